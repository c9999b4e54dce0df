"""Kernels of the sweep planner: one joint track, drawn vertex by vertex inside exact viable intervals.

All links follow one rule with one history, so every joint passes where the joint ahead of it has passed. The
track is a list of vertices; vertex n is the end of a link that starts at vertex `start[n]`, exactly one link
length away. A pose is a chain of starts from the tip's vertex down to the feeder's axis. Lengths are in maze
units, angles in rad.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.beam_rules import coordinate_at_length, nearest_index
from planners.kernels.rod import WHOLE_TURN, free_directions
from planners.kernels.types import BoolArray, FloatArray, IntArray

TWO_PI = 2.0 * np.pi

GOAL, DEAD_END, FULL, PAUSED = 0, 1, 2, 3
"""How a track ends: at the goal; where no direction stays free during the next link length of feed; full; not
yet, but for the number of vertices asked for."""

FASTEST = 1.9
"""Largest movement of the tip from vertex to vertex, in steps. Starts that go several vertices at once move
at most one step, so that there is room to turn meanwhile."""

MOST_WAITING = 4
"""Largest sum of turns in one place, in rad: a link that turns back and forth for longer never leaves."""

MOST_CREDIT = 0.3
"""Largest turn in place, in rad, that may be saved up while the arm is fed."""


@njit(cache=True)
def _apart(a: float, b: float, c: float, d: float) -> float:
    """Return the gap between the intervals (a, b) and (c, d) on the circle; 0 or less if they overlap."""
    offset = abs((0.5 * (a + b) - 0.5 * (c + d) + np.pi) % TWO_PI - np.pi)
    return offset - 0.5 * (b - a) - 0.5 * (d - c)


@njit(cache=True)
def _prune(
    low: int, high: int, first: IntArray, gaps: FloatArray, viable: BoolArray, slack: float, whole: bool
) -> None:
    """Take from vertices high - 1 down to low the intervals that lead to none at the next vertex.

    What is viable only ever shrinks as vertices are added, so unless `whole` is asked for the first vertex
    that loses nothing ends the work.
    """
    for j in range(high - 1, low - 1, -1):
        changed = False
        for r in range(first[j], first[j + 1]):
            if not viable[r]:
                continue
            leads_on = False
            for q in range(first[j + 1], first[j + 2]):
                if viable[q] and _apart(gaps[r, 0], gaps[r, 1], gaps[q, 0], gaps[q, 1]) <= slack:
                    leads_on = True
                    break
            if not leads_on:
                viable[r] = False
                changed = True
        if not changed and not whole:
            return


@njit(cache=True)
def _nearest_viable(
    vertex: int, direction: float, first: IntArray, gaps: FloatArray, viable: BoolArray
) -> tuple[int, float]:
    """Return the viable interval of a vertex nearest to a direction (-1 if none), and how far off it is."""
    best, best_away = -1, np.inf
    for r in range(first[vertex], first[vertex + 1]):
        if viable[r]:
            away = _apart(gaps[r, 0], gaps[r, 1], direction, direction)
            if away < best_away:
                best, best_away = r, away
    return best, best_away


@njit(cache=True)
def _into(direction: float, near: float, start: float, end: float) -> float:
    """Clamp a direction into an interval, moved by whole turns so that it is beside `near`.

    Where nothing is in the way, the interval is a whole turn, and its ends mean nothing.
    """
    if end - start >= WHOLE_TURN:
        return direction
    turns = TWO_PI * np.round((near - 0.5 * (start + end)) / TWO_PI)
    clamped: float = min(max(direction, start + turns), end + turns)
    return clamped


@njit(cache=True)
def _chain_may_move(
    a: int, b: int, track: FloatArray, start: IntArray, straight: int, largest: float
) -> bool:
    """Tell whether no joint moves too far when a link's start goes from vertex a to vertex b.

    Vertices up to `straight` are the feeder's axis and the first link in front of it. No joint may step over
    the last of them: a pose in which that link is still straight belongs between.
    """
    half = straight // 2
    while True:
        if a < straight < b:
            return False
        if (track[a, 0] - track[b, 0]) ** 2 + (track[a, 1] - track[b, 1]) ** 2 > largest * largest:
            return False
        if a == b or b <= straight or a < half:
            return True
        a, b = start[a], start[b]


@njit(cache=True)
def _advance(
    s: int,
    current: int,
    newest: int,
    track: FloatArray,
    start: IntArray,
    first: IntArray,
    gaps: FloatArray,
    viable: BoolArray,
    straight: int,
    largest: float,
    slack: float,
    reached: BoolArray,
    reached_next: BoolArray,
) -> int:
    """Find the furthest vertex to which a link's start may go in one step, at least the next one.

    `reached` is filled with which intervals of that vertex are joined to the `current` one of s through
    viable intervals; s itself is returned if there are none.
    """
    reached[:] = False
    reached[current - first[s]] = True
    j = s
    while j < newest:
        if j > s and not _chain_may_move(s, j + 1, track, start, straight, largest):
            break
        any_reached = False
        reached_next[:] = False
        for q in range(first[j + 1], first[j + 2]):
            if not viable[q]:
                continue
            for r in range(first[j], first[j + 1]):
                if reached[r - first[j]] and _apart(gaps[r, 0], gaps[r, 1], gaps[q, 0], gaps[q, 1]) <= slack:
                    reached_next[q - first[j + 1]] = True
                    any_reached = True
                    break
        if not any_reached:
            break
        reached[:] = reached_next
        j += 1
    return j


@njit(cache=True)
def _nearest_reached(
    vertex: int, direction: float, first: IntArray, gaps: FloatArray, reached: BoolArray
) -> int:
    best, best_away = -1, np.inf
    for r in range(first[vertex], first[vertex + 1]):
        if reached[r - first[vertex]]:
            away = _apart(gaps[r, 0], gaps[r, 1], direction, direction)
            if away < best_away:
                best, best_away = r, away
    return best


@njit(cache=True)
def _add_gaps(
    n: int,
    track: FloatArray,
    heading: float,
    joint_limit: float,
    free: bool,
    length: float,
    walls: FloatArray,
    pad: float,
    first: IntArray,
    gaps: FloatArray,
    viable: BoolArray,
    blocked: FloatArray,
    found: FloatArray,
) -> bool:
    """Store the free intervals of vertex n, within the joint limit about the heading of the link up to it.

    Where no link will ever start (`free`) all directions are. False if there is no room to store them.
    """
    n_found = 1
    if free:
        found[0, 0], found[0, 1] = heading - np.pi, heading + np.pi
    else:
        n_found = free_directions(track[n, 0], track[n, 1], length, walls, pad, blocked, found)
    place = first[n]
    for k in range(n_found):
        begin, end = found[k, 0], found[k, 1]
        if end - begin >= WHOLE_TURN:
            begin, end = heading - np.pi, heading + np.pi
        if joint_limit < np.pi and not free:
            turns = TWO_PI * np.round((heading - 0.5 * (begin + end)) / TWO_PI)
            begin = max(begin + turns, heading - joint_limit)
            end = min(end + turns, heading + joint_limit)
            if begin >= end:
                continue
        if place >= gaps.shape[0]:
            return False
        gaps[place, 0], gaps[place, 1] = begin, end
        viable[place] = True
        place += 1
    first[n + 1] = place
    return True


@njit(cache=True)
def _turn_range(
    track: FloatArray, s: int, origin: int, heading: float, length: float, step: float
) -> tuple[float, float]:
    """Return the least and the largest turn with which the end of a link moves at most `step`.

    Its start goes from vertex s to `origin`, which are at most a step apart. So by induction neighbouring
    vertices are nowhere farther apart, and joints that follow one another along the track do not move ever
    faster.
    """
    vx, vy = track[origin, 0] - track[s, 0], track[origin, 1] - track[s, 1]
    across = vy * np.cos(heading) - vx * np.sin(heading)
    half = np.sqrt(max(step * step - vx * vx - vy * vy + across * across, 0.0))
    # No turn at all is always allowed, whatever rounding says.
    return min((-across - half) / length, 0.0), max((-across + half) / length, 0.0)


@njit(cache=True)
def _lay_axis(
    per_link: int,
    joint_limit: float,
    base_pose: FloatArray,
    length: float,
    points: FloatArray,
    rest: FloatArray,
    reach: int,
    walls: FloatArray,
    pad: float,
    track: FloatArray,
    start: IntArray,
    headings: FloatArray,
    indices: IntArray,
    first: IntArray,
    gaps: FloatArray,
    viable: BoolArray,
    blocked: FloatArray,
    found: FloatArray,
) -> bool:
    """Fill the vertices on the feeder's axis, to one link length in front of the base."""
    index, step = 0, length / per_link
    first[0] = 0
    for i in range(2 * per_link + 1):
        along = (i - per_link) * step
        track[i, 0] = base_pose[0] + along * np.cos(base_pose[2])
        track[i, 1] = base_pose[1] + along * np.sin(base_pose[2])
        start[i] = i - per_link
        headings[i] = base_pose[2]
        first[i + 1] = first[i]
        if i >= per_link:
            index = nearest_index(points, track[i, 0], track[i, 1], index, reach)
            if not _add_gaps(
                i, track, base_pose[2], joint_limit, rest[index] < length, length, walls, pad, first, gaps,
                viable, blocked, found,
            ):  # fmt: skip
                return False
        indices[i] = index
    return True


@njit(cache=True)
def grow_track(
    length: float,
    joint_limit: float,
    base_pose: FloatArray,
    goal: FloatArray,
    goal_radius: float,
    points: FloatArray,
    rest: FloatArray,
    aim_line: FloatArray,
    reach: int,
    walls: FloatArray,
    per_link: int,
    overlap: float,
    pad: float,
    softening: float,
    resumed: int,
    most: int,
    track: FloatArray,
    start: IntArray,
    headings: FloatArray,
    indices: IntArray,
    credits: FloatArray,
    waits: IntArray,
    first: IntArray,
    gaps: FloatArray,
    viable: BoolArray,
) -> tuple[int, int]:
    """Draw the joint track from the feeder to the goal.

    Every link aims its end at a line along the path that swings to the outer walls at corners, clamped into
    the intervals of directions that stay free during the next link length of feed. The feed waits while a
    link turns.

    Parameters
    ----------
    length, joint_limit : float
        Of the links.
    base_pose : array, shape (3,)
        Base position and heading.
    goal : array, shape (2,)
        Where the tip shall go.
    goal_radius : float
        The tip shall come this near.
    points, aim_line : array, shape (n, 2)
        The path, and the line that links aim at.
    rest : array, shape (n,)
        Arclength from each path point to the goal.
    reach : int
        How far, in path points, the closest point may move along the path from vertex to vertex.
    walls : array, shape (n_walls, 2, 2)
        Wall segments.
    per_link : int
        Vertices per link length; the largest turn from vertex to vertex is one over it, in rad.
    overlap : float
        Intervals at neighbouring vertices count as joined within this part of the largest turn between them.
        Much of it lets a link hop over a thin wall; exact overlap loses length, as thin intervals drift
        faster than they are wide.
    pad : float
        Kept from the walls, in rad.
    softening : float
        Turn in place that a link length of feed allows, in rad.
    resumed : int
        Number of vertices of the arrays that are filled already, by a run that differs from here on; 0 for
        none, otherwise more than the straight ones.
    most : int
        Number of vertices at which to pause.
    track : array, shape (n_max, 2)
        Filled with the vertices: first the axis from a link length behind the base to one in front of it.
    start, headings, indices : array, shape (n_max,)
        Filled for each vertex: where its link starts, its heading, the closest path point.
    credits, waits : array, shape (n_max,)
        Filled for each vertex: the turn in place that is saved up there, in rad, and for how many vertices
        the feed has waited.
    first : array, shape (n_max + 2,)
        Filled: place of each vertex's first free interval in `gaps`.
    gaps : array, shape (n_gaps_max, 2)
        Filled with free intervals.
    viable : array, shape (n_gaps_max,)
        Filled: whether an interval stays joined to one of the newest vertex.

    Returns
    -------
    n, ending : int
        Number of vertices, and one of GOAL, DEAD_END, FULL and PAUSED.
    """
    step, turn = length / per_link, 1.0 / per_link
    slack = overlap * turn
    straight = 2 * per_link
    n_gaps = walls.shape[0] + 1
    blocked, found = np.empty((n_gaps, 2)), np.empty((n_gaps, 2))
    reached, reached_next = np.zeros(n_gaps, dtype=np.bool_), np.zeros(n_gaps, dtype=np.bool_)
    before = np.empty_like(viable)
    turns = np.array([0.0, 1.0, -1.0, 0.5, -0.5, 0.25, -0.25])
    if resumed == 0:
        n = straight + 1
        if not _lay_axis(
            per_link, joint_limit, base_pose, length, points, rest, reach, walls, pad, track, start, headings,
            indices, first, gaps, viable, blocked, found,
        ):  # fmt: skip
            return n, FULL
        credits[:n], waits[:n] = 0.0, 0
    else:
        n = resumed
    s, heading, credit, waited = start[n - 1], headings[n - 1], credits[n - 1], waits[n - 1]
    viable[first[s] : first[n]] = True
    _prune(s, n - 1, first, gaps, viable, slack, True)
    last_distance = np.inf
    while n < min(most, track.shape[0]):
        distance = np.hypot(track[n - 1, 0] - goal[0], track[n - 1, 1] - goal[1])
        if distance <= 0.5 * goal_radius:
            return n, GOAL
        if last_distance < distance and last_distance <= goal_radius:
            return n - 1, GOAL
        last_distance = distance
        current, away = _nearest_viable(s, heading, first, gaps, viable)
        if current < 0 or away > 2.0 * turn:
            return n, DEAD_END
        ahead = _advance(
            s, current, n - 1, track, start, first, gaps, viable, straight, step, slack, reached, reached_next
        )
        if ahead == s:
            return n, DEAD_END
        joined = _nearest_reached(ahead, heading, first, gaps, reached)
        needed = _into(heading, heading, gaps[joined, 0], gaps[joined, 1])
        px, py = track[ahead, 0], track[ahead, 1]
        hit, wanted = coordinate_at_length(aim_line, px, py, indices[ahead], length)
        if hit < 0:
            last = aim_line.shape[0] - 1
            wanted = np.arctan2(aim_line[last, 1] - py, aim_line[last, 0] - px)
        wanted = heading + (wanted - heading + np.pi) % TWO_PI - np.pi
        wanted = _into(wanted, heading, gaps[joined, 0], gaps[joined, 1])
        in_place = True
        least, most_turn = _turn_range(track, s, ahead, heading, length, FASTEST * step)
        if needed - heading < least - 1e-9 or needed - heading > most_turn + 1e-9:
            change = min(max(needed - heading, -turn), turn)
        elif abs(wanted - heading) > turn and credit >= turn:
            change = min(max(wanted - heading, -turn), turn)
            credit -= turn
        else:
            in_place = False
            change = min(max(wanted - heading, -turn), turn)
        accepted = False
        origin, interval = (s, current) if in_place else (ahead, joined)
        if in_place:
            least, most_turn = -turn, turn
        new = heading
        for r in range(first[s], first[n]):
            before[r] = viable[r]
        for k in range(turns.shape[0]):  # first the step as it is chosen, then with other turns
            aimed = change if k == 0 else turns[k] * turn
            aimed = heading + min(max(aimed, least), most_turn)
            new = _into(aimed, heading, gaps[interval, 0], gaps[interval, 1])
            if new - heading < least - 1e-9 or new - heading > most_turn + 1e-9:
                continue
            if in_place and abs(new - heading) < 1e-12:
                continue
            if rest[indices[origin]] < length:
                # No link was expected to start here, so what is free was not looked at.
                n_found = free_directions(
                    track[origin, 0], track[origin, 1], length, walls, pad, blocked, found
                )
                inside = False
                for j in range(n_found):
                    inside |= _apart(found[j, 0], found[j, 1], new, new) <= 1e-12
                inside &= abs(new - headings[origin]) <= joint_limit
                if not inside:
                    continue
            track[n, 0] = track[origin, 0] + length * np.cos(new)
            track[n, 1] = track[origin, 1] + length * np.sin(new)
            index = nearest_index(points, track[n, 0], track[n, 1], indices[n - 1], reach)
            if not _add_gaps(
                n, track, new, joint_limit, rest[index] < length, length, walls, pad, first, gaps, viable,
                blocked, found,
            ):  # fmt: skip
                return n, FULL
            _prune(origin, n, first, gaps, viable, slack, False)
            held, off = _nearest_viable(origin, new, first, gaps, viable)
            if held >= 0 and off <= 1e-9:
                accepted = True
                break
            for r in range(first[s], first[n]):  # what the rejected vertex has pruned is viable again
                viable[r] = before[r]
        if not accepted:
            return n, DEAD_END
        waited = waited + 1 if in_place else 0
        if waited > MOST_WAITING * per_link:
            return n, DEAD_END
        if not in_place:
            moved = np.hypot(track[origin, 0] - track[s, 0], track[origin, 1] - track[s, 1])
            credit = min(credit + softening * moved / length, MOST_CREDIT)
        start[n], headings[n], indices[n], credits[n], waits[n] = origin, new, index, credit, waited
        s, heading = origin, new
        n += 1
    return n, FULL if n == track.shape[0] else PAUSED


@njit(cache=True)
def _chain_may_turn(a: int, b: int, start: IntArray, headings: FloatArray, half: int, most: float) -> bool:
    """Tell whether the squared turns of all links, with the tip going from vertex a to b, sum up to `most`.

    With linear joint angles in between, joints leave their chords by at most an eighth of that sum, in link
    lengths.
    """
    total = 0.0
    while b > half and a != b:
        total += (headings[b] - headings[max(a, 0)]) ** 2
        if total > most:
            return False
        a, b = start[max(a, 0)], start[b]
    return True


@njit(cache=True)
def thin_track(
    n: int,
    track: FloatArray,
    start: IntArray,
    headings: FloatArray,
    per_link: int,
    largest: float,
    most: float,
    kept: IntArray,
) -> int:
    """Choose tip vertices for poses so that no joint moves far from pose to pose.

    Any choice is a motion of exact chords. No joint moves farther than `largest`, and the squared turns of
    the links sum up to at most `most`, in rad^2. The poses in which a joint is just at the base, and its
    link still straight, are kept: the feeder's rule needs them.

    Returns
    -------
    n_kept : int
        Number of entries of `kept`, shape (n,), that are filled.
    """
    straight = 2 * per_link
    n_kept, at = 1, per_link
    kept[0] = per_link
    while at < n - 1:
        step = at + 1
        while (
            step + 1 < n
            and _chain_may_move(at, step + 1, track, start, straight, largest)
            and _chain_may_turn(at, step + 1, start, headings, per_link, most)
        ):
            step += 1
        kept[n_kept] = step
        n_kept += 1
        at = step
    return n_kept


@njit(cache=True)
def pose_joints(
    kept: IntArray,
    track: FloatArray,
    start: IntArray,
    per_link: int,
    length: float,
    base_pose: FloatArray,
    joints: FloatArray,
) -> None:
    """Fill the joint positions of poses, shape (n_poses, n_links + 1, 2), from the tips' vertices.

    Notes
    -----
    The caller guarantees enough links for the longest chain.
    """
    cos, sin = np.cos(base_pose[2]), np.sin(base_pose[2])
    for pose in range(kept.shape[0]):
        vertex = kept[pose]
        k = joints.shape[1] - 1
        while True:
            joints[pose, k, 0], joints[pose, k, 1] = track[vertex, 0], track[vertex, 1]
            if vertex <= per_link:
                break
            vertex = start[vertex]
            k -= 1
        axial = (vertex - per_link) * (length / per_link)
        for behind in range(k - 1, -1, -1):
            axial -= length
            joints[pose, behind, 0] = base_pose[0] + axial * cos
            joints[pose, behind, 1] = base_pose[1] + axial * sin


@njit(cache=True)
def chain_length(vertex: int, start: IntArray, per_link: int) -> int:
    """Count the links of the pose whose tip is at a vertex, down to the one that comes out of the feeder."""
    n = 0
    while vertex > per_link:
        vertex = start[vertex]
        n += 1
    return n


@njit(cache=True)
def blocked_chords(line: FloatArray, length: float, walls: FloatArray, blocked: BoolArray) -> None:
    """Tell for each point of a line whether a link from it to the line meets a wall.

    It ends at the next place at distance `length`, or near the end, where there is none, at the last point.

    Parameters
    ----------
    line : array, shape (n, 2)
        From base to goal.
    length : float
        Of the link.
    walls : array, shape (n_walls, 2, 2)
        Segments.
    blocked : array, shape (n,)
        Filled.
    """
    for i in range(line.shape[0]):
        px, py = line[i, 0], line[i, 1]
        hit, heading = coordinate_at_length(line, px, py, i, length)
        qx, qy = line[-1, 0], line[-1, 1]
        if hit >= 0:
            qx, qy = px + length * np.cos(heading), py + length * np.sin(heading)
        blocked[i] = False
        for k in range(walls.shape[0]):
            ax, ay, bx, by = walls[k, 0, 0], walls[k, 0, 1], walls[k, 1, 0], walls[k, 1, 1]
            if max(ax, bx) < min(px, qx) or min(ax, bx) > max(px, qx):
                continue
            if max(ay, by) < min(py, qy) or min(ay, by) > max(py, qy):
                continue
            first = (qx - px) * (ay - py) - (qy - py) * (ax - px)
            second = (qx - px) * (by - py) - (qy - py) * (bx - px)
            third = (bx - ax) * (py - ay) - (by - ay) * (px - ax)
            fourth = (bx - ax) * (qy - ay) - (by - ay) * (qx - ax)
            if first * second <= 0.0 and third * fourth <= 0.0:
                blocked[i] = True
                break
