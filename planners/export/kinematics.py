"""What timing has to know of an arm, in the plane and in space: where its joints are, what the feeder holds.

A configuration is a row (feed, angles): the feed in link lengths, the angles in rad. In the plane there is
one per joint, in space there are two, yaw and pitch of a universal joint (`planners.spatial.kinematics`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hrsnake_env.arm import FloatArray, joints_from_configuration
from planners.problem import Motion
from planners.spatial.kinematics import base_frame, universal_angles_from_joint_angles
from planners.spatial.problem import SpatialMotion

__all__ = ["Kinematics", "PlanarKinematics", "SpatialKinematics", "configurations", "kinematics_of"]


class Kinematics(Protocol):
    """An arm of one kind, at a base; lengths are in link lengths."""

    @property
    def n_links(self) -> int:
        """Number of links."""

    def joints(self, configurations: FloatArray) -> FloatArray:
        """Return joint positions, shape (n, n_links + 1, 2 or 3), of configurations, shape (n, dof)."""

    def held(self, configurations: FloatArray, past: FloatArray) -> FloatArray:
        """Return configurations with straight joints where `past`, shape (n, n_links), is negative.

        In the plane links in front of them keep their headings.
        """


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarKinematics:
    """Know an arm in the plane; see `Kinematics`."""

    n_links: int
    base_pose: FloatArray
    link_length: float

    def joints(self, configurations: FloatArray) -> FloatArray:
        """Return joint positions in link lengths."""
        x, y, heading = self.base_pose
        base = np.array([x / self.link_length, y / self.link_length, heading])
        return joints_from_configuration(configurations[:, 0], configurations[:, 1:], 1.0, base)

    def held(self, configurations: FloatArray, past: FloatArray) -> FloatArray:
        """Return configurations with the links that the feeder holds on its axis."""
        headings = np.cumsum(configurations[:, 1:], axis=1)
        behind = past < 0.0
        headings[behind] = 0.0
        result = configurations.copy()
        # Only what is held, and the joint next to it: other angles stay as they are to the last bit.
        moved = behind.copy()
        moved[:, 1:] |= behind[:, :-1]
        turned = np.diff(headings, axis=1, prepend=0.0)
        result[:, 1:] = np.where(moved, turned, configurations[:, 1:])
        return result


@dataclass(frozen=True, eq=False, kw_only=True)
class SpatialKinematics:
    """Know an arm of universal joints in space; see `Kinematics`."""

    n_links: int
    base_pose: FloatArray
    link_length: float

    def joints(self, configurations: FloatArray) -> FloatArray:
        """Return joint positions in link lengths."""
        axes = base_frame(self.base_pose)
        angles = configurations[:, 1:].reshape(len(configurations), self.n_links, 2)
        joints = np.empty((len(configurations), self.n_links + 1, 3))
        start = self.base_pose[:3] / self.link_length
        joints[:, 0] = start + (configurations[:, 0] - self.n_links)[:, None] * axes[0]
        frames = np.broadcast_to(axes, (len(configurations), 3, 3))
        for k in range(self.n_links):
            frames = _turned(frames, angles[:, k])
            joints[:, k + 1] = joints[:, k] + frames[:, 0]
        return joints

    def held(self, configurations: FloatArray, past: FloatArray) -> FloatArray:
        """Return configurations with straight joints where the feeder holds them."""
        result = configurations.copy()
        result[:, 1:][np.repeat(past < 0.0, 2, axis=1)] = 0.0
        return result


def _turned(frames: FloatArray, angles: FloatArray) -> FloatArray:
    """Turn frames, shape (n, 3, 3), by yaw and pitch, shape (n, 2)."""
    cos_yaw, cos_pitch = np.cos(angles).T[..., None]
    sin_yaw, sin_pitch = np.sin(angles).T[..., None]
    x, y, z = frames[:, 0], frames[:, 1], frames[:, 2]
    ahead = cos_yaw * x + sin_yaw * y
    return np.stack(
        [
            cos_pitch * ahead + sin_pitch * z,
            cos_yaw * y - sin_yaw * x,
            cos_pitch * z - sin_pitch * ahead,
        ],
        axis=1,
    )


def kinematics_of(motion: Motion | SpatialMotion) -> Kinematics:
    """Return what is to be known of the arm of a motion."""
    kind = PlanarKinematics if isinstance(motion, Motion) else SpatialKinematics
    return kind(n_links=motion.n_links, base_pose=motion.base_pose, link_length=motion.link_length)


def configurations(motion: Motion | SpatialMotion) -> FloatArray:
    """Return the poses of a motion as configurations, shape (n_poses, dof)."""
    if isinstance(motion, Motion):
        angles = motion.joint_angles
    else:
        universal = universal_angles_from_joint_angles(motion.joint_angles)
        angles = np.unwrap(universal, axis=0).reshape(motion.n_poses, -1)
    return np.concatenate([motion.feed[:, None] / motion.link_length, angles], axis=1)
