"""The beams (section 2 of the paper): perpendicular rays from each path point to the walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hrsnake_env.maze import Maze
from planners.kernels.rays import cast_rays
from planners.kernels.types import FloatArray
from planners.path import Path

__all__ = ["Beams", "cast_beams"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Beams:
    """Hold the beams on both sides of a path: the paper's green (left) and red (right).

    Parameters
    ----------
    origins : array, shape (n, 2)
        The path points.
    normals : array, shape (n, 2)
        Unit vectors to the left of the path.
    left_lengths, right_lengths : array, shape (n,)
        Exact distance to the first wall, in maze units.
    """

    origins: FloatArray
    normals: FloatArray
    left_lengths: FloatArray
    right_lengths: FloatArray

    @property
    def left(self) -> FloatArray:
        """Ends of the left beams, shape (n, 2)."""
        return self.ends(+1)

    @property
    def right(self) -> FloatArray:
        """Ends of the right beams, shape (n, 2)."""
        return self.ends(-1)

    def ends(self, side: int, longest: float = np.inf) -> FloatArray:
        """Return the beams' ends on one side, shape (n, 2).

        Parameters
        ----------
        side : int
            +1 for left, -1 for right.
        longest : float
            Longer beams are cut to this length, in maze units: at a junction a beam may reach down another
            corridor.
        """
        lengths = self.left_lengths if side > 0 else self.right_lengths
        return self.origins + side * np.minimum(lengths, longest)[:, None] * self.normals


def cast_beams(maze: Maze, path: Path) -> Beams:
    """Cast the beams of a path by exact ray casting.

    Parameters
    ----------
    maze : Maze
        The maze.
    path : Path
        A path in its free space.

    Returns
    -------
    beams : Beams
        One pair per path point.
    """
    normals = np.column_stack([-path.tangents[:, 1], path.tangents[:, 0]])
    left, right = np.empty(len(normals)), np.empty(len(normals))
    walls = maze.walls
    cast_rays(path.points, normals, walls, left)
    cast_rays(path.points, -normals, walls, right)
    # A ray through the seam of two walls can slip between them by rounding; nothing is farther than this.
    return Beams(
        origins=path.points,
        normals=normals,
        left_lengths=np.minimum(left, maze.size),
        right_lengths=np.minimum(right, maze.size),
    )
