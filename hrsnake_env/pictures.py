"""Pictures of a maze and an arm, drawn with matplotlib and without a display."""

from __future__ import annotations

import os
from collections.abc import Collection
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from numpy.typing import ArrayLike, NDArray

from hrsnake_env.appearance import COLOURS, shown_window
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze

__all__ = ["ArmDrawing", "MazePicture"]


class ArmDrawing:
    """Draw one arm, and move it cheaply.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw.
    colour : str
        Of the links.
    alpha : float
        1 is opaque.
    """

    def __init__(self, axes: Axes, colour: str = COLOURS["arm"], alpha: float = 1.0) -> None:
        style: dict[str, Any] = {"solid_capstyle": "round", "alpha": alpha, "clip_on": True}
        self._links = Line2D([], [], color=colour, linewidth=2.2, zorder=4, **style)
        self._touching = {
            kind: Line2D([], [], color=COLOURS[kind], linewidth=3.4, zorder=5, **style)
            for kind in ("pinch", "collision")
        }
        self._joints = Line2D(
            [], [], color=COLOURS["joint"], marker="o", markersize=3.2, linestyle="", alpha=alpha, zorder=6
        )
        self.artists = (self._links, *self._touching.values(), self._joints)
        for artist in self.artists:
            axes.add_line(artist)

    def move(self, joints: ArrayLike, pinched: Collection[int] = (), collided: Collection[int] = ()) -> None:
        """Show a pose.

        Parameters
        ----------
        joints : array-like, shape (n_links + 1, 2)
            Joint positions, base end first, in maze units.
        pinched, collided : collection of int
            Links to show as touching a wall, and as going into one.
        """
        points = np.asarray(joints, dtype=np.float64)
        self._links.set_data(points[:, 0], points[:, 1])
        self._joints.set_data(points[:, 0], points[:, 1])
        for kind, links in (("pinch", pinched), ("collision", collided)):
            parts = [np.vstack([points[k : k + 2], [np.nan, np.nan]]) for k in sorted(links)]
            line = np.vstack(parts) if parts else np.empty((0, 2))
            self._touching[kind].set_data(line[:, 0], line[:, 1])


class MazePicture:
    """Draw a maze once, with its base and goal, and arms in it as often as wanted.

    Parameters
    ----------
    maze : Maze
        The maze.
    height : float
        Of the picture, in inches; the width follows from the maze, between 0.4 and 3 times it.
    dpi : int
        Pixels per inch.
    title : str, optional
        Above the maze.

    Attributes
    ----------
    figure, axes : matplotlib Figure and Axes
        To draw more; x and y are in maze units.
    """

    def __init__(self, maze: Maze, *, height: float = 6.0, dpi: int = 100, title: str | None = None) -> None:
        x_min, y_min, x_max, y_max = shown_window(maze)
        share = min(max((x_max - x_min) / (y_max - y_min), 0.4), 3.0)
        # Whole even numbers of pixels, as video formats want them.
        pixels = [2 * max(round(length * dpi / 2), 1) for length in (height * share, height)]
        self.figure = Figure(figsize=(pixels[0] / dpi, pixels[1] / dpi), dpi=dpi, facecolor=COLOURS["wall"])
        self._canvas = FigureCanvasAgg(self.figure)
        top = 0.94 if title else 1.0
        self.axes = self.figure.add_axes((0.0, 0.0, 1.0, top))
        self.axes.set_axis_off()
        self.axes.set_xlim(x_min, x_max)
        self.axes.set_ylim(y_min, y_max)
        self.axes.set_aspect("equal")
        if title:
            self.figure.text(0.5, 0.97, title, ha="center", va="center", fontsize=11)
        self._draw_maze(maze)
        self._arm: ArmDrawing | None = None

    def draw_arm(
        self, joints: ArrayLike, *, pinched: Collection[int] = (), collided: Collection[int] = ()
    ) -> None:
        """Show the arm in a pose, instead of the pose that was shown before.

        Parameters
        ----------
        joints : array-like, shape (n_links + 1, 2)
            In maze units.
        pinched, collided : collection of int
            Links to show as touching a wall, and as going into one.
        """
        if self._arm is None:
            self._arm = self.add_arm()
        self._arm.move(joints, pinched, collided)

    def add_arm(
        self, joints: ArrayLike | None = None, *, colour: str = COLOURS["arm"], alpha: float = 1.0
    ) -> ArmDrawing:
        """Add one more arm, for pictures of several poses."""
        arm = ArmDrawing(self.axes, colour, alpha)
        if joints is not None:
            arm.move(joints)
        return arm

    def rgb(self) -> NDArray[np.uint8]:
        """Return the picture, shape (height, width, 3)."""
        self._canvas.draw()  # type: ignore[no-untyped-call]
        pixels: NDArray[np.uint8] = np.asarray(self._canvas.buffer_rgba())  # type: ignore[no-untyped-call]
        return pixels[:, :, :3].copy()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the picture, completely or not at all; the format follows from the path's suffix."""
        with replacing(path) as part:
            self.figure.savefig(part, facecolor=self.figure.get_facecolor())

    def _draw_maze(self, maze: Maze) -> None:
        rings = list(maze.rings)
        codes = [
            code
            for ring in rings
            for code in (Path.MOVETO, *([Path.LINETO] * (len(ring) - 2)), Path.CLOSEPOLY)
        ]
        self.axes.add_patch(
            PathPatch(
                Path(np.concatenate(rings), codes),
                facecolor=COLOURS["free"],
                edgecolor=COLOURS["edge"],
                linewidth=1.0,
                joinstyle="miter",
                zorder=1,
            )
        )
        goal = (float(maze.goal[0]), float(maze.goal[1]))
        self.axes.add_patch(
            Circle(goal, maze.goal_radius, facecolor=COLOURS["goal"], alpha=0.35, edgecolor="none", zorder=2)
        )
        self.axes.plot(*goal, marker="x", color=COLOURS["goal"], markersize=6, zorder=2)
        x, y, heading = (float(value) for value in maze.base_pose)
        self.axes.plot(
            x, y, marker=(3, 0, np.degrees(heading) - 90.0), color=COLOURS["base"], markersize=9, zorder=3
        )
