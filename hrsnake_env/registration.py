"""The environments' ids: one table, from the ladder of tasks and the random mazes."""

from __future__ import annotations

from typing import Any

import gymnasium

from hrsnake_env.ladder import LADDER, Rung
from hrsnake_env.random_mazes import N_LINKS, N_TASKS

__all__ = ["ENVIRONMENTS", "register_environments"]

ENTRY_POINT = "hrsnake_env.env:HyperRedundantMazeEnv"

STEPS_PER_LINK = 200
"""Time limit of a task. Feeding one link takes 50 steps, planned motions at most twice that."""

LONG_ARM, LONG_DIFFICULTY = 30, (0.7, 1.0)
"""Links and difficulties of the long random mazes, which have ten bends and more."""


def _task_name(maze: str) -> str:
    """Return the part of an id that names a maze.

    Examples
    --------
    >>> _task_name("u-turn-i50")
    'UTurn-I50'
    """
    shape, _, index = maze.partition("-i")
    name = "".join(part[:1].upper() + part[1:] for part in shape.split("-"))
    return f"{name}-I{index}" if index else name


def _rung(rung: Rung) -> dict[str, Any]:
    return {
        "max_episode_steps": STEPS_PER_LINK * rung.n_links,
        "kwargs": {"maze": rung.maze, "link_length": rung.link_length, "n_links": rung.n_links},
    }


def _random(split: str) -> dict[str, Any]:
    return {
        "max_episode_steps": STEPS_PER_LINK * N_LINKS,
        "kwargs": {"maze": "random", "split": split},
    }


def _random_long(split: str) -> dict[str, Any]:
    return {
        "max_episode_steps": STEPS_PER_LINK * LONG_ARM,
        "kwargs": {"maze": "random", "split": split, "n_links": LONG_ARM, "difficulty": LONG_DIFFICULTY},
    }


def _environments() -> dict[str, dict[str, Any]]:
    tasks = {_task_name(rung.maze): _rung(rung) for rung in LADDER.values()}
    tasks |= {f"Random{split.capitalize()}": _random(split) for split in N_TASKS}
    tasks |= {f"RandomLong{split.capitalize()}": _random_long(split) for split in N_TASKS}
    table: dict[str, dict[str, Any]] = {"HyperRedundantMaze-v0": {"max_episode_steps": 10_000, "kwargs": {}}}
    for name, task in tasks.items():
        for suffix, reward_type in (("", "dense"), ("-Sparse", "sparse")):
            arguments = {**task["kwargs"], "reward_type": reward_type}
            table[f"HyperRedundantMaze-{name}{suffix}-v0"] = {**task, "kwargs": arguments}
    return table


ENVIRONMENTS = _environments()
"""Every environment: id, and the time limit and keyword arguments that it is registered with."""


def register_environments() -> None:
    """Register all ids with Gymnasium; those that are registered already stay as they are."""
    for name, task in ENVIRONMENTS.items():
        if name not in gymnasium.registry:  # imported twice, as worker processes may do
            gymnasium.register(id=name, entry_point=ENTRY_POINT, **task)
