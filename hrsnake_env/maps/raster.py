"""From pixels to polygons: the boundary of the free pixels, exactly along their sides."""

from __future__ import annotations

import numba
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from shapely.geometry import MultiPolygon, Polygon

from hrsnake_env.errors import InputError

__all__ = ["free_polygons"]

EAST, NORTH, WEST, SOUTH = range(4)

IntArray = NDArray[np.int64]


def free_polygons(free: ArrayLike) -> Polygon | MultiPolygon:
    """Return the area of the free pixels, with the pixels' sides as its boundary.

    Free pixels that touch at a corner alone are not joined: an arm does not fit through a point.

    Parameters
    ----------
    free : array-like of bool, shape (rows, columns)
        Row 0 is at the top.

    Returns
    -------
    free_space : Polygon or MultiPolygon
        In pixels, y up; the lower left corner of the image is at (0, 0). Empty if no pixel is free.

    Raises
    ------
    InputError
        If `free` has not two axes.

    Examples
    --------
    >>> free_polygons([[1, 1, 1], [1, 0, 1], [1, 1, 1]]).area
    8.0
    """
    pixels = np.ascontiguousarray(free, dtype=np.bool_)
    if pixels.ndim != 2:
        raise InputError(f"Expected pixels with shape (rows, columns), got {pixels.shape}.")
    if not pixels.any():
        return Polygon()
    labels, n_parts = ndimage.label(pixels)
    vertices, begins, parts = _traced(pixels, labels)
    vertices, begins, parts = _split_where_they_touch(vertices, begins, parts)
    n_rings = len(parts)
    ring_of = np.repeat(np.arange(n_rings), np.diff(begins))
    following = np.arange(1, len(vertices) + 1)
    following[begins[1:] - 1] = begins[:-1]
    x, y = vertices[:, 0].astype(np.float64), float(len(pixels)) - vertices[:, 1]
    doubled = np.bincount(ring_of, weights=x * y[following] - x[following] * y, minlength=n_rings)
    order = np.lexsort((-doubled, parts))  # of each part the outer ring first: it alone has a positive area
    place = np.empty(n_rings, dtype=np.int64)
    place[order] = np.arange(n_rings)
    by_ring = np.argsort(place[ring_of], kind="stable")
    rings = shapely.linearrings(np.stack([x, y], axis=1)[by_ring], indices=place[ring_of][by_ring])
    polygons = shapely.polygons(rings, indices=parts[order] - 1)
    assert len(polygons) == n_parts
    return polygons[0] if n_parts == 1 else MultiPolygon(list(polygons))


@numba.njit(cache=True)
def _is_free(free: NDArray[np.bool_], row: int, column: int) -> bool:
    """Tell whether a pixel is free; there is none outside the image."""
    rows, columns = free.shape
    return 0 <= row < rows and 0 <= column < columns and bool(free[row, column])


@numba.njit(cache=True)
def _traced(free: NDArray[np.bool_], labels: NDArray[np.int32]) -> tuple[IntArray, IntArray, IntArray]:
    """Trace all boundaries with the free pixels on the left.

    Returns
    -------
    vertices : array, shape (n_vertices, 3)
        Column and row of each corner, and whether two boundaries meet there, ring by ring.
    begins : array, shape (n_rings + 1,)
        Where each ring begins.
    parts : array, shape (n_rings,)
        The label of the pixels on the left of each ring.
    """
    rows, columns = free.shape
    seen = np.zeros((rows + 1, columns), dtype=np.bool_)
    vertices = np.empty((1024, 3), dtype=np.int64)
    begins = np.zeros(256, dtype=np.int64)
    parts = np.zeros(256, dtype=np.int64)
    n, n_rings = 0, 0
    for row in range(1, rows + 1):
        for column in range(columns):
            # Each boundary has a run to the east: free above, not below. It begins at a corner.
            if not free[row - 1, column] or _is_free(free, row, column) or seen[row, column]:
                continue
            if column > 0 and free[row - 1, column - 1] and not _is_free(free, row, column - 1):
                continue
            i, j, heading = row, column, EAST
            while not (heading == EAST and seen[i, j]):
                if n == len(vertices):
                    vertices = np.concatenate((vertices, np.empty_like(vertices)))
                if heading == EAST:
                    seen[i, j] = True
                vertices[n] = (j, i, int(_is_touch(free, i, j)))
                n += 1
                i, j, heading = _next_corner(free, i, j, heading)
            if n_rings + 1 == len(begins):
                begins = np.concatenate((begins, np.zeros_like(begins)))
                parts = np.concatenate((parts, np.zeros_like(parts)))
            parts[n_rings] = labels[row - 1, column]
            n_rings += 1
            begins[n_rings] = n
    return vertices[:n], begins[: n_rings + 1], parts[:n_rings]


@numba.njit(cache=True)
def _is_touch(free: NDArray[np.bool_], i: int, j: int) -> bool:
    """Tell whether two free pixels touch at the corner (i, j) alone."""
    a, b = _is_free(free, i - 1, j - 1), _is_free(free, i - 1, j)
    c, d = _is_free(free, i, j - 1), _is_free(free, i, j)
    return a == d and b == c and a != b


@numba.njit(cache=True)
def _next_corner(free: NDArray[np.bool_], i: int, j: int, heading: int) -> tuple[int, int, int]:
    """Follow the boundary from corner (i, j) to the next, and return it with the heading from there on."""
    while True:
        if heading == EAST:
            j += 1
            left, right = _is_free(free, i - 1, j), _is_free(free, i, j)
        elif heading == NORTH:
            i -= 1
            left, right = _is_free(free, i - 1, j - 1), _is_free(free, i - 1, j)
        elif heading == WEST:
            j -= 1
            left, right = _is_free(free, i, j - 1), _is_free(free, i - 1, j - 1)
        else:
            i += 1
            left, right = _is_free(free, i, j), _is_free(free, i, j - 1)
        if not left:
            return i, j, (heading + 1) % 4
        if right:
            return i, j, (heading + 3) % 4


def _split_where_they_touch(
    vertices: IntArray, begins: IntArray, parts: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Cut rings that touch themselves into rings that do not, as valid polygons want them."""
    twin = np.full(len(vertices), -1, dtype=np.int64)
    touches = np.flatnonzero(vertices[:, 2])
    if len(touches) == 0:
        return vertices, begins, parts
    ring_of = np.searchsorted(begins, touches, side="right")
    keys = vertices[touches]
    order = np.lexsort((touches, keys[:, 0], keys[:, 1], ring_of))
    same = (np.diff(keys[order], axis=0) == 0).all(axis=1) & (np.diff(ring_of[order]) == 0)
    first, second = touches[order[:-1][same]], touches[order[1:][same]]
    twin[second] = first
    chosen, new_begins, new_parts = _without_loops(twin, begins, parts)
    return vertices[chosen], new_begins, new_parts


@numba.njit(cache=True)
def _without_loops(twin: IntArray, begins: IntArray, parts: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Cut a loop off a ring wherever the ring comes back to the twin of a vertex. Loops are nested."""
    n = len(twin)
    chosen, stack = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    new_begins, new_parts = np.zeros(n + 1, dtype=np.int64), np.empty(n, dtype=np.int64)
    n_chosen, n_rings = 0, 0
    for ring in range(len(parts)):
        top = 0
        for k in range(begins[ring], begins[ring + 1] + 1):
            if k < begins[ring + 1] and twin[k] < 0:
                stack[top] = k
                top += 1
                continue
            low = 0
            if k < begins[ring + 1]:
                low = top - 1
                while stack[low] != twin[k]:
                    low -= 1
            for place in range(low, top):
                chosen[n_chosen] = stack[place]
                n_chosen += 1
            new_parts[n_rings] = parts[ring]
            n_rings += 1
            new_begins[n_rings] = n_chosen
            top = low + 1  # the vertex itself stays: the ring goes on from there
    return chosen[:n_chosen], new_begins[: n_rings + 1], new_parts[:n_rings]
