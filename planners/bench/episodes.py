"""Episodes of the environment for a row: what came of a policy, without its poses."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from planners.bench.tasks import ENV_ID, Problem
from planners.controllers import PlannedPolicy
from planners.problem import Motion
from planners.rollout import Policy

__all__ = ["RandomPolicy", "episode_facts", "motion_facts"]

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


def episode_facts(
    env: gym.Env[Any, Any], policy: Policy, seed: int | None = None, options: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Run one episode, and return what a row says of it.

    Parameters
    ----------
    env : gymnasium.Env
        `HyperRedundantMaze-v0`, wrapped or not.
    policy : Policy
        Which acts.
    seed : int, optional
        For `env.reset`.
    options : dict, optional
        For `env.reset`, such as the `task_id`.
    """
    world: Any = env.unwrapped
    observation, info = env.reset(seed=seed, options=options)
    state, start, over, collisions = None, np.array([True]), False, 0
    while not over:
        action, state = policy.predict(observation, state=state, episode_start=start)
        observation, _, terminated, truncated, info = env.step(action)
        collisions += bool(info["collisions"])
        start, over = np.array([False]), terminated or truncated
    return {
        "success": bool(info["is_success"]),
        "clean": bool(world.physics.report().clean),
        "steps": int(info["total_steps"]),
        "return": float(info["total_reward"]),
        "progress": float(info["progress"]),
        "worst_depth": float(info["worst_depth"]) / world.arm.link_length,
        "collisions": collisions,
        "pinches": int(info["total_pinches"]),
    }


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
        return episode_facts(env, policy)
    finally:
        env.close()
