"""Twins: kernels of feeding, rays and grids against slow versions, on random and degenerate inputs."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.trust.twins_feeding import LAWS
from planners.feeding import feed
from planners.kernels.feeding import (
    DONE,
    MEETS,
    configurations,
    feed_along,
    feeder_axis,
    first_hit,
    first_self_crossing,
    links_at_end,
)
from planners.kernels.feeding_sweep import directions, start_of_link, sweep_chords
from planners.kernels.grid import ascend, scan_walls
from planners.kernels.rays import cast_rays

KERNELS = (
    ascend, cast_rays, configurations, directions, feed_along, feeder_axis, first_hit, first_self_crossing,
    links_at_end, scan_walls, start_of_link, sweep_chords,
)  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_a_kernel_does_what_its_slow_twin_does(law, seed):
    LAWS[law](np.random.default_rng(seed))


def test_every_kernel_here_has_a_twin():
    named = {name for names in LAWS for name in names.split(", ")}
    assert named == {kernel.__name__ for kernel in KERNELS}


@pytest.mark.parametrize("seed", range(20))
def test_rays_aimed_at_a_corner_between_two_walls_end_there(seed):
    LAWS["cast_rays"](np.random.default_rng(seed))


def test_a_node_on_any_corner_of_a_hole_is_not_inside():
    rings = [[(0, 0), (10, 0), (10, 10), (0, 10)], [(3, 3), (3, 6), (6, 6), (6, 3)]]
    walls = np.array(
        [(a, b) for ring in rings for a, b in zip(ring, ring[1:] + ring[:1], strict=True)], float
    )
    inside, _, _ = scan_walls(walls, -3.0, -3.0, 1.0, 17, 17)
    assert not inside[[6, 6, 9, 9], [6, 9, 6, 9]].any()
    assert inside[5, 5] and inside[10, 10]


@pytest.mark.parametrize("n_points", [1, 2])
def test_a_track_of_one_place_is_fed_with_walls_too(n_points):
    wall = np.array([[(5.0, -1.0), (5.0, 1.0)]])
    fed = feed(np.zeros((n_points, 2)), 1.0, np.zeros(3), walls=wall)
    assert fed.ending == DONE
    np.testing.assert_array_equal(fed.poses, [[(-1.0, 0.0), (0.0, 0.0)]])


@pytest.mark.parametrize("reach", [0.1, 0.24, 0.6, 1.0])
def test_a_wall_across_a_track_shorter_than_a_link_is_met(reach):
    wall = np.array([[(0.95 * reach, -1.0), (0.95 * reach, 1.0)]])
    track = np.array([(0.0, 0.0), (reach, 0.0)])
    assert feed(track, 1.0, np.zeros(3), walls=wall).ending == MEETS
    assert feed(track, 1.0, np.zeros(3), walls=wall + np.array([1.0, 0.0])).ending == DONE


@pytest.mark.parametrize("offset", [1e5, 1e6, 1e8])
def test_a_straight_arm_is_fed_however_far_from_the_origin(offset):
    for heading in np.linspace(0.1, 3.0, 12):
        base_pose = np.array([0.77 * offset, 0.31 * offset, heading])
        along = np.array([math.cos(heading), math.sin(heading)])
        track = base_pose[:2] + np.array([[0.0], [1.0], [2.5]]) * along
        assert feed(track, 1.0, base_pose).ending == DONE
