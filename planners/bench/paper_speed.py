"""The paper's workspaces, time per pose (its Fig. 18), and growth with links (its section 5.2)."""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS, serpentine
from planners.beam_planner import FedArm, Rules, plan_beam
from planners.bench.fits import exponent, line
from planners.bench.paper_trials import RULES, try_planner
from planners.bench.pool import Tell
from planners.bench.single import serpentine_length, time_plans
from planners.kernels.beam_arm import FULL, GOAL
from planners.kernels.types import FloatArray, IntArray
from planners.planning import plan
from planners.problem import Motion
from planners.query import Query
from planners.rollout import simulate_motion
from planners.survey import Geometry, survey

__all__ = [
    "PLANNERS",
    "PosesInTime",
    "growth_with_arm",
    "pose_figures",
    "time_each_pose",
    "time_plans_of_serpentines",
    "workspaces",
]

PLANNERS = ("auto", *RULES)
"""Those that run in the paper's workspaces."""

PAPER_LINKS = 45
"""Links in the paper's Fig. 17a."""

GROWTH_LENGTH = 0.85 * 254.0
"""Link length in px, 0.85 of the longest rod, for the growth with the arm: the clamped rules take it to
the end of the longest serpentine; with 0.9 they end before."""

TOGETHER = 40
"""Poses that are timed together where an arm grows; a link length of feed has at least 240."""

MOST_POSES = 240_000
"""An arm that grows is fed no farther."""

SHOWN = 60
"""Points of a curve that are kept in the results."""


@contextmanager
def no_collector() -> Iterator[None]:
    """Keep Python's garbage collector out of what is timed."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def workspaces(names: Sequence[str], runs: int, tell: Tell = lambda: None) -> list[dict[str, Any]]:
    """Run the planners in the paper's workspaces; check, time and simulate what they give.

    Parameters
    ----------
    names : sequence of str
        Keys of `PAPER_LINK_LENGTHS`.
    runs : int
        Timed runs of each.
    tell : callable
        Called after each planner in each workspace.

    Returns
    -------
    rows : list of dict
        How it ended, and seconds from the maze to all poses, the check left out.
    """
    return [_workspace(name, planner, runs, tell) for name in names for planner in PLANNERS]


def _workspace(name: str, planner: str, runs: int, tell: Tell) -> dict[str, Any]:
    maze, length = Maze.load(name), PAPER_LINK_LENGTHS[name]
    trial, geometry = try_planner(maze, length, planner), survey(maze)
    assert geometry is not None  # these mazes have a path
    with no_collector():
        seconds = [_maze_to_poses(maze, length, planner) for _ in range(runs)]
    row = {
        "maze": name,
        "link_length": length,
        "planner": planner,
        **trial.row(),
        "path_length": geometry.path.length,
        "runs": runs,
        "median_s": float(np.median(seconds)),
        "least_s": min(seconds),
        "clean": None,
    }
    if trial.solved and trial.motion is not None:
        row["clean"] = _is_clean(maze, trial.motion)
    tell()
    return row


def _maze_to_poses(maze: Maze, link_length: float, planner: str) -> float:
    """Plan once; return all seconds that it took, but for the exact check of the motion."""
    arm, start = ArmSpec(link_length=link_length), time.perf_counter()
    if planner in RULES:
        plan_beam(Query(maze=maze, arm=arm), RULES[planner])
        return time.perf_counter() - start
    timings = plan(maze, arm, planner, explain=False).timings
    return time.perf_counter() - start - timings.get("validate", 0.0)


def _is_clean(maze: Maze, motion: Motion) -> bool:
    """Simulate a motion; say whether the arm comes to the goal and its links merely pinch the walls."""
    episode = simulate_motion(motion, maze)
    return bool(episode.success and episode.report.clean)


@dataclass(frozen=True, eq=False, kw_only=True)
class PosesInTime:
    """Hold the time of each pose of an arm that is fed.

    Parameters
    ----------
    feeds : array, shape (n,)
        Length of arm that is out, in maze units.
    seconds : array, shape (n,)
        What each pose took: the least of several repetitions.
    links_out : array, shape (n,)
        Links that are out of the feeder, at least in part.
    at_goal : bool
        Whether the arm came to the goal.
    """

    feeds: FloatArray
    seconds: FloatArray
    links_out: IntArray
    at_goal: bool


def time_each_pose(geometry: Geometry, link_length: float, rules: Rules, repeats: int) -> PosesInTime:
    """Feed an arm pose by pose, all links anew at each, and time every pose.

    The garbage collector is off, and of each pose the least of the repetitions is kept: other work on the
    machine then counts only where it comes at the same pose each time.
    """
    arm = ArmSpec(link_length=link_length)
    FedArm(geometry, arm, rules, record=False).feed(2)  # compiles
    every: list[list[float]] = []
    fed, ending = FedArm(geometry, arm, rules, record=False), FULL
    with no_collector():
        for _ in range(repeats):
            fed, ending, seconds = FedArm(geometry, arm, rules, record=False), FULL, []
            while ending == FULL:
                start = time.perf_counter()
                ending, _ = fed.feed(1)
                seconds.append(time.perf_counter() - start)
            every.append(seconds)
    n = fed.n_poses - 1  # the first one is given
    feeds = fed.feeds[1 : n + 1].copy()
    return PosesInTime(
        feeds=feeds,
        seconds=np.min([seconds[:n] for seconds in every], axis=0),
        links_out=np.ceil(feeds / link_length - 1e-9).astype(np.int64),
        at_goal=ending == GOAL,
    )


def pose_figures(name: str, link_length: float, planner: str, repeats: int) -> dict[str, Any]:
    """Compute the figures of Fig. 18: cumulative time over the arm's length, and the time of each pose.

    Returns
    -------
    figures : dict
        The straight line through the cumulative time and its exponent, median, 99th percentile and largest
        time of a pose, over all poses and over those with at least as many links out as the paper has.
    """
    geometry = survey(Maze.load(name))
    assert geometry is not None  # this maze has a path
    timed = time_each_pose(geometry, link_length, RULES[planner], repeats)
    total = np.cumsum(timed.seconds)
    shown = np.unique(np.linspace(0, len(total) - 1, SHOWN).astype(np.int64))
    later = shown[timed.feeds[shown] > 0.1 * timed.feeds[-1]]
    many = timed.links_out >= PAPER_LINKS
    return {
        "maze": name,
        "link_length": link_length,
        "planner": planner,
        "repeats": repeats,
        "at_goal": timed.at_goal,
        "came": min(1.0, float(timed.feeds[-1] / geometry.path.length)) if not timed.at_goal else 1.0,
        "n_links": int(timed.links_out[-1]),
        "n_poses": len(total),
        "total_s": float(total[-1]),
        "survey_s": sum(geometry.timings.values()),
        "line": line(timed.feeds, total),
        "growth": exponent(timed.feeds[later].tolist(), total[later].tolist()),
        "all": _spread(timed.seconds),
        "paper_links": _spread(timed.seconds[many]) if many.any() else None,
        "feeds": timed.feeds[shown].tolist(),
        "cumulative_s": total[shown].tolist(),
    }


def _spread(seconds: FloatArray) -> dict[str, float]:
    return {
        "n_poses": len(seconds),
        "median_s": float(np.median(seconds)),
        "p99_s": float(np.percentile(seconds, 99.0)),
        "largest_s": float(seconds.max()),
    }


def growth_with_arm(
    turns: int, counts: Sequence[int], planner: str, tell: Tell = lambda: None
) -> dict[str, Any]:
    """Feed one arm through a serpentine and time its poses when so many links are out.

    Returns
    -------
    growth : dict
        Rows of `n_links`, and of the median and the least time per pose among the groups of poses with so
        many links out, for the counts that the arm came to; and the exponents of both. Where joints move
        fast, poses are tried again with less feed: the median has that, the least has not.
    """
    arm = ArmSpec(link_length=GROWTH_LENGTH)
    geometry = Query(maze=serpentine(turns), arm=arm).geometry
    assert geometry is not None  # a serpentine has a path
    fed, ending = FedArm(geometry, arm, RULES[planner], record=False), FULL
    per_pose: dict[int, list[float]] = {}
    with no_collector():
        while ending == FULL and fed.n_poses < MOST_POSES and _links_out(fed) <= max(counts):
            before, out, start = fed.n_poses, _links_out(fed), time.perf_counter()
            ending, _ = fed.feed(TOGETHER)
            seconds = time.perf_counter() - start
            if out == _links_out(fed) and fed.n_poses > before:
                per_pose.setdefault(out, []).append(seconds / (fed.n_poses - before))
    tell()
    rows = [
        {"n_links": count, "median_s": float(np.median(per_pose[count])), "least_s": min(per_pose[count])}
        for count in counts
        if count in per_pose
    ]
    fits = {
        key: exponent([row["n_links"] for row in rows], [row[key] for row in rows])
        for key in ("median_s", "least_s")
        if len(rows) > 1
    }
    return {
        "planner": planner,
        "turns": turns,
        "link_length": GROWTH_LENGTH,
        "rows": rows,
        "came_to_links": _links_out(fed),
        "fits": fits,
    }


def _links_out(fed: FedArm) -> int:
    return int(np.ceil(fed.feeds[fed.n_poses - 1] / fed.link_length - 1e-9))


def time_plans_of_serpentines(turns: Sequence[int], runs: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Time `auto` from the maze to all poses in serpentines of ever more turns, and fit exponents."""
    cases = [(serpentine(n), serpentine_length(), "auto") for n in turns]
    rows = [row for row in time_plans(cases, runs, tell) if row["status"] == "solved"]
    seconds = [row["least_s"]["maze to poses"] for row in rows]
    several = len(rows) > 1
    return {
        "rows": rows,
        "over_links": exponent([row["n_links"] for row in rows], seconds) if several else None,
        "over_path": exponent([row["path_length"] for row in rows], seconds) if several else None,
    }
