"""The kernels that make maps simple, against slow twins in shapely."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon
from shapely.geometry.polygon import orient

from benchmarks.trust.twin_draws import blob, largest_part, on_grid, star
from hrsnake_env.maps import cells, inward
from hrsnake_env.maps.cells import Walls
from hrsnake_env.maps.raster import free_polygons


def some_rings(rng):
    """Draw an outline of a free space: pixels, or a star with a star in it; rings are not closed."""
    if rng.random() < 0.5:
        area = orient(largest_part(blob(rng)))
        if area.is_empty:
            return None
        turn, scale = rng.choice([0.0, 0.4]), 10.0 ** rng.uniform(-3, 3)
        area = shapely.affinity.rotate(area, turn, origin=(0, 0), use_radians=True)
        area = shapely.affinity.scale(area, scale, scale, origin=(0, 0))
    else:
        area = orient(Polygon(star(rng, n=int(rng.integers(5, 30)), low=2.0, high=3.0)) - Polygon(
            star(rng, n=int(rng.integers(3, 9)), low=0.2, high=0.9)
        ))  # fmt: skip
    return [np.asarray(ring.coords)[:-1] for ring in (area.exterior, *area.interiors)]


def walls_kept(rings):
    """Return rings as the kernels hold them, with nothing cut yet."""
    old, counts = np.concatenate(rings), np.array([len(ring) for ring in rings])
    begins = np.concatenate([[0], np.cumsum(counts)])
    n, ring = len(old), np.repeat(np.arange(len(rings)), counts)
    before, after = np.arange(-1, n - 1), np.arange(1, n + 1)
    before[begins[:-1]], after[begins[1:] - 1] = begins[1:] - 1, begins[:-1]
    return Walls(old, old.copy(), np.arange(n).astype(float), before, after, ring, begins, counts)


def in_grid(walls):
    """Return a grid of all walls, and its entries."""
    grid, entries = cells.grid_of(walls), np.empty((4, 3), dtype=np.int64)
    for i in range(len(walls.old)):
        entries = cells.listed(grid, entries, walls, i)
    return grid, entries


def a_cross_product_is_numpys(rng):
    """cells.cross."""
    a, b = on_grid(rng, rng.normal(size=(2, 2)))
    np.testing.assert_allclose(cells.cross(*a, *b), np.linalg.det([a, b]), atol=1e-12)


def every_wall_is_listed_in_every_cell_that_it_comes_into(rng):
    """cells.grid_of and cells.listed."""
    rings = some_rings(rng)
    if rings is None:
        return False
    walls = walls_kept(rings)
    grid, entries = in_grid(walls)
    assert len(grid.head) == grid.n_x * grid.n_y <= cells.MAX_CELLS
    high = np.array([grid.x + grid.n_x * grid.cell, grid.y + grid.n_y * grid.cell])
    assert (walls.old >= (grid.x, grid.y)).all() and (walls.old <= high).all()
    assert 0.0 < grid.gap < 1e-9 * np.abs(walls.old).max()
    listed = [set() for _ in grid.head]
    for cell, entry in enumerate(grid.head):
        while entry >= 0:
            listed[cell].add(tuple(entries[entry, :2]))
            entry = entries[entry, 2]
    for i in rng.integers(0, len(walls.old), 6):
        j = int(walls.after[i])
        for share in np.linspace(0.0, 1.0, 50):
            x, y = walls.now[i] + share * (walls.now[j] - walls.now[i])
            column = min(int((x - grid.x) / grid.cell), grid.n_x - 1)
            row = min(int((y - grid.y) / grid.cell), grid.n_y - 1)
            assert (int(i), j) in listed[max(row, 0) * grid.n_x + max(column, 0)]
    return None


def a_triangle_is_clear_where_no_wall_touches_it(rng):
    """cells.is_clear: triangles anywhere, and ears of the outline, alone or not."""
    rings = some_rings(rng)
    if rings is None:
        return False
    walls = walls_kept(rings)
    grid, entries = in_grid(walls)
    size, n = np.ptp(walls.old, axis=0).max(), len(walls.old)
    alone = bool(rng.random() < 0.5)
    i = int(rng.integers(0, n))
    a, b, c = (walls.now[k].copy() for k in (walls.before[i], i, walls.after[i]))
    own = (int(walls.before[i]), i, i)
    if rng.random() < 0.6:
        low, high = walls.old.min(axis=0), walls.old.max(axis=0)
        a = rng.uniform(low, high)
        b, c = a + 0.3 * size * rng.normal(size=(2, 2))
        own = (-1, -1, -1) if rng.random() < 0.5 else own
    triangle = shapely.MultiPoint([a, b, c]).convex_hull
    near, inner = triangle.buffer(1e-7 * size), triangle.buffer(-1e-7 * size)
    touched, deep = False, False
    for k in set(range(n)) - set(own):
        ends = walls.now[[k, walls.after[k]]]
        wall = LineString(ends)
        deep |= not inner.is_empty and wall.intersects(inner)
        meets_at_corner = bool({*map(tuple, ends)} & {tuple(a), tuple(b), tuple(c)})
        if not alone and meets_at_corner and wall.intersection(triangle).length <= 1e-9 * size:
            continue  # it goes on beside the triangle
        touched |= wall.intersects(near)
    clear = cells.is_clear(walls, grid, entries, a, b, c, own, alone)
    assert not (clear and deep)
    flat = triangle.area < 1e-6 * size * size
    assert clear or touched or flat
    return None


def walls_move_inward_alone_and_no_farther_than_allowed(rng):
    """inward.shrunk: what is left is valid, within, as near as is said, and each ring is one."""
    rings = some_rings(rng)
    if rings is None:
        return False
    if rng.random() < 0.3:
        free = blob(rng)
        parts = free_polygons(free)
        parts = [parts] if isinstance(parts, Polygon) else list(parts.geoms)
        polygons = [orient(part) for part in parts]
        rings = [np.asarray(r.coords)[:-1] for part in polygons for r in (part.exterior, *part.interiors)]
    walls = walls_kept(rings)
    size = np.abs(walls.old).max()
    tolerance = rng.choice([0.0, 0.02, 0.1, 0.5]) * np.ptp(walls.old, axis=0).max() / 3.0
    now, after, moved = inward.shrunk(walls.old, walls.begins, tolerance)
    assert 0.0 <= moved <= tolerance * (1.0 + 1e-9)
    seen = set()
    for k, ring in enumerate(rings):
        first, last = walls.begins[k], walls.begins[k + 1]
        kept = first + np.flatnonzero(after[first:last] >= 0)
        assert len(kept) >= 3
        np.testing.assert_array_equal(after[kept], np.roll(kept, -1))
        seen |= set(kept)
        old, new = LineString([*ring, ring[0]]), LineString([*now[kept], now[kept[0]]])
        assert shapely.hausdorff_distance(new, old, densify=0.05) <= moved + 1e-9 * size
        assert shapely.hausdorff_distance(old, new, densify=0.05) <= moved + 1e-9 * size
        area, smaller = Polygon(ring), Polygon(now[kept])
        assert smaller.is_valid
        inner, outer = (smaller, area) if area.exterior.is_ccw else (area, smaller)
        assert outer.buffer(1e-9 * size).covers(inner)
    assert len(seen) == (after >= 0).sum()
    return None


LAWS = (
    a_cross_product_is_numpys,
    every_wall_is_listed_in_every_cell_that_it_comes_into,
    a_triangle_is_clear_where_no_wall_touches_it,
    walls_move_inward_alone_and_no_farther_than_allowed,
)
