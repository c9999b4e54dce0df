"""An extension of Griffe, which reads the docstrings for `docs/reference.md`: types in words stay words.

Without it, `array-like, shape (3,)` is taken for an expression of Python and written as one, with a minus.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

__all__ = ["TypesInWords"]

IN_WORDS = re.compile(r"^(\w[\w, ]*) : (?=.*(?:,(?! optional$)|-| or ))", flags=re.MULTILINE)
WORD_JOINER = "\u2060"
"""Takes no room, and is no Python."""


class TypesInWords(griffe.Extension):
    """Mark types that are more than one word, so that they are not taken for Python."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Mark the types in a docstring."""
        if obj.docstring is not None:
            obj.docstring.value = IN_WORDS.sub(rf"\1 : {WORD_JOINER}", obj.docstring.value)
