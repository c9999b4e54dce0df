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
# it comes through a U-turn after two of them and some seconds on one core; PPO takes a minute or two for the
# same, and only if its episodes start along a planned motion. The demonstrations have noise, so they show how
# to come back: the pupil comes through with pushes under which the plan alone is lost.

# %%
import tempfile

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np
from gymnasium.wrappers import TransformAction

from planners.controllers import PlanningPolicy
from planners.demonstrator import Demonstrator
from planners.figures import STYLE, draw_ends, draw_walls
from planners.rl.clone import clone
from planners.rl.environments import WRAPPERS, decision_steps
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
# `Demonstrator` follows a planned motion in a closed loop: each action goes to the pose after the nearest
# one. Noise pushes the arm off it, and what is recorded is what the planner would have done without. Ways of
# the tip, with more and more noise:


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
# `clone` goes in rounds: the expert plays, a perceptron with two hidden layers is fitted to all that was seen
# so far, and 20 test episodes with sampled actions say how good it is. At 98 % it stops. `resume` goes on,
# here for another round. `hrsnake train ID --method clone` does the same; with `dagger` the pupil itself
# plays.

# %%
pupils = {}
with tempfile.TemporaryDirectory() as folder:
    for name, steps, share in (("after a round", 500, 0.98), ("after two rounds", 1000, 1.1)):
        run = clone("clone", TASK, steps=steps, folder=folder, resume=bool(pupils), stop_at=share, quiet=True)
        pupils[name] = NetworkPolicy.load(run.policy)
for steps, seconds, share in run.curve:
    print(f"after {steps} steps and {seconds:.1f} s of the processor {share:.0%} of the test episodes arrive")

# %% [markdown]
# ## Beside others
#
# The expert plans at each reset. `u-turn-i60-ppo-planned` comes with the package: PPO whose episodes started
# along a planned motion, near the goal at first. The last row is plain PPO as learnt in a loose U-turn, I =
# 0.30; at 0.50 it came to nothing when tried (docs/comparison.md). Ten episodes each, with sampled actions
# where a policy has any; depth in link lengths.

# %%
ppo, loose = (NetworkPolicy.load(POLICIES[name]) for name in ("u-turn-i60-ppo-planned", "u-turn-i30-ppo"))
rows = {
    "the expert": PlanningPolicy(env),
    **pupils,
    "PPO, planned starts": ppo,
    "PPO of the loose U-turn": loose,
}
print(f"{'':26}success  clean  steps  return  deepest  steps to learn")
for name, policy in rows.items():
    own = None if isinstance(policy, NetworkPolicy) else env
    mean = summary(evaluate(policy, TASK, episodes=10, deterministic=False, env=own))
    print(f"{name:26}{mean['success']:7.0%} {mean['clean']:6.0%} {mean['steps']:6.0f}", end=" ")
    print(f"{mean['return']:7.1f} {mean['worst_depth']:8.4f}", end="  ")
    print("none" if own else f"{policy.origin.train_steps * decision_steps(policy.origin.wrappers):,}")

# %% [markdown]
# ## Pushed
#
# Now something pushes: noise is added to every action, in shares of the largest one. An episode ends where a
# link goes into a wall. The expert's plan is carried out blindly, and errors add up. A pupil has seen what to
# do beside the planned motion, the more often the longer it was taught.


# %%
def pushed_success(policy, noise):
    world, rng = gym.make(f"hrsnake_env:{TASK}"), np.random.default_rng(0)
    world = TransformAction(world, lambda action: pushed(action, noise, rng), world.action_space)
    if not isinstance(policy, NetworkPolicy):
        return summary(evaluate(PlanningPolicy(world), env=world, episodes=10))["success"]
    for name, arguments in policy.origin.wrappers:
        world = WRAPPERS[name](world, **arguments)
    return summary(evaluate(policy, env=world, episodes=10))["success"]


def pushed(action, noise, rng):
    return np.clip(action + noise * rng.standard_normal(action.shape), -1.0, 1.0).astype(np.float32)


NOISES = (0.0, 0.1, 0.3, 0.6, 1.0)
COLOURS = ("#4b5058", "#6db3ea", "#1f5fae", "#e67700")
figure, axes = plt.subplots(figsize=(9.6, 3.2))
for (name, policy), colour in zip(list(rows.items())[:4], COLOURS, strict=True):
    shares = [100.0 * pushed_success(policy, noise) for noise in NOISES]
    axes.plot(NOISES, shares, "o-", color=colour, label=name)
    print(f"{name}: " + ", ".join(f"{share:.0f} %" for share in shares))
axes.set(xlabel="noise, in shares of the largest action", ylabel="episodes that arrive (%)", ylim=(-4, 104))
axes.grid(color="#e3e5e8", linewidth=0.6)
axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.02))
plt.show()

# %% [markdown]
# One maze is easily learnt by heart, of course. `u-turn-i98-clone`, which comes with the package, knows a
# U-turn that leaves 2 % of the longest rod; `hrsnake dataset` records demonstrations in random mazes, and
# docs/reinforcement_learning.md has curricula, wrappers and everything else.
