"""The joint track of the sweep: the line that links aim at, the track that grows along it, and its poses."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hrsnake_env.arm import ArmSpec, configuration_from_joints
from hrsnake_env.maze import Maze
from planners.clock import now
from planners.corners import Corner
from planners.kernels import sweep as kernel
from planners.kernels.types import FloatArray, IntArray
from planners.problem import Motion
from planners.room import TooLarge, most_poses
from planners.survey import Geometry

__all__ = ["Fineness", "Track", "aim_line", "grow", "motion_of"]

REACH_OF_CORNER = 1.2
"""The aim is the path itself farther than this from any corner, in link lengths."""

SMOOTHING = 0.6
"""Width of the moving average over the aim's side, in link lengths."""

SHORTENED = 0.997
"""Share of a beam that is aimed at: a joint exactly on a wall has no free direction or all."""

LONGEST_BEAM = 1.2
"""Beams are cut to this many passage widths: at a junction they reach down other corridors."""

SOFTENING = 8.0
"""Turn in place that a link length of feed allows, in rad."""

PAD = 3e-4
"""Kept from the walls by every link, in rad about its base-side joint."""

SEARCH_REACH = 0.5
"""How far the closest path point may move between vertices, in link lengths of arclength."""

CHUNK = 20_000
"""Vertices between two looks at the clock."""

POSED = 200_000
"""Links that are posed between two looks at the clock."""


class Fineness(NamedTuple):
    """Say how finely a track is drawn.

    Parameters
    ----------
    per_link : int
        Vertices per link length.
    overlap : float
        As in `planners.kernels.sweep.grow_track`.
    step : float
        Largest movement of a joint between poses, in link lengths, where the resolution allows.
    deviation : float
        Largest distance of a joint from its chord between poses, in link lengths, likewise.
    options : int
        How many other ways are tried at a trouble.
    """

    per_link: int
    overlap: float
    step: float
    deviation: float
    options: int


@dataclass(frozen=True, eq=False, kw_only=True)
class Track:
    """Hold a joint track, as `planners.kernels.sweep.grow_track` fills it.

    The arrays have room for more than its n vertices, of which the first are those of an earlier track.
    """

    fineness: Fineness
    n: int
    resumed: int
    ending: int
    aim: FloatArray
    points: FloatArray
    start: IntArray
    headings: FloatArray
    indices: IntArray
    credits: FloatArray
    waits: IntArray
    first: IntArray
    gaps: FloatArray

    @property
    def reached(self) -> bool:
        """Whether it ends at the goal."""
        return self.ending == kernel.GOAL

    @property
    def index(self) -> int:
        """Index of the path point closest to its end."""
        return int(self.indices[self.n - 1])

    @property
    def chain(self) -> FloatArray:
        """The arm with its tip at the end of the track, tip first, shape (n_joints, 2)."""
        vertices = [self.n - 1]
        while vertices[-1] > self.fineness.per_link:
            vertices.append(int(self.start[vertices[-1]]))
        return self.points[vertices]


def aim_line(
    geometry: Geometry, corners: list[Corner], variants: list[tuple[float, float]], link_length: float
) -> FloatArray:
    """Compute the line at which links aim their ends.

    Near a corner it runs along the outer beam ends, elsewhere along the path, and it fades into the goal.

    Parameters
    ----------
    geometry : Geometry
        Path and beams.
    corners : list of Corner
        Along the path.
    variants : list of two floats each
        For each corner its displacement along the path in link lengths, and its amplitude in [0, 1].
    link_length : float
        In maze units.

    Returns
    -------
    line : array, shape (n, 2)
        One point for each path point.
    """
    path, beams = geometry.path, geometry.beams
    lateral, nearest = np.zeros(len(path.s)), np.full(len(path.s), REACH_OF_CORNER * link_length)
    for corner, (shift, amplitude) in zip(corners, variants, strict=True):
        first, last = path.s[corner.first] + shift * link_length, path.s[corner.last] + shift * link_length
        distance = np.maximum(np.maximum(first - path.s, path.s - last), 0.0)
        near = distance < nearest
        lateral[near], nearest[near] = -corner.turn * amplitude, distance[near]
    window = max(1, round(SMOOTHING * link_length / path.s[1]))
    padded = np.pad(lateral, (window // 2, window - 1 - window // 2), mode="edge")
    lateral = np.convolve(padded, np.full(window, 1.0 / window), mode="valid")
    lateral *= np.minimum(1.0, (path.length - path.s) / link_length)
    outer = np.where(lateral > 0.0, beams.left_lengths, beams.right_lengths)
    outer = SHORTENED * np.minimum(outer, LONGEST_BEAM * path.width)
    return path.points + (lateral * outer)[:, None] * beams.normals


def grow(
    geometry: Geometry,
    arm: ArmSpec,
    fineness: Fineness,
    aim: FloatArray,
    earlier: Track | None = None,
    deadline: float = math.inf,
) -> Track:
    """Grow a joint track along an aim line.

    Parameters
    ----------
    geometry : Geometry
        Path and walls.
    arm : ArmSpec
        Link length and joint limit.
    fineness : Fineness
        Of the track.
    aim : array, shape (n, 2)
        One point for each path point (`aim_line`).
    earlier : Track, optional
        Of the same fineness, with another aim: the new track is the same up to where the aims differ.
    deadline : float
        When to stop, on the clock of `planners.clock.now`.
    """
    path, length = geometry.path, float(arm.link_length)
    n_lengths = path.length / length
    # Someone in the arm is always moving fast, so vertices grow with links times corners.
    n_max = int((0.6 * n_lengths**2 + 12.0 * n_lengths + 40.0) * fineness.per_link)
    track = Track(
        fineness=fineness,
        n=0,
        resumed=0,
        ending=kernel.FULL,
        aim=aim,
        points=np.empty((n_max, 2)),
        start=np.empty(n_max, dtype=np.int64),
        headings=np.empty(n_max),
        indices=np.empty(n_max, dtype=np.int64),
        credits=np.empty(n_max),
        waits=np.empty(n_max, dtype=np.int64),
        first=np.empty(n_max + 2, dtype=np.int64),
        gaps=np.empty((8 * n_max, 2)),
    )
    resumed = 0 if earlier is None else _common(track, earlier, path.s, length)
    n, ending = resumed, kernel.PAUSED
    while ending == kernel.PAUSED and (n == resumed or now() < deadline):
        n, ending = kernel.grow_track(
            length,
            math.inf if arm.joint_limit is None else float(arm.joint_limit),
            geometry.maze.base_pose,
            geometry.maze.goal,
            geometry.maze.goal_radius,
            path.points,
            path.length - path.s,
            aim,
            max(1, round(SEARCH_REACH * length / path.s[1])),
            geometry.maze.walls,
            fineness.per_link,
            fineness.overlap,
            PAD,
            SOFTENING,
            n,
            n + CHUNK,
            track.points,
            track.start,
            track.headings,
            track.indices,
            track.credits,
            track.waits,
            track.first,
            track.gaps,
            np.empty(len(track.gaps), dtype=np.bool_),
        )
    return dataclasses.replace(track, n=n, resumed=resumed, ending=ending)


def _common(track: Track, earlier: Track, s: FloatArray, length: float) -> int:
    """Copy what a track has in common with an earlier one, and return its number of vertices."""
    differs = np.flatnonzero((track.aim != earlier.aim).any(axis=1))
    if not len(differs):
        return 0
    # A link looks ahead to where the aim leaves its reach, hardly farther along the path than its end is.
    begin = s[differs[0]] - length
    ahead = np.flatnonzero(s[earlier.indices[: earlier.n]] > begin)
    n = int(ahead[0]) if len(ahead) else earlier.n
    if n <= 2 * track.fineness.per_link + 1:
        return 0
    for name in ("points", "start", "headings", "indices", "credits", "waits"):
        getattr(track, name)[:n] = getattr(earlier, name)[:n]
    track.first[: n + 1] = earlier.first[: n + 1]
    track.gaps[: track.first[n]] = earlier.gaps[: track.first[n]]
    return n


def motion_of(track: Track, length: float, maze: Maze, deadline: float = math.inf) -> Motion | None:
    """Make poses of a track, thinned to the largest step of its fineness; None if time is over before.

    Raises
    ------
    TooLarge
        If the poses take more memory than a motion may.
    """
    per_link, step = track.fineness.per_link, track.fineness.step * length
    kept = np.empty(track.n, dtype=np.int64)
    most = 8.0 * track.fineness.deviation
    n_kept = kernel.thin_track(track.n, track.points, track.start, track.headings, per_link, step, most, kept)
    kept = kept[:n_kept]
    n_links = max(1, kernel.chain_length(int(kept[-1]), track.start, per_link))
    if n_kept > most_poses(n_links):
        x, y = (float(value) for value in track.points[track.n - 1])
        raise TooLarge((x, y), n_kept, n_links)
    joints, feed = np.empty((n_kept, n_links + 1, 2)), np.empty(n_kept)
    angles, before = np.empty((n_kept, n_links)), np.zeros((1, n_links))
    rows = max(1, POSED // n_links)
    for first in range(0, n_kept, rows):
        if first > 0 and now() >= deadline:
            return None
        part = slice(first, first + rows)
        kernel.pose_joints(
            kept[part], track.points, track.start, per_link, length, maze.base_pose, joints[part]
        )
        feed[part], turns = configuration_from_joints(joints[part], length, maze.base_pose)
        angles[part] = np.unwrap(np.concatenate([before, turns]), axis=0)[1:]
        before = angles[part][-1:]
    return Motion(joints=joints, joint_angles=angles, feed=feed, link_length=length, base_pose=maze.base_pose)
