"""The pictures of a report: over the index, over the number of links, profiles, and the ladder."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter

from hrsnake_env.appearance import COLOURS
from hrsnake_env.arm import FloatArray
from planners.bench.report_charts import (
    SUCCESS,
    legend,
    new_figure,
    plain,
    save,
    seconds_axis,
    show_shares,
    style_of,
    time_curves,
)
from planners.bench.report_learners import Scores, normalised_runs, shared_tasks, success_runs
from planners.bench.report_rows import (
    OURS,
    Row,
    grouped,
    index_of,
    is_learner,
    is_shown,
    ladder_order,
    links_of,
    methods_of,
    succeeded,
)
from planners.bench.report_tables import rung
from planners.bench.statistics import performance_profile

__all__ = ["draw_index", "draw_ladder", "draw_links", "draw_profiles"]

MANY = 22
"""More columns than this are put together, by steps of the index."""

STEP = 0.05

Runs = Sequence[Sequence[float]]
"""Scores of the runs of every task."""

TICKS = (5, 10, 20, 50, 100, 200)
"""Numbers of links that are named on the axis."""


def draw_index(rows: Sequence[Row], shapes: Sequence[str], out: Path) -> None:
    """Draw success of all methods, and time of all planners, over the index: a column for each shape.

    Parameters
    ----------
    rows : sequence of mapping
        Of the study of the index; of learners, the deterministic actions are shown.
    shapes : sequence of str
        At least one, all of them in the rows.
    out : Path
        The picture.
    """
    rows = [row for row in rows if row["shape"] in shapes and is_shown(row)]
    methods = methods_of(rows)
    n_planners = _n_planners(rows, methods)
    heights = (0.17 * len(methods) + 0.35, 3.3)
    figure = new_figure(sum(heights) + 1.25)
    grid = figure.subplots(2, len(shapes), squeeze=False, sharey="row", height_ratios=heights)
    for column, shape in enumerate(shapes):
        here = [row for row in rows if row["shape"] == shape]
        strip, times = grid[0, column], grid[1, column]
        strip.set_title(shape, fontsize=10, fontweight="bold")
        _success_strip(strip, here, methods)
        if 0 < n_planners < len(methods):
            strip.axhline(n_planners, color=COLOURS["edge"], linewidth=1.2)
        seconds_axis(times)
        plain(times)
        times.set_xlim(0.15, 1.03)
        times.set_xlabel("index I: link over longest rod", fontsize=8)
    planned = [row for row in rows if not is_learner(row)]
    time_curves(
        grid[1, :].tolist(), [[row for row in planned if row["shape"] == shape] for shape in shapes], index_of
    )
    grid[1, 0].set_ylabel("median time", fontsize=8)
    _success_bar(figure, grid[0, :].tolist())
    legend(figure, methods_of(planned))
    save(figure, out)


def _n_planners(rows: Sequence[Row], methods: Sequence[str]) -> int:
    """Return how many of the methods, the first ones, are planners."""
    planning = {row["method"] for row in rows if not is_learner(row)}
    return sum(method in planning for method in methods)


def _success_strip(axes: Axes, rows: Sequence[Row], methods: Sequence[str]) -> None:
    """Draw success over the index, a line for each method."""
    exact = sorted({round(row["index"], 2) for row in rows})
    merged = len(exact) > MANY

    def column(row: Row) -> float:
        index = float(row["index"])
        return round(round(index / STEP) * STEP if merged else index, 2)

    columns = sorted({column(row) for row in rows})
    shares = _shares(rows, methods, columns, column)
    names = [f"{value:.2g}".lstrip("0") for value in columns]
    show_shares(axes, shares, names, methods)
    axes.set_xticks(np.arange(0, len(columns), 3) + 0.5, names[::3])
    axes.tick_params(labelsize=7.5)


def _shares(
    rows: Sequence[Row], methods: Sequence[str], columns: Sequence[Any], column: Callable[[Row], Any]
) -> FloatArray:
    """Return shares of successes, shape (n_methods, n_columns), NaN where nothing was measured."""
    groups = grouped(rows, lambda row: (row["method"], column(row)))
    return np.array(
        [
            [
                np.mean([succeeded(row) for row in groups[name, value]])
                if (name, value) in groups
                else np.nan
                for value in columns
            ]
            for name in methods
        ],
        dtype=np.float64,
    ).reshape(len(methods), len(columns))


def _success_bar(figure: Figure, axes: Any, **more: Any) -> None:
    """Explain the colours of success."""
    colours = ScalarMappable(Normalize(0.0, 1.0), SUCCESS)
    style: dict[str, Any] = {"location": "right", "aspect": 22, "pad": 0.01, "fraction": 0.05}
    bar = figure.colorbar(colours, ax=axes, **(style | more))
    bar.set_ticks([0.0, 0.5, 1.0], labels=["0 %", "50 %", "100 %"])
    bar.ax.tick_params(labelsize=7.5, length=2)
    bar.set_label("success", fontsize=8)
    bar.outline.set_visible(False)


def draw_links(rows: Sequence[Row], out: Path) -> None:
    """Draw the time of all planners over the number of links: a column for each index.

    Parameters
    ----------
    rows : sequence of mapping
        Of the study of the links, at least one of a planner.
    out : Path
        The picture.
    """
    rows = [row for row in rows if not is_learner(row)]
    indices = sorted({round(row["index"], 2) for row in rows})
    figure = new_figure(4.6)
    every = figure.subplots(1, len(indices), squeeze=False, sharey=True)[0]
    for axes, index in zip(every, indices, strict=True):
        seconds_axis(axes)
        axes.set_xscale("log")
        plain(axes)
        axes.xaxis.set_major_locator(FixedLocator(TICKS))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_title(f"I = {index:.2f}", fontsize=10, fontweight="bold")
        axes.set_xlabel("links", fontsize=8)
    groups = [[row for row in rows if round(row["index"], 2) == index] for index in indices]
    time_curves(every, groups, lambda group: float(links_of(group) or np.nan))
    every[0].set_ylabel("median time", fontsize=8)
    legend(figure, methods_of(rows))
    save(figure, out)


def draw_ladder(rows: Sequence[Row], out: Path) -> None:
    """Draw the success of all methods on all rungs, of learners with deterministic actions, as colours."""
    rows = [row for row in rows if is_shown(row)]
    methods, order = methods_of(rows), ladder_order(rows)
    tasks = grouped(rows, lambda row: row["task"])
    named = [rung(task, tasks[task]) for task in order]
    labels = [f"{task}   I {index}, {links} links" for task, index, links, _ in named]
    labels = [label.replace("I no bend", "no bend") for label in labels]
    shares = _shares(rows, methods, order, lambda row: row["task"]).T
    figure = new_figure(0.23 * len(order) + 1.6)
    axes = figure.subplots()
    show_shares(axes, shares, methods, labels, numbers=True, on_top=True)
    planners = _n_planners(rows, methods)
    if 0 < planners < len(methods):
        axes.axvline(planners, color=COLOURS["edge"], linewidth=1.2)
    for label in axes.get_xticklabels():
        label.set(rotation=40, ha="left", rotation_mode="anchor")
    _success_bar(figure, axes, location="bottom", aspect=50, shrink=0.5, pad=0.015, fraction=0.03)
    save(figure, out)


def draw_profiles(rows: Sequence[Row], out: Path) -> bool:
    """Draw performance profiles: planners over time, learners over score. Return whether there was any.

    Every task counts alike. Of learners the deterministic actions are shown.
    """
    panels = [
        (name, label, scores)
        for name, label, scores in (
            ("planners", "solved within", _planner_speeds(rows)),
            ("learners", "normalised return above", normalised_runs(rows, "mean")),
            ("learners", "share of successes above", success_runs(rows, "mean")),
        )
        if shared_tasks(scores)[1]
    ]
    if not panels:
        return False
    figure = new_figure(4.4)
    every = figure.subplots(1, len(panels), squeeze=False, sharey=True)[0]
    shown: list[str] = []
    for axes, (name, label, scores) in zip(every, panels, strict=True):
        tasks, names = shared_tasks(scores)
        draw = _draw_speeds if name == "planners" else _draw_scores
        draw(axes, {method: [scores[method][task] for task in tasks] for method in names})
        plain(axes)
        axes.set_ylim(-0.02, 1.02)
        axes.set_xlabel(label, fontsize=8)
        axes.set_title(f"{name}, {len(tasks)} tasks", fontsize=10, fontweight="bold")
        shown += [method for method in names if method not in shown]
    every[0].set_ylabel("share of runs (every task counts alike)", fontsize=8)
    every[0].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:.0f} %"))
    legend(figure, shown)
    save(figure, out)
    return True


def _planner_speeds(rows: Sequence[Row]) -> Scores:
    """Return 1 / time of every run of a planner, 0 if it did not succeed."""
    planned = [row for row in rows if not is_learner(row)]
    return {
        method: {
            task: [1.0 / max(row["seconds"], 1e-6) if succeeded(row) else 0.0 for row in here]
            for task, here in grouped(
                (row for row in planned if row["method"] == method), lambda row: row["task"]
            ).items()
        }
        for method in methods_of(planned)
    }


def _draw_speeds(axes: Axes, scores: Mapping[str, Runs]) -> None:
    seconds_axis(axes, "x")
    speeds = [speed for runs in scores.values() for task in runs for speed in task if speed > 0.0] or [1.0]
    times = np.geomspace(0.8 / max(speeds), 1.2 / min(speeds), 300)
    for method, runs in scores.items():
        _profile_line(axes, method, times, _profile(runs, 1.0 / times))


def _draw_scores(axes: Axes, scores: Mapping[str, Runs]) -> None:
    highest = max(1.0, *(max(task) for runs in scores.values() for task in runs))
    taus = np.linspace(0.0, highest, 301)
    for method, runs in scores.items():
        _profile_line(axes, method, taus, _profile(runs, taus))


def _profile(runs: Runs, thresholds: FloatArray) -> FloatArray:
    """Return the mean of the profiles of all tasks, of which some may have more runs than others."""
    profiles = [performance_profile([[score] for score in task], thresholds) for task in runs]
    return np.asarray(np.mean(profiles, axis=0), dtype=np.float64)


def _profile_line(axes: Axes, method: str, across: FloatArray, shares: FloatArray) -> None:
    look = style_of(method)
    axes.plot(
        *(across, shares, look.line),
        color=look.colour,
        linewidth=look.width,
        marker=look.marker,
        drawstyle="steps-post",
        markersize=4,
        markevery=(first_mark(method), 40),
        zorder=3.5 if method in OURS else 3.0,
    )


def first_mark(method: str) -> int:
    """Return where the first marker of a line is, so that those of lines that run together are apart."""
    return sum(map(ord, method)) % 40
