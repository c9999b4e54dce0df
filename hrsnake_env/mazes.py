"""The named mazes: the paper's workspaces, families of turns of a corridor 200 wide, and random ones."""

from __future__ import annotations

from functools import partial

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely import unary_union
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES, MITRE_LIMIT, SEEDED_MAZES, Maze

__all__ = [
    "MAZES",
    "PAPER_LINK_LENGTHS",
    "SEEDED_MAZES",
    "clutter_hall",
    "corridor_family",
    "fig17a",
    "fig17b",
    "fig17c",
    "fig17d",
    "fig19",
    "random_corridor",
    "serpentine",
]

FIG17A_LEG = 857.0
"""With it and `FIG17A_GOAL` 45 links of 245 px just reach, with 18 px of the arm left in the feeder, and the
smoothed global path is 10,422 px long: the paper's 10,505 to 0.8 %. The links zigzag in the turns, so the arm
is 590 px longer than the path, and a path of 10,505 px takes 46 links."""

FIG17A_GOAL = 171.0
"""How far the goal of `fig17a` lies below the level of its U-turns' upper ends, in px."""

PAPER_LINK_LENGTHS: dict[str, float] = {
    "fig19": 430.0,
    "fig17a": 245.0,
    "fig17b": 225.0,
    "fig17c": 275.0,
    "fig17d": 200.0,
}
"""Link lengths with which the paper's workspaces are run, in px: all over 0.9 of the longest rod that passes.
Those of `fig19` and `fig17a` are the paper's, those of the others are our design."""

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

# fmt: off
FIG17D_CAVE = (
    (80, 430), (130, 60), (470, 60), (760, 110), (1010, 60), (1030, 420), (985, 700), (1000, 860), (950, 985),
    (1000, 1065), (1185, 1065), (1245, 945), (1330, 700), (1365, 380), (1340, 120), (1690, 60), (2050, 130),
    (2270, 90), (2330, 560), (2250, 980), (2290, 1230), (1960, 1400), (1600, 1340), (1400, 1420),
    (1415, 1190), (1300, 985), (1205, 1117), (935, 1117), (895, 1230), (905, 1400), (560, 1450), (250, 1340),
    (60, 1090), (120, 800),
)
"""Outer wall of `fig17d`: the left room, the crack, the right room."""

FIG17D_BLOCKS = (
    ((430, 300), (560, 250), (640, 360), (520, 470), (400, 420)),
    ((200, 560), (330, 560), (330, 760), (200, 760)),
    ((500, 620), (620, 560), (700, 680), (640, 800), (520, 770)),
    ((790, 560), (880, 520), (890, 700), (820, 740)),
    ((330, 880), (470, 880), (470, 960), (400, 960), (400, 1060), (330, 1060)),
    ((480, 1150), (640, 1080), (730, 1190), (640, 1310), (500, 1280)),
    ((1480, 230), (1620, 190), (1640, 350), (1520, 380)),
    ((2060, 300), (2170, 300), (2170, 430), (2060, 430)),
    ((1480, 560), (1590, 500), (1660, 600), (1560, 700)),
    ((1800, 530), (1960, 560), (1930, 640), (1860, 625), (1840, 720), (1770, 700)),
    ((1440, 860), (1530, 800), (1620, 880), (1570, 980), (1460, 960)),
    ((1990, 820), (2110, 850), (2080, 990), (1970, 960)),
    ((1550, 1110), (1700, 1110), (1700, 1210), (1550, 1210)),
    ((1850, 1100), (1960, 1060), (2060, 1150), (2000, 1260), (1860, 1230)),
)
"""Corners of the blocks in `fig17d`."""

FIG17D_DRUMS = (
    (800, 330, 85, 14, 0), (760, 920, 70, 9, 10), (210, 1130, 60, 10, 0),
    (1820, 300, 90, 16, 0), (2130, 640, 75, 11, 5), (1760, 880, 95, 18, 0),
)
"""Round blocks in `fig17d`: centre, radius, number of corners, turn in degrees."""
# fmt: on


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
    angle and the length of the global path (10,505 px), no dimensions of the maze. Here the longest rods that
    pass are 254 px in the U-turns of width 118 and 254.6 px in the bends of width 90, the last one included.

    Parameters
    ----------
    leg : float
        Length of the legs of the U-turns, in px; the spiral and the goal move with their upper ends.

    Raises
    ------
    InputError
        If the leg is too short to hold the spiral.
    """
    if not (np.isfinite(leg) and leg >= 600.0):
        raise InputError(f"Expected a finite leg of at least 600, got {leg!r}.")
    turns = [(0, -320), (0, leg), (136, leg), (136, 0), (272, 0), (272, leg), (408, leg), (408, 0), (544, 0)]
    spiral = [(544, leg - 60), (544, leg + 320), (1624, leg + 320), (1624, -540), (804, -540)]
    goal = (1324.0, leg - FIG17A_GOAL)
    inner = [(804, leg + 20), (1324, leg + 20), (1324, goal[1] - 40)]
    return Maze.from_corridors(
        [[*turns, (544, leg)], [*spiral, *inner]],
        [118.0, 90.0],
        name="fig17a",
        goal=goal,
        goal_radius=45.0,
    )


def fig17b() -> Maze:
    """Build one tight U-turn round a thin wall, then a hall of pillars in rows.

    Our design for the paper's Fig. 17b, of which it prints no dimensions; it says that the workspaces b, c
    and d have light places besides tight ones. The U-turn limits the longest rod to 242 px. Between the
    pillars, 144 px and more apart, there are many ways.
    """
    turn = _corridor([(0, 0), (0, 1180), (132, 1180), (132, 160), (330, 160)], 110.0)
    squares = [box(x - 90, y - 90, x + 90, y + 90) for x in (520, 1130, 1740) for y in (330, 720, 1110)]
    drums = [_drum(x, y, 95, 12) for x in (825, 1435) for y in (60, 525, 915, 1400)]
    return Maze(
        name="fig17b",
        free_space=_joined(turn, box(230, 60, 2100, 1400)).difference(unary_union([*squares, *drums])),
        base_pose=np.array([0.0, 5.0, np.pi / 2]),
        goal=np.array([1990.0, 1290.0]),
        goal_radius=30.0,
    )


def fig17c() -> Maze:
    """Build a tight S-bend, a hall with a free-standing block, and a wider S-bend that turns back.

    Our design for the paper's Fig. 17c, of which it prints no dimensions. All bends are rounded. The first
    S-bend, 92 px wide, limits the longest rod to 298 px.
    """
    first = _corridor(_with_arcs([(0, 0), (640, 0), (640, 680), (1200, 680)], 90.0), 92.0)
    hall = Polygon([(1120, 420), (1700, 330), (1980, 560), (1980, 1010), (1640, 1180), (1180, 1060)])
    block = Polygon([(1500, 740), (1690, 710), (1730, 890), (1570, 950)])
    second = _corridor(_with_arcs([(1900, 700), (2520, 700), (2030, 0), (2600, 0)], 150.0), 130.0)
    return Maze(
        name="fig17c",
        free_space=_joined(first, hall, second).difference(block),
        base_pose=np.array([5.0, 0.0, 0.0]),
        goal=np.array([2550.0, 0.0]),
        goal_radius=30.0,
    )


def fig17d() -> Maze:
    """Build two rooms of a cave, full of irregular blocks, and a crooked crack between them.

    Our design for the paper's Fig. 17d, of which it prints no dimensions. The crack, 52 to 68 px wide with a
    kink of about 60 degrees, limits the longest rod to 216 px. In the rooms there are many ways.
    """
    free_space = Polygon(FIG17D_CAVE)
    blocks = [*map(Polygon, FIG17D_BLOCKS), *(_drum(*drum) for drum in FIG17D_DRUMS)]
    return Maze(
        name="fig17d",
        free_space=free_space.difference(unary_union(blocks)),
        base_pose=np.array([300.0, 65.0, np.pi / 2]),
        goal=np.array([2200.0, 190.0]),
        goal_radius=30.0,
    )


def _corridor(waypoints: ArrayLike, width: float) -> Polygon:
    """Return a corridor with mitred corners and flat ends."""
    return LineString(waypoints).buffer(
        0.5 * width, cap_style="flat", join_style="mitre", mitre_limit=MITRE_LIMIT
    )


def _joined(*parts: Polygon) -> Polygon:
    """Return the union, with corners to 1e-6 px: buffers leave them at 1e-13 beside their place."""
    return shapely.transform(unary_union(parts), lambda xy: np.round(xy, 6) + 0.0)


def _with_arcs(waypoints: ArrayLike, radius: float) -> FloatArray:
    """Replace the corners of a line by arcs, in chords of at most 15 degrees."""
    points = np.asarray(waypoints, dtype=np.float64)
    along = np.diff(points, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    parts = [points[:1]]
    for corner, before, after in zip(points[1:-1], along[:-1], along[1:], strict=True):
        turn = np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after)
        angles = np.linspace(0.0, abs(turn), int(np.ceil(abs(turn) / np.radians(15.0))) + 1)[:, None]
        inward = np.sign(turn) * np.array([-before[1], before[0]])
        start = corner - radius * np.tan(0.5 * abs(turn)) * before
        parts.append(start + radius * (np.sin(angles) * before + (1.0 - np.cos(angles)) * inward))
    return np.concatenate([*parts, points[-1:]])


def _drum(x: float, y: float, radius: float, n_corners: int, turn: float = 0.0) -> Polygon:
    """Return a regular polygon: a round pillar as walls can have it; `turn` in degrees."""
    angles = np.radians(turn) + 2.0 * np.pi * np.arange(n_corners) / n_corners
    corners = np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])
    return Polygon(np.round(corners, 3))


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
MAZES["fig17b"] = fig17b
MAZES["fig17c"] = fig17c
MAZES["fig17d"] = fig17d
SEEDED_MAZES["corridor"] = random_corridor
SEEDED_MAZES["clutter"] = clutter_hall
MAZES.update({name: partial(corridor_family, name) for name in LEGS})
