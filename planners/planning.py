"""plan(): from a maze and an arm to a validated motion, or to the reason why there is none."""

from __future__ import annotations

import time
from collections.abc import Callable

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.beam_planner import plan_beam
from planners.problem import Candidate, Failure, Motion, PlanningResult, PlanningStatus, Progress
from planners.query import Query
from planners.sweep_planner import plan_sweep
from planners.validation import validate

__all__ = ["PLANNERS", "plan"]

PLANNERS: dict[str, Callable[[Query], Candidate]] = {
    "beam": plan_beam,
    "sweep": plan_sweep,
}
"""All planners by name."""

AUTO = ("sweep", "beam")
"""The planners that `auto` tries, in this order, until one has a motion that passes the checker."""


def plan(
    maze: Maze, arm: ArmSpec, planner: str = "auto", *, progress: Progress | None = None
) -> PlanningResult:
    """Plan a motion of the whole arm from the feeder to the goal, and validate it.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        The arm. With `n_links` None it gets as many links as the motion needs.
    planner : str
        `auto` or a key of `PLANNERS`.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    result : PlanningResult
        Its motion is not None if and only if it has passed the exact checker.

    Raises
    ------
    InputError
        If the planner is unknown, the arm does not fit the feeder, or has fewer links than the motion needs.

    Examples
    --------
    >>> result = plan(Maze.load("fig19"), ArmSpec(link_length=430.0))
    >>> result.status, result.motion.n_links
    (<PlanningStatus.SOLVED: 'solved'>, 7)
    """
    if planner != "auto" and planner not in PLANNERS:
        raise InputError(f"Unknown planner {planner!r}. Available: auto, {', '.join(PLANNERS)}.")
    maze.check_arm(arm)
    failures: list[PlanningResult] = []
    shortage: InputError | None = None
    for name in AUTO if planner == "auto" else (planner,):
        try:
            result = _plan_with(name, maze, arm, progress)
        except InputError as error:  # another planner may need fewer links
            shortage = shortage or error
            continue
        if result.solved:
            return result
        failures.append(result)
    if shortage is not None:
        raise shortage
    return failures[0]


def _plan_with(name: str, maze: Maze, arm: ArmSpec, progress: Progress | None) -> PlanningResult:
    candidate = PLANNERS[name](Query(maze=maze, arm=arm, progress=progress))
    if candidate.motion is None:
        return PlanningResult(
            status=candidate.status,
            planner=name,
            reason=candidate.reason,
            failure=candidate.failure,
            timings=candidate.timings,
        )
    motion = _with_wanted_links(candidate.motion, maze, arm)
    start = time.perf_counter()
    report = validate(motion, maze, arm, progress)
    timings = {**candidate.timings, "validate": time.perf_counter() - start}
    if report.valid:
        return PlanningResult(
            status=PlanningStatus.SOLVED, planner=name, motion=motion, report=report, timings=timings
        )
    fault = report.faults[0]
    return PlanningResult(
        status=PlanningStatus.NOT_VALID,
        planner=name,
        reason=f"The exact check refused the motion: {fault.message}",
        failure=None if fault.place is None else Failure(place=fault.place),
        report=report,
        timings=timings,
    )


def _with_wanted_links(motion: Motion, maze: Maze, arm: ArmSpec) -> Motion:
    if arm.n_links is None:
        return motion
    if arm.n_links < motion.n_links:
        raise InputError(
            f"Expected at least {motion.n_links} links of {arm.link_length:g} {maze.units} to reach the goal "
            f"of maze '{maze.name}', got {arm.n_links}."
        )
    return motion.with_links(arm.n_links)
