"""The tables of the comparison in `docs/comparison.md` and `README.md`, from the rows in `docs/comparison/`.

Run with `.venv/bin/python docs/make_comparison.py` from the repository's root: it replaces what stands
between the marks `<!-- table NAME -->` and `<!-- end -->`. The pictures beside are those of the report.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from hrsnake_env.files import replacing
from hrsnake_env.ladder import LADDER
from planners.bench.rows import read_rows
from planners.bench.statistics import success_share

ROOT = Path(__file__).parent.parent
ROWS = ROOT / "docs" / "comparison"

PLANNERS = (
    *("auto", "track", "sweep", "beam", "as-printed", "follow"),
    *("outer-wall", "b-spline", "backbone", "virtual-torque", "pseudo-inverse"),
)
SAMPLING = ("rrt-connect", "aorrtc")
LEARNERS = ("ppo", "ppo-residual", "sac", "tqc", "tqc-her", "ppo-planned", "clone", "dagger")
SCANNED = ("fig19", "zig3", "serp")

SHOWN = {
    "u-turn-i50": "U-turn, I = 0.50",
    "u-turn-i91": "U-turn, I = 0.91",
    "u-turn-long-i68": "long U-turn, I = 0.68",
    "u-turn-long-i91": "long U-turn, I = 0.91",
    "fig19": "`fig19`, I = 0.98",
    "u-turn-deep-i45": "deep U-turn, I = 0.45",
    "u-turn-deep-i23": "deep U-turn, I = 0.23",
}
"""Rungs of the README's table."""

EXACT = 1e-9
"""In link lengths: penetration up to here is rounding."""

Row = dict[str, Any]


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Write a table in Markdown."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *lines))


def by(rows: Sequence[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """Group rows."""
    groups: dict[tuple[Any, ...], list[Row]] = defaultdict(list)
    for row in rows:
        groups[tuple(row[name] for name in names)].append(row)
    return groups


def rows_of(study: str) -> list[Row]:
    """Read the rows of a study."""
    return read_rows(ROWS / study / "rows.parquet")


def rounded_down(value: float) -> str:
    """Write an index so that it does not flatter."""
    return f"{math.floor(1000.0 * value + 1e-6) / 1000.0:.3f}"


def duration(seconds: float) -> str:
    """Write seconds."""
    return f"{1000.0 * seconds:.0f} ms" if seconds < 1.0 else f"{seconds:.1f} s"


def span(values: Sequence[float], write: Callable[[float], str]) -> str:
    """Write from the least to the largest."""
    low, high = write(min(values)), write(max(values))
    return low if low == high else f"{low} to {high}"


def steps(count: float) -> str:
    """Write a number of steps."""
    return f"{count / 1e3:.0f}k" if count < 1e6 else f"{count / 1e6:.2f}M"


def solved(rows: Sequence[Row]) -> tuple[str, float | None]:
    """Write how many are solved, and the median time if most are; without, within what."""
    times = [row["seconds"] for row in rows if row["solved"]]
    if 2 * len(times) > len(rows):
        return f"{len(times)} of {len(rows)}, {duration(median(times))}", median(times)
    return f"{len(times)} of {len(rows)} in {rows[0]['budget']:.0f} s", None


def tight_table() -> str:
    """Write the largest index of each planner."""
    groups, lines = by(rows_of("tightest"), "method", "task"), []
    for method in PLANNERS:
        cells = [f"`{method}`"]
        for maze in SCANNED:
            rows = groups[method, maze]
            valid = [row for row in rows if row["solved"]]
            if not valid:
                cells.append("none" if rows else "not measured")
                continue
            best = max(row["index"] for row in valid)
            clear = [row["index"] for row in valid if row["worst_depth"] <= EXACT]
            shorter = [row["solved"] for row in rows if row["index"] < best]
            none = rounded_down(max(clear)) if clear else "none"
            cells.append(f"{rounded_down(best)} ({none}); {shorter.count(False)} of {len(shorter)}")
        lines.append(cells)
    return table(["planner", *SCANNED], lines)


def sampling_table() -> str:
    """Write time and ratio of sampling planners on the rungs that they were given."""
    groups, lines = by(rows_of("ladder"), "task", "method"), []
    for task in LADDER:
        ours = groups[task, "auto"]
        if not all(groups[task, name] for name in SAMPLING):
            continue
        own = median(row["seconds"] for row in ours)
        follow = "passes" if groups[task, "follow"][0]["solved"] else "fails"
        cells = [task, f"{ours[0]['n_links']}", follow, duration(own)]
        for name in SAMPLING:
            rows = groups[task, name]
            said, seconds = solved(rows)
            ratio = rows[0]["budget"] / own if seconds is None else seconds / own
            text = f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.1f}"
            cells += [said, f"> {text}" if seconds is None else text]
        lines.append(cells)
    head = ["rung", "links", "follow-the-leader", "`auto`", "RRT-Connect", "ratio", "AORRTC", "ratio"]
    return table(head, lines)


def learning_table() -> str:
    """Write what came of each training."""
    groups, lines = by(rows_of("ladder"), "task", "method"), []
    for task in LADDER:
        for method in LEARNERS:
            if not (rows := groups[task, method]):
                continue
            runs = by(rows, "seed")
            first = [run[0] for run in runs.values()]
            mean = sum(any(r["success"] for r in run if r["actions"] == "mean") for run in runs.values())
            sampled = [row["success"] for row in rows if row["actions"] == "sampled"]
            share = success_share(sum(sampled), len(sampled))
            low, high = 100.0 * share.low, 100.0 * share.high
            lines.append(
                [
                    *(task, f"`{method}`", f"{len(runs)}"),
                    span([row["train_steps"] for row in first], steps),
                    span([row["cpu_seconds"] for row in first], lambda seconds: f"{seconds:.0f} s"),
                    f"{mean} of {len(runs)}",
                    f"{100.0 * share.value:.1f} % ({low:.0f} to {high:.0f})",
                ]
            )
    head = ["rung", "method", "seeds", "steps of training", "processor time", "by mean actions", "sampled"]
    return table(head, lines)


def short_table() -> str:
    """Write the README's table."""
    groups, lines = by(rows_of("ladder"), "task", "method"), []
    for task, name in SHOWN.items():
        ours = groups[task, "auto"]
        lines.append(
            [
                *(name, f"{ours[0]['n_links']}", duration(median(row["seconds"] for row in ours))),
                *(solved(groups[task, sampling])[0] for sampling in SAMPLING),
                "passes" if groups[task, "follow"][0]["solved"] else "fails",
            ]
        )
    return table(["", "links", "`auto`", "RRT-Connect (OMPL)", "AORRTC (OMPL)", "follow-the-leader"], lines)


TABLES = {"tight": tight_table, "sampling": sampling_table, "learning": learning_table, "short": short_table}


def main() -> None:
    """Write all tables where they belong."""
    for path in (ROOT / "README.md", ROOT / "docs" / "comparison.md"):
        text = path.read_text(encoding="utf-8")
        for name, write in TABLES.items():
            mark = f"<!-- table {name} -->\n"
            if mark in text:
                start = text.index(mark) + len(mark)
                end = text.index("<!-- end -->", start)
                text = f"{text[:start]}\n{write()}\n\n{text[end:]}"
        with replacing(path) as part:
            part.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
