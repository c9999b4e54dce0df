"""What a policy sees: the parts of an observation, its spaces, and the kernel that fills it."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrsnake_env.arguments import check_one_of
from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.physics import CONTROL_TIMESTEP
from hrsnake_env.sensing import N_TIP_RAYS

__all__ = [
    "AHEAD",
    "OBSERVATIONS",
    "observation_names",
    "observation_parts",
    "observation_space",
    "write_observation",
]

OBSERVATIONS = ("state", "goal", "image")
"""The modes: a vector, a dictionary with the goal for hindsight replay, a picture."""

AHEAD = (0.5, 1.0, 2.0)
"""How far ahead of the tip places on the way to the goal are seen, in link lengths."""


def observation_parts(n_links: int, *, goal: bool = True, rays: bool = False) -> dict[str, tuple[int, float]]:
    """Return the parts of the vector in order: name, length and lower bound; the upper bound is always 1.

    Parameters
    ----------
    n_links : int
        Of the arm.
    goal : bool
        Whether what depends on the goal is in it; the mode "goal" has the goal beside the vector.
    rays : bool
        Whether rays are in it.
    """
    parts = {
        "feed": (1, 0.0),
        "joint_angles": (n_links, -1.0),
        "target_errors": (1 + n_links, -1.0),
        "speeds": (1 + n_links, -1.0),
        "tip_position": (2, -1.0),
        "tip_heading": (2, -1.0),
        "clearances": (n_links, -1.0),
    }
    if goal:
        parts |= {"goal_offset": (2, -1.0), "goal_distance": (1, 0.0), "ahead": (2 * len(AHEAD), -1.0)}
    if rays:
        parts |= {"tip_rays": (N_TIP_RAYS, 0.0), "side_rays": (2 * n_links, 0.0)}
    return parts


def observation_names(n_links: int, *, goal: bool = True, rays: bool = False) -> tuple[str, ...]:
    """Return a name for every number of the vector.

    Examples
    --------
    >>> observation_names(2)[:5]
    ('feed', 'joint_angles[0]', 'joint_angles[1]', 'target_errors[0]', 'target_errors[1]')
    """
    parts = observation_parts(n_links, goal=goal, rays=rays)
    return tuple(
        f"{name}[{k}]" if length > 1 else name for name, (length, _) in parts.items() for k in range(length)
    )


def observation_space(mode: str, n_links: int, *, rays: bool, image_size: int) -> spaces.Space[Any]:
    """Return the space of an observation mode.

    Raises
    ------
    InputError
        If there is no such mode, or it has no rays.
    """
    check_one_of("observation", mode, OBSERVATIONS)
    if mode == "image":
        if rays:
            raise InputError("Expected rays=False with observation 'image', got True.")
        return spaces.Box(0, 255, (image_size, image_size, 3), np.uint8)
    parts = observation_parts(n_links, goal=mode == "state", rays=rays)
    low = np.concatenate([np.full(length, bound, dtype=np.float32) for length, bound in parts.values()])
    vector = spaces.Box(low, np.ones(len(low), dtype=np.float32), dtype=np.float32)
    if mode == "state":
        return vector
    place = spaces.Box(-1.0, 1.0, (2,), np.float32)
    return spaces.Dict({"observation": vector, "achieved_goal": place, "desired_goal": place})


@numba.njit(cache=True)
def write_observation(
    joint_angles: FloatArray,
    joint_speeds: FloatArray,
    clearances: FloatArray,
    readings: FloatArray,
    target: FloatArray,
    scales: FloatArray,
    base_pose: FloatArray,
    with_goal: bool,
    goal: FloatArray,
    goal_distance: float,
    ahead: FloatArray,
    rays: FloatArray,
    out: NDArray[np.float32],
) -> None:
    """Write the vector of `observation_parts`, scaled to [-1, 1] and cut there.

    Parameters
    ----------
    joint_angles, joint_speeds, clearances, readings : array
        See `hrsnake_env.sensing.Senses`.
    target : array, shape (1 + n_links,)
        Where feed and joint angles were last sent, in maze units and rad.
    scales : array, shape (4,)
        Link length, largest change of the feed's target in a step (maze units), of a joint's, and the joint
        limit (rad).
    base_pose : array, shape (3,)
        x, y and heading, in maze units and rad.
    with_goal : bool
        Whether to write what depends on the goal.
    goal : array, shape (2,)
        In maze units.
    goal_distance : float
        As a share of the longest there is to be expected.
    ahead : array, shape (n_ahead, 2)
        Places on the way to the goal, `AHEAD` link lengths from the tip, in maze units.
    rays : array, shape (n_rays,)
        Written as they are; of length 0 for none.
    out : array, shape (n_observations,), float32
        Written; all 0 if the simulation has broken down.
    """
    n_links = joint_angles.shape[0]
    link_length, feed_step, joint_step, joint_limit = scales[0], scales[1], scales[2], scales[3]
    reach = n_links * link_length
    feed, tip_x, tip_y, heading, feed_speed = readings[0], readings[1], readings[2], readings[3], readings[4]
    if not np.isfinite(readings.sum()):
        out[:] = 0.0
        return
    out[0] = feed / reach
    i = 1
    for k in range(n_links):
        out[i + k] = joint_angles[k] / joint_limit
    i += n_links
    out[i] = (target[0] - feed) / feed_step
    for k in range(n_links):
        out[i + 1 + k] = (target[1 + k] - joint_angles[k]) / joint_step
    i += 1 + n_links
    out[i] = feed_speed * CONTROL_TIMESTEP / feed_step
    for k in range(n_links):
        out[i + 1 + k] = joint_speeds[k] * CONTROL_TIMESTEP / joint_step
    i += 1 + n_links
    cos, sin = np.cos(heading), np.sin(heading)
    out[i], out[i + 1] = (tip_x - base_pose[0]) / reach, (tip_y - base_pose[1]) / reach
    out[i + 2], out[i + 3] = cos, sin
    i += 4
    for k in range(n_links):
        out[i + k] = clearances[k] / link_length
    i += n_links
    if with_goal:
        out[i], out[i + 1] = (goal[0] - tip_x) / reach, (goal[1] - tip_y) / reach
        out[i + 2] = goal_distance
        i += 3
        for k in range(ahead.shape[0]):
            dx, dy = ahead[k, 0] - tip_x, ahead[k, 1] - tip_y
            scale = AHEAD[k] * link_length
            out[i], out[i + 1] = (dx * cos + dy * sin) / scale, (dy * cos - dx * sin) / scale
            i += 2
    for k in range(rays.shape[0]):
        out[i + k] = rays[k]
    for k in range(out.shape[0]):
        out[k] = min(max(out[k], -1.0), 1.0)
    out[0] = max(out[0], 0.0)
