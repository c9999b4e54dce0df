"""One maze at a time: stages of planning, their growth with links and way, memory, and the first call."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig17a, serpentine
from planners.bench.fits import exponent
from planners.bench.pool import Tell
from planners.planning import plan
from planners.query import Query

__all__ = [
    "PLANNERS",
    "first_calls",
    "growth_with_links",
    "growth_with_way",
    "memory",
    "serpentine_length",
    "stages",
    "time_plans",
]

PLANNERS = ("auto", "sweep")
"""Those that are timed: what is asked by default, and the causal one."""

LONGEST_IN_TURNS = 254.0
"""Longest rod in U-turns of `serpentine`'s width and pitch, in px (those of `fig17a`)."""

INDEX = 0.9
"""Link length over the longest rod where the way grows."""

PEAK_RSS = """
import re, resource, sys
from pathlib import Path
from hrsnake_env.arm import ArmSpec
from hrsnake_env.mazes import fig17a, serpentine
from planners import plan
def peak():  # on Linux ru_maxrss also counts what the process was forked from; on macOS it is in bytes
    if sys.platform == "linux":
        return 1024 * int(re.search("VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1])
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
before = peak()
maze = fig17a() if sys.argv[1] == "fig17a" else serpentine(int(sys.argv[1]))
motion = plan(maze, ArmSpec(link_length=float(sys.argv[2])), explain=False).motion
print(before, peak(), *((motion.n_poses, motion.n_links) if motion else (0, 0)))
"""
"""Prints the peak before and after, in bytes, and the motion's numbers of poses and links."""

FIRST_CALL = """
import time
start = time.perf_counter()
import planners
imported = time.perf_counter()
from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
assert planners.plan(Maze.load("fig19"), ArmSpec(link_length=430.0)).solved
print(imported - start, time.perf_counter() - start)
"""
"""Prints the seconds of the import, and of import and first plan."""


def time_plans(
    cases: Sequence[tuple[Maze, float, str]], runs: int, tell: Tell = lambda: None
) -> list[dict[str, Any]]:
    """Plan several times in each case, after once that warms up; in turns, so that noise comes to all alike.

    Parameters
    ----------
    cases : sequence of (maze, link length, planner)
        What is planned.
    runs : int
        Of each.
    tell : callable
        Called after each.

    Returns
    -------
    rows : list of dict
        Status, numbers of links and poses, length of the path, shape of the joints, and by stage (with
        `maze to poses` for all but the check) median and least seconds.
    """
    rows = [_first_plan(*case) for case in cases]
    every: list[list[dict[str, float]]] = [[] for _ in cases]
    for _ in range(runs):
        for (maze, length, planner), row, timed in zip(cases, rows, every, strict=True):
            if row["status"] == "solved":
                timings = plan(maze, ArmSpec(link_length=length), planner, explain=False).timings
                before = sum(value for stage, value in timings.items() if stage != "validate")
                timed.append({**timings, "maze to poses": before})
            tell()
    for row, timed in zip(rows, every, strict=True):
        if timed:
            row["runs"] = runs
            row["median_s"] = {stage: float(np.median([run[stage] for run in timed])) for stage in timed[0]}
            row["least_s"] = {stage: min(run[stage] for run in timed) for stage in timed[0]}
    return rows


def _first_plan(maze: Maze, link_length: float, planner: str) -> dict[str, Any]:
    arm = ArmSpec(link_length=link_length)
    result = plan(maze, arm, planner, explain=False)
    row: dict[str, Any] = {
        "maze": maze.name,
        "link_length": link_length,
        "planner": planner if planner == result.planner else f"{planner} ({result.planner})",
        "status": str(result.status),
    }
    geometry = Query(maze=maze, arm=arm).geometry
    if result.motion is None or geometry is None:
        return row
    return {
        **row,
        "n_links": result.motion.n_links,
        "n_poses": result.motion.n_poses,
        "shape": list(result.motion.joints.shape),
        "path_length": geometry.path.length,
    }


def stages(lengths: Sequence[float], runs: int, tell: Tell = lambda: None) -> list[dict[str, Any]]:
    """Time the stages of `fig17a` at some link lengths."""
    cases = [(fig17a(), length, planner) for planner in PLANNERS for length in lengths]
    return time_plans(cases, runs, tell)


def growth_with_links(lengths: Sequence[float], runs: int, tell: Tell = lambda: None) -> list[dict[str, Any]]:
    """Time `fig17a` with ever shorter links, on a way that stays the same; exponents over links."""
    return _growth([(fig17a(), length) for length in lengths], "n_links", runs, tell)


def growth_with_way(turns: Sequence[int], runs: int, tell: Tell = lambda: None) -> list[dict[str, Any]]:
    """Time serpentines of ever more turns, with links of one length; exponents over the path's length."""
    return _growth([(serpentine(n), serpentine_length()) for n in turns], "path_length", runs, tell)


def serpentine_length() -> float:
    """Return the link length that is used in serpentines."""
    return INDEX * LONGEST_IN_TURNS


def _growth(mazes: Sequence[tuple[Maze, float]], size: str, runs: int, tell: Tell) -> list[dict[str, Any]]:
    rows = time_plans([(*maze, planner) for planner in PLANNERS for maze in mazes], runs, tell)
    parts = [rows[k * len(mazes) : (k + 1) * len(mazes)] for k in range(len(PLANNERS))]
    return [
        {"planner": planner, "rows": part, "fits": _fits(part, size)}
        for planner, part in zip(PLANNERS, parts, strict=True)
    ]


def _fits(rows: list[dict[str, Any]], size: str) -> dict[str, dict[str, float]]:
    """Fit exponents to the least seconds, which other work on the machine disturbs least."""
    solved = [row for row in rows if row["status"] == "solved"]
    if len(solved) < 2:
        return {}
    sizes = [row[size] for row in solved]
    fits = {
        stage: exponent(sizes, [row["least_s"][stage] for row in solved]) for stage in solved[0]["least_s"]
    }
    per_pose = [row["least_s"]["maze to poses"] / row["n_poses"] for row in solved]
    return {
        **fits,
        "per pose": exponent(sizes, per_pose),
        "(number of poses)": exponent(sizes, [row["n_poses"] for row in solved]),
        "(poses x links)": exponent(sizes, [row["n_poses"] * row["n_links"] for row in solved]),
    }


def memory(turns: int, tell: Tell = lambda: None) -> list[dict[str, Any]]:
    """Measure the peak memory of planning `fig17a` and a serpentine, each in a fresh process."""
    rows = []
    for name, length in (("fig17a", 245.0), (str(turns), serpentine_length())):
        before, peak, n_poses, n_links = _fresh(PEAK_RSS, name, str(length))
        rows.append(
            {
                "maze": name if name == "fig17a" else f"serpentine of {name} turns",
                "link_length": length,
                "n_poses": int(n_poses),
                "n_links": int(n_links),
                "imported_bytes": before,
                "peak_bytes": peak,
            }
        )
        tell()
    return rows


def first_calls(runs: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Time import and first plan of `fig19` in fresh processes, after one that fills the kernels' cache."""
    _fresh(FIRST_CALL)
    every, walls = [], []
    for _ in range(runs):
        start = time.perf_counter()
        every.append(_fresh(FIRST_CALL))
        walls.append(time.perf_counter() - start)
        tell()
    imports, plans = np.array(every).T
    return {
        "runs": runs,
        "import_s": float(np.median(imports)),
        "import_least_s": float(imports.min()),
        "import_and_plan_s": float(np.median(plans)),
        "import_and_plan_least_s": float(plans.min()),
        "process_s": float(np.median(walls)),
        "load": list(os.getloadavg()) if hasattr(os, "getloadavg") else None,
    }


def _fresh(script: str, *arguments: str) -> list[float]:
    """Run a script in a fresh process, and return the numbers that it prints."""
    root = str(Path(__file__).parents[2])  # so that it also runs from a checkout that is not installed
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(json.loads(word)) for word in done.stdout.split()]
