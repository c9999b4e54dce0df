"""A kernel that shortens paths of an arm out of a feeder; states are those of `planners.kernels.fed_arm`."""

from __future__ import annotations

import numpy as np
from numba import njit

from planners.kernels.fed_arm import FedScene, edge_is_clear
from planners.kernels.types import FloatArray

LEAST = 1e-6
"""By how much, as a share, a shortcut must be shorter than the way that it replaces."""


@njit(cache=True)
def path_length(path: FloatArray) -> float:
    """Compute the length of a path of states, shape (n, n_links), in rad and link lengths."""
    length = 0.0
    for k in range(len(path) - 1):
        length += np.sqrt(np.sum((path[k + 1] - path[k]) ** 2))
    return length


@njit(cache=True)
def _cut(path: FloatArray, first: float, last: float, scene: FedScene) -> FloatArray:
    """Return a path made straight between two shares of its length, if that is shorter and free."""
    lengths = np.zeros(len(path))
    for k in range(1, len(path)):
        lengths[k] = lengths[k - 1] + np.sqrt(np.sum((path[k] - path[k - 1]) ** 2))
    low, high = first * lengths[-1], last * lengths[-1]
    i = min(np.searchsorted(lengths, low, side="right") - 1, len(path) - 2)
    j = min(np.searchsorted(lengths, high, side="right") - 1, len(path) - 2)
    if i == j:
        return path
    a = path[i] + (path[i + 1] - path[i]) * ((low - lengths[i]) / (lengths[i + 1] - lengths[i]))
    b = path[j] + (path[j + 1] - path[j]) * ((high - lengths[j]) / (lengths[j + 1] - lengths[j]))
    if np.sqrt(np.sum((b - a) ** 2)) > (1.0 - LEAST) * (high - low):
        return path
    if not (edge_is_clear(a, b, scene) and edge_is_clear(path[i], a, scene)):
        return path
    if not edge_is_clear(b, path[j + 1], scene):
        return path
    cut = np.empty((len(path) - (j - i) + 2, path.shape[1]))
    cut[: i + 1], cut[i + 1], cut[i + 2], cut[i + 3 :] = path[: i + 1], a, b, path[j + 1 :]
    return cut


@njit(cache=True)
def shortcut(path: FloatArray, draws: FloatArray, scene: FedScene) -> FloatArray:
    """Shorten a path by straight edges between places on it.

    Parameters
    ----------
    path : array, shape (n, n_links)
        States, of which no two neighbours are the same; the edges between them are free.
    draws : array, shape (n_tries, 2)
        Between which shares of the length to try, in [0, 1).
    scene : FedScene
        Feeder and walls.

    Returns
    -------
    path : array, shape (m, n_links)
        With the same ends, not longer, and free.
    """
    for row in range(len(draws)):
        path = _cut(path, min(draws[row, 0], draws[row, 1]), max(draws[row, 0], draws[row, 1]), scene)
    return path
