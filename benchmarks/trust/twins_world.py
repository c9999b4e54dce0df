"""The environment's kernels against slow twins: the simulator's arithmetic, senses, observations, ways."""

from __future__ import annotations

import itertools
import math
from functools import cache

import numpy as np
import shapely

from benchmarks.trust.twin_draws import (
    distances_to,
    lines,
    on_grid,
    random_maze,
    segments,
    some_walls,
    star,
    walls_of,
)
from hrsnake_env import dynamics, geodesic, observation, sensing, task
from hrsnake_env.arm import feeder_angle_limits, joints_from_configuration


def a_target(rng, n_links=None, length=1.0):
    """Draw feed and joint angles, those in the feeder straight."""
    n_links = int(rng.integers(1, 9)) if n_links is None else n_links
    feed = rng.choice([0.0, n_links, rng.integers(0, n_links + 1), rng.uniform(0, n_links)]) * length
    limits = feeder_angle_limits(feed, n_links, length)
    return np.append(feed, np.clip(rng.normal(scale=0.8, size=n_links), -limits, limits))


def joints_of(target, length):
    """Return the joints of a configuration by the arm's own kinematics, the base at the origin."""
    return joints_from_configuration(target[0], target[1:], length, (0.0, 0.0, 0.0))


def substeps_are_linear_and_straight_in_the_feeder(rng):
    """dynamics.step_targets and dynamics.divide."""
    length, rows = 10.0 ** rng.uniform(-2, 3), int(rng.integers(1, 9))
    start, end = a_target(rng, length=length), None
    end = a_target(rng, len(start) - 1, length)
    targets = np.full((rows, len(start)), np.nan)
    dynamics.step_targets(start, end, length, targets)
    shares = np.arange(1, rows + 1)[:, None] / rows
    expected = (1.0 - shares) * start + shares * end
    limits = feeder_angle_limits(expected[:, 0], len(start) - 1, length)
    expected[:, 1:] = np.clip(expected[:, 1:], -limits, limits)
    np.testing.assert_allclose(targets, expected, rtol=1e-9, atol=1e-9)
    assert targets[-1, 0] == end[0]
    again, largest = np.empty_like(targets), length * rng.uniform(0.01, 1.0)
    parts = dynamics.divide(start, end, length, largest, again)
    np.testing.assert_array_equal(again, targets)
    joints = [joints_of(row, length) for row in (start, *targets)]
    moved = max(np.hypot(*(b - a).T).max() for a, b in itertools.pairwise(joints))
    assert abs(moved / largest - parts) < 1.0 + 1e-9 and parts >= moved / largest - 1e-9
    assert abs(dynamics.largest_move(start, targets, length) - moved) < 1e-9 * length


def joints_and_links_are_placed_as_the_arms_kinematics_place_them(rng):
    """dynamics.place_links, place_joints and largest_distance."""
    length, target = 10.0 ** rng.uniform(-2, 3), a_target(rng)
    target[0] *= length
    n = len(target) - 1
    poses, nodes, joints = np.empty((n, 3)), np.empty((n + 1, 2)), np.empty((n + 1, 2))
    dynamics.place_links(target, length, poses, nodes)
    expected = joints_of(target, length)
    np.testing.assert_allclose(nodes, expected, atol=1e-9 * length)
    np.testing.assert_allclose(poses[:, :2], 0.5 * (expected[1:] + expected[:-1]), atol=1e-9 * length)
    np.testing.assert_allclose(poses[:, 2], np.cumsum(target[1:]), atol=1e-12)
    dynamics.place_joints(target, length, joints)
    np.testing.assert_allclose(joints - expected, [[n * length, 0.0]] * (n + 1), atol=1e-9 * length)
    other = joints + rng.normal(size=joints.shape)
    twin = np.hypot(*(other - joints).T).max()
    np.testing.assert_allclose(dynamics.largest_distance(joints, other), twin)


def a_simulated_arm(rng, n=None):
    """Draw link states (centre, heading, velocities) of a chain that moves, length, timestep and targets."""
    length, timestep = rng.uniform(0.5, 30.0), 10.0 ** rng.uniform(-3, -1)
    target = a_target(rng, n, 1.0)
    target[0] *= length
    n = len(target) - 1
    poses, nodes = np.empty((n, 3)), np.empty((n + 1, 2))
    dynamics.place_links(target, length, poses, nodes)
    state = np.column_stack([poses, rng.normal(scale=0.1, size=(n, 3))])
    aim = target + 0.02 * rng.normal(size=n + 1)
    dynamics.place_links(aim, length, poses, nodes)
    return state, target, aim, poses, nodes, length, timestep


def jacobian_of_links(state, length, timestep):
    """Return how feed and joint angles move centres and headings of links, at the predicted positions."""
    n = len(state)
    places, turned = state[:, :2] + timestep * state[:, 3:5], state[:, 2] + timestep * state[:, 5]
    starts = places - 0.5 * length * np.column_stack([np.cos(turned), np.sin(turned)])
    jacobian = np.zeros((n, 3, n + 1))
    jacobian[:, 0, 0] = 1.0
    for k in range(n):
        for a in range(k + 1):
            x, y = places[k] - starts[a]
            jacobian[k, :, 1 + a] = -y, x, 1.0
    return jacobian


def servo_forces_reach_the_target_and_their_torques_are_the_jacobians(rng):
    """dynamics.servo_forces: after the next substep the link is at its target; torques are J^T F."""
    state, _, _, poses, _, length, timestep = a_simulated_arm(rng)
    n, held = len(state), int(rng.integers(0, len(state) + 1))
    forces, torques = np.full((n + 1, 3), np.nan), np.empty(n)
    feed = dynamics.servo_forces(state, poses, length, timestep, held, forces, torques)
    # Bodies are moved before their velocities change: position, then velocity, then position.
    inertia = np.array([1.0, 1.0, length**2 / 12.0])
    velocity = state[:, 3:] + timestep * forces[:n] / inertia
    reached = state[:, :3] + timestep * state[:, 3:] + timestep * velocity
    np.testing.assert_allclose(reached, poses, atol=1e-8 * length)
    assert np.isnan(forces[n]).all()
    whole = np.einsum("kxa,kx->a", jacobian_of_links(state, length, timestep), forces[:n])
    scale = np.abs(whole).max() + length
    np.testing.assert_allclose(feed, whole[0], atol=1e-9 * scale)
    np.testing.assert_allclose(torques[held:], whole[1 + held :], atol=1e-8 * scale * length)
    assert not torques[:held].any()


def limited_torques_keep_the_limit_and_coast_or_reach(rng):
    """dynamics.limited_forces and drive: within the limit; with a wide one as if there were none."""
    state, target, aim, poses, nodes, length, timestep = a_simulated_arm(rng, int(rng.integers(2, 7)))
    n = len(state)
    held = int(rng.integers(0, n))
    # What the feeder holds lies on its axis and is still.
    forces, torques, effort = np.zeros((n, 3)), np.zeros(n), np.zeros(n + 1)
    limit = 10.0 ** rng.uniform(-2, 4)
    dynamics.limited_forces(state, target, aim, length, timestep, limit, held, forces, torques)
    assert np.isfinite(forces).all() and (np.abs(torques) <= limit * (1 + 1e-12)).all()
    free, whole = np.zeros((n, 3)), np.zeros(n)
    feed = dynamics.servo_forces(state, poses, length, timestep, held, free, whole)
    dynamics.drive(
        aim, target, state, length, timestep, math.inf, held, poses, nodes, forces, torques, effort
    )
    np.testing.assert_allclose(forces, free)
    np.testing.assert_allclose(effort, np.append(feed, whole))
    np.testing.assert_allclose(nodes, joints_of(aim, length), atol=1e-9 * length)
    effort[:] = 1.0
    dynamics.drive(aim, target, state, length, timestep, limit, held, poses, nodes, forces, torques, effort)
    assert (np.abs(torques) <= limit * (1 + 1e-12)).all()
    np.testing.assert_allclose(effort[1:], 1.0 + torques)
    if (np.abs(whole) <= limit).all():
        np.testing.assert_allclose(forces, free)


def ends_off_their_places_are_measured_and_nan_is_noticed(rng):
    """dynamics.deviation and read_links."""
    state, _, _, _, nodes, length, _ = a_simulated_arm(rng)
    n = len(state)
    state[:, :2] += 0.1 * rng.normal(size=(n, 2))
    broken = rng.random() < 0.2
    if broken:
        state[rng.integers(0, n), rng.integers(0, 6)] = math.nan
    half = 0.5 * length * np.column_stack([np.cos(state[:, 2]), np.sin(state[:, 2])])
    rear, front = state[:, :2] - half, state[:, :2] + half
    joints = np.empty((n + 1, 2))
    error, drift = dynamics.deviation(state, nodes, length, joints)
    numbers, read, tracking = np.append(state.ravel(), [math.nan] * 3), np.empty((n, 6)), rng.random(4)
    before = tracking.copy()
    dynamics.read_links(numbers, nodes, length, read, joints, tracking)
    np.testing.assert_array_equal(read, state)
    if broken:
        assert math.isnan(error) and math.isnan(drift) and np.isinf(tracking).all()
        return
    errors = np.hypot(*(np.concatenate([rear - nodes[:-1], front - nodes[1:]])).T)
    gaps = np.hypot(*(rear[1:] - front[:-1]).T)
    np.testing.assert_allclose([error, drift], [errors.max(), gaps.max(initial=0.0)], atol=1e-9)
    expected = np.concatenate([rear[:1], 0.5 * (rear[1:] + front[:-1]), front[-1:]])
    np.testing.assert_allclose(joints, expected, atol=1e-9 * length)
    np.testing.assert_allclose(tracking, np.maximum(before, [error, drift] * 2))


def an_action_moves_no_joint_too_far_and_takes_nan_for_what_it_is(rng):
    """task.next_target."""
    length, limit = 10.0 ** rng.uniform(-1, 3), rng.uniform(0.1, math.pi)
    target = a_target(rng, length=length)
    n = len(target) - 1
    target[1:] = np.clip(target[1:], -limit, limit)
    action, absolute, wanted = rng.uniform(-1.5, 1.5, n + 1), bool(rng.random() < 0.5), np.empty(n + 1)
    bad = -1
    if rng.random() < 0.2:
        bad = int(rng.integers(0, n + 1))
        action[bad] = rng.choice([math.nan, math.inf, -math.inf])
    assert task.next_target(target, action, absolute, length, limit, wanted) == bad
    if bad >= 0:
        return
    moved = np.hypot(*(joints_of(wanted, length) - joints_of(target, length)).T).max()
    assert moved <= task.LARGEST_STEP * length * (1.0 + 1e-5)
    limits = np.minimum(feeder_angle_limits(wanted[0], n, length), limit)
    assert (np.abs(wanted[1:]) <= limits + 1e-12).all() and 0.0 <= wanted[0] <= n * length * (1 + 1e-12)
    # What is asked for: the whole of it, where no joint moves too far.
    cut, steps = np.clip(action, -1.0, 1.0), np.append(task.FEED_STEP * length, np.full(n, task.JOINT_STEP))
    change = cut * steps
    if absolute:
        goal = np.append(0.5 * (cut[0] + 1.0) * n * length, cut[1:] * limit)
        change = np.clip(goal - target, -steps, steps)
    whole = target + change
    whole[0] = np.clip(whole[0], 0.0, n * length)
    free = np.minimum(feeder_angle_limits(whole[0], n, length), limit)
    whole[1:] = np.clip(whole[1:], -free, free)
    far = np.hypot(*(joints_of(whole, length) - joints_of(target, length)).T).max()
    if far <= task.LARGEST_STEP * length:
        np.testing.assert_allclose(wanted, whole, rtol=1e-9, atol=1e-9 * length)


def around_an_arm(rng, size=3.0):
    """Draw walls, shape (n, 4), of a ring and loose ones, and an arm that comes out of the feeder in them."""
    walls = np.concatenate([walls_of(star(rng, low=0.5, high=size)), some_walls(rng, size)])
    target = a_target(rng)
    joints = joints_of(target, 1.0)
    n = len(target) - 1
    held = int((target[0] - (n - np.arange(n)) <= 0.0).sum())
    state = np.zeros((n, 6))
    state[:, :2] = 0.5 * (joints[1:] + joints[:-1])
    state[:, 2] = np.cumsum(target[1:])
    state[:, 3:] = rng.normal(size=(n, 3))
    return walls, target, joints, held, state


def clearances_by_shapely(walls, joints, held, reach):
    """Return what `link_distances` shall, by shapely; links in the gate see walls in front of the base."""
    expected = np.full(len(joints) - 1, reach)
    for k in range(len(joints) - 1):
        a, b = joints[k], joints[k + 1]
        if k < held - 1 or (k == held - 1 and b[0] <= 0.0):
            continue
        seen = walls
        if k == held - 1:
            seen = walls[walls[..., 0].max(axis=1) > 0.0]
            a = np.array([0.0, a[1] - a[0] * (b - a)[1] / (b - a)[0]]) if a[0] < 0.0 else a
        expected[k] = min(reach, distances_to(seen, segments(a[None], b[None]))[0])
    return expected


def links_are_as_far_from_walls_as_shapely_says(rng):
    """sensing.link_distances: walls that are crossed, touched, of length 0."""
    walls, _, joints, held, _ = around_an_arm(rng)
    joints, reach = on_grid(rng, joints), rng.choice([0.3, 1.0, 5.0])
    distances = np.full(len(joints) - 1, np.nan)
    sensing.link_distances(joints, held, walls.reshape(-1, 4), reach, distances)
    np.testing.assert_allclose(distances, clearances_by_shapely(walls, joints, held, reach), atol=1e-7)


def readings_are_those_of_the_arm_in_maze_units(rng):
    """sensing.read_arm."""
    walls, target, joints, held, state = around_an_arm(rng)
    n, radius, frame = (
        len(state),
        rng.uniform(0.0, 0.2),
        np.append(rng.normal(size=3), 10.0 ** rng.uniform(-2, 2)),
    )
    touched = rng.choice([math.inf, 0.05, -0.01], n)
    angles, speeds, clearances = (np.full(n, np.nan) for _ in range(3))
    readings = np.full(sensing.N_READINGS, np.nan)
    sensing.read_arm(
        state, joints, held, walls.reshape(-1, 4), 1.0, radius, touched, frame, angles, speeds, clearances,
        readings,
    )  # fmt: skip
    np.testing.assert_allclose(angles, target[1:], atol=1e-9)
    np.testing.assert_allclose(np.cumsum(speeds), state[:, 5], atol=1e-9)
    off = clearances_by_shapely(walls, joints, held, 1.0)
    off = np.minimum(np.where(off < 1.0 - 1e-9, off - radius, 1.0), touched) / frame[3]
    if not (np.abs(clearances_by_shapely(walls, joints, held, 2.0) - 1.0) < 1e-9).any():
        np.testing.assert_allclose(clearances, off, atol=1e-6 / frame[3])
    c, s = math.cos(frame[2]), math.sin(frame[2])
    tip = frame[:2] + np.array([[c, -s], [s, c]]) @ joints[-1] / frame[3]
    heading = state[-1, 2] + frame[2]
    expected = [target[0] / frame[3], *tip, heading, state[0, 3] / frame[3], clearances.min()]
    np.testing.assert_allclose(readings, expected, rtol=1e-9, atol=1e-9 / frame[3] + 1e-9)


def ray_length(walls, place, heading, reach):
    """Return how far a ray goes to the first wall by shapely, and whether it is certain."""
    ahead = np.array([math.cos(heading), math.sin(heading)])
    ray = shapely.LineString([place, place + reach * ahead])
    shape = lines(walls)
    hit = shapely.intersection(ray, shape)
    if hit.is_empty:
        return reach, bool(shapely.distance(ray, shape) > 1e-9)
    at = shapely.distance(shapely.Point(place), hit)
    ends = walls.reshape(-1, 2) - place
    beside = np.abs(ends @ np.array([-ahead[1], ahead[0]]))
    at_a_wall = shapely.distance(shapely.Point(place), shape) < 1e-9
    return at, not (at_a_wall or ((beside < 1e-9) & (ends @ ahead > -1e-9)).any())


def rays_end_at_the_first_wall_and_at_corners_do_not_slip_through(rng):
    """sensing.cast_rays: from everywhere, and straight at the corners of a ring, which is closed."""
    walls, _, joints, held, state = around_an_arm(rng)
    n, reach = len(state), rng.choice([0.5, 2.0, 20.0])
    rays = np.full(sensing.N_TIP_RAYS + 2 * n, np.nan)
    sensing.cast_rays(state, joints, held, walls.reshape(-1, 4), reach, rays)
    assert ((rays >= 0.0) & (rays <= 1.0)).all()
    headings = [(joints[-1], state[-1, 2] + turn, True) for turn in sensing.TIP_RAYS]
    means = 0.5 * (np.append(0.0, state[:-1, 2]) + state[:, 2])
    for k in range(n):
        headings += [(joints[k], means[k] + side * math.pi / 2.0, k >= held) for side in (-1, 1)]
    for ray, (place, heading, counts) in zip(rays, headings, strict=True):
        if not counts:
            assert ray == 1.0
            continue
        expected, certain = ray_length(walls, place, heading, reach)
        assert not certain or abs(ray * reach - expected) < 1e-6
    # Straight at a corner: the tip's rays from inside a closed ring always end.
    ring = star(rng, n=int(rng.integers(5, 12)), low=0.5, high=3.0)
    corner = ring[rng.integers(0, len(ring))]
    state, tip = np.zeros((1, 6)), np.zeros((2, 2))
    state[0, 2] = math.atan2(corner[1], corner[0]) - sensing.TIP_RAYS[int(rng.integers(0, 8))]
    rays = np.empty(sensing.N_TIP_RAYS + 2)
    sensing.cast_rays(state, tip, 1, walls_of(ring).reshape(-1, 4), 10.0, rays)
    assert (rays[: sensing.N_TIP_RAYS] < 0.31).all()


def an_observation_is_scaled_and_cut_part_by_part(rng):
    """observation.write_observation: with and without goal and rays; of numbers that are not, zeros."""
    n, link, limit = int(rng.integers(1, 7)), rng.uniform(0.5, 500.0), rng.uniform(0.5, 3.0)
    reach, wide = n * link, rng.choice([0.1, 1.0])
    angles, speeds, clear = wide * rng.normal(size=(3, n))
    clear = clear * link
    tip, heading, feed = wide * reach * rng.normal(size=2), rng.uniform(-4, 4), rng.uniform(0.0, reach)
    readings = np.array([feed, *tip, heading, rng.normal() * link, clear.min()])
    target = np.append(feed, angles) + 0.02 * rng.normal(size=n + 1)
    scales, base = np.array([link, 0.02 * link, 0.05, limit]), rng.normal(size=3)
    goal, with_goal = reach * rng.normal(size=2), bool(rng.random() < 0.5)
    ahead, rays = (
        tip + link * rng.normal(size=(len(observation.AHEAD), 2)),
        rng.random(rng.choice([0, 8 + 2 * n])),
    )
    distance = rng.uniform(0.0, 1.5)
    parts = observation.observation_parts(n, goal=with_goal, rays=len(rays) > 0)
    out = np.full(sum(number for number, _ in parts.values()), np.nan, dtype=np.float32)
    broken = rng.random() < 0.2
    if broken:
        readings[rng.integers(0, 6)] = rng.choice([math.nan, math.inf])
    observation.write_observation(
        angles, speeds, clear, readings, target, scales, base, with_goal, goal, distance, ahead, rays, out
    )
    if broken:
        assert not out.any()
        return
    c, s = math.cos(heading), math.sin(heading)
    turned = (ahead - tip) @ np.array([[c, -s], [s, c]]) / (np.array(observation.AHEAD)[:, None] * link)
    per_step = observation.CONTROL_TIMESTEP
    expected = {
        "feed": [feed / reach],
        "joint_angles": angles / limit,
        "target_errors": (target - np.append(feed, angles)) / np.append(0.02 * link, np.full(n, 0.05)),
        "speeds": np.append(readings[4] * per_step / (0.02 * link), speeds * per_step / 0.05),
        "tip_position": (tip - base[:2]) / reach,
        "tip_heading": [c, s],
        "clearances": clear / link,
        "goal_offset": (goal - tip) / reach,
        "goal_distance": [distance],
        "ahead": turned.ravel(),
        "tip_rays": rays[:8],
        "side_rays": rays[8:],
    }
    whole = np.concatenate([np.clip(expected[name], low, 1.0) for name, (_, low) in parts.items()])
    np.testing.assert_allclose(out, whole, atol=1e-5)


@cache
def ways_of(number):
    """Return a random maze, its ways, and the corners that see each other with their ways, made once."""
    maze = random_maze(number)
    space = maze.free_space.buffer(1e-9 * maze.size, join_style="mitre")
    shapely.prepare(space)
    corners = np.concatenate([maze.goal[None], *(ring[:-1] for ring in maze.rings)])
    a, b = np.triu_indices(len(corners), 1)
    sees = shapely.covers(space, shapely.linestrings(np.stack([corners[a], corners[b]], axis=1)))
    gaps = np.full((len(corners), len(corners)), math.inf)
    gaps[a[sees], b[sees]] = np.hypot(*(corners[a] - corners[b]).T)[sees]
    gaps = np.minimum(gaps, gaps.T)
    lengths = np.full(len(corners), math.inf)
    lengths[0] = 0.0
    for _ in corners:  # Bellman and Ford's way, as Dijkstra's is the kernel's
        shorter = np.minimum(lengths, (gaps + lengths).min(axis=1))
        if (shorter == lengths).all():
            break
        lengths = shorter
    return maze, geodesic.GeodesicDistance(maze).ways, space, corners, lengths


def ways_are_the_shortest_round_all_corners(rng):
    """geodesic.distance_at and look_ahead: against all lines of sight, by shapely."""
    maze, ways, space, corners, lengths = ways_of(int(rng.integers(0, 6)))

    def twin(place):
        sight = shapely.covers(space, segments(np.array([place]), corners))
        return (np.hypot(*(corners - place).T) + lengths)[sight].min()

    low, high = np.reshape(maze.free_space.bounds, (2, 2))
    place = rng.uniform(low, high)
    if not shapely.contains_xy(maze.free_space, *place):
        return False
    tolerance, distance = 1e-6 * maze.size, geodesic.distance_at(ways, *place)
    assert abs(distance - twin(place)) < tolerance
    along, places = np.sort(rng.uniform(0.0, 1.3 * distance, 6)), np.empty((6, 2))
    assert geodesic.look_ahead(ways, *place, along, places) == distance
    for way, there in zip(along, places, strict=True):
        assert abs(twin(there) - max(distance - way, 0.0)) < tolerance
    return None


LAWS = (
    substeps_are_linear_and_straight_in_the_feeder,
    joints_and_links_are_placed_as_the_arms_kinematics_place_them,
    servo_forces_reach_the_target_and_their_torques_are_the_jacobians,
    limited_torques_keep_the_limit_and_coast_or_reach,
    ends_off_their_places_are_measured_and_nan_is_noticed,
    an_action_moves_no_joint_too_far_and_takes_nan_for_what_it_is,
    links_are_as_far_from_walls_as_shapely_says,
    readings_are_those_of_the_arm_in_maze_units,
    rays_end_at_the_first_wall_and_at_corners_do_not_slip_through,
    an_observation_is_scaled_and_cut_part_by_part,
    ways_are_the_shortest_round_all_corners,
)
