"""Many random mazes over processes: how many are solved, and how many in a second."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from planners.bench.mazes import plan_in_maze, rod_in_maze, warm_up
from planners.bench.pool import Tell, over_processes, worker_pool

__all__ = ["LENGTHS", "ROUNDS", "random_mazes"]

LENGTHS = {"clutter": 200.0, "corridor": 250.0}
"""Link length by kind of maze, in px."""

PLANNER, TIME_BUDGET, ROD_BUDGET = "auto", 10.0, 5.0
"""Planner, seconds that a maze may take, and that the proof may that no rod passes where none was solved."""


ROUNDS = 5
"""How often one worker and all are compared: other work on the machine comes and goes."""


def random_mazes(
    seeds: Sequence[int], workers: int, n_compared: int, tell: Tell = lambda: None
) -> dict[str, Any]:
    """Plan in random mazes with all workers, then in some of those solved with one worker and all in turns.

    Parameters
    ----------
    seeds : sequence of int
        One hall and one corridor each.
    workers : int
        Number of processes.
    n_compared : int
        Number of solved mazes for the comparison. Unsolved ones would spend their time budget on either side.

    Returns
    -------
    figures : dict
        Counts, rates and rows.
    """
    tasks = [
        (f"{kind}-{seed}", length, PLANNER, TIME_BUDGET) for seed in seeds for kind, length in LENGTHS.items()
    ]
    with worker_pool(workers, warm_up) as pool, worker_pool(1, warm_up) as single:
        _wait_for(pool, workers)
        _wait_for(single, 1)
        rows, seconds = _timed(pool, tasks, tell)
        solved = {row["maze"] for row in rows if row["status"] == "solved"}
        failed = [(name, length, ROD_BUDGET) for name, length, *_ in tasks if name not in solved]
        rods = {row["maze"]: row["rod"] for row in over_processes(pool, rod_in_maze, failed)}
        compared = [task for task in tasks if task[0] in solved][:n_compared]
        rounds = [[_timed(each, compared, tell)[1] for each in (single, pool)] for _ in range(ROUNDS)]
    one_seconds, all_seconds = np.median(rounds, axis=0).tolist()
    ratios = [one / both for one, both in rounds]
    open_ = [row for row in rows if row["maze"] not in solved and rods[row["maze"]] != "no"]
    kinds = {kind: [row for row in rows if row["maze"].startswith(kind)] for kind in LENGTHS}
    return {
        "workers": workers,
        "time_budget_s": TIME_BUDGET,
        "kinds": {kind: _counts(chosen, solved, rods) for kind, chosen in kinds.items()},
        "mazes_per_second": len(rows) / seconds,
        "compared": len(compared),
        "one_worker_per_second": len(compared) / one_seconds,
        "all_workers_per_second": len(compared) / all_seconds,
        "ratio": float(np.median(ratios)),
        "ratios": ratios,
        "unsolved": [f"{row['maze']}: {row['status']}" for row in open_],
        "rows": rows,
    }


def _counts(rows: list[dict[str, Any]], solved: set[str], rods: dict[str, str]) -> dict[str, Any]:
    failed = [row for row in rows if row["maze"] not in solved]
    open_ = [row for row in failed if rods[row["maze"]] != "no"]
    done = [row["seconds"] for row in rows if row["maze"] in solved]
    return {
        "link_length": rows[0]["link_length"],
        "mazes": len(rows),
        "solved": len(done),
        "no_rod_passes": len(failed) - len(open_),
        "unsolved": dict(Counter(row["status"] for row in open_)),
        "median_s": float(np.median(done)) if done else None,
        "by_planner": dict(Counter(row["planner"] for row in rows if row["maze"] in solved)),
    }


def _timed(pool: Any, tasks: Sequence[tuple[Any, ...]], tell: Tell) -> tuple[list[dict[str, Any]], float]:
    start = time.perf_counter()
    rows = list(over_processes(pool, plan_in_maze, tasks, tell))
    return rows, time.perf_counter() - start


def _wait_for(pool: Any, workers: int) -> None:
    """Have every worker started, so that no start is counted: a pool starts them as tasks come in."""
    for future in [pool.submit(time.sleep, 0.2) for _ in range(4 * workers)]:
        future.result()
