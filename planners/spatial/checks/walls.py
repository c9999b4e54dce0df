"""Poses against the obstacles: exact signed distances decide."""

from __future__ import annotations

import math

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.checks.tolerances import ROUNDING
from planners.problem import Fault, Progress
from planners.spatial.checks.boxes import axis_gaps, frame_gaps, separations
from planners.spatial.checks.scene import BoolArray, IntArray, Scene, point_of, slices

__all__ = ["check_poses", "nearest_of_each"]


def check_poses(scene: Scene, tell: Progress) -> tuple[float, Fault | None, BoolArray]:
    """Check all poses: clearance, the worst penetration, and the links deeper than any sweep allows."""
    motion, radius = scene.motion, scene.radius
    deep = np.zeros((motion.n_poses, motion.n_links), dtype=bool)
    clearance, where, place = math.inf, (0, 0), motion.joints[0, -1]
    for part in slices(motion.n_poses, motion.n_links * len(scene.boxes)):
        arc = scene.arc[part]
        joints = scene.in_workspace(motion.joints[part], arc)
        pose, link = np.nonzero(arc[:, 1:] > ROUNDING * scene.length)
        start, end = joints[pose, link], joints[pose, link + 1]
        row, distance, share = _nearest(start, end, scene.boxes, clearance + radius, radius)
        of_deep = row[distance - radius < -scene.tolerance]
        deep[part][pose[of_deep], link[of_deep]] = True
        if len(row) and distance.min() - radius < clearance:
            best = int(np.argmin(distance))
            clearance, one = float(distance[best]) - radius, row[best]
            where = (part.start + int(pose[one]), int(link[one]))
            place = start[one] + share[best] * (end[one] - start[one])
        tell("validate", 0.1 + 0.3 * part.stop / motion.n_poses)
    if clearance >= -ROUNDING * scene.length:
        return clearance, None, deep
    fault = Fault(
        kind="penetration",
        message=f"Link {where[1]} is {scene.figure(-clearance)} deep in an obstacle at pose {where[0]}.",
        pose=where[0],
        link=where[1],
        place=point_of(place),
        amount=-clearance,
    )
    return clearance, fault, deep


def _nearest(
    start: FloatArray, end: FloatArray, boxes: FloatArray, beat: float, always: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Compute the signed distances of segments to boxes that may be the least of all and less than `beat`.

    Those below `always` are computed too. Return the numbers of the segments, distances, and shares.
    """

    def measured(row: IntArray, box: IntArray) -> tuple[FloatArray, FloatArray]:
        distance, _, share = separations(start[row], end[row], boxes[box, 0], boxes[box, 1])
        return distance, share

    gaps = frame_gaps(np.minimum(start, end), np.maximum(start, end), boxes)
    # The likely nearest first: it sets most of the others aside.
    limit = beat
    if gaps.size:
        likely = np.array([np.argmin(gaps)])
        limit = min(limit, float(measured(*np.divmod(likely, len(boxes)))[0][0]))
    row, box = np.nonzero(gaps <= max(limit, always))
    if len(row):
        bounds = axis_gaps(start[row], end[row], boxes[box, 0], boxes[box, 1]).max(axis=1)
        first = np.array([np.argmin(bounds)])
        limit = min(limit, float(measured(row[first], box[first])[0][0]))
        near = bounds <= max(limit, always)
        row, box = row[near], box[near]
    return row, *measured(row, box)


def nearest_of_each(start: FloatArray, end: FloatArray, boxes: FloatArray) -> FloatArray:
    """Compute the least signed distance of each segment, shape (n, 3) both, to any box; infinite without."""
    least = np.full(len(start), np.inf)
    for part in slices(len(start), len(boxes)):
        one, other = start[part], end[part]
        gaps = frame_gaps(np.minimum(one, other), np.maximum(one, other), boxes)
        # No farther than the middle is from the box that is nearest to it.
        middle = (one + other) / 2.0
        limit = np.full(len(one), np.inf)
        for low, high in boxes:
            away = np.linalg.norm(middle - np.clip(middle, low, high), axis=1)
            np.minimum(limit, away, out=limit)
        row, box = np.nonzero(gaps <= limit[:, None])
        distance, _, _ = separations(one[row], other[row], boxes[box, 0], boxes[box, 1])
        np.minimum.at(least[part], row, distance)
    return least
