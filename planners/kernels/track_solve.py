"""Kernels of the track planner: the movement of all samples that meets the constraints best."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.track_types import ROW_WIDTH, Rows
from planners.kernels.types import BoolArray, FloatArray, IntArray

PASSES = 3
"""How often the rows that count are chosen: first those violated now, then those the movement violates."""


@njit(cache=True)
def find_normals(points: FloatArray, normals: FloatArray) -> None:
    """Fill the unit normals to the left of a track, shape (n, 2), across the neighbours of each sample."""
    n = points.shape[0]
    for i in range(n):
        a, b = max(i - 1, 0), min(i + 1, n - 1)
        x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
        size = max(np.sqrt(x * x + y * y), 1e-12)
        normals[i, 0], normals[i, 1] = -y / size, x / size


@njit(cache=True)
def project_rows(n_rows: int, fixed: int, normals: FloatArray, rows: Rows) -> int:
    """Turn rows of movements in the plane into rows of movements along the normals; return their spread.

    From here on `rows.samples` counts from the first sample that may move.
    """
    spread = 2
    for r in range(n_rows):
        least, most = normals.shape[0], -1
        for q in range(ROW_WIDTH):
            i = rows.samples[r, q]
            rows.samples[r, q] = -1
            if i >= fixed:
                rows.slope[r, q] = rows.factor[r, q, 0] * normals[i, 0] + rows.factor[r, q, 1] * normals[i, 1]
                rows.samples[r, q] = i - fixed
                least, most = min(least, i), max(most, i)
        spread = max(spread, most - least)
    return spread


@njit(cache=True, fastmath=True)
def factorise(band: FloatArray, low: IntArray) -> None:
    """Replace a symmetric positive matrix by its Cholesky factor, inside its envelope.

    Row r of `band`, shape (n, w + 1), holds the columns r - w to r; those before `low[r]` are 0.
    """
    n, w = band.shape[0], band.shape[1] - 1
    for r in range(n):
        for c in range(low[r], r):
            total = band[r, c - r + w]
            for p in range(max(low[r], low[c]), c):
                total -= band[r, p - r + w] * band[c, p - c + w]
            band[r, c - r + w] = total / band[c, w]
        total = band[r, w]
        for p in range(low[r], r):
            total -= band[r, p - r + w] ** 2
        band[r, w] = np.sqrt(max(total, 1e-30))


@njit(cache=True, fastmath=True)
def substitute(band: FloatArray, low: IntArray, x: FloatArray) -> None:
    """Solve with the factor: `x`, shape (n,), is the right side first and the solution then."""
    n, w = band.shape[0], band.shape[1] - 1
    for r in range(n):
        total = x[r]
        for p in range(low[r], r):
            total -= band[r, p - r + w] * x[p]
        x[r] = total / band[r, w]
    for r in range(n - 1, -1, -1):
        x[r] /= band[r, w]
        for p in range(low[r], r):
            x[p] -= band[r, p - r + w] * x[r]


@njit(cache=True)
def _add_bending(
    points: FloatArray, normals: FloatArray, fixed: int, smooth: float, stiff: float, band: FloatArray,
    right: FloatArray,
) -> None:  # fmt: skip
    """Add the bending of the track after the movement, and of the movement, to the banded system."""
    w, n, spacing = band.shape[1] - 1, points.shape[0], 1.0 / (fixed - 1)
    smooth, stiff = smooth / spacing**3, stiff / spacing**3
    for i in range(fixed - 1, n - 1):
        bent_x = points[i - 1, 0] - 2.0 * points[i, 0] + points[i + 1, 0]
        bent_y = points[i - 1, 1] - 2.0 * points[i, 1] + points[i + 1, 1]
        for q in range(3):
            r, a = i + q - 1 - fixed, -2.0 if q == 1 else 1.0
            if r < 0:
                continue
            x, y = normals[r + fixed, 0], normals[r + fixed, 1]
            right[r] -= smooth * a * (x * bent_x + y * bent_y)
            for p in range(max(0, q - r), q + 1):
                b = -2.0 if p == 1 else 1.0
                turn = x * normals[r + fixed - q + p, 0] + y * normals[r + fixed - q + p, 1]
                band[r, w - q + p] += a * b * (stiff + smooth * turn)


@njit(cache=True)
def _add_rows(
    samples: IntArray, slope: FloatArray, wanted: FloatArray, weight: FloatArray, counts: BoolArray,
    spacing: float, band: FloatArray, low: IntArray, right: FloatArray,
) -> None:  # fmt: skip
    """Add weight (slope . x - wanted)^2 / 2 of the rows that count to the banded system."""
    w = band.shape[1] - 1
    for r in range(counts.shape[0]):
        if not counts[r]:
            continue
        least, heavy = band.shape[0], weight[r] * spacing
        for q in range(ROW_WIDTH):
            if samples[r, q] >= 0:
                least = min(least, samples[r, q])
        for q in range(ROW_WIDTH):
            i = samples[r, q]
            if i < 0:
                continue
            low[i] = min(low[i], least)
            right[i] += heavy * wanted[r] * slope[r, q]
            for p in range(ROW_WIDTH):
                k = samples[r, p]
                if 0 <= k <= i:
                    band[i, k - i + w] += heavy * slope[r, q] * slope[r, p]


@njit(cache=True)
def _choose_rows(
    samples: IntArray, slope: FloatArray, wanted: FloatArray, move: FloatArray, counts: BoolArray
) -> bool:
    """Choose the rows that a movement violates; tell whether they are others than before."""
    changed = False
    for r in range(counts.shape[0]):
        left = wanted[r]
        for q in range(ROW_WIDTH):
            if samples[r, q] >= 0:
                left -= slope[r, q] * move[samples[r, q]]
        changed |= counts[r] != (left > 0.0)
        counts[r] = left > 0.0
    return changed


@njit(cache=True)
def solve_rows(
    points: FloatArray,
    normals: FloatArray,
    fixed: int,
    n_rows: int,
    rows: Rows,
    smooth: float,
    stiff: float,
    tether: float,
    band: FloatArray,
    low: IntArray,
    move: FloatArray,
    right: FloatArray,
) -> None:
    """Find the movement that meets the rows best: least squares on those that would be violated.

    Samples move along their normals; along the track they would change nothing.

    Parameters
    ----------
    points, normals : array, shape (n, 2)
        The track; the first `fixed` samples never move.
    smooth, stiff, tether : float
        Weights of the track's bending, of the movement's bending and of the movement itself.
    band : array, shape (n - fixed, w + 1)
        Work space, wide enough for every row.
    low, right : array, shape (n - fixed,)
        Work space.
    move : array, shape (n - fixed,)
        Filled.
    """
    w, n, spacing = band.shape[1] - 1, points.shape[0] - fixed, 1.0 / (fixed - 1)
    counts = np.zeros(n_rows, dtype=np.bool_)
    bending, bent = np.zeros((n, 3)), np.zeros(n)
    bending[:, 2] = tether * spacing
    _add_bending(points, normals, fixed, smooth, stiff, bending, bent)
    move[:] = 0.0
    for number in range(PASSES):
        changed = _choose_rows(rows.samples, rows.slope, rows.wanted, move, counts)
        if number > 0 and not changed:
            return
        for i in range(n):
            low[i] = max(0, i - 2)
            right[i] = bent[i]
            band[i, : w - 2] = 0.0
            band[i, w - 2], band[i, w - 1], band[i, w] = bending[i, 0], bending[i, 1], bending[i, 2]
        _add_rows(rows.samples, rows.slope, rows.wanted, rows.weight, counts, spacing, band, low, right)
        factorise(band, low)
        move[:] = right
        substitute(band, low, move)
