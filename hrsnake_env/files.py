"""Writing files completely or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["replacing"]


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it takes the place of `path` when the block ends well.

    If the block is left by an exception, Ctrl-C included, `path` stays as it was, with nothing beside it.
    """
    target = Path(path)
    part = target.with_name(f"{target.stem}.part{target.suffix}")  # libraries tell the format by the ending
    try:
        yield part
        part.replace(target)
    finally:
        part.unlink(missing_ok=True)
