"""What the pages in docs/ name is there."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda path: path.name)
def test_files_that_a_page_names_are_there(page):
    text = page.read_text()
    for name in re.findall(r"\]\(([^):#]+)\)", text):
        assert (page.parent / name).exists(), name
    for name in re.findall(r"`((?:docs|hrsnake_env|planners|benchmarks)/[\w/.]+)`", text):
        assert (DOCS.parent / name).exists(), name
