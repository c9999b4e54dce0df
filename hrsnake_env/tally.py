"""The count of an episode: what has happened in the last step, and since the reset."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

from hrsnake_env.contacts import Contact

__all__ = ["Tally"]


def _no_reward() -> dict[str, float]:
    return {"reward_progress": 0.0, "reward_contact": 0.0, "reward_goal": 0.0}


@dataclass(slots=True)
class Tally:
    """Count what happens in an episode; lengths are in maze units.

    Parameters
    ----------
    distance : float
        From the tip to the goal, round the walls.
    tip_distance : float
        The same, straight.
    steps_at_goal : int
        So many steps in a row the tip has been at the goal.
    """

    distance: float
    tip_distance: float = 0.0
    steps_at_goal: int = 0
    succeeded: bool = False
    collided: bool = False
    pinches: int = 0
    collisions: int = 0
    depth: float = 0.0
    impulse: float = 0.0
    terms: dict[str, float] = field(default_factory=_no_reward)
    steps: int = 0
    total_reward: float = 0.0
    total_pinches: int = 0
    total_collisions: int = 0
    worst_depth: float = 0.0
    worst_impulse: float = 0.0

    def see(self, contacts: tuple[Contact, ...]) -> None:
        """Take over the contacts of a step."""
        self.pinches = self.collisions = 0
        self.depth = self.impulse = 0.0
        if contacts:
            self.pinches = len({contact.link for contact in contacts if contact.kind == "pinch"})
            self.collisions = len({contact.link for contact in contacts if contact.kind == "collision"})
            self.depth = max(0.0, *(-contact.clearance for contact in contacts), 0.0)
            self.impulse = max(contact.impulse for contact in contacts)
        self.collided = self.collisions > 0
        self.total_pinches += self.pinches
        self.total_collisions += self.collisions
        self.worst_depth = max(self.worst_depth, self.depth)
        self.worst_impulse = max(self.worst_impulse, self.impulse)

    def reward(self, terms: dict[str, float]) -> float:
        """Take over the terms of a step's reward; return their sum."""
        self.terms = terms
        total = sum(terms.values())
        self.steps += 1
        self.total_reward += total
        return total

    def copy(self) -> Tally:
        """Return a count that goes on by itself."""
        return dataclasses.replace(self, terms=dict(self.terms))
