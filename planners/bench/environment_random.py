"""Random policies in every maze: what they run into, and that nothing breaks."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from hrsnake_env.actuation import ACTUATIONS
from hrsnake_env.arm import FloatArray
from hrsnake_env.ladder import LADDER
from hrsnake_env.maze import MAZES
from planners.bench.environment_scenes import ENV_ID
from planners.bench.pool import resumed

__all__ = ["EVERY_MAZE", "random_policies", "random_steps", "random_tasks", "summed_up"]

EVERY_MAZE = tuple(dict.fromkeys([*LADDER, *MAZES, "random"]))
"""The ladder's, the named ones, and new random ones."""

EPISODE = 1000
"""Time limit, in steps."""

COUNTS = ("steps", "episodes", "pinched", "collided", "jams", "successes", "not_finite")
WORST = ("worst_depth", "worst_impulse", "worst_drift")


def random_tasks(
    steps: int, mazes: Sequence[str] = EVERY_MAZE, seed: int = 0
) -> list[tuple[str, bool, str, int, int]]:
    """List what is run: maze, `terminate_on_collision`, actuation, steps and seed; so many steps in all."""
    cases = list(itertools.product(mazes, (True, False), ACTUATIONS))
    share = -(-steps // len(cases))
    return [(*case, share, seed) for case in cases]


def random_policies(
    tasks: Sequence[tuple[str, bool, str, int, int]], rows: Path, workers: int | None = None
) -> list[dict[str, Any]]:
    """Run the tasks that are not in the file of lines yet, and return the rows of all that are done."""
    return resumed(rows, random_steps, tasks, _warm_up, workers)


def _warm_up() -> None:
    random_steps("straight", False, "computed_torque", 1, 0)


def random_steps(maze: str, terminates: bool, actuation: str, steps: int, seed: int) -> dict[str, Any]:
    """Take random steps in a maze; count what happens.

    In every episode the policy is one of three: a new action in each step; one that is held; one that is held
    and feeds.

    Parameters
    ----------
    maze : str
        One of `EVERY_MAZE`.
    terminates : bool
        Whether a collision ends the episode.
    actuation : str
        As the environment has it.
    steps : int
        So many.
    seed : int
        Of everything.

    Returns
    -------
    row : dict
        With counts of `steps` and `episodes`, of steps in which something `pinched` or `collided`, of `jams`
        and `successes` at the end of episodes, and of steps with a number that is `not_finite`; the worst
        depth and drift in link lengths, and impulse; and the `exception` that ended the run, if one did.
    """
    task = [maze, terminates, actuation, steps, seed]
    row: dict[str, Any] = {"task": task, **dict.fromkeys(COUNTS, 0), **dict.fromkeys(WORST, 0.0)}
    try:
        _walk(row, maze, terminates, actuation, steps, seed)
    except Exception as error:  # what breaks is what is looked for
        row["exception"] = f"{type(error).__name__}: {error}"
    return row


def _walk(row: dict[str, Any], maze: str, terminates: bool, actuation: str, steps: int, seed: int) -> None:
    rung = LADDER.get(maze)
    arm: dict[str, Any] = {} if rung is None else {"link_length": rung.link_length, "n_links": rung.n_links}
    env = gym.make(
        ENV_ID,
        max_episode_steps=EPISODE,
        maze=maze,
        actuation=actuation,
        terminate_on_collision=terminates,
        **arm,
    )
    rng = np.random.default_rng(seed)
    length = env.unwrapped.arm.link_length  # type: ignore[attr-defined]
    observation, _ = env.reset(seed=seed)
    actions = _actions(rng, len(env.action_space.sample()))
    while row["steps"] < steps:
        observation, reward, terminated, truncated, info = env.step(next(actions))
        row["steps"] += 1
        row["pinched"] += info["pinches"] > 0
        row["collided"] += info["collisions"] > 0
        finite = np.isfinite(observation).all() and np.isfinite(float(reward))
        row["not_finite"] += not (finite and np.isfinite(info["drift"]) and np.isfinite(info["depth"]))
        row["worst_drift"] = max(row["worst_drift"], info["drift"] / length)
        if terminated or truncated:
            _end(row, info, length, jammed=_is_jam(info, terminated, terminates))
            env.reset()
            actions = _actions(rng, len(env.action_space.sample()))
    _end(row, info, length, jammed=False)


def _is_jam(info: Mapping[str, Any], terminated: bool, terminates: bool) -> bool:
    """Whether an episode ended without a success, and without a collision that ends it."""
    return bool(terminated and not info["is_success"] and not (terminates and info["collisions"] > 0))


def _end(row: dict[str, Any], info: Mapping[str, Any], length: float, *, jammed: bool) -> None:
    row["episodes"] += 1
    row["jams"] += jammed
    row["successes"] += bool(info["is_success"])
    row["worst_depth"] = max(row["worst_depth"], info["worst_depth"] / length)
    row["worst_impulse"] = max(row["worst_impulse"], info["worst_impulse"])


def _actions(rng: np.random.Generator, size: int) -> Iterator[FloatArray]:
    """Yield the actions of one of the policies, without end."""
    policy = rng.integers(3)
    while True:
        action = rng.uniform(-1.0, 1.0, size)
        if policy == 2:
            action[0] = abs(action[0])
        for _ in range(1 if policy == 0 else 25):
            yield action


def summed_up(rows: Sequence[Mapping[str, Any]], n_tasks: int) -> dict[str, Any]:
    """Add up the rows by what ends an episode and what drives the arm."""
    kinds: dict[tuple[bool, str], list[Mapping[str, Any]]] = {}
    for row in rows:
        _, terminates, actuation, *_ = row["task"]
        kinds.setdefault((terminates, actuation), []).append(row)
    return {
        "tasks": n_tasks,
        "done": len(rows),
        "mazes": len({row["task"][0] for row in rows}),
        "exceptions": [f"{row['task']}: {row['exception']}" for row in rows if "exception" in row],
        "rows": [
            {
                "terminates": terminates,
                "actuation": actuation,
                **{count: sum(row[count] for row in mine) for count in COUNTS},
                **{worst: max(row[worst] for row in mine) for worst in WORST},
                "worst_in": max(mine, key=lambda row: row["worst_depth"])["task"][0],
            }
            for (terminates, actuation), mine in kinds.items()
        ],
    }
