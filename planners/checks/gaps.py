"""Distances and gaps between segments, many at once.

Points are complex numbers, in the frame of the other segment, which runs from 0 to its length along the real
axis. All arrays have shape (n,).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray
from planners.checks.scene import BoolArray

ComplexArray = NDArray[np.complex128]


def complex_from_points(points: FloatArray) -> ComplexArray:
    """Return points, shape (..., 2), as complex numbers, shape (...)."""
    return np.ascontiguousarray(points).view(np.complex128)[..., 0]


def segment_distances(start: ComplexArray, end: ComplexArray, length: FloatArray) -> FloatArray:
    """Compute the distances of segments, or points where both ends are one, from those on the real axis."""
    along = end - start
    square = along.real**2 + along.imag**2
    square[square == 0.0] = 1.0
    distance = np.abs(start - np.clip(start.real, 0.0, length))
    np.minimum(distance, np.abs(end - np.clip(end.real, 0.0, length)), out=distance)
    for corner in (np.zeros(len(length)), length):
        offset = corner - start
        share = np.clip((along.real * offset.real + along.imag * offset.imag) / square, 0.0, 1.0)
        np.minimum(distance, np.abs(offset - share * along), out=distance)
    near, far = cross(along, -start), cross(along, length - start)
    distance[(start.imag * end.imag < 0.0) & (near * far < 0.0)] = 0.0
    return distance


def segment_gaps(
    before: tuple[ComplexArray, ComplexArray],
    after: tuple[ComplexArray, ComplexArray],
    length: FloatArray,
    together: BoolArray,
) -> FloatArray:
    """Bound the distances that segments keep from those on the real axis while their ends move straight.

    Parameters
    ----------
    before, after : two arrays each
        Both ends of the moving segments.
    length : array
        Of the segments on the real axis.
    together : array
        Whether both ends move at even speed. If not, each is anywhere on its way at any time.

    Returns
    -------
    gap : array
        At most the distance at any time; not positive where they may meet.
    """
    ends = np.stack([*before, *after])
    aside = np.maximum(ends.imag.min(axis=0), -ends.imag.max(axis=0))
    beyond = np.maximum(ends.real.min(axis=0) - length, -ends.real.max(axis=0))
    gap = np.maximum(aside, beyond)
    both = (aside > 0.0) & (beyond > 0.0)
    gap[both] = np.hypot(aside[both], beyond[both])
    return np.asarray(np.where(together, np.maximum(gap, _turning_gaps(before, after, length)), gap))


def _turning_gaps(
    before: tuple[ComplexArray, ComplexArray],
    after: tuple[ComplexArray, ComplexArray],
    length: FloatArray,
) -> FloatArray:
    """Bound how far both ends of the real segments stay on one side of the lines of the moving ones.

    The cross product of a moving segment and the way from its start to a fixed point is the signed distance
    times the segment's length. It is quadratic in time, so not smaller than its least Bernstein coefficient.
    """
    (start, later_start), along, later_along = (
        (before[0], after[0]),
        before[1] - before[0],
        after[1] - after[0],
    )
    turns = np.stack([along.imag, (along.imag + later_along.imag) / 2.0, later_along.imag])
    near = -np.stack(
        [
            cross(along, start),
            (cross(along, later_start) + cross(later_along, start)) / 2.0,
            cross(later_along, later_start),
        ]
    )
    far = near - length * turns
    left, right = np.minimum(near, far).min(axis=0), -np.maximum(near, far).max(axis=0)
    longest = np.maximum(np.abs(along), np.abs(later_along))
    longest[longest == 0.0] = 1.0
    return np.asarray(np.maximum(left, right) / longest)


def cross(one: ComplexArray, other: ComplexArray) -> FloatArray:
    """Compute the cross products of vectors."""
    return np.asarray(one.real * other.imag - one.imag * other.real)
