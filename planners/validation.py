"""Check a motion exactly, independently of every planner.

At the poses the exact polygons decide: a link may touch a wall, and no more. Between poses a bound decides,
not samples. Feed and joint angles change linearly there, so link headings do, and joint k stays within
``e_k = L / 8 * sum_{j < k} (change of heading j)^2`` of the straight line between its two places (a curve
leaves its chord by at most an eighth of its largest second derivative). A link therefore stays inside the
convex hull of its two placements, grown by e of its tip-side joint. Where that hull is covered by the free
space grown by g, the link is nowhere deeper than g + e in a wall. Where it is not, the piece is halved, in
time if e is what makes the hull too coarse, along the link if the turning of the link does (the hull of a
link that pivots is wide away from the pivot), and both halves are tried, to a limit.

Two rules say what of the arm is in the maze:

- Joints behind the base are put at the base point, so that a link which comes out of the feeder is checked
  from there on and links wholly in the feeder are not checked. A joint is behind the base while the feed is
  less than the length of arm from it to the tip; the maze itself may well reach behind the base.
- The feeder comes through a wall that may be nearer than the link radius. For links of a positive radius,
  walls behind the base (in the half-plane against its heading) therefore count only once the link's base-side
  joint is a radius past the base: then nothing of a link that points forward is behind it. Until then, and to
  the end of the piece of motion in which it gets there, only its centre line may not leave the free space.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from hrsnake_env.arm import ArmSpec, FloatArray, joints_from_configuration
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.problem import Fault, Motion, Progress, ValidationReport

__all__ = ["FAULTS", "PINCH_TOLERANCE", "STEP_LIMIT", "validate"]

PINCH_TOLERANCE = 1e-3
"""Largest depth of a link in a wall between two poses, in link lengths."""

STEP_LIMIT = 0.05
"""Largest movement of a joint between two poses, in link lengths."""

ROUNDING = 1e-9
"""What counts as rounding, in link lengths."""

PLACE_SLACK = 1e-6
"""How far joints may be from where configuration, feeder and start put them, in link lengths."""

ARC_SEGMENTS = 32
"""Chords per quarter of an arc where the free space is shrunk by a link radius."""

GROWTHS = (1e-6, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 7 / 8)
"""By how much the free space is grown between poses, in pinch tolerances; the first is for rounding alone."""

MAX_SPLITS = 14
"""How often a piece between two poses is halved before it counts as not bounded."""

PATIENCE = 6
"""How often a piece is halved before depths over an eighth of the tolerance are accepted."""

MAX_PIECES = 40_000
"""How many pieces of one chunk of poses are looked at together before the rest counts as not bounded."""

FAULT_SAMPLES = 257
"""Times between two poses at which the depth is looked for when a fault there is described."""

CHUNK = 128
"""Poses that are looked at together."""

FAULTS: Mapping[str, str] = MappingProxyType(
    {
        "length": "a link has another length than the arm's",
        "inconsistent": "the joint positions are not those of feed and joint angles",
        "feeder": "the feed is beyond the arm, or a link leaves the feeder's axis before its base-side joint "
        "has passed the base",
        "start": "the first pose is not the whole arm in the feeder with the tip at the base",
        "goal": "the last pose does not have the tip inside the goal radius",
        "step": "a joint moves too far between two poses",
        "penetration": "a link is in a wall at a pose",
        "sweep": "a link is in a wall between two poses, or may be",
        "crossing": "the arm crosses or touches itself, or may do so between two poses",
        "joint limit": "a joint angle is larger than the arm's joint limit",
    }
)
"""What each kind of fault means."""

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Geometry = Any
Nearest = tuple[float, int, FloatArray]
"""Clearance, index of the segment, and the place on it, shape (2,)."""


def validate(
    motion: Motion, maze: Maze, arm: ArmSpec | None = None, progress: Progress | None = None
) -> ValidationReport:
    """Check everything that makes a motion a solution.

    Parameters
    ----------
    motion : Motion
        From the base of this maze.
    maze : Maze
        With the exact walls.
    arm : ArmSpec, optional
        Gives link radius and joint limit. By default thin links without joint limits.
    progress : callable, optional
        Called with "validate" and the share that is done.

    Returns
    -------
    report : ValidationReport
        With at most one fault of each kind, the worst. A fault's `amount` is the figure that was too large
        (for a crossing: the distance that was too small).

    Raises
    ------
    InputError
        If the motion belongs to another maze or another arm.
    """
    arm = ArmSpec(link_length=motion.link_length) if arm is None else arm
    _check_arm(motion, arm)
    motion.check_maze(maze)
    tell = progress if progress is not None else lambda stage, share: None
    scene = _Scene(motion=motion, maze=maze, radius=arm.link_radius)
    length_error, length = _length(scene)
    largest_step, step = _step(scene)
    goal_distance, goal = _goal(scene)
    clearance, penetration, deep = _poses(scene, tell)
    between, sweep = _sweep(scene, deep, tell)
    depth = 0.0 if penetration is None else penetration.amount
    found = [length, _consistency(scene), _feeder(scene), _start(scene), goal, step, penetration, sweep]
    found += [_crossing(scene, tell), _joint_limit(scene, arm.joint_limit)]
    tell("validate", 1.0)
    return ValidationReport(
        faults=tuple(fault for fault in found if fault is not None),
        clearance=clearance,
        penetration=depth,
        penetration_between=max(between, depth),
        largest_step=largest_step,
        length_error=length_error,
        goal_distance=goal_distance,
    )


def _check_arm(motion: Motion, arm: ArmSpec) -> None:
    if not math.isclose(arm.link_length, motion.link_length, rel_tol=ROUNDING):
        raise InputError(
            f"Expected a motion of links of length {arm.link_length:g}, got one of {motion.link_length:g}."
        )
    if arm.n_links is not None and arm.n_links != motion.n_links:
        raise InputError(f"Expected a motion of {arm.n_links} links, got one of {motion.n_links}.")


@dataclass(frozen=True, eq=False, kw_only=True)
class _Scene:
    """Hold the motion, the walls, and what follows from them."""

    motion: Motion
    maze: Maze
    radius: float

    @property
    def length(self) -> float:
        return self.motion.link_length

    @cached_property
    def free(self) -> Geometry:
        return _prepared(self.maze.free_space)

    @cached_property
    def walls(self) -> Geometry:
        return _prepared(self.maze.free_space.boundary)

    @cached_property
    def open_behind(self) -> Geometry:
        """The free space together with everything behind the base: only walls in front are left."""
        x, y, heading = self.motion.base_pose
        along = 2.0 * (self.maze.size + self.length) * np.array([math.cos(heading), math.sin(heading)])
        across, base = np.array([-along[1], along[0]]), np.array([x, y])
        behind = Polygon([base + across, base + across - along, base - across - along, base - across])
        return self.maze.free_space.union(behind)

    @cached_property
    def walls_in_front(self) -> Geometry:
        return _prepared(self.open_behind.boundary)

    def distances(self, lines: Any, emerging: BoolArray) -> FloatArray:
        """Compute the distances from lines to the walls that count for them."""
        distances = shapely.distance(lines, self.walls)
        if emerging.any():
            distances[emerging] = shapely.distance(lines[emerging], self.walls_in_front)
        return np.asarray(distances)

    @cached_property
    def shallow(self) -> Geometry:
        """Where every centre line lies that is not surely deeper in a wall than the pinch tolerance."""
        depth = max(PINCH_TOLERANCE * self.length - self.radius, ROUNDING * self.length)
        return _prepared(self.maze.free_space.buffer(1.02 * depth))

    @cached_property
    def arc(self) -> FloatArray:
        """How far past the base each joint is along the arm, shape (n_poses, n_links + 1)."""
        return self.arc_from_feed(self.motion.feed)

    def arc_from_feed(self, feed: FloatArray) -> FloatArray:
        n_links = self.motion.n_links
        return np.asarray(feed[:, None] - (n_links - np.arange(n_links + 1)) * self.length)

    def in_maze(self, joints: FloatArray, arc: FloatArray) -> FloatArray:
        """Put the joints behind the base, shape (..., 2), at the base point."""
        return np.where(arc[..., None] < 0.0, self.motion.base_pose[:2], joints)

    def emerging(self, arc: FloatArray) -> BoolArray:
        """Say for which links, by the arc of their base-side joint, walls behind the base do not count."""
        return np.asarray((arc < self.radius) & (self.radius > 0.0))

    @cached_property
    def curvature(self) -> FloatArray:
        """How far each joint may leave its chord after each pose (e_k), shape (n_poses, n_links + 1)."""
        headings = np.cumsum(self.motion.joint_angles, axis=1)
        turns = np.diff(headings, axis=0, append=headings[-1:])
        sums = np.cumsum(turns**2, axis=1) * self.length / 8.0
        return np.concatenate([np.zeros((len(turns), 1)), sums], axis=1)

    def figure(self, amount: float) -> str:
        return f"{amount:.6g} {self.maze.units} ({amount / self.length:.3g} link lengths)"

    def ends(self, interval: IntArray, link: IntArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute both joints of links between poses: places, shape (n, 2, 2), and arcs, shape (n, 2)."""
        motion = self.motion
        moments, rows = np.unique(interval + time, return_inverse=True)  # many links share a configuration
        before = np.minimum(moments.astype(np.int64), motion.n_poses - 1)
        after, share = np.minimum(before + 1, motion.n_poses - 1), (moments - before)[:, None]
        feed = (1.0 - share[:, 0]) * motion.feed[before] + share[:, 0] * motion.feed[after]
        angles = (1.0 - share) * motion.joint_angles[before] + share * motion.joint_angles[after]
        joints = joints_from_configuration(feed, angles, self.length, motion.base_pose)
        rows, both = rows[:, None], np.stack([link, link + 1], axis=1)
        return joints[rows, both], self.arc_from_feed(feed)[rows, both]


def _prepared(geometry: Geometry) -> Geometry:
    shapely.prepare(geometry)
    return geometry


def _point(place: FloatArray) -> tuple[float, float]:
    return float(place[0]), float(place[1])


# Figures of the arm alone


def _worst(values: FloatArray) -> tuple[float, int, int]:
    row, column = np.unravel_index(np.argmax(values), values.shape)
    return float(values[row, column]), int(row), int(column)


def _length(scene: _Scene) -> tuple[float, Fault | None]:
    lengths = np.linalg.norm(np.diff(scene.motion.joints, axis=1), axis=2)
    amount, pose, link = _worst(np.abs(lengths - scene.length))
    if amount <= ROUNDING * scene.length:
        return amount, None
    figure = f"{lengths[pose, link]:.9g} {scene.maze.units}"
    message = f"Link {link} is {figure} long at pose {pose}, not {scene.length:g}."
    return amount, _joint_fault(scene, "length", message, pose, link, amount)


def _joint_fault(scene: _Scene, kind: str, message: str, pose: int, joint: int, amount: float) -> Fault:
    link = min(joint, scene.motion.n_links - 1)
    place = _point(scene.motion.joints[pose, joint])
    return Fault(kind=kind, message=message, pose=pose, link=link, place=place, amount=amount)


def _consistency(scene: _Scene) -> Fault | None:
    motion = scene.motion
    joints = joints_from_configuration(motion.feed, motion.joint_angles, motion.link_length, motion.base_pose)
    amount, pose, joint = _worst(np.linalg.norm(motion.joints - joints, axis=2))
    if amount <= PLACE_SLACK * scene.length:
        return None
    message = (
        f"Joint {joint} is {scene.figure(amount)} from where feed and joint angles put it at pose {pose}."
    )
    return _joint_fault(scene, "inconsistent", message, pose, joint, amount)


def _feeder(scene: _Scene) -> Fault | None:
    motion, whole = scene.motion, scene.motion.n_links * scene.length
    excess = np.maximum(motion.feed - whole, -motion.feed)
    pose = int(np.argmax(excess))
    if excess[pose] > PLACE_SLACK * scene.length:
        message = (
            f"The feed is {scene.figure(motion.feed[pose])} at pose {pose}, not between 0 and {whole:g}."
        )
        return _joint_fault(scene, "feeder", message, pose, 0, float(excess[pose]))
    behind = scene.arc[:, :-1] < -ROUNDING * scene.length
    # A link is held until its base-side joint has passed, so still at the pose after one with the joint
    # behind; and likewise on the way back.
    held = behind.copy()
    held[1:] |= behind[:-1]
    held[:-1] |= behind[1:]
    x, y, heading = motion.base_pose
    along = (motion.joints - (x, y)) @ (math.cos(heading), math.sin(heading))
    across = np.abs((motion.joints - (x, y)) @ (-math.sin(heading), math.cos(heading)))
    aside = np.maximum(across[:, :-1], across[:, 1:])
    aside = np.where(np.diff(along, axis=1) > 0.0, aside, scene.length)  # it points backward
    aside = np.where(held, aside, 0.0)
    aside[:, 0] = np.maximum(aside[:, 0], across[:, 0])
    amount, pose, link = _worst(aside)
    if amount <= PLACE_SLACK * scene.length:
        return None
    message = f"Link {link}, still held by the feeder, is {scene.figure(amount)} off its axis at pose {pose}."
    return _joint_fault(scene, "feeder", message, pose, link, amount)


def _start(scene: _Scene) -> Fault | None:
    motion = scene.motion
    wanted = joints_from_configuration(0.0, np.zeros(motion.n_links), scene.length, motion.base_pose)
    distances = np.linalg.norm(motion.joints[0] - wanted, axis=1)
    joint = int(np.argmax(distances))
    if distances[joint] <= PLACE_SLACK * scene.length:
        return None
    amount = float(distances[joint])
    message = f"Joint {joint} starts {scene.figure(amount)} from its place with the whole arm in the feeder."
    return _joint_fault(scene, "start", message, 0, joint, amount)


def _goal(scene: _Scene) -> tuple[float, Fault | None]:
    motion, radius = scene.motion, scene.maze.goal_radius
    distance = float(np.linalg.norm(motion.joints[-1, -1] - scene.maze.goal))
    if distance <= radius:
        return distance, None
    message = f"The tip ends {scene.figure(distance)} from the goal, outside its radius of {radius:g}."
    return distance, _joint_fault(scene, "goal", message, motion.n_poses - 1, motion.n_links, distance)


def _step(scene: _Scene) -> tuple[float, Fault | None]:
    if scene.motion.n_poses == 1:
        return 0.0, None
    steps = np.linalg.norm(np.diff(scene.motion.joints, axis=0), axis=2)
    amount, pose, joint = _worst(steps)
    if amount <= STEP_LIMIT * scene.length * (1.0 + ROUNDING):
        return amount, None
    figure = f"{scene.figure(amount)}, more than {STEP_LIMIT:g}"
    message = f"Joint {joint} moves {figure}, between poses {pose} and {pose + 1}."
    return amount, _joint_fault(scene, "step", message, pose, joint, amount)


def _joint_limit(scene: _Scene, limit: float | None) -> Fault | None:
    amount, pose, joint = _worst(np.abs(scene.motion.joint_angles))
    if limit is None or amount <= limit + ROUNDING:
        return None
    message = f"Joint {joint} turns by {amount:.6g} rad at pose {pose}; the limit is {limit:g} rad."
    return _joint_fault(scene, "joint limit", message, pose, joint, amount)


# Poses against the walls


def _poses(scene: _Scene, tell: Progress) -> tuple[float, Fault | None, BoolArray]:
    """Check all poses: clearance, the worst penetration, and the links deeper than any sweep allows."""
    motion = scene.motion
    deep = np.zeros((motion.n_poses, motion.n_links), dtype=bool)
    worst: tuple[float, int, int, FloatArray] = (math.inf, 0, 0, motion.joints[0, -1])
    for first in range(0, motion.n_poses, CHUNK):
        arc = scene.arc[first : first + CHUNK]
        joints = scene.in_maze(motion.joints[first : first + CHUNK], arc)
        pose, link = np.nonzero(arc[:, 1:] > ROUNDING * scene.length)
        if len(pose):
            segments = np.stack([joints[pose, link], joints[pose, link + 1]], axis=1)
            emerging = scene.emerging(arc[pose, link])
            clearance, index, place = _nearest(scene, segments, emerging)
            if clearance < worst[0]:
                worst = (clearance, first + int(pose[index]), int(link[index]), place)
            deep[first + pose, link] = _are_deep(scene, segments, emerging)
        tell("validate", 0.3 * min(1.0, (first + CHUNK) / motion.n_poses))
    clearance, where, link_index, place = worst
    if clearance >= (0.0 if scene.radius == 0.0 else -ROUNDING * scene.length):
        return clearance, None, deep
    fault = Fault(
        kind="penetration",
        message=f"Link {link_index} is {scene.figure(-clearance)} deep in a wall at pose {where}.",
        pose=where,
        link=link_index,
        place=_point(place),
        amount=-clearance,
    )
    return clearance, fault, deep


def _nearest(scene: _Scene, segments: FloatArray, emerging: BoolArray) -> Nearest:
    """Find the least signed distance to the walls of capsules around segments, shape (n, 2, 2)."""
    lines = shapely.linestrings(segments)
    outside = np.flatnonzero(~shapely.covers(scene.free, lines))
    if len(outside):
        depth, index, place = _deepest(scene, segments[outside])
        return -depth - scene.radius, int(outside[index]), place
    distances = scene.distances(lines, emerging)
    index = int(np.argmin(distances))
    walls = scene.walls_in_front if emerging[index] else scene.walls
    place = shapely.get_coordinates(shapely.shortest_line(lines[index], walls))[0]
    return float(distances[index]) - scene.radius, index, place


def _are_deep(scene: _Scene, segments: FloatArray, emerging: BoolArray) -> BoolArray:
    """Say which capsules are surely deeper in a wall than the pinch tolerance."""
    lines, excess = shapely.linestrings(segments), scene.radius - PINCH_TOLERANCE * scene.length
    deep = ~shapely.covers(scene.shallow, lines)
    if excess > 0.0:
        deep |= scene.distances(lines, emerging) < excess
    return np.asarray(deep)


def _deepest(scene: _Scene, segments: FloatArray) -> Nearest:
    """Find the point of segments that leave the free space, shape (n, 2, 2), that is farthest from it.

    Outside, the distance to the free space is the least of the distances to the walls. Each of those is
    convex along a segment, so the larger one of its two ends bounds it, and the least such bound over the
    walls bounds the depth. Halving the parts that may still beat the deepest point found closes in on it.
    """
    outside = shapely.difference(shapely.linestrings(segments), scene.free)
    parts, owner = shapely.get_parts(outside, return_index=True)
    parts, owner = parts[~shapely.is_empty(parts)], owner[~shapely.is_empty(parts)]
    ends = np.stack([shapely.get_coordinates(shapely.get_point(parts, k)) for k in (0, -1)], axis=1)
    walls, accuracy = scene.maze.walls, 0.1 * PLACE_SLACK * scene.length
    # What is not covered is outside, even where rounding leaves nothing of it.
    depth, index, place = 1e-15 * scene.maze.size, 0, segments[0].mean(axis=0)
    for first in range(0, len(ends), CHUNK):
        rest, of = ends[first : first + CHUNK], owner[first : first + CHUNK]
        while len(rest):
            start, end = (_wall_distances(rest[:, k], walls) for k in (0, 1))
            reached = np.stack([start.min(axis=1), end.min(axis=1)], axis=1)
            best, row, side = _worst(reached)
            if best > depth:
                depth, index, place = best, int(of[row]), rest[row, side]
            open_ = np.maximum(start, end).min(axis=1) > depth + accuracy
            rest, of = rest[open_], np.repeat(of[open_], 2)
            middle = rest.mean(axis=1)
            rest = np.stack([rest[:, 0], middle, middle, rest[:, 1]], axis=1).reshape(-1, 2, 2)
    return depth, index, place


def _wall_distances(points: FloatArray, walls: FloatArray) -> FloatArray:
    """Compute the distances from points, shape (n, 2), to each wall, as shape (n, n_walls)."""
    along = walls[:, 1] - walls[:, 0]
    offset = points[:, None] - walls[:, 0]
    share = np.clip(np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=2))


# Between poses against the walls


@dataclass(frozen=True, eq=False, kw_only=True)
class _Region:
    """Hold where a centre line may be for its link to be at most `depth` deep in a wall.

    `in_front` is the same for links for which walls behind the base do not count.
    """

    depth: float
    everywhere: Geometry
    in_front: Geometry

    def covers(self, geometries: Any, emerging: BoolArray) -> BoolArray:
        covered = shapely.covers(self.everywhere, geometries)
        if emerging.any():
            covered[emerging] = shapely.covers(self.in_front, geometries[emerging])
        return np.asarray(covered)


def _region(scene: _Scene, growth: float) -> _Region:
    """Build the region for a depth of at most `growth`, to be sure a little less than that.

    Buffers have chords in place of arcs, so growing falls short; shrinking does by the factor of `inflated`.
    Shallow dents may be filled by a hundredth of the distance.
    """
    shrink = scene.radius - growth
    if shrink <= 0.0:
        grown = _prepared(scene.free.buffer(-0.99 * shrink))
        return _Region(depth=growth, everywhere=grown, in_front=grown)
    inflated = shrink / math.cos(math.pi / (4 * ARC_SEGMENTS))
    everywhere = scene.free.buffer(-inflated, quad_segs=ARC_SEGMENTS)
    in_front = scene.open_behind.buffer(-inflated, quad_segs=ARC_SEGMENTS).intersection(scene.free)
    # The distance that came of it is measured: that it is large enough is then beyond doubt.
    kept = min(
        shapely.distance(everywhere, scene.walls) if not everywhere.is_empty else shrink,
        shapely.distance(in_front, scene.walls_in_front) if not in_front.is_empty else shrink,
    )
    return _Region(depth=scene.radius - kept, everywhere=_prepared(everywhere), in_front=_prepared(in_front))


@dataclass(frozen=True, eq=False, kw_only=True)
class _Pieces:
    """Hold pieces of motion: of a link, from `part[:, 0]` to `part[:, 1]` along it, over a `time` in [0, 1].

    `interval` and `link` have shape (n,), `time` and `part` shape (n, 2).
    """

    interval: IntArray
    link: IntArray
    time: FloatArray
    part: FloatArray

    def __len__(self) -> int:
        return len(self.link)

    def __getitem__(self, chosen: BoolArray) -> _Pieces:
        return _Pieces(
            interval=self.interval[chosen],
            link=self.link[chosen],
            time=self.time[chosen],
            part=self.part[chosen],
        )

    def halved(self, in_time: BoolArray) -> _Pieces:
        """Halve the pieces in time where told so, else along the link."""
        time = np.where(in_time[:, None, None], _halves(self.time), self.time[:, None])
        part = np.where(in_time[:, None, None], self.part[:, None], _halves(self.part))
        return _Pieces(
            interval=np.repeat(self.interval, 2),
            link=np.repeat(self.link, 2),
            time=time.reshape(-1, 2),
            part=part.reshape(-1, 2),
        )

    def placed(self, scene: _Scene, time: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Compute the segments in the maze at a time of each piece, shape (n, 2, 2), and which emerge."""
        joints, arc = scene.ends(self.interval, self.link, time)
        joints = scene.in_maze(joints, arc)
        segments = joints[:, :1] + self.part[..., None] * (joints[:, 1:] - joints[:, :1])
        return segments, scene.emerging(arc[:, 0])


def _halves(spans: FloatArray) -> FloatArray:
    """Halve spans, shape (n, 2), into shape (n, 2, 2)."""
    middle = spans.mean(axis=1)
    return np.stack(
        [np.stack([spans[:, 0], middle], axis=1), np.stack([middle, spans[:, 1]], axis=1)], axis=1
    )


def _sweep(scene: _Scene, deep: BoolArray, tell: Progress) -> tuple[float, Fault | None]:
    """Bound the depth between poses, and find the worst place where there is no bound up to the tolerance.

    Links that are deeper at one of the two poses are left out: the fault of that pose says it already.
    """
    motion, bound = scene.motion, 0.0
    regions = [_region(scene, share * PINCH_TOLERANCE * scene.length) for share in GROWTHS]
    skipped = deep[1:] | deep[:-1]
    moving = np.maximum(scene.arc[1:, 1:], scene.arc[:-1, 1:]) > ROUNDING * scene.length
    interval, link = np.nonzero(moving & ~skipped)
    open_: list[_Pieces] = []
    for first in range(0, motion.n_poses - 1, CHUNK):
        chosen = (interval >= first) & (interval < first + CHUNK)
        span = np.tile((0.0, 1.0), (int(chosen.sum()), 1))
        pieces = _Pieces(interval=interval[chosen], link=link[chosen], time=span, part=span)
        chunk_bound, chunk_open = _swept(scene, pieces, regions)
        bound = max(bound, chunk_bound)
        open_ += [piece for piece in chunk_open if len(piece)]
        tell("validate", 0.3 + 0.5 * min(1.0, (first + CHUNK) / motion.n_poses))
    if open_:
        return math.inf, _sweep_fault(scene, open_)
    return math.inf if skipped.any() else bound, None


def _swept(scene: _Scene, pieces: _Pieces, regions: list[_Region]) -> tuple[float, list[_Pieces]]:
    """Bound the depth of pieces by halving; return the bound, and the pieces that are deep or still open."""
    tolerance, bound, deep = PINCH_TOLERANCE * scene.length, 0.0, []
    for level in range(MAX_SPLITS + 1):
        if not len(pieces):
            break
        limit = tolerance if level >= PATIENCE else tolerance / 8.0
        curve = scene.curvature[pieces.interval, pieces.link + 1] * np.ptp(pieces.time, axis=1) ** 2
        (before, early), (after, late) = (pieces.placed(scene, pieces.time[:, k]) for k in (0, 1))
        depth = _hull_depth(np.concatenate([before, after], axis=1), early | late, curve, regions, limit)
        bound = max(bound, float(np.max(depth, where=np.isfinite(depth), initial=0.0)))
        left = np.isinf(depth)
        twist = np.linalg.norm((after[:, 1] - before[:, 1]) - (after[:, 0] - before[:, 0]), axis=1) / 4.0
        in_time, pieces = (curve >= twist)[left], pieces[left]
        middle, emerging = pieces.placed(scene, pieces.time.mean(axis=1))
        is_deep = _are_deep(scene, middle, emerging)
        deep.append(pieces[is_deep])
        if level == MAX_SPLITS or 2 * len(pieces) > MAX_PIECES:
            break
        # One deep place is enough to know of a link between two poses.
        names = pieces.interval * scene.motion.n_links + pieces.link
        go_on = ~np.isin(names, names[is_deep])
        pieces = pieces[go_on].halved(in_time[go_on])
    return bound, [*deep, pieces]


def _hull_depth(
    corners: FloatArray, emerging: BoolArray, curve: FloatArray, regions: list[_Region], limit: float
) -> FloatArray:
    """Bound the depth of hulls of `corners`, shape (n, 4, 2), grown by `curve`; infinite beyond `limit`."""
    depth = np.full(len(corners), np.inf)
    for region in regions:
        rest = np.flatnonzero(np.isinf(depth) & (region.depth + curve <= limit))
        hulls = shapely.convex_hull(shapely.linestrings(corners[rest]))
        free = rest[region.covers(hulls, emerging[rest])]
        depth[free] = region.depth + curve[free]
    return depth


def _sweep_fault(scene: _Scene, open_: list[_Pieces]) -> Fault:
    """Name the worst of the pieces that are not bounded, by the depth at the middle of each."""
    worst: tuple[float, int, int] | None = None
    for pieces in open_:
        clearance, index, _ = _nearest(scene, *pieces.placed(scene, pieces.time.mean(axis=1)))
        if worst is None or clearance < worst[0]:
            worst = (clearance, int(pieces.interval[index]), int(pieces.link[index]))
    assert worst is not None  # the caller has pieces
    _, pose, link = worst
    times = np.linspace(0.0, 1.0, FAULT_SAMPLES)
    samples = _Pieces(
        interval=np.full(FAULT_SAMPLES, pose),
        link=np.full(FAULT_SAMPLES, link),
        time=np.stack([times, times], axis=1),
        part=np.tile((0.0, 1.0), (FAULT_SAMPLES, 1)),
    )
    segments, emerging = samples.placed(scene, times)
    clearance, _, place = _nearest(scene, segments, emerging)
    amount, what = -clearance, f"gets {scene.figure(-clearance)} deep in a wall"
    if amount <= PINCH_TOLERANCE * scene.length:
        amount, what = (
            math.inf,
            f"could not be shown to get at most {PINCH_TOLERANCE:g} link lengths deep in a wall",
        )
    message = f"Link {link} {what} between poses {pose} and {pose + 1}."
    return Fault(kind="sweep", message=message, pose=pose, link=link, place=_point(place), amount=amount)


# The arm against itself


def _crossing(scene: _Scene, tell: Progress) -> Fault | None:
    """Check that links keep apart, by the distances at the ends of ever shorter pieces of time.

    A point of a link that moves along a chord c is at most t * c + e from its place at the start and at most
    (1 - t) * c + e from its place at the end, so the mean of the two distances, less half of both chords and
    both e, bounds the distance within.
    """
    amount, pose, joint = (
        _worst(np.abs(scene.motion.joint_angles[:, 1:])) if scene.motion.n_links > 1 else (0.0, 0, 0)
    )
    if amount >= math.pi - ROUNDING:
        message = f"Link {joint + 1} lies folded back on link {joint} at pose {pose}."
        return _joint_fault(scene, "crossing", message, pose, joint + 1, 0.0)
    n_intervals = max(1, scene.motion.n_poses - 1)
    worst: tuple[float, int, int, int, float] | None = None
    for first in range(0, n_intervals, CHUNK):
        pairs = _near_pairs(scene, np.arange(first, min(first + CHUNK, n_intervals)))
        for found in _meetings(scene, *pairs):
            worst = found if worst is None or found[0] < worst[0] else worst
        tell("validate", 0.8 + 0.2 * min(1.0, (first + CHUNK) / n_intervals))
    return None if worst is None else _crossing_fault(scene, *worst)


def _near_pairs(scene: _Scene, interval: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Find the pairs of non-adjacent links whose middles are not far apart: interval, first, second."""
    motion, after = scene.motion, np.minimum(interval + 1, scene.motion.n_poses - 1)
    first, second = np.triu_indices(motion.n_links, 2)
    joints = scene.in_maze(motion.joints[interval], scene.arc[interval])
    move = np.linalg.norm(motion.joints[after] - motion.joints[interval], axis=2) + scene.curvature[interval]
    reach = np.linalg.norm(np.diff(joints, axis=1), axis=2) / 2.0 + np.maximum(move[:, :-1], move[:, 1:])
    middle = (joints[:, :-1] + joints[:, 1:]) / 2.0
    apart = np.linalg.norm(middle[:, first] - middle[:, second], axis=2)
    slack = 2.0 * scene.radius + 2.0 * PLACE_SLACK * scene.length
    near = apart <= reach[:, first] + reach[:, second] + slack
    near &= np.maximum(scene.arc[interval], scene.arc[after])[:, first + 1] > 0.0
    row, pair = np.nonzero(near)
    return interval[row], first[pair], second[pair]


def _meetings(
    scene: _Scene, interval: IntArray, first: IntArray, second: IntArray
) -> Iterator[tuple[float, int, int, int, float]]:
    """Yield where pairs of links meet, or may: distance, interval, both links, time in the interval."""
    time, allowed = np.tile((0.0, 1.0), (len(interval), 1)), 2.0 * scene.radius
    for level in range(MAX_SPLITS + 1):
        if not len(interval):
            return
        least = np.zeros(len(interval))
        lines = []
        for link in (first, second):
            (before, arc), (after, later) = (scene.ends(interval, link, time[:, k]) for k in (0, 1))
            lines.append(
                [shapely.linestrings(scene.in_maze(*ends)) for ends in ((before, arc), (after, later))]
            )
            least -= np.linalg.norm(after - before, axis=2).max(axis=1) / 2.0
            least -= scene.curvature[interval, link + 1] * np.ptp(time, axis=1) ** 2
        apart = np.stack([shapely.distance(lines[0][k], lines[1][k]) for k in (0, 1)], axis=1)
        least += apart.mean(axis=1)
        meet = apart.min(axis=1) <= allowed
        rest = ~meet & (least <= allowed)
        named = meet | rest if level == MAX_SPLITS else meet
        if named.any():
            row, side = (int(k) for k in np.argwhere(apart == apart[named].min())[0])
            yield (
                float(apart[row, side]),
                int(interval[row]),
                int(first[row]),
                int(second[row]),
                float(time[row, side]),
            )
        time = _halves(time[rest]).reshape(-1, 2)
        interval, first, second = (np.repeat(values[rest], 2) for values in (interval, first, second))


def _crossing_fault(scene: _Scene, distance: float, pose: int, first: int, second: int, time: float) -> Fault:
    both = [np.array([value]) for value in (pose, time)]
    ends, arc = scene.ends(both[0], np.array([second]), both[1])
    when = f"between poses {pose} and {pose + 1}"
    if time in (0.0, 1.0):
        pose += int(time)
        when = f"at pose {pose}"
    what = "cross" if distance == 0.0 else f"come within {scene.figure(distance)} of each other"
    return Fault(
        kind="crossing",
        message=f"Links {first} and {second} {what} {when}.",
        pose=pose,
        link=second,
        place=_point(scene.in_maze(ends, arc)[0].mean(axis=0)),
        amount=distance,
    )
