"""Trajectories of planned motions: how long they take, how far they are off, and what making them costs.

Run it with `python benchmarks/trajectories.py`; it prints a table in Markdown.
"""

from __future__ import annotations

import time

from hrsnake_env import ArmSpec, Maze
from planners import plan
from planners.export import (
    ExportRefused,
    Trajectory,
    TrajectoryLimits,
    check_trajectory,
    fastest_duration,
    safe_trajectory,
)
from planners.problem import Motion

PROBLEMS = (("fig19", 430.0), ("fig17a", 245.0), ("S400", 300.0))
RATES = (50.0, 200.0)


def main() -> None:
    limits = TrajectoryLimits()
    print(
        "| maze | link | samples per s | duration s | feed alone s | points | off, link lengths | "
        "deepest, link lengths | seconds | of them checking |"
    )
    print("|---" * 10 + "|")
    for name, length in PROBLEMS:
        maze = Maze.load(name)
        motion = plan(maze, ArmSpec(link_length=length)).motion
        if motion is None:
            print(f"| {name} | {length:g} | no motion |")
            continue
        safe_trajectory(motion, maze, limits=limits)  # imports and compilation are not what is measured
        for rate in RATES:
            print(row(motion, maze, limits, rate))


def row(motion: Motion, maze: Maze, limits: TrajectoryLimits, rate: float) -> str:
    length = motion.link_length
    start = time.perf_counter()
    try:
        trajectory, report = safe_trajectory(motion, maze, limits=limits, rate=rate)
    except ExportRefused as refusal:
        return f"| {maze.name} | {length:g} | {rate:g} | {refusal} |"
    seconds = time.perf_counter() - start
    return (
        f"| {maze.name} | {length:g} | {rate:g} | {trajectory.duration:.2f} | "
        f"{fastest_duration(motion, limits):.2f} | {trajectory.n_points} | "
        f"{trajectory.deviation / length:.2g} | {report.penetration_between / length:.2g} | "
        f"{seconds:.2f} | {checking(trajectory, maze):.2f} |"
    )


def checking(trajectory: Trajectory, maze: Maze) -> float:
    start = time.perf_counter()
    check_trajectory(trajectory, maze)
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
