"""Kernels for planners that sample configurations of an arm out of a straight feeder; all in link lengths.

A state holds the feed and the angles of joints 1 to n_links - 1, in rad; joint 0 never leaves the feeder. A
joint that has not passed the base is straight whatever the state says, and one that has may bend as far as
`release` times the way past the base: so every state means a pose that the feeder allows, the pose changes
continuously with the state, and no sample is lost to the feeder.

Along an edge between two states the arm runs through poses that keep the checker's step limit, and between
these feed and joint angles change linearly, as in any motion. It is this that is checked: a piece is free if
in its middle everything is farther away than anything moves within it (Schwarzer, Saha and Latombe, "Adaptive
dynamic collision checking for single and multiple articulated robots in complex environments", IEEE
Transactions on Robotics 21(3), 2005), and halved if not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray

PARTS = 8
"""An edge has at least so many pieces."""

MOST_HALVINGS = 12
"""A piece of an edge is halved at most this often for its poses, and one between poses for the check."""

SHORTEST = 1e-5
"""Poses of an edge are not tried closer than that, as a share of it."""

STEP = 0.045
"""How far a joint may move between poses: nine tenths of what the checker allows."""

WHOLE = 1e-12
"""How near to a whole number a feed is taken for it."""


class FedScene(NamedTuple):
    """What an arm out of a feeder is among.

    Attributes
    ----------
    base_pose : array, shape (3,)
        (x, y, heading).
    walls : array, shape (n_walls, 2, 2)
        Segments.
    release : float
        How far a joint may bend, in rad per link length that it is past the base.
    margin : float
        How far links keep off walls.
    apart : float
        How far links that are no neighbours keep off each other, besides twice the margin: two link radii.
    """

    base_pose: FloatArray
    walls: FloatArray
    release: float
    margin: float
    apart: float


@njit(cache=True)
def place_arm(state: FloatArray, scene: FedScene, points: FloatArray) -> int:
    """Compute where the part of the arm in front of the base is.

    Parameters
    ----------
    state : array, shape (n_links,)
        Feed, then joint angles.
    scene : FedScene
        The feeder.
    points : array, shape (n_links + 1, 2)
        Filled with the base and the joints past it, tip last.

    Returns
    -------
    n : int
        Number of points filled.

    Notes
    -----
    The caller guarantees a feed between 0 and n_links.
    """
    n_links, heading = state.shape[0], scene.base_pose[2]
    points[0, 0], points[0, 1] = scene.base_pose[0], scene.base_pose[1]
    first = n_links - int(np.ceil(state[0])) + 1  # of the joints past the base
    if first > n_links:
        return 1
    way = state[0] - (n_links - first)
    points[1, 0] = points[0, 0] + way * np.cos(heading)
    points[1, 1] = points[0, 1] + way * np.sin(heading)
    n = 2
    for joint in range(first, n_links):
        limit = scene.release * (state[0] - (n_links - joint))
        heading += min(max(state[joint], -limit), limit)
        points[n, 0] = points[n - 1, 0] + np.cos(heading)
        points[n, 1] = points[n - 1, 1] + np.sin(heading)
        n += 1
    return n


@njit(cache=True)
def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Tell whether segments ab and cd meet; those along one line do not."""
    abx, aby, cdx, cdy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    of_c = abx * (c[1] - a[1]) - aby * (c[0] - a[0])
    of_d = abx * (d[1] - a[1]) - aby * (d[0] - a[0])
    if of_c * of_d > 0.0 or of_c == of_d:
        return False
    of_a = cdx * (a[1] - c[1]) - cdy * (a[0] - c[0])
    of_b = cdx * (b[1] - c[1]) - cdy * (b[0] - c[0])
    return bool(of_a * of_b <= 0.0)


@njit(cache=True)
def squared_distance(p: FloatArray, a: FloatArray, b: FloatArray) -> float:
    """Compute the squared distance of a point from a segment."""
    x, y, along_x, along_y = p[0] - a[0], p[1] - a[1], b[0] - a[0], b[1] - a[1]
    squared = along_x * along_x + along_y * along_y
    share = 0.0 if squared == 0.0 else min(max((x * along_x + y * along_y) / squared, 0.0), 1.0)
    x, y = x - share * along_x, y - share * along_y
    return float(x * x + y * y)


@njit(cache=True)
def keeps_off(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, need: float) -> bool:
    """Tell whether segments ab and cd do not meet and are at least `need` from each other."""
    if max(a[0], b[0]) + need < min(c[0], d[0]) or max(c[0], d[0]) + need < min(a[0], b[0]):
        return True
    if max(a[1], b[1]) + need < min(c[1], d[1]) or max(c[1], d[1]) + need < min(a[1], b[1]):
        return True
    if _meet(a, b, c, d):
        return False
    least = min(
        min(squared_distance(a, c, d), squared_distance(b, c, d)),
        min(squared_distance(c, a, b), squared_distance(d, a, b)),
    )
    return bool(least > 0.0 and least >= need * need)  # segments in line that overlap are at 0, too


@njit(cache=True)
def is_clear(points: FloatArray, n: int, scene: FedScene, needs: FloatArray) -> bool:
    """Tell whether a chain of points keeps off the walls, and `apart` off itself.

    The first piece, from the base on, stays on the feeder's axis and only must not meet a wall.

    Parameters
    ----------
    points : array, shape (at least n, 2)
        Of `place_arm`.
    n : int
        Number of points.
    scene : FedScene
        The walls.
    needs : array, shape (at least n,)
        What each point needs around it; a link needs what the more demanding of its ends does, and two links
        the sum.

    Notes
    -----
    The caller guarantees that the first point is in the free space.
    """
    for k in range(n - 2, -1, -1):  # the tip is what meets something most often
        need = max(needs[k], needs[k + 1]) if k > 0 else 0.0
        for wall in range(scene.walls.shape[0]):
            if not keeps_off(points[k], points[k + 1], scene.walls[wall, 0], scene.walls[wall, 1], need):
                return False
    for k in range(n - 1):
        for other in range(k + 2, n - 1):
            need = max(needs[k], needs[k + 1]) + max(needs[other], needs[other + 1]) + scene.apart
            if not keeps_off(points[k], points[k + 1], points[other], points[other + 1], need):
                return False
    return True


@njit(cache=True)
def state_is_clear(state: FloatArray, scene: FedScene) -> bool:
    """Tell whether the arm keeps the margin."""
    points, needs = np.empty((state.shape[0] + 1, 2)), np.full(state.shape[0] + 1, scene.margin)
    return is_clear(points, place_arm(state, scene, points), scene, needs)


@njit(cache=True)
def room_around(state: FloatArray, moves: FloatArray, scene: FedScene) -> int:
    """Count the moves, shape (n_moves, n_links), after which the arm keeps the margin."""
    count = 0
    for row in range(len(moves)):
        moved = state + moves[row]
        moved[0] = min(max(moved[0], 0.0), state.shape[0])
        count += state_is_clear(moved, scene)
    return count


@njit(cache=True)
def _moves(before: FloatArray, n_before: int, after: FloatArray, n_after: int, moves: FloatArray) -> float:
    """Compute how far joints move, counted from the tip; raise `moves` to it, and return the most."""
    most = 0.0
    for back in range(min(n_before, n_after)):
        x = after[n_after - 1 - back, 0] - before[n_before - 1 - back, 0]
        y = after[n_after - 1 - back, 1] - before[n_before - 1 - back, 1]
        move = np.sqrt(x * x + y * y)
        moves[back] = max(moves[back], move)
        most = max(most, move)
    return most


@njit(cache=True)
def _between(a: FloatArray, b: FloatArray, share: float, state: FloatArray) -> None:
    """Fill in the state at a share of the way from a to b."""
    for k in range(a.shape[0]):
        state[k] = b[k] if share == 1.0 else a[k] + share * (b[k] - a[k])


@njit(cache=True)
def _first_shares(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return shares of an edge at which there are poses: evenly, and where a joint passes the base."""
    first, last = min(a[0], b[0]), max(a[0], b[0])
    low, high = int(np.ceil(first)), int(np.floor(last))
    passing = high - low + 1 if first < last else 0
    shares = np.empty(PARTS + 1 + passing)
    for k in range(PARTS + 1):
        shares[k] = k / PARTS
    for k in range(passing):
        shares[PARTS + 1 + k] = (low + k - a[0]) / (b[0] - a[0])
    return np.sort(shares)


@njit(cache=True)
def _pose(a: FloatArray, b: FloatArray, share: float, release: float, pose: FloatArray) -> None:
    """Fill in the pose at a share of an edge: the angles that the arm has there."""
    n_links = a.shape[0]
    _between(a, b, share, pose)
    if abs(pose[0] - np.round(pose[0])) < WHOLE:
        pose[0] = np.round(pose[0])
    for joint in range(1, n_links):
        limit = release * max(pose[0] - (n_links - joint), 0.0)
        pose[joint] = min(max(pose[joint], -limit), limit)


@njit(cache=True)
def edge_poses(a: FloatArray, b: FloatArray, scene: FedScene) -> FloatArray:
    """Compute the poses along an edge; the other way round they are the same.

    Parameters
    ----------
    a, b : array, shape (n_links,)
        States.
    scene : FedScene
        The feeder.

    Returns
    -------
    poses : array, shape (n_poses, n_links)
        From a to b: states whose angles are those that the arm has, so near to each other that no joint moves
        more than a step, and among them those at which a joint passes the base.
    """
    k, n_links = 0, a.shape[0]
    while k < n_links - 1 and a[k] == b[k]:
        k += 1
    if a[k] > b[k]:
        return edge_poses_onward(b, a, scene)[::-1].copy()
    return edge_poses_onward(a, b, scene)


@njit(cache=True)
def edge_poses_onward(a: FloatArray, b: FloatArray, scene: FedScene) -> FloatArray:
    """Compute the poses along an edge, see `edge_poses`, by halving what is too far between two of them."""
    n_links, todo = a.shape[0], _first_shares(a, b)[::-1]
    stack, height = np.empty(len(todo) + MOST_HALVINGS), len(todo) - 1
    stack[:height] = todo[:height]
    poses, n_poses, share = np.empty((64, n_links)), 1, 0.0
    before, points, moves = np.empty((n_links + 1, 2)), np.empty((n_links + 1, 2)), np.empty(n_links + 1)
    _pose(a, b, 0.0, scene.release, poses[0])
    n_before = place_arm(poses[0], scene, before)
    while height > 0:
        if n_poses == len(poses):
            poses = np.concatenate((poses, np.empty_like(poses)))
        pose, end = poses[n_poses], stack[height - 1]
        _pose(a, b, end, scene.release, pose)
        n = place_arm(pose, scene, points)
        moved = max(_moves(before, n_before, points, n, moves), abs(pose[0] - poses[n_poses - 1, 0]))
        if moved > STEP and height < len(stack) and end - share > SHORTEST:
            stack[height] = 0.5 * (share + end)
            height += 1
            continue
        height -= 1
        if end > share:
            before, points, n_before = points, before, n
            n_poses, share = n_poses + 1, end
    return poses[:n_poses].copy()


@njit(cache=True)
def _piece_is_clear(a: FloatArray, b: FloatArray, scene: FedScene) -> bool:
    """Tell whether the arm keeps off everything while it moves from one pose to the next.

    No joint is farther from the line between its places at a piece's ends than an eighth of the sum of the
    squares of what the headings behind it change by.
    """
    n_links = a.shape[0]
    bends, turn = np.zeros(n_links + 1), 0.0  # counted from the tip
    for joint in range(1, n_links):
        turn += b[joint] - a[joint]
        for back in range(n_links - joint):
            bends[back] += turn * turn / 8.0
    state, moves, needs = np.empty(n_links), np.empty(n_links + 1), np.empty(n_links + 1)
    points, n = np.empty((3, n_links + 1, 2)), np.empty(3, dtype=np.int64)
    stack, height = np.empty((MOST_HALVINGS + 2, 2)), 1
    stack[0, 0], stack[0, 1] = 0.0, 1.0
    while height > 0:
        height -= 1
        start, end = stack[height, 0], stack[height, 1]
        middle = 0.5 * (start + end)
        for k, share in enumerate((start, middle, end)):
            _between(a, b, share, state)
            n[k] = place_arm(state, scene, points[k])
        moves[:] = 0.0
        _moves(points[0], n[0], points[1], n[1], moves)
        _moves(points[2], n[2], points[1], n[1], moves)
        most = 0.0
        for k in range(n[1]):
            back = n[1] - 1 - k
            move = moves[back] + bends[back] * (end - start) * (end - start)
            needs[k], most = max(move, scene.margin), max(most, move)
        if is_clear(points[1], n[1], scene, needs):
            continue
        needs[:] = scene.margin
        if most <= scene.margin or height + 2 > len(stack) or not is_clear(points[1], n[1], scene, needs):
            return False
        stack[height, 0], stack[height, 1] = middle, end
        stack[height + 1, 0], stack[height + 1, 1] = start, middle
        height += 2
    return True


@njit(cache=True)
def edge_is_clear(a: FloatArray, b: FloatArray, scene: FedScene) -> bool:
    """Tell whether the arm keeps the margin at b and all along the edge from a to b.

    Parameters
    ----------
    a, b : array, shape (n_links,)
        States; the arm is known to keep the margin at a.
    scene : FedScene
        Feeder and walls.
    """
    if not state_is_clear(b, scene):
        return False
    poses, needs = edge_poses(a, b, scene), np.full(a.shape[0] + 1, scene.margin)
    last, points = len(poses) - 1, np.empty((a.shape[0] + 1, 2))
    stride = 1
    while stride < last:
        stride *= 2
    while stride > 1:  # coarse to fine, for what is not free shows soon
        half = stride // 2
        for k in range(half, last, stride):
            if not is_clear(points, place_arm(poses[k], scene, points), scene, needs):
                return False
        stride = half
    for k in range(last):  # noqa: SIM110 - numba has no all()
        if not _piece_is_clear(poses[k], poses[k + 1], scene):
            return False
    return True
