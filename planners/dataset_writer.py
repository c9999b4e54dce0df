"""Episodes of the planner and of random actions, written in Minari's format."""

from __future__ import annotations

import dataclasses
import importlib.metadata
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import hrsnake_env
from planners.demonstrator import Demonstrator
from planners.motion_cache import maze_key

__all__ = ["DatasetWriter", "mean_return"]

AUTHOR = "The hrsnake developers"
ALGORITHM = "planned motions, closed loop, with action noise"

Choice = Callable[[], tuple[NDArray[np.float32], NDArray[np.float32]]]
"""Returns the action to take and the one that the planner would take."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _Episode:
    """Hold an episode: observations and infos from the reset on, and what was done and came of it."""

    observations: list[NDArray[Any]]
    infos: list[dict[str, Any]]
    actions: list[NDArray[np.float32]] = field(default_factory=list)
    experts: list[NDArray[np.float32]] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)
    ends: list[tuple[bool, bool]] = field(default_factory=list)

    @property
    def success(self) -> bool:
        """Whether the tip reached the goal."""
        return bool(self.infos[-1]["success"])


def _play(env: gym.Env[Any, Any], start: tuple[Any, dict[str, Any]], choose: Choice) -> _Episode:
    """Play an episode from its reset to its end."""
    episode = _Episode(observations=[start[0]], infos=[start[1]])
    while not episode.ends or not any(episode.ends[-1]):
        action, expert = choose()
        observation, reward, terminated, truncated, info = env.step(action)
        episode.observations.append(observation)
        episode.infos.append(info)
        episode.actions.append(action)
        episode.experts.append(expert)
        episode.rewards.append(float(reward))
        episode.ends.append((terminated, truncated))
    return episode


class DatasetWriter:
    """Play and write episodes, and keep count."""

    def __init__(self, env: gym.Env[Any, Any], folder: Path, only_success: bool) -> None:
        from minari.dataset.minari_storage import MinariStorage

        assert env.spec is not None
        self.env, self.only_success, self.demonstrator = env, only_success, Demonstrator(env)
        # With its module in the id the environment is found where nobody has imported it.
        spec = dataclasses.replace(env.spec, id=f"{hrsnake_env.__name__}:{env.spec.id}")
        self.storage = MinariStorage.new(
            folder,
            observation_space=env.observation_space,
            action_space=env.action_space,
            env_spec=spec,
            data_format="hdf5",
        )
        self.successes: dict[float, list[bool]] = {}
        self.random_returns: list[float] = []
        self.expert_returns: list[float] = []
        self.n_episodes = self.n_steps = 0
        self._unplanned: set[bytes] = set()

    @property
    def unplanned(self) -> int:
        """Number of mazes without a plan."""
        return len(self._unplanned)

    def add(self, seed: int, maze: str | None, levels: Sequence[float], *, first: bool) -> None:
        """Play from one start at every noise level, and for the reference scores."""
        options = None if maze is None else {"maze": maze}
        _, info = self.env.reset(seed=seed, options=options)
        if not self.demonstrator.begin():
            self._unplanned.add(maze_key(self.env.unwrapped.maze))  # type: ignore[attr-defined]
            return
        # Without noise, episodes in the same maze are all alike: one of them will do.
        fresh = first or info["task_id"] >= 0
        if fresh:
            noiseless = self._demonstrate(seed, options, 0.0)
            self.expert_returns.append(sum(noiseless.rewards))
        rng = np.random.default_rng([seed, 0])
        size = self.env.action_space.shape
        start = self.env.reset(seed=seed, options=options)
        random = _play(self.env, start, lambda: (rng.uniform(-1.0, 1.0, size).astype(np.float32),) * 2)
        self.random_returns.append(sum(random.rewards))
        for noise in levels:
            if noise > 0.0:
                self._keep(self._demonstrate(seed, options, noise), seed, options, noise)
            elif fresh:
                self._keep(noiseless, seed, options, noise)

    def _demonstrate(self, seed: int, options: dict[str, Any] | None, noise: float) -> _Episode:
        start = self.env.reset(seed=seed, options=options)
        self.demonstrator.begin()
        rng = np.random.default_rng([seed, 1, round(1e6 * noise)])

        def choose() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            expert = self.demonstrator.action()
            return self.demonstrator.noisy(expert, noise * rng.standard_normal(len(expert))), expert

        return _play(self.env, start, choose)

    def _keep(self, episode: _Episode, seed: int, options: dict[str, Any] | None, noise: float) -> None:
        """Count an episode, and write it if it is to be kept."""
        from minari import EpisodeMetadataCallback
        from minari.data_collector import EpisodeBuffer

        self.successes.setdefault(noise, []).append(episode.success)
        if self.only_success and not episode.success:
            return
        terminated, truncated = np.array(episode.ends).T
        infos = {key: np.array([info[key] for info in episode.infos]) for key in episode.infos[0]}
        # Infos begin at the reset, before which nothing is done.
        infos["expert_action"] = np.array([np.zeros_like(episode.experts[0]), *episode.experts])
        rewards = np.array(episode.rewards)
        buffer = EpisodeBuffer(
            seed=seed,
            options=options,
            observations=np.array(episode.observations),
            actions=np.array(episode.actions),
            rewards=rewards,
            terminations=terminated,
            truncations=truncated,
            infos=infos,
        )
        metadata = {
            **EpisodeMetadataCallback()({"rewards": rewards}),
            "noise": noise,
            "success": episode.success,
            "maze": self.env.unwrapped.maze.name,  # type: ignore[attr-defined]
            "task_id": episode.infos[0]["task_id"],
        }
        self.storage.update_episodes([buffer])
        self.storage.update_episode_metadata([metadata], [self.n_episodes])
        self.n_episodes += 1
        self.n_steps += len(rewards)

    def finish(self, dataset_id: str, levels: Sequence[float]) -> None:
        """Write what the data set is."""
        import minari

        self.storage.update_metadata(
            {
                "dataset_id": dataset_id,
                "minari_version": minari.__version__,
                "author": {AUTHOR},
                "algorithm_name": ALGORITHM,
                "description": _description(levels, self.only_success),
                "requirements": _requirements(),
                "ref_min_score": mean_return(self.random_returns),
                "ref_max_score": mean_return(self.expert_returns),
                "num_episodes_average_score": len(self.random_returns),
                "noise_levels": list(levels),
            }
        )


def _description(levels: Sequence[float], only_success: bool) -> str:
    kept = "Only episodes that reach the goal are kept." if only_success else "Failed episodes are kept, too."
    return (
        "A planner feeds a hyper-redundant arm through a maze. Actions are those of the planner, led back to "
        f"its motion in every step, with Gaussian noise of {', '.join(f'{noise:g}' for noise in levels)} of "
        "the largest action (by episode, in the metadata), less where it would meet a wall. "
        f"infos['expert_action'][k + 1] is what the planner would have done instead of action k. {kept}"
    )


def _requirements() -> list[str]:
    """Return what Minari shall look for before it makes the environment."""
    try:
        return [f"hrsnake>={importlib.metadata.version('hrsnake')}"]
    except importlib.metadata.PackageNotFoundError:  # run from its folder, not installed
        return []


def mean_return(values: Sequence[float]) -> float | None:
    """Return the mean; None of nothing."""
    return float(np.mean(values)) if values else None
