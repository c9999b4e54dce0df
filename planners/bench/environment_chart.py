"""A chart of where the time of a step goes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hrsnake_env.files import replacing

__all__ = ["draw_where"]

SMALLEST = 0.06
"""Pieces below this share of the longest bar have no number in them."""


def draw_where(rows: Sequence[Mapping[str, Any]], out: Path) -> None:
    """Draw a bar for each arm, made of the pieces of a step.

    Parameters
    ----------
    rows : sequence of mapping
        From `planners.bench.environment_where.where`.
    out : Path
        The picture (.png, .svg, .pdf).
    """
    figure = Figure(figsize=(8.5, 1.9 + 0.75 * len(rows)), dpi=130, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    longest, left = max(row["sum"] for row in rows), np.zeros(len(rows))
    places = np.arange(len(rows))[::-1]
    colours = matplotlib.colormaps["tab20"].colors  # type: ignore[attr-defined]
    for number, piece in enumerate(rows[0]["pieces"]):
        widths = np.array([row["pieces"][piece] for row in rows])
        bars = axes.barh(places, widths, left=left, height=0.6, color=colours[number], label=piece)
        texts = [f"{width:.0f}" if width > SMALLEST * longest else "" for width in widths]
        axes.bar_label(bars, texts, label_type="center", fontsize=8)
        left += widths
    wholes = [row["whole"] for row in rows]
    axes.vlines(wholes, places - 0.36, places + 0.36, color="black", linewidth=1.5, label="whole, untimed")
    axes.set_yticks(places, [f"{row['n_links']} links" for row in rows])
    axes.set_xlabel("µs per step of the environment, with 4 substeps")
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="x", color="#e3e5e8", linewidth=0.6)
    axes.set_axisbelow(True)
    figure.legend(loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    with replacing(out) as part:
        figure.savefig(part)
