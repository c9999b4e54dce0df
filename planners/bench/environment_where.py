"""Where the time of a step goes: every piece is timed in running episodes, beside the same ones untimed."""

from __future__ import annotations

import functools
import pkgutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest import mock

import gymnasium as gym

from planners.bench.environment_scenes import ENV_ID, arm_in_hall, half_out, hall
from planners.bench.environment_stepper import HOLD
from planners.bench.pool import Tell

__all__ = ["PIECES", "REST", "where"]

_ENV, _PHYSICS, _SPACE = (f"hrsnake_env.{name}" for name in ("env", "physics", "space"))
_CLASS = f"{_ENV}.HyperRedundantMazeEnv"

WHOLE = f"{_CLASS}.step"

PIECES: dict[str, tuple[str, ...]] = {
    "pymunk's step": (f"{_SPACE}.pymunk.Space.step",),
    "contact callbacks": tuple(
        f"{_SPACE}.ArmSpace.{name}" for name in ("_before_wall", "_before_link", "_after")
    ),
    "pymunk's batches": tuple(
        f"{_PHYSICS}.pymunk.batch.{name}" for name in ("get_space_bodies", "set_space_bodies")
    ),
    "force and reading kernels": tuple(f"{_PHYSICS}.{name}" for name in ("drive", "read_links", "divide")),
    "physics glue": (f"{_PHYSICS}.Physics.advance_to", f"{_PHYSICS}.Physics.take_back"),
    "senses": (f"{_PHYSICS}.read_arm",),
    "geodesic": (f"{_ENV}.look_ahead",),
    "observation": (f"{_CLASS}.observe", f"{_ENV}.write_observation"),
    "info": (f"{_CLASS}._info",),
    "targets, reward, end": (f"{_ENV}.task.next_target", f"{_CLASS}._judge"),
    "environment glue": (WHOLE,),
}
"""Names of what is timed, by piece. What one of them calls and another has counts for the other alone."""

REST = "Gymnasium's wrappers"
"""What is left of a step through `gym.make`, with the loop around it."""

CALIBRATION = 20_000
"""Calls of nothing, from which the cost of timing is known."""


class Stopwatch:
    """Add up the time of pieces, each without that of the pieces inside it.

    Parameters
    ----------
    root : str
        Only what happens within this piece counts.

    Attributes
    ----------
    seconds, calls, inside : dict
        By piece: its time, how often it was called, and how often it called another.
    total : float
        Seconds of the root with all inside.
    """

    def __init__(self, root: str) -> None:
        self.root = root
        self.seconds: dict[str, float] = {}
        self.calls: dict[str, float] = {}
        self.inside: dict[str, float] = {}
        self.total = 0.0
        self._open: list[list[float]] = []

    def timed(self, piece: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """Return the function, timed as a part of a piece."""
        seconds, calls, inside = self.seconds, self.calls, self.inside
        for count in (seconds, calls, inside):
            count.setdefault(piece, 0)
        open_, clock, is_root = self._open, time.perf_counter, piece == self.root

        @functools.wraps(function)
        def run(*args: Any) -> Any:
            if not (open_ or is_root):
                return function(*args)
            frame = [0.0, 0.0]  # seconds and calls of pieces inside
            open_.append(frame)
            start = clock()
            result = function(*args)
            spent = clock() - start
            open_.pop()
            seconds[piece] += spent - frame[0]
            calls[piece] += 1
            inside[piece] += frame[1]
            if open_:
                above = open_[-1]
                above[0] += spent
                above[1] += 1
            else:
                self.total += spent
            return result

        return run

    def corrected(self) -> dict[str, float]:
        """Return the seconds of the pieces, without what timing them has cost."""
        before, around = _cost_of_timing()
        return {
            piece: max(self.seconds[piece] - before * self.calls[piece] - around * self.inside[piece], 0.0)
            for piece in self.seconds
        }


def _nothing(*args: Any) -> None:
    pass


@functools.cache
def _cost_of_timing() -> tuple[float, float]:
    """Return what timing one call adds to the time of the call itself, and of the caller, in s."""
    watch = Stopwatch("caller")
    timed = watch.timed("called", _nothing)

    def calls(function: Callable[..., None]) -> None:
        for number in range(CALIBRATION):
            function(watch, timed, number, CALIBRATION)

    start = time.perf_counter()
    calls(_nothing)
    plain = time.perf_counter() - start
    watch.timed("caller", calls)(timed)
    before, around = watch.seconds["called"], watch.seconds["caller"] - plain
    return max(before, 0.0) / CALIBRATION, max(around, 0.0) / CALIBRATION


@contextmanager
def _watched() -> Iterator[Stopwatch]:
    """Time every piece within the block."""
    watch = Stopwatch("environment glue")
    with ExitStack() as stack:
        for piece, names in PIECES.items():
            for name in names:
                stack.enter_context(mock.patch(name, watch.timed(piece, pkgutil.resolve_name(name))))
        yield watch


def where(links: Sequence[int], steps: int, rounds: int, tell: Tell = lambda: None) -> list[dict[str, Any]]:
    """Time all pieces of a step, in microseconds.

    Parameters
    ----------
    links : sequence of int
        Numbers of links, in the hall.
    steps : int
        In each round.
    rounds : int
        So often; those of the fastest are returned, which other work on the machine disturbs least.
    tell : callable
        Called after each round.

    Returns
    -------
    rows : list of dict
        By number of links: microseconds of the `pieces`, their sum, and of the `whole` step where nothing was
        timed inside. The episodes are the same to the last bit.
    """
    return [_where(n_links, steps, rounds, tell) for n_links in links]


def _where(n_links: int, steps: int, rounds: int, tell: Tell) -> dict[str, Any]:
    arguments, wholes, every = arm_in_hall(n_links, hall()), [], []
    for _ in range(rounds + 1):  # the first warms up
        wholes.append(_walk(arguments, steps, time.process_time) / steps * 1e6)
        with _watched() as watch:
            spent = _walk(arguments, steps, time.perf_counter)
        pieces = {piece: seconds / steps * 1e6 for piece, seconds in watch.corrected().items()}
        outside = spent - watch.total - watch.calls[watch.root] * sum(_cost_of_timing())
        every.append({**pieces, REST: max(outside, 0.0) / steps * 1e6})
        tell()
    least = min(every[1:], key=lambda pieces: sum(pieces.values()))
    return {
        "n_links": n_links,
        "steps": steps,
        "rounds": rounds,
        "pieces": least,
        "sum": sum(least.values()),
        "whole": min(wholes[1:]),
    }


def _walk(arguments: dict[str, Any], steps: int, clock: Callable[[], float]) -> float:
    """Take so many random steps, always the same; return their seconds, without those of resets."""
    env = gym.make(ENV_ID, **arguments)
    env.action_space.seed(0)
    actions = [action for _ in range(steps // HOLD + 1) for action in [env.action_space.sample()] * HOLD]
    env.reset(seed=0, options=half_out())
    step, spent, start = env.step, 0.0, clock()
    for action in actions[:steps]:
        _, _, terminated, truncated, _ = step(action)
        if terminated or truncated:
            spent += clock() - start
            env.reset(options=half_out())
            start = clock()
    return spent + clock() - start
