"""The benchmark of speed and scale, in one run: only what is measured side by side compares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from planners.baselines.ompl_sampling import is_installed
from planners.bench.beside import beside_ompl, ompl_tasks
from planners.bench.many import ROUNDS, random_mazes
from planners.bench.pool import bar
from planners.bench.records import run_parts
from planners.bench.single import PLANNERS, first_calls, growth_with_links, growth_with_way, memory, stages

__all__ = ["FULL", "PARTS", "QUICK", "Sizes", "run_speed"]

PARTS = ("stages", "links", "way", "memory", "first call", "random mazes", "ompl")
"""What can be measured, in the order in which it is."""


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Say how much is measured.

    Parameters
    ----------
    runs : int
        Of each measurement, after one that warms up.
    stage_lengths : tuple of float
        Link lengths in `fig17a` whose stages are timed, in px.
    link_lengths : tuple of float
        Those for the growth with links.
    turns : tuple of int
        Of the serpentines for the growth with the way; the last one's memory is measured.
    fresh : int
        Fresh processes for the first call.
    seeds : int
        Of the random mazes: as many halls, and as many corridors.
    compared : int
        Random mazes for the comparison of one worker and all.
    ompl_turns, ompl_indices : tuple
        U-turns and tightness of the mazes beside OMPL.
    ompl_seeds : int
        Runs of each planner in each.
    ompl_seconds : float
        That each may take.
    """

    runs: int
    stage_lengths: tuple[float, ...]
    link_lengths: tuple[float, ...]
    turns: tuple[int, ...]
    fresh: int
    seeds: int
    compared: int
    ompl_turns: tuple[int, ...]
    ompl_indices: tuple[float, ...]
    ompl_seeds: int
    ompl_seconds: float


FULL = Sizes(
    runs=9,
    stage_lengths=(245.0, 251.0),
    link_lengths=(245.0, 122.5, 61.25, 30.625),
    turns=(1, 3, 7, 15),
    fresh=5,
    seeds=100,
    compared=60,
    ompl_turns=(1, 2, 3),
    ompl_indices=(0.25, 0.5, 0.9),
    ompl_seeds=3,
    ompl_seconds=10.0,
)
"""Under ten minutes on two cores."""

QUICK = Sizes(
    runs=3,
    stage_lengths=(245.0, 251.0),
    link_lengths=(245.0, 122.5, 61.25),
    turns=(1, 3, 7),
    fresh=2,
    seeds=10,
    compared=10,
    ompl_turns=(1, 2),
    ompl_indices=(0.5, 0.9),
    ompl_seeds=1,
    ompl_seconds=2.0,
)
"""Under a minute on two cores."""


def run_speed(
    sizes: Sizes, *, parts: tuple[str, ...] = PARTS, workers: int | None = None, quiet: bool = False
) -> dict[str, Any]:
    """Measure, with a bar for each part.

    Parameters
    ----------
    sizes : Sizes
        How much.
    parts : tuple of str
        Some of `PARTS`.
    workers : int, optional
        Processes at a time, by default one for each processor.
    quiet : bool
        Show no bars.

    Returns
    -------
    results : dict
        Plain data by part; that of `ompl` is None if OMPL is not installed.

    Raises
    ------
    InputError
        If there is no such part.
    """
    return run_parts(parts, PARTS, workers, lambda part, count: _measure(part, sizes, count, quiet))


def _measure(part: str, sizes: Sizes, workers: int, quiet: bool) -> Any:
    runs, timed = sizes.runs, sizes.runs * len(PLANNERS)
    match part:
        case "stages":
            with bar(part, timed * len(sizes.stage_lengths), quiet) as tell:
                return stages(sizes.stage_lengths, runs, tell)
        case "links":
            with bar(part, timed * len(sizes.link_lengths), quiet) as tell:
                return growth_with_links(sizes.link_lengths, runs, tell)
        case "way":
            with bar(part, timed * len(sizes.turns), quiet) as tell:
                return growth_with_way(sizes.turns, runs, tell)
        case "memory":
            with bar(part, 2, quiet) as tell:
                return memory(sizes.turns[-1], tell)
        case "first call":
            with bar(part, sizes.fresh, quiet) as tell:
                return first_calls(sizes.fresh, tell)
        case "random mazes":
            with bar(part, 2 * (sizes.seeds + ROUNDS * sizes.compared), quiet) as tell:
                return random_mazes(range(sizes.seeds), workers, sizes.compared, tell)
        case _:
            return _beside(sizes, workers, quiet)


def _beside(sizes: Sizes, workers: int, quiet: bool) -> dict[str, Any] | None:
    if not is_installed():
        return None
    seeds = range(1, sizes.ompl_seeds + 1)
    tasks = ompl_tasks(sizes.ompl_turns, sizes.ompl_indices, seeds, sizes.ompl_seconds)
    with bar("ompl", len(tasks), quiet) as tell:
        return {"seconds": sizes.ompl_seconds, "rows": beside_ompl(tasks, workers, tell)}
