"""A motion as a policy: `predict(observation) -> action`, as stable-baselines3 has it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hrsnake_env.arm import FloatArray
from hrsnake_env.task import FEED_STEP, JOINT_STEP
from planners.motion_cache import maze_key
from planners.planning import plan
from planners.problem import Motion, PlanningResult

__all__ = ["PlannedPolicy", "PlanningPolicy", "actions_of"]


def actions_of(
    motion: Motion,
    feed_step: float = FEED_STEP,
    joint_step: float = JOINT_STEP,
    *,
    action: str = "delta",
    joint_limit: float | None = None,
) -> FloatArray:
    """Compute the actions that drive the environment along a motion.

    Parameters
    ----------
    motion : Motion
        A motion from the feeder.
    feed_step : float
        Largest change of the feed in a step, in link lengths.
    joint_step : float
        Largest change of a joint's target in a step, in rad.
    action : {"delta", "absolute"}
        What an action means in the environment.
    joint_limit : float, optional
        Of the environment's arm; absolute actions are shares of it, or of pi.

    Returns
    -------
    actions : array, shape (n_steps, n_links + 1)
        Each in [-1, 1]: feed, then the joints from the base end. A pose that is farther than one action from
        the last takes several equal ones.
    """
    steps = np.array([feed_step * motion.link_length, *([joint_step] * motion.n_links)])
    poses = np.column_stack([motion.feed, motion.joint_angles])
    changes = np.diff(poses, axis=0)
    parts = np.maximum(np.ceil(np.abs(changes / steps).max(axis=1) - 1e-9), 1.0).astype(int)
    changes = np.repeat(changes / parts[:, None], parts, axis=0)
    if action == "delta":
        return np.asarray(changes / steps)
    number = np.concatenate([np.arange(n) for n in parts]) - np.repeat(parts, parts) + 1
    targets = np.repeat(poses[1:], parts, axis=0) + number[:, None] * changes
    reach = motion.n_links * motion.link_length
    limit = np.pi if joint_limit is None else joint_limit
    return np.column_stack([2.0 * targets[:, 0] / reach - 1.0, targets[:, 1:] / limit])


class PlannedPolicy:
    """Follow a planned motion from the feeder to the goal, whatever is observed, and then hold still.

    It goes where a trained policy goes, into `stable_baselines3.common.evaluation.evaluate_policy` too. The
    state that `predict` returns is the number of steps taken; a caller that does not hand it back gets the
    policy's own count, which `episode_start` or `reset` sets to 0. Gymnasium's vectors take a step for a
    reset, so there an episode starts one step after the end of the last.

    Parameters
    ----------
    motion : Motion
        A motion from the feeder.
    feed_step, joint_step, action, joint_limit
        What an action means in the environment; see `actions_of`.
    """

    def __init__(
        self,
        motion: Motion,
        feed_step: float = FEED_STEP,
        joint_step: float = JOINT_STEP,
        *,
        action: str = "delta",
        joint_limit: float | None = None,
    ) -> None:
        self.actions = actions_of(motion, feed_step, joint_step, action=action, joint_limit=joint_limit)
        self._rest = np.zeros_like(self.actions[-1]) if action == "delta" else self.actions[-1]
        self.reset()

    def reset(self) -> None:
        """Start the motion anew at the next `predict`."""
        self._steps: FloatArray | None = None

    def predict(
        self,
        observation: ArrayLike,
        state: tuple[Any, ...] | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> tuple[FloatArray, tuple[Any, ...]]:
        """Return the next action.

        Parameters
        ----------
        observation : array-like, shape (n_observations,) or (n_envs, n_observations)
            Not used, but for the number of environments.
        state : tuple, optional
            What the last call has returned.
        episode_start : array-like of bool, shape (n_envs,), optional
            Which environments begin an episode.
        deterministic : bool
            A planned motion is; accepted for the interface's sake.

        Returns
        -------
        action : array, shape (n_links + 1,) or (n_envs, n_links + 1)
            In [-1, 1].
        state : tuple
            For the next call.
        """
        shape = _batch_shape(observation)
        steps = self._steps if state is None else np.asarray(state[0])
        if steps is None or np.shape(steps) != shape:
            steps = np.zeros(shape, dtype=np.int64)
        if episode_start is not None:
            steps = np.where(np.reshape(episode_start, shape), 0, steps)
        done = np.minimum(steps, len(self.actions) - 1)
        actions = np.where((steps < len(self.actions))[..., None], self.actions[done], self._rest)
        self._steps = steps + 1
        return actions, (self._steps,)


class PlanningPolicy:
    """Plan at the start of every episode, in the maze that it is in, and follow the motion.

    The expert of the environments whose mazes change. Where there is no plan it holds still. Motions are kept
    for mazes that come again.

    Parameters
    ----------
    env : gymnasium.Env, gymnasium.vector.VectorEnv or stable_baselines3 VecEnv
        From which the present maze and the arm are read.
    planner : str
        See `planners.plan`.

    Attributes
    ----------
    results : list of PlanningResult
        Of every maze that was planned in, in order.
    """

    def __init__(self, env: Any, planner: str = "auto") -> None:
        self.env, self.planner = env, planner
        self._resets_late = _resets_late(env)
        self._pending: NDArray[np.bool_] | None = None
        self.results: list[PlanningResult] = []
        self._known: dict[bytes, PlanningResult] = {}
        self._policies: dict[int, PlannedPolicy | None] = {}

    def predict(
        self,
        observation: Any,
        state: tuple[Any, ...] | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> tuple[FloatArray, None]:
        """Return the next action, as `PlannedPolicy.predict` does; it keeps count itself.

        Without `episode_start` the first call begins an episode, and later calls do not. Give it which
        episodes the last step has ended, also where Gymnasium's vectors then reset one step late.
        """
        shape = _batch_shape(observation)
        starts = np.zeros(shape, dtype=bool) if episode_start is None else np.reshape(episode_start, shape)
        if self._resets_late:
            # The action after an end only resets: the episode begins with the one after it.
            begun, starts = starts, np.ones(shape, dtype=bool) if self._pending is None else self._pending
            self._pending = np.zeros(shape, dtype=bool) if self._pending is None else begun
        actions = []
        for k, start in enumerate(np.atleast_1d(starts)):
            if start or k not in self._policies:
                self._policies[k] = self._plan(k)
            policy = self._policies[k]
            actions.append(self._rest(k) if policy is None else policy.predict(np.zeros(1))[0])
        return np.array(actions).reshape(*shape, -1), None

    def _plan(self, k: int) -> PlannedPolicy | None:
        maze, arm, action = (self._attribute(name, k) for name in ("maze", "arm", "action_mode"))
        key = maze_key(maze)
        if key not in self._known:
            self._known[key] = plan(maze, arm, planner=self.planner, explain=False)
            self.results.append(self._known[key])
        result = self._known[key]
        if result.motion is None:
            return None
        return PlannedPolicy(result.motion, action=action, joint_limit=arm.joint_limit)

    def _rest(self, k: int) -> FloatArray:
        arm, action = self._attribute("arm", k), self._attribute("action_mode", k)
        rest = np.zeros(1 + arm.n_links)
        if action == "absolute":
            rest[0] = -1.0
        return rest

    def _attribute(self, name: str, k: int) -> Any:
        if hasattr(self.env, "get_attr"):
            return self.env.get_attr(name)[k]
        return getattr(self.env.unwrapped, name)


def _resets_late(env: Any) -> bool:
    """Whether an environment is a vector that takes a step of its own for a reset, as Gymnasium's do."""
    if not isinstance(env, gym.vector.VectorEnv):
        return False
    mode = env.metadata.get("autoreset_mode")  # not there before Gymnasium 1.1, when all did
    return mode is None or getattr(mode, "name", mode) == "NEXT_STEP"


def _batch_shape(observation: Any) -> tuple[int, ...]:
    """Return () for one observation, (n_envs,) for a batch; dictionaries go by their vector."""
    if isinstance(observation, Mapping):
        observation = observation["observation"]
    shape: tuple[int, ...] = np.shape(observation)
    one = 1 if len(shape) <= 2 else 3  # a vector or a picture
    return shape[: len(shape) - one]
