"""Laws of the simulator: it tracks, it repeats itself, walls push back, torques are what mechanics says."""

import ctypes
import gc
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsnake_env.arm import ArmSpec, feeder_angle_limits, joints_from_configuration
from hrsnake_env.dynamics import largest_move, place_links, step_targets
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from hrsnake_env.physics import CONTROL_TIMESTEP, Physics
from hrsnake_env.simulation import simulate

LENGTH = 200.0
N_LINKS = 9
ARM = ArmSpec(link_length=LENGTH, n_links=N_LINKS)
HALL = Maze.from_corridors([(0, 0), (0, 3000)], 2500.0, name="hall")


def waves(n_poses=600, n_links=N_LINKS, length=LENGTH, amplitude=0.3):
    """Feed the arm in while joints that are out swing smoothly."""
    feed = np.linspace(0.0, 0.7 * n_links * length, n_poses)
    time = np.linspace(0.0, 12.0, n_poses)[:, None]
    swing = amplitude * np.sin(time + 0.7 * np.arange(n_links))
    out = feed[:, None] / length - (n_links - np.arange(n_links))
    return feed, swing * np.clip(0.5 * out, 0.0, 1.0) ** 2


# Tracking


def test_a_smooth_free_motion_is_tracked_to_a_hundredth_of_the_pinch_tolerance_or_so():
    feed, angles = waves()
    report = simulate(HALL, ARM, feed, angles)
    assert report.clean
    assert report.free == report.link_poses
    assert report.node_error < 0.05
    assert report.drift < 0.02
    assert report.kinematic.node_error < 1e-9


def test_the_arm_arrives_where_it_was_sent():
    feed, angles = waves()
    physics = Physics(HALL, ARM)
    for k in range(len(feed)):
        physics.advance(feed[k], angles[k])
    for _ in range(3):
        physics.settle()
    wanted = joints_from_configuration(feed[-1], angles[-1], LENGTH, HALL.base_pose)
    np.testing.assert_allclose(physics.joints, wanted, atol=0.01)
    np.testing.assert_allclose(physics.joint_angles, angles[-1], atol=1e-4)
    assert physics.feed == pytest.approx(feed[-1], abs=0.01)
    np.testing.assert_allclose(physics.tip_position, physics.joints[-1], atol=1e-9)
    assert physics.tip_heading == pytest.approx(math.pi / 2 + angles[-1].sum(), abs=1e-4)
    np.testing.assert_allclose(physics.target, [feed[-1], *angles[-1]], atol=1e-9)


def test_forty_five_links_are_tracked_as_well():
    arm = ArmSpec(link_length=LENGTH, n_links=45)
    maze = Maze.from_corridors([(0, 0), (0, 12000)], 12000.0)
    feed, angles = waves(1500, 45, amplitude=0.1)
    report = simulate(maze, arm, feed, angles)
    assert report.clean
    assert report.node_error < 0.05


def test_speeds_are_those_of_the_targets():
    physics = Physics(HALL, ARM)
    feeds = 700.0 + 2.0 * np.arange(20)
    angles = np.zeros((20, N_LINKS))
    angles[:, -1] = 0.01 * np.arange(20)
    physics.reset(feeds[0], angles[0])
    for k in range(1, 20):
        physics.advance(feeds[k], angles[k])
    assert physics.feed_speed == pytest.approx(2.0 / CONTROL_TIMESTEP, rel=1e-3)
    np.testing.assert_allclose(physics.joint_speeds, [0.0] * 8 + [0.01 / CONTROL_TIMESTEP], atol=2e-3)


@pytest.mark.parametrize("kinematic", [False, True])
def test_a_long_step_is_divided_until_no_joint_moves_far(kinematic):
    # A quarter turn of the tip link: 1.57 link lengths of way at the tip.
    physics = Physics(HALL, ARM, substeps=1, kinematic=kinematic)
    physics.reset(1500.0)
    angles = np.zeros(N_LINKS)
    angles[-1] = math.pi / 2
    physics.advance(1500.0, angles)
    physics.settle()
    wanted = joints_from_configuration(1500.0, angles, LENGTH, HALL.base_pose)
    np.testing.assert_allclose(physics.joints, wanted, atol=0.5)
    assert physics.node_error < 0.5


# Walls push back


@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("beyond", [1.0, 5.0, 20.0])
def test_a_wall_stops_what_is_sent_into_it_at_the_pinch_tolerance(beyond, substeps):
    physics = Physics(fig19(), ARM, substeps=substeps)
    end = math.asin((100.0 + beyond) / LENGTH)
    physics.reset(1200.0)
    angles = np.zeros(N_LINKS)
    for k in range(100):
        angles[-1] = end * min(1.0, (k + 1) / 60)
        physics.advance(1200.0, angles)
        if k > 80:  # held
            assert 0.0 < -physics.clearance.min() < 2 * 0.001 * LENGTH
    tip = joints_from_configuration(1200.0, angles, LENGTH, physics.maze.base_pose)[-1]
    refused = np.linalg.norm(tip - physics.tip_position)
    assert physics.node_error == pytest.approx(refused, rel=0.05)
    assert refused > 0.8 * beyond
    report = physics.report()
    assert report.largest_impulse > 0.0
    assert report.worst_depth < 0.01 * LENGTH
    assert {touch.wall for touch in report.collisions} == {7}


def test_within_the_tolerance_a_wall_does_not_push():
    physics = Physics(fig19(), ARM)
    physics.reset(1200.0)
    angles = np.zeros(N_LINKS)
    for k in range(80):
        angles[-1] = math.asin(100.1 / LENGTH) * min(1.0, (k + 1) / 60)
        physics.advance(1200.0, angles)
    report = physics.report()
    assert report.clean
    assert report.pinch > 0
    assert report.largest_impulse == 0.0
    assert report.worst_depth == pytest.approx(0.1, abs=0.01)


# Torques


def test_the_first_torque_of_a_tip_link_is_its_moment_of_inertia_times_acceleration():
    # From rest, by dq in one substep of t: acceleration dq / t^2; a rod about its end has m L^2 / 3.
    step, timestep = 1e-4, CONTROL_TIMESTEP
    physics = Physics(HALL, ARM, substeps=1)
    physics.reset(900.0)
    angles = np.zeros(N_LINKS)
    angles[-1] = step
    physics.advance(900.0, angles)
    assert physics.torques[-1] == pytest.approx(step / timestep**2 / 3.0, rel=1e-3)
    # The next joint also carries the reaction at the tip joint: 1/3 + 1/2.
    assert physics.torques[-2] == pytest.approx(step / timestep**2 * (1 / 3 + 1 / 2), rel=1e-3)
    assert physics.torques[: N_LINKS - 5].tolist() == [0.0] * (N_LINKS - 5)  # in the feeder


def test_the_feed_force_is_mass_times_acceleration():
    physics = Physics(HALL, ARM, substeps=1)
    physics.reset(900.0)
    physics.advance(900.0 + 0.001 * LENGTH, np.zeros(N_LINKS))
    assert physics.feed_force == pytest.approx(N_LINKS * 0.001 / CONTROL_TIMESTEP**2, rel=1e-9)


def test_a_torque_limit_holds_and_leaves_the_arm_behind():
    feed, angles = waves(200)
    strong, weak = Physics(HALL, ARM), Physics(HALL, ARM, torque_limit=0.05)
    peak = 0.0
    for k in range(len(feed)):
        strong.advance(feed[k], angles[k])
        peak = max(peak, np.abs(strong.torques).max())
        weak.advance(feed[k], angles[k])
        assert np.abs(weak.torques).max() <= 0.05 + 1e-12
    assert peak > 0.05
    assert weak.finite
    assert weak.report().node_error > 10 * strong.report().node_error


def test_a_torque_limit_above_all_torques_changes_nothing():
    feed, angles = waves(100)
    reports = [simulate(HALL, ARM, feed, angles, torque_limit=limit) for limit in (None, 1e6)]
    assert reports[0] == reports[1]


# Gears


@pytest.mark.parametrize(("n_links", "amplitude"), [(1, 0.0), (7, 0.3), (45, 0.1), (100, 0.03)])
@pytest.mark.parametrize("substeps", [1, 4])
def test_gears_track_a_free_motion_that_starts_abruptly(n_links, amplitude, substeps):
    size = 260.0 * n_links + 1000.0
    maze = Maze.from_corridors([(0, 0), (0, size)], size)
    feed, angles = waves(600 + 20 * n_links, n_links, amplitude=amplitude)
    report = simulate(maze, ARM, feed, angles, substeps=substeps, actuation="gear")
    assert report.clean
    assert report.free == report.link_poses
    assert report.node_error < 0.0002 * LENGTH
    assert report.drift < 0.0001 * LENGTH


def test_gears_bring_the_arm_where_it_was_sent_and_have_no_torques():
    feed, angles = waves()
    physics, usual = Physics(HALL, ARM, actuation="gear"), Physics(HALL, ARM)
    for k in range(len(feed)):
        for each in (physics, usual):
            each.advance(feed[k], angles[k])
    assert not np.array_equal(physics.joints, usual.joints)
    assert physics.feed_speed == pytest.approx(usual.feed_speed, rel=1e-3)
    np.testing.assert_allclose(physics.joint_speeds, usual.joint_speeds, atol=1e-3)
    assert physics.torques.tolist() == [0.0] * N_LINKS
    assert physics.feed_force == 0.0
    for _ in range(3):
        physics.settle()
    wanted = joints_from_configuration(feed[-1], angles[-1], LENGTH, HALL.base_pose)
    np.testing.assert_allclose(physics.joints, wanted, atol=0.01)


@pytest.mark.parametrize("beyond", [1.0, 5.0])
def test_walls_lose_against_gears(beyond):
    physics = Physics(fig19(), ARM, actuation="gear")
    physics.reset(1200.0)
    angles = np.zeros(N_LINKS)
    for k in range(100):
        angles[-1] = math.asin((100.0 + beyond) / LENGTH) * min(1.0, (k + 1) / 60)
        physics.advance(1200.0, angles)
    assert 0.8 * beyond < -physics.clearance.min() < beyond
    report = physics.report()
    assert not report.clean
    assert report.largest_impulse > 0.0
    assert {touch.wall for touch in report.collisions} == {7}


def test_gears_repeat_themselves_to_the_last_bit():
    physics = Physics(fig19(), ARM, actuation="gear")
    runs = []
    for _ in range(2):
        physics.reset(1200.0)
        trace = []
        for k in range(60):
            angles = np.zeros(N_LINKS)
            angles[-1] = -0.015 * k  # into the wall
            physics.advance(1200.0 + k, angles)
            trace.append(physics.joints)
        runs.append((np.array(trace), physics.contacts))
    assert np.array_equal(runs[0][0], runs[1][0])
    assert runs[0][1] == runs[1][1] != ()


# Determinism

DIGEST = """
import hashlib, numpy as np
from hrsnake_env.arm import ArmSpec
from hrsnake_env.mazes import fig19
from hrsnake_env.physics import Physics
arms = [
    Physics(fig19(), ArmSpec(link_length=200.0, n_links=9), actuation=actuation)
    for actuation in ("computed_torque", "gear")
]
rng = np.random.default_rng(5)
digest = hashlib.sha256()
for physics in arms + arms:
    physics.reset()
    feed, angles = 0.0, np.zeros(9)
    for _ in range(400):
        feed += rng.uniform(0.0, 8.0)
        angles += rng.uniform(-0.02, 0.02, 9)
        physics.advance(min(feed, 1700.0), angles)
        digest.update(physics.joints.tobytes() + physics.clearance.tobytes())
    digest.update(repr(physics.contacts).encode())
    assert physics.report().collision > 0
exact = Physics(fig19(), ArmSpec(link_length=200.0, n_links=9), kinematic=True)
for feed in np.linspace(700.0, 1700.0, 60):
    exact.reset(feed, np.clip(rng.normal(0.0, 0.3, 9), -0.6, 0.6))
    digest.update(repr(exact.contacts).encode() + exact.clearance.tobytes())
print(digest.hexdigest())
"""


def test_two_runs_are_bit_identical_in_processes_with_other_hashes_and_other_leftovers_in_memory():
    digests = {
        subprocess.run(
            [sys.executable, "-c", DIGEST],
            env={**os.environ, "PYTHONHASHSEED": seed, "MALLOC_PERTURB_": leftovers},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed, leftovers in (("1", "0"), ("2", "85"), ("3", "255"))
    }
    assert len(digests) == 1


def test_a_simulation_that_has_broken_down_stands_still_and_says_so():
    physics = Physics(HALL, ARM)
    physics.reset(1200.0)
    next(iter(physics._space.space.bodies)).velocity = (math.nan, 0.0)
    for k in range(3):
        physics.advance(1200.0 + k, np.zeros(N_LINKS))
    assert not physics.finite
    assert physics.node_error == math.inf
    assert not physics.report().clean
    physics.reset()
    assert physics.finite


class MallocState(ctypes.Structure):
    """What glibc says of the memory in use (`struct mallinfo2`)."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "blocks", "small_blocks", "mapped_blocks", "mapped"),
            *("most_used", "small_free", "in_use", "free", "top"),
        )
    ]


def memory_in_use():
    """Return the bytes in use outside Python's own arenas; None where nobody counts them."""
    try:
        count = ctypes.CDLL("libc.so.6").mallinfo2
    except (OSError, AttributeError):
        return None
    count.restype = MallocState
    state = count()
    return state.in_use + state.mapped


@pytest.mark.skipif(memory_in_use() is None, reason="glibc 2.33 counts memory")
@pytest.mark.parametrize("anew", [False, True], ids=["reset", "another simulator"])
def test_an_episode_gives_back_its_memory_without_the_garbage_collector(anew):
    physics, maze = Physics(fig19(), ARM), fig19()
    gc.collect()
    gc.disable()
    try:
        used = []
        for _ in range(60):
            physics = Physics(maze, ARM) if anew else physics
            physics.reset()
            physics.advance(0.1 * LENGTH, np.zeros(N_LINKS))
            used.append(memory_in_use())
    finally:
        gc.enable()
    assert used[-1] - used[10] < 50 * 40_000  # a space alone has a hundred thousand and more


def test_a_second_episode_is_bit_identical_to_the_first():
    physics = Physics(fig19(), ARM)
    runs = []
    for _ in range(2):
        physics.reset(1200.0)
        trace = []
        for k in range(60):
            angles = np.zeros(N_LINKS)
            angles[-1] = -0.015 * k  # into the wall
            physics.advance(1200.0, angles)
            trace.append(physics.joints)
        runs.append((np.array(trace), physics.contacts))
    assert np.array_equal(runs[0][0], runs[1][0])
    assert runs[0][1] == runs[1][1] != ()


# Kernels and their twins

configurations = st.tuples(st.floats(0.0, 9.0), st.lists(st.floats(-3.0, 3.0), min_size=9, max_size=9))


@given(configurations)
@settings(max_examples=100)
def test_links_lie_where_forward_kinematics_puts_them(drawn):
    feed, angles = drawn
    poses, nodes = np.empty((9, 3)), np.empty((10, 2))
    place_links(np.array([feed, *angles]), 1.0, poses, nodes)
    joints = joints_from_configuration(feed, angles, 1.0, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(nodes, joints, atol=1e-12)
    np.testing.assert_allclose(poses[:, :2], 0.5 * (joints[1:] + joints[:-1]), atol=1e-12)


@given(configurations, configurations)
@settings(max_examples=100)
def test_targets_are_linear_between_poses_and_keep_to_the_feeder(start, end):
    a, b = np.array([start[0], *start[1]]), np.array([end[0], *end[1]])
    targets = np.empty((4, 10))
    step_targets(a, b, 1.0, targets)
    linear = a + np.arange(1, 5)[:, None] / 4 * (b - a)
    limits = feeder_angle_limits(targets[:, 0], 9, 1.0)
    np.testing.assert_allclose(targets[:, 0], linear[:, 0], atol=1e-12)
    np.testing.assert_allclose(targets[:, 1:], np.clip(linear[:, 1:], -limits, limits), atol=1e-9)
    assert np.array_equal(targets[-1, 1:], np.clip(b[1:], -limits[-1], limits[-1]))
    joints = joints_from_configuration([a[0], *targets[:, 0]], [a[1:], *targets[:, 1:]], 1.0, (0.0, 0.0, 0.0))
    moves = np.linalg.norm(np.diff(joints, axis=0), axis=-1)
    assert largest_move(a, targets, 1.0) == pytest.approx(moves.max(), abs=1e-9)


# Errors


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"arm": ArmSpec(link_length=200.0)},
            r"Expected an arm with a number of links \(n_links\), got None\.",
        ),
        ({"substeps": 0}, r"Expected substeps to be a whole number of at least 1, got 0\."),
        ({"substeps": 1.5}, r"Expected substeps to be a whole number of at least 1, got 1\.5\."),
        ({"torque_limit": -1.0}, r"Expected a positive torque_limit, or None, got -1\.0\."),
        ({"actuation": "spring"}, r"Unknown actuation 'spring'\. Available: 'computed_torque', 'gear'\."),
        ({"actuation": None}, r"Unknown actuation None\. Available: 'computed_torque', 'gear'\."),
        (
            {"actuation": "gear", "torque_limit": 2.0},
            r"Expected no torque_limit with actuation 'gear', got 2\.0\.",
        ),
        (
            {"actuation": "gear", "arm": ArmSpec(link_length=200.0, n_links=201)},
            r"Expected at most 200 links with actuation 'gear', got 201\.",
        ),
        ({"torque_limit": math.nan}, r"Expected a positive torque_limit, or None, got nan\."),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    values = {"maze": HALL, "arm": ARM, **arguments}
    with pytest.raises(InputError, match=f"^{message}$"):
        Physics(values.pop("maze"), values.pop("arm"), **values)


@pytest.mark.parametrize(
    ("feed", "angles", "message"),
    [
        (0.0, np.zeros(8), r"Expected joint_angles with shape \(9,\), got \(8,\)\."),
        (math.nan, np.zeros(9), r"Expected a finite feed and finite joint_angles, got NaN or infinity\."),
        (0.0, np.full(9, np.inf), r"Expected a finite feed and finite joint_angles, got NaN or infinity\."),
    ],
)
def test_bad_targets_are_named(feed, angles, message):
    with pytest.raises(InputError, match=f"^{message}$"):
        Physics(HALL, ARM).advance(feed, angles)
