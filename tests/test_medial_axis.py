"""Laws of the medial axis as a graph."""

import math

import numpy as np
import pytest
import shapely

from hrsnake_env.maze import Maze
from hrsnake_env.mazes import clutter_hall, fig19, random_corridor
from planners.inset import inset_maze
from planners.medial_axis import chains, medial_axis

FINEST = 0.5
"""In px; the mazes here have no narrower gaps."""


def axis_of(maze, price=np.ones_like):
    return medial_axis(maze, np.stack([maze.base_pose[:2], maze.goal]), price, FINEST)


def number_of_loops(axis):
    """Links less vertices, plus one for each part: what is left when a spanning tree is taken away."""
    n_vertices = sum(1 for near in axis.links if near)
    seen, n_parts = set(), 0
    for start, near in enumerate(axis.links):
        if not near or start in seen:
            continue
        n_parts += 1
        stack = [start]
        while stack:
            vertex = stack.pop()
            if vertex not in seen:
                seen.add(vertex)
                stack += axis.links[vertex]
    return sum(map(len, axis.links)) // 2 - n_vertices + n_parts


def disc_field(quad_segs):
    discs = [
        shapely.Point(200 + 250 * i, 175 + 260 * j).buffer(80, quad_segs=quad_segs)
        for i in range(7)
        for j in range(5)
    ]
    return Maze(
        name="disc field",
        free_space=shapely.box(0, 0, 2000, 1400).difference(shapely.union_all(discs)),
        base_pose=(5.0, 565.0, 0.0),
        goal=(1950.0, 700.0),
        goal_radius=5.0,
    )


@pytest.mark.parametrize(
    "maze",
    [
        fig19(),
        random_corridor(0),
        *(clutter_hall(seed) for seed in range(12)),
        inset_maze(clutter_hall(0), 15.0),
        disc_field(quad_segs=16),
    ],
    ids=lambda maze: maze.name,
)
def test_it_has_as_many_loops_as_the_free_space_has_holes(maze):
    assert number_of_loops(axis_of(maze)) == len(maze.free_space.interiors)


@pytest.mark.parametrize("seed", range(4))
def test_its_links_lie_in_the_free_space(seed):
    maze = clutter_hall(seed)
    axis = axis_of(maze)
    pairs = [(a, b) for a, near in enumerate(axis.links) for b in near if a < b]
    assert shapely.covers(maze.free_space, shapely.linestrings(axis.places[np.array(pairs)])).all()


def test_a_long_needle_is_no_hole_in_the_axis():
    """Its tip is sharper than 2 degrees: sites on its two sides must stand side by side."""
    hall = shapely.box(0, 0, 1000, 600) - shapely.Polygon([(200, 300), (800, 290), (800, 310)])
    maze = Maze(
        name="needle", free_space=hall, base_pose=(5.0, 300.0, 0.0), goal=(950.0, 300.0), goal_radius=5.0
    )
    assert number_of_loops(axis_of(maze)) == 1


def test_a_corridor_is_one_chain_along_its_middle():
    maze = Maze.from_corridors([(0, 0), (0, 1000)], 100.0)
    (chain,) = chains(axis_of(maze))
    places = axis_of(maze).places[chain]
    # At its ends the axis forks into the corners.
    assert np.allclose(places[(places[:, 1] > 60.0) & (places[:, 1] < 940.0), 0], 0.0, atol=1e-6)
    assert np.allclose(sorted((places[0, 1], places[-1, 1])), (5.0, 950.0))


def test_links_cost_their_length_times_the_price_of_their_clearance():
    maze = Maze.from_corridors([(0, 0), (0, 1000)], 100.0)
    axis = axis_of(maze, price=lambda clearance: 1.0 / clearance)
    middle = [k for k, place in enumerate(axis.places) if axis.links[k] and 200.0 < place[1] < 800.0]
    for a in middle:
        for b, cost in axis.links[a].items():
            assert cost == pytest.approx(math.dist(axis.places[a], axis.places[b]) / 50.0, rel=0.1)
