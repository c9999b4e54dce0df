"""What the paper's figures consist of, each drawn on a matplotlib Axes: walls, path, beams, corners, arms."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray
from hrsnake_env.maze import Maze
from hrsnake_env.rendering import COLOURS, ArmDrawing
from planners.beams import Beams
from planners.corners import Corner
from planners.path import Path

__all__ = [
    "GREEN",
    "RED",
    "STYLE",
    "draw_arm",
    "draw_beams",
    "draw_ends",
    "draw_path",
    "draw_rings",
    "draw_walls",
    "mark_corner",
    "zoom",
]

GREEN, RED = "#1a9850", "#d73027"
"""The paper's colours of the left and the right beams."""

STYLE: dict[str, Any] = {
    "figure.constrained_layout.use": True,
    "figure.dpi": 130,
    "axes.titlesize": 10,
    "axes.labelsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.framealpha": 0.95,
}
"""How figures in notebooks look: `plt.rcParams.update(STYLE)`."""


def draw_walls(axes: Axes, maze: Maze) -> None:
    """Draw free space in white, walls in grey; x and y are in maze units, and equally long."""
    draw_rings(axes, maze.rings)


def draw_rings(axes: Axes, rings: Iterable[FloatArray]) -> None:
    """Draw what `Maze.rings` yields, perhaps turned, as walls."""
    parts = [
        Outline(ring, [Outline.MOVETO, *[Outline.LINETO] * (len(ring) - 2), Outline.CLOSEPOLY])
        for ring in rings
    ]
    outline = Outline.make_compound_path(*parts)
    axes.set_facecolor(COLOURS["wall"])
    axes.add_patch(PathPatch(outline, facecolor="white", edgecolor="none", zorder=0))
    axes.add_patch(PathPatch(outline, facecolor="none", edgecolor=COLOURS["edge"], linewidth=1.3, zorder=6))
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_visible(False)


def draw_ends(axes: Axes, maze: Maze) -> None:
    """Draw the base, a triangle that points where the arm is fed, and the goal, a green disc."""
    x, y, heading = (float(value) for value in maze.base_pose)
    marker = (3, 0, np.degrees(heading) - 90.0)
    axes.plot(x, y, marker=marker, color=COLOURS["base"], markersize=9, zorder=7, clip_on=False)
    goal = (float(maze.goal[0]), float(maze.goal[1]))
    axes.add_patch(Circle(goal, maze.goal_radius, facecolor=COLOURS["goal"], alpha=0.45, zorder=2))


def draw_path(axes: Axes, path: Path, raw: bool = False, **style: Any) -> None:
    """Draw the path, or the raw line before windowing; `style` goes to `Axes.plot`."""
    points = path.raw if raw else path.points
    usual = {"color": "#8a9099" if raw else "black", "linewidth": 1.0 if raw else 1.4}
    axes.plot(*points.T, **(usual | style))


def draw_beams(
    axes: Axes, beams: Beams, every: int = 1, longest: float = np.inf, linewidth: float = 0.6
) -> None:
    """Draw the beams, the left ones green and the right ones red.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    beams : Beams
        The beams.
    every : int
        Draw one of so many.
    longest : float
        Longer beams are cut to this length, in maze units.
    linewidth : float
        In points.
    """
    for side, colour in ((+1, GREEN), (-1, RED)):
        lines = np.stack([beams.origins, beams.ends(side, longest)], axis=1)[::every]
        axes.add_collection(LineCollection(list(lines), colors=colour, linewidths=linewidth, alpha=0.7))


def mark_corner(axes: Axes, path: Path, corner: Corner, label: str | None = None) -> None:
    """Mark a corner: its path points in the colour of its side, a dot on the wall, and its name beside.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    path : Path
        The path on which the corner is.
    corner : Corner
        The corner.
    label : str, optional
        Instead of "left corner" or "right corner"; nothing is written if it is empty.
    """
    run = path.points[corner.first : corner.last + 1]
    axes.plot(*run.T, color=GREEN if corner.turn > 0 else RED, linewidth=3.5, solid_capstyle="round")
    axes.plot(*corner.place, marker="o", color="black", markersize=4, zorder=7)
    middle = run[len(run) // 2]
    outward = middle - corner.place
    axes.annotate(
        f"{corner.name} corner" if label is None else label,
        middle,
        xytext=16.0 * outward / np.hypot(*outward),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=8,
        weight="bold",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        zorder=8,
    )


def zoom(axes: Axes, centre: ArrayLike, half_size: float | tuple[float, float]) -> None:
    """Show only what is around a place.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to look closer.
    centre : array-like, shape (2,)
        In maze units.
    half_size : float or tuple of two floats
        Half the width and half the height of what is shown, in maze units.
    """
    middle, half = np.asarray(centre, dtype=np.float64), np.broadcast_to(half_size, 2)
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])


def draw_arm(
    axes: Axes,
    joints: ArrayLike,
    colour: str = COLOURS["arm"],
    alpha: float = 1.0,
    pinched: Collection[int] = (),
    collided: Collection[int] = (),
) -> ArmDrawing:
    """Draw an arm in one pose; what is returned can be moved to other poses.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    joints : array-like, shape (n_links + 1, 2)
        Joint positions, base end first, in maze units.
    colour : str
        Of the links.
    alpha : float
        1 is opaque.
    pinched, collided : collection of int
        Links to show as touching a wall, and as going into one.
    """
    arm = ArmDrawing(axes, colour, alpha)
    arm.move(joints, pinched, collided)
    return arm
