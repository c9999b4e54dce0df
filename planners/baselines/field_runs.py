"""What the two methods that move an arm by forces share: attempts with several gains, and their motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arguments import place_text
from planners.clock import now
from planners.kernels import field_steps as kernel
from planners.kernels.types import FloatArray
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.survey import Geometry

__all__ = ["Gains", "Mover", "base_frame", "new_run", "new_task", "plan_by_forces"]

STOP = 0.5
"""The motion ends when the tip is this near to the goal, in goal radii, as with the paper's planner."""

MOST_BENT = 3.0
"""Largest joint angle, in rad: short of folding a link back onto its neighbour."""

MOST_STEPS = 200
"""Steps for each link length of path, from which on no more are tried."""

CHUNK, CHUNK_LINKS = 256, 100
"""Steps between two looks at the clock; for more links than these fewer, as each takes longer."""

CONTACTS_PER_LINK = 16
"""Places of a link near walls that are minded, on average."""


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Hold what such a method can be tuned with.

    Parameters
    ----------
    barrier : float
        Strength of the repulsion by walls, over that of the field.
    reach : float
        Distance at which it begins, in link lengths.
    lead : float
        How many control points the tip counts for beyond its own.
    ahead, poles_ahead : float
        How far ahead along the path the tip is led, and how far poles are, in link lengths.
    damping : float
        Of the pseudo-inverse.
    """

    barrier: float
    reach: float
    lead: float = 0.0
    ahead: float = 0.0
    poles_ahead: float = 0.0
    damping: float = 0.0


Mover = Callable[[kernel.Task, kernel.Run, Gains, FloatArray], tuple[int, int]]
"""Moves a run on, and fills in the states gone through."""


@dataclass(frozen=True, kw_only=True)
class _Outcome:
    """How an attempt ended: the states, the ending of the kernel, and the run at its end."""

    states: FloatArray
    ending: int
    run: kernel.Run
    late: bool


def base_frame(points: FloatArray, query: Query) -> FloatArray:
    """Return points in link lengths from the base."""
    return np.ascontiguousarray((points - query.maze.base_pose[:2]) / query.arm.link_length)


def new_task(query: Query, geometry: Geometry, gains: Gains, per_link: int) -> kernel.Task:
    """Return what the arm is to do, in link lengths; walls are grown by the radius of the links."""
    limit = query.arm.joint_limit
    return kernel.Task(
        walls=base_frame(geometry.maze.walls, query),
        heading=float(query.maze.base_pose[2]),
        most_bent=MOST_BENT if limit is None else min(MOST_BENT, limit * (1.0 - 1e-9)),
        goal=base_frame(query.maze.goal, query),
        stop=STOP * float(query.maze.goal_radius) / float(query.arm.link_length),
        per_link=per_link,
        barrier=gains.barrier,
        reach=gains.reach,
        lead=gains.lead,
    )


def new_run(n_links: int, per_link: int) -> kernel.Run:
    """Return an arm in the feeder, with the tip at the base."""
    n = n_links + 1
    return kernel.Run(
        state=np.zeros(n),
        points=np.zeros((n, 2)),
        contacts=np.empty((CONTACTS_PER_LINK * n, 6)),
        best=np.array([-math.inf, 0.0]),
        nearest=np.zeros(n * per_link, dtype=np.int64),
        places=np.empty((n * per_link, 2)),
        forces=np.empty((n * per_link, 2)),
        links=np.empty(n * per_link, dtype=np.int64),
        matrix=np.empty((n, n)),
        vectors=np.zeros((5, n)),
        trial=np.empty(n),
        chain=np.empty((n, 2)),
    )


def plan_by_forces(query: Query, move: Mover, attempts: Iterable[Gains], per_link: int) -> Candidate:
    """Try gains one after the other, until the checker accepts a motion.

    Parameters
    ----------
    query : Query
        Maze, arm and terms.
    move : callable
        The method.
    attempts : iterable of Gains
        In this order.
    per_link : int
        Control points of a link.

    Returns
    -------
    candidate : Candidate
        The first motion that is accepted; else the one that is least deep in a wall; else how far the arm
        came with the gains with which its tip came nearest to the goal.
    """
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    start, refused, ended = now(), [], []
    attempts = list(attempts)
    for number, gains in enumerate(attempts):
        query.tell("plan", number / len(attempts))
        outcome = _attempt(query, geometry, move, gains, per_link)
        if outcome.ending == kernel.DONE:
            motion = _motion(outcome.states, query)
            report = query.check(motion)
            if report is None or report.valid:
                return _solved(motion, geometry, start)
            refused.append((max(report.penetration, report.penetration_between), number, motion))
        else:
            ended.append(outcome)
        if outcome.late or query.late:
            break
    query.tell("plan", 1.0)
    if refused:
        return _solved(min(refused)[2], geometry, start)
    nearest = min(ended, key=lambda outcome: _way_left(outcome, query, geometry))
    return _failed(query, nearest, geometry, start)


def _attempt(query: Query, geometry: Geometry, move: Mover, gains: Gains, per_link: int) -> _Outcome:
    """Run from the base until the end."""
    links_of_path = math.ceil(geometry.path.length / query.arm.link_length)
    run = new_run(2 * links_of_path + 2, per_link)
    task = new_task(query, geometry, gains, per_link)
    states = np.empty((CHUNK, len(run.state)))
    chunk = max(1, round(CHUNK * min(1.0, CHUNK_LINKS / len(run.state)) ** 3))
    n, ending = kernel.push_straight(task, run, states)
    found, n_all, late = [states[:n].copy()], n, False
    while ending == kernel.GOING and n_all < MOST_STEPS * (links_of_path + 1) and not late:
        n, ending = move(task, run, gains, states[:chunk])
        found.append(states[:n].copy())
        n_all += n
        late = query.late
    return _Outcome(states=np.concatenate(found), ending=ending, run=run, late=late)


def _motion(states: FloatArray, query: Query) -> Motion:
    """Return the motion of an arm with as many links as it takes."""
    n_links = max(1, math.ceil(states[:, 0].max()))
    angles = np.zeros((len(states), n_links))
    angles[:, 1:] = states[:, n_links - 1 : 0 : -1]
    length = query.arm.link_length
    return Motion.from_configurations(states[:, 0] * length, angles, length, query.maze.base_pose)


def _solved(motion: Motion, geometry: Geometry, start: float) -> Candidate:
    seconds = now() - start
    return Candidate(
        status=PlanningStatus.SOLVED, motion=motion, timings={**geometry.timings, "plan": seconds}
    )


def _tip(outcome: _Outcome, query: Query) -> tuple[float, float]:
    x, y = query.maze.base_pose[:2] + query.arm.link_length * outcome.run.points[0]
    return float(x), float(y)


def _way_left(outcome: _Outcome, query: Query, geometry: Geometry) -> float:
    """Return how far the tip still is from the goal, along the path."""
    path = geometry.path
    at = int(np.argmin(np.hypot(*(path.points - _tip(outcome, query)).T)))
    return float(path.s[-1] - path.s[at])


def _failed(query: Query, outcome: _Outcome, geometry: Geometry, start: float) -> Candidate:
    """Say where the best attempt ended, and why."""
    place = _tip(outcome, query)
    units, feed = query.maze.units, float(outcome.run.state[0])
    k = max(math.ceil(feed) - 1, 0)
    joints = query.maze.base_pose[:2] + query.arm.link_length * outcome.run.points[k::-1]
    why = {
        kernel.GOING: "more steps are of no use",
        kernel.STUCK: "the forces on the arm balance or press it against a wall, and it makes no progress",
        kernel.FULL: "twice the links that the path is long have come out of the feeder",
    }[outcome.ending]
    if outcome.late:
        why = "time was over"
    return Candidate(
        status=PlanningStatus.OUT_OF_TIME if outcome.late else PlanningStatus.DEAD_END,
        reason=f"With the tip at {place_text(place, query.maze.size)} {units}, {why}.",
        failure=Failure(
            place=place,
            path_position=geometry.path.length - _way_left(outcome, query, geometry),
            joints=np.concatenate([query.maze.base_pose[None, :2], joints]),
        ),
        timings={**geometry.timings, "plan": now() - start},
    )
