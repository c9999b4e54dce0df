"""The figures of the environment as Markdown, to be pasted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planners.bench.environment_where import REST
from planners.bench.markdown import parts_in_markdown, table

__all__ = ["environment_markdown"]


def environment_markdown(results: Mapping[str, Any]) -> str:
    """Write all parts that were measured, each with a heading sentence and a table."""
    return parts_in_markdown(
        results,
        {
            "peers": _peers,
            "where": _where,
            "resets": _resets,
            "planner": _planner,
            "vector": _vector,
            "random": _random,
        },
    )


def _peers(runs: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    data = runs[0]
    yield (
        "**peers**: steps per second of processor time through `gym.make`, each in a process of its own, in "
        f"turns of {data['window_s']:g} s, {data['rounds']} rounds; medians, and from the least to the "
        "largest. A ratio compares ours with the peer in the same round. Our arms move among the pillars of "
        "a hall with 40 wall segments, half out of the feeder at first; `collisions` says in how many of "
        "their steps a link was in one. By default the environment has 4 substeps. Random actions are new in "
        "every step, as is the custom, or held, so that arms move and meet walls."
    )
    yield ""
    rows: list[tuple[str, ...]] = []
    for data in runs:
        held = "new" if data["hold"] == 1 else f"held for {data['hold']}"
        rows += [(held, peer["name"], "", _rate(peer["rate"]), "1", "", "") for peer in data["peers"]]
        rows += [(held, *_peers_row(row)) for row in data["ours"]]
    yield from table(("actions", "environment", "substeps", "steps/s", "ratio", "target", "collisions"), rows)


def _peers_row(row: Mapping[str, Any]) -> tuple[str, ...]:
    target = row["target"]
    return (
        f"{row['n_links']} links",
        str(row["substeps"]),
        _rate(row["rate"]),
        f"{_spread(row['ratio'], '.2f')} x {row['peer']}",
        "" if target is None else f">= {target:g}: {_met(row['ratio']['median'] >= target)}",
        f"{row['touched']:.0%}",
    )


def _where(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    yield (
        f"**where** the time of a step goes, in us, with 4 substeps; the fastest of {rows[0]['rounds']} "
        f"rounds of {rows[0]['steps']} steps. Pieces are timed in running episodes, less what timing costs; "
        "`whole` is the same episodes with nothing timed inside."
    )
    yield ""
    head = ("piece", *(f"{row['n_links']} links" for row in rows))
    lines = [(piece, *(_share(row, piece) for row in rows)) for piece in rows[0]["pieces"]]
    assert lines[-1][0] == REST
    yield from table(
        head,
        [
            *lines,
            ("sum", *(f"{row['sum']:.1f}" for row in rows)),
            ("whole", *(f"{row['whole']:.1f}" for row in rows)),
        ],
    )


def _share(row: Mapping[str, Any], piece: str) -> str:
    return f"{row['pieces'][piece]:.1f} ({row['pieces'][piece] / row['sum']:.0%})"


def _resets(data: Mapping[str, Any]) -> Iterator[str]:
    yield (
        f"**resets** per second of processor time, {data['n_links']} links, {data['rounds']} rounds; target "
        f"{data['target']:g} in the hall."
    )
    yield ""
    yield from table(
        ("where", "wall segments", "resets/s"),
        [(row["name"], str(row["n_walls"]), _rate(row["rate"])) for row in data["rows"]],
    )


def _planner(data: Mapping[str, Any]) -> Iterator[str]:
    targets = data["targets"]
    yield (
        f"**planner**: its motions as episodes through `gym.make`, reset included, processor time of "
        f"{data['runs']} runs after one. Errors are the largest of the episode in px at a link of 230. "
        f"Targets: node error {targets['node_error']:g}, drift {targets['drift']:g}, {targets['seconds']:g} "
        "s in `fig17a`."
    )
    yield ""
    head = ("maze", "links", "substeps", "seconds", "steps", "steps/s", "node error", "drift", "verdict")
    yield from table(head, [_planner_row(row, targets) for row in data["rows"]])


def _planner_row(row: Mapping[str, Any], targets: Mapping[str, float]) -> tuple[str, ...]:
    seconds = _spread(row["seconds"], ".3f")
    if row["timed"]:
        seconds += f", {_met(row['seconds']['median'] <= targets['seconds'])}"
    errors = [f"{row[key]:.4f}, {_met(row[key] <= targets[key])}" for key in ("node_error", "drift")]
    verdict = ("" if row["success"] else "no success, ") + ("clean" if row["clean"] else "not clean")
    return (
        row["maze"],
        f"{row['n_links']} of {row['link_length']:g}",
        str(row["substeps"]),
        seconds,
        str(row["steps"]),
        f"{row['rate']:,.0f}",
        *errors,
        verdict,
    )


def _vector(data: Mapping[str, Any]) -> Iterator[str]:
    yield (
        f"**vector**: steps per second on the wall of {data['n_envs']} environments `{data['id']}` together, "
        f"{data['rounds']} rounds, beside one alone. In one process no vector, however made, has more than "
        "one environment without wrappers."
    )
    yield ""
    yield from table(
        ("environments", "steps/s", "ratio to one"),
        [(row["name"], _rate(row["rate"]), _spread(row["ratio"], ".2f")) for row in data["rows"]],
    )


def _random(data: Mapping[str, Any]) -> Iterator[str]:
    steps = sum(row["steps"] for row in data["rows"])
    so_far = "" if data["done"] == data["tasks"] else f" ({data['done']} of {data['tasks']} runs are done)"
    yield (
        f"**random** policies, {steps:,} steps in {data['mazes']} mazes{so_far}: "
        f"{len(data['exceptions'])} exceptions. Depth and drift are in link lengths; of a link that lies "
        "wholly behind the surface, the depth is a lower bound."
    )
    yield from data["exceptions"]
    yield ""
    head = ("a collision ends it", "actuation", "steps", "episodes", "successes", "jams", "not finite")
    yield from table(
        (*head, "steps with pinches", "with collisions", "worst depth", "in", "worst drift"),
        [
            (
                "yes" if row["terminates"] else "no",
                row["actuation"],
                *(f"{row[key]:,}" for key in ("steps", "episodes", "successes", "jams", "not_finite")),
                *(f"{row[key]:,}" for key in ("pinched", "collided")),
                f"{row['worst_depth']:.3g}",
                row["worst_in"],
                f"{row['worst_drift']:.2g}",
            )
            for row in data["rows"]
        ],
    )


def _rate(rate: Mapping[str, float]) -> str:
    return _spread(rate, ",.0f")


def _spread(values: Mapping[str, float], form: str) -> str:
    return f"{values['median']:{form}} ({values['least']:{form}} to {values['largest']:{form}})"


def _met(met: bool) -> str:
    return "met" if met else "not met"
