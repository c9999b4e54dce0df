"""Kernels that take vertices out of walls, so that walls move into the free space alone, and not far.

Rings have the free space on the left. Two kinds of cuts are made, and each takes a triangle off the free
space: a corner of the free space is cut off (its vertex is left out), or a short wall is covered by its
neighbours, which are made longer until they meet. A cut is made only if its triangle touches no other wall,
so walls never cross and passages stay open; and if the new walls are near the map's own. Each vertex has a
foot on the map's own ring: a wall stands for the vertices between its feet, so deviations are measured, never
added up. Corners are cut off first, and walls covered then: the other way round, staircases would grow.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray
from hrsnake_env.maps.cells import Grid, IntArray, Walls, cross, grid_of, is_clear, listed

__all__ = ["shrunk"]

LEVELS = (0.25, 0.5, 1.0)
"""Cuts are made in this order, in shares of the tolerance: the least harmful first."""

NUDGE = 1e-14
"""In the size of the coordinates. New vertices are put this far into the free space, against rounding."""

BLUNT = 0.05
"""Least square of the sum of two walls' normals: walls that meet in a sharper spike are not made longer."""


@numba.njit(cache=True)
def shrunk(old: FloatArray, begins: IntArray, tolerance: float) -> tuple[FloatArray, IntArray, float]:
    """Take vertices out of rings.

    Parameters
    ----------
    old : array, shape (n, 2)
        Vertices, ring by ring, not closed, with the free space on the left.
    begins : array, shape (n_rings + 1,)
        Where each ring begins.
    tolerance : float
        How far walls may move.

    Returns
    -------
    now : array, shape (n, 2)
        Where vertices are now.
    after : array, shape (n,)
        The vertex after each; -1 for those that are gone.
    moved : float
        How far walls have moved at most, not over the tolerance.

    Notes
    -----
    The caller guarantees rings that do not cross, of three vertices at least.
    """
    n = len(old)
    walls = _walls(old, begins)
    _drop_straight(walls)
    if tolerance > 0.0:
        grid = grid_of(walls)
        entries = np.empty((4 * n + 1024, 3), dtype=np.int64)
        for i in range(n):
            if walls.after[i] >= 0:
                entries = listed(grid, entries, walls, i)
        nudge = NUDGE * np.abs(old).max()
        due, waits = np.empty(n, dtype=np.bool_), np.zeros(n, dtype=np.int64)
        sweep = 0
        for stage in range(2 * len(LEVELS)):
            level, covers = LEVELS[stage % len(LEVELS)], stage >= len(LEVELS)
            due[:] = True
            changed = True
            while changed:
                changed = False
                sweep += 1
                for i in range(n):
                    if walls.after[i] < 0 or not due[i] or waits[i] == sweep:
                        continue
                    due[i] = False
                    done, entries = _cut(walls, grid, entries, i, covers, level * tolerance, nudge)
                    if done:
                        changed = True
                        _wake(walls, due, waits, i, sweep)
    return walls.now, walls.after, _moved(walls)


@numba.njit(cache=True)
def _walls(old: FloatArray, begins: IntArray) -> Walls:
    n = len(old)
    before, after = np.arange(-1, n - 1), np.arange(1, n + 1)
    ring = np.empty(n, dtype=np.int64)
    for k in range(len(begins) - 1):
        before[begins[k]], after[begins[k + 1] - 1] = begins[k + 1] - 1, begins[k]
        ring[begins[k] : begins[k + 1]] = k
    foot = np.arange(n).astype(np.float64)
    return Walls(old, old.copy(), foot, before, after, ring, begins, np.diff(begins))


@numba.njit(cache=True)
def _drop_straight(walls: Walls) -> None:
    """Leave out vertices on straight walls, and those that stand twice in the same place."""
    for i in range(len(walls.old)):
        a, b = walls.before[i], walls.after[i]
        if walls.left[walls.ring[i]] <= 3 or _turn(walls, i) != 0.0:
            continue
        ux, uy = walls.now[i, 0] - walls.now[a, 0], walls.now[i, 1] - walls.now[a, 1]
        wx, wy = walls.now[b, 0] - walls.now[i, 0], walls.now[b, 1] - walls.now[i, 1]
        if ux * wx + uy * wy >= 0.0:
            _remove(walls, i)


@numba.njit(cache=True)
def _remove(walls: Walls, i: int) -> None:
    a, b = walls.before[i], walls.after[i]
    walls.after[a], walls.before[b], walls.after[i] = b, a, -1
    walls.left[walls.ring[i]] -= 1


@numba.njit(cache=True)
def _wake(walls: Walls, due: NDArray[np.bool_], waits: IntArray, i: int, sweep: int) -> None:
    """After a cut, try the vertices around it again: not at once, lest one wall grow vertex by vertex."""
    here = i if walls.after[i] >= 0 else walls.before[i]
    for _ in range(2):
        here = walls.before[here]
    for k in range(6):
        due[here] = True
        if k >= 2:
            waits[here] = sweep
        here = walls.after[here]


@numba.njit(cache=True)
def _turn(walls: Walls, i: int) -> float:
    """Return a positive number where the walls turn left: at a corner of the free space."""
    a, b, now = walls.before[i], walls.after[i], walls.now
    return cross(now[i, 0] - now[a, 0], now[i, 1] - now[a, 1], now[b, 0] - now[i, 0], now[b, 1] - now[i, 1])


@numba.njit(cache=True)
def _cut(
    walls: Walls, grid: Grid, entries: IntArray, i: int, covers: bool, limit: float, nudge: float
) -> tuple[bool, IntArray]:
    """Cut off vertex i, or cover the wall from it if `covers`; tell whether that was possible."""
    if walls.left[walls.ring[i]] <= 3:
        return False, entries
    now, foot, a, b = walls.now, walls.foot, walls.before[i], walls.after[i]
    turn = _turn(walls, i)
    if (
        turn >= 0.0
        and _deviation(walls, foot[a], foot[b], now[a], now[b], limit) <= limit
        and is_clear(walls, grid, entries, now[a], now[i], now[b], (a, i, i), False)
    ):
        _remove(walls, i)
        return True, listed(grid, entries, walls, a)
    if not covers or turn == 0.0 or not (turn < 0.0 or _turn(walls, b) < 0.0):
        return False, entries
    return _cover(walls, grid, entries, i, limit, nudge)


@numba.njit(cache=True)
def _cover(
    walls: Walls, grid: Grid, entries: IntArray, p: int, limit: float, nudge: float
) -> tuple[bool, IntArray]:
    """Replace the wall from vertex p by making its neighbours longer until they meet, if possible."""
    now, foot, q = walls.now, walls.foot, walls.after[p]
    o, r = walls.before[p], walls.after[q]
    x, low, high = _apex(walls, p, nudge)
    if not high > low:
        return False, entries
    t, gap = _nearest(walls, walls.ring[p], low, high, x, limit)
    if (
        gap > limit
        or _deviation(walls, foot[o], t, now[o], x, limit) > limit
        or _deviation(walls, t, foot[r], x, now[r], limit) > limit
        or not is_clear(walls, grid, entries, now[p], now[q], x, (o, p, q), True)
    ):
        return False, entries
    now[p] = x
    foot[p] = t
    _remove(walls, q)
    entries = listed(grid, entries, walls, o)
    return True, listed(grid, entries, walls, p)


@numba.njit(cache=True)
def _apex(walls: Walls, p: int, nudge: float) -> tuple[FloatArray, float, float]:
    """Return where the neighbours of the wall from p meet, and between which feet the new foot may be."""
    now, foot, q = walls.now, walls.foot, walls.after[p]
    o, r = walls.before[p], walls.after[q]
    ux, uy = now[p, 0] - now[o, 0], now[p, 1] - now[o, 1]
    wx, wy = now[r, 0] - now[q, 0], now[r, 1] - now[q, 1]
    ex, ey = now[q, 0] - now[p, 0], now[q, 1] - now[p, 1]
    x, nowhere = np.zeros(2), (0.0, 0.0)
    both = cross(ux, uy, wx, wy)
    u, w = math.hypot(ux, uy), math.hypot(wx, wy)
    if abs(both) <= 1e-9 * u * w:
        return x, *nowhere
    along_u, along_w = cross(ex, ey, wx, wy) / both, cross(ex, ey, ux, uy) / both
    at_p, at_q = _turn(walls, p), _turn(walls, q)
    low, high = foot[p], foot[q]
    if at_p < 0.0 and at_q < 0.0:
        fits = along_u > 0.0 and along_w < 0.0
    elif at_p < 0.0 and at_q > 0.0:
        fits = along_u > 0.0 and 0.0 < along_w < 1.0
        high = foot[r]
    elif at_p > 0.0 and at_q < 0.0:
        fits = along_w < 0.0 and -1.0 < along_u < 0.0
        low = foot[o]
    else:
        fits = False
    nx, ny = -uy / u - wy / w, ux / u + wx / w  # into the free space, off both walls
    if not fits or nx * nx + ny * ny < BLUNT:
        return x, *nowhere
    x[0], x[1] = now[p, 0] + along_u * ux + nudge * nx, now[p, 1] + along_u * uy + nudge * ny
    return x, low, high if high > low else high + _n_old(walls, walls.ring[p])


# Distances to the map's own walls


@numba.njit(cache=True)
def _n_old(walls: Walls, ring: int) -> int:
    return int(walls.begins[ring + 1] - walls.begins[ring])


@numba.njit(cache=True)
def _old(walls: Walls, ring: int, k: int) -> tuple[float, float]:
    """Return an old vertex by a number that may go on beyond the end of its ring."""
    if k >= walls.begins[ring + 1]:
        k -= _n_old(walls, ring)
    return walls.old[k, 0], walls.old[k, 1]


@numba.njit(cache=True)
def _ring_at(walls: Walls, foot: float) -> int:
    return int(walls.ring[int(foot) % len(walls.ring)])


@numba.njit(cache=True)
def _deviation(walls: Walls, start: float, end: float, a: FloatArray, b: FloatArray, limit: float) -> float:
    """Return the largest distance of the old vertices between two feet from the wall from a to b.

    Stops at the first that is over the limit.
    """
    ring = _ring_at(walls, start)
    n = _n_old(walls, ring)
    first = walls.begins[ring]
    if start >= first + n:
        start -= n
    if end < start:
        end += n
    ux, uy = b[0] - a[0], b[1] - a[1]
    square = ux * ux + uy * uy
    worst = 0.0
    for k in range(math.floor(start) + 1, math.ceil(end)):
        x, y = _old(walls, ring, k)
        share = min(max(((x - a[0]) * ux + (y - a[1]) * uy) / square, 0.0), 1.0) if square > 0.0 else 0.0
        gap = math.hypot(x - a[0] - share * ux, y - a[1] - share * uy)
        if gap > worst:
            worst = gap
            if worst > limit:
                break
    return worst


@numba.njit(cache=True)
def _nearest(
    walls: Walls, ring: int, low: float, high: float, x: FloatArray, limit: float
) -> tuple[float, float]:
    """Return the foot between two feet that is nearest to a place, and its distance."""
    best, least = low, math.inf
    for k in range(math.floor(low), math.ceil(high)):
        ax, ay = _old(walls, ring, k)
        bx, by = _old(walls, ring, k + 1)
        ux, uy = bx - ax, by - ay
        square = ux * ux + uy * uy
        share = ((x[0] - ax) * ux + (x[1] - ay) * uy) / square if square > 0.0 else 0.0
        share = min(max(share, max(low - k, 0.0)), min(high - k, 1.0))
        gap = math.hypot(x[0] - ax - share * ux, x[1] - ay - share * uy)
        if gap < least:
            best, least = k + share, gap
    if best >= walls.begins[ring + 1]:
        best -= _n_old(walls, ring)
    return best, least


@numba.njit(cache=True)
def _moved(walls: Walls) -> float:
    """Return how far walls have moved at most: old vertices from walls, and new vertices from old walls."""
    worst = 0.0
    for i in range(len(walls.old)):
        if walls.after[i] < 0:
            continue
        foot, b = walls.foot[i], walls.after[i]
        worst = max(worst, _deviation(walls, foot, walls.foot[b], walls.now[i], walls.now[b], math.inf))
        if walls.now[i, 0] != walls.old[i, 0] or walls.now[i, 1] != walls.old[i, 1]:
            ax, ay = _old(walls, walls.ring[i], math.floor(foot))
            bx, by = _old(walls, walls.ring[i], math.floor(foot) + 1)
            share = foot - math.floor(foot)
            gap = math.hypot(
                walls.now[i, 0] - ax - share * (bx - ax), walls.now[i, 1] - ay - share * (by - ay)
            )
            worst = max(worst, gap)
    return worst
