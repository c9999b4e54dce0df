"""Path following: every joint runs on the global path, as others do it, to compare with.

Section 5.5 of the paper: "a simple path following algorithm" that "keeps the link ends on the path points
while advancing to the goal point". The path is the one that all planners here begin with. Nothing is done
about the walls: a link cuts the bends that it is long for, and where that takes it into a wall the exact
checker refuses the motion.
"""

from __future__ import annotations

import math

import numpy as np

from hrsnake_env.arguments import place_text
from planners.clock import now
from planners.feeding import LATE, Feeding, feed, motion_of
from planners.kernels import feeding as kernel
from planners.kernels.types import FloatArray
from planners.problem import Candidate, Failure, PlanningStatus
from planners.query import Query

__all__ = ["JOIN", "followed_track", "plan_path_following"]

JOIN = 0.5
"""How much farther from the base than the end of the axis the path is joined, in link lengths. In corridors,
where paths begin along the axis, it makes no difference; in random halls joints jump with a tenth of it."""

LEAST = 1e-3
"""How far an arm moves at least, in link lengths: a goal may be at the base."""

ROUNDING = 1e-9
"""Going back by less is not counted, in link lengths."""

STOP = 0.5
"""The motion ends when the tip is this near to the goal, in goal radii, as with the paper's planner."""


def plan_path_following(query: Query) -> Candidate:
    """Plan by keeping all link ends on the global path.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; neither joint limits nor a warm start are used.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, not validated and maybe deep in walls, or the reason why
        there is none: a joint would jump along the path, or go back on it.
    """
    geometry, length = query.geometry, float(query.arm.link_length)
    if geometry is None:
        return query.no_path()
    query.tell("plan", 0.2)
    clock = [now()]
    maze = geometry.maze
    track = followed_track(geometry.path.points, length, maze.base_pose, maze.goal, STOP * maze.goal_radius)
    fed = feed(track, length, maze.base_pose, deadline=query.deadline)
    clock.append(now())
    query.tell("plan", 1.0)
    stuck = _stuck(fed, maze.base_pose, length)
    if stuck is not None:
        why, pose = stuck
        x, y = (float(value) for value in fed.poses[pose, -1])
        return Candidate(
            status=PlanningStatus.OUT_OF_TIME if fed.ending == LATE else PlanningStatus.DEAD_END,
            reason=f"With the tip at {place_text((x, y), maze.size)} {maze.units}, {why}.",
            failure=Failure(place=(x, y), joints=fed.poses[pose]),
            timings={**geometry.timings, "plan": clock[1] - clock[0]},
        )
    motion = motion_of(fed.poses, length, maze.base_pose)
    clock.append(now())
    stages = dict(zip(("plan", "poses"), np.diff(clock).tolist(), strict=True))
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings={**geometry.timings, **stages})


def _stuck(fed: Feeding, base_pose: FloatArray, link_length: float) -> tuple[str, int] | None:
    """Say why an arm cannot advance along the whole path, and from which pose on; None if it can."""
    if fed.ending == LATE:
        return "time was over", -1
    heading = np.array([math.cos(base_pose[2]), math.sin(base_pose[2])])
    # Links that end in the feeder are left out: if they were out of it before, they come back over the axis.
    forward = np.diff(fed.poses[:, 0] @ heading)
    back = forward < -ROUNDING * link_length
    if back.any():
        # Its chord lies across the legs of a turn that are nearer to each other than a link is long.
        why = "the arm behind it would have to go back along the path for it to advance"
        return why, int(np.argmax(back))
    if fed.ending != kernel.DONE:
        return "a joint behind it would have to jump along the path to stay a link length behind", -1
    return None


def followed_track(
    path: FloatArray, link_length: float, base_pose: FloatArray, goal: FloatArray, stop: float
) -> FloatArray:
    """Put the feeder's axis in front of a path, and end it at the goal.

    A link leaves the axis only when its base-side joint has passed the base, so the track is the axis for one
    link length. From the axis' end a straight step leads to the first point of the path that is `JOIN` link
    lengths farther from the base, or to the path's end if there is none. From there on the track is the path.

    Parameters
    ----------
    path : array, shape (n, 2)
        From the base to the goal, in maze units.
    link_length : float
        In maze units.
    base_pose : array, shape (3,)
        Base position and heading.
    goal : array, shape (2,)
        In maze units.
    stop : float
        Distance from the goal, in maze units, at which the track ends.

    Returns
    -------
    track : array, shape (m, 2)
        Begins at the base; ends at its first vertex that is near enough to the goal.
    """
    base = base_pose[:2]
    axis_end = base + link_length * np.array([math.cos(base_pose[2]), math.sin(base_pose[2])])
    far = np.hypot(*(path - base).T) >= (1.0 + JOIN) * link_length
    joined = path[int(np.argmax(far)) if far.any() else len(path) - 1 :]
    # The straight parts get a vertex where they are nearest to the goal, which may be beside them.
    feet = _foot(base, axis_end, goal), _foot(axis_end, joined[0], goal)
    track = np.concatenate([[base, feet[0], axis_end, feet[1]], joined])
    near = np.hypot(*(track[1:] - goal).T) <= stop
    return track[: int(np.argmax(near)) + 2] if near.any() else track


def _foot(start: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    """Return the place on the way from start to end, though not at the start, that is nearest to a point."""
    along = end - start
    share = float((point - start) @ along) / max(float(along @ along), 1e-300)
    return np.asarray(start + min(max(share, LEAST), 1.0) * along)
