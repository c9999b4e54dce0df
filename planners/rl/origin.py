"""Where a trained policy comes from, as its file says."""

from __future__ import annotations

import importlib.metadata
from dataclasses import dataclass, field, fields
from typing import Any

from hrsnake_env.arguments import is_number
from hrsnake_env.errors import InputError
from planners.reading import shown
from planners.rl.environments import Wrappers

__all__ = ["Origin"]

KINDS: dict[str, type] = {
    "method": str,
    "env_id": str,
    "env_kwargs": dict,
    "wrappers": list,
    "seed": int,
    "train_steps": int,
    "versions": dict,
}
"""What a file holds for each."""

MOST_WRAPPERS = 20

LARGEST = {
    "image_size": 4096,
    "max_episode_steps": 1_000_000,
    "n_links": 2000,
    "repeat": 1000,
    "substeps": 1000,
    "success_hold_steps": 1_000_000,
}
"""Arguments in a file with which somebody else could let an environment take all memory, or all time."""

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

    @classmethod
    def from_dict(cls, data: Any) -> Origin:
        """Build an origin from what `dataclasses.asdict` returned, as a policy's file holds it.

        Raises
        ------
        InputError
            If something is missing, unknown or of another kind.
        """
        if not isinstance(data, dict):
            raise InputError(f"Expected the origin of a policy by name, got {shown(data)}.")
        for each in fields(cls):
            kind = KINDS[each.name]
            if not isinstance(data.get(each.name), kind) or isinstance(data[each.name], bool):
                raise InputError(f"Expected the {each.name} of a policy, got {shown(data.get(each.name))}.")
        if unknown := [key for key in data if key not in KINDS]:
            raise InputError(
                f"Unknown origin {shown(unknown[0])} of a policy. Available: {', '.join(KINDS)}."
            )
        if len(data["wrappers"]) > MOST_WRAPPERS:
            raise InputError(f"Expected at most {MOST_WRAPPERS} wrappers, got {len(data['wrappers'])}.")
        for pair in data["wrappers"]:
            named = isinstance(pair, list) and len(pair) == 2 and isinstance(pair[0], str)
            if not named or not isinstance(pair[1], dict):
                raise InputError(f"Expected wrappers of a policy as names with arguments, got {shown(pair)}.")
        for arguments in (data["env_kwargs"], *(kwargs for _, kwargs in data["wrappers"])):
            for key, most in LARGEST.items():
                if is_number(value := arguments.get(key)) and value > most:
                    raise InputError(f"Expected {key} of at most {most} for a policy, got {shown(value)}.")
        return cls(**{**data, "wrappers": tuple((name, kwargs) for name, kwargs in data["wrappers"])})

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
