"""Corners (sections 2 and 3.5 of the paper): where the path bends close to a wall, sharply or slightly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planners.beams import Beams
from planners.kernels.types import FloatArray
from planners.path import Path

__all__ = ["Corner", "critical_corners", "semi_critical_corners", "turn_of"]

MIN_CURVATURE = 0.8
"""Smallest curvature of a critical corner, times the passage width."""

MAX_INNER_BEAM = 0.6
"""Longest beam towards the inner wall at a critical corner, in passage widths."""

SEMI_MIN_CURVATURE, SEMI_MAX_INNER_BEAM = 0.4, 1.0
"""The same of a semi-critical corner: a slighter bend, a longer beam."""

MERGE_GAP = 0.3
"""Runs of the same turn that are closer than this, in passage widths, are one corner: a U-turn round a thin
wall has two wall corners and is one manoeuvre."""


@dataclass(frozen=True, kw_only=True)
class Corner:
    """Hold one corner: a run of path points.

    Parameters
    ----------
    first, last : int
        Index of the first and the last path point of the run.
    turn : int
        +1 for a left corner, -1 for a right corner (section 3.5).
    place : tuple of two floats
        End of the shortest inner beam of the run: the wall's corner, in maze units.
    critical : bool
        Otherwise it is semi-critical.
    """

    first: int
    last: int
    turn: int
    place: tuple[float, float]
    critical: bool = True

    @property
    def name(self) -> str:
        """The paper's name: `left` or `right`."""
        return "left" if self.turn > 0 else "right"


def critical_corners(
    path: Path, beams: Beams, min_curvature: float = MIN_CURVATURE, max_inner_beam: float = MAX_INNER_BEAM
) -> list[Corner]:
    """Find the critical corners: high curvature and a short beam on the inner side.

    Parameters
    ----------
    path : Path
        The path.
    beams : Beams
        Its beams.
    min_curvature : float
        Times the passage width.
    max_inner_beam : float
        In passage widths.

    Returns
    -------
    corners : list of Corner
        In the order of the path.
    """
    return [
        _corner(path, beams, run, critical=True) for run in _runs(path, beams, min_curvature, max_inner_beam)
    ]


def semi_critical_corners(path: Path, beams: Beams, critical: list[Corner]) -> list[Corner]:
    """Find the semi-critical corners (Fig. 4): slighter bends, and farther from the wall.

    Parameters
    ----------
    path : Path
        The path.
    beams : Beams
        Its beams.
    critical : list of Corner
        The critical ones; the slight bends at their flanks belong to them.

    Returns
    -------
    corners : list of Corner
        In the order of the path.
    """
    return [
        _corner(path, beams, (first, last), critical=False)
        for first, last in _runs(path, beams, SEMI_MIN_CURVATURE, SEMI_MAX_INNER_BEAM)
        if not any(first <= corner.last and corner.first <= last for corner in critical)
    ]


def turn_of(points: FloatArray) -> int:
    """Identify a corner (section 3.5, Fig. 11): +1 for a left one, -1 for a right one.

    Two vectors lead from the first of its path points, shape (n, 2), to the middle one and on to the last.
    Where y points up, as here, their product is positive in a left corner; where it points down, as on the
    paper's screen, in a right one.
    """
    middle = points[len(points) // 2]
    (ax, ay), (bx, by) = middle - points[0], points[-1] - middle
    return 1 if ax * by - ay * bx > 0.0 else -1


def _runs(path: Path, beams: Beams, min_curvature: float, max_inner_beam: float) -> list[tuple[int, int]]:
    """Return first and last index of each run of points that bend to one side, close to the wall there."""
    turns = np.sign(path.curvature).astype(int)
    sharp = np.abs(path.curvature) * path.width > min_curvature
    close = _inner(path, beams) < max_inner_beam * path.width
    runs: list[tuple[int, int]] = []
    for index in np.flatnonzero(sharp & close):
        same = bool(runs) and turns[runs[-1][1]] == turns[index]
        if same and path.s[index] - path.s[runs[-1][1]] < MERGE_GAP * path.width:
            runs[-1] = (runs[-1][0], int(index))
        else:
            runs.append((int(index), int(index)))
    return [run for run in runs if run[1] > run[0]]


def _inner(path: Path, beams: Beams) -> FloatArray:
    """Return the length of the beam on the inner side of the bend at each point."""
    return np.where(path.curvature > 0.0, beams.left_lengths, beams.right_lengths)


def _corner(path: Path, beams: Beams, run: tuple[int, int], *, critical: bool) -> Corner:
    first, last = run
    turn = turn_of(path.points[max(first - 1, 0) : last + 2])
    nearest = first + int(np.argmin(_inner(path, beams)[first : last + 1]))
    x, y = beams.ends(turn)[nearest]
    return Corner(first=first, last=last, turn=turn, place=(float(x), float(y)), critical=critical)
