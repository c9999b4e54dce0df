"""Free space out of closed outlines: areas, what lies in what, and walls between rooms that touch."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import STRtree
from shapely.geometry import MultiPolygon, Polygon

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError

__all__ = [
    "MAX_CROSSINGS",
    "Nesting",
    "check_all_crossings",
    "check_crossings",
    "even_odd",
    "filled",
    "nested",
    "odd",
    "polygons",
    "without",
]


MAX_CROSSINGS = 20_000
"""Of one outline with itself, and of all together: more of them are a scribble, and take minutes."""

MAX_PAIRS = 200_000
"""Of outlines whose bounds meet."""

N_PROBES = 500

GRID = 1e-13
"""Share of the largest coordinate to which points are rounded where plain arithmetic fails."""


def check_crossings(points: FloatArray) -> None:
    """Check that a line does not cross itself too often, as far as some of its sides tell.

    Raises
    ------
    InputError
        If it does.
    """
    if _n_crossings([points]) > MAX_CROSSINGS:
        raise InputError(
            f"Expected outlines that cross themselves at most {MAX_CROSSINGS:,} times, got a scribble."
        )


def check_all_crossings(lines: Sequence[FloatArray]) -> None:
    """Check that lines do not cross each other too often, as far as some of their sides tell.

    Raises
    ------
    InputError
        If they do.
    """
    if _n_crossings(lines) > MAX_CROSSINGS:
        raise InputError(
            f"Expected outlines that cross each other at most {MAX_CROSSINGS:,} times, got a scribble: "
            f"ignore layers that are not needed."
        )


def _n_crossings(lines: Sequence[FloatArray]) -> float:
    """Return how often sides of lines, shape (n, 2) each, cross, as far as some of them tell."""
    n = sum(len(points) - 1 for points in lines)
    if n * n < 2 * MAX_CROSSINGS:
        return 0.0
    sides = shapely.linestrings(
        np.concatenate([np.stack([points[:-1], points[1:]], axis=1) for points in lines])
    )
    probes = sides[:: max(1, n // N_PROBES)]
    hits = len(STRtree(sides).query(probes, predicate="crosses")[0])
    return 0.5 * hits * n / len(probes)


def polygons(geometry: shapely.Geometry) -> list[Polygon]:
    """Return the polygons of a geometry, without lines and points."""
    found = []
    for part in shapely.get_parts(geometry):
        if isinstance(part, Polygon):
            if part.area > 0.0:
                found.append(part)
        elif part.geom_type.startswith(("Multi", "Geometry")):
            found += polygons(part)
    return found


def without(area: shapely.Geometry, taken: Sequence[shapely.Geometry] | np.ndarray) -> MultiPolygon | Polygon:
    """Return an area without others.

    Rounding of almost parallel sides makes GEOS return invalid areas now and then; on a grid finer than any
    wall it does not.
    """
    others = shapely.disjoint_subset_union_all(taken)
    left = shapely.difference(area, others)
    if left.is_valid:
        return left
    grid = GRID * float(np.abs(area.bounds).max())
    return shapely.difference(shapely.make_valid(area), others, grid_size=grid)


def even_odd(rings: Sequence[FloatArray]) -> MultiPolygon | Polygon:
    """Return the area of rings, shape (n, 2) each, by the even-odd rule, that of crossing ones too."""
    areas = [
        shapely.union_all(polygons(shapely.make_valid(Polygon(ring), method="linework"))) for ring in rings
    ]
    return odd(areas)


def odd(areas: Sequence[shapely.Geometry]) -> MultiPolygon | Polygon:
    """Return what an odd number of areas covers."""
    return functools.reduce(shapely.symmetric_difference, areas)


def filled(ring: FloatArray) -> MultiPolygon | Polygon:
    """Return all that a ring encloses, shape (n, 2), that of a crossing one too: nothing is missing."""
    area = Polygon(ring)
    if area.is_valid:
        return area
    faces = shapely.get_parts(shapely.polygonize([shapely.node(area.exterior)]))
    whole = polygons(shapely.union_all(faces))
    return shapely.union_all([Polygon(part.exterior) for part in whole])


@dataclass(frozen=True, eq=False, kw_only=True)
class Nesting:
    """Hold what became of closed outlines, in their order.

    Parameters
    ----------
    free_space : Polygon or MultiPolygon
    free : array of bool
        Which outlines bound free space from outside.
    twice : array of bool
        Which repeat another.
    crossing : array of bool
        Which cross a larger one, and are obstacles therefore.
    """

    free_space: Polygon | MultiPolygon
    free: np.ndarray
    twice: np.ndarray
    crossing: np.ndarray


def nested(rings: Sequence[FloatArray], is_wall: Sequence[bool], gap: float, thickness: float) -> Nesting:
    """Return the free space of a floor plan.

    Outermost outlines bound free space, outlines within them are obstacles, outlines within those bound free
    space again, and so on. A wall within anything is an obstacle. What crosses a larger outline of free space
    is an obstacle, for that never makes the free space larger. Where free spaces touch, a wall is between
    them.

    Parameters
    ----------
    rings : sequence of arrays, shape (n, 2)
    is_wall : sequence of bool
        The outline is said to be a wall.
    gap : float
        Overlaps thinner than this are none.
    thickness : float
        Of the walls between free spaces that touch.
    """
    areas = np.array([filled(ring) for ring in rings], dtype=object)
    inner, outer, cross_small, cross_large, twin = _relations(areas, gap)
    twice = twin >= 0
    size = shapely.area(areas)
    parent = np.full(len(areas), -1)
    for i in np.argsort(-size[outer], kind="stable"):  # the smallest around it comes last
        parent[inner[i]] = outer[i]
    free = np.zeros(len(areas), dtype=bool)
    crossing = np.zeros(len(areas), dtype=bool)
    crossed: dict[int, list[int]] = {}
    for small, large in zip(cross_small, cross_large, strict=True):
        crossed.setdefault(int(small), []).append(int(large))
    for i in np.argsort(-size, kind="stable"):
        outermost = parent[i] < 0
        free[i] = not twice[i] and (outermost or (not free[parent[i]] and not is_wall[i]))
        crossing[i] = free[i] and any(free[j] for j in crossed.get(int(i), ()))
        free[i] &= not crossing[i]
    around = set(zip(inner.tolist(), outer.tolist(), strict=True))
    solid = [(i, areas[i]) for i in np.flatnonzero(~free & (~twice | ~free[twin])).tolist()]
    # What is within an obstacle, but for a gap, is no way out of it.
    solid += [
        (i, shapely.difference(areas[i], areas[parent[i]]))
        for i in np.flatnonzero(free & (parent >= 0)).tolist()
        if not areas[parent[i]].covers(areas[i])
    ]
    tree = STRtree([area for _, area in solid])
    rooms = []
    for i in np.flatnonzero(free).tolist():
        near = [solid[k] for k in tree.query(areas[i], predicate="intersects").tolist()]
        taken = [area for j, area in near if (i, twin[j] if twice[j] else j) not in around]
        room = without(even_odd([rings[i]]), taken)
        for j in np.flatnonzero(twin == i).tolist():
            room = shapely.intersection(room, areas[j])
        rooms.append(room)
    return Nesting(free_space=_apart(rooms, thickness), free=free, twice=twice, crossing=crossing)


def _relations(areas: np.ndarray, gap: float) -> tuple[np.ndarray, ...]:
    """Return who lies in whom (inner, outer), who crosses whom (smaller, larger), who repeats whom, or -1.

    What sticks out of another by no more than the gap lies in it.
    """
    tree = STRtree(areas)
    _check_pairs(tree, areas)
    outer, inner = tree.query(areas, predicate="covers")
    a, b = tree.query(areas, predicate="overlaps")
    a, b = a[a < b], b[a < b]
    shapely.prepare(areas)
    size = shapely.area(areas)
    a_in_b, b_in_a = _within(areas[a], areas[b], gap), _within(areas[b], areas[a], gap)
    alike = _within(areas[outer], areas[inner], gap)
    inner, outer = (
        np.concatenate([inner, outer[alike], a[a_in_b], b[b_in_a]]),
        np.concatenate([outer, inner[alike], b[a_in_b], a[b_in_a]]),
    )
    both = set(zip(inner.tolist(), outer.tolist(), strict=True))
    twin = np.full(len(areas), -1)
    for i, j in sorted(both, reverse=True):
        if i > j and (j, i) in both:
            twin[i] = j  # the first of them in the end
    for i in np.flatnonzero(twin >= 0):
        twin[i] = twin[i] if twin[twin[i]] < 0 else twin[twin[i]]
    twice = twin >= 0
    real = (inner != outer) & ~twice[inner] & ~twice[outer]
    cross = ~a_in_b & ~b_in_a & ~twice[a] & ~twice[b]
    a, b = a[cross], b[cross]
    common, edges = shapely.intersection(areas[a], areas[b]), shapely.boundary(areas)
    shapely.prepare(edges)
    deep = ~(_near(common, edges[a], gap) & _near(common, edges[b], gap))
    a, b = a[deep], b[deep]
    swap = size[a] > size[b]
    return inner[real], outer[real], np.where(swap, b, a), np.where(swap, a, b), twin


def _check_pairs(tree: STRtree, areas: np.ndarray) -> None:
    n_pairs = 0
    for start in range(0, len(areas), 100):
        n_pairs += len(tree.query(areas[start : start + 100])[0])
        if n_pairs > 2 * MAX_PAIRS:
            raise InputError(
                f"Expected at most {MAX_PAIRS:,} pairs of outlines that lie in or over each other, got more."
            )


def _within(areas: np.ndarray, others: np.ndarray, gap: float) -> np.ndarray:
    """Tell which areas stick out of the other by no more than a gap."""
    sides, limits = shapely.bounds(areas), shapely.bounds(others) + np.array([-gap, -gap, gap, gap])
    within = ((sides[:, :2] >= limits[:, :2]) & (sides[:, 2:] <= limits[:, 2:])).all(axis=1)
    within[within] = _near(shapely.difference(areas[within], others[within]), others[within], gap)
    return np.asarray(within)


def _near(shapes: np.ndarray, others: np.ndarray, gap: float) -> np.ndarray:
    """Tell which shapes have no corner farther than a gap from the other."""
    corners, owner = shapely.get_coordinates(shapes, return_index=True)
    far = ~shapely.dwithin(shapely.points(corners), others[owner], gap)
    near = np.ones(len(shapes), dtype=bool)
    near[owner[far]] = False
    return near


def _apart(rooms: list[Polygon | MultiPolygon], thickness: float) -> Polygon | MultiPolygon:
    """Return rooms as one geometry, with walls where two of them touch."""
    tree = STRtree(rooms)
    a, b = tree.query(rooms, predicate="intersects")
    walls: dict[int, list[shapely.Geometry]] = {}
    for i, j in zip(a[a < b].tolist(), b[a < b].tolist(), strict=True):
        shared = shapely.intersection(rooms[i].boundary, rooms[j].boundary)
        walls.setdefault(j, []).append(rooms[i])
        if shared.length > 0.0:
            wall = shapely.buffer(shared, 0.5 * thickness, cap_style="flat", join_style="mitre")
            walls.setdefault(i, []).append(wall)
            walls[j].append(wall)
    parts = [without(room, walls[i]) if i in walls else room for i, room in enumerate(rooms)]
    return shapely.union_all(parts)
