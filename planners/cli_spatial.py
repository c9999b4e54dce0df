"""The commands of `hrsnake spatial`: plan, check and draw in three dimensions; the paper's figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners import tables
from planners.cli_tools import (
    INTERRUPTED,
    NOT_CLEAN,
    PICTURES,
    JsonOption,
    LimitOption,
    OwnLimitOption,
    OwnRadiusOption,
    RadiusOption,
    arm_of,
    check_folder,
    check_output,
    examples,
    name_of,
    one_bar,
    print_outcome,
    progress_bars,
    radians,
)
from planners.spatial.longest import longest_link
from planners.spatial.planning import PLANNERS, TIME_BUDGET, plan
from planners.spatial.problem import SpatialMotion
from planners.spatial.rooms import ROOMS, load_workspace
from planners.spatial.validation import signed_distances, validate

if TYPE_CHECKING:
    from planners.spatial.figures import SpatialFigure

__all__ = ["spatial_app"]

spatial_app = typer.Typer(help="Plan, check and draw in three dimensions.", no_args_is_help=True)

WorkspaceArgument = Annotated[
    str, typer.Argument(metavar="WORKSPACE", help=f"A .json file, {', '.join(ROOMS)} or random-SEED.")
]
PlannerOption = Annotated[str, typer.Option("--planner", help=f"auto, {', '.join(PLANNERS)}.")]
PageOption = Annotated[Path | None, typer.Option("--page", help="Write a page that turns and plays (.html).")]
MotionOption = Annotated[Path | None, typer.Option("--out", help="Write the motion (.npz).")]


@spatial_app.command(
    "plan",
    epilog=examples(["hrsnake spatial plan paired-panels --link-length 90 --out m3.npz --page m3.html"]),
)
def plan_command(
    workspace: WorkspaceArgument,
    link_length: Annotated[float, typer.Option("--link-length", help="In workspace units.")],
    links: Annotated[int | None, typer.Option("--links", help="By default as many as it takes.")] = None,
    link_radius: RadiusOption = 0.0,
    joint_limit: LimitOption = None,
    planner: PlannerOption = "auto",
    time_budget: Annotated[
        float, typer.Option("--time-budget", help="Seconds that planning may take.")
    ] = TIME_BUDGET,
    out: MotionOption = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", help="Draw the last pose (.png, .svg, .pdf).")
    ] = None,
    page: PageOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a motion from the feeder to the goal, and check it exactly."""
    check_output(out, (".npz",))
    check_output(picture, PICTURES)
    check_output(page, (".html",))
    room = load_workspace(workspace)
    arm = ArmSpec(
        link_length=link_length, n_links=links, link_radius=link_radius, joint_limit=radians(joint_limit)
    )
    with progress_bars(as_json) as progress:
        result = plan(room, arm, planner, time_budget=time_budget, progress=progress)
    if result.motion is not None:
        if out is not None:
            result.motion.save(out)
        _show(room, result.motion, picture, page, path=result.path, link_radius=link_radius)
    made = result.motion is not None
    report = None if result.report is None else tables.validation_dict(result.report)
    print_outcome(
        as_json,
        {
            **result.to_dict(),
            "validation": report,
            "out": name_of(out, made),
            "picture": name_of(picture, made),
            "page": name_of(page, made),
        },
        lambda: tables.show_plan(room, arm, result, [out, picture, page]),
    )
    if not result.solved:
        raise typer.Exit(NOT_CLEAN)


@spatial_app.command("validate", epilog=examples(["hrsnake spatial validate paired-panels m3.npz"]))
def validate_command(
    workspace: WorkspaceArgument,
    motion: Annotated[Path, typer.Argument(metavar="MOTION", help="A motion in space (.npz).")],
    link_radius: OwnRadiusOption = None,
    joint_limit: OwnLimitOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check a motion exactly: lengths, feeder, clearance at and between poses, crossings, start and goal."""
    room, moved = load_workspace(workspace), SpatialMotion.load(motion)
    arm = arm_of(moved, link_radius, joint_limit)
    with progress_bars(as_json) as progress:
        report = validate(moved, room, arm, progress)
    print_outcome(
        as_json, tables.validation_dict(report), lambda: tables.show_validation(room, moved, report)
    )
    if not report.valid:
        raise typer.Exit(NOT_CLEAN)


@spatial_app.command("longest", epilog=examples(["hrsnake spatial longest paired-panels --accuracy 0.01"]))
def longest_command(
    workspace: WorkspaceArgument,
    planner: PlannerOption = "auto",
    link_radius: RadiusOption = 0.0,
    joint_limit: LimitOption = None,
    accuracy: Annotated[
        float, typer.Option("--accuracy", help="How close to get to the longest, as a share.")
    ] = 1e-3,
    time_budget: Annotated[
        float, typer.Option("--time-budget", help="Seconds that planning may take for each length.")
    ] = 30.0,
    out: MotionOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find the longest link that reaches the goal, and how many links arms of each length take."""
    check_output(out, (".npz",))
    room = load_workspace(workspace)
    with one_bar(as_json) as progress:
        result = longest_link(
            room,
            planner,
            link_radius=link_radius,
            joint_limit=radians(joint_limit),
            accuracy=accuracy,
            time_budget=time_budget,
            progress=progress,
        )
    if out is not None and result.motion is not None:
        result.motion.save(out)
    files = [out] if out is not None and result.motion is not None else []
    print_outcome(
        as_json,
        {**result.to_dict(), "out": name_of(out, bool(files))},
        lambda: tables.show_spatial_longest(room, result, files),
    )
    if not result.complete:
        raise typer.Exit(INTERRUPTED)
    if result.motion is None:
        raise typer.Exit(NOT_CLEAN)


@spatial_app.command("draw", epilog=examples(["hrsnake spatial draw paired-panels m3.npz --out m3.png"]))
def draw_command(
    workspace: WorkspaceArgument,
    motion: Annotated[Path, typer.Argument(metavar="MOTION", help="A motion in space (.npz).")],
    link_radius: OwnRadiusOption = None,
    out: Annotated[Path | None, typer.Option("--out", help="The picture (.png, .svg, .pdf).")] = None,
    page: PageOption = None,
    as_json: JsonOption = False,
) -> None:
    """Draw the pose of a motion in which a link is deepest in an obstacle, or else the last."""
    check_output(out, PICTURES)
    check_output(page, (".html",))
    if out is None and page is None:
        raise InputError("Expected --out (a picture) or --page (a page that turns and plays), got neither.")
    room, moved = load_workspace(workspace), SpatialMotion.load(motion)
    moved.check_workspace(room)
    _show(room, moved, out, page, worst=True, link_radius=arm_of(moved, link_radius).link_radius)
    written = [str(file) for file in (out, page) if file is not None]
    print_outcome(
        as_json, {"written": written}, lambda: print("\n".join(f"Written: {file}" for file in written))
    )


@spatial_app.command("save", epilog=examples(["hrsnake spatial save random-7 room.json"]))
def save_command(
    workspace: WorkspaceArgument,
    out: Annotated[Path, typer.Argument(metavar="FILE", help="A new workspace file (.json).")],
) -> None:
    """Write a workspace as a file, to begin one's own from."""
    check_output(out, (".json",))
    load_workspace(workspace).save(out)
    print(f"Written: {out}")


@spatial_app.command("figures", epilog=examples(["hrsnake spatial figures --out figures"]))
def figures_command(
    out: Annotated[Path, typer.Option("--out", help="Folder; made if missing.")] = Path("spatial-figures"),
    as_json: JsonOption = False,
) -> None:
    """Make Figs. 20 to 22 of the paper, and the motion that it announces: pictures, and a page to turn."""
    from planners.spatial.figures import run_figures

    check_folder(out)
    with progress_bars(as_json) as progress:
        figures = run_figures(out, progress)
    print_outcome(
        as_json,
        {"figures": [figure.to_dict() for figure in figures], "out": str(out)},
        lambda: _show_figures(figures, out),
    )


def _show(
    room: Any,
    motion: SpatialMotion,
    picture: Path | None,
    page: Path | None,
    *,
    path: Any = None,
    worst: bool = False,
    link_radius: float,
) -> None:
    """Write a picture and a page, as far as they are wanted."""
    if picture is None and page is None:
        return
    from planners.spatial.drawing import draw_motion
    from planners.spatial.viewer import Scene, save_page

    distances = signed_distances(motion.joints, room, motion.base_pose, link_radius)
    if picture is not None:
        poses = None if worst else [-1]
        draw_motion(room, motion, path, picture, poses=poses, distances=distances, link_radius=link_radius)
    if page is not None:
        name = f"{motion.n_links} links of {motion.link_length:g}"
        scene = Scene(
            name=name, workspace=room, motion=motion, path=path, distances=distances, link_radius=link_radius
        )
        save_page([scene], page)


def _show_figures(figures: list[SpatialFigure], folder: Path) -> None:
    rows = []
    for figure in figures:
        facts = f"{figure.motion.n_poses} poses, {figure.poses_that_collide} collide"
        if figure.report.penetration > 0.0:
            facts += f", {figure.report.penetration:.3g} deep"
        else:
            facts += f", clearance {figure.report.clearance:.3g}"
        if figure.error is not None:
            facts += f"; off the path by up to {figure.error.link_to_path:.3g}"
        rows.append((figure.name, facts))
    tables.show_rows("Figures 20 to 22", rows)
    print(f"Written: {folder / 'spatial.html'} and the pictures and motions beside it.")
