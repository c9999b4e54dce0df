"""Inputs for readers of maps: drawn by number."""

from __future__ import annotations

import copy
import gzip
import json
import re
import struct
import zlib
from dataclasses import dataclass, field

import numpy as np
from PIL import Image

from benchmarks.trust.map_mutations import mutated
from benchmarks.trust.map_seeds import TAGS, binary_dxf, encoded, seeds, text_dxf

__all__ = ["KINDS", "Input", "drawn"]

KINDS = ("geojson", "ros", "image", "svg", "dxf")

OPTIONS = (
    *({}, {}, {}, {"tolerance": 0.0}, {"tolerance": 1.0}, {"wall_thickness": 0.5}, {"scale": 1000.0}),
    *({"units": "mm"}, {"invert": True}, {"unknown_is_free": True}, {"threshold": 0.2}, {"resolution": 0.01}),
    *({"free": ("free",)}, {"walls": ("#333333", "w")}, {"ignore": ("w",)}, {"scale": 1e-6}),
)
"""Of readings; the most of them have none."""


@dataclass(frozen=True, kw_only=True)
class Input:
    """Hold the files of one input.

    Parameters
    ----------
    main : str
        The name of the map among the files.
    files : dict from str to bytes
    options : dict
        Arguments of `MapOptions`.
    how : str
        `map` (read_map, on disk), `upload` (read_map, in memory), `maze` (Maze.load) or `cli`.
    """

    main: str
    files: dict[str, bytes]
    options: dict[str, object] = field(default_factory=dict)
    how: str = "map"


def drawn(kind, seed, number):
    """Return an input of a kind: the same for the same numbers."""
    rng = np.random.default_rng((zlib.crc32(kind.encode()), seed, number))
    ending, data = seeds(kind)[int(rng.integers(0, len(seeds(kind))))]
    others = [other for _, other in seeds(kind)]
    files = {f"map{ending}": _broken(kind, data, others, rng)}
    if kind == "ros":
        image = seeds("image")[0][1]
        if rng.random() < 0.4:
            files = {f"map{ending}": data}
            image = mutated(image, rng, [other for _, other in seeds("image")[:6]])
        files["room.pgm"] = image
    how = str(rng.choice(["map", "map", "map", "map", "upload", "maze", "cli"]))
    if how == "maze" and kind != "geojson":
        how = "map"
    return Input(
        main=f"map{ending}",
        files=files,
        options=OPTIONS[int(rng.integers(0, len(OPTIONS)))],
        how=how,
    )


def _broken(kind, data, others, rng):
    """Return a file with faults: in what it says, in its bytes, or in what was packed."""
    if kind == "geojson" and rng.random() < 0.5:
        return json.dumps(_other_value(json.loads(data), rng)).encode("utf-8", "surrogatepass")
    if kind == "dxf" and rng.random() < 0.6:
        tags = _other_tags(list(TAGS), rng)
        try:
            return (binary_dxf if data.startswith(b"AutoCAD Binary") else text_dxf)(tags)
        except (struct.error, UnicodeEncodeError):  # a number that its place does not hold
            return text_dxf(tags)
    if kind == "image" and rng.random() < 0.4:
        return _other_image(rng)
    gentle = rng.random() < 0.6
    if kind == "svg" and gentle:
        plain = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
        return mutated(_other_elements(plain, rng), rng, others, gentle=True)
    if data[:2] == b"\x1f\x8b" and rng.random() < 0.8:
        return gzip.compress(mutated(gzip.decompress(data), rng, others), 1, mtime=0)
    return mutated(data, rng, others, gentle)


ELEMENT = re.compile(rb"<[a-z]+ [^<>]*/>")


def _other_elements(data, rng):
    """Repeat, leave out or move one to three elements of a drawing that hold no others."""
    for _ in range(int(rng.integers(1, 4))):
        found = list(ELEMENT.finditer(data))
        if not found:
            return data
        one, other = (found[int(rng.integers(0, len(found)))] for _ in range(2))
        copies = one.group() * int(rng.choice([0, 1, 2, 20]))
        data = data[: other.start()] + copies + data[other.end() :]
    return data


def _other_image(rng):
    """Return a whole image of random shapes, size, kind of pixels and format."""
    wide, high = (int(rng.choice([1, 2, 7, 31, 64, 130])) for _ in range(2))
    level = np.full((high, wide), int(rng.choice([0, 205, 254])), dtype=np.uint8)
    for _ in range(int(rng.integers(0, 12))):
        (x, y), side = rng.integers(0, (wide, high)), int(rng.integers(1, 40))
        level[y : y + side, x : x + int(rng.integers(1, 40))] = int(rng.choice([0, 100, 205, 255]))
    noise = rng.random(level.shape) < float(rng.choice([0.0, 0.0, 0.02, 0.5]))
    level[noise] = rng.integers(0, 256, int(noise.sum()))
    mode, form = str(rng.choice(MODES)), str(rng.choice(FORMATS))
    image = Image.fromarray(level)
    try:
        return encoded(image if mode == "L" else image.convert(mode), form)
    except (OSError, ValueError):  # not every format has every kind of pixels
        return encoded(image, form)


MODES = ("L", "L", "1", "P", "RGB", "RGBA", "LA", "I", "I;16", "F", "CMYK", "YCbCr", "PA")
FORMATS = ("PPM", "PNG", "BMP", "TIFF", "GIF", "JPEG", "WEBP")


def _other_tags(tags, rng):
    """Change values of a drawing, leave tags out, move and repeat them."""
    odd = (0, -1, 1, 32767, -32768, 2**31, 1e308, -1e308, 1e-320, float("nan"), float("inf"), 1e99, "", "x")
    for _ in range(int(rng.integers(1, 5))):
        place = int(rng.integers(0, len(tags)))
        code, value = tags[place]
        change = int(rng.integers(0, 6))
        if change == 0:
            del tags[place]
        elif change == 1:
            tags.insert(int(rng.integers(0, len(tags))), (code, value))
        elif change == 2:
            tags[place] = (int(rng.choice([0, 2, 8, 10, 40, 62, 70, 71, 90, 100, 210, 1071])), value)
        elif change == 3:
            tags[place : place + 1] = tags[place : place + int(rng.integers(1, 9))] * int(rng.integers(2, 40))
        elif isinstance(value, str):
            names = [other for _, other in tags if isinstance(other, str)]
            tags[place] = (code, names[int(rng.integers(0, len(names)))])
        else:
            new = odd[int(rng.integers(0, len(odd)))]
            tags[place] = (code, float(new) if isinstance(value, float) and new not in ("", "x") else new)
    return tags


ODD = (
    *(None, True, 0, -0.0, -1, 1e308, -1e308, 1e-320, 1e100, 10**400, float("nan"), float("inf"), 2**63),
    *(
        "",
        "free",
        "base",
        "Point",
        "\x1b[2J",
        "\ud800",
        "a" * 2000,
        "[/b]",
        "1",
        [],
        {},
        [[]],
        [0, 0],
        [None],
    ),
    *([[0, 0], [1, 1]], {"type": "Point"}, [["x", 1]], [1e99, -1e99]),
)
"""Values that a place of a GeoJSON hardly ever has."""


def _other_value(value, rng):
    """Change one to three places of plain data."""
    for _ in range(int(rng.integers(1, 4))):
        holder, key, inner = None, None, value
        while isinstance(inner, dict | list) and inner and (holder is None or rng.random() < 0.9):
            holder = inner
            keys = list(inner) if isinstance(inner, dict) else range(len(inner))
            key = keys[int(rng.integers(0, len(keys)))]
            inner = holder[key]
        if holder is None:
            return value
        change = int(rng.integers(0, 6))
        if change == 0:
            del holder[key]
        elif change == 1 and isinstance(holder, list):
            holder[key:key] = [copy.deepcopy(inner) for _ in range(int(rng.integers(1, 30)))]
        elif change == 2 and isinstance(inner, int | float) and abs(inner) < 1e300:
            holder[key] = inner * float(rng.choice([-1.0, 1e-9, 1e9, 1.0 + 1e-15, 1e60]))
        else:
            holder[key] = copy.deepcopy(ODD[int(rng.integers(0, len(ODD)))])
    return value
