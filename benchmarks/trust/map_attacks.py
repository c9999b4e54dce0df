"""Attacks on readers of maps: whole files made to hang them, to fill memory, or to look elsewhere."""

from __future__ import annotations

import gzip
import json
import struct
import zlib

import numpy as np
from PIL import Image

from benchmarks.trust.map_seeds import OUTLINES, SVG, TAGS, YAML, encoded, text_dxf

__all__ = ["ATTACKS"]


def _gj(*parts, **top):
    listed = [{"type": "Feature", "properties": own, "geometry": geometry} for own, geometry in parts]
    return json.dumps({"type": "FeatureCollection", "features": listed, **top}).encode()


def _maze(corner=10.0, role="free", heading=0, radius=1.0, base=(1, 1), **top):
    ring = [[0, 0], [corner, 0], [corner, corner], [0, corner], [0, 0]]
    return _gj(
        ({"role": role}, {"type": "Polygon", "coordinates": [ring]}),
        ({"role": "base", "heading_deg": heading}, {"type": "Point", "coordinates": list(base)}),
        ({"role": "goal", "radius": radius}, {"type": "Point", "coordinates": [8, 8]}),
        **top,
    )


def _lines(starts, ends):
    lines = np.stack([starts, ends], axis=1).tolist()
    return _gj(({"layer": "w"}, {"type": "MultiLineString", "coordinates": lines}))


def _squares(corners, side=1.0, **own):
    square = np.array([[0, 0], [side, 0], [side, side], [0, side], [0, 0]])
    return _gj(
        *((own, {"type": "Polygon", "coordinates": [(square + corner).tolist()]}) for corner in corners)
    )


def _star(n, spread):
    rng = np.random.default_rng(0)
    angles = np.linspace(0, 6, n)
    return _lines(spread * rng.random((n, 2)), np.stack([np.cos(angles), np.sin(angles)], axis=1))


def _svg(body, page='viewBox="0 0 200 100"'):
    return f'<svg xmlns="http://www.w3.org/2000/svg" {page}>{body}</svg>'.encode()


def _circles(n, own=""):
    places = 50.0 + 50.0 * np.random.default_rng(0).random((n, 2))
    return _svg("".join(f'<circle {own} cx="{x:.3f}" cy="{y:.3f}" r="20"/>' for x, y in places))


def _uses(n):
    groups = (f'<g id="a{i}"><use href="#a{i - 1}"/><use href="#a{i - 1}"/></g>' for i in range(1, n))
    return _svg(f'<g id="a0"><rect width="9" height="9"/></g>{"".join(groups)}')


def _png(width, height, data=bytes(1000)):
    def chunk(kind, content):
        return (
            struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


def _noise(size, share=0.5):
    rng = np.random.default_rng(0)
    return encoded(Image.fromarray(np.uint8(255 * (rng.random((size, size)) < share))), "PNG")


def _laughs(line, last):
    rows = [line(i) for i in range(1, 12)]
    return b"a0: &a0 {x: 1}\n" + b"".join(rows) + YAML.replace(b"room.pgm", last)


def _blocks(body, insert):
    at = TAGS.index((0, "BLOCK"))
    entities = len(TAGS) - TAGS[::-1].index((2, "ENTITIES"))
    return text_dxf([*TAGS[:at], *body, *TAGS[at:entities], *insert, *TAGS[entities:]])


def _block(name, *inner):
    place = [(10, 0.0), (20, 0.0)]
    return [
        *((0, "BLOCK"), (8, "0"), (2, name), (70, 0), *place, (3, name)),
        *(tag for each in inner for tag in ((0, "INSERT"), (8, "w"), (2, each), *place)),
        *((0, "ENDBLK"), (8, "0")),
    ]


def _spline(n, degree):
    points = 10.0 * np.random.default_rng(0).random((n, 2))
    knots = [0.0] * degree + np.linspace(0, 1, n - degree + 1).tolist() + [1.0] * degree
    body = [(0, "SPLINE"), (8, "w"), (70, 8), (71, degree), (72, len(knots)), (73, n)]
    body += [(40, knot) for knot in knots]
    return _blocks([], body + [tag for x, y in points.tolist() for tag in ((10, x), (20, y), (30, 0.0))])


def _ros(old, new):
    return YAML.replace(old, new)


ATTACKS = {
    "geojson": {
        "brackets": lambda: b"[" * 100_000,
        "collections": lambda: b'{"type":"GeometryCollection","geometries":[' * 20_000,
        "digits": lambda: b'{"type":"FeatureCollection","x":' + b"9" * 6000 + b"}",
        "huge integer as radius": lambda: _maze(radius=10**400),
        "huge integer as coordinate": lambda: _maze(base=(10**400, 1)),
        "not a number": lambda: _maze(corner=float("nan")),
        "largest numbers": lambda: _maze(corner=1e308),
        "squares that are infinite": lambda: _maze(corner=1e160),
        "smallest numbers": lambda: _maze(corner=1e-320),
        "role is a list": lambda: _maze(role=["free"]),
        "control characters": lambda: _maze(name="\x1b[2J[/b]\n\u202e", units="\x07\ud800"),
        "long type": lambda: json.dumps({"type": "x" * 10**6}).encode(),
        "long kind": lambda: _gj(
            ({"role": "free"}, {"type": "\x1b" * 10**5}), *[({"role": r}, None) for r in ("base", "goal")]
        ),
        "a star of lines": lambda: _star(8_000, 0.0),
        "lines that almost meet": lambda: _star(8_000, 1e-6),
        "lines that cross": lambda: _lines(*np.random.default_rng(0).random((2, 1500, 2))),
        "squares that overlap": lambda: _squares(np.random.default_rng(0).random((1500, 2))),
        "free squares that overlap": lambda: _squares(
            np.random.default_rng(0).random((1500, 2)), layer="free"
        ),
        "squares in squares": lambda: _gj(
            *(
                ({}, {"type": "Polygon", "coordinates": [[[-i, -i], [i, -i], [i, i], [-i, i]]]})
                for i in range(1, 1000)
            )
        ),
        "UTF-16": lambda: json.dumps(OUTLINES).encode("utf-16"),
        "byte order mark": lambda: b"\xef\xbb\xbf" + _maze(),
        "latin": lambda: b'{"type":"\xff"}',
        "empty": lambda: b"",
    },
    "ros": {
        "laughs": lambda: _laughs(
            lambda i: b"a%d: &a%d [%s]\n" % (i, i, b",".join([b"*a%d" % (i - 1)] * 9)), b"*a11"
        ),
        "merged laughs": lambda: _laughs(
            lambda i: b"a%d: &a%d {<<: [%s]}\n" % (i, i, b",".join([b"*a%d" % (i - 1)] * 9)), b"room.pgm"
        ),
        "a map within itself": lambda: b"&a {image: *a, resolution: 1}",
        "brackets": lambda: b"[" * 99_000,
        "few brackets": lambda: b"[" * 15_000,
        "braces": lambda: b"a: " + b"{a: " * 4_000,
        "a list as key": lambda: b"? [a, b]\n: 1\n",
        **{
            f"{key} {value.decode()[:20]}": lambda key=key, value=value, old=old: _ros(
                f"{key}: {old}".encode(), f"{key}: ".encode() + value
            )
            for key, old in (("resolution", "0.05"), ("negate", "0"), ("mode", "trinary"))
            for value in (
                b"!!timestamp x",
                b'!!int ""',
                b'!!float ""',
                b"!!bool x",
                b"0x" + b"F" * 9000,
                b"1:" * 9000 + b"1",
                b"{a: [1]}",
            )
        },
        "smallest pixels": lambda: _ros(b"0.05", b"1.0e-320"),
        "pixels finer than numbers": lambda: _ros(b"0.05", b"1.0e-9").replace(b"[-1.2", b"[100000000000"),
        "another folder": lambda: _ros(b"room.pgm", b"../../../../../../etc/passwd"),
        "a device": lambda: _ros(b"room.pgm", b"/dev/zero"),
        "a device in disguise": lambda: _ros(b"room.pgm", b"/proc/kmsg"),
        "itself": lambda: _ros(b"room.pgm", b"map.yaml"),
        "a name with a zero": lambda: _ros(b"room.pgm", b'"a\\0b"'),
        "a long name": lambda: _ros(b"room.pgm", b"a" * 15_000),
        "a surrogate": lambda: _ros(b"room.pgm", b'"\\ud800\\e[2J"'),
        "empty": lambda: b"",
    },
    "image": {
        "sixty million pixels that are not there": lambda: _png(8000, 7900),
        "ten thousand million pixels": lambda: _png(100_000, 100_000),
        "one row": lambda: _png(2**31 - 1, 1),
        "noise": lambda: _noise(1200),
        "little noise": lambda: _noise(250, 0.65),
        "white": lambda: encoded(Image.new("L", (4000, 4000), 255), "PNG"),
        "empty": lambda: b"",
    },
    "svg": {
        "entities": lambda: b'<!DOCTYPE s [<!ENTITY a "x"><!ENTITY b "&a;&a;">]>' + _svg("&b;"),
        "a file as entity": lambda: b'<!DOCTYPE s [<!ENTITY a SYSTEM "/etc/passwd">]>' + _svg("&a;"),
        "a file as DOCTYPE": lambda: b'<!DOCTYPE s SYSTEM "file:///etc/passwd">' + SVG.encode(),
        "groups": lambda: _svg("<g>" * 50_000),
        "uses": lambda: _uses(30),
        "some uses": lambda: _uses(10),
        "packed spaces": lambda: gzip.compress(b" " * (40 << 20), 1, mtime=0),
        "packed path": lambda: gzip.compress(_svg(f'<path d="M0,0{"L1,1L2,2" * 2_000_000}"/>'), 1, mtime=0),
        "style that opens": lambda: _svg(f'<style>{"a{" * 50_000}</style><rect width="9" height="9"/>'),
        "style of comments": lambda: _svg(f'<style>/*{"*/ /*" * 50_000}</style><rect width="9" height="9"/>'),
        "style that closes": lambda: _svg(f'<style>{"}" * 50_000}</style><rect width="9" height="9"/>'),
        "circles that overlap": lambda: _circles(500),
        "free circles that overlap": lambda: _circles(300, 'class="free"'),
        "many digits": lambda: _svg(f'<path d="M0,0 L{"1" * 100_000},1 2,2z"/>'),
        "many transforms": lambda: _svg(
            f'<g transform="{"scale(2)" * 5000}"><rect width="9" height="9"/></g>'
        ),
        "largest page": lambda: _svg(
            '<rect width="9" height="9"/>', 'width="1e308in" height="1e308in" viewBox="0 0 1e-308 1e-308"'
        ),
        "largest arc": lambda: _svg('<path d="M0,0 A1e300,1e-300 0 0 0 1,1 z"/>'),
        "UTF-16": lambda: SVG.encode("utf-16"),
        "empty": lambda: b"",
    },
    "dxf": {
        "an empty block a thousand million times": lambda: _blocks(
            _block("E"), [(0, "INSERT"), (8, "w"), (2, "E"), (10, 0.0), (20, 0.0), (70, 32767), (71, 32767)]
        ),
        "blocks of blocks": lambda: _blocks(
            [tag for i in range(40) for tag in _block(f"B{i}", *[f"B{i - 1}"] * (2 if i else 0))],
            [(0, "INSERT"), (8, "w"), (2, "B39"), (10, 0.0), (20, 0.0)],
        ),
        "a block in itself": lambda: _blocks(
            _block("A", "A", "A"), [(0, "INSERT"), (8, "w"), (2, "A"), (10, 0.0), (20, 0.0)]
        ),
        "blocks in each other": lambda: _blocks(
            [*_block("A", "C", "C"), *_block("C", "A", "A")],
            [(0, "INSERT"), (8, "w"), (2, "A"), (10, 0.0), (20, 0.0)],
        ),
        "a spline of degree 399": lambda: _spline(400, 399),
        "a long spline": lambda: _spline(2000, 20),
        "zeros": lambda: b"0\n" * 50_000,
        "binary zeros": lambda: b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(1000),
        "units that are none": lambda: text_dxf([(70, "nan") if tag == (70, 4) else tag for tag in TAGS]),
        "empty": lambda: b"",
    },
}
"""Builders of files by kind and name."""
