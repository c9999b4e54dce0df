"""How much memory a motion may take, whatever the time that planning has."""

from __future__ import annotations

from hrsnake_env.errors import InputError
from planners.reading import MOTION_BYTES

__all__ = ["TooLarge", "most_poses"]


class TooLarge(InputError):
    """Raised where a motion would take more memory than is allowed.

    Parameters
    ----------
    place : tuple of two or three floats
        Where the tip has come to, in maze units.
    n_poses, n_links : int
        How many poses there are until then, and how many links the arm has.
    """

    def __init__(self, place: tuple[float, ...], n_poses: int, n_links: int) -> None:
        where = ", ".join(f"{value:.1f}" for value in place)
        super().__init__(
            f"Expected a motion of at most {MOTION_BYTES // 2**20} MiB, got more: {n_poses} poses of "
            f"{n_links} links bring the tip to ({where}). Longer links take less."
        )
        self.place = place


def most_poses(n_links: int, dimension: int = 2) -> int:
    """Return how many poses of an arm have room: their joints, joint angles and feed.

    Parameters
    ----------
    n_links : int
        Of the arm.
    dimension : int
        2 in the plane, 3 in space, where a joint has two angles.

    Examples
    --------
    >>> most_poses(99) > 800_000
    True
    """
    numbers = (n_links + 1) * dimension + n_links * (dimension - 1) + 1
    return MOTION_BYTES // (8 * numbers)
