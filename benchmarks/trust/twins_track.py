"""Slow twins of the kernels of the track planner and of the sweep, and random inputs for both.

Each law draws an input, and fails with an AssertionError where kernel and twin disagree.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.corners import critical_corners
from planners.kernels import sweep, track, track_solve, track_walls
from planners.kernels.track_types import ROW_WIDTH, Chords, Rows, Surroundings
from planners.kernels.track_walls import LONGEST_MOVE, REACH
from planners.survey import survey
from planners.sweep_planner import FINENESSES, MIN_CURVATURE, VARIANTS
from planners.sweep_track import aim_line, grow
from planners.track_start import with_axis

ROUNDING = 1e-9


def points_at_random(rng, wild=0.06):
    """Return the samples of a track, in link lengths, and how many are in a link length."""
    per_link = int(rng.integers(8, 16))
    turns = np.cumsum(rng.normal(0.0, wild, int(rng.integers(8, 60))))
    line = np.cumsum(np.column_stack([np.cos(turns), np.sin(turns)]) / 12.0, axis=0) + np.array([1.0, 0.0])
    return with_axis(np.concatenate([[(1.0, 0.0)], line]), per_link), per_link


def walls_near(rng, points, n, size=0.4):
    """Return short walls beside some points, shape (n, 2, 2)."""
    middles = points[rng.integers(0, len(points), n)] + rng.normal(0.0, 0.3, (n, 2))
    return middles[:, None] + rng.normal(0.0, size, (n, 2, 2))


def surroundings(rng, points, n, size=0.4):
    """Return walls near points, listed as the planner lists them."""
    walls = walls_near(rng, points, n, size)
    corners = walls.reshape(-1, 2)
    angle = rng.uniform(-math.pi, math.pi, len(corners))
    origin = np.minimum(corners.min(axis=0, initial=0.0), points.min(axis=0)) - 1.0
    extent = np.maximum(corners.max(axis=0, initial=0.0), points.max(axis=0)) + 1.0 - origin
    cell = rng.uniform(0.2, 0.5)
    nx, ny = (int(value / cell) + 1 for value in extent)
    first, members = np.zeros(nx * ny + 1, dtype=np.int64), np.empty(0, dtype=np.int64)
    members = np.empty(track_walls.list_walls(walls, origin, cell, nx, ny, first, members), dtype=np.int64)
    track_walls.list_walls(walls, origin, cell, nx, ny, first, members)
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    return Surroundings(walls, corners, outward, origin, cell, nx, ny, first, members)


def room_for_chords(n):
    """Return arrays for the chords of n samples."""
    most = track.MOST_PARTS * n
    ends, starts = (np.full(most, -9, dtype=np.int64) for _ in range(2))
    shares = np.full((2, most), np.nan)
    empty = np.full((most, 2), -np.inf)
    return Chords(
        ends, shares[0], starts, shares[1], empty, np.zeros((most, 2)), np.full(n, -9, dtype=np.int64)
    )


def room_for_rows(most):
    """Return arrays for rows."""
    samples, factor = np.full((most, ROW_WIDTH), -1, dtype=np.int64), np.zeros((most, ROW_WIDTH, 2))
    return Rows(samples, factor, np.zeros((most, ROW_WIDTH)), np.full(most, np.nan), np.full(most, np.nan))


def segment(ends):
    """Return a segment for shapely, which does not know those of no length."""
    return Point(ends[0]) if (ends[0] == ends[1]).all() else LineString(ends)


def place_on(points, segment, share):
    """Return the place at a share of a segment."""
    return points[segment] + share * (points[segment + 1] - points[segment])


# Walls


def segments_meet_agrees(rng):
    """Compare `segments_meet` and `wall_between` with shapely, half of the time on a lattice."""
    lattice = rng.random() < 0.5
    ends = rng.integers(-2, 3, (6, 2, 2)).astype(float) if lattice else rng.uniform(-1.0, 1.0, (6, 2, 2))
    line, walls = segment(ends[0]), ends[1:]
    met = [line.intersects(segment(wall)) for wall in walls]
    for wall, expected in zip(walls, met, strict=True):
        assert track_walls.segments_meet(*ends[0].ravel(), *wall.ravel()) == expected
    found = track_walls.wall_between(*ends[0].ravel(), walls)
    assert found == (met.index(True) if any(met) else -1)
    assert track_walls.wall_between(*ends[0].ravel(), walls[:0]) == -1


def list_walls_agrees(rng):
    """Compare the lists of `list_walls` with the boxes of all walls and cells."""
    points, _ = points_at_random(rng)
    near = surroundings(rng, points, int(rng.integers(0, 9)))
    low, high = near.walls.min(axis=1) - REACH, near.walls.max(axis=1) + REACH
    for cell in range(near.nx * near.ny):
        corner = near.origin + near.cell * np.array([cell % near.nx, cell // near.nx])
        listed = np.flatnonzero(((low <= corner + near.cell) & (high >= corner)).all(axis=1))
        np.testing.assert_array_equal(np.sort(near.members[near.first[cell] : near.first[cell + 1]]), listed)


def edges_are_free_agrees(rng):
    """Compare `edges_are_free` with shapely; edges may be longer than the reach."""
    points, _ = points_at_random(rng)
    points = points[:: int(rng.integers(1, 9))]
    near = surroundings(rng, points, int(rng.integers(0, 3)), size=0.1)
    first = int(rng.integers(0, len(points)))
    line = LineString(points[first:]) if first + 1 < len(points) else Point(points[-1]).buffer(0)
    expected = not any(line.intersects(LineString(wall)) for wall in near.walls)
    assert track_walls.edges_are_free(points, first, near) == (expected or first + 1 >= len(points))


def longest_edge_agrees(rng):
    """Compare `longest_edge` with NumPy."""
    points = rng.uniform(-1.0, 1.0, (int(rng.integers(1, 9)), 2))
    first = int(rng.integers(0, len(points)))
    longest = np.linalg.norm(np.diff(points[first:], axis=0), axis=1).max(initial=0.0)
    found = track_walls.longest_edge(points, first)
    assert longest <= found <= 1.002 * longest + 1e-4


def add_row_agrees(rng):
    """Check that `add_row` closes a row and no other."""
    rows, wanted = room_for_rows(3), rng.uniform(-1.0, 1.0)
    assert track_walls.add_row(1, wanted, 0.7, rows) == 2
    np.testing.assert_array_equal(rows.wanted, [np.nan, min(wanted, LONGEST_MOVE), np.nan])
    np.testing.assert_array_equal(rows.weight, [np.nan, 0.7, np.nan])


def sample_rows_agree(rng):
    """Compare `sample_rows` with the nearest wall of all, and the nearest on its other side."""
    points, per_link = points_at_random(rng)
    near, rows, margin = (
        surroundings(rng, points, int(rng.integers(0, 9))),
        room_for_rows(2 * len(points)),
        0.05,
    )
    n, at = track_walls.sample_rows(points, per_link + 1, near, margin, 0, rows), 0
    for i in range(per_link + 1, len(points)):
        away = [
            points[i] - np.array(shapely.shortest_line(LineString(w), Point(points[i])).coords[0])
            for w in near.walls
        ]
        before = np.zeros(2)
        for _ in range(2):
            there = [v for v in away if np.hypot(*v) < REACH and v @ before <= 0.0]
            if not there:
                break
            nearest = min(there, key=lambda v: np.hypot(*v))
            before = nearest / np.hypot(*nearest)
            np.testing.assert_array_equal(rows.samples[at], [i] + [-1] * (ROW_WIDTH - 1))
            np.testing.assert_allclose(rows.factor[at, 0], before, atol=1e-6)
            wanted = min(margin - np.hypot(*nearest), LONGEST_MOVE)
            np.testing.assert_allclose(rows.wanted[at], wanted, atol=ROUNDING)
            at += 1
    assert at == n


def edge_rows_agree(rng):
    """Compare `edge_rows` with every corner against every edge."""
    points, per_link = points_at_random(rng)
    near, margin = surroundings(rng, points, int(rng.integers(0, 9))), 0.05
    rows, fixed = room_for_rows(20 * len(points)), per_link + 1
    n, expected = track_walls.edge_rows(points, fixed, near, margin, 0, rows), []
    for corner, outward in zip(near.corners, near.outward, strict=True):
        for i in range(fixed - 1, len(points) - 1):
            edge = points[i + 1] - points[i]
            size = np.hypot(*edge)
            t = (corner - points[i]) @ edge / size**2
            if np.abs(corner - points[i]).max() > REACH or not 0.0 < t < 1.0:
                continue
            normal = np.array([-edge[1], edge[0]]) / size
            normal *= 1.0 if normal @ outward >= 0.0 else -1.0
            away = normal @ (points[i] - corner)
            if away >= -track_walls.SLIP * size:
                wanted = min(margin - away, LONGEST_MOVE)
                expected.append([i, i + 1, *((1.0 - t) * normal), *(t * normal), wanted])
    found = np.column_stack([rows.samples[:n, :2], rows.factor[:n, 0], rows.factor[:n, 1], rows.wanted[:n]])
    np.testing.assert_allclose(found, np.array(expected).reshape(-1, 7), atol=ROUNDING)
    few = room_for_rows(max(n - 1, 0))
    assert track_walls.edge_rows(points, fixed, near, margin, 0, few) == max(n - 1, 0)


def apply_move_agrees(rng):
    """Check with shapely that `apply_move` goes as far as it may and keeps a free track free."""
    points, per_link = points_at_random(rng)
    walls = surroundings(rng, points, int(rng.integers(0, 12)), size=0.08)
    fixed, normals, new = per_link + 1, np.empty_like(points), np.full_like(points, np.nan)
    track_solve.find_normals(points, normals)
    move = rng.normal(0.0, 0.08, len(points) - fixed)
    if rng.random() < 0.2:
        move[rng.integers(0, len(move))] = rng.choice([np.nan, np.inf])
    track_walls.apply_move(points, normals, fixed, move, walls, new)
    np.testing.assert_array_equal(new[:fixed], points[:fixed])
    asked = np.nan_to_num(np.clip(move, -LONGEST_MOVE, LONGEST_MOVE), nan=0.0)
    shift = ((new - points)[fixed:] * normals[fixed:]).sum(axis=1)
    np.testing.assert_allclose(new[fixed:], points[fixed:] + shift[:, None] * normals[fixed:], atol=ROUNDING)
    assert (np.abs(shift) <= np.abs(asked) + ROUNDING).all()
    lines = [LineString(wall) for wall in walls.walls]
    old_edges = [LineString(points[i : i + 2]) for i in range(fixed - 1, len(points) - 1)]
    if any(edge.intersects(line) for edge in old_edges for line in lines):
        return
    wholly = np.concatenate([points[:fixed], points[fixed:] + asked[:, None] * normals[fixed:]])
    ways = [LineString([points[i], wholly[i]]) for i in range(fixed, len(points))]
    wanted = [*ways, LineString(wholly[fixed - 1 :])]
    assert not LineString(new[fixed - 1 :]).intersects(shapely.union_all(lines))
    if not any(way.intersects(line) for way in wanted for line in lines):
        np.testing.assert_allclose(shift, asked, atol=ROUNDING)


# Chords and rows


def chords_at_random(rng):
    """Return a gentle track with the chords that `find_chords` finds on it."""
    points, per_link = points_at_random(rng)
    chord, chords = rng.uniform(0.4, 1.0), room_for_chords(len(points))
    n_chords, done = track.find_chords(points, per_link, chord, chords)
    return points, per_link, chord, chords, n_chords, done


def find_chords_agrees(rng):
    """Compare `find_chords` with the circle round each chord's end, cut with the track by shapely."""
    points, per_link, chord, chords, n_chords, done = chords_at_random(rng)
    line = LineString(points)
    for c in range(n_chords):
        end = place_on(points, chords.end[c], chords.end_share[c])
        start = place_on(points, chords.segment[c], chords.share[c])
        assert 0.0 <= chords.share[c] <= 1.0 and chords.segment[c] <= chords.end[c]
        np.testing.assert_allclose(np.hypot(*(end - start)), chord, rtol=ROUNDING)
    if done < len(points):
        return
    ends = chords.end[:n_chords] + chords.end_share[:n_chords]
    assert (np.diff(ends) > 0.0).all()
    assert set(range(per_link + 1, len(points))) <= {int(v) for v in ends if v == int(v)}
    for j in range(per_link + 1, len(points)):
        c = chords.of_sample[j]
        assert ends[c] == j
        crossings = _crossings(points[: j + 1], points[j], chord)
        if len(crossings) == 1:  # otherwise it depends on the earlier chords
            found = chords.segment[c] + chords.share[c]
            np.testing.assert_allclose(found, crossings[0], atol=1e-6)
    assert line.length > chord


def _crossings(points, centre, radius):
    """Return the places of a polyline, in segments, at a distance from a centre."""
    found = []
    for k in range(len(points) - 1):
        step, way = points[k + 1] - points[k], points[k] - centre
        roots = np.roots([step @ step, 2.0 * way @ step, way @ way - radius**2])
        roots = roots[np.isreal(roots)].real
        found += [k + t for t in roots if 0.0 <= t < 1.0]
    return found


def find_corners_agrees(rng):
    """Check the depths of `find_corners` against the corners that shapely finds in each chord's loop."""
    points, per_link, chord, chords, n_chords, done = chords_at_random(rng)
    if done < len(points):
        return
    near = surroundings(rng, points, int(rng.integers(0, 12)), size=0.1)
    passed = np.empty(len(points), dtype=np.int64)
    track.find_corners(points, per_link, chord, n_chords, near, passed, chords)
    for c in range(0, n_chords, 3):
        a = place_on(points, chords.segment[c], chords.share[c])
        b = place_on(points, chords.end[c], chords.end_share[c])
        loop = np.array([a, *points[chords.segment[c] + 1 : chords.end[c] + 1], b])
        u = (b - a) / chord
        deepest = [-np.inf, -np.inf]
        for corner in near.corners:
            along, across = u @ (corner - a) / chord, u[0] * (corner - a)[1] - u[1] * (corner - a)[0]
            turns = _winding(loop, corner)
            if abs(across) > 2.0 or not -0.5 <= along <= 1.5:
                continue
            if turns == 0 and 0.0 < along < 1.0 and abs(across) <= REACH:
                side = 0 if across > 0.0 else 1
            elif turns != 0:
                side = 0 if turns > 0 else 1
            else:
                continue
            deep = -across if side == 0 else across
            if turns == 0 or deep >= 0.0:
                deepest[side] = max(deepest[side], deep)
        np.testing.assert_allclose(chords.depth[c], deepest, atol=ROUNDING)


def _winding(loop, place):
    """Return how often a closed loop goes round a place, by its angles."""
    ways = loop - place
    angles = np.arctan2(ways[:, 1], ways[:, 0])
    turns = (np.diff(np.append(angles, angles[0])) + np.pi) % (2.0 * np.pi) - np.pi
    return round(turns.sum() / (2.0 * np.pi))


def chord_rows_agree(rng):
    """Compare the rows of `chord_rows` with differences, on a track that is moved a little."""
    points, per_link, chord, chords, n_chords, done = chords_at_random(rng)
    if done < len(points):
        return
    near = surroundings(rng, points, int(rng.integers(1, 12)), size=0.1)
    track.find_corners(points, per_link, chord, n_chords, near, np.empty(len(points), dtype=np.int64), chords)
    rows, worst, limit = (
        room_for_rows(4 * n_chords + 4),
        np.full((4, 2), np.nan),
        rng.choice([0.1, 0.4, np.inf]),
    )
    margin, least = 0.02, rng.uniform(0.6, 1.0)
    n = track.chord_rows(points, per_link, chord, n_chords, chords, margin, least, limit, rows, worst)
    weights = rows.weight[:n]
    assert set(weights) <= {1.0, track.SLOPE_WEIGHT, track.ANGLE_WEIGHT}
    deep = chords.depth[:n_chords]
    np.testing.assert_array_equal(worst[track.CORNER, 0], deep.max())
    np.testing.assert_array_equal(
        np.sort(rows.wanted[:n][weights == 1.0]),
        np.sort(np.minimum(deep[deep > -np.inf] + margin, LONGEST_MOVE)),
    )
    assert (weights == track.ANGLE_WEIGHT).any() <= (limit < np.pi)
    for r in range(n):
        _row_is_a_slope(rng, r, points, chord, chords, n_chords, rows, least, limit)


def _row_is_a_slope(rng, r, points, chord, chords, n_chords, rows, least, limit):
    """Compare one row with differences; which chord it is of is read from its first entries."""
    samples = rows.samples[r]
    j = samples[0]
    e = _share(rows.factor[r, 0], rows.factor[r, 1])
    if e is None:
        return
    matches = [
        c
        for c in range(n_chords)
        if chords.end[c] == j and abs(chords.end_share[c] - e) < 1e-6 and chords.segment[c] == samples[2]
    ]
    if len(matches) != 1:
        return
    c, step = matches[0], 1e-6
    movement = np.zeros_like(points)
    used = samples[samples >= 0]
    movement[used] = rng.normal(0.0, 1.0, (len(used), 2))
    expected = sum(rows.factor[r, q] @ movement[i] for q, i in enumerate(samples) if i >= 0)
    values = []
    for sign in (-1.0, 1.0):
        moved = points + sign * step * movement
        a = place_on(moved, chords.segment[c], chords.share[c])
        b = place_on(moved, j, chords.end_share[c])
        u = (b - a) / np.hypot(*(b - a))
        if rows.weight[r] == track.SLOPE_WEIGHT:
            way = moved[samples[5]] - moved[samples[4]]
            values.append(u @ way / np.hypot(*way))
        elif rows.weight[r] == track.ANGLE_WEIGHT:
            # On the axis the link behind starts at a place that stays.
            rear = a - place_on(points, chords.segment[c], chords.share[c]) + (chord, 0.0)
            if samples[4] >= 0:
                g = _share(rows.factor[r, 4], rows.factor[r, 5])
                rear = a - place_on(moved, samples[4], g)
            if (rear[0] * u[1] - rear[1] * u[0]) ** 2 < 1e-8 or abs(np.hypot(*rear) - chord) > 0.02 * chord:
                return  # at a kink; or the starts between are no chord away, as they are taken to be
            values.append(-abs(math.atan2(rear[0] * u[1] - rear[1] * u[0], rear @ u)))
        else:
            return
    slope = (values[1] - values[0]) / (2.0 * step)
    # The link behind is taken to be a chord long, which its starts in between are nearly.
    np.testing.assert_allclose(expected, slope, rtol=2e-2, atol=2e-2)


def _share(first, second):
    """Return f of two factors (1 - f) v and f v; None where v is nothing."""
    total = first + second
    return None if np.hypot(*total) < 1e-6 else float(second @ total / (total @ total))


def goal_row_agrees(rng):
    """Compare `goal_row` with how the distance from the goal changes."""
    points, goal, radius = rng.uniform(-1.0, 1.0, (5, 2)), rng.uniform(-1.0, 1.0, 2), 0.1
    rows, way = room_for_rows(2), rng.normal(0.0, 1.0, 2)
    assert track.goal_row(4, points, goal, radius, 1, rows) == 2
    apart = np.hypot(*(goal - points[4]))
    nearer = (apart - np.hypot(*(goal - points[4] - 1e-7 * way))) / 1e-7
    np.testing.assert_allclose(rows.factor[1, 0] @ way, nearer, atol=1e-4)
    np.testing.assert_array_equal(rows.samples[1], [4] + [-1] * (ROW_WIDTH - 1))
    assert (
        abs(rows.wanted[1] - min(apart - radius, LONGEST_MOVE)) < ROUNDING
        and rows.weight[1] == track.GOAL_WEIGHT
    )
    assert track.goal_row(4, points, points[4].copy(), radius, 1, rows) == 1


def resample_agrees(rng):
    """Compare `resample` with `numpy.interp`, some points twice."""
    points = rng.uniform(-1.0, 1.0, (int(rng.integers(2, 12)), 2))
    points = np.repeat(points, rng.integers(1, 3, len(points)), axis=0)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    new = np.empty((int(rng.integers(2, 30)), 2))
    track.resample(points, new)
    places = np.linspace(0.0, arc[-1], len(new))
    expected = np.column_stack([np.interp(places, arc, column) for column in points.T])
    np.testing.assert_allclose(new, expected, atol=ROUNDING)


# The least-squares movement


def find_normals_agrees(rng):
    """Compare `find_normals` with NumPy."""
    points = np.cumsum(rng.uniform(0.1, 1.0, (int(rng.integers(2, 20)), 2)), axis=0)
    normals = np.empty_like(points)
    track_solve.find_normals(points, normals)
    padded = np.concatenate([points[:1], points, points[-1:]])
    along = padded[2:] - padded[:-2]
    along /= np.linalg.norm(along, axis=1)[:, None]
    np.testing.assert_allclose(normals, np.column_stack([-along[:, 1], along[:, 0]]), atol=ROUNDING)


def rows_at_random(rng, n, n_rows):
    """Return rows that tie neighbouring samples together."""
    rows = room_for_rows(n_rows)
    for r in range(n_rows):
        begin = int(rng.integers(0, max(1, n - 6)))
        count = int(rng.integers(1, ROW_WIDTH + 1))
        rows.samples[r, rng.permutation(ROW_WIDTH)[:count]] = rng.integers(begin, min(n, begin + 6), count)
    rows.factor[:] = rng.normal(0.0, 1.0, rows.factor.shape)
    rows.wanted[:], rows.weight[:] = rng.normal(0.0, 0.1, n_rows), rng.uniform(0.1, 2.0, n_rows)
    return rows


def solve_rows_agrees(rng):
    """Compare `project_rows` and `solve_rows` with dense least squares in NumPy."""
    points, per_link = points_at_random(rng)
    fixed, n_rows = per_link + 1, int(rng.integers(0, 25))
    rows, n = rows_at_random(rng, len(points), n_rows), len(points) - fixed
    samples, normals = rows.samples.copy(), np.empty_like(points)
    track_solve.find_normals(points, normals)
    spread = track_solve.project_rows(n_rows, fixed, normals, rows)
    dense = np.zeros((n_rows, n))
    for r in range(n_rows):
        moving = samples[r][samples[r] >= fixed]
        assert spread >= np.ptp(moving) if len(moving) else spread >= 2
        for q in np.flatnonzero(samples[r] >= fixed):
            dense[r, samples[r, q] - fixed] += rows.factor[r, q] @ normals[samples[r, q]]
    smooth, stiff, tether = rng.uniform(0.01, 1.0, 3)
    move = np.empty(n)
    track_solve.solve_rows(
        points, normals, fixed, n_rows, rows, smooth, stiff, tether,
        np.empty((n, spread + 1)), np.empty(n, dtype=np.int64), move, np.empty(n),
    )  # fmt: skip
    spacing = 1.0 / per_link
    bend = np.zeros((n, len(points)))  # second differences about the samples fixed - 1 to the last but one
    for row, i in enumerate(range(fixed - 1, len(points) - 1)):
        bend[row, i - 1 : i + 2] = 1.0, -2.0, 1.0
    free = bend[:, fixed:]
    across = [free * normals[fixed:, c] for c in range(2)]
    matrix = tether * spacing * np.eye(n) + stiff / spacing**3 * free.T @ free
    matrix += smooth / spacing**3 * sum(a.T @ a for a in across)
    right = -smooth / spacing**3 * sum(a.T @ (bend @ points[:, c]) for c, a in enumerate(across))
    expected, counts = np.zeros(n), None
    for _ in range(track_solve.PASSES):
        now = rows.wanted[:n_rows] - dense @ expected > 0.0
        if counts is not None and (now == counts).all():
            break
        counts = now
        heavy = spacing * rows.weight[:n_rows] * counts
        expected = np.linalg.solve(
            matrix + dense.T @ (heavy[:, None] * dense), right + dense.T @ (heavy * rows.wanted[:n_rows])
        )
    np.testing.assert_allclose(move, expected, atol=1e-6 * max(1.0, np.abs(expected).max(initial=0.0)))


# The sweep


@functools.cache
def grown(name, length):
    """Return a maze, a link length and a track that the sweep has grown there."""
    maze = Maze.load(name)
    geometry, arm = survey(maze), ArmSpec(link_length=length)
    corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE)
    aim = aim_line(geometry, corners, [VARIANTS[0]] * len(corners), length)
    return maze, length, grow(geometry, arm, FINENESSES[0], aim)


def grown_at_random(rng):
    """Return one of a few mazes, a link length and its track."""
    return grown(*[("fig19", 300.0), ("L", 250.0), ("S200", 300.0)][rng.integers(0, 3)])


def grow_track_agrees(rng):
    """Check with shapely that links of `grow_track` are free, exact and start ever farther on."""
    maze, length, grown_track = grown_at_random(rng)
    assert grown_track.reached
    per_link, n = grown_track.fineness.per_link, grown_track.n
    boundary = maze.free_space.boundary
    for vertex in rng.integers(2 * per_link + 1, n, 20):
        chord = grown_track.points[[grown_track.start[vertex], vertex]]
        assert not boundary.intersects(LineString(chord))
        np.testing.assert_allclose(np.hypot(*(chord[1] - chord[0])), length, rtol=1e-9)
        assert grown_track.start[vertex - 1] <= grown_track.start[vertex] < vertex


def _arm(vertex, grown_track, length, base_pose, n_joints):
    """Return joints, tip first, the numbers of the links' vertices, and how many are out of the feeder."""
    per_link, joints, vertices = grown_track.fineness.per_link, [], []
    axis = np.array([math.cos(base_pose[2]), math.sin(base_pose[2])])
    while vertex > per_link:
        joints.append(grown_track.points[vertex])
        vertices.append(vertex)
        vertex = int(grown_track.start[vertex])
    along = (vertex - per_link) / per_link
    while len(joints) < n_joints:
        joints.append(base_pose[:2] + along * length * axis)
        along -= 1.0
    return np.array(joints), vertices


def thin_track_agrees(rng):
    """Compare `thin_track`, `chain_length` and `pose_joints` with arms that are built one by one."""
    maze, length, grown_track = grown_at_random(rng)
    per_link, n = (
        grown_track.fineness.per_link,
        int(rng.integers(3 * grown_track.fineness.per_link, grown_track.n)),
    )
    largest, most = length * rng.uniform(0.02, 0.3), rng.uniform(0.001, 0.2)
    kept = np.empty(n, dtype=np.int64)
    args = (n, grown_track.points, grown_track.start, grown_track.headings, per_link, largest, most, kept)
    kept = kept[: sweep.thin_track(*args)]
    assert kept[0] == per_link and kept[-1] == n - 1 and (np.diff(kept) > 0).all()
    n_links = max(sweep.chain_length(int(v), grown_track.start, per_link) for v in kept)
    joints = np.empty((len(kept), n_links + 1, 2))
    sweep.pose_joints(kept, grown_track.points, grown_track.start, per_link, length, maze.base_pose, joints)
    before = None
    for number in range(min(len(kept), 40) if rng.random() < 0.5 else len(kept)):
        pose, vertices = _arm(int(kept[number]), grown_track, length, maze.base_pose, n_links + 1)
        assert len(vertices) == sweep.chain_length(int(kept[number]), grown_track.start, per_link)
        np.testing.assert_allclose(joints[number, ::-1], pose, atol=1e-9 * length)
        if before is not None and kept[number] > kept[number - 1] + 1:
            moved = np.linalg.norm(pose - before[0], axis=1)
            assert moved.max() <= largest * (1.0 + 1e-9)
            old = [*before[1], *[0] * len(vertices)]
            turns = [
                grown_track.headings[b] - grown_track.headings[a] for a, b in zip(old, vertices, strict=False)
            ]
            assert np.square(turns).sum() <= most * (1.0 + 1e-9)
            straight = 2 * per_link
            assert not any(a < straight < b for a, b in zip(old, vertices, strict=False) if a)
        before = pose, vertices


def blocked_chords_agrees(rng):
    """Compare `blocked_chords` with shapely."""
    line = np.cumsum(rng.normal(0.0, 0.2, (int(rng.integers(2, 25)), 2)) + np.array([0.1, 0.0]), axis=0)
    length, walls = rng.uniform(0.1, 1.0), walls_near(rng, line, int(rng.integers(0, 4)), size=0.2)
    blocked = np.empty(len(line), dtype=np.bool_)
    sweep.blocked_chords(line, length, walls, blocked)
    for i, here in enumerate(line):
        crossings = [i + v for v in _crossings(line[i:], here, length)]
        if np.isclose(np.hypot(*(line[-1] - here)), length):
            continue
        end = line[-1]
        if crossings:
            end = place_on(line, int(crossings[0]), crossings[0] - int(crossings[0]))
        chord = LineString([here, end])
        assert blocked[i] == any(chord.intersects(LineString(wall)) for wall in walls)


LAWS = {
    "segments_meet, wall_between": segments_meet_agrees,
    "list_walls": list_walls_agrees,
    "edges_are_free": edges_are_free_agrees,
    "longest_edge": longest_edge_agrees,
    "add_row": add_row_agrees,
    "sample_rows": sample_rows_agree,
    "edge_rows": edge_rows_agree,
    "apply_move": apply_move_agrees,
    "find_chords": find_chords_agrees,
    "find_corners": find_corners_agrees,
    "chord_rows": chord_rows_agree,
    "goal_row": goal_row_agrees,
    "resample": resample_agrees,
    "find_normals": find_normals_agrees,
    "project_rows, solve_rows": solve_rows_agrees,
    "grow_track": grow_track_agrees,
    "thin_track, pose_joints, chain_length": thin_track_agrees,
    "blocked_chords": blocked_chords_agrees,
}
"""By the kernels that they compare."""
