"""Laws of the motion record and its file."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsnake_env.errors import InputError
from hrsnake_env.mazes import MAZES, fig19
from planners.problem import Motion


def straight_motion(n_poses=5, n_links=3):
    """Return an arm that is pushed straight in."""
    feed = np.linspace(0, 200, n_poses)
    return Motion.from_configurations(feed, np.zeros((n_poses, n_links)), 100.0, fig19().base_pose)


def test_a_motion_survives_the_round_trip_through_a_file(tmp_path):
    motion, path = straight_motion(), tmp_path / "m.npz"
    motion.save(path)
    again = Motion.load(path)
    for key in ("joints", "joint_angles", "feed", "base_pose"):
        np.testing.assert_array_equal(getattr(again, key), getattr(motion, key))
    assert again.link_length == motion.link_length
    assert sorted(np.load(path)) == ["base_pose", "feed", "joint_angles", "joints", "link_length"]
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_has_the_name_that_was_asked_for(tmp_path):
    straight_motion().save(tmp_path / "motion.data")
    assert Motion.load(tmp_path / "motion.data").n_poses == 5


def test_arrays_of_a_motion_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        straight_motion().joints[0] = 0.0


@given(st.integers(1, 6), st.integers(0, 5))
def test_more_links_stay_in_the_feeder(n_links, more):
    motion = straight_motion(n_links=n_links)
    longer = motion.with_links(n_links + more)
    np.testing.assert_allclose(longer.joints[:, more:], motion.joints, atol=1e-9)
    np.testing.assert_array_equal(longer.joint_angles[:, :more], 0.0)


def test_fewer_links_are_refused():
    with pytest.raises(InputError, match="Expected at least 3 links for this motion, got 2"):
        straight_motion().with_links(2)


def test_joints_and_configurations_make_the_same_motion():
    rng = np.random.default_rng(0)
    angles = np.cumsum(rng.uniform(-0.05, 0.05, (200, 4)), axis=0)  # no jumps, more than a turn in the end
    angles[:, 1] += np.linspace(0, 7, 200)
    motion = Motion.from_configurations(np.linspace(0, 9, 200), angles, 3.0, (1.0, 2.0, 0.3))
    again = Motion.from_joints(motion.joints, 3.0, (1.0, 2.0, 0.3))
    turns = (again.joint_angles - motion.joint_angles) / (2 * math.pi)
    np.testing.assert_allclose(turns, np.broadcast_to(np.rint(turns[0]), turns.shape), atol=1e-9)
    np.testing.assert_allclose(again.feed, motion.feed, atol=1e-9)


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda path: None, "but there is none"),
        (lambda path: path.write_text("no motion"), "got a file that is not one"),
        (lambda path: path.write_bytes(b""), "got a file that is not one"),
        (lambda path: path.write_bytes(b"PK\x03\x04broken"), "got a file that is not one"),
        (lambda path: path.mkdir(), "got a folder or a device"),
        (
            lambda path: np.savez(path, joints=np.zeros((2, 3, 2))),
            "missing: joint_angles, feed, link_length, base_pose",
        ),
    ],
)
def test_files_that_are_not_motions_are_refused(write, message, tmp_path):
    path = tmp_path / "m.npz"
    write(path)
    with pytest.raises(InputError) as raised:
        Motion.load(path)
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joints": np.zeros((5, 3, 2))}, r"Expected joints with shape \(5, 4, 2\), got \(5, 3, 2\)"),
        ({"feed": np.zeros(4)}, r"Expected feed with shape \(5,\), got \(4,\)"),
        ({"feed": np.full(5, math.nan)}, "Expected a motion of finite numbers"),
        ({"link_length": np.array(-1.0)}, "Expected a positive, finite link_length"),
        ({"link_length": np.array([1.0, 2.0])}, "with one link_length"),
        ({"joint_angles": np.zeros(5)}, "Expected joint_angles with shape"),
        ({"joint_angles": np.array([["a"] * 3] * 5)}, "Expected a motion of numbers"),
    ],
)
def test_motions_with_wrong_arrays_are_refused(changes, message, tmp_path):
    motion = straight_motion()
    arrays = {
        key: getattr(motion, key) for key in ("joints", "joint_angles", "feed", "link_length", "base_pose")
    }
    np.savez(tmp_path / "m.npz", **{**arrays, **changes})
    with pytest.raises(InputError, match=message):
        Motion.load(tmp_path / "m.npz")


def test_a_motion_of_another_maze_is_refused():
    other = Motion.from_configurations([0.0], [[0.0]], 100.0, (1.0, 2.0, 0.0))
    with pytest.raises(InputError, match="it belongs to another maze"):
        other.check_maze(fig19())
    straight_motion().check_maze(MAZES["serp"]())
