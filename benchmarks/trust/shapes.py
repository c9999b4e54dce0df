"""Degenerate scenes in the plane: random compositions of what geometry programs stumble over."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

HAIR = 1e-9
"""How thin slivers are and how narrow gaps, in corridor widths."""

PLACEMENTS = tuple((scale, offset) for scale in (1.0, 1e-3, 1e6) for offset in (0.0, 1e6, 1e9))
"""Scales and offsets at which scenes are looked at; the first is the plain one."""


@dataclasses.dataclass(kw_only=True)
class Scene:
    """Hold what a maze and an arm are made of, in corridor widths; any of it may be wrong.

    Parameters
    ----------
    free : shapely geometry
        The free space.
    base, heading, goal, goal_radius, link_length, n_links, link_radius
        Of the maze and the arm.
    marks : list of str
        Which degeneracies went in.
    fragile : bool
        Whether rounding of coordinates alone may turn the answer: something is exact, or as thin as a hair.
    wrong : bool
        Whether the maze or the arm has to be refused.
    """

    free: Any
    base: tuple[float, float]
    heading: float
    goal: tuple[float, float]
    goal_radius: float = 0.1
    link_length: float = 1.3
    n_links: int | None = None
    link_radius: float = 0.0
    marks: list[str] = dataclasses.field(default_factory=list)
    fragile: bool = False
    wrong: bool = False

    def placed(self, scale: float, offset: float) -> dict[str, Any]:
        """Return the arguments of the maze and of the arm, scaled and moved."""
        move = lambda xy: np.asarray(xy, dtype=np.float64) * scale + offset  # noqa: E731
        return {
            "maze": {
                "name": "+".join(self.marks) or "plain",
                "free_space": shapely.transform(self.free, move),
                "base_pose": (*move(self.base), self.heading),
                "goal": move(self.goal),
                "goal_radius": self.goal_radius * scale,
            },
            "arm": {
                "link_length": self.link_length * scale,
                "n_links": self.n_links,
                "link_radius": self.link_radius * scale,
            },
        }


def random_scene(rng: np.random.Generator) -> Scene:
    """Compose a scene of a shape and up to three degeneracies."""
    scene = SHAPES[rng.integers(len(SHAPES))](rng)
    names = list(CHANGES)
    for k in sorted(rng.permutation(len(names))[: rng.integers(0, 4)]):
        CHANGES[names[k]](scene, rng)
        scene.marks.append(names[k])
    return scene


# Shapes: at (0, 0) stands the base, and the first stretch goes along x.


def corridor(rng: np.random.Generator) -> Scene:
    """Return a corridor of one to five legs."""
    points, way = [(-0.05, 0.0), (3.0, 0.0)], 0
    for _ in range(rng.integers(0, 5)):
        way = way + 1 if way <= 0 else way - 1
        x, y = points[-1]
        leg = float(rng.choice([2.0, 2.5, 3.3]))
        points.append((x + (leg if way == 0 else 0.0), y + way * leg))
    line = shapely.linestrings(points)
    free = line.buffer(0.5, cap_style="flat", join_style="mitre")
    (x, y), (u, v) = points[-1], points[-2]
    back = 0.5 / math.hypot(x - u, y - v)
    return Scene(free=free, base=(0.0, 0.0), heading=0.0, goal=(x + back * (u - x), y + back * (v - y)))


def hall(rng: np.random.Generator) -> Scene:
    """Return a hall with pillars on a grid."""
    pillars = [
        shapely.box(x, y, x + 0.6, y + 0.6)
        for x in (2.0, 4.0)
        for y in (-1.8, -0.3, 1.2)
        if rng.random() < 0.7
    ]
    free = shapely.box(-0.05, -2.5, 6.5, 2.5).difference(shapely.union_all(pillars))
    return Scene(free=free, base=(0.0, 0.0), heading=0.0, goal=(6.0, float(rng.choice([-2.0, 0.0, 2.0]))))


SHAPES: tuple[Callable[[np.random.Generator], Scene], ...] = (corridor, hall)


# Changes of the walls


def rings_of(free: Any) -> Iterator[list[np.ndarray]]:
    """Yield the rings of each polygon, open."""
    for part in getattr(free, "geoms", [free]):
        yield [shapely.get_coordinates(ring)[:-1] for ring in (part.exterior, *part.interiors)]


def rebuilt(free: Any, change: Callable[[np.ndarray], np.ndarray]) -> Any:
    """Return polygons with each ring changed."""
    parts = [Polygon(change(rings[0]), [change(ring) for ring in rings[1:]]) for rings in rings_of(free)]
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def _fine(ring: np.ndarray, parts: int) -> np.ndarray:
    after = np.roll(ring, -1, axis=0)
    share = np.arange(parts)[:, None] / parts
    return (ring[:, None] + share * (after - ring)[:, None]).reshape(-1, 2)


def collinear(scene: Scene, rng: np.random.Generator) -> None:
    """Put many points on every wall."""
    parts = int(rng.choice([7, 100]))
    scene.free = rebuilt(scene.free, lambda ring: _fine(ring, parts))


def duplicates(scene: Scene, rng: np.random.Generator) -> None:
    """Give every corner twice or three times."""
    times = int(rng.integers(2, 4))
    scene.free = rebuilt(scene.free, lambda ring: np.repeat(ring, times, axis=0))


def near_duplicates(scene: Scene, rng: np.random.Generator) -> None:
    """Give every corner again, a hair beside it along the wall."""

    def change(ring: np.ndarray) -> np.ndarray:
        after = np.roll(ring, -1, axis=0)
        size = np.maximum(np.linalg.norm(after - ring, axis=1), 1e-300)[:, None]
        return np.stack([ring, ring + HAIR * (after - ring) / size], axis=1).reshape(-1, 2)

    scene.free, scene.fragile = rebuilt(scene.free, change), True


def sliver(scene: Scene, rng: np.random.Generator) -> None:
    """Put a wall as thin as a hair aside the way."""
    scene.free, scene.fragile = scene.free.difference(shapely.box(1.5, 0.3, 2.5, 0.3 + HAIR)), True


def hair_gap(scene: Scene, rng: np.random.Generator) -> None:
    """Put two pillars a hair apart, or a hair from the wall."""
    y = 0.3 if rng.random() < 0.5 else 0.4 - HAIR
    pillars = [shapely.box(2.0, y, 2.05, y + 0.1), shapely.box(2.05 + HAIR, y, 2.1, y + 0.1)]
    scene.free, scene.fragile = scene.free.difference(shapely.union_all(pillars)), True


def spike(scene: Scene, rng: np.random.Generator) -> None:
    """Put a spike of walls a hair thick at its tip into the way's side."""
    scene.free = scene.free.difference(Polygon([(1.8, 0.55), (1.9, 0.1), (1.9 + HAIR, 0.1), (2.0, 0.55)]))
    scene.fragile = True


def touching_holes(scene: Scene, rng: np.random.Generator) -> None:
    """Put two pillars that touch in a corner."""
    a, b = shapely.box(1.5, 0.2, 1.6, 0.3), shapely.box(1.6, 0.3, 1.7, 0.4)
    scene.free = scene.free.difference(a).difference(b)
    scene.fragile = True


def hole_at_wall(scene: Scene, rng: np.random.Generator) -> None:
    """Put a pillar that touches the outer wall in a point."""
    scene.free = scene.free.difference(Polygon([(2.0, 0.5), (1.9, 0.4), (2.0, 0.3), (2.1, 0.4)]))
    scene.fragile = True


def island(scene: Scene, rng: np.random.Generator) -> None:
    """Put a room inside a pillar, and one beside all."""
    hole = shapely.box(1.6, 0.2, 1.9, 0.45)
    inner, beside = shapely.box(1.7, 0.25, 1.8, 0.4), shapely.box(50.0, 50.0, 51.0, 51.0)
    scene.free = MultiPolygon([*_parts(scene.free.difference(hole)), inner, beside])


def flat_hole(scene: Scene, rng: np.random.Generator) -> None:
    """Put a wall without thickness: a hole that is a line."""
    first = _parts(scene.free)[0]
    hole = [(1.5, 0.2), (2.0, 0.2), (1.7, 0.2)]
    scene.free = Polygon(first.exterior, [*first.interiors, hole])
    scene.wrong = True


def shared_edge(scene: Scene, rng: np.random.Generator) -> None:
    """Put two holes with a common edge."""
    first = _parts(scene.free)[0]
    holes = [shapely.box(1.5, 0.2, 1.6, 0.3).exterior, shapely.box(1.6, 0.2, 1.7, 0.3).exterior]
    scene.free = Polygon(first.exterior, [*first.interiors, *holes])
    scene.wrong = True


def many_edges(scene: Scene, rng: np.random.Generator) -> None:
    """Make every wall a zigzag of small steps."""
    n = int(rng.choice([30, 200]))

    def change(ring: np.ndarray) -> np.ndarray:
        fine = _fine(ring, n)
        step = np.roll(fine, -1, axis=0) - np.roll(fine, 1, axis=0)
        out = np.stack([-step[:, 1], step[:, 0]], axis=1) * (np.arange(len(fine)) % 2)[:, None]
        return fine + 0.1 * out * (np.arange(len(fine)) % n > 1)[:, None]

    free = rebuilt(scene.free, change)
    if free.is_valid and not free.is_empty:
        scene.free = free


def _parts(free: Any) -> list[Polygon]:
    return list(getattr(free, "geoms", [free]))


# Changes of the places and of the arm


def goal_somewhere(scene: Scene, rng: np.random.Generator) -> None:
    """Put the goal at a wall, on a corner, in a wall, outside, elsewhere, at the base, or nowhere."""
    corner = shapely.get_coordinates(scene.free)[int(rng.integers(len(shapely.get_coordinates(scene.free))))]
    places = [
        (scene.goal[0], scene.goal[1], False, False),
        (2.5, 0.5 - HAIR, True, False),
        (*corner.tolist(), True, True),
        (1e3, 1e3, False, True),
        (50.5, 50.5, False, True),
        (*scene.base, False, True),
        (math.nan, 0.0, False, True),
        (math.inf, 0.0, False, True),
        (2.5, 0.0, False, False),
    ]
    x, y, fragile, wrong = places[rng.integers(len(places))]
    scene.goal = (x, y)
    scene.fragile |= fragile
    scene.wrong |= wrong


def goal_radius_somehow(scene: Scene, rng: np.random.Generator) -> None:
    """Make the radius of the goal nothing, tiny, huge or no number."""
    scene.goal_radius = float(rng.choice([0.0, 1e-9, 1e-3, 1e9, -1.0, math.nan, math.inf, 1e-300]))
    scene.wrong |= not 1e-320 < scene.goal_radius < 1e8
    scene.fragile |= scene.goal_radius < 1e-6


def base_somewhere(scene: Scene, rng: np.random.Generator) -> None:
    """Put the base at a wall, on a wall, in a wall, or nowhere, or turn it."""
    places = [
        (0.0, 0.5 - HAIR, 0.0, True, False),
        (0.0, -0.5 + 1e-6, 0.0, True, False),
        (-0.05, 0.0, 0.0, True, True),
        (-1.0, 0.0, 0.0, False, True),
        (0.0, 0.0, math.pi, False, True),
        (0.0, 0.0, 2e5 * math.pi, True, False),
        (0.0, 0.0, math.nan, False, True),
        (0.0, math.inf, 0.0, False, True),
        (0.0, 0.0, 0.1, False, False),
        (-0.05 + HAIR, 0.0, 0.0, True, False),
    ]
    x, y, scene.heading, fragile, wrong = places[rng.integers(len(places))]
    scene.base = (x, y)
    scene.fragile |= fragile
    scene.wrong |= wrong


def links_somehow(scene: Scene, rng: np.random.Generator) -> None:
    """Make links short, long, exactly as long as fits, few, or very many."""
    choices = [
        (0.3, None),
        (0.05, None),
        (2.95, None),
        (100.0, None),
        (1.0, 1),
        (1.0, 300),
        (1e-3, None),
        (1e-6, None),
    ]
    scene.link_length, scene.n_links = choices[rng.integers(len(choices))]
    scene.fragile |= scene.link_length == 2.95 or scene.n_links == 300
    scene.wrong |= scene.link_length == 100.0


def radius_somehow(scene: Scene, rng: np.random.Generator) -> None:
    """Make links as thick as the corridor exactly, a hair thinner or thicker, or nearly as thin as lines."""
    share = float(rng.choice([0.5, 0.5 - HAIR, 0.5 + HAIR, 0.4, 0.1, 1e-12]))
    scene.link_radius = min(share, 0.499 * scene.link_length)
    scene.fragile |= share not in (0.4, 0.1)


CHANGES: dict[str, Callable[[Scene, np.random.Generator], None]] = {
    "sliver": sliver,
    "hair gap": hair_gap,
    "spike": spike,
    "touching holes": touching_holes,
    "hole at wall": hole_at_wall,
    "island": island,
    "many edges": many_edges,
    "collinear": collinear,
    "near duplicates": near_duplicates,
    "duplicates": duplicates,
    "flat hole": flat_hole,
    "shared edge": shared_edge,
    "goal": goal_somewhere,
    "goal radius": goal_radius_somehow,
    "base": base_somewhere,
    "links": links_somehow,
    "radius": radius_somehow,
}
"""In the order in which they are made: cuts, then corners, then what makes a polygon invalid for good."""
