"""Imitate a planner: behaviour cloning, and DAgger, where the planner corrects what its pupil does.

Both go in rounds: play, fit a perceptron to all that was seen so far, test, keep. In behaviour cloning the
planner plays; in DAgger [1]_ it plays the first round, and then the pupil does more and more. Actions have
noise, and what is learnt is always what the planner would have done without.

References
----------
.. [1] Ross, Gordon and Bagnell, "A Reduction of Imitation Learning and Structured Prediction to No-Regret
   Online Learning", AISTATS 2011. Algorithm 3.1.
"""

from __future__ import annotations

import dataclasses
import json
import os
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arguments import check_at_least, check_one_of, is_number
from hrsnake_env.errors import InputError
from planners.demonstrator import Demonstrator
from planners.reading import read_arrays
from planners.rl.checkpoints import read_model, write_checkpoint
from planners.rl.environments import make_env
from planners.rl.evaluate import evaluate
from planners.rl.fitting import Layers, fitted, load_torch
from planners.rl.network import NetworkPolicy, observation_layout
from planners.rl.runs import CHECKPOINT, TrainingRun, old_progress, origin_of, run_folder, write_run
from planners.rl.settings import CLONING, Settings, load_settings
from planners.rl.watch import Progress, Stop, Tell, stop_on_interrupt, training_bar

__all__ = ["Lessons", "clone"]

Float32 = NDArray[np.float32]

STEPS = 100_000
"""Of the environment, unless told otherwise."""

ROUNDS, LEAST_STEPS = 10, 500
"""So many rounds, of at least so many steps each."""

NOISES = (0.0, 0.1, 0.3, 0.6)
"""Noise of an episode, in shares of the largest action: so the pupil sees how to come back.

Measured in UTurn-I60: with it both methods pass all tests after 600 to 1300 steps of the environment.
Without, DAgger takes about twice as many, and behaviour cloning never does, as all of its episodes are alike.
"""

BETA = 0.5
"""In DAgger's round k, counted from 0, the planner takes this to the power of k of the steps."""

PATIENCE, LEAST_PROGRESS = 200, 1e-3
"""An episode ends that has not come on by this share of the way in so many steps."""

UNPLANNED = 100
"""So many random mazes in a row without a plan are given up."""

TESTS, TEST_SEED = 20, 500_000
"""Test episodes after each round, and the seed of the first: the same after each, and in no evaluation."""

LOG_STD = -5.0
"""Of sampled actions. In Fig19 with -3 none of 20 episodes comes through, where mean actions do."""


LESSONS_BYTES = 2**30
"""That lessons in a checkpoint may take when they are unpacked."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Lessons:
    """Hold what a pupil has been taught, and what it has learnt from it.

    Parameters
    ----------
    observations : float32 array, shape (n_steps, n_observed)
        Of all rounds.
    actions : float32 array, shape (n_steps, n_actions)
        What the planner would have done there.
    layers : tuple of (weights, bias)
        Of the perceptron after the last round; weights have shape (n_out, n_in).
    n_rounds, round_steps : int
        Rounds so far, and the least number of steps in one.
    """

    observations: Float32
    actions: Float32
    layers: Layers
    n_rounds: int
    round_steps: int

    def save(self, file: IO[bytes]) -> None:
        """Write them as .npz, without pickle."""
        arrays: dict[str, Any] = {f"weights_{k}": weights for k, (weights, _) in enumerate(self.layers)}
        arrays |= {f"bias_{k}": bias for k, (_, bias) in enumerate(self.layers)}
        counts = np.array([self.n_rounds, self.round_steps])
        np.savez(file, observations=self.observations, actions=self.actions, counts=counts, **arrays)

    @classmethod
    def load(cls, file: IO[bytes]) -> Lessons:
        """Read what `save` has written."""
        data = read_arrays(file, most_bytes=LESSONS_BYTES)
        if any(array.dtype.kind not in "fi" for array in data.values()):
            raise InputError("Expected lessons in numbers, got something else.")
        n_rounds, round_steps = map(int, data["counts"])
        layers = tuple((data[f"weights_{k}"], data[f"bias_{k}"]) for k in range((len(data) - 3) // 2))
        return cls(
            observations=data["observations"],
            actions=data["actions"],
            layers=layers,
            n_rounds=n_rounds,
            round_steps=round_steps,
        )


def clone(
    method: str,
    env_id: str,
    *,
    seed: int = 0,
    steps: int | None = None,
    folder: str | os.PathLike[str],
    resume: bool = False,
    env_kwargs: dict[str, Any] | None = None,
    stop_at: float = 0.98,
    quiet: bool = False,
) -> TrainingRun:
    """Imitate the planner until the task is learnt, or for a number of steps.

    After each round 20 episodes from the base, with sampled actions, tell whether it is; their steps do not
    count. Random mazes without a plan are left out. A run that is resumed ends as if it had never stopped,
    to the last bit; at most one round is lost.

    Parameters
    ----------
    method : {"clone", "dagger"}
        Who plays.
    env_id : str
        A registered id.
    seed : int
        The same seed gives the same policy, on the same machine with the same versions.
    steps : int, optional
        Of the environment, in ten rounds of whole episodes, so that they may be more; by default 100,000. A
        resumed run goes on in rounds of the size it began with.
    folder : path
        For the checkpoint, the policy and the record of the run.
    resume : bool
        Go on from the checkpoint in the folder, if there is one.
    env_kwargs : dict, optional
        For the environment, after those of the settings for "ppo", so that both observe the same.
    stop_at : float
        Share of the test episodes, over 0; over 1 it is never reached.
    quiet : bool
        Whether to show no bar.

    Raises
    ------
    InputError
        If torch is not installed, an argument is unknown or out of its range, there is no plan to imitate,
        the folder holds another run, or has one that shall not be resumed.
    """
    check_one_of("method", method, CLONING)
    check_at_least("seed", seed, 0, whole=True)
    total = STEPS if steps is None else steps
    check_at_least("steps", total, 1, whole=True)
    if not (is_number(stop_at) and stop_at > 0.0):
        raise InputError(f"Expected a positive stop_at, got {stop_at!r}.")
    torch = load_torch()
    like = load_settings("ppo", env_id)
    env_kwargs = {**like.env_kwargs, **(env_kwargs or {})}
    settings = Settings(method=method, env_id=env_id, n_timesteps=total, env_kwargs=env_kwargs)
    env = make_env(env_id, env_kwargs=env_kwargs)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # small networks are slower with more
    try:
        with (
            run_folder(Path(folder)),
            stop_on_interrupt() as stop,
            training_bar(method, total, quiet) as tell,
        ):
            school = _School(settings, seed, env, stop, tell)
            return school.run(total, Path(folder), resume, stop_at)
    finally:
        torch.set_num_threads(threads)
        env.close()


class _School:
    """Let a pupil and its teacher play rounds."""

    def __init__(self, settings: Settings, seed: int, env: gym.Env[Any, Any], stop: Stop, tell: Tell) -> None:
        self.settings, self.seed, self.env = settings, seed, env
        self._stop, self._tell = stop, tell
        self._teacher, self._layout = Demonstrator(env), observation_layout(env.observation_space)

    def run(self, total: int, folder: Path, resume: bool, stop_at: float) -> TrainingRun:
        """Play rounds until the task is learnt, or all steps are done."""
        task = json.loads(json.dumps({**asdict(self.settings), "seed": self.seed}))
        task.pop("n_timesteps")  # a resumed run may be longer
        checkpoint = folder / CHECKPOINT
        old = old_progress(checkpoint, task, resume)
        progress = old or Progress()
        lessons = self._first(total) if old is None else self._resumed(checkpoint)
        cpu, wall = progress.cpu_seconds - time.process_time(), progress.seconds - time.monotonic()
        while progress.steps < total and not self._learnt(progress, stop_at) and not self._stop.asked:
            more = self._round(lessons, progress)
            if more is None:
                break
            lessons = more
            progress.recent = self._tested(lessons.layers)
            progress.cpu_seconds, progress.seconds = cpu + time.process_time(), wall + time.monotonic()
            progress.curve.append([progress.steps, round(progress.cpu_seconds, 2), progress.success or 0.0])
            write_checkpoint(checkpoint, lessons, {"task": task, "progress": progress.to_dict()})
        if not lessons.layers:
            raise KeyboardInterrupt  # in the first round, so that there is nothing to keep
        stopped = "interrupted" if self._stop.asked else "steps"
        stopped = "learnt" if self._learnt(progress, stop_at) else stopped
        policy = self._policy(lessons.layers, progress.steps)
        return write_run(self.settings, self.seed, policy, progress, stopped, folder)

    @staticmethod
    def _learnt(progress: Progress, stop_at: float) -> bool:
        return progress.success is not None and progress.success >= stop_at

    def _first(self, total: int) -> Lessons:
        """Return lessons before the first."""
        widths = [sum(length for _, length in self._layout), *(self.env.action_space.shape or ())]
        observations, actions = (np.zeros((0, width), dtype=np.float32) for width in widths)
        steps = max(-(-total // ROUNDS), LEAST_STEPS)
        return Lessons(observations=observations, actions=actions, layers=(), n_rounds=0, round_steps=steps)

    def _resumed(self, checkpoint: Path) -> Lessons:
        """Return the lessons of a checkpoint, if they are of this environment."""
        lessons: Lessons = read_model(checkpoint, Lessons.load)
        first = self._first(1)
        counts = len(lessons.observations) == len(lessons.actions) and min(
            lessons.n_rounds, lessons.round_steps
        )
        if not counts or any(
            getattr(lessons, key).shape[1:] != getattr(first, key).shape[1:]
            for key in ("observations", "actions")
        ):
            raise InputError(f"Expected lessons in {self.settings.env_id} in '{checkpoint}', got others.")
        self._policy(lessons.layers)  # refuses layers that do not fit
        return lessons

    def _policy(self, layers: Layers, steps: int = 0) -> NetworkPolicy:
        *hidden, mean = layers
        return NetworkPolicy(
            hidden=tuple(hidden),
            mean=mean,
            spread=(np.zeros_like(mean[0]), np.full_like(mean[1], LOG_STD)),
            activation="tanh",
            squash=False,
            observation=self._layout,
            origin=origin_of(self.settings, self.seed, steps),
        )

    def _tested(self, layers: Layers) -> list[bool]:
        """Return which of the test episodes succeed."""
        tests: dict[str, Any] = {"episodes": TESTS, "seed": TEST_SEED, "deterministic": False}
        return [fact["success"] for fact in evaluate(self._policy(layers), env=self.env, **tests)]

    def _round(self, lessons: Lessons, progress: Progress) -> Lessons | None:
        """Play a round, and fit to all rounds so far; None if somebody wants to stop."""
        k = lessons.n_rounds
        rng = np.random.default_rng([self.seed, k])
        pupil = self._policy(lessons.layers) if self.settings.method == "dagger" and k > 0 else None
        seen: list[Float32] = []
        told: list[Float32] = []
        episodes, seed = 0, int(rng.integers(2**31))
        while len(seen) < lessons.round_steps:
            self._episode(self._start(seed if episodes == 0 else None), pupil, BETA**k, rng, seen, told)
            if self._stop.asked:
                return None
            episodes += 1
            self._tell(progress.steps + len(seen), progress.news)
        progress.steps, progress.episodes = progress.steps + len(seen), progress.episodes + episodes
        observations = np.concatenate([lessons.observations, seen])
        actions = np.concatenate([lessons.actions, told])
        layers = fitted(observations, actions, lessons.layers, rng)
        return dataclasses.replace(
            lessons, observations=observations, actions=actions, layers=layers, n_rounds=k + 1
        )

    def _start(self, seed: int | None) -> Any:
        """Return the first observation in a maze with a plan."""
        for _ in range(UNPLANNED):
            observation, info = self.env.reset(seed=seed)
            if self._teacher.begin():
                return observation
            if info["task_id"] < 0:
                break
            seed = None
        raise InputError(f"Expected planned motions to imitate, got none in {self.settings.env_id}.")

    def _episode(
        self,
        observation: Any,
        pupil: NetworkPolicy | None,
        beta: float,
        rng: np.random.Generator,
        seen: list[Float32],
        told: list[Float32],
    ) -> None:
        """Play an episode, and add what is observed and what the teacher would do in each step."""
        space, noise, best, idle, over = self.env.observation_space, float(rng.choice(NOISES)), 0.0, 0, False
        while not (over or idle > PATIENCE or self._stop.asked):
            taught = self._teacher.action()
            seen.append(np.asarray(gym.spaces.flatten(space, observation), dtype=np.float32))
            told.append(taught)
            own = pupil is not None and rng.random() >= beta
            action = pupil.predict(observation)[0] if pupil is not None and own else taught
            action = self._teacher.noisy(action, noise * rng.standard_normal(len(action)))
            observation, _, terminated, truncated, info = self.env.step(action)
            idle, over = idle + 1, terminated or truncated
            if info["progress"] >= best + LEAST_PROGRESS:
                best, idle = info["progress"], 0
