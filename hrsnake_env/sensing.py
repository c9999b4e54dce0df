"""What the arm senses: its own configuration, how near the walls are, and rays.

Numbers and arrays in, numbers and arrays out; as in `dynamics`, the base is the origin of the simulator's
frame and the x axis is the feeder's axis.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from hrsnake_env.arm import FloatArray

__all__ = ["N_READINGS", "N_TIP_RAYS", "TIP_RAYS", "Senses", "cast_rays", "link_distances", "read_arm"]

N_READINGS = 6
"""Length of the readings: feed, tip's x and y, tip heading, feed speed, smallest clearance."""

N_TIP_RAYS = 8
TIP_RAYS = np.radians(np.linspace(-105.0, 105.0, N_TIP_RAYS))
"""Directions of the tip's rays relative to the last link, in rad, from right to left."""


class Senses(NamedTuple):
    """Hold what an arm senses, in maze units, rad and s.

    Parameters
    ----------
    joint_angles, joint_speeds, clearances : array, shape (n_links,)
        Clearances as `Physics.clearance` has them.
    readings : array, shape (N_READINGS,)
        Feed, the tip's x, y and heading, feed speed, smallest clearance.
    """

    joint_angles: FloatArray
    joint_speeds: FloatArray
    clearances: FloatArray
    readings: FloatArray


@numba.njit(cache=True)
def _point_distance2(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Compute the squared distance from a point to a segment."""
    dx, dy = bx - ax, by - ay
    length2 = dx * dx + dy * dy
    t = 0.0 if length2 == 0.0 else ((px - ax) * dx + (py - ay) * dy) / length2
    t = min(max(t, 0.0), 1.0)
    qx, qy = px - ax - t * dx, py - ay - t * dy
    return qx * qx + qy * qy


@numba.njit(cache=True)
def _cross(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> float:
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


@numba.njit(cache=True)
def link_distances(
    joints: FloatArray, n_held: int, walls: FloatArray, reach: float, distances: FloatArray
) -> None:
    """Compute the distance from the centre line of each link, as far as it is in the maze, to the walls.

    Parameters
    ----------
    joints : array, shape (n_links + 1, 2)
        Base end first.
    n_held : int
        So many joints at the base end are held by the feeder: the links before the last of them are not in
        the maze, and the link behind it only in front of the base: walls behind the base are no matter
        to it.
    walls : array, shape (n_walls, 4)
        x, y of the start and of the end of each wall segment.
    reach : float
        Distances are not looked for beyond it.
    distances : array, shape (n_links,)
        Written: 0 where a link crosses a wall, at most `reach`.
    """
    for k in range(joints.shape[0] - 1):
        ax, ay, bx, by = joints[k, 0], joints[k, 1], joints[k + 1, 0], joints[k + 1, 1]
        best = reach * reach
        if k < n_held - 1 or (k == n_held - 1 and bx <= 0.0):
            distances[k] = reach
            continue
        in_gate = k == n_held - 1
        if in_gate and ax < 0.0:
            ax, ay = 0.0, ay - ax * (by - ay) / (bx - ax)
        margin = reach
        low_x, high_x, low_y, high_y = min(ax, bx), max(ax, bx), min(ay, by), max(ay, by)
        for w in range(walls.shape[0]):
            cx, cy, dx, dy = walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3]
            if (
                min(cx, dx) - high_x > margin
                or low_x - max(cx, dx) > margin
                or min(cy, dy) - high_y > margin
                or low_y - max(cy, dy) > margin
                or (in_gate and max(cx, dx) <= 0.0)
            ):
                continue
            if (
                _cross(ax, ay, bx, by, cx, cy) * _cross(ax, ay, bx, by, dx, dy) < 0.0
                and _cross(cx, cy, dx, dy, ax, ay) * _cross(cx, cy, dx, dy, bx, by) < 0.0
            ):
                best = 0.0
                break
            near = min(
                min(_point_distance2(ax, ay, cx, cy, dx, dy), _point_distance2(bx, by, cx, cy, dx, dy)),
                min(_point_distance2(cx, cy, ax, ay, bx, by), _point_distance2(dx, dy, ax, ay, bx, by)),
            )
            if near < best:
                best = near
                margin = math.sqrt(best)
        distances[k] = math.sqrt(best)


@numba.njit(cache=True)
def read_arm(
    state: FloatArray,
    joints: FloatArray,
    n_held: int,
    walls: FloatArray,
    link_length: float,
    link_radius: float,
    touched: FloatArray,
    frame: FloatArray,
    angles: FloatArray,
    speeds: FloatArray,
    clearances: FloatArray,
    readings: FloatArray,
) -> None:
    """Compute all readings of an arm, in maze units, rad and s.

    Parameters
    ----------
    state : array, shape (n_links, 6)
        Centre, heading, velocity and angular velocity of each link.
    joints : array, shape (n_links + 1, 2)
        Base end first.
    n_held, walls
        See `link_distances`.
    link_length, link_radius : float
        In simulator units.
    touched : array, shape (n_links,)
        Smallest clearance of each link's contacts, in simulator units; infinite without one.
    frame : array, shape (4,)
        x, y and heading of the base, in maze units and rad; simulator units per maze unit.
    angles, speeds, clearances, readings : array
        Written; see `Senses`.
    """
    n_links = state.shape[0]
    x, y, base_heading, scale = frame[0], frame[1], frame[2], frame[3]
    cos, sin = math.cos(base_heading), math.sin(base_heading)
    heading, turning = 0.0, 0.0
    for k in range(n_links):
        angles[k], speeds[k] = state[k, 2] - heading, state[k, 5] - turning
        heading, turning = state[k, 2], state[k, 5]
    link_distances(joints, n_held, walls, link_length, clearances)
    smallest = math.inf
    for k in range(n_links):
        free = clearances[k] - link_radius if clearances[k] < link_length else link_length
        clearances[k] = min(free, touched[k]) / scale
        smallest = min(smallest, clearances[k])
    tip_x, tip_y = joints[n_links, 0], joints[n_links, 1]
    readings[0] = (joints[0, 0] + n_links * link_length) / scale
    readings[1] = x + (tip_x * cos - tip_y * sin) / scale
    readings[2] = y + (tip_x * sin + tip_y * cos) / scale
    readings[3] = heading + base_heading
    readings[4] = state[0, 3] / scale
    readings[5] = smallest


@numba.njit(cache=True)
def _ray(x: float, y: float, heading: float, walls: FloatArray, reach: float) -> float:
    """Compute the distance from a point to the first wall in a direction, at most `reach`.

    On which side of the ray a corner is, is computed alike for both its walls: no ray slips through there.
    """
    dx, dy = math.cos(heading), math.sin(heading)
    nearest = reach
    for w in range(walls.shape[0]):
        ax, ay = walls[w, 0] - x, walls[w, 1] - y
        bx, by = walls[w, 2] - x, walls[w, 3] - y
        side_a, side_b = ax * dy - ay * dx, bx * dy - by * dx
        if side_a == side_b or (side_a > 0.0 and side_b > 0.0) or (side_a < 0.0 and side_b < 0.0):
            continue
        along_a, along_b = ax * dx + ay * dy, bx * dx + by * dy
        along = along_a + side_a / (side_a - side_b) * (along_b - along_a)
        if 0.0 <= along < nearest:
            nearest = along
    return nearest


@numba.njit(cache=True)
def cast_rays(
    state: FloatArray, joints: FloatArray, n_held: int, walls: FloatArray, reach: float, rays: FloatArray
) -> None:
    """Compute how far it is to the walls: from the tip, and to both sides of every joint.

    Parameters
    ----------
    state, joints, n_held, walls
        See `read_arm`.
    reach : float
        In simulator units; rays are no longer than this, and rays of joints in the feeder are as long.
    rays : array, shape (N_TIP_RAYS + 2 * n_links,)
        Written, in shares of `reach`: the tip's rays from right to left (`TIP_RAYS`), then the right and the
        left ray of each joint but the tip, base end first, perpendicular to the mean of its links' headings.
    """
    n_links = state.shape[0]
    for i in range(N_TIP_RAYS):
        heading = state[n_links - 1, 2] + TIP_RAYS[i]
        rays[i] = _ray(joints[n_links, 0], joints[n_links, 1], heading, walls, reach) / reach
    before = 0.0
    for k in range(n_links):
        heading = 0.5 * (before + state[k, 2])
        before = state[k, 2]
        for side in range(2):
            i = N_TIP_RAYS + 2 * k + side
            rays[i] = 1.0
            if k >= n_held:
                across = heading + (side - 0.5) * math.pi
                rays[i] = _ray(joints[k, 0], joints[k, 1], across, walls, reach) / reach
