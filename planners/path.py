"""The global path of a point robot (section 2 of the paper): descent, windowing, arclength and curvature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrsnake_env.maze import Maze
from planners.kernels.grid import ascend
from planners.kernels.types import FloatArray
from planners.potential import Potential

__all__ = ["Path", "arclength", "curvature", "descend", "global_path", "path_along", "resampled", "windowed"]

POINTS_PER_WIDTH = 25.0
"""Path points per passage width."""

WINDOW = 6
"""Points on each side in the moving average: a quarter of a passage width. Above half a width the average
cuts corners; above one it leaves the free space at thin walls."""

CURVATURE_SPAN = 4
"""Points on each side between whose tangents curvature is measured: 0.16 passage widths."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Path:
    """Hold the smoothed path from base to goal.

    Parameters
    ----------
    points : array, shape (n, 2)
        In maze units, base first.
    raw : array, shape (m, 2)
        The streamline before windowing.
    s : array, shape (n,)
        Arclength from the base.
    tangents : array, shape (n, 2)
        Unit vectors along the chord between the neighbours of each point.
    curvature : array, shape (n,)
        In rad per maze unit, positive to the left.
    width : float
        The passage width with which the path was scaled, in maze units.
    """

    points: FloatArray
    raw: FloatArray
    s: FloatArray
    tangents: FloatArray
    curvature: FloatArray
    width: float

    @property
    def length(self) -> float:
        """Arclength from base to goal, in maze units."""
        return float(self.s[-1])


def descend(maze: Maze, potential: Potential) -> FloatArray | None:
    """Follow the direction of the largest descent of phi from base to goal, Eq. (3).

    Parameters
    ----------
    maze : Maze
        The maze.
    potential : Potential
        Its potential.

    Returns
    -------
    points : array, shape (n, 2), or None
        In maze units, a quarter of a cell apart. None if the potential does not lead to the goal: the grid
        does not resolve a passage, or u is below the smallest number (some 200 passage widths from the goal).
    """
    start = (maze.base_pose[:2] - potential.origin) / potential.cell
    goal = (maze.goal - potential.origin) / potential.cell
    step = 0.25
    work = np.empty((int(4.0 * np.count_nonzero(potential.u) / step) + 100, 2))
    n = ascend(potential.u, potential.blocked_x, potential.blocked_y, start, goal, step, 1.5, work)
    return None if n == 0 else potential.origin + potential.cell * work[:n]


def arclength(points: FloatArray) -> FloatArray:
    """Compute the arclength at each point of a polyline, shape (n, dimension) -> (n,), from 0."""
    return np.concatenate([[0.0], np.cumsum(np.hypot.reduce(np.diff(points, axis=0), axis=1))])


def resampled(points: FloatArray, spacing: float) -> FloatArray:
    """Place points evenly on a polyline, at most `spacing` apart; both ends stay."""
    s = arclength(points)
    places = np.linspace(0.0, s[-1], max(int(np.ceil(s[-1] / spacing)), 2) + 1)
    return np.column_stack([np.interp(places, s, column) for column in points.T])


def windowed(points: FloatArray, window: int) -> FloatArray:
    """Average each point with `window` points on each side (Fig. 1); at the ends with as many as there are.

    Parameters
    ----------
    points : array, shape (n, dimension)
        In any units.
    window : int
        At least 0.

    Returns
    -------
    smooth : array, shape (n, dimension)
        The first and the last point stay where they are.
    """
    index = np.arange(len(points))
    half = np.minimum(np.minimum(index, index[::-1]), window)
    sums = np.concatenate([np.zeros((1, points.shape[1])), np.cumsum(points, axis=0)])
    return np.asarray((sums[index + half + 1] - sums[index - half]) / (2 * half + 1)[:, None])


def tangents(points: FloatArray) -> FloatArray:
    """Compute unit tangents, shape (n, dimension), from the chord between the neighbours of each point."""
    chords = np.gradient(points, axis=0)
    return np.asarray(chords / np.hypot.reduce(chords, axis=1)[:, None])


def curvature(points: FloatArray, span: int = CURVATURE_SPAN) -> FloatArray:
    """Compute the curvature at each point: the turn between the tangents `span` points before and after.

    Parameters
    ----------
    points : array, shape (n, 2)
        In maze units.
    span : int
        At least 1; shorter at the ends.

    Returns
    -------
    curvature : array, shape (n,)
        In rad per maze unit, positive to the left.
    """
    along, s = tangents(points), arclength(points)
    index = np.arange(len(points))
    before, after = np.maximum(index - span, 0), np.minimum(index + span, len(points) - 1)
    a, b = along[before], along[after]
    turn = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
    return np.asarray(turn / (s[after] - s[before]))


def global_path(maze: Maze, potential: Potential, width: float, window: int = WINDOW) -> Path | None:
    """Compute the smoothed global path.

    Parameters
    ----------
    maze : Maze
        The maze.
    potential : Potential
        Its potential.
    width : float
        The passage width, which sets the spacing of the points.
    window : int
        Points on each side in the moving average.

    Returns
    -------
    path : Path or None
        None if the potential does not lead to the goal.
    """
    streamline = descend(maze, potential)
    return None if streamline is None else path_along(streamline, width, window)


def path_along(line: FloatArray, width: float, window: int = WINDOW) -> Path:
    """Resample and smooth a line, shape (n, 2), into a path scaled with the passage width.

    Parameters
    ----------
    line : array, shape (n, 2)
        From base to goal, in maze units.
    width : float
        The passage width, which sets the spacing of the points.
    window : int
        Points on each side in the moving average.
    """
    raw = resampled(line, width / POINTS_PER_WIDTH)
    points = windowed(raw, window)
    return Path(
        points=points,
        raw=raw,
        s=arclength(points),
        tangents=tangents(points),
        curvature=curvature(points),
        width=width,
    )
