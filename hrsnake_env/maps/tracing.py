"""Outlines as rings and open lines: curves flattened, gaps closed, lines joined."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maps.drawing import Outline, Stroke, counted
from hrsnake_env.maps.flatten import MAX_POINTS, Trace, flattened
from hrsnake_env.maps.joining import joined
from hrsnake_env.maps.nesting import check_all_crossings, check_crossings

__all__ = ["OpenLine", "Ring", "Traced", "traced"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Ring:
    """A closed line.

    Parameters
    ----------
    points : array, shape (n, 2)
        The last one is joined to the first.
    role, key : str
        See `roles.Roles`.
    outline : int
        Index of the outline it is drawn by, -1 if it was joined from lines.
    nonzero : bool
        Whether that outline is, see `drawing.Outline`.
    """

    points: FloatArray
    role: str | None
    key: str
    outline: int = -1
    nonzero: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class OpenLine:
    """A line that encloses nothing, shape (n, 2)."""

    points: FloatArray
    role: str | None
    key: str


@dataclass(eq=False, kw_only=True)
class Traced:
    """Hold what outlines were drawn with, while it is collected.

    Parameters
    ----------
    rings, open_lines
        What is closed and what is not.
    guards : list of geometries
        What chords leave out of each curve, see `flatten.Trace`.
    deviation : float
        How far guards reach from their chords.
    notes : list of str
    """

    rings: list[Ring] = field(default_factory=list)
    open_lines: list[OpenLine] = field(default_factory=list)
    guards: list[shapely.Geometry] = field(default_factory=list)
    deviation: float = 0.0
    notes: list[str] = field(default_factory=list)

    def take(self, trace: Trace) -> None:
        """Take over what is known of a trace's curves."""
        if len(trace.guards):  # one union per curve is far faster than one of all
            self.guards.append(shapely.disjoint_subset_union_all(trace.guards))
        self.deviation = max(self.deviation, trace.deviation)


def traced(
    outlines: Sequence[Outline],
    roles: Sequence[str | None],
    keys: Sequence[str],
    *,
    curve: float,
    gap: float,
    same: float,
) -> Traced:
    """Return the rings and open lines of outlines that are free space, walls, or of no named role.

    Parameters
    ----------
    curve : float
        Tolerance of chords.
    gap : float
        Gaps up to here are closed.
    same : float
        Ends nearer than this are one point.
    """
    found = Traced()
    loose: dict[tuple[str | None, str, str], list[FloatArray]] = {}
    left: Counter[str] = Counter()
    traces: list[Trace] = []
    n_points = 0
    for i, (outline, role, key) in enumerate(zip(outlines, roles, keys, strict=True)):
        if role not in (None, "free", "walls"):
            continue
        if outline.extra and role is None:
            left["hatch"] += 1
            continue
        for stroke in outline.strokes:
            trace = flattened(stroke.pieces, curve)
            n_points += len(trace.points)
            if n_points > MAX_POINTS:
                raise InputError(
                    f"Expected at most {MAX_POINTS:,} points of outlines, got more: give a larger tolerance."
                )
            if np.ptp(trace.points, axis=0).max() <= 0.0:
                left["place or shape of no size"] += 1
                continue
            check_crossings(trace.points)
            traces.append(trace)
            if _encloses(stroke, trace.points, gap):
                ring = Ring(points=trace.points, role=role, key=key, outline=i, nonzero=outline.nonzero)
                found.rings.append(ring)
            else:
                loose.setdefault((role, key, outline.layer), []).append(trace.points)
    check_all_crossings([ring.points for ring in found.rings])
    for trace in traces:
        found.take(trace)
    for (role, key, _), lines in loose.items():
        _join(found, role, key, lines, gap, same)
    found.notes += [f"{counted(n, what)} left out." for what, n in left.items()]
    return found


def _encloses(stroke: Stroke, points: FloatArray, gap: float) -> bool:
    """Tell whether a line is closed, or all but closed, around some area."""
    if len(points) < 3 or MultiPoint(points).convex_hull.area <= 0.0:
        return False
    near = float(np.linalg.norm(points[0] - points[-1])) <= gap
    return stroke.closed or (near and LineString(points).length > 4.0 * gap)


def _join(
    found: Traced, role: str | None, key: str, lines: list[FloatArray], gap: float, same: float
) -> None:
    """Join lines: those that share end points first, then those with gaps between them."""
    rings, rest = joined(lines, same)
    more, rest = joined(rest, gap) if rest else ([], [])
    rings = [ring for ring in [*rings, *more] if shapely.convex_hull(MultiPoint(ring)).area > 0.0]
    if rings:
        n = len(lines) - len(rest)
        found.notes.append(
            f"{counted(n, 'line')} of '{key}' joined to {counted(len(rings), 'closed outline')}."
        )
    found.rings += [Ring(points=ring, role=role, key=key) for ring in rings]
    found.open_lines += [OpenLine(points=line, role=role, key=key) for line in rest]
