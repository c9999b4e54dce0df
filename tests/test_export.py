"""Trajectories out: limits, ends, walls, and every format."""

import csv
import dataclasses
import io
import json
import math
import xml.etree.ElementTree as Xml
from itertools import pairwise

import numpy as np
import pytest
import typer
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline
from typer.testing import CliRunner

from hrsnake_env import ArmSpec, Maze
from hrsnake_env.arm import joints_from_configuration
from hrsnake_env.errors import InputError
from planners import plan
from planners.cli_export import export_command
from planners.export import (
    EXPORTS,
    ExportRefused,
    Trajectory,
    TrajectoryLimits,
    check_trajectory,
    checking,
    export,
    export_bytes,
    fastest_duration,
    format_for,
    largest_shares,
    rounding,
    safe_trajectory,
    save_export,
    time_parametrise,
)
from planners.export.kinematics import configurations, kinematics_of
from planners.export.units import METRES, metres_in
from planners.export.urdf import urdf_bytes
from planners.problem import Motion
from planners.spatial.problem import SpatialMotion

MAZE = Maze.load("L")
LINK = 300.0
LIMITS = TrajectoryLimits(joint_speed=1.0, joint_acceleration=3.0, feed_speed=200.0, feed_acceleration=400.0)


@pytest.fixture(scope="module")
def motion() -> Motion:
    result = plan(MAZE, ArmSpec(link_length=LINK), planner="sweep")
    assert result.motion is not None
    return result.motion


@pytest.fixture(scope="module")
def trajectory(motion: Motion) -> Trajectory:
    return safe_trajectory(motion, MAZE, limits=LIMITS)[0]


def cubic(trajectory: Trajectory) -> CubicHermiteSpline:
    """Return what a controller drives that interpolates positions and velocities."""
    positions, velocities, _ = trajectory.table()
    return CubicHermiteSpline(trajectory.time, positions, velocities)


def test_limits_hold_between_samples_too(trajectory: Trajectory) -> None:
    times = np.linspace(0.0, trajectory.duration, 40 * trajectory.n_points)
    driven = cubic(trajectory)
    for order, feed, joint in ((1, 200.0, 1.0), (2, 400.0, 3.0)):
        largest = np.abs(driven(times, order)).max(axis=0)
        assert largest[0] <= feed * 1.001
        assert largest[1:].max() <= joint * 1.001
    shares = largest_shares(trajectory, LIMITS)
    assert 0.9 < max(shares.values()) <= 1.001  # and at least one of them is used


def test_largest_shares_are_those_of_the_cubics(trajectory: Trajectory) -> None:
    times = np.linspace(0.0, trajectory.duration, 40 * trajectory.n_points)
    speed = np.abs(cubic(trajectory)(times, 1)).max(axis=0)
    shares = largest_shares(trajectory, LIMITS)
    assert shares["feed_speed"] == pytest.approx(speed[0] / 200.0, rel=1e-3)
    assert shares["joint_speed"] == pytest.approx(speed[1:].max(), rel=1e-3)


def test_accelerations_are_those_of_the_cubics(trajectory: Trajectory) -> None:
    *_, accelerations = trajectory.table()
    inner = trajectory.time[1:-1]
    for side in (-1e-9, 1e-9):
        assert cubic(trajectory)(inner + side, 2) == pytest.approx(accelerations[1:-1], abs=1e-3)


def test_a_trajectory_starts_and_ends_at_rest_at_the_ends_of_the_motion(
    motion: Motion, trajectory: Trajectory
) -> None:
    _, velocities, accelerations = trajectory.table()
    for sample in (0, -1):
        assert not velocities[sample].any()
        assert not accelerations[sample].any()
        assert trajectory.feed[sample] == pytest.approx(motion.feed[sample], abs=1e-9)
        assert trajectory.joint_angles[sample] == pytest.approx(motion.joint_angles[sample], abs=1e-12)


def test_no_trajectory_is_faster_than_the_feed_alone(motion: Motion, trajectory: Trajectory) -> None:
    assert fastest_duration(motion, LIMITS) < trajectory.duration


def test_a_trajectory_keeps_to_the_way_of_the_motion_in_its_order(motion: Motion) -> None:
    deviation = 1e-3
    trajectory = time_parametrise(motion, LIMITS, deviation=deviation, rate=200.0)
    joints = joints_from_configuration(trajectory.feed, trajectory.joint_angles, LINK, motion.base_pose)
    nearest = [
        int(np.argmin(np.linalg.norm(motion.joints - pose, axis=2).max(axis=1))) for pose in joints[::20]
    ]
    assert (np.diff(nearest) >= 0).all()
    assert nearest[0] == 0
    assert nearest[-1] >= motion.n_poses - 3
    assert trajectory.deviation <= 2.0 * deviation * LINK


def test_a_smaller_deviation_stays_closer_and_takes_longer(motion: Motion) -> None:
    loose, close = (time_parametrise(motion, LIMITS, deviation=deviation) for deviation in (1e-2, 1e-3))
    assert close.deviation < loose.deviation
    assert close.duration > loose.duration


@settings(max_examples=5, deadline=None)
@given(factor=st.floats(0.3, 4.0))
def test_time_runs_as_fast_as_the_clock(motion: Motion, factor: float) -> None:
    """Speeds times f, accelerations times f^2, f times as many samples: all in a time divided by f."""
    faster = TrajectoryLimits(
        joint_speed=factor * LIMITS.joint_speed,
        joint_acceleration=factor**2 * LIMITS.joint_acceleration,
        feed_speed=factor * 200.0,
        feed_acceleration=factor**2 * 400.0,
    )
    slow, fast = (
        time_parametrise(motion, limits, rate=rate)
        for limits, rate in ((LIMITS, 50.0), (faster, 50.0 * factor))
    )
    assert fast.duration * factor == pytest.approx(slow.duration, rel=1e-3, abs=0.05)


def test_joints_in_the_feeder_are_straight(trajectory: Trajectory) -> None:
    times = np.linspace(0.0, trajectory.duration, 20 * trajectory.n_points)
    driven = cubic(trajectory)(times)
    past = driven[:, :1] / LINK - (trajectory.n_links - np.arange(trajectory.n_links))
    assert (past < 0.0).any()
    assert np.abs(driven[:, 1:][past < 0.0]).max() <= 1e-15


def test_a_joint_that_is_released_just_before_the_end_is_straight_till_then() -> None:
    feed = np.linspace(0.0, 1.03, 52)
    angles = np.zeros((52, 3))
    angles[:, 2] = 0.02 * np.clip(feed - 1.0, 0.0, None)
    trajectory = time_parametrise(Motion.from_configurations(100.0 * feed, 0.0 + angles, 100.0, [0, 0, 0]))
    times = np.linspace(0.0, trajectory.duration, 20 * trajectory.n_points)
    driven = cubic(trajectory)(times)
    assert driven[-1, 3] == pytest.approx(angles[-1, 2])
    assert np.abs(driven[:, 3][driven[:, 0] < 100.0]).max() <= 1e-9


def test_what_is_exported_is_valid_at_twice_as_many_moments(trajectory: Trajectory) -> None:
    assert check_trajectory(trajectory, MAZE, limits=LIMITS).valid
    times = np.linspace(0.0, trajectory.duration, 2 * trajectory.n_points - 1)
    driven = cubic(trajectory)
    position, velocity, acceleration = driven(times), driven(times, 1), driven(times, 2)
    finer = dataclasses.replace(
        trajectory,
        time=times,
        feed=position[:, 0],
        joint_angles=position[:, 1:],
        feed_velocity=velocity[:, 0],
        joint_velocities=velocity[:, 1:],
        feed_acceleration=acceleration[:, 0],
        joint_accelerations=acceleration[:, 1:],
    )
    assert check_trajectory(finer, MAZE, limits=LIMITS).valid


def test_a_motion_that_bends_joints_at_the_base_at_once_is_followed_too() -> None:
    maze, arm = Maze.load("fig19"), ArmSpec(link_length=LINK)
    motion = plan(maze, arm, planner="beam").motion
    assert motion is not None
    trajectory, report = safe_trajectory(motion, maze, arm)
    assert report.valid
    assert max(largest_shares(trajectory, TrajectoryLimits()).values()) <= 1.001


def test_a_motion_that_draws_the_arm_back_is_followed_too(motion: Motion) -> None:
    order = np.concatenate([np.arange(200), np.arange(198, 100, -1), np.arange(101, motion.n_poses)])
    back = Motion.from_configurations(motion.feed[order], motion.joint_angles[order], LINK, MAZE.base_pose)
    trajectory, report = safe_trajectory(back, MAZE)
    assert report.valid
    assert trajectory.duration > fastest_duration(back) > fastest_duration(motion)
    assert trajectory.feed_velocity.min() < -0.5 * LINK * 0.9


def test_a_refusal_says_where_and_what_helps(motion: Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checking, "DEVIATIONS", (900.0,))  # paths that cut the corner
    monkeypatch.setattr(rounding, "SPACING", 2.0)
    sentence = r"^No trajectory at 50 samples .* Link \d+.* s\. Try a larger --rate"
    with pytest.raises(ExportRefused, match=sentence) as refusal:
        safe_trajectory(motion, MAZE)
    assert refusal.value.report is not None
    assert not refusal.value.report.valid


def test_a_forged_collision_is_refused_with_its_time(trajectory: Trajectory) -> None:
    angles = trajectory.joint_angles.copy()
    middle = int(0.9 * trajectory.n_points)
    bump = np.exp(-(((np.arange(trajectory.n_points) - middle) / 10.0) ** 2))
    angles[:, -1] += 0.5 * bump * (trajectory.feed > LINK)
    forged = dataclasses.replace(trajectory, joint_angles=angles)
    report = check_trajectory(forged, MAZE)
    kinds = {fault.kind for fault in report.faults}
    assert kinds & {"penetration", "sweep"}
    assert all(" s" in fault.message and "pose" not in fault.message for fault in report.faults)


def test_forged_velocities_and_speeds_are_refused(trajectory: Trajectory) -> None:
    halved = dataclasses.replace(trajectory, time=trajectory.time / 2.0)
    assert {fault.kind for fault in check_trajectory(halved, MAZE, limits=LIMITS).faults} >= {"limits"}
    velocities = trajectory.joint_velocities.copy()
    velocities[-1] = 0.1
    moving = dataclasses.replace(trajectory, joint_velocities=velocities)
    assert "rest" in {fault.kind for fault in check_trajectory(moving, MAZE).faults}


def test_a_motion_that_is_not_valid_is_not_exported(motion: Motion) -> None:
    half = Motion.from_configurations(
        motion.feed[: motion.n_poses // 2], motion.joint_angles[: motion.n_poses // 2], LINK, motion.base_pose
    )
    for name in ("csv", "urdf"):
        with pytest.raises(
            ExportRefused, match="The motion is not valid in 'L', so it is not exported: The tip"
        ):
            export_bytes(half, MAZE, format=name, metres_per_unit=1.0)


def test_csv_json_and_npz_hold_the_same_numbers(motion: Motion, trajectory: Trajectory) -> None:
    files = {name: export_bytes(motion, MAZE, None, name, LIMITS) for name in ("csv", "json", "npz")}
    header, *rows = csv.reader(io.StringIO(files["csv"].decode()))
    assert header[:3] == ["time_s", "feed_px", "joint_0_rad"]
    assert len(set(header)) == len(header)
    table = np.array(rows, dtype=np.float64)
    wanted = np.column_stack([trajectory.time, *trajectory.table()])
    assert np.abs(table - wanted).max() <= 1e-12
    data = json.loads(files["json"])
    arrays = np.load(io.BytesIO(files["npz"]))
    for name in ("time", "feed", "joint_angles", "joint_velocities", "joint_accelerations", "base_pose"):
        assert np.array_equal(np.array(data[name]), getattr(trajectory, name))
        assert np.array_equal(arrays[name], getattr(trajectory, name))
    assert data["joint_names"] == list(trajectory.joint_names) == arrays["joint_names"].tolist()


@pytest.mark.parametrize("name", ["ros2-yaml", "ros2-json"])
def test_messages_have_the_fields_of_the_message_definition(
    motion: Motion, trajectory: Trajectory, name: str
) -> None:
    text = export_bytes(motion, MAZE, None, name, LIMITS, metres_per_unit=0.001)
    message = yaml.load(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    if name == "ros2-json":
        assert json.loads(text) == message  # YAML 1.1 reads no number as a string
    assert list(message) == ["header", "joint_names", "points"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert message["joint_names"] == list(trajectory.joint_names)
    moments = []
    for point in message["points"]:
        assert list(point) == ["positions", "velocities", "accelerations", "effort", "time_from_start"]
        assert point["effort"] == []
        for key in ("positions", "velocities", "accelerations"):
            assert [type(value) for value in point[key]] == [float] * len(trajectory.joint_names)
        start = point["time_from_start"]
        assert list(start) == ["sec", "nanosec"]
        assert 0 <= start["nanosec"] < 1_000_000_000
        moments.append(start["sec"] * 1_000_000_000 + start["nanosec"])
    assert all(before < after for before, after in pairwise(moments))
    assert moments[-1] == pytest.approx(1e9 * trajectory.duration, abs=1.0)
    positions = np.array([point["positions"] for point in message["points"]])
    assert np.allclose(positions[:, 0], 0.001 * trajectory.feed, rtol=0.0, atol=1e-12)
    assert np.array_equal(positions[:, 1:], trajectory.joint_angles)


def joint_places(robot: Xml.Element, positions: dict[str, float]) -> dict[str, np.ndarray]:
    """Compute where the frame of each link of a URDF is (forward kinematics)."""
    frames = {"maze": np.eye(4)}
    joints = robot.findall("joint")
    while joints:
        joint = next(one for one in joints if one.find("parent").get("link") in frames)
        joints.remove(joint)
        origin = joint.find("origin")
        local = np.eye(4)
        roll, pitch, yaw = map(float, origin.get("rpy").split())
        local[:3, :3] = turned((0, 0, 1), yaw) @ turned((0, 1, 0), pitch) @ turned((1, 0, 0), roll)
        local[:3, 3] = list(map(float, origin.get("xyz").split()))
        moved = np.eye(4)
        if joint.get("type") != "fixed":
            axis = np.array(list(map(float, joint.find("axis").get("xyz").split())))
            value = positions[joint.get("name")]
            if joint.get("type") == "prismatic":
                moved[:3, 3] = value * axis
            else:
                moved[:3, :3] = turned(axis, value)
        frames[joint.find("child").get("link")] = frames[joint.find("parent").get("link")] @ local @ moved
    return {name: frame[:3, 3] for name, frame in frames.items()}


def turned(axis: tuple[float, ...], angle: float) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=float)
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def test_the_urdf_puts_the_joints_where_the_motion_has_them(motion: Motion, trajectory: Trajectory) -> None:
    arm = ArmSpec(link_length=LINK, joint_limit=3.0)
    robot = Xml.fromstring(export_bytes(motion, MAZE, arm, "urdf", LIMITS, metres_per_unit=0.001))
    moving = [joint for joint in robot.findall("joint") if joint.get("type") != "fixed"]
    assert [joint.get("name") for joint in moving] == list(trajectory.joint_names)
    assert float(moving[1].find("limit").get("upper")) == 3.0
    for pose in (0, motion.n_poses // 2, motion.n_poses - 1):
        values = [0.001 * motion.feed[pose], *motion.joint_angles[pose]]
        places = joint_places(robot, dict(zip(trajectory.joint_names, values, strict=True)))
        for joint in range(motion.n_links):
            wanted = [*(0.001 * motion.joints[pose, joint]), 0.0]
            assert places[f"link_{joint}"] == pytest.approx(wanted, abs=1e-9)
        assert places["tip"][:2] == pytest.approx(0.001 * motion.joints[pose, -1], abs=1e-9)


@pytest.mark.parametrize("radius", [0.0, 8.0])
def test_the_links_of_the_urdf_can_exist(motion: Motion, radius: float) -> None:
    arm = ArmSpec(link_length=LINK, link_radius=radius)
    text = export_bytes(motion, MAZE, arm, "urdf", metres_per_unit=0.001)
    for link in Xml.fromstring(text).iter("inertial"):
        assert float(link.find("mass").get("value")) > 0.0
        moments = sorted(float(link.find("inertia").get(key)) for key in ("ixx", "iyy", "izz"))
        assert 0.0 < moments[2] <= moments[0] + moments[1]


@pytest.fixture(scope="module")
def motion_in_space() -> SpatialMotion:
    """Return an arm of three links that is pushed out of the feeder and bends both ways."""
    feed = np.linspace(0.0, 2.5, 126)
    past = np.clip(feed[:, None] - np.array([3.0, 2.0, 1.0]), 0.0, None)
    angles = np.stack([0.6 * past**2, -0.4 * past**2], axis=2)
    return SpatialMotion.from_configurations(50.0 * feed, angles, 50.0, [1.0, 2.0, 3.0, 0.6, 0.0, 0.8])


def test_universal_joints_hold_the_poses_of_a_motion_in_space(motion_in_space: SpatialMotion) -> None:
    joints = 50.0 * kinematics_of(motion_in_space).joints(configurations(motion_in_space))
    assert joints == pytest.approx(motion_in_space.joints, abs=1e-9)


def test_a_motion_in_space_gets_its_time_within_limits(motion_in_space: SpatialMotion) -> None:
    trajectory = time_parametrise(motion_in_space)
    assert trajectory.joint_angles.shape[1:] == (3, 2)
    assert trajectory.joint_names[:3] == ("feed", "joint_0_yaw", "joint_0_pitch")
    assert 0.9 < max(largest_shares(trajectory, TrajectoryLimits()).values()) <= 1.001
    assert trajectory.deviation <= 1e-3 * 50.0
    assert not trajectory.joint_angles[:, 0].any()  # it never leaves the feeder


def test_the_urdf_in_space_puts_the_joints_where_the_motion_has_them(motion_in_space: SpatialMotion) -> None:
    moved, arm = motion_in_space, ArmSpec(link_length=50.0)
    robot = Xml.fromstring(urdf_bytes(moved, arm, TrajectoryLimits(), 0.01, "room"))
    values = configurations(moved)[-1] * np.array([0.5, *[1.0] * 6])
    names = time_parametrise(moved).joint_names
    places = joint_places(robot, dict(zip(names, values, strict=True)))
    for joint in range(3):
        assert places[f"link_{joint}"] == pytest.approx(0.01 * moved.joints[-1, joint], abs=1e-9)
    assert places["tip"] == pytest.approx(0.01 * moved.joints[-1, -1], abs=1e-9)


def test_what_does_not_fit_together_is_refused_in_a_sentence(motion_in_space: SpatialMotion) -> None:
    with pytest.raises(InputError, match=r"Expected one of csv, .* for a motion in space, got 'gif'"):
        export(motion_in_space, MAZE, format="gif")
    with pytest.raises(InputError, match="Expected a motion in the plane with a maze"):
        export(motion_in_space, MAZE)


def test_units_with_a_length_are_known_and_others_asked_for() -> None:
    assert [metres_in(unit) for unit in METRES] == list(METRES.values())
    assert metres_in("px", 0.5) == 0.5
    with pytest.raises(InputError, match=r"Expected the length of one px in metres \(--metres-per-unit"):
        metres_in("px")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"joint_speed": 0.0}, "Expected a positive, finite joint_speed, got 0.0."),
        ({"joint_acceleration": math.nan}, "Expected a positive, finite joint_acceleration, got nan."),
        ({"feed_speed": "fast"}, "Expected a positive, finite feed_speed, got 'fast'."),
        ({"feed_acceleration": -1.0}, "Expected a positive, finite feed_acceleration, got -1.0."),
    ],
)
def test_bad_limits_are_refused_in_a_sentence(values: dict[str, float], message: str) -> None:
    with pytest.raises(InputError) as error:
        TrajectoryLimits(**values)
    assert str(error.value) == message


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"format": "xls"}, "Unknown format 'xls'. Available: csv"),
        ({"rate": 0.0}, "Expected a rate between"),
        ({"rate": math.nan}, "Expected a rate between"),
        ({"metres_per_unit": -1.0, "format": "urdf"}, "Expected metres per unit between"),
        ({"format": "ros2-yaml"}, "Expected the length of one px in metres"),
        ({"limits": TrajectoryLimits(joint_speed=1e-300)}, "Expected speeds between"),
        ({"limits": TrajectoryLimits(feed_speed=1e-3)}, "Expected a trajectory of at most"),
    ],
)
def test_bad_options_are_refused_in_a_sentence(motion: Motion, options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        export(motion, MAZE, **options)


def test_the_ending_says_the_format() -> None:
    for name, entry in EXPORTS.items():
        if name != "ros2-json":
            assert format_for(f"arm{entry.ending}") == name
    assert format_for("arm.YML") == "ros2-yaml"
    with pytest.raises(InputError, match=r"Expected a file name ending in \.csv, \.json"):
        format_for("arm.txt")


def test_nothing_is_left_of_an_export_that_fails(motion: Motion, tmp_path) -> None:
    with pytest.raises(InputError):
        save_export(motion, MAZE, path=tmp_path / "arm.yaml")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def command():
    app = typer.Typer()
    app.command()(export_command)
    return lambda *words: CliRunner().invoke(app, [str(word) for word in words])


def test_the_command_writes_and_tells(motion: Motion, tmp_path, command) -> None:
    motion.save(tmp_path / "m.npz")
    run = command("L", tmp_path / "m.npz", "--out", tmp_path / "arm.csv", "--json")
    assert run.exit_code == 0, run.output
    data = json.loads(run.stdout)
    assert data["validation"]["valid"]
    assert data["points"] == len((tmp_path / "arm.csv").read_text().splitlines()) - 1
    assert max(data["shares_of_limits"].values()) <= 1.001
    run = command("L", tmp_path / "m.npz", "--out", tmp_path / "arm.npz")
    assert run.exit_code == 0
    assert "% of the limit" in run.stdout


def test_the_command_refuses_a_motion_of_too_tight_an_arm_with_exit_code_3(
    motion: Motion, tmp_path, command
) -> None:
    motion.save(tmp_path / "m.npz")
    run = command("L", tmp_path / "m.npz", "--out", tmp_path / "arm.csv", "--joint-limit", "1", "--json")
    assert run.exit_code == 3
    assert "joint limit" in json.loads(run.stdout)["validation"]["faults"][0]["kind"]
    assert not (tmp_path / "arm.csv").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--out", "arm.txt"), "Expected a file name ending in"),
        (("--out", "arm.csv", "--format", "json"), "Expected a file name ending in .json"),
        (("--out", "arm.csv", "--joint-speed", "0"), "Expected a positive, finite --joint-speed, got 0."),
        (("--out", "arm.csv", "--feed-speed", "nan"), "Expected a positive, finite --feed-speed, got nan."),
        (("--out", "nowhere/arm.csv"), "Expected an existing folder"),
        (("--out", "arm.csv", "--joint-limit", "999"), "Expected --joint-limit over 0"),
    ],
)
def test_bad_words_raise_one_sentence(words, message, motion: Motion, tmp_path, command, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    motion.save(tmp_path / "m.npz")
    run = command("L", "m.npz", *words)
    assert isinstance(run.exception, InputError)
    assert message in str(run.exception)
