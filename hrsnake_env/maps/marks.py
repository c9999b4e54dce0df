"""Base and goal out of what is drawn for them: places, circles, arrows, shapes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Point, Polygon

from hrsnake_env.arm import FloatArray
from hrsnake_env.maps.drawing import Outline, Stroke
from hrsnake_env.maps.flatten import flattened
from hrsnake_env.maps.nesting import filled

__all__ = ["base_of", "goal_of", "widest_heading"]

N_HEADINGS = 72
"""Directions in which a base without a heading looks around."""


def base_of(outlines: Sequence[Outline], gap: float) -> tuple[FloatArray | None, float | None, str | None]:
    """Return position, heading and a sentence if something is unclear.

    An arrow or line goes from the base to where it looks. A place, circle or other closed shape is the base's
    position, its heading is that of a line from it, if there is one.
    """
    shapes, lines = _sorted(outlines, gap)
    if len(shapes) > 1 or not (shapes or lines):
        return None, None, f"Expected one base, got {len(shapes)} shapes: give it by hand."
    shaft = max(lines, key=lambda line: float(np.linalg.norm(line[-1] - line[0])), default=None)
    if not shapes:
        assert shaft is not None
        along = shaft[-1] - shaft[0]
        return shaft[0], math.atan2(along[1], along[0]), None
    place, _, outline = shapes[0]
    heading = outline.heading
    if heading is None and shaft is not None:
        along = max((shaft[0] - place, shaft[-1] - place), key=lambda way: float(np.linalg.norm(way)))
        heading = math.atan2(along[1], along[0])
    return place, heading, None


def goal_of(outlines: Sequence[Outline], gap: float) -> tuple[FloatArray | None, float | None, str | None]:
    """Return position, radius and a sentence if something is unclear.

    A circle is its centre and radius, another closed shape its centroid and the radius of the circle around
    it within the shape; a place has no radius unless it says one; a cross of lines is its middle.
    """
    shapes, lines = _sorted(outlines, gap)
    if len(shapes) > 1 or not (shapes or lines):
        return None, None, f"Expected one goal, got {len(shapes)} shapes: give it by hand."
    if not shapes:
        points = np.concatenate(lines)
        return 0.5 * (points.min(axis=0) + points.max(axis=0)), None, None
    place, radius, outline = shapes[0]
    return place, radius if outline.radius is None else outline.radius, None


def widest_heading(free_space: Polygon | MultiPolygon, place: FloatArray) -> float | None:
    """Return the direction of the longest straight free way from a place, None outside the free space."""
    if not free_space.contains(Point(place)):
        return None
    rings = shapely.get_rings(shapely.get_parts(free_space))
    coords = [shapely.get_coordinates(ring) - place for ring in rings]
    start = np.concatenate([ring[:-1] for ring in coords])
    end = np.concatenate([ring[1:] for ring in coords])
    ways = []
    for angle in 2 * math.pi * np.arange(N_HEADINGS) / N_HEADINGS:
        along, across = (
            np.array([math.cos(angle), math.sin(angle)]),
            np.array([-math.sin(angle), math.cos(angle)]),
        )
        low, high = start @ across, end @ across
        hit = ((low <= 0.0) & (high >= 0.0)) | ((low >= 0.0) & (high <= 0.0))
        span = np.where(low[hit] == high[hit], 1.0, low[hit] - high[hit])
        reach = (start[hit] + (low[hit] / span)[:, None] * (end[hit] - start[hit])) @ along
        ways.append(float(reach[reach > 0.0].min(initial=math.inf)))
    best = 2 * math.pi * int(np.argmax(ways)) / N_HEADINGS
    return math.remainder(best, 2 * math.pi)


def _sorted(
    outlines: Sequence[Outline], gap: float
) -> tuple[list[tuple[FloatArray, float | None, Outline]], list[FloatArray]]:
    """Return closed shapes and places as (centre, radius, outline), and open lines as points (n, 2)."""
    shapes: list[tuple[FloatArray, float | None, Outline]] = []
    lines = []
    for outline in outlines:
        for stroke in outline.strokes:
            circle = stroke.circle
            points = flattened(
                stroke.pieces, max(gap, 1e-3 * float(np.ptp(stroke.hull, axis=0).max()))
            ).points
            if circle is not None:
                shapes.append((*circle, outline))
            elif np.ptp(points, axis=0).max() <= 0.0:
                shapes.append((points[0], None, outline))
            elif _is_closed(stroke, points, gap):
                shapes.append((*_middle(points), outline))
            else:
                lines.append(points)
    return shapes, lines


def _is_closed(stroke: Stroke, points: FloatArray, gap: float) -> bool:
    near = float(np.linalg.norm(points[0] - points[-1])) <= gap
    return len(np.unique(points, axis=0)) > 2 and (stroke.closed or near)


def _middle(points: FloatArray) -> tuple[FloatArray, float | None]:
    area = filled(points) if len(points) > 3 or (points[0] != points[-1]).any() else Polygon()
    if area.is_empty or area.area == 0.0:
        return points.mean(axis=0), None
    centre = area.centroid if area.contains(area.centroid) else area.representative_point()
    return np.array([centre.x, centre.y]), float(area.boundary.distance(centre))
