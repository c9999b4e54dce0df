"""Laws of what touches what: distances, depths, places, and the verdict."""

import json
import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point

from hrsnake_env.arm import ArmSpec, feeder_angle_limits, joints_from_configuration
from hrsnake_env.contacts import PINCH_TOLERANCE, ContactLog, pinch_report
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from hrsnake_env.physics import SLOT_TOLERANCES, Physics
from hrsnake_env.simulation import simulate

LENGTH = 200.0
N_LINKS = 9
TOLERANCE = PINCH_TOLERANCE * LENGTH
EXACT = 1e-8
"""In px: coordinates are some 1e3, and pymunk's distances are good to 1e-11 of them."""

ARM = ArmSpec(link_length=LENGTH, n_links=N_LINKS)


def tightened(d):
    """fig19 with every wall d nearer to the middle of the corridor."""
    return fig19(l1=200 - 2 * d, l2=200 - 2 * d, wall=40 + 2 * d, end_gap=200 - 2 * d)


def pose_contacts(maze, feed, angles, arm=ARM):
    physics = Physics(maze, arm, kinematic=True)
    physics.reset(feed, angles)
    return physics.pose_contacts


def last_angle(angle):
    angles = np.zeros(N_LINKS)
    angles[-1] = angle
    return angles


def swing(to, feed, n_poses=60):
    """Turn the tip link, at a fixed feed, from straight to an angle."""
    angles = np.zeros((n_poses, N_LINKS))
    angles[:, -1] = np.linspace(0.0, to, n_poses)
    return np.full(n_poses, feed), angles


# Distances

random_arms = st.tuples(
    st.floats(300.0, 1700.0), st.lists(st.floats(-0.7, 0.7), min_size=N_LINKS, max_size=N_LINKS)
)


@given(random_arms)
@settings(max_examples=200, deadline=None)
def test_a_link_is_reported_if_and_only_if_it_is_within_the_tolerance_of_a_wall(drawn):
    maze = fig19()
    feed, angles = drawn
    limits = feeder_angle_limits(feed, N_LINKS, LENGTH)
    angles = np.clip(angles, -limits, limits)
    joints = joints_from_configuration(feed, angles, LENGTH, maze.base_pose)
    reported = {
        contact.link: contact for contact in pose_contacts(maze, feed, angles) if contact.wall is not None
    }
    boundary = maze.free_space.boundary
    for k in range(N_LINKS):
        rear, front = joints[k], joints[k + 1]
        if k * LENGTH < N_LINKS * LENGTH - feed:  # its rear end is in the feeder
            if front[1] <= maze.base_pose[1]:
                continue
            rear = maze.base_pose[:2]
        link = LineString([rear, front])
        distance = link.distance(boundary)
        if abs(distance - TOLERANCE) < EXACT:
            continue
        if maze.free_space.covers(link):
            assert (k in reported) == (distance < TOLERANCE), (k, distance)
        elif distance == 0.0:
            assert k in reported, (k, link)


@given(st.floats(-0.19, 5.0), st.floats(0.65, 1.2))
@settings(max_examples=60, deadline=None)
def test_a_link_that_cuts_a_corner_is_as_deep_as_the_corner_is_from_its_centre_line(depth, angle):
    # The corner (100, 1400) of the wall's end; the tip link turns right about a joint on the feeder's axis.
    maze = fig19()
    joint_y = 1400.0 - 100.0 / math.tan(angle) - depth / math.sin(angle)
    feed = joint_y - maze.base_pose[1] + LENGTH
    contacts = pose_contacts(maze, feed, last_angle(-angle))
    joints = joints_from_configuration(feed, last_angle(-angle), LENGTH, maze.base_pose)
    distance = Point(100.0, 1400.0).distance(LineString(joints[-2:]))
    assert [contact.corner for contact in contacts] == [(100.0, 1400.0)]
    assert contacts[0].clearance == pytest.approx(-math.copysign(distance, depth), abs=EXACT)
    assert contacts[0].link == N_LINKS - 1
    if abs(depth - TOLERANCE) > EXACT:
        assert contacts[0].kind == ("collision" if depth > TOLERANCE else "pinch")


@given(st.floats(-0.19, 5.0), st.floats(300.0, 1300.0))
@settings(max_examples=60, deadline=None)
def test_a_tip_that_pokes_a_flat_wall_is_as_deep_as_it_is_beyond_it(depth, feed):
    contacts = pose_contacts(fig19(), feed, last_angle(math.asin((100.0 + depth) / LENGTH)))
    assert [contact.wall for contact in contacts] == [7]
    assert contacts[0].corner is None
    assert contacts[0].clearance == pytest.approx(-depth, abs=EXACT)
    assert contacts[0].point[0] == pytest.approx(-100.0, abs=EXACT)


@pytest.mark.parametrize("depth", [0.3, 1.0, 3.0])
def test_a_link_wholly_behind_the_surface_is_a_collision_of_its_depth(depth):
    # Its centre line touches no wall line; only what is solid behind the surface sees it.
    maze = Maze.from_corridors([(0, 0), (0, 3000)], 200.0)
    offset = 100.0 + depth
    angles = np.zeros(N_LINKS)
    angles[-2], angles[-1] = math.asin(offset / LENGTH), -math.asin(offset / LENGTH)
    contacts = [c for c in pose_contacts(maze, 1500.0, angles) if c.link == N_LINKS - 1]
    assert min(contact.clearance for contact in contacts) == pytest.approx(-depth, abs=EXACT)


@given(st.floats(0.0, 30.0), st.floats(-0.19, 2.0))
@settings(max_examples=30, deadline=None)
def test_the_radius_of_a_link_counts_from_its_centre_line(radius, depth):
    arm = ArmSpec(link_length=LENGTH, n_links=N_LINKS, link_radius=radius)
    angle = math.asin((100.0 - radius + depth) / LENGTH)
    contacts = pose_contacts(fig19(), 900.0, last_angle(angle), arm)
    assert min(contact.clearance for contact in contacts) == pytest.approx(-depth, abs=EXACT)


@given(random_arms)
@example((1605.0, [0.0, -0.359375, 0.0, -0.53125, 0.15625, 0.0, -0.3125, 0.0, 0.0]))  # ends beyond a wall
@settings(max_examples=50, deadline=None)
def test_clearance_is_the_distance_to_the_walls_and_negative_across_one(drawn):
    maze = Maze.from_corridors([(0, 0), (0, 3000)], 800.0)
    feed, angles = drawn
    limits = feeder_angle_limits(feed, N_LINKS, LENGTH)
    angles = 0.4 * np.clip(angles, -limits, limits)
    physics = Physics(maze, ARM, kinematic=True)
    physics.reset(feed, angles)
    joints = physics.joints
    half_slot = SLOT_TOLERANCES * TOLERANCE  # the walls are open for the feeder
    base = maze.base_pose[1]
    walls = maze.free_space.boundary - shapely.box(-half_slot, -1e4, half_slot, base)
    in_front = maze.free_space.boundary - shapely.box(-1e4, -1e4, 1e4, base)
    for k in range(N_LINKS):
        if joints[k, 1] >= base:
            # To a link that is just leaving the feeder the walls behind the base are no matter.
            distance = LineString(joints[k : k + 2]).distance(walls if joints[k, 1] > base else in_front)
            if distance == 0.0:
                assert physics.clearance[k] < 0.0
                continue
            if not maze.free_space.intersects(LineString(joints[k : k + 2])):
                # It is beyond a wall, which an earlier link has crossed: near it what is solid sees it.
                assert physics.clearance[k] < distance + EXACT
                continue
            assert physics.clearance[k] == pytest.approx(min(distance, LENGTH), abs=EXACT)


# The feeder


def test_nothing_touches_the_walls_behind_the_base_while_the_arm_comes_in():
    # Behind the base stand the end wall and, across the feeder, another corridor of the same maze.
    maze = Maze.from_corridors([(0, 0), (0, 900), (700, 900), (700, -400), (-700, -400)], 200.0)
    feeds = np.linspace(0.0, 800.0, 60)
    report = simulate(maze, ARM, feeds, np.zeros((60, N_LINKS)))
    assert report.clean
    assert report.pinch == report.kinematic.pinch == 0
    # As many link-poses as there are links past the base: 1 at first, 5 at the end.
    assert 60 < report.link_poses < 5 * 60


def test_the_wall_beside_the_feeder_still_stands():
    # A link that has left the feeder and turns back by 150 degrees pokes the end wall, 5 behind the base.
    angles = last_angle(0.0)
    angles[-1], angles[-2] = 1.4, 1.4
    contacts = pose_contacts(fig19(l1=1000.0, l2=1000.0), 2 * LENGTH + 20.0, angles)
    assert {contact.wall for contact in contacts} == {0}


# Links among themselves


def test_links_that_cross_are_reported_and_neighbours_are_not():
    maze = Maze.from_corridors([(0, 0), (0, 3000)], 2000.0)
    angles = np.zeros(N_LINKS)
    angles[-3:] = 2.0, 2.0, 2.0  # a triangle and more: the last link crosses the fourth from the tip
    contacts = pose_contacts(maze, 1500.0, angles)
    joints = joints_from_configuration(1500.0, angles, LENGTH, maze.base_pose)
    lines = shapely.linestrings(np.stack([joints[:-1], joints[1:]], axis=1))
    crossing = {
        (i, j)
        for i in range(N_LINKS)
        for j in range(i + 2, N_LINKS)
        if lines[i].distance(lines[j]) < TOLERANCE
    }
    assert crossing
    assert {(contact.link, contact.other) for contact in contacts} == crossing
    assert all(contact.wall is None and contact.kind == "collision" for contact in contacts)


def test_crossed_links_make_a_report_unclean():
    maze = Maze.from_corridors([(0, 0), (0, 3000)], 2000.0)
    angles = np.zeros((200, N_LINKS))
    angles[:, -3:] = np.linspace(0.0, 2.0, 200)[:, None]
    report = simulate(maze, ARM, np.full(200, 1500.0), angles, kinematic=True)
    assert report.crossed_links == ((5, 8),)
    assert report.collisions == ()
    assert not report.clean


# The verdict: it must be able to say no


@pytest.mark.parametrize("d", [1.0, 2.0, 5.0])
def test_the_same_motion_collides_at_the_same_corner_by_what_the_maze_is_tighter(d):
    # In fig19 the link ends exactly on the corner (100, 1400), turned by 45 degrees about (0, 1300).
    feed, angles = swing(-math.pi / 4, 1300.0 - 5.0 + LENGTH)
    depth = d * math.sqrt(2.0)  # the corner has moved by (-d, d), square to the link
    report = simulate(tightened(d), ARM, feed, angles)
    exact = report.kinematic
    assert not report.clean
    assert not exact.clean
    assert exact.worst_depth == pytest.approx(depth, abs=EXACT)
    assert [(touch.corner, touch.clearance) for touch in exact.collisions] == [
        ((100.0 - d, 1400.0 + d), pytest.approx(-depth, abs=EXACT))
    ]
    assert exact.first_collision.link == N_LINKS - 1
    assert exact.first_collision.point == pytest.approx((100.0 - d, 1400.0 + d), abs=EXACT)
    assert [touch.corner for touch in report.collisions] == [(100.0 - d, 1400.0 + d)]
    assert report.largest_impulse > 0.0
    assert report.node_error > depth / 2


def test_the_motion_merely_pinches_in_the_maze_it_was_made_for():
    feed, angles = swing(-math.pi / 4, 1300.0 - 5.0 + LENGTH)
    report = simulate(fig19(), ARM, feed, angles)
    assert report.clean
    assert report.kinematic.pinch > 0
    assert [touch.corner for touch in report.kinematic.pinched_corners] == [(100.0, 1400.0)]
    assert report.kinematic.pinched_links == (N_LINKS - 1,)
    assert report.kinematic.worst_depth < EXACT
    assert report.largest_impulse == 0.0


@pytest.mark.parametrize("d", [-1.0, -5.0])
def test_the_same_motion_touches_nothing_in_a_wider_maze(d):
    feed, angles = swing(-math.pi / 4, 1300.0 - 5.0 + LENGTH)
    report = simulate(tightened(d), ARM, feed, angles)
    assert report.clean
    assert report.pinch == report.collision == report.kinematic.pinch == report.kinematic.collision == 0
    assert report.free == report.kinematic.free > 0


def test_a_wall_of_ten_px_is_not_tunnelled_even_by_one_leap():
    # Two halls with a thin wall between them; the tip link is sent through it broadside.
    hall = shapely.box(-400, 0, 400, 3000) - shapely.box(100, 20, 110, 2990)
    maze = Maze(
        name="halls",
        free_space=hall,
        base_pose=(0.0, 5.0, math.pi / 2),
        goal=(300.0, 1500.0),
        goal_radius=9.0,
    )
    angles = np.zeros((2, N_LINKS))
    angles[1, -2], angles[1, -1] = -1.0, 1.0  # the tip link stays upright and moves 168 to the right
    for kinematic in (False, True):
        report = simulate(maze, ARM, np.full(2, 1500.0), angles, kinematic=kinematic)
        assert not report.clean
        assert report.collision > 0


# Records


def test_a_log_keeps_the_deepest_contact_of_each_pose_and_place():
    log = ContactLog(tolerance=0.1)
    log.begin_pose(3)
    key = (1, -1, 5, None, False)
    for substep, clearance in enumerate((0.05, -0.3, -0.2)):
        log.touch(key, substep, 5, (1.0, 2.0), clearance, impulse=float(substep))
    (contact,) = log.contacts
    assert (contact.pose, contact.substep, contact.clearance, contact.impulse) == (3, 1, -0.3, 2.0)
    assert contact.kind == "collision"
    log.begin_pose(4)
    assert log.current == ()
    assert log.contacts == (contact,)


def test_a_report_counts_each_link_pose_once_at_its_worst():
    log = ContactLog(tolerance=0.1)
    log.touch((0, -1, 5, None, False), 0, 5, (0.0, 0.0), 0.0, 0.0)
    log.touch((0, -1, 6, None, False), 0, 6, (0.0, 0.0), -1.0, 0.0)
    log.touch((1, -1, 6, None, False), 0, 6, (0.0, 0.0), 0.05, 0.0)
    report = pinch_report(
        log.contacts, n_poses=1, n_links=4, link_poses=4, link_length=100.0, node_error=0.0, drift=0.0
    )
    assert (report.free, report.pinch, report.collision) == (2, 1, 1)
    assert report.worst_depth == 1.0
    assert [touch.wall for touch in report.collisions] == [6]


@pytest.mark.parametrize(
    ("changed", "clean"),
    [
        ({}, True),
        ({"node_error": 0.11}, False),
        ({"node_error": math.inf}, False),
        ({"drift": 0.11}, False),
        ({"drift": 0.09}, True),
    ],
)
def test_a_report_is_clean_only_if_links_were_where_they_belonged(changed, clean):
    values = {
        "n_poses": 1,
        "n_links": 1,
        "link_poses": 1,
        "link_length": 100.0,
        "node_error": 0.0,
        "drift": 0.0,
    }
    assert pinch_report((), **{**values, **changed}).clean is clean


def test_a_report_becomes_json_and_says_where_it_collided():
    feed, angles = swing(-math.pi / 4, 1300.0 - 5.0 + LENGTH, 10)
    text = json.dumps(simulate(tightened(2.0), ARM, feed, angles).to_dict(), allow_nan=False)
    data = json.loads(text)
    assert data["clean"] is False
    assert data["kinematic"]["first_collision"]["corner"] == [98.0, 1402.0]
    assert data["kinematic"]["collisions"][0]["corner"] == [98.0, 1402.0]
