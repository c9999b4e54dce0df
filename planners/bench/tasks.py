"""The tasks of the studies: mazes and arms that every method is given alike."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Any

import numpy as np

from hrsnake_env.geodesic import GeodesicDistance
from hrsnake_env.ladder import LADDER, RODS, rung_maze
from hrsnake_env.maze import RUNG_MAZES, Maze
from hrsnake_env.random_mazes import (
    EASIEST,
    LINK_LENGTH,
    N_LINKS,
    N_TASKS,
    TIGHTEST,
    index_of_difficulty,
    random_maze,
    task_maze,
)
from hrsnake_env.registration import ENVIRONMENTS, LONG_ARM, LONG_DIFFICULTY, STEPS_PER_LINK
from planners.rod_bound import rod_bound

__all__ = [
    "ENV_ID",
    "Problem",
    "Task",
    "clutter_task",
    "fewest_links",
    "held_out_task",
    "known_maze",
    "leg_task",
    "random_task",
    "rung_task",
    "scan_task",
    "shape_task",
]

ENV_ID = "HyperRedundantMaze-v0"

ROD_ACCURACY = 0.01
"""Of the longest rod of halls, whose upper bound is taken: their index is rather too small than too large."""

SHAPE_LINKS = {"bend": 5, "u-turn": 5, "s-bend": 6}
"""Links with which learners are trained in short mazes; enough from the index 0.3 on."""

TURN_LINKS = 0.7
"""About what the turn takes beyond the legs: loose links cut its corners, tight ones zigzag in it."""

LEG_LINKS = 3.5
"""Both legs of a short U-turn together, in links."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Problem:
    """Hold a maze, a link length for it, and the longest rod that passes (infinite without a turn)."""

    maze: Maze
    link_length: float
    longest_rod: float

    @property
    def index(self) -> float:
        """Link length over the longest rod: the paper's I; 0 without a turn."""
        return self.link_length / self.longest_rod


@dataclass(frozen=True, eq=False, kw_only=True)
class Task:
    """Describe a task, or a family of tasks that differ in their maze.

    Parameters
    ----------
    name : str
        Unique in its study.
    shape : str
        What its mazes have in common.
    problem : functools.partial
        Of a module's function: given the number of the maze, returns the `Problem`. Its arguments are plain.
    n_mazes : int
        Of the family; 1 for a single task.
    n_links : int, optional
        The fewest links that are known to reach the goal; by default an estimate.
    simulate : bool
        Whether motions are also driven through the environment.
    scan : bool
        Whether the problem is a function of the index, which is to be scanned, and not of the maze's number.
    env_id : str, optional
        The environment in which methods that learn are trained and tested; None if they are not.
    test_id : str, optional
        Another environment, in which they are tested.
    env_kwargs : mapping
        Further arguments of both, plain; `maze` names the maze of `problem` (`known_maze`).
    """

    name: str
    shape: str
    problem: Callable[..., Problem]
    n_mazes: int = 1
    n_links: int | None = None
    simulate: bool = False
    scan: bool = False
    env_id: str | None = None
    test_id: str | None = None
    env_kwargs: Mapping[str, Any] = field(default_factory=dict)

    @property
    def definition(self) -> str:
        """Return a text that is the same in every process, and another for another task."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        made = values.pop("problem")
        values["problem"] = (made.func.__qualname__, made.args, sorted(made.keywords.items()))
        values["env_kwargs"] = sorted(values["env_kwargs"].items())
        return repr(sorted(values.items()))


def fewest_links(task: Task, problem: Problem) -> int:
    """Return the fewest links that are known to reach the goal, or what the shortest way takes."""
    if task.n_links is not None:
        return task.n_links
    way = float(GeodesicDistance(problem.maze)(problem.maze.base_pose[:2]))
    return max(1, math.ceil(way / problem.link_length))


def known_maze(task: Task) -> None:
    """Have `Maze.load` know the maze that the task's environment names, in this process."""
    name = task.env_kwargs.get("maze")
    if name is not None:
        RUNG_MAZES.setdefault(name, lambda: task.problem(0).maze)


# The ladder


def rung_task(name: str) -> Task:
    """Return a rung of the ladder as a task."""
    rung = LADDER[name]
    return Task(
        name=name,
        shape=name.partition("-i")[0],
        problem=partial(_rung, name, rung.link_length, rung.longest_rod),
        n_links=rung.n_links,
        simulate=True,
        env_id=_env_id(name),
    )


def held_out_task(kind: str, n_mazes: int) -> Task:
    """Return the first tasks of the held-out random mazes: kind `random`, or `random-long` with 30 links."""
    n_links, difficulty = (LONG_ARM, LONG_DIFFICULTY) if kind == "random-long" else (N_LINKS, (0.0, 1.0))
    name = "RandomLong" if kind == "random-long" else "Random"
    return Task(
        name=kind,
        shape=kind,
        problem=partial(_held_out, n_links, difficulty),
        n_mazes=n_mazes,
        n_links=n_links,
        simulate=True,
        env_id=f"HyperRedundantMaze-{name}Train-v0",
        test_id=f"HyperRedundantMaze-{name}Test-v0",
    )


def _rung(name: str, link_length: float, longest_rod: float, number: int) -> Problem:
    return Problem(maze=Maze.load(name), link_length=link_length, longest_rod=longest_rod)


def _held_out(n_links: int, difficulty: tuple[float, float], number: int) -> Problem:
    maze = task_maze("test", number, difficulty=difficulty, n_links=n_links)
    # The first draw of a task is its difficulty.
    drawn = np.random.default_rng([list(N_TASKS).index("test"), number]).uniform(*difficulty)
    return Problem(
        maze=maze, link_length=LINK_LENGTH, longest_rod=LINK_LENGTH / index_of_difficulty(float(drawn))
    )


def _env_id(maze: str) -> str | None:
    """Return the environment of a rung, with dense rewards."""
    for name, task in ENVIRONMENTS.items():
        if task["kwargs"].get("maze") == maze and task["kwargs"].get("reward_type") == "dense":
            return name
    return None


# Shapes at any index


def shape_task(shape: str, index: float, *, learnt: bool = False) -> Task:
    """Return a short maze of a shape of the ladder at an index; its legs grow with the link.

    With `learnt`, also for methods that learn; from the index 0.3 on, as below `SHAPE_LINKS` do not reach.
    """
    length, maze, n_links = index * RODS[shape], f"{shape} at {index:g}", SHAPE_LINKS[shape]
    arguments = {"maze": maze, "link_length": length, "n_links": n_links}
    return Task(
        name=_task_name(shape, index),
        shape=shape,
        problem=partial(_grown, shape, maze, length, None),
        n_links=n_links if learnt else None,
        simulate=True,
        env_id=ENV_ID if learnt else None,
        env_kwargs={**arguments, "max_episode_steps": STEPS_PER_LINK * n_links} if learnt else {},
    )


def leg_task(n_links: int, index: float) -> Task:
    """Return a U-turn at an index whose legs are so long that it takes about so many links."""
    length = index * RODS["u-turn"]
    longer = max(1.0, (n_links - TURN_LINKS) / LEG_LINKS)
    name = f"{_task_name('u-turn', index)}-n{n_links}"
    return Task(name=name, shape="u-turn", problem=partial(_grown, "u-turn", name, length, longer))


def _task_name(shape: str, index: float) -> str:
    return f"{shape}-i{round(100.0 * index):02d}"


def _grown(shape: str, name: str, link_length: float, longer: float | None, number: int) -> Problem:
    maze = rung_maze(shape, link_length, name=name, longer=longer)
    return Problem(maze=maze, link_length=link_length, longest_rod=RODS[shape])


def random_task(index: float, n_mazes: int) -> Task:
    """Return random mazes whose tightest bend has an index, from 0.3 to 0.9."""
    difficulty = (index - EASIEST) / (TIGHTEST - EASIEST)
    return Task(
        name=_task_name("random", index),
        shape="random",
        problem=partial(_random, index, min(max(difficulty, 0.0), 1.0)),
        n_mazes=n_mazes,
        n_links=N_LINKS,
        simulate=True,
    )


def _random(index: float, difficulty: float, number: int) -> Problem:
    maze = random_maze(
        np.random.default_rng([len(N_TASKS), number]), difficulty=difficulty, name=f"random {number}"
    )
    return Problem(maze=maze, link_length=LINK_LENGTH, longest_rod=LINK_LENGTH / index)


def clutter_task(index: float, n_mazes: int) -> Task:
    """Return halls full of pillars, each with links at an index of its own longest rod."""
    return Task(
        name=_task_name("clutter", index),
        shape="clutter",
        problem=partial(_clutter, index),
        n_mazes=n_mazes,
        simulate=True,
    )


def _clutter(index: float, number: int) -> Problem:
    longest_rod = _hall_rod(number)
    return Problem(
        maze=Maze.load(f"clutter-{number}"), link_length=index * longest_rod, longest_rod=longest_rod
    )


@functools.cache
def _hall_rod(number: int) -> float:
    return float(rod_bound(Maze.load(f"clutter-{number}"), accuracy=ROD_ACCURACY).upper)


# Scans of the index


def scan_task(maze: str, longest_rod: float) -> Task:
    """Return a named maze in which link lengths are scanned."""
    return Task(name=maze, shape=maze, problem=partial(_scanned, maze, longest_rod), scan=True)


def _scanned(maze: str, longest_rod: float, index: float) -> Problem:
    return Problem(maze=Maze.load(maze), link_length=index * longest_rod, longest_rod=longest_rod)
