"""Named workspaces: the room of the paper's spatial figures, and seeded random rooms."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from planners.spatial.workspace import Panel, Workspace

__all__ = ["ROOMS", "load_workspace", "paired_panels", "random_room"]

# Panels of `paired_panels`: normal, corners of the panel, corners of its window.
PAIRED_PANELS = (
    ("x", (130, 0, 0), (150, 500, 400), (130, 90, 70), (150, 150, 130)),
    ("x", (200, 0, 0), (220, 500, 400), (200, 270, 190), (220, 330, 250)),
    ("z", (220, 0, 250), (480, 500, 270), (280, 100, 250), (340, 160, 270)),
    ("z", (220, 0, 320), (480, 500, 340), (370, 300, 320), (430, 360, 340)),
    ("x", (480, 0, 0), (500, 500, 400), (480, 300, 340), (500, 360, 400)),
    ("y", (500, 230, 0), (800, 250, 400), (620, 230, 220), (680, 250, 280)),
    ("y", (500, 160, 0), (800, 180, 400), (690, 160, 60), (750, 180, 120)),
)


def paired_panels() -> Workspace:
    """Return our workspace for Figs. 20 to 22 of the paper, whose own is not published.

    Seven panels, six of them in pairs with a gap of 50 and windows of 60 by 60 set off sideways: the arm has
    to turn twice by about 90 degrees within each gap, in all three directions.
    """
    return Workspace(
        name="paired-panels",
        room_low=np.zeros(3),
        room_high=np.array([800.0, 500.0, 400.0]),
        open_sides=("x-",),
        panels=tuple(
            Panel(
                normal=normal,
                low=np.array(low, dtype=float),
                high=np.array(high, dtype=float),
                window_low=np.array(window_low, dtype=float),
                window_high=np.array(window_high, dtype=float),
            )
            for normal, low, high, window_low, window_high in PAIRED_PANELS
        ),
        base=np.array([0.0, 120.0, 100.0]),
        heading=np.array([1.0, 0.0, 0.0]),
        straight=90.0,
        goal=np.array([670.0, 90.0, 90.0]),
        goal_radius=5.0,
    )


def random_room(seed: int, n_boxes: int = 60) -> Workspace:
    """Return a room with boxes of 40 to 160 units at random places; not every one has a way through.

    Parameters
    ----------
    seed : int
        Not negative.
    n_boxes : int
        Their number.
    """
    rng = np.random.default_rng(seed)
    size = np.array([800.0, 500.0, 400.0])
    base, goal, straight, clear = np.array([0.0, 250.0, 200.0]), np.array([740.0, 250.0, 200.0]), 60.0, 30.0
    start = base + np.array([straight, 0.0, 0.0])
    boxes: list[FloatArray] = []
    while len(boxes) < n_boxes:
        extent = 10.0 * rng.integers(4, 17, size=3)
        low = 10.0 * np.floor(rng.uniform(0.0, (size - extent) / 10.0 + 1.0))
        box = np.stack([low, low + extent])
        kept = np.stack([np.minimum(base, start) - clear, np.maximum(base, start) + clear])
        about_goal = np.stack([goal - clear, goal + clear])
        if not any(((box[0] < zone[1]) & (box[1] > zone[0])).all() for zone in (kept, about_goal)):
            boxes.append(box)
    return Workspace(
        name=f"random-{seed}",
        room_low=np.zeros(3),
        room_high=size,
        open_sides=("x-",),
        boxes=np.array(boxes),
        base=base,
        heading=np.array([1.0, 0.0, 0.0]),
        straight=straight,
        goal=goal,
        goal_radius=5.0,
    )


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
