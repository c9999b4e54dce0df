"""A ladder of tasks, from one that everything solves to the paper's workspaces; each maze suits its arm.

What makes a task hard is not the number of links but the index: how long a link is, over the longest rod that
passes the maze's turns. The legs of the short rungs grow with the link, so that they take few links at any
index.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from hrsnake_env.maze import RUNG_MAZES, Maze
from hrsnake_env.mazes import DIRECTIONS, PAPER_LINK_LENGTHS

__all__ = ["LADDER", "Rung", "rung_maze"]

WIDTH = 200.0
"""Of the corridors of the short rungs, in px, as of the families."""

SHAPES = {
    "straight": "N",
    "bend": "N E",
    "u-turn": "N E240 S",
    "s-bend": "N E400 N",
    "zigzag": "N E240 S E240 N",
    "u-turn-long": "N E240 S",
    "u-turn-deep": "N3000 E240 S2500",
}
"""Compass directions of the legs; those without a length in px grow with the link."""

FIRST, INNER, LAST = 2.0, 2.5, 1.5
"""Lengths of growing legs in links; of the last one, up to the goal. In front of the tightest U-turn a first
leg of 1.5 is too short: the first link is in the turn while the second one cannot leave the feeder's axis."""

RIGHT_ANGLE = 2.0 * math.sqrt(2.0) * WIDTH
"""The longest rod that passes a right-angled bend, in px."""

U_TURN = 2.0 * WIDTH + 40.0
"""The longest rod that passes a U-turn around a wall of 40 px, in px."""

RODS = {
    "straight": math.inf,
    "bend": RIGHT_ANGLE,
    "u-turn": U_TURN,
    "s-bend": RIGHT_ANGLE,
    "zigzag": U_TURN,
    "u-turn-long": U_TURN,
    "u-turn-deep": U_TURN,
}
"""The longest rods that pass the shapes if their legs are long, in px."""

LONGER = {"u-turn-long": 2.3}
"""Factor by which the growing legs of these shapes are longer."""


@dataclass(frozen=True, kw_only=True)
class Rung:
    """Hold a task of the ladder.

    Parameters
    ----------
    maze : str
        Name of the maze, for `Maze.load`.
    link_length : float
        In maze units.
    n_links : int
        Enough to reach the goal.
    longest_rod : float
        The longest rod that passes the maze's turns if its legs are long enough; infinite without a turn.
    role : str
        What the task is for.
    """

    maze: str
    link_length: float
    n_links: int
    longest_rod: float
    role: str

    @property
    def index(self) -> float:
        """Link length over the longest rod: the paper's I."""
        return self.link_length / self.longest_rod


def rung_maze(shape: str, link_length: float, *, name: str = "rung", longer: float | None = None) -> Maze:
    """Build the maze of a short rung.

    Parameters
    ----------
    shape : str
        A key of `SHAPES`.
    link_length : float
        In px.
    name : str
        Of the maze.
    longer : float, optional
        Factor by which the legs are longer that grow with the link; by default the shape's own.
    """
    longer = LONGER.get(shape, 1.0) if longer is None else longer
    legs = SHAPES[shape].split()
    grown = [FIRST, *[INNER] * (len(legs) - 2), LAST] if len(legs) > 1 else [INNER]
    lengths = [float(leg[1:] or longer * links * link_length) for leg, links in zip(legs, grown, strict=True)]
    lengths[-1] += WIDTH / 2  # the goal stands half a width before the end
    steps = np.array([DIRECTIONS[leg[0]] for leg in legs]) * np.array(lengths)[:, None]
    waypoints = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    return Maze.from_corridors(waypoints, WIDTH, name=name)


def _short(shape: str, link_length: float, n_links: int, role: str) -> Rung:
    """Return a short rung, named after its shape and index, and register its maze."""
    rod = RODS[shape]
    name = shape if math.isinf(rod) else f"{shape}-i{round(100.0 * link_length / rod):02d}"
    RUNG_MAZES[name] = partial(rung_maze, shape, link_length, name=name)
    return Rung(maze=name, link_length=link_length, n_links=n_links, longest_rod=rod, role=role)


def _papers(maze: str, n_links: int, longest_rod: float, role: str) -> Rung:
    return Rung(
        maze=maze,
        link_length=PAPER_LINK_LENGTHS[maze],
        n_links=n_links,
        longest_rod=longest_rod,
        role=role,
    )


RUNGS = (
    _short("straight", 130.0, 3, "A smoke test: feed, and arrive."),
    _short("bend", 170.0, 4, "One loose bend: the first task in which joints must turn."),
    _short("bend", 340.0, 5, "One bend whose inner corner links hit if they follow the path."),
    _short("u-turn", 132.0, 5, "A loose U-turn: links that follow the path pass."),
    _short(
        "u-turn",
        220.0,
        5,
        "The first U-turn that links which follow the path do not pass: here planning begins.",
    ),
    _short("u-turn", 264.0, 5, "A U-turn of medium tightness."),
    _short("u-turn", 352.0, 5, "A tight U-turn: links have a fifth of the longest rod to spare."),
    _short("u-turn", 400.0, 5, "A tighter U-turn: links have a tenth of the longest rod to spare."),
    _short("u-turn", 430.0, 5, "The paper's U-turn and link, with short legs: links pinch the walls."),
    _short("s-bend", 170.0, 6, "Two loose bends to opposite sides."),
    _short("s-bend", 340.0, 6, "Two bends, in which neighbouring links turn to opposite sides."),
    _short("s-bend", 420.0, 5, "Nearly the longest link with a known motion: a quarter below the rod."),
    _short("zigzag", 132.0, 7, "Two loose U-turns to opposite sides."),
    _short("zigzag", 352.0, 8, "Two tight U-turns to opposite sides."),
    _short("u-turn-long", 300.0, 9, "Long legs: half a dozen links more to keep in mind at a U-turn."),
    _short("u-turn-long", 400.0, 9, "The same with a tenth of the longest rod to spare."),
    _short("u-turn-deep", 100.0, 55, "Legs of 3000 px, as the paper's: many short links."),
    _short("u-turn-deep", 200.0, 28, "The same with links of nearly half the longest rod."),
    _short("u-turn-deep", 300.0, 19, "The same with links of two thirds of the longest rod."),
    _short("u-turn-deep", 400.0, 15, "The same with a tenth of the longest rod to spare."),
    _short("u-turn-deep", 435.6, 14, "The same with a hundredth of the longest rod to spare."),
    _papers("fig19", 6, 440.0, "The paper's benchmark."),
    _papers("fig17b", 21, 242.0, "A tight U-turn, then a hall of pillars with many ways."),
    _papers("fig17c", 16, 297.6, "Rounded S-bends and a hall between them."),
    _papers("fig17d", 16, 216.1, "Two cluttered rooms and a crooked crack."),
    _papers("fig17a", 45, 254.0, "The paper's longest: 45 links through four U-turns and a spiral."),
)

LADDER: dict[str, Rung] = {rung.maze: rung for rung in RUNGS}
"""The rungs by the name of their maze, short ones first."""
