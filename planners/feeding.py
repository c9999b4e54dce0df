"""From a joint track to a motion: every joint runs on one curve, and every link is an exact chord of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planners.clock import now
from planners.kernels import feeding as kernel
from planners.kernels.feeding_sweep import Sweep, sweep_chords
from planners.kernels.types import FloatArray
from planners.problem import Motion
from planners.room import TooLarge, most_poses

__all__ = ["LATE", "STEP", "Feeding", "feed", "motion_along", "motion_of"]

STEP = 0.03
"""Largest movement of a joint between poses, in link lengths."""

POSES_PER_LINK = 120
"""Room for poses per link length of track, at first."""

MOST_POSES_PER_LINK = 2000
"""Largest number of poses per link length of track; a joint that needs more is about to jump."""

CHUNK = 1_000_000
"""Joints that are placed at a time, at most: some hundredths of a second, between which time is looked at."""

ROOM = 100_000_000
"""Joints for which there is room at first, at most: of a long arm all that might be is more than fits."""

LATE = 4
"""How feeding ends where time is over; beside those of `planners.kernels.feeding`."""


UNCHECKED = Sweep(
    walls=np.empty((0, 2, 2)),
    low=np.empty(0),
    high=np.empty(0),
    first=np.empty(0, dtype=np.int64),
    members=np.empty(0, dtype=np.int64),
    crosses=np.empty(0, dtype=np.bool_),
)
"""For feeding whatever the arm may meet."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Feeding:
    """Hold what came of feeding an arm along a track.

    Parameters
    ----------
    poses : array, shape (n_poses, n_links + 1, 2 or 3)
        As far as it went; the tip last.
    ending : int
        One of DONE, JUMP, FULL and MEETS of `planners.kernels.feeding`, or LATE.
    place : tuple of two or three floats
        Where the tip was at the end, in maze units.
    """

    poses: FloatArray
    ending: int
    place: tuple[float, ...]


def feed(
    track: FloatArray,
    link_length: float,
    base_pose: FloatArray,
    step: float = STEP,
    walls: FloatArray | None = None,
    deadline: float = math.inf,
) -> Feeding:
    """Feed an arm along a track, in the plane or in space.

    Parameters
    ----------
    track : array, shape (n, 2 or 3)
        A polyline in maze units that begins at the base and is straight for one link length.
    link_length : float
        In maze units.
    base_pose : array, shape (3,) or, in space, (6,)
        Base position and heading.
    step : float
        Largest movement of a joint between poses, in link lengths.
    walls : array, shape (n_walls, 2, 2), or None
        Segments, in maze units, in the plane alone; if given, feeding ends at the first pose that meets one
        of them or itself. That is before the first pose if chords that end at points of the track do.
    deadline : float
        When to stop, on the clock of `planners.clock.now`.

    Raises
    ------
    TooLarge
        If the poses take more memory than a motion may.
    """
    # About the base: far from the origin, rounding would be more than links are exact to.
    base, heading = kernel.feeder_axis(base_pose)
    centred = base_pose.astype(np.float64)
    centred[: len(base)] = 0.0
    track, arc = _subdivided(track - base, link_length)
    sweep = UNCHECKED
    if walls is not None:
        free, found = sweep_chords(track, arc, link_length, walls - base)
        sweep = Sweep(*found)
        if not free:
            return Feeding(poses=np.empty((0, 0, 2)), ending=kernel.MEETS, place=tuple(base.tolist()))
    n_links = kernel.links_at_end(track, arc, link_length)
    if n_links < 0:
        n_links = math.floor(arc[-1] / link_length) + 2
    most = MOST_POSES_PER_LINK * n_links
    allowed = min(most, most_poses(n_links, track.shape[1]))
    chunk = max(1, CHUNK // (n_links + 1))
    room = min(POSES_PER_LINK * n_links, ROOM // (n_links + 1) + 1, allowed)
    poses = np.empty((room, n_links + 1, track.shape[1]))
    state, segments = np.zeros(5), np.zeros((2, n_links + 1), dtype=np.int64)
    places, n, ending = np.zeros((2, n_links + 1)), 0, kernel.FULL
    while ending == kernel.FULL and n < most:
        if n > 0 and now() >= deadline:
            ending = LATE
            break
        if n == allowed:
            raise TooLarge(tuple((poses[n - 1, -1] + base).tolist()), n, n_links)
        if n == room:
            room = min(2 * room, allowed)
            more = np.empty((room, *poses.shape[1:]))
            more[:n] = poses
            poses = more
        n, ending = kernel.feed_along(
            track, arc, link_length, centred, step * link_length, sweep, poses, min(n + chunk, room),
            state, segments, places,
        )  # fmt: skip
    poses = poses[:n]
    # Links that never leave the feeder are not needed: those behind the base at the end.
    along = poses[-1] @ heading
    aside = np.linalg.norm(poses[-1] - along[:, None] * heading, axis=1)
    inside = (along <= 1e-9 * link_length) & (aside <= 1e-9 * link_length)
    unused = int(np.argmin(inside[1:]))
    poses = poses[:, unused:] + base
    return Feeding(poses=poses, ending=ending, place=tuple(poses[-1, -1].tolist()))


def _subdivided(track: FloatArray, link_length: float) -> tuple[FloatArray, FloatArray]:
    """Return the same polyline without segments of no length or over a quarter link, and its arclength."""
    sizes = np.linalg.norm(np.diff(track, axis=0), axis=1)
    track = track[np.concatenate([[True], sizes > 1e-9 * link_length])]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(track, axis=0), axis=1))])
    parts = np.ceil(np.diff(arc) / (0.25 * link_length)).astype(np.int64)
    index = np.append(np.repeat(np.arange(len(parts)), parts), len(parts))
    first = np.concatenate([[0], np.cumsum(parts)])
    share = (np.arange(len(index)) - first[index]) / np.append(parts, 1)[index]
    after = np.minimum(index + 1, len(track) - 1)
    track = track[index] + share[:, None] * (track[after] - track[index])
    return track, arc[index] + share * (arc[after] - arc[index])


def motion_along(
    track: FloatArray, link_length: float, base_pose: FloatArray, step: float = STEP
) -> Motion | None:
    """Return the motion of an arm fed along a track; None if a joint would jump.

    Parameters
    ----------
    track : array, shape (n, 2)
        A polyline in maze units that begins at the base and is straight for one link length.
    link_length : float
        In maze units.
    base_pose : array, shape (3,)
        Base position and heading.
    step : float
        Largest movement of a joint between poses, in link lengths.

    Examples
    --------
    >>> motion_along(np.array([[0.0, 0.0], [2.5, 0.0]]), 1.0, np.zeros(3))
    Motion(89 poses, 3 links of 1)
    """
    fed = feed(track, link_length, base_pose, step)
    return None if fed.ending != kernel.DONE else motion_of(fed.poses, link_length, base_pose)


def motion_of(poses: FloatArray, link_length: float, base_pose: FloatArray) -> Motion:
    """Return the motion of poses fed along a track, shape (n_poses, n_links + 1, 2)."""
    feed, joint_angles = np.empty(len(poses)), np.empty((len(poses), poses.shape[1] - 1))
    kernel.configurations(poses, link_length, base_pose, feed, joint_angles)
    return Motion(
        joints=poses, joint_angles=joint_angles, feed=feed, link_length=link_length, base_pose=base_pose
    )
