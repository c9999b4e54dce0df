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
# # Quick start: a duct, a plan, and two verdicts
#
# How does an arm of a few long, rigid links get through a duct that they barely fit in? `plan` finds the way
# of all joints in a fraction of a second; an exact checker says that no link is ever in a wall; and a
# simulation with real walls says whether the links merely pinched them. Five minutes, from an empty page to
# both verdicts.

# %%
import matplotlib.pyplot as plt
import numpy as np

from hrsnake_env import ArmSpec, Maze
from hrsnake_env.physics import CONTROL_TIMESTEP
from hrsnake_env.replay import show
from planners import longest_link, plan, validate
from planners.figures import STYLE, draw_arm, draw_ends, draw_walls
from planners.rollout import simulate_motion

plt.rcParams.update(STYLE)

# %% [markdown]
# ## A duct
#
# A maze is the free space between walls, a base where a feeder pushes the arm in, and a goal for its tip.
# Corridors are the quickest way to one: a centreline and a width. `Maze.load` knows more by name (`fig17a`,
# `fig19`, `clutter-7`) and reads files; a floor plan or drawing of your own is notebook 13.

# %%
centreline = [(0, 0), (0, 700), (500, 700), (500, 250), (1000, 250)]
duct = Maze.from_corridors(centreline, 100.0, name="duct", units="mm")
arm = ArmSpec(link_length=240.0)
print(duct, "of", duct.units)

# %% [markdown]
# ## A plan
#
# One call. The arm gets as many links as the way needs; `result.status` says how planning ended, and
# `result.motion` is there only if the exact checker has passed it.

# %%
result = plan(duct, arm)
motion = result.motion
print(f"{result.status} by '{result.planner}' in {1e3 * sum(result.timings.values()):.0f} ms: {motion}")
print({stage: f"{1e3 * seconds:.1f} ms" for stage, seconds in result.timings.items()})

# %%
figure, every = plt.subplots(1, 4, figsize=(10.0, 3.1))
for axes, share in zip(every, (0.25, 0.5, 0.75, 1.0), strict=True):
    pose = round(share * (motion.n_poses - 1))
    draw_walls(axes, duct)
    draw_ends(axes, duct)
    draw_arm(axes, motion.joints[pose])
    axes.set(xlim=(-60, 1010), ylim=(-60, 760), title=f"{motion.feed[pose]:.0f} mm fed")
plt.show()

# %% [markdown]
# A motion is plain arrays: how far the arm is fed, and the angle of every joint, pose by pose. Links behind
# the base are in the feeder and straight.

# %%
print("feed", motion.feed.shape, "joint angles", motion.joint_angles.shape, "joints", motion.joints.shape)
figure, axes = plt.subplots(figsize=(9.6, 2.8))
for joint, angles in enumerate(np.degrees(motion.joint_angles).T):
    axes.plot(motion.feed, angles, color=plt.cm.viridis(joint / motion.n_links), label=f"joint {joint}")
axes.set(xlabel="fed (mm)", ylabel="joint angle (deg)")
axes.grid(color="#e3e5e8", linewidth=0.6)
axes.legend(ncols=2, loc="upper left", bbox_to_anchor=(1.0, 1.0))
plt.show()

# %% [markdown]
# ## The exact check
#
# `validate` trusts no planner: lengths, the feeder, the distance of every link to every wall at the poses and
# *between* them, links that cross, start and goal. It has passed this motion already. In a duct that is 5 mm
# narrower it has not, and says why.

# %%
report = validate(motion, duct, arm)
print(
    f"valid: {report.valid}; nearest to a wall {report.clearance:.3f} mm, in walls {report.penetration:g} mm"
)
narrow = Maze.from_corridors(centreline, 95.0, name="narrower", units="mm")
for fault in validate(motion, narrow, arm).faults:
    print("narrower:", fault.message)

# %% [markdown]
# ## The simulated run
#
# `simulate_motion` drives an arm with masses, motors and solid walls along the motion. Its verdict counts
# each link at each pose: free, pinching a wall (to a thousandth of its length), or in collision. `clean`
# means that nothing was worse than a pinch and no wall had to push.

# %%
run = simulate_motion(motion, duct, arm)
verdict = run.report
print(f"goal reached: {run.success}; clean: {verdict.clean}; {run.n_steps} steps in {run.seconds:.2f} s")
print(f"free {verdict.free}, pinching {verdict.pinch}, colliding {verdict.collision} link-poses")

# %% [markdown]
# The replay is one page that needs nothing else: play it, scrub, zoom, click a link. `save_replay` writes it
# to a file that you can send to somebody.

# %%
show([run.trace(duct, title="duct, 240 mm")], height=620)

# %% [markdown]
# The same at a glance: how far each link is from the nearest wall, over time. Every bend is a wave that runs
# through the arm, from the tip to the base: each link in its turn squeezes through (yellow). The thin strokes
# before are links that come out of the feeder, whose mouth is 5 mm from the wall behind it.

# %%
figure, axes = plt.subplots(figsize=(9.6, 2.6))
seconds, links = CONTROL_TIMESTEP * np.arange(len(run.joints)), np.arange(motion.n_links)
image = axes.pcolormesh(seconds, links, run.clearances.T, cmap="viridis_r", vmin=0.0, vmax=25.0)
axes.set(xlabel="time (s)", ylabel="link, the tip's above", yticks=links)
figure.colorbar(image, label="nearest wall (mm)", extend="max")
plt.show()

# %% [markdown]
# ## Too long
#
# No plan is an answer, too: a status and one sentence. And how long may a link be? `longest_link` searches
# from below with the planners, and from above with a proof about single rods.

# %%
refused = plan(duct, ArmSpec(link_length=290.0))
print(f"{refused.status}: {refused.reason}")
longest = longest_link(duct, accuracy=0.01, time_budget=1.0)
print(f"longest {longest.length:.1f} mm, index I = {longest.index_text}")
print(f"no rod longer than {longest.bound.upper:.1f} mm passes")

# %% [markdown]
# ## Without Python
#
# The same steps in one of the named mazes, as commands:
#
#     hrsnake plan fig19 --link-length 430 --out m.npz --picture m.png
#     hrsnake validate fig19 m.npz
#     hrsnake simulate fig19 m.npz --replay m.html
#     hrsnake longest fig19
#
# From here: how tight is tight (notebook 11), learning from the planner (12), a map of your own and a
# trajectory for a robot (13), arms in space (10), and what the planners do inside (01 to 09).
