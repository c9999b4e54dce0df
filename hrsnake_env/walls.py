"""The walls as the simulator needs them: an exact surface, something solid behind it, an open feeder."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import LineString, Polygon

from hrsnake_env.arm import FloatArray
from hrsnake_env.maze import Maze

__all__ = ["Frame", "WallPiece", "has_thin_walls", "wall_pieces"]

CORE_RADII = (0.02, 0.01, 0.005)
"""Radii of the solid layer, in link lengths; the smaller ones stand only in walls too thin for the larger.

The depth of a link that lies wholly behind the surface is exact up to this, and beyond it a lower bound."""


@dataclass(frozen=True, kw_only=True)
class Frame:
    """Map the maze to the simulator: the base is the origin, x the feeder's axis, lengths are scaled.

    Parameters
    ----------
    base_pose : tuple of three floats
        (x, y, heading) in maze units and rad.
    scale : float
        Simulator units per maze unit.
    """

    base_pose: tuple[float, float, float]
    scale: float

    @cached_property
    def _turn(self) -> tuple[float, float]:
        return math.cos(self.base_pose[2]), math.sin(self.base_pose[2])

    def to_simulator(self, points: ArrayLike) -> FloatArray:
        """Return points, shape (..., 2), in the simulator's frame."""
        x, y, heading = self.base_pose
        offset = (np.asarray(points, dtype=np.float64) - (x, y)) * self.scale
        cos, sin = math.cos(heading), math.sin(heading)
        return np.asarray(offset @ np.array([[cos, -sin], [sin, cos]]), dtype=np.float64)

    def place_in_maze(self, point: tuple[float, float]) -> tuple[float, float]:
        """Return one point in the maze's frame."""
        x, y, _ = self.base_pose
        cos, sin = self._turn
        return (
            x + (point[0] * cos - point[1] * sin) / self.scale,
            y + (point[0] * sin + point[1] * cos) / self.scale,
        )

    def to_maze(self, points: ArrayLike) -> FloatArray:
        """Return points, shape (..., 2), in the maze's frame."""
        x, y, heading = self.base_pose
        cos, sin = math.cos(heading), math.sin(heading)
        turned = np.asarray(points, dtype=np.float64) @ np.array([[cos, sin], [-sin, cos]])
        return np.asarray(turned / self.scale + (x, y), dtype=np.float64)


@dataclass(frozen=True, eq=False, kw_only=True)
class WallPiece:
    """Hold one straight piece of a wall, in simulator units.

    Parameters
    ----------
    start, end : tuple of two floats
        With the free space on the left.
    radius : float
        0 for the surface, positive for what is solid behind it.
    wall : int
        Index into `Maze.walls`.
    start_juts, end_juts : bool
        Whether the end is a corner of the walls that juts into the free space.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    radius: float
    wall: int
    start_juts: bool = False
    end_juts: bool = False


def wall_pieces(maze: Maze, frame: Frame, link_length: float, slot: float, reach: float) -> list[WallPiece]:
    """Build the simulator's walls.

    A link that touches a wall touches its surface, a chain without thickness, so that distances are exact
    at corners too: a thick chain would round them. Chains of thick segments behind the surface stop what
    has jumped over it.

    Parameters
    ----------
    maze : Maze
        The maze.
    frame : Frame
        The simulator's frame.
    link_length, slot, reach : float
        In simulator units. The walls are open for the feeder, `slot` to each side of its axis and `reach`
        behind the base.
    """
    rings = [frame.to_simulator(ring) for ring in maze.rings]
    surface, first_wall = [], 0
    for ring in rings:
        surface += _surface_pieces(ring[:-1], first_wall, _slot(slot, reach))
        first_wall += len(ring) - 1
    free_space = Polygon(rings[0], rings[1:])
    edges = shapely.linestrings([np.stack([a, b]) for ring in rings for a, b in pairwise(ring)])
    return surface + _core_pieces(free_space, shapely.STRtree(edges), link_length, slot, reach)


def has_thin_walls(pieces: Iterable[WallPiece], link_length: float) -> bool:
    """Whether walls are too thin for the thickest solid layer, over more than the stump of a corner."""
    stump = 2.0 * CORE_RADII[0] * link_length
    return any(
        0.0 < piece.radius < 0.99 * CORE_RADII[0] * link_length and math.dist(piece.start, piece.end) > stump
        for piece in pieces
    )


def _slot(half_width: float, reach: float) -> Polygon:
    return shapely.box(-reach, -half_width, 0.0, half_width)


def _surface_pieces(ring: FloatArray, first_wall: int, slot: Polygon) -> list[WallPiece]:
    """Cut one ring, shape (n_vertices, 2), into its edges without what lies in the feeder's slot."""
    n = len(ring)
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    juts = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0.0
    vertices = [(float(x), float(y)) for x, y in ring]
    pieces = []
    for k in range(n):
        line = LineString([vertices[k], vertices[(k + 1) % n]])
        for start, end in _parts(line, slot):
            whole_start, whole_end = start == vertices[k], end == vertices[(k + 1) % n]
            pieces.append(
                WallPiece(
                    start=start,
                    end=end,
                    radius=0.0,
                    wall=first_wall + k,
                    start_juts=whole_start and bool(juts[k]),
                    end_juts=whole_end and bool(juts[(k + 1) % n]),
                )
            )
    return pieces


def _parts(line: LineString, hole: Polygon) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return start and end of the parts of a segment outside a hole, in the segment's direction."""
    if not line.intersects(hole):
        return [(line.coords[0], line.coords[1])]
    parts = shapely.get_parts(line.difference(hole))
    origin = np.asarray(line.coords[0])
    ends = [part.coords for part in parts if part.length > 0.0]
    turned = [
        (c[0], c[-1]) if np.sum((c[0] - origin) ** 2) <= np.sum((c[-1] - origin) ** 2) else (c[-1], c[0])
        for c in (np.asarray(coords) for coords in ends)
    ]
    return [((float(a[0]), float(a[1])), (float(b[0]), float(b[1]))) for a, b in turned]


def _core_pieces(
    free_space: Polygon, edges: shapely.STRtree, link_length: float, slot: float, reach: float
) -> list[WallPiece]:
    """Build the solid chains behind the surface, thick ones first, thinner ones where those do not fit."""
    pieces: list[WallPiece] = []
    covered: Any = Polygon()
    for share in CORE_RADII:
        depth = share * link_length
        lines = free_space.buffer(depth, join_style="mitre").boundary.difference(covered)
        covered = covered.union(lines.buffer(depth))
        lines = lines.difference(_slot(slot + depth, reach))
        for line in shapely.get_parts(shapely.line_merge(lines)):
            # The buffer's rounding and simplifying must never let the core stand out of the surface.
            radius = min(depth, float(line.distance(free_space)))
            pieces += _chain_pieces(line, radius, edges)
    return pieces


def _chain_pieces(line: LineString, radius: float, edges: shapely.STRtree) -> list[WallPiece]:
    points = [(float(x), float(y)) for x, y in line.coords]
    middles = 0.5 * (np.asarray(points[:-1]) + np.asarray(points[1:]))
    walls = edges.nearest(shapely.points(middles))
    return [
        WallPiece(start=start, end=end, radius=radius, wall=int(wall))
        for start, end, wall in zip(points, points[1:], walls, strict=False)
    ]
