"""Laws of the curve-based baselines: where joints and links are, what they pass, and how they fail."""

import dataclasses

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString

from hrsnake_env.arm import ArmSpec
from hrsnake_env.ladder import LADDER
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from planners import PLANNERS, PlanningStatus, plan, validate
from planners.baselines.b_spline import DEVIATIONS, b_spline, beside
from planners.baselines.backbone import WINDOWS, backbone_curve
from planners.baselines.outer_wall import HELD, LONGEST_BEAMS, SHARES, outer_line
from planners.baselines.path_following import followed_track
from planners.baselines.trials import Stuck, best_of, fed_along
from planners.clock import now
from planners.path import arclength
from planners.query import Query

CURVES = ("outer-wall", "b-spline", "backbone")

LOOSE = ("straight", "bend-i30", "u-turn-i30", "zigzag-i30")

PASSED = {"outer-wall": 430.0, "b-spline": 220.0, "backbone": 220.0}
"""Links that pass the benchmark, in px; those that follow the path pass with 150."""

EVERY = pytest.mark.parametrize("planner", CURVES)


def asked(name, length, **arm):
    """Return a query with the exact checker."""
    maze, spec = Maze.load(name), ArmSpec(link_length=length, **arm)
    return Query(maze=maze, arm=spec, checker=lambda motion: validate(motion, maze, spec))


@pytest.fixture(scope="module")
def passed():
    """Return by planner a query and its valid motion."""
    found = {}
    for planner, length in PASSED.items():
        query = asked("fig19", length)
        found[planner] = query, PLANNERS[planner](query).motion
    return found


@EVERY
@pytest.mark.parametrize("name", LOOSE)
def test_the_loose_rungs_are_passed(planner, name):
    result = plan(Maze.load(name), ArmSpec(link_length=LADDER[name].link_length), planner=planner)
    assert result.solved, result.reason


@EVERY
def test_longer_links_pass_one_u_turn_than_follow_the_path(planner):
    assert not plan(fig19(), ArmSpec(link_length=160.0), planner="follow", explain=False).solved
    assert plan(fig19(), ArmSpec(link_length=PASSED[planner]), planner=planner).solved


def test_the_outer_wall_passes_tight_u_turns_to_both_sides():
    for name, length in (("zig3", 400.0), ("serp", 350.0)):
        result = plan(Maze.load(name), ArmSpec(link_length=length), planner="outer-wall")
        assert result.solved, result.reason


@EVERY
def test_links_keep_their_length_and_come_straight_out_of_the_feeder(passed, planner):
    query, motion = passed[planner]
    lengths = np.hypot(*np.diff(motion.joints, axis=1).transpose(2, 0, 1))
    np.testing.assert_allclose(lengths, query.arm.link_length, rtol=1e-9)
    assert validate(motion, query.maze).faults == ()


@EVERY
def test_planning_twice_gives_the_same_motion(passed, planner):
    query, motion = passed[planner]
    again = PLANNERS[planner](dataclasses.replace(query, surveys={})).motion
    np.testing.assert_array_equal(again.joints, motion.joints)


def farthest_from(line, points):
    """Return the largest distance of points from a line."""
    curve = LineString(line)
    shapely.prepare(curve)
    return float(shapely.distance(curve, shapely.points(points.reshape(-1, 2))).max())


def past_the_axis(motion, reach):
    """Tell for each joint in front of the base whether it is farther from it than axis and step reach."""
    offset = motion.joints - motion.base_pose[:2]
    heading = np.array([np.cos(motion.base_pose[2]), np.sin(motion.base_pose[2])])
    return (offset @ heading > 0.0) & (np.hypot(*offset.transpose(2, 0, 1)) > reach)


def test_joints_at_the_outer_wall_are_near_it_in_the_turn(passed):
    query, motion = passed["outer-wall"]
    beams, path = query.geometry.beams, query.geometry.path
    line = outer_line(query.geometry, motion.link_length, 1.0, HELD[0], LONGEST_BEAMS[0])
    turn = np.abs(path.s - path.s[np.argmax(path.points[:, 1])]) < 100.0
    np.testing.assert_allclose(line[turn], beams.left[turn], atol=1e-9)  # a right turn
    joints = motion.joints[motion.joints[..., 1] > 1500.0]
    outer = LineString([(-100, 1400), (-100, 1600), (340, 1600), (340, 1400)])
    assert len(joints) > 50
    # The beams' ends are some px apart round the corners of the wall.
    assert shapely.distance(outer, shapely.points(joints)).max() < (1.0 - min(SHARES[:2])) * 300.0 + 10.0


def test_the_outer_line_is_the_path_where_nothing_is_shifted():
    geometry = asked("zig3", 200.0).geometry
    for share, side in ((0.0, slice(None)), (1.0, [0, -1])):
        line = outer_line(geometry, 200.0, share, 0.3, 1.5)
        np.testing.assert_allclose(line[side], geometry.path.points[side], atol=1e-9)


def test_the_outer_line_changes_sides_between_opposite_turns():
    geometry = asked("zig3", 200.0).geometry
    line = outer_line(geometry, 200.0, 1.0, 0.3, 1.5)
    aside = ((line - geometry.path.points) * geometry.beams.normals).sum(axis=1)
    first, second = (
        np.abs(geometry.path.points - place).sum(axis=1).argmin() for place in ((120, 1450), (360, 850))
    )
    assert aside[first] > 50.0 and aside[second] < -50.0  # a right turn, then a left one


def test_joints_run_on_the_curve_where_links_are_its_chords():
    query = asked("fig19", 150.0)
    maze, curve = query.maze, b_spline(query.geometry.path, DEVIATIONS[0])
    np.testing.assert_array_equal(beside(curve, 150.0, 0.0), curve)
    track = followed_track(curve, 150.0, maze.base_pose, maze.goal, 12.5)
    motion = fed_along(track, 150.0, maze.base_pose)
    joints = motion.joints[past_the_axis(motion, 1.6 * 150.0)]
    assert len(joints) > 1000
    assert farthest_from(curve, joints[::7]) < 1e-6 * 150.0


def test_a_b_spline_stays_near_the_path_and_joins_its_ends():
    path = asked("serp", 150.0).geometry.path
    for deviation in DEVIATIONS:
        curve = b_spline(path, deviation)
        apart = np.hypot(*(curve - path.points).T)
        assert 0.0 < np.sqrt(np.mean(apart**2)) <= 1.01 * deviation * path.width
        np.testing.assert_array_equal(curve[[0, -1]], path.points[[0, -1]])


def test_links_beside_a_round_bend_are_tangent_to_it():
    turn = np.linspace(0.0, np.pi, 4001)
    bend = 100.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    length = 80.0
    radii = np.hypot(*beside(bend, length, 1.0)[1000:3000].T)
    # The joints of links tangent to a circle are half a link from where they touch it.
    np.testing.assert_allclose(radii, np.hypot(100.0, length / 2.0), rtol=0.005)


def test_links_fitted_to_the_backbone_are_on_both_sides_of_it(passed):
    query, motion = passed["backbone"]
    maze, length = query.maze, motion.link_length
    track = followed_track(query.geometry.path.points, length, maze.base_pose, maze.goal, 0.0)
    joints = motion.joints[past_the_axis(motion, 1.6 * length)]
    middles = 0.5 * (motion.joints[:, 1:] + motion.joints[:, :-1])[past_the_axis(motion, 2.6 * length)[:, 1:]]
    aside = farthest_from(track, joints[::5])
    assert 0.02 * length < aside < 0.3 * length
    # Chords of the path have their ends on it and their middles farther inside its bends than these.
    chords = np.array([-1.0, 1.0]) * length / 2.0
    s = arclength(track)
    places = np.linspace(2.0 * length, s[-1] - length, 400)
    ends = [np.column_stack([np.interp(places + half, s, track[:, k]) for k in range(2)]) for half in chords]
    assert farthest_from(track, middles[::5]) < farthest_from(track, 0.5 * (ends[0] + ends[1]))


def test_a_wider_window_bends_the_backbone_less():
    turn = np.linspace(0.0, np.pi, 200)
    track = np.concatenate([[(1.0, -5.0)], np.column_stack([np.cos(turn), np.sin(turn)]), [(-1.0, -5.0)]])
    tops = [backbone_curve(track, window)[:, 1].max() for window in WINDOWS]
    assert tops == sorted(tops, reverse=True) and tops[-1] < tops[0] <= 1.0


@EVERY
def test_links_too_long_for_a_turn_have_a_reason_and_a_place(planner):
    result = plan(fig19(), ArmSpec(link_length=445.0), planner=planner, explain=False)
    assert not result.solved and result.reason.endswith(".")
    x, y = result.place
    assert -100.0 <= x <= 340.0 and 0.0 <= y <= 1600.0


@EVERY
@pytest.mark.parametrize("name", ["clutter-1", "corridor-2", "fig17d", "s-bend-i74"])
def test_any_maze_has_an_outcome(planner, name):
    result = plan(Maze.load(name), ArmSpec(link_length=150.0), planner=planner, explain=False)
    assert (result.motion is not None) == result.solved
    assert result.solved or (result.reason.endswith(".") and result.place is not None)


def test_after_the_deadline_no_more_variants_are_tried():
    query = dataclasses.replace(asked("fig19", 430.0), deadline=now())
    joints = np.array([(0.0, 5.0), (0.0, 435.0)])
    trials = iter([Stuck(why="a joint would jump", joints=joints)] * 3)
    assert best_of(query, query.geometry, trials).status is PlanningStatus.OUT_OF_TIME
    assert len(list(trials)) == 2
    assert best_of(query, query.geometry, []).status is PlanningStatus.OUT_OF_TIME
    assert PLANNERS["backbone"](query).status is PlanningStatus.OUT_OF_TIME


def test_of_motions_in_walls_the_least_deep_one_is_returned():
    query = asked("fig19", 200.0)
    maze, geometry = query.maze, query.geometry
    trials = []
    for share in (0.04, 0.1, 0.07):
        line = outer_line(geometry, 200.0, share, 0.3, 1.5)
        trials.append(
            fed_along(followed_track(line, 200.0, maze.base_pose, maze.goal, 12.5), 200.0, maze.base_pose)
        )
    depths = [validate(trial, maze).penetration for trial in trials]
    assert min(depths) > 0.0 and len(set(depths)) > 1
    best = best_of(query, geometry, trials)
    assert best.motion is trials[int(np.argmin(depths))]


def test_without_any_motion_the_first_reason_is_told():
    query = asked("fig19", 430.0)
    joints = np.array([(0.0, 5.0), (0.0, 435.0)])
    trials = [Stuck(why=why, joints=joints) for why in ("a joint would jump", "another one would")]
    candidate = best_of(query, query.geometry, trials)
    assert (
        candidate.status is PlanningStatus.DEAD_END and "(0, 435) px, a joint would jump." in candidate.reason
    )
    assert candidate.failure.place == (0.0, 435.0)
