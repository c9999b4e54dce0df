"""Twins: each kernel against a slow version in NumPy or shapely."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, box

from hrsnake_env.mazes import MAZES, fig19
from planners.kernels.grid import scan_walls
from planners.kernels.rays import cast_rays
from planners.kernels.rod import free_directions, nearest_gap

PLACES = st.floats(-50.0, 50.0)
POINTS = st.tuples(PLACES, PLACES)
WALLS = st.lists(st.tuples(POINTS, POINTS), min_size=0, max_size=8)


def gaps_of(point, length, walls, pad=0.0):
    """Return the free intervals of a rod as a list of (start, end)."""
    walls = np.asarray(walls, dtype=np.float64).reshape(-1, 2, 2)
    blocked, gaps = np.empty((len(walls) + 1, 2)), np.empty((len(walls) + 1, 2))
    n = free_directions(float(point[0]), float(point[1]), float(length), walls, pad, blocked, gaps)
    return [tuple(gap) for gap in gaps[:n]]


def is_in_gap(direction, gaps, slack):
    """Tell whether a direction is in a gap (True), in none (False), or too near to an end to say (None)."""
    for start, end in gaps:
        shift = (direction - start) % (2 * math.pi)
        if slack < shift < end - start - slack:
            return True
        if shift <= slack or shift >= 2 * math.pi - slack or abs(shift - (end - start)) <= slack:
            return None
    return False


@given(POINTS, st.floats(1.0, 60.0), WALLS, st.floats(-math.pi, math.pi))
def test_a_direction_is_free_exactly_when_the_rod_meets_no_wall(point, length, walls, direction):
    end = (point[0] + length * math.cos(direction), point[1] + length * math.sin(direction))
    rod = LineString([point, end])
    walls = [wall for wall in walls if Point(wall[0]).distance(Point(wall[1])) > 1e-6]
    distance = min((rod.distance(LineString(wall)) for wall in walls), default=math.inf)
    assume(all(Point(point).distance(LineString(wall)) > 1e-6 for wall in walls))
    free = is_in_gap(direction, gaps_of(point, length, walls), slack=1e-6)
    if free is True:
        assert distance > 0.0
    elif free is False:
        assert distance < 1e-4


@given(POINTS, st.floats(1.0, 60.0), WALLS)
def test_free_intervals_are_apart_and_less_than_a_turn(point, length, walls):
    gaps = gaps_of(point, length, walls)
    assert all(end > start for start, end in gaps)
    assert sum(end - start for start, end in gaps) <= 2 * math.pi + 1e-12
    assert all(after[0] >= before[1] for before, after in pairwise(gaps))


def test_a_rod_between_two_walls_is_free_in_the_hand_computed_intervals():
    # A rod of length 2 pivots midway between two walls at distance 1: free within 30 degrees of the walls.
    gaps = gaps_of((0, 0), 2.0, [[(-9, 1), (9, 1)], [(-9, -1), (9, -1)]], pad=0.01)
    third = math.pi / 6 - 0.01
    ends = sorted((start % (2 * math.pi), end - start) for start, end in gaps)
    assert ends[0] == pytest.approx((math.pi - third, 2 * third))
    assert ends[1] == pytest.approx((2 * math.pi - third, 2 * third))


def test_without_walls_every_direction_is_free():
    assert gaps_of((0, 0), 5.0, []) == [(0.0, 2 * math.pi)]


def test_nearest_gap_is_moved_beside_the_direction():
    gaps = np.array([[0.5, 1.0], [3.0, 3.5]])
    turn = 2 * math.pi
    assert nearest_gap(0.7, gaps, 2) == (0.5, 1.0)
    assert nearest_gap(5 * turn + 1.2, gaps, 2) == pytest.approx((5 * turn + 0.5, 5 * turn + 1.0))
    assert nearest_gap(-0.5, gaps, 2) == (0.5, 1.0)
    assert nearest_gap(-turn + 2.9, gaps, 2) == pytest.approx((3.0 - turn, 3.5 - turn))


@given(POINTS, st.floats(-math.pi, math.pi), st.integers(0, len(MAZES) - 1))
def test_rays_end_at_the_first_wall(offset, direction, number):
    maze = list(MAZES.values())[number]()
    x, y, heading = maze.base_pose
    ahead = np.array([100.0 + offset[0], 0.8 * offset[1]])
    origin = np.array([x, y]) + ahead @ [
        [math.cos(heading), math.sin(heading)],
        [-math.sin(heading), math.cos(heading)],
    ]
    assume(maze.free_space.contains(Point(origin)))
    along = np.array([[math.cos(direction), math.sin(direction)]])
    length = np.empty(1)
    cast_rays(origin[None], along, maze.walls, length)
    ray = LineString([origin, origin + 1e4 * along[0]])
    expected = Point(origin).distance(ray.intersection(maze.free_space.boundary))
    assert length[0] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("name", MAZES)
def test_grid_nodes_are_inside_exactly_where_shapely_says(name):
    maze = MAZES[name]()
    x_min, y_min, x_max, y_max = maze.free_space.bounds
    cell, x0, y0 = 23.7, x_min - 31.3, y_min - 29.9
    nx, ny = int((x_max - x0) / cell) + 3, int((y_max - y0) / cell) + 3
    inside, blocked_x, blocked_y = scan_walls(maze.walls, x0, y0, cell, nx, ny)
    x, y = np.meshgrid(x0 + cell * np.arange(nx), y0 + cell * np.arange(ny))
    np.testing.assert_array_equal(inside, shapely.contains_xy(maze.free_space, x, y))
    nodes = np.stack([x, y], axis=-1)
    for blocked, near, far in (
        (blocked_x[:, :-1], nodes[:, :-1], nodes[:, 1:]),
        (blocked_y[:-1], nodes[:-1], nodes[1:]),
    ):
        edges = shapely.linestrings(np.stack([near, far], axis=-2))
        np.testing.assert_array_equal(blocked, shapely.intersects(maze.free_space.boundary, edges))


def test_a_wall_thinner_than_a_cell_still_blocks():
    walls = np.array([[(0.4, -5.0), (0.4, 5.0)], [(0.5, 5.0), (0.5, -5.0)]])
    inside, blocked_x, _ = scan_walls(walls, -3.0, -7.0, 1.0, 7, 15)
    assert not inside.any()
    assert blocked_x[2:12, 3].all()


def test_the_pad_keeps_the_rod_off_the_walls():
    walls = fig19().walls
    for direction in (start for start, _ in gaps_of((0.0, 1400.0), 430.0, walls, pad=3e-4)):
        end = (430 * math.cos(direction), 1400 + 430 * math.sin(direction))
        assert fig19().free_space.contains(LineString([(0.0, 1400.0), end]))
    assert not fig19().free_space.contains(box(90, 0, 110, 10))
