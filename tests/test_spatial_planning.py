"""Laws of planning in space: what is solved is valid, what is not says why, units and axes do not matter."""

import dataclasses
import math
from functools import cache

import numpy as np
import pytest

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners import PlanningStatus
from planners.kernels.spatial_track import overlap
from planners.spatial.panel import Panel
from planners.spatial.path import Path
from planners.spatial.planning import PLANNERS, plan
from planners.spatial.problem import SpatialCandidate
from planners.spatial.rooms import paired_panels, random_room
from planners.spatial.validation import signed_distances, validate
from planners.spatial.workspace import SIDES, Workspace


def room(**changes):
    """Return a room of 200 by 150 by 120, empty unless told otherwise."""
    values = {"name": "room", "room_low": np.zeros(3), "room_high": [200.0, 150.0, 120.0]}
    values |= {"open_sides": ("x-",), "base": [0.0, 70.0, 60.0], "heading": [1.0, 0.0, 0.0], "straight": 20.0}
    return Workspace(**(values | {"goal": [180.0, 80.0, 50.0], "goal_radius": 5.0} | changes))


def panel(x, window_y, window_z):
    """Return a panel across the room, 10 thick, with a window 20 by 20."""
    return Panel(
        low=[x, 0.0, 0.0],
        high=[x + 10.0, 150.0, 120.0],
        normal="x",
        window_low=[x, window_y, window_z],
        window_high=[x + 10.0, window_y + 20.0, window_z + 20.0],
    )


def two_panels():
    """Return a room where the arm turns twice between two panels: path following fails from about 35 on."""
    return room(panels=(panel(90.0, 10.0, 10.0), panel(115.0, 110.0, 90.0)))


def walled():
    """Return a room with a wall between base and goal."""
    return room(boxes=[[[90.0, 0.0, 0.0], [100.0, 150.0, 120.0]]])


def mapped(workspace, order=(0, 1, 2), scale=1.0, shift=0.0):
    """Return the workspace with its axes in another order, in other units, somewhere else."""
    order = list(order)

    def put(points):
        return scale * np.asarray(points)[..., order] + shift

    def side(name):
        return "xyz"[order.index("xyz".index(name[0]))] + name[1]

    return Workspace(
        name=workspace.name,
        room_low=put(workspace.room_low),
        room_high=put(workspace.room_high),
        open_sides=tuple(side(name) for name in workspace.open_sides),
        panels=tuple(
            Panel(
                low=put(one.low),
                high=put(one.high),
                normal=side(one.normal + "-")[0],
                window_low=put(one.window_low),
                window_high=put(one.window_high),
            )
            for one in workspace.panels
        ),
        boxes=put(workspace.boxes),
        base=put(workspace.base),
        heading=workspace.heading[order],
        straight=scale * workspace.straight,
        goal=put(workspace.goal),
        goal_radius=scale * workspace.goal_radius,
    )


def mirrored(workspace, axis):
    """Return the mirror image of a room from the origin on, which is closed along the axis."""
    turn, shift = np.ones(3), np.zeros(3)
    turn[axis], shift[axis] = -1.0, workspace.room_high[axis]

    def put(low, high):
        return np.sort([low * turn + shift, high * turn + shift], axis=0)

    panels = []
    for one in workspace.panels:
        (low, high), (window_low, window_high) = put(one.low, one.high), put(one.window_low, one.window_high)
        panels.append(
            Panel(low=low, high=high, normal=one.normal, window_low=window_low, window_high=window_high)
        )
    return room(
        panels=tuple(panels), base=workspace.base * turn + shift, goal=workspace.goal * turn + shift
    ), lambda points: points * turn + shift


def assert_sound(result, workspace, arm):
    """Assert what every solved plan promises."""
    assert result.status is PlanningStatus.SOLVED and result.solved and result.reason == ""
    motion = result.motion
    assert motion.link_length == arm.link_length
    assert validate(motion, workspace, dataclasses.replace(arm, n_links=None)).valid
    base = workspace.base_pose_for(arm.link_length)
    np.testing.assert_array_equal(motion.base_pose, base)
    along = (motion.joints[0] - base[:3]) @ base[3:]
    assert along.max() <= 1e-9 * arm.link_length  # all in the feeder
    aside = motion.joints[0] - base[:3] - along[:, None] * base[3:]
    assert np.abs(aside).max() <= 1e-9 * arm.link_length
    assert np.linalg.norm(motion.joints[-1, -1] - workspace.goal) <= workspace.goal_radius
    assert signed_distances(motion.joints, workspace, base, arm.link_radius).min() >= 0.0
    angles = np.linalg.norm(motion.joint_angles, axis=2)
    assert arm.joint_limit is None or angles.max() <= arm.joint_limit * (1.0 + 1e-9)
    assert result.report.valid and result.report.clearance >= 0.0


def solved(workspace, planner="track", **arm):
    arm = ArmSpec(**arm)
    result = plan(workspace, arm, planner)
    assert_sound(result, workspace, arm)
    return result


@cache
def through_two_panels(planner="track", length=40.0):
    """Return a plan through the two panels, which many laws compare with."""
    return solved(two_panels(), planner, link_length=length)


# What is solved


@pytest.mark.parametrize(
    "arm",
    [
        {"link_length": 90.0},
        {"link_length": 90.0, "link_radius": 2.0},
        {"link_length": 90.0, "link_radius": 6.0},
        {"link_length": 120.0},
        {"link_length": 90.0, "joint_limit": math.radians(100.0)},
        {"link_length": 60.0, "joint_limit": math.radians(70.0)},
        {"link_length": 60.0, "link_radius": 4.0, "joint_limit": math.radians(90.0)},
    ],
)
def test_the_paired_panels_are_passed_with_radius_and_joint_limit(arm):
    result = solved(paired_panels(), **arm)
    # The distance to the obstacles is at least the radius; it is what the report calls clearance, beyond it.
    distances = signed_distances(result.motion.joints, paired_panels(), result.motion.base_pose)
    assert distances.min() >= arm.get("link_radius", 0.0)


def test_the_links_that_collide_in_the_paper_get_through():
    # Section 5.5 of the paper: 15 links of 90.
    assert solved(paired_panels(), link_length=90.0).motion.n_links == 15


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_random_rooms_are_passed(seed):
    solved(random_room(seed), link_length=40.0, link_radius=1.0)


ODD = {
    "no obstacles at all": {"open_sides": SIDES},
    "oblique heading": {"open_sides": SIDES, "base": [30.0, 30.0, 60.0], "heading": [1.0, 1.0, 0.0]},
    "skew heading": {"base": [30.0, 30.0, 30.0], "heading": [1.0, 2.0, 0.5], "open_sides": SIDES},
    "heading up": {"open_sides": ("z-",), "base": [60.0, 60.0, 0.0], "heading": [0.0, 0.0, 1.0]},
    "heading down": {"open_sides": ("z+",), "base": [60.0, 60.0, 120.0], "heading": [0.0, 0.0, -1.0]},
    "goal just past the straight": {"goal": [21.0, 70.0, 60.0], "goal_radius": 0.5},
    "goal at the end of the straight": {"goal": [20.0, 70.0, 60.0], "goal_radius": 0.5},
    "goal beside the end of the straight": {"goal": [20.0, 71.0, 60.0], "goal_radius": 0.5},
    "long straight": {"straight": 170.0},
}


@pytest.mark.parametrize("changes", ODD.values(), ids=ODD)
@pytest.mark.parametrize("length", [20.0, 65.0])
def test_odd_rooms_are_passed(changes, length):
    solved(room(**changes), link_length=length)


@pytest.mark.parametrize("planner", PLANNERS)
def test_links_longer_than_the_way_need_two(planner):
    # One has left the feeder, the other holds it.
    result = solved(room(goal=[40.0, 80.0, 50.0]), planner, link_length=100.0)
    assert result.motion.n_links == 2


def test_a_way_straight_ahead_is_passed_straight():
    result = solved(room(goal=[150.0, 70.0, 60.0]), link_length=30.0)
    assert np.linalg.norm(result.motion.joint_angles, axis=2).max() < math.radians(1.0)
    # Links longer than the straight stretch of 20 come from a base that is farther back.
    assert result.motion.feed[-1] == pytest.approx(160.0, rel=1e-3)


@pytest.mark.parametrize(("x", "degrees"), [(60.0, 30.0), (25.0, 30.0), (25.0, 50.0)])
def test_joint_limits_are_kept_where_the_way_turns_right_past_the_straight(x, degrees):
    wide = room(room_high=[300.0, 300.0, 120.0], base=[0.0, 150.0, 60.0], goal=[x, 280.0, 60.0])
    solved(wide, link_length=20.0, joint_limit=math.radians(degrees))


def test_the_same_question_has_the_same_answer_bit_by_bit():
    for workspace, length in ((paired_panels(), 90.0), (two_panels(), 50.0)):
        one, other = (plan(workspace, ArmSpec(link_length=length)) for _ in range(2))
        np.testing.assert_array_equal(one.track, other.track)
        np.testing.assert_array_equal(one.path, other.path)
        for key in ("joints", "joint_angles", "feed", "base_pose"):
            np.testing.assert_array_equal(getattr(one.motion, key), getattr(other.motion, key))


# Units, axes, mirrors


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_units_do_not_matter(scale):
    arm = {"link_length": 40.0, "link_radius": 0.5, "joint_limit": 1.9}
    plain = solved(two_panels(), **arm)
    arm |= {"link_length": 40.0 * scale, "link_radius": 0.5 * scale}
    other = solved(mapped(two_panels(), scale=scale), **arm)
    assert other.motion.n_links == plain.motion.n_links
    np.testing.assert_allclose(other.track / scale, plain.track, atol=1e-6)
    assert other.report.clearance / scale == pytest.approx(plain.report.clearance, abs=1e-6)


@pytest.mark.parametrize("order", [(1, 2, 0), (2, 0, 1), (0, 2, 1)])
@pytest.mark.parametrize("planner", PLANNERS)
def test_the_order_of_the_axes_does_not_matter(order, planner):
    length = 40.0 if planner == "track" else 20.0
    plain = through_two_panels(planner, length)
    other = solved(mapped(two_panels(), order), planner, link_length=length)
    assert other.motion.n_links == plain.motion.n_links
    # The causal planner rounds lengths to samples, so it may have one more or less.
    mine, theirs = (
        result.track[np.rint(np.linspace(0.0, 1.0, 200) * (len(result.track) - 1)).astype(int)]
        for result in (plain, other)
    )
    np.testing.assert_allclose(theirs, mine[:, list(order)], atol=1.0 if planner == "causal" else 1e-6)


@pytest.mark.parametrize("axis", [1, 2])
def test_the_mirror_image_of_a_room_has_the_mirrored_track(axis):
    other, turned = mirrored(two_panels(), axis)
    one, other = through_two_panels(), solved(other, link_length=40.0)
    assert other.motion.n_links == one.motion.n_links
    index = np.linspace(0.0, 1.0, 300)
    mine, theirs = (
        result.track[np.rint(index * (len(result.track) - 1)).astype(int)] for result in (one, other)
    )
    # Potentials of mirror images differ by their tolerance, not only by rounding.
    np.testing.assert_allclose(turned(theirs), mine, atol=0.5)


# The number of links


def test_more_links_than_needed_stay_in_the_feeder():
    fewest = through_two_panels().motion
    result = solved(two_panels(), link_length=40.0, n_links=fewest.n_links + 5)
    assert result.motion.n_links == fewest.n_links + 5
    np.testing.assert_allclose(result.motion.joints[:, 5:], fewest.joints, atol=1e-6)
    assert not result.motion.joint_angles[:, :5].any()


def test_fewer_links_than_needed_are_refused_with_the_number_that_is():
    fewest = through_two_panels().motion.n_links
    message = rf"Expected at least {fewest} links of 40 units to reach .* 'room', got {fewest - 1}\."
    with pytest.raises(InputError, match=message):
        plan(two_panels(), ArmSpec(link_length=40.0, n_links=fewest - 1))


# What is not solved


@pytest.mark.parametrize("planner", PLANNERS)
def test_where_there_is_no_way_there_is_no_path(planner):
    result = plan(walled(), ArmSpec(link_length=20.0), planner)
    assert result.status is PlanningStatus.NO_PATH and not result.solved
    assert result.motion is None and result.path is None and result.track is None
    assert result.reason.startswith("No ") and result.reason.endswith(".")


def test_links_too_thick_for_a_window_have_no_path():
    result = plan(two_panels(), ArmSpec(link_length=40.0, link_radius=10.5))
    assert result.status is PlanningStatus.NO_PATH


def test_links_too_long_for_the_room_end_in_a_dead_end_that_says_where():
    workspace = two_panels()
    result = plan(workspace, ArmSpec(link_length=100.0))
    assert result.status is PlanningStatus.DEAD_END and result.motion is None
    failure = result.failure
    low, high = workspace.obstacles[failure.wall]
    assert failure.depth > 0.0
    # That link is in that wall: the place is its front end.
    np.testing.assert_allclose(failure.joints[-1], failure.place)
    link = failure.joints[0] + np.linspace(0.0, 1.0, 2001)[:, None] * (failure.joints[1] - failure.joints[0])
    assert ((link > low) & (link < high)).all(axis=1).any()
    assert np.linalg.norm(np.diff(failure.joints, axis=0)) == pytest.approx(100.0)
    assert workspace.straight <= failure.path_position
    assert result.reason.startswith("No track was found on which links of 100 units are free: the link that ")
    assert f"{failure.depth:.3g} units deep in the obstacle from (" in result.reason


def test_a_dead_end_of_thick_links_counts_their_radius_and_names_the_joint_limit():
    workspace = two_panels()
    arm = ArmSpec(link_length=80.0, link_radius=4.0, joint_limit=math.radians(30.0))
    result = plan(workspace, arm)
    assert result.status is PlanningStatus.DEAD_END and "joints of at most 30 degrees" in result.reason
    low, high = workspace.obstacles[result.failure.wall]
    a, b = result.failure.joints
    link = a + np.linspace(0.0, 1.0, 2001)[:, None] * (b - a)
    assert ((link > low - 4.0) & (link < high + 4.0)).all(axis=1).any()
    # How far the link is from being free is how deep its axis is in the box that its radius is added to.
    thin, thick = (overlap(*a, *b, np.array([[low - grown, high + grown]]), 0)[0] for grown in (0.0, 4.0))
    assert result.failure.depth == pytest.approx(thick) and thin < thick - 1.0


def test_a_track_that_only_grows_is_a_dead_end_even_without_obstacles():
    behind = room(open_sides=SIDES, room_low=[-100.0, 0.0, 0.0], goal=[-60.0, 70.0, 60.0])
    result = plan(behind, ArmSpec(link_length=20.0))
    assert result.status is PlanningStatus.DEAD_END and not len(behind.obstacles)
    if result.failure is None:
        assert result.reason.startswith("No track was found for links of 20 units: it grows ever longer ")
    else:
        assert "a joint would have to jump" in result.reason


def test_the_follower_says_which_link_is_how_deep():
    result = plan(paired_panels(), ArmSpec(link_length=90.0), "follow")
    assert result.status is PlanningStatus.NOT_VALID and result.motion is None
    assert result.report.penetration == pytest.approx(23.9, rel=0.01)
    assert result.reason.startswith("The exact check refused the motion: Link ")
    assert result.failure.depth > 20.0 and len(result.failure.place) == 3
    assert not result.report.valid


@pytest.mark.parametrize("planner", PLANNERS)
def test_without_time_the_plan_is_out_of_time(planner):
    result = plan(two_panels(), ArmSpec(link_length=20.0), planner, time_budget=1e-9)
    assert result.status is PlanningStatus.OUT_OF_TIME and result.motion is None
    assert result.reason.startswith("Time was over before ")


def test_a_motion_that_the_checker_refuses_is_never_handed_out(monkeypatch):
    good = through_two_panels()

    def through_the_wall(query):
        joints = good.motion.joints + np.array([0.0, 0.0, 4.0]) * (good.motion.joints[..., :1] > 60.0)
        motion = type(good.motion).from_joints(joints, 40.0, good.motion.base_pose).moved(-query.origin)
        return SpatialCandidate(status=PlanningStatus.SOLVED, motion=motion)

    monkeypatch.setitem(PLANNERS, "through", through_the_wall)
    result = plan(two_panels(), ArmSpec(link_length=40.0), "through")
    assert result.status is PlanningStatus.NOT_VALID and result.motion is None
    assert result.reason.startswith("The exact check refused the motion: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"planner": "magic"}, r"Unknown planner 'magic'\. Available: auto, track, causal, follow\."),
        ({"time_budget": -1.0}, r"Expected a positive time_budget in seconds, got -1\.0\."),
        ({"time_budget": math.nan}, r"Expected a positive time_budget in seconds, got nan\."),
        ({"time_budget": "1"}, r"Expected a positive time_budget in seconds, got '1'\."),
        ({"arm": ArmSpec(link_length=500.0)}, r"Expected a link_length of at most the size of .*, got 500\."),
        ({"arm": ArmSpec(link_length=90.0, link_radius=44.0)}, r"Expected 20 units of straight free way .*"),
    ],
)
def test_wrong_arguments_are_named(arguments, message):
    narrow = room(boxes=[[[10.0, 0.0, 0.0], [15.0, 27.0, 120.0]]])
    with pytest.raises(InputError, match=message):
        plan(narrow, **({"arm": ArmSpec(link_length=20.0)} | arguments))


def test_links_longer_than_the_feeder_allows_are_refused():
    inside = room(open_sides=(), base=[30.0, 70.0, 60.0])
    with pytest.raises(
        InputError, match=r"Expected links of at most 50 units .* \(20 past .*, 30 behind it\)"
    ):
        plan(inside, ArmSpec(link_length=50.1))
    solved(inside, link_length=49.9)


# Warm starts, progress and records


def test_the_track_of_shorter_links_is_a_start_for_longer_ones():
    workspace = paired_panels()
    short, arm = solved(workspace, link_length=85.0), ArmSpec(link_length=95.0)
    result = plan(workspace, arm, warm_start=short)
    assert_sound(result, workspace, arm)
    assert result.path is None and "potential" not in result.timings
    with pytest.raises(InputError, match="Expected a warm start with a motion and its track"):
        plan(workspace, arm, warm_start=plan(walled(), ArmSpec(link_length=20.0)))


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_plan_tells_its_progress_and_where_its_time_went(planner):
    told = []
    result = plan(
        two_panels(),
        ArmSpec(link_length=20.0),
        planner,
        progress=lambda stage, share: told.append((stage, share)),
    )
    assert all(0.0 <= share <= 1.0 for _, share in told)
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == (["path", "validate"] if planner == "follow" else ["path", "plan", "validate"])
    assert {"potential", "path", "poses", "validate"} <= set(result.timings)
    (attempt,) = result.attempts
    assert attempt.planner == result.planner == planner and attempt.status is result.status
    assert sum(result.timings.values()) <= attempt.seconds
    assert isinstance(result.path, np.ndarray) and not isinstance(result.path, Path)
    np.testing.assert_allclose(result.path[[0, -1]], [two_panels().base, two_panels().goal], atol=1e-9)


def test_all_joints_run_on_the_track_of_the_result():
    result = solved(two_panels(), link_length=50.0)
    starts, ways = result.track[:-1], np.diff(result.track, axis=0)
    ways, starts = ways[np.linalg.norm(ways, axis=1) > 0.0], starts[np.linalg.norm(ways, axis=1) > 0.0]
    base = result.motion.base_pose
    joints = result.motion.joints[(result.motion.joints - base[:3]) @ base[3:] > 0.0]
    for place in joints[::61]:
        t = np.clip(np.einsum("nc,nc->n", place - starts, ways) / (ways**2).sum(axis=1), 0.0, 1.0)
        assert np.linalg.norm(starts + t[:, None] * ways - place, axis=1).min() < 1e-8
