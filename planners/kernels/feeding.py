"""Kernels of feeding: poses of an arm whose joints all run on one polyline, and their exact check.

Feeding is the same in the plane and in space; the check is for the plane.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.feeding_sweep import Sweep, directions, start_of_link
from planners.kernels.track_walls import segments_meet
from planners.kernels.types import FloatArray, IntArray

DONE, JUMP, FULL, MEETS = 0, 1, 2, 3
"""How feeding ends: with the tip at the track's end; where a joint would jump; without room for poses; at a
pose that meets a wall or itself."""

SMALLEST = 1e-7
"""Smallest feed of the tip between poses, in link lengths: a joint that still moves too far jumps."""

RELEASED = 1e-10
"""How near to the end of the straight part a joint is just there, in link lengths."""


@njit(cache=True, inline="always")
def _put(track: FloatArray, along: FloatArray, k: int, t: float, row: int, joints: FloatArray) -> None:
    """Put a joint on segment k of the track, a way t from its start."""
    for c in range(track.shape[1]):
        joints[row, c] = track[k, c] + t * along[k, c]


@njit(cache=True)
def _place_arm(
    track: FloatArray, along: FloatArray, arc: FloatArray, tip: float, length: float, segment: IntArray,
    new_segment: IntArray, place: FloatArray, joints: FloatArray,
) -> int:  # fmt: skip
    """Place the joints, the tip last, with the tip at arclength `tip`; return the last one's number.

    Joints are numbered from the tip. The last is the first one on the straight part with which the track
    begins: all behind it are on the axis. Each joint is looked for from its earlier segment on; `place` is
    filled with arclengths. Returns -1 where there is none.
    """
    end, squared = joints.shape[0] - 1, length * length
    k = segment[0]
    while k + 2 < arc.shape[0] and arc[k + 1] < tip:
        k += 1
    while k > 0 and arc[k] > tip:
        k -= 1
    _put(track, along, k, tip - arc[k], end, joints)
    new_segment[0], place[0] = k, tip
    n, at = 0, tip
    while at > length * (1.0 + 1e-12):
        if n == end:
            return -1
        k, t = start_of_link(track, along, joints, end - n, squared, min(segment[n + 1], k), k)
        if k < 0:
            return -1
        n += 1
        at = arc[k] + t
        _put(track, along, k, t, end - n, joints)
        new_segment[n], place[n] = k, at
    return n


@njit(cache=True)
def feeder_axis(base_pose: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return base point and unit heading of a base pose in the plane, shape (3,), or in space, (6,)."""
    if base_pose.shape[0] == 6:
        return base_pose[:3], base_pose[3:]
    return base_pose[:2], np.array([np.cos(base_pose[2]), np.sin(base_pose[2])])


@njit(cache=True)
def _put_behind(
    n: int, place: float, length: float, base: FloatArray, heading: FloatArray, joints: FloatArray
) -> None:
    """Put joint n, at arclength `place` of the straight part, and those behind it on the axis."""
    end = joints.shape[0] - 1
    for k in range(n, joints.shape[0]):
        for c in range(joints.shape[1]):
            joints[end - k, c] = base[c] + (place - (k - n) * length) * heading[c]


@njit(cache=True)
def _tip_at_release(
    k: int, tip: float, beyond: float, at_tip: float, at_beyond: float, track: FloatArray, along: FloatArray,
    arc: FloatArray, length: float, segment: IntArray, new_segment: IntArray, place: FloatArray,
    joints: FloatArray,
) -> float:  # fmt: skip
    """Find the tip's place, from `tip` to `beyond`, at which joint k is at the end of the straight part.

    `at_tip` and `at_beyond` are where joint k is at both.
    """
    low, high, g_low, g_high = tip, beyond, at_tip - length, at_beyond - length
    at = high
    for _ in range(60):  # regula falsi, with the stale end's value halved (Illinois)
        at = low + (high - low) * g_low / (g_low - g_high)
        if _place_arm(track, along, arc, at, length, segment, new_segment, place, joints) < k:
            return beyond
        g = place[k] - length
        if abs(g) <= 1e-13 * length:
            break
        if (g > 0.0) == (g_high > 0.0):
            high, g_high, g_low = at, g, 0.5 * g_low
        else:
            low, g_low, g_high = at, g, 0.5 * g_high
    return at


@njit(cache=True)
def _squared_distance(points: FloatArray, k: int, others: FloatArray, row: int) -> float:
    total = 0.0
    for c in range(points.shape[1]):
        total += (points[k, c] - others[row, c]) ** 2
    return total


@njit(cache=True)
def _releases(track: FloatArray, along: FloatArray, arc: FloatArray, length: float) -> FloatArray:
    """Return the tip's places at which a joint comes to the end of the straight part, the track's end last.

    These are link ends in a row from there on. Where the track comes back to a link's start there are more.
    """
    n_segments, squared = arc.shape[0] - 1, length * length
    found, at = np.empty(int(arc[n_segments] / length) + 2), track[:1].copy()
    n, k = 0, 0
    while True:
        while k < n_segments and _squared_distance(track, k + 1, at, 0) < squared:
            k += 1
        if k == n_segments:
            found[n] = arc[n_segments]
            return found[: n + 1]
        half = 0.0
        for c in range(track.shape[1]):
            half += (track[k, c] - at[0, c]) * along[k, c]
        t = -half + np.sqrt(max(half * half - _squared_distance(track, k, at, 0) + squared, 0.0))
        _put(track, along, k, t, 0, at)
        found[n] = min(arc[k] + t, arc[n_segments])
        n += 1


@njit(cache=True)
def feed_along(
    track: FloatArray, arc: FloatArray, length: float, base_pose: FloatArray, step: float, sweep: Sweep,
    poses: FloatArray, most: int, state: FloatArray, segments: IntArray, places: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Feed an arm along a track, pose by pose; no joint moves farther than `step` between two.

    It may be called again to go on from where it was full.

    Parameters
    ----------
    track : array, shape (n, 2 or 3)
        Begins at the base and is straight along the base heading for one link length.
    arc : array, shape (n,)
        Its arclength; strictly increasing.
    length, step : float
        In maze units.
    base_pose : array, shape (3,) or, in space, (6,)
        Base position and heading.
    sweep : Sweep
        What chords of the track may meet; with empty arrays, as always in space, nothing is looked at.
    poses : array, shape (n_max, n_joints, 2 or 3)
        Filled with the joints of each pose, the tip last.
    most : int
        Poses, after which it is full; at most `n_max`.
    state : array, shape (5,)
        Zeros at first. How far it is: number of poses, place of the tip, stride, number of the joint that is
        placed last, and which half of the next two arrays is in use.
    segments, places : array, shape (2, n_joints)
        Zeros at first. Segment and arclength of the joints, from the tip on, before and after a step.

    Returns
    -------
    n_poses, ending : int
        Number of poses, and one of DONE, JUMP, FULL and MEETS.

    Notes
    -----
    A pose in which a joint is just at the end of the straight part, so that its link is still straight and
    its other end at the base, is never stepped over: the feeder's rule needs it.
    """
    n_joints, end = poses.shape[1], poses.shape[1] - 1
    base, heading = feeder_axis(base_pose)
    along = directions(track, arc)
    releases, next_release = _releases(track, along, arc, length), 0
    total, checked = arc[arc.shape[0] - 1], sweep.low.shape[0] > 0
    links = np.empty(n_joints, dtype=np.int64)
    if state[0] == 0.0:
        _put_behind(0, 0.0, length, base, heading, poses[0])
        state[0], state[2] = 1.0, step
    n_poses, tip, stride, placed, old = int(state[0]), state[1], state[2], int(state[3]), int(state[4])
    while tip < total:
        now = poses[n_poses - 1]
        if n_poses >= most:
            state[0], state[1], state[2], state[3], state[4] = n_poses, tip, stride, placed, old
            return n_poses, FULL
        new, segment, place = poses[n_poses], segments[old], places[old]
        new_segment, new_place = segments[1 - old], places[1 - old]
        while next_release + 1 < releases.shape[0] and releases[next_release] <= tip:
            next_release += 1
        at = min(tip + stride, max(releases[next_release], tip + 1e-12 * length))
        n = _place_arm(track, along, arc, at, length, segment, new_segment, new_place, new)
        least = min(n, placed)
        if n >= 0 and n != placed and min(
            abs(place[least] - length), abs(new_place[least] - length)
        ) > RELEASED * length:  # fmt: skip
            at = _tip_at_release(
                least, tip, at, place[least], new_place[least], track, along, arc, length, segment,
                new_segment, new_place, new,
            )  # fmt: skip
            if at <= tip + 1e-12 * length:  # the joint comes out of the straight part with a jump
                return n_poses, JUMP
            n = _place_arm(track, along, arc, at, length, segment, new_segment, new_place, new)
        moved = np.inf
        if n >= 0 and abs(n - placed) <= 1:
            _put_behind(n, new_place[n], length, base, heading, new)
            moved = 0.0
            for k in range(end - max(n, placed), n_joints):
                moved = max(moved, _squared_distance(new, k, now, k))
            moved = np.sqrt(moved)
        if moved > step * (1.0 + 1e-9):
            stride = (at - tip) * min(max(0.9 * step / moved, 0.1), 0.9)
            if stride < SMALLEST * length:
                return n_poses, JUMP
            continue
        if checked and not _is_free(n, new_segment, new_place, base_pose, sweep, links, poses, n_poses):
            return n_poses, MEETS
        wanted = (at - tip) * min(2.0, 0.97 * step / max(moved, 1e-300))
        # After a short step to a release the stride of before is still right.
        stride = min(step, max(wanted, stride * min(1.0, 0.97 * step / max(moved, 1e-300))), 2.0 * stride)
        stride = max(stride, 10.0 * SMALLEST * length)
        for k in range(n + 1, min(max(placed, n) + 2, n_joints)):
            new_segment[k], new_place[k] = 0, 0.0
        placed, tip, old = n, at, 1 - old
        n_poses += 1
    return n_poses, DONE


@njit(cache=True)
def links_at_end(track: FloatArray, arc: FloatArray, length: float) -> int:
    """Return how many links a tip at the track's end needs, one in the feeder; -1 if it jumps."""
    along, squared = directions(track, arc), length * length
    k, at, n = arc.shape[0] - 2, arc[arc.shape[0] - 1], 0
    joint = track[k + 1 : k + 2].copy()
    while at > length * (1.0 + 1e-12):
        k, t = start_of_link(track, along, joint, 0, squared, k, k)
        if k < 0:
            return -1
        n, at = n + 1, arc[k] + t
        _put(track, along, k, t, 0, joint)
    return n + 1


@njit(cache=True)
def configurations(
    poses: FloatArray, length: float, base_pose: FloatArray, feed: FloatArray, joint_angles: FloatArray
) -> None:
    """Fill the feed, shape (n_poses,), and the joint angles, shape (n_poses, n_links), of poses fed along.

    Angles are in rad and unwrapped: none changes by more than a half turn from pose to pose. Links that are
    still in the feeder have exactly none.
    """
    cos, sin = np.cos(base_pose[2]), np.sin(base_pose[2])
    n_links = joint_angles.shape[1]
    for p in range(poses.shape[0]):
        rear = (poses[p, 0, 0] - base_pose[0]) * cos + (poses[p, 0, 1] - base_pose[1]) * sin
        feed[p] = rear + n_links * length
        n_inside = min(max(int(np.floor(-rear / length + 1e-9)), 0), n_links)
        joint_angles[p, :n_inside] = 0.0
        ux, uy = length * cos, length * sin
        for k in range(n_inside, n_links):
            vx, vy = poses[p, k + 1, 0] - poses[p, k, 0], poses[p, k + 1, 1] - poses[p, k, 1]
            cross, dot = ux * vy - uy * vx, ux * vx + uy * vy
            if abs(cross) < 0.01 * dot:
                # The series is exact to rounding, and most links follow nearly straight.
                r = cross / dot
                s = r * r
                angle = r * (1.0 - s * (1.0 / 3.0 - s * (0.2 - s * (1.0 / 7.0 - s / 9.0))))
            else:
                angle = np.arctan2(cross, dot)
            if p > 0 and abs(angle - joint_angles[p - 1, k]) > np.pi:
                angle += 2.0 * np.pi * np.round((joint_angles[p - 1, k] - angle) / (2.0 * np.pi))
            joint_angles[p, k] = angle
            ux, uy = vx, vy


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


@njit(cache=True)
def _is_free(
    n: int, segment: IntArray, place: FloatArray, base_pose: FloatArray, sweep: Sweep, links: IntArray,
    poses: FloatArray, pose: int,
) -> bool:  # fmt: skip
    """Tell whether a pose with n links on the track meets neither walls nor itself, as exactly as the above.

    Only what the chords of the track may meet is looked at, unless a link starts where none was known to.
    The link that comes out of the feeder is not looked at against walls.
    """
    end, n_met = poses.shape[1] - 1, 0
    slack = 1e-9 * place[0]
    for i in range(n):
        j = segment[i]
        if not (sweep.low[j] - slack <= place[i + 1] <= sweep.high[j] + slack):
            only = poses[pose : pose + 1]
            return first_hit(only, base_pose, sweep.walls)[0] < 0 and (
                first_self_crossing(only, base_pose)[0] < 0
            )
        for at in range(sweep.first[j], sweep.first[j + 1]):
            w = sweep.members[at]
            if segments_meet(
                poses[pose, end - i - 1, 0], poses[pose, end - i - 1, 1],
                poses[pose, end - i, 0], poses[pose, end - i, 1],
                sweep.walls[w, 0, 0], sweep.walls[w, 0, 1], sweep.walls[w, 1, 0], sweep.walls[w, 1, 1],
            ):  # fmt: skip
                return False
        if sweep.crosses[j]:
            links[n_met] = i
            n_met += 1
    if sweep.crosses[0]:
        links[n_met] = n
        n_met += 1
    for p in range(n_met - 1):
        dx, dy = poses[pose, end - links[p], 0], poses[pose, end - links[p], 1]
        cx, cy = poses[pose, end - links[p] - 1, 0], poses[pose, end - links[p] - 1, 1]
        for q in range(p + 1, n_met):
            if links[q] < links[p] + 2:
                continue
            ax, ay = base_pose[0], base_pose[1]
            if links[q] < n:
                ax, ay = poses[pose, end - links[q] - 1, 0], poses[pose, end - links[q] - 1, 1]
            bx, by = poses[pose, end - links[q], 0], poses[pose, end - links[q], 1]
            if _cross(ax, ay, bx, by, cx, cy, dx, dy):
                return False
    return True
