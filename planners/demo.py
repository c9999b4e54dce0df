"""The demonstration: the paper's benchmark from the maze to the verdict."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrsnake_env.arm import ArmSpec
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from planners.drawing import animate, draw_geometry, draw_poses
from planners.planning import plan
from planners.problem import PlanningResult, Progress
from planners.rollout import Episode, simulate_motion

__all__ = ["Demo", "run_demo"]

PLANNER = "beam"
"""The paper's."""

LINK_LENGTH = 430.0
"""The paper's links (section 5.1), in px."""

LONGEST = 440.0
"""The paper's l_max: both legs and the wall between them, in px."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Demo:
    """Hold what the demonstration found and wrote.

    Parameters
    ----------
    maze : Maze
        The paper's benchmark.
    arm : ArmSpec
        With the paper's link length.
    result : PlanningResult
        Planned and validated.
    episode : Episode or None
        Simulated; None if nothing was planned.
    files : tuple of Path
        Written.
    """

    maze: Maze
    arm: ArmSpec
    result: PlanningResult
    episode: Episode | None
    files: tuple[Path, ...]

    @property
    def index(self) -> float:
        """The tightness index I, Eq. (4) of the paper."""
        return self.arm.link_length / LONGEST

    @property
    def clean(self) -> bool:
        """Whether the goal was reached with a clean verdict."""
        return self.episode is not None and self.episode.success and self.episode.report.clean

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        return {
            "maze": self.maze.name,
            "link_length": self.arm.link_length,
            "index": self.index,
            "plan": self.result.to_dict(),
            "success": self.episode is not None and self.episode.success,
            "verdict": None if self.episode is None else self.episode.report.to_dict(),
            "simulate_seconds": None if self.episode is None else self.episode.seconds,
            "files": [str(path) for path in self.files],
        }


def run_demo(folder: Path, progress: Progress | None = None) -> Demo:
    """Plan, validate and simulate the paper's benchmark, and write pictures and figures.

    Parameters
    ----------
    folder : Path
        Made if missing.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    demo : Demo
        The outcome.
    """
    maze, arm = Maze.load("fig19"), ArmSpec(link_length=LINK_LENGTH)
    tell = progress if progress is not None else lambda stage, share: None
    tell("compile", 0.0)
    for planner in (PLANNER, "auto"):  # the first plans on a machine compile kernels, which would hide times
        plan(maze, arm, planner)
    tell("compile", 1.0)
    result = plan(maze, arm, PLANNER, progress=progress)
    if result.motion is None:
        return Demo(maze=maze, arm=arm, result=result, episode=None, files=())
    episode = simulate_motion(result.motion, maze, arm, progress=progress)
    folder.mkdir(exist_ok=True)
    names = ("five_poses.png", "geometry.png", "animation.gif", "motion.npz", "verdict.json")
    poses, geometry, animation, motion, verdict = files = tuple(folder / name for name in names)
    draw_poses(maze, episode, poses)
    draw_geometry(maze, None, geometry)
    animate(maze, episode, animation, progress)
    result.motion.save(motion)
    demo = Demo(maze=maze, arm=arm, result=result, episode=episode, files=files)
    with replacing(verdict) as part:
        part.write_text(json.dumps(demo.to_dict(), indent=1) + "\n", encoding="utf-8")
    return demo
