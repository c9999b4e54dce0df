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
# # Figs. 9 and 10: interference near a semi-critical corner, and the path point
#
# Where the path bends slightly (a semi-critical corner), a link that aims at the edge side pokes the wall:
# the paper's *interference space* (Fig. 9). Its remedy is to aim at the path itself there (Fig. 10). Here:
# the same corridor and arm without that rule and with it; then, over many corridors, how often it helps.

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import ArmSpec, Maze
from planners.beam_planner import Rules, run_beam
from planners.figures import (
    CHOICE_COLOURS,
    STYLE,
    choice_handles,
    draw_choices,
    draw_path,
    draw_walls,
    evenly_fed,
    mark_corner,
    wall_depths,
    zoom,
)
from planners.kernels.beam_types import CHOICE, CLOSEST, EDGE, PATH, TARGET
from planners.survey import survey

plt.rcParams.update(STYLE)
WITHOUT, WITH = Rules(clamp=False, semi_critical=False), Rules(clamp=False)
CORRIDORS, SHARE = 15, 1.4  # how many, and the link length in passage widths


def measured(maze, seen, rules):
    length = SHARE * seen.path.width
    motion = run_beam(seen, ArmSpec(link_length=length), rules, record=False).motion(maze)
    evenly = wall_depths(motion, maze, evenly_fed(motion.feed, length / 12.0), samples=17)
    some = wall_depths(
        motion, maze, np.arange(0, motion.n_poses, 16), samples=17
    )  # most where joints move fast
    return np.mean(evenly.max(axis=1) > 1e-3 * length), some.max() / length


# %% [markdown]
# ## How often
#
# The corridors `corridor-0` to `corridor-14`, those that have a semi-critical corner, with links of 1.4
# passage widths. A pose interferes if some link is deeper in a wall than a thousandth of its length; poses
# are counted at even steps of the feed.

# %%
mazes = {f"corridor-{seed}": Maze.load(f"corridor-{seed}") for seed in range(CORRIDORS)}
surveys = {name: survey(maze) for name, maze in mazes.items()}
names = [name for name, seen in surveys.items() if seen.semi_critical]
# By corridor and rule: the share of poses that interfere, and the deepest place in link lengths.
table = np.array(
    [[measured(mazes[name], surveys[name], rules) for rules in (WITHOUT, WITH)] for name in names]
)
print(f"{len(names)} of {len(mazes)} corridors have a semi-critical corner.")
figure, every = plt.subplots(1, 2, figsize=(9.6, 4.6))
titles = "share of poses that interfere", "deepest place (link lengths)"
for axes, column, title in zip(every, (0, 1), titles, strict=True):
    without, kept = table[:, :, column].T
    better, worse = np.sum(kept < without - 0.01), np.sum(kept > without + 0.01)
    print(f"{title}: mean {without.mean():.2f} without, {kept.mean():.2f} with; {better} less, {worse} more")
    axes.plot(without, kept, "o", color="#1f5fae", markersize=6, alpha=0.7)
    end = 1.05 * table[:, :, column].max()
    axes.plot([0.0, end], [0.0, end], color="black", linewidth=0.8)
    for word, place in (("helps", (0.7, 0.45)), ("hurts", (0.2, 0.75))):
        axes.annotate(word, (place[0] * end, place[1] * end), fontsize=9, color="#4b5058")
    axes.set(xlabel="without the rule", ylabel="with the rule", title=title, aspect="equal")
plt.show()

# %% [markdown]
# The rule does what it is for: far fewer poses interfere. The deepest place on the whole way, however, is
# deeper with it in more corridors than not: it seems that a link on the path is not prepared for the
# critical corner behind.
#
# ## Figs. 9 and 10: where it helps most
#
# The corridor above in which most poses become free: there, the pose in which a link that aims at the edge
# side past a semi-critical corner is deepest in the wall; and the arm at the same feed with the rule.

# %%
name = names[int(np.argmax(table[:, 0, 0] - table[:, 1, 0]))]
maze, seen = mazes[name], surveys[name]
length = SHARE * seen.path.width
runs = [run_beam(seen, ArmSpec(link_length=length), rules) for rules in (WITHOUT, WITH)]
motions = [run.motion(maze) for run in runs]
poses = [evenly_fed(run.feeds, length / 60.0) for run in runs]
depths = [wall_depths(*of, samples=33) for of in zip(motions, (maze, maze), poses, strict=True)]

some = runs[0].record[poses[0], : motions[0].n_links]
past = np.zeros(some.shape[:2], dtype=bool)
for corner in seen.semi_critical:
    past |= (some[..., CLOSEST] <= corner.last) & (corner.first <= some[..., TARGET])
row, k = np.unravel_index(np.argmax(depths[0] * past * (some[..., CHOICE] == EDGE)), past.shape)
feed = runs[0].feeds[poses[0][row]]
ends = motions[0].joints[poses[0][row], ::-1]
centre = ends[k : k + 2].mean(axis=0)

figure, every = plt.subplots(1, 2, figsize=(9.6, 5.0))
titles = ("Fig. 9: edge side", "Fig. 10: path point")
for axes, run, motion, title in zip(every, runs, motions, titles, strict=True):
    pose = int(np.searchsorted(run.feeds, feed))
    draw_walls(axes, maze)
    draw_path(axes, seen.path)
    for corner in seen.semi_critical:
        mark_corner(axes, seen.path, corner, label="semi-critical")
    draw_choices(axes, motion.joints[pose, ::-1], run.record[pose, :, CHOICE])
    zoom(axes, centre, 1.8 * length)
    deep = wall_depths(motion, maze, np.array([pose]))[0, max(k - 2, 0) : k + 3].max()
    axes.set_title(f"{title}\nfeed {feed:.0f} px: {deep:.1f} px deep in the wall here")
figure.legend(handles=choice_handles(), loc="outside lower center", ncols=4)
print(f"{name}, links of {length:.0f} px = {SHARE} widths")
for depth, label in zip(depths, ("Without", "With"), strict=True):
    share = np.mean(depth.max(axis=1) > 1e-3 * length)
    print(f"{label} the rule {share:.0%} of the poses interfere, the deepest by {depth.max():.1f} px.")
plt.show()

# %% [markdown]
# The same over the whole way. Links that aim at the far edge of a slight bend lie across the inner wall for
# as long as they are beside it.

# %%
figure, axes = plt.subplots(figsize=(9.6, 2.8))
colours = CHOICE_COLOURS[EDGE], CHOICE_COLOURS[PATH]
for number, label in enumerate(("without the rule", "with it")):
    fed, depth = runs[number].feeds[poses[number]], depths[number].max(axis=1)
    axes.plot(fed, depth, color=colours[number], linewidth=1.4, label=label)
axes.axvline(feed, color="black", linewidth=0.8, linestyle="--")
axes.set(xlabel="feed (px)", ylabel="depth (px)", xlim=(0.0, runs[0].feeds[-1]), ylim=(0.0, None))
axes.legend()
plt.show()
