"""Laws of section 2 of the paper: potential, path, beams, corners."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import affinity

from hrsnake_env.maze import Maze
from hrsnake_env.mazes import LEGS, MAZES, fig19
from planners.inset import inset_maze
from planners.path import arclength, curvature, resampled, windowed
from planners.potential import laplace_potential, passage_width
from planners.survey import survey

TURNS = {"N": 0, "E": 1, "S": 2, "W": 3}


def turned(maze, degrees):
    """Return a maze turned about the origin."""
    angle = math.radians(degrees)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return Maze(
        name=maze.name,
        free_space=affinity.rotate(maze.free_space, degrees, origin=(0, 0)),
        base_pose=np.array([*(turn @ maze.base_pose[:2]), maze.base_pose[2] + angle]),
        goal=turn @ maze.goal,
        goal_radius=maze.goal_radius,
    )


@pytest.mark.parametrize("name", MAZES)
def test_the_potential_is_harmonic_and_between_wall_and_goal(name):
    maze = MAZES[name]()
    potential = laplace_potential(maze)
    u = potential.u
    assert u.min() == 0.0 and u.max() == 1.0
    x = np.rint((maze.goal - potential.origin) / potential.cell).astype(int)
    assert u[x[1], x[0]] == 1.0
    blocked_x, blocked_y = potential.blocked_x, potential.blocked_y
    around = np.zeros_like(u)
    around[:, :-1] += np.where(blocked_x, 0.0, np.roll(u, -1, axis=1))[:, :-1]
    around[:, 1:] += np.where(np.roll(blocked_x, 1, axis=1), 0.0, np.roll(u, 1, axis=1))[:, 1:]
    around[:-1] += np.where(blocked_y, 0.0, np.roll(u, -1, axis=0))[:-1]
    around[1:] += np.where(np.roll(blocked_y, 1, axis=0), 0.0, np.roll(u, 1, axis=0))[1:]
    free = (u > 0.0) & (u < 1.0)
    np.testing.assert_allclose(around[free] / 4, u[free], rtol=1e-9)  # relative: u spans a hundred decades


def test_the_potential_decays_as_the_corridors_slowest_mode():
    # In a corridor of n cells, u falls by a factor x + sqrt(x^2 - 1), x = 2 - cos(pi / n), per cell.
    maze = Maze.from_corridors([(0, 0), (0, 20_000)], 200.0)
    potential = laplace_potential(maze, width=200.0)
    column = potential.u[:, potential.u.shape[1] // 2]
    n = 200.0 / potential.cell
    x = 2.0 - math.cos(math.pi / n)
    # Rows 300 to 900 are hundreds of cells from both ends: only the slowest mode is left.
    ratios = column[301:901] / column[300:900]
    np.testing.assert_allclose(ratios, x + math.sqrt(x * x - 1.0), rtol=1e-9)
    assert column[300] < 1e-90


@pytest.mark.parametrize("name", MAZES)
def test_paths_lead_from_base_to_goal_through_the_free_space(name):
    maze = MAZES[name]()
    path = survey(maze).path
    np.testing.assert_allclose(path.points[0], maze.base_pose[:2], atol=1e-9)
    np.testing.assert_allclose(path.points[-1], maze.goal, atol=1e-9)
    assert shapely.covers(maze.free_space, shapely.LineString(path.points))
    assert shapely.covers(maze.free_space, shapely.LineString(path.raw))
    assert path.length == pytest.approx(arclength(path.raw)[-1], rel=0.03)


@pytest.mark.parametrize("name", ["L", "U200", "S400", "stairs", "spiral"])
def test_every_turn_of_the_corridor_is_a_corner_with_its_side(name):
    legs = [TURNS[leg[0]] for leg in LEGS[name].split()]
    expected = ["right" if (b - a) % 4 == 1 else "left" for a, b in pairwise(legs)]
    assert [corner.name for corner in survey(MAZES[name]()).corners] == expected


def test_both_turns_round_a_thin_wall_are_one_corner():
    corners = survey(fig19()).corners
    assert [corner.name for corner in corners] == ["right"]
    assert corners[0].place[1] == pytest.approx(1400, abs=1)


@pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0])
def test_corners_and_length_do_not_change_when_the_maze_is_turned(degrees):
    straight, slanted = survey(fig19()), survey(turned(fig19(), degrees))
    assert [c.turn for c in straight.corners] == [c.turn for c in slanted.corners]
    assert slanted.path.length == pytest.approx(straight.path.length, rel=0.01)


@pytest.mark.parametrize("name", ["fig19", "stairs"])
def test_beams_are_perpendicular_and_end_on_walls(name):
    geometry = survey(MAZES[name]())
    boundary = geometry.maze.free_space.boundary
    for ends, side in ((geometry.beams.left, 1), (geometry.beams.right, -1)):
        beams = ends - geometry.path.points
        np.testing.assert_allclose((beams * geometry.path.tangents).sum(axis=1), 0.0, atol=1e-9)
        cross = geometry.path.tangents[:, 0] * beams[:, 1] - geometry.path.tangents[:, 1] * beams[:, 0]
        assert (side * cross > 0.0).all()
        assert shapely.distance(boundary, shapely.points(ends)).max() < 1e-9


def test_the_passage_width_is_that_of_the_narrowest_place():
    maze = Maze.from_corridors(
        [[(0, 0), (0, 500)], [(0, 490), (0, 700)], [(0, 690), (0, 1500)]], [200, 60, 200]
    )
    assert passage_width(maze) == pytest.approx(60, rel=0.02)


def test_arclength_and_curvature_of_a_circle():
    angle = np.linspace(0, math.pi, 200)
    points = 50.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert arclength(points)[-1] == pytest.approx(50 * math.pi, rel=1e-4)
    np.testing.assert_allclose(curvature(points)[8:-8], 1 / 50, rtol=1e-4)
    np.testing.assert_allclose(curvature(points[::-1])[8:-8], -1 / 50, rtol=1e-4)


def test_windowing_keeps_the_ends_and_straight_lines():
    line = np.column_stack([np.linspace(0, 9, 40), np.linspace(0, 3, 40)])
    np.testing.assert_allclose(windowed(line, 6), line, atol=1e-12)
    zigzag = line + 0.1 * np.column_stack([np.zeros(40), (-1.0) ** np.arange(40)])
    smooth = windowed(zigzag, 6)
    np.testing.assert_allclose(smooth[[0, -1]], zigzag[[0, -1]], atol=1e-12)
    np.testing.assert_allclose(
        np.abs(smooth - line)[6:-6, 1], 0.1 / 13, atol=1e-12
    )  # 13 points, one left over
    np.testing.assert_allclose(windowed(zigzag, 0), zigzag, atol=1e-12)


def test_resampling_keeps_the_ends_and_spaces_evenly():
    points = resampled(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]]), 0.5)
    np.testing.assert_allclose(points[[0, -1]], [[0, 0], [3, 4]], atol=1e-12)
    assert np.diff(arclength(points)).max() <= 0.5 + 1e-12


def test_a_line_free_between_grown_walls_is_a_capsule_free_between_the_walls():
    maze, radius = fig19(), 20.0
    grown = inset_maze(maze, radius).free_space
    ahead = grown.intersection(shapely.box(-1e3, 50, 1e3, 2e3))
    assert shapely.covers(maze.free_space, ahead.buffer(radius * (1 - 1e-9), quad_segs=64))
    assert grown.area > 0.98 * maze.free_space.buffer(-radius, quad_segs=64).area
    assert inset_maze(maze, 0.0) is maze
    assert inset_maze(maze, 120.0) is None
