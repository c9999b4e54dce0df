"""The causal planner at the physical limit: the paper's aim, inside exact viable intervals.

Three things are changed in the paper's method (section 3). All links share one joint track instead of a
memory per link, so a joint passes exactly where the joint ahead of it has passed. Every link aims its end,
not its tangent, at the outer beam end of the corner nearest to that end. And of the directions that are free
now only those are taken that stay free during the next link length of feed (viable intervals), so no link is
led into a gap that closes; links then become tangent to corners by themselves.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator

import numpy as np

from hrsnake_env.arguments import length_text, place_text
from planners.clock import now
from planners.corners import critical_corners
from planners.kernels import sweep as kernel
from planners.obstruction import least_depth, wall_nearest_to
from planners.problem import Candidate, Failure, Fault, Motion, PlanningStatus, ValidationReport
from planners.query import Query
from planners.survey import Geometry
from planners.sweep_track import Fineness, Track, aim_line, grow, motion_of

__all__ = ["longest_past", "plan_sweep"]

FINENESSES = (
    Fineness(44, 0.9, 0.045, 8e-4, 12),
    Fineness(96, 0.9, 0.045, 8e-4, 12),
    Fineness(160, 0.9, 0.045, 8e-4, 100),
    Fineness(320, 0.9, 0.045, 8e-4, 100),
)
"""Tried in this order: the finer ones gain the last percent of length."""

QUICK = 2
"""As many of them are tried if the query is not to be answered thoroughly."""

STRICT_OVERLAP, STRICT_STEP, STRICT_DEVIATION = 0.5, 0.02, 3e-4
"""Of a fineness, once the checker has refused a motion of a coarser one for what is between its poses: so
sharp corners of walls are passed without a hop."""

MIN_CURVATURE = 0.4
"""Of a corner, times the passage width: half the paper's, so that turns of 40 degrees are seen."""

MAX_INNER_BEAM = 0.6
"""Of a corner, in passage widths."""

VARIANTS = (
    (-0.15, 1.0),
    (-0.3, 1.0),
    (0.0, 1.0),
    (0.15, 1.0),
    (-0.15, 0.5),
    (-0.45, 1.0),
    (0.3, 1.0),
    (-0.15, 0.0),
    (-0.15, 0.25),
    (-0.15, 0.75),
)
"""How a corner is taken: by how many link lengths along the path its aim is displaced, and how far out it
swings, as a share of the way to the wall. At a dead end the others are tried, in this order, at the corner
and at the one before."""

SWINGS = (7, 8, 4, 9)
"""The variants that swing the least, in order: where links that follow the aim meet no wall, that is how a
corner is taken first; otherwise it is the first of the variants."""

LONGEST_STEPS, LONGEST_RATIO = 220, 0.995
"""How far down, and how finely, the longest link past a place is looked for."""

MAX_ATTEMPTS = 150
"""Tracks that are tried at one fineness."""

MAX_VERTICES = 200_000
"""Vertices that all tracks of one fineness may add to the earlier ones: about a second of work."""


def plan_sweep(query: Query) -> Candidate:
    """Plan with the sweep: one joint track inside viable intervals.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; a warm start is not used.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, or the reason why there is none.
    """
    if query.geometry is None:
        return query.no_path()
    search = _Search(query, query.geometry)
    motion = search.run()
    query.tell("plan", 1.0)
    timings = {**query.geometry.timings, **search.seconds}
    if motion is not None:
        return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings=timings)
    return _failed(query, query.geometry, search.best, timings)


class _Search:
    """Grow tracks, at each trouble with other ways to take the corners before it, until one is accepted."""

    def __init__(self, query: Query, geometry: Geometry) -> None:
        self.query, self.geometry = query, geometry
        self.corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE, MAX_INNER_BEAM)
        self.best: Track | None = None
        self.motion: Motion | None = None
        self.report: ValidationReport | None = None
        self.seconds = {"plan": 0.0, "poses": 0.0}
        self.left, self.work, self.share = MAX_ATTEMPTS, MAX_VERTICES, 0.0

    def run(self) -> Motion | None:
        """Return a motion that the checker accepts; otherwise the last one that it refused, or None."""
        chosen, strict = self._least_swings(), False
        for number, fineness in enumerate(FINENESSES if self.query.thorough else FINENESSES[:QUICK]):
            if strict:
                fineness = fineness._replace(
                    overlap=STRICT_OVERLAP, step=STRICT_STEP, deviation=STRICT_DEVIATION
                )
            self.left, self.work, self.share = MAX_ATTEMPTS, MAX_VERTICES, number / len(FINENESSES)
            track, chosen = self._reach(fineness, chosen)
            if track.reached:
                if self._accepts(track):
                    return self.motion
                if self.motion is None:
                    break
                crossing = self._fault().kind == "crossing"
                if strict or crossing:
                    others = self._other_ways(track, chosen, self._nearest_index(self._fault()))
                    if any(other.reached and self._accepts(other) for other, _ in others):
                        return self.motion
                strict = strict or not crossing
            if self.query.late:
                break
        return self.motion

    def gets_past(self, s: float, fineness: Fineness) -> bool:
        """Tell whether a track gets beyond a place on the path, s in maze units from the base."""
        self.left, self.work, self.share = MAX_ATTEMPTS, MAX_VERTICES, 0.0
        track, _ = self._reach(fineness, self._least_swings())
        return track.reached or bool(self.geometry.path.s[track.index] > s)

    def _reach(self, fineness: Fineness, chosen: list[int]) -> tuple[Track, list[int]]:
        """Grow tracks until one reaches the goal or no other way gets farther; return it and its ways."""
        track = self._grow(fineness, chosen, None)
        while not track.reached:
            trouble = track.index
            for other, tried in self._other_ways(track, chosen, trouble):
                last = self.corners[self._nearest_corner(trouble)].last
                if other.reached or other.index > max(trouble, last):
                    track, chosen = other, tried
                    break
            else:
                break
        return track, chosen

    def _least_swings(self) -> list[int]:
        """Choose for each corner the least swing at which links that follow the aim meet no wall."""
        chosen = [0] * len(self.corners)
        length, path = float(self.query.arm.link_length), self.geometry.path
        blocked = np.empty(len(path.s), dtype=np.bool_)
        for variant in reversed(SWINGS):
            line = aim_line(self.geometry, self.corners, [VARIANTS[variant]] * len(chosen), length)
            kernel.blocked_chords(line, length, self.geometry.maze.walls, blocked)
            for k, corner in enumerate(self.corners):
                begin = int(np.searchsorted(path.s, path.s[corner.first] - length))
                if not blocked[begin : corner.last + 1].any():
                    chosen[k] = variant
        return chosen

    def _other_ways(self, track: Track, chosen: list[int], trouble: int) -> Iterator[tuple[Track, list[int]]]:
        """Grow tracks that take the corner nearest to the trouble, and the one before it, in other ways."""
        if not self.corners:
            return
        at = self._nearest_corner(trouble)
        pair = [k for k in (at - 1, at) if k >= 0]
        options = itertools.product(range(len(VARIANTS)), repeat=len(pair))
        for option in sorted(options, key=sum)[: track.fineness.options]:
            if self.left == 0 or self.work <= 0 or self.query.late:
                return
            tried = list(chosen)
            for k, value in zip(pair, option, strict=True):
                tried[k] = value
            if tried != chosen:
                yield self._grow(track.fineness, tried, track), tried

    def _nearest_corner(self, index: int) -> int:
        return min(
            range(len(self.corners)),
            key=lambda k: max(self.corners[k].first - index, index - self.corners[k].last, 0),
        )

    def _grow(self, fineness: Fineness, chosen: list[int], earlier: Track | None) -> Track:
        """Grow a track, from where its aim begins to differ from that of an earlier one."""
        clock = now()
        aim = aim_line(
            self.geometry,
            self.corners,
            [VARIANTS[k] for k in chosen],
            float(self.query.arm.link_length),
        )
        track = grow(self.geometry, self.query.arm, fineness, aim, earlier, self.query.deadline)
        self.left, self.work = self.left - 1, self.work - (track.n - track.resumed)
        if self.best is None or track.index > self.best.index:
            self.best = track
        self.seconds["plan"] += now() - clock
        self.query.tell("plan", self.share + (1.0 - self.left / MAX_ATTEMPTS) / len(FINENESSES))
        return track

    def _accepts(self, track: Track) -> bool:
        """Make the motion of a track and ask the checker about it; without a checker, accept it.

        If there is no time to make it, there is no motion then.
        """
        clock = now()
        query = self.query
        self.motion = motion_of(track, query.arm.link_length, query.maze, query.deadline)
        self.seconds["poses"] += now() - clock
        if self.motion is None:
            return False
        self.report = self.query.check(self.motion)
        return self.report is None or self.report.valid

    def _fault(self) -> Fault:
        assert self.report is not None  # the last motion was refused
        return self.report.faults[0]

    def _nearest_index(self, fault: Fault) -> int:
        place = self.geometry.maze.goal if fault.place is None else np.asarray(fault.place)
        away = self.geometry.path.points - place
        return int(np.argmin(np.hypot(*away.T)))


def longest_past(query: Query, s: float) -> float | None:
    """Find the longest link that the sweep brings beyond a place on the path.

    Parameters
    ----------
    query : Query
        Whose arm has links too long for it.
    s : float
        Arclength of the place along the path, in maze units.

    Returns
    -------
    length : float or None
        To half a percent; None if there is none of at least a third of the arm's, or time ran out.
    """
    wanted = float(query.arm.link_length)
    if query.geometry is None:
        return None
    for step in range(1, LONGEST_STEPS):
        length = wanted * LONGEST_RATIO**step
        # Lengths that fail may be isolated: the first that passes from above counts, none is skipped.
        arm = dataclasses.replace(query.arm, link_length=length)
        if _Search(dataclasses.replace(query, arm=arm), query.geometry).gets_past(s, FINENESSES[1]):
            return length
        if query.late:
            return None
    return None


def _failed(query: Query, geometry: Geometry, track: Track | None, timings: dict[str, float]) -> Candidate:
    assert track is not None  # every search grows at least one track
    x, y = (float(value) for value in track.points[track.n - 1])
    path, length = geometry.path, float(query.arm.link_length)
    status, why = (
        PlanningStatus.DEAD_END,
        "no direction of its link stays free during the next link length of feed",
    )
    if track.ending == kernel.FULL:
        why = "the joint track has grown out of all proportion to the path"
    if query.late:
        status, why = PlanningStatus.OUT_OF_TIME, "time was over"
    # Its start comes over the track already drawn and, if all goes well, the aim: there the link has to turn.
    drawn = slice(max(int(track.start[track.n - 1]), 0), track.n)
    along = np.unwrap(np.arctan2(path.tangents[:, 1], path.tangents[:, 0]))
    beyond = min(int(np.searchsorted(path.s, path.s[track.index] + length)), len(along) - 1)
    heading = float(track.headings[track.n - 1])
    heading += 2.0 * math.pi * round((along[track.indices[drawn.start]] - heading) / (2.0 * math.pi))
    every = max(1, (drawn.stop - drawn.start) // max(beyond - track.index, 1))
    starts = np.concatenate([track.points[drawn][::every], track.aim[track.index : beyond]])
    deepest = least_depth(geometry.maze, starts, heading, float(along[beyond]) - heading, length)
    if deepest is None:  # in an S-bend it is the turn in its middle that is hard
        between = along[track.index : beyond + 1]
        farthest = float(between[np.argmax(np.abs(between - heading))])
        deepest = least_depth(geometry.maze, starts, heading, farthest - heading, length)
    what = " A single link could turn there; the track must be free for those that follow on it, too."
    if deepest is not None:
        depth, place = deepest
        what = (
            f" To turn as the path does, its link would get at least {depth:.3g} {query.maze.units} deep "
            f"into the wall at {place_text(place, query.maze.size)}."
        )
    return Candidate(
        status=status,
        reason=f"With the tip at {place_text((x, y), query.maze.size)} {query.maze.units}, "
        f"{length_text(path.s[track.index], query.maze.size)} along the path, {why}, in every way "
        f"tried to take the corners before it.{what}",
        failure=Failure(
            place=(x, y),
            path_position=float(path.s[track.index]),
            link=0,
            wall=None if deepest is None else wall_nearest_to(query.maze, deepest[1]),
            depth=None if deepest is None else deepest[0],
            joints=track.chain[::-1],
        ),
        timings=timings,
    )
