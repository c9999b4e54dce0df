"""What is in the way where a planner could not go on: which wall, and how deep a link would be in it."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import LineString

from hrsnake_env.maze import Maze
from planners.kernels.beam import direction_to_distance
from planners.kernels.types import FloatArray, IntArray

__all__ = ["deepest_link", "wall_nearest_to"]

LINKS, SAMPLES = 64, 96
"""Links looked at, and points on each: enough to name a wall and to draw a picture."""


def wall_nearest_to(maze: Maze, place: tuple[float, float]) -> int:
    """Return the index in `Maze.walls` of the wall nearest to a place."""
    return int(np.argmin(shapely.distance(shapely.linestrings(maze.walls), shapely.points(place))))


def deepest_link(
    maze: Maze, aim: FloatArray, starts: FloatArray, indices: IntArray, length: float
) -> tuple[float, tuple[float, float]] | None:
    """Find the link that would be deepest in a wall if all aimed at a line.

    Parameters
    ----------
    maze : Maze
        With the walls.
    aim : array, shape (n, 2)
        The line that links aim their ends at.
    starts : array, shape (m, 2)
        Where links start.
    indices : array, shape (m,)
        For each of them, from which point on the line is looked at.
    length : float
        Of the links.

    Returns
    -------
    depth, place : float and tuple of two floats, or None
        Both in maze units; None if all these links are free.
    """
    worst: tuple[float, tuple[float, float]] = (0.0, (0.0, 0.0))
    for k in np.unique(np.linspace(0, len(starts) - 1, LINKS).astype(int)):
        x, y = starts[k]
        hit, heading = direction_to_distance(aim, x, y, int(indices[k]), length)
        if not hit:
            continue
        link = LineString([(x, y), (x + length * np.cos(heading), y + length * np.sin(heading))])
        points = shapely.line_interpolate_point(link, np.linspace(0.0, length, SAMPLES))
        depths = shapely.distance(points, maze.free_space)
        deepest = int(np.argmax(depths))
        if depths[deepest] > worst[0]:
            worst = (float(depths[deepest]), (float(points[deepest].x), float(points[deepest].y)))
    return worst if worst[0] > 0.0 else None
