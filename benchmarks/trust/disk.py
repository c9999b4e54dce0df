"""Every command that writes, where it cannot: one sentence, exit code 2, the old file intact, no half one.

The disk is full (a small tmpfs where mounting is allowed, and a limit of the size of files), the folder or
the file is read-only, missing, of another kind, or its name is too long.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from rich.progress import Progress

from benchmarks.trust.forks import run, stopped
from benchmarks.trust.kills import FAST, OUT, warm
from hrsnake_env.files import LOCK, PART

FILES = {
    "plan --out": ("plan straight --link-length 100 --out {out}", ".npz"),
    "plan --picture": ("plan straight --link-length 100 --picture {out}", ".png"),
    "longest --state": ("longest straight --accuracy 0.05 --state {out}", ".json"),
    "longest --plot": ("longest straight --accuracy 0.05 --plot {out}", ".pdf"),
    "longest --out": ("longest straight --accuracy 0.05 --out {out}", ".npz"),
    "simulate --replay": ("simulate straight {motion} --replay {out}", ".html"),
    "simulate --out": ("simulate straight {motion} --out {out}", ".gif"),
    **{
        f"export {ending}": (
            f"export straight {{motion}} --metres-per-unit 0.001 --out {{out}} {FAST}",
            ending,
        )
        for ending in (".csv", ".json", ".npz", ".yaml", ".urdf", ".gif", ".mp4", ".html")
    },
    "draw png": ("draw straight {motion} --out {out}", ".png"),
    "draw svg": ("draw straight --out {out}", ".svg"),
    "import --out": ("import {maps}/duct.yaml --base 0.1,0.5,0 --goal 10,0.5 --out {out}", ".geojson"),
    "import --picture": ("import {maps}/duct.yaml --picture {out}", ".png"),
    "evaluate --replay": ("evaluate u-turn-i60-ppo-planned --episodes 1 --replay {out}", ".html"),
    "spatial plan --out": ("spatial plan paired-panels --link-length 90 --out {out}", ".npz"),
    "spatial plan --page": ("spatial plan paired-panels --link-length 90 --page {out}", ".html"),
}
"""Commands that write a file: the words, and how the file's name ends."""

FOLDERS = {
    "bench --out": "bench ladder --methods track,sweep --tasks straight --workers 1 --out {out}",
    "train --out": "train HyperRedundantMaze-Straight-v0 --method dagger --steps 300 --stop-at 2 --out {out}",
    "dataset --path": "dataset arm/x-v0 --env HyperRedundantMaze-Straight-v0 --episodes 1 --path {out}",
    "demo --out": "demo --out {out}",
}
"""Commands that write a folder."""

OLD = b"old"


LOADED_LATER = (
    "concurrent.futures.process",
    "hrsnake_env.maps.picture",
    "hrsnake_env.replay",
    "minari",
    "planners.bench.campaign",
    "planners.bench.studies",
    "planners.dataset",
    "planners.demo",
    "planners.drawing",
    "planners.longest_chart",
    "planners.rl.evaluate",
    "planners.spatial.viewer",
)
"""Modules that commands load at need, and that somebody who owns nothing may not be able to read."""


def limited():
    """Let no file become larger than a few bytes."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))


def nobody():
    """Be a user that owns nothing."""
    if os.getuid() == 0:
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)


def ways(name, place):
    """Yield the ways in which a command cannot write: a name, where to write, and what to do in the child.

    `place` is an empty folder for each.
    """
    is_file = name in FILES
    ending = FILES[name][1] if is_file else ""
    out = place / f"a{ending}"

    def old():
        if is_file:
            out.write_bytes(OLD)
        return out

    def full():
        if not mounted(place):
            return None
        old()
        (place / "filler").write_bytes(b"")
        with open(place / "filler", "wb", buffering=0) as file:
            try:
                while file.write(b"x" * 4096) == 4096:
                    pass
            except OSError:
                pass
        return out

    def closed(mode=0o555):
        place.chmod(mode)
        return out

    yield "full", full, lambda: None
    yield "limit of size", old, limited
    yield "read-only folder", lambda: (old(), closed())[1], nobody
    yield (
        "no such folder",
        lambda: place / "none" / "deep" / f"a{ending}" if is_file else "/proc/none/a",
        nobody,
    )
    if is_file:
        yield "read-only file", lambda: (old().chmod(0o444), place.chmod(0o777), out)[2], nobody
        yield "a folder", lambda: (out.mkdir(), out)[1], lambda: None
        yield "no file", lambda: (os.mkfifo(out), out)[1], lambda: None
        yield "name too long", lambda: place / f"{'a' * 300}{ending}", lambda: None
    else:
        yield "a file", lambda: (out.write_bytes(OLD), out)[1], lambda: None
        yield "name too long", lambda: place / ("a" * 300), lambda: None


def mounted(place):
    """Put a small disk at a folder; False if that is not allowed."""
    words = ["mount", "-t", "tmpfs", "-o", "size=64k,mode=777", "tmpfs", str(place)]
    try:
        return subprocess.run(words, capture_output=True).returncode == 0
    except OSError:
        return False


def attack(name, way, make, prepare, base, place):
    """Run a command where it cannot write; return what was wrong, None if that could not be tried here."""
    out = make()
    if out is None:
        return None
    words = (FILES[name][0] if name in FILES else FOLDERS[name]).format(
        out=out, motion=base / "motion.npz", maps=Path("docs/maps").resolve()
    )
    before = out.read_bytes() if isinstance(out, Path) and way != "name too long" and out.is_file() else None
    child = run(words.split(), base / "here", prepare)
    said, faults = child.words(), []
    if child.code != 2:
        faults.append(f"it ended with {child.code}")
    if "Traceback" in said or "Exception ignored" in said or said.count("hrsnake: ") != 1:
        faults.append("it did not say one sentence")
    if before is not None and out.read_bytes() != before:
        faults.append("the old file is not what it was")
    half = [path.name for path in place.rglob("*") if path.name.startswith((PART, ".recording", LOCK))]
    if half:
        faults.append(f"files were left: {half}")
    return [f"{name}, {way}: {fault}: {said[-1500:]}" for fault in faults]


def campaign(names, bar, figures):
    """Try all ways with the commands; put what is found into the figures by way."""
    with tempfile.TemporaryDirectory(prefix="hrsnake-disk-") as top:
        base = Path(top).resolve()
        base.chmod(0o755)
        for module in LOADED_LATER:
            importlib.import_module(module)
        (base / "here").mkdir()
        (base / "here").chmod(0o777)
        warm(base, names)
        task = bar.add_task("disk", total=len(names))
        for name in names:
            for k in range(len(list(ways(name, base)))):
                place = base / "place"
                place.mkdir()
                place.chmod(0o777)
                way, make, prepare = list(ways(name, place))[k]
                figure = figures.setdefault(way, {"cases": 0, "faults": []})
                try:
                    found = attack(name, way, make, prepare, base, place)
                finally:
                    if os.path.ismount(place):
                        subprocess.run(["umount", str(place)], check=True)
                    shutil.rmtree(place)
                if found is not None:
                    figure["cases"] += 1
                    figure["faults"] += found
                    for fault in found:
                        print(fault, flush=True)
            bar.advance(task)
            bar.refresh()


def main():
    """Run the campaign; return 1 if a fault was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--command", action="append", choices=[*FILES, *FOLDERS], help="by default all")
    options = parser.parse_args()
    os.environ.setdefault("MPLBACKEND", "agg")
    figures, names = {}, options.command or [*FILES, *FOLDERS]
    with Progress(auto_refresh=False) as bar:  # no thread beside a process that forks
        cut = stopped(lambda: campaign(names, bar, figures))
    for way, figure in figures.items():
        print(f"{way}: {figure['cases']} commands, {len(figure['faults'])} faults")
    OUT.mkdir(parents=True, exist_ok=True)
    record = {"ways": figures, "python": platform.python_version()}
    (OUT / "disk.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return 130 if cut else int(any(figure["faults"] for figure in figures.values()))


if __name__ == "__main__":
    sys.exit(main())
