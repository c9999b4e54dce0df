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
# # Figs. 15 and 16: the words of the algorithm, and its flowchart
#
# Six links in one pose of the benchmark with the paper's abbreviations (Fig. 15), what every link does over
# the whole motion, and the flowchart (Fig. 16) of what our code does. RL is the *reference link*: its end
# has passed the base, its start has not. *Downstream* (DS) of it, towards the tip, links follow the rules;
# *upstream* (US) of it they lie on the feeder's axis. Each downstream link starts at the end of its
# *adjacent link* (AL) and looks at its *guide link* (GL), the next one towards the tip.

# %%
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import FancyBboxPatch

from hrsnake_env import ArmSpec, Maze
from planners.beam_planner import AS_PRINTED, CHOICES, run_beam
from planners.figures import (
    STYLE,
    choice_handles,
    draw_arrow,
    draw_choices,
    draw_ends,
    draw_path,
    draw_relay,
    draw_walls,
)
from planners.kernels.beam_types import CHOICE, PIECES, TANGENT, TARGET
from planners.survey import survey

plt.rcParams.update(STYLE)
LENGTH = 430.0
maze = Maze.load("fig19")
seen = survey(maze)
run = run_beam(seen, ArmSpec(link_length=LENGTH), AS_PRINTED)
ends = run.motion(maze).joints[:, ::-1]  # link k from the tip ends at ends[:, k], starts at ends[:, k + 1]

# %% [markdown]
# ## Fig. 15: six links
#
# The first pose with six links at least partly out, in which the second one is tangent. That one is the
# link in question, and the labels follow from it. Links are numbered n = 1 to 6 from the tip.

# %%
kinds = run.record[..., CHOICE]
n_placed = np.ceil(run.feeds / LENGTH - 1e-9).astype(int)
fits = n_placed == 6
fits &= (kinds[:, 1] == TANGENT) & (run.record[:, :5, PIECES] == 0).all(axis=1)
pose = int(np.flatnonzero(fits)[0])
joints, k, reference = ends[pose], 1, 5

figure, axes = plt.subplots(figsize=(6.6, 8.8))
draw_walls(axes, maze)
draw_path(axes, seen.path, linewidth=1.0)
draw_ends(axes, maze)
draw_choices(axes, joints[: reference + 3], kinds[pose], linewidth=4.0)
BOX = {"facecolor": "white", "edgecolor": "#4b5058", "linewidth": 0.5, "alpha": 0.95, "pad": 2.0}
LOOK = {"fontsize": 8.5, "ha": "center", "va": "center", "bbox": BOX, "zorder": 10}


def name(text, place, spot):
    leader = {"arrowstyle": "-", "color": "black", "linewidth": 0.7}
    axes.annotate(text, place, xytext=spot, arrowprops=leader, annotation_clip=False, **LOOK)


for j in range(reference + 1):
    roles = {k - 1: "GL, DS", k: "link in question, DS", k + 1: "AL, DS", reference: "RL"}
    text = f"n = {j + 1}: {CHOICES[int(kinds[pose, j])]}\n{roles.get(j, 'DS')}"
    middle = joints[j : j + 2].mean(axis=0)
    side = -1 if middle[0] < 120 else +1
    name(text, middle, (120 + side * 430, middle[1]))
touch = seen.path.points[run.record[pose, k, TARGET]]
axes.plot(*touch, "*", color="black", markersize=14, zorder=9)
name("TP", touch, touch - (45, 75))
name("SPC", joints[k + 1], joints[k + 1] + (0, 110))
name("EPC", joints[k], joints[k] + (250, 0))
name("US, in the feeder", maze.base_pose[:2] - (0, 60), (-310, -50))
axes.set(xlim=(-480, 720), ylim=(-150, 1770))
axes.legend(handles=choice_handles(), loc="lower center", bbox_to_anchor=(0.5, -0.04), ncols=4)
axes.set_title(f"{LENGTH:.0f} px, pose {pose}, feed {run.feeds[pose]:.0f} px")
print(f"The link in question is n = {k + 1}; RL is n = {reference + 1}.")
plt.show()

# %% [markdown]
# ## The relay
#
# What each link does, over the feed. A link comes out of the feeder on its axis and takes the edge side.
# The first one finds a tangent point, lets go of it again and goes for the path behind the corner. Only
# then may the second one be tangent, for a short while; when it lets go, the third one is blocked by that
# jump, and stays on the edge side.

# %%
figure, axes = plt.subplots(figsize=(9.6, 3.2))
draw_relay(axes, run.feeds, kinds[:, : run.n_links])
axes.axvline(run.feeds[pose], color="black", linewidth=1.2, linestyle="--")
axes.set_title(f"dashed: the pose above, feed {run.feeds[pose]:.0f} px")
axes.set_xlabel("feed (px)")
figure.legend(handles=choice_handles(), loc="outside lower center", ncols=4)
for j in range(run.n_links):
    fed = np.diff(run.feeds, append=run.feeds[-1])
    shares = ", ".join(f"{name} {fed[kinds[:, j] == c].sum():.0f}" for c, name in CHOICES.items())
    print(f"link {j + 1}, px of feed: {shares}")
plt.show()

# %% [markdown]
# ## Fig. 16: the flowchart
#
# What `feed_arm` and `place_arm` in `planners/kernels/beam_arm.py` do for one pose. Names in typewriter
# letters are functions in `planners/kernels/`. The paper has no clamp, and the one before the last box is
# skipped by `AS_PRINTED`.

# %%
PART = {"start": "#eceef1", "A": "#dbe9f8", "B": "#fdf0d5", "C": "#e3f2e1", "end": "#eceef1"}
STEPS = (  # column and row, width, part, text
    ("feed", 0, 0, 3.6, "start", "a little more feed:  feed_arm"),
    ("A", 0, 1, 3.6, "A", "Part A: reference link, on the axis\nplace_reference_link"),
    ("C", 0, 2, 3.6, "C", "Part C: upstream links, in the feeder\nplace_upstream_links"),
    ("next", 0, 3, 3.6, "B", "Part B: next link downstream, with SPC\n= EPC of AL:  place_downstream_link"),
    ("closest", 0, 4, 3.6, "B", "closest path point, 3.2\nclosest_path_point"),
    ("tangent?", 0, 5, 3.6, "B", "tangent point found?  3.1\ntangent_point"),
    ("blocked?", 4.2, 5, 3.6, "B", "blocked by GL?  3.6\nblocking"),
    (
        "edge?",
        0,
        6,
        3.6,
        "B",
        "critical corner ahead, beam's end in reach,\nno semi-critical corner?  3.3 to 3.5",
    ),
    ("path", 0, 7, 3.6, "B", "PATH POINT  3.4\npath_point"),
    ("edge", 4.2, 7, 1.9, "B", "EDGE SIDE  3.3\nedge_side"),
    ("tangent", 8.0, 7, 1.7, "B", "TANGENT\nto TP"),
    ("soften", 4.2, 8, 3.6, "B", "remember a jump, 3.6, and soften it, 3.7\nremember_jump, soften"),
    ("clamp", 4.2, 9, 3.6, "B", "not in the paper: clamp into the\nfree interval, clamp_to_free"),
    ("epc", 4.2, 10, 3.6, "B", "EPC = SPC + L (cos, sin)\nwas it the tip's link, n = 1?"),
    ("moved", 4.2, 11, 3.6, "end", "has a joint moved too far?\nlargest_movement"),
    ("goal", 4.2, 12, 3.6, "end", "keep the pose. Is the tip at the goal?"),
)
WAYS = (  # from, to, label
    ("feed", "A", ""), ("A", "C", ""), ("C", "next", ""), ("next", "closest", ""),
    ("closest", "tangent?", ""), ("tangent?", "blocked?", "yes"), ("tangent?", "edge?", "no"),
    ("blocked?", "edge?", "yes"), ("blocked?", "tangent", "no"),
    ("edge?", "edge", "yes"), ("edge?", "path", "no"),
    ("path", "soften", ""), ("edge", "soften", ""), ("tangent", "soften", ""),
    ("soften", "clamp", ""), ("clamp", "epc", ""), ("epc", "moved", "yes"), ("moved", "goal", "no"),
)  # fmt: skip
BACK = (
    ("epc", "next", -2.35, "no: n - 1"),
    ("moved", "feed", -2.75, "yes: feed less"),
    ("goal", "feed", -3.15, "no"),
)
HALF, PITCH = 0.38, 1.3

figure, axes = plt.subplots(figsize=(8.6, 10.4))
where = {key: (x, -PITCH * row) for key, x, row, *_ in STEPS}
wide = {key: width / 2 for key, _, _, width, *_ in STEPS}
for _, x, row, width, part, text in STEPS:
    box = FancyBboxPatch(
        (x - width / 2, -PITCH * row - HALF),
        width,
        2 * HALF,
        boxstyle="round,pad=0.02",
        facecolor=PART[part],
        linewidth=0.8,
    )
    axes.add_patch(box)
    axes.annotate(text, (x, -PITCH * row), ha="center", va="center", fontsize=7.5)
for a, b, label in WAYS:
    (xa, ya), (xb, yb) = where[a], where[b]
    if ya == yb:
        start, end = (xa + wide[a], ya), (xb - wide[b], yb)
    else:
        start, end = (
            (xa + np.sign(xb - xa) * 0.5 * wide[a], ya - HALF),
            (xb - np.sign(xb - xa) * 0.6 * wide[b], yb + HALF),
        )
    draw_arrow(axes, start, end, "#4b5058", 1.1)
    middle = 0.5 * (np.array(start) + end) + ((-0.1, 0.08) if ya == yb else (0.12, -0.05))
    axes.annotate(label, middle, fontsize=7.5, weight="bold")
for a, b, x, label in BACK:
    (xa, ya), (xb, yb) = where[a], where[b]
    axes.plot([xa - wide[a], x, x], [ya, ya, yb], color="#4b5058", linewidth=1.1)
    draw_arrow(axes, (x, yb), (xb - wide[b], yb), "#4b5058", 1.1)
    axes.annotate(label, (xa - wide[a] - 0.1, ya + 0.08), ha="right", fontsize=7.5, weight="bold")
axes.set(xlim=(-3.4, 9.2), ylim=(-16.2, 0.6))
axes.set_axis_off()
plt.show()
