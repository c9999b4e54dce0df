"""Kernels that find walls near a triangle: rings of vertices, and a grid of what is in which cell."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray

__all__ = ["Grid", "IntArray", "Walls", "cross", "grid_of", "is_clear", "listed"]

IntArray = NDArray[np.int64]

GAP = 1e-11
"""In the size of the coordinates. Rounding then never decides whether walls touch."""

MAX_CELLS = 4_000_000
"""Of the grid that finds walls."""


class Walls(NamedTuple):
    """Hold rings of vertices as they are now, and as they were."""

    old: FloatArray
    """The map's vertices, ring by ring, shape (n, 2)."""
    now: FloatArray
    """Where the vertices are now, shape (n, 2)."""
    foot: FloatArray
    """Number of the old vertex that each stands on, and how far it is on the way to the next, shape (n,)."""
    before: IntArray
    """The vertex before each, shape (n,)."""
    after: IntArray
    """The vertex after each, or -1 for those that are gone, shape (n,)."""
    ring: IntArray
    """The ring of each, shape (n,)."""
    begins: IntArray
    """Where each ring begins, shape (n_rings + 1,)."""
    left: IntArray
    """Vertices that are left in each ring, shape (n_rings,)."""


class Grid(NamedTuple):
    """Hold which walls are in which cells, as linked lists. Walls that are gone stay listed."""

    x: float
    y: float
    cell: float
    gap: float
    """What is nearer than this counts as touching."""
    n_x: int
    n_y: int
    head: IntArray
    """The first entry of each cell, or -1, shape (n_x * n_y,)."""
    used: IntArray
    """Entries in use, shape (1,)."""


@numba.njit(cache=True)
def cross(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the cross product: positive if b turns left from a."""
    return ax * by - ay * bx


@numba.njit(cache=True)
def grid_of(walls: Walls) -> Grid:
    """Return a grid with as many cells as there are vertices, and nothing listed yet."""
    x, y = walls.old[:, 0].min(), walls.old[:, 1].min()
    wide, high = walls.old[:, 0].max() - x, walls.old[:, 1].max() - y
    n = min(walls.left.sum(), MAX_CELLS // 2)
    cell = max(math.sqrt(wide * high / n), max(wide, high) / n)
    n_x, n_y = int(wide / cell) + 1, int(high / cell) + 1
    gap = GAP * np.abs(walls.old).max()
    return Grid(
        x, y, cell, gap, n_x, n_y, np.full(n_x * n_y, -1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    )


@numba.njit(cache=True)
def _row(grid: Grid, y: float) -> int:
    return min(max(int((y - grid.y) / grid.cell), 0), grid.n_y - 1)


@numba.njit(cache=True)
def _columns(grid: Grid, row: int, a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[int, int]:
    """Return the first and the last column in which a triangle, or a line (b is c), reaches a row."""
    margin = 1e-6 * grid.cell
    low, high = grid.y + row * grid.cell - margin, grid.y + (row + 1) * grid.cell + margin
    if row == 0:
        low = -math.inf
    if row == grid.n_y - 1:
        high = math.inf
    least, most = math.inf, -math.inf
    for k in range(3):
        start, end = (a, b) if k == 0 else ((b, c) if k == 1 else (c, a))
        if max(start[1], end[1]) < low or min(start[1], end[1]) > high:
            continue
        for y in (low, high):
            if min(start[1], end[1]) < y < max(start[1], end[1]):
                x = start[0] + (y - start[1]) / (end[1] - start[1]) * (end[0] - start[0])
                least, most = min(least, x), max(most, x)
        for point in (start, end):
            if low <= point[1] <= high:
                least, most = min(least, point[0]), max(most, point[0])
    first, last = (least - margin - grid.x) / grid.cell, (most + margin - grid.x) / grid.cell
    return int(min(max(first, 0.0), grid.n_x - 1.0)), int(min(max(last, 0.0), grid.n_x - 1.0))


@numba.njit(cache=True)
def listed(grid: Grid, entries: IntArray, walls: Walls, i: int) -> IntArray:
    """List the wall from vertex i in all cells that it comes into. An entry is start, end, next entry."""
    j = walls.after[i]
    a, b = walls.now[i], walls.now[j]
    for row in range(_row(grid, min(a[1], b[1])), _row(grid, max(a[1], b[1])) + 1):
        first, last = _columns(grid, row, a, b, b)
        for column in range(first, last + 1):
            n, cell = grid.used[0], row * grid.n_x + column
            if n == len(entries):
                entries = np.concatenate((entries, np.empty_like(entries)))
            entries[n, 0], entries[n, 1], entries[n, 2] = i, j, grid.head[cell]
            grid.head[cell] = n
            grid.used[0] = n + 1
    return entries


@numba.njit(cache=True)
def is_clear(
    walls: Walls,
    grid: Grid,
    entries: IntArray,
    a: FloatArray,
    b: FloatArray,
    c: FloatArray,
    own: tuple[int, int, int],
    alone: bool,
) -> bool:
    """Tell whether a triangle is free of walls, other than those that begin at `own`.

    Walls may begin and end at its corners, unless those shall be `alone`.
    """
    if cross(b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]) < 0.0:
        b, c = c, b
    for row in range(_row(grid, min(a[1], b[1], c[1])), _row(grid, max(a[1], b[1], c[1])) + 1):
        first, last = _columns(grid, row, a, b, c)
        for column in range(first, last + 1):
            entry = grid.head[row * grid.n_x + column]
            while entry >= 0:
                i, j = entries[entry, 0], entries[entry, 1]
                entry = entries[entry, 2]
                if walls.after[i] != j or i == own[0] or i == own[1] or i == own[2]:
                    continue
                if _touches(walls.now[i], walls.now[j], a, b, c, alone, grid.gap):
                    return False
    return True


@numba.njit(cache=True)
def _goes_in(
    here: FloatArray, end: FloatArray, following: FloatArray, before: FloatArray, gap: float
) -> bool:
    """Tell whether a line from a corner of a triangle goes into it or along it; the triangle may be flat."""
    x, y = end[0] - here[0], end[1] - here[1]
    fx, fy = following[0] - here[0], following[1] - here[1]
    bx, by = before[0] - here[0], before[1] - here[1]
    flat = gap * max(math.hypot(fx, fy), math.hypot(bx, by))
    if abs(cross(fx, fy, bx, by)) <= flat and fx * bx + fy * by < 0.0:
        return True  # the middle of three in a row: a wall will pass there
    length = math.hypot(x, y)
    if cross(fx, fy, x, y) < -gap * max(length, math.hypot(fx, fy)):
        return False
    if cross(x, y, bx, by) < -gap * max(length, math.hypot(bx, by)):
        return False
    return bool(x * fx + y * fy > 0.0 or x * bx + y * by > 0.0)


@numba.njit(cache=True)
def _touches(
    d: FloatArray, e: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, alone: bool, gap: float
) -> bool:
    """Tell whether the line from d to e touches a triangle (a to b to c turns left).

    A line that begins or ends at a corner does not, unless it goes on into the triangle or along its side, or
    the corner shall be alone.
    """
    if (
        max(d[0], e[0]) < min(a[0], b[0], c[0]) - gap
        or min(d[0], e[0]) > max(a[0], b[0], c[0]) + gap
        or max(d[1], e[1]) < min(a[1], b[1], c[1]) - gap
        or min(d[1], e[1]) > max(a[1], b[1], c[1]) + gap
    ):
        return False
    for k in range(3):
        here, following, before = (a, b, c) if k == 0 else ((b, c, a) if k == 1 else (c, a, b))
        for m in range(2):
            start, end = (d, e) if m == 0 else (e, d)
            if start[0] == here[0] and start[1] == here[1]:
                return alone or _goes_in(here, end, following, before, gap)
    for k in range(3):
        here, following = (a, b) if k == 0 else ((b, c) if k == 1 else (c, a))
        x, y = following[0] - here[0], following[1] - here[1]
        far = -gap * math.hypot(x, y)
        if (
            cross(x, y, d[0] - here[0], d[1] - here[1]) < far
            and cross(x, y, e[0] - here[0], e[1] - here[1]) < far
        ):
            return False
    x, y = e[0] - d[0], e[1] - d[1]
    sides = (
        cross(x, y, a[0] - d[0], a[1] - d[1]),
        cross(x, y, b[0] - d[0], b[1] - d[1]),
        cross(x, y, c[0] - d[0], c[1] - d[1]),
    )
    far = gap * math.hypot(x, y)
    return not (min(sides) > far or max(sides) < -far)
