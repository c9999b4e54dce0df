"""Checks of arguments: each raises one sentence that says what was expected and what came.

And how places and lengths are put into sentences, with as many digits as the size of the whole asks for.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.errors import InputError

__all__ = [
    "check_at_least",
    "check_flag",
    "check_one_of",
    "is_number",
    "length_text",
    "numbers",
    "place_text",
]

MOST_DECIMALS, MOST_DIGITS = 12, 1e12
"""Numbers with more decimals, or larger, are written with an exponent."""


def is_number(value: Any) -> bool:
    """Whether a value is a real number, and no truth value."""
    return isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)


def check_one_of(what: str, value: Any, available: tuple[str | None, ...]) -> None:
    """Raise InputError if a value is not one of those available."""
    if not (value is None or isinstance(value, str)) or value not in available:
        raise InputError(f"Unknown {what} {value!r}. Available: {', '.join(map(repr, available))}.")


def check_flag(what: str, value: Any) -> None:
    """Raise InputError if a value is neither True nor False."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"Expected {what} to be True or False, got {value!r}.")


def check_at_least(what: str, value: Any, least: float, *, whole: bool = False) -> None:
    """Raise InputError if a value is no finite number of at least `least`."""
    right = is_number(value) and (not whole or isinstance(value, int | np.integer))
    if not right or not (least <= value < math.inf):
        kind = "a whole number" if whole else "a finite number"
        raise InputError(f"Expected {what} to be {kind} of at least {least:g}, got {value!r}.")


def numbers(what: str, value: Any) -> NDArray[np.float64]:
    """Return an array of numbers.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"Expected {what} in numbers, got {value!r}.") from None


def place_text(place: Iterable[float], size: float) -> str:
    """Write a place as (x, y) or (x, y, z), to a ten-thousandth of the size of what it lies in, or finer.

    Examples
    --------
    >>> place_text((1234.5678, -0.04), size=2000.0), place_text((1e6 + 0.0012345, 0.0), size=0.003)
    ('(1234.6, 0)', '(1000000.0012345, 0)')
    """
    return f"({', '.join(length_text(float(value), size) for value in place)})"


def length_text(value: float, size: float) -> str:
    """Write a length or a coordinate, to a ten-thousandth of the size of what it lies in, or finer."""
    decimals = 4 - math.floor(math.log10(size))
    if decimals > MOST_DECIMALS or abs(value) >= MOST_DIGITS:
        return f"{value:.15g}"
    text = f"{round(value, max(decimals, 0)) + 0.0:.{max(decimals, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
