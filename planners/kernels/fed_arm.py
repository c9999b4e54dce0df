"""Kernels for planners that sample configurations of an arm out of a straight feeder.

A state holds the feed in link lengths and the angles of joints 1 to n_links - 1, in rad; joint 0 never leaves
the feeder. A joint that has not passed the base is straight whatever the state says, and one that has may
bend as far as `release` times the way past the base: so every state means a pose that the feeder allows, the
pose changes continuously with the state, and no sample is lost to the feeder.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray

PARTS = 8
"""By how many parts of an edge it is judged how far joints move along it."""

MOST_LEVELS = 12
"""An edge is halved at most this often."""


@njit(cache=True)
def place_arm(
    state: FloatArray, length: float, release: float, base_pose: FloatArray, points: FloatArray
) -> int:
    """Compute where the part of the arm in front of the base is.

    Parameters
    ----------
    state : array, shape (n_links,)
        Feed in link lengths, then joint angles.
    length : float
        Of a link.
    release : float
        In rad per link length past the base.
    base_pose : array, shape (3,)
        (x, y, heading).
    points : array, shape (n_links + 1, 2)
        Filled with the base and the joints past it, tip last.

    Returns
    -------
    n : int
        Number of points filled.

    Notes
    -----
    The caller guarantees a feed between 0 and n_links.
    """
    n_links, heading = state.shape[0], base_pose[2]
    points[0, 0], points[0, 1] = base_pose[0], base_pose[1]
    first = n_links - int(np.ceil(state[0])) + 1  # of the joints past the base
    if first > n_links:
        return 1
    way = (state[0] - (n_links - first)) * length
    points[1, 0] = base_pose[0] + way * np.cos(heading)
    points[1, 1] = base_pose[1] + way * np.sin(heading)
    n = 2
    for joint in range(first, n_links):
        limit = release * (state[0] - (n_links - joint))
        heading += min(max(state[joint], -limit), limit)
        points[n, 0] = points[n - 1, 0] + length * np.cos(heading)
        points[n, 1] = points[n - 1, 1] + length * np.sin(heading)
        n += 1
    return n


@njit(cache=True)
def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Tell whether segments ab and cd meet; those along one line do not."""
    if max(a[0], b[0]) < min(c[0], d[0]) or max(c[0], d[0]) < min(a[0], b[0]):
        return False
    if max(a[1], b[1]) < min(c[1], d[1]) or max(c[1], d[1]) < min(a[1], b[1]):
        return False
    abx, aby, cdx, cdy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    of_c = abx * (c[1] - a[1]) - aby * (c[0] - a[0])
    of_d = abx * (d[1] - a[1]) - aby * (d[0] - a[0])
    if of_c * of_d > 0.0 or of_c == of_d:
        return False
    of_a = cdx * (a[1] - c[1]) - cdy * (a[0] - c[0])
    of_b = cdx * (b[1] - c[1]) - cdy * (b[0] - c[0])
    return bool(of_a * of_b <= 0.0)


@njit(cache=True)
def is_free(points: FloatArray, n: int, walls: FloatArray) -> bool:
    """Tell whether a chain of points meets neither a wall nor itself.

    Parameters
    ----------
    points : array, shape (at least n, 2)
        Of `place_arm`.
    n : int
        Number of points.
    walls : array, shape (n_walls, 2, 2)
        Segments.

    Notes
    -----
    The caller guarantees that the first point is in the free space.
    """
    for k in range(n - 2, -1, -1):  # the tip is what meets something most often
        for wall in range(walls.shape[0]):
            if _meet(points[k], points[k + 1], walls[wall, 0], walls[wall, 1]):
                return False
    for k in range(n - 1):
        for other in range(k + 2, n - 1):
            if _meet(points[k], points[k + 1], points[other], points[other + 1]):
                return False
    return True


@njit(cache=True)
def state_is_free(
    state: FloatArray,
    length: float,
    release: float,
    base_pose: FloatArray,
    walls: FloatArray,
    points: FloatArray,
) -> bool:
    """Tell whether the arm is free; arguments as in `place_arm` and `is_free`."""
    return is_free(points, place_arm(state, length, release, base_pose, points), walls)


@njit(cache=True)
def edge_levels(
    a: FloatArray,
    b: FloatArray,
    length: float,
    release: float,
    base_pose: FloatArray,
    step: float,
    points: FloatArray,
) -> int:
    """Compute how often the edge from a to b must be halved for no joint to move more than a step.

    It is judged by what joints move in each of some parts of the edge.
    """
    n_links = a.shape[0]
    before, state = np.empty((n_links + 1, 2)), np.empty(n_links)
    n_before, most = place_arm(a, length, release, base_pose, before), 0.0
    for part in range(1, PARTS + 1):
        for k in range(n_links):
            state[k] = a[k] + (b[k] - a[k]) * part / PARTS
        n = place_arm(state, length, release, base_pose, points)
        for back in range(1, min(n, n_before) + 1):  # counted from the tip: joints come out at the base
            most = max(
                most,
                np.hypot(
                    points[n - back, 0] - before[n_before - back, 0],
                    points[n - back, 1] - before[n_before - back, 1],
                ),
            )
        before[:n], n_before = points[:n], n
    levels = 0
    while levels < MOST_LEVELS and PARTS * most > step * (1 << levels):
        levels += 1
    return levels


@njit(cache=True)
def edge_is_free(
    a: FloatArray,
    b: FloatArray,
    length: float,
    release: float,
    base_pose: FloatArray,
    walls: FloatArray,
    step: float,
    points: FloatArray,
) -> bool:
    """Tell whether the arm is free at b and all along the edge from a to b, in steps.

    Parameters
    ----------
    a, b : array, shape (n_links,)
        States; a is known to be free.
    length, release, base_pose, walls, points
        As in `place_arm` and `is_free`.
    step : float
        How far a joint may move from one check to the next, in maze units.
    """
    n = place_arm(b, length, release, base_pose, points)
    if not is_free(points, n, walls):
        return False
    levels = edge_levels(a, b, length, release, base_pose, step, points)
    state = np.empty(a.shape[0])
    for level in range(1, levels + 1):  # coarse to fine, for what is not free shows soon
        parts = 1 << level
        for part in range(1, parts, 2):
            for k in range(a.shape[0]):
                state[k] = a[k] + (b[k] - a[k]) * part / parts
            n = place_arm(state, length, release, base_pose, points)
            if not is_free(points, n, walls):
                return False
    return True
