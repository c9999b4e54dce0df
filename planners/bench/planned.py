"""Cells of planners: a planning query for each maze of a task, or a scan of link lengths."""

from __future__ import annotations

import contextlib
import functools
import time
from collections.abc import Iterator
from typing import Any

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.bench.cells import Cell, CellResult, row_of
from planners.bench.episodes import motion_facts
from planners.bench.tasks import Problem, fewest_links
from planners.planning import plan

__all__ = ["MOST_LENGTHS", "run_planner"]

SCAN = tuple(round(0.06 + 0.02 * k, 2) for k in range(48))
"""Indices that a scan tries, up to 1."""

FINEST = 0.002
"""To this a scan halves the step between the largest index that was solved and the next one."""

HALVINGS = 4

MOST_LENGTHS = len(SCAN) + HALVINGS

WARM_UP = (("bend-i60", 340.0), ("fig19", 430.0))
"""What every worker plans once with a method before its first cell, uncounted: kernels are compiled."""

WARM_UP_BUDGET = 5.0


def run_planner(cell: Cell) -> CellResult:
    """Do a cell of a planner; a maze in which it fails with an error has a row that says so."""
    warm_up(cell.method)
    rows = _scan(cell) if cell.task.scan else (_guarded(cell, k, k) for k in range(cell.episodes))
    return CellResult(rows=list(rows))


@functools.cache
def warm_up(method: str) -> None:
    """Have all compiled that a method needs, in this process."""
    for name, length in WARM_UP:
        with contextlib.suppress(InputError):
            plan(
                Maze.load(name),
                ArmSpec(link_length=length),
                method,
                time_budget=WARM_UP_BUDGET,
                explain=False,
            )


def _scan(cell: Cell) -> Iterator[dict[str, Any]]:
    # All of them: some methods fail with middling links and pass with long ones.
    solved, number = None, 0
    for index in SCAN:
        row = _guarded(cell, index, number)
        yield row
        number += 1
        solved = index if row["solved"] else solved
    if solved is None or solved == SCAN[-1]:
        return
    low, high = solved, SCAN[SCAN.index(solved) + 1]
    while high - low > FINEST:
        middle = 0.5 * (low + high)
        row = _guarded(cell, middle, number)
        yield row
        number += 1
        low, high = (middle, high) if row["solved"] else (low, middle)


def _guarded(cell: Cell, which: float, episode: int) -> dict[str, Any]:
    """Plan once; any error is a row."""
    problem = None
    try:
        problem = cell.task.problem(which)
        return _attempt(cell, problem, episode)
    except Exception as error:
        status = f"error: {type(error).__name__}: {' '.join(str(error).split())}"
        n_links = cell.task.n_links or 0
        return row_of(cell, problem, episode, n_links=n_links, status=status, reason=status)


def _attempt(cell: Cell, problem: Problem, episode: int) -> dict[str, Any]:
    arm = ArmSpec(link_length=problem.link_length)
    start, cpu_start = time.perf_counter(), time.process_time()
    result = plan(problem.maze, arm, cell.method, time_budget=cell.budget, seed=cell.seed, explain=False)
    seconds, cpu_seconds = time.perf_counter() - start, time.process_time() - cpu_start
    motion, report = result.motion, result.report
    facts: dict[str, Any] = {}
    if motion is not None and cell.task.simulate:
        facts = motion_facts(motion, problem)
    elif report is not None:  # the exact check's bound, of what a link sweeps between poses too
        facts = {"worst_depth": max(report.penetration, report.penetration_between) / problem.link_length}
    return row_of(
        cell,
        problem,
        episode,
        n_links=fewest_links(cell.task, problem) if motion is None else motion.n_links,
        status=str(result.status),
        reason=result.reason,
        solved=result.solved,
        seconds=seconds,
        cpu_seconds=cpu_seconds,
        check_seconds=float(result.timings.get("validate", 0.0)),
        **facts,
    )
