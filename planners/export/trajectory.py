"""Trajectories: a motion with time, within limits, as a controller takes it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from planners.problem import ValidationReport

__all__ = ["DEFAULT_RATE", "LARGEST_RATE", "ExportRefused", "Trajectory", "TrajectoryLimits"]

DEFAULT_RATE = 50.0
"""Samples per second."""

LARGEST_RATE = 10_000.0
"""Samples per second that no controller exceeds."""

FEED_SPEED, FEED_ACCELERATION = 0.5, 1.0
"""What the feed does where nothing else is said, in link lengths per s and per s^2."""


class ExportRefused(Exception):
    """Say in one sentence why nothing was written: a motion or a trajectory did not pass the checker.

    Parameters
    ----------
    message : str
        One sentence.
    report : ValidationReport, optional
        What the checker said.
    """

    def __init__(self, message: str, report: ValidationReport | None = None) -> None:
        super().__init__(message)
        self.report = report


@dataclass(frozen=True, kw_only=True)
class TrajectoryLimits:
    """Hold what a trajectory may not exceed, at any moment.

    Parameters
    ----------
    joint_speed : float
        Of every joint, in rad/s. By default a quarter turn per second.
    joint_acceleration : float
        Of every joint, in rad/s^2. By default a full turn per second squared.
    feed_speed : float, optional
        In maze units per s. By default half a link length per second.
    feed_acceleration : float, optional
        In maze units per s^2. By default a link length per second squared.

    Raises
    ------
    InputError
        If a limit is not positive and finite.
    """

    joint_speed: float = math.pi / 2.0
    joint_acceleration: float = 2.0 * math.pi
    feed_speed: float | None = None
    feed_acceleration: float | None = None

    def __post_init__(self) -> None:
        for name in ("joint_speed", "joint_acceleration", "feed_speed", "feed_acceleration"):
            value = getattr(self, name)
            if value is None and name.startswith("feed"):
                continue
            if not is_number(value) or not 0.0 < value < math.inf:
                raise InputError(f"Expected a positive, finite {name}, got {value!r}.")

    def for_links(self, link_length: float) -> TrajectoryLimits:
        """Return the limits with those of the feed filled in, for links of this length."""
        speed = FEED_SPEED * link_length if self.feed_speed is None else self.feed_speed
        acceleration = (
            FEED_ACCELERATION * link_length if self.feed_acceleration is None else self.feed_acceleration
        )
        return TrajectoryLimits(
            joint_speed=self.joint_speed,
            joint_acceleration=self.joint_acceleration,
            feed_speed=speed,
            feed_acceleration=acceleration,
        )

    def arrays(self, link_length: float, n_angles: int) -> tuple[FloatArray, FloatArray]:
        """Return speeds and accelerations, shape (1 + n_angles,): first of the feed.

        Those of the feed are in link lengths.

        Raises
        ------
        InputError
            If the limits are so large or small that no clock tells.
        """
        full = self.for_links(link_length)
        assert full.feed_speed is not None and full.feed_acceleration is not None  # filled in above
        speeds = np.array([full.feed_speed / link_length, *[self.joint_speed] * n_angles])
        accelerations = np.array(
            [full.feed_acceleration / link_length, *[self.joint_acceleration] * n_angles]
        )
        for what, values in (("speeds", speeds), ("accelerations", accelerations)):
            if values.min() < 1e-6 or values.max() > 1e6:
                raise InputError(
                    f"Expected {what} between 1e-6 and 1e6 rad or link lengths per s, "
                    f"got {values.min():g} to {values.max():g}."
                )
        return speeds, accelerations


@dataclass(frozen=True, eq=False, kw_only=True)
class Trajectory:
    """Hold a motion with time: samples between which a controller goes along cubics.

    Positions, velocities and accelerations fit each other: the cubics between samples that have the positions
    and velocities of both have their accelerations, too. All arrays are read-only.

    Parameters
    ----------
    time : array-like, shape (n,)
        In s, from 0 on, evenly spaced.
    feed, feed_velocity, feed_acceleration : array-like, shape (n,)
        In maze units, per s and per s^2.
    joint_angles, joint_velocities, joint_accelerations : array-like, shape (n, n_links) or (n, n_links, 2)
        In rad, rad/s and rad/s^2. In space the last axis is yaw and pitch of universal joints.
    link_length : float
        In maze units.
    base_pose : array-like, shape (3,) or (6,)
        As of the motion.
    units : str
        The unit of length of the maze.
    n_poses : int
        How many poses the motion had.
    deviation : float
        How far, at most, a joint was found from where the motion has it at the same place along the way, in
        maze units.

    Raises
    ------
    InputError
        If shapes do not agree, a value is not finite, or time does not run forward.
    """

    time: FloatArray
    feed: FloatArray
    joint_angles: FloatArray
    feed_velocity: FloatArray
    joint_velocities: FloatArray
    feed_acceleration: FloatArray
    joint_accelerations: FloatArray
    link_length: float
    base_pose: FloatArray
    units: str = "px"
    n_poses: int = 0
    deviation: float = 0.0

    def __post_init__(self) -> None:
        names = [
            name
            for name in self.__dataclass_fields__
            if name not in ("link_length", "units", "n_poses", "deviation")
        ]
        for name in names:
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
            if not np.isfinite(array).all():
                raise InputError(f"Expected a trajectory of finite numbers, got NaN or infinity in {name}.")
        shape = self.joint_angles.shape
        if len(shape) not in (2, 3) or 0 in shape or shape[2:] not in ((), (2,)):
            raise InputError(
                f"Expected joint_angles with shape (n, n_links) or (n, n_links, 2), got {shape}."
            )
        for name in names[:-1]:
            wanted = shape if name.startswith("joint") else shape[:1]
            if getattr(self, name).shape != wanted:
                raise InputError(f"Expected {name} with shape {wanted}, got {getattr(self, name).shape}.")
        if self.base_pose.shape != ((3,) if len(shape) == 2 else (6,)):
            raise InputError(f"Expected a base_pose as of a motion, got shape {self.base_pose.shape}.")
        if not is_number(self.link_length) or not 0.0 < self.link_length < math.inf:
            raise InputError(f"Expected a positive, finite link_length, got {self.link_length!r}.")
        if (np.diff(self.time) <= 0.0).any():
            raise InputError("Expected a trajectory whose time runs forward.")

    def __repr__(self) -> str:
        return f"Trajectory({self.n_points} points, {self.duration:.4g} s, {self.n_links} links)"

    @property
    def n_points(self) -> int:
        """Number of samples."""
        return len(self.time)

    @property
    def n_links(self) -> int:
        """Number of links."""
        return int(self.joint_angles.shape[1])

    @property
    def duration(self) -> float:
        """Time from the first sample to the last, in s."""
        return float(self.time[-1] - self.time[0])

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The feed, then the joints from the base end on; in space yaw and pitch of each."""
        if self.joint_angles.ndim == 2:
            return ("feed", *(f"joint_{k}" for k in range(self.n_links)))
        return ("feed", *(f"joint_{k}_{way}" for k in range(self.n_links) for way in ("yaw", "pitch")))

    def table(self, metres_per_unit: float = 1.0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions, velocities and accelerations, shape (n, 1 + n_angles): feed first, scaled."""
        n = self.n_points
        rows = []
        for feed, angles in (
            (self.feed, self.joint_angles),
            (self.feed_velocity, self.joint_velocities),
            (self.feed_acceleration, self.joint_accelerations),
        ):
            rows.append(np.concatenate([metres_per_unit * feed[:, None], angles.reshape(n, -1)], axis=1))
        return rows[0], rows[1], rows[2]
