"""Walls with a window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from planners.spatial.entries import check_keys, corners_of, point_text, store_box, vector_of

__all__ = ["AXES", "Panel", "panel_from_dict"]

AXES = "xyz"


@dataclass(frozen=True, eq=False, kw_only=True)
class Panel:
    """Describe a wall of some thickness with one rectangular window.

    Parameters
    ----------
    low, high : array-like, shape (3,)
        Two opposite corners of the whole panel, window included.
    normal : str
        `x`, `y` or `z`: the axis along which the window goes through.
    window_low, window_high : array-like, shape (3,)
        Two opposite corners of the window. Along the normal they are those of the panel.

    Raises
    ------
    InputError
        If a box is inside out or the window is not in the panel.
    """

    low: FloatArray
    high: FloatArray
    normal: str
    window_low: FloatArray
    window_high: FloatArray

    def __post_init__(self) -> None:
        if self.normal not in tuple(AXES):
            raise InputError(f"Expected the normal of a panel to be x, y or z, got {self.normal!r}.")
        store_box(self, "low", "high", "a panel")
        axis = AXES.index(self.normal)
        for key, limit in (("window_low", self.low), ("window_high", self.high)):
            corner = vector_of(getattr(self, key), "a corner of the window of a panel")
            corner[axis] = limit[axis]
            object.__setattr__(self, key, corner)
        store_box(self, "window_low", "window_high", "the window of a panel")
        if not ((self.window_low >= self.low).all() and (self.window_high <= self.high).all()):
            raise InputError(
                f"Expected the window of a panel inside it, from {point_text(self.low)} to "
                f"{point_text(self.high)}, got one from {point_text(self.window_low)} to "
                f"{point_text(self.window_high)}."
            )

    @property
    def boxes(self) -> FloatArray:
        """The panel as up to four boxes, shape (n, 2, 3): all of it beyond each edge of the window.

        They overlap at the corners. Boxes that merely abut would have seams, at which the way out of a wall
        would point into the next.
        """
        found = []
        for axis in range(3):
            if axis == AXES.index(self.normal):
                continue
            below, above = np.stack([self.low, self.high]), np.stack([self.low, self.high])
            below[1, axis], above[0, axis] = self.window_low[axis], self.window_high[axis]
            found += [box for box in (below, above) if box[1, axis] > box[0, axis]]
        return np.array(found).reshape(-1, 2, 3)


def panel_from_dict(data: Any, number: int) -> Panel:
    """Build a panel of a workspace file; `number` says which, for people."""
    what = f"panel {number}"
    check_keys(data, what, ("low", "high", "normal", "window"), ("low", "high", "normal", "window"))
    low, high = corners_of({"low": data["low"], "high": data["high"]}, what)
    window = corners_of(data["window"], f"the window of {what}")
    try:
        return Panel(low=low, high=high, normal=data["normal"], window_low=window[0], window_high=window[1])
    except InputError as error:
        raise InputError(f"{str(error).removesuffix('.')} ({what}).") from None
