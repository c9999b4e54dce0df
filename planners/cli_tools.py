"""What the commands share: their common options, what they print, bars of progress, checks of file names."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES
from planners.planning import PLANNERS
from planners.problem import Motion, Progress

if TYPE_CHECKING:
    from planners.spatial.problem import SpatialMotion

__all__ = [
    "BAD_INPUT",
    "INTERRUPTED",
    "MAZE_HELP",
    "NOT_CLEAN",
    "PICTURES",
    "JsonOption",
    "LimitOption",
    "MazeArgument",
    "MotionArgument",
    "OwnLimitOption",
    "OwnRadiusOption",
    "PlannerOption",
    "RadiusOption",
    "arm_of",
    "check_folder",
    "check_output",
    "examples",
    "lengths_in",
    "name_of",
    "one_bar",
    "print_outcome",
    "progress_bars",
    "radians",
]

BAD_INPUT = 2
NOT_CLEAN = 3
INTERRUPTED = 130

PICTURES = (".png", ".svg", ".pdf")


def mazes_named(incomplete: str) -> list[str]:
    """Return the mazes and maze files whose names begin so, for the shell's completion."""
    files = [str(path) for ending in (".geojson", ".json") for path in Path().glob(f"*{ending}")]
    return [name for name in (*MAZES, *sorted(files)) if name.startswith(incomplete)]


def planners_named(incomplete: str) -> list[str]:
    """Return the planners whose names begin so, for the shell's completion."""
    return [name for name in ("auto", *PLANNERS) if name.startswith(incomplete)]


MAZE_HELP = f"A .geojson file, or one of: {', '.join(MAZES)}."
MazeArgument = Annotated[str, typer.Argument(metavar="MAZE", help=MAZE_HELP, autocompletion=mazes_named)]
MotionArgument = Annotated[Path, typer.Argument(metavar="MOTION", help="A motion (.npz), as plan writes it.")]
PlannerOption = Annotated[
    str, typer.Option("--planner", help=f"auto, {', '.join(PLANNERS)}.", autocompletion=planners_named)
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of tables.")]
RadiusOption = Annotated[
    float,
    typer.Option("--link-radius", help="Half the thickness of the links, in units of the maze or workspace."),
]
LimitOption = Annotated[
    float | None,
    typer.Option("--joint-limit", help="Largest joint angle, in degrees. By default there is none."),
]

OwnRadiusOption = Annotated[
    float | None,
    typer.Option("--link-radius", help="Half the thickness of the links. By default what the motion says."),
]
OwnLimitOption = Annotated[
    float | None,
    typer.Option("--joint-limit", help="Largest joint angle, in degrees. By default what the motion says."),
]


def examples(lines: Sequence[str]) -> str:
    """Return the end of a help page: one example to a line."""
    return "\n\n".join([f"Example{'s' if len(lines) > 1 else ''}:", *(f"  {line}" for line in lines)])


def radians(joint_limit: float | None) -> float | None:
    """Return a joint limit in rad, checked."""
    if joint_limit is not None and not 0.0 < joint_limit <= 180.0:
        raise InputError(f"Expected --joint-limit over 0 and at most 180 degrees, got {joint_limit:g}.")
    return None if joint_limit is None else math.radians(joint_limit)


def arm_of(
    motion: Motion | SpatialMotion, link_radius: float | None, joint_limit: float | None = None
) -> ArmSpec:
    """Return the arm of a motion, but for what was given (degrees); say on stderr where that differs."""
    own, limit = motion.arm, radians(joint_limit)
    arm = replace(
        own,
        link_radius=own.link_radius if link_radius is None else link_radius,
        joint_limit=own.joint_limit if limit is None else limit,
    )
    if arm.link_radius != own.link_radius:
        _note(f"--link-radius {arm.link_radius:g}", f"of radius {own.link_radius:g}")
    if limit is not None and not math.isclose(limit, own.joint_limit or math.inf):
        bent = (
            "that bend freely" if own.joint_limit is None else f"of {math.degrees(own.joint_limit):g} degrees"
        )
        _note(f"--joint-limit {joint_limit:g}", f"with joints {bent}")
    return arm


def _note(given: str, own: str) -> None:
    print(f"Note: {given} is used; the motion was made for links {own}.", file=sys.stderr)


def lengths_in(text: str) -> list[float]:
    """Read lengths with commas between them."""
    try:
        return [float(part) for part in text.split(",")] if text.strip() else []
    except ValueError:
        raise InputError(
            f"Expected lengths as numbers with commas between them (100,200,300), got '{text}'."
        ) from None


def print_outcome(as_json: bool, data: dict[str, Any], show: Callable[[], None]) -> None:
    """Print an outcome as one JSON object, or as tables."""
    if as_json:
        print(json.dumps(data))
    else:
        show()


def name_of(path: Path | None, written: bool = True) -> str | None:
    """Return the name of a file that was written, for JSON."""
    return str(path) if path is not None and written else None


def check_output(path: Path | None, endings: tuple[str, ...] = ()) -> None:
    """Refuse a file that could not be written, before the work is done."""
    if path is None:
        return
    if endings and path.suffix.lower() not in endings:
        raise InputError(f"Expected a file name ending in {', '.join(endings)}, got '{path}'.")
    if not path.parent.is_dir():
        raise InputError(f"Expected an existing folder for '{path}', but there is no '{path.parent}'.")
    if path.exists() and not path.is_file():
        what = "a folder" if path.is_dir() else "no file"
        raise InputError(f"Expected a file name to write, but '{path}' is {what}.")
    if path.exists() and not os.access(path, os.W_OK):
        raise InputError(f"Expected a file that may be written, but '{path}' may not.")
    if not os.access(path.parent, os.W_OK):
        raise InputError(f"Expected a folder that can be written, but '{path.parent}' cannot.")


def check_folder(path: Path) -> None:
    """Refuse a folder that could not be written to, before the work is done."""
    if path.exists() and not path.is_dir():
        raise InputError(f"Expected a folder, but '{path}' is a file.")
    if not path.exists() and not path.parent.is_dir():
        raise InputError(f"Expected an existing folder for '{path}', but there is no '{path.parent}'.")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InputError(f"Expected a folder that can be written, but '{path}' cannot.")


@contextmanager
def progress_bars(quiet: bool) -> Iterator[Progress]:
    """Show a bar per stage on stderr, where somebody can see it."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    console = Console(stderr=True)
    columns = (TextColumn("{task.description:<10}"), BarColumn(), TimeElapsedColumn())
    with Bars(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bars:
        tasks: dict[str, Any] = {}

        def tell(stage: str, share: float) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=share)

        yield tell


@contextmanager
def one_bar(quiet: bool) -> Iterator[Progress]:
    """Show one bar on stderr whose text is the news, where somebody can see it."""
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    console = Console(stderr=True)
    columns = (BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    with Bars(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bars:
        task = bars.add_task("", total=1.0)
        yield lambda news, share: bars.update(task, description=news, completed=share)
