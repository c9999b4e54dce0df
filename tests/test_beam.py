"""The beam planner as a whole: runs of the paper's rules, as printed and clamped."""

import math

import numpy as np
import pytest
import shapely

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS, fig19
from planners import plan, validate
from planners.beam_planner import AS_PRINTED, CLAMPED, STEP, FedArm, Rules, plan_beam, run_beam
from planners.kernels.beam_arm import FULL, GOAL
from planners.kernels.beam_rules import turn_between
from planners.kernels.beam_types import AXIS, CHOICE, CLOSEST, EDGE, PATH, PIECES, TANGENT, TARGET
from planners.query import Query
from planners.rollout import simulate_motion

BOTH = pytest.mark.parametrize("rules", [AS_PRINTED, CLAMPED], ids=["as printed", "clamped"])


def query(maze, length):
    """Return a query for thin links."""
    return Query(maze=maze, arm=ArmSpec(link_length=length))


def depth(length, rules, maze=None):
    """Return how deep, in link lengths, links get into walls at the poses of a run."""
    maze = fig19() if maze is None else maze
    return validate(plan_beam(query(maze, length), rules).motion, maze).penetration / length


@pytest.mark.parametrize("length", [200.0, 250.0, 300.0, 350.0, 400.0, 430.0, 436.0])
def test_the_paper_s_rules_as_printed_pass_the_benchmark(length):
    # Section 5.1: I = 430 / 440 = 0.98, with nothing added to the rules.
    result = plan(fig19(), ArmSpec(link_length=length), planner="as-printed")
    assert result.solved, result.reason
    assert result.report.penetration == 0.0


@pytest.mark.parametrize("length", [437.0, 438.0, 439.0, 439.5])
def test_clamped_rules_pass_the_benchmark_up_to_the_longest_rod(length):
    assert plan(fig19(), ArmSpec(link_length=length), planner="beam").solved


@pytest.mark.parametrize("length", [150.0, 430.0])
def test_as_printed_the_simulated_links_merely_pinch_the_walls(length):
    motion = plan(fig19(), ArmSpec(link_length=length), planner="as-printed").motion
    episode = simulate_motion(motion, fig19())
    assert episode.success and episode.report.clean


@pytest.mark.parametrize("name", ["fig19", "fig17b", "fig17c"])
def test_clamped_rules_solve_workspaces_of_the_paper_at_their_link_lengths(name):
    result = plan(Maze.load(name), ArmSpec(link_length=PAPER_LINK_LENGTHS[name]), planner="beam")
    assert result.solved, result.reason


def test_clamped_links_are_in_no_wall_even_where_the_arm_gets_stuck():
    maze = Maze.load("fig17a")
    asked = query(maze, 245.0)
    run = run_beam(asked.geometry, asked.arm, CLAMPED, record=False)
    assert run.ending != GOAL
    joints = run.motion(maze).joints[::7]
    links = shapely.linestrings(np.stack([joints[:, :-1], joints[:, 1:]], axis=2))
    in_front = joints[:, 1:, 1] > maze.base_pose[1] + 245.0
    assert in_front.sum() > 1000
    assert shapely.covers(maze.free_space, links[in_front]).all()


def test_without_blocking_by_a_tangent_guide_links_cut_the_corner():
    assert depth(430.0, Rules(clamp=False, tangent_blocks=False)) > 0.1


def test_without_blocking_by_a_jump_shorter_links_poke_the_walls():
    assert depth(350.0, Rules(clamp=False, jump_blocks=False)) > 1e-3
    assert depth(350.0, AS_PRINTED) == 0.0


def test_the_more_a_jump_is_softened_the_deeper_links_get():
    degrees = [depth(430.0, Rules(clamp=False, softening_degree=degree)) for degree in (3, 10, 30)]
    assert degrees[0] == 0.0 < degrees[1] < degrees[2]


def test_softening_does_without_jumps_of_joints():
    steps = []
    for degree in (0, 3):
        motion = plan_beam(query(fig19(), 430.0), Rules(clamp=False, softening_degree=degree)).motion
        steps.append(np.hypot(*np.diff(motion.joints, axis=0).reshape(-1, 2).T).max() / 430.0)
    assert steps[0] > 0.05 > steps[1]


@BOTH
def test_no_joint_moves_farther_than_a_step(rules):
    motion = plan_beam(query(fig19(), 430.0), rules).motion
    assert np.hypot(*np.diff(motion.joints, axis=0).reshape(-1, 2).T).max() <= STEP * 430.0 * (1 + 1e-9)
    assert (np.diff(motion.feed) > 0.0).all()


@BOTH
def test_fed_pose_by_pose_the_arm_does_the_same(rules):
    asked = query(fig19(), 430.0)
    run = run_beam(asked.geometry, asked.arm, rules)
    fed = FedArm(asked.geometry, asked.arm, rules)
    ending = FULL
    while ending == FULL:
        ending, _ = fed.feed(1)
    assert ending == run.ending == GOAL
    np.testing.assert_array_equal(fed.headings[: fed.n_poses], run.headings)
    np.testing.assert_array_equal(fed.record[: fed.n_poses], run.record)


def test_every_link_points_where_the_record_says():
    asked = query(fig19(), 430.0)
    geometry = asked.geometry
    run = run_beam(geometry, asked.arm, AS_PRINTED)
    motion = run.motion(fig19())
    ends = {EDGE: geometry.beams.left, PATH: geometry.path.points}  # a right corner: edges are on the left
    seen = set()
    for pose in range(1, motion.n_poses):
        joints = motion.joints[pose, ::-1]
        for k, row in enumerate(run.record[pose, : run.n_links]):
            heading, target = run.headings[pose, k], row[TARGET]
            if row[CHOICE] == AXIS:
                assert heading == pytest.approx(math.pi / 2)
                continue
            past_base = joints[k + 1, 1] - fig19().base_pose[1]
            if row[PIECES] > 0 or past_base < 0.2 * 430.0:  # softened, or not yet let go by the feeder
                continue
            start, choice = joints[k + 1], int(row[CHOICE])
            seen.add(choice)
            if choice == TANGENT:
                to_target = np.arctan2(*(geometry.path.points[target] - start)[::-1])
                assert abs(turn_between(heading, to_target)) < 1e-9
            elif target < len(geometry.path.points) - 1:
                a, b = ends[choice][target - 1 : target + 1]
                assert shapely.LineString([a, b]).distance(shapely.Point(joints[k])) < 1e-6
    assert seen == {TANGENT, EDGE, PATH}


def test_the_closest_path_point_through_the_beams_is_about_the_nearest_one():
    asked = query(fig19(), 430.0)
    path = asked.geometry.path
    run = run_beam(asked.geometry, asked.arm, AS_PRINTED)
    joints = run.motion(fig19()).joints[:, ::-1]
    for pose in range(1, len(run.feeds), 5):
        for k in np.flatnonzero(run.record[pose, : run.n_links, CHOICE] != AXIS):
            start, found = joints[pose, k + 1], run.record[pose, k, CLOSEST]
            near = slice(max(0, found - 30), found + 31)
            nearest = np.hypot(*(path.points[near] - start).T).min()
            assert np.hypot(*(path.points[found] - start)) <= nearest + 0.25 * path.width


def test_a_straight_corridor_has_no_corners_and_is_solved():
    maze = Maze.from_corridors([(0, 0), (0, 1500)], 200.0)
    assert query(maze, 300.0).geometry.corners == []
    for planner in ("beam", "as-printed"):
        assert plan(maze, ArmSpec(link_length=300.0), planner=planner).solved


@pytest.mark.parametrize(("degrees", "critical", "semi"), [(20, 0, 0), (42, 0, 1), (90, 1, 0)])
def test_slight_bends_are_semi_critical_and_sharp_ones_critical(degrees, critical, semi):
    angle = math.radians(90.0 - degrees)
    end = 900.0 * np.array([math.cos(angle), math.sin(angle)])
    maze = Maze.from_corridors(np.stack([(0, 0), (0, 1000), np.add((0, 1000), end)]), 200.0)
    geometry = query(maze, 300.0).geometry
    assert (len(geometry.corners), len(geometry.semi_critical)) == (critical, semi)
    every = [*geometry.corners, *geometry.semi_critical]
    assert all(corner.name == "right" for corner in every)
    assert [corner.critical for corner in every] == [True] * critical + [False] * semi


def test_a_negative_degree_is_refused():
    with pytest.raises(InputError, match="Expected a softening_degree of at least 0, got -1"):
        Rules(softening_degree=-1)
