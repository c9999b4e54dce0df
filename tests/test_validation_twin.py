"""The checker and a second one, written from scratch, agree; planted faults are named, and no other."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import box
from test_validation import corridor, hall, kinds, straight_in

from benchmarks.trust.agreement import disagreements, shipped_motions
from benchmarks.trust.motions import draw_case
from benchmarks.trust.planted import KINDS, NAMED, good_motion, plant
from benchmarks.trust.spatial_agreement import draw_spatial_case, spatial_disagreements
from hrsnake_env.arm import ArmSpec
from planners.problem import Motion
from planners.spatial.problem import SpatialMotion
from planners.spatial.rooms import load_workspace
from planners.spatial.validation import validate as validate_in_space
from planners.validation import validate

SEEDS = st.integers(0, 2**32)


@settings(max_examples=200)
@given(seed=SEEDS)
def test_checker_and_twin_agree_on_every_figure_and_verdict(seed):
    case = draw_case(np.random.default_rng(seed))
    assert not list(disagreements(case.motion, case.maze, case.arm, case.cores))


@pytest.mark.parametrize("number", [2227, 2559, 6624])
def test_they_agree_where_they_once_did_not(number):
    """A joint at the base but for rounding; links along walls, but for rounding."""
    case = draw_case(np.random.default_rng([7, number]))
    assert not list(disagreements(case.motion, case.maze, case.arm, case.cores))


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=8)
@given(seed=SEEDS, excess=st.floats(0.02, 0.5), above=st.booleans())
def test_a_planted_fault_is_named_exactly_if_it_is_over_what_is_allowed(kind, seed, excess, above):
    share = 1.0 + excess if above else 1.0 - excess
    report = validate(*plant(np.random.default_rng(seed), kind, share))
    assert (NAMED.get(kind, kind) in kinds(report)) is above


@settings(max_examples=10)
@given(seed=SEEDS)
def test_what_faults_are_planted_in_is_valid(seed):
    assert validate(*good_motion(np.random.default_rng(seed))).valid


def test_motions_of_the_projects_own_planners_are_valid_to_the_twin_too():
    for name, motion, maze, arm in shipped_motions(("straight", "bend-i30")):
        assert not list(disagreements(motion, maze, arm)), name


@settings(max_examples=25)
@given(seed=SEEDS)
def test_in_space_checker_and_twin_agree_on_every_figure_and_verdict(seed):
    case = draw_spatial_case(np.random.default_rng(seed))
    assert not list(spatial_disagreements(*case))


@pytest.mark.parametrize("heading", np.linspace(-3.0, 3.0, 13))
def test_a_wall_flush_with_the_base_is_behind_it_whatever_rounding_says(heading):
    free = box(-100.0, -200.0, 400.0, 200.0).difference(box(-60.0, 20.0, 0.0, 60.0))
    maze = hall()
    maze = replace(
        maze,
        free_space=affinity.rotate(free, heading, origin=(0, 0), use_radians=True),
        base_pose=np.array([0.0, 0.0, heading]),
        goal=300.0 * np.array([math.cos(heading), math.sin(heading)]),
    )
    report = validate(straight_in(maze, 100.0, 4, 300.0), maze, ArmSpec(link_length=100.0, link_radius=30.0))
    assert "penetration" not in kinds(report)


def test_the_depth_at_a_pose_is_exact_to_a_billionth_of_a_link():
    # A square pillar under 30 degrees: the deepest point of the link is as far from two of its sides.
    pillar = affinity.rotate(box(130.0, -20.0, 170.0, 25.0), 30.0)
    free = corridor().free_space.difference(pillar)
    maze = replace(corridor(), free_space=free, base_pose=np.array([100.0, 0.0, 0.0]))
    motion = Motion.from_configurations([100.0], [[0.0]], 100.0, maze.base_pose)
    assert not [
        one for one in disagreements(motion, maze, ArmSpec(link_length=100.0)) if "sweep" not in one[0]
    ]


@pytest.mark.parametrize("bend", [0.0, 2.0])
def test_a_single_pose_in_space_is_checked_against_itself(bend):
    workspace = load_workspace("paired-panels")
    base_pose = workspace.base_pose_for(10.0)
    angles = np.zeros((1, 5, 2))
    angles[0, 3:, 0] = bend  # past a right angle twice: the last link crosses the one before the one before
    motion = SpatialMotion.from_configurations([50.0], angles, 10.0, base_pose)
    assert (
        "crossing" in kinds(validate_in_space(motion, workspace, ArmSpec(link_length=10.0, link_radius=3.0)))
    ) is (bend > 0.0)
