"""Laws of saving and restoring: what follows is the same to the last bit."""

import copy
import pickle
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from hrsnake_env import InputError, Maze
from hrsnake_env.mazes import MAZES, PAPER_LINK_LENGTHS

ID = "hrsnake_env:HyperRedundantMaze-v0"
WAYS = ["get_state", "snapshot", "pickled state", "pickled env", "deep copy", "reset option"]


def make(maze="fig19", **arguments):
    length = PAPER_LINK_LENGTHS.get(maze, 300.0)
    return gym.make(
        ID, maze=maze, **{"link_length": length, "terminate_on_collision": False, **arguments}
    ).unwrapped


def actions_for(env, n, seed=0):
    """Return random actions that feed the arm, and so drive it into walls."""
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, *env.action_space.shape))
    actions[:, 0] = 1.0
    return actions


def rollout(env, actions):
    """Return all that the environment says, as bytes, step by step."""
    said = []
    for action in actions:
        observation, reward, terminated, _, info = env.step(action)
        numbers = [np.asarray(value, dtype=np.float64).tobytes() for value in info.values()]
        said.append((observation.tobytes(), reward, terminated, numbers))
    return said


def assert_equal(one, other):
    for step, (a, b) in enumerate(zip(one, other, strict=True)):
        assert a == b, step


@pytest.mark.parametrize("name", list(MAZES))
def test_an_episode_goes_on_from_a_state_and_a_snapshot_to_the_last_bit(name):
    env = make(name)
    env.reset(seed=1)
    actions = actions_for(env, 320)
    rollout(env, actions[:120])
    state = env.get_state()
    undisturbed = rollout(env, actions[120:])
    assert env.pinch_report().collision > 0  # walls have pushed, so there was something to remember
    env.set_state(state)
    assert_equal(rollout(env, actions[120:]), undisturbed)
    env.set_state(state)
    snapshot = env.snapshot()
    after = rollout(env, actions[120:])
    env.set_state(snapshot)
    assert_equal(rollout(env, actions[120:]), after)


@pytest.mark.parametrize("arguments", [{}, {"actuation": "gear"}, {"torque_limit": 2.0}], ids=str)
@pytest.mark.parametrize("way", WAYS)
def test_every_way_of_keeping_a_state_is_exact(way, arguments):
    env = make(**arguments)
    env.reset(seed=3)
    actions = actions_for(env, 160, seed=2)
    rollout(env, actions[:80])
    state = env.snapshot() if way == "snapshot" else env.get_state()
    other = {
        "pickled env": lambda: pickle.loads(pickle.dumps(env)),
        "deep copy": lambda: copy.deepcopy(env),
    }.get(way, lambda: make(**arguments))()
    expected = env.observe(), env.pinch_report()
    after = rollout(env, actions[80:])
    if way == "reset option":
        observation, info = other.reset(options={"state": state})
        assert np.array_equal(observation, expected[0])
        assert info["total_steps"] == 80
    elif way in ("get_state", "snapshot"):
        other.set_state(state)
    elif way == "pickled state":
        other.set_state(pickle.loads(pickle.dumps(state)))
    assert np.array_equal(other.observe(), expected[0])
    assert other.pinch_report() == expected[1]
    assert_equal(rollout(other, actions[80:]), after)


def test_taking_a_state_disturbs_nothing():
    one, other = make(), make()
    actions = actions_for(one, 150)
    for env in (one, other):
        env.reset(seed=0)
    said = []
    for action in actions:
        other.get_state()
        said += rollout(other, action[None])
    assert_equal(said, rollout(one, actions))


def test_states_can_be_gone_back_to_in_any_order():
    env = make()
    env.reset(seed=0)
    actions = actions_for(env, 90)
    states, expected = [], []
    for k in range(3):
        states.append(env.snapshot() if k == 1 else env.get_state())
        expected += rollout(env, actions[30 * k : 30 * k + 30])
    for k in (1, 0, 2, 1):
        env.set_state(states[k])
        # The snapshot of episode 1 came after state 0 and before state 2, whose run goes through it.
        said = rollout(env, actions[30 * k : 30 * k + 30])
        assert_equal(said, expected[30 * k : 30 * k + 30])


def test_random_mazes_go_on_as_they_would_have():
    env = gym.make(ID, maze="random").unwrapped
    env.reset(seed=5)
    state = env.get_state()
    tasks = [env.reset()[1]["task_id"] for _ in range(3)]
    env.set_state(state)
    assert [env.reset()[1]["task_id"] for _ in range(3)] == tasks
    assert len(set(tasks)) == 3
    env.reset(options={"state": state})
    assert np.array_equal(env.maze.walls, state.maze.walls)


def test_whole_episodes_are_bit_identical_in_other_processes():
    code = (
        "import hashlib, gymnasium, numpy as np\n"
        f"env = gymnasium.make({ID!r}, maze='zig3', link_length=250.0, terminate_on_collision=False)\n"
        "env.reset(seed=4)\n"
        "said, rng = hashlib.sha256(), np.random.default_rng(0)\n"
        "for _ in range(400):\n"
        "    action = rng.uniform(-1, 1, env.action_space.shape)\n"
        "    action[0] = abs(action[0])\n"
        "    observation, reward, *_, info = env.step(action)\n"
        "    said.update(observation.tobytes() + np.array([reward, info['impulse']]).tobytes())\n"
        "assert info['total_collisions'] > 0\n"
        "print(said.hexdigest())\n"
    )
    runs = {
        subprocess.run(
            [sys.executable, "-c", code],
            check=True,
            capture_output=True,
            text=True,
            env={"PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("0", "1")
    }
    assert len(runs) == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (None, "Expected a state from get_state or snapshot, got dict."),
        ({"n_links": 3}, "Expected a state of the same arm, with n_links=7, got one with n_links=3."),
        (
            {"n_links": 7, "link_length": 400.0},
            "Expected a state of the same arm, with link_length=430.0, got one with link_length=400.0.",
        ),
        ({"goal_radius": 60.0, "n_links": 7}, "Expected a state of the same world, with goal_radius=None, "),
        ({"actuation": "gear", "n_links": 7}, "Expected a state of the same world, with actuation="),
    ],
    ids=str,
)
def test_a_state_of_something_else_is_refused_and_changes_nothing(arguments, message):
    state = {"feed": 1.0}
    if arguments is not None:
        other = make("U40", **{"link_length": 430.0, **arguments})
        other.reset()
        state = other.get_state()
    env = make(n_links=7)
    env.reset(options={"feed": 900.0})
    before = env.observe()
    with pytest.raises(InputError, match=f"^{message}"):
        env.set_state(state)
    assert env.maze.name == "fig19"
    assert np.array_equal(env.observe(), before)


def test_a_state_of_another_maze_takes_the_environment_there():
    env, other = make(), make(maze="U40", n_links=7, link_length=430.0)
    other.reset(seed=0)
    actions = actions_for(other, 60)
    rollout(other, actions[:30])
    state = other.get_state()
    after = rollout(other, actions[30:])
    env.reset(seed=0)
    env.set_state(state)
    assert isinstance(env.maze, Maze) and env.maze.name == "U40"
    assert_equal(rollout(env, actions[30:]), after)
