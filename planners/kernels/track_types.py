"""What the kernels of the track planner pass around: bundles of arrays, all in link lengths."""

from __future__ import annotations

from typing import NamedTuple

from planners.kernels.types import FloatArray, IntArray

ROW_WIDTH = 6
"""Samples that one constraint ties together, at most."""


class Surroundings(NamedTuple):
    """Walls, listed by the cells of a grid, and their convex corners.

    Attributes
    ----------
    walls : array, shape (n_walls, 2, 2)
        Segments.
    corners, outward : array, shape (n_corners, 2)
        Convex corners, and unit vectors from each into the free space.
    origin : array, shape (2,)
        Corner of the grid.
    cell : float
        Size of a grid cell.
    nx, ny : int
        Cells of the grid; cell (x, y) has number y nx + x.
    first : array, shape (nx ny + 1,)
        Place of each cell's first wall in `members`.
    members : array
        Indices of the walls whose box is near a cell.
    """

    walls: FloatArray
    corners: FloatArray
    outward: FloatArray
    origin: FloatArray
    cell: float
    nx: int
    ny: int
    first: IntArray
    members: IntArray


class Chords(NamedTuple):
    """The chords of a track of n samples, in the order of their ends.

    Attributes
    ----------
    end, end_share : array, shape (n_chords_max,)
        The segment of the track on which a chord ends, and at which share of it.
    segment, share : array, shape (n_chords_max,)
        The same for its start.
    depth : array, shape (n_chords_max, 2)
        How far the worst corner of those that belong to the left (0), to the right (1), is across; negative
        if it is on its own side, -inf if there is none near.
    place : array, shape (n_chords_max, 2)
        At which share of the chord that corner is.
    of_sample : array, shape (n,)
        The chord that ends at each sample behind the axis.
    """

    end: IntArray
    end_share: FloatArray
    segment: IntArray
    share: FloatArray
    depth: FloatArray
    place: FloatArray
    of_sample: IntArray


class Rows(NamedTuple):
    """Constraints on the movement of samples: sum of factor . movement >= wanted.

    Attributes
    ----------
    samples : array, shape (n_rows_max, ROW_WIDTH)
        Their indices; -1 where there is none.
    factor : array, shape (n_rows_max, ROW_WIDTH, 2)
        For movements in the plane.
    slope : array, shape (n_rows_max, ROW_WIDTH)
        For movements along the track's normals.
    wanted, weight : array, shape (n_rows_max,)
        What is wanted, and how much it counts.
    """

    samples: IntArray
    factor: FloatArray
    slope: FloatArray
    wanted: FloatArray
    weight: FloatArray
