"""Walls as faces with open windows, and which of them are in front of what: the geometry of the pictures."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from hrsnake_env.arm import FloatArray
from planners.spatial.panel import AXES
from planners.spatial.workspace import Workspace

__all__ = ["Face", "Solid", "Stroke", "from_behind", "lifted", "rectangles", "solids"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Face:
    """Hold one flat side of a wall.

    Parameters
    ----------
    axis : int
        The axis it is perpendicular to.
    sign : int
        1 if it is turned to the high end of that axis, else -1.
    at : float
        Its place on that axis.
    polygon : shapely Polygon
        Its outline along the next two axes (x after z), with a hole where there is a window.
    """

    axis: int
    sign: int
    at: float
    polygon: shapely.Polygon


@dataclass(frozen=True, eq=False, kw_only=True)
class Solid:
    """Hold the surface of one panel or box.

    Parameters
    ----------
    faces : sequence of Face
        All of it, without overlaps.
    edges : array, shape (n, 2, 3)
        Where faces meet.
    of_window : bool array, shape (n,)
        Which edges belong to the window.
    """

    faces: tuple[Face, ...]
    edges: FloatArray
    of_window: NDArray[np.bool_]


def solids(workspace: Workspace) -> list[Solid]:
    """Return panels, with their windows open, and then boxes."""
    assert workspace.boxes is not None
    found = []
    for panel in workspace.panels:
        axis = AXES.index(panel.normal)
        window = _flat(panel.window_low, panel.window_high, axis)
        whole = _flat(panel.low, panel.high, axis).difference(window)
        found.append(_prism(panel.low, panel.high, axis, whole, window))
    for low, high in workspace.boxes:
        found.append(_prism(low, high, 2, _flat(low, high, 2), shapely.Polygon()))
    return found


def rectangles(face: Face) -> FloatArray:
    """Cut a face into rectangles, shape (n, 2, 3): two opposite corners of each."""
    corners = shapely.get_coordinates(face.polygon)
    b, c = (np.unique(corners[:, k]) for k in (0, 1))
    found = []
    for (b0, b1), (c0, c1) in itertools.product(itertools.pairwise(b), itertools.pairwise(c)):
        if face.polygon.contains(shapely.Point(0.5 * (b0 + b1), 0.5 * (c0 + c1))):
            found.append([lifted((b0, c0), face.axis, face.at), lifted((b1, c1), face.axis, face.at)])
    return np.array(found).reshape(-1, 2, 3)


def _flat(low: FloatArray, high: FloatArray, axis: int) -> shapely.Polygon:
    b, c = (axis + 1) % 3, (axis + 2) % 3
    return shapely.box(low[b], low[c], high[b], high[c])


def lifted(point: ArrayLike, axis: int, at: float) -> list[float]:
    """Return the place in space of a point of a face: its places on the next two axes, and on its own."""
    b, c = np.asarray(point, dtype=np.float64).tolist()
    place = [at, at, at]
    place[(axis + 1) % 3], place[(axis + 2) % 3] = b, c
    return place


def _prism(
    low: FloatArray, high: FloatArray, axis: int, outline: shapely.Geometry, window: shapely.Polygon
) -> Solid:
    """Return what stands on an outline, from the low to the high end of an axis."""
    ends, faces, edges, of_window = (float(low[axis]), float(high[axis])), [], [], []
    for part in shapely.get_parts(outline):
        part = shapely.orient_polygons(part)  # walls are on the left of all of its rings
        faces += [Face(axis=axis, sign=s, at=at, polygon=part) for s, at in zip((-1, 1), ends, strict=True)]
        for ring in (part.exterior, *part.interiors):
            for p, q in itertools.pairwise(shapely.get_coordinates(ring)):
                faces.append(_side(p, q, axis, ends))
                edges += [[lifted(p, axis, at), lifted(q, axis, at)] for at in ends]
                edges.append([lifted(p, axis, at) for at in ends])
                rim = [bool(window.intersects(shapely.Point(*place))) for place in (0.5 * (p + q), p)]
                of_window += [rim[0], rim[0], rim[1]]
    return Solid(
        faces=tuple(faces),
        edges=np.array(edges).reshape(-1, 2, 3),
        of_window=np.array(of_window, dtype=bool),
    )


def _side(p: FloatArray, q: FloatArray, axis: int, ends: tuple[float, float]) -> Face:
    """Return the face on one edge of an outline, which has the wall on its left."""
    along_b = p[1] == q[1]
    way = q - p
    across = (axis + 2) % 3 if along_b else (axis + 1) % 3
    sign = int(-np.sign(way[0]) if along_b else np.sign(way[1]))
    corners = np.array([lifted(p, axis, ends[0]), lifted(q, axis, ends[1])])
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Face(axis=across, sign=sign, at=float(low[across]), polygon=_flat(low, high, across))


# What is in front of what


@dataclass(frozen=True, eq=False, kw_only=True)
class Stroke:
    """Hold a straight line in space and how it is drawn; `lift` brings it nearer than what it lies on."""

    start: FloatArray
    end: FloatArray
    colour: Any
    width: float
    lift: float = 0.0


def from_behind(faces: list[Face], strokes: list[Stroke], out: FloatArray) -> Iterator[Face | Stroke]:
    """Yield faces and strokes, cut where they pass a face, in the order in which they cover each other.

    The plane of a face parts all the rest, and so on, until a part holds strokes alone (a binary space
    partition); these are sorted by how far away their middle is.

    Parameters
    ----------
    faces : list of Face
        Those that are turned to the eye.
    strokes : list of Stroke
        In workspace units.
    out : array, shape (3,)
        Towards the eye, which is far away.
    """
    if not faces:
        yield from sorted(strokes, key=lambda one: float(0.5 * (one.start + one.end) @ out) + one.lift)
        return
    plane = min(faces[:: max(1, len(faces) // 12)], key=lambda face: _badness(face, faces))
    axis, at = plane.axis, plane.at
    near = int(out[axis] > 0.0)
    kept = [face for face in faces if face.axis == axis and face.at == at]
    sides: tuple[list[Face], list[Face]] = ([], [])
    lines: tuple[list[Stroke], list[Stroke]] = ([], [])
    for face in faces:
        for side, part in _cut_face(face, axis, at):
            sides[side].append(part)
    for stroke in strokes:
        for side, line in _cut_stroke(stroke, axis, at, near):
            lines[side].append(line)
    yield from from_behind(sides[1 - near], lines[1 - near], out)
    yield from kept
    yield from from_behind(sides[near], lines[near], out)


def _extent(face: Face, axis: int) -> tuple[float, float]:
    x_min, y_min, x_max, y_max = face.polygon.bounds
    return (x_min, x_max) if axis == (face.axis + 1) % 3 else (y_min, y_max)


def _badness(plane: Face, faces: list[Face]) -> float:
    """Return how many faces a plane cuts, and how unevenly it parts them."""
    axis, at, cut, balance = plane.axis, plane.at, 0, 0
    for face in faces:
        low, high = (face.at, face.at) if face.axis == axis else _extent(face, axis)
        cut += low < at < high
        balance += int(low >= at) - int(high <= at)
    return 3.0 * cut + 0.5 * abs(balance)


def _cut_face(face: Face, axis: int, at: float) -> Iterator[tuple[int, Face]]:
    """Yield what of a face is below (0) and above (1) a plane; nothing if it lies in it."""
    if face.axis == axis:
        if face.at != at:
            yield int(face.at > at), face
        return
    low, high = _extent(face, axis)
    if not low < at < high:
        yield int(low >= at), face
        return
    bounds = list(face.polygon.bounds)
    k = 0 if axis == (face.axis + 1) % 3 else 1
    for side, end in ((0, k + 2), (1, k)):
        rectangle = [*bounds]
        rectangle[end] = at
        for part in shapely.get_parts(shapely.intersection(face.polygon, shapely.box(*rectangle))):
            if part.area > 0.0:
                yield side, Face(axis=face.axis, sign=face.sign, at=face.at, polygon=part)


def _cut_stroke(stroke: Stroke, axis: int, at: float, near: int) -> Iterator[tuple[int, Stroke]]:
    """Yield what of a stroke is below (0) and above (1) a plane; what lies in it is seen from both."""
    a, b = float(stroke.start[axis]) - at, float(stroke.end[axis]) - at
    if a == b == 0.0:
        yield near, stroke
    elif a * b >= 0.0:
        yield int(a + b > 0.0), stroke
    else:
        place = stroke.start + a / (a - b) * (stroke.end - stroke.start)
        style: dict[str, Any] = {"colour": stroke.colour, "width": stroke.width, "lift": stroke.lift}
        yield int(a > 0.0), Stroke(start=stroke.start, end=place, **style)
        yield int(b > 0.0), Stroke(start=place, end=stroke.end, **style)
