"""The places of a rod: headings that may be free from a triangle of tails, and that are from its centre.

The tails live in a conforming triangulation of the free space. To every triangle belong

- the *possible* headings: those that the walls do not block from every tail in the triangle, an outer
  estimate, so what is not joined through them is not joined at all;
- the *exact* headings: those that are free from the triangle's centre, an inner estimate, so a way through
  them is a motion of the rod.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from planners.kernels.rod import TWO_PI, WHOLE_TURN, free_directions
from planners.kernels.types import BoolArray, FloatArray, IntArray

GAPS = 16
"""Intervals kept per triangle and kind. What is more is joined (possible ones) or dropped (exact ones)."""

SLACK = 1e-9
"""In rad, and relative to the length: what is called blocked is smaller, what is called free is smaller."""


class RodSpace(NamedTuple):
    """Hold walls, triangles of tails, and the headings over them; a plain bundle of arrays.

    Parameters
    ----------
    walls : array, shape (n_walls, 2, 2)
        Segments, ring by ring, each starting where the one before ends.
    rings : array of int, shape (n_rings + 1,)
        Where each ring begins in `walls`.
    boxes : array, shape (n_rings, 4)
        (x_min, y_min, x_max, y_max) of each ring.
    counts : array of int, shape (2,)
        Vertices and triangles in use; the arrays below are longer.
    vertices : array, shape (n, 2)
        Of the triangles.
    triangles : array of int, shape (n, 3)
        Vertices, counter-clockwise.
    neighbours : array of int, shape (n, 3)
        Triangle across the edge from vertex k to vertex k + 1; -1 at a wall.
    changed : array of bool, shape (n,)
        Triangles whose headings are out of date.
    centres : array, shape (n, 2)
        Of the triangles.
    sizes : array, shape (n,)
        Length of the longest edge.
    possible, exact : array, shape (n, GAPS, 2)
        Intervals (start, end) of headings, at most one turn long.
    n_possible, n_exact : array of int, shape (n,)
        How many there are.
    around : array of int, shape (n, GAPS)
        The possible interval that holds the exact one.
    """

    walls: FloatArray
    rings: IntArray
    boxes: FloatArray
    counts: IntArray
    vertices: FloatArray
    triangles: IntArray
    neighbours: IntArray
    changed: BoolArray
    centres: FloatArray
    sizes: FloatArray
    possible: FloatArray
    exact: FloatArray
    n_possible: IntArray
    n_exact: IntArray
    around: IntArray


# Triangles


@njit(cache=True)
def _longest_edge(space: RodSpace, triangle: int) -> int:
    """Return the edge to be halved: the longest, of equals the one with the largest vertex numbers."""
    best, best_squared, best_low, best_high = 0, -1.0, -1, -1
    for k in range(3):
        i, j = space.triangles[triangle, k], space.triangles[triangle, (k + 1) % 3]
        dx = space.vertices[i, 0] - space.vertices[j, 0]
        dy = space.vertices[i, 1] - space.vertices[j, 1]
        squared, low, high = dx * dx + dy * dy, min(i, j), max(i, j)
        if squared > best_squared or (
            squared == best_squared and (low > best_low or (low == best_low and high > best_high))
        ):
            best, best_squared, best_low, best_high = k, squared, low, high
    return best


@njit(cache=True)
def _edge_to(space: RodSpace, triangle: int, neighbour: int) -> int:
    for k in range(3):
        if space.neighbours[triangle, k] == neighbour:
            return k
    return -1


@njit(cache=True)
def _halve(space: RodSpace, triangle: int, edge: int, middle: int) -> int:
    """Halve one triangle from the middle of an edge; the first half keeps its number. Return the other's."""
    new = int(space.counts[1])
    space.counts[1] += 1
    a = space.triangles[triangle, edge]
    b = space.triangles[triangle, (edge + 1) % 3]
    c = space.triangles[triangle, (edge + 2) % 3]
    across_bc = space.neighbours[triangle, (edge + 1) % 3]
    across_ca = space.neighbours[triangle, (edge + 2) % 3]
    space.triangles[triangle, 0], space.triangles[triangle, 1], space.triangles[triangle, 2] = a, middle, c
    space.neighbours[triangle, 0], space.neighbours[triangle, 1] = -1, new
    space.neighbours[triangle, 2] = across_ca
    space.triangles[new, 0], space.triangles[new, 1], space.triangles[new, 2] = middle, b, c
    space.neighbours[new, 0], space.neighbours[new, 1], space.neighbours[new, 2] = -1, across_bc, triangle
    if across_bc >= 0:
        space.neighbours[across_bc, _edge_to(space, across_bc, triangle)] = new
    space.changed[triangle] = space.changed[new] = True
    return new


@njit(cache=True)
def _halve_pair(space: RodSpace, triangle: int, edge: int) -> None:
    """Halve an edge, and with it the triangles on both its sides."""
    across = space.neighbours[triangle, edge]
    i, j = space.triangles[triangle, edge], space.triangles[triangle, (edge + 1) % 3]
    middle = space.counts[0]
    space.counts[0] += 1
    for axis in range(2):
        space.vertices[middle, axis] = 0.5 * (space.vertices[i, axis] + space.vertices[j, axis])
    other_edge = _edge_to(space, across, triangle) if across >= 0 else -1
    new = _halve(space, triangle, edge, middle)
    if across < 0:
        return
    other = _halve(space, across, other_edge, middle)
    # The two run against each other along the edge: the first half here meets the second half there.
    space.neighbours[triangle, 0], space.neighbours[other, 0] = other, triangle
    space.neighbours[new, 0], space.neighbours[across, 0] = across, new


@njit(cache=True)
def refine(space: RodSpace, wanted: IntArray, first: int) -> int:
    """Halve triangles, and neighbours where needed, so that the triangulation stays conforming.

    A triangle is halved across its longest edge. Where that edge is not its neighbour's longest, the
    neighbour goes first (longest-edge propagation [1]_), which keeps the angles.

    Parameters
    ----------
    space : RodSpace
        Changed in place.
    wanted : array of int, shape (n,)
        Triangles to be halved; those with `changed` set already have been.
    first : int
        Where to begin in `wanted`.

    Returns
    -------
    done : int
        How many of `wanted` are done; fewer than n if the arrays are full.

    References
    ----------
    .. [1] M.-C. Rivara, "New longest-edge algorithms for the refinement and/or improvement of unstructured
       triangulations", Int. J. Numerical Methods in Engineering 40, 1997.
    """
    for place in range(first, wanted.shape[0]):
        while not space.changed[wanted[place]]:
            if (
                space.counts[0] + 1 > space.vertices.shape[0]
                or space.counts[1] + 2 > space.triangles.shape[0]
            ):
                return place
            triangle = wanted[place]
            while True:
                edge = _longest_edge(space, triangle)
                across = space.neighbours[triangle, edge]
                if across < 0 or space.neighbours[across, _longest_edge(space, across)] == triangle:
                    break
                triangle = across
            _halve_pair(space, triangle, edge)
    return len(wanted)


# Headings


@njit(cache=True)
def _within_reach(
    corners: FloatArray, squared_reach: float, ax: float, ay: float, bx: float, by: float
) -> tuple[float, float]:
    """Return the part of a wall that every corner reaches, as fractions; first > last if there is none."""
    first, last = 0.0, 1.0
    ex, ey = bx - ax, by - ay
    squared = ex * ex + ey * ey
    for k in range(3):
        x, y = ax - corners[k, 0], ay - corners[k, 1]
        middle = -(x * ex + y * ey)
        root = middle * middle - squared * (x * x + y * y - squared_reach)
        if root < 0.0:
            return 1.0, 0.0
        half = np.sqrt(root)
        first, last = max(first, (middle - half) / squared), min(last, (middle + half) / squared)
    return first, last


@njit(cache=True)
def _spread(corners: FloatArray, margin: float, x: float, y: float) -> tuple[bool, float, float]:
    """Return by how much the direction to a point differs between the corners and their centre.

    The first value tells whether the point is outside the triangle by the margin at least: only then all
    tails see it within half a turn, and the corners see it the furthest apart.
    """
    outside = False
    for k in range(3):
        ax, ay = corners[k, 0], corners[k, 1]
        ex, ey = corners[(k + 1) % 3, 0] - ax, corners[(k + 1) % 3, 1] - ay
        if ex * (y - ay) - ey * (x - ax) < -margin * np.sqrt(ex * ex + ey * ey):
            outside = True
            break
    if not outside:
        return False, 0.0, 0.0
    dx = x - (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3.0
    dy = y - (corners[0, 1] + corners[1, 1] + corners[2, 1]) / 3.0
    least, most = np.inf, -np.inf
    for k in range(3):
        cx, cy = x - corners[k, 0], y - corners[k, 1]
        turn = np.arctan2(dx * cy - dy * cx, dx * cx + dy * cy)
        least, most = min(least, turn), max(most, turn)
    return True, least, most


@njit(cache=True)
def _block(blocked: FloatArray, n: int, start: float, end: float) -> int:
    """Insert an interval of blocked headings, sorted by its start modulo a turn; return their new number."""
    start, end = start + SLACK, end - SLACK
    if end <= start:
        return n
    turns = TWO_PI * np.floor(start / TWO_PI)
    start, end = start - turns, end - turns
    place = n
    while place > 0 and blocked[place - 1, 0] > start:
        blocked[place] = blocked[place - 1]
        place -= 1
    blocked[place, 0], blocked[place, 1] = start, end
    return n + 1


@njit(cache=True)
def _block_ring(
    walls: FloatArray, corners: FloatArray, length: float, reached: BoolArray, blocked: FloatArray, n: int
) -> int:
    """Insert what one ring of walls blocks from every tail in a triangle; return the new number of intervals.

    A connected chain of walls that is within reach of every tail hides, from each, all headings between
    its extreme ones. The part common to all tails runs from the least of the largest to the largest of the
    least direction under which the corners see a point of the chain.
    """
    n_walls = walls.shape[0]
    rx, ry = corners[:, 0].sum() / 3.0, corners[:, 1].sum() / 3.0
    reach = length * (1.0 - SLACK)
    start = 0
    for j in range(n_walls):
        reached[j] = True
        for k in range(3):
            x, y = walls[j, 0, 0] - corners[k, 0], walls[j, 0, 1] - corners[k, 1]
            if x * x + y * y > reach * reach:
                reached[j] = False
                start = j
                break
    low, high, angle, linked = np.inf, -np.inf, 0.0, False
    for step in range(n_walls):
        j = (start + step) % n_walls
        ax, ay, bx, by = walls[j, 0, 0], walls[j, 0, 1], walls[j, 1, 0], walls[j, 1, 1]
        here, there = reached[j], reached[(j + 1) % n_walls]
        first, last = 0.0, 1.0
        if not (here and there):
            first, last = _within_reach(corners, reach * reach, ax, ay, bx, by)
            if here:
                first, last = 0.0, max(last, 0.0)
            if there:
                first, last = min(first, 1.0), 1.0
            if first > last:
                continue
        px, py = ax + first * (bx - ax), ay + first * (by - ay)
        qx, qy = ax + last * (bx - ax), ay + last * (by - ay)
        if not linked:
            low, high, angle = np.inf, -np.inf, np.arctan2(py - ry, px - rx)
            seen, least, most = _spread(corners, SLACK * length, px, py)
            if seen:
                low, high = angle + most, angle + least
        px, py, qx, qy = px - rx, py - ry, qx - rx, qy - ry
        angle += np.arctan2(px * qy - py * qx, px * qx + py * qy)
        seen, least, most = _spread(corners, SLACK * length, qx + rx, qy + ry)
        if seen:
            low, high = min(low, angle + most), max(high, angle + least)
        linked = there and step < n_walls - 1
        if not linked:
            n = _block(blocked, n, low, high)
    return n


@njit(cache=True)
def possible_gaps(
    space: RodSpace,
    corners: FloatArray,
    length: float,
    reached: BoolArray,
    blocked: FloatArray,
    gaps: FloatArray,
) -> int:
    """Compute the headings that are not blocked from every tail in a triangle.

    Parameters
    ----------
    space : RodSpace
        Its walls are read.
    corners : array, shape (3, 2)
        Of the triangle, counter-clockwise.
    length : float
        Of the rod.
    reached : array of bool, shape (n_walls,)
        Work space.
    blocked : array, shape (n_walls + 1, 2)
        Work space.
    gaps : array, shape (GAPS, 2)
        Filled with the intervals (start, end), start in [-2 pi, 2 pi).

    Returns
    -------
    n_gaps : int
        Number of intervals.

    Notes
    -----
    The caller guarantees that no wall enters the triangle's inside.
    """
    n = 0
    x_min, x_max = corners[:, 0].min() - length, corners[:, 0].max() + length
    y_min, y_max = corners[:, 1].min() - length, corners[:, 1].max() + length
    for ring in range(space.rings.shape[0] - 1):
        box = space.boxes[ring]
        if box[0] > x_max or box[1] > y_max or box[2] < x_min or box[3] < y_min:
            continue
        walls = space.walls[space.rings[ring] : space.rings[ring + 1]]
        n = _block_ring(walls, corners, length, reached, blocked, n)
    if n == 0:
        gaps[0, 0], gaps[0, 1] = 0.0, TWO_PI
        return 1
    end = blocked[:n, 1].max() - TWO_PI
    n_gaps = 0
    for k in range(n):
        if blocked[k, 0] >= end:
            if n_gaps == GAPS:  # no room: what is blocked in between counts as possible
                gaps[GAPS - 1, 1] = blocked[k, 0]
            else:
                gaps[n_gaps, 0], gaps[n_gaps, 1] = end, blocked[k, 0]
                n_gaps += 1
        end = max(end, blocked[k, 1])
    return n_gaps


@njit(cache=True)
def beside(start: float, end: float, first: float, last: float) -> tuple[float, float]:
    """Return an interval (first, last) moved by whole turns so that its middle is nearest to another's.

    If the two meet after any whole turns, they meet after these.
    """
    turns = TWO_PI * np.round((start + end - first - last) / (2.0 * TWO_PI))
    return first + turns, last + turns


@njit(cache=True)
def update_headings(space: RodSpace, length: float, every: bool) -> None:
    """Compute the headings over all triangles, or over those that have changed.

    Parameters
    ----------
    space : RodSpace
        Changed in place.
    length : float
        Of the rod.
    every : bool
        Whether to do all triangles.
    """
    n_walls = space.walls.shape[0]
    reached = np.empty(n_walls, dtype=np.bool_)
    blocked, gaps = np.empty((n_walls + 1, 2)), np.empty((n_walls + 1, 2))
    corners = np.empty((3, 2))
    for t in range(space.counts[1]):
        if not (every or space.changed[t]):
            continue
        space.changed[t] = False
        for k in range(3):
            corners[k] = space.vertices[space.triangles[t, k]]
        cx, cy = corners[:, 0].sum() / 3.0, corners[:, 1].sum() / 3.0
        space.centres[t, 0], space.centres[t, 1] = cx, cy
        edge = corners[_longest_edge(space, t)] - corners[(_longest_edge(space, t) + 1) % 3]
        space.sizes[t] = np.sqrt(edge[0] * edge[0] + edge[1] * edge[1])
        space.n_possible[t] = possible_gaps(space, corners, length, reached, blocked, space.possible[t])
        n_gaps = free_directions(cx, cy, length, space.walls, SLACK, blocked, gaps)
        space.n_exact[t] = 0
        for k in range(n_gaps):
            for h in range(space.n_possible[t]):
                start, end = beside(gaps[k, 0], gaps[k, 1], space.possible[t, h, 0], space.possible[t, h, 1])
                # All headings hold any interval: where they begin means nothing.
                holds = end - start >= WHOLE_TURN or (start <= gaps[k, 0] and gaps[k, 1] <= end)
                if holds and space.n_exact[t] < GAPS:
                    space.exact[t, space.n_exact[t]] = gaps[k]
                    space.around[t, space.n_exact[t]] = h
                    space.n_exact[t] += 1
                    break
