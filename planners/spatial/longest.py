"""The longest link in space: how long may links be, so how few actuators does the arm need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.arguments import check_at_least
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners.clock import now
from planners.problem import PlanningStatus, Progress
from planners.spatial.planning import check_planner, check_time_budget, plan
from planners.spatial.problem import SpatialMotion, SpatialResult
from planners.spatial.workspace import Workspace

__all__ = ["SpatialLongest", "SpatialTrial", "longest_link"]

SHORTEST = 1.0 / 40.0
"""First length of the scan, in diagonals of the room."""

STEP = 1.06
"""Ratio of one length of the scan to the one before."""

BEYOND = 3
"""Lengths of the scan without a plan after which it ends; longer links may pass where shorter do not."""


@dataclass(frozen=True, kw_only=True)
class SpatialTrial:
    """Say how planning with links of one length ended.

    Parameters
    ----------
    link_length : float
        In workspace units.
    status : PlanningStatus
        SOLVED if there is a validated motion.
    n_links : int or None
        What the motion takes; a joint of two angles each.
    clearance : float or None
        Smallest distance of the motion's links from an obstacle, less their radius.
    seconds : float
        Planning and checking.
    """

    link_length: float
    status: PlanningStatus
    n_links: int | None
    clearance: float | None
    seconds: float


@dataclass(frozen=True, eq=False, kw_only=True)
class SpatialLongest:
    """Hold the longest link that was found to reach the goal.

    Parameters
    ----------
    length : float
        In workspace units; 0 if none was found.
    result : SpatialResult or None
        Its plan.
    trials : tuple of SpatialTrial
        All lengths that were tried, the shortest first.
    complete : bool
        False if the search was stopped before it was as accurate as asked for.
    """

    length: float
    result: SpatialResult | None
    trials: tuple[SpatialTrial, ...]
    complete: bool

    @property
    def motion(self) -> SpatialMotion | None:
        """The validated motion of the longest link; None if none was found."""
        return None if self.result is None else self.result.motion

    def to_dict(self) -> dict[str, Any]:
        """Return the outcome as plain numbers and strings."""
        return {
            "length": self.length,
            "n_links": None
            if self.result is None or self.result.motion is None
            else self.result.motion.n_links,
            "complete": self.complete,
            "trials": [
                {
                    "link_length": trial.link_length,
                    "status": str(trial.status),
                    "n_links": trial.n_links,
                    "clearance": trial.clearance,
                    "seconds": trial.seconds,
                }
                for trial in self.trials
            ],
        }


def longest_link(
    workspace: Workspace,
    planner: str = "auto",
    *,
    link_radius: float = 0.0,
    joint_limit: float | None = None,
    accuracy: float = 1e-3,
    time_budget: float = 30.0,
    progress: Progress | None = None,
) -> SpatialLongest:
    """Find the longest link with which a planner reaches the goal.

    Lengths are scanned upwards, each with a whole plan, until several in a row find none; then the gap above
    the longest that did is halved. Every length that counts has a validated motion. Ctrl-C ends the search
    with what was found so far.

    Parameters
    ----------
    workspace : Workspace
        The workspace.
    planner : str
        `auto` or a key of `planners.spatial.PLANNERS`.
    link_radius : float
        In workspace units.
    joint_limit : float, optional
        In rad.
    accuracy : float
        As a share of the length.
    time_budget : float
        In s, for each length.
    progress : callable, optional
        Called with a sentence and the share done.

    Raises
    ------
    InputError
        If the planner is unknown, a number is out of its range, or no arm of this radius fits the feeder.
    """
    check_planner(planner)
    check_at_least("accuracy", accuracy, 1e-6)
    check_at_least("link_radius", link_radius, 0.0)
    check_time_budget(time_budget)
    shortest = max(SHORTEST * workspace.size, 2.5 * link_radius)
    search = _Search(workspace, planner, link_radius, joint_limit, time_budget, progress)
    workspace.check_arm(search.arm(shortest))
    complete = True
    try:
        search.scan(shortest)
        search.close_in(accuracy)
    except KeyboardInterrupt:
        complete = False
    return SpatialLongest(
        length=search.length,
        result=search.best,
        trials=tuple(sorted(search.trials, key=lambda trial: trial.link_length)),
        complete=complete,
    )


class _Search:
    """Ask for one length after the other, and keep the record."""

    def __init__(
        self,
        workspace: Workspace,
        planner: str,
        link_radius: float,
        joint_limit: float | None,
        time_budget: float,
        progress: Progress | None,
    ) -> None:
        self.workspace, self.planner, self.progress = workspace, planner, progress
        self.link_radius, self.joint_limit, self.time_budget = link_radius, joint_limit, time_budget
        self.trials: list[SpatialTrial] = []
        self.best: SpatialResult | None = None
        self.length = 0.0

    def arm(self, length: float) -> ArmSpec:
        """Return an arm with links of a length."""
        return ArmSpec(link_length=length, link_radius=self.link_radius, joint_limit=self.joint_limit)

    def ask(self, length: float) -> bool:
        """Plan with links of a length; tell whether there is a motion."""
        if self.progress is not None:
            self.progress(f"{length:.4g} {self.workspace.units}", min(length / self.workspace.size, 1.0))
        start = now()
        arm = self.arm(length)
        try:
            self.workspace.check_arm(arm)
        except InputError:  # too long for the feeder
            return False
        result = plan(self.workspace, arm, self.planner, time_budget=self.time_budget)
        self.trials.append(
            SpatialTrial(
                link_length=length,
                status=result.status,
                n_links=None if result.motion is None else result.motion.n_links,
                clearance=None if result.report is None or not result.solved else result.report.clearance,
                seconds=now() - start,
            )
        )
        if result.solved and length > self.length:
            self.best, self.length = result, length
        return result.solved

    def scan(self, length: float) -> None:
        """Try longer and longer links, to some way beyond the last that has a plan."""
        missed = 0
        while missed < BEYOND and length <= self.workspace.size:
            missed = 0 if self.ask(length) else missed + 1
            if self.trials and self.trials[-1].status is PlanningStatus.NO_PATH:
                return  # there is none for any length
            length *= STEP

    def close_in(self, accuracy: float) -> None:
        """Halve the gap above the longest link with a plan."""
        beyond = self.length * STEP
        while self.length > 0.0 and beyond > self.length * (1.0 + accuracy):
            middle = float(np.sqrt(self.length * beyond))
            if not self.ask(middle):
                beyond = middle
