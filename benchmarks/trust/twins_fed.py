"""The kernels of arms out of a feeder, which samplers and growers use, against slow twins."""

from __future__ import annotations

import itertools
import math

import numpy as np
import shapely

from benchmarks.trust.twin_draws import distances_to, on_grid, segments, some_walls, star, walls_of
from hrsnake_env.arm import joints_from_configuration
from planners.kernels import fed_arm, fed_growth, fed_shortcut

RELEASE = 16.0
NEAR = 1e-9


def a_scene(rng, margin=None):
    """Draw a scene in a ring with a bar in it; the base is inside and off the walls."""
    ring = star(rng, low=2.0, high=5.0)
    walls = np.concatenate([walls_of(ring), some_walls(rng, 2.5, 2)])
    walls = walls[(walls[:, 0] != walls[:, 1]).any(axis=1)]
    base = np.append(rng.uniform(-0.5, 0.5, 2), rng.uniform(-math.pi, math.pi))
    if distances_to(walls, shapely.points(base[None, :2]))[0] < 0.05:
        return None
    margin = rng.uniform(0.0, 0.05) if margin is None else margin
    return fed_arm.FedScene(
        base_pose=base, walls=walls, release=RELEASE, margin=margin, apart=rng.choice([0.0, 0.1])
    )


def a_state(rng, n_links=None, least=0.0):
    """Draw a state: any feed, none, whole ones, all; small and large angles."""
    n_links = int(rng.integers(1, 6)) if n_links is None else n_links
    state = rng.normal(scale=rng.choice([0.1, 0.5, 2.0]), size=n_links)
    feed = rng.uniform(least, n_links)
    state[0] = rng.choice([feed, min(max(np.round(feed), least), n_links), least, n_links])
    return state


def angles_of(state, release=RELEASE):
    """Return the joint angles that a state means, joint 0 first."""
    past = state[0] - (len(state) - np.arange(len(state)))
    limits = np.maximum(release * past, 0.0)
    angles = np.clip(state, -limits, limits)
    angles[0] = 0.0
    return angles


def points_of(state, scene):
    """Return the base and the joints past it, by the environment's own kinematics."""
    joints = joints_from_configuration(state[0], angles_of(state), 1.0, scene.base_pose)
    past = state[0] - (len(state) - np.arange(len(state) + 1)) > 0.0
    return np.concatenate([scene.base_pose[None, :2], joints[past]])


def chain(points):
    """Return the links of a chain of points as shapes."""
    return segments(points[:-1], points[1:])


def an_arm_is_placed_as_the_environment_places_it(rng):
    """fed_arm.place_arm."""
    scene, state = a_scene(rng), a_state(rng)
    if scene is None:
        return False
    points = np.full((len(state) + 1, 2), np.nan)
    n = fed_arm.place_arm(state, scene, points)
    np.testing.assert_allclose(points[:n], points_of(state, scene), atol=1e-12)
    assert np.isnan(points[n:]).all()
    return None


def distances_of_points_and_segments_are_shapelys(rng):
    """fed_arm.squared_distance and fed_arm.keeps_off: also of points, in line, end to end, with need 0."""
    a, b, c, d = on_grid(rng, rng.uniform(-2, 2, (4, 2)))
    if rng.random() < 0.3:
        b, c, d = (a + rng.integers(-2, 3) * np.array([1.0, 0.5]) for _ in range(3))
    if rng.random() < 0.1:
        b = a
    ab, cd = segments(np.array([a]), np.array([b]))[0], segments(np.array([c]), np.array([d]))[0]
    found = math.sqrt(fed_arm.squared_distance(c, a, b))
    assert abs(found - shapely.distance(shapely.Point(c), ab)) < NEAR
    gap, need = shapely.distance(ab, cd), rng.choice([0.0, 0.1, 1.0])
    if abs(gap - need) > NEAR or need == gap == 0.0:
        assert fed_arm.keeps_off(a, b, c, d, need) == (gap > 0.0 and gap >= need)


def clear_by_how_much(points, needs, scene):
    """Return by how much a chain keeps off everything beyond what it needs, by shapely; 0 is a touch."""
    links, off = chain(points), [math.inf]
    needs = np.maximum(needs[:-1], needs[1:])
    walls = distances_to(scene.walls, links)
    off += [gap if k == 0 else (gap - needs[k] if gap > 0.0 else -1.0) for k, gap in enumerate(walls)]
    for k in range(len(links)):
        for other in range(k + 2, len(links)):
            gap = shapely.distance(links[k], links[other])
            off.append(gap - needs[k] - needs[other] - scene.apart if gap > 0.0 else -1.0)
    return min(off)


def a_chain_is_clear_where_shapely_says_so(rng):
    """fed_arm.is_clear and fed_arm.state_is_clear."""
    scene, state = a_scene(rng), a_state(rng)
    if scene is None:
        return False
    points = points_of(state, scene)
    needs = rng.uniform(0.0, 0.3, len(points))
    by = clear_by_how_much(points, needs, scene)
    if abs(by) > NEAR:
        assert fed_arm.is_clear(points, len(points), scene, needs) == (by > 0.0)
    by = clear_by_how_much(points, np.full(len(points), scene.margin), scene)
    if abs(by) > NEAR:
        assert fed_arm.state_is_clear(state, scene) == (by > 0.0)
    return None


def the_room_around_is_counted_move_by_move(rng):
    """fed_arm.room_around."""
    scene, state = a_scene(rng), a_state(rng)
    if scene is None:
        return False
    moves = rng.normal(scale=0.3, size=(int(rng.integers(0, 9)), len(state)))
    count = 0
    for move in moves:
        moved = state + move
        moved[0] = np.clip(moved[0], 0.0, len(state))
        points = points_of(moved, scene)
        by = clear_by_how_much(points, np.full(len(points), scene.margin), scene)
        if abs(by) < NEAR:
            return False
        count += by > 0.0
    assert fed_arm.room_around(state, moves, scene) == count
    return None


def joints_moved(poses, scene):
    """Return the largest movement between poses of a joint in front of the base in both, and of the feed."""
    moved = [0.0]
    for one, other in itertools.pairwise(poses):
        before, after = points_of(one, scene)[1:], points_of(other, scene)[1:]
        n = min(len(before), len(after))
        if n:
            moved.append(np.hypot(*(after[len(after) - n :] - before[len(before) - n :]).T).max())
        moved.append(abs(other[0] - one[0]))
    return max(moved)


def poses_along_an_edge_are_near_to_each_other_and_the_same_both_ways(rng):
    """fed_arm.edge_poses and fed_arm.edge_poses_onward."""
    scene, a = a_scene(rng), a_state(rng)
    if scene is None:
        return False
    b = a_state(rng, len(a)) if rng.random() < 0.8 else a.copy()
    onward, poses = fed_arm.edge_poses_onward(a, b, scene), fed_arm.edge_poses(a, b, scene)
    np.testing.assert_array_equal(poses, fed_arm.edge_poses(b, a, scene)[::-1])
    shortest = fed_arm.SHORTEST * (np.abs(b - a).sum() + 1.0) * len(a)
    for some in (onward, poses):
        for end, pose in ((a, some[0]), (b, some[-1])):
            assert abs(pose[0] - end[0]) < 1e-11
            np.testing.assert_allclose(angles_of(pose)[1:], angles_of(end)[1:], atol=1e-9)
        # Every pose is at its share of the edge, with the angles that the arm has there.
        direction = b - a
        for pose in some:
            if direction[0] == 0.0:
                break
            share = (pose[0] - a[0]) / direction[0]
            expected = angles_of(np.append(pose[0], a[1:] + share * direction[1:]))
            np.testing.assert_allclose(pose[1:], expected[1:], atol=1e-8)
        assert joints_moved(some, scene) <= fed_arm.STEP + RELEASE * shortest
        low, high = sorted((a[0], b[0]))
        passed = np.arange(math.ceil(low), math.floor(high) + 1)
        assert low == high or np.isin(passed, some[:, 0]).all()
    return None


def an_edge_that_is_clear_is_so_at_all_places_and_one_well_off_is_clear(rng):
    """fed_arm.edge_is_clear: against shapely at places between the poses."""
    scene, a = a_scene(rng, margin=rng.choice([1e-3, 0.02])), a_state(rng, 3, least=0.0)
    if scene is None or not fed_arm.state_is_clear(a, scene):
        return False
    b = a + rng.normal(scale=0.3, size=3)
    b[0] = np.clip(b[0], 0.0, 3.0)
    poses = fed_arm.edge_poses(a, b, scene)
    worst = math.inf
    for one, other in itertools.pairwise(poses):
        for share in (0.0, 0.35, 0.7, 1.0):  # between poses, feed and angles change linearly
            points = points_of(one + share * (other - one), scene)
            worst = min(worst, clear_by_how_much(points, np.full(len(points), scene.margin), scene))
    clear = fed_arm.edge_is_clear(a, b, scene)
    assert not clear or worst > -1e-9
    assert clear or worst < 0.06
    return None


def a_link_is_free_where_shapely_says_so(rng):
    """fed_growth.link_is_free."""
    walls, need = some_walls(rng), rng.choice([0.0, 0.2])
    a, b = on_grid(rng, rng.uniform(-3, 3, (2, 2)))
    off = distances_to(walls, segments(a[None], b[None]))[0]
    if off == need == 0.0 or abs(off - need) > NEAR:
        assert fed_growth.link_is_free(a, b, walls, need) == (off > 0.0 and off >= need)


def free_angles_are_those_in_which_a_link_meets_no_wall(rng):
    """fed_growth.free_directions: 60 links of length 1 as shapes."""
    walls, place, heading = some_walls(rng), on_grid(rng, rng.uniform(-2, 2, 2)), rng.uniform(-4, 4)
    walls = walls[(walls[:, 0] != walls[:, 1]).any(axis=1)]
    most = rng.choice([0.0, 0.3, 2.0, 3.1])
    if distances_to(walls, shapely.points(place[None]))[0] < 1e-3:
        return False
    ranges = fed_growth.free_directions(place, heading, most, walls)
    assert (ranges[:, 0] < ranges[:, 1]).all() and (np.abs(ranges) <= most).all()
    assert (ranges[1:, 0] >= ranges[:-1, 1]).all()
    angles = rng.uniform(-most, most, 60)
    tips = place + np.column_stack([np.cos(heading + angles), np.sin(heading + angles)])
    off = distances_to(walls, segments(place[None], tips))
    inside = ((ranges[:, 0] <= angles[:, None]) & (angles[:, None] <= ranges[:, 1])).any(axis=1)
    doubtful = (np.abs(ranges.ravel() - angles[:, None]) < 1e-6).any(axis=1)
    assert not (inside & ~doubtful & (off == 0.0)).any()
    assert most == 0.0 or not (~inside & ~doubtful & (off > 1e-5)).any()
    return None


def a_guide(rng):
    """Draw a guide: evenly spaced points on a straight way that bends once."""
    spacing, n = rng.choice([0.05, 0.1, 0.24]), int(rng.integers(2, 60))
    angles = np.where(np.arange(n) < n // 2, 0.0, rng.uniform(-1, 1)) + rng.uniform(-3, 3)
    steps = spacing * np.column_stack([np.cos(angles), np.sin(angles)])
    return fed_growth.Guide(points=np.cumsum(steps, axis=0), spacing=spacing, radius=0.1)


def seen_from(place, after, guide, walls):
    """Return the farthest guide point seen, by shapely; None where a wall is only touched or nearly so."""
    steps = int(1.0 / guide.spacing)
    last = min(after + 2 * steps + 1, len(guide.points) - 1)
    points = guide.points[max(after - steps, 0) : last + 1]
    off = distances_to(walls, segments(place[None], points))
    if ((off > 0.0) & (off < NEAR)).any():
        return None
    return int(np.flatnonzero(off > 0.0).max(initial=-1 - max(after - steps, 0))) + max(after - steps, 0)


def the_farthest_point_seen_is_the_last_in_the_window(rng):
    """fed_growth.farthest_seen."""
    walls, guide, place = some_walls(rng), a_guide(rng), rng.uniform(-2, 2, 2)
    after = int(rng.integers(0, len(guide.points)))
    expected = seen_from(place, after, guide, walls)
    if expected is None:
        return False
    assert fed_growth.farthest_seen(place, after, guide, walls) == expected
    return None


def grown_links_are_free_lead_on_and_are_written_down_rightly(rng):
    """fed_growth.grow: two rounds from the base; each new joint against all that its docstring says."""
    scene, guide = a_scene(rng), a_guide(rng)
    if scene is None:
        return False
    base, axis = scene.base_pose[:2], scene.base_pose[2]
    guide = guide._replace(points=guide.points + base)
    way, most_bent, progress = rng.uniform(0.0, 1.0), rng.choice([0.5, 2.5]), rng.choice([-1.0, 0.1])
    first = base + way * np.array([math.cos(axis), math.sin(axis)])
    rest = guide.spacing * (len(guide.points) - 1)
    chains = fed_growth.Chains(
        np.array([base, first]), np.array([axis, axis]), np.zeros(2), np.array([-1, 0]),
        np.zeros(2, dtype=np.int64), np.full(2, rest + 1.0), np.zeros(2),
    )  # fmt: skip
    joints = np.array([1])
    for _ in range(2):
        draws = rng.random((len(joints), fed_growth.MOST))
        grown = fed_growth.grow(chains, joints, scene, most_bent, guide, progress, draws)
        places, headings, angles, parents, guides, to_go, bent = grown
        for k in range(len(places)):
            p = parents[k]
            assert p in joints and abs(headings[k] - chains.headings[p] - angles[k]) < 1e-12
            ahead = np.array([math.cos(headings[k]), math.sin(headings[k])])
            np.testing.assert_allclose(places[k], chains.places[p] + ahead, atol=1e-12)
            limit = min(most_bent, RELEASE * way) if chains.parents[p] == 0 else most_bent
            assert abs(angles[k]) <= limit and abs(bent[k] - chains.bent[p] - angles[k] ** 2) < 1e-12
            link = segments(chains.places[p][None], places[k][None])
            assert distances_to(scene.walls, link)[0] >= 2.0 * scene.margin - NEAR
            assert distances_to(scene.walls, segments(places[k][None], guide.points[guides[k]][None]))[0] > 0
            seen = seen_from(places[k], chains.guides[p], guide, scene.walls)
            assert seen is None or seen == guides[k]
            left = guide.spacing * (len(guide.points) - 1 - guides[k])
            left += np.hypot(*(places[k] - guide.points[guides[k]]))
            assert abs(left - to_go[k]) < 1e-9 and left <= chains.to_go[p] - progress + 1e-12
        joints = len(chains.places) + np.arange(min(len(places), 3))
        chains = fed_growth.Chains(
            *(np.concatenate([old, new]) for old, new in zip(chains, grown, strict=True))
        )
        if not len(joints):
            break
    return None


def paths_are_as_long_as_their_edges_and_shortcuts_no_longer(rng):
    """fed_shortcut.path_length and fed_shortcut.shortcut."""
    scene = a_scene(rng, margin=1e-3)
    if scene is None:
        return False
    path = [np.zeros(3)]
    for _ in range(30):
        state = path[-1] + rng.normal(scale=0.3, size=3)
        state[0] = np.clip(state[0], 0.0, 3.0)
        if fed_arm.edge_is_clear(path[-1], state, scene):
            path.append(state)
    path = np.array(path)
    length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
    assert abs(fed_shortcut.path_length(path) - length) < 1e-9
    if len(path) < 2:
        return False
    short = fed_shortcut.shortcut(path, rng.random((20, 2)), scene)
    np.testing.assert_array_equal(short[[0, -1]], path[[0, -1]])
    assert np.linalg.norm(np.diff(short, axis=0), axis=1).sum() <= length + 1e-12
    for one, other in itertools.pairwise(short):
        for share in np.linspace(0.0, 1.0, 7):
            points = points_of(one + share * (other - one), scene)
            assert clear_by_how_much(points, np.full(len(points), scene.margin), scene) > -1e-9
    return None


LAWS = (
    an_arm_is_placed_as_the_environment_places_it,
    distances_of_points_and_segments_are_shapelys,
    a_chain_is_clear_where_shapely_says_so,
    the_room_around_is_counted_move_by_move,
    poses_along_an_edge_are_near_to_each_other_and_the_same_both_ways,
    an_edge_that_is_clear_is_so_at_all_places_and_one_well_off_is_clear,
    a_link_is_free_where_shapely_says_so,
    free_angles_are_those_in_which_a_link_meets_no_wall,
    the_farthest_point_seen_is_the_last_in_the_window,
    grown_links_are_free_lead_on_and_are_written_down_rightly,
    paths_are_as_long_as_their_edges_and_shortcuts_no_longer,
)
