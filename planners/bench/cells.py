"""A cell of a study: one method at one task from one seed, and the rows that come of it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from planners.bench.rows import whole_row
from planners.bench.tasks import Problem, Task, fewest_links

__all__ = ["EVERY_ACTIONS", "Cell", "CellResult", "Run", "error_rows", "row_of"]

EVERY_ACTIONS = ("mean", "sampled")
"""How a trained policy acts when it is tested."""

PATIENCE = 10.0
"""A planning query may take so many times its budget, and `GRACE`, before its worker is ended."""

GRACE = 300.0
"""In s; compiling all kernels takes under that on a slow machine."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Cell:
    """Describe a piece of work that is done as a whole or not at all.

    Parameters
    ----------
    study, method : str
        Names.
    task : Task
        What is to be done.
    seed : int
        Of the method's random numbers; not negative.
    budget : float
        Of one planning query in s, or of a training in steps.
    budget_unit : {"s", "steps"}
        Which of these.
    episodes : int
        Mazes of a planner, at most so many lengths of a scan, or episodes of a test of a policy.
    """

    study: str
    method: str
    task: Task
    seed: int
    budget: float
    budget_unit: str
    episodes: int

    @property
    def key(self) -> str:
        """A file name: the same for the same work in every process, and another for other work."""
        parts = (self.study, self.method, self.task.definition, self.seed, self.budget, self.budget_unit)
        digest = hashlib.sha256(repr((*parts, self.episodes)).encode()).hexdigest()[:12]
        readable = re.sub(r"[^A-Za-z0-9_-]", "_", f"{self.method}_{self.task.name}_s{self.seed}")
        return f"{readable}_{digest}"

    @property
    def identity(self) -> tuple[str, str, str, int]:
        """What the cell is about, whatever its budget: study, task, method, seed."""
        return self.study, self.task.name, self.method, self.seed

    @property
    def most_seconds(self) -> float | None:
        """Planning time that the cell takes at most if planners keep their budget; None for learners."""
        return self.budget * self.episodes if self.budget_unit == "s" else None

    @property
    def patience(self) -> float | None:
        """Seconds after which the worker hangs; None if there is no telling."""
        return None if self.most_seconds is None else PATIENCE * self.most_seconds + GRACE


@dataclass(frozen=True, eq=False, kw_only=True)
class CellResult:
    """Hold the rows of a cell, and files by the ending of their name."""

    rows: list[dict[str, Any]]
    files: Mapping[str, bytes] = field(default_factory=dict)


Run = Callable[[Cell], CellResult]
"""Does a cell; a function of a module, so that other processes find it."""


def row_of(cell: Cell, problem: Problem | None, episode: int, **facts: Any) -> dict[str, Any]:
    """Return a row of a cell, in which facts are what was measured.

    Without a problem, as when its maze cannot be built, its columns are 0.
    """
    made: dict[str, Any] = {"maze": "", "link_length": 0.0, "longest_rod": 0.0, "index": 0.0, "n_links": 0}
    if problem is not None:
        made = {
            "maze": problem.maze.name,
            "link_length": problem.link_length,
            "longest_rod": problem.longest_rod,
            "index": problem.index,
            "n_links": facts["n_links"] if "n_links" in facts else fewest_links(cell.task, problem),
        }
    return whole_row(
        {
            "study": cell.study,
            "method": cell.method,
            "task": cell.task.name,
            "shape": cell.task.shape,
            "seed": cell.seed,
            "episode": episode,
            "budget": cell.budget,
            "budget_unit": cell.budget_unit,
            **made,
            **facts,
        }
    )


def error_rows(cell: Cell, error: BaseException | str) -> list[dict[str, Any]]:
    """Return what stands for the cell where nothing could be measured: a row for each way to act."""
    text = error if isinstance(error, str) else f"{type(error).__name__}: {error}"
    status = f"error: {' '.join(text.split())}"
    ways = ("planned",) if cell.budget_unit == "s" else EVERY_ACTIONS
    return [row_of(cell, None, 0, actions=way, status=status, reason=status) for way in ways]
