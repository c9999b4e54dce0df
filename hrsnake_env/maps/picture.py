"""A picture of what was understood of a map, with axes to read off where base and goal shall be."""

from __future__ import annotations

import os
import textwrap
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from shapely.geometry import Polygon

from hrsnake_env.appearance import COLOURS
from hrsnake_env.files import replacing
from hrsnake_env.maps.reading import MapReading
from hrsnake_env.maze import Maze

__all__ = ["draw_reading"]

PARTS = ("#ffffff", "#cfe3f7", "#fde4b8", "#d3eed9", "#ead9f2", "#f9d5d5")
"""Of the parts of the free space that are not joined: the largest first; the last is for all others."""

SIDE, LEAST, LINE = 7.0, 2.5, 0.165
"""The longer side of the map, the least of the shorter one, and a line of text, in inches."""

MARGIN = 0.9
"""Round the axes, for their numbers, in inches."""


def draw_reading(reading: MapReading, out: str | os.PathLike[str], maze: Maze | None = None) -> None:
    """Draw what was understood of a map.

    Parameters
    ----------
    reading : MapReading
        What was understood.
    out : path
        The picture (.png, .svg, .pdf).
    maze : Maze, optional
        Made of the reading; shows the base and the goal that it has, instead of the map's.
    """
    x_min, y_min, x_max, y_max = reading.free_space.bounds
    margin = 0.03 * max(x_max - x_min, y_max - y_min)
    wide, high = x_max - x_min + 2 * margin, y_max - y_min + 2 * margin
    width, height = (max(SIDE * side / max(wide, high), LEAST) for side in (wide, high))
    caption = _caption(reading, int(13 * (width + MARGIN)))
    below = LINE * len(caption) + MARGIN
    figure = Figure(figsize=(width + 1.5 * MARGIN, height + 0.5 * MARGIN + below), facecolor="white")
    FigureCanvasAgg(figure)
    full_width, full_height = figure.get_size_inches()
    axes = figure.add_axes(
        (MARGIN / full_width, below / full_height, width / full_width, height / full_height)
    )
    axes.set_facecolor(COLOURS["wall"])
    axes.set_xlim(x_min - margin, x_max + margin)
    axes.set_ylim(y_min - margin, y_max + margin)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"x in {reading.units}")
    axes.set_ylabel(f"y in {reading.units}")
    axes.minorticks_on()
    axes.grid(which="major", color=COLOURS["edge"], alpha=0.35, linewidth=0.6, zorder=2)
    axes.grid(which="minor", color=COLOURS["edge"], alpha=0.12, linewidth=0.4, zorder=2)
    _draw_parts(axes, reading)
    _draw_ends(axes, reading, maze)
    axes.set_title(reading.name if maze is None else maze.name, fontsize=11, parse_math=False)
    figure.text(
        0.02,
        0.1 / full_height,
        "\n".join(caption),
        fontsize=8,
        va="bottom",
        linespacing=1.4,
        parse_math=False,
    )
    with replacing(out) as part:
        figure.savefig(part, dpi=120)


def _caption(reading: MapReading, columns: int) -> list[str]:
    parts = len(reading.parts)
    lines = [
        f"White: free space. Grey: walls. They moved by {reading.moved:.4g} {reading.units} at most.",
        *([f"Coloured: {parts - 1} other parts that are not joined to the white one."] if parts > 1 else []),
        *reading.notes,
    ]
    return [row for line in lines for row in textwrap.wrap(line, max(columns, 30))]


def _draw_parts(axes: Axes, reading: MapReading) -> None:
    for number, part in enumerate(reading.parts):
        axes.add_patch(
            PathPatch(
                _outline(part),
                facecolor=PARTS[min(number, len(PARTS) - 1)],
                edgecolor=COLOURS["edge"],
                linewidth=0.7,
                zorder=1,
            )
        )


def _outline(part: Polygon) -> Path:
    rings = [shapely.get_coordinates(ring) for ring in shapely.get_rings(part)]
    codes = np.concatenate(
        [[Path.MOVETO, *[Path.LINETO] * (len(ring) - 2), Path.CLOSEPOLY] for ring in rings]
    )
    return Path(np.concatenate(rings), codes)


def _draw_ends(axes: Axes, reading: MapReading, maze: Maze | None) -> None:
    """Draw the base as an arrow along its heading, and the goal as a disc, with their coordinates."""
    base: Any = reading.base_pose if maze is None else maze.base_pose
    goal: Any = reading.goal if maze is None else maze.goal
    radius = reading.goal_radius if maze is None else maze.goal_radius
    x_min, y_min, x_max, y_max = reading.free_space.bounds
    label: dict[str, Any] = {
        "xytext": (8, 8),
        "textcoords": "offset points",
        "fontsize": 8,
        "zorder": 5,
        "bbox": {"boxstyle": "round,pad=0.2", "facecolor": "white", "alpha": 0.8, "edgecolor": "none"},
    }
    if goal is not None:
        place = (float(goal[0]), float(goal[1]))
        if radius is not None:
            axes.add_patch(Circle(place, radius, facecolor=COLOURS["goal"], alpha=0.35, zorder=3))
        axes.plot(*place, marker="x", color=COLOURS["goal"], markersize=7, zorder=4)
        axes.annotate(f"goal {place[0]:.6g}, {place[1]:.6g}", place, color=COLOURS["goal"], **label)
    if base is not None:
        x, y, heading = (float(value) for value in base)
        length = 0.07 * max(x_max - x_min, y_max - y_min)
        ahead = (x + length * np.cos(heading), y + length * np.sin(heading))
        arrow = {"arrowstyle": "-|>", "color": COLOURS["arm"], "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", ahead, (x, y), arrowprops=arrow, zorder=4)
        axes.plot(x, y, marker="o", color=COLOURS["arm"], markersize=5, zorder=4)
        text = f"base {x:.6g}, {y:.6g}, {np.degrees(heading):.4g} deg"
        axes.annotate(text, (x, y), color=COLOURS["arm"], **label)
