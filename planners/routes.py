"""The ways from base to goal that go differently round the obstacles: short paths of the medial axis."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.linalg import solveh_banded
from shapely.geometry import LineString, Point

from hrsnake_env.maze import Maze
from planners.inset import inset_maze
from planners.kernels.types import FloatArray
from planners.medial_axis import MedialAxis, chains, medial_axis
from planners.path import arclength, resampled

__all__ = ["Route", "routes", "signature"]

CRAMP = 1.0
"""A way as wide as this many link lengths costs twice its length. Of the first three ways in 24 halls of
pillars (links of 250 and 300 px), the sweep does not pass 5 of 72 with 0.5, 2 with 1 and 2 with 2."""

FINEST = 0.01
"""Smallest spacing of the sites on the walls, in link lengths; walls nearer to one another leave no way."""

FRONT = 0.9
"""Where the first link is taken to end, of the way that is free in front of the base."""

STRAIGHT = 0.5
"""How much of that way is not moved off the base heading."""

FEWEST_POINTS, MOST_POINTS, POINTS_PER_WIDTH = 100, 1500, 8.0
"""Points of a tightened line; between these bounds, as many per width of its narrow parts."""

KEPT = 0.75
"""Share of the clearance of the medial axis that a tightened line keeps."""

AMPLE = 0.5
"""Clearance, in link lengths, that is always enough."""

PASSES, ROUNDS = 4, 12
"""The discs are laid round the points so many times; in between, the band is pulled so many times."""

STIFFNESS = 100.0
"""The square of how many points on each side pull at a point."""

LAST_STIFFNESS = 2.0
"""The same for the last pull, which no disc stops: it rounds the kinks where the discs end."""

RAY_ANGLE = 1.0 / math.sqrt(2.0)
"""Direction of the rays of the signature, in rad: no drawn maze has two holes in line with it."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Route:
    """Hold a way from base to goal.

    Parameters
    ----------
    points : array, shape (n, 2)
        Through the free space, in maze units; the first is the base, the last the goal.
    length : float
        In maze units.
    width : float
        Twice the least clearance in front of the first link, in maze units; for thick links, what is left
        beside them.
    signature : tuple of int
        The homotopy class, as `signature` computes it in the maze with walls grown by the radius of the
        links (`planners.survey.Geometry.maze`).
    """

    points: FloatArray
    length: float
    width: float
    signature: tuple[int, ...]

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        points.setflags(write=False)
        object.__setattr__(self, "points", points)


def routes(maze: Maze, link_length: float, *, link_radius: float = 0.0) -> Iterator[Route]:
    """Yield ways from base to goal of different homotopy classes, the most promising first.

    The free space can be shrunk to its medial axis, so loopless paths of the axis are of different classes.
    They come in the order of their length [1]_, where a stretch ds of width w counts (1 + (c L / w)^2) ds for
    links of length L; each is then tightened like a rubber band that keeps its clearance.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_length, link_radius : float
        In maze units.

    Yields
    ------
    route : Route
        The next one, computed when it is asked for. Classes that pass a junction of the axis twice, as those
        that wind round an obstacle, are not among them, nor are ways through gaps narrower than a hundredth
        of a link.

    References
    ----------
    .. [1] J. Y. Yen, "Finding the k shortest loopless paths in a network", Management Science 17(11), 1971.
    """
    import networkx as nx  # takes a quarter of a second, which planners without routes need not spend

    inset = inset_maze(maze, link_radius)
    if inset is None:
        return

    def price(clearance: FloatArray) -> FloatArray:
        return np.asarray(1.0 + (0.5 * CRAMP * link_length / clearance) ** 2)

    ends = np.stack([_front(inset, link_length), inset.goal])
    axis = medial_axis(inset, ends, price, FINEST * link_length)
    if axis is None:
        return
    parts = chains(axis)
    graph = nx.Graph()
    graph.add_nodes_from(axis.terminals)
    for number, chain in enumerate(parts):
        cost = sum(axis.links[a][b] for a, b in itertools.pairwise(chain))
        # Two chains may join the same junctions: a node within each tells them apart.
        graph.add_edge(chain[0], -1 - number, cost=0.5 * cost)
        graph.add_edge(-1 - number, chain[-1], cost=0.5 * cost)
    seen: set[tuple[int, ...]] = set()
    with contextlib.suppress(nx.NetworkXNoPath):
        for way in nx.shortest_simple_paths(graph, *axis.terminals, weight="cost"):
            route = _route(inset, _line(inset, axis, parts, way), link_length)
            if route is not None and route.signature not in seen:
                seen.add(route.signature)
                yield route


def signature(maze: Maze, line: FloatArray) -> tuple[int, ...]:
    """Compute the homotopy class of a line from base to goal.

    The word of the line's crossings of parallel rays, one from a point in each hole of the free space, with
    adjacent inverse letters cancelled. The plane without the rays is simply connected, so lines through the
    free space with the same ends have equal words if, and only if, one can be deformed into the other.

    Parameters
    ----------
    maze : Maze
        The maze.
    line : array, shape (n, 2)
        In maze units.

    Returns
    -------
    word : tuple of int
        +k where the line crosses the ray of hole k - 1 from its right to its left, -k in the other direction.
    """
    rings = maze.free_space.interiors
    if len(rings) == 0 or len(line) < 2:
        return ()
    holes = shapely.get_coordinates(shapely.point_on_surface(shapely.polygons(list(rings))))
    # In the frame of the rays: the first axis along them, the second to their left.
    frame = np.array(
        [[math.cos(RAY_ANGLE), -math.sin(RAY_ANGLE)], [math.sin(RAY_ANGLE), math.cos(RAY_ANGLE)]]
    )
    places, origins = np.asarray(line) @ frame, holes @ frame
    # A point on a ray counts as on its left: it is crossed once or not at all.
    left = places[:, None, 1] >= origins[None, :, 1]
    segment, hole = np.nonzero(left[1:] != left[:-1])
    start, end = places[segment], places[segment + 1]
    share = (origins[hole, 1] - start[:, 1]) / (end[:, 1] - start[:, 1])
    ahead = start[:, 0] + share * (end[:, 0] - start[:, 0]) > origins[hole, 0]
    letters = np.where(left[segment + 1, hole], hole + 1, -hole - 1)
    word: list[int] = []
    for index in np.lexsort((share, segment)):
        if not ahead[index]:
            continue
        letter = int(letters[index])
        if word and word[-1] == -letter:
            word.pop()
        else:
            word.append(letter)
    return tuple(word)


def _front(maze: Maze, link_length: float) -> FloatArray:
    """Return where the first link ends when the arm comes straight out of the feeder; short of a wall."""
    base, heading = maze.base_pose[:2], maze.base_pose[2]
    along = np.array([math.cos(heading), math.sin(heading)])
    reach = min(link_length, math.dist(base, maze.goal))
    wall = LineString([base, base + reach * along]).intersection(maze.free_space.boundary)
    free = reach if wall.is_empty else Point(base).distance(wall)
    return np.asarray(base + FRONT * free * along)


def _line(maze: Maze, axis: MedialAxis, parts: list[list[int]], way: list[int]) -> FloatArray:
    """Lay a line from the base along a way: junctions and, as -1 - k, chains between them, in turn."""
    vertices = [way[0]]
    for node in way[1::2]:
        chain = parts[-1 - node]
        vertices += (chain if chain[0] == vertices[-1] else chain[::-1])[1:]
    return np.concatenate([maze.base_pose[None, :2], axis.places[vertices]])


def _route(maze: Maze, line: FloatArray, link_length: float) -> Route | None:
    """Smooth a line along the medial axis; None if not even the line itself is free."""
    word = signature(maze, line)
    for points in (_tightened(maze, line, link_length), line):
        if maze.free_space.covers(LineString(points)) and signature(maze, points) == word:
            s = arclength(points)
            ahead = points[s >= min(link_length, s[-1])]
            width = 2.0 * float(_clearance(maze, ahead).min())
            return Route(points=points, length=float(s[-1]), width=width, signature=word)
    return None


def _tightened(maze: Maze, line: FloatArray, link_length: float) -> FloatArray:
    """Tighten a line like a rubber band, each point within a disc that keeps its clearance.

    The discs lie in the free space and overlap, so the line stays in its class.
    """
    length = float(arclength(line)[-1])
    narrow = 2.0 * float(np.quantile(_clearance(maze, resampled(line, length / FEWEST_POINTS)), 0.1))
    spacing = min(max(narrow / POINTS_PER_WIDTH, length / MOST_POINTS), length / FEWEST_POINTS)
    points = resampled(line, spacing)
    # Nearer to a corner than two points are to each other, the line between them would cut it.
    floor = np.minimum(KEPT * _clearance(maze, points), max(AMPLE * link_length, 2.0 * spacing))
    floor[arclength(points) < STRAIGHT * math.dist(line[0], line[1])] = np.inf
    floor[-1] = np.inf
    for _ in range(PASSES):
        centres, reach = points, np.maximum(_clearance(maze, points) - floor, 0.0)
        for _ in range(ROUNDS):
            away = _smoothed(points, STIFFNESS) - centres
            distance = np.hypot(away[:, 0], away[:, 1])
            points = centres + away * np.minimum(1.0, reach / np.maximum(distance, 1e-300))[:, None]
    return _smoothed(points, LAST_STIFFNESS)


def _smoothed(points: FloatArray, stiffness: float) -> FloatArray:
    """Pull each point towards the middle of its neighbours, over stiffness^(1/2) points."""
    inner = points[1:-1].copy()
    inner[0] += stiffness * points[0]
    inner[-1] += stiffness * points[-1]
    bands = np.full((2, len(inner)), -stiffness)
    bands[1] = 1.0 + 2.0 * stiffness
    return np.concatenate([points[:1], solveh_banded(bands, inner), points[-1:]])


def _clearance(maze: Maze, points: FloatArray) -> FloatArray:
    """Compute the distance of free points to the walls, shape (n, 2) -> (n,), in maze units."""
    return np.asarray(shapely.distance(shapely.points(points), maze.free_space.boundary))
