"""Demonstrations of the planner as a Minari data set, for imitation and offline reinforcement learning."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

import hrsnake_env
from hrsnake_env.arguments import check_at_least, is_number
from hrsnake_env.errors import InputError
from hrsnake_env.files import scratch_folder
from hrsnake_env.registration import ENVIRONMENTS
from planners.dataset_writer import DatasetWriter, mean_return
from planners.problem import Progress

__all__ = ["Recording", "dataset_ids", "record_dataset"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Recording:
    """Hold what was recorded.

    Parameters
    ----------
    dataset_id, env_id : str
        Of the data set and its environment.
    path : Path
        Of the data set; nothing is there if no episode was kept.
    successes : dict from float to list of bool
        By noise level, whether each episode reached the goal; those that were not kept count, too.
    n_episodes, n_steps : int
        Kept.
    n_links, link_length : int and float
        Of the arm; lengths are in maze units.
    unplanned : int
        Mazes without a plan.
    random_return, expert_return : float or None
        Mean returns of random actions and of the noiseless planner; None if nothing was planned.
    seconds : float
        Wall time.
    """

    dataset_id: str
    env_id: str
    path: Path
    successes: dict[float, list[bool]]
    n_episodes: int
    n_steps: int
    n_links: int
    link_length: float
    unplanned: int
    random_return: float | None
    expert_return: float | None
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data."""
        rates = [
            {"noise": noise, "episodes": len(all_), "successes": sum(all_)}
            for noise, all_ in self.successes.items()
        ]
        fields = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {**fields, "path": str(self.path) if self.n_episodes else None, "successes": rates}

    def rows(self) -> Iterator[tuple[str, str]]:
        """Write the figures."""
        yield "environment", self.env_id
        yield "kept", f"{self.n_episodes} episodes, {self.n_steps} steps"
        for noise, all_ in self.successes.items():
            yield f"noise {noise:g}", f"{sum(all_)} of {len(all_)} episodes reached the goal"
        if self.unplanned:
            arm = f"{self.n_links} links of {self.link_length:g}"
            yield (
                "without a plan",
                f"{self.unplanned} mazes, left out: no motion for an arm of {arm} was found",
            )
        if self.expert_return is not None:
            yield "mean return", f"{self.expert_return:.4g} planner, {self.random_return:.4g} random actions"
        yield "time", f"{self.seconds:.3g} s"
        yield "written", str(self.path) if self.n_episodes else "nothing"


def dataset_ids(dataset_id: str, env_ids: Sequence[str]) -> list[str]:
    """Return an id for the data set of each environment: a data set has the spaces of one environment.

    Raises
    ------
    InputError
        If an environment is unknown.

    Examples
    --------
    >>> dataset_ids("planner-v0", ["HyperRedundantMaze-Straight-v0"])
    ['planner-v0']
    >>> dataset_ids("arm/planner-v0", ["HyperRedundantMaze-Straight-v0", "HyperRedundantMaze-Bend-I30-v0"])
    ['arm/Straight/planner-v0', 'arm/Bend-I30/planner-v0']
    """
    for env_id in env_ids:
        if env_id not in ENVIRONMENTS:
            raise InputError(f"Unknown environment {env_id!r}. Available: {', '.join(ENVIRONMENTS)}.")
    if len(env_ids) == 1:
        return [dataset_id]
    folder, _, name = dataset_id.rpartition("/")
    middle = [env_id.removesuffix("-v0").removeprefix("HyperRedundantMaze").strip("-") for env_id in env_ids]
    return ["/".join(filter(None, (folder, part, name))) for part in middle]


def record_dataset(
    dataset_id: str,
    env_id: str,
    *,
    episodes: int = 10,
    noises: Sequence[float] = (0.0, 0.3),
    seed: int = 0,
    mazes: Sequence[str] = (),
    only_success: bool = False,
    path: str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Record episodes in which the planner drives the arm, as a Minari data set.

    In each episode Gaussian noise of one level is added to the actions, and the planner leads the arm back
    (`Demonstrator`). The actions are those taken; `infos["expert_action"]` at step k + 1 is what the planner
    would have done instead of action k. Each episode's metadata hold `noise`, `success`, `maze` and
    `task_id`. Reference scores are the mean returns of random actions (0) and of the noiseless planner (1).

    A run that is broken off leaves no data set behind.

    Parameters
    ----------
    dataset_id : str
        As Minari has it: (namespace/)name-v0.
    env_id : str
        A key of `hrsnake_env.registration.ENVIRONMENTS`.
    episodes : int
        At each noise level and in each maze of `mazes`. Without noise and random mazes all would be alike:
        then there is one.
    noises : sequence of float
        Standard deviations, in shares of the largest action.
    seed : int
        Of the first episode; later ones have the next numbers. All noise levels see the same random mazes.
    mazes : sequence of str
        Names or files of other mazes for the environment's arm; they are options of the reset.
    only_success : bool
        Whether to keep only episodes that reach the goal.
    path : path, optional
        Folder of data sets; by default Minari's own, which `MINARI_DATASETS_PATH` names.
    progress : callable, optional
        Called with `dataset_id` and the share done.

    Returns
    -------
    recording : Recording
        What was recorded; if no episode was kept, nothing is written.

    Raises
    ------
    InputError
        If Minari is not installed, an argument is out of its range, or the data set is there already.
    """
    begin = time.perf_counter()
    if isinstance(mazes, str):
        raise InputError(f"Expected a list of mazes, got the string {mazes!r}.")
    check_at_least("episodes", episodes, 1, whole=True)
    check_at_least("seed", seed, 0, whole=True)
    levels = _checked_levels(noises)
    root = _datasets_folder(path)
    folder = _new_folder(root, dataset_id)
    dataset_ids(dataset_id, [env_id])
    env = gym.make(f"{hrsnake_env.__name__}:{env_id}")
    starts: list[tuple[int, str | None]] = [
        (seed + k, maze) for k in range(episodes) for maze in (mazes or (None,))
    ]
    for name in mazes:  # a maze that does not suit the arm is told before the work
        env.reset(options={"maze": name})
    # Hidden, so that Minari does not list it; beside the others, so that it can be renamed.
    root.mkdir(parents=True, exist_ok=True)
    with scratch_folder(root) as part:
        whole = part / "whole"
        whole.mkdir()
        writer = DatasetWriter(env, whole / "data", only_success)
        for number, (start, maze) in enumerate(starts):
            if progress is not None:
                progress(dataset_id, number / len(starts))
            writer.add(start, maze, levels, first=number < max(len(mazes), 1))
        if writer.n_episodes:
            writer.finish(dataset_id, levels)
            folder.parent.mkdir(parents=True, exist_ok=True)
            if folder.exists():
                raise _taken(dataset_id, root)
            whole.rename(folder)
    env.close()
    return Recording(
        dataset_id=dataset_id,
        env_id=env_id,
        path=folder,
        successes=writer.successes,
        n_episodes=writer.n_episodes,
        n_steps=writer.n_steps,
        n_links=env.unwrapped.arm.n_links,  # type: ignore[attr-defined]
        link_length=env.unwrapped.arm.link_length,  # type: ignore[attr-defined]
        unplanned=writer.unplanned,
        random_return=mean_return(writer.random_returns),
        expert_return=mean_return(writer.expert_returns),
        seconds=time.perf_counter() - begin,
    )


def _datasets_folder(path: str | os.PathLike[str] | None) -> Path:
    """Return the folder of all data sets, if there is something to write them with."""
    try:
        import h5py  # noqa: F401
        from minari.storage import get_dataset_path
    except ImportError:
        raise InputError(
            'Expected minari to be installed, to write data sets: pip install "hrsnake[data]".'
        ) from None
    return Path(get_dataset_path() if path is None else path).absolute()  # Minari wants it so


def _new_folder(root: Path, dataset_id: str) -> Path:
    """Return where a data set shall stand; refuse an id that Minari cannot read, or that is taken."""
    from minari.dataset.minari_dataset import parse_dataset_id

    try:
        parse_dataset_id(dataset_id)
    except (ValueError, TypeError):  # the latter without a version
        raise InputError(
            f"Expected the id of a data set as name-v0 or namespace/name-v0, of letters, digits, _ and -, "
            f"and no namespace of a single letter, got {dataset_id!r}."
        ) from None
    folder = root / dataset_id
    if folder.exists():
        raise _taken(dataset_id, root)
    return folder


def _taken(dataset_id: str, root: Path) -> InputError:
    return InputError(f"Expected the id of a new data set, but '{dataset_id}' is in '{root}' already.")


def _checked_levels(noises: Sequence[float]) -> tuple[float, ...]:
    """Return the noise levels, each once."""
    levels = noises if isinstance(noises, Sequence) and not isinstance(noises, str) else ()
    if not levels:
        raise InputError(f"Expected a list of noise levels, got {noises!r}.")
    for noise in levels:
        if not (is_number(noise) and 0.0 <= noise <= 1.0):
            raise InputError(f"Expected noise levels from 0 to 1, got {noise!r}.")
    return tuple(dict.fromkeys(float(noise) for noise in levels))
