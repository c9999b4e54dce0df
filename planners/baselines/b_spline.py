"""B-splines: the links stay nearly tangent to a B-spline curve along the path, to compare with.

A curve based method in the sense of the paper's introduction: reference 11, by the paper's authors, of
which it says that "the path could be approximated by B-spline curves" and that the algorithm "keeps the
links of the hyper-redundant manipulator approximately tangent to these curves, thereby follows the path
successfully". What is here is built from these two sentences alone.

A link is tangent to a bend if its joints lie outside it. So all joints run on a track beside the curve: it
is shifted outward by how far a chord of the curve, a link long, has its middle inside it. That makes links
tangent where the curvature hardly changes within a link, and it is why they are so approximately only. How
smooth the curve is, and how much of the shift is made (all: tangent; none: link ends on the curve), is
tried. Nothing is done about the walls.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from scipy.interpolate import splev, splprep

from planners.baselines.path_following import STOP, followed_track
from planners.baselines.trials import Trial, best_of, fed_along
from planners.kernels.types import FloatArray
from planners.path import Path, arclength
from planners.problem import Candidate
from planners.query import Query
from planners.survey import Geometry

__all__ = ["b_spline", "beside", "plan_b_spline"]

DEVIATIONS = (0.005, 0.02, 0.05, 0.1)
"""Mean deviation of the curve from the path, in passage widths; all are tried."""

SHIFTS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""How much of the shift is made that brings links from chords of the curve to tangents; all are tried."""


def plan_b_spline(query: Query) -> Candidate:
    """Plan by keeping all links nearly tangent to a B-spline curve.

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
    """Feed the arm along one curve after the other."""
    maze, length = geometry.maze, float(query.arm.link_length)
    curves: dict[float, FloatArray] = {}
    variants = list(product(SHIFTS, DEVIATIONS))
    for number, (shift, deviation) in enumerate(variants):
        query.tell("plan", number / len(variants))
        if deviation not in curves:
            curves[deviation] = b_spline(geometry.path, deviation)
        line = beside(curves[deviation], length, shift)
        track = followed_track(line, length, maze.base_pose, maze.goal, STOP * maze.goal_radius)
        yield fed_along(track, length, maze.base_pose, query.deadline)


def b_spline(path: Path, deviation: float) -> FloatArray:
    """Approximate a path by a cubic B-spline, with as few knots as its deviation allows.

    Parameters
    ----------
    path : Path
        The path.
    deviation : float
        Root of the mean squared distance of path points from the curve, at most, in passage widths.

    Returns
    -------
    points : array, shape (n, 2)
        On the curve, one for each path point; the first and the last point are the path's.
    """
    # The ends weigh so much that they stay where they are.
    weights = np.ones(len(path.s))
    weights[[0, -1]] = len(path.s)
    limit = len(path.s) * (deviation * path.width) ** 2
    degree = min(3, len(path.s) - 1)
    spline, places = splprep(path.points.T, w=weights, u=path.s, k=degree, s=limit)
    points = np.column_stack(splev(places, spline))
    points[[0, -1]] = path.points[[0, -1]]
    return points


def beside(curve: FloatArray, link_length: float, shift: float) -> FloatArray:
    """Shift a curve to where the joints of links tangent to it are.

    Parameters
    ----------
    curve : array, shape (n, 2)
        In maze units.
    link_length : float
        In maze units.
    shift : float
        1 for tangents; 0 leaves the curve as it is, so that links are its chords.

    Returns
    -------
    line : array, shape (n, 2)
        The curve where it is straight; outside its bends.
    """
    s = arclength(curve)
    half = np.minimum(0.5 * link_length, np.minimum(s, s[-1] - s))
    middles = [
        0.5 * (np.interp(s - half, s, curve[:, k]) + np.interp(s + half, s, curve[:, k])) for k in range(2)
    ]
    return np.asarray(curve + shift * (curve - np.column_stack(middles)))
