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
# # How tight is tight?
#
# What does a longer link cost, and what does it save? The index $I$, a link's length over that of the longest
# rod that passes, says how tight a task is. With it the number of links falls as $1 / I$, joints turn
# farther, and an arm whose joints keep to a path fails early, from about 0.4 on. Our planners come to $I$ >
# 0.99 through U-turns. Where a bend to one side closely follows one to the other, the joints behind a link
# have to follow on its track, and in the S-bend below ours end at 0.75.

# %%
import time

import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import ArmSpec, Maze
from planners import longest_link, plan
from planners.figures import STYLE, draw_arm, draw_ends, draw_walls
from planners.length_trials import LengthTrial

plt.rcParams.update(STYLE)
MAZES = {"fig19": "U-turn", "S200": "S-bend", "serp": "four U-turns"}
PLANNERS = {
    "track": ("track", "#1f5fae", "o"),
    "sweep": ("sweep", "#2e9e5b", "s"),
    "outer-wall": ("outer wall (baseline)", "#e67700", "^"),
    "follow": ("joints on the path (baseline)", "#d73027", "v"),
}
mazes = {name: Maze.load(name) for name in MAZES}

# %% [markdown]
# ## The longest link
#
# `longest_link` asks a planner for ever longer links, and a proof about single rods for the length that none
# can exceed; $I$ is their quotient, so at least what is printed. Every length is tried for itself: a planner
# that passes one need not pass a shorter one. In steps of 1 % here; `hrsnake longest` takes 0.25 %.

# %%
best = {name: longest_link(maze, "track", accuracy=0.01, time_budget=1.0) for name, maze in mazes.items()}
rods = {name: result.bound.upper for name, result in best.items()}
for name, result in best.items():
    print(f"{MAZES[name]}: longest link {result.length:.1f}, no rod over {rods[name]:.1f} passes: ", end="")
    print(f"I = {result.index_text}, {result.motion.n_links} links")

# %%
figure, every = plt.subplots(1, 3, figsize=(8.0, 4.3), width_ratios=(0.5, 0.4, 1.0))
for axes, (name, result) in zip(every, best.items(), strict=True):
    draw_walls(axes, mazes[name])
    draw_ends(axes, mazes[name])
    draw_arm(axes, result.motion.joints[-1])
    axes.set_title(f"{MAZES[name]}: links of {result.length:.0f} px")
plt.show()

# %% [markdown]
# ## Over the index
#
# Four planners on each maze at a dozen lengths, each with a second of time. A motion counts only if the exact
# checker passes it. Times are those of planning and check, the survey of the maze among them.

# %%
INDICES = (0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7, 0.74, 0.8, 0.9, 0.95, 0.98)


def attempt(maze, length, planner, budget=1.0):
    start = time.perf_counter()
    result = plan(maze, ArmSpec(link_length=length), planner, time_budget=budget, explain=False)
    return LengthTrial.from_result(length, result, time.perf_counter() - start, budget)


trials = {}
for name, maze in mazes.items():
    for planner in PLANNERS:
        attempt(maze, 0.5 * rods[name], planner)  # compiled before the clock runs
        trials[name, planner] = [attempt(maze, index * rods[name], planner) for index in INDICES]
    for planner in PLANNERS:
        passed = [f"{i:g}" for i, t in zip(INDICES, trials[name, planner], strict=True) if t.passes]
        print(f"{MAZES[name]}, {planner}: {len(passed)} of {len(INDICES)}, up to I = {passed[-1]}")

# %%
ROWS = {
    "links": lambda trial: trial.n_links,
    "joint range\n(deg)": lambda trial: np.degrees(trial.joint_range),
    "joint speed\n(deg per px of travel)": lambda trial: np.degrees(trial.joint_speed),
    "time (ms)": lambda trial: 1e3 * trial.seconds,
}
figure, every = plt.subplots(
    5, 3, figsize=(10.0, 9.2), sharex=True, sharey="row", height_ratios=(0.7, *[1] * 4)
)
for column, name in zip(every.T, MAZES, strict=True):
    for place, (planner, (_, colour, marker)) in enumerate(PLANNERS.items()):
        pairs = list(zip(INDICES, trials[name, planner], strict=True))
        passed = [(index, trial) for index, trial in pairs if trial.passes]
        failed = [index for index, trial in pairs if not trial.passes]
        column[0].plot([i for i, _ in passed], [place] * len(passed), marker, color=colour, markersize=5)
        column[0].plot(failed, [place] * len(failed), "x", color="#b0b4ba", markersize=4)
        for axes, figure_of in zip(column[1:], ROWS.values(), strict=True):
            values = [figure_of(trial) for _, trial in passed]
            axes.plot(
                [i for i, _ in passed], values, marker=marker, color=colour, markersize=4, linewidth=1.2
            )
    for axes in column:
        axes.axvline(best[name].index, color="#6b7078", linewidth=0.9, linestyle="--")
        axes.grid(color="#e3e5e8", linewidth=0.6)
    column[0].set_title(MAZES[name])
    column[-1].set(xlabel="index $I$", yscale="log")
every[0, 0].set_yticks(range(len(PLANNERS)), [label for label, _, _ in PLANNERS.values()])
every[0, 0].set_ylim(len(PLANNERS) - 0.4, -0.6)
for axes, label in zip(every[1:, 0], ROWS, strict=True):
    axes.set_ylabel(label)
plt.show()

# %% [markdown]
# Above: which lengths pass, and which do not (grey crosses); the dashed line is the longest link that was
# found. A link of twice the length halves the number of actuators, at the price of joints that turn farther:
# the range chooses the joint. The speed, per way of the joint that travels farthest, chooses the motor. Fewer
# links also take less time to plan.
#
# ## What is saved
#
# Path following stays safe up to a third of the longest rod. What the other two thirds are worth:

# %%
for name, result in best.items():
    loose = trials[name, "track"][INDICES.index(0.25)]
    tight, least = result.motion, result.fewest
    print(
        f"{MAZES[name]}: {loose.n_links} links at I = 0.25, {tight.n_links} at {result.index:.2f};", end=" "
    )
    print(f"fewest {least.n_links}, with {least.link_length:.0f} px")
