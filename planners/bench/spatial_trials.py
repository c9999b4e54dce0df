"""Plans in space, one by one: how each ends, how deep links get, how long it takes; and longest links."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from hrsnake_env.arm import ArmSpec, FloatArray
from planners.clock import now
from planners.feeding import feed
from planners.kernels.feeding import DONE
from planners.path import arclength
from planners.spatial.causal_planner import plan_causal
from planners.spatial.following import follow_path, mapping_error
from planners.spatial.longest import longest_link
from planners.spatial.path import Path, global_path
from planners.spatial.planning import plan
from planners.spatial.potential import laplace_potential
from planners.spatial.problem import SpatialMotion, SpatialResult
from planners.spatial.query import SpatialQuery, behind_straight
from planners.spatial.rooms import load_workspace, paired_panels
from planners.spatial.validation import signed_distances, validate
from planners.spatial.workspace import Workspace

__all__ = [
    "FOLLOW",
    "farthest_with_horizon",
    "longest_in_panels",
    "longest_in_room",
    "longest_row",
    "time_poses",
    "try_arm",
    "try_links",
    "warm_up_spatial",
]

FOLLOW = "follow"
"""What other planners are compared with."""

TOUCH = 1e-9
"""Depth, in link lengths, up to which a link merely touches."""

TIME_BUDGET = 20.0
"""Seconds that a planner may take for one length where the longest is looked for."""


HORIZON_LENGTHS = tuple(float(length) for length in np.geomspace(50.0, 134.0, 21))
"""Link lengths with which horizons are compared, 5 % apart, in workspace units."""

HORIZON_SECONDS = 5.0
"""Time for each of them."""


def warm_up_spatial() -> None:
    """Load the compiled kernels."""
    workspace = load_workspace("paired-panels")
    for planner in ("follow", "track"):
        plan(workspace, ArmSpec(link_length=90.0), planner)


def try_links(workspace: Workspace, planner: str, link_length: float, runs: int) -> dict[str, Any]:
    """Plan with thin links of one length, and measure the motion, free or not.

    Parameters
    ----------
    workspace : Workspace
        The workspace.
    planner : str
        A key of `planners.spatial.PLANNERS`.
    link_length : float
        In workspace units.
    runs : int
        Timed runs, after one that warms up.

    Returns
    -------
    row : dict
        Status; links and poses, and how many of these collide; depth at poses and its bound between them;
        smallest clearance; lengths of path and track; mapping error of path following; median seconds of a
        pose and of each stage, `whole` for the plan with its check. What is not known is None.
    """
    arm = ArmSpec(link_length=link_length)
    result, seconds = plan(workspace, arm, planner), []
    for _ in range(runs):
        start = time.perf_counter()
        timings = plan(workspace, arm, planner).timings
        seconds.append({**timings, "whole": time.perf_counter() - start})
    potential = laplace_potential(workspace)
    path = None if potential is None else global_path(workspace, potential)
    motion = result.motion
    if motion is None and planner == FOLLOW and path is not None:
        motion = follow_path(path, workspace, link_length)
    return {
        "planner": planner,
        "link_length": link_length,
        "status": str(result.status),
        "path_length": None if path is None else path.length,
        **_motion_figures(motion, workspace),
        **_report_figures(result),
        **_curve_figures(result, workspace, link_length, runs),
        **_mapping(path if planner == FOLLOW else None, link_length),
        "runs": runs,
        "median_s": {key: float(np.median([run[key] for run in seconds])) for key in seconds[0]},
    }


def _motion_figures(motion: SpatialMotion | None, workspace: Workspace) -> dict[str, Any]:
    if motion is None:
        return {"n_links": None, "n_poses": None, "n_colliding": None, "largest_angle": None}
    distances = signed_distances(motion.joints, workspace, motion.base_pose).min(axis=1)
    return {
        "n_links": motion.n_links,
        "n_poses": motion.n_poses,
        "n_colliding": int((distances < -TOUCH * motion.link_length).sum()),
        "largest_angle": _largest_angle(motion),
    }


def _largest_angle(motion: SpatialMotion) -> float:
    return float(np.hypot(motion.joint_angles[..., 0], motion.joint_angles[..., 1]).max())


def _report_figures(result: SpatialResult) -> dict[str, Any]:
    report = result.report
    if report is None:
        return {"depth": None, "between": None, "clearance": None}
    bound = report.penetration_between
    return {
        "depth": report.penetration,
        "between": bound if math.isfinite(bound) else None,
        "clearance": report.clearance if math.isfinite(report.clearance) else None,
    }


def _curve_figures(
    result: SpatialResult, workspace: Workspace, link_length: float, runs: int
) -> dict[str, Any]:
    """Measure the curve on which all joints run, and the time of feeding the arm along it."""
    if result.track is None or result.report is None:
        return {"track_length": None, "pose_s": None, "jumps": None}
    pose_s, jumps = time_poses(workspace, result.track, link_length, max(runs, 1))
    return {
        "track_length": workspace.straight + float(arclength(behind_straight(workspace, result.track))[-1]),
        "pose_s": pose_s,
        "jumps": jumps,
    }


def _mapping(path: Path | None, link_length: float) -> dict[str, float | None]:
    if path is None:
        return {"link_to_path": None, "path_to_link": None}
    return dict(vars(mapping_error(path, link_length)))


def time_poses(workspace: Workspace, curve: FloatArray, link_length: float, runs: int) -> tuple[float, bool]:
    """Feed an arm along a curve, and nothing else.

    Parameters
    ----------
    workspace : Workspace
        Gives base and straight stretch.
    curve : array, shape (n, 3)
        To the goal.
    link_length : float
        In workspace units.
    runs : int
        At least 1.

    Returns
    -------
    seconds : float
        Per pose, median over the runs.
    jumps : bool
        Whether feeding ended before the goal, as a joint would have had to jump.
    """
    base_pose = workspace.base_pose_for(link_length)
    curve = np.concatenate([base_pose[None, :3], behind_straight(workspace, curve)])
    fed, seconds = feed(curve, link_length, base_pose), []
    for _ in range(runs):
        start = time.perf_counter()
        feed(curve, link_length, base_pose)
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds)) / len(fed.poses), fed.ending != DONE


def longest_row(workspace: Workspace, planner: str, accuracy: float) -> dict[str, Any]:
    """Find the longest link of a planner, and check its motion once more.

    Returns
    -------
    row : dict
        Length (0 if none), links, clearance, whether the exact checker agrees, how many lengths were tried,
        and seconds.
    """
    start = time.perf_counter()
    found = longest_link(workspace, planner, accuracy=accuracy, time_budget=TIME_BUDGET)
    report = None if found.motion is None else validate(found.motion, workspace)
    return {
        "planner": planner,
        "length": found.length,
        "n_links": None if found.motion is None else found.motion.n_links,
        "clearance": None if report is None else report.clearance,
        "valid": report is not None and report.valid,
        "tried": len(found.trials),
        "out_of_time": sum(str(trial.status) == "out of time" for trial in found.trials),
        "seconds": time.perf_counter() - start,
    }


def longest_in_room(room: str, planner: str, accuracy: float) -> dict[str, Any]:
    """Find the longest link in a workspace by name; see `longest_row`."""
    return {
        "task": [room, planner, accuracy],
        "room": room,
        **longest_row(load_workspace(room), planner, accuracy),
    }


def longest_in_panels(
    gap: float, window: float, thickness: float, planner: str, accuracy: float
) -> dict[str, Any]:
    """Find the longest link through paired panels of other sizes; see `longest_row`."""
    workspace = paired_panels(gap=gap, window=window, thickness=thickness)
    return {
        "task": [gap, window, thickness, planner, accuracy],
        "gap": gap,
        "window": window,
        "thickness": thickness,
        **longest_row(workspace, planner, accuracy),
    }


def farthest_with_horizon(horizon: float) -> dict[str, Any]:
    """Find the longest of `HORIZON_LENGTHS` with which the causal planner passes the paired panels."""
    workspace, start = paired_panels(), time.perf_counter()
    valid: list[float] = []
    for length in HORIZON_LENGTHS:
        arm = ArmSpec(link_length=length)
        query = SpatialQuery(
            workspace=workspace,
            arm=arm,
            deadline=now() + HORIZON_SECONDS,
            check=lambda motion: validate(motion, workspace),
        )
        motion = plan_causal(query, horizon).motion
        if motion is not None and validate(motion, workspace).valid:
            valid.append(length)
    longest = max(valid, default=0.0)
    return {
        "task": [horizon],
        "horizon": horizon,
        "length": longest,
        "shorter_that_fail": sum(length <= longest for length in HORIZON_LENGTHS) - len(valid),
        "seconds": time.perf_counter() - start,
    }


def try_arm(workspace: Workspace, arm: ArmSpec) -> dict[str, Any]:
    """Plan a joint track for an arm with a radius or a joint limit, and check its motion once more."""
    start = time.perf_counter()
    result = plan(workspace, arm)
    seconds = time.perf_counter() - start
    return {
        "link_length": arm.link_length,
        "radius": arm.link_radius,
        "joint_limit": arm.joint_limit,
        "status": str(result.status),
        "seconds": seconds,
        **_checked(result.motion, workspace, arm),
    }


def _checked(motion: SpatialMotion | None, workspace: Workspace, arm: ArmSpec) -> Mapping[str, Any]:
    if motion is None:
        return {"n_links": None, "clearance": None, "largest_angle": None, "valid": False}
    report = validate(motion, workspace, arm)
    return {
        "n_links": motion.n_links,
        "clearance": report.clearance,
        "largest_angle": _largest_angle(motion),
        "valid": report.valid,
    }
