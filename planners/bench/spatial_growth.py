"""How the time of planning in space grows with the number of links, and with the way."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from hrsnake_env.arm import ArmSpec
from planners.bench.fits import exponent
from planners.bench.pool import Tell
from planners.feeding import feed
from planners.problem import ValidationReport
from planners.spatial.problem import SpatialMotion
from planners.spatial.query import SpatialQuery, behind_straight
from planners.spatial.rooms import paired_panels, panels_in_a_row
from planners.spatial.track_planner import plan_track
from planners.spatial.validation import validate
from planners.spatial.workspace import Workspace

__all__ = ["BEND_PANELS", "LENGTH", "STAGES", "growth_with_links", "growth_with_way", "time_stages"]

STAGES = ("path", "track", "poses", "per pose", "plan", "check", "whole")
"""What is timed: `plan` is path, track and poses, `whole` is that and the check."""

LENGTH = 90.0
"""Link length where the way grows, in workspace units."""

BEND_PANELS = 2
"""Panels of one copy of the pattern: to the opposite corner of the room and back."""


def growth_with_links(lengths: Sequence[float], runs: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Plan through the paired panels with shorter and shorter links."""
    workspace = paired_panels()
    return _growth([(workspace, length) for length in lengths], "n_links", runs, tell)


def growth_with_way(copies: Sequence[int], runs: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Plan in longer and longer rooms, with more and more panels."""
    cases = [(panels_in_a_row(BEND_PANELS * number), LENGTH) for number in copies]
    return _growth(cases, "path_length", runs, tell)


def _growth(cases: Sequence[tuple[Workspace, float]], over: str, runs: int, tell: Tell) -> dict[str, Any]:
    """Time all cases, in turns so that noise comes to all alike, and fit exponents over a figure."""
    rows: list[dict[str, Any]] = []
    every: list[list[dict[str, float]]] = [[] for _ in cases]
    for run in range(runs):
        for number, (workspace, length) in enumerate(cases):
            row, seconds = time_stages(workspace, length)
            every[number].append(seconds)
            if run == 0:
                rows.append(row)
            tell()
    for row, timed in zip(rows, every, strict=True):
        row["median_s"] = {stage: float(np.median([one[stage] for one in timed])) for stage in STAGES}
    fitted = [row for row in rows if row["solved"]]
    fits = {}
    if len({row[over] for row in fitted}) > 1:
        sizes = [row[over] for row in fitted]
        fits = {stage: exponent(sizes, [row["median_s"][stage] for row in fitted]) for stage in STAGES}
    return {"over": over, "runs": runs, "rows": rows, "fits": fits}


class _TimedCheck:
    """The exact checker for a planner; adds up the processor's time that it takes."""

    def __init__(self, workspace: Workspace) -> None:
        self.workspace, self.valid = workspace, False
        self.seconds, self.last_seconds, self.calls = 0.0, 0.0, 0

    def __call__(self, motion: SpatialMotion) -> ValidationReport:
        start = time.process_time()
        report = validate(motion, self.workspace)
        self.last_seconds = time.process_time() - start
        self.seconds, self.calls, self.valid = self.seconds + self.last_seconds, self.calls + 1, report.valid
        return report


def time_stages(workspace: Workspace, link_length: float) -> tuple[dict[str, Any], dict[str, float]]:
    """Plan a joint track once, stage by stage.

    Time is the processor's, not the wall clock's. Where the checker refuses a first track, shaping and
    feeding it counts as `track`, and of the checks only the last counts.

    Returns
    -------
    row : dict
        What was planned and whether the checker agrees.
    seconds : dict
        By `STAGES`.
    """
    arm, check = ArmSpec(link_length=link_length), _TimedCheck(workspace)
    query = SpatialQuery(workspace=workspace, arm=arm, deadline=np.inf, check=check)
    start = time.process_time()
    path = query.path
    path_s = time.process_time() - start
    start = time.process_time()
    candidate = plan_track(query)
    planner_s = time.process_time() - start - check.seconds
    motion, poses_s = candidate.motion, 0.0
    if motion is not None and candidate.track is not None:
        poses_s = _feeding_seconds(workspace, candidate.track, link_length)
    n_poses = 0 if motion is None else motion.n_poses
    row = {
        "workspace": workspace.name,
        "link_length": link_length,
        "solved": motion is not None and check.valid,
        "n_links": 0 if motion is None else motion.n_links,
        "n_poses": n_poses,
        "n_obstacles": len(workspace.obstacles),
        "path_length": 0.0 if path is None else path.length,
        "attempts": check.calls,
    }
    seconds = {
        "path": path_s,
        "track": max(planner_s - poses_s, 0.0),
        "poses": poses_s,
        "per pose": poses_s / max(n_poses, 1),
        "plan": path_s + planner_s,
        "check": check.last_seconds,
        "whole": path_s + planner_s + check.last_seconds,
    }
    return row, seconds


def _feeding_seconds(workspace: Workspace, track: np.ndarray, link_length: float) -> float:
    """Feed an arm along its track once more, as the planner does; return how long that takes."""
    start = time.process_time()
    base_pose = workspace.base_pose_for(link_length)
    curve = np.concatenate([base_pose[None, :3], behind_straight(workspace, track)])
    SpatialMotion.from_joints(feed(curve, link_length, base_pose).poses, link_length, base_pose)
    return time.process_time() - start
