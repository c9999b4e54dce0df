"""Laws of the routes and of their homotopy classes."""

import itertools
import math
from collections import Counter

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString

from hrsnake_env.geodesic import GeodesicDistance
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import MAZES, clutter_hall, random_corridor
from planners.inset import inset_maze
from planners.routes import routes, signature
from planners.survey import survey

LINK = 150.0

HALL = clutter_hall(0)


def first(n, maze, link_length=LINK, **kwargs):
    return list(itertools.islice(routes(maze, link_length, **kwargs), n))


def one_pillar(gap=30.0):
    """Build a hall: below the pillar is a short way, as wide as the gap, above it a wide detour."""
    return Maze(
        name="one pillar",
        free_space=shapely.box(0, 0, 1000, 600) - shapely.box(400, gap, 600, 350),
        base_pose=(5.0, 100.0, 0.0),
        goal=(950.0, 100.0),
        goal_radius=10.0,
    )


def moved(maze, angle, scale):
    """Rotate and scale a maze."""
    turn = scale * np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    return Maze(
        name=maze.name,
        free_space=shapely.transform(maze.free_space, lambda xy: xy @ turn),
        base_pose=(*(maze.base_pose[:2] @ turn), maze.base_pose[2] + angle),
        goal=maze.goal @ turn,
        goal_radius=scale * maze.goal_radius,
    )


# Routes


@pytest.mark.parametrize("maze", [Maze.load("fig19"), *map(random_corridor, range(5))], ids=lambda m: m.name)
def test_without_holes_there_is_one_route(maze):
    (route,) = routes(maze, LINK)
    assert route.signature == ()
    assert maze.free_space.covers(LineString(route.points))


def test_one_pillar_makes_two_routes():
    one, other = routes(one_pillar(), LINK)
    assert {len(one.signature), len(other.signature)} == {0, 1}


@pytest.mark.parametrize("seed", range(6))
def test_routes_of_a_hall_lead_to_the_goal_by_different_ways(seed):
    maze = clutter_hall(seed)
    found = first(10, maze)
    assert len(found) == 10
    for route in found:
        assert (route.points[0] == maze.base_pose[:2]).all()
        assert (route.points[-1] == maze.goal).all()
        assert maze.free_space.covers(LineString(route.points))
        assert route.signature == signature(maze, route.points)
        assert route.length == pytest.approx(LineString(route.points).length)
    assert len({route.signature for route in found}) == 10
    assert min(route.length for route in found) <= 1.3 * GeodesicDistance(maze)(maze.base_pose[:2])


@pytest.mark.parametrize("name", MAZES)
def test_a_route_is_not_much_longer_than_need_be_in_the_named_mazes(name):
    maze = Maze.load(name)
    route = next(routes(maze, LINK))
    assert route.length <= 1.2 * GeodesicDistance(maze)(maze.base_pose[:2])


@pytest.mark.parametrize("seed", range(3))
def test_the_surveyed_path_of_a_route_is_free_and_of_its_class(seed):
    maze = clutter_hall(seed)
    for route in first(4, maze):
        path = survey(maze, route=route.points).path
        assert maze.free_space.covers(LineString(path.points))
        assert signature(maze, path.points) == route.signature


def test_the_first_link_goes_straight_ahead():
    for route in first(5, HALL):
        ahead = route.points[route.points[:, 0] - HALL.base_pose[0] < 0.3 * LINK]
        assert len(ahead) > 1
        assert np.allclose(ahead[:, 1], HALL.base_pose[1], atol=0.05 * LINK)


def test_the_way_of_the_potential_is_among_the_first_routes():
    """As in these halls; the Laplace path knows nothing of links, so no more is to be expected."""
    for seed in range(6):
        maze = clutter_hall(seed)
        assert signature(maze, survey(maze).path.points) in {route.signature for route in first(4, maze)}


def test_a_wide_detour_comes_before_a_short_cut_too_narrow_for_the_link():
    long_link, short_link = first(2, one_pillar(), 150.0), first(2, one_pillar(), 5.0)
    assert long_link[0].length > long_link[1].length
    assert long_link[0].width > 90.0
    assert short_link[0].length < short_link[1].length
    assert short_link[0].width < 30.0


def test_thick_links_lose_the_narrow_ways():
    assert len(first(3, one_pillar(), link_radius=14.0)) == 2
    (detour,) = first(3, one_pillar(), link_radius=16.0)
    assert detour.points[:, 1].max() > 350.0
    assert inset_maze(one_pillar(), 16.0).free_space.covers(LineString(detour.points))


def test_links_too_thick_for_every_way_have_no_route():
    assert first(1, one_pillar(), link_radius=126.0) == []


def test_routes_of_thick_links_are_named_by_the_grown_walls():
    grown = inset_maze(HALL, 15.0)
    for route in first(4, HALL, link_radius=15.0):
        assert grown.free_space.covers(LineString(route.points))
        assert signature(grown, route.points) == route.signature


@pytest.mark.parametrize(("angle", "scale"), [(1.0, 1.0), (0.0, 0.01), (-2.0, 37.0)])
def test_scale_and_rotation_change_nothing(angle, scale):
    other = moved(HALL, angle, scale)
    lengths = [route.length for route in first(6, HALL)]
    # Rounding may put a site elsewhere, which moves the line by less than a spacing of its points.
    assert [route.length / scale for route in first(6, other, scale * LINK)] == pytest.approx(
        lengths, rel=5e-3
    )


def test_a_goal_within_the_first_link_is_approached_without_turning_back():
    maze = Maze(
        name="near goal",
        free_space=shapely.box(0, 0, 1000, 200),
        base_pose=(5.0, 100.0, 0.0),
        goal=(80.0, 100.0),
        goal_radius=5.0,
    )
    (route,) = routes(maze, LINK)
    assert route.length == pytest.approx(75.0, rel=0.05)


def test_the_points_of_a_route_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        first(1, HALL)[0].points[0] = 0.0


# Signatures


def winding_numbers(maze, loop):
    """How often a closed line goes round a point in each hole, by the angles it sweeps: the slow twin."""
    inside = [ring_polygon.representative_point() for ring_polygon in holes(maze)]
    numbers = []
    for point in inside:
        x, y = (loop - (point.x, point.y)).T
        angles = np.unwrap(np.arctan2(y, x), discont=math.pi)
        numbers.append(round((angles[-1] - angles[0]) / (2.0 * math.pi)))
    return numbers


def holes(maze):
    return [shapely.Polygon(ring) for ring in maze.free_space.interiors]


def test_a_closed_line_counts_its_turns_round_each_hole():
    found = first(8, HALL)
    for one, other in itertools.combinations(found, 2):
        loop = np.concatenate([one.points, other.points[::-1]])
        count = Counter()
        for letter in signature(HALL, loop):
            count[abs(letter) - 1] += int(math.copysign(1, letter))
        assert [count[k] for k in range(len(holes(HALL)))] == winding_numbers(HALL, loop)


@given(st.integers(0, 7), st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_signature_does_not_change_when_a_line_is_wiggled(number, seed):
    route = ROUTES[number]
    line = np.repeat(route.points, 2, axis=0)
    away = np.random.default_rng(seed).normal(size=line.shape)
    line[1:-1] += 0.2 * route.width * (away / np.linalg.norm(away, axis=1)[:, None])[1:-1]
    if HALL.free_space.covers(LineString(line)):  # as nearly always: only next to the base it is tight
        assert signature(HALL, line) == route.signature


@given(st.integers(0, 7), st.floats(0.0, 1.0))
def test_there_and_back_cancels(number, share):
    points = ROUTES[number].points
    turn = 1 + int(share * (len(points) - 1))
    spike = np.concatenate([points[:turn], points[:turn][::-1], points])
    assert signature(HALL, points[:turn].tolist() + points[:turn][::-1].tolist()) == ()
    assert signature(HALL, spike) == ROUTES[number].signature


def test_the_reversed_line_has_the_inverse_word():
    for route in ROUTES:
        assert signature(HALL, route.points[::-1]) == tuple(-k for k in reversed(route.signature))


def test_a_turn_round_a_pillar_changes_the_class():
    maze = one_pillar()
    way = np.array([(5, 100), (200, 100), (300, 500), (700, 500), (700, 15), (300, 15)], dtype=float)
    over = np.concatenate([way[:4], maze.goal[None]])
    round_once = np.concatenate([way, way[2:4], maze.goal[None]])
    assert maze.free_space.covers(LineString(round_once))
    assert len(signature(maze, round_once)) == len(signature(maze, over)) + 1


def test_order_of_crossings_on_one_segment_counts():
    """One long segment over many rays reads as the same segment in pieces."""
    line = np.array([[-10.0, 700.0], [2010.0, 700.0]])
    pieces = np.column_stack([np.linspace(-10.0, 2010.0, 5000), np.full(5000, 700.0)])
    assert signature(HALL, line) == signature(HALL, pieces)


ROUTES = first(8, HALL)
