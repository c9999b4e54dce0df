"""Random mazes for a given arm, whose tightness and number of bends grow with a difficulty; tasks by number.

A maze is a corridor of straight legs whose widths differ, at times with U-turns, at times with a small hall
of pillars at its end. Its tightest bend has just the index that the difficulty says. Mazes are drawn without
asking a planner. Lengths are in links until the maze is built.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from shapely.geometry import Polygon

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.bends import MIXED, Bend, Corridor, draw_bends
from hrsnake_env.errors import InputError
from hrsnake_env.maze import SEEDED_MAZES, Maze

__all__ = [
    "LINK_LENGTH",
    "N_LINKS",
    "N_TASKS",
    "checked_difficulty",
    "draw_train_maze",
    "index_of_difficulty",
    "random_maze",
    "task_maze",
]

LINK_LENGTH, N_LINKS = 100.0, 12
"""The arm of the tasks by default, and of the tasks that `Maze.load` gives."""

N_TASKS = {"train": 2**32, "test": 1000}
"""Number of tasks of each split; their seeds are disjoint."""

EASIEST, TIGHTEST = 0.3, 0.9
"""Index of the tightest bend at difficulty 0 and 1."""

HALLS = 0.25
"""How often a maze ends in a hall, at difficulties over `MIXED`."""

BASE, BEHIND = 0.05, 0.3
"""From the corridor's start to the base, and from the goal to its end."""

ENTRY, EXIT = 1.6, 1.1
"""Least straight way from the base to the first bend, and from the last bend to the goal. A tight first bend
that is closer is closed: one link is in it while the next one cannot leave the feeder's axis."""

GOAL_RADIUS = 0.15

MOUTH, AISLE, PILLARS = 0.3, 0.35, 12
"""Straight way from the last bend to a hall; least width between its pillars and walls, for an index of 1;
how often a pillar is drawn, and left out where it finds no place."""

ALTERNATING = 2.2
"""Bends to opposite sides can both be as tight as a rod allows if they are this many links apart: a link has
then left the first when it enters the second."""

LOOSE = 0.5
"""Bends up to this index need not be apart for that."""

LONGER = 1.05
"""An arm is this much longer than its way, since links zigzag in bends; and one link may stay outside."""

ROUND = math.radians(200.0)
"""Bends do not turn the corridor farther from its first heading, except by a U-turn: it would meet itself."""

PER_BEND = 1.4
"""About the shortest way that a bend takes, in links."""

DRAWS, SIDES = 8, 6
"""How often a corridor is drawn before it gets one bend less, and how often the sides of its bends."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Hall:
    """Hold the hall in which a corridor ends; x points along the last leg from its end, y to the left.

    Parameters
    ----------
    length, width : float
        The hall lies at x from 0 to length and y from -width / 2 to width / 2.
    goal : array, shape (2,)
        The goal.
    pillars : list of arrays, shape (n_corners, 2)
        Convex, apart from one another and from the walls.
    """

    length: float
    width: float
    goal: FloatArray
    pillars: list[FloatArray]


def index_of_difficulty(difficulty: float) -> float:
    """Return the index of the tightest bend: link length over the longest rod that passes it.

    Raises
    ------
    InputError
        If the difficulty is not in [0, 1].

    Examples
    --------
    >>> index_of_difficulty(0.5)
    0.6
    """
    if not 0.0 <= difficulty <= 1.0:
        raise InputError(f"Expected a difficulty from 0 to 1, got {difficulty!r}.")
    return (1.0 - difficulty) * EASIEST + difficulty * TIGHTEST


def random_maze(
    seed: int | np.random.SeedSequence | np.random.Generator,
    *,
    difficulty: float,
    link_length: float = LINK_LENGTH,
    n_links: int = N_LINKS,
    name: str = "random",
) -> Maze:
    """Draw a maze for an arm; the same arguments give the same maze.

    Parameters
    ----------
    seed : int, SeedSequence or Generator
        Where the draws come from.
    difficulty : float
        In [0, 1]. At 0 there is one gentle bend of index 0.3; at 1 the tightest bend has the index 0.9, the
        others hardly less, and there are about as many as the arm's length allows.
    link_length : float
        In maze units. The maze has the same shape for any.
    n_links : int
        At least 5. The arm is at least one link longer than 1.05 times its way to the goal.
    name : str
        Of the maze.

    Raises
    ------
    InputError
        If the difficulty is not in [0, 1], or the arm is too short for one bend.

    Examples
    --------
    >>> random_maze(7, difficulty=1.0).free_space.equals(random_maze(7, difficulty=1.0).free_space)
    True
    """
    arm, index = ArmSpec(link_length=link_length, n_links=n_links), index_of_difficulty(difficulty)
    rng, longest = np.random.default_rng(seed), (n_links - 1) / LONGER
    hall_wanted = bool(difficulty > MIXED and rng.random() < HALLS)
    most = max(int((longest - ENTRY - EXIT) / PER_BEND) - hall_wanted, 1)
    wanted = 1 + round(difficulty * (most - 1))
    for n_bends, with_hall in [*((k, hall_wanted) for k in range(wanted, 0, -1)), (1, False)]:
        for _ in range(DRAWS if n_bends > 1 else 25 * DRAWS):
            bends = draw_bends(rng, n_bends, index, difficulty)
            hall = _draw_hall(rng, index) if with_hall else None
            slack = rng.uniform(0.05, 0.85 - 0.4 * difficulty, n_bends + 1)
            for sides in _draw_sides(rng, bends):
                lengths = _lengths(bends, sides, slack, with_hall)
                if _way(lengths, hall) > longest:
                    continue
                corridor = Corridor.from_bends(bends, sides, lengths)
                if corridor.keeps_apart(n_links, None if hall is None else _outline(corridor, hall)):
                    return _maze(corridor, hall, arm.link_length, name)
    raise InputError(f"Expected more links for a maze of difficulty {difficulty:g}, got n_links={n_links}.")


def checked_difficulty(difficulty: Any) -> tuple[float, float]:
    """Return a range of difficulties.

    Raises
    ------
    InputError
        If it is none.
    """
    ends = tuple(difficulty) if isinstance(difficulty, Sequence | np.ndarray) else ()
    if len(ends) != 2 or not all(map(is_number, ends)) or not 0.0 <= ends[0] <= ends[1] <= 1.0:
        raise InputError(f"Expected a range of difficulties in [0, 1], got {difficulty!r}.")
    return float(ends[0]), float(ends[1])


def task_maze(
    split: str,
    task_id: int,
    *,
    difficulty: tuple[float, float] = (0.0, 1.0),
    link_length: float = LINK_LENGTH,
    n_links: int = N_LINKS,
) -> Maze:
    """Return the maze of a task, whose difficulty is drawn from a range by the task's own seed.

    It bears the task's name; under that name `Maze.load` gives the maze for the default arm and range.

    Parameters
    ----------
    split : str
        `train` or `test`.
    task_id : int
        From 0 up to `N_TASKS` of the split.
    difficulty : (float, float)
        Least and largest difficulty, in [0, 1].
    link_length, n_links
        As for `random_maze`.

    Raises
    ------
    InputError
        If there is no such task, or the range is not one.

    Examples
    --------
    >>> task_maze("test", 17).name
    'random-test-17'
    """
    if split not in N_TASKS:
        raise InputError(f"Unknown split {split!r}. Available: {', '.join(N_TASKS)}.")
    if not (isinstance(task_id, int | np.integer) and 0 <= task_id < N_TASKS[split]):
        raise InputError(
            f"Expected a whole task_id from 0 to {N_TASKS[split] - 1} of split '{split}', got {task_id!r}."
        )
    low, high = checked_difficulty(difficulty)
    rng = np.random.default_rng([list(N_TASKS).index(split), task_id])
    return random_maze(
        rng,
        difficulty=rng.uniform(low, high),
        link_length=link_length,
        n_links=n_links,
        name=f"random-{split}-{task_id}",
    )


def draw_train_maze(
    rng: np.random.Generator,
    *,
    difficulty: tuple[float, float] = (0.0, 1.0),
    link_length: float = LINK_LENGTH,
    n_links: int = N_LINKS,
) -> Maze:
    """Draw one of the train tasks, as `task_maze` gives it."""
    task_id = int(rng.integers(N_TASKS["train"]))
    return task_maze("train", task_id, difficulty=difficulty, link_length=link_length, n_links=n_links)


# How a maze is drawn


def _draw_sides(rng: np.random.Generator, bends: list[Bend]) -> Iterator[FloatArray]:
    """Yield to which side each bend turns: 1 to the left, -1 to the right."""
    for _ in range(SIDES if bends else 0):
        sides, heading = rng.choice([-1.0, 1.0], len(bends)), 0.0
        for k, bend in enumerate(bends):
            if bend.wall is not None:
                sides[k] = sides[k - 1]
            elif abs(heading + sides[k] * bend.turn) > ROUND:
                sides[k] *= -1.0
            heading += sides[k] * bend.turn
        yield sides


def _lengths(bends: list[Bend], sides: FloatArray, slack: FloatArray, with_hall: bool) -> FloatArray:
    """Return the length of each leg between the centreline's corners, in links."""
    between = [BASE + ENTRY + slack[0]]
    for k in range(1, len(bends)):
        wall, alternating = bends[k].wall, bool(sides[k - 1] != sides[k])
        between.append(wall or _apart(bends[k - 1], bends[k], alternating) + slack[k])
    between.append(MOUTH if with_hall else EXIT + slack[-1] + BEHIND)
    before = [*(bend.setbacks[0] for bend in bends), 0.0]
    behind = [0.0, *(bend.setbacks[1] for bend in bends)]
    return np.add(between, before) + behind


def _apart(first: Bend, second: Bend, alternating: bool) -> float:
    """Return how far apart the inner corners of two bends must be for each to be as tight as it is alone."""
    room, next_room = first.rooms[1], second.rooms[0]
    if not alternating:
        return room + next_room
    tight = (min(first.index, second.index) - LOOSE) / (TIGHTEST - LOOSE)
    return max(room, next_room, ALTERNATING * tight)


def _way(lengths: FloatArray, hall: Hall | None) -> float:
    """Return the length of the centreline to the goal, in links, with a detour around the hall's pillars."""
    return float(lengths.sum()) + (-BEHIND if hall is None else 1.2 * float(np.linalg.norm(hall.goal)))


def _draw_hall(rng: np.random.Generator, index: float) -> Hall:
    """Draw a hall between whose pillars a rod has more room than in the bends."""
    gap = AISLE / index
    length, width = gap * rng.uniform((3.0, 2.0), (4.0, 3.0)) + rng.uniform(0.5, 0.9, 2)
    across = 0.5 * width - 2.0 * GOAL_RADIUS
    goal = np.array([length - 2.0 * GOAL_RADIUS, rng.uniform(-across, across)])
    pillars: list[FloatArray] = []
    kept = [(goal, 2.0 * GOAL_RADIUS - gap)]
    for _ in range(PILLARS):
        radius = rng.uniform(0.12, 0.35)
        reach = np.array([length, width]) - 2.0 * (gap + radius)
        place = np.array([0.5 * length, 0.0]) + rng.uniform(-0.5, 0.5, 2) * np.maximum(reach, 0.0)
        n = int(rng.integers(4, 9))
        angles = (np.arange(n) + rng.uniform(-0.3, 0.3, n) + rng.random()) * (2.0 * math.pi / n)
        clear = all(np.linalg.norm(place - other) >= radius + size + gap for other, size in kept)
        if clear and (reach >= 0.0).all():
            kept.append((place, radius))
            pillars.append(place + radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return Hall(length=length, width=width, goal=goal, pillars=pillars)


def _outline(corridor: Corridor, hall: Hall) -> FloatArray:
    """Return the corners of a hall, shape (4, 2), from near on the left to near on the right."""
    x, y = hall.length, 0.5 * hall.width
    return corridor.beyond([(0.0, y), (x, y), (x, -y), (0.0, -y)])


def _maze(corridor: Corridor, hall: Hall | None, link_length: float, name: str) -> Maze:
    goal = corridor.beyond([(-BEHIND, 0.0)] if hall is None else [hall.goal])[0]
    outline = np.empty((0, 2)) if hall is None else _outline(corridor, hall)
    walls = np.concatenate([corridor.left, outline, corridor.right[::-1]])
    pillars = [] if hall is None else [corridor.beyond(pillar) for pillar in hall.pillars]

    def scaled(points: FloatArray) -> FloatArray:
        """Return points in maze units; rounded, so that they do not depend on how sines are computed."""
        return link_length * np.round(points, 9)

    return Maze(
        name=name,
        free_space=Polygon(scaled(walls), [scaled(pillar) for pillar in pillars]),
        base_pose=np.array([0.0, link_length * BASE, math.pi / 2]),
        goal=scaled(goal),
        goal_radius=link_length * GOAL_RADIUS,
    )


for _split in N_TASKS:
    SEEDED_MAZES[f"random-{_split}"] = partial(task_maze, _split)
