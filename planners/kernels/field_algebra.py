"""Kernels of small linear algebra: Cholesky's factors, and a task with a wish in its null space."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray


@njit(cache=True)
def factorise(matrix: FloatArray, n: int) -> None:
    """Replace the lower triangle of a positive definite n x n matrix by its Cholesky factor."""
    for j in range(n):
        for i in range(j, n):
            value = matrix[i, j]
            for m in range(j):
                value -= matrix[i, m] * matrix[j, m]
            if i == j:
                matrix[j, j] = np.sqrt(max(value, 1e-12))
            else:
                matrix[i, j] = value / matrix[j, j]


@njit(cache=True)
def solve_lower(factor: FloatArray, n: int, x: FloatArray) -> None:
    """Solve factor y = x in place."""
    for i in range(n):
        value = x[i]
        for j in range(i):
            value -= factor[i, j] * x[j]
        x[i] = value / factor[i, i]


@njit(cache=True)
def solve_upper(factor: FloatArray, n: int, x: FloatArray) -> None:
    """Solve factor^T y = x in place."""
    for i in range(n - 1, -1, -1):
        value = x[i]
        for j in range(i + 1, n):
            value -= factor[j, i] * x[j]
        x[i] = value / factor[i, i]


@njit(cache=True)
def redundant_velocity(
    jacobian: FloatArray, n: int, task: FloatArray, wish: FloatArray, damping: float, velocity: FloatArray
) -> None:
    """Compute the velocity that follows a task in the plane, and a wish as far as the task leaves room.

    It is J^T (J J^T + damping^2 I)^-1 task + (I - J^+ J) wish, with the pseudo-inverse J^+.

    Parameters
    ----------
    jacobian : array, shape (2, at least n)
        Of the point that the task is about.
    n : int
        Number of coordinates.
    task : array, shape (2,)
        Wanted velocity of that point.
    wish : array, shape (at least n,)
        Wanted velocity of the coordinates.
    damping : float
        Positive; how much of the task is given up where it would take fast coordinates.
    velocity : array, shape (at least n,)
        Filled.
    """
    xx, xy, yy, wish_x, wish_y = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        x, y = jacobian[0, i], jacobian[1, i]
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        wish_x, wish_y = wish_x + x * wish[i], wish_y + y * wish[i]
    # J J^T by its two eigenvectors: a direction in which nothing moves the point has no inverse.
    mean, spread = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    pull_x, pull_y = 0.0, 0.0
    for side in range(2):
        value = mean + spread if side == 0 else mean - spread
        ex, ey = (np.cos(angle), np.sin(angle)) if side == 0 else (-np.sin(angle), np.cos(angle))
        wanted = (ex * task[0] + ey * task[1]) / (max(value, 0.0) + damping**2)
        if value > 1e-12 * (mean + spread):
            wanted -= (ex * wish_x + ey * wish_y) / value
        pull_x, pull_y = pull_x + wanted * ex, pull_y + wanted * ey
    for i in range(n):
        velocity[i] = wish[i] + jacobian[0, i] * pull_x + jacobian[1, i] * pull_y
