"""The one exception that means "the input is at fault, not the program"."""

import reprlib
from typing import Any

__all__ = ["LONGEST_MESSAGE", "InputError", "brief", "printable"]

LONGEST_MESSAGE = 1000
"""Characters of a message. What was given may be a whole file, and nobody reads that."""

LONGEST_ECHO = 200
"""Characters of one thing that was given."""


def printable(text: str, most: int = LONGEST_MESSAGE) -> str:
    r"""Return a text that terminals can show: control characters as escapes, and cut in its middle.

    Names out of files may hold what clears a screen, moves the cursor or cannot be written at all.

    Examples
    --------
    >>> printable("\x1b[2J")
    '\\x1b[2J'
    >>> printable("a" * 1000, 20)
    'aaaaaaaaa ... aaaaaa'
    """
    if len(text) > most:
        tail = (most - 5) * 2 // 5
        text = f"{text[: most - 5 - tail]} ... {text[len(text) - tail :]}"
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else each.encode("unicode_escape").decode("ascii") for each in text
    )


def brief(value: Any) -> str:
    """Return what was given, short enough for a sentence, whatever it is.

    Examples
    --------
    >>> brief(list(range(100)))
    '[0, 1, 2, 3, 4, 5, ...]'
    """
    try:
        return printable(reprlib.repr(value), LONGEST_ECHO)
    except (ValueError, RecursionError):  # integers of thousands of digits are not written out
        return f"a long {type(value).__name__}"


class InputError(ValueError):
    """Say in one sentence what was expected, what came, and what would be accepted.

    Raised only at public boundaries. The command line prints it without a traceback and exits with 2;
    any other exception is a bug of ours and keeps its traceback. The sentence is made `printable`.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(str(message)))
