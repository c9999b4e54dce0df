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
# # Figs. 5 to 8: tangent point, closest path point, edge side
#
# A link knows where it starts: at the end of its adjacent link. Where shall it point? If it can touch the
# path (Fig. 5), it does; which path point its end is then beside, the beams say (Fig. 6), and the next link
# starts looking from there. If it cannot touch the path, it aims at the outer ends of the beams (Figs. 7
# and 8). Below, all this happens in one run of the rules through the benchmark, as printed in the paper.
# Links are numbered from the tip.

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import ArmSpec, Maze
from planners.beam_planner import AS_PRINTED, NEAR_END, FedArm, closest_path_point, run_beam, tangent_point
from planners.figures import (
    CHOICE_COLOURS,
    GREEN,
    RED,
    STYLE,
    choice_handles,
    draw_arrow,
    draw_beams,
    draw_choices,
    draw_path,
    draw_walls,
    zoom,
)
from planners.kernels.beam_types import CHOICE, CLOSEST, EDGE, LEFT, PIECES, TANGENT, TARGET
from planners.survey import survey

plt.rcParams.update(STYLE)
LENGTH = 430.0
maze = Maze.load("fig19")
seen, arm = survey(maze), ArmSpec(link_length=LENGTH)
run = run_beam(seen, arm, AS_PRINTED)
way, path = FedArm(seen, arm, AS_PRINTED).way, seen.path
ends = run.motion(maze).joints[:, ::-1]  # link k from the tip ends at ends[:, k], starts at ends[:, k + 1]
settled = run.record[:, :, PIECES] == 0  # no jump is being softened
corner = seen.corners[0]


def first(of_poses):
    return int(np.flatnonzero(of_poses)[0])


# %% [markdown]
# ## Fig. 5: the tangent point
#
# The first pose in which the second link is tangent. From its start, vectors $F_i$ lead to one path point
# after the other. Consecutive ones are multiplied, and where the product changes its sign, the path changes
# the side of the vector: there the link can touch it. On a straight leg the products are nothing but
# rounding, so we look only inside the corner (shaded), and only as far as the link reaches. The paper does
# not say either, but the method needs both.

# %%
k = 1
n = first((run.record[:, k, CHOICE] == TANGENT) & settled[:, k])
start, index, target = ends[n, k + 1], run.record[n, k, CLOSEST], run.record[n, k, TARGET]
assert tangent_point(way, *start, index, LENGTH) == target

vectors = path.points - start
lengths = np.hypot(*vectors.T)
sines = np.cross(np.c_[vectors, 0 * lengths][:-1], np.c_[vectors, 0 * lengths][1:])[:, 2] / (
    lengths[:-1] * lengths[1:]
)
figure, (place, chart) = plt.subplots(1, 2, figsize=(9.6, 4.8), width_ratios=(1.0, 1.15))
draw_walls(place, maze)
draw_path(place, path)
draw_choices(place, ends[n], run.record[n, :, CHOICE])
for i in range(index + 3, target + 20, 6):
    draw_arrow(place, start, path.points[i], GREEN if sines[i] > 0 else RED, 0.9)
place.plot(*path.points[target], "*", color="black", markersize=13, zorder=9)
figure.legend(handles=choice_handles(), loc="outside lower center", ncols=4)
zoom(place, (120, 1330), (245, 300))
place.set_title(f"pose {n}, feed {run.feeds[n]:.0f} px: link 2 is tangent")

shown = np.arange(index + 1, index + 1 + first(lengths[index + 1 :] > LENGTH))
chart.axvspan(corner.first, corner.last, color="#9aa1ab", alpha=0.25, linewidth=0.0, label="corner")
chart.axhline(0.0, color="black", linewidth=0.8)
chart.bar(shown, sines[shown], color=np.where(sines[shown] > 0, GREEN, RED))
chart.plot(target, 0.0, "*", color="black", markersize=13, label=f"tangent point: {target}")
chart.set(xlabel="index i of the path point", ylabel=r"$F_i \times F_{i+1}$, by their lengths (sine)")
chart.set_title("the sign of the products")
chart.legend(loc="best")
print(f"The products change their sign between the path points {target} and {target + 1} of {len(lengths)}.")
plt.show()

# %% [markdown]
# ## Fig. 6: to which path point is the end closest?
#
# The same link in the same pose. From the tangent point on, it crosses one beam after the other. The
# distance from the crossing to the link's end shrinks, and the first one below the threshold ends the
# search. That beam's path point is where the next link begins to look. "The nearest path point" would be
# simpler, but the other leg of a U-turn can be nearer than the own one.

# %%
near = NEAR_END * path.width
heading = run.headings[n, k]
found = closest_path_point(way, *start, heading, LENGTH, target, len(path.points), near)
assert found == run.record[n, k - 1, CLOSEST]

along = np.array([np.cos(heading), np.sin(heading)])
beams = np.arange(target, found + 3)
crossings = np.sum((path.points[beams] - start) * path.tangents[beams], axis=1) / (
    path.tangents[beams] @ along
)
rest = LENGTH - crossings
figure, (place, chart) = plt.subplots(1, 2, figsize=(9.6, 4.4), width_ratios=(1.0, 1.15))
draw_walls(place, maze)
draw_beams(place, seen.beams, longest=1.2 * path.width, linewidth=0.35)
draw_path(place, path, marker="o", markersize=1.6, linewidth=0.8)
draw_choices(place, ends[n], run.record[n, :, CHOICE])
inside = rest >= 0
place.plot(*(start + crossings[inside, None] * along).T, "o", color="black", markersize=3.5, zorder=8)
for i in (target, found):
    place.plot(
        *path.points[i], "*" if i == target else "D", color="black", markersize=10 if i == target else 6
    )
place.plot(*np.array([path.points[found], start + crossings[found - target] * along]).T, color="black")
zoom(place, 0.5 * (path.points[target] + ends[n, k]), (170, 190))
place.set_title("link 2 crosses beams on its way to its end")
chart.plot(beams[inside], rest[inside], "o-", color="black", markersize=3.5, linewidth=0.8)
chart.axhline(near, color="#1f5fae", linestyle="--", label=f"threshold: {near:.0f} px")
chart.plot(
    found, rest[found - target], "D", color="black", markersize=7, label=f"closest path point: {found}"
)
chart.xaxis.get_major_locator().set_params(integer=True)
chart.set(xlabel="index of the beam", ylabel="from the crossing to the end (px)", ylim=(0.0, None))
chart.legend()
print(f"At beam {found} the crossing is {rest[found - target]:.1f} px before the end of the link.")
plt.show()

# %% [markdown]
# ## Figs. 7 and 8: the closest edge side
#
# The first pose in which the first link finds no tangent point and aims into the corner. It is a right
# corner, so the link goes for the left side: vectors lead from its start to the left ends of the beams.
# They grow, and the first one as long as the link gives the direction. The paper takes that beam's end. We
# take the place between the last end that is too near and that one, at just a link's length: otherwise the
# aim jumps from beam to beam.

# %%
k = 0
inside = run.record[:, k, TARGET] > corner.first
n = first((run.record[:, k, CHOICE] == EDGE) & settled[:, k] & inside)
start, index, target = ends[n, k + 1], run.record[n, k, CLOSEST], run.record[n, k, TARGET]
edge = way.lines[LEFT]
lengths = np.hypot(*(edge - start).T)
figure, (place, chart) = plt.subplots(1, 2, figsize=(9.6, 4.8), width_ratios=(1.0, 1.15))
draw_walls(place, maze)
draw_path(place, path)
draw_choices(place, ends[n], run.record[n, :, CHOICE])
for i in (*range(index, target, 6), target):
    place.plot(*np.array([path.points[i], edge[i]]).T, color=GREEN, linewidth=0.7)
    draw_arrow(place, start, edge[i], "#9aa1ab" if lengths[i] < LENGTH else "black", 0.9)
place.plot(*ends[n, k], "o", color=CHOICE_COLOURS[EDGE], markersize=7, markeredgecolor="black", zorder=9)
figure.legend(handles=choice_handles(), loc="outside lower center", ncols=4)
zoom(place, (120, 1330), (245, 300))
place.set_title(f"pose {n}, feed {run.feeds[n]:.0f} px: link 1 takes the edge side")
shown = np.arange(index, target + 6)
chart.plot(shown, lengths[shown], ".-", color=GREEN, linewidth=0.8, label="start to left end of beam i")
chart.axhline(LENGTH, color="black", linestyle="--", linewidth=1.0, label=f"link length: {LENGTH:.0f} px")
chart.plot(
    target,
    lengths[target],
    "o",
    color=CHOICE_COLOURS[EDGE],
    markeredgecolor="black",
    markersize=7,
    label=f"first at or beyond it: beam {target}",
)
chart.set(xlabel="index i of the beam", ylabel="length of the vector (px)")
chart.legend(loc="lower right")
miss = np.hypot(*(ends[n, k] - edge[target]))
print(f"Beam {target - 1} ends {lengths[target - 1]:.1f} px away, beam {target} {lengths[target]:.1f} px.")
print(f"The link ends between them, {miss:.1f} px from the end of beam {target}.")
plt.show()
