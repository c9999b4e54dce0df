"""Pictures of what planners see and do: path, beams, corners, poses, animations."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import shapely
from matplotlib.animation import PillowWriter
from matplotlib.image import imsave

from hrsnake_env.appearance import COLOURS
from hrsnake_env.arguments import length_text, place_text
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.contacts import PINCH_TOLERANCE
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.pictures import MazePicture
from planners.figures import draw_beams, draw_path, mark_corner
from planners.interrupts import interruption_first
from planners.problem import Motion, PlanningResult, Progress
from planners.survey import Geometry, survey

__all__ = ["animate", "draw_failure", "draw_geometry", "draw_poses", "draw_result"]

TEXT_WIDTH = 3.2
"""Of what stands beside a picture of a failure, in inches."""

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
    draw_beams(picture.axes, geometry.beams, linewidth=0.4)
    draw_path(picture.axes, geometry.path)
    for corner in geometry.corners:
        mark_corner(picture.axes, geometry.path, corner)


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
    dpi = picture.figure.dpi
    with interruption_first(), replacing(out) as part, writer.saving(picture.figure, part, dpi=dpi):
        for number, frame in enumerate(frames):
            picture.draw_arm(run.joints[frame], pinched=run.pinched(frame), collided=run.collided(frame))
            writer.grab_frame(facecolor=picture.figure.get_facecolor())
            if progress is not None:
                progress("animate", (number + 1) / len(frames))


@dataclass(frozen=True, eq=False)
class _Planned:
    """A planned motion as a run: what touches is measured, not simulated."""

    maze: Maze
    joints: FloatArray
    reach: float

    def pinched(self, pose: int) -> Collection[int]:
        """Return the links, past the base, that a wall is within reach of."""
        joints = self.joints[pose]
        x, y, heading = self.maze.base_pose
        outside = (joints[:-1] - (x, y)) @ (np.cos(heading), np.sin(heading)) >= 0.0
        links = shapely.linestrings(np.stack([joints[:-1], joints[1:]], axis=1))
        near = shapely.distance(links, self.maze.free_space.boundary) <= self.reach
        return [int(link) for link in np.flatnonzero(near & outside)]

    def collided(self, pose: int) -> Collection[int]:
        """Return none: the motion was validated."""
        return ()


def draw_result(maze: Maze, arm: ArmSpec, result: PlanningResult, out: Path) -> None:
    """Draw five poses of a planned motion, links that touch a wall in orange; or what was in its way.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        The arm.
    result : PlanningResult
        Of planning with that arm in that maze.
    out : Path
        The picture (.png, .svg, .pdf).
    """
    motion = result.motion
    if motion is None:
        draw_failure(maze, arm, result, out)
        return
    reach = arm.link_radius + PINCH_TOLERANCE * arm.link_length
    draw_poses(maze, _Planned(maze, motion.joints, reach), out)


def draw_failure(maze: Maze, arm: ArmSpec, result: PlanningResult, out: Path) -> None:
    """Draw where planning ended: the path, the arm as far as it came, and the wall that is in the way.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        The arm.
    result : PlanningResult
        Without a motion.
    out : Path
        The picture (.png, .svg, .pdf).
    """
    picture, failure = MazePicture(maze), result.failure
    axes, geometry = picture.axes, survey(maze, arm.link_radius)
    if geometry is not None:
        axes.plot(*geometry.path.points.T, color="black", linewidth=1.0, linestyle=(0, (4, 3)), alpha=0.6)
    if failure is not None:
        if failure.joints is not None:
            picture.add_arm(failure.joints)
        if failure.wall is not None:
            axes.plot(*maze.walls[failure.wall].T, color=COLOURS["collision"], linewidth=4.0, zorder=3)
        ring: dict[str, Any] = {"markersize": 18, "markeredgewidth": 2.0, "fillstyle": "none", "zorder": 7}
        axes.plot(*failure.place, marker="o", color=COLOURS["collision"], **ring)
    _write_beside(picture, f"{maze.name}: {result.status}", list(_why(maze, arm, result)))
    picture.save(out)


def _write_beside(picture: MazePicture, title: str, lines: list[str]) -> None:
    """Make a picture wider on its right, and write there."""
    width, height = picture.figure.get_size_inches()
    picture.figure.set_size_inches(width + TEXT_WIDTH, height)
    picture.axes.set_position((0.0, 0.0, width / (width + TEXT_WIDTH), 1.0))
    left = (width + 0.1) / (width + TEXT_WIDTH)
    picture.figure.text(left, 0.93, title, fontsize=13, weight="bold", va="top")
    picture.figure.text(left, 0.86, "\n".join(lines), fontsize=10, va="top", linespacing=1.6)


def _why(maze: Maze, arm: ArmSpec, result: PlanningResult) -> Iterator[str]:
    failure, units = result.failure, maze.units
    yield f"links of {arm.link_length:g} {units}, planner {result.planner}"
    yield "dashed: path to the goal"
    if failure is None:
        return
    yield f"ring: {place_text(failure.place, maze.size)} {units}"
    if failure.path_position is not None:
        yield f"   {length_text(failure.path_position, maze.size)} {units} along the path"
    if failure.wall is not None:
        yield "red: the wall that is in the way"
    if failure.depth is not None:
        yield f"   a link would be {failure.depth:.3g} {units} deep in it"
    if result.longest_there is not None:
        yield f"longest link past here: {result.longest_there:.4g} {units}"
