"""The rod's kernels against slow twins in shapely and NumPy.

Each law draws a case from a generator and raises AssertionError where a kernel and its twin disagree; it
returns False where what is drawn is no case.
"""

from __future__ import annotations

import itertools
import math
from functools import cache

import networkx
import numpy as np
import shapely

from benchmarks.trust.twin_draws import TURN, distances_to, random_maze, segments, some_walls, star, walls_of
from hrsnake_env.maze import Maze
from planners.kernels import rod, rod_search, rod_shorten, rod_space
from planners.rod_bound import _copy, _first_triangles, _halved, _neighbours, _task, _work_space

GAPS = rod_space.GAPS
NEAR = 1e-6
"""In rad, and in lengths: nearer to an end or to a wall than that, a twin does not decide."""


def gaps_at(place, length, walls, pad=0.0):
    """Return the free intervals that the kernel finds, shape (n, 2)."""
    blocked, gaps = np.empty((len(walls) + 1, 2)), np.empty((len(walls) + 1, 2))
    n = rod.free_directions(*place, length, walls, pad, blocked, gaps)
    return gaps[:n]


def within(directions, gaps):
    """Tell which directions are in one of the intervals, and which are too near to an end to say."""
    ahead = (directions[:, None] - gaps[:, 0]) % TURN
    extent = gaps[:, 1] - gaps[:, 0]
    inside = (ahead < extent).any(axis=1)
    doubtful = (np.minimum(ahead, TURN - ahead) < NEAR) | (np.abs(ahead - extent) < NEAR)
    return inside, doubtful.any(axis=1)


def unit(angles):
    """Return unit vectors."""
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def a_direction_is_free_where_the_rod_meets_no_wall(rng):
    """rod.free_directions: 90 rods as shapes, among loose, degenerate and scaled walls."""
    scale, walls = 10.0 ** rng.uniform(-3, 6), some_walls(rng)
    walls = np.concatenate([walls, walls_of(star(rng))]) if rng.random() < 0.5 else walls
    place, length = rng.uniform(-1, 1, 2), rng.uniform(0.1, 4.0)
    # A wall of length 0 blocks nothing: it is no wall.
    walls = walls[(walls[:, 0] != walls[:, 1]).any(axis=1)]
    if distances_to(walls, shapely.points(place[None]))[0] < 1e-3:
        return False
    directions = rng.uniform(-TURN, TURN, 90)
    gaps = gaps_at(scale * place, scale * length, scale * walls)
    inside, doubtful = within(directions, gaps)
    off = distances_to(walls, segments(place[None], place + length * unit(directions)))
    assert not (inside & ~doubtful & (off == 0.0)).any()
    assert not (~inside & ~doubtful & (off > 1e-4)).any()
    return None


def the_nearest_gap_is_the_one_that_brute_force_finds(rng):
    """rod.nearest_gap: of all gaps, moved by -6 to 6 turns."""
    starts = np.sort(rng.uniform(0.0, TURN, int(rng.integers(1, 6))))
    ends = starts + rng.uniform(0.05, 1.0, len(starts)) * np.diff(np.append(starts, starts[0] + TURN))
    gaps, direction = np.stack([starts, ends], axis=1), rng.uniform(-4 * TURN, 4 * TURN)
    start, end = rod.nearest_gap(direction, gaps, len(gaps))
    moved = gaps[:, None] + TURN * np.arange(-6, 7)[:, None]
    away = np.maximum(np.maximum(moved[..., 0] - direction, direction - moved[..., 1]), 0.0)
    found = max(start - direction, direction - end, 0.0)
    assert abs(found - away.min()) < 1e-9
    assert np.abs(moved - (start, end)).sum(axis=-1).min() < 1e-9


def an_interval_beside_another_meets_it_if_any_turns_make_it(rng):
    """rod_space.beside."""
    start, first = rng.uniform(-2 * TURN, 2 * TURN, 2)
    end, last = start + rng.uniform(0.0, TURN), first + rng.uniform(0.0, TURN)
    low, high = rod_space.beside(start, end, first, last)
    turns = np.arange(-8, 9) * TURN
    middles = np.abs(first + last + 2 * turns - start - end)
    assert abs(abs(low + high - start - end) - middles.min()) < 1e-9
    assert abs(high - low - (last - first)) < 1e-9 and abs((low - first) / TURN % 1.0 - 0.5) > 0.4999999
    some = ((first + turns <= end - NEAR) & (start + NEAR <= last + turns)).any()
    assert not some or (low <= end and start <= high)


def bare_space(rings):
    """Return a space that has walls and no triangles."""
    walls = [walls_of(ring) for ring in rings]
    n, flags = np.zeros((0, 2)), np.zeros(0, dtype=np.bool_)
    whole = np.zeros(0, dtype=np.int64)
    return rod_space.RodSpace(
        walls=np.concatenate(walls), rings=np.cumsum([0, *map(len, walls)]),
        boxes=np.array([[*ring.min(axis=0), *ring.max(axis=0)] for ring in rings]),
        counts=np.zeros(2, dtype=np.int64), vertices=n, triangles=np.zeros((0, 3), dtype=np.int64),
        neighbours=np.zeros((0, 3), dtype=np.int64), changed=flags, centres=n, sizes=np.zeros(0),
        possible=np.zeros((0, GAPS, 2)), exact=np.zeros((0, GAPS, 2)), n_possible=whole, n_exact=whole,
        around=np.zeros((0, GAPS), dtype=np.int64),
    )  # fmt: skip


def a_sweep_is_free_where_its_area_meets_no_wall(rng):
    """rod_search.sweep_is_free: with steps of 0, along the rod, and exactly to a wall."""
    rings = [star(rng, centre=rng.uniform(-2, 2, 2), low=0.2, high=1.0) for _ in range(rng.integers(1, 4))]
    if rng.random() < 0.3:
        rings = [np.round(2.0 * ring) / 2.0 for ring in rings]
    space = bare_space(rings)
    heading, length = rng.uniform(-math.pi, math.pi), rng.uniform(0.0, 3.0)
    if rng.random() < 0.3:
        heading = rng.integers(-4, 5) * math.pi / 4.0
    p, step = np.round(2 * rng.uniform(-3, 3, 2)) / 2, rng.uniform(-2, 2, 2)
    kind = rng.integers(0, 4)
    step = (step, 0.0 * step, rng.uniform(-2, 2) * unit(heading), np.round(step))[kind]
    along = length * unit(heading)
    area = shapely.MultiPoint([p, p + step, p + along, p + step + along]).convex_hull
    off = distances_to(space.walls, np.array([area]))[0]
    free = rod_search.sweep_is_free(*p, *(p + step), heading, length, space)
    assert free or off < NEAR
    # Of a flat area shapely's distance is exact to rounding alone.
    deep = area.buffer(-NEAR)
    assert not free or off > 0.0 or deep.is_empty or distances_to(space.walls, np.array([deep]))[0] > 0.0


@cache
def first_space(number):
    """Return the triangles of a random maze, made once."""
    return _first_triangles(random_maze(number))


def check_conforming(space, area):
    """Raise unless triangles fill an area, and neighbours are those that share an edge."""
    n_vertices, n = (int(count) for count in space.counts)
    corners = space.vertices[space.triangles[:n]]
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
    assert (areas > 0.0).all() and math.isclose(areas.sum(), area, rel_tol=1e-9)
    np.testing.assert_array_equal(space.neighbours[:n], _neighbours(space.triangles[:n]))
    assert len(np.unique(space.vertices[:n_vertices], axis=0)) == n_vertices


def refined_triangles_fill_the_same_space_and_meet_edge_to_edge(rng):
    """rod_space.refine: with room, and with hardly any."""
    number = int(rng.integers(0, 6))
    space = _copy(first_space(number))
    n = int(space.counts[1])
    wanted = np.unique(rng.integers(0, n, int(rng.integers(1, 6))))
    corners = space.vertices[space.triangles[wanted]]
    area = random_maze(number).free_space.area
    done = rod_space.refine(space, wanted, 0)
    assert 0 <= done <= len(wanted)
    check_conforming(space, area)
    if done < len(wanted):
        space = _halved(space, wanted)
        check_conforming(space, area)
    # A wanted triangle is in the first half or smaller: no longer the same.
    assert space.changed[wanted].all() and int(space.counts[1]) >= n + len(wanted)
    assert all(not np.array_equal(space.vertices[space.triangles[t]], corner)
               for t, corner in zip(wanted, corners, strict=True))  # fmt: skip


def headings_over_a_triangle_are_those_of_its_centre_and_of_some_tail(rng):
    """rod_space.update_headings: of triangles that are said to have changed, and of no others."""
    space = _copy(first_space(int(rng.integers(0, 6))))
    n, length = int(space.counts[1]), 10.0 ** rng.uniform(0.5, 2.8)
    space.changed[:] = False
    picked = rng.integers(0, n, 3)
    space.changed[picked] = True
    space.exact[:], space.sizes[:] = np.nan, np.nan
    rod_space.update_headings(space, length, False)
    assert np.isnan(np.delete(space.sizes, picked)).all() and not space.changed.any()
    for t in picked:
        corners = space.vertices[space.triangles[t]]
        centre, edges = corners.mean(axis=0), np.roll(corners, -1, axis=0) - corners
        np.testing.assert_allclose(space.centres[t], centre)
        np.testing.assert_allclose(space.sizes[t], np.hypot(*edges.T).max())
        directions = rng.uniform(0.0, TURN, 40)
        off = distances_to(space.walls, segments(centre[None], centre + length * unit(directions)))
        exact, possible = space.exact[t, : space.n_exact[t]], space.possible[t, : space.n_possible[t]]
        inside, doubtful = within(directions, exact)
        assert not (inside & (off == 0.0)).any()
        may, unsure = within(directions, possible)
        assert (may | unsure | doubtful | (off <= 1e-4 * length))[~inside | (off > 0.0)].all()
        if len(exact) < GAPS and len(possible) < GAPS:
            assert not (~inside & ~doubtful & (off > 1e-4 * length)).any()
        for gap, h in zip(exact, space.around[t], strict=False):
            start, end = rod_space.beside(*gap, *possible[h])
            assert end - start == TURN or (start <= gap[0] and gap[1] <= end)


def meet(one, other):
    """Tell whether two intervals of headings meet, whole turns apart or not."""
    return any(one[0] <= other[1] + k * TURN and other[0] + k * TURN <= one[1] for k in range(-4, 5))


def doubtful_ways(space, task):
    """Return the graph of possible headings between the base and the goal."""
    n, slack = int(space.counts[1]), rod_space.SLACK
    graph, base = networkx.Graph(), (task.x, task.y)
    graph.add_nodes_from(["base", "goal"])
    grown = shapely.polygons(space.vertices[space.triangles[:n]])
    at_base = shapely.distance(grown, shapely.Point(base)) <= slack * task.length
    for t in range(n):
        dx, dy = task.goal_x - space.centres[t, 0], task.goal_y - space.centres[t, 1]
        away, radius = math.hypot(dx, dy), task.goal_radius + 0.667 * space.sizes[t] + slack * task.length
        window = None
        if abs(away - task.length) <= radius:
            cosine = (away**2 + task.length**2 - radius**2) / (2.0 * away * task.length) if away else -1.0
            half = math.acos(min(max(cosine, -1.0), 1.0))
            window = (math.atan2(dy, dx) - half - slack, math.atan2(dy, dx) + half + slack)
        for h in range(space.n_possible[t]):
            gap = space.possible[t, h]
            if window is not None and meet(gap, window):
                graph.add_edge((t, h), "goal")
            if at_base[t] and meet(gap + np.array([-slack, slack]), (task.heading, task.heading)):
                graph.add_edge((t, h), "base")
            for other in space.neighbours[t][space.neighbours[t] > t]:
                for g in range(space.n_possible[other]):
                    if meet(gap, space.possible[other, g]):
                        graph.add_edge((t, h), (int(other), g))
    return graph


def the_search_finds_a_way_where_possible_headings_are_joined(rng):
    """rod_search.search: reachability by networkx, and what is written down of the way."""
    number = int(rng.integers(0, 6))
    space, maze = _copy(first_space(number)), random_maze(number)
    length = maze.size * 10.0 ** rng.uniform(-1.6, -0.2)
    task = _task(maze, space.walls, length, 0.01 * length)
    if task.gap_start == task.gap_end:
        return False
    rod_space.update_headings(space, length, True)
    frontier, way, headings = _work_space(rod_search.FIRST + int(space.counts[1]) * 2 * GAPS)
    n = rod_search.search(space, task, frontier, way, headings)
    assert np.isinf(frontier.cost).all()
    joined = networkx.has_path(doubtful_ways(space, task), "base", "goal")
    assert joined == (n > 0) or (n == 2)  # from the base straight to the goal no triangle is asked
    if n == 0:
        return None
    assert way[0] == rod_search.GOAL and way[n - 1] == rod_search.BASE and len(set(way[:n])) == n
    triangles, kinds = np.divmod(way[1 : n - 1] - rod_search.FIRST, 2 * GAPS)
    for one, other in itertools.pairwise(triangles):
        assert one == other or other in space.neighbours[one]
    doubts = triangles[(kinds < GAPS) & (space.sizes[triangles] > task.resolution)]
    np.testing.assert_array_equal(frontier.doubts[: frontier.used[2]], doubts)
    return None


def rods_are_free(maze, places, length):
    """Tell whether a rod's moves and turns stay in the free space: areas swept, and dense turns."""
    grown = maze.free_space.buffer(1e-7 * maze.size)
    shapely.prepare(grown)
    for (x, y, before), (u, v, after) in itertools.pairwise(places):
        assert (x, y) == (u, v) or before == after
        turned = np.linspace(before, after, 2 + int(abs(after - before) / 0.02))
        tips = np.array([x, y]) + length * unit(turned)
        shapes = segments(np.array([[x, y]]), tips)
        if (x, y) != (u, v):
            ends = np.array([[x, y], [u, v]])
            tail = shapely.MultiPoint(np.concatenate([ends, ends + length * unit(before)]))
            shapes = np.array([tail.convex_hull])
        if not shapely.covers(grown, shapes).all():
            return False
    return True


def wandered(rng, maze, length, steps):
    """Return the places of a rod that moves and turns at random where shapely says that it may."""
    places = [tuple(maze.base_pose)]
    low = 0.1 * length
    for _ in range(steps):
        x, y, heading = places[-1]
        step = low * rng.normal(size=2)
        other = (x + step[0], y + step[1], heading)
        if rng.random() < 0.4:
            other = (x, y, heading + 0.3 * rng.normal())
        if rods_are_free(maze, np.array([places[-1], other]), length):
            places.append(other)
    return np.array(places)


ROOM = Maze(
    name="room",
    free_space=shapely.box(0, 0, 400, 300) - shapely.box(150, 80, 190, 120) - shapely.box(260, 160, 300, 240),
    base_pose=(20.0, 50.0, 0.0), goal=(350.0, 250.0), goal_radius=10.0,
)  # fmt: skip


def a_shortened_way_has_its_ends_is_no_longer_and_is_free(rng):
    """rod_shorten.shorten: of a rod that wanders at random."""
    length, walls = rng.uniform(5.0, 90.0), ROOM.rings
    space = bare_space([ring[:-1] for ring in walls])
    places = wandered(rng, ROOM, length, int(rng.integers(1, 60)))
    short = rod_shorten.shorten(places, length, space)
    np.testing.assert_array_equal(short[0], places[0])
    np.testing.assert_array_equal(short[-1], places[-1])

    def spent(some):
        moved = np.hypot(*np.diff(some[:, :2], axis=0).T)
        return (moved + 0.5 * length * np.abs(np.diff(some[:, 2]))).sum()

    assert spent(short) <= spent(places) * (1.0 + 1e-12)
    assert rods_are_free(ROOM, short, length)


LAWS = (
    a_direction_is_free_where_the_rod_meets_no_wall,
    the_nearest_gap_is_the_one_that_brute_force_finds,
    an_interval_beside_another_meets_it_if_any_turns_make_it,
    a_sweep_is_free_where_its_area_meets_no_wall,
    refined_triangles_fill_the_same_space_and_meet_edge_to_edge,
    headings_over_a_triangle_are_those_of_its_centre_and_of_some_tail,
    the_search_finds_a_way_where_possible_headings_are_joined,
    a_shortened_way_has_its_ends_is_no_longer_and_is_free,
)
