"""The commands that teach and measure policies: demonstrations, training, evaluation."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from planners import tables
from planners.cli_tools import (
    INTERRUPTED,
    NOT_CLEAN,
    JsonOption,
    check_folder,
    check_output,
    name_of,
    print_outcome,
    progress_bars,
)
from planners.rl.settings import CLONING, FIRST_SEED, METHODS
from planners.rl.shipped import POLICIES, policy_path

__all__ = ["dataset_command", "evaluate_command", "train_command"]


def dataset_command(
    dataset_id: Annotated[
        str, typer.Argument(metavar="OUT_ID", help="As Minari has it: name-v0 or namespace/name-v0.")
    ],
    env: Annotated[
        list[str] | None,
        typer.Option("--env", help="An environment; a data set for each. By default random mazes."),
    ] = None,
    episodes: Annotated[int, typer.Option("--episodes", help="For each noise level and maze.")] = 10,
    noise: Annotated[
        list[float] | None,
        typer.Option("--noise", help="Of the actions, in shares of the largest one. By default 0 and 0.3."),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Of the first episode.")] = 0,
    maze: Annotated[
        list[str] | None, typer.Option("--maze", help="Another maze for the environment's arm.")
    ] = None,
    only_success: Annotated[
        bool, typer.Option("--only-success", help="Leave out episodes that miss the goal.")
    ] = False,
    path: Annotated[
        Path | None, typer.Option("--path", help="Folder of data sets; by default Minari's.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Record demonstrations of the planner as a Minari data set."""
    from planners.dataset import dataset_ids, record_dataset

    if path is not None:
        check_folder(path)
    env_ids = list(dict.fromkeys(env or ["HyperRedundantMaze-RandomTrain-v0"]))
    with progress_bars(as_json) as progress:
        recordings = [
            record_dataset(
                name,
                env_id,
                episodes=episodes,
                noises=noise or (0.0, 0.3),
                seed=seed,
                mazes=maze or (),
                only_success=only_success,
                path=path,
                progress=progress,
            )
            for name, env_id in zip(dataset_ids(dataset_id, env_ids), env_ids, strict=True)
        ]

    def show() -> None:
        for recording in recordings:
            tables.show_rows(f"Data set {recording.dataset_id}", recording.rows())

    print_outcome(as_json, {"datasets": [recording.to_dict() for recording in recordings]}, show)
    if not all(recording.n_episodes for recording in recordings):
        raise typer.Exit(NOT_CLEAN)


def train_command(
    env_id: Annotated[str, typer.Argument(metavar="ENV_ID", help="As HyperRedundantMaze-Straight-v0.")],
    method: Annotated[str, typer.Option("--method", help=f"{', '.join((*METHODS, *CLONING))}.")] = "ppo",
    seed: Annotated[int, typer.Option("--seed", help="The same seed gives the same policy.")] = 0,
    steps: Annotated[
        int | None, typer.Option("--steps", help="Of all environments together; by default the settings'.")
    ] = None,
    stop_at: Annotated[
        float, typer.Option("--stop-at", help="Share of the last 100 episodes at which the task is learnt.")
    ] = 0.98,
    settings: Annotated[
        Path | None, typer.Option("--settings", help="Other hyper-parameters, as RL Zoo has them (.yml).")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder; by default ENV_ID-METHOD-SEED.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the folder's checkpoint.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Train a policy, and write it as plain arrays. Ctrl-C: so far, to go on with --resume."""
    from planners.rl.settings import load_settings
    from planners.rl.train import train

    folder = Path(f"{env_id}-{method}-{seed}") if out is None else out
    chosen = None if settings is None else load_settings(method, env_id, file=settings)
    check_folder(folder)
    run = train(
        method,
        env_id,
        seed=seed,
        steps=steps,
        folder=folder,
        resume=resume,
        stop_at=stop_at,
        quiet=as_json,
        settings=chosen,
    )
    print_outcome(as_json, run.to_dict(), lambda: tables.show_rows(f"{method}: {env_id}", run.rows()))
    if run.stopped == "interrupted":
        raise typer.Exit(INTERRUPTED)


def evaluate_command(
    policy: Annotated[
        str,
        typer.Argument(metavar="POLICY", help=f"A trained policy (.npz), or one of: {', '.join(POLICIES)}."),
    ],
    env: Annotated[
        str | None, typer.Option("--env", help="By default the environment that it was trained in.")
    ] = None,
    episodes: Annotated[int, typer.Option("--episodes", help="Each with the next seed.")] = 100,
    seed: Annotated[int, typer.Option("--seed", help="Of the first episode.")] = FIRST_SEED,
    replay: Annotated[
        Path | None,
        typer.Option(
            "--replay", help="Write a page with the first episode, by mean and by sampled actions (.html)."
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure a trained policy from the base, with mean and with sampled actions."""
    from planners.rl.evaluate import evaluate_both, replayed, summary
    from planners.rl.network import NetworkPolicy

    check_output(replay, (".html",))
    acting = NetworkPolicy.load(policy_path(policy))
    facts = evaluate_both(acting, env, episodes=episodes, seed=seed)
    if replay is not None:
        from hrsnake_env.replay import save_replay

        save_replay(replayed(acting, env, seed=seed), replay)
    figures = {actions: summary(rows) for actions, rows in facts.items()}
    name = acting.origin.env_id if env is None else env
    print_outcome(
        as_json,
        {"env_id": name, "summary": figures, "episodes": facts, "replay": name_of(replay)},
        lambda: tables.show_evaluation(f"{acting.origin.method}: {name}", figures, replay),
    )
