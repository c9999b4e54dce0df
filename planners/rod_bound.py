"""The physical limit: the longest rod that passes from the base to the goal, from below and from above.

The last link of any arm is such a rod, so no planner can do better. A rod's place is that of its tail and
its heading. Over a triangulation of the free space, `planners.kernels.rod_space` says which headings are
possible at all from a triangle (an outer estimate) and which are exact at its centre (an inner one);
`planners.kernels.rod_search` looks for a way. A way through exact headings is a motion; no way even through
possible ones is a proof that there is none; a way with doubts says which triangles to halve.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.clock import now
from planners.inset import inset_maze
from planners.kernels.rod import free_directions
from planners.kernels.rod_search import BASE, FIRST, GOAL, PER_TRIANGLE, Frontier, Task, search
from planners.kernels.rod_shorten import shorten
from planners.kernels.rod_space import GAPS, SLACK, RodSpace, refine, update_headings
from planners.kernels.types import FloatArray, IntArray
from planners.problem import Progress

__all__ = ["Passage", "RodBound", "RodPath", "RodVerdict", "rod_bound", "rod_passes"]

COARSEST = 0.35
"""Size of the first triangles in mean widths of the free space: a few of them across a corridor."""

MOST_AT_FIRST = 6000
"""About how many triangles there may be before any is needed."""

RESOLUTION = 1e-4
"""Size of the smallest triangles of a single question, in rod lengths."""

FINEST = 1e-6
"""Size below which the bound gives up halving, in rod lengths."""

FRACTIONS = (0.5, 0.3, 0.7)
"""Where in the interval to ask: the middle, or where it is too close to the limit, off it."""

SHORTENINGS = 4
"""How often a path is shortened; each time stretches can grow together further."""

PART = 1.0 / 16.0
"""Smallest triangles of a question in parts of the interval: a limit that close is not worth deciding."""


class Passage(StrEnum):
    """Say whether a rod passes."""

    YES = "yes"
    NO = "no"
    UNDECIDED = "undecided"


@dataclass(frozen=True, eq=False, kw_only=True)
class RodPath:
    """Hold a motion of one rod; the arrays are read-only.

    From each place to the next the rod is either moved without turning, or turned about its tail. Where the
    goal is on the straight way in front of the base, the rod need not leave the feeder: from its first place
    it is pulled back, its tail behind the base.

    Parameters
    ----------
    length : float
        Of the rod.
    tails : array-like, shape (n, 2)
        From the base, in maze units.
    headings : array-like, shape (n,)
        From tail to tip, in rad, without jumps of 2 pi.
    """

    length: float
    tails: FloatArray
    headings: FloatArray

    def __post_init__(self) -> None:
        for key in ("tails", "headings"):
            array = np.array(getattr(self, key), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, key, array)

    @property
    def tips(self) -> FloatArray:
        """The rod's other end, shape (n, 2)."""
        along = np.stack([np.cos(self.headings), np.sin(self.headings)], axis=-1)
        return np.asarray(self.tails + self.length * along)

    @property
    def way(self) -> FloatArray:
        """Waypoints from the base to the goal, shape (m, 2): the tails and the last tip."""
        first, last = self.tails[0], self.tails[-1]
        heading = (math.cos(self.headings[0]), math.sin(self.headings[0]))
        pulled_back = len(self.tails) == 2 and (last - first) @ heading < 0.0
        return np.concatenate([self.tails[:1] if pulled_back else self.tails, self.tips[-1:]])


@dataclass(frozen=True, eq=False, kw_only=True)
class RodVerdict:
    """Say whether one rod passes.

    Parameters
    ----------
    passes : Passage
        YES with a checked path, NO with proof, or UNDECIDED at the resolution or the deadline.
    length : float
        Of the rod.
    path : RodPath or None
        Not None if and only if the rod passes.
    n_triangles : int
        How many triangles of tails it took.
    """

    passes: Passage
    length: float
    path: RodPath | None = None
    n_triangles: int = 0


@dataclass(frozen=True, eq=False, kw_only=True)
class RodBound:
    """Hold the longest rod that passes, from below and from above.

    Parameters
    ----------
    lower : float
        A rod of this length passes: `path` is its motion. 0 if none was found.
    upper : float
        No longer rod passes, and so no arm with longer links.
    limited_by : str
        `feeder` if the straight free way in front of the base is what limits it: no shorter rod was shown
        not to pass. Else `maze`.
    proven : bool
        Whether lower and upper are as close as was asked for. Both hold in any case.
    path : RodPath or None
        Motion of the rod of length `lower`.
    """

    lower: float
    upper: float
    limited_by: str
    proven: bool
    path: RodPath | None


def rod_bound(
    maze: Maze,
    link_radius: float = 0.0,
    *,
    accuracy: float = 0.005,
    deadline: float = math.inf,
    progress: Progress | None = None,
) -> RodBound:
    """Compute the length of the longest rod that passes from the base to the goal.

    The rod comes out of the feeder along the base heading, and turns only once its tail has passed the base;
    it may touch walls; at the end its tip is within the goal radius of the goal. Where the goal is on the
    straight way in front of the base, any rod passes that fits there: it may end still in the feeder.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_radius : float
        In maze units; the walls are grown by it as `inset_maze` does.
    accuracy : float
        (upper - lower) / upper to be reached, in (0, 1).
    deadline : float
        Reading of `planners.clock.now` after which the best interval so far is returned.
    progress : callable, optional
        Called with stage and share done.

    Raises
    ------
    InputError
        If `accuracy` is not between 0 and 1.

    Notes
    -----
    The proof is up to rounding: intervals of headings are shortened, and distances shrunk, by 1e-9.

    Examples
    --------
    >>> bound = rod_bound(Maze.load("fig19"))
    >>> bound.lower <= 440.0 <= bound.upper, bound.limited_by
    (True, 'maze')
    """
    if not 0.0 < accuracy < 1.0:
        raise InputError(f"Expected an accuracy between 0 and 1, got {accuracy!r}.")
    inset = inset_maze(maze, link_radius)
    if inset is None:
        return RodBound(lower=0.0, upper=0.0, limited_by="maze", proven=True, path=None)
    questions = _Questions(inset)
    lower, upper, best, part = 0.0, questions.straight, None, PART
    if (ahead := questions.straight_path(upper)) is not None:
        lower, best = upper, ahead
    while upper - lower > accuracy * upper and now() < deadline:
        if progress is not None:
            progress("rod bound", _share((upper - lower) / upper, accuracy))
        for fraction in FRACTIONS:
            length = lower + fraction * (upper - lower)
            verdict = questions.ask(length, part * (upper - lower), deadline)
            if verdict.passes is not Passage.UNDECIDED:
                break
        if verdict.passes is Passage.YES:
            lower, best = length, verdict.path
        elif verdict.passes is Passage.NO:
            upper = length
        else:
            part /= 4.0
            if part * (upper - lower) < FINEST * upper:
                break
    return RodBound(
        lower=lower,
        upper=upper,
        limited_by="feeder" if upper == questions.straight else "maze",
        proven=upper - lower <= accuracy * upper,
        path=best,
    )


def rod_passes(
    maze: Maze,
    length: float,
    link_radius: float = 0.0,
    *,
    resolution: float = RESOLUTION,
    deadline: float = math.inf,
) -> RodVerdict:
    """Decide whether a rod passes from the base to the goal.

    Parameters
    ----------
    maze : Maze
        The maze.
    length : float
        Of the rod, in maze units.
    link_radius : float
        In maze units.
    resolution : float
        Triangles of tails smaller than this, in rod lengths, are not halved any more.
    deadline : float
        Reading of `planners.clock.now` after which it is undecided.

    Raises
    ------
    InputError
        If `length` is not positive and finite.

    Examples
    --------
    >>> str(rod_passes(Maze.load("fig19"), 438.0).passes), str(rod_passes(Maze.load("fig19"), 442.0).passes)
    ('yes', 'no')
    """
    if not (math.isfinite(length) and length > 0.0):
        raise InputError(f"Expected a positive, finite length, got {length!r}.")
    inset = inset_maze(maze, link_radius)
    if inset is None:
        return RodVerdict(passes=Passage.NO, length=length)
    return _Questions(inset).ask(length, resolution * length, deadline)


def _share(gap: float, accuracy: float) -> float:
    return 1.0 - math.log(max(gap, accuracy) / accuracy) / math.log(1.0 / accuracy)


class _Questions:
    """Answer whether a rod of some length passes; own the triangles and the work space of the search.

    Parameters
    ----------
    maze : Maze
        With walls grown by the link radius.
    """

    def __init__(self, maze: Maze) -> None:
        self.maze = maze
        self.straight = _straight_way(maze)
        self._first = _first_triangles(maze)
        self._work = _work_space(0)

    def ask(self, length: float, resolution: float, deadline: float) -> RodVerdict:
        """Decide whether a rod passes; start from the first triangles and halve those that are in doubt."""
        if length > self.straight:
            return RodVerdict(passes=Passage.NO, length=length)
        if (ahead := self.straight_path(length)) is not None:
            return RodVerdict(passes=Passage.YES, length=length, path=ahead)
        task = _task(self.maze, self._first.walls, length, resolution)
        space, every = _copy(self._first), True
        while True:
            update_headings(space, length, every)
            nodes, headings, doubts = self._way(space, task)
            if nodes.size == 0:
                passes = Passage.NO
                break
            if not ((nodes >= FIRST) & ((nodes - FIRST) % PER_TRIANGLE < GAPS)).any():
                passes = Passage.YES
                break
            if not doubts.size or now() > deadline:
                passes = Passage.UNDECIDED
                break
            space, every = _halved(space, doubts), False
        return RodVerdict(
            passes=passes,
            length=length,
            path=_path(space, task, nodes, headings) if passes is Passage.YES else None,
            n_triangles=int(space.counts[1]),
        )

    def straight_path(self, length: float) -> RodPath | None:
        """Return the motion of a rod that reaches the goal on the straight way; None if it does not."""
        x, y, heading = self.maze.base_pose
        base, along = np.array([x, y]), np.array([math.cos(heading), math.sin(heading)])
        out = min(max(0.0, float((self.maze.goal - base) @ along)), length)
        if math.dist(base + out * along, self.maze.goal) > self.maze.goal_radius:
            return None
        tails = np.array([base, base - (length - out) * along])
        return RodPath(length=length, tails=tails, headings=np.array([heading, heading]))

    def _way(self, space: RodSpace, task: Task) -> tuple[IntArray, FloatArray, IntArray]:
        """Return nodes and headings of the cheapest way, base first, and the triangles to be halved."""
        n_nodes = FIRST + int(space.counts[1]) * PER_TRIANGLE
        if self._work[0].cost.size < n_nodes:
            self._work = _work_space(2 * n_nodes)
        frontier, nodes, headings = self._work
        n = search(space, task, frontier, nodes, headings)
        doubts = np.unique(frontier.doubts[: frontier.used[2]])
        return nodes[:n][::-1].copy(), headings[:n][::-1].copy(), doubts


# From the maze to triangles


def _straight_way(maze: Maze) -> float:
    """Return the length of the straight free way in front of the base; it may touch walls."""
    x, y, heading = maze.base_pose
    reach = 2.0 * maze.size
    ray = LineString([(x, y), (x + reach * math.cos(heading), y + reach * math.sin(heading))])
    parts = shapely.get_parts(shapely.line_merge(ray.intersection(maze.free_space)))
    return float(min(parts, key=Point(x, y).distance).length)


def _first_triangles(maze: Maze) -> RodSpace:
    """Triangulate the free space into triangles of a third of a corridor's width."""
    parts = shapely.get_parts(shapely.constrained_delaunay_triangles(maze.free_space))
    corners = shapely.get_coordinates(parts).reshape(-1, 4, 2)[:, :3]
    vertices, index = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    triangles = index.reshape(-1, 3).astype(np.int64)
    doubled_areas = _doubled_areas(vertices[triangles])
    triangles[doubled_areas < 0.0] = triangles[doubled_areas < 0.0][:, ::-1]
    neighbours = _neighbours(triangles)
    _check_triangles(maze, vertices, triangles, neighbours)
    walls = [np.stack([ring[:-1], ring[1:]], axis=1) for ring in maze.rings]
    n = len(triangles)
    space = RodSpace(
        walls=np.concatenate(walls),
        rings=np.cumsum([0, *map(len, walls)]),
        boxes=np.array([[*wall.min(axis=(0, 1)), *wall.max(axis=(0, 1))] for wall in walls]),
        counts=np.array([len(vertices), n]),
        vertices=vertices,
        triangles=triangles,
        neighbours=neighbours,
        changed=np.zeros(n, dtype=np.bool_),
        centres=np.zeros((n, 2)),
        sizes=np.zeros(n),
        possible=np.zeros((n, GAPS, 2)),
        exact=np.zeros((n, GAPS, 2)),
        n_possible=np.zeros(n, dtype=np.int64),
        n_exact=np.zeros(n, dtype=np.int64),
        around=np.zeros((n, GAPS), dtype=np.int64),
    )
    area = maze.free_space.area
    return _halved_to(space, max(COARSEST * 2.0 * area / maze.free_space.length, _size_for(area)))


def _size_for(area: float) -> float:
    """Return the size of right-angled triangles, of which `MOST_AT_FIRST` fill an area."""
    return 2.0 * math.sqrt(area / MOST_AT_FIRST)


def _doubled_areas(corners: FloatArray) -> FloatArray:
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])


def _neighbours(triangles: IntArray) -> IntArray:
    """Return the triangle across each edge, shape (n, 3); -1 where there is none."""
    edges = [((a, b), (b, c), (c, a)) for a, b, c in triangles.tolist()]
    owner = {edge: triangle for triangle, three in enumerate(edges) for edge in three}
    return np.array([[owner.get((b, a), -1) for a, b in three] for three in edges], dtype=np.int64)


def _check_triangles(maze: Maze, vertices: FloatArray, triangles: IntArray, neighbours: IntArray) -> None:
    """Check what the proof rests on: the triangles fill the free space, and meet except along walls."""
    corners = vertices[triangles]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)
    area, length = 0.5 * float(_doubled_areas(corners).sum()), float(edges[neighbours < 0].sum())
    free = maze.free_space
    if not (math.isclose(area, free.area, rel_tol=1e-9) and math.isclose(length, free.length, rel_tol=1e-9)):
        raise InputError(
            f"Expected a free space that can be cut into triangles, got {area:g} of the area {free.area:g} "
            f"and {length:g} of the walls' length {free.length:g} of maze '{maze.name}'."
        )


def _halved(space: RodSpace, wanted: IntArray) -> RodSpace:
    """Halve triangles; return the same arrays, or longer ones where there was no room."""
    done = 0
    while (done := refine(space, wanted, done)) < wanted.size:
        space = _with_room(space)
    return space


def _halved_to(space: RodSpace, size: float) -> RodSpace:
    while True:
        n = int(space.counts[1])
        corners = space.vertices[space.triangles[:n]]
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).max(axis=1)
        wanted = np.flatnonzero(longest > size)
        if not wanted.size:
            return space
        space = _halved(space, wanted)
        space.changed[:] = False


def _copy(space: RodSpace) -> RodSpace:
    return RodSpace(**{key: array.copy() for key, array in space._asdict().items()})


def _with_room(space: RodSpace) -> RodSpace:
    """Return a copy with twice as much room for triangles."""
    fixed = ("walls", "rings", "boxes", "counts")
    arrays = {
        key: array
        if key in fixed
        else np.concatenate([array, np.zeros_like(array), np.zeros_like(array[:2])])
        for key, array in space._asdict().items()
    }
    return RodSpace(**arrays)


# The search


def _work_space(n_nodes: int) -> tuple[Frontier, IntArray, FloatArray]:
    frontier = Frontier(
        cost=np.full(n_nodes, np.inf),
        heading=np.zeros(n_nodes),
        parent=np.zeros(n_nodes, dtype=np.int64),
        heap=np.zeros(n_nodes, dtype=np.int64),
        place=np.zeros(n_nodes, dtype=np.int64),
        used=np.zeros(3, dtype=np.int64),
        touched=np.zeros(n_nodes, dtype=np.int64),
        doubts=np.zeros(n_nodes, dtype=np.int64),
    )
    return frontier, np.zeros(n_nodes, dtype=np.int64), np.zeros(n_nodes)


def _task(maze: Maze, walls: FloatArray, length: float, resolution: float) -> Task:
    """Say what the rod shall do, with the free interval around its first heading (empty if it touches)."""
    x, y, heading = (float(value) for value in maze.base_pose)
    blocked, gaps = np.empty((len(walls) + 1, 2)), np.empty((len(walls) + 1, 2))
    n_gaps = free_directions(x, y, length, walls, SLACK, blocked, gaps)
    around = (heading, heading)
    for start, end in gaps[:n_gaps].tolist():
        turns = 2.0 * math.pi * round((heading - 0.5 * (start + end)) / (2.0 * math.pi))
        if start + turns < heading < end + turns:
            around = (start + turns, end + turns)
    return Task(
        length=float(length),
        x=x,
        y=y,
        heading=heading,
        gap_start=around[0],
        gap_end=around[1],
        goal_x=float(maze.goal[0]),
        goal_y=float(maze.goal[1]),
        goal_radius=maze.goal_radius,
        resolution=float(resolution),
    )


def _path(space: RodSpace, task: Task, nodes: IntArray, headings: FloatArray) -> RodPath:
    """Write a way without doubts as turns about the tail and moves without turning."""
    places = [(task.x, task.y, task.heading)]
    for node, heading in zip(nodes.tolist(), headings.tolist(), strict=True):
        x, y, before = places[-1]
        if heading != before:
            places.append((x, y, heading))
        if node not in (BASE, GOAL):
            places.append((*space.centres[(node - FIRST) // PER_TRIANGLE].tolist(), heading))
    array = np.array(places)
    for _ in range(SHORTENINGS):
        array = shorten(array, task.length, space)
    return RodPath(length=task.length, tails=array[:, :2], headings=array[:, 2])
