"""Exponents of growth, and straight lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["exponent", "line"]


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> dict[str, float]:
    """Fit time = factor * size^exponent by least squares of the logarithms.

    Parameters
    ----------
    sizes, seconds : sequence of float
        Positive, at least two different sizes.

    Returns
    -------
    fit : dict
        `exponent`, and `off`: by what factor a time is off the fitted one in the root mean square.

    Examples
    --------
    >>> fit = exponent([1.0, 2.0, 4.0], [3.0, 12.0, 48.0])
    >>> round(fit["exponent"], 6), round(fit["off"], 6)
    (2.0, 1.0)
    """
    x, y = np.log(np.asarray(sizes)), np.log(np.asarray(seconds))
    slope, start = np.polyfit(x, y, 1)
    residual = y - (slope * x + start)
    return {"exponent": float(slope), "off": float(np.exp(np.sqrt(np.mean(residual**2))))}


def line(x: ArrayLike, y: ArrayLike) -> dict[str, float]:
    """Fit y = start + slope * x by least squares.

    Parameters
    ----------
    x, y : array-like, shape (n,)
        At least two different x, and two different y.

    Returns
    -------
    fit : dict
        `start`, `slope` and `r2`: which share of the variance of y is on the line.

    Examples
    --------
    >>> {key: round(value, 6) for key, value in line([0.0, 1.0, 2.0], [1.0, 3.0, 5.0]).items()}
    {'start': 1.0, 'slope': 2.0, 'r2': 1.0}
    """
    across, up = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    slope, start = np.polyfit(across, up, 1)
    residual = up - (slope * across + start)
    return {
        "start": float(start),
        "slope": float(slope),
        "r2": float(1.0 - np.sum(residual**2) / np.sum((up - up.mean()) ** 2)),
    }
