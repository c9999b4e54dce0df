"""Between poses, against the walls: a bound decides, not samples (see `planners.validation`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from hrsnake_env.arm import FloatArray
from planners.checks.scene import (
    CHUNK,
    MAX_SPLITS,
    PINCH_TOLERANCE,
    ROUNDING,
    BoolArray,
    Geometry,
    IntArray,
    Scene,
    halves,
    point_of,
    prepared,
)
from planners.checks.walls import are_deep, nearest
from planners.problem import Fault, Progress

ARC_SEGMENTS = 32
"""Chords per quarter of an arc where the free space is shrunk by a link radius."""

GROWTHS = (1e-6, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 7 / 8)
"""By how much the free space is grown between poses, in pinch tolerances; the first is for rounding alone."""

PATIENCE = 6
"""How often a piece is halved before depths over an eighth of the tolerance are accepted."""

MAX_PIECES = 40_000
"""How many pieces of one chunk of poses are looked at together before the rest counts as not bounded."""

FAULT_SAMPLES = 257
"""Times between two poses at which the depth is looked for when a fault there is described."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _Region:
    """Hold where a centre line may be for its link to be at most `depth` deep in a wall.

    `in_front` is the same for links for which walls behind the base do not count.
    """

    depth: float
    everywhere: Geometry
    in_front: Geometry

    def covers(self, geometries: Geometry, emerging: BoolArray) -> BoolArray:
        """Say which centre lines, or hulls of them, keep to the depth."""
        covered = shapely.covers(self.everywhere, geometries)
        if emerging.any():
            covered[emerging] = shapely.covers(self.in_front, geometries[emerging])
        return np.asarray(covered)


def _region(scene: Scene, growth: float) -> _Region:
    """Build the region for a depth of at most `growth`, to be sure a little less than that.

    Buffers have chords in place of arcs, so growing falls short; shrinking does by the factor of `inflated`.
    Shallow dents may be filled by a hundredth of the distance.
    """
    shrink = scene.radius - growth
    if shrink <= 0.0:
        grown = prepared(scene.free.buffer(-0.99 * shrink))
        return _Region(depth=growth, everywhere=grown, in_front=grown)
    inflated = shrink / math.cos(math.pi / (4 * ARC_SEGMENTS))
    everywhere = scene.free.buffer(-inflated, quad_segs=ARC_SEGMENTS)
    in_front = scene.open_behind.buffer(-inflated, quad_segs=ARC_SEGMENTS).intersection(scene.free)
    # The distance that came of it is measured: that it is large enough is then beyond doubt.
    kept = min(
        shapely.distance(everywhere, scene.walls) if not everywhere.is_empty else shrink,
        shapely.distance(in_front, scene.walls_in_front) if not in_front.is_empty else shrink,
    )
    return _Region(depth=scene.radius - kept, everywhere=prepared(everywhere), in_front=prepared(in_front))


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
        time = np.where(in_time[:, None, None], halves(self.time), self.time[:, None])
        part = np.where(in_time[:, None, None], self.part[:, None], halves(self.part))
        return _Pieces(
            interval=np.repeat(self.interval, 2),
            link=np.repeat(self.link, 2),
            time=time.reshape(-1, 2),
            part=part.reshape(-1, 2),
        )

    def placed(self, scene: Scene, time: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Compute the segments in the maze at a time of each piece, shape (n, 2, 2), and which emerge."""
        joints, arc = scene.ends(self.interval, self.link, time)
        joints = scene.in_maze(joints, arc)
        segments = joints[:, :1] + self.part[..., None] * (joints[:, 1:] - joints[:, :1])
        return segments, scene.emerging(arc[:, 0])


def check_between(
    scene: Scene, doubtful: BoolArray, deep: BoolArray, tell: Progress
) -> tuple[float, Fault | None]:
    """Bound the depth between poses, and find the worst place where there is no bound up to the tolerance.

    Only links that are `doubtful` after a pose are looked at, and of these not those that are deeper at one
    of the two poses: the fault of that pose says it already.
    """
    motion, bound = scene.motion, 0.0
    skipped = deep[1:] | deep[:-1]
    moving = np.maximum(scene.arc[1:, 1:], scene.arc[:-1, 1:]) > ROUNDING * scene.length
    interval, link = np.nonzero(moving & doubtful[:-1] & ~skipped)
    shares = GROWTHS if len(link) else ()
    regions = [_region(scene, share * PINCH_TOLERANCE * scene.length) for share in shares]
    open_: list[_Pieces] = []
    for first in range(0, motion.n_poses - 1, CHUNK):
        chosen = (interval >= first) & (interval < first + CHUNK)
        span = np.tile((0.0, 1.0), (int(chosen.sum()), 1))
        pieces = _Pieces(interval=interval[chosen], link=link[chosen], time=span, part=span)
        chunk_bound, chunk_open = _swept(scene, pieces, regions)
        bound = max(bound, chunk_bound)
        open_ += [piece for piece in chunk_open if len(piece)]
        tell("validate", 0.6 + 0.2 * min(1.0, (first + CHUNK) / motion.n_poses))
    if open_:
        return math.inf, _sweep_fault(scene, open_)
    return math.inf if skipped.any() else bound, None


def _swept(scene: Scene, pieces: _Pieces, regions: list[_Region]) -> tuple[float, list[_Pieces]]:
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
        is_deep = are_deep(scene, middle, emerging)
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


def _sweep_fault(scene: Scene, open_: list[_Pieces]) -> Fault:
    """Name the worst of the pieces that are not bounded, by the depth at the middle of each."""
    worst: tuple[float, int, int] | None = None
    for pieces in open_:
        clearance, index, _ = nearest(scene, *pieces.placed(scene, pieces.time.mean(axis=1)))
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
    clearance, _, place = nearest(scene, segments, emerging)
    amount, what = -clearance, f"gets {scene.figure(-clearance)} deep in a wall"
    if amount <= PINCH_TOLERANCE * scene.length:
        amount, what = (
            math.inf,
            f"could not be shown to get at most {PINCH_TOLERANCE:g} link lengths deep in a wall",
        )
    message = f"Link {link} {what} between poses {pose} and {pose + 1}."
    return Fault(kind="sweep", message=message, pose=pose, link=link, place=point_of(place), amount=amount)
