"""The `hrsnake` command: plan, check, simulate, draw and play; train and evaluate; measure.

Exit codes: 0 done; 2 bad input, one sentence on stderr; 3 no plan, a motion that is not valid, or a verdict
that is not clean. `--json` prints one JSON object instead of tables.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import longest, tables
from planners.cli_bench import bench_app
from planners.cli_export import export_command
from planners.cli_learn import dataset_command, evaluate_command, train_command
from planners.cli_maps import import_command
from planners.cli_spatial import spatial_app
from planners.cli_studio import studio_command
from planners.cli_tools import (
    BAD_INPUT,
    INTERRUPTED,
    MAZE_HELP,
    NOT_CLEAN,
    PICTURES,
    JsonOption,
    LimitOption,
    MazeArgument,
    MotionArgument,
    OwnLimitOption,
    OwnRadiusOption,
    PlannerOption,
    RadiusOption,
    arm_of,
    check_folder,
    check_output,
    examples,
    lengths_in,
    mazes_named,
    name_of,
    one_bar,
    print_outcome,
    progress_bars,
    radians,
)
from planners.interrupts import careful_interrupts
from planners.length_trials import motion_path
from planners.planning import TIME_BUDGET, plan
from planners.problem import Motion, PlanningResult, Progress
from planners.validation import validate

__all__ = ["INTERRUPTED", "STOPPED", "app", "main"]

STOPPED = "hrsnake: stopped; no half-written file is left."

app = typer.Typer(name="hrsnake", pretty_exceptions_enable=False)

# Some versions of typer carry their own copy of click: its base of all usage errors is found by name.
UsageError: type[Exception] = next(
    cls for cls in typer.BadParameter.__mro__ if cls.__name__ == "ClickException"
)


@app.callback(invoke_without_command=True)
def help_command(context: typer.Context) -> None:
    """Plan and simulate hyper-redundant arms in spaces so tight that the links pinch the walls.

    `hrsnake COMMAND --help` says more, with examples. Exit codes: 0 done; 2 bad input; 3 no plan, or a
    verdict that is not clean.
    """
    if context.invoked_subcommand is None:
        print(context.get_help())


def plan_command(
    maze: MazeArgument,
    link_length: Annotated[float, typer.Option("--link-length", help="In maze units.")],
    links: Annotated[int | None, typer.Option("--links", help="By default as many as it takes.")] = None,
    link_radius: RadiusOption = 0.0,
    joint_limit: LimitOption = None,
    planner: PlannerOption = "auto",
    time_budget: Annotated[
        float, typer.Option("--time-budget", help="Seconds that planning may take.")
    ] = TIME_BUDGET,
    warm_start: Annotated[
        Path | None, typer.Option("--warm-start", help="A motion (.npz) in a similar maze, to start from.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Write the motion (.npz).")] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Draw five poses, or what was in the way (.png).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a motion from the feeder to the goal, and check it exactly.

    Without a plan (exit code 3) it says where the arm stopped, which wall is in the way, and a length with
    which the sweep gets past it; --picture shows it.
    """
    check_output(out, (".npz",))
    check_output(picture, PICTURES)
    world, arm = Maze.load(maze), _arm(link_length, links, link_radius, joint_limit)
    start = None if warm_start is None else Motion.load(warm_start)
    with progress_bars(as_json) as progress:
        result = plan(world, arm, planner, time_budget=time_budget, warm_start=start, progress=progress)
    if result.motion is not None and out is not None:
        result.motion.save(out)
    if picture is not None:
        _draw_result(world, arm, result, picture)
    print_outcome(
        as_json,
        {
            **result.to_dict(),
            "validation": _report_dict(result),
            "out": name_of(out, result.motion is not None),
            "picture": name_of(picture),
        },
        lambda: tables.show_plan(world, arm, result, [out], picture),
    )
    if not result.solved:
        raise typer.Exit(NOT_CLEAN)


def longest_command(
    maze: MazeArgument,
    planner: PlannerOption = "auto",
    link_radius: RadiusOption = 0.0,
    joint_limit: LimitOption = None,
    lengths: Annotated[
        str, typer.Option("--lengths", help="Further lengths for the table, as 100,200,300.")
    ] = "",
    accuracy: Annotated[
        float,
        typer.Option("--accuracy", help="Step of the lengths that are tried, as a share of the length."),
    ] = longest.ACCURACY,
    time_budget: Annotated[
        float, typer.Option("--time-budget", help="Seconds that planning may take for each length.")
    ] = longest.TIME_BUDGET,
    out: Annotated[Path | None, typer.Option("--out", help="Write the motion (.npz).")] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", help="Draw what each length needs (.png, .svg, .pdf).")
    ] = None,
    state: Annotated[
        Path | None,
        typer.Option("--state", help="File (.json) from which the next run goes on."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Find the longest link that reaches the goal, and how few links it takes. Ctrl-C: so far.

    The table says what shorter links need, too: their number, and the range and the speed of their joints.
    --state lets the same command go on where it was stopped.
    """
    check_output(out)
    check_output(plot, PICTURES)
    check_output(state, (".json",))
    world, limit = Maze.load(maze), radians(joint_limit)
    with one_bar(as_json) as progress:
        result = longest.longest_link(
            world,
            planner,
            link_radius=link_radius,
            joint_limit=limit,
            accuracy=accuracy,
            lengths=lengths_in(lengths),
            time_budget=time_budget,
            state=state,
            progress=progress,
        )
    files = [*_write_longest(world, result, out, plot), *_state_files(state)]
    print_outcome(
        as_json,
        {**result.to_dict(), "files": [str(path) for path in files]},
        lambda: tables.show_longest(world, result, files),
    )
    if not result.complete:
        raise typer.Exit(INTERRUPTED)
    if result.motion is None:
        raise typer.Exit(NOT_CLEAN)


def validate_command(
    maze: MazeArgument,
    motion: MotionArgument,
    link_radius: OwnRadiusOption = None,
    joint_limit: OwnLimitOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check a motion exactly: lengths, feeder, clearance, crossings, start and goal.

    The check shares no code with the planners, and looks between the poses, too. Exit code 3 if a rule is
    broken; the table says which, where and by how much.
    """
    world, moved = Maze.load(maze), Motion.load(motion)
    arm = arm_of(moved, link_radius, joint_limit)
    with progress_bars(as_json) as progress:
        report = validate(moved, world, arm, progress)
    print_outcome(
        as_json, tables.validation_dict(report), lambda: tables.show_validation(world, moved, report)
    )
    if not report.valid:
        raise typer.Exit(NOT_CLEAN)


def simulate_command(
    maze: MazeArgument,
    motion: MotionArgument,
    link_radius: OwnRadiusOption = None,
    substeps: Annotated[int, typer.Option("--substeps", help="Simulated steps per action.")] = 4,
    out: Annotated[Path | None, typer.Option("--out", help="Write an animation (.gif).")] = None,
    replay: Annotated[
        Path | None, typer.Option("--replay", help="Write a page to play it in a browser (.html).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Drive the simulated arm along a motion, and say whether its links merely pinched the walls.

    The walls are real bodies here: a link that runs into one is pushed. A link within a thousandth of its
    length of a wall pinches it; deeper is a collision, and exit code 3.
    """
    from hrsnake_env.replay import save_replay
    from planners.rollout import simulate_motion  # needs the simulator, which other commands do not

    check_output(out, (".gif",))
    check_output(replay, (".html",))
    world, moved = Maze.load(maze), Motion.load(motion)
    arm = arm_of(moved, link_radius)
    with progress_bars(as_json) as progress:
        episode = simulate_motion(moved, world, arm, substeps=substeps, progress=progress)
        if out is not None:
            _animate(world, episode, out, progress)
        if replay is not None:
            save_replay([episode.trace(world, link_radius=arm.link_radius)], replay)
    print_outcome(
        as_json,
        {
            "success": episode.success,
            "verdict": episode.report.to_dict(),
            "out": name_of(out),
            "replay": name_of(replay),
        },
        lambda: tables.show_verdict(world, episode, (out, replay)),
    )
    if not (episode.success and episode.report.clean):
        raise typer.Exit(NOT_CLEAN)


def draw_command(
    maze: MazeArgument,
    motion: Annotated[Path | None, typer.Argument(metavar="[MOTION]", help="A motion (.npz) to add.")] = None,
    link_radius: OwnRadiusOption = None,
    out: Annotated[Path | None, typer.Option("--out", help="The picture (.png, .svg, .pdf).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw a maze with its global path, left (green) and right (red) beams and critical corners.

    With a motion, five poses of it, too.
    """
    from planners.drawing import draw_geometry

    world = Maze.load(maze)
    moved = None if motion is None else Motion.load(motion)
    if moved is not None:
        moved.check_maze(world)
    picture = Path(f"{world.name}.png") if out is None else out
    check_output(picture, PICTURES)
    radius = (link_radius or 0.0) if moved is None else arm_of(moved, link_radius).link_radius
    summary = draw_geometry(world, moved, picture, radius)
    print_outcome(
        as_json, {**summary, "out": str(picture)}, lambda: tables.show_geometry(world, summary, picture)
    )


def demo_command(
    out: Annotated[Path, typer.Option("--out", help="Folder for the results; made if missing.")] = Path(
        "demo"
    ),
    as_json: JsonOption = False,
) -> None:
    """Plan, check and simulate the paper's benchmark (Fig. 19) with its links of 430 px."""
    from planners.demo import run_demo

    check_folder(out)
    with progress_bars(as_json) as progress:
        demo = run_demo(out, progress)
    print_outcome(as_json, demo.to_dict(), lambda: tables.show_demo(demo))
    if not demo.clean:
        raise typer.Exit(NOT_CLEAN)


def play_command(
    maze: Annotated[
        str, typer.Argument(metavar="[MAZE]", help=MAZE_HELP, autocompletion=mazes_named)
    ] = "fig19",
    link_length: Annotated[float | None, typer.Option("--link-length", help="In maze units.")] = None,
    links: Annotated[int | None, typer.Option("--links", help="By default enough to reach the goal.")] = None,
    planner: PlannerOption = "auto",
) -> None:
    """Drive the arm through a maze by keys or mouse, in a window; space lets the planner show how."""
    from planners.play import play

    play(Maze.load(maze), link_length, links, planner)


PLANNING = "Plan and check"
OWN = "One's own ducts and arms"
LEARNING = "Drive and learn"
MORE = "Space, and measuring"

for _panel, _name, _command, _examples in (
    (
        PLANNING,
        "demo",
        demo_command,
        ["hrsnake demo"],
    ),
    (
        PLANNING,
        "plan",
        plan_command,
        [
            "hrsnake plan fig19 --link-length 430 --out m.npz",
            "hrsnake plan fig19 --link-length 445 --picture why.png",
        ],
    ),
    (
        PLANNING,
        "validate",
        validate_command,
        ["hrsnake validate fig19 m.npz"],
    ),
    (
        PLANNING,
        "simulate",
        simulate_command,
        ["hrsnake simulate fig19 m.npz --replay m.html"],
    ),
    (
        PLANNING,
        "longest",
        longest_command,
        ["hrsnake longest fig19 --plot links.png --state fig19.json"],
    ),
    (
        OWN,
        "studio",
        studio_command,
        ["hrsnake studio", "hrsnake studio duct.geojson --port 9000 --no-browser"],
    ),
    (
        OWN,
        "import",
        import_command,
        [
            "hrsnake import docs/maps/duct.yaml --picture duct.png",
            "hrsnake import docs/maps/duct.yaml --base 0.1,0.5,0 --goal 10,0.5 --out duct.geojson",
            "hrsnake import docs/maps/channel.dxf --walls PILLARS --base-layer BASE --goal-layer GOAL",
        ],
    ),
    (
        OWN,
        "export",
        export_command,
        [
            "hrsnake export duct.geojson duct.npz --out duct.yaml --joint-speed 45",
            "hrsnake export fig19 m.npz --out arm.urdf --metres-per-unit 0.001",
        ],
    ),
    (OWN, "draw", draw_command, ["hrsnake draw fig19 m.npz --out fig19.png"]),
    (LEARNING, "play", play_command, ["hrsnake play fig19"]),
    (LEARNING, "dataset", dataset_command, ["hrsnake dataset arm/planner-v0 --episodes 50"]),
    (
        LEARNING,
        "train",
        train_command,
        ["hrsnake train HyperRedundantMaze-UTurn-I30-v0 --method sac --out run"],
    ),
    (LEARNING, "evaluate", evaluate_command, ["hrsnake evaluate u-turn-i60-ppo-planned"]),
):
    app.command(_name, rich_help_panel=_panel, epilog=examples(_examples))(_command)
app.add_typer(spatial_app, name="spatial", rich_help_panel=MORE)
app.add_typer(bench_app, name="bench", rich_help_panel=MORE)


def main() -> None:
    """Run the command line: one sentence on stderr and exit code 2 for bad input, no traceback."""
    try:
        with careful_interrupts():
            code = app(prog_name="hrsnake", standalone_mode=False)
            sys.stdout.flush()
    except InputError as error:
        sys.exit(_complain(str(error)))
    except UsageError as error:
        sys.exit(_complain(error.format_message()))  # type: ignore[attr-defined]
    except OSError as error:
        _drop_output()
        sys.exit(_complain(f"Expected files that can be read and written, got: {error}."))
    except MemoryError as error:
        sys.exit(_complain(f"Expected a motion that fits into memory, got: {error}. Longer links take less."))
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    if code == INTERRUPTED:  # typer turns Ctrl-C into this code
        print(STOPPED, file=sys.stderr)
    sys.exit(code or 0)


def _drop_output() -> None:
    """Forget what cannot be printed, as on a full disk: Python would try again at its end, and say so."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(message: str) -> int:
    print("hrsnake: " + " ".join(message.split()), file=sys.stderr)
    return BAD_INPUT


def _arm(link_length: float, links: int | None, link_radius: float, joint_limit: float | None) -> ArmSpec:
    limit = radians(joint_limit)
    return ArmSpec(link_length=link_length, n_links=links, link_radius=link_radius, joint_limit=limit)


def _write_longest(
    maze: Maze, result: longest.LongestLink, out: Path | None, plot: Path | None
) -> list[Path]:
    """Write motion and picture, as far as they are wanted and there; return their names."""
    written = []
    if out is not None and result.motion is not None:
        result.motion.save(out)
        written.append(out)
    if plot is not None:
        from planners.longest_chart import draw_longest

        draw_longest(maze, result, plot)
        written.append(plot)
    return written


def _state_files(state: Path | None) -> list[Path]:
    """Return the files of a search that are there."""
    return [] if state is None else [path for path in (state, motion_path(state)) if path.exists()]


def _report_dict(result: PlanningResult) -> dict[str, Any] | None:
    return None if result.report is None else tables.validation_dict(result.report)


def _draw_result(maze: Maze, arm: ArmSpec, result: PlanningResult, out: Path) -> None:
    from planners.drawing import draw_result

    draw_result(maze, arm, result, out)


def _animate(maze: Maze, episode: Any, out: Path, progress: Progress) -> None:
    from planners.drawing import animate

    animate(maze, episode, out, progress)
