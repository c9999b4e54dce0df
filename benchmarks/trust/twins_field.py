"""The kernels of arms that forces move, and of the arm that follows a curve, against slow twins."""

from __future__ import annotations

import itertools
import math
from functools import cache

import numpy as np
import shapely
from scipy.interpolate import RegularGridInterpolator

from benchmarks.trust.twin_draws import distances_to, segments, star, walls_of
from hrsnake_env.arm import ArmSpec, joints_from_configuration
from hrsnake_env.maze import Maze
from planners.baselines.field_runs import Gains, base_frame, new_run, new_task
from planners.kernels import backbone, field_algebra, field_arm, field_moves, field_steps
from planners.potential import laplace_potential
from planners.query import Query

RELEASE = field_arm.RELEASE
HALF_TURN = math.pi


def triangles_and_solutions_are_those_of_numpy(rng):
    """field_algebra.factorise, solve_lower and solve_upper."""
    n = int(rng.integers(1, 9))
    root = rng.normal(size=(n, n))
    matrix = root @ root.T + rng.choice([0.1, 5.0]) * np.eye(n)
    factor, x = rng.normal(size=(n + 1, n + 1)), rng.normal(size=n + 1)
    factor[:n, :n] = np.tril(matrix) + np.triu(factor[:n, :n], 1)  # the upper triangle is not looked at
    field_algebra.factorise(factor, n)
    np.testing.assert_allclose(np.tril(factor[:n, :n]), np.linalg.cholesky(matrix), atol=1e-9)
    lower, upper, kept = np.tril(factor[:n, :n]), x.copy(), x[n]
    y = x.copy()
    field_algebra.solve_lower(factor, n, y)
    np.testing.assert_allclose(lower @ y[:n], x[:n], atol=1e-9)
    field_algebra.solve_upper(factor, n, upper)
    np.testing.assert_allclose(lower.T @ upper[:n], x[:n], atol=1e-9)
    assert y[n] == upper[n] == kept


def a_redundant_velocity_is_its_formula(rng):
    """field_algebra.redundant_velocity: also where nothing moves the point in one direction, or in any."""
    n, damping = int(rng.integers(1, 8)), rng.uniform(0.01, 1.0)
    jacobian, task, wish = rng.normal(size=(2, n)), rng.normal(size=2), rng.normal(size=n)
    jacobian *= rng.choice([[[1.0], [1.0]], [[0.0], [1.0]], [[0.0], [0.0]]])
    velocity = np.empty(n)
    field_algebra.redundant_velocity(jacobian, n, task, wish, damping, velocity)
    inverse = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + damping**2 * np.eye(2))
    null = np.eye(n) - np.linalg.pinv(jacobian, rcond=1e-6) @ jacobian
    np.testing.assert_allclose(velocity, inverse @ task + null @ wish, atol=1e-6)


def a_state(rng, n=None, most_bent=HALF_TURN):
    """Draw a state within its limits: feeds of 0, whole ones, and just short of all."""
    n = int(rng.integers(2, 8)) if n is None else n
    feed = rng.choice([0.0, rng.uniform(0.0, n - 0.01), rng.integers(0, n), n - 0.01])
    limits = np.minimum(RELEASE * np.maximum(feed - np.arange(n), 0.0), most_bent)
    state = np.clip(rng.normal(scale=1.0, size=n), -limits, limits)
    state[0] = feed
    return state


def placed(state, heading, per_link):
    """Return the kernels' points, joints past the base, and places and links of control points."""
    points, places = np.zeros((len(state), 2)), np.zeros((len(state) * per_link, 2))
    links = np.zeros(len(places), dtype=np.int64)
    k = field_arm.place_points(state, heading, points)
    n = field_arm.place_controls(state, points, k, heading, per_link, places, links)
    return points, k, places[:n], links[:n]


def jacobian_at(place, link, points, k, heading):
    """Return how each coordinate moves a place on a link, shape (2, k + 1), from first principles."""
    columns = [(math.cos(heading), math.sin(heading))]
    for a in range(1, k + 1):
        x, y = place - points[a]
        columns.append((-y, x) if a >= link else (0.0, 0.0))
    return np.array(columns).T


def places_on_the_arm_are_those_of_the_environment(rng):
    """field_arm.place_points and place_controls."""
    state, heading, per_link = a_state(rng), rng.uniform(-4, 4), int(rng.integers(1, 6))
    feed = state[0]
    points, k, places, links = placed(state, heading, per_link)
    joints = joints_from_configuration(feed, np.append(0.0, state[:0:-1]), 1.0, (0.0, 0.0, heading))[::-1]
    assert k == max(math.ceil(feed) - 1, 0)
    np.testing.assert_allclose(points[: k + 1], joints[: k + 1], atol=1e-12)
    backs = np.arange(len(places)) / per_link
    assert len(places) == max(1, math.ceil(feed * per_link - 1e-12))
    low = np.floor(backs + 1e-12).astype(int)
    for place, link, back, at in zip(places, links, backs, low, strict=True):
        assert link == at + 1
        if at + 1 < len(joints):
            on = joints[at] + (back - at) * (joints[at + 1] - joints[at])
            np.testing.assert_allclose(place, on, atol=1e-9)


def limits_are_kept_by_clipping(rng):
    """field_arm.keep_limits."""
    state, most_bent = rng.normal(scale=2.0, size=int(rng.integers(1, 8))), rng.uniform(0.0, 3.0)
    state[0] = rng.choice([0.0, 1.0, rng.uniform(0.0, len(state))])
    limits = np.minimum(RELEASE * np.maximum(state[0] - np.arange(len(state)), 0.0), most_bent)
    expected = np.append(state[0], np.clip(state, -limits, limits)[1:])
    field_arm.keep_limits(state, most_bent)
    np.testing.assert_allclose(state, expected, atol=0.0)


def torques_and_drag_are_the_jacobians(rng):
    """field_arm.add_torques, fill_drag and contact_row."""
    state, heading, per_link = a_state(rng), rng.uniform(-4, 4), int(rng.integers(1, 6))
    points, k, places, links = placed(state, heading, per_link)
    n, forces = len(places), rng.normal(size=places.shape)
    torques = rng.normal(size=k + 1)
    expected = torques.copy()
    drag, ridge = np.full((k + 1, k + 1), np.nan), rng.uniform(0.0, 1.0)
    whole = ridge * np.eye(k + 1)
    for place, link, force in zip(places, links, forces, strict=True):
        jacobian = jacobian_at(place, link, points, k, heading)
        expected += jacobian.T @ force
        whole += jacobian.T @ jacobian
    field_arm.add_torques(points, k, heading, places, links, forces, n, torques)
    np.testing.assert_allclose(torques, expected, atol=1e-9)
    field_arm.fill_drag(points, k, heading, places, links, n, ridge, drag)
    np.testing.assert_allclose(drag, whole, atol=1e-9)
    normal, link, row = rng.normal(size=2), int(rng.integers(1, k + 2)), np.empty(k + 1)
    contact = np.array([*places[0], *normal, 0.1, link])
    field_arm.contact_row(contact, points, k, heading, row)
    np.testing.assert_allclose(row, normal @ jacobian_at(places[0], link, points, k, heading), atol=1e-9)


def contacts_are_the_nearest_places_however_few_fit(rng):
    """field_arm.find_contacts: `least` against shapely, with room for all contacts and for hardly any."""
    state, heading, reach = a_state(rng), rng.uniform(-4, 4), rng.uniform(0.1, 0.8)
    points, k, *_ = placed(state, heading, 1)
    centre = rng.uniform(-2, 2, 2)
    ring = star(rng, centre=centre, low=0.1, high=2.0)
    walls = walls_of(ring)
    contacts = np.full((int(rng.choice([0, 1, 3, 400])), 6), np.nan)
    n, least = field_arm.find_contacts(points, k, walls, reach, contacts)
    assert n <= len(contacts) and not np.isnan(contacts[:n]).any() and np.isnan(contacts[n:]).all()
    links = segments(points[1 : k + 1], points[:k])
    gaps = distances_to(walls, links)
    axis_joint = distances_to(walls, shapely.points(points[k][None]))[0]
    # The joint on the axis is not turned by any: what is beside it alone is no contact.
    if k and abs(axis_joint - gaps.min()) > 1e-9:
        assert abs(least - min(gaps.min(), reach)) < 1e-9
    elif not k:
        assert n == 0 and least == reach
    for x, y, nx, ny, gap, link in contacts[:n]:
        assert gap < reach and (gap < 1e-9 or abs(math.hypot(nx, ny) - 1.0) < 1e-9)
        on, wall = np.array([x, y]), np.array([x - gap * nx, y - gap * ny])
        assert shapely.distance(links[int(link) - 1], shapely.Point(on)) < 1e-9
        assert distances_to(walls, shapely.points(wall[None]))[0] < 1e-9


@cache
def corridor():
    """Return a maze, a query, its potential, and the field's directions, made once."""
    maze = Maze.from_corridors([(0, 0), (0, 600), (300, 600), (300, 300)], 200.0)
    query = Query(maze=maze, arm=ArmSpec(link_length=150.0))
    potential = laplace_potential(query.geometry.maze, width=query.geometry.path.width)
    field = np.zeros((*potential.u.shape, 2))
    field_moves.fill_field(potential.u, potential.blocked_x, potential.blocked_y, field)
    return query, potential, field


def directions_are_unit_vectors_or_none_and_rise(rng):
    """field_moves.fill_field: on random potentials without walls, against plain differences."""
    u = rng.random((int(rng.integers(1, 7)), int(rng.integers(1, 7))))
    if rng.random() < 0.3:
        u[:] = 0.5
    blocked = np.zeros(u.shape, dtype=np.bool_)
    field = np.zeros((*u.shape, 2))
    field_moves.fill_field(u, blocked, blocked, field)
    sizes = np.hypot(field[..., 0], field[..., 1])
    assert (np.isclose(sizes, 1.0) | (sizes == 0.0)).all()
    for j in range(1, u.shape[0] - 1):
        for i in range(1, u.shape[1] - 1):
            # A component that is not 0 leads to a neighbour that is higher.
            for d, (di, dj) in enumerate(((1, 0), (0, 1))):
                way = int(np.sign(field[j, i, d]))
                neighbour = u[j + way * dj, i + way * di]
                assert way == 0 or neighbour > min(u[j, i], u[j - way * dj, i - way * di])


def a_field_between_nodes_is_scipys(rng):
    """field_moves.field_at: inside, on nodes, and outside."""
    shape = rng.integers(2, 6, 2)
    field = rng.normal(size=(*shape, 2))
    twin = RegularGridInterpolator((np.arange(shape[0]), np.arange(shape[1])), field)
    for _ in range(20):
        x, y = rng.uniform(-1.0, shape[::-1] + 0.5)
        x, y = (np.round(x), y) if rng.random() < 0.3 else (x, y)
        expected = (0.0, 0.0)
        if 0 <= x < shape[1] - 1 and 0 <= y < shape[0] - 1:
            expected = twin([[y, x]])[0]
        np.testing.assert_allclose(field_moves.field_at(field, x, y), expected, atol=1e-9)


def a_run(rng, n_links=5, per_link=4):
    """Return a task and a run in the corridor, with an arm that is somewhere free; None if it is not."""
    query, *_ = corridor()
    gains = Gains(barrier=rng.choice([0.01, 0.3]), reach=rng.uniform(0.1, 0.6), lead=rng.choice([0.0, 5.0]))
    task, run = new_task(query, query.geometry, gains, per_link), new_run(n_links, per_link)
    state = a_state(rng, n_links + 1)
    run.state[:] = np.append(state[0], 0.3 * state[1:])
    k, _, _, least = field_steps.place(task, run)
    line = segments(run.points[1 : k + 1], run.points[:k])
    if k and (distances_to(task.walls, line).min() <= field_steps.MARGIN or least <= field_steps.MARGIN):
        return None
    whole = shapely.LineString([*run.points[k::-1], run.points[0]])
    return (task, run) if whole.is_simple else None


def a_steps_matrix_and_torques_are_those_of_numpy(rng):
    """field_steps.place and assemble: J^T J, friction and the walls' slopes; held joints stay."""
    drawn = a_run(rng)
    if drawn is None:
        return False
    task, run = drawn
    if rng.random() < 0.5:  # press joints against the joint limit
        task = task._replace(most_bent=float(np.abs(run.state[1:]).max()))
    k, n, n_contacts, _ = field_steps.place(task, run)
    run.forces[:] = rng.normal(size=run.forces.shape)
    forces = run.forces[:n].copy()
    forces[0] *= 1.0 + task.lead
    matrix, pulled = field_steps.RIDGE * task.per_link * np.eye(k + 1), np.zeros(k + 1)
    for c in range(n):
        jacobian = jacobian_at(run.places[c], run.links[c], run.points, k, task.heading)
        matrix += jacobian.T @ jacobian
        pulled += jacobian.T @ forces[c]
    pushed = np.zeros(k + 1)
    for contact in run.contacts[:n_contacts]:
        row = contact[2:4] @ jacobian_at(contact[:2], contact[5], run.points, k, task.heading)
        gap = max(contact[4] - field_steps.MARGIN, 0.01 * field_steps.MARGIN)
        pushed += task.barrier * task.per_link * (1.0 / gap - 1.0 / task.reach) * row
        matrix += field_steps.STEP * task.barrier * task.per_link / gap**2 * np.outer(row, row)
    limits = np.minimum(RELEASE * (run.state[0] - np.arange(k + 1)), task.most_bent)
    held = (np.abs(run.state[: k + 1]) >= limits - 1e-9) & ((pulled + pushed) * run.state[: k + 1] >= 0.0)
    held[0] = False
    for vector in (pulled, pushed):
        vector[held] = 0.0
    matrix[held], matrix[:, held] = 0.0, 0.0
    matrix[held, held] = 1.0
    field_steps.assemble(task, run, k, n, n_contacts)
    np.testing.assert_allclose(run.vectors[0, : k + 1], pulled, atol=1e-8)
    np.testing.assert_allclose(run.vectors[4, : k + 1], pushed, rtol=1e-8, atol=1e-8)
    np.testing.assert_array_equal(run.vectors[1, : k + 1], (~held).astype(float))
    lower = np.tril(run.matrix[: k + 1, : k + 1])
    np.testing.assert_allclose(lower @ lower.T, matrix, rtol=1e-7, atol=1e-7 * np.abs(matrix).max())
    return None


def check_step(task, before, after):
    """Raise unless an arm's step is small, off the walls, within its limits, and does not cross itself."""
    chains = [placed(state, task.heading, 1)[:2] for state in (before, after)]
    (old, k_old), (new, k_new) = chains
    n = min(k_old, k_new) + 1
    assert np.hypot(*(new[:n] - old[:n]).T).max() <= field_steps.LONGEST + 1e-12
    assert abs(after[0] - before[0]) <= field_steps.LONGEST + 1e-12
    limits = np.minimum(RELEASE * np.maximum(after[0] - np.arange(len(after)), 0.0), task.most_bent)
    assert (np.abs(after[1:]) <= limits[1:] + 1e-12).all()
    # A joint passes the base at a pose.
    low, high = sorted((before[0], after[0]))
    assert math.ceil(high) - math.floor(low) <= 1
    links = segments(new[1 : k_new + 1], new[:k_new])
    if k_new:
        gaps = distances_to(task.walls, links)
        beside_axis = distances_to(task.walls, shapely.points(new[k_new][None]))[0]
        assert gaps.min() >= field_steps.MARGIN - 1e-9 or gaps.min() > beside_axis - 1e-9
    assert all(shapely.distance(links[i], links[j]) > 0.0 for i in range(k_new) for j in range(i + 2, k_new))


def a_step_is_small_free_and_within_limits(rng):
    """field_steps.advance: with any velocity, and none."""
    drawn = a_run(rng)
    if drawn is None:
        return False
    task, run = drawn
    k, _, n_contacts, _ = field_steps.place(task, run)
    velocity = np.full(len(run.state), np.nan)
    velocity[: k + 1] = rng.normal(size=k + 1) * rng.choice([0.0, 0.01, 1.0, 100.0])
    before = run.state.copy()
    if before[0] + field_steps.LONGEST >= len(before) - 1 or before[0] < 1.0:
        return False
    moved = field_steps.advance(task, run, k, n_contacts, velocity, rng.choice([0.001, 1.0]))
    assert moved == (not np.array_equal(before, run.state)) or not moved
    if moved:
        check_step(task, before, run.state)
    else:
        np.testing.assert_allclose(run.state, before, atol=1e-12)
    return None


def arms_that_forces_move_go_step_by_step(rng):
    """field_steps.push_straight, field_moves.descend and lead_tip: all states of 40 steps are a motion's."""
    query, potential, field = corridor()
    gains = Gains(barrier=rng.choice([0.01, 0.1]), reach=rng.uniform(0.15, 0.5), lead=5.0)
    task, run, states = new_task(query, query.geometry, gains, 4), new_run(8, 4), np.empty((64, 9))
    n, ending = field_steps.push_straight(task, run, states)
    expected = np.arange(n) / math.ceil(1.0 / field_steps.STEP)
    np.testing.assert_allclose(states[:n, 0], expected, atol=1e-12)
    assert ending == field_steps.GOING and states[n - 1, 0] == 1.0 and not states[:n, 1:].any()
    last = states[n - 1].copy()
    if rng.random() < 0.5:
        origin, cell = base_frame(potential.origin, query), potential.cell / 150.0
        n, ending = field_moves.descend(task, run, potential.u, field, origin, cell, states[:40])
    else:
        points = base_frame(query.geometry.path.points, query)
        spacing = np.hypot(*(points[1] - points[0]))
        ahead = int(rng.integers(1, 20))
        n, ending = field_moves.lead_tip(task, run, points, spacing, ahead, ahead, 0.1, states[:40])
    assert (n == 40) == (ending == field_steps.GOING)
    for before, after in zip([last, *states[: n - 1]], states[:n], strict=False):
        check_step(task, before, after)


def a_chain_led_along_a_curve_moves_in_small_steps(rng):
    """backbone.lead_along: steps, ticks and angles of all poses, and what its ending says."""
    n, bend = 800, rng.uniform(-1.5, 1.5)
    arc = 0.01 * np.arange(n)
    along = bend * np.clip((arc - rng.uniform(0.5, 3.0)) / rng.uniform(0.3, 2.0), 0.0, 1.0)
    steps = 0.01 * np.column_stack([np.cos(along), np.sin(along)])
    curve = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)[:-1]])
    normals = np.column_stack([-np.sin(along), np.cos(along)])
    n_links, room, step = int(rng.integers(2, 12)), int(rng.choice([40, 2000])), rng.choice([0.02, 0.1])
    feeds, headings = np.zeros(room, dtype=np.int64), np.zeros((room, n_links))
    joints, nearest = np.zeros((n_links + 1, 2)), np.zeros((n_links, backbone.SAMPLES), dtype=np.int64)
    goal, stop, release = curve[int(rng.integers(200, n))], rng.uniform(0.01, 0.1), 16.0
    pause = int(rng.integers(2, 3000))
    n_poses, ending = backbone.lead_along(
        curve, normals, 0.0, goal, stop, release, step, 1, pause, feeds, headings, joints, nearest
    )
    out = feeds[:n_poses] / backbone.TICKS
    assert 1 <= n_poses <= room and out[0] == 0.0 and (np.diff(out) >= 0.0).all()
    joints_of = []
    for feed, row in zip(out, headings[:n_poses], strict=True):
        past = math.floor(feed)
        assert not past or abs(row[past - 1]) <= min(release * (feed - past), math.pi) + 1e-12
        ahead = np.array([feed - past, 0.0])
        turned = np.column_stack([np.cos(row[:past]), np.sin(row[:past])])[::-1]
        joints_of.append(np.concatenate([[ahead], ahead + np.cumsum(turned, axis=0)])[::-1])
    np.testing.assert_allclose(joints[: len(joints_of[-1])], joints_of[-1], atol=1e-9)
    for one, other in itertools.pairwise(joints_of):
        both = min(len(one), len(other))
        assert np.hypot(*(one[:both] - other[:both]).T).max() <= step + 1e-9
    away = math.dist(joints_of[-1][0], goal)
    assert (ending == backbone.DONE) == (away <= stop)
    assert ending != backbone.PAUSED or n_poses >= pause
    assert ending != backbone.FULL or n_poses == room


LAWS = (
    triangles_and_solutions_are_those_of_numpy,
    a_redundant_velocity_is_its_formula,
    places_on_the_arm_are_those_of_the_environment,
    limits_are_kept_by_clipping,
    torques_and_drag_are_the_jacobians,
    contacts_are_the_nearest_places_however_few_fit,
    directions_are_unit_vectors_or_none_and_rise,
    a_field_between_nodes_is_scipys,
    a_steps_matrix_and_torques_are_those_of_numpy,
    a_step_is_small_free_and_within_limits,
    arms_that_forces_move_go_step_by_step,
    a_chain_led_along_a_curve_moves_in_small_steps,
)
