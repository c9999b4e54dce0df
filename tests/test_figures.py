"""What the paper's figures are drawn with."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from hrsnake_env.maze import Maze
from planners.beam_planner import CHOICES
from planners.figures import (
    CHOICE_COLOURS,
    STAGES,
    draw_choices,
    draw_relay,
    draw_stages,
    evenly_fed,
    wall_depths,
)
from planners.problem import Motion


@pytest.fixture
def maze():
    return Maze.from_corridors([(0, 0), (0, 1000), (1000, 1000)], 200.0)


def swinging(maze, *angles):
    """Return two links of 200 px, the base-side one out by 100, the tip-side one turned by an angle."""
    return Motion.from_configurations(
        np.full(len(angles), 300.0), np.array([(0.0, angle) for angle in angles]), 200.0, maze.base_pose
    )


def test_the_depth_of_a_link_is_how_far_its_end_is_in_the_wall(maze):
    angles = np.array([0.0, 0.5, np.pi / 4, -1.2, np.pi / 2])
    depths = wall_depths(swinging(maze, *angles), maze)
    expected = np.maximum(200.0 * np.abs(np.sin(angles)) - 100.0, 0.0)  # the walls are 100 px to either side
    assert depths == pytest.approx(np.column_stack([expected, np.zeros(5)]), abs=1e-9)


def test_only_the_poses_asked_for_are_looked_at(maze):
    motion = swinging(maze, 0.1, 0.8, -1.0, 1.3)
    some = np.array([3, 1])
    assert np.array_equal(wall_depths(motion, maze, some), wall_depths(motion, maze)[some])


def test_links_in_the_feeder_are_in_no_wall(maze):
    motion = Motion.from_configurations([0.0, 50.0], np.zeros((2, 4)), 200.0, maze.base_pose)
    assert not wall_depths(motion, maze).any()


@pytest.mark.parametrize("spacing", [0.5, 3.0, 1000.0])
def test_evenly_fed_poses_are_the_first_ones_at_or_beyond_each_step(spacing):
    feed = np.cumsum(np.random.default_rng(0).exponential(1.0, 300))
    poses = evenly_fed(feed, spacing)
    steps = feed[0] + spacing * np.arange(len(poses))
    assert poses[0] == 0 and np.all(feed[poses] >= steps) and np.all(feed[poses[1:] - 1] < steps[1:])
    assert feed[-1] - steps[-1] <= spacing * (1.0 + 1e-9)


def test_every_choice_has_its_colour():
    assert CHOICE_COLOURS.keys() == CHOICES.keys()
    assert len(set(CHOICE_COLOURS.values())) == len(CHOICES)


def test_a_link_has_the_colour_of_its_own_choice():
    figure, axes = plt.subplots()
    ends = np.array([(3.0, 0.0), (2.0, 0.0), (1.0, 0.0)])
    draw_choices(axes, ends, [3, 1, 0, 0])
    (links,) = axes.collections
    assert [tuple(map(tuple, np.sort(line, axis=0))) for line in links.get_segments()] == [
        ((2.0, 0.0), (3.0, 0.0)),
        ((1.0, 0.0), (2.0, 0.0)),
    ]
    wanted = plt.matplotlib.colors.to_rgba_array([CHOICE_COLOURS[3], CHOICE_COLOURS[1]])
    assert np.array_equal(links.get_colors(), wanted)
    plt.close(figure)


def test_the_relay_has_the_tips_link_on_top():
    figure, axes = plt.subplots()
    draw_relay(axes, np.array([0.0, 1.0, 2.0]), np.array([(0, 0), (2, 0), (1, 2)]))
    assert np.array_equal(axes.collections[0].get_array(), [(0, 2, 1), (0, 0, 2)])
    assert axes.yaxis_inverted()
    plt.close(figure)


def test_the_last_stage_is_the_last_pose(maze):
    figure, axes = plt.subplots()
    motion = swinging(maze, 0.1, 0.2, 0.3)
    draw_stages(axes, motion.joints)
    assert STAGES[-1][0] == 1.0
    assert np.array_equal(np.ravel(axes.lines[-1].get_data()), motion.joints[-1, -1])
    plt.close(figure)
