"""Environments as learners have them: made by id, with wrappers by name."""

from __future__ import annotations

import json
import math
from typing import Any

import gymnasium as gym

import hrsnake_env
from hrsnake_env.errors import InputError
from hrsnake_env.registration import ENVIRONMENTS
from planners.wrappers import REPEAT, ActionRepeat, PlannedResets, ResidualFollower, StepCost

__all__ = [
    "TRAINING_KWARGS",
    "TRAINING_ONLY",
    "WRAPPERS",
    "Wrappers",
    "check_env_id",
    "decision_steps",
    "make_env",
]

Wrappers = tuple[tuple[str, dict[str, Any]], ...]
"""Names with arguments, innermost first."""

WRAPPERS: dict[str, Any] = {
    "planners.wrappers.ActionRepeat": ActionRepeat,
    "planners.wrappers.PlannedResets": PlannedResets,
    "planners.wrappers.ResidualFollower": ResidualFollower,
    "planners.wrappers.StepCost": StepCost,
}
"""The wrappers that settings and policies may name."""

TRAINING_ONLY = ("planners.wrappers.PlannedResets", "planners.wrappers.StepCost")
"""Wrappers that help to learn: an evaluation starts at the base, and has the environment's own rewards."""

TRAINING_KWARGS = (
    "contact_penalty",
    "max_episode_steps",
    "reward_type",
    "substeps",
    "terminate_on_collision",
)
"""Arguments that make practice easier or shorter: an evaluation has the registered ones."""


def decision_steps(wrappers: Wrappers) -> int:
    """Return how many steps of the environment a decision takes."""
    repeats = (
        arguments.get("repeat", REPEAT) for name, arguments in wrappers if WRAPPERS[name] is ActionRepeat
    )
    return math.prod(int(repeat) for repeat in repeats)


def check_env_id(env_id: str) -> None:
    """Raise InputError if there is no such environment."""
    if env_id not in ENVIRONMENTS:
        raise InputError(f"Unknown environment {env_id!r}. Available: {', '.join(ENVIRONMENTS)}.")


def make_env(
    env_id: str,
    *,
    env_kwargs: dict[str, Any] | None = None,
    wrappers: Wrappers = (),
    render_mode: str | None = None,
) -> gym.Env[Any, Any]:
    """Make an environment with its wrappers.

    Parameters
    ----------
    env_id : str
        A registered id.
    env_kwargs : dict, optional
        For `gymnasium.make`; a policy's file holds them, so that JSON must be able to.
    wrappers : tuple of (name, arguments)
        Names of `WRAPPERS`, innermost first.
    render_mode : str, optional
        See `HyperRedundantMazeEnv`.

    Raises
    ------
    InputError
        If the id, a wrapper or an argument is unknown, or JSON cannot hold an argument.
    """
    check_env_id(env_id)
    try:
        json.dumps(env_kwargs or {})
    except TypeError:
        raise InputError(f"Expected env_kwargs that JSON can hold, got {env_kwargs!r}.") from None
    for name, _ in wrappers:
        if name not in WRAPPERS:
            raise InputError(f"Unknown wrapper {name!r}. Available: {', '.join(WRAPPERS)}.")
    try:
        env = gym.make(f"{hrsnake_env.__name__}:{env_id}", render_mode=render_mode, **(env_kwargs or {}))
        for name, arguments in wrappers:
            env = WRAPPERS[name](env, **arguments)
    except TypeError as error:  # an argument that there is not
        raise InputError(f"Expected arguments that {env_id} has, got: {error}.") from None
    return env
