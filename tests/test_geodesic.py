"""Laws of the shortest ways to the goal through the free space."""

import math
import pickle
from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from shapely import affinity

from hrsnake_env.errors import InputError
from hrsnake_env.geodesic import OFF_WALL, GeodesicDistance
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import MAZES, fig19

NAMES = [*MAZES, "clutter-0", "clutter-1", "clutter-2", "corridor-0", "corridor-1", "corridor-2"]

ROUNDING = 1e-7
"""In sizes of the maze: ways keep OFF_WALL off the walls, at every corner that they pass."""

FIG19 = fig19()
DISTANCE = GeodesicDistance(FIG19)


class Twin:
    """The shortest ways by shapely and brute force: all corners, all lines of sight, from scratch."""

    def __init__(self, maze):
        self.space = maze.free_space.buffer(1e-10 * maze.size, join_style="mitre")
        shapely.prepare(self.space)
        corners = [np.asarray(maze.goal)[None]]
        for ring in maze.rings:
            before, after = ring[:-1] - np.roll(ring[:-1], 1, axis=0), np.diff(ring, axis=0)
            corners.append(ring[:-1][before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]])
        self.corners = np.concatenate(corners)
        n = len(self.corners)
        a, b = np.triu_indices(n, 1)
        seen = self.sees(self.corners[a], self.corners[b])
        gaps = np.zeros((n, n))
        gaps[a[seen], b[seen]] = np.linalg.norm(self.corners[a] - self.corners[b], axis=1)[seen]
        self.lengths, self.onward = dijkstra(gaps, directed=False, indices=0, return_predecessors=True)

    def sees(self, starts, ends):
        """Tell which lines cross no wall."""
        lines = shapely.linestrings(np.stack(np.broadcast_arrays(starts, ends), axis=1))
        return shapely.covers(self.space, lines) | (np.asarray(starts) == ends).all(axis=1)

    def way(self, point):
        """Return the way's vertices, from the point to the goal."""
        lengths = np.linalg.norm(self.corners - point, axis=1) + self.lengths
        bend = int(np.argmin(np.where(self.sees(self.corners, point[None]), lengths, math.inf)))
        way = [point, self.corners[bend]]
        while bend != 0:
            bend = self.onward[bend]
            way.append(self.corners[bend])
        return np.array(way)


@cache
def known(name):
    """Return a maze, its distance, its twin, and points in it: the base, at random, on walls and corners."""
    maze = Maze.load(name)
    rng = np.random.default_rng(0)
    low, high = np.reshape(maze.free_space.bounds, (2, 2))
    points = rng.uniform(low, high, (400, 2))
    free = points[shapely.contains_xy(maze.free_space, *points.T)][:40]
    starts, ends = maze.walls[rng.permutation(len(maze.walls))[:12]].swapaxes(0, 1)
    on_walls = starts + rng.random((len(starts), 1)) * (ends - starts)
    points = np.concatenate([maze.base_pose[None, :2], free, starts, on_walls])
    return maze, GeodesicDistance(maze), Twin(maze), points


def length_of(way):
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def places_along(way, lefts):
    """Return the places on a way from which it is this far to its end."""
    left = length_of(way) - np.concatenate([[0.0], np.linalg.norm(np.diff(way, axis=0), axis=1).cumsum()])
    return np.column_stack([np.interp(lefts, left[::-1], way[::-1, axis]) for axis in (0, 1)])


@pytest.mark.parametrize("name", NAMES)
def test_it_is_the_length_of_the_shortest_way_round_the_corners(name):
    maze, distance, twin, points = known(name)
    expected = [length_of(twin.way(point)) for point in points]
    found = [distance(point) for point in points]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * maze.size)


@pytest.mark.parametrize("name", NAMES)
def test_along_the_way_it_falls_by_the_length_of_each_step(name):
    maze, distance, twin, points = known(name)
    step = 0.02 * maze.free_space.area / maze.free_space.length  # a hundredth of the mean width
    for point in points[:4]:
        way = twin.way(point)
        lefts = np.arange(0.0, length_of(way), step)
        found = [distance(place) for place in places_along(way, lefts)]
        np.testing.assert_allclose(found, lefts, rtol=0.0, atol=ROUNDING * maze.size)


@pytest.mark.parametrize("name", NAMES)
def test_the_look_ahead_follows_the_shortest_way_to_the_goal(name):
    maze, distance, twin, points = known(name)
    for point in points[:8]:
        way = twin.way(point)
        ahead = np.linspace(0.0, 1.2, 40) * length_of(way)
        lefts = np.maximum(length_of(way) - ahead, 0.0)
        places = distance.ahead(point, ahead)
        np.testing.assert_allclose(places, places_along(way, lefts), rtol=0.0, atol=10 * ROUNDING * maze.size)
        np.testing.assert_allclose(places[-1], maze.goal, rtol=0.0, atol=1e-9 * maze.size)


@given(
    st.sampled_from(["fig17c", "fig17d", "clutter-1", "clutter-2", "corridor-1"]),
    st.integers(0, 10_000),
    st.sampled_from([0.0, 1e-9, 0.3, 1.0]) | st.floats(0.0, 1.0),
    st.floats(-12.0, 0.0),
    st.floats(0.0, 2 * math.pi),
    st.floats(-9.0, 0.0),
)
@settings(max_examples=400)
def test_no_step_past_walls_changes_it_by_more_than_its_length(name, wall, share, off, turn, step):
    maze, distance, *_ = known(name)
    start, end = maze.walls[wall % len(maze.walls)]
    along = (end - start) / np.linalg.norm(end - start)
    width = 2.0 * maze.free_space.area / maze.free_space.length
    a = start + share * (end - start) + 10.0**off * width * np.array([-along[1], along[0]])
    b = a + 10.0**step * width * np.array([math.cos(turn), math.sin(turn)])
    if shapely.covers(maze.free_space, shapely.linestrings([a, b])):
        assert abs(distance(a) - distance(b)) <= np.linalg.norm(b - a) + ROUNDING * maze.size


@given(st.floats(0.0, 2 * math.pi), st.floats(-4.0, 4.0), st.floats(-1e3, 1e3))
@settings(max_examples=20)
def test_turning_scaling_and_shifting_the_maze_changes_nothing_else(turn, exponent, shift):
    scale = 10.0**exponent

    def moved(points):
        c, s = math.cos(turn), math.sin(turn)
        return scale * (np.asarray(points) @ np.array([[c, s], [-s, c]]) + shift)

    maze, distance, _, points = known("fig17c")
    space = shapely.transform(maze.free_space, moved)
    other = GeodesicDistance(
        Maze(
            name="moved",
            free_space=space,
            base_pose=np.append(moved(maze.base_pose[:2]), turn),
            goal=moved(maze.goal),
            goal_radius=scale,
        )
    )
    for point in points[:13]:
        assert other(moved(point)) == pytest.approx(scale * distance(point), rel=1e-6)


def test_deep_in_a_wall_it_is_infinite_and_the_way_ahead_stays():
    for point in ((120.0, 700.0), (-1e6, 0.0), (120.0, math.nan)):
        assert DISTANCE(point) == math.inf
    np.testing.assert_allclose(DISTANCE.ahead((120.0, 700.0), [0.0, 50.0]), [[120.0, 700.0]] * 2)


@given(st.floats(0.0, 1300.0), st.floats(-8.0, 0.8))
@settings(max_examples=50)
def test_a_little_inside_a_wall_the_way_begins_at_its_surface(y, exponent):
    depth = 10.0**exponent
    expected = DISTANCE((100.0, y)) + depth
    assert DISTANCE((100.0 + depth, y)) == pytest.approx(expected, abs=ROUNDING * FIG19.size)


def halls(thickness):
    wall = shapely.box(200 - thickness / 2, -1, 200 + thickness / 2, 1800)
    return Maze(
        name="halls",
        free_space=shapely.box(0, 0, 400, 2000) - wall,
        base_pose=(100.0, 5.0, math.pi / 2),
        goal=(300.0, 100.0),
        goal_radius=9.0,
    )


@pytest.mark.parametrize("thickness", [2.0, 0.1, 1e-3])
def test_the_thinnest_wall_has_two_sides(thickness):
    distance = GeodesicDistance(halls(thickness))
    tip = math.hypot(100.0 - thickness / 2, 1700.0)  # from the goal to the wall's end
    for gap in (50.0, thickness):
        left, right = (200.0 + side * (thickness / 2 + gap) for side in (-1, 1))
        over = math.hypot(gap, 1700.0) + thickness + tip
        assert distance((left, 100.0)) == pytest.approx(over, abs=1e-4)
        assert distance((right, 100.0)) == pytest.approx(300.0 - right, abs=1e-4)
        ahead = distance.ahead((left, 100.0), [over - tip - thickness, over - tip])
        ends = [(200.0 - thickness / 2, 1800.0), (200.0 + thickness / 2, 1800.0)]
        np.testing.assert_allclose(ahead, ends, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("degrees", [60.0, 30.0, 10.0])
def test_the_point_of_a_sharp_corner_has_a_way(degrees):
    far = 500.0 * math.tan(math.radians(degrees) / 2)
    maze = Maze(
        name="wedge",
        free_space=shapely.Polygon([(0.0, 0.0), (500.0, -far), (500.0, far)]),
        base_pose=(400.0, 0.0, 0.0),
        goal=(300.0, 0.0),
        goal_radius=9.0,
    )
    assert GeodesicDistance(maze)((0.0, 0.0)) == pytest.approx(300.0, abs=1e-3)


@pytest.mark.parametrize("width", [200.0, 6.0, 0.05, 1e-3])
def test_a_way_is_found_however_narrow(width):
    maze = Maze.from_corridors([(0, 0), (1000, 3000), (2000, 0)], width)
    base = np.linalg.norm(maze.base_pose[:2] - (1000, 3000))
    goal = np.linalg.norm(maze.goal - (1000, 3000))
    distance = GeodesicDistance(maze)(maze.base_pose[:2])
    assert base + goal - 4 * width < distance <= base + goal + 1e-3


def test_a_way_too_narrow_for_floating_point_numbers_is_named():
    maze = Maze.from_corridors([(0, 0), (1000, 3000), (2000, 0)], 1e-8)
    with pytest.raises(InputError, match="Expected a way to the goal of maze 'corridors' that is wider than"):
        GeodesicDistance(maze)


@pytest.mark.parametrize("name", ["fig17d", "corridor-0"])
def test_ways_to_another_goal_are_those_of_the_maze_with_that_goal(name):
    maze, distance, _, points = known(name)
    for goal in points[1:4]:
        there = GeodesicDistance(maze, goal)
        assert there(goal) == pytest.approx(0.0, abs=1e-9 * maze.size)
        assert there(maze.goal) == pytest.approx(distance(goal), abs=ROUNDING * maze.size)
        np.testing.assert_allclose(there.ahead(maze.goal, [math.inf])[0], goal, rtol=1e-9)


@pytest.mark.parametrize(
    "goal", [(120.0, 700.0), (1e4, 0.0), (100.0, 700.0), (0.0, math.nan), (1.0, 2.0, 3.0)]
)
def test_a_goal_outside_the_free_space_is_named(goal):
    with pytest.raises(InputError, match=r"Expected a goal \(x, y\) in the free space, got"):
        GeodesicDistance(FIG19, goal)


@pytest.mark.parametrize("distances", [[-1.0], [math.nan], 5.0])
def test_distances_ahead_that_are_none_are_named(distances):
    with pytest.raises(InputError, match="Expected a list of distances that are not negative, got"):
        DISTANCE.ahead((0.0, 5.0), distances)


def test_a_pickled_copy_tells_the_same_and_is_read_only():
    _, distance, _, points = known("fig17d")
    stored = pickle.dumps(distance)
    copy = pickle.loads(stored)
    assert len(stored) < 200_000
    assert [copy(point) for point in points] == [distance(point) for point in points]
    for ways in (distance.ways, copy.ways):
        assert not any(array.flags.writeable for array in ways if isinstance(array, np.ndarray))


def test_the_goal_and_the_base_may_touch_the_walls():
    square = shapely.box(0, 0, 100, 100) - affinity.rotate(shapely.box(40, 40, 60, 60), 45)
    tiny = 1e-3 * OFF_WALL
    maze = Maze(
        name="square",
        free_space=square,
        base_pose=(tiny, 50.0, 0.0),
        goal=(100.0 - tiny, 50.0),
        goal_radius=1.0,
    )
    half = 10.0 * math.sqrt(2.0)
    expected = 2.0 * math.hypot(50.0, half)
    assert GeodesicDistance(maze)(maze.base_pose[:2]) == pytest.approx(expected, abs=1e-4)
