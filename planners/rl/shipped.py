"""The trained policies that come with the package, by name."""

from __future__ import annotations

from pathlib import Path

__all__ = ["POLICIES", "policy_path"]

POLICIES: dict[str, Path] = {
    path.stem: path for path in sorted((Path(__file__).parent / "policies").glob("*.npz"))
}
"""Named after the rung of the ladder and the method, as `u-turn-i60-ppo-planned`."""


def policy_path(name_or_path: str) -> Path:
    """Return the file of a policy that comes with the package, or the path as it is."""
    return POLICIES.get(name_or_path, Path(name_or_path))
