"""The rows of a study, one for each episode: their columns, and the Parquet files that they stand in."""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing

__all__ = [
    "COLUMNS",
    "ORDER",
    "TIMES",
    "check_pyarrow",
    "check_size",
    "read_rows",
    "sorted_rows",
    "whole_row",
    "write_rows",
]

COLUMNS: dict[str, str] = {
    "study": "string",
    "method": "string",
    "task": "string",
    "shape": "string",
    "maze": "string",
    "link_length": "float64",
    "n_links": "int64",
    "longest_rod": "float64",
    "index": "float64",
    "seed": "int64",
    "episode": "int64",
    "actions": "string",
    "budget": "float64",
    "budget_unit": "string",
    "status": "string",
    "reason": "string",
    "solved": "bool",
    "success": "bool",
    "clean": "bool",
    "seconds": "float64",
    "cpu_seconds": "float64",
    "check_seconds": "float64",
    "train_steps": "int64",
    "steps": "int64",
    "return": "float64",
    "progress": "float64",
    "worst_depth": "float64",
    "collisions": "int64",
    "pinches": "int64",
}
"""Name and type of each column. Lengths are in maze units, worst_depth in link lengths, times in s."""

NULLABLE = ("success", "clean", "steps", "return", "progress", "worst_depth", "collisions", "pinches")
"""Columns that are null where no episode was simulated."""

MOST_ROWS, TABLE_BYTES = 10**6, 256 * 2**20
"""Of one file, unpacked."""

ORDER = ("study", "task", "method", "seed", "actions", "episode")
"""By which rows are sorted; no two rows agree in all of them."""

TIMES = ("seconds", "cpu_seconds", "check_seconds")
"""Columns that no two runs agree in."""

DEFAULTS: dict[str, Any] = {
    "actions": "planned",
    "reason": "",
    "solved": False,
    "seconds": 0.0,
    "cpu_seconds": 0.0,
    "check_seconds": 0.0,
    "train_steps": 0,
    **dict.fromkeys(NULLABLE),
}


def whole_row(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return a row with every column in order; what is not measured is null.

    Raises
    ------
    InputError
        If a column that must be there is missing, or is none.
    """
    row = {**DEFAULTS, **facts}
    unknown = [name for name in row if name not in COLUMNS]
    missing = [name for name in COLUMNS if name not in NULLABLE and row.get(name) is None]
    if unknown or missing:
        raise InputError(f"Expected the columns of a row; unknown: {unknown}, missing: {missing}.")
    return {name: row[name] for name in COLUMNS}


def sorted_rows(rows: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the rows in the one order in which they are written."""
    return sorted(rows, key=lambda row: tuple(row[name] for name in ORDER))


def write_rows(rows: Iterable[Mapping[str, Any]], path: Path) -> None:
    """Write rows as Parquet, completely or not at all.

    Raises
    ------
    InputError
        If pyarrow is not installed.
    """
    arrow, parquet = _pyarrow()
    schema = arrow.schema([(name, arrow.type_for_alias(kind)) for name, kind in COLUMNS.items()])
    table = arrow.Table.from_pylist([dict(row) for row in rows], schema=schema)
    with replacing(path) as part:
        parquet.write_table(table, part)


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Read rows that `write_rows` has written.

    Raises
    ------
    InputError
        If the file holds something else, or pyarrow is not installed.
    """
    arrow, parquet = _pyarrow()
    try:
        # Without Arrow's threads: they may abort the process at its end.
        file = parquet.ParquetFile(arrow.BufferReader(path.read_bytes()))
        check_size(file.metadata)
        if file.schema_arrow.names != list(COLUMNS):
            raise InputError(f"Expected the columns of a benchmark's rows in '{path}', got others.")
        schema = arrow.schema(
            [(name, arrow.type_for_alias(kind), name in NULLABLE) for name, kind in COLUMNS.items()]
        )
        rows: list[dict[str, Any]] = file.read(use_threads=False).cast(schema).to_pylist()
    except InputError:
        raise
    except Exception:  # Arrow raises whatever its parsers stumble over
        raise InputError(f"Expected rows of a benchmark (Parquet) in '{path}', got something else.") from None
    return rows


def check_size(metadata: Any) -> None:
    """Refuse a Parquet file that would be too large when it is unpacked.

    Raises
    ------
    ValueError
        If it is so.
    """
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    if metadata.num_rows > MOST_ROWS or sum(group.total_byte_size for group in groups) > TABLE_BYTES:
        raise ValueError(f"more than {MOST_ROWS} rows or {TABLE_BYTES // 2**20} MiB when it is unpacked")


def check_pyarrow() -> None:
    """Raise InputError if pyarrow is not installed."""
    _pyarrow()


def _pyarrow() -> tuple[Any, Any]:
    try:
        return importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    except ImportError:
        raise InputError("Expected pyarrow to be installed: pip install 'hrsnake[bench]'.") from None
