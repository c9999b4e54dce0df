"""Load for long: memory stays flat, and an answer after hours is the one of the first minute.

Run with `.venv/bin/python -m benchmarks.trust.load` from the repository's root. Two parts:

- steps: environments stepped by several processes, ids in turn, actions at random. Now and then an episode of
  the first minute is played again, by the planner where the maze is known beforehand: each observation,
  reward and ending must be the same to the bit.
- plans: one process that plans again and again, some questions with an answer and some without; each motion
  must be the same to the bit as the first time.

Resident memory is read on the way. It counts as flat if the median of the last quarter is at most
`FLAT_MIB` above that of the second; what that would come to in a day is printed, too. Writes
`benchmarks/results/trust/load.json`; exits with 1 if an answer drifts or memory grows.
"""

from __future__ import annotations

import argparse
import hashlib
import itertools
import multiprocessing
import os
import sys
import time
from collections.abc import Callable, Iterator
from multiprocessing.queues import Queue
from typing import Any

import gymnasium as gym
import numpy as np
import psutil
from rich.progress import Progress

import hrsnake_env  # noqa: F401 - registers the ids
from benchmarks.trust.results import write_results
from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.controllers import PlannedPolicy
from planners.planning import plan

IDS = ("v0", "Straight-v0", "UTurn-I50-v0", "SBend-I74-v0", "RandomTrain-v0")
QUESTIONS = (
    ("fig19", 430.0), ("fig19", 300.0), ("fig19", 445.0), ("L", 300.0), ("S0", 250.0),
    ("U200", 400.0), ("zig3", 420.0), ("stairs", 300.0), ("S400", 350.0), ("U40", 150.0),
)  # fmt: skip
FLAT_MIB = 4.0
REPLAY_EVERY = 20_000  # steps of one process
READ_EVERY = 5_000
MOST_STEPS = 3_000  # of an episode that is played again
DAY_S = 86_400.0
MIB = 2.0**20


def resident() -> float:
    """Return this process's resident memory in MiB."""
    return float(psutil.Process().memory_info().rss) / MIB


def environments() -> dict[str, Any]:
    """Make one environment of each id."""
    return {name: gym.make(f"HyperRedundantMaze-{name}") for name in IDS}


def orders(env: Any, seed: int) -> Iterator[Any]:
    """Yield actions: the planner's, where the maze does not change, and random ones after that."""
    if "Random" not in env.spec.id:
        motion = plan(env.unwrapped.maze, env.unwrapped.arm).motion
        assert motion is not None, env.spec.id
        yield from PlannedPolicy(motion).actions
    rng, low, high = np.random.default_rng(seed), env.action_space.low, env.action_space.high
    while True:
        yield rng.uniform(low, high).astype(low.dtype)


def digest_of_episode(env: Any, seed: int) -> str:
    """Play an episode from a seed, and digest all that comes back."""
    found = hashlib.sha256()
    env.reset(seed=seed)
    for action in itertools.islice(orders(env, seed), MOST_STEPS):
        observation, reward, terminated, truncated, _ = env.step(action)
        found.update(observation.tobytes() + np.float64(reward).tobytes() + bytes([terminated, truncated]))
        if terminated or truncated:
            break
    return found.hexdigest()


def step_worker(number: int, n_steps: int, seed: int, news: Queue[Any]) -> None:
    """Step environments in turn; tell of steps, memory and drift."""
    envs, rng = environments(), np.random.default_rng([seed, number])
    names = list(envs)
    first = {name: digest_of_episode(envs[name], seed) for name in names}
    memory, drifts, episodes, replayed, done = [], 0, 0, 0, 0
    start = time.perf_counter()
    while done < n_steps:
        name = names[episodes % len(names)]
        env, episodes = envs[name], episodes + 1
        env.reset(seed=int(rng.integers(2**31)))
        low, high = env.action_space.low, env.action_space.high
        ended = False
        while not ended and done < n_steps:
            action = rng.uniform(low, high).astype(low.dtype)
            _, _, terminated, truncated, _ = env.step(action)
            ended, done = terminated or truncated, done + 1
            if done % READ_EVERY == 0:
                memory.append(resident())
                news.put(("steps", number, READ_EVERY))
            if done % REPLAY_EVERY == 0:
                again = names[replayed % len(names)]
                drifts += digest_of_episode(envs[again], seed) != first[again]
                replayed, ended = replayed + 1, True
    seconds = time.perf_counter() - start
    figures = {"steps": done, "episodes": episodes, "replayed": replayed, "drifts": drifts}
    news.put(("done", number, {**figures, **growth(memory, seconds)}))


def plan_worker(_number: int, n_plans: int, _seed: int, news: Queue[Any]) -> None:
    """Plan again and again; tell of plans, memory and drift."""
    questions = [(Maze.load(name), ArmSpec(link_length=length)) for name, length in QUESTIONS]
    first = [digest_of_plan(*question) for question in questions]
    memory, drifts, solved = [], 0, 0
    start = time.perf_counter()
    for k in range(n_plans):
        found = digest_of_plan(*questions[k % len(questions)])
        drifts += found != first[k % len(questions)]
        solved += not found.startswith("no")
        if k % 20 == 19:
            memory.append(resident())
            news.put(("steps", 0, 20))
    seconds = time.perf_counter() - start
    figures = {"plans": n_plans, "solved": solved, "drifts": drifts}
    news.put(("done", 0, {**figures, **growth(memory, seconds)}))


def digest_of_plan(maze: Maze, arm: ArmSpec) -> str:
    """Plan, and digest the motion, or say why there is none."""
    result = plan(maze, arm)
    if result.motion is None:
        return f"no motion: {result.status.value}"
    return hashlib.sha256(result.motion.joints.tobytes()).hexdigest()


def growth(memory: list[float], seconds: float) -> dict[str, float]:
    """Compare memory in the last quarter with that in the second."""
    read = np.array(memory)
    quarter = max(read.size // 4, 1)
    grown = float(np.median(read[-quarter:]) - np.median(read[quarter : 2 * quarter]))
    # The middles of the two quarters are half of the time apart; a fall counts as none.
    day = max(grown, 0.0) * DAY_S / (0.5 * seconds)
    return {"seconds": seconds, "mib": float(read[-1]), "grown_mib": grown, "day_mib": day}


def run(
    target: Callable[..., None], n_processes: int, each: int, seed: int, title: str
) -> list[dict[str, Any]]:
    """Run a part in processes of its own, and return what each found."""
    context = multiprocessing.get_context("spawn")
    news = context.Queue()
    workers = [
        context.Process(target=target, args=(number, each, seed, news), daemon=True)
        for number in range(n_processes)
    ]
    for worker in workers:
        worker.start()
    try:
        return list(_told(workers, news, n_processes * each, title))
    finally:
        for worker in workers:
            worker.kill()


def _told(workers: list[Any], news: Queue[Any], total: int, title: str) -> Iterator[dict[str, Any]]:
    left = set(range(len(workers)))
    with Progress() as bar:
        task = bar.add_task(title, total=total)
        while left:
            kind, number, what = news.get(timeout=600.0)
            if kind == "done":
                left.discard(number)
                yield what
            else:
                bar.advance(task, what)


def report(title: str, found: list[dict[str, Any]], unit: str) -> int:
    """Print what was found; return the number of faults."""
    count, seconds = sum(each[unit] for each in found), max(each["seconds"] for each in found)
    drifts, grown = sum(each["drifts"] for each in found), max(each["grown_mib"] for each in found)
    day, again = max(each["day_mib"] for each in found), sum(each.get("replayed", count) for each in found)
    print(
        f"{title}: {count:,} {unit} in {seconds:.0f} s by {len(found)} processes; {again:,} answers compared,"
    )
    print(f"  {drifts} drifted; memory of a process grew by {grown:.2f} MiB at most ({day:.0f} MiB in a day)")
    if "episodes" in found[0]:
        episodes = sum(each["episodes"] for each in found)
        print(f"  {episodes:,} episodes; in 24 h {episodes * DAY_S / seconds:,.0f} at this rate")
    return drifts + sum(each["grown_mib"] > FLAT_MIB for each in found)


def main() -> None:
    """Run both parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=10**7, help="of all environments together")
    parser.add_argument("--plans", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    ask = parser.parse_args()
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    found: dict[str, Any] = {}
    faults = 0
    for env in environments().values():  # compiles what the processes need, once
        digest_of_episode(env, ask.seed)
    if ask.steps:
        found["steps"] = run(step_worker, ask.workers, ask.steps // ask.workers, ask.seed, "steps")
        faults += report("steps", found["steps"], "steps")
    if ask.plans:
        found["plans"] = run(plan_worker, 1, ask.plans, ask.seed, "plans")
        faults += report("plans", found["plans"], "plans")
    write_results("load", {**found, "faults": faults})
    print(f"{faults} faults")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
