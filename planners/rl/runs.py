"""What stays of a training: the policy, the checkpoint to go on from, and the record of the run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hrsnake_env.errors import InputError
from hrsnake_env.files import locked, replacing
from planners.rl.checkpoints import read_progress
from planners.rl.network import NetworkPolicy, Origin
from planners.rl.settings import Settings
from planners.rl.watch import Progress

__all__ = ["CHECKPOINT", "TrainingRun", "old_progress", "origin_of", "run_folder", "write_run"]

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
        Decisions (several steps of the environment each with `ActionRepeat`) and episodes of all environments
        together, over all resumed runs.
    success : float or None
        Share of the last 100 episodes that began at the base, with actions sampled as in training; of
        imitation, of the test episodes after the last round.
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


@contextmanager
def run_folder(folder: Path) -> Iterator[None]:
    """Make a run's folder if it is missing, and keep it for this process alone."""
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        yield


def old_progress(checkpoint: Path, task: dict[str, Any], resume: bool) -> Progress | None:
    """Return how far the folder's run has come, None for a new one; refuse another's checkpoint."""
    if not checkpoint.exists():
        return None
    if not resume:
        raise InputError(
            f"Expected a folder without a run, but there is '{checkpoint}'; resume it, or move it."
        )
    old = read_progress(checkpoint)
    try:
        its, progress = dict(old["task"]), Progress.from_dict(old["progress"])
    except (KeyError, TypeError, ValueError):
        raise InputError(f"Expected a checkpoint of this version in '{checkpoint}', got another.") from None
    for key, value in task.items():
        if its.get(key) != value:
            raise InputError(
                f"Expected a run with {key}={value!r} to resume in '{checkpoint}', got one with "
                f"{key}={its.get(key)!r}."
            )
    return progress


def origin_of(settings: Settings, seed: int, steps: int) -> Origin:
    """Return where a policy comes from, for its file."""
    return Origin(
        method=settings.method,
        env_id=settings.env_id,
        env_kwargs=settings.evaluation_kwargs,
        wrappers=settings.evaluation_wrappers,
        seed=seed,
        train_steps=steps,
        versions=Origin.installed_versions(),
    )


def write_run(
    settings: Settings, seed: int, policy: NetworkPolicy, progress: Progress, stopped: str, folder: Path
) -> TrainingRun:
    """Write the policy and the record of the run."""
    policy.save(folder / POLICY)
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
