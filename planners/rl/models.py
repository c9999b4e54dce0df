"""Learners of stable-baselines3, made from settings or from a checkpoint."""

from __future__ import annotations

import copy
import importlib.util
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hrsnake_env.errors import InputError
from planners.rl.checkpoints import read_model, restore
from planners.rl.environments import decision_steps, make_env
from planners.rl.settings import Settings

__all__ = ["learners", "new_model", "resumed_model", "vector"]


def learners() -> Any:
    """Return torch, if everything that learns is installed."""
    try:
        import sb3_contrib  # noqa: F401
        import stable_baselines3  # noqa: F401
        import torch
    except ImportError:
        raise InputError(
            'Expected stable-baselines3 to be installed, to train: pip install "hrsnake[rl]".'
        ) from None
    return torch


def vector(settings: Settings) -> Any:
    """Make the environments, each of which tells the learner of its episodes."""
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import DummyVecEnv

    def one() -> Any:
        return Monitor(make_env(settings.env_id, env_kwargs=settings.env_kwargs, wrappers=settings.wrappers))

    return DummyVecEnv([one] * settings.n_envs)


def _class(settings: Settings) -> Any:
    from sb3_contrib import TQC
    from stable_baselines3 import PPO, SAC

    return {"ppo": PPO, "sac": SAC, "tqc": TQC}[settings.algorithm]


def new_model(settings: Settings, envs: Any, seed: int, folder: Path) -> Any:
    """Make a new model."""
    from stable_baselines3 import HerReplayBuffer

    arguments = copy.deepcopy(settings.arguments)  # stable-baselines3 writes into some
    for key in ("learning_rate", "clip_range"):
        if isinstance(arguments.get(key), str):
            arguments[key] = _Linear(float(arguments[key].removeprefix("lin_")))
    if isinstance(arguments.get("train_freq"), list):
        arguments["train_freq"] = tuple(arguments["train_freq"])
    if "replay_buffer_class" in arguments:
        arguments["replay_buffer_class"] = {"HerReplayBuffer": HerReplayBuffer}[
            arguments["replay_buffer_class"]
        ]
        # Hindsight takes whole episodes alone: one must have ended before the first is drawn.
        limit = envs.get_attr("spec")[0].max_episode_steps / decision_steps(settings.wrappers)
        least = settings.n_envs * math.ceil(limit)
        arguments["learning_starts"] = max(arguments.get("learning_starts", 0), least)
    try:
        return _class(settings)(
            settings.policy, envs, seed=seed, device="cpu", tensorboard_log=_logs(folder), **arguments
        )
    except (AssertionError, TypeError, ValueError) as error:
        raise InputError(f"Expected settings that {settings.algorithm} takes, got: {error}.") from None


def resumed_model(settings: Settings, envs: Any, seed: int, checkpoint: Path) -> Any:
    """Return the model of the checkpoint, with random numbers that it has not yet drawn."""
    new = new_model(settings, envs, seed, checkpoint.parent)
    model = read_model(checkpoint, lambda file: restore(new, file))
    own = np.random.SeedSequence((seed, model.num_timesteps)).generate_state(1)[0]
    model.set_random_seed(int(own) % 2**31)
    return model


def _logs(folder: Path) -> str | None:
    return str(folder / "tensorboard") if importlib.util.find_spec("tensorboard") else None


@dataclass(frozen=True)
class _Linear:
    """Let a setting fall from a start to 0 over the run, as RL Zoo's `lin_` does."""

    start: float

    def __call__(self, remaining: float) -> float:
        return remaining * self.start
