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
# # Fig. 19: the benchmark, and the index
#
# How long may a link be? In the paper's benchmark, a U-turn round a thin wall, no rod longer than
# $l_{max}$ = 440 px gets round, so no arm has longer links. The index of Eq. (4), $I = l_{link} / l_{max}$,
# says how much of that an algorithm uses: the paper's links of 430 px have $I$ = 0.98, and it puts two others
# at about 0.25.

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import Maze
from planners.bench.paper_scans import LONGEST_ROD, index_over_lengths
from planners.bench.paper_trials import try_planner
from planners.figures import STYLE, draw_arm, draw_ends, draw_path, draw_walls, zoom
from planners.survey import survey

plt.rcParams.update(STYLE)
maze = Maze.load("fig19")
seen = survey(maze)
beam = try_planner(maze, 430.0, "beam").motion
print(f"{beam.n_links} links of 430 px, {beam.n_poses} poses, I = {430.0 / LONGEST_ROD:.3f}")

# %% [markdown]
# ## The benchmark
#
# Left: its dimensions, and the longest rod at the moment when it lies on the wall's end, from outer wall to
# outer wall: it just passes. Then five poses of an arm with links of 430 px that follows the rules of the
# paper, clamped into the free intervals; dots are joints. In the third pose the link that goes
# round has 10 px left between the outer walls.


# %%
def dimension(axes, start, end, text, offset=(0.0, 0.0), colour="black"):
    look = {"arrowstyle": "<->", "color": colour, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=look, zorder=9)
    middle = 0.5 * (np.array(start) + end) + offset
    axes.annotate(text, middle, ha="center", va="center", fontsize=8, color=colour, zorder=9)


figure, every = plt.subplots(1, 6, figsize=(10.0, 4.6))
draw_walls(every[0], maze)
draw_ends(every[0], maze)
every[0].plot((-100, 340), (1400, 1400), color="#d73027", linewidth=3.0, zorder=8)
every[0].annotate("$l_{max}$ = 440", (55, 1445), ha="center", fontsize=8, color="#d73027", zorder=9)
dimension(every[0], (-100, 850), (100, 850), "$l_1$ = 200", (0, 45))
dimension(every[0], (140, 850), (340, 850), "$l_2$ = 200", (0, 45))
dimension(every[0], (230, 1400), (230, 1600), "200", (55, 0))
every[0].annotate("wall: 40", (120, 620), ha="center", va="center", fontsize=8, rotation=90, zorder=9)
every[0].set_title("dimensions (px)")
level = np.abs(beam.joints[:, -1, 1] - beam.joints[:, -2, 1]) + 1e6 * (beam.joints[:, -2, 1] < 1200.0)
tight = int(np.argmin(level))
for axes, pose in zip(every[1:], (tight - 600, tight - 130, tight, tight + 130, -1), strict=True):
    draw_walls(axes, maze)
    draw_ends(axes, maze)
    draw_arm(axes, beam.joints[pose])
    axes.set_title(f"{beam.feed[pose] / 430.0:.2f} links out")
plt.show()

# %% [markdown]
# ## Others: joints on the path
#
# Most algorithms for snake-like arms keep the joints on a path (5.4, 5.5): fine for links that are short
# beside the bends. A long link is a chord of the bend, and the chord goes through the wall. Below, both with
# the tip at the same place behind the turn, at three lengths; red if the exact checker refuses the motion,
# with the largest depth in all of it.

# %%
chosen = (150.0, 180.0, 215.0)
figure, every = plt.subplots(1, 6, figsize=(10.0, 3.3))
for pair, length in zip(every.reshape(3, 2), chosen, strict=True):
    for axes, (planner, title) in zip(
        pair, {"follow": "on the path", "beam": "the rules"}.items(), strict=True
    ):
        trial = try_planner(maze, length, planner)
        tips = trial.motion.joints[:, -1]
        pose = int(np.argmin(np.hypot(*(tips - (240.0, 1150.0)).T)))
        draw_walls(axes, maze)
        draw_path(axes, seen.path, linewidth=0.9, linestyle="--")
        draw_arm(axes, trial.motion.joints[pose], colour="#1f5fae" if trial.solved else "#d73027")
        zoom(axes, (120, 1340), (240, 280))
        axes.set_title(f"{length:g} px, {title}\n{trial.depth:.1f} px deep", fontsize=8)
plt.show()

# %% [markdown]
# ## The index over link length
#
# Some lengths from 100 px up to just below the longest rod; each planner tries all of them, and the exact
# checker decides. Crosses are shorter lengths that fail: failures need not be neighbours, so nothing is
# bisected. `hrsnake bench paper --parts index` takes steps of half a pixel, from 150 px on.

# %%
lengths = (100.0, 110.0, 120.0, 140.0, 157.0, 160.0, 200.0, 250.0, 300.0, 350.0, 400.0, 430.0, 436.0, 439.0)
scan = index_over_lengths(lengths, (), workers=0)
names = {"follow": "path following", "as-printed": "the rules, as printed", "beam": "the rules, clamped"}
names |= {"sweep": "sweep", "track": "track", "auto": "auto"}
figure, axes = plt.subplots(figsize=(9.6, 3.2))
rows = {row["planner"]: row for row in scan["planners"]}
for place, (planner, name) in enumerate(names.items()):
    row = rows[planner]
    colour = "#d73027" if planner == "follow" else "#1f5fae"
    axes.barh(place, row["index"], color=colour, alpha=0.85, height=0.62)
    failed = np.array(row["shorter_failed"]) / LONGEST_ROD
    axes.plot(failed, np.full(len(failed), place), "x", color="white", markersize=6)
    axes.annotate(
        f" {row['longest']:g} px, I = {row['index']:.3f}", (row["index"], place), va="center", fontsize=9
    )
    print(f"{name}: longest {row['longest']:g} px, {len(failed)} of {row['shorter']} shorter ones fail")
axes.axvline(0.98, color="black", linewidth=0.9, linestyle="--")
axes.axvline(0.25, color="#6b7078", linewidth=0.9, linestyle="--")
axes.annotate("the paper: 0.98", (0.975, -0.75), ha="right", fontsize=8)
axes.annotate("the paper, of others: 0.25", (0.245, -0.75), ha="right", fontsize=8, color="#6b7078")
axes.set_yticks(range(len(names)), names.values())
axes.set(xlabel="index $I = l_{link} / l_{max}$ of the longest valid link", xlim=(0, 1.25), ylim=(5.5, -1.1))
axes.set_xticks(np.arange(0.0, 1.01, 0.2))
plt.show()
