"""Rings out of lines: CAD drawings have rooms as single lines and arcs that share end points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from shapely.geometry import LineString, MultiLineString

from hrsnake_env.arm import FloatArray

__all__ = ["joined"]


def joined(lines: Sequence[FloatArray], gap: float) -> tuple[list[FloatArray], list[FloatArray]]:
    """Join lines that share end points, up to a gap.

    Lines drawn twice count once. Where more than two lines meet, every face that they enclose is a ring:
    rooms that share a wall are two rings with a wall in common.

    Parameters
    ----------
    lines : sequence of arrays, shape (n >= 2, 2)

    Returns
    -------
    rings : list of arrays, shape (n, 2)
        Closed: the last point is the first.
    open_lines : list of arrays, shape (n, 2)
    """
    ends = _snapped(np.array([point for line in lines for point in (line[0], line[-1])]).reshape(-1, 2), gap)
    whole: dict[tuple[object, ...], LineString] = {}
    for line, start, end in zip(lines, ends[::2], ends[1::2], strict=True):
        points = np.concatenate([[start], line, [end]])
        again = np.concatenate([[False], (points[1:] == points[:-1]).all(axis=1)])
        lost = (start == end).all() and len(line) < 3  # shorter than the gap: its ends are one
        if (~again).sum() >= 2 and not lost:
            sides = sorted([tuple(start), tuple(end)])
            inner = sorted(map(tuple, np.round(line[1:-1] / (gap or 1.0)))) if len(line) > 2 else []
            whole.setdefault((*sides, *inner), LineString(points[~again]))
    merged = _lines(shapely.line_merge(MultiLineString(list(whole.values())))) if whole else []
    rings = [line for line in merged if line.is_closed]
    rest = [line for line in merged if not line.is_closed]
    if len(rest) > 1:
        faces, cuts, dangles, _ = shapely.polygonize_full(rest)
        rings += [face.exterior for face in faces.geoms]
        rest = [*_lines(cuts), *_lines(dangles)]
    return [np.asarray(ring.coords)[:, :2] for ring in rings], [np.asarray(line.coords) for line in rest]


def _snapped(ends: FloatArray, gap: float) -> FloatArray:
    """Move ends that are a gap apart at most to one of them, shape (n, 2)."""
    if not len(ends):
        return ends
    pairs = cKDTree(ends).query_pairs(gap, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(ends), len(ends)))
    _, group = connected_components(graph, directed=False)
    _, first = np.unique(group, return_index=True)
    return np.asarray(ends[first][group])


def _lines(geometry: shapely.Geometry) -> list[LineString]:
    parts = shapely.get_parts(geometry)
    # GEOS puts lines into collections, too.
    return [part for part in parts if isinstance(part, LineString) and not part.is_empty]
