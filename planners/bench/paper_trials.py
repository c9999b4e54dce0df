"""One planner, or some of the paper's rules, in one maze: how it ends, and how deep it gets in the walls."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import LEGS, corridor_family
from planners.baselines.path_following import plan_path_following
from planners.beam_planner import AS_PRINTED, CLAMPED, Rules, run_beam
from planners.checks.arm_alone import check_steps
from planners.checks.scene import CHUNK, Scene, prepared
from planners.checks.tolerances import ROUNDING, STEP_LIMIT
from planners.checks.walls import nearest
from planners.clock import now
from planners.kernels.beam_arm import GOAL
from planners.kernels.types import FloatArray
from planners.planning import plan
from planners.problem import Motion, PlanningStatus
from planners.query import Query
from planners.survey import Geometry
from planners.validation import validate

__all__ = ["RULES", "Trial", "depth_at_poses", "depth_between", "maze_of", "try_planner", "warm_up_trials"]

RULES = {"beam": CLAMPED, "as-printed": AS_PRINTED}
"""The paper's rules by the name of their planner."""

JUMP_SAMPLES = 15
"""At so many places between two poses the depth is looked for where a joint jumps."""

MOST_CHECKED = 2_400_000
"""Links times poses of the longest motion that is checked where many are; the check takes up to a minute."""

TIME_BUDGET = 10.0
"""Seconds that a planner may take for one length."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trial:
    """Hold what came of one planner at one length.

    Parameters
    ----------
    status : str
        `solved` only for a motion that has passed the exact checker.
    motion : Motion or None
        As far as it goes, if there is one; the goal is reached if the status is `solved` or `not valid`.
    depth : float or None
        Largest depth at poses, in maze units.
    between : float or None
        The same between poses: a bound of it if `bounded`, else the largest that was met, no less than
        `depth`.
    bounded : bool
        Which of the two.
    came : float or None
        How far along the path the tip came, as a share of the path; None where a planner does not tell.
    why : str
        Why it is not solved.
    """

    status: str
    motion: Motion | None = None
    depth: float | None = None
    between: float | None = None
    bounded: bool = False
    came: float | None = None
    why: str = ""

    @property
    def solved(self) -> bool:
        """Whether a motion has passed the exact checker."""
        return self.status == PlanningStatus.SOLVED

    def row(self) -> dict[str, Any]:
        """Return all but the motion as plain data, with its numbers of links and poses."""
        data = {key: value for key, value in vars(self).items() if key != "motion"}
        return {
            **data,
            "n_links": None if self.motion is None else self.motion.n_links,
            "n_poses": None if self.motion is None else self.motion.n_poses,
        }


def maze_of(name: str) -> Maze:
    """Return a family's maze, or a named one."""
    return corridor_family(name) if name in LEGS else Maze.load(name)


def warm_up_trials() -> None:
    """Load the compiled kernels."""
    maze = Maze.load("fig19")
    for planner in ("auto", "sweep", "track", "follow", *RULES):
        try_planner(maze, 430.0, planner)


def try_planner(
    maze: Maze,
    link_length: float,
    planner: str | Rules,
    geometry: Geometry | None = None,
    *,
    depths: bool = True,
) -> Trial:
    """Ask a planner for one length, and the exact checker about its motion.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_length : float
        In maze units.
    planner : str or Rules
        A name that `plan` knows, or the rules that are followed.
    geometry : Geometry, optional
        Of the maze; otherwise it is computed.
    depths : bool
        Whether to measure how deep a motion gets that is not valid, which takes longer than to refuse it. If
        not, motions of more than `MOST_CHECKED` links times poses are not checked, and so not solved.
    """
    rules = RULES.get(planner) if isinstance(planner, str) else planner
    try:
        arm = ArmSpec(link_length=link_length)
        maze.check_arm(arm)
    except InputError as error:
        return Trial(status="does not fit", came=0.0, why=str(error))
    query = Query(maze=maze, arm=arm, deadline=now() + TIME_BUDGET)
    if geometry is not None:
        query.surveys[id(query.route)] = geometry
    if rules is not None:
        return _by_rules(query, rules, depths)
    if planner == "follow":
        return _by_path(query, depths)
    result = plan(maze, arm, str(planner), time_budget=TIME_BUDGET, explain=False)
    if result.motion is None or result.report is None:
        return Trial(status=str(result.status), why=result.reason)
    report = result.report
    return Trial(
        status=str(result.status),
        motion=result.motion,
        depth=report.penetration,
        between=report.penetration_between,
        bounded=True,
        came=1.0,
    )


def _by_rules(query: Query, rules: Rules, depths: bool) -> Trial:
    geometry = query.geometry
    if geometry is None:
        return Trial(status=str(PlanningStatus.NO_PATH), came=0.0)
    run = run_beam(geometry, query.arm, rules, record=False)
    motion = run.motion(query.maze)
    if run.ending == GOAL:
        return judged(motion, query.maze, depths)
    came = share_of_path(geometry, motion.joints[-1, -1])
    return Trial(status=str(PlanningStatus.DEAD_END), motion=motion, came=came, why=run.reason(query.maze))


def _by_path(query: Query, depths: bool) -> Trial:
    candidate = plan_path_following(query)
    if candidate.motion is not None:
        return judged(candidate.motion, query.maze, depths)
    came = 0.0
    if candidate.failure is not None and query.geometry is not None:
        came = share_of_path(query.geometry, np.asarray(candidate.failure.place))
    return Trial(status=str(candidate.status), came=came, why=candidate.reason)


def share_of_path(geometry: Geometry, place: FloatArray) -> float:
    """Return how far along the path a place, shape (2,), is, as a share of the path's length."""
    path = geometry.path
    return float(path.s[np.argmin(np.hypot(*(path.points - place).T))] / path.length)


def judged(motion: Motion, maze: Maze, depths: bool = True) -> Trial:
    """Let the exact checker decide about a motion to the goal, and say how deep it gets.

    The full check may take minutes where many links are deep between poses. A motion that is refused at its
    poses already, for depth or steps, is refused here too; for every other motion the full check decides.
    """
    _, step = check_steps(Scene(motion=motion, maze=maze, radius=0.0))
    if not depths and (step is not None or not is_free_at_poses(motion, maze)):
        why = "a link is in a wall at a pose, or a joint moves too far between two"
        return Trial(status=str(PlanningStatus.NOT_VALID), motion=motion, came=1.0, why=why)
    if not depths and motion.n_poses * motion.n_links > MOST_CHECKED:
        return Trial(status="not checked", motion=motion, came=1.0, why="its exact check takes minutes")
    depth = depth_at_poses(motion, maze)
    if depth == 0.0 and step is None:
        report = validate(motion, maze)
        bound = report.penetration_between
        why = "" if report.valid else report.faults[0].message
        status = PlanningStatus.SOLVED if report.valid else PlanningStatus.NOT_VALID
        if np.isfinite(bound):
            return Trial(
                status=str(status), motion=motion, depth=0.0, between=bound, bounded=True, came=1.0, why=why
            )
    else:
        status = PlanningStatus.NOT_VALID
        why = "a link is in a wall at a pose" if depth > 0.0 else "a joint moves too far between two poses"
    return Trial(
        status=str(status),
        motion=motion,
        depth=depth,
        between=depth_between(motion, maze, depth),
        came=1.0,
        why=why,
    )


def is_free_at_poses(motion: Motion, maze: Maze) -> bool:
    """Say whether no link is in a wall at any pose."""
    scene = Scene(motion=motion, maze=maze, radius=0.0)
    return all(shapely.covers(scene.free, shapely.linestrings(links)).all() for links in _links(scene))


def depth_at_poses(motion: Motion, maze: Maze) -> float:
    """Find the largest depth of a link in a wall at a pose, in maze units, with the exact checker's means."""
    return _depth(motion, maze, 0.0)


def depth_between(motion: Motion, maze: Maze, least: float = 0.0) -> float:
    """Find the largest depth that is met on the way from pose to pose, if it is larger than `least`.

    It is looked for in the middle, and where a joint jumps at many places: there may be larger ones between.
    """
    steps = np.linalg.norm(np.diff(motion.joints, axis=0), axis=2).max(axis=1)
    jumps = np.flatnonzero(steps > STEP_LIMIT * motion.link_length)
    every = np.arange(motion.n_poses - 1)
    pose = np.concatenate([every, np.repeat(jumps, JUMP_SAMPLES)])
    middle, places = np.full(len(every), 0.5), np.arange(1, JUMP_SAMPLES + 1) / (JUMP_SAMPLES + 1)
    share = np.concatenate([middle, np.tile(places, len(jumps))])
    feed = (1.0 - share) * motion.feed[pose] + share * motion.feed[pose + 1]
    angles = (1.0 - share)[:, None] * motion.joint_angles[pose] + share[:, None] * motion.joint_angles[
        pose + 1
    ]
    sampled = Motion.from_configurations(feed, angles, motion.link_length, motion.base_pose)
    return _depth(sampled, maze, least)


def _depth(motion: Motion, maze: Maze, least: float) -> float:
    """Find the largest depth over all poses, if it is larger than `least`; else return that."""
    scene, deepest = Scene(motion=motion, maze=maze, radius=0.0), least
    shallow = scene.free if least == 0.0 else prepared(maze.free_space.buffer(least))
    for links in _links(scene):
        segments = links[~shapely.covers(shallow, shapely.linestrings(links))]
        if not len(segments):
            continue
        clearance, _, _ = nearest(scene, segments, np.zeros(len(segments), dtype=bool))
        if -clearance > deepest:  # what is no deeper need not be looked at any more
            deepest = -clearance
            shallow = prepared(maze.free_space.buffer(deepest))
    return deepest


def _links(scene: Scene) -> Iterator[FloatArray]:
    """Yield the links that are out of the feeder, shape (n, 2, 2), some poses at a time."""
    for first in range(0, scene.motion.n_poses, CHUNK):
        arc = scene.arc[first : first + CHUNK]
        joints = scene.in_maze(scene.motion.joints[first : first + CHUNK], arc)
        yield np.stack([joints[:, :-1], joints[:, 1:]], axis=2)[arc[:, 1:] > ROUNDING * scene.length]
