"""What the worker processes do: each kind of job, from a request to plain data."""

from __future__ import annotations

import base64
import math
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.replay import replay_payload
from planners import longest, tables
from planners.planning import plan
from planners.problem import Motion, PlanningResult, Progress
from planners.studio.files import exported, map_read
from planners.studio.motions import arm_spec, checked, motion_bytes, motion_from
from planners.studio.requests import CheckRequest, ExportRequest, LongestRequest, MapRequest, PlanRequest
from planners.studio.scene import maze_from_scene
from planners.validation import validate

if TYPE_CHECKING:
    from planners.studio.workers import Desk

__all__ = ["TASKS", "warm_up", "warm_up_search"]


def warm_up() -> None:
    """Plan and simulate the paper's benchmark once, so that the first job finds all compiled."""
    from planners.rollout import simulate_motion

    maze = Maze.load("fig19")
    result = plan(maze, ArmSpec(link_length=430.0))
    if result.motion is not None:
        simulate_motion(result.motion, maze)


def warm_up_search() -> None:
    """Look for a longest link for a moment: rod bound and search are compiled on this machine then."""
    bend = Maze.from_corridors([(0.0, 0.0), (0.0, 600.0), (600.0, 600.0)], 200.0)
    longest.longest_link(bend, accuracy=0.1, time_budget=0.1)


def plan_task(ask: PlanRequest, desk: Desk) -> dict[str, Any]:
    """Plan, check and simulate."""
    maze, arm = maze_from_scene(ask.scene), arm_spec(ask.arm)
    warm_start = None if ask.warm_start is None else motion_from(ask.warm_start)
    progress, start = _progress(desk), time.perf_counter()
    result = plan(
        maze, arm, ask.planner, time_budget=ask.time_budget, warm_start=warm_start, progress=progress
    )
    seconds = time.perf_counter() - start
    return {
        **_planned(result, seconds),
        "report": None if result.report is None else tables.validation_dict(result.report),
        **_watched(maze, arm, result.motion, progress, result.planner),
        "failure_joints": None
        if result.failure is None or result.failure.joints is None
        else result.failure.joints[:, :2].tolist(),
        "geojson": maze.to_geojson(),
    }


def check_task(ask: CheckRequest, desk: Desk) -> dict[str, Any]:
    """Check a motion exactly, and simulate it if it is valid."""
    maze, motion, progress = maze_from_scene(ask.scene), motion_from(ask.motion), _progress(desk)
    start = time.perf_counter()
    arm, report = checked(ask.arm, motion, maze, progress)
    seconds = time.perf_counter() - start
    fault = None if report.valid else report.faults[0]
    return {
        "solved": report.valid,
        "status": "solved" if fault is None else "not valid",
        "reason": "" if fault is None else f"The exact check refused the motion: {fault.message}",
        "place": None if fault is None else fault.place,
        "longest_there": None,
        "planner": "",
        "attempts": [],
        "timings": {"validate": seconds},
        "seconds": seconds,
        "n_links": motion.n_links,
        "n_poses": motion.n_poses,
        "report": tables.validation_dict(report),
        **_watched(maze, arm, motion if report.valid else None, progress, ""),
        "failure_joints": None if fault is None else motion.joints[fault.pose].tolist(),
        "geojson": maze.to_geojson(),
    }


def longest_task(ask: LongestRequest, desk: Desk) -> dict[str, Any]:
    """Find the longest link; a stop ends the search with the best so far."""
    maze = maze_from_scene(ask.scene)
    limit = None if ask.joint_limit_deg is None else math.radians(ask.joint_limit_deg)
    with desk.interruptible():
        found = longest.longest_link(
            maze,
            ask.planner,
            link_radius=ask.link_radius,
            joint_limit=limit,
            accuracy=longest.ACCURACY if ask.accuracy is None else ask.accuracy,
            time_budget=longest.TIME_BUDGET if ask.time_budget is None else ask.time_budget,
            progress=lambda news, share: desk.tell(stage="longest", news=news, share=share),
        )
    return _longest_result(maze, found, ask.link_radius, limit, _progress(desk))


def _longest_result(
    maze: Maze, found: longest.LongestLink, radius: float, limit: float | None, progress: Progress
) -> dict[str, Any]:
    motion, report = found.motion, None
    arm = ArmSpec(link_length=found.length or maze.size, link_radius=radius, joint_limit=limit)
    if motion is not None:
        report = validate(motion, maze, arm)
    best = next((trial for trial in found.trials if trial.link_length == found.length), None)
    return {
        "length": found.length,
        "index": found.index,
        "bound_lower": found.bound.lower,
        "bound_upper": found.bound.upper,
        "complete": found.complete,
        "note": found.note,
        "table": [trial.to_dict() for trial in found.table],
        "solved": motion is not None,
        "status": "solved" if motion is not None else "no path",
        "reason": "" if motion is not None else "No length that was tried reaches the goal.",
        "place": None,
        "longest_there": None,
        "planner": "" if best is None else best.planner,
        "attempts": [],
        "timings": {},
        "seconds": sum(trial.seconds for trial in found.trials),
        "n_links": None if motion is None else motion.n_links,
        "n_poses": None if motion is None else motion.n_poses,
        "report": None if report is None else tables.validation_dict(report),
        **_watched(maze, arm, motion, progress, "" if best is None else best.planner),
        "failure_joints": None,
        "geojson": maze.to_geojson(),
    }


def map_task(ask: MapRequest, desk: Desk) -> dict[str, Any]:
    """Read a map."""
    desk.tell(stage="read", share=0.0)
    return map_read(ask)


def export_task(ask: ExportRequest, desk: Desk) -> dict[str, Any]:
    """Write a file of a run."""
    return exported(ask, _progress(desk))


TASKS: dict[str, Callable[[Any, Desk], dict[str, Any]]] = {
    "map": map_task,
    "plan": plan_task,
    "check": check_task,
    "longest": longest_task,
    "export": export_task,
}
"""What is done for each kind of job."""


# What they share


def _progress(desk: Desk) -> Progress:
    return lambda stage, share: desk.tell(stage=stage, share=round(min(max(share, 0.0), 1.0), 4))


def _planned(result: PlanningResult, seconds: float) -> dict[str, Any]:
    """Return what came of planning, without the motion."""
    outcome = result.to_dict()
    keys = (
        "status",
        "reason",
        "place",
        "longest_there",
        "planner",
        "attempts",
        "timings",
        "n_links",
        "n_poses",
    )
    return {"solved": result.solved, "seconds": seconds, **{key: outcome[key] for key in keys}}


def _watched(
    maze: Maze, arm: ArmSpec, motion: Motion | None, progress: Progress, planner: str
) -> dict[str, Any]:
    """Return the motion, and what the simulator says and shows of it."""
    if motion is None:
        return {"verdict": None, "success": False, "payload": None, "motion": None}
    from planners.rollout import simulate_motion

    episode = simulate_motion(motion, maze, arm, progress=progress)
    links = f"{motion.n_links} links of {motion.link_length:g} {maze.units}"
    title = ", ".join(part for part in (maze.name, links, planner) if part)
    return {
        "verdict": episode.report.to_dict(),
        "success": episode.success,
        "payload": replay_payload([episode.trace(maze, title=title, link_radius=arm.link_radius)]),
        "motion": base64.b64encode(motion_bytes(motion)).decode("ascii"),
    }
