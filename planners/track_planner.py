"""The global planner: one joint track, shaped until every chord of it is free.

The arm comes out of a straight feeder and all links are equal, so all joints can run along one curve, and
the whole motion is free if and only if every chord of one link length is. The track begins as the path and
with short chords, which fit it. As the chords grow, each step moves the whole track by the least-squares
solution of what its chords and samples lack (a banded system), so that news of a corner reach as far as they
must at once. The coarse track is then made finer until the exact poses along it are free.

A motion in a similar maze is a better beginning than the path: the way of its tip is its joint track.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hrsnake_env.arguments import place_text
from planners.clock import now
from planners.feeding import feed, motion_of
from planners.inset import inset_maze
from planners.kernels import feeding as feeding_kernel
from planners.kernels import track as kernel
from planners.kernels.track_solve import find_normals, project_rows, solve_rows
from planners.kernels.track_types import ROW_WIDTH, Chords, Rows
from planners.kernels.track_walls import apply_move, edge_rows, edges_are_free, sample_rows
from planners.kernels.types import FloatArray
from planners.obstruction import wall_nearest_to
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.track_scene import Scene
from planners.track_start import start_from_motion, start_from_path, with_axis

__all__ = ["plan_track"]

COARSE = (12, 24, 48)
"""Samples per link length while the chords grow: the first that keep the track from cutting corners."""

FINE = ((24, 1.0), (24, 4.0), (48, 1.0), (48, 4.0), (96, 4.0), (96, 16.0))
"""Samples per link length, and margins in units of the usual one, tried until the exact poses are free."""

ASIDE, ASIDE_STEPS = (24, 4.0), 6
"""Of those, one that costs little where there is room, and its steps. Where there is none it leads astray:
the next begins where it began."""

MARGIN = 0.3
"""Kept from the walls, over the square of the samples per link: what a track bends between two samples."""

KEPT = 0.3
"""Share of the margin that is enough."""

SHORT_CHORDS = (1.0, 0.7, 0.4)
"""Chords, in link lengths, with which the track may begin: the first that fit it roughly."""

ROUGHLY = 0.05
"""How deep the first chords may be across corners, in link lengths."""

GROWTH = 1.08
"""By how much chords grow at a time, at first."""

LEAST_GROWTH = 1.002
"""Growing by less is given up."""

EASY = 0.02
"""Chords grow on when no corner is farther across than this, in link lengths."""

JUMP = 0.25
"""A corner farther across than this after growing means that the chords have jumped to another place."""

PATIENCE = 12
"""Steps after growing, until less growth is tried."""

SETTLING = 4
"""Steps on the coarse track, at least: they take the kinks out of the line it begins with."""

MOST_GROWING, MOST_STEPS = 400, 40
"""Steps on the coarse track, and on each of the finer ones."""

LEAST_SLOPE, SLOPE_SLACK = 0.1, 4.8
"""Cosine between a chord and the track at its start; a track of n samples per link may fall short by the
slack over n, as it turns by that much from sample to sample."""

LONGEST_SPAN = 5
"""Link lengths of track that one constraint may tie together; a track that coils up more is lost."""

SMOOTH, SMOOTH_DECAY, LEAST_SMOOTH = 1e-4, 0.5, 1e-8
"""Weight of the track's bending at the first step, its factor from step to step, and its smallest value."""


REASONS = {
    kernel.CORNER: "a link that follows it would cut a corner",
    kernel.SLOPE: "it bends so tightly that a joint would jump",
    kernel.ANGLE: "a joint would turn beyond its limit",
    -1: "no arrangement of it was found that the exact poses can follow",
}
"""What may be wrong with a track, by kind of what it lacks."""


@dataclass(frozen=True, kw_only=True)
class _Weights:
    """Hold the weights of the track's bending, of the movement's bending and of the movement itself.

    And the margin from walls, in units of the usual one.
    """

    smooth: float
    stiff: float
    tether: float
    margin: float = 1.0


COARSE_WEIGHTS = _Weights(smooth=SMOOTH, stiff=1e-4, tether=1e-2)
FINE_WEIGHTS = _Weights(smooth=1e-9, stiff=1e-6, tether=1e-3)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Track:
    """Hold a track with its chords, and what they lack.

    Parameters
    ----------
    points : array, shape (n, 2)
        Samples, in link lengths; the first `per_link + 1` are the axis.
    per_link : int
        Samples per link length.
    chord : float
        Length of the chords, in link lengths.
    chords : Chords
        As far as they could be found.
    lacking : array, shape (4, 2)
        By kind (`planners.kernels.track`): how much is lacking, and at which chord; infinite where a chord's
        start slips off the track.
    margin : float
        To be kept from the walls, in link lengths.
    next_points : array, shape (n, 2)
        Where the samples should go.
    poses : array, shape (n_poses, n_links + 1, 2), or None
        Exact poses along the track, in maze units, if they are free.
    """

    points: FloatArray
    per_link: int
    chord: float
    chords: Chords
    lacking: FloatArray
    margin: float
    next_points: FloatArray
    poses: FloatArray | None = None

    def ends(self, number: int) -> tuple[FloatArray, FloatArray]:
        """Return start and end of a chord."""
        chords, points = self.chords, self.points
        start, end = (
            points[k] + f * (points[k + 1] - points[k])
            for k, f in (
                (chords.segment[number], chords.share[number]),
                (chords.end[number], chords.end_share[number]),
            )
        )
        return start, end

    @property
    def fits(self) -> bool:
        """Whether the chords are roughly free."""
        return not self.slips and bool(self.lacking[kernel.CORNER, 0] < ROUGHLY)

    @property
    def slips(self) -> bool:
        """Whether a chord's start has slipped off the track."""
        return bool(np.isinf(self.lacking[kernel.SLOPE, 0]))

    @property
    def good(self) -> bool:
        """Whether nothing is lacking."""
        kept = -KEPT * self.margin
        lacking = self.lacking[:, 0]
        return bool(
            lacking[kernel.CORNER] < kept
            and lacking[kernel.PLACE] < kept
            and lacking[kernel.SLOPE] < 0.5 * LEAST_SLOPE
            and lacking[kernel.ANGLE] <= 0.0
        )

    @property
    def easy(self) -> bool:
        """Whether little enough is lacking for the chords to grow."""
        lacking = self.lacking[:, 0]
        return bool(
            lacking[kernel.CORNER] < EASY
            and lacking[kernel.SLOPE] < LEAST_SLOPE
            and lacking[kernel.ANGLE] < 0.1
        )


def plan_track(query: Query) -> Candidate:
    """Plan with the track planner: one joint track, all of whose chords are free.

    Parameters
    ----------
    query : Query
        Maze, arm and terms. From a warm start the survey of the maze is not needed, unless it fails.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, not yet validated, or the reason why there is none.
    """
    clock = [now()]
    if query.warm_start is not None:
        track, scene = _from_motion(query, query.warm_start)
        clock.append(now())
        if track is not None and scene is not None and track.poses is not None:
            return _solved(track.poses, scene, clock, {})
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    clock = [now()]
    scene = Scene(maze=geometry.maze, length=query.arm.link_length, joint_limit=_limit(query))
    line = start_from_path(scene, scene.scaled(geometry.path.points))
    track = _finished(_grown(line, scene, query), scene, query)
    clock.append(now())
    query.tell("plan", 1.0)
    if track.poses is not None:
        return _solved(track.poses, scene, clock, geometry.timings)
    timings = {**geometry.timings, "plan": clock[1] - clock[0]}
    return _unsolved(track, scene, query, timings)


def _limit(query: Query) -> float:
    return math.inf if query.arm.joint_limit is None else float(query.arm.joint_limit)


def _from_motion(query: Query, motion: Motion) -> tuple[_Track | None, Scene | None]:
    """Shape the joint track of a motion; None where it is of other links or cannot be led to the goal."""
    inset = inset_maze(query.maze, query.arm.link_radius)
    if inset is None or not math.isclose(motion.link_length, query.arm.link_length, rel_tol=1e-9):
        return None, None
    if not np.allclose(motion.base_pose, query.maze.base_pose):
        return None, None
    scene = Scene(maze=inset, length=query.arm.link_length, joint_limit=_limit(query))
    line = start_from_motion(scene, motion)
    if line is None:
        return None, None
    points, per_link = _coarse(line, scene)
    track = _finished(_measured(points, per_link, 1.0, scene, COARSE_WEIGHTS), scene, query)
    if track.poses is None:
        track = _finished(_grown(line, scene, query), scene, query)
    return track, scene


def _coarse(line: FloatArray, scene: Scene) -> tuple[FloatArray, int]:
    """Sample a free line, the axis in front of it, so that it stays free; return samples per link too."""
    for per_link in COARSE:
        points = with_axis(line, per_link)
        if edges_are_free(points, per_link, scene.near):
            break
    return points, per_link


def _measured(points: FloatArray, per_link: int, chord: float, scene: Scene, weights: _Weights) -> _Track:
    """Find what a track lacks, and where its samples should go."""
    n, fixed, near, margin = len(points), per_link + 1, scene.near, weights.margin * MARGIN / per_link**2
    chords, lacking = _room_for_chords(n), np.tile((np.inf, 0.0), (4, 1))
    n_chords, done = kernel.find_chords(points, per_link, chord, chords)
    track = _Track(
        points=points,
        per_link=per_link,
        chord=chord,
        chords=chords,
        lacking=lacking,
        margin=margin,
        next_points=points,
    )
    if done < n:
        lacking[:, 1] = done
        return track
    kernel.find_corners(points, per_link, chord, n_chords, near, np.empty(n, dtype=np.int64), chords)
    rows = _room_for_rows(4 * n_chords + 6 * n)
    slope = LEAST_SLOPE - SLOPE_SLACK / per_link
    n_first = kernel.chord_rows(
        points, per_link, chord, n_chords, chords, margin, slope, scene.joint_limit, rows, lacking
    )
    n_rows = kernel.goal_row(n - 1, points, scene.goal, 0.8 * scene.goal_radius, n_first, rows)
    n_rows = sample_rows(points, fixed, near, margin, n_rows, rows)
    n_rows = edge_rows(points, fixed, near, margin, n_rows, rows)
    lacking[kernel.PLACE, 0] = np.max(rows.wanted[n_first:n_rows], initial=0.0) - margin
    normals, move, new = np.empty((n, 2)), np.empty(n - fixed), np.empty((n, 2))
    find_normals(points, normals)
    width = project_rows(n_rows, fixed, normals, rows) + 1
    if width > LONGEST_SPAN * per_link:
        lacking[:, 0], lacking[:, 1] = np.inf, chords.end[int(lacking[kernel.CORNER, 1])]
        return track
    solve_rows(
        points, normals, fixed, n_rows, rows, weights.smooth, weights.stiff, weights.tether,
        np.empty((n - fixed, width)), np.empty(n - fixed, dtype=np.int64), move, np.empty(n - fixed),
    )  # fmt: skip
    apply_move(points, normals, fixed, move, near, new)
    return replace(track, next_points=new)


def _room_for_chords(n: int) -> Chords:
    most = kernel.MOST_PARTS * n
    return Chords(
        end=np.empty(most, dtype=np.int64),
        end_share=np.empty(most),
        segment=np.empty(most, dtype=np.int64),
        share=np.empty(most),
        depth=np.empty((most, 2)),
        place=np.empty((most, 2)),
        of_sample=np.empty(n, dtype=np.int64),
    )


def _room_for_rows(most: int) -> Rows:
    return Rows(
        samples=np.empty((most, ROW_WIDTH), dtype=np.int64),
        factor=np.empty((most, ROW_WIDTH, 2)),
        slope=np.empty((most, ROW_WIDTH)),
        wanted=np.empty(most),
        weight=np.empty(most),
    )


def _moved(track: _Track, scene: Scene, weights: _Weights, chord: float | None = None) -> _Track:
    """Move the samples of a track to where they should go, and measure it again.

    They are spread evenly again, unless the track would cut a corner then.
    """
    points = with_axis(track.next_points[track.per_link :], track.per_link)
    if not edges_are_free(points, track.per_link, scene.near):
        points = track.next_points
    return _measured(points, track.per_link, track.chord if chord is None else chord, scene, weights)


def _grown(line: FloatArray, scene: Scene, query: Query) -> _Track:
    """Shape a coarse track along a line by letting its chords grow to a link length.

    Returns
    -------
    track : _Track
        With chords of the length that was reached.
    """
    weights, growth, since = COARSE_WEIGHTS, GROWTH, 0
    points, per_link = _coarse(line, scene)
    for chord in SHORT_CHORDS:
        track = _measured(points, per_link, chord, scene, weights)
        if track.fits:
            break
    best: _Track | None = None
    for number in range(MOST_GROWING):
        if (number >= SETTLING and track.easy and track.chord == 1.0) or query.late:
            break
        weights = replace(weights, smooth=max(SMOOTH_DECAY * weights.smooth, LEAST_SMOOTH))
        if track.easy:
            best, since = track, 0
            query.tell("plan", 0.5 * track.chord)
            track = _moved(track, scene, weights, min(track.chord * growth, 1.0))
        elif _is_promising(track, since, best is None):
            track, since = _moved(track, scene, weights), since + 1
        elif best is not None and growth > LEAST_GROWTH:
            growth, since = math.sqrt(growth), 0
            track = _moved(best, scene, weights, min(best.chord * growth, 1.0))
        else:
            break
    return track


def _is_promising(track: _Track, since: int, first: bool) -> bool:
    """Tell whether a track is worth another step; `since` counts those since its chords have grown."""
    if track.slips:
        return False
    return since < MOST_STEPS if first else since < PATIENCE and bool(track.lacking[kernel.CORNER, 0] < JUMP)


def _finished(track: _Track, scene: Scene, query: Query) -> _Track:
    """Make a track finer until the exact poses along it are free."""
    if track.chord < 1.0 or track.slips:
        return track
    for number, (per_link, margin) in enumerate(FINE):
        if per_link < track.per_link:
            continue
        query.tell("plan", 0.5 + 0.5 * number / len(FINE))
        aside, weights = (per_link, margin) == ASIDE, replace(FINE_WEIGHTS, margin=margin)
        settled = _settled(track, per_link, scene, weights, query, ASIDE_STEPS if aside else MOST_STEPS)
        if settled.lacking[kernel.CORNER, 0] <= 0.0 and not (settled.slips or query.late):
            poses = _free_poses(settled, scene, query.deadline)
            if poses is not None:
                return replace(settled, poses=poses)
        if not aside:
            track = settled
        if track.slips or query.late:
            break
    return track


def _settled(
    track: _Track, per_link: int, scene: Scene, weights: _Weights, query: Query, most_steps: int
) -> _Track:
    """Sample a track again and move it until it is good, for some steps at most."""
    track = _measured(with_axis(track.points[track.per_link :], per_link), per_link, 1.0, scene, weights)
    for _ in range(most_steps):
        if track.good or track.slips or query.late:
            break
        track = _moved(track, scene, weights)
    return track


def _free_poses(track: _Track, scene: Scene, deadline: float) -> FloatArray | None:
    """Return the poses along a track if the arm fits it exactly and there is time to make them."""
    maze = scene.maze
    line = scene.unscaled(track.points)
    fed = feed(line, scene.length, maze.base_pose, walls=maze.walls, deadline=deadline)
    return fed.poses if fed.ending == feeding_kernel.DONE else None


def _solved(poses: FloatArray, scene: Scene, clock: list[float], timings: Mapping[str, float]) -> Candidate:
    motion = motion_of(poses, scene.length, scene.maze.base_pose)
    clock.append(now())
    stages = dict(zip(("plan", "poses"), np.diff(clock).tolist(), strict=True))
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings={**timings, **stages})


def _unsolved(track: _Track, scene: Scene, query: Query, timings: Mapping[str, float]) -> Candidate:
    """Say what is worst about a track that is not free."""
    kind = next((k for k in (kernel.CORNER, kernel.SLOPE, kernel.ANGLE) if track.lacking[k, 0] > 0.0), None)
    number = int(track.lacking[kernel.CORNER if kind is None else kind, 1])
    start, end = (track.points[number],) * 2 if track.slips else track.ends(number)
    place, depth = end, None
    if kind == kernel.CORNER and not track.slips:
        side = int(np.argmax(track.chords.depth[number]))
        place = start + track.chords.place[number, side] * (end - start)
        depth = float(track.lacking[kernel.CORNER, 0]) * scene.length
    x, y = (float(value) for value in scene.unscaled(place))
    path_position = None
    if query.geometry is not None:
        nearest = int(np.argmin(np.hypot(*(query.geometry.path.points - (x, y)).T)))
        path_position = float(query.geometry.path.s[nearest])
    why = REASONS[-1 if kind is None or track.slips else kind]
    if track.chord < 1.0:
        why += f"; this track is free for links of up to about {track.chord * scene.length:.4g}"
    late = " when time ran out" if query.late else ""
    return Candidate(
        status=PlanningStatus.OUT_OF_TIME if query.late else PlanningStatus.DEAD_END,
        reason=f"The joint track is not free near {place_text((x, y), scene.maze.size)} {scene.maze.units}"
        f"{late}: {why}.",
        failure=Failure(
            place=(x, y), path_position=path_position, depth=depth, wall=wall_nearest_to(query.maze, (x, y))
        ),
        timings=timings,
    )
