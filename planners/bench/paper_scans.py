"""Over link lengths: the index (5.1, Eq. 4), the families of turns, and what each rule of section 3 does."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from hrsnake_env.maze import Maze
from hrsnake_env.mazes import LEGS, PAPER_LINK_LENGTHS
from planners.beam_planner import Rules
from planners.bench.paper_trials import maze_of, try_planner, warm_up_trials
from planners.bench.pool import Tell, over_processes, worker_pool
from planners.rod_bound import rod_bound
from planners.survey import Geometry, survey

__all__ = [
    "FAMILY_PLANNERS",
    "INDEX_PLANNERS",
    "LONGEST_ROD",
    "VARIANTS",
    "families",
    "family_rod",
    "index_over_lengths",
    "rules_compared",
    "trials",
]

LONGEST_ROD = 440.0
"""Longest possible link in the paper's benchmark, in px (its section 5.1)."""

INDEX_PLANNERS = ("auto", "sweep", "track", "beam", "as-printed", "follow")
"""Those whose index is measured."""

FAMILY_PLANNERS = ("beam", "as-printed", "follow")
"""Those that are scanned over the families."""

SHORTEST = 0.15
"""Length at which families are given up, in longest rods."""

TURN_ROD = 2.0**1.5 * 200.0
"""Longest rod round one right-angled turn of a corridor 200 wide, in px."""

RODS: dict[str, float] = {name: TURN_ROD for name in LEGS} | {"U40": 440.0, "zig3": 440.0, "serp": 440.0}
"""Longest rod in a family where it is known in closed form, in px: of its tightest turn alone, a right-angled
one or a U-turn round a wall of 40. In `S0` the two bends meet, and a rod passes that is much longer."""
del RODS["S0"]

STEPS: dict[str, dict[str, Any]] = {
    "all rules": {},
    "without the jump rule": {"jump_blocks": False},
    "without the tangent rule": {"tangent_blocks": False},
    "without both": {"jump_blocks": False, "tangent_blocks": False},
    "without semi-critical": {"semi_critical": False},
    "softening degree 1": {"softening_degree": 1},
    "softening degree 8": {"softening_degree": 8},
    "softening degree 20": {"softening_degree": 20},
}
"""What is changed; the default softening degree is 3."""

VARIANTS: dict[str, Rules] = {
    f"{kind}, {name}": Rules(clamp=clamp, **change)
    for kind, clamp in (("as printed", False), ("clamped", True))
    for name, change in STEPS.items()
}
"""The rules by what is changed about them."""


@cache
def _seen(name: str) -> tuple[Maze, Geometry | None]:
    """Load and survey a maze once for each process."""
    maze = maze_of(name)
    return maze, survey(maze)


def try_length(name: str, link_length: float, planner: str, depths: bool = True) -> dict[str, Any]:
    """Try one planner, or variant of the rules, at one length; see `try_planner`."""
    maze, geometry = _seen(name)
    trial = try_planner(maze, link_length, VARIANTS.get(planner, planner), geometry, depths=depths)
    return {
        "task": [name, link_length, planner, depths],
        "maze": name,
        "link_length": link_length,
        "planner": planner,
        **trial.row(),
    }


def trials(
    tasks: Sequence[tuple[str, float, str, bool]], workers: int, tell: Tell = lambda: None
) -> list[dict[str, Any]]:
    """Try many lengths over processes (0: in this one); rows are in the order of the tasks."""
    return _in_order(try_length, tasks, workers, tell)


def _in_order(
    function: Any, tasks: Sequence[tuple[Any, ...]], workers: int, tell: Tell
) -> list[dict[str, Any]]:
    if workers == 0:
        rows = []
        for task in tasks:
            rows.append(function(*task))
            tell()
        return rows
    with worker_pool(workers, warm_up_trials) as pool:
        done = {tuple(row["task"]): row for row in over_processes(pool, function, tasks, tell)}
    return [done[task] for task in tasks]


def index_over_lengths(
    lengths: Sequence[float], shown: Sequence[float], workers: int, tell: Tell = lambda: None
) -> dict[str, Any]:
    """Try every length on the paper's benchmark: none is left out, as single ones may fail.

    Parameters
    ----------
    lengths : sequence of float
        That all planners try, in px.
    shown : sequence of float
        Lengths whose outcomes are kept whole, for the rules as printed and for path following.
    workers : int
        Processes.
    tell : callable
        Called after each try.
    """
    tasks = [("fig19", length, planner, length in shown) for planner in INDEX_PLANNERS for length in lengths]
    tasks += [("fig19", length, planner, True) for planner in FAMILY_PLANNERS for length in shown]
    rows = trials(list(dict.fromkeys(tasks)), workers, tell)
    scanned = set(lengths)
    return {
        "longest_rod": LONGEST_ROD,
        "lengths": [min(lengths), max(lengths), len(lengths)],
        "planners": [
            _summary(planner, [row for row in rows if row["link_length"] in scanned])
            for planner in INDEX_PLANNERS
        ],
        "shown": [
            row for row in rows if row["link_length"] in set(shown) and row["planner"] in FAMILY_PLANNERS
        ],
    }


def _summary(planner: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Say which is the longest length that passes, and which of the shorter ones fail."""
    own = sorted((row for row in rows if row["planner"] == planner), key=lambda row: row["link_length"])
    solved = [row["link_length"] for row in own if row["status"] == "solved"]
    longest = max(solved, default=None)
    shorter = [row for row in own if longest is not None and row["link_length"] < longest]
    failed = [row["link_length"] for row in shorter if row["status"] != "solved"]
    first = min((row["link_length"] for row in own if row["status"] != "solved"), default=np.inf)
    return {
        "planner": planner,
        "longest": longest,
        "index": None if longest is None else longest / LONGEST_ROD,
        "shorter": len(shorter),
        "shorter_failed": failed,
        "all_pass_to": max((length for length in solved if length < first), default=None),
    }


def family_rod(name: str) -> tuple[float, bool]:
    """Return the longest rod in a family in px, and whether it is known in closed form."""
    if name in RODS:
        return RODS[name], True
    return rod_bound(maze_of(name), accuracy=0.005).upper, False


def families(
    names: Sequence[str], step: float, coarse: float, workers: int, tell: Tell = lambda: None
) -> list[dict[str, Any]]:
    """Find the longest link for the rules and for path following in families of turns.

    Parameters
    ----------
    names : sequence of str
        Keys of `LEGS`.
    step : float
        Of lengths from the longest rod's downwards until one passes, in longest rods.
    coarse : float
        Of the shorter lengths that are counted.
    workers : int
        Processes.
    tell : callable
        Called after each planner in each family.
    """
    tasks = [(name, planner, step, coarse) for name in names for planner in FAMILY_PLANNERS]
    return _in_order(scan_family, tasks, workers, tell)


def scan_family(name: str, planner: str, step: float, coarse: float) -> dict[str, Any]:
    """Try lengths from the longest rod's downwards until one passes, then a coarser grid below it."""
    rod, closed = family_rod(name)
    shares = np.round(np.arange(1.0, SHORTEST - 1e-9, -step), 9)
    # Just below the rod's length: at the length itself it is pinched everywhere.
    longest, longer = None, []
    for share in shares:
        longer.append(_outcome(name, share * rod * (1.0 - 1e-9), planner))
        if longer[-1] == "solved":
            longest = share
            break
    grid = np.round(np.arange(1.0, SHORTEST - 1e-9, -coarse), 9)
    shorter = [float(share) for share in grid if longest is not None and share < longest]
    outcomes = [_outcome(name, share * rod, planner) for share in shorter]
    return {
        "task": [name, planner, step, coarse],
        "maze": name,
        "planner": planner,
        "rod": rod,
        "closed_form": closed,
        "longest": None if longest is None else float(longest * rod * (1.0 - 1e-9)),
        "share": None if longest is None else float(longest),
        "longer_not_checked": longer.count("not checked"),
        "shorter": len(shorter),
        "shorter_solved": outcomes.count("solved"),
        "shorter_not_checked": outcomes.count("not checked"),
    }


def _outcome(name: str, link_length: float, planner: str) -> str:
    return str(try_length(name, float(link_length), planner, False)["status"])


def rules_compared(
    variants: Sequence[str],
    lengths: Sequence[float],
    names: Sequence[str],
    shares: Sequence[float],
    workers: int,
    tell: Tell = lambda: None,
) -> list[dict[str, Any]]:
    """Change one rule at a time: what of the benchmark, the families and the paper's workspaces is solved.

    Parameters
    ----------
    variants : sequence of str
        Keys of `VARIANTS`.
    lengths : sequence of float
        Link lengths on the benchmark, in px.
    names : sequence of str
        Further mazes.
    shares : sequence of float
        Link lengths there, in longest rods, or in `PAPER_LINK_LENGTHS`.
    workers : int
        Processes.
    tell : callable
        Called after each try.
    """
    units = {name: PAPER_LINK_LENGTHS.get(name) or family_rod(name)[0] for name in names}
    tasks = [("fig19", length, variant, True) for variant in variants for length in lengths]
    tasks += [
        (name, share * units[name], variant, False)
        for variant in variants
        for name in names
        for share in shares
    ]
    rows = trials(tasks, workers, tell)
    return [_effect(variant, [row for row in rows if row["planner"] == variant]) for variant in variants]


def _effect(variant: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    benchmark = [row for row in rows if row["maze"] == "fig19"]
    others = [row for row in rows if row["maze"] != "fig19"]

    def worst(key: str) -> float | None:
        return max((row[key] / row["link_length"] for row in benchmark if row[key] is not None), default=None)

    return {
        "variant": variant,
        "lengths": len(benchmark),
        "valid": sum(row["status"] == "solved" for row in benchmark),
        "dead_ends": sum(row["status"] == "dead end" for row in benchmark),
        "worst_depth": worst("depth"),
        "worst_between": worst("between"),
        "others": len(others),
        "others_solved": sum(row["status"] == "solved" for row in others),
        "others_dead_ends": sum(row["status"] == "dead end" for row in others),
    }
