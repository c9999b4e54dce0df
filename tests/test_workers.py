"""Laws of environments side by side, in one process and in workers of every kind."""

import multiprocessing
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from hrsnake_env import ENVIRONMENTS

ID = "hrsnake_env:HyperRedundantMaze-UTurn-I50-v0"
N_ENVS, N_STEPS = 2, 60


def make_one():
    """Return an environment; workers get this function by its name."""
    return gym.make(ID)


def actions():
    values = np.random.default_rng(0).uniform(-1.0, 1.0, (N_STEPS, N_ENVS, 6)).astype(np.float32)
    values[..., 0] = np.abs(values[..., 0])
    return values


@pytest.fixture(scope="module")
def alone():
    """Return observations of environments that run one by one, seeded as vectors seed theirs."""
    seen = []
    for k in range(N_ENVS):
        env = make_one()
        run = [env.reset(seed=7 + k)[0]]
        for action in actions():
            observation, _, terminated, truncated, _ = env.step(action[k])
            assert not (terminated or truncated)
            run.append(observation)
        seen.append(run)
    return np.array(seen).swapaxes(0, 1)


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_a_vector_environment_is_its_environments(mode, alone):
    envs = gym.make_vec(ID, num_envs=N_ENVS, vectorization_mode=mode)
    seen = [envs.reset(seed=7)[0].copy()]
    for action in actions():
        observation, rewards, _, _, info = envs.step(action)
        seen.append(observation.copy())
        assert rewards.shape == info["clearance"].shape == info["is_success"].shape == (N_ENVS,)
        assert info["joint_torques"].shape == (N_ENVS, 5)
    envs.close()
    assert np.array_equal(seen, alone)


@pytest.mark.parametrize("start", ["fork", "spawn", "forkserver"])
def test_workers_of_every_kind_know_the_ids(start, alone):
    vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {start} here")
    envs = vec_env.SubprocVecEnv([make_one] * N_ENVS, start_method=start)
    envs.seed(7)
    seen = [envs.reset()]
    for action in actions():
        envs.step_async(action)
        seen.append(envs.step_wait()[0])
    assert [maze.name for maze in envs.get_attr("maze")] == ["u-turn-i50"] * N_ENVS
    envs.close()
    assert np.array_equal(seen, alone)


def test_an_environment_in_the_same_process_is_as_good(alone):
    vec_env = pytest.importorskip("stable_baselines3.common.vec_env")
    envs = vec_env.DummyVecEnv([make_one] * N_ENVS)
    envs.seed(7)
    seen = [envs.reset(), *(envs.step(action)[0].copy() for action in actions())]
    assert np.array_equal(seen, alone)


@pytest.mark.parametrize("name", list(ENVIRONMENTS))
def test_gymnasium_and_stable_baselines3_find_nothing_to_warn_of_in_any_id(name):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gym.make(f"hrsnake_env:{name}")
        check_env(env.unwrapped, skip_render_check=True)
        checker.check_env(env.unwrapped, skip_render_check=True)
    assert env.spec.max_episode_steps == ENVIRONMENTS[name]["max_episode_steps"]


def test_hindsight_replay_computes_the_rewards_that_the_environment_gave():
    env = gym.make(ID, observation="goal", reward_type="dense", terminate_on_collision=False).unwrapped
    observation, _ = env.reset()
    achieved, desired, infos, rewards = [], [], [], []
    for action in np.repeat(actions()[:, 0], 4, axis=0):
        observation, reward, terminated, _, info = env.step(action)
        assert reward == env.compute_reward(observation["achieved_goal"], observation["desired_goal"], info)
        achieved.append(observation["achieved_goal"])
        desired.append(observation["desired_goal"])
        infos.append(info)
        rewards.append(reward)
        assert not terminated
    assert any(info["collisions"] for info in infos)
    batch = env.compute_reward(np.array(achieved), np.array(desired), infos)
    np.testing.assert_array_equal(batch, rewards)
    # To be where the tip is would have been a success each time.
    relabelled = env.compute_reward(np.array(achieved), np.array(achieved), np.array([{}] * len(infos)))
    np.testing.assert_array_equal(relabelled, 1.0)


def test_hindsight_replay_of_stable_baselines3_learns_from_it():
    sb3 = pytest.importorskip("stable_baselines3")
    env = gym.make("hrsnake_env:HyperRedundantMaze-Straight-Sparse-v0", observation="goal", max_episode_steps=30)
    model = sb3.SAC(
        "MultiInputPolicy",
        env,
        replay_buffer_class=sb3.HerReplayBuffer,
        learning_starts=60,
        batch_size=32,
        policy_kwargs={"net_arch": [16]},
        seed=0,
    )
    model.learn(90)
    rewards = model.replay_buffer.sample(64).rewards
    assert (rewards == 1.0).any()  # of relabelled transitions: the tip never came to the goal
