"""Mazes far from the origin: planners see them from the base, where coordinates are small.

Map coordinates are large (a room of some metres may lie millions of metres from the origin), and rounding is
then as large as what planners tell apart. Only such mazes are moved: all others are planned as they are.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from shapely.affinity import translate

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.problem import Failure, PlanningResult, ValidationReport

__all__ = ["moved_maze", "moved_report", "moved_result", "seen_from_base"]

FAR = 1e4
"""How far from the origin, in link lengths, a maze is planned as seen from its base."""


def seen_from_base(maze: Maze, link_length: float) -> tuple[Maze, FloatArray | None]:
    """Return a far maze as seen from its base, and the base; another maze as it is, and None."""
    origin: FloatArray = maze.base_pose[:2].copy()
    if np.abs(origin).max() <= FAR * link_length:
        return maze, None
    try:
        return moved_maze(maze, -origin), origin
    except InputError:  # rounding makes another maze of it
        return maze, None


def moved_maze(maze: Maze, way: FloatArray) -> Maze:
    """Return the same maze with everything in it moved by a vector, shape (2,)."""
    x, y, heading = maze.base_pose
    return dataclasses.replace(
        maze,
        free_space=translate(maze.free_space, *way),
        base_pose=np.array([x + way[0], y + way[1], heading]),
        goal=maze.goal + way,
    )


def moved_report(report: ValidationReport, way: FloatArray) -> ValidationReport:
    """Return a report with its places moved by a vector, shape (2,)."""
    faults = tuple(
        dataclasses.replace(fault, place=None if fault.place is None else _moved_place(fault.place, way))
        for fault in report.faults
    )
    return dataclasses.replace(report, faults=faults)


def moved_result(result: PlanningResult, way: FloatArray) -> PlanningResult:
    """Return a result with all places moved by a vector, shape (2,); a reason tells places from the base."""
    failure, reason = result.failure, result.reason
    motion: Any = None if result.motion is None else result.motion.moved(way)
    return dataclasses.replace(
        result,
        motion=motion,
        reason=f"{reason} Places in this text are as seen from the base." if reason else "",
        failure=None if failure is None else _moved_failure(failure, way),
        report=None if result.report is None else moved_report(result.report, way),
    )


def _moved_failure(failure: Failure, way: FloatArray) -> Failure:
    joints = None if failure.joints is None else failure.joints + way
    return dataclasses.replace(failure, place=_moved_place(failure.place, way), joints=joints)


def _moved_place(place: tuple[float, ...], way: FloatArray) -> tuple[float, ...]:
    return tuple((np.asarray(place) + way).tolist())
