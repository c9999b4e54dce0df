"""A rod's path made shorter: straight moves with one turn in place of stretches through many triangles."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.rod import free_directions
from planners.kernels.rod_search import sweep_is_free
from planners.kernels.rod_space import SLACK, RodSpace, beside
from planners.kernels.types import FloatArray

STRIDES = (128, 64, 32, 24, 16, 12, 8, 6, 4, 3, 2)
"""How many places a straight move may stand for, tried in this order."""


@njit(cache=True)
def _turn_is_free(
    x: float, y: float, before: float, after: float, length: float, space: RodSpace, work: FloatArray
) -> bool:
    """Check that a rod may turn about its tail from one heading to another, without a whole turn."""
    low, high = min(before, after), max(before, after)
    n_gaps = free_directions(x, y, length, space.walls, SLACK, work[0], work[1])
    for k in range(n_gaps):
        start, end = beside(low, high, work[1, k, 0], work[1, k, 1])
        if start <= low and high <= end:
            return True
    return False


@njit(cache=True)
def _direct_heading(
    p: FloatArray,
    q: FloatArray,
    before: float,
    after: float,
    length: float,
    space: RodSpace,
    work: FloatArray,
) -> float:
    """Return a heading at which a rod may be moved from p straight to q, turning there and here; else nan."""
    for heading in (before, after, 0.5 * (before + after)):
        if (
            sweep_is_free(p[0], p[1], q[0], q[1], heading, length, space)
            and (heading == before or _turn_is_free(p[0], p[1], before, heading, length, space, work))
            and (heading == after or _turn_is_free(q[0], q[1], heading, after, length, space, work))
        ):
            return heading
    return np.nan


@njit(cache=True)
def shorten(places: FloatArray, length: float, space: RodSpace) -> FloatArray:
    """Replace stretches of a rod's path by one straight move with a turn before or after it, where free.

    Parameters
    ----------
    places : array, shape (n, 3)
        (x, y, heading) of the tail; neighbours differ by a move or by a turn.
    length : float
        Of the rod.
    space : RodSpace
        Its walls are read.

    Returns
    -------
    places : array, shape (m, 3)
        Of the same kind, from the same first to the same last place, and no longer.
    """
    n = places.shape[0]
    work = np.empty((2, space.walls.shape[0] + 1, 2))
    new = np.empty((3 * n, 3))
    spent = np.zeros(n)
    for k in range(1, n):
        moved = np.hypot(places[k, 0] - places[k - 1, 0], places[k, 1] - places[k - 1, 1])
        spent[k] = spent[k - 1] + moved + 0.5 * length * abs(places[k, 2] - places[k - 1, 2])
    new[0] = places[0]
    here, m = 0, 1
    while here < n - 1:
        there, heading = here + 1, np.nan
        for stride in STRIDES:
            there = min(here + stride, n - 1)
            p, q = places[here], places[there]
            direct = np.hypot(q[0] - p[0], q[1] - p[1]) + 0.5 * length * abs(q[2] - p[2])
            if direct < spent[there] - spent[here]:
                heading = _direct_heading(p, q, p[2], q[2], length, space, work)
            if not np.isnan(heading):
                break
        if np.isnan(heading):
            there = here + 1
        else:
            if heading != places[here, 2]:
                new[m, 0], new[m, 1], new[m, 2] = places[here, 0], places[here, 1], heading
                m += 1
            if heading != places[there, 2]:
                new[m, 0], new[m, 1], new[m, 2] = places[there, 0], places[there, 1], heading
                m += 1
        new[m] = places[there]
        m, here = m + 1, there
    return new[:m].copy()
