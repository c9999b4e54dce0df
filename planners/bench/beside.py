"""Planners of OMPL beside ours, in the same mazes, on the same machine, before the same checker."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import serpentine
from planners.baselines.ompl_sampling import OMPL_PLANNERS, plan_ompl
from planners.baselines.ompl_sampling import warm_up as load_ompl
from planners.bench.mazes import warm_up
from planners.bench.pool import Tell, over_processes, worker_pool
from planners.clock import now
from planners.planning import plan
from planners.query import Query
from planners.validation import validate

__all__ = ["LONGEST", "beside_ompl", "ompl_tasks", "run_one", "u_turns"]

LONGEST = 440.0
"""Longest rod in a U-turn of width 200 round a wall of 40 (the paper, section 5.1)."""

OURS = ("auto", "sweep")
"""Our planners beside theirs."""


def u_turns(turns: int) -> Maze:
    """Build U-turns as in the paper's benchmark, with legs of 600."""
    return serpentine(turns, width=200.0, pitch=240.0, leg=600.0)


def ompl_tasks(
    turns: Sequence[int], indices: Sequence[float], seeds: Sequence[int], time_limit: float
) -> list[tuple[int, float, str, int, float]]:
    """List all that `beside_ompl` runs: turns, index, planner, seed and time limit."""
    return [
        (n, index, planner, seed, time_limit)
        for n in turns
        for index in indices
        for planner in (*OURS, *OMPL_PLANNERS)
        for seed in seeds
    ]


def beside_ompl(
    tasks: Sequence[tuple[int, float, str, int, float]], workers: int, tell: Tell = lambda: None
) -> list[dict[str, Any]]:
    """Run planners over processes, and count by maze, index and planner.

    Returns
    -------
    rows : list of dict
        With counts of `valid`, `invalid` and `unsolved` runs, and the median seconds of the valid ones.
    """
    with worker_pool(workers, warm_up) as pool:
        runs = list(over_processes(pool, run_one, tasks, tell))
    links = {(run["turns"], run["index"]): run["n_links"] for run in runs if run["planner"] == OURS[0]}
    rows = []
    for turns, index, planner in dict.fromkeys(task[:3] for task in tasks):
        chosen = [
            run for run in runs if (run["turns"], run["index"], run["planner"]) == (turns, index, planner)
        ]
        valid = [run for run in chosen if run["outcome"] == "valid"]
        rows.append(
            {
                "turns": turns,
                "index": index,
                "planner": planner,
                "runs": len(chosen),
                **{
                    outcome: sum(run["outcome"] == outcome for run in chosen)
                    for outcome in ("valid", "invalid", "unsolved")
                },
                "n_links": next((run["n_links"] for run in valid), links.get((turns, index))),
                "median_s": float(np.median([run["seconds"] for run in valid])) if valid else None,
                "faults": sorted({run["fault"] for run in chosen if run["fault"]}),
            }
        )
    return rows


def run_one(turns: int, index: float, planner: str, seed: int, time_limit: float) -> dict[str, Any]:
    """Run one planner once.

    Returns
    -------
    run : dict
        Its `seconds` are those from maze to poses, with the survey of the maze.
    """
    maze, arm = u_turns(turns), ArmSpec(link_length=index * LONGEST)
    outcome: dict[str, Any] = {"turns": turns, "index": index, "planner": planner, "seed": seed}
    if planner in OURS:
        result = plan(maze, arm, planner, time_budget=time_limit, explain=False)
        motion, timings = result.motion, result.timings
    else:
        load_ompl()
        query = Query(maze=maze, arm=arm, deadline=now() + time_limit, seed=seed)
        candidate = plan_ompl(query, algorithm=planner)
        motion, timings = candidate.motion, candidate.timings
    seconds = sum(value for stage, value in timings.items() if stage != "validate")
    if motion is None:
        return {**outcome, "outcome": "unsolved", "n_links": None, "seconds": seconds, "fault": ""}
    faults = validate(motion, maze, arm).faults
    return {
        **outcome,
        "outcome": "invalid" if faults else "valid",
        "n_links": motion.n_links,
        "seconds": seconds,
        "fault": faults[0].kind if faults else "",
    }
