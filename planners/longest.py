"""longest_link(): say how long a link may be, and so how few actuators a maze needs.

The planners do not promise that a shorter link passes where a longer one does, so halving alone is no answer:
every step of a grid, from the length that no rod can exceed (`planners.rod_bound`) down to the longest link
that passes, is tried. What is known is a set of trials; which length comes next follows from it, so a search
that was stopped goes on from a file.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.files import locked
from hrsnake_env.maze import Maze
from planners.clock import now
from planners.length_trials import LengthTrial, TrialFile, digest_of
from planners.planning import PLANNERS, plan
from planners.problem import Motion, PlanningStatus, Progress
from planners.rod_bound import RodBound, rod_bound
from planners.validation import validate

__all__ = ["ACCURACY", "TIME_BUDGET", "LongestLink", "longest_link"]

VERSION = 3
"""Part of a state's digest: raise it when planners learn to pass what they did not, or the bound changes."""

ACCURACY = 0.0025
"""Step of the grid of lengths, as a share of the length."""

FINEST, COARSEST = 1e-4, 0.5
"""Accuracies that may be asked for."""

TIME_BUDGET = 20.0
"""Seconds that planning one length may take by default."""

BOUND_BUDGET = 60.0
"""Seconds after which the rod bound is taken as it is then."""

FRACTIONS = (0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)
"""The ladder of lengths in the table, as shares of the bound, before they are rounded to three digits."""

FINER = 0.2
"""In the end, how close to a length that failed the longest is brought, in steps of the grid."""

STRIDES = (32, 16, 8, 4, 2, 1)
"""Which steps of the grid above the best are tried first: every 32nd, and so on."""

SHORTEST = 0.1
"""The last step of the grid, as a share of the bound."""

COARSE = 0.02
"""Where nothing has passed yet, the grid is looked through in steps of this share of the length."""


@dataclass(frozen=True, eq=False, kw_only=True)
class LongestLink:
    """Hold the longest link with which the goal is reached, and what shorter ones cost.

    Parameters
    ----------
    length : float
        Of the longest link with a validated motion, in maze units; 0 if there is none.
    bound : RodBound
        No link longer than `bound.upper` passes, whatever the planner.
    motion : Motion or None
        Of the arm with links of that length.
    table : tuple of LengthTrial
        The ladder of lengths, those that were asked for, the longest and that of the fewest links; shortest
        first.
    trials : tuple of LengthTrial
        All lengths that were tried, shortest first.
    untried : tuple of float
        Steps of the grid from `length` to `bound.upper` that were not tried, shortest first.
    complete : bool
        False if the search was interrupted.
    units : str
        Of lengths.
    note : str
        A sentence if the state that was given could not be used.
    """

    length: float
    bound: RodBound
    motion: Motion | None
    table: tuple[LengthTrial, ...]
    trials: tuple[LengthTrial, ...]
    untried: tuple[float, ...]
    complete: bool
    units: str
    note: str = ""

    @property
    def index(self) -> float:
        """The tightness index I, Eq. (4) of the paper, at least: the length over the bound from above."""
        return self.length / self.bound.upper if self.bound.upper > 0.0 else 0.0

    @property
    def index_text(self) -> str:
        """The index to four digits, rounded down."""
        return f"{math.floor(1e4 * self.index + 1e-9) / 1e4:.4f}"

    @property
    def fewest(self) -> LengthTrial | None:
        """The trial with the fewest links, and of these with the smallest joint range; None if none passes.

        It need not be the longest link: that may only pass on a detour.
        """
        passing = [trial for trial in self.trials if trial.passes]
        return min(passing, key=lambda trial: (trial.n_links, trial.joint_range), default=None)

    @property
    def failed(self) -> tuple[LengthTrial, ...]:
        """Trials of longer links, shortest first, in which the planners gave up by themselves."""
        return tuple(
            trial for trial in self.trials if trial.link_length > self.length and not trial.out_of_time
        )

    @property
    def out_of_time(self) -> tuple[LengthTrial, ...]:
        """Trials of longer links, shortest first, of which only time was the end: nothing is known."""
        return tuple(trial for trial in self.trials if trial.link_length > self.length and trial.out_of_time)

    def to_dict(self) -> dict[str, Any]:
        """Return the outcome as plain numbers and strings, without the motion's arrays."""
        bound = self.bound
        return {
            "length": self.length,
            "index": self.index,
            "bound": {
                "lower": bound.lower,
                "upper": bound.upper,
                "limited_by": bound.limited_by,
                "proven": bound.proven,
            },
            "fewest": None if self.fewest is None else self.fewest.to_dict(),
            "table": [trial.to_dict() for trial in self.table],
            "failed": [trial.link_length for trial in self.failed],
            "out_of_time": [trial.link_length for trial in self.out_of_time],
            "untried": list(self.untried),
            "complete": self.complete,
            "units": self.units,
            "note": self.note,
        }


def longest_link(
    maze: Maze,
    planner: str = "auto",
    *,
    link_radius: float = 0.0,
    joint_limit: float | None = None,
    accuracy: float = ACCURACY,
    lengths: Sequence[float] = (),
    time_budget: float = TIME_BUDGET,
    state: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> LongestLink:
    """Find the longest link with which a planner reaches the goal, and what arms with shorter links need.

    Parameters
    ----------
    maze : Maze
        The maze.
    planner : str
        As in `plan`.
    link_radius : float
        In maze units.
    joint_limit : float, optional
        Largest absolute joint angle in rad.
    accuracy : float
        Step of the grid of lengths as a share of the length; the bound is at least as accurate.
    lengths : sequence of float
        Further lengths for the table, in maze units.
    time_budget : float
        In s, for each length.
    state : str or path, optional
        A file (JSON) that is written after each length, with the best motion beside it; from there the
        next call goes on.
    progress : callable, optional
        Called with a line that names the best length so far, and the share of lengths done.

    Returns
    -------
    result : LongestLink
        On Ctrl-C (KeyboardInterrupt) what is known by then, with `complete` False.

    Raises
    ------
    InputError
        If an option is out of its range, the planner is unknown, or `state` is a file of something else, or
        in another process's hands.

    Examples
    --------
    >>> result = longest_link(Maze.load("fig19"), accuracy=0.01)
    >>> 430.0 <= result.length <= 440.0 <= result.bound.upper, result.index > 0.97
    (True, True)
    """
    question = _Question(
        maze=maze,
        planner=planner,
        link_radius=link_radius,
        joint_limit=joint_limit,
        accuracy=accuracy,
        lengths=tuple(float(length) for length in lengths),
        time_budget=time_budget,
    )
    question.check()
    with nullcontext() if state is None else locked(state):
        return _searched(question, TrialFile.open(state, question.digest), progress)


def _searched(question: _Question, file: TrialFile, progress: Progress | None) -> LongestLink:
    """Search on from what a file of trials knows."""
    if file.bound is None:
        deadline = now() + BOUND_BUDGET
        finer = min(question.accuracy, ACCURACY)  # a coarse grid is no reason for a coarse index
        file.bound = rod_bound(
            question.maze, question.link_radius, accuracy=finer, deadline=deadline, progress=progress
        )
        file.save()
    search = _Search(question, file, file.bound)
    try:
        search.run(progress)
    except KeyboardInterrupt:
        return search.result(complete=False)
    return search.result(complete=True)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Question:
    """Hold what `longest_link` was asked."""

    maze: Maze
    planner: str
    link_radius: float
    joint_limit: float | None
    accuracy: float
    lengths: tuple[float, ...]
    time_budget: float

    def check(self) -> None:
        """Check all options."""
        if self.planner != "auto" and self.planner not in PLANNERS:
            raise InputError(f"Unknown planner {self.planner!r}. Available: auto, {', '.join(PLANNERS)}.")
        if not FINEST <= self.accuracy <= COARSEST:
            raise InputError(
                f"Expected an accuracy between {FINEST:g} and {COARSEST:g}, got {self.accuracy!r}."
            )
        for length in self.lengths:
            if not (math.isfinite(length) and length > 0.0):
                raise InputError(f"Expected positive, finite lengths, got {length!r}.")
        if not self.time_budget > 0.0:
            raise InputError(f"Expected a positive time_budget in seconds, got {self.time_budget!r}.")
        self.arm(self.maze.size)  # checks radius and joint limit

    def arm(self, length: float) -> ArmSpec:
        """Return the arm with links of some length."""
        return ArmSpec(link_length=length, link_radius=self.link_radius, joint_limit=self.joint_limit)

    @property
    def digest(self) -> str:
        """What a state must have been written for; time and lengths may differ."""
        options = (VERSION, sorted(PLANNERS), self.planner, self.accuracy)
        return digest_of(self.maze, *options, float(self.link_radius), self.joint_limit)


class _Search:
    """Try lengths in an order in which the best so far improves early."""

    def __init__(self, question: _Question, file: TrialFile, bound: RodBound) -> None:
        self.question, self.file, self.bound = question, file, bound
        upper, kept = bound.upper, 1.0 - question.accuracy
        n_steps = int(math.log(SHORTEST) / math.log(kept)) if upper > 0.0 else -1
        self.grid = [upper * kept**k for k in range(n_steps + 1)]
        self.coarse = self.grid[:: max(1, round(COARSE / question.accuracy))]
        ladder = {float(f"{fraction * upper:.3g}") for fraction in FRACTIONS if upper > 0.0}
        self.rungs = sorted({*question.lengths, *ladder})
        self._forget_what_is_worth_another_try()

    def run(self, progress: Progress | None) -> None:
        """Try lengths until nothing is left to try."""
        if self._next() is not None:
            _compile(self.question.planner)
        while (length := self._next()) is not None:
            if progress is not None:
                progress(*self._news())
            self._try(length)
        if progress is not None:
            progress(self._news()[0], 1.0)

    def result(self, complete: bool) -> LongestLink:
        """Sum up what is known."""
        trials, best = self.file.trials, self.file.best
        length = 0.0 if best is None else best.link_length
        every = tuple(trials[key] for key in sorted(trials))
        result = LongestLink(
            length=length,
            bound=self.bound,
            motion=self.file.motion,
            table=(),
            trials=every,
            untried=tuple(sorted(step for step in self.grid if step > length and step not in trials)),
            complete=complete,
            units=self.question.maze.units,
            note=self.file.note,
        )
        fewest = result.fewest
        shown = {*self.rungs, length, *([] if fewest is None else [fewest.link_length])}
        return replace(result, table=tuple(trial for trial in every if trial.link_length in shown))

    def _next(self) -> float | None:
        """Return the length to try next.

        First the rungs of the ladder, the middle one before the others, until one passes. Then between the
        best and the nearest longer length that failed, halving; then the other rungs; then every step that is
        left above the best, first few and far between, then ever closer; last, what lies between two steps.
        """
        trials, best = self.file.trials, self.file.best
        rungs = sorted(self.rungs, key=lambda length: abs(length - 0.5 * self.bound.upper))
        rungs = [length for length in rungs if length not in trials]
        if best is None:
            coarse = [length for length in self.coarse if length not in trials]
            return next(iter([*rungs, *coarse]), None)
        above = [length for length in self.grid if length > best.link_length]  # longest first
        last = max((k for k, length in enumerate(above) if length in trials), default=-1)
        if last + 1 < len(above):
            return above[(last + 1 + len(above)) // 2]
        if rungs:
            return rungs[0]
        strides = (above[::stride] for stride in STRIDES)
        left = (length for steps in strides for length in steps[::-1] if length not in trials)
        return next(left, None) or self._finer(best.link_length)

    def _finer(self, best: float) -> float | None:
        """Return a length halfway from the best to the nearest longer one that failed, while that is far."""
        above = min((length for length in self.file.trials if length > best), default=self.bound.upper)
        if above - best <= FINER * self.question.accuracy * best:
            return None
        return 0.5 * (best + above)

    def _try(self, length: float) -> None:
        ask, start = self.question, now()
        if length > self.bound.upper:
            limit = f"{self.bound.upper:.5g} {ask.maze.units}"
            why = f"No rod longer than {limit} passes: this is proved."
            self._rule_out(length, PlanningStatus.IMPOSSIBLE, why)
            return
        try:
            arm = ask.arm(length)
            result = plan(ask.maze, arm, ask.planner, time_budget=ask.time_budget, explain=False)
        except InputError as error:  # the link is too short for its radius, or does not leave the feeder
            self._rule_out(length, PlanningStatus.NO_PATH, str(error))
            return
        seconds = now() - start
        self.file.add(LengthTrial.from_result(length, result, seconds, ask.time_budget), result.motion)

    def _rule_out(self, length: float, status: PlanningStatus, why: str) -> None:
        self.file.add(LengthTrial(link_length=length, status=status, reason=why), None)

    def _news(self) -> tuple[str, float]:
        """Return a line about the best so far, and the share of lengths done."""
        best, trials = self.file.best, self.file.trials
        length = 0.0 if best is None else best.link_length
        todo = {*self.rungs, *(self.coarse if best is None else (x for x in self.grid if x > length))}
        line = (
            "no length passes yet" if best is None else f"best so far {length:.5g} {self.question.maze.units}"
        )
        return line, 1.0 - len(todo - set(trials)) / max(len(todo), 1)

    def _forget_what_is_worth_another_try(self) -> None:
        """Drop trials from the file that only lacked time, and all that pass if the best is not valid."""
        for trial in list(self.file.trials.values()):
            if trial.out_of_time and trial.time_budget < self.question.time_budget:
                self.file.drop(trial.link_length)
        if self.file.motion is None or self._is_valid(self.file.motion):
            return
        self.file.motion = None
        for trial in list(self.file.trials.values()):
            if trial.passes:
                self.file.drop(trial.link_length)

    def _is_valid(self, motion: Motion) -> bool:
        try:
            return validate(motion, self.question.maze, self.question.arm(motion.link_length)).valid
        except InputError:
            return False


def _compile(planner: str) -> None:
    """Plan in a small maze: what compiles only once on a machine shall not count as planning time."""
    bend = Maze.from_corridors([(0, 0), (0, 600), (600, 600)], 200.0)
    for length in (300.0, 580.0):  # one passes; of the other all planners are asked, and the rod bound
        plan(bend, ArmSpec(link_length=length), planner, time_budget=TIME_BUDGET, explain=False)
