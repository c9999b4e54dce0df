"""Try the kernels of feeding, tracks, sweeps and potentials against their slow twins, many times.

Run as `python -m benchmarks.trust.kernels_of_tracks --count 1000 --seed 0`. A fault is told with its law and
seed, from which the law alone draws its input again: `--law NAME --count 1 --seed SEED`.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
from pathlib import Path

import numba
import numpy as np
import shapely
from rich.progress import Progress

from benchmarks.trust import twins_feeding, twins_space, twins_track

LAWS = {**twins_feeding.LAWS, **twins_track.LAWS, **twins_space.LAWS}

RESULTS = Path("benchmarks/results/trust/kernels_of_tracks.json")


def faults_of(law, seeds, tick):
    """Try a law with each seed; return how many were tried, and what went wrong, by seed."""
    n, faults = 0, {}
    try:
        for seed in seeds:
            try:
                law(np.random.default_rng(seed))
            except Exception as error:  # any error of a kernel or its twin is a fault
                faults[seed] = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
            n += 1
            tick()
    except KeyboardInterrupt:
        return n, faults, True
    return n, faults, False


def main():
    """Run the campaign; exit with 1 if there are faults."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--law", choices=LAWS, help="only this one")
    given = parser.parse_args()
    laws = LAWS if given.law is None else {given.law: LAWS[given.law]}
    begin, results = time.perf_counter(), {}
    with Progress(transient=True) as progress:
        task = progress.add_task("twins", total=given.count * len(laws))
        for name, law in laws.items():
            progress.update(task, description=name)
            seeds = range(given.seed, given.seed + given.count)
            n, faults, stopped = faults_of(law, seeds, lambda: progress.advance(task))
            results[name] = {"cases": n, "faults": faults}
            if stopped:
                break
    for name, result in results.items():
        print(f"{name}: {result['cases']} cases, {len(result['faults'])} faults")
        for seed, what in result["faults"].items():
            print(f"  --law '{name}' --count 1 --seed {seed}: {what}")
    versions = {"python": platform.python_version(), "numpy": np.__version__}
    versions |= {"numba": numba.__version__, "shapely": shapely.__version__}
    record = {
        "seed": given.seed,
        "seconds": time.perf_counter() - begin,
        "versions": versions,
        "laws": results,
    }
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    RESULTS.write_text(json.dumps(record, indent=1))
    return any(result["faults"] for result in results.values())


if __name__ == "__main__":
    sys.exit(main())
