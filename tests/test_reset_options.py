"""Laws of the options of `reset`."""

import math
import re
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest

from hrsnake_env import InputError, Maze
from hrsnake_env.arm import joints_from_configuration

ID = "hrsnake_env:HyperRedundantMaze-v0"
BENT = np.array([0.0] * 5 + [0.0, 0.08])


def make(**arguments):
    return gym.make(ID, **{"maze": "fig19", "link_length": 430.0, "n_links": 7, **arguments}).unwrapped


def test_an_episode_starts_where_it_was_asked_to():
    env = make()
    _, info = env.reset(options={"feed": 1000.0, "joint_angles": BENT})
    joints = joints_from_configuration(1000.0, BENT, 430.0, env.maze.base_pose)
    np.testing.assert_allclose(env.physics.joints, joints, atol=1e-9)
    np.testing.assert_allclose(env.target, [1000.0, *BENT], atol=1e-12)
    assert info["feed"] == pytest.approx(1000.0)
    assert info["total_steps"] == 0 and not info["success"]
    _, info = env.reset()
    assert info["feed"] == pytest.approx(0.0)


def test_an_episode_starts_at_a_waypoint_of_anything_with_feed_and_joint_angles():
    motion = SimpleNamespace(
        feed=np.array([0.0, 500.0, 1000.0]), joint_angles=np.array([0 * BENT, 0 * BENT, BENT])
    )
    env = make()
    for waypoint in range(3):
        _, info = env.reset(options={"motion": motion, "waypoint": waypoint})
        assert info["feed"] == pytest.approx(motion.feed[waypoint])
        np.testing.assert_allclose(env.target[1:], motion.joint_angles[waypoint], atol=1e-12)


def test_another_maze_may_be_drawn_by_name_or_given():
    env = make()
    env.reset(options={"maze": "U200"})
    assert env.maze.name == "U200"
    other = Maze.load("zig3")
    observation, _ = env.reset(options={"maze": other})
    assert env.maze is other
    assert env.observation_space.contains(observation)
    env.reset()
    assert env.maze.name == "fig19"


def test_another_goal_is_where_success_is():
    env = make()
    _, info = env.reset(options={"goal": (0.0, 700.0)})
    assert info["goal_distance"] == pytest.approx(695.0)
    action = np.zeros(8)
    action[0] = 1.0
    terminated = False
    while not terminated:
        *_, terminated, _, info = env.step(action)
    assert info["success"]
    assert info["feed"] == pytest.approx(695.0 - 25.0, abs=9.0)
    _, info = env.reset()
    assert info["goal_distance"] > 2000.0


def test_a_goal_radius_holds_for_other_mazes_and_goals_too():
    env = make(goal_radius=60.0)
    for options in ({}, {"maze": "U40"}, {"goal": (0.0, 700.0)}):
        env.reset(options=options)
        assert env.maze.goal_radius == 60.0


def test_success_must_be_held_as_long_as_asked():
    counts = {}
    for hold in (1, 4):
        env = make(goal_radius=60.0, success_hold_steps=hold)
        env.reset(options={"goal": (0.0, 700.0)})
        action = np.zeros(8)
        action[0] = 1.0
        *_, terminated, _, info = env.step(action)
        while not terminated:
            *_, terminated, _, info = env.step(action)
        assert info["success"] and info["reward_goal"] == 10.0
        counts[hold] = info["total_steps"]
    assert counts[4] == counts[1] + 3


def test_a_task_is_the_same_maze_every_time_and_drawn_ones_follow_the_seed():
    env = gym.make(ID, maze="random", split="test").unwrapped
    mazes = []
    for _ in range(2):
        _, info = env.reset(options={"task_id": 17})
        assert info["task_id"] == 17
        mazes.append(env.maze.free_space)
    assert mazes[0].equals_exact(mazes[1], 0.0)
    drawn = [
        [env.reset(seed=seed)[1]["task_id"], *(env.reset()[1]["task_id"] for _ in range(3))]
        for seed in (1, 1, 2)
    ]
    assert drawn[0] == drawn[1] != drawn[2]
    _, info = env.reset(options={"maze": Maze.load("L")})
    assert info["task_id"] == -1


def test_a_thousand_resets_never_start_in_success():
    env = gym.make(ID, maze="random").unwrapped
    for seed in range(1000):
        _, info = env.reset(seed=seed)
        assert not info["success"]
        assert info["tip_distance"] > env.maze.goal_radius
        assert info["progress"] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"pose": 1},
            "Unknown reset option 'pose'. Available: maze, task_id, goal, feed, joint_angles, motion, "
            "waypoint, state.",
        ),
        ({"maze": "fig20"}, "Unknown maze 'fig20'. Available: fig19, "),
        ({"task_id": 3}, "Expected maze='random' for the reset option 'task_id', got another maze."),
        ({"task_id": -1}, "Expected task_id to be a whole number of at least 0, got -1."),
        ({"goal": (0.0, 1.0, 2.0)}, "Expected a goal with shape (2,), got (3,)."),
        ({"goal": (-900.0, 700.0)}, "Expected "),
        ({"joint_angles": BENT}, "Expected reset option 'feed' with 'joint_angles', got none."),
        ({"waypoint": 3}, "Expected reset option 'motion' with 'waypoint', got none."),
        ({"feed": 900.0, "joint_angles": np.zeros(3)}, "Expected joint_angles with shape (7,), got (3,)."),
        ({"feed": math.nan}, "Expected a finite feed and finite joint_angles, got NaN or infinity."),
        ({"feed": 4000.0}, "Expected a feed from 0 to 3010, got 4000."),
        (
            {"feed": 400.0, "joint_angles": BENT},
            "Expected joint 6 within 0 rad, which feeder and joint limit leave it at feed 400, got 0.08.",
        ),
        ({"feed": 900.0, "joint_angles": 5.0 * BENT}, "Expected a start clear of the walls, got link 6 "),
        ({"feed": 700.0, "goal": (0.0, 700.0)}, "Expected a start outside the goal's radius, "),
        ({"goal": "abc"}, "Expected a goal in numbers, got 'abc'."),
        ({"goal": [[1.0, 2.0], [3.0]]}, "Expected a goal in numbers, got [[1.0, 2.0], [3.0]]."),
        ({"feed": "a"}, "Expected a feed in numbers, got 'a'."),
        ({"feed": True}, "Expected a feed in numbers, got True."),
        ({"feed": 900.0, "joint_angles": "a"}, "Expected joint_angles in numbers, got 'a'."),
        ({"motion": 5}, "Expected a motion with feed and joint_angles, got 5."),
        ({"maze": 5}, "Expected a Maze, the name of one, or a file, got 5."),
        ([1], "Expected reset options by name, got [1]."),
        ({"state": 1, "feed": 2.0}, "Expected one of the reset options 'state' and 'feed', got both."),
        ({"maze": "L", "task_id": 2}, "Expected one of the reset options 'maze' and 'task_id', got both."),
    ],
    ids=str,
)
def test_a_bad_option_is_named(options, message):
    env = make()
    env.reset()
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        env.reset(options=options)
    with pytest.raises(gym.error.ResetNeeded, match=r"as the last one was refused\.$"):
        env.step(np.zeros(8))
    env.reset()
    env.step(np.zeros(8))


def test_thick_links_get_random_mazes_that_they_fit():
    env = gym.make(ID, maze="random", link_radius=15.0).unwrapped
    refused = 0
    for task_id in range(40):
        try:
            env.reset(options={"task_id": task_id})
        except InputError:
            refused += 1
    assert 0 < refused < 40  # of mazes that are asked for; drawn ones are drawn again
    for seed in range(40):
        env.reset(seed=seed)
        env.step(np.zeros(13))


def test_a_waypoint_beyond_the_motion_is_named():
    motion = SimpleNamespace(feed=np.zeros(2), joint_angles=np.zeros((2, 7)))
    with pytest.raises(InputError, match=r"^Expected a waypoint below 2, got 2\.$"):
        make().reset(options={"motion": motion, "waypoint": 2})
