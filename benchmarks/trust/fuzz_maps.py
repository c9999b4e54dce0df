"""Feed the readers of maps with broken and hostile files.

    python -m benchmarks.trust.fuzz_maps --count 10000

Each reader (GeoJSON, ROS maps, images, SVG, DXF) gets so many drawn inputs, after attacks that have names.
They are read in a process of its own with limits; what hangs or dies there is a fault, and reading goes on in
a new one. A share goes through `Maze.load`, through memory as uploads do, and through `hrsnake import`.
Inputs that break a law go to `benchmarks/results/trust/fuzz_maps/`, figures to `fuzz_maps.json` beside it.
With --atheris, coverage says which inputs to go on with; it needs the package of that name.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import platform
import signal
import sys
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmarks.trust.map_attacks import ATTACKS
from benchmarks.trust.map_inputs import KINDS, Input, drawn
from benchmarks.trust.map_laws import LAWS, SECONDS, empty_folder, fault_of, limit_memory, watch_files
from benchmarks.trust.map_seeds import seeds

__all__ = ["attack", "attacks", "faults_in"]

RESULTS = Path(__file__).parent.parent / "results" / "trust"
PACKAGES = ("numpy", "scipy", "shapely", "numba", "pillow", "pyyaml", "svgelements", "ezdxf")
PATIENCE = 4.0
"""Wall time per second of `SECONDS` after which a process is ended: the machine may have other work."""


def attack(kind, name):
    """Return an attack as an input."""
    ending = {"ros": ".yaml", "image": ".png"}.get(kind, f".{kind}")
    files = {f"map{ending}": ATTACKS[kind][name]()}
    if kind == "ros":
        files["room.pgm"] = seeds("image")[0][1]
    return Input(main=f"map{ending}", files=files)


def attacks(kind):
    """Return (label, input builder) of each attack; GeoJSON ones are read as mazes, too."""
    hows = ("map", "maze", "cli") if kind == "geojson" else ("map", "cli")
    return [(f"{name} ({how})", name, how) for name in ATTACKS[kind] for how in hows]


def _given(kind, seed, task):
    """Return the input of a task: a number, or an attack."""
    if isinstance(task, int):
        return drawn(kind, seed, task)
    whole = attack(kind, task[1])
    return Input(main=whole.main, files=whole.files, how=task[2])


def _work(connection, kind, seed, tasks):
    """Read inputs in this process and send back what is wrong with each."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # libtiff tells of damaged images there
    watch_files()
    with empty_folder() as folder:
        for ending, data in seeds(kind):  # what is imported and compiled once does not count
            files = {f"map{ending}": data, "room.pgm": seeds("image")[0][1]}
            for how in ("map", "cli", *(["maze"] if kind == "geojson" else [])):
                fault_of(Input(main=f"map{ending}", files=files, how=how), folder)
        for each in folder.iterdir():
            each.unlink()
        limit_memory()
        connection.send("ready")
        for task in tasks:
            given = _given(kind, seed, task)
            connection.send(fault_of(given, folder))
            for each in folder.iterdir():
                each.unlink()


def faults_in(kind, seed, tasks):
    """Yield (task, fault or None), for tasks that are numbers or attacks, each read under the limits."""
    context, left = multiprocessing.get_context("fork"), list(tasks)
    while left:
        here, there = context.Pipe(duplex=False)
        worker = context.Process(target=_work, args=(there, kind, seed, left), daemon=True)
        worker.start()
        there.close()
        try:
            ready = False
            while left:
                if not here.poll(PATIENCE * SECONDS if ready else 300.0):
                    yield left.pop(0), ("time", "it hangs")
                    break
                answer = here.recv()
                if answer == "ready":
                    ready = True
                    continue
                yield left.pop(0), answer
        except EOFError:
            worker.join()
            yield left.pop(0), ("memory", f"the process died: exit code {worker.exitcode}")
        finally:
            worker.kill()
            worker.join()
            here.close()


def keep(kind, seed, task, folder):
    """Write the files of an input that broke a law; return the way to read it again."""
    given = _given(kind, seed, task)
    label = (
        str(task) if isinstance(task, int) else task[0].replace(" ", "-").replace("(", "").replace(")", "")
    )
    place = folder / f"{kind}-{seed}-{label}"
    place.mkdir(parents=True, exist_ok=True)
    for name, data in given.files.items():
        (place / name).write_bytes(data)
    if isinstance(task, int):
        return f"--kind {kind} --seed {seed} --first {task} --count 1 ({given.how}, {given.options})"
    return f"--kind {kind} --attacks: {task[0]}"


def campaign(kinds, seed, numbers, with_attacks, results):
    """Read all inputs; fill in cases and faults by kind as they come."""
    columns = (TextColumn("{task.description:8}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, transient=True) as bars:
        for kind in kinds:
            found = results[kind] = {"cases": 0, "faults": [], "seconds": 0.0}
            tasks = [*(attacks(kind) if with_attacks else []), *numbers]
            row, begin = bars.add_task(kind, total=len(tasks)), time.monotonic()
            for task, fault in faults_in(kind, seed, tasks):
                found["cases"] += 1
                found["seconds"] = round(time.monotonic() - begin, 1)
                bars.advance(row)
                if fault is not None:
                    again = keep(kind, seed, task, RESULTS / "fuzz_maps")
                    found["faults"].append({"law": fault[0], "fault": fault[1], "again": again})
                    bars.console.print(f"{kind}: {fault[0]}: {again}", markup=False, highlight=False)
                    bars.console.print(f"    {fault[1].strip()}", markup=False, highlight=False)


def main():
    """Run the campaign."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=10_000, help="drawn inputs for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input, to repeat one")
    parser.add_argument("--kind", action="append", choices=KINDS, help="by default all")
    parser.add_argument("--attacks", action="store_true", help="the attacks alone")
    parser.add_argument("--atheris", action="store_true", help="let coverage guide, for one --kind")
    options = parser.parse_args()
    if options.atheris:
        from benchmarks.trust.map_coverage import guided

        guided(options.kind[0] if options.kind else "geojson", options.count, options.seed)
        return
    numbers = [] if options.attacks else list(range(options.first, options.first + options.count))
    results: dict[str, dict[str, object]] = {}
    try:
        campaign(options.kind or KINDS, options.seed, numbers, options.first == 0, results)
    except KeyboardInterrupt:
        print("Stopped; what was read so far:")
    for kind, found in results.items():
        print(f"{kind}: {found['cases']:,} inputs in {found['seconds']:.0f} s, {len(found['faults'])} faults")
    cases, faults = (
        sum(each["cases"] for each in results.values()),
        [f for each in results.values() for f in each["faults"]],
    )
    for law, words in LAWS.items():
        print(f"{law}: {words}: {cases:,} cases, {sum(fault['law'] == law for fault in faults)} faults")
    RESULTS.mkdir(parents=True, exist_ok=True)
    versions = {"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}}
    whole = {"seed": options.seed, "kinds": results, "laws": LAWS, "versions": versions}
    (RESULTS / "fuzz_maps.json").write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")
    sys.exit(1 if faults else 0)


def _version(package):
    try:
        return version(package)
    except PackageNotFoundError:
        return None


if __name__ == "__main__":
    main()
