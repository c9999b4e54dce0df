"""HTML pages that hold all they need: a template filled with data, and a frame for notebooks."""

from __future__ import annotations

import html
import json
import re
from typing import Any

from hrsnake_env.errors import InputError

__all__ = ["filled", "framed"]


def filled(template: str, title: str, payload: Any, *, style: str = "", script: str = "") -> str:
    """Return a template with its places filled in.

    Parameters
    ----------
    template : str
        HTML with `__TITLE__`, `__PAYLOAD__` and, where it has them, `__STYLE__` and `__SCRIPT__`.
    title : str
        Any text.
    payload : plain data
        Written as JSON that is safe within a script element.
    style, script : str
        Of this project: they go in as they are, within an element of their kind.
    """
    # Nothing in the JSON can end the script element that holds it.
    text = json.dumps(payload, allow_nan=False, separators=(",", ":"))
    parts = {
        "TITLE": html.escape(title),
        "PAYLOAD": re.sub("[<>&]", lambda sign: f"\\u{ord(sign[0]):04x}", text),
        "STYLE": style.strip(),
        "SCRIPT": script.strip(),
    }
    # In one go, so that nothing in a title is taken for a place to fill.
    return re.sub("__(TITLE|PAYLOAD|STYLE|SCRIPT)__", lambda place: parts[place[1]], template)


def framed(page: str, height: int) -> Any:
    """Return a page in a frame that the last line of a notebook's cell shows.

    It can run its script, and reaches nothing of the notebook.

    Raises
    ------
    InputError
        If IPython is not installed.
    """
    try:
        from IPython.display import IFrame
    except ImportError:
        raise InputError(
            "Expected IPython to be installed, to show a page in a notebook: pip install "
            "'hrsnake[notebooks]'."
        ) from None
    frame: Any = IFrame  # IPython's own functions are only partly typed
    extras = ['sandbox="allow-scripts"', f'srcdoc="{html.escape(page)}"']
    return frame("about:blank", "100%", height, extras=extras)
