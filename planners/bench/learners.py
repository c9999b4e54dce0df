"""Cells of methods that learn, and of random actions; the only file here that knows `planners.rl`."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

from planners.bench.cells import EVERY_ACTIONS, Cell, CellResult, row_of
from planners.bench.episodes import MEASURED, RandomPolicy
from planners.bench.planned import warm_up
from planners.bench.tasks import Problem, Task, known_maze
from planners.rl.environments import decision_steps
from planners.rollout import episode_facts

__all__ = ["LEARNERS", "Learner", "Trained", "run_learner", "run_random"]

TEST_SEED = 1_000_000
"""Of the first episode that tests a policy; trainings take their seeds from below."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Trained:
    """Hold what a training has given.

    Parameters
    ----------
    test : callable
        Given the number of episodes, the seed of the first and whether actions are the mean ones, returns
        for each episode what a row says of it.
    seconds, cpu_seconds : float
        Of the training.
    train_steps : int
        Steps of the environment that it took.
    policy : bytes
        The policy's file (.npz).
    """

    test: Callable[[int, int, bool], list[Mapping[str, Any]]]
    seconds: float
    cpu_seconds: float
    train_steps: int
    policy: bytes


Learner = Callable[[Task, int, int, Path], Trained]
"""Trains at a task, from a seed, for so many steps, with a folder for its files."""


def run_learner(cell: Cell) -> CellResult:
    """Train, and test with mean and with sampled actions: `cell.episodes` rows each, and the policy."""
    known_maze(cell.task)
    _warm_up(cell.task)
    with tempfile.TemporaryDirectory() as folder:
        trained = LEARNERS[cell.method](cell.task, cell.seed, int(cell.budget), Path(folder))
    rows = []
    for actions in EVERY_ACTIONS:
        tested = trained.test(cell.episodes, TEST_SEED, actions == "mean")
        rows += [
            row_of(
                cell,
                _problem(cell.task, number),
                number,
                actions=actions,
                status="evaluated",
                solved=bool(facts["success"]),
                seconds=trained.seconds,
                cpu_seconds=trained.cpu_seconds,
                train_steps=trained.train_steps,
                **{name: facts[name] for name in MEASURED},
            )
            for number, facts in enumerate(tested)
        ]
    return CellResult(rows=rows, files={".npz": trained.policy})


def _warm_up(task: Task) -> None:
    """Have all compiled that a training may need, so that its time does not count it."""
    warm_up("auto")
    env = gym.make(f"hrsnake_env:{task.env_id}", **task.env_kwargs)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.close()


def run_random(cell: Cell) -> CellResult:
    """Test a policy that draws every action evenly; nothing is trained."""
    known_maze(cell.task)
    env = gym.make(f"hrsnake_env:{cell.task.test_id or cell.task.env_id}", **cell.task.env_kwargs)
    policy, rows = RandomPolicy(env, cell.seed), []
    for number in range(cell.episodes):
        facts = episode_facts(env, policy, TEST_SEED + number, options=_options(cell.task, number))
        rows.append(
            row_of(
                cell,
                _problem(cell.task, number),
                number,
                actions="sampled",
                status="evaluated",
                solved=facts["success"],
                **{name: facts[name] for name in MEASURED},
            )
        )
    env.close()
    return CellResult(rows=rows)


def _problem(task: Task, number: int) -> Problem:
    """Return the problem of an episode: in a family both have the same number, as for planners."""
    return task.problem(number if task.n_mazes > 1 else 0)


def _options(task: Task, number: int) -> dict[str, Any] | None:
    """Return the reset options of an episode."""
    return {"task_id": number} if task.n_mazes > 1 else None


def _from_package(module: str, function: str, method: str) -> Learner:
    """Return a learner of `planners.rl`, which is imported when it is asked."""

    def learn(task: Task, seed: int, steps: int, folder: Path) -> Trained:
        network: Any = importlib.import_module("planners.rl.network")
        train: Any = getattr(importlib.import_module(f"planners.rl.{module}"), function)
        make_env: Any = importlib.import_module("planners.rl.environments").make_env
        run = train(
            method,
            task.env_id,
            seed=seed,
            steps=steps,
            folder=folder,
            env_kwargs=dict(task.env_kwargs),
            quiet=True,
        )
        file = Path(run.policy)
        policy = network.NetworkPolicy.load(file)
        wrappers = policy.origin.wrappers
        kwargs = {**policy.origin.env_kwargs, **task.env_kwargs}  # with the task's own time limit

        def test(episodes: int, first_seed: int, mean: bool) -> list[Mapping[str, Any]]:
            env = make_env(task.test_id or task.env_id, env_kwargs=kwargs, wrappers=wrappers)
            found: list[Mapping[str, Any]] = []
            with closing(env):
                for number in range(episodes):
                    policy.reseed(first_seed + number)
                    options = _options(task, number)
                    seed = first_seed + number
                    found.append(episode_facts(env, policy, seed, options=options, deterministic=mean))
            return found

        return Trained(
            test=test,
            seconds=run.seconds,
            cpu_seconds=run.cpu_seconds,
            train_steps=run.steps * decision_steps(wrappers),
            policy=file.read_bytes(),
        )

    return learn


LEARNERS: dict[str, Learner] = {
    **{
        name: _from_package("train", "train", name)
        for name in ("ppo", "ppo-planned", "ppo-residual", "sac", "tqc", "tqc-her")
    },
    **{name: _from_package("clone", "clone", name) for name in ("clone", "dagger")},
}
"""All methods that learn, by name."""
