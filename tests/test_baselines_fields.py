"""Laws of the methods that move an arm by forces: virtual torques, and pseudo-inverse control with poles."""

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, MultiLineString

from hrsnake_env.arm import ArmSpec, feeder_angle_limits, joints_from_configuration
from hrsnake_env.ladder import LADDER
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from planners import PlanningStatus, plan
from planners.baselines.field_runs import Gains, new_run, new_task
from planners.baselines.pseudo_inverse import plan_pseudo_inverse
from planners.baselines.virtual_torque import plan_virtual_torque
from planners.clock import now
from planners.kernels import field_algebra, field_moves
from planners.kernels import field_arm as kernel
from planners.kernels import field_steps as steps
from planners.potential import laplace_potential
from planners.problem import Motion
from planners.query import Query

NAMES = ("virtual-torque", "pseudo-inverse")
PLANNERS = {"virtual-torque": plan_virtual_torque, "pseudo-inverse": plan_pseudo_inverse}
BOTH = pytest.mark.parametrize("planner", NAMES)

HEADING = 0.7
STATES = [
    np.array([2.6, 0.4, -0.7, 0.0, 0.0]),  # the third link is partly in the feeder
    np.array([3.5, -0.2, 1.1, 0.5, 0.0]),
    np.array([0.5, 0.0, 0.0, 0.0, 0.0]),  # only the feed can move
    np.array([3.0, 0.3, 0.2, 0.0, 0.0]),  # a joint at the base
]
EPSILON = 1e-6


def placed(state, per_link=4):
    """Return points, number of joints past the base, and places and links of control points."""
    points, places = np.zeros((len(state), 2)), np.zeros((len(state) * per_link, 2))
    links = np.zeros(len(places), dtype=np.int64)
    k = kernel.place_points(state, HEADING, points)
    n = kernel.place_controls(state, points, k, HEADING, per_link, places, links)
    return points, k, places[:n], links[:n]


def jacobian_of(state, k, function):
    """Return the derivatives of an array by the coordinates 0 to k, by central differences."""
    columns = []
    for a in range(k + 1):
        ahead, behind = state.copy(), state.copy()
        ahead[a] += EPSILON
        behind[a] -= EPSILON
        columns.append((function(ahead) - function(behind)) / (2.0 * EPSILON))
    return np.stack(columns, axis=-1)


def rung(name):
    """Return maze and arm of a rung."""
    return Maze.load(LADDER[name].maze), ArmSpec(link_length=LADDER[name].link_length)


@pytest.mark.parametrize("state", STATES)
def test_points_are_those_of_the_environment(state):
    n_links = len(state) - 1
    joints = joints_from_configuration(state[0], [0.0, *state[n_links - 1 : 0 : -1]], 1.0, (0, 0, HEADING))
    points, k, places, links = placed(state)
    np.testing.assert_allclose(points[: k + 1], joints[: -k - 2 : -1], atol=1e-12)
    arm = LineString([*joints])
    np.testing.assert_allclose(places[0], joints[-1])
    assert shapely.distance(arm, shapely.points(places)).max() < 1e-12
    assert len(places) == np.ceil(4 * state[0]) and links[0] == 1 and (np.diff(links) >= 0).all()


@pytest.mark.parametrize("state", STATES)
def test_torques_are_the_jacobian_transposed_times_forces(state):
    points, k, places, links = placed(state)
    moving = jacobian_of(state, k, lambda other: placed(other)[2][: len(places) - 1])
    forces = np.random.default_rng(1).normal(size=places.shape)
    forces[-1] = 0.0  # the last control point may vanish into the feeder
    torques = np.zeros(k + 1)
    kernel.add_torques(points, k, HEADING, places, links, forces, len(places), torques)
    np.testing.assert_allclose(torques, np.einsum("pxa,px->a", moving, forces[:-1]), atol=1e-8)


@pytest.mark.parametrize("state", STATES)
def test_drag_is_the_jacobian_transposed_times_the_jacobian(state):
    points, k, places, links = placed(state)
    moving = jacobian_of(state, k, lambda other: placed(other)[2][: len(places) - 1]).reshape(-1, k + 1)
    drag = np.zeros((k + 1, k + 1))
    kernel.fill_drag(points, k, HEADING, places[:-1], links[:-1], len(places) - 1, 0.5, drag)
    np.testing.assert_allclose(drag, moving.T @ moving + 0.5 * np.eye(k + 1), atol=1e-8)


def test_contacts_have_exact_distances_and_open_as_their_rows_say():
    state = STATES[1]
    points, k, *_ = placed(state)
    rng, contacts, row = np.random.default_rng(2), np.empty((64, 6)), np.empty(k + 1)
    seen = 0
    for _ in range(150):
        ring = rng.uniform(-1.0, 3.5, (3, 2))
        walls = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
        n, least = kernel.find_contacts(points, k, walls, 0.5, contacts)
        arm = LineString(points[k::-1])
        distance = arm.distance(MultiLineString([*walls]))
        nearest_is_the_axis = distance < 0.5 and shapely.Point(points[k]).distance(
            MultiLineString([*walls])
        ) == pytest.approx(distance)
        if not nearest_is_the_axis:  # that joint moves on the axis alone, whatever is beside it
            assert least == pytest.approx(min(distance, 0.5), abs=1e-9)
        if n == 0 or least == 0.0:
            continue
        c = int(np.argmin(contacts[:n, 4]))
        kernel.contact_row(contacts[c], points, k, HEADING, row)

        def gap(other, walls=walls, c=c, n=n):
            found, there = np.empty((64, 6)), placed(other)[0]
            return kernel.find_contacts(there, k, walls, 0.6, found)[1]

        np.testing.assert_allclose(row, jacobian_of(state, k, gap), atol=1e-4)
        seen += 1
    assert seen > 5


@pytest.mark.parametrize("n", [1, 2, 5, 20])
def test_the_damped_pseudo_inverse_is_that_of_numpy(n):
    rng = np.random.default_rng(n)
    jacobian, task, velocity = rng.normal(size=(2, n)), rng.normal(size=2), np.empty(n)
    field_algebra.redundant_velocity(jacobian, n, task, np.zeros(n), 0.3, velocity)
    damped = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + 0.09 * np.eye(2))
    np.testing.assert_allclose(velocity, damped @ task, atol=1e-9)
    field_algebra.redundant_velocity(jacobian, n, task, np.zeros(n), 1e-6, velocity)
    if n > 1:
        np.testing.assert_allclose(velocity, np.linalg.pinv(jacobian) @ task, atol=1e-6)


@pytest.mark.parametrize("n", [1, 2, 3, 20])
def test_the_null_space_term_does_not_move_the_tip(n):
    rng = np.random.default_rng(n)
    jacobian, wish, velocity = rng.normal(size=(2, n)), rng.normal(size=n), np.empty(n)
    field_algebra.redundant_velocity(jacobian, n, np.zeros(2), wish, 0.3, velocity)
    np.testing.assert_allclose(jacobian @ velocity, 0.0, atol=1e-9)
    expected = wish - np.linalg.pinv(jacobian) @ (jacobian @ wish)
    np.testing.assert_allclose(velocity, expected, atol=1e-9)
    assert n < 3 or np.abs(velocity).max() > 0.01


def test_the_field_has_unit_size_and_leads_to_larger_potentials():
    potential = laplace_potential(fig19())
    u, field = potential.u, np.zeros((*potential.u.shape, 2))
    field_moves.fill_field(u, potential.blocked_x, potential.blocked_y, field)
    j, i = np.nonzero(u > 0.0)
    sizes = np.hypot(*field[j, i].T)
    assert (np.isclose(sizes, 1.0) | (sizes == 0.0)).all() and (sizes > 0.0).mean() > 0.99
    ahead = [u[b + round(field[b, a, 1]), a + round(field[b, a, 0])] for b, a in zip(j, i, strict=True)]
    assert (np.array(ahead) >= u[j, i]).mean() > 0.99


@BOTH
@pytest.mark.parametrize("name", ["straight", "bend-i30", "s-bend-i30"])
def test_loose_rungs_pass_the_exact_checker(planner, name):
    result = plan(*rung(name), planner=planner)
    assert result.solved, result.reason
    assert result.motion.n_links <= LADDER[name].n_links


def test_virtual_torques_pass_the_papers_benchmark():
    assert plan(fig19(), ArmSpec(link_length=430.0), planner="virtual-torque").solved


@BOTH
def test_steps_are_small_and_the_feeder_is_honoured(planner):
    maze, arm = rung("u-turn-i30")
    motion = PLANNERS[planner](Query(maze=maze, arm=arm)).motion
    moved = np.linalg.norm(np.diff(motion.joints, axis=0), axis=-1)
    assert moved.max() <= (steps.LONGEST + 1e-9) * arm.link_length
    limits = feeder_angle_limits(motion.feed, motion.n_links, arm.link_length)
    assert (np.abs(motion.joint_angles) <= limits).all() and np.abs(motion.joint_angles).max() > 0.5
    # A joint passes the base at a pose.
    feed = motion.feed / arm.link_length
    passing = np.floor(feed[1:] - 1e-12) > np.floor(feed[:-1])
    assert not passing.any()


@BOTH
def test_joint_limits_are_kept(planner):
    maze, arm = rung("bend-i30")
    largest = np.abs(PLANNERS[planner](Query(maze=maze, arm=arm)).motion.joint_angles).max()
    limited = ArmSpec(link_length=arm.link_length, joint_limit=0.9 * largest)
    result = plan(maze, limited, planner=planner)
    assert result.solved, result.reason
    assert np.abs(result.motion.joint_angles).max() <= 0.9 * largest


@BOTH
def test_links_that_are_too_long_end_at_a_place_in_front_of_the_turn(planner):
    result = plan(fig19(), ArmSpec(link_length=560.0), planner=planner, explain=False)
    assert result.status is PlanningStatus.DEAD_END and "no progress" in result.reason
    assert fig19().free_space.contains(shapely.Point(result.place)) and result.place[1] > 1000.0
    np.testing.assert_allclose(result.failure.joints[-1], result.place)
    np.testing.assert_allclose(result.failure.joints[0], fig19().base_pose[:2])


@BOTH
def test_a_deadline_ends_planning(planner):
    query = Query(maze=fig19(), arm=ArmSpec(link_length=60.0), deadline=now())
    candidate = PLANNERS[planner](query)
    assert candidate.status is PlanningStatus.OUT_OF_TIME and "time was over" in candidate.reason


@BOTH
def test_the_checker_decides_which_gains_are_taken(planner):
    maze, arm = rung("bend-i30")
    asked: list[Motion] = []

    class Report:
        valid, penetration, penetration_between = False, 0.0, 0.0

    def checker(motion):
        asked.append(motion)
        report = Report()
        report.penetration = -float(len(asked))
        report.penetration_between = -float(len(asked))
        return report

    candidate = PLANNERS[planner](Query(maze=maze, arm=arm, checker=checker))
    assert len(asked) > 1 and candidate.motion is asked[-1]


@BOTH
@pytest.mark.parametrize(("name", "length"), [("clutter-3", 90.0), ("random-test-1", 60.0)])
def test_any_maze_has_an_outcome(planner, name, length):
    result = plan(Maze.load(name), ArmSpec(link_length=length), planner=planner, explain=False)
    assert result.solved or (result.reason and result.place is not None)


@BOTH
def test_thick_links_keep_their_radius_from_the_walls(planner):
    maze, arm = rung("bend-i30")
    thick = ArmSpec(link_length=arm.link_length, link_radius=10.0)
    result = plan(maze, thick, planner=planner)
    assert result.solved, result.reason


def test_a_step_stops_short_of_walls():
    maze, arm = rung("bend-i60")
    query = Query(maze=maze, arm=arm)
    run = new_run(6, 4)
    task = new_task(query, query.geometry, Gains(barrier=1e-9, reach=0.2), 4)
    run.state[:2] = 1.8, 0.0
    velocity, least = np.array([0.0, 1.0]), 1.0
    for _ in range(200):  # turning the link into the wall beside it
        k, _, n_contacts, least = steps.place(task, run)
        steps.advance(task, run, k, n_contacts, velocity, 1.0)
    assert steps.MARGIN <= least < 2.0 * steps.MARGIN
