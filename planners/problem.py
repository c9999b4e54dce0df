"""The records that planners, the checker and the command line pass around."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import IO, Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hrsnake_env.arm import ArmSpec, FloatArray, configuration_from_joints, joints_from_configuration
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from planners.reading import MOTION_BYTES, NotReadable, read_arrays

__all__ = [
    "Attempt",
    "Candidate",
    "Failure",
    "Fault",
    "Motion",
    "PlanningResult",
    "PlanningStatus",
    "Progress",
    "Result",
    "ValidationReport",
    "motion_values",
    "read_motion_arrays",
    "write_motion_arrays",
]

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the share of it that is done, in [0, 1]."""

KEYS = ("joints", "joint_angles", "feed", "link_length", "base_pose")

ARM_KEYS = ("link_radius", "joint_limit")
"""What a motion file holds besides if the arm has it; in files without, links are thin and bend freely."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """Hold a motion of the whole arm: poses in order, without time.

    Between two poses feed and joint angles change linearly. All arrays are read-only.

    Parameters
    ----------
    joints : array-like, shape (n_poses, n_links + 1, 2)
        Joint positions, base end first, in maze units.
    joint_angles : array-like, shape (n_poses, n_links)
        In rad, counter-clockwise positive, without jumps of 2 pi.
    feed : array-like, shape (n_poses,)
        In maze units.
    link_length : float
        In maze units.
    base_pose : array-like, shape (3,)
        (x, y, heading) of the base, in maze units and rad.
    link_radius : float
        Of the arm that it was made for, in maze units.
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
            array = np.array(getattr(self, key), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, key, array)
        object.__setattr__(self, "link_length", float(self.link_length))
        n_poses, n_links = self.joint_angles.shape if self.joint_angles.ndim == 2 else (0, 0)
        wanted = {"joints": (n_poses, n_links + 1, 2), "feed": (n_poses,), "base_pose": (3,)}
        if n_poses == 0 or n_links == 0:
            raise InputError(
                f"Expected joint_angles with shape (n_poses, n_links), got {self.joint_angles.shape}."
            )
        for key, shape in wanted.items():
            if getattr(self, key).shape != shape:
                raise InputError(f"Expected {key} with shape {shape}, got {getattr(self, key).shape}.")
        if not (np.isfinite(self.link_length) and self.link_length > 0.0):
            raise InputError(f"Expected a positive, finite link_length, got {self.link_length!r}.")
        if not all(
            np.isfinite(getattr(self, key)).all() for key in ("joints", "joint_angles", "feed", "base_pose")
        ):
            raise InputError("Expected a motion of finite numbers, got NaN or infinity.")
        _ = self.arm  # there is one

    def __repr__(self) -> str:
        return f"Motion({self.n_poses} poses, {self.n_links} links of {self.link_length:g})"

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

    def of_arm(self, arm: ArmSpec) -> Motion:
        """Return the same motion as one of links as thick, and of joints as limited, as those of an arm."""
        if (arm.link_radius, arm.joint_limit) == (self.link_radius, self.joint_limit):
            return self
        return replace(self, link_radius=arm.link_radius, joint_limit=arm.joint_limit)

    @classmethod
    def from_configurations(
        cls, feed: ArrayLike, joint_angles: ArrayLike, link_length: float, base_pose: ArrayLike
    ) -> Motion:
        """Build a motion from feed, shape (n_poses,), and joint angles, shape (n_poses, n_links)."""
        joints = joints_from_configuration(feed, joint_angles, link_length, base_pose)
        return cls(
            joints=joints,
            joint_angles=np.asarray(joint_angles),
            feed=np.asarray(feed),
            link_length=link_length,
            base_pose=np.asarray(base_pose),
        )

    @classmethod
    def from_joints(cls, joints: ArrayLike, link_length: float, base_pose: ArrayLike) -> Motion:
        """Build a motion from joint positions, shape (n_poses, n_links + 1, 2)."""
        feed, joint_angles = configuration_from_joints(joints, link_length, base_pose)
        return cls(
            joints=np.asarray(joints),
            joint_angles=np.unwrap(joint_angles, axis=0),
            feed=feed,
            link_length=link_length,
            base_pose=np.asarray(base_pose),
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the motion as `.npz`, completely or not at all.

        The keys are `joints`, `joint_angles`, `feed`, `link_length` and `base_pose`; where the arm has them
        also `link_radius` and `joint_limit` (rad).
        """
        with replacing(path) as part, part.open("wb") as file:
            write_motion_arrays(file, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Motion:
        """Read a motion that `save` has written.

        Raises
        ------
        InputError
            If the file is missing or does not hold a motion.
        """
        values = read_motion_arrays(path)
        if values["joint_angles"].ndim == 3:
            raise InputError(f"Expected a motion in the plane in '{path}', got one in space.")
        return cls(**values)

    def check_maze(self, maze: Maze) -> None:
        """Check that the motion starts from the base of this maze.

        Raises
        ------
        InputError
            If it was made for another base pose.
        """
        if not np.allclose(self.base_pose, maze.base_pose, rtol=0.0, atol=1e-9 * self.link_length):
            mine, others = (
                f"({x:.12g}, {y:.12g}, {np.degrees(heading):g} deg)"
                for x, y, heading in (self.base_pose, maze.base_pose)
            )
            raise InputError(
                f"Expected a motion from the base of maze '{maze.name}' at {others}, got one from {mine}: "
                f"it belongs to another maze."
            )

    def moved(self, way: ArrayLike) -> Motion:
        """Return the same motion with everything moved by a vector, shape (2,)."""
        way = np.asarray(way, dtype=np.float64)
        base_pose = np.concatenate([self.base_pose[:2] + way, self.base_pose[2:]])
        return replace(self, joints=self.joints + way, base_pose=base_pose)

    def with_links(self, n_links: int) -> Motion:
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
        joint_angles = np.pad(self.joint_angles, ((0, 0), (more, 0)))
        longer = Motion.from_configurations(self.feed, joint_angles, self.link_length, self.base_pose)
        return longer.of_arm(self.arm)


def write_motion_arrays(file: IO[bytes], motion: object) -> None:
    """Write the attributes `KEYS` of a motion as `.npz`, and those of `ARM_KEYS` that its arm has."""
    present = [key for key in ARM_KEYS if getattr(motion, key)]
    arrays: dict[str, Any] = {key: np.asarray(getattr(motion, key)) for key in (*KEYS, *present)}
    np.savez_compressed(file, **arrays)


def read_motion_arrays(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read the arrays `KEYS` of a motion file (.npz), and those of `ARM_KEYS` that it has; scalars as floats.

    Raises
    ------
    InputError
        If the file is missing or does not hold a motion.
    """
    try:
        return motion_values(read_arrays(path, most_bytes=MOTION_BYTES), f" in '{path}'")
    except FileNotFoundError:
        raise InputError(f"Expected a motion file at '{path}', but there is none.") from None
    except NotReadable as got:
        raise InputError(f"Expected a motion (.npz) in '{path}', got {got}.") from None


def motion_values(arrays: Mapping[str, NDArray[Any]], where: str = "") -> dict[str, Any]:
    """Check that arrays are those of a motion, in the plane or in space; return them, scalars as floats.

    Parameters
    ----------
    arrays : mapping from str to array
        Of an .npz file; others than a motion's are left out.
    where : str
        For messages.

    Raises
    ------
    InputError
        If one is missing, or is not made of numbers.
    """
    missing = [key for key in KEYS if key not in arrays]
    if missing:
        raise InputError(
            f"Expected a motion{where} with the keys {', '.join(KEYS)}; missing: {', '.join(missing)}."
        )
    values: dict[str, Any] = {key: arrays[key] for key in (*KEYS, *ARM_KEYS) if key in arrays}
    if any(array.dtype.kind not in "fiu" for array in values.values()):
        raise InputError(f"Expected a motion of numbers{where}, with one link_length.")
    for key in ("link_length", *ARM_KEYS):
        if key in values:
            if values[key].size != 1:
                raise InputError(f"Expected a motion of numbers{where}, with one {key}.")
            values[key] = float(values[key].item())
    return values


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Name one thing that is wrong with a motion, at its worst place.

    Parameters
    ----------
    kind : str
        One of the keys of `planners.validation.FAULTS`.
    message : str
        One sentence with figures.
    pose : int
        Index of the pose, or of the pose before the place between two poses.
    link : int or None
        Index of the link, from the base end.
    place : tuple of floats, or None
        In maze units; x, y and in space z.
    amount : float
        How much, in maze units (rad for joint limits).
    """

    kind: str
    message: str
    pose: int
    link: int | None
    place: tuple[float, ...] | None
    amount: float


@dataclass(frozen=True, kw_only=True)
class ValidationReport:
    """Hold what the exact checker found.

    Parameters
    ----------
    faults : tuple of Fault
        At most one of each kind: the worst (of crossings: the first). Empty means valid.
    clearance : float
        Smallest signed distance of any link to the walls over all poses, in maze units; negative is the
        penetration depth.
    penetration : float
        Largest penetration depth at any pose, at least 0.
    penetration_between : float
        Bound on the depth anywhere between poses, at least 0; infinite if none up to the tolerance was found.
    largest_step : float
        Largest movement of any joint between two poses.
    length_error : float
        Largest deviation of any link from its length.
    goal_distance : float
        From the tip of the last pose to the goal.
    """

    faults: tuple[Fault, ...]
    clearance: float
    penetration: float
    penetration_between: float
    largest_step: float
    length_error: float
    goal_distance: float

    @property
    def valid(self) -> bool:
        """Whether no fault was found."""
        return not self.faults


class PlanningStatus(StrEnum):
    """Say how planning ended; IMPOSSIBLE only with a proof."""

    SOLVED = "solved"
    NO_PATH = "no path"
    DEAD_END = "dead end"
    NOT_VALID = "not valid"
    OUT_OF_TIME = "out of time"
    IMPOSSIBLE = "impossible"


@dataclass(frozen=True, eq=False, kw_only=True)
class Failure:
    """Say where a planner could not go on, and what is in the way.

    Parameters
    ----------
    place : tuple of floats
        Where, in maze units; x, y and in space z.
    path_position : float or None
        Arclength along the path up to there.
    link : int or None
        The link that finds no way, counted from the tip (0).
    wall : int or None
        Index in `Maze.walls` of the wall that is most in its way.
    depth : float or None
        How deep the link would be in that wall where the planner wants it, in maze units.
    joints : array, shape (n_joints, 2 or 3), or None
        The arm as far as it came, from the base to the tip, for a picture.
    """

    place: tuple[float, ...]
    path_position: float | None = None
    link: int | None = None
    wall: int | None = None
    depth: float | None = None
    joints: FloatArray | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Candidate:
    """Hold what one planner hands to the checker.

    Parameters
    ----------
    status : PlanningStatus
        SOLVED if there is a motion; it is not validated yet.
    motion : Motion or None
        With as many links as it needs.
    reason, failure, timings
        As in `PlanningResult`.
    """

    status: PlanningStatus
    motion: Motion | None = None
    reason: str = ""
    failure: Failure | None = None
    timings: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """Say how one planner fared on one way round the obstacles.

    Parameters
    ----------
    planner : str
        Its name.
    route : int
        0 for the way of the potential, otherwise the number of the way.
    status : PlanningStatus
        Its outcome.
    seconds : float
        Time that it took, check included.
    """

    planner: str
    route: int
    status: PlanningStatus
    seconds: float

    def __str__(self) -> str:
        way = f" on way {self.route}" if self.route else ""
        return f"{self.planner}{way}: {self.status}"


class _Poses(Protocol):
    """What a result tells of its motion."""

    @property
    def n_poses(self) -> int: ...

    @property
    def n_links(self) -> int: ...


AnyMotion = TypeVar("AnyMotion", bound=_Poses)


@dataclass(frozen=True, eq=False, kw_only=True)
class Result(Generic[AnyMotion]):
    """Hold what a planner found, or why it found nothing; in the plane or in space.

    Parameters
    ----------
    status : PlanningStatus
        SOLVED if and only if `motion` is there and has passed the exact checker.
    planner : str
        Name of the planner that was used.
    motion : Motion or None
        The motion.
    reason : str
        One sentence; empty when solved.
    failure : Failure or None
        Where planning ended and what is in the way; None when solved.
    longest_there : float or None
        The longest link with which the planner gets past that place; None if not looked for.
    report : ValidationReport or None
        What the checker said of the motion that was tried.
    attempts : tuple of Attempt
        All planners that were asked, in order.
    timings : mapping from str to float
        Seconds by stage of `planner`: potential, path, beams, plan, poses, validate.
    """

    status: PlanningStatus
    planner: str
    motion: AnyMotion | None = None
    reason: str = ""
    failure: Failure | None = None
    longest_there: float | None = None
    report: ValidationReport | None = None
    attempts: tuple[Attempt, ...] = ()
    timings: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "timings", MappingProxyType(dict(self.timings)))

    @property
    def place(self) -> tuple[float, ...] | None:
        """Where planning ended, in maze units."""
        return None if self.failure is None else self.failure.place

    @property
    def solved(self) -> bool:
        """Whether there is a validated motion."""
        return self.status is PlanningStatus.SOLVED

    def to_dict(self) -> dict[str, Any]:
        """Return the outcome as plain numbers and strings, without the motion's arrays."""
        return {
            "status": str(self.status),
            "planner": self.planner,
            "reason": self.reason,
            "place": self.place,
            "path_position": None if self.failure is None else self.failure.path_position,
            "link": None if self.failure is None else self.failure.link,
            "wall": None if self.failure is None else self.failure.wall,
            "depth": None if self.failure is None else self.failure.depth,
            "longest_there": self.longest_there,
            "n_poses": None if self.motion is None else self.motion.n_poses,
            "n_links": None if self.motion is None else self.motion.n_links,
            "attempts": [str(attempt) for attempt in self.attempts],
            "timings": dict(self.timings),
        }


class PlanningResult(Result[Motion]):
    """Hold what a planner found in a maze, or why it found nothing; see `Result`."""
