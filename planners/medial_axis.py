"""The medial axis of the free space as a graph: the Voronoi diagram of sites on the walls."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from hrsnake_env.maze import Maze
from planners.kernels.types import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.spatial import Delaunay

__all__ = ["MedialAxis", "chains", "medial_axis"]

COARSEST = 1.0 / 40.0
"""Largest spacing of the sites on the walls, in square roots of the area of the free space."""

MOST_SITES = 30_000
"""The sites are not refined beyond this number."""

NEIGHBOURS = 8
"""Sites among which the nearest one on another wall is looked for."""

IN_SIGHT = 50
"""Vertices among which one in sight of a terminal is looked for."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MedialAxis:
    """Hold the medial axis as a graph, with two terminals joined to it.

    Parameters
    ----------
    places : array, shape (n, 2)
        Of the vertices, in maze units.
    links : list of dict from int to float
        To which vertices each one is linked, and what the link costs.
    terminals : tuple of two int
        The vertices where ways start and end.
    """

    places: FloatArray
    links: list[dict[int, float]]
    terminals: tuple[int, int]


def medial_axis(
    maze: Maze, terminals: FloatArray, price: Callable[[FloatArray], FloatArray], finest: float
) -> MedialAxis | None:
    """Compute the medial axis of the free space.

    It is the dual of the Delaunay triangulation of the sites: a vertex is the centre of the circle round a
    triangle in the free space, a link joins triangles with a common edge. It has one loop for each hole,
    unless walls come nearer to one another than `finest`.

    Parameters
    ----------
    maze : Maze
        The maze.
    terminals : array, shape (2, 2)
        Two points of the free space, in maze units.
    price : callable
        Cost per length of links of a clearance, shape (n,) -> (n,), in maze units.
    finest : float
        Smallest spacing of the sites, in maze units.

    Returns
    -------
    axis : MedialAxis or None
        None if a terminal sees nothing of it.
    """
    from scipy.spatial import Delaunay  # takes a tenth of the time of importing the planners

    shapely.prepare(maze.free_space)
    sites, crowding = _wall_sites(maze, finest)
    triangulation = Delaunay(sites)
    centres, radii, flat = _circumcircles(sites[triangulation.simplices])
    near, far, shared = _links(maze, triangulation, flat, crowding)
    edge: FloatArray = sites[shared]
    middle = edge.mean(axis=1)
    # A link that crosses its edge does so in the middle, where the walls are nearest to it.
    crossing = ((centres[near] - middle) * (centres[far] - middle)).sum(axis=1) < 0.0
    half = 0.5 * np.hypot(*(edge[:, 1] - edge[:, 0]).T)
    clearance = np.where(crossing, half, np.minimum(radii[near], radii[far]))
    costs = np.hypot(*(centres[near] - centres[far]).T) * price(clearance)
    links: list[dict[int, float]] = [{} for _ in centres]
    for a, b, cost in zip(near.tolist(), far.tolist(), costs.tolist(), strict=True):
        links[a][b] = links[b][a] = cost
    for number, point in enumerate(terminals, start=len(centres)):
        seen = _nearest_in_sight(maze, centres, links, point)
        if seen is None:
            return None
        radius = shapely.distance(shapely.points(point[None]), maze.free_space.boundary)
        cost = float(np.hypot(*(centres[seen] - point)) * price(radius)[0])
        links.append({seen: cost})
        links[seen][number] = cost
    return MedialAxis(
        places=np.concatenate([centres, terminals]), links=links, terminals=(len(centres), len(centres) + 1)
    )


def chains(axis: MedialAxis) -> list[list[int]]:
    """Return the chains of vertices between junctions or terminals, without dead ends and loops.

    A pocket's branch leads nowhere; when it is cut off, what it branched from is no junction any more.
    """
    near = [set(others) for others in axis.links]
    leaves = deque(k for k, others in enumerate(near) if len(others) == 1 and k not in axis.terminals)
    while leaves:
        leaf = leaves.popleft()
        for other in near[leaf]:
            near[other].discard(leaf)
            if len(near[other]) == 1 and other not in axis.terminals:
                leaves.append(other)
        near[leaf] = set()
    found, walked = [], set()
    for junction in range(len(near)):
        if len(near[junction]) == 2 and junction not in axis.terminals:
            continue
        for neighbour in sorted(near[junction]):
            if (junction, neighbour) in walked:
                continue
            chain = [junction, neighbour]
            while len(near[chain[-1]]) == 2 and chain[-1] not in axis.terminals:
                chain += near[chain[-1]] - {chain[-2]}
            walked.add((chain[-1], chain[-2]))
            if chain[-1] != junction:
                found.append(chain)
    return found


def _links(
    maze: Maze, triangulation: Delaunay, flat: BoolArray, crowding: BoolArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Return which triangles in the free space have a common edge, and its two sites, shape (n, 2)."""
    sites, triangles = triangulation.points, triangulation.simplices
    middle = sites[triangles].mean(axis=1)
    free = shapely.contains_xy(maze.free_space, middle[:, 0], middle[:, 1]) & ~flat
    near = np.repeat(np.arange(len(triangles)), 3)
    far = triangulation.neighbors.ravel()
    shared = triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
    link = (near < far) & free[near] & free[far]
    # Where the sites are too sparse for walls this near to one another, a triangle may reach through a wall.
    doubtful = np.flatnonzero(link & crowding[shared].any(axis=1))
    link[doubtful] = shapely.covers(maze.free_space, shapely.linestrings(sites[shared[doubtful]]))
    return near[link], far[link], shared[link]


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
    from scipy.spatial import KDTree

    walls = maze.walls
    start, span = walls[:, 0], walls[:, 1] - walls[:, 0]
    before, after = _neighbours(maze)
    coarsest = COARSEST * math.sqrt(maze.free_space.area)  # unlike its size, this is the same in any frame
    pieces = np.ceil(np.hypot(*span.T) / coarsest).astype(np.int64)
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
        cut = _cuts(first, width, length / coarsest)
        wall = np.concatenate([wall, wall[split]])
        first = np.concatenate([first, (first + cut)[split]])
        width = np.concatenate([np.where(split, cut, width), (width - cut)[split]])


def _cuts(first: FloatArray, width: FloatArray, length: FloatArray) -> FloatArray:
    """Return where to cut pieces of walls, in shares of the wall from the piece's start.

    In the middle, but next to a corner at a power of two from it: on both walls of a sharp corner the sites
    stand at the same distances then, and halving one piece does not make the other one too long again [1]_.

    Parameters
    ----------
    first, width : array, shape (n,)
        Start and extent of the pieces, in shares of their walls.
    length : array, shape (n,)
        In any unit, the same for all.

    References
    ----------
    .. [1] J. Ruppert, "A Delaunay refinement algorithm for quality 2-dimensional mesh generation", Journal
       of Algorithms 18(3), 1995: the concentric shells of its section on small angles.
    """
    shell = np.exp2(np.round(np.log2(0.5 * length))) / length
    at_start, at_end = first == 0.0, first + width > 1.0 - 1e-9
    return np.asarray(width * np.where(at_start, shell, np.where(at_end, 1.0 - shell, 0.5)))


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


def _nearest_in_sight(
    maze: Maze, places: FloatArray, links: list[dict[int, float]], point: FloatArray
) -> int | None:
    """Return the nearest linked vertex that a point sees; None if it sees none of the nearest."""
    linked = np.array([k for k in range(len(places)) if links[k]], dtype=np.int64)
    if len(linked) == 0:
        return None
    nearest = linked[np.argsort(np.hypot(*(places[linked] - point).T), kind="stable")[:IN_SIGHT]]
    sights = np.stack([np.broadcast_to(point, (len(nearest), 2)), places[nearest]], axis=1)
    seen = nearest[shapely.covers(maze.free_space, shapely.linestrings(sights))]
    return int(seen[0]) if len(seen) else None
