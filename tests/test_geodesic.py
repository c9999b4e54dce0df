"""Laws of the distance to the goal through the free space."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsnake_env.errors import InputError
from hrsnake_env.geodesic import GeodesicDistance
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import MAZES, fig19

LONGER = 1.03
"""Ways on the grid are at most 2.8 % longer than straight ones."""

FIG19 = fig19()
DISTANCE = GeodesicDistance(FIG19)
CELL = FIG19.size / 200


def shortest_way(point):
    """From a point in fig19's left leg: round both corners of the wall's end."""
    corners = [np.asarray(point), np.array([100.0, 1400.0]), np.array([140.0, 1400.0]), FIG19.goal]
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum())


@given(st.floats(-80.0, 80.0), st.floats(20.0, 1300.0))
@settings(max_examples=100, deadline=None)
def test_the_way_round_a_wall_is_that_round_its_corners(x, y):
    way = shortest_way((x, y))
    assert way - CELL <= DISTANCE((x, y)) <= LONGER * way + 2 * CELL


@given(st.floats(150.0, 330.0), st.floats(30.0, 1300.0))
@settings(max_examples=100, deadline=None)
def test_in_sight_of_the_goal_it_is_the_straight_line(x, y):
    straight = math.hypot(x - FIG19.goal[0], y - FIG19.goal[1])
    assert straight - CELL <= DISTANCE((x, y)) <= LONGER * straight + 2 * CELL


@given(st.floats(-90.0, 90.0), st.floats(10.0, 1350.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
@settings(max_examples=100, deadline=None)
def test_a_small_step_changes_it_little(x, y, dx, dy):
    change = abs(DISTANCE((x, y)) - DISTANCE((x + dx, y + dy)))
    assert change <= 1.5 * math.hypot(dx, dy) + 1e-9


@pytest.mark.parametrize("name", MAZES)
def test_it_is_finite_from_the_base_of_every_named_maze(name):
    maze = Maze.load(name)
    distance = GeodesicDistance(maze)(maze.base_pose[:2])
    assert distance >= np.linalg.norm(maze.base_pose[:2] - maze.goal) - maze.size / 100
    assert math.isfinite(distance)


def test_it_is_infinite_inside_a_wall():
    assert DISTANCE((120.0, 700.0)) == math.inf


def test_a_wall_thinner_than_a_cell_is_still_a_wall():
    halls = shapely.box(0, 0, 400, 2000) - shapely.box(199, -1, 201, 1800)
    maze = Maze(
        name="halls",
        free_space=halls,
        base_pose=(100.0, 5.0, math.pi / 2),
        goal=(300.0, 100.0),
        goal_radius=9.0,
    )
    distance = GeodesicDistance(maze)
    assert distance((150.0, 100.0)) > 3000.0
    assert distance((250.0, 100.0)) < 100.0


def test_a_way_narrower_than_a_cell_is_found_on_a_finer_grid():
    maze = Maze.from_corridors([(0, 0), (0, 3000)], 6.0)
    assert GeodesicDistance(maze)(maze.base_pose[:2]) == pytest.approx(2992.0, abs=10.0)


def test_a_way_too_narrow_for_any_grid_is_named():
    maze = Maze.from_corridors([(0, 0), (1000, 3000)], 0.05)
    with pytest.raises(InputError, match="Expected a way to the goal of maze 'corridors' that is wider than"):
        GeodesicDistance(maze)
