"""The commands of `hrsnake bench`: studies that compare methods, and what measures this project itself."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from hrsnake_env.errors import InputError
from planners.cli_tools import (
    INTERRUPTED,
    PICTURES,
    JsonOption,
    check_folder,
    check_output,
    print_outcome,
)

__all__ = ["bench_app"]

bench_app = typer.Typer(help="Measure, and print tables to paste.", no_args_is_help=True)

HELP = {
    "ladder": "Compare all methods on the ladder of tasks, and on random mazes that are held out.",
    "index": "Compare all methods over the index: link length over the longest rod that passes.",
    "links": "Compare planners over the number of links, in U-turns with legs of any length.",
    "tightest": "Find the largest index at which each planner has a valid motion.",
}


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


for _study, _text in HELP.items():
    bench_app.command(_study, help=f"{_text} Ctrl-C: stop; the same command goes on.")(_command(_study))


@bench_app.command("speed")
def bench_speed_command(
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer and smaller mazes: under a minute, not ten.")
    ] = False,
    parts: Annotated[str, typer.Option("--parts", help="Some of the parts, as stages,links.")] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Write all figures (.json).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure speed and scale: stages, growth, memory, first call, random mazes, and OMPL beside."""
    from planners.bench import speed
    from planners.bench.speed_tables import speed_markdown

    sizes = speed.QUICK if quick else speed.FULL
    chosen = _parts(parts, speed.PARTS, out)
    _publish(speed.run_speed(sizes, parts=chosen, quiet=as_json), speed_markdown, out, as_json)


@bench_app.command("paper")
def bench_paper_command(
    quick: Annotated[bool, typer.Option("--quick", help="Fewer lengths and mazes: under a minute.")] = False,
    parts: Annotated[str, typer.Option("--parts", help="Some of the parts, as poses,index.")] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Write all figures (.json).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure the paper's results: workspaces, time per pose, growth, index, families, and its rules."""
    from planners.bench import paper
    from planners.bench.paper_tables import paper_markdown

    sizes = paper.QUICK if quick else paper.FULL
    chosen = _parts(parts, paper.PARTS, out)
    _publish(paper.run_paper(sizes, parts=chosen, quiet=as_json), paper_markdown, out, as_json)


@bench_app.command("spatial")
def bench_spatial_command(
    quick: Annotated[bool, typer.Option("--quick", help="Fewer rooms, lengths and repeats.")] = False,
    parts: Annotated[str, typer.Option("--parts", help="Some of the parts, as figures,rooms.")] = "",
    out: Annotated[Path | None, typer.Option("--out", help="Write all figures (.json).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure in space: the paper's figures, longest links, random rooms, growth, radius, joint limits."""
    from planners.bench import spatial
    from planners.bench.spatial_tables import spatial_markdown

    sizes = spatial.QUICK if quick else spatial.FULL
    chosen = _parts(parts, spatial.PARTS, out)
    _publish(spatial.run_spatial(sizes, parts=chosen, quiet=as_json), spatial_markdown, out, as_json)


@bench_app.command("env")
def bench_env_command(
    quick: Annotated[bool, typer.Option("--quick", help="Shorter windows, fewer mazes and steps.")] = False,
    parts: Annotated[str, typer.Option("--parts", help="Some of the parts, as peers,where.")] = "",
    random_steps: Annotated[
        int | None, typer.Option("--random-steps", min=1, help="Of all random policies together.")
    ] = None,
    peers_python: Annotated[
        Path | None, typer.Option("--peers-python", help="A Python with gym-pusht and MuJoCo.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Write all figures (.json), and random runs to go on from (.jsonl)."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Draw where a step's time goes (.png, .svg, .pdf).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Measure the environment: speed beside peers, a step's pieces, resets, vectors, random policies."""
    from planners.bench import environment
    from planners.bench.environment_tables import environment_markdown
    from planners.bench.records import write_results

    check_output(picture, PICTURES)
    sizes = environment.QUICK if quick else environment.FULL
    if random_steps is not None:
        sizes = dataclasses.replace(sizes, random_steps=random_steps)
    results = environment.run_environment(
        sizes,
        parts=_parts(parts, environment.PARTS, out),
        peers=peers_python,
        rows=None if out is None else out.with_suffix(".jsonl"),
        keep=lambda done: None if out is None else write_results(done, out),
        quiet=as_json,
    )
    if picture is not None and "where" in results:
        from planners.bench.environment_chart import draw_where

        draw_where(results["where"], picture)
    _publish(results, environment_markdown, out, as_json)
    if "stopped" in results:
        raise typer.Exit(INTERRUPTED)


@bench_app.command("report")
def bench_report_command(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER...", help="Of studies, with their rows.")],
    out: Annotated[Path, typer.Option("--out", help="Folder for the report; made if missing.")],
    as_json: JsonOption = False,
) -> None:
    """Write tables, pictures and one HTML page of the studies in some folders."""
    from planners.bench.report import write_report

    check_folder(out)
    written = [str(path) for path in write_report(folders, out)]
    print_outcome(as_json, {"written": written}, lambda: print("\n".join(written)))


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",") if word.strip()]


def _numbers(text: str) -> list[int]:
    try:
        return [int(word) for word in _words(text)]
    except ValueError:
        raise InputError(f"Expected seeds as whole numbers with commas (0,1,2), got '{text}'.") from None


def _parts(text: str, every: tuple[str, ...], out: Path | None) -> tuple[str, ...]:
    """Read which parts of a benchmark are wanted; refuse a file that could not be written first."""
    check_output(out, (".json",))
    return tuple(part.strip() for part in text.split(",")) if text else every


def _publish(
    results: dict[str, Any], markdown: Callable[[dict[str, Any]], str], out: Path | None, as_json: bool
) -> None:
    """Write the results of a benchmark, and print them."""
    from planners.bench.records import write_results

    if out is not None:
        write_results(results, out)
    print_outcome(as_json, results, lambda: print(markdown(results)))
