"""The charts of a report, readable at the width of a page of text, on light ground.

Ours are blue, heavier than the others, and on top. What is told by colour is told by a marker, a number or
lightness as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter, NullLocator

from hrsnake_env.appearance import COLOURS
from hrsnake_env.arm import FloatArray
from hrsnake_env.files import replacing
from planners.bench.report_rows import (
    OURS,
    Row,
    grouped,
    methods_of,
    succeeded,
    time_limit,
    typical_seconds,
)

__all__ = [
    "GRID",
    "SUCCESS",
    "WIDTH",
    "Style",
    "legend",
    "new_figure",
    "plain",
    "save",
    "seconds_axis",
    "show_shares",
    "style_of",
    "time_curves",
]

WIDTH = 9.0
"""Of all charts, in inches."""

DPI = 180

GRID = "#e3e5e8"

SUCCESS = LinearSegmentedColormap.from_list(
    "success", ["#d9822b", "#f3d9bf", "#e9edf3", "#a9c6e8", COLOURS["arm"]]
)
"""From orange (never) to our blue (always): told apart whatever colours one sees."""

TIMES = 10.0 ** np.arange(-6, 6)
"""Seconds that an axis names."""

LANE = 1.35
"""Factor from one method's mark for "not solved" to the next one's."""


@dataclass(frozen=True, kw_only=True)
class Style:
    """Hold how a method is drawn.

    Parameters
    ----------
    colour, marker : str
        As matplotlib has them.
    line : str
        Line style.
    width : float
        Of the line, in points.
    """

    colour: str
    marker: str
    line: Literal["-", "--", ":"] = "-"
    width: float = 1.2


STYLES = {
    "auto": Style(colour=COLOURS["arm"], marker="o", width=2.8),
    "track": Style(colour=COLOURS["arm"], marker="s", line="--", width=2.0),
    "sweep": Style(colour=COLOURS["arm"], marker="^", line=":", width=2.0),
    "beam": Style(colour=COLOURS["joint"], marker="D", width=1.6),
    "as-printed": Style(colour=COLOURS["joint"], marker="d", line="--", width=1.4),
    "follow": Style(colour="#6b7480", marker="x"),
    "outer-wall": Style(colour="#6b7480", marker="v", line="--"),
    "b-spline": Style(colour="#b1569a", marker="P"),
    "backbone": Style(colour="#009e73", marker="<"),
    "virtual-torque": Style(colour="#8c6d31", marker="*"),
    "pseudo-inverse": Style(colour="#009e73", marker=">", line="--"),
    "rrt-connect": Style(colour="#d55e00", marker="s", width=1.6),
    "aorrtc": Style(colour="#e69f00", marker="D", width=1.6),
    "ppo": Style(colour="#d55e00", marker="o"),
    "ppo-planned": Style(colour="#4a9fd8", marker="p", width=2.2),
    "ppo-residual": Style(colour="#b1569a", marker="^"),
    "sac": Style(colour="#009e73", marker="v"),
    "tqc": Style(colour="#a6761d", marker="H"),
    "tqc-her": Style(colour="#e69f00", marker="h"),
    "clone": Style(colour="#6b7480", marker="H"),
    "dagger": Style(colour="#8c6d31", marker="X"),
    "random": Style(colour="#9aa3ae", marker="x", line=":"),
}
"""By method. The colours are those of M. Okabe and K. Ito ("Color universal design", 2008), darkened where
they would be too light for a thin line."""


def style_of(method: str) -> Style:
    """Return how a method is drawn, also one that is not known here."""
    return STYLES.get(method, Style(colour="#1c2128", marker="."))


def new_figure(height: float) -> Figure:
    """Return an empty figure."""
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, out: Path) -> None:
    """Write a picture, completely or not at all."""
    with replacing(out) as part:
        figure.savefig(part)


def plain(axes: Axes, grid: Any = "both") -> None:
    """Take the frame away and draw a quiet grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis=grid, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=8)


def seconds_axis(axes: Axes, which: str = "y") -> None:
    """Make an axis of seconds logarithmic, with times as people write them."""
    (axes.set_yscale if which == "y" else axes.set_xscale)("log")
    axis = axes.yaxis if which == "y" else axes.xaxis
    axis.set_major_locator(LogLocator(numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _short_time(value)))
    axis.set_minor_formatter(NullFormatter())


def _short_time(seconds: float) -> str:
    return f"{seconds * 1e3:.3g} ms" if seconds < 0.9 else f"{seconds:.6g} s"


def legend(figure: Figure, methods: Sequence[str], **more: Any) -> None:
    """Explain the lines of all axes below them."""
    handles = [_line(name, label=name) for name in methods]
    columns = math.ceil(len(handles) / math.ceil(len(handles) / 7)) if handles else 1
    style: dict[str, Any] = {"loc": "outside lower center", "ncols": columns, "fontsize": 8, "frameon": False}
    every = figure.legend(handles=handles, **(style | more))
    for text in every.get_texts():
        if text.get_text() in OURS:
            text.set_fontweight("bold")


def _line(method: str, **more: Any) -> Line2D:
    look = style_of(method)
    return Line2D(
        *([], []),
        color=look.colour,
        linestyle=look.line,
        linewidth=look.width,
        marker=look.marker,
        markersize=5,
        **more,
    )


def time_curves(
    every: Sequence[Axes], groups: Sequence[Sequence[Row]], place: Callable[[Sequence[Row]], float]
) -> None:
    """Draw the median time of every planner over something, and above the limit where it is not solved.

    Parameters
    ----------
    every : sequence of matplotlib Axes
        With one axis of seconds up.
    groups : sequence of sequence of mapping
        The rows of planners in each of the axes.
    place : callable
        Given the rows of a task, returns where on the other axis it is.
    """
    rows = [row for group in groups for row in group]
    methods, top = methods_of(rows), _top(rows)
    curves = {
        (method, number): _curve(group, method, place)
        for number, group in enumerate(groups)
        for method in methods
    }
    missed = [name for name in methods if any(np.isinf(curves[name, n][1]).any() for n in range(len(every)))]
    for (method, number), (across, up) in curves.items():
        line = _line(method, zorder=3.5 if method in OURS else 3.0)
        line.set_data(across, np.where(np.isfinite(up), up, np.nan))
        every[number].add_line(line)
        if method in missed:
            _mark_missed(
                every[number],
                method,
                across[np.isinf(up)],
                _lane(top, len(missed) - 1 - missed.index(method)),
            )
    for axes in every:
        axes.autoscale_view()
    if missed:
        _show_lanes(every, top, _lane(top, len(missed)))
    every[0].yaxis.set_major_locator(FixedLocator([tick for tick in TIMES if tick <= top]))
    every[0].yaxis.set_minor_locator(NullLocator())


def _curve(
    rows: Sequence[Row], method: str, place: Callable[[Sequence[Row]], float]
) -> tuple[FloatArray, FloatArray]:
    """Return where the tasks are, and the typical time of a method there, infinite if it is not solved."""
    tasks = grouped(rows, lambda row: row["task"]).values()
    solved = [(place(task), [row for row in task if row["method"] == method]) for task in tasks]
    points = sorted((x, typical_seconds(here)) for x, here in solved if here)
    across, up = np.array(points, dtype=np.float64).reshape(-1, 2).T
    return across, up


def _top(rows: Sequence[Row]) -> float:
    """Return the time up to which a chart shows times: the largest limit, or the largest time."""
    limits = [time_limit([row]) for row in rows]
    times = [row["seconds"] for row in rows if succeeded(row) and row["seconds"] is not None]
    return max([limit for limit in limits if limit is not None] + times, default=1.0)


def _lane(top: float, number: float) -> float:
    """Return how high the marks of a method that did not solve a task are, above all times."""
    return float(top * LANE ** (1.8 + number))


def _mark_missed(axes: Axes, method: str, across: FloatArray, height: float) -> None:
    look = style_of(method)
    axes.plot(
        *(across, np.full(len(across), height), look.marker), color=look.colour, markersize=3.8, zorder=3
    )


def _show_lanes(every: Sequence[Axes], top: float, end: float) -> None:
    """Set the marks of what is not solved apart from the times."""
    for axes in every:
        axes.axhspan(top * LANE, end, color="#f4f0ea", zorder=0)
    every[0].set_ylim(top=end)
    height = float(np.sqrt(top * LANE * end))
    style: dict[str, Any] = {"fontsize": 8, "color": "#6b5a45", "ha": "right", "va": "center"}
    every[0].text(-0.02, height, "not\nsolved", transform=every[0].get_yaxis_transform(), **style)


def show_shares(
    axes: Axes,
    shares: FloatArray,
    columns: Sequence[str],
    methods: Sequence[str],
    *,
    numbers: bool = False,
    on_top: bool = False,
) -> None:
    """Draw a table of shares as colours, white where nothing was measured.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    shares : array, shape (n_methods, n_columns)
        0 to 1, NaN where nothing was measured.
    columns, methods : sequence of str
        What stands below and at the left.
    numbers : bool
        Whether to write percents into the cells.
    on_top : bool
        Whether the names of the columns stand above.
    """
    axes.pcolormesh(
        np.ma.masked_invalid(shares), cmap=SUCCESS, vmin=0.0, vmax=1.0, edgecolors="white", linewidth=0.8
    )
    axes.set_xlim(0, shares.shape[1])
    axes.set_ylim(shares.shape[0], 0)
    axes.set_xticks(np.arange(len(columns)) + 0.5, columns)
    axes.set_yticks(np.arange(len(methods)) + 0.5, methods)
    axes.tick_params(length=0, labelsize=8, top=on_top, labeltop=on_top, labelbottom=not on_top)
    axes.spines[:].set_visible(False)
    if numbers:
        for (row, column), share in np.ndenumerate(shares):
            if np.isfinite(share):
                text = f"{100 * share:.0f}"
                colour = "white" if share > 0.85 else "#1c2128"
                place = (column + 0.5, row + 0.5)
                axes.text(*place, text, ha="center", va="center", fontsize=6.5, color=colour)
    for label in [*axes.get_xticklabels(), *axes.get_yticklabels()]:
        if label.get_text() in OURS:
            label.set(fontweight="bold", color=COLOURS["arm"])
