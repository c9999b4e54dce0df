"""What is in the way where a planner could not go on: which wall, and how deep a link would be in it."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import LineString

from hrsnake_env.maze import Maze
from planners.kernels.beam import direction_to_distance
from planners.kernels.types import FloatArray
from planners.problem import Failure

__all__ = ["deepest_chord", "wall_nearest_to"]

CHORDS, SAMPLES = 48, 96
"""Chords looked at, and points on each: enough to name a wall and to draw a picture."""


def wall_nearest_to(maze: Maze, place: tuple[float, float]) -> int:
    """Return the index in `Maze.walls` of the wall nearest to a place."""
    return int(np.argmin(shapely.distance(shapely.linestrings(maze.walls), shapely.points(place))))


def deepest_chord(maze: Maze, line: FloatArray, first: int, last: int, length: float) -> Failure | None:
    """Find the link that would be deepest in a wall if all joints ran along a line.

    Parameters
    ----------
    maze : Maze
        With the walls.
    line : array, shape (n, 2)
        Where the joints are wanted.
    first, last : int
        Links that start at points in this range are looked at.
    length : float
        Of the links.

    Returns
    -------
    failure : Failure or None
        With place, wall and depth; None if all these links are free.
    """
    worst: tuple[float, tuple[float, float]] = (0.0, (0.0, 0.0))
    for index in np.unique(np.linspace(first, last, CHORDS).astype(int)):
        x, y = line[index]
        hit, heading = direction_to_distance(line, x, y, index, length)
        if not hit:
            break
        chord = LineString([(x, y), (x + length * np.cos(heading), y + length * np.sin(heading))])
        points = shapely.line_interpolate_point(chord, np.linspace(0.0, length, SAMPLES))
        depths = shapely.distance(points, maze.free_space)
        deepest = int(np.argmax(depths))
        if depths[deepest] > worst[0]:
            worst = (float(depths[deepest]), (float(points[deepest].x), float(points[deepest].y)))
    depth, place = worst
    return None if depth == 0.0 else Failure(place=place, wall=wall_nearest_to(maze, place), depth=depth)
