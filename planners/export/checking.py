"""Check trajectories as motions are checked: independently, and as a controller drives them.

Between samples a controller goes along cubics through positions and velocities. So many poses are taken
from these that what changes linearly between them is no farther off than `CHORD`. The exact checker
(`planners.validation`) then decides on these poses and on everything between them. A motion may get as deep
as the pinch tolerance between its poses and not at them; of a trajectory no moment is more of a pose than
any other, so it may get that deep at any. All other rules are the motion's.
"""

from __future__ import annotations

import dataclasses
import re

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.checks.tolerances import PINCH_TOLERANCE, STEP_LIMIT
from planners.export.kinematics import Kinematics, PlanarKinematics, SpatialKinematics
from planners.export.timing import time_parametrise
from planners.export.trajectory import DEFAULT_RATE, ExportRefused, Trajectory, TrajectoryLimits
from planners.problem import Fault, Motion, Progress, ValidationReport
from planners.spatial.problem import SpatialMotion
from planners.spatial.validation import validate as validate_in_space
from planners.spatial.workspace import Workspace
from planners.validation import validate

IntArray = NDArray[np.int64]

__all__ = [
    "LIMIT_TOLERANCE",
    "check_motion",
    "check_trajectory",
    "largest_shares",
    "safe_trajectory",
    "sampled_motion",
]

LIMIT_TOLERANCE = 1e-3
"""By how much a limit may be exceeded, as a share of it."""

CHORD = 0.02 * PINCH_TOLERANCE
"""How far poses between those that are checked may be from where the checker has them, in link lengths."""

HOPELESS = 8.0
"""How many times farther off than the rounded path a trajectory is whose samples are too far apart: a closer
path is no help then."""

STEP_SHARE = 0.8
"""Of the largest step between two poses: what is taken from the cubics stays below."""

DEVIATIONS = (1.0, 0.5, 0.25, 0.1)
"""How far the rounded path may be off, one after the other, in pinch tolerances. What counts is how deep
links get, which is less than how far they are off; so the first is often good enough."""


def sampled_motion(trajectory: Trajectory) -> tuple[Motion | SpatialMotion, FloatArray]:
    """Return poses along the cubics that a controller drives, and their times.

    Returns
    -------
    motion : Motion or SpatialMotion
        So many poses that feed and angles between two are linear but for what moves a joint by `CHORD`.
    times : array, shape (n_poses,)
        In s.
    """
    length, planar = trajectory.link_length, trajectory.joint_angles.ndim == 2
    kind = PlanarKinematics if planar else SpatialKinematics
    kinematics = kind(n_links=trajectory.n_links, base_pose=trajectory.base_pose, link_length=length)
    positions, velocities, _ = trajectory.table()
    scale = np.array([length, *[1.0] * (positions.shape[1] - 1)])
    positions, velocities = positions / scale, velocities / scale
    steps = np.diff(trajectory.time)
    counts = _subdivisions(kinematics, positions, velocities, steps)
    owner = np.repeat(np.arange(len(steps)), counts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    shares = number / counts[owner]
    rows = np.concatenate([_cubic(positions, velocities, steps, owner, shares), positions[-1:]])
    times = np.append(trajectory.time[:-1][owner] + shares * steps[owner], trajectory.time[-1])
    if planar:
        feed = length * rows[:, 0]
        return Motion.from_configurations(feed, rows[:, 1:], length, trajectory.base_pose), times
    return SpatialMotion.from_joints(length * kinematics.joints(rows), length, trajectory.base_pose), times


def _cubic(
    positions: FloatArray, velocities: FloatArray, steps: FloatArray, owner: IntArray, share: FloatArray
) -> FloatArray:
    """Evaluate the cubics at shares of the steps, shape (n,) -> (n, dof)."""
    t, h = share[:, None], steps[owner][:, None]
    change = positions[owner + 1] - positions[owner]
    start, end = h * velocities[owner], h * velocities[owner + 1]
    return np.asarray(
        positions[owner]
        + t * (start + t * (3.0 * change - 2.0 * start - end + t * (start + end - 2.0 * change)))
    )


def _subdivisions(
    kinematics: Kinematics, positions: FloatArray, velocities: FloatArray, steps: FloatArray
) -> IntArray:
    """Find into how many pieces each step has to be cut, shape (n_steps,)."""
    each = np.arange(len(steps))
    places = kinematics.joints(positions)
    moves = np.linalg.norm(np.diff(places, axis=0), axis=2).max(axis=1)
    off = np.zeros(len(steps))
    for share in (0.25, 0.5, 0.75):
        row = _cubic(positions, velocities, steps, each, np.full(len(steps), share))
        chord = (1.0 - share) * positions[:-1] + share * positions[1:]
        apart = np.linalg.norm(kinematics.joints(row) - kinematics.joints(chord), axis=2)
        off = np.maximum(off, apart.max(axis=1))
        reach = np.linalg.norm(kinematics.joints(row) - places[:-1], axis=2).max(axis=1)
        moves = np.maximum(moves, reach)
    by_chord = np.ceil(np.sqrt(1.5 * off / CHORD))
    by_step = np.ceil(2.0 * moves / (STEP_SHARE * STEP_LIMIT))
    return np.asarray(np.clip(np.maximum(by_chord, by_step), 1, 256).astype(np.int64))


def largest_shares(trajectory: Trajectory, limits: TrajectoryLimits) -> dict[str, float]:
    """Compute what the cubics use of each limit at most, as shares: 1 is the limit itself.

    Returns
    -------
    shares : dict
        `joint_speed`, `joint_acceleration`, `feed_speed`, `feed_acceleration`.
    """
    full = limits.for_links(trajectory.link_length)
    positions, velocities, _ = trajectory.table()
    h = np.diff(trajectory.time)[:, None]
    mean, before, after = np.diff(positions, axis=0) / h, velocities[:-1], velocities[1:]
    # The acceleration of a cubic is linear: largest at an end. The speed is largest there or where that is 0.
    first, last = (6.0 * mean - 4.0 * before - 2.0 * after) / h, (2.0 * before + 4.0 * after - 6.0 * mean) / h
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.clip(np.nan_to_num(first / (first - last), posinf=0.0, neginf=0.0), 0.0, 1.0)
    inner = before + h * turn * (first + 0.5 * turn * (last - first))
    speed = np.maximum(np.abs(inner), np.maximum(np.abs(before), np.abs(after))).max(axis=0)
    acceleration = np.maximum(np.abs(first), np.abs(last)).max(axis=0)
    assert full.feed_speed is not None and full.feed_acceleration is not None  # filled in
    return {
        "joint_speed": float(speed[1:].max()) / full.joint_speed,
        "joint_acceleration": float(acceleration[1:].max()) / full.joint_acceleration,
        "feed_speed": float(speed[0]) / full.feed_speed,
        "feed_acceleration": float(acceleration[0]) / full.feed_acceleration,
    }


def check_trajectory(
    trajectory: Trajectory,
    maze: Maze | Workspace,
    arm: ArmSpec | None = None,
    limits: TrajectoryLimits | None = None,
    progress: Progress | None = None,
) -> ValidationReport:
    """Check a trajectory exactly, at its samples and between them.

    Parameters
    ----------
    trajectory : Trajectory
        From the base of this maze.
    maze : Maze or Workspace
        With the exact walls.
    arm : ArmSpec, optional
        Gives link radius and joint limit. By default thin links without joint limits.
    limits : TrajectoryLimits, optional
        What it has to keep to, but for `LIMIT_TOLERANCE`. By default speeds are not looked at.
    progress : callable, optional
        Called with "validate" and the share that is done.

    Returns
    -------
    report : ValidationReport
        As of a motion, but links may be as deep as the pinch tolerance anywhere; messages name times. Two
        more kinds of fault: "rest", if it does not start and end at rest, and "limits".

    Raises
    ------
    InputError
        If the trajectory belongs to another maze or another arm.
    """
    motion, times = sampled_motion(trajectory)
    report = _validated(motion, maze, arm, progress)
    allowed = PINCH_TOLERANCE * trajectory.link_length
    faults = [
        _timed(fault, trajectory, times)
        for fault in report.faults
        if fault.kind != "penetration" or fault.amount > allowed
    ]
    faults += _timing_faults(trajectory, limits)
    return dataclasses.replace(report, faults=tuple(faults))


def check_motion(
    motion: Motion | SpatialMotion,
    maze: Maze | Workspace,
    arm: ArmSpec | None = None,
    progress: Progress | None = None,
) -> ValidationReport:
    """Check a motion before it is exported.

    Raises
    ------
    InputError
        If the motion is of another maze or arm, or not of its kind.
    ExportRefused
        If it is not valid.
    """
    report = _validated(motion, maze, arm, progress)
    if not report.valid:
        raise ExportRefused(
            f"The motion is not valid in '{maze.name}', so it is not exported: {report.faults[0].message}",
            report,
        )
    return report


def _validated(
    motion: Motion | SpatialMotion, maze: Maze | Workspace, arm: ArmSpec | None, progress: Progress | None
) -> ValidationReport:
    if isinstance(motion, Motion) and isinstance(maze, Maze):
        return validate(motion, maze, arm, progress)
    if isinstance(motion, SpatialMotion) and isinstance(maze, Workspace):
        return validate_in_space(motion, maze, arm, progress)
    raise InputError("Expected a motion in the plane with a maze, or one in space with a workspace.")


def _timed(fault: Fault, trajectory: Trajectory, times: FloatArray) -> Fault:
    """Say of a fault of the poses that were checked at what time it is."""
    message = re.sub(
        r"between poses (\d+) and (\d+)",
        lambda found: f"between {times[int(found[1])]:.3f} s and {times[int(found[2])]:.3f} s",
        fault.message,
    )
    message = re.sub(r"at pose (\d+)", lambda found: f"at {times[int(found[1])]:.3f} s", message)
    sample = int(np.searchsorted(trajectory.time, times[fault.pose], side="right")) - 1
    return dataclasses.replace(fault, message=message, pose=sample)


def _timing_faults(trajectory: Trajectory, limits: TrajectoryLimits | None) -> list[Fault]:
    """Check that the trajectory starts and ends at rest, and keeps to the limits."""
    faults = []
    _, velocities, _ = trajectory.table(1.0 / trajectory.link_length)
    for sample, when in ((0, "starts"), (-1, "ends")):
        speed = float(np.abs(velocities[sample]).max())
        if speed > 1e-9:
            message = (
                f"The trajectory {when} at a speed of {speed:.3g} rad or link lengths per s, not at rest."
            )
            pose = sample % trajectory.n_points
            faults.append(Fault(kind="rest", message=message, pose=pose, link=None, place=None, amount=speed))
    if limits is not None:
        shares = largest_shares(trajectory, limits)
        worst = max(shares, key=lambda name: shares[name])
        if shares[worst] > 1.0 + LIMIT_TOLERANCE:
            message = f"The trajectory uses {shares[worst]:.4g} times the limit of {worst.replace('_', ' ')}."
            amount = shares[worst]
            faults.append(Fault(kind="limits", message=message, pose=0, link=None, place=None, amount=amount))
    return faults


def safe_trajectory(
    motion: Motion | SpatialMotion,
    maze: Maze | Workspace,
    arm: ArmSpec | None = None,
    limits: TrajectoryLimits | None = None,
    *,
    rate: float = DEFAULT_RATE,
    progress: Progress | None = None,
) -> tuple[Trajectory, ValidationReport]:
    """Give a motion time, and check what comes of it; go closer to the motion where that fails.

    Parameters
    ----------
    motion : Motion or SpatialMotion
        Valid in this maze.
    maze, arm
        As in `check_trajectory`.
    limits : TrajectoryLimits, optional
        By default those that the class names.
    rate : float
        Samples per second.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    trajectory : Trajectory
        Valid, and within the limits.
    report : ValidationReport
        Of the trajectory.

    Raises
    ------
    InputError
        If limits or rate are out of range, or toppra is not installed.
    ExportRefused
        If the motion is not valid in this maze, or no trajectory near it is.
    """
    limits = TrajectoryLimits() if limits is None else limits
    limits.arrays(motion.link_length, 1)
    report = check_motion(motion, maze, arm, progress)
    for share in DEVIATIONS:
        deviation = share * PINCH_TOLERANCE
        trajectory = time_parametrise(
            motion, limits, rate=rate, deviation=deviation, units=maze.units, progress=progress
        )
        report = check_trajectory(trajectory, maze, arm, limits, progress)
        if report.valid:
            return trajectory, report
        if trajectory.deviation > HOPELESS * deviation * motion.link_length:
            break
    raise ExportRefused(
        f"No trajectory at {rate:g} samples per second keeps to this motion: {report.faults[0].message} "
        f"Try a larger --rate, or lower speeds and accelerations.",
        report,
    )
