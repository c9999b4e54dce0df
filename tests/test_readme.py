"""The README's lines run, and what it names is there."""

import re
from pathlib import Path

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text()


def test_the_readmes_lines_run(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out
    assert printed.startswith("solved Motion(") and printed.endswith("True True\n")


def test_files_that_the_readme_names_are_there():
    linked = re.findall(r"\]\(([^):#]+)\)", TEXT)
    named = re.findall(r"`((?:hrsnake_env|planners|benchmarks)/[\w/.]*)`", TEXT)
    assert len(linked) >= 2 and len(named) >= 8
    for name in linked + named:
        assert (ROOT / name).exists(), name


def test_targets_that_the_readme_names_are_in_the_makefile():
    makefile = (ROOT / "Makefile").read_text()
    targets = set(re.findall(r"^    make (\w+)", TEXT, flags=re.MULTILINE))
    assert targets == {"demo", "test"}
    assert all(f"\n{target}:" in makefile for target in targets)
