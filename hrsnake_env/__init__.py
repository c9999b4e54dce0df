"""The world: an arm of rigid links, mazes, and the Gymnasium environment `HyperRedundantMaze-v0`."""

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.ladder import LADDER
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import MAZES
from hrsnake_env.registration import ENVIRONMENTS, register_environments

__all__ = ["ENVIRONMENTS", "LADDER", "MAZES", "ArmSpec", "InputError", "Maze"]

register_environments()
