"""A second checker of planar motions, written from scratch: slow, plain, and sharing nothing with the first.

At the poses all is exact. A link in a wall is deepest at one of its ends, or where two features of the
walls (corners, or lines that walls lie on) are equally far from it: between such places the distance to
every feature is convex along the link, so the least of them is largest at an end. All these places are
listed and measured.

Between poses the way is cut into `CUTS` pieces. The link at the cuts says how deep it gets at least; the
hulls of its places at two neighbouring cuts, grown by how far a turning link leaves them at most, say what
it sweeps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
import shapely
from shapely.geometry import Polygon

CUTS = 12
"""Pieces into which the way from a pose to the next is cut."""

TIE = 1e-9
"""Within so many link lengths of a limit both verdicts are right."""

DEEP = 1e-3
"""Largest depth between poses, in link lengths."""


@dataclass
class Findings:
    """Hold the figures, in maze units, and for each kind of fault whether it is there; None if that is open.

    `between_low` is a depth that some link reaches between poses, `swept_free` whether the swept areas are
    free, and `astray` how far the joints are from where the configuration puts them.
    """

    clearance: float = math.inf
    penetration: float = 0.0
    length_error: float = 0.0
    largest_step: float = 0.0
    goal_distance: float = 0.0
    between_low: float = 0.0
    astray: float = 0.0
    swept_free: bool = True
    faulty: dict[str, bool | None] = field(default_factory=dict)

    def judge(self, kind: str, amount: float, limit: float, tie: float) -> None:
        """Note whether an amount is over its limit, or too near to it to tell."""
        self.faulty[kind] = None if abs(amount - limit) <= tie else bool(amount > limit)


def place(feed, angles, length, base):
    """Return the joints, shape (n, n_links + 1), as complex numbers."""
    turn = base[2] + np.cumsum(angles, axis=1)
    links = length * np.exp(1j * turn)
    rear = complex(base[0], base[1]) + (feed - angles.shape[1] * length) * np.exp(1j * base[2])
    return np.concatenate([rear[:, None], rear[:, None] + np.cumsum(links, axis=1)], axis=1)


def inspect(motion, maze, arm, cores=()):
    """Check a motion; `cores` are lines inside thin walls that no link may cross at any time."""
    found, length = Findings(), motion.link_length
    joints = motion.joints[..., 0] + 1j * motion.joints[..., 1]
    past = motion.feed[:, None] - (motion.n_links - np.arange(motion.n_links + 1)) * length
    _arm_alone(found, motion, maze, arm, joints, past)
    walls = Walls(maze, arm.link_radius, length)
    _at_poses(found, walls, joints, past, length)
    _between(found, walls, motion, cores)
    return found


def _arm_alone(found, motion, maze, arm, joints, past):
    length, n_links, base = motion.link_length, motion.n_links, motion.base_pose
    frame = (joints - complex(base[0], base[1])) * np.exp(-1j * base[2])  # the feeder along the real axis
    placed = place(motion.feed, motion.joint_angles, length, base)
    rounding = 1e-12 * length + 1e-14 * np.abs(joints).max() * n_links

    found.length_error = float(np.abs(np.abs(np.diff(joints, axis=1)) - length).max())
    found.judge("length", found.length_error, 1e-9 * length, rounding)
    found.astray = float(np.abs(joints - placed).max())
    found.judge("inconsistent", found.astray, 1e-6 * length, rounding)
    if motion.n_poses > 1:
        found.largest_step = float(np.abs(np.diff(joints, axis=0)).max())
    found.judge("step", found.largest_step, 0.05 * length, 1.1e-9 * length)
    found.goal_distance = float(abs(joints[-1, -1] - complex(*maze.goal)))
    found.judge("goal", found.goal_distance, maze.goal_radius, rounding)
    at_start = (np.arange(n_links + 1) - n_links) * length
    found.judge("start", float(np.abs(frame[0] - at_start).max()), 1e-6 * length, rounding)

    # The feeder: a feed it can have, its rear joint on the axis, and the links it holds straight on.
    amount = max(motion.feed.max() - n_links * length, -motion.feed.min(), np.abs(frame[:, 0].imag).max())
    for pose in range(motion.n_poses):
        neighbours = slice(max(0, pose - 1), pose + 2)
        for link in range(n_links):
            if past[neighbours, link].min() < -1e-9 * length:
                one, other = frame[pose, link], frame[pose, link + 1]
                aside = max(abs(one.imag), abs(other.imag)) if other.real > one.real else length
                amount = max(amount, aside)
    found.judge("feeder", float(amount), 1e-6 * length, rounding)
    if np.abs(past[:, :-1] + 1e-9 * length).min() < rounding:
        found.faulty["feeder"] = None

    allowed = np.clip(16.0 * past[:, :-1] / length, 0.0, math.pi)
    excess = float((np.abs(motion.joint_angles) - allowed).max())
    found.judge("release", excess, 1e-6, 1e-11 + 16.0 * rounding / length)
    limit = math.inf if arm.joint_limit is None else arm.joint_limit + 1e-9
    found.judge("joint limit", float(np.abs(motion.joint_angles).max()), limit, 1e-12)


class Walls:
    """The walls, as what is solid and as segments."""

    def __init__(self, maze, radius, length):
        x_min, y_min, x_max, y_max = maze.free_space.bounds
        frame = 2.0 * math.hypot(x_max - x_min, y_max - y_min)
        everything = shapely.box(x_min - frame, y_min - frame, x_max + frame, y_max + frame)
        self.free, self.radius, self.base = maze.free_space, radius, maze.base_pose
        self.solid = everything.difference(maze.free_space)
        shapely.prepare(self.free)
        self.ends = maze.walls[..., 0] + 1j * maze.walls[..., 1]
        self.solid_in_front = self.solid
        if radius > 0.0:
            x, y, heading = maze.base_pose
            x, y = x + 1e-9 * length * math.cos(heading), y + 1e-9 * length * math.sin(heading)
            along, across = 2 * frame * np.exp(1j * heading), 2 * frame * 1j * np.exp(1j * heading)
            corners = [complex(x, y) + z for z in (across, across + along, along - across, -across)]
            front = self.solid.intersection(Polygon([(z.real, z.imag) for z in corners]))
            # Walls that only touch the line across the base, by rounding or not, are not in front of it.
            parts = [part for part in shapely.get_parts(front) if part.area > 1e-9 * radius**2]
            self.solid_in_front = shapely.union_all(parts)

    def contains(self, points):
        """Say which points, complex, are in the free space or on its border."""
        return shapely.intersects_xy(self.free, points.real, points.imag)

    def depth(self, points):
        """Return the distance to the nearest wall, for complex points of shape (n,)."""
        return point_distances(points, self.ends[:, 0], self.ends[:, 1]).min(axis=1)

    def deepest(self, start, end):
        """Return the depth of the deepest of many segments in the walls: exact."""
        share = np.linspace(0.0, 1.0, 9)
        points = start[:, None] + share * (end - start)[:, None]
        flat = points.ravel()
        depth = np.where(self.contains(flat), 0.0, self.depth(flat)).reshape(points.shape)
        best = float(depth.max())
        most = depth.max(axis=1) + np.abs(end - start) / 16.0 * (1.0 + 1e-9)
        for one in np.argsort(-most):
            if most[one] <= best:
                break
            best = max(best, self._deepest_of(start[one], end[one], best))
        return best

    def _deepest_of(self, start, end, least):
        """Return the depth of one segment, or 0 if it is less than `least`."""
        corners, along = np.unique(self.ends[:, 0]), self.ends[:, 1] - self.ends[:, 0]
        way, normal = end - start, 1j * along / np.abs(along)
        # Squares of distances to corners and to lines, as polynomials of the share of the way.
        off = start - corners
        to_corners = np.stack([np.full(len(off), abs(way) ** 2), 2 * dot(way, off), np.abs(off) ** 2], axis=1)
        rate, level = dot(way, normal), dot(start - self.ends[:, 0], normal)
        to_lines = np.stack([rate**2, 2 * rate * level, level**2], axis=1)
        squares = np.concatenate([to_corners, to_lines])
        first, second = np.triu_indices(len(squares), 1)
        a, b, c = (squares[first] - squares[second]).T
        with np.errstate(all="ignore"):
            root = np.sqrt(np.maximum(b * b - 4 * a * c, 0.0))
            half = -(b + np.where(b >= 0.0, root, -root)) / 2
            shares = np.concatenate([half / a, c / half, [0.0, 1.0]])
        points = start + shares[(shares >= 0.0) & (shares <= 1.0)] * way
        depth = self.depth(points)
        points, depth = points[depth > least], depth[depth > least]
        return float(depth.max(where=~self.contains(points), initial=0.0))


def dot(one, other):
    """Return the dot products of complex vectors."""
    return one.real * other.real + one.imag * other.imag


def point_distances(points, start, end):
    """Return the distances from points, shape (n,), to segments, shape (m,), as shape (n, m)."""
    along, offset = end - start, points[:, None] - start
    share = np.clip(dot(offset, along) / np.maximum(np.abs(along) ** 2, 1e-300), 0.0, 1.0)
    return np.abs(offset - share * along)


def as_lines(start, end):
    """Return segments between complex points as shapely lines."""
    return shapely.linestrings(np.stack([np.stack([z.real, z.imag], axis=-1) for z in (start, end)], axis=-2))


def in_maze(joints, past, length, base):
    """Return starts and ends of links past the base, what is in the feeder put at the base; and which."""
    placed = np.where(past < 0.0, complex(base[0], base[1]), joints)
    row, link = np.nonzero(past[:, 1:] > 1e-9 * length)
    return placed[row, link], placed[row, link + 1], row, link


def leave_free(walls, start, end):
    """Say which segments are not all in the free space; touching a wall is free."""
    return ~shapely.covers(walls.free, as_lines(start, end))


def _at_poses(found, walls, joints, past, length):
    start, end, row, link = in_maze(joints, past, length, walls.base)
    if not len(start):
        found.faulty["penetration"] = False
        return
    emerging = (past[row, link] < walls.radius) & (walls.radius > 0.0)
    deepest = walls.deepest(start, end)
    if deepest > 0.0:
        found.clearance = -deepest - walls.radius
    else:
        lines = as_lines(start, end)
        away = shapely.distance(lines, walls.solid)
        away[emerging] = shapely.distance(lines[emerging], walls.solid_in_front)
        found.clearance = float(away.min()) - walls.radius
    found.penetration = max(0.0, -found.clearance)
    limit = 0.0 if walls.radius == 0.0 else 1e-9 * length
    found.judge("penetration", -found.clearance, limit, TIE * length)


def _between(found, walls, motion, cores):
    length, n_links = motion.link_length, motion.n_links
    folded = np.abs(motion.joint_angles[:, 1:]).max(initial=0.0) - (math.pi - 1e-9)
    share = np.arange(0, CUTS + 1) / CUTS
    share = share[None] if motion.n_poses > 1 else np.zeros((1, 1))
    before, after = (slice(None, -1), slice(1, None)) if motion.n_poses > 1 else (slice(None), slice(None))
    feed = motion.feed[before, None] * (1 - share) + motion.feed[after, None] * share
    some, other = motion.joint_angles[before, None], motion.joint_angles[after, None]
    angles = some * (1 - share[..., None]) + other * share[..., None]
    turns = np.abs(np.cumsum(other - some, axis=2))[:, 0] / CUTS  # of each link, in one piece of the way
    push = np.abs(motion.feed[after] - motion.feed[before]) / CUTS
    shape = feed.shape
    joints = place(feed.ravel(), angles.reshape(-1, n_links), length, walls.base).reshape(*shape, n_links + 1)
    past = feed[..., None] - (n_links - np.arange(n_links + 1)) * length
    past = np.where(np.abs(past) < TIE * length, 0.0, past)  # a joint at the base by rounding is where it is
    _swept(found, walls, joints, past, turns, length, cores)
    _crossing(found, walls, joints, past, turns, push, length)
    if folded >= 0.0 or (found.faulty["crossing"] is False and folded > -1e-11):
        found.faulty["crossing"] = True if folded >= 0.0 else None


def _swept(found, walls, joints, past, turns, length, cores):
    n_links = turns.shape[1]
    start, end, row, link = in_maze(
        joints.reshape(-1, n_links + 1), past.reshape(-1, n_links + 1), length, walls.base
    )
    if not len(start):
        found.faulty["sweep"] = False
        return
    lines = as_lines(start, end)
    outside = leave_free(walls, start, end)
    low = 0.0
    if outside.any():
        share = np.linspace(0.0, 1.0, 17)
        points = (start[outside, None] + share * (end - start)[outside, None]).ravel()
        points = points[~walls.contains(points)]
        low = walls.radius + (float(walls.depth(points).max()) if len(points) else 0.0)
    elif walls.radius > 0.0:
        counts = past.reshape(-1, n_links + 1)[row, link] >= walls.radius + 0.06 * length
        if counts.any():
            low = max(0.0, walls.radius - float(shapely.distance(lines[counts], walls.solid).min()))
    found.between_low = low
    crossed = any(shapely.intersects(lines, core).any() for core in cores)
    found.faulty["sweep"] = True if crossed or low > (DEEP + TIE) * length else None
    found.swept_free = not outside.any() and low == 0.0 and _hulls_free(walls, joints, past, turns, length)
    if found.swept_free:
        found.faulty["sweep"] = False


def _hulls_free(walls, joints, past, turns, length):
    """Say whether the hulls of neighbouring cuts, grown by the sagitta and the radius, are free."""
    joints = np.where(past < 0.0, complex(walls.base[0], walls.base[1]), joints)
    if joints.shape[1] == 1:
        return True
    corners = [joints[:, cut:][:, :CUTS] if cut else joints[:, :-1] for cut in (0, 1)]
    quads = np.stack([part[..., k : part.shape[-1] - 1 + k] for part in corners for k in (0, 1)], axis=-1)
    out = np.maximum(past[:, 1:, 1:], past[:, :-1, 1:]) > 1e-9 * length
    # A turn by d goes at most L d^2 / 8 beside the chord of the link's tip, and tips add up along the arm.
    sagitta = length / 8.0 * np.cumsum(turns**2, axis=1)
    grown = np.broadcast_to(sagitta[:, None], out.shape)[out] + walls.radius + 1e-9 * length
    hulls = shapely.convex_hull(shapely.multipoints(np.stack([quads[out].real, quads[out].imag], axis=-1)))
    return bool(
        shapely.covers(walls.free, hulls).all() and (shapely.distance(hulls, walls.solid) > grown).all()
    )


def _crossing(found, walls, joints, past, turns, push, length):
    """Say whether links that are not neighbours meet: at a cut, or surely nowhere between the cuts."""
    base, n_links = complex(walls.base[0], walls.base[1]), turns.shape[1]
    placed, limit, near = np.where(past < 0.0, base, joints), 2.0 * walls.radius, math.inf
    # Half a piece of the way from the nearest cut, a joint is no farther than this from its place there.
    stray = (push[:, None] + length * np.cumsum(turns, axis=1)) / 2.0
    met = False
    for one, other in combinations(range(n_links), 2):
        if other < one + 2:
            continue
        out = past[..., one + 1] > 0.0
        maybe = past[..., one + 1] + push[:, None] * CUTS > 0.0
        if not maybe.any():
            continue
        ends = [placed[..., k] for k in (one, one + 1, other, other + 1)]
        apart = segment_distances(*ends)
        met |= (
            bool((apart[out] < limit - TIE * length).any()) if limit else bool(cross_over(*ends)[out].any())
        )
        room = apart - stray[:, None, one] - stray[:, None, other]
        near = min(near, float(room[maybe].min()))
    found.faulty["crossing"] = True if met else (False if near > limit + 2 * TIE * length else None)


def segment_distances(a, b, c, d):
    """Return the distances between segments a-b and c-d of complex arrays of one shape; 0 if they cross."""
    least = np.full(a.shape, np.inf)
    for point, start, end in ((a, c, d), (b, c, d), (c, a, b), (d, a, b)):
        along = end - start
        share = np.clip(dot(point - start, along) / np.maximum(np.abs(along) ** 2, 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.abs(point - start - share * along))
    return np.where(cross_over(a, b, c, d), 0.0, least)


def cross_over(a, b, c, d):
    """Say which segments surely cross: the ends of each well on both sides of the other."""

    def side(p, q, r):
        return ((q - p).conjugate() * (r - p)).imag / np.maximum(np.abs(q - p), 1e-300)

    eps = 1e-9 * np.maximum(np.abs(b - a), np.abs(d - c))
    one, other = (side(a, b, c), side(a, b, d)), (side(c, d, a), side(c, d, b))
    return np.logical_and.reduce(
        [np.minimum(*pair) < -eps for pair in (one, other)]
        + [np.maximum(*pair) > eps for pair in (one, other)]
    )
