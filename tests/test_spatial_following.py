"""Laws of path following in space: the paper's figures, joints on the path, and how far links are from it."""

import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsnake_env.arm import ArmSpec
from planners import PlanningStatus
from planners.feeding import feed
from planners.kernels import feeding as feeding_kernel
from planners.kernels.spatial_chords import chord_errors, place_on_path
from planners.path import arclength, resampled, tangents
from planners.spatial.following import follow_path, mapping_error
from planners.spatial.path import Path, global_path
from planners.spatial.planning import plan
from planners.spatial.potential import laplace_potential
from planners.spatial.rooms import paired_panels
from planners.spatial.validation import validate
from planners.spatial.workspace import SIDES, Workspace

ROUNDING = 1e-9


@cache
def panels_path():
    workspace = paired_panels()
    return global_path(workspace, laplace_potential(workspace))


def path_of(points):
    """Return a path of a polyline's points."""
    s, along = arclength(points), tangents(points)
    return Path(points=points, raw=points, s=s, tangents=along, curvature=np.zeros(len(points)))


def open_room(goal, straight=1.0):
    """Return a room without obstacles, with the base at the origin."""
    return Workspace(
        name="open",
        room_low=np.full(3, -20.0),
        room_high=np.full(3, 20.0),
        open_sides=SIDES,
        base=np.zeros(3),
        heading=[1.0, 0.0, 0.0],
        straight=straight,
        goal=goal,
        goal_radius=0.1,
    )


def curve_at_random(rng, n=300, wild=0.04):
    """Return a smooth curve from the origin, first along x for one unit, six units more in all directions."""
    turns = np.cumsum(rng.normal(0.0, wild, (n, 2)), axis=0)
    cos = np.cos(turns)
    way = np.column_stack([cos[:, 0] * cos[:, 1], np.sin(turns[:, 0]) * cos[:, 1], np.sin(turns[:, 1])])
    bent = np.array([1.0, 0.0, 0.0]) + np.cumsum(way, axis=0) * 6.0 / n
    return np.concatenate([np.linspace(0.0, 1.0, 51)[:, None] * (1.0, 0.0, 0.0), bent])


def arcs_on(curve, places):
    """Return where on a polyline places are that lie on it."""
    arc, ways = arclength(curve), np.diff(curve, axis=0)
    found = np.empty(len(places))
    for i, place in enumerate(places):
        t = np.clip(np.einsum("nc,nc->n", place - curve[:-1], ways) / (ways**2).sum(axis=1), 0.0, 1.0)
        away = np.linalg.norm(curve[:-1] + t[:, None] * ways - place, axis=1)
        k = int(np.argmin(away))
        assert away[k] < 1e-7
        found[i] = arc[k] + t[k] * (arc[k + 1] - arc[k])
    return found


# The paper's figures


@pytest.mark.parametrize(
    ("length", "n_links", "error"),
    [(8.0, 182, (0.31, 0.31)), (30.0, 49, (4.2, 4.2)), (90.0, 16, (38.8, 40.9))],
)
def test_as_many_links_follow_the_path_as_in_the_paper_and_are_as_near(length, n_links, error):
    # Section 5.5: 182 links of 8 units and 49 of 30 follow without contact, 15 of 90 collide. (Here a 16th
    # link of 90 is needed by a few units, as the room is not the paper's.)
    motion = follow_path(panels_path(), paired_panels(), length)
    assert motion.n_links == n_links
    found = mapping_error(panels_path(), length)
    assert found.link_to_path == pytest.approx(error[0], rel=0.02)
    assert found.path_to_link == pytest.approx(error[1], rel=0.02)
    if length < 30.0:
        return  # thousands of poses take seconds to check
    report = validate(motion, paired_panels())
    assert report.valid == (length == 30.0)
    assert report.penetration == pytest.approx(0.0 if report.valid else 23.9, rel=0.01)


def test_the_longest_links_that_follow_are_those_that_were_measured():
    # By another program: 57.5 free, and at 60 a depth of 1.3.
    workspace = paired_panels()
    assert plan(workspace, ArmSpec(link_length=0.99 * 57.5), "follow").status is PlanningStatus.SOLVED
    assert plan(workspace, ArmSpec(link_length=1.01 * 57.5), "follow").status is PlanningStatus.NOT_VALID
    report = validate(follow_path(panels_path(), workspace, 60.0), workspace)
    assert report.penetration == pytest.approx(1.3, abs=0.1)


# Joints on the path


@pytest.mark.parametrize("seed", range(8))
def test_joints_at_the_nearest_place_behind_are_those_of_feeding_where_nothing_jumps(seed):
    curve = curve_at_random(np.random.default_rng(seed))
    base_pose = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    length = [0.3, 0.6, 1.0][seed % 3]
    fed = feed(curve, length, base_pose)
    assert fed.ending == feeding_kernel.DONE
    chosen = fed.poses[::11]
    tips, poses = arcs_on(curve, chosen[:, -1]), np.empty_like(chosen)
    place_on_path(curve, arclength(curve), length, tips, base_pose, poses)
    np.testing.assert_allclose(poses, chosen, atol=1e-6)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), wild=st.floats(0.0, 0.3), length=st.floats(0.05, 3.0))
def test_every_joint_is_on_the_path_and_every_link_exact_whatever_jumps(seed, wild, length):
    curve = curve_at_random(np.random.default_rng(seed), wild=wild)
    base_pose, arc = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]), arclength(curve)
    poses = np.empty((40, math.ceil(arc[-1] / length) + 1, 3))
    place_on_path(curve, arc, length, np.linspace(0.0, arc[-1], 40), base_pose, poses)
    np.testing.assert_allclose(np.linalg.norm(np.diff(poses, axis=1), axis=2), length, rtol=ROUNDING)
    for pose in poses[::13]:
        inside = (np.abs(pose[:, 1:]) < ROUNDING).all(axis=1) & (pose[:, 0] <= ROUNDING)
        places = arcs_on(curve, pose[~inside])
        assert (np.diff(places) > 0.0).all()
        # Nearest behind: all of the path from there to the next joint is nearer to that one.
        for here, there, ahead in zip(places[:-1], places[1:], pose[~inside][1:], strict=True):
            between = curve[(arc > here + 1e-6) & (arc < there)]
            assert (np.linalg.norm(between - ahead, axis=1) < length + ROUNDING).all()


def test_where_a_joint_jumps_the_arm_is_still_put_on_the_path():
    # The path turns back in a hairpin narrower than half a link.
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 40)
    hairpin = np.column_stack([3.0 + 0.1 * np.cos(turn), 0.1 + 0.1 * np.sin(turn), np.zeros(40)])
    corners = np.concatenate([[(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], hairpin, [(-3.0, 0.2, 0.0)]])
    path, workspace = path_of(resampled(corners, 0.02)), open_room([-3.0, 0.2, 0.0])
    curve = np.concatenate([np.zeros((1, 3)), path.points[path.s >= 1.0]])
    assert feed(curve, 1.0, workspace.base_pose_for(1.0)).ending != feeding_kernel.DONE
    motion = follow_path(path, workspace, 1.0)
    np.testing.assert_allclose(np.linalg.norm(np.diff(motion.joints, axis=1), axis=2), 1.0, rtol=ROUNDING)
    np.testing.assert_allclose(motion.joints[0, -1], workspace.base, atol=ROUNDING)
    np.testing.assert_allclose(motion.joints[-1, -1], workspace.goal, atol=ROUNDING)
    assert (motion.joints[0, :, 0] <= ROUNDING).all() and motion.joints[-1, 0, 0] <= ROUNDING
    assert {"step"} <= {fault.kind for fault in validate(motion, workspace).faults}


@pytest.mark.parametrize("length", [0.4, 1.0, 1.5, 2.5])
def test_a_follower_comes_out_of_the_feeder_and_ends_at_the_goal(length):
    curve = curve_at_random(np.random.default_rng(2), wild=0.02)
    workspace = open_room(curve[-1])
    motion = follow_path(path_of(curve), workspace, length)
    base = workspace.base_pose_for(length)
    np.testing.assert_allclose(motion.joints[0, -1], base[:3], atol=ROUNDING)
    np.testing.assert_allclose(motion.joints[-1, -1], curve[-1], atol=ROUNDING)
    assert validate(motion, workspace).valid
    # Not a link too many: the second joint is out of the feeder at the end.
    assert motion.joints[-1, 0] @ base[3:] <= base[:3] @ base[3:] + ROUNDING
    assert (motion.joints[-1, 1] - base[:3]) @ base[3:] > 0.0


# The mapping error


def brute_errors(points, length):
    """Compute the errors by trying all: chords that end at points, against the points they span."""
    link_to_path, path_to_link = 0.0, 0.0
    share = np.linspace(0.0, 1.0, 101)[:, None]
    for i in range(len(points)):
        apart = np.linalg.norm(points[:i] - points[i], axis=1)
        if not (apart >= length).any():
            continue
        k = int(np.flatnonzero(apart >= length)[-1])
        link, spanned = points[k] + share * (points[i] - points[k]), points[k : i + 1]
        distances = np.linalg.norm(link[:, None] - spanned, axis=2)
        link_to_path = max(link_to_path, distances.min(axis=1).max())
        path_to_link = max(path_to_link, distances.min(axis=0).max())
    return link_to_path, path_to_link


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("length", [0.5, 1.2])
def test_mapping_errors_are_those_of_a_search_over_all_chords(seed, length):
    points = resampled(curve_at_random(np.random.default_rng(seed)), 0.02)
    # The twin knows points only: it is too far by as much as a point is from the nearest.
    np.testing.assert_allclose(chord_errors(points, length), brute_errors(points, length), atol=2e-3)


@pytest.mark.parametrize("length", [0.5, 1.0, 1.9])
def test_on_a_circle_both_errors_are_the_height_of_the_segment(length):
    angle = np.linspace(0.0, np.pi, 4000)
    points = np.column_stack([np.sin(angle), np.cos(angle), np.zeros_like(angle)])
    height = 1.0 - math.sqrt(1.0 - 0.25 * length**2)
    found = mapping_error(path_of(points), length)
    assert found.path_to_link == pytest.approx(height, rel=2e-3)
    # The middle of the link is nearest to the arc beyond it, unless that is more than a half circle.
    assert found.link_to_path == pytest.approx(height, rel=2e-3)


def test_links_on_a_straight_path_are_on_it():
    points = np.linspace(0.0, 1.0, 400)[:, None] * (3.0, 2.0, -1.0)
    assert chord_errors(points, 0.5) == (pytest.approx(0.0, abs=1e-12), pytest.approx(0.0, abs=1e-12))


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_mapping_error_is_a_length(scale):
    points = resampled(curve_at_random(np.random.default_rng(4)), 0.02)
    one, other = mapping_error(path_of(points), 0.7), mapping_error(path_of(scale * points), 0.7 * scale)
    assert other.link_to_path == pytest.approx(scale * one.link_to_path, rel=1e-6)
    assert other.path_to_link == pytest.approx(scale * one.path_to_link, rel=1e-6)


def test_links_longer_than_the_path_span_none_of_it():
    points = np.linspace(0.0, 1.0, 50)[:, None] * (1.0, 0.0, 0.0)
    assert chord_errors(points, 1.5) == (0.0, 0.0)
