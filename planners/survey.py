"""What every planner looks at first: path, beams and corners of a maze (section 2 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrsnake_env.maze import Maze
from planners.beams import Beams, cast_beams
from planners.clock import now
from planners.corners import Corner, critical_corners, semi_critical_corners
from planners.inset import inset_maze
from planners.kernels.types import FloatArray
from planners.path import Path, global_path, path_along
from planners.potential import laplace_potential, passage_width

__all__ = ["Geometry", "survey"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Geometry:
    """Hold the geometry of section 2 of the paper.

    Parameters
    ----------
    maze : Maze
        The maze, with walls grown by the radius of the links.
    path, beams
        In that maze.
    corners, semi_critical : list of Corner
        The critical and the semi-critical corners.
    timings : dict from str to float
        Seconds by stage: potential, path, beams.
    """

    maze: Maze
    path: Path
    beams: Beams
    corners: list[Corner]
    semi_critical: list[Corner]
    timings: dict[str, float]


def survey(maze: Maze, link_radius: float = 0.0, route: FloatArray | None = None) -> Geometry | None:
    """Compute path, beams and corners of a maze.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_radius : float
        In maze units.
    route : array, shape (n, 2), optional
        Waypoints from base to goal that the path shall follow; by default it follows the potential.

    Returns
    -------
    geometry : Geometry or None
        None if no path was found.
    """
    clock = [now()]
    inset = inset_maze(maze, link_radius)
    if inset is None:
        return None
    width = passage_width(inset)
    if route is None:
        potential = laplace_potential(inset, width=width)
        clock.append(now())
        path = global_path(inset, potential, width)
    else:
        clock.append(clock[0])
        path = path_along(route, width)
    clock.append(now())
    if path is None:
        return None
    beams = cast_beams(inset, path)
    corners = critical_corners(path, beams)
    semi_critical = semi_critical_corners(path, beams, corners)
    clock.append(now())
    return Geometry(
        maze=inset,
        path=path,
        beams=beams,
        corners=corners,
        semi_critical=semi_critical,
        timings=dict(zip(("potential", "path", "beams"), np.diff(clock).tolist(), strict=True)),
    )
