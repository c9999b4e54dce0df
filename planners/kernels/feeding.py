"""Kernels of feeding: poses of an arm whose joints all run on one polyline, and their exact check."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray, IntArray

DONE, JUMP, FULL = 0, 1, 2
"""How feeding ends: with the tip at the track's end; where a joint would jump; without room for poses."""

SMALLEST = 1e-7
"""Smallest feed of the tip between poses, in link lengths: a joint that still moves too far jumps."""


@njit(cache=True)
def _start_of_link(
    track: FloatArray, x: float, y: float, length: float, segment: int, share: float
) -> tuple[int, float, float, float]:
    """Find the place on the track one link length from (x, y), from an earlier one on: segment, share, place.

    Segment -1 is the axis behind the track, where `share` is the distance from its first point.
    """
    k, squared = segment, length * length
    px, py = track[k, 0], track[k, 1]
    px += share * (track[k + 1, 0] - px)
    py += share * (track[k + 1, 1] - py)
    if (px - x) ** 2 + (py - y) ** 2 >= squared:
        while (track[k + 1, 0] - x) ** 2 + (track[k + 1, 1] - y) ** 2 >= squared:
            k += 1
            if k + 1 > track.shape[0] - 1:
                return -1, 0.0, 0.0, 0.0
    else:
        while (track[k, 0] - x) ** 2 + (track[k, 1] - y) ** 2 < squared:
            k -= 1
            if k < 0:
                return -1, 0.0, 0.0, 0.0
    ax, ay = track[k, 0] - x, track[k, 1] - y
    ex, ey = track[k + 1, 0] - track[k, 0], track[k + 1, 1] - track[k, 1]
    size = ex * ex + ey * ey
    half = (ax * ex + ay * ey) / size
    root = max(half * half - (ax * ax + ay * ay - squared) / size, 0.0)
    t = min(max(-half - np.sqrt(root), 0.0), 1.0)
    return k, t, track[k, 0] + t * ex, track[k, 1] + t * ey


@njit(cache=True)
def _place_arm(
    track: FloatArray, arc: FloatArray, tip: float, length: float, segment: IntArray, share: FloatArray,
    new_segment: IntArray, new_share: FloatArray, joints: FloatArray,
) -> int:  # fmt: skip
    """Place the joints, numbered from the tip, with the tip at arclength `tip`; return the last one's number.

    That is the first one on the straight part with which the track begins: all behind it are on the axis.
    Each joint is looked for from its earlier place on. Returns -1 where there is none.
    """
    k = segment[0]
    while k + 2 < arc.shape[0] and arc[k + 1] < tip:
        k += 1
    while k > 0 and arc[k] > tip:
        k -= 1
    t = (tip - arc[k]) / (arc[k + 1] - arc[k])
    new_segment[0], new_share[0] = k, t
    joints[0, 0] = track[k, 0] + t * (track[k + 1, 0] - track[k, 0])
    joints[0, 1] = track[k, 1] + t * (track[k + 1, 1] - track[k, 1])
    n = 0
    while _arc_of(n, arc, new_segment, new_share) > length * (1.0 + 1e-12):
        if n + 1 == joints.shape[0]:
            return -1
        k, t, x, y = _start_of_link(track, joints[n, 0], joints[n, 1], length, segment[n + 1], share[n + 1])
        if k < 0:
            return -1
        n += 1
        new_segment[n], new_share[n] = k, t
        joints[n, 0], joints[n, 1] = x, y
    return n


@njit(cache=True)
def _arc_of(k: int, arc: FloatArray, segment: IntArray, share: FloatArray) -> float:
    """Return the arclength at which joint k is placed."""
    place: float = arc[segment[k]] + share[k] * (arc[segment[k] + 1] - arc[segment[k]])
    return place


@njit(cache=True)
def _put_behind(n: int, place: float, length: float, base_pose: FloatArray, joints: FloatArray) -> None:
    """Put joint n, at arclength `place` of the straight part, and those behind it on the axis."""
    cos, sin = np.cos(base_pose[2]), np.sin(base_pose[2])
    for k in range(n, joints.shape[0]):
        along = place - (k - n) * length
        joints[k, 0] = base_pose[0] + along * cos
        joints[k, 1] = base_pose[1] + along * sin


@njit(cache=True)
def _tip_at_release(
    k: int, tip: float, beyond: float, track: FloatArray, arc: FloatArray, length: float, segment: IntArray,
    share: FloatArray, new_segment: IntArray, new_share: FloatArray, joints: FloatArray,
) -> float:  # fmt: skip
    """Find the tip's place, from `tip` to `beyond`, at which joint k is at the end of the straight part."""
    low, high = tip, beyond
    g_low = _arc_of(k, arc, segment, share) - length
    _place_arm(track, arc, high, length, segment, share, new_segment, new_share, joints)
    g_high = _arc_of(k, arc, new_segment, new_share) - length
    at = high
    for _ in range(60):  # regula falsi, with the stale end's value halved (Illinois)
        at = low + (high - low) * g_low / (g_low - g_high)
        if _place_arm(track, arc, at, length, segment, share, new_segment, new_share, joints) < 0:
            return beyond
        g = _arc_of(k, arc, new_segment, new_share) - length
        if abs(g) <= 1e-13 * length:
            break
        if (g > 0.0) == (g_high > 0.0):
            high, g_high, g_low = at, g, 0.5 * g_low
        else:
            low, g_low, g_high = at, g, 0.5 * g_high
    return at


@njit(cache=True)
def feed_along(
    track: FloatArray, arc: FloatArray, length: float, base_pose: FloatArray, step: float, poses: FloatArray
) -> tuple[int, int, float, float]:
    """Feed an arm along a track, pose by pose; no joint moves farther than `step` between two.

    Parameters
    ----------
    track : array, shape (n, 2)
        Begins at the base and is straight along the base heading for one link length.
    arc : array, shape (n,)
        Its arclength; strictly increasing.
    length, step : float
        In maze units.
    base_pose : array, shape (3,)
        Base position and heading.
    poses : array, shape (n_max, n_joints, 2)
        Filled with the joints of each pose, the tip last.

    Returns
    -------
    n_poses, ending : int
        Number of poses, and one of DONE, JUMP and FULL.
    x, y : float
        The tip's place at the end.

    Notes
    -----
    A pose in which a joint is just at the end of the straight part, so that its link is still straight and
    its other end at the base, is never stepped over: the feeder's rule needs it.
    """
    n_joints = poses.shape[1]
    segment, share = np.zeros(n_joints, dtype=np.int64), np.zeros(n_joints)
    new_segment, new_share = np.zeros(n_joints, dtype=np.int64), np.zeros(n_joints)
    now, new = np.empty((n_joints, 2)), np.empty((n_joints, 2))
    total = arc[arc.shape[0] - 1]
    _put_behind(0, 0.0, length, base_pose, now)
    poses[0] = now[::-1]
    placed, tip, stride, n_poses = 0, 0.0, step, 1
    while tip < total:
        if n_poses == poses.shape[0]:
            return n_poses, FULL, now[0, 0], now[0, 1]
        at = min(tip + stride, total)
        n = _place_arm(track, arc, at, length, segment, share, new_segment, new_share, new)
        least = min(n, placed)
        if n >= 0 and n != placed and abs(_arc_of(least, arc, segment, share) - length) > 1e-11 * length:
            at = _tip_at_release(
                least, tip, at, track, arc, length, segment, share, new_segment, new_share, new
            )
            n = _place_arm(track, arc, at, length, segment, share, new_segment, new_share, new)
        moved = np.inf
        if n >= 0 and abs(n - placed) <= 1:
            _put_behind(n, _arc_of(n, arc, new_segment, new_share), length, base_pose, new)
            moved = 0.0
            for k in range(max(n, placed) + 1):
                moved = max(moved, np.hypot(new[k, 0] - now[k, 0], new[k, 1] - now[k, 1]))
        if moved > step * (1.0 + 1e-9):
            stride = (at - tip) * min(max(0.9 * step / moved, 0.1), 0.9)
            if stride < SMALLEST * length:
                return n_poses, JUMP, now[0, 0], now[0, 1]
            continue
        stride = min(step, (at - tip) * min(2.0, 0.97 * step / max(moved, 1e-300)), 2.0 * stride)
        stride = max(stride, 10.0 * SMALLEST * length)
        for k in range(n + 1):
            segment[k], share[k] = new_segment[k], new_share[k]
        for k in range(n + 1, min(placed + 2, n_joints)):
            segment[k], share[k] = 0, 0.0
        now[:] = new
        poses[n_poses] = now[::-1]
        placed, tip = n, at
        n_poses += 1
    return n_poses, DONE, now[0, 0], now[0, 1]


@njit(cache=True)
def _cross(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> bool:
    """Tell whether two segments cross; mere touching is not crossing."""
    ex, ey, fx, fy = bx - ax, by - ay, dx - cx, dy - cy
    c, d = ex * (cy - ay) - ey * (cx - ax), ex * (dy - ay) - ey * (dx - ax)
    if (c >= 0.0 and d >= 0.0) or (c <= 0.0 and d <= 0.0):
        return False
    a, b = fx * (ay - cy) - fy * (ax - cx), fx * (by - cy) - fy * (bx - cx)
    return not ((a >= 0.0 and b >= 0.0) or (a <= 0.0 and b <= 0.0))


@njit(cache=True)
def _in_feeder(ax: float, ay: float, bx: float, by: float, base_pose: FloatArray) -> bool:
    """Tell whether a link from a to b still lies on the feeder's axis, with its start behind the base."""
    cos, sin = np.cos(base_pose[2]), np.sin(base_pose[2])
    size = abs(bx - ax) + abs(by - ay)
    along = (ax - base_pose[0]) * cos + (ay - base_pose[1]) * sin
    start = abs((ay - base_pose[1]) * cos - (ax - base_pose[0]) * sin)
    end = abs((by - base_pose[1]) * cos - (bx - base_pose[0]) * sin)
    behind: bool = along < 0.0 and start <= 1e-9 * size and end <= 1e-9 * size
    return behind


@njit(cache=True)
def first_hit(poses: FloatArray, base_pose: FloatArray, walls: FloatArray) -> tuple[int, int, int]:
    """Find the first pose in which a link in front of the base meets a wall: pose, link, wall; -1 if none.

    Exact up to rounding: centre lines against wall segments, touching counted. A link that comes out of the
    feeder is looked at from the base on.
    """
    for pose in range(poses.shape[0]):
        for link in range(poses.shape[1] - 2, -1, -1):
            ax, ay = poses[pose, link, 0], poses[pose, link, 1]
            bx, by = poses[pose, link + 1, 0], poses[pose, link + 1, 1]
            behind = _in_feeder(ax, ay, bx, by, base_pose)
            if behind:
                ax, ay = base_pose[0], base_pose[1]
            low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
            for w in range(walls.shape[0]):
                cx, cy, dx, dy = walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1]
                if max(cx, dx) < low_x or min(cx, dx) > high_x or max(cy, dy) < low_y or min(cy, dy) > high_y:
                    continue
                ex, ey, fx, fy = bx - ax, by - ay, dx - cx, dy - cy
                c, d = ex * (cy - ay) - ey * (cx - ax), ex * (dy - ay) - ey * (dx - ax)
                if (c > 0.0 and d > 0.0) or (c < 0.0 and d < 0.0):
                    continue
                a, b = fx * (ay - cy) - fy * (ax - cx), fx * (by - cy) - fy * (bx - cx)
                if (a > 0.0 and b > 0.0) or (a < 0.0 and b < 0.0):
                    continue
                return pose, link, w
            if behind:
                break
    return -1, -1, -1


@njit(cache=True)
def first_self_crossing(poses: FloatArray, base_pose: FloatArray) -> tuple[int, int, int]:
    """Find the first pose in which two links that are not neighbours cross: pose and links; -1 if none.

    What is in the feeder is not looked at.
    """
    for pose in range(poses.shape[0]):
        for i in range(poses.shape[1] - 3, -1, -1):
            ax, ay = poses[pose, i, 0], poses[pose, i, 1]
            behind = _in_feeder(ax, ay, poses[pose, i + 1, 0], poses[pose, i + 1, 1], base_pose)
            if behind:
                ax, ay = base_pose[0], base_pose[1]
            bx, by = poses[pose, i + 1, 0], poses[pose, i + 1, 1]
            low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
            for k in range(i + 2, poses.shape[1] - 1):
                cx, cy = poses[pose, k, 0], poses[pose, k, 1]
                dx, dy = poses[pose, k + 1, 0], poses[pose, k + 1, 1]
                if max(cx, dx) < low_x or min(cx, dx) > high_x or max(cy, dy) < low_y or min(cy, dy) > high_y:
                    continue
                if _cross(ax, ay, bx, by, cx, cy, dx, dy):
                    return pose, i, k
            if behind:
                break
    return -1, -1, -1
