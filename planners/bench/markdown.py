"""What tables of results are written with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

__all__ = ["milliseconds", "parts_in_markdown", "table"]


def parts_in_markdown(
    results: Mapping[str, Any], writers: Mapping[str, Callable[[Any], Iterator[str]]]
) -> str:
    """Write all parts that were measured, in the order of the writers, below a line about the machine."""
    lines = [measured_on(results)]
    for part, write in writers.items():
        if part in results:
            lines += ["", *write(results[part])]
    return "\n".join(lines)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Write a table in Markdown, line by line."""
    yield "| " + " | ".join(head) + " |"
    yield "|---" * len(head) + "|"
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def milliseconds(seconds: float) -> str:
    """Write a time in ms."""
    return f"{seconds * 1e3:.3g} ms"


def measured_on(results: Mapping[str, Any]) -> str:
    """Say in one sentence on which machine a run was, how long it took, and how busy the machine was."""
    machine = results["machine"]
    load, later = machine["load"], results["load_at_end"]
    busy = f", load {load[0]:.1f} at the start and {later[0]:.1f} at the end" if load and later else ""
    return (
        f"Measured in one run of {results['seconds']:.0f} s on {machine['cores']} cores of "
        f"{machine['processor']} ({machine['platform']}), Python {machine['python']}{busy}."
    )
