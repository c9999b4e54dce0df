"""Time for a motion: as fast as joints and feed allow, with TOPP-RA, and still on the motion's way.

1. The poses become a path without corners, a cubic B-spline near them (`planners.export.rounding`).
2. TOPP-RA finds the fastest way along it within the limits of speed and acceleration, from rest to rest.
3. What comes of that is sampled at the controller's rate, and the samples become the control points of a
   cubic B-spline in time. Its speeds and accelerations are averages of those before, so they keep to the
   limits between the samples, too; they change without a jump; and the cubics through its positions and
   velocities, which controllers drive, are that spline itself.
"""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from planners.checks.tolerances import PINCH_TOLERANCE
from planners.export.kinematics import configurations, kinematics_of
from planners.export.rounding import Polyline, RoundedPath, release_ways, rounded_path
from planners.export.trajectory import DEFAULT_RATE, LARGEST_RATE, Trajectory, TrajectoryLimits
from planners.problem import Motion, Progress
from planners.spatial.problem import SpatialMotion

__all__ = ["LONGEST", "fastest_duration", "time_parametrise"]

LONGEST = 20_000_000
"""Numbers that the positions of a trajectory may be: samples times joints."""

STRETCHES = 12
"""How often the time is stretched at most where limits are found to be exceeded."""

GRID_STEP = 1e-9
"""Places closer than this to another are one, in link lengths."""

RELEASE_SHARES = (-0.5, 0.0, 1.0, 1.5)
"""Where the arm is slow around the release of a joint, as shares of the way to where it starts to bend."""

REACH = 3.0
"""Steps between samples over which a control point of a cubic spline in time acts before and after."""


def time_parametrise(
    motion: Motion | SpatialMotion,
    limits: TrajectoryLimits | None = None,
    *,
    rate: float = DEFAULT_RATE,
    deviation: float = PINCH_TOLERANCE / 2.0,
    units: str = "px",
    progress: Progress | None = None,
) -> Trajectory:
    """Give a motion the shortest time within limits, from rest to rest.

    Parameters
    ----------
    motion : Motion or SpatialMotion
        The poses.
    limits : TrajectoryLimits, optional
        By default those that the class names.
    rate : float
        Samples per second.
    deviation : float
        How far the rounded path may take a joint from where the motion has it, in link lengths.
    units : str
        The maze's unit of length, for those who read the trajectory.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    trajectory : Trajectory
        It keeps to the limits at every moment; whether it is still free of walls is not known
        (`planners.export.checking`).

    Raises
    ------
    InputError
        If toppra is not installed, the rate or the limits are out of range, or the motion does not move.
    """
    if not is_number(rate) or not 0.1 <= rate <= LARGEST_RATE:
        raise InputError(
            f"Expected a rate between 0.1 and {LARGEST_RATE:g} samples per second, got {rate!r}."
        )
    if not is_number(deviation) or not 1e-9 <= deviation <= 1.0:
        raise InputError(f"Expected a deviation between 1e-9 and 1 link lengths, got {deviation!r}.")
    limits = TrajectoryLimits() if limits is None else limits
    poses, kinematics = configurations(motion), kinematics_of(motion)
    speeds, accelerations = limits.arrays(motion.link_length, poses.shape[1] - 1)
    line = Polyline(poses)
    if line.length == 0.0:
        raise InputError("Expected a motion that moves, got one that stays where it is.")
    release = release_ways(
        line, motion.n_links, longest=REACH * float(speeds[0]) / rate, deviation=deviation / 2.0
    )
    path = rounded_path(line, kinematics, deviation=deviation, release=release, progress=progress)
    places = _grid(path, release)
    feed_speeds = _feed_speeds(path.spline(places)[:, 0], release, float(speeds[0]), float(rate))
    clock = _fastest(path, places, feed_speeds, speeds, accelerations)
    samples, stays = _sampled(path, clock, places, speeds, accelerations, float(rate))
    if progress is not None:
        progress("time", 1.0)
    apart = kinematics.joints((samples[:-2] + 4.0 * samples[1:-1] + samples[2:]) / 6.0)
    apart = np.linalg.norm(apart - kinematics.joints(line(stays)), axis=2)
    return _trajectory(motion, samples, float(rate), units, motion.link_length * float(apart.max()))


def fastest_duration(motion: Motion | SpatialMotion, limits: TrajectoryLimits | None = None) -> float:
    """Return the time that the feed alone would take at full speed, in s: no trajectory is shorter."""
    full = (TrajectoryLimits() if limits is None else limits).for_links(motion.link_length)
    assert full.feed_speed is not None  # filled in
    return float(np.abs(np.diff(motion.feed)).sum() / full.feed_speed)


def _toppra() -> Any:
    try:
        import toppra
    except ImportError:
        raise InputError(
            "Expected toppra, which gives motions their time; install it with: pip install 'hrsnake[export]'"
        ) from None
    logging.getLogger("toppra").setLevel(logging.ERROR)
    return toppra


class _ToppraPath:
    """The path as toppra asks for it; only what moves, so that the programs it solves stay small."""

    def __init__(self, path: RoundedPath, moving: NDArray[np.bool_]) -> None:
        self._splines = [path.spline, path.spline.derivative(1), path.spline.derivative(2)]
        self._moving = moving
        self.dof = int(moving.sum())
        self.path_interval = np.array([path.breaks[0], path.breaks[-1]])
        self.waypoints = None

    def __call__(self, places: Any, order: int = 0) -> FloatArray:
        return np.asarray(self._splines[order](places)[..., self._moving])

    def eval(self, places: Any) -> FloatArray:
        """Return configurations."""
        return self(places)

    def evald(self, places: Any) -> FloatArray:
        """Return first derivatives."""
        return self(places, 1)

    def evaldd(self, places: Any) -> FloatArray:
        """Return second derivatives."""
        return self(places, 2)


def _grid(path: RoundedPath, release: FloatArray) -> FloatArray:
    """Choose places along the path for TOPP-RA: breaks, middles, and where joints are released slowly."""
    grid = np.sort(np.concatenate([path.breaks, 0.5 * (path.breaks[:-1] + path.breaks[1:])]))
    feed = path.spline(grid)[:, 0]
    found = [grid]
    for joint in np.flatnonzero(release < release.max(initial=0.0)):
        for share in RELEASE_SHARES:
            level = len(release) - joint + share * release[joint]
            crossed = np.flatnonzero((feed[:-1] - level) * (feed[1:] - level) < 0.0)
            part = (level - feed[crossed]) / (feed[crossed + 1] - feed[crossed])
            found.append(grid[crossed] + part * (grid[crossed + 1] - grid[crossed]))
    return _apart(np.sort(np.concatenate(found)))


def _apart(places: FloatArray) -> FloatArray:
    """Leave out of sorted places those that are next to the one before, but never the last."""
    keep = np.concatenate([[True], np.diff(places) > GRID_STEP])
    kept = places[keep]
    kept[-1] = places[-1]
    return np.asarray(kept)


def _feed_speeds(feed: FloatArray, release: FloatArray, fastest: float, rate: float) -> FloatArray:
    """Return the largest speed of the feed at places of this feed, in link lengths per s.

    Between the base and where it starts to bend, a joint has to stay as long as samples act, so that none of
    them bends it before the base.
    """
    speeds = np.full(len(feed), fastest)
    first, last = RELEASE_SHARES[0], RELEASE_SHARES[-1]
    for joint in np.flatnonzero(release < release.max(initial=0.0)):
        share = (feed - (len(release) - joint)) / release[joint]
        near = (share > first - 0.1) & (share < last + 0.1)
        speeds[near] = np.minimum(speeds[near], release[joint] * rate / REACH)
    return speeds


def _fastest(
    path: RoundedPath,
    places: FloatArray,
    feed_speeds: FloatArray,
    speeds: FloatArray,
    accelerations: FloatArray,
) -> FloatArray:
    """Find the fastest way along a path.

    Parameters
    ----------
    path : RoundedPath
        The path.
    places : array, shape (n,)
        Along it, in order, from its start to its end.
    feed_speeds : array, shape (n,)
        Largest speed of the feed at each place, in link lengths per s.
    speeds, accelerations : array, shape (dof,)
        The limits.

    Returns
    -------
    clock : array, shape (n, 2)
        Time, and speed along the path, at each place.
    """
    toppra = _toppra()
    moving = np.ptp(path.spline.c, axis=0) > 0.0
    most = np.repeat(speeds[None], len(places), axis=0)
    most[:, 0] = feed_speeds
    most = most[:, moving]
    both = np.stack([-most, most], axis=2)
    limit = accelerations[moving]
    constraint = toppra.constraint
    speed = constraint.JointVelocityConstraintVarying(lambda place: both[np.searchsorted(places, place)])
    solver = toppra.algorithm.TOPPRA(
        [speed, constraint.JointAccelerationConstraint(np.stack([-limit, limit], axis=1))],
        _ToppraPath(path, moving),
        gridpoints=places,
        solver_wrapper="seidel",
    )
    solver.compute_parameterization(0.0, 0.0)
    along = solver.problem_data.sd_vec
    if along is None or not np.isfinite(along).all() or (along[1:] + along[:-1] <= 0.0).any():
        raise InputError(
            "Expected a motion and limits for which TOPP-RA finds a timing, but it found none: "
            "try larger limits of acceleration."
        )
    times = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(places) / (along[1:] + along[:-1]))])
    return np.stack([times, along], axis=1)


def _place_at(clock: FloatArray, places: FloatArray, times: FloatArray) -> FloatArray:
    """Return the places along the path at times: between grid points the speed changes evenly."""
    before = np.clip(np.searchsorted(clock[:, 0], times, side="right") - 1, 0, len(places) - 2)
    span = clock[before + 1, 0] - clock[before, 0]
    since = np.clip(times - clock[before, 0], 0.0, span)
    gain = (clock[before + 1, 1] - clock[before, 1]) / span
    reached = places[before] + since * (clock[before, 1] + 0.5 * gain * since)
    return np.asarray(np.minimum(reached, places[before + 1]))


def _sampled(
    path: RoundedPath,
    clock: FloatArray,
    places: FloatArray,
    speeds: FloatArray,
    accelerations: FloatArray,
    rate: float,
) -> tuple[FloatArray, FloatArray]:
    """Sample the fastest way; stretch the time until the spline of the samples keeps to the limits.

    Returns
    -------
    control : array, shape (n + 2, dof)
        Control points of the spline in time, one before the first sample and one after the last.
    stays : array, shape (n,)
        The place along the path of each sample.
    """
    stretch = 1.0
    for _ in range(STRETCHES):
        n = max(1, int(np.ceil(clock[-1, 0] * stretch * rate)))
        if n * len(speeds) > LONGEST:
            raise InputError(
                f"Expected a trajectory of at most {LONGEST // len(speeds)} samples, got {n}: "
                "lower the rate or raise the limits."
            )
        reached = _place_at(clock, places, np.linspace(0.0, clock[-1, 0], n + 1))
        reached[[0, -1]] = places[[0, -1]]
        samples = path.spline(reached)
        # Once more at either end: the spline then starts and ends at rest, at the motion's own poses.
        control = np.pad(samples, ((2, 2), (0, 0)), mode="edge")
        steps = np.diff(control, axis=0)
        excess = max(
            float((np.abs(steps).max(axis=0) * rate / speeds).max()),
            float((np.abs(np.diff(steps, axis=0)).max(axis=0) * rate**2 / accelerations).max()) ** 0.5,
        )
        if excess <= 1.0:
            break
        stretch *= excess * (1.0 + 1e-9) + 0.5 / n  # a whole number of samples: at least one more
    return control, np.pad(reached, 1, mode="edge")


def _trajectory(
    motion: Motion | SpatialMotion, control: FloatArray, rate: float, units: str, deviation: float
) -> Trajectory:
    """Read positions, velocities and accelerations off the spline with these control points."""
    before, here, after = control[:-2], control[1:-1], control[2:]
    tables = [
        (before + 4.0 * here + after) / 6.0,
        0.5 * rate * (after - before),
        rate**2 * ((after - here) - (here - before)),
    ]
    shape = (len(here), *motion.joint_angles.shape[1:])
    feeds = [motion.link_length * table[:, 0] for table in tables]
    angles = [table[:, 1:].reshape(shape) for table in tables]
    return Trajectory(
        time=np.arange(len(here)) / rate,
        feed=feeds[0],
        joint_angles=angles[0],
        feed_velocity=feeds[1],
        joint_velocities=angles[1],
        feed_acceleration=feeds[2],
        joint_accelerations=angles[2],
        link_length=motion.link_length,
        base_pose=motion.base_pose,
        units=units,
        n_poses=motion.n_poses,
        deviation=deviation,
    )
