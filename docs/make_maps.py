"""The maps of the tutorial and the guides, as scanners and drawing programs write them.

Run `.venv/bin/python docs/make_maps.py` from the repository's root: it writes `docs/maps/`.
"""

from __future__ import annotations

from pathlib import Path

import ezdxf
import numpy as np
from PIL import Image, ImageDraw
from shapely import contains_xy
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.files import replacing

MAPS = Path(__file__).parent / "maps"
RESOLUTION = 0.02  # m per pixel
ORIGIN = (-1.0, -1.0)  # m: of the lower left corner
SIZE = (620, 420)  # pixels
WAY = [
    (0.0, 0.5),
    (4.2, 0.5),
    (4.2, 3.4),
    (1.0, 3.4),
    (1.0, 6.0),
    (6.4, 6.0),
    (8.2, 4.2),
    (8.2, 0.5),
    (10.4, 0.5),
]
"""The middle of the duct, in m."""


def duct() -> Polygon:
    """Return the free space of the duct, in m: bends, a slanted run, a chamber with a fan, stiffeners."""
    way = LineString(WAY).buffer(0.4, cap_style="flat", join_style="mitre")
    chamber = box(5.2, 1.4, 9.2, 3.4)
    things = [
        Point(7.6, 2.4).buffer(0.25),
        box(5.9, 1.4, 6.1, 2.2),
        box(2.2, 3.0, 2.3, 3.15),
        box(3.0, 3.65, 3.1, 3.8),
    ]
    free = way.union(chamber)
    for thing in things:
        free = free.difference(thing)
    return free


def write_ros_map() -> None:
    """Write a scan as map_server reads it: the duct is free, its walls are occupied, the rest is unknown."""
    free = duct()
    walls = free.buffer(0.06).difference(free)
    columns, rows = SIZE
    x = ORIGIN[0] + RESOLUTION * (np.arange(columns) + 0.5)
    y = ORIGIN[1] + RESOLUTION * (np.arange(rows)[::-1] + 0.5)
    places = np.meshgrid(x, y)
    pixels = np.full((rows, columns), 205, dtype=np.uint8)
    pixels[contains_xy(walls, *places)] = 0
    pixels[contains_xy(free, *places)] = 254
    with replacing(MAPS / "duct.pgm") as part:
        Image.fromarray(pixels).save(part)
    with replacing(MAPS / "duct.yaml") as part:
        part.write_text(
            "image: duct.pgm\n"
            f"resolution: {RESOLUTION}\n"
            f"origin: [{ORIGIN[0]}, {ORIGIN[1]}, 0.0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
            encoding="utf-8",
        )


CASING = """<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"
     width="420mm" height="310mm" viewBox="0 0 420 310">
  <g inkscape:groupmode="layer" inkscape:label="free" fill="#ffffff" stroke="#000000">
    <path d="M 45 300 V 260 A 165 165 0 0 1 375 260 H 330 A 120 120 0 0 0 90 260 V 300 Z"/>
  </g>
  <g inkscape:groupmode="layer" inkscape:label="walls" fill="#808080">
    <ellipse cx="112" cy="158" rx="13" ry="5" transform="rotate(-45 112 158)"/>
    <circle cx="210" cy="108" r="6"/>
    <rect x="305" y="150" width="6" height="22" transform="rotate(45 308 161)"/>
  </g>
  <g inkscape:groupmode="layer" inkscape:label="base"><path d="M 67 295 v -20" stroke="#1f5fae"/></g>
  <g inkscape:groupmode="layer" inkscape:label="goal"><circle cx="352" cy="252" r="6" fill="#2e9e5b"/></g>
  <g inkscape:groupmode="layer" inkscape:label="notes"><text x="180" y="280">casing, sheet 3</text></g>
</svg>
"""
"""A casing with a channel bent in a half circle, and vanes in it, in mm."""


def write_drawing() -> None:
    """Write a drawing of layers, in mm: what is free, vanes, a port to come in by, and the goal."""
    with replacing(MAPS / "casing.svg") as part:
        part.write_text(CASING, encoding="utf-8")


def write_plan() -> None:
    """Write a plan in mm, as CAD exports it: polylines with rounded corners, pillars, single lines."""
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = 4
    for layer, colour in (("CHANNEL", 7), ("PILLARS", 1), ("BASE", 5), ("GOAL", 3), ("DIMENSIONS", 8)):
        document.layers.add(layer, color=colour)
    sheet = document.modelspace()
    quarter = 0.41421356237309503  # the bulge of a quarter of a circle
    outline = [(0, 0, 0), (2300, 0, quarter), (2500, 200, 0), (2500, 1400, 0), (300, 1400, 0), (300, 2400, 0)]
    outline += [(0, 2400, 0), (0, 1100, 0), (2150, 1100, 0), (2150, 300, 0), (0, 300, 0)]
    sheet.add_lwpolyline(outline, format="xyb", close=True, dxfattribs={"layer": "CHANNEL"})
    for place in ((900, 40), (1500, 260)):
        sheet.add_circle(place, 30, dxfattribs={"layer": "PILLARS"})
    sheet.add_line((20, 150), (120, 150), dxfattribs={"layer": "BASE"})
    sheet.add_circle((150, 2250), 40, dxfattribs={"layer": "GOAL"})
    sheet.add_text("channel 300", dxfattribs={"layer": "DIMENSIONS"})
    with replacing(MAPS / "channel.dxf") as part:
        document.saveas(part)


def write_scan() -> None:
    """Write the scan of a plan: four corridors and a pillar, bright on dark."""
    sheet = Image.new("L", (900, 600), 40)
    pen = ImageDraw.Draw(sheet)
    for corridor in ((60, 60, 140, 540), (60, 60, 840, 140), (760, 60, 840, 540), (260, 460, 840, 540)):
        pen.rectangle(corridor, fill=235)
    pen.ellipse((420, 480, 460, 520), fill=40)
    with replacing(MAPS / "scan.png") as part:
        sheet.save(part, optimize=True)


if __name__ == "__main__":
    MAPS.mkdir(exist_ok=True)
    write_ros_map()
    write_drawing()
    write_scan()
    write_plan()
    print("\n".join(f"Written: docs/maps/{path.name}" for path in sorted(MAPS.iterdir())))
