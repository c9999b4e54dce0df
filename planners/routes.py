"""The ways from base to goal that go differently round the obstacles: shortest paths of the medial axis."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from scipy.linalg import solveh_banded
from scipy.spatial import Delaunay, KDTree
from shapely.geometry import LineString, Point

from hrsnake_env.maze import Maze
from planners.inset import inset_maze
from planners.kernels.types import BoolArray, FloatArray, IntArray
from planners.path import arclength, resampled

__all__ = ["Route", "routes", "signature"]

CRAMP = 0.5
"""Weight of narrowness: a way as wide as this many link lengths costs twice its length."""

COARSEST = 1.0 / 60.0
"""Largest spacing of the sites on the walls, in sizes of the maze."""

FINEST = 0.01
"""Smallest spacing of the sites, in link lengths; walls nearer to one another leave no way."""

MOST_SITES = 30_000
"""The sites are not refined beyond this number."""

NEIGHBOURS = 8
"""Sites among which the nearest one on another wall is looked for."""

KEPT = 0.75
"""Share of the medial axis' clearance that a tightened line keeps."""

STRAIGHT = 0.5
"""Length in front of the base, in link lengths, that is not moved off the base heading."""

AMPLE = 0.5
"""Clearance, in link lengths, above which a route need not stay in the middle."""

POINTS_PER_WIDTH = 8.0
"""Points of a route per passage width."""

FEWEST_POINTS, MOST_POINTS = 100, 1500
"""Points of a route."""

PASSES = 4
"""Times that the discs are laid anew round the tightened points."""

STIFFNESS = 100.0
"""Of the band: it smooths over this many points squared."""

LAST_STIFFNESS = 2.0
"""Of the last round, which no disc stops: it rounds the kinks where discs end."""

IN_SIGHT = 50
"""Vertices of the axis among which one in sight of the base or the goal is looked for."""

FRONT = 0.9
"""Where the first link is taken to end, of the way that is free in front of the base."""

ROUNDS = 12
"""Rounds of tightening and putting back into the discs."""

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

    The dual graph of a Delaunay triangulation of the free space, with vertices in the circumcentres, is its
    medial axis (the Voronoi diagram of the walls' sites). Loopless paths of this graph are of different
    classes; they come in the order of their length [1]_, where a stretch ds of width w counts
    (1 + (c L / w)^2) ds for links of length L.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_length, link_radius : float
        In maze units.

    Yields
    ------
    route : Route
        The next one, computed when it is asked for. A class that winds round an obstacle is not among them.

    References
    ----------
    .. [1] J. Y. Yen, "Finding the k shortest loopless paths in a network", Management Science 17(11), 1971.
    """
    import networkx as nx  # takes a quarter of a second, which planners without routes need not spend

    inset = inset_maze(maze, link_radius)
    axis = None if inset is None else _axis_with_ends(inset, link_length)
    if inset is None or axis is None:
        return
    ends = (len(axis.links) - 2, len(axis.links) - 1)
    chains = _chains(axis.links, ends)
    graph = nx.Graph()
    graph.add_nodes_from(ends)
    for number, chain in enumerate(chains):
        cost = sum(axis.links[a][b] for a, b in itertools.pairwise(chain))
        # Two chains may join the same junctions: a node within each tells them apart.
        graph.add_edge(chain[0], -1 - number, cost=0.5 * cost)
        graph.add_edge(-1 - number, chain[-1], cost=0.5 * cost)
    seen: set[tuple[int, ...]] = set()
    with contextlib.suppress(nx.NetworkXNoPath):
        for way in nx.shortest_simple_paths(graph, *ends, weight="cost"):
            line = _line(inset, axis, chains, way)
            route = _route(inset, line, link_length)
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
    (places, origins) = (np.asarray(line) @ frame, holes @ frame)
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


@dataclass(frozen=True, eq=False, kw_only=True)
class _Axis:
    """Hold the medial axis: vertices, shape (n, 2), in maze units, and what the links of each cost."""

    places: FloatArray
    links: list[dict[int, float]]


def _axis_with_ends(maze: Maze, link_length: float) -> _Axis | None:
    """Compute the medial axis with the end of the first link and the goal as its last two vertices."""
    axis = _joined(_medial_axis(maze, link_length), maze, _front(maze, link_length), link_length)
    return None if axis is None else _joined(axis, maze, maze.goal, link_length)


def _line(maze: Maze, axis: _Axis, chains: list[list[int]], way: list[int]) -> FloatArray:
    """Lay a line from the base along a way: junctions and, as -1 - k, chains between them, in turn."""
    vertices = [way[0]]
    for node in way[1::2]:
        chain = chains[-1 - node]
        vertices += (chain if chain[0] == vertices[-1] else chain[::-1])[1:]
    return np.concatenate([maze.base_pose[None, :2], axis.places[vertices]])


def _medial_axis(maze: Maze, link_length: float) -> _Axis:
    shapely.prepare(maze.free_space)
    sites, crowding = _wall_sites(maze, FINEST * link_length)
    triangulation = Delaunay(sites)
    corners: FloatArray = sites[triangulation.simplices]
    centres, radii, flat = _circumcircles(corners)
    middle = corners.mean(axis=1)
    inner = shapely.contains_xy(maze.free_space, middle[:, 0], middle[:, 1]) & ~flat
    near = np.repeat(np.arange(len(inner)), 3)
    far = triangulation.neighbors.ravel()
    shared = triangulation.simplices[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    link = (near < far) & inner[near] & inner[far]
    # Where the sites are too sparse for walls this near to one another, a triangle may reach through a wall.
    doubtful = np.flatnonzero(link & crowding[shared].any(axis=1))
    link[doubtful] = shapely.covers(maze.free_space, shapely.linestrings(sites[shared[doubtful]]))
    near, far, shared = near[link], far[link], shared[link]
    gate = sites[shared].mean(axis=1)
    straddled = ((centres[near] - gate) * (centres[far] - gate)).sum(axis=1) < 0.0
    half = 0.5 * np.hypot(*(sites[shared[:, 0]] - sites[shared[:, 1]]).T)
    radius = np.where(straddled, half, np.minimum(radii[near], radii[far]))
    costs = np.hypot(*(centres[near] - centres[far]).T) * _cramped(radius, link_length)
    links: list[dict[int, float]] = [{} for _ in centres]
    for a, b, cost in zip(near.tolist(), far.tolist(), costs.tolist(), strict=True):
        links[a][b] = links[b][a] = cost
    return _Axis(places=centres, links=links)


def _cramped(radius: FloatArray, link_length: float) -> FloatArray:
    """Return what a unit of length costs where the clearance is so large, shape (n,) -> (n,)."""
    return np.asarray(1.0 + (0.5 * CRAMP * link_length / radius) ** 2)


def _wall_sites(maze: Maze, finest: float) -> tuple[FloatArray, BoolArray]:
    """Place sites on the walls, at most as far apart as other walls are away.

    Until the circle over two neighbours holds no third site, too: then each wall is a chain of edges of the
    Delaunay triangulation, and no vertex or edge of the Voronoi diagram of the free side crosses a wall.

    Returns
    -------
    sites : array, shape (n, 2)
        In maze units.
    crowding : array, shape (n,)
        Whether a site is in such a circle, which could not be emptied.
    """
    walls = maze.walls
    start, span = walls[:, 0], walls[:, 1] - walls[:, 0]
    before, after = _neighbours(maze)
    pieces = np.ceil(np.hypot(*span.T) / (COARSEST * maze.size)).astype(np.int64)
    wall = np.repeat(np.arange(len(walls)), pieces)
    first = (np.arange(len(wall)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[wall]
    width = 1.0 / pieces[wall]
    while True:
        sites = start[wall] + first[:, None] * span[wall]
        length = width * np.hypot(*span[wall].T)
        middle = start[wall] + (first + 0.5 * width)[:, None] * span[wall]
        distance, nearest = KDTree(sites).query(middle, k=min(NEIGHBOURS, len(sites)))
        owner = wall[nearest]
        apart = (owner != wall[:, None]) & (owner != before[wall][:, None]) & (owner != after[wall][:, None])
        inside = distance < 0.499 * length[:, None]
        split = (inside | (apart & (distance < length[:, None]))).any(axis=1) & (length > finest)
        if not split.any() or len(sites) > MOST_SITES:
            crowding = np.zeros(len(sites), dtype=bool)
            crowding[nearest[inside]] = True
            return sites, crowding
        width = np.where(split, 0.5 * width, width)
        wall = np.concatenate([wall, wall[split]])
        first = np.concatenate([first, first[split] + width[split]])
        width = np.concatenate([width, width[split]])


def _neighbours(maze: Maze) -> tuple[IntArray, IntArray]:
    """Return the wall before and the wall after each wall, on its ring."""
    before, after, n = [], [], 0
    for ring in maze.rings:
        own = np.arange(n, n + len(ring) - 1)
        before.append(np.roll(own, 1))
        after.append(np.roll(own, -1))
        n += len(own)
    return np.concatenate(before), np.concatenate(after)


def _circumcircles(corners: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Compute centre and radius of the circles through triangles, shape (n, 3, 2), and which are flat."""
    b, c = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    bb, cc = (b * b).sum(axis=1), (c * c).sum(axis=1)
    cross = b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0]
    flat = np.abs(cross) <= 1e-9 * np.maximum(bb, cc)
    double = 2.0 * np.where(flat, 1.0, cross)
    offset = np.column_stack([c[:, 1] * bb - b[:, 1] * cc, b[:, 0] * cc - c[:, 0] * bb]) / double[:, None]
    return corners[:, 0] + offset, np.hypot(*offset.T), flat


def _joined(axis: _Axis, maze: Maze, point: FloatArray, link_length: float) -> _Axis | None:
    """Add a point as the axis' last vertex, linked to the nearest one in sight; None if there is none."""
    linked = np.array([k for k, near in enumerate(axis.links) if near], dtype=np.int64)
    if len(linked) == 0:
        return None
    away = np.hypot(*(axis.places[linked] - point).T)
    nearest = np.argsort(away, kind="stable")[:IN_SIGHT]
    sights = np.stack([np.broadcast_to(point, (len(nearest), 2)), axis.places[linked[nearest]]], axis=1)
    seen = nearest[shapely.covers(maze.free_space, shapely.linestrings(sights))]
    if len(seen) == 0:
        return None
    radius = shapely.distance(shapely.points(point[None]), maze.free_space.boundary)
    cost = float(away[seen[0]] * _cramped(radius, link_length)[0])
    new, old = len(axis.links), int(linked[seen[0]])
    links = [*axis.links, {old: cost}]
    links[old] = links[old] | {new: cost}
    return _Axis(places=np.concatenate([axis.places, point[None]]), links=links)


def _front(maze: Maze, link_length: float) -> FloatArray:
    """Return where the first link ends when the arm comes straight out of the feeder; short of a wall."""
    x, y, heading = maze.base_pose
    along = np.array([math.cos(heading), math.sin(heading)])
    base = np.array([x, y])
    wall = LineString([base, base + link_length * along]).intersection(maze.free_space.boundary)
    free = link_length if wall.is_empty else Point(x, y).distance(wall)
    return np.asarray(base + FRONT * free * along)


def _chains(links: list[dict[int, float]], ends: tuple[int, int]) -> list[list[int]]:
    """Return the chains of vertices between junctions, without the dead ends.

    A pocket's branch leads nowhere; when it is cut off, what it branched from is no junction any more.
    """
    near = [set(others) for others in links]
    leaves = deque(k for k, others in enumerate(near) if len(others) == 1 and k not in ends)
    while leaves:
        leaf = leaves.popleft()
        for other in near[leaf]:
            near[other].discard(leaf)
            if len(near[other]) == 1 and other not in ends:
                leaves.append(other)
        near[leaf] = set()
    chains, walked = [], set()
    for junction in range(len(near)):
        if len(near[junction]) == 2 and junction not in ends:
            continue
        for neighbour in sorted(near[junction]):
            if (junction, neighbour) in walked:
                continue
            chain = [junction, neighbour]
            while len(near[chain[-1]]) == 2 and chain[-1] not in ends:
                chain += near[chain[-1]] - {chain[-2]}
            walked.add((chain[-1], chain[-2]))
            if chain[-1] != junction:
                chains.append(chain)
    return chains


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
    floor = np.minimum(KEPT * _clearance(maze, points), AMPLE * link_length)
    floor[arclength(points) < STRAIGHT * link_length] = np.inf
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
