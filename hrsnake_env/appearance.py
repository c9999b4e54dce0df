"""What every picture of a maze and an arm has in common: colours, the scale of clearances, what is shown."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray
from hrsnake_env.contacts import PINCH_TOLERANCE, Contact
from hrsnake_env.maze import Maze

__all__ = ["COLOURS", "FAR", "FEEDER_SHARE", "RGB", "link_colours", "mixed", "rgb", "shown_window"]

COLOURS = {
    "wall": "#c9ccd1",
    "edge": "#4b5058",
    "free": "#ffffff",
    "goal": "#2e9e5b",
    "base": "#4b5058",
    "arm": "#1f5fae",
    "near": "#6db3ea",
    "joint": "#0d2f5c",
    "pinch": "#e69f00",
    "collision": "#d62828",
}
"""`arm` is a link far from the walls, `near` one that all but pinches them."""

FAR = 0.1
"""In link lengths: free links farther than this from the walls all look the same."""

FEEDER_SHARE = 0.06
"""So much of the maze's size is shown behind the base."""

RGB = tuple[int, int, int]


def rgb(name: str) -> RGB:
    """Return a colour of `COLOURS` as red, green and blue, each in 0 to 255."""
    red, green, blue = bytes.fromhex(COLOURS[name][1:])
    return red, green, blue


def mixed(start: RGB, end: RGB, share: float) -> RGB:
    """Return the colour a share of the way from one to another."""
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(start, end, strict=True))
    return red, green, blue


def link_colours(
    n_links: int,
    *,
    clearances: ArrayLike | None = None,
    link_length: float = 1.0,
    contacts: Iterable[Contact] = (),
) -> list[RGB]:
    """Choose each link's colour: the nearer to a wall, the lighter; what touches has a colour of its own.

    The scale is that of the HTML replay: logarithmic, from `FAR` down to the pinch tolerance.

    Parameters
    ----------
    n_links : int
        Number of links.
    clearances : array-like, shape (n_links,), optional
        In maze units. Without them all free links look the same.
    link_length : float
        In maze units.
    contacts : iterable of Contact
        What touches.

    Returns
    -------
    colours : list of RGB
        One per link.
    """
    colours = [rgb("arm")] * n_links
    if clearances is not None:
        shares = np.maximum(np.asarray(clearances, dtype=np.float64) / link_length, PINCH_TOLERANCE)
        scaled = np.log(FAR / shares) / math.log(FAR / PINCH_TOLERANCE)
        colours = [mixed(rgb("arm"), rgb("near"), share) for share in np.clip(scaled, 0.0, 1.0).tolist()]
    for contact in sorted(contacts, key=lambda contact: contact.kind == "collision"):
        for link in {contact.link, contact.other} - {None}:
            colours[int(link)] = rgb(contact.kind)  # type: ignore[arg-type]
    return colours


def shown_window(maze: Maze) -> FloatArray:
    """Return x_min, y_min, x_max, y_max of what is shown: the maze, a margin, and the feeder's first bit."""
    margin, behind = 0.02 * maze.size, FEEDER_SHARE * maze.size
    x, y, heading = maze.base_pose
    feeder = np.array([x - behind * np.cos(heading), y - behind * np.sin(heading)])
    x_min, y_min, x_max, y_max = maze.free_space.bounds
    low = np.minimum([x_min - margin, y_min - margin], feeder)
    high = np.maximum([x_max + margin, y_max + margin], feeder)
    return np.concatenate([low, high])
