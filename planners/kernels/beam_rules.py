"""The rules of the beam planner: one function per subsection of section 3 of the paper.

Each answers its question for one link, which starts at p. Path points and beams share their indices.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.beam_types import (
    GUIDE_JUMPED,
    GUIDE_TANGENT,
    LEFT,
    NOTHING,
    POINTS,
    RIGHT,
    TANGENT,
    Records,
    Terms,
    Way,
)
from planners.kernels.rod import WHOLE_TURN, free_directions, nearest_gap
from planners.kernels.types import FloatArray

TWO_PI = 2.0 * np.pi

FLAT = 1e-4
"""Sine below which two vectors count as parallel: straight legs have no tangent points, only rounding."""


@njit(cache=True)
def tangent_point(way: Way, px: float, py: float, index: int, length: float) -> int:
    """Find the path point at which a link from p is tangent to the path (section 3.1), or -1.

    From the path point next to the one closest to p, at `index`, the vectors F from p to consecutive path
    points are multiplied; the tangent point is where the product changes sign. Only points within the link's
    reach and inside a corner count, and there the change that belongs to its turn; so products are looked at
    from just before the next corner on.
    """
    points, corner = way.lines[POINTS], way.beams[index].next_corner
    if corner < 0:
        return -1
    previous = 0.0
    for i in range(max(index + 1, way.corners[corner].first - 2), points.shape[0] - 1):
        ax, ay = points[i, 0] - px, points[i, 1] - py
        bx, by = points[i + 1, 0] - px, points[i + 1, 1] - py
        b_squared = bx * bx + by * by
        if b_squared > length * length:
            return -1
        product = ax * by - ay * bx
        if product * product < FLAT * FLAT * (ax * ax + ay * ay) * b_squared:
            continue
        at = way.beams[i].corner
        if previous * product < 0.0 and at >= 0 and product * way.corners[at].turn > 0.0:
            return i
        previous = product
    return -1


@njit(cache=True)
def closest_path_point(
    way: Way, px: float, py: float, heading: float, length: float, first: int, reach: int, near_end: float
) -> int:
    """Find the path point to which the end of a link is closest, through the beams (section 3.2), or -1.

    The link crosses beams. From `first` on, the path point of the tangent point or of the link's start, the
    distance from the crossing to the link's end is looked at; the first one under `near_end` ends the search,
    at most `reach` path points on. So it stays local: the other leg of a U-turn may be nearer than its own.
    """
    c, s = np.cos(heading), np.sin(heading)
    points = way.lines[POINTS]
    for i in range(first, min(points.shape[0], first + reach)):
        along_x, along_y = way.beams[i].along_x, way.beams[i].along_y
        slope = c * along_x + s * along_y
        x, y = points[i, 0] - px, points[i, 1] - py
        beyond = abs(slope) * length - np.sign(slope) * (x * along_x + y * along_y)
        if beyond < 0.0 or beyond > abs(slope) * near_end or slope == 0.0:
            continue
        crossing = (x * along_x + y * along_y) / slope
        aside = (crossing * s - y) * along_x - (crossing * c - x) * along_y
        end = way.lines[LEFT if aside > 0.0 else RIGHT, i]
        if abs(aside) <= np.hypot(end[0] - points[i, 0], end[1] - points[i, 1]) + near_end:
            return i
    return -1


@njit(cache=True)
def nearest_index(points: FloatArray, px: float, py: float, around: int, reach: int) -> int:
    """Find the path point closest to p among those at most `reach` indices away from `around`.

    For ends that no beam passes: beside the first and the last path point, and where beams fan out.
    """
    best, best_squared = around, np.inf
    for i in range(max(0, around - reach), min(points.shape[0], around + reach + 1)):
        squared = (points[i, 0] - px) ** 2 + (points[i, 1] - py) ** 2
        if squared < best_squared:
            best, best_squared = i, squared
    return best


@njit(cache=True)
def coordinate_at_length(
    line: FloatArray, px: float, py: float, index: int, length: float
) -> tuple[int, float]:
    """Find the first place on a line, from an index on, at distance `length` from p (sections 3.3, 3.4).

    The paper takes the first point at or beyond the distance. Between two points we interpolate: from
    point to point the direction jumps, and the links poke the walls.

    Returns
    -------
    i : int
        The first point at or beyond the distance, or -1 if there is none.
    direction : float
        From p to the place.
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
        return i, np.arctan2(by, bx)
    return -1, 0.0


@njit(cache=True)
def edge_side(way: Way, corner: int, px: float, py: float, index: int, length: float) -> tuple[int, float]:
    """Find the closest edge side coordinate (3.3): on the left of a right corner, and conversely (3.5).

    Returns the beam and the direction, as `coordinate_at_length` does of the beams' ends.
    """
    side = LEFT if way.corners[corner].turn < 0 else RIGHT
    return coordinate_at_length(way.lines[side], px, py, index, length)


@njit(cache=True)
def path_point(way: Way, px: float, py: float, index: int, length: float) -> tuple[int, float]:
    """Find the closest path point coordinate (section 3.4), or the goal if that is nearer than a link.

    Returns the path point and the direction, as `coordinate_at_length` does of the path.
    """
    points = way.lines[POINTS]
    target, direction = coordinate_at_length(points, px, py, index, length)
    if target >= 0:
        return target, direction
    last = points.shape[0] - 1
    return last, np.arctan2(points[last, 1] - py, points[last, 0] - px)


@njit(cache=True)
def is_near_semi_critical(way: Way, index: int, end: int) -> bool:
    """Tell whether a semi-critical corner lies between two path points, beside a link (section 3.4)."""
    corner = way.beams[index].next_corner
    while 0 <= corner < way.corners.shape[0] and way.corners[corner].first <= end:
        if not way.corners[corner].critical:
            return True
        corner += 1
    return False


@njit(cache=True)
def blocking(links: Records, k: int, corner: int, terms: Terms) -> int:
    """Tell what keeps a link from a tangent point at a corner: its guide link (section 3.6), or nothing.

    The guide link is the next one towards the tip, in its state of the last pose. It blocks while it is
    tangent to the path, and at the corner where it has jumped, until it finds a tangent point there.
    """
    if k > 0:
        guide = links[k - 1]
        if terms.tangent_blocks and guide.choice == TANGENT:
            return GUIDE_TANGENT
        if terms.jump_blocks and guide.jumped == corner:
            return GUIDE_JUMPED
    return NOTHING


@njit(cache=True)
def soften(direction: float, wanted: float, pieces: float, share: float) -> tuple[float, float]:
    """Make a piece of a jump (section 3.7).

    A jump starts with as many pieces as the softening degree. Each regular pose makes one; a pose that is fed
    by a `share` of the regular one, that share. The goal of the jump may move meanwhile.

    Returns
    -------
    direction, pieces : float
        The new direction, and how many pieces are left.
    """
    if pieces <= share:
        return wanted, 0.0
    return direction + turn_between(direction, wanted) * share / pieces, pieces - share


@njit(cache=True)
def turn_between(a: float, b: float) -> float:
    """Return the turn from one direction to another, in [-pi, pi)."""
    return (b - a + np.pi) % TWO_PI - np.pi


@njit(cache=True)
def clamp_to_free(
    wanted: float,
    direction: float,
    largest: float,
    px: float,
    py: float,
    length: float,
    walls: FloatArray,
    pad: float,
    blocked: FloatArray,
    gaps: FloatArray,
) -> tuple[bool, float]:
    """Clamp the wanted direction into the free interval of the link, and its turn to `largest`.

    Not in the paper: it is what the exact check shows to be needed for a penetration of 0. The interval is
    the one nearest to the present direction. Where a wall has held a link and lets it go, the turn is no jump
    from one choice to another, which 3.7 softens, and would be sudden; hence `largest`.
    """
    change = turn_between(direction, wanted)
    wanted = direction + min(max(change, -largest), largest)
    n_gaps = free_directions(px, py, length, walls, pad, blocked, gaps)
    if n_gaps == 0:
        return False, direction
    start, end = nearest_gap(direction, gaps, n_gaps)
    if end - start >= WHOLE_TURN:  # nothing is in the way, and the ends of the interval mean nothing
        return True, wanted
    return True, min(max(wanted, start), end)
