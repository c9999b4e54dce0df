"""Kernels of the spatial track planner: a joint track shaped until every chord of it is free.

The track is a list of samples. The first `fixed` lie on the feeder's axis, from one link length behind the
end of the straight stretch to that end, and never move; neither does the last, the goal. A chord is a link
on the track. Chords are looked at from each sample backwards and, so that the front end is not skipped over
where the rear end hardly moves, from each sample forwards.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray, IntArray

RELAXATION = 0.8
"""Share of the averaged pushes that is carried out: all at once, so that their order does not matter."""

PARALLEL = 1e-3
"""A chord that rises by less than this share of its length over a face touches it with all of its length."""

SPAN = 4
"""Samples on each side that turn the track."""

SKEW = 1e-6
"""No direction across a chord and an edge is looked for if they are this near to parallel."""


BLOCK = 8
"""Samples whose chords look at the same boxes."""

REFRESH = 25
"""Iterations after which it is looked up again which boxes are near."""

REACH = 1.25
"""How far around a block of samples boxes are near, in chords: a chord, and what samples move till then."""


@njit(cache=True)
def overlap(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float, boxes: FloatArray, m: int
) -> tuple[float, float, float, float, float]:
    """Find the smallest translation that separates a segment a-b from box m.

    The sum of a box and a segment is a zonotope, whose faces are normal to the three axes and to the three
    cross products of an axis and the segment: the smallest overlap along these is exact.

    Returns
    -------
    depth : float
        Length of the translation; not positive if the segment is free of the box.
    nx, ny, nz : float
        Its unit direction.
    t : float
        Where the segment touches then: 0 at a, 1 at b.
    """
    dx, dy, dz = bx - ax, by - ay, bz - az
    size = np.sqrt(dx * dx + dy * dy + dz * dz)
    least, nx, ny, nz, t = np.inf, 0.0, 0.0, 0.0, 0.5
    for axis in range(3):
        if axis == 0:
            p, q = ax, bx
        elif axis == 1:
            p, q = ay, by
        else:
            p, q = az, bz
        flat = abs(q - p) <= PARALLEL * size
        below, above = max(p, q) - boxes[m, 0, axis], boxes[m, 1, axis] - min(p, q)
        if below <= 0.0 or above <= 0.0:
            return 0.0, 0.0, 0.0, 0.0, 0.5
        if below < least:
            least, t = below, 0.5 if flat else (1.0 if q > p else 0.0)
            nx, ny, nz = -1.0 if axis == 0 else 0.0, -1.0 if axis == 1 else 0.0, -1.0 if axis == 2 else 0.0
        if above < least:
            least, t = above, 0.5 if flat else (0.0 if q > p else 1.0)
            nx, ny, nz = 1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0
    for axis in range(3):
        if axis == 0:
            pb, pc, db, dc, b, c = ay, az, dy, dz, 1, 2
        elif axis == 1:
            pb, pc, db, dc, b, c = az, ax, dz, dx, 2, 0
        else:
            pb, pc, db, dc, b, c = ax, ay, dx, dy, 0, 1
        width = np.sqrt(db * db + dc * dc)
        if width <= SKEW * size:
            continue
        ub, uc = -dc / width, db / width
        high_b, low_b = (boxes[m, 1, b], boxes[m, 0, b]) if ub > 0.0 else (boxes[m, 0, b], boxes[m, 1, b])
        high_c, low_c = (boxes[m, 1, c], boxes[m, 0, c]) if uc > 0.0 else (boxes[m, 0, c], boxes[m, 1, c])
        here = ub * pb + uc * pc
        up, down = ub * high_b + uc * high_c - here, here - ub * low_b - uc * low_c
        if up <= 0.0 or down <= 0.0:
            return 0.0, 0.0, 0.0, 0.0, 0.5
        if min(up, down) < least:
            if up < down:
                least, sign, eb, ec = up, 1.0, high_b, high_c
            else:
                least, sign, eb, ec = down, -1.0, low_b, low_c
            nb, nc = sign * ub, sign * uc
            t = min(max(((eb - pb) * db + (ec - pc) * dc) / (width * width), 0.0), 1.0)
            if axis == 0:
                nx, ny, nz = 0.0, nb, nc
            elif axis == 1:
                nx, ny, nz = nc, 0.0, nb
            else:
                nx, ny, nz = nb, nc, 0.0
    return least, nx, ny, nz, t


class Demand(NamedTuple):
    """What is asked of a track besides that its chords are free.

    Attributes
    ----------
    length : float
        Of a chord.
    joint_limit : float
        Largest angle between two chords that meet, in rad; pi for none.
    outward : float
        Share of what a joint angle has too much that the far ends of its links give, outwards; the rest is
        the joint's own, inwards.
    slope : float
        Smallest cosine between a chord and the track at its rear end: at 0 a joint would jump.
    straight : bool
        Whether the fixed samples are straight. If not, they begin where the chord of the last one starts.
    """

    length: float
    joint_limit: float = np.pi
    outward: float = 0.5
    slope: float = 0.1
    straight: bool = True


class Near(NamedTuple):
    """Which boxes are near each block of samples.

    Attributes
    ----------
    first : array, shape (n_blocks + 1,)
        Place of each block's first box in `members`.
    members : array
        Indices of boxes.
    """

    first: IntArray
    members: IntArray


@njit(cache=True)
def _look_up(points: FloatArray, boxes: FloatArray, reach: float, near: Near) -> None:
    """Fill which boxes are within `reach` of each block's bounding box."""
    count, n = 0, points.shape[0]
    low, high = np.empty(3), np.empty(3)
    for block in range(near.first.shape[0] - 1):
        for c in range(3):
            low[c], high[c] = np.inf, -np.inf
            for i in range(block * BLOCK, min((block + 1) * BLOCK, n)):
                low[c], high[c] = min(low[c], points[i, c]), max(high[c], points[i, c])
        near.first[block] = count
        for m in range(boxes.shape[0]):
            apart = False
            for c in range(3):
                apart |= low[c] - reach >= boxes[m, 1, c] or high[c] + reach <= boxes[m, 0, c]
            if not apart:
                near.members[count] = m
                count += 1
    near.first[near.first.shape[0] - 1] = count


@njit(cache=True)
def _push_chord(
    points: FloatArray, i: int, k: int, f: float, boxes: FloatArray, near: Near, pushes: FloatArray,
    weights: FloatArray,
) -> float:  # fmt: skip
    """Add the pushes on the chord from sample i to share f of segment k; return the largest depth.

    A push acts where the chord touches, and moves its ends as a lever.
    """
    ax, ay, az = points[i, 0], points[i, 1], points[i, 2]
    bx = points[k, 0] + f * (points[k + 1, 0] - points[k, 0])
    by = points[k, 1] + f * (points[k + 1, 1] - points[k, 1])
    bz = points[k, 2] + f * (points[k + 1, 2] - points[k, 2])
    low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
    low_z, high_z, worst = min(az, bz), max(az, bz), 0.0
    for place in range(near.first[i // BLOCK], near.first[i // BLOCK + 1]):
        m = near.members[place]
        if (
            low_x >= boxes[m, 1, 0] or high_x <= boxes[m, 0, 0] or low_y >= boxes[m, 1, 1]
            or high_y <= boxes[m, 0, 1] or low_z >= boxes[m, 1, 2] or high_z <= boxes[m, 0, 2]
        ):  # fmt: skip
            continue
        depth, nx, ny, nz, t = overlap(ax, ay, az, bx, by, bz, boxes, m)
        if depth <= 0.0:
            continue
        worst = max(worst, depth)
        size = depth / ((1.0 - t) ** 2 + t * t)
        w, v = (1.0 - t) * size, t * size
        pushes[i, 0] += w * nx
        pushes[i, 1] += w * ny
        pushes[i, 2] += w * nz
        weights[i] += 1.0 - t
        w = (1.0 - f) * v
        pushes[k, 0] += w * nx
        pushes[k, 1] += w * ny
        pushes[k, 2] += w * nz
        weights[k] += (1.0 - f) * t
        w = f * v
        pushes[k + 1, 0] += w * nx
        pushes[k + 1, 1] += w * ny
        pushes[k + 1, 2] += w * nz
        weights[k + 1] += f * t
    return worst


@njit(cache=True)
def _squared(points: FloatArray, i: int, k: int) -> float:
    total: float = 0.0
    for c in range(3):
        total += (points[k, c] - points[i, c]) ** 2
    return total


@njit(cache=True)
def _far_end(points: FloatArray, i: int, near: int, far: int, squared: float) -> float:
    """Return the share of the way from sample `near` to sample `far` where sample i is a chord away."""
    half, size, apart = 0.0, 0.0, 0.0
    for c in range(3):
        step, way = points[far, c] - points[near, c], points[near, c] - points[i, c]
        size += step * step
        half += step * way
        apart += way * way
    root = max(half * half - size * (apart - squared), 0.0)
    return float(min(max((np.sqrt(root) - half) / max(size, 1e-300), 0.0), 1.0))


@njit(cache=True)
def segment_at(place: float, n: int) -> int:
    """Return the segment that holds a place, an index with a fraction; the last sample is the last one's."""
    return min(int(place), n - 2)


@njit(cache=True)
def push_chords(
    points: FloatArray, fixed: int, length: float, boxes: FloatArray, near: Near, rear: FloatArray,
    front: FloatArray, pushes: FloatArray, weights: FloatArray,
) -> float:  # fmt: skip
    """Add the pushes on all chords, shapes (n, 3) and (n,), and return the largest depth.

    `rear` and `front`, shape (n,), are filled with where, as an index with a fraction, the chords backwards
    and forwards from each sample end; negative if there is none.
    """
    n, squared, worst = points.shape[0], length * length, 0.0
    k = 0  # the rear end of the chord of sample i lies between samples k and k + 1
    rear[:], front[:] = -1.0, -1.0
    for i in range(fixed, n):
        while k + 1 < i and _squared(points, i, k + 1) >= squared:
            k += 1
        while k > 0 and _squared(points, i, k) < squared:
            k -= 1
        share = 1.0 - _far_end(points, i, k + 1, k, squared)
        rear[i] = k + share
        worst = max(worst, _push_chord(points, i, k, share, boxes, near, pushes, weights))
    k = n - 2  # and now the front end
    for i in range(n - 2, -1, -1):
        if k == n - 2 and _squared(points, i, n - 1) < squared:
            continue
        while k > i and _squared(points, i, k) >= squared:
            k -= 1
        while k + 2 < n and _squared(points, i, k + 1) < squared:
            k += 1
        share = _far_end(points, i, k, k + 1, squared)
        front[i] = k + share
        if k + 1 >= fixed:
            worst = max(worst, _push_chord(points, i, k, share, boxes, near, pushes, weights))
    return worst


@njit(cache=True)
def _straighten(
    points: FloatArray, fixed: int, demand: Demand, rear: FloatArray, front: FloatArray, pushes: FloatArray,
    weights: FloatArray,
) -> None:  # fmt: skip
    """Add pushes against joint angles over a limit: the joint inwards, the ends of its links outwards."""
    allowed, out = demand.length * np.sin(0.5 * demand.joint_limit), np.empty(3)
    for i in range(fixed, points.shape[0]):
        if front[i] < 0.0:
            continue
        j, k = segment_at(rear[i], points.shape[0]), segment_at(front[i], points.shape[0])
        g, f = rear[i] - j, front[i] - k
        height = 0.0
        for c in range(3):
            behind = points[j, c] + g * (points[j + 1, c] - points[j, c])
            ahead = points[k, c] + f * (points[k + 1, c] - points[k, c])
            out[c] = points[i, c] - 0.5 * (behind + ahead)
            height += out[c] ** 2
        height = np.sqrt(height)
        if height <= allowed:
            continue
        share = (height - allowed) / height
        inwards, outwards = (1.0 - demand.outward) * share, demand.outward * share
        weights[i] += 1.0
        weights[j] += 1.0 - g
        weights[j + 1] += g
        weights[k] += 1.0 - f
        weights[k + 1] += f
        for c in range(3):
            pushes[i, c] -= inwards * out[c]
            pushes[j, c] += (1.0 - g) * outwards * out[c]
            pushes[j + 1, c] += g * outwards * out[c]
            pushes[k, c] += (1.0 - f) * outwards * out[c]
            pushes[k + 1, c] += f * outwards * out[c]


@njit(cache=True)
def _bend_out(
    points: FloatArray, fixed: int, demand: Demand, front: FloatArray, pushes: FloatArray, weights: FloatArray
) -> None:
    """Add pushes against joint angles over a limit on the straight stretch: only the front end can move.

    There a joint angle is also the angle between chord and track, which has a limit of its own. Where the
    fixed samples are not straight, that limit alone is kept.
    """
    length, angle = demand.length, np.arccos(demand.slope)
    if demand.straight:
        angle = min(angle, demand.joint_limit)
    allowed, out = length * np.sin(0.5 * angle), np.empty(3)
    axis = points[fixed - 1] - points[0]
    axis *= length / np.sqrt((axis**2).sum())
    for i in range(fixed):
        if front[i] < 0.0:
            continue
        k = segment_at(front[i], points.shape[0])
        if k + 1 < fixed:
            continue
        if not demand.straight:
            axis = points[i + 1] - points[i] if i + 1 < fixed else points[i] - points[i - 1]
            axis *= length / np.sqrt((axis**2).sum())
        f, height = front[i] - k, 0.0
        for c in range(3):
            ahead = points[k, c] + f * (points[k + 1, c] - points[k, c])
            out[c] = 0.5 * (points[i, c] + axis[c] - ahead)
            height += out[c] ** 2
        height = np.sqrt(height)
        if height <= allowed:
            continue
        share = 2.0 * (height - allowed) / height
        weights[k] += 1.0 - f
        weights[k + 1] += f
        for c in range(3):
            pushes[k, c] += (1.0 - f) * share * out[c]
            pushes[k + 1, c] += f * share * out[c]


@njit(cache=True)
def _turn_along(
    points: FloatArray, fixed: int, demand: Demand, rear: FloatArray, pushes: FloatArray, weights: FloatArray
) -> None:
    """Add pushes that turn the track towards the chord where a chord starts nearly across it.

    A joint there would have to run far ahead of the tip, and at a right angle to jump.
    """
    n, length = points.shape[0], demand.length
    for i in range(fixed, n):
        if rear[i] < 0.0:
            continue
        k = segment_at(rear[i], n)
        size, slope, chord = 0.0, 0.0, np.empty(3)
        for c in range(3):
            way = points[k + 1, c] - points[k, c]
            here = points[k, c] + (rear[i] - k) * way
            chord[c] = (points[i, c] - here) / length
            slope += chord[c] * way
            size += way * way
        size = np.sqrt(size)
        lack = demand.slope * size - slope
        if lack <= 0.0:
            continue
        if k < fixed:  # the straight stretch cannot turn: its chord's front end goes ahead
            share = lack * length / size**2
            weights[i] += 1.0
            for c in range(3):
                pushes[i, c] += share * (points[k + 1, c] - points[k, c])
            continue
        for j in range(SPAN):
            share = 0.5 * lack * (j + 0.5) * (1.0 - j / SPAN)
            behind, ahead = k - j, k + 1 + j
            if behind >= fixed:
                weights[behind] += 1.0
                for c in range(3):
                    pushes[behind, c] -= share * chord[c]
            if ahead < n - 1:
                weights[ahead] += 1.0
                for c in range(3):
                    pushes[ahead, c] += share * chord[c]


@njit(cache=True)
def resample_free(points: FloatArray, fixed: int, work: FloatArray) -> None:
    """Place the samples behind the fixed ones evenly on their polyline; both its ends stay."""
    n, total = points.shape[0], 0.0
    first = fixed - 1
    for i in range(first, n - 1):
        total += np.sqrt(_squared(points, i, i + 1))
    for i in range(first, n):
        for c in range(3):
            work[i, c] = points[i, c]
    k, done = first, 0.0
    size = np.sqrt(_squared(work, k, k + 1))
    for i in range(first + 1, n - 1):
        at = total * (i - first) / (n - 1 - first)
        while done + size < at and k + 2 < n:
            done += size
            k += 1
            size = np.sqrt(_squared(work, k, k + 1))
        t = min(max((at - done) / max(size, 1e-300), 0.0), 1.0)
        for c in range(3):
            points[i, c] = work[k, c] + t * (work[k + 1, c] - work[k, c])


@njit(cache=True)
def _leave_boxes(points: FloatArray, fixed: int, boxes: FloatArray, near: Near) -> None:
    """Move samples that are in a box to its nearest face."""
    for i in range(fixed, points.shape[0] - 1):
        for _ in range(2):
            for place in range(near.first[i // BLOCK], near.first[i // BLOCK + 1]):
                m = near.members[place]
                least, axis, to = np.inf, 0, 0.0
                for c in range(3):
                    below, above = points[i, c] - boxes[m, 0, c], boxes[m, 1, c] - points[i, c]
                    if below <= 0.0 or above <= 0.0:
                        least = 0.0
                        break
                    if below < least:
                        least, axis, to = below, c, boxes[m, 0, c]
                    if above < least:
                        least, axis, to = above, c, boxes[m, 1, c]
                if least > 0.0:
                    points[i, axis] = to


@njit(cache=True)
def relax(
    points: FloatArray, fixed: int, demand: Demand, boxes: FloatArray, smoothing: float, iterations: int
) -> float:
    """Shape a track until its chords are free, in place; return the largest depth seen in the last iteration.

    Parameters
    ----------
    points : array, shape (n, 3)
        The track; the first `fixed` samples and the last one stay.
    fixed : int
        At least 2.
    demand : Demand
        What is asked of it.
    boxes : array, shape (n_boxes, 2, 3)
        Obstacles, grown by what is to be kept from them.
    smoothing : float
        Share of the way to the middle of its neighbours that each sample goes in each iteration.
    iterations : int
        All are done: a track that is free at first is not smooth yet.

    Notes
    -----
    The caller guarantees that the fixed samples are a chord or more long.
    """
    n = points.shape[0]
    work, pushes, weights, worst = np.empty_like(points), np.empty_like(points), np.empty(n), 0.0
    rear, front = np.empty(n), np.empty(n)
    n_blocks = (n + BLOCK - 1) // BLOCK
    near = Near(np.empty(n_blocks + 1, dtype=np.int64), np.empty(n_blocks * boxes.shape[0], dtype=np.int64))
    for iteration in range(iterations):
        for c in range(3):
            before = points[fixed - 1, c]
            for i in range(fixed, n - 1):
                here = points[i, c]
                points[i, c] = here + smoothing * (0.5 * (before + points[i + 1, c]) - here)
                before = here
        resample_free(points, fixed, work)
        if iteration % REFRESH == 0:
            _look_up(points, boxes, REACH * demand.length, near)
        pushes[:], weights[:] = 0.0, 0.0
        worst = push_chords(points, fixed, demand.length, boxes, near, rear, front, pushes, weights)
        _turn_along(points, fixed, demand, rear, pushes, weights)
        _bend_out(points, fixed, demand, front, pushes, weights)
        if demand.joint_limit < np.pi:
            _straighten(points, fixed, demand, rear, front, pushes, weights)
        for i in range(fixed, n - 1):
            share = RELAXATION / max(1.0, weights[i])
            for c in range(3):
                points[i, c] += share * pushes[i, c]
        _leave_boxes(points, fixed, boxes, near)
    return worst


@njit(cache=True)
def deepest_chord(
    points: FloatArray, fixed: int, length: float, boxes: FloatArray
) -> tuple[int, FloatArray, int, float]:
    """Find the backward chord that is deepest in a box: its end sample, its start, the box, and the depth."""
    squared, k, end, wall, worst = length * length, 0, fixed, 0, -1.0
    start, rear = points[0].copy(), points[0].copy()
    for i in range(fixed, points.shape[0]):
        while k + 1 < i and _squared(points, i, k + 1) >= squared:
            k += 1
        while k > 0 and _squared(points, i, k) < squared:
            k -= 1
        share = 1.0 - _far_end(points, i, k + 1, k, squared)
        for c in range(3):
            start[c] = points[k, c] + share * (points[k + 1, c] - points[k, c])
        for m in range(boxes.shape[0]):
            depth = overlap(start[0], start[1], start[2], points[i, 0], points[i, 1], points[i, 2], boxes, m)[
                0
            ]
            if depth > worst:
                end, wall, worst, rear[:] = i, m, depth, start
    return end, rear, wall, worst
