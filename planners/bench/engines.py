"""Engines that do cells: processes of this machine, or a Ray cluster; both survive workers that die."""

from __future__ import annotations

import importlib
import math
import multiprocessing
import os
import socket
import threading
import time
from collections.abc import Generator, Sequence
from contextlib import suppress
from multiprocessing.connection import wait
from typing import Any

from hrsnake_env.errors import InputError
from planners.bench.cells import Cell, CellResult, Run, error_rows
from planners.bench.pool import end_with_parent, no_ctrl_c

__all__ = ["DIED", "ENGINES", "over_cells"]

ENGINES = ("processes", "ray")

DIED = "worker died"
"""Reason of a cell whose worker has died, as by the system for want of memory, twice."""

HUNG = "worker did not come back"
"""Reason of a cell whose worker was ended as it took many times its budget."""

TRIES = 2

CONNECT_SECONDS = 10.0

AT_ONCE = 4
"""Cells for each processor that a Ray cluster has been handed at any time."""

Done = Generator[tuple[Cell, CellResult], None, None]


def over_cells(
    cells: Sequence[Cell], run: Run, *, engine: str, workers: int | None = None, address: str | None = None
) -> Done:
    """Yield every cell with its result, in the order in which they are done.

    Parameters
    ----------
    cells : sequence of Cell
        What is to be done.
    run : callable
        Does a cell; a function of a module.
    engine : str
        One of `ENGINES`.
    workers : int, optional
        Processes; by default one for each processor. A cluster that is there has its own.
    address : str, optional
        Of an existing Ray cluster, as `ray.init` has it; by default Ray starts on this machine.

    Raises
    ------
    InputError
        If there is no such engine, Ray is not installed, or its cluster cannot be reached.
    """
    check_engine(engine, workers, address)
    if engine == "ray":
        _check_reachable(address)
        return _over_ray(cells, run, workers, address)
    return _over_processes(cells, run, workers or os.cpu_count() or 1)


def check_engine(engine: str, workers: int | None, address: str | None) -> None:
    """Refuse an engine that there is not, and what does not suit it."""
    if engine not in ENGINES:
        raise InputError(f"Unknown engine {engine!r}. Available: {', '.join(ENGINES)}.")
    if address is not None and engine != "ray":
        raise InputError(f"Expected an address for the engine 'ray' alone, got one for '{engine}'.")
    if workers is not None and workers < 1:
        raise InputError(f"Expected at least one worker, got {workers}.")


# Processes


class _Worker:
    """A process that does one cell after another; it ends when this process does."""

    def __init__(self, run: Run) -> None:
        # Forked children would inherit the locks of this process's threads; spawned ones start clean.
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(run, theirs))
        self.process.start()
        theirs.close()
        self.cell: Cell | None = None
        self.overdue = math.inf

    def give(self, cell: Cell) -> None:
        """Hand over a cell; a worker that is dead already is found by `answer`."""
        self.cell = cell
        self.overdue = time.monotonic() + (cell.patience or math.inf)
        try:
            self.pipe.send(cell)
        except OSError:
            self.process.join()

    def answer(self) -> CellResult | None:
        """Return the result of the cell if it is there; None if the worker has died."""
        try:
            result: CellResult = self.pipe.recv()
        except (EOFError, OSError):
            return None
        return result

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.pipe.close()


def _serve(run: Run, pipe: Any) -> None:
    threading.Thread(target=end_with_parent, daemon=True).start()
    with suppress(EOFError, ConnectionError):  # the parent has ended
        while True:
            pipe.send(run(pipe.recv()))


def _over_processes(cells: Sequence[Cell], run: Run, count: int) -> Done:
    waiting, tries = list(reversed(cells)), dict.fromkeys(cells, 0)
    workers: list[_Worker] = []
    try:
        for _ in range(min(count, len(cells))):
            _start(workers, run)
        while waiting or any(worker.cell for worker in workers):
            for worker in workers:
                if worker.cell is None and waiting:
                    worker.give(waiting.pop())
            for worker, cell, result, late in _answers(workers):
                if result is None:
                    workers.remove(worker)
                    worker.end()
                    _start(workers, run)
                    tries[cell] += 1
                    if tries[cell] < TRIES and not late:
                        waiting.append(cell)
                        continue
                yield cell, result or CellResult(rows=error_rows(cell, HUNG if late else DIED))
    finally:
        for worker in workers:
            worker.end()


def _start(workers: list[_Worker], run: Run) -> None:
    with no_ctrl_c():
        workers.append(_Worker(run))


def _answers(workers: Sequence[_Worker]) -> list[tuple[_Worker, Cell, CellResult | None, bool]]:
    """Wait until a worker has something to say, or is overdue.

    Returns
    -------
    answers : list of (worker, cell, result, late)
        Of each such worker; no result if it has died, or is late.
    """
    busy = [worker for worker in workers if worker.cell is not None]
    soonest = min(worker.overdue for worker in busy)
    timeout = None if math.isinf(soonest) else max(0.0, soonest - time.monotonic())
    ready, answers = wait([worker.pipe for worker in busy], timeout), []
    for worker in busy:
        late = worker.pipe not in ready and time.monotonic() >= worker.overdue
        if worker.pipe in ready or late:
            cell, worker.cell = worker.cell, None
            assert cell is not None
            answers.append((worker, cell, None if late else worker.answer(), late))
    return answers


# Ray


def _over_ray(cells: Sequence[Cell], run: Run, workers: int | None, address: str | None) -> Done:
    ray = _ray()
    started = not ray.is_initialized()
    if started:
        _connect(ray, workers, address)
    try:
        task = ray.remote(num_cpus=1, max_retries=TRIES - 1)(run)
        at_once = AT_ONCE * max(1, int(ray.cluster_resources().get("CPU", 1)))
        waiting: list[Cell] = list(reversed(cells))
        running: dict[Any, Cell] = {}
        while waiting or running:
            while waiting and len(running) < at_once:
                cell = waiting.pop()
                running[task.remote(cell)] = cell
            ready, _ = ray.wait(list(running), num_returns=1)
            for reference in ready:
                cell = running.pop(reference)
                try:
                    result = ray.get(reference)
                except ray.exceptions.RayError as error:
                    failed = isinstance(error, ray.exceptions.RayTaskError)
                    result = CellResult(rows=error_rows(cell, str(error.cause) if failed else DIED))
                yield cell, result
    finally:
        if started:
            ray.shutdown()  # ends what still runs for this driver, and nothing else on the cluster


def _ray() -> Any:
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        return importlib.import_module("ray")
    except ImportError:
        raise InputError("Expected Ray to be installed: pip install 'hrsnake[bench]'.") from None


def _check_reachable(address: str | None) -> None:
    """Refuse a host and port where nobody listens: Ray itself would try for minutes."""
    host, _, port = (address or "").rpartition(":")
    if not host or "/" in host or not port.isdigit():
        return  # such as auto, or ray://host:port
    try:
        socket.create_connection((host, int(port)), CONNECT_SECONDS).close()
    except OSError as error:
        raise InputError(f"Expected a Ray cluster at '{address}', got: {error}.") from None


def _connect(ray: Any, workers: int | None, address: str | None) -> None:
    """Join the cluster, or start Ray here; no code is uploaded: workers have the package installed."""
    options: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    if address is None:
        options |= {"num_cpus": workers or os.cpu_count() or 1, "include_dashboard": False}
    else:
        options["address"] = address
    try:
        ray.init(**options)
    except (ConnectionError, ValueError, RuntimeError) as error:
        text = " ".join(str(error).split())
        raise InputError(f"Expected a Ray cluster at '{address or 'this machine'}', got: {text}") from None
