"""The maze as the track planner sees it: in link lengths, the base at the origin and its axis along x."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hrsnake_env.maze import Maze
from planners.kernels import track_walls as kernel
from planners.kernels.track_types import Surroundings
from planners.kernels.types import FloatArray

__all__ = ["Scene"]

CELL = 0.25
"""Size of the grid cells by which walls are listed, in link lengths."""

MOST_CELLS = 400
"""Grid cells along one side, at most."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Hold maze and link length.

    Parameters
    ----------
    maze : Maze
        With walls grown by the radius of the links.
    length : float
        Link length, in maze units.
    joint_limit : float
        In rad; infinite if there is none.
    """

    maze: Maze
    length: float
    joint_limit: float

    def scaled(self, points: FloatArray) -> FloatArray:
        """Turn places in the maze, shape (..., 2), into link lengths from the base."""
        return np.ascontiguousarray((points - self.maze.base_pose[:2]) @ self._rotation / self.length)

    def unscaled(self, points: FloatArray) -> FloatArray:
        """Turn link lengths from the base, shape (..., 2), into places in the maze."""
        return np.asarray(self.length * points @ self._rotation.T + self.maze.base_pose[:2])

    @cached_property
    def _rotation(self) -> FloatArray:
        cos, sin = math.cos(self.maze.base_pose[2]), math.sin(self.maze.base_pose[2])
        return np.array([[cos, -sin], [sin, cos]])

    @cached_property
    def goal(self) -> FloatArray:
        """The goal, shape (2,)."""
        return self.scaled(self.maze.goal)

    @property
    def goal_radius(self) -> float:
        """In link lengths."""
        return self.maze.goal_radius / self.length

    @cached_property
    def rings(self) -> list[FloatArray]:
        """The walls as rings, each of shape (n_vertices, 2), with the free space on the left.

        Corners that turning and scaling put on one another are one corner: no wall is a point.
        """
        rings = [_without_repeats(self.scaled(ring[:-1])) for ring in self.maze.rings]
        return [ring for ring in rings if len(ring) > 1]

    @cached_property
    def outward(self) -> list[FloatArray]:
        """For each ring unit vectors from its vertices into the free space, shape (n_vertices, 2)."""
        return [_outward(ring)[1] for ring in self.rings]

    @cached_property
    def near(self) -> Surroundings:
        """Walls and corners, for the kernels."""
        walls = np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in self.rings])
        convex = np.concatenate([_outward(ring)[0] for ring in self.rings])
        origin = walls.min(axis=(0, 1)) - 1.0
        size = walls.max(axis=(0, 1)) + 1.0 - origin
        cell = max(CELL, float(size.max()) / MOST_CELLS)
        nx, ny = (int(value / cell) + 1 for value in size)
        first, members = np.zeros(nx * ny + 1, dtype=np.int64), np.empty(0, dtype=np.int64)
        n = kernel.list_walls(walls, origin, cell, nx, ny, first, members)
        members = np.empty(n, dtype=np.int64)
        kernel.list_walls(walls, origin, cell, nx, ny, first, members)
        return Surroundings(
            walls=walls,
            corners=np.concatenate(self.rings)[convex],
            outward=np.concatenate(self.outward)[convex],
            origin=origin,
            cell=cell,
            nx=nx,
            ny=ny,
            first=first,
            members=members,
        )

    def sees(self, a: FloatArray, b: FloatArray) -> bool:
        """Tell whether no wall meets the segment between two points, in link lengths."""
        return bool(kernel.wall_between(a[0], a[1], b[0], b[1], self.near.walls) < 0)


def _without_repeats(ring: FloatArray) -> FloatArray:
    return np.asarray(ring[(ring != np.roll(ring, 1, axis=0)).any(axis=1)])


def _outward(ring: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tell which vertices of a ring are convex corners, and the way from each into the free space."""
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    before, after = before / np.hypot(*before.T)[:, None], after / np.hypot(*after.T)[:, None]
    convex = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0.0
    # Across the mean of both edges, to the left of them, where the free space is.
    across = np.column_stack([-(before + after)[:, 1], (before + after)[:, 0]])
    return convex, across / np.maximum(np.hypot(*across.T), 1e-12)[:, None]
