"""plan(): from a maze and an arm to a validated motion, or to the reason why there is none."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator

import numpy as np

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.afar import moved_report, moved_result, seen_from_base
from planners.baselines import BASELINES
from planners.beam_planner import plan_as_printed, plan_beam
from planners.checking import Checker, Late
from planners.clock import now
from planners.obstruction import wall_nearest_to
from planners.portfolio import Question, first_questions, further_questions
from planners.problem import (
    Attempt,
    Candidate,
    Failure,
    Motion,
    PlanningResult,
    PlanningStatus,
    Progress,
    ValidationReport,
)
from planners.query import Query
from planners.rod_bound import Passage, rod_passes
from planners.room import TooLarge
from planners.sweep_planner import longest_past, plan_sweep
from planners.track_planner import plan_track
from planners.validation import validate

__all__ = ["PLANNERS", "TIME_BUDGET", "plan"]

PLANNERS: dict[str, Callable[[Query], Candidate]] = {
    "beam": plan_beam,
    "as-printed": plan_as_printed,
    "sweep": plan_sweep,
    "track": plan_track,
    **BASELINES,  # to compare with; `auto` does not ask them
}
"""All planners by name."""

ROD = 1e-3
"""How finely, in link lengths, it is decided whether a rod passes."""

SHORTEST = 1e-3
"""Shortest links that are planned for, in sizes of the maze: an arm of more has no place in memory."""

TIME_BUDGET = 60.0
"""Seconds that planning may take by default."""


def plan(
    maze: Maze,
    arm: ArmSpec,
    planner: str = "auto",
    *,
    time_budget: float = TIME_BUDGET,
    warm_start: Motion | None = None,
    seed: int = 0,
    explain: bool = True,
    progress: Progress | None = None,
) -> PlanningResult:
    """Plan a motion of the whole arm from the feeder to the goal, and validate it.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        The arm. With `n_links` None it gets as many links as the motion needs.
    planner : str
        `auto` or a key of `PLANNERS`. `auto` tries the track, then the sweep and the others, then other ways
        round the obstacles.
    time_budget : float
        In s. What is found by then is returned; the outcome depends on it only if it runs out.
    warm_start : Motion, optional
        A motion of links of this length in a similar maze (the goal or a wall has moved): planning starts
        from it, which takes milliseconds where the change is small.
    seed : int
        Of planners that draw random numbers; not negative.
    explain : bool
        Without a plan, find out what is in the way, and the longest link that would pass there.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    result : PlanningResult
        Its motion is not None if and only if it has passed the exact checker.

    Raises
    ------
    InputError
        If the planner is unknown, the arm does not fit the feeder, the warm start belongs to another base or
        link length, or the arm has fewer links than the motion needs.

    Examples
    --------
    >>> result = plan(Maze.load("fig19"), ArmSpec(link_length=430.0))
    >>> result.status, result.motion.n_links
    (<PlanningStatus.SOLVED: 'solved'>, 6)
    """
    if planner != "auto" and planner not in PLANNERS:
        raise InputError(f"Unknown planner {planner!r}. Available: auto, {', '.join(PLANNERS)}.")
    if not is_number(time_budget) or not time_budget > 0.0:
        raise InputError(f"Expected a positive time_budget in seconds, got {time_budget!r}.")
    if not (isinstance(seed, int | np.integer) and seed >= 0):
        raise InputError(f"Expected a whole seed of at least 0, got {seed!r}.")
    maze.check_arm(arm)
    if arm.link_length < SHORTEST * maze.size:
        raise InputError(
            f"Expected links of at least {SHORTEST * maze.size:g} {maze.units}, a thousandth of the size "
            f"of maze '{maze.name}', got {arm.link_length:g}."
        )
    if warm_start is not None:
        _check_warm_start(warm_start, maze, arm)
    deadline = now() + time_budget
    bare = dataclasses.replace(arm, n_links=None)  # planners give as many links as the motion needs
    seen, origin = seen_from_base(maze, arm.link_length)
    if warm_start is not None and origin is not None:
        warm_start = warm_start.moved(-origin)
    checker = Checker[Motion](
        lambda motion, tell: _checked(motion, maze, bare, tell, origin), deadline, progress
    )
    query = Query(
        maze=seen,
        arm=arm,
        deadline=deadline,
        seed=int(seed),
        checker=checker,
        refused=checker.refused,
        progress=progress,
    )
    result = _asked(query, planner, checker, warm_start, explain=explain)
    return result if origin is None else moved_result(result, origin)


def _checked(
    motion: Motion, maze: Maze, arm: ArmSpec, tell: Progress, origin: FloatArray | None
) -> ValidationReport:
    """Check a motion in the maze as it is, wherever planners see it from."""
    if origin is None:
        return validate(motion, maze, arm, tell)
    return moved_report(validate(motion.moved(origin), maze, arm, tell), -origin)


def _asked(
    query: Query, planner: str, checker: Checker[Motion], warm_start: Motion | None, *, explain: bool
) -> PlanningResult:
    """Ask one planner or, as `auto`, one after the other."""
    maze, arm = query.maze, query.arm
    hearing, proof = _Hearing(checker), ""
    if planner != "auto":
        own = Question(planner, 0, dataclasses.replace(query, warm_start=warm_start))
        result = hearing.first_solved(iter([own]))
    else:
        result = hearing.first_solved(first_questions(query, warm_start))
        if result is None and hearing.shortage is None and not query.late and query.geometry is not None:
            rod = rod_passes(maze, arm.link_length, arm.link_radius, resolution=ROD, deadline=query.deadline)
            if rod.passes is Passage.NO:
                proof = f"No rod of {arm.link_length:g} {maze.units} passes: this is proved."
            else:
                result = hearing.first_solved(further_questions(query, rod.path))
        hearing.late = query.late and not proof
    if result is not None:
        return result
    if hearing.shortage is not None:
        raise hearing.shortage
    failure = hearing.failure(proof)
    return _explained(failure, query) if explain else failure


class _Hearing:
    """Ask planners one after the other, and keep the record."""

    def __init__(self, checker: Checker[Motion]) -> None:
        self.checker = checker
        self.attempts: list[Attempt] = []
        self.failures: list[PlanningResult] = []
        self.shortage: InputError | None = None
        self.late = False

    def first_solved(self, questions: Iterator[Question]) -> PlanningResult | None:
        """Return the first valid answer."""
        for question in questions:
            start = now()
            try:
                result = _answer(question, self.checker)
            except InputError as error:  # another planner may need fewer links
                self.shortage = self.shortage or error
                continue
            seconds = now() - start
            self.attempts.append(
                Attempt(planner=question.planner, route=question.route, status=result.status, seconds=seconds)
            )
            if result.solved:
                return dataclasses.replace(result, attempts=tuple(self.attempts))
            if question.route == 0:
                self.failures.append(result)
            if question.query.late:
                break
        return None

    def failure(self, proof: str = "") -> PlanningResult:
        """Return the failure that says best what is in the way: the link that is least deep in a wall.

        With a `proof`, that no planner can have a motion.
        """
        result = min(self.failures, key=_depth)
        late = self.late or any(attempt.status is PlanningStatus.OUT_OF_TIME for attempt in self.attempts)
        if proof:
            result = dataclasses.replace(
                result, status=PlanningStatus.IMPOSSIBLE, reason=f"{proof} {result.reason}"
            )
        elif late and result.status is not PlanningStatus.OUT_OF_TIME:
            result = dataclasses.replace(
                result,
                status=PlanningStatus.OUT_OF_TIME,
                reason=f"Time was over before everything was tried. {result.reason}",
            )
        return dataclasses.replace(result, attempts=tuple(self.attempts))


def _depth(result: PlanningResult) -> float:
    depth = None if result.failure is None else result.failure.depth
    return math.inf if depth is None else depth


def _answer(question: Question, checker: Checker[Motion]) -> PlanningResult:
    """Ask one planner, and the checker about its motion."""
    name, _, query = question
    checker.seconds, checker.asked = 0.0, None
    try:
        candidate = PLANNERS[name](query)
        if candidate.motion is None:
            return PlanningResult(
                status=candidate.status,
                planner=name,
                reason=candidate.reason,
                failure=candidate.failure,
                timings=candidate.timings,
            )
        motion = _with_wanted_links(candidate.motion, query.maze, query.arm).of_arm(query.arm)
        report = checker(motion)
    except Late:
        return PlanningResult(
            status=PlanningStatus.OUT_OF_TIME,
            planner=name,
            reason="Time was over before the exact check of a motion was.",
            failure=None if checker.asked is None else Failure(place=_end_of(checker.asked)),
        )
    except TooLarge as error:
        return PlanningResult(
            status=PlanningStatus.DEAD_END,
            planner=name,
            reason=str(error),
            failure=Failure(place=error.place),
        )
    timings = {**candidate.timings, "validate": checker.seconds}
    if report.valid:
        return PlanningResult(
            status=PlanningStatus.SOLVED, planner=name, motion=motion, report=report, timings=timings
        )
    fault = report.faults[0]
    return PlanningResult(
        status=PlanningStatus.NOT_VALID,
        planner=name,
        reason=f"The exact check refused the motion: {fault.message}",
        failure=None
        if fault.place is None
        else Failure(
            place=fault.place,
            link=None if fault.link is None else motion.n_links - 1 - fault.link,
            wall=wall_nearest_to(query.maze, fault.place),
            depth=fault.amount if fault.kind in ("penetration", "sweep") else None,
            joints=motion.joints[fault.pose],
        ),
        report=report,
        timings=timings,
    )


def _end_of(motion: Motion) -> tuple[float, float]:
    x, y = motion.joints[-1, -1]
    return float(x), float(y)


def _explained(result: PlanningResult, query: Query) -> PlanningResult:
    """Add the longest link that would pass where planning ended."""
    failure, geometry = result.failure, query.geometry
    if failure is None or geometry is None or query.late:
        return result
    s = failure.path_position
    if s is None:
        s = float(geometry.path.s[np.argmin(np.hypot(*(geometry.path.points - failure.place).T))])
        failure = dataclasses.replace(failure, path_position=s)
    return dataclasses.replace(
        result,
        failure=failure,
        longest_there=longest_past(query, min(s + query.arm.link_length, geometry.path.length)),
    )


def _check_warm_start(motion: Motion, maze: Maze, arm: ArmSpec) -> None:
    motion.check_maze(maze)
    if not math.isclose(motion.link_length, arm.link_length, rel_tol=1e-9):
        raise InputError(
            f"Expected a warm start with links of {arm.link_length:g} {maze.units}, got one with links of "
            f"{motion.link_length:g}."
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
