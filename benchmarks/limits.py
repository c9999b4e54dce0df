"""How long a link may be: the longest link with a validated motion in each named maze, beside the rod bound.

Run with `.venv/bin/python benchmarks/limits.py` from the repository's root (`limits.py L U40` for some of the
mazes). Every length from 0.97 of the longest down is checked to pass as well, in steps of 3 %. A run that was
stopped is gone on with. Prints the table of the README and writes `benchmarks/results/limits.json`.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

from rich.progress import Progress

from hrsnake_env.arm import ArmSpec
from hrsnake_env.files import replacing
from hrsnake_env.maze import MAZES, Maze
from planners import longest_link, plan

ACCURACY = 0.0025
TIME_BUDGET = 1.0  # s for each length
SHORTER = [0.97 - 0.03 * k for k in range(25)]
RESULTS = Path(__file__).parent / "results" / "limits.json"


def measure(name: str, bars: Progress) -> dict[str, Any]:
    """Find the longest link in a maze, and which of the shorter ones fail."""
    maze, start = Maze.load(name), time.perf_counter()
    task = bars.add_task(name, total=1.0)
    longest = longest_link(
        maze,
        accuracy=ACCURACY,
        time_budget=TIME_BUDGET,
        progress=lambda stage, share: bars.update(task, completed=share, description=f"{name} {stage}"),
    )
    seconds = time.perf_counter() - start
    lengths = [share * longest.length for share in SHORTER]
    results = {length: plan(maze, ArmSpec(link_length=length), explain=False) for length in lengths}
    best = next(trial for trial in longest.trials if trial.link_length == longest.length)
    bars.remove_task(task)
    assert longest.fewest is not None  # a longest link passes
    return {
        "longest": longest.length,
        "bound_lower": longest.bound.lower,
        "bound_upper": longest.bound.upper,
        "index": longest.index,
        "links": best.n_links,
        "planner": best.planner,
        "fewest": [longest.fewest.n_links, longest.fewest.link_length],
        "seconds": seconds,
        "undecided": len(longest.out_of_time) + len(longest.untried),
        "shorter_failed": [length for length, result in results.items() if not result.solved],
    }


def main() -> None:
    """Measure, print and write."""
    RESULTS.parent.mkdir(exist_ok=True)
    rows: dict[str, Any] = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    with Progress(transient=True) as bars:
        for name in sys.argv[1:] or MAZES:
            if name not in rows or name in sys.argv:
                rows[name] = measure(name, bars)
                with replacing(RESULTS) as part:
                    part.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    print("| maze | longest link | longest rod | index | links | fewest links | shorter that fail |")
    print("|---|---|---|---|---|---|---|")
    for name, row in rows.items():
        links, length = row["fewest"]
        index = math.floor(1e4 * row["index"]) / 1e4
        print(
            f"| {name} | {row['longest']:.1f} ({row['planner']}) | {row['bound_lower']:.1f} to "
            f"{row['bound_upper']:.1f} | {index:.4f} | {row['links']} | {links} of {length:.1f} "
            f"| {len(row['shorter_failed'])} of {len(SHORTER)} |"
        )


if __name__ == "__main__":
    main()
