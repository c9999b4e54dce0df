"""Planning in one of many random mazes, in a process of its own."""

from __future__ import annotations

import time
from typing import Any

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.clock import now
from planners.planning import plan
from planners.rod_bound import rod_bound, rod_passes

__all__ = ["longest_in_maze", "plan_in_maze", "rod_in_maze", "warm_up"]

FINENESS = 0.005
"""Step of lengths, and accuracy of the bound that they start from."""

HALVINGS = 3
"""Between the longest step that passes and the next: to an eighth of a step."""

SHORTEST = 0.5
"""Length at which the scan gives up, in bounds."""

WARMED = ("beam", "as-printed", "sweep", "track", "follow")
"""Planners whose kernels are loaded before anything is timed."""


def warm_up() -> None:
    """Load the compiled kernels, by planning one motion with each of the planners that are timed."""
    maze = Maze.load("fig19")
    for planner in WARMED:
        plan(maze, ArmSpec(link_length=430.0), planner)
    rod_passes(maze, 430.0)


def plan_in_maze(name: str, link_length: float, planner: str, time_budget: float) -> dict[str, Any]:
    """Plan in a named maze, and check exactly what is found.

    Returns
    -------
    row : dict
        Task, status and planner, seconds from maze to validated motion, number of links and poses.
    """
    maze = Maze.load(name)
    start = time.perf_counter()
    result = plan(maze, ArmSpec(link_length=link_length), planner, time_budget=time_budget, explain=False)
    seconds = time.perf_counter() - start
    return {
        "task": [name, link_length, planner, time_budget],
        "maze": name,
        "link_length": link_length,
        "status": str(result.status),
        "planner": result.planner,
        "asked": [str(attempt) for attempt in result.attempts],
        "seconds": seconds,
        "n_links": None if result.motion is None else result.motion.n_links,
        "n_poses": None if result.motion is None else result.motion.n_poses,
    }


def rod_in_maze(name: str, length: float, seconds: float) -> dict[str, Any]:
    """Say whether a rod of the length of a link passes a named maze: yes, no (a proof), or undecided."""
    verdict = rod_passes(Maze.load(name), length, deadline=now() + seconds)
    return {"task": [name, length, seconds], "maze": name, "link_length": length, "rod": str(verdict.passes)}


def closed_in(maze: Maze, planner: str, time_budget: float, passes: float) -> float:
    """Close in, by halving, between a length that passes and the step above it that does not."""
    fails = passes / (1.0 - FINENESS)
    for _ in range(HALVINGS):
        middle = 0.5 * (passes + fails)
        arm = ArmSpec(link_length=middle)
        if plan(maze, arm, planner, time_budget=time_budget, explain=False).solved:
            passes = middle
        else:
            fails = middle
    return passes


def longest_in_maze(name: str, planner: str, time_budget: float) -> dict[str, Any]:
    """Try lengths from the longest rod's downwards until the planner has a valid motion.

    Returns
    -------
    row : dict
        Task, bounds, the longest link that passes (None if none of at least half the bound does), and how
        many lengths ran out of time before.
    """
    maze = Maze.load(name)
    start = time.perf_counter()
    bound = rod_bound(maze, accuracy=FINENESS, deadline=start + 30.0)
    length, longest, late, tried = bound.upper, None, 0, 0
    while longest is None and length > SHORTEST * bound.upper:
        arm = ArmSpec(link_length=length * (1.0 - 1e-9))  # just inside the feeder where that is the limit
        result = plan(maze, arm, planner, time_budget=time_budget, explain=False)
        tried, late = tried + 1, late + (result.status == "out of time")
        if result.solved:
            longest = length
        length *= 1.0 - FINENESS
    if longest is not None and longest < bound.upper:
        longest = closed_in(maze, planner, time_budget, longest)
    return {
        "task": [name, planner, time_budget],
        "maze": name,
        "lower": bound.lower,
        "upper": bound.upper,
        "limited_by": bound.limited_by,
        "longest": longest,
        "tried": tried,
        "late": late,
        "seconds": time.perf_counter() - start,
    }
