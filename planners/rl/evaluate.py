"""Evaluate a policy: plain facts of each episode, with mean actions and with sampled ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hrsnake_env.arguments import check_at_least
from hrsnake_env.replay import Trace
from planners.rl.environments import make_env
from planners.rl.network import NetworkPolicy
from planners.rl.settings import FIRST_SEED
from planners.rollout import Policy, episode_facts, run_episode

__all__ = ["FACTS", "evaluate", "evaluate_both", "replayed", "summary"]

FACTS = ("success", "clean", "return", "steps", "progress", "worst_depth", "collisions", "pinches")
"""What is measured of an episode."""


def evaluate(
    policy: Policy,
    env_id: str | None = None,
    *,
    episodes: int = 100,
    seed: int = FIRST_SEED,
    deterministic: bool = True,
    env: Any = None,
) -> list[dict[str, Any]]:
    """Run episodes from the base, and return what came of each.

    An episode is the same, to the last bit, whenever seed and policy are.

    Parameters
    ----------
    policy : NetworkPolicy, or anything with `predict`
        What acts. A NetworkPolicy brings its wrappers, and random numbers that start anew in each episode.
    env_id : str, optional
        By default the environment that a NetworkPolicy was trained in.
    episodes : int
        How many.
    seed : int
        Of the first reset; each further one has the next.
    deterministic : bool
        Whether to take mean actions, or to sample them as in training.
    env : gymnasium.Env, optional
        To use instead of one by its id; it stays open.

    Returns
    -------
    facts : list of dict
        `seed`, `task_id` and, for each of `FACTS`: whether the tip came to the goal, and whether links merely
        pinched the walls; the sum of rewards; the number of steps; the share of the way at the end; the
        deepest place of a link in a wall, in link lengths; how often the policy saw a collision, and links
        that pinched, summed over steps (`planners.rollout.episode_facts`).

    Raises
    ------
    InputError
        If the environment is unknown, or does not suit the policy.
    """
    check_at_least("episodes", episodes, 1, whole=True)
    check_at_least("seed", seed, 0, whole=True)
    made = _env_of(policy, env_id) if env is None else env
    try:
        return [_episode(policy, made, seed + k, deterministic) for k in range(episodes)]
    finally:
        if env is None:
            made.close()


def evaluate_both(
    policy: NetworkPolicy, env_id: str | None = None, *, episodes: int = 100, seed: int = FIRST_SEED
) -> dict[str, list[dict[str, Any]]]:
    """Evaluate with mean and with sampled actions: the one may fail where the other comes through.

    In one maze all episodes with mean actions are the same, so that a single one is run.

    Parameters
    ----------
    policy, env_id, episodes, seed
        See `evaluate`.

    Returns
    -------
    facts : dict
        What `evaluate` returns, under "mean" and "sampled".
    """
    check_at_least("episodes", episodes, 1, whole=True)
    env = policy.make_env(env_id)
    try:
        first = evaluate(policy, episodes=1, seed=seed, env=env)
        more = episodes - 1 if first[0]["task_id"] >= 0 else 0
        rest = evaluate(policy, episodes=more, seed=seed + 1, env=env) if more else []
        sampled = evaluate(policy, episodes=episodes, seed=seed, deterministic=False, env=env)
    finally:
        env.close()
    return {"mean": [*first, *rest], "sampled": sampled}


def summary(facts: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Return the number of episodes and the mean of each fact; of `worst_depth` the largest."""
    means = {name: float(np.mean([fact[name] for fact in facts])) for name in FACTS}
    worst = max(fact["worst_depth"] for fact in facts)
    return {"episodes": len(facts), **means, "worst_depth": float(worst)}


def replayed(policy: NetworkPolicy, env_id: str | None = None, *, seed: int = FIRST_SEED) -> list[Trace]:
    """Return the first episode with mean and with sampled actions, for a replay side by side.

    Parameters
    ----------
    policy, env_id, seed
        See `evaluate`.
    """
    env = policy.make_env(env_id)
    try:
        return [_trace(policy, env, seed, deterministic) for deterministic in (True, False)]
    finally:
        env.close()


class _Sampled:
    """Sample, whatever is asked for."""

    def __init__(self, policy: Policy) -> None:
        self.policy = policy

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = True
    ) -> Any:
        return self.policy.predict(observation, state, episode_start, False)


def _trace(policy: NetworkPolicy, env: Any, seed: int, deterministic: bool) -> Trace:
    policy.reseed(seed)
    episode = run_episode(env, policy if deterministic else _Sampled(policy), seed=seed)
    world = env.unwrapped
    title = f"{world.maze.name}, {policy.origin.method}, {'mean' if deterministic else 'sampled'} actions"
    return episode.trace(world.maze, title=title, link_radius=world.arm.link_radius)


def _env_of(policy: Policy, env_id: str | None) -> Any:
    if isinstance(policy, NetworkPolicy):
        return policy.make_env(env_id)
    return make_env("" if env_id is None else env_id)


def _episode(policy: Policy, env: Any, seed: int, deterministic: bool) -> dict[str, Any]:
    if isinstance(policy, NetworkPolicy):
        policy.reseed(seed)
    return {"seed": seed, **episode_facts(env, policy, seed, deterministic=deterministic)}
