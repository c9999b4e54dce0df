"""Pseudo-inverse velocity control with attractive poles, as others do it, to compare with.

The paper's introduction says of its reference [20]: a method "where pseudo-inverse velocity control is
combined with the attractive poles concept can be used in enclosed workspaces".

What is ours is what the paper does not say. The tip's velocity leads along the global path that all planners
here begin with. Feed and joint angles follow by a damped pseudo-inverse; in its null space control points on
all links are drawn to poles, which run ahead of them on the path, and away from walls that are near. The
pseudo-inverse is weighted with the metric of the control points' movements: in plain joint angles the joints
near the base, with their long levers, would do all the work.
"""

from __future__ import annotations

import math

import numpy as np

from planners.baselines.field_runs import Gains, base_frame, plan_by_forces
from planners.kernels import field_moves as kernel
from planners.kernels.field_steps import Run, Task
from planners.kernels.types import FloatArray
from planners.problem import Candidate
from planners.query import Query

__all__ = ["ATTEMPTS", "PER_LINK", "SPACING", "plan_pseudo_inverse"]

PER_LINK = 12
"""Control points of a link, each with a pole."""

SPACING = 0.02
"""Distance of the path's points, in link lengths."""

ATTEMPTS = (
    Gains(barrier=0.05, reach=0.3, ahead=0.2, poles_ahead=0.2, damping=0.05),
    Gains(barrier=0.05, reach=0.3, ahead=0.2, poles_ahead=0.05, damping=0.12),
    Gains(barrier=0.1, reach=0.5, ahead=0.2, poles_ahead=0.05, damping=0.12),
    Gains(barrier=0.05, reach=0.3, ahead=0.1, poles_ahead=0.05, damping=0.08),
    Gains(barrier=0.01, reach=0.15, ahead=0.2, poles_ahead=0.1, damping=0.15),
    Gains(barrier=0.02, reach=0.15, ahead=0.1, poles_ahead=0.1, damping=0.3),
)
"""Gains that are tried in turn."""


def plan_pseudo_inverse(query: Query) -> Candidate:
    """Plan by leading the tip along the path, and the links behind it towards poles.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; the warm start is not used.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs that the query's checker has accepted, if it has one; the
        least bad one; or where the tip makes no progress.
    """
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    points = base_frame(geometry.path.points, query)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    even = np.linspace(0.0, arc[-1], math.ceil(arc[-1] / SPACING) + 2)
    path = np.column_stack([np.interp(even, arc, points[:, axis]) for axis in range(2)])
    spacing = max(float(even[1]), 1e-9)

    def move(task: Task, run: Run, gains: Gains, states: FloatArray) -> tuple[int, int]:
        ahead, poles_ahead = (max(1, round(way / spacing)) for way in (gains.ahead, gains.poles_ahead))
        return kernel.lead_tip(task, run, path, spacing, ahead, poles_ahead, gains.damping, states)

    return plan_by_forces(query, move, ATTEMPTS, PER_LINK)
