"""Planners of others, for comparison: functions of a query like ours, before the same checker."""

from __future__ import annotations

from collections.abc import Callable

from planners.baselines.b_spline import plan_b_spline
from planners.baselines.backbone import plan_backbone
from planners.baselines.ompl_sampling import plan_aorrtc, plan_rrt_connect
from planners.baselines.outer_wall import plan_outer_wall
from planners.baselines.path_following import plan_path_following
from planners.baselines.pseudo_inverse import plan_pseudo_inverse
from planners.baselines.virtual_torque import plan_virtual_torque
from planners.problem import Candidate
from planners.query import Query

__all__ = ["BASELINES"]

BASELINES: dict[str, Callable[[Query], Candidate]] = {
    "follow": plan_path_following,
    "outer-wall": plan_outer_wall,
    "b-spline": plan_b_spline,
    "backbone": plan_backbone,
    "virtual-torque": plan_virtual_torque,
    "pseudo-inverse": plan_pseudo_inverse,
    "rrt-connect": plan_rrt_connect,
    "aorrtc": plan_aorrtc,
}
"""All baselines by name."""
