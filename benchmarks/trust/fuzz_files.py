"""Feed every reader of files and requests (but those of maps) with broken input.

    python -m benchmarks.trust.fuzz_files --count 10000

A reader may refuse with one sentence. It may not raise anything else, hang, take much memory, write a file,
or run what was planted in a pickle. Faults are written to `benchmarks/results/trust/fuzz_files/`.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.metadata
import json
import pickle
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zlib
from pathlib import Path

import numpy as np

from benchmarks.trust.file_readers import PLANTED, READERS
from hrsnake_env.errors import InputError
from planners.bench.pool import bar

SECONDS, WAIT, BYTES, SENTENCE = 10.0, 60.0, 2**30, 10_000
"""That one input may take: of the processor, on the clock, of memory; and characters of a message."""

OUT = Path("benchmarks/results/trust")

PACKAGES = ("hrsnake", "numpy", "pyarrow", "pyyaml", "pydantic", "torch", "stable-baselines3")


class Hung(BaseException):
    """Say that reading took too long."""


def rng_of(reader, seed, number):
    """Return the random numbers of one case: the same for the same arguments, on every machine."""
    return np.random.default_rng((zlib.crc32(reader.name.encode()), seed, number))


def fault_of(reader, data, folder):
    """Let a reader read an input; return what is wrong with how it does, or an empty string."""
    path = folder / f"input{reader.ending}"
    if reader.ending:
        path.write_bytes(data)
    before, begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    signal.setitimer(signal.ITIMER_REAL, WAIT)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            reader.read(path if reader.ending else data)
        fault = ""
    except InputError as error:
        text = str(error)
        fault = f"no sentence: {text[:300]!r}" if "\n" in text or len(text) > SENTENCE else ""
    except Hung:
        fault = "it hangs"
    except Exception:
        fault = traceback.format_exc(limit=-4)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    if time.process_time() - begin > SECONDS:
        fault = fault or "it hangs"
    if 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) > BYTES:
        fault = fault or "it takes more than 1 GiB"
    if PLANTED.exists():
        PLANTED.unlink()
        fault = "what was planted in a pickle was run"
    with contextlib.suppress(FileNotFoundError):
        path.unlink()
    if left := [each.name for each in folder.iterdir()]:
        fault = fault or f"it has written {left}"
    return fault


@contextlib.contextmanager
def watched():
    """Let what takes too long be ended, and yield an empty folder."""

    def late(number, frame):
        raise Hung

    old = signal.signal(signal.SIGALRM, late)
    try:
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder)
    finally:
        signal.signal(signal.SIGALRM, old)


def campaign(readers, count, seed, first=0):
    """Read so many inputs each; return cases and faults by reader."""
    found = {}
    with watched() as folder:
        for reader in readers:
            faults, done, begin = [], 0, time.monotonic()
            with contextlib.suppress(Exception):  # what compiles or is imported once shall not count
                fault_of(reader, reader.draw(rng_of(reader, seed, 0)), folder)
            found[reader.name] = {"cases": 0, "faults": faults, "seconds": 0.0}
            with bar(reader.name[:10], count) as tell:
                for number in range(first, first + count):
                    data = reader.draw(rng_of(reader, seed, number))
                    fault = fault_of(reader, data, folder)
                    done += 1
                    if fault:
                        faults.append({"number": number, "fault": fault})
                        keep(reader, seed, number, data)
                    found[reader.name].update(cases=done, seconds=round(time.monotonic() - begin, 2))
                    tell()
            yield reader.name, found


def keep(reader, seed, number, data):
    """Write an input that a reader fell over."""
    folder = OUT / "fuzz_files"
    folder.mkdir(parents=True, exist_ok=True)
    name = f"{reader.name.replace(' ', '-').replace(':', '')}-{seed}-{number}{reader.ending or '.pkl'}"
    (folder / name).write_bytes(data if isinstance(data, bytes) else pickle.dumps(data))


def main():
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=10_000, help="inputs for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input, to repeat one")
    parser.add_argument("--reader", action="append", choices=list(READERS), help="by default all")
    options = parser.parse_args()
    chosen = [READERS[name] for name in options.reader or READERS]
    found = {}
    with contextlib.suppress(KeyboardInterrupt):
        for name, found in campaign(chosen, options.count, options.seed, options.first):
            one = found[name]
            print(
                f"{name}: {one['cases']} inputs, {len(one['faults'])} faults, {one['seconds']:.0f} s",
                flush=True,
            )
            for fault in one["faults"][:5]:
                print(
                    f"  --reader '{name}' --seed {options.seed} --first {fault['number']} --count 1",
                    flush=True,
                )
                print("    " + fault["fault"].strip().replace("\n", "\n    "), flush=True)
    versions = {}
    for package in PACKAGES:
        with contextlib.suppress(importlib.metadata.PackageNotFoundError):
            versions[package] = importlib.metadata.version(package)
    OUT.mkdir(parents=True, exist_ok=True)
    result = {"seed": options.seed, "readers": found, "versions": versions, "python": sys.version.split()[0]}
    (OUT / "fuzz_files.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    sys.exit(1 if any(one["faults"] for one in found.values()) else 0)


if __name__ == "__main__":
    main()
