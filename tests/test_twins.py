"""Kernels against slow twins in NumPy and shapely; `benchmarks.trust.kernel_twins` tries many more cases."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.trust.kernel_twins import LAWS, SHARE
from benchmarks.trust.twin_draws import TURN, star, walls_of
from benchmarks.trust.twins_rod import bare_space
from hrsnake_env.sensing import N_TIP_RAYS, TIP_RAYS, cast_rays
from planners.kernels.fed_arm import keeps_off
from planners.kernels.field_arm import find_contacts
from planners.kernels.rod_space import GAPS, update_headings

EXAMPLES = 12

pytestmark = pytest.mark.filterwarnings("ignore:invalid value encountered:RuntimeWarning")  # of GEOS


@pytest.mark.parametrize("name", LAWS)
def test_kernels_agree_with_their_twins(name):
    @settings(max_examples=max(2, EXAMPLES // SHARE.get(name, 1)))
    @given(seed=st.integers(0, 2**32 - 1))
    def holds(seed):
        LAWS[name](np.random.default_rng(seed))

    holds()


def test_headings_free_from_the_centre_count_where_the_triangle_blocks_none():
    # The post is within reach of the centre, not of all tails: what it blocks is not blocked from all.
    post = 0.01 * np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, -1.0)]) + (1.0, 0.0)
    corners = 0.5 * np.column_stack([np.cos(TURN * np.arange(3) / 3), np.sin(TURN * np.arange(3) / 3)])
    one, turn = np.zeros(1, dtype=np.int64), np.zeros((1, GAPS, 2))
    for heading in np.linspace(0.0, TURN, 13):
        c, s = math.cos(heading), math.sin(heading)
        spun = np.array([[c, s], [-s, c]])
        space = bare_space([post @ spun])._replace(
            counts=np.array([3, 1]), vertices=corners @ spun, triangles=np.array([[0, 1, 2]]),
            neighbours=np.full((1, 3), -1), changed=np.array([True]), centres=np.zeros((1, 2)),
            sizes=np.zeros(1), possible=turn.copy(), exact=turn.copy(), n_possible=one.copy(),
            n_exact=one.copy(), around=np.zeros((1, GAPS), dtype=np.int64),
        )  # fmt: skip
        update_headings(space, 1.02, True)
        assert space.n_possible[0] == 1 and space.n_exact[0] == 1


def test_segments_in_line_that_overlap_do_not_keep_off_each_other():
    a, b, c, d = np.array([[0.0, 0.0], [2.0, 1.0], [1.0, 0.5], [3.0, 1.5]])
    assert not keeps_off(a, b, c, d, 0.0)
    assert keeps_off(a, c, b, d, 0.0)


def test_the_nearest_wall_counts_where_there_is_room_for_no_contact():
    points, wall = np.array([[1.0, 0.0], [0.0, 0.0]]), np.array([[[0.5, 0.2], [0.5, 3.0]]])
    for room in (0, 1, 8):
        assert find_contacts(points, 1, wall, 1.0, np.empty((room, 6)))[1] == pytest.approx(0.2)


def test_no_ray_slips_through_a_corner():
    rays, joints, state = np.empty(N_TIP_RAYS + 2), np.zeros((2, 2)), np.zeros((1, 6))
    for seed in range(60):
        ring = star(np.random.default_rng(seed), n=9)
        for corner in ring:
            state[0, 2] = math.atan2(corner[1], corner[0]) - TIP_RAYS[0]
            cast_rays(state, joints, 1, walls_of(ring).reshape(-1, 4), 20.0, rays)
            assert rays[0] == pytest.approx(np.hypot(*corner) / 20.0)
