"""Train a policy in an environment: seeded, watched, and stopped and resumed without loss."""

from __future__ import annotations

import dataclasses
import json
import os
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hrsnake_env.arguments import check_at_least, is_number
from hrsnake_env.errors import InputError
from planners.rl.checkpoints import write_checkpoint
from planners.rl.clone import clone
from planners.rl.models import learners, new_model, resumed_model, vector
from planners.rl.network import NetworkPolicy
from planners.rl.runs import CHECKPOINT, TrainingRun, old_progress, origin_of, run_folder, write_run
from planners.rl.settings import CLONING, METHODS, Settings, load_settings
from planners.rl.watch import Progress, Watch, stop_on_interrupt, training_bar

__all__ = ["METHODS", "TrainingRun", "train"]

CHECKPOINT_STEPS = {"ppo": 50_000, "sac": 10_000, "tqc": 10_000}
"""From one checkpoint to the next: about as long for each, as steps of off-policy learners take longer."""


def train(
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
    settings: Settings | None = None,
) -> TrainingRun:
    """Train until the task is learnt, or for a number of steps.

    The task is learnt when `stop_at` of the last 100 episodes that began at the base have succeeded; where
    most begin on a planned motion, 20 are enough. Ctrl-C stops at the next step and keeps what is there. A
    run that is resumed goes on from the last checkpoint with episodes that begin anew, and so not to the last
    bit as if it had never stopped; the same checkpoint always goes on in the same way.

    Parameters
    ----------
    method : str
        One of `METHODS`, or of `CLONING`, for which see `planners.rl.clone`.
    env_id : str
        A registered id.
    seed : int
        The same seed gives the same policy, on the same machine with the same versions.
    steps : int, optional
        Of all environments together, rounded up to whole rollouts; by default the settings' own.
    folder : path
        For the checkpoint, the policy, the record of the run, and logs for TensorBoard if it is installed.
    resume : bool
        Go on from the checkpoint in the folder, if there is one.
    env_kwargs : dict, optional
        For the environment, after the settings' own. Rewards, the time limit and what a collision does are
        those of training alone: a policy is tested with the registered ones.
    stop_at : float
        Share of successful episodes, over 0; over 1 it is never reached.
    quiet : bool
        Whether to show no bar.
    settings : Settings, optional
        Others than `load_settings` has.

    Raises
    ------
    InputError
        If stable-baselines3 is not installed, an argument is unknown or out of its range, the folder holds
        another run, or has one that shall not be resumed.
    """
    check_at_least("seed", seed, 0, whole=True)
    if seed >= 2**31:
        raise InputError(f"Expected a seed under 2**31, got {seed}.")
    if not (is_number(stop_at) and stop_at > 0.0):
        raise InputError(f"Expected a positive stop_at, got {stop_at!r}.")
    if method in CLONING and settings is None:
        return clone(
            method,
            env_id,
            seed=seed,
            steps=steps,
            folder=folder,
            resume=resume,
            env_kwargs=env_kwargs,
            stop_at=stop_at,
            quiet=quiet,
        )
    chosen = load_settings(method, env_id) if settings is None else settings
    if (chosen.method, chosen.env_id) != (method, env_id):
        raise InputError(
            f"Expected settings of {method} for {env_id}, got those of {chosen.method} for {chosen.env_id}."
        )
    chosen = dataclasses.replace(chosen, env_kwargs={**chosen.env_kwargs, **(env_kwargs or {})})
    total = chosen.n_timesteps if steps is None else steps
    check_at_least("steps", total, 1, whole=True)
    torch = learners()
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # small networks are slower with more
    try:
        with closing(vector(chosen)) as envs, run_folder(Path(folder)):
            return _run(chosen, envs, seed, total, Path(folder), resume, stop_at, quiet)
    finally:
        torch.set_num_threads(threads)


def _run(
    settings: Settings,
    envs: Any,
    seed: int,
    total: int,
    folder: Path,
    resume: bool,
    stop_at: float,
    quiet: bool,
) -> TrainingRun:
    """Train from the start, or from where the folder's checkpoint stands."""
    checkpoint = folder / CHECKPOINT
    task = json.loads(json.dumps({**asdict(settings), "seed": seed}))
    task.pop("n_timesteps")  # a resumed run may be longer
    old = old_progress(checkpoint, task, resume)
    if old is None:
        progress, model = Progress(), new_model(settings, envs, seed, folder)
    else:
        progress, model = old, resumed_model(settings, envs, seed, checkpoint)

    def keep(model: Any) -> None:
        write_checkpoint(checkpoint, model, {"task": task, "progress": progress.to_dict()})

    every = CHECKPOINT_STEPS[settings.algorithm]
    with stop_on_interrupt() as stop, training_bar(settings.method, total, quiet) as tell:
        watch = Watch(progress, stop_at=stop_at, checkpoint=keep, every=every, stop=stop, tell=tell)
        left = total - progress.steps
        if left > 0 and not progress.learnt(stop_at):
            model.learn(left, callback=_callback(watch), reset_num_timesteps=old is None)
            watch.clock()
            watch.mark()
            keep(model)
        stopped = "learnt" if progress.learnt(stop_at) else "interrupted" if stop.asked else "steps"
        policy = NetworkPolicy.from_model(model, origin_of(settings, seed, progress.steps))
        return write_run(settings, seed, policy, progress, stopped, folder)


def _callback(watch: Watch) -> Any:
    """Let stable-baselines3 tell the watch what happens."""
    from stable_baselines3.common.callbacks import BaseCallback

    class Callback(BaseCallback):
        def _on_rollout_start(self) -> None:
            watch.between(self.model)

        def _on_step(self) -> bool:
            return watch.step(self.num_timesteps, self.locals["dones"], self.locals["infos"])

    return Callback()
