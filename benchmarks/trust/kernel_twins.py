"""Set kernels against their slow twins, many thousand times.

Run `python -m benchmarks.trust.kernel_twins --count 10000 --seed 0` from the repository's root. A law that is
slow gets a share of the count. A fault is reproduced by the seed that is printed with it:
`--law NAME --seed SEED --count 1`.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TimeRemainingColumn

from benchmarks.trust import twins_beam, twins_fed, twins_field, twins_maps, twins_rod, twins_world

RESULTS = Path("benchmarks/results/trust")
MODULES = (twins_rod, twins_beam, twins_fed, twins_field, twins_world, twins_maps)

SHARE = {
    "the_search_finds_a_way_where_possible_headings_are_joined": 100,
    "arms_that_forces_move_go_step_by_step": 20,
    "refined_triangles_fill_the_same_space_and_meet_edge_to_edge": 10,
    "an_arm_is_fed_in_small_steps_and_the_same_in_parts_as_at_once": 10,
}
"""By what the count is divided for laws that take long."""

LAWS = {law.__name__: law for module in MODULES for law in module.LAWS}


def run_law(law, count, seed, tick):
    """Try a law with seeds from one on; return the number of cases, and the faults as (seed, what)."""
    cases, faults = 0, []
    for number in range(seed, seed + count):
        try:
            cases += law(np.random.default_rng(number)) is not False
        except Exception as error:  # an exception of whatever kind is a fault
            cases += 1
            faults.append((number, f"{type(error).__name__}: {str(error).strip()[:200]}"))
        tick()
    return cases, faults


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="cases of each law (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, help="the first seed (default: 0)")
    parser.add_argument("--law", default="", help="only laws with this in their name")
    options = parser.parse_args(arguments)
    warnings.filterwarnings("ignore", "invalid value encountered", RuntimeWarning)  # of GEOS, now and then
    names = [name for name in LAWS if options.law in name]
    counts = {name: max(1, options.count // SHARE.get(name, 1)) for name in names}
    found, start, stopped = {}, time.perf_counter(), False
    console = Console(stderr=True)
    columns = (*Progress.get_default_columns()[:2], MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task("kernels and twins", total=sum(counts.values()))
        try:
            for name in names:
                found[name] = run_law(LAWS[name], counts[name], options.seed, lambda: progress.advance(bar))
        except KeyboardInterrupt:
            stopped = True
    seconds = time.perf_counter() - start
    for name, (cases, faults) in found.items():
        print(f"{name.replace('_', ' ')}: {cases} cases, {len(faults)} faults")
        for number, what in faults[:5]:
            print(f"  --law {name} --seed {number} --count 1: {what}")
    RESULTS.mkdir(parents=True, exist_ok=True)
    report = {
        "laws": {name: {"cases": cases, "faults": faults} for name, (cases, faults) in found.items()},
        "seed": options.seed,
        "count": options.count,
        "stopped": stopped,
        "seconds": round(seconds, 1),
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in ("numba", "numpy", "scipy", "shapely")},
        },
    }
    (RESULTS / "kernel_twins.json").write_text(json.dumps(report, indent=1) + "\n")
    if stopped:
        print("Stopped.")
        return 130
    return 1 if any(faults for _, faults in found.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
