"""Where the figures of the campaigns go, and with which versions they were found."""

from __future__ import annotations

import json
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hrsnake_env.files import replacing

FOLDER = Path(__file__).parent.parent / "results" / "trust"
PACKAGES = ("numpy", "scipy", "shapely", "numba", "gymnasium", "pymunk")


def write_results(name: str, figures: dict[str, Any]) -> Path:
    """Write a campaign's figures, whole or not at all; return the file."""
    path = FOLDER / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    versions = {"python": platform.python_version(), **{package: version(package) for package in PACKAGES}}
    with replacing(path) as file:
        file.write_text(json.dumps({**figures, "versions": versions}, indent=1) + "\n", encoding="utf-8")
    return path
