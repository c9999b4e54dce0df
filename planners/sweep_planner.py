"""The causal planner at the physical limit: the paper's aim, inside exact viable intervals.

Three things are changed in the paper's method (section 3). All links share one joint track instead of a
memory per link, so a joint passes exactly where the joint ahead of it has passed. Every link aims its end,
not its tangent, at the outer beam end of the corner nearest to that end. And of the directions that are free
now only those are taken that stay free during the next link length of feed (viable intervals), so no link is
led into a gap that closes; links then become tangent to corners by themselves.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.corners import Corner, critical_corners
from planners.kernels import sweep as kernel
from planners.kernels.types import FloatArray, IntArray
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.survey import Geometry

__all__ = ["aim_line", "plan_sweep"]

RESOLUTIONS = (64, 96, 160)
"""Vertices per link length, tried in this order: the finer ones gain the last percent of length."""

MIN_CURVATURE = 0.4
"""Of a corner, times the passage width: half the paper's, so that turns of 40 degrees are seen."""

MAX_INNER_BEAM = 0.6
"""Of a corner, in passage widths."""

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

STEP = 0.03
"""Largest movement of a joint between poses, in link lengths, where the track's resolution allows."""

SEARCH_REACH = 0.5
"""How far the closest path point may move between vertices, in link lengths of arclength."""

VARIANTS = (
    (-0.15, 1.0),
    (-0.3, 1.0),
    (0.0, 1.0),
    (0.15, 1.0),
    (-0.15, 0.5),
    (-0.45, 1.0),
    (0.3, 1.0),
    (-0.15, 0.0),
)
"""How a corner is taken: by how many link lengths along the path its aim is displaced, and how far out it
swings. The first is the default; at a dead end the others are tried at the corner and at the one before."""

MAX_ATTEMPTS = 150
"""Tracks that are tried at one resolution."""

MAX_VERTICES = 600_000
"""Vertices that all tracks of one resolution may have together: a few seconds of work."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _Track:
    """Hold a joint track, as `planners.kernels.sweep.grow_track` fills it."""

    per_link: int
    n: int
    ending: int
    points: FloatArray
    start: IntArray
    index: int

    @property
    def reached(self) -> bool:
        return self.ending == kernel.GOAL


def plan_sweep(query: Query) -> Candidate:
    """Plan with the sweep: one joint track inside viable intervals.

    Parameters
    ----------
    query : Query
        Maze, arm and terms.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, not yet validated, or the reason why there is none.
    """
    maze, arm, geometry = query.maze, query.arm, query.geometry
    if geometry is None:
        return query.no_path()
    clock = [time.perf_counter()]
    track = _best_track(geometry, query)
    clock.append(time.perf_counter())
    query.tell("plan", 1.0)
    if not track.reached:
        x, y = (float(value) for value in track.points[track.n - 1])
        why = (
            "the joint track has grown out of all proportion to the path"
            if track.ending == kernel.FULL
            else "no direction of its link stays free during the next link length of feed"
        )
        return Candidate(
            status=PlanningStatus.DEAD_END,
            reason=f"With the tip at ({x:.1f}, {y:.1f}) {maze.units}, {why}, in every way tried to take the "
            f"corners before it.",
            failure=Failure(place=(x, y)),
            timings={**geometry.timings, "plan": clock[1] - clock[0]},
        )
    motion = _motion(track, arm.link_length, maze)
    clock.append(time.perf_counter())
    stages = dict(zip(("plan", "poses"), np.diff(clock).tolist(), strict=True))
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings={**geometry.timings, **stages})


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


def _best_track(geometry: Geometry, query: Query) -> _Track:
    """Return the first track that reaches the goal, or else the one that came farthest."""
    best: _Track | None = None
    for number, per_link in enumerate(RESOLUTIONS):
        for attempt, track in enumerate(_attempts(geometry, query.arm, per_link)):
            query.tell("plan", (number + attempt / MAX_ATTEMPTS) / len(RESOLUTIONS))
            if track.reached:
                return track
            if best is None or track.index > best.index:
                best = track
    assert best is not None  # every resolution makes at least one attempt
    return best


def _attempts(geometry: Geometry, arm: ArmSpec, per_link: int) -> Iterator[_Track]:
    """Yield tracks: the default first, and at each dead end other ways to take the corners before it."""
    corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE, MAX_INNER_BEAM)
    chosen = [0] * len(corners)
    track = _grow(geometry, arm, per_link, corners, chosen)
    yield track
    left, work = MAX_ATTEMPTS - 1, track.n
    while corners and not track.reached:
        farther = None
        at = min(range(len(corners)), key=lambda k: _distance_in_indices(corners[k], track.index))
        pair = [k for k in (at - 1, at) if k >= 0]
        options = itertools.product(range(len(VARIANTS)), repeat=len(pair))
        for option in sorted(options, key=sum):
            if left == 0 or work > MAX_VERTICES:
                return
            tried = list(chosen)
            for k, value in zip(pair, option, strict=True):
                tried[k] = value
            if tried == chosen:
                continue
            other = _grow(geometry, arm, per_link, corners, tried)
            left, work = left - 1, work + other.n
            yield other
            if other.index > max(track.index, corners[at].last):
                farther = (other, tried)
                break
        if farther is None:
            return
        track, chosen = farther


def _distance_in_indices(corner: Corner, index: int) -> int:
    return max(corner.first - index, index - corner.last, 0)


def _grow(
    geometry: Geometry, arm: ArmSpec, per_link: int, corners: list[Corner], chosen: list[int]
) -> _Track:
    path, length = geometry.path, float(arm.link_length)
    n_lengths = path.length / length
    # Someone in the arm is always moving fast, so vertices grow with links times corners.
    n_max = int((0.6 * n_lengths**2 + 12.0 * n_lengths + 40.0) * per_link)
    points, start, headings = np.empty((n_max, 2)), np.empty(n_max, dtype=np.int64), np.empty(n_max)
    indices, first = np.empty(n_max, dtype=np.int64), np.empty(n_max + 2, dtype=np.int64)
    n_gaps = 8 * n_max
    n, ending = kernel.grow_track(
        length,
        math.inf if arm.joint_limit is None else float(arm.joint_limit),
        geometry.maze.base_pose,
        geometry.maze.goal,
        geometry.maze.goal_radius,
        path.points,
        path.length - path.s,
        aim_line(geometry, corners, [VARIANTS[k] for k in chosen], length),
        max(1, round(SEARCH_REACH * length / path.s[1])),
        geometry.maze.walls,
        per_link,
        PAD,
        SOFTENING,
        points,
        start,
        headings,
        indices,
        first,
        np.empty((n_gaps, 2)),
        np.empty(n_gaps, dtype=np.bool_),
    )
    return _Track(
        per_link=per_link, n=n, ending=ending, points=points, start=start, index=int(indices[n - 1])
    )


def _motion(track: _Track, length: float, maze: Maze) -> Motion:
    kept = np.empty(track.n, dtype=np.int64)
    n_kept = kernel.thin_track(track.n, track.points, track.start, track.per_link, STEP * length, kept)
    kept = kept[:n_kept]
    n_links = max(1, kernel.chain_length(int(kept[-1]), track.start, track.per_link))
    joints = np.empty((n_kept, n_links + 1, 2))
    kernel.pose_joints(kept, track.points, track.start, track.per_link, length, maze.base_pose, joints)
    return Motion.from_joints(joints, length, maze.base_pose)
