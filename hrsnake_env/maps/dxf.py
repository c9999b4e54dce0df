"""DXF drawings: lines, polylines with bulges, circles, arcs, ellipses, splines and blocks, by layer."""

from __future__ import annotations

import io
import logging
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import PurePath
from typing import Any

import numpy as np

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maps.drawing import Drawing, Outline, Stroke, counted
from hrsnake_env.maps.flatten import MAX_POINTS, Arc, Line, Piece, spline_pieces
from hrsnake_env.maps.outlines import read_outlines
from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading

__all__ = ["read_dxf"]

MAX_BYTES = 256 * 2**20
MAX_DEPTH = 32
"""Blocks within blocks."""

MAX_ENTITIES = 500_000
"""Entities after all blocks are inserted."""

UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 7: "km", 10: "yd", 13: "um", 14: "dm"}
"""Of $INSUNITS."""

Parsed = tuple[tuple[Stroke, ...], float | None]


def read_dxf(name: str, files: MapFiles, options: MapOptions) -> MapReading:
    """Read a DXF drawing, ASCII or binary, a damaged one as far as it can be repaired.

    The model space alone; layers that are off, frozen or not to be plotted, and invisible things, are left
    out. Blocks are inserted, and what they hold on layer 0 is on the layer of the insertion. Hatches count if
    their layer is given a role. Heights are left out: all is seen from above. Other files that a drawing
    refers to are not read.

    Raises
    ------
    InputError
        If it is no DXF, is too large, or means no free space.
    """
    try:
        import ezdxf  # noqa: F401
    except ImportError:
        raise InputError("Expected ezdxf for DXF drawings: pip install 'hrsnake[maps]'.") from None
    data = files(name)
    if len(data) > MAX_BYTES:
        raise InputError(f"Expected at most {MAX_BYTES >> 20} MiB in '{name}', got more.")
    document, notes = _document(data, name)
    units = UNITS.get(document.header.get("$INSUNITS", 0))
    reader = _Reader(document, name)
    outlines = list(reader.outlines())
    notes.insert(0, f"DXF drawing of {counted(len(outlines), 'outline')}.")
    notes += reader.notes()
    return read_outlines(
        Drawing(name=PurePath(name).stem, outlines=outlines, units=units, notes=notes), options
    )


def _document(data: bytes, name: str) -> tuple[Any, list[str]]:
    """Return the document, and a note if it had to be repaired."""
    from ezdxf import recover
    from ezdxf.document import Drawing as Document
    from ezdxf.filemanagement import dxf_stream_info
    from ezdxf.lldxf.const import DXFError
    from ezdxf.lldxf.tagger import binary_tags_loader

    logging.getLogger("ezdxf").setLevel(logging.CRITICAL)  # the notes say what matters
    if not data.strip():
        raise InputError(f"Expected a DXF drawing in '{name}', got an empty file.")
    try:
        if data.startswith(b"AutoCAD Binary DXF"):
            return Document.load(binary_tags_loader(data)), []
        encoding = dxf_stream_info(io.StringIO(data.decode("utf-8", errors="ignore"))).encoding
        text = io.TextIOWrapper(io.BytesIO(data), encoding=encoding, errors="surrogateescape")
        return Document.read(text), []
    except Exception:  # the library raises whatever its parts do; what is damaged is repaired below
        pass
    try:
        document, auditor = recover.read(io.BytesIO(data))
    except (DXFError, OSError):
        raise InputError(f"Expected a DXF drawing in '{name}', got something else.") from None
    except Exception:
        raise InputError(f"Expected a DXF drawing in '{name}', got one damaged beyond repair.") from None
    n = len(auditor.fixes) + len(auditor.errors)
    return document, [
        f"The file is damaged; {counted(n, 'place')} of it repaired, and what could not be read left out."
    ]


class _Reader:
    """Walks a model space and counts what it leaves out."""

    def __init__(self, document: Any, name: str) -> None:
        self.document = document
        self.name = name
        self.left: Counter[str] = Counter()
        self.broken: Counter[str] = Counter()
        self.hidden = 0
        self.wide = 0
        self.n_entities = 0
        self.n_points = 0
        self.layers = {layer.dxf.name.casefold(): layer for layer in document.layers}

    def notes(self) -> list[str]:
        """Say what was left out."""
        notes = []
        if self.left:
            named = ", ".join(f"{n:,} {kind}" for kind, n in sorted(self.left.items()))
            notes.append(f"Left out, for they are no outlines: {named}.")
        if self.broken:
            named = ", ".join(f"{n:,} {kind}" for kind, n in sorted(self.broken.items()))
            notes.append(f"Left out, for they cannot be read: {named}.")
        if self.hidden:
            notes.append(_hidden(self.hidden))
        if self.wide:
            notes.append(f"{counted(self.wide, 'polyline')} with a width: read as thin lines.")
        return notes

    def outlines(self) -> Iterator[Outline]:
        """Yield what the model space shows."""
        if self._weight(self.document.modelspace(), {}, ()) > MAX_ENTITIES:
            raise InputError(f"Expected at most {MAX_ENTITIES:,} entities in '{self.name}', got more.")
        for entity in self.document.modelspace():
            yield from self._outlines(entity, "0", None, ())

    def _outlines(
        self, entity: Any, above: str, colour: str | None, blocks: tuple[str, ...]
    ) -> Iterator[Outline]:
        """Yield an entity's outlines; `above` and `colour` are those of the innermost of its `blocks`."""
        try:
            yield from self._outlines_of(entity, above, colour, blocks)
        except InputError:
            raise
        except Exception:  # damaged entities make the library raise whatever its parts do
            self.broken[entity.dxftype()] += 1

    def _outlines_of(
        self, entity: Any, above: str, colour: str | None, blocks: tuple[str, ...]
    ) -> Iterator[Outline]:
        self.n_entities += 1
        if self.n_entities > MAX_ENTITIES:
            raise InputError(f"Expected at most {MAX_ENTITIES:,} entities in '{self.name}', got more.")
        kind = entity.dxftype()
        if not entity.dxf.is_supported("layer"):  # a thing that the library does not know
            self.left[f"unknown {kind}"] += 1
            return
        own = str(entity.dxf.get("layer", "0"))
        layer = above if own == "0" else own
        if self._is_hidden(entity, layer):
            self.hidden += 1
            return
        own_colour = self._colour(entity, layer, colour)
        if kind == "INSERT":
            yield from self._inserted(entity, layer, own_colour, blocks)
            return
        if kind == "MLINE":
            yield from self._inside(entity, layer, own_colour, blocks)
            return
        try:
            parsed = _parsed(entity)
        except InputError:  # of one spline, not of the drawing
            self.broken[kind] += 1
            return
        if parsed is None:
            self.left[kind] += 1
            return
        strokes, heading = parsed
        strokes = tuple(stroke for stroke in strokes if stroke.pieces)
        if not strokes:
            self.broken[kind] += 1
            return
        self.wide += bool(kind == "LWPOLYLINE" and entity.dxf.get("const_width", 0.0))
        self.n_points += sum(len(stroke.hull) for stroke in strokes)
        if self.n_points > MAX_POINTS:
            raise InputError(f"Expected at most {MAX_POINTS:,} points in '{self.name}', got more.")
        yield Outline(
            strokes=strokes,
            layer=layer,
            names=(layer,),
            colours=(own_colour,) if own_colour else (),
            heading=heading,
            extra=kind in ("HATCH", "MPOLYGON"),
        )

    def _weight(self, entities: Any, known: dict[str, int], under_way: tuple[str, ...]) -> int:
        """Return how many entities there are after all blocks are inserted, those within themselves once."""
        total = 0
        for entity in entities:
            total += 1
            name = str(entity.dxf.get("name", "")).casefold() if entity.dxftype() == "INSERT" else ""
            if not name or name in under_way or len(under_way) > MAX_DEPTH:
                continue
            if name not in known:
                block = self.document.blocks.get(name)
                known[name] = 0 if block is None else self._weight(block, known, (*under_way, name))
            total += _count(entity) * (1 + known[name])  # empty blocks take their time, too
        return total

    def _inserted(
        self, insert: Any, layer: str, colour: str | None, blocks: tuple[str, ...]
    ) -> Iterator[Outline]:
        block, name = insert.block(), str(insert.dxf.get("name", "")).casefold()
        if block is None or name in blocks or len(blocks) >= MAX_DEPTH:
            self.left["INSERT"] += 1
            return
        if block.block.dxf.get("flags", 0) & 4:
            self.left["XREF"] += 1
            return
        for one in insert.multi_insert() if _count(insert) > 1 else (insert,):
            yield from self._inside(one, layer, colour, (*blocks, name))

    def _inside(
        self, entity: Any, layer: str, colour: str | None, blocks: tuple[str, ...]
    ) -> Iterator[Outline]:
        """Yield what an entity is made of."""
        for part in list(entity.virtual_entities()):
            yield from self._outlines(part, layer, colour, blocks)

    def _is_hidden(self, entity: Any, layer: str) -> bool:
        entry = self.layers.get(layer.casefold())
        off = entry is not None and (
            entry.is_frozen()
            # What is in a block is on layers of its own, or on this one, and looked at there.
            or (entity.dxftype() != "INSERT" and (entry.is_off() or not entry.dxf.get("plot", 1)))
        )
        return bool(off or entity.dxf.get("invisible", 0))

    def _colour(self, entity: Any, layer: str, above: str | None) -> str | None:
        """Return an entity's colour as #rrggbb: its own, its block's, or its layer's."""
        from ezdxf import colors

        entry = self.layers.get(layer.casefold())
        rgb = entity.rgb
        if rgb is None:
            index = int(entity.dxf.get("color", 256))
            if index == 0:
                return above
            if index == 256:
                rgb = None if entry is None else entry.rgb
                index = 7 if entry is None else entry.color
            if rgb is None:
                rgb = colors.aci2rgb(index) if 0 < index < 256 else (255, 255, 255)
        red, green, blue = rgb
        return f"#{red:02x}{green:02x}{blue:02x}"


def _count(insert: Any) -> int:
    """Return how often a block is inserted; damaged drawings have fractions and words there."""
    try:
        return max(1, int(insert.mcount))
    except (TypeError, ValueError, OverflowError):
        return 1


def _hidden(n: int) -> str:
    things = "1 entity" if n == 1 else f"{n:,} entities"
    return f"{things} on layers that are off, frozen or not plotted left out."


# Entities


def _parsed(entity: Any) -> Parsed | None:
    """Return an entity's strokes and heading, None if it is no outline."""
    kind, dxf = entity.dxftype(), entity.dxf
    if kind == "LINE":
        return (Stroke(pieces=(_line([dxf.start, dxf.end]),)),), None
    if kind == "POINT":
        angle = math.radians(-dxf.angle) if dxf.hasattr("angle") and dxf.angle else None
        return (Stroke(pieces=(_line([dxf.location]),)),), angle
    if kind in ("CIRCLE", "ARC"):
        return (_round(entity, kind),), None
    if kind == "ELLIPSE":
        return (_ellipse(entity.construction_tool()),), None
    if kind == "SPLINE":
        return (_spline(entity.construction_tool(), bool(entity.closed)),), None
    if kind == "LWPOLYLINE":
        bulged = list(entity.get_points("xyb"))
        return (_polyline(bulged, bool(entity.closed), entity.ocs(), float(dxf.elevation)),), None
    if kind == "POLYLINE":
        return _old_polyline(entity)
    if kind in ("SOLID", "TRACE", "3DFACE"):
        return (Stroke(pieces=(_line(entity.wcs_vertices()),), closed=True),), None
    if kind in ("HATCH", "MPOLYGON"):
        return _hatch(entity), None
    return None


def _line(points: Iterable[Any]) -> Line:
    return Line(points=np.array([(point[0], point[1]) for point in points], dtype=np.float64))


def _world(ocs: Any, elevation: float) -> tuple[FloatArray, FloatArray]:
    """Return matrix and offset from an entity's own plane to the drawing's x and y."""
    origin, ux, uy = (
        ocs.to_wcs(point) for point in ((0, 0, elevation), (1, 0, elevation), (0, 1, elevation))
    )
    base = np.array([origin[0], origin[1]], dtype=np.float64)
    return np.array([[ux[0], uy[0]], [ux[1], uy[1]]], dtype=np.float64) - base[:, None], base


def _round(entity: Any, kind: str) -> Stroke:
    centre, radius = entity.dxf.center, abs(float(entity.dxf.radius))
    start, sweep = 0.0, 2 * math.pi
    if kind == "ARC":
        start = math.radians(entity.dxf.start_angle)
        sweep = (math.radians(entity.dxf.end_angle) - start) % (2 * math.pi) or 2 * math.pi
    arc = Arc(
        centre=np.array([centre[0], centre[1]], dtype=np.float64),
        major=np.array([radius, 0.0]),
        minor=np.array([0.0, radius]),
        start=start,
        sweep=sweep,
    )
    if radius == 0.0:
        return Stroke(pieces=(Line(points=arc.centre[None]).transformed(*_world(entity.ocs(), centre[2])),))
    return Stroke(pieces=(arc.transformed(*_world(entity.ocs(), float(centre[2]))),), closed=kind == "CIRCLE")


def _ellipse(tool: Any) -> Stroke:
    start = float(tool.start_param)
    sweep = (float(tool.end_param) - start) % (2 * math.pi)
    whole = sweep < 1e-9 or 2 * math.pi - sweep < 1e-9
    arc = Arc(
        centre=np.array(tool.center.xyz[:2]),
        major=np.array(tool.major_axis.xyz[:2]),
        minor=np.array(tool.minor_axis.xyz[:2]),
        start=start,
        sweep=2 * math.pi if whole else sweep,
    )
    return Stroke(pieces=(arc,), closed=whole)


def _spline(tool: Any, closed: bool) -> Stroke:
    pieces = spline_pieces(
        tool.knots(),
        [(point[0], point[1]) for point in tool.control_points],
        int(tool.degree),
        tool.weights() or None,
    )
    return Stroke(pieces=tuple(pieces), closed=closed)


def _polyline(bulged: list[tuple[float, float, float]], closed: bool, ocs: Any, elevation: float) -> Stroke:
    """Return a polyline of points and bulges: tan of a quarter of the angle of the arc to the next point."""
    from ezdxf.math import bulge_to_arc

    pieces: list[Piece] = []
    straight = [bulged[0][:2]] if bulged else []
    following = [*bulged[1:], bulged[0]] if closed else bulged[1:]
    for (x, y, bulge), (x_next, y_next, _) in zip(bulged, following, strict=False):
        if abs(bulge) < 1e-12 or (x, y) == (x_next, y_next):
            straight.append((x_next, y_next))
            continue
        if len(straight) > 1:
            pieces.append(_line(straight))
        straight = [(x_next, y_next)]
        centre, _, _, radius = bulge_to_arc((x, y), (x_next, y_next), bulge)
        off = np.array([x - centre[0], y - centre[1]])
        pieces.append(
            Arc(
                centre=np.array([centre[0], centre[1]]),
                major=np.array([radius, 0.0]),
                minor=np.array([0.0, radius]),
                start=math.atan2(off[1], off[0]),
                sweep=4.0 * math.atan(bulge),
            )
        )
    if len(straight) > 1 or not pieces:
        pieces += [_line(straight)] if straight else []
    matrix, offset = _world(ocs, elevation)
    return Stroke(pieces=tuple(piece.transformed(matrix, offset) for piece in pieces), closed=closed)


def _old_polyline(entity: Any) -> Parsed | None:
    if entity.is_polygon_mesh or entity.is_poly_face_mesh:
        return None
    if entity.is_3d_polyline:
        return (Stroke(pieces=(_line(entity.points()),), closed=bool(entity.is_closed)),), None
    # Vertices of a frame for splines are not on the line.
    bulged = [
        (*vertex.dxf.location.xyz[:2], float(vertex.dxf.get("bulge", 0.0)))
        for vertex in entity.vertices
        if not vertex.dxf.flags & 16
    ]
    elevation = float(entity.dxf.elevation[2]) if entity.dxf.hasattr("elevation") else 0.0
    return (_polyline(bulged, bool(entity.is_closed), entity.ocs(), elevation),), None


def _hatch(entity: Any) -> tuple[Stroke, ...]:
    ocs, elevation = entity.ocs(), float(entity.dxf.elevation[2]) if entity.dxf.hasattr("elevation") else 0.0
    world = _world(ocs, elevation)
    strokes = []
    for path in entity.paths:
        if hasattr(path, "vertices"):
            bulged = [(x, y, bulge) for x, y, bulge in path.vertices]
            strokes.append(_polyline(bulged, True, ocs, elevation))
            continue
        pieces: list[Piece] = []
        for edge in path.edges:
            pieces += [piece.transformed(*world) for piece in _edge(edge)]
        strokes.append(Stroke(pieces=tuple(pieces), closed=True))
    return tuple(strokes)


def _edge(edge: Any) -> list[Piece]:
    kind = type(edge).__name__
    if kind == "LineEdge":
        return [_line([edge.start, edge.end])]
    tool = edge.construction_tool()
    if kind == "SplineEdge":
        return list(_spline(tool, False).pieces)
    start, end = (
        (edge.start_param, edge.end_param) if kind == "EllipseEdge" else (edge.start_angle, edge.end_angle)
    )
    if kind == "ArcEdge":
        start, end = math.radians(start), math.radians(end)
        major, minor = np.array([edge.radius, 0.0]), np.array([0.0, edge.radius])
    else:
        major, minor = (np.array(axis.xyz[:2]) for axis in (tool.major_axis, tool.minor_axis))
    sweep = (end - start) % (2 * math.pi) or 2 * math.pi
    arc = Arc(
        centre=np.array([edge.center[0], edge.center[1]]), major=major, minor=minor, start=start, sweep=sweep
    )
    if not edge.ccw:
        arc = Arc(centre=arc.centre, major=major, minor=minor, start=start + sweep, sweep=-sweep)
    return [arc]
