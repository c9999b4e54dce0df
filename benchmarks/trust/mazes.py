"""Plan random mazes, and check every law of `maze_laws` on each.

Run from the repository's root with `python -m benchmarks.trust.mazes --count 1000 --seed 0`. `auto` is asked
in each maze, and one other planner in turn. What must hold, and what may come
out otherwise:

- A motion is valid in the maze that is moved, turned, mirrored or scaled with it, and with far walls.
- A maze scaled by a power of two has the same plan, digit by digit, of thick links to
  1e-9 link lengths: no length is absolute.
- Turned, mirrored or shifted, a maze may have another plan, or none: the grid of the potential is along x and
  y, and rounding is another. So it may where the walls are listed in another order, as sums then round
  otherwise: mostly by 1e-14 link lengths, rarely so that another planner of `auto` is the first to succeed.
  Both motions are valid. This is counted as "other answers".
- Another part of the free space leaves the walls in their order, and so changes no digit.

Any case is planned again with `--only NUMBER` and the same seed.
Ends with one line per law, and with 1 if a fault was found.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
import traceback
from collections import Counter
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmarks.trust import maze_laws as laws
from benchmarks.trust.maze_draws import (
    Similarity,
    draw_case,
    draw_similarity,
    in_other_order,
    with_far_part,
    with_far_walls,
)
from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.bench.pool import bar
from planners.planning import PLANNERS, plan

RESULTS = Path(__file__).parents[1] / "results" / "trust"
TIME_BUDGET = 1.0
"""Seconds for each plan."""


class Tally:
    """Count cases and faults by law, and keep the faults' sentences."""

    def __init__(self) -> None:
        self.cases: Counter[str] = Counter()
        self.statuses: Counter[str] = Counter()
        self.others: list[dict[str, str | int]] = []
        self.faults: list[dict[str, str | int]] = []
        self.seconds: list[float] = []

    def check(self, number: int, law: str, function, *arguments):
        """Call a function; note whether the law holds. Return what it returns, None if it does not hold."""
        self.cases[law] += 1
        try:
            return function(*arguments)
        except laws.Broken as error:
            self._note(number, law, str(error))
        except Exception:
            self._note(number, law if law == "exception" else "exception", traceback.format_exc(limit=-4))
        return None

    def _note(self, number: int, law: str, message: str) -> None:
        what = "other answer" if law in laws.MAY_DIFFER else "fault"
        (self.others if law in laws.MAY_DIFFER else self.faults).append(
            {"number": number, "law": law, "message": message}
        )
        print(f"\n{what} in case {number}: {law}: {message}", flush=True)


def one_case(seed: int, number: int, tally: Tally, folder: Path) -> None:
    """Draw and plan one maze, and check every law on it."""
    draws = np.random.default_rng([seed, number])
    case = draw_case(draws)
    others = [name for name in PLANNERS]
    solved = None
    for planner in ("auto", others[number % len(others)]):
        answer = tally.check(number, "exception", laws.timed_plan, case, planner, TIME_BUDGET)
        if answer is None:
            continue
        result, seconds = answer
        tally.seconds.append(seconds)
        tally.statuses[f"{'auto' if planner == 'auto' else 'others'}: {result.status}"] += 1
        tally.check(number, "time", laws.on_time, seconds, TIME_BUDGET, planner)
        tally.check(number, "reason", laws.says_why, case, planner, result)
        if result.motion is not None:
            tally.check(number, "saved", laws.valid_when_saved, case, result.motion, folder / f"{number}.npz")
            (folder / f"{number}.npz").unlink(missing_ok=True)
        if planner == "auto":
            solved = result
    if solved is None:
        return
    similarity, walls = draw_similarity(draws), (with_far_walls, with_far_part)[number % 2]
    if solved.motion is not None:
        motion = solved.motion
        tally.check(number, "moved motion", laws.valid_when_moved, case, motion, similarity)
        tally.check(number, "reversed", laws.valid_when_reversed, case, motion)
        n_poses = int(draws.integers(1, motion.n_poses + 1))
        tally.check(number, "cut", laws.valid_when_cut, case, motion, n_poses)
    moved = similarity.case(case)
    far = laws.replace_maze(case, walls(case.maze, draws))
    twofold = Similarity(scale=2.0 ** int(draws.integers(-9, 14)))
    ordered = laws.replace_maze(case, in_other_order(case.maze, draws))
    if solved.motion is not None:
        tally.check(
            number,
            "far walls",
            laws.stays_valid,
            solved.motion,
            ordered.maze,
            ordered,
            "walls in other order",
        )
    if solved.motion is not None:
        tally.check(
            number, "far walls", laws.stays_valid, solved.motion, far.maze, far, "with far walls", {"goal"}
        )
    for law, other in (
        ("moved plan", moved),
        ("far walls", far),
        ("wall order", ordered),
        ("scaled plan", twofold.case(case)),
    ):
        answer = tally.check(number, "exception", laws.timed_plan, other, "auto", TIME_BUDGET)
        if answer is not None:
            tally.check(number, "time", laws.on_time, answer[1], TIME_BUDGET, law)
            tally.seconds.append(answer[1])
            if law == "scaled plan":
                tally.check(number, law, laws.digit_by_digit, case, solved, answer[0], twofold)
                continue
            what = {"moved plan": str(similarity), "far walls": walls.__name__}.get(law, law)
            tally.check(number, law, laws.still_solved, solved, answer[0], what)


def main() -> int:
    """Run the campaign."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="random mazes")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first maze")
    parser.add_argument("--only", type=int, help="one maze by its number")
    given = parser.parse_args()
    folder = RESULTS / "mazes"
    folder.mkdir(parents=True, exist_ok=True)
    for planner in PLANNERS:  # kernels are compiled before anything is timed
        plan(Maze.load("fig19"), ArmSpec(link_length=200.0), planner)
    numbers = range(given.first, given.first + given.count) if given.only is None else [given.only]
    tally, start, done = Tally(), time.perf_counter(), 0
    try:
        with bar("mazes", len(numbers)) as tell:
            for number in numbers:
                one_case(given.seed, number, tally, folder)
                done += 1
                tell()
    except KeyboardInterrupt:
        print(f"\nstopped after {done} mazes")
    return report(given.seed, done, tally, time.perf_counter() - start)


def report(seed: int, done: int, tally: Tally, seconds: float) -> int:
    """Print and write what was found; return 1 if that is any fault."""
    by_law = Counter(fault["law"] for fault in tally.faults)
    other = Counter(answer["law"] for answer in tally.others)
    late = np.array(tally.seconds or [0.0])
    for law, meaning in laws.LAWS.items():
        print(f"{law}: {meaning}: {tally.cases[law]} cases, {by_law[law]} faults, {other[law]} other answers")
    print(f"outcomes: {dict(sorted(tally.statuses.items()))}")
    median, slow, most = np.quantile(late, (0.5, 0.99, 1.0))
    print(f"seconds of the processor per plan: median {median:.2f}, 99 % {slow:.2f}, most {most:.2f}")
    print(f"{done} mazes with seed {seed} in {seconds:.0f} s, {len(tally.faults)} faults")
    (RESULTS / "mazes.json").write_text(
        json.dumps(
            {
                "mazes": done,
                "seed": seed,
                "seconds": seconds,
                "cases": tally.cases,
                "statuses": tally.statuses,
                "faults": tally.faults,
                "other_answers": tally.others,
                "most_seconds": float(late.max()),
                "versions": {
                    "python": platform.python_version(),
                    **{name: version(name) for name in ("numpy", "shapely", "numba", "scipy")},
                },
            },
            indent=1,
        )
    )
    return 1 if tally.faults else 0


if __name__ == "__main__":
    raise SystemExit(main())
