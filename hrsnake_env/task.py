"""The task: reach the goal with the tip, and collide with nothing. Pure functions of the simulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray
from hrsnake_env.physics import CONTROL_TIMESTEP, Physics

__all__ = [
    "COLLISION_PENALTY",
    "FEED_STEP",
    "GOAL_BONUS",
    "JOINT_STEP",
    "LARGEST_STEP",
    "StepOutcome",
    "is_jammed",
    "observation",
    "observation_parts",
    "observation_space",
    "reward_terms",
]

FEED_STEP = 0.02
"""Largest change of the feed's target in one step, in link lengths."""

JOINT_STEP = 0.05
"""Largest change of a joint's target in one step, in rad."""

LARGEST_STEP = 0.05
"""Largest movement of any joint's place in one step, in link lengths: many joints together move a tip far."""

GOAL_BONUS = 10.0
COLLISION_PENALTY = 1.0

JAM_NODE_ERROR = 0.05
JAM_DRIFT = 0.01
"""In link lengths: an arm that is so far from where it belongs, or torn so far apart, is jammed."""


def observation_parts(n_links: int) -> dict[str, tuple[int, float]]:
    """Return the observation's parts in order: name, length and lower bound; the upper bound is always 1."""
    return {
        "feed": (1, 0.0),
        "joint_angles": (n_links, -1.0),
        "target_errors": (1 + n_links, -1.0),
        "speeds": (1 + n_links, -1.0),
        "goal_offset": (2, -1.0),
        "tip_heading": (2, -1.0),
        "goal_distance": (1, 0.0),
        "clearances": (n_links, -1.0),
    }


def observation_space(n_links: int) -> spaces.Box:
    """Return the space of `observation`."""
    low = np.concatenate([np.full(length, bound) for length, bound in observation_parts(n_links).values()])
    return spaces.Box(low.astype(np.float32), np.ones(len(low), dtype=np.float32), dtype=np.float32)


def observation(physics: Physics, target: FloatArray, goal_distance: float) -> NDArray[np.float32]:
    """Return what a policy sees, scaled to [-1, 1] and cut there.

    Parameters
    ----------
    physics : Physics
        The simulator.
    target : array, shape (1 + n_links,)
        Where feed and joint angles were last sent, in maze units and rad.
    goal_distance : float
        Geodesic distance from the tip to the goal, as a share of the longest there is to be expected.

    Returns
    -------
    observation : array, shape (4 * n_links + 8,)
        Its parts are those of `observation_parts`; all 0 if the simulation has broken down.
    """
    if not physics.finite:
        return np.zeros(4 * physics.n_links + 8, dtype=np.float32)
    length, maze = physics.link_length, physics.maze
    feed, angles, heading = physics.feed, physics.joint_angles, physics.tip_heading
    feed_step = FEED_STEP * length
    values = np.concatenate(
        [
            [max(feed / (physics.n_links * length), 0.0)],
            angles / np.pi,
            [(target[0] - feed) / feed_step],
            (target[1:] - angles) / JOINT_STEP,
            [physics.feed_speed * CONTROL_TIMESTEP / feed_step],
            physics.joint_speeds * (CONTROL_TIMESTEP / JOINT_STEP),
            (maze.goal - physics.tip_position) / maze.size,
            [np.cos(heading), np.sin(heading)],
            [goal_distance],
            physics.clearance / length,
        ]
    )
    seen: NDArray[np.float32] = np.clip(values, -1.0, 1.0).astype(np.float32)
    return seen


@dataclass(frozen=True, kw_only=True)
class StepOutcome:
    """Hold what a step has come to.

    Parameters
    ----------
    progress : float
        By how much the geodesic distance from the tip to the goal has decreased, in link lengths.
    collided : bool
        Whether a link went deeper into something than the pinch tolerance.
    succeeded : bool
        Whether the tip has come within the goal's radius, with the arm whole.
    """

    progress: float
    collided: bool
    succeeded: bool


def reward_terms(outcome: StepOutcome) -> dict[str, float]:
    """Return the terms of the reward by name; the reward is their sum."""
    return {
        "reward_progress": outcome.progress,
        "reward_collision": -COLLISION_PENALTY if outcome.collided else 0.0,
        "reward_goal": GOAL_BONUS if outcome.succeeded else 0.0,
    }


def is_jammed(physics: Physics) -> bool:
    """Whether the arm is so far from where it belongs that the simulation means nothing any more."""
    return (
        not physics.finite
        or physics.node_error > JAM_NODE_ERROR * physics.link_length
        or physics.drift > JAM_DRIFT * physics.link_length
    )
