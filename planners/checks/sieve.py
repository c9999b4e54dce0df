"""Set aside, cheaply and surely, what is far from every wall and from the rest of the arm.

Over a block of poses no point of a link leaves its place at a reference pose by more than the link's `reach`:
the larger way of its two joints to any pose of the block, and e of its tip-side joint for what is in between.
What is farther away than that at the reference pose is never met. The rest is looked at again in shorter
blocks, in the end from one pose to the next, where gaps decide. What is left goes to the exact polygons.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely

from hrsnake_env.arm import FloatArray, joints_from_configuration
from planners.checks.gaps import (
    ComplexArray,
    Ends,
    Walls,
    complex_from_points,
    depths_from_gaps,
    moves_evenly,
    segment_distances,
    slices,
)
from planners.checks.scene import BoolArray, IntArray, Scene
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING
from planners.problem import Progress

SIZES = (64, 16, 4, 1)
"""Steps from pose to pose in a block, at each level; each a multiple of the next."""

SPAN = 512
"""Steps that are looked at together, a multiple of the largest block."""


@dataclass(eq=False, kw_only=True)
class Sifted:
    """Hold what is left for the exact polygons.

    Parameters
    ----------
    lower : array, shape (n_poses, n_links)
        No link is nearer to the walls than this; infinite where it was not worth a measurement.
    outside : array, shape (n_poses, n_links)
        Links that may lie behind the walls.
    open_steps : array, shape (n_poses, n_links)
        Links that may be in a wall between a pose and the next.
    least : float
        At least the distance to the walls of the link that is nearest to them at any pose.
    bound : float
        Bound on the depth between poses of all links that are not open.
    astray : array, shape (n_poses,)
        How far joints are from where the configuration puts them, at most.
    pairs : list of arrays, shape (n, 3)
        Step and both links of the pairs that may meet.
    """

    lower: FloatArray
    outside: BoolArray
    open_steps: BoolArray
    astray: FloatArray
    least: float = math.inf
    bound: float = 0.0
    pairs: list[IntArray] = field(default_factory=list)

    def doubtful(self, scene: Scene) -> BoolArray:
        """Say which links at poses may be in a wall, or be the nearest to one."""
        return self.outside | (self.lower <= self.limit(scene))

    def limit(self, scene: Scene) -> float:
        """Return the distance up to which walls matter at poses."""
        return max(scene.radius, self.least) + scene.slack


@dataclass(frozen=True, eq=False, kw_only=True)
class _Level:
    """Hold blocks of poses: the first pose of each and `size` more, if there are as many.

    Parameters
    ----------
    size : int
        Steps in a block.
    first, reference : array, shape (n_blocks,)
        The first pose and the one that stands for all.
    joints, last : array, shape (n_blocks, n_links + 1)
        Joints at the reference pose and at the last, in the maze, as the configuration puts them.
    reach : array, shape (n_blocks, n_links)
        How far a link gets from its place at the reference pose.
    farthest : array, shape (n_blocks,)
        The largest feed.
    astray : array, shape (n_blocks,)
        How far joints are from where the configuration puts them; part of the reach.
    """

    size: int
    first: IntArray
    reference: IntArray
    joints: ComplexArray
    last: ComplexArray
    reach: FloatArray
    farthest: FloatArray
    astray: FloatArray

    def active(self, scene: Scene, least: float) -> BoolArray:
        """Say which links get past the base with more than `least` of their length."""
        return scene.arc_from_feed(self.farthest)[:, 1:] > least

    def holds(self, scene: Scene, block: IntArray, link: IntArray, least: float) -> BoolArray:
        """Say which blocks there are, with a link that gets past the base with more than `least`."""
        there = block < len(self.first)
        there[there] = self.active(scene, least)[block[there], link[there]]
        return there

    def ends(self, block: IntArray, link: IntArray) -> Ends:
        """Return both ends of links at reference poses."""
        return self.joints[block, link], self.joints[block, link + 1]


def sift(scene: Scene, tell: Progress) -> Sifted:
    """Set aside what is free at and between poses, and pairs of links that keep apart."""
    shape = (scene.motion.n_poses, scene.motion.n_links)
    sifted = Sifted(
        lower=np.full(shape, np.inf),
        outside=np.zeros(shape, dtype=bool),
        open_steps=np.zeros(shape, dtype=bool),
        astray=np.zeros(shape[0]),
    )
    walls = Walls.of(scene)
    for first in range(0, shape[0], SPAN):
        poses = np.arange(first, min(first + SPAN + 1, shape[0]))
        joints, sifted.astray[poses] = _placed(scene, poses)
        levels = [_level(scene, joints, sifted.astray[poses], first, size) for size in SIZES]
        _sift_walls(scene, walls, levels, sifted)
        _sift_pairs(scene, levels, sifted)
        tell("validate", 0.5 * min(1.0, (first + SPAN) / shape[0]))
    return sifted


def _placed(scene: Scene, poses: IntArray) -> tuple[ComplexArray, FloatArray]:
    """Compute the joints in the maze by the configuration, and how far they are from the motion's."""
    motion = scene.motion
    joints = joints_from_configuration(
        motion.feed[poses], motion.joint_angles[poses], scene.length, motion.base_pose
    )
    astray = np.abs(complex_from_points(motion.joints[poses] - joints)).max(axis=1)
    return complex_from_points(scene.in_maze(joints, scene.arc[poses])), astray


def _level(scene: Scene, joints: ComplexArray, astray: FloatArray, first: int, size: int) -> _Level:
    """Cut the poses of `joints`, the first of which is pose `first`, into blocks."""
    last = len(joints) - 1
    n_steps = min(SPAN, scene.motion.n_poses - first)
    starts = np.arange(0, n_steps, size)
    within = np.minimum(starts[:, None] + np.arange(size + 1), last)
    middle = np.minimum(starts + size // 2, last)
    moves = np.abs(joints[within] - joints[middle, None]).max(axis=1)
    steps = first + within[:, :-1]
    curve = (scene.curvature[steps, 1:] + scene.swerve[steps]).max(axis=1)
    stray = astray[within].max(axis=1)
    return _Level(
        size=size,
        first=first + starts,
        reference=first + middle,
        joints=joints[middle],
        last=joints[within[:, -1]],
        reach=np.maximum(moves[:, :-1], moves[:, 1:]) + curve + stray[:, None],
        farthest=scene.motion.feed[first + within].max(axis=1),
        astray=stray,
    )


def _sift_walls(scene: Scene, walls: Walls, levels: list[_Level], sifted: Sifted) -> None:
    """Set aside links that keep off all walls over a block; look at the others in shorter blocks."""
    block, link = np.nonzero(levels[0].active(scene, ROUNDING * scene.length))
    (start, end), reach = levels[0].ends(block, link), levels[0].reach[block, link]
    case, wall = walls.in_sight((start + end) / 2.0, reach + scene.length / 2.0 + sifted.limit(scene))
    for level, finer in zip(levels, [*levels[1:], None], strict=True):
        distance = np.full(len(block), np.inf)
        away = walls.distances(level.ends(block, link), case, wall)
        np.minimum.at(distance, case, away)
        _note_least(scene, level, block, link, distance, sifted)
        spare = away - level.reach[block, link][case]
        if finer is None:
            near = spare <= scene.radius + scene.slack
            _note_distances(scene, level, block, link, distance, sifted)
            _sift_steps(scene, walls, level, (block, link, case[near], wall[near]), sifted)
            return
        near = spare <= sifted.limit(scene)
        kept = np.zeros(len(block), dtype=bool)
        kept[case[near]] = True
        _set_aside(scene, level, block[~kept], link[~kept], sifted)
        # The same in shorter blocks, but for those past the end or with the link still in the feeder.
        share = level.size // finer.size
        into = ((np.cumsum(kept) - 1)[case[near], None] * share + np.arange(share)).ravel()
        block, link = _shorter(share, block[kept]), np.repeat(link[kept], share)
        there = finer.holds(scene, block, link, ROUNDING * scene.length)
        left = there[into]
        case, wall = (np.cumsum(there) - 1)[into[left]], np.repeat(wall[near], share)[left]
        block, link = block[there], link[there]


def _shorter(share: int, block: IntArray) -> IntArray:
    """Return the shorter blocks that make up blocks, in their order."""
    return (block[:, None] * share + np.arange(share)).ravel()


def _note_least(
    scene: Scene, level: _Level, block: IntArray, link: IntArray, distance: FloatArray, sifted: Sifted
) -> None:
    """Note the least distance at reference poses, of the links for which all walls count."""
    pose = level.reference[block]
    counts = scene.arc[pose, link + 1] > ROUNDING * scene.length
    counts &= ~scene.emerging(scene.arc[pose, link])
    found = np.min(distance + level.astray[block], where=counts, initial=np.inf)
    sifted.least = min(sifted.least, float(found))


def _note_distances(
    scene: Scene, level: _Level, block: IntArray, link: IntArray, distance: FloatArray, sifted: Sifted
) -> None:
    """Note the distances at poses, and the links that are not inside."""
    pose, point = level.first[block], level.joints[block, link]
    sifted.lower[pose, link] = distance - level.astray[block]
    sifted.outside[pose, link] = ~shapely.contains_xy(scene.free, point.real, point.imag)


def _set_aside(scene: Scene, level: _Level, block: IntArray, link: IntArray, sifted: Sifted) -> None:
    """Set aside links that touch no wall over a block, unless a point of them, so all of them, is outside."""
    point = level.joints[block, link]
    outside = ~shapely.contains_xy(scene.free, point.real, point.imag)
    for one, other in zip(block[outside], link[outside], strict=True):
        poses = slice(level.first[one], level.first[one] + level.size)
        sifted.outside[poses, other] = sifted.open_steps[poses, other] = True


def _sift_steps(
    scene: Scene,
    walls: Walls,
    level: _Level,
    cases: tuple[IntArray, IntArray, IntArray, IntArray],
    sifted: Sifted,
) -> None:
    """Set aside links that a gap keeps out of walls to the next pose."""
    block, link, case, wall = cases
    pose = level.first[block]
    after = np.minimum(pose + 1, scene.motion.n_poses - 1)
    arcs = [np.stack([scene.arc[row, link + k] for k in (0, 1)], axis=1) for row in (pose, after)]
    ends, last = level.ends(block, link), (level.last[block, link], level.last[block, link + 1])
    gap = walls.gaps(ends, last, moves_evenly(*arcs), case, wall)
    emerging = scene.emerging(np.minimum(arcs[0][:, 0], arcs[1][:, 0]))
    curve = scene.curvature[pose, link + 1] + scene.swerve[pose, link]
    depth = depths_from_gaps(scene, gap, ends[0], emerging, curve, PINCH_TOLERANCE * scene.length / 8.0)
    sifted.open_steps[pose, link] = np.isinf(depth)
    bounded = np.isfinite(depth) & (after > pose)
    sifted.bound = max(sifted.bound, float(np.max(depth, where=bounded, initial=0.0)))


def _sift_pairs(scene: Scene, levels: list[_Level], sifted: Sifted) -> None:
    """Set aside pairs of links, adjacent ones left out, that keep apart over a block."""
    allowed = 2.0 * scene.radius + scene.slack
    block, first, second = _pairs_in_sight(scene, levels[0], allowed)
    for level, finer in zip(levels, [*levels[1:], None], strict=True):
        reach = level.reach[block, first] + level.reach[block, second]
        near = _pair_distances(level, block, first, second) <= reach + allowed
        block, first, second = block[near], first[near], second[near]
        if finer is None:
            pairs = np.stack([level.first[block], first, second], axis=1)
            sifted.pairs.append(pairs[np.lexsort((second, first, block))])
            return
        share = level.size // finer.size
        block, first, second = _shorter(share, block), np.repeat(first, share), np.repeat(second, share)
        there = finer.holds(scene, block, first, 0.0)
        block, first, second = block[there], first[there], second[there]


def _pairs_in_sight(scene: Scene, level: _Level, allowed: float) -> tuple[IntArray, IntArray, IntArray]:
    """Find pairs of links with their middles not too far apart to get within `allowed`."""
    first, second = np.triu_indices(scene.motion.n_links, 2)
    middle = (level.joints[:, :-1] + level.joints[:, 1:]) / 2.0
    apart = np.abs(middle[:, first] - middle[:, second])
    near = apart <= level.reach[:, first] + level.reach[:, second] + scene.length + allowed
    near &= level.active(scene, 0.0)[:, first]
    block, pair = np.nonzero(near)
    return block, first[pair], second[pair]


def _pair_distances(level: _Level, block: IntArray, first: IntArray, second: IntArray) -> FloatArray:
    """Compute the distances between links at reference poses."""
    distance = np.empty(len(block))
    for part in slices(len(block)):
        (start, end), others = (level.ends(block[part], link[part]) for link in (first, second))
        length = np.abs(end - start)
        along = np.where(length > 0.0, end - start, 1.0) / np.where(length > 0.0, length, 1.0)
        framed = [(other - start) * along.conj() for other in others]
        distance[part] = segment_distances((framed[0], framed[1]), length)
    return distance
