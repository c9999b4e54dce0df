"""Segments against boxes: signed distances, and gaps that hold while a segment moves.

The signed distance of a segment to a box is the largest, over all unit vectors n, of the least n . x on the
segment less the largest n . x in the box: the distance if they are apart, minus the shortest translation that
parts them if they overlap. So each single direction gives a lower bound, and so it does for whatever a moving
segment sweeps. All functions work on matching rows: segment i against box i.
"""

from __future__ import annotations

import numpy as np

from hrsnake_env.arm import FloatArray

__all__ = ["axis_gaps", "direction_gaps", "frame_gaps", "moving_gaps", "separations"]


def frame_gaps(low: FloatArray, high: FloatArray, boxes: FloatArray) -> FloatArray:
    """Compute the gaps of bounding boxes to boxes: the largest along x, y or z; negative if they overlap.

    Parameters
    ----------
    low, high : array, shape (n, 3)
        Corners of the bounding boxes.
    boxes : array, shape (n_boxes, 2, 3)
        All are compared with all.

    Returns
    -------
    gaps : array, shape (n, n_boxes)
    """
    gaps = np.full((len(low), len(boxes)), -np.inf)
    for axis in range(3):
        for apart in (
            low[:, None, axis] - boxes[None, :, 1, axis],
            boxes[None, :, 0, axis] - high[:, None, axis],
        ):
            np.maximum(gaps, apart, out=gaps)
    return gaps


def axis_gaps(start: FloatArray, end: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Compute the gaps between segments and boxes along twelve directions.

    They are the normals of the faces of box plus segment, a zonotope: if the two overlap, the largest gap is
    exactly minus the shortest translation that parts them; if not, it is positive, at most their distance.

    Parameters
    ----------
    start, end, low, high : array, shape (n, 3)
        Ends of the segments, corners of the boxes.

    Returns
    -------
    gaps : array, shape (n, 12)
        Along +x, +y, +z, -x, -y, -z, then + and - the cross product of x, y, z and the segment; minus
        infinity where that is 0.
    """
    gaps = np.full((len(start), 12), -np.inf)
    gaps[:, :3] = np.minimum(start, end) - high
    gaps[:, 3:6] = low - np.maximum(start, end)
    along = end - start
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        size = np.hypot(along[:, b], along[:, c])
        there = size > 0.0
        size = np.where(there, size, 1.0)
        n_b, n_c = -along[:, c] / size, along[:, b] / size
        one, other = (n_b * point[:, b] + n_c * point[:, c] for point in (start, end))
        box_b, box_c = (n_b * low[:, b], n_b * high[:, b]), (n_c * low[:, c], n_c * high[:, c])
        most, least = np.maximum(*box_b) + np.maximum(*box_c), np.minimum(*box_b) + np.minimum(*box_c)
        gaps[there, 6 + axis] = (np.minimum(one, other) - most)[there]
        gaps[there, 9 + axis] = (least - np.maximum(one, other))[there]
    return gaps


def separations(
    start: FloatArray, end: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute signed distances of segments to boxes: exact, negative where they overlap.

    Parameters
    ----------
    start, end, low, high : array, shape (n, 3)
        Ends of the segments, corners of the boxes.

    Returns
    -------
    distances : array, shape (n,)
        If negative, minus the shortest translation that parts the two.
    normals : array, shape (n, 3)
        Unit vectors from box to segment, along which they are that far apart.
    shares : array, shape (n,)
        Where along the segment: the nearest point, or the middle of what is inside.
    """
    gaps = axis_gaps(start, end, low, high)
    best = np.argmax(gaps, axis=1)
    signed = gaps[np.arange(len(gaps)), best]
    normals = _axis_normals(start, end, best)
    shares = _middle_inside(start, end, low, high)
    apart = np.flatnonzero(signed > 0.0)
    distance, normal, share = _distances(start[apart], end[apart], low[apart], high[apart])
    shares[apart] = share
    # What an axis shows already is left to it: differences of rounding have no direction.
    more = distance > signed[apart] + 1e-12 * np.abs(start[apart]).max(axis=1, initial=1.0)
    apart = apart[more]
    signed[apart], normals[apart] = distance[more], normal[more]
    return signed, normals, shares


def _axis_normals(start: FloatArray, end: FloatArray, which: FloatArray) -> FloatArray:
    """Return the directions of `axis_gaps` by number, shape (n, 3)."""
    faces = np.concatenate([np.eye(3), -np.eye(3)])
    normals = faces[np.minimum(which, 5)]
    crossed = np.flatnonzero(which >= 6)
    cross = np.cross(np.eye(3)[which[crossed] % 3], (end - start)[crossed])
    cross /= np.linalg.norm(cross, axis=1, keepdims=True)
    normals[crossed] = np.where(which[crossed, None] < 9, cross, -cross)
    return normals


def _crossings(start: FloatArray, end: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Compute where along segments the planes of the faces are, shape (n, 2, 3); 0 where parallel."""
    along = end - start
    safe = np.where(along != 0.0, along, 1.0)
    with np.errstate(over="ignore"):
        found = np.stack([low - start, high - start], axis=1) / safe[:, None]
    return np.where((along != 0.0)[:, None], found, 0.0)


def _middle_inside(start: FloatArray, end: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Find the middle of what of each segment is in its box."""
    planes, parallel = _crossings(start, end, low, high), end == start
    enter = np.where(parallel, 0.0, planes.min(axis=1)).max(axis=1)
    leave = np.where(parallel, 1.0, planes.max(axis=1)).min(axis=1)
    return np.asarray((np.clip(enter, 0.0, 1.0) + np.clip(leave, 0.0, 1.0)) / 2.0)


def _distances(
    start: FloatArray, end: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute distances of segments to boxes that they do not meet, normals and shares.

    The squared distance of a point to the box is convex along the segment and piecewise quadratic, with a
    breakpoint at the plane of each face. On a piece only the axes along which it is outside contribute. The
    nearest of the points that are best on each piece is the nearest of all.
    """
    n = len(start)
    planes = np.clip(_crossings(start, end, low, high).reshape(n, 6), 0.0, 1.0)
    breaks = np.sort(np.concatenate([planes, np.zeros((n, 1)), np.ones((n, 1))], axis=1), axis=1)
    along, p = (end - start)[:, None], start[:, None]
    middle = p + ((breaks[:, :-1] + breaks[:, 1:]) / 2.0)[..., None] * along
    nearest = np.clip(middle, low[:, None], high[:, None])
    slope = np.where(middle != nearest, along, 0.0)
    square = np.sum(slope**2, axis=2)
    vertex = np.sum(slope * (nearest - p), axis=2) / np.where(square > 0.0, square, 1.0)
    shares = np.clip(vertex, breaks[:, :-1], breaks[:, 1:])
    points = p + shares[..., None] * along
    away = points - np.clip(points, low[:, None], high[:, None])
    squares = np.sum(away**2, axis=2)
    rows, best = np.arange(n), np.argmin(squares, axis=1)
    distance = np.sqrt(squares[rows, best])
    normal = away[rows, best] / np.where(distance > 0.0, distance, 1.0)[:, None]
    return distance, normal, shares[rows, best]


def direction_gaps(points: FloatArray, normals: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Compute the gaps between the hulls of points, shape (n, m, 3), and boxes along unit vectors."""
    nearest = np.einsum("nmi,ni->nm", points, normals).min(axis=1)
    return np.asarray(nearest - np.maximum(normals * low, normals * high).sum(axis=1))


def moving_gaps(before: FloatArray, after: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Bound from below the signed distances of segments whose ends move straight and evenly.

    Two kinds of planes are tried. The faces of the box, beyond which all four ends must be. And planes that
    go along with the segment, and hold one axis too: with m(t) = axis x (end - start), which is linear in
    time, a corner c of the box is m . (c - start) / |m| in front of the plane. The numerator is quadratic in
    time, so its extremes are known, and |m| is largest at one of the two times.

    Parameters
    ----------
    before, after : array, shape (n, 2, 3)
        The segments at the beginning and at the end.
    low, high : array, shape (n, 3)
        Corners of the boxes.

    Returns
    -------
    gaps : array, shape (n,)
    """
    least = np.minimum(before, after).min(axis=1)
    most = np.maximum(before, after).max(axis=1)
    gaps = np.maximum(least - high, low - most).max(axis=1)
    middle = (before + after) / 2.0
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        heights, normals = [], []
        for start, end in ((row[:, 0], row[:, 1]) for row in (before, middle, after)):
            m_b, m_c = start[:, c] - end[:, c], end[:, b] - start[:, b]
            at_b = [m_b * (corner[:, b] - start[:, b]) for corner in (low, high)]
            at_c = [m_c * (corner[:, c] - start[:, c]) for corner in (low, high)]
            heights.append(np.stack([one + other for one in at_b for other in at_c]))
            normals.append(np.stack([m_b, m_c]))
        lowest, highest = _quadratic_extremes(*heights)
        size = [np.hypot(*normal) for normal in normals]
        longest = np.maximum(size[0], size[2])
        shortest = np.maximum(size[1] - np.hypot(*(normals[2] - normals[0])) / 2.0, 0.0)
        for height in (lowest.min(axis=0), -highest.max(axis=0)):
            by = np.where(height >= 0.0, longest, shortest)
            np.maximum(gaps, np.divide(height, by, out=np.full_like(by, -np.inf), where=by > 0.0), out=gaps)
    return np.asarray(gaps)


def _quadratic_extremes(
    first: FloatArray, middle: FloatArray, last: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compute least and largest value on [0, 1] of quadratics by their values at 0, 1/2 and 1."""
    curve = 2.0 * (first - 2.0 * middle + last)
    slope = 4.0 * middle - 3.0 * first - last
    # The vertex is at -slope / (2 curve); within [0, 1] it is an extreme.
    inside = (-slope * np.sign(curve) > 0.0) & (np.abs(slope) < 2.0 * np.abs(curve))
    vertex = first - slope**2 / np.where(inside, 4.0 * curve, 1.0)
    vertex = np.where(inside, vertex, first)
    return np.minimum(np.minimum(first, last), vertex), np.maximum(np.maximum(first, last), vertex)
