"""Distances and gaps between segments, many at once; points are complex numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray
from planners.checks.scene import BoolArray, IntArray, Scene

SLICE = 1 << 15
"""How many segments are looked at together, to bound the memory and stay in the cache."""

ComplexArray = NDArray[np.complex128]
Ends = tuple[ComplexArray, ComplexArray]
"""Both ends of segments, shape (n,) each."""


def complex_from_points(points: FloatArray) -> ComplexArray:
    """Return points, shape (..., 2), as complex numbers, shape (...)."""
    return np.ascontiguousarray(points).view(np.complex128)[..., 0]


@dataclass(frozen=True, eq=False, kw_only=True)
class Walls:
    """Hold where walls start, their directions (of length 1) and their lengths, each of shape (n_walls,)."""

    start: ComplexArray
    along: ComplexArray
    length: FloatArray

    @classmethod
    def of(cls, scene: Scene) -> Walls:
        """Return the walls of a scene's maze."""
        ends = complex_from_points(scene.maze.walls)
        ends = ends[ends[:, 0] != ends[:, 1]]
        length = np.abs(ends[:, 1] - ends[:, 0])
        return cls(start=ends[:, 0], along=(ends[:, 1] - ends[:, 0]) / length, length=length)

    def in_sight(self, middle: ComplexArray, limit: FloatArray) -> tuple[IntArray, IntArray]:
        """Find pairs of a point and a wall that may be within a limit of each other, both shape (n,)."""
        centre, pairs = self.start + self.along * self.length / 2.0, [np.zeros((0, 2), dtype=np.int64)]
        for part in slices(len(middle), 1 + 8 * SLICE // len(centre)):
            apart = np.abs(middle[part, None] - centre)
            near = np.argwhere(apart <= limit[part, None] + self.length / 2.0)
            near[:, 0] += part.start
            pairs.append(near)
        case, wall = np.concatenate(pairs).T
        return case, wall

    def distances(self, ends: Ends, case: IntArray, wall: IntArray) -> FloatArray:
        """Compute the distances of segments `case` from walls `wall`, both of shape (m,)."""
        distance = np.empty(len(wall))
        for part in slices(len(wall)):
            framed = self._framed(ends, case[part], wall[part])
            distance[part] = segment_distances(framed, self.length[wall[part]])
        return distance

    def gaps(
        self, before: Ends, after: Ends, together: BoolArray, case: IntArray, wall: IntArray
    ) -> FloatArray:
        """Bound the gaps of moving segments from walls; infinite for segments that are not in `case`."""
        gap = np.full(len(together), np.inf)
        for part in slices(len(wall)):
            at, of = case[part], wall[part]
            moving = self._framed(before, at, of), self._framed(after, at, of)
            np.minimum.at(gap, at, segment_gaps(*moving, self.length[of], together[at]))
        return gap

    def _framed(self, ends: Ends, case: IntArray, wall: IntArray) -> Ends:
        start, along = self.start[wall], self.along[wall].conj()
        return (ends[0][case] - start) * along, (ends[1][case] - start) * along


def depths_from_gaps(
    scene: Scene, gap: FloatArray, point: ComplexArray, emerging: BoolArray, curve: FloatArray, limit: float
) -> FloatArray:
    """Bound the depths of moving links in walls, infinite where there is no bound up to `limit`.

    Their centre lines are in the free space if they touch no wall and a point of them is. Of emerging links
    some walls may be nearer: here they count all the same. Where walls are thin none may be entered.
    """
    depth = np.maximum(scene.radius + curve - gap, 0.0)
    sure = (gap > scene.slack) & (depth <= np.where(emerging, 0.0, limit))
    entered = sure & (curve >= gap)
    if entered.any():
        sure[entered] = ~scene.may_tunnel(emerging[entered])
    sure[sure] = shapely.contains_xy(scene.free, point[sure].real, point[sure].imag)
    return np.where(sure, depth, np.inf)


def moves_evenly(before: FloatArray, after: FloatArray) -> BoolArray:
    """Say by the arcs of both joints, shape (n, 2), which links in the maze have ends that move evenly.

    Where a joint comes out of the feeder in between, the end of its link in the maze first stays at the base.
    """
    return np.asarray(np.all((before < 0.0) == (after < 0.0), axis=1))


def segment_distances(ends: Ends, length: FloatArray) -> FloatArray:
    """Compute the distances of segments from others that run from 0 to `length` on the real axis.

    Either may be a point.
    """
    start, end = ends
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


def segment_gaps(before: Ends, after: Ends, length: FloatArray, together: BoolArray) -> FloatArray:
    """Bound the distances that segments keep from those on the real axis while their ends move straight.

    Parameters
    ----------
    before, after : pairs of arrays, shape (n,)
        Both ends of the moving segments.
    length : array, shape (n,)
        The other segments run from 0 to `length` on the real axis.
    together : array, shape (n,)
        Whether both ends move at even speed. If not, each is anywhere on its way at any time.

    Returns
    -------
    gap : array, shape (n,)
        At most the distance at any time; not positive where they may meet.
    """
    ends = np.stack([*before, *after])
    aside = np.maximum(ends.imag.min(axis=0), -ends.imag.max(axis=0))
    beyond = np.maximum(ends.real.min(axis=0) - length, -ends.real.max(axis=0))
    gap = np.maximum(aside, beyond)
    both = (aside > 0.0) & (beyond > 0.0)
    gap[both] = np.hypot(aside[both], beyond[both])
    return np.asarray(np.where(together, np.maximum(gap, _turning_gaps(before, after, length)), gap))


def _turning_gaps(before: Ends, after: Ends, length: FloatArray) -> FloatArray:
    """Bound how far both ends of the real segments stay on one side of the lines of the moving ones.

    The cross product of a moving segment and the way from its start to a fixed point is the signed distance
    times the segment's length. It is quadratic in time, so not smaller than its least Bernstein coefficient.
    """
    start, later_start = before[0], after[0]
    along, later_along = before[1] - start, after[1] - later_start
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


def slices(length: int, size: int = SLICE) -> list[slice]:
    """Cut a length into pieces of at most `size`."""
    return [slice(first, first + size) for first in range(0, length, size)]
