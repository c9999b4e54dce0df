"""Contracts of plan(), over all planners and many mazes."""

import math
import time

import numpy as np
import pytest
from shapely import unary_union
from shapely.geometry import LineString, Point, box

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19, serpentine
from planners import PLANNERS, PlanningStatus, plan, planning, validate
from planners.baselines import BASELINES
from planners.portfolio import Question
from planners.problem import Candidate
from planners.query import Query
from planners.survey import survey

SAMPLING = ("rrt-connect", "aorrtc")
"""Planners that draw, and want OMPL; they have tests of their own."""

EVERY = pytest.mark.parametrize("planner", [name for name in PLANNERS if name not in SAMPLING])

TIGHT = [name for name in PLANNERS if name not in BASELINES]
"""Planners that claim links near the limit; those to compare with do not."""

SHORT = 120.0
"""A length that those to compare with solve, too."""


def claimed(planner, length):
    """Return a link length near the limit for planners that claim it, a short one for others."""
    return length if planner in TIGHT else SHORT


@pytest.fixture(scope="module")
def benchmark():
    """Return the paper's benchmark, planned at the paper's link length."""
    return plan(fig19(), ArmSpec(link_length=430.0), planner="beam")


def test_the_papers_links_pass_the_benchmark_without_penetration(benchmark):
    # Section 5.1: 430 px of 440 px, I = 0.977 (the paper rounds to 0.98).
    assert benchmark.status is PlanningStatus.SOLVED
    assert benchmark.report.penetration == 0.0
    assert benchmark.report.clearance >= 0.0
    assert benchmark.report.penetration_between <= 1e-3 * 430.0


@pytest.mark.parametrize("length", [150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 431.2, 436.0, 439.0, 439.5])
def test_the_beam_planner_passes_the_benchmark_with_shorter_and_longer_links(length):
    result = plan(fig19(), ArmSpec(link_length=length), planner="beam")
    assert result.solved, result.reason
    assert result.report.penetration == 0.0


@EVERY
@pytest.mark.parametrize("degrees", [0.0, 33.0, 180.0])
@pytest.mark.parametrize("scale", [0.01, 1.0])
def test_planning_does_not_depend_on_place_scale_and_direction(planner, degrees, scale):
    angle = math.radians(degrees)
    turn = scale * np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    line = np.array([(0, 0), (0, 1500), (240, 1500), (240, 600)]) @ turn.T + (31.0, -7.0)
    maze = Maze.from_corridors(line, 200.0 * scale)
    result = plan(maze, ArmSpec(link_length=claimed(planner, 420.0) * scale), planner=planner)
    assert result.solved, result.reason


@EVERY
def test_solved_means_that_the_checker_agrees(planner):
    result = plan(fig19(), ArmSpec(link_length=claimed(planner, 430.0)), planner=planner)
    again = validate(result.motion, fig19())
    assert result.solved and again.valid
    assert again.penetration_between == result.report.penetration_between


@EVERY
@pytest.mark.parametrize("name", ["fig19", "L", "S0", "stairs"])
def test_every_outcome_is_a_result_with_a_reason(planner, name):
    maze = Maze.load(name)
    # What would pass in the stairs takes seconds to say: there one planner asks for it, elsewhere all do.
    explain = name != "stairs" or planner == "beam"
    result = plan(maze, ArmSpec(link_length=300.0), planner=planner, time_budget=4.0, explain=explain)
    assert (result.motion is not None) == result.solved
    if result.solved:
        assert result.reason == "" and result.report.valid
        start, end = result.motion.joints[0, -1], result.motion.joints[-1, -1]
        np.testing.assert_allclose(start, maze.base_pose[:2], atol=1e-9)
        assert np.hypot(*(end - maze.goal)) <= maze.goal_radius
    else:
        assert result.reason.endswith(".") and result.place is not None


def test_links_longer_than_the_turn_is_wide_get_a_reason_and_a_place():
    # No rod longer than 440 passes: it must lie across both legs and the wall at some moment.
    result = plan(fig19(), ArmSpec(link_length=445.0))
    assert result.status is PlanningStatus.IMPOSSIBLE
    assert result.motion is None and "No rod of 445 px passes" in result.reason
    assert 430.0 < result.longest_there <= 440.0
    x, y = result.place
    assert -100 <= x <= 340 and 900 <= y <= 1600
    assert plan(fig19(), ArmSpec(link_length=445.0), planner="beam").status is PlanningStatus.DEAD_END


def test_planning_twice_gives_the_same_motion(benchmark):
    again = plan(fig19(), ArmSpec(link_length=430.0), planner="beam")
    np.testing.assert_array_equal(again.motion.joints, benchmark.motion.joints)


def test_the_result_times_its_stages(benchmark):
    assert list(benchmark.timings) == ["potential", "path", "beams", "plan", "poses", "validate"]
    assert all(seconds > 0.0 for seconds in benchmark.timings.values())


def test_extra_links_stay_in_the_feeder(benchmark):
    longer = plan(fig19(), ArmSpec(link_length=430.0, n_links=9), planner="beam").motion
    np.testing.assert_allclose(longer.joints[:, 2:], benchmark.motion.joints, atol=1e-8)
    assert longer.n_links == 9


@EVERY
def test_too_few_links_are_refused_with_the_number_it_takes(planner):
    # The path takes 19 short links; along the outer wall, and outside bends, the way is longer.
    length, number = claimed(planner, 430.0), "[67]" if planner in TIGHT else "(19|2[04])"
    with pytest.raises(InputError, match=rf"Expected at least {number} links of {length:g} px .* got 5"):
        plan(fig19(), ArmSpec(link_length=length, n_links=5), planner=planner)


def test_a_planner_that_needs_fewer_links_is_found(monkeypatch):
    maze = Maze.load("fig17a")
    with pytest.raises(InputError, match=r"at least 4[89] links"):
        plan(maze, ArmSpec(link_length=245.0, n_links=45), planner="sweep")
    monkeypatch.setattr(
        planning,
        "first_questions",
        lambda query, warm_start: (Question(name, 0, query) for name in ("sweep", "track")),
    )
    assert plan(maze, ArmSpec(link_length=245.0, n_links=45)).planner == "track"


@EVERY
def test_thick_links_are_planned_between_grown_walls(planner):
    length = claimed(planner, 300.0)
    arm = ArmSpec(link_length=length, link_radius=15.0)
    result = plan(fig19(), arm, planner=planner)
    assert result.solved, result.reason
    assert validate(result.motion, fig19(), arm).clearance >= 0.0
    if planner in TIGHT:  # short links in the middle of the corridor may be thicker
        assert not validate(result.motion, fig19(), ArmSpec(link_length=length, link_radius=80.0)).valid


@EVERY
def test_links_too_thick_for_the_corridor_find_no_path(planner):
    maze = Maze.from_corridors([[(0, 0), (0, 500)], [(0, 490), (0, 900)]], [200, 40])
    result = plan(maze, ArmSpec(link_length=100.0, link_radius=30.0), planner=planner)
    assert result.status is PlanningStatus.NO_PATH
    assert "radius 30" in result.reason


@EVERY
@pytest.mark.parametrize("away", [80.0, 160.0, 240.0, 330.0])
def test_a_goal_within_the_first_links_has_an_outcome(planner, away):
    maze = Maze.from_corridors([(0, 0), (0, 1500)], 200.0, goal=(40.0, 5.0 + away))
    # What would pass takes a second to say for the nearest goals: there one planner asks for it.
    explain = away > 200.0 or planner == "sweep"
    result = plan(maze, ArmSpec(link_length=300.0), planner=planner, explain=explain)
    assert (result.motion is not None) == result.solved
    if result.solved:
        assert result.report.goal_distance <= maze.goal_radius
    else:
        assert result.reason.endswith(".") and result.place is not None


@pytest.mark.parametrize("planner", TIGHT)
def test_joint_limits_hold(planner):
    free = plan(fig19(), ArmSpec(link_length=250.0), planner=planner)
    largest = np.abs(free.motion.joint_angles).max()
    limit = 0.9 * largest
    result = plan(fig19(), ArmSpec(link_length=250.0, joint_limit=limit), planner=planner)
    assert result.solved, result.reason
    assert np.abs(result.motion.joint_angles).max() <= limit + 1e-9


def test_links_at_the_physical_limit_are_solved_by_auto():
    result = plan(fig19(), ArmSpec(link_length=439.6))
    assert result.solved and str(result.attempts[-1]).endswith("solved")


def test_auto_never_asks_a_planner_that_is_there_to_compare_with(monkeypatch):
    def fail(query):
        raise AssertionError("path following was asked")

    monkeypatch.setitem(PLANNERS, "follow", fail)
    # Close to the longest rod of an S-bend everything is tried, in vain.
    result = plan(Maze.load("S200"), ArmSpec(link_length=550.0), explain=False)
    assert not result.solved
    assert {attempt.planner for attempt in result.attempts} == {"track", "sweep", "beam"}


def test_a_time_budget_is_kept_and_said():
    maze, arm = Maze.load("S200"), ArmSpec(link_length=430.0)
    plan(maze, arm, time_budget=20.0, explain=False)  # compiles
    start = time.perf_counter()
    result = plan(maze, arm, time_budget=0.05)
    assert time.perf_counter() - start < 1.0  # one step of a planner at most, on a busy machine
    assert result.status is PlanningStatus.OUT_OF_TIME and "time " in result.reason.lower()


def test_where_the_potential_leads_into_a_narrow_way_another_way_is_found():
    # The potential prefers the short way between the pillars, which is too narrow for links to turn in.
    free = box(0, 0, 1600, 900).difference(unary_union([box(300, 0, 1250, 380), box(300, 520, 1250, 560)]))
    maze = Maze(name="ways", free_space=free, base_pose=(5, 450, 0), goal=(1350, 150), goal_radius=25)
    for length in (200.0, 280.0, 320.0):
        result = plan(maze, ArmSpec(link_length=length), explain=False)
        assert result.solved, result.reason


def test_a_way_too_long_for_the_potential_follows_the_medial_axis():
    # Over 240 passage widths the potential falls below the smallest number.
    maze = serpentine(50, width=100.0, pitch=140.0, leg=700.0)
    assert survey(maze) is None
    geometry = Query(maze=maze, arm=ArmSpec(link_length=100.0)).geometry
    assert geometry.path.length > 240 * 100.0
    assert maze.free_space.covers(LineString(geometry.path.points))


def test_a_refused_motion_says_where_it_is_refused(monkeypatch):
    bad = plan(fig19(), ArmSpec(link_length=430.0)).motion
    moved = fig19(l1=196, l2=196, wall=44, end_gap=196)
    monkeypatch.setitem(
        PLANNERS, "sweep", lambda query: Candidate(status=PlanningStatus.SOLVED, motion=bad, timings={})
    )
    result = plan(moved, ArmSpec(link_length=430.0), planner="sweep")
    assert result.status is PlanningStatus.NOT_VALID and result.motion is None
    assert result.failure.depth == pytest.approx(2.0, abs=0.5)
    x, y = result.failure.place
    wall = LineString(moved.walls[result.failure.wall])
    assert wall.distance(Point(x, y)) < 3.0 and result.failure.path_position > 0.0


@pytest.mark.parametrize(
    ("arm", "planner", "message"),
    [
        ({"link_length": 430.0}, "beams", r"Unknown planner 'beams'\. Available: auto, beam"),
        ({"link_length": 1596.0}, "auto", r"Expected one link length \(1596 px\) of straight free way"),
        ({"link_length": 5000.0}, "auto", "Expected a link_length of at most the size of maze 'fig19'"),
    ],
)
def test_bad_questions_are_refused_in_one_sentence(arm, planner, message):
    with pytest.raises(InputError, match=message):
        plan(fig19(), ArmSpec(**arm), planner=planner)
