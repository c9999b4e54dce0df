"""What the pages in docs/ name is there."""

import json
import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from hrsnake_env.arm import ArmSpec
from planners.cli import main
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


SHOWN = re.compile(r"^\$ (hrsnake (?:.*\\\n)*.*)\n((?:(?!\$ ).*\n)*)", flags=re.MULTILINE)


def agrees(shown, printed):
    """Return the first line that is shown but was not printed, in this order; `...` stands for anything."""
    rest = [" ".join(line.split()) for line in printed.splitlines()]
    for line in filter(None, (" ".join(line.split()) for line in shown.splitlines())):
        pattern = re.compile(".*".join(map(re.escape, line.split("..."))) + r"\Z")
        found = next((k for k, one in enumerate(rest) if pattern.match(one)), None)
        if found is None:
            return line
        rest = rest[found + 1 :]
    return None


def test_what_is_shown_is_compared_line_by_line():
    assert agrees("a b\n...\nd 1.5 ...", "a   b\nc\nd 1.5 s\n") is None
    assert agrees("b\na", "a\nb") == "a"
    assert agrees("a", "ab") == "a"


CONSOLE = [page for page in sorted(DOCS.glob("*.md")) if "```console\n$ hrsnake" in page.read_text()]


@pytest.mark.parametrize("page", CONSOLE, ids=lambda path: path.name)
def test_the_commands_of_a_page_run_and_print_what_is_shown(page, tmp_path, monkeypatch, capsys):
    shutil.copytree(DOCS / "maps", tmp_path / "docs" / "maps")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "110")
    blocks = re.findall(r"```console\n(.*?)```", page.read_text(), flags=re.DOTALL)
    commands = [command for block in blocks for command in SHOWN.findall(block)]
    assert commands
    for command, shown in commands:
        words = shlex.split(command.replace("\\\n", " "), comments=True)
        monkeypatch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        assert agrees(shown, printed.out + printed.err) is None, (command, printed)
        refused = re.search(r"# exit code (\d)$", command)
        assert (ended.value.code or 0) == (int(refused[1]) if refused else 0), command
