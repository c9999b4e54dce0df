"""The world: an arm of rigid links, mazes, and the Gymnasium environment `HyperRedundantMaze-v0`."""

import gymnasium

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.ladder import LADDER
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import MAZES
from hrsnake_env.random_mazes import random_maze, task_maze

__all__ = ["LADDER", "MAZES", "ArmSpec", "InputError", "Maze", "random_maze", "task_maze"]

ENVIRONMENTS = {
    "HyperRedundantMaze-v0": {
        "entry_point": "hrsnake_env.env:HyperRedundantMazeEnv",
        "max_episode_steps": 10_000,
    },
}
"""Every registered environment: id and arguments of `gymnasium.register`."""

for _id, _arguments in ENVIRONMENTS.items():
    if _id not in gymnasium.registry:  # imported twice, as worker processes may do, it stays as it is
        gymnasium.register(id=_id, **_arguments)  # type: ignore[arg-type]
