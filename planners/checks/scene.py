"""What all checks look at: the motion, the walls, and what follows from them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from hrsnake_env.arm import FloatArray, joints_from_configuration
from hrsnake_env.maze import Maze
from planners.checks.thin import ThinWalls
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING
from planners.problem import Fault, Motion

PLACE_SLACK = 1e-6
"""How far joints may be from where configuration, feeder and start put them, in link lengths."""

MAX_SPLITS = 14
"""How often a piece between two poses is halved before it counts as not bounded."""

CHUNK = 128
"""Poses that are looked at together."""

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Geometry = Any
Nearest = tuple[float, int, FloatArray]
"""Clearance, index of the segment, and the place on it, shape (2,)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Hold the motion, the walls, and what follows from them."""

    motion: Motion
    maze: Maze
    radius: float

    @property
    def length(self) -> float:
        """The link length, in maze units."""
        return self.motion.link_length

    @cached_property
    def slack(self) -> float:
        """What counts as rounding where places in the maze are compared, in maze units."""
        return ROUNDING * self.length + 100.0 * float(
            np.finfo(np.float64).eps * np.abs(self.maze.walls).max()
        )

    @cached_property
    def far(self) -> float:
        """What rounding of coordinates makes of a length, in maze units: some units in their last place."""
        return 4.0 * float(np.finfo(np.float64).eps * np.abs(self.motion.joints).max())

    @property
    def length_slack(self) -> float:
        """How far an exact link may be off its length, in maze units."""
        return ROUNDING * self.length + self.far

    @property
    def place_slack(self) -> float:
        """How far joints may be from where configuration, feeder and start put them, in maze units."""
        return PLACE_SLACK * self.length + self.far

    @cached_property
    def free(self) -> Geometry:
        """The free space."""
        return prepared(self.maze.free_space)

    @cached_property
    def walls(self) -> Geometry:
        """The walls as lines."""
        return prepared(self.maze.free_space.boundary)

    @cached_property
    def open_behind(self) -> Geometry:
        """The free space together with everything behind the base: only walls in front are left.

        A wall that ends at the line across the base is behind it, whatever rounding makes of that.
        """
        x, y, heading = self.motion.base_pose
        along = 2.0 * (self.maze.size + self.length) * np.array([math.cos(heading), math.sin(heading)])
        across = np.array([-along[1], along[0]])
        base = np.array([x + self.slack * math.cos(heading), y + self.slack * math.sin(heading)])
        behind = Polygon([base + across, base + across - along, base - across - along, base - across])
        return self.maze.free_space.union(behind)

    @cached_property
    def walls_in_front(self) -> Geometry:
        """The walls in front of the base, as lines."""
        return prepared(self.open_behind.boundary)

    def distances(self, lines: Any, emerging: BoolArray) -> FloatArray:
        """Compute the distances from lines to the walls that count for them."""
        distances = shapely.distance(lines, self.walls)
        if emerging.any():
            distances[emerging] = shapely.distance(lines[emerging], self.walls_in_front)
        return np.asarray(distances)

    @cached_property
    def shallow(self) -> Geometry:
        """Where every centre line lies that is not surely deeper in a wall than the pinch tolerance."""
        depth = max(PINCH_TOLERANCE * self.length - self.radius, ROUNDING * self.length)
        return prepared(self.maze.free_space.buffer(1.02 * depth))

    @cached_property
    def thin(self) -> ThinWalls:
        """The walls in which depth alone says too little."""
        return ThinWalls(maze=self.maze, tolerance=PINCH_TOLERANCE * self.length)

    def may_tunnel(self, emerging: BoolArray) -> BoolArray:
        """Say which links could cross a thin wall with their centre line, and yet not be too deep in it."""
        slim = self.radius <= PINCH_TOLERANCE * self.length
        return (emerging | slim) & self.thin.any if slim or emerging.any() else np.zeros_like(emerging)

    @cached_property
    def arc(self) -> FloatArray:
        """How far past the base each joint is along the arm, shape (n_poses, n_links + 1)."""
        return self.arc_from_feed(self.motion.feed)

    def arc_from_feed(self, feed: FloatArray) -> FloatArray:
        """Compute how far past the base each joint is along the arm, shape (n,) -> (n, n_links + 1)."""
        n_links = self.motion.n_links
        return np.asarray(feed[:, None] - (n_links - np.arange(n_links + 1)) * self.length)

    def in_maze(self, joints: FloatArray, arc: FloatArray) -> FloatArray:
        """Put the joints behind the base, shape (..., 2), at the base point."""
        return np.where(arc[..., None] < 0.0, self.motion.base_pose[:2], joints)

    def emerging(self, arc: FloatArray) -> BoolArray:
        """Say for which links, by the arc of their base-side joint, walls behind the base do not count."""
        return np.asarray((arc < self.radius) & (self.radius > 0.0))

    @cached_property
    def curvature(self) -> FloatArray:
        """How far each joint may leave its chord after each pose (e_k), shape (n_poses, n_links + 1)."""
        headings = np.cumsum(self.motion.joint_angles, axis=1)
        turns = np.diff(headings, axis=0, append=headings[-1:])
        sums = np.cumsum(turns**2, axis=1) * self.length / 8.0
        return np.concatenate([np.zeros((len(turns), 1)), sums], axis=1)

    @cached_property
    def swerve(self) -> FloatArray:
        """How far the ends of a link may be off their lines after each pose, shape (n_poses, n_links).

        A joint that comes out of the feeder at the base is on the line from there to its next place. If it
        comes out elsewhere (a fault) it is somewhere on its way, which is at most 4 e longer than its chord.
        """
        motion, before = self.motion, self.arc
        after = np.concatenate([before[1:], before[-1:]])
        pose, joint = np.nonzero((before < 0.0) != (after < 0.0))
        share = before[pose, joint] / (before[pose, joint] - after[pose, joint])
        rows, row = np.unique(pose, return_inverse=True)
        feed, angles = (np.stack([all_[rows], all_[rows + 1]]) for all_ in (motion.feed, motion.joint_angles))
        ends = joints_from_configuration(feed, angles, self.length, motion.base_pose)[:, row, joint]
        passing = ends[0] + share[:, None] * (ends[1] - ends[0])
        off = np.linalg.norm(passing - motion.base_pose[:2], axis=1) > self.slack
        way = np.linalg.norm(ends[1] - ends[0], axis=1) + 4.0 * self.curvature[pose, joint]
        ways = np.zeros_like(before)
        ways[pose, joint] = np.where(off, way, 0.0)
        return np.maximum(ways[:, :-1], ways[:, 1:])

    def figure(self, amount: float) -> str:
        """Write a length in maze units and in link lengths."""
        return f"{amount:.6g} {self.maze.units} ({amount / self.length:.3g} link lengths)"

    def ends(self, interval: IntArray, link: IntArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute both joints of links between poses: places, shape (n, 2, 2), and arcs, shape (n, 2)."""
        motion = self.motion
        moments, rows = np.unique(interval + time, return_inverse=True)  # many links share a configuration
        before = np.minimum(moments.astype(np.int64), motion.n_poses - 1)
        after, share = np.minimum(before + 1, motion.n_poses - 1), (moments - before)[:, None]
        feed = (1.0 - share[:, 0]) * motion.feed[before] + share[:, 0] * motion.feed[after]
        angles = (1.0 - share) * motion.joint_angles[before] + share * motion.joint_angles[after]
        joints = joints_from_configuration(feed, angles, self.length, motion.base_pose)
        rows, both = rows[:, None], np.stack([link, link + 1], axis=1)
        return joints[rows, both], self.arc_from_feed(feed)[rows, both]


def prepared(geometry: Geometry) -> Geometry:
    """Return a geometry that answers predicates fast."""
    shapely.prepare(geometry)
    return geometry


def point_of(place: FloatArray) -> tuple[float, float]:
    """Return a place, shape (2,), as plain numbers."""
    return float(place[0]), float(place[1])


def worst_of(values: FloatArray) -> tuple[float, int, int]:
    """Return the largest of values, shape (n, m), with its row and column."""
    row, column = np.unravel_index(np.argmax(values), values.shape)
    return float(values[row, column]), int(row), int(column)


def joint_fault(scene: Scene, kind: str, message: str, pose: int, joint: int, amount: float) -> Fault:
    """Return a fault at a joint."""
    link = min(joint, scene.motion.n_links - 1)
    place = point_of(scene.motion.joints[pose, joint])
    return Fault(kind=kind, message=message, pose=pose, link=link, place=place, amount=amount)


def halves(spans: FloatArray) -> FloatArray:
    """Halve spans, shape (n, 2), into shape (n, 2, 2)."""
    middle = spans.mean(axis=1)
    return np.stack(
        [np.stack([spans[:, 0], middle], axis=1), np.stack([middle, spans[:, 1]], axis=1)], axis=1
    )
