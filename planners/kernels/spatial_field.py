"""Kernels of the Laplace potential in space: flood fill, over-relaxation, steepest ascent.

Grids are flat arrays in C order, the node (x, y, z) at x * stride_x + y * stride_y + z. The caller guarantees
that the outermost nodes are walls.
"""

import math

import numba
import numpy as np
from numpy.typing import NDArray

from planners.kernels.types import BoolArray, FloatArray, IntArray

IndexArray = NDArray[np.uint32]

SIXTH = 1.0 / 6.0

EVERY = 5
"""Sweeps from one look at the change to the next."""

TRIES, SHORTER = 40, 0.8
"""How often the ascent tries a step, each time so much shorter, until u rises; then it gives up."""


@numba.njit(cache=True)
def flood(free: BoolArray, stride_x: int, stride_y: int, goal: int) -> tuple[IntArray, IntArray]:
    """Order the free nodes by how many steps from the goal they are.

    Parameters
    ----------
    free : array, shape (n_nodes,)
        False at walls.
    stride_x, stride_y : int
        Of the flat array.
    goal : int
        A free node.

    Returns
    -------
    order : array, shape (n_reached,)
        The nodes that can be reached, nearest first.
    levels : array, shape (n_levels + 1,)
        Those at k steps are order[levels[k] : levels[k + 1]].
    """
    seen = ~free
    order = np.empty(free.size, dtype=np.int64)
    levels = np.empty(free.size + 1, dtype=np.int64)
    order[0], seen[goal], levels[0] = goal, True, 0
    begin, end, n_levels = 0, 1, 0
    while begin < end:
        tail = end
        for k in range(begin, end):
            i = order[k]
            for j in (i - stride_x, i - stride_y, i - 1, i + 1, i + stride_y, i + stride_x):
                if not seen[j]:
                    seen[j] = True
                    order[tail] = j
                    tail += 1
        begin, end = end, tail
        n_levels += 1
        levels[n_levels] = begin
    return order[:end].copy(), levels[: n_levels + 1].copy()


@numba.njit(cache=True)
def add_slowest_modes(free: BoolArray, modes: FloatArray) -> None:
    """Add cos(pi / (n + 1)) / 3 to each of n free nodes in a row along the last axis.

    Summed over the three axes, this is the factor by which the Jacobi iteration damps the slowest mode of a
    box as wide as the free space at a node.

    Parameters
    ----------
    free : array, shape (nx, ny, nz)
        False at walls.
    modes : array, shape (nx, ny, nz)
        Added to.
    """
    nx, ny, nz = free.shape
    for x in range(nx):
        for y in range(ny):
            begin = 0
            while begin < nz:
                if not free[x, y, begin]:
                    begin += 1
                    continue
                end = begin
                while free[x, y, end]:
                    end += 1
                value = math.cos(math.pi / (end - begin + 1)) / 3.0
                for z in range(begin, end):
                    modes[x, y, z] += value
                begin = end


@numba.njit(cache=True)
def neighbours_of(order: IntArray, n_nodes: int, stride_x: int, stride_y: int) -> IndexArray:
    """Look up the six neighbours of each node by their places in `order`.

    Parameters
    ----------
    order : array, shape (n,)
        Nodes of the grid.
    n_nodes : int
        Of the grid.
    stride_x, stride_y : int
        Of the flat array.

    Returns
    -------
    neighbours : array, shape (n, 6)
        n for a node that is not in `order`.
    """
    place = np.full(n_nodes, order.size, dtype=np.uint32)
    for k in range(order.size):
        place[order[k]] = k
    # Without a sign: a sweep need not ask whether an index counts from the end, which halves its time.
    neighbours = np.empty((order.size, 6), dtype=np.uint32)
    for k in range(order.size):
        i = order[k]
        neighbours[k, 0], neighbours[k, 1] = place[i - stride_x], place[i + stride_x]
        neighbours[k, 2], neighbours[k, 3] = place[i - stride_y], place[i + stride_y]
        neighbours[k, 4], neighbours[k, 5] = place[i - 1], place[i + 1]
    return neighbours


@numba.njit(cache=True)
def relax(
    u: FloatArray,
    neighbours: IndexArray,
    weights: FloatArray,
    first: int,
    tolerance: float,
    max_sweeps: int,
) -> int:
    """Bring u to the mean of its six neighbours, by over-relaxed Gauss-Seidel sweeps.

    Parameters
    ----------
    u : array, shape (n_reached + 1,)
        At the nodes in the order of `flood`, in which each sweep carries u from the goal all the way; the
        last value is that at walls. Changed in place.
    neighbours : array, shape (n, 6)
        Of each node to sweep, as `neighbours_of` returns them.
    weights : array, shape (n,)
        Over-relaxation of each, from 1 to below 2.
    first : int
        The first node to sweep. Those before and behind the n nodes keep their u.
    tolerance : float
        Change of u, relative to u itself at each node, below which to stop.
    max_sweeps : int
        When to give up.

    Returns
    -------
    n_sweeps : int
        0 if it gave up.
    """
    for sweep in range(1, max_sweeps + 1):
        settled = True
        looks = sweep % EVERY == 0
        for k in range(len(neighbours)):
            # Written out: an array for the row of neighbours would cost half as much again.
            mean = SIXTH * (
                u[neighbours[k, 0]]
                + u[neighbours[k, 1]]
                + u[neighbours[k, 2]]
                + u[neighbours[k, 3]]
                + u[neighbours[k, 4]]
                + u[neighbours[k, 5]]
            )
            change = mean - u[first + k]
            u[first + k] += weights[k] * change
            if looks and not abs(change) < tolerance * mean:
                settled = False
        if looks and settled:
            return sweep
    return 0


@numba.njit(cache=True)
def rise(log_u: FloatArray, x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Interpolate u linearly along each axis: its logarithm, and the unit vector of steepest ascent.

    Parameters
    ----------
    log_u : array, shape (nx, ny, nz)
        Natural logarithm; minus infinity at walls.
    x, y, z : float
        In cells from node (0, 0, 0).

    Returns
    -------
    log_u, dx, dy, dz : float
        All zero, and the logarithm minus infinity, where u is 0 at all eight corners, off the grid, and
        where u is flat.
    """
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    nx, ny, nz = log_u.shape
    if not (0 <= i < nx - 1 and 0 <= j < ny - 1 and 0 <= k < nz - 1):
        return -np.inf, 0.0, 0.0, 0.0
    top = -np.inf
    for corner in range(8):
        top = max(top, log_u[i + (corner >> 2), j + (corner >> 1 & 1), k + (corner & 1)])
    if top == -np.inf:
        return -np.inf, 0.0, 0.0, 0.0
    value, gx, gy, gz = 0.0, 0.0, 0.0, 0.0
    for corner in range(8):
        a, b, c = corner >> 2, corner >> 1 & 1, corner & 1
        # Relative to the highest corner: u itself may be below the smallest number.
        u = math.exp(log_u[i + a, j + b, k + c] - top)
        wx, wy, wz = 1.0 - abs(x - i - a), 1.0 - abs(y - j - b), 1.0 - abs(z - k - c)
        value += u * wx * wy * wz
        gx += u * (2 * a - 1) * wy * wz
        gy += u * wx * (2 * b - 1) * wz
        gz += u * wx * wy * (2 * c - 1)
    length = math.sqrt(gx * gx + gy * gy + gz * gz)
    if length == 0.0 or value <= 0.0:
        return -np.inf, 0.0, 0.0, 0.0
    return top + math.log(value), gx / length, gy / length, gz / length


@numba.njit(cache=True)
def ascend_in_space(
    log_u: FloatArray, start: FloatArray, goal: FloatArray, step: float, stop: float
) -> FloatArray:
    """Follow the steepest ascent of u from start to goal, by the midpoint rule (Eq. 3 of the paper).

    Parameters
    ----------
    log_u : array, shape (nx, ny, nz)
        Natural logarithm of u, largest at the goal's node; minus infinity at walls.
    start, goal : array, shape (3,)
        In cells from node (0, 0, 0).
    step, stop : float
        Largest length of a step, and distance from the goal at which to end, in cells.

    Returns
    -------
    points : array, shape (n, 3)
        In cells, from the start to within `stop` of the goal; u rises from each to the next. Empty if the
        ascent ended before.
    """
    points = np.empty((1024, 3))
    x, y, z = start[0], start[1], start[2]
    value, dx, dy, dz = rise(log_u, x, y, z)
    n = 0
    while value > -np.inf:
        if n == len(points):
            more = np.empty((2 * n, 3))
            more[:n] = points
            points = more
        points[n, 0], points[n, 1], points[n, 2] = x, y, z
        n += 1
        if (x - goal[0]) ** 2 + (y - goal[1]) ** 2 + (z - goal[2]) ** 2 <= stop * stop:
            return points[:n].copy()
        half, far = 0.5 * step, step
        _, sx, sy, sz = rise(log_u, x + half * dx, y + half * dy, z + half * dz)
        now, value = value, -np.inf
        for _ in range(TRIES):
            length = max(math.sqrt(sx * sx + sy * sy + sz * sz), 1e-12)
            px, py, pz = x + far * sx / length, y + far * sy / length, z + far * sz / length
            there, dx, dy, dz = rise(log_u, px, py, pz)
            if there > now:
                x, y, z, value = px, py, pz, there
                break
            # The step has crossed a ridge of u: the way along it is between the slopes on its sides. Adding
            # those met so far finds a direction that rises on all of them, as a perceptron does.
            far *= SHORTER
            sx, sy, sz = sx + dx, sy + dy, sz + dz
    return points[:0].copy()
