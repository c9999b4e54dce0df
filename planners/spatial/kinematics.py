"""The arm in space: the map between its configuration and its joint positions.

The configuration is the feed and two angles per joint. Every link carries a frame whose x axis is the link.
A joint bends its link by ``joint_angles[k] = (a, b)``: a towards the y axis of the link behind, b towards its
z axis, hypot(a, b) in all. As a rotation vector that is (0, -b, a) in the frame of the link behind: it turns
the frame without twist and has no singular place short of a full reversal. In the plane a is the joint angle
of the planar arm, counter-clockwise positive.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError

__all__ = [
    "base_frame",
    "configuration_from_joints",
    "joints_from_configuration",
    "universal_angles_from_joint_angles",
]

VERTICAL = 1e-9
"""A heading is vertical if its horizontal part is shorter than this: less than rounding leaves of a turn."""


def base_frame(base_pose: ArrayLike) -> FloatArray:
    """Return the axes of the feeder, shape (3, 3), one per row.

    x is the heading. z points up as far as it can; if the heading is vertical, z points along the world's x.

    Parameters
    ----------
    base_pose : array-like, shape (6,)
        Position of the base, in workspace units, and unit heading.

    Raises
    ------
    InputError
        If there is no heading in it.
    """
    pose = np.asarray(base_pose, dtype=np.float64)
    if pose.shape != (6,) or not 0.0 < math.hypot(*pose[3:]) < math.inf:
        raise InputError(
            "Expected a base_pose with shape (6,), the position and a heading of length 1, got "
            f"{pose.tolist() if pose.size <= 6 else pose.shape}."
        )
    x = pose[3:] / math.hypot(*pose[3:])
    # y is square to the heading and to what z shall point along: no difference that could cancel.
    horizontal = np.hypot(x[0], x[1])
    y = np.array([-x[1], x[0], 0.0]) if horizontal >= VERTICAL else np.array([0.0, -x[2], x[1]])
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def _checked(values: ArrayLike, what: str, middle: str, last: int) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 3 or array.shape[2] != last:
        raise InputError(f"Expected {what} with shape (n_poses, {middle}, {last}), got {array.shape}.")
    return array


def _bent(frames: FloatArray, angles: FloatArray) -> FloatArray:
    """Turn frames, shape (n, 3, 3), by joint angles, shape (n, 2)."""
    theta = np.hypot(angles[:, 0], angles[:, 1])[:, None]
    sinc = np.sinc(theta / np.pi)
    # (1 - cos) / theta^2, by the half angle, which does not cancel.
    versed = 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    x, y, z = frames[:, 0], frames[:, 1], frames[:, 2]
    a, b = angles[:, :1], angles[:, 1:]
    way = a * y + b * z
    turned = np.empty_like(frames)
    turned[:, 0] = np.cos(theta) * x + sinc * way
    turned[:, 1] = y - a * (sinc * x + versed * way)
    turned[:, 2] = z - b * (sinc * x + versed * way)
    return turned


def joints_from_configuration(
    feed: ArrayLike, joint_angles: ArrayLike, link_length: float, base_pose: ArrayLike
) -> FloatArray:
    """Compute the joint positions of many configurations (forward kinematics).

    Parameters
    ----------
    feed : array-like, shape (n_poses,)
        Length of arm pushed past the base, in workspace units.
    joint_angles : array-like, shape (n_poses, n_links, 2)
        In rad.
    link_length : float
        In workspace units.
    base_pose : array-like, shape (6,)
        Position of the base, in workspace units, and unit heading.

    Returns
    -------
    joints : array, shape (n_poses, n_links + 1, 3)
        Base end first, tip last, in workspace units.

    Raises
    ------
    InputError
        If shapes do not agree.

    Examples
    --------
    >>> base = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    >>> joints_from_configuration([2.0], [[[0.0, 0.0], [np.pi / 2, 0.0]]], 2.0, base).round(9)
    array([[[-2.,  0.,  0.],
            [ 0.,  0.,  0.],
            [ 0.,  2.,  0.]]])
    """
    feed, angles = np.asarray(feed, dtype=np.float64), _checked(joint_angles, "joint_angles", "n_links", 2)
    n_poses, n_links = angles.shape[:2]
    if feed.shape != (n_poses,):
        raise InputError(f"Expected feed with shape ({n_poses},), got {feed.shape}.")
    position, axes = np.asarray(base_pose, dtype=np.float64)[:3], base_frame(base_pose)
    joints = np.empty((n_poses, n_links + 1, 3))
    joints[:, 0] = (feed - n_links * link_length)[:, None] * axes[0]
    frames = np.broadcast_to(axes, (n_poses, 3, 3))
    for k in range(n_links):
        frames = _bent(frames, angles[:, k])
        joints[:, k + 1] = joints[:, k] + link_length * frames[:, 0]
    joints += position  # at last, so that far from the origin it is rounded only once
    return joints


def configuration_from_joints(
    joints: ArrayLike, link_length: float, base_pose: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Compute feed and joint angles from joint positions (the inverse of `joints_from_configuration`).

    Only the directions of the links count; a link without length goes straight on.

    Parameters
    ----------
    joints : array-like, shape (n_poses, n_links + 1, 3)
        The rearmost joint on the feeder's axis.
    link_length : float
        In workspace units.
    base_pose : array-like, shape (6,)
        Position of the base, in workspace units, and unit heading.

    Returns
    -------
    feed : array, shape (n_poses,)
        In workspace units.
    joint_angles : array, shape (n_poses, n_links, 2)
        In rad; hypot of the two is at most pi.

    Raises
    ------
    InputError
        If a shape is wrong.
    """
    places = _checked(joints, "joints", "n_links + 1", 3)
    n_links = places.shape[1] - 1
    position, axes = np.asarray(base_pose, dtype=np.float64)[:3], base_frame(base_pose)
    feed = (places[:, 0] - position) @ axes[0] + n_links * link_length
    steps = np.diff(places, axis=1)
    angles = np.empty((len(places), n_links, 2))
    frames = np.broadcast_to(axes, (len(places), 3, 3))
    for k in range(n_links):
        ahead, left, up = np.einsum("nij,nj->in", frames, steps[:, k])
        aside = np.hypot(left, up)
        theta = np.arctan2(aside, ahead)
        # A full reversal has no side of its own: it is towards y. Subnormal numbers have no quotient.
        some = aside >= np.finfo(np.float64).tiny
        angles[:, k, 0] = theta * np.divide(left, aside, out=np.ones_like(aside), where=some)
        angles[:, k, 1] = theta * np.divide(up, aside, out=np.zeros_like(aside), where=some)
        frames = _bent(frames, angles[:, k])
    return feed, angles


def universal_angles_from_joint_angles(joint_angles: ArrayLike) -> FloatArray:
    """Compute yaw and pitch of universal joints that hold the same poses.

    A universal joint first turns its link about the z axis of the link behind (yaw, counter-clockwise), then
    about the y axis that this has turned (pitch, positive towards z). Its links twist against those that
    bend without twist, which is taken into account. Yaw is within half a turn, pitch within a quarter turn;
    at a pitch of a quarter turn yaw is not defined.

    Parameters
    ----------
    joint_angles : array-like, shape (n_poses, n_links, 2)
        In rad, as in `SpatialMotion`.

    Returns
    -------
    angles : array, shape (n_poses, n_links, 2)
        Yaw and pitch in rad.

    Raises
    ------
    InputError
        If the shape is wrong.
    """
    bends = _checked(joint_angles, "joint_angles", "n_links", 2)
    angles = np.empty_like(bends)
    frames = universal = np.broadcast_to(np.eye(3), (len(bends), 3, 3))
    for k in range(bends.shape[1]):
        frames = _bent(frames, bends[:, k])
        ahead, left, up = np.einsum("nij,nj->in", universal, frames[:, 0])
        yaw, pitch = np.arctan2(left, ahead), np.arctan2(up, np.hypot(ahead, left))
        angles[:, k, 0], angles[:, k, 1] = yaw, pitch
        x, y, z = universal[:, 0], universal[:, 1], universal[:, 2]
        cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
        turned = cos * x + sin * y
        universal = np.stack(
            [
                np.cos(pitch)[:, None] * turned + np.sin(pitch)[:, None] * z,
                cos * y - sin * x,
                np.cos(pitch)[:, None] * z - np.sin(pitch)[:, None] * turned,
            ],
            axis=1,
        )
    return angles
