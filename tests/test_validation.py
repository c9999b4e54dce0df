"""Planted faults must be named, good motions must pass, and bounds must bound what dense sampling finds."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import LineString, Polygon, box

from hrsnake_env.arm import ArmSpec, joints_from_configuration
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import validation
from planners.checks.gaps import depths_from_gaps, segment_distances, segment_gaps
from planners.checks.scene import Scene
from planners.checks.sieve import SPAN, Sifted, sift
from planners.problem import Motion
from planners.validation import FAULTS, PINCH_TOLERANCE, STEP_LIMIT, validate

LENGTH = 60.0


# Motions built by hand


def track_motion(track, length, n_links, tips, base_pose):
    """Lay an arm on a track from the base: every joint on it, each a link length behind the next."""

    def behind(s):
        near, far = s - length, s - 1.6 * length
        for _ in range(60):
            middle = (near + far) / 2.0
            beyond = np.linalg.norm(track(middle) - track(s), axis=1) >= length
            near, far = np.where(beyond, near, middle), np.where(beyond, middle, far)
        return np.where(s <= length, s - length, far)

    places = [np.asarray(tips)]
    for _ in range(n_links):
        places.append(behind(places[-1]))
    joints = np.stack([track(s) for s in places[::-1]], axis=1)
    return Motion.from_joints(joints, length, base_pose)


@cache
def bend():
    """Build an L-bend 200 wide and a motion of short links round it, on an arc of radius 150."""
    maze = Maze.from_corridors([(0, 0), (0, 900), (900, 900)], 200.0, base_offset=120.0)
    radius, straight = 150.0, 900.0 - 120.0 - 150.0

    def track(s):
        turn = np.clip((s - straight) / radius, 0.0, math.pi / 2)
        x = radius * (1.0 - np.cos(turn)) + np.maximum(s - straight - radius * math.pi / 2, 0.0)
        return np.stack([x, 120.0 + np.minimum(s, straight) + radius * np.sin(turn)], axis=1)

    tips = np.linspace(0.0, straight + radius * math.pi / 2 + 650.0, 760)
    n_links = math.ceil(tips[-1] / LENGTH) + 1
    return maze, track_motion(track, LENGTH, n_links, tips, maze.base_pose)


def straight_in(maze, length, n_links, feed):
    """Push a straight arm in, to a given feed."""
    feeds = np.linspace(0.0, feed, math.ceil(feed / (0.04 * length)) + 1)
    return Motion.from_configurations(feeds, np.zeros((len(feeds), n_links)), length, maze.base_pose)


def then(motion, angles):
    """Append poses with the last feed and given joint angles, shape (n, n_links)."""
    return Motion.from_configurations(
        np.concatenate([motion.feed, np.full(len(angles), motion.feed[-1])]),
        np.concatenate([motion.joint_angles, angles]),
        motion.link_length,
        motion.base_pose,
    )


def corridor(width=200.0, base_offset=150.0, length=1000.0):
    return Maze.from_corridors(
        [(0, 0), (length, 0)], width, base_offset=base_offset, goal=(length - 200.0, 0), goal_radius=5.0
    )


def hall(*obstacles, goal=(300.0, 0.0)):
    """Build a hall with the base at (0, 0), heading along x."""
    free = box(-400, -400, 800, 400)
    for obstacle in obstacles:
        free = free.difference(obstacle)
    return Maze(name="hall", free_space=free, base_pose=np.zeros(3), goal=np.array(goal), goal_radius=5.0)


def fault(report, kind):
    found = [one for one in report.faults if one.kind == kind]
    assert len(found) == 1, f"wanted one fault '{kind}', got {report.faults}"
    return found[0]


def kinds(report):
    return {one.kind for one in report.faults}


# What is good passes


def test_a_motion_round_a_bend_is_valid():
    maze, motion = bend()
    report = validate(motion, maze)
    assert report.valid, report.faults
    assert report.penetration == 0.0
    assert report.penetration_between <= PINCH_TOLERANCE * LENGTH / 8
    assert report.length_error < 1e-9 * LENGTH
    assert 1.0 < report.largest_step < STEP_LIMIT * LENGTH
    assert report.goal_distance < 25.0


def test_links_that_stay_in_the_feeder_change_nothing():
    maze, motion = bend()
    longer = Motion.from_configurations(
        motion.feed, np.pad(motion.joint_angles, ((0, 0), (3, 0))), LENGTH, motion.base_pose
    )
    one, other = validate(motion, maze), validate(longer, maze)
    assert other.valid
    assert other.clearance == pytest.approx(one.clearance, abs=1e-9)


def test_a_motion_is_as_free_backward_as_forward():
    maze, motion = bend()
    back = Motion.from_configurations(motion.feed[::-1], motion.joint_angles[::-1], LENGTH, motion.base_pose)
    assert kinds(validate(back, maze)) == {"start", "goal"}


def test_clearance_of_a_straight_arm_is_half_the_corridor_less_the_radius():
    maze = corridor(width=200.0, base_offset=150.0)
    motion = straight_in(maze, 100.0, 8, 650.0)
    report = validate(motion, maze)
    assert report.valid
    assert report.clearance == pytest.approx(100.0, abs=1e-9)
    thick = validate(motion, maze, ArmSpec(link_length=100.0, link_radius=30.0))
    assert thick.valid, thick.faults
    assert thick.clearance == pytest.approx(70.0, abs=1e-9)


def test_touching_a_wall_is_no_penetration():
    maze = replace(corridor(), base_pose=np.array([150.0, 0.0, 0.0]))
    pillar = box(300, 0, 700, 40)  # the arm slides along its lower side
    maze = replace(maze, free_space=maze.free_space.difference(pillar))
    report = validate(straight_in(maze, 100.0, 8, 650.0), maze)
    assert report.valid, report.faults
    assert report.clearance == 0.0


def test_the_wall_that_the_feeder_comes_through_does_not_count_for_thick_links():
    maze = corridor(width=200.0, base_offset=5.0)
    motion = straight_in(maze, 150.0, 7, 795.0)
    report = validate(motion, maze, ArmSpec(link_length=150.0, link_radius=50.0))
    assert report.valid, report.faults
    # A joint counts from a radius past the base on, so from 50 + 5 before the wall; poses are at 6 or less.
    assert 5.0 <= report.clearance <= 11.0


def test_progress_rises_to_one():
    maze, motion = bend()
    told = []
    validate(motion, maze, progress=lambda stage, share: told.append((stage, share)))
    assert {stage for stage, _ in told} == {"validate"}
    shares = [share for _, share in told]
    assert len(shares) > 5
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_one_pose_is_checked_too():
    maze = corridor()
    motion = Motion.from_configurations([0.0], np.zeros((1, 3)), 100.0, maze.base_pose)
    report = validate(motion, maze)
    assert kinds(report) == {"goal"}
    assert report.largest_step == 0.0
    assert report.penetration_between == 0.0


# What is not good is named


def planted(change, pose):
    """Change the joints of a pose of the motion round the bend; the configuration stays."""
    maze, motion = bend()
    joints = motion.joints.copy()
    joints[pose] = change(joints[pose])
    return validate(replace(motion, joints=joints), maze)


def test_a_stretched_link_is_a_fault():
    pose, link, stretch = 400, 25, 1e-7 * LENGTH

    def change(joints):
        along = (joints[link + 1] - joints[link]) / LENGTH
        joints[link + 1 :] += stretch * along
        return joints

    found = fault(planted(change, pose), "length")
    assert (found.pose, found.link) == (pose, link)
    assert found.amount == pytest.approx(stretch, abs=1e-11)


def test_joints_that_are_not_those_of_the_configuration_are_a_fault():
    report = planted(lambda joints: joints + np.array([0.0, 1e-5 * LENGTH]), 300)
    found = fault(report, "inconsistent")
    assert found.pose == 300
    assert found.amount == pytest.approx(1e-5 * LENGTH, rel=1e-6)


def turned(pose, link, angle):
    """Turn two links of the bend's motion at one pose: only the joint between them leaves its place."""
    maze, motion = bend()
    angles = motion.joint_angles.copy()
    angles[pose, link : link + 3] += np.array([1.0, -2.0, 1.0]) * angle
    return maze, Motion.from_configurations(motion.feed, angles, LENGTH, motion.base_pose)


def test_a_link_off_the_axis_of_the_feeder_is_a_fault():
    maze, motion = turned(200, 3, 1e-4)
    found = fault(validate(motion, maze), "feeder")
    assert found.pose == 200
    assert found.link in (3, 4)
    assert found.amount == pytest.approx(LENGTH * math.sin(1e-4), rel=1e-6)


def test_a_link_is_held_until_a_pose_at_which_its_base_side_joint_has_passed():
    maze, motion = bend()
    behind = motion.feed - (motion.n_links - 15) * LENGTH < -1e-6
    last = int(np.flatnonzero(behind)[-1])
    for pose, held in ((last, True), (last + 1, True), (last + 2, False)):
        report = validate(turned(pose, 15, 1e-4)[1], maze)
        assert ("feeder" in kinds(report)) is held, pose


@pytest.mark.parametrize(("excess", "faulty"), [(-1e-3, False), (1e-3, True)])
def test_a_joint_that_bends_faster_than_the_feeder_lets_go_of_it_is_a_fault(excess, faulty):
    # 1 px past the base, the feeder lets a joint of links of 100 px bend by 16 * 0.01 rad.
    maze = corridor(length=2000.0)
    motion = straight_in(maze, 100.0, 8, 201.0)
    angles = motion.joint_angles.copy()
    angles[-1, 6] = 0.16 + excess
    found = validate(Motion.from_configurations(motion.feed, angles, 100.0, motion.base_pose), maze)
    assert ("release" in kinds(found)) is faulty
    if faulty:
        assert fault(found, "release").link == 6
        assert fault(found, "release").amount == pytest.approx(excess)


def test_a_rear_joint_that_leaves_the_axis_is_a_fault():
    report = planted(lambda joints: joints + np.array([0.01, 0.0]), 759)
    found = fault(report, "feeder")
    assert (found.pose, found.link) == (759, 0)
    assert found.amount == pytest.approx(0.01, rel=1e-6)


@pytest.mark.parametrize(("feed", "amount"), [(801.0, 1.0), (-3.0, 3.0)])
def test_a_feed_beyond_the_arm_is_a_fault(feed, amount):
    maze = corridor(length=2000.0)
    motion = straight_in(maze, 100.0, 8, 800.0)
    feeds = motion.feed.copy()
    feeds[7] = feed
    beyond = Motion.from_configurations(feeds, motion.joint_angles, 100.0, motion.base_pose)
    found = fault(validate(beyond, maze), "feeder")
    assert found.pose == 7
    assert found.amount == pytest.approx(amount)


def sliced(motion, rows):
    return Motion.from_configurations(
        motion.feed[rows], motion.joint_angles[rows], motion.link_length, motion.base_pose
    )


def test_a_motion_that_does_not_start_in_the_feeder_is_a_fault():
    maze, motion = bend()
    report = validate(sliced(motion, np.arange(1, motion.n_poses)), maze)
    assert kinds(report) == {"start"}
    assert fault(report, "start").amount == pytest.approx(motion.feed[1])


def test_a_motion_that_ends_before_the_goal_is_a_fault():
    maze, motion = bend()
    report = validate(sliced(motion, np.arange(motion.n_poses - 60)), maze)
    assert kinds(report) == {"goal"}
    gap = np.linalg.norm(motion.joints[-61, -1] - maze.goal)
    assert fault(report, "goal").amount == report.goal_distance == pytest.approx(gap)


@pytest.mark.parametrize("dropped", [1, 10])
def test_dropped_poses_are_a_step_too_long(dropped):
    maze, motion = bend()
    rows = np.delete(np.arange(motion.n_poses), np.arange(501, 501 + dropped))
    report = validate(sliced(motion, rows), maze)
    found = fault(report, "step")
    assert found.pose == 500
    moves = np.linalg.norm(motion.joints[501 + dropped] - motion.joints[500], axis=1)
    assert found.amount == report.largest_step == pytest.approx(moves.max())
    assert found.amount > STEP_LIMIT * LENGTH


def test_a_joint_beyond_its_limit_is_a_fault():
    maze, motion = bend()
    largest = np.abs(motion.joint_angles).max()
    assert validate(motion, maze, ArmSpec(link_length=LENGTH, joint_limit=largest)).valid
    report = validate(motion, maze, ArmSpec(link_length=LENGTH, joint_limit=largest - 1e-6))
    assert kinds(report) == {"joint limit"}
    found = fault(report, "joint limit")
    assert abs(motion.joint_angles[found.pose, found.link]) == found.amount == largest


@pytest.mark.parametrize("depth", [1e-9, 0.03, 15.0])
def test_the_depth_past_a_flat_wall_is_how_far_past_it_the_link_is(depth):
    length = 420.0
    angle = math.asin((400.0 + depth) / length)
    motion = Motion.from_configurations([0.0, 2 * length], [[0.0, 0.0], [0.0, angle]], length, np.zeros(3))
    report = validate(motion, hall())
    found = fault(report, "penetration")
    assert (found.pose, found.link) == (1, 1)
    assert found.amount == report.penetration == -report.clearance
    assert found.amount == pytest.approx(depth, abs=1e-12, rel=1e-6)
    assert found.place == pytest.approx((length + length * math.cos(angle), 400.0 + depth))
    assert report.penetration_between >= report.penetration


def cut_corner(gap):
    """Push an arm at 45 degrees past a square corner that reaches `gap` beyond its line."""
    free = box(-300, -300, 300, 300).difference(box(0, -300, 300, 0))
    along, across = np.array([1.0, 1.0]) / math.sqrt(2), np.array([1.0, -1.0]) / math.sqrt(2)
    base, goal = gap * across - 200.0 * along, gap * across + 150.0 * along
    maze = Maze(
        name="corner", free_space=free, base_pose=np.array([*base, math.pi / 4]), goal=goal, goal_radius=5.0
    )
    return maze, straight_in(maze, 100.0, 4, 350.0)


@pytest.mark.parametrize("gap", [0.01, 1.0, 40.0])
def test_the_depth_over_a_square_corner_is_that_of_the_farthest_point_of_the_link(gap):
    maze, motion = cut_corner(gap)
    report = validate(motion, maze)
    assert kinds(report) == {"penetration"}
    found = fault(report, "penetration")
    assert found.amount == pytest.approx(gap / math.sqrt(2), abs=1e-4)
    assert found.place == pytest.approx(gap * np.array([1.0, -1.0]) / math.sqrt(2), abs=1e-3)


def test_a_link_that_just_misses_a_square_corner_is_free():
    maze, motion = cut_corner(-1e-3)
    report = validate(motion, maze)
    assert report.valid, report.faults
    assert report.clearance == pytest.approx(1e-3, abs=1e-9)


def test_a_corner_cut_at_one_pose_is_found_there():
    maze, motion = bend()
    corner, joints = shapely.Point(100.0, 800.0), motion.joints[430]
    links = [LineString(joints[k : k + 2]) for k in range(motion.n_links)]
    link = int(np.argmin(shapely.distance(links, corner)))
    gap = np.diff(shapely.shortest_line(links[link], corner).coords, axis=0)[0]
    moved = motion.joints.copy()
    moved[430] += gap * (1.0 + 0.01 * LENGTH / np.linalg.norm(gap))
    found = fault(validate(replace(motion, joints=moved), maze), "penetration")
    assert (found.pose, found.link) == (430, link)
    assert 0.007 * LENGTH < found.amount <= 0.01 * LENGTH


def past_needle(width):
    """Turn the last link of a straight arm, link length 100, over a needle that stands between two poses."""
    angles = np.zeros((10, 3))
    angles[:, 2] = 0.04 * np.arange(1, 11)
    turn = 0.04 * 5.5
    needle = affinity.rotate(box(275, -width / 2, 285, width / 2), turn, origin=(200, 0), use_radians=True)
    maze = hall(needle)
    return (
        maze,
        then(straight_in(maze, 100.0, 3, 300.0), angles),
        85.0 * np.array([math.cos(turn), math.sin(turn)]),
    )


def test_a_wall_cut_only_between_two_poses_is_found_there():
    maze, motion, offset = past_needle(0.6)
    report = validate(motion, maze)
    assert kinds(report) == {"sweep", "goal"}
    assert report.clearance > 0.0
    assert report.penetration_between == math.inf
    found = fault(report, "sweep")
    n_straight = motion.n_poses - 10
    assert (found.pose, found.link) == (n_straight + 4, 2)
    assert found.amount == pytest.approx(0.3, rel=0.05)
    assert np.linalg.norm(np.array(found.place) - (200.0, 0.0) - offset) < 6.0


@pytest.mark.parametrize("width", [0.19, 0.08, 0.01, 1e-4, 1e-7, 1e-12])
def test_no_wall_is_too_thin_to_be_found_between_two_poses(width):
    maze, motion, _ = past_needle(width)
    report = validate(motion, maze)
    assert kinds(report) == {"sweep", "goal"}
    assert report.penetration == 0.0
    n_straight = motion.n_poses - 10
    assert (fault(report, "sweep").pose, fault(report, "sweep").link) == (n_straight + 4, 2)


@pytest.mark.parametrize("width", [0.08, 0.01])
def test_a_thin_wall_may_be_touched_and_its_very_end_passed(width):
    beside, ahead = box(100.0, 0.0, 290.0, width), box(299.95, -width / 2, 390.0, width / 2)
    straight, turning = np.zeros((2, 10, 3))
    turning[:, 2] = np.linspace(0.0, -0.4, 10)  # away from the wall that the arm lies on
    passing = turning + np.array([0.0, 0.0, 0.2])
    feeds = np.linspace(250.0, 286.0, 10)
    for wall, angles, feed in ((beside, straight, feeds), (beside, turning, 300.0), (ahead, passing, 300.0)):
        maze = hall(wall, goal=(50.0, 50.0))
        feed = np.broadcast_to(feed, 10)
        report = validate(Motion.from_configurations(feed, angles, 100.0, maze.base_pose), maze)
        assert not kinds(report) & {"penetration", "sweep"}, (report.faults, feed[0])


@pytest.mark.parametrize("radius", [0.0, 5.0])
@pytest.mark.parametrize(("depth", "allowed"), [(0.05, True), (0.3, False), (1.0, False)])
def test_the_arc_of_a_joint_counts_and_not_its_chord(radius, depth, allowed):
    # The tip moves on an arc of 0.3 rad, which leaves its chord by 100 (1 - cos 0.15) = 1.12.
    maze = hall(box(300.0 + radius - depth, -400.0, 800.0, 400.0), goal=(250.0, 0.0))
    angles = np.zeros((2, 3))
    angles[:, 2] = -0.15, 0.15
    motion = Motion.from_configurations([300.0, 300.0], angles, 100.0, maze.base_pose)
    report = validate(motion, maze, ArmSpec(link_length=100.0, link_radius=radius))
    assert report.penetration == 0.0
    if allowed:
        assert "sweep" not in kinds(report)
        assert depth <= report.penetration_between <= PINCH_TOLERANCE * 100.0
    else:
        assert fault(report, "sweep").link == 2
        assert fault(report, "sweep").amount == pytest.approx(depth, abs=1e-3)


@pytest.mark.parametrize(("depth", "allowed"), [(0.07, True), (0.13, False)])
def test_a_thick_tip_that_grazes_a_pillar_between_poses_is_bounded_by_its_depth(depth, allowed):
    # The pillar points at the tip's arc a third of the way; half-way the cap is only 0.07 deep at most.
    needle = affinity.rotate(box(305.0 - depth, -0.01, 330, 0.01), 0.015, origin=(200, 0), use_radians=True)
    angles = np.zeros((2, 3))
    angles[1, 2] = 0.045
    motion = Motion.from_configurations([300.0, 300.0], angles, 100.0, np.zeros(3))
    report = validate(motion, hall(needle, goal=(250.0, 0.0)), ArmSpec(link_length=100.0, link_radius=5.0))
    assert report.penetration == 0.0
    assert ("sweep" not in kinds(report)) is allowed
    assert report.penetration_between >= depth
    assert allowed or fault(report, "sweep").amount == pytest.approx(depth, abs=1e-3)


def curling(to):
    """Curl a five-link arm in the hall, all joints alike."""
    maze = hall()
    motion = straight_in(maze, 100.0, 6, 600.0)
    angles = np.zeros((math.ceil(to / 0.002), 6))
    angles[:, 1:] = np.linspace(0.0, to, len(angles))[:, None]
    return maze, then(motion, angles)


def test_an_arm_that_curls_onto_itself_crosses_where_its_line_is_no_longer_simple():
    maze, motion = curling(1.3)
    found = fault(validate(motion, maze), "crossing")
    simple = np.array([LineString(joints).is_simple for joints in motion.joints])
    assert not simple[found.pose] or not simple[found.pose + 1]
    assert found.amount == 0.0
    first = int(np.flatnonzero(~simple)[0])
    before = sliced(motion, np.arange(first - 1))
    assert "crossing" not in kinds(validate(before, maze))


def test_thick_links_cross_when_they_touch():
    maze, motion = curling(1.0)
    gap = min(
        LineString(joints[k : k + 2]).distance(LineString(joints[j : j + 2]))
        for joints in motion.joints[-3:]
        for k in range(6)
        for j in range(k + 2, 6)
    )
    for radius, crosses in ((0.5 * gap - 0.2, False), (0.5 * gap + 0.01, True)):
        report = validate(motion, maze, ArmSpec(link_length=100.0, link_radius=radius))
        assert ("crossing" in kinds(report)) is crosses
    assert fault(report, "crossing").amount == pytest.approx(gap, abs=1e-6)


def test_a_link_folded_flat_on_the_one_before_is_a_crossing():
    maze = hall()
    motion = then(straight_in(maze, 100.0, 3, 300.0), [[0.0, 0.0, math.pi]])
    found = fault(validate(motion, maze), "crossing")
    assert (found.pose, found.link) == (motion.n_poses - 1, 2)
    almost = then(straight_in(maze, 100.0, 3, 300.0), [[0.0, 0.0, math.pi - 1e-6]])
    assert "crossing" not in kinds(validate(almost, maze))


@pytest.mark.parametrize(("radius", "excess"), [(100.0, 0.0), (101.0, 1.0), (120.0, 20.0)])
def test_a_link_thicker_than_the_corridor_penetrates_by_the_excess(radius, excess):
    maze = corridor(width=200.0, base_offset=300.0, length=2000.0)
    motion = straight_in(maze, 300.0, 6, 1500.0)
    report = validate(motion, maze, ArmSpec(link_length=300.0, link_radius=radius))
    assert report.penetration == pytest.approx(excess, abs=1e-9)
    assert ("penetration" in kinds(report)) is (excess > 0.0)
    if excess == 0.0:
        assert report.valid, report.faults


def test_motions_of_other_arms_and_mazes_are_bad_input():
    maze, motion = bend()
    for arm in (ArmSpec(link_length=61.0), ArmSpec(link_length=LENGTH, n_links=3)):
        with pytest.raises(InputError, match="Expected a motion of"):
            validate(motion, maze, arm)
    with pytest.raises(InputError, match="another maze"):
        validate(motion, hall())


def test_every_fault_is_explained():
    assert all(text and not text.endswith(".") for text in FAULTS.values())
    maze, motion = turned(200, 3, 0.5)
    found = validate(motion, maze, ArmSpec(link_length=LENGTH, joint_limit=0.3)).faults
    assert len(found) >= 3
    assert {one.kind for one in found} <= set(FAULTS)
    assert all(one.message.endswith(".") for one in found)


# Against dense sampling

PILLARS = hall(
    box(100, 20, 140, 60),
    box(200, -90, 230, -40),
    Polygon([(60, -60), (100, -60), (80, -20)]),
    *(box(x, y, x + 4, y + 4) for x in (150, 260) for y in (-130, -60, 10, 90)),
)


PILLAR_WALLS = PILLARS.free_space.boundary
shapely.prepare(PILLAR_WALLS)


def signed_distances(points):
    """Measure points, shape (n, 2), among the pillars."""
    distances = shapely.distance(PILLAR_WALLS, shapely.points(points))
    return np.where(shapely.contains_xy(PILLARS.free_space, points), distances, -distances)


coordinates = st.one_of(st.integers(-150, 250), st.floats(-150.0, 250.0))


@settings(deadline=None, max_examples=200)
@given(x=coordinates, y=coordinates, quarter=st.integers(0, 7), extra=st.sampled_from([0.0, 0.1, 1e-9]))
def test_the_clearance_of_a_link_is_that_of_its_nearest_or_deepest_point(x, y, quarter, extra):
    assume(PILLARS.free_space.contains(shapely.Point(x, y)))
    length, heading, n_points = 160.0, quarter * math.pi / 4 + extra, 2001
    maze = replace(PILLARS, base_pose=np.array([x, y, heading]))
    motion = Motion.from_configurations([length], [[0.0]], length, maze.base_pose)
    report = validate(motion, maze)
    share = np.linspace(0.0, 1.0, n_points)[:, None]
    points = (1.0 - share) * motion.joints[0, 0] + share * motion.joints[0, 1]
    sampled = signed_distances(points).min()
    assert report.clearance <= sampled + 1e-6 * length
    assert report.clearance >= sampled - 0.5 * length / (n_points - 1) - 1e-6 * length
    assert ("penetration" in kinds(report)) is (report.clearance < 0.0)


def random_pair(rng, spread):
    """Draw two configurations of a fully fed arm among the pillars."""
    angles = np.concatenate([np.zeros((2, 1)), rng.uniform(-0.7, 0.7, (1, 3)).repeat(2, axis=0)], axis=1)
    angles[1, 1:] += rng.uniform(-spread, spread, 3)
    return Motion.from_configurations([320.0, 320.0], angles, 80.0, PILLARS.base_pose)


def between(motion, n_times):
    share = np.linspace(0.0, 1.0, n_times)[:, None]
    angles = (1.0 - share) * motion.joint_angles[0] + share * motion.joint_angles[1]
    return joints_from_configuration(np.full(n_times, motion.feed[0]), angles, 80.0, motion.base_pose)


def deepest(joints, radius):
    """Measure the depth of the deepest of many points of links, or how near the links come to a wall."""
    share = np.linspace(0.0, 1.0, 81)[:, None]
    points = (joints[:, :-1, None] * (1.0 - share) + joints[:, 1:, None] * share).reshape(-1, 2)
    inside = points[~shapely.contains_xy(PILLARS.free_space, points)]
    if len(inside):
        return radius - float(signed_distances(inside).min())
    links = shapely.linestrings(np.stack([joints[:, :-1], joints[:, 1:]], axis=2).reshape(-1, 2, 2))
    return radius - float(shapely.distance(PILLAR_WALLS, links).min())


@pytest.mark.parametrize("radius", [0.0, 4.0])
@pytest.mark.parametrize("spread", [0.03, 0.3])
def test_no_configuration_between_poses_is_deeper_than_the_bound(radius, spread):
    rng = np.random.default_rng(7)
    bounded = cut = 0
    for _ in range(150):
        motion = random_pair(rng, spread)
        report = validate(motion, PILLARS, ArmSpec(link_length=80.0, link_radius=radius))
        if "penetration" in kinds(report):
            continue
        deep = deepest(between(motion, 101), radius)
        assert deep <= report.penetration_between + 1e-9
        if "sweep" not in kinds(report):
            bounded += 1
            assert report.penetration_between <= PINCH_TOLERANCE * 80.0
        else:
            cut += 1
            found = fault(report, "sweep")
            assert found.amount > PINCH_TOLERANCE * 80.0
            assert math.isinf(found.amount) or deep >= 0.5 * found.amount
    assert bounded > 5
    assert cut > (3 if spread == 0.3 else -1)


@pytest.mark.parametrize("radius", [0.0, 4.0])
def test_no_link_that_comes_askew_out_of_the_feeder_is_deeper_than_the_bound(radius):
    rng = np.random.default_rng(5)
    share, bounded, cut = np.linspace(0.0, 1.0, 101), 0, 0
    for _ in range(150):
        angles = rng.uniform(-1.0, 1.0, (1, 4)) * [[1.0, 1.0, 0.5, 0.5]] + rng.uniform(-0.02, 0.02, (2, 4))
        feed = rng.choice([80.0, 160.0, 240.0]) + np.array([-1.0, 1.0]) * rng.uniform(0.1, 30.0, 2)
        motion = Motion.from_configurations(feed, angles, 80.0, PILLARS.base_pose)
        report = validate(motion, PILLARS, ArmSpec(link_length=80.0, link_radius=radius))
        if {"penetration", "sweep"} & kinds(report):
            cut += 1
            continue
        bounded += 1
        moved = Motion.from_configurations(
            feed[0] + share * (feed[1] - feed[0]),
            angles[0] + share[:, None] * (angles[1] - angles[0]),
            80.0,
            PILLARS.base_pose,
        )
        arc = moved.feed[:, None] - 80.0 * (4 - np.arange(5))
        joints = np.where(arc[..., None] < 0.0, 0.0, moved.joints)
        assert deepest(joints, radius) <= report.penetration_between + 1e-9
    assert bounded > 5
    assert cut > 5


def test_an_arm_without_a_crossing_fault_is_simple_between_poses():
    rng = np.random.default_rng(11)
    maze = hall()
    apart = only_between = 0
    for k in range(1000):
        angles = np.concatenate([np.zeros((2, 1)), rng.uniform(-2.8, 2.8, (2, 3))], axis=1)
        motion = Motion.from_configurations([320.0, 320.0], angles, 80.0, maze.base_pose)
        simple = shapely.is_simple(shapely.linestrings(between(motion, 101)))
        passing = bool(simple[0] and simple[-1] and not simple.all())
        if k >= 80 and not passing:
            continue
        found = "crossing" in kinds(validate(motion, maze))
        assert simple.all() or found
        apart += not found
        only_between += passing
    assert apart > 50
    assert only_between > 5


# What is set aside before the exact check, against slow twins

figures = st.integers(-3, 4) | st.floats(-3.0, 4.0).map(lambda figure: round(figure, 6))
places = st.builds(complex, figures, figures)
lengths = st.sampled_from([0.0, 1.0, 2.0]) | figures.map(abs)


def lines(start, end):
    """Draw lines between complex numbers, shape (n,)."""
    return shapely.linestrings(np.stack([[start.real, end.real], [start.imag, end.imag]]).transpose(2, 1, 0))


@settings(max_examples=500)
@given(start=places, end=places, length=lengths)
def test_distances_of_segments_are_those_of_shapely(start, end, length):
    wall = LineString([(0.0, 0.0), (length, 0.0)])
    wanted = lines(np.array([start]), np.array([end]))[0].distance(wall)
    found = segment_distances((np.array([start]), np.array([end])), np.array([length]))
    assert found[0] == pytest.approx(wanted, abs=1e-12)


def distances_on_the_way(before, after, length, together):
    """Measure moving segments at many times; both ends at the same time, or each at any time."""
    share = np.linspace(0.0, 1.0, 101 if together else 21)
    one, other = (share, share) if together else (axis.ravel() for axis in np.meshgrid(share, share))
    start, end = (before[k] + part * (after[k] - before[k]) for k, part in ((0, one), (1, other)))
    return shapely.distance(lines(start, end), LineString([(0.0, 0.0), (length, 0.0)]))


def gap_of(before, after, length, together):
    one = [tuple(np.array([place], dtype=complex) for place in ends) for ends in (before, after)]
    return float(segment_gaps(*one, np.array([float(length)]), np.array([together]))[0])


@settings(max_examples=1000)
@given(data=st.data(), start=places, end=places, length=lengths, together=st.booleans())
def test_no_gap_is_larger_than_the_distance_on_the_way(data, start, end, length, together):
    # An end often stays, so that segments rest, pivot about an end, or move along themselves.
    way = st.just(0.0) | st.just(end - start) | st.builds(lambda place: place - start, places)
    before = (start, end)
    after = (start + data.draw(way), end + data.draw(way))
    gap = gap_of(before, after, length, together)
    assert gap <= distances_on_the_way(before, after, length, together).min() + 1e-12


@pytest.mark.parametrize(
    ("before", "after", "length", "at_least"),
    [
        ((-1 + 1j, 3 + 1j), (-1 + 1j, 3 + 1j), 2.0, 1.0),  # at rest beside the wall
        ((0.1j, 2 + 0.1j), (1 + 0.1j, 3 + 0.1j), 2.0, 0.1),  # slides along it
        ((3 + 1j, 3 + 4j), (4 + 1j, 2.5 + 4j), 2.0, 1.0),  # beside its end
        ((-2 + 0j, -1 + 0j), (-3 + 0j, -2 + 0j), 2.0, 1.0),  # in line with it
        ((-0.1 - 1j, -0.1 + 1j), (-0.2 - 1j, 1j), 2.0, 0.04),  # turns about its end
        (
            (-0.01 - 2j, -0.01 + 2j),
            (-0.41 - 2j, 0.37 + 2j),
            2.0,
            0.009,
        ),  # so close that the hull has it inside
    ],
)
def test_segments_that_pass_a_wall_have_a_gap(before, after, length, at_least):
    gap = gap_of(before, after, length, True)
    assert at_least <= gap <= distances_on_the_way(before, after, length, True).min() + 1e-12


def test_a_wall_inside_the_hull_is_missed_only_by_a_segment_that_turns():
    before, after, length = (-0.01 - 2j, -0.01 + 2j), (-0.41 - 2j, 0.37 + 2j), 2.0
    assert gap_of(before, after, length, True) > 0.0 >= gap_of(before, after, length, False)


def test_a_pillar_that_a_segment_sweeps_over_leaves_no_gap():
    for side in ((0.0, 0.4), (0.4j, 0.4), (0.4 + 0.4j, 0.4)):
        corner, length = side
        before, after = (-1 - 1j - corner, 1 - 1j - corner), (-1 + 2j - corner, 1 + 2j - corner)
        assert gap_of(before, after, length, True) <= 0.0


def everything(scene, tell):
    """Set nothing aside: the slow twin of `sift`."""
    motion, shape = scene.motion, (scene.motion.n_poses, scene.motion.n_links)
    after = np.minimum(np.arange(shape[0]) + 1, shape[0] - 1)
    step, first, second = (
        axis.ravel()
        for axis in np.meshgrid(*(np.arange(size) for size in (shape[0], *shape[1:] * 2)), indexing="ij")
    )
    chosen = (second >= first + 2) & (np.maximum(scene.arc, scene.arc[after])[step, first + 1] > 0.0)
    joints = joints_from_configuration(motion.feed, motion.joint_angles, motion.link_length, motion.base_pose)
    return Sifted(
        lower=np.zeros(shape),
        outside=np.ones(shape, dtype=bool),
        open_steps=np.ones(shape, dtype=bool),
        astray=np.linalg.norm(motion.joints - joints, axis=2).max(axis=1),
        pairs=[np.stack([step, first, second], axis=1)[chosen]],
    )


def without_sieve(motion, maze, arm):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(validation, "sift", everything)
        return validate(motion, maze, arm)


def assert_sieve_changes_nothing(motion, maze, radius=0.0):
    arm = ArmSpec(link_length=motion.link_length, link_radius=radius)
    quick, slow = validate(motion, maze, arm), without_sieve(motion, maze, arm)
    assert kinds(quick) == kinds(slow)
    assert (quick.clearance, quick.penetration) == (slow.clearance, slow.penetration)
    assert quick.faults == slow.faults or "sweep" in kinds(slow)


angles_of_a_joint = st.sampled_from([0.0, math.pi / 4, -math.pi / 2, 3.0]) | st.floats(-1.5, 1.5)
turns_of_a_joint = st.sampled_from([0.0, 0.0, 1e-9, 0.01]) | st.floats(-0.3, 0.3)


@settings(max_examples=150)
@given(
    angles=st.lists(angles_of_a_joint, min_size=3, max_size=3),
    turns=st.lists(turns_of_a_joint, min_size=3, max_size=3),
    feeds=st.tuples(st.floats(0.0, 330.0) | st.just(320.0), st.sampled_from([0.0, 0.0, 1.0, 60.0])),
    n_poses=st.integers(1, 7),
    radius=st.sampled_from([0.0, 0.0, 4.0]),
    astray=st.sampled_from([0.0, 0.0, 1e-8, 1.0]),
)
def test_nothing_is_set_aside_that_matters(angles, turns, feeds, n_poses, radius, astray):
    share = np.linspace(0.0, 1.0, n_poses)
    joint_angles = np.concatenate([[0.0], angles]) + share[:, None] * np.concatenate([[0.0], turns])
    motion = Motion.from_configurations(feeds[0] + share * feeds[1], joint_angles, 80.0, PILLARS.base_pose)
    motion = replace(motion, joints=motion.joints + np.array([0.0, astray]))
    assert_sieve_changes_nothing(motion, PILLARS, radius)


@pytest.mark.parametrize("radius", [0.0, 0.4 * LENGTH])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.02])
def test_nothing_is_set_aside_of_a_long_motion_that_matters(radius, noise):
    maze, motion = bend()
    assert motion.n_poses > SPAN
    angles = motion.joint_angles + np.random.default_rng(3).normal(size=motion.joint_angles.shape) * noise
    motion = sliced(
        Motion.from_configurations(motion.feed, angles, LENGTH, motion.base_pose), slice(300, None)
    )
    assert_sieve_changes_nothing(motion, maze, radius)


def test_little_is_left_of_a_motion_through_wide_places():
    maze, motion = bend()
    sifted = sift(Scene(motion=motion, maze=maze, radius=0.0), lambda stage, share: None)
    scene = Scene(motion=motion, maze=maze, radius=0.0)
    in_maze = (scene.arc[:, 1:] > 0.0).sum()
    assert 0 < (sifted.doubtful(scene) & (scene.arc[:, 1:] > 0.0)).sum() < 0.01 * in_maze
    assert not sifted.open_steps.any()
    assert sum(map(len, sifted.pairs)) == 0


def test_a_link_that_turns_all_round_back_to_its_place_is_not_set_aside():
    maze = hall(box(190, 60, 210, 80), goal=(300.0, 0.0))
    angles = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0 * math.pi]])
    motion = Motion.from_configurations([300.0, 300.0], angles, 100.0, maze.base_pose)
    assert fault(validate(motion, maze), "sweep").link == 2


def test_a_gap_bounds_nothing_behind_the_walls():
    maze, motion = bend()
    scene = Scene(motion=motion, maze=maze, radius=0.0)
    gap, still = np.full(2, 5.0), np.zeros(2)
    points = np.array([200j, 500 + 200j])  # in the corridor, and far outside
    depth = depths_from_gaps(scene, gap, points, still > 0.0, still, 1.0)
    assert depth.tolist() == [0.0, math.inf]
