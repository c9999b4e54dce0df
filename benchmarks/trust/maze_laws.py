"""What must hold of every maze, arm and motion; each law raises `Broken` where it does not.

The campaign and the tests check these same functions.
"""

from __future__ import annotations

import dataclasses
import math
import time

import numpy as np

from benchmarks.trust.maze_draws import Case, Similarity
from hrsnake_env.maze import Maze
from planners.planning import PLANNERS, plan
from planners.problem import Motion, PlanningResult, PlanningStatus
from planners.validation import validate

__all__ = [
    "AS_MANY_LINKS",
    "LAWS",
    "MAY_DIFFER",
    "Broken",
    "cut_short",
    "digit_by_digit",
    "on_time",
    "replace_maze",
    "says_why",
    "stays_valid",
    "still_solved",
    "timed_plan",
    "valid_when_cut",
    "valid_when_moved",
    "valid_when_reversed",
    "valid_when_saved",
]

LAWS = {
    "exception": "no planner raises on a valid maze",
    "saved": "a returned motion, saved and loaded, is valid",
    "reason": "without a motion the result says why, and where",
    "time": "planning ends in time, counted in seconds of the processor",
    "moved motion": "a motion is valid in the maze that is moved, turned, mirrored and scaled with it",
    "scaled plan": "scaled by a power of two, a maze has the same plan digit by digit (thick links: 1e-9)",
    "moved plan": "planning in the moved maze ends the same way",
    "wall order": "planning ends the same way where walls are listed in another order",
    "far walls": "walls that no arm can reach change nothing",
    "reversed": "a motion backward has the faults of its ends alone",
    "cut": "a motion that is cut short has the fault of its end alone",
}
"""What is checked, by name."""

MAY_DIFFER = ("moved plan", "wall order")
"""Laws that hold up to rounding, and up to the potential's grid, which is along x and y: where there are
several ways, another one may be found, or none. These are counted as other answers, not as faults."""

AS_MANY_LINKS = 1
"""Links that the same motion in a moved maze may take more or less."""

ROUNDING = 1e-9
"""Link lengths by which the plan of thick links may differ in a maze scaled by a power of two."""

LATE = 1.0
"""Seconds of the processor that planning may take longer than its budget."""


class Broken(AssertionError):
    """Raised where a law does not hold."""


def timed_plan(case: Case, planner: str, time_budget: float) -> tuple[PlanningResult, float]:
    """Plan, and say how many seconds of the processor it took: others may use the machine as well."""
    start = time.process_time()
    result = plan(case.maze, case.arm, planner, time_budget=time_budget, explain=False)
    return result, time.process_time() - start


def on_time(seconds: float, time_budget: float, what: str = "planning") -> None:
    """Check how many seconds of the processor planning took."""
    if seconds > time_budget + LATE:
        raise Broken(f"{what}: {seconds:.1f} s of the processor with a budget of {time_budget:g} s")


def says_why(case: Case, planner: str, result: PlanningResult) -> None:
    """Check that a result has a valid motion, or a status, a reason and a place."""
    what = f"{planner}: {result.status}"
    if result.solved != (result.motion is not None):
        raise Broken(f"{what}, with the motion {result.motion}")
    if planner != "auto" and result.planner != planner:
        raise Broken(f"{what}, of the planner {result.planner}")
    if not result.attempts or result.planner not in PLANNERS:
        raise Broken(f"{what}, with the attempts {result.attempts}")
    if result.solved:
        if result.reason or result.failure is not None or not result.report.valid:
            raise Broken(f"{what}, with the reason {result.reason!r} and the report {result.report}")
        return
    place, failure = result.place, result.failure
    if not (result.reason.endswith(".") and result.reason[0].isupper() and len(result.reason) > 20):
        raise Broken(f"{what}, with the reason {result.reason!r}")
    if "nan" in result.reason or place is None or not np.isfinite(place).all():
        raise Broken(f"{what}, at the place {place}, with the reason {result.reason!r}")
    if failure.wall is not None and not 0 <= failure.wall < len(case.maze.walls):
        raise Broken(f"{what}, at the wall {failure.wall} of {len(case.maze.walls)}")
    if failure.depth is not None and not 0.0 <= failure.depth < math.inf:
        raise Broken(f"{what}, at the depth {failure.depth}")


def valid_when_saved(case: Case, motion: Motion, path) -> None:
    """Check a motion from its file."""
    motion.save(path)
    stays_valid(Motion.load(path), case.maze, case, "saved and loaded")


def valid_when_moved(case: Case, motion: Motion, similarity: Similarity) -> None:
    """Check a motion that is moved together with its maze and arm."""
    moved = similarity.case(case)
    stays_valid(similarity.motion(motion), moved.maze, moved, f"moved by {similarity}")


def valid_when_reversed(case: Case, motion: Motion) -> None:
    """Check a motion from its end to its begin: only its ends are not where they should be."""
    backward = Motion(
        joints=motion.joints[::-1],
        joint_angles=motion.joint_angles[::-1],
        feed=motion.feed[::-1],
        link_length=motion.link_length,
        base_pose=motion.base_pose,
    )
    stays_valid(backward, case.maze, case, "reversed", but={"start", "goal"})


def cut_short(motion: Motion, n_poses: int) -> Motion:
    """Return the first poses of a motion."""
    return Motion(
        joints=motion.joints[:n_poses],
        joint_angles=motion.joint_angles[:n_poses],
        feed=motion.feed[:n_poses],
        link_length=motion.link_length,
        base_pose=motion.base_pose,
    )


def valid_when_cut(case: Case, motion: Motion, n_poses: int) -> None:
    """Check the first poses of a motion."""
    stays_valid(cut_short(motion, n_poses), case.maze, case, f"cut to {n_poses} poses", but={"goal"})


def stays_valid(motion: Motion, maze: Maze, case: Case, what: str, but=frozenset()) -> None:
    """Check that a motion has no faults but those."""
    faults = [fault for fault in validate(motion, maze, case.arm).faults if fault.kind not in but]
    if faults:
        raise Broken(f"{what}: {faults[0].kind}: {faults[0].message}")


def replace_maze(case: Case, maze: Maze) -> Case:
    """Return a case with another maze."""
    return dataclasses.replace(case, maze=maze)


def digit_by_digit(case: Case, result: PlanningResult, again: PlanningResult, similarity: Similarity) -> None:
    """Check that planning in a maze that is scaled by a power of two has found the scaled motion exactly.

    Walls are grown by the radius of the links in another library, which rounds otherwise at another scale.
    """
    if PlanningStatus.OUT_OF_TIME in (result.status, again.status):
        return
    if result.status is not again.status:
        raise Broken(f"{similarity}: {result.status} has become {again.status}: {again.reason}")
    if not result.solved:
        return
    scaled, joints = similarity.motion(result.motion).joints, again.motion.joints
    allowed = ROUNDING * again.motion.link_length if case.arm.link_radius > 0.0 else 0.0
    if scaled.shape != joints.shape or np.abs(scaled - joints).max() > allowed:
        raise Broken(f"{similarity}: {result.motion} has become {again.motion}")


def still_solved(result: PlanningResult, again: PlanningResult, what: str) -> None:
    """Check that planning has ended the same way, unless time was over."""
    statuses = {result.status, again.status}
    if PlanningStatus.OUT_OF_TIME in statuses:
        return
    if result.solved != again.solved:
        raise Broken(f"{what}: {result.status} has become {again.status}: {result.reason}{again.reason}")
    if result.solved and abs(result.motion.n_links - again.motion.n_links) > AS_MANY_LINKS:
        raise Broken(f"{what}: {result.motion.n_links} links have become {again.motion.n_links}")
