"""Which maze an episode has, and what is computed for a maze once."""

from __future__ import annotations

import dataclasses
import math
import os
from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.arguments import check_one_of
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.geodesic import GeodesicDistance
from hrsnake_env.maze import Maze
from hrsnake_env.options import ResetOptions
from hrsnake_env.physics import Physics
from hrsnake_env.random_mazes import LINK_LENGTH, N_LINKS, N_TASKS, checked_difficulty, task_maze

__all__ = ["NO_TASK", "Scene", "Scenes"]

N_KEPT = 8
"""So many mazes are kept ready."""

MOST_LINKS = 1000
"""So many links an arm gets by default at most."""

N_TRIES = 100
"""So many random mazes are drawn until one fits the arm: thick links may not fit its entry."""

NO_TASK = -1


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Hold a maze and what is computed for it once.

    Parameters
    ----------
    maze : Maze
        With the goal of the episode.
    distance : GeodesicDistance
        To that goal.
    way : float
        That distance from the base.
    physics : Physics
        The arm among the maze's walls.
    """

    maze: Maze
    distance: GeodesicDistance
    way: float
    physics: Physics


class Scenes:
    """Choose the maze of each episode, and keep the last ones ready.

    Parameters
    ----------
    maze : Maze, str or path
        A maze, the name of one, or a maze file; "random" for a new one every time.
    link_length, n_links, link_radius, joint_limit
        The arm; see `HyperRedundantMazeEnv` for what None means.
    goal_radius : float, optional
        Instead of the mazes' own.
    split : str, optional
        Which random mazes.
    difficulty : tuple of two floats, optional
        Of random mazes.
    physics : dict
        More arguments of `Physics`.

    Attributes
    ----------
    arm : ArmSpec
        The arm, complete.
    random : bool
        Whether mazes are random.
    first : Scene
        Of the first maze.
    world : dict
        What besides the arm and the maze an episode depends on.
    """

    def __init__(
        self,
        maze: Maze | str | os.PathLike[str],
        *,
        link_length: float | None,
        n_links: int | None,
        link_radius: float,
        joint_limit: float | None,
        goal_radius: float | None,
        split: str | None,
        difficulty: tuple[float, float] | None,
        physics: dict[str, Any],
    ) -> None:
        self.random = isinstance(maze, str) and maze == "random"
        for what, value in (("split", split), ("difficulty", difficulty)):
            if value is not None and not self.random:
                raise InputError(f"Expected no {what} but with maze='random', got {value!r}.")
        split = "train" if split is None else split
        check_one_of("split", split, tuple(N_TASKS))
        difficulty = checked_difficulty((0.0, 1.0) if difficulty is None else difficulty)
        self._goal_radius, self._split, self._physics = goal_radius, split, physics
        self.world = {"goal_radius": goal_radius, **physics}
        self._named: dict[str, Maze] = {}
        if self.random:
            link_length = LINK_LENGTH if link_length is None else link_length
            n_links = N_LINKS if n_links is None else n_links
            self._task: dict[str, Any] = {
                "difficulty": difficulty,
                "link_length": link_length,
                "n_links": n_links,
            }
            maze = task_maze(split, 0, **self._task)
        self._own = self._with_goal(self._loaded(maze), None)
        distance = GeodesicDistance(self._own)
        if link_length is None:
            link_length = 1.5 * _mean_width(self._own)
        arm = ArmSpec(
            link_length=link_length, n_links=n_links, link_radius=link_radius, joint_limit=joint_limit
        )
        self._own.check_arm(arm)
        if n_links is None:
            # A link more than a way 10 % longer takes: links cut corners less well than a string.
            n_links = math.ceil(1.1 * distance(self._own.base_pose[:2]) / link_length) + 1
            if n_links > MOST_LINKS:
                raise InputError(
                    f"Expected a link_length with which {MOST_LINKS} links reach the goal, or n_links, got "
                    f"{link_length:g} {self._own.units}, which takes {n_links}."
                )
        self.arm = dataclasses.replace(arm, n_links=n_links)
        self._kept: OrderedDict[Maze, Scene] = OrderedDict()
        self.first = self.of(self._own, distance)

    def choose(self, wanted: ResetOptions, rng: np.random.Generator) -> tuple[Scene, int]:
        """Return the scene of a new episode, and the number of its random maze (or `NO_TASK`).

        Raises
        ------
        InputError
            If the wanted maze does not fit the arm, or a task is wanted where mazes are not random.
        """
        if wanted.task_id is not None and not self.random:
            raise InputError("Expected maze='random' for the reset option 'task_id', got another maze.")
        if wanted.maze is not None:
            return self.of(self._with_goal(self._loaded(wanted.maze), wanted.goal)), NO_TASK
        if not self.random:
            return self.of(
                self._own if wanted.goal is None else self._with_goal(self._own, wanted.goal)
            ), NO_TASK
        if wanted.task_id is not None:
            return self._task_scene(wanted.task_id, wanted.goal), wanted.task_id
        refusal = InputError("")
        for _ in range(N_TRIES if wanted.goal is None else 1):
            task_id = int(rng.integers(N_TASKS[self._split]))
            try:
                return self._task_scene(task_id, wanted.goal), task_id
            except InputError as error:
                refusal = error
        raise refusal

    def _task_scene(self, task_id: int, goal: FloatArray | None) -> Scene:
        return self.of(self._with_goal(task_maze(self._split, task_id, **self._task), goal))

    def of(self, maze: Maze, distance: GeodesicDistance | None = None) -> Scene:
        """Return the scene of a maze, whose walls and distances are computed when it is new."""
        scene = self._kept.get(maze)
        if scene is None:
            maze.check_arm(self.arm)
            distance = distance or GeodesicDistance(maze)
            scene = Scene(
                maze=maze,
                distance=distance,
                way=distance(maze.base_pose[:2]),
                physics=Physics(maze, self.arm, **self._physics),
            )
            self._kept[maze] = scene
            if len(self._kept) > N_KEPT:
                self._kept.popitem(last=False)
        self._kept.move_to_end(maze)
        return scene

    def _loaded(self, maze: Maze | str | os.PathLike[str]) -> Maze:
        if isinstance(maze, Maze):
            return maze
        try:
            name = os.fspath(maze)
        except TypeError:
            raise InputError(f"Expected a Maze, the name of one, or a file, got {maze!r}.") from None
        if name not in self._named:
            self._named[name] = Maze.load(name)
        return self._named[name]

    def _with_goal(self, maze: Maze, goal: FloatArray | None) -> Maze:
        """Return a maze with the goal, and the radius, that are asked for."""
        changes: dict[str, Any] = {} if goal is None else {"goal": goal}
        if self._goal_radius is not None and self._goal_radius != maze.goal_radius:
            changes["goal_radius"] = self._goal_radius
        return dataclasses.replace(maze, **changes) if changes else maze


def _mean_width(maze: Maze) -> float:
    """Return the width of the corridor that has the maze's area and length of walls."""
    return float(2.0 * maze.free_space.area / maze.free_space.length)
