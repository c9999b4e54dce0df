"""Kernels of the track planner: the movement of all samples that meets the constraints best."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.track_types import ROW_WIDTH, Rows
from planners.kernels.types import FloatArray, IntArray

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
def _add_penalty(
    index: IntArray,
    slope: FloatArray,
    wanted: float,
    weight: float,
    band: FloatArray,
    low: IntArray,
    right: FloatArray,
) -> None:
    """Add weight (slope . x - wanted)^2 / 2 to the banded system; entries of `index` below 0 do not count."""
    w, least = band.shape[1] - 1, band.shape[0]
    for q in range(index.shape[0]):
        if index[q] >= 0:
            least = min(least, index[q])
    for q in range(index.shape[0]):
        i = index[q]
        if i < 0:
            continue
        low[i] = min(low[i], least)
        right[i] += weight * wanted * slope[q]
        for p in range(index.shape[0]):
            k = index[p]
            if 0 <= k <= i:
                band[i, k - i + w] += weight * slope[q] * slope[p]


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
    w, n, spacing = band.shape[1] - 1, points.shape[0], 1.0 / (fixed - 1)
    bend = np.array([1.0, -2.0, 1.0])
    index, slope = np.empty(3, dtype=np.int64), np.empty(3)
    move[:] = 0.0
    for _ in range(PASSES):
        band[:], right[:] = 0.0, 0.0
        for i in range(n - fixed):
            band[i, w] = tether * spacing
            low[i] = max(0, i - 2)
        for r in range(n_rows):
            left = rows.wanted[r]
            for q in range(ROW_WIDTH):
                if rows.samples[r, q] >= 0:
                    left -= rows.slope[r, q] * move[rows.samples[r, q]]
            if left > 0.0:
                weight = rows.weight[r] * spacing
                _add_penalty(rows.samples[r], rows.slope[r], rows.wanted[r], weight, band, low, right)
        for i in range(fixed - 1, n - 1):
            for q in range(3):
                index[q] = i + q - 1 - fixed
            _add_penalty(index, bend, 0.0, stiff / spacing**3, band, low, right)
            for a in range(2):
                for q in range(3):
                    slope[q] = bend[q] * normals[i + q - 1, a]
                bent = points[i - 1, a] - 2.0 * points[i, a] + points[i + 1, a]
                _add_penalty(index, slope, -bent, smooth / spacing**3, band, low, right)
        factorise(band, low)
        move[:] = right
        substitute(band, low, move)
