"""What a spatial planner is asked: a workspace, an arm, a time limit; and the path, found once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arguments import place_text
from hrsnake_env.arm import ArmSpec, FloatArray
from planners.clock import now
from planners.problem import PlanningStatus, Progress, ValidationReport
from planners.spatial.path import Path, global_path
from planners.spatial.potential import laplace_potential
from planners.spatial.problem import SpatialCandidate, SpatialMotion
from planners.spatial.workspace import Workspace

__all__ = ["SpatialQuery", "behind_straight"]

FIRST = 0.5
"""Share of the link length with which chords on the path begin to grow."""


def behind_straight(workspace: Workspace, curve: FloatArray) -> FloatArray:
    """Return the part of a curve behind the straight stretch, shape (n, 3), the end of that first."""
    end = workspace.base + workspace.straight * workspace.heading
    nearest = int(np.argmin(np.linalg.norm(curve - end, axis=1)))
    return np.concatenate([end[None], curve[nearest + 1 :]])


@dataclass(eq=False, kw_only=True)
class SpatialQuery:
    """Hold a question to a spatial planner.

    Parameters
    ----------
    workspace, arm
        What is asked. The workspace is seen from `origin`, and so is all that planners hand on.
    deadline : float
        On the clock of `planners.clock.now`.
    check : callable
        The exact checker.
    warm_start : tuple of array, shape (n, 3), and float; or None
        The track of links of another length, from the base to the goal, and that length.
    progress : callable or None
        Called with stage and share done.
    origin : array, shape (3,)
        Where people have the place that is (0, 0, 0) here; `text` tells them of places.
    """

    workspace: Workspace
    arm: ArmSpec
    deadline: float
    check: Callable[[SpatialMotion], ValidationReport]
    warm_start: tuple[FloatArray, float] | None = None
    progress: Progress | None = None
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))
    timings: dict[str, float] = field(default_factory=dict)

    def text(self, place: ArrayLike) -> str:
        """Write a place for people."""
        return place_text(np.asarray(place) + self.origin, self.workspace.size)

    def obstacle_text(self, number: int) -> str:
        """Write which obstacle is meant."""
        low, high = self.workspace.obstacle_in_room(number)
        return f"the obstacle from {self.text(low)} to {self.text(high)}"

    @property
    def late(self) -> bool:
        """Whether time is over."""
        return now() > self.deadline

    @cached_property
    def path(self) -> Path | None:
        """The path of a ball of the link radius; None if there is no way on the grid."""
        self.tell("path", 0.0)
        start = now()
        potential = laplace_potential(self.workspace, radius=self.arm.link_radius)
        middle = now()
        path = None if potential is None else global_path(self.workspace, potential)
        self.timings |= {"potential": middle - start, "path": now() - middle}
        self.tell("path", 1.0)
        return path

    def no_path(self) -> SpatialCandidate:
        """Return the answer of a planner without a path."""
        what = "a point" if self.arm.link_radius == 0.0 else "a ball of the links' radius"
        return SpatialCandidate(
            status=PlanningStatus.NO_PATH,
            reason=f"No path from the base to the goal was found on the finest grid, not even for {what}.",
        )

    @property
    def start(self) -> tuple[FloatArray, float]:
        """Return the curve on which chords begin to grow, from the straight stretch on, and their length.

        There must be a path or a warm start.
        """
        if self.warm_start is not None:
            curve, length = self.warm_start
        else:
            assert self.path is not None
            curve, length = self.path.points, FIRST * self.arm.link_length
        return behind_straight(self.workspace, curve), length

    def tell(self, stage: str, share: float) -> None:
        """Report progress."""
        if self.progress is not None:
            self.progress(stage, share)
