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
# # Fig. 17: the four workspaces
#
# The paper shows its arm at the end of four executions, with the beams in a, "in which all maneuvering
# spaces are extremely tight"; b, c and d "include also light maneuvering spaces". It prints no dimensions
# of them, so these are reconstructions (docs/workspaces.md). First what our best planner makes of them,
# then how far the paper's own rules come.

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import ArmSpec, Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from planners import plan
from planners.beam_planner import AS_PRINTED, CLAMPED, run_beam
from planners.figures import (
    STYLE,
    choice_handles,
    draw_beams,
    draw_choices,
    draw_ends,
    draw_path,
    draw_stages,
    draw_walls,
    wall_depths,
)
from planners.kernels.beam_arm import GOAL
from planners.kernels.beam_types import CHOICE
from planners.survey import survey

plt.rcParams.update(STYLE)
NAMES = ("fig17a", "fig17b", "fig17c", "fig17d")
mazes = {name: Maze.load(name) for name in NAMES}
arms = {name: ArmSpec(link_length=PAPER_LINK_LENGTHS[name]) for name in NAMES}
surveys = {name: survey(maze) for name, maze in mazes.items()}

# %% [markdown]
# ## By the planner `auto`
#
# Each motion has passed the exact checker: no link is in a wall at any pose or between poses. The arm after
# 35 % (red) and 65 % (violet) of its poses, and at the goal (blue).

# %%
figure, every = plt.subplots(2, 2, figsize=(10.0, 7.9), height_ratios=(1.25, 1.0))
for axes, name in zip(every.flat, NAMES, strict=True):
    maze, seen = mazes[name], surveys[name]
    motion = plan(maze, arms[name]).motion
    draw_walls(axes, maze)
    axes.margins(0.01)
    if name == "fig17a":  # as in the paper; elsewhere they would hide the halls
        draw_beams(axes, seen.beams, every=5, linewidth=0.4)
    draw_path(axes, seen.path, linewidth=0.8)
    draw_ends(axes, maze)
    draw_stages(axes, motion.joints)
    axes.set_title(f"{name[-1]}: {motion.n_links} links of {motion.link_length:g} px, {motion.n_poses} poses")
plt.show()

# %% [markdown]
# ## By the paper's rules
#
# As printed, nothing stops a link that goes into a wall: the picture shows the pose in which one is
# deepest. With the clamp, which is ours, links keep out of the walls, or the arm stops where that is
# impossible (cross). Links have the colours of what they do.


# %%
def shown(axes, name, rules, title):
    maze, run = mazes[name], run_beam(surveys[name], arms[name], rules)
    motion = run.motion(maze)
    some = np.append(np.arange(0, len(run.feeds) - 1, 4), len(run.feeds) - 1)
    depths = wall_depths(motion, maze, some, samples=33)
    deepest = depths.max()
    row = int(np.argmax(depths.max(axis=1))) if deepest > 1e-3 * run.link_length else len(some) - 1
    pose = some[row]
    draw_walls(axes, maze)
    axes.margins(0.01)
    draw_path(axes, surveys[name].path, linewidth=0.7)
    draw_ends(axes, maze)
    draw_choices(axes, motion.joints[pose, ::-1], run.record[pose, :, CHOICE], linewidth=2.4)
    where = "reaches the goal" if run.ending == GOAL else f"stops, {run.n_links} links out"
    if deepest > 1e-3 * run.link_length:
        link = int(np.argmax(depths[row]))
        ring = motion.joints[pose, ::-1][link : link + 2].mean(axis=0)
        axes.plot(*ring, "o", color="#d62828", markersize=22, fillstyle="none", markeredgewidth=1.6, zorder=9)
    if run.ending != GOAL:
        axes.plot(*run.place, "X", color="#d62828", markeredgecolor="white", markersize=12, zorder=9)
        print(f"{name}, {title}: {run.reason(maze)}")
    axes.set_title(f"{name[-1]}, {title}: {where}, deepest {deepest:.1f} px")
    print(f"{name}, {title}: {where} after {run.feeds[-1]:.0f} px of feed, deepest {deepest:.2f} px")


for rules, title in ((AS_PRINTED, "as printed"), (CLAMPED, "clamped")):
    figure, every = plt.subplots(2, 2, figsize=(10.0, 7.9), height_ratios=(1.25, 1.0))
    for axes, name in zip(every.flat, NAMES, strict=True):
        shown(axes, name, rules, title)
    figure.legend(handles=choice_handles(), loc="outside lower center", ncols=4)
    plt.show()

# %% [markdown]
# As printed, the rules bring the arm to the goal in all four, but in none without going through walls; in a
# most deeply at the very end, where the goal is nearer than a link's length and the tip swings past it.
# Clamped, they solve b and c without touching more than the surface. In a the clamped arm stops behind the
# fourth U-turn, and in d in the crack: there a wall would make the tip's link jump. That is what the other
# planners are for.
