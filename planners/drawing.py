"""Pictures of what planners see and do: path, beams, corners, poses, animations."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.collections import LineCollection
from matplotlib.image import imsave

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.rendering import MazePicture
from planners.problem import Motion, Progress
from planners.survey import Geometry, survey

__all__ = ["animate", "draw_geometry", "draw_poses"]

GREEN, RED = "#1a9850", "#d73027"
"""The paper's colours of the left and the right beams."""

N_PANELS = 5
N_FRAMES, FRAMES_PER_SECOND = 90, 15


class Run(Protocol):
    """A run whose poses can be drawn."""

    @property
    def joints(self) -> FloatArray:
        """Joint positions, shape (n_poses, n_links + 1, 2)."""

    def pinched(self, pose: int) -> Collection[int]:
        """Return the links that pinch a wall in a pose."""

    def collided(self, pose: int) -> Collection[int]:
        """Return the links that collide in a pose."""


def draw_geometry(maze: Maze, motion: Motion | None, out: Path, link_radius: float = 0.0) -> dict[str, Any]:
    """Draw path, beams and critical corners of a maze, and poses of a motion if one is given.

    Parameters
    ----------
    maze : Maze
        The maze.
    motion : Motion or None
        In that maze.
    out : Path
        The picture; its ending says the format.
    link_radius : float
        Beams end at walls grown by this much, in maze units.

    Returns
    -------
    summary : dict
        Passage width, path length and corners.

    Raises
    ------
    InputError
        If no path leads to the goal.
    """
    geometry = survey(maze, link_radius)
    if geometry is None:
        raise InputError(
            f"Expected a maze with a path for links of radius {link_radius:g}, but in '{maze.name}' none "
            f"leads from the base to the goal."
        )
    picture = MazePicture(maze)
    _draw_beams(picture, geometry)
    if motion is not None:
        for pose in np.linspace(0, motion.n_poses - 1, N_PANELS).round().astype(int):
            picture.add_arm(motion.joints[pose], alpha=0.2 + 0.8 * pose / max(motion.n_poses - 1, 1))
    picture.save(out)
    return {
        "passage_width": geometry.path.width,
        "path_length": geometry.path.length,
        "corners": [{"turn": corner.name, "place": corner.place} for corner in geometry.corners],
    }


def _draw_beams(picture: MazePicture, geometry: Geometry) -> None:
    axes, path, beams = picture.axes, geometry.path, geometry.beams
    for ends, colour in ((beams.left, GREEN), (beams.right, RED)):
        lines = np.stack([path.points, ends], axis=1)
        axes.add_collection(LineCollection(list(lines), colors=colour, linewidths=0.4, alpha=0.7))
    axes.plot(*path.points.T, color="black", linewidth=1.4)
    for corner in geometry.corners:
        run = path.points[corner.first : corner.last + 1]
        colour = GREEN if corner.turn > 0 else RED
        axes.plot(*run.T, color=colour, linewidth=3.5, solid_capstyle="round")
        axes.plot(*corner.place, marker="o", color="black", markersize=4)
        middle = run[len(run) // 2]
        outward = middle - corner.place
        axes.annotate(
            f"{corner.name} corner",
            middle,
            xytext=16.0 * outward / np.hypot(*outward),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=8,
            weight="bold",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
        )


def draw_poses(maze: Maze, run: Run, out: Path) -> None:
    """Draw five poses of a run side by side, evenly chosen, the last among them; orange links pinch a wall.

    Parameters
    ----------
    maze : Maze
        The maze.
    run : Run
        What came of a motion in the simulator.
    out : Path
        The picture (.png).
    """
    panels = []
    for pose in np.linspace(0, len(run.joints) - 1, N_PANELS + 1).round().astype(int)[1:]:
        picture = MazePicture(maze, title=f"pose {pose}")
        picture.draw_arm(run.joints[pose], pinched=run.pinched(pose), collided=run.collided(pose))
        panels.append(picture.rgb())
    with replacing(out) as part:
        imsave(part, np.concatenate(panels, axis=1))


def animate(maze: Maze, run: Run, out: Path, progress: Progress | None = None) -> None:
    """Write an animation (GIF) of a run, completely or not at all.

    Parameters
    ----------
    maze : Maze
        The maze.
    run : Run
        What came of a motion in the simulator.
    out : Path
        The file.
    progress : callable, optional
        Called with "animate" and the share done.
    """
    picture = MazePicture(maze, title="orange: pinches a wall")
    frames = np.unique(np.linspace(0, len(run.joints) - 1, N_FRAMES).round().astype(int))
    writer = PillowWriter(fps=FRAMES_PER_SECOND)
    with replacing(out) as part, writer.saving(picture.figure, part, dpi=picture.figure.dpi):
        for number, frame in enumerate(frames):
            picture.draw_arm(run.joints[frame], pinched=run.pinched(frame), collided=run.collided(frame))
            writer.grab_frame(facecolor=picture.figure.get_facecolor())
            if progress is not None:
                progress("animate", (number + 1) / len(frames))
