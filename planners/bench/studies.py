"""The studies: which methods are given which tasks, and how much of it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from hrsnake_env.errors import InputError
from hrsnake_env.ladder import LADDER, RODS
from planners.bench.cells import Cell
from planners.bench.methods import METHODS, PLANNING, available, draws
from planners.bench.planned import MOST_LENGTHS
from planners.bench.tasks import (
    Task,
    clutter_task,
    held_out_task,
    leg_task,
    random_task,
    rung_task,
    scan_task,
    shape_task,
)

__all__ = ["STUDIES", "Amount", "Study", "study_cells"]

INDICES = (*(round(0.2 + 0.05 * k, 2) for k in range(16)), 0.98, 0.99)
"""Of the single mazes of the study of the index."""

LEARNT = (0.3, 0.45, 0.6, 0.75, 0.9)
"""Those of them that methods that learn are given."""

FAMILY_INDICES = {
    "random": tuple(round(0.3 + 0.1 * k, 1) for k in range(7)),
    "clutter": tuple(round(0.2 + 0.1 * k, 1) for k in range(8)),
}
"""Of its families of mazes. Random mazes have no other indices."""

N_LINKS = (5, 8, 12, 18, 27, 40, 60, 100)
"""Of the study of the number of links."""

TIGHTNESS = (0.23, 0.68, 0.91)

SCANNED = {"fig19": RODS["u-turn"], "zig3": RODS["u-turn"], "serp": RODS["u-turn"]}
"""Mazes in which the tightest passage is looked for, and their longest rods, in px."""

MOST_LEARNT_LINKS = 8
"""Methods that learn are given tasks of so many links at most, unless tasks are asked for by name."""


@dataclass(frozen=True, kw_only=True)
class Amount:
    """Say how much of a study is done.

    Parameters
    ----------
    budget : float
        Seconds of a planning query.
    train_steps : int
        Of each training.
    mazes : int
        Of each family.
    episodes : int
        That test a policy.
    seeds : tuple of int
        Of methods that draw; the others have the first.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    budget: float
    train_steps: int
    mazes: int = 20
    episodes: int = 100
    seeds: tuple[int, ...] = (0, 1, 2)

    def __post_init__(self) -> None:
        if not (0.0 < self.budget < math.inf):
            raise InputError(f"Expected a positive, finite budget in seconds, got {self.budget:g}.")
        if self.train_steps < 1:
            raise InputError(f"Expected at least one step of training, got {self.train_steps}.")
        if min(self.seeds) < 0:
            raise InputError(f"Expected seeds of at least 0, got {min(self.seeds)}.")


@dataclass(frozen=True, eq=False, kw_only=True)
class Study:
    """Hold a study.

    Parameters
    ----------
    name : str
        Its name.
    methods : tuple of str
        That are compared.
    full, quick : Amount
        How much is done, and how much with `--quick`.
    few : tuple of str
        Patterns of the names of the tasks that `--quick` has.
    """

    name: str
    methods: tuple[str, ...]
    full: Amount
    quick: Amount
    few: tuple[str, ...]

    def tasks(self, mazes: int) -> list[Task]:
        """Return the tasks, with so many mazes in each family."""
        match self.name:
            case "ladder":
                rungs = [rung_task(name) for name in LADDER]
                return [*rungs, *(held_out_task(kind, mazes) for kind in ("random", "random-long"))]
            case "index":
                shapes = [
                    shape_task(shape, index, learnt=index in LEARNT)
                    for shape in ("bend", "u-turn", "s-bend")
                    for index in INDICES
                ]
                families = [random_task(index, mazes) for index in FAMILY_INDICES["random"]]
                # The longest rod of a hall takes a second: half as many halls.
                halls = [clutter_task(index, (mazes + 1) // 2) for index in FAMILY_INDICES["clutter"]]
                return [*shapes, *families, *halls]
            case "links":
                return [leg_task(n_links, index) for index in TIGHTNESS for n_links in N_LINKS]
            case _:
                return [scan_task(maze, rod) for maze, rod in SCANNED.items()]


QUICK = Amount(budget=2.0, train_steps=20_000, mazes=2, episodes=10, seeds=(0,))

STUDIES = {
    study.name: study
    for study in (
        Study(
            name="ladder",
            methods=METHODS,
            full=Amount(budget=30.0, train_steps=300_000),
            quick=QUICK,
            few=("straight", "bend-i60", "u-turn-i60", "random"),
        ),
        Study(
            name="index",
            methods=METHODS,
            full=Amount(budget=10.0, train_steps=300_000),
            quick=QUICK,
            few=("*-i30", "*-i60", "*-i90"),
        ),
        Study(
            name="links",
            methods=PLANNING,
            full=Amount(budget=30.0, train_steps=300_000),
            quick=QUICK,
            few=("*-n5", "*-n12"),
        ),
        Study(
            name="tightest",
            methods=PLANNING,
            full=Amount(budget=10.0, train_steps=300_000),
            quick=QUICK,
            few=("fig19",),
        ),
    )
}
"""All studies by name."""


def study_cells(
    study: str,
    *,
    methods: Sequence[str] = (),
    tasks: Sequence[str] = (),
    seeds: Sequence[int] = (),
    budget: float | None = None,
    train_steps: int | None = None,
    quick: bool = False,
    skip_missing: bool = False,
) -> list[Cell]:
    """Return the cells of a study, task by task, so that all methods at one meet the same machine.

    Parameters
    ----------
    study : str
        A key of `STUDIES`.
    methods, tasks, seeds : sequences, optional
        Instead of the study's own; tasks by name or pattern (`u-turn*`).
    budget : float, optional
        Seconds of a planning query.
    train_steps : int, optional
        Of each training.
    quick : bool
        A sample of the study, in a few minutes.
    skip_missing : bool
        Leave out methods whose package is not installed, instead of refusing.

    Raises
    ------
    InputError
        If there is no such study, method or task, a number is out of its range, or a package is missing.
    """
    if study not in STUDIES:
        raise InputError(f"Unknown study {study!r}. Available: {', '.join(STUDIES)}.")
    chosen = STUDIES[study]
    amount = chosen.quick if quick else chosen.full
    amount = dataclasses.replace(
        amount,
        budget=amount.budget if budget is None else budget,
        train_steps=amount.train_steps if train_steps is None else train_steps,
        seeds=tuple(dict.fromkeys(seeds)) or amount.seeds,
    )
    named = available(methods or chosen.methods, skip_missing)
    patterns = tasks or (chosen.few if quick else ("*",))
    cells = [
        cell
        for task in _chosen(chosen.tasks(amount.mazes), patterns)
        for method in named
        if method in PLANNING or _learnt(task, asked=bool(tasks))
        for cell in _cells(study, task, method, amount)
    ]
    if not cells:
        raise InputError(f"Expected a method that the tasks are for, got {', '.join(named)}.")
    return cells


def _cells(study: str, task: Task, method: str, amount: Amount) -> Iterator[Cell]:
    """Yield a cell for each seed that a method has."""
    if method in PLANNING:
        unit, budget, episodes = "s", amount.budget, MOST_LENGTHS if task.scan else task.n_mazes
    else:
        unit, budget, episodes = "steps", float(amount.train_steps), amount.episodes
    for seed in amount.seeds if draws(method) else amount.seeds[:1]:
        yield Cell(
            study=study,
            method=method,
            task=task,
            seed=seed,
            budget=budget if method != "random" else 0.0,  # nothing is trained
            budget_unit=unit,
            episodes=episodes,
        )


def _chosen(tasks: Sequence[Task], patterns: Iterable[str]) -> list[Task]:
    """Return the tasks that a pattern names, in their own order."""
    kept: set[str] = set()
    for pattern in patterns:
        matching = {task.name for task in tasks if fnmatchcase(task.name, pattern)}
        if not matching:
            raise InputError(f"Unknown task {pattern!r}. Available: {', '.join(t.name for t in tasks)}.")
        kept |= matching
    return [task for task in tasks if task.name in kept]


def _learnt(task: Task, *, asked: bool) -> bool:
    """Tell whether methods that learn are given a task."""
    return task.env_id is not None and (asked or (task.n_links or 0) <= MOST_LEARNT_LINKS)
