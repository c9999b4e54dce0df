"""The exact building block of all planners here: the free directions of a rod that pivots at a point."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray

TWO_PI = 2.0 * np.pi

WHOLE_TURN = TWO_PI - 1e-9
"""An interval of at least this extent is all directions."""


@njit(cache=True)
def _blocked_by_wall(
    px: float, py: float, length: float, ax: float, ay: float, bx: float, by: float
) -> tuple[bool, float, float]:
    """Return the directions from p that meet the part of a wall within the rod's reach: start and extent."""
    ax, ay, bx, by = ax - px, ay - py, bx - px, by - py
    ex, ey = bx - ax, by - ay
    squared = ex * ex + ey * ey
    if squared == 0.0:
        return False, 0.0, 0.0
    middle = -(ax * ex + ay * ey) / squared
    offset = (ax * ey - ay * ex) ** 2 / squared
    if offset > length * length:
        return False, 0.0, 0.0
    half = np.sqrt((length * length - offset) / squared)
    first, last = max(0.0, middle - half), min(1.0, middle + half)
    if first > last:
        return False, 0.0, 0.0
    start = np.arctan2(ay + first * ey, ax + first * ex)
    turn = np.arctan2(ay + last * ey, ax + last * ex) - start
    if turn > np.pi:
        turn -= TWO_PI
    elif turn < -np.pi:
        turn += TWO_PI
    if turn < 0.0:
        start, turn = start + turn, -turn
    return True, start % TWO_PI, turn


@njit(cache=True)
def free_directions(
    px: float, py: float, length: float, walls: FloatArray, pad: float, blocked: FloatArray, gaps: FloatArray
) -> int:
    """Compute the directions in which a rod from p meets no wall.

    A wall blocks exactly the directions under which the part of it inside the circle of radius `length`
    about p is seen; what no wall blocks is free.

    Parameters
    ----------
    px, py : float
        The pivot.
    length : float
        Of the rod.
    walls : array, shape (n_walls, 2, 2)
        Segments.
    pad : float
        Each free interval is made shorter by this much at both ends, in rad.
    blocked : array, shape (n_walls + 1, 2)
        Work space.
    gaps : array, shape (n_walls + 1, 2)
        Filled with the free intervals (start, end), end > start, start in [-2 pi, 2 pi).

    Returns
    -------
    n_gaps : int
        Number of free intervals.

    Notes
    -----
    The caller guarantees that p is not on a wall: there, every direction is blocked or none.
    """
    n = 0
    for k in range(walls.shape[0]):
        ax, ay, bx, by = walls[k, 0, 0], walls[k, 0, 1], walls[k, 1, 0], walls[k, 1, 1]
        if min(ax, bx) > px + length or max(ax, bx) < px - length:
            continue
        if min(ay, by) > py + length or max(ay, by) < py - length:
            continue
        hit, start, turn = _blocked_by_wall(px, py, length, ax, ay, bx, by)
        if not hit:
            continue
        place = n  # insertion sort by start: few walls are within reach
        while place > 0 and blocked[place - 1, 0] > start:
            blocked[place] = blocked[place - 1]
            place -= 1
        blocked[place, 0], blocked[place, 1] = start, start + turn
        n += 1
    if n == 0:
        gaps[0, 0], gaps[0, 1] = 0.0, TWO_PI
        return 1
    # The largest end, one turn back, is where the first gap begins: the gap across 0 is no special case.
    reach = blocked[0, 1]
    for k in range(1, n):
        reach = max(reach, blocked[k, 1])
    reach -= TWO_PI
    n_gaps = 0
    for k in range(n):
        if blocked[k, 0] - reach > 2.0 * pad:
            gaps[n_gaps, 0], gaps[n_gaps, 1] = reach + pad, blocked[k, 0] - pad
            n_gaps += 1
        reach = max(reach, blocked[k, 1])
    return n_gaps


@njit(cache=True)
def nearest_gap(direction: float, gaps: FloatArray, n_gaps: int) -> tuple[float, float]:
    """Return the free interval nearest to a direction, moved by whole turns so that it is beside it.

    Notes
    -----
    The caller guarantees n_gaps >= 1.
    """
    best, best_start, best_end = np.inf, 0.0, 0.0
    for k in range(n_gaps):
        centre = 0.5 * (gaps[k, 0] + gaps[k, 1])
        turns = TWO_PI * np.round((direction - centre) / TWO_PI)
        start, end = gaps[k, 0] + turns, gaps[k, 1] + turns
        away = max(start - direction, direction - end, 0.0)
        if away < best:
            best, best_start, best_end = away, start, end
    return best_start, best_end
