"""Set aside, cheaply and surely, what is far from every wall and from the rest of the arm.

Over a block of poses no point of a link leaves its place at a reference pose by more than the link's `reach`
(the larger way of its two joints to any pose of the block, and e of its tip-side joint in between). What is
farther away than that at the reference pose is out of reach all the time; what is not is looked at again in
shorter blocks, in the end from pose to pose. There a gap decides (`gaps`): a joint goes along its chord but
for e, so a link keeps off a wall by a gap if at every moment the wall's line, or the link's, has wall and
link on two sides of it at that distance. Only what this leaves is handed to the exact polygons.

Points are complex numbers here, mostly in the frame of a wall that runs from 0 to its length along the real
axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely

from hrsnake_env.arm import FloatArray, joints_from_configuration
from planners.checks.gaps import ComplexArray, complex_from_points, segment_distances, segment_gaps
from planners.checks.scene import PINCH_TOLERANCE, ROUNDING, BoolArray, IntArray, Scene
from planners.problem import Progress

SIZES = (64, 16, 4, 1)
"""Steps from pose to pose in a block, at each level; each a multiple of the next."""

SPAN = 512
"""Steps that are looked at together, a multiple of the largest block."""

SLICE = 1 << 15
"""How many distances are computed together, to bound the memory and stay in the cache."""


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
    pairs : list of arrays, shape (n, 3)
        Step and both links of the pairs that may meet.
    """

    lower: FloatArray
    outside: BoolArray
    open_steps: BoolArray
    least: float = math.inf
    bound: float = 0.0
    pairs: list[IntArray] = field(default_factory=list)

    def doubtful(self, scene: Scene) -> BoolArray:
        """Say which links at poses may be in a wall, or be the nearest to one."""
        return self.outside | (self.lower <= self.reach_out(scene))

    def reach_out(self, scene: Scene) -> float:
        """Return the distance up to which walls matter at poses."""
        return max(scene.radius, self.least) + ROUNDING * scene.length


@dataclass(frozen=True, eq=False, kw_only=True)
class _Walls:
    """Hold where walls start, their directions (of length 1) and their lengths, each of shape (n_walls,)."""

    start: ComplexArray
    along: ComplexArray
    length: FloatArray

    @classmethod
    def of(cls, scene: Scene) -> _Walls:
        ends = complex_from_points(scene.maze.walls)
        sides = ends[:, 1] - ends[:, 0]
        ends, sides = ends[sides != 0.0], sides[sides != 0.0]
        return cls(start=ends[:, 0], along=sides / np.abs(sides), length=np.abs(sides))


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


def sift(scene: Scene, tell: Progress) -> Sifted:
    """Set aside what is free at and between poses, and pairs of links that keep apart."""
    shape = (scene.motion.n_poses, scene.motion.n_links)
    sifted = Sifted(
        lower=np.full(shape, np.inf),
        outside=np.zeros(shape, dtype=bool),
        open_steps=np.zeros(shape, dtype=bool),
    )
    walls = _Walls.of(scene)
    for first in range(0, shape[0], SPAN):
        poses = np.arange(first, min(first + SPAN + 1, shape[0]))
        joints, astray = _placed(scene, poses)
        levels = [_level(scene, joints, astray, first, size) for size in SIZES]
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
    curvature = scene.curvature[first + within[:, :-1], 1:].max(axis=1)
    stray = astray[within].max(axis=1)
    return _Level(
        size=size,
        first=first + starts,
        reference=first + middle,
        joints=joints[middle],
        last=joints[within[:, -1]],
        reach=np.maximum(moves[:, :-1], moves[:, 1:]) + curvature + stray[:, None],
        farthest=scene.motion.feed[first + within].max(axis=1),
        astray=stray,
    )


def _sift_walls(scene: Scene, walls: _Walls, levels: list[_Level], sifted: Sifted) -> None:
    """Set aside links that keep off all walls over a block; look at the others in shorter blocks."""
    level = levels[0]
    block, link = np.nonzero(level.active(scene, ROUNDING * scene.length))
    case, wall = _in_sight(walls, level, block, link, scene.length / 2.0 + sifted.reach_out(scene))
    for level, finer in zip(levels, [*levels[1:], None], strict=True):
        distance = _wall_distances(walls, level, block[case], link[case], wall)
        _note_least(scene, level, block[case], link[case], distance, sifted)
        spare = distance - level.reach[block, link][case]
        if finer is None:
            _sift_steps(scene, walls, level, (block, link, case, wall), (distance, spare), sifted)
            return
        near = spare <= sifted.reach_out(scene)
        kept = np.zeros(len(block), dtype=bool)
        kept[case[near]] = True
        _set_aside(scene, level, block[~kept], link[~kept], sifted)
        # The same in shorter blocks, but for those past the end or with the link still in the feeder.
        share = level.size // finer.size
        into = (np.cumsum(kept) - 1)[case[near], None] * share + np.arange(share)
        block = (block[kept, None] * share + np.arange(share)).ravel()
        link, case, wall = np.repeat(link[kept], share), into.ravel(), np.repeat(wall[near], share)
        there = block < len(finer.first)
        there[there] = finer.active(scene, ROUNDING * scene.length)[block[there], link[there]]
        case, wall = case[there[case]], wall[there[case]]
        block, link, case = block[there], link[there], (np.cumsum(there) - 1)[case]


def _in_sight(
    walls: _Walls, level: _Level, block: IntArray, link: IntArray, limit: float
) -> tuple[IntArray, IntArray]:
    """Find the walls with their middle not too far from that of a link for it to get within `limit`."""
    middle = (level.joints[block, link] + level.joints[block, link + 1]) / 2.0
    apart = np.abs(middle[:, None] - (walls.start + walls.along * walls.length / 2.0))
    case, wall = np.nonzero(apart <= level.reach[block, link][:, None] + walls.length / 2.0 + limit)
    return case, wall


def _wall_distances(
    walls: _Walls, level: _Level, block: IntArray, link: IntArray, wall: IntArray
) -> FloatArray:
    """Compute the distances from links at reference poses to walls."""
    distance = np.empty(len(wall))
    for part in _slices(len(wall)):
        at, start, along = block[part], walls.start[wall[part]], walls.along[wall[part]].conj()
        distance[part] = segment_distances(
            (level.joints[at, link[part]] - start) * along,
            (level.joints[at, link[part] + 1] - start) * along,
            walls.length[wall[part]],
        )
    return distance


def _note_least(
    scene: Scene, level: _Level, block: IntArray, link: IntArray, distance: FloatArray, sifted: Sifted
) -> None:
    """Note the least distance at reference poses, of the links for which all walls count."""
    arc = scene.arc[level.reference[block], link]
    counts = (arc + scene.length > ROUNDING * scene.length) & ~scene.emerging(arc)
    found = np.min(distance + level.astray[block], where=counts, initial=np.inf)
    sifted.least = min(sifted.least, float(found))


def _set_aside(scene: Scene, level: _Level, block: IntArray, link: IntArray, sifted: Sifted) -> None:
    """Set aside links that touch no wall over a block; they are inside if one point of them is."""
    inside = _are_inside(scene, level, block, link)
    for one, other in zip(block[~inside], link[~inside], strict=True):
        poses = slice(level.first[one], level.first[one] + level.size)
        sifted.outside[poses, other] = sifted.open_steps[poses, other] = True


def _are_inside(scene: Scene, level: _Level, block: IntArray, link: IntArray) -> BoolArray:
    point = level.joints[block, link]
    return np.asarray(shapely.contains_xy(scene.free, point.real, point.imag))


def _sift_steps(
    scene: Scene,
    walls: _Walls,
    level: _Level,
    cases: tuple[IntArray, IntArray, IntArray, IntArray],
    measured: tuple[FloatArray, FloatArray],
    sifted: Sifted,
) -> None:
    """Note distances at poses, and set aside links that a gap keeps out of walls to the next pose."""
    block, link, case, wall = cases
    distance, spare = measured
    pose, inside = level.first[block], _are_inside(scene, level, block, link)
    least = np.full(len(block), np.inf)
    np.minimum.at(least, case, distance)
    sifted.lower[pose, link] = least - level.astray[block]
    sifted.outside[pose, link] = ~inside
    near = spare <= scene.radius + ROUNDING * scene.length
    gap = np.full(len(block), np.inf)
    np.minimum.at(
        gap, case[near], _step_gaps(scene, walls, level, block[case[near]], link[case[near]], wall[near])
    )
    depth = np.where(np.isinf(gap), 0.0, scene.radius + scene.curvature[pose, link + 1] - gap)
    depth = np.maximum(depth, 0.0)
    after = np.minimum(pose + 1, scene.motion.n_poses - 1)
    emerging = scene.emerging(np.minimum(scene.arc[pose, link], scene.arc[after, link]))
    decided = inside & (gap > ROUNDING * scene.length) & (depth <= PINCH_TOLERANCE * scene.length / 8.0)
    decided &= np.isinf(gap) | ~emerging
    sifted.open_steps[pose, link] = ~decided
    decided &= after > pose
    sifted.bound = max(sifted.bound, float(np.max(depth, where=decided, initial=0.0)))


def _step_gaps(
    scene: Scene, walls: _Walls, level: _Level, block: IntArray, link: IntArray, wall: IntArray
) -> FloatArray:
    """Compute by how much links surely keep off walls, but for e, from a pose to the next."""
    after = np.minimum(level.first + 1, scene.motion.n_poses - 1)
    # Of a link that comes out of the feeder in between, the end at the base does not move evenly.
    behind = scene.arc[level.first] < 0.0, scene.arc[after] < 0.0
    even = behind[0] == behind[1]
    together = even[:, :-1] & even[:, 1:]
    gap = np.empty(len(wall))
    for part in _slices(len(wall)):
        at, of, start, along = (
            block[part],
            link[part],
            walls.start[wall[part]],
            walls.along[wall[part]].conj(),
        )
        a, b, c, d = (
            (joints[at, of + k] - start) * along for joints in (level.joints, level.last) for k in (0, 1)
        )
        gap[part] = segment_gaps((a, b), (c, d), walls.length[wall[part]], together[at, of])
    return gap


def _sift_pairs(scene: Scene, levels: list[_Level], sifted: Sifted) -> None:
    """Set aside pairs of links, adjacent ones left out, that keep apart over a block."""
    allowed = 2.0 * scene.radius + ROUNDING * scene.length
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
        block = (block[:, None] * share + np.arange(share)).ravel()
        first, second = np.repeat(first, share), np.repeat(second, share)
        there = block < len(finer.first)
        there[there] = finer.active(scene, 0.0)[block[there], first[there]]
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
    for part in _slices(len(block)):
        start, end, other, far = (
            level.joints[block[part], joint[part] + k] for joint in (second, first) for k in (0, 1)
        )
        length = np.abs(end - start)
        along = np.where(length > 0.0, (end - start) / np.where(length > 0.0, length, 1.0), 1.0).conj()
        distance[part] = segment_distances((other - start) * along, (far - start) * along, length)
    return distance


def _slices(length: int) -> list[slice]:
    return [slice(first, first + SLICE) for first in range(0, length, SLICE)]
