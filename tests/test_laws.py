"""Laws of every maze, arm and motion; `python -m benchmarks.trust.mazes` checks them on thousands."""

import dataclasses
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon, box
from strategies import cases, similarities

from benchmarks.trust import maze_laws as laws
from benchmarks.trust.maze_draws import Similarity, draw_case, in_other_order, with_far_part, with_far_walls
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19, serpentine
from planners import PLANNERS, PlanningStatus, plan
from planners.clock import now
from planners.feeding import LATE, feed
from planners.problem import Motion
from planners.room import most_poses
from planners.track_scene import Scene
from planners.validation import validate

FEW = settings(max_examples=8)
BUDGET = 1.0
SAMPLING = ("rrt-connect", "aorrtc")  # they want OMPL, which not every environment has


@pytest.fixture(scope="module")
def solved():
    """Return random cases, each with the motion that was planned for it."""
    found = []
    for number in range(60):
        case = draw_case(np.random.default_rng([1, number]))
        result = plan(case.maze, case.arm, time_budget=BUDGET, explain=False)
        if result.motion is not None and result.motion.n_poses < 1500:
            found.append((case, result))
        if len(found) == 8:
            return found
    raise AssertionError("Expected more mazes that are easy.")


SOLVED = st.integers(0, 7)


@FEW
@given(case=cases(), planner=st.sampled_from(["auto", *(name for name in PLANNERS if name not in SAMPLING)]))
def test_any_planner_ends_with_a_valid_motion_or_a_reason_and_a_place(case, planner, tmp_path_factory):
    result, _ = laws.timed_plan(case, planner, BUDGET)
    laws.says_why(case, planner, result)
    if result.motion is not None:
        laws.valid_when_saved(case, result.motion, tmp_path_factory.mktemp("laws") / "motion.npz")


@FEW
@given(which=SOLVED, similarity=similarities())
def test_a_motion_is_valid_in_a_maze_that_is_moved_with_it(solved, which, similarity):
    case, result = solved[which]
    laws.valid_when_moved(case, result.motion, similarity)


@FEW
@given(which=SOLVED, share=st.floats(0.0, 1.0))
def test_a_motion_that_is_cut_lacks_nothing_but_the_goal(solved, which, share):
    case, result = solved[which]
    laws.valid_when_cut(case, result.motion, 1 + int(share * (result.motion.n_poses - 1)))


def test_a_motion_backward_lacks_nothing_but_its_ends(solved):
    for case, result in solved:
        laws.valid_when_reversed(case, result.motion)


def test_walls_that_no_arm_can_reach_leave_motions_valid(solved):
    for number, (case, result) in enumerate(solved):
        far = laws.replace_maze(case, with_far_walls(case.maze, np.random.default_rng(number)))
        laws.stays_valid(result.motion, far.maze, far, "with far walls")


def test_another_part_of_the_free_space_changes_no_digit_of_a_plan(solved):
    for number, (case, result) in enumerate(solved[:3]):
        far = laws.replace_maze(case, with_far_part(case.maze, np.random.default_rng(number)))
        again, _ = laws.timed_plan(far, "auto", 30.0 * BUDGET)
        np.testing.assert_array_equal(again.motion.joints, result.motion.joints)


def test_a_maze_scaled_by_a_power_of_two_has_the_same_plan_digit_by_digit(solved):
    for case, result in solved[:3]:
        similarity = Similarity(scale=2.0**-7)
        again, _ = laws.timed_plan(similarity.case(case), "auto", 30.0 * BUDGET)
        laws.digit_by_digit(case, result, again, similarity)


def test_a_motion_is_valid_in_whatever_order_the_walls_are_listed(solved):
    for number, (case, result) in enumerate(solved):
        ordered = laws.replace_maze(case, in_other_order(case.maze, np.random.default_rng(number)))
        assert not np.array_equal(ordered.maze.walls, case.maze.walls)
        laws.stays_valid(result.motion, ordered.maze, ordered, "walls in other order")


def test_a_planted_shift_of_one_joint_breaks_a_law(solved):
    case, result = solved[0]
    joints = result.motion.joints.copy()
    joints[result.motion.n_poses // 2, -1] += 0.02 * case.arm.link_length
    with pytest.raises(laws.Broken):
        laws.stays_valid(dataclasses.replace(result.motion, joints=joints), case.maze, case, "shifted")


@pytest.mark.parametrize("planner", ["track", "outer-wall"])
def test_the_wall_in_the_way_of_thick_links_is_a_wall_of_the_maze(planner):
    # Walls grown by the radius have more vertices, and so other numbers.
    maze, arm = fig19(), ArmSpec(link_length=425.0, link_radius=40.0)
    result = plan(maze, arm, planner, explain=False, time_budget=4.0)
    assert not result.solved
    assert 0 <= result.failure.wall < len(maze.walls)
    aim, wall = np.asarray(result.place), maze.walls[result.failure.wall]
    away = [LineString(segment).distance(Point(aim)) for segment in maze.walls]
    assert LineString(wall).distance(Point(aim)) == min(away)


@pytest.mark.parametrize("size", [2e-13, 1e-13])
def test_walls_without_length_are_no_walls_of_a_track_s_scene(size):
    # Unions of outlines leave such walls where edges of both meet.
    outline = np.array([(0, 0), (0, 900), (700, 900), (700, 700), (200, 700), (200, 0)], dtype=float)
    doubled = np.insert(outline, 4, outline[3] - size * 700.0, axis=0)
    maze = dataclasses.replace(
        Maze.from_corridors([(100, 0), (100, 800), (700, 800)], 200.0), free_space=Polygon(doubled)
    )
    assert len(maze.walls) == 7
    near = Scene(maze=maze, length=250.0, joint_limit=np.inf).near
    assert len(near.walls) == 6
    np.testing.assert_allclose(np.hypot(*near.outward.T), 1.0)


def test_feeding_goes_on_where_it_was_full(monkeypatch):
    turn = np.linspace(0.0, 3.0, 300)
    track = np.concatenate(
        [[(0.0, 0.0)], np.column_stack([1.0 + 2.0 * np.sin(turn), 2.0 - 2.0 * np.cos(turn)])]
    )
    whole = feed(track, 1.0, np.zeros(3))
    monkeypatch.setattr("planners.feeding.CHUNK", 7)
    monkeypatch.setattr("planners.feeding.ROOM", 20)
    pieces = feed(track, 1.0, np.zeros(3))
    np.testing.assert_array_equal(pieces.poses, whole.poses)
    late = feed(track, 1.0, np.zeros(3), deadline=now())
    assert late.ending == LATE and len(late.poses) < len(whole.poses)


@pytest.mark.parametrize("planner", ["track", "sweep", "follow"])
def test_where_time_ends_while_poses_are_made_the_result_says_so(planner, monkeypatch):
    now = [0.0]
    monkeypatch.setattr("planners.feeding.CHUNK", 1000)
    monkeypatch.setattr("planners.sweep_track.POSED", 1000)

    def clock():
        now[0] += 0.1
        return now[0]

    case = laws.Case(kind="serpentine", maze=serpentine(4), arm=ArmSpec(link_length=100.0))
    monkeypatch.setattr("time.perf_counter", clock)
    result = plan(case.maze, case.arm, planner, time_budget=2.0, explain=False)
    assert result.status is PlanningStatus.OUT_OF_TIME
    laws.says_why(case, planner, result)


def test_time_that_ends_in_a_check_within_a_planner_has_a_place(monkeypatch):
    from planners.checking import Checker, Late

    def late(self, stage, share):
        if stage == "validate":
            raise Late

    monkeypatch.setattr(Checker, "_tell", late)
    result = plan(fig19(), ArmSpec(link_length=200.0), "backbone", explain=False)
    assert result.status is PlanningStatus.OUT_OF_TIME and result.place is not None


def test_a_check_tells_before_it_looks_at_the_first_pose():
    told = []
    motion = Motion.from_configurations([0.0, 0.04], np.zeros((2, 1)), 1.0, (0.0, 0.0, 0.0))
    maze = Maze(
        name="box",
        free_space=box(-1.0, -1.0, 2.0, 1.0),
        base_pose=np.zeros(3),
        goal=np.array([1.0, 0.0]),
        goal_radius=0.1,
    )
    validate(motion, maze, progress=lambda stage, share: told.append(share))
    assert told[0] == 0.0 and told == sorted(told)


LONGEST_ARM = 1.1e-3
"""Link length in sizes of the maze: hardly more than the shortest that is planned for."""

POSING = ("track", "sweep", "beam", "as-printed", "follow", "backbone")


@pytest.mark.parametrize("planner", ["beam", "as-printed"])
def test_rules_that_run_out_of_time_with_thousands_of_links_have_a_reason_and_a_place(planner):
    maze = fig19()
    case = laws.Case(kind="fig19", maze=maze, arm=ArmSpec(link_length=LONGEST_ARM * maze.size))
    result, _ = laws.timed_plan(case, planner, 0.2)
    laws.says_why(case, planner, result)
    assert result.status is PlanningStatus.OUT_OF_TIME


@pytest.mark.parametrize("planner", [*POSING, "auto"])
def test_a_motion_that_would_fill_the_memory_is_refused_with_a_place(planner, monkeypatch):
    monkeypatch.setattr("planners.room.MOTION_BYTES", 20_000)
    case = laws.Case(kind="fig19", maze=fig19(), arm=ArmSpec(link_length=200.0))
    result, _ = laws.timed_plan(case, planner, 20.0)
    laws.says_why(case, planner, result)
    assert not result.solved and "Longer links take less" in result.reason


def test_files_hold_whatever_motions_are_made(solved, tmp_path, monkeypatch):
    _, result = solved[0]
    motion, path = result.motion, tmp_path / "motion.npz"
    motion.save(path)
    taken = motion.joints.nbytes + motion.joint_angles.nbytes + motion.feed.nbytes
    monkeypatch.setattr("planners.room.MOTION_BYTES", taken)
    assert most_poses(motion.n_links) == motion.n_poses
    monkeypatch.setattr("planners.problem.MOTION_BYTES", taken + 4096)
    assert Motion.load(path).n_poses == motion.n_poses
    monkeypatch.setattr("planners.problem.MOTION_BYTES", taken)
    with pytest.raises(InputError):
        Motion.load(path)


def test_where_time_ends_before_the_other_ways_are_tried_auto_says_so(monkeypatch):
    late, clock, beam = [0.0], time.perf_counter, PLANNERS["beam"]

    def slow(query):
        candidate = beam(query)
        late[0] = 1000.0
        return candidate

    monkeypatch.setitem(PLANNERS, "beam", slow)
    monkeypatch.setattr("time.perf_counter", lambda: clock() + late[0])
    result = plan(fig19(), ArmSpec(link_length=440.0), time_budget=100.0, explain=False)
    assert [attempt.planner for attempt in result.attempts][-1] == "beam"
    assert result.status is PlanningStatus.OUT_OF_TIME


def test_goal_states_are_looked_at_as_long_as_there_is_time(monkeypatch):
    from planners.baselines.goal_states import _roomiest

    class Arm:
        looked = 0

        def room(self, state, moves):
            self.looked += 1
            return 1

    arm, states = Arm(), [np.zeros(3)] * 9
    kept = _roomiest(arm, states, 4, np.random.default_rng(0), now())
    assert arm.looked == len(kept) == 1
