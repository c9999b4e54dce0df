"""Kernels for rays and walls."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray

PARALLEL = 1e-200
"""Cross products below this would overflow as divisors."""


@njit(cache=True)
def cast_rays(origins: FloatArray, directions: FloatArray, walls: FloatArray, lengths: FloatArray) -> None:
    """Compute the exact length of each ray up to the first wall.

    Parameters
    ----------
    origins, directions : array, shape (n, 2)
        Directions are unit vectors.
    walls : array, shape (n_walls, 2, 2)
        Segments.
    lengths : array, shape (n,)
        Filled; infinite where no wall is hit.

    Notes
    -----
    The caller guarantees the shapes. Walls parallel to a ray are met at their ends by their neighbours.
    """
    for n in range(origins.shape[0]):
        px, py = origins[n, 0], origins[n, 1]
        dx, dy = directions[n, 0], directions[n, 1]
        best = np.inf
        for k in range(walls.shape[0]):
            ax, ay = walls[k, 0, 0] - px, walls[k, 0, 1] - py
            ex, ey = walls[k, 1, 0] - walls[k, 0, 0], walls[k, 1, 1] - walls[k, 0, 1]
            cross = dx * ey - dy * ex
            if abs(cross) < PARALLEL:
                continue
            # From each end by itself, so that two walls that share it agree and no ray slips between them.
            bx, by = walls[k, 1, 0] - px, walls[k, 1, 1] - py
            start, end = ax * dy - ay * dx, bx * dy - by * dx
            if (start > 0.0 and end > 0.0) or (start < 0.0 and end < 0.0):
                continue
            # A place between the ends, however near to parallel the wall is.
            share = start / (start - end) if start != end else 0.0
            along_ray = (ax + share * ex) * dx + (ay + share * ey) * dy
            if 0.0 <= along_ray < best:
                best = along_ray
        lengths[n] = best
