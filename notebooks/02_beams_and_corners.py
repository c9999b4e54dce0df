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
# # Figs. 2, 3, 4 and 11: beams, and the corners that they find
#
# From each point of the path two *beams* go out at right angles until they meet a wall: a green one to the
# left and a red one to the right, as seen on the way to the goal (Fig. 2 of the paper). Where the path
# bends sharply *and* the beam on the inner side of the bend is short, there is a *critical corner* (Fig.
# 3): a place at which links have to be careful. They go round a left corner otherwise than round a right
# one, so each corner gets its side (section 3.5, Fig. 11).

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import Maze
from planners.corners import MAX_INNER_BEAM, MIN_CURVATURE, SEMI_MAX_INNER_BEAM, SEMI_MIN_CURVATURE
from planners.figures import (
    GREEN,
    RED,
    STYLE,
    draw_beams,
    draw_ends,
    draw_path,
    draw_walls,
    mark_corner,
    zoom,
)
from planners.survey import survey

plt.rcParams.update(STYLE)
BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.5}
MIDDLE = {"textcoords": "offset points", "ha": "center", "va": "center", "zorder": 9}
KIND = {True: "#c2410c", False: "#2563a8"}  # critical, semi-critical
NOTE = {"weight": "bold", "fontsize": 8.5, "bbox": BOX, **MIDDLE}

turns = Maze.load("zig3")
seen = survey(turns)  # path, beams and corners
for corner in seen.corners:
    x, y = corner.place
    print(f"{corner.name} corner round ({x:.0f}, {y:.0f}): path points {corner.first} to {corner.last}")

# %% [markdown]
# ## Fig. 2: beams
#
# Every third pair of beams at the first turn; and for one path point its tangent and, at right angles to
# it, its left and its right beam. They are exact: a beam ends where the ray meets the wall, not at a grid
# node.

# %%
figure, axes = plt.subplots(figsize=(6.4, 6.2))
draw_walls(axes, turns)
draw_beams(axes, seen.beams, every=3)
draw_path(axes, seen.path, marker="o", markersize=1.6, linewidth=0.8)
k = seen.corners[0].first + 8
point, along = seen.path.points[k], 130.0 * seen.path.tangents[k]
left, right = seen.beams.left[k], seen.beams.right[k]
axes.plot(*np.array([point - along, point + along]).T, color="black", linestyle="--", linewidth=1.2)
axes.plot(*np.array([point, left]).T, color=GREEN, linewidth=2.6, zorder=5)
axes.plot(*np.array([point, right]).T, color=RED, linewidth=2.6, zorder=5)
axes.plot(*point, "o", color="black", markersize=6, zorder=7)
notes = (
    ("path point", point, (-46, -18), "black"),
    ("tangent", point + along, (34, 12), "black"),
    (f"left beam: {seen.beams.left_lengths[k]:.0f} px", 0.5 * (point + left), (18, 62), GREEN),
    (f"right beam: {seen.beams.right_lengths[k]:.0f} px", 0.6 * right + 0.4 * point, (75, -52), RED),
)
for text, spot, offset, colour in notes:
    leader = {"arrowstyle": "-", "color": colour, "linewidth": 0.8}
    axes.annotate(text, spot, xytext=offset, color=colour, arrowprops=leader, **NOTE)
zoom(axes, (120, 1360), (240, 260))
plt.show()

# %% [markdown]
# ## Fig. 3: critical corners
#
# In a hall full of pillars, what the detection sees along the whole way: the curvature of the path, and the
# length of the beam on the inner side of the bend. Where both are beyond their thresholds (dashed), the
# path points make up a critical corner (shaded in its colour). Either alone would not do: short beams are
# everywhere in a narrow straight corridor, and a sharp bend in the open (shaded in grey) needs no care. (In
# the picture beams are cut to 1.2 passage widths.)

# %%
hall = Maze.load("clutter-147")
view = survey(hall)
path, beams, corners = view.path, view.beams, view.corners
s, bend = path.s / path.width, path.curvature * path.width
inner = np.where(bend > 0.0, beams.left_lengths, beams.right_lengths) / path.width

figure, (place, curvature, beam) = plt.subplots(3, 1, figsize=(8.6, 10.4), height_ratios=(2.6, 1.0, 1.0))
draw_walls(place, hall)
place.margins(0.01)
draw_beams(place, beams, every=3, longest=1.2 * path.width, linewidth=0.5)
draw_path(place, path)
draw_ends(place, hall)
for number, corner in enumerate(corners, 1):
    mark_corner(place, path, corner, label=f"{number} {corner.name}")
    span = s[corner.first], s[corner.last]
    for axes in (curvature, beam):
        axes.axvspan(*span, color=GREEN if corner.turn > 0 else RED, alpha=0.2, linewidth=0.0)
    curvature.annotate(f"{number} {corner.name}", (np.mean(span), 3.4), xytext=(0, 0), **NOTE)
curvature.plot(s, bend, color="black", linewidth=1.3)
beam.plot(s, inner, color="black", linewidth=1.3)
in_the_open = (np.abs(bend) > MIN_CURVATURE) & (inner >= MAX_INNER_BEAM)
for axes, height in ((curvature, (-4.0, 4.0)), (beam, (0.0, 2.0))):
    axes.fill_between(s, *height, where=in_the_open, color="#9aa1ab", alpha=0.35, linewidth=0.0)
    axes.set(xlim=(0.0, s[-1]), ylim=height)
text = {"fontsize": 8, "color": "#1f5fae", "va": "bottom"}
for level in (-MIN_CURVATURE, MIN_CURVATURE):
    curvature.axhline(level, color="#1f5fae", linewidth=1.0, linestyle="--")
beam.axhline(MAX_INNER_BEAM, color="#1f5fae", linewidth=1.0, linestyle="--")
curvature.annotate(f"sharp: beyond {MIN_CURVATURE} either way", (0.1, MIN_CURVATURE + 0.05), **text)
beam.annotate(f"short: below {MAX_INNER_BEAM}", (0.1, MAX_INNER_BEAM - 0.22), **text)
curvature.set_ylabel("curvature x width\n(positive: to the left)")
beam.set(ylabel="inner beam\n(passage widths)", xlabel="arclength (passage widths)")
plt.show()

# %% [markdown]
# The inner beam jumps where the path changes from bending one way to bending the other, as the inner side
# is the other one then.
#
# ## Fig. 4: semi-critical corners
#
# Slighter bends, farther from the wall, have thresholds of their own: half the curvature, a longer beam.
# The paper gives no numbers for either kind; these are ours. A corner that is beyond both pairs of
# thresholds is critical, and the slight bends at its flanks belong to it. In this corridor both kinds
# occur.

# %%
corridor = Maze.load("corridor-21")
view = survey(corridor)
path, beams = view.path, view.beams
s, bend = path.s / path.width, np.abs(path.curvature) * path.width
inner = np.where(path.curvature > 0.0, beams.left_lengths, beams.right_lengths) / path.width
both = sorted([*view.corners, *view.semi_critical], key=lambda corner: corner.first)

figure, panels = plt.subplot_mosaic(
    [["map", "bend"], ["map", "beam"]], figsize=(10.0, 6.0), width_ratios=(1, 2)
)
place, curvature, beam = panels["map"], panels["bend"], panels["beam"]
draw_walls(place, corridor)
place.margins(0.01)
draw_beams(place, beams, every=4, longest=1.2 * path.width, linewidth=0.4)
draw_path(place, path)
draw_ends(place, corridor)
for number, corner in enumerate(both, 1):
    mark_corner(place, path, corner, label=f"{number}" if corner.critical else f"{number} semi")
    run = slice(corner.first, corner.last + 1)
    for axes in (curvature, beam):
        axes.axvspan(*s[[corner.first, corner.last]], color=KIND[corner.critical], alpha=0.3, linewidth=0.0)
    curvature.annotate(f"{number}", (s[run].mean(), 2.5), xytext=(0, 0), **NOTE)
    kind = "critical" if corner.critical else "semi-critical"
    print(f"{number}, {kind}, {corner.name}: curvature {bend[run].max():.2f}, beam {inner[run].min():.2f}")
levels = {True: (MIN_CURVATURE, MAX_INNER_BEAM), False: (SEMI_MIN_CURVATURE, SEMI_MAX_INNER_BEAM)}
for axes, values, which in ((curvature, bend, 0), (beam, inner, 1)):
    axes.plot(s, values, color="black", linewidth=1.3)
    for critical, kind in ((True, "critical"), (False, "semi-critical")):
        level = levels[critical][which]
        word = "below" if which else "beyond"
        look = {"color": KIND[critical], "linestyle": "--", "label": f"{kind}: {word} {level}"}
        axes.axhline(level, linewidth=1.3, **look)
    axes.set_xlim(0.0, s[-1])
    axes.legend(loc="upper center", ncols=2)
curvature.set(ylim=(0.0, 3.6), ylabel="|curvature| x width")
beam.set(ylim=(0.0, 1.4), ylabel="inner beam\n(passage widths)", xlabel="arclength (passage widths)")
plt.show()

# %% [markdown]
# ## Fig. 11: right or left
#
# Section 3.5 draws two vectors between path points inside the corner and multiplies them. The sign of their
# cross product says to which side the path turns. Here y points up, so that a positive product is a *left*
# corner; the paper has it the other way round.

# %%
figure, every = plt.subplots(1, 2, figsize=(8.0, 4.3))
for axes, corner in zip(every, seen.corners, strict=True):
    run = seen.path.points[corner.first : corner.last + 1]
    a, b, c = run[0], run[len(run) // 2], run[-1]
    (ux, uy), (vx, vy) = b - a, c - b
    draw_walls(axes, turns)
    draw_beams(axes, seen.beams, every=3, linewidth=0.5)
    draw_path(axes, seen.path)
    for start, end in ((a, b), (b, c)):
        arrow = {"arrowstyle": "-|>", "color": "#1f5fae", "linewidth": 2.2, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", end, xytext=start, arrowprops=arrow, zorder=8)
    axes.plot(*np.array([a, b, c]).T, "o", color="black", markersize=5, zorder=9)
    zoom(axes, run.mean(axis=0), 200)
    axes.set_title(f"{corner.name} corner: cross product {ux * vy - uy * vx:+,.0f} px²")
plt.show()

# %% [markdown]
# ## A long way
#
# `fig17a`, after the maze of the paper's Fig. 17a: four U-turns, then a spiral inwards. All ten corners are
# found, with their sides. The thresholds are the same as above: they are in passage widths, so they hold
# for mazes of any size.

# %%
way = Maze.load("fig17a")
found = survey(way)
figure, axes = plt.subplots(figsize=(7.6, 8.0))
draw_walls(axes, way)
draw_beams(axes, found.beams, every=5, linewidth=0.4)
draw_path(axes, found.path)
draw_ends(axes, way)
for number, corner in enumerate(found.corners, 1):
    mark_corner(axes, found.path, corner, label=str(number))
axes.set_title(", ".join(f"{number} {corner.name}" for number, corner in enumerate(found.corners, 1)))
plt.show()
