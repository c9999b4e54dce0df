"""The Laplace potential of the free space of a workspace (section 2 of the paper, in space)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arguments import check_at_least
from hrsnake_env.errors import InputError
from planners.kernels.spatial_field import IndexArray, add_slowest_modes, flood, neighbours_of, relax
from planners.kernels.types import BoolArray, FloatArray, IntArray
from planners.spatial.panel import AXES
from planners.spatial.workspace import Workspace

__all__ = ["Potential", "laplace_potential"]

CELLS_PER_ROOM, CELLS_PER_WINDOW = 40.0, 6.0
"""Grid cells across the room's shortest side, and across the narrowest window of a panel."""

ROUND_NUMBERS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Cells are these times a power of ten: walls are mostly at round coordinates, and on nodes lose nothing."""

MANY_NODES, MAX_NODES = 2_000_000, 12_000_000
"""Up to how many nodes the grid is made fine for windows, and how many there may be at all."""

HALVINGS = 2
"""How often to try a cell half as large if the grid has no way."""

TOLERANCE = 1e-6
"""Largest change of u in the last sweep, relative to u at each node."""

MAX_SWEEPS = 5_000

LEVELS, OVERLAP = 390, 130
"""Steps from the goal solved at once, and how many of them once more with the next. From step to step u falls
at most to a sixth, so in one piece by less than 1e304. Cutting u off behind the overlap changes it by 4e-5 at
the overlap's beginning in a hall 80 cells wide and high, and by far less in narrower passages; but what comes
round by a wider way that is longer by more than the overlap is missed there."""

SNAP = 1e-9
"""In cells: how near to a node a wall is on it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Potential:
    """Hold u = 1 - phi on a grid: 1 at the goal, 0 on walls, harmonic elsewhere.

    Parameters
    ----------
    log_u : array, shape (nx, ny, nz)
        Natural logarithm of u at origin + cell (x, y, z); minus infinity on walls, and where the goal cannot
        be reached from. u falls by some twenty decades per room diagonal, more in narrow passages: its
        logarithm has no end.
    origin : array, shape (3,)
        Place of node (0, 0, 0), in workspace units.
    cell : float
        Spacing of the nodes, in workspace units.
    """

    log_u: FloatArray
    origin: FloatArray
    cell: float

    @property
    def u(self) -> FloatArray:
        """The potential itself, shape (nx, ny, nz); 0 also where it is below the smallest number."""
        with np.errstate(under="ignore"):
            return np.exp(self.log_u)

    @property
    def goal_node(self) -> FloatArray:
        """Place of the goal's node, shape (3,), in workspace units."""
        return self.origin + self.cell * np.array(np.unravel_index(np.argmax(self.log_u), self.log_u.shape))


def laplace_potential(
    workspace: Workspace, *, cell: float | None = None, radius: float = 0.0
) -> Potential | None:
    """Solve the discrete Laplace equation with the goal at 1 and the walls at 0.

    The grid starts at the room's low corner. Obstacles are rounded outwards to nodes, so that a line along
    which u rises never enters one. The nodes are numbered by their steps from the goal, and swept in this
    order with Gauss-Seidel over-relaxation, at each node with the weight that is best for a box as large as
    the free space around it. Every sweep carries u to the farthest node, and only adds what is of the size of
    u there: it is accurate relative to itself, down to the smallest numbers.

    Parameters
    ----------
    workspace : Workspace
        The workspace.
    cell : float, optional
        Spacing of the grid, in workspace units. By default a fortieth of the room's shortest side or a sixth
        of the narrowest window, as a round number, and halved up to twice if the grid has no way.
    radius : float
        By which obstacles are grown along each axis, for thick links. In workspace units.

    Returns
    -------
    potential : Potential or None
        None if there is no way from base to goal that the grid resolves: it needs passages at least three
        cells wide, two where walls are on nodes.

    Raises
    ------
    InputError
        If the cell is not positive or needs too many nodes, or the radius is negative.
    """
    check_at_least("radius", radius, 0.0)
    for size in _default_cells(workspace) if cell is None else [_checked_cell(workspace, cell)]:
        free = _free_nodes(workspace, size, radius)
        stride_x, stride_y = free.shape[1] * free.shape[2], free.shape[2]
        strides = np.array([stride_x, stride_y, 1])
        goals = _free_corners(workspace, workspace.goal, free, size)
        if not len(goals):
            continue
        away = np.linalg.norm(workspace.room_low + size * goals - workspace.goal, axis=1)
        order, levels = flood(free.ravel(), stride_x, stride_y, int(goals[np.argmin(away)] @ strides))
        start = workspace.base + workspace.straight * workspace.heading
        if np.isin(_free_corners(workspace, start, free, size) @ strides, order).any():
            neighbours = neighbours_of(order, free.size, stride_x, stride_y)
            log_u = np.full(free.size, -np.inf)
            log_u[order] = _solve(levels, neighbours, _weights(free, order))
            return Potential(log_u=log_u.reshape(free.shape), origin=workspace.room_low, cell=size)
    return None


def _n_nodes(workspace: Workspace, cell: float) -> float:
    return float(np.prod((workspace.room_high - workspace.room_low) / cell + 2.0))


def _default_cells(workspace: Workspace) -> list[float]:
    """Return the spacings to try, in turn."""
    room = workspace.room_high - workspace.room_low
    windows = [
        np.delete(panel.window_high - panel.window_low, AXES.index(panel.normal)).min()
        for panel in workspace.panels
    ]
    fine = min([room.min() / CELLS_PER_ROOM, *(window / CELLS_PER_WINDOW for window in windows)])
    wanted = max(fine, float(np.prod(room) / MANY_NODES) ** (1.0 / 3.0))
    decade = 10.0 ** math.floor(math.log10(wanted))
    cell = min((decade * number for number in ROUND_NUMBERS), key=lambda size: abs(math.log(size / wanted)))
    cells = [cell / 2**k for k in range(HALVINGS + 1)]
    return [size for size in cells if size == cell or _n_nodes(workspace, size) <= MAX_NODES]


def _checked_cell(workspace: Workspace, cell: float) -> float:
    check_at_least("cell", cell, 0.0)
    if cell == 0.0 or _n_nodes(workspace, cell) > MAX_NODES:
        raise InputError(
            f"Expected a cell that fills workspace '{workspace.name}' with at most {MAX_NODES:,} nodes, got "
            f"{cell:g}."
        )
    return float(cell)


def _free_nodes(workspace: Workspace, cell: float, radius: float) -> BoolArray:
    """Mark the nodes that are not in an obstacle rounded outwards, nor on an outer face."""
    low = workspace.room_low
    shape = np.ceil((workspace.room_high - low) / cell - SNAP).astype(int) + 1
    free = np.zeros(np.maximum(shape, 2), dtype=bool)
    free[1:-1, 1:-1, 1:-1] = True
    first = np.floor((workspace.obstacles[:, 0] - radius - low) / cell + SNAP)
    last = np.ceil((workspace.obstacles[:, 1] + radius - low) / cell - SNAP)
    for a, b in zip(np.maximum(first, 0).astype(int), (last + 1).astype(int), strict=True):
        if (b > 0).all():
            free[a[0] : b[0], a[1] : b[1], a[2] : b[2]] = False
    return free


def _free_corners(workspace: Workspace, place: FloatArray, free: BoolArray, cell: float) -> IntArray:
    """Return the free nodes around a place in the room, shape (n, 3): at most eight."""
    where = (place - workspace.room_low) / cell
    pairs = [sorted({math.floor(value + SNAP), math.ceil(value - SNAP)}) for value in where]
    corners = np.stack([axis.ravel() for axis in np.meshgrid(*pairs, indexing="ij")], axis=1)
    return np.asarray(corners[free[tuple(corners.T)]])


def _weights(free: BoolArray, order: IntArray) -> FloatArray:
    """Return the over-relaxation of each node in `order`."""
    modes = np.zeros(free.shape)
    for axis in range(3):
        add_slowest_modes(np.moveaxis(free, axis, 2), np.moveaxis(modes, axis, 2))
    slowest = modes.ravel()[order]
    return np.asarray(2.0 / (1.0 + np.sqrt(1.0 - slowest**2)))


def _solve(levels: IntArray, neighbours: IndexArray, weights: FloatArray) -> FloatArray:
    """Return log u in the order of the flood, solving `LEVELS` at a time with u scaled to 1 at their rim."""
    u, log_u, log_scale = np.zeros(len(weights) + 1), np.zeros(len(weights)), 0.0
    u[0] = 1.0
    done, n_levels = 1, len(levels) - 1
    while done < n_levels:
        end = min(done + LEVELS, n_levels)
        part = slice(levels[done], levels[end])
        _relax(u, neighbours[part], weights[part], int(levels[done]))
        kept = end if end == n_levels else end - OVERLAP
        part = slice(levels[done], levels[kept])
        log_u[part] = np.log(u[part]) + log_scale
        done = kept
        scale = u[levels[done - 1] : levels[done]].max()
        u[levels[done - 1] :] /= scale
        log_scale += math.log(scale)
    return log_u


def _relax(u: FloatArray, neighbours: IndexArray, weights: FloatArray, first: int) -> None:
    for share in (1.0, 0.5, 0.0):
        # Over-relaxation with weights that differ is not proved to settle; without any it is.
        over = 1.0 + share * (weights - 1.0)
        if relax(u, neighbours, over, first, TOLERANCE, MAX_SWEEPS):
            return
        u[first : first + len(weights)] = 0.0
    raise RuntimeError(f"The potential has not settled within {MAX_SWEEPS} sweeps.")
