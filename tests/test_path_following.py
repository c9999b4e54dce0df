"""Laws of path following: link ends on the path, exact chords, and what becomes of links too long for it."""

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from planners import PlanningStatus, plan, validate
from planners.baselines.path_following import JOIN, followed_track, plan_path_following
from planners.query import Query

SHORT = [("fig19", 150.0), ("L", 250.0), ("U200", 250.0), ("S0", 330.0), ("S400", 240.0), ("zig3", 130.0),
         ("stairs", 240.0), ("fig17a", 80.0), ("clutter-3", 70.0)]  # fmt: skip
"""Mazes, and links short enough to follow the path there."""


def followed(maze, length, **arm):
    """Return query and candidate."""
    query = Query(maze=maze, arm=ArmSpec(link_length=length, **arm))
    return query, plan_path_following(query)


@pytest.mark.parametrize(("name", "length"), SHORT)
def test_short_links_pass(name, length):
    result = plan(Maze.load(name), ArmSpec(link_length=length), planner="follow")
    assert result.solved, result.reason


@pytest.mark.parametrize("length", [30.0, 60.0, 90.0, 120.0, 150.0])
def test_shorter_links_pass_the_benchmark_too(length):
    result = plan(fig19(), ArmSpec(link_length=length), planner="follow")
    assert result.solved, result.reason


@pytest.mark.parametrize(("name", "length"), [*SHORT, ("fig19", 200.0), ("L", 500.0), ("S200", 430.0)])
def test_link_ends_lie_on_the_path(name, length):
    query, candidate = followed(Maze.load(name), length)
    every = max(1, candidate.motion.n_poses // 1000)
    maze, joints = query.maze, candidate.motion.joints[::every]
    heading = np.array([np.cos(maze.base_pose[2]), np.sin(maze.base_pose[2])])
    ahead = (joints - maze.base_pose[:2]) @ heading
    aside = (joints - maze.base_pose[:2]) @ (-heading[1], heading[0])
    on_axis = (np.abs(aside) <= 1e-9 * length) & (ahead <= (1.0 + 1e-9) * length)
    # From the axis a straight step leads to a point of the path.
    path = query.geometry.path
    joined = (1.0 + JOIN) * length + np.diff(path.s).max()
    near = np.hypot(*(joints - maze.base_pose[:2]).transpose(2, 0, 1)) < joined
    points = joints[~on_axis & ~near]
    assert len(points) > 100
    line = LineString(path.points)
    shapely.prepare(line)
    assert shapely.distance(line, shapely.points(points)).max() <= 1e-9 * length


@pytest.mark.parametrize(("name", "length"), SHORT)
def test_links_are_exact_and_the_arm_only_advances(name, length):
    _, candidate = followed(Maze.load(name), length)
    motion = candidate.motion
    lengths = np.hypot(*np.diff(motion.joints, axis=1).transpose(2, 0, 1))
    np.testing.assert_allclose(lengths, length, rtol=1e-9)
    assert (np.diff(motion.feed) >= -1e-9 * length).all()
    assert motion.feed[-1] > motion.feed[0]


@pytest.mark.parametrize(("name", "length"), SHORT)
def test_the_arm_comes_straight_out_of_the_feeder_and_stops_in_the_goal(name, length):
    query, candidate = followed(Maze.load(name), length)
    maze, joints = query.maze, candidate.motion.joints
    np.testing.assert_allclose(joints[0, -1], maze.base_pose[:2], atol=1e-9)
    away = np.hypot(*(joints[:, -1] - maze.goal).T)
    assert away[-1] <= 0.5 * maze.goal_radius < away[-2] + 0.05 * length
    assert {fault.kind for fault in validate(candidate.motion, maze).faults} == set()


def test_links_too_long_for_the_benchmark_get_deeper_into_its_wall():
    lengths, depths = (155.0, 160.0, 165.0, 170.0, 175.0, 180.0), []
    for length in lengths:
        _, candidate = followed(fig19(), length)
        depths.append(validate(candidate.motion, fig19()).penetration)
        result = plan(fig19(), ArmSpec(link_length=length), planner="follow", explain=False)
        if depths[-1] > 0.0:
            assert result.status is PlanningStatus.NOT_VALID and "deep in a wall" in result.reason
            assert result.failure.depth == depths[-1]
            np.testing.assert_allclose(result.place, (120.0, 1400.0), atol=25.0)  # the wall's end
    assert depths[0] == 0.0 < depths[1] and depths == sorted(depths)
    assert depths[-1] > 15.0


def test_links_longer_than_the_legs_are_apart_would_drive_the_arm_back():
    # The legs are 240 apart: the tip goes down one and the link's other end, for longer links, the other.
    for length in (250.0, 430.0):
        result = plan(fig19(), ArmSpec(link_length=length), planner="follow", explain=False)
        assert result.status is PlanningStatus.DEAD_END and "go back along the path" in result.reason
        assert 0.0 < result.place[0] < 240.0 and result.place[1] > 1390.0
        np.testing.assert_allclose(result.failure.joints[-1], result.place)


def test_a_joint_that_would_jump_is_a_dead_end_with_a_place():
    # Behind the base there is no path: from the axis the tip would have to turn back into its first link.
    maze = Maze.from_corridors([(0, 0), (0, 1500)], 200.0, goal=(40.0, 165.0))
    result = plan(maze, ArmSpec(link_length=300.0), planner="follow", explain=False)
    assert result.status is PlanningStatus.DEAD_END and "jump along the path" in result.reason
    np.testing.assert_allclose(result.place, (0.0, 305.0), atol=1e-9)


def test_joint_limits_are_left_to_the_checker():
    free = plan(fig19(), ArmSpec(link_length=120.0), planner="follow").motion
    largest = np.abs(free.joint_angles).max()
    for limit, status in ((1.01, PlanningStatus.SOLVED), (0.99, PlanningStatus.NOT_VALID)):
        arm = ArmSpec(link_length=120.0, joint_limit=limit * largest)
        assert plan(fig19(), arm, planner="follow", explain=False).status is status


def test_a_goal_on_the_axis_is_reached_with_the_first_link():
    maze = Maze.from_corridors([(0, 0), (0, 1500)], 200.0, goal=(8.0, 205.0))
    result = plan(maze, ArmSpec(link_length=300.0), planner="follow")
    assert result.solved and result.motion.n_links == 1
    np.testing.assert_allclose(result.motion.joints[-1, -1], (0.0, 205.0), atol=1e-9)


def test_the_track_is_the_axis_a_step_and_the_path():
    path = np.column_stack([np.full(41, 3.0), np.arange(41.0)])
    path[0] = 0.0, 0.0
    track = followed_track(path, 10.0, np.array([0.0, 0.0, np.pi / 2]), np.array([3.0, 40.0]), 1.5)
    np.testing.assert_allclose(track[:3], [(0, 0), (0, 10), (0, 10)], atol=1e-12)
    np.testing.assert_array_equal(track[4:], path[15:40])


def test_planning_twice_gives_the_same_motion():
    once, again = (followed(fig19(), 140.0)[1].motion for _ in range(2))
    np.testing.assert_array_equal(once.joints, again.joints)
    np.testing.assert_array_equal(once.joint_angles, again.joint_angles)


def test_the_stages_are_timed():
    result = plan(fig19(), ArmSpec(link_length=140.0), planner="follow")
    assert list(result.timings) == ["potential", "path", "beams", "plan", "poses", "validate"]
    assert all(seconds > 0.0 for seconds in result.timings.values())
