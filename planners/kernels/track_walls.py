"""Kernels of the track planner against walls: wall lists, samples that keep away, moves that stay free."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.track_types import Rows, Surroundings
from planners.kernels.types import FloatArray, IntArray

LONGEST_MOVE = 0.12
"""Largest movement of a sample in one step, in link lengths; less than the reach of the wall lists."""

REACH = 0.15
"""Walls within this distance of a sample, and corners within this distance of a chord, are looked at."""

HALVINGS = 4
"""How often a movement is halved where it would meet a wall, before it is given up."""

SLIP = 0.3
"""How far the track between two samples may cut a corner and still count as having slipped, in spacings. What
is deeper belongs to the other side of a thin wall."""


@njit(cache=True)
def segments_meet(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> bool:
    """Tell whether the segments a-b and c-d have a point in common."""
    if max(ax, bx) < min(cx, dx) or max(cx, dx) < min(ax, bx):
        return False
    if max(ay, by) < min(cy, dy) or max(cy, dy) < min(ay, by):
        return False
    ex, ey, fx, fy = bx - ax, by - ay, dx - cx, dy - cy
    c, d = ex * (cy - ay) - ey * (cx - ax), ex * (dy - ay) - ey * (dx - ax)
    if (c > 0.0 and d > 0.0) or (c < 0.0 and d < 0.0):
        return False
    a, b = fx * (ay - cy) - fy * (ax - cx), fx * (by - cy) - fy * (bx - cx)
    return not ((a > 0.0 and b > 0.0) or (a < 0.0 and b < 0.0))


@njit(cache=True)
def wall_between(ax: float, ay: float, bx: float, by: float, walls: FloatArray) -> int:
    """Return the index of the first wall that meets the segment a-b, or -1."""
    for w in range(walls.shape[0]):
        if segments_meet(ax, ay, bx, by, walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1]):
            return w
    return -1


@njit(cache=True)
def list_walls(
    walls: FloatArray, origin: FloatArray, cell: float, nx: int, ny: int, first: IntArray, members: IntArray
) -> int:
    """List for each cell of a grid the walls whose box is within reach of it; return how many in all.

    Called first with an empty `members`, to count; `first`, shape (nx ny + 1,), is filled both times.
    """
    first[:] = 0
    for fill in range(2):
        for w in range(walls.shape[0]):
            low_x = int(np.floor((min(walls[w, 0, 0], walls[w, 1, 0]) - REACH - origin[0]) / cell))
            high_x = int(np.floor((max(walls[w, 0, 0], walls[w, 1, 0]) + REACH - origin[0]) / cell))
            low_y = int(np.floor((min(walls[w, 0, 1], walls[w, 1, 1]) - REACH - origin[1]) / cell))
            high_y = int(np.floor((max(walls[w, 0, 1], walls[w, 1, 1]) + REACH - origin[1]) / cell))
            for iy in range(max(low_y, 0), min(high_y, ny - 1) + 1):
                for ix in range(max(low_x, 0), min(high_x, nx - 1) + 1):
                    if fill == 0:
                        first[iy * nx + ix + 1] += 1
                    else:
                        members[first[iy * nx + ix]] = w
                        first[iy * nx + ix] += 1
        if fill == 0:
            for at in range(nx * ny):
                first[at + 1] += first[at]
            if members.shape[0] < first[nx * ny]:
                return int(first[nx * ny])
    first[1:] = first[:-1].copy()
    first[0] = 0
    return int(first[nx * ny])


@njit(cache=True, inline="always")
def _cell_of(x: float, y: float, near: Surroundings) -> int:
    ix = min(max(int((x - near.origin[0]) / near.cell), 0), near.nx - 1)
    iy = min(max(int((y - near.origin[1]) / near.cell), 0), near.ny - 1)
    return iy * near.nx + ix


@njit(cache=True, inline="always")
def _meets_near(ax: float, ay: float, bx: float, by: float, near: Surroundings) -> bool:
    """Tell whether the segment a-b meets a wall."""
    meets, walls = False, near.walls
    # No place of the segment is farther than the reach from one at which the lists are looked up.
    parts = max(int(max(abs(bx - ax), abs(by - ay)) / REACH) + 1, 1)
    for part in range(parts):
        cell = _cell_of(ax + part / parts * (bx - ax), ay + part / parts * (by - ay), near)
        for at in range(near.first[cell], near.first[cell + 1]):
            w = near.members[at]
            if segments_meet(ax, ay, bx, by, walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1]):
                meets = True
                break
        if meets:
            break
    return meets


@njit(cache=True)
def edges_are_free(points: FloatArray, first: int, near: Surroundings) -> bool:
    """Tell whether no wall meets the track, shape (n, 2), from a sample on."""
    for i in range(first, points.shape[0] - 1):
        if _meets_near(points[i, 0], points[i, 1], points[i + 1, 0], points[i + 1, 1], near):
            return False
    return True


@njit(cache=True)
def _from_wall(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> tuple[float, float]:
    """Return the vector from the nearest point of a wall a-b to (x, y)."""
    ex, ey = bx - ax, by - ay
    t = ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)
    t = min(max(t, 0.0), 1.0)
    return x - ax - t * ex, y - ay - t * ey


@njit(cache=True)
def add_row(n: int, wanted: float, weight: float, rows: Rows) -> int:
    """Close row n, with a limit on what one step shall do; return the number of the next."""
    rows.wanted[n] = min(wanted, LONGEST_MOVE)
    rows.weight[n] = weight
    return n + 1


@njit(cache=True)
def sample_rows(points: FloatArray, fixed: int, near: Surroundings, margin: float, n: int, rows: Rows) -> int:
    """Write as rows that each sample from `fixed` on keeps a margin from the nearest wall on both sides."""
    walls = near.walls
    for i in range(fixed, points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        cell = _cell_of(x, y, near)
        ox, oy = 0.0, 0.0
        for _ in range(2):
            best, bx, by = REACH * REACH, 0.0, 0.0
            for at in range(near.first[cell], near.first[cell + 1]):
                w = near.members[at]
                dx, dy = _from_wall(x, y, walls[w, 0, 0], walls[w, 0, 1], walls[w, 1, 0], walls[w, 1, 1])
                if dx * dx + dy * dy < best and dx * ox + dy * oy <= 0.0:
                    best, bx, by = dx * dx + dy * dy, dx, dy
            if bx == 0.0 and by == 0.0:
                break
            size = np.sqrt(best)
            ox, oy = bx / size, by / size
            rows.samples[n, :] = -1
            rows.samples[n, 0] = i
            rows.factor[n, 0, 0], rows.factor[n, 0, 1] = ox, oy
            n = add_row(n, margin - size, 1.0, rows)
    return n


@njit(cache=True)
def longest_edge(points: FloatArray, first: int) -> float:
    """Return a little more than the longest distance between two samples in a row, from a sample on."""
    longest = 1e-9
    for i in range(first, points.shape[0] - 1):
        ex, ey = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        longest = max(longest, ex * ex + ey * ey)
    return float(1.001 * np.sqrt(longest))


@njit(cache=True)
def edge_rows(points: FloatArray, fixed: int, near: Surroundings, margin: float, n: int, rows: Rows) -> int:
    """Write as rows that the track between two samples does not cut a corner."""
    longest = longest_edge(points, fixed - 1)
    for c in range(near.corners.shape[0]):
        x, y = near.corners[c, 0], near.corners[c, 1]
        i = fixed - 2
        while i + 2 < points.shape[0]:
            i += 1
            ax, ay = x - points[i, 0], y - points[i, 1]
            if abs(ax) > REACH or abs(ay) > REACH:
                # Samples are no farther apart than `longest`: those that cannot be near yet are left out.
                i += max(int((max(abs(ax), abs(ay)) - REACH) / longest) - 1, 0)
                continue
            ex, ey = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
            squared = ex * ex + ey * ey
            t = (ax * ex + ay * ey) / squared
            if t <= 0.0 or t >= 1.0:
                continue
            size = np.sqrt(squared)
            nx, ny = -ey / size, ex / size
            if nx * near.outward[c, 0] + ny * near.outward[c, 1] < 0.0:
                nx, ny = -nx, -ny
            away = -(nx * ax + ny * ay)
            if away < -SLIP * size:
                continue
            if n == rows.wanted.shape[0]:
                return n
            rows.samples[n, :] = -1
            rows.samples[n, 0], rows.samples[n, 1] = i, i + 1
            rows.factor[n, 0, 0], rows.factor[n, 0, 1] = (1.0 - t) * nx, (1.0 - t) * ny
            rows.factor[n, 1, 0], rows.factor[n, 1, 1] = t * nx, t * ny
            n = add_row(n, margin - away, 1.0, rows)
    return n


@njit(cache=True)
def apply_move(
    points: FloatArray, normals: FloatArray, fixed: int, move: FloatArray, near: Surroundings, new: FloatArray
) -> None:
    """Move the samples from `fixed` on along their normals, none through a wall.

    `new`, shape (n, 2), is filled, and is as free as the track was.
    """
    n = points.shape[0]
    new[:fixed] = points[:fixed]
    for i in range(fixed, n):
        size = min(max(move[i - fixed], -LONGEST_MOVE), LONGEST_MOVE)
        for halving in range(HALVINGS + 1):
            if halving == HALVINGS or not np.isfinite(size):
                size = 0.0
            new[i, 0] = points[i, 0] + size * normals[i, 0]
            new[i, 1] = points[i, 1] + size * normals[i, 1]
            if not _meets_near(points[i, 0], points[i, 1], new[i, 0], new[i, 1], near):
                break
            size *= 0.5
    # Both ends of an edge may be free and the edge not: take the ends back halfway, and in the end wholly.
    for number in range(HALVINGS + n):
        clean = True
        for i in range(fixed - 1, n - 1):
            if _meets_near(new[i, 0], new[i, 1], new[i + 1, 0], new[i + 1, 1], near):
                for k in (i, i + 1):
                    if new[k, 0] != points[k, 0] or new[k, 1] != points[k, 1]:
                        clean = False
                        if number < HALVINGS:
                            new[k, 0] = 0.5 * (new[k, 0] + points[k, 0])
                            new[k, 1] = 0.5 * (new[k, 1] + points[k, 1])
                        else:
                            new[k, 0], new[k, 1] = points[k, 0], points[k, 1]
        if clean:
            return
