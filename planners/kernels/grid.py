"""Kernels on a regular grid: which nodes and edges walls block, and descent of a potential."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import BoolArray, FloatArray

ON_WALL = 1e-9
"""A node this near to a wall, in cells, is on it."""


@njit(cache=True)
def scan_walls(
    walls: FloatArray, x0: float, y0: float, cell: float, nx: int, ny: int
) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Find the nodes inside the free space and the grid edges that a wall crosses.

    Parameters
    ----------
    walls : array, shape (n_walls, 2, 2)
        Segments of closed rings.
    x0, y0, cell : float
        Node (j, i) stands at (x0 + i cell, y0 + j cell).
    nx, ny : int
        Number of nodes.

    Returns
    -------
    inside : array, shape (ny, nx)
        By parity of the crossings along each row; a node on a wall is not inside.
    blocked_x : array, shape (ny, nx)
        Whether a wall crosses between nodes (j, i) and (j, i + 1).
    blocked_y : array, shape (ny, nx)
        Whether a wall crosses between nodes (j, i) and (j + 1, i).

    Notes
    -----
    The caller guarantees that the grid reaches beyond the walls on all sides.
    """
    inside = np.zeros((ny, nx), dtype=np.bool_)
    on_wall = np.zeros((ny, nx), dtype=np.bool_)
    blocked_x = np.zeros((ny, nx), dtype=np.bool_)
    blocked_y = np.zeros((ny, nx), dtype=np.bool_)
    for k in range(walls.shape[0]):
        ax, ay = (walls[k, 0, 0] - x0) / cell, (walls[k, 0, 1] - y0) / cell
        bx, by = (walls[k, 1, 0] - x0) / cell, (walls[k, 1, 1] - y0) / cell
        # Half-open in the running coordinate, so that a vertex on a row counts once.
        for j in range(int(np.ceil(min(ay, by))), int(np.ceil(max(ay, by)))):
            x = ax + (j - ay) * (bx - ax) / (by - ay)
            i = int(np.floor(x))
            blocked_x[j, i] = True
            inside[j, i + 1] ^= True
            on_wall[j, int(np.rint(x))] |= abs(x - np.rint(x)) < ON_WALL
        for i in range(int(np.ceil(min(ax, bx))), int(np.ceil(max(ax, bx)))):
            y = ay + (i - ax) * (by - ay) / (bx - ax)
            blocked_y[int(np.floor(y)), i] = True
            on_wall[int(np.rint(y)), i] |= abs(y - np.rint(y)) < ON_WALL
        # Neither wall at a corner that is above and right of both counts it.
        i, j = int(np.rint(bx)), int(np.rint(by))
        on_wall[j, i] |= abs(bx - i) < ON_WALL and abs(by - j) < ON_WALL
    for j in range(ny):
        for i in range(1, nx):
            inside[j, i] ^= inside[j, i - 1]
    return inside & ~on_wall, blocked_x, blocked_y


@njit(cache=True)
def _node_ascent(
    u: FloatArray, blocked_x: BoolArray, blocked_y: BoolArray, j: int, i: int
) -> tuple[float, float]:
    """Return the central differences of u at a node, over the largest u around it."""
    east = 0.0 if blocked_x[j, i] else u[j, i + 1]
    west = 0.0 if blocked_x[j, i - 1] else u[j, i - 1]
    north = 0.0 if blocked_y[j, i] else u[j + 1, i]
    south = 0.0 if blocked_y[j - 1, i] else u[j - 1, i]
    largest = max(u[j, i], east, west, north, south)
    if largest <= 0.0:
        return 0.0, 0.0
    return (east - west) / largest, (north - south) / largest


@njit(cache=True)
def ascend(
    u: FloatArray,
    blocked_x: BoolArray,
    blocked_y: BoolArray,
    start: FloatArray,
    goal: FloatArray,
    step: float,
    stop: float,
    points: FloatArray,
) -> int:
    """Follow the steepest ascent of u from start to goal (Eq. 3 with linear interpolation).

    Parameters
    ----------
    u : array, shape (ny, nx)
        1 at the goal's node, 0 on walls.
    blocked_x, blocked_y : array, shape (ny, nx)
        As `scan_walls` returns them.
    start, goal : array, shape (2,)
        In cells from node (0, 0).
    step, stop : float
        Length of a step, and distance from the goal at which to jump to it, in cells.
    points : array, shape (n_max, 2)
        Filled with the path, in cells.

    Returns
    -------
    n_points : int
        0 if the ascent ended before the goal.

    Notes
    -----
    The caller guarantees that the outermost two rings of nodes are walls.
    """
    x, y = start[0], start[1]
    for n in range(points.shape[0] - 1):
        points[n, 0], points[n, 1] = x, y
        if np.hypot(goal[0] - x, goal[1] - y) <= stop:
            points[n + 1] = goal
            return n + 2
        i, j = int(np.floor(x)), int(np.floor(y))
        if not (1 <= i < u.shape[1] - 2 and 1 <= j < u.shape[0] - 2):
            return 0
        gx, gy = 0.0, 0.0
        for dj in range(2):
            for di in range(2):
                weight = (1.0 - abs(x - i - di)) * (1.0 - abs(y - j - dj))
                nx, ny = _node_ascent(u, blocked_x, blocked_y, j + dj, i + di)
                gx += weight * nx
                gy += weight * ny
        length = np.hypot(gx, gy)
        if length == 0.0:
            return 0
        x += step * gx / length
        y += step * gy / length
    return 0
