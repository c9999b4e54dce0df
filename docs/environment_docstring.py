"""The docstring of the environment, taken apart: sections, the rows of their tables, arguments."""

from __future__ import annotations

import inspect
import re

from hrsnake_env.env import HyperRedundantMazeEnv

__all__ = ["arguments", "lead", "paragraphs", "section", "table"]

DOC = inspect.cleandoc(HyperRedundantMazeEnv.__doc__ or "")
LEAD, *SECTIONS = re.split(r"^## (.+)\n", DOC, flags=re.MULTILINE)
BY_TITLE = dict(zip(SECTIONS[::2], (text.strip() for text in SECTIONS[1::2]), strict=True))
UNDERLINED = r"^(\w+)\n-+\n"


def lead() -> str:
    """Return what stands before the first section."""
    return LEAD.strip()


def section(title: str) -> str:
    """Return the text of a section, such as `Rewards`; headings of NumPy's form become bold."""
    return re.sub(UNDERLINED, r"**\1**\n\n", BY_TITLE[title], flags=re.MULTILINE)


def paragraphs(title: str) -> list[str]:
    """Return the paragraphs of a section that are no tables."""
    return [text for text in section(title).split("\n\n") if not text.startswith("|")]


def table(title: str) -> list[list[str]]:
    """Return the cells of a section's table, row by row, the heading first and without the rule below it."""
    rows = [line for line in section(title).splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows]
    return [cells[0], *cells[2:]]


def arguments() -> dict[str, tuple[str, str]]:
    """Return type and meaning of every argument, by name."""
    _, *blocks = re.split(UNDERLINED, BY_TITLE["Arguments"], flags=re.MULTILINE)
    block = dict(zip(blocks[::2], blocks[1::2], strict=True))["Parameters"]
    entries = re.findall(r"^(\w+) : (.+)\n((?:    .+\n?)+)", block, flags=re.MULTILINE)
    return {name: (kind, " ".join(text.split())) for name, kind, text in entries}
