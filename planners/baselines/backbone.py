"""The backbone: links are fitted by least squares to a smooth curve that leads them, to compare with.

A curve based method in the sense of the paper's introduction: reference 13, of which it says that "a
backbone curve whose length is constant can be obtained", that the "configuration of a manipulator with
discrete links can be fitted to this curve as closely as possible", and that few links and large curvatures
are bad for it. It moves by following the leader, as the introduction says of references 19 and 34. What is
here is built from these sentences alone.

The curve is the path, smoothed by a moving average, which bounds its curvature. The arm is a constant
length of it, from the feeder on; as it is pushed in, all links past the base are fitted at once, for every
pose: the sum of the squared distances of places on the links from the curve is least near the pose before.
So joints are outside bends, and the middles of links inside. Only distances across the curve count, since
links that stay as long as their piece of the curve would have to zigzag after every bend. How smooth the
curve is, is tried; nothing is done about the walls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from hrsnake_env.arm import FEEDER_RELEASE
from planners.baselines.path_following import STOP, followed_track
from planners.baselines.trials import Stuck, Trial, best_of
from planners.kernels import backbone as kernel
from planners.kernels.types import FloatArray
from planners.path import arclength, resampled, tangents, windowed
from planners.problem import Candidate, Motion
from planners.query import Query
from planners.room import TooLarge, most_poses
from planners.survey import Geometry

__all__ = ["backbone_curve", "plan_backbone"]

WINDOWS = (0.0, 0.1, 0.25, 0.5, 1.0)
"""Width of the moving average along the path, in passage widths, besides the path's own; all are tried."""

SPACING = 1 / 60
"""Of the points of the curve, in link lengths."""

STEP = 0.03
"""Largest movement of a joint between poses, in link lengths."""

MORE_LINKS = 1.5
"""Most links that there is room for, times those that are as long as the curve."""

NEAR = 0.9
"""Where the tip does not come within `STOP` of the goal, the motion ends where it is nearest, if it is this
near, in goal radii."""

CHUNK = 500
"""Poses between two looks at the clock."""

WHY = {
    kernel.JUMP: "a joint would have to jump for the links to stay near the curve",
    kernel.PAST: "the tip misses the goal: links near the curve pass beside it",
    kernel.FULL: "joints move so fast that there are too many poses",
}


def plan_backbone(query: Query) -> Candidate:
    """Plan by fitting all links to a smooth curve.

    Parameters
    ----------
    query : Query
        Maze, arm, deadline and checker; neither joint limits nor a warm start are used.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, or the reason why there is none: a joint would jump, or the
        tip misses the goal. Where no motion is valid, the one that gets least deep into walls.
    """
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    return best_of(query, geometry, _trials(query, geometry))


def _trials(query: Query, geometry: Geometry) -> Iterator[Trial]:
    """Lead the arm along one curve after the other, as long as there is time."""
    maze, length = geometry.maze, float(query.arm.link_length)
    track = followed_track(geometry.path.points, length, maze.base_pose, maze.goal, 0.0)
    track = (track - maze.base_pose[:2]) / length
    for number, window in enumerate(WINDOWS):
        query.tell("plan", number / len(WINDOWS))
        trial = _led(query, backbone_curve(track, window * geometry.path.width / length))
        if trial is None:
            return
        yield trial


def backbone_curve(track: FloatArray, window: float) -> FloatArray:
    """Smooth a track, shape (n, 2), by a moving average; track and window are in link lengths.

    The end of the feeder's axis is smoothed as well: the curve is not to be followed there, but to be near.
    """
    return windowed(resampled(track, SPACING), round(0.5 * window / SPACING))


def _led(query: Query, curve: FloatArray) -> Trial | None:
    """Lead the arm along a curve, in link lengths, that begins at the base; None if time runs out."""
    maze, length = query.maze, float(query.arm.link_length)
    along, axis = tangents(curve), float(maze.base_pose[2])
    normals = np.column_stack([-along[:, 1], along[:, 0]])
    n_links = math.ceil(MORE_LINKS * arclength(curve)[-1]) + 2
    room = min(4 * n_links * kernel.TICKS // kernel.STRIDE, most_poses(n_links))
    feeds, headings = np.zeros(room, dtype=np.int64), np.empty((room, n_links))
    headings[0] = axis  # later rows begin as copies: to fill all would take seconds for a long arm
    joints, nearest = np.zeros((n_links + 1, 2)), np.zeros((n_links, kernel.SAMPLES), dtype=np.int64)
    goal, stop = (maze.goal - maze.base_pose[:2]) / length, STOP * maze.goal_radius / length
    n, ending = 1, kernel.PAUSED
    while ending == kernel.PAUSED:
        if query.late:
            return None
        n, ending = kernel.lead_along(
            curve, normals, axis, goal, stop, FEEDER_RELEASE, STEP, n, n + CHUNK,
            feeds, headings, joints, nearest,
        )  # fmt: skip
    if ending == kernel.FULL and room == most_poses(n_links):
        x, y = (float(value) for value in maze.base_pose[:2] + length * joints[0])
        raise TooLarge((x, y), n, n_links)
    if ending == kernel.PAST:
        motion = _motion(feeds[:n], headings[:n], maze.base_pose, length)
        away = np.hypot(*(motion.joints[:, -1] - maze.goal).T)
        if away.min() <= NEAR * maze.goal_radius:
            n, ending = int(np.argmin(away)) + 1, kernel.DONE
    if ending != kernel.DONE:
        out = feeds[n - 1] // kernel.TICKS
        return Stuck(why=WHY[ending], joints=maze.base_pose[:2] + length * joints[: out + 1][::-1])
    return _motion(feeds[:n], headings[:n], maze.base_pose, length)


def _motion(ticks: FloatArray, headings: FloatArray, base_pose: FloatArray, length: float) -> Motion:
    """Make a motion of feeds and headings, tip first, with as many links as it needs."""
    n_links = math.ceil(ticks.max() / kernel.TICKS)
    from_base = np.column_stack([np.full(len(ticks), base_pose[2]), headings[:, n_links - 1 :: -1]])
    feed = ticks * (length / kernel.TICKS)
    return Motion.from_configurations(feed, np.diff(from_base, axis=1), length, base_pose)
