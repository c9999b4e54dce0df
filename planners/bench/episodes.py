"""Episodes of the environment for a row: what came of a policy, without its poses."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from planners.bench.tasks import ENV_ID, Problem
from planners.controllers import PlannedPolicy
from planners.problem import Motion
from planners.rollout import episode_facts

__all__ = ["MEASURED", "RandomPolicy", "motion_facts"]

MEASURED = ("success", "clean", "steps", "return", "progress", "worst_depth", "collisions", "pinches")
"""What a row holds of an episode."""

SLACK = 10
"""Steps that an episode may take beyond its motion: the arm is a substep behind its target."""


class RandomPolicy:
    """Draw every action evenly from all there are."""

    def __init__(self, env: gym.Env[Any, Any], seed: int) -> None:
        self._space: Any = env.action_space
        self._rng = np.random.default_rng(seed)

    def predict(
        self,
        observation: Any,
        state: tuple[Any, ...] | None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], tuple[Any, ...] | None]:
        """Return an action, and the state as it came."""
        action = self._rng.uniform(self._space.low, self._space.high)
        return action.astype(self._space.dtype), state


def motion_facts(motion: Motion, problem: Problem) -> dict[str, Any]:
    """Drive the simulated arm along a motion, and return what a row says of it."""
    policy = PlannedPolicy(motion)
    env = gym.make(
        f"hrsnake_env:{ENV_ID}",
        max_episode_steps=len(policy.actions) + SLACK,
        maze=problem.maze,
        link_length=motion.link_length,
        n_links=motion.n_links,
    )
    try:
        facts = episode_facts(env, policy)
        return {name: facts[name] for name in MEASURED}
    finally:
        env.close()
