"""Sampling-based planners of the Open Motion Planning Library (OMPL) on a fed arm.

Everything that is not their business is made as easy for them as we could: states are such that none is lost
to the feeder, states and edges are checked by compiled kernels, whole arms at the goal are grown for them,
and what they find is shortened. Nothing is taken from our own motions.

References
----------
.. [1] I. Sucan, M. Moll and L. Kavraki, "The Open Motion Planning Library", IEEE Robotics & Automation
   Magazine 19(4), 2012.
.. [2] J. Kuffner and S. LaValle, "RRT-Connect: an efficient approach to single-query path planning", IEEE
   International Conference on Robotics and Automation, 2000.
.. [3] T. Wilson, W. Thomason, Z. Kingston and J. Gammell, "AORRTC: almost-surely asymptotically optimal
   planning with RRT-Connect", IEEE Robotics and Automation Letters 10(12), 2025.
"""

from __future__ import annotations

import functools
import importlib
import importlib.util
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hrsnake_env.arguments import place_text
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.baselines.fed_states import MARGIN, FedArm, fed_arm, state_bounds
from planners.baselines.goal_states import grown_goal_states, guide_along
from planners.clock import now
from planners.kernels.types import FloatArray
from planners.problem import Candidate, Failure, PlanningStatus
from planners.query import Query

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["OMPL_PLANNERS", "is_installed", "plan_aorrtc", "plan_ompl", "plan_rrt_connect", "warm_up"]

OMPL_PLANNERS = ("KPIECE1", "BKPIECE1", "RRTConnect", "AORRTC")
"""Those that can be asked for: the first wants a goal region, the others, which also grow from the goal, goal
states; the first two want a projection."""

TIME_LIMIT = 60.0
"""Seconds that planning may take, if the query's deadline is not earlier."""

RANGE = 0.25
"""Longest edge, in rad and link lengths. The default, a fifth of the extent, solves next to nothing here."""

CELL = 0.25
"""Size of a cell of KPIECE1's projection, the place of the tip, in link lengths."""

GOAL_STATES = 16
"""Whole arms at the goal that are grown, at most."""

FINER = 4.0
"""By how much more links keep off the walls after the exact checker has refused a motion."""

PATIENCE = 2.0
"""Seconds that a planner gets with goal states once grown. Then others are grown, for twice as long."""

SHORTENING = 0.2
"""Seconds for which a path is shortened, at most; and no longer than it was searched."""


def is_installed() -> bool:
    """Tell whether OMPL can be imported."""
    return importlib.util.find_spec("ompl") is not None


def plan_rrt_connect(query: Query) -> Candidate:
    """Plan with RRT-Connect: two trees of random states, from the base and the goal, that try to meet [2]_.

    Parameters and outcome are those of `plan_ompl`, which also says what a seed means.
    """
    return plan_ompl(query, algorithm="RRTConnect")


def plan_aorrtc(query: Query) -> Candidate:
    """Plan with AORRTC: RRT-Connect over states and cost [3]_, up to its first solution.

    Parameters and outcome are those of `plan_ompl`, which also says what a seed means.
    """
    return plan_ompl(query, algorithm="AORRTC")


def plan_ompl(query: Query, *, algorithm: str = "RRTConnect", time_limit: float = TIME_LIMIT) -> Candidate:
    """Plan with a planner of OMPL.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; a warm start is not used. OMPL gives the same random numbers for the same seed
        to the first planner of a process only, and the clock says how many shortcuts are tried: the same seed
        does not always lead to the same motion.
    algorithm : str
        One of `OMPL_PLANNERS`.
    time_limit : float
        Seconds that planning may take, if the query's deadline is not earlier.

    Returns
    -------
    candidate : Candidate
        Not validated, unless the query has a checker: if that refuses a motion, planning goes on with links
        that keep farther off the walls. Stages of `timings`: grow (goal states), plan (sampling), shortcut,
        poses. Importing OMPL and loading kernels (`warm_up`) are not counted.

    Raises
    ------
    InputError
        If OMPL is not installed or the planner is unknown.
    """
    if algorithm not in OMPL_PLANNERS:
        raise InputError(f"Unknown OMPL planner {algorithm!r}. Available: {', '.join(OMPL_PLANNERS)}.")
    warm_up()
    return _plan(query, algorithm, min(query.deadline, now() + time_limit))


@functools.cache
def warm_up() -> None:
    """Import OMPL and load the kernels, once per process.

    Raises
    ------
    InputError
        If OMPL is not installed.
    """
    if not is_installed():
        raise InputError("Expected OMPL to be installed: pip install 'hrsnake[bench]'.")
    importlib.import_module("ompl.geometric")
    maze = Maze.from_corridors([(0.0, 0.0), (0.0, 300.0), (300.0, 300.0)], 100.0)
    arm = ArmSpec(link_length=100.0)
    _plan(Query(maze=maze, arm=arm), "RRTConnect", now() + TIME_LIMIT)


def _plan(query: Query, algorithm: str, deadline: float) -> Candidate:
    """Grow goal states, search, shorten, and ask the checker, until it agrees or time is over."""
    geometry, length = query.geometry, float(query.arm.link_length)
    if geometry is None:
        return query.no_path()
    guide = guide_along(geometry.path.points, query.maze.goal, query.maze.goal_radius, length)
    rng, timings, margin = np.random.default_rng(query.seed), dict(geometry.timings), MARGIN
    start, patience, reason = now(), PATIENCE, "OMPL's {} found no way in {:.3g} s."
    query.tell("plan", 0.1)
    while True:
        clock = [now()]
        arm = fed_arm(geometry.maze, length, query.arm.link_radius, query.arm.joint_limit, margin)
        goals, farthest = grown_goal_states(arm, guide, GOAL_STATES, rng, deadline)
        clock.append(now())
        if not goals:
            _count(timings, clock)
            return _no_goal_states(query.maze, farthest, clock[-1] > deadline, timings)
        path = _path(arm, goals, algorithm, query, min(patience, deadline - clock[-1]), rng)
        clock.append(now())
        if path is not None:
            path = arm.shortened(path, rng, min(SHORTENING, clock[2] - clock[1], deadline - clock[2]))
            clock.append(now())
            motion = arm.motion(path)
            clock.append(now())
        _count(timings, clock)
        if path is None and clock[-1] < deadline:
            patience *= 2.0  # other goal states, perhaps of another number of links, may be nearer
            continue
        if path is None:
            return Candidate(
                status=PlanningStatus.OUT_OF_TIME,
                reason=reason.format(algorithm, clock[-1] - start),
                failure=Failure(place=(float(farthest[-1, 0]), float(farthest[-1, 1]))),
                timings=timings,
            )
        report = query.check(motion)
        if report is None or report.valid or now() > deadline:
            return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings=timings)
        margin *= FINER
        reason = "OMPL's {} found no way in {:.3g} s that the exact check agrees with."


def _count(timings: dict[str, float], clock: list[float]) -> None:
    """Add what the stages of a try have taken."""
    for stage, seconds in zip(("grow", "plan", "shortcut", "poses"), np.diff(clock).tolist(), strict=False):
        timings[stage] = timings.get(stage, 0.0) + seconds


def _no_goal_states(maze: Maze, farthest: FloatArray, late: bool, timings: dict[str, float]) -> Candidate:
    """Say that no whole arm at the goal could be grown."""
    x, y = (float(value) for value in farthest[-1])
    return Candidate(
        status=PlanningStatus.OUT_OF_TIME if late else PlanningStatus.DEAD_END,
        reason=f"No whole arm could be grown to the goal{' in time' if late else ''}: the farthest ends at "
        f"{place_text((x, y), maze.size)} {maze.units}.",
        failure=Failure(place=(x, y), joints=farthest),
        timings=timings,
    )


def _path(
    arm: FedArm,
    goals: list[FloatArray],
    algorithm: str,
    query: Query,
    seconds: float,
    rng: np.random.Generator,
) -> FloatArray | None:
    """Return the states of the path that a planner of OMPL finds, shape (n, n_links), or None."""
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_NONE)  # it complains of every seed but the first
    util.RNG.setSeed(int(rng.integers(1, 2**31)))
    n_links = len(goals[0])
    space = base.RealVectorStateSpace(n_links)
    bounds = base.RealVectorBounds(n_links)
    for axis, (low, high) in enumerate(state_bounds(n_links, arm.most_bent).tolist()):
        bounds.setLow(axis, low)
        bounds.setHigh(axis, high)
    space.setBounds(bounds)
    information = base.SpaceInformation(space)
    parts = _parts(base, information, arm, n_links, query)
    information.setStateValidityChecker(parts["is_clear"])
    information.setMotionValidator(parts["edges"])
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.addStartState(_state(space, np.zeros(n_links)))
    planner = getattr(geometric, algorithm)(information)
    planner.setRange(RANGE)
    if algorithm in ("KPIECE1", "BKPIECE1"):
        projection = parts["projection"]
        projection.inferCellSizes()  # without it there are none, and they cannot be set
        for axis in range(2):
            projection.setCellSizes(axis, CELL)
        planner.setProjectionEvaluator(projection)
    if algorithm == "KPIECE1":
        problem.setGoal(parts["region"])
    else:
        ends = base.GoalStates(information)
        for goal in goals:
            ends.addState(_state(space, goal))
        problem.setGoal(ends)
    planner.setProblemDefinition(problem)
    planner.setup()
    planner.solve(
        base.plannerOrTerminationCondition(
            base.timedPlannerTerminationCondition(max(seconds, 1e-3)),
            base.exactSolnPlannerTerminationCondition(problem),  # AORRTC goes on without it
        )
    )
    if not problem.hasExactSolution():
        return None
    found = problem.getSolutionPath()
    path = np.array([found.getState(k)[0:n_links] for k in range(found.getStateCount())])
    if (path[0] != 0.0).any():
        # Where one straight edge reaches a goal state, AORRTC may give that state alone.
        if not arm.edge_is_clear(np.zeros(n_links), path[0]):
            return None
        path = np.concatenate([np.zeros((1, n_links)), path])
    moved = np.concatenate([[True], (np.diff(path, axis=0) != 0.0).any(axis=1)])
    return np.ascontiguousarray(path[moved])


def _state(space: Any, values: FloatArray) -> Any:
    state = space.allocState()
    state[0 : len(values)] = values.tolist()
    return state


def _parts(base: ModuleType, information: Any, arm: FedArm, n: int, query: Query) -> dict[str, Any]:
    """Build what a planner calls: validity of states and edges, the goal region and the projection."""
    a, b = np.empty(n), np.empty(n)  # filled in place: a new array for each state costs more than a check

    def is_clear(state: Any) -> bool:
        a[:] = state[0:n]
        return arm.is_clear(a)

    class Edges(base.MotionValidator):  # type: ignore[name-defined, misc]
        def checkMotion(self, start: Any, end: Any) -> bool:
            a[:], b[:] = start[0:n], end[0:n]
            return arm.edge_is_clear(a, b)

    class Region(base.GoalRegion):  # type: ignore[name-defined, misc]
        def distanceGoal(self, state: Any) -> float:
            a[:] = state[0:n]
            return math.dist(arm.tip(a), query.maze.goal)

    class TipPlace(base.ProjectionEvaluator):  # type: ignore[name-defined, misc]
        def getDimension(self) -> int:
            return 2

        def project(self, state: Any, projection: FloatArray) -> None:
            a[:] = state[0:n]
            projection[0], projection[1] = arm.tip(a) / arm.link_length

    region = Region(information)
    region.setThreshold(query.maze.goal_radius)
    return {
        "is_clear": is_clear,
        "edges": Edges(information),
        "region": region,
        "projection": TipPlace(information.getStateSpace()),
    }
