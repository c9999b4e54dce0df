"""A motion as a policy: `predict(observation) -> action`, as stable-baselines3 has it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray
from hrsnake_env.task import FEED_STEP, JOINT_STEP
from planners.problem import Motion

__all__ = ["PlannedPolicy", "actions_of"]


def actions_of(motion: Motion, feed_step: float = FEED_STEP, joint_step: float = JOINT_STEP) -> FloatArray:
    """Compute the actions that drive the environment along a motion.

    Parameters
    ----------
    motion : Motion
        A motion from the feeder.
    feed_step : float
        Feed of an action of 1, in link lengths.
    joint_step : float
        Change of a joint's target by an action of 1, in rad.

    Returns
    -------
    actions : array, shape (n_steps, n_links + 1)
        Each in [-1, 1]: feed, then the joints from the base end. A pose that is farther than one action from
        the last takes several equal ones.
    """
    changes = np.column_stack(
        [
            np.diff(motion.feed) / (feed_step * motion.link_length),
            np.diff(motion.joint_angles, axis=0) / joint_step,
        ]
    )
    parts = np.maximum(np.ceil(np.abs(changes).max(axis=1) - 1e-9), 1.0).astype(int)
    return np.repeat(changes / parts[:, None], parts, axis=0)


class PlannedPolicy:
    """Follow a planned motion from the feeder to the goal, whatever is observed, and then hold still.

    It goes where a trained policy goes, into `stable_baselines3.common.evaluation.evaluate_policy` too. The
    state that `predict` returns is the number of steps taken; a caller that does not hand it back gets the
    policy's own count, which `episode_start` or `reset` sets to 0.

    Parameters
    ----------
    motion : Motion
        A motion from the feeder.
    feed_step, joint_step : float
        What an action of 1 means in the environment; see `actions_of`.
    """

    def __init__(self, motion: Motion, feed_step: float = FEED_STEP, joint_step: float = JOINT_STEP) -> None:
        self.actions = actions_of(motion, feed_step, joint_step)
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
        shape = np.shape(observation)[:-1]
        steps = self._steps if state is None else np.asarray(state[0])
        if steps is None or np.shape(steps) != shape:
            steps = np.zeros(shape, dtype=np.int64)
        if episode_start is not None:
            steps = np.where(np.reshape(episode_start, shape), 0, steps)
        done = np.minimum(steps, len(self.actions) - 1)
        actions = np.where((steps < len(self.actions))[..., None], self.actions[done], 0.0)
        self._steps = steps + 1
        return actions, (self._steps,)
