"""Laws of the planned policy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsnake_env.task import FEED_STEP, JOINT_STEP
from planners.controllers import PlannedPolicy, actions_of
from planners.problem import Motion


def motion_of(n_poses=30, n_links=4, seed=0, largest=0.2):
    """Return a random smooth motion that starts in the feeder."""
    rng = np.random.default_rng(seed)
    angles = np.cumsum(rng.uniform(-largest, largest, (n_poses, n_links)), axis=0)
    feed = np.cumsum(rng.uniform(0, 5, n_poses))
    return Motion.from_configurations(feed - feed[0], angles - angles[0], 100.0, (0.0, 0.0, 0.0))


@given(st.integers(0, 1000), st.floats(0.001, 0.5), st.integers(1, 5))
def test_actions_are_in_bounds_and_add_up_to_the_motion(seed, largest, n_links):
    motion = motion_of(n_links=n_links, seed=seed, largest=largest)
    actions = actions_of(motion)
    assert np.abs(actions).max() <= 1.0 + 1e-9
    steps = np.array([FEED_STEP * 100.0, *[JOINT_STEP] * n_links])
    reached = (actions * steps).sum(axis=0)
    np.testing.assert_allclose(reached[0], motion.feed[-1], atol=1e-9)
    np.testing.assert_allclose(reached[1:], motion.joint_angles[-1], atol=1e-9)


def test_every_pose_is_passed_on_the_way():
    motion = motion_of(largest=0.3)
    reached = np.cumsum(actions_of(motion) * np.array([FEED_STEP * 100.0, *[JOINT_STEP] * 4]), axis=0)
    for feed, angles in zip(motion.feed[1:], motion.joint_angles[1:], strict=True):
        distance = np.abs(reached - np.array([feed, *angles])).max(axis=1)
        assert distance.min() < 1e-9


def test_a_pose_that_repeats_is_a_step_of_rest():
    motion = Motion.from_configurations([0.0, 0.0, 1.0], np.zeros((3, 2)), 100.0, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(actions_of(motion), [[0, 0, 0], [0.5, 0, 0]])


def play(policy, n, **arguments):
    """Return the next n actions to one environment, without handing the state back."""
    return np.array([policy.predict(np.zeros(3), **arguments)[0] for _ in range(n)])


def test_the_policy_plays_its_actions_and_then_holds_still():
    policy = PlannedPolicy(motion_of())
    n = len(policy.actions)
    played = play(policy, n + 3)
    np.testing.assert_array_equal(played[:n], policy.actions)
    np.testing.assert_array_equal(played[n:], 0.0)


def test_reset_and_episode_start_begin_anew():
    policy = PlannedPolicy(motion_of())
    play(policy, 5)
    policy.reset()
    np.testing.assert_array_equal(play(policy, 4), policy.actions[:4])
    action, _ = policy.predict(np.zeros(3), episode_start=np.array([True]))
    np.testing.assert_array_equal(action, policy.actions[0])


def test_the_state_that_is_handed_back_decides():
    policy = PlannedPolicy(motion_of())
    _, state = policy.predict(np.zeros(3))
    play(policy, 7)
    action, _ = policy.predict(np.zeros(3), state=state)
    np.testing.assert_array_equal(action, policy.actions[1])


def test_environments_side_by_side_have_their_own_steps():
    policy = PlannedPolicy(motion_of())
    observations = np.zeros((3, 8))
    _, state = policy.predict(observations, episode_start=np.ones(3, dtype=bool))
    _, state = policy.predict(observations, state=state, episode_start=np.array([False, True, False]))
    actions, _ = policy.predict(observations, state=state, episode_start=np.array([False, False, True]))
    np.testing.assert_array_equal(actions, policy.actions[[2, 1, 0]])


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_smaller_steps_take_more_actions(factor):
    motion = motion_of(largest=0.3)
    coarse, fine = len(actions_of(motion)), len(actions_of(motion, FEED_STEP * factor, JOINT_STEP * factor))
    assert (fine > coarse) == (factor < 1.0)
