"""Execute the notebooks, and write them with their figures to `notebooks/build/`.

`make notebooks` executes all of them; `.venv/bin/python docs/execute_notebooks.py 01` those whose names begin
with 01. They open in Jupyter, VS Code or any other viewer of .ipynb files. The notebooks themselves are text,
`notebooks/*.py`: Jupyter opens them with jupytext as notebooks, and Python runs them as they are.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import jupytext
import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode
from traitlets.config import Config

from hrsnake_env.files import replacing

ROOT = Path(__file__).parent.parent
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.py"))
BUILD = ROOT / "notebooks" / "build"
SECONDS_PER_CELL = 120


def execute(path: Path) -> NotebookNode:
    """Execute a notebook from top to bottom with the running interpreter, and return it with its outputs.

    Raises
    ------
    CellExecutionError
        If a cell does; its text has the cell and the traceback.
    """
    notebook = jupytext.read(path)
    with TemporaryDirectory() as folder:
        settings = {
            # Of no folder, so that `python3` is this interpreter, whatever kernels the user has installed.
            "KernelSpecManager": {"kernel_dirs": []},
            # Sockets are files that only this user can open; Windows has none.
            "KernelManager": {
                "transport": "tcp" if os.name == "nt" else "ipc",
                "connection_file": str(Path(folder, "kernel.json")),
            },
        }
        client = NotebookClient(
            notebook,
            config=Config(settings),
            timeout=SECONDS_PER_CELL,
            resources={"metadata": {"path": str(ROOT)}},
        )
        # Of its own, so that the user's start-up files have no say.
        client.execute(env={**os.environ, "IPYTHONDIR": folder})
    return notebook


def figures(notebook: NotebookNode) -> list[str]:
    """Return the pictures in a notebook's outputs: PNG files, in base64."""
    return [
        output.data["image/png"]
        for cell in notebook.cells
        for output in cell.get("outputs", ())
        if "image/png" in output.get("data", ())
    ]


def main(beginnings: list[str]) -> None:
    """Execute the notebooks whose names begin as said, by default all, and write them."""
    chosen = [path for path in NOTEBOOKS if path.name.startswith(tuple(beginnings or [""]))]
    if not chosen:
        sys.exit(f"No notebook's name begins with {' or '.join(beginnings)}; there are: " + names(NOTEBOOKS))
    BUILD.mkdir(exist_ok=True)
    for number, path in enumerate(chosen, 1):
        print(f"[{number}/{len(chosen)}] {path.relative_to(ROOT)} ... ", end="", flush=True)
        start = time.perf_counter()
        notebook = execute(path)
        out = BUILD / f"{path.stem}.ipynb"
        with replacing(out) as part:
            nbformat.write(notebook, part)
        count, seconds = len(figures(notebook)), time.perf_counter() - start
        print(f"{count} figures, {seconds:.1f} s: {out.relative_to(ROOT)}", flush=True)


def names(paths: list[Path]) -> str:
    """Join the names of notebooks."""
    return ", ".join(path.stem for path in paths)


if __name__ == "__main__":
    main(sys.argv[1:])
