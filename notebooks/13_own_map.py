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
# # From a floor plan to a robot
#
# How does a map of one's own become a trajectory that a real controller runs? In four calls: `read_map` makes
# a maze of a ROS map, an image, or a drawing (SVG, DXF, GeoJSON), and never makes free what is not; `plan`
# finds the motion; `time_parametrise` gives it time within the limits of the joints; `export_bytes` checks it
# once more and writes it for ROS 2. The map here is drawn by the notebook itself, as a scan would have been.

# %%
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image, ImageDraw

from hrsnake_env import ArmSpec
from hrsnake_env.maps import MapOptions, read_map
from planners import plan
from planners.export import TrajectoryLimits, check_trajectory, export_bytes, time_parametrise
from planners.figures import STYLE, draw_ends, draw_stages, draw_walls

plt.rcParams.update(STYLE)
files = tempfile.TemporaryDirectory()
folder = Path(files.name)

# %% [markdown]
# ## The scan
#
# A plant room of 8 m by 6 m, at 2 cm to a pixel: walls and machines are black, what is free is white, and
# what nobody has seen is grey. Beside the picture a ROS map has a small file that says what its pixels mean.

# %%
FREE, WALL, UNKNOWN, RESOLUTION = 254, 0, 205, 0.02
MACHINES = [(1.0, 0.0, 1.2, 4.9), (2.3, 1.2, 2.5, 6.0), (2.5, 1.2, 4.6, 1.4), (3.6, 2.5, 5.8, 2.7)]
MACHINES += [(5.6, 0.0, 5.8, 2.6), (3.6, 3.8, 7.1, 4.0), (6.9, 1.1, 7.1, 3.9)]
SLANTED = [(2.5, 3.1), (3.0, 3.6), (2.5, 4.4)]
TANKS = [(4.4, 5.0, 0.45), (6.3, 5.2, 0.35), (3.2, 5.4, 0.3)]


def pixels(*metres):
    return [round(value / RESOLUTION) + 20 for value in metres]


image = Image.new("L", (440, 340), UNKNOWN)
pen = ImageDraw.Draw(image)
pen.rectangle(pixels(-0.15, -0.15, 8.15, 6.15), fill=WALL)
pen.rectangle(pixels(0.0, 0.0, 8.0, 6.0), fill=FREE)
for left, low, right, high in MACHINES:
    pen.rectangle(pixels(left, low, right, high), fill=WALL)
pen.polygon(pixels(*np.ravel(SLANTED)), fill=WALL)
for x, y, radius in TANKS:
    pen.ellipse(pixels(x - radius, y - radius, x + radius, y + radius), fill=WALL)
image = image.transpose(Image.Transpose.FLIP_TOP_BOTTOM)  # rows of a picture go down, y goes up
image.save(folder / "plant.png")
(folder / "plant.yaml").write_text(
    f"image: plant.png\nresolution: {RESOLUTION}\norigin: [-0.4, -0.4, 0.0]\n"
    "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
figure, axes = plt.subplots(figsize=(8.0, 5.9))
axes.imshow(image, cmap="gray", vmin=0, vmax=255, extent=(-0.4, 8.4, -0.4, 6.4))
axes.set(xlabel="x (m)", ylabel="y (m)")
plt.show()

# %% [markdown]
# ## The maze
#
# What nobody has seen counts as a wall, and the steps of pixels along slanted walls become straight lines on
# the side of the free space: it may shrink by `tolerance`, and grows nowhere. A map does not say where the
# arm stands nor where it should go: that is read off the picture, in metres.

# %%
reading = read_map(folder / "plant.yaml", MapOptions())
for note in reading.notes:
    print("-", note)
print(f"- walls moved into the free space by up to {1e3 * reading.moved:.0f} mm, ", end="")
print(f"of {1e3 * reading.tolerance:.0f} mm allowed")
room = reading.maze(base_pose=(0.5, 0.1, np.pi / 2), goal=(7.5, 0.6), goal_radius=0.1)
print(room, "in", room.units)

# %% [markdown]
# ## The plan
#
# Links of 1.2 m and 6 cm thick, in aisles of 1 m. They are planned as if they were 10 cm thick, so that they
# keep 2 cm off everything: robots are not as exact as checkers. Poses at 35 % (red), 65 % (violet) and the
# end (blue).

# %%
arm = ArmSpec(link_length=1.2, link_radius=0.05)
result = plan(room, arm)
motion, report = result.motion, result.report
print(f"{result.status} in {1e3 * sum(result.timings.values()):.0f} ms: {motion}")
print(f"{1e3 * (report.clearance + 0.02):.1f} mm or more between links and walls")
figure, axes = plt.subplots(figsize=(8.0, 6.0))
draw_walls(axes, room)
draw_ends(axes, room)
draw_stages(axes, motion.joints)
axes.set(xticks=range(9), yticks=range(7), xlabel="x (m)", ylabel="y (m)")
plt.show()

# %% [markdown]
# ## The trajectory
#
# A motion has no time. `time_parametrise` gives it the shortest that speeds and accelerations of joints and
# feed allow, from rest to rest (by [TOPP-RA](https://hungpham2511.github.io/toppra/)), with corners rounded
# by less than the pinch tolerance. Mostly the feed is the limit; in the turns the joints are.

# %%
limits = TrajectoryLimits(
    joint_speed=np.radians(30.0), joint_acceleration=np.radians(90.0), feed_speed=0.25, feed_acceleration=0.5
)
trajectory = time_parametrise(motion, limits, rate=50.0, units=room.units)
print(f"{trajectory}; the feed alone would take {motion.feed[-1] / 0.25:.1f} s")
print(f"keeps to walls and limits: {check_trajectory(trajectory, room, arm, limits).valid}")
figure, every = plt.subplots(2, 1, figsize=(9.6, 4.4), sharex=True)
every[0].plot(trajectory.time, trajectory.feed_velocity, color="#1f5fae")
every[0].axhline(limits.feed_speed, color="#d73027", linewidth=1.0, linestyle="--")
every[0].set(ylabel="feed (m/s)", ylim=(0.0, None))
speeds = np.degrees(trajectory.joint_velocities)
every[1].plot(trajectory.time, speeds, linewidth=0.8)
for sign in (-1.0, 1.0):
    every[1].axhline(sign * np.degrees(limits.joint_speed), color="#d73027", linewidth=1.0, linestyle="--")
every[1].set(xlabel="time (s)", ylabel="joints (deg/s)", xlim=(0.0, trajectory.duration))
plt.show()

# %% [markdown]
# ## To the robot
#
# Before a byte is written the trajectory is checked as above, between its samples, too; what goes into a wall
# by more than a pinch is refused. The YAML is a `trajectory_msgs/msg/JointTrajectory` with the feed in
# metres; the URDF describes the arm with the same joint names. Others are CSV, JSON, NPZ, GIF, MP4 and a page
# to play.

# %%
for name, form in (("arm.yaml", "ros2-yaml"), ("arm.urdf", "urdf"), ("arm.csv", "csv")):
    (folder / name).write_bytes(export_bytes(motion, room, arm, form, limits, rate=50.0))
    print(f"{name}: {(folder / name).stat().st_size / 1024:.0f} kB")
lines = (folder / "arm.yaml").read_text().splitlines()
print(*lines[:6], "...", *(f"{line[:90]} ..." for line in lines[-5:-2]), *lines[-2:], sep="\n")

# %%
joints = {joint.get("name"): joint for joint in ElementTree.parse(folder / "arm.urdf").iter("joint")}
for name in ("feed", "joint_0", "joint_17"):
    limit = joints[name].find("limit")
    print(f"{name}: {joints[name].get('type')}, up to {float(limit.get('velocity')):.4g} per s,", end=" ")
    print(f"from {float(limit.get('lower')):.4g} to {float(limit.get('upper')):.4g}")

# %% [markdown]
# On a robot (`--yaml-file` is there since ROS 2 Kilted; as an argument a shell takes 128 kB at most):
#
#     ros2 topic pub --once /arm/joint_trajectory trajectory_msgs/msg/JointTrajectory --yaml-file arm.yaml
#
# ## The same without Python
#
#     hrsnake import plant.yaml --base 0.5,0.1,90 --goal 7.5,0.6 --goal-radius 0.1 --out plant.geojson
#     hrsnake plan plant.geojson --link-length 1.2 --link-radius 0.05 --out m.npz
#     hrsnake export plant.geojson m.npz --link-radius 0.05 --joint-speed 30 --joint-acceleration 90 \
#         --feed-speed 0.25 --feed-acceleration 0.5 --out arm.yaml
#
# A drawing does as well: `read_map("plan.svg")` or `.dxf` takes closed outlines as free space and what is in
# them as walls, or layers by name (`MapOptions(walls=("WALLS",), base=("BASE",))`). `hrsnake studio` is a
# page on which to do all this with the mouse.

# %%
files.cleanup()
