"""Kernels that grow an arm out of a feeder, at angles that are exactly free; all in link lengths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.fed_arm import FedScene, keeps_off
from planners.kernels.types import FloatArray, IntArray

INSET = 0.01
"""How far inside a free range of directions its first and last ones are taken, in rad."""

STRATUM = 0.2
"""One direction is drawn from about every so many rad of a free range."""

REACH = 1.01
"""How far walls are looked for: a link and its margin."""

MOST = 64
"""Directions that are tried at a joint, at most."""


class Chains(NamedTuple):
    """Partial arms, as the tree of their joints.

    Attributes
    ----------
    places : array, shape (n, 2)
        Of joints; the first is the base, those grown from it are on the feeder's axis.
    headings, angles : array, shape (n,)
        Of the link that ends at the joint, and its angle to the link before, in rad.
    parents : array, shape (n,)
        The joint before; -1 for the base.
    guides : array, shape (n,)
        The farthest guide point that each sees.
    to_go : array, shape (n,)
        Way to the goal by that guide point.
    bent : array, shape (n,)
        Sum of the squares of the angles up to there.
    """

    places: FloatArray
    headings: FloatArray
    angles: FloatArray
    parents: IntArray
    guides: IntArray
    to_go: FloatArray
    bent: FloatArray


Grown = tuple[FloatArray, FloatArray, FloatArray, IntArray, IntArray, FloatArray, FloatArray]


class Guide(NamedTuple):
    """A path to the goal, and what counts as there.

    Attributes
    ----------
    points : array, shape (n, 2)
        Evenly spaced, the goal last.
    spacing : float
        Of the points, along the path.
    radius : float
        How near to the goal the tip must be.
    """

    points: FloatArray
    spacing: float
    radius: float


@njit(cache=True)
def free_directions(place: FloatArray, heading: float, most: float, walls: FloatArray) -> FloatArray:
    """Compute in which directions a link meets no wall.

    Parameters
    ----------
    place : array, shape (2,)
        Where the link begins.
    heading : float
        Direction from which angles are counted, in rad.
    most : float
        Largest angle, in rad; under pi.
    walls : array, shape (n_walls, 2, 2)
        Segments, none of which goes through the place.

    Returns
    -------
    ranges : array, shape (n, 2)
        First and last angle of each free range, in order.
    """
    blocked, n = np.empty((2 * walls.shape[0] + 2, 2)), 0
    for wall in range(walls.shape[0]):
        ax, ay = walls[wall, 0, 0] - place[0], walls[wall, 0, 1] - place[1]
        along_x, along_y = walls[wall, 1, 0] - walls[wall, 0, 0], walls[wall, 1, 1] - walls[wall, 0, 1]
        squared = along_x * along_x + along_y * along_y
        half = ax * along_x + ay * along_y
        root = half * half - squared * (ax * ax + ay * ay - 1.0)
        if squared == 0.0 or root <= 0.0:
            continue
        low, high = (-half - np.sqrt(root)) / squared, (-half + np.sqrt(root)) / squared
        low, high = max(low, 0.0), min(high, 1.0)
        if low >= high:
            continue
        first = np.arctan2(ay + low * along_y, ax + low * along_x) - heading
        last = np.arctan2(ay + high * along_y, ax + high * along_x) - heading
        turn = (last - first + np.pi) % (2.0 * np.pi) - np.pi
        start = ((first if turn >= 0.0 else last) + np.pi) % (2.0 * np.pi) - np.pi
        blocked[n, 0], blocked[n, 1] = start, start + abs(turn)
        n += 1
        if start + abs(turn) > np.pi:
            blocked[n, 0], blocked[n, 1] = -np.pi, start + abs(turn) - 2.0 * np.pi
            n += 1
    ranges, n_ranges, reached = np.empty((n + 1, 2)), 0, -most
    for k in np.argsort(blocked[:n, 0]):
        if blocked[k, 0] >= most:
            break
        if blocked[k, 0] > reached:
            ranges[n_ranges, 0], ranges[n_ranges, 1] = reached, blocked[k, 0]
            n_ranges += 1
        reached = max(reached, blocked[k, 1])
    if reached < most:
        ranges[n_ranges, 0], ranges[n_ranges, 1] = reached, most
        n_ranges += 1
    return ranges[:n_ranges]


@njit(cache=True)
def link_is_free(a: FloatArray, b: FloatArray, walls: FloatArray, need: float) -> bool:
    """Tell whether the segment ab meets no wall and is at least `need` from all."""
    for wall in range(walls.shape[0]):  # noqa: SIM110 - numba has no all()
        if not keeps_off(a, b, walls[wall, 0], walls[wall, 1], need):
            return False
    return True


@njit(cache=True)
def _walls_about(points: FloatArray, walls: FloatArray) -> FloatArray:
    """Return the walls whose boxes meet that of some points: all that segments between these may meet."""
    near, n = np.empty_like(walls), 0
    x0, x1 = points[:, 0].min(), points[:, 0].max()
    y0, y1 = points[:, 1].min(), points[:, 1].max()
    for wall in range(walls.shape[0]):
        (ax, ay), (bx, by) = walls[wall, 0], walls[wall, 1]
        if max(ax, bx) >= x0 and min(ax, bx) <= x1 and max(ay, by) >= y0 and min(ay, by) <= y1:
            near[n] = walls[wall]
            n += 1
    return near[:n]


@njit(cache=True)
def _window(after: int, guide: Guide) -> tuple[int, int]:
    """Return the first and the last guide point that a link after the one that sees `after` may see."""
    steps = int(1.0 / guide.spacing)
    return max(after - steps, 0), min(after + 2 * steps + 1, guide.points.shape[0] - 1)


@njit(cache=True)
def farthest_seen(place: FloatArray, after: int, guide: Guide, walls: FloatArray) -> int:
    """Return the farthest guide point, up to two links after one, seen from a place; -1 if none is."""
    first, last = _window(after, guide)
    for k in range(last, first - 1, -1):
        if link_is_free(place, guide.points[k], walls, 0.0):
            return k
    return -1


@njit(cache=True)
def _directions(
    place: FloatArray, heading: float, most: float, ahead: FloatArray, walls: FloatArray, draws: FloatArray,
    angles: FloatArray,
) -> int:  # fmt: skip
    """Fill in the angles to try: of each free range the ends and drawn ones, and that to a point."""
    n, n_drawn = 0, 0
    aim = np.arctan2(ahead[1] - place[1], ahead[0] - place[0]) - heading
    aim = (aim + np.pi) % (2.0 * np.pi) - np.pi
    for low, high in free_directions(place, heading, most, walls):
        inset = min(INSET, (high - low) / 3.0)
        low, high = low + inset, high - inset
        if low <= aim <= high and n < MOST:
            angles[n] = aim
            n += 1
        strata = int(np.ceil((high - low) / STRATUM))
        for k in range(strata + 2):
            if n < MOST and n_drawn < MOST:
                share = (k + draws[n_drawn]) / strata if k < strata else float(k - strata)
                angles[n] = low + share * (high - low)
                n += 1
                n_drawn += 1
    return n


@njit(cache=True)
def _keeps_off_itself(chains: Chains, joint: int, place: FloatArray, off: float) -> bool:
    """Tell whether a link from a joint to a place keeps off the chain that ends at that joint."""
    after = chains.parents[joint]
    while chains.parents[after] >= 0:
        before = chains.parents[after]
        if not keeps_off(chains.places[before], chains.places[after], chains.places[joint], place, off):
            return False
        after = before
    return True


@njit(cache=True)
def grow(
    chains: Chains, joints: IntArray, scene: FedScene, most_bent: float, guide: Guide, progress: float,
    draws: FloatArray,
) -> Grown:  # fmt: skip
    """Grow chains by a link each, in all ways that are tried.

    Parameters
    ----------
    chains : Chains
        What has been grown.
    joints : array, shape (n,)
        Those from which to go on.
    scene : FedScene
        Walls.
    most_bent : float
        Largest joint angle, in rad.
    guide : Guide
        The way to go.
    progress : float
        How much nearer to the goal a link must lead, by the guide.
    draws : array, shape (n, MOST)
        Random numbers in [0, 1).

    Returns
    -------
    grown : tuple
        The fields of `Chains` of the new joints alone; parents are numbers in `chains`. Python's code would
        make a named tuple, Ctrl-C may arrive there, and numba crashes then.
    """
    size = joints.shape[0] * MOST
    places, headings, angles = np.empty((size, 2)), np.empty(size), np.empty(size)
    parents, guides = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    to_go, bent = np.empty(size), np.empty(size)
    tried, tip, n = np.empty(MOST), np.empty(2), 0
    for row in range(joints.shape[0]):
        joint = joints[row]
        place, heading, most = chains.places[joint], chains.headings[joint], most_bent
        if chains.parents[joint] == 0:  # it is just out of the feeder
            way = np.hypot(place[0] - scene.base_pose[0], place[1] - scene.base_pose[1])
            most = min(most, scene.release * way)
        reach = np.array([[place[0] - REACH, place[1] - REACH], [place[0] + REACH, place[1] + REACH]])
        near = _walls_about(reach, scene.walls)
        first, last = _window(chains.guides[joint], guide)
        about = _walls_about(np.concatenate((reach, guide.points[first : last + 1])), scene.walls)
        ahead = guide.points[chains.guides[joint]]  # the goal, once it is seen
        for k in range(_directions(place, heading, most, ahead, near, draws[row], tried)):
            tip[0] = place[0] + np.cos(heading + tried[k])
            tip[1] = place[1] + np.sin(heading + tried[k])
            if not link_is_free(place, tip, near, 2.0 * scene.margin):
                continue
            seen = farthest_seen(tip, chains.guides[joint], guide, about)
            if seen < 0:
                continue
            rest = guide.spacing * (guide.points.shape[0] - 1 - seen)
            rest += np.hypot(tip[0] - guide.points[seen, 0], tip[1] - guide.points[seen, 1])
            if rest > chains.to_go[joint] - progress:
                continue
            if not _keeps_off_itself(chains, joint, tip, scene.apart + 4.0 * scene.margin):
                continue
            places[n, 0], places[n, 1] = tip[0], tip[1]
            headings[n], angles[n], parents[n] = heading + tried[k], tried[k], joint
            guides[n], to_go[n], bent[n] = seen, rest, chains.bent[joint] + tried[k] ** 2
            n += 1
    return places[:n], headings[:n], angles[:n], parents[:n], guides[:n], to_go[:n], bent[:n]
