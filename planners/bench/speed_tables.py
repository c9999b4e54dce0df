"""The results of the speed benchmark as Markdown, to be pasted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planners.bench.markdown import milliseconds, parts_in_markdown, table

__all__ = ["speed_markdown"]

STAGES = ("potential", "path", "beams", "plan", "poses", "maze to poses", "validate")


def speed_markdown(results: Mapping[str, Any]) -> str:
    """Write all parts that were measured, each with a heading sentence and a table."""
    return parts_in_markdown(
        results,
        {
            "stages": _stages,
            "links": _links,
            "way": _way,
            "memory": _memory,
            "first call": _first_call,
            "random mazes": _random_mazes,
            "ompl": _ompl,
        },
    )


def _stages(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for row in rows:
        what = f"{row['maze']}, links of {row['link_length']:g} px, planner {row['planner']}"
        yield f"**{what}**: {row['status']}"
        if row["status"] != "solved":
            continue
        yield (
            f"with {row['n_links']} links, {row['n_poses']} poses, joints {tuple(row['shape'])}; "
            f"{row['runs']} runs:"
        )
        yield ""
        yield from table(
            ("stage", "median", "least", "median per pose"),
            [
                (
                    stage,
                    milliseconds(row["median_s"][stage]),
                    milliseconds(row["least_s"][stage]),
                    f"{row['median_s'][stage] / row['n_poses'] * 1e6:.3g} us",
                )
                for stage in STAGES
            ],
        )
        yield ""


def _growth(what: str, data: Mapping[str, Any]) -> Iterator[str]:
    yield from table(
        (
            "link",
            "planner",
            "path",
            "links",
            "poses",
            "maze to poses",
            "plan",
            "poses",
            "per pose",
            "validate",
        ),
        [_growth_row(row) for row in data["rows"]],
    )
    yield ""
    yield (
        f"Exponents over {what} (least squares of the logarithms of the least times; in brackets by what "
        "factor times are off the fit): "
        + ", ".join(
            f"{stage} {fit['exponent']:.2f} ({fit['off']:.2f})" for stage, fit in data["fits"].items()
        )
        + "."
    )


def _growth_row(row: Mapping[str, Any]) -> tuple[str, ...]:
    if row["status"] != "solved":
        return (f"{row['link_length']:g}", row["planner"], row["status"], *["-"] * 7)
    least = row["least_s"]
    return (
        f"{row['link_length']:g}",
        row["planner"],
        f"{row['path_length']:.0f}",
        str(row["n_links"]),
        str(row["n_poses"]),
        *(milliseconds(least[stage]) for stage in ("maze to poses", "plan", "poses")),
        f"{least['maze to poses'] / row['n_poses'] * 1e6:.3g} us",
        milliseconds(least["validate"]),
    )


def _links(data: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for growth in data:
        yield f"**Growth with links, planner {growth['planner']}**: fig17a, the same way for shorter links."
        yield ""
        yield from _growth("links", growth)
        yield ""


def _way(data: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    for growth in data:
        yield f"**Growth with the way, planner {growth['planner']}**: serpentines, links of one length."
        yield ""
        yield from _growth("the path's length", growth)
        yield ""


def _memory(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield "**Memory**, each in a fresh process:"
    yield ""
    yield from table(
        ("maze", "links", "poses", "after imports", "at the peak"),
        [
            (
                row["maze"],
                f"{row['n_links']} of {row['link_length']:g} px",
                str(row["n_poses"]),
                f"{row['imported_bytes'] / 2**20:.0f} MiB",
                f"{row['peak_bytes'] / 2**20:.0f} MiB",
            )
            for row in rows
        ],
    )


def _first_call(data: Mapping[str, Any]) -> Iterator[str]:
    yield (
        f"**First call** in a fresh process, kernels cached on disk, {data['runs']} processes: import of "
        f"`planners` {data['import_s']:.2f} s (least {data['import_least_s']:.2f} s); import and first "
        f"plan of fig19 {data['import_and_plan_s']:.2f} s (least {data['import_and_plan_least_s']:.2f} s); "
        f"the whole process {data['process_s']:.2f} s."
    )


def _random_mazes(data: Mapping[str, Any]) -> Iterator[str]:
    yield f"**Random mazes**, at most {data['time_budget_s']:g} s each, every motion validated:"
    yield ""
    yield from table(
        ("mazes", "link", "number", "solved", "no rod passes", "unsolved", "median of the solved"),
        [
            (
                kind,
                f"{row['link_length']:g} px",
                str(row["mazes"]),
                str(row["solved"]),
                str(row["no_rod_passes"]),
                ", ".join(f"{status} {count}" for status, count in row["unsolved"].items()) or "0",
                "-" if row["median_s"] is None else f"{row['median_s']:.2f} s",
            )
            for kind, row in data["kinds"].items()
        ],
    )
    yield ""
    yield (
        f"{data['mazes_per_second']:.2f} mazes per second with {data['workers']} workers, unsolved ones "
        f"included. {data['compared']} of the solved ones: {data['one_worker_per_second']:.2f} per second "
        f"with one worker, {data['all_workers_per_second']:.2f} with {data['workers']}, a ratio of "
        f"{data['ratio']:.2f} ({min(data['ratios']):.2f} to {max(data['ratios']):.2f} in "
        f"{len(data['ratios'])} rounds in turns)."
    )


def _ompl(data: Mapping[str, Any] | None) -> Iterator[str]:
    if data is None:
        yield "**OMPL** is not installed (`pip install 'hrsnake[bench]'`)."
        return
    yield (
        f"**Beside OMPL**, at most {data['seconds']:g} s for each run; I is link length over the longest "
        "rod; the times of OMPL's planners are with the growing of whole arms at the goal:"
    )
    yield ""
    yield from table(
        ("U-turns", "I", "links", "planner", "runs", "valid", "invalid", "unsolved", "median of the valid"),
        [
            (
                str(row["turns"]),
                f"{row['index']:g}",
                "-" if row["n_links"] is None else str(row["n_links"]),
                row["planner"],
                *(str(row[key]) for key in ("runs", "valid", "invalid", "unsolved")),
                "-" if row["median_s"] is None else f"{row['median_s']:.3g} s",
            )
            for row in data["rows"]
        ],
    )
