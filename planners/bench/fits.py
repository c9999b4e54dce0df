"""Exponents of growth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["exponent"]


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
