"""The outer wall: every joint keeps to the outer wall of the bends, to compare with.

The paper's introduction divides planners into Jacobian based, curve based, geometric and path tracking
ones; this is a path tracking one that knows about walls. It is what remains of the paper's section 3.3, the
"closest edge side" in a bend, when the two choices that section makes for every link, tangent or edge and
left or right, are made once, for a fixed curve: the path, shifted along its beams to the outer side of the
bends, and across the corridor between bends of opposite sides. All joints run on that curve. A link that
slides with both ends along the outer walls of a bend has all the room that there is, so one U-turn takes it
nearly to the longest possible link.

It does not look at the arm: where opposite bends follow each other so closely that a link is in both, no
curve that keeps to the outer walls is right for it, and walls are met. How near to the walls, and how much
of the way between bends is used for crossing over, is tried; nothing is shaped.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from scipy.ndimage import minimum_filter1d

from planners.baselines.path_following import STOP, followed_track
from planners.baselines.trials import Trial, best_of, fed_along
from planners.kernels.types import FloatArray
from planners.problem import Candidate
from planners.query import Query
from planners.survey import Geometry

__all__ = ["outer_line", "plan_outer_wall"]

SHARES = (0.997, 0.98, 0.9, 0.7, 0.4)
"""How far out the curve runs, in beam lengths; all are tried."""

HELD = (0.3, 0.38, 0.45, 0.15)
"""How much of the way between two bends the curve still keeps to the wall, at each end."""

LONGEST_BEAMS = (1.5, 0.75)
"""Beams are cut to this many passage widths, in a square bend not at all: at a junction they reach down
another corridor."""

CALM = 0.25
"""Cut beams are also no longer than any this near along the path, in passage widths."""


def plan_outer_wall(query: Query) -> Candidate:
    """Plan by keeping all joints at the outer walls of the bends.

    Parameters
    ----------
    query : Query
        Maze, arm, deadline and checker; neither joint limits nor a warm start are used.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, or the reason why there is none: a joint would jump. Where no
        motion is valid, the one that gets least deep into walls.
    """
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    return best_of(query, geometry, _trials(query, geometry))


def _trials(query: Query, geometry: Geometry) -> Iterator[Trial]:
    """Feed the arm along one outer line after the other."""
    maze, length = geometry.maze, float(query.arm.link_length)
    variants = list(product(LONGEST_BEAMS, SHARES, HELD))
    for number, (longest, share, held) in enumerate(variants):
        query.tell("plan", number / len(variants))
        line = outer_line(geometry, length, share, held, longest)
        track = followed_track(line, length, maze.base_pose, maze.goal, STOP * maze.goal_radius)
        yield fed_along(track, length, maze.base_pose, query.deadline)


def outer_line(
    geometry: Geometry, link_length: float, share: float, held: float, longest: float
) -> FloatArray:
    """Shift the path to the outer side of its bends.

    Parameters
    ----------
    geometry : Geometry
        Path, beams and corners.
    link_length : float
        In maze units: so far the feeder's axis reaches, from whose end the first bend is approached.
    share : float
        How far out, in beam lengths, from 0 to 1.
    held : float
        How much of the way between two bends it keeps to the wall at each end, from 0 to 0.5; in between it
        crosses over evenly. Likewise in front of the first bend and behind the last one, where it is the path
        at the end of the axis and at the goal.
    longest : float
        Beams are cut to this many passage widths.

    Returns
    -------
    line : array, shape (n, 2)
        One point for each path point.
    """
    path, beams = geometry.path, geometry.beams
    side = _side(geometry, link_length, held)
    left, right = (_calm(lengths, geometry, longest) for lengths in (beams.left_lengths, beams.right_lengths))
    aside = share * side * np.where(side > 0.0, left, right)
    return np.asarray(path.points + aside[:, None] * beams.normals)


def _side(geometry: Geometry, link_length: float, held: float) -> FloatArray:
    """Return the side on which the line runs at each path point: from -1, right, over 0 to 1, left."""
    s = geometry.path.s
    places, sides = [min(link_length, 0.5 * s[-1])], [0.0]
    for corner in sorted([*geometry.corners, *geometry.semi_critical], key=lambda corner: corner.first):
        first, last = float(s[corner.first]), float(s[corner.last])
        if last > places[-1]:
            places += [max(first, places[-1]), last]
            sides += [-float(corner.turn)] * 2
    places.append(float(s[-1]))
    sides.append(0.0)
    knots, values = [0.0], [0.0]
    for k in range(len(places) - 1):
        gap = held * (places[k + 1] - places[k])
        knots += [places[k] + gap, places[k + 1] - gap]
        values += [sides[k], sides[k + 1]]
    return np.interp(s, [*knots, s[-1]], [*values, 0.0])


def _calm(lengths: FloatArray, geometry: Geometry, longest: float) -> FloatArray:
    """Cut beam lengths, and if they are cut to less than a square bend's, even them out."""
    path = geometry.path
    cut = np.minimum(lengths, longest * path.width)
    if longest == max(LONGEST_BEAMS):
        return np.asarray(cut)
    return np.asarray(minimum_filter1d(cut, 2 * round(CALM * path.width / path.s[1]) + 1))
