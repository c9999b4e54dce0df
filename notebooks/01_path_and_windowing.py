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
# # Fig. 1: the path, and what windowing does to it
#
# Before any link moves, the planner asks how a *point* would get from the base to the goal. The paper's
# answer is a potential. Think of a metal plate in the shape of the free space: the walls are kept cold, the
# goal is kept hot, and each place is as warm as the average around it. Whoever walks where it gets warmer
# comes to the goal, from anywhere, and never into a dead end. Fig. 1 of the paper shows such a path, (a) raw
# and (b) after *windowing*: each point is replaced by the average of those before and after it.

# %%
import matplotlib.pyplot as plt
import numpy as np
import shapely

from hrsnake_env import Maze
from planners.corners import MIN_CURVATURE
from planners.figures import STYLE, draw_ends, draw_walls, zoom
from planners.path import POINTS_PER_WIDTH, WINDOW, arclength, curvature, descend, resampled, windowed
from planners.potential import laplace_potential, passage_width

plt.rcParams.update(STYLE)
BEFORE, AFTER = "#d7301f", "#1f5fae"
mazes = {"the benchmark": Maze.load("fig19"), "a hall full of pillars": Maze.load("clutter-7")}
widths = {name: passage_width(maze) for name, maze in mazes.items()}
potentials = {name: laplace_potential(maze, width=widths[name]) for name, maze in mazes.items()}

# %% [markdown]
# ## The potential, Eq. (1) and (2)
#
# It falls off so fast that only its logarithm can be drawn: from one contour to the next it is ten times
# less. (The paper counts from the other end, so that the goal is the *lowest* place; our $u$ is $1 - \phi$.)
#
# A raw path that follows the grid takes three lines: stand on a node, look at the eight around it, step to
# the warmest. Our planner (`planners.path.descend`) takes its values from *between* the nodes, too, as the
# paper does for Eq. (3), and goes on by a quarter of a cell at a time: a streamline.


# %%
def steps_from_node_to_node(maze, potential):
    ends = np.rint((np.array([maze.base_pose[:2], maze.goal]) - potential.origin) / potential.cell)
    nodes, goal = [tuple(ends[0].astype(int))], tuple(ends[1].astype(int))
    while nodes[-1] != goal:
        around = [(nodes[-1][0] + dx, nodes[-1][1] + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
        nodes.append(max(around, key=lambda node: potential.u[node[1], node[0]]))
    return potential.origin + potential.cell * np.array(nodes)


stepped = {name: steps_from_node_to_node(maze, potentials[name]) for name, maze in mazes.items()}
streamlines = {name: descend(maze, potentials[name]) for name, maze in mazes.items()}

figure, every = plt.subplots(1, 2, figsize=(9.6, 5.0), width_ratios=(0.28, 1.0))
for axes, (name, maze) in zip(every, mazes.items(), strict=True):
    potential, levels = potentials[name], np.arange(-19, 1)
    ny, nx = potential.u.shape
    x, y = (potential.origin[k] + potential.cell * np.arange((nx, ny)[k]) for k in range(2))
    log_u = np.log10(np.where(potential.u > 0.0, potential.u, np.nan))
    draw_walls(axes, maze)
    shown = axes.contourf(x, y, log_u, levels=levels, cmap="viridis", zorder=1)
    axes.contour(x, y, log_u, levels=levels, colors="white", linewidths=0.4, linestyles="-", zorder=1)
    axes.plot(*stepped[name].T, color="black", linewidth=1.4, label="from node to node")
    axes.plot(*streamlines[name].T, color="#ff5a36", linewidth=1.4, label="streamline")
    draw_ends(axes, maze)
    axes.set_title(name)
figure.legend(*every[1].get_legend_handles_labels(), loc="outside lower center", ncols=2)
figure.colorbar(shown, ax=every, label=r"$\log_{10} u$", shrink=0.8, pad=0.01)
plt.show()

# %% [markdown]
# In the hall the two part for a while. A walk on nodes has eight directions to choose from; where the
# steepest lies between two of them, it takes the same one again and again, and drifts.
#
# ## Raw and smoothed
#
# This is Fig. 1 of the paper, at the turn of the benchmark. (a) The raw path from node to node has kinks, as
# it knows multiples of 45 degrees only. (b) Windowing rounds them. (c) On the streamline there is little left
# to round, and it lies where the room is: that is the path that our planners use.


# %%
def evenly(line, width):
    return resampled(line, width / POINTS_PER_WIDTH)  # as in planners.path: 25 points per passage width


benchmark, width = mazes["the benchmark"], widths["the benchmark"]
raw, streamline = (evenly(lines["the benchmark"], width) for lines in (stepped, streamlines))
panels = {
    "a. raw path, from node to node": (raw, False),
    f"b. smoothed: {WINDOW} points on each side": (raw, True),
    "c. a streamline, smoothed likewise": (streamline, True),
}
figure, every = plt.subplots(1, 3, figsize=(9.6, 4.0))
for axes, (title, (line, smooth)) in zip(every, panels.items(), strict=True):
    draw_walls(axes, benchmark)
    look = {"linewidth": 0.6, "markersize": 2.4}
    axes.plot(*line.T, "o-", color=BEFORE, alpha=0.4 if smooth else 1.0, label="before windowing", **look)
    if smooth:
        axes.plot(*windowed(line, WINDOW).T, "o-", color=AFTER, label="after windowing", **look)
    zoom(axes, (120, 1360), (240, 260))
    axes.set_title(title)
figure.legend(*every[2].get_legend_handles_labels(), loc="outside lower center", ncols=2)
plt.show()

# %% [markdown]
# ## What the window is for: curvature
#
# Critical corners are found by the curvature of the path. On the raw path it is nothing at all, then a kink,
# then nothing again. Windowing spreads the kinks, but the grid's path needs a wide window until they become
# one hump. On the streamline a narrow one does. Below the dashed line a bend begins to count as critical.

# %%
figure, every = plt.subplots(2, 1, figsize=(9.6, 4.8), sharex=True, sharey=True)
for axes, (name, line) in zip(every, {"node to node": raw, "streamline": streamline}.items(), strict=True):
    for window, colour, thickness in (
        (0, "#f2a58e", 1.2),
        (WINDOW, AFTER, 2.0),
        (3 * WINDOW, "#2e9e5b", 1.4),
    ):
        points = windowed(line, window)
        label = f"window of {window} points on each side" if window else "raw"
        bend = curvature(points) * width
        axes.plot(arclength(points) / width, bend, color=colour, linewidth=thickness, label=label)
        print(f"{name}, {label}: largest curvature {np.abs(bend).max():.1f} per passage width")
    axes.axhline(-MIN_CURVATURE, color="black", linewidth=0.8, linestyle="--")
    axes.set(title=name, xlim=(5.0, 10.0), ylim=(-5.5, 0.5), ylabel="curvature x width\n(negative: right)")
    axes.grid(color="#e3e5e8", linewidth=0.6)
every[1].set_xlabel("arclength (passage widths)")
every[0].legend(loc="lower left")
plt.show()

# %% [markdown]
# ## Not too wide
#
# An average lies on the inner side of a bend, so a wide window cuts corners. On the right: how much room is
# left beside the path, wherever it is least, for windows up to two passage widths. Our default takes about a
# tenth of the room, half a width already a third. From about one passage width on, the path goes
# *through* the thin wall of the benchmark, and through a pillar of the hall soon after.


# %%
def room_left(maze, points):
    ahead = shapely.points(points[len(points) // 20 :])  # the base stands at a wall, and shall not count
    sign = np.where(shapely.contains(maze.free_space, ahead), 1.0, -1.0)
    return np.min(sign * shapely.distance(ahead, maze.free_space.boundary))


windows = np.arange(0, 51)
figure, (place, chart) = plt.subplots(1, 2, figsize=(9.6, 4.2), width_ratios=(0.85, 1.0))
draw_walls(place, benchmark)
some = (WINDOW, 12, 18, 25, 50)
for window, colour in zip(some, plt.get_cmap("plasma")(np.linspace(0.0, 0.85, 5)), strict=True):
    label = f"{window / POINTS_PER_WIDTH:.2f}"
    place.plot(*windowed(streamline, window).T, color=colour, linewidth=1.6, label=label)
zoom(place, (120, 1360), (240, 260))
place.set_title("the path at the turn")
figure.legend(
    loc="outside lower left", ncols=5, title="window on each side (passage widths)", title_fontsize=8
)

for (name, maze), colour in zip(mazes.items(), (AFTER, "#d97a12"), strict=True):
    line = evenly(streamlines[name], widths[name])
    room = np.array([room_left(maze, windowed(line, window)) for window in windows]) / widths[name]
    chart.plot(windows / POINTS_PER_WIDTH, room, color=colour, linewidth=1.8, label=name)
    shares, through = 1.0 - room / room[0], windows[np.argmax(room < 0.0)] / POINTS_PER_WIDTH
    print(f"{name}: the default takes {shares[WINDOW]:.0%} of the room, half a width {shares[12]:.0%}")
    print(f"{name}: through a wall from {through:.2f} widths on")
chart.axhspan(-0.2, 0.0, color="#c9ccd1", zorder=0)
chart.annotate("through the wall", (0.3, -0.06), fontsize=9, color="#4b5058", va="center")
chart.axvline(WINDOW / POINTS_PER_WIDTH, color="black", linewidth=0.8, linestyle="--")
chart.annotate("default", (WINDOW / POINTS_PER_WIDTH + 0.03, 0.24), fontsize=8)
chart.set(xlabel="window on each side (passage widths)", ylabel="room beside the path (passage widths)")
chart.set(xlim=(0.0, 2.0), ylim=(-0.12, 0.26), title="the least room beside it")
chart.legend(loc="upper right")
plt.show()
