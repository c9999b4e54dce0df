"""A study as a folder of finished cells, from which the next run goes on."""

from __future__ import annotations

import datetime
import importlib.metadata
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrsnake_env.errors import InputError
from hrsnake_env.files import locked, replacing, tidy
from planners.bench.cells import Cell, CellResult, Run
from planners.bench.engines import check_engine, over_cells
from planners.bench.methods import run_cell
from planners.bench.pool import bar
from planners.bench.records import machine, write_results
from planners.bench.rows import check_pyarrow, read_rows, sorted_rows, write_rows
from planners.reading import NotReadable, read_json, shown

__all__ = ["ROWS", "StudyRun", "remaining", "run_cells", "worst_hours"]

ROWS = "rows.parquet"
"""All rows of a study, in its folder."""

MANIFEST, CELLS = "manifest.json", "cells"

PACKAGES = ("hrsnake", "numpy", "numba", "gymnasium", "pymunk", "ompl", "stable-baselines3", "torch", "ray")
"""Whose versions stand in the manifest, as far as they are installed."""

STEPS_PER_SECOND = 1000.0
"""With which the time of trainings is estimated; they may end early."""


@dataclass(frozen=True, kw_only=True)
class StudyRun:
    """Say what a run has done.

    Parameters
    ----------
    out : Path
        The folder.
    cells, done : int
        Cells that were wanted, and those of them that are finished now.
    rows : int
        In the folder's `rows.parquet`, of other runs, too.
    errors : int
        Rows of the wanted cells whose status is an error.
    """

    out: Path
    cells: int
    done: int
    rows: int
    errors: int

    @property
    def complete(self) -> bool:
        """Whether every wanted cell is finished."""
        return self.done == self.cells


def run_cells(
    cells: Sequence[Cell],
    out: Path,
    *,
    run: Run = run_cell,
    engine: str = "processes",
    workers: int | None = None,
    address: str | None = None,
    retry_errors: bool = False,
    quiet: bool = False,
) -> StudyRun:
    """Do the cells that are not finished yet; Ctrl-C, or the end of the process, loses none that are.

    Each finished cell is a file in `cells/`, which appears as a whole or not at all. At the end all of them
    are merged into `rows.parquet`, sorted. A cell with another budget has another file; of two with the same
    study, task, method and seed the wanted one is merged, or else the one with the larger budget.

    Parameters
    ----------
    cells : sequence of Cell
        Of one study.
    out : Path
        The study's folder; made if missing.
    run : callable
        Does a cell; a function of a module.
    engine, workers, address
        See `planners.bench.engines.over_cells`.
    retry_errors : bool
        Do cells again that have ended with an error.
    quiet : bool
        Show no bar.

    Raises
    ------
    InputError
        If the folder holds another study, another process writes in it, or a package that the engine or the
        files need is missing.
    """
    check_engine(engine, workers, address)
    check_pyarrow()
    out.mkdir(parents=True, exist_ok=True)
    with locked(out):
        return _run_cells(cells, out, run, engine, workers, address, retry_errors, quiet)


def _run_cells(
    cells: Sequence[Cell],
    out: Path,
    run: Run,
    engine: str,
    workers: int | None,
    address: str | None,
    retry_errors: bool,
    quiet: bool,
) -> StudyRun:
    """Do the cells in a folder that is this process's alone."""
    folder = _opened(cells[0].study, out)
    left = remaining(cells, out, retry_errors=retry_errors)
    if left:
        _note(out, cells[0].study, engine, workers)
        with bar(cells[0].study, len(left), quiet) as tell:
            done = over_cells(left, run, engine=engine, workers=workers, address=address)
            try:
                for cell, result in done:
                    _keep(cell, result, folder)
                    tell()
            except KeyboardInterrupt:
                pass
            finally:
                done.close()
    rows = _merged(cells, folder)
    write_rows(rows, out / ROWS)
    keys = {cell.identity for cell in cells}
    mine = [row for row in rows if _identity(row) in keys]
    return StudyRun(
        out=out,
        cells=len(cells),
        done=len(cells) - len(remaining(cells, out)),
        rows=len(rows),
        errors=sum(row["status"].startswith("error") for row in mine),
    )


def remaining(cells: Sequence[Cell], out: Path, *, retry_errors: bool = False) -> list[Cell]:
    """Return the cells that are not finished in a folder; with `retry_errors`, those with an error, too."""
    left = []
    for cell in cells:
        path = _path(cell, out / CELLS)
        if not path.exists() or (
            retry_errors and any(row["status"].startswith("error") for row in read_rows(path))
        ):
            left.append(cell)
    return left


def worst_hours(cells: Sequence[Cell], workers: int | None = None) -> float:
    """Return how long cells take at most, about: every query all its budget, every training all its steps."""
    seconds = sum(
        cell.budget / STEPS_PER_SECOND if cell.most_seconds is None else cell.most_seconds for cell in cells
    )
    return seconds / 3600.0 / (workers or os.cpu_count() or 1)


def _opened(study: str, out: Path) -> Path:
    """Make the folder, refuse another study's, and take away what a killed run has half written."""
    folder = out / CELLS
    try:
        manifest = read_json(out / MANIFEST)
        known, _ = manifest["study"], list(manifest["runs"])
    except FileNotFoundError:
        known = study
    except (NotReadable, KeyError, TypeError):
        raise InputError(f"Expected the manifest of a study in '{out}', got something else.") from None
    if known != study:
        raise InputError(f"Expected a folder for the study '{study}', but '{out}' holds {shown(known)}.")
    folder.mkdir(exist_ok=True)
    tidy(out)
    tidy(folder)
    return folder


def _keep(cell: Cell, result: CellResult, folder: Path) -> None:
    """Write a cell's files, and then its rows: with these it is finished."""
    path = _path(cell, folder)
    for ending, data in result.files.items():
        with replacing(path.with_suffix(ending)) as part:
            part.write_bytes(data)
    write_rows(sorted_rows(result.rows), path)


def _path(cell: Cell, folder: Path) -> Path:
    return folder / f"{cell.key}.parquet"


def _identity(row: Any) -> tuple[Any, ...]:
    return row["study"], row["task"], row["method"], row["seed"]


def _merged(cells: Sequence[Cell], folder: Path) -> list[Any]:
    """Return the rows of all finished cells, sorted; of the same work only one cell's."""
    wanted = {_path(cell, folder).name for cell in cells}
    best: dict[tuple[Any, ...], tuple[tuple[Any, ...], list[dict[str, Any]]]] = {}
    for path in sorted(folder.glob("[!.]*.parquet")):
        rows = read_rows(path)
        if rows:
            rank = (path.name in wanted, rows[0]["budget"], len(rows), path.name)
            key = _identity(rows[0])
            if key not in best or rank > best[key][0]:
                best[key] = (rank, rows)
    return sorted_rows(row for _, rows in best.values() for row in rows)


def _note(out: Path, study: str, engine: str, workers: int | None) -> None:
    """Add this run to the manifest: when, on which machine, with what."""
    path = out / MANIFEST
    runs = read_json(path)["runs"] if path.exists() else []
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    this = {
        "started": now,
        "engine": engine,
        "workers": workers or os.cpu_count(),
        "machine": machine(),
        "versions": _versions(),
    }
    write_results({"study": study, "runs": [*runs, this]}, path)


def _versions() -> dict[str, str]:
    versions = {}
    for name in PACKAGES:
        try:
            versions[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return versions
