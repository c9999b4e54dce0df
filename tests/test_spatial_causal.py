"""Laws of the planner that grows its track from the tip on and sees the path only to a horizon."""

import dataclasses

import numpy as np
import pytest

from hrsnake_env.arm import ArmSpec
from planners.clock import now
from planners.kernels import spatial_track as kernel
from planners.path import arclength, resampled
from planners.problem import PlanningStatus
from planners.spatial import load_workspace, plan, validate
from planners.spatial.causal_planner import ADVANCE, HORIZON, PER_LINK, grow_track
from planners.spatial.query import SpatialQuery, behind_straight
from planners.spatial.workspace import Workspace


@pytest.fixture(scope="module")
def room():
    return load_workspace("paired-panels")


@pytest.fixture(scope="module")
def path(room):
    return query_of(room, 90.0).path


def query_of(workspace, length, path=None, seconds=60.0, **changes):
    """Return a question; with a path, the potential is not computed again."""
    query = SpatialQuery(
        workspace=workspace,
        arm=ArmSpec(link_length=length, **changes),
        deadline=now() + seconds,
        check=lambda motion: validate(motion, workspace),
    )
    if path is not None:
        query.__dict__["path"] = path
    return query


def test_links_that_cannot_follow_the_path_pass_on_a_grown_track(room):
    arm = ArmSpec(link_length=90.0)
    assert plan(room, arm, "follow").status is PlanningStatus.NOT_VALID
    result = plan(room, arm, "causal")
    assert result.status is PlanningStatus.SOLVED
    assert validate(result.motion, room, arm).valid


def test_a_grown_track_goes_from_the_straight_stretch_to_the_goal(room, path):
    grown = grow_track(query_of(room, 90.0, path))
    assert grown.status is PlanningStatus.SOLVED
    assert grown.track[0] == pytest.approx(room.base + room.straight * room.heading)
    assert grown.track[-1] == pytest.approx(room.goal)
    assert np.linalg.norm(np.diff(grown.track, axis=0), axis=1).max() < 2.0 * 90.0 / PER_LINK


def test_growing_is_repeatable(room, path):
    first, second = (grow_track(query_of(room, 100.0, path)).track for _ in range(2))
    assert np.array_equal(first, second)


@pytest.mark.parametrize("horizon", [1.0, HORIZON])
def test_what_lies_beyond_the_horizon_changes_nothing_before_it(room, path, horizon):
    length, turn = 80.0, 600.0
    points = behind_straight(room, path.points)
    s = arclength(points)
    other = dataclasses.replace(path, points=points[s <= turn])
    mine, yours = (grow_track(query_of(room, length, way), horizon).track for way in (path, other))
    same = (mine[: len(yours)] == yours[: len(mine)]).all(axis=1)
    n_same = len(same) if same.all() else int(np.argmin(same))
    # The tip sees the end when it is a horizon away. The shaped track may be shorter than the path.
    assert n_same > 0.6 * (turn - (horizon + ADVANCE) * length) * PER_LINK / length
    assert n_same < len(same)


def test_no_chord_that_is_fixed_is_in_an_obstacle(room, path):
    length = 90.0  # too long for so short a horizon: the tip gets stuck
    grown = grow_track(query_of(room, length, path), 0.5)
    assert grown.status is PlanningStatus.DEAD_END
    axis = (
        room.base + np.linspace(room.straight - length, room.straight, PER_LINK + 1)[:, None] * room.heading
    )
    points = np.concatenate([axis, grown.track[1:]])
    assert len(grown.track) > PER_LINK
    assert kernel.deepest_chord(points, PER_LINK + 1, length, room.obstacles)[3] <= 0.0


def test_a_dead_end_says_which_link_is_in_which_obstacle(room):
    result = plan(room, ArmSpec(link_length=140.0), "causal")
    assert result.status is PlanningStatus.DEAD_END
    assert result.reason.startswith("The tip cannot advance beyond (")
    failure = result.failure
    rear, front = failure.joints
    depth = kernel.overlap(*rear, *front, room.obstacles, failure.wall)[0]
    assert np.linalg.norm(front - rear) == pytest.approx(140.0)
    assert depth == pytest.approx(failure.depth)
    assert depth > 0.0
    assert failure.place == pytest.approx(tuple(front))


def test_thick_links_and_joint_limits_are_kept(room):
    for changes in ({"link_radius": 5.0}, {"joint_limit": 1.9}):
        arm = ArmSpec(link_length=90.0, **changes)
        result = plan(room, arm, "causal")
        assert result.status is PlanningStatus.SOLVED
        assert validate(result.motion, room, arm).valid


def test_an_empty_room_is_crossed_in_a_straight_line():
    room = Workspace(
        name="empty",
        room_low=np.zeros(3),
        room_high=np.array([300.0, 100.0, 100.0]),
        open_sides=("x-",),
        base=np.array([0.0, 50.0, 50.0]),
        heading=np.array([1.0, 0.0, 0.0]),
        straight=30.0,
        goal=np.array([250.0, 50.0, 50.0]),
        goal_radius=5.0,
    )
    grown = grow_track(query_of(room, 30.0))
    assert float(arclength(resampled(grown.track, 1.0))[-1]) == pytest.approx(220.0, rel=1e-3)


def test_without_a_way_there_is_no_path():
    room = load_workspace("paired-panels")
    wall = np.array([[[300.0, -1.0, -1.0], [320.0, 501.0, 401.0]]])
    closed = Workspace(
        name="closed",
        room_low=room.room_low,
        room_high=room.room_high,
        open_sides=("x-",),
        boxes=wall,
        base=room.base,
        heading=room.heading,
        straight=room.straight,
        goal=room.goal,
        goal_radius=room.goal_radius,
    )
    assert plan(closed, ArmSpec(link_length=30.0), "causal").status is PlanningStatus.NO_PATH


def test_when_time_is_over_the_plan_says_where_the_tip_was(room, path):
    grown = grow_track(query_of(room, 90.0, path, seconds=0.0))
    assert grown.status is PlanningStatus.OUT_OF_TIME
    assert grown.track[-1] == pytest.approx(room.base + room.straight * room.heading)
