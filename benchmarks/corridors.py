"""How close to the longest rod the longest link comes that passes through 100 random corridors.

Run with `.venv/bin/python benchmarks/corridors.py [seconds per length]` from the repository's root. Goes on
from `benchmarks/results/corridors.jsonl` where an earlier run was stopped.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from planners.bench.mazes import longest_in_maze, warm_up
from planners.bench.pool import resumed

SEEDS = range(100)
PLANNER, TIME_BUDGET = "auto", 1.0
RESULTS = Path(__file__).parent / "results"
LOW = 0.95


def main() -> None:
    """Measure and print."""
    budget = float(sys.argv[1]) if len(sys.argv) > 1 else TIME_BUDGET
    tasks = [(f"corridor-{seed}", PLANNER, budget) for seed in SEEDS]
    rows = resumed(RESULTS / "corridors.jsonl", longest_in_maze, tasks, warm_up)
    if not rows:
        return
    shares = np.array([(row["longest"] or 0.0) / row["upper"] for row in rows])
    print(
        f"\n{len(rows)} corridors, planner {PLANNER}: longest link over the longest rod (its proven upper "
        f"bound): mean {shares.mean():.4f}, median {np.median(shares):.4f}, least {shares.min():.4f}; "
        f"at least 0.99 in {np.mean(shares >= 0.99):.0%}, 0.98 in {np.mean(shares >= 0.98):.0%}, "
        f"{LOW} in {np.mean(shares >= LOW):.0%}; lengths that ran out of time: "
        f"{sum(row['late'] for row in rows)} of {sum(row['tried'] for row in rows)}."
    )
    print("\n| corridor | longest link | rod | share | lengths out of time |\n|---|---|---|---|---|")
    for index in np.argsort(shares)[: max(10, int((shares < LOW).sum()))]:
        row = rows[index]
        longest = "none" if row["longest"] is None else f"{row['longest']:.1f}"
        print(
            f"| {row['maze']} | {longest} | {row['lower']:.1f} to {row['upper']:.1f} | {shares[index]:.4f} "
            f"| {row['late']} of {row['tried']} |"
        )


if __name__ == "__main__":
    main()
