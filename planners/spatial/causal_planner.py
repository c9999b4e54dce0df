"""A joint track in space that is grown from the tip on, knowing the path only some links ahead.

The track planner shapes one curve as a whole. Here the way ahead is seen up to a horizon alone. The track
behind the tip is fixed, as rear joints must run on it. The stretch up to the horizon is shaped as in the
track planner, with its far end on the path. Then the tip advances by a part of a link, which fixes that
much, more of the path comes into sight, and so on. Only what is free is fixed, and as long as anything is
left to try, only what has no cusp.

Where that fails, the chords in sight are grown once more from shorter ones, and then the tip withdraws by up
to half a link on its own track: what it sees by then may ask for an earlier turn. The motion handed on
leaves withdrawals out.

How far one must look is a part of `hrsnake bench spatial`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.clock import now
from planners.kernels import spatial_track as kernel
from planners.path import arclength, resampled
from planners.problem import Failure, PlanningStatus
from planners.spatial.problem import SpatialCandidate
from planners.spatial.query import SpatialQuery, behind_straight
from planners.spatial.track_planner import candidate_along

__all__ = ["HORIZON", "Grown", "grow_track", "plan_causal"]

HORIZON = 2.0
"""How much of the way ahead of the tip is seen, in link lengths."""

ADVANCE = 0.25
"""How far the tip advances at a time, in link lengths."""

PER_LINK = 30
"""Samples per link."""

MARGIN = 0.003
"""Kept from obstacles beyond the link radius, in link lengths."""

KEPT = 0.1
"""Share of the margin that what is fixed must keep at least."""

STRICT = 0.98
"""Share of the joint limit that is kept."""

OUTWARD, SLOPE = 0.5, 0.1
"""As in `kernels.spatial_track.Demand`."""

SHAPING = ((0.3, 20), (0.03, 20), (0.003, 20))
GROWING = ((0.3, 20),)
"""Smoothing and number of iterations, with chords of a link's length and with shorter ones."""

SHORTER = (0.8, 0.85, 0.9, 0.95)
"""Chords from which those in sight are grown again, in link lengths."""

REMEDIES = ((0.0, SHORTER), (0.25, ()), (0.25, ()), (0.5, ()), (0.5, SHORTER))
"""What is tried, one after the other, where the tip cannot advance: links to withdraw, and shorter chords."""

CUSP = 0.7
"""Cosine of the largest turn of the track from sample to sample; a cusp makes a joint run back or jump."""

ASTRAY = 2.5
"""A track that is this many times as long as the path winds about an obstacle which it cannot pass."""


PATIENCE = 6
"""How often a window is shaped at most, for each advance that the path is long."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Grown:
    """Hold what came of growing a track.

    Parameters
    ----------
    status : PlanningStatus
        SOLVED if it reaches the goal, else DEAD_END or OUT_OF_TIME.
    track : array, shape (n, 3)
        From the end of the straight stretch to the goal, or to where the tip could not advance.
    failure : Failure or None
        The chord that is not free at a dead end.
    """

    status: PlanningStatus
    track: FloatArray
    failure: Failure | None = None


def grow_track(query: SpatialQuery, horizon: float = HORIZON) -> Grown:
    """Grow a track from the straight stretch to the goal.

    Parameters
    ----------
    query : SpatialQuery
        With a path. Its warm start is not looked at.
    horizon : float
        How much of the way ahead of the tip is seen, in link lengths; at least `ADVANCE`.
    """
    growth, tries, failed = _Growth(query, horizon), 0, False
    furthest = growth.size
    for _ in range(PATIENCE * (math.ceil(growth.total / (ADVANCE * growth.length)) + len(REMEDIES))):
        if query.late:
            return Grown(status=PlanningStatus.OUT_OF_TIME, track=growth.track)
        query.tell("plan", growth.seen / growth.total)
        growth.look()
        withdrawal, shorter = REMEDIES[tries - 1] if failed else (0.0, ())
        growth.withdraw(withdrawal)
        growth.shape(shorter)
        free = growth.is_free()
        failed = not free or (growth.has_cusp() and tries < len(REMEDIES))
        if failed and tries < len(REMEDIES):
            tries, furthest = tries + 1, max(furthest, growth.size)
            continue
        if failed or growth.astray:
            return Grown(status=PlanningStatus.DEAD_END, track=growth.track, failure=growth.failure())
        growth.advance()
        if growth.arrives:
            return Grown(status=PlanningStatus.SOLVED, track=growth.track)
        if growth.size > furthest:
            tries = 0
    return Grown(status=PlanningStatus.DEAD_END, track=growth.track, failure=growth.failure())


class _Growth:
    """The fixed track up to the tip, and the window: the stretch in sight, from the tip on."""

    def __init__(self, query: SpatialQuery, horizon: float) -> None:
        assert query.path is not None
        workspace, arm = query.workspace, query.arm
        self.length, self.horizon, self.margin = arm.link_length, horizon, MARGIN * arm.link_length
        self.swollen = workspace.obstacles_grown(arm.link_radius)
        self.boxes = workspace.obstacles_grown(arm.link_radius + self.margin)
        self.limit = math.pi if arm.joint_limit is None else STRICT * arm.joint_limit
        self.straight = workspace.straight
        self.path = behind_straight(workspace, query.path.points)
        self.s = arclength(self.path)
        self.total, self.seen, self.arrives = float(self.s[-1]), 0.0, False
        axis = np.linspace(-self.length, 0.0, PER_LINK + 1)[:, None] * workspace.heading
        self.samples = list(self.path[0] + axis)
        self.rears = [0] * len(self.samples)
        """For each fixed sample, the one behind which the chord that ends there starts."""
        self.window = self.path[:1]
        self.points, self.fixed, self.piece = self.window, 1, 1

    @property
    def size(self) -> int:
        """How many samples are fixed."""
        return len(self.samples)

    @property
    def track(self) -> FloatArray:
        """What is fixed of the track, from the straight stretch on."""
        return np.array(self.samples[PER_LINK:])

    @property
    def astray(self) -> bool:
        """Whether the track winds."""
        return self.size * self.length > PER_LINK * ASTRAY * (self.total + self.length)

    def look(self) -> None:
        """See more of the path, up to the horizon."""
        lack = self.horizon * self.length - float(arclength(self.window)[-1])
        if lack <= 0.0 or self.seen >= self.total:
            return
        upto = min(self.seen + lack, self.total)
        more = self.path[(self.s > self.seen) & (self.s < upto)]
        last = [np.interp(upto, self.s, self.path[:, c]) for c in range(3)]
        self.window = np.concatenate([self.window, more, [last]])
        self.seen = upto

    def withdraw(self, links: float) -> None:
        """Take the tip back on its track: what was fixed is in the window again."""
        count = min(int(links * PER_LINK), self.size - PER_LINK - 1)
        if count > 0:
            self.window = np.concatenate([np.array(self.samples[-count - 1 :]), self.window[1:]])
            del self.samples[-count:], self.rears[-count:]

    def shape(self, shorter: tuple[float, ...]) -> None:
        """Shape the window, and say which piece of it the tip is to advance on.

        `points` are those of the window behind `fixed` samples, of which the first chords in it may need.
        """
        behind = np.array(self.samples[max(self.rears[-1] - 2, 0) :])
        self.fixed = len(behind)
        lengths = [(share * self.length, GROWING) for share in shorter] + [(self.length, SHAPING)]
        for length, stages in lengths:
            free = resampled(self.window, self.length / PER_LINK)
            if len(free) < 3:
                free = np.stack([self.window[0], 0.5 * (self.window[0] + self.window[-1]), self.window[-1]])
            self.points = np.concatenate([behind, free[1:]])
            for smoothing, iterations in stages:
                demand = kernel.Demand(length, self.limit, OUTWARD, SLOPE, False)
                kernel.relax(self.points, self.fixed, demand, self.boxes, smoothing, iterations)
            self.window = self.points[self.fixed - 1 :]
        rest, size = float(arclength(self.window)[-1]), len(self.window) - 1
        self.arrives = self.seen >= self.total and rest <= 1.5 * ADVANCE * self.length
        self.piece = size
        if not self.arrives:
            self.piece = min(max(round(ADVANCE * self.length * size / rest), 1), size)

    def is_free(self) -> bool:
        """Tell whether all chords from and to the piece are free, as far as samples tell."""
        points = self.points[: self.fixed + self.piece].copy()
        demand = kernel.Demand(self.length, math.pi, OUTWARD, SLOPE, False)
        depth = kernel.relax(points, self.fixed, demand, self.boxes, 0.0, 1)
        return depth <= (1.0 - KEPT) * self.margin

    def has_cusp(self) -> bool:
        """Tell whether the track turns sharply in the piece or at one of its ends."""
        steps = np.diff(self.points[self.fixed - 2 : self.fixed + self.piece + 1], axis=0)
        steps /= np.maximum(np.linalg.norm(steps, axis=1), 1e-300)[:, None]
        return bool((steps[1:] * steps[:-1]).sum(axis=1).min() < CUSP)

    def advance(self) -> None:
        """Fix the piece."""
        for point in self.points[self.fixed : self.fixed + self.piece]:
            self.samples.append(point)
            rear = self.rears[-1]
            while rear + 2 < self.size and math.dist(self.samples[rear + 1], point) >= self.length:
                rear += 1
            self.rears.append(rear)
        self.window = self.window[self.piece :]

    def failure(self) -> Failure:
        """Return the chord on the piece that is deepest in an obstacle, or where the tip is if none is."""
        points = self.points[: self.fixed + self.piece]
        tip, rear, wall, depth = kernel.deepest_chord(points, self.fixed, self.length, self.swollen)
        way = self.straight + float(arclength(self.track)[-1])
        if depth <= 0.0:
            return Failure(place=tuple(self.track[-1].tolist()), path_position=way)
        return Failure(
            place=tuple(points[tip].tolist()),
            path_position=way + float(arclength(points[self.fixed - 1 : tip + 1])[-1]),
            wall=int(wall),
            depth=float(depth),
            joints=np.stack([rear, points[tip]]),
        )


def plan_causal(query: SpatialQuery, horizon: float = HORIZON) -> SpatialCandidate:
    """Plan by a joint track that is grown from the tip on; the checker says whether the motion is free."""
    if query.path is None:
        return query.no_path()
    begin = now()
    grown = grow_track(query, horizon)
    query.timings["plan"] = now() - begin
    if grown.status is not PlanningStatus.SOLVED:
        return SpatialCandidate(
            status=grown.status, reason=_reason(query, grown), failure=grown.failure, track=grown.track
        )
    return candidate_along(query, grown.track)


def _reason(query: SpatialQuery, grown: Grown) -> str:
    """Say why a track does not reach the goal."""
    if grown.failure is None:
        return f"Time was over before a track was shaped; its tip is at {query.text(grown.track[-1])}."
    tip, units = query.text(grown.track[-1]), query.workspace.units
    link = f"the link of {query.arm.link_length:g} {units}"
    if grown.failure.wall is None:
        return f"The tip cannot advance beyond {tip}: the track of {link} winds without becoming free."
    return (
        f"The tip cannot advance beyond {tip}: {link} that ends at {query.text(grown.failure.place)} is "
        f"{grown.failure.depth:.3g} {units} deep in {query.obstacle_text(grown.failure.wall)}."
    )
