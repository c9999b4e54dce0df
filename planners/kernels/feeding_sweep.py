"""Kernels of feeding: what the chords of a track may meet, found once for all poses on it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.track_walls import segments_meet
from planners.kernels.types import BoolArray, FloatArray, IntArray

BLOCK = 16
"""Segments of track that are looked at together, before each alone."""


class Sweep(NamedTuple):
    """What the chords that end on each segment of a track may meet.

    Attributes
    ----------
    walls : array, shape (n_walls, 2, 2)
        Segments, in maze units.
    low, high : array, shape (n_segments,)
        Arclengths between which those chords start; no chord is known that starts elsewhere.
    first : array, shape (n_segments + 1,)
        Place of each segment's first wall in `members`.
    members : array
        Indices of walls that chords ending on a segment may meet.
    crosses : array, shape (n_segments,)
        Whether they may meet chords that end elsewhere and are not neighbours.
    """

    walls: FloatArray
    low: FloatArray
    high: FloatArray
    first: IntArray
    members: IntArray
    crosses: BoolArray


Found = tuple[FloatArray, FloatArray, FloatArray, IntArray, IntArray, BoolArray]


@njit(cache=True, inline="always")
def start_of_link(
    track: FloatArray, along: FloatArray, ends: FloatArray, row: int, squared: float, segment: int, last: int
) -> tuple[int, float]:
    """Find the place on the track one link length from `ends[row]`: segment, and way on it.

    In the plane and in space, from an earlier segment on. Segment -1 is nowhere: the axis behind the track,
    or beyond the segment `last`.
    """
    k, d = segment, track.shape[1]
    size, next_size, half = 0.0, 0.0, 0.0
    for c in range(d):
        size += (track[k, c] - ends[row, c]) ** 2
    if size < squared:
        while size < squared:
            k -= 1
            if k < 0:
                return -1, 0.0
            size = 0.0
            for c in range(d):
                size += (track[k, c] - ends[row, c]) ** 2
    else:
        while True:
            next_size = 0.0
            for c in range(d):
                next_size += (track[k + 1, c] - ends[row, c]) ** 2
            if next_size < squared:
                break
            k += 1
            if k > last:
                return -1, 0.0
            size = next_size
    for c in range(d):
        half += (track[k, c] - ends[row, c]) * along[k, c]
    return k, max(-half - np.sqrt(max(half * half - size + squared, 0.0)), 0.0)


@njit(cache=True)
def directions(track: FloatArray, arc: FloatArray) -> FloatArray:
    """Return the unit vectors along the segments of a track, shape (n_segments, 2 or 3)."""
    along = np.empty((arc.shape[0] - 1, track.shape[1]))
    for k in range(along.shape[0]):
        squared = 0.0
        for c in range(track.shape[1]):
            squared += (track[k + 1, c] - track[k, c]) ** 2
        for c in range(track.shape[1]):
            along[k, c] = (track[k + 1, c] - track[k, c]) / np.sqrt(squared)
    return along


@njit(cache=True)
def _from_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the squared distance of (x, y) from the segment a-b."""
    ex, ey = bx - ax, by - ay
    t = ((x - ax) * ex + (y - ay) * ey) / max(ex * ex + ey * ey, 1e-300)
    t = min(max(t, 0.0), 1.0)
    return (x - ax - t * ex) ** 2 + (y - ay - t * ey) ** 2


@njit(cache=True)
def _are_near(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float, far: float
) -> bool:
    """Tell whether the segments a-b and c-d come within a distance."""
    if min(ax, bx) > max(cx, dx) + far or max(ax, bx) < min(cx, dx) - far:
        return False
    if min(ay, by) > max(cy, dy) + far or max(ay, by) < min(cy, dy) - far:
        return False
    if segments_meet(ax, ay, bx, by, cx, cy, dx, dy):
        return True
    least = min(_from_segment(ax, ay, cx, cy, dx, dy), _from_segment(bx, by, cx, cy, dx, dy))
    least = min(least, _from_segment(cx, cy, ax, ay, bx, by), _from_segment(dx, dy, ax, ay, bx, by))
    return least <= far * far


@njit(cache=True)
def _middle_chords(
    track: FloatArray, arc: FloatArray, length: float, middle: FloatArray, low: FloatArray, high: FloatArray,
    ends: FloatArray,
) -> int:  # fmt: skip
    """Find a chord in the midst of those that end on each segment, and between which places they start.

    Parameters
    ----------
    middle : array, shape (n_segments, 5)
        Filled: start and end of that chord, and how far the others are from it, at most.
    low, high : array, shape (n_segments,)
        Filled; -1 for `high` where there is no chord.
    ends : array, shape (n_segments, 2)
        Filled: where the chord to the segment's end starts.

    Returns
    -------
    first : int
        The first segment that is not wholly on the straight part with which the track begins.
    """
    along, squared, n_segments = directions(track, arc), length * length, arc.shape[0] - 1
    first = 0
    while first + 1 < n_segments and arc[first + 1] <= length * (1.0 + 1e-12):
        first += 1
    low[:], high[:] = 0.0, 0.0
    k, from_place, begin = 0, 0.0, length
    for j in range(first, n_segments):
        seen = k
        k, t = start_of_link(track, along, track, j + 1, squared, k, j)
        if k < 0:
            low[j:], high[j:], middle[j:] = 0.0, -1.0, 0.0
            return first
        x, y = track[k, 0] + t * along[k, 0], track[k, 1] + t * along[k, 1]
        to_place = arc[k] + t
        low[j], high[j] = min(from_place, to_place), max(from_place, to_place)
        mean = 0.5 * (from_place + to_place)
        i = min(seen, k)
        while arc[i + 1] < mean:
            i += 1
        rest = mean - arc[i]
        share = 0.5 * (begin + arc[j + 1]) - arc[j]
        middle[j, 0], middle[j, 1] = track[i, 0] + rest * along[i, 0], track[i, 1] + rest * along[i, 1]
        middle[j, 2], middle[j, 3] = track[j, 0] + share * along[j, 0], track[j, 1] + share * along[j, 1]
        middle[j, 4] = 0.5 * max(high[j] - low[j], arc[j + 1] - arc[j]) + 1e-8 * arc[j + 1]
        ends[j, 0], ends[j, 1] = x, y
        from_place, begin = to_place, arc[j + 1]
    return first


@njit(cache=True)
def _box(middle: FloatArray, first: int, last: int) -> tuple[float, float, float, float]:
    """Return the least box round the chords that end on some segments: low x, high x, low y, high y."""
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for j in range(first, last):
        far = middle[j, 4]
        low_x = min(low_x, min(middle[j, 0], middle[j, 2]) - far)
        high_x = max(high_x, max(middle[j, 0], middle[j, 2]) + far)
        low_y = min(low_y, min(middle[j, 1], middle[j, 3]) - far)
        high_y = max(high_y, max(middle[j, 1], middle[j, 3]) + far)
    return low_x, high_x, low_y, high_y


@njit(cache=True)
def _mark_crossings(
    middle: FloatArray, arc: FloatArray, high: FloatArray, length: float, first: int, crosses: BoolArray
) -> None:
    """Mark the segments whose chords may cross other chords, a link or more away; 0 stands for the axis."""
    n = middle.shape[0]
    begin = first - 1  # stands for the axis: all of it
    n_blocks = (n - begin + BLOCK - 1) // BLOCK
    boxes = np.empty((n_blocks, 4))
    for b in range(n_blocks):
        boxes[b] = _box(middle, begin + b * BLOCK, min(begin + (b + 1) * BLOCK, n))
    for b in range(n_blocks):
        for c in range(b, n_blocks):
            if boxes[b, 0] > boxes[c, 1] or boxes[b, 1] < boxes[c, 0]:
                continue
            if boxes[b, 2] > boxes[c, 3] or boxes[b, 3] < boxes[c, 2]:
                continue
            for i in range(begin + b * BLOCK, min(begin + (b + 1) * BLOCK, n)):
                end = 0.0 if i == begin else arc[i]
                for j in range(max(begin + c * BLOCK, i + 1), min(begin + (c + 1) * BLOCK, n)):
                    if high[j] - end < 0.999 * length or (crosses[i] and crosses[j]):
                        continue
                    if _are_near(
                        middle[i, 0], middle[i, 1], middle[i, 2], middle[i, 3],
                        middle[j, 0], middle[j, 1], middle[j, 2], middle[j, 3], middle[i, 4] + middle[j, 4],
                    ):  # fmt: skip
                        crosses[i] = crosses[j] = True
    crosses[0] = crosses[begin]


@njit(cache=True)
def sweep_chords(
    track: FloatArray, arc: FloatArray, length: float, walls: FloatArray
) -> tuple[bool, Found]:
    """Find what the chords of a track may meet; False if those that end at its points do meet walls.

    Parameters
    ----------
    track, arc : array, shape (n, 2) and (n,)
        As for `feed_along`.
    length : float
        In maze units.
    walls : array, shape (n_walls, 2, 2)
        Segments, in maze units.

    Returns
    -------
    free : bool
        Whether the chords that end at points of the track meet no wall.
    found : tuple
        The fields of `Sweep`; a named tuple would be made by Python's code, in which Ctrl-C may arrive, and
        numba crashes then.

    Notes
    -----
    Chords that end on one segment of the track stay near the one in their midst: no end of theirs is farther
    from its end than the track between the two is long.
    """
    n = arc.shape[0] - 1
    middle, ends = np.zeros((n, 5)), np.empty((n, 2))
    low, high = np.empty(n), np.empty(n)
    crosses = np.zeros(n, dtype=np.bool_)
    places, members = np.zeros(n + 1, dtype=np.int64), np.empty(4 * n + 16, dtype=np.int64)
    first = _middle_chords(track, arc, length, middle, low, high, ends)
    found = (walls, low, high, places, members, crosses)
    begin, n_members = first - 1, 0
    middle[begin, 0], middle[begin, 1], middle[begin, 4] = track[0, 0], track[0, 1], 1e-8 * length
    middle[begin, 2], middle[begin, 3] = track[first, 0], track[first, 1]
    for w in range(walls.shape[0]):
        cx, cy, dx, dy = walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1]
        if segments_meet(
            middle[begin, 0], middle[begin, 1], middle[begin, 2], middle[begin, 3], cx, cy, dx, dy
        ):
            return False, found
    near = np.empty(walls.shape[0], dtype=np.int64)
    for block in range(first, n, BLOCK):
        last, n_near = min(block + BLOCK, n), 0
        low_x, high_x, low_y, high_y = _box(middle, block, last)
        for w in range(walls.shape[0]):
            cx, cy, dx, dy = walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1]
            if (
                max(cx, dx) >= low_x
                and min(cx, dx) <= high_x
                and max(cy, dy) >= low_y
                and min(cy, dy) <= high_y
            ):
                near[n_near] = w
                n_near += 1
        for j in range(block, last):
            places[j] = n_members
            if n_members + n_near > members.shape[0]:
                more = np.empty(2 * members.shape[0] + n_near, dtype=np.int64)
                more[:n_members] = members[:n_members]
                members = more
            for at in range(n_near):
                w = near[at]
                cx, cy, dx, dy = walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1]
                if not _are_near(
                    middle[j, 0], middle[j, 1], middle[j, 2], middle[j, 3], cx, cy, dx, dy, middle[j, 4]
                ):
                    continue
                members[n_members] = w
                n_members += 1
                if high[j] >= 0.0 and segments_meet(
                    ends[j, 0], ends[j, 1], track[j + 1, 0], track[j + 1, 1], cx, cy, dx, dy
                ):
                    return False, found
    places[n] = n_members
    _mark_crossings(middle, arc, high, length, first, crosses)
    return True, (walls, low, high, places, members, crosses)
