"""Small whole map files of every kind, with all that their readers know: what faults are put into."""

from __future__ import annotations

import functools
import gzip
import io
import json
import struct
from pathlib import Path

import numpy as np
from PIL import Image

from hrsnake_env.maze import Maze

SAMPLES = Path(__file__).parent.parent.parent / "tests" / "maps"

YAML = b"""image: room.pgm
mode: trinary
resolution: 0.05
origin: [-1.2, -0.8, 0.1]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""

SVG = """<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"
 width="200mm" height="10cm" viewBox="0 0 200 100" preserveAspectRatio="xMidYMid meet">
<style>.wall{fill:#333;stroke:none} #free, rect.a {fill:white}</style>
<defs><symbol id="s"><circle cx="3" cy="3" r="2"/></symbol><g id="d"><path d="M1,1 l4,0 0,4z"/></g></defs>
<g id="free" transform="translate(2,3) scale(.9) rotate(1 5 5) skewX(1)">
<path d="M5 5H190V90H5zM40 40h20v20h-20z" fill-rule="evenodd"/></g>
<g class="wall" style="fill:#333"><rect x="80" y="20" width="10" height="40" rx="3" ry="2"/>
<ellipse cx="120" cy="50" rx="8" ry="5" transform="matrix(1 .1 -.1 1 2 2)"/>
<polygon points="150,20 160,20 155,40"/><polyline points="20,70 30,70 30,80 20,80 20,70"/>
<path d="M100 70c5-5 10 5 15 0s4 4 8 0q3 3 6 0t6 0a5 4 30 1 0 4 8L100 80Z"/></g>
<use xlink:href="#d" x="60" y="70"/><use href="#s" x="170" y="60" width="5"/>
<line id="base" x1="15" y1="20" x2="25" y2="20" stroke="#00f"/>
<circle id="goal" cx="180" cy="80" r="2.5e0" fill="red"/><text x="1" y="2">words</text></svg>"""

TAGS = [
    *((0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1015"), (9, "$INSUNITS"), (70, 4)),
    *((0, "ENDSEC"), (0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LAYER"), (70, 2)),
    *((0, "LAYER"), (2, "free"), (70, 0), (62, 3), (6, "CONTINUOUS")),
    *((0, "LAYER"), (2, "off"), (70, 1), (62, -1), (6, "CONTINUOUS"), (0, "ENDTAB"), (0, "ENDSEC")),
    *((0, "SECTION"), (2, "BLOCKS"), (0, "BLOCK"), (8, "0"), (2, "B"), (70, 0), (10, 0.0), (20, 0.0)),
    *((3, "B"), (0, "CIRCLE"), (8, "0"), (10, 0.5), (20, 0.5), (40, 0.5), (0, "ENDBLK"), (8, "0")),
    *((0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")),
    *((0, "LWPOLYLINE"), (100, "AcDbEntity"), (8, "free"), (100, "AcDbPolyline"), (90, 4), (70, 1)),
    *(
        (10, 0.0),
        (20, 0.0),
        (10, 100.0),
        (20, 0.0),
        (42, 0.3),
        (10, 100.0),
        (20, 50.0),
        (10, 0.0),
        (20, 50.0),
    ),
    *((0, "LINE"), (8, "w"), (62, 5), (10, 5.0), (20, 5.0), (11, 9.0), (21, 5.0)),
    *((0, "LINE"), (8, "w"), (10, 9.0), (20, 5.0), (11, 9.0), (21, 9.0)),
    *((0, "LINE"), (8, "w"), (10, 9.0), (20, 9.0), (11, 5.0), (21, 5.0)),
    *((0, "ARC"), (8, "w"), (10, 20.0), (20, 20.0), (40, 3.0), (50, 0.0), (51, 180.0)),
    *((0, "LINE"), (8, "w"), (10, 17.0), (20, 20.0), (11, 23.0), (21, 20.0)),
    *((0, "INSERT"), (100, "AcDbEntity"), (8, "w"), (100, "AcDbBlockReference"), (2, "B")),
    *((10, 30.0), (20, 10.0), (41, 2.0), (50, 30.0), (70, 2), (71, 2), (44, 8.0), (45, 8.0)),
    *((0, "ELLIPSE"), (100, "AcDbEntity"), (8, "w"), (100, "AcDbEllipse"), (10, 60.0), (20, 30.0)),
    *((30, 0.0), (11, 5.0), (21, 1.0), (31, 0.0), (40, 0.5), (41, 0.0), (42, 6.283185307179586)),
    *((0, "SPLINE"), (100, "AcDbEntity"), (8, "w"), (100, "AcDbSpline"), (70, 8), (71, 2), (72, 7), (73, 4)),
    *((40, 0.0), (40, 0.0), (40, 0.0), (40, 1.0), (40, 2.0), (40, 2.0), (40, 2.0)),
    *((10, 70.0), (20, 10.0), (10, 75.0), (20, 15.0), (10, 80.0), (20, 10.0), (10, 70.0), (20, 10.0)),
    *((0, "POLYLINE"), (8, "w"), (66, 1), (70, 1), (0, "VERTEX"), (8, "w"), (10, 85.0), (20, 40.0)),
    *((42, 0.5), (0, "VERTEX"), (8, "w"), (10, 90.0), (20, 40.0), (0, "VERTEX"), (8, "w"), (10, 90.0)),
    *((20, 45.0), (0, "SEQEND"), (8, "w"), (0, "SOLID"), (8, "walls"), (10, 40.0), (20, 40.0)),
    *((11, 44.0), (21, 40.0), (12, 40.0), (22, 44.0), (13, 44.0), (23, 44.0)),
    *((0, "HATCH"), (100, "AcDbEntity"), (8, "walls"), (100, "AcDbHatch"), (10, 0.0), (20, 0.0), (30, 0.0)),
    *((210, 0.0), (220, 0.0), (230, 1.0), (2, "SOLID"), (70, 1), (71, 0), (91, 1), (92, 1), (93, 3)),
    *((72, 1), (10, 50.0), (20, 5.0), (11, 55.0), (21, 5.0), (72, 1), (10, 55.0), (20, 5.0), (11, 55.0)),
    *((21, 9.0), (72, 1), (10, 55.0), (20, 9.0), (11, 50.0), (21, 5.0), (97, 0), (75, 0), (76, 1), (98, 0)),
    *((0, "POINT"), (8, "base"), (10, 5.0), (20, 30.0), (50, 15.0)),
    *((0, "CIRCLE"), (8, "goal"), (10, 90.0), (20, 10.0), (40, 2.0)),
    *((0, "TEXT"), (8, "text"), (10, 0.0), (20, 0.0), (40, 1.0), (1, "words"), (0, "ENDSEC"), (0, "EOF")),
]
"""A drawing with every entity that is read, as group codes and values."""

OUTLINES = {
    "type": "FeatureCollection",
    "name": "flat",
    "units": "m",
    "features": [
        {
            "type": "Feature",
            "id": 7,
            "properties": {"layer": "free", "fill": "#ffffff"},
            "geometry": {
                "type": "MultiPolygon",
                "coordinates": [
                    [[[0, 0], [9, 0], [9, 6], [0, 6], [0, 0]], [[4, 2], [5, 2], [5, 3], [4, 2]]],
                    [[[9, 1], [12, 1], [12, 2], [9, 2], [9, 1]]],
                ],
            },
        },
        {
            "type": "Feature",
            "properties": {"kind": "walls"},
            "geometry": {
                "type": "GeometryCollection",
                "geometries": [
                    {"type": "LineString", "coordinates": [[1, 1], [2, 1], [2, 2]]},
                    {"type": "MultiLineString", "coordinates": [[[2, 2], [1, 1]], [[6, 1], [7, 2.5]]]},
                ],
            },
        },
        {
            "type": "Feature",
            "properties": {"name": "base", "heading_deg": 10.0},
            "geometry": {"type": "Point", "coordinates": [0.5, 3, 0]},
        },
        {
            "type": "Feature",
            "properties": {"name": "goal", "radius": 0.2},
            "geometry": {"type": "MultiPoint", "coordinates": [[8, 5]]},
        },
    ],
}


def room():
    """Return grey levels of a room with a pillar, shape (24, 32)."""
    level = np.zeros((24, 32), dtype=np.uint8)
    level[2:-2, 2:-2] = 254
    level[8:14, 10:16] = 0
    level[2:6, 20:24] = 205
    return level


def encoded(image, form, **how):
    """Return an image as a file."""
    file = io.BytesIO()
    image.save(file, form, **how)
    return file.getvalue()


def text_dxf(tags):
    """Return group codes and values as ASCII DXF."""
    return "".join(f"{code:3d}\n{value}\n" for code, value in tags).encode("utf-8", "surrogateescape")


def binary_dxf(tags):
    """Return group codes and values as binary DXF."""
    parts = [b"AutoCAD Binary DXF\r\n\x1a\x00"]
    for code, value in tags:
        parts.append(struct.pack("<H", code))
        if isinstance(value, float):
            parts.append(struct.pack("<d", value))
        elif isinstance(value, int):
            parts.append(struct.pack("<i" if 90 <= code < 100 else "<h", value))
        else:
            parts.append(str(value).encode() + b"\x00")
    return b"".join(parts)


@functools.cache
def seeds(kind):
    """Return whole files of a kind: their endings and contents. A ROS map comes without its image."""
    sample = {each.suffix: each.read_bytes() for each in SAMPLES.iterdir()}
    if kind == "geojson":
        maze = Maze.load("zig3").to_geojson()
        files = [sample[".geojson"], json.dumps(OUTLINES).encode(), json.dumps(maze, indent=1).encode()]
        return tuple((".geojson", data) for data in files)
    if kind == "ros":
        scale = YAML.replace(b"trinary", b"scale").replace(b"negate: 0", b"negate: 1")
        return tuple((".yaml", data) for data in (YAML, scale, YAML.replace(b"trinary", b"raw")))
    if kind == "svg":
        return (
            (".svg", SVG.encode()),
            (".svg", sample[".svg"]),
            (".svg", gzip.compress(SVG.encode(), mtime=0)),
        )
    if kind == "dxf":
        return ((".dxf", text_dxf(TAGS)), (".dxf", binary_dxf(TAGS)), (".dxf", text_dxf(TAGS)))
    return _images()


def _images():
    grey = Image.fromarray(room())
    opaque = Image.merge("LA", (grey, Image.new("L", grey.size, 200)))
    text = f"P2\n# words\n32 24\n255\n{' '.join(map(str, room().ravel().tolist()))}\n".encode()
    return (
        (".pgm", encoded(grey, "PPM")),
        (".pgm", text),
        (".pgm", b"P5 32 24 65535 " + (room().astype(">u2") * 257).tobytes()),
        (".pgm", encoded(grey.convert("1"), "PPM")),
        (".png", encoded(grey, "PNG")),
        (".png", encoded(opaque.convert("RGBA"), "PNG")),
        (".png", encoded(opaque, "PNG")),
        (".png", encoded(grey.convert("P"), "PNG", transparency=3)),
        (".png", encoded(grey.convert("1"), "PNG")),
        (".png", encoded(grey.convert("I;16"), "PNG")),
        (
            ".jpg",
            encoded(
                grey.convert("RGB"),
                "JPEG",
                exif=b"Exif\0\0MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0",
            ),
        ),
        (".jpeg", encoded(grey, "JPEG", progressive=True)),
        (".bmp", encoded(grey.convert("RGB"), "BMP")),
        (".bmp", encoded(grey, "BMP")),
        (".tif", encoded(grey, "TIFF")),
        (".tiff", encoded(grey, "TIFF", compression="tiff_lzw")),
        (".tif", encoded(grey.convert("I"), "TIFF", compression="tiff_adobe_deflate")),
        (".gif", encoded(grey, "GIF", save_all=True, append_images=[grey.rotate(180)])),
        (".webp", encoded(grey.convert("RGB"), "WEBP", lossless=True)),
    )
