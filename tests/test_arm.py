"""Laws of forward kinematics and its inverse."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hrsnake_env.arm import (
    ArmSpec,
    configuration_from_joints,
    feeder_angle_limits,
    joints_from_configuration,
)
from hrsnake_env.errors import InputError

LENGTHS = st.floats(0.1, 1e3)
POSES = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-math.pi, math.pi))
# From one link up, straight joints and joints almost folded back among them.
ANGLES = st.integers(1, 60).flatmap(
    lambda n: arrays(
        np.float64,
        n,
        elements=st.one_of(st.just(0.0), st.floats(-3.14, 3.14), st.sampled_from([-3.1415, 3.1415])),
    )
)
ROUNDING = 1e-9  # of lengths up to 6e4


@given(ANGLES, LENGTHS, POSES, st.floats(0.0, 1.0))
def test_configuration_survives_the_round_trip(angles, length, base_pose, share):
    feed = share * len(angles) * length
    joints = joints_from_configuration(feed, angles, length, base_pose)
    feed_back, angles_back = configuration_from_joints(joints, length, base_pose)
    assert feed_back == pytest.approx(feed, abs=1e-7)
    np.testing.assert_allclose(angles_back, angles, atol=1e-8)


@given(ANGLES, LENGTHS, POSES)
def test_every_link_has_its_exact_length(angles, length, base_pose):
    joints = joints_from_configuration(0.0, angles, length, base_pose)
    np.testing.assert_allclose(np.hypot(*np.diff(joints, axis=0).T), length, rtol=1e-9)


@given(st.integers(1, 60), LENGTHS, POSES, st.floats(0.0, 1.0))
def test_straight_arm_reaches_its_feed_along_the_base_heading(n_links, length, base_pose, share):
    x, y, heading = base_pose
    feed = share * n_links * length
    tip = joints_from_configuration(feed, np.zeros(n_links), length, base_pose)[-1]
    np.testing.assert_allclose(
        tip, [x + feed * math.cos(heading), y + feed * math.sin(heading)], atol=ROUNDING * 1e4
    )


@given(ANGLES, LENGTHS, POSES)
def test_first_joint_stays_on_the_feeders_axis(angles, length, base_pose):
    joints = joints_from_configuration(0.3 * length, angles, length, base_pose)
    x, y, heading = base_pose
    across = -(joints[0, 0] - x) * math.sin(heading) + (joints[0, 1] - y) * math.cos(heading)
    assert abs(across) < 1e-7


def test_many_configurations_equal_one_after_another():
    rng = np.random.default_rng(1)
    feed, angles = rng.uniform(0, 10, 7), rng.uniform(-1, 1, (7, 5))
    together = joints_from_configuration(feed, angles, 2.0, (1.0, 2.0, 0.5))
    for pose in range(7):
        alone = joints_from_configuration(feed[pose], angles[pose], 2.0, (1.0, 2.0, 0.5))
        np.testing.assert_array_equal(together[pose], alone)


def test_counter_clockwise_is_positive():
    joints = joints_from_configuration(2.0, [0.0, math.pi / 2], 1.0, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(joints, [[0, 0], [1, 0], [1, 1]], atol=1e-12)


@given(st.integers(1, 30), LENGTHS, st.floats(0.0, 1.0))
def test_the_feeder_holds_exactly_the_joints_behind_the_base(n_links, length, share):
    feed = share * n_links * length
    limits = feeder_angle_limits(feed, n_links, length)
    rear_ends = joints_from_configuration(feed, np.zeros(n_links), length, (0, 0, 0))[:-1, 0]
    behind = rear_ends < -1e-9 * length
    ahead = rear_ends > 1e-9 * length
    assert (limits[behind] <= 1e-7).all()
    assert (limits[ahead] > 0.0).all()
    assert (np.diff(limits) >= 0.0).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"link_length": 0.0}, "Expected a positive, finite link_length, got 0.0."),
        ({"link_length": -1.0}, "Expected a positive, finite link_length, got -1.0."),
        ({"link_length": math.nan}, "Expected a positive, finite link_length, got nan."),
        ({"link_length": math.inf}, "Expected a positive, finite link_length, got inf."),
        ({"link_length": "1"}, "Expected a positive, finite link_length, got '1'."),
        ({"link_length": 1.0, "n_links": 0}, "Expected n_links to be a whole number of at least 1"),
        ({"link_length": 1.0, "n_links": 2.5}, "Expected n_links to be a whole number of at least 1"),
        ({"link_length": 1.0, "link_radius": -0.1}, "Expected link_radius of at least 0"),
        ({"link_length": 1.0, "link_radius": math.nan}, "Expected link_radius of at least 0"),
        ({"link_length": 1.0, "link_radius": 0.5}, "Expected link_radius of at least 0"),
        ({"link_length": 1.0, "joint_limit": 0.0}, "Expected joint_limit in"),
        ({"link_length": 1.0, "joint_limit": 4.0}, "Expected joint_limit in"),
    ],
)
def test_bad_arms_are_refused_in_one_sentence(arguments, message):
    with pytest.raises(InputError) as raised:
        ArmSpec(**arguments)
    assert str(raised.value).startswith(message)
    assert "\n" not in str(raised.value)
