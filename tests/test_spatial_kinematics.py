"""Laws of the spatial arm's kinematics, and of its motion record and file."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import hrsnake_env.arm as planar
from hrsnake_env.errors import InputError
from planners.problem import Motion
from planners.spatial.kinematics import (
    base_frame,
    configuration_from_joints,
    joints_from_configuration,
    universal_angles_from_joint_angles,
)
from planners.spatial.problem import SpatialMotion
from planners.spatial.rooms import paired_panels

LENGTHS = st.floats(0.1, 1e3)
HEADINGS = st.one_of(
    arrays(np.float64, 3, elements=st.floats(-1.0, 1.0)).filter(lambda way: np.linalg.norm(way) > 0.1),
    st.sampled_from(
        [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (1e-5, 0, 1), (1e-9, 1e-9, -1)]
    ),
).map(lambda way: np.asarray(way, dtype=float) / np.linalg.norm(way))
BASES = st.builds(
    lambda place, way: np.concatenate([place, way]),
    arrays(np.float64, 3, elements=st.floats(-1e3, 1e3)),
    HEADINGS,
)
# From one link up; straight, hardly bent, bent in one plane and almost reversed joints among them.
ANGLE = st.one_of(st.just(0.0), st.sampled_from([1e-12, -1e-12, 1e-300]), st.floats(-math.pi, math.pi))
BENDS = st.one_of(
    st.tuples(ANGLE, ANGLE).filter(lambda bend: math.hypot(*bend) < 3.14),
    st.floats(-math.pi, math.pi).map(lambda side: (3.1415 * math.cos(side), 3.1415 * math.sin(side))),
)
ANGLES = st.lists(BENDS, min_size=1, max_size=40).map(lambda bends: np.array([bends]))
TO_LENGTH = 1e-9  # of lengths up to 4e4


def rotation(axis, angle):
    """Return the matrix that turns about x, y or z by the right-hand rule."""
    cos, sin = math.cos(angle), math.sin(angle)
    one, two = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[one, one] = matrix[two, two] = cos
    matrix[two, one], matrix[one, two] = sin, -sin
    return matrix


# The map and its inverse


@given(ANGLES, LENGTHS, BASES, st.floats(0.0, 1.0))
def test_configuration_survives_the_round_trip(angles, length, base_pose, share):
    feed = [share * angles.shape[1] * length]
    joints = joints_from_configuration(feed, angles, length, base_pose)
    feed_back, angles_back = configuration_from_joints(joints, length, base_pose)
    np.testing.assert_allclose(feed_back, feed, atol=1e-7)
    # Joints lie up to 4e4 from the origin: the direction of a link of 0.1 is known to 1e-10.
    np.testing.assert_allclose(angles_back, angles, atol=1e-6)


@given(ANGLES, LENGTHS, BASES, st.integers(0, 39))
def test_joints_survive_the_round_trip_through_any_reversal(angles, length, base_pose, reversed_joint):
    joints = joints_from_configuration([0.0], angles, length, base_pose)
    k = reversed_joint % angles.shape[1]
    back = joints[0, k] - joints[0, k - 1] if k else length * base_pose[3:]
    joints[0, k + 1 :] += joints[0, k] - back - joints[0, k + 1]
    feed, angles = configuration_from_joints(joints, length, base_pose)
    again = joints_from_configuration(feed, angles, length, base_pose)
    np.testing.assert_allclose(again, joints, atol=1e-6)
    assert np.hypot(*angles[0, k]) == pytest.approx(math.pi, abs=1e-6)


@pytest.mark.parametrize("aside", [0.0, -0.0, 5e-324, 1e-310, 1e-200, 1e-17])
def test_a_full_reversal_has_half_a_turn_however_little_it_is_aside(aside):
    _, angles = configuration_from_joints(
        [[[0, 0, 0], [1, 0, 0], [0, aside, aside]]], 1.0, (0, 0, 0, 1, 0, 0)
    )
    assert np.hypot(*angles[0, 1]) == pytest.approx(math.pi)


def test_a_link_without_length_goes_straight_on():
    _, angles = configuration_from_joints([[[0, 0, 0], [1, 0, 0], [1, 0, 0]]], 1.0, (0, 0, 0, 1, 0, 0))
    np.testing.assert_array_equal(angles, 0.0)


@given(ANGLES, LENGTHS, BASES)
def test_every_link_has_its_exact_length(angles, length, base_pose):
    joints = joints_from_configuration([0.0], angles, length, base_pose)
    np.testing.assert_allclose(np.linalg.norm(np.diff(joints[0], axis=0), axis=1), length, rtol=1e-8)


def test_lengths_stay_exact_along_many_links():
    angles = np.random.default_rng(0).uniform(-1.5, 1.5, (20, 1000, 2))
    joints = joints_from_configuration(np.zeros(20), angles, 1.0, (0, 0, 0, 0.6, 0, 0.8))
    np.testing.assert_allclose(np.linalg.norm(np.diff(joints, axis=1), axis=2), 1.0, rtol=1e-11)


@given(ANGLES, BASES)
def test_links_meet_at_the_angle_that_the_bend_vector_is_long(angles, base_pose):
    joints = joints_from_configuration([0.0], angles, 1.0, np.concatenate([np.zeros(3), base_pose[3:]]))
    ways = np.vstack([base_pose[3:], np.diff(joints[0], axis=0)])
    across = np.linalg.norm(np.cross(ways[:-1], ways[1:]), axis=1)
    between = np.arctan2(across, (ways[:-1] * ways[1:]).sum(axis=1))
    np.testing.assert_allclose(between, np.hypot(*angles[0].T), atol=1e-9)


@given(st.integers(1, 60), LENGTHS, BASES, st.floats(0.0, 1.0))
def test_a_straight_arm_reaches_its_feed_along_the_heading(n_links, length, base_pose, share):
    feed = share * n_links * length
    joints = joints_from_configuration([feed], np.zeros((1, n_links, 2)), length, base_pose)
    np.testing.assert_allclose(joints[0, -1], base_pose[:3] + feed * base_pose[3:], atol=TO_LENGTH * 1e3)


@given(ANGLES, LENGTHS, BASES)
def test_the_first_joint_stays_on_the_feeders_axis(angles, length, base_pose):
    joint = joints_from_configuration([0.3 * length], angles, length, base_pose)[0, 0] - base_pose[:3]
    np.testing.assert_allclose(np.cross(joint, base_pose[3:]), 0.0, atol=TO_LENGTH * 1e4)


@given(ANGLES, LENGTHS, st.floats(-math.pi, math.pi), st.floats(-1e3, 1e3))
def test_without_the_second_angle_it_is_the_planar_arm(angles, length, heading, height):
    angles[..., 1] = 0.0
    base = (3.0, -4.0, height, math.cos(heading), math.sin(heading), 0.0)
    joints = joints_from_configuration([length], angles, length, base)
    flat = planar.joints_from_configuration([length], angles[..., 0], length, (3.0, -4.0, heading))
    np.testing.assert_allclose(joints[..., :2], flat, atol=TO_LENGTH * 1e4)
    np.testing.assert_allclose(joints[..., 2], height, atol=TO_LENGTH)


@given(ANGLES, BASES, st.lists(st.tuples(st.sampled_from("xyz"), st.floats(-4, 4)), max_size=3))
def test_a_turned_feeder_turns_the_arm(angles, base_pose, turns):
    # The frame of a turned feeder is rolled against the turned frame; bends roll back by the same angle.
    turn = np.eye(3)
    for axis, angle in turns:
        turn = rotation(axis, angle) @ turn
    moved = np.concatenate([turn @ base_pose[:3], turn @ base_pose[3:]])
    roll = base_frame(moved) @ turn @ base_frame(base_pose).T
    np.testing.assert_allclose(roll[0], [1.0, 0.0, 0.0], atol=1e-9)
    joints = joints_from_configuration([1.0], angles, 1.0, base_pose)
    again = joints_from_configuration([1.0], angles @ roll[1:, 1:].T, 1.0, moved)
    np.testing.assert_allclose(again, joints @ turn.T, atol=1e-6)


@given(ANGLES, BASES, st.floats(-math.pi, math.pi))
def test_turning_about_the_vertical_changes_no_angle(angles, base_pose, turn):
    if math.hypot(*base_pose[3:5]) < 1e-6:
        return  # A vertical heading stays what it is.
    joints = joints_from_configuration([1.0], angles, 1.0, base_pose)
    matrix = rotation("z", turn)
    moved = np.concatenate([matrix @ base_pose[:3], matrix @ base_pose[3:]])
    feed, again = configuration_from_joints(joints @ matrix.T, 1.0, moved)
    np.testing.assert_allclose(feed, [1.0], atol=1e-9)
    np.testing.assert_allclose(again, angles, atol=1e-6)


@given(ANGLES, st.integers(0, 2**32 - 1), st.floats(1e-14, 1e-3), st.floats(0.0, 1.0))
def test_small_changes_of_angles_move_joints_a_little(angles, seed, size, share):
    # Half of the time away from where an angle is 0, and from there in any direction.
    angles = angles * (share > 0.5)
    change = np.random.default_rng(seed).uniform(-size, size, angles.shape)
    base = (0, 0, 0, 1, 0, 0)
    before = joints_from_configuration([0.0], angles, 1.0, base)
    after = joints_from_configuration([0.0], angles + change, 1.0, base)
    # A change of one bend vector turns all that is beyond by no more than the change is long.
    lever = np.arange(angles.shape[1], 0, -1)
    assert np.linalg.norm(after[0, -1] - before[0, -1]) <= (lever * np.hypot(*change[0].T)).sum() + 1e-12


@given(ANGLES, st.integers(0, 2**32 - 1), st.floats(1e-13, 1e-6))
def test_small_moves_of_joints_change_angles_a_little(angles, seed, size):
    angles = angles * min(1.0, 1.5 / np.hypot(*angles[0].T).max(initial=1.5))
    base = (0, 0, 0, 1, 0, 0)
    joints = joints_from_configuration([0.0], angles, 1.0, base)
    moved = joints + np.random.default_rng(seed).uniform(-size, size, joints.shape)
    moved[:, 0, 1:] = 0.0
    _, again = configuration_from_joints(moved, 1.0, base)
    # The side of a bend is the more sensitive the nearer a reversal. Up to 1.5 rad a move of one link's
    # direction, at most 3.5 times the size, turns all frames beyond by at most about four times as much,
    # and angles by 1.5 times that.
    assert np.abs(again - angles).max() <= 20.0 * angles.shape[1] * size + 1e-11


def test_many_configurations_equal_one_after_another():
    rng = np.random.default_rng(1)
    feed, angles, base = rng.uniform(0, 10, 7), rng.uniform(-1, 1, (7, 5, 2)), (1, 2, 3, 0, 0.6, 0.8)
    together = joints_from_configuration(feed, angles, 2.0, base)
    for pose in range(7):
        alone = joints_from_configuration(feed[pose : pose + 1], angles[pose : pose + 1], 2.0, base)
        np.testing.assert_array_equal(together[pose], alone[0])


@given(HEADINGS)
def test_the_feeders_frame_is_square_and_right_handed(heading):
    frame = base_frame(np.concatenate([np.ones(3), heading]))
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1.0)
    np.testing.assert_allclose(frame[0], heading, atol=1e-15)
    assert frame[2, 2] >= -1e-9  # upwards, but of a vertical heading


@pytest.mark.parametrize(
    ("heading", "left", "up"),
    [
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
        ((0, 0, 1), (0, -1, 0), (1, 0, 0)),
        ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    ],
)
def test_the_feeders_frame_has_z_up_or_along_x(heading, left, up):
    np.testing.assert_allclose(base_frame((0, 0, 0, *heading)), [heading, left, up], atol=1e-15)


# Universal joints


@given(ANGLES, LENGTHS)
def test_universal_joints_hold_the_same_pose(angles, length):
    joints = joints_from_configuration([0.0], angles, length, (0, 0, 0, 1, 0, 0))[0]
    universal = universal_angles_from_joint_angles(angles)[0]
    frame, place = np.eye(3), joints[0]
    for (yaw, pitch), wanted in zip(universal, joints[1:], strict=True):
        frame = frame @ rotation("z", yaw) @ rotation("y", -pitch)
        place = place + length * frame[:, 0]
        np.testing.assert_allclose(place, wanted, atol=1e-9 * length)
    assert np.abs(universal[:, 0]).max() <= math.pi
    assert np.abs(universal[:, 1]).max() <= math.pi / 2


@given(ANGLES)
def test_universal_joints_of_a_planar_pose_only_yaw(angles):
    angles[..., 1] = 0.0
    np.testing.assert_allclose(universal_angles_from_joint_angles(angles), angles, atol=1e-9)


def test_a_lone_pitch_is_positive_towards_z():
    np.testing.assert_allclose(universal_angles_from_joint_angles([[[0.0, 0.5]]]), [[[0.0, 0.5]]], atol=1e-15)


# Motions


def curled(n_poses=5, n_links=3):
    """Return an arm that curls while it is pushed in."""
    angles = np.linspace(0.0, 0.4, n_poses)[:, None, None] * np.ones((n_links, 2))
    return SpatialMotion.from_configurations(
        np.linspace(0, 200, n_poses), angles, 100.0, (1, 2, 3, 0, 0.6, 0.8)
    )


def planar_motion():
    """Return a motion in the plane."""
    return Motion.from_configurations(np.zeros(5), np.zeros((5, 3)), 100.0, (0.0, 0.0, 0.0))


def test_a_motion_survives_the_round_trip_through_a_file(tmp_path):
    motion, path = curled(), tmp_path / "m.npz"
    motion.save(path)
    again = SpatialMotion.load(path)
    for key in ("joints", "joint_angles", "feed", "base_pose"):
        np.testing.assert_array_equal(getattr(again, key), getattr(motion, key))
    assert again.link_length == motion.link_length
    assert list(tmp_path.iterdir()) == [path]


def test_joints_and_configurations_make_the_same_motion():
    motion = curled()
    again = SpatialMotion.from_joints(motion.joints, 100.0, motion.base_pose)
    np.testing.assert_allclose(again.joint_angles, motion.joint_angles, atol=1e-12)
    np.testing.assert_allclose(again.feed, motion.feed, atol=1e-9)


@pytest.mark.parametrize("key", ["joints", "joint_angles", "feed", "base_pose"])
def test_arrays_of_a_motion_cannot_be_written(key):
    with pytest.raises(ValueError, match="read-only"):
        getattr(curled(), key)[0] = 0.0


def test_a_motion_says_how_large_it_is():
    assert repr(curled()) == "SpatialMotion(5 poses, 3 links of 100)"
    assert (curled().n_poses, curled().n_links) == (5, 3)


@given(st.integers(1, 6), st.integers(0, 5))
def test_more_links_stay_in_the_feeder(n_links, more):
    motion = curled(n_links=n_links)
    longer = motion.with_links(n_links + more)
    np.testing.assert_allclose(longer.joints[:, more:], motion.joints, atol=1e-9)
    np.testing.assert_array_equal(longer.joint_angles[:, :more], 0.0)
    assert longer.n_links == n_links + more


def test_fewer_links_are_refused():
    with pytest.raises(InputError, match=r"^Expected at least 3 links for this motion, got 2\.$"):
        curled().with_links(2)


def test_a_motion_of_another_workspace_is_refused():
    room = paired_panels()
    for length in (90.0, 120.0):
        base = room.base_pose_for(length)
        SpatialMotion.from_configurations([0.0], [[[0.0, 0.0]]], length, base).check_workspace(room)
    with pytest.raises(InputError) as raised:
        curled().check_workspace(room)
    assert str(raised.value) == (
        "Expected a motion from the base of workspace 'paired-panels' at (-10, 120, 100, 1, 0, 0), got one "
        "from (1, 2, 3, 0, 0.6, 0.8): it belongs to another workspace."
    )


def test_a_motion_in_the_plane_is_none_in_space(tmp_path):
    path = tmp_path / "m.npz"
    planar_motion().save(path)
    with pytest.raises(InputError) as raised:
        SpatialMotion.load(path)
    assert str(raised.value) == f"Expected a motion in space in '{path}', got one in the plane."


def test_a_motion_in_space_is_none_in_the_plane(tmp_path):
    curled().save(tmp_path / "m.npz")
    with pytest.raises(InputError, match=r"^Expected [^\n]*\.$"):
        Motion.load(tmp_path / "m.npz")


def test_a_missing_motion_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"^Expected a motion file at '.*none\.npz', but there is none\.$"):
        SpatialMotion.load(tmp_path / "none.npz")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joints": np.zeros((5, 3, 3))}, "Expected joints with shape (5, 4, 3), got (5, 3, 3)."),
        ({"feed": np.zeros(4)}, "Expected feed with shape (5,), got (4,)."),
        ({"feed": np.full(5, math.nan)}, "Expected a motion of finite numbers, got NaN or infinity in feed."),
        ({"feed": ["a"] * 5}, "Expected feed of a motion as an array of numbers."),
        (
            {"joint_angles": np.zeros((5, 3))},
            "Expected joint_angles with shape (n_poses, n_links, 2), got (5, 3).",
        ),
        (
            {"joint_angles": np.zeros((0, 3, 2))},
            "Expected joint_angles with shape (n_poses, n_links, 2), got (0, 3, 2).",
        ),
        ({"link_length": 0.0}, "Expected a positive, finite link_length, got 0.0."),
        ({"link_length": True}, "Expected a positive, finite link_length, got True."),
        ({"link_length": "90"}, "Expected a positive, finite link_length, got '90'."),
        ({"base_pose": np.zeros(3)}, "Expected base_pose with shape (6,), got (3,)."),
        (
            {"base_pose": [0, 0, 0, 1, 2, 0]},
            "Expected a base_pose with a heading of length 1, got [1.0, 2.0, 0.0].",
        ),
    ],
)
def test_motions_with_wrong_arrays_are_refused(changes, message):
    motion = curled()
    keys = ("joints", "joint_angles", "feed", "link_length", "base_pose")
    with pytest.raises(InputError) as raised:
        SpatialMotion(**{**{key: getattr(motion, key) for key in keys}, **changes})
    assert str(raised.value) == message


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda base: joints_from_configuration([0.0], [[0.0, 0.0]], 1.0, base),
            "Expected joint_angles with shape (n_poses, n_links, 2), got (1, 2).",
        ),
        (
            lambda base: joints_from_configuration(0.0, [[[0.0, 0.0]]], 1.0, base),
            "Expected feed with shape (1,), got ().",
        ),
        (
            lambda base: configuration_from_joints(np.zeros((1, 4, 2)), 1.0, base),
            "Expected joints with shape (n_poses, n_links + 1, 3), got (1, 4, 2).",
        ),
        (
            lambda base: joints_from_configuration([0.0], [[[0.0, 0.0]]], 1.0, (0, 0, 0)),
            "Expected a base_pose with shape (6,), the position and a heading of length 1, got "
            "[0.0, 0.0, 0.0].",
        ),
        (
            lambda base: base_frame(np.zeros(6)),
            "Expected a base_pose with shape (6,), the position and a heading of length 1, got "
            "[0.0, 0.0, 0.0, 0.0, 0.0, 0.0].",
        ),
        (
            lambda base: universal_angles_from_joint_angles([0.0, 1.0]),
            "Expected joint_angles with shape (n_poses, n_links, 2), got (2,).",
        ),
    ],
)
def test_wrong_shapes_are_refused(make, message):
    with pytest.raises(InputError) as raised:
        make((0, 0, 0, 1, 0, 0))
    assert str(raised.value) == message
