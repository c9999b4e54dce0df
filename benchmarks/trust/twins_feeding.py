"""Slow twins of the kernels of feeding, of rays and of grids in the plane, and random inputs for both.

Each law draws an input, and fails with an AssertionError where kernel and twin disagree.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import shapely
from scipy.ndimage import map_coordinates
from scipy.optimize import brentq
from shapely.geometry import LineString, Point, Polygon

from planners.feeding import UNCHECKED
from planners.kernels import feeding, feeding_sweep, grid, rays

ROUNDING = 1e-9


def rotation(angle):
    """Return the matrix that turns row vectors by an angle."""
    return np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])


def track_at_random(rng, dimension=2, wild=0.12):
    """Return a track, its arclength, a link length and the base pose; segments are under a quarter link."""
    length = 10.0 ** rng.uniform(-1.0, 2.0)
    n = int(rng.integers(5, 70))
    sizes = length * rng.uniform(0.02, 0.24, n)
    turns = np.cumsum(rng.normal(0.0, wild, n) + rng.choice([-0.04, 0.0, 0.04]))
    steps = np.zeros((n, dimension))
    steps[:, 0], steps[:, 1] = sizes * np.cos(turns), sizes * np.sin(turns)
    if dimension == 3:
        tilts = np.cumsum(rng.normal(0.0, wild, n))
        steps[:, :2] *= np.cos(tilts)[:, None]
        steps[:, 2] = sizes * np.sin(tilts)
    straight = np.zeros((6, dimension))
    straight[:, 0] = length * np.linspace(0.0, 1.0, 6)
    track = np.concatenate([straight, straight[-1] + np.cumsum(steps, axis=0)])
    heading = rng.uniform(-math.pi, math.pi) if dimension == 2 else 0.0
    base = rng.uniform(-5.0, 5.0, dimension) * length
    if dimension == 2:
        track, base_pose = track @ rotation(heading) + base, np.array([*base, heading])
    else:
        track, base_pose = track + base, np.array([*base, 1.0, 0.0, 0.0])
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(track, axis=0), axis=1))])
    return track, arc, length, base_pose


def start_behind(track, arc, point, segment, length):
    """Return the last place before a segment's end that is a length away from a point: segment and way."""
    apart = np.linalg.norm(track[: segment + 1] - point, axis=1)
    far = np.flatnonzero(apart >= length)
    if not len(far):
        return -1, 0.0
    k = int(far[-1])
    along = (track[k + 1] - track[k]) / (arc[k + 1] - arc[k])
    ends = [np.linalg.norm(track[k] + t * along - point) - length for t in (0.0, arc[k + 1] - arc[k])]
    if ends[0] <= 0.0 or ends[1] >= 0.0:
        return k, 0.0 if ends[0] <= 0.0 else arc[k + 1] - arc[k]
    return k, brentq(
        lambda t: np.linalg.norm(track[k] + t * along - point) - length, 0.0, arc[k + 1] - arc[k], xtol=1e-300
    )


def arm_behind(track, arc, tip, length):
    """Return the joints of an arm on a track, tip first, each at the nearest place behind the one ahead.

    The last is the first on the straight part. Their places on the track come second.
    """
    k = min(int(np.searchsorted(arc, tip, side="right")) - 1, max(len(arc) - 2, 0))
    joints, places = [np.array([np.interp(tip, arc, column) for column in track.T])], [tip]
    while places[-1] > length * (1.0 + 1e-9):
        k, t = start_behind(track, arc, joints[-1], k, length)
        joints.append(track[k] + t / (arc[k + 1] - arc[k]) * (track[k + 1] - track[k]))
        places.append(arc[k] + t)
    return np.array(joints), np.array(places)


def start_of_link_agrees(rng):
    """Compare `start_of_link` and `directions` with a search over all vertices."""
    track, arc, length, _ = track_at_random(rng, int(rng.integers(2, 4)))
    along = feeding_sweep.directions(track, arc)
    steps = np.diff(track, axis=0)
    np.testing.assert_allclose(along, steps / np.linalg.norm(steps, axis=1)[:, None], atol=ROUNDING)
    end = int(rng.integers(1, len(track)))
    segment = int(rng.integers(0, end))
    apart = np.linalg.norm(track - track[end], axis=1)
    if np.abs(apart - length).min() < ROUNDING * length:
        return
    found, way = feeding_sweep.start_of_link(track, along, track, end, length**2, segment, end - 1)
    if apart[segment] < length:
        expected, t = start_behind(track, arc, track[end], segment, length)
    else:
        expected = segment + int(np.flatnonzero(apart[segment + 1 :] < length)[0])
        expected, t = start_behind(track, arc, track[end], expected, length)
    assert found == expected
    assert abs(way - t) <= ROUNDING * length


def feeder_axis_agrees(rng):
    """Compare `feeder_axis` with its definition."""
    x, y, z, angle = rng.uniform(-3.0, 3.0, 4)
    base, heading = feeding.feeder_axis(np.array([x, y, angle]))
    np.testing.assert_array_equal(base, [x, y])
    np.testing.assert_allclose(heading, [math.cos(angle), math.sin(angle)])
    base, heading = feeding.feeder_axis(np.array([x, y, z, 0.0, 0.6, 0.8]))
    np.testing.assert_array_equal(base, [x, y, z])
    np.testing.assert_array_equal(heading, [0.0, 0.6, 0.8])


def feed_along_agrees(rng):
    """Compare poses of `feed_along`, and `links_at_end`, with arms that are put on the track one by one."""
    track, arc, length, base_pose = track_at_random(
        rng, int(rng.integers(2, 4)), wild=rng.choice([0.03, 0.2])
    )
    if rng.random() < 0.2:  # all or a part of the straight stretch alone
        n = int(rng.integers(1, 7))
        track, arc = track[:n].copy(), arc[:n].copy()
    step = length * rng.uniform(0.01, 0.08)
    n_links = feeding.links_at_end(track, arc, length)
    room = math.ceil(arc[-1] / length) + 1 if n_links < 0 else n_links
    poses = np.empty((4000, room + 1, track.shape[1]))
    state, segments = np.zeros(5), np.zeros((2, room + 1), dtype=np.int64)
    places = np.zeros((2, room + 1))
    n, ending = feeding.feed_along(
        track, arc, length, base_pose, step, UNCHECKED, poses, len(poses), state, segments, places
    )
    assert ending in (feeding.DONE, feeding.JUMP)
    base, heading = feeding.feeder_axis(base_pose)
    poses = poses[:n]
    links = np.linalg.norm(np.diff(poses, axis=1), axis=2)
    np.testing.assert_allclose(links, length, rtol=ROUNDING)
    moved = np.linalg.norm(np.diff(poses, axis=0), axis=2)
    assert moved.max(initial=0.0) <= step * (1.0 + 1e-6)
    np.testing.assert_allclose(poses[0, -1], base, atol=ROUNDING * length)
    if ending == feeding.DONE:
        np.testing.assert_allclose(poses[-1, -1], track[-1], atol=ROUNDING * length)
        joints, places = arm_behind(track, arc, arc[-1], length)
        gentle = np.abs(places - length).min() > 1e-6 * length
        if gentle and np.linalg.norm(poses[-1, ::-1][: len(joints)] - joints, axis=1).max() < 1e-6 * length:
            assert len(joints) == n_links
    for pose in poses[:: max(1, n // 5)]:
        for joint in pose:  # on the track, or on the axis behind it
            behind = min((joint - base) @ heading, 0.0)
            on_axis = np.linalg.norm(joint - base - behind * heading)
            assert min(on_axis, from_polyline(joint, track)) <= 1e-8 * length


def from_polyline(point, line):
    """Return the distance of a point from a polyline, in any dimension."""
    steps = np.diff(line, axis=0)
    if not len(steps):
        return float(np.linalg.norm(line[0] - point))
    share = ((point - line[:-1]) * steps).sum(axis=1) / (steps**2).sum(axis=1)
    feet = line[:-1] + np.clip(share, 0.0, 1.0)[:, None] * steps
    return float(np.linalg.norm(feet - point, axis=1).min())


def sweep_chords_agrees(rng):
    """Compare `sweep_chords` with many chords that end on each segment, and shapely."""
    track, arc, length, _ = track_at_random(rng, 2, wild=rng.choice([0.03, 0.12]))
    track, arc = track[: int(rng.integers(1, len(track) + 1))], arc
    arc = arc[: len(track)]
    middles = track[rng.integers(0, len(track), 6)] + rng.normal(0.0, 0.5 * length, (6, 2))
    walls = middles[:, None] + rng.normal(0.0, 0.3 * length, (6, 2, 2))
    free, found = feeding_sweep.sweep_chords(track, arc, length, walls)
    found = feeding_sweep.Sweep(*found)
    lines = [LineString(wall) for wall in walls]
    n = len(arc) - 1
    k_last = 0
    meets = any(LineString(track[arc <= length]).intersects(line) for line in lines) if n else False
    for j in range(n):
        if arc[j + 1] <= length * (1.0 + 1e-9):
            continue
        along = feeding_sweep.directions(track, arc)
        seen, _ = feeding_sweep.start_of_link(track, along, track, j + 1, length**2, k_last, j)
        if seen < 0:
            return  # a joint slips off the track: no more is known
        k_last = seen
        for share in np.linspace(0.02, 1.0, 9):
            end = track[j] + share * (track[j + 1] - track[j])
            if share * (arc[j + 1] - arc[j]) + arc[j] <= length:
                continue
            k, t = start_behind(track, arc, end, j, length)
            place = arc[k] + t if k >= 0 else -1.0
            slack = 1e-8 * arc[-1]
            if not found.low[j] - slack <= place <= found.high[j] + slack:
                continue  # looked at by the exact check of the pose
            chord = LineString([track[k] + t / (arc[k + 1] - arc[k]) * (track[k + 1] - track[k]), end])
            met = {w for w, line in enumerate(lines) if chord.intersects(line)}
            if share == 1.0 and met:
                meets = True
            if free:
                assert met <= set(found.members[found.first[j] : found.first[j + 1]].tolist())
    assert meets is False or not free


def configurations_agree(rng):
    """Compare `configurations` with angles that NumPy unwraps."""
    n_poses, n_links = int(rng.integers(0, 12)), int(rng.integers(1, 6))
    length, base = 10.0 ** rng.uniform(-2.0, 2.0), rng.uniform(-3.0, 3.0, 3)
    feed = length * np.sort(rng.uniform(0.0, n_links, n_poses))
    angles = np.cumsum(rng.normal(0.0, 1.0, (n_poses, n_links)), axis=0)
    inside = np.arange(n_links) < np.floor(n_links - feed / length)[:, None]
    angles[inside] = 0.0  # and so unwrapped from there on
    headings = base[2] + np.cumsum(angles, axis=1)
    steps = length * np.stack([np.cos(headings), np.sin(headings)], axis=2)
    axis = np.array([math.cos(base[2]), math.sin(base[2])])
    rear = base[:2] + (feed - n_links * length)[:, None] * axis
    poses = np.concatenate([rear[:, None], rear[:, None] + np.cumsum(steps, axis=1)], axis=1)
    found_feed, found = np.empty(n_poses), np.empty((n_poses, n_links))
    feeding.configurations(poses, length, base, found_feed, found)
    np.testing.assert_allclose(found_feed, feed, atol=1e-9 * length * n_links)
    wrapped = (angles + np.pi) % (2.0 * np.pi) - np.pi
    expected = np.unwrap(wrapped, axis=0) if n_poses else wrapped
    sure = np.ones(found.shape, dtype=bool)  # exactly a half turn may go either way
    if n_poses > 1:
        jumps = np.abs(np.abs(np.diff(expected, axis=0)) - np.pi) < 1e-6
        sure[1:] = ~np.logical_or.accumulate(jumps, axis=0)
    np.testing.assert_allclose(found[sure], expected[sure], atol=1e-9)
    assert (found[inside] == 0.0).all() or not n_poses


def poses_at_random(rng):
    """Return poses, a base pose and walls; half of them on a lattice, where much is met exactly."""
    lattice = rng.random() < 0.5
    n_poses, n_joints, n_walls = int(rng.integers(0, 6)), int(rng.integers(1, 8)), int(rng.integers(0, 5))
    if lattice:
        steps = rng.integers(-2, 3, (n_poses, n_joints, 2)).astype(float)
        steps[(steps == 0.0).all(axis=2), 0] = 1.0
        walls = rng.integers(-4, 5, (n_walls, 2, 2)).astype(float)
    else:
        turns = np.cumsum(rng.uniform(-1.3, 1.3, (n_poses, n_joints)), axis=1)
        steps = np.stack([np.cos(turns), np.sin(turns)], axis=2)
        walls = rng.uniform(-4.0, 4.0, (n_walls, 2, 2))
    poses = np.cumsum(steps, axis=1)
    for pose in poses:  # the first joints in the feeder, behind the base at the origin
        n_behind = int(rng.integers(0, n_joints + 1))
        pose[:] -= pose[max(n_behind - 1, 0)]
        pose[:n_behind] = np.column_stack([np.arange(n_behind) - n_behind + 0.5, np.zeros(n_behind)])
    if lattice:
        poses, walls = 2.0 * poses, 2.0 * walls
    return poses, np.zeros(3), walls


def links_in_front(pose):
    """Return the links that are not wholly in the feeder, by number, cut off at the base at the origin."""
    links = {}
    for k in range(len(pose) - 2, -1, -1):
        a, b = pose[k], pose[k + 1]
        if a[0] < 0.0 and a[1] == 0.0 and b[1] == 0.0:
            links[k] = LineString([(0.0, 0.0), b])
            break
        links[k] = LineString([a, b])
    return links


def first_hit_agrees(rng):
    """Compare `first_hit` with shapely."""
    poses, base_pose, walls = poses_at_random(rng)
    expected = (-1, -1, -1)
    for p, pose in enumerate(poses):
        hits = [
            (p, k, w)
            for k, link in links_in_front(pose).items()
            for w, wall in enumerate(walls)
            if link.intersects(LineString(wall))
        ]
        if hits:
            expected = hits[0]
            break
    assert feeding.first_hit(poses, base_pose, walls) == expected


def first_self_crossing_agrees(rng):
    """Compare `first_self_crossing` with shapely."""
    poses, base_pose, _ = poses_at_random(rng)
    expected = (-1, -1, -1)
    for p, pose in enumerate(poses):
        links = links_in_front(pose)
        crossed = [
            (p, i, k) for i in links for k in sorted(links) if k >= i + 2 and links[i].crosses(links[k])
        ]
        if crossed:
            expected = crossed[0]
            break
    assert feeding.first_self_crossing(poses, base_pose) == expected


def star_at_random(rng):
    """Return the corners of a polygon all of which are seen from a point, and the point."""
    n = int(rng.integers(4, 12))
    angles = (np.arange(n) + rng.uniform(-0.3, 0.3, n)) * 2.0 * np.pi / n
    corners = rng.uniform(1.0, 3.0, n)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    middle = rng.uniform(-100.0, 100.0, 2)
    return corners + middle, middle


def cast_rays_agrees(rng):
    """Compare `cast_rays` with shapely, and with the way to each corner that it is aimed at."""
    corners, middle = star_at_random(rng)
    walls = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    to_corners = corners - middle
    sizes = np.linalg.norm(to_corners, axis=1)
    angle = rng.uniform(-np.pi, np.pi, 4)
    ways = np.concatenate([to_corners / sizes[:, None], np.column_stack([np.cos(angle), np.sin(angle)])])
    found = np.empty(len(ways))
    rays.cast_rays(np.repeat(middle[None], len(ways), axis=0), ways, walls, found)
    ring = Polygon(corners).boundary
    for way, size in zip(ways[len(corners) :], found[len(corners) :], strict=True):
        expected = Point(middle).distance(ring.intersection(LineString([middle, middle + 10.0 * way])))
        assert abs(size - expected) <= 1e-9 * 100.0
    np.testing.assert_allclose(found[: len(corners)], sizes, rtol=1e-9)


def rooms_at_random(rng):
    """Return a free space with holes whose corners are on nodes and halfway between them."""

    def corner(low, high):
        return 0.5 * rng.integers(2 * low, 2 * high, 2)

    free = shapely.box(0.5 * rng.integers(-1, 2), 0.0, 12.0, 0.5 * rng.integers(18, 22))
    for _ in range(rng.integers(0, 4)):
        hole = shapely.MultiPoint([corner(1, 9) for _ in range(4)]).convex_hull
        if hole.geom_type == "Polygon":
            free = free.difference(hole)
    parts = [part for part in shapely.get_parts(free) if part.geom_type == "Polygon"]
    return shapely.geometry.polygon.orient(max(parts, key=lambda part: part.area))


def walls_of(free):
    """Return the walls of a polygon, shape (n, 2, 2)."""
    rings = [np.array(ring.coords) for ring in (free.exterior, *free.interiors)]
    return np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in rings])


def scan_walls_agrees(rng):
    """Compare `scan_walls` with shapely where corners and walls are on nodes."""
    free = rooms_at_random(rng)
    nx, ny = 18, 17
    inside, blocked_x, blocked_y = grid.scan_walls(walls_of(free), -3.0, -3.0, 1.0, nx, ny)
    x, y = np.meshgrid(np.arange(nx) - 3.0, np.arange(ny) - 3.0)
    apart = shapely.distance(free.boundary, shapely.points(x, y))
    np.testing.assert_array_equal(inside, shapely.contains_xy(free, x, y) & (apart > grid.ON_WALL))
    for blocked, dj, di in ((blocked_x, 0, 1), (blocked_y, 1, 0)):
        for j, i in np.argwhere(inside[: ny - dj, : nx - di] & inside[dj:, di:]):
            edge = LineString([(i - 3.0, j - 3.0), (i + di - 3.0, j + dj - 3.0)])
            if blocked[j, i]:
                assert edge.intersects(free.boundary)
            else:
                assert free.covers(edge)


def ascend_agrees(rng):
    """Compare each step of `ascend` with slopes that SciPy interpolates."""
    free = rooms_at_random(rng)
    nx, ny = 18, 17
    inside, blocked_x, blocked_y = grid.scan_walls(walls_of(free), -3.0, -3.0, 1.0, nx, ny)
    nodes = np.argwhere(inside)
    goal, start = (nodes[k][::-1].astype(float) for k in rng.integers(0, len(nodes), 2))
    start = start + rng.uniform(-0.4, 0.4, 2)
    j, i = np.mgrid[:ny, :nx]
    u = np.where(inside, np.exp(-0.3 * np.hypot(i - goal[0], j - goal[1])), 0.0)
    step, stop, points = rng.uniform(0.1, 0.4), 1.5, np.empty((int(rng.integers(0, 300)), 2))
    n = grid.ascend(u, blocked_x, blocked_y, start, goal, step, stop, points)
    east, west, north, south = (np.zeros_like(u) for _ in range(4))
    east[:, :-1] = np.where(blocked_x[:, :-1], 0.0, u[:, 1:])
    west[:, 1:] = np.where(blocked_x[:, :-1], 0.0, u[:, :-1])
    north[:-1] = np.where(blocked_y[:-1], 0.0, u[1:])
    south[1:] = np.where(blocked_y[:-1], 0.0, u[:-1])
    largest = np.maximum.reduce([u, east, west, north, south])
    largest[largest == 0.0] = 1.0
    slopes = [(east - west) / largest, (north - south) / largest]
    for here, there in pairwise(points[: max(n - 1, 0)]):
        slope = np.array([map_coordinates(s, here[::-1, None], order=1)[0] for s in slopes])
        np.testing.assert_allclose(there, here + step * slope / np.hypot(*slope), atol=1e-6)
    if n:
        np.testing.assert_array_equal(points[n - 1], goal)
        assert np.hypot(*(points[n - 2] - goal)) <= stop
        assert (np.hypot(*(points[: n - 2] - goal).T) > stop).all()


LAWS = {
    "directions, start_of_link": start_of_link_agrees,
    "feeder_axis": feeder_axis_agrees,
    "feed_along, links_at_end": feed_along_agrees,
    "sweep_chords": sweep_chords_agrees,
    "configurations": configurations_agree,
    "first_hit": first_hit_agrees,
    "first_self_crossing": first_self_crossing_agrees,
    "cast_rays": cast_rays_agrees,
    "scan_walls": scan_walls_agrees,
    "ascend": ascend_agrees,
}
"""By the kernels that they compare."""
