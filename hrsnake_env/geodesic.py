"""How far it is to the goal through the free space, and which way: exactly, round the walls' corners."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze

__all__ = ["GeodesicDistance", "Ways", "distance_at", "look_ahead"]

CELLS_PER_WIDTH = 4
"""Grid cells across the mean width of the free space."""

MAX_CELLS = 400
"""Grid cells along the maze's diagonal, at most. Coarser grids cost time in a query, not exactness."""

OFF_WALL = 1e-7
"""In cells. Ways keep this far off the walls: rounding then never decides whether a wall is in the way."""

MARGIN = 1e-6
"""In cells. A wall is listed in all cells that it comes this near to."""

INTO_WALLS = 0.25
"""In cells. Less deep in a wall there still is a way: out of it first, then on from the surface."""

HALF_DIAGONAL = 0.71
"""Of a cell, in cells, rounded up."""


class Ways(NamedTuple):
    """Hold the shortest ways to the goal as plain arrays, for kernels.

    A shortest way runs straight from bend to bend, and bends at the walls' convex corners alone. Lengths and
    places are in grid cells, from the grid's origin: cell (i, j) goes from (i, j) to (i + 1, j + 1).
    """

    origin_x: float
    """The grid's origin, in maze units."""
    origin_y: float
    cell: float
    """Side of a cell, in maze units."""
    n_x: int
    """Number of cells along each axis; cell (i, j) is number i * n_y + j."""
    n_y: int
    bends: FloatArray
    """The goal, then the corners, shape (n_bends, 2)."""
    lengths: FloatArray
    """Of the way from each bend, shape (n_bends,)."""
    onward: NDArray[np.int32]
    """The bend after each bend, shape (n_bends,)."""
    walls: FloatArray
    """Start and end of each wall, shape (n_walls, 4)."""
    wall_begins: NDArray[np.int32]
    """Where the walls of each cell begin in `cell_walls`, shape (n_cells + 1,)."""
    cell_walls: NDArray[np.int32]
    """The walls in each cell, cell by cell."""
    bend_begins: NDArray[np.int32]
    """Where the bends of each cell begin in `cell_bends`, shape (n_cells + 1,)."""
    cell_bends: NDArray[np.int32]
    """The bends with which a way from each cell can begin, cell by cell."""


class GeodesicDistance:
    """Tell how far it is from any place to the goal without crossing a wall, and where the way goes.

    Exact: shortest ways bend at the walls' corners, and Dijkstra's algorithm on the graph of corners that see
    each other finds those from the corners. From other places the first bend is looked up: a grid holds the
    few that come into question in each cell. So the distance changes by no more than the length of a step,
    and falls by that length all along the way, to within 1e-6 cells (see `Ways`).

    Parameters
    ----------
    maze : Maze
        The maze.
    goal : array-like, shape (2,), optional
        In maze units; by default the maze's.

    Raises
    ------
    InputError
        If the goal is not in the free space, or the way is too narrow for floating-point numbers.
    """

    def __init__(self, maze: Maze, goal: ArrayLike | None = None) -> None:
        place = np.array(maze.goal if goal is None else goal, dtype=np.float64)
        if place.shape != (2,) or not shapely.contains_xy(maze.free_space, *place):
            raise InputError(f"Expected a goal (x, y) in the free space, got {place.tolist()}.")
        self.ways = _ways(maze, place)
        if not math.isfinite(self(maze.base_pose[:2])):
            raise InputError(
                f"Expected a way to the goal of maze '{maze.name}' that is wider than "
                f"{2 * OFF_WALL * self.ways.cell:g} {maze.units}, got a narrower one."
            )

    def __call__(self, point: ArrayLike) -> float:
        """Return the distance from a point, shape (2,), in maze units; infinite deep in a wall."""
        x, y = np.asarray(point, dtype=np.float64)
        return float(distance_at(self.ways, x, y))

    def ahead(self, point: ArrayLike, distances: ArrayLike) -> FloatArray:
        """Return the places on the way to the goal at some distances ahead of a point.

        Parameters
        ----------
        point : array-like, shape (2,)
            In maze units.
        distances : array-like, shape (n,)
            Along the way, in maze units, not negative.

        Returns
        -------
        places : array, shape (n, 2)
            In maze units: the goal where it is nearer, and the point itself deep in a wall.

        Raises
        ------
        InputError
            If a distance is negative or not a number.
        """
        x, y = np.asarray(point, dtype=np.float64)
        along = np.array(distances, dtype=np.float64)
        if not (along.ndim == 1 and (along >= 0.0).all()):
            raise InputError(f"Expected a list of distances that are not negative, got {distances!r}.")
        places = np.empty((len(along), 2))
        look_ahead(self.ways, x, y, along, places)
        return places

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the arrays read-only again, which pickle forgets."""
        self.ways = _frozen(state["ways"])


def _frozen(ways: Ways) -> Ways:
    """Make all arrays read-only; kernels are compiled for such alone."""
    for array in ways:
        if isinstance(array, np.ndarray):
            array.setflags(write=False)
    return ways


def _ways(maze: Maze, goal: FloatArray) -> Ways:
    """Find the shortest ways from all corners, and the corners with which ways from each cell can begin."""
    mean_width = 2.0 * maze.free_space.area / maze.free_space.length
    cell = max(mean_width / CELLS_PER_WIDTH, maze.size / MAX_CELLS)
    low, high = np.reshape(maze.free_space.bounds, (2, 2))
    origin = low - 1.5 * cell
    n_x, n_y = (int(n) for n in np.ceil((high - origin) / cell) + 2)
    rings = [(ring - origin) / cell for ring in maze.rings]
    walls = np.concatenate([np.hstack([ring[:-1], ring[1:]]) for ring in rings])
    corners, ends = _corners(rings)
    wall_begins, cell_walls = _by_cell(_walls_in_cells(walls, n_y), n_x * n_y)
    ways = Ways(
        origin_x=float(origin[0]),
        origin_y=float(origin[1]),
        cell=float(cell),
        n_x=n_x,
        n_y=n_y,
        bends=np.concatenate([((goal - origin) / cell)[None], corners]),
        lengths=np.zeros(len(ends)),
        onward=np.zeros(len(ends), dtype=np.int32),
        walls=walls,
        wall_begins=wall_begins,
        cell_walls=cell_walls,
        bend_begins=np.zeros(n_x * n_y + 1, dtype=np.int32),
        cell_bends=np.zeros(0, dtype=np.int32),
    )
    ways.bends[0] = _off_walls(_frozen(ways._replace(bends=ways.bends.copy())), *ways.bends[0])
    lengths, onward = _ways_from_bends(_frozen(ways), ends)
    ways = _frozen(ways._replace(lengths=lengths, onward=onward))
    bend_begins, cell_bends = _by_cell(_bends_of_cells(ways, ends), n_x * n_y)
    return _frozen(ways._replace(bend_begins=bend_begins, cell_bends=cell_bends))


def _ways_from_bends(ways: Ways, ends: FloatArray) -> tuple[FloatArray, NDArray[np.int32]]:
    """Return `Ways.lengths`, infinite where there is no way, and `Ways.onward`."""
    a, b = _bends_in_sight(ways, ends).T
    gaps = np.linalg.norm(ways.bends[a] - ways.bends[b], axis=1)
    graph = csr_array((gaps, (a.astype(np.int32), b.astype(np.int32))), shape=(len(ends), len(ends)))
    lengths, onward = dijkstra(graph, directed=False, indices=0, return_predecessors=True)
    return lengths, np.maximum(onward, 0).astype(np.int32)


def _corners(rings: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Find the walls' convex corners.

    Returns
    -------
    corners : array, shape (n_corners, 2)
        The corners, a little off the wall.
    ends : array, shape (1 + n_corners, 4)
        The directions in which the two walls of each bend leave it; zeros for the goal, which is bend 0.
    """
    corners, ends = [], [np.zeros((1, 4))]
    for ring in rings:
        after = np.diff(ring, axis=0)
        after /= np.linalg.norm(after, axis=1)[:, None]
        before = np.roll(after, 1, axis=0)
        # The free space is on the left: at its reflex corners the walls turn right.
        convex = before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]
        outward = (before + after)[convex] @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        corners.append(ring[:-1][convex] + 2.0 * OFF_WALL * outward)
        ends.append(np.hstack([-before[convex], after[convex]]))
    return np.concatenate(corners), np.concatenate(ends)


def _by_cell(entries: FloatArray, n_cells: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Sort rows (cell, what is in it, rank); return where each cell begins, and what is in the cells."""
    entries = entries[np.lexsort((entries[:, 2], entries[:, 0]))]
    begins = np.searchsorted(entries[:, 0], np.arange(n_cells + 1))
    return begins.astype(np.int32), entries[:, 1].astype(np.int32)


@numba.njit(cache=True)
def distance_at(ways: Ways, x: float, y: float) -> float:
    """Return the distance from a place to the goal, in maze units; infinite deep in a wall."""
    _, _, _, length = _way_from(ways, (x - ways.origin_x) / ways.cell, (y - ways.origin_y) / ways.cell)
    return length * ways.cell


@numba.njit(cache=True)
def look_ahead(ways: Ways, x: float, y: float, distances: FloatArray, places: FloatArray) -> float:
    """Write the places at some distances ahead of (x, y) on the way to the goal, all in maze units.

    Returns
    -------
    distance : float
        As `distance_at` has it.
    """
    u, v = (x - ways.origin_x) / ways.cell, (y - ways.origin_y) / ways.cell
    start_u, start_v, first, length = _way_from(ways, u, v)
    for k in range(len(distances)):
        left = min(distances[k] / ways.cell, length)
        here_u, here_v, next_u, next_v, bend = u, v, start_u, start_v, first
        while length < math.inf:
            gap = math.hypot(next_u - here_u, next_v - here_v)
            if left <= gap or (next_u == ways.bends[0, 0] and next_v == ways.bends[0, 1]):
                share = min(left / gap, 1.0) if gap > 0.0 else 0.0
                here_u, here_v = here_u + share * (next_u - here_u), here_v + share * (next_v - here_v)
                break
            left -= gap
            here_u, here_v = next_u, next_v
            next_u, next_v, bend = ways.bends[bend, 0], ways.bends[bend, 1], ways.onward[bend]
        places[k, 0] = ways.origin_x + ways.cell * here_u
        places[k, 1] = ways.origin_y + ways.cell * here_v
    return length * ways.cell


@numba.njit(cache=True)
def _way_from(ways: Ways, x: float, y: float) -> tuple[float, float, int, float]:
    """Return where the way from a place begins in the free space, its first bend, and its length."""
    if not (0.0 <= x < ways.n_x and 0.0 <= y < ways.n_y):
        return x, y, -1, math.inf
    start_x, start_y = _off_walls(ways, x, y)
    bend, length = _first_bend(ways, start_x, start_y)
    if bend < 0:  # in a wall: begin at its surface
        start_x, start_y = _nearest_on_walls(ways, x, y)
        if start_x < math.inf:
            start_x, start_y = _off_walls(ways, start_x, start_y)
            bend, length = _first_bend(ways, start_x, start_y)
    return start_x, start_y, bend, length + math.hypot(start_x - x, start_y - y)


@numba.njit(cache=True)
def _first_bend(ways: Ways, x: float, y: float) -> tuple[int, float]:
    """Return the first bend of the shortest way from a place, and the way's length; -1 in a wall."""
    c = int(x) * ways.n_y + int(y)
    best, least = -1, math.inf
    for k in range(ways.bend_begins[c], ways.bend_begins[c + 1]):
        bend = ways.cell_bends[k]
        bend_x, bend_y = ways.bends[bend, 0], ways.bends[bend, 1]
        length = math.hypot(bend_x - x, bend_y - y) + ways.lengths[bend]
        if length < least and _wall_between(ways, x, y, bend_x, bend_y) < 0:
            best, least = bend, length
    return best, least


@numba.njit(cache=True)
def _wall_between(ways: Ways, ax: float, ay: float, bx: float, by: float) -> int:
    """Return a wall that touches the line from a to b, the first to be found in the cells on it, or -1."""
    i, j, last_i, last_j = int(ax), int(ay), int(bx), int(by)
    dx, dy = bx - ax, by - ay
    step_i, step_j = 1 if dx > 0.0 else -1, 1 if dy > 0.0 else -1
    pace_x, pace_y = abs(1.0 / dx) if dx != 0.0 else math.inf, abs(1.0 / dy) if dy != 0.0 else math.inf
    # When, between 0 at a and 1 at b, the line comes to the next column and to the next row of cells.
    next_x = ((i + 1 - ax) if dx > 0.0 else (ax - i)) * pace_x if dx != 0.0 else math.inf
    next_y = ((j + 1 - ay) if dy > 0.0 else (ay - j)) * pace_y if dy != 0.0 else math.inf
    while True:
        c = i * ways.n_y + j
        for k in range(ways.wall_begins[c], ways.wall_begins[c + 1]):
            if _crosses(ways.walls, ways.cell_walls[k], ax, ay, bx, by):
                return int(ways.cell_walls[k])
        if i == last_i and j == last_j:
            return -1
        if j == last_j or (i != last_i and next_x < next_y):
            i += step_i
            next_x += pace_x
        else:
            j += step_j
            next_y += pace_y


@numba.njit(cache=True)
def _crosses(walls: FloatArray, k: int, ax: float, ay: float, bx: float, by: float) -> bool:
    """Tell whether a wall crosses or touches the line from a to b, or ends on it."""
    px, py = walls[k, 0], walls[k, 1]
    wx, wy = walls[k, 2] - px, walls[k, 3] - py
    side_a = wx * (ay - py) - wy * (ax - px)
    side_b = wx * (by - py) - wy * (bx - px)
    if (side_a > 0.0 and side_b > 0.0) or (side_a < 0.0 and side_b < 0.0):
        return False
    if side_a == 0.0 and side_b == 0.0:  # on the line of a wall: neither end is within OFF_WALL of it
        return False
    dx, dy = bx - ax, by - ay
    side_p = dx * (py - ay) - dy * (px - ax)
    side_q = side_p + dx * wy - dy * wx
    return not ((side_p > 0.0 and side_q > 0.0) or (side_p < 0.0 and side_q < 0.0))


@numba.njit(cache=True)
def _off_walls(ways: Ways, x: float, y: float) -> tuple[float, float]:
    """Return a place in front of the walls, if (x, y) is nearer to one than OFF_WALL."""
    c = int(x) * ways.n_y + int(y)
    moved, n = True, 0
    while moved and n < 50:  # in a corner, off either wall in turn; 50 times suffice if it is not very sharp
        moved, n = False, n + 1
        for k in range(ways.wall_begins[c], ways.wall_begins[c + 1]):
            wall = ways.cell_walls[k]
            near_x, near_y = _nearest_on_wall(ways.walls, wall, x, y)
            wx, wy = ways.walls[wall, 2] - ways.walls[wall, 0], ways.walls[wall, 3] - ways.walls[wall, 1]
            length, gap = math.hypot(wx, wy), math.hypot(x - near_x, y - near_y)
            in_front = wx * (y - near_y) - wy * (x - near_x) > -0.99 * gap * length
            if gap < (1.0 if in_front else 3.0) * OFF_WALL:  # it may just have been moved behind this wall
                share = 1.5 * OFF_WALL / length
                x, y, moved = near_x - share * wy, near_y + share * wx, True
    return x, y


@numba.njit(cache=True)
def _nearest_on_wall(walls: FloatArray, k: int, x: float, y: float) -> tuple[float, float]:
    px, py = walls[k, 0], walls[k, 1]
    wx, wy = walls[k, 2] - px, walls[k, 3] - py
    share = min(max(((x - px) * wx + (y - py) * wy) / (wx * wx + wy * wy), 0.0), 1.0)
    return px + share * wx, py + share * wy


@numba.njit(cache=True)
def _nearest_on_walls(ways: Ways, x: float, y: float) -> tuple[float, float]:
    """Return the nearest place on a wall; infinite if none is within INTO_WALLS."""
    n_x, n_y = ways.n_x, ways.n_y
    best_x, best_y, least = math.inf, math.inf, INTO_WALLS
    for i in range(max(int(x) - 1, 0), min(int(x) + 2, n_x)):
        for c in range(i * n_y + max(int(y) - 1, 0), i * n_y + min(int(y) + 2, n_y)):
            for k in range(ways.wall_begins[c], ways.wall_begins[c + 1]):
                near_x, near_y = _nearest_on_wall(ways.walls, ways.cell_walls[k], x, y)
                gap = math.hypot(near_x - x, near_y - y)
                if gap < least:
                    best_x, best_y, least = near_x, near_y, gap
    return best_x, best_y


@numba.njit(cache=True)
def _walls_in_cells(walls: FloatArray, n_y: int) -> FloatArray:
    """Return rows (cell, wall, 0): the cells that each wall comes within MARGIN of."""
    rows = [(0.0, 0.0, 0.0) for _ in range(0)]
    for wall in range(len(walls)):
        px, py, qx, qy = walls[wall]
        if px > qx:
            px, py, qx, qy = qx, qy, px, py
        for i in range(int(px - MARGIN), int(qx + MARGIN) + 1):
            a, b = 0.0, 1.0  # the part of the wall in this column of cells
            if qx > px:
                a = min(max((i - MARGIN - px) / (qx - px), 0.0), 1.0)
                b = min(max((i + 1 + MARGIN - px) / (qx - px), 0.0), 1.0)
            end_a, end_b = py + a * (qy - py), py + b * (qy - py)
            for j in range(int(min(end_a, end_b) - MARGIN), int(max(end_a, end_b) + MARGIN) + 1):
                rows.append((float(i * n_y + j), float(wall), 0.0))
    return np.array(rows)


@numba.njit(cache=True)
def _bends_in_sight(ways: Ways, ends: FloatArray) -> NDArray[np.int64]:
    """Return the pairs of bends that see each other, and round both of which a taut string could bend."""
    pairs = [(0, 0) for _ in range(0)]
    for a in range(len(ends)):
        ax, ay = ways.bends[a]
        for b in range(a):
            bx, by = ways.bends[b]
            if (
                _grazes(ends[a], bx - ax, by - ay)
                and _grazes(ends[b], bx - ax, by - ay)
                and _wall_between(ways, ax, ay, bx, by) < 0
            ):
                pairs.append((a, b))
    found = np.empty((len(pairs), 2), dtype=np.int64)
    for k in range(len(pairs)):
        found[k] = pairs[k]
    return found


@numba.njit(cache=True)
def _grazes(ends: FloatArray, dx: float, dy: float) -> bool:
    """Tell whether a line passes by a corner with both of its walls on one side."""
    one, other = dx * ends[1] - dy * ends[0], dx * ends[3] - dy * ends[2]
    return not (min(one, other) < -MARGIN and max(one, other) > MARGIN)


@numba.njit(cache=True)
def _bends_of_cells(ways: Ways, ends: FloatArray) -> FloatArray:
    """Return rows (cell, bend, length of the way over it): from which cells a way can begin with which bend.

    Ways that begin with a bend come from places that see it, lie in its shadow (between the line on which the
    way goes on, drawn backwards, and the wall), and have no shorter way. The cells that such places are in
    hang together, so a flood from the bend finds them. A cell too many does no harm.
    """
    rows = [(0.0, 0.0, 0.0) for _ in range(0)]
    n_cells = ways.n_x * ways.n_y
    known = np.full(n_cells, math.inf)  # from anywhere in the cell there is a way no longer than this
    reached = np.full(n_cells, -1, dtype=np.int32)
    stack = np.empty(n_cells, dtype=np.int32)
    for bend in np.argsort(ways.lengths):
        if ways.lengths[bend] == math.inf:
            break
        x, y = ways.bends[bend]
        stack[0], n = int(x) * ways.n_y + int(y), 1
        reached[stack[0]] = bend
        while n > 0:
            n -= 1
            c, i, j = stack[n], stack[n] // ways.n_y, stack[n] % ways.n_y
            length = ways.lengths[bend] + math.hypot(i + 0.5 - x, j + 0.5 - y)
            if length - HALF_DIAGONAL > known[c] or not _in_shadow(ways, ends, bend, i, j):
                continue
            wall = _wall_between(ways, x, y, i - MARGIN, j - MARGIN)
            if wall >= 0 and _hides(ways.walls, wall, x, y, i, j):
                continue
            if wall < 0 and ways.wall_begins[c] == ways.wall_begins[c + 1]:
                # By way of the corner of the cell that the bend sees.
                known[c] = min(known[c], length + 3.1 * HALF_DIAGONAL)
            rows.append((float(c), float(bend), length))
            for a in range(max(i - 1, 1), min(i + 2, ways.n_x - 1)):
                for near in range(a * ways.n_y + max(j - 1, 1), a * ways.n_y + min(j + 2, ways.n_y - 1)):
                    if reached[near] != bend:
                        reached[near], stack[n] = bend, near
                        n += 1
    return np.array(rows)


@numba.njit(cache=True)
def _in_shadow(ways: Ways, ends: FloatArray, bend: int, i: int, j: int) -> bool:
    """Tell whether ways from places in cell (i, j) can turn round a bend towards the next one."""
    if bend == 0:
        return True
    x, y = ways.bends[bend]
    on_x, on_y = ways.bends[ways.onward[bend], 0] - x, ways.bends[ways.onward[bend], 1] - y
    gap = math.hypot(on_x, on_y)
    on_x, on_y = on_x / gap, on_y / gap
    side = on_x * (ends[bend, 1] + ends[bend, 3]) - on_y * (ends[bend, 0] + ends[bend, 2])
    turn = 1.0 if side > 0.0 else -1.0  # counter-clockwise, if the walls are on the left
    dx, dy = x - (i + 0.5), y - (j + 0.5)
    for ux, uy in ((on_x, on_y), (ends[bend, 0], ends[bend, 1]), (ends[bend, 2], ends[bend, 3])):
        if turn * (dx * uy - dy * ux) < -0.5 * (abs(ux) + abs(uy)) - MARGIN:
            return False
    return True


@numba.njit(cache=True)
def _hides(walls: FloatArray, wall: int, x: float, y: float, i: int, j: int) -> bool:
    """Tell whether a wall hides all of cell (i, j) from (x, y): all four corners."""
    for a in (i - MARGIN, i + 1 + MARGIN):
        for b in (j - MARGIN, j + 1 + MARGIN):
            if not _crosses(walls, wall, x, y, a, b):
                return False
    return True
