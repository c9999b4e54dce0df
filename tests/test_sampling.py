"""Sampling planners: what their states and edges mean, how goals are grown, and what OMPL makes of it."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, MultiLineString, Point

from hrsnake_env.arm import ArmSpec, joints_from_configuration
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import PLANNERS, plan
from planners.baselines import ompl_sampling
from planners.baselines.fed_states import MARGIN, fed_arm
from planners.baselines.goal_states import grown_goal_states, guide_along
from planners.baselines.ompl_sampling import plan_aorrtc, plan_ompl, plan_rrt_connect
from planners.kernels.fed_growth import free_directions
from planners.kernels.fed_shortcut import path_length
from planners.query import Query
from planners.validation import validate

MAZE = Maze.from_corridors([(0, 0), (0, 600), (240, 600), (240, 300)], 200.0)
LENGTH = 220.0
ARM = fed_arm(MAZE, LENGTH, 0.0, None)
STATES = st.tuples(st.floats(0.0, 4.0), *[st.floats(-3.0, 3.0)] * 3).map(np.array)
LIGHT = settings(max_examples=20)


def guide_in(maze, link_length, link_radius=0.0):
    geometry = Query(maze=maze, arm=ArmSpec(link_length=link_length, link_radius=link_radius)).geometry
    return guide_along(geometry.path.points, maze.goal, maze.goal_radius, link_length)


def goal_states(arm=ARM, maze=MAZE, number=6, seed=0):
    """Grow goal states in a maze."""
    guide = guide_in(maze, arm.link_length)
    return grown_goal_states(arm, guide, number, np.random.default_rng(seed))[0]


def in_front(joints, feed, length, base):
    """Return the arm in front of the base as a line."""
    past = feed - (len(joints) - 1 - np.arange(len(joints))) * length > 1e-9
    return LineString([base, *(joints[past] if past.any() else [base])])


def walk(rng, steps=12):
    """Return a path of free edges from a straight arm, found at random."""
    path = [np.zeros(4), np.array([1.5, 0.0, 0.0, 0.0])]
    for _ in range(2000):
        if len(path) == steps:
            break
        state = path[-1] + rng.normal(scale=0.3, size=4)
        state[0] = min(max(state[0], 0.0), 4.0)
        if ARM.edge_is_clear(path[-1], state):
            path.append(state)
    return np.array(path)


@LIGHT
@given(STATES)
def test_a_state_places_the_arm_as_the_environment_does(state):
    motion = ARM.motion(np.array([state, state]))
    joints = joints_from_configuration(motion.feed[-1], motion.joint_angles[-1], LENGTH, MAZE.base_pose)
    assert ARM.tip(state) == pytest.approx(joints[-1], abs=1e-6)
    past = state[0] - (4 - np.arange(4))
    assert (motion.joint_angles[-1][past <= 0.0] == 0.0).all()


@LIGHT
@given(STATES)
def test_a_state_is_clear_when_the_arm_keeps_its_margin_and_does_not_meet_itself(state):
    motion = ARM.motion(np.array([state, state]))
    line = in_front(motion.joints[-1], motion.feed[-1], LENGTH, MAZE.base_pose[:2])
    inside, off = line.within(MAZE.free_space), line.distance(MAZE.free_space.boundary)
    if ARM.is_clear(state):
        assert inside and line.is_simple
    elif inside and off > 2.0 * MARGIN * LENGTH and state[0] > 0.0:
        links = [LineString(pair) for pair in zip(line.coords[:-1], line.coords[1:], strict=True)]
        pairs = [links[k].distance(links[j]) for k in range(len(links)) for j in range(k + 2, len(links))]
        assert min(pairs) < 3.0 * MARGIN * LENGTH


@LIGHT
@given(STATES, STATES)
def test_an_edge_keeps_the_checkers_step_limit_and_the_feeders_rule(a, b):
    report = validate(ARM.motion(np.array([np.zeros(4), a, b])), MAZE)
    assert not {"step", "feeder", "release", "start", "length", "inconsistent"} & {
        fault.kind for fault in report.faults
    }


def test_poses_are_the_same_on_the_way_back():
    a, b = np.array([0.7, 0.2, -0.4, 0.3]), np.array([3.3, 0.5, 0.4, -0.9])
    there, back = (ARM.motion(np.array(pair)) for pair in ([a, b], [b, a]))
    np.testing.assert_allclose(there.joints, back.joints[::-1], atol=1e-9)


@LIGHT
@given(st.integers(0, 10_000))
def test_an_edge_that_is_said_to_be_clear_is_so_at_many_places(seed):
    path = walk(np.random.default_rng(seed), steps=4)
    assume(len(path) == 4)
    motion = ARM.motion(path[2:])
    for share in (0.0, 0.25, 0.5, 0.75):  # between poses feed and angles change linearly
        feed = motion.feed[:-1] + share * np.diff(motion.feed)
        angles = motion.joint_angles[:-1] + share * np.diff(motion.joint_angles, axis=0)
        for f, joints in zip(
            feed, joints_from_configuration(feed, angles, LENGTH, MAZE.base_pose), strict=True
        ):
            line = in_front(joints, f, LENGTH, MAZE.base_pose[:2])
            assert line.within(MAZE.free_space) and line.is_simple


@LIGHT
@given(st.integers(0, 10_000))
def test_an_edge_that_keeps_well_off_everything_is_clear(seed):
    rng = np.random.default_rng(seed)
    a = np.array([3.0, 0.0, 0.0, 0.0]) + rng.normal(scale=0.15, size=4)
    b = a + rng.normal(scale=0.1, size=4)
    motion = ARM.motion(np.array([a, b]))
    lines = [
        in_front(joints, feed, LENGTH, MAZE.base_pose[:2])
        for joints, feed in zip(motion.joints, motion.feed, strict=True)
    ]
    front = [LineString(line.coords[1:]) for line in lines]  # the base is near the wall behind it
    off = min(line.distance(MAZE.free_space.boundary) for line in front)
    assume(all(line.within(MAZE.free_space) for line in lines) and off > 0.03 * LENGTH)
    assert ARM.edge_is_clear(a, b)


def test_an_edge_through_a_thin_wall_is_not_clear():
    # Both ends are free; between them the last link sweeps through the wall between the legs.
    thin = Maze.from_corridors([(0, 0), (0, 600), (201, 600), (201, 300)], 200.0)
    arm = fed_arm(thin, LENGTH, 0.0, None)
    a, b = np.array([2.0, 0.3]), np.array([2.0, -1.57])
    assert arm.is_clear(a) and not arm.edge_is_clear(a, b)


def test_the_start_is_clear_and_the_edge_into_the_wall_is_not():
    start, straight, through = np.zeros(4), np.array([2.5, 0, 0, 0]), np.array([3.5, 1.5, 0, 0])
    assert ARM.edge_is_clear(start, straight)
    assert not ARM.edge_is_clear(straight, through)


@LIGHT
@given(st.floats(-80.0, 80.0), st.floats(20.0, 680.0), st.floats(-3.0, 3.0))
def test_free_directions_are_those_in_which_a_link_meets_no_wall(x, y, heading):
    place, walls = np.array([x, y]) / LENGTH, MAZE.walls / LENGTH
    ranges = free_directions(place, heading, 3.0, walls)
    lines = MultiLineString([list(map(tuple, wall)) for wall in walls])
    for angle in np.linspace(-3.0, 3.0, 121):
        tip = place + np.array([math.cos(heading + angle), math.sin(heading + angle)])
        ends = np.abs(ranges - angle)
        if ends.size and ends.min() < 1e-6:
            continue  # an end may be read either way
        free = not LineString([place, tip]).intersects(lines)
        assert free == any(low <= angle <= high for low, high in ranges)


@pytest.mark.parametrize("length", [120.0, 220.0, 300.0])
def test_grown_arms_are_free_at_the_goal_and_out_of_the_feeder_as_its_rule_says(length):
    arm = fed_arm(MAZE, length, 0.0, None)
    states = goal_states(arm)
    assert states and len({len(state) for state in states}) == 1
    for state in states:
        motion = arm.motion(np.array([state, state]))
        joints, feed = motion.joints[-1], motion.feed[-1]
        line = in_front(joints, feed, length, MAZE.base_pose[:2])
        assert line.within(MAZE.free_space) and line.is_simple
        assert math.dist(joints[-1], MAZE.goal) < MAZE.goal_radius
        assert {fault.kind for fault in validate(motion, MAZE).faults} == {"start"}


def test_as_few_links_are_grown_as_reach_the_goal_in_a_straight_corridor():
    maze = Maze.from_corridors([(0, 0), (0, 1000)], 100.0, goal=(0.0, 700.0))
    away = 700.0 - maze.base_pose[1]
    for length in (100.0, 230.0, 400.0, 690.0):
        (state, *_) = goal_states(fed_arm(maze, length, 0.0, None), maze)
        assert len(state) == math.ceil((away - maze.goal_radius) / length)


def test_grown_arms_keep_the_joint_limit():
    free = np.abs(np.array(goal_states())[:, 1:]).max()
    limited = goal_states(fed_arm(MAZE, LENGTH, 0.0, 0.9 * free))
    assert limited and np.abs(np.array(limited)[:, 1:]).max() <= 0.9 * free


def test_grown_thick_arms_keep_off_themselves_and_the_walls():
    query = Query(maze=MAZE, arm=ArmSpec(link_length=LENGTH, link_radius=15.0))
    states = goal_states(fed_arm(query.geometry.maze, LENGTH, 15.0, None))
    assert states
    for state in states:
        motion = ARM.motion(np.array([state, state]))
        line = in_front(motion.joints[-1], motion.feed[-1], LENGTH, MAZE.base_pose[:2])
        out = line.difference(Point(MAZE.base_pose[:2]).buffer(30.0))  # the feeder comes through a wall
        assert out.distance(MAZE.free_space.boundary) >= 15.0


def test_links_too_long_to_stand_between_two_bends_do_not_grow_to_the_goal():
    sharp = Maze.from_corridors([(0, 0), (0, 600), (150, 600), (150, 1000)], 60.0)
    arm = fed_arm(sharp, 250.0, 0.0, None)
    states, farthest = grown_goal_states(arm, guide_in(sharp, 250.0), 4, np.random.default_rng(0))
    assert states == []
    np.testing.assert_allclose(np.hypot(*np.diff(farthest[1:], axis=0).T), 250.0)


def test_the_same_seed_grows_the_same_arms():
    one, same, other = (np.array(goal_states(seed=seed)) for seed in (1, 1, 2))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


@LIGHT
@given(st.integers(0, 10_000))
def test_shortcuts_shorten_a_path_keep_its_ends_and_leave_it_free(seed):
    rng = np.random.default_rng(seed)
    path = walk(rng)
    short = ARM.shortened(path, rng, 10.0)
    assert path_length(short) <= path_length(path) * (1.0 + 1e-12)
    assert np.array_equal(short[[0, -1]], path[[0, -1]])
    assert {fault.kind for fault in validate(ARM.motion(short), MAZE).faults} <= {"goal"}


def test_a_detour_becomes_a_straight_edge():
    detour = np.array([[0.0, 0, 0, 0], [1.0, 0, 0, 0], [1.5, 0.8, 0.5, 0.2], [2.0, 0, 0, 0]])
    short = ARM.shortened(detour, np.random.default_rng(0), 10.0)
    assert path_length(short) < 0.8 * path_length(detour)


def test_bad_questions_to_the_sampling_planners_are_refused():
    with pytest.raises(InputError, match=r"Unknown OMPL planner 'Dijkstra'\. Available: KPIECE1"):
        plan_ompl(Query(maze=MAZE, arm=ArmSpec(link_length=LENGTH)), algorithm="Dijkstra")


@pytest.mark.parametrize("planner", ["rrt-connect", "aorrtc"])
def test_without_ompl_it_is_said_how_to_install_it(monkeypatch, planner):
    ompl_sampling.warm_up.cache_clear()
    monkeypatch.setattr(ompl_sampling, "is_installed", lambda: False)
    with pytest.raises(InputError, match=r"pip install 'hrsnake\[bench\]'"):
        plan(MAZE, ArmSpec(link_length=LENGTH), planner)


@pytest.mark.parametrize("planner", ["rrt-connect", "aorrtc"])
@pytest.mark.parametrize("arm", [{}, {"link_radius": 10.0}, {"joint_limit": 1.7}])
def test_what_a_sampling_planner_finds_is_valid(planner, arm):
    pytest.importorskip("ompl")
    result = plan(MAZE, ArmSpec(link_length=LENGTH, **arm), planner, explain=False)
    assert result.solved, result.reason
    assert set(result.timings) >= {"potential", "grow", "plan", "shortcut", "poses", "validate"}


def test_a_second_seed_in_a_process_is_no_error(capfd):
    pytest.importorskip("ompl")
    query = [Query(maze=MAZE, arm=ArmSpec(link_length=LENGTH), seed=seed) for seed in (0, 1, 2**40)]
    assert all(PLANNERS["rrt-connect"](q).motion is not None for q in query)
    assert capfd.readouterr() == ("", "")


def test_planning_goes_on_with_a_wider_margin_when_the_checker_refuses():
    pytest.importorskip("ompl")
    asked = []

    def checker(motion):
        asked.append(motion)
        start = validate(motion, MAZE)
        wrong = validate(motion, Maze.load("fig19")) if len(asked) == 1 else start
        assert start.valid
        return wrong

    result = plan_rrt_connect(Query(maze=MAZE, arm=ArmSpec(link_length=LENGTH), checker=checker))
    assert result.status == "solved" and len(asked) == 2 and result.motion is asked[1]


def test_a_sampling_planner_that_runs_out_of_time_says_so():
    pytest.importorskip("ompl")
    long = Maze.from_corridors([(0, 0), (0, 3000), (240, 3000), (240, 300)], 200.0)
    candidate = plan_aorrtc(Query(maze=long, arm=ArmSpec(link_length=400.0), deadline=0.0))
    assert candidate.motion is None and candidate.status == "out of time"
    assert candidate.reason.endswith(".") and candidate.failure is not None
