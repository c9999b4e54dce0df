"""Walls so thin that a link could pass through them without ever being deep in a wall."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPoint, box

from hrsnake_env.arm import FloatArray
from hrsnake_env.maze import Maze

N_LEVELS = 11
"""From the tolerance down to a millionth of it, by four each time."""

SHARE = 1 / 8
"""The largest depth in a wall, as a share of its thickness where the link is."""

TIP = math.radians(100.0)
"""Corners of walls sharper than this are ends of them: there is nothing behind that a link would get to."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ThinWalls:
    """Find which walls are thinner than eight times a depth: there the depth alone says too little.

    Depths are those of a ladder, `tolerance / 4^level`. A wall is thin at a place where no disc of that
    thickness fits into it. Corners are squared first, so that they are not thin; only very sharp ones are.

    Parameters
    ----------
    maze : Maze
        With the walls.
    tolerance : float
        The largest depth, in maze units.
    """

    maze: Maze
    tolerance: float

    def depth(self, level: int) -> float:
        """Return the depth of a level, in maze units."""
        return self.tolerance / 4.0**level

    @cached_property
    def any(self) -> bool:
        """Whether a wall is thin for the tolerance."""
        return not self.lines(0).is_empty

    @cached_property
    def core(self) -> Any:
        """Where a point is surely deeper than the share of the thickness, prepared for predicates."""
        parts = []
        for level in range(N_LEVELS):
            depth, around = self.depth(level), self._around(level)
            parts.append(self._less(self._solid.buffer(-depth), around))
        core = self._less(shapely.union_all(parts), self._tips.buffer(2.0 * self.tolerance))
        shapely.prepare(core)
        return core

    def lines(self, level: int) -> Any:
        """Return the sides of walls that are thin for the depth of a level, less the ends of the walls."""
        if level not in self._lines:
            sides = self._less(self.maze.free_space.boundary, self._around(level))
            lines = self._less(sides, self._tips.buffer(2.0 * self.depth(level)))
            shapely.prepare(lines)
            self._lines[level] = lines
        return self._lines[level]

    def keeps_off(self, geometries: Any, depth: FloatArray) -> NDArray[np.bool_]:
        """Say which hulls of links of a depth, shape (n,), are farther than that from walls too thin for it.

        The depth of any level is as good, if it is not smaller: less is thin for a small one, but more of the
        ends of walls counts.
        """
        off = np.zeros(len(depth), dtype=bool)
        for level in range(N_LEVELS):
            rows = np.flatnonzero(~off & (depth <= self.depth(level)))
            lines = self.lines(level)
            off[rows] = lines.is_empty | ~shapely.dwithin(geometries[rows], lines, self.depth(level))
        return off

    @cached_property
    def _lines(self) -> dict[int, Any]:
        return {}

    @cached_property
    def _solid(self) -> Any:
        """What is not free, with a broad frame around the maze."""
        x_min, y_min, x_max, y_max = self.maze.free_space.bounds
        frame = self.maze.size + 100.0 * self.tolerance
        return box(x_min - frame, y_min - frame, x_max + frame, y_max + frame).difference(
            self.maze.free_space
        )

    @cached_property
    def _tips(self) -> Any:
        """The sharp corners of the walls."""
        tips = []
        for ring in self.maze.rings:
            corner = ring[:-1]
            before, after = np.roll(corner, 1, axis=0) - corner, np.roll(corner, -1, axis=0) - corner
            # The free space is on the left, so the wall is on the right, from the way on to the way back.
            cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            angle = np.arctan2(cross, np.sum(before * after, axis=1))
            tips.append(corner[(angle > -1e-9) & (angle < TIP)])
        return MultiPoint(np.concatenate(tips))

    def _around(self, level: int) -> Any:
        """Return the walls that are thick for a level, with a little margin for what buffers leave out."""
        radius = self.depth(level) / SHARE / 2.0
        # Shrinking with mitred corners now and then makes a polygon that is none; growing squares corners.
        thick = self._solid.buffer(-radius).buffer(radius, join_style="mitre")
        return thick.buffer(self.depth(level) / 4.0, quad_segs=2)

    def _less(self, geometry: Any, other: Any) -> Any:
        """Return what is left of a geometry without another; on a fine grid where that fails without."""
        try:
            return geometry.difference(other)
        except shapely.errors.GEOSException:
            grid = 1e-13 * float(np.abs(geometry.bounds).max())
            return shapely.difference(shapely.make_valid(geometry), shapely.make_valid(other), grid_size=grid)
