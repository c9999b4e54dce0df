"""Sampling-based planners of the Open Motion Planning Library (OMPL) on a fed arm.

Everything that is not their business is made as easy for them as we could: states are such that none is lost
to the feeder, states and edges are checked by compiled kernels, and our own motion gives the number of links
and, where a planner wants goal states, whole arms at the goal.
"""

from __future__ import annotations

import importlib
import importlib.util
import math
import time
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from hrsnake_env.arm import joints_from_configuration
from hrsnake_env.errors import InputError
from planners.kernels import fed_arm as kernel
from planners.kernels.types import FloatArray
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.sweep_planner import plan_sweep
from planners.track_planner import plan_track
from planners.validation import STEP_LIMIT

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["OMPL_PLANNERS", "FedArm", "is_installed", "plan_ompl"]

OMPL_PLANNERS = ("KPIECE1", "BKPIECE1", "RRTConnect")
"""Those that can be asked for: the first wants a goal region, the others, which also grow from the goal, goal
states; the first two want a projection."""

TIME_LIMIT = 20.0
"""Seconds that sampling may take by default."""

RANGE = 0.3
"""Longest edge, in rad and link lengths. The default, a fifth of the extent, solves next to nothing here."""

STEP = 0.01
"""Largest movement of a joint between two checks along an edge, in link lengths."""

RELEASE = 4.0
"""How far a joint may bend, in rad per link length that it is past the base: gentler than the environment's,
so that angles do not change at once where a joint comes out; in a straight first leg it costs nothing."""

MOST_BENT = 3.0
"""Largest joint angle, in rad: short of folding a link back onto its neighbour."""

CELL = 0.25
"""Size of a cell of KPIECE1's projection, the place of the tip, in link lengths."""

SHARE_OF_LIMIT = 0.9
"""Of the checker's step limit, that poses keep."""

GOAL_STATES = 8
"""Whole arms at the goal that a planner that wants goal states is given."""


def is_installed() -> bool:
    """Tell whether OMPL can be imported."""
    return importlib.util.find_spec("ompl") is not None


def plan_ompl(
    query: Query, *, algorithm: str = "RRTConnect", seed: int = 1, time_limit: float = TIME_LIMIT
) -> Candidate:
    """Plan with a planner of OMPL.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; link radius and warm start are not used.
    algorithm : str
        One of `OMPL_PLANNERS`.
    seed : int
        Of its random numbers; positive.
    time_limit : float
        Seconds that sampling may take, if the query's deadline is not earlier.

    Returns
    -------
    candidate : Candidate
        What it takes for a solution, not validated; `timings["plan"]` is the time of sampling alone.

    Raises
    ------
    InputError
        If OMPL is not installed, the planner is unknown, or links have a radius.
    """
    if algorithm not in OMPL_PLANNERS:
        raise InputError(f"Unknown OMPL planner {algorithm!r}. Available: {', '.join(OMPL_PLANNERS)}.")
    if query.arm.link_radius > 0.0:
        raise InputError(f"Expected thin links for OMPL, got a link radius of {query.arm.link_radius:g}.")
    if not is_installed():
        raise InputError("Expected OMPL to be installed: pip install 'hrsnake[bench]'.")
    clock = [time.perf_counter()]
    given = plan_track(query).motion or plan_sweep(query).motion
    if given is None:
        return Candidate(
            status=PlanningStatus.DEAD_END,
            reason="Our planners, whose last pose gives number of links and goal states, found none.",
            failure=Failure(place=(float(query.maze.goal[0]), float(query.maze.goal[1]))),
        )
    arm = FedArm(query, given.n_links)
    goals = arm.goal_states(given, np.random.default_rng(seed))
    arm.edge_is_free(goals[0], goals[0])  # the first call compiles it
    importlib.import_module("ompl.geometric")
    clock.append(time.perf_counter())
    limit = min(time_limit, query.deadline - clock[-1])
    states = _solve(arm, goals, algorithm, seed, limit)
    clock.append(time.perf_counter())
    if states is None:
        return Candidate(
            status=PlanningStatus.OUT_OF_TIME,
            reason=f"OMPL's {algorithm} found no way in {limit:.3g} s.",
            failure=Failure(place=(float(query.maze.goal[0]), float(query.maze.goal[1]))),
            timings={"given": clock[1] - clock[0], "plan": clock[2] - clock[1]},
        )
    motion = arm.motion(states)
    clock.append(time.perf_counter())
    timings = dict(zip(("given", "plan", "poses"), np.diff(clock).tolist(), strict=True))
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings=timings)


@dataclass(frozen=True, eq=False)
class FedArm:
    """Hold what states of a fed arm mean in a maze (`planners.kernels.fed_arm`).

    Parameters
    ----------
    query : Query
        Maze and arm.
    n_links : int
        Number of links, and so of a state's coordinates.
    """

    query: Query
    n_links: int

    @cached_property
    def terms(self) -> tuple[float, float, FloatArray]:
        """Link length, release and base pose: what the kernels want of the arm."""
        return float(self.query.arm.link_length), RELEASE, self.query.maze.base_pose

    @cached_property
    def walls(self) -> FloatArray:
        """Start and end of each wall."""
        return self.query.maze.walls

    @cached_property
    def most_bent(self) -> float:
        """Largest joint angle."""
        limit = self.query.arm.joint_limit
        return MOST_BENT if limit is None else min(MOST_BENT, limit)

    @cached_property
    def points(self) -> FloatArray:
        """Work space of the kernels."""
        return np.empty((self.n_links + 1, 2))

    def is_free(self, state: FloatArray) -> bool:
        """Tell whether the arm in front of the base meets neither walls nor itself."""
        return bool(kernel.state_is_free(state, *self.terms, self.walls, self.points))

    def edge_is_free(self, a: FloatArray, b: FloatArray) -> bool:
        """Tell whether the arm is free at b and, in small steps, from a, which is free, to b."""
        step = STEP * self.terms[0]
        return bool(kernel.edge_is_free(a, b, *self.terms, self.walls, step, self.points))

    def tip(self, state: FloatArray) -> tuple[float, float]:
        """Return where the tip is."""
        last = kernel.place_arm(state, *self.terms, self.points) - 1
        return float(self.points[last, 0]), float(self.points[last, 1])

    def goal_distance(self, state: FloatArray) -> float:
        """Return how far the tip is from the goal."""
        return math.dist(self.tip(state), self.query.maze.goal)

    def goal_states(self, motion: Motion, rng: np.random.Generator) -> list[FloatArray]:
        """Return the last pose of a motion, and others near it that are free and at the goal, too."""
        length = self.terms[0]
        last = np.concatenate([[motion.feed[-1] / length], motion.joint_angles[-1, 1:]])
        found, spread = [last], 0.1
        for _ in range(2000):
            if len(found) == GOAL_STATES:
                break
            state = last + rng.normal(scale=spread, size=len(last))
            state[0] = min(max(state[0], 0.0), self.n_links)
            spread = max(0.995 * spread, 1e-3)
            if self.goal_distance(state) < self.query.maze.goal_radius and self.is_free(state):
                found.append(state)
        return found

    def motion(self, states: list[FloatArray]) -> Motion:
        """Return the poses at which the edges were checked, and those where a joint passes the base."""
        length, _, base_pose = self.terms
        path = np.concatenate([states[0][None], *(self._edge(a, b) for a, b in pairwise(states))])
        return Motion.from_configurations(*self._configurations(path), length, base_pose)

    def _edge(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Return states after a, up to b, so near to each other that poses keep the checker's step limit."""
        length, _, base_pose = self.terms
        levels = kernel.edge_levels(a, b, *self.terms, STEP * length, self.points)
        while True:
            shares = np.arange((1 << levels) + 1) / (1 << levels)
            if a[0] != b[0]:
                passing = np.arange(math.ceil(min(a[0], b[0])), math.floor(max(a[0], b[0])) + 1)
                shares = np.union1d(shares, (passing - a[0]) / (b[0] - a[0]))
            edge = a + shares[:, None] * (b - a)
            whole = np.round(edge[:, 0])
            edge[:, 0] = np.where(np.abs(edge[:, 0] - whole) < 1e-12, whole, edge[:, 0])
            joints = joints_from_configuration(*self._configurations(edge), length, base_pose)
            steps = np.linalg.norm(np.diff(joints, axis=0), axis=-1)
            if steps.max() <= SHARE_OF_LIMIT * STEP_LIMIT * length or levels == kernel.MOST_LEVELS:
                return np.asarray(edge[1:])
            levels += 1

    def _configurations(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return feed, shape (n,), and joint angles, shape (n, n_links), of states, shape (n, n_links)."""
        past = states[:, :1] - (self.n_links - np.arange(self.n_links))
        limits = RELEASE * np.maximum(past, 0.0)
        angles = np.clip(np.column_stack([np.zeros(len(states)), states[:, 1:]]), -limits, limits)
        return states[:, 0] * self.terms[0], angles


def _solve(
    arm: FedArm, goals: list[FloatArray], algorithm: str, seed: int, time_limit: float
) -> list[FloatArray] | None:
    """Return the states of the path that a planner of OMPL finds, or None."""
    from ompl import base, geometric, util

    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed)
    space = base.RealVectorStateSpace(arm.n_links)
    bounds = base.RealVectorBounds(arm.n_links)
    bounds.setLow(-arm.most_bent)
    bounds.setHigh(arm.most_bent)
    bounds.setLow(0, 0.0)
    bounds.setHigh(0, float(arm.n_links))
    space.setBounds(bounds)
    information = base.SpaceInformation(space)
    parts = _parts(base, information, arm)
    information.setStateValidityChecker(parts["is_free"])
    information.setMotionValidator(parts["edges"])
    information.setup()
    problem = base.ProblemDefinition(information)
    problem.addStartState(_state(space, np.zeros(arm.n_links)))
    planner = getattr(geometric, algorithm)(information)
    planner.setRange(RANGE)
    if algorithm != "RRTConnect":
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
    planner.solve(base.timedPlannerTerminationCondition(max(time_limit, 1e-3)))
    if not problem.hasExactSolution():
        return None
    path = problem.getSolutionPath()
    return [_array(path.getState(k), arm.n_links) for k in range(path.getStateCount())]


def _state(space: Any, values: FloatArray) -> Any:
    state = space.allocState()
    state[0 : len(values)] = values.tolist()
    return state


def _array(state: Any, size: int) -> FloatArray:
    return np.array(state[0:size])


def _parts(base: ModuleType, information: Any, arm: FedArm) -> dict[str, Any]:
    """Build what a planner calls: validity of states and edges, the goal region and the projection."""
    n, length = arm.n_links, arm.terms[0]
    a, b = (
        np.empty(n),
        np.empty(n),
    )  # filled in place: a new array for each state would cost more than a check

    def is_free(state: Any) -> bool:
        a[:] = state[0:n]
        return arm.is_free(a)

    class Edges(base.MotionValidator):  # type: ignore[name-defined, misc]
        def checkMotion(self, start: Any, end: Any) -> bool:
            a[:], b[:] = start[0:n], end[0:n]
            return arm.edge_is_free(a, b)

    class Region(base.GoalRegion):  # type: ignore[name-defined, misc]
        def distanceGoal(self, state: Any) -> float:
            a[:] = state[0:n]
            return arm.goal_distance(a)

    class TipPlace(base.ProjectionEvaluator):  # type: ignore[name-defined, misc]
        def getDimension(self) -> int:
            return 2

        def project(self, state: Any, projection: FloatArray) -> None:
            a[:] = state[0:n]
            x, y = arm.tip(a)
            projection[0], projection[1] = x / length, y / length

    region = Region(information)
    region.setThreshold(arm.query.maze.goal_radius)
    return {
        "is_free": is_free,
        "edges": Edges(information),
        "region": region,
        "projection": TipPlace(information.getStateSpace()),
    }
