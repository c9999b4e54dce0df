"""The queue of jobs, and the workers that take them in order."""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import threading
from collections import deque
from collections.abc import AsyncIterator
from typing import Any

from planners.studio.limits import Limits
from planners.studio.workers import PROGRESS, READY, STOP, Compiler, Worker, error_line, line_of

__all__ = ["Busy", "Job", "Jobs"]

ALIVE_S = 2.0
"""Seconds after which a blank line says that the server is still there."""

GIVE_UP = 3
"""Workers in a row that ended before they were ready, after which waiting jobs are told so."""

RETRY_S = 5.0
"""Seconds before the next one is started then."""

COMPILE_S = 15.0
"""Seconds after the first worker is ready before what searches need is compiled, too."""


class Busy(Exception):
    """Say that no further job can wait."""


class Job:
    """Hold one job: what was asked, and the lines of the answer that are still to be sent.

    Parameters
    ----------
    kind : str
        A key of `planners.studio.requests.REQUESTS`.
    body : bytes
        The request, as it came.
    time_limit : float
        Seconds after which it is asked to stop if it can, and ended if not.
    """

    def __init__(self, kind: str, body: bytes, time_limit: float) -> None:
        self.id = secrets.token_urlsafe(12)
        self.kind, self.body, self.time_limit = kind, body, time_limit
        self.ended = False
        self._lines: deque[tuple[str, bytes]] = deque()
        self._news = asyncio.Event()
        self.say("job", line_of(type="job", id=self.id))

    def say(self, what: str, line: bytes) -> None:
        """Add a line to the answer; a newer one of the same kind replaces one that nobody has taken."""
        if self.ended:
            return
        if self._lines and self._lines[-1][0] == what:
            self._lines.pop()
        self._lines.append((what, line))
        self._news.set()

    def end(self, line: bytes | None = None) -> None:
        """Add the last line, if any, and close the answer."""
        if line is not None:
            self.say("end", line)
        self.ended, self.body = True, b""
        self._news.set()

    async def lines(self) -> AsyncIterator[bytes]:
        """Yield the answer as it comes, with blank lines while there is nothing to say."""
        while True:
            while self._lines:
                yield self._lines.popleft()[1]
            if self.ended:
                return
            self._news.clear()
            try:
                await asyncio.wait_for(self._news.wait(), ALIVE_S)
            except TimeoutError:
                yield b"\n"


class _Slot:
    """Hold the place of one worker, and the job that it does."""

    def __init__(self) -> None:
        self.worker: Worker | None = None
        self.starting = self.ready = False
        self.job: Job | None = None
        self.timer: asyncio.TimerHandle | None = None

    @property
    def idle(self) -> bool:
        """Whether it can take a job."""
        return self.ready and self.job is None


class Jobs:
    """Let jobs wait in one queue, and do as many at once as there are workers.

    All methods belong to one event loop.

    Parameters
    ----------
    limits : Limits
        Of jobs, queue, time and memory.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.waiting: deque[Job] = deque()
        self.slots = [_Slot() for _ in range(limits.jobs)]
        self.closed = False
        self._failures = 0
        self._compiler: Compiler | None = None
        self._tasks: set[asyncio.Task[Any]] = set()

    # Asked by the server

    def start(self) -> None:
        """Start the first worker. When it is ready, so is compiled code for the others, which follow."""
        self._loop = asyncio.get_running_loop()
        for slot in self.slots[:1]:
            self._replace(slot)

    async def close(self) -> None:
        """End all workers."""
        self.closed = True
        for job in [*self.waiting, *(slot.job for slot in self.slots if slot.job is not None)]:
            job.end(error_line("internal", "The studio was closed."))
        self.waiting.clear()
        await self._kill_all()
        if self._tasks:
            await asyncio.wait(self._tasks)
        await self._kill_all()  # those that were only just started, too

    async def _kill_all(self) -> None:
        workers = [self._compiler, *(slot.worker for slot in self.slots)]
        await asyncio.gather(*(asyncio.to_thread(worker.kill) for worker in workers if worker is not None))

    def submit(self, kind: str, body: bytes, time_limit: float) -> Job:
        """Put a job at the end of the queue.

        Raises
        ------
        Busy
            If the queue is full.
        """
        if len(self.waiting) >= self.limits.queue or self.closed:
            raise Busy
        job = Job(kind, body, time_limit)
        self.waiting.append(job)
        self._pump()
        return job

    def cancel(self, job: Job) -> None:
        """End a job that nobody waits for any more; the worker that does it is replaced."""
        if job.ended:
            return
        job.end()
        if job in self.waiting:
            self.waiting.remove(job)
            self._pump()
        for slot in self.slots:
            if slot.job is job:
                self._replace(slot)

    def stop(self, job_id: str) -> bool:
        """Ask a search to end with the best so far, cancel any other job; return whether there is one."""
        for slot in self.slots:
            if slot.job is not None and slot.job.id == job_id:
                if slot.job.kind == "longest":
                    self._ask_to_stop(slot)
                else:
                    self._refuse(slot.job, "time", "The job was stopped.")
                return True
        for job in self.waiting:
            if job.id == job_id:
                self._refuse(job, "time", "The job was stopped before its turn came.")
                return True
        return False

    @property
    def pids(self) -> list[int]:
        """Numbers of the worker processes."""
        return [slot.worker.pid for slot in self.slots if slot.worker is not None and slot.worker.pid]

    # The queue

    def _pump(self) -> None:
        """Give jobs to idle workers, and tell the others how many are before them."""
        for slot in self.slots:
            if slot.idle and self.waiting:
                self._give(slot, self.waiting.popleft())
        warming = not any(slot.ready for slot in self.slots)
        for ahead, job in enumerate(self.waiting):
            job.say("queued", line_of(type="queued", ahead=ahead, warming=warming))

    def _give(self, slot: _Slot, job: Job) -> None:
        worker, slot.job = slot.worker, job
        assert worker is not None
        slot.timer = self._loop.call_later(job.time_limit, self._late, slot, job)
        self._in_thread(worker.send, job.kind.encode() + b"\n" + job.body)
        job.body = b""

    def _refuse(self, job: Job, kind: str, message: str) -> None:
        job.say("end", error_line(kind, message))
        self.cancel(job)

    def _late(self, slot: _Slot, job: Job) -> None:
        if slot.job is not job:
            return
        if job.kind == "longest":
            self._ask_to_stop(slot)
            slot.timer = self._loop.call_later(self.limits.grace_s, self._too_late, slot, job)
        else:
            self._too_late(slot, job)

    def _too_late(self, slot: _Slot, job: Job) -> None:
        if slot.job is job:
            self._refuse(job, "time", "Time was over, and the job was ended.")

    def _ask_to_stop(self, slot: _Slot) -> None:
        if slot.worker is not None:
            self._in_thread(slot.worker.send, STOP)

    # The workers

    def _read(self, slot: _Slot, worker: Worker) -> None:
        """Pass on what a worker sends (in a thread of its own)."""
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody waits for it
            for message in worker.messages():
                self._loop.call_soon_threadsafe(self._on_message, slot, worker, message)
            self._loop.call_soon_threadsafe(self._on_message, slot, worker, None)

    def _on_message(self, slot: _Slot, worker: Worker, message: bytes | None) -> None:
        if slot.worker is not worker or self.closed:
            return
        if message is None:
            self._on_death(slot)
        elif message == READY:
            slot.ready, self._failures = True, 0
            if self._compiler is None:
                self._loop.call_later(COMPILE_S, self._compile)
            for other in self.slots:
                if other.worker is None:
                    self._replace(other)
            self._pump()
        elif slot.job is not None:
            self._on_line(slot, slot.job, message)

    def _on_line(self, slot: _Slot, job: Job, message: bytes) -> None:
        if message.startswith(PROGRESS):
            job.say("progress", message)
            return
        job.end(message)
        self._leave(slot)
        self._pump()

    def _on_death(self, slot: _Slot) -> None:
        if slot.job is not None:
            slot.job.end(error_line("internal", "The process that did the job has ended unexpectedly."))
        if not slot.ready:
            self._failures += 1
        if self._failures < GIVE_UP:
            self._replace(slot)
        else:
            self._give_up(slot, "No worker could be started; the terminal says more.")

    def _give_up(self, slot: _Slot, why: str) -> None:
        """Start another worker in a while; those that wait hear why, unless another one works."""
        if not any(other.ready for other in self.slots):
            for job in self.waiting:
                job.end(error_line("internal", why))
            self.waiting.clear()
        self._loop.call_later(RETRY_S, self._retry, slot)

    def _retry(self, slot: _Slot) -> None:
        if not slot.ready:
            self._replace(slot)

    def _not_ready(self, slot: _Slot, worker: Worker) -> None:
        if slot.worker is worker and not slot.ready and not self.closed:
            seconds = self.limits.warm_up_s
            self._give_up(slot, f"No worker was ready after {seconds:g} s; the terminal may say more.")

    def _compile(self) -> None:
        """Let a process of low priority compile what the first search would wait for."""

        async def compiled() -> None:
            with contextlib.suppress(OSError):  # then the first search compiles
                self._compiler = await asyncio.to_thread(Compiler)

        if self._compiler is None and not self.closed:
            self._run(compiled())

    def _replace(self, slot: _Slot) -> None:
        """End the worker in this place, if there is one, and start another."""
        if slot.starting or self.closed:
            return
        old, slot.worker, slot.ready, slot.starting = slot.worker, None, False, True
        self._leave(slot)

        async def replace() -> None:
            if old is not None:
                await asyncio.to_thread(old.kill)
            try:
                new = await asyncio.to_thread(Worker, self.limits)
            except OSError as error:  # the system has no more processes, memory or files
                slot.starting = False
                self._give_up(slot, f"No worker could be started: {error.strerror or error}.")
                return
            slot.worker, slot.starting = new, False
            self._loop.call_later(self.limits.warm_up_s, self._not_ready, slot, new)
            threading.Thread(target=self._read, args=(slot, new), daemon=True).start()

        self._run(replace())

    def _leave(self, slot: _Slot) -> None:
        slot.job = None
        if slot.timer is not None:
            slot.timer.cancel()
            slot.timer = None

    def _run(self, coroutine: Any) -> None:
        task = self._loop.create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _in_thread(self, function: Any, *args: Any) -> None:
        self._run(asyncio.to_thread(function, *args))
