"""Named workspaces: the room of the paper's spatial figures, and seeded random rooms."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from planners.spatial.panel import AXES, Panel
from planners.spatial.workspace import Workspace

__all__ = ["ROOMS", "load_workspace", "paired_panels", "panels_in_a_row", "random_room"]

ROOM = np.array([800.0, 500.0, 400.0])
"""Size of all of these rooms."""

CLEAR, MOST_DRAWN = 30.0, 100
"""Distance of random boxes from goal and straight stretch, and how often they are drawn at most."""


def paired_panels(*, gap: float = 50.0, window: float = 60.0, thickness: float = 20.0) -> Workspace:
    """Return our workspace for Figs. 20 to 22 of the paper, whose own is not published.

    Seven panels, six of them in pairs with windows set off sideways: the arm has to turn twice by about 90
    degrees within each gap, in all three directions.

    Parameters
    ----------
    gap : float
        Between the panels of a pair. A wider one leaves less behind the pair.
    window : float
        Width and height of the windows.
    thickness : float
        Of the panels.

    Raises
    ------
    InputError
        If panels of these sizes do not fit the room.
    """
    pair, high, half = thickness + gap, ROOM, 0.5 * window
    far = 130.0 + pair + thickness  # the far side of the first pair
    middle, last = (far, 0.0, 0.0), (480.0 + thickness, 0.0, 0.0)
    panels = (
        _panel("x", 130.0, thickness, (0.0, 0.0, 0.0), high, (0.0, 120.0, 100.0), half),
        _panel("x", 130.0 + pair, thickness, (0.0, 0.0, 0.0), high, (0.0, 300.0, 220.0), half),
        _panel("z", 250.0, thickness, middle, (480.0, high[1], 0.0), (310.0, 130.0, 0.0), half),
        _panel("z", 250.0 + pair, thickness, middle, (480.0, high[1], 0.0), (400.0, 330.0, 0.0), half),
        _panel("x", 480.0, thickness, (0.0, 0.0, 0.0), high, (0.0, 330.0, high[2] - half), half),
        _panel("y", 160.0 + pair, thickness, last, high, (650.0, 0.0, 250.0), half),
        _panel("y", 160.0, thickness, last, high, (720.0, 0.0, 90.0), half),
    )
    usual = (gap, window, thickness) == (50.0, 60.0, 20.0)
    return Workspace(
        name="paired-panels" if usual else f"paired-panels-{gap:g}-{window:g}-{thickness:g}",
        room_low=np.zeros(3),
        room_high=ROOM,
        open_sides=("x-",),
        panels=panels,
        base=np.array([0.0, 120.0, 100.0]),
        heading=np.array([1.0, 0.0, 0.0]),
        straight=90.0,
        goal=np.array([670.0, 90.0, 90.0]),
        goal_radius=5.0,
    )


def panels_in_a_row(n_panels: int) -> Workspace:
    """Return a room that is as long as there are panels, with windows in two opposite corners in turn.

    Parameters
    ----------
    n_panels : int
        At least 1.
    """
    pitch, low, high = 150.0, (0.0, 0.0, 0.0), np.array([150.0 * (n_panels + 1), 300.0, 300.0])
    places = (100.0, 200.0)
    return Workspace(
        name=f"row-of-{n_panels}",
        room_low=np.zeros(3),
        room_high=high,
        open_sides=("x-",),
        panels=tuple(
            _panel("x", pitch * (k + 1), 20.0, low, high, (0.0, places[k % 2], places[k % 2]), 30.0)
            for k in range(n_panels)
        ),
        base=np.array([0.0, 100.0, 100.0]),
        heading=np.array([1.0, 0.0, 0.0]),
        straight=90.0,
        goal=np.array([high[0] - 50.0, 150.0, 150.0]),
        goal_radius=5.0,
    )


def _panel(
    normal: str,
    start: float,
    thickness: float,
    low: ArrayLike,
    high: ArrayLike,
    centre: ArrayLike,
    half: float,
) -> Panel:
    """Return a panel from `start` on along its normal; across, from `low` to `high`, with a square window."""
    corners = [np.array(corner, dtype=np.float64) for corner in (low, high)]
    window = [np.asarray(centre) - half, np.asarray(centre) + half]
    for ends in (corners, window):
        ends[0][AXES.index(normal)], ends[1][AXES.index(normal)] = start, start + thickness
    return Panel(normal=normal, low=corners[0], high=corners[1], window_low=window[0], window_high=window[1])


def random_room(seed: int, n_boxes: int = 60) -> Workspace:
    """Return a room with boxes of 40 to 160 units at random places; not every one has a way through.

    Base and goal are near opposite corners, and from no place on the straight stretch is the goal in sight:
    otherwise links of any length might reach it. Boxes are drawn anew until that is so, but not for ever, as
    a few boxes may hide nothing.

    Parameters
    ----------
    seed : int
        Not negative.
    n_boxes : int
        Their number.
    """
    rng = np.random.default_rng(seed)
    base, goal = np.array([0.0, 120.0, 100.0]), np.array([740.0, 400.0, 320.0])
    stretch = base + np.linspace(0.0, 60.0, 13)[:, None] * np.array([1.0, 0.0, 0.0])
    kept = [(stretch.min(axis=0) - CLEAR, stretch.max(axis=0) + CLEAR), (goal - CLEAR, goal + CLEAR)]
    for _ in range(MOST_DRAWN):
        boxes = _random_boxes(rng, n_boxes, kept)
        if not _sees(stretch, goal, boxes):
            break
    return Workspace(
        name=f"random-{seed}",
        room_low=np.zeros(3),
        room_high=ROOM,
        open_sides=("x-",),
        boxes=boxes,
        base=base,
        heading=np.array([1.0, 0.0, 0.0]),
        straight=float(stretch[-1, 0] - base[0]),
        goal=goal,
        goal_radius=5.0,
    )


def _random_boxes(
    rng: np.random.Generator, n_boxes: int, kept: Sequence[tuple[FloatArray, FloatArray]]
) -> FloatArray:
    """Draw boxes, shape (n_boxes, 2, 3), that leave free what is kept."""
    boxes: list[FloatArray] = []
    while len(boxes) < n_boxes:
        extent = 10.0 * rng.integers(4, 17, size=3)
        low = 10.0 * np.floor(rng.uniform(0.0, (ROOM - extent) / 10.0 + 1.0))
        box = np.stack([low, low + extent])
        if not any(((box[0] < zone[1]) & (box[1] > zone[0])).all() for zone in kept):
            boxes.append(box)
    return np.array(boxes).reshape(-1, 2, 3)


def _sees(places: FloatArray, goal: FloatArray, boxes: FloatArray) -> bool:
    """Tell whether a straight line from some place, shape (n, 3), to the goal misses all boxes."""
    way = goal - places[:, None, None]  # no coordinate of the goal is that of a place
    shares = (boxes - places[:, None, None]) / way
    enter, leave = shares.min(axis=2).max(axis=2), shares.max(axis=2).min(axis=2)
    meets = (enter < leave) & (leave > 0.0) & (enter < 1.0)
    return not meets.any(axis=1).all()


ROOMS: dict[str, Callable[[], Workspace]] = {"paired-panels": paired_panels}
"""Named workspaces."""


def load_workspace(source: str | os.PathLike[str]) -> Workspace:
    """Load a named workspace, or a workspace file (JSON).

    Parameters
    ----------
    source : str or path
        One of `ROOMS`, `random-SEED`, or the path of a `.json` file.

    Raises
    ------
    InputError
        If there is no such workspace, or the file does not hold one.

    Examples
    --------
    >>> load_workspace("paired-panels").goal
    array([670.,  90.,  90.])
    """
    text = os.fspath(source)
    if text in ROOMS:
        return ROOMS[text]()
    kind, _, seed = text.rpartition("-")
    if kind == "random" and seed.isascii() and seed.isdigit():
        return random_room(int(seed))
    if Path(text).suffix.lower() != ".json":
        raise InputError(
            f"Unknown workspace {text!r}. Available: {', '.join(ROOMS)}, random-SEED; or give the path of a "
            f".json file."
        )
    return Workspace.load(text)
