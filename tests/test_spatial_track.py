"""Laws of the track planner in space: its kernels against slow twins, and what shaping keeps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planners.feeding import feed
from planners.kernels import feeding as feeding_kernel
from planners.kernels import spatial_track as kernel
from planners.path import arclength, resampled
from planners.spatial.kinematics import base_frame

ROUNDING = 1e-12
FREE = np.empty((0, 2, 3))
"""No boxes."""


def overlap(a, b, box):
    """Return depth, direction, shape (3,), and place of the touch."""
    depth, *direction, t = kernel.overlap(*map(float, a), *map(float, b), np.asarray(box, float)[None], 0)
    return depth, np.array(direction), t


def part_along(direction, a, b, box):
    """Return how far box and segment overlap along a direction: the least shift along it that parts them."""
    corners = np.where(direction > 0.0, box[1], box[0]) @ direction
    return corners - min(a @ direction, b @ direction)


def meets(a, b, box):
    """Tell by clipping whether a segment has a point inside a box."""
    d, first, last = b - a, 0.0, 1.0
    for axis in range(3):
        if d[axis] == 0.0:
            if not box[0, axis] < a[axis] < box[1, axis]:
                return False
            continue
        ends = sorted([(box[0, axis] - a[axis]) / d[axis], (box[1, axis] - a[axis]) / d[axis]])
        first, last = max(first, ends[0]), min(last, ends[1])
    return first < last


def random_pair(rng):
    low = rng.uniform(-1.0, 0.5, 3)
    box = np.stack([low, low + rng.uniform(0.05, 1.5, 3)])
    a, b = rng.uniform(-1.5, 1.5, (2, 3))
    if rng.random() < 0.3:  # parallel to a face, or to an edge
        axes = rng.permutation(3)[: rng.integers(1, 3)]
        b[axes] = a[axes]
    return a, b, box


# The smallest translation


def test_the_push_parts_segment_and_box_and_none_shorter_does():
    rng, n_deep = np.random.default_rng(5), 0
    for _ in range(3000):
        a, b, box = random_pair(rng)
        depth, direction, t = overlap(a, b, box)
        assert (depth > 0.0) == meets(a, b, box)
        if depth <= 0.0:
            assert not direction.any()
            continue
        n_deep += 1
        assert np.linalg.norm(direction) == pytest.approx(1.0, abs=ROUNDING)
        assert 0.0 <= t <= 1.0
        push = depth * direction
        assert overlap(a + push, b + push, box)[0] < ROUNDING
        for way in rng.normal(size=(20, 3)):
            shorter = 0.999 * depth * way / np.linalg.norm(way)
            assert overlap(a + shorter, b + shorter, box)[0] > 0.0
            assert meets(a + shorter, b + shorter, box)
    assert n_deep > 300


def test_the_depth_is_the_smallest_shift_over_all_directions():
    rng = np.random.default_rng(6)
    ways = rng.normal(size=(20_000, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    for _ in range(100):
        a, b, box = random_pair(rng)
        depth, direction, _ = overlap(a, b, box)
        if depth <= 0.0:
            continue
        shifts = np.where(ways > 0.0, box[1], box[0])
        shifts = np.einsum("nk,nk->n", shifts, ways) - np.minimum(ways @ a, ways @ b)
        assert depth <= shifts.min() + ROUNDING
        assert part_along(direction, a, b, box) == pytest.approx(depth, abs=ROUNDING)
        # Among so many directions one is near the best.
        assert shifts.min() - depth < 0.05 * (np.linalg.norm(b - a) + np.linalg.norm(box[1] - box[0]))


def test_the_segment_touches_the_box_where_the_push_says():
    rng, n_deep = np.random.default_rng(7), 0
    for _ in range(2000):
        a, b, box = random_pair(rng)
        depth, direction, t = overlap(a, b, box)
        rise = np.abs(b - a) / np.linalg.norm(b - a)
        if depth > 0.0 and (rise[direction != 0.0] > kernel.PARALLEL).all():
            place = a + t * (b - a) + depth * direction
            away = np.linalg.norm(np.maximum(0.0, np.maximum(box[0] - place, place - box[1])))
            assert away < ROUNDING
            n_deep += 1
    assert n_deep > 200


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [0, 1])
def test_a_segment_in_a_face_is_free_and_one_just_below_is_not(axis, side):
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    b, c = (axis + 1) % 3, (axis + 2) % 3
    for db, dc in ((1.0, 0.0), (0.0, 1.0), (0.4, 0.3)):
        p, q = np.empty(3), np.empty(3)
        p[axis] = q[axis] = float(side)
        p[b], p[c] = 0.3, 0.2
        q[b], q[c] = 0.3 + db, 0.2 + dc
        assert overlap(p, q, box)[0] <= 0.0
        p[axis] = q[axis] = 0.01 if side == 0 else 0.99
        depth, direction, t = overlap(p, q, box)
        assert depth == pytest.approx(0.01) and t == 0.5
        assert direction[axis] == pytest.approx(2.0 * side - 1.0)


def test_a_segment_along_an_edge_is_free_and_one_inside_it_is_not():
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    edge = np.array([[-1.0, 1.0, 1.0], [2.0, 1.0, 1.0]])
    assert overlap(*edge, box)[0] <= 0.0
    depth, direction, _ = overlap(*(edge - (0.0, 0.02, 0.01)), box)
    assert depth == pytest.approx(0.01)
    np.testing.assert_allclose(direction, [0.0, 0.0, 1.0])


def test_a_segment_across_an_edge_leaves_across_that_edge():
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    depth, direction, t = overlap([0.8, 0.5, 1.1], [1.1, 0.5, 0.8], box)
    assert depth == pytest.approx(0.05 * math.sqrt(2.0))
    np.testing.assert_allclose(direction, [math.sqrt(0.5), 0.0, math.sqrt(0.5)], atol=ROUNDING)
    assert t == pytest.approx(0.5)


def test_a_segment_of_no_length_is_pushed_as_the_point_that_it_is():
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    depth, direction, _ = overlap([0.5, 0.9, 0.4], [0.5, 0.9, 0.4], box)
    assert depth == pytest.approx(0.1)
    np.testing.assert_array_equal(direction, [0.0, 1.0, 0.0])


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), scale=st.floats(1e-6, 1e6))
def test_ends_may_change_places_axes_turn_and_units_change(seed, scale):
    rng = np.random.default_rng(seed)
    a, b, box = random_pair(rng)
    a, b = 0.3 * a, 0.3 * b
    depth, direction, t = overlap(a, b, box)
    order = [1, 2, 0]
    for other in (
        overlap(b, a, box)[0],
        overlap(a[order], b[order], box[:, order])[0],
        overlap(scale * a, scale * b, scale * box)[0] / scale,
        overlap(-a, -b, -box[::-1])[0],
    ):
        assert max(other, 0.0) == pytest.approx(max(depth, 0.0), abs=1e-9)
    turned = overlap(a[order], b[order], box[:, order])
    np.testing.assert_allclose(turned[1], direction[order], atol=1e-9)
    assert turned[2] == pytest.approx(t, abs=1e-9)


# Shaping a track


PER_LINK = 15
"""Samples per link."""


def curve_at_random(rng, n=150):
    """Return a smooth curve from (1, 0, 0) on, about six units long, first along x."""
    turns = np.cumsum(rng.normal(0.0, 0.06, (n, 2)), axis=0)
    way = np.column_stack(
        [
            np.cos(turns[:, 0]) * np.cos(turns[:, 1]),
            np.sin(turns[:, 0]) * np.cos(turns[:, 1]),
            np.sin(turns[:, 1]),
        ]
    )
    return np.array([1.0, 0.0, 0.0]) + np.concatenate([np.zeros((1, 3)), np.cumsum(way, axis=0) * 6.0 / n])


def track_at_random(seed):
    """Return samples with one link length of straight feed, and how many of them are fixed."""
    free = resampled(curve_at_random(np.random.default_rng(seed)), 1.0 / PER_LINK)
    axis = np.linspace(0.0, 1.0, PER_LINK + 1)[:, None] * (1.0, 0.0, 0.0)
    return np.concatenate([axis, free[1:]]), PER_LINK + 1


def boxes_beside(points, rng, n=40, least=0.15, size=(0.2, 0.8)):
    """Return boxes that are at least so far from a curve's samples."""
    found = []
    while len(found) < n:
        middle = points[rng.integers(len(points))] + rng.normal(0.0, 0.6, 3)
        half = 0.5 * rng.uniform(*size, 3)
        gaps = np.abs(points - middle) - half
        if np.linalg.norm(np.maximum(gaps, 0.0), axis=1).min() > least:
            found.append([middle - half, middle + half])
    return np.array(found)


def relaxed(points, fixed, boxes, smoothing=0.1, iterations=60, limit=math.pi):
    points = points.copy()
    depth = kernel.relax(points, fixed, kernel.Demand(1.0, limit), boxes, smoothing, iterations)
    return points, depth


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("limit", [math.pi, 0.7])
def test_shaping_moves_neither_the_fixed_samples_nor_the_goal(seed, limit):
    points, fixed = track_at_random(seed)
    boxes = boxes_beside(points, np.random.default_rng(seed), least=0.02)
    shaped, _ = relaxed(points, fixed, boxes, 0.3, 40, limit)
    np.testing.assert_array_equal(shaped[:fixed], points[:fixed])
    np.testing.assert_array_equal(shaped[-1], points[-1])
    assert not np.array_equal(shaped, points) and np.isfinite(shaped).all()


def chord_depth(points, fixed, boxes):
    return kernel.deepest_chord(points, fixed, 1.0, boxes)[3]


@pytest.mark.parametrize("seed", range(6))
def test_a_track_without_slack_that_is_free_stays_as_it_is(seed):
    # Without smoothing nothing but boxes moves it, and even samples stay where they are.
    points, fixed = track_at_random(seed)
    points[fixed - 1 :] = resampled(
        points[fixed - 1 :], arclength(points[fixed - 1 :])[-1] / (len(points) - fixed)
    )
    boxes = boxes_beside(points, np.random.default_rng(seed), least=0.6, size=(0.1, 0.3))
    assert chord_depth(points, fixed, boxes) <= 0.0
    shaped, depth = relaxed(points, fixed, boxes, 0.0, 1)
    assert depth == 0.0
    np.testing.assert_allclose(shaped, points, atol=5e-3 / PER_LINK)


@pytest.mark.parametrize("seed", range(6))
def test_a_free_track_is_still_free_after_shaping(seed):
    points, fixed = track_at_random(seed)
    rng = np.random.default_rng(seed)
    boxes = boxes_beside(points, rng)
    boxes = boxes[[chord_depth(points, fixed, box[None]) <= 0.0 for box in boxes]]
    assert len(boxes) > 5
    grown = boxes + np.array([[-0.02], [0.02]])
    shaped = points
    for smoothing in (0.3, 0.03, 0.003):
        shaped, depth = relaxed(shaped, fixed, grown, smoothing, 60)
    assert depth < 0.02
    assert chord_depth(shaped, fixed, boxes) <= 0.0
    assert arclength(shaped)[-1] < arclength(points)[-1] + ROUNDING


def test_a_chord_in_a_box_is_pushed_out_and_takes_the_track_with_it():
    # The curve goes round the edge of a box, its chords cut through.
    corner = np.array([[1.0, 0.0, 0.0], [1.9, 0.0, 0.0], [2.2, 0.3, 0.0], [2.2, 2.5, 0.0]])
    free = resampled(corner, 1.0 / PER_LINK)
    axis = np.linspace(0.0, 1.0, PER_LINK + 1)[:, None] * (1.0, 0.0, 0.0)
    points, fixed = np.concatenate([axis, free[1:]]), PER_LINK + 1
    box = np.array([[[0.0, 0.1, -2.0], [2.0, 3.0, 2.0]]])
    assert chord_depth(points, fixed, box) > 0.1
    shaped = points
    for smoothing in (0.1, 0.03, 0.003):
        shaped, depth = relaxed(shaped, fixed, box, smoothing, 100)
    assert depth < 1e-3 and chord_depth(shaped, fixed, box) < 1e-3
    assert np.abs(shaped[:, 2]).max() < ROUNDING  # nothing pushes it out of the plane


@pytest.mark.parametrize("seed", range(8))
def test_boxes_that_are_near_are_all_that_matter(seed, monkeypatch):
    points, fixed = track_at_random(seed)
    rng = np.random.default_rng(seed)
    boxes = boxes_beside(points, rng, n=60, least=0.03)
    n_blocks = (len(points) + kernel.BLOCK - 1) // kernel.BLOCK
    near = kernel.Near(np.empty(n_blocks + 1, dtype=np.int64), np.empty(n_blocks * 60, dtype=np.int64))
    kernel._look_up(points, boxes, kernel.REACH, near)
    every = kernel.Near(60 * np.arange(n_blocks + 1), np.tile(np.arange(60), n_blocks))
    assert near.first[-1] < 0.7 * every.first[-1]
    found = []
    for candidates in (near, every):
        rear, front, weights = np.empty(len(points)), np.empty(len(points)), np.zeros(len(points))
        pushes = np.zeros_like(points)
        # The look-up is used until samples have moved by a quarter of a chord.
        moved = points + np.r_[np.zeros(fixed), np.full(len(points) - fixed, 0.14)][:, None]
        depth = kernel.push_chords(moved, fixed, 1.0, boxes, candidates, rear, front, pushes, weights)
        found.append((depth, pushes, weights, rear, front))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)
    assert found[0][0] > 0.0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("axis", [1, 2])
def test_the_mirror_image_of_a_track_is_shaped_into_the_mirror_image(seed, axis):
    points, fixed = track_at_random(seed)
    boxes = boxes_beside(points, np.random.default_rng(seed), least=0.02)
    turn = np.ones(3)
    turn[axis] = -1.0
    for limit in (math.pi, 0.8):
        shaped, depth = relaxed(points, fixed, boxes, 0.1, 15, limit)
        other, others = relaxed(points * turn, fixed, np.sort(boxes * turn, axis=1), 0.1, 15, limit)
        # Samples on the edge of a decision make much of rounding, but not at once.
        np.testing.assert_allclose(other * turn, shaped, atol=1e-9)
        assert others == pytest.approx(depth, abs=1e-9)


def test_chords_end_one_length_away_on_the_track():
    points, fixed = track_at_random(3)
    n = len(points)
    near = kernel.Near(np.zeros((n + 7) // 8 + 1, dtype=np.int64), np.empty(0, dtype=np.int64))
    rear, front, pushes, weights = np.empty(n), np.empty(n), np.zeros((n, 3)), np.zeros(n)
    kernel.push_chords(points, fixed, 1.0, FREE, near, rear, front, pushes, weights)
    index = np.arange(n)
    for ends, which in ((rear, rear >= 0.0), (front, front >= 0.0)):
        k = np.minimum(ends[which].astype(int), n - 2)
        places = points[k] + (ends[which] - k)[:, None] * (points[k + 1] - points[k])
        apart = np.linalg.norm(places - points[which], axis=1)
        np.testing.assert_allclose(apart, 1.0, atol=1e-9)
    assert (rear[fixed:] >= 0.0).all() and (rear[:fixed] < 0.0).all()
    assert (rear[fixed:] < index[fixed:]).all() and (front[front >= 0.0] >= index[front >= 0.0]).all()
    # Only samples less than a chord from the end have no chord forwards.
    distant = np.linalg.norm(points - points[-1], axis=1) >= 1.0 + ROUNDING
    assert (front[distant] >= 0.0).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_deepest_chord_is_that_of_a_search_over_all(seed):
    points, fixed = track_at_random(seed)
    boxes = boxes_beside(points, np.random.default_rng(seed), least=0.02)
    end, rear, wall, depth = kernel.deepest_chord(points, fixed, 1.0, boxes)
    assert np.linalg.norm(points[end] - rear) == pytest.approx(1.0)
    assert overlap(rear, points[end], boxes[wall])[0] == pytest.approx(depth)
    n = len(points)
    near = kernel.Near(np.zeros((n + 7) // 8 + 1, dtype=np.int64), np.empty(0, dtype=np.int64))
    ends, front, pushes, weights = np.empty(n), np.empty(n), np.zeros((n, 3)), np.zeros(n)
    kernel.push_chords(points, fixed, 1.0, FREE, near, ends, front, pushes, weights)
    worst = 0.0
    for i in range(fixed, n):
        k = int(ends[i])
        start = points[k] + (ends[i] - k) * (points[k + 1] - points[k])
        worst = max(worst, *(overlap(start, points[i], box)[0] for box in boxes))
    assert max(depth, 0.0) == pytest.approx(worst, abs=1e-12)


def test_a_chord_may_end_at_the_last_sample_itself():
    points = np.zeros((100, 3))
    points[:, 0] = np.arange(100.0)  # in whole numbers, so that chords end at samples
    limited = kernel.Demand(30.0, 1.0, 0.5, 0.1, False)
    straight = points.copy()
    kernel.relax(straight, 31, limited, np.empty((0, 2, 3)), 0.0, 3)
    assert np.array_equal(straight, points)
    points[60:, 1] = np.arange(40.0)  # a joint there is over its limit
    kernel.relax(points, 31, limited, np.empty((0, 2, 3)), 0.0, 3)
    assert np.isfinite(points).all()


def test_a_joint_limit_straightens_the_track():
    corner = np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 2.0, 1.0], [3.0, 4.0, 1.0]])
    free = resampled(corner, 1.0 / PER_LINK)
    axis = np.linspace(0.0, 1.0, PER_LINK + 1)[:, None] * (1.0, 0.0, 0.0)
    points, fixed = np.concatenate([axis, free[1:]]), PER_LINK + 1
    base_pose, limit = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), 0.8
    largest = []
    for allowed in (math.pi, limit):
        shaped, _ = relaxed(points, fixed, FREE, 0.003, 400, allowed)
        poses = feed(shaped, 1.0, base_pose).poses
        links = np.diff(poses, axis=1)
        cosines = np.einsum("pkc,pkc->pk", links[:, 1:], links[:, :-1])
        largest.append(math.acos(cosines.min()))
    assert largest[0] > 1.2 and largest[1] < 1.02 * limit


def with_axis(corners):
    """Return a polyline from (1, 0, 0) on as a track: samples, and how many of them are fixed."""
    free = resampled(np.array(corners), 1.0 / PER_LINK)
    axis = np.linspace(0.0, 1.0, PER_LINK + 1)[:, None] * (1.0, 0.0, 0.0)
    return np.concatenate([axis, free[1:]]), PER_LINK + 1


def test_a_corner_at_which_a_joint_would_jump_is_opened_by_shaping():
    points, fixed = with_axis([(1.0, 0.0, 0.0), (3.0, 0.0, 0.0), (1.5, 2.0, 1.0)])
    base_pose = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    assert feed(points, 1.0, base_pose).ending == feeding_kernel.JUMP
    for smoothing, iterations in ((0.5, 60), (0.1, 30), (0.02, 30)):
        points, _ = relaxed(points, fixed, FREE, smoothing, iterations)
    assert feed(points, 1.0, base_pose).ending == feeding_kernel.DONE


def test_the_track_is_turned_towards_a_chord_that_starts_across_it_and_no_other():
    points, fixed = with_axis([(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 0.8, 0.0), (3.5, 0.0, 0.0)])
    k = int(np.argmin(np.linalg.norm(points - (2.0, 0.4, 0.0), axis=1)))  # on the riser
    for i in range(k + 12, len(points) - 1):
        chord = points[i] - 0.5 * (points[k] + points[k + 1])
        length = np.linalg.norm(chord)
        rear, pushes, weights = np.full(len(points), -1.0), np.zeros_like(points), np.zeros(len(points))
        rear[i] = k + 0.5
        kernel._turn_along(points, fixed, kernel.Demand(length), rear, pushes, weights)
        before = (points[k + 1] - points[k]) @ chord
        lacks = before < 0.1 * length * np.linalg.norm(points[k + 1] - points[k])
        assert pushes.any() == lacks == (weights > 0.0).any()
        if lacks:
            turned = points + pushes
            assert (turned[k + 1] - turned[k]) @ chord > before
            reach = np.flatnonzero(pushes.any(axis=1))
            assert k - kernel.SPAN < reach.min() and reach.max() < k + 1 + kernel.SPAN


@pytest.mark.parametrize("seed", range(4))
def test_a_resampled_track_has_even_samples_on_the_polyline_and_keeps_its_ends(seed):
    rng = np.random.default_rng(seed)
    points, fixed = track_at_random(seed)
    points[fixed:-1] += rng.normal(0.0, 0.03, points[fixed:-1].shape)
    even = points.copy()
    kernel.resample_free(even, fixed, np.empty_like(points))
    np.testing.assert_array_equal(even[:fixed], points[:fixed])
    np.testing.assert_array_equal(even[-1], points[-1])
    line = points[fixed - 1 :]
    where = np.linspace(0.0, 1.0, len(line)) * arclength(line)[-1]
    wanted = np.column_stack([np.interp(where, arclength(line), line[:, c]) for c in range(3)])
    np.testing.assert_allclose(even[fixed - 1 :], wanted, atol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_samples_in_a_box_go_to_its_nearest_face_and_others_stay(seed):
    points, fixed = track_at_random(seed)
    middle, half = points[fixed + 20], np.array([0.5, 0.3, 0.4])
    box = np.array([[middle - half + 0.07, middle + half]])
    moved = points.copy()
    n_blocks = (len(points) + kernel.BLOCK - 1) // kernel.BLOCK
    every = kernel.Near(np.arange(n_blocks + 1), np.zeros(n_blocks, dtype=np.int64))
    kernel._leave_boxes(moved, fixed, box, every)
    inside = ((points > box[0, 0]) & (points < box[0, 1])).all(axis=1)
    inside[:fixed] = inside[-1] = False
    assert inside.any()
    np.testing.assert_array_equal(moved[~inside], points[~inside])
    gaps = np.minimum(points - box[0, 0], box[0, 1] - points)[inside].min(axis=1)
    np.testing.assert_allclose(np.linalg.norm(moved - points, axis=1)[inside], gaps)
    assert not ((moved > box[0, 0] + ROUNDING) & (moved < box[0, 1] - ROUNDING)).all(axis=1)[inside].any()


# Feeding, which is shared with the plane


def frame_at_random(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn)), rng.normal(size=3)


@pytest.mark.parametrize("seed", range(6))
def test_a_planar_track_gives_the_planar_poses_wherever_its_plane_is(seed):
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 6.0, 400)
    y = rng.uniform(0.1, 0.45) * np.sin(rng.uniform(1.2, 1.7) * s) * np.minimum(1.0, s * s)
    track = np.concatenate([[(0.0, 0.0)], np.column_stack([1.0 + s, y])])
    flat = feed(track, 1.0, np.zeros(3))
    assert flat.ending == feeding_kernel.DONE
    lifted = np.concatenate([flat.poses, np.zeros((*flat.poses.shape[:2], 1))], axis=2)
    level = feed(np.column_stack([track, np.zeros(len(track))]), 1.0, np.array([0.0, 0, 0, 1, 0, 0]))
    np.testing.assert_array_equal(level.poses, lifted)
    turn, shift = frame_at_random(rng)
    base_pose = np.concatenate([shift, turn[0]])
    placed = feed(np.column_stack([track, np.zeros(len(track))]) @ turn + shift, 1.0, base_pose)
    assert placed.ending == flat.ending
    assert abs(len(placed.poses) - len(flat.poses)) <= 1
    for p, q in ((0, 0), (-1, -1)):
        np.testing.assert_allclose(placed.poses[p], lifted[q] @ turn + shift, atol=1e-9)
    if len(placed.poses) == len(flat.poses):
        np.testing.assert_allclose(placed.poses, lifted @ turn + shift, atol=1e-6)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), length=st.floats(1e-3, 1e3))
def test_feeding_in_space_keeps_lengths_steps_and_the_track(seed, length):
    rng = np.random.default_rng(seed)
    turn, shift = frame_at_random(rng)
    curve = np.concatenate([np.zeros((1, 3)), curve_at_random(rng)])
    track, base_pose = length * (curve @ turn + shift), np.concatenate([length * shift, turn[0]])
    np.testing.assert_allclose(base_frame(base_pose)[0], turn[0])
    fed = feed(track, length, base_pose)
    links = np.linalg.norm(np.diff(fed.poses, axis=1), axis=2)
    np.testing.assert_allclose(links, length, rtol=1e-9)
    assert np.linalg.norm(np.diff(fed.poses, axis=0), axis=2).max() <= 0.03 * length * (1.0 + 1e-6)
    if fed.ending == feeding_kernel.DONE:
        np.testing.assert_allclose(fed.poses[-1, -1], track[-1], atol=1e-9 * length)
        np.testing.assert_allclose(fed.poses[0, -1], track[0], atol=1e-9 * length)
    starts, ways = track[:-1], np.diff(track, axis=0)
    along = (fed.poses - base_pose[:3]) @ base_pose[3:]
    for place in fed.poses[along > 0.0][::97]:
        t = np.clip(np.einsum("nc,nc->n", place - starts, ways) / (ways**2).sum(axis=1), 0.0, 1.0)
        away = np.linalg.norm(starts + t[:, None] * ways - place, axis=1).min()
        assert away <= 1e-9 * length
