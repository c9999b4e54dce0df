"""A motion in the simulator, from its first pose to its last, and the verdict."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import ArmSpec
from hrsnake_env.contacts import PinchReport
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.physics import Physics

__all__ = ["simulate"]


def simulate(
    maze: Maze,
    arm: ArmSpec,
    feed: ArrayLike,
    joint_angles: ArrayLike,
    *,
    substeps: int = 4,
    kinematic: bool = False,
    torque_limit: float | None = None,
    actuation: str = "computed_torque",
) -> PinchReport:
    """Run the poses of a motion through the simulator, and say whether links merely pinched the walls.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        The arm; its number of links is that of `joint_angles`.
    feed : array-like, shape (n_poses,)
        In maze units.
    joint_angles : array-like, shape (n_poses, n_links)
        In rad.
    substeps, torque_limit, actuation
        As `Physics` has them.
    kinematic : bool
        Run the exact pass alone. By default the report is of the dynamic run, and holds the exact pass.

    Returns
    -------
    report : PinchReport
    """
    feeds, angles = np.asarray(feed, dtype=np.float64), np.asarray(joint_angles, dtype=np.float64)
    if angles.ndim != 2 or feeds.shape != angles.shape[:1] or len(feeds) == 0:
        raise InputError(
            f"Expected feed with shape (n_poses,) and joint_angles with shape (n_poses, n_links), "
            f"got {feeds.shape} and {angles.shape}."
        )
    arm = dataclasses.replace(arm, n_links=angles.shape[1])
    physics = Physics(
        maze,
        arm,
        substeps=substeps,
        kinematic=kinematic,
        torque_limit=torque_limit,
        actuation=actuation,
    )
    physics.reset(feeds[0], angles[0])
    for k in range(1, len(feeds)):
        physics.advance(feeds[k], angles[k])
    physics.settle()
    report = physics.report()
    if kinematic:
        return report
    exact = simulate(maze, arm, feeds, angles, substeps=substeps, kinematic=True)
    return dataclasses.replace(report, kinematic=exact)
