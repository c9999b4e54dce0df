"""Kernels of the beam planner: one function per subsection of section 3 of the paper, and the whole sweep.

Every rule answers one question for one link: in which direction shall the link that starts at p point?
Lengths are in maze units, angles in rad. Path points and beam ends share their indices.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.rod import WHOLE_TURN, free_directions, nearest_gap
from planners.kernels.types import FloatArray, IntArray

TWO_PI = 2.0 * np.pi

GOAL, TOO_LONG, NO_GAP, JUMP = 0, 1, 2, 3
"""How a sweep ends: at the goal; all arm fed; a link without a free direction; a joint that would jump."""

FLAT = 1e-4
"""Sine below which two vectors count as parallel: straight legs have no tangent points, only rounding."""

TICKS = 128
"""The regular feed per pose is divided by up to this where joints move fast."""


@njit(cache=True)
def closest_index(points: FloatArray, px: float, py: float, around: int, reach: int) -> int:
    """Find the path point closest to the end of a link (section 3.2), which is where the next one starts.

    The paper walks along the beams that the link crosses to the one through its end; a search of the closest
    of the path points at most `reach` indices away from `around`, that of the last pose, finds the same. It
    stays local: the other leg of a U-turn may be nearer than the own one.
    """
    best, best_squared = around, np.inf
    for i in range(max(0, around - reach), min(points.shape[0], around + reach + 1)):
        squared = (points[i, 0] - px) ** 2 + (points[i, 1] - py) ** 2
        if squared < best_squared:
            best, best_squared = i, squared
    return best


@njit(cache=True)
def tangent_point(
    points: FloatArray, px: float, py: float, index: int, length: float, corner_at: IntArray
) -> int:
    """Find the path point at which a link from p is tangent to the path (section 3.1), or -1.

    From the path point next to the one closest to p, the vectors F from p to consecutive path points are
    multiplied; the tangent point is where the product changes sign. Only points within the link's reach and
    inside a critical corner count, and there the change that belongs to its turn.
    """
    previous = 0.0
    for i in range(index + 1, points.shape[0] - 1):
        ax, ay = points[i, 0] - px, points[i, 1] - py
        bx, by = points[i + 1, 0] - px, points[i + 1, 1] - py
        reach, reach_b = np.hypot(ax, ay), np.hypot(bx, by)
        if reach_b > length:
            return -1
        sine = (ax * by - ay * bx) / max(reach * reach_b, 1e-300)
        if abs(sine) < FLAT:
            continue
        if previous * sine < 0.0 and sine * corner_at[i] > 0.0:
            return i
        previous = sine
    return -1


@njit(cache=True)
def direction_to_distance(
    line: FloatArray, px: float, py: float, index: int, length: float
) -> tuple[bool, float]:
    """Return the direction from p to the first place on a line, from an index on, at distance `length`.

    With the ends of the outer beams as line this is the closest edge side coordinate (section 3.3); with the
    path itself, the closest path point. The paper takes the first point at or beyond the distance; between
    two points we interpolate, so that the direction does not jump from point to point.
    """
    for i in range(index, line.shape[0]):
        bx, by = line[i, 0] - px, line[i, 1] - py
        if bx * bx + by * by < length * length:
            continue
        if i > index:
            ax, ay = line[i - 1, 0] - px, line[i - 1, 1] - py
            ex, ey = bx - ax, by - ay
            squared = ex * ex + ey * ey
            half = (ax * ex + ay * ey) / squared
            t = -half + np.sqrt(half * half + (length * length - ax * ax - ay * ay) / squared)
            bx, by = ax + t * ex, ay + t * ey
        return True, np.arctan2(by, bx)
    return False, 0.0


@njit(cache=True)
def aim(
    px: float,
    py: float,
    length: float,
    index: int,
    taken: int,
    points: FloatArray,
    left: FloatArray,
    right: FloatArray,
    corner_at: IntArray,
    next_corner: IntArray,
) -> tuple[float, int]:
    """Choose the direction of a link from p: tangent, edge side or path point (sections 3.1, 3.3, 3.5, 3.6).

    A link that finds a tangent point takes it, unless the next link towards the tip is tangent to the same
    corner, `taken`. Otherwise it takes the outer edge side of the next critical corner, however far that is:
    the left side for a right corner and the other way round. Behind the last corner, or where the edge ends,
    it takes the path point. Returned with the direction is the corner that the link is tangent to, or 0.
    """
    tangent = tangent_point(points, px, py, index, length, corner_at)
    if tangent >= 0 and corner_at[tangent] != taken:
        return np.arctan2(points[tangent, 1] - py, points[tangent, 0] - px), corner_at[tangent]
    if next_corner[index] != 0:
        edge = left if next_corner[index] < 0 else right
        found, direction = direction_to_distance(edge, px, py, index, length)
        if found:
            return direction, 0
    found, direction = direction_to_distance(points, px, py, index, length)
    if found:
        return direction, 0
    last = points.shape[0] - 1
    return np.arctan2(points[last, 1] - py, points[last, 0] - px), 0


@njit(cache=True)
def soften(direction: float, wanted: float, largest: float) -> float:
    """Turn from a direction towards the wanted one, by at most `largest` (section 3.7)."""
    change = (wanted - direction + np.pi) % TWO_PI - np.pi
    return direction + min(max(change, -largest), largest)


@njit(cache=True)
def clamp_to_free(
    wanted: float,
    direction: float,
    px: float,
    py: float,
    length: float,
    walls: FloatArray,
    pad: float,
    blocked: FloatArray,
    gaps: FloatArray,
) -> tuple[bool, float]:
    """Move the wanted direction into the free interval nearest to the link's present direction.

    Not in the paper: it is what the exact check shows to be needed for a penetration of 0.
    """
    n_gaps = free_directions(px, py, length, walls, pad, blocked, gaps)
    if n_gaps == 0:
        return False, direction
    start, end = nearest_gap(direction, gaps, n_gaps)
    if end - start >= WHOLE_TURN:  # nothing is in the way, and the ends of the interval mean nothing
        return True, wanted
    return True, min(max(wanted, start), end)


@njit(cache=True)
def _place_links(
    first: int,
    feed: float,
    turn_limit: float,
    length: float,
    joint_limit: float,
    base_pose: FloatArray,
    points: FloatArray,
    left: FloatArray,
    right: FloatArray,
    corner_at: IntArray,
    next_corner: IntArray,
    reach: int,
    walls: FloatArray,
    pad: float,
    blocked: FloatArray,
    gaps: FloatArray,
    headings: FloatArray,
    indices: IntArray,
    tangent_to: IntArray,
    joints: FloatArray,
) -> int:
    """Place all links of one pose, base to tip, and return -1, or the link that has no free direction.

    `first` is the link that is still held on the feeder's axis, next to the base. Links are numbered from the
    tip here, so that a number stays with its link as the arm is fed. `headings`, `indices` (of the path point
    closest to each link's start), `tangent_to` (the corner, or 0) and `joints` hold the last pose and are
    overwritten; `joints[k]` is the end of link k.
    """
    axial = feed - first * length
    headings[first] = base_pose[2]
    joints[first, 0] = base_pose[0] + axial * np.cos(base_pose[2])
    joints[first, 1] = base_pose[1] + axial * np.sin(base_pose[2])
    for k in range(first - 1, -1, -1):
        px, py = joints[k + 1, 0], joints[k + 1, 1]
        indices[k] = closest_index(points, px, py, indices[k], reach)
        taken = tangent_to[k - 1] if k > 0 else 0
        wanted, tangent_to[k] = aim(
            px, py, length, indices[k], taken, points, left, right, corner_at, next_corner
        )
        wanted = soften(headings[k], wanted, turn_limit)
        wanted = min(max(wanted, headings[k + 1] - joint_limit), headings[k + 1] + joint_limit)
        found, wanted = clamp_to_free(wanted, headings[k], px, py, length, walls, pad, blocked, gaps)
        if not found or abs(wanted - headings[k + 1]) > joint_limit + 1e-12:
            return k
        headings[k] = wanted
        joints[k, 0] = px + length * np.cos(wanted)
        joints[k, 1] = py + length * np.sin(wanted)
    return -1


@njit(cache=True)
def sweep_poses(
    length: float,
    joint_limit: float,
    base_pose: FloatArray,
    goal: FloatArray,
    stop: float,
    points: FloatArray,
    left: FloatArray,
    right: FloatArray,
    corner_at: IntArray,
    next_corner: IntArray,
    reach: int,
    walls: FloatArray,
    poses_per_link: int,
    softening: float,
    pad: float,
    step_limit: float,
    feeds: FloatArray,
    headings: FloatArray,
) -> tuple[int, int, int, float, float]:
    """Feed the arm pose by pose from the feeder to the goal.

    Parameters
    ----------
    length, joint_limit : float
        Of the links.
    base_pose : array, shape (3,)
        Base position and heading.
    goal : array, shape (2,)
        Place of the goal.
    stop : float
        The sweep ends when the tip is this near to the goal.
    points, left, right : array, shape (n, 2)
        Path points and the ends of the beams.
    corner_at : array, shape (n,)
        Number of the critical corner at each path point, from 1, negative for right corners; else 0.
    next_corner : array, shape (n,)
        The same for the next corner that ends at or after each index; 0 behind the last.
    reach : int
        How far, in path points, the closest point may move along the path from pose to pose.
    walls : array, shape (n_walls, 2, 2)
        Wall segments.
    poses_per_link : int
        Regular number of poses per link length of feed.
    softening : float
        Largest turn of a link, in rad per link length of feed.
    pad : float
        Kept from the walls, in rad.
    step_limit : float
        Largest movement of any joint between poses; the feed per pose shrinks where needed.
    feeds : array, shape (n_max,)
        Filled with the feed of each pose.
    headings : array, shape (n_max, n_links)
        Filled with the heading of each link, numbered from the tip.

    Returns
    -------
    n_poses, ending, link : int
        The number of poses, one of GOAL, TOO_LONG, NO_GAP and JUMP, and the link at which it ended, from the
        tip.
    x, y : float
        Start of that link.
    """
    n_links = headings.shape[1]
    blocked, gaps = np.empty((walls.shape[0] + 1, 2)), np.empty((walls.shape[0] + 1, 2))
    now, new = np.full(n_links + 1, base_pose[2]), np.full(n_links + 1, base_pose[2])
    index_now, index_new = np.zeros(n_links + 1, dtype=np.int64), np.zeros(n_links + 1, dtype=np.int64)
    tangent_now, tangent_new = np.zeros(n_links + 1, dtype=np.int64), np.zeros(n_links + 1, dtype=np.int64)
    joints, joints_new = np.empty((n_links + 1, 2)), np.empty((n_links + 1, 2))
    for k in range(n_links + 1):
        joints[k, 0] = base_pose[0] - k * length * np.cos(base_pose[2])
        joints[k, 1] = base_pose[1] - k * length * np.sin(base_pose[2])
    per_link = poses_per_link * TICKS
    tick = length / per_link
    feeds[0] = 0.0
    headings[0] = base_pose[2]
    n, place, stride = 1, 0, TICKS
    while n < feeds.shape[0]:
        # No pose steps over the place where a joint passes the base.
        stride = min(stride, per_link - place % per_link)
        if (place + stride) // per_link > n_links:
            return n, TOO_LONG, 0, joints[0, 0], joints[0, 1]
        feed = (place + stride) * tick
        turn_limit = softening * stride / per_link
        new[:], index_new[:], tangent_new[:], joints_new[:] = now, index_now, tangent_now, joints
        # A link whose joint is just at the base is still straight in that pose.
        first = (place + stride - 1) // per_link
        failed = _place_links(
            first, feed, turn_limit, length, joint_limit, base_pose, points, left, right, corner_at,
            next_corner, reach, walls, pad, blocked, gaps, new, index_new, tangent_new, joints_new,
        )  # fmt: skip
        if failed >= 0:
            largest = np.inf
        else:
            largest, failed = 0.0, 0
            for k in range(first):
                moved = np.hypot(joints_new[k, 0] - joints[k, 0], joints_new[k, 1] - joints[k, 1])
                if moved > largest:
                    largest, failed = moved, k
        if largest > step_limit:
            if stride > 1:
                stride = stride // 2
                continue
            ending = NO_GAP if largest == np.inf else JUMP
            return n, ending, failed, joints[failed + 1, 0], joints[failed + 1, 1]
        now[:], index_now[:], tangent_now[:], joints[:] = new, index_new, tangent_new, joints_new
        place += stride
        stride = min(2 * stride, TICKS)
        feeds[n] = feed
        headings[n] = now[:n_links]
        n += 1
        if np.hypot(joints[0, 0] - goal[0], joints[0, 1] - goal[1]) <= stop:
            return n, GOAL, 0, joints[0, 0], joints[0, 1]
    return n, TOO_LONG, 0, joints[0, 0], joints[0, 1]
