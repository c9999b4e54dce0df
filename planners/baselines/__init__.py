"""Planners of others, for comparison: functions of a query like ours, before the same checker."""

from __future__ import annotations

from collections.abc import Callable

from planners.baselines.ompl_sampling import plan_aorrtc, plan_rrt_connect
from planners.baselines.path_following import plan_path_following
from planners.problem import Candidate
from planners.query import Query

__all__ = ["BASELINES"]

BASELINES: dict[str, Callable[[Query], Candidate]] = {
    "follow": plan_path_following,
    "rrt-connect": plan_rrt_connect,
    "aorrtc": plan_aorrtc,
}
"""All baselines by name."""
