"""What the command line prints: results as tables for people and as plain data for programs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from hrsnake_env.arguments import length_text, place_text
from hrsnake_env.arm import ArmSpec
from hrsnake_env.contacts import PINCH_TOLERANCE, PinchReport
from hrsnake_env.maze import Maze
from planners.length_trials import LengthTrial
from planners.longest import LongestLink
from planners.problem import Motion, PlanningResult, ValidationReport
from planners.spatial.longest import SpatialLongest
from planners.spatial.problem import SpatialMotion, SpatialResult
from planners.spatial.workspace import Workspace

if TYPE_CHECKING:
    from planners.demo import Demo
    from planners.rollout import Episode

__all__ = [
    "show_demo",
    "show_evaluation",
    "show_geometry",
    "show_longest",
    "show_plan",
    "show_rows",
    "show_spatial_longest",
    "show_validation",
    "show_verdict",
    "validation_dict",
    "verdict_rows",
]

Rows = Iterable[tuple[str, str]]
World = Maze | Workspace


def show_rows(title: str, rows: Rows) -> None:
    """Print a table of names and figures."""
    # Names out of files may look like rich's markup.
    table = Table(title=escape(title), title_justify="left", show_header=False, box=box.SIMPLE_HEAD)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    for name, figure in rows:
        table.add_row(Text(name), Text(figure))
    Console().print(table)


def show_evaluation(title: str, figures: dict[str, dict[str, float]], replay: Path | None) -> None:
    """Print what a policy does with mean and with sampled actions, side by side."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("", style="bold")
    for actions in figures:
        table.add_column(f"{actions} actions", justify="right")
    for name in next(iter(figures.values())):
        table.add_row(name.replace("_", " "), *(f"{row[name]:.4g}" for row in figures.values()))
    Console().print(table)
    if replay is not None:
        print(f"replay: {replay}")


def seconds(value: float) -> str:
    """Write a time in ms or s."""
    return f"{value * 1e3:.3g} ms" if value < 1.0 else f"{value:.3g} s"


def timing_rows(timings: dict[str, float], n_poses: int) -> Rows:
    """Write the time of each stage, for the whole motion and per pose."""
    for stage, value in timings.items():
        yield f"time: {stage}", f"{seconds(value)}, {value / n_poses * 1e6:.3g} us per pose"


def validation_rows(world: World, motion: Motion | SpatialMotion, report: ValidationReport) -> Rows:
    """Write the figures of the exact check."""
    length, units = motion.link_length, world.units
    yield "exact check", "valid" if report.valid else "NOT VALID"
    for fault in report.faults:
        yield f"  {fault.kind}", fault.message
    yield (
        "clearance at poses",
        f"{report.clearance:.4g} {units} ({report.clearance / length:.2g} link lengths)",
    )
    yield "penetration at poses", f"{report.penetration:.4g} {units}"
    yield (
        "penetration between poses",
        f"at most {report.penetration_between:.4g} {units} "
        f"({report.penetration_between / length:.2g} link lengths; {PINCH_TOLERANCE:g} allowed)"
        if math.isfinite(report.penetration_between)
        else "not bounded",
    )
    yield "largest joint step", f"{report.largest_step / length:.3f} link lengths"
    yield "tip to goal", f"{report.goal_distance:.3g} {units} (radius {world.goal_radius:g})"


def validation_dict(report: ValidationReport) -> dict[str, Any]:
    """Return the exact check as plain data; None stands for infinity."""
    data = {key: value for key, value in vars(report).items() if key != "faults"}
    data = {key: value if abs(value) != float("inf") else None for key, value in data.items()}
    faults = [
        {key: value if value != float("inf") else None for key, value in vars(fault).items()}
        for fault in report.faults
    ]
    return {"valid": report.valid, **data, "faults": faults}


def world_row(world: World) -> tuple[str, str]:
    """Write what the arm moves in."""
    return "maze" if isinstance(world, Maze) else "workspace", world.name


def motion_rows(world: World, motion: Motion | SpatialMotion) -> Rows:
    """Write what a motion is."""
    yield world_row(world)
    yield "arm", f"{motion.n_links} links of {motion.link_length:g} {world.units}"
    yield "poses", f"{motion.n_poses}"


def plan_rows(world: World, arm: ArmSpec, result: PlanningResult | SpatialResult) -> Rows:
    """Write the outcome of planning."""
    yield "status", f"{result.status} (planner: {result.planner})"
    for number, attempt in enumerate(result.attempts):
        yield "" if number else "tried", f"{attempt}, {seconds(attempt.seconds)}"
    if result.motion is None:
        yield world_row(world)
        yield "link length", f"{arm.link_length:g} {world.units}"
        yield "reason", result.reason
        yield from failure_rows(world, result)
        return
    assert result.report is not None  # a motion is there only if it was validated
    yield from motion_rows(world, result.motion)
    yield from validation_rows(world, result.motion, result.report)
    yield from timing_rows(dict(result.timings), result.motion.n_poses)


def failure_rows(world: World, result: PlanningResult | SpatialResult) -> Rows:
    """Write where planning ended, what is in the way, and what would pass there."""
    failure, units = result.failure, world.units
    if failure is None:
        return
    yield "place", f"{place_text(failure.place, world.size)} {units}"
    if failure.path_position is not None:
        yield "along the path", f"{length_text(failure.path_position, world.size)} {units} from the base"
    if failure.link is not None:
        yield "link", "the one at the tip" if failure.link == 0 else f"{failure.link} behind the tip's"
    if failure.wall is not None:
        yield "in the way", _wall(world, failure.wall)
    if failure.depth is not None:
        yield "depth", f"{failure.depth:.4g} {units} in that wall"
    if result.longest_there is not None:
        yield "longest link there", f"{result.longest_there:.4g} {units}"


def show_plan(
    world: World,
    arm: ArmSpec,
    result: PlanningResult | SpatialResult,
    of_motion: Iterable[Path | None],
    picture: Path | None = None,
) -> None:
    """Print the outcome of planning, and the files: those of a motion, and a picture that is always drawn."""
    show_rows("Plan", plan_rows(world, arm, result))
    for file in of_motion:
        if file is not None:
            made = result.motion is not None
            print(f"Written: {file}" if made else f"Nothing written to {file}: no motion.")
    if picture is not None:
        print(f"Written: {picture}")


def show_validation(world: World, motion: Motion | SpatialMotion, report: ValidationReport) -> None:
    """Print the exact check of a motion."""
    show_rows("Exact check", [*motion_rows(world, motion), *validation_rows(world, motion, report)])


def verdict_rows(maze: Maze, report: PinchReport) -> Rows:
    """Write the verdict: what touched what."""
    units, length = maze.units, report.link_length
    yield "verdict", "clean: links merely pinch the walls" if report.clean else "NOT CLEAN"
    for name, run in (("dynamic links", report), ("kinematic links", report.kinematic)):
        if run is None:
            continue
        yield f"{name}: free", f"{run.free} link-poses"
        yield f"{name}: pinch", f"{run.pinch} link-poses"
        yield f"{name}: collision", f"{run.collision} link-poses"
        yield (
            f"{name}: worst depth",
            f"{run.worst_depth:.4g} {units} ({run.worst_depth / length:.2g} link lengths)",
        )
        for touch in run.collisions:
            where = _wall(maze, touch.wall) if touch.corner is None else f"corner {_place(touch.corner)}"
            yield "  collided", f"{where}, {-touch.clearance:.4g} {units} deep"
        if run.first_collision is not None:
            first = run.first_collision
            yield (
                "  first",
                f"pose {first.pose}, link {first.link}, at {_place(first.point)}, "
                f"{-first.clearance:.4g} {units} deep",
            )
    yield "largest wall impulse", f"{report.largest_impulse:.4g} link masses x link lengths / s"
    yield "node error", f"{report.node_error:.4g} {units}"
    yield "joint drift", f"{report.drift:.4g} {units}"
    yield "links that pinched", ", ".join(map(str, report.pinched_links)) or "none"
    yield (
        "corners pinched",
        ", ".join(_place(touch.corner) for touch in report.pinched_corners if touch.corner) or "none",
    )


def _wall(world: World, number: int) -> str:
    if isinstance(world, Maze):
        what, (start, end) = "wall", world.walls[number].tolist()
    else:
        what, (start, end) = "obstacle", world.obstacle_in_room(number).tolist()
    return f"{what} {number} from {_place(start)} to {_place(end)}"


def _place(place: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.5g}' for value in place)})"


def show_spatial_longest(workspace: Workspace, result: SpatialLongest, files: Iterable[Path]) -> None:
    """Print the longest link in space, and what was tried."""
    units = workspace.units
    rows = [world_row(workspace)]
    if result.motion is None:
        rows.append(("longest link", "none was found"))
    else:
        rows.append(("longest link", f"{result.length:.5g} {units}"))
        rows.append(("links", f"{result.motion.n_links}"))
    if not result.complete:
        rows.append(("", "stopped: there may be longer ones"))
    show_rows("Longest link", rows)
    table = Table(title="What was tried", title_justify="left", box=box.SIMPLE_HEAD)
    for heading in (f"link, {units}", "links", f"clearance, {units}", "time", "outcome"):
        table.add_column(heading, justify="left" if heading == "outcome" else "right", no_wrap=True)
    for trial in result.trials:
        table.add_row(
            f"{trial.link_length:.5g}",
            "" if trial.n_links is None else f"{trial.n_links}",
            "" if trial.clearance is None else f"{trial.clearance:.3g}",
            seconds(trial.seconds),
            str(trial.status),
            style="bold" if trial.link_length == result.length else None,
        )
    Console().print(table)
    for file in files:
        print(f"Written: {file}")


def show_verdict(maze: Maze, episode: Episode, files: Iterable[Path | None]) -> None:
    """Print what the simulation found, and which files were written."""
    goal = "reached" if episode.success else "NOT REACHED"
    rows = [
        ("maze", maze.name),
        ("goal", goal),
        ("steps", f"{episode.n_steps}, {seconds(episode.seconds / episode.n_steps)} each"),
    ]
    show_rows("Simulation", [*rows, *verdict_rows(maze, episode.report)])
    for out in files:
        if out is not None:
            print(f"Written: {out}")


def show_geometry(maze: Maze, summary: dict[str, Any], out: Path) -> None:
    """Print the geometry of section 2 of the paper."""
    rows = [("maze", maze.name), ("narrowest passage", f"{summary['passage_width']:.4g} {maze.units}")]
    rows.append(("path length", f"{summary['path_length']:.5g} {maze.units}"))
    for corner in summary["corners"]:
        rows.append((f"{corner['turn']} corner", _place(corner["place"])))
    show_rows("Geometry", rows)
    print(f"Written: {out}")


def show_demo(demo: Demo) -> None:
    """Print what the demonstration found."""
    show_rows("Plan", plan_rows(demo.maze, demo.arm, demo.result))
    if demo.episode is None:
        return
    rows = [
        ("index I (Eq. 4)", f"{demo.index:.3f}: {demo.arm.link_length:g} of at most 440 {demo.maze.units}"),
        ("goal", "reached" if demo.episode.success else "NOT REACHED"),
        (
            "time: simulate",
            f"{seconds(demo.episode.seconds)}, "
            f"{seconds(demo.episode.seconds / demo.episode.n_steps)} per step",
        ),
    ]
    show_rows("Simulation", [*rows, *verdict_rows(demo.maze, demo.episode.report)])
    for path in demo.files:
        print(f"Written: {path}")


def longest_rows(maze: Maze, result: LongestLink) -> Rows:
    """Write the answer: how long a link may be, and how sure that is."""
    bound, units = result.bound, result.units
    yield "maze", maze.name
    if result.length > 0.0:
        yield "longest link", f"{result.length:.5g} {units}, with a validated motion"
        yield "index I (Eq. 4)", f"at least {result.index_text}"
        fewest = result.fewest
        assert fewest is not None  # some length passes
        yield "fewest links", f"{fewest.n_links}, of {fewest.link_length:.5g} {units}"
    else:
        yield "longest link", "none: no length that was tried passes"
    way = "the straight way in front of the base" if bound.limited_by == "feeder" else "the maze"
    closer = "" if bound.proven else "; time ended before they were closer"
    yield (
        "longest rod that passes",
        f"from {bound.lower:.5g} to {bound.upper:.5g} {units}, limited by {way}{closer}",
    )
    yield "longer links", ", ".join(_longer(result)) or "the next step is longer than any rod that passes"
    if not result.complete:
        yield "stopped", "the longest link so far; the search was not over"
    if result.note:
        yield "state", result.note


def _longer(result: LongestLink) -> Iterable[str]:
    """Say what is known of the lengths between the longest link and the bound."""
    failed = [trial for trial in result.failed if trial.link_length <= result.bound.upper]
    if failed:
        low, high = failed[0].link_length, failed[-1].link_length
        span = f"{low:.5g}" if len(failed) == 1 else f"{low:.5g} to {high:.5g}"
        yield f"{len(failed)} tried ({span} {result.units}): none passes"
    if result.out_of_time:
        longest = max(trial.time_budget for trial in result.out_of_time)
        yield f"{len(result.out_of_time)} undecided within {seconds(longest)} each (try --time-budget)"
    if result.untried:
        yield f"{len(result.untried)} not tried"


def show_longest(maze: Maze, result: LongestLink, files: Iterable[Path]) -> None:
    """Print the longest link, and what arms with links of other lengths need."""
    show_rows("Longest link", longest_rows(maze, result))
    units = result.units
    table = Table(
        title="What each length needs", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    figures = (
        f"\nlink\n{units}",
        "\nof the\nbound",
        "\n\nlinks",
        "\nactu-\nators",
        "joint\nrange\ndeg",
        f"joint\nspeed\ndeg/{units}",
        "\nturning\ndeg",
        "\n\nposes",
    )
    for heading in figures:
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("\n\noutcome", no_wrap=True)
    for trial in result.table:
        chosen = trial.link_length == result.length
        table.add_row(*_trial_cells(trial, result.bound.upper), style="bold" if chosen else None)
    Console().print(table)
    print(
        f"Actuators: a joint for each link, and the feed. Joint speed: per {units} that the fastest joint "
        f"travels.\nTurning: over the joints' speed, the least time of the whole motion."
    )
    for path in files:
        print(f"Written: {path}")


def _trial_cells(trial: LengthTrial, upper: float) -> list[str]:
    cells = [f"{trial.link_length:.5g}", f"{trial.link_length / upper:.3f}" if upper > 0.0 else ""]
    if trial.joint_range is None or trial.joint_speed is None or trial.turning is None:
        return [*cells, *[""] * 6, str(trial.status)]
    return [
        *cells,
        str(trial.n_links),
        str(trial.n_actuators),
        f"{np.degrees(trial.joint_range):.1f}",
        f"{np.degrees(trial.joint_speed):.3g}",
        f"{np.degrees(trial.turning):.0f}",
        str(trial.n_poses),
        f"passes: {trial.planner}",
    ]
