"""The exact checker within a time limit, in the plane and in space."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic

from planners.clock import now
from planners.problem import AnyMotion, Progress, ValidationReport

__all__ = ["Checker", "Late"]


class Late(Exception):
    """Raised by the checker when time is over."""


class Checker(Generic[AnyMotion]):
    """The exact checker for one query; remembers what it said last.

    Parameters
    ----------
    validate : callable
        Takes a motion and a progress.
    deadline : float
        On the clock of `planners.clock.now`.
    progress : callable or None
        Called with stage and share done.

    Attributes
    ----------
    asked : motion or None
        The last one it was asked about, whether or not there was time to answer.
    refused : list
        The motions that were not valid.
    seconds : float
        Time that checking took.
    """

    def __init__(
        self,
        validate: Callable[[AnyMotion, Progress], ValidationReport],
        deadline: float,
        progress: Progress | None,
    ) -> None:
        self.validate, self.deadline, self.progress = validate, deadline, progress
        self.last: tuple[AnyMotion, ValidationReport] | None = None
        self.asked: AnyMotion | None = None
        self.refused: list[AnyMotion] = []
        self.seconds = 0.0

    def __call__(self, motion: AnyMotion) -> ValidationReport:
        """Check a motion, or say again what was said of it.

        Raises
        ------
        Late
            If time is over before the check is.
        """
        if self.last is not None and self.last[0] is motion:
            return self.last[1]
        self.asked = motion
        start = now()
        try:
            report = self.validate(motion, self._tell)
        finally:
            self.seconds += now() - start
        self.last = (motion, report)
        if not report.valid:
            self.refused.append(motion)
        return report

    def _tell(self, stage: str, share: float) -> None:
        if now() > self.deadline:
            raise Late
        if self.progress is not None:
            self.progress(stage, share)
