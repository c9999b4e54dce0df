"""The benchmark of the environment: how fast it steps and resets, beside others, and how exact it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from planners.bench.environment_episodes import episodes, resets
from planners.bench.environment_peers import HOLDS, SUBSTEPS, beside_peers, peers_python
from planners.bench.environment_random import (
    EVERY_MAZE,
    random_policies,
    random_steps,
    random_tasks,
    summed_up,
)
from planners.bench.environment_vector import vector
from planners.bench.environment_where import where
from planners.bench.pool import bar
from planners.bench.records import check_parts, run_parts

__all__ = ["FULL", "PARTS", "PEERS_FOLDER", "QUICK", "EnvironmentSizes", "run_environment"]

PARTS = ("peers", "where", "resets", "planner", "vector", "random")
"""What can be measured, in the order in which it is."""

PEERS_FOLDER = Path("benchmarks/.peers")
"""Where the peers are installed, once, below the working folder."""

Keep = Callable[[dict[str, Any]], None]
"""Called with all results so far, when a part is done."""


@dataclass(frozen=True, kw_only=True)
class EnvironmentSizes:
    """Say how much is measured.

    Parameters
    ----------
    window : float
        Seconds for which each contender steps in each round.
    rounds : int
        Rounds, in which all take turns.
    links : tuple of int
        Arms whose steps are taken apart.
    where_rounds, where_steps : int
        How often steps are taken apart, and how many; many short rounds, of which one is hardly disturbed.
    mazes : tuple of str
        Keys of `PAPER_LINK_LENGTHS`, for planned episodes.
    runs : int
        Timed episodes of each.
    n_envs : int
        Environments in a vector.
    random_mazes : tuple of str
        For random policies.
    random_steps : int
        Of all random policies.
    """

    window: float
    rounds: int
    links: tuple[int, ...]
    where_rounds: int
    where_steps: int
    mazes: tuple[str, ...]
    runs: int
    n_envs: int
    random_mazes: tuple[str, ...]
    random_steps: int


FULL = EnvironmentSizes(
    window=1.0,
    rounds=9,
    links=(12, 45),
    where_rounds=40,
    where_steps=1000,
    mazes=("fig19", "fig17a"),
    runs=5,
    n_envs=8,
    random_mazes=EVERY_MAZE,
    random_steps=1_000_000,
)
"""Under ten minutes on two cores."""

QUICK = EnvironmentSizes(
    window=0.1,
    rounds=3,
    links=(12, 45),
    where_rounds=5,
    where_steps=500,
    mazes=("fig19",),
    runs=1,
    n_envs=4,
    random_mazes=("straight", "u-turn-i50", "fig19", "random"),
    random_steps=4_000,
)
"""Under half a minute."""


def run_environment(
    sizes: EnvironmentSizes,
    *,
    parts: tuple[str, ...] = PARTS,
    peers: Path | None = None,
    rows: Path | None = None,
    keep: Keep = lambda results: None,
    workers: int | None = None,
    quiet: bool = False,
) -> dict[str, Any]:
    """Measure, with a bar for each part; Ctrl-C ends it with the parts that are done.

    Parameters
    ----------
    sizes : EnvironmentSizes
        How much.
    parts : tuple of str
        Some of `PARTS`.
    peers : Path, optional
        A Python that has the peers; by default one is made in `PEERS_FOLDER`.
    rows : Path, optional
        File of lines from which random policies go on.
    keep : callable
        Called with all results so far, when a part is done.
    workers : int, optional
        Processes at a time for random policies that have a file of lines, by default one for each processor.
    quiet : bool
        Show no bars.

    Returns
    -------
    results : dict
        Plain data by part; with `stopped`, the part that Ctrl-C has ended, if one was.

    Raises
    ------
    InputError
        If there is no such part, or the peers cannot be had.
    """
    check_parts(parts, PARTS)
    results = run_parts((), PARTS, workers, lambda part, count: None)
    for part in (part for part in PARTS if part in parts):
        try:
            done = run_parts(
                (part,), PARTS, workers, lambda name, count: _measure(name, sizes, peers, rows, count, quiet)
            )
        except KeyboardInterrupt:
            results["stopped"] = part
            break
        seconds = results["seconds"] + done["seconds"]
        results |= {part: done[part], "seconds": seconds, "load_at_end": done["load_at_end"]}
        keep(results)
    return results


def _measure(
    part: str, sizes: EnvironmentSizes, peers: Path | None, rows: Path | None, workers: int, quiet: bool
) -> Any:
    window, rounds = sizes.window, sizes.rounds
    match part:
        case "peers":
            python = peers_python(PEERS_FOLDER) if peers is None else peers
            with bar(part, len(HOLDS) * rounds, quiet) as tell:
                return [beside_peers(python, window, rounds, tell, hold=hold) for hold in HOLDS]
        case "where":
            with bar(part, len(sizes.links) * (sizes.where_rounds + 1), quiet) as tell:
                return where(sizes.links, sizes.where_steps, sizes.where_rounds, tell)
        case "resets":
            with bar(part, rounds, quiet) as tell:
                return resets(window, rounds, tell)
        case "planner":
            with bar(part, len(sizes.mazes) * len(SUBSTEPS) * (sizes.runs + 1), quiet) as tell:
                return episodes(sizes.mazes, sizes.runs, tell)
        case "vector":
            with bar(part, rounds, quiet) as tell:
                return vector(sizes.n_envs, window, rounds, tell)
        case _:
            return _random(sizes, rows, workers, quiet)


def _random(sizes: EnvironmentSizes, rows: Path | None, workers: int, quiet: bool) -> dict[str, Any]:
    tasks = random_tasks(sizes.random_steps, sizes.random_mazes)
    if rows is not None:
        return summed_up(random_policies(tasks, rows, workers), len(tasks))
    done = []
    with bar("random", len(tasks), quiet) as tell:
        for task in tasks:
            done.append(random_steps(*task))
            tell()
    return summed_up(done, len(tasks))
