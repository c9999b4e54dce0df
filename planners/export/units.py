"""Metres, which robots count in."""

from __future__ import annotations

from hrsnake_env.arguments import is_number
from hrsnake_env.errors import InputError
from hrsnake_env.maps.reading import METRES

__all__ = ["METRES", "metres_in"]


def metres_in(units: str, given: float | None = None) -> float:
    """Return how many metres a unit of length is.

    Parameters
    ----------
    units : str
        The maze's unit.
    given : float, optional
        What the user says; it counts before the table.

    Raises
    ------
    InputError
        If the unit has no length and none is given, or what is given is not positive and finite.
    """
    if given is not None:
        if not is_number(given) or not 1e-9 <= given <= 1e9:
            raise InputError(f"Expected metres per unit between 1e-9 and 1e9, got {given!r}.")
        return float(given)
    if units in METRES:
        return METRES[units]
    raise InputError(
        f"Expected the length of one {units or 'unit'} in metres (--metres-per-unit 0.001), as robots count "
        f"in metres; known without it: {', '.join(METRES)}."
    )
