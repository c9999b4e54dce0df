"""Contracts of the environment: Gymnasium's, stable-baselines3's and its own documentation's."""

import math
import re
import subprocess
import sys
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import hrsnake_env
from hrsnake_env import ArmSpec, InputError, Maze
from hrsnake_env.arm import FEEDER_RELEASE, feeder_angle_limits, joints_from_configuration
from hrsnake_env.env import HyperRedundantMazeEnv
from hrsnake_env.observation import observation_names, observation_parts
from hrsnake_env.options import RESET_OPTIONS
from hrsnake_env.physics import RAY_REACH
from hrsnake_env.pictures import MazePicture
from hrsnake_env.task import (
    CONTACT_PENALTY,
    FEED_STEP,
    GOAL_BONUS,
    JAM_DRIFT,
    JAM_NODE_ERROR,
    JOINT_STEP,
    LARGEST_PROGRESS,
    LARGEST_STEP,
    SPARSE_GOAL_REWARD,
)

ID = "HyperRedundantMaze-v0"
SHORT = Maze.from_corridors([(0, 0), (0, 900)], 300.0, name="short", goal=(0.0, 450.0), goal_radius=40.0)
"""A straight corridor: feeding alone reaches the goal."""


def make(**arguments):
    return gym.make(ID, **{"maze": "fig19", "link_length": 430.0, **arguments})


def feeding(env, amount=1.0):
    action = np.zeros(env.action_space.shape)
    action[0] = amount
    return action


# The contracts of others


MODES = [
    {},
    {"rays": True},
    {"observation": "goal"},
    {"observation": "goal", "reward_type": "dense", "rays": True},
    {"observation": "image", "image_size": 48},
    {"action": "absolute", "joint_limit": 2.0},
    {"reward_type": "sparse", "success_hold_steps": 3, "goal_radius": 40.0},
    {"maze": "random", "link_length": None, "difficulty": (0.0, 0.3), "split": "test"},
    {"render_mode": "rgb_array"},
    {"n_links": 1},
    {"link_radius": 10.0},
    {"actuation": "gear"},
    {"torque_limit": 1.0},
]


@pytest.mark.parametrize("arguments", MODES, ids=str)
def test_gymnasium_finds_nothing_to_warn_of(arguments):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(**arguments).unwrapped)


@pytest.mark.parametrize("arguments", MODES, ids=str)
def test_stable_baselines3_finds_nothing_to_warn_of(arguments):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(make(**{"render_mode": "rgb_array", **arguments}).unwrapped)


def test_the_world_registers_itself_once_and_without_the_simulator():
    code = (
        "import sys, warnings; warnings.simplefilter('error')\n"
        "import hrsnake_env, importlib\n"
        "assert 'pymunk' not in sys.modules\n"
        "importlib.reload(hrsnake_env)\n"
        "import gymnasium\n"
        f"assert gymnasium.spec({ID!r}).max_episode_steps == 10_000\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
    code = f"import gymnasium; gymnasium.make('hrsnake_env:{ID}').reset()"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_all_names_of_the_package_are_there():
    assert all(hasattr(hrsnake_env, name) for name in hrsnake_env.__all__)


# Episodes


def test_a_random_policy_meets_no_nan_and_stays_in_the_spaces():
    env = make(terminate_on_collision=False)
    env.action_space.seed(3)
    observation, info = env.reset(seed=3)
    keys, seen, ends = list(info), [], 0
    for _ in range(4000):
        action = env.action_space.sample()
        action[0] = abs(action[0])
        observation, reward, terminated, truncated, info = env.step(action)
        seen.append(observation)
        assert env.observation_space.contains(observation)
        assert math.isfinite(reward)
        assert all(np.isfinite(value).all() for value in info.values())
        assert list(info) == keys
        if terminated or truncated:
            ends += 1
            env.reset()
    assert ends > 0
    n = env.unwrapped.physics.n_links
    constant = np.flatnonzero(np.ptp(seen, axis=0) == 0.0)
    # Only links that have never left the feeder have nothing to tell: the rear one cannot.
    names = np.concatenate([np.full(length, name) for name, (length, _) in observation_parts(n).items()])
    assert set(names[constant]) <= {"joint_angles", "target_errors", "speeds", "clearances"}


def test_info_has_the_same_keys_and_kinds_from_the_reset_on():
    env = make()
    _, first = env.reset()
    *_, second = env.step(feeding(env))
    kinds = [{key: (type(v), np.shape(v)) for key, v in info.items()} for info in (first, second)]
    assert kinds[0] == kinds[1]
    documented = re.findall(r"^ *\| ([\w, ]+?) +\| ", HyperRedundantMazeEnv.__doc__.split("## Info")[1], re.M)
    assert list(first) == [key for keys in documented[1:] for key in keys.split(", ")]
    terms = [value for key, value in first.items() if key.startswith("reward_")]
    assert terms == [0.0, 0.0, 0.0]


def test_two_rollouts_with_the_same_actions_are_equal():
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (300, 8))
    actions[:, 0] = np.abs(actions[:, 0])
    rollouts = []
    env = make(terminate_on_collision=False, n_links=7)
    for _ in range(2):
        observation, _ = env.reset(seed=1)
        trace = [observation]
        for action in actions:
            observation, reward, terminated, _, info = env.step(action)
            trace.append(np.append(observation, [reward, info["clearance"], info["impulse"]]))
            if terminated:
                break
        rollouts.append(trace)
    for step, (a, b) in enumerate(zip(*rollouts, strict=True)):
        assert np.array_equal(a, b), step


def test_observations_share_no_memory():
    env = make()
    first, _ = env.reset()
    kept = first.copy()
    env.step(feeding(env))
    assert np.array_equal(first, kept)


def test_the_goal_ends_the_episode_as_a_success():
    env = gym.make(ID, maze=SHORT, link_length=200.0)
    env.reset()
    terminated, total = False, 0.0
    while not terminated:
        _, reward, terminated, truncated, info = env.step(feeding(env))
        total += reward
        assert reward == pytest.approx(sum(v for key, v in info.items() if key.startswith("reward_")))
        assert not truncated
    assert info["success"] and info["is_success"]
    assert info["tip_distance"] <= SHORT.goal_radius
    assert info["reward_goal"] == GOAL_BONUS
    # The tip has come 445 - 40 nearer, of which a link is 200.
    assert total == pytest.approx(GOAL_BONUS + (445.0 - 40.0) / 200.0, abs=0.1)
    assert env.unwrapped.pinch_report().clean


@pytest.mark.parametrize("ends", [True, False])
def test_a_collision_ends_the_episode_if_it_shall(ends):
    env = make(terminate_on_collision=ends)
    env.reset(options={"feed": 900.0})
    action = feeding(env, 0.0)
    action[-1] = 1.0
    info = {"collisions": 0}
    while info["collisions"] == 0:
        _, _, terminated, _, info = env.step(action)
    assert terminated is ends
    assert info["collisions"] == 1
    assert info["depth"] > 0.001 * 430.0
    assert not info["success"]
    assert info["reward_contact"] == -CONTACT_PENALTY
    report = env.unwrapped.pinch_report()
    assert report.first_collision.link == env.unwrapped.physics.n_links - 1
    assert not report.clean


def test_an_arm_pushed_on_into_a_wall_does_not_wind_up():
    env = make(terminate_on_collision=False)
    env.reset(options={"feed": 1500.0})
    for _ in range(200):  # the end of the leg is 95 away
        *_, terminated, _, info = env.step(feeding(env))
        assert not terminated
    assert info["total_collisions"] > 100
    assert info["worst_depth"] < 0.05 * 430.0
    place = info["feed"]
    for _ in range(3):  # the first of them ends the push
        *_, info = env.step(feeding(env, -1.0))
    assert info["feed"] < place - FEED_STEP * 430.0
    assert info["collisions"] == 0


def test_a_refused_action_changes_nothing_even_after_a_collision():
    env = make(terminate_on_collision=False).unwrapped
    env.reset(options={"feed": 1500.0})
    while env.step(feeding(env))[-1]["collisions"] == 0:
        pass
    target, moves = env.target, len(env.get_state().physics.moves)
    with pytest.raises(InputError):
        env.step(np.full(env.action_space.shape, np.nan))
    assert np.array_equal(env.target, target)
    assert len(env.get_state().physics.moves) == moves


def test_numbers_of_numpy_as_arguments_change_no_kind():
    env = make(success_hold_steps=np.int64(2), contact_penalty=np.float32(0.5), terminate_on_collision=False)
    _, first = env.reset(options={"feed": 1500.0})
    for _ in range(20):
        *_, terminated, _, info = env.step(feeding(env))
    assert info["total_collisions"] > 0 and type(terminated) is bool
    assert {key: type(value) for key, value in info.items()} == {key: type(v) for key, v in first.items()}


def test_an_arm_on_gears_goes_where_a_wall_stops_one_driven_by_computed_torque():
    depths = {}
    for actuation in ("computed_torque", "gear"):
        env = make(terminate_on_collision=False, actuation=actuation)
        env.reset(options={"feed": 900.0})
        action = feeding(env, 0.0)
        action[-1] = 1.0
        depths[actuation] = [env.step(action)[-1]["depth"] for _ in range(8)][-1]
    assert depths["gear"] > 5.0 * depths["computed_torque"] > 0.0


def test_the_time_limit_truncates():
    env = gym.make(ID, max_episode_steps=3)
    env.reset()
    assert [env.step(feeding(env, 0.1))[3] for _ in range(3)] == [False, False, True]


# Actions


def test_an_action_changes_the_targets_by_the_step_limits():
    env = make().unwrapped
    env.reset(options={"feed": 900.0})
    action = np.zeros(env.action_space.shape)
    action[0], action[-1] = 0.25, -0.5
    env.step(action)
    expected = np.zeros(env.action_space.shape)
    expected[0], expected[-1] = 900.0 + 0.25 * FEED_STEP * 430.0, -0.5 * JOINT_STEP
    np.testing.assert_allclose(env.target, expected, atol=1e-9)
    env.step(10.0 * action)  # cut to [-1, 1]
    expected[0] += FEED_STEP * 430.0
    moved = math.hypot(0.02, 0.05) + 0.02  # more than the largest step: all of it is scaled down
    assert moved > LARGEST_STEP
    share = (env.target[-1] - expected[-1]) / -JOINT_STEP
    assert 0.5 < share < 1.0
    assert env.target[0] == pytest.approx(expected[0] - (1 - share) * FEED_STEP * 430.0, abs=1e-6)


def test_a_float64_action_keeps_its_digits():
    env = make().unwrapped
    env.reset(options={"feed": 900.0})
    action = np.zeros(env.action_space.shape)
    action[-1] = 1.0 / 3.0
    env.step(action)
    assert env.target[-1] == pytest.approx(JOINT_STEP / 3.0, rel=1e-14)


def test_no_joint_moves_farther_in_a_step_than_the_largest_step():
    env = make(terminate_on_collision=False).unwrapped
    rng = np.random.default_rng(1)
    env.reset(options={"feed": 1300.0})
    before = env.physics.target_joints
    collided = 0
    for _ in range(100):
        _, _, terminated, _, info = env.step(rng.choice([-1.0, 1.0], env.action_space.shape))
        after = env.physics.target_joints
        assert np.linalg.norm(after - before, axis=1).max() <= LARGEST_STEP * 430.0 * 1.001
        limits = feeder_angle_limits(env.target[0], env.physics.n_links, 430.0)
        assert (np.abs(env.target[1:]) <= limits + 1e-12).all()
        before = after
        if info["collisions"]:  # then the targets are taken back to where the arm is
            collided += 1
            feed, angles = env.physics.feed, env.physics.joint_angles
            limits = feeder_angle_limits(feed, env.physics.n_links, 430.0)
            angles = np.clip(angles, -limits, limits)
            before = joints_from_configuration(feed, angles, 430.0, env.maze.base_pose)
        if terminated:
            env.reset(options={"feed": 1300.0})
            before = env.physics.target_joints
    assert 0 < collided < 100


def test_joints_in_the_feeder_stay_straight_whatever_their_action():
    env = make().unwrapped
    env.reset()
    for _ in range(20):
        env.step(np.ones(env.action_space.shape))
    assert env.target[0] > 0.0
    assert (env.target[1:] == 0.0).all()


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(7), r"Expected an action with shape (8,), got (7,)."),
        (np.zeros((1, 8)), r"Expected an action with shape (8,), got (1, 8)."),
        (np.array([0, 0, 0, np.nan, 0, 0, 0, 0]), r"Expected a finite action, got nan at index 3."),
        ("a", r"Expected an action in numbers, got 'a'."),
        (np.array([np.inf, 0, 0, 0, 0, 0, 0, 0]), r"Expected a finite action, got inf at index 0."),
    ],
)
def test_a_bad_action_is_named(action, message):
    env = make(n_links=7).unwrapped
    env.reset()
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        env.step(action)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"maze": "fig20"}, "Unknown maze 'fig20'. Available: fig19, "),
        ({"link_length": -1.0}, "Expected a positive, finite link_length, got -1.0."),
        ({"link_length": 1e4}, "Expected a link_length of at most the size of maze 'fig19'"),
        ({"n_links": 0}, "Expected n_links to be a whole number of at least 1, or None, got 0."),
        ({"substeps": 0}, "Expected substeps to be a whole number of at least 1, got 0."),
        ({"actuation": "magic"}, "Unknown actuation 'magic'. Available: 'computed_torque', 'gear'."),
        (
            {"actuation": "gear", "torque_limit": 0.5},
            "Expected no torque_limit with actuation 'gear', got 0.5.",
        ),
        ({"render_mode": "ansi"}, "Unknown render_mode 'ansi'. Available: None, 'human', 'rgb_array'."),
        ({"observation": "x"}, "Unknown observation 'x'. Available: 'state', 'goal', 'image'."),
        ({"observation": "image", "rays": True}, "Expected rays=False with observation 'image', got True."),
        ({"action": "x"}, "Unknown action 'x'. Available: 'delta', 'absolute'."),
        ({"reward_type": "x"}, "Unknown reward_type 'x'. Available: 'dense', 'sparse'."),
        ({"maze": "random", "split": "x"}, "Unknown split 'x'. Available: 'train', 'test'."),
        (
            {"contact_penalty": -0.1},
            "Expected contact_penalty to be a finite number of at least 0, got -0.1.",
        ),
        ({"success_hold_steps": 0}, "Expected success_hold_steps to be a whole number of at least 1, got 0."),
        ({"image_size": 8}, "Expected image_size to be a whole number of at least 16, got 8."),
        ({"goal_radius": 0.0}, "Expected a positive, finite goal_radius, or None, got 0.0."),
        ({"rays": "no"}, "Expected rays to be True or False, got 'no'."),
        ({"terminate_on_collision": None}, "Expected terminate_on_collision to be True or False, got None."),
        ({"maze": 5}, "Expected a Maze, the name of one, or a file, got 5."),
        ({"maze": "random", "split": []}, "Unknown split []. Available: 'train', 'test'."),
        ({"torque_limit": "a"}, "Expected a positive torque_limit, or None, got 'a'."),
        (
            {"link_length": 1e-3},
            "Expected a link_length with which 1000 links reach the goal, or n_links, got ",
        ),
        ({"maze": "random", "difficulty": 0.5}, "Expected a range of difficulties in [0, 1], got 0.5."),
        ({"difficulty": (0.0, 0.3)}, "Expected no difficulty but with maze='random', got (0.0, 0.3)."),
        (
            {"maze": "random", "difficulty": (0, 1, 2)},
            "Expected a range of difficulties in [0, 1], got (0, 1, 2).",
        ),
        (
            {"n_links": 1, "observation": "goal", "link_length": 430.0},
            "Expected a goal within the arm's 430 px for observation 'goal', got one 735.",
        ),
        ({"joint_limit": 4.0}, "Expected joint_limit in (0, pi] rad, or None, got 4.0."),
        (
            {"maze": "random", "difficulty": (0.5, 2.0)},
            "Expected a range of difficulties in [0, 1], got (0.5, 2.0).",
        ),
    ],
)
def test_a_bad_argument_is_named(arguments, message):
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        HyperRedundantMazeEnv(**arguments)


# What the documentation says


def test_the_table_of_the_docstring_is_the_observation_space():
    rows = re.findall(
        r"^ *\| (\w+) +\| ([\w +*]+?) +\|.*\| (-?\d) +\| (\d) +\|$", HyperRedundantMazeEnv.__doc__, re.M
    )
    n = 5
    documented = {name: (eval(number, {"n_links": n}), float(low)) for name, number, low, _ in rows}
    assert documented == observation_parts(n, rays=True)
    low = np.concatenate([np.full(length, bound) for length, bound in documented.values()])
    env = make(n_links=n, rays=True)
    assert np.array_equal(env.observation_space.low, low)
    assert np.array_equal(env.observation_space.high, np.ones(len(low)))
    assert len(observation_names(n, rays=True)) == len(low)
    assert make(n_links=n).observation_space.shape == (4 * n + 16,) == (len(low) - 8 - 2 * n,)
    goal = make(n_links=n, observation="goal").observation_space
    assert goal["observation"].shape == (4 * n + 16 - 9,)
    assert env.action_space.shape == (n + 1,)


def test_the_docstring_states_the_constants():
    text = HyperRedundantMazeEnv.__doc__
    for value in (FEED_STEP, JOINT_STEP, LARGEST_STEP):
        assert f"{value:g}" in text
    for value in (LARGEST_PROGRESS, JAM_NODE_ERROR, JAM_DRIFT, FEEDER_RELEASE, RAY_REACH):
        assert f"{value:g}" in text
    assert re.search(rf"\| reward_goal +\| {GOAL_BONUS:g} on success +\| {SPARSE_GOAL_REWARD:g} on", text)
    assert f"{-CONTACT_PENALTY:g} (`contact_penalty`) in a step" in text
    options = re.findall(r"^ *\| `(\w+)` +\| ", text.split("## Starting State")[1], re.M)
    assert sorted(options) == sorted(RESET_OPTIONS)


def test_an_observation_holds_what_its_parts_are_called():
    env = make(rays=True).unwrapped
    physics, maze = env.physics, env.maze
    n, reach = physics.n_links, physics.n_links * 430.0
    angles = np.zeros(n)
    angles[-1] = 0.1
    observation, info = env.reset(options={"feed": 900.0, "joint_angles": angles})
    parts, start = {}, 0
    for name, (length, _) in observation_parts(n, rays=True).items():
        parts[name] = observation[start : start + length]
        start += length
    heading = math.pi / 2 + 0.1
    tip = np.array([0.0, 5.0 + 900.0 - 430.0]) + 430.0 * np.array([math.cos(heading), math.sin(heading)])
    assert parts["feed"][0] == pytest.approx(900.0 / reach)
    assert parts["joint_angles"][-1] == pytest.approx(0.1 / math.pi, rel=1e-5)
    np.testing.assert_allclose(parts["tip_position"] * reach, tip - [0.0, 5.0], rtol=1e-5)
    np.testing.assert_allclose(parts["tip_heading"], [math.cos(heading), math.sin(heading)], rtol=1e-5)
    np.testing.assert_allclose(parts["goal_offset"] * reach, maze.goal - tip, rtol=1e-5)
    np.testing.assert_allclose(parts["clearances"], np.minimum(physics.clearance / 430.0, 1.0), rtol=1e-5)
    way, left = (env._scene.distance(place) for place in (maze.base_pose[:2], tip))
    assert parts["goal_distance"][0] == pytest.approx(0.5 * left / way, rel=1e-5)
    ahead = env._scene.distance.ahead(tip, [215.0, 430.0, 860.0]) - tip
    turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
    seen = parts["ahead"].reshape(3, 2) * np.array([[215.0], [430.0], [860.0]])
    np.testing.assert_allclose(seen, ahead @ turn, rtol=1e-4, atol=0.1)
    # To the corridor's sides, 100 to the left and right of its middle; joints in the feeder see nothing.
    sides = parts["side_rays"].reshape(n, 2) * 2.0 * 430.0
    np.testing.assert_allclose(sides[-1], 100.0 / math.cos(0.05), rtol=1e-4)
    np.testing.assert_allclose(sides[-2], 100.0, rtol=1e-4)
    np.testing.assert_allclose(parts["side_rays"][: -2 * 3], 1.0)
    right = (100.0 - tip[0]) / math.cos(heading - math.radians(75.0))
    assert parts["tip_rays"][1] * 2.0 * 430.0 == pytest.approx(right, rel=1e-4)
    assert info["feed"] == pytest.approx(900.0)


def test_errors_and_speeds_are_those_of_the_last_step():
    env = make(substeps=1).unwrapped
    n = env.physics.n_links
    env.reset(options={"feed": 900.0})
    action = np.zeros(n + 1)
    action[0], action[-1] = 0.5, -0.25
    env.step(action)
    observation, *_ = env.step(action)
    errors, speeds = (observation[1 + n + k * (n + 1) : 1 + n + (k + 1) * (n + 1)] for k in (0, 1))
    # The arm is one substep behind its target, and goes as fast as the target.
    np.testing.assert_allclose(errors[[0, -1]], [0.5, -0.25], atol=1e-3)
    np.testing.assert_allclose(speeds[[0, -1]], [0.5, -0.25], atol=1e-3)
    np.testing.assert_allclose(np.delete(speeds, [0, n]), 0.0, atol=1e-3)


def test_the_default_arm_fits_its_maze_and_reaches_the_goal():
    for name in ("fig19", "spiral", "stairs"):
        env = HyperRedundantMazeEnv(maze=name)
        assert isinstance(env.arm, ArmSpec)
        assert env.arm.n_links * env.arm.link_length > np.linalg.norm(env.maze.goal - env.maze.base_pose[:2])
    assert HyperRedundantMazeEnv(maze="fig19", link_length=430.0).arm.n_links == 7


# Pictures


@pytest.mark.image
def test_a_picture_changes_with_the_pose_and_shows_what_touches():
    env = make(render_mode="rgb_array")
    env.reset(options={"feed": 900.0})
    first = env.render()
    assert first.dtype == np.uint8
    assert first.ndim == 3
    assert first.shape[2] == 3
    assert np.array_equal(first, env.render())
    action = feeding(env, 0.0)
    action[-1] = 1.0
    for _ in range(6):
        if env.step(action)[2]:
            break
    second = env.render()
    red = (second[..., 0] > 180) & (second[..., 1] < 80) & (second[..., 2] < 80)
    assert red.any()
    assert not ((first[..., 0] > 180) & (first[..., 1] < 80) & (first[..., 2] < 80)).any()


def test_rendering_without_a_mode_warns_and_returns_nothing():
    env = make().unwrapped
    env.reset()
    with pytest.warns(UserWarning, match="without a render mode"):
        assert env.render() is None


@pytest.mark.image
def test_a_picture_is_written_as_png_or_svg(tmp_path):
    picture = MazePicture(SHORT, title="short")
    picture.draw_arm(np.array([[0.0, -100.0], [0.0, 100.0], [50.0, 290.0]]), pinched=[1])
    picture.add_arm(np.array([[0.0, -100.0], [0.0, 100.0]]), colour="black", alpha=0.3)
    for suffix in ("png", "svg"):
        path = tmp_path / f"picture.{suffix}"
        picture.save(path)
        assert path.stat().st_size > 1000
    assert sorted(p.name for p in tmp_path.iterdir()) == ["picture.png", "picture.svg"]
