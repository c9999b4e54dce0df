"""What the paper's figures consist of, each drawn on a matplotlib Axes: walls, path, beams, corners, arms."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import ArrayLike

from hrsnake_env.appearance import COLOURS
from hrsnake_env.arm import FloatArray
from hrsnake_env.maze import Maze
from hrsnake_env.pictures import ArmDrawing
from planners.beam_planner import CHOICES
from planners.beams import Beams
from planners.corners import Corner
from planners.kernels.beam_types import AXIS, EDGE, PATH, TANGENT
from planners.kernels.types import IntArray
from planners.path import Path
from planners.problem import Motion

__all__ = [
    "CHOICE_COLOURS",
    "GREEN",
    "RED",
    "STAGES",
    "STYLE",
    "choice_handles",
    "draw_arm",
    "draw_arrow",
    "draw_beams",
    "draw_choices",
    "draw_ends",
    "draw_path",
    "draw_relay",
    "draw_rings",
    "draw_stages",
    "draw_walls",
    "evenly_fed",
    "mark_corner",
    "wall_depths",
    "zoom",
]

GREEN, RED = "#1a9850", "#d73027"
"""The paper's colours of the left and the right beams."""

CHOICE_COLOURS = {AXIS: "#8a9099", TANGENT: "#1f5fae", EDGE: "#e67700", PATH: "#8e44ad"}
"""Colours of links by what they do, by its number in the record of a run."""

STAGES = ((0.35, "#d6336c"), (0.65, "#8e44ad"), (1.0, COLOURS["arm"]))
"""Poses of a motion that are drawn together: their share of the motion, and their colour."""

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


def draw_stages(axes: Axes, joints: FloatArray) -> None:
    """Draw the arm at the `STAGES` of a motion, joints of shape (n_poses, n_links + 1, 2); dots mark tips."""
    for share, colour in STAGES:
        pose = joints[round(share * (len(joints) - 1))]
        draw_arm(axes, pose, colour=colour)
        axes.plot(*pose[-1], "o", color=colour, markersize=6, markeredgecolor="white", zorder=8)


def draw_choices(
    axes: Axes, ends: FloatArray, choices: ArrayLike, linewidth: float = 3.0, alpha: float = 1.0
) -> None:
    """Draw links in the colours of what they do.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    ends : array, shape (n_links + 1, 2)
        Joint positions, the tip first, in maze units.
    choices : array-like, shape (n_links or more,)
        What each link does, the tip's first, as in the record of a run.
    linewidth : float
        In points.
    alpha : float
        1 is opaque.
    """
    lines = np.stack([ends[1:], ends[:-1]], axis=1)
    colours = [CHOICE_COLOURS[int(choice)] for choice in np.asarray(choices)[: len(lines)]]
    axes.add_collection(
        LineCollection(
            list(lines), colors=colours, linewidths=linewidth, alpha=alpha, capstyle="round", zorder=4
        )
    )
    axes.plot(*ends.T, "o", color=COLOURS["joint"], markersize=1.3 * linewidth, alpha=alpha, zorder=5)


def choice_handles() -> list[Line2D]:
    """Return what a legend needs to name the colours of `draw_choices`."""
    return [Line2D([], [], color=CHOICE_COLOURS[k], linewidth=3.0, label=name) for k, name in CHOICES.items()]


def draw_relay(axes: Axes, feed: FloatArray, choices: ArrayLike) -> None:
    """Draw what each link does, shape (n_poses, n_links), over the feed, shape (n_poses,); links are rows."""
    rows = np.asarray(choices).T
    n_links = len(rows)
    borders = np.append(feed, feed[-1])
    colours = ListedColormap([CHOICE_COLOURS[k] for k in sorted(CHOICE_COLOURS)])
    norm = BoundaryNorm(np.arange(len(CHOICE_COLOURS) + 1) - 0.5, len(CHOICE_COLOURS))
    axes.pcolormesh(borders, np.arange(n_links + 1) + 0.5, rows, cmap=colours, norm=norm)
    axes.hlines(np.arange(1, n_links) + 0.5, feed[0], feed[-1], color="white", linewidth=2.0)
    axes.set_ylim(n_links + 0.5, 0.5)
    axes.set_yticks(range(1, n_links + 1))
    axes.set_ylabel("link, from the tip")


def draw_arrow(axes: Axes, start: ArrayLike, end: ArrayLike, colour: str, linewidth: float = 1.4) -> None:
    """Draw a vector from one place to another."""
    look = {"arrowstyle": "-|>", "color": colour, "linewidth": linewidth, "shrinkA": 0.0, "shrinkB": 0.0}
    tail, head = (tuple(np.asarray(place, dtype=np.float64).tolist()) for place in (start, end))
    axes.annotate("", head, xytext=tail, arrowprops=look, zorder=7)


def evenly_fed(feed: FloatArray, spacing: float) -> IntArray:
    """Return poses at even spacing of the feed, shape (n_poses,): where joints move fast there are more."""
    return np.searchsorted(feed, np.arange(feed[0], feed[-1], spacing))


def wall_depths(motion: Motion, maze: Maze, poses: IntArray | None = None, samples: int = 65) -> FloatArray:
    """Compute how deep each link is in the walls at each pose, for pictures: the checker has the last word.

    Parameters
    ----------
    motion : Motion
        Valid or not.
    maze : Maze
        With the exact walls.
    poses : array of int, shape (n,), optional
        Look at these poses only.
    samples : int
        Evenly spaced points on a link at which depth is looked at.

    Returns
    -------
    depths : array, shape (n_poses or n, n_links)
        Of links from the tip, in maze units; 0 where a link is free. Of links in the feeder, what is past the
        base counts.
    """
    feed, joints = (
        (motion.feed, motion.joints) if poses is None else (motion.feed[poses], motion.joints[poses])
    )
    arc = feed[:, None] - (motion.n_links - np.arange(motion.n_links + 1)) * motion.link_length
    joints = np.where(arc[..., None] < 0.0, motion.base_pose[:2], joints)
    pose, link = np.nonzero(arc[:, 1:] > 1e-9 * motion.link_length)
    starts, ends = joints[pose, link], joints[pose, link + 1]
    lines = shapely.linestrings(np.stack([starts, ends], axis=1))
    outside = np.flatnonzero(~shapely.covers(maze.free_space, lines))
    shares = np.linspace(0.0, 1.0, samples)[:, None]
    walls, along = maze.walls[:, 0], maze.walls[:, 1] - maze.walls[:, 0]
    depths = np.zeros((len(feed), motion.n_links))
    for k in outside:
        points = starts[k] + shares * (ends[k] - starts[k])
        offset = points[~shapely.intersects_xy(maze.free_space, points)][:, None] - walls
        nearest = np.clip(np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
        distances = np.linalg.norm(offset - nearest[..., None] * along, axis=2)
        depths[pose[k], link[k]] = distances.min(axis=1).max(initial=0.0)
    return depths[:, ::-1]
