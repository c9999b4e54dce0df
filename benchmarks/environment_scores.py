"""How three policies do in every environment: random actions, follow-the-leader, and the planner.

Run with `.venv/bin/python benchmarks/environment_scores.py` from the repository's root; with parts of ids,
such as `UTurn`, these are measured anew. A run that was stopped is gone on with. Writes
`docs/environments/scores.json`, from which the pages of the environments have their numbers.
"""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from rich.progress import Progress

from hrsnake_env import ENVIRONMENTS, InputError
from hrsnake_env.files import replacing
from planners import plan
from planners.controllers import PlannedPolicy
from planners.rollout import Episode, Policy, run_episode

SCORES = Path(__file__).parent.parent / "docs" / "environments" / "scores.json"
COMMAND = "python benchmarks/environment_scores.py"
PACKAGES = ("gymnasium", "pymunk", "numpy", "scipy", "shapely", "numba")
N_RANDOM, N_TASKS = 20, 100
"""Episodes of random actions in one maze, and of any policy in random mazes."""

PLANNERS = {"follow": "follow", "planner": "auto"}


class RandomPolicy:
    """Take any action, whatever is observed."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        self.space = env.action_space
        self.space.seed(0)

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> tuple[Any, None]:
        """Return a random action."""
        return self.space.sample(), None


def episodes(env: gym.Env[Any, Any], name: str) -> Iterator[Episode | None]:
    """Run a policy's episodes with seeds from 0; None stands for a maze without a valid motion."""
    is_random = ENVIRONMENTS[env.spec.id]["kwargs"].get("maze") == "random"
    n = N_TASKS if is_random else (N_RANDOM if name == "random" else 1)
    policy: Policy | None = RandomPolicy(env) if name == "random" else None
    for seed in range(n):
        if name != "random":
            policy = planned(env, PLANNERS[name], seed)
        yield None if policy is None else run_episode(env, policy, seed=seed)


def planned(env: gym.Env[Any, Any], planner: str, seed: int) -> PlannedPolicy | None:
    """Plan in the maze that a seed leads to."""
    env.reset(seed=seed)
    world: Any = env.unwrapped
    try:
        motion = plan(world.maze, world.arm, planner, explain=False).motion
    except InputError:  # the motion needs more links than the arm has
        return None
    return None if motion is None else PlannedPolicy(motion)


def score(found: list[Episode | None]) -> dict[str, Any]:
    """Return means of the episodes; those that were not run are failures with return 0, and have no steps."""
    run = [episode for episode in found if episode is not None]
    return {
        "episodes": len(found),
        "run": len(run),
        "success": sum(episode.success for episode in run) / len(found),
        "return": round(sum(float(episode.rewards.sum()) for episode in run) / len(found), 3),
        "steps": round(float(np.mean([episode.n_steps for episode in run])), 1) if run else None,
        "collided": sum(episode.report.collision > 0 for episode in run),
    }


def save(scores: dict[str, Any]) -> None:
    """Write what there is, with the command and the versions."""
    data = {
        "command": COMMAND,
        "versions": {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}},
        "scores": {name: scores[name] for name in ENVIRONMENTS if name in scores},
    }
    with replacing(SCORES) as part:
        part.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def main(parts: list[str]) -> None:
    scores = json.loads(SCORES.read_text(encoding="utf-8"))["scores"] if SCORES.exists() else {}
    if parts:
        names = [name for name in ENVIRONMENTS if any(part in name for part in parts)]
    else:
        names = [name for name in ENVIRONMENTS if name not in scores]
    with Progress() as bars:
        whole = bars.add_task("environments", total=len(names))
        for name in names:
            env = gym.make(name)
            scores[name] = {}
            for policy in ("random", *PLANNERS):
                bars.update(whole, description=f"{name}, {policy}")
                scores[name][policy] = score(list(episodes(env, policy)))
            save(scores)
            bars.advance(whole)
    print(f"{len(names)} measured; written: {SCORES.relative_to(SCORES.parents[2])}")


if __name__ == "__main__":
    main(sys.argv[1:])
