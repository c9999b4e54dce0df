"""plan(): from a workspace and an arm to a validated motion in space, or to the reason why there is none."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable

import numpy as np

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners.problem import Attempt, Failure, PlanningStatus, Progress, ValidationReport
from planners.spatial.causal_planner import plan_causal
from planners.spatial.following import plan_following
from planners.spatial.problem import SpatialCandidate, SpatialMotion, SpatialResult
from planners.spatial.query import SpatialQuery
from planners.spatial.track_planner import plan_track
from planners.spatial.validation import validate
from planners.spatial.workspace import Workspace

__all__ = ["PLANNERS", "TIME_BUDGET", "check_time_budget", "plan"]

PLANNERS: dict[str, Callable[[SpatialQuery], SpatialCandidate]] = {
    "track": plan_track,
    "causal": plan_causal,
    "follow": plan_following,
}
"""All spatial planners by name."""

TIME_BUDGET = 60.0
"""Seconds that planning may take by default."""


class _Late(Exception):
    """Raised by the checker when time is over."""


class _Checker:
    """The exact checker for one query; remembers what it said last."""

    def __init__(
        self, workspace: Workspace, arm: ArmSpec, deadline: float, progress: Progress | None
    ) -> None:
        self.workspace, self.arm = workspace, dataclasses.replace(arm, n_links=None)
        self.deadline, self.progress = deadline, progress
        self.last: tuple[SpatialMotion, ValidationReport] | None = None
        self.seconds = 0.0

    def __call__(self, motion: SpatialMotion) -> ValidationReport:
        if self.last is not None and self.last[0] is motion:
            return self.last[1]
        start = time.perf_counter()
        try:
            report = validate(motion, self.workspace, self.arm, self._tell)
        finally:
            self.seconds += time.perf_counter() - start
        self.last = (motion, report)
        return report

    def _tell(self, stage: str, share: float) -> None:
        if time.perf_counter() > self.deadline:
            raise _Late
        if self.progress is not None:
            self.progress(stage, share)


def plan(
    workspace: Workspace,
    arm: ArmSpec,
    planner: str = "track",
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
        A key of `PLANNERS`.
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
        If the planner is unknown, the arm does not fit the feeder, or has fewer links than the motion needs.

    Examples
    --------
    >>> from planners.spatial import load_workspace
    >>> result = plan(load_workspace("paired-panels"), ArmSpec(link_length=90.0))
    >>> result.status, result.motion.n_links
    (<PlanningStatus.SOLVED: 'solved'>, 15)
    """
    if planner not in PLANNERS:
        raise InputError(f"Unknown planner {planner!r}. Available: {', '.join(PLANNERS)}.")
    check_time_budget(time_budget)
    workspace.check_arm(arm)
    begin = time.perf_counter()
    deadline = begin + time_budget
    checker = _Checker(workspace, arm, deadline, progress)
    query = SpatialQuery(
        workspace=workspace,
        arm=arm,
        deadline=deadline,
        check=checker,
        warm_start=_warm(warm_start),
        progress=progress,
    )
    result = _answer(planner, query, checker)
    attempt = Attempt(planner=planner, route=0, status=result.status, seconds=time.perf_counter() - begin)
    return dataclasses.replace(
        result,
        attempts=(attempt,),
        timings={**query.timings, "validate": checker.seconds},
        path=None if warm_start is not None or query.path is None else query.path.points,
    )


def check_time_budget(time_budget: float) -> None:
    """Raise InputError if a time budget is no positive number of seconds."""
    if not is_number(time_budget) or not time_budget > 0.0:
        raise InputError(f"Expected a positive time_budget in seconds, got {time_budget!r}.")


def _warm(result: SpatialResult | None) -> tuple[np.ndarray, float] | None:
    if result is None:
        return None
    if result.motion is None or result.track is None:
        raise InputError("Expected a warm start with a motion and its track, got a result without.")
    return result.track, result.motion.link_length


def _answer(name: str, query: SpatialQuery, checker: _Checker) -> SpatialResult:
    """Ask a planner, and the checker about its motion."""
    motion = None
    try:
        candidate = PLANNERS[name](query)
        if candidate.motion is None:
            return SpatialResult(
                status=candidate.status,
                planner=name,
                reason=candidate.reason,
                failure=candidate.failure,
                track=candidate.track,
            )
        motion = _with_wanted_links(candidate.motion, query)
        report = checker(motion)
    except _Late:
        return SpatialResult(
            status=PlanningStatus.OUT_OF_TIME,
            planner=name,
            reason="Time was over before the exact check of a motion was.",
            failure=None if motion is None else Failure(place=tuple(motion.joints[-1, -1].tolist())),
        )
    if report.valid:
        return SpatialResult(
            status=PlanningStatus.SOLVED, planner=name, motion=motion, report=report, track=candidate.track
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
        track=candidate.track,
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
