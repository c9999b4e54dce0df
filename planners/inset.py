"""The maze for thick links: walls grown by the link radius, so that links may be planned as lines."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from shapely.geometry import LineString, Point, Polygon

from hrsnake_env.arguments import check_at_least
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.kernels.types import FloatArray

__all__ = ["inset_maze"]

QUAD_SEGS = 16
"""Edges in the quarter circle that a grown wall corner becomes."""


def inset_maze(maze: Maze, radius: float) -> Maze | None:
    """Grow the walls of a maze by the radius of the links.

    Grown corners are polygons round the true arc, so a line that is free here is a capsule that is free
    there. The wall behind the base, which the feeder comes through, is opened first.

    Parameters
    ----------
    maze : Maze
        The maze.
    radius : float
        In maze units; for 0 the maze itself is returned.

    Returns
    -------
    inset : Maze or None
        None if the goal cannot be reached by a disc of this radius.

    Raises
    ------
    InputError
        If the radius is no finite number of at least 0.
    """
    check_at_least("link_radius", radius, 0.0)
    if radius == 0.0:
        return maze
    grown = radius / math.cos(math.pi / (4 * QUAD_SEGS))
    opened = maze.free_space.union(_mouth(maze, grown))
    try:
        return dataclasses.replace(maze, free_space=opened.buffer(-grown, quad_segs=QUAD_SEGS))
    except InputError:
        return None


def _mouth(maze: Maze, radius: float) -> Polygon:
    """Return a rectangle that joins the feeder behind the base to the free space, as wide as fits."""
    base = maze.base_pose[:2]
    along = np.array([math.cos(maze.base_pose[2]), math.sin(maze.base_pose[2])])
    across: FloatArray = np.array([-along[1], along[0]])
    walls = maze.free_space.boundary
    back = LineString([base, base - maze.size * along]).intersection(walls)
    depth = 2.0 * radius + (0.0 if back.is_empty else Point(base).distance(back))
    front = base + 2.0 * radius * along
    sides = [
        Point(front).distance(LineString([front, front + side * maze.size * across]).intersection(walls))
        for side in (1.0, -1.0)
    ]
    rear = base - depth * along
    return Polygon(
        [
            front + sides[0] * across,
            rear + sides[0] * across,
            rear - sides[1] * across,
            front - sides[1] * across,
        ]
    )
