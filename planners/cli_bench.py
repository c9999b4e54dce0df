"""The commands of `hrsnake bench` that compare methods over studies, and go on where they were stopped."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from hrsnake_env.errors import InputError
from planners.cli_tools import INTERRUPTED

__all__ = ["add_studies"]

HELP = {
    "ladder": "Compare all methods on the ladder of tasks, and on random mazes that are held out.",
    "index": "Compare all methods over the index: link length over the longest rod that passes.",
    "links": "Compare planners over the number of links, in U-turns with legs of any length.",
    "tightest": "Find the largest index at which each planner has a valid motion.",
}


def add_studies(app: typer.Typer) -> None:
    """Add a command for each study."""
    for study, text in HELP.items():
        app.command(study, help=f"{text} Ctrl-C: stop; the same command goes on.")(_command(study))


def _command(study: str) -> Callable[..., None]:
    def command(
        out: Annotated[Path, typer.Option("--out", help="Folder of the study; made if missing.")],
        methods: Annotated[str, typer.Option("--methods", help="Some methods, as track,ppo.")] = "",
        tasks: Annotated[
            str, typer.Option("--tasks", help="Some tasks, by name or pattern, as 'u-turn*'.")
        ] = "",
        seeds: Annotated[str, typer.Option("--seeds", help="Of methods that draw, as 0,1,2.")] = "",
        budget: Annotated[
            float | None, typer.Option("--budget", help="Seconds of each planning query.")
        ] = None,
        train_steps: Annotated[
            int | None, typer.Option("--train-steps", help="Decisions of each training.")
        ] = None,
        engine: Annotated[str, typer.Option("--engine", help="processes or ray.")] = "processes",
        address: Annotated[
            str | None, typer.Option("--address", help="Of an existing Ray cluster, as auto.")
        ] = None,
        workers: Annotated[
            int | None, typer.Option("--workers", help="Processes; by default one for each processor.")
        ] = None,
        skip_missing: Annotated[
            bool, typer.Option("--skip-missing", help="Leave out methods that are not installed.")
        ] = False,
        retry_errors: Annotated[
            bool, typer.Option("--retry-errors", help="Do again what has ended with an error.")
        ] = False,
        quick: Annotated[bool, typer.Option("--quick", help="A sample of it, in minutes.")] = False,
        dry_run: Annotated[
            bool, typer.Option("--dry-run", help="Say how much there is to do, and stop.")
        ] = False,
    ) -> None:
        from planners.bench import campaign
        from planners.bench.engines import check_engine
        from planners.bench.studies import study_cells

        check_engine(engine, workers, address)
        cells = study_cells(
            study,
            methods=_words(methods),
            tasks=_words(tasks),
            seeds=_numbers(seeds),
            budget=budget,
            train_steps=train_steps,
            quick=quick,
            skip_missing=skip_missing,
        )
        left = campaign.remaining(cells, out, retry_errors=retry_errors)
        print(
            f"{study}: {len(cells)} cells, {len(cells) - len(left)} of them finished; the others take "
            f"{campaign.worst_hours(left, workers):.2g} h at most.",
            file=sys.stderr,
        )
        if dry_run:
            return
        done = campaign.run_cells(
            cells,
            out,
            engine=engine,
            workers=workers,
            address=address,
            retry_errors=retry_errors,
        )
        print(f"{done.rows} rows in '{out / campaign.ROWS}', {done.errors} of this run's with an error.")
        if not done.complete:
            print(
                f"Stopped after {done.done} of {done.cells} cells; the same command goes on.", file=sys.stderr
            )
            raise typer.Exit(INTERRUPTED)

    return command


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _numbers(text: str) -> list[int]:
    try:
        return [int(word) for word in _words(text)]
    except ValueError:
        raise InputError(f"Expected seeds as whole numbers with commas (0,1,2), got '{text}'.") from None
