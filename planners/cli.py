"""The `hrsnake` command: plan, check, simulate, draw and play; train and evaluate; measure.

Exit codes: 0 done; 2 bad input, one sentence on stderr; 3 no plan, a motion that is not valid, or a verdict
that is not clean. `--json` prints one JSON object instead of tables.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES, Maze
from planners import longest, tables
from planners.cli_bench import add_studies
from planners.cli_spatial import spatial_app
from planners.cli_tools import (
    BAD_INPUT,
    INTERRUPTED,
    NOT_CLEAN,
    PICTURES,
    JsonOption,
    LimitOption,
    RadiusOption,
    check_folder,
    check_output,
    lengths_in,
    name_of,
    one_bar,
    print_outcome,
    progress_bars,
    radians,
)
from planners.length_trials import motion_path
from planners.planning import PLANNERS, TIME_BUDGET, plan
from planners.problem import Motion, PlanningResult, Progress
from planners.rl.settings import CLONING, FIRST_SEED, METHODS
from planners.rl.shipped import POLICIES, policy_path
from planners.validation import validate

__all__ = ["app", "main"]

app = typer.Typer(
    name="hrsnake",
    add_completion=False,
    pretty_exceptions_enable=False,
)

bench_app = typer.Typer(help="Measure, and print tables to paste.")
app.add_typer(bench_app, name="bench")
add_studies(bench_app)
app.add_typer(spatial_app, name="spatial")

# Some versions of typer carry their own copy of click: its base of all usage errors is found by name.
UsageError: type[Exception] = next(
    cls for cls in typer.BadParameter.__mro__ if cls.__name__ == "ClickException"
)

MazeArgument = Annotated[
    str, typer.Argument(metavar="MAZE", help=f"A .geojson file, or one of: {', '.join(MAZES)}.")
]
MotionArgument = Annotated[Path, typer.Argument(metavar="MOTION", help="A motion (.npz).")]
PlannerOption = Annotated[str, typer.Option("--planner", help=f"auto, {', '.join(PLANNERS)}.")]


@app.callback(invoke_without_command=True)
def help_command(context: typer.Context) -> None:
    """Plan and simulate hyper-redundant arms in spaces so tight that the links pinch the walls."""
    if context.invoked_subcommand is None:
        print(context.get_help())


@app.command("plan")
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
    """Plan a motion from the feeder to the goal, and check it exactly."""
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


@app.command("longest")
def longest_command(
    maze: MazeArgument,
    planner: PlannerOption = "auto",
    link_radius: RadiusOption = 0.0,
    joint_limit: LimitOption = None,
    lengths: Annotated[
        str, typer.Option("--lengths", help="Further lengths for the table, as 100,200,300.")
    ] = "",
    accuracy: Annotated[
        float, typer.Option("--accuracy", help="Step of the lengths, as a share.")
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
    """Find the longest link that reaches the goal, and what arms with shorter links need. Ctrl-C: so far."""
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


@app.command("validate")
def validate_command(
    maze: MazeArgument,
    motion: MotionArgument,
    link_radius: RadiusOption = 0.0,
    joint_limit: LimitOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check a motion exactly: lengths, feeder, clearance at and between poses, crossings, start and goal."""
    world, moved = Maze.load(maze), Motion.load(motion)
    arm = _arm(moved.link_length, moved.n_links, link_radius, joint_limit)
    with progress_bars(as_json) as progress:
        report = validate(moved, world, arm, progress)
    print_outcome(
        as_json, tables.validation_dict(report), lambda: tables.show_validation(world, moved, report)
    )
    if not report.valid:
        raise typer.Exit(NOT_CLEAN)


@app.command("simulate")
def simulate_command(
    maze: MazeArgument,
    motion: MotionArgument,
    link_radius: RadiusOption = 0.0,
    substeps: Annotated[int, typer.Option("--substeps", help="Simulated steps per action.")] = 4,
    out: Annotated[Path | None, typer.Option("--out", help="Write an animation (.gif).")] = None,
    replay: Annotated[
        Path | None, typer.Option("--replay", help="Write a page to play it in a browser (.html).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Drive the simulated arm along a motion, and say whether its links merely pinched the walls."""
    from hrsnake_env.replay import save_replay
    from planners.rollout import simulate_motion  # needs the simulator, which other commands do not

    check_output(out, (".gif",))
    check_output(replay, (".html",))
    world, moved = Maze.load(maze), Motion.load(motion)
    arm = _arm(moved.link_length, moved.n_links, link_radius, None)
    with progress_bars(as_json) as progress:
        episode = simulate_motion(moved, world, arm, substeps=substeps, progress=progress)
        if out is not None:
            _animate(world, episode, out, progress)
        if replay is not None:
            save_replay([episode.trace(world, link_radius=link_radius)], replay)
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


@app.command("draw")
def draw_command(
    maze: MazeArgument,
    motion: Annotated[Path | None, typer.Argument(metavar="[MOTION]", help="A motion (.npz) to add.")] = None,
    link_radius: RadiusOption = 0.0,
    out: Annotated[Path | None, typer.Option("--out", help="The picture (.png, .svg, .pdf).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw a maze with its global path, left (green) and right (red) beams and critical corners."""
    from planners.drawing import draw_geometry

    world = Maze.load(maze)
    moved = None if motion is None else Motion.load(motion)
    if moved is not None:
        moved.check_maze(world)
    picture = Path(f"{world.name}.png") if out is None else out
    check_output(picture, PICTURES)
    summary = draw_geometry(world, moved, picture, link_radius)
    print_outcome(
        as_json, {**summary, "out": str(picture)}, lambda: tables.show_geometry(world, summary, picture)
    )


@app.command("demo")
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


@app.command("play")
def play_command(
    maze: Annotated[
        str, typer.Argument(metavar="[MAZE]", help=f"A .geojson file, or one of: {', '.join(MAZES)}.")
    ] = "fig19",
    link_length: Annotated[float | None, typer.Option("--link-length", help="In maze units.")] = None,
    links: Annotated[int | None, typer.Option("--links", help="By default enough to reach the goal.")] = None,
    planner: PlannerOption = "auto",
) -> None:
    """Drive the arm through a maze by keys or mouse, in a window; space lets the planner show how."""
    from planners.play import play

    play(Maze.load(maze), link_length, links, planner)


@app.command("dataset")
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


@app.command("train")
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


@app.command("evaluate")
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


def main() -> None:
    """Run the command line: one sentence on stderr and exit code 2 for bad input, no traceback."""
    try:
        code = app(standalone_mode=False)
    except InputError as error:
        sys.exit(_complain(str(error)))
    except UsageError as error:
        sys.exit(_complain(error.format_message()))  # type: ignore[attr-defined]
    except OSError as error:
        sys.exit(_complain(f"Expected files that can be read and written, got: {error}."))
    except MemoryError as error:
        sys.exit(_complain(f"Expected a motion that fits into memory, got: {error}. Longer links take less."))
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    if code == INTERRUPTED:  # typer turns Ctrl-C into this code
        print("hrsnake: stopped; no half-written file is left.", file=sys.stderr)
    sys.exit(code or 0)


def _complain(message: str) -> int:
    print("hrsnake: " + " ".join(message.split()), file=sys.stderr)
    return BAD_INPUT


def _arm(link_length: float, links: int | None, link_radius: float, joint_limit: float | None) -> ArmSpec:
    limit = radians(joint_limit)
    return ArmSpec(link_length=link_length, n_links=links, link_radius=link_radius, joint_limit=limit)


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
