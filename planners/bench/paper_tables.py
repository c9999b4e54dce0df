"""The results beside the paper's as Markdown, to be pasted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planners.bench.markdown import milliseconds, parts_in_markdown, table

__all__ = ["paper_markdown"]


def paper_markdown(results: Mapping[str, Any]) -> str:
    """Write all parts that were measured, each with a heading sentence and a table."""
    return parts_in_markdown(
        results,
        {
            "workspaces": _workspaces,
            "poses": _poses,
            "links": _links,
            "index": _index,
            "families": _families,
            "rules": _rules,
        },
    )


def _workspaces(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        f"**workspaces** (Fig. 17, 19), lengths in px, median of {rows[0]['runs']} runs from the maze to "
        "all poses, without the exact check. Depth is that of the deepest link: at poses, and between them "
        "(a bound where the exact check gives one, else, with >=, the deepest that was met). The paper's "
        "time is of its own program and machine (C#, Intel i5-4210U), so times beside it are no ratio of "
        "the methods."
    )
    yield ""
    head = ("maze", "planner", "outcome", "links", "poses", "path", "maze to poses", "per pose")
    paper = (
        "fig17a",
        "**the paper**",
        "reaches the goal",
        "45 of 245",
        "1870",
        "10,505",
        "1921 ms",
        "1.03 ms",
    )
    yield from table(
        (*head, "depth at poses", "between", "simulated"),
        [(*paper, "-", "-", "-"), *(_workspace_row(row) for row in rows)],
    )


def _workspace_row(row: Mapping[str, Any]) -> tuple[str, ...]:
    n_poses = row["n_poses"]
    return (
        row["maze"],
        row["planner"],
        _outcome(row),
        "-" if row["n_links"] is None else f"{row['n_links']} of {row['link_length']:g}",
        "-" if n_poses is None else str(n_poses),
        f"{row['path_length']:,.0f}",
        milliseconds(row["median_s"]),
        "-" if n_poses is None else microseconds(row["median_s"] / n_poses),
        _depth(row["depth"]),
        _between(row),
        {None: "-", True: "clean", False: "not clean"}[row["clean"]],
    )


def _outcome(row: Mapping[str, Any]) -> str:
    """Say how a trial ended, and where it ended on the way."""
    came = row["came"]
    return (
        f"{row['status']} at {100 * came:.0f} % of the path"
        if came is not None and came < 1.0
        else row["status"]
    )


def _depth(depth: float | None) -> str:
    return "-" if depth is None else f"{depth:.3g}"


def _between(row: Mapping[str, Any]) -> str:
    return "-" if row["between"] is None else f"{'' if row['bounded'] else '>= '}{row['between']:.3g}"


def microseconds(seconds: float) -> str:
    """Write a time in us."""
    return f"{seconds * 1e6:.3g} us"


def _poses(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        f"**poses** (Fig. 18): {rows[0]['maze']}, links of {rows[0]['link_length']:g} px, the whole arm "
        f"anew at each pose; of each pose the least of {rows[0]['repeats']} times, Python's garbage "
        "collector off, path and beams computed before. An arm that grows makes cumulative time convex: "
        "exponent over the length that is out, and R2 of the best straight line. The paper: 1.03 ms per "
        "pose on average, on its own machine."
    )
    yield ""
    yield from table(
        (
            *("planner", "came", "links", "poses", "all poses", "exponent", "R2", "pose: median", "99 %"),
            *("largest", "with 45 links or more: poses", "median", "99 %", "largest"),
        ),
        [
            (
                row["planner"],
                "to the goal" if row["at_goal"] else f"{100 * row['came']:.0f} % of the path's length",
                str(row["n_links"]),
                str(row["n_poses"]),
                milliseconds(row["total_s"]),
                f"{row['growth']['exponent']:.2f}",
                f"{row['line']['r2']:.3f}",
                *_spread(row["all"])[1:],
                *_spread(row["paper_links"]),
            )
            for row in rows
        ],
    )


def _spread(spread: Mapping[str, float] | None) -> tuple[str, ...]:
    if spread is None:
        return ("0", "-", "-", "-")
    return (
        f"{spread['n_poses']:.0f}",
        *(microseconds(spread[key]) for key in ("median_s", "p99_s", "largest_s")),
    )


def _links(data: Mapping[str, Any]) -> Iterator[str]:
    arm = data["arm"]
    yield (
        f"**links** (5.2): time per pose of an arm with so many links out, in a serpentine of "
        f"{arm[0]['turns']} turns, links of {arm[0]['link_length']:g} px. Median (and least) of groups of "
        "poses; poses that are tried again with less feed count in the median."
    )
    yield ""
    counts = sorted({row["n_links"] for growth in arm for row in growth["rows"]})
    yield from table(
        ("planner", *(f"{count} links" for count in counts), "exponent"),
        [_growth_row(growth, counts) for growth in arm],
    )
    yield ""
    auto = data["auto"]
    yield "From the maze to all poses, planner `auto`, serpentines of ever more turns, least times:"
    yield ""
    yield from table(
        ("path", "links", "poses", "maze to poses", "per pose", "by"),
        [
            (
                f"{row['path_length']:,.0f}",
                str(row["n_links"]),
                str(row["n_poses"]),
                milliseconds(row["least_s"]["maze to poses"]),
                microseconds(row["least_s"]["maze to poses"] / row["n_poses"]),
                row["planner"],
            )
            for row in auto["rows"]
        ],
    )
    if auto["over_links"] is not None:
        yield ""
        yield (
            f"Exponent over links {auto['over_links']['exponent']:.2f}, over the path's length "
            f"{auto['over_path']['exponent']:.2f} (the paper: almost linear)."
        )


def _growth_row(growth: Mapping[str, Any], counts: Sequence[int]) -> tuple[str, ...]:
    rows = {row["n_links"]: row for row in growth["rows"]}
    cells = [
        f"{microseconds(rows[count]['median_s'])} ({microseconds(rows[count]['least_s'])})"
        if count in rows
        else f"ends at {growth['came_to_links']}"
        for count in counts
    ]
    fits = growth["fits"]
    exponents = f"{fits['median_s']['exponent']:.2f} ({fits['least_s']['exponent']:.2f})" if fits else "-"
    return (growth["planner"], *cells, exponents)


def _index(data: Mapping[str, Any]) -> Iterator[str]:
    shortest, longest, number = data["lengths"]
    yield (
        f"**index** (5.1, Eq. 4): fig19, longest rod {data['longest_rod']:g} px; {number} link lengths from "
        f"{longest:g} down to {shortest:g} px, every one of them tried and checked. The paper: 430 px, "
        "I = 0.98, and about 0.25 for others (5.4)."
    )
    yield ""
    yield from table(
        ("planner", "longest valid link", "index", "shorter that fail", "all pass up to"),
        [
            (
                row["planner"],
                "none" if row["longest"] is None else f"{row['longest']:g} px",
                "-" if row["index"] is None else f"{row['index']:.4f}",
                f"{len(row['shorter_failed'])} of {row['shorter']}",
                "none" if row["all_pass_to"] is None else f"{row['all_pass_to']:g} px",
            )
            for row in data["planners"]
        ],
    )
    yield ""
    yield "Depth in px at poses / between, or how it ends:"
    yield ""
    planners = list(dict.fromkeys(row["planner"] for row in data["shown"]))
    cells = {(row["link_length"], row["planner"]): row for row in data["shown"]}
    yield from table(
        ("link, px", *planners),
        [
            (f"{length:g}", *(_ends(cells[length, planner]) for planner in planners))
            for length in sorted({row["link_length"] for row in data["shown"]})
        ],
    )


def _ends(row: Mapping[str, Any]) -> str:
    if row["depth"] is None:
        return _outcome(row)
    return f"{row['status']}: {_depth(row['depth'])} / {_between(row)}"


def _families(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    _, _, step, coarse = rows[0]["task"]
    yield (
        "**families**: the longest link that passes, in px and as a share of the longest rod, in steps of "
        f"{step:g} of it; in brackets how many of the shorter ones that were checked pass, in steps of "
        f"{coarse:g}, down to 0.15. Rods in closed form are those of the tightest turn alone; one with a "
        "star is a proven bound."
    )
    yield ""
    planners = list(dict.fromkeys(row["planner"] for row in rows))
    cells = {(row["maze"], row["planner"]): row for row in rows}
    yield from table(
        ("family", "longest rod", *planners),
        [
            (
                maze,
                _rod(cells[maze, planners[0]]),
                *(_longest(cells[maze, planner]) for planner in planners),
            )
            for maze in dict.fromkeys(row["maze"] for row in rows)
        ],
    )


def _rod(row: Mapping[str, Any]) -> str:
    return f"{row['rod']:.1f}{'' if row['closed_form'] else ' *'}"


def _longest(row: Mapping[str, Any]) -> str:
    skipped = row["longer_not_checked"]
    unsure = f"; {skipped} longer not checked" if skipped else ""
    if row["longest"] is None:
        return f"none{unsure}"
    checked = row["shorter"] - row["shorter_not_checked"]
    return f"{row['longest']:.1f}, {row['share']:.2f} ({row['shorter_solved']} of {checked}{unsure})"


def _rules(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        f"**rules** (section 3), one changed at a time: {rows[0]['lengths']} link lengths on fig19, with the "
        f"worst depth in link lengths of motions to the goal, and {rows[0]['others']} further cases of "
        "families and of the paper's workspaces."
    )
    yield ""
    yield from table(
        ("rules", "fig19: valid", "dead ends", "worst at poses", "between", "others: solved", "dead ends"),
        [
            (
                row["variant"],
                f"{row['valid']} of {row['lengths']}",
                str(row["dead_ends"]),
                _share(row["worst_depth"]),
                _share(row["worst_between"]),
                f"{row['others_solved']} of {row['others']}",
                str(row["others_dead_ends"]),
            )
            for row in rows
        ],
    )


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"
