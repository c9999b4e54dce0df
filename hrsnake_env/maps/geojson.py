"""GeoJSON: maze files of our own, exactly, and outlines of any other origin."""

from __future__ import annotations

import json
import math
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import PurePath
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Point

from hrsnake_env.errors import InputError, printable
from hrsnake_env.maps.drawing import Drawing, Outline, Stroke, counted, factor
from hrsnake_env.maps.flatten import Line
from hrsnake_env.maps.outlines import read_outlines
from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading
from hrsnake_env.maze import Maze

__all__ = ["read_geojson"]

MAX_BYTES = 256 * 2**20
LONGEST_TITLE = 80
NAMING = ("role", "layer", "Layer", "name", "kind", "type", "class")
"""Properties that name a feature, the most specific first; the first of them there is its layer."""

COLOURING = ("stroke", "fill", "color", "colour", "marker-color")
DEPTH = {"LineString": 0, "MultiLineString": 1, "Polygon": 1, "MultiPolygon": 2, "MultiPoint": 0}


def read_geojson(name: str, files: MapFiles, options: MapOptions) -> MapReading:
    """Read GeoJSON. A maze file is read exactly, corner by corner; anything else as outlines.

    Coordinates are plain x and y: degrees are not projected. A feature's layer is its property role, layer,
    name or kind; a point's `heading_deg` and `radius` are those of a base and a goal.

    Raises
    ------
    InputError
        If it is no GeoJSON, or means no free space.
    """
    data = _data(files(name), name)
    stem = PurePath(name).stem
    named = any((options.free, options.walls, options.base, options.goal, options.ignore))
    if _is_maze(data) and not named:
        return _maze(Maze.from_geojson(data, default_name=stem), options)
    notes: list[str] = []
    outlines = list(_outlines(data, name, notes))
    notes.insert(0, f"GeoJSON with {counted(len(outlines), 'outline')}.")
    if outlines and _like_degrees(outlines):
        notes.append(
            "Coordinates look like degrees of longitude and latitude: they are read as plain x and y, so "
            "project them to metres first."
        )
    title, units = (data.get(key) for key in ("name", "units"))
    return read_outlines(
        Drawing(
            name=printable(title, LONGEST_TITLE) if isinstance(title, str) and title else stem,
            outlines=outlines,
            units=printable(units, LONGEST_TITLE) if isinstance(units, str) and units else None,
            notes=notes,
        ),
        options,
    )


def _data(raw: bytes, name: str) -> dict[str, Any]:
    if len(raw) > MAX_BYTES:
        raise InputError(f"Expected at most {MAX_BYTES >> 20} MiB in '{name}', got more.")
    try:
        data = json.loads(raw)
    except RecursionError:
        raise InputError(f"Expected GeoJSON in '{name}', got lists nested too deeply.") from None
    except ValueError as error:
        raise InputError(f"Expected JSON in '{name}', got: {error}.") from None
    if not isinstance(data, dict) or not isinstance(data.get("type"), str):
        raise InputError(f"Expected GeoJSON in '{name}', got JSON without a type.")
    return data


def _is_maze(data: dict[str, Any]) -> bool:
    features = data.get("features")
    found = set()
    for feature in features if isinstance(features, list) else []:
        properties = feature.get("properties") if isinstance(feature, dict) else None
        role = properties.get("role") if isinstance(properties, dict) else None
        found |= {role} if isinstance(role, str) else set()
    return {"free", "base", "goal"} <= found


def _maze(maze: Maze, options: MapOptions) -> MapReading:
    by, in_words = factor(
        Drawing(name=maze.name, outlines=(), units=maze.units), options.units, options.scale
    )
    x, y, heading = (float(value) for value in maze.base_pose)
    free = maze.free_space if by == 1.0 else shapely.transform(maze.free_space, lambda xy: by * xy)
    return MapReading(
        name=maze.name,
        free_space=free,
        units=options.units or maze.units,
        notes=("A maze file, read corner by corner.", in_words),
        layers={"free": "free", "base": "base", "goal": "goal"},
        base_pose=(by * x, by * y, heading),
        goal=(by * float(maze.goal[0]), by * float(maze.goal[1])),
        goal_radius=by * maze.goal_radius,
    )


def _outlines(data: dict[str, Any], name: str, notes: list[str]) -> Iterator[Outline]:
    """Yield the outlines of all geometries; a collection's are one outline each."""
    left: Counter[str] = Counter()
    stack: list[tuple[Any, dict[str, Any], Any]] = [(data, {}, None)]
    while stack:
        item, properties, own = stack.pop()
        kind = item.get("type") if isinstance(item, dict) else None
        if kind == "FeatureCollection":
            stack += [(feature, {}, None) for feature in reversed(_list(item, "features", name))]
        elif kind == "Feature":
            said = item.get("properties")
            stack.append((item.get("geometry"), said if isinstance(said, dict) else {}, item.get("id")))
        elif kind == "GeometryCollection":
            stack += [(part, properties, own) for part in reversed(_list(item, "geometries", name))]
        elif item is not None and kind in ("Point", *DEPTH):
            for strokes in _geometry(kind, item.get("coordinates"), name):
                yield _outline(strokes, properties, own)
        else:
            left[kind if isinstance(kind, str) else "feature without geometry"] += 1
    if left:
        notes.append(f"Left out: {', '.join(f'{n:,} {kind}' for kind, n in sorted(left.items()))}.")


def _list(item: dict[str, Any], key: str, name: str) -> list[Any]:
    value = item.get(key)
    if not isinstance(value, list):
        raise InputError(f"Expected a list of {key} in '{name}', got {type(value).__name__}.")
    return value


def _geometry(kind: str, coordinates: Any, name: str) -> Iterator[tuple[Stroke, ...]]:
    """Yield the strokes of each part: a polygon is one outline of several rings, a line one of its own."""
    if kind == "Point":
        yield (_stroke([coordinates], False, name),)
    elif kind == "MultiPoint":
        for point in _items(coordinates, name):
            yield (_stroke([point], False, name),)
    elif DEPTH[kind] == 0:
        yield (_stroke(coordinates, False, name),)
    elif kind == "MultiLineString":
        for line in _items(coordinates, name):
            yield (_stroke(line, False, name),)
    else:
        for polygon in [coordinates] if kind == "Polygon" else _items(coordinates, name):
            rings = _items(polygon, name)
            if rings:
                yield tuple(_stroke(ring, True, name) for ring in rings)


def _items(value: Any, name: str) -> list[Any]:
    if not isinstance(value, list):
        raise InputError(f"Expected lists of coordinates in '{name}', got {type(value).__name__}.")
    return value


def _stroke(points: Any, closed: bool, name: str) -> Stroke:
    try:
        array = np.array([(float(point[0]), float(point[1])) for point in points], dtype=np.float64)
    except (TypeError, ValueError, IndexError, KeyError, OverflowError):
        array = np.empty(0)
    if array.ndim != 2 or not len(array):
        raise InputError(f"Expected pairs of numbers as coordinates in '{name}', got others.")
    if not np.isfinite(array).all():
        raise InputError(f"Expected finite coordinates in '{name}', got others.")
    return Stroke(pieces=(Line(points=array),), closed=closed)


def _outline(strokes: tuple[Stroke, ...], properties: dict[str, Any], own: Any) -> Outline:
    names = [str(properties[key]) for key in NAMING if isinstance(properties.get(key), str)]
    colours = [properties[key].casefold() for key in COLOURING if isinstance(properties.get(key), str)]
    heading, radius = (_number(properties.get(key)) for key in ("heading_deg", "radius"))
    return Outline(
        strokes=strokes,
        layer=names[0] if names else "",
        names=(*names, *((str(own),) if isinstance(own, str | int) else ())),
        colours=tuple(dict.fromkeys(colours)),
        heading=None if heading is None else math.radians(heading),
        radius=radius if radius is not None and radius > 0.0 else None,
    )


def _number(value: Any) -> float | None:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return float(value) if good and abs(value) <= sys.float_info.max else None


def _like_degrees(outlines: list[Outline]) -> bool:
    """Tell whether numbers are within a degree of each other, far from the origin, and on the globe."""
    points = np.concatenate([outline.hull for outline in outlines])
    with np.errstate(over="ignore"):  # of coordinates that are left out later
        extent = float(np.ptp(points, axis=0).max())
    near = np.abs(points).max(axis=0)
    if extent >= 1.0:
        return False
    middle = Point(points.mean(axis=0)).distance(Point(0.0, 0.0))
    return bool(near[0] <= 180.0 and near[1] <= 90.0 and middle > 10.0 * extent)
