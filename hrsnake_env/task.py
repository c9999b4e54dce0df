"""The task: reach the goal with the tip, and collide with nothing. Pure functions and kernels."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray
from hrsnake_env.dynamics import largest_distance, place_joints, step_targets

__all__ = [
    "ACTIONS",
    "CONTACT_PENALTY",
    "FEED_STEP",
    "GOAL_BONUS",
    "JAM_DRIFT",
    "JAM_NODE_ERROR",
    "JOINT_STEP",
    "LARGEST_PROGRESS",
    "LARGEST_STEP",
    "REWARDS",
    "SPARSE_GOAL_REWARD",
    "goal_reward_terms",
    "next_target",
    "reward_terms",
]

ACTIONS = ("delta", "absolute")
REWARDS = ("dense", "sparse")

FEED_STEP = 0.02
"""Largest change of the feed's target in one step, in link lengths."""

JOINT_STEP = 0.05
"""Largest change of a joint's target in one step, in rad."""

LARGEST_STEP = 0.05
"""Largest movement of any joint's place in one step, in link lengths: many joints together move a tip far."""

GOAL_BONUS = 10.0
SPARSE_GOAL_REWARD = 1.0
CONTACT_PENALTY = 0.2
"""Of a step in which a link went deeper into something than the pinch tolerance, unless told otherwise."""

LARGEST_PROGRESS = 2.0 * LARGEST_STEP
"""Bound of the progress reward of a step, in link lengths; only an arm that walls throw about reaches it."""

JAM_NODE_ERROR = 0.1
JAM_DRIFT = 0.02
"""In link lengths: an arm that is so far from where it belongs, or torn so far apart, is jammed."""


def reward_terms(
    reward_type: str, *, progress: float, collided: bool, succeeded: bool, contact_penalty: float
) -> dict[str, float]:
    """Return the terms of the reward by name; the reward is their sum.

    Parameters
    ----------
    reward_type : {"dense", "sparse"}
        Sparse has no progress.
    progress : float
        By how much the geodesic distance from the tip to the goal has decreased, in link lengths. As a
        difference of a potential it leaves the best policy what it is.
    collided : bool
        Whether a link went deeper into something than the pinch tolerance.
    succeeded : bool
        Whether the episode has ended in success.
    contact_penalty : float
        At least 0.
    """
    dense = reward_type == "dense"
    bonus = GOAL_BONUS if dense else SPARSE_GOAL_REWARD
    return {
        "reward_progress": min(max(progress, -LARGEST_PROGRESS), LARGEST_PROGRESS) if dense else 0.0,
        "reward_contact": -contact_penalty if collided else 0.0,
        "reward_goal": bonus if succeeded else 0.0,
    }


def goal_reward_terms(
    reward_type: str,
    *,
    distance: FloatArray,
    goal_radius: float,
    collided: NDArray[np.bool_],
    contact_penalty: float,
) -> dict[str, Any]:
    """Return the terms of the reward of the mode "goal": functions of where the tip is and should be.

    Parameters
    ----------
    reward_type : {"dense", "sparse"}
        Dense is minus the straight distance; sparse has none of it.
    distance : array, shape (...)
        From the tip to the goal, as a share of the arm's length.
    goal_radius : float
        As a share of the arm's length.
    collided : array of bool, shape (...)
        Whether a link went deeper into something than the pinch tolerance.
    contact_penalty : float
        At least 0.
    """
    return {
        "reward_progress": -distance if reward_type == "dense" else np.zeros_like(distance),
        "reward_contact": np.where(collided, -contact_penalty, 0.0),
        "reward_goal": np.where(distance <= goal_radius, SPARSE_GOAL_REWARD, 0.0),
    }


@numba.njit(cache=True)
def next_target(
    target: FloatArray,
    action: FloatArray,
    absolute: bool,
    link_length: float,
    joint_limit: float,
    wanted: FloatArray,
) -> int:
    """Compute the target after an action, scaled down until no joint's place moves too far.

    Parameters
    ----------
    target : array, shape (1 + n_links,)
        Feed and joint angles to start from, in maze units and rad.
    action : array, shape (1 + n_links,)
        Cut to [-1, 1].
    absolute : bool
        Whether actions are targets to go to (of the feed from -1, none, to 1, all; of the joints in shares of
        `joint_limit`) and not changes (in shares of the largest ones).
    link_length, joint_limit : float
        In maze units and rad.
    wanted : array, shape (1 + n_links,)
        Written; joints in the feeder are straight.

    Returns
    -------
    bad : int
        Index of the first number of the action that is not finite; -1 if there is none.
    """
    n = target.shape[0]
    reach, feed_step = (n - 1) * link_length, FEED_STEP * link_length
    change, row = np.empty(n), np.empty((1, n))
    before, after = np.empty((n, 2)), np.empty((n, 2))
    place_joints(target, link_length, before)
    for k in range(n):
        if not math.isfinite(action[k]):
            return k
        value, step = min(max(action[k], -1.0), 1.0), feed_step if k == 0 else JOINT_STEP
        if absolute:
            place = 0.5 * (value + 1.0) * reach if k == 0 else value * joint_limit
            change[k] = min(max(place - target[k], -step), step)
        else:
            change[k] = value * step
    largest = LARGEST_STEP * link_length
    for _ in range(20):
        wanted[0] = min(max(target[0] + change[0], 0.0), reach)
        for k in range(1, n):
            wanted[k] = min(max(target[k] + change[k], -joint_limit), joint_limit)
        step_targets(target, wanted, link_length, row)  # straight in the feeder
        wanted[:] = row[0]
        place_joints(wanted, link_length, after)
        move = largest_distance(before, after)
        if move <= largest * (1.0 + 1e-6):
            return -1
        change *= 0.99 * largest / move  # a little less, as the way is not quite in proportion
    wanted[:] = target
    return -1
