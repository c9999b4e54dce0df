"""The joint track in space: one curve, shaped until every link on it is free of every obstacle.

Links that run on a curve are chords of it. The planner starts from the path of the point robot with chords so
short that they are free, and lets them grow to the length of the links. Whatever chord is in an obstacle is
pushed out of it by the smallest translation that separates the two, and takes the curve with it as a lever
(`planners.kernels.spatial_track`). As chords grow by little at a time each push is small, and the curve stays
on its side of every edge. Then the curve is sampled more finely, and the arm is fed along it.

The smallest translation is across a face of the box or across one of its edges. That pushes across edges are
among them is what makes the edge of a window act as a corner does in the plane.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.clock import now
from planners.feeding import feed
from planners.kernels import feeding as feeding_kernel
from planners.kernels import spatial_track as kernel
from planners.path import arclength, resampled
from planners.problem import Failure, PlanningStatus
from planners.spatial.following import follow_path
from planners.spatial.problem import SpatialCandidate, SpatialMotion
from planners.spatial.query import SpatialQuery
from planners.spatial.workspace import Workspace

__all__ = [
    "Track",
    "candidate_along",
    "plan_track",
    "track_from_curve",
]

GROWING = ((0.5, 60), (0.1, 30), (0.02, 30))
FINISHING = ((0.3, 60), (0.03, 40), (0.003, 40))
"""Smoothing and number of iterations, while chords grow and then: strong smoothing takes slack and cusps out
of the track and leaves a residual, which weaker smoothing takes away."""

DEEP = 0.01
"""Depth, in link lengths, that is left where no chord is free: the arm is not even fed then."""

ASTRAY = 3.0
"""A track that is this many times as long as it was winds about an obstacle which it cannot pass."""


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Say how carefully a track is shaped.

    Parameters
    ----------
    margin : float
        Kept from obstacles beyond the link radius, in link lengths.
    coarse : int
        Samples per link while chords grow. The fewer, the faster slack is smoothed out of the track.
    steps : int
        In how many steps chords grow.
    fine : int
        Samples per link in the end: their number is doubled up to it.
    slope, outward : float
        As in `kernels.spatial_track.Demand`.
    strict : float
        Share of the joint limit that is kept.
    """

    margin: float
    coarse: int
    steps: int
    fine: int = 60
    slope: float = 0.1
    outward: float = 0.5
    strict: float = 0.98


EFFORTS = (
    Effort(margin=0.003, coarse=8, steps=20, fine=30, slope=0.2),
    Effort(margin=0.003, coarse=15, steps=40),
    Effort(margin=0.001, coarse=8, steps=20),
    Effort(margin=0.001, coarse=15, steps=40, strict=0.95),
    Effort(margin=0.001, coarse=10, steps=80, strict=0.95),
)
"""What is tried, one after the other, until the exact checker agrees."""

LIMITED = tuple(dataclasses.replace(effort, outward=0.75) for effort in EFFORTS)
"""What is tried then if joints have a limit: either way of meeting it finds what the other misses."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Track:
    """Hold a joint track while it is shaped.

    Parameters
    ----------
    points : array, shape (n, 3)
        Samples in workspace units. The first `fixed` lie on the axis of the feeder.
    fixed : int
        At least 2.
    """

    points: FloatArray
    fixed: int

    @property
    def free(self) -> FloatArray:
        """The part behind the straight stretch, with the end of that, shape (m, 3)."""
        return self.points[self.fixed - 1 :]


def track_from_curve(workspace: Workspace, curve: FloatArray, length: float, per_link: int) -> Track:
    """Sample a curve, shape (n, 3), from the straight stretch to the goal, for links of a length."""
    start = workspace.base + workspace.straight * workspace.heading
    free = resampled(curve, length / per_link)
    axis = start + np.linspace(-length, 0.0, per_link + 1)[:, None] * workspace.heading
    return Track(points=np.concatenate([axis, free[1:]]), fixed=per_link + 1)


def plan_track(query: SpatialQuery) -> SpatialCandidate:
    """Plan by a joint track, or failing that by the path itself.

    If a motion is handed on that the exact checker refuses, everything has failed.
    """
    if query.warm_start is None and query.path is None:
        return query.no_path()
    best = SpatialCandidate(
        status=PlanningStatus.OUT_OF_TIME, reason="Time was over before a track was shaped."
    )
    for effort in EFFORTS if query.arm.joint_limit is None else EFFORTS + LIMITED:
        candidate = _attempt(query, effort)
        if candidate is None:  # time is over
            break
        if candidate.motion is not None and query.check(candidate.motion).valid:
            return candidate
        if best.motion is None:
            best = candidate
    if query.warm_start is None and query.path is not None and not query.late:
        # Short links, and long ones in wide rooms, may follow the path where no track was found.
        motion = follow_path(query.path, query.workspace, query.arm.link_length)
        if query.check(motion).valid:
            return SpatialCandidate(status=PlanningStatus.SOLVED, motion=motion, track=query.path.points)
    return best


def _attempt(query: SpatialQuery, effort: Effort) -> SpatialCandidate | None:
    """Shape a track and feed the arm along it; None if time runs out."""
    begin = now()
    shaped = _shaped(query, effort)
    shaping = now() - begin
    query.timings["plan"] = query.timings.get("plan", 0.0) + shaping
    if shaped is None:
        return None
    track, depth = shaped
    if depth > DEEP * query.arm.link_length:
        return _dead_end(query, track)
    return candidate_along(query, track.free)


def candidate_along(query: SpatialQuery, curve: FloatArray) -> SpatialCandidate:
    """Feed the arm along a track, shape (n, 3), from the straight stretch on; or say where a joint jumps."""
    begin = now()
    length = query.arm.link_length
    base_pose = query.workspace.base_pose_for(length)
    curve = np.concatenate([base_pose[None, :3], curve])
    fed = feed(curve, length, base_pose)
    motion = None
    if fed.ending == feeding_kernel.DONE:
        motion = SpatialMotion.from_joints(fed.poses, length, base_pose)
    query.timings["poses"] = query.timings.get("poses", 0.0) + now() - begin
    if motion is not None:
        return SpatialCandidate(status=PlanningStatus.SOLVED, motion=motion, track=curve)
    return SpatialCandidate(
        status=PlanningStatus.DEAD_END,
        track=curve,
        reason=(
            f"With the tip at {query.text(fed.place)} a joint would have to jump: the track turns across the "
            f"link of {length:g} {query.workspace.units} that starts there."
        ),
        failure=Failure(place=fed.place, joints=fed.poses[-1]),
    )


def _shaped(query: SpatialQuery, effort: Effort) -> tuple[Track, float] | None:
    """Shape a track; return it with the depth that is left, or None if time runs out."""
    workspace, arm = query.workspace, query.arm
    boxes = workspace.obstacles_grown(arm.link_radius + effort.margin * arm.link_length)
    limit = math.pi if arm.joint_limit is None else effort.strict * arm.joint_limit
    curve, first = query.start
    plan = [
        (float(length), effort.coarse, GROWING)
        for length in np.geomspace(first, arm.link_length, effort.steps + 1)
    ]
    per_link = effort.coarse
    while per_link < effort.fine:
        per_link = min(2 * per_link, effort.fine)
        plan.append((arm.link_length, per_link, FINISHING))
    depth, longest = 0.0, ASTRAY * float(arclength(curve)[-1])
    for number, (length, per_link, stages) in enumerate(plan):
        query.tell("plan", number / len(plan))
        track = track_from_curve(workspace, curve, length, per_link)
        demand = kernel.Demand(length, limit, effort.outward, effort.slope, True)
        for smoothing, iterations in stages:
            if query.late:
                return None
            depth = kernel.relax(track.points, track.fixed, demand, boxes, smoothing, iterations)
        curve = track.free
        if float(arclength(curve)[-1]) > longest:
            depth = math.inf
            break
    query.tell("plan", 1.0)
    return track, depth


def _dead_end(query: SpatialQuery, track: Track) -> SpatialCandidate:
    """Say which chord is deepest in an obstacle."""
    length, units = query.arm.link_length, query.workspace.units
    swollen = query.workspace.obstacles_grown(query.arm.link_radius)
    tip, rear, wall, depth = kernel.deepest_chord(track.points, track.fixed, length, swollen)
    links = f"links of {length:g} {units}"
    if query.arm.joint_limit is not None:
        links += f" with joints of at most {math.degrees(query.arm.joint_limit):.3g} degrees"
    if depth <= 0.0:
        return SpatialCandidate(
            status=PlanningStatus.DEAD_END,
            track=track.points,
            reason=f"No track was found for {links}: it grows ever longer without becoming free.",
        )
    place = tuple(track.points[tip].tolist())
    return SpatialCandidate(
        status=PlanningStatus.DEAD_END,
        track=track.points,
        reason=(
            f"No track was found on which {links} are free: the link that ends at {query.text(place)} is "
            f"{depth:.3g} {units} deep in {query.obstacle_text(wall)}."
        ),
        failure=Failure(
            place=place,
            path_position=float(arclength(track.free)[max(tip - track.fixed + 1, 0)])
            + query.workspace.straight,
            wall=int(wall),
            depth=float(depth),
            joints=np.stack([rear, track.points[tip]]),
        ),
    )
