"""Critical corners (sections 2 and 3.5 of the paper): where the path bends close to a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planners.beams import Beams
from planners.path import Path

__all__ = ["Corner", "critical_corners"]

MIN_CURVATURE = 0.8
"""Smallest curvature of a critical corner, times the passage width."""

MAX_INNER_BEAM = 0.6
"""Longest beam towards the inner wall at a critical corner, in passage widths."""

MERGE_GAP = 0.3
"""Runs of the same turn that are closer than this, in passage widths, are one corner: a U-turn round a thin
wall has two wall corners and is one manoeuvre."""


@dataclass(frozen=True, kw_only=True)
class Corner:
    """Hold one critical corner: a run of path points.

    Parameters
    ----------
    first, last : int
        Index of the first and the last path point of the run.
    turn : int
        +1 for a left corner, -1 for a right corner (section 3.5).
    place : tuple of two floats
        End of the shortest inner beam of the run: the wall's corner, in maze units.
    """

    first: int
    last: int
    turn: int
    place: tuple[float, float]

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
    turns = np.sign(path.curvature).astype(int)
    inner = np.where(turns > 0, beams.left_lengths, beams.right_lengths)
    sharp = np.abs(path.curvature) * path.width > min_curvature
    critical = np.where(sharp & (inner < max_inner_beam * path.width), turns, 0)
    runs: list[tuple[int, int, int]] = []
    for index in np.flatnonzero(critical):
        turn = int(critical[index])
        if runs and runs[-1][2] == turn and path.s[index] - path.s[runs[-1][1]] < MERGE_GAP * path.width:
            runs[-1] = (runs[-1][0], int(index), turn)
        else:
            runs.append((int(index), int(index), turn))
    return [_corner(beams, inner, run) for run in runs if run[1] > run[0]]


def _corner(beams: Beams, inner: np.ndarray, run: tuple[int, int, int]) -> Corner:
    first, last, turn = run
    nearest = first + int(np.argmin(inner[first : last + 1]))
    x, y = beams.ends(turn)[nearest]
    return Corner(first=first, last=last, turn=turn, place=(float(x), float(y)))
