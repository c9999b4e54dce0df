"""Kernels for methods that move an arm out of a straight feeder by forces and velocities.

Lengths are in link lengths and the base is the origin. Joints are counted from the tip: the tip is point 0,
joint i is i links behind it, and link i leads from joint i to point i - 1. So joint i is `feed - i` past the
base, and the number of a joint does not change as the arm comes out.

A state holds the feed and, at place i, the angle of joint i. As the feeder wants it, a joint that has not
passed the base is straight, and one that has may bend as far as `RELEASE` times the way past the base.

The coordinates that can move are the feed (0) and the joints 1 to k past the base. Pushing the feed moves
every point along the axis, and turning joint a moves the points of links 1 to a around it; everything below
follows from this one Jacobian J.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.types import FloatArray, IntArray

RELEASE = 15.9
"""How far a joint may bend, in rad per link length past the base: just less than the environment allows."""


@njit(cache=True)
def place_points(state: FloatArray, heading: float, points: FloatArray) -> int:
    """Compute where the tip and the joints past the base are.

    Parameters
    ----------
    state : array, shape (n,)
        Feed, then joint angles from the tip's neighbour on.
    heading : float
        Of the feeder's axis, in rad.
    points : array, shape (n, 2)
        Filled up to point k; the tip first.

    Returns
    -------
    k : int
        The joint past the base that is nearest to it; 0 if only the tip is.

    Notes
    -----
    The caller guarantees a feed of less than n.
    """
    k = max(int(np.ceil(state[0])) - 1, 0)
    points[k, 0] = (state[0] - k) * np.cos(heading)
    points[k, 1] = (state[0] - k) * np.sin(heading)
    for i in range(k, 0, -1):
        heading += state[i]
        points[i - 1, 0] = points[i, 0] + np.cos(heading)
        points[i - 1, 1] = points[i, 1] + np.sin(heading)
    return k


@njit(cache=True)
def keep_limits(state: FloatArray, most_bent: float) -> None:
    """Clip joint angles to what the feeder and the joint limit allow at this feed."""
    for i in range(1, state.shape[0]):
        limit = min(RELEASE * max(state[0] - i, 0.0), most_bent)
        state[i] = min(max(state[i], -limit), limit)


@njit(cache=True)
def place_controls(
    state: FloatArray,
    points: FloatArray,
    k: int,
    heading: float,
    per_link: int,
    places: FloatArray,
    links: IntArray,
) -> int:
    """Spread control points evenly over the arm in front of the base, from the tip on.

    Parameters
    ----------
    state, points, k, heading
        As in `place_points`.
    per_link : int
        Control points of a link.
    places : array, shape (n per_link, 2)
        Filled with their places.
    links : array, shape (n per_link,)
        Filled with the link of each; k + 1 is the link that is partly in the feeder.

    Returns
    -------
    n : int
        Number of control points, at least the tip's.
    """
    n = 0
    while n < places.shape[0] and (n == 0 or n < state[0] * per_link):
        link = n // per_link + 1
        back = n / per_link - (link - 1)  # from the link's end, in link lengths
        if link <= k:
            for axis in range(2):
                end, start = points[link - 1, axis], points[link, axis]
                places[n, axis] = end + back * (start - end)
        else:
            places[n, 0] = points[k, 0] - back * np.cos(heading)
            places[n, 1] = points[k, 1] - back * np.sin(heading)
        links[n] = link
        n += 1
    return n


@njit(cache=True)
def add_torques(
    points: FloatArray,
    k: int,
    heading: float,
    places: FloatArray,
    links: IntArray,
    forces: FloatArray,
    n: int,
    torques: FloatArray,
) -> None:
    """Add the feed's force and the joints' torques that forces on points of the arm make: J^T F.

    Parameters
    ----------
    points, k, heading
        As in `place_points`.
    places, links
        Of `place_controls`; in ascending order of links.
    forces : array, shape (n, 2)
        On these places.
    n : int
        Number of places.
    torques : array, shape (at least k + 1,)
        Added to.
    """
    force_x, force_y, moment, done = 0.0, 0.0, 0.0, 0
    for a in range(1, k + 2):
        while done < n and (links[done] <= a or a == k + 1):
            force_x += forces[done, 0]
            force_y += forces[done, 1]
            moment += places[done, 0] * forces[done, 1] - places[done, 1] * forces[done, 0]
            done += 1
        if a <= k:
            torques[a] += moment - (points[a, 0] * force_y - points[a, 1] * force_x)
    torques[0] += force_x * np.cos(heading) + force_y * np.sin(heading)


@njit(cache=True)
def fill_drag(
    points: FloatArray,
    k: int,
    heading: float,
    places: FloatArray,
    links: IntArray,
    n: int,
    ridge: float,
    drag: FloatArray,
) -> None:
    """Compute what torques it takes to drag an arm's control points: J^T J, and a ridge on its diagonal.

    Parameters
    ----------
    points, k, heading, places, links, n
        As in `add_torques`.
    ridge : float
        Friction of the coordinates themselves, over that of a control point.
    drag : array, shape (at least k + 1, k + 1)
        Filled.
    """
    count, sum_x, sum_y, squares, done = 0.0, 0.0, 0.0, 0.0, 0
    cos, sin = np.cos(heading), np.sin(heading)
    drag[0, 0] = n + ridge
    for a in range(1, k + 1):
        while done < n and links[done] <= a:
            count += 1.0
            sum_x += places[done, 0]
            sum_y += places[done, 1]
            squares += places[done, 0] ** 2 + places[done, 1] ** 2
            done += 1
        # Points beyond joint a are beyond those behind it as well: their sums are all that is needed.
        ax, ay = points[a, 0], points[a, 1]
        drag[a, 0] = sin * (sum_x - count * ax) - cos * (sum_y - count * ay)
        drag[0, a] = drag[a, 0]
        for b in range(a, k + 1):
            bx, by = points[b, 0], points[b, 1]
            both = squares - (ax + bx) * sum_x - (ay + by) * sum_y + count * (ax * bx + ay * by)
            drag[a, b] = both
            drag[b, a] = both
        drag[a, a] += ridge


@njit(cache=True)
def _contact(
    px: float, py: float, wx: float, wy: float, link: int, reach: float, n: int, contacts: FloatArray
) -> tuple[int, float]:
    """Note the contact of a point of a link with the place of a wall that is nearest to it, if there is room.

    Returns the number of contacts, and the distance.
    """
    dx, dy = px - wx, py - wy
    gap = float(np.hypot(dx, dy))
    if gap >= reach or n == contacts.shape[0]:
        return n, gap
    scale = 1.0 / max(gap, 1e-12)
    contacts[n, 0], contacts[n, 1] = px, py
    contacts[n, 2], contacts[n, 3] = dx * scale, dy * scale
    contacts[n, 4], contacts[n, 5] = gap, link
    return n + 1, gap


@njit(cache=True)
def find_contacts(
    points: FloatArray, k: int, walls: FloatArray, reach: float, contacts: FloatArray
) -> tuple[int, float]:
    """Find where the links past the base are near to walls: exact distances.

    Parameters
    ----------
    points, k
        Of `place_points`.
    walls : array, shape (n_walls, 2, 2)
        Segments of closed rings, each of which ends where another starts.
    reach : float
        Greatest distance that counts.
    contacts : array, shape (n_max, 6)
        Filled: place on the link, unit vector away from the wall, distance, link.

    Returns
    -------
    n : int
        Number of contacts.
    least : float
        Smallest distance, also of contacts for which there was no room; 0 where a link crosses a wall;
        `reach` without contacts.
    """
    n, least = 0, reach
    for link in range(k, 0, -1):
        ax, ay = points[link, 0], points[link, 1]
        bx, by = points[link - 1, 0], points[link - 1, 1]
        ux, uy = bx - ax, by - ay
        for wall in range(walls.shape[0]):
            cx, cy = walls[wall, 0, 0], walls[wall, 0, 1]
            ex, ey = walls[wall, 1, 0], walls[wall, 1, 1]
            if min(cx, ex) > max(ax, bx) + reach or max(cx, ex) < min(ax, bx) - reach:
                continue
            if min(cy, ey) > max(ay, by) + reach or max(cy, ey) < min(ay, by) - reach:
                continue
            wx, wy = ex - cx, ey - cy
            # The end of the link against the wall; the other end belongs to the link behind.
            along = ((bx - cx) * wx + (by - cy) * wy) / max(wx * wx + wy * wy, 1e-300)
            if 0.0 <= along <= 1.0:
                n, gap = _contact(bx, by, cx + along * wx, cy + along * wy, link, reach, n, contacts)
                least = min(least, gap)
            # The wall's start against the link; its end is another wall's start.
            share = ux * (cx - ax) + uy * (cy - ay)
            if share > 0.0:
                share = min(share, 1.0)
                n, gap = _contact(ax + share * ux, ay + share * uy, cx, cy, link, reach, n, contacts)
                least = min(least, gap)
            of_c, of_e = ux * (cy - ay) - uy * (cx - ax), ux * (ey - ay) - uy * (ex - ax)
            of_a, of_b = wx * (ay - cy) - wy * (ax - cx), wx * (by - cy) - wy * (bx - cx)
            if of_c * of_e < 0.0 and of_a * of_b < 0.0:
                least = 0.0
    return n, least


@njit(cache=True)
def contact_row(contact: FloatArray, points: FloatArray, k: int, heading: float, row: FloatArray) -> None:
    """Compute how fast each coordinate opens a contact: the normal times J, shape (k + 1,)."""
    row[0] = contact[2] * np.cos(heading) + contact[3] * np.sin(heading)
    link = int(contact[5])
    for a in range(1, k + 1):
        row[a] = 0.0
        if a >= link:
            row[a] = (contact[0] - points[a, 0]) * contact[3] - (contact[1] - points[a, 1]) * contact[2]
