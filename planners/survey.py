"""What every planner looks at first: path, beams and critical corners of a maze (section 2 of the paper)."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.beams import Beams, cast_beams
from planners.corners import Corner, critical_corners
from planners.inset import inset_maze
from planners.path import Path, global_path
from planners.potential import laplace_potential, passage_width
from planners.problem import Candidate, PlanningStatus

__all__ = ["Geometry", "no_path", "survey"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Geometry:
    """Hold the geometry of section 2 of the paper.

    Parameters
    ----------
    maze : Maze
        The maze, with walls grown by the radius of the links.
    path, beams, corners
        In that maze.
    timings : dict from str to float
        Seconds by stage: potential, path, beams.
    """

    maze: Maze
    path: Path
    beams: Beams
    corners: list[Corner]
    timings: dict[str, float]


def survey(maze: Maze, link_radius: float = 0.0) -> Geometry | None:
    """Compute path, beams and critical corners of a maze.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_radius : float
        In maze units.

    Returns
    -------
    geometry : Geometry or None
        None if no path was found.
    """
    clock = [time.perf_counter()]
    inset = inset_maze(maze, link_radius)
    if inset is None:
        return None
    width = passage_width(inset)
    potential = laplace_potential(inset, width=width)
    clock.append(time.perf_counter())
    path = global_path(inset, potential, width)
    clock.append(time.perf_counter())
    if path is None:
        return None
    beams = cast_beams(inset, path)
    corners = critical_corners(path, beams)
    clock.append(time.perf_counter())
    return Geometry(
        maze=inset,
        path=path,
        beams=beams,
        corners=corners,
        timings=dict(zip(("potential", "path", "beams"), np.diff(clock).tolist(), strict=True)),
    )


def no_path(maze: Maze, arm: ArmSpec) -> Candidate:
    """Return the outcome where there is nothing to survey."""
    return Candidate(
        status=PlanningStatus.NO_PATH,
        reason=f"No path for a disc of radius {arm.link_radius:g} leads from the base to the goal.",
        place=(float(maze.goal[0]), float(maze.goal[1])),
    )
