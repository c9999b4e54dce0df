"""Laws of the track planner and of feeding, its kernels against slow twins, and how far it gets."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import clutter_hall, fig19
from planners import Motion, PlanningStatus, plan, validate
from planners.feeding import feed, motion_along
from planners.kernels.feeding import DONE, MEETS, first_hit, first_self_crossing
from planners.kernels.track import find_chords, find_corners
from planners.kernels.track_solve import factorise, substitute
from planners.kernels.track_walls import edges_are_free
from planners.query import Query
from planners.track_planner import _room_for_chords, plan_track
from planners.track_scene import Scene
from planners.track_start import start_from_path, with_axis

# In px, at corridors 200 wide: what the planner passes, and half a percent from the longest known.
LONG = {
    "L": 562.0,
    "U40": 438.0,
    "U200": 560.0,
    "S0": 695.0,
    "S200": 423.0,
    "S400": 446.0,
    "S1000": 562.0,
    "zig3": 437.0,
    "serp": 437.0,
    "stairs": 291.0,
    "spiral": 562.0,
}

HEADING = math.radians(30.0)


def wavy_track(length, amplitude, n_links=6.0):
    """Return a track of some links that leaves the axis after one link and swings about it."""
    s = np.linspace(0.0, n_links * length, 600)
    y = amplitude * length * np.sin(1.7 * s / length) * np.minimum(1.0, (s / length) ** 2)
    line = np.concatenate([[(0.0, 0.0)], np.column_stack([length + s, y])])
    cos, sin = math.cos(HEADING), math.sin(HEADING)
    return line @ np.array([[cos, sin], [-sin, cos]]) + (3.0, -2.0)


@given(length=st.floats(1e-3, 1e4), amplitude=st.floats(0.0, 0.5), step=st.floats(0.005, 0.05))
@settings(max_examples=30)
def test_feeding_keeps_lengths_steps_and_the_track(length, amplitude, step):
    track = wavy_track(length, amplitude) if amplitude > 0.0 else wavy_track(length, 0.0)[[0, -1]]
    base_pose = np.array([*track[0], HEADING])
    motion = motion_along(track, length, base_pose, step)
    links = np.diff(motion.joints, axis=1)
    np.testing.assert_allclose(np.hypot(links[..., 0], links[..., 1]), length, rtol=1e-9)
    steps = np.diff(motion.joints, axis=0)
    assert np.hypot(steps[..., 0], steps[..., 1]).max() <= step * length * (1.0 + 1e-6)
    along = (motion.joints - track[0]) @ (math.cos(HEADING), math.sin(HEADING))
    curve = LineString(track)
    for x, y in motion.joints[along > 0.0][::37]:
        assert curve.distance(Point(x, y)) <= 1e-9 * length
    np.testing.assert_allclose(motion.joints[-1, -1], track[-1], atol=1e-9 * length)


def test_a_track_of_less_than_one_link_needs_one_link():
    motion = motion_along(np.array([(0.0, 0.0), (0.6, 0.0)]), 1.0, np.zeros(3))
    assert motion.n_links == 1
    np.testing.assert_allclose(motion.joints[[0, -1]], [[(-1, 0), (0, 0)], [(-0.4, 0), (0.6, 0)]], atol=1e-12)


def test_every_link_is_straight_in_one_pose_when_it_comes_out_of_the_feeder():
    motion = motion_along(wavy_track(1.0, 0.4), 1.0, np.array([3.0, -2.0, HEADING]))
    for n_out in range(1, math.floor(motion.feed[-1]) + 1):
        pose = int(np.argmin(np.abs(motion.feed - n_out)))
        assert abs(motion.feed[pose] - n_out) <= 1e-9
        assert abs(motion.joint_angles[pose, motion.n_links - n_out]) <= 1e-9


def test_a_track_that_bends_tighter_than_a_link_would_make_a_joint_jump():
    angle = np.linspace(-np.pi / 2, np.pi, 80)
    curl = np.array([1.0, 0.2]) + 0.2 * np.column_stack([np.cos(angle), np.sin(angle)])
    track = np.vstack([[(0.0, 0.0), (1.0, 0.0)], curl[1:], [(0.8, -3.0)]])
    assert motion_along(track, 1.0, np.zeros(3)) is None


def poses_at_random(rng, n_poses, n_links):
    turns = rng.uniform(-1.2, 1.2, size=(n_poses, n_links)).cumsum(axis=1)
    links = np.stack([np.cos(turns), np.sin(turns)], axis=2)
    return np.concatenate([np.full((n_poses, 1, 2), 0.5), 0.5 + links.cumsum(axis=1)], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_hits_and_self_crossings_are_those_of_shapely(seed):
    rng = np.random.default_rng(seed)
    poses, base_pose = poses_at_random(rng, 60, 7), np.zeros(3)
    walls = rng.uniform(-4.0, 4.0, size=(4, 2, 2))
    for pose in poses:
        links = [LineString(pose[k : k + 2]) for k in range(7)]
        hit = any(link.intersects(LineString(wall)) for link in links for wall in walls)
        crossed = any(links[i].intersects(links[k]) for i in range(7) for k in range(i + 2, 7))
        assert (first_hit(pose[None], base_pose, walls)[0] >= 0) == hit
        assert (first_self_crossing(pose[None], base_pose)[0] >= 0) == crossed


@given(amplitude=st.floats(0.0, 0.5), degrees=st.floats(-360.0, 360.0))
@settings(max_examples=20)
def test_configurations_along_a_track_are_those_of_its_joints(amplitude, degrees):
    angle = math.radians(degrees)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    base_pose = np.array([*((3.0, -2.0) @ turn), HEADING + angle])
    motion = motion_along(wavy_track(1.0, amplitude) @ turn, 1.0, base_pose)
    other = Motion.from_joints(motion.joints, 1.0, base_pose)
    np.testing.assert_allclose(motion.feed, other.feed, atol=1e-12)
    np.testing.assert_allclose(motion.joint_angles, other.joint_angles, atol=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_feeding_ends_at_the_first_pose_that_meets_a_wall_or_itself(seed):
    rng = np.random.default_rng(seed)
    length, base_pose = 100.0, np.array([3.0, -2.0, HEADING])
    turns = (rng.normal(0.0, 0.1, 240) + rng.choice([-1.0, 0.0, 1.0]) * rng.uniform(0.01, 0.05)).cumsum()
    steps = np.column_stack([np.cos(turns), np.sin(turns)]) / 24.0
    line = np.concatenate([[(0.0, 0.0)], np.concatenate([[(1.0, 0.0)], steps]).cumsum(axis=0)])
    cos, sin = math.cos(HEADING), math.sin(HEADING)
    track = length * line @ np.array([[cos, sin], [-sin, cos]]) + base_pose[:2]
    starts = track[rng.integers(30, len(track), 3)] + rng.normal(0.0, 50.0, (3, 2))
    walls = np.stack([starts, starts + rng.normal(0.0, 30.0, (3, 2))], axis=1)
    unchecked = feed(track, length, base_pose)
    for barriers in (walls, walls[:0]):
        firsts = (
            first_hit(unchecked.poses, base_pose, barriers)[0],
            first_self_crossing(unchecked.poses, base_pose)[0],
        )
        met = min((pose for pose in firsts if pose >= 0), default=len(unchecked.poses))
        fed = feed(track, length, base_pose, walls=barriers)
        if met == len(unchecked.poses) and unchecked.ending == DONE:
            # A wall may also be met between two poses.
            assert fed.ending == DONE or len(fed.poses) == 0
        elif met < len(unchecked.poses):
            assert fed.ending == MEETS
            assert len(fed.poses) in (met, 0)


def test_the_banded_solver_solves_what_numpy_solves():
    rng = np.random.default_rng(1)
    n, w = 40, 6
    matrix = np.zeros((n, n))
    low = np.maximum(np.arange(n) - rng.integers(0, w + 1, n), 0)
    for r in range(n):
        row = np.zeros(n)
        row[low[r] : r + 1] = rng.normal(size=r + 1 - low[r])
        matrix += np.outer(row, row)
    matrix += 0.1 * np.eye(n)
    envelope = np.array([np.flatnonzero(matrix[r])[0] for r in range(n)])
    band = np.zeros((n, w + 1))
    for r in range(n):
        for c in range(max(0, r - w), r + 1):
            band[r, c - r + w] = matrix[r, c]
    right = rng.normal(size=n)
    x = right.copy()
    factorise(band, envelope)
    substitute(band, envelope, x)
    np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-9, atol=1e-9)


def test_corners_are_across_a_chord_where_they_are_inside_the_loop_with_its_track():
    query = Query(maze=Maze.load("fig19"), arm=ArmSpec(link_length=300.0))
    scene = Scene(maze=query.maze, length=300.0, joint_limit=math.inf)
    points = with_axis(start_from_path(scene, scene.scaled(query.geometry.path.points)), 12)
    assert edges_are_free(points, 12, scene.near)
    chords = _room_for_chords(len(points))
    n_chords, done = find_chords(points, 12, 1.0, chords)
    assert done == len(points)
    find_corners(points, 12, 1.0, n_chords, scene.near, np.empty(len(points), dtype=np.int64), chords)
    n_across = 0
    for c in range(n_chords):
        k, f, j, e = chords.segment[c], chords.share[c], chords.end[c], chords.end_share[c]
        start, end = (points[i] + g * (points[i + 1] - points[i]) for i, g in ((k, f), (j, e)))
        np.testing.assert_allclose(np.hypot(*(end - start)), 1.0, rtol=1e-9)
        # Corners far beyond the ends of a chord are no reason to push it aside.
        loop = Polygon([start, *points[k + 1 : j + 1], end]).buffer(0)
        u = end - start
        offsets = [
            abs(u[0] * (y - start[1]) - u[1] * (x - start[0]))
            for x, y in scene.near.corners
            if loop.contains(Point(x, y)) and -0.5 <= u @ ((x, y) - start) <= 1.5
        ]
        deepest = max(chords.depth[c].max(), 0.0)
        assert deepest == pytest.approx(max(offsets, default=0.0), abs=1e-9)
        n_across += deepest > 0.0
    assert n_across > 0


@pytest.mark.parametrize("name", LONG)
def test_links_near_the_limit_pass_every_turn(name):
    result = plan(Maze.load(name), ArmSpec(link_length=LONG[name]), planner="track")
    assert result.solved, result.reason
    assert result.report.penetration == 0.0


@pytest.mark.parametrize("length", [100.0, 150.0, 200.0, 250.0])
@pytest.mark.parametrize("seed", range(4))
def test_halls_with_pillars_are_passed(seed, length):
    maze = clutter_hall(seed)
    result = plan(maze, ArmSpec(link_length=length), planner="track")
    assert result.solved, result.reason


@pytest.mark.parametrize("length", [150.0, 350.0, 420.0])
def test_round_bends_of_many_short_walls_are_passed(length):
    angle = np.linspace(np.pi, 0.0, 120)
    bend = 300.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    maze = Maze.from_corridors(np.vstack([[(-300.0, -900.0)], bend, [(300.0, -900.0)]]), 150.0)
    result = plan(maze, ArmSpec(link_length=length), planner="track")
    assert result.solved, result.reason


def test_links_longer_than_any_rod_that_passes_end_with_a_place_and_a_reason():
    # No rod longer than 440 passes: it must lie across both legs and the wall at some moment.
    candidate = plan_track(Query(maze=fig19(), arm=ArmSpec(link_length=445.0)))
    assert candidate.status is PlanningStatus.DEAD_END and candidate.motion is None
    assert candidate.reason.startswith("The joint track is not free near")
    x, y = candidate.failure.place
    assert -100 <= x <= 340 and 900 <= y <= 1600


def test_a_deadline_that_has_passed_ends_planning():
    candidate = plan_track(Query(maze=fig19(), arm=ArmSpec(link_length=439.0), deadline=0.0))
    assert candidate.status is PlanningStatus.OUT_OF_TIME and candidate.failure is not None


@pytest.fixture(scope="module")
def solved_hall():
    """Return a clutter hall and a motion of links of 200 in it."""
    maze = clutter_hall(0)
    return maze, plan(maze, ArmSpec(link_length=200.0), planner="track").motion


def assert_warm_start_solves(maze, motion):
    """Check that the motion is a start from which no survey of the maze is needed."""
    query = Query(maze=maze, arm=ArmSpec(link_length=200.0), warm_start=motion)
    candidate = plan_track(query)
    assert candidate.status is PlanningStatus.SOLVED
    assert "geometry" not in vars(query)
    assert list(candidate.timings) == ["plan", "poses"]
    assert validate(candidate.motion, maze).valid


@pytest.mark.parametrize("degrees", [100.0, 180.0, 260.0])
def test_a_warm_start_follows_a_goal_that_moves_by_a_link(solved_hall, degrees):
    maze, motion = solved_hall
    angle = math.radians(degrees)
    moved = maze.goal + 200.0 * np.array([math.cos(angle), math.sin(angle)])
    assert_warm_start_solves(dataclasses.replace(maze, goal=moved), motion)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("share", [0.35, 0.6, 0.8])
def test_a_warm_start_goes_round_a_pillar_that_comes_20_px_into_its_way(solved_hall, side, share):
    maze, motion = solved_hall
    tips = motion.joints[:, -1]
    k = int(share * len(tips))
    along = tips[k + 2] - tips[k - 2]
    x, y = tips[k] + side * 10.0 * np.array([-along[1], along[0]]) / np.hypot(*along)
    free = maze.free_space.difference(box(x - 30.0, y - 30.0, x + 30.0, y + 30.0))
    assert_warm_start_solves(dataclasses.replace(maze, free_space=free), motion)


def test_a_warm_start_that_does_not_fit_falls_back_to_the_path():
    motion = plan(Maze.load("L"), ArmSpec(link_length=300.0), planner="track").motion
    query = Query(maze=Maze.load("U200"), arm=ArmSpec(link_length=300.0), warm_start=motion)
    candidate = plan_track(query)
    assert candidate.status is PlanningStatus.SOLVED
    assert validate(candidate.motion, query.maze).valid
