"""Twins: kernels of planning in space against slow versions, on random inputs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.trust.twins_space import LAWS
from planners.kernels import spatial_field, spatial_track
from planners.kernels.spatial_chords import chord_errors, place_on_path
from planners.kernels.spatial_field import add_slowest_modes, ascend_in_space, flood, neighbours_of, rise
from planners.kernels.spatial_track import deepest_chord, push_chords, resample_free, segment_at

KERNELS = (
    add_slowest_modes, ascend_in_space, chord_errors, deepest_chord, flood, neighbours_of, place_on_path,
    push_chords, resample_free, rise, segment_at, spatial_field.relax, spatial_track.relax,
)  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_a_kernel_does_what_its_slow_twin_does(law, seed):
    LAWS[law](np.random.default_rng(seed))


def test_every_kernel_here_has_a_twin():
    named = {name.split(" (")[0] for names in LAWS for name in names.split(", ")}
    assert named == {kernel.__name__ for kernel in KERNELS}


def test_at_a_hairpin_chords_are_still_one_link_long():
    # Where the path comes back on itself every place less than a link away is skipped.
    there = np.linspace(0.0, 4.0, 201)[:, None] * (1.0, 0.0, 0.0)
    points = np.concatenate([there, there[::-1] + np.array([0.0, 0.05, 0.0])])
    assert chord_errors(points, 1.0)[1] < 1.0
