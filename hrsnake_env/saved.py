"""Where a simulation stands, to go back to it exactly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hrsnake_env.arm import FloatArray
from hrsnake_env.contacts import ContactLog

__all__ = ["Move", "PhysicsState", "SimulationStart"]


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulationStart:
    """Hold a simulation whose solver remembers nothing: of a reset, or of a canonical snapshot.

    In simulator units; `n_active` links have been in the maze in this pose, and `past_link_poses` counts
    those of the poses before.
    """

    links: FloatArray
    target: FloatArray
    last_target: FloatArray
    touched: FloatArray
    effort: FloatArray
    n_efforts: int
    tracking: FloatArray
    pose: int
    n_held: int
    n_active: int
    past_link_poses: int
    log: ContactLog


Move = tuple[Literal["advance", "take_back", "settle"], FloatArray | None]


@dataclass(frozen=True, eq=False, kw_only=True)
class PhysicsState:
    """Hold where a simulation stands, for `Physics.set_state`: where it started, and every move since.

    The solver remembers impulses that pymunk does not tell of, so a state repeats the moves since the reset,
    or since the last `Physics.snapshot`, and so is exact to the last bit.
    """

    start: SimulationStart
    moves: tuple[Move, ...]
