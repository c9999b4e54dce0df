"""Tables in Markdown, and what stands in those of spaces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

__all__ = ["as_table", "bounds", "span"]


def span(start: int, stop: int) -> str:
    """Return a range of indices in words; `stop` is not in it."""
    return f"{start}" if stop == start + 1 else f"{start}\u00a0to\u00a0{stop - 1}"


def bounds(space: gym.spaces.Space[Any], start: int, stop: int) -> tuple[str, str]:
    """Return least and largest value of a range of a box, which are the same in all of it."""
    assert isinstance(space, gym.spaces.Box)
    low, high = (np.unique(values[start:stop]).tolist() for values in (space.low, space.high))
    assert len(low) == len(high) == 1
    return f"{low[0]:g}", f"{high[0]:g}"


def as_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
