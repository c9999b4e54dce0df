"""The methods that studies compare: what there is, what is installed, and how a cell of each is done."""

from __future__ import annotations

import importlib.util
from collections.abc import Sequence

from hrsnake_env.errors import InputError
from planners.bench.cells import Cell, CellResult, error_rows
from planners.bench.learners import LEARNERS, run_learner, run_random
from planners.bench.planned import run_planner
from planners.planning import PLANNERS

__all__ = ["METHODS", "PLANNING", "POLICIES", "available", "draws", "run_cell"]

PLANNING = ("auto", *PLANNERS)
"""Methods that plan."""

POLICIES = ("random", *LEARNERS)
"""Methods that act by what they observe."""

METHODS = (*PLANNING, *POLICIES)

SAMPLING = ("rrt-connect", "aorrtc")
"""Planners that draw random numbers; for the others one seed says it all."""

NEEDED = {
    **dict.fromkeys(SAMPLING, ("ompl", "bench")),
    **dict.fromkeys(LEARNERS, ("stable_baselines3", "rl")),
    "tqc": ("sb3_contrib", "rl"),
    "tqc-her": ("sb3_contrib", "rl"),
    **dict.fromkeys(("clone", "dagger"), ("torch", "rl")),
}
"""The package that a method needs, and the extra that brings it."""


def draws(method: str) -> bool:
    """Tell whether a method's outcome depends on its seed."""
    return method in SAMPLING or method in POLICIES


def available(methods: Sequence[str], skip_missing: bool = False) -> list[str]:
    """Return the methods, without doubles.

    Parameters
    ----------
    methods : sequence of str
        Names.
    skip_missing : bool
        Leave out those whose package is not installed.

    Raises
    ------
    InputError
        If there is no such method, or its package is not installed.
    """
    for method in methods:
        if method not in METHODS:
            raise InputError(f"Unknown method {method!r}. Available: {', '.join(METHODS)}.")
    kept = []
    for method in dict.fromkeys(methods):
        package, extra = NEEDED.get(method, ("numpy", ""))
        if importlib.util.find_spec(package) is not None:
            kept.append(method)
        elif not skip_missing:
            raise InputError(
                f"Expected {package} to be installed for the method '{method}': pip install "
                f"'hrsnake[{extra}]', or leave such methods out with --skip-missing."
            )
    return kept


def run_cell(cell: Cell) -> CellResult:
    """Do a cell; any error becomes a row, so that no cell is ever lost."""
    try:
        if cell.method in LEARNERS:
            return run_learner(cell)
        return run_random(cell) if cell.method == "random" else run_planner(cell)
    except Exception as error:
        return CellResult(rows=error_rows(cell, error))
