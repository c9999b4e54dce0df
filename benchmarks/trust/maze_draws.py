"""Random valid mazes with an arm that fits their feeder, for campaigns and for hypothesis alike.

Whatever is drawn comes from an object with two methods of NumPy's generators, `uniform(low, high)` and
`integers(low, high)`. The campaign passes a generator; tests pass one that asks hypothesis, which can then
shrink what it found.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.random_mazes import random_maze
from planners.problem import Motion

__all__ = [
    "KINDS",
    "Case",
    "Similarity",
    "draw_case",
    "draw_similarity",
    "in_other_order",
    "with_far_part",
    "with_far_walls",
]

DRAWS = 50
"""How often a maze is drawn until it is a valid one."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """Hold what is planned: the kind it was drawn as, the maze, the arm."""

    kind: str
    maze: Maze
    arm: ArmSpec


@dataclass(frozen=True, kw_only=True)
class Similarity:
    """Map the plane: mirror at the x axis first, then turn, scale and shift.

    Lengths in the new maze are `scale` times the old ones; `shift` is in new lengths.
    """

    scale: float = 1.0
    angle: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)
    mirrored: bool = False

    @property
    def sign(self) -> float:
        """By which angles are multiplied."""
        return -1.0 if self.mirrored else 1.0

    def points(self, points):
        """Map points, shape (..., 2)."""
        cos, sin = self.scale * math.cos(self.angle), self.scale * math.sin(self.angle)
        matrix = np.array([[cos, -sin * self.sign], [sin, cos * self.sign]])
        return np.asarray(points) @ matrix.T + self.shift

    def pose(self, pose):
        """Map a pose (x, y, heading)."""
        return np.array([*self.points(pose[:2]), self.sign * pose[2] + self.angle])

    def maze(self, maze: Maze) -> Maze:
        """Map a maze."""
        return dataclasses.replace(
            maze,
            free_space=shapely.transform(maze.free_space, self.points),
            base_pose=self.pose(maze.base_pose),
            goal=self.points(maze.goal),
            goal_radius=self.scale * maze.goal_radius,
        )

    def arm(self, arm: ArmSpec) -> ArmSpec:
        """Map an arm."""
        return dataclasses.replace(
            arm, link_length=self.scale * arm.link_length, link_radius=self.scale * arm.link_radius
        )

    def motion(self, motion: Motion) -> Motion:
        """Map a motion."""
        return Motion(
            joints=self.points(motion.joints),
            joint_angles=self.sign * motion.joint_angles,
            feed=self.scale * motion.feed,
            link_length=self.scale * motion.link_length,
            base_pose=self.pose(motion.base_pose),
        )

    def case(self, case: Case) -> Case:
        """Map maze and arm of a case."""
        return dataclasses.replace(case, maze=self.maze(case.maze), arm=self.arm(case.arm))


def draw_similarity(draws) -> Similarity:
    """Draw a similarity: any direction, a scale of 1e-3 to 1e6, a shift of some maze sizes, or a mirror."""
    scale = 10.0 ** draws.uniform(-3.0, 6.0)
    return Similarity(
        scale=scale,
        angle=draws.uniform(-math.pi, math.pi),
        shift=(scale * draws.uniform(-3e3, 3e3), scale * draws.uniform(-3e3, 3e3)),
        mirrored=bool(draws.integers(0, 2)),
    )


def draw_case(draws, kind: str | None = None) -> Case:
    """Draw a maze of a kind, or of any, and an arm that fits its feeder."""
    if kind is None:
        kind = list(KINDS)[int(draws.integers(0, len(KINDS)))]
    for _ in range(DRAWS):
        try:
            maze = KINDS[kind](draws)
            maze = Similarity(angle=draws.uniform(-math.pi, math.pi)).maze(maze)
            return Case(kind=kind, maze=maze, arm=_arm(draws, maze))
        except InputError:  # what was drawn is no maze
            continue
    maze = Maze.from_corridors([(0, 0), (0, 900), (900, 900)], 200.0)
    return Case(kind="bend", maze=maze, arm=ArmSpec(link_length=150.0))


def with_far_walls(maze: Maze, draws) -> Maze:
    """Hang a room with a pillar on the outside of a maze, by a duct far too narrow for any arm.

    It begins at a corner of the maze's convex hull, away from base and goal. Nothing of the old free space
    is taken away, so what was free stays free.
    """
    hull = np.asarray(maze.free_space.convex_hull.exterior.coords)[:-1]
    away = np.minimum(*(np.hypot(*(hull - point).T) for point in (maze.base_pose[:2], maze.goal)))
    corner, middle, size = hull[np.argmax(away)], hull.mean(axis=0), maze.size
    out = (corner - middle) / np.hypot(*(corner - middle))
    end = corner + size * draws.uniform(0.2, 2.0) * out
    duct = LineString([corner - 1e-4 * size * out, end]).buffer(1e-4 * size, cap_style="flat")
    radius = size * draws.uniform(0.02, 0.15)
    room = Point(end).buffer(radius).difference(Point(end).buffer(0.3 * radius, quad_segs=2))
    return dataclasses.replace(maze, free_space=shapely.union_all([maze.free_space, duct, room]))


def with_far_part(maze: Maze, draws) -> Maze:
    """Add another part of the free space beside the maze, which no arm can get to."""
    _, _, x_max, y_max = maze.free_space.bounds
    x, y = x_max + draws.uniform(0.1, 3.0) * maze.size, y_max
    part = box(x, y, x + draws.uniform(0.05, 1.0) * maze.size, y + 0.3 * maze.size)
    return dataclasses.replace(maze, free_space=MultiPolygon([maze.free_space, part]))


def in_other_order(maze: Maze, draws) -> Maze:
    """Return the same maze with its walls in another order: rings begin elsewhere, holes come backward."""

    def turned(ring):
        points = np.asarray(ring.coords)[:-1]
        return np.roll(points, int(draws.integers(1, len(points))), axis=0)

    space = maze.free_space
    holes = [turned(hole) for hole in space.interiors]
    return dataclasses.replace(maze, free_space=Polygon(turned(space.exterior), holes[::-1]))


def _arm(draws, maze: Maze) -> ArmSpec:
    """Draw an arm whose first link has a free straight way."""
    x, y, heading = maze.base_pose
    far = maze.size * np.array([math.cos(heading), math.sin(heading)])
    ray = LineString([(x, y), (x + far[0], y + far[1])]).intersection(maze.free_space.boundary)
    free = maze.size if ray.is_empty else Point(x, y).distance(ray)
    length = min(free, 0.5 * maze.size) * draws.uniform(0.08, 0.95)
    radius = length * draws.uniform(0.005, 0.08) if draws.integers(0, 5) == 0 else 0.0
    limit = draws.uniform(0.6, math.pi) if draws.integers(0, 4) == 0 else None
    arm = ArmSpec(link_length=length, link_radius=radius, joint_limit=limit)
    maze.check_arm(arm)
    return arm


def _corridor(draws) -> Maze:
    """Draw straight legs of different widths that turn by any angle; they may meet and so make islands."""
    n, heading, at = int(draws.integers(1, 7)), 0.0, np.zeros(2)
    parts, width = [], 0.0
    for k in range(n):
        width = draws.uniform(80.0, 300.0)
        step = draws.uniform(250.0, 1000.0) * np.array([math.cos(heading), math.sin(heading)])
        cap = "flat" if k == 0 else "round" if draws.integers(0, 4) == 0 else "square"
        parts.append(LineString([at, at + step]).buffer(width / 2, cap_style=cap, quad_segs=6))
        at = at + step
        parts.append(Point(at).buffer(width / 2, quad_segs=2))
        heading += draws.uniform(-2.3, 2.3)
    return _maze(shapely.union_all(parts), (5.0, 0.0, 0.0), at, draws.uniform(0.05, 0.4) * width)


def _hall(draws) -> Maze:
    """Draw a hall with pillars of 3 to 8 corners, which may touch the walls and one another."""
    width, height = draws.uniform(800.0, 2400.0), draws.uniform(500.0, 1600.0)
    y, goal = draws.uniform(100.0, height - 100.0), (width - 90.0, draws.uniform(60.0, height - 60.0))
    pillars = [
        _blob(draws, (draws.uniform(200.0, width), draws.uniform(0.0, height)), draws.uniform(20.0, 140.0))
        for _ in range(int(draws.integers(0, 25)))
    ]
    space = box(0.0, 0.0, width, height).difference(shapely.union_all(pillars))
    return _maze(space, (5.0, y, 0.0), goal, draws.uniform(5.0, 40.0))


def _star(draws) -> Maze:
    """Draw a ragged polygon seen whole from its middle, with some holes; the base is anywhere inside."""
    n = int(draws.integers(4, 24))
    radii = np.array([draws.uniform(200.0, 1000.0) for _ in range(n)])
    angles = 2.0 * math.pi * np.arange(n) / n
    outer = Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]))
    holes = [
        _blob(draws, (draws.uniform(-500.0, 500.0), draws.uniform(-500.0, 500.0)), draws.uniform(10.0, 160.0))
        for _ in range(int(draws.integers(0, 8)))
    ]
    base = (draws.uniform(-400.0, 400.0), draws.uniform(-400.0, 400.0), draws.uniform(-math.pi, math.pi))
    goal = (draws.uniform(-700.0, 700.0), draws.uniform(-700.0, 700.0))
    return _maze(outer.difference(shapely.union_all(holes)), base, goal, draws.uniform(2.0, 60.0))


def _slanted(draws) -> Maze:
    """Draw a hall or a corridor and press it aslant: no right angles, thin slivers."""
    maze = _hall(draws) if draws.integers(0, 2) else _corridor(draws)
    shear, press = draws.uniform(-50.0, 50.0), draws.uniform(0.3, 1.0)
    space = affinity.scale(affinity.skew(maze.free_space, xs=shear, origin=(0, 0)), 1.0, press, origin=(0, 0))
    base, goal = (
        np.array([x + y * math.tan(math.radians(shear)), press * y])
        for x, y in (maze.base_pose[:2], maze.goal)
    )
    return _maze(space, (*base, 0.0), goal, press * maze.goal_radius)


def _drawn(draws) -> Maze:
    """Draw a maze as training does."""
    return random_maze(
        int(draws.integers(0, 2**31)),
        difficulty=draws.uniform(0.0, 1.0),
        n_links=int(draws.integers(6, 20)),
    )


def _blob(draws, centre, radius) -> Polygon:
    angles = np.sort([draws.uniform(0.0, 2.0 * math.pi) for _ in range(int(draws.integers(3, 9)))])
    ring = Polygon(np.column_stack([np.cos(angles), np.sin(angles)]) * radius + centre)
    return ring if ring.is_valid else ring.buffer(0.0)


def _maze(space, base, goal, radius) -> Maze:
    return Maze(
        name="drawn", free_space=space, base_pose=np.array(base), goal=np.array(goal), goal_radius=radius
    )


KINDS = {
    "corridor": _corridor,
    "hall": _hall,
    "star": _star,
    "slanted": _slanted,
    "drawn": _drawn,
}
"""What can be drawn, by name."""
