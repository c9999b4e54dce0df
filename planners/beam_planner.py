"""The paper's planner (section 3): every link chooses tangent, edge side or path point, base to tip.

The rules themselves are kernels, one per subsection, in `planners.kernels.beam`. One step is added to the
paper's: the chosen direction is clamped into the exact free interval of the link, which makes the penetration
exactly 0 where softening (3.7) alone would poke the walls.
"""

from __future__ import annotations

import math
import time

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.corners import Corner
from planners.kernels import beam as kernel
from planners.kernels.types import FloatArray, IntArray
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.survey import Geometry

__all__ = ["plan_beam"]

POSES_PER_LINK = 240
"""Regular number of poses per link length of feed; more where joints move fast."""

SOFTENING = 12.0
"""Largest turn of a link in rad per link length of feed: a jump of half a radian takes a twenty-fifth of a
link length. Slower lags behind the walls, faster moves joints farther than a step allows."""

STEP = 0.03
"""Largest movement of a joint between poses, in link lengths; the checker allows 0.05."""

PAD = 3e-4
"""Kept from the walls by every link, in rad about its base-side joint."""

LONGEST_BEAM = 1.2
"""Beams are cut to this many passage widths for aiming: at a junction they reach down other corridors."""

SEARCH_REACH = 0.5
"""How far the closest path point may move between poses, in link lengths of arclength."""

STOP = 0.5
"""The motion ends when the tip is this near to the goal, in goal radii."""


def plan_beam(query: Query) -> Candidate:
    """Plan with the paper's rules, clamped to the exact free intervals.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; no warm start is used, and one run takes milliseconds, so no deadline either.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, not yet validated, or the reason why there is none.
    """
    maze, arm, geometry = query.maze, query.arm, query.geometry
    if geometry is None:
        return query.no_path()
    query.tell("plan", 0.2)
    clock = [time.perf_counter()]
    feeds, headings, failure = _sweep(geometry, arm)
    clock.append(time.perf_counter())
    query.tell("plan", 1.0)
    if failure is not None:
        ending, link, place = failure
        return Candidate(
            status=PlanningStatus.DEAD_END,
            reason=_reason(ending, link, place, maze),
            failure=Failure(place=place),
            timings={**geometry.timings, "plan": clock[1] - clock[0]},
        )
    motion = _motion(feeds, headings, arm.link_length, maze)
    clock.append(time.perf_counter())
    stages = dict(zip(("plan", "poses"), np.diff(clock).tolist(), strict=True))
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings={**geometry.timings, **stages})


def _sweep(
    geometry: Geometry, arm: ArmSpec
) -> tuple[FloatArray, FloatArray, tuple[int, int, tuple[float, float]] | None]:
    path, beams, length = geometry.path, geometry.beams, float(arm.link_length)
    corner_at, next_corner = _corner_numbers(geometry.corners, len(path.points))
    # A joint track that swings from wall to wall is longer than the path, but never by this much.
    n_links = math.ceil(1.6 * path.length / length) + 4
    feeds = np.empty(6 * POSES_PER_LINK * n_links)
    headings = np.empty((len(feeds), n_links))
    cap = LONGEST_BEAM * path.width
    n, ending, link, x, y = kernel.sweep_poses(
        length,
        math.inf if arm.joint_limit is None else float(arm.joint_limit),
        geometry.maze.base_pose,
        geometry.maze.goal,
        STOP * geometry.maze.goal_radius,
        path.points,
        beams.ends(+1, cap),
        beams.ends(-1, cap),
        corner_at,
        next_corner,
        max(1, round(SEARCH_REACH * length / path.s[1])),
        geometry.maze.walls,
        POSES_PER_LINK,
        SOFTENING,
        PAD,
        STEP * length,
        feeds,
        headings,
    )
    failure = None if ending == kernel.GOAL else (ending, link, (x, y))
    return feeds[:n], headings[:n], failure


def _corner_numbers(corners: list[Corner], n_points: int) -> tuple[IntArray, IntArray]:
    corner_at = np.zeros(n_points, dtype=np.int64)
    next_corner = np.zeros(n_points, dtype=np.int64)
    for number, corner in reversed(list(enumerate(corners, start=1))):
        corner_at[corner.first : corner.last + 1] = corner.turn * number
        next_corner[: corner.last + 1] = corner.turn * number
    return corner_at, next_corner


def _motion(feeds: FloatArray, headings: FloatArray, length: float, maze: Maze) -> Motion:
    n_links = math.ceil(feeds[-1] / length - 1e-9)
    from_base = headings[:, :n_links][:, ::-1]
    joint_angles = np.diff(from_base, axis=1, prepend=maze.base_pose[2])
    return Motion.from_configurations(feeds, joint_angles, length, maze.base_pose)


def _reason(ending: int, link: int, place: tuple[float, float], maze: Maze) -> str:
    where = f"({place[0]:.1f}, {place[1]:.1f}) {maze.units}"
    which = "the tip's link" if link == 0 else f"link {link + 1} from the tip"
    if ending == kernel.NO_GAP:
        return f"With its base-side joint at {where}, {which} has no free direction."
    if ending == kernel.JUMP:
        return f"With its base-side joint at {where}, {which} would have to jump to another free direction."
    return f"All arm that the path can take is fed, and the tip is at {where}, not at the goal."
