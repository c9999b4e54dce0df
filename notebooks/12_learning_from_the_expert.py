# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Learning from the expert
#
# What does a planner that solves every task give to a learner? Demonstrations. A small network that imitates
# it passes a U-turn after seconds on one core, for which reinforcement learning takes minutes even if its
# episodes start along a planned motion. Noise in the demonstrations is what makes the difference: they then show
# how to come back, and the pupil withstands pushes that an open-loop plan does not.

# %%
import tempfile

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np

from planners.controllers import PlanningPolicy
from planners.demonstrator import Demonstrator
from planners.figures import STYLE, draw_ends, draw_walls
from planners.rl.clone import clone
from planners.rl.evaluate import evaluate, summary
from planners.rl.network import NetworkPolicy
from planners.rl.shipped import POLICIES

plt.rcParams.update(STYLE)
TASK = "HyperRedundantMaze-UTurn-I60-v0"
env = gym.make(f"hrsnake_env:{TASK}")
world = env.unwrapped
print(f"{world.maze.name}: {world.arm.n_links} links of {world.arm.link_length:g} px, ", end="")
print(f"{env.observation_space.shape[0]} observed numbers, {env.action_space.shape[0]} actions")

# %% [markdown]
# ## Demonstrations
#
# `Demonstrator` follows a planned motion in a closed loop: each action goes to the pose after the nearest one.
# Noise pushes the arm off it, and what is recorded is what the planner would have done without. Ways of the
# tip, with more and more noise:


# %%
def demonstrate(noise, seed):
    teacher, rng, tips, over = Demonstrator(env), np.random.default_rng(seed), [], False
    _, info = env.reset(seed=seed)
    teacher.begin()
    while not over:
        push = noise * rng.standard_normal(env.action_space.shape)
        _, _, terminated, truncated, info = env.step(teacher.noisy(teacher.action(), push))
        tips.append(world.physics.joints[-1].copy())
        over = terminated or truncated
    return np.array(tips), info["is_success"]


figure, every = plt.subplots(1, 4, figsize=(9.6, 3.6))
for axes, noise in zip(every, (0.0, 0.1, 0.3, 0.6), strict=True):
    shown = [demonstrate(noise, seed) for seed in range(1 if noise == 0.0 else 5)]
    draw_walls(axes, world.maze)
    draw_ends(axes, world.maze)
    for tips, _ in shown:
        axes.plot(*tips.T, color="#1f5fae", linewidth=0.8, alpha=0.8)
    axes.set_title(f"noise {noise:g}: {sum(success for _, success in shown)} of {len(shown)} arrive")
plt.show()

# %% [markdown]
# ## The pupil
#
# `clone` goes in rounds: the expert plays, a perceptron of two layers is fitted to all that was seen so far,
# 20 test episodes with sampled actions say how good it is. `hrsnake train ID --method clone` does the same;
# `dagger` lets the pupil play more and more.

# %%
with tempfile.TemporaryDirectory() as folder:
    run = clone("clone", TASK, seed=0, steps=5000, folder=folder, quiet=True)
    pupil = NetworkPolicy.load(run.policy)
steps, seconds, successes = np.array(run.curve).T
print(f"{run.stopped}: {run.steps} steps, {run.episodes} episodes, {run.cpu_seconds:.1f} s of the processor")
for count, share in zip(steps, successes, strict=True):
    print(f"after {count:.0f} steps {share:.0%} of the test episodes arrive")

# %% [markdown]
# ## Beside others
#
# The expert plans at each reset. `u-turn-i60-ppo-planned` comes with the package: PPO that started most
# episodes along a planned motion. The last row is PPO that learnt in a loose U-turn (I = 0.30), as plain PPO
# did not learn this one. Ten episodes each, with sampled actions where a policy has any.

# %%
TUTOR = "u-turn-i60-ppo-planned"
policies = {"the expert": PlanningPolicy(env), "its pupil": pupil, "PPO, planned starts": NetworkPolicy.load(POLICIES[TUTOR])}
policies["PPO, from the loose U-turn"] = NetworkPolicy.load(POLICIES["u-turn-i30-ppo"])
print(f"{'':28}success  clean  steps  return  deepest   trained on")
for name, policy in policies.items():
    learnt = isinstance(policy, NetworkPolicy)
    facts = evaluate(policy, TASK, episodes=10, deterministic=False, env=None if learnt else env)
    mean = summary(facts)
    print(f"{name:28}{mean['success']:6.0%} {mean['clean']:7.0%} {mean['steps']:6.0f}", end=" ")
    print(f"{mean['return']:7.1f} {mean['worst_depth']:8.4f}   {policy.origin.train_steps if learnt else 0:,} steps")
