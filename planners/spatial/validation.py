"""Check a motion in space exactly, independently of every planner.

At the poses exact signed distances of links to boxes decide (`checks.boxes`): a link may touch an obstacle,
and no more. Its depth in a box is the shortest translation that parts the two, plus the link radius.

Between poses a bound decides, not samples. Feed and joint angles change linearly there, and all is smooth:

1. `checks.turning` bounds the third derivative x''' of the place of each joint. A parabola through its places
   at both poses and half way is at most max |x'''| * sqrt(3) / 216 from it, and leaves its chord by as much
   as it does half way. So the joint is never farther than e, the sum of the two, from a point that moves
   evenly along the straight line between its two places, and no point of a link is farther than the larger e
   of its joints from that of a segment whose ends move so.
2. `checks.boxes.moving_gaps` bounds the signed distance g of that segment to a box from below: by planes that
   stand still, or go along with the segment. So does every single direction; the one in which box and link
   are farthest apart half way is tried too.
3. The link is then at most e + radius - g deep in the box.

Where that is not enough the time is halved and both halves are tried, to a limit: then e gets smaller by at
least the square of the time in the end, and g gets to the distance. Distances between links are bounded
likewise (`checks.crossing`).

What of the arm is in the workspace: joints behind the base are put at the base point, so that a link which
comes out of the feeder is checked from there on and links wholly in the feeder are not checked. A joint is
behind the base while the feed is less than the length of arm from it to the tip. The round end of a thick
link about the base point counts, even the half of it behind the base: `Workspace.check_arm` asks for at least
as much room there.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING, STEP_LIMIT
from planners.problem import Progress, ValidationReport
from planners.spatial.checks.arm_alone import (
    check_consistency,
    check_feeder,
    check_goal,
    check_joint_limit,
    check_lengths,
    check_start,
    check_steps,
)
from planners.spatial.checks.between import check_between
from planners.spatial.checks.crossing import check_crossing
from planners.spatial.checks.scene import Scene
from planners.spatial.checks.walls import check_poses, nearest_of_each
from planners.spatial.problem import SpatialMotion
from planners.spatial.workspace import Workspace

__all__ = ["PINCH_TOLERANCE", "STEP_LIMIT", "signed_distances", "validate"]


def validate(
    motion: SpatialMotion, workspace: Workspace, arm: ArmSpec | None = None, progress: Progress | None = None
) -> ValidationReport:
    """Check everything that makes a motion a solution.

    Parameters
    ----------
    motion : SpatialMotion
        From the base of this workspace.
    workspace : Workspace
        With the exact obstacles.
    arm : ArmSpec, optional
        Gives link radius and joint limit. By default the arm that the motion was made for.
    progress : callable, optional
        Called with "validate" and the share that is done.

    Returns
    -------
    report : ValidationReport
        With at most one fault of each kind, the worst (of crossings, the first). Kinds are those of
        `planners.validation.FAULTS` but for "release". A fault's `amount` is the figure that was too large
        (for a crossing: the distance that was too small).

    Raises
    ------
    InputError
        If the motion belongs to another workspace or another arm.
    """
    arm = motion.arm if arm is None else arm
    _check_arm(motion, arm)
    motion.check_workspace(workspace)
    tell = progress if progress is not None else lambda stage, share: None
    scene = Scene(motion=motion, workspace=workspace, radius=arm.link_radius)
    length_error, length = check_lengths(scene)
    largest_step, step = check_steps(scene)
    goal_distance, goal = check_goal(scene)
    clearance, penetration, deep = check_poses(scene, tell)
    between, sweep = check_between(scene, deep, tell)
    depth = 0.0 if penetration is None else penetration.amount
    found = [
        length,
        check_consistency(scene),
        check_feeder(scene),
        check_start(scene),
        goal,
        step,
        penetration,
        sweep,
        check_crossing(scene, tell),
        check_joint_limit(scene, arm.joint_limit),
    ]
    tell("validate", 1.0)
    return ValidationReport(
        faults=tuple(fault for fault in found if fault is not None),
        clearance=clearance,
        penetration=depth,
        penetration_between=max(between, depth),
        largest_step=largest_step,
        length_error=length_error,
        goal_distance=goal_distance,
    )


def signed_distances(
    joints: ArrayLike, workspace: Workspace, base_pose: ArrayLike, radius: float = 0.0
) -> FloatArray:
    """Compute the signed distance of every link at every pose to the nearest obstacle.

    Exact. Negative is the depth in the obstacle in which the link is deepest: the shortest translation that
    gets it out, plus the radius. Joints behind the base are put at the base point, as in `validate`.

    Parameters
    ----------
    joints : array-like, shape (n_poses, n_links + 1, 3)
        Base end first, tip last, in workspace units; the rearmost joint on the feeder's axis.
    workspace : Workspace
        With the obstacles.
    base_pose : array-like, shape (6,)
        Position and unit heading of the base of this arm (`Workspace.base_pose_for`).
    radius : float
        Of the links, in workspace units.

    Returns
    -------
    distances : array, shape (n_poses, n_links)
        In workspace units; infinite for links wholly in the feeder, and without obstacles.
    """
    places, base = np.asarray(joints, dtype=np.float64), np.asarray(base_pose, dtype=np.float64)
    if places.ndim != 3 or places.shape[1] < 2 or places.shape[2] != 3:
        raise InputError(f"Expected joints with shape (n_poses, n_links + 1, 3), got {places.shape}.")
    if base.shape != (6,):
        raise InputError(f"Expected base_pose with shape (6,), got {base.shape}.")
    length = np.linalg.norm(places[:, 1] - places[:, 0], axis=1)[:, None]
    rear = ((places[:, 0] - base[:3]) @ base[3:])[:, None]
    arc = rear + length * np.arange(places.shape[1])
    places = np.where(arc[..., None] < 0.0, base[:3], places)
    distances = np.full((len(places), places.shape[1] - 1), np.inf)
    out = arc[:, 1:] > ROUNDING * length
    distances[out] = nearest_of_each(places[:, :-1][out], places[:, 1:][out], workspace.obstacles) - radius
    return distances


def _check_arm(motion: SpatialMotion, arm: ArmSpec) -> None:
    if not math.isclose(arm.link_length, motion.link_length, rel_tol=ROUNDING):
        raise InputError(
            f"Expected a motion of links of length {arm.link_length:g}, got one of {motion.link_length:g}."
        )
    if arm.n_links is not None and arm.n_links != motion.n_links:
        raise InputError(f"Expected a motion of {arm.n_links} links, got one of {motion.n_links}.")
