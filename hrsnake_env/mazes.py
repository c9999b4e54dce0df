"""The named mazes: the paper's benchmark and the families of turns, all of corridor width 200."""

from __future__ import annotations

from functools import partial

import numpy as np
from shapely.geometry import Polygon

from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES, Maze

__all__ = ["MAZES", "corridor_family", "fig19"]

DIRECTIONS = {"N": (0.0, 1.0), "E": (1.0, 0.0), "S": (0.0, -1.0), "W": (-1.0, 0.0)}

LEGS = {
    "L": "N1500 E1500",
    "U40": "N1500 E240 S1500",
    "U200": "N1500 E400 S1500",
    "S0": "N1500 E240 N1500",
    "S200": "N1500 E400 N1500",
    "S400": "N1500 E600 N1500",
    "S1000": "N1500 E1200 N1500",
    "zig3": "N1500 E240 S700 E240 N1500",
    "serp": "N1500 E240 S800 E240 N800 E240 S800 E240 N1500",
    "stairs": "N1500 E400 N400 E400 N400 E400 N400 E400 N1500",
    "spiral": "N3000 E2600 S2300 W2000 N1700 E1400 S1100 W800",
}
"""Centrelines of the families: compass direction and length of each leg, from (0, 0)."""


def fig19(l1: float = 200.0, l2: float = 200.0, wall: float = 40.0, end_gap: float = 200.0) -> Maze:
    """Build the paper's benchmark, a U-turn round a thin wall (Fig. 19).

    A reconstruction: the paper prints the figure's lengths (l1 = l2 = 200, longest possible link 440, so a
    wall of 40), but neither the length of the legs nor the gap at the wall's end. The legs here are 1500 long
    and the gap is as wide as a leg.

    Parameters
    ----------
    l1, l2 : float
        Width of the first and of the second leg, in px.
    wall : float
        Thickness of the wall between them.
    end_gap : float
        From the wall's end to the outer wall.

    Raises
    ------
    InputError
        If a length is not positive and finite, or `end_gap` leaves no wall.

    Examples
    --------
    >>> fig19().free_space.bounds
    (-100.0, 0.0, 340.0, 1600.0)
    """
    for key, value in {"l1": l1, "l2": l2, "wall": wall, "end_gap": end_gap}.items():
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"Expected a positive, finite {key}, got {value!r}.")
    leg = 1500.0
    if end_gap >= 2 * leg:
        raise InputError(f"Expected an end_gap under {2 * leg:g}, so that a wall is left, got {end_gap:g}.")
    left, inner, outer = -l1 / 2, l1 / 2, l1 / 2 + wall
    right, top, tip = outer + l2, leg + end_gap / 2, leg - end_gap / 2
    corners = [
        (left, 0),
        (inner, 0),
        (inner, tip),
        (outer, tip),
        (outer, 0),
        (right, 0),
        (right, top),
        (left, top),
    ]
    return Maze(
        name="fig19",
        free_space=Polygon(corners),
        base_pose=np.array([0.0, 5.0, np.pi / 2]),
        goal=np.array([outer + l2 / 2, 700.0]),
        goal_radius=25.0,
    )


def corridor_family(name: str, width: float = 200.0) -> Maze:
    """Build a maze of the families: right-angled turns of one corridor, with long end legs.

    Parameters
    ----------
    name : str
        A key of `LEGS`.
    width : float
        Of the corridor, in px; the centreline stays where it is.

    Raises
    ------
    InputError
        If there is no such family.
    """
    if name not in LEGS:
        raise InputError(f"Unknown family {name!r}. Available: {', '.join(LEGS)}.")
    waypoints = [np.zeros(2)]
    for leg in LEGS[name].split():
        waypoints.append(waypoints[-1] + float(leg[1:]) * np.array(DIRECTIONS[leg[0]]))
    return Maze.from_corridors(np.array(waypoints), width, name=name)


MAZES["fig19"] = fig19
MAZES.update({name: partial(corridor_family, name) for name in LEGS})
