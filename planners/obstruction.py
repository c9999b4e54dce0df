"""What is in the way where a planner could not go on: which wall, and how deep a link would be in it."""

from __future__ import annotations

import numpy as np
import shapely

from hrsnake_env.maze import Maze
from planners.kernels.types import FloatArray

__all__ = ["least_depth", "wall_nearest_to"]

STARTS, HEADINGS, SAMPLES = 48, 16, 48
"""Starts and headings of a link, and points on it, that are looked at: enough to name a wall."""


def wall_nearest_to(maze: Maze, place: tuple[float, ...]) -> int:
    """Return the index in `Maze.walls` of the wall nearest to a place."""
    return int(np.argmin(shapely.distance(shapely.linestrings(maze.walls), shapely.points(place))))


def least_depth(
    maze: Maze, starts: FloatArray, heading: float, turn: float, length: float
) -> tuple[float, tuple[float, float]] | None:
    """Find how deep a link gets into a wall at least when it turns, wherever its start is meanwhile.

    Parameters
    ----------
    maze : Maze
        With the walls.
    starts : array, shape (m, 2)
        Where the link's start may be.
    heading, turn : float
        Present heading of the link, and by how much it shall turn, in rad.
    length : float
        Of the link.

    Returns
    -------
    depth, place : float and tuple of two floats, or None
        At the heading at which even the best start is worst, in maze units; None if it can turn freely.
    """
    chosen = starts[np.unique(np.linspace(0, len(starts) - 1, STARTS).astype(int))]
    directions = heading + turn * np.linspace(0.0, 1.0, HEADINGS)
    along = length * np.linspace(0.0, 1.0, SAMPLES)[:, None]
    units = np.column_stack([np.cos(directions), np.sin(directions)])
    places = chosen[:, None, None] + along * units[:, None]  # start, heading, sample
    depths = shapely.distance(shapely.points(places), maze.free_space)
    by_start = depths.max(axis=2)
    direction = int(np.argmax(by_start.min(axis=0)))
    start = int(np.argmin(by_start[:, direction]))
    depth, sample = float(by_start[start, direction]), int(np.argmax(depths[start, direction]))
    x, y = places[start, direction, sample]
    return None if depth == 0.0 else (depth, (float(x), float(y)))
