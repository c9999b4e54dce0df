"""A trained policy as plain arrays: it acts and is stored without the library that trained it."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.reading import NotReadable, read_arrays, shown
from planners.rl.environments import make_env
from planners.rl.origin import Origin

__all__ = ["NetworkPolicy", "Origin"]

Float32 = NDArray[np.float32]

ACTIVATIONS: dict[str, Callable[[Any], Any]] = {
    "tanh": np.tanh,
    "relu": lambda values: np.maximum(values, np.float32(0.0)),
}

LOG_STD = (-20.0, 2.0)
"""Bounds of a squashed policy's log standard deviations, as in stable-baselines3."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NetworkPolicy:
    """Act by a perceptron whose last layer gives the means of a Gaussian with independent parts.

    Parameters
    ----------
    hidden : tuple of (weights, bias)
        Layers from the observation on; weights have shape (n_out, n_in).
    mean : (weights, bias)
        From the last hidden layer to the means.
    spread : (weights, bias)
        From the last hidden layer to the logarithms of the standard deviations; weights of 0 where these do
        not depend on the observation.
    activation : {"tanh", "relu"}
        After each hidden layer.
    squash : bool
        Whether tanh brings actions into [-1, 1]; otherwise they are cut.
    observation : tuple of (name, length)
        Parts of the observation in their order; the name "" stands for a plain vector.
    origin : Origin
        Where it comes from.

    Raises
    ------
    InputError
        If the shapes do not fit each other, or a number is not finite.
    """

    hidden: tuple[tuple[Float32, Float32], ...]
    mean: tuple[Float32, Float32]
    spread: tuple[Float32, Float32]
    activation: str
    squash: bool
    observation: tuple[tuple[str, int], ...]
    origin: Origin

    def __post_init__(self) -> None:
        if self.activation not in ACTIVATIONS:
            names = ", ".join(ACTIVATIONS)
            raise InputError(f"Unknown activation {shown(self.activation)}. Available: {names}.")
        width = sum(length for _, length in self.observation)
        for weights, bias in self.hidden:
            width = _check_layer(weights, bias, width)
        if _check_layer(*self.mean, width) != _check_layer(*self.spread, width):
            raise InputError(
                f"Expected as many standard deviations as means, got {len(self.spread[1])} and "
                f"{len(self.mean[1])}."
            )
        self.reseed(0)

    @property
    def n_actions(self) -> int:
        """Numbers in an action."""
        return len(self.mean[1])

    @property
    def n_observed(self) -> int:
        """Numbers in an observation."""
        return sum(length for _, length in self.observation)

    def reseed(self, seed: int) -> None:
        """Start the random numbers of sampled actions anew."""
        object.__setattr__(self, "_rng", np.random.default_rng(seed))

    def predict(
        self,
        observation: Any,
        state: tuple[Any, ...] | None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Float32, tuple[Any, ...] | None]:
        """Return actions for one observation or a batch, as stable-baselines3 does.

        Parameters
        ----------
        observation : array or dict of arrays, shape (n_observed,) or (n_envs, n_observed)
            As the environment gives it.
        state, episode_start
            Handed back and not used: a perceptron has no memory.
        deterministic : bool
            Whether to take the mean; otherwise an action is drawn by the policy's own random numbers.

        Returns
        -------
        action : float32 array, shape (n_actions,) or (n_envs, n_actions)
            In [-1, 1].
        state : tuple, optional
            The one given.

        Raises
        ------
        InputError
            If the observation is not of the policy's shape.
        """
        values = self._vector(observation)
        act = ACTIVATIONS[self.activation]
        for weights, bias in self.hidden:
            values = act(values @ weights.T + bias)
        action = values @ self.mean[0].T + self.mean[1]
        if not deterministic:
            log_std = values @ self.spread[0].T + self.spread[1]
            if self.squash:
                log_std = np.clip(log_std, *LOG_STD)
            rng: np.random.Generator = self._rng  # type: ignore[attr-defined]
            action = action + np.exp(log_std) * rng.standard_normal(action.shape, dtype=np.float32)
        action = np.tanh(action) if self.squash else np.clip(action, -1.0, 1.0)
        return action.astype(np.float32), state

    def make_env(self, env_id: str | None = None, *, render_mode: str | None = None) -> gym.Env[Any, Any]:
        """Make the environment that the policy acts in, with episodes that start at the base.

        Parameters
        ----------
        env_id : str, optional
            Another one, of an arm with as many links.
        render_mode : str, optional
            See `HyperRedundantMazeEnv`.

        Raises
        ------
        InputError
            If the id is unknown, or its observations or actions are not of the policy's shape.
        """
        origin = self.origin
        name = origin.env_id if env_id is None else env_id
        env = make_env(name, env_kwargs=origin.env_kwargs, wrappers=origin.wrappers, render_mode=render_mode)
        observed = observation_layout(env.observation_space)
        if observed != self.observation or env.action_space.shape != (self.n_actions,):
            env.close()
            raise InputError(
                f"Expected an environment with {self.n_observed} numbers observed and {self.n_actions} in an "
                f"action, as the policy has, got {name}."
            )
        return env

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the policy as .npz: arrays, and what else there is as JSON."""
        layers = [*self.hidden, self.mean, self.spread]
        arrays: dict[str, Any] = {f"weights_{k}": weights for k, (weights, _) in enumerate(layers)}
        arrays |= {f"bias_{k}": bias for k, (_, bias) in enumerate(layers)}
        meta = {
            "activation": self.activation,
            "squash": self.squash,
            "observation": self.observation,
            "origin": asdict(self.origin),
        }
        with replacing(path) as part, open(part, "wb") as file:
            np.savez(file, meta=np.array(json.dumps(meta)), **arrays)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> NetworkPolicy:
        """Read a policy that `save` has written.

        Raises
        ------
        InputError
            If the file is missing or does not hold a policy.
        """
        try:
            data = read_arrays(path)
            meta = json.loads(str(data.pop("meta")))
            layers = [(data[f"weights_{k}"], data[f"bias_{k}"]) for k in range(len(data) // 2)]
            *hidden, mean, spread = layers
            return cls(
                hidden=tuple(hidden),
                mean=mean,
                spread=spread,
                activation=meta["activation"],
                squash=bool(meta["squash"]),
                observation=tuple((str(name), int(length)) for name, length in meta["observation"]),
                origin=Origin.from_dict(meta["origin"]),
            )
        except FileNotFoundError:
            raise InputError(f"Expected a policy (.npz) at '{path}', but there is none.") from None
        except InputError as error:
            raise InputError(f"Expected a policy (.npz) in '{path}': {error}") from None
        except NotReadable as got:
            raise InputError(f"Expected a policy (.npz) in '{path}', got {got}.") from None
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            raise InputError(f"Expected a policy (.npz) in '{path}', got a file that is not one.") from None

    @classmethod
    def from_model(cls, model: Any, origin: Origin) -> NetworkPolicy:
        """Take the policy out of a model of stable-baselines3 or sb3-contrib: PPO, SAC or TQC.

        Parameters
        ----------
        model : stable_baselines3 model
            With a perceptron for a policy, on vectors or dictionaries of vectors.
        origin : Origin
            Where it comes from.

        Raises
        ------
        InputError
            If its policy is of another kind.
        """
        state = {
            name: np.array(value.cpu().numpy(), dtype=np.float32)
            for name, value in model.policy.state_dict().items()
        }
        squash = "actor.mu.weight" in state
        trunk = "actor.latent_pi" if squash else "mlp_extractor.policy_net"
        try:
            mean = _layer(state, "actor.mu" if squash else "action_net")
            constant = None if squash else (np.zeros_like(mean[0]), state["log_std"])
            spread = constant or _layer(state, "actor.log_std")
        except KeyError:
            raise InputError(f"Expected a Gaussian policy, got {type(model.policy).__name__}.") from None
        numbers = sorted(
            int(name.split(".")[-2])
            for name in state
            if name.startswith(f"{trunk}.") and name.endswith(".weight")
        )
        activation = model.policy.activation_fn.__name__.lower()
        return cls(
            hidden=tuple(_layer(state, f"{trunk}.{number}") for number in numbers),
            mean=mean,
            spread=spread,
            activation=activation,
            squash=squash,
            observation=observation_layout(model.observation_space),
            origin=origin,
        )

    def _vector(self, observation: Any) -> Float32:
        """Return an observation as one vector, or a batch of them."""
        if isinstance(observation, Mapping):
            missing = [name for name, _ in self.observation if name not in observation]
            if missing:
                raise InputError(f"Expected observations with {missing[0]!r}, got {', '.join(observation)}.")
            parts = [observation[name] for name, _ in self.observation]
            values = np.concatenate([np.asarray(part, dtype=np.float32) for part in parts], axis=-1)
        else:
            values = np.asarray(observation, dtype=np.float32)
        if values.shape[-1:] != (self.n_observed,) or values.ndim > 2:
            raise InputError(
                f"Expected observations with {self.n_observed} numbers each, got shape {values.shape}."
            )
        return values


def observation_layout(space: Any) -> tuple[tuple[str, int], ...]:
    """Return the parts of an observation space: name and length; the name "" stands for a plain vector.

    Raises
    ------
    InputError
        If a part is not a vector.
    """
    named: list[tuple[str, Any]] = [("", space)]
    if isinstance(space, gym.spaces.Dict):
        named = list(space.spaces.items())
    for name, part in named:
        if not isinstance(part, gym.spaces.Box) or len(part.shape) != 1:
            raise InputError(f"Expected observations made of vectors, got {part} for {name!r}.")
    return tuple((name, int(part.shape[0])) for name, part in named)


def _layer(state: dict[str, Float32], name: str) -> tuple[Float32, Float32]:
    return state[f"{name}.weight"], state[f"{name}.bias"]


def _check_layer(weights: Float32, bias: Float32, width: int) -> int:
    """Return how many numbers come out of a layer that so many go into."""
    if weights.dtype.kind != "f" or bias.dtype.kind != "f":
        raise InputError(f"Expected weights in numbers, got {weights.dtype} and {bias.dtype}.")
    if weights.ndim != 2 or bias.ndim != 1:
        raise InputError(f"Expected weights with shape (n_out, n_in), got {weights.shape} and {bias.shape}.")
    if weights.shape != (*bias.shape, width):
        raise InputError(
            f"Expected layers that fit each other, got weights with shape {weights.shape} after {width} "
            f"numbers, with a bias of shape {bias.shape}."
        )
    if not (np.isfinite(weights).all() and np.isfinite(bias).all()):
        raise InputError("Expected finite weights, got some that are not.")
    return len(bias)
