"""States of an arm out of a feeder, for planners that sample them: what they mean, and which are free."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrsnake_env.maze import Maze
from planners.clock import now
from planners.kernels import fed_arm as kernel
from planners.kernels.fed_shortcut import shortcut
from planners.kernels.types import FloatArray
from planners.problem import Motion

__all__ = ["FedArm", "fed_arm", "state_bounds"]

RELEASE = 4.0
"""How far a joint may bend, in rad per link length that it is past the base: gentler than the environment's,
so that angles do not change at once where a joint comes out; in a straight first leg it costs nothing."""

MOST_BENT = 3.0
"""Largest joint angle, in rad: short of folding a link back onto its neighbour."""

MARGIN = 5e-4
"""How far links keep off walls, in link lengths. What is narrower is taken for closed."""

BATCH = 20
"""Shortcuts that are tried between two looks at the clock."""

BATCHES = 25
"""How often, at most: later ones gain little."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FedArm:
    """Hold what states of a fed arm mean in a maze (`planners.kernels.fed_arm`).

    Parameters
    ----------
    base_pose : array, shape (3,)
        Of the maze, in maze units.
    link_length : float
        In maze units.
    most_bent : float
        Largest joint angle, in rad.
    scene : FedScene
        Feeder and walls, in link lengths.
    """

    base_pose: FloatArray
    link_length: float
    most_bent: float
    scene: kernel.FedScene

    def is_clear(self, state: FloatArray) -> bool:
        """Tell whether the arm in front of the base keeps off walls and itself."""
        return bool(kernel.state_is_clear(state, self.scene))

    def edge_is_clear(self, a: FloatArray, b: FloatArray) -> bool:
        """Tell whether the arm keeps off walls and itself all the way from a, where it does, to b."""
        return bool(kernel.edge_is_clear(a, b, self.scene))

    def room(self, state: FloatArray, moves: FloatArray) -> int:
        """Count the moves, shape (n_moves, n_links), after which the arm keeps off walls and itself."""
        return int(kernel.room_around(state, moves, self.scene))

    def tip(self, state: FloatArray) -> FloatArray:
        """Return where the tip is, shape (2,), in maze units."""
        points = np.empty((len(state) + 1, 2))
        return np.asarray(self.link_length * points[kernel.place_arm(state, self.scene, points) - 1])

    def shortened(self, path: FloatArray, rng: np.random.Generator, seconds: float) -> FloatArray:
        """Return a path of states, shape (n, n_links), with shortcuts; `seconds` bounds the time roughly."""
        late = now() + seconds
        for _ in range(BATCHES):
            if len(path) < 3 or now() > late:
                break
            path = shortcut(path, rng.random((BATCH, 2)), self.scene)
        return path

    def motion(self, path: FloatArray) -> Motion:
        """Return the poses along a path of states, shape (n, n_links)."""
        n_links = path.shape[1]
        edges = [kernel.edge_poses(path[k], path[k + 1], self.scene) for k in range(len(path) - 1)]
        poses = np.concatenate([edges[0][:1], *(edge[1:] for edge in edges)])
        angles = np.column_stack([np.zeros(len(poses)), poses[:, 1:]])
        feed = self.link_length * np.minimum(poses[:, 0], n_links)
        return Motion.from_configurations(feed, angles, self.link_length, self.base_pose)


def fed_arm(
    maze: Maze, link_length: float, link_radius: float, joint_limit: float | None, margin: float = MARGIN
) -> FedArm:
    """Build what states are checked with.

    Parameters
    ----------
    maze : Maze
        With walls grown by the radius of the links.
    link_length, link_radius : float
        In maze units.
    joint_limit : float or None
        In rad.
    margin : float
        How far links keep off the walls, in link lengths; at most half as far as the base does.
    """
    scale = (link_length, link_length, 1.0)
    base, walls = maze.base_pose / scale, maze.walls / link_length
    least = np.sqrt(min(kernel.squared_distance(base[:2], *wall) for wall in walls))
    scene = kernel.FedScene(
        np.ascontiguousarray(base),
        np.ascontiguousarray(walls),
        RELEASE,
        float(min(margin, 0.5 * least)),
        2.0 * link_radius / link_length,
    )
    most = MOST_BENT if joint_limit is None else min(MOST_BENT, joint_limit)
    return FedArm(base_pose=maze.base_pose, link_length=link_length, most_bent=most, scene=scene)


def state_bounds(n_links: int, most_bent: float) -> FloatArray:
    """Return the least and the largest value of each of a state's coordinates, shape (n_links, 2)."""
    bounds = np.tile((-most_bent, most_bent), (n_links, 1))
    bounds[0] = 0.0, n_links
    return bounds
