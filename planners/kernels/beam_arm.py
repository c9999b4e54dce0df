"""The flowchart of the beam planner (section 3.8): the whole arm, pose by pose.

The reference link is the one whose start has passed the base last: what is upstream of it lies in the feeder
(Part C), and downstream of it, towards the tip, links follow the rules (Part B), one after the other. Each
starts at the end of its adjacent link, upstream, and looks at its guide link, downstream.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.beam_rules import (
    blocking,
    clamp_to_free,
    closest_path_point,
    edge_side,
    is_near_semi_critical,
    nearest_index,
    path_point,
    soften,
    tangent_point,
    turn_between,
)
from planners.kernels.beam_types import (
    AXIS,
    BLOCKED,
    CHOICE,
    CLOSEST,
    EDGE,
    NOTHING,
    PATH,
    PIECES,
    POINTS,
    TANGENT,
    TARGET,
    Records,
    Terms,
    Way,
)
from planners.kernels.types import FloatArray, IntArray

GOAL, TOO_LONG, NO_GAP, JUMP, FULL = 0, 1, 2, 3, 4
"""How feeding ends: at the goal; all arm fed; a link without a free direction; a joint that would jump; no
room for more poses."""

LITTLE = 12
"""Path points about the one that was closest: half a passage width, many times a joint's step."""

TICKS = 128
"""The regular feed per pose is divided by up to this where joints move fast."""


@njit(cache=True)
def choose(way: Way, links: Records, k: int, terms: Terms) -> float:
    """Choose what a link does, and return the direction: tangent, edge side or path point (3.1, 3.3 to 3.6).

    A link that finds a tangent point takes it, unless its guide link blocks it. Otherwise it takes the edge
    side of the next critical corner, however far that is: the left side for a right corner and the other way
    round (3.5). Near a semi-critical corner, behind the last critical one, and where the edge ends, it takes
    the path point. Choice, target, corner and what blocks are written into `links`.
    """
    link, points, length = links[k], way.lines[POINTS], terms.length
    px, py, index = links[k + 1].x, links[k + 1].y, link.closest
    link.blocked = NOTHING
    target = tangent_point(way, px, py, index, length)
    if target >= 0:
        corner = way.beams[target].corner
        link.blocked = blocking(links, k, corner, terms)
        if link.blocked == NOTHING:
            link.choice, link.target, link.corner = TANGENT, target, corner
            return float(np.arctan2(points[target, 1] - py, points[target, 0] - px))
    corner = way.beams[index].next_critical
    if corner >= 0:
        beam, direction = edge_side(way, corner, px, py, index, length)
        if beam >= 0 and not (terms.semi_critical and is_near_semi_critical(way, index, beam)):
            link.choice, link.target, link.corner = EDGE, beam, corner
            return direction
    link.choice, link.corner = PATH, -1
    link.target, direction = path_point(way, px, py, index, length)
    return direction


@njit(cache=True)
def find_closest(way: Way, links: Records, k: int, terms: Terms) -> int:
    """Find the path point closest to the start of a link, which is the end of its adjacent link (3.2).

    The search begins a little before the path point of the last pose.
    """
    adjacent, last = links[k + 1], links[k].closest
    if adjacent.choice != AXIS:
        first = adjacent.target if adjacent.choice == TANGENT else adjacent.closest
        found = closest_path_point(
            way, links[k + 2].x, links[k + 2].y, adjacent.heading, terms.length,
            max(first, last - LITTLE), terms.reach, terms.near_end,
        )  # fmt: skip
        if found >= 0:
            return found
    return nearest_index(way.lines[POINTS], adjacent.x, adjacent.y, last, LITTLE)


@njit(cache=True)
def place_reference_link(links: Records, reference: int, axial: float, base_pose: FloatArray) -> None:
    """Place the end of the reference link (Part A): `axial` in front of the base, on the feeder's axis."""
    link = links[reference]
    link.heading, link.choice, link.corner = base_pose[2], AXIS, -1
    link.x = base_pose[0] + axial * np.cos(base_pose[2])
    link.y = base_pose[1] + axial * np.sin(base_pose[2])


@njit(cache=True)
def place_downstream_link(
    way: Way,
    links: Records,
    k: int,
    share: float,
    released: float,
    terms: Terms,
    walls: FloatArray,
    blocked: FloatArray,
    gaps: FloatArray,
) -> bool:
    """Place a link downstream of the reference link (Part B), whose adjacent link is placed.

    The feeder has let go of its joint by `released` rad. Returns False if it has no free direction within
    this and its joint's limit.
    """
    link, adjacent = links[k], links[k + 1]
    was, was_about, direction = link.choice, link.corner, link.heading
    link.closest = find_closest(way, links, k, terms)
    wanted = choose(way, links, k, terms)
    remember_jump(way, links, k, wanted, terms.jump)
    if link.choice != was or link.corner != was_about:
        link.pieces = terms.degree
    wanted, link.pieces = soften(direction, wanted, link.pieces, share)
    straight, most_bent = adjacent.heading, min(released, terms.joint_limit)
    wanted = straight + min(max(turn_between(straight, wanted), -most_bent), most_bent)
    if terms.clamp:
        found, wanted = clamp_to_free(
            wanted, direction, terms.turn * share, adjacent.x, adjacent.y, terms.length, walls, terms.pad,
            blocked, gaps,
        )  # fmt: skip
        if not found or abs(wanted - straight) > most_bent + 1e-12:
            return False
    link.heading = direction + turn_between(direction, wanted)
    link.x = adjacent.x + terms.length * np.cos(wanted)
    link.y = adjacent.y + terms.length * np.sin(wanted)
    return True


@njit(cache=True)
def remember_jump(way: Way, links: Records, k: int, wanted: float, threshold: float) -> None:
    """Remember the corner at which a link's aim jumps to an edge side, until it is tangent or past (3.6)."""
    link = links[k]
    if link.choice == TANGENT or (link.jumped >= 0 and link.closest > way.corners[link.jumped].last):
        link.jumped = -1
    if link.choice == EDGE and abs(turn_between(link.aimed, wanted)) > threshold:
        link.jumped = link.corner
    link.aimed = wanted


@njit(cache=True)
def place_upstream_links(links: Records, reference: int, length: float, base_pose: FloatArray) -> None:
    """Place the links upstream of the reference link (Part C): on the axis, in the feeder."""
    c, s = np.cos(base_pose[2]), np.sin(base_pose[2])
    for k in range(reference + 1, links.shape[0]):
        links[k].heading = base_pose[2]
        links[k].x = links[k - 1].x - length * c
        links[k].y = links[k - 1].y - length * s


@njit(cache=True)
def place_arm(
    way: Way,
    links: Records,
    reference: int,
    feed: float,
    share: float,
    base_pose: FloatArray,
    terms: Terms,
    walls: FloatArray,
    blocked: FloatArray,
    gaps: FloatArray,
) -> int:
    """Place the whole arm for a feed (Fig. 16); `links` holds the last pose and is overwritten.

    Returns -1, or the link that has no free direction.
    """
    axial = feed - reference * terms.length
    place_reference_link(links, reference, axial, base_pose)
    place_upstream_links(links, reference, terms.length, base_pose)
    for k in range(reference - 1, -1, -1):
        released = terms.release * (axial / terms.length + reference - 1 - k)
        if not place_downstream_link(way, links, k, share, released, terms, walls, blocked, gaps):
            return k
    return -1


@njit(cache=True)
def largest_movement(before: Records, after: Records, reference: int) -> tuple[float, int]:
    """Return the largest movement of a joint downstream of the reference link, and whose end it is."""
    largest, whose = 0.0, 0
    for k in range(reference):
        moved = np.hypot(after[k].x - before[k].x, after[k].y - before[k].y)
        if moved > largest:
            largest, whose = moved, k
    return largest, whose


@njit(cache=True)
def feed_arm(
    way: Way,
    now: Records,
    new: Records,
    progress: IntArray,
    base_pose: FloatArray,
    goal: FloatArray,
    stop: float,
    terms: Terms,
    walls: FloatArray,
    poses_per_link: int,
    step_limit: float,
    n_last: int,
    feeds: FloatArray,
    headings: FloatArray,
    record: IntArray,
) -> tuple[int, int]:
    """Feed the arm pose by pose, from where it is to the goal.

    Parameters
    ----------
    way : Way
        Path, beams and corners.
    now, new : Records
        The arm, in the pose `headings[n - 1]`, and room for a copy. There is one more link than there.
    progress : array, shape (3,)
        Number of poses n, feed in ticks, and ticks of the next pose; updated.
    base_pose : array, shape (3,)
        Base position and heading.
    goal : array, shape (2,)
        Place of the goal.
    stop : float
        Feeding ends when the tip is this near to the goal.
    terms : Terms
        Of the rules.
    walls : array, shape (n_walls, 2, 2)
        Wall segments.
    poses_per_link : int
        Regular number of poses per link length of feed.
    step_limit : float
        Largest movement of any joint between poses; the feed per pose shrinks where needed. Where that does
        not help, a clamped arm ends there and any other jumps.
    n_last : int
        No more poses than these.
    feeds : array, shape (n_max,)
        Filled with the feed of each pose.
    headings : array, shape (n_max, n_links)
        Filled with the heading of each link.
    record : array, shape (n_max or 0, n_links, 5)
        Filled with what each link does, in the columns of `beam_types`, if there is room.

    Returns
    -------
    ending, link : int
        One of GOAL, TOO_LONG, NO_GAP, JUMP and FULL, and the link at which it ended.
    """
    n_links = headings.shape[1]
    room = walls.shape[0] + 1
    blocked, gaps = np.empty((room, 2)), np.empty((room, 2))
    per_link = poses_per_link * TICKS
    while progress[0] < n_last:
        # No pose steps over the place where a joint passes the base.
        stride = min(progress[2], per_link - progress[1] % per_link)
        place = progress[1] + stride
        if place // per_link > n_links:
            return TOO_LONG, 0
        new[:] = now
        # A link whose joint is just at the base is still straight in that pose.
        reference = (place - 1) // per_link
        feed = place * terms.length / per_link
        failed = place_arm(way, new, reference, feed, stride / TICKS, base_pose, terms, walls, blocked, gaps)
        largest, whose = largest_movement(now, new, reference)
        if failed >= 0 or largest > step_limit:
            if stride > 1:
                progress[2] = stride // 2
                continue
            if failed >= 0:
                return NO_GAP, failed
            if terms.clamp:
                return JUMP, whose
        now[:] = new
        n = progress[0]
        feeds[n] = feed
        for k in range(n_links):
            headings[n, k] = now[k].heading
        if n < record.shape[0]:
            _write_record(now, record[n])
        grown = 2 * stride if 2.0 * largest < step_limit else stride
        progress[0], progress[1], progress[2] = n + 1, place, min(grown, TICKS)
        if np.hypot(now[0].x - goal[0], now[0].y - goal[1]) <= stop:
            return GOAL, 0
    return FULL, 0


@njit(cache=True)
def _write_record(links: Records, row: IntArray) -> None:
    for k in range(row.shape[0]):
        row[k, CHOICE] = links[k].choice
        row[k, TARGET] = links[k].target
        row[k, CLOSEST] = links[k].closest
        row[k, BLOCKED] = links[k].blocked
        row[k, PIECES] = np.ceil(links[k].pieces)
