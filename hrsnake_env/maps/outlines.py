"""Outlines of a drawing as free space, base and goal; what SVG, DXF and GeoJSON have in common.

What is what. Layers, names and colours have roles by option, or by names that speak for themselves (`free`,
`walls`, `base`, `goal`). Where something is named free, that is the free space, and closed outlines of walls
are obstacles in it; closed outlines that nobody named are obstacles too, unless the option says what is free:
then they are left out. Where nothing is named free, the drawing is a floor plan: outermost closed outlines
bound the free space, those within them are obstacles, and so on.

What is closed. Lines that share end points on one layer are joined, gaps up to the tolerance are closed.
What stays open is a wall of the given thickness, or left out, which the notes say.

What moves. Curves become chords, and what chords leave out is taken from the free space, see `flatten`:
straight walls stay where they are, curved ones move into the free space by at most half the tolerance. The
rest of the tolerance is for leaving out corners.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maps.drawing import Drawing, Outline, factor, scaled, sound
from hrsnake_env.maps.floor import free_space_of
from hrsnake_env.maps.marks import base_of, goal_of, widest_heading
from hrsnake_env.maps.nesting import polygons, without
from hrsnake_env.maps.reading import MapOptions, MapReading
from hrsnake_env.maps.roles import roles_of
from hrsnake_env.maps.simplify import simplified_inward
from hrsnake_env.maps.tracing import traced

__all__ = ["MAX_VERTICES", "read_outlines"]

TOLERANCE = 1e-4
"""Share of the drawing's size by which walls may move if no tolerance is given."""

SAME_END = 1e-6
"""Ends of lines nearer than this share of the drawing's size are one point."""

MAX_VERTICES = 200_000
"""Corners of a free space that planners can still work with."""

THINNEST = 1e-9
"""Parts of the free space thinner than this share of its size are rounding, not rooms."""

Area: TypeAlias = "Polygon | MultiPolygon"
Found = tuple[FloatArray | None, float | None, str | None]


def read_outlines(drawing: Drawing, options: MapOptions) -> MapReading:
    """Return what a drawing means.

    Raises
    ------
    InputError
        If no free space is found, an option names a layer that is not there, or there is too much of it.
    """
    kept, lost = sound(drawing)
    by, in_words = factor(drawing, options.units, options.scale)
    outlines = scaled(kept, by)
    roles = roles_of(outlines, options)
    notes = [*drawing.notes, in_words, *lost]
    size = _size([outline for outline, its in zip(outlines, roles.roles, strict=True) if its != "ignore"])
    allowed = TOLERANCE * size if options.tolerance is None else options.tolerance
    gap = max(allowed, SAME_END * size)
    drawn = traced(
        outlines,
        roles.roles,
        roles.keys,
        curve=0.5 * (allowed or TOLERANCE * size),  # curves have no corners to keep
        gap=gap,
        same=SAME_END * size,
    )
    table: dict[str, str] = {}
    notes += drawn.notes
    free = free_space_of(drawn, options.wall_thickness, gap, table, notes)
    free = _without_slivers(_guarded(free, drawn.guards), size)
    if free.is_empty:
        raise InputError(_nothing_free(drawing.name, len(drawn.rings), len(drawn.open_lines)))
    if drawn.deviation > 0.0:
        notes.append(f"Curves became chords and move into the free space by at most {drawn.deviation:.3g}.")
    free, moved = _simplified(free, max(0.0, allowed - drawn.deviation))
    _check_vertices(free, drawing.name)
    base, heading, unclear = _mark(base_of, roles.of(outlines, "base"), gap)
    goal, goal_radius, unsure = _mark(goal_of, roles.of(outlines, "goal"), gap)
    notes += [sentence for sentence in (unclear, unsure) if sentence]
    if base is not None and heading is None:
        heading = widest_heading(free, base)
        notes.append(_looking(heading))
    for key, role in zip(roles.keys, roles.roles, strict=True):
        table.setdefault(key, "ignored" if role in (None, "ignore") else role)
    return MapReading(
        name=drawing.name,
        free_space=free,
        units=options.units or drawing.units or "units",
        tolerance=max(allowed, drawn.deviation),
        moved=drawn.deviation + moved,
        notes=tuple(notes),
        layers=table,
        base_pose=None if base is None or heading is None else (float(base[0]), float(base[1]), heading),
        goal=None if goal is None else (float(goal[0]), float(goal[1])),
        goal_radius=goal_radius,
    )


def _size(outlines: Sequence[Outline]) -> float:
    if not outlines:
        raise InputError("Expected outlines that are not ignored, got none.")
    corners = np.concatenate([outline.hull for outline in outlines])
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    if not 0.0 < size < np.inf:
        raise InputError("Expected outlines of some size, got none.")
    return size


def _mark(rule: Callable[[Sequence[Outline], float], Found], outlines: list[Outline], gap: float) -> Found:
    return rule(outlines, gap) if outlines else (None, None, None)


def _looking(heading: float | None) -> str:
    if heading is None:
        return "The base is not in the free space and does not say where it looks: give it by hand."
    return (
        f"The base does not say where it looks: along the longest straight way, at {np.degrees(heading):g} "
        f"degrees. Draw a line from it, or give its heading."
    )


def _guarded(free: Area, guards: list[shapely.Geometry]) -> Area:
    """Return the free space without what chords leave out of curves."""
    every = np.array(guards, dtype=object)
    if free.is_empty or not len(every):
        return free
    shapely.prepare(free)
    near = every[shapely.intersects(free, every)]
    return without(free, near)


def _without_slivers(free: Area, size: float) -> Area:
    parts = [part for part in polygons(free) if part.area > THINNEST * size * part.length]
    parts.sort(key=lambda part: -part.area)
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def _simplified(free: Area, tolerance: float) -> tuple[Area, float]:
    simple, moved = simplified_inward(free, tolerance)
    parts = sorted(polygons(simple), key=lambda part: -part.area)
    return parts[0] if len(parts) == 1 else MultiPolygon(parts), moved


def _check_vertices(free: Area, name: str) -> None:
    n = int(shapely.get_num_coordinates(free))
    if n > MAX_VERTICES:
        raise InputError(
            f"Expected a free space of at most {MAX_VERTICES:,} corners in map '{name}', got {n:,}: give a "
            f"larger tolerance, or ignore layers."
        )


def _nothing_free(name: str, n_closed: int, n_open: int) -> str:
    return (
        f"Expected closed outlines around free space in map '{name}', got {n_closed} closed and {n_open} "
        f"open lines: name what is free, or give open lines a wall thickness."
    )
