"""Ctrl-C at any moment of every long command: exit code 130, one sentence, no half-written file.

Each command runs once in peace; then COUNT times it gets SIGINT, as its whole process group gets it from
a terminal. It must end by itself, within seconds, with 130, or with its own code if it was done before.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

from rich.progress import Progress

from benchmarks.trust.forks import Child, run, stopped
from benchmarks.trust.kills import FAST, OUT, warm
from hrsnake_env.files import LOCK, PART

STOPPED = "hrsnake: stopped; no half-written file is left.\n"

BAD = ("Traceback", "Exception ignored", "Segmentation", "SystemError", "Fatal Python", "Error")

PATIENCE_S = 20.0
"""Within which a command must end, on a machine that others use, too."""

COMMANDS = {
    "plan": "plan U40 --link-length 300 --out a.npz --picture a.png",
    "longest": "longest straight --accuracy 0.03 --state s.json --plot s.png --json",
    "simulate": "simulate straight {motion} --replay a.html --out a.gif",
    "export gif": f"export straight {{motion}} --out a.gif {FAST}",
    "export mp4": f"export straight {{motion}} --out a.mp4 {FAST}",
    "export csv": f"export straight {{motion}} --out a.csv {FAST}",
    "draw": "draw straight {motion} --out a.png",
    "import": "import {maps}/duct.yaml --picture a.png --base 0.1,0.5,0 --goal 10,0.5 --out a.geojson",
    "bench": "bench ladder --methods track,sweep --tasks straight,bend-i30 --workers 2 --out o",
    "train": "train HyperRedundantMaze-Straight-v0 --method dagger --steps 1200 --stop-at 2 --out r --json",
    "dataset": "dataset arm/peace-v0 --env HyperRedundantMaze-Straight-v0 --episodes 2 --path d --json",
    "evaluate": "evaluate u-turn-i60-ppo-planned --episodes 2 --replay a.html",
    "demo": "demo --out d",
    "spatial plan": "spatial plan paired-panels --link-length 90 --out m3.npz --page m3.html",
    "studio": "studio --no-browser --port 9130",
}


def arguments(name, base):
    """Return the words of a command."""
    maps = Path("docs/maps").resolve()
    return COMMANDS[name].format(motion=base / "motion.npz", maps=maps).split()


def faults_of(child, normal, folder):
    """Return what was wrong with an end."""
    faults, words = [], child.words()
    if child.code is None:
        child.send(signal.SIGKILL)
        child.wait()
        faults.append("it did not end")
    elif child.code not in (130, normal):
        faults.append(f"it ended with {child.code}")
    if child.code == 130 and words.count(STOPPED) != 1:
        faults.append("it did not say its sentence once")
    faults += [f"it said '{word}'" for word in BAD if word in words]
    if child.left():
        faults.append("a process was left behind")
    half = [path.name for path in folder.rglob("*") if path.name.startswith((PART, LOCK))]
    if half:
        faults.append(f"files were left: {half}")
    return [f"{fault}: {words[-1500:]}" for fault in faults]


def attack(name, base, seed, seconds, normal):
    """Press Ctrl-C once amid a command.

    Returns
    -------
    faults, code : list of str, int
        What was wrong, and the exit code.
    """
    rng = random.Random(f"{name} {seed}")
    with tempfile.TemporaryDirectory(dir=base) as place:
        folder = Path(place) / "attack"
        folder.mkdir()
        child = Child(arguments(name, base), folder)
        child.wait(0.03 + rng.uniform(0.0, seconds))  # its handler is there after the first moment
        child.send(signal.SIGINT)
        child.wait(PATIENCE_S)
        return faults_of(child, normal, folder), child.code


def campaign(count, seed, names, bar, figures):
    """Attack the commands; put what is found into the figures by command."""
    with tempfile.TemporaryDirectory(prefix="hrsnake-ctrl-c-") as place:
        base = Path(place).resolve()
        warm(base, names)
        for name in names:
            task = bar.add_task(name, total=count)
            peace = base / "peace" / name
            peace.mkdir(parents=True)
            seconds, normal = 3.0, 0
            if name != "studio":  # it never ends by itself
                run(arguments(name, base), peace)
                (peace / "again").mkdir()
                child = run(arguments(name, base), peace / "again")
                seconds, normal = time.monotonic() - child.started, child.code
                if normal not in (0, 3):
                    raise RuntimeError(f"{name} ended with {normal}: {child.words()}")
            figures[name] = figure = {"cases": 0, "interrupted": 0, "faults": []}
            start = time.monotonic()
            for number in range(seed, seed + count):
                found, code = attack(name, base, number, seconds, normal)
                figure["cases"] += 1
                figure["interrupted"] += code == 130 or name == "studio"  # to which it is the usual end
                figure["seconds"] = round(time.monotonic() - start, 1)
                for fault in found:
                    figure["faults"].append({"seed": number, "fault": fault})
                    print(f"--command '{name}' --seed {number} --count 1: {fault}", flush=True)
                bar.advance(task)
                bar.refresh()


def main():
    """Run the campaign; return 1 if a fault was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=40, help="times of each command")
    parser.add_argument("--seed", type=int, default=0, help="of the first time")
    parser.add_argument("--command", action="append", choices=list(COMMANDS), help="by default all")
    options = parser.parse_args()
    os.environ.setdefault("MPLBACKEND", "agg")
    figures, names = {}, options.command or list(COMMANDS)
    with Progress(auto_refresh=False) as bar:  # no thread beside a process that forks
        cut = stopped(lambda: campaign(options.count, options.seed, names, bar, figures))
    for name, figure in figures.items():
        print(
            f"Ctrl-C in {name}: {figure['cases']} times, {figure['interrupted']} amid its work, "
            f"{len(figure['faults'])} faults"
        )
    OUT.mkdir(parents=True, exist_ok=True)
    versions = {name: importlib.metadata.version(name) for name in ("numpy", "numba", "pymunk", "typer")}
    record = {
        "seed": options.seed,
        "commands": figures,
        "versions": versions,
        "python": platform.python_version(),
    }
    (OUT / "ctrl_c.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return 130 if cut else int(any(figure["faults"] for figure in figures.values()))


if __name__ == "__main__":
    sys.exit(main())
