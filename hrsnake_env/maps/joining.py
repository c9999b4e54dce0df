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
from hrsnake_env.errors import InputError

__all__ = ["joined"]

MAX_PAIRS = 2_000_000
"""Of ends of lines that may be joined: more of them take minutes."""


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
    places, first_end, place_of = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    tree = cKDTree(places)
    if tree.count_neighbors(tree, gap) > 2 * MAX_PAIRS + len(places):
        raise InputError(
            f"Expected at most {MAX_PAIRS:,} pairs of ends of lines nearer than {gap:.3g}, got more: give a "
            f"smaller tolerance."
        )
    pairs = tree.query_pairs(gap, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(places), len(places)))
    n_groups, group = connected_components(graph, directed=False)
    first = np.full(n_groups, len(ends))
    np.minimum.at(first, group, first_end)  # a group is where its first end is
    return np.asarray(ends[first[group[place_of.ravel()]]])


def _lines(geometry: shapely.Geometry) -> list[LineString]:
    parts = shapely.get_parts(geometry)
    # GEOS puts lines into collections, too.
    return [part for part in parts if isinstance(part, LineString) and not part.is_empty]
