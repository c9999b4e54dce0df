"""How many of 200 random halls are solved at four link lengths, and how many no planner could solve.

Run with `.venv/bin/python benchmarks/halls.py [seconds per maze]` from the repository's root. Goes on from
`benchmarks/results/halls.jsonl` where an earlier run was stopped, and prints the README's table.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from planners.bench.mazes import plan_in_maze, rod_in_maze, warm_up
from planners.bench.pool import resumed

LENGTHS = (100.0, 150.0, 200.0, 250.0)
SEEDS = range(200)
PLANNER, TIME_BUDGET = "auto", 10.0
ROD_BUDGET = 5.0  # s that the proof of a failure may take
RESULTS = Path(__file__).parent / "results"


def print_table(rows: list[dict[str, Any]], rods: list[dict[str, Any]]) -> None:
    """Print counts for each length as Markdown; a failure is no failure where not even a rod passes."""
    passes = {(row["maze"], row["link_length"]): row["rod"] for row in rods}
    print("\n| link | halls | solved | by planner | no rod passes | unsolved | of those by status | median |")
    print("|---|---|---|---|---|---|---|---|")
    for length in LENGTHS:
        here = [row for row in rows if row["link_length"] == length]
        solved = [row for row in here if row["status"] == "solved"]
        failed = [row for row in here if row["status"] != "solved"]
        open_ = [row for row in failed if passes.get((row["maze"], length)) != "no"]
        planners = Counter(row["planner"] for row in solved)
        seconds = [row["seconds"] for row in solved]
        print(
            f"| {length:g} | {len(here)} | {len(solved)} | {listed(planners)} | {len(failed) - len(open_)} "
            f"| {len(open_)} | {listed(Counter(row['status'] for row in open_))} "
            f"| {np.median(seconds) if seconds else float('nan'):.2f} s |"
        )
        print(f"  unsolved at {length:g}: {' '.join(row['maze'] for row in open_)}", file=sys.stderr)


def listed(counts: Counter[str]) -> str:
    """Write counts in one line."""
    return ", ".join(f"{name} {count}" for name, count in counts.most_common()) or "-"


def main() -> None:
    """Plan, prove and print."""
    budget = float(sys.argv[1]) if len(sys.argv) > 1 else TIME_BUDGET
    tasks = [(f"clutter-{seed}", length, PLANNER, budget) for seed in SEEDS for length in LENGTHS]
    rows = resumed(RESULTS / "halls.jsonl", plan_in_maze, tasks, warm_up)
    failed = [(row["maze"], row["link_length"], ROD_BUDGET) for row in rows if row["status"] != "solved"]
    print_table(rows, resumed(RESULTS / "halls-rods.jsonl", rod_in_maze, failed, warm_up))


if __name__ == "__main__":
    main()
