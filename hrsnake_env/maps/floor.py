"""The free space that rings and open lines mean: what is named free, or a floor plan."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPolygon, Polygon

from hrsnake_env.arm import FloatArray
from hrsnake_env.maps.drawing import counted
from hrsnake_env.maps.nesting import check_all_crossings, even_odd, filled, nested, odd, polygons, without
from hrsnake_env.maps.tracing import Ring, Traced

__all__ = ["free_space_of"]

MITRE_LIMIT = 10.0
"""Corners of thick walls sharper than about 11 degrees are cut off."""

Area: TypeAlias = "Polygon | MultiPolygon"


def free_space_of(
    drawn: Traced, thickness: float, gap: float, table: dict[str, str], notes: list[str]
) -> Area:
    """Return the free space; enter the roles of layers and sentences on what was done.

    Parameters
    ----------
    thickness : float
        Of open lines as walls; 0 leaves them out.
    gap : float
        Overlaps thinner than this are none.
    """
    thick = _thick_walls(drawn, thickness, table, notes)
    things = _by_outline(drawn.rings)
    if any(thing[0].role == "free" for thing in things):
        return _named(things, thick, table, notes)
    solid = [thing for thing in things if len(thing) > 1 and thing[0].role == "walls"]
    rings = [ring for thing in things if len(thing) == 1 or thing[0].role != "walls" for ring in thing]
    material = shapely.union_all([*thick, *(_material(thing) for thing in solid)])
    for thing in solid:
        table[thing[0].key] = "walls"
    return _floor_plan(rings, material, thickness, gap, table, notes)


def _named(things: list[list[Ring]], thick: list[Area], table: dict[str, str], notes: list[str]) -> Area:
    """Return the areas named free without walls, and without what nobody named."""
    free = [even_odd([ring.points for ring in thing]) for thing in things if thing[0].role == "free"]
    table |= {thing[0].key: "free" for thing in things if thing[0].role == "free"}
    space = shapely.union_all(free)
    inside, walls = [area.representative_point() for area in free if not area.is_empty], list(thick)
    n_around = n_unnamed = 0
    for thing in things:
        if thing[0].role == "free":
            continue
        table.setdefault(thing[0].key, "walls")
        if len(thing) > 1:
            walls.append(_material(thing))
            continue
        area = filled(thing[0].points)
        if any(area.contains(point) for point in inside) and any(area.covers(part) for part in free):
            n_around += 1
            continue
        n_unnamed += thing[0].role is None
        walls.append(area)
    if n_around:
        notes.append(f"{counted(n_around, 'outline')} around the free space left out.")
    if n_unnamed:
        notes.append(f"{counted(n_unnamed, 'closed outline')} without a role taken as obstacles.")
    return without(space, walls)


def _floor_plan(
    rings: list[Ring],
    material: Area,
    thickness: float,
    gap: float,
    table: dict[str, str],
    notes: list[str],
) -> Area:
    """Return what is free by the nesting of outlines; what thick walls enclose is a room, too."""
    holes = [Polygon(hole) for part in polygons(material) for hole in part.interiors]
    areas = [filled(ring.points) for ring in rings]
    rooms = [
        Ring(points=np.asarray(hole.exterior.coords), role=None, key="")
        for hole in holes
        if not any(area.covers(hole) for area in areas)
    ]
    whole = [*rings, *rooms]
    if not whole:
        return Polygon()
    plan = nested(
        [ring.points for ring in whole],
        [ring.role == "walls" for ring in whole],
        gap,
        max(thickness, 0.5 * gap),
    )
    for ring, free in zip(rings, plan.free, strict=False):
        table[ring.key] = "free" if free or table.get(ring.key) == "free" else "walls"
    n_free, n_twice, n_cross = (int(found.sum()) for found in (plan.free, plan.twice, plan.crossing))
    n_walls = len(whole) - n_free - n_twice
    notes.append(
        f"Nothing is named free, so this is a floor plan: {counted(n_free, 'outline')} around free space, "
        f"{counted(n_walls, 'obstacle')} within."
    )
    if n_twice:
        notes.append(f"{counted(n_twice, 'outline')} drawn twice left out.")
    if n_cross:
        notes.append(
            f"{counted(n_cross, 'outline')} crossing larger ones are obstacles: name free what is to join."
        )
    return without(plan.free_space, [material])


def _thick_walls(drawn: Traced, thickness: float, table: dict[str, str], notes: list[str]) -> list[Area]:
    """Return open lines as walls, or say that they were left out."""
    if thickness > 0.0:
        check_all_crossings([line.points for line in drawn.open_lines])
    walls = []
    left: Counter[str] = Counter()
    for line in drawn.open_lines:
        if thickness > 0.0 and line.role != "free":
            half = 0.5 * thickness + drawn.deviation  # what chords leave out of curves is wall, too
            walls.append(_thick(line.points, half))
            table.setdefault(line.key, "walls")
        else:
            left[line.key] += 1
            table.setdefault(line.key, "ignored")
    for key, n in left.items():
        notes.append(
            f"{counted(n, 'open line')} of '{key}' left out: lines are walls if they have a wall thickness."
        )
    return walls


def _thick(points: FloatArray, half: float) -> Area:
    return LineString(points).buffer(half, cap_style="flat", join_style="mitre", mitre_limit=MITRE_LIMIT)


def _material(thing: Sequence[Ring]) -> Area:
    """Return the walls that one outline draws; by the nonzero rule at least those, and never less."""
    areas = [filled(ring.points) for ring in thing]
    if not thing[0].nonzero:
        return odd(areas)
    turns = np.array([shapely.is_ccw(shapely.linearrings(ring.points)) for ring in thing])
    tree = shapely.STRtree(areas)
    first, second = tree.query(areas, predicate="intersects")
    both = (first < second) & (turns[first] == turns[second])
    overlaps = [areas[i].intersection(areas[k]) for i, k in zip(first[both], second[both], strict=True)]
    return shapely.union_all([odd(areas), *overlaps])


def _by_outline(rings: list[Ring]) -> list[list[Ring]]:
    """Return rings by the outline they belong to; joined ones each on their own."""
    things: dict[tuple[int, int], list[Ring]] = {}
    for i, ring in enumerate(rings):
        things.setdefault((ring.outline, i if ring.outline < 0 else -1), []).append(ring)
    return list(things.values())
