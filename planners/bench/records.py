"""What every benchmark does besides measuring: run its parts, name machine and load, write the results."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing

__all__ = ["check_parts", "machine", "run_parts", "write_results"]


def check_parts(parts: Sequence[str], known: Sequence[str]) -> None:
    """Refuse parts that are not there.

    Raises
    ------
    InputError
        If there is no such part.
    """
    if unknown := [part for part in parts if part not in known]:
        raise InputError(f"Unknown part {unknown[0]!r}. Available: {', '.join(known)}.")


def run_parts(
    parts: Sequence[str],
    known: Sequence[str],
    workers: int | None,
    measure: Callable[[str, int], Any],
    warm_up: Callable[[], None] = lambda: None,
) -> dict[str, Any]:
    """Measure the wanted ones of all known parts, in the order of these.

    Parameters
    ----------
    parts, known : sequence of str
        What is wanted, and what there is.
    workers : int or None
        Processes at a time; None is one for each processor.
    measure : callable
        Given a part and the number of workers, returns its figures.
    warm_up : callable
        Called before the first part.

    Returns
    -------
    results : dict
        Plain data by part, with machine, workers, seconds and load.

    Raises
    ------
    InputError
        If there is no such part.
    """
    check_parts(parts, known)
    count = os.cpu_count() or 1 if workers is None else workers
    start = time.perf_counter()
    results: dict[str, Any] = {"machine": machine(), "workers": count}
    warm_up()
    for part in known:
        if part in parts:
            results[part] = measure(part, count)
    results["seconds"] = time.perf_counter() - start
    results["load_at_end"] = load()
    return results


def machine() -> dict[str, Any]:
    """Name the machine, and how busy it is."""
    return {
        "platform": platform.platform(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "load": load(),
    }


def load() -> list[float] | None:
    """Return how many processes wanted to run in the last 1, 5 and 15 minutes, where the system tells it."""
    return list(os.getloadavg()) if hasattr(os, "getloadavg") else None


def write_results(results: dict[str, Any], path: Path) -> None:
    """Write results as JSON, completely or not at all."""
    with replacing(path) as part:
        part.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


def _processor() -> str:
    """Return the processor's name where the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
