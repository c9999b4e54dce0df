"""The clock of time budgets: it stands still while numba compiles.

Kernels are compiled when they are first used on a machine: half a minute in all, and more on a slow one. That
is no time of planning, and a budget would be over before a plan is begun.
"""

from __future__ import annotations

import time

from numba.core import event

__all__ = ["now"]


class _Compiling(event.Listener):
    """Sum up the time in which anything is compiled; one function may be compiled within another."""

    def __init__(self) -> None:
        self.seconds = self._began = 0.0
        self._depth = 0

    def on_start(self, event: event.Event) -> None:
        """Begin, unless something is being compiled already."""
        if self._depth == 0:
            self._began = time.perf_counter()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        """End with the outermost function."""
        self._depth -= 1
        if self._depth == 0:
            self.seconds += time.perf_counter() - self._began


_compiling = _Compiling()
event.register("numba:compile", _compiling)  # type: ignore[no-untyped-call]


def now() -> float:
    """Return the seconds from some moment on, without those in which kernels were compiled."""
    return time.perf_counter() - _compiling.seconds
