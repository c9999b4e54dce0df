"""Kernels of the track planner: the chords of a joint track, and what they ask of it.

Everything is in link lengths, with the base at the origin and the feeder's axis along x. The track is a list
of samples, `per_link` to a link length; the first `per_link + 1` lie on the axis, from the base to one link
in front of it, and never move. A chord is a link on the track.

A wall corner is on the right side of a chord if it is not between the chord and the stretch of track that the
chord spans: then, and only then, the link can be where the track says it came along. The corner's winding
number about that loop says so, and to which side of the chord the corner belongs if it is not.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.track_types import Chords, Rows, Surroundings
from planners.kernels.track_walls import REACH, add_row
from planners.kernels.types import FloatArray, IntArray

CORNER, SLOPE, ANGLE, PLACE = 0, 1, 2, 3
"""What a track may lack: room for a chord at a corner; slope; room for a joint; room for a sample."""

NEAR = 0.3
"""Slopes and joint angles this near to their limit are watched, so that no movement carries them beyond."""

SLOPE_WEIGHT, ANGLE_WEIGHT, GOAL_WEIGHT = 0.02, 0.3, 100.0
"""Of rows, against 1 for lengths."""

MOST_PARTS = 8
"""Chords per sample, at most, where their starts move fast."""

BLOCK = 16
"""Chords that are looked at together, before each alone."""


@njit(cache=True)
def _start_from(
    points: FloatArray, chord: float, x: float, y: float, segment: int, share: float, last: int
) -> tuple[int, float]:
    """Find where a chord to (x, y) starts, forward or backward from an earlier start; segment -1 if nowhere.

    No start lies on segment `last` or behind it.
    """
    k, squared = segment, chord * chord
    px = points[k, 0] + share * (points[k + 1, 0] - points[k, 0])
    py = points[k, 1] + share * (points[k + 1, 1] - points[k, 1])
    if (px - x) ** 2 + (py - y) ** 2 >= squared:
        while (points[k + 1, 0] - x) ** 2 + (points[k + 1, 1] - y) ** 2 >= squared:
            k += 1
            if k >= last:
                return -1, 0.0
    else:
        while (points[k, 0] - x) ** 2 + (points[k, 1] - y) ** 2 < squared:
            k -= 1
            if k < 0:
                return -1, 0.0
    ax, ay = points[k, 0] - x, points[k, 1] - y
    ex, ey = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    size = ex * ex + ey * ey
    half = (ax * ex + ay * ey) / size
    root = max(half * half - (ax * ax + ay * ay - squared) / size, 0.0)
    return k, min(max(-half - np.sqrt(root), 0.0), 1.0)


@njit(cache=True)
def find_chords(points: FloatArray, per_link: int, chord: float, chords: Chords) -> tuple[int, int]:
    """Find the chords that end at the samples behind the axis, and where their starts move fast also between.

    Returns
    -------
    n_chords, done : int
        Number of chords, and of samples done: fewer than there are if a start would slip off the track.
    """
    n = points.shape[0]
    k = min(int((1.0 - chord) * per_link), per_link - 1)
    f = (1.0 - chord) * per_link - k
    c = 0
    for j in range(per_link, n - 1):
        last_k, last_f = k, f
        k, f = _start_from(points, chord, points[j + 1, 0], points[j + 1, 1], last_k, last_f, j + 1)
        if k < 0:
            return c, j + 1
        parts = min(max(int(np.ceil(abs(k + f - last_k - last_f))), 1), MOST_PARTS)
        for part in range(1, parts):
            e = part / parts
            x = points[j, 0] + e * (points[j + 1, 0] - points[j, 0])
            y = points[j, 1] + e * (points[j + 1, 1] - points[j, 1])
            last_k, last_f = _start_from(points, chord, x, y, last_k, last_f, j + 1)
            if last_k < 0:
                return c, j + 1
            chords.end[c], chords.end_share[c] = j, e
            chords.segment[c], chords.share[c] = last_k, last_f
            c += 1
        chords.end[c], chords.end_share[c], chords.segment[c], chords.share[c] = j, 1.0, k, f
        chords.of_sample[j + 1] = c
        c += 1
    return c, n


@njit(cache=True, inline="always")
def _on(points: FloatArray, k: int, f: float) -> tuple[float, float]:
    """Return the place at share f of segment k."""
    x = points[k, 0] + f * (points[k + 1, 0] - points[k, 0])
    y = points[k, 1] + f * (points[k + 1, 1] - points[k, 1])
    return x, y


@njit(cache=True, inline="always")
def _crossing(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> int:
    """Count the crossing of a step from a to b with the ray from (x, y) along x: +1 upward, -1 downward."""
    if (ay <= y) == (by <= y):
        return 0
    side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    if by > ay:
        return 1 if side > 0.0 else 0
    return -1 if side < 0.0 else 0


@njit(cache=True)
def _put_in_boxes(points: FloatArray, n_chords: int, chords: Chords, boxes: FloatArray) -> None:
    """Fill for each block of chords the box, grown by the reach, of the stretches of track that they span.

    Boxes, shape (n_blocks, 4), are low x, high x, low y, high y.
    """
    for block in range(boxes.shape[0]):
        first, last = block * BLOCK, min((block + 1) * BLOCK, n_chords)
        start = chords.segment[first]
        for c in range(first, last):
            start = min(start, chords.segment[c])
        low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
        for i in range(start, chords.end[last - 1] + 2):
            low_x, high_x = min(low_x, points[i, 0]), max(high_x, points[i, 0])
            low_y, high_y = min(low_y, points[i, 1]), max(high_y, points[i, 1])
        boxes[block, 0], boxes[block, 1] = low_x - REACH, high_x + REACH
        boxes[block, 2], boxes[block, 3] = low_y - REACH, high_y + REACH


@njit(cache=True)
def find_corners(
    points: FloatArray,
    per_link: int,
    chord: float,
    n_chords: int,
    near: Surroundings,
    passed: IntArray,
    chords: Chords,
) -> None:
    """Find for each chord the corner that is deepest across it, of those that belong to either side.

    `chords.depth` and `chords.place` are filled; `passed`, shape (n,), is work space.
    """
    chords.depth[:n_chords] = -np.inf
    boxes = np.empty(((n_chords + BLOCK - 1) // BLOCK, 4))
    _put_in_boxes(points, n_chords, chords, boxes)
    for number in range(near.corners.shape[0]):
        x, y = near.corners[number, 0], near.corners[number, 1]
        # Crossings are counted from sample `begin` to sample `done`, where chords are near.
        begin, done, c = 0, -1, -1
        while c + 1 < n_chords:
            c += 1
            if c % BLOCK == 0:
                box = c // BLOCK
                if not (boxes[box, 0] <= x <= boxes[box, 1] and boxes[box, 2] <= y <= boxes[box, 3]):
                    c += BLOCK - 1
                    continue
            j, k = chords.end[c], chords.segment[c]
            ax, ay = _on(points, k, chords.share[c])
            bx, by = _on(points, j, chords.end_share[c])
            ux, uy = (bx - ax) / chord, (by - ay) / chord
            along = (ux * (x - ax) + uy * (y - ay)) / chord
            across = ux * (y - ay) - uy * (x - ax)
            if abs(across) > 2.0 or along < -0.5 or along > 1.5:
                continue
            if k < begin or k > done:
                begin, done = k, k
                passed[k] = 0
            for i in range(done + 1, j + 1):
                passed[i] = passed[i - 1] + _crossing(
                    points[i - 1, 0], points[i - 1, 1], points[i, 0], points[i, 1], x, y
                )
            done = max(done, j)
            turns = passed[j] - passed[k + 1] + _crossing(bx, by, ax, ay, x, y)
            turns += _crossing(ax, ay, points[k + 1, 0], points[k + 1, 1], x, y)
            turns += _crossing(points[j, 0], points[j, 1], bx, by, x, y)
            if turns == 0:
                if along <= 0.0 or along >= 1.0 or abs(across) > REACH:
                    continue
                side = 0 if across > 0.0 else 1
            else:
                side = 0 if turns > 0 else 1
            deep = -across if side == 0 else across
            if (turns == 0 or deep >= 0.0) and deep > chords.depth[c, side]:
                chords.depth[c, side], chords.place[c, side] = deep, min(max(along, 0.0), 1.0)


@njit(cache=True)
def chord_rows(
    points: FloatArray,
    per_link: int,
    chord: float,
    n_chords: int,
    chords: Chords,
    margin: float,
    least_slope: float,
    joint_limit: float,
    rows: Rows,
    worst: FloatArray,
) -> int:
    """Write what the chords ask for as rows: corners on their sides, slope, joint limits.

    Parameters
    ----------
    points, per_link, chord, n_chords, chords
        The track and its chords.
    margin : float
        Kept from corners.
    least_slope : float
        Smallest cosine between a chord and the track at its start: at 0 the start would jump.
    joint_limit : float
        In rad.
    worst : array, shape (4, 2)
        Filled: deepest corner, lacking slope, joint angle beyond the limit, and the chord of each.

    Returns
    -------
    n : int
        Number of rows.
    """
    n = 0
    worst[:, 0], worst[:, 1] = -np.inf, 0
    for c in range(n_chords):
        ax, ay = _on(points, chords.segment[c], chords.share[c])
        bx, by = _on(points, chords.end[c], chords.end_share[c])
        ux, uy = (bx - ax) / chord, (by - ay) / chord
        for side in range(2):
            deep = chords.depth[c, side]
            if deep > -np.inf:
                n = _corner_row(c, side, ux, uy, points, chords, deep + margin, n, rows)
                if deep > worst[CORNER, 0]:
                    worst[CORNER, 0], worst[CORNER, 1] = deep, c
        k, before = chords.segment[c], chords.segment[max(c - 1, 0)]
        first, last = max(min(before, k), per_link - 1), min(max(before, k) + 1, chords.end[c])
        steep, slope = _steepest(points, ux, uy, k, first, last)
        if least_slope - slope > worst[SLOPE, 0]:
            worst[SLOPE, 0], worst[SLOPE, 1] = least_slope - slope, c
        if slope <= least_slope + NEAR:
            n = _slope_row(c, ux, uy, points, chord, chords, steep, least_slope - slope, n, rows)
        if joint_limit < np.pi:
            n = _joint_row(c, ux, uy, points, per_link, chord, chords, joint_limit, n, rows, worst)
    return n


@njit(cache=True)
def _put(place: int, k: int, f: float, x: float, y: float, n: int, rows: Rows) -> None:
    """Put the factor (x, y) of the movement of a place on segment k into two entries of row n."""
    rows.samples[n, place], rows.samples[n, place + 1] = k, k + 1
    rows.factor[n, place, 0], rows.factor[n, place, 1] = (1.0 - f) * x, (1.0 - f) * y
    rows.factor[n, place + 1, 0], rows.factor[n, place + 1, 1] = f * x, f * y


@njit(cache=True)
def _corner_row(
    c: int,
    side: int,
    ux: float,
    uy: float,
    points: FloatArray,
    chords: Chords,
    wanted: float,
    n: int,
    rows: Rows,
) -> int:
    """Write that chord c goes farther from a corner.

    Its end moves with the track. Its start moves with the track and slides along it, so that the chord keeps
    its length.
    """
    k = chords.segment[c]
    tx, ty = points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1]
    size = np.sqrt(tx * tx + ty * ty)
    tx, ty = tx / size, ty / size
    nx, ny = -uy, ux
    slide = (nx * tx + ny * ty) / max(ux * tx + uy * ty, 0.1)
    t, s = chords.place[c, side], -1.0 if side == 0 else 1.0
    rows.samples[n, :] = -1
    gx, gy = t * nx + (1.0 - t) * slide * ux, t * ny + (1.0 - t) * slide * uy
    _put(0, chords.end[c], chords.end_share[c], s * gx, s * gy, n, rows)
    gx, gy = (1.0 - t) * (nx - slide * ux), (1.0 - t) * (ny - slide * uy)
    _put(2, k, chords.share[c], s * gx, s * gy, n, rows)
    return add_row(n, wanted, 1.0, rows)


@njit(cache=True, inline="always")
def _steepest(
    points: FloatArray, ux: float, uy: float, steep: int, first: int, last: int
) -> tuple[int, float]:
    """Find the segment, from `first` to `last`, that turns farthest from a unit vector, and its slope.

    Where there is none, `steep` is returned.
    """
    least = np.inf
    for i in range(first, last + 1):
        ex, ey = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        slope = (ux * ex + uy * ey) / np.sqrt(ex * ex + ey * ey)
        if slope < least:
            steep, least = i, slope
    return steep, least


@njit(cache=True)
def _slope_row(
    c: int,
    ux: float,
    uy: float,
    points: FloatArray,
    chord: float,
    chords: Chords,
    steep: int,
    wanted: float,
    n: int,
    rows: Rows,
) -> int:
    """Write that the track where chord c starts does not turn too far from the chord.

    Where the start moves over several segments the steepest counts. The slope changes with the turn of the
    chord and with that of the segment.
    """
    k = chords.segment[c]
    ex, ey = points[steep + 1, 0] - points[steep, 0], points[steep + 1, 1] - points[steep, 1]
    size = np.sqrt(ex * ex + ey * ey)
    tx, ty = ex / size, ey / size
    turn = (ux * ty - uy * tx) / chord
    swing = (uy * tx - ux * ty) / size
    _put(0, chords.end[c], chords.end_share[c], -turn * uy, turn * ux, n, rows)
    _put(2, k, chords.share[c], turn * uy, -turn * ux, n, rows)
    rows.samples[n, 4], rows.samples[n, 5] = steep, steep + 1
    rows.factor[n, 4, 0], rows.factor[n, 4, 1] = swing * ty, -swing * tx
    rows.factor[n, 5, 0], rows.factor[n, 5, 1] = -swing * ty, swing * tx
    return add_row(n, wanted, SLOPE_WEIGHT, rows)


@njit(cache=True)
def _joint_row(
    c: int,
    ux: float,
    uy: float,
    points: FloatArray,
    per_link: int,
    chord: float,
    chords: Chords,
    joint_limit: float,
    n: int,
    rows: Rows,
    worst: FloatArray,
) -> int:
    """Write the joint limit between chord c and the link behind it."""
    k, f = chords.segment[c], chords.share[c]
    ax, ay = _on(points, k, f)
    i, g, vx, vy = -1, 0.0, 1.0, 0.0
    if k > per_link:
        # The link behind starts between the starts of the samples about a; otherwise it is on the axis.
        first, second = chords.of_sample[k], chords.of_sample[k + 1]
        place = (1.0 - f) * (chords.segment[first] + chords.share[first])
        place += f * (chords.segment[second] + chords.share[second])
        i = int(place)
        g = place - i
        vx, vy = _on(points, i, g)
        vx, vy = (ax - vx) / chord, (ay - vy) / chord
    angle = np.arctan2(vx * uy - vy * ux, vx * ux + vy * uy)
    beyond = abs(angle) - joint_limit
    if beyond > worst[ANGLE, 0]:
        worst[ANGLE, 0], worst[ANGLE, 1] = beyond, c
    if beyond < -NEAR:
        return n
    s = (-1.0 if angle > 0.0 else 1.0) / chord
    rows.samples[n, :] = -1
    _put(0, chords.end[c], chords.end_share[c], -s * uy, s * ux, n, rows)
    _put(2, k, f, s * (uy + vy), -s * (ux + vx), n, rows)
    if i >= 0:
        _put(4, i, g, -s * vy, s * vx, n, rows)
    return add_row(n, beyond + 0.002, ANGLE_WEIGHT, rows)


@njit(cache=True)
def goal_row(last: int, points: FloatArray, goal: FloatArray, radius: float, n: int, rows: Rows) -> int:
    """Write that the last sample keeps within a radius of the goal."""
    dx, dy = goal[0] - points[last, 0], goal[1] - points[last, 1]
    size = np.sqrt(dx * dx + dy * dy)
    if size == 0.0:
        return n
    rows.samples[n, :] = -1
    rows.samples[n, 0] = last
    rows.factor[n, 0, 0], rows.factor[n, 0, 1] = dx / size, dy / size
    return add_row(n, size - radius, GOAL_WEIGHT, rows)


@njit(cache=True)
def resample(points: FloatArray, new: FloatArray) -> None:
    """Fill `new`, shape (n_new, 2), with samples evenly along a polyline, shape (n, 2), its ends included."""
    n, n_new, total = points.shape[0], new.shape[0], 0.0
    for i in range(1, n):
        total += np.hypot(points[i, 0] - points[i - 1, 0], points[i, 1] - points[i - 1, 1])
    k, done = 0, 0.0
    size = np.hypot(points[1, 0] - points[0, 0], points[1, 1] - points[0, 1])
    for i in range(n_new):
        at = total * i / (n_new - 1)
        while done + size < at and k + 2 < n:
            done += size
            k += 1
            size = np.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
        t = min(max((at - done) / max(size, 1e-300), 0.0), 1.0)
        new[i, 0] = points[k, 0] + t * (points[k + 1, 0] - points[k, 0])
        new[i, 1] = points[k, 1] + t * (points[k + 1, 1] - points[k, 1])
