"""Kill -9 amid `longest`, `bench`, `train`, `dataset` and `export`: nothing is lost, no half file is read.

Each command runs once in peace, then in folders of its own until it has been killed COUNT times: half the
times at any moment, half at a moment at which it writes. Then all files must be whole, no process may be
left, and the same command, run again, must end with the same results as in peace, with no other file beside.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.metadata
import json
import os
import platform
import random
import shutil
import signal
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.progress import Progress

from benchmarks.trust.forks import Child, at_write, die, files_in, run, stopped
from hrsnake_env.files import PART

OUT = Path("benchmarks/results/trust")

TIMES = ("seconds", "cpu_seconds", "check_seconds", "timings", "curve")
"""What no two runs agree in."""

MOST_RUNS = 3
"""For each kill: a run that has ended before its kill does not count as one."""

FAST = "--rate 20 --joint-speed 900 --feed-speed 500 --feed-acceleration 9000 --joint-acceleration 9000"
EXPORTS = ("csv", "json", "npz", "yaml", "urdf", "gif", "html")


def without_times(data):
    """Return plain data without what no two runs agree in."""
    if isinstance(data, dict):
        return {key: without_times(value) for key, value in data.items() if key not in TIMES}
    return [without_times(each) for each in data] if isinstance(data, list) else data


def whole_npz(path):
    """Return the arrays of a file."""
    with np.load(path, allow_pickle=False) as data:
        return {name: data[name].tolist() for name in data.files}


def digest(path):
    """Return a short name for the contents of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


class Longest:
    """A search that goes on from its state."""

    name = "longest --state"

    def arguments(self, folder, rng):
        """Return the words of the command."""
        words = "longest straight --accuracy 0.03 --time-budget 600 --state s.json --json"
        return words.split()

    def facts(self, folder):
        """Read everything, as the next run does; return what must be the same."""
        from planners.length_trials import TrialFile, motion_path

        state = folder / "s.json"
        if not state.exists():
            return None
        data = json.loads(state.read_text())
        file = TrialFile.open(state, data["digest"])
        if file.best is not None and len(file.trials) != len(data["trials"]):
            raise AssertionError("a trial lost its motion")
        best = motion_path(state)
        return without_times(data), whole_npz(best) if best.exists() else None


class Bench:
    """A study in cells."""

    name = "bench ladder"

    def arguments(self, folder, rng):
        """Return the words of the command."""
        words = "bench ladder --methods track,sweep --tasks straight,bend-i30 --workers 2 --out o"
        return words.split()

    def facts(self, folder):
        """Read what is there; return the results, None before there are any."""
        from planners.bench.rows import TIMES as ROW_TIMES
        from planners.bench.rows import read_rows

        for path in (folder / "o" / "cells").glob("[!.]*.parquet"):
            read_rows(path)
        if (folder / "o" / "manifest.json").exists():
            json.loads((folder / "o" / "manifest.json").read_text())
        table = folder / "o" / "rows.parquet"
        if not table.exists():
            return None
        rows = read_rows(table)
        return [{key: value for key, value in row.items() if key not in ROW_TIMES} for row in rows]


class Train:
    """A training that is resumed."""

    name = "train --resume"

    def arguments(self, folder, rng):
        """Return the words of the command."""
        words = "train HyperRedundantMaze-Straight-v0 --method dagger --steps 1200 --stop-at 2 --out r --json"
        return [*words.split(), "--resume"]

    def facts(self, folder):
        """Read what is there; return the results, None before there are any."""
        from planners.rl.checkpoints import read_model, read_progress
        from planners.rl.clone import Lessons

        if (folder / "r" / "checkpoint.zip").exists():
            read_progress(folder / "r" / "checkpoint.zip")
            read_model(folder / "r" / "checkpoint.zip", Lessons.load)
        policy = folder / "r" / "policy.npz"
        policy = whole_npz(policy) if policy.exists() else None
        if not (folder / "r" / "run.json").exists():
            return None
        return without_times(json.loads((folder / "r" / "run.json").read_text())), policy


class Dataset:
    """A data set of a planner's episodes."""

    name = "dataset"

    def arguments(self, folder, rng):
        """Return the words of the command."""
        return [
            "dataset",
            "arm/peace-v0",
            "--env",
            "HyperRedundantMaze-Straight-v0",
            "--episodes",
            "2",
            "--path",
            "d",
            "--json",
        ]

    def facts(self, folder):
        """Read what is there; return the results, None before there are any."""
        from minari.dataset.minari_dataset import MinariDataset

        if not (folder / "d" / "arm" / "peace-v0").exists():
            return None
        data = MinariDataset((folder / "d" / "arm" / "peace-v0" / "data").absolute())
        return [
            [episode.actions.tolist(), episode.rewards.tolist(), episode.observations.tolist()]
            for episode in data.iterate_episodes()
        ]


class Export:
    """An export in any format, over an old file or none."""

    name = "export"

    def arguments(self, folder, rng):
        """Return the words of the command."""
        ending = rng.choice(EXPORTS)
        if rng.random() < 0.5:
            (folder / f"a.{ending}").write_text("old")
        motion = folder.parent / "motion.npz"
        return f"export straight {motion} --out a.{ending} --metres-per-unit 0.001 --json {FAST}".split()

    def facts(self, folder):
        """Return what is there; None of the old file."""
        files = [path for path in folder.iterdir() if path.name.startswith("a.")]
        if not files or files[0].read_bytes() == b"old":
            return None
        return [files[0].name, digest(files[0])]


COMMANDS = {command.name: command for command in (Longest(), Bench(), Train(), Dataset(), Export())}


def warm(base, names):
    """Load and compile what the commands need, and write the motion that is exported.

    The first words of their names tell them.
    """
    kinds = {name.split()[0] for name in names}
    if "train" in kinds:
        from planners.rl import clone, fitting

        clone.TESTS, clone.LEAST_STEPS = 1, 300  # the files are at stake, not the figures
        fitting.UPDATES, fitting.CHECK = 40, 20
    peace = base / "warm"
    peace.mkdir()
    before, words = os.getcwd(), sys.argv
    os.chdir(peace)
    sink = os.open(os.devnull, os.O_WRONLY)
    kept = os.dup(1)
    try:
        os.dup2(sink, 1)
        motion = base / "motion.npz"
        whole = [
            command.arguments(peace, random.Random(0))
            for command in (Longest(), Dataset(), Train())
            if command.name.split()[0] in kinds
        ]
        exports = [
            f"export straight {motion} --out a.{ending} --metres-per-unit 0.001 {FAST}"
            for ending in EXPORTS
            if "export" in kinds
        ]
        plan = f"plan straight --link-length 100 --out {motion} --json"
        for words_of in (plan.split(), *whole, *(export.split() for export in exports)):
            sys.argv = ["hrsnake", *words_of]
            try:
                from planners import cli

                cli.main()
            except SystemExit as end:
                if end.code:
                    raise RuntimeError(f"{sys.argv} ended with {end.code}") from end
            sys.stdout.flush()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(sink)
        os.chdir(before)
        sys.argv = words


def in_peace(command, base, seed):
    """Run a command to its end.

    Returns
    -------
    facts, names, seconds, writes : list, list of str, float, int
        Of the whole run.
    """
    folder = base / "peace"
    folder.mkdir()
    count = base / "writes"

    def prepare():
        seen = 0

        from benchmarks.trust import forks

        def hook(event, arguments):
            nonlocal seen
            if event in forks.WRITES and forks._writes(event, arguments):
                seen += 1
                with open(count, "w") as file:  # outside the folder, so it does not count
                    file.write(str(seen))

        sys.addaudithook(hook)

    child = run(command.arguments(folder, random.Random(seed)), folder, prepare)
    if child.code != 0:
        raise RuntimeError(f"{command.name} ended with {child.code}: {child.words()}")
    seconds = time.monotonic() - child.started
    found = command.facts(folder), files_in(folder), seconds, int(count.read_text())
    shutil.rmtree(folder)
    return found


def attack(command, base, seed, peace):
    """Kill a command once and run it again.

    Returns
    -------
    faults : list of str
        What was wrong; empty if nothing was.
    killed : bool
        Whether it still ran when it was killed.
    """
    facts, names, seconds, writes = peace
    rng = random.Random(f"{command.name} {seed}")
    folder = base / "attack"
    folder.mkdir()
    draw = rng.getrandbits(32)
    arguments = command.arguments(folder, random.Random(draw))
    group, faults = rng.random() < 0.5, []
    if rng.random() < 0.5:
        delay = rng.choice([0.0, rng.uniform(1e-5, 5e-3)])
        child = Child(arguments, folder, at_write(rng.randrange(writes), delay, die))
        child.wait()
    else:
        child = Child(arguments, folder)
        child.wait(rng.uniform(0.0, seconds))
        child.send(signal.SIGKILL, group)
        child.wait()
    killed = child.code in (-signal.SIGKILL, -signal.SIGALRM)
    if not killed and child.code != 0:
        faults.append(f"ended by itself with {child.code}: {child.words()[-2000:]}")
    if child.left():
        faults.append("a process was left behind")
    try:
        done = command.facts(folder)
    except Exception as error:
        faults.append(f"half a file was taken for a whole one: {type(error).__name__}: {error}")
        done = None
    if isinstance(command, Export):
        facts, names = peace_of_export(base, arguments)
        if done not in (None, facts):
            faults.append("half a file stands where a whole one should")
    if command.name != "dataset" or done is None:
        again = run(arguments, folder)
        if again.code != 0:
            faults.append(f"the next run ended with {again.code}: {again.words()[-2000:]}")
        elif command.facts(folder) is None:
            faults.append("the next run left no result")
    if not faults:
        if command.facts(folder) != facts:
            faults.append("the result is another one than in peace")
        if [name for name in files_in(folder) if PART not in name] != names:
            faults.append(f"files differ from those in peace: {files_in(folder)}")
        if command.name != "dataset" and files_in(folder) != names:
            faults.append(f"unfinished files are left: {files_in(folder)}")
    if faults:
        kept = OUT / "kills" / f"{command.name.split()[0]}-{seed}"
        shutil.rmtree(kept, ignore_errors=True)
        shutil.copytree(folder, kept)
    shutil.rmtree(folder)
    return faults, killed


_exports = {}


def peace_of_export(base, arguments):
    """Return what an export writes in peace; each format is run once."""
    key = tuple(arguments)
    if key not in _exports:
        folder = base / "format"
        folder.mkdir()
        child = run(arguments, folder)
        assert child.code == 0, child.words()
        _exports[key] = Export().facts(folder), files_in(folder)
        shutil.rmtree(folder)
    return _exports[key]


def campaign(count, seed, names, bar, figures):
    """Attack the commands; put what is found into the figures by command."""
    with tempfile.TemporaryDirectory(prefix="hrsnake-kills-") as name:
        base = Path(name).resolve()
        warm(base, names)
        tasks = {each: bar.add_task(each, total=count) for each in names}
        for each in names:
            command, start = COMMANDS[each], time.monotonic()
            peace = in_peace(command, base, seed)
            figures[each] = figure = {"cases": 0, "killed": 0, "writes": peace[3], "faults": []}
            for number in range(seed, seed + MOST_RUNS * count):
                if figure["killed"] == count:
                    break
                found, killed = attack(command, base, number, peace)
                figure["cases"] += 1
                figure["killed"] += killed
                figure["seconds"] = round(time.monotonic() - start, 1)
                for fault in found:
                    figure["faults"].append({"seed": number, "fault": fault})
                    print(f"{each}, --command '{each}' --seed {number} --count 1: {fault}", flush=True)
                bar.update(tasks[each], completed=figure["killed"])
                bar.refresh()


def main():
    """Run the campaign; return 1 if a fault was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=100, help="kills of each command")
    parser.add_argument("--seed", type=int, default=0, help="of the first kill")
    parser.add_argument("--command", action="append", choices=list(COMMANDS), help="by default all")
    options = parser.parse_args()
    if "DISPLAY" in os.environ:
        os.environ.setdefault("MPLBACKEND", "agg")
    figures, names = {}, options.command or list(COMMANDS)
    with Progress(auto_refresh=False) as bar:  # no thread beside a process that forks
        cut = stopped(lambda: campaign(options.count, options.seed, names, bar, figures))
    for name, figure in figures.items():
        print(
            f"{name}: {figure['cases']} runs, {figure['killed']} of them killed amid their work, "
            f"{len(figure['faults'])} faults"
        )
    OUT.mkdir(parents=True, exist_ok=True)
    versions = {name: importlib.metadata.version(name) for name in ("numpy", "numba", "pyarrow", "minari")}
    record = {
        "seed": options.seed,
        "commands": figures,
        "versions": versions,
        "python": platform.python_version(),
    }
    (OUT / "kills.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return 130 if cut else int(any(figure["faults"] for figure in figures.values()))


if __name__ == "__main__":
    sys.exit(main())
