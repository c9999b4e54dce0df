"""Check a motion exactly, independently of every planner.

At the poses the exact polygons decide: a link may touch a wall, and no more. Between poses a bound decides,
not samples. Feed and joint angles change linearly there, so link headings do, and joint k stays within
``e_k = L / 8 * sum_{j < k} (change of heading j)^2`` of a point that moves evenly along the straight line
between its two places (a curve leaves its chord by at most an eighth of its largest second derivative). So a
link stays within e of its tip-side joint of a segment whose ends move straight and evenly.

Three things are tried, from the cheap to the exact. Each is a proof; what one leaves open goes to the next:

1. Reach (`checks.sieve`). A link that over many poses gets no farther from its place than the walls, or
   another link, are away from it there is free of them at all these poses and between.
2. Gaps (`checks.gaps`). Where at any moment the line of each wall, or that of the moving segment, parts the
   two by g, and a point of the segment is in the free space, the link is at most e - g deep, plus its radius.
3. Polygons. At the poses `covers` and `distance` decide. Between poses a link stays inside the convex hull of
   its two placements, grown by e: where that hull is covered by the free space grown by g, the link is
   nowhere deeper than g + e.

Where neither gap nor hull is enough, the piece is halved, in time if e is what makes it too coarse, along the
link if the turning of the link does (the hull of a link that pivots is wide away from the pivot), and both
halves are tried, to a limit.

Two rules say what of the arm is in the maze:

- Joints behind the base are put at the base point, so that a link which comes out of the feeder is checked
  from there on and links wholly in the feeder are not checked. A joint is behind the base while the feed is
  less than the length of arm from it to the tip; the maze itself may well reach behind the base.
- The feeder comes through a wall that may be nearer than the link radius. For links of a positive radius,
  walls behind the base (in the half-plane against its heading) therefore count only once the link's base-side
  joint is a radius past the base: then nothing of a link that points forward is behind it. Until then, and to
  the end of the piece of motion in which it gets there, only its centre line may not leave the free space.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.checks.arm_alone import (
    check_consistency,
    check_feeder,
    check_goal,
    check_joint_limit,
    check_lengths,
    check_release,
    check_start,
    check_steps,
)
from planners.checks.between import check_between
from planners.checks.crossing import check_crossing
from planners.checks.scene import Scene
from planners.checks.sieve import sift
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING, STEP_LIMIT
from planners.checks.walls import check_poses
from planners.problem import Motion, Progress, ValidationReport

__all__ = ["FAULTS", "PINCH_TOLERANCE", "STEP_LIMIT", "validate"]

FAULTS: Mapping[str, str] = MappingProxyType(
    {
        "length": "a link has another length than the arm's",
        "inconsistent": "the joint positions are not those of feed and joint angles",
        "feeder": "the feed is beyond the arm, or a link leaves the feeder's axis before its base-side joint "
        "has passed the base",
        "release": "a joint just past the base bends faster than the feeder lets go of it",
        "start": "the first pose is not the whole arm in the feeder with the tip at the base",
        "goal": "the last pose does not have the tip inside the goal radius",
        "step": "a joint moves too far between two poses",
        "penetration": "a link is in a wall at a pose",
        "sweep": "a link is in a wall between two poses, or may be",
        "crossing": "the arm crosses or touches itself, or may do so between two poses",
        "joint limit": "a joint angle is larger than the arm's joint limit",
    }
)
"""What each kind of fault means."""


def validate(
    motion: Motion, maze: Maze, arm: ArmSpec | None = None, progress: Progress | None = None
) -> ValidationReport:
    """Check everything that makes a motion a solution.

    Parameters
    ----------
    motion : Motion
        From the base of this maze.
    maze : Maze
        With the exact walls.
    arm : ArmSpec, optional
        Gives link radius and joint limit. By default the arm that the motion was made for.
    progress : callable, optional
        Called with "validate" and the share that is done.

    Returns
    -------
    report : ValidationReport
        With at most one fault of each kind, the worst (of crossings, the first). A fault's `amount` is the
        figure that was too large (for a crossing: the distance that was too small).

    Raises
    ------
    InputError
        If the motion belongs to another maze or another arm.
    """
    arm = motion.arm if arm is None else arm
    _check_arm(motion, arm)
    motion.check_maze(maze)
    tell = progress if progress is not None else lambda stage, share: None
    scene = Scene(motion=motion, maze=maze, radius=arm.link_radius)
    tell("validate", 0.0)  # a progress that raises ends the check: it is told between what takes long
    length_error, length = check_lengths(scene)
    tell("validate", 0.0)
    largest_step, step = check_steps(scene)
    tell("validate", 0.0)
    goal_distance, goal = check_goal(scene)
    sifted = sift(scene, tell)
    clearance, penetration, deep = check_poses(scene, sifted.doubtful(scene), tell)
    between, sweep = check_between(scene, sifted.open_steps, deep, tell)
    depth = 0.0 if penetration is None else penetration.amount
    found = [
        length,
        check_consistency(scene, sifted.astray),
        check_feeder(scene),
        check_release(scene),
        check_start(scene),
        goal,
        step,
        penetration,
        sweep,
    ]
    found += [
        check_crossing(scene, np.concatenate(sifted.pairs), tell),
        check_joint_limit(scene, arm.joint_limit),
    ]
    tell("validate", 1.0)
    return ValidationReport(
        faults=tuple(fault for fault in found if fault is not None),
        clearance=clearance,
        penetration=depth,
        penetration_between=max(between, depth, sifted.bound),
        largest_step=largest_step,
        length_error=length_error,
        goal_distance=goal_distance,
    )


def _check_arm(motion: Motion, arm: ArmSpec) -> None:
    if not math.isclose(arm.link_length, motion.link_length, rel_tol=ROUNDING):
        raise InputError(
            f"Expected a motion of links of length {arm.link_length:g}, got one of {motion.link_length:g}."
        )
    if arm.n_links is not None and arm.n_links != motion.n_links:
        raise InputError(f"Expected a motion of {arm.n_links} links, got one of {motion.n_links}.")
