"""What came of planning with one link length, and the file that remembers it for the next run."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hrsnake_env.arguments import is_number
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from planners.problem import Motion, PlanningResult, PlanningStatus
from planners.reading import NotReadable, read_json, shown
from planners.rod_bound import RodBound, RodPath

__all__ = ["LengthTrial", "TrialFile", "digest_of", "motion_path"]

KIND = "hrsnake longest"
"""Stands in every file of trials, so that no other file is taken for one, or overwritten."""

FIGURES = ("n_links", "n_poses", "joint_range", "joint_speed", "turning")
"""What is known of a trial with a motion alone."""


@dataclass(frozen=True, kw_only=True)
class LengthTrial:
    """Say what an arm with links of one length needs, or why there is no motion.

    The figures are None without a motion.

    Parameters
    ----------
    link_length : float
        In maze units.
    status : PlanningStatus
        SOLVED if there is a validated motion.
    planner : str
        That found it, or that was asked first; empty if none was asked.
    reason : str
        Why there is no motion; empty if there is one.
    n_links : int or None
        That the motion needs.
    n_poses : int or None
        Of the motion.
    joint_range : float or None
        Largest absolute joint angle, in rad: it chooses the joint.
    joint_speed : float or None
        Largest change of a joint angle per way of the joint that travels farthest meanwhile, in rad per
        maze unit: times the speed that is allowed anywhere along the arm, it chooses the motor.
    turning : float or None
        Largest change of any joint angle from pose to pose, summed up over the motion, in rad: divided by the
        joints' speed, it is the least time that the motion can take.
    seconds : float
        Time that planning took.
    time_budget : float
        That planning had, in s.

    Notes
    -----
    A speed per feed, or per way of the tip, would say nothing: both stand still while links turn in place.
    Some joint always travels while any angle changes, and at most 4 rad are turned per link length of it: a
    link that is turned by an angle has one end that travels at least half of link length times angle, and
    a joint angle belongs to two links.
    """

    link_length: float
    status: PlanningStatus
    planner: str = ""
    reason: str = ""
    n_links: int | None = None
    n_poses: int | None = None
    joint_range: float | None = None
    joint_speed: float | None = None
    turning: float | None = None
    seconds: float = 0.0
    time_budget: float = 0.0

    @property
    def passes(self) -> bool:
        """Whether there is a validated motion."""
        return self.status is PlanningStatus.SOLVED

    @property
    def out_of_time(self) -> bool:
        """Whether it was the time that ended planning, so that nothing is known."""
        return self.status is PlanningStatus.OUT_OF_TIME

    @property
    def n_actuators(self) -> int | None:
        """Number of actuators: one for each link's joint, and the feed."""
        return None if self.n_links is None else self.n_links + 1

    @classmethod
    def from_result(
        cls, link_length: float, result: PlanningResult, seconds: float, time_budget: float
    ) -> LengthTrial:
        """Take the figures of a planning result."""
        motion, status = result.motion, result.status
        figures: dict[str, Any] = {} if motion is None else _figures(motion)
        # A result names the first planner's failure; that the last one had no time left makes it undecided.
        late = seconds >= time_budget or any(
            attempt.status is PlanningStatus.OUT_OF_TIME for attempt in result.attempts
        )
        if late and status not in (PlanningStatus.SOLVED, PlanningStatus.IMPOSSIBLE):
            status = PlanningStatus.OUT_OF_TIME
        return cls(
            link_length=link_length,
            status=status,
            planner=result.planner,
            reason=result.reason,
            seconds=seconds,
            time_budget=time_budget,
            **figures,
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the trial as plain numbers and strings."""
        return {**dataclasses.asdict(self), "status": str(self.status), "n_actuators": self.n_actuators}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> LengthTrial:
        """Build a trial from what `to_dict` returned."""
        names = {each.name for each in dataclasses.fields(cls)}
        values = {name: value for name, value in data.items() if name in names}
        for name, value in values.items():
            texts = name in ("status", "planner", "reason")
            if not (
                isinstance(value, str) if texts else is_number(value) or (value is None and name in FIGURES)
            ):
                raise ValueError(f"no {name}: {shown(value)}")
        return cls(**{**values, "status": PlanningStatus(values["status"])})


def _figures(motion: Motion) -> dict[str, Any]:
    turned = np.abs(np.diff(motion.joint_angles, axis=0)).max(axis=1, initial=0.0)
    travelled = np.hypot(*np.diff(motion.joints, axis=0).transpose(2, 0, 1)).max(axis=1, initial=0.0)
    moving = travelled > 1e-9 * motion.link_length  # what is less is rounding
    return {
        "n_links": motion.n_links,
        "n_poses": motion.n_poses,
        "joint_range": float(np.abs(motion.joint_angles).max()),
        "joint_speed": float((turned[moving] / travelled[moving]).max(initial=0.0)),
        "turning": float(turned.sum()),
    }


def digest_of(maze: Maze, *options: object) -> str:
    """Return a text that differs for other geometry or other options, but not for another name."""
    digest = hashlib.sha256(repr((options, maze.goal_radius)).encode())
    for array in (maze.base_pose, maze.goal, *maze.rings):
        digest.update(repr(array.shape).encode() + array.tobytes())
    return digest.hexdigest()


def motion_path(path: Path) -> Path:
    """Return where the best motion stands: beside the file of trials, as `<name>.best.npz`."""
    return path.with_name(f"{path.stem}.best.npz")


@dataclass(eq=False, kw_only=True)
class TrialFile:
    """Hold the bound and all trials so far, and keep them in a file if one is given.

    Parameters
    ----------
    path : Path or None
        The file (JSON). The motion of the longest link that passes stands beside it (`motion_path`).
    digest : str
        Of maze and options (`digest_of`).
    note : str
        A sentence if the file was there but belongs to something else, so that it was not used.
    bound : RodBound or None
        None before it is known.
    trials : dict from float to LengthTrial
        By link length.
    motion : Motion or None
        Of the longest link that passes.
    """

    path: Path | None
    digest: str
    note: str = ""
    bound: RodBound | None = None
    trials: dict[float, LengthTrial] = field(default_factory=dict)
    motion: Motion | None = None

    @classmethod
    def open(cls, path: str | os.PathLike[str] | None, digest: str) -> TrialFile:
        """Read the file if it is there and belongs to these options; otherwise start anew.

        Raises
        ------
        InputError
            If the file is there and holds something else.
        """
        file = cls(path=None if path is None else Path(path), digest=digest)
        if file.path is None or not file.path.exists():
            return file
        data = _read(file.path)
        if data.get("digest") != digest:
            file.note = (
                f"The state in '{file.path}' was for another maze, other options or another version, so the "
                f"search starts anew."
            )
            return file
        try:
            file.bound = _bound_from_dict(data["bound"])
            trials = [LengthTrial.from_dict(each) for each in data["trials"]]
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
            raise InputError(
                f"Expected a state of `longest` in '{file.path}', got a damaged one; delete it to start anew."
            ) from None
        file.trials = {trial.link_length: trial for trial in trials}
        file._load_motion()
        return file

    @property
    def best(self) -> LengthTrial | None:
        """The longest link that passes."""
        return max(
            (trial for trial in self.trials.values() if trial.passes),
            key=lambda trial: trial.link_length,
            default=None,
        )

    def add(self, trial: LengthTrial, motion: Motion | None) -> None:
        """Remember a trial, and its motion if it is the best."""
        best = self.best
        if motion is not None and (best is None or trial.link_length > best.link_length):
            self.motion = motion
            if self.path is not None:  # before the trial, so that a trial always finds its motion
                motion.save(motion_path(self.path))
        self.trials[trial.link_length] = trial
        self.save()

    def drop(self, length: float) -> None:
        """Forget a trial."""
        del self.trials[length]

    def save(self) -> None:
        """Write the file, completely or not at all."""
        if self.path is None or self.bound is None:
            return
        data = {
            "kind": KIND,
            "digest": self.digest,
            "bound": _bound_to_dict(self.bound),
            "trials": [trial.to_dict() for trial in self.trials.values()],
        }
        with replacing(self.path) as part:
            part.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")

    def _load_motion(self) -> None:
        """Load the best motion; forget the best trials down to the one that has its motion beside it."""
        assert self.path is not None
        try:
            self.motion = Motion.load(motion_path(self.path))
        except InputError:
            self.motion = None
        while (best := self.best) is not None and (
            self.motion is None or self.motion.link_length != best.link_length
        ):
            self.drop(best.link_length)
        if self.best is None:
            self.motion = None


def _read(path: Path) -> dict[str, Any]:
    try:
        data = read_json(path)
    except OSError as error:
        raise InputError(f"Expected a state of `longest` at '{path}', got: {error.strerror}.") from None
    except NotReadable:
        data = None
    if not isinstance(data, dict) or data.get("kind") != KIND:
        raise InputError(
            f"Expected a state of `longest`, or a new file name, got '{path}', which holds something else."
        )
    return data


def _bound_to_dict(bound: RodBound) -> dict[str, Any]:
    path = bound.path
    return {
        "lower": bound.lower,
        "upper": bound.upper,
        "limited_by": bound.limited_by,
        "proven": bound.proven,
        "path": None
        if path is None
        else {"length": path.length, "tails": path.tails.tolist(), "headings": path.headings.tolist()},
    }


def _bound_from_dict(data: dict[str, Any]) -> RodBound:
    path = data["path"]
    if not (is_number(data["lower"]) and is_number(data["upper"]) and isinstance(data["proven"], bool)):
        raise ValueError("no bound")
    rod = None if path is None else RodPath(**path)
    if rod is not None and not (is_number(rod.length) and rod.tails.shape == (*rod.headings.shape, 2)):
        raise ValueError("no path of a rod")
    return RodBound(**{**data, "path": rod})
