"""Ctrl-C at a moment that harms nobody: never amid code that C has called, which would swallow it, or crash.

Python raises KeyboardInterrupt at any line. If that line belongs to a function that was called from C, the
exception is printed and dropped (pymunk's callbacks, finalizers), leaves memory half freed, or comes out as
another one (SystemError from numba's cached kernels, ImportError from numpy, ValueError from matplotlib). So
it waits for that to end.
"""

from __future__ import annotations

import _thread
import atexit
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

__all__ = ["again", "careful_interrupts", "in_foreign_code", "interruption_first"]

FOREIGN = (
    "pymunk",
    "cffi",
    "llvmlite",
    "matplotlib.path",
    "matplotlib.transforms",
    "numba.core.caching",
    "numba.core.serialize",
    "numba.core.typing.typeof",
    "importlib._bootstrap",
    "weakref",
)
"""Modules whose functions are called from C, or must not be left half done."""

AGAIN_S = 0.01
"""Seconds after which an interruption that had to wait is tried again."""

INSIST_S = 2.0
"""Seconds within which a second Ctrl-C means: whatever it breaks."""


def in_foreign_code(frame: FrameType | None) -> bool:
    """Tell whether an exception that is raised in this frame could get lost, or break something.

    Parameters
    ----------
    frame : frame or None
        The innermost one, as a signal's handler gets it.
    """
    while frame is not None:
        if frame.f_code.co_name == "__del__" or _is_foreign(str(frame.f_globals.get("__name__", ""))):
            return True
        frame = frame.f_back
    return False


def _is_foreign(module: str) -> bool:
    """Tell a module by its name; named tuples that numba unpickles have modules of their own."""
    return module.startswith("namedtuple_") or any(
        module == name or module.startswith(f"{name}.") for name in FOREIGN
    )


def again(call: Callable[[], None] = _thread.interrupt_main) -> None:
    """Interrupt the main thread again in a moment; `call` is run in a thread of its own."""

    def later() -> None:
        time.sleep(AGAIN_S)
        call()

    # No threading.Thread: what was interrupted could hold its locks. At the very end no thread can start.
    with suppress(RuntimeError):
        _thread.start_new_thread(later, ())


class _Careful:
    """Handle Ctrl-C: raise KeyboardInterrupt as soon as it harms nothing; at once if pressed again."""

    def __init__(self) -> None:
        self.asked: float | None = None  # when Ctrl-C was pressed that still waits
        self.retries = False  # the next call is no Ctrl-C of its own
        self.closed = False

    def __call__(self, _number: int, frame: FrameType | None) -> None:
        retry, self.retries = self.retries, False
        insists = False
        if not retry:
            now = time.monotonic()
            insists = self.asked is not None and now - self.asked < INSIST_S
            self.asked = now
        if self.asked is None:
            return  # a second Ctrl-C has been raised meanwhile
        if not insists and in_foreign_code(frame):
            again(self._retry)
            return
        self.asked = None
        raise KeyboardInterrupt

    def _retry(self) -> None:
        if not self.closed:
            self.retries = True
            _thread.interrupt_main()


@contextmanager
def careful_interrupts() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt in here where it harms nothing; pressed twice, it raises at once.

    Where somebody else handles Ctrl-C, or ignores it, and outside the main thread, nothing changes. Once the
    process ends, Ctrl-C ends it without a word.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    handler = _Careful()
    signal.signal(signal.SIGINT, handler)
    atexit.register(signal.signal, signal.SIGINT, signal.SIG_DFL)
    try:
        try:
            yield
        except Exception as error:
            if handler.asked is not None:
                raise KeyboardInterrupt from error  # as a child that was interrupted, too, has failed
            raise
        if handler.asked is not None:
            raise KeyboardInterrupt
    finally:
        handler.closed = True
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def interruption_first() -> Iterator[None]:
    """Let Ctrl-C through where a library fails as it cleans up after it, as with a film without a frame."""
    try:
        yield
    except Exception as error:
        before: BaseException | None = error
        while before is not None:
            if isinstance(before, KeyboardInterrupt):
                raise KeyboardInterrupt from error
            before = before.__context__
        raise
