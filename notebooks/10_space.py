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
# # Figs. 20, 21 and 22: path following in space, and the arm that only tight manoeuvring gets through
#
# How does an arm of long links get through a room full of panels? With its link ends on the path, one of many
# short links covers the path, and one of few long links cuts through the walls (Figs. 20 to 22). One joint
# track for the whole motion takes the same long links through without touching anything. The paper's
# workspace is not published; ours has seven panels with a window each, six of them in pairs so close that the
# arm has to turn twice by about 90 degrees between two windows. At the end: a room of one's own.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Image

from hrsnake_env import ArmSpec
from planners.figures import STYLE
from planners.spatial import Panel, Workspace, follow_path, load_workspace, mapping_error, plan
from planners.spatial.drawing import draw_motion
from planners.spatial.path import global_path
from planners.spatial.potential import laplace_potential
from planners.spatial.validation import signed_distances
from planners.spatial.viewer import Scene, show

plt.rcParams.update(STYLE)
room = load_workspace("paired-panels")
path = global_path(room, laplace_potential(room))
print(f"a path of {path.length:.1f} units")

# %% [markdown]
# ## Following
#
# Every joint is on the path, each at the nearest place behind the next that is one link length away. The
# *mapping error* says how far the links are from the path for that: it grows with the square of their length.

# %%
followed = {length: follow_path(path, room, length) for length in (8.0, 30.0, 90.0)}


def distances_of(motion, room=room, radius=0.0):
    return signed_distances(motion.joints, room, motion.base_pose) - radius


for length, motion in followed.items():
    error, distances = mapping_error(path, length), distances_of(motion)
    print(
        f"{motion.n_links} links of {length:g}: off the path by up to {error.link_to_path:.2f}, "
        f"smallest distance {distances.min():.2f}"
    )


# %%
def picture(motion, room=room, poses=(-1,), radius=0.0):
    line = path.points if room.name == "paired-panels" else None
    look = {"poses": poses, "distances": distances_of(motion, room, radius), "link_radius": radius}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "pose.png")
        draw_motion(room, motion, line, file, **look)
        return Image(file.read_bytes(), width=1000)


# %% [markdown]
# Figs. 20 and 21: links of 8 cover the path, links of 30 follow it closely.

# %%
picture(followed[8.0])

# %%
picture(followed[30.0])

# %% [markdown]
# Fig. 22: links of 90 are up to a quarter of their length deep in the panels (red).

# %%
picture(followed[90.0], poses=None)

# %%
figure, axes = plt.subplots(figsize=(8, 3))
for length, motion in followed.items():
    share = np.linspace(0.0, 1.0, motion.n_poses)
    axes.plot(share, np.minimum(distances_of(motion).min(axis=1), 60.0), label=f"links of {length:g}")
axes.axhspan(-30.0, 0.0, color="#d62728", alpha=0.1)
axes.set_xlabel("share of the motion")
axes.set_ylabel("smallest distance, units")
axes.legend()
plt.show()

# %% [markdown]
# ## Tracking
#
# The `track` planner lets chords of the path grow from half the link length to the whole. What comes into an
# obstacle is pushed out of it by the smallest translation that separates the two, across one of its faces or
# one of its edges, and takes the curve with it. The exact checker has the last word.

# %%
result = plan(room, ArmSpec(link_length=90.0))
print(result.status, result.motion)
print({stage: f"{1e3 * seconds:.0f} ms" for stage, seconds in result.timings.items()})
print(f"clearance {result.report.clearance:.3f}, between poses {result.report.penetration_between:g} deep")

# %%
picture(result.motion)

# %% [markdown]
# Turn it, and let it play:

# %%
show(
    [
        Scene(name=name, workspace=room, motion=motion, path=path.points, distances=distances_of(motion))
        for name, motion in (("followed", followed[90.0]), ("tracked", result.motion))
    ]
)

# %% [markdown]
# ## How long may a link be?
#
# A link whose rear joint comes to the end of the straight stretch, 90 past the base, with its front joint
# through the first window (of 60 by 60 about the axis, up to 150 along it), cannot have reached the second
# panel at 200, whose window is elsewhere. That leaves 110 units along the axis at a slope of 1 : 1/2 : 1/2 at
# most: 110 times the square root of 1.5, 134.7 in all. `hrsnake spatial longest paired-panels` searches; here
# are some lengths.

# %%
for length in (57.0, 58.0):
    print(f"followed with {length:g}:", plan(room, ArmSpec(link_length=length), "follow").status)
tracked = {length: plan(room, ArmSpec(link_length=length)) for length in (120.0, 130.0, 136.0)}
for length, outcome in tracked.items():
    print(f"tracked with {length:g}:", outcome.status, outcome.reason)

# %%
picture(tracked[130.0].motion)

# %% [markdown]
# ## A room of one's own
#
# Boxes, panels with a window, a base and a goal: that is a `Workspace`. The arm may be thick and its joints
# limited; here links of 80 mm, 12 mm thick, whose joints bend by 50 degrees at most. `own.save("own.json")`
# writes a file that `hrsnake spatial plan own.json` reads.

# %%
boxes = [((0, 0, 0), (300, 120, 90)), ((260, 180, 0), (300, 400, 300)), ((360, 0, 120), (400, 270, 300))]
panel = Panel(
    low=(480, 0, 0), high=(500, 400, 300), normal="x", window_low=(480, 60, 60), window_high=(500, 130, 130)
)
own = Workspace(
    name="own",
    room_low=(0, 0, 0),
    room_high=(600, 400, 300),
    open_sides=("x-",),
    panels=(panel,),
    boxes=boxes,
    base=(0, 300, 150),
    heading=(1, 0, 0),
    straight=80,
    goal=(560, 300, 240),
    goal_radius=5,
    units="mm",
)
thick = ArmSpec(link_length=80.0, link_radius=6.0, joint_limit=np.radians(50.0))
result = plan(own, thick)
print(result.status, result.motion, f"{1e3 * sum(result.timings.values()):.0f} ms")
print(f"clearance {result.report.clearance:.3f} mm between links and walls")

# %%
picture(result.motion, own, radius=thick.link_radius)
