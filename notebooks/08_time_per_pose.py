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
# # Fig. 18: time over path length, and per pose
#
# The arm is fed through Fig. 17a, and at each pose *all* of its links are placed anew by the rules. The paper
# shows (a) the cumulative time over the length of the path, which it calls near-linear, and (b) the time of
# each new pose: 1.03 ms on average, 1921 ms in all, on a laptop with an Intel i5-4210U, in C#. Here are the
# same two charts from our program on this machine. Two machines and two languages: no ratio of the methods
# can be drawn from the times, but the *form* of the curves can be compared.

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from planners.beam_planner import AS_PRINTED, CLAMPED
from planners.bench.fits import exponent, line
from planners.bench.paper_speed import PAPER_LINKS, time_each_pose
from planners.figures import STYLE
from planners.survey import survey

plt.rcParams.update(STYLE)
LENGTH, REPEATS = PAPER_LINK_LENGTHS["fig17a"], 2
COLOURS = {"as printed": "#d97a12", "clamped": "#1f5fae"}
seen = survey(Maze.load("fig17a"))
runs = {
    name: time_each_pose(seen, LENGTH, rules, REPEATS)
    for name, rules in {"as printed": AS_PRINTED, "clamped": CLAMPED}.items()
}

# %% [markdown]
# Of each pose the least of two times is kept, with Python's garbage collector off: other work on the machine
# then counts less. `hrsnake bench paper --parts poses` takes five.
#
# ## (a) Cumulative time
#
# Over the length of arm that is out. Every link that comes out of the feeder is one more to place at each
# pose after it, so the sum *must* bend upwards: were all else equal it would grow with the square, and where
# the arm turns fast, more poses are needed. A straight line has a high R² all the same; the exponent tells
# the two apart.

# %%
figure, axes = plt.subplots(figsize=(9.6, 4.2))
for name, timed in runs.items():
    total, colour = np.cumsum(timed.seconds), COLOURS[name]
    straight, later = line(timed.feeds, total), timed.feeds > 0.1 * timed.feeds[-1]
    growth = exponent(timed.feeds[later], total[later])["exponent"]
    label = f"{name}: exponent {growth:.2f}, line with $R^2$ = {straight['r2']:.3f}"
    axes.plot(timed.feeds, 1e3 * total, color=colour, linewidth=2.0, label=label)
    ends = timed.feeds[[0, -1]]
    axes.plot(ends, 1e3 * (straight["start"] + straight["slope"] * ends), "--", color=colour, linewidth=1.0)
    mark = "the goal" if timed.at_goal else "a dead end"
    place = (timed.feeds[-1], 1e3 * total[-1])
    axes.plot(*place, "o", color=colour, markersize=5)
    look = {"textcoords": "offset points", "ha": "right", "fontsize": 8, "color": colour}
    axes.annotate(mark, place, (-9, 6), bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0}, **look)
    print(f"{name}: {len(total)} poses in {1e3 * total[-1]:.0f} ms, {timed.links_out[-1]} links, to {mark}")
axes.set(xlabel="length of arm that is out (px)", ylabel="cumulative time (ms)", xlim=(0, None))
axes.set_ylim(0, None)
axes.grid(color="#e3e5e8", linewidth=0.6)
axes.legend(loc="upper left")
plt.show()

# %% [markdown]
# As printed the rules bring the tip to the goal (with links in walls on the way: notebook 07). Clamped into
# the free intervals they never enter a wall, and come to a dead end in this workspace, whose every turn is at
# 0.96 of the longest rod.
#
# ## (b) Time per pose
#
# Each dot is a pose; the line is the median over the poses with as many links out. The dots lie in layers:
# in the lowest a pose was found at once, in the next ones it was tried again, once or more, with less feed,
# as a joint had moved too far. Within each layer time grows evenly with the number of links. Every pose
# takes well under the millisecond that is the paper's average.

# %%
figure, every = plt.subplots(1, 2, figsize=(9.6, 3.8), sharey=True)
for axes, (name, timed) in zip(every, runs.items(), strict=True):
    micro, counts = 1e6 * timed.seconds, np.unique(timed.links_out)
    medians = [np.median(micro[timed.links_out == count]) for count in counts]
    axes.plot(timed.links_out, micro, ".", color=COLOURS[name], markersize=2.0, alpha=0.15, rasterized=True)
    axes.plot(counts, medians, color="black", linewidth=1.6, label="median")
    axes.axvline(PAPER_LINKS, color="#6b7078", linewidth=0.8, linestyle="--")
    axes.annotate("45 links ", (PAPER_LINKS, 2.0), ha="right", fontsize=8, color="#6b7078")
    axes.set(title=name, xlabel="links out", xlim=(0, 50))
    axes.grid(color="#e3e5e8", linewidth=0.6)
    many = micro[timed.links_out >= PAPER_LINKS]
    for what, chosen in (("all poses", micro), ("with 45 links and more", many)):
        if len(chosen):
            figures = np.median(chosen), np.percentile(chosen, 99.0), chosen.max()
            print(f"{name}, {what}: median, 99 % and largest", *(f"{value:.0f} us" for value in figures))
every[0].set(ylabel="time of a pose (us)")
every[0].set_ylim(0.0, 1.1e6 * max(timed.seconds.max() for timed in runs.values()))
every[0].legend(loc="upper left")
plt.show()
