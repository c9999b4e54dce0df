"""SVG drawings: shapes of all kinds with their transforms, by layer, name and colour."""

from __future__ import annotations

import gzip
import io
import math
import re
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import PurePath
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from hrsnake_env.errors import InputError, printable
from hrsnake_env.maps.drawing import Drawing, Outline, Stroke, counted
from hrsnake_env.maps.flatten import MAX_POINTS, Arc, Bezier, Line, Piece
from hrsnake_env.maps.outlines import read_outlines
from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading

__all__ = ["read_svg"]

MAX_BYTES = 32 * 2**20
MAX_DEPTH = 100
"""Groups within groups; the library walks them by recursion."""

MAX_ELEMENTS = 200_000
"""Elements after all uses are written out."""

MAX_NUMBERS = 1_000_000
"""In paths and points: the library takes a minute for more."""

NAMESPACE = "{http://www.w3.org/2000/svg}"
LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
LINKS = ("href", "{http://www.w3.org/1999/xlink}href")
LENGTH = re.compile(r"\s*([0-9.]+(?:[eE][-+]?\d+)?)\s*(mm|cm|in|pt|pc|px|q|)\s*", re.IGNORECASE)
NUMBER = re.compile(r"[0-9]+")
IN_MM = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72, "pc": 25.4 / 6, "q": 0.25}

SAID = ("text", "image", "foreignObject")
"""Left out, and worth a word."""

NOT_DRAWN = {*SAID, "script", "metadata", "title", "desc", "namedview"}
NOT_DRAWN |= {"marker", "mask", "clipPath", "pattern", "linearGradient", "radialGradient", "filter"}
NOT_DRAWN |= {"animate", "animateTransform", "animateMotion", "set", "video", "audio", "iframe"}


def read_svg(name: str, files: MapFiles, options: MapOptions) -> MapReading:
    """Read an SVG drawing.

    Lengths are those of the page if it has a size in mm, cm, in or pt, then in mm; otherwise user units (px).
    The origin is the page's lower left corner, y points up. Names are labels and ids of shapes and groups,
    and classes; colours are those of stroke and fill. What is filled is closed. Texts, images and all that is
    not displayed are left out, and nothing but the file itself is read.

    Raises
    ------
    InputError
        If it is no SVG, is too large or nested too deeply, declares entities, or means no free space.
    """
    try:
        from svgelements import SVG
    except ImportError:
        raise InputError("Expected svgelements for SVG drawings: pip install 'hrsnake[maps]'.") from None
    root = _checked_tree(_plain(files(name), name), name)
    to_page, height, units = _page(root, name)
    _check_numbers(root, name)
    notes = _prepare(root)
    _check_uses(root, name)
    for key in ("width", "height"):
        root.attrib.pop(key, None)  # the page's size is ours: the library's mm are 1 in 2 million off
    try:
        picture = SVG.parse(io.BytesIO(ElementTree.tostring(root)), reify=False)
        with np.errstate(all="ignore"):  # what is not finite is left out later, and said
            outlines = list(_outlines(picture, to_page, height))
    except InputError:
        raise
    except RecursionError:
        raise InputError(f"Expected groups at most {MAX_DEPTH} deep in '{name}', got more.") from None
    except Exception:  # broken shapes make the library raise whatever its parts do
        raise InputError(f"Expected shapes that can be read in '{name}', got broken ones.") from None
    notes.insert(0, f"SVG drawing of {counted(len(outlines), 'shape')}.")
    return read_outlines(
        Drawing(name=PurePath(name).stem, outlines=outlines, units=units, notes=notes), options
    )


# The document, before its shapes are asked for


def _plain(data: bytes, name: str) -> bytes:
    if data[:2] == b"\x1f\x8b":
        try:
            with gzip.open(io.BytesIO(data)) as packed:
                data = packed.read(MAX_BYTES + 1)
        except (OSError, EOFError, zlib.error):
            raise InputError(f"Expected a whole compressed SVG in '{name}', got a broken one.") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"Expected at most {MAX_BYTES >> 20} MiB in '{name}', got more.")
    return data


def _checked_tree(data: bytes, name: str) -> ElementTree.Element:
    """Return the document if it is an SVG without entities, and not nested too deeply."""
    parser = expat.ParserCreate()
    depth = n_elements = 0

    def refuse(*_: Any) -> None:
        raise InputError(f"Expected an SVG without a DOCTYPE that declares entities, got one in '{name}'.")

    def enter(*_: Any) -> None:
        nonlocal depth, n_elements
        depth, n_elements = depth + 1, n_elements + 1
        if depth > MAX_DEPTH or n_elements > MAX_ELEMENTS:
            raise InputError(
                f"Expected at most {MAX_ELEMENTS:,} elements, {MAX_DEPTH} deep, in '{name}', got more."
            )

    def leave(*_: Any) -> None:
        nonlocal depth
        depth -= 1

    parser.EntityDeclHandler = refuse
    parser.StartElementHandler, parser.EndElementHandler = enter, leave
    try:
        parser.Parse(data, True)
        root = ElementTree.fromstring(data)
    except (expat.ExpatError, ElementTree.ParseError, LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"Expected an SVG drawing in '{name}', got broken XML: {printable(str(error), 200)}."
        ) from None
    if _tag(root) != "svg":
        raise InputError(f"Expected an SVG drawing in '{name}', got <{_tag(root)}>.")
    return root


def _check_numbers(root: ElementTree.Element, name: str) -> None:
    n = sum(len(NUMBER.findall(element.get(key, ""))) for element in root.iter() for key in ("d", "points"))
    if n > MAX_NUMBERS:
        raise InputError(f"Expected at most {MAX_NUMBERS:,} numbers in paths in '{name}', got {n:,}.")


def _tag(element: ElementTree.Element) -> str:
    return str(element.tag).rpartition("}")[2]


def _page(root: ElementTree.Element, name: str) -> tuple[np.ndarray, float, str]:
    """Return page units per user unit along x and y, the page's height in page units, and its unit."""
    sizes = [LENGTH.fullmatch(root.get(key, "")) for key in ("width", "height")]
    given = [
        (float(size[1]), size[2].lower() or "px") if size and _number(size[1]) else None for size in sizes
    ]
    box = [float(v) for v in re.split(r"[\s,]+", root.get("viewBox", "").strip()) if _number(v)]
    if len(box) != 4 or min(box[2:]) <= 0.0 or not np.isfinite(box).all():
        box = []
        root.attrib.pop("viewBox", None)
    real = all(size is not None and size[1] in IN_MM for size in given)
    if not real:
        # No size that can be measured: user units are the drawing's own.
        tall = box[3] if box else (given[1][0] if given[1] is not None else 0.0)
        return np.ones(2), tall, "px"
    width, height = (size[0] * IN_MM[size[1]] for size in given if size is not None)
    if min(width, height) <= 0.0:
        raise InputError(f"Expected a page with an area in '{name}', got {width:g} x {height:g} mm.")
    if not box:
        return np.full(2, 25.4 / 96), height, "mm"  # without a viewBox user units are px of CSS
    scales = np.array([width / box[2], height / box[3]])
    if not root.get("preserveAspectRatio", "").strip().startswith("none"):
        scales[:] = scales.min()
    return scales, scales[1] * box[3], "mm"


def _number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _prepare(root: ElementTree.Element) -> list[str]:
    """Take out what is not drawn; keep symbols from being drawn where they are defined."""
    out: Counter[str] = Counter()
    for parent in list(root.iter()):
        for child in list(parent):
            tag = _tag(child)
            if tag in NOT_DRAWN or not isinstance(child.tag, str):
                parent.remove(child)
                out[tag] += 1
            elif _is_hidden(child):
                parent.remove(child)
                out["hidden element"] += 1
            elif tag == "symbol" and _tag(parent) != "defs":
                defs = ElementTree.Element(f"{NAMESPACE}defs")
                defs.append(child)
                parent[list(parent).index(child)] = defs
            elif tag == "style":
                child.text = _rules(child.text or "")
    said = [counted(out[what], what) for what in (*SAID, "hidden element") if out[what]]
    return [f"Left out: {', '.join(said)}."] if said else []


def _rules(text: str) -> str:
    """Return the rules of a style sheet: what is not closed takes the library the square of its length."""
    text = re.sub(r"/\*.*?(\*/|\Z)", "", text, flags=re.DOTALL)
    rules = (rule.partition("{") for rule in text.split("}")[:-1])
    return "".join(
        f"{who.strip()}{{{what.strip()}}}\n"
        for who, _, what in rules
        if who.strip() and what.strip() and "{" not in what
    )


def _is_hidden(element: ElementTree.Element) -> bool:
    style = element.get("style", "").replace(" ", "")
    return (
        element.get("display", "").strip() == "none"
        or element.get("visibility", "").strip() in ("hidden", "collapse")
        or "display:none" in style
        or "visibility:hidden" in style
    )


def _check_uses(root: ElementTree.Element, name: str) -> None:
    """Refuse elements that use themselves, and uses of uses that multiply."""
    by_id = {element.get("id"): element for element in root.iter()}
    weights: dict[int, int] = {}
    under_way: set[int] = set()

    def weight(element: ElementTree.Element) -> int:
        key = id(element)
        if key in weights:
            return weights[key]
        if key in under_way or len(under_way) > MAX_DEPTH:
            raise InputError(f"Expected no element in '{name}' that uses itself, nor uses {MAX_DEPTH} deep.")
        under_way.add(key)
        total = 1 + sum(weight(child) for child in element)
        if _tag(element) == "use":
            link = next((element.get(key) for key in LINKS if element.get(key)), "") or ""
            target = by_id.get(link[1:]) if link.startswith("#") else None
            total += weight(target) if target is not None else 0
        under_way.discard(key)
        weights[key] = min(total, 2 * MAX_ELEMENTS)
        return weights[key]

    if weight(root) > MAX_ELEMENTS:
        raise InputError(f"Expected at most {MAX_ELEMENTS:,} elements in '{name}', got more by its uses.")


# Shapes


def _outlines(picture: Any, to_page: np.ndarray, height: float) -> Iterator[Outline]:
    from svgelements import Shape

    n_points = 0
    stack: list[tuple[Any, str, tuple[str, ...]]] = [(picture, "", ())]
    while stack:
        element, layer, names = stack.pop()
        if isinstance(element, Shape):
            outline = _outline(element, layer, names, to_page, height)
            if outline is not None:
                n_points += len(outline.hull)
                if n_points > MAX_POINTS:
                    raise InputError(f"Expected at most {MAX_POINTS:,} points of outlines, got more.")
                yield outline
        elif isinstance(element, list):
            own = _names(element) if element is not picture else ()
            stack += [(child, own[0] if own else layer, own + names) for child in reversed(element)]


def _names(element: Any) -> tuple[str, ...]:
    """Return label, id and classes that an element has itself."""
    own = element.values.get("attributes", {})
    return tuple(
        text for text in (own.get(LABEL), own.get("id"), *str(own.get("class") or "").split()) if text
    )


def _outline(
    shape: Any, layer: str, names: tuple[str, ...], to_page: np.ndarray, height: float
) -> Outline | None:
    own = _names(shape)
    is_filled = shape.fill is not None and shape.fill.value is not None
    is_line = type(shape).__name__ == "SimpleLine"
    strokes = list(_strokes(shape.segments(transformed=False), is_filled and not is_line))
    if not strokes:
        return None
    m = shape.transform
    turn = np.array([[m.a, m.c], [m.b, m.d]], dtype=np.float64)
    flip = np.diag(to_page * (1.0, -1.0))
    matrix, offset = flip @ turn, flip @ np.array([m.e, m.f], dtype=np.float64) + (0.0, height)
    colours = [
        paint.hexrgb for paint in (shape.stroke, shape.fill) if paint is not None and paint.value is not None
    ]
    with np.errstate(all="ignore"):  # what is not finite is left out later, and said
        return Outline(
            strokes=tuple(
                Stroke(
                    pieces=tuple(piece.transformed(matrix, offset) for piece in stroke.pieces),
                    closed=stroke.closed,
                )
                for stroke in strokes
            ),
            layer=layer or (own[0] if own else ""),
            names=own + names,
            colours=tuple(dict.fromkeys(colours)),
            nonzero=is_filled and shape.values.get("fill-rule", "nonzero") == "nonzero",
        )


def _strokes(segments: Any, closes: bool) -> Iterator[Stroke]:
    pieces: list[Piece] = []
    corners: list[tuple[float, float]] = []

    def flush() -> None:
        if len(corners) > 1:
            pieces.append(Line(points=np.array(corners)))
        corners.clear()

    for segment in segments:
        kind = type(segment).__name__
        if kind == "Move":
            flush()
            if pieces:
                yield Stroke(pieces=tuple(pieces), closed=closes)
            pieces = []
            corners.append(_xy(segment.end))
        elif kind == "Line":
            if not corners:
                corners.append(_xy(segment.start))
            corners.append(_xy(segment.end))
        elif kind == "Close":
            flush()
            if pieces:
                yield Stroke(pieces=tuple(pieces), closed=True)
            pieces = []
            if segment.end is not None:
                corners.append(_xy(segment.end))
        else:
            flush()
            pieces.append(_curve(segment))
    flush()
    if pieces:
        yield Stroke(pieces=tuple(pieces), closed=closes)


def _xy(point: Any) -> tuple[float, float]:
    return float(point.x), float(point.y)


def _curve(segment: Any) -> Piece:
    kind = type(segment).__name__
    if kind == "Arc":
        if segment.rx == 0.0 or segment.ry == 0.0:
            return Line(points=np.array([_xy(segment.start), _xy(segment.end)]))
        centre, axes = np.array(_xy(segment.center)), np.array([_xy(segment.prx), _xy(segment.pry)])
        major, minor = axes - centre
        off = np.array(_xy(segment.start)) - centre
        return Arc(
            centre=centre,
            major=major,
            minor=minor,
            start=math.atan2(off @ minor / (minor @ minor), off @ major / (major @ major)),
            sweep=float(segment.sweep),
        )
    inner = [segment.control] if kind == "QuadraticBezier" else [segment.control1, segment.control2]
    return Bezier(control=np.array([_xy(point) for point in (segment.start, *inner, segment.end)]))
