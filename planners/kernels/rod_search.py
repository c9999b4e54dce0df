"""The search for a rod's way through the triangles of its tails: through exact headings if there is one.

Nodes are the base, the goal, and two kinds in every triangle: its possible intervals of headings, and the
exact ones of its centre. A step between exact ones is a motion that has been checked; a step to a possible
one is a doubt and costs more. So the cheapest way is a motion if it avoids possible nodes, and there is no
way at all only if no rod passes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.rod_space import GAPS, SLACK, RodSpace, beside
from planners.kernels.types import FloatArray, IntArray

PER_TRIANGLE = 2 * GAPS
"""Nodes per triangle: possible ones first, then exact ones."""

BASE = 0
GOAL = 1
FIRST = 2
"""Node numbers: the base, the goal, and the first node of triangle 0."""

DOUBT = 30.0
"""How many times its length a doubtful step costs, so that known ground is used as far as it goes."""

TURNABOUT = 4.0
"""How many rod lengths it costs to begin doubting: more than the turn that a doubtful step would save."""

HOPELESS = 1e4
"""How many rod lengths a doubtful step costs in a triangle that is not to be halved any more."""

MARGIN = 0.02
"""In rad: how far inside a free interval a rod stays where it may."""


class Frontier(NamedTuple):
    """Hold the state of a search; arrays have one entry per node.

    Parameters
    ----------
    cost : array
        From the base; infinite where not reached.
    heading : array
        Of the rod when it arrives at the node, without jumps of 2 pi along the way.
    parent : array of int
        Node before.
    heap : array of int
        Open nodes, a binary heap by cost.
    place : array of int
        Of the node in the heap.
    used : array of int, shape (3,)
        Number of open nodes, of touched nodes, and of doubts.
    touched : array of int
        Nodes with a cost.
    doubts : array of int
        Triangles on the way to be halved.
    """

    cost: FloatArray
    heading: FloatArray
    parent: IntArray
    heap: IntArray
    place: IntArray
    used: IntArray
    touched: IntArray
    doubts: IntArray


class Task(NamedTuple):
    """Hold what is to be done by the rod.

    Parameters
    ----------
    length : float
        Of the rod.
    x, y, heading : float
        Of its tail at the start.
    gap_start, gap_end : float
        Free headings at the start, around `heading`.
    goal_x, goal_y, goal_radius : float
        Where the tip shall get.
    resolution : float
        Size of the triangles that are not to be halved any more.
    """

    length: float
    x: float
    y: float
    heading: float
    gap_start: float
    gap_end: float
    goal_x: float
    goal_y: float
    goal_radius: float
    resolution: float


# Heap


@njit(cache=True)
def _raise(f: Frontier, place: int) -> None:
    """Move a node towards the top of the heap, to where its cost belongs."""
    node = f.heap[place]
    while place > 0:
        above = (place - 1) // 2
        if f.cost[f.heap[above]] <= f.cost[node]:
            break
        f.heap[place] = f.heap[above]
        f.place[f.heap[place]] = place
        place = above
    f.heap[place], f.place[node] = node, place


@njit(cache=True)
def _pop(f: Frontier) -> int:
    """Take the cheapest node from the heap."""
    top = f.heap[0]
    f.used[0] -= 1
    n = f.used[0]
    node, place = f.heap[n], 0
    while 2 * place + 1 < n:
        below = 2 * place + 1
        if below + 1 < n and f.cost[f.heap[below + 1]] < f.cost[f.heap[below]]:
            below += 1
        if f.cost[node] <= f.cost[f.heap[below]]:
            break
        f.heap[place] = f.heap[below]
        f.place[f.heap[place]] = place
        place = below
    f.heap[place], f.place[node] = node, place
    return int(top)


@njit(cache=True)
def _offer(f: Frontier, node: int, cost: float, heading: float, parent: int) -> None:
    """Note a way to a node if it is the cheapest so far."""
    if cost >= f.cost[node]:
        return
    if np.isinf(f.cost[node]):
        f.touched[f.used[1]] = node
        f.used[1] += 1
        f.place[node] = f.used[0]
        f.used[0] += 1
    f.cost[node], f.heading[node], f.parent[node] = cost, heading, parent
    f.heap[f.place[node]] = node
    _raise(f, f.place[node])


# Geometry


@njit(cache=True)
def sweep_is_free(
    px: float, py: float, qx: float, qy: float, heading: float, length: float, space: RodSpace
) -> bool:
    """Check that a rod moved from p to q without turning meets no wall (separating axes).

    Parameters
    ----------
    px, py, qx, qy : float
        Tail before and after.
    heading, length : float
        Of the rod.
    space : RodSpace
        Its walls are read.

    Returns
    -------
    free : bool
        A touch counts as not free.
    """
    dx, dy = qx - px, qy - py
    rx, ry = length * np.cos(heading), length * np.sin(heading)
    x_min, x_max = px + min(dx, 0.0) + min(rx, 0.0), px + max(dx, 0.0) + max(rx, 0.0)
    y_min, y_max = py + min(dy, 0.0) + min(ry, 0.0), py + max(dy, 0.0) + max(ry, 0.0)
    area = dx * ry - dy * rx
    for ring in range(space.rings.shape[0] - 1):
        box = space.boxes[ring]
        if box[0] > x_max or box[1] > y_max or box[2] < x_min or box[3] < y_min:
            continue
        for j in range(space.rings[ring], space.rings[ring + 1]):
            ax, ay, bx, by = (
                space.walls[j, 0, 0],
                space.walls[j, 0, 1],
                space.walls[j, 1, 0],
                space.walls[j, 1, 1],
            )
            if min(ax, bx) > x_max or max(ax, bx) < x_min or min(ay, by) > y_max or max(ay, by) < y_min:
                continue
            ax, ay, bx, by = ax - px, ay - py, bx - px, by - py
            # In units of (d, r) the swept area is the unit square, if it is one at all.
            along_a, along_b = ax * dy - ay * dx, bx * dy - by * dx
            if min(along_a, along_b) > max(-area, 0.0) or max(along_a, along_b) < min(-area, 0.0):
                continue
            across_a, across_b = ax * ry - ay * rx, bx * ry - by * rx
            if min(across_a, across_b) > max(area, 0.0) or max(across_a, across_b) < min(area, 0.0):
                continue
            nx, ny = ay - by, bx - ax
            level, d, r = ax * nx + ay * ny, dx * nx + dy * ny, rx * nx + ry * ny
            if level > max(d, 0.0) + max(r, 0.0) or level < min(d, 0.0) + min(r, 0.0):
                continue
            return False
    return True


@njit(cache=True)
def _contains(space: RodSpace, triangle: int, x: float, y: float, margin: float) -> bool:
    for k in range(3):
        a = space.vertices[space.triangles[triangle, k]]
        b = space.vertices[space.triangles[triangle, (k + 1) % 3]]
        ex, ey = b[0] - a[0], b[1] - a[1]
        if ex * (y - a[1]) - ey * (x - a[0]) < -margin * np.sqrt(ex * ex + ey * ey):
            return False
    return True


@njit(cache=True)
def _goal_window(task: Task, x: float, y: float, slack: float) -> tuple[float, float]:
    """Return the headings with which a rod from (x, y) has its tip in the goal's disc, grown by a slack.

    The interval is empty (start > end) where the rod is too short or too long.
    """
    dx, dy = task.goal_x - x, task.goal_y - y
    away, radius = np.sqrt(dx * dx + dy * dy), task.goal_radius + slack
    if abs(away - task.length) > radius:
        return np.inf, -np.inf
    half = np.pi
    if away > 0.0:  # the law of cosines
        cosine = (away * away + task.length**2 - radius * radius) / (2.0 * away * task.length)
        half = np.arccos(max(-1.0, min(1.0, cosine)))
    middle = np.arctan2(dy, dx)
    return middle - half, middle + half


@njit(cache=True)
def _exact_goal(task: Task, x: float, y: float, start: float, end: float, heading: float) -> float:
    """Return the nearest heading in an interval with which a rod reaches the goal; inf if there is none."""
    first, last = _goal_window(task, x, y, -SLACK * task.goal_radius)
    if first > last:
        return np.inf
    first, last = beside(start, end, first, last)
    first, last = max(first, start), min(last, end)
    return max(first, min(last, heading)) if first <= last else np.inf


@njit(cache=True)
def _may_be_goal(space: RodSpace, task: Task, triangle: int, gap: FloatArray) -> bool:
    """Tell whether a rod with its tail in a triangle and a heading in a gap may have its tip at the goal.

    No tail is further from the centre than two thirds of the longest edge, and its tip is as far from that
    of the rod at the centre.
    """
    slack = 0.667 * space.sizes[triangle] + SLACK * task.length
    first, last = _goal_window(task, space.centres[triangle, 0], space.centres[triangle, 1], slack)
    if first > last:
        return False
    start, end = beside(first, last, gap[0], gap[1])
    return bool(start <= last + SLACK and first - SLACK <= end)


# Steps


@njit(cache=True)
def _step_exact(
    f: Frontier,
    space: RodSpace,
    task: Task,
    node: int,
    x: float,
    y: float,
    start: float,
    end: float,
    triangle: int,
) -> None:
    """Offer the checked steps from a tail with free headings (start, end) to the centre of a triangle."""
    px, py = space.centres[triangle, 0], space.centres[triangle, 1]
    heading = f.heading[node]
    away = np.sqrt((px - x) ** 2 + (py - y) ** 2)
    for h in range(space.n_exact[triangle]):
        low, high = beside(start, end, space.exact[triangle, h, 0], space.exact[triangle, h, 1])
        low, high = max(low, start), min(high, end)
        if high <= low:
            continue
        to = FIRST + triangle * PER_TRIANGLE + GAPS + h
        inside = min(MARGIN, 0.25 * (high - low))
        nearest = max(low + inside, min(high - inside, heading))
        for choice in (nearest, 0.5 * (low + high)):
            cost = f.cost[node] + away + 0.5 * task.length * abs(choice - heading)
            if cost < f.cost[to] and sweep_is_free(x, y, px, py, choice, task.length, space):
                _offer(f, to, cost, choice, node)
                break


@njit(cache=True)
def _doubt(task: Task, size: float) -> float:
    """Return the cost of a doubtful step; steps too short to be looked into more closely come last."""
    return DOUBT * size + (HOPELESS * task.length if size <= task.resolution else 0.0)


@njit(cache=True)
def _leave_exact(f: Frontier, space: RodSpace, task: Task, node: int) -> None:
    triangle, g = (node - FIRST) // PER_TRIANGLE, (node - FIRST) % PER_TRIANGLE - GAPS
    x, y = space.centres[triangle, 0], space.centres[triangle, 1]
    # The interval beside the rod's own heading, so that headings never jump.
    heading = f.heading[node]
    start, end = beside(heading, heading, space.exact[triangle, g, 0], space.exact[triangle, g, 1])
    for k in range(3):
        if space.neighbours[triangle, k] >= 0:
            _step_exact(f, space, task, node, x, y, start, end, space.neighbours[triangle, k])
    doubt = FIRST + triangle * PER_TRIANGLE + space.around[triangle, g]
    cost = f.cost[node] + TURNABOUT * task.length + _doubt(task, space.sizes[triangle])
    _offer(f, doubt, cost, heading, node)
    at_goal = _exact_goal(task, x, y, start, end, heading)
    if not np.isinf(at_goal):
        _offer(f, GOAL, f.cost[node] + 0.5 * task.length * abs(at_goal - heading), at_goal, node)


@njit(cache=True)
def _leave_possible(f: Frontier, space: RodSpace, task: Task, node: int) -> None:
    triangle, g = (node - FIRST) // PER_TRIANGLE, (node - FIRST) % PER_TRIANGLE
    gap = space.possible[triangle, g]
    for h in range(space.n_exact[triangle]):
        if space.around[triangle, h] == g:
            to = FIRST + triangle * PER_TRIANGLE + GAPS + h
            middle = 0.5 * (space.exact[triangle, h, 0] + space.exact[triangle, h, 1])
            _offer(f, to, f.cost[node], middle, node)
    for k in range(3):
        across = space.neighbours[triangle, k]
        if across < 0:
            continue
        away = _doubt(task, space.sizes[across])
        for h in range(space.n_possible[across]):
            low, high = beside(gap[0], gap[1], space.possible[across, h, 0], space.possible[across, h, 1])
            if low <= gap[1] and gap[0] <= high:
                _offer(f, FIRST + across * PER_TRIANGLE + h, f.cost[node] + away, 0.0, node)
    if _may_be_goal(space, task, triangle, gap):
        _offer(f, GOAL, f.cost[node] + _doubt(task, space.sizes[triangle]), 0.0, node)


@njit(cache=True)
def _leave_base(f: Frontier, space: RodSpace, task: Task) -> None:
    for triangle in range(space.counts[1]):
        if not _contains(space, triangle, task.x, task.y, SLACK * task.length):
            continue
        _step_exact(f, space, task, BASE, task.x, task.y, task.gap_start, task.gap_end, triangle)
        for h in range(space.n_possible[triangle]):
            low, high = beside(
                task.heading, task.heading, space.possible[triangle, h, 0], space.possible[triangle, h, 1]
            )
            if low - SLACK <= task.heading <= high + SLACK:
                node = FIRST + triangle * PER_TRIANGLE + h
                _offer(f, node, _doubt(task, space.sizes[triangle]), 0.0, BASE)
    at_goal = _exact_goal(task, task.x, task.y, task.gap_start, task.gap_end, task.heading)
    if not np.isinf(at_goal):
        _offer(f, GOAL, 0.5 * task.length * abs(at_goal - task.heading), at_goal, BASE)


@njit(cache=True)
def _note_way(f: Frontier, space: RodSpace, way: IntArray, headings: FloatArray, resolution: float) -> int:
    """Write down the way to the goal, goal first, and which of its triangles are to be halved."""
    n, node = 0, GOAL
    while node >= 0:
        way[n], headings[n] = node, f.heading[node]
        triangle = (node - FIRST) // PER_TRIANGLE
        if node >= FIRST and (node - FIRST) % PER_TRIANGLE < GAPS and space.sizes[triangle] > resolution:
            f.doubts[f.used[2]] = triangle
            f.used[2] += 1
        node = f.parent[node]
        n += 1
    return n


@njit(cache=True)
def search(space: RodSpace, task: Task, f: Frontier, way: IntArray, headings: FloatArray) -> int:
    """Find the cheapest way from the base to the goal (Dijkstra).

    Parameters
    ----------
    space : RodSpace
        With headings up to date.
    task : Task
        What the rod shall do.
    f : Frontier
        Work space with all costs infinite; left so. `doubts` are filled with the triangles to be halved.
    way : array of int, shape (n_nodes,)
        Filled with the nodes of the way, goal first.
    headings : array, shape (n_nodes,)
        Filled with the headings on arrival there.

    Returns
    -------
    n : int
        Number of nodes on the way; 0 if the goal cannot be reached.

    Notes
    -----
    The caller guarantees FIRST + n_triangles * PER_TRIANGLE nodes of work space.
    """
    f.used[:] = 0
    _offer(f, BASE, 0.0, task.heading, -1)
    n = 0
    while f.used[0] > 0:
        node = _pop(f)
        if node == GOAL:
            n = _note_way(f, space, way, headings, task.resolution)
            break
        if node == BASE:
            _leave_base(f, space, task)
        elif (node - FIRST) % PER_TRIANGLE < GAPS:
            _leave_possible(f, space, task, node)
        else:
            _leave_exact(f, space, task, node)
    for k in range(f.used[1]):
        f.cost[f.touched[k]] = np.inf
    return n
