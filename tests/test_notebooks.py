"""The notebooks run from top to bottom, and show what they say."""

import base64
import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
RUNNER = runpy.run_path(str(ROOT / "docs" / "execute_notebooks.py"))
NOTEBOOKS = RUNNER["NOTEBOOKS"]


def outputs(notebook):
    return [output for cell in notebook.cells for output in cell.get("outputs", ())]


def title_of(path):
    return next(line for line in path.read_text().splitlines() if line.startswith("# # ")).removeprefix(
        "# # "
    )


def row_of(path):
    """Return what stands in front of the notebook's name in the index."""
    lines = (ROOT / "notebooks" / "README.md").read_text().splitlines()
    return next(line for line in lines if f"[{path.stem}]({path.name})" in line).split("|")[1]


def figures_in(text):
    """Return the paper's figures that a title or the index names, a range with all between its ends."""
    numbers = [int(number) for number in re.findall(r"\d+", text)]
    return list(range(numbers[0], numbers[-1] + 1)) if numbers and " to " in text else numbers


def test_there_are_notebooks():
    assert NOTEBOOKS


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_without_a_warning_and_draws_figures(path):
    notebook = RUNNER["execute"](path)  # raises what a cell raises
    # Warnings are written there.
    assert not [output.text for output in outputs(notebook) if output.get("name") == "stderr"]
    pictures = [base64.b64decode(picture) for picture in RUNNER["figures"](notebook)]
    assert pictures and all(picture.startswith(b"\x89PNG") and len(picture) > 5000 for picture in pictures)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_index_names_every_notebook_with_its_figures(path):
    assert figures_in(row_of(path)) == figures_in(title_of(path).partition(":")[0])


def test_every_figure_of_the_paper_is_in_a_notebook():
    assert sorted(figure for path in NOTEBOOKS for figure in figures_in(row_of(path))) == list(range(1, 23))


def test_a_cell_that_fails_fails_the_notebook(tmp_path):
    failing = tmp_path / "failing.py"
    failing.write_text("# %%\nimport numpy as np\n\n# %%\nassert np.pi > 4, 'not that large'\n")
    with pytest.raises(Exception, match="not that large"):
        RUNNER["execute"](failing)


def test_a_name_that_no_notebook_has_is_refused():
    with pytest.raises(SystemExit, match="there are: 00_quick_start"):
        RUNNER["main"](["99"])
