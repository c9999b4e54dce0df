"""Virtual torques: a numerical potential field drags the links, as others do it, to compare with.

The paper's introduction says of its reference [14]: a "numerical potential field [...] navigates the discrete
links of the manipulator through obstacles without any collision by taking advantage of the gradient
descent"; "the algorithm makes the field create virtual torque at the joints of the manipulators", "suffers
from saddle-point traps and [...] is computationally intensive as it necessitates the number of control points
on a link to be as high as possible".

What is ours is what the paper does not say. The field is the Laplace potential that all planners here begin
with, and the force on a control point is along its gradient, of unit size. Where links are near to walls
there are more control points, exactly there, and a force away from the wall. Descent of feed and joint angles
is in the metric of the control points' movements: plain joint angles would make steps a matter of how long
the arm is. Steps allow for how steep the repulsion of walls is (`planners.kernels.field_steps`). The last two
carry the method in tight turns and with many links: what it passes here says nothing about the reference.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from planners.baselines.field_runs import Gains, base_frame, plan_by_forces
from planners.kernels import field_moves as kernel
from planners.kernels.field_steps import Run, Task
from planners.kernels.types import FloatArray
from planners.potential import laplace_potential
from planners.problem import Candidate
from planners.query import Query

__all__ = ["ATTEMPTS", "PER_LINK", "plan_virtual_torque"]

PER_LINK = 10
"""Control points of a link."""

ATTEMPTS = (
    Gains(barrier=0.1, reach=0.5, lead=5.0),
    Gains(barrier=0.01, reach=0.15, lead=10.0),
    Gains(barrier=0.03, reach=0.3, lead=10.0),
    Gains(barrier=0.003, reach=0.15, lead=5.0),
)
"""Gains that are tried in turn."""


def plan_virtual_torque(query: Query) -> Candidate:
    """Plan by descending a potential field with control points on all links.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; warm start and route are not used, the field knows its way.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs that the query's checker has accepted, if it has one; the
        least bad one; or where the arm makes no progress, a saddle of the field for instance.
    """
    query = dataclasses.replace(query, route=None)
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    potential = laplace_potential(geometry.maze, width=geometry.path.width)
    field = np.zeros((*potential.u.shape, 2))
    kernel.fill_field(potential.u, potential.blocked_x, potential.blocked_y, field)
    origin = base_frame(potential.origin, query)
    cell = potential.cell / query.arm.link_length

    def move(task: Task, run: Run, _: Gains, states: FloatArray) -> tuple[int, int]:
        return kernel.descend(task, run, potential.u, field, origin, cell, states)

    return plan_by_forces(query, move, ATTEMPTS, PER_LINK)
