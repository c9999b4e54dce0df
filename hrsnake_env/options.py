"""The options of `reset`: where an episode starts, and in which maze."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.arguments import is_number, numbers
from hrsnake_env.arm import ArmSpec, FloatArray, feeder_angle_limits
from hrsnake_env.errors import InputError

__all__ = ["RESET_OPTIONS", "ResetOptions"]

RESET_OPTIONS = ("maze", "task_id", "goal", "feed", "joint_angles", "motion", "waypoint", "state")

ROUNDING = 1e-6
"""In rad and link lengths: by so much a start may miss what an arm can do, as planned poses are rounded."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ResetOptions:
    """Hold checked reset options; None stands for the default.

    Parameters
    ----------
    maze : Maze, str or path, optional
        Another maze than the environment was made with, for the same arm.
    task_id : int, optional
        Which of the random mazes.
    goal : array, shape (2,), optional
        Another goal, in maze units.
    feed : float
        In maze units.
    joint_angles : array, shape (n_links,)
        In rad.
    state : object, optional
        From `HyperRedundantMazeEnv.get_state`.
    """

    maze: Any = None
    task_id: int | None = None
    goal: FloatArray | None = None
    feed: float = 0.0
    joint_angles: FloatArray
    state: Any = None

    @classmethod
    def parse(cls, options: Mapping[str, Any] | None, arm: ArmSpec) -> ResetOptions:
        """Check the options of a reset.

        Raises
        ------
        InputError
            If an option is unknown, contradicts another, or an arm cannot be so.
        """
        if not (options is None or isinstance(options, Mapping)):
            raise InputError(f"Expected reset options by name, got {options!r}.")
        given = {key: value for key, value in (options or {}).items() if value is not None}
        for key in given:
            if key not in RESET_OPTIONS:
                raise InputError(f"Unknown reset option {key!r}. Available: {', '.join(RESET_OPTIONS)}.")
        _refuse_both(given, "state", *RESET_OPTIONS[:-1])
        _refuse_both(given, "maze", "task_id")
        _refuse_both(given, "motion", "feed", "joint_angles")
        for key, needed in (("waypoint", "motion"), ("joint_angles", "feed")):
            if key in given and needed not in given:
                raise InputError(f"Expected reset option {needed!r} with {key!r}, got none.")
        feed, angles = _start(given, int(arm.n_links or 0))
        _check_start(feed, angles, arm)
        return cls(
            maze=given.get("maze"),
            task_id=_whole(given.get("task_id"), "task_id"),
            goal=_goal(given.get("goal")),
            feed=feed,
            joint_angles=angles,
            state=given.get("state"),
        )


def _refuse_both(given: Mapping[str, Any], key: str, *others: str) -> None:
    for other in others:
        if key in given and other in given:
            raise InputError(f"Expected one of the reset options {key!r} and {other!r}, got both.")


def _whole(value: Any, key: str) -> int | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 0:
        raise InputError(f"Expected {key} to be a whole number of at least 0, got {value!r}.")
    return int(value)


def _goal(value: Any) -> FloatArray | None:
    if value is None:
        return None
    goal = numbers("a goal", value)
    if goal.shape != (2,):
        raise InputError(f"Expected a goal with shape (2,), got {goal.shape}.")
    return goal


def _start(given: Mapping[str, Any], n_links: int) -> tuple[float, FloatArray]:
    """Return feed and joint angles that are asked for."""
    if "motion" not in given:
        feed, angles = given.get("feed", 0.0), given.get("joint_angles", np.zeros(n_links))
        if not is_number(feed):
            raise InputError(f"Expected a feed in numbers, got {feed!r}.")
        return float(numbers("a feed", feed)), numbers("joint_angles", angles)
    motion = given["motion"]
    if not (hasattr(motion, "feed") and hasattr(motion, "joint_angles")):
        raise InputError(f"Expected a motion with feed and joint_angles, got {motion!r}.")
    feeds = numbers("a motion's feed", motion.feed)
    waypoint = _whole(given.get("waypoint", 0), "waypoint") or 0
    if feeds.ndim != 1 or waypoint >= len(feeds):
        raise InputError(f"Expected a waypoint below {feeds.size}, got {waypoint}.")
    return float(feeds[waypoint]), numbers("a motion's joint_angles", motion.joint_angles[waypoint])


def _check_start(feed: float, angles: FloatArray, arm: ArmSpec) -> None:
    n_links, length = int(arm.n_links or 0), arm.link_length
    if angles.shape != (n_links,):
        raise InputError(f"Expected joint_angles with shape ({n_links},), got {angles.shape}.")
    if not (np.isfinite(feed) and np.isfinite(angles).all()):
        raise InputError("Expected a finite feed and finite joint_angles, got NaN or infinity.")
    reach = n_links * length
    if not (-ROUNDING * length <= feed <= reach + ROUNDING * length):
        raise InputError(f"Expected a feed from 0 to {reach:g}, got {feed:g}.")
    limits = feeder_angle_limits(feed, n_links, length)
    if arm.joint_limit is not None:
        limits = np.minimum(limits, arm.joint_limit)
    over = np.abs(angles) - limits
    worst = int(np.argmax(over))
    if over[worst] > ROUNDING:
        raise InputError(
            f"Expected joint {worst} within {limits[worst]:g} rad, which feeder and joint limit leave it at "
            f"feed {feed:g}, got {angles[worst]:g}."
        )
