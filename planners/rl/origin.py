"""Where a trained policy comes from, as its file says."""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass, field
from typing import Any

from planners.rl.environments import Wrappers

__all__ = ["Origin"]

PACKAGES = ("hrsnake", "numpy", "gymnasium", "stable-baselines3", "sb3-contrib", "torch")


@dataclass(frozen=True, kw_only=True)
class Origin:
    """Say where a policy comes from, and what it acts in.

    Parameters
    ----------
    method : str
        What it was trained by.
    env_id : str
        In which environment.
    env_kwargs : dict
        For `gymnasium.make`.
    wrappers : tuple of (name, arguments)
        That it acts through, innermost first.
    seed, train_steps : int
        Of the training.
    versions : dict
        Of the packages that trained it.
    """

    method: str
    env_id: str
    env_kwargs: dict[str, Any] = field(default_factory=dict)
    wrappers: Wrappers = ()
    seed: int = 0
    train_steps: int = 0
    versions: dict[str, str] = field(default_factory=dict)

    @staticmethod
    def installed_versions() -> dict[str, str]:
        """Return the versions of the packages that matter here, as far as they are installed."""
        versions = {}
        for name in PACKAGES:
            try:
                versions[name] = importlib.metadata.version(name)
            except importlib.metadata.PackageNotFoundError:
                continue
        return versions
