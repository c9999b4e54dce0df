"""The records that the spatial planners, their checker and the command line pass around."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.problem import Failure, PlanningStatus, Result, read_motion_arrays, write_motion_arrays
from planners.spatial.kinematics import configuration_from_joints, joints_from_configuration
from planners.spatial.workspace import Workspace

__all__ = ["SpatialCandidate", "SpatialMotion", "SpatialResult"]


@dataclass(frozen=True, eq=False, kw_only=True)
class SpatialMotion:
    """Hold a motion of a whole arm in space: poses in order, without time.

    Between two poses feed and joint angles change linearly. All arrays are read-only.

    Parameters
    ----------
    joints : array-like, shape (n_poses, n_links + 1, 3)
        Joint positions, base end first, in workspace units.
    joint_angles : array-like, shape (n_poses, n_links, 2)
        In rad: how far each joint bends its link towards the y and the z axis of the link behind; see
        `planners.spatial.kinematics`.
    feed : array-like, shape (n_poses,)
        Length of arm pushed past the base, in workspace units.
    link_length : float
        In workspace units.
    base_pose : array-like, shape (6,)
        Position and unit heading of the base.
    link_radius : float
        Of the arm that it was made for, in workspace units.
    joint_limit : float or None
        Of that arm, in rad.

    Raises
    ------
    InputError
        If shapes do not agree, a value is not finite, or there is no such arm.
    """

    joints: FloatArray
    joint_angles: FloatArray
    feed: FloatArray
    link_length: float
    base_pose: FloatArray
    link_radius: float = 0.0
    joint_limit: float | None = None

    def __post_init__(self) -> None:
        for key in ("joints", "joint_angles", "feed", "base_pose"):
            try:
                array = np.array(getattr(self, key), dtype=np.float64)
            except (TypeError, ValueError):
                raise InputError(f"Expected {key} of a motion as an array of numbers.") from None
            array.setflags(write=False)
            object.__setattr__(self, key, array)
        shape = self.joint_angles.shape
        if len(shape) != 3 or shape[2] != 2 or 0 in shape:
            raise InputError(f"Expected joint_angles with shape (n_poses, n_links, 2), got {shape}.")
        wanted = {"joints": (shape[0], shape[1] + 1, 3), "feed": (shape[0],), "base_pose": (6,)}
        for key, expected in wanted.items():
            if getattr(self, key).shape != expected:
                raise InputError(f"Expected {key} with shape {expected}, got {getattr(self, key).shape}.")
        if not is_number(self.link_length) or not 0.0 < self.link_length < np.inf:
            raise InputError(f"Expected a positive, finite link_length, got {self.link_length!r}.")
        object.__setattr__(self, "link_length", float(self.link_length))
        for key in (*wanted, "joint_angles"):
            if not np.isfinite(getattr(self, key)).all():
                raise InputError(f"Expected a motion of finite numbers, got NaN or infinity in {key}.")
        if not np.isclose(np.linalg.norm(self.base_pose[3:]), 1.0, rtol=0.0, atol=1e-9):
            raise InputError(
                f"Expected a base_pose with a heading of length 1, got {self.base_pose[3:].tolist()}."
            )
        _ = self.arm  # there is one

    def __repr__(self) -> str:
        return f"SpatialMotion({self.n_poses} poses, {self.n_links} links of {self.link_length:g})"

    @property
    def n_poses(self) -> int:
        """Number of poses."""
        return int(self.joint_angles.shape[0])

    @property
    def n_links(self) -> int:
        """Number of links, those that never leave the feeder included."""
        return int(self.joint_angles.shape[1])

    @property
    def arm(self) -> ArmSpec:
        """The arm that it was made for."""
        return ArmSpec(
            link_length=self.link_length,
            n_links=self.n_links,
            link_radius=self.link_radius,
            joint_limit=self.joint_limit,
        )

    def of_arm(self, arm: ArmSpec) -> SpatialMotion:
        """Return the same motion as one of links as thick, and of joints as limited, as those of an arm."""
        if (arm.link_radius, arm.joint_limit) == (self.link_radius, self.joint_limit):
            return self
        return replace(self, link_radius=arm.link_radius, joint_limit=arm.joint_limit)

    @classmethod
    def from_configurations(
        cls, feed: ArrayLike, joint_angles: ArrayLike, link_length: float, base_pose: ArrayLike
    ) -> SpatialMotion:
        """Build a motion from feed, shape (n_poses,), and joint angles, shape (n_poses, n_links, 2)."""
        return cls(
            joints=joints_from_configuration(feed, joint_angles, link_length, base_pose),
            joint_angles=np.asarray(joint_angles),
            feed=np.asarray(feed),
            link_length=link_length,
            base_pose=np.asarray(base_pose),
        )

    @classmethod
    def from_joints(cls, joints: ArrayLike, link_length: float, base_pose: ArrayLike) -> SpatialMotion:
        """Build a motion from joint positions, shape (n_poses, n_links + 1, 3)."""
        feed, joint_angles = configuration_from_joints(joints, link_length, base_pose)
        return cls(
            joints=np.asarray(joints),
            joint_angles=joint_angles,
            feed=feed,
            link_length=link_length,
            base_pose=np.asarray(base_pose),
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion as `.npz`, completely or not at all; the keys are those of a planar one."""
        with replacing(path) as part, part.open("wb") as file:
            write_motion_arrays(file, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> SpatialMotion:
        """Read a motion that `save` has written.

        Raises
        ------
        InputError
            If the file is missing or does not hold a spatial motion.
        """
        values = read_motion_arrays(path)
        if values["joint_angles"].ndim == 2:
            raise InputError(f"Expected a motion in space in '{path}', got one in the plane.")
        return cls(**values)

    def check_workspace(self, workspace: Workspace) -> None:
        """Check that the motion starts from the base of this workspace.

        Raises
        ------
        InputError
            If it was made for another base.
        """
        wanted = workspace.base_pose_for(self.link_length)
        if not np.allclose(self.base_pose, wanted, rtol=0.0, atol=1e-9 * self.link_length):
            mine, others = (
                "(" + ", ".join(f"{value:g}" for value in pose) + ")" for pose in (self.base_pose, wanted)
            )
            raise InputError(
                f"Expected a motion from the base of workspace '{workspace.name}' at {others}, got one from "
                f"{mine}: it belongs to another workspace."
            )

    def moved(self, way: ArrayLike) -> SpatialMotion:
        """Return the same motion with everything moved by a vector, shape (3,)."""
        way = np.asarray(way, dtype=np.float64)
        base_pose = np.concatenate([self.base_pose[:3] + way, self.base_pose[3:]])
        return dataclasses.replace(self, joints=self.joints + way, base_pose=base_pose)

    def with_links(self, n_links: int) -> SpatialMotion:
        """Return the same motion of an arm with more links, which stay in the feeder.

        Raises
        ------
        InputError
            If the motion needs more links.
        """
        more = n_links - self.n_links
        if more < 0:
            raise InputError(f"Expected at least {self.n_links} links for this motion, got {n_links}.")
        if more == 0:
            return self
        joint_angles = np.pad(self.joint_angles, ((0, 0), (more, 0), (0, 0)))
        longer = SpatialMotion.from_configurations(self.feed, joint_angles, self.link_length, self.base_pose)
        return longer.of_arm(self.arm)


@dataclass(frozen=True, eq=False, kw_only=True)
class SpatialCandidate:
    """Hold what one spatial planner hands to the checker.

    Parameters
    ----------
    status : PlanningStatus
        SOLVED if there is a motion; it is not validated yet.
    motion : SpatialMotion or None
        With as many links as it needs.
    track : array, shape (n, 3), or None
        The curve on which all joints run.
    reason, failure, timings
        As in `planners.problem.Result`.
    """

    status: PlanningStatus
    motion: SpatialMotion | None = None
    track: FloatArray | None = None
    reason: str = ""
    failure: Failure | None = None
    timings: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class SpatialResult(Result[SpatialMotion]):
    """Hold what a planner found in a workspace, or why it found nothing; see `planners.problem.Result`.

    Parameters
    ----------
    path : array, shape (n, 3), or None
        The path of the point robot, base first; None if there is none.
    track : array, shape (n, 3), or None
        The curve on which all joints of the motion run, for pictures.
    """

    path: FloatArray | None = None
    track: FloatArray | None = None
