"""A chart of what arms need over the length of their links."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hrsnake_env.appearance import COLOURS
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from planners.longest import LongestLink

__all__ = ["draw_longest"]


def draw_longest(maze: Maze, result: LongestLink, out: Path) -> None:
    """Draw what arms need over the length of their links: number of links, joint range and joint speed.

    Parameters
    ----------
    maze : Maze
        The maze.
    result : LongestLink
        Of `longest_link` in that maze.
    out : Path
        The picture (.png, .svg, .pdf).
    """
    figure = Figure(figsize=(7.0, 6.4), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    every = list(figure.subplots(3, 1, sharex=True))
    solved = [trial for trial in result.trials if trial.passes]
    lengths = np.array([trial.link_length for trial in solved])
    curves = {
        "links needed": [trial.n_links for trial in solved],
        "joint range\n(deg)": np.degrees([trial.joint_range or 0.0 for trial in solved]),
        f"joint speed\n(deg per {maze.units} of travel)": np.degrees(
            [trial.joint_speed or 0.0 for trial in solved]
        ),
    }
    for axes, (label, values) in zip(every, curves.items(), strict=True):
        axes.plot(lengths, values, color=COLOURS["arm"], linewidth=1.0, marker="o", markersize=3.5)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
        axes.grid(color="#e3e5e8", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        _mark_lengths(axes, result)
    every[0].legend(loc="upper right", fontsize=8, framealpha=0.9)
    every[-1].set_xlabel(f"link length ({maze.units})")
    figure.suptitle(f"{maze.name}: {_sum_up(result)}", fontsize=11)
    with replacing(out) as part:
        figure.savefig(part)


def _mark_lengths(axes: Axes, result: LongestLink) -> None:
    """Mark the longest link, the bound, and below them the lengths that failed."""
    if result.length > 0.0:
        axes.axvline(result.length, color=COLOURS["goal"], linewidth=1.4, label="longest that passes")
    axes.axvline(
        result.bound.upper, color=COLOURS["edge"], linewidth=1.4, linestyle="--", label="no longer rod passes"
    )
    tried = [trial for trial in result.trials if trial.link_length <= result.bound.upper]
    kinds = {
        "planning failed": (COLOURS["collision"], [t for t in tried if not t.passes and not t.out_of_time]),
        "out of time": (COLOURS["edge"], [t for t in tried if t.out_of_time]),
    }
    for label, (colour, trials) in kinds.items():
        if trials:
            lengths = [trial.link_length for trial in trials]
            style: dict[str, Any] = {"marker": "x", "linestyle": "", "markersize": 5, "clip_on": False}
            style |= {"transform": axes.get_xaxis_transform(), "zorder": 5}
            axes.plot(lengths, np.zeros(len(lengths)), color=colour, label=label, **style)


def _sum_up(result: LongestLink) -> str:
    if result.length == 0.0:
        return "no length passes"
    return f"links of up to {result.length:.4g} {result.units}, index I = {result.index_text}"
