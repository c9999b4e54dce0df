"""What a training looks at while it runs: episodes, whether it has learnt, and when to write a checkpoint."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bars

from hrsnake_env.arguments import check_at_least
from planners.wrappers import AT_BASE

__all__ = ["Progress", "Stop", "Tell", "Watch", "stop_on_interrupt", "training_bar"]

WINDOW = 100
"""Of so many of the last episodes success is counted."""

LEAST_MIXED = 20
"""Where most episodes start on a planned motion, so many of those from the base have to tell."""

CURVE_STEPS = 2000
"""About so many steps lie between two points of a learning curve."""

Tell = Callable[[int, str], None]
"""Called with steps done, and the news."""


@dataclass(kw_only=True)
class Progress:
    """Count what a training has done; a checkpoint holds it.

    Parameters
    ----------
    steps, episodes : int
        Of all environments together.
    recent : list of bool
        Success of the last 100 episodes that began at the base.
    recent_planned : list of bool
        Success of the last 100 that began elsewhere, as on a planned motion.
    cpu_seconds, seconds : float
        Of the process, and on the clock.
    curve : list of [steps, cpu_seconds, success]
        The learning curve.
    """

    steps: int = 0
    episodes: int = 0
    recent: list[bool] = field(default_factory=list)
    recent_planned: list[bool] = field(default_factory=list)
    cpu_seconds: float = 0.0
    seconds: float = 0.0
    curve: list[list[float]] = field(default_factory=list)

    @property
    def success(self) -> float | None:
        """Share of the last 100 episodes from the base that succeeded; None before the first."""
        return _share(self.recent)

    @property
    def success_planned(self) -> float | None:
        """The same of episodes that began elsewhere."""
        return _share(self.recent_planned)

    def learnt(self, stop_at: float) -> bool:
        """Whether enough episodes from the base have ended, and enough of them well."""
        least = LEAST_MIXED if self.recent_planned else WINDOW
        return len(self.recent) >= least and sum(self.recent) >= stop_at * len(self.recent)

    def see(self, info: dict[str, Any]) -> None:
        """Count an episode by its last info."""
        self.episodes += 1
        window = self.recent if info.get("waypoint", AT_BASE) == AT_BASE else self.recent_planned
        window.append(bool(info["is_success"]))
        del window[:-WINDOW]

    @property
    def news(self) -> str:
        """Success so far, for the bar."""
        parts = ((self.success, "from the base"), (self.success_planned, "from elsewhere"))
        return ", ".join(f"{share:.0%} {where}" for share, where in parts if share is not None)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Progress:
        """Build it from what `to_dict` returned.

        Raises
        ------
        TypeError, ValueError
            If something is missing, unknown or of another kind.
        """
        progress = cls(**data)
        lists = (progress.recent, progress.recent_planned, progress.curve)
        if not all(isinstance(each, list) for each in lists):
            raise TypeError("no lists")
        for count in (progress.steps, progress.episodes):
            check_at_least("a count", count, 0, whole=True)
        for what in (
            progress.cpu_seconds,
            progress.seconds,
            *(number for point in progress.curve for number in point),
        ):
            check_at_least("a time or a share", what, 0)
        if not all(isinstance(each, bool) for each in (*progress.recent, *progress.recent_planned)):
            raise TypeError("no truth values")
        return progress


def _share(window: list[bool]) -> float | None:
    return sum(window) / len(window) if window else None


class Stop:
    """Say whether somebody has pressed Ctrl-C."""

    asked = False


class Watch:
    """Look at a training after each step, and between rollouts.

    Parameters
    ----------
    progress : Progress
        To go on counting in.
    stop_at : float
        Share of the episodes at which the task is learnt.
    checkpoint : callable
        Writes one, of a model.
    every : int
        Steps from one checkpoint to the next.
    stop : Stop
        Whether to stop early.
    tell : callable
        For a bar.
    """

    def __init__(
        self,
        progress: Progress,
        *,
        stop_at: float,
        checkpoint: Callable[[Any], None],
        every: int,
        stop: Stop,
        tell: Tell,
    ) -> None:
        self.progress, self.stop_at, self.stop = progress, stop_at, stop
        self._checkpoint, self._every, self._tell = checkpoint, every, tell
        self._saved: int | None = None
        self._cpu, self._wall = (
            progress.cpu_seconds - time.process_time(),
            progress.seconds - time.monotonic(),
        )

    def step(self, steps: int, dones: Sequence[bool], infos: Sequence[dict[str, Any]]) -> bool:
        """Count a step of all environments; return whether to go on."""
        progress = self.progress
        progress.steps = steps
        for done, info in zip(dones, infos, strict=True):
            if done:
                progress.see(info)
        if any(dones):
            self._tell(steps, progress.news)
        return not (self.stop.asked or progress.learnt(self.stop_at))

    def between(self, model: Any) -> None:
        """Write a checkpoint between two rollouts, if it is time."""
        progress = self.progress
        progress.steps = model.num_timesteps
        self.clock()
        if progress.success is not None:
            model.logger.record("rollout/success_from_base", progress.success)
            if not progress.curve or progress.steps >= progress.curve[-1][0] + CURVE_STEPS:
                self.mark()
        if progress.success_planned is not None:
            model.logger.record("rollout/success_from_elsewhere", progress.success_planned)
        if self._saved is None or progress.steps >= self._saved + self._every:
            self._checkpoint(model)
            self._saved = progress.steps

    def clock(self) -> None:
        """Bring the times up to date."""
        self.progress.cpu_seconds = self._cpu + time.process_time()
        self.progress.seconds = self._wall + time.monotonic()

    def mark(self) -> None:
        """Add a point to the learning curve."""
        progress = self.progress
        if progress.success is not None:
            progress.curve.append([progress.steps, round(progress.cpu_seconds, 2), progress.success])


@contextmanager
def stop_on_interrupt() -> Iterator[Stop]:
    """Let the first Ctrl-C ask to stop at the next step; a second one stops at once."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def ask(number: int, frame: Any) -> None:
        stop.asked = True
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield stop
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def training_bar(name: str, total: int, quiet: bool) -> Iterator[Tell]:
    """Show a bar on stderr, where somebody can see it, with steps, success and time."""
    console = Console(stderr=True)
    columns = (
        TextColumn(name),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
    )
    hidden = quiet or not console.is_terminal
    with Bars(*columns, console=console, transient=True, disable=hidden) as bars:
        task = bars.add_task("", total=total)
        yield lambda steps, news: bars.update(task, completed=min(steps, total), description=news)
