"""Steps per second of many environments together, beside one alone."""

from __future__ import annotations

import importlib.util
import multiprocessing
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np

from planners.bench.environment_peers import spread
from planners.bench.environment_stepper import HOLD, Stepper
from planners.bench.pool import Tell

__all__ = ["VECTOR_ID", "vector"]

VECTOR_ID = "hrsnake_env:HyperRedundantMaze-UTurn-I50-v0"

N_ORDERS = 50
"""So many actions of all environments are sampled beforehand; each is held."""

Run = Callable[[float], float]
"""Steps for so many seconds; returns the rate."""


def vector(n_envs: int, window: float, rounds: int, tell: Tell = lambda: None) -> dict[str, Any]:
    """Measure one environment, without and with wrappers, and many in vectors, in turns.

    Parameters
    ----------
    n_envs : int
        In each vector.
    window : float
        Seconds for each in each round. Seconds pass on the wall here, as several processes work.
    rounds : int
        So many.
    tell : callable
        Called after each round.

    Returns
    -------
    figures : dict
        Rates, and their ratios to one environment; without those that are not installed.
    """
    with ExitStack() as stack:
        runs: dict[str, Run] = {
            "one": _one(gym.make(VECTOR_ID)),
            "one, without wrappers": _one(gym.make(VECTOR_ID).unwrapped),
        }
        for mode in ("sync", "async"):
            runs[f"make_vec, {mode}"] = stack.enter_context(_gymnasium(mode, n_envs))
        if importlib.util.find_spec("stable_baselines3"):
            for kind in ("DummyVecEnv", "SubprocVecEnv"):
                runs[f"SB3 {kind}"] = stack.enter_context(_baselines(kind, n_envs))
        for run in runs.values():
            run(window)
        rates: dict[str, list[float]] = {name: [] for name in runs}
        for _ in range(rounds):
            for name, run in runs.items():
                rates[name].append(run(window))
            tell()
    return {
        "id": VECTOR_ID.partition(":")[2],
        "n_envs": n_envs,
        "rounds": rounds,
        "rows": [
            {
                "name": name,
                "rate": spread(mine),
                "ratio": spread([a / b for a, b in zip(mine, rates["one"], strict=True)]),
            }
            for name, mine in rates.items()
        ],
    }


def _one(env: Any) -> Run:
    stepper = Stepper(env)

    def run(seconds: float) -> float:
        counts = stepper.run(seconds, time.perf_counter)
        return counts["steps"] / counts["seconds"]

    return run


def _many(step: Callable[[Any], Any], space: gym.Space[Any], n_envs: int) -> Run:
    space.seed(0)
    orders = [np.stack([space.sample() for _ in range(n_envs)]) for _ in range(N_ORDERS)]
    held = [order for order in orders for _ in range(HOLD)]

    def run(seconds: float) -> float:
        calls, start = 0, time.perf_counter()
        while (spent := time.perf_counter() - start) < seconds:
            step(held[calls % len(held)])
            calls += 1
        return calls * n_envs / spent

    return run


@contextmanager
def _gymnasium(mode: str, n_envs: int) -> Iterator[Run]:
    # As stable-baselines3 starts its workers: a fork would inherit the locks of this process's threads.
    start = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
    how = {"context": start} if mode == "async" else {}
    env = gym.make_vec(VECTOR_ID, num_envs=n_envs, vectorization_mode=mode, vector_kwargs=how)
    try:
        env.reset(seed=0)
        yield _many(env.step, env.single_action_space, n_envs)
    finally:
        env.close()


@contextmanager
def _baselines(kind: str, n_envs: int) -> Iterator[Run]:
    from stable_baselines3.common import vec_env

    env = getattr(vec_env, kind)([partial(gym.make, VECTOR_ID) for _ in range(n_envs)])
    try:
        env.seed(0)
        env.reset()
        yield _many(env.step, env.action_space, n_envs)
    finally:
        env.close()
