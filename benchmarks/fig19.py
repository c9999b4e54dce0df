"""The paper's benchmark, measured: time of each stage, verdicts among moved walls, and repeatability.

Run with `.venv/bin/python benchmarks/fig19.py` from the repository's root. Prints the tables of the README
and writes them with all figures to `benchmarks/results/fig19.json`.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from hrsnake_env.arm import ArmSpec
from hrsnake_env.contacts import Touch
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import corridor_family, fig19
from planners import Motion, plan, validate
from planners.rollout import simulate_motion

LINK_LENGTH, LONGEST = 430.0, 440.0  # the paper, section 5.1
PLANNER = "beam"  # the paper's rules, clamped
PAPER_MS_PER_POSE = 1.03  # the paper, section 4: its Fig. 17a on an Intel i5-4210U
REPEATS = 15
INWARD = (-5.0, 0.0, 1.0, 2.0, 5.0)
RESULTS = Path(__file__).parent / "results" / "fig19.json"


def walls_moved(inward: float) -> Maze:
    """Return the benchmark with all side and end walls moved into the corridor, on the same centrelines."""
    return fig19(l1=200 - 2 * inward, l2=200 - 2 * inward, wall=40 + 2 * inward, end_gap=200 - 2 * inward)


def bend_moved(inward: float) -> Maze:
    """Return the right-angled bend with all side and end walls moved into the corridor."""
    return corridor_family("L", 200 - 2 * inward)


def measure_stages() -> tuple[Motion, dict[str, float]]:
    """Plan, validate and simulate several times; return the median seconds of each stage, compiled before."""
    maze, arm = fig19(), ArmSpec(link_length=LINK_LENGTH)
    runs: list[dict[str, float]] = []
    motion = None
    for _ in track(range(REPEATS + 1), description="stages"):
        result = plan(maze, arm, PLANNER)
        motion = result.motion
        assert motion is not None, result.reason
        episode = simulate_motion(motion, maze, arm)
        runs.append({**result.timings, "simulate": episode.seconds})
    medians = {stage: float(np.median([run[stage] for run in runs[1:]])) for stage in runs[0]}
    assert motion is not None
    return motion, medians


def verdict_row(motion: Motion, maze: Maze, inward: float) -> dict[str, Any]:
    """Return what checker and simulator say of a motion in a maze."""
    report = simulate_motion(motion, maze).report
    exact = report.kinematic
    assert exact is not None
    return {
        "walls_inward_px": inward,
        "clean": report.clean,
        "free": exact.free,
        "pinch": exact.pinch,
        "collision": exact.collision,
        "kinematic_depth_px": exact.worst_depth,
        "checker_depth_px": validate(motion, maze).penetration,
        "dynamic_depth_px": report.worst_depth,
        "largest_impulse": report.largest_impulse,
        "node_error_px": report.node_error,
        "drift_px": report.drift,
        "first_collision": None if exact.first_collision is None else exact.first_collision.to_dict(),
        "collided_depth_px": {where(maze, touch): -touch.clearance for touch in exact.collisions},
    }


def where(maze: Maze, touch: Touch) -> str:
    """Name a corner by its place, a wall by its middle."""
    x, y = maze.walls[touch.wall].mean(axis=0) if touch.corner is None else touch.corner
    return f"{'wall' if touch.corner is None else 'corner'} ({x:g}, {y:g})"


def fingerprint() -> str:
    """Return a hash of a whole run, plan and simulation, to the last bit."""
    motion = plan(fig19(), ArmSpec(link_length=LINK_LENGTH), PLANNER).motion
    assert motion is not None
    episode = simulate_motion(motion, fig19())
    digest = hashlib.sha256(motion.joints.tobytes() + episode.joints.tobytes() + episode.rewards.tobytes())
    digest.update(json.dumps(episode.report.to_dict()).encode())
    return digest.hexdigest()


def fingerprints() -> list[str]:
    """Return the hash of two runs here and of runs in two more processes with other hash seeds."""
    others = [
        subprocess.run(
            [sys.executable, __file__, "--fingerprint"],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        for seed in ("1", "2")
    ]
    return [fingerprint(), fingerprint(), *others]


def print_tables(results: dict[str, Any]) -> None:
    """Print the results as Markdown."""
    n_poses = results["n_poses"]
    print(f"\n| stage | whole motion of {n_poses} poses | per pose |\n|---|---|---|")
    for stage, value in results["stages_s"].items():
        print(f"| {stage} | {value * 1e3:.1f} ms | {value / n_poses * 1e6:.2f} us |")
    planning = sum(
        value for stage, value in results["stages_s"].items() if stage not in ("validate", "simulate")
    )
    print(
        f"| maze to poses, the paper: {PAPER_MS_PER_POSE} ms per pose | {planning * 1e3:.1f} ms "
        f"| {planning / n_poses * 1e6:.2f} us |"
    )
    for title, rows in results["verdicts"].items():
        print(
            f"\n{title}\n\n| walls moved inward | verdict | free, pinch, collision | depth (kinematic) "
            "| where, and how deep in px |"
        )
        print("|---|---|---|---|---|")
        for row in rows:
            counts = f"{row['free']}, {row['pinch']}, {row['collision']}"
            verdict = "clean" if row["clean"] else "not clean"
            places = "; ".join(f"{place}: {depth:.2f}" for place, depth in row["collided_depth_px"].items())
            print(
                f"| {row['walls_inward_px']:g} px | {verdict} | {counts} "
                f"| {row['kinematic_depth_px']:.2f} px | {places or '-'} |"
            )
    same = len(set(results["fingerprints"])) == 1
    print(
        f"\n{len(results['fingerprints'])} runs in 3 processes: {'bit-identical' if same else 'NOT THE SAME'}"
    )


def main() -> None:
    """Measure, print and write."""
    if "--fingerprint" in sys.argv:
        print(fingerprint())
        return
    motion, stages = measure_stages()
    bend = plan(bend_moved(0.0), ArmSpec(link_length=560.0), PLANNER).motion
    assert bend is not None
    results = {
        "machine": {
            "processor": platform.machine(),
            "cores": os.cpu_count(),
            "python": platform.python_version(),
        },
        "link_length_px": LINK_LENGTH,
        "index": LINK_LENGTH / LONGEST,
        "n_poses": motion.n_poses,
        "n_links": motion.n_links,
        "stages_s": stages,
        "verdicts": {
            "fig19, links of 430 px": [
                verdict_row(motion, walls_moved(inward), inward)
                for inward in track(INWARD, description="fig19")
            ],
            "L, links of 560 px": [
                verdict_row(bend, bend_moved(inward), inward) for inward in track(INWARD, description="L")
            ],
        },
        "fingerprints": fingerprints(),
    }
    RESULTS.parent.mkdir(exist_ok=True)
    with replacing(RESULTS) as part:
        part.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    print_tables(results)


if __name__ == "__main__":
    main()
