"""Trying variants of a method: the first motion that is valid, otherwise the one least deep in walls."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import shapely

from hrsnake_env.arguments import place_text
from hrsnake_env.maze import Maze
from planners.clock import now
from planners.feeding import LATE, feed, motion_of
from planners.kernels import feeding as kernel
from planners.kernels.types import FloatArray
from planners.obstruction import wall_nearest_to
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.survey import Geometry

__all__ = ["Stuck", "Trial", "best_of", "fed_along"]

POSES, PLACES = 300, 9
"""Poses, and places on each link, at which a motion's depth in the walls is looked at: enough to rank."""

BACK = "the arm behind it would have to go back into the feeder for it to advance"
OVER = "time was over"
JUMP = "a joint behind it would have to jump along the track to stay a link length behind"


@dataclass(frozen=True, eq=False, kw_only=True)
class Stuck:
    """Say why a variant of a method has no motion.

    Parameters
    ----------
    why : str
        The end of a sentence that begins with the place of the tip.
    joints : array, shape (n_joints, 2)
        The arm as far as it came, the tip last.
    """

    why: str
    joints: FloatArray


Trial = Motion | Stuck
"""What comes of one variant of a method."""


def fed_along(
    track: FloatArray, link_length: float, base_pose: FloatArray, deadline: float = math.inf
) -> Trial:
    """Feed an arm along a track (`planners.feeding.feed`), whatever walls it meets.

    Parameters
    ----------
    track : array, shape (n, 2)
        A polyline in maze units that begins at the base and is straight for one link length.
    link_length : float
        In maze units.
    base_pose : array, shape (3,)
        Base position and heading.
    deadline : float
        When to stop, on the clock of `planners.clock.now`.
    """
    fed = feed(track, link_length, base_pose, deadline=deadline)
    if fed.ending == LATE:
        return Stuck(why=OVER, joints=fed.poses[-1])
    if fed.ending != kernel.DONE:
        return Stuck(why=JUMP, joints=fed.poses[-1])
    # Links behind the base at the end have been left out: were they out of the feeder before?
    forward = (fed.poses[:, 0] - base_pose[:2]) @ (np.cos(base_pose[2]), np.sin(base_pose[2]))
    if forward.max() > 1e-9 * link_length:
        return Stuck(why=BACK, joints=fed.poses[int(np.argmax(forward))])
    return motion_of(fed.poses, link_length, base_pose)


def best_of(query: Query, geometry: Geometry, trials: Iterable[Trial]) -> Candidate:
    """Return the first motion that is free and that the checker does not refuse.

    Parameters
    ----------
    query : Query
        Its checker, if there is one, is asked about motions whose poses are free.
    geometry : Geometry
        Of the query.
    trials : iterable of Motion or Stuck
        Made one after the other, until the deadline.

    Returns
    -------
    candidate : Candidate
        Where no motion is valid, the one that gets least deep into the walls; where there is no motion at
        all, a dead end with the reason and the place of the first variant; out of time if not all were tried.
    """
    begin, best, depth, stuck, late = now(), None, np.inf, None, False
    maze = geometry.maze
    for trial in trials:
        if isinstance(trial, Stuck):
            stuck = stuck or trial
        else:
            free = kernel.first_hit(trial.joints, maze.base_pose, maze.walls)[0] < 0
            report = query.check(trial) if free else None
            if free and (report is None or report.valid):
                return _answer(geometry, begin, trial)
            how_deep = 0.0 if free else _depth(trial, maze)
            if best is None or how_deep < depth:
                best, depth = trial, how_deep
        if query.late:
            late = True
            break
    if best is None and stuck is not None:
        return _dead_end(query, geometry, begin, stuck, late)
    return _answer(geometry, begin, best)


def _answer(geometry: Geometry, begin: float, motion: Motion | None) -> Candidate:
    if motion is None:  # there was no time for a single variant
        x, y = (float(value) for value in geometry.maze.base_pose[:2])
        return Candidate(
            status=PlanningStatus.OUT_OF_TIME,
            reason="Time was over before the first motion was found.",
            failure=Failure(place=(x, y)),
            timings=_timings(geometry, begin),
        )
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings=_timings(geometry, begin))


def _dead_end(query: Query, geometry: Geometry, begin: float, stuck: Stuck, late: bool) -> Candidate:
    before = "Time was over before everything was tried. " if late else ""
    x, y = (float(value) for value in stuck.joints[-1])
    return Candidate(
        status=PlanningStatus.OUT_OF_TIME if late else PlanningStatus.DEAD_END,
        reason=f"{before}With the tip at {place_text((x, y), geometry.maze.size)} {geometry.maze.units}, "
        f"{stuck.why}.",
        failure=Failure(place=(x, y), wall=wall_nearest_to(query.maze, (x, y)), joints=stuck.joints),
        timings=_timings(geometry, begin),
    )


def _timings(geometry: Geometry, begin: float) -> dict[str, float]:
    return {**geometry.timings, "plan": now() - begin}


def _depth(motion: Motion, maze: Maze) -> float:
    """Estimate the largest depth of a motion's links in the walls at its poses, in maze units."""
    heading = np.array([np.cos(maze.base_pose[2]), np.sin(maze.base_pose[2])])
    joints = motion.joints[:: max(1, motion.n_poses // POSES)]
    out = (joints[:, :-1] - maze.base_pose[:2]) @ heading >= 0.0
    out |= np.abs((joints[:, :-1] - maze.base_pose[:2]) @ (-heading[1], heading[0])) > 1e-9
    shares = np.linspace(0.0, 1.0, PLACES)[:, None]
    starts, ends = joints[:, :-1][out][:, None], joints[:, 1:][out][:, None]
    places = (starts + shares * (ends - starts)).reshape(-1, 2)
    shapely.prepare(maze.free_space)
    beyond = places[~shapely.contains_xy(maze.free_space, places)]
    return float(shapely.distance(maze.free_space, shapely.points(beyond)).max(initial=0.0))
