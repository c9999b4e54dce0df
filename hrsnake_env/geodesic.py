"""How far it is to the goal through the free space: a distance that knows of the walls."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze

__all__ = ["GeodesicDistance"]

CELLS = 200
"""Grid cells along the maze's diagonal, to begin with."""

FINE_CELLS = 800
MAX_CELLS = 1600
"""The grid is refined up to these: to tell the sides of a thin wall apart, and to find a way at all."""

STEPS = ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2))
"""Half of the 16 neighbours of a grid node; the distances are then at most 2.8 % too long."""


class GeodesicDistance:
    """Tell how far it is from any place to the goal without crossing a wall.

    Computed once on a grid (Dijkstra's algorithm), then interpolated. The grid is refined where it must be:
    until the base is joined to the goal, and, within reason, until no cell has both sides of a wall.

    Parameters
    ----------
    maze : Maze
        The maze.

    Raises
    ------
    InputError
        If the way is too narrow even for the finest grid.
    """

    def __init__(self, maze: Maze) -> None:
        self._goal = np.asarray(maze.goal)
        shapely.prepare(maze.free_space)
        cells = CELLS
        while True:
            self._cell = maze.size / cells
            self._build(maze)
            joined = math.isfinite(self(maze.base_pose[:2]))
            cells *= 2
            if joined and (cells > FINE_CELLS or self._tells_sides_apart()):
                return
            if cells > MAX_CELLS:
                raise InputError(
                    f"Expected a way to the goal of maze '{maze.name}' that is wider than "
                    f"{2 * self._cell:g} {maze.units}, got a narrower one."
                )

    def __call__(self, point: ArrayLike) -> float:
        """Return the distance from a point, shape (2,), in maze units; infinite far inside a wall."""
        x, y = (np.asarray(point, dtype=np.float64) - self._origin) / self._cell
        rows, columns = self._grid.shape
        i, j = min(max(int(x), 0), rows - 2), min(max(int(y), 0), columns - 2)
        u, v = min(max(x - i, 0.0), 1.0), min(max(y - j, 0.0), 1.0)
        total, weight = 0.0, 0.0
        for di, dj, share in (
            (0, 0, (1 - u) * (1 - v)),
            (1, 0, u * (1 - v)),
            (0, 1, (1 - u) * v),
            (1, 1, u * v),
        ):
            value = self._grid[i + di, j + dj]
            if value < math.inf:
                share = max(share, 1e-9)  # a point on a grid line next to a wall
                total, weight = total + share * value, weight + share
        return float(total / weight) if weight > 0.0 else math.inf

    def _build(self, maze: Maze) -> None:
        """Compute the distance of all grid nodes in the free space; the others are infinitely far."""
        x_min, y_min, x_max, y_max = maze.free_space.bounds
        # Half a cell off the walls of mazes in round numbers, along which no node could be free.
        self._origin = np.array([x_min, y_min]) - 0.5 * self._cell
        shape = (math.ceil((x_max - x_min) / self._cell) + 2, math.ceil((y_max - y_min) / self._cell) + 2)
        x, y = (self._origin[axis] + self._cell * np.arange(shape[axis]) for axis in (0, 1))
        nodes = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        free = shapely.contains_xy(maze.free_space, nodes[:, 0], nodes[:, 1])
        starts, ends = self._edges(maze, nodes, free, shape)
        near_goal = np.flatnonzero(free & (np.linalg.norm(nodes - self._goal, axis=1) <= 3 * self._cell))
        lines = shapely.linestrings(
            np.stack([nodes[near_goal], np.broadcast_to(self._goal, (len(near_goal), 2))], 1)
        )
        near_goal = near_goal[shapely.covers(maze.free_space, lines)]
        starts = np.concatenate([starts, near_goal])
        ends = np.concatenate([ends, np.full(len(near_goal), len(nodes))])
        places = np.concatenate([nodes, self._goal[None]])
        lengths = np.maximum(np.linalg.norm(places[starts] - places[ends], axis=1), 1e-9 * self._cell)
        graph = coo_array((lengths, (starts, ends)), shape=(len(places), len(places))).tocsr()
        self._grid = dijkstra(graph, directed=False, indices=len(nodes))[:-1].reshape(shape)

    def _tells_sides_apart(self) -> bool:
        corners = np.stack(
            [self._grid[:-1, :-1], self._grid[1:, :-1], self._grid[:-1, 1:], self._grid[1:, 1:]]
        )
        finite = np.isfinite(corners)
        highest = np.max(corners, axis=0, where=finite, initial=0.0)
        lowest = np.min(corners, axis=0, where=finite, initial=math.inf)
        return not np.any(highest - lowest > 8.0 * self._cell)

    def _edges(
        self, maze: Maze, nodes: FloatArray, free: np.ndarray, shape: tuple[int, int]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Join neighbouring free nodes, where no wall stands in between."""
        index = np.arange(len(nodes)).reshape(shape)
        starts, ends = [], []
        for di, dj in STEPS:
            a = index[: shape[0] - di, max(0, -dj) : shape[1] - max(0, dj)].ravel()
            b = index[di:, max(0, dj) : shape[1] - max(0, -dj)].ravel()
            both = free[a] & free[b]
            starts.append(a[both])
            ends.append(b[both])
        start, end = np.concatenate(starts), np.concatenate(ends)
        # An edge is at most 2.24 cells long: only nodes this near to a wall can have one that crosses it.
        near = np.zeros(len(nodes), dtype=bool)
        near[free] = shapely.dwithin(shapely.points(nodes[free]), maze.free_space.boundary, 2.3 * self._cell)
        doubtful = np.flatnonzero(near[start] & near[end])
        lines = shapely.linestrings(np.stack([nodes[start[doubtful]], nodes[end[doubtful]]], axis=1))
        crossing = doubtful[~shapely.covers(maze.free_space, lines)]
        return np.delete(start, crossing), np.delete(end, crossing)
