"""Between poses, against the walls: a bound decides, not samples (see `planners.validation`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import shapely

from hrsnake_env.arm import FloatArray
from planners.checks.gaps import Walls, complex_from_points, depths_from_gaps, moves_evenly
from planners.checks.scene import MAX_SPLITS, BoolArray, Geometry, IntArray, Scene, halves, point_of, prepared
from planners.checks.thin import N_LEVELS, SHARE
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING
from planners.checks.walls import are_deep, nearest
from planners.problem import Fault, Progress

ARC_SEGMENTS = 32
"""Chords per quarter of an arc where the free space is shrunk by a link radius."""

GROWTHS = (1e-6, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 7 / 8)
"""By how much the free space is grown between poses, in pinch tolerances; the first is for rounding alone."""

FINE_GROWTHS = tuple(0.5 / 4.0**level for level in range(N_LEVELS))
"""The same where walls are thin: half of what a wall of each thickness allows, the rest is for the curve."""

PATIENCE = 6
"""How often a piece is halved before depths over an eighth of the tolerance are accepted."""

GROUP = 1024
"""How many links on their way from a pose to the next are looked at together."""

MAX_PIECES = 40_000
"""How many pieces of one group there may be before the rest counts as not bounded."""

LATE = MAX_SPLITS - 4
"""After so many halvings there may be an eighth of them: only touched places are left of what is free."""

OPEN_SAMPLES = 512
"""How many pieces that are not bounded are looked at when a fault there is described."""

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


def _inset(scene: Scene, growth: float) -> float:
    """Return by how much to shrink the free space for a depth of at most `growth`, to be sure a little less.

    Buffers have chords in place of arcs: growing falls short, shrinking does not shrink enough. Shallow dents
    may be filled by a hundredth of the distance.
    """
    inset = scene.radius - growth
    return 0.99 * inset if inset <= 0.0 else inset / math.cos(math.pi / (4 * ARC_SEGMENTS))


def _region(scene: Scene, growth: float) -> _Region:
    """Build the region for a depth of at most `growth`."""
    inset = _inset(scene, growth)
    if inset <= 0.0:
        grown = prepared(scene.free.buffer(-inset))
        return _Region(depth=growth, everywhere=grown, in_front=grown)
    everywhere = scene.free.buffer(-inset, quad_segs=ARC_SEGMENTS)
    in_front = scene.open_behind.buffer(-inset, quad_segs=ARC_SEGMENTS).intersection(scene.free)
    # The distance that came of it is measured: that it is large enough is then beyond doubt.
    wanted = scene.radius - growth
    kept = min(
        shapely.distance(everywhere, scene.walls) if not everywhere.is_empty else wanted,
        shapely.distance(in_front, scene.walls_in_front) if not in_front.is_empty else wanted,
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

    def placed(self, scene: Scene, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the segments in the maze at a time of each piece, shape (n, 2, 2), and the joints' arcs."""
        joints, arc = scene.ends(self.interval, self.link, time)
        joints = scene.in_maze(joints, arc)
        return joints[:, :1] + self.part[..., None] * (joints[:, 1:] - joints[:, :1]), arc


def check_between(
    scene: Scene, doubtful: BoolArray, deep: BoolArray, tell: Progress
) -> tuple[float, Fault | None]:
    """Bound the depth between poses, and find the worst place where there is no bound up to the tolerance.

    Only links that are `doubtful` after a pose are looked at, and of these not those that are deeper at one
    of the two poses: the fault of that pose says it already.
    """
    bound, skipped = 0.0, deep[1:] | deep[:-1]
    moving = np.maximum(scene.arc[1:, 1:], scene.arc[:-1, 1:]) > ROUNDING * scene.length
    interval, link = np.nonzero(moving & doubtful[:-1] & ~skipped)
    region_of = cache(partial(_region, scene))
    walls, open_ = Walls.of(scene), []
    for first in range(0, len(link), GROUP):
        chosen = slice(first, first + GROUP)
        span = np.tile((0.0, 1.0), (len(link[chosen]), 1))
        pieces = _Pieces(interval=interval[chosen], link=link[chosen], time=span, part=span)
        group_bound, group_open = _swept(scene, pieces, walls, region_of)
        bound = max(bound, group_bound)
        open_ += [piece for piece in group_open if len(piece)]
        tell("validate", 0.6 + 0.2 * min(1.0, (first + GROUP) / len(link)))
    if open_:
        return math.inf, _sweep_fault(scene, open_)
    return math.inf if skipped.any() else bound, None


def _swept(
    scene: Scene, pieces: _Pieces, walls: Walls, region_of: Callable[[float], _Region]
) -> tuple[float, list[_Pieces]]:
    """Bound the depth of pieces by halving; return the bound, and the pieces that are deep or still open."""
    tolerance, bound, deep = PINCH_TOLERANCE * scene.length, 0.0, []
    deepest = scene.radius - _inset(scene, GROWTHS[-1] * tolerance)  # by hulls, so by gaps too
    for level in range(MAX_SPLITS + 1):
        if not len(pieces):
            break
        limit = tolerance if level >= PATIENCE else tolerance / 8.0
        span = np.ptp(pieces.time, axis=1)
        (before, early), (after, late) = (pieces.placed(scene, pieces.time[:, k]) for k in (0, 1))
        emerging = scene.emerging(np.minimum(early[:, 0], late[:, 0]))
        even = moves_evenly(early, late)
        swerve = np.where(even, 0.0, scene.swerve[pieces.interval, pieces.link] * span)
        curve = scene.curvature[pieces.interval, pieces.link + 1] * span**2 + swerve
        depth = _gap_depth(scene, walls, (before, after), even, emerging, curve, min(limit, deepest))
        rest = np.flatnonzero(np.isinf(depth))
        corners = np.concatenate([before, after], axis=1)[rest]
        depth[rest] = _hull_depth(scene, corners, emerging[rest], curve[rest], region_of, limit)
        bound = max(bound, float(np.max(depth, where=np.isfinite(depth), initial=0.0)))
        left = np.isinf(depth)
        twist = np.linalg.norm((after[:, 1] - before[:, 1]) - (after[:, 0] - before[:, 0]), axis=1) / 4.0
        in_time = (curve >= np.minimum(twist, tolerance / 32.0)) | (swerve > 0.0)
        in_time, pieces = in_time[left], pieces[left]
        middle, arc = pieces.placed(scene, pieces.time.mean(axis=1))
        is_deep = _too_deep(scene, middle, scene.emerging(arc[:, 0]))
        deep.append(pieces[is_deep])
        most = MAX_PIECES if level < LATE else MAX_PIECES // 8
        if level == MAX_SPLITS or 2 * len(pieces) > most:
            break
        # One deep place is enough to know of a link between two poses.
        names = pieces.interval * scene.motion.n_links + pieces.link
        go_on = ~np.isin(names, names[is_deep])
        pieces = pieces[go_on].halved(in_time[go_on])
    return bound, [*deep, pieces]


def _gap_depth(
    scene: Scene,
    walls: Walls,
    segments: tuple[FloatArray, FloatArray],
    together: BoolArray,
    emerging: BoolArray,
    curve: FloatArray,
    limit: float,
) -> FloatArray:
    """Bound the depth by gaps of segments, shape (n, 2, 2), before and after; infinite beyond `limit`."""
    before, after = (complex_from_points(segment) for segment in segments)
    ends = np.concatenate([before, after], axis=1)
    middle = ends.mean(axis=1)
    reach = np.abs(ends - middle[:, None]).max(axis=1) + scene.radius + curve + scene.slack
    case, wall = walls.in_sight(middle, reach)
    gap = walls.gaps((before[:, 0], before[:, 1]), (after[:, 0], after[:, 1]), together, case, wall)
    return depths_from_gaps(scene, gap, before[:, 0], emerging, curve, limit)


def _hull_depth(
    scene: Scene,
    corners: FloatArray,
    emerging: BoolArray,
    curve: FloatArray,
    region_of: Callable[[float], _Region],
    limit: float,
) -> FloatArray:
    """Bound the depth of hulls of `corners`, shape (n, 4, 2), grown by `curve`; infinite beyond `limit`."""
    depth = np.full(len(corners), np.inf)
    tunnels = scene.may_tunnel(emerging) if len(corners) else emerging
    growths = GROWTHS if not tunnels.any() else sorted({*GROWTHS, *FINE_GROWTHS})
    for growth in np.array(growths) * PINCH_TOLERANCE * scene.length:
        rest = np.flatnonzero(np.isinf(depth) & (growth + curve <= limit))
        if not len(rest):
            continue
        region = region_of(float(growth))
        rest = rest[region.depth + curve[rest] <= limit]
        hulls = shapely.convex_hull(shapely.linestrings(corners[rest]))
        covered = region.covers(hulls, emerging[rest])
        thin = np.flatnonzero(covered & tunnels[rest])
        covered[thin] = scene.thin.keeps_off(hulls[thin], growth + curve[rest[thin]])
        free = rest[covered]
        depth[free] = region.depth + curve[free]
    return depth


def _too_deep(scene: Scene, segments: FloatArray, emerging: BoolArray) -> BoolArray:
    """Say which capsules are surely deeper in a wall than allowed between poses."""
    deep = are_deep(scene, segments, emerging)
    tunnels = scene.may_tunnel(emerging) if len(emerging) else emerging
    if tunnels.any():
        deep[tunnels] |= shapely.intersects(scene.thin.core, shapely.linestrings(segments[tunnels]))
    return deep


def _sweep_fault(scene: Scene, open_: list[_Pieces]) -> Fault:
    """Name the worst of the pieces that are not bounded, by the depth at the middle of each."""
    worst: tuple[float, int, int] | None = None
    for pieces in open_:
        chosen = np.zeros(len(pieces), dtype=bool)
        chosen[:: 1 + len(pieces) // OPEN_SAMPLES] = True
        pieces = pieces[chosen]
        middle, arc = pieces.placed(scene, pieces.time.mean(axis=1))
        clearance, index, _ = nearest(scene, middle, scene.emerging(arc[:, 0]))
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
    segments, arc = samples.placed(scene, times)
    clearance, _, place = nearest(scene, segments, scene.emerging(arc[:, 0]))
    amount, what = -clearance, f"gets {scene.figure(-clearance)} deep in a wall"
    if amount <= PINCH_TOLERANCE * scene.length:
        amount, what = (
            math.inf,
            f"could not be shown to get at most {PINCH_TOLERANCE:g} link lengths deep in a wall, "
            f"and at most {SHARE:g} of its thickness",
        )
    message = f"Link {link} {what} between poses {pose} and {pose + 1}."
    return Fault(kind="sweep", message=message, pose=pose, link=link, place=point_of(place), amount=amount)
