"""Where the track planner starts from: a free line from base to goal that begins with the feeder's axis."""

from __future__ import annotations

import math

import numpy as np

from planners.kernels import track as kernel
from planners.kernels.types import FloatArray, IntArray
from planners.problem import Motion
from planners.track_scene import Scene

__all__ = ["start_from_motion", "start_from_path", "with_axis"]

AXIS_END = np.array([1.0, 0.0])
"""One link length in front of the base, in link lengths."""

NEAREST_JOINT, FARTHEST_JOINT = 0.7, 3.0
"""Where along a path the axis may join it, in link lengths."""

CANDIDATES = 60
"""Places at which joining a line is tried."""

COST_OF_LENGTH = 0.1
"""What skipping a link length of line costs, against turning by a rad."""

OFFSET = 0.02
"""How far from a wall a line is led round it, in link lengths."""

LONGEST_SKIP = 3.0
"""How much of a line may be given up to join its end to a goal that has moved, in link lengths."""


def start_from_path(scene: Scene, path: FloatArray) -> FloatArray:
    """Join the end of the feeder's axis to a path, shape (n, 2), where both turns are small.

    Parameters
    ----------
    scene : Scene
        The maze.
    path : array, shape (n, 2)
        Free, from base to goal, in link lengths.

    Returns
    -------
    line : array, shape (m, 2)
        Free; begins at the end of the axis.
    """
    s = _arclength(path)
    first, last = np.minimum(np.searchsorted(s, [NEAREST_JOINT, FARTHEST_JOINT]), len(path) - 1)
    index = _joint(scene, AXIS_END, AXIS_END, path, _spread(int(first), int(last)), s)
    return np.concatenate([[AXIS_END], path[len(path) - 1 if index is None else index :]])


def start_from_motion(scene: Scene, motion: Motion) -> FloatArray | None:
    """Make the joint track of a motion in another maze free again, and lead it to the goal.

    Parameters
    ----------
    scene : Scene
        The maze.
    motion : Motion
        Of the same links; the way of its tip is its joint track.

    Returns
    -------
    line : array, shape (m, 2), or None
        Free; begins at the end of the axis. None if that is not to be had nearby.
    """
    track = scene.scaled(motion.joints[:, -1])
    line = track[_arclength(track) > 1.0 + 1e-6]
    if not len(line):
        return None
    free = _led_round(scene, np.concatenate([[AXIS_END], line]))
    return None if free is None else _led_to_goal(scene, free)


def with_axis(line: FloatArray, per_link: int) -> FloatArray:
    """Sample a line evenly and put the feeder's axis in front of it."""
    n = max(2, round(float(_arclength(line)[-1]) * per_link)) + 1
    samples = np.empty((n, 2))
    kernel.resample(line, samples)
    axis = np.column_stack([np.arange(per_link) / per_link, np.zeros(per_link)])
    return np.concatenate([axis, samples])


def _arclength(line: FloatArray) -> FloatArray:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])


def _spread(first: int, last: int) -> IntArray:
    """Return at most `CANDIDATES` indices from first to last, both included."""
    return np.unique(np.linspace(first, last, CANDIDATES).astype(np.int64))


def _joint(
    scene: Scene,
    point: FloatArray,
    heading: FloatArray | None,
    line: FloatArray,
    index: IntArray,
    s: FloatArray,
) -> int | None:
    """Find the place of a line, among those of `index`, to which a straight step from a point turns least."""
    best, best_cost = None, math.inf
    for k in index:
        step = line[k] - point
        ahead = line[min(k + 2, len(line) - 1)] - line[max(k - 2, 0)]
        cost = abs(_turn(step, ahead)) + COST_OF_LENGTH * float(s[k])
        cost += 0.0 if heading is None else abs(_turn(heading, step))
        if cost < best_cost and np.hypot(*step) > 0.1 and scene.sees(point, line[k]):
            best, best_cost = int(k), cost
    return best


def _turn(a: FloatArray, b: FloatArray) -> float:
    return math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b))


def _led_to_goal(scene: Scene, line: FloatArray) -> FloatArray | None:
    """Lead the end of a line to the goal, from the place from which that turns least."""
    if np.hypot(*(line[-1] - scene.goal)) <= scene.goal_radius:
        return line
    backward = line[::-1]
    s = _arclength(backward)
    last = min(int(np.searchsorted(s, LONGEST_SKIP)), len(line) - 1)
    index = _joint(scene, scene.goal, None, backward, _spread(0, last), s)
    return None if index is None else np.concatenate([line[: len(line) - index], [scene.goal]])


def _led_round(scene: Scene, line: FloatArray) -> FloatArray | None:
    """Lead a line round the walls in its way, each on the shorter side; None if one leads into the next."""
    meetings = _meetings(scene, line)
    if len(meetings) % 2:
        return None
    pieces, done = [], 0
    for (edge, ring, vertex, _), (edge_out, ring_out, vertex_out, _) in zip(
        meetings[::2], meetings[1::2], strict=True
    ):
        if ring != ring_out:
            return None
        pieces += [line[done : edge + 1], _round_ring(scene, ring, vertex, vertex_out)]
        done = edge_out + 1
    led = np.concatenate([*pieces, line[done:]])
    return led if not meetings or not _meetings(scene, led) else None


def _meetings(scene: Scene, line: FloatArray) -> list[tuple[int, int, int, float]]:
    """Find where a line meets the walls: edge of the line, ring, edge of the ring, place on the line's."""
    found = []
    a, along = line[:-1, None], np.diff(line, axis=0)[:, None]
    for number, ring in enumerate(scene.rings):
        if (ring.max(axis=0) < line.min(axis=0)).any() or (ring.min(axis=0) > line.max(axis=0)).any():
            continue
        start, wall = ring[None], (np.roll(ring, -1, axis=0) - ring)[None]
        cross = along[..., 0] * wall[..., 1] - along[..., 1] * wall[..., 0]
        cross = np.where(cross == 0.0, np.inf, cross)
        offset = start - a
        t = (offset[..., 0] * wall[..., 1] - offset[..., 1] * wall[..., 0]) / cross
        u = (offset[..., 0] * along[..., 1] - offset[..., 1] * along[..., 0]) / cross
        for edge, vertex in np.argwhere((t >= 0.0) & (t < 1.0) & (u >= 0.0) & (u < 1.0) & np.isfinite(cross)):
            found.append((int(edge), number, int(vertex), float(t[edge, vertex])))
    return sorted(found, key=lambda meeting: (meeting[0], meeting[3]))


def _round_ring(scene: Scene, ring: int, first: int, last: int) -> FloatArray:
    """Walk along a ring from its edge `first` to its edge `last`, the shorter way, beside its vertices."""
    vertices = scene.rings[ring]
    n = len(vertices)
    forward = (first + 1 + np.arange((last - first) % n)) % n
    backward = (first - np.arange((first - last) % n)) % n
    ways = [(vertices + OFFSET * scene.outward[ring])[way] for way in (forward, backward)]
    lengths = [float(_arclength(vertices[way])[-1]) if len(way) else 0.0 for way in (forward, backward)]
    return ways[0] if lengths[0] <= lengths[1] else ways[1]
