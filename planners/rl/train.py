"""Train a policy in an environment: seeded, watched, and stopped and resumed without loss."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterator
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hrsnake_env.arguments import check_at_least, is_number
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.rl.checkpoints import read_progress, write_checkpoint
from planners.rl.models import learners, new_model, resumed_model, vector
from planners.rl.network import NetworkPolicy, Origin
from planners.rl.settings import METHODS, Settings, load_settings
from planners.rl.watch import Progress, Watch, stop_on_interrupt, training_bar

__all__ = ["METHODS", "TrainingRun", "train"]

CHECKPOINT_STEPS = {"ppo": 50_000, "sac": 10_000, "tqc": 10_000}
"""From one checkpoint to the next: about as long for each, as steps of off-policy learners take longer."""

STOPPED = {
    "learnt": "the task is learnt",
    "steps": "all steps are done",
    "interrupted": "by Ctrl-C; --resume goes on",
}

CHECKPOINT, POLICY, RUN = "checkpoint.zip", "policy.npz", "run.json"


@dataclass(frozen=True, kw_only=True)
class TrainingRun:
    """Hold what came of a training.

    Parameters
    ----------
    method, env_id, seed
        What was trained.
    steps, episodes : int
        Of all environments together, over all resumed runs.
    success : float or None
        Share of the last 100 episodes that began at the base, with actions sampled as in training.
    success_planned : float or None
        The same of episodes that began elsewhere, as on a planned motion.
    stopped : {"learnt", "steps", "interrupted"}
        Why it ended.
    cpu_seconds, seconds : float
        Of the process, and on the clock; over all resumed runs.
    curve : tuple of (steps, cpu_seconds, success)
        The learning curve.
    policy, checkpoint : Path
        Files in the folder.
    """

    method: str
    env_id: str
    seed: int
    steps: int
    episodes: int
    success: float | None
    success_planned: float | None
    stopped: str
    cpu_seconds: float
    seconds: float
    curve: tuple[tuple[float, ...], ...]
    policy: Path
    checkpoint: Path

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {**asdict(self), "policy": str(self.policy), "checkpoint": str(self.checkpoint)}

    def rows(self) -> Iterator[tuple[str, str]]:
        """Write the figures for people."""
        share = "no episode from the base" if self.success is None else f"{self.success:.0%}"
        yield "success", f"{share} of the last episodes from the base, sampled actions"
        if self.success_planned is not None:
            yield "from elsewhere", f"{self.success_planned:.0%} of the last that began on a planned motion"
        yield "steps", f"{self.steps}, {self.episodes} episodes"
        yield "time", f"{self.seconds:.1f} s, {self.cpu_seconds:.1f} s of the processor"
        yield "stopped", STOPPED[self.stopped]
        yield "policy", str(self.policy)
        yield "checkpoint", str(self.checkpoint)


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
        One of `METHODS`.
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
        For the environment, after the settings' own.
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
        with closing(vector(chosen)) as envs:
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
    old = _old_progress(checkpoint, task, resume)
    folder.mkdir(parents=True, exist_ok=True)
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
        return _finish(settings, seed, model, progress, stopped, folder)


def _old_progress(checkpoint: Path, task: dict[str, Any], resume: bool) -> Progress | None:
    """Return how far the folder's run has come, None for a new one; refuse another's checkpoint."""
    if not checkpoint.exists():
        return None
    if not resume:
        raise InputError(
            f"Expected a folder without a run, but there is '{checkpoint}'; resume it, or move it."
        )
    old = read_progress(checkpoint)
    try:
        its, progress = dict(old["task"]), Progress(**old["progress"])
    except (KeyError, TypeError, ValueError):
        raise InputError(f"Expected a checkpoint of this version in '{checkpoint}', got another.") from None
    for key, value in task.items():
        if its.get(key) != value:
            raise InputError(
                f"Expected a run with {key}={value!r} to resume in '{checkpoint}', got one with "
                f"{key}={its.get(key)!r}."
            )
    return progress


def _callback(watch: Watch) -> Any:
    """Let stable-baselines3 tell the watch what happens."""
    from stable_baselines3.common.callbacks import BaseCallback

    class Callback(BaseCallback):
        def _on_rollout_start(self) -> None:
            watch.between(self.model)

        def _on_step(self) -> bool:
            return watch.step(self.num_timesteps, self.locals["dones"], self.locals["infos"])

    return Callback()


def _finish(
    settings: Settings, seed: int, model: Any, progress: Progress, stopped: str, folder: Path
) -> TrainingRun:
    """Write the policy and the record of the run."""
    origin = Origin(
        method=settings.method,
        env_id=settings.env_id,
        env_kwargs=settings.env_kwargs,
        wrappers=settings.evaluation_wrappers,
        seed=seed,
        train_steps=progress.steps,
        versions=Origin.installed_versions(),
    )
    NetworkPolicy.from_model(model, origin).save(folder / POLICY)
    run = TrainingRun(
        method=settings.method,
        env_id=settings.env_id,
        seed=seed,
        steps=progress.steps,
        episodes=progress.episodes,
        success=progress.success,
        success_planned=progress.success_planned,
        stopped=stopped,
        cpu_seconds=progress.cpu_seconds,
        seconds=progress.seconds,
        curve=tuple(map(tuple, progress.curve)),
        policy=folder / POLICY,
        checkpoint=folder / CHECKPOINT,
    )
    with replacing(folder / RUN) as part:
        part.write_text(json.dumps(run.to_dict(), indent=1), encoding="utf-8")
    return run
