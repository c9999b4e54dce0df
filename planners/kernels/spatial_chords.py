"""Kernels of path following: joints on a path, and how far its chords are from it."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray

PARTS = 40
"""Into how many parts a link is cut."""


@njit(cache=True)
def _from_segment(
    px: float, py: float, pz: float, ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> float:
    """Return the squared distance of a point p from the segment a-b."""
    ex, ey, ez = bx - ax, by - ay, bz - az
    size = max(ex * ex + ey * ey + ez * ez, 1e-300)
    t = min(max(((px - ax) * ex + (py - ay) * ey + (pz - az) * ez) / size, 0.0), 1.0)
    return (px - ax - t * ex) ** 2 + (py - ay - t * ey) ** 2 + (pz - az - t * ez) ** 2


@njit(cache=True)
def chord_errors(points: FloatArray, length: float) -> tuple[float, float]:
    """Return how far chords get from the stretch of path that they span, and that from them.

    Parameters
    ----------
    points : array, shape (n, 3)
        The path. Chords end at all its points that are a chord or more from its start.
    length : float
        Of a chord.
    """
    link_to_path, path_to_link = 0.0, 0.0
    for i in range(1, points.shape[0]):
        k = i
        while k >= 0:
            apart = 0.0
            for c in range(3):
                apart += (points[k, c] - points[i, c]) ** 2
            if apart >= length * length:
                break
            k -= 1
        if k < 0:
            continue
        ax, ay, az = points[k, 0], points[k, 1], points[k, 2]
        bx, by, bz = points[i, 0], points[i, 1], points[i, 2]
        for j in range(k, i + 1):
            far = _from_segment(points[j, 0], points[j, 1], points[j, 2], ax, ay, az, bx, by, bz)
            path_to_link = max(path_to_link, far)
        for part in range(1, PARTS):
            t = part / PARTS
            px, py, pz = ax + t * (bx - ax), ay + t * (by - ay), az + t * (bz - az)
            least = np.inf
            for j in range(k, i):
                least = min(
                    least,
                    _from_segment(
                        px, py, pz, points[j, 0], points[j, 1], points[j, 2],
                        points[j + 1, 0], points[j + 1, 1], points[j + 1, 2],
                    ),
                )  # fmt: skip
            link_to_path = max(link_to_path, least)
    return np.sqrt(link_to_path), np.sqrt(path_to_link)


@njit(cache=True)
def place_on_path(
    points: FloatArray,
    arc: FloatArray,
    length: float,
    tips: FloatArray,
    base_pose: FloatArray,
    poses: FloatArray,
) -> None:
    """Put all joints on a path, for each place of the tip: each at the nearest place behind the one ahead.

    Parameters
    ----------
    points : array, shape (n, 3)
        The path. It begins at the base; behind it joints are on the axis.
    arc : array, shape (n,)
        Its arclength, strictly increasing.
    length : float
        Of a link.
    tips : array, shape (n_poses,)
        Arclengths, increasing.
    base_pose : array, shape (6,)
        Position and unit heading of the base.
    poses : array, shape (n_poses, n_joints, 3)
        Filled, the tip last.
    """
    squared, last = length * length, poses.shape[1] - 1
    for p in range(tips.shape[0]):
        k = min(max(np.searchsorted(arc, tips[p]) - 1, 0), arc.shape[0] - 2)
        share = (tips[p] - arc[k]) / (arc[k + 1] - arc[k])
        for c in range(3):
            poses[p, last, c] = points[k, c] + share * (points[k + 1, c] - points[k, c])
        for j in range(last - 1, -1, -1):
            while k >= 0:
                apart = 0.0
                for c in range(3):
                    apart += (points[k, c] - poses[p, j + 1, c]) ** 2
                if apart >= squared:
                    break
                k -= 1
            half, size, apart = 0.0, 0.0, 0.0
            if k < 0:
                for c in range(3):  # on the axis: base + t heading, with t at most 0
                    way = base_pose[c] - poses[p, j + 1, c]
                    half += way * base_pose[3 + c]
                    apart += way * way
                t = -half - np.sqrt(max(half * half - apart + squared, 0.0))
                for c in range(3):
                    poses[p, j, c] = base_pose[c] + t * base_pose[3 + c]
                continue
            for c in range(3):  # between samples k and k + 1, the latter nearer than a link
                step, way = points[k + 1, c] - points[k, c], points[k, c] - poses[p, j + 1, c]
                size += step * step
                half += step * way
                apart += way * way
            t = (-half - np.sqrt(max(half * half - size * (apart - squared), 0.0))) / size
            for c in range(3):
                poses[p, j, c] = points[k, c] + t * (points[k + 1, c] - points[k, c])
