"""Which outlines are free space, walls, base or goal: by option, or by names that speak for themselves."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from hrsnake_env.errors import InputError, brief, printable
from hrsnake_env.maps.drawing import Outline
from hrsnake_env.maps.reading import MapOptions

__all__ = ["ROLES", "Roles", "roles_of"]

ROLES = ("ignore", "free", "walls", "base", "goal")
"""In the order in which options are asked: what is to be ignored is."""

SPEAKING = {
    "free": {"free", "freespace"},
    "walls": {"wall", "walls", "obstacle", "obstacles", "pillar", "pillars"},
    "base": {"base"},
    "goal": {"goal"},
}
"""Words of a name that say what its outlines are: `A-WALL`, `Free space`, `goal_1`."""

SHOWN_NAMES, LONGEST_LIST = 20, 200
"""Of the names that there are, and characters of them together."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Roles:
    """Hold the roles of outlines, in their order.

    Parameters
    ----------
    roles : tuple of str or None
        One of `ROLES` per outline, None if nothing says it.
    keys : tuple of str
        The layer or colour per outline by which it has its role, or under which it is listed.
    """

    roles: tuple[str | None, ...]
    keys: tuple[str, ...]

    def of(self, outlines: Sequence[Outline], role: str | None) -> list[Outline]:
        """Return the outlines of a role."""
        return [outline for outline, its in zip(outlines, self.roles, strict=True) if its == role]


def roles_of(outlines: Sequence[Outline], options: MapOptions) -> Roles:
    """Give outlines their roles.

    A layer or colour that an option names has that role. A role that no option is given for falls to layers
    whose names have a word of `SPEAKING`. If options say what is free, all that has no role is ignored. The
    most specific name counts: a shape's own before its layer's.

    Raises
    ------
    InputError
        If an option names a layer or colour that is not there.
    """
    names = {
        name.casefold(): name for outline in outlines for name in (*outline.names, outline.layer) if name
    }
    colours = {colour for outline in outlines for colour in outline.colours}
    wanted: dict[str, dict[str, str]] = {}
    for role in ROLES:
        for name in getattr(options, role):
            wanted.setdefault(_known(name, names, colours), {})[role] = name
    speaking = {role: words for role, words in SPEAKING.items() if not getattr(options, role)}
    found = [_role(outline, wanted, speaking) for outline in outlines]
    if options.free:
        found = [("ignore" if role is None else role, key) for role, key in found]
    return Roles(roles=tuple(role for role, _ in found), keys=tuple(key for _, key in found))


def _known(name: str, names: dict[str, str], colours: set[str]) -> str:
    """Return a name as the drawing is asked for it."""
    plain = name.strip().casefold()
    if plain in names:
        return plain
    colour = _colour(plain)
    if colour in colours:
        return str(colour)
    shown = [*sorted(names.values()), *sorted(colours)]
    more = f" and {len(shown) - SHOWN_NAMES} more" if len(shown) > SHOWN_NAMES else ""
    listed = printable(", ".join(shown[:SHOWN_NAMES]), LONGEST_LIST) or "none"
    raise InputError(f"Unknown layer or colour {brief(name)}. Available: {listed}{more}.")


def _colour(name: str) -> str | None:
    from PIL import ImageColor

    try:
        red, green, blue = ImageColor.getrgb(name)[:3]
    except ValueError:
        return None
    return f"#{red:02x}{green:02x}{blue:02x}"


def _role(
    outline: Outline, wanted: dict[str, dict[str, str]], speaking: dict[str, set[str]]
) -> tuple[str | None, str]:
    listed = outline.layer or next(iter(outline.colours), "") or "(no layer)"
    names = list(dict.fromkeys([*outline.names, outline.layer, *outline.colours]))
    for name in names:
        roles = wanted.get(name.casefold(), {})
        for role in ROLES:
            if role in roles:
                return role, name
    for name in names:
        words = set(re.findall(r"[^\W\d_]+", name.casefold()))
        spoken = [role for role, known in speaking.items() if words & known]
        if len(spoken) == 1:
            return spoken[0], name
    return None, listed
