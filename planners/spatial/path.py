"""The global path of a point robot in space: steepest descent of the potential, and windowing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planners.kernels.spatial_field import ascend_in_space
from planners.kernels.types import FloatArray
from planners.path import CURVATURE_SPAN, arclength, resampled, tangents, windowed
from planners.spatial.potential import Potential
from planners.spatial.workspace import Workspace

__all__ = ["Path", "descend", "global_path"]

STEP = 0.1
"""Length of a step of the descent, and spacing of the path's points, in cells."""

STOP = 0.5
"""Distance from the goal's node at which the descent jumps to it, in cells."""

WINDOW, PASSES = 15, 3
"""Points on each side in the moving average, and how often it is taken. With wider windows the path comes
near corners, and links that follow it have to be shorter."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Path:
    """Hold the smoothed path from base to goal.

    Parameters
    ----------
    points : array, shape (n, 3)
        In workspace units, base first, evenly spaced.
    raw : array, shape (m, 3)
        The streamline before windowing.
    s : array, shape (n,)
        Arclength from the base.
    tangents : array, shape (n, 3)
        Unit vectors along the chord between the neighbours of each point.
    curvature : array, shape (n,)
        In rad per workspace unit; not negative, as a curve in space has no left.
    """

    points: FloatArray
    raw: FloatArray
    s: FloatArray
    tangents: FloatArray
    curvature: FloatArray

    @property
    def length(self) -> float:
        """Arclength from base to goal, in workspace units."""
        return float(self.s[-1])


def descend(workspace: Workspace, potential: Potential) -> FloatArray | None:
    """Follow the steepest descent of phi from the end of the straight stretch to the goal.

    Parameters
    ----------
    workspace : Workspace
        The workspace.
    potential : Potential
        Its potential.

    Returns
    -------
    points : array, shape (n, 3), or None
        In workspace units: the base, then the end of the straight stretch, then points a tenth of a cell
        apart, then the goal. None if the potential does not lead there.
    """
    start = workspace.base + workspace.straight * workspace.heading
    goal = potential.goal_node
    line = ascend_in_space(
        potential.log_u,
        (start - potential.origin) / potential.cell,
        (goal - potential.origin) / potential.cell,
        STEP,
        STOP,
    )
    if not len(line):
        return None
    line = potential.origin + potential.cell * line
    ends = np.array([goal, workspace.goal])
    apart = np.array([np.linalg.norm(line[-1] - goal), np.linalg.norm(goal - workspace.goal)])
    ends = ends[apart > 1e-9 * potential.cell]
    return np.concatenate([workspace.base[None], start[None], line[1:], ends])


def global_path(
    workspace: Workspace, potential: Potential, window: int = WINDOW, passes: int = PASSES
) -> Path | None:
    """Compute the smoothed global path.

    The straight stretch past the base stays as it is; behind it, windows shrink towards both ends.

    Parameters
    ----------
    workspace : Workspace
        The workspace.
    potential : Potential
        Its potential.
    window : int
        Points on each side in the moving average; they are a tenth of the potential's cell apart.
    passes : int
        How often it is taken.

    Returns
    -------
    path : Path or None
        None if the potential does not lead to the goal.
    """
    raw = descend(workspace, potential)
    if raw is None:
        return None
    spacing = STEP * potential.cell
    line = resampled(raw[1:], spacing)
    for _ in range(passes):
        line = windowed(line, window)
    points = resampled(np.concatenate([raw[:1], line]), spacing)
    s, along = arclength(points), tangents(points)
    return Path(points=points, raw=raw, s=s, tangents=along, curvature=_curvature(along, s))


def _curvature(along: FloatArray, s: FloatArray) -> FloatArray:
    """Compute the turn between tangents a few points before and after each, per length."""
    index = np.arange(len(s))
    before = np.maximum(index - CURVATURE_SPAN, 0)
    after = np.minimum(index + CURVATURE_SPAN, len(s) - 1)
    # Half the difference of unit vectors is the sine of half their angle, which is exact for small ones.
    half = 0.5 * np.linalg.norm(along[after] - along[before], axis=1)
    turn = 2.0 * np.arcsin(np.minimum(half, 1.0))
    return np.asarray(turn / (s[after] - s[before]))
