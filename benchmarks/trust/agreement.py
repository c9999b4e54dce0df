"""Check random motions with `planners.validation` and with its twin in `swept`, and compare every figure.

Run from the repository's root with `python -m benchmarks.trust.agreement --count 100000 --seed 0`; case n
of a seed is drawn by `--only n`. `--shipped` looks at the motions that come with the project instead. Ends
with one line per law, and with 1 if a law was broken.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter

import numpy as np

from benchmarks.trust.motions import draw_case
from benchmarks.trust.planted import KINDS, NAMED, plant
from benchmarks.trust.results import write_results
from benchmarks.trust.swept import DEEP, TIE, inspect
from hrsnake_env.arm import ArmSpec
from hrsnake_env.ladder import LADDER
from hrsnake_env.maze import Maze
from hrsnake_env.random_mazes import LINK_LENGTH, task_maze
from planners import demo
from planners.bench.pool import bar
from planners.planning import plan
from planners.validation import validate

FIGURES = ("clearance", "penetration", "length_error", "largest_step", "goal_distance")


def disagreements(motion, maze, arm, cores=()):
    """Yield a law and a sentence for everything on which the checker and its twin do not agree."""
    report, twin = validate(motion, maze, arm), inspect(motion, maze, arm, cores)
    kinds, length = {fault.kind for fault in report.faults}, motion.link_length
    for name in FIGURES:
        one, other = getattr(report, name), getattr(twin, name)
        if one != other and not abs(one - other) <= 1e-9 * length:
            yield name, f"{name} is {one!r}, by the twin {other!r}, {(one - other) / length:.3g} links apart"
    off = 1e-9 * length + twin.astray  # poses are as the joints say, between them the configuration decides
    for kind, wanted in twin.faulty.items():
        if kind == "sweep" and wanted and ("penetration" in kinds or off > 1e-5 * length):
            continue  # it is said already of the pose, or the two are not of one motion
        if wanted is not None and wanted is not (kind in kinds):
            yield f"verdict: {kind}", f"{kind} is {kind in kinds}, by the twin {wanted}"
    between = report.penetration_between
    if off < 1e-5 * length and not between + off >= twin.between_low:
        yield "bound between", f"the bound is {between!r}, the twin gets {twin.between_low!r} deep"
    if (
        math.isfinite(between)
        and not kinds & {"sweep", "penetration"}
        and between > DEEP * length * (1 + TIE)
    ):
        yield "bound between", f"the bound is {between!r} without a fault"
    if twin.swept_free and not report.penetration and between > DEEP * length * (1 + TIE):
        yield "bound between", f"the bound is {between!r} where the swept areas are free"
    if report.valid is bool(kinds):
        yield "valid", f"valid is {report.valid} with the faults {sorted(kinds)}"


def planted_faults(count, seed):
    """Yield a law and a sentence for every planted fault that is not named, or named without being there."""
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        kind, share = (
            KINDS[number % len(KINDS)],
            1.0 + float(rng.choice([-1.0, 1.0])) * rng.uniform(0.02, 0.5),
        )
        report = validate(*plant(rng, kind, share))
        there = NAMED.get(kind, kind) in {fault.kind for fault in report.faults}
        wrong = there is not (share > 1.0)
        yield f"planted: {kind}", f"{share:.3f} of what is allowed: fault is {there}" if wrong else None


def shipped_motions(rungs=None):
    """Yield name, motion, maze and arm for what `auto` makes of the rungs of the ladder and named mazes."""
    for name, rung in LADDER.items():
        if rungs is not None and name not in rungs:
            continue
        maze, arm = Maze.load(rung.maze), ArmSpec(link_length=rung.link_length)
        result = plan(maze, arm)
        if result.motion is not None:
            yield name, result.motion, maze, arm
    if rungs is None:  # the demonstration, and the expert's in random mazes with its margins
        yield "demo", *_demo()
        for split in ("train", "test"):
            for seed in range(20):
                maze, arm = task_maze(split, seed), ArmSpec(link_length=LINK_LENGTH)
                result = plan(maze, arm)
                if result.motion is not None:
                    yield f"random {split} {seed}", result.motion, maze, arm


def _demo():
    maze, arm = Maze.load("fig19"), ArmSpec(link_length=demo.LINK_LENGTH)
    return plan(maze, arm, demo.PLANNER).motion, maze, arm


def run_all(name, rows):
    """Go through laws and sentences (None where all is well); return how many, and the broken ones."""
    done, broken = 0, []
    try:
        for law, sentence in rows:
            done += 1
            if sentence is not None:
                broken.append({"law": law, "message": sentence})
                print(f"{name}: {law}: {sentence}", flush=True)
    except KeyboardInterrupt:
        print("stopped")
    return done, broken


def shipped_rows():
    """Yield one row for each shipped motion that is all right, and one for each law that it breaks."""
    for name, motion, maze, arm in shipped_motions():
        found = list(disagreements(motion, maze, arm))
        report = validate(motion, maze, arm)
        if not report.valid:
            found.append(("valid", f"faults {[fault.kind for fault in report.faults]}"))
        yield from ((f"{name}: {law}", sentence) for law, sentence in found or [("all", None)])


def run(count, seed, only=None):
    """Compare `count` cases; return counts by law and verdict, and the broken laws."""
    seen, broken = Counter(), []
    numbers = range(count) if only is None else [only]
    try:
        with bar("agreement", len(numbers)) as tell:
            for number in numbers:
                case = draw_case(np.random.default_rng([seed, number]))
                seen["cases"] += 1
                for law, sentence in disagreements(case.motion, case.maze, case.arm, case.cores):
                    broken.append({"number": number, "law": law, "message": sentence})
                    print(f"case {number}: {law}: {sentence}", flush=True)
                tell()
    except KeyboardInterrupt:
        print("stopped")
    return seen, broken


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="one case alone")
    parser.add_argument("--shipped", action="store_true", help="the project's own motions")
    parser.add_argument("--planted", action="store_true", help="planted faults")
    options = parser.parse_args()
    start = time.perf_counter()
    if options.shipped or options.planted:
        name = "shipped" if options.shipped else "planted"
        rows = shipped_rows() if options.shipped else planted_faults(options.count, options.seed)
        done, broken = run_all(name, rows)
        seconds = time.perf_counter() - start
        print(f"{name}: {done} cases, {len(broken)} faults, {seconds:.0f} s")
        figures = {"count": done, "seed": options.seed, "seconds": seconds, "faults": broken[:1000]}
        print(write_results(f"agreement_{name}", figures))
        return 1 if broken else 0
    seen, broken = run(options.count, options.seed, options.only)
    seconds = time.perf_counter() - start
    laws = Counter(fault["law"] for fault in broken)
    print(f"agreement with the twin: {seen['cases']} cases, {len(broken)} faults, {seconds:.0f} s")
    for law, n in laws.items():
        print(f"  {law}: {n} faults")
    figures = {"count": seen["cases"], "seed": options.seed, "seconds": seconds, "faults": broken[:1000]}
    if options.only is None and seen["cases"]:
        print(write_results("agreement", figures))
    return 1 if broken else 0


if __name__ == "__main__":
    raise SystemExit(main())
