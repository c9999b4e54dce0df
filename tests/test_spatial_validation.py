"""In space too: planted faults are named, good motions pass, and bounds bound what dense sampling finds."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import validation as planar
from planners.problem import Motion
from planners.spatial.checks.boxes import axis_gaps, moving_gaps, separations
from planners.spatial.checks.crossing import segment_distances
from planners.spatial.checks.scene import Scene
from planners.spatial.kinematics import joints_from_configuration
from planners.spatial.problem import SpatialMotion
from planners.spatial.validation import PINCH_TOLERANCE, STEP_LIMIT, signed_distances, validate
from planners.spatial.workspace import SIDES, Workspace

LENGTH = 10.0
ROUNDING = 1e-9


# Workspaces and motions built by hand


def space(*boxes, goal=(0.0, 0.0, 50.0), heading=(1.0, 0.0, 0.0)):
    """Build a room without walls, with boxes; the base is in its middle."""
    return Workspace(
        name="boxes",
        room_low=np.full(3, -100.0),
        room_high=np.full(3, 100.0),
        open_sides=SIDES,
        boxes=np.array(boxes, dtype=float).reshape(-1, 2, 3),
        base=np.zeros(3),
        heading=np.array(heading),
        straight=LENGTH,
        goal=np.array(goal),
        goal_radius=1.0,
    )


def moved(workspace, feeds, angles):
    """Build a motion from feeds, shape (n,), and joint angles, shape (n, n_links, 2)."""
    return SpatialMotion.from_configurations(feeds, angles, LENGTH, workspace.base_pose_for(LENGTH))


def bent(workspace, n_links, last, step=0.004):
    """Push an arm straight in to its length, then bend it to joint angles `last`, shape (n_links, 2)."""
    feeds = np.linspace(0.0, n_links * LENGTH, math.ceil(n_links / 0.04) + 1)
    n = math.ceil(np.abs(last).max() / step)
    angles = np.concatenate(
        [np.zeros((len(feeds), n_links, 2)), np.linspace(0.0, 1.0, n + 1)[1:, None, None] * np.array(last)]
    )
    return moved(workspace, np.concatenate([feeds, np.full(n, feeds[-1])]), angles)


BENDS = np.array([[0.0, 0.0], [0.5, 0.2], [0.3, -0.4], [-0.2, 0.6]])


@cache
def good():
    """Build a motion without faults: an arm of four links bends in all directions, past a box."""
    tip = joints_from_configuration([4 * LENGTH], BENDS[None], LENGTH, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0))[0, -1]
    workspace = space([(12.0, -20.0, -20.0), (60.0, -0.5, 20.0)], goal=tip)
    return workspace, bent(workspace, 4, BENDS)


def fault_of(report, kind):
    found = [fault for fault in report.faults if fault.kind == kind]
    assert len(found) == 1, report.faults
    return found[0]


def kinds_of(report):
    return {fault.kind for fault in report.faults}


# Distances


def distance_by_search(start, end, low, high):
    """Find the distance of a segment to a box by thirds, as it is convex along the segment."""

    def away(share):
        point = start + share * (end - start)
        return np.linalg.norm(point - np.clip(point, low, high))

    near, far = 0.0, 1.0
    for _ in range(70):
        one, other = near + (far - near) / 3.0, far - (far - near) / 3.0
        near, far = (near, other) if away(one) <= away(other) else (one, far)
    return min(away((near + far) / 2.0), away(0.0), away(1.0))


# Whole numbers make segments along edges, in faces and of no length at all.
numbers = st.one_of(st.integers(-4, 4).map(float), st.floats(-5.0, 5.0).map(lambda value: round(value, 6)))
points = st.tuples(numbers, numbers, numbers).map(np.array)
boxes = st.tuples(points, st.tuples(*[st.floats(0.5, 6.0) | st.just(2.0)] * 3).map(np.array)).map(
    lambda pair: np.array([pair[0], pair[0] + pair[1]])
)


def separation(start, end, box):
    distance, normal, share = separations(start[None], end[None], box[None, 0], box[None, 1])
    return float(distance[0]), normal[0], float(share[0])


@given(points, points, boxes)
def test_the_distance_to_a_box_is_the_one_that_a_search_along_the_segment_finds(start, end, box):
    distance, normal, share = separation(start, end, box)
    searched = distance_by_search(start, end, *box)
    assert max(distance, 0.0) == pytest.approx(searched, abs=1e-9)
    assert 0.0 <= share <= 1.0
    assert np.linalg.norm(normal) == pytest.approx(1.0)
    if distance > 1e-6:
        point = start + share * (end - start)
        assert np.linalg.norm(point - np.clip(point, *box)) == pytest.approx(distance, abs=1e-9)


places_inside = st.tuples(*[st.floats(0.05, 0.95)] * 3).map(np.array)


@given(boxes, places_inside, points, st.floats(0.0, 1.0), st.randoms())
def test_the_depth_in_a_box_is_the_shortest_way_out(box, inside, along, share, random):
    middle = box[0] + inside * (box[1] - box[0])
    start, end = middle - share * along, middle + (1.0 - share) * along
    distance, normal, share = separation(start, end, box)
    assert distance < 0.0
    out = normal * (-distance + 1e-7)
    assert distance_by_search(start + out, end + out, *box) > 1e-9
    ways = np.random.default_rng(random.getrandbits(32)).normal(size=(10, 3))
    for way in ways / np.linalg.norm(ways, axis=1, keepdims=True):
        short = -0.999 * distance * way
        assert distance_by_search(start + short, end + short, *box) < 1e-9
    middle = start + share * (end - start)  # of what is inside
    assert (middle >= box[0] - 1e-9).all() and (middle <= box[1] + 1e-9).all()


@given(points, points, boxes)
def test_no_direction_parts_segment_and_box_by_more_than_the_axes_or_the_distance(start, end, box):
    distance, normal, _ = separation(start, end, box)
    ways = np.concatenate([np.random.default_rng(0).normal(size=(200, 3)), normal[None]])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    gaps = np.minimum(ways @ start, ways @ end) - np.maximum(ways * box[0], ways * box[1]).sum(axis=1)
    assert gaps.max() <= distance + 1e-9
    assert gaps[-1] == pytest.approx(distance, abs=1e-7)
    assert axis_gaps(start[None], end[None], box[None, 0], box[None, 1]).max() <= distance + 1e-9


@pytest.mark.parametrize(
    ("start", "end", "signed"),
    [
        ((-1, 0, 0), (3, 0, 0), 0.0),  # along an edge
        ((-1, 1, 0), (3, 1, 0), 0.0),  # in a face
        ((-1, 1, 1), (3, 1, 1), -1.0),  # through the middle
        ((-1, 1.5, 1), (3, 1.5, 1), -0.5),
        ((2, 1, 1), (3, 1, 1), 0.0),  # an end on a face
        ((1, 1, 1), (1, 1, 1), -1.0),  # a point inside
        ((3, 3, 3), (3, 3, 3), math.sqrt(3)),  # a point off a corner
        ((1, -1, 1), (-1, 1, 1), 0.0),  # across an edge
        ((1.2, -1, 1), (-1, 1.2, 1), -0.1 * math.sqrt(2)),  # cuts an edge off
        ((0.8, -1, 1), (-1, 0.8, 1), 0.1 * math.sqrt(2)),
    ],
)
def test_signed_distances_to_a_cube_of_two_are_those_found_by_hand(start, end, signed):
    box = np.array([(0.0, 0.0, 0.0), (2.0, 2.0, 2.0)])
    found, _, _ = separation(np.array(start, float), np.array(end, float), box)
    assert found == pytest.approx(signed, abs=1e-12)


@given(points, points, points, points)
def test_the_distance_of_two_segments_is_the_least_between_their_points(a, b, c, d):
    found = segment_distances(*(point[None] for point in (a, b, c, d)))[0]
    # From each point of one, the nearest of the other is known; along the one the distance is convex.
    near, far = 0.0, 1.0

    def away(share):
        point, along = a + share * (b - a), d - c
        where = np.clip((point - c) @ along / (along @ along), 0.0, 1.0) if (along @ along) > 0.0 else 0.0
        return np.linalg.norm(point - c - where * along)

    for _ in range(70):
        one, other = near + (far - near) / 3.0, far - (far - near) / 3.0
        near, far = (near, other) if away(one) <= away(other) else (one, far)
    assert found == pytest.approx(min(away((near + far) / 2.0), away(0.0), away(1.0)), abs=1e-7)


# Bounds between poses


@given(points, points, points, points, boxes)
def test_a_moving_segment_is_never_deeper_than_the_gap_says(a, b, c, d, box):
    times = np.linspace(0.0, 1.0, 101)[:, None]
    starts, ends = a + times * (c - a), b + times * (d - b)
    n = len(times)
    seen = separations(starts, ends, np.tile(box[0], (n, 1)), np.tile(box[1], (n, 1)))[0].min()
    gap = moving_gaps(np.array([[a, b]]), np.array([[c, d]]), box[None, 0], box[None, 1])[0]
    assert gap <= seen + 1e-9


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 1.0))
def test_a_segment_that_slides_along_an_edge_while_it_turns_is_seen_to_keep_off(seed, gap):
    rng = np.random.default_rng(seed)
    box = np.array([(-50.0, -50.0, -50.0), (0.0, 0.0, 50.0)])
    before, after = [], []
    for row, turn in ((before, 0.0), (after, 0.1)):
        way = np.array([math.cos(2.3 + turn), math.sin(2.3 + turn), 0.0])
        off = (gap + 0.02 * turn) * np.array([way[1], -way[0], 0.0])
        slide = 0.3 * turn * way + np.array([0.0, 0.0, rng.uniform(-5.0, 5.0)])
        row += [slide + off - 5.0 * way, slide + off + 5.0 * way]
    found = moving_gaps(np.array([before]), np.array([after]), box[None, 0], box[None, 1])[0]
    # A plane that stands still would lose 5 * 0.05; this one loses but what the middle dips.
    assert found > 0.97 * gap - 0.002


configurations = st.tuples(
    st.integers(1, 6), st.integers(0, 2**32 - 1), st.sampled_from([0.01, 0.1, 0.5, 1.5])
)


def random_step(n_links, seed, size):
    """Build two poses of a whole arm in the room, one random change apart."""
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-1.5, 1.5, (1, n_links, 2)) + np.array([0.0, 1.0])[:, None, None] * rng.uniform(
        -size, size, (1, n_links, 2)
    )
    feeds = n_links * LENGTH + np.array([0.0, rng.uniform(-1.0, 1.0)])
    return moved(space(), feeds, angles)


@given(configurations)
def test_between_poses_no_joint_is_farther_from_its_chord_than_the_bound(drawn):
    motion = random_step(*drawn)
    n, times = motion.n_links, np.linspace(0.0, 1.0, 201)[:, None, None]
    angles = motion.joint_angles[0] + times * np.diff(motion.joint_angles, axis=0)
    feed = motion.feed[0] + times[:, 0, 0] * np.diff(motion.feed)
    joints = joints_from_configuration(feed, angles, LENGTH, motion.base_pose)
    off = joints - (joints[0] + times * (joints[-1] - joints[0]))
    seen = np.linalg.norm(off, axis=2).max(axis=0)
    scene = Scene(motion=replace(motion, feed=motion.feed + 50.0), workspace=space(), radius=0.0)
    astray = scene.steps(0, 1).astray
    assert (np.maximum(seen[1:], seen[:-1]) <= astray + 1e-12).all()
    halves = [
        scene.moves(np.zeros(n, dtype=int), np.arange(n), np.tile(span, (n, 1))).astray
        for span in ((0.0, 0.5), (0.5, 1.0), (0.0, 1.0))
    ]
    assert np.allclose(halves[2], astray)
    if drawn[2] <= 0.1:
        assert (np.maximum(*halves[:2]) <= 0.5 * astray + 1e-12).all()


def third_derivatives_seen(motion):
    """Measure the third derivatives of joint places after the first pose, by differences."""
    h, times = 1e-3, np.linspace(0.0, 1.0, 21)
    stencil = times[:, None] + h * np.array([-2.0, -1.0, 1.0, 2.0])
    joints = poses_between(motion, stencil.ravel()).reshape(*stencil.shape, -1, 3)
    third = np.einsum("s,tsjx->tjx", np.array([-0.5, 1.0, -1.0, 0.5]), joints) / h**3
    return np.linalg.norm(third, axis=2).max(axis=0)


@given(configurations)
def test_third_derivatives_are_bounded(drawn):
    motion = random_step(*drawn)
    scene = Scene(motion=motion, workspace=space(), radius=0.0)
    assert (third_derivatives_seen(motion) <= 1.001 * scene.third[0] + 1e-3).all()


def grazing(joints, rng, depth):
    """Build a box that the arm gets about `depth` deep in over poses, shape (n_poses, n_links + 1, 3)."""
    middle = joints[len(joints) // 2, rng.integers(1, joints.shape[1])]
    way, size = rng.normal(size=3), rng.uniform(0.3, 3.0, size=3)
    way /= np.linalg.norm(way)
    starts, ends = joints[:, :-1].reshape(-1, 3), joints[:, 1:].reshape(-1, 3)

    def box_at(shift):
        return np.stack([middle + shift * way - size, middle + shift * way + size])

    near, far = 0.0, 60.0
    for _ in range(40):
        shift = (near + far) / 2.0
        box = np.tile(box_at(shift)[None], (len(starts), 1, 1))
        gets = -separations(starts, ends, box[:, 0], box[:, 1])[0].min()
        near, far = (shift, far) if gets > depth else (near, shift)
    return box_at(near)


def poses_between(motion, times):
    """Return the joints at times after the first pose, in [0, 1]."""
    feeds = motion.feed[0] + times * np.diff(motion.feed)
    angles = motion.joint_angles[0] + times[:, None, None] * np.diff(motion.joint_angles, axis=0)
    return joints_from_configuration(feeds, angles, LENGTH, motion.base_pose)


def least_distance(motion, workspace, radius, accuracy=1e-4):
    """Find the least signed distance between two poses: what cannot be lower for its speed is set aside."""
    turns = np.hypot(*np.diff(motion.joint_angles, axis=0)[0].T)
    speed = np.abs(np.diff(motion.feed)[0]) + LENGTH * turns @ np.arange(len(turns), 0, -1)
    least, width, middles = math.inf, 1.0 / 64.0, (np.arange(64) + 0.5) / 64.0
    while len(middles):
        joints = poses_between(motion, middles)
        found = signed_distances(joints, workspace, motion.base_pose, radius).min(axis=1)
        least = min(least, found.min())
        if width * speed <= accuracy:
            break
        middles = middles[found - speed * width / 2.0 < least]
        width /= 4.0
        middles = (middles[:, None] + width * np.array([-1.5, -0.5, 0.5, 1.5])).ravel()
    return least


@settings(max_examples=60)
@given(
    st.integers(1, 4),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.3]),
    st.sampled_from([0.03, 0.1, 0.3]),
    st.floats(-1.0, 3.0),
)
def test_the_depth_between_poses_is_at_most_what_is_reported(n_links, seed, radius, size, depths):
    """A box grazes the arm somewhere between the poses, so that the bound matters."""
    rng, tolerance = np.random.default_rng(seed), PINCH_TOLERANCE * LENGTH
    change = np.array([-0.5, 0.5])[:, None, None] * rng.uniform(-size, size, (1, n_links, 2))
    angles = rng.uniform(-1.0, 1.0, (1, n_links, 2)) + change
    motion = moved(space(), n_links * LENGTH + np.array([0.0, rng.uniform(-0.2, 0.2)]), angles)
    seen = poses_between(motion, np.linspace(0.0, 1.0, 101))
    box = grazing(seen, rng, depths * tolerance - radius)
    workspace = space() if ((box[0] < 0.0) & (box[1] > 0.0)).all() else space(box)
    at_poses = float(signed_distances(motion.joints, workspace, motion.base_pose, radius).min())
    depth = -min(least_distance(motion, workspace, radius), at_poses)

    report = validate(motion, workspace, ArmSpec(link_length=LENGTH, link_radius=radius))
    kinds = kinds_of(report)
    assert depth <= report.penetration_between + ROUNDING * LENGTH
    assert report.clearance == pytest.approx(at_poses, abs=1e-9)
    assert ("penetration" in kinds) == (at_poses < -ROUNDING * LENGTH)
    if depth > tolerance * (1.0 + 1e-6):
        assert kinds & {"sweep", "penetration"}
    if depth < 0.9 * tolerance:
        assert "sweep" not in kinds
        assert report.penetration_between <= tolerance


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=40)
def test_a_link_that_leaves_the_feeder_stays_within_the_bound_of_its_hull(seed, on_axis):
    """Also where it leaves it beside the base, which is another fault."""
    rng = np.random.default_rng(seed)
    workspace, link = space(), 2
    angles = rng.uniform(-0.6, 0.6, (1, 4, 2)) * np.ones((2, 1, 1))
    if on_axis:
        angles[:, : link + 1] = 0.0
    feeds = (4 - link) * LENGTH + np.array([-rng.uniform(0.1, 2.0), rng.uniform(0.1, 2.0)])
    motion = moved(workspace, feeds, angles)
    scene = Scene(motion=motion, workspace=workspace, radius=0.0)
    moves = scene.moves(np.zeros(1, dtype=int), np.array([link]), np.array([(0.0, 1.0)]))
    assert not moves.even[0]
    times = np.linspace(0.0, 1.0, 101)
    joints, arc = scene.ends(np.zeros(101, dtype=int), np.full(101, link), times)
    seen = scene.in_workspace(joints, arc)
    ends = np.stack([moves.before[0], moves.after[0]])
    for side in (0, 1):
        way = ends[1, side] - ends[0, side]
        share = np.clip((seen[:, side] - ends[0, side]) @ way / (way @ way), 0.0, 1.0)
        off = np.linalg.norm(seen[:, side] - ends[0, side] - share[:, None] * way, axis=1)
        assert (off <= moves.astray + 1e-12).all()
    if on_axis:
        assert moves.astray < 1e-9
    assert moves.ways[0] >= np.linalg.norm(ends[1] - ends[0], axis=1).max()


@pytest.mark.parametrize("depth", [-0.5, 0.5, 0.8, 1.2, 3.0, 30.0])
@pytest.mark.parametrize("radius", [0.0, 0.4])
def test_a_corner_cut_between_poses_is_refused_beyond_the_tolerance_only(depth, radius):
    """The tip of a long straight arm swings through the lowest point of its circle between two poses."""
    tolerance, n_links, half = PINCH_TOLERANCE * LENGTH, 3, 0.2
    reach = n_links * LENGTH
    lowest = reach + radius - depth * tolerance
    assert depth > 4 or reach * math.cos(half) < lowest - radius  # free at both poses
    workspace = space([(lowest, -5.0, -5.0), (lowest + 20.0, 5.0, 5.0)])
    angles = np.zeros((2, n_links, 2))
    angles[:, 0] = [(0.0, -half), (0.0, half)]
    motion = moved(workspace, np.full(2, reach), angles)
    report = validate(motion, workspace, ArmSpec(link_length=LENGTH, link_radius=radius))
    assert "penetration" not in kinds_of(report)
    assert ("sweep" in kinds_of(report)) == (depth > 1.0)
    if depth > 1.0:
        fault = fault_of(report, "sweep")
        assert fault.amount == pytest.approx(depth * tolerance, rel=0.02)
        assert (fault.pose, fault.link) == (0, 2)
        assert fault.place[0] == pytest.approx(reach, abs=depth * tolerance)
        assert math.isinf(report.penetration_between)
    else:
        assert max(depth, 0.0) * tolerance <= report.penetration_between <= tolerance
        if depth < 0.0:
            assert report.penetration_between == 0.0


# Verdicts


def test_a_motion_without_faults_passes():
    workspace, motion = good()
    report = validate(motion, workspace)
    assert report.valid, report.faults
    assert 0.0 < report.clearance <= 0.5
    assert (report.penetration, report.penetration_between) == (0.0, 0.0)
    assert 0.0 < report.largest_step <= STEP_LIMIT * LENGTH
    assert report.length_error < 1e-12
    assert report.goal_distance < 1e-9


def test_progress_grows_to_the_whole():
    workspace, motion = good()
    told = []
    validate(motion, workspace, progress=lambda stage, share: told.append((stage, share)))
    assert {stage for stage, _ in told} == {"validate"}
    shares = [share for _, share in told]
    assert shares == sorted(shares) and shares[-1] == 1.0


def stretched(motion):
    joints = motion.joints.copy()
    joints[50, -1, 0] += 5e-6
    return replace(motion, joints=joints)


def shifted(motion):
    joints = motion.joints.copy()
    joints[150, :, 2] += 1e-4
    return replace(motion, joints=joints)


def early(motion):
    """Bend the second link a little too soon, while it comes out."""
    angles = motion.joint_angles.copy()
    angles[60, 1, 1] = 1e-3
    return moved(good()[0], motion.feed, angles)


def fed_too_far(motion):
    feed = motion.feed.copy()
    feed[-1] += 0.1
    return moved(good()[0], feed, motion.joint_angles)


def late(motion):
    return moved(good()[0], motion.feed[1:], motion.joint_angles[1:])


def halted(motion):
    return moved(good()[0], motion.feed[:-30], motion.joint_angles[:-30])


def hasty(motion):
    keep = np.delete(np.arange(motion.n_poses), [70])
    return moved(good()[0], motion.feed[keep], motion.joint_angles[keep])


@pytest.mark.parametrize(
    ("spoil", "kind", "pose", "says"),
    [
        (stretched, "length", 50, "Link 3 is 10.00000"),
        (shifted, "inconsistent", 150, "from where feed and joint angles put it at pose 150"),
        (early, "feeder", 60, "still held by the feeder"),
        (fed_too_far, "feeder", -1, "not between 0 and 40"),
        (late, "start", 0, "starts 0.4 units (0.04 link lengths) from its place"),
        (halted, "goal", -1, "outside its radius of 1"),
        (hasty, "step", 69, "moves 0.8 units (0.08 link lengths), more than 0.05, between poses 69 and 70"),
    ],
)
def test_each_fault_of_the_arm_alone_is_named_with_pose_and_figure(spoil, kind, pose, says):
    workspace, motion = good()
    spoiled = spoil(motion)
    report = validate(spoiled, workspace)
    fault = fault_of(report, kind)
    assert fault.pose == pose % spoiled.n_poses
    assert says in fault.message
    assert fault.amount > 0.0 and len(fault.place) == 3
    assert not report.valid


def test_a_box_in_the_way_is_a_penetration_with_its_depth():
    workspace, motion = good()
    tip = motion.joints[-1, -1]
    low = tip - np.array([1.0, 2.0, 3.0])
    blocked = replace(workspace, boxes=np.array([[low, tip + 5.0]]), goal=motion.joints[-1, -1] - 5.0)
    report = validate(motion, blocked)
    fault = fault_of(report, "penetration")
    exact = signed_distances(motion.joints, blocked, motion.base_pose)
    assert fault.amount == report.penetration == -report.clearance == pytest.approx(-exact.min(), abs=1e-12)
    assert exact[fault.pose, fault.link] == exact.min()
    assert f"Link {fault.link} is {fault.amount:.6g} units" in fault.message
    assert (np.array(fault.place) > low - 1e-9).all() and (np.array(fault.place) < tip + 5.0).all()


def test_a_thick_link_may_touch_and_no_more():
    workspace, motion = good()
    clearance = validate(motion, workspace).clearance
    for excess, kinds in ((0.0, set()), (-1e-6, set()), (2e-8, {"penetration"})):
        arm = ArmSpec(link_length=LENGTH, link_radius=clearance + excess)
        report = validate(motion, workspace, arm)
        assert kinds_of(report) == kinds
        assert report.clearance == pytest.approx(-excess, abs=1e-12)


def test_the_joint_limit_is_on_the_whole_bend():
    workspace, motion = good()
    largest = float(np.hypot(*BENDS.T).max())
    assert validate(motion, workspace, ArmSpec(link_length=LENGTH, joint_limit=largest)).valid
    report = validate(motion, workspace, ArmSpec(link_length=LENGTH, joint_limit=largest - 1e-3))
    fault = fault_of(report, "joint limit")
    assert (fault.link, fault.amount) == (3, pytest.approx(largest))


def curled(out_of_plane):
    """Curl an arm of five links to a pentagon and beyond, its last link beside the first or into it."""
    workspace = space(goal=(3.0, 1.5, 0.0))
    angles = np.tile((1.5, 0.0), (5, 1))
    angles[0] = 0.0
    angles[3, 1] = out_of_plane
    return workspace, bent(workspace, 5, angles)


def test_an_arm_that_runs_into_itself_crosses():
    workspace, motion = curled(0.0)
    fault = fault_of(validate(motion, workspace), "crossing")
    assert "cross" in fault.message and fault.amount <= ROUNDING * LENGTH
    seen = [
        segment_distances(*(motion.joints[:, k] for k in (0, 1, other, other + 1))).min()
        for other in (2, 3, 4)
    ]
    assert min(seen) < 0.5


def test_links_that_pass_each_other_keep_twice_the_radius_apart():
    workspace, motion = curled(0.3)
    first, second = np.triu_indices(5, 2)
    joints = motion.joints[motion.feed >= 5 * LENGTH - 1e-9]
    closest = min(
        segment_distances(joints[:, i], joints[:, i + 1], joints[:, j], joints[:, j + 1]).min()
        for i, j in zip(first, second, strict=True)
    )
    assert 0.1 < closest < 5.0
    for radius, kinds in ((0.49 * closest, set()), (0.5 * closest + 1e-6, {"crossing"})):
        report = validate(motion, workspace, ArmSpec(link_length=LENGTH, link_radius=radius))
        assert kinds_of(report) & {"crossing"} == kinds
    fault = fault_of(report, "crossing")
    assert "of each other" in fault.message and fault.amount <= 2.0 * radius + ROUNDING * LENGTH


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.02, 0.2]), st.sampled_from([0.97, 1.03]))
def test_links_are_found_too_near_exactly_when_samples_between_poses_are(seed, size, share):
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-1.8, 1.8, (1, 5, 2)) + np.array([0.0, 1.0])[:, None, None] * rng.uniform(
        -size, size, (1, 5, 2)
    )
    workspace = space()
    motion = moved(workspace, [50.0, 50.0], angles)
    joints = poses_between(motion, np.linspace(0.0, 1.0, 801))
    closest = min(
        segment_distances(joints[:, i], joints[:, i + 1], joints[:, j], joints[:, j + 1]).min()
        for i, j in zip(*np.triu_indices(5, 2), strict=True)
    )
    assume(0.5 < closest < 9.0)
    arm = ArmSpec(link_length=LENGTH, link_radius=share * closest / 2.0)
    assert ("crossing" in kinds_of(validate(motion, workspace, arm))) == (share > 1.0)


def test_links_that_change_sides_between_two_poses_cross():
    """Free at both poses, through each other between them: only the bound can see it."""
    workspace = space()
    angles = np.zeros((2, 5, 2))
    angles[:, 1:, 0] = 1.5
    angles[:, 3, 1] = (-0.02, 0.02)
    motion = moved(workspace, np.full(2, 50.0), angles)
    fault = fault_of(validate(motion, workspace), "crossing")
    assert fault.message.endswith("between poses 0 and 1.")


def test_a_link_folded_back_crosses():
    workspace = space()
    angles = np.zeros((1, 2, 2))
    angles[0, 1] = (0.0, math.pi)
    report = validate(moved(workspace, [20.0], angles), workspace)
    assert "Link 1 lies folded back on link 0 at pose 0." in fault_of(report, "crossing").message


def test_a_single_pose_is_checked_too():
    workspace = space([(15.0, -1.0, -1.0), (16.0, 1.0, 1.0)])
    report = validate(moved(workspace, [20.0], np.zeros((1, 2, 2))), workspace)
    assert fault_of(report, "penetration").amount == pytest.approx(1.0)
    assert report.largest_step == 0.0


def test_what_is_in_the_feeder_is_not_in_the_workspace():
    workspace = space([(-50.0, -5.0, -5.0), (-1.0, 5.0, 5.0)])
    motion = bent(workspace, 3, np.array([[0.0, 0.0], [0.3, 0.0], [0.3, 0.0]]))
    report = validate(motion, workspace)
    assert kinds_of(report) == {"goal"}
    assert report.clearance == pytest.approx(1.0)
    distances = signed_distances(motion.joints, workspace, motion.base_pose)
    assert np.isinf(distances[0]).all()
    assert np.isinf(distances[30, 0]) and distances[30, 1] == pytest.approx(1.0)
    assert distances.min() == pytest.approx(1.0)


def test_a_heading_across_the_axes_and_no_boxes_at_all_will_do():
    workspace = space(heading=(1.0, 2.0, -0.5))
    motion = bent(workspace, 3, BENDS[:3])
    report = validate(motion, workspace)
    assert kinds_of(report) == {"goal"}
    assert math.isinf(report.clearance) and report.penetration_between == 0.0


def test_longer_links_start_farther_back():
    workspace = replace(space(goal=(15.0, 0.0, 0.0)), straight=4.0)
    motion = moved(workspace, np.linspace(0.0, 20.5, 60), np.zeros((60, 3, 2)))
    assert motion.base_pose[0] == -6.0
    report = validate(motion, workspace)
    assert report.valid, report.faults


@pytest.mark.parametrize(
    ("arm", "message"),
    [
        (ArmSpec(link_length=11.0), "Expected a motion of links of length 11, got one of 10."),
        (ArmSpec(link_length=LENGTH, n_links=7), "Expected a motion of 7 links, got one of 4."),
    ],
)
def test_a_motion_of_another_arm_is_refused(arm, message):
    workspace, motion = good()
    with pytest.raises(InputError) as caught:
        validate(motion, workspace, arm)
    assert str(caught.value) == message


def test_a_motion_of_another_workspace_is_refused():
    workspace, motion = good()
    with pytest.raises(InputError, match="belongs to another workspace"):
        validate(motion, replace(workspace, base=np.array([1.0, 0.0, 0.0])))


@pytest.mark.parametrize(
    ("joints", "base", "message"),
    [
        (
            np.zeros((3, 4, 2)),
            np.eye(6)[3],
            "Expected joints with shape (n_poses, n_links + 1, 3), got (3, 4, 2).",
        ),
        (np.zeros((3, 4, 3)), np.zeros(3), "Expected base_pose with shape (6,), got (3,)."),
    ],
)
def test_distances_of_something_else_are_refused(joints, base, message):
    with pytest.raises(InputError) as caught:
        signed_distances(joints, space(), base)
    assert str(caught.value) == message


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_each_link_has_the_distance_to_the_nearest_of_all_boxes(seed):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-40.0, 30.0, (6, 3))
    low[:, 0] = rng.uniform(1.0, 40.0, 6)
    workspace = space(*np.stack([low, low + rng.uniform(1.0, 15.0, (6, 3))], axis=1))
    feeds = np.minimum(rng.uniform(5.0, 80.0, 8), 40.0)
    bends = rng.uniform(-1.0, 1.0, (8, 4, 2)) * (feeds >= 40.0)[:, None, None]
    motion = moved(workspace, feeds, bends)
    found = signed_distances(motion.joints, workspace, motion.base_pose, 0.1)
    behind = feeds[:, None] < LENGTH * np.arange(4, -1, -1)
    joints = np.where(behind[..., None], 0.0, motion.joints)
    for pose, link in np.ndindex(found.shape):
        start, end = joints[pose, link], joints[pose, link + 1]
        wanted = min(separation(start, end, box)[0] for box in workspace.obstacles) - 0.1
        held = behind[pose, link + 1]
        assert found[pose, link] == (math.inf if held else pytest.approx(wanted, abs=1e-9))


# The same in the plane


@cache
def corner():
    """Build an L-bend 200 wide in the plane, and the same with a flat room about it."""
    maze = Maze.from_corridors([(0, 0), (0, 900), (900, 900)], 200.0, base_offset=120.0)
    workspace = Workspace(
        name="bend",
        room_low=np.array([-100.0, 0.0, -300.0]),
        room_high=np.array([900.0, 1000.0, 300.0]),
        boxes=np.array([[(100.0, 0.0, -300.0), (900.0, 800.0, 300.0)]]),
        base=np.array([*maze.base_pose[:2], 0.0]),
        heading=np.array([0.0, 1.0, 0.0]),
        straight=60.0,
        goal=np.array([*maze.goal, 0.0]),
        goal_radius=maze.goal_radius,
    )
    return maze, workspace


@pytest.mark.parametrize("feed", [700.0, 760.0, 860.0, 1000.0])
@pytest.mark.parametrize("turn", [-0.5, -0.05, 0.03, 0.1])
def test_a_motion_in_a_plane_is_judged_as_by_the_checker_in_the_plane(feed, turn):
    maze, workspace = corner()
    feeds = np.linspace(0.0, feed, math.ceil(feed / 2.4) + 1)
    n_links = math.ceil(feed / 60.0)
    last = np.where(np.arange(n_links) >= n_links - 6, turn, 0.0)
    angles = np.concatenate([np.zeros((len(feeds), n_links)), np.linspace(0.0, 1.0, 81)[1:, None] * last])
    feeds = np.concatenate([feeds, np.full(80, feed)])
    flat = Motion.from_configurations(feeds, angles, 60.0, maze.base_pose)
    bends = np.stack([angles, np.zeros_like(angles)], axis=2)
    solid = SpatialMotion.from_configurations(feeds, bends, 60.0, workspace.base_pose_for(60.0))
    assert np.allclose(solid.joints[..., :2], flat.joints, atol=1e-9)
    wanted, report = planar.validate(flat, maze), validate(solid, workspace)
    assert kinds_of(report) == kinds_of(wanted)
    assert report.largest_step == pytest.approx(wanted.largest_step)
    assert report.goal_distance == pytest.approx(wanted.goal_distance)
    if wanted.clearance >= 0.0:
        assert report.clearance == pytest.approx(wanted.clearance, abs=1e-9)
    else:
        assert report.clearance < 0.0


@pytest.mark.parametrize("thickness", [1e-4, 0.01, 0.04, 0.1, 1.0])
def test_no_wall_is_so_thin_that_a_link_may_pass_through_it_between_poses(thickness):
    # The last link swings past a fin that lies along it between two poses: no depth is over half of it.
    fin = [[LENGTH - thickness / 2.0, 4.0, -5.0], [LENGTH + thickness / 2.0, 8.0, 5.0]]
    swing = [[0.0, 0.0], [2.0, 0.0]]
    kinds = kinds_of(validate(bent(space(), 2, swing), space()))
    assert not kinds & {"penetration", "sweep"}
    kinds = kinds_of(validate(bent(space(fin), 2, swing), space(fin)))
    assert kinds & {"penetration", "sweep"}
    assert thickness > 1e-3 or "penetration" not in kinds


@pytest.mark.parametrize("turn", [1.5, 3.0, math.pi, 2.0 * math.pi])
def test_a_joint_does_not_turn_about_between_two_poses(turn):
    workspace, angles = space(), np.zeros((3, 1, 2))
    angles[2, 0, 0] = turn
    report = validate(moved(workspace, [0.0, 5.0, 5.0], angles), workspace)
    assert kinds_of(report) & {"step", "crossing"}
