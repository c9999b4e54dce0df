"""The arm: its specification, and the map between its configuration and its joint positions.

The configuration is the feed and the joint angles. Joint 0 is the rear end of the rearmost link and never
leaves the feeder's axis; joint `n_links` is the tip. Joint angle `k` turns link `k` about joint `k`, relative
to link `k - 1` (the first relative to the base heading), counter-clockwise positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hrsnake_env.arguments import is_number
from hrsnake_env.errors import InputError

__all__ = [
    "ArmSpec",
    "FloatArray",
    "configuration_from_joints",
    "feeder_angle_limits",
    "joints_from_configuration",
]

FloatArray = NDArray[np.float64]

FEEDER_RELEASE = 16.0
"""How fast the feeder lets go of a joint, in rad per link length that the joint is past the base."""


@dataclass(frozen=True, kw_only=True)
class ArmSpec:
    """Describe an arm of equal rigid links.

    An arm has one actuator per joint, `n_links` of them (the first is at the rear end of the rearmost link),
    and the feed.

    Parameters
    ----------
    link_length : float
        In maze units; positive.
    n_links : int, optional
        Number of links. None means as many as the motion needs.
    link_radius : float
        Links are capsules of this radius; 0 means line segments, as in the paper.
    joint_limit : float, optional
        Largest absolute joint angle in rad. None means no limit.

    Raises
    ------
    InputError
        If a value is not finite or out of its range.
    """

    link_length: float
    n_links: int | None = None
    link_radius: float = 0.0
    joint_limit: float | None = None

    def __post_init__(self) -> None:
        if not is_number(self.link_length) or not (0.0 < self.link_length < math.inf):
            raise InputError(f"Expected a positive, finite link_length, got {self.link_length!r}.")
        if self.n_links is not None and (
            isinstance(self.n_links, bool)
            or not isinstance(self.n_links, int | np.integer)
            or self.n_links < 1
        ):
            raise InputError(
                f"Expected n_links to be a whole number of at least 1, or None, got {self.n_links!r}."
            )
        if not is_number(self.link_radius) or not (0.0 <= self.link_radius < self.link_length / 2):
            raise InputError(
                f"Expected link_radius of at least 0 and under half a link length "
                f"({self.link_length / 2:g}), got {self.link_radius!r}."
            )
        if self.joint_limit is not None and (
            not is_number(self.joint_limit) or not (0.0 < self.joint_limit <= math.pi)
        ):
            raise InputError(f"Expected joint_limit in (0, pi] rad, or None, got {self.joint_limit!r}.")


def joints_from_configuration(
    feed: ArrayLike, joint_angles: ArrayLike, link_length: float, base_pose: ArrayLike
) -> FloatArray:
    """Compute the joint positions of one or many configurations (forward kinematics).

    Parameters
    ----------
    feed : array-like, shape (...)
        Length of arm pushed past the base, in maze units.
    joint_angles : array-like, shape (..., n_links)
        In rad, counter-clockwise positive.
    link_length : float
        In maze units.
    base_pose : array-like, shape (3,)
        (x, y, heading) of the base, in maze units and rad.

    Returns
    -------
    joints : array, shape (..., n_links + 1, 2)
        Base end first, tip last, in maze units.

    Examples
    --------
    >>> joints_from_configuration(1.0, [0.0, 0.0], 2.0, (0.0, 0.0, 0.0))
    array([[-3.,  0.],
           [-1.,  0.],
           [ 1.,  0.]])
    """
    angles = np.asarray(joint_angles, dtype=np.float64)
    x, y, heading = np.asarray(base_pose, dtype=np.float64)
    headings = heading + np.cumsum(angles, axis=-1)
    joints = np.zeros((*angles.shape[:-1], angles.shape[-1] + 1, 2))
    axial = np.asarray(feed, dtype=np.float64) - angles.shape[-1] * link_length
    joints[..., 0, 0] = x + axial * np.cos(heading)
    joints[..., 0, 1] = y + axial * np.sin(heading)
    joints[..., 1:, 0] = joints[..., :1, 0] + link_length * np.cumsum(np.cos(headings), axis=-1)
    joints[..., 1:, 1] = joints[..., :1, 1] + link_length * np.cumsum(np.sin(headings), axis=-1)
    return joints


def configuration_from_joints(
    joints: ArrayLike, link_length: float, base_pose: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Compute feed and joint angles from joint positions (the inverse of `joints_from_configuration`).

    Parameters
    ----------
    joints : array-like, shape (..., n_links + 1, 2)
        Base end first, in maze units; the first joint lies on the feeder's axis.
    link_length : float
        In maze units.
    base_pose : array-like, shape (3,)
        (x, y, heading), in maze units and rad.

    Returns
    -------
    feed : array, shape (...)
        In maze units.
    joint_angles : array, shape (..., n_links)
        In rad, each in [-pi, pi).
    """
    positions = np.asarray(joints, dtype=np.float64)
    x, y, heading = np.asarray(base_pose, dtype=np.float64)
    steps = np.diff(positions, axis=-2)
    headings = np.arctan2(steps[..., 1], steps[..., 0])
    angles = np.diff(headings, axis=-1, prepend=heading)
    angles = (angles + np.pi) % (2.0 * np.pi) - np.pi
    rear = (positions[..., 0, 0] - x) * np.cos(heading) + (positions[..., 0, 1] - y) * np.sin(heading)
    return rear + steps.shape[-2] * link_length, angles


def feeder_angle_limits(feed: ArrayLike, n_links: int, link_length: float) -> FloatArray:
    """Compute the largest absolute joint angles that the feeder leaves at a given feed.

    A joint that has not passed the base is held straight (limit 0). Behind the base the limit grows in
    proportion to the way past it, so that the rule is exact and still continuous in the feed.

    Parameters
    ----------
    feed : array-like, shape (...)
        In maze units.
    n_links : int
        Number of links.
    link_length : float
        In maze units.

    Returns
    -------
    limits : array, shape (..., n_links)
        In rad, each in [0, pi].
    """
    places = np.asarray(feed, dtype=np.float64)[..., None] / link_length - (n_links - np.arange(n_links))
    return np.clip(FEEDER_RELEASE * places, 0.0, np.pi)
