"""Twins: kernels of the track planner and of the sweep against slow versions, on random inputs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.trust.twins_track import LAWS
from planners.kernels.sweep import blocked_chords, chain_length, grow_track, pose_joints, thin_track
from planners.kernels.track import chord_rows, find_chords, find_corners, goal_row, resample
from planners.kernels.track_solve import find_normals, project_rows, solve_rows
from planners.kernels.track_walls import (
    add_row,
    apply_move,
    edge_rows,
    edges_are_free,
    list_walls,
    longest_edge,
    sample_rows,
    segments_meet,
    wall_between,
)

KERNELS = (
    add_row, apply_move, blocked_chords, chain_length, chord_rows, edge_rows, edges_are_free, find_chords,
    find_corners, find_normals, goal_row, grow_track, list_walls, longest_edge, pose_joints, project_rows,
    resample, sample_rows, segments_meet, solve_rows, thin_track, wall_between,
)  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_a_kernel_does_what_its_slow_twin_does(law, seed):
    LAWS[law](np.random.default_rng(seed))


def test_every_kernel_here_has_a_twin():
    named = {name for names in LAWS for name in names.split(", ")}
    assert named == {kernel.__name__ for kernel in KERNELS}


@pytest.mark.parametrize("seed", [139, 236, 322, 372])
def test_walls_far_from_both_ends_of_a_long_edge_are_seen(seed):
    LAWS["edges_are_free"](np.random.default_rng(seed))
