"""Slow twins of the kernels in space: the potential, chords on a path, and the shaping of a track.

Each law draws an input, and fails with an AssertionError where kernel and twin disagree.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from benchmarks.trust.twins_feeding import start_behind
from planners.kernels import spatial_chords, spatial_field, spatial_track
from planners.path import arclength, resampled

ROUNDING = 1e-9


# The potential


def rooms_at_random(rng):
    """Return which nodes of a small grid are free; the outermost are not."""
    free = np.zeros(rng.integers(3, 8, 3), dtype=bool)
    inner = free[1:-1, 1:-1, 1:-1]
    inner[...] = rng.random(inner.shape) < rng.choice([0.6, 0.9, 1.0])
    inner[tuple(rng.integers(0, inner.shape))] = True
    return free


def _strides(free):
    return free.shape[1] * free.shape[2], free.shape[2]


def _links(free):
    """Return pairs of neighbouring free nodes, as flat indices."""
    index, pairs = np.arange(free.size).reshape(free.shape), []
    for axis in range(3):
        near, far = (np.moveaxis(index, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        both = np.moveaxis(free, axis, 0)[:-1] & np.moveaxis(free, axis, 0)[1:]
        pairs.append(np.column_stack([near[both], far[both]]))
    return np.concatenate(pairs)


def flood_agrees(rng):
    """Compare `flood` and `neighbours_of` with shortest ways found by SciPy."""
    free = rooms_at_random(rng)
    goal = int(rng.choice(np.flatnonzero(free)))
    order, levels = spatial_field.flood(free.ravel(), *_strides(free), goal)
    pairs = _links(free)
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(free.size, free.size))
    steps = dijkstra(graph, directed=False, unweighted=True, indices=goal)
    assert len(order) == np.isfinite(steps).sum() == levels[-1] and order[0] == goal and levels[0] == 0
    for k, (begin, end) in enumerate(itertools.pairwise(levels)):
        assert sorted(order[begin:end]) == np.flatnonzero(steps == k).tolist()
    found = spatial_field.neighbours_of(order, free.size, *_strides(free))
    place = {node: k for k, node in enumerate(order.tolist())}
    beside = {node: set() for node in place}
    for a, b in pairs.tolist():
        if a in place:
            beside[a].add(place[b])
            beside[b].add(place[a])
    for node, row in zip(order.tolist(), found.tolist(), strict=True):
        assert sorted(k for k in row if k != len(order)) == sorted(beside[node])
        assert len(row) == 6


def slowest_modes_agree(rng):
    """Compare `add_slowest_modes` with rows of free nodes that are looked for by text."""
    free = rooms_at_random(rng)
    modes, axis = np.ones(free.shape), int(rng.integers(0, 3))
    spatial_field.add_slowest_modes(np.moveaxis(free, axis, 2), np.moveaxis(modes, axis, 2))
    for row, found in zip(
        np.moveaxis(free, axis, 2).reshape(-1, free.shape[axis]),
        np.moveaxis(modes, axis, 2).reshape(-1, free.shape[axis]),
        strict=True,
    ):
        expected = np.ones(len(row))
        text = "".join("x" if node else "." for node in row)
        for begin in (k for k in range(1, len(text)) if text[k - 1 : k + 1] == ".x"):
            n = text.index(".", begin) - begin
            expected[begin : begin + n] += math.cos(math.pi / (n + 1)) / 3.0
        np.testing.assert_allclose(found, expected, atol=ROUNDING)


def potential_agrees(rng):
    """Compare what `relax` settles on with the solution of the dense linear system."""
    free = rooms_at_random(rng)
    goal = int(rng.choice(np.flatnonzero(free)))
    order, _ = spatial_field.flood(free.ravel(), *_strides(free), goal)
    neighbours = spatial_field.neighbours_of(order, free.size, *_strides(free))
    n = len(order)
    u = np.zeros(n + 1)
    u[0] = 1.0
    weights = np.full(n - 1, rng.uniform(1.0, 1.4))
    sweeps = spatial_field.relax(u, neighbours[1:], weights, 1, 1e-12, 2000)
    assert sweeps > 0 and sweeps % spatial_field.EVERY == 0 and u[0] == 1.0 and u[n] == 0.0
    matrix, right = np.eye(n), np.zeros(n)
    right[0] = 1.0
    for k in range(1, n):
        for other in neighbours[k]:
            if other < n:
                matrix[k, other] -= 1.0 / 6.0
    np.testing.assert_allclose(u[:n], np.linalg.solve(matrix, right), rtol=1e-6)
    assert spatial_field.relax(u, neighbours[1:], weights, 1, 0.0, spatial_field.EVERY) == 0 or n == 1


def potentials_at_random(rng):
    """Return the logarithm of something that rises towards a node, and that node."""
    shape = rng.integers(4, 9, 3)
    goal = np.array([rng.integers(1, size - 1) for size in shape])
    away = np.linalg.norm(np.moveaxis(np.indices(shape), 0, -1) - goal, axis=-1)
    log_u = -rng.choice([0.5, 3.0, 100.0]) * away
    free = np.zeros(shape, dtype=bool)
    inner = free[1:-1, 1:-1, 1:-1]
    inner[...] = rng.random(inner.shape) < rng.choice([0.8, 1.0])
    free[tuple(goal)] = True
    return np.where(free, log_u, -np.inf), goal.astype(float)


def _interpolated(log_u):
    """Return u over its largest value, to be interpolated linearly by SciPy."""
    axes = [np.arange(size, dtype=float) for size in log_u.shape]
    return RegularGridInterpolator(axes, np.exp(log_u - log_u.max()), bounds_error=False, fill_value=0.0)


def rise_agrees(rng):
    """Compare `rise` with differences of what SciPy interpolates."""
    log_u, _ = potentials_at_random(rng)
    place = rng.uniform(-0.5, np.array(log_u.shape) - 0.5)
    value, *way = spatial_field.rise(log_u, *place)
    low = np.floor(place)
    off = (place < 0.0).any() or (place >= np.array(log_u.shape) - 1.0).any()
    cell = log_u[tuple(slice(int(k), int(k) + 2) for k in low)]
    top = -np.inf if off else cell.max()
    u = None if top == -np.inf else _interpolated(cell)
    place = place - low
    here = 0.0 if u is None else float(u(place)[0])
    if here == 0.0:
        assert value == -np.inf and way == [0.0, 0.0, 0.0]
        return
    assert abs(value - top - math.log(here)) < 1e-6
    ends = [[place.copy() for _ in range(2)] for _ in range(3)]
    for axis in range(3):
        ends[axis][0][axis], ends[axis][1][axis] = 0.0, 1.0  # u is linear in between
    slope = np.array([float(u(b)[0] - u(a)[0]) for a, b in ends])
    np.testing.assert_allclose(way, slope / np.linalg.norm(slope), atol=1e-6)


def ascent_agrees(rng):
    """Check that u rises along `ascend_in_space`, and how it begins and ends."""
    log_u, goal = potentials_at_random(rng)
    free = np.argwhere(np.isfinite(log_u))
    start = free[rng.integers(len(free))] + rng.uniform(-0.3, 0.3, 3)
    step, stop = rng.uniform(0.05, 0.5), 0.5
    points = spatial_field.ascend_in_space(log_u, start, goal, step, stop)
    if np.isfinite(log_u[1:-1, 1:-1, 1:-1]).all() and (start >= 1.0).all():
        assert len(points) or (start > np.array(log_u.shape) - 2.0).any()
    if len(points):
        values = [spatial_field.rise(log_u, *point)[0] for point in points]
        assert (np.diff(values) > 0.0).all()
        np.testing.assert_array_equal(points[0], start)
        away = np.linalg.norm(points - goal, axis=1)
        assert away[-1] <= stop and (away[:-1] > stop).all()
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).max(initial=0.0) <= step * (1.0 + ROUNDING)


# Chords on a path


def curves_at_random(rng):
    """Return a curve along x at first; some turn back on themselves."""
    n, wild = int(rng.integers(60, 150)), rng.choice([0.05, 0.2, 0.5])
    turns = np.cumsum(rng.normal(0.0, wild, (n, 2)), axis=0)
    steps = np.column_stack(
        [
            np.cos(turns[:, 0]) * np.cos(turns[:, 1]),
            np.sin(turns[:, 0]) * np.cos(turns[:, 1]),
            np.sin(turns[:, 1]),
        ]
    )
    curve = np.concatenate(
        [np.zeros((1, 3)), [[1.0, 0.0, 0.0]], [1.0, 0.0, 0.0] + np.cumsum(steps, axis=0) * 0.04]
    )
    if rng.random() < 0.3:  # a hairpin
        curve = np.concatenate(
            [curve, curve[-1] + (0.0, 0.03, 0.0) - np.linspace(0.0, 1.5, 40)[:, None] * (1, 0, 0)]
        )
    return resampled(curve, 0.05)


def _from_segments(places, a, b):
    """Return the distance of each place, shape (n, 3), from the nearest of some segments."""
    steps = b - a
    share = ((places[:, None] - a) * steps).sum(axis=2) / np.maximum((steps**2).sum(axis=1), 1e-300)
    feet = a + np.clip(share, 0.0, 1.0)[:, :, None] * steps
    return np.linalg.norm(places[:, None] - feet, axis=2).min(axis=1)


def chord_errors_agree(rng):
    """Compare `chord_errors` with a search over all chords, each ending one length or just more ahead."""
    points, length = curves_at_random(rng), rng.uniform(0.2, 1.5)
    link_to_path, path_to_link = 0.0, 0.0
    share = np.arange(1, spatial_chords.PARTS)[:, None] / spatial_chords.PARTS
    for i in range(len(points)):
        far = np.flatnonzero(((points[:i] - points[i]) ** 2).sum(axis=1) >= length**2)
        if len(far):
            k = far[-1]
            link = points[k] + share * (points[i] - points[k])
            near = _from_segments(link, points[k:i], points[k + 1 : i + 1])
            link_to_path = max(link_to_path, near.max())
            spanned = _from_segments(points[k : i + 1], points[k : k + 1], points[i : i + 1])
            path_to_link = max(path_to_link, spanned.max())
    found = spatial_chords.chord_errors(points, length)
    np.testing.assert_allclose(found, (link_to_path, path_to_link), atol=1e-9)


def place_on_path_agrees(rng):
    """Compare `place_on_path` with a search for each joint by itself."""
    points, length = curves_at_random(rng), rng.uniform(0.2, 1.5)
    arc, base_pose = arclength(points), np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    tips = np.sort(rng.uniform(0.0, arc[-1], 4))
    poses = np.empty((4, math.ceil(arc[-1] / length) + 1, 3))
    spatial_chords.place_on_path(points, arc, length, tips, base_pose, poses)
    for tip, pose in zip(tips, poses, strict=True):
        k = max(int(np.searchsorted(arc, tip)) - 1, 0)
        joint = np.array([np.interp(tip, arc, column) for column in points.T])
        np.testing.assert_allclose(pose[-1], joint, atol=ROUNDING)
        for found in pose[-2::-1]:
            if k >= 0:
                k, t = start_behind(points, arc, joint, k, length)
            if k >= 0:
                joint = points[k] + t / (arc[k + 1] - arc[k]) * (points[k + 1] - points[k])
            else:  # on the axis, which is that of x
                joint = np.array([joint[0] - math.sqrt(length**2 - joint[1] ** 2 - joint[2] ** 2), 0.0, 0.0])
            np.testing.assert_allclose(found, joint, atol=1e-7)
            joint = found


# Shaping


def shapes_at_random(rng):
    """Return samples of a track in space, the number that is fixed, and boxes near them."""
    per_link = int(rng.integers(6, 14))
    curve = curves_at_random(rng)
    curve = resampled(curve[arclength(curve) >= 1.0 - 1e-9], 1.0 / per_link)
    points = np.concatenate([np.linspace(0.0, 1.0, per_link + 1)[:-1, None] * (1.0, 0.0, 0.0), curve])
    middles = points[rng.integers(0, len(points), int(rng.integers(0, 5)))]
    middles = middles + rng.normal(0.0, 0.3, middles.shape)
    half = rng.uniform(0.02, 0.3, middles.shape)
    return points, per_link + 1, np.stack([middles - half, middles + half], axis=1)


def _place(points, place):
    k = spatial_track.segment_at(place, len(points))
    assert k == min(math.floor(place), len(points) - 2)
    return k, place - k


def _twin_pushes(points, fixed, boxes, rear, front):
    """Return pushes, weights and the largest depth, chord by chord."""
    pushes, weights, worst = np.zeros_like(points), np.zeros(len(points)), 0.0
    chords = [(i, rear[i]) for i in range(fixed, len(points))]
    chords += [(i, front[i]) for i in range(len(points)) if front[i] >= 0.0 and int(front[i]) + 1 >= fixed]
    for i, place in chords:
        k, f = _place(points, place)
        b = points[k] + f * (points[k + 1] - points[k])
        for m in range(len(boxes)):
            depth, *way, t = spatial_track.overlap(*points[i], *b, boxes, m)
            if depth <= 0.0:
                continue
            worst = max(worst, depth)
            # As a lever: the touching place moves by the depth, each end by its share of it.
            size = depth / ((1.0 - t) ** 2 + t**2)
            for sample, share in ((i, 1.0 - t), (k, t * (1.0 - f)), (k + 1, t * f)):
                pushes[sample] += share * size * np.array(way)
                weights[sample] += share
    return pushes, weights, worst


def push_chords_agrees(rng):
    """Compare `push_chords` and `deepest_chord` with each chord by itself and every box."""
    points, fixed, boxes = shapes_at_random(rng)
    n, n_boxes = len(points), len(boxes)
    n_blocks = (n + spatial_track.BLOCK - 1) // spatial_track.BLOCK
    every = spatial_track.Near(n_boxes * np.arange(n_blocks + 1), np.tile(np.arange(n_boxes), n_blocks))
    rear, front, pushes, weights = np.empty(n), np.empty(n), np.zeros((n, 3)), np.zeros(n)
    worst = spatial_track.push_chords(points, fixed, 1.0, boxes, every, rear, front, pushes, weights)
    for i in range(n):
        for place in (rear[i], front[i]):
            if place >= 0.0:
                k, f = _place(points, place)
                if k + f in (0.0, n - 1.0):
                    continue  # cut off at the end of the track: no place on it is a link away
                apart = np.linalg.norm(points[k] + f * (points[k + 1] - points[k]) - points[i])
                np.testing.assert_allclose(apart, 1.0, atol=1e-6)
    expected = _twin_pushes(points, fixed, boxes, rear, front)
    np.testing.assert_allclose(pushes, expected[0], atol=ROUNDING)
    np.testing.assert_allclose(weights, expected[1], atol=ROUNDING)
    assert abs(worst - expected[2]) < ROUNDING
    end, start, wall, depth = spatial_track.deepest_chord(points, fixed, 1.0, boxes)
    depths = [
        spatial_track.overlap(*(points[k] + f * (points[k + 1] - points[k])), *points[i], boxes, m)[0]
        for i in range(fixed, n)
        for k, f in [_place(points, rear[i])]
        for m in range(n_boxes)
    ]
    assert abs(depth - max(depths, default=-1.0)) < 1e-6
    if depth > 0.0:
        assert abs(spatial_track.overlap(*start, *points[end], boxes, wall)[0] - depth) < 1e-9


def shaping_agrees(rng):
    """Compare an iteration of `relax` and `resample_free` with NumPy, where nothing but boxes is asked."""
    points, fixed, boxes = shapes_at_random(rng)
    smoothing, demand = rng.uniform(0.0, 0.5), spatial_track.Demand(1.0, math.pi, 0.5, -1.0)
    shaped = points.copy()
    worst = spatial_track.relax(shaped, fixed, demand, boxes, smoothing, 1)
    expected = points.copy()
    middle = 0.5 * (points[fixed - 1 : -2] + points[fixed + 1 :])
    expected[fixed:-1] += smoothing * (middle - points[fixed:-1])
    free = expected[fixed - 1 :]
    arc = arclength(free)
    even = np.linspace(0.0, arc[-1], len(free))
    expected[fixed:-1] = np.column_stack([np.interp(even, arc, column) for column in free.T])[1:-1]
    n = len(points)
    rear, front = np.empty(n), np.empty(n)
    none = spatial_track.Near(np.zeros(n + 1, dtype=np.int64), np.empty(0, dtype=np.int64))
    spatial_track.push_chords(expected, fixed, 1.0, boxes, none, rear, front, np.zeros((n, 3)), np.zeros(n))
    pushes, weights, deepest = _twin_pushes(expected, fixed, boxes, rear, front)
    assert abs(worst - deepest) < 1e-6
    share = spatial_track.RELAXATION / np.maximum(weights, 1.0)[:, None]
    expected[fixed:-1] += (share * pushes)[fixed:-1]
    inside = (expected[:, None] > boxes[:, 0]) & (expected[:, None] < boxes[:, 1])
    outside = ~inside.all(axis=2).any(axis=1) if len(boxes) else np.ones(n, dtype=bool)
    np.testing.assert_allclose(shaped[outside], expected[outside], atol=1e-6)
    if not len(boxes):
        even_again = points.copy()
        spatial_track.resample_free(even_again, fixed, np.empty_like(points))
        arc = arclength(points[fixed - 1 :])
        places = np.linspace(0.0, arc[-1], len(arc))
        columns = [np.interp(places, arc, column) for column in points[fixed - 1 :].T]
        np.testing.assert_allclose(even_again[fixed - 1 :], np.column_stack(columns), atol=ROUNDING)


LAWS = {
    "flood, neighbours_of": flood_agrees,
    "add_slowest_modes": slowest_modes_agree,
    "relax (potential)": potential_agrees,
    "rise": rise_agrees,
    "ascend_in_space": ascent_agrees,
    "chord_errors": chord_errors_agree,
    "place_on_path": place_on_path_agrees,
    "push_chords, deepest_chord, segment_at": push_chords_agrees,
    "relax (track), resample_free": shaping_agrees,
}
"""By the kernels that they compare."""
