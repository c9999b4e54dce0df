"""The rules of section 3 of the paper, each by itself, on ways that can be computed by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planners.beam_planner import (
    blocking,
    clamp_to_free,
    closest_path_point,
    coordinate_at_length,
    edge_side,
    is_near_semi_critical,
    path_point,
    soften,
    tangent_point,
)
from planners.corners import turn_of
from planners.kernels.beam_rules import nearest_index
from planners.kernels.beam_types import (
    BEAM,
    CORNER,
    EDGE,
    GUIDE_JUMPED,
    GUIDE_TANGENT,
    LINK,
    NOTHING,
    TANGENT,
    Terms,
    Way,
)
from planners.path import tangents

ANGLES = st.floats(-math.pi, math.pi)


def way(points, corners=(), half_width=1.0):
    """Return a way in a corridor; corners are given as (first, last, turn, critical)."""
    points = np.asarray(points, dtype=np.float64)
    along = tangents(points)
    left = points + half_width * np.column_stack([-along[:, 1], along[:, 0]])
    beams = np.recarray(len(points), dtype=BEAM)
    beams.along_x, beams.along_y = along.T
    beams.corner = beams.next_corner = beams.next_critical = -1
    for number, (first, last, _, critical) in reversed(list(enumerate(corners))):
        beams.corner[first : last + 1] = number
        beams.next_corner[: last + 1] = number
        if critical:
            beams.next_critical[: last + 1] = number
    return Way(
        lines=np.stack([points, left, 2.0 * points - left]),
        beams=beams,
        corners=np.array(list(corners), dtype=CORNER).view(np.recarray),
    )


def straight(n=40):
    """Return n points, one apart, along x."""
    return np.column_stack([np.arange(float(n)), np.zeros(n)])


def circle(n=400):
    """Return path points on a left-hand half circle of radius 1 from (1, 0)."""
    angle = np.linspace(0, math.pi, n)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def terms(**changes):
    """Return terms of links of length 1, with some of them changed."""
    usual = {
        "length": 1.0,
        "joint_limit": math.inf,
        "release": 16.0,
        "near_end": 0.1,
        "reach": 50,
        "semi_critical": True,
        "tangent_blocks": True,
        "jump_blocks": True,
        "jump": 0.15,
        "degree": 3.0,
        "clamp": False,
        "pad": 0.0,
        "turn": 0.05,
    }
    return Terms(**(usual | changes))


def links(n=3):
    """Return n links that do nothing."""
    arm = np.recarray(n, dtype=LINK)
    arm.fill(0)
    arm.corner = arm.jumped = -1
    return arm


# 3.1


def test_the_tangent_point_touches_a_circle_at_the_hand_computed_place():
    # From a point at distance 2 r from the centre, the tangent touches 60 degrees off the line of centres;
    # products too small to have a sign put it a few of the 400 points later.
    left_bend = way(circle(), [(0, 399, +1, True)])
    i = tangent_point(left_bend, 2.0, 0.0, 0, 5.0)
    assert i / 399 * math.pi == pytest.approx(math.pi / 3, abs=0.03)


def test_there_is_no_tangent_point_out_of_reach_or_outside_a_corner():
    corner = [(0, 399, +1, True)]
    assert tangent_point(way(circle(), corner), 2.0, 0.0, 0, 1.5) == -1  # the tangent is sqrt(3) long
    assert tangent_point(way(circle()), 2.0, 0.0, 0, 5.0) == -1
    assert tangent_point(way(circle(), [(0, 399, -1, True)]), 2.0, 0.0, 0, 5.0) == -1  # not a right corner
    assert tangent_point(way(circle(), [(200, 399, +1, True)]), 2.0, 0.0, 0, 5.0) == -1  # before the corner


def test_semi_critical_corners_have_tangent_points_too():
    assert tangent_point(way(circle(), [(0, 399, +1, False)]), 2.0, 0.0, 0, 5.0) > 0


# 3.2


@given(st.floats(2.0, 30.0), st.floats(-0.2, 0.2))
def test_on_a_straight_path_the_beam_through_the_end_is_found(length, heading):
    found = closest_path_point(way(straight(), half_width=9.0), 0.0, 0.0, heading, length, 0, 100, 1.1)
    assert abs(found - length * math.cos(heading)) <= 1.2


def test_beams_of_another_leg_are_not_taken():
    # Two legs, 4 apart, with a wall between them: the end is nearer to the second leg than to its own.
    out, back = straight(20), np.add(straight(20)[::-1], (0.0, 4.0))
    u_turn = way(np.concatenate([out, back]), half_width=1.5)
    heading = math.asin(2.1 / 10.0)
    assert closest_path_point(u_turn, 0.0, 0.0, heading, 10.0, 0, 40, 1.1) in (9, 10)


def test_a_beam_that_does_not_come_near_the_end_is_not_taken():
    assert closest_path_point(way(straight(8)), 0.0, 0.0, 0.0, 20.0, 0, 100, 1.1) == -1  # behind the last
    assert closest_path_point(way(straight()), 0.0, 0.0, 0.5, 20.0, 0, 100, 1.1) == -1  # beyond its ends
    assert closest_path_point(way(straight()), 0.0, 0.0, 0.0, 20.0, 0, 10, 1.1) == -1  # out of reach


def test_the_nearest_point_does_not_leave_its_neighbourhood():
    line = straight(20)
    assert nearest_index(line, 11.2, 5.0, 10, 5) == 11
    assert nearest_index(line, 0.0, 5.0, 10, 5) == 5
    assert nearest_index(line, 99.0, 5.0, 18, 5) == 19


# 3.3 and 3.4


@given(st.floats(2.0, 12.0))
def test_the_edge_side_is_at_exactly_the_link_length(length):
    edge = np.column_stack([np.linspace(-3, 20, 47), np.full(47, 1.0)])
    found, direction = coordinate_at_length(edge, 0.0, 0.0, 0, length)
    if length < math.hypot(3, 1):  # the first point is already too far: the paper takes it
        assert found == 0 and direction == pytest.approx(math.atan2(1, -3))
    else:
        assert np.hypot(*edge[found]) >= length > np.hypot(*edge[found - 1])
        assert length * math.sin(direction) == pytest.approx(1.0)
        assert math.cos(direction) > 0.0


def test_no_edge_side_is_found_beyond_the_end():
    assert coordinate_at_length(np.zeros((4, 2)), 0.0, 0.0, 0, 1.0)[0] == -1


@pytest.mark.parametrize(("turn", "side"), [(-1, +1), (+1, -1)])
def test_the_edge_side_of_a_corner_is_the_outer_one(turn, side):
    bend = way(straight(), [(30, 34, turn, True)], half_width=3.0)
    beam, direction = edge_side(bend, 0, 0.0, 0.0, 0, 5.0)
    assert beam == 4 and direction == pytest.approx(side * math.atan2(3.0, 4.0))


def test_the_path_point_is_at_the_link_length_or_the_goal():
    assert path_point(way(straight()), 0.0, 3.0, 0, 5.0) == (4, pytest.approx(math.atan2(-3.0, 4.0)))
    assert path_point(way(straight()), 30.0, 0.0, 30, 50.0) == (39, 0.0)


def test_a_link_is_near_a_semi_critical_corner_that_lies_beside_it():
    corners = [(5, 8, +1, True), (12, 15, -1, False), (20, 22, +1, True)]
    mixed = way(straight(), corners)
    assert is_near_semi_critical(mixed, 0, 12) and is_near_semi_critical(mixed, 14, 30)
    assert not is_near_semi_critical(mixed, 0, 11)
    assert not is_near_semi_critical(mixed, 16, 39)
    assert not is_near_semi_critical(way(straight()), 0, 39)


# 3.5


@given(st.floats(0.3, 2.8), ANGLES)
def test_a_bend_to_the_left_is_a_left_corner_however_it_is_turned(bend, heading):
    angle = heading + np.linspace(0.0, bend, 12)
    points = np.cumsum(np.column_stack([np.cos(angle), np.sin(angle)]), axis=0)
    assert turn_of(points) == 1
    assert turn_of(points[::-1]) == -1
    assert turn_of(points * (1.0, -1.0)) == -1
    assert turn_of(points[:3]) == 1


# 3.6


@pytest.mark.parametrize(
    ("choice", "corner", "jumped", "expected"),
    [
        (TANGENT, 2, -1, GUIDE_TANGENT),
        (TANGENT, 1, -1, GUIDE_TANGENT),
        (EDGE, 2, -1, NOTHING),
        (EDGE, 2, 2, GUIDE_JUMPED),
        (EDGE, 1, 1, NOTHING),
    ],
)
def test_a_guide_link_blocks_while_it_is_tangent_and_at_the_corner_where_it_has_jumped(
    choice, corner, jumped, expected
):
    arm = links()
    arm[0].choice, arm[0].corner, arm[0].jumped = choice, corner, jumped
    assert blocking(arm, 1, 2, terms()) == expected
    assert blocking(arm, 0, 2, terms()) == NOTHING  # the link at the tip has no guide
    assert blocking(arm, 1, 2, terms(tangent_blocks=False, jump_blocks=False)) == NOTHING


# 3.7


@given(ANGLES, st.floats(-3.0, 3.0), st.integers(1, 20))
def test_a_jump_is_made_in_equal_pieces(direction, jump, degree):
    goal, pieces, way_there = direction + jump, float(degree), [direction]
    for _ in range(degree):
        at, pieces = soften(way_there[-1], goal, pieces, 1.0)
        way_there.append(at)
    np.testing.assert_allclose(np.diff(way_there), jump / degree, atol=1e-12)
    assert way_there[-1] == goal and pieces == 0.0


def test_shorter_poses_make_smaller_pieces_of_the_same_jump():
    direction, pieces = 0.0, 3.0
    for _ in range(4):
        direction, pieces = soften(direction, 1.0, pieces, 0.25)
    assert direction == pytest.approx(1.0 / 3.0) and pieces == pytest.approx(2.0)


def test_softening_takes_the_short_way():
    assert soften(0.0, 2 * math.pi - 0.2, 2.0, 1.0)[0] == pytest.approx(-0.1)


# The step that is not in the paper.


def clamped(wanted, direction, largest, wall_angles, pad=0.01):
    """Clamp a rod of length 2 between short walls at distance 1 in these directions."""
    walls = [[(math.cos(a), math.sin(a)), (1.01 * math.cos(a), 1.01 * math.sin(a))] for a in wall_angles]
    blocked, gaps = np.empty((len(walls) + 1, 2)), np.empty((len(walls) + 1, 2))
    walls = np.array(walls, dtype=np.float64).reshape(-1, 2, 2)
    return clamp_to_free(wanted, direction, largest, 0.0, 0.0, 2.0, walls, pad, blocked, gaps)


def test_a_clamped_direction_stays_in_its_free_interval():
    assert clamped(0.3, 0.0, 9.0, [0.5, -0.5]) == (True, pytest.approx(0.3))
    assert clamped(0.7, 0.0, 9.0, [0.5, -0.5]) == (True, pytest.approx(0.49))
    assert clamped(-3.0, 0.0, 9.0, [0.5, -0.5]) == (True, pytest.approx(-0.49))


def test_a_clamped_link_turns_no_more_than_allowed():
    assert clamped(0.3, 0.0, 0.1, [0.5, -0.5]) == (True, pytest.approx(0.1))
    assert clamped(2 * math.pi - 0.3, 0.0, 0.1, []) == (True, pytest.approx(-0.1))


def test_without_a_free_interval_there_is_no_direction():
    ring = np.linspace(0.0, 2 * math.pi, 200)
    assert clamped(0.3, 0.0, 9.0, ring, pad=0.05)[0] is False
