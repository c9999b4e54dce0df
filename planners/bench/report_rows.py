"""The rows that a report is made of: read from Parquet, checked, and grouped."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from hrsnake_env.errors import InputError
from hrsnake_env.ladder import LADDER
from planners.bench.campaign import MANIFEST, ROWS
from planners.bench.rows import COLUMNS, check_size
from planners.reading import NotReadable, read_json

__all__ = [
    "METHODS",
    "OURS",
    "RANDOM",
    "grouped",
    "index_of",
    "is_learner",
    "is_shown",
    "ladder_order",
    "links_of",
    "machines",
    "methods_of",
    "of_study",
    "read_rows",
    "succeeded",
    "time_limit",
    "typical_seconds",
]

NEVER_NULL = ("study", "method", "task", "shape", "maze", "index", "seed", "episode", "actions", "solved")

KEY = ("study", "method", "task", "seed", "actions", "episode")
"""No two rows are alike in all of these."""

OURS = ("auto", "track", "sweep")
"""Our planners; the first one that was measured stands for us."""

METHODS = (
    *OURS,
    *("beam", "as-printed"),
    *("follow", "outer-wall", "b-spline", "backbone", "virtual-torque", "pseudo-inverse"),
    *("rrt-connect", "aorrtc"),
    *("ppo", "ppo-planned", "ppo-residual", "sac", "tqc", "tqc-her", "clone", "dagger", "random"),
)
"""The order in which methods are shown; others come after them."""

RANDOM = "random"
"""The policy that draws its actions evenly: the zero of scores."""

OUT_OF_TIME = "out of time"

Row = Mapping[str, Any]
Key = TypeVar("Key", bound=Hashable)


def read_rows(folders: Sequence[Path]) -> list[Row]:
    """Read the rows of some studies.

    Parameters
    ----------
    folders : sequence of Path
        Each with a `rows.parquet`.

    Returns
    -------
    rows : list of mapping
        One per episode, keys as in `COLUMNS`; None where nothing was measured.

    Raises
    ------
    InputError
        If there are no rows, a file cannot be read, a column is missing or of another type, or a run is there
        twice.
    """
    if not folders:
        raise InputError("Expected at least one folder with results, got none.")
    rows: list[Row] = []
    for folder in folders:
        rows += _read(folder / ROWS)
    if not rows:
        raise InputError(f"Expected at least one row, got none in {', '.join(map(str, folders))}.")
    for key, alike in grouped(rows, lambda row: tuple(row[name] for name in KEY)).items():
        if len(alike) > 1:
            named = ", ".join(f"{name} {value}" for name, value in zip(KEY, key, strict=True))
            raise InputError(f"Expected every run once, got {len(alike)} rows with {named}.")
    return rows


def _read(path: Path) -> list[Row]:
    """Read one file."""
    try:
        pyarrow, parquet = (importlib.import_module(name) for name in ("pyarrow", "pyarrow.parquet"))
    except ImportError:
        raise InputError(
            "Expected pyarrow to be installed, to read results: pip install 'hrsnake[bench]'."
        ) from None
    if not path.is_file():
        raise InputError(f"Expected a folder with {ROWS}, as a study writes it, but there is no '{path}'.")
    try:
        # Without Arrow's threads, as `rows.read_rows` has it.
        file = parquet.ParquetFile(pyarrow.BufferReader(path.read_bytes()))
        check_size(file.metadata)
        table = file.read(use_threads=False)
    except Exception as error:  # Arrow raises whatever its parsers stumble over
        raise InputError(f"Expected a Parquet file, but '{path}' is none: {error}.") from None
    if missing := [name for name in COLUMNS if name not in table.column_names]:
        raise InputError(f"Expected rows of a study, but '{path}' has no column {', '.join(missing)}.")
    schema = pyarrow.schema(
        [(name, pyarrow.type_for_alias(alias), name not in NEVER_NULL) for name, alias in COLUMNS.items()]
    )
    try:
        rows: list[Row] = table.select(list(COLUMNS)).cast(schema).to_pylist()
    except Exception as error:
        raise InputError(f"Expected columns of the types of a study in '{path}', got: {error}.") from None
    return rows


def machines(folders: Sequence[Path]) -> list[str]:
    """Say on which machines studies were run, as far as their manifests tell it."""
    found: dict[str, None] = {}
    for folder in folders:
        try:
            for run in read_json(folder / MANIFEST)["runs"]:
                machine = run["machine"]
                named = f"{machine['cores']} cores of {machine['processor']}"
                found[f"{named}, Python {machine['python']}, {run['workers']} at a time"] = None
        except (OSError, NotReadable, KeyError, TypeError):
            continue  # it only adds to what the rows tell
    return list(found)


def grouped(rows: Iterable[Row], key: Callable[[Row], Key]) -> dict[Key, list[Row]]:
    """Sort rows into groups, in the order in which these turn up."""
    groups: dict[Key, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def of_study(rows: Iterable[Row], study: str) -> list[Row]:
    """Return the rows of a study."""
    return [row for row in rows if row["study"] == study]


def is_learner(row: Row) -> bool:
    """Tell whether a policy ran, not a planner."""
    return bool(row["actions"] != "planned")


def is_shown(row: Row) -> bool:
    """Tell whether a row is in charts, which show learners with deterministic actions alone."""
    return bool(row["actions"] != "sampled" or row["method"] == RANDOM)


def methods_of(rows: Iterable[Row]) -> list[str]:
    """Return the methods that were measured, in the order in which they are shown."""
    names = {row["method"] for row in rows}
    return sorted(names, key=lambda name: (METHODS.index(name) if name in METHODS else len(METHODS), name))


def ladder_order(rows: Iterable[Row]) -> list[str]:
    """Return the rungs that were measured, from the lowest to the highest; those not of the ladder last."""
    places = {name: place for place, name in enumerate(LADDER)}
    first = {task: group[0] for task, group in grouped(rows, lambda row: row["task"]).items()}
    last = len(places)

    def height(task: str) -> tuple[int, int, str]:
        place = min(places.get(task, last), places.get(first[task]["maze"], last))
        return place, first[task]["n_links"] or 0, task

    return sorted(first, key=height)


def succeeded(row: Row) -> bool:
    """Tell whether the goal was reached in the simulator, or, without a simulation, whether planning was."""
    return bool(row["solved"] if row["success"] is None else row["success"])


def typical_seconds(rows: Sequence[Row]) -> float:
    """Return the median time; runs that did not succeed take infinitely long."""
    times = sorted(
        row["seconds"] if succeeded(row) and row["seconds"] is not None else math.inf for row in rows
    )
    return float(0.5 * (times[(len(times) - 1) // 2] + times[len(times) // 2]))


def time_limit(rows: Sequence[Row]) -> float | None:
    """Return the least budget of the runs that ran out of time; None if most failures have other reasons."""
    failed = [row for row in rows if not succeeded(row)]
    late = [row for row in failed if row["status"] == OUT_OF_TIME]
    if not late or 2 * len(late) < len(failed):
        return None
    limits = [row["budget"] if row["budget_unit"] == "s" else row["seconds"] for row in late]
    return min((limit for limit in limits if limit is not None), default=None)


def index_of(rows: Sequence[Row]) -> float:
    """Return the median index."""
    return float(np.median([row["index"] for row in rows]))


def links_of(rows: Sequence[Row]) -> int | None:
    """Return the median number of links of the runs that succeeded, or of all if none did."""
    counts = [row["n_links"] for row in rows if row["n_links"]]
    solved = [row["n_links"] for row in rows if row["n_links"] and succeeded(row)]
    return round(float(np.median(solved or counts))) if counts else None
