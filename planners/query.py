"""What a planner is asked, and the terms on which it works."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.clock import now
from planners.kernels.types import FloatArray
from planners.problem import Candidate, Failure, Motion, PlanningStatus, Progress, ValidationReport
from planners.routes import routes
from planners.survey import Geometry, survey

__all__ = ["Query"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Query:
    """Hold one planning query; every planner is a function of it.

    Parameters
    ----------
    maze : Maze
        The maze; the arm fits its feeder (`Maze.check_arm`).
    arm : ArmSpec
        The arm; planners do not use `n_links`, they give as many links as the motion needs.
    deadline : float
        When to stop, on the clock of `planners.clock.now`.
    warm_start : Motion or None
        A motion of the same links in a similar maze, to start from.
    route : array, shape (n, 2), or None
        Waypoints from the base to the goal through the free space: which way round the obstacles. By default
        the way of the Laplace potential.
    thorough : bool
        Whether to try everything; otherwise what takes more than some tenths of a second is left.
    checker : callable or None
        Says of a motion whether it is valid, as `planners.validation.validate` does.
    seed : int
        Of planners that draw random numbers; not negative.
    refused : list of Motion
        What the checker has refused so far.
    progress : callable or None
        Told about stage and share done.
    surveys : dict
        What has been looked at by this query and those made from it by `dataclasses.replace`, for the same
        maze and link radius, by the identity of the route.
    """

    maze: Maze
    arm: ArmSpec
    deadline: float = math.inf
    warm_start: Motion | None = None
    route: FloatArray | None = None
    thorough: bool = True
    checker: Callable[[Motion], ValidationReport] | None = None
    seed: int = 0
    refused: list[Motion] = field(default_factory=list, repr=False)
    progress: Progress | None = None
    surveys: dict[int, Geometry | None] = field(default_factory=dict, repr=False)

    @property
    def geometry(self) -> Geometry | None:
        """Path, beams and corners of the route; None if nothing leads to the goal. Computed once."""
        key = id(self.route)
        if key not in self.surveys:
            self.surveys[key] = survey(self.maze, self.arm.link_radius, self.route) or self._medial()
        return self.surveys[key]

    def _medial(self) -> Geometry | None:
        """Survey the medial axis' first way: some 240 passage widths from the goal the potential vanishes."""
        if self.route is not None:
            return None
        way = next(routes(self.maze, self.arm.link_length, link_radius=self.arm.link_radius), None)
        return None if way is None else survey(self.maze, self.arm.link_radius, way.points)

    def check(self, motion: Motion) -> ValidationReport | None:
        """Ask the checker about a motion; None if there is none to ask."""
        return None if self.checker is None else self.checker(motion)

    def tell(self, stage: str, share: float) -> None:
        """Report progress."""
        if self.progress is not None:
            self.progress(stage, share)

    @property
    def late(self) -> bool:
        """Whether the deadline has passed."""
        return now() >= self.deadline

    def no_path(self) -> Candidate:
        """Return the outcome where there is nothing to survey."""
        return Candidate(
            status=PlanningStatus.NO_PATH,
            reason=f"No path for a disc of radius {self.arm.link_radius:g} leads from the base to the goal.",
            failure=Failure(place=(float(self.maze.goal[0]), float(self.maze.goal[1]))),
        )
