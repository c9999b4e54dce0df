"""Steps of an arm on which forces act.

The arm moves as a viscous medium would that holds its control points: the velocity v solves
(J^T J + R) v = J^T F, where F are the forces on the control points and on the places nearest to walls, and R
holds a little friction and, for the stiff repulsion of walls, its slope, so that steps need not be tiny.
Lengths and coordinates are those of `planners.kernels.field_arm`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.fed_arm import keeps_off
from planners.kernels.field_algebra import factorise
from planners.kernels.field_arm import (
    RELEASE,
    add_torques,
    contact_row,
    fill_drag,
    find_contacts,
    keep_limits,
    place_controls,
    place_points,
)
from planners.kernels.types import FloatArray, IntArray

GOING, DONE, STUCK, FULL = range(4)
"""How a run ends: not yet, at the goal, without progress, with the whole arm out."""

STEP = 0.025
"""Wanted movement of the fastest joint in a step, in link lengths."""

LONGEST = 0.03
"""Largest movement of a joint in a step, in link lengths."""

KEPT = 0.3
"""Share of a distance to a wall, beyond the margin, that a step leaves at least, to first order."""

MARGIN = 1e-3
"""Smallest distance of links to walls, in link lengths."""

HALVINGS = 6
"""A step that is not free is halved at most this often."""

RIDGE = 0.02
"""Friction of feed and joints, over that of a control point that is a link length away."""


class Task(NamedTuple):
    """What an arm is to do where.

    Attributes
    ----------
    walls : array, shape (n_walls, 2, 2)
        Segments of closed rings.
    heading : float
        Of the feeder's axis, in rad.
    most_bent : float
        Largest joint angle, in rad.
    goal : array, shape (2,)
        For the tip.
    stop : float
        Distance of the tip from the goal that is near enough.
    per_link : int
        Control points of a link.
    barrier : float
        Strength of the repulsion by walls.
    reach : float
        Distance at which it begins.
    lead : float
        How many control points the tip counts for beyond its own.
    """

    walls: FloatArray
    heading: float
    most_bent: float
    goal: FloatArray
    stop: float
    per_link: int
    barrier: float
    reach: float
    lead: float


class Run(NamedTuple):
    """An arm on its way, and its work space.

    Attributes
    ----------
    state : array, shape (n,)
        As in `planners.kernels.field_arm`.
    points : array, shape (n, 2)
        Of that state.
    contacts : array, shape (n_max, 6)
        Of that state.
    best : array, shape (2,)
        Greatest progress so far, and the steps since then.
    nearest : array, shape (n per_link,)
        For each control point the place of the path that is nearest to it.
    places, forces : array, shape (n per_link, 2)
        Of control points.
    links : array, shape (n per_link,)
        Of control points.
    matrix : array, shape (n, n)
    vectors : array, shape (5, n)
    trial, chain : array, shape (n,), (n + 1, 2)
    """

    state: FloatArray
    points: FloatArray
    contacts: FloatArray
    best: FloatArray
    nearest: IntArray
    places: FloatArray
    forces: FloatArray
    links: IntArray
    matrix: FloatArray
    vectors: FloatArray
    trial: FloatArray
    chain: FloatArray


@njit(cache=True)
def place(task: Task, run: Run) -> tuple[int, int, int, float]:
    """Place the arm of a run's state, its control points and its contacts.

    Returns
    -------
    k, n_controls, n_contacts : int
        Joints past the base, control points, contacts.
    least : float
        Distance to the walls, up to the reach.
    """
    k = place_points(run.state, task.heading, run.points)
    n = place_controls(run.state, run.points, k, task.heading, task.per_link, run.places, run.links)
    n_contacts, least = find_contacts(run.points, k, task.walls, task.reach, run.contacts)
    return k, n, n_contacts, least


@njit(cache=True)
def _held(task: Task, state: FloatArray, i: int, torque: float) -> bool:
    """Tell whether a joint is pressed against its limit."""
    limit = min(RELEASE * (state[0] - i), task.most_bent)
    return bool(abs(state[i]) >= limit - 1e-9 and torque * state[i] >= 0.0)


@njit(cache=True)
def assemble(task: Task, run: Run, k: int, n: int, n_contacts: int) -> None:
    """Compute what moves the arm, and the factor of the matrix of a step.

    Filled are vectors[0], torques of the forces on control points; vectors[4], torques of walls; vectors[1],
    1 for coordinates that move and 0 for joints pressed against their limits, which get no torques.
    """
    torques, moves, row, pushes = run.vectors[0], run.vectors[1], run.vectors[2], run.vectors[4]
    for a in range(k + 1):
        torques[a], moves[a], pushes[a] = 0.0, 1.0, 0.0
    for axis in range(2):
        run.forces[0, axis] *= 1.0 + task.lead
    add_torques(run.points, k, task.heading, run.places, run.links, run.forces, n, torques)
    fill_drag(run.points, k, task.heading, run.places, run.links, n, RIDGE * task.per_link, run.matrix)
    for c in range(n_contacts):
        gap = max(run.contacts[c, 4] - MARGIN, 0.01 * MARGIN)  # stiff before it is too small
        force = task.barrier * task.per_link * (1.0 / gap - 1.0 / task.reach)
        slope = STEP * task.barrier * task.per_link / gap**2
        contact_row(run.contacts[c], run.points, k, task.heading, row)
        for a in range(k + 1):
            pushes[a] += force * row[a]
            for b in range(a + 1):
                run.matrix[a, b] += slope * row[a] * row[b]
    for a in range(1, k + 1):
        if _held(task, run.state, a, torques[a] + pushes[a]):
            torques[a], pushes[a], moves[a] = 0.0, 0.0, 0.0
            for b in range(k + 1):
                if b <= a:
                    run.matrix[a, b] = 0.0
                else:
                    run.matrix[b, a] = 0.0
            run.matrix[a, a] = 1.0
    factorise(run.matrix, k + 1)


@njit(cache=True)
def _longest_move(before: FloatArray, k: int, after: FloatArray, k_after: int, feed: float) -> float:
    longest = abs(feed)  # of what is in the feeder
    for i in range(min(k, k_after) + 1):
        longest = max(longest, np.hypot(after[i, 0] - before[i, 0], after[i, 1] - before[i, 1]))
    return longest


@njit(cache=True)
def _free_share(task: Task, run: Run, k: int, n_contacts: int, velocity: FloatArray, time: float) -> float:
    """Return the part of a step after which no distance to a wall has shrunk too much, to first order."""
    row, share = run.vectors[2], 1.0
    for c in range(n_contacts):
        contact_row(run.contacts[c], run.points, k, task.heading, row)
        opening = 0.0
        for a in range(k + 1):
            opening += row[a] * velocity[a]
        room = (1.0 - KEPT) * max(run.contacts[c, 4] - MARGIN, 0.0)
        if -opening * time > room:
            share = min(share, room / (-opening * time))
    return share


@njit(cache=True)
def advance(task: Task, run: Run, k: int, n_contacts: int, velocity: FloatArray, stop: float) -> bool:
    """Move the arm with a velocity, for as long as limits, walls and the arm itself allow.

    Parameters
    ----------
    task, run
        The run's state and points are moved.
    k, n_contacts
        Of the run's state.
    velocity : array, shape (at least k + 1,)
        Of feed and joint angles.
    stop : float
        Movement of the tip that is wanted at most.

    Returns
    -------
    moved : bool
        Whether the arm could move.
    """
    fastest = abs(velocity[0])
    x, y = velocity[0] * np.cos(task.heading), velocity[0] * np.sin(task.heading)
    for i in range(k, 0, -1):
        turn = 0.0
        for a in range(i, k + 1):
            turn += velocity[a]
        x -= turn * (run.points[i - 1, 1] - run.points[i, 1])
        y += turn * (run.points[i - 1, 0] - run.points[i, 0])
        fastest = max(fastest, np.hypot(x, y))
    if fastest < 1e-9:
        return False
    time = min(min(STEP, stop) / fastest, 4.0 * STEP)
    time *= _free_share(task, run, k, n_contacts, velocity, time)
    feed = run.state[0]
    least_feed = max(np.ceil(feed) - 1.0, 1.0)
    for _ in range(HALVINGS):
        run.trial[:] = run.state
        # A joint passes the base at a pose: between poses angles would be ahead of what the feeder allows.
        run.trial[0] = min(max(feed + time * velocity[0], least_feed), np.floor(feed) + 1.0)
        for a in range(1, k + 1):
            run.trial[a] += time * velocity[a]
        keep_limits(run.trial, task.most_bent)
        k_after = place_points(run.trial, task.heading, run.chain)
        moved = _longest_move(run.points, k, run.chain, k_after, run.trial[0] - feed)
        _, least = find_contacts(run.chain, k_after, task.walls, task.reach, run.contacts)
        if moved <= LONGEST and least >= MARGIN and not _crosses_itself(run.chain, k_after + 1):
            run.state[:] = run.trial
            return bool(moved > 0.0)
        time *= 0.5
    return False


@njit(cache=True)
def _crosses_itself(points: FloatArray, n: int) -> bool:
    """Tell whether two links of a chain of n points meet that are not neighbours."""
    for k in range(n - 1):
        for other in range(k + 2, n - 1):
            if not keeps_off(points[k], points[k + 1], points[other], points[other + 1], 0.0):
                return True
    return False


@njit(cache=True)
def push_straight(task: Task, run: Run, states: FloatArray) -> tuple[int, int]:
    """Push the first link out of the feeder; arguments and results as in `field_moves.descend`."""
    n = int(np.ceil(1.0 / STEP))
    for m in range(n + 1):
        run.state[0] = m / n
        states[m] = run.state
        k = place_points(run.state, task.heading, run.points)
        if np.hypot(run.points[0, 0] - task.goal[0], run.points[0, 1] - task.goal[1]) <= task.stop:
            return m + 1, DONE
        if k != 0:
            break
    return n + 1, GOING
