"""Wrappers that let a learner profit from the planners: where episodes start, and what an action adds to."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from hrsnake_env.arguments import check_at_least, is_number
from hrsnake_env.arm import ArmSpec, FloatArray, feeder_angle_limits
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.task import FEED_STEP, JOINT_STEP
from planners.baselines.path_following import STOP, followed_track
from planners.feeding import feed, motion_of
from planners.motion_cache import MARGINS, N_MAZES, MotionCache, maze_key
from planners.problem import Motion
from planners.query import Query

__all__ = ["ActionRepeat", "PlannedResets", "ResidualFollower", "StepCost", "follow_the_leader"]

AT_BASE = -1

START_OPTIONS = ("feed", "joint_angles", "motion", "waypoint", "state")
"""Reset options that say where the arm starts."""

OWN_STREAM = 1
"""Random numbers of this stream have nothing in common with those of an environment of the same seed."""

AT_GOAL = 1e-6
"""By so much of the goal's radius a start must be outside it, as simulated places are rounded."""

LAST_PART = 0.03
"""Starts that recede begin in this last part of the motion, and then in parts of this length. In tight mazes
a learner that knows nothing yet must succeed from there before it collides."""

PART_STARTS = 0.6
"""Share of the starts on the motion that are in the part to be learnt; the others are anywhere after it."""

PART_EPISODES, LEARNT, LOST = 8, 0.7, 0.1
"""After so many episodes from a part, starts recede if this share succeeded, and come back if only that."""

RECEDE = 0.03
"""By this share of the motion starts recede; they come back by a third of it."""

REPEAT = 4
"""Steps to a decision by default."""

SLOWEST = 0.01
"""The feed never waits with less than this share of its step."""


class PlannedResets(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Let most episodes start somewhere along a planned motion, and the others at the base.

    Learners that always start at the base stay at half the way in tight U-turns. With `recede` PPO comes
    through at I = 0.6 and 0.8 within minutes (docs/comparison.md); with even draws it did not when tried.

    A start is a waypoint of the motion, drawn uniformly from those with the tip outside the goal's radius. In
    tight mazes learners need them in order: with `recede`, starts are near the goal at first, and recede from
    it along the motion as fast as the learner succeeds from where they are (reverse curriculum, also known as
    backplay). The motions keep a distance from the walls where there is room for it. Where there is no plan,
    episodes start at the base. A reset whose options say where to start (`feed`, `joint_angles`, `motion`,
    `waypoint` or `state`) is passed on as it is. The draws are the wrapper's own, and repeat with the seed of
    `reset`.

    `info["waypoint"]`, there from the reset on, is the waypoint that the episode started at; -1 if the
    wrapper has not chosen one, as at the base. `info["receded"]` is the share of the motion that starts have
    left, from the goal; 1 where all of it is drawn from.

    Parameters
    ----------
    env : gymnasium.Env
        An environment of this project, wrapped or not.
    motion : Motion, optional
        Of the environment's present maze, and valid there; all other mazes are planned for.
    share : float
        Of the episodes that start on the motion, from 0 to 1.
    planner : str
        See `planners.plan`.
    recede : bool
        Whether starts recede from the goal.

    Raises
    ------
    InputError
        If the motion is of another arm or maze, the share is out of its range, or the planner is unknown.
    """

    def __init__(
        self,
        env: gym.Env[Any, Any],
        motion: Motion | None = None,
        *,
        share: float = 0.7,
        planner: str = "auto",
        recede: bool = False,
    ) -> None:
        RecordConstructorArgs.__init__(self, motion=motion, share=share, planner=planner, recede=recede)
        gym.Wrapper.__init__(self, env)
        if not (is_number(share) and 0.0 <= share <= 1.0):
            raise InputError(f"Expected a share from 0 to 1, got {share!r}.")
        self.share, self._motions = float(share), MotionCache(planner, MARGINS)
        self._receding = _Receding() if recede else None
        if motion is not None:
            self._motions.add(motion, self._world.maze, self._world.arm)
        self._rng = np.random.default_rng()
        self._waypoint = AT_BASE

    @property
    def _world(self) -> Any:
        return self.env.unwrapped

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode, on the motion or at the base; see `HyperRedundantMazeEnv.reset`."""
        if seed is not None:
            self._rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(OWN_STREAM,)))
        share, place, part = self._rng.random(3)  # always all, so that no draw depends on an earlier plan
        observation, info = self.env.reset(seed=seed, options=options)
        self._waypoint = AT_BASE
        if self._receding is not None:
            place = self._receding.place(place, part)
        given = {key: value for key, value in (options or {}).items() if value is not None}
        if share < self.share and not any(key in given for key in START_OPTIONS):
            # Only now the maze is known. It is kept: what was drawn at random is asked for by its number.
            start = self._start(place)
            if start:
                task = {"task_id": info["task_id"]} if info["task_id"] >= 0 else {}
                observation, info = self.env.reset(options={**given, **task, **start})
                self._waypoint = start["waypoint"]
        return observation, {**info, **self._told()}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Take a step; its info says where the episode has started."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        if (terminated or truncated) and self._receding is not None and self._waypoint != AT_BASE:
            self._receding.ended(bool(info["is_success"]))
        return observation, reward, terminated, truncated, {**info, **self._told()}

    def _told(self) -> dict[str, Any]:
        receded = 1.0 if self._receding is None else 1.0 - self._receding.front
        return {"waypoint": self._waypoint, "receded": receded}

    def _start(self, place: float) -> dict[str, Any]:
        """Return reset options for the waypoint at a place in [0, 1) among those to draw from."""
        maze = self._world.maze
        motion = self._motions.motion(maze, self._world.arm)
        if motion is None:
            return {}
        away = np.hypot(*(motion.joints[:, -1] - maze.goal).T) > (1.0 + AT_GOAL) * maze.goal_radius
        waypoints = np.flatnonzero(away)
        return {"motion": motion, "waypoint": int(waypoints[int(place * len(waypoints))])}


class _Receding:
    """Say where along a motion episodes start, farther from the goal the more of them succeed."""

    def __init__(self) -> None:
        self.front = 1.0 - LAST_PART
        self._in_part = False
        self._successes: list[bool] = []

    def place(self, place: float, part: float) -> float:
        """Return a place in [0, 1) along the motion for two numbers drawn from there."""
        self._in_part = part < PART_STARTS
        return self.front + place * (LAST_PART if self._in_part else 1.0 - self.front)

    def ended(self, success: bool) -> None:
        """Take note of how an episode has ended that started on the motion."""
        if not self._in_part:
            return
        self._successes.append(success)
        if len(self._successes) < PART_EPISODES:
            return
        rate = sum(self._successes[-PART_EPISODES:]) / PART_EPISODES
        if rate >= LEARNT or rate <= LOST:
            back = -RECEDE if rate >= LEARNT else RECEDE / 3.0
            self.front = min(max(self.front + back, 0.0), 1.0 - LAST_PART)
            self._successes = []


class ActionRepeat(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Take every action several times, so that a learner decides less often; rewards add up.

    Measured: links move by a fiftieth of their length in a step, and learners that decide in each one lose
    sight of a goal hundreds of steps away; with four to eight steps to a decision they learn in a fraction of
    the time.

    Parameters
    ----------
    env : gymnasium.Env
        Any environment.
    repeat : int
        Steps to a decision, at least 1.

    Raises
    ------
    InputError
        If `repeat` is not a positive whole number.
    """

    def __init__(self, env: gym.Env[Any, Any], repeat: int = REPEAT) -> None:
        RecordConstructorArgs.__init__(self, repeat=repeat)
        gym.Wrapper.__init__(self, env)
        check_at_least("repeat", repeat, 1, whole=True)
        self.repeat = int(repeat)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Take up to `repeat` steps; fewer where the episode ends."""
        total = 0.0
        for _ in range(self.repeat):
            observation, reward, terminated, truncated, info = self.env.step(action)
            total += float(reward)
            if terminated or truncated:
                break
        return observation, total, terminated, truncated, info


class StepCost(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Take a cost off the reward of every step, and off `compute_reward` alike.

    Measured: with hindsight replay and a reward for success alone, a learner stays where it is: there it
    is at a replayed goal again and again, which pays more than a success that ends the episode once. With
    a cost of 1 both are worth 0, the most there is. Collisions must cost more then, such as
    `contact_penalty=10`, or the learner ends the cost by one.

    Parameters
    ----------
    env : gymnasium.Env
        Any environment, wrapped or not.
    cost : float
        Of a step; at least 0.

    Raises
    ------
    InputError
        If the cost is not a finite number from 0 on.
    """

    def __init__(self, env: gym.Env[Any, Any], cost: float = 1.0) -> None:
        RecordConstructorArgs.__init__(self, cost=cost)
        gym.Wrapper.__init__(self, env)
        check_at_least("cost", cost, 0.0)
        self.cost = float(cost)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take a step; its reward is less by the cost."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, float(reward) - self.cost, terminated, truncated, info

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the rewards of replayed goals, less by the cost; see `HyperRedundantMazeEnv.goal_reward`."""
        rewards = self.env.get_wrapper_attr("compute_reward")(achieved_goal, desired_goal, info)
        return np.subtract(rewards, self.cost)


class ResidualFollower(gym.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Let an action be a small correction of follow-the-leader.

    Follow-the-leader keeps all joints on the path to the goal (`follow_the_leader`). An action is in [-1, 1]:
    its first number says how fast to feed, in 0.02 link lengths a step; the others are angles to add to the
    follower's at that feed, in shares of `scale`. So (1, 0, ..., 0) is the follower itself. Where joints
    cannot turn that fast, the feed waits for them.

    Both modes of the environment, `action="delta"` and `action="absolute"`, are driven alike.

    Parameters
    ----------
    env : gymnasium.Env
        An environment of this project, wrapped or not.
    scale : float
        Largest angle that an action adds, in rad; positive.

    Raises
    ------
    InputError
        If the scale is not a positive, finite number.
    """

    def __init__(self, env: gym.Env[Any, Any], *, scale: float = 0.2) -> None:
        RecordConstructorArgs.__init__(self, scale=scale)
        gym.Wrapper.__init__(self, env)
        if not (is_number(scale) and 0.0 < scale < np.inf):
            raise InputError(f"Expected a positive, finite scale in rad, got {scale!r}.")
        self.scale = float(scale)
        self._followers: OrderedDict[bytes, tuple[FloatArray, FloatArray]] = OrderedDict()
        self._feeds, self._angles = np.zeros(1), np.zeros((1, self._world.arm.n_links))

    @property
    def _world(self) -> Any:
        return self.env.unwrapped

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; see `HyperRedundantMazeEnv.reset`."""
        observation, info = self.env.reset(seed=seed, options=options)
        maze, arm = self._world.maze, self._world.arm
        key = maze_key(maze)
        if key not in self._followers:
            self._followers[key] = follow_the_leader(maze, arm)
            if len(self._followers) > N_MAZES:
                self._followers.popitem(last=False)
        self._feeds, self._angles = self._followers[key]
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Take a step.

        Raises
        ------
        InputError
            If the action has another shape, or is not finite; nothing has happened then.
        """
        return self.env.step(self.driven(action))

    def driven(self, action: Any) -> NDArray[np.float32]:
        """Return what the environment is told at present, for an action of this wrapper.

        Raises
        ------
        InputError
            If the action has another shape, or is not finite.
        """
        values, target = np.asarray(action, dtype=np.float64), self._world.target
        if values.shape != target.shape or not np.isfinite(values).all():
            raise InputError(f"Expected a finite action with shape {target.shape}, got {action!r}.")
        values = np.clip(values, -1.0, 1.0)
        arm, share = self._world.arm, 1.0
        steps = np.array([FEED_STEP * arm.link_length, *[JOINT_STEP] * arm.n_links])
        while True:
            change = self._wanted(values, share * values[0] * steps[0], target) - target
            if share < SLOWEST or np.abs(change[1:]).max() <= JOINT_STEP:
                break
            share /= 2.0
        change = np.clip(change, -steps, steps)
        if self._world.action_mode == "delta":
            return np.asarray(change / steps, dtype=np.float32)
        limit = np.pi if arm.joint_limit is None else arm.joint_limit
        wanted, reach = target + change, arm.n_links * arm.link_length
        driven = np.array([2.0 * wanted[0] / reach - 1.0, *(wanted[1:] / limit)])
        return np.asarray(np.clip(driven, -1.0, 1.0), dtype=np.float32)

    def _wanted(self, action: FloatArray, advance: float, target: FloatArray) -> FloatArray:
        """Return the feed after an advance, and the follower's angles there with the action's added."""
        arm = self._world.arm
        place = min(max(target[0] + advance, 0.0), arm.n_links * arm.link_length)
        follower = [np.interp(place, self._feeds, column) for column in self._angles.T]
        # Joints that the feeder holds straight would only make the feed wait for them.
        limits = feeder_angle_limits(place, arm.n_links, arm.link_length)
        if arm.joint_limit is not None:
            limits = np.minimum(limits, arm.joint_limit)
        return np.array([place, *np.clip(follower + self.scale * action[1:], -limits, limits)])


def follow_the_leader(maze: Maze, arm: ArmSpec) -> tuple[FloatArray, FloatArray]:
    """Return feed and joint angles of an arm whose joints stay on the path, whatever the walls.

    The motion of the planner "follow" before its check, and as far as it goes where a joint would have to
    jump or to go back.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        The arm, with its number of links.

    Returns
    -------
    feeds : array, shape (n_poses,)
        In maze units; does not decrease.
    joint_angles : array, shape (n_poses, n_links)
        In rad.
    """
    n_links, geometry = int(arm.n_links or 0), Query(maze=maze, arm=arm).geometry
    if geometry is None:
        return np.zeros(1), np.zeros((1, n_links))
    track = followed_track(
        geometry.path.points, arm.link_length, maze.base_pose, maze.goal, STOP * maze.goal_radius
    )
    motion = motion_of(feed(track, arm.link_length, maze.base_pose).poses, arm.link_length, maze.base_pose)
    back = np.diff(motion.feed) < 0.0
    end = int(np.argmax(back)) + 1 if back.any() else motion.n_poses
    spare = n_links - motion.n_links
    angles = motion.joint_angles[:end]
    # Links are counted from the base: an arm with more of them keeps some in the feeder, one with fewer ends.
    return motion.feed[:end], np.pad(angles, ((0, 0), (max(spare, 0), 0)))[:, -n_links:]
