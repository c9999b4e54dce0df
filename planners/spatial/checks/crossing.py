"""The arm against itself, at poses and between them."""

from __future__ import annotations

import math

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.checks.tolerances import ROUNDING
from planners.problem import Fault, Progress
from planners.spatial.checks.scene import (
    MAX_PIECES,
    MAX_SPLITS,
    IntArray,
    Scene,
    halves,
    joint_fault,
    point_of,
    slices,
    worst_of,
)

__all__ = ["check_crossing", "segment_distances"]

BLOCK = 8
"""Steps over which links are first compared by their middles."""

Meeting = tuple[float, int, int, int, float]
"""Distance, step, both links, time after the step."""


def check_crossing(scene: Scene, tell: Progress) -> Fault | None:
    """Check that links that are not neighbours keep apart, by distances at the ends of ever shorter times.

    A point of a link that moves along a way c is at most t * c + e from its place at the first time and at
    most (1 - t) * c + e from its place at the last, so the mean of the two distances, less half of both ways
    and both e, bounds the distance within.
    """
    motion = scene.motion
    amount, pose, joint = worst_of(np.hypot(motion.joint_angles[..., 0], motion.joint_angles[..., 1]))
    if amount >= math.pi - ROUNDING:
        behind = f"link {joint - 1}" if joint else "the feeder"
        message = f"Link {joint} lies folded back on {behind} at pose {pose}."
        return joint_fault(scene, "crossing", message, pose, joint, 0.0)
    n_steps = motion.n_poses - 1
    if n_steps == 0:
        pairs = _at_single_pose(scene)
        found = _first_meeting(scene, *pairs, at=np.zeros((len(pairs[0]), 2)))
        return None if found is None else _crossing_fault(scene, *found)
    first, second = np.triu_indices(motion.n_links, 2)
    for part in slices(n_steps, math.ceil(len(first) / BLOCK)):
        found = _first_meeting(scene, *_pairs_in_sight(scene, part, first, second))
        if found is not None:
            return _crossing_fault(scene, *found)
        tell("validate", 0.8 + 0.2 * part.stop / n_steps)
    return None


def segment_distances(
    start: FloatArray, end: FloatArray, other_start: FloatArray, other_end: FloatArray
) -> FloatArray:
    """Compute the distances between segments, shape (n, 3) each.

    The nearest points are inside both segments, where the lines are nearest, or one of the four ends is one.
    """
    along, other_along, apart = end - start, other_end - other_start, other_start - start
    a, b, c = (np.sum(x * y, axis=1) for x, y in ((along, along), (along, other_along), (other_along,) * 2))
    d, e = np.sum(along * apart, axis=1), np.sum(other_along * apart, axis=1)
    det = a * c - b * b
    safe = np.where(det > 0.0, det, 1.0)
    share, other = np.clip((c * d - b * e) / safe, 0.0, 1.0), np.clip((b * d - a * e) / safe, 0.0, 1.0)
    between = apart + other[:, None] * other_along - share[:, None] * along
    found = [
        np.linalg.norm(between, axis=1),
        _point_distances(start, other_start, other_along),
        _point_distances(end, other_start, other_along),
        _point_distances(other_start, start, along),
        _point_distances(other_end, start, along),
    ]
    return np.asarray(np.minimum.reduce(found))


def _point_distances(point: FloatArray, start: FloatArray, along: FloatArray) -> FloatArray:
    square = np.sum(along**2, axis=1)
    share = np.sum((point - start) * along, axis=1) / np.where(square > 0.0, square, 1.0)
    nearest = start + np.clip(share, 0.0, 1.0)[:, None] * along
    return np.asarray(np.linalg.norm(point - nearest, axis=1))


def _pairs_in_sight(
    scene: Scene, part: slice, first: IntArray, second: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Find steps and pairs of links whose middles are near enough for them to meet."""
    n_links, size = scene.motion.n_links, part.stop - part.start
    moves = scene.steps(part.start, part.stop)
    middle = ((moves.before + moves.after) / 2.0).mean(axis=1).reshape(size, n_links, 3)
    reach = (moves.ways / 2.0 + moves.astray).reshape(size, n_links) + scene.length / 2.0 + scene.radius
    out = np.maximum(scene.arc[part, 1:], scene.arc[part.start + 1 : part.stop + 1, 1:]) > 0.0
    # Over a block, a link is within the farthest that any of its places there reaches from one of them.
    starts = np.arange(0, size, BLOCK)
    within = np.minimum(starts[:, None] + np.arange(BLOCK), size - 1)
    centre = middle[within[:, BLOCK // 2]]
    wide = (np.linalg.norm(middle[within] - centre[:, None], axis=3) + reach[within]).max(axis=1)
    outside = out[within].any(axis=1)
    apart = np.linalg.norm(centre[:, first] - centre[:, second], axis=2)
    near = outside[:, first] & (apart <= wide[:, first] + wide[:, second] + scene.slack)
    block, pair = np.nonzero(near)
    step = starts[block][:, None] + np.arange(BLOCK)
    pair = np.broadcast_to(pair[:, None], step.shape)[step < size]
    step = step[step < size]
    one, other = first[pair], second[pair]
    apart = np.linalg.norm(middle[step, one] - middle[step, other], axis=1)
    near = out[step, one] & (apart <= reach[step, one] + reach[step, other] + scene.slack)
    order = np.argsort(step[near], kind="stable")
    return part.start + step[near][order], one[near][order], other[near][order]


def _at_single_pose(scene: Scene) -> tuple[IntArray, IntArray, IntArray]:
    first, second = np.triu_indices(scene.motion.n_links, 2)
    out = scene.arc[0, first + 1] > 0.0
    return np.zeros(out.sum(), dtype=np.int64), first[out], second[out]


def _first_meeting(
    scene: Scene, step: IntArray, first: IntArray, second: IntArray, at: FloatArray | None = None
) -> Meeting | None:
    """Find where pairs of links meet, or may.

    Of those found after equally many halvings the nearest is returned; the rest is not looked at.
    """
    time = np.tile((0.0, 1.0), (len(step), 1)) if at is None else at
    allowed = 2.0 * scene.radius + ROUNDING * scene.length
    for level in range(MAX_SPLITS + 1):
        if not len(step):
            return None
        one, other = (scene.moves(step, link, time) for link in (first, second))
        apart = np.stack(
            [
                segment_distances(ends[:, 0], ends[:, 1], others[:, 0], others[:, 1])
                for ends, others in ((one.before, other.before), (one.after, other.after))
            ],
            axis=1,
        )
        least = apart.mean(axis=1) - (one.ways + other.ways) / 2.0 - one.astray - other.astray
        meet = apart.min(axis=1) <= allowed
        rest = ~meet & (least <= allowed)
        last = level == MAX_SPLITS or 2 * np.count_nonzero(rest) > MAX_PIECES
        named = meet | rest if last else meet
        if named.any():
            row, side = (int(k) for k in np.argwhere(apart == apart[named].min())[0])
            links = int(first[row]), int(second[row])
            return float(apart[row, side]), int(step[row]), *links, float(time[row, side])
        time = halves(time[rest])
        step, first, second = (np.repeat(values[rest], 2) for values in (step, first, second))
    return None


def _crossing_fault(scene: Scene, distance: float, pose: int, first: int, second: int, time: float) -> Fault:
    ends, arc = scene.ends(np.array([pose]), np.array([second]), np.array([time]))
    when = f"between poses {pose} and {pose + 1}"
    if time in (0.0, 1.0):
        pose += int(time)
        when = f"at pose {pose}"
    touch = distance <= ROUNDING * scene.length
    what = "cross" if touch else f"come within {scene.figure(distance)} of each other"
    return Fault(
        kind="crossing",
        message=f"Links {first} and {second} {what} {when}.",
        pose=pose,
        link=second,
        place=point_of(scene.in_workspace(ends, arc)[0].mean(axis=0)),
        amount=distance,
    )
