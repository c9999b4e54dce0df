"""The spatial planners in one run: paired panels, random rooms, growth, thick arms, and other sizes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.arm import ArmSpec
from planners.bench.pool import Tell, bar, over_processes, worker_pool
from planners.bench.records import run_parts
from planners.bench.spatial_growth import growth_with_links, growth_with_way
from planners.bench.spatial_trials import (
    FOLLOW,
    farthest_with_horizon,
    longest_in_panels,
    longest_in_room,
    longest_row,
    try_arm,
    try_links,
    warm_up_spatial,
)
from planners.spatial.planning import PLANNERS
from planners.spatial.potential import laplace_potential
from planners.spatial.rooms import paired_panels, random_room

__all__ = ["FULL", "PARTS", "QUICK", "SpatialSizes", "compared", "rooms_with_a_way", "run_spatial"]

PARTS = ("figures", "growth", "radius", "horizon", "rooms", "workspaces")
"""What can be measured, in the order in which it is."""

PAPER_LENGTHS = (8.0, 30.0, 90.0)
"""Link lengths of the paper's Figs. 20 to 22: 182 of 8 and 49 of 30 follow the path, 15 of 90 collide."""

IN_ORDER = (FOLLOW, *(planner for planner in PLANNERS if planner != FOLLOW))
"""All planners, with the one that others are compared with first."""

LENGTH = 90.0
"""Link length for arms with a radius or a joint limit, in workspace units."""


@dataclass(frozen=True, kw_only=True)
class SpatialSizes:
    """Say how much is measured.

    Parameters
    ----------
    planners : tuple of str
        Keys of `planners.spatial.PLANNERS`; `follow` is what the others are compared with.
    runs : int
        Timed runs of each plan.
    accuracy : float
        Of longest links, as a share of the length.
    rooms : int
        Random rooms with a way.
    lengths : tuple of float
        Link lengths for the growth with links, in workspace units.
    copies : tuple of int
        Copies of a pattern of bends for the growth with the way.
    radii : tuple of float
        Of links, in workspace units.
    limits : tuple of float
        Of joints, in degrees.
    horizons : tuple of float
        Of the causal planner, in links.
    panels : tuple of (gap, window, thickness)
        Sizes of the paired panels, in workspace units.
    """

    planners: tuple[str, ...]
    runs: int
    accuracy: float
    rooms: int
    lengths: tuple[float, ...]
    copies: tuple[int, ...]
    radii: tuple[float, ...]
    limits: tuple[float, ...]
    horizons: tuple[float, ...]
    panels: tuple[tuple[float, float, float], ...]


FULL = SpatialSizes(
    planners=IN_ORDER,
    runs=5,
    accuracy=0.005,
    rooms=20,
    lengths=(90.0, 45.0, 22.5, 11.25, 5.625),
    copies=(1, 2, 4, 8),
    radii=(0.3, 1.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0),
    limits=(98.0, 95.0, 90.0),
    horizons=(0.5, 1.0, 1.5, 2.0, 3.0),
    panels=(
        *((gap, window, 20.0) for gap, window in ((40.0, 40.0), (40.0, 60.0), (50.0, 50.0), (50.0, 60.0))),
        *((gap, window, 20.0) for gap, window in ((60.0, 60.0), (60.0, 80.0), (80.0, 80.0))),
        (50.0, 60.0, 5.0),
        (50.0, 60.0, 1.0),
    ),
)
"""Half an hour on two cores."""

QUICK = SpatialSizes(
    planners=IN_ORDER,
    runs=1,
    accuracy=0.03,
    rooms=1,
    lengths=(90.0, 45.0, 22.5),
    copies=(1, 2, 4),
    radii=(0.3, 4.0),
    limits=(90.0,),
    horizons=(1.0,),
    panels=((60.0, 60.0, 20.0),),
)
"""Two minutes on two cores."""


def run_spatial(
    sizes: SpatialSizes, *, parts: tuple[str, ...] = PARTS, workers: int | None = None, quiet: bool = False
) -> dict[str, Any]:
    """Measure, with a bar for each part.

    Parameters
    ----------
    sizes : SpatialSizes
        How much.
    parts : tuple of str
        Some of `PARTS`.
    workers : int, optional
        Processes at a time where nothing is timed, by default one for each processor; 0 for none but this.
    quiet : bool
        Show no bars.

    Returns
    -------
    results : dict
        Plain data by part.

    Raises
    ------
    InputError
        If there is no such part.
    """

    def measure(part: str, count: int) -> Any:
        with bar(part, _total(part, sizes), quiet) as tell:
            return _measure(part, sizes, count, tell)

    return run_parts(parts, PARTS, workers, measure, warm_up_spatial)


def _figure_cases(sizes: SpatialSizes) -> list[tuple[str, float]]:
    """Return planners and link lengths: all of the paper's for path following, the longest for the others."""
    follow = [(FOLLOW, length) for length in PAPER_LENGTHS if FOLLOW in sizes.planners]
    return follow + [(planner, PAPER_LENGTHS[-1]) for planner in sizes.planners if planner != FOLLOW]


def _total(part: str, sizes: SpatialSizes) -> int:
    """Say how often a part tells that a piece of work is done."""
    return {
        "figures": len(_figure_cases(sizes)) + len(sizes.planners),
        "rooms": len(sizes.planners) * sizes.rooms,
        "growth": sizes.runs * (len(sizes.lengths) + len(sizes.copies)),
        "radius": len(_arms(sizes)),
        "horizon": len(sizes.horizons),
        "workspaces": len(sizes.planners) * len(sizes.panels),
    }[part]


def _measure(part: str, sizes: SpatialSizes, workers: int, tell: Tell) -> Any:
    match part:
        case "figures":
            return _figures(sizes, tell)
        case "rooms":
            return _rooms(sizes, workers, tell)
        case "growth":
            return {
                "links": growth_with_links(sizes.lengths, sizes.runs, tell),
                "way": growth_with_way(sizes.copies, sizes.runs, tell),
            }
        case "radius":
            rows = []
            for arm in _arms(sizes):
                rows.append(try_arm(paired_panels(), arm))
                tell()
            return rows
        case "horizon":
            return _in_order(farthest_with_horizon, [(horizon,) for horizon in sizes.horizons], workers, tell)
        case _:
            tasks = [
                (*panels, planner, sizes.accuracy) for panels in sizes.panels for planner in sizes.planners
            ]
            return _in_order(longest_in_panels, tasks, workers, tell)


def _figures(sizes: SpatialSizes, tell: Tell) -> list[dict[str, Any]]:
    workspace, rows = paired_panels(), []
    for planner, length in _figure_cases(sizes):
        rows.append({"longest": False, **try_links(workspace, planner, length, sizes.runs)})
        tell()
    for planner in sizes.planners:
        found = longest_row(workspace, planner, sizes.accuracy)
        if found["length"] > 0.0:
            row = try_links(workspace, planner, found["length"], sizes.runs)
            rows.append({"longest": True, "tried": found["tried"], "search_s": found["seconds"], **row})
        tell()
    return rows


def rooms_with_a_way(n_rooms: int) -> tuple[list[int], list[int]]:
    """Return the first seeds of random rooms that have a way for a point, and those before without one."""
    found: list[int] = []
    without: list[int] = []
    for seed in itertools.count():
        if len(found) == n_rooms:
            break
        (without if laplace_potential(random_room(seed)) is None else found).append(seed)
    return found, without


def _rooms(sizes: SpatialSizes, workers: int, tell: Tell) -> dict[str, Any]:
    seeds, without = rooms_with_a_way(sizes.rooms)
    tasks = [(f"random-{seed}", planner, sizes.accuracy) for seed in seeds for planner in sizes.planners]
    rows = _in_order(longest_in_room, tasks, workers, tell)
    return {
        "seeds": seeds,
        "without_way": without,
        "rows": rows,
        "compared": [compared(rows, planner) for planner in sizes.planners if planner != FOLLOW],
    }


def compared(rows: Sequence[dict[str, Any]], planner: str) -> dict[str, Any]:
    """Compare the longest links of a planner with those that follow the path, room by room.

    Rooms count if both have a longest link whose motion the exact checker has passed.
    """
    longest = {(row["room"], row["planner"]): row for row in rows if row["valid"]}
    rooms = list(dict.fromkeys(row["room"] for row in rows))
    both = [room for room in rooms if {(room, planner), (room, FOLLOW)} <= set(longest)]
    pairs = [(longest[room, planner], longest[room, FOLLOW]) for room in both]
    ratios = [mine["length"] / others["length"] for mine, others in pairs]
    links = [mine["n_links"] / others["n_links"] for mine, others in pairs]
    some = bool(pairs)
    return {
        "planner": planner,
        "rooms": len(rooms),
        "compared": len(both),
        "alone": sum((room, planner) in longest and (room, FOLLOW) not in longest for room in rooms),
        "followed_alone": sum((room, FOLLOW) in longest and (room, planner) not in longest for room in rooms),
        "longer": sum(ratio > 1.0 for ratio in ratios),
        "mean": float(np.mean(ratios)) if some else None,
        "median": float(np.median(ratios)) if some else None,
        "least": min(ratios, default=None),
        "largest": max(ratios, default=None),
        "mean_links": float(np.mean(links)) if some else None,
    }


def _arms(sizes: SpatialSizes) -> list[ArmSpec]:
    thick = [ArmSpec(link_length=LENGTH, link_radius=radius) for radius in sizes.radii]
    return thick + [ArmSpec(link_length=LENGTH, joint_limit=math.radians(limit)) for limit in sizes.limits]


def _in_order(
    function: Callable[..., dict[str, Any]], tasks: Sequence[tuple[Any, ...]], workers: int, tell: Tell
) -> list[dict[str, Any]]:
    """Do tasks over processes (0: in this one); rows are in the order of the tasks."""
    if workers == 0:
        return list(_one_by_one(function, tasks, tell))
    with worker_pool(min(workers, max(len(tasks), 1)), warm_up_spatial) as pool:
        done = {tuple(row["task"]): row for row in over_processes(pool, function, tasks, tell)}
    return [done[task] for task in tasks]


def _one_by_one(
    function: Callable[..., dict[str, Any]], tasks: Sequence[tuple[Any, ...]], tell: Tell
) -> Iterator[dict[str, Any]]:
    for task in tasks:
        yield function(*task)
        tell()
