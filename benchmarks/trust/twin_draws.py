"""What the kernels' twins draw: walls, rings and places, ordinary and degenerate."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import shapely
from scipy import ndimage
from shapely.geometry import Polygon

from hrsnake_env.maps.raster import free_polygons
from hrsnake_env.maze import Maze

TURN = 2.0 * math.pi


def on_grid(rng, points):
    """Round points to halves in one draw of three: so they are in line, in one place, and touch exactly."""
    return np.round(2.0 * points) / 2.0 if rng.random() < 1.0 / 3.0 else points


def some_walls(rng, size=3.0, most=12):
    """Draw loose walls, shape (n, 2, 2): crossing, touching, of length 0, twice the same, none at all."""
    n = int(rng.integers(0, most + 1))
    walls = on_grid(rng, rng.uniform(-size, size, (n, 2, 2)))
    if n > 2 and rng.random() < 0.5:
        walls[0, 1] = walls[0, 0]
        walls[1] = walls[2]
    return walls


def star(rng, n=None, centre=(0.0, 0.0), low=0.5, high=3.0):
    """Draw a ring of vertices around a centre, counter-clockwise, that does not cross itself; not closed."""
    n = int(rng.integers(3, 12)) if n is None else n
    angles = TURN * (np.arange(n) + rng.uniform(0.1, 0.9, n)) / n
    radii = rng.uniform(low, high, n)
    return np.asarray(centre) + radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def walls_of(ring):
    """Return the walls of a ring that is not closed."""
    return np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)


def blob(rng, size=14, share=0.6):
    """Draw a free space of pixels, with holes and corners that touch; in pixels."""
    smooth = rng.choice([0.0, 0.8, 1.5])
    noise = ndimage.gaussian_filter(rng.random((size, size)), smooth)
    free = noise < np.quantile(noise, share)
    return free


@cache
def random_maze(number):
    """Return one of some random mazes, made once."""
    kind = ("clutter", "corridor")[number % 2]
    return Maze.load(f"{kind}-{number // 2}")


def largest_part(free):
    """Return the largest polygon of free pixels."""
    area = free_polygons(free)
    return area if isinstance(area, Polygon) else max(area.geoms, key=lambda part: part.area)


def lines(walls):
    """Return walls, shape (n, 2, 2), as one geometry; those of length 0 as points."""
    return shapely.union_all(
        [shapely.Point(a) if np.array_equal(a, b) else shapely.LineString([a, b]) for a, b in walls]
    )


def distances_to(walls, shapes):
    """Return the distance of each shape to the nearest wall, infinite without any."""
    gaps = shapely.distance(shapes, lines(walls)) if len(walls) else np.full(len(shapes), math.inf)
    return np.where(np.isnan(gaps), math.inf, gaps)


def segments(starts, ends):
    """Return segments as shapes, points where both ends are the same."""
    starts, ends = np.broadcast_arrays(starts, ends)
    same = (starts == ends).all(axis=-1)
    with np.errstate(invalid="ignore"):
        made = shapely.linestrings(np.stack([starts, ends], axis=-2))
    made[same] = shapely.points(starts[same])
    return made
