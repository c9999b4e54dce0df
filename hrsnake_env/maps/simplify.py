"""Fewer vertices in an outline, without ever growing the free space."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from hrsnake_env.errors import InputError
from hrsnake_env.maps.inward import shrunk

__all__ = ["simplified_inward"]


def simplified_inward(
    polygon: Polygon | MultiPolygon, tolerance: float
) -> tuple[Polygon | MultiPolygon, float]:
    """Take vertices out of an outline by moving its walls into the free space, not far.

    The result lies within the polygon, and has its parts and holes: passages become narrower by at most
    twice the tolerance, but none is closed, and no obstacle is lost. Staircases of pixels along a slanted
    wall become one straight wall if the tolerance is their depth: 0.71 pixels at 45 degrees, and at most 1.42
    at any angle.

    Parameters
    ----------
    polygon : Polygon or MultiPolygon
        The free space; valid.
    tolerance : float
        How far walls may move, in units of the polygon. 0 leaves out vertices on straight walls alone.

    Returns
    -------
    simple : Polygon or MultiPolygon
        Its vertices are those of the polygon as far as they are kept, to the last bit.
    moved : float
        The largest distance between the walls and the polygon's: none of either is farther from the other.

    Raises
    ------
    InputError
        If the tolerance is negative or not finite, or the polygon is not valid.

    Examples
    --------
    >>> stairs = Polygon([(0, 0), (3, 0), (3, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3)])
    >>> simplified_inward(stairs, 0.75)[0].wkt
    'POLYGON ((0 0, 3 0, 0 3, 0 0))'
    """
    if not 0.0 <= tolerance < math.inf:
        raise InputError(f"Expected a finite tolerance of at least 0, got {tolerance!r}.")
    if polygon.is_empty:
        return polygon, 0.0
    if not polygon.is_valid:
        raise InputError(f"Expected a valid polygon, got one with: {shapely.is_valid_reason(polygon)}.")
    parts = shapely.get_parts(shapely.orient_polygons(shapely.force_2d(polygon)))
    rings, part_of = shapely.get_rings(parts, return_index=True)
    simple, moved = _without_vertices(rings, part_of, tolerance)
    for k in np.flatnonzero(~shapely.is_valid(simple)):  # rounding has made walls touch: that part stays
        simple[k] = parts[k]
    return simple[0] if len(simple) == 1 else MultiPolygon(list(simple)), moved


def _without_vertices(rings: Any, part_of: Any, tolerance: float) -> tuple[Any, float]:
    """Return the polygons of the rings with fewer vertices, and how far walls have moved."""
    closed, ring_of = shapely.get_coordinates(rings, return_index=True)
    ends = np.flatnonzero(np.append(np.diff(ring_of), 1))
    old, ring_of = np.delete(closed, ends, axis=0), np.delete(ring_of, ends)
    begins = np.searchsorted(ring_of, np.arange(len(rings) + 1))
    now, after, moved = shrunk(old, begins, float(tolerance))
    kept = after >= 0  # vertices keep their order in the ring
    outlines = shapely.linearrings(now[kept], indices=ring_of[kept])
    return shapely.polygons(outlines, indices=part_of), float(moved)
