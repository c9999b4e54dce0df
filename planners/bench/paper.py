"""The paper's results, each measured in one run: its sections 4 and 5, and what each rule does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hrsnake_env.mazes import LEGS, PAPER_LINK_LENGTHS
from planners.bench.paper_scans import (
    FAMILY_PLANNERS,
    INDEX_PLANNERS,
    VARIANTS,
    families,
    index_over_lengths,
    rules_compared,
)
from planners.bench.paper_speed import (
    PLANNERS,
    growth_with_arm,
    pose_figures,
    time_plans_of_serpentines,
    workspaces,
)
from planners.bench.paper_trials import RULES, warm_up_trials
from planners.bench.pool import Tell, bar
from planners.bench.records import run_parts

__all__ = ["FULL", "PARTS", "QUICK", "PaperSizes", "run_paper"]

PARTS = ("workspaces", "poses", "links", "index", "families", "rules")
"""What can be measured, in the order in which it is."""

INDEX_LENGTHS = (441.0, 150.0)
"""Longest and shortest link in px for the index; the longest rod is 440."""


@dataclass(frozen=True, kw_only=True)
class PaperSizes:
    """Say how much is measured.

    Parameters
    ----------
    workspaces : tuple of str
        Keys of `PAPER_LINK_LENGTHS`.
    runs : int
        Timed runs of a plan.
    repeats : int
        Repetitions of each pose's time.
    links : tuple of int
        Links out at which the time of a pose is looked at.
    turns : tuple of int
        Of the serpentines; the last one's is the way of the arm that grows.
    index_step : float
        Step of link lengths in px.
    shown : tuple of float
        Link lengths in px whose depths are shown.
    families : tuple of str
        Keys of `LEGS`.
    family_step, family_coarse : float
        Steps of link lengths, in longest rods: down to the first that passes, and of the shorter ones.
    variants : tuple of str
        Keys of `VARIANTS`.
    rule_lengths : tuple of float
        Link lengths on the benchmark, in px.
    rule_mazes : tuple of str
        Further mazes.
    rule_shares : tuple of float
        Link lengths there, in longest rods, or in `PAPER_LINK_LENGTHS`.
    """

    workspaces: tuple[str, ...]
    runs: int
    repeats: int
    links: tuple[int, ...]
    turns: tuple[int, ...]
    index_step: float
    shown: tuple[float, ...]
    families: tuple[str, ...]
    family_step: float
    family_coarse: float
    variants: tuple[str, ...]
    rule_lengths: tuple[float, ...]
    rule_mazes: tuple[str, ...]
    rule_shares: tuple[float, ...]

    @property
    def index_lengths(self) -> tuple[float, ...]:
        """Link lengths for the index, in px, from the longest down."""
        longest, shortest = INDEX_LENGTHS
        return tuple(np.round(np.arange(longest, shortest - 1e-9, -self.index_step), 6).tolist())


FULL = PaperSizes(
    workspaces=tuple(PAPER_LINK_LENGTHS),
    runs=9,
    repeats=5,
    links=(11, 22, 45, 90, 180),
    turns=(1, 3, 7, 15, 31),
    index_step=0.5,
    shown=(150.0, 157.0, 200.0, 250.0, 300.0, 350.0, 400.0, 430.0, 436.0, 439.0, 439.5),
    families=tuple(LEGS),
    family_step=0.01,
    family_coarse=0.05,
    variants=tuple(VARIANTS),
    rule_lengths=(150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 430.0, 436.0, 439.0),
    rule_mazes=(*LEGS, "fig17b", "fig17c", "fig17d"),
    rule_shares=(0.3, 0.45, 0.6, 0.75, 0.9),
)
"""Some ten minutes on two cores."""

QUICK = PaperSizes(
    workspaces=("fig19", "fig17a"),
    runs=3,
    repeats=2,
    links=(11, 22, 45),
    turns=(1, 3, 7),
    index_step=20.0,
    shown=(150.0, 300.0, 430.0, 439.0),
    families=("L", "U40", "S1000"),
    family_step=0.05,
    family_coarse=0.2,
    variants=tuple(name for name in VARIANTS if "softening" not in name),
    rule_lengths=(300.0, 430.0),
    rule_mazes=("L", "U200", "S1000", "fig17c"),
    rule_shares=(0.6, 0.9),
)
"""Under a minute on two cores."""


def run_paper(
    sizes: PaperSizes, *, parts: tuple[str, ...] = PARTS, workers: int | None = None, quiet: bool = False
) -> dict[str, Any]:
    """Measure, with a bar for each part.

    Parameters
    ----------
    sizes : PaperSizes
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

    return run_parts(parts, PARTS, workers, measure, warm_up_trials)


def _total(part: str, sizes: PaperSizes) -> int:
    """Say how often a part tells that a piece of work is done."""
    shown = sum(length not in sizes.index_lengths for length in sizes.shown)
    return {
        "workspaces": len(sizes.workspaces) * len(PLANNERS),
        "poses": len(RULES),
        "links": len(RULES) + sizes.runs * len(sizes.turns),
        "index": len(INDEX_PLANNERS) * len(sizes.index_lengths) + len(FAMILY_PLANNERS) * shown,
        "families": len(sizes.families) * len(FAMILY_PLANNERS),
        "rules": len(sizes.variants)
        * (len(sizes.rule_lengths) + len(sizes.rule_mazes) * len(sizes.rule_shares)),
    }[part]


def _measure(part: str, sizes: PaperSizes, workers: int, tell: Tell) -> Any:
    match part:
        case "workspaces":
            return workspaces(sizes.workspaces, sizes.runs, tell)
        case "poses":
            return _poses(sizes, tell)
        case "links":
            return {
                "arm": [growth_with_arm(sizes.turns[-1], sizes.links, planner, tell) for planner in RULES],
                "auto": time_plans_of_serpentines(sizes.turns, sizes.runs, tell),
            }
        case "index":
            return index_over_lengths(sizes.index_lengths, sizes.shown, workers, tell)
        case "families":
            return families(sizes.families, sizes.family_step, sizes.family_coarse, workers, tell)
        case _:
            return rules_compared(
                sizes.variants, sizes.rule_lengths, sizes.rule_mazes, sizes.rule_shares, workers, tell
            )


def _poses(sizes: PaperSizes, tell: Tell) -> list[dict[str, Any]]:
    rows = []
    for planner in RULES:
        rows.append(pose_figures("fig17a", PAPER_LINK_LENGTHS["fig17a"], planner, sizes.repeats))
        tell()
    return rows
