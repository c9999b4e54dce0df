"""Work spread over processes, with a bar, and with a file of lines from which the next run goes on."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hrsnake_env.errors import InputError
from hrsnake_env.files import locked
from planners.reading import NotReadable, read_limited

__all__ = ["Tell", "bar", "end_with_parent", "no_ctrl_c", "over_processes", "resumed", "worker_pool"]

LINES_BYTES = 256 * 2**20
"""Of a file of lines, each of which is small."""

Tell = Callable[[], None]
"""Called when one more piece of work is done."""


@contextmanager
def bar(name: str, total: int, quiet: bool = False) -> Iterator[Tell]:
    """Show a bar on stderr, where somebody can see it, that is moved on by calling what this yields."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description:<10}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    hidden = quiet or not console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=hidden) as progress:
        task = progress.add_task(name, total=total)
        yield lambda: progress.advance(task)


@contextmanager
def worker_pool(workers: int, warm_up: Callable[[], None]) -> Iterator[ProcessPoolExecutor]:
    """Start fresh processes, each of which is warmed up before its first task; they end with the block.

    Parameters
    ----------
    workers : int
        Number of processes.
    warm_up : callable
        Loads what every task needs, as the compiled kernels; a module's function.
    """
    # Forked children would inherit the locks of this process's threads; spawned ones start clean.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_start, initargs=(warm_up,))
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _start(warm_up: Callable[[], None]) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's business
    threading.Thread(target=end_with_parent, daemon=True).start()
    warm_up()


def end_with_parent() -> None:
    """End this process when its parent has ended, in the midst of its work, too: nobody would take it."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


@contextmanager
def no_ctrl_c() -> Iterator[None]:
    """Ignore Ctrl-C in the block, and ever after in processes that are started in it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def over_processes(
    pool: ProcessPoolExecutor,
    function: Callable[..., dict[str, Any]],
    tasks: Sequence[tuple[Any, ...]],
    tell: Tell = lambda: None,
) -> Iterator[dict[str, Any]]:
    """Yield what the function returns for each task, in the order in which they are done.

    Parameters
    ----------
    pool : ProcessPoolExecutor
        Of `worker_pool`.
    function : callable
        A module's function.
    tasks : sequence of tuples
        Its arguments.
    tell : callable
        Called after each.
    """
    with no_ctrl_c():  # processes start with the first task
        futures = [pool.submit(function, *task) for task in tasks]
    for future in as_completed(futures):
        tell()
        yield future.result()


def resumed(
    path: Path,
    function: Callable[..., dict[str, Any]],
    tasks: Sequence[tuple[Any, ...]],
    warm_up: Callable[[], None],
    workers: int | None = None,
) -> list[dict[str, Any]]:
    """Do the tasks that are not in the file yet, and add a line for each as soon as it is done.

    Ctrl-C stops between two tasks; what is done by then is in the file.

    Parameters
    ----------
    path : Path
        JSON lines, one for each task, with its arguments under `task`; made if missing.
    function, tasks, warm_up
        As in `over_processes` and `worker_pool`.
    workers : int, optional
        By default one for each processor.

    Returns
    -------
    rows : list of dict
        Of those of the tasks that are done, in their order.

    Raises
    ------
    InputError
        If the file holds something else, or another process adds lines to it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with locked(path):
        done = _read(path)
        _do(path, function, [task for task in tasks if json.dumps(task) not in done], warm_up, workers, done)
    return [done[json.dumps(task)] for task in tasks if json.dumps(task) in done]


def _do(
    path: Path,
    function: Callable[..., dict[str, Any]],
    wanted: Sequence[tuple[Any, ...]],
    warm_up: Callable[[], None],
    workers: int | None,
    done: dict[str, dict[str, Any]],
) -> None:
    """Do tasks, and add them to what is done, and to the file."""
    count = os.cpu_count() or 1 if workers is None else workers
    with bar(path.stem, len(wanted)) as tell, worker_pool(count, warm_up) as pool, path.open("a") as file:
        try:
            for row in over_processes(pool, function, wanted, tell):
                file.write(json.dumps(row) + "\n")
                file.flush()
                done[json.dumps(row["task"])] = row
        except KeyboardInterrupt:
            print(f"Stopped; run it again to go on from '{path.name}'.", file=sys.stderr)


def _read(path: Path) -> dict[str, dict[str, Any]]:
    """Read the lines by their task; a last line that was cut off is taken off the file."""
    if not path.exists():
        return {}
    try:
        text = read_limited(path, LINES_BYTES)
        whole = text[: text.rfind(b"\n") + 1]
        rows = [json.loads(line) for line in whole.splitlines()]
        done = {json.dumps(row["task"]): row for row in rows}
    except (NotReadable, ValueError, KeyError, TypeError, RecursionError):
        raise InputError(
            f"Expected lines of JSON, each with its task, in '{path}', got something else."
        ) from None
    if whole != text:
        os.truncate(path, len(whole))  # at one stroke: rows that are there stay, whatever happens
    return done
