"""The results of the spatial planners as Markdown, to be pasted."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planners.bench.markdown import parts_in_markdown, table
from planners.bench.spatial_growth import LENGTH, STAGES

__all__ = ["spatial_markdown"]


def spatial_markdown(results: Mapping[str, Any]) -> str:
    """Write all parts that were measured, each with a heading sentence and a table."""
    return parts_in_markdown(
        results,
        {
            "figures": _figures,
            "growth": _growth,
            "radius": _radius,
            "horizon": _horizon,
            "rooms": _rooms,
            "workspaces": _workspaces,
        },
    )


def _figures(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        "**figures** (the paper's Figs. 20 to 22, in a workspace of ours): paired-panels, lengths in its "
        f"units, path of {_number(rows[0]['path_length'], '.1f')}. Depth is the shortest translation that "
        "parts link and obstacle: at poses, and a bound of it between them, where the check gives one. "
        "Mapping errors: a link's largest distance from the path that it spans, and the path's from the "
        "link. Track: length of the curve on which the joints run. Time per pose is that of "
        "feeding alone; the whole plan is field, path, shaping of the track, poses and exact check, warm; "
        f"medians of {rows[0]['runs']} runs."
    )
    yield ""
    yield from table(
        (
            *("planner", "links", "outcome", "depth", "between", "poses that collide", "clearance"),
            *("link to path", "path to link", "track", "largest angle"),
            *("per pose", "field and path", "shaping", "poses", "check", "whole"),
        ),
        [_figure_row(row) for row in rows],
    )


def _figure_row(row: Mapping[str, Any]) -> tuple[str, ...]:
    times = row["median_s"]
    n_poses, length = row["n_poses"], f"{row['link_length']:.4g}"
    longest = ", the longest" if row["longest"] else ""
    field = [times[key] for key in ("potential", "path") if key in times]
    return (
        row["planner"] + longest,
        length if row["n_links"] is None else f"{row['n_links']} x {length}",
        f"{row['status']}{', a joint jumps' if row['jumps'] else ''}",
        _number(row["depth"], ".3g"),
        _number(row["between"], ".3g"),
        "-" if n_poses is None else f"{row['n_colliding']} of {n_poses}",
        _number(row["clearance"], ".3g"),
        _number(row["link_to_path"], ".3g"),
        _number(row["path_to_link"], ".3g"),
        _number(row["track_length"], ".1f"),
        _degrees(row["largest_angle"]),
        _time(row["pose_s"]),
        _time(sum(field)) if field else "-",
        *(_time(times[key]) if key in times else "-" for key in ("plan", "poses", "validate")),
        _time(times["whole"]),
    )


def _rooms(data: Mapping[str, Any]) -> Iterator[str]:
    without = data["without_way"]
    number, seeds = len(data["seeds"]), data["seeds"]
    yield (
        f"**rooms**: the first {number} seeded random rooms of 60 boxes that have a way for a point, seeds "
        f"{min(seeds)} to {max(seeds)} ({len(without)} between them without one{_listed(without)}). From "
        "nowhere on the straight stretch is the goal in sight, or boxes are drawn anew. Longest link with a "
        "motion that has passed the exact check twice, in units and in numbers of links, and seconds of the "
        "search."
    )
    yield ""
    planners = list(dict.fromkeys(row["planner"] for row in data["rows"]))
    cells = {(row["room"], row["planner"]): row for row in data["rows"]}
    rooms = list(dict.fromkeys(row["room"] for row in data["rows"]))
    yield from table(
        ("room", *planners, *(f"{one['planner']} / follow" for one in data["compared"]), "search"),
        [
            (
                room,
                *(_longest(cells[room, planner]) for planner in planners),
                *(_ratio(cells, room, one["planner"]) for one in data["compared"]),
                f"{sum(cells[room, planner]['seconds'] for planner in planners):.0f} s",
            )
            for room in rooms
        ],
    )
    for one in data["compared"]:
        yield ""
        yield _summary(one)


def _listed(seeds: Sequence[int]) -> str:
    return f": {', '.join(map(str, seeds))}" if seeds else ""


def _summary(one: Mapping[str, Any]) -> str:
    if not one["compared"]:
        return f"`{one['planner']}` and `follow` have no room in common."
    return (
        f"`{one['planner']}` over `follow`: {one['mean']:.2f} times as long in the mean of {one['compared']} "
        f"rooms, {one['median']:.2f} in the median, from {one['least']:.2f} to {one['largest']:.2f}; longer "
        f"in {one['longer']}; {one['mean_links']:.2f} times as many links. Left out of {one['rooms']} rooms: "
        f"{one['alone']} where it alone has a motion, {one['followed_alone']} where `follow` alone has one, "
        f"{one['rooms'] - one['compared'] - one['alone'] - one['followed_alone']} where neither."
    )


def _longest(row: Mapping[str, Any]) -> str:
    late = f", {row['out_of_time']} out of time" if row["out_of_time"] else ""
    if row["length"] == 0.0:
        return f"none{late}"
    return f"{row['length']:.1f} ({row['n_links']}{'' if row['valid'] else ', NOT VALID'}{late})"


def _ratio(cells: Mapping[tuple[Any, str], Mapping[str, Any]], place: Any, planner: str) -> str:
    mine, others = cells[place, planner]["length"], cells.get((place, "follow"), {"length": 0.0})["length"]
    return f"{mine / others:.2f}" if mine > 0.0 and others > 0.0 else "-"


def _growth(data: Mapping[str, Any]) -> Iterator[str]:
    yield (
        f"**growth**: processor time of planner `track`, medians of {data['links']['runs']} runs, and "
        "exponents over the number of links and over the path's length (least squares of logarithms). "
        "`plan` is path (with the field), track and poses; `whole` is that and the exact check. Between two "
        "poses no joint moves farther than a fixed share of a link, so there are as many more poses as "
        "links: where the time of a pose grows with exponent 1, that of all poses does with 2."
    )
    for name, what in (
        ("links", "Through the paired panels, with shorter and shorter links"),
        ("way", f"Links of {LENGTH:g}, in longer and longer rooms with more and more panels"),
    ):
        growth = data[name]
        yield ""
        yield f"{what}:"
        yield ""
        yield from table(
            ("links", "path", "obstacles", "poses", "tracks tried", *STAGES),
            [_growth_row(row) for row in growth["rows"]] + _exponents(growth["fits"]),
        )


def _growth_row(row: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        f"{row['n_links']} x {row['link_length']:g}{'' if row['solved'] else ' (not solved)'}",
        f"{row['path_length']:,.0f}",
        str(row["n_obstacles"]),
        f"{row['n_poses']:,}",
        str(row["attempts"]),
        *(_time(row["median_s"][stage]) for stage in STAGES),
    )


def _exponents(fits: Mapping[str, Mapping[str, float]]) -> list[tuple[str, ...]]:
    if not fits:
        return []
    return [("exponent", "", "", "", "", *(f"{fits[stage]['exponent']:.2f}" for stage in STAGES))]


def _radius(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        f"**radius**: planner `track` in the paired panels, links of {rows[0]['link_length']:g} with a "
        "radius or a joint limit. Clearance is from the link's surface; every motion has passed the exact "
        "check twice."
    )
    yield ""
    yield from table(
        ("radius", "joint limit", "outcome", "links", "clearance", "largest angle", "plan and check"),
        [
            (
                f"{row['radius']:g}",
                _degrees(row["joint_limit"]),
                row["status"] + ("" if row["valid"] or row["n_links"] is None else ", NOT VALID"),
                _number(row["n_links"], "d"),
                _number(row["clearance"], ".3g"),
                _degrees(row["largest_angle"]),
                _time(row["seconds"]),
            )
            for row in rows
        ],
    )


def _horizon(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        "**horizon**: how much of the path ahead of its tip the planner `causal` sees, and the longest of 21 "
        "link lengths, 5 % apart, with which it passes the paired panels; how many shorter ones fail."
    )
    yield ""
    yield from table(
        ("horizon, links", "longest link, units", "shorter that fail"),
        [(f"{row['horizon']:g}", f"{row['length']:.1f}", str(row["shorter_that_fail"])) for row in rows],
    )


def _workspaces(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        "**workspaces**: the paired panels with other gaps, windows and thickness, in units; longest link "
        "with a motion that has passed the exact check twice, and number of links."
    )
    yield ""
    planners = list(dict.fromkeys(row["planner"] for row in rows))
    sizes = [(row["gap"], row["window"], row["thickness"]) for row in rows]
    cells = {(size, row["planner"]): row for size, row in zip(sizes, rows, strict=True)}
    others = [planner for planner in planners if planner != "follow"]
    yield from table(
        ("gap", "window", "thickness", *planners, *(f"{planner} / follow" for planner in others)),
        [
            (
                *(f"{value:g}" for value in size),
                *(_longest(cells[size, planner]) for planner in planners),
                *(_ratio(cells, size, planner) for planner in others),
            )
            for size in dict.fromkeys(sizes)
        ],
    )


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def _time(seconds: float | None) -> str:
    """Write a time in the unit in which it is easiest to read."""
    if seconds is None:
        return "-"
    for unit, size in (("s", 1.0), ("ms", 1e-3)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds * 1e6:.3g} us"


def _degrees(angle: float | None) -> str:
    return "-" if angle is None else f"{math.degrees(angle):.0f} deg"
