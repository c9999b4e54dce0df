"""Kernels of the backbone: a chain of links is fitted to a curve by least squares, feed by feed."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray, IntArray

DONE, JUMP, PAST, FULL, PAUSED = 0, 1, 2, 3, 4
"""How leading a chain along a curve ends: with the tip at the goal; where a joint would jump; with the tip
past the goal; without room for poses; at the number of poses at which it was to pause."""

TICKS = 4096
"""Smallest feed between poses, as a part of a link: a power of two, so that no release is stepped over."""

STRIDE, LEAST_STRIDE = TICKS // 64, TICKS // 1024
"""Largest feed between poses, in ticks, and the one at which joints that still move too far are turned over:
where the fit is least at two places, it changes from one to the other."""

SLOWLY, MOST_PARTS = 1.5, 40
"""Poses per largest movement that turning over takes, and most of them: no link swings far."""

SAMPLES = 4
"""Places on each link whose distance from the curve counts, the end included and the start not."""

DAMPING = 1e-3
"""What a turn of a link costs, against the squared distances in link lengths."""

STIFFNESS = 0.05
"""The same of the angle of a joint half a link past the base; it grows without bound towards the base."""

ITERATIONS, SETTLED = 8, 1e-4
"""Most steps of a fit, and the turn of all links, in rad, at which it ends."""

LARGEST_TURN = 0.2
"""Of a link in one step, in rad."""

OF_RELEASE = 0.9
"""Share of the feeder's limit that joint angles keep."""


@njit(cache=True)
def _nearest(curve: FloatArray, x: float, y: float, start: int) -> int:
    """Walk from a point of the curve to the one that is nearest to (x, y) thereabouts."""
    k = start
    here = (curve[k, 0] - x) ** 2 + (curve[k, 1] - y) ** 2
    for ahead in (1, -1):
        while 0 <= k + ahead < curve.shape[0]:
            there = (curve[k + ahead, 0] - x) ** 2 + (curve[k + ahead, 1] - y) ** 2
            if there >= here:
                break
            k, here = k + ahead, there
    return k


@njit(cache=True)
def _normal_equations(
    curve: FloatArray, normals: FloatArray, n: int, headings: FloatArray, joints: FloatArray,
    nearest: IntArray, matrix: FloatArray, slope: FloatArray,
) -> None:  # fmt: skip
    """Fill the equations of one step, for headings of n links numbered from the tip, in link lengths.

    A place on a link is counted by its distance across the curve alone: it may slide along it. Turning link j
    moves all of link i < j, so what links beyond add up to is summed from the tip on.
    """
    xx, xy, yy, rx, ry = 0.0, 0.0, 0.0, 0.0, 0.0
    cos, sin = np.cos(headings[:n]), np.sin(headings[:n])
    for i in range(n):
        ex, ey = cos[i], sin[i]
        # Sums over the places: of normals' products, and of normals times distances; times share once, twice.
        sum_xx, sum_xy, sum_yy, sum_rx, sum_ry = 0.0, 0.0, 0.0, 0.0, 0.0
        one_xx, one_xy, one_yy, one_rx, one_ry, two = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for sample in range(SAMPLES):
            share = (sample + 1.0) / SAMPLES
            x, y = joints[i + 1, 0] + share * ex, joints[i + 1, 1] + share * ey
            k = _nearest(curve, x, y, nearest[i, sample])
            nearest[i, sample] = k
            nx, ny = normals[k, 0], normals[k, 1]
            aside = nx * (x - curve[k, 0]) + ny * (y - curve[k, 1])
            sum_xx, sum_xy, sum_yy = sum_xx + nx * nx, sum_xy + nx * ny, sum_yy + ny * ny
            sum_rx, sum_ry = sum_rx + nx * aside, sum_ry + ny * aside
            sx, sy = share * nx, share * ny
            one_xx, one_xy, one_yy = one_xx + sx * nx, one_xy + sx * ny, one_yy + sy * ny
            one_rx, one_ry = one_rx + sx * aside, one_ry + sy * aside
            two += (sy * ex - sx * ey) ** 2
        matrix[i, i] = two + ey * ey * xx - 2.0 * ey * ex * xy + ex * ex * yy
        vx = -ey * (one_xx + xx) + ex * (one_xy + xy)
        vy = -ey * (one_xy + xy) + ex * (one_yy + yy)
        for j in range(i + 1, n):
            matrix[i, j] = matrix[j, i] = cos[j] * vy - sin[j] * vx
        slope[i] = -ey * (one_rx + rx) + ex * (one_ry + ry)
        xx, xy, yy, rx, ry = xx + sum_xx, xy + sum_xy, yy + sum_yy, rx + sum_rx, ry + sum_ry


@njit(cache=True)
def _place(n: int, past: float, axis: float, headings: FloatArray, joints: FloatArray) -> None:
    """Place the joints of n links, the tip first, the last one `past` link lengths past the base."""
    joints[n, 0], joints[n, 1] = past * np.cos(axis), past * np.sin(axis)
    for i in range(n - 1, -1, -1):
        joints[i, 0] = joints[i + 1, 0] + np.cos(headings[i])
        joints[i, 1] = joints[i + 1, 1] + np.sin(headings[i])


@njit(cache=True)
def _fit(
    curve: FloatArray, normals: FloatArray, n: int, past: float, axis: float, release: float,
    headings: FloatArray, joints: FloatArray, nearest: IntArray,
) -> None:  # fmt: skip
    """Turn n links so that they are near the curve: damped Gauss-Newton steps from where they are."""
    _place(n, past, axis, headings, joints)
    if n == 0:
        return
    matrix, slope = np.empty((n, n)), np.empty(n)
    limit = min(OF_RELEASE * release * past, np.pi)
    stiffness = STIFFNESS * (1.0 / max(past, 1e-9) - 1.0) ** 2
    for _ in range(ITERATIONS):
        _normal_equations(curve, normals, n, headings, joints, nearest, matrix, slope)
        for i in range(n):
            matrix[i, i] += DAMPING
        matrix[n - 1, n - 1] += stiffness
        slope[n - 1] += stiffness * (headings[n - 1] - axis)
        turns = np.linalg.solve(matrix, slope)
        largest = np.max(np.abs(turns))
        scale = min(1.0, LARGEST_TURN / max(largest, 1e-300))
        for i in range(n):
            headings[i] -= scale * turns[i]
        headings[n - 1] = min(max(headings[n - 1], axis - limit), axis + limit)
        _place(n, past, axis, headings, joints)
        if largest < SETTLED:
            return


@njit(cache=True)
def _moved(n: int, joints: FloatArray, earlier: FloatArray) -> float:
    """Return how far the first n joints have moved at most."""
    most: float = 0.0
    for i in range(n):
        most = max(most, np.hypot(joints[i, 0] - earlier[i, 0], joints[i, 1] - earlier[i, 1]))
    return most


@njit(cache=True)
def _turn_over(n_poses: int, steps: float, feeds: IntArray, headings: FloatArray) -> int:
    """Put poses before pose `n_poses`, at the feed of the pose before it, that turn all links evenly to it.

    Returns the new place of the pose, or minus the old one if it is so far away that links would swing round.
    """
    parts: int = int(np.ceil(SLOWLY * steps))
    if parts > MOST_PARTS:
        return -n_poses
    parts = min(parts, feeds.shape[0] - n_poses)
    before, pose = n_poses - 1, n_poses + parts - 1
    headings[pose] = headings[n_poses]
    for part in range(1, parts):
        share = part / parts
        headings[before + part] = (1.0 - share) * headings[before] + share * headings[pose]
        feeds[before + part] = feeds[before]
    return pose


@njit(cache=True)
def lead_along(
    curve: FloatArray, normals: FloatArray, axis: float, goal: FloatArray, stop: float, release: float,
    step: float, begin: int, pause: int, feeds: IntArray, headings: FloatArray, joints: FloatArray,
    nearest: IntArray,
) -> tuple[int, int]:  # fmt: skip
    """Lead a chain along a curve, fitted to it at every feed; no joint moves farther than `step` in between.

    Parameters
    ----------
    curve, normals : array, shape (n, 2)
        In link lengths, the base at the origin: points close to each other, and unit vectors across.
    axis : float
        Heading of the base, in rad.
    goal : array, shape (2,)
        In link lengths.
    stop : float
        The chain ends with the tip this near to the goal.
    release : float
        How far a joint may bend, in rad per link length that it is past the base.
    step : float
        In link lengths.
    begin, pause : int
        Number of poses that are there already, at least 1, and at which to pause.
    feeds : array, shape (n_max,)
        Filled with the feed of each pose, in ticks; the first is 0.
    headings : array, shape (n_max, n_links)
        Filled with the headings of the links past the base, the tip first, in rad; the first are the axis'.
    joints : array, shape (n_links + 1, 2)
        Those of the last pose, the tip first.
    nearest : array, shape (n_links, SAMPLES)
        Where on the curve the places on each link were last.

    Returns
    -------
    n_poses, ending : int
        Number of poses, and one of DONE, JUMP, PAST, FULL and PAUSED.
    """
    now, at = joints.copy(), nearest.copy()
    n_poses, stride = begin, STRIDE
    while n_poses < pause:
        if n_poses == feeds.shape[0]:
            return n_poses, FULL
        feed = feeds[n_poses - 1] + stride
        n = feed // TICKS
        if n >= headings.shape[1]:
            return n_poses, PAST
        headings[n_poses] = headings[n_poses - 1]
        at[:] = nearest
        past = (feed - n * TICKS) / TICKS
        _fit(curve, normals, n, past, axis, release, headings[n_poses], now, at)
        # The joint behind the last one has come out just now or is on the axis.
        moved = _moved(n, now, joints)
        if moved > step:
            if stride > LEAST_STRIDE:
                stride //= 2
                continue
            n_poses = _turn_over(n_poses, moved / step, feeds, headings)
            if n_poses < 0:
                return -n_poses, JUMP
        joints[:], nearest[:], feeds[n_poses] = now, at, feed
        n_poses += 1
        x, y = joints[0]
        if np.hypot(x - goal[0], y - goal[1]) <= stop:
            return n_poses, DONE
        last = curve.shape[0] - 1
        ahead = (x - curve[last, 0]) * normals[last, 1] - (y - curve[last, 1]) * normals[last, 0]
        if nearest[0, SAMPLES - 1] == last and ahead > stop:
            return n_poses, PAST
        if stride < STRIDE and feed % (2 * stride) == 0:
            stride *= 2
    return n_poses, PAUSED
