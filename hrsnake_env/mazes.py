"""The named mazes: the paper's, the families of turns of corridor width 200, and seeded random ones."""

from __future__ import annotations

from functools import partial

import numpy as np
from shapely import unary_union
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES, SEEDED_MAZES, Maze

__all__ = [
    "MAZES",
    "SEEDED_MAZES",
    "clutter_hall",
    "corridor_family",
    "fig17a",
    "fig19",
    "random_corridor",
    "serpentine",
]

FIG17A_LEG = 852.0
"""With it 45 links of 245 px just reach, and the smoothed global path is 10,385 px long, the paper's 10,505
to 1.2 %; with 867 it is 10,505, and takes 46 links."""

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


def fig17a(leg: float = FIG17A_LEG) -> Maze:
    """Build the first of the paper's extremely tight mazes (Fig. 17a): four U-turns, then a spiral.

    A reconstruction: the paper prints the number of links (45), their length (245 px), the largest joint
    angle and the length of the global path (10,505 px), no figure of the maze. Here the longest rods that
    pass are 254 px in the U-turns of width 118 and 254.6 px in the bends of width 90.

    Parameters
    ----------
    leg : float
        Length of the legs of the U-turns, in px.

    Raises
    ------
    InputError
        If the leg is too short to hold the spiral.
    """
    if not (np.isfinite(leg) and leg >= 600.0):
        raise InputError(f"Expected a finite leg of at least 600, got {leg!r}.")
    turns = [(0, -320), (0, leg), (136, leg), (136, 0), (272, 0), (272, leg), (408, leg), (408, 0), (544, 0)]
    spiral = [(544, leg - 60), (544, leg + 320), (1624, leg + 320), (1624, -540), (804, -540)]
    inner = [(804, leg + 20), (1324, leg + 20), (1324, leg - 240)]
    return Maze.from_corridors(
        [[*turns, (544, leg)], [*spiral, *inner]],
        [118.0, 90.0],
        name="fig17a",
        goal=(1324.0, leg - 200.0),
        goal_radius=45.0,
    )


def serpentine(n_turns: int, *, width: float = 118.0, pitch: float = 136.0, leg: float = 1200.0) -> Maze:
    """Build parallel legs joined by U-turns, as those of `fig17a`, to any length.

    Parameters
    ----------
    n_turns : int
        Number of U-turns.
    width, pitch, leg : float
        Of the corridor, between the legs' centrelines, and of the legs, in px.
    """
    waypoints = [(0.0, -320.0)]
    for turn in range(n_turns + 1):
        ends = (0.0, leg) if turn % 2 == 0 else (leg, 0.0)
        waypoints += [(turn * pitch, end) for end in (ends if turn else ends[1:])]
    return Maze.from_corridors(np.array(waypoints), width, name=f"serpentine of {n_turns} turns")


def random_corridor(seed: int) -> Maze:
    """Draw a corridor of seven turns of 35 to 125 degrees to either side, 120 to 220 px wide.

    Corridors that touch themselves are drawn again.
    """
    rng = np.random.default_rng(seed)
    while True:
        width = rng.uniform(120.0, 220.0)
        turns = np.radians(rng.uniform(35.0, 125.0, 7)) * rng.choice([-1.0, 1.0], 7)
        headings = np.pi / 2 + np.concatenate([[0.0], np.cumsum(turns)])
        legs = np.concatenate([[7.0], rng.uniform(2.0, 6.0, 6), [5.0]]) * width
        steps = legs[:, None] * np.column_stack([np.cos(headings), np.sin(headings)])
        waypoints = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        if _keeps_apart(waypoints, width):
            return Maze.from_corridors(waypoints, width, name=f"corridor-{seed}")


def _keeps_apart(waypoints: FloatArray, width: float) -> bool:
    """Tell whether legs that do not follow one another are more than a quarter of the width apart."""
    legs = [LineString(waypoints[k : k + 2]) for k in range(len(waypoints) - 1)]
    return all(
        legs[i].distance(legs[j]) > 1.25 * width for i in range(len(legs)) for j in range(i + 2, len(legs))
    )


def clutter_hall(seed: int) -> Maze:
    """Draw a hall of 2000 x 1400 px with 28 convex pillars of 3 to 8 corners, 60 to 130 px in radius.

    Pillars may touch. The base is on the left, with 300 px of free way in front of it, the goal on the right.
    """
    rng = np.random.default_rng(seed)
    while True:
        base = np.array([5.0, rng.uniform(200.0, 1200.0)])
        goal = np.array([1900.0, rng.uniform(100.0, 1300.0)])
        kept_free = (
            LineString([base, (base[0] + 300.0, base[1])]).buffer(40.0).union(Point(goal).buffer(60.0))
        )
        pillars: list[Polygon] = []
        while len(pillars) < 28:
            angles = np.sort(rng.uniform(0.0, 2 * np.pi, rng.integers(3, 9)))
            corners = np.column_stack([np.cos(angles), np.sin(angles)]) * rng.uniform(60.0, 130.0)
            pillar = Polygon(corners + rng.uniform((150.0, 0.0), (1950.0, 1400.0)))
            if pillar.area > 1500.0 and not pillar.intersects(kept_free):
                pillars.append(pillar)
        free_space = box(0.0, 0.0, 2000.0, 1400.0).difference(unary_union(pillars))
        try:
            return Maze(
                name=f"clutter-{seed}",
                free_space=free_space,
                base_pose=np.array([*base, 0.0]),
                goal=goal,
                goal_radius=25.0,
            )
        except InputError:  # the pillars have walled in the goal
            continue


MAZES["fig19"] = fig19
MAZES["fig17a"] = fig17a
SEEDED_MAZES["corridor"] = random_corridor
SEEDED_MAZES["clutter"] = clutter_hall
MAZES.update({name: partial(corridor_family, name) for name in LEGS})
