"""Random steps through an environment, counted and timed; as a script, a process that answers by lines.

It needs Python and Gymnasium alone, so that it also runs where nothing of this project is installed. A line
of JSON comes in, and one goes out: first `{"make": id, ...}`, then `{"run": seconds}` as often as is asked.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Mapping
from typing import IO, Any

__all__ = ["Stepper", "serve"]

N_ACTIONS = 997
"""So many actions are sampled beforehand."""

HOLD = 10
"""So many steps each of them is held, unless told otherwise: a motor that gets a new order in every step
hardly moves anything."""

CHUNK = 10
"""Steps between two looks at the clock."""


class Stepper:
    """Step through an environment with random actions, and reset it whenever an episode ends.

    Parameters
    ----------
    env : gymnasium.Env
        The environment.
    seed : int
        Of the actions, and of the first reset.
    options : mapping, optional
        Of every reset.
    hold : int
        So many steps each action is held.
    """

    def __init__(
        self, env: Any, seed: int = 0, options: Mapping[str, Any] | None = None, hold: int = HOLD
    ) -> None:
        self._env, self._options = env, options
        env.action_space.seed(seed)
        self._actions = [action for _ in range(N_ACTIONS) for action in [env.action_space.sample()] * hold]
        self._next = 0
        env.reset(seed=seed, options=options)

    def run(self, seconds: float, clock: Callable[[], float] = time.process_time) -> dict[str, float]:
        """Step for so many seconds of the processor's time, or of another clock.

        Returns
        -------
        counts : dict
            `steps`, `seconds`, `resets`, and the steps in which something `touched` (as `info` says).
        """
        step, reset, actions, options = self._env.step, self._env.reset, self._actions, self._options
        steps = resets = touched = 0
        start = now = clock()
        while now - start < seconds:
            for _ in range(CHUNK):
                _, _, terminated, truncated, info = step(actions[self._next])
                self._next = (self._next + 1) % len(actions)
                steps += 1
                touched += info.get("collisions", 0) > 0
                if terminated or truncated:
                    reset(options=options)
                    resets += 1
            now = clock()
        return {"steps": steps, "seconds": now - start, "resets": resets, "touched": touched}


def serve(orders: IO[str], answers: IO[str]) -> None:
    """Answer orders, line by line, until there are no more."""
    stepper: Stepper | None = None
    for line in orders:
        order = json.loads(line)
        if stepper is None:
            stepper, answer = _make(order)
        else:
            answer = stepper.run(order["run"])
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _make(order: Mapping[str, Any]) -> tuple[Stepper, dict[str, Any]]:
    import gymnasium

    env = gymnasium.make(order["make"], **order.get("arguments", {}))
    stepper = Stepper(env, order.get("seed", 0), order.get("options"), order.get("hold", HOLD))
    return stepper, {"ready": order["make"], "gymnasium": gymnasium.__version__}


if __name__ == "__main__":
    answers, sys.stdout = sys.stdout, sys.stderr  # whatever an environment prints is no answer
    serve(sys.stdin, answers)
