"""The Laplace potential of the free space (section 2 of the paper, Eq. 1 and 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Point

from hrsnake_env.maze import Maze
from planners.kernels.grid import scan_walls
from planners.kernels.types import BoolArray, FloatArray

__all__ = ["Potential", "laplace_potential", "passage_width"]

CELLS_PER_WIDTH = 12.0
"""Grid cells across the narrowest passage."""

MANY_CELLS, FEWEST_CELLS_PER_WIDTH = 100_000, 6.0
"""In a wide hall with a narrow passage cells are larger, until these are all, but not larger than this."""

MANY_CORNERS = 1000
"""Walls of more corners than this are simplified for the width of the narrowest passage."""

MAX_CELLS = 400_000
"""Largest number of grid cells in the bounding box; above it, cells are larger in any case."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Potential:
    """Hold u = 1 - phi on a grid: 1 at the goal, 0 on walls, harmonic elsewhere.

    Parameters
    ----------
    u : array, shape (ny, nx)
        Node (j, i) stands at origin + cell (i, j). Outside the free space u is 0.
    blocked_x, blocked_y : array, shape (ny, nx)
        Whether a wall crosses the grid edge towards the next node in x, in y.
    origin : array, shape (2,)
        Place of node (0, 0), in maze units.
    cell : float
        Spacing of the nodes, in maze units.
    """

    u: FloatArray
    blocked_x: BoolArray
    blocked_y: BoolArray
    origin: FloatArray
    cell: float


def passage_width(maze: Maze) -> float:
    """Compute the width of the narrowest passage from base to goal.

    This is the diameter of the largest disc that can be moved from beside the base to beside the goal, to
    about 1 %; the geometry of the paper is scaled with it.

    Parameters
    ----------
    maze : Maze
        The maze.

    Returns
    -------
    width : float
        In maze units.

    Examples
    --------
    >>> bool(abs(passage_width(Maze.load("fig19")) - 200) < 4)
    True
    """
    low, high = 0.0, math.sqrt(maze.free_space.area / math.pi)
    while high - low > 0.01 * high:
        radius = 0.5 * (low + high)
        if _disc_passes(maze, radius):
            low = radius
        else:
            high = radius
        if high < 1e-6 * maze.size:
            break
    return 2.0 * (low if low > 0.0 else high)


def _disc_passes(maze: Maze, radius: float) -> bool:
    centres = _shrunk(maze.free_space, radius)
    reach = radius * (1.0 + 1e-9)
    base, goal = Point(maze.base_pose[:2]), Point(maze.goal)
    return any(
        part.distance(base) <= reach and part.distance(goal) <= reach
        for part in shapely.get_parts(centres)
        if not part.is_empty
    )


def _shrunk(free_space: Any, radius: float) -> Any:
    """Return where the centre of a disc may be; of walls in many pieces, to about a hundredth of the radius.

    Pieces much shorter than the radius are slow to shrink at once, as the arcs round them all meet.
    """
    if shapely.get_num_coordinates(free_space) <= MANY_CORNERS:
        return free_space.buffer(-radius, quad_segs=4)
    for tolerance in (0.001, 0.005, 0.02):
        free_space = free_space.simplify(tolerance * radius)
        if shapely.get_num_coordinates(free_space) <= MANY_CORNERS:
            break
    done = 0.0
    for share in (0.03, 0.15, 1.0):
        free_space = free_space.buffer(done - share * radius, quad_segs=4).simplify(0.001 * radius)
        done = share * radius
    return free_space


def laplace_potential(maze: Maze, *, width: float | None = None) -> Potential:
    """Solve the discrete Laplace equation, Eq. (2), with the goal at 1 and the walls at 0.

    The paper gives the goal 2^-126, the walls 0 and the rest 1 and iterates; for its descent, Eq. (3), to end
    at the goal, the goal must be the lowest value, so u stands for 1 - phi here, and is ascended. One sparse
    LU factorisation of the M-matrix keeps the relative accuracy of u down to the smallest numbers, where an
    iteration ends on a plateau.

    Parameters
    ----------
    maze : Maze
        The maze.
    width : float, optional
        The passage width, in maze units; the grid spacing is a twelfth of it, or more where that would be
        very many cells. By default it is computed.

    Returns
    -------
    potential : Potential
        With a node on the goal.
    """
    x_min, y_min, x_max, y_max = maze.free_space.bounds
    width = passage_width(maze) if width is None else width
    side = math.sqrt((x_max - x_min) * (y_max - y_min))
    coarse = min(side / math.sqrt(MANY_CELLS), width / FEWEST_CELLS_PER_WIDTH)
    cell = max(width / CELLS_PER_WIDTH, coarse, side / math.sqrt(MAX_CELLS))
    # Two rings of nodes outside, so that differences can be taken everywhere inside.
    left = math.ceil((maze.goal[0] - x_min) / cell) + 2
    below = math.ceil((maze.goal[1] - y_min) / cell) + 2
    nx = left + math.ceil((x_max - maze.goal[0]) / cell) + 3
    ny = below + math.ceil((y_max - maze.goal[1]) / cell) + 3
    origin = maze.goal - cell * np.array([left, below], dtype=np.float64)
    inside, blocked_x, blocked_y = scan_walls(maze.walls, origin[0], origin[1], cell, nx, ny)
    inside[below, left] = True
    u = _solve(inside, blocked_x, blocked_y, (below, left))
    return Potential(u=u, blocked_x=blocked_x, blocked_y=blocked_y, origin=origin, cell=cell)


def _solve(
    inside: BoolArray, blocked_x: BoolArray, blocked_y: BoolArray, goal: tuple[int, int]
) -> FloatArray:
    import scipy.sparse as sparse  # takes a tenth of a second, which programs that do not plan save
    from scipy.sparse.linalg import splu

    unknown = inside.copy()
    unknown[goal] = False
    index = np.full(inside.shape, -1)
    n = int(unknown.sum())
    index[unknown] = np.arange(n)
    rows, columns = [], []
    right = np.zeros(n)
    for axis, blocked in ((1, blocked_x), (0, blocked_y)):
        first = tuple(slice(None, -1) if k == axis else slice(None) for k in range(2))
        second = tuple(slice(1, None) if k == axis else slice(None) for k in range(2))
        open_edge = ~blocked[first]
        a, b = index[first], index[second]
        both = open_edge & (a >= 0) & (b >= 0)
        rows += [a[both], b[both]]
        columns += [b[both], a[both]]
        at_goal = np.zeros(inside.shape, dtype=bool)
        at_goal[goal] = True
        for near, far in ((a, at_goal[second]), (b, at_goal[first])):
            np.add.at(right, near[open_edge & far & (near >= 0)], 1.0)
    row, column = np.concatenate(rows), np.concatenate(columns)
    matrix = sparse.csc_matrix(
        (
            np.concatenate([np.full(row.size, -1.0), np.full(n, 4.0)]),
            (np.concatenate([row, np.arange(n)]), np.concatenate([column, np.arange(n)])),
        ),
        shape=(n, n),
    )
    u = np.zeros(inside.shape)
    if n > 0:
        factors = splu(
            matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        u[unknown] = factors.solve(right)
    u[goal] = 1.0
    return u
