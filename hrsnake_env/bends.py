"""Bends of a corridor that are just as tight as wanted, and the corridor's walls; all lengths in links.

What limits a link in a bend is the longest rod that passes it, which is known in closed form: a rod at an
angle to the corridor is longest where it touches the inner corner and the outer walls before and behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray

__all__ = ["Bend", "Corridor", "draw_bends", "longest_rod_of_bend"]

SLIGHT, GENTLE, SHARP = math.radians(35.0), math.radians(60.0), math.radians(125.0)
"""A bend turns by SLIGHT at least; at difficulty 0 by GENTLE, at 1 by SHARP at most."""

U_TURNS, MIXED = 0.3, 0.25
"""How often a bend is the first of a U-turn, at difficulties over `MIXED`."""

WIDTHS, CHANGE = (0.2, 2.0), (0.6, 1.7)
"""Between which a corridor's width may be, and by what factor it may change in a bend."""

GAP = 0.12
"""Least thickness of the walls between legs."""

TRIES = 20
"""How often a bend's angle is drawn for the width that is there."""

PARTS = np.linspace(0.0, 1.0, 183)[1:-1]
"""Headings of a rod in a bend, in parts of the turn: widths are then right to 1e-4."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Bend:
    """Hold a bend to either side.

    Parameters
    ----------
    turn : float
        In rad, positive.
    entry, outlet : float
        Widths of the corridor before and behind it.
    index : float
        Link length over the longest rod that passes; of the U-turn, if it belongs to one.
    wall : float or None
        In the second bend of a U-turn, the thickness of the wall that the arm turns round.
    """

    turn: float
    entry: float
    outlet: float
    index: float
    wall: float | None = None

    @cached_property
    def setbacks(self) -> tuple[float, float]:
        """How far its corners reach into the legs before and behind it, from the centreline's corner."""
        cosine, twice = math.cos(self.turn), 2.0 * math.sin(self.turn)
        return abs(self.outlet - self.entry * cosine) / twice, abs(self.entry - self.outlet * cosine) / twice

    @cached_property
    def rooms(self) -> tuple[float, float]:
        """How far before and behind the inner corner the longest rod touches the outer walls."""
        angles = self.turn * PARTS
        angle = float(angles[np.argmin(_rods(self.entry, self.outlet, self.turn))])
        return max(self.entry / math.tan(angle), 0.0), max(self.outlet / math.tan(self.turn - angle), 0.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Corridor:
    """Hold the walls of a corridor that starts at (0, 0) north.

    Parameters
    ----------
    left, right : array, shape (n_legs + 1, 2)
        Corners of the walls; those with the same number belong to the same bend or end.
    """

    left: FloatArray
    right: FloatArray

    @classmethod
    def from_bends(cls, bends: list[Bend], sides: FloatArray, lengths: FloatArray) -> Corridor:
        """Join legs by bends.

        Parameters
        ----------
        bends : list of Bend
            At least one.
        sides : array, shape (n_bends,)
            1 for a bend to the left, -1 for one to the right.
        lengths : array, shape (n_bends + 1,)
            Of each leg's centreline, from corner to corner.
        """
        turns = sides * [bend.turn for bend in bends]
        widths = np.array([bends[0].entry, *(bend.outlet for bend in bends)])
        headings = math.pi / 2 + np.concatenate([[0.0], np.cumsum(turns)])
        along = np.column_stack([np.cos(headings), np.sin(headings)])
        across = np.column_stack([-along[:, 1], along[:, 0]])
        line = np.concatenate([np.zeros((1, 2)), np.cumsum(lengths[:, None] * along, axis=0)])
        # In the frame of the leg before it a corner of the left wall lies at (ahead, half a width).
        ahead = np.zeros(len(line))
        ahead[1:-1] = (widths[:-1] * np.cos(turns) - widths[1:]) / (2.0 * np.sin(turns))
        legs = np.concatenate([[0], np.arange(len(widths))])
        offset = ahead[:, None] * along[legs] + 0.5 * widths[legs, None] * across[legs]
        return cls(left=line + offset, right=line - offset)

    def beyond(self, points: ArrayLike) -> FloatArray:
        """Return points of the frame at the corridor's end: x along the last leg, y to its left."""
        end, across = 0.5 * (self.left[-1] + self.right[-1]), self.left[-1] - self.right[-1]
        across = across / np.linalg.norm(across)
        xy = np.asarray(points, dtype=np.float64)
        return np.asarray(end + xy[:, :1] * [across[1], -across[0]] + xy[:, 1:] * across)

    def keeps_apart(self, feeder: float, hall: FloatArray | None) -> bool:
        """Tell whether legs that do not follow one another are apart.

        Parameters
        ----------
        feeder : float
            Length of the feeder behind the start, from which they are apart, too.
        hall : array, shape (4, 2), or None
            Corners of a hall behind the last leg, from which the legs before that are apart.
        """
        behind = np.array([[0.0, -feeder]])
        left = np.concatenate([self.left[:1] + behind, self.left])
        right = np.concatenate([self.right[:1] + behind, self.right])
        parts = np.stack([left[:-1], left[1:], right[1:], right[:-1]], axis=1)
        if hall is not None:
            parts = np.concatenate([parts, hall[None]])
        legs = shapely.polygons(parts)
        i, j = np.triu_indices(len(legs), 2)
        return bool((shapely.distance(legs[i], legs[j]) >= GAP).all())


def longest_rod_of_bend(entry: float, outlet: float, turn: float) -> float:
    """Return the longest rod that passes a bend between two long corridors.

    Parameters
    ----------
    entry, outlet : float
        Widths of the corridors.
    turn : float
        By how much the bend turns, in rad, in (0, pi).

    Examples
    --------
    >>> round(longest_rod_of_bend(200.0, 200.0, math.pi / 2), 1)  # 2 x sqrt(2) x 200
    565.7
    """
    return float(_rods(entry, outlet, turn).min())


def _rods(entry: float, outlet: float, turn: float) -> FloatArray:
    angles = turn * PARTS
    return np.asarray(entry / np.sin(angles) + outlet / np.sin(turn - angles))


def draw_bends(rng: np.random.Generator, n_bends: int, index: float, difficulty: float) -> list[Bend]:
    """Draw bends one behind the other, the tightest of which has the given index; none if they do not fit.

    The others are looser: at difficulty 0 by up to a half, at 1 by up to a tenth.
    """
    indices = index * rng.uniform(0.5 + 0.4 * difficulty, 1.0, n_bends)
    indices[rng.integers(max(n_bends - 1, 1))] = index  # not the last: a rod need not leave that one
    sharpest = GENTLE + difficulty * (SHARP - GENTLE)
    bends: list[Bend] = []
    while len(bends) < n_bends:
        entry, k = bends[-1].outlet if bends else None, len(bends)
        if k + 1 < n_bends and difficulty > MIXED and rng.random() < U_TURNS:
            drawn = _draw_u_turn(rng, entry, float(indices[k : k + 2].max()))
        else:
            drawn = _draw_bend(rng, entry, float(indices[k]), sharpest)
        if not drawn:
            return []
        bends += drawn
    return bends


def _draw_bend(rng: np.random.Generator, entry: float | None, index: float, sharpest: float) -> list[Bend]:
    for _ in range(TRIES):
        turn = rng.uniform(SLIGHT, sharpest)
        width = entry or rng.uniform(0.85, 1.2) * math.sin(0.5 * turn) / (2.0 * index)
        bend = Bend(turn=turn, entry=width, outlet=_outlet(width, turn, 1.0 / index), index=index)
        if _fits(width, bend.outlet):
            return [bend]
    return []


def _draw_u_turn(rng: np.random.Generator, entry: float | None, index: float) -> list[Bend]:
    """Draw two bends to the same side of 160 to 180 degrees together, around a thin wall."""
    rod = 1.0 / index
    for _ in range(TRIES):
        first, wall = math.radians(rng.uniform(80.0, 100.0)), rng.uniform(GAP, 3.0 * GAP)
        second = math.radians(rng.uniform(160.0, 180.0)) - first
        width = entry or rng.uniform(0.85, 1.15) * 0.5 * (rod - wall)
        across = _outlet(width, first, rod) * rng.uniform(1.0, 1.3)
        outlet = _outlet_of_u_turn(width, across, first, second, wall, rod)
        if _fits(width, across) and _fits(width, outlet) and _fits(across, outlet):
            return [
                Bend(turn=first, entry=width, outlet=across, index=index),
                Bend(turn=second, entry=across, outlet=outlet, index=index, wall=wall),
            ]
    return []


def _fits(before: float, after: float) -> bool:
    return WIDTHS[0] <= min(before, after) <= max(before, after) <= WIDTHS[1] and (
        CHANGE[0] <= after / before <= CHANGE[1]
    )


def _outlet(entry: float, turn: float, rod: float) -> float:
    """Return the width behind a bend with which no longer rod passes; negative if any width lets it pass."""
    angles = turn * PARTS
    return float(np.max((rod - entry / np.sin(angles)) * np.sin(turn - angles)))


def _outlet_of_u_turn(
    entry: float, across: float, first: float, second: float, wall: float, rod: float
) -> float:
    """Return the same behind a U-turn: a rod touches the wall's near corner first, and then its far one.

    Behind the near corner it may reach the outer wall of the last leg, before the far one that of the first.
    """
    turn = first + second
    near, far = first * PARTS, first + second * PARTS
    before = (rod - entry / np.sin(near)) * np.sin(turn - near) - wall * math.sin(second)
    back = np.minimum(across / np.sin(far - first), (entry + wall * math.sin(first)) / np.sin(far))
    behind = (rod - back) * np.sin(turn - far)
    return float(max(before.max(), behind.max()))
