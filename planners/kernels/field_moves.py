"""Two ways to move an arm: by a field's forces on its links, and by leading its tip along a path."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.field_algebra import redundant_velocity, solve_lower, solve_upper
from planners.kernels.field_steps import DONE, FULL, GOING, STUCK, Run, Task, advance, assemble, place
from planners.kernels.grid import _node_ascent
from planners.kernels.types import BoolArray, FloatArray

PATIENCE = 300
"""Steps without progress after which a run is stuck."""


@njit(cache=True)
def fill_field(u: FloatArray, blocked_x: BoolArray, blocked_y: BoolArray, field: FloatArray) -> None:
    """Compute the direction in which a potential rises at each node.

    Parameters
    ----------
    u, blocked_x, blocked_y
        As in `planners.potential.Potential`.
    field : array, shape (ny, nx, 2)
        Filled with unit vectors, and zeros where there is no direction.
    """
    for j in range(1, u.shape[0] - 1):
        for i in range(1, u.shape[1] - 1):
            x, y = _node_ascent(u, blocked_x, blocked_y, j, i)
            size = max(np.hypot(x, y), 1e-300)
            field[j, i, 0], field[j, i, 1] = x / size, y / size


@njit(cache=True)
def field_at(field: FloatArray, x: float, y: float) -> tuple[float, float]:
    """Interpolate a field at a place in cells; zero outside of the grid."""
    i, j = int(np.floor(x)), int(np.floor(y))
    gx, gy = 0.0, 0.0
    if 0 <= i < field.shape[1] - 1 and 0 <= j < field.shape[0] - 1:
        for dj in range(2):
            for di in range(2):
                weight = (1.0 - abs(x - i - di)) * (1.0 - abs(y - j - dj))
                gx += weight * field[j + dj, i + di, 0]
                gy += weight * field[j + dj, i + di, 1]
    return gx, gy


@njit(cache=True)
def _noted(run: Run, progress: float, least: float) -> bool:
    """Note progress; tell whether there has been none for too long."""
    if progress > run.best[0] + least:
        run.best[0], run.best[1] = progress, 0.0
    run.best[1] += 1.0
    return bool(run.best[1] > PATIENCE)


@njit(cache=True)
def descend(
    task: Task,
    run: Run,
    u: FloatArray,
    field: FloatArray,
    origin: FloatArray,
    cell: float,
    states: FloatArray,
) -> tuple[int, int]:
    """Let the field's forces on control points move the arm (virtual torques).

    Parameters
    ----------
    task, run
        The run goes on from where it was.
    u : array, shape (ny, nx)
        A potential that rises towards the goal.
    field : array, shape (ny, nx, 2)
        Its directions (`fill_field`).
    origin, cell
        Place of node (0, 0), and spacing of the nodes.
    states : array, shape (n_max, n)
        Filled with the states gone through.

    Returns
    -------
    n : int
        Number of states.
    ending : int
        One of GOING, DONE, STUCK and FULL.
    """
    velocity = run.vectors[3]
    for m in range(states.shape[0]):
        k, n, n_contacts, _ = place(task, run)
        away = np.hypot(run.points[0, 0] - task.goal[0], run.points[0, 1] - task.goal[1])
        if away <= task.stop:
            return m, DONE
        if run.state[0] >= run.state.shape[0] - 1.0:
            return m, FULL
        for c in range(n):
            x, y = (run.places[c, 0] - origin[0]) / cell, (run.places[c, 1] - origin[1]) / cell
            run.forces[c, 0], run.forces[c, 1] = field_at(field, x, y)
        x, y = (run.points[0, 0] - origin[0]) / cell, (run.points[0, 1] - origin[1]) / cell
        here = u[int(np.rint(y)), int(np.rint(x))]
        if _noted(run, np.log(max(here, 1e-308)) - away * 1e-6, 1e-4):
            return m, STUCK
        assemble(task, run, k, n, n_contacts)
        for a in range(k + 1):
            velocity[a] = run.vectors[0, a] + run.vectors[4, a]
        solve_lower(run.matrix, k + 1, velocity)
        solve_upper(run.matrix, k + 1, velocity)
        if not advance(task, run, k, n_contacts, velocity, max(0.5 * away, 0.1 * task.stop)):
            return m, STUCK
        states[m] = run.state
    return states.shape[0], GOING


@njit(cache=True)
def _climb(path: FloatArray, at: int, x: float, y: float, look: int) -> int:
    """Return the place of a path, from one nearby on, that is nearest to a point."""
    while True:
        best, least = at, np.hypot(path[at, 0] - x, path[at, 1] - y)
        for other in range(max(at - look, 0), min(at + look + 1, path.shape[0])):
            away = np.hypot(path[other, 0] - x, path[other, 1] - y)
            if away < least:
                best, least = other, away
        if best == at:
            return at
        at = best


@njit(cache=True)
def _drawn(point: FloatArray, aim: FloatArray, far: float) -> tuple[float, float]:
    """Return the velocity towards an aim: 1 where it is as far as it should be, less where it is nearer."""
    x, y = aim[0] - point[0], aim[1] - point[1]
    size = max(np.hypot(x, y), far)
    return x / size, y / size


@njit(cache=True)
def _draw_to_poles(run: Run, n: int, path: FloatArray, ahead: int, spacing: float) -> None:
    """Draw each control point to its pole: the path some way ahead of the place nearest to it."""
    for c in range(n):
        x, y = run.places[c, 0], run.places[c, 1]
        at = _climb(path, run.nearest[c], x, y, 4)
        run.nearest[c] = at
        pole = path[min(at + ahead, path.shape[0] - 1)]
        run.forces[c, 0], run.forces[c, 1] = _drawn(run.places[c], pole, ahead * spacing)


@njit(cache=True)
def lead_tip(
    task: Task,
    run: Run,
    path: FloatArray,
    spacing: float,
    ahead: int,
    poles_ahead: int,
    damping: float,
    states: FloatArray,
) -> tuple[int, int]:
    """Lead the tip along a path, with the rest of the arm drawn to poles in the null space of its velocity.

    Parameters
    ----------
    task, run, states
        As in `descend`.
    path : array, shape (n_path, 2)
        From the base to the goal, in even steps.
    spacing : float
        Their length.
    ahead, poles_ahead : int
        Steps from the place nearest to the tip to where it is led, and from the place nearest to a control
        point to its pole.
    damping : float
        Of the pseudo-inverse.

    Returns
    -------
    n, ending : int
        As in `descend`.
    """
    velocity = run.vectors[3]
    jacobian = np.empty((2, run.state.shape[0]))
    tip = np.empty(2)
    for m in range(states.shape[0]):
        k, n, n_contacts, _ = place(task, run)
        away = np.hypot(run.points[0, 0] - task.goal[0], run.points[0, 1] - task.goal[1])
        if away <= task.stop:
            return m, DONE
        if run.state[0] >= run.state.shape[0] - 1.0:
            return m, FULL
        _draw_to_poles(run, n, path, poles_ahead, spacing)
        aim = path[min(run.nearest[0] + ahead, path.shape[0] - 1)]
        tip[0], tip[1] = _drawn(run.points[0], aim, ahead * spacing)
        if _noted(run, run.nearest[0] * spacing, 1e-3):
            return m, STUCK
        assemble(task, run, k, n, n_contacts)
        # In coordinates in which the matrix of the step is the identity.
        _fill_tip_jacobian(task, run, k, jacobian)
        wish, pushed = run.vectors[0], run.vectors[4]
        solve_lower(run.matrix, k + 1, wish)
        solve_lower(run.matrix, k + 1, pushed)
        for axis in range(2):
            column = jacobian[axis]
            solve_lower(run.matrix, k + 1, column)
            for a in range(k + 1):
                tip[axis] -= column[a] * pushed[a]
        # What walls do comes first, and as far as damping goes before the tip as well.
        redundant_velocity(jacobian, k + 1, tip, wish, damping, velocity)
        for a in range(k + 1):
            velocity[a] += pushed[a]
        solve_upper(run.matrix, k + 1, velocity)
        if not advance(task, run, k, n_contacts, velocity, max(0.5 * away, 0.1 * task.stop)):
            return m, STUCK
        states[m] = run.state
    return states.shape[0], GOING


@njit(cache=True)
def _fill_tip_jacobian(task: Task, run: Run, k: int, jacobian: FloatArray) -> None:
    """Compute how fast each coordinate moves the tip; those that are held do not."""
    jacobian[0, 0], jacobian[1, 0] = np.cos(task.heading), np.sin(task.heading)
    for a in range(1, k + 1):
        jacobian[0, a] = -run.vectors[1, a] * (run.points[0, 1] - run.points[a, 1])
        jacobian[1, a] = run.vectors[1, a] * (run.points[0, 0] - run.points[a, 0])
