"""Checks of what a workspace is made of: each raises one sentence, what was expected and what came."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from hrsnake_env.arguments import is_number, numbers
from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from planners.reading import shown

__all__ = [
    "boxes_of",
    "check_box",
    "check_keys",
    "corners_of",
    "kind_of",
    "list_of",
    "point_text",
    "positive",
    "store",
    "store_box",
    "string_of",
    "unit_of",
    "vector_of",
]

LONG = 200
"""Characters of a value from which on it is cut."""


def store(record: Any, key: str, array: FloatArray) -> None:
    """Store an array in a frozen record, read-only."""
    array = np.array(array, dtype=np.float64)
    array.setflags(write=False)
    object.__setattr__(record, key, array)


def vector_of(value: Any, what: str) -> FloatArray:
    """Return three finite numbers."""
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        vector = np.empty(0)
    # NumPy takes True and "1" for numbers.
    if vector.shape != (3,) or not np.isfinite(vector).all() or not all(map(is_number, value)):
        came = " ".join(repr(value).split())
        came = came if len(came) < LONG else shown(value)
        raise InputError(f"Expected {what} as three finite numbers (x, y, z), got {came}.")
    return vector


def unit_of(vector: FloatArray) -> FloatArray:
    """Return a vector of length 1 along another; itself if it is one but for rounding."""
    if abs(math.hypot(*vector) - 1.0) <= 4.0 * np.finfo(np.float64).eps:
        return vector
    # First by the largest number, as squares may be too large or too small.
    vector = vector / np.abs(vector).max()
    return np.asarray(vector / math.hypot(*vector), dtype=np.float64)


def positive(value: Any, what: str) -> float:
    """Return a positive, finite number."""
    if not is_number(value) or not 0.0 < value <= sys.float_info.max:
        raise InputError(f"Expected {what} to be positive and finite, got {value!r}.")
    return float(value)


def string_of(value: Any, what: str) -> str:
    """Return a text."""
    if not isinstance(value, str):
        raise InputError(f"Expected {what} as a text, got {kind_of(value)}.")
    return value


def boxes_of(value: Any) -> FloatArray:
    """Return boxes, shape (n, 2, 3)."""
    boxes = numbers("boxes", [] if value is None else value)
    if boxes.shape == (0,):
        return boxes.reshape(0, 2, 3)
    if boxes.ndim != 3 or boxes.shape[1:] != (2, 3):
        raise InputError(f"Expected boxes with shape (n_boxes, 2, 3), got {boxes.shape}.")
    for number, (low, high) in enumerate(value):
        what = f"a corner of box {number}"
        check_box(vector_of(low, what), vector_of(high, what), f"box {number}")
    return boxes


def store_box(record: Any, low: str, high: str, what: str) -> None:
    """Store both corners of a box in a frozen record, checked."""
    for key in (low, high):
        store(record, key, vector_of(getattr(record, key), f"a corner of {what}"))
    check_box(getattr(record, low), getattr(record, high), what)


def check_box(low: FloatArray, high: FloatArray, what: str) -> None:
    """Refuse a box that is inside out or has no thickness."""
    if not (low < high).all():
        raise InputError(
            f"Expected {what} with a low corner below its high corner along every axis, got "
            f"{point_text(low)} and {point_text(high)}: it is inside out or has no thickness."
        )


def check_keys(data: Any, what: str, known: tuple[str, ...], needed: tuple[str, ...]) -> None:
    """Refuse what is no object, lacks a key, or has one that is not known."""
    if not isinstance(data, dict):
        raise InputError(f"Expected {what} as an object with {', '.join(needed)}, got {kind_of(data)}.")
    for key in needed:
        if key not in data:
            raise InputError(f"Expected {what} with '{key}', but it has none.")
    for key in data:
        if key not in known:
            raise InputError(f"Unknown key {shown(key)} of {what}. Available: {', '.join(known)}.")


def list_of(data: Any, what: str) -> list[Any]:
    """Return a list."""
    if not isinstance(data, list):
        raise InputError(f"Expected {what} as a list, got {kind_of(data)}.")
    return data


def corners_of(data: Any, what: str) -> list[FloatArray]:
    """Return both corners of a box in a file."""
    check_keys(data, what, ("low", "high"), ("low", "high"))
    return [vector_of(data[key], f"the {key} corner of {what}") for key in ("low", "high")]


def kind_of(data: Any) -> str:
    """Say what came, for people."""
    if isinstance(data, dict):
        return f"an object of type {shown(data['type'])}" if "type" in data else "an object without a type"
    return {list: "a list", str: "a text", type(None): "nothing"}.get(type(data), shown(data))


def point_text(point: Sequence[float] | FloatArray) -> str:
    """Write a point as (x, y, z), as people gave it: all digits that are not rounding."""
    return "(" + ", ".join(f"{value:.12g}" for value in point) + ")"
