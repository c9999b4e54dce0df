"""What `auto` asks which planner, and in which order: first on the potential's way, then on other ways."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from typing import NamedTuple

from planners.kernels.types import FloatArray
from planners.problem import Motion
from planners.query import Query
from planners.rod_bound import RodPath
from planners.routes import routes, signature

__all__ = ["Question", "first_questions", "further_questions"]

MAX_ROUTES = 12
"""Ways round the obstacles that are tried."""


class Question(NamedTuple):
    """Say whom to ask what.

    Parameters
    ----------
    planner : str
        Name of the planner.
    route : int
        0 for the potential's way round the obstacles, otherwise the number of the way.
    query : Query
        What to ask.
    """

    planner: str
    route: int
    query: Query


def first_questions(query: Query, warm_start: Motion | None) -> Iterator[Question]:
    """Yield what to ask on the potential's way.

    The track comes first as its motions take the fewest links and poses, and its failures hardly any time.
    """
    if warm_start is not None:
        yield Question("track", 0, dataclasses.replace(query, warm_start=warm_start))
    yield Question("track", 0, query)
    yield Question("sweep", 0, dataclasses.replace(query, thorough=False))
    yield from _from_refused(query)
    yield Question("beam", 0, query)


def further_questions(query: Query, rod: RodPath | None) -> Iterator[Question]:
    """Yield what to ask on other ways: first a rod's that passes, then the medial axis'; cheap ones first."""
    if query.geometry is None:
        return
    ways = [] if rod is None else [rod.way]
    ways += list(itertools.islice(_other_ways(query), MAX_ROUTES))
    variants = [dataclasses.replace(query, route=way, thorough=False) for way in ways]
    for planner in ("track", "sweep"):
        for number, variant in enumerate(variants, start=1):
            yield Question(planner, number, variant)
    yield Question("sweep", 0, query)
    yield from _from_refused(query)


def _from_refused(query: Query) -> Iterator[Question]:
    """Ask for a track from what the sweep drew and the checker refused: it may lack little."""
    if query.refused:
        yield Question("track", 0, dataclasses.replace(query, warm_start=query.refused[-1]))


def _other_ways(query: Query) -> Iterator[FloatArray]:
    """Yield ways in other homotopy classes than the potential's."""
    assert query.geometry is not None
    own = signature(query.geometry.maze, query.geometry.path.points)
    for way in routes(query.maze, query.arm.link_length, link_radius=query.arm.link_radius):
        if way.signature != own:
            yield way.points
