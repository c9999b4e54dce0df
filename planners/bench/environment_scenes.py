"""The arms and the hall in which the environment's speed is measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.arm import FloatArray
from hrsnake_env.maze import Maze

__all__ = ["ENV_ID", "N_WALLS", "REACH", "arm_in_hall", "half_out", "hall"]

ENV_ID = "hrsnake_env:HyperRedundantMaze-v0"

N_WALLS = 40
"""Wall segments of the hall: four, and four of each pillar."""

REACH = 1200.0
"""Length of all arms in the hall, whatever the number of their links, in px."""

LENGTH, WIDTH = 1300.0, 700.0
"""Of the hall, in px."""

BASE = 5.0
LANE = 25.0
"""No pillar is so near to the arm as it stands, half out; from there it goes anywhere."""

APART = 25.0
"""Pillars are so far from each other and from the walls, at least."""


def hall(seed: int = 0) -> Maze:
    """Build a hall with `N_WALLS` wall segments: square pillars on both sides of the arm's way in.

    Parameters
    ----------
    seed : int
        From which pillars are drawn.
    """
    rng = np.random.default_rng(seed)
    goal = np.array([LENGTH - 60.0, 0.4 * WIDTH])
    room = box(0.0, -0.5 * WIDTH, LENGTH, 0.5 * WIDTH)
    kept = [LineString([(0.0, 0.0), (BASE + 0.5 * REACH, 0.0)]).buffer(LANE), Point(goal).buffer(50.0)]
    pillars: list[Polygon] = []
    while len(pillars) < N_WALLS // 4 - 1:
        pillar = Polygon(_square(rng))
        if room.buffer(-APART).contains(pillar) and all(pillar.distance(other) > 0.0 for other in kept):
            pillars.append(pillar)
            kept.append(pillar.buffer(APART))
    return Maze(
        name=f"hall-{seed}",
        free_space=Polygon(room.exterior, [pillar.exterior for pillar in pillars]),
        base_pose=np.array([BASE, 0.0, 0.0]),
        goal=goal,
        goal_radius=20.0,
    )


def _square(rng: np.random.Generator) -> FloatArray:
    place = rng.uniform((0.0, -0.5 * WIDTH), (0.8 * LENGTH, 0.5 * WIDTH))
    angles = rng.uniform(0.0, 2.0 * np.pi) + np.arange(4) * 0.5 * np.pi
    corners: FloatArray = place + rng.uniform(50.0, 80.0) * np.column_stack([np.cos(angles), np.sin(angles)])
    return corners


def arm_in_hall(n_links: int, maze: Maze | Path, substeps: int = 4) -> dict[str, Any]:
    """Return the arguments for `gym.make` of an arm in the hall that goes on after collisions."""
    return {
        "maze": str(maze) if isinstance(maze, Path) else maze,
        "link_length": REACH / n_links,
        "n_links": n_links,
        "substeps": substeps,
        "terminate_on_collision": False,
        "max_episode_steps": 1000,
    }


def half_out() -> dict[str, Any]:
    """Return the options for `reset` that start with the arm half out of the feeder."""
    return {"feed": 0.5 * REACH}
