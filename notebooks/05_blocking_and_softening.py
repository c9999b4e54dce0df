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
# # Figs. 12, 13 and 14: blocking, and softening of sudden jumps
#
# Two rules make links wait for each other. A link must not touch the path at a corner while its *guide
# link*, the next one towards the tip, is tangent there, nor after its guide link has jumped, until that is
# tangent again (*blocking*, Fig. 12). And no link may jump from a tangent point to an edge side at once
# (*softening*, Figs. 13 and 14). All of it happens below in runs through the benchmark, with the rules as
# printed. Links are numbered from the tip.

# %%
import matplotlib.pyplot as plt
import numpy as np
import shapely

from hrsnake_env import ArmSpec, Maze
from planners.beam_planner import (
    AS_PRINTED,
    POSES_PER_LINK,
    FedArm,
    Rules,
    coordinate_at_length,
    run_beam,
    tangent_point,
)
from planners.figures import (
    CHOICE_COLOURS,
    GREEN,
    STYLE,
    choice_handles,
    draw_arrow,
    draw_choices,
    draw_path,
    draw_walls,
    wall_depths,
    zoom,
)
from planners.kernels.beam_types import (
    BLOCKED,
    CHOICE,
    CLOSEST,
    EDGE,
    GUIDE_JUMPED,
    LEFT,
    PIECES,
    TANGENT,
)
from planners.survey import survey

plt.rcParams.update(STYLE)
LENGTH = 430.0
maze = Maze.load("fig19")
seen = survey(maze)


def run_of(length, **rules):
    run = run_beam(seen, ArmSpec(link_length=length), Rules(clamp=False, **rules))
    return run, run.motion(maze)


def jump_of(
    run, k
):  # the pose in which a link goes over from tangent to edge side, and the first settled one
    kinds = run.record[:, k, CHOICE]
    n = 1 + int(np.flatnonzero((kinds[:-1] == TANGENT) & (kinds[1:] == EDGE))[0])
    return n, n + int(np.flatnonzero(run.record[n:, k, PIECES] == 0)[0])


def put(axes, text, place, offset):
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 0.8}
    axes.plot(*place, "o", color="black", markersize=5, zorder=9)
    axes.annotate(text, place, xytext=offset, textcoords="offset points", bbox=box, weight="bold", zorder=10)


# %% [markdown]
# ## Fig. 12: the second link jumps, the third one is blocked
#
# The first pose in which the second link loses its tangent point: its end jumps from A to A'. In the next
# pose the third link could be tangent, with its end at B', but it is blocked and takes the edge side, B''.
# The circle about the joint of the two, with the link length as radius, shows that the jump meets no wall.
# One thing differs from the paper's figure: there the third link jumps from B' to B''. Here it is on the
# edge side already, as the other rule has kept it there while the second link was tangent; the jump only
# keeps it there for longer.

# %%
run, motion = run_of(LENGTH)
ends, record = motion.joints[:, ::-1], run.record
n, after = jump_of(run, 1)
held = n + int(np.flatnonzero(record[n:, 2, BLOCKED] == GUIDE_JUMPED)[0])
a, b = ends[n - 1, 1], ends[after, 1]
joint = ends[after, 2]
start, way = ends[held, 3], FedArm(seen, ArmSpec(link_length=LENGTH), AS_PRINTED).way
could = tangent_point(way, *start, record[held, 2, CLOSEST], LENGTH)
aim = seen.path.points[could] - start
b_tangent = start + LENGTH * aim / np.hypot(*aim)
angles = np.unwrap([np.arctan2(*(end - joint)[::-1]) for end in (a, b)])
arc = joint + LENGTH * np.column_stack([f(np.linspace(*angles, 60)) for f in (np.cos, np.sin)])
assert shapely.intersects_xy(maze.free_space, arc[:-1]).all()  # A' itself is on the wall

figure, every = plt.subplots(1, 3, figsize=(10.4, 4.9))
titles = ("a. just before: A", "b. after the jump: A'", "c. the third link: B'' instead of B'")
for axes, pose, title in zip(every, (n - 1, after, held), titles, strict=True):
    draw_walls(axes, maze)
    draw_path(axes, seen.path)
    draw_choices(axes, ends[pose], record[pose, :, CHOICE])
    zoom(axes, (120, 1290), (250, 345))
    axes.set_title(f"{title}\nfeed {run.feeds[pose]:.1f} px")
put(every[0], "A", a, (6, 6))
put(every[1], "A", a, (6, 6))
put(every[1], "A'", b, (6, -14))
every[1].add_patch(plt.Circle(joint, LENGTH, fill=False, color="#d6336c", linestyle="--", zorder=7))
put(every[2], "B''", ends[held, 2], (-22, -16))
put(every[2], "B'", b_tangent, (8, 2))
every[2].plot(*np.array([start, b_tangent]).T, color=CHOICE_COLOURS[TANGENT], linestyle=":", linewidth=2.5)
figure.legend(handles=choice_handles(), loc="outside lower center", ncols=4)
fed = run.feeds[after] - run.feeds[n - 1]
print(
    f"The second link's end jumps {np.hypot(*(b - a)):.0f} px within {fed:.1f} px of feed, in the free space."
)
print(f"B' is {np.hypot(*(b_tangent - ends[held, 2])):.0f} px from B''.")
plt.show()

# %% [markdown]
# ## What the two rules are good for
#
# The same arm with both rules, and without one or both of them, at three lengths: how deep the links come
# into the walls, over the feed.

# %%
CASES = {
    "both rules": ({}, "#2e9e5b"),
    "without the jump rule": ({"jump_blocks": False}, "#1f5fae"),
    "without the tangent rule": ({"tangent_blocks": False}, "#e67700"),
    "without either": ({"tangent_blocks": False, "jump_blocks": False}, "#d62828"),
}
figure, every = plt.subplots(3, 1, figsize=(9.6, 6.4), sharex=True)
for axes, length in zip(every, (250.0, 350.0, 430.0), strict=True):
    told = []
    for number, (name, (rules, colour)) in enumerate(CASES.items()):
        other, its_motion = run_of(length, **rules)
        deep = wall_depths(its_motion, maze, samples=33).max(axis=1)
        style = {"linewidth": 3.2 - 0.7 * number, "linestyle": "--" if number == 3 else "-"}
        axes.plot(other.feeds, deep, color=colour, label=name, **style)
        told.append(f"{name} {deep.max():.1f}")
    axes.set(title=f"links of {length:.0f} px", ylabel="depth (px)", xlim=(1200, 3000))
    print(f"{length:.0f} px, deepest in px: {', '.join(told)}")
every[0].legend(loc="upper left")
every[2].set_xlabel("feed (px)")
plt.show()

# %% [markdown]
# With both rules no link goes into a wall, at any of the three. The tangent rule is the one that long links
# cannot do without. The jump rule is worth a few pixels with shorter ones, and nothing at the paper's
# length.
#
# ## Fig. 13: softening
#
# The first link lets go of the path: A is where its end is, B where it would be at once. $F_1$ leads from A
# to B; it is divided into as many pieces as the *softening degree*, and $F_2$ is one of them. The paper
# divides the line from A to B. We divide the turn, as links turn about a joint and do not shrink, and B may
# move on meanwhile. Degree 8 makes the pieces visible; the default is 3.

# %%
DEGREE = 8
run, motion = run_of(LENGTH, softening_degree=DEGREE)
ends, record = motion.joints[:, ::-1], run.record
n, after = jump_of(run, 0)
a, start = ends[n - 1, 0], ends[n, 1]
_, direction = coordinate_at_length(way.lines[LEFT], *start, record[n, 0, CLOSEST], LENGTH)
b = start + LENGTH * np.array([np.cos(direction), np.sin(direction)])
pieces = record[n : after + 1, 0, PIECES]
last = np.append(np.flatnonzero(np.diff(pieces)), len(pieces) - 1) + n  # the last pose of each piece

figure, (place, chart) = plt.subplots(1, 2, figsize=(9.6, 4.9), width_ratios=(1.0, 1.1))
draw_walls(place, maze)
draw_path(place, seen.path)
draw_choices(place, ends[n - 1], record[n - 1, :, CHOICE])
for pose in last:
    place.plot(*ends[pose, :2].T, color=CHOICE_COLOURS[EDGE], linewidth=1.0, alpha=0.8)
place.plot(*ends[last, 0].T, "o", color=CHOICE_COLOURS[EDGE], markersize=4, zorder=8)
draw_arrow(place, a, b, "black", 1.6)
draw_arrow(place, a, a + (b - a) / DEGREE, "#d6336c", 2.2)
put(place, "A", a, (-14, -14))
put(place, "B", b, (8, 6))
place.annotate("$F_1$", 0.4 * a + 0.6 * b, xytext=(-8, 10), textcoords="offset points", weight="bold")
zoom(place, 0.5 * (a + b) + (0, 30), (75, 80))
place.set_title(f"degree {DEGREE}: from A to B, $F_2$ in red")
for degree, colour in zip((1, 3, 8, 20), plt.get_cmap("viridis")(np.linspace(0.0, 0.85, 4)), strict=True):
    other, _ = run_of(LENGTH, softening_degree=degree)
    m, _ = jump_of(other, 0)
    shown = np.abs(other.feeds - other.feeds[m - 1] - 20.0) < 40.0
    chart.plot(
        other.feeds[shown] - other.feeds[m - 1],
        np.degrees(other.headings[shown, 0]),
        color=colour,
        linewidth=1.6,
        label=f"degree {degree}",
    )
chart.set(xlabel="feed after the jump begins (px)", ylabel="heading of the first link (degrees)")
chart.legend(loc="upper right")
print(f"|F1| = {np.hypot(*(b - a)):.0f} px, |F2| = {np.hypot(*(b - a)) / DEGREE:.0f} px, {len(last)} pieces.")
plt.show()

# %% [markdown]
# ## Fig. 14: on the way to the leftmost side
#
# The same jump goes on pose by pose until the link's end is on the left ends of the beams (green), and
# along them from there.

# %%
edge = shapely.LineString(way.lines[LEFT])
apart = shapely.distance(shapely.points(ends[:, 0]), edge)
arrived = n + int(np.flatnonzero(apart[n:] < 0.5)[0])
figure, axes = plt.subplots(figsize=(5.4, 5.6))
draw_walls(axes, maze)
draw_path(axes, seen.path)
axes.plot(*way.lines[LEFT].T, color=GREEN, linewidth=2.5, zorder=7)
poses = np.linspace(n - 1, arrived, 8).round().astype(int)
for pose, alpha in zip(poses, np.linspace(0.25, 1.0, len(poses)), strict=True):
    draw_choices(axes, ends[pose, :3], record[pose, :2, CHOICE], linewidth=2.2, alpha=alpha)
axes.legend(handles=choice_handles(), loc="lower left")
zoom(axes, ends[n - 1, :2].mean(axis=0), (230, 300))
axes.set_title(f"feed {run.feeds[n - 1]:.1f} to {run.feeds[arrived]:.1f} px")
print(f"Before the jump the end is {apart[n - 1]:.0f} px from the edge side, and")
print(f"on it after {run.feeds[arrived] - run.feeds[n - 1]:.1f} px of feed.")
plt.show()

# %% [markdown]
# ## What softening costs
#
# Softening trades depth for continuity. With a higher degree links turn more slowly in a jump. But the arm
# is fed on meanwhile, and the link is not yet where the rules want it. At the paper's length a degree of 3,
# our default, costs nothing; each piece from about the fifth on costs more.

# %%
degrees = (1, 2, 3, 4, 5, 6, 8, 12, 16, 20)
fastest, deepest = [], []
for degree in degrees:
    other, its_motion = run_of(LENGTH, softening_degree=degree)
    first, settled = jump_of(other, 0)
    turns = np.abs(np.diff(other.headings[first - 1 : settled + 1, 0]))
    per_pose = np.degrees(turns / np.diff(other.feeds[first - 1 : settled + 1])) * LENGTH / POSES_PER_LINK
    fastest.append(per_pose.max())
    deepest.append(wall_depths(its_motion, maze, samples=33).max())
    print(f"degree {degree}: {fastest[-1]:.1f} degrees per regular pose, {deepest[-1]:.1f} px deep")
figure, (turn, depth) = plt.subplots(1, 2, figsize=(9.6, 3.4))
turn.plot(degrees, fastest, "o-", color="#1f5fae")
turn.set(
    xlabel="softening degree",
    ylabel="first link's jump: fastest turn\n(degrees per regular pose)",
    ylim=(0, None),
)
depth.plot(degrees, deepest, "o-", color="#d62828")
depth.set(xlabel="softening degree", ylabel="depth (px)")
for axes in (turn, depth):
    axes.xaxis.get_major_locator().set_params(integer=True)
plt.show()

# %% [markdown]
# Our reading: what is softened is a change of choice, from tangent point to edge side or back. Where a link
# that keeps its choice turns fast, because the edge itself has a corner, the arm is fed in smaller steps
# instead.
