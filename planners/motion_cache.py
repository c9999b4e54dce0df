"""Motions for the mazes that an environment comes to, planned once."""

from __future__ import annotations

import dataclasses
from collections import OrderedDict

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.planning import PLANNERS, plan
from planners.problem import Motion

__all__ = ["MARGINS", "N_MAZES", "MotionCache", "maze_key"]

MARGINS = (0.1, 0.05, 0.02, 0.01, 0.0)
"""Distances to the walls that are asked of a motion to learn from, in link lengths; the first with a plan is
taken.

Motions planned without one touch the walls: who imitates them with the least error collides, and so does who
tries something else from one of their poses.
"""

N_MAZES = 100
"""For so many mazes motions are kept."""


class MotionCache:
    """Plan through mazes, and keep the motions for those that come again.

    Parameters
    ----------
    planner : str
        See `planners.plan`.
    margins : tuple of float
        Distances to the walls, in link lengths, that a motion shall keep; the first with a plan is taken.

    Raises
    ------
    InputError
        If the planner is unknown.
    """

    def __init__(self, planner: str = "auto", margins: tuple[float, ...] = (0.0,)) -> None:
        if planner != "auto" and planner not in PLANNERS:
            raise InputError(f"Unknown planner {planner!r}. Available: auto, {', '.join(PLANNERS)}.")
        self.planner, self.margins = planner, margins
        self._motions: OrderedDict[bytes, Motion | None] = OrderedDict()

    def motion(self, maze: Maze, arm: ArmSpec) -> Motion | None:
        """Return a motion of all the arm's links; None if there is no plan, or it takes more links."""
        key = maze_key(maze)
        if key not in self._motions:
            self._keep(key, self._planned(maze, arm))
        self._motions.move_to_end(key)
        return self._motions[key]

    def add(self, motion: Motion, maze: Maze, arm: ArmSpec) -> None:
        """Keep a motion that is there already.

        Raises
        ------
        InputError
            If it is of another arm, or from another base.
        """
        motion.check_maze(maze)
        if not np.isclose(motion.link_length, arm.link_length, rtol=1e-9):
            raise InputError(
                f"Expected a motion of links of {arm.link_length:g} {maze.units}, got one of links of "
                f"{motion.link_length:g}."
            )
        motion = motion.with_links(int(arm.n_links or motion.n_links)).of_arm(arm)
        self._keep(maze_key(maze), motion)

    def _planned(self, maze: Maze, arm: ArmSpec) -> Motion | None:
        for margin in self.margins:
            thicker = dataclasses.replace(arm, link_radius=arm.link_radius + margin * arm.link_length)
            try:
                motion = plan(maze, thicker, planner=self.planner, explain=False).motion
            except InputError:  # links too thick for the feeder, or too few for the motions that were found
                continue
            if motion is not None:
                return motion.of_arm(arm)
        return None

    def _keep(self, key: bytes, motion: Motion | None) -> None:
        self._motions[key] = motion
        if len(self._motions) > N_MAZES:
            self._motions.popitem(last=False)


def maze_key(maze: Maze) -> bytes:
    """Return what two mazes have in common just if the same motions solve them."""
    return bytes(maze.free_space.wkb) + np.array([*maze.base_pose, *maze.goal, maze.goal_radius]).tobytes()
