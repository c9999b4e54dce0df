"""From plan to verdict: what the simulator says of planned motions."""

import hashlib
import os
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import corridor_family, fig19
from planners import plan
from planners.controllers import PlannedPolicy
from planners.rollout import run_episode, simulate_motion

NODE_ERROR = 0.05  # px: what the arm may be off its plan


@pytest.fixture(scope="module")
def benchmark():
    """Return the motion of the paper's links through the paper's benchmark."""
    return plan(fig19(), ArmSpec(link_length=430.0), planner="beam").motion


@pytest.fixture(scope="module")
def bend():
    """Return a motion through a right-angled bend, as tight as to pass close to its inner corner."""
    return plan(corridor_family("L"), ArmSpec(link_length=560.0), planner="beam").motion


@pytest.fixture(scope="module")
def episode(benchmark):
    """Return what came of it in the simulator."""
    return simulate_motion(benchmark, fig19())


def walls_moved(inward):
    """Return the benchmark with its walls moved into the corridor."""
    return fig19(l1=200 - 2 * inward, l2=200 - 2 * inward, wall=40 + 2 * inward, end_gap=200 - 2 * inward)


def test_the_papers_links_merely_pinch_the_walls(episode):
    report = episode.report
    assert episode.success
    assert report.clean
    assert report.collision == 0 and report.largest_impulse == 0.0
    assert report.pinch > 1000 and report.pinched_links == (1, 2, 3, 4, 5, 6)
    assert report.kinematic.collision == 0


@pytest.mark.parametrize(("name", "length"), [("fig19", 439.2), ("S400", 446.0), ("stairs", 310.0)])
def test_links_at_the_physical_limit_merely_pinch_the_walls(name, length):
    maze, arm = Maze.load(name), ArmSpec(link_length=length)
    episode = simulate_motion(plan(maze, arm).motion, maze, arm)
    assert episode.success and episode.report.clean
    assert episode.report.kinematic.pinch > 0 and episode.report.kinematic.collision == 0


def test_the_arm_follows_its_plan(benchmark, episode):
    assert episode.report.node_error < NODE_ERROR
    assert episode.report.drift < NODE_ERROR
    # Every pose passed lies near one of the plan's: the arm is one substep, a quarter of a step, behind.
    tips, planned = episode.joints[1:, -1], benchmark.joints[:, -1]
    nearest = np.hypot(*(tips[:, None] - planned[None]).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() < 0.25 * 0.05 * benchmark.link_length
    assert np.hypot(*(episode.joints[-1, -1] - fig19().goal)) <= fig19().goal_radius


@pytest.mark.parametrize("inward", [1.0, 2.0, 5.0])
def test_tighter_walls_are_reported_as_collisions_of_that_depth(benchmark, inward):
    report = simulate_motion(benchmark, walls_moved(inward)).report
    exact = report.kinematic
    assert not report.clean and not exact.clean
    assert report.largest_impulse > 0.0 and exact.largest_impulse == 0.0
    # Between poses the links reach 0.02 px into the walls that they pinch.
    assert exact.worst_depth == pytest.approx(inward, abs=0.03)
    # They pinch the outer walls: the one at the left, the one across the end, the one at the right.
    walls = walls_moved(inward).walls[[touch.wall for touch in exact.collisions]].mean(axis=1)
    expected = [(-100 + inward, 800 - inward / 2), (120, 1600 - inward), (340 - inward, 800 - inward / 2)]
    np.testing.assert_allclose(sorted(walls.tolist()), expected)
    for touch in exact.collisions:
        assert -touch.clearance == pytest.approx(inward, abs=0.15)
    first = exact.first_collision
    assert first.link == 6 and first.point == pytest.approx((-100 + inward, 433), abs=2)


def test_an_inner_corner_is_named_as_pinched_and_deeper_in_as_collided(bend):
    exact = simulate_motion(bend, corridor_family("L", 200 - 2 * 2.0)).report.kinematic
    assert [touch.corner for touch in exact.pinched_corners] == [(98.0, 1402.0)]
    assert all(touch.corner is None for touch in exact.collisions)
    exact = simulate_motion(bend, corridor_family("L", 200 - 2 * 5.0)).report.kinematic
    (corner,) = [touch for touch in exact.collisions if touch.corner is not None]
    assert corner.corner == (95.0, 1405.0)
    # The moved corner itself is the reference: its distance from the deepest link of all poses.
    links = np.stack([bend.joints[:, :-1], bend.joints[:, 1:]], axis=2).reshape(-1, 2, 2)
    along = links[:, 1] - links[:, 0]
    offset = np.array(corner.corner) - links[:, 0]
    side = (along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]) / np.hypot(*along.T)
    across = (offset * along).sum(axis=1) / (along**2).sum(axis=1)
    deepest = side[(across > 0) & (across < 1) & (np.abs(side) < 20)].max()
    assert -corner.clearance == pytest.approx(deepest, abs=0.05)


def test_wider_walls_are_not_touched(benchmark):
    report = simulate_motion(benchmark, walls_moved(-5.0)).report
    assert report.clean
    assert (report.pinch, report.collision, report.kinematic.pinch) == (0, 0, 0)
    assert report.pinched_links == ()


def fingerprint(episode):
    """Return a hash of an episode to the last bit."""
    return hashlib.sha256(episode.joints.tobytes() + episode.rewards.tobytes()).hexdigest()


def test_two_runs_are_bit_identical_across_processes(benchmark, episode, tmp_path):
    benchmark.save(tmp_path / "m.npz")
    code = (
        "import hashlib, sys; from planners import Motion; from planners.rollout import simulate_motion;"
        "from hrsnake_env.mazes import fig19; e = simulate_motion(Motion.load(sys.argv[1]), fig19());"
        "print(hashlib.sha256(e.joints.tobytes() + e.rewards.tobytes()).hexdigest())"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "m.npz")],
        env={**os.environ, "PYTHONHASHSEED": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    again = simulate_motion(benchmark, fig19())
    assert fingerprint(episode) == fingerprint(again) == run.stdout.strip()


@pytest.mark.parametrize("substeps", [1, 2, 8])
def test_more_substeps_track_better(benchmark, episode, substeps):
    other = simulate_motion(benchmark, fig19(), substeps=substeps)
    assert (other.report.node_error < episode.report.node_error) == (substeps > 4)


def test_clearances_are_those_of_the_deepest_contacts(episode):
    assert episode.clearances.shape == (episode.n_steps + 1, 7)
    for clearances, touching in zip(episode.clearances, episode.contacts, strict=True):
        for contact in touching:
            assert clearances[contact.link] <= contact.clearance + 1e-9


def test_a_trace_holds_the_episode(episode):
    maze = fig19()
    trace = episode.trace(maze, title="t")
    assert (trace.title, trace.n_poses, trace.n_links, trace.link_length) == (
        "t",
        len(episode.joints),
        7,
        430.0,
    )
    assert trace.clean and trace.summary[0] == "goal reached" and trace.timestep == 0.05
    np.testing.assert_array_equal(trace.joints, episode.joints)
    assert episode.trace(maze).title == "fig19, 7 links of 430 px"


def test_links_at_the_limit_have_a_clean_verdict_too():
    motion = plan(fig19(), ArmSpec(link_length=439.2), planner="sweep").motion
    episode = simulate_motion(motion, fig19())
    assert episode.success and episode.report.clean
    assert episode.report.node_error < NODE_ERROR


def test_thick_links_are_simulated_as_thick():
    arm = ArmSpec(link_length=300.0, link_radius=15.0)
    motion = plan(fig19(), arm, planner="beam").motion
    assert simulate_motion(motion, fig19(), arm).report.clean
    thicker = ArmSpec(link_length=300.0, link_radius=20.0)
    report = simulate_motion(motion, fig19(), thicker).report
    assert not report.clean
    assert report.kinematic.worst_depth == pytest.approx(5.0, abs=0.1)


def test_a_motion_of_another_maze_is_refused(benchmark):
    other = Maze.from_corridors([(50, 0), (50, 1500)], 200.0)
    with pytest.raises(InputError, match="it belongs to another maze"):
        simulate_motion(benchmark, other)


def test_the_policy_reaches_the_goal_through_gym_make(benchmark):
    env = gym.make("HyperRedundantMaze-v0", maze="fig19", link_length=430.0, n_links=7)
    episode = run_episode(env, PlannedPolicy(benchmark), seed=0)
    assert episode.success
    assert len(episode.contacts) == len(episode.joints) == len(episode.clearances) == episode.n_steps + 1
    env.close()


def test_stable_baselines3_evaluates_the_policy_to_the_same_return(benchmark):
    evaluation = pytest.importorskip("stable_baselines3.common.evaluation")
    monitor = pytest.importorskip("stable_baselines3.common.monitor")
    make = {"maze": "fig19", "link_length": 430.0, "n_links": 7}
    env = monitor.Monitor(gym.make("HyperRedundantMaze-v0", **make))
    returns, lengths = evaluation.evaluate_policy(
        PlannedPolicy(benchmark), env, n_eval_episodes=2, return_episode_rewards=True
    )
    alone = run_episode(gym.make("HyperRedundantMaze-v0", **make), PlannedPolicy(benchmark))
    assert returns == pytest.approx([alone.rewards.sum()] * 2)
    assert lengths == [alone.n_steps] * 2
