"""Attack everything that takes planar geometry with degenerate scenes, at all scales and offsets.

Run with `python -m benchmarks.trust.degenerate --count 2000` from the repository's root. A scene is given by
its seed: `--seed S --count 1` looks at scene S again. Exits with 1 if a law is broken.
"""

from __future__ import annotations

import argparse
import collections
import importlib.metadata
import json
import math
import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from rich.progress import track

import hrsnake_env  # noqa: F401  registers the environment
from benchmarks.trust.shapes import PLACEMENTS, Scene, random_scene
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.planning import plan
from planners.problem import PlanningResult
from planners.validation import validate

OUT = Path("benchmarks/results/trust")
BUDGET = 3.0
"""Seconds for a plan."""

HANG = 10.0
"""Seconds that nothing may take."""

PLANNERS = ("auto", "track", "sweep", "beam")

LAWS = {
    "sentence": "what is refused is refused in one clear sentence",
    "silence": "no traceback, no warning",
    "time": f"nothing takes {HANG:g} s",
    "refused": "what is wrong is refused",
    "valid": "a motion handed out is valid",
    "reason": "no motion without a reason",
    "same": "the answer is the same at every scale and offset",
    "file": "a maze comes back from its file as it was",
    "env": "the environment resets and steps to finite numbers",
    "picture": "a plan can be drawn, replayed and simulated",
}


class Broken(Exception):
    """Say which law is broken, and how."""


def look_at(scene: Scene, placement: tuple[float, float], planner: str, extras: bool) -> Iterator[str]:
    """Put a scene through everything; yield each law that was tried, at last the outcome after a colon.

    Raises
    ------
    Broken
        At the first fault.
    """
    given = scene.placed(*placement)
    maze, arm = _made(lambda: Maze(**given["maze"])), _made(lambda: ArmSpec(**given["arm"]))
    yield "sentence"
    refused = maze is None or arm is None
    result = None
    if maze is not None:
        _check_file(maze)
        yield "file"
    if maze is not None and arm is not None:
        result = _timed("plan", lambda: _made(lambda: plan(maze, arm, planner, time_budget=BUDGET)))
        refused = result is None
        yield "time"
    if scene.wrong and not refused:
        raise Broken(f"refused: {scene.marks} was taken")
    yield "refused"
    if maze is None or arm is None:
        yield ":refused"
        return
    if result is not None:
        _check_result(maze, arm, result)
        yield "valid" if result.solved else "reason"
    if extras:
        _timed("env", lambda: _check_env(maze, arm))
        yield "env"
        if result is not None:
            _timed("picture", lambda: _check_pictures(maze, arm, result))
            yield "picture"
    yield ":refused" if result is None else f":{result.status}"


def look_everywhere(seed: int, extras: bool = True) -> tuple[collections.Counter[str], list[str]]:
    """Look at the scene of a seed at the plain and at one other placement; return laws tried, and faults."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng)
    planner = PLANNERS[rng.integers(len(PLANNERS))]
    elsewhere = PLACEMENTS[rng.integers(1, len(PLACEMENTS))]
    tried: collections.Counter[str] = collections.Counter()
    faults, outcomes = [], []
    for placement in (PLACEMENTS[0], elsewhere):
        where = f"seed {seed}, {scene.marks}, {planner}, scale and offset {placement}"
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                for law in look_at(scene, placement, planner, extras):
                    if law.startswith(":"):
                        outcomes.append(law[1:])
                    else:
                        tried[law] += 1
            except Broken as broken:
                faults.append(f"{broken} ({where})")
            except Exception as error:
                last = traceback.extract_tb(error.__traceback__)[-1]
                faults.append(
                    f"silence: {type(error).__name__}: {error} at {last.filename}:{last.lineno} ({where})"
                )
        tried["silence"] += 1
    if len(outcomes) == 2 and not scene.fragile and "out of time" not in outcomes and _resolved(elsewhere):
        tried["same"] += 1
        if _kind(outcomes[0]) != _kind(outcomes[1]):
            faults.append(f"same: {outcomes[0]} became {outcomes[1]} ({where})")
    return tried, faults


def _resolved(placement: tuple[float, float]) -> bool:
    """Whether coordinates are fine enough at a placement for the answer to be the same."""
    scale, offset = placement
    return offset * np.finfo(np.float64).eps < 1e-6 * scale


def _kind(outcome: str) -> str:
    return outcome if outcome in ("refused", "solved") else "no plan"


def _made(make: Callable[[], Any]) -> Any:
    """Make something; None if it is refused, in one sentence."""
    try:
        return make()
    except InputError as error:
        text = str(error)
        if not text.startswith(("Expected ", "Unknown ")) or not text.endswith(".") or "\n" in text:
            raise Broken(f"sentence: {text!r}") from None
        return None


def _timed(what: str, call: Callable[[], Any]) -> Any:
    start = time.perf_counter()
    value = call()
    if (seconds := time.perf_counter() - start) > HANG:
        raise Broken(f"time: {what} took {seconds:.1f} s")
    return value


def _check_file(maze: Maze) -> None:
    again = Maze.from_geojson(json.loads(json.dumps(maze.to_geojson())))
    same = again.walls.shape == maze.walls.shape and (again.walls == maze.walls).all()
    if not same or (again.goal != maze.goal).any() or (again.base_pose[:2] != maze.base_pose[:2]).any():
        raise Broken("file: the maze comes back from GeoJSON as another")


def _check_result(maze: Maze, arm: ArmSpec, result: PlanningResult) -> None:
    if result.solved != (result.motion is not None):
        raise Broken(f"valid: {result.status} with motion {result.motion}")
    if result.motion is not None:
        report = validate(result.motion, maze, arm)
        if not report.valid:
            raise Broken(f"valid: {report.faults[0].message}")
    elif not result.reason.endswith("."):
        raise Broken(f"reason: {result.status} because {result.reason!r}")


def _check_env(maze: Maze, arm: ArmSpec) -> None:
    if arm.n_links is None and maze.size > 300.0 * arm.link_length:
        return  # as many links as no simulator wants
    env = _made(
        lambda: gym.make(
            "HyperRedundantMaze-v0",
            maze=maze,
            link_length=arm.link_length,
            n_links=arm.n_links,
            link_radius=arm.link_radius,
        )
    )
    if env is None:
        return
    with env:
        observation, _ = env.reset(seed=0)
        for _ in range(5):
            if not np.isfinite(observation).all():
                raise Broken("env: an observation is not finite")
            action = np.ones(env.action_space.shape, dtype=np.float32)
            observation, reward, *_ = env.step(action)
            if not math.isfinite(float(reward)):
                raise Broken("env: a reward is not finite")


def _check_pictures(maze: Maze, arm: ArmSpec, result: PlanningResult) -> None:
    from hrsnake_env.replay import replay_html
    from planners.drawing import draw_result
    from planners.rollout import simulate_motion

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "plan.png"
        draw_result(maze, arm, result, out)
        if not out.stat().st_size:
            raise Broken("picture: nothing was drawn")
    motion = result.motion
    if motion is not None and motion.n_poses * motion.n_links < 20_000:
        episode = simulate_motion(motion, maze, arm, substeps=1)
        replay_html([episode.trace(maze, link_radius=arm.link_radius)])


# The campaign


def main() -> int:
    """Run the campaign; return 1 if a fault was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=2000, help="scenes, each at two placements")
    parser.add_argument("--seed", type=int, default=0, help="of the first scene")
    parser.add_argument("--every", type=int, default=5, help="of so many scenes one is drawn and simulated")
    options = parser.parse_args()
    tried: collections.Counter[str] = collections.Counter()
    faults: list[str] = []
    start, done = time.perf_counter(), 0
    try:
        for seed in track(range(options.seed, options.seed + options.count), description="degenerate"):
            more, found = look_everywhere(seed, extras=options.every > 0 and seed % options.every == 0)
            tried += more
            faults += found
            done += 1
            for fault in found:
                print(fault, flush=True)
    except KeyboardInterrupt:
        print(f"Stopped after {done} scenes.")
    write(tried, faults, done, options.seed, time.perf_counter() - start)
    return int(bool(faults))


def write(tried: collections.Counter[str], faults: list[str], done: int, seed: int, seconds: float) -> None:
    """Print one line for each law, and write the figures."""
    laws = {
        law: {
            "what": what,
            "cases": tried[law],
            "faults": sum(fault.startswith(law + ":") for fault in faults),
        }
        for law, what in LAWS.items()
    }
    for entry in laws.values():
        print(f"{entry['what']}: {entry['cases']} cases, {entry['faults']} faults")
    OUT.mkdir(parents=True, exist_ok=True)
    versions = {name: importlib.metadata.version(name) for name in ("numpy", "shapely", "pymunk", "numba")}
    record = {
        "campaign": "degenerate",
        "scenes": done,
        "seed": seed,
        "seconds": round(seconds, 1),
        "laws": laws,
        "faults": faults,
        "versions": {"python": sys.version.split()[0], **versions},
    }
    part = OUT / "degenerate.json.part"
    part.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    os.replace(part, OUT / "degenerate.json")


if __name__ == "__main__":
    sys.exit(main())
