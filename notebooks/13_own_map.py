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
# How does a map of one's own become a trajectory that a real controller runs? In four calls: `read_map` makes a
# maze of a ROS map, an image, or a drawing (SVG, DXF, GeoJSON), and never makes free what is not; `plan` finds
# the motion; `time_parametrise` gives it time within the limits of the joints; `save_export` checks it once
# more and writes it for ROS 2. The map here is drawn by the notebook itself, as a scan would have been.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image, ImageDraw

from hrsnake_env import ArmSpec
from hrsnake_env.maps import MapOptions, read_map
from planners import plan
from planners.export import TrajectoryLimits, export_bytes, time_parametrise
from planners.figures import STYLE, draw_ends, draw_stages, draw_walls

plt.rcParams.update(STYLE)
folder = Path(tempfile.mkdtemp())

# %% [markdown]
# ## The scan
#
# A plant room of 8 m by 6 m, at 2 cm to a pixel: walls and machines are black, what is free is white, and what
# nobody has seen is grey. Beside the picture a ROS map has a small file that says what its pixels mean.

# %%
FREE, WALL, UNKNOWN, RESOLUTION = 254, 0, 205, 0.02
MACHINES = [(1.0, 0.0, 1.2, 4.9), (2.3, 1.2, 2.5, 6.0), (2.5, 1.2, 4.6, 1.4), (3.6, 2.5, 5.8, 2.7)]
MACHINES += [(5.6, 0.0, 5.8, 2.6), (3.6, 3.8, 7.0, 4.0), (6.9, 1.1, 7.1, 4.0)]
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
image
