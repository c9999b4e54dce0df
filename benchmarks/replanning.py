"""Replanning from the last motion: a goal that wanders through a hall, and a pillar that moves across it.

Run with `.venv/bin/python benchmarks/replanning.py` from the repository's root. Each frame is one call of
`plan(maze, arm, warm_start=motion)`, exact check included; beside it, in the same run, a plan from nothing.
Prints a table and writes `benchmarks/results/replanning.json`.
"""

from __future__ import annotations

import dataclasses
import json
import os
import platform
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track
from shapely.affinity import translate
from shapely.geometry import Point, Polygon, box

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import clutter_hall
from planners import Motion, plan

LINK_LENGTH = 150.0
HALLS, FRAMES = 10, 30
PILLAR_STEP = 20.0  # px per frame
RESULTS = Path(__file__).parent / "results" / "replanning.json"


def wandering_goal(seed: int) -> Iterator[Maze]:
    """Yield a hall whose goal moves by one link length per frame, in directions that change slowly."""
    maze, rng = clutter_hall(seed), np.random.default_rng(seed)
    heading = rng.uniform(0.0, 2.0 * np.pi)
    yield maze
    for _ in range(FRAMES):
        while True:  # turn until the next place is free, a little off the walls, and not beside the base
            heading += rng.normal(0.0, 0.7)
            goal = maze.goal + LINK_LENGTH * np.array([np.cos(heading), np.sin(heading)])
            room = maze.free_space.buffer(-30.0).contains(Point(goal))
            if room and np.hypot(*(goal - maze.base_pose[:2])) > 4.0 * LINK_LENGTH:
                break
        maze = dataclasses.replace(maze, goal=goal)
        yield maze


def moving_pillar(seed: int) -> Iterator[Maze]:
    """Yield a hall in which a square pillar comes down across the middle, 20 px per frame."""
    maze, rng = clutter_hall(seed), np.random.default_rng(seed)
    pillar: Polygon = box(-50.0, -50.0, 50.0, 50.0)
    x, y = rng.uniform(900.0, 1100.0), 1300.0
    yield maze
    for _ in range(FRAMES):
        y -= PILLAR_STEP
        try:
            yield dataclasses.replace(maze, free_space=maze.free_space.difference(translate(pillar, x, y)))
        except InputError:  # pillar and walls together have closed the hall: that frame is left out
            continue


def run(scene: Callable[[int], Iterator[Maze]], title: str) -> dict[str, Any]:
    """Replan all frames of all halls; return counts and seconds."""
    arm = ArmSpec(link_length=LINK_LENGTH)
    warm: list[float] = []
    cold: list[float] = []
    fallen_back = unsolved = 0
    for seed in track(range(HALLS), description=title):
        motion: Motion | None = None
        for maze in scene(seed):
            start = time.perf_counter()
            result = plan(maze, arm, warm_start=motion, explain=False)
            if motion is not None:
                warm.append(time.perf_counter() - start)
                fallen_back += len(result.attempts) > 1
                unsolved += not result.solved
                start = time.perf_counter()
                plan(maze, arm, explain=False)
                cold.append(time.perf_counter() - start)
            motion = result.motion or motion
    return {
        "frames": len(warm),
        "unsolved": unsolved,
        "not from the last motion alone": fallen_back,
        "median_s": float(np.median(warm)),
        "p90_s": float(np.quantile(warm, 0.9)),
        "from_nothing_median_s": float(np.median(cold)),
    }


def main() -> None:
    """Measure, print and write."""
    plan(clutter_hall(0), ArmSpec(link_length=LINK_LENGTH))  # compiles the kernels
    scenes = {
        f"goal wanders by one link ({LINK_LENGTH:g} px)": wandering_goal,
        f"pillar moves by {PILLAR_STEP:g} px": moving_pillar,
    }
    results = {
        "machine": {"processor": platform.machine(), "cores": os.cpu_count()},
        "scenes": {title: run(scene, title) for title, scene in scenes.items()},
    }
    print("\n| per frame | frames | unsolved | not warm | median | 90 % | from nothing, median | ratio |")
    print("|---|---|---|---|---|---|---|---|")
    for title, row in results["scenes"].items():
        print(
            f"| {title} | {row['frames']} | {row['unsolved']} | {row['not from the last motion alone']} "
            f"| {row['median_s'] * 1e3:.1f} ms | {row['p90_s'] * 1e3:.1f} ms "
            f"| {row['from_nothing_median_s'] * 1e3:.1f} ms "
            f"| {row['from_nothing_median_s'] / row['median_s']:.1f} |"
        )
    RESULTS.parent.mkdir(exist_ok=True)
    with replacing(RESULTS) as part:
        part.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
