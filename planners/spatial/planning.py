"""plan(): from a workspace and an arm to a validated motion in space, or to the reason why there is none."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from planners.checking import Checker, Late
from planners.clock import now
from planners.problem import Attempt, Failure, PlanningStatus, Progress
from planners.spatial.causal_planner import plan_causal
from planners.spatial.following import plan_following
from planners.spatial.problem import SpatialCandidate, SpatialMotion, SpatialResult
from planners.spatial.query import SpatialQuery
from planners.spatial.track_planner import plan_track
from planners.spatial.validation import validate
from planners.spatial.workspace import Workspace

__all__ = ["AUTO", "PLANNERS", "TIME_BUDGET", "check_planner", "check_time_budget", "plan"]

PLANNERS: dict[str, Callable[[SpatialQuery], SpatialCandidate]] = {
    "track": plan_track,
    "causal": plan_causal,
    "follow": plan_following,
}
"""All spatial planners by name."""

AUTO = ("track", "causal")
"""Whom `auto` asks, in turn: what is missed by shaping a track as a whole may be found by growing it."""

TIME_BUDGET = 60.0
"""Seconds that planning may take by default."""


def plan(
    workspace: Workspace,
    arm: ArmSpec,
    planner: str = "auto",
    *,
    time_budget: float = TIME_BUDGET,
    warm_start: SpatialResult | None = None,
    progress: Progress | None = None,
) -> SpatialResult:
    """Plan a motion of the whole arm from the feeder to the goal, and validate it.

    Parameters
    ----------
    workspace : Workspace
        The workspace.
    arm : ArmSpec
        The arm, in workspace units. With `n_links` None it gets as many links as the motion needs.
    planner : str
        A key of `PLANNERS`, or `auto`, which asks the track and then the causal planner.
    time_budget : float
        In s. The outcome depends on it only if it runs out.
    warm_start : SpatialResult, optional
        A solution in this workspace with links of another length: the track starts from its own.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    result : SpatialResult
        Its motion is not None if and only if it has passed the exact checker.

    Raises
    ------
    InputError
        If the planner is unknown, the arm does not fit the feeder, or has fewer links than the motion needs,
        or the warm start is from another base or does not end at the goal.

    Notes
    -----
    Planners see the workspace from its base, where coordinates are small: far from the origin, rounding would
    be as large as what they look at. The motion is checked where it belongs.

    Examples
    --------
    >>> from planners.spatial import load_workspace
    >>> result = plan(load_workspace("paired-panels"), ArmSpec(link_length=90.0))
    >>> result.status, result.motion.n_links
    (<PlanningStatus.SOLVED: 'solved'>, 15)
    """
    check_planner(planner)
    check_time_budget(time_budget)
    workspace.check_arm(arm)
    deadline = now() + time_budget
    bare = dataclasses.replace(arm, n_links=None)  # planners give as many links as the motion needs
    seen, origin = _from_base(workspace)
    checker = Checker[SpatialMotion](
        lambda motion, tell: validate(motion.moved(origin), workspace, bare, tell), deadline, progress
    )
    query = SpatialQuery(
        workspace=seen,
        arm=arm,
        deadline=deadline,
        check=checker,
        origin=origin,
        warm_start=_warm(warm_start, workspace, origin),
        progress=progress,
    )
    attempts: list[Attempt] = []
    first: SpatialResult | None = None
    for name in AUTO if planner == "auto" else (planner,):
        begin, checker.seconds = now(), 0.0
        result = _answer(name, query, checker)
        seconds = now() - begin
        attempts.append(Attempt(planner=name, route=0, status=result.status, seconds=seconds))
        timings = {**query.timings, "validate": checker.seconds}
        first = first or dataclasses.replace(result, timings=timings)
        if result.solved:
            first = dataclasses.replace(result, timings=timings)
        if result.solved or query.late or result.status is PlanningStatus.NO_PATH:
            break
        query.timings = {
            stage: query.timings[stage] for stage in ("potential", "path") if stage in query.timings
        }
    assert first is not None
    path = None if warm_start is not None or query.path is None else query.path.points + origin
    return dataclasses.replace(first, attempts=tuple(attempts), path=path)


def check_planner(planner: str) -> None:
    """Raise InputError if there is no such planner."""
    if planner != "auto" and planner not in PLANNERS:
        raise InputError(f"Unknown planner {planner!r}. Available: auto, {', '.join(PLANNERS)}.")


def check_time_budget(time_budget: float) -> None:
    """Raise InputError if a time budget is no positive number of seconds."""
    if not is_number(time_budget) or not time_budget > 0.0:
        raise InputError(f"Expected a positive time_budget in seconds, got {time_budget!r}.")


def _from_base(workspace: Workspace) -> tuple[Workspace, FloatArray]:
    """Return the workspace as seen from its base, and the base; itself where rounding makes another of it."""
    try:
        return workspace.moved(-workspace.base), workspace.base
    except InputError:
        return workspace, np.zeros(3)


def _warm(
    result: SpatialResult | None, workspace: Workspace, origin: FloatArray
) -> tuple[FloatArray, float] | None:
    if result is None:
        return None
    if result.motion is None or result.track is None:
        raise InputError("Expected a warm start with a motion and its track, got a result without.")
    result.motion.check_workspace(workspace)
    away = float(np.linalg.norm(result.track[-1] - workspace.goal))
    if away > workspace.goal_radius:
        raise InputError(
            f"Expected a warm start that ends within {workspace.goal_radius:g} {workspace.units} of the goal "
            f"of workspace '{workspace.name}', got one that ends {away:g} from it: it belongs to another "
            f"workspace."
        )
    return result.track - origin, result.motion.link_length


def _answer(name: str, query: SpatialQuery, checker: Checker[SpatialMotion]) -> SpatialResult:
    """Ask a planner, and the checker about its motion."""
    checker.asked = None
    try:
        candidate = PLANNERS[name](query)
        if candidate.motion is None:
            return SpatialResult(
                status=candidate.status,
                planner=name,
                reason=candidate.reason,
                failure=_moved_failure(candidate.failure, query.origin),
                track=_moved_track(candidate.track, query.origin),
            )
        motion = _with_wanted_links(candidate.motion, query).of_arm(query.arm)
        report = checker(motion)
    except Late:
        return SpatialResult(
            status=PlanningStatus.OUT_OF_TIME,
            planner=name,
            reason="Time was over before the exact check of a motion was.",
            failure=None
            if checker.asked is None
            else Failure(place=tuple((checker.asked.joints[-1, -1] + query.origin).tolist())),
        )
    motion, track = motion.moved(query.origin), _moved_track(candidate.track, query.origin)
    if report.valid:
        return SpatialResult(
            status=PlanningStatus.SOLVED, planner=name, motion=motion, report=report, track=track
        )
    fault = min(report.faults, key=lambda one: one.kind not in ("penetration", "sweep"))
    return SpatialResult(
        status=PlanningStatus.NOT_VALID,
        planner=name,
        reason=f"The exact check refused the motion: {fault.message}",
        failure=None
        if fault.place is None
        else Failure(
            place=fault.place,
            link=None if fault.link is None else motion.n_links - 1 - fault.link,
            depth=fault.amount if fault.kind in ("penetration", "sweep") else None,
            joints=motion.joints[fault.pose],
        ),
        report=report,
        track=track,
    )


def _at_end(motion: SpatialMotion) -> Failure:
    return Failure(place=tuple(motion.joints[-1, -1].tolist()))


def _moved_track(track: FloatArray | None, origin: FloatArray) -> FloatArray | None:
    return None if track is None else track + origin


def _moved_failure(failure: Failure | None, origin: FloatArray) -> Failure | None:
    if failure is None:
        return None
    return dataclasses.replace(
        failure,
        place=tuple((np.asarray(failure.place) + origin).tolist()),
        joints=_moved_track(failure.joints, origin),
    )


def _with_wanted_links(motion: SpatialMotion, query: SpatialQuery) -> SpatialMotion:
    wanted = query.arm.n_links
    if wanted is None or wanted == motion.n_links:
        return motion
    if wanted < motion.n_links:
        raise InputError(
            f"Expected at least {motion.n_links} links of {motion.link_length:g} {query.workspace.units} to "
            f"reach the goal of workspace '{query.workspace.name}', got {wanted}."
        )
    return motion.with_links(wanted)
