"""The tables of a report: what was run, the ladder, the tightest links, and times beside each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from planners.bench.report_page import Table
from planners.bench.report_rows import (
    OURS,
    RANDOM,
    Row,
    grouped,
    index_of,
    is_learner,
    ladder_order,
    links_of,
    methods_of,
    succeeded,
    time_limit,
    typical_seconds,
)
from planners.bench.statistics import success_share

__all__ = [
    "below_table",
    "duration",
    "ladder_tables",
    "percent",
    "runs_in_words",
    "tightest_table",
    "time_table",
]

FOLLOW = "follow"
"""Follow-the-leader: its result stands beside every rung."""

FEW = 0.1
"""Below this share of successes a method is said to fail on a rung."""

DEEPEST = 1e-9
"""In link lengths: penetration up to here is rounding."""


def duration(seconds: float) -> str:
    """Write a time in ms, s, min or h."""
    for unit, size, limit in (("ms", 1e-3, 1.0), ("s", 1.0, 120.0), ("min", 60.0, 7200.0)):
        if seconds < limit:
            return f"{seconds / size:.2g} {unit}" if seconds / size < 10 else f"{seconds / size:.0f} {unit}"
    return f"{seconds / 3600.0:.1f} h"


def percent(share: float) -> str:
    """Write a share, so that only all is 100 %, and only none 0 %."""
    text = f"{100.0 * share:.0f}"
    if (text == "100" and share < 1.0) or (text == "0" and share > 0.0):
        text = f"{100.0 * share:.1f}"
    return f"{text} %"


def runs_in_words(rows: Sequence[Row]) -> Iterator[str]:
    """Say what was run in each study: methods, tasks, seeds, rows, budget, and what went wrong."""
    for study, here in grouped(rows, lambda row: row["study"]).items():
        groups = grouped(here, lambda row: row["method"])
        alike: dict[str, list[str]] = {}
        for method in methods_of(here):
            alike.setdefault(_amount(groups[method]), []).append(method)
        yield (
            f"**{study}**: "
            + "; ".join(f"{', '.join(names)} ({what})" for what, names in alike.items())
            + "."
        )
        errors = [row for row in here if str(row["status"]).startswith("error")]
        if errors:
            first = errors[0]
            yield (
                f"**{len(errors)} rows of {study} are errors** and count as failures, the first of "
                f"{first['method']} on {first['task']}: {first['status'].removeprefix('error: ')}."
            )


def _amount(rows: Sequence[Row]) -> str:
    tasks, seeds = (len({row[name] for row in rows}) for name in ("task", "seed"))
    budgets = sorted({f"{row['budget']:g} {row['budget_unit']}" for row in rows if row["budget"]})
    amounts = [f"{tasks} task{'s' * (tasks != 1)}", f"{seeds} seed{'s' * (seeds != 1)}", f"{len(rows)} rows"]
    return ", ".join(amounts + budgets)


def ladder_tables(rows: Sequence[Row]) -> list[Table]:
    """Write success and time of all methods on all rungs: one table each for few methods."""
    planned = [row for row in rows if not is_learner(row)]
    ours = [name for name in methods_of(planned) if name in (*OURS, "beam", "as-printed")]
    others = [name for name in methods_of(planned) if name not in ours]
    tables = []
    for title, names in (("Our planners, and the paper's", ours), ("Other planners", others)):
        if names:
            chosen = [row for row in planned if row["method"] in names]
            tables.append(_ladder_table(f"{title}: success (95 % interval), median time", rows, chosen))
    for actions in ("mean", "sampled"):
        chosen = [row for row in rows if row["actions"] == actions]
        if chosen:
            title = f"Learners, {'deterministic' if actions == 'mean' else 'sampled'} actions"
            tables.append(_ladder_table(f"{title}: success (95 % interval), median training", rows, chosen))
    return tables


def _ladder_table(title: str, every: Sequence[Row], rows: Sequence[Row]) -> Table:
    """Write some methods on the rungs on which they were measured."""
    names = methods_of(rows)
    cells = grouped(rows, lambda row: (row["task"], row["method"]))
    tasks = grouped(every, lambda row: row["task"])
    lines = [
        (*rung(task, tasks[task]), *(_cell(cells.get((task, name), [])) for name in names))
        for task in ladder_order(rows)
    ]
    shown = [f"**{name}**" if name in OURS else name for name in names]
    return Table(head=("rung", "I", "links", "follow-the-leader", *shown), rows=lines, title=title)


def rung(task: str, rows: Sequence[Row]) -> tuple[str, str, str, str]:
    """Name a task, its index and links, and whether follow-the-leader passes."""
    indices = [row["index"] for row in rows]
    low, high = min(indices), max(indices)
    if math.isinf(max(row["longest_rod"] or 0.0 for row in rows)):
        index = "no bend"
    elif high - low < 0.005:
        index = f"{high:.2f}"
    else:
        index = f"{low:.2f} to {high:.2f}"
    follow = [row for row in rows if row["method"] == FOLLOW]
    passed = sum(map(succeeded, follow)) / len(follow) if follow else math.nan
    result = {0.0: "fails", 1.0: "passes"}.get(passed, "-" if math.isnan(passed) else percent(passed))
    links = links_of([row for row in rows if not is_learner(row)] or rows)
    return task, index, "-" if links is None else str(links), result


def _cell(rows: Sequence[Row]) -> str:
    """Write success with its interval, and the time: of a success for planners, of training for learners."""
    if not rows:
        return "-"
    text = "solved" if succeeded(rows[0]) else "fails"
    if len(rows) > 1:
        share = success_share(sum(map(succeeded, rows)), len(rows))
        text = f"{percent(share.value)} ({100 * share.low:.0f} to {100 * share.high:.0f})"
    timed = [row for row in rows if row["method"] != RANDOM and (succeeded(row) or is_learner(row))]
    times = [row["seconds"] for row in timed if row["seconds"] is not None]
    return f"{text}, {duration(float(np.median(times)))}" if times and max(times) > 0.0 else text


def below_table(rows: Sequence[Row]) -> Table:
    """Name the rung where each method first stays below 10 % success, and from where on on every rung."""
    order = ladder_order(rows)
    lines = []
    groups = grouped(rows, lambda row: (row["method"], row["actions"]))
    for method in methods_of(rows):
        for actions in ("planned", "mean", "sampled"):
            if every := groups.get((method, actions)):
                tasks = grouped(every, lambda row: row["task"])
                rungs = [task for task in order if task in tasks]
                shares = [sum(map(succeeded, tasks[task])) / len(tasks[task]) for task in rungs]
                lines.append((*_below_line(method, actions, rungs, shares), _clean(every)))
    head = ("method", "actions", "rungs", "first rung below 10 %", "below 10 % from here on", "clean")
    return Table(head=head, rows=lines, title="Where each method first stays below 10 % success")


def _below_line(method: str, actions: str, rungs: Sequence[str], shares: Sequence[float]) -> tuple[str, ...]:
    few = [share < FEW for share in shares]
    first = rungs[few.index(True)] if True in few else "none"
    tail = len(few)
    while tail and few[tail - 1]:
        tail -= 1
    word = {"planned": "-", "mean": "deterministic"}.get(actions, actions)
    shown = f"**{method}**" if method in OURS else method
    return shown, word, str(len(rungs)), first, rungs[tail] if tail < len(rungs) else "none"


def _clean(rows: Sequence[Row]) -> str:
    """Write how many of the simulated successes only pinch the walls."""
    simulated = [row["clean"] for row in rows if row["success"] and row["clean"] is not None]
    return percent(sum(simulated) / len(simulated)) if simulated else "-"


def tightest_table(rows: Sequence[Row]) -> Table:
    """Write the largest index that passes, per maze and planner, and how many shorter lengths fail."""
    lines = []
    for maze, here in grouped(rows, lambda row: row["maze"]).items():
        groups = grouped(here, lambda row: row["method"])
        best = max(_largest(group, succeeded) for group in groups.values())
        for method in methods_of(here):
            lines.append((f"{maze}: {method}", *_tightest_cells(groups[method], best)))
    head = ("maze: planner", "largest I that is valid", "without penetration", "links", "time there")
    return Table(head=(*head, "shorter lengths that fail", "longest rod"), rows=lines)


def _largest(rows: Sequence[Row], passes: Callable[[Row], bool]) -> float:
    """Return the largest index of the rows that pass; 0 if there is none."""
    return max((float(row["index"]) for row in rows if passes(row)), default=0.0)


def _is_free(row: Row) -> bool:
    """Tell whether a motion was found that does not penetrate the walls anywhere."""
    return succeeded(row) and row["worst_depth"] is not None and row["worst_depth"] <= DEEPEST


def _tightest_cells(rows: Sequence[Row], best: float) -> Iterator[str]:
    """Write what a planner reaches in one maze."""
    valid, free = _largest(rows, succeeded), _largest(rows, _is_free)
    measured = any(row["worst_depth"] is not None for row in rows if succeeded(row))
    there = [row for row in rows if row["index"] == valid and succeeded(row)]
    yield "none" if not valid else f"**{valid:.3f}**" if valid == best else f"{valid:.3f}"
    yield f"{free:.3f}" if free else "none" if measured or not valid else "not measured"
    yield str(links_of(there) or "-") if there else "-"
    yield duration(typical_seconds(there)) if there else "-"
    shorter = [group for index, group in grouped(rows, lambda row: row["index"]).items() if index < valid]
    yield f"{sum(not all(map(succeeded, group)) for group in shorter)} of {len(shorter)}" if valid else "-"
    yield f"{rows[0]['longest_rod']:.5g}" if rows[0]["longest_rod"] is not None else "-"


def time_table(rows: Sequence[Row], order: Sequence[str] = ()) -> Table | None:
    """Write the times of the other planners, and how many times ours they are, task by task.

    In the given order of tasks, or by shape, index and links. None if ours or others were not measured.
    """
    planned = [row for row in rows if not is_learner(row)]
    names = methods_of(planned)
    reference = next((name for name in OURS if name in names), None)
    others = [name for name in names if name != reference]
    if reference is None or not others:
        return None
    lines = []
    tasks = grouped(planned, lambda row: row["task"])
    for task in [name for name in order if name in tasks] or sorted(
        tasks, key=lambda name: _place(tasks[name])
    ):
        here = tasks[task]
        groups = grouped(here, lambda row: row["method"])
        ours = typical_seconds(groups[reference]) if reference in groups else math.inf
        own = "-" if reference not in groups else duration(ours) if ours < math.inf else "not solved"
        cells = (time_cell(groups.get(name, []), ours) for name in others)
        lines.append((task, *rung(task, here)[1:3], own, *cells))
    shown = [f"**{name}**" if name in OURS else name for name in others]
    title = f"Median time, and how many times that of `{reference}` it is; why, if half of the runs fail"
    return Table(head=("task", "I", "links", f"**{reference}**", *shown), rows=lines, title=title)


def _place(rows: Sequence[Row]) -> tuple[str, float, int]:
    """Return what tasks are sorted by."""
    return rows[0]["shape"], round(index_of(rows), 3), links_of(rows) or 0


def time_cell(rows: Sequence[Row], ours: float) -> str:
    """Write a time and its ratio to ours; of what ran out of time, that both are larger."""
    if not rows:
        return "-"
    seconds, beyond = typical_seconds(rows), ""
    if math.isinf(seconds):
        limit = time_limit(rows)
        if limit is None:
            return _failure(rows)
        seconds, beyond = limit, "> "
    ratio = f" ({beyond}{seconds / ours:.2g}x)" if 0.0 < ours < math.inf else ""
    if seconds / ours >= 100 and ratio:
        ratio = f" ({beyond}{seconds / ours:.0f}x)"
    return f"{beyond}{duration(seconds)}{ratio}"


def _failure(rows: Sequence[Row]) -> str:
    """Say for which reason most runs failed before their time was out."""
    reasons = grouped((row for row in rows if not succeeded(row)), lambda row: row["status"] or "fails")
    reason = max(reasons, key=lambda name: len(reasons[name]))
    return "error" if reason.startswith("error") else reason if reason != "solved" else "not at the goal"
