"""A planner as a teacher: its actions lead an arm that has strayed back to the planned motion."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import shapely
from numpy.typing import NDArray

from hrsnake_env.arm import ArmSpec, FloatArray, joints_from_configuration
from hrsnake_env.errors import InputError
from hrsnake_env.task import FEED_STEP, JOINT_STEP, next_target
from planners.controllers import actions_of
from planners.motion_cache import MARGINS, MotionCache

__all__ = ["Demonstrator"]

KEPT = 0.005
"""So near to a wall noise does not take a link, in link lengths: links in haste stray.

Of 80 episodes in tight mazes with noise of 0.6 and 1, 17 fail with 0.002, 9 with this, 7 with 0.01; but the
farther off, the less noise is left there.
"""

AHEAD = 20
"""So many steps of the motion ahead are looked at for the one that is nearest."""

LEAST = 0.1
"""Noise that would still collide at this share of it is left out of the step."""


class Demonstrator:
    """Drive the arm of an environment along a planned motion, with or without noise in the actions.

    The loop is closed: every action goes from where the arm has been sent to the pose after the nearest one
    of the motion, so errors do not add up. The motion keeps a distance from the walls where there is room
    (`planners.motion_cache.MARGINS`). Noise that would take a link into a wall is halved until it does not, so demonstrations in
    tight mazes mostly reach the goal, too.

    Parameters
    ----------
    env : gymnasium.Env
        An environment of this project with `action="delta"`, wrapped or not.
    planner : str
        See `planners.plan`.

    Raises
    ------
    InputError
        If the environment's actions are absolute, or the planner is unknown.
    """

    def __init__(self, env: gym.Env[Any, Any], planner: str = "auto") -> None:
        self.env = env
        action_mode: str = self._world.action_mode
        if action_mode != "delta":
            raise InputError(f"Expected an environment with action='delta', got {action_mode!r}.")
        self._motions = MotionCache(planner, MARGINS)
        arm: ArmSpec = self._world.arm
        self._steps = np.array([FEED_STEP * arm.link_length, *[JOINT_STEP] * int(arm.n_links or 0)])
        self._poses, self._nearest, self._room = np.zeros((1, len(self._steps))), 0, shapely.Polygon()
        self._next = np.zeros(len(self._steps))

    @property
    def _world(self) -> Any:
        return self.env.unwrapped

    def begin(self) -> bool:
        """Plan in the maze that the environment has been reset to; return whether there is a plan."""
        maze, arm = self._world.maze, self._world.arm
        motion = self._motions.motion(maze, arm)
        if motion is None:
            return False
        actions = actions_of(motion)
        self._poses = np.concatenate([np.zeros((1, actions.shape[1])), np.cumsum(actions, axis=0)])
        self._nearest = 0
        self._room = maze.free_space.buffer(-arm.link_radius - KEPT * arm.link_length, join_style="mitre")
        shapely.prepare(self._room)
        return True

    def action(self) -> NDArray[np.float32]:
        """Return the action that leads the arm along the motion from where it has been sent, in [-1, 1]."""
        place = self._world.target / self._steps
        ahead = self._poses[self._nearest : self._nearest + AHEAD]
        self._nearest += int(np.argmin(((ahead - place) ** 2).sum(axis=1)))
        change = self._poses[min(self._nearest + 1, len(self._poses) - 1)] - place
        return np.asarray(change / max(1.0, float(np.abs(change).max())), dtype=np.float32)

    def noisy(self, action: NDArray[np.float32], noise: FloatArray) -> NDArray[np.float32]:
        """Return an action with noise, cut to [-1, 1]; with less noise where it would meet a wall.

        Parameters
        ----------
        action, noise : array, shape (n_links + 1,)
            Noise in shares of the largest action.
        """
        share = 1.0
        while share >= LEAST and noise.any():
            tried = np.asarray(np.clip(action + share * noise, -1.0, 1.0), dtype=np.float32)
            if self._clear(tried):
                return tried
            share /= 2.0
        return action

    def _clear(self, action: NDArray[np.float32]) -> bool:
        """Return whether an action leaves all links at a distance from the walls."""
        arm, base_pose, target = self._world.arm, self._world.maze.base_pose, self._world.target
        limit = np.pi if arm.joint_limit is None else arm.joint_limit
        next_target(target, action.astype(np.float64), False, arm.link_length, limit, self._next)
        joints = joints_from_configuration(self._next[0], self._next[1:], arm.link_length, base_pose)
        out = self._next[0] > arm.link_length * np.arange(arm.n_links, -1, -1)
        return not out.any() or bool(
            self._room.covers(shapely.LineString(np.concatenate([base_pose[None, :2], joints[out]])))
        )
