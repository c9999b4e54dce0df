"""The simulator's arithmetic: where links belong, the forces that take them there, how far off they are.

Numbers and arrays in, numbers and arrays out; the x axis is the feeder's axis and the base is its origin.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from hrsnake_env.arm import FEEDER_RELEASE, FloatArray

__all__ = [
    "divide",
    "drive",
    "largest_distance",
    "largest_move",
    "limited_forces",
    "place_joints",
    "place_links",
    "read_links",
    "servo_forces",
    "step_targets",
]


PATIENCE = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0)
"""In how many substeps an arm with limited torques tries to reach its target."""


@numba.njit(cache=True)
def step_targets(start: FloatArray, end: FloatArray, link_length: float, targets: FloatArray) -> None:
    """Divide a change of the configuration into substeps, linear in feed and joint angles.

    Parameters
    ----------
    start, end : array, shape (1 + n_links,)
        Feed and joint angles, in simulator units and rad.
    targets : array, shape (substeps, 1 + n_links)
        Written; the last is `end`. Joints that the feeder holds are straight, as in
        `hrsnake_env.arm.feeder_angle_limits`.

    Notes
    -----
    The caller guarantees finite numbers.
    """
    n_links, substeps = end.shape[0] - 1, targets.shape[0]
    for i in range(substeps):
        share = (i + 1) / substeps
        feed = end[0] if i == substeps - 1 else start[0] + share * (end[0] - start[0])
        targets[i, 0] = feed
        for k in range(n_links):
            angle = end[1 + k] if i == substeps - 1 else start[1 + k] + share * (end[1 + k] - start[1 + k])
            limit = FEEDER_RELEASE * (feed / link_length - (n_links - k))
            limit = min(max(limit, 0.0), math.pi)
            targets[i, 1 + k] = min(max(angle, -limit), limit)


@numba.njit(cache=True)
def place_links(target: FloatArray, link_length: float, poses: FloatArray, nodes: FloatArray) -> None:
    """Compute where the links and the joints of a configuration lie (forward kinematics).

    Parameters
    ----------
    target : array, shape (1 + n_links,)
        Feed and joint angles.
    poses : array, shape (n_links, 3)
        Written: centre and heading of each link.
    nodes : array, shape (n_links + 1, 2)
        Written: joint positions, base end first.

    Notes
    -----
    The caller guarantees finite numbers.
    """
    n_links = target.shape[0] - 1
    x, y, heading = target[0] - n_links * link_length, 0.0, 0.0
    nodes[0, 0], nodes[0, 1] = x, y
    for k in range(n_links):
        heading += target[1 + k]
        step_x, step_y = link_length * math.cos(heading), link_length * math.sin(heading)
        poses[k, 0], poses[k, 1], poses[k, 2] = x + 0.5 * step_x, y + 0.5 * step_y, heading
        x, y = x + step_x, y + step_y
        nodes[k + 1, 0], nodes[k + 1, 1] = x, y


@numba.njit(cache=True)
def place_joints(target: FloatArray, link_length: float, joints: FloatArray) -> None:
    """Compute where the joints of a configuration lie, up to a constant shift along the feeder.

    Parameters
    ----------
    target : array, shape (1 + n_links,)
        Feed and joint angles.
    joints : array, shape (n_links + 1, 2)
        Written: base end first.
    """
    x, y, heading = target[0], 0.0, 0.0
    joints[0, 0], joints[0, 1] = x, y
    for k in range(1, target.shape[0]):
        heading += target[k]
        x += link_length * math.cos(heading)
        y += link_length * math.sin(heading)
        joints[k, 0], joints[k, 1] = x, y


@numba.njit(cache=True)
def largest_distance(a: FloatArray, b: FloatArray) -> float:
    """Return the largest distance between points of the same number, arrays of shape (n, 2)."""
    largest2 = 0.0
    for k in range(a.shape[0]):
        dx, dy = b[k, 0] - a[k, 0], b[k, 1] - a[k, 1]
        largest2 = max(largest2, dx * dx + dy * dy)
    return math.sqrt(largest2)


@numba.njit(cache=True)
def largest_move(start: FloatArray, targets: FloatArray, link_length: float) -> float:
    """Compute the largest movement of any joint from one configuration to the next.

    Parameters
    ----------
    start : array, shape (1 + n_links,)
        Feed and joint angles.
    targets : array, shape (n, 1 + n_links)
        What follows on it.

    Returns
    -------
    move : float
    """
    n_joints = start.shape[0]
    before, now = np.empty((n_joints, 2)), np.empty((n_joints, 2))
    place_joints(start, link_length, before)
    largest = 0.0
    for i in range(targets.shape[0]):
        place_joints(targets[i], link_length, now)
        largest = max(largest, largest_distance(before, now))
        before, now = now, before
    return largest


@numba.njit(cache=True)
def servo_forces(
    state: FloatArray,
    poses: FloatArray,
    link_length: float,
    timestep: float,
    n_held: int,
    forces: FloatArray,
    torques: FloatArray,
) -> float:
    """Compute the forces that take every link to its target in the next substep, and the joint torques.

    The simulator moves bodies before it changes their velocities, so a force acts on the position after
    the next one: the target is aimed at from the predicted position.

    Parameters
    ----------
    state : array, shape (n_links, 6)
        Centre, heading, velocity and angular velocity of each link.
    poses : array, shape (n_links, 3)
        Target centre and heading.
    n_held : int
        So many joints at the base end are held by the feeder: it takes their torque.
    forces : array, shape (n_links or more, 3)
        Written: force and torque on each link of mass 1.
    torques : array, shape (n_links,)
        Written: joint torques.

    Returns
    -------
    feed_force : float
        Along the feeder's axis.

    Notes
    -----
    There are as many actuators as degrees of freedom, so forces F on the links equal joint torques
    tau = J^T F and a feed force.
    """
    n_links = poses.shape[0]
    inertia = link_length * link_length / 12.0
    sum_x, sum_y, moment = 0.0, 0.0, 0.0
    for k in range(n_links - 1, -1, -1):
        x, y = state[k, 0] + state[k, 3] * timestep, state[k, 1] + state[k, 4] * timestep
        heading = state[k, 2] + state[k, 5] * timestep
        force_x = ((poses[k, 0] - x) / timestep - state[k, 3]) / timestep
        force_y = ((poses[k, 1] - y) / timestep - state[k, 4]) / timestep
        couple = inertia * ((poses[k, 2] - heading) / timestep - state[k, 5]) / timestep
        forces[k, 0], forces[k, 1], forces[k, 2] = force_x, force_y, couple
        sum_x, sum_y = sum_x + force_x, sum_y + force_y
        moment += couple + x * force_y - y * force_x
        joint_x = x - 0.5 * link_length * math.cos(heading)
        joint_y = y - 0.5 * link_length * math.sin(heading)
        torques[k] = 0.0 if k < n_held else moment - (joint_x * sum_y - joint_y * sum_x)
    return sum_x


@numba.njit(cache=True)
def limited_forces(
    state: FloatArray,
    last_target: FloatArray,
    target: FloatArray,
    link_length: float,
    timestep: float,
    torque_limit: float,
    n_held: int,
    forces: FloatArray,
    torques: FloatArray,
) -> float:
    """Compute the forces as `servo_forces`, towards what joints with limited torque can do.

    Parameters
    ----------
    last_target, target : array, shape (1 + n_links,)
        Feed and joint angles to be at now, and after the next substep.
    torque_limit : float
        No joint torque is larger.
    state, link_length, timestep, n_held, forces, torques
        See `servo_forces`.

    Returns
    -------
    feed_force : float
        The feed is as strong as it must be.

    Notes
    -----
    Known is where the links go if they coast, and what torques that takes. To turn faster by a, the free
    links take M a in addition, M being their mass matrix with respect to their headings. If the target cannot
    be reached in one substep, all links together take more of them, as a critically damped oscillator does:
    a = e / T^2 + 2 e' / T, with the smallest T that keeps to the limit. What is still too much is cut.
    """
    n_links = target.shape[0] - 1
    n_free = n_links - n_held
    poses, nodes = np.empty((n_links, 3)), np.empty((n_links + 1, 2))
    aim = target.copy()
    mass = _mass_matrix(state, link_length, timestep, n_held)
    error, error_rate = np.zeros(n_free), np.zeros(n_free)
    wanted, before, coasting_before = 0.0, 0.0, 0.0
    for k in range(n_links):
        wanted, before = wanted + target[1 + k], before + last_target[1 + k]
        if k < n_held:
            coasting_before = wanted
            continue
        coasting = state[k, 2] + 2.0 * timestep * state[k, 5]
        aim[1 + k], coasting_before = coasting - coasting_before, coasting
        error[k - n_held] = before - (state[k, 2] + timestep * state[k, 5])
        error_rate[k - n_held] = (wanted - before) / timestep - state[k, 5]
    place_links(aim, link_length, poses, nodes)
    servo_forces(state, poses, link_length, timestep, n_held, forces, torques)
    coasting_torques = torques[n_held:].copy()
    for patience in PATIENCE:
        horizon = patience * timestep
        damping = 1.0 if patience == 1.0 else 2.0  # in one substep, what is over is over
        turning = mass @ (error / horizon**2 + damping * error_rate / horizon)
        torques[n_held:] = coasting_torques + np.cumsum(turning[::-1])[::-1]
        if np.abs(torques).max() <= torque_limit:
            break
    np.clip(torques, -torque_limit, torque_limit, torques)
    kept = torques.copy()
    # A joint's torque turns its own link, and the one before it back.
    change = kept[n_held:] - coasting_torques
    change[:-1] -= change[1:].copy()
    turns = np.linalg.solve(mass, change) * timestep**2
    aim[1 + n_held :] += turns
    aim[2 + n_held :] -= turns[:-1]
    place_links(aim, link_length, poses, nodes)
    feed_force = servo_forces(state, poses, link_length, timestep, n_held, forces, torques)
    torques[:] = kept
    return feed_force


@numba.njit(cache=True)
def _mass_matrix(state: FloatArray, link_length: float, timestep: float, n_held: int) -> FloatArray:
    """Compute the mass matrix of the links that the feeder does not hold, with respect to their headings."""
    n_free = state.shape[0] - n_held
    mass = np.zeros((n_free, n_free))
    for i in range(n_free):
        for k in range(n_free):
            turn = state[n_held + i, 2] - state[n_held + k, 2]
            turn += (state[n_held + i, 5] - state[n_held + k, 5]) * timestep
            beyond = n_free - 1 - max(i, k)
            share = beyond + 1.0 / 3.0 if i == k else (beyond + 0.5) * math.cos(turn)
            mass[i, k] = link_length * link_length * share
    return mass


@numba.njit(cache=True)
def deviation(
    state: FloatArray, nodes: FloatArray, link_length: float, joints: FloatArray
) -> tuple[float, float]:
    """Compute how far the links' ends are from where they belong, and from each other.

    Parameters
    ----------
    state : array, shape (n_links, 6)
        Centre, heading, velocity and angular velocity of each link.
    nodes : array, shape (n_links + 1, 2)
        Where the joints belong.
    joints : array, shape (n_links + 1, 2)
        Written: where they are; of two joined ends, their middle.

    Returns
    -------
    node_error, drift : float
        Largest distance of a link's end from its place, and largest gap between joined ends; NaN if a
        number is not finite.
    """
    n_links = state.shape[0]
    node_error, drift, total = 0.0, 0.0, 0.0
    last_x, last_y = 0.0, 0.0
    for k in range(n_links):
        half_x = 0.5 * link_length * math.cos(state[k, 2])
        half_y = 0.5 * link_length * math.sin(state[k, 2])
        rear_x, rear_y = state[k, 0] - half_x, state[k, 1] - half_y
        front_x, front_y = state[k, 0] + half_x, state[k, 1] + half_y
        if k == 0:
            last_x, last_y = rear_x, rear_y
        rear_error = math.hypot(rear_x - nodes[k, 0], rear_y - nodes[k, 1])
        front_error = math.hypot(front_x - nodes[k + 1, 0], front_y - nodes[k + 1, 1])
        node_error = max(node_error, rear_error, front_error)
        drift = max(drift, math.hypot(rear_x - last_x, rear_y - last_y))
        total += rear_error + front_error + state[k, 3] + state[k, 4] + state[k, 5]
        joints[k, 0], joints[k, 1] = 0.5 * (rear_x + last_x), 0.5 * (rear_y + last_y)
        last_x, last_y = front_x, front_y
    joints[n_links, 0], joints[n_links, 1] = last_x, last_y
    if not math.isfinite(total):
        return math.nan, math.nan
    return node_error, drift


@numba.njit(cache=True)
def divide(
    start: FloatArray, end: FloatArray, link_length: float, largest: float, targets: FloatArray
) -> int:
    """Divide a change of the configuration into the rows of `targets`, as `step_targets` does.

    Returns
    -------
    parts : int
        Each of them must be divided into so many parts again, lest a joint moves farther than `largest`.
    """
    step_targets(start, end, link_length, targets)
    return math.ceil(largest_move(start, targets, link_length) / largest)


@numba.njit(cache=True)
def drive(
    target: FloatArray,
    last_target: FloatArray,
    state: FloatArray,
    link_length: float,
    timestep: float,
    torque_limit: float,
    n_held: int,
    poses: FloatArray,
    nodes: FloatArray,
    forces: FloatArray,
    torques: FloatArray,
    effort: FloatArray,
) -> None:
    """Compute where the links belong after a substep (`place_links`), and the forces that take them there.

    Parameters
    ----------
    effort : array, shape (1 + n_links,)
        Feed force and joint torques are added to it.
    target, last_target, state, link_length, timestep, n_held, poses, nodes, forces, torques
        See `place_links`, `servo_forces` and `limited_forces`.
    torque_limit : float
        Infinite for none.
    """
    place_links(target, link_length, poses, nodes)
    feed_force = servo_forces(state, poses, link_length, timestep, n_held, forces, torques)
    if np.abs(torques).max() > torque_limit:
        feed_force = limited_forces(
            state, last_target, target, link_length, timestep, torque_limit, n_held, forces, torques
        )
    effort[0] += feed_force
    for k in range(torques.shape[0]):
        effort[1 + k] += torques[k]


@numba.njit(cache=True)
def read_links(
    numbers: FloatArray,
    nodes: FloatArray,
    link_length: float,
    state: FloatArray,
    joints: FloatArray,
    tracking: FloatArray,
) -> None:
    """Take over the simulator's numbers, and compare the links with where they belong.

    Parameters
    ----------
    numbers : array, shape (6 * n_links or more,)
        Centre, heading, velocity and angular velocity of each link; more numbers are not looked at.
    nodes : array, shape (n_links + 1, 2)
        Where the joints belong.
    state, joints : array, shape (n_links, 6) and (n_links + 1, 2)
        Written: the numbers, and the joint positions as `deviation` has them.
    tracking : array, shape (4,)
        Raised to what is seen: node error and drift of this pose, then those since the reset; infinite if a
        number is not finite.
    """
    n_links = state.shape[0]
    for k in range(n_links):
        for i in range(6):
            state[k, i] = numbers[6 * k + i]
    error, drift = deviation(state, nodes, link_length, joints)
    if math.isnan(error):
        error = drift = math.inf
    for i in (0, 2):
        tracking[i] = max(tracking[i], error)
        tracking[i + 1] = max(tracking[i + 1], drift)
