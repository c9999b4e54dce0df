"""Worker processes: one job at a time each; they can be killed at any moment."""

from __future__ import annotations

import _thread
import json
import math
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from queue import SimpleQueue
from types import FrameType
from typing import Any

from hrsnake_env.errors import InputError
from planners.interrupts import again, in_foreign_code
from planners.studio.limits import Limits
from planners.studio.requests import read_request

__all__ = ["PROGRESS", "READY", "STOP", "Compiler", "Desk", "Worker", "error_line", "line_of"]

READY = b"ready"
"""What a worker sends when it can work at full speed."""

PROGRESS = b'{"type":"progress"'
"""How each line but the last of a job begins."""

STOP = b"stop"
"""What a worker is sent to end a search with what it has."""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

QUIET_S = 0.05
"""Seconds from one line of progress to the next, at least."""


_starting = threading.Lock()


def line_of(**fields: Any) -> bytes:
    """Return one line of an answer; infinite figures are null."""
    try:
        text = json.dumps(fields, allow_nan=False, separators=(",", ":"), default=_plain)
    except ValueError:
        text = json.dumps(_finite(fields), allow_nan=False, separators=(",", ":"), default=_plain)
    return text.encode() + b"\n"


def error_line(kind: str, message: str) -> bytes:
    """Return the last line of an answer that has failed."""
    return line_of(type="error", kind=kind, message=message)


def _plain(value: Any) -> Any:
    """Return numpy's numbers and arrays, and mappings, as json knows them."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no plain data")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


class Worker:
    """Hold one worker process, and the pipe to it.

    Parameters
    ----------
    limits : Limits
        Of memory.
    """

    def __init__(self, limits: Limits) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, theirs = context.Pipe()
        self._sending = threading.Lock()
        self.process = context.Process(
            target=_work, args=(theirs, limits.worker_bytes), name="hrsnake-studio-worker", daemon=True
        )
        with _starting, _few_threads():
            self.process.start()
        theirs.close()

    @property
    def pid(self) -> int | None:
        """The process's number."""
        return self.process.pid

    def messages(self) -> Iterator[bytes]:
        """Yield what the process sends until it ends."""
        with self.connection:
            while True:
                try:
                    yield self.connection.recv_bytes()
                except (EOFError, OSError):
                    return

    def send(self, message: bytes) -> None:
        """Send a job (its kind, a line break, its body), or `STOP`.

        That the process has ended already is no error: `messages` tells.
        """
        with self._sending, suppress(OSError, ValueError):
            self.connection.send_bytes(message)

    def kill(self) -> None:
        """End the process at once."""
        self.process.kill()
        self.process.join()


class Compiler:
    """Hold a process that compiles what a search for the longest link needs, for all workers, and ends."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.process = context.Process(target=_compile, name="hrsnake-studio-compiler", daemon=True)
        with _starting, _few_threads():
            self.process.start()

    def kill(self) -> None:
        """End the process at once."""
        self.process.kill()
        self.process.join()


@contextmanager
def _few_threads() -> Iterator[None]:
    """Let processes that start here use one thread for linear algebra each: memory and cores are shared."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


# In the process


class Desk:
    """Hold what the threads of a worker process share: the pipe, and whether the job may be interrupted."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.jobs: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self.stopped = self.stoppable = False
        self.told = 0.0

    def listen(self) -> None:
        """Take jobs and stops from the pipe; end the process when the server has gone."""
        try:
            while True:
                message = self.connection.recv_bytes()
                if message == STOP:
                    self.stopped = True
                    _thread.interrupt_main()  # calls `on_interrupt` in the main thread
                else:
                    kind, _, body = message.partition(b"\n")
                    self.jobs.put((kind.decode(), body))
        except (EOFError, OSError):
            os._exit(0)

    def next_job(self) -> tuple[str, bytes]:
        """Wait for a job; return its kind and body."""
        job = self.jobs.get()
        self.stopped, self.told = False, 0.0
        return job

    def on_interrupt(self, _number: int = 0, frame: FrameType | None = None) -> None:
        """End a search early if that was asked for. Ctrl-C in the terminal concerns the server alone."""
        if not (self.stopped and self.stoppable):
            return
        if in_foreign_code(frame):
            again()
            return
        self.stoppable = False
        raise KeyboardInterrupt

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """Let a stop raise KeyboardInterrupt in here."""
        self.stoppable = True
        try:
            self.on_interrupt()  # the stop may have come before
            yield
        finally:
            self.stoppable = False

    def say(self, **fields: Any) -> None:
        """Send one line of the answer."""
        self.connection.send_bytes(line_of(**fields))

    def tell(self, **fields: Any) -> None:
        """Send a line of progress, unless the last one is only just gone."""
        now = time.monotonic()
        if now - self.told >= QUIET_S:
            self.told = now
            self.say(type="progress", **fields)


def _work(connection: Connection, worker_bytes: int) -> None:
    """Do jobs until the server goes away."""
    desk = Desk(connection)
    signal.signal(signal.SIGINT, desk.on_interrupt)
    threading.Thread(target=desk.listen, daemon=True).start()
    _limit_memory(worker_bytes)
    from planners.studio import tasks

    tasks.warm_up()
    connection.send_bytes(READY)
    while True:
        kind, body = desk.next_job()
        connection.send_bytes(_last_line(desk, kind, body, tasks.TASKS))


def _compile() -> None:
    """Compile for the disk, whenever nobody else needs the processor."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(19)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    from planners.studio import tasks

    tasks.warm_up_search()


def _end_with(parent: Any) -> None:
    """End this process when the server's has ended."""
    parent.join()
    os._exit(0)


def _last_line(desk: Desk, kind: str, body: bytes, tasks: dict[str, Any]) -> bytes:
    """Do a job, and return the last line of its answer."""
    try:
        return line_of(type="done", result=tasks[kind](read_request(kind, body), desk))
    except InputError as error:
        return error_line("input", str(error))
    except MemoryError:
        return error_line(
            "limit", "The job needs more memory than one may use: try longer links, or a smaller drawing."
        )
    except KeyboardInterrupt:
        return error_line("time", "The search was stopped before any length was tried.")
    except Exception as error:
        traceback.print_exc()
        what = type(error).__name__
        return error_line("internal", f"The studio itself has failed ({what}); its terminal says more.")


def _limit_memory(n_bytes: int) -> None:
    """Let the process use this much memory for its data, where the system can see to that."""
    if sys.platform == "win32":
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    if hard == resource.RLIM_INFINITY or hard > n_bytes:
        with suppress(ValueError, OSError):
            resource.setrlimit(resource.RLIMIT_DATA, (n_bytes, hard))
