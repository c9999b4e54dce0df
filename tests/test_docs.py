"""What the pages in docs/ name is there."""

import json
import re
from pathlib import Path

import pytest

from hrsnake_env.arm import ArmSpec
from planners.spatial import Workspace, plan

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda path: path.name)
def test_files_that_a_page_names_are_there(page):
    text = page.read_text()
    for name in re.findall(r"\]\(([^):#]+)\)", text):
        assert (page.parent / name).exists(), name
    for name in re.findall(r"`((?:docs|hrsnake_env|planners|benchmarks)/[\w/.]+)`", text):
        assert (DOCS.parent / name).exists(), name


def test_the_lines_about_space_run_and_the_file_is_a_workspace(capsys):
    text = (DOCS / "spatial.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    exec(compile(code, "spatial.md", "exec"), {})
    assert capsys.readouterr().out.startswith("solved SpatialMotion(")
    (file,) = re.findall(r"```json\n(.*?)```", text, flags=re.DOTALL)
    workspace = Workspace.from_dict(json.loads(file))
    assert plan(workspace, ArmSpec(link_length=35.0)).solved
