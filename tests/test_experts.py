"""The expert through the evaluation of stable-baselines3: it succeeds wherever there is a plan."""

import gymnasium as gym
import numpy as np
import pytest

from hrsnake_env import ENVIRONMENTS, LADDER
from hrsnake_env.mazes import MAZES, PAPER_LINK_LENGTHS
from planners import plan
from planners.controllers import PlannedPolicy, PlanningPolicy
from planners.problem import PlanningStatus

evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
vec_env = pytest.importorskip("stable_baselines3.common.vec_env")

DENSE = [name for name in ENVIRONMENTS if "Sparse" not in name]
FAMILIES = [name for name in MAZES if name not in PAPER_LINK_LENGTHS]
FAMILY_LINK_LENGTH = 280.0


class Endings:
    """Keep how the episodes of an evaluation end."""

    def __init__(self, env):
        self.env, self.successes, self.clean = env, [], []

    def __call__(self, local, _):
        """Look at what `evaluate_policy` knows after a step."""
        if local["done"]:
            self.successes.append(bool(local["info"]["is_success"]))
            self.clean.append(
                local["info"]["total_collisions"] == 0 and local["info"]["worst_impulse"] == 0.0
            )


def evaluate(policy, env, n_episodes=1):
    endings = Endings(env)
    rewards, lengths = evaluation.evaluate_policy(
        policy, env, n_eval_episodes=n_episodes, callback=endings, return_episode_rewards=True, warn=False
    )
    assert all(endings.clean)
    return endings.successes, rewards, lengths


@pytest.mark.parametrize("name", [name for name in DENSE if "Random" not in name])
def test_the_planner_succeeds_on_every_task(name):
    env = vec_env.DummyVecEnv([lambda: gym.make(f"hrsnake_env:{name}")])
    world = env.envs[0].unwrapped
    successes, rewards, _ = evaluate(PlanningPolicy(env), env)
    assert successes == [True]
    # All of the way, in links, and the bonus.
    way = world._scene.way - world.maze.goal_radius
    assert rewards[0] == pytest.approx(way / world.arm.link_length + 10.0, abs=0.1)


@pytest.mark.parametrize("name", FAMILIES)
def test_a_planned_policy_succeeds_in_every_family(name):
    env = gym.make("hrsnake_env:HyperRedundantMaze-v0", maze=name, link_length=FAMILY_LINK_LENGTH)
    world = env.unwrapped
    result = plan(world.maze, world.arm)
    assert result.status is PlanningStatus.SOLVED
    successes, _, _ = evaluate(PlannedPolicy(result.motion), env)
    assert successes == [True]
    assert world.arm.n_links == result.motion.n_links


@pytest.mark.parametrize("action", ["delta", "absolute"])
@pytest.mark.parametrize("reward_type", ["dense", "sparse"])
def test_the_expert_succeeds_in_any_mode(action, reward_type):
    env = gym.make("hrsnake_env:HyperRedundantMaze-Bend-I60-v0", action=action, reward_type=reward_type)
    successes, rewards, _ = evaluate(PlanningPolicy(env), env, 2)
    assert successes == [True, True]
    if reward_type == "sparse":
        assert rewards == [1.0, 1.0]


def test_the_expert_plans_for_every_new_maze_of_several_environments():
    env = vec_env.DummyVecEnv([lambda: gym.make("hrsnake_env:HyperRedundantMaze-RandomTest-v0")] * 3)
    env.seed(7)
    policy = PlanningPolicy(env)
    successes, _, lengths = evaluate(policy, env, 18)
    unsolved = sum(result.status is not PlanningStatus.SOLVED for result in policy.results)
    assert len(successes) == 18 and len(set(lengths)) > 10
    assert unsolved < 3
    assert sum(successes) >= 18 - unsolved


@pytest.mark.parametrize("mode", ["NEXT_STEP", "SAME_STEP"])
def test_the_expert_succeeds_in_the_vectors_of_gymnasium(mode):
    vectors = pytest.importorskip("gymnasium.vector")
    arguments = {}
    if hasattr(vectors, "AutoresetMode"):
        arguments = {"vector_kwargs": {"autoreset_mode": vectors.AutoresetMode[mode]}}
    elif mode != "NEXT_STEP":
        pytest.skip("before Gymnasium 1.1 there was one mode")
    env = gym.make_vec(
        "hrsnake_env:HyperRedundantMaze-RandomTest-v0",
        num_envs=2,
        vectorization_mode="sync",
        difficulty=(0.0, 0.2),
        **arguments,
    )
    policy = PlanningPolicy(env)
    observation, _ = env.reset(seed=0)
    over, successes = np.ones(2, dtype=bool), []
    while len(successes) < 6:
        action, _ = policy.predict(observation, episode_start=over)
        observation, _, terminated, truncated, info = env.step(action)
        over = terminated | truncated
        ended = info["final_info"] if mode == "SAME_STEP" and over.any() else info
        successes += list(ended["is_success"][over])
        assert not ended["total_collisions"][over].any()
    assert all(successes)


def test_without_a_plan_the_expert_holds_still_and_says_why():
    env = gym.make("hrsnake_env:HyperRedundantMaze-v0", maze="fig19", link_length=470.0, n_links=7)
    env = gym.wrappers.TimeLimit(env, 5)
    policy = PlanningPolicy(env)
    observation, _ = env.reset()
    action, _ = policy.predict(observation, episode_start=np.array([True]))
    assert not action.any()
    assert policy.results[0].status is not PlanningStatus.SOLVED


def test_the_ladder_is_the_ids():
    mazes = {ENVIRONMENTS[name]["kwargs"].get("maze") for name in DENSE}
    assert mazes == {None, "random", *LADDER}
