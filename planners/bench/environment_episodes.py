"""Resets per second, and the planner's motions as episodes: how fast, how near to the plan, how clean."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from hrsnake_env.space import SIM_LINK
from planners.bench.environment_peers import SUBSTEPS, spread
from planners.bench.environment_scenes import ENV_ID, arm_in_hall, half_out, hall
from planners.bench.pool import Tell
from planners.controllers import PlannedPolicy
from planners.planning import plan
from planners.problem import Motion

__all__ = ["RESET_CASES", "RESET_TARGET", "TARGETS", "episodes", "resets"]

RESET_LINKS = 20
RESET_TARGET = 500.0
"""Resets per second that we want with so many links in the hall."""

TARGETS = {"node_error": 0.02, "drift": 0.005, "seconds": 0.3}
"""What we want at most: px at a link of 230, and seconds for the insertion into `fig17a`."""

FASTEST_MAZE = "fig17a"
"""In which the seconds have a target."""


def _hall_case() -> gym.Env[Any, Any]:
    return gym.make(ENV_ID, **arm_in_hall(RESET_LINKS, hall()))


def _paper_case(maze: str) -> gym.Env[Any, Any]:
    return gym.make(ENV_ID, maze=maze, link_length=PAPER_LINK_LENGTHS[maze], n_links=RESET_LINKS)


RESET_CASES: dict[str, tuple[Callable[[], gym.Env[Any, Any]], dict[str, Any] | None]] = {
    "hall": (_hall_case, None),
    "hall, arm half out": (_hall_case, half_out()),
    "fig19": (lambda: _paper_case("fig19"), None),
    "fig17a": (lambda: _paper_case("fig17a"), None),
    "a new random maze": (lambda: gym.make(ENV_ID, maze="random", n_links=RESET_LINKS), None),
}
"""Environments and options of the reset, by what is shown."""


def resets(window: float, rounds: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Count resets per second of processor time, in turns.

    Parameters
    ----------
    window : float
        Seconds for each case in each round.
    rounds : int
        So many.
    tell : callable
        Called after each round.
    """
    envs = {name: make() for name, (make, _) in RESET_CASES.items()}
    rates: dict[str, list[float]] = {name: [] for name in envs}
    for env, (_, options) in zip(envs.values(), RESET_CASES.values(), strict=True):
        env.reset(seed=0, options=options)
    for _ in range(rounds):
        for name, env in envs.items():
            rates[name].append(_reset_rate(env, RESET_CASES[name][1], window))
        tell()
    return {
        "n_links": RESET_LINKS,
        "target": RESET_TARGET,
        "rounds": rounds,
        "rows": [
            {"name": name, "n_walls": _n_walls(env), "rate": spread(rates[name])}
            for name, env in envs.items()
        ],
    }


def _reset_rate(env: gym.Env[Any, Any], options: dict[str, Any] | None, window: float) -> float:
    """Count resets alone, each after a step: a simulator that nothing has moved is not built again."""
    n, spent, still = 0, 0.0, np.zeros(env.action_space.shape or ())
    while spent < window:
        env.step(still)
        start = time.process_time()
        env.reset(options=options)
        spent += time.process_time() - start
        n += 1
    return n / spent


def _n_walls(env: gym.Env[Any, Any]) -> int:
    return len(env.unwrapped.maze.walls)  # type: ignore[attr-defined]


def episodes(mazes: Sequence[str], runs: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Plan, and take the motion through `gym.make` with fewer and more substeps.

    Parameters
    ----------
    mazes : sequence of str
        Keys of `PAPER_LINK_LENGTHS`.
    runs : int
        Timed episodes of each, after one that warms up, in turns.
    tell : callable
        Called after each episode.

    Returns
    -------
    figures : dict
        For each maze and number of substeps: seconds of processor time from the reset to the goal, and the
        largest errors in px at a link of 230.
    """
    motions = {maze: _motion(maze) for maze in mazes}
    cases = [(motions[maze], maze, substeps) for maze in mazes for substeps in SUBSTEPS]
    every: list[list[dict[str, Any]]] = [[] for _ in cases]
    for _ in range(runs + 1):
        for case, seen in zip(cases, every, strict=True):
            seen.append(_episode(*case))
            tell()
    return {
        "runs": runs,
        "targets": TARGETS,
        "rows": [_row(case, seen) for case, seen in zip(cases, every, strict=True)],
    }


def _row(case: tuple[Motion, str, int], seen: Sequence[dict[str, Any]]) -> dict[str, Any]:
    motion, maze, substeps = case
    seconds = spread([run["seconds"] for run in seen[1:]])
    return {
        "maze": maze,
        "n_links": motion.n_links,
        "link_length": motion.link_length,
        "substeps": substeps,
        **seen[-1],
        "seconds": seconds,
        "rate": seen[-1]["steps"] / seconds["median"],
        "timed": maze == FASTEST_MAZE,
    }


def _motion(maze: str) -> Motion:
    motion = plan(Maze.load(maze), ArmSpec(link_length=PAPER_LINK_LENGTHS[maze])).motion
    assert motion is not None  # these mazes have one
    return motion


def _episode(motion: Motion, maze: str, substeps: int) -> dict[str, Any]:
    """Take a motion through the environment once."""
    actions = PlannedPolicy(motion).actions
    env = gym.make(
        ENV_ID,
        maze=maze,
        link_length=motion.link_length,
        n_links=motion.n_links,
        substeps=substeps,
        max_episode_steps=len(actions) + 2,
    )
    infos: list[dict[str, Any]] = []
    rest, over = 0.0 * actions[0], False
    start = time.process_time()
    env.reset()
    while not over:
        action = actions[len(infos)] if len(infos) < len(actions) else rest
        _, _, terminated, truncated, info = env.step(action)
        infos.append(info)
        over = terminated or truncated
    seconds = time.process_time() - start
    scale = SIM_LINK / motion.link_length
    return {
        "seconds": seconds,
        "steps": len(infos),
        "node_error": scale * max(info["node_error"] for info in infos),
        "drift": scale * max(info["drift"] for info in infos),
        "success": bool(infos[-1]["is_success"]),
        "clean": env.unwrapped.pinch_report().clean,  # type: ignore[attr-defined]
    }
