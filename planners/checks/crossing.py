"""The arm against itself, at poses and between them."""

from __future__ import annotations

import math

import numpy as np
import shapely

from planners.checks.scene import CHUNK, MAX_SPLITS, IntArray, Scene, halves, joint_fault, point_of, worst_of
from planners.checks.tolerances import ROUNDING
from planners.problem import Fault, Progress


def check_crossing(scene: Scene, pairs: IntArray, tell: Progress) -> Fault | None:
    """Check that links keep apart, by the distances at the ends of ever shorter pieces of time.

    A point of a link that moves along a chord c is at most t * c + e from its place at the start and at most
    (1 - t) * c + e from its place at the end, so the mean of the two distances, less half of both chords and
    both e, bounds the distance within.
    """
    amount, pose, joint = (
        worst_of(np.abs(scene.motion.joint_angles[:, 1:])) if scene.motion.n_links > 1 else (0.0, 0, 0)
    )
    if amount >= math.pi - ROUNDING:
        message = f"Link {joint + 1} lies folded back on link {joint} at pose {pose}."
        return joint_fault(scene, "crossing", message, pose, joint + 1, 0.0)
    n_intervals = max(1, scene.motion.n_poses - 1)
    for first in range(0, n_intervals, CHUNK):
        chosen = pairs[(pairs[:, 0] >= first) & (pairs[:, 0] < min(first + CHUNK, n_intervals))]
        found = _first_meeting(scene, *chosen.T)
        if found is not None:
            return _crossing_fault(scene, *found)
        tell("validate", 0.8 + 0.2 * min(1.0, (first + CHUNK) / n_intervals))
    return None


def _first_meeting(
    scene: Scene, interval: IntArray, first: IntArray, second: IntArray
) -> tuple[float, int, int, int, float] | None:
    """Find where pairs of links meet, or may: distance, interval, both links, time in the interval.

    Of those found after equally many halvings the nearest is returned; the rest is not looked at.
    """
    time, allowed = np.tile((0.0, 1.0), (len(interval), 1)), 2.0 * scene.radius
    for level in range(MAX_SPLITS + 1):
        if not len(interval):
            return None
        least = np.zeros(len(interval))
        lines = []
        for link in (first, second):
            (before, arc), (after, later) = (scene.ends(interval, link, time[:, k]) for k in (0, 1))
            lines.append(
                [shapely.linestrings(scene.in_maze(*ends)) for ends in ((before, arc), (after, later))]
            )
            least -= np.linalg.norm(after - before, axis=2).max(axis=1) / 2.0
            least -= scene.curvature[interval, link + 1] * np.ptp(time, axis=1) ** 2
        apart = np.stack([shapely.distance(lines[0][k], lines[1][k]) for k in (0, 1)], axis=1)
        least += apart.mean(axis=1)
        meet = apart.min(axis=1) <= allowed
        rest = ~meet & (least <= allowed)
        named = meet | rest if level == MAX_SPLITS else meet
        if named.any():
            row, side = (int(k) for k in np.argwhere(apart == apart[named].min())[0])
            return (
                float(apart[row, side]),
                int(interval[row]),
                int(first[row]),
                int(second[row]),
                float(time[row, side]),
            )
        time = halves(time[rest]).reshape(-1, 2)
        interval, first, second = (np.repeat(values[rest], 2) for values in (interval, first, second))
    return None


def _crossing_fault(scene: Scene, distance: float, pose: int, first: int, second: int, time: float) -> Fault:
    both = [np.array([value]) for value in (pose, time)]
    ends, arc = scene.ends(both[0], np.array([second]), both[1])
    when = f"between poses {pose} and {pose + 1}"
    if time in (0.0, 1.0):
        pose += int(time)
        when = f"at pose {pose}"
    what = "cross" if distance == 0.0 else f"come within {scene.figure(distance)} of each other"
    return Fault(
        kind="crossing",
        message=f"Links {first} and {second} {what} {when}.",
        pose=pose,
        link=second,
        place=point_of(scene.in_maze(ends, arc)[0].mean(axis=0)),
        amount=distance,
    )
