"""`hrsnake export`: a motion as a trajectory for a controller, as the arm's URDF, or as a video."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import tables
from planners.cli_tools import (
    NOT_CLEAN,
    JsonOption,
    OwnLimitOption,
    OwnRadiusOption,
    arm_of,
    check_output,
    print_outcome,
    progress_bars,
)
from planners.export import (
    DEFAULT_RATE,
    EXPORTS,
    Export,
    ExportRefused,
    TrajectoryLimits,
    fastest_duration,
    format_for,
    largest_shares,
    save_export,
)
from planners.problem import Motion, read_motion_arrays
from planners.spatial.problem import SpatialMotion
from planners.spatial.rooms import load_workspace
from planners.spatial.workspace import Workspace

__all__ = ["export_command"]


def export_command(
    maze: Annotated[
        str, typer.Argument(metavar="MAZE", help="A name or a file, as for plan or spatial plan.")
    ],
    motion: Annotated[
        Path, typer.Argument(metavar="MOTION", help="A motion (.npz) in it, as plan writes it.")
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            help="The file; its ending says the format: .csv, .json, .npz, .yaml (ROS 2), "
            ".urdf, .gif, .mp4, .html.",
        ),
    ],
    format: Annotated[
        str | None, typer.Option("--format", help=f"By default as --out ends; else {', '.join(EXPORTS)}.")
    ] = None,
    rate: Annotated[float, typer.Option("--rate", help="Samples per second.")] = DEFAULT_RATE,
    joint_speed: Annotated[float, typer.Option("--joint-speed", help="Largest, in degrees per s.")] = 90.0,
    joint_acceleration: Annotated[
        float, typer.Option("--joint-acceleration", help="Largest, in degrees per s^2.")
    ] = 360.0,
    feed_speed: Annotated[
        float | None,
        typer.Option("--feed-speed", help="In maze units per s. By default half a link length per s."),
    ] = None,
    feed_acceleration: Annotated[
        float | None,
        typer.Option("--feed-acceleration", help="In maze units per s^2. By default a link length per s^2."),
    ] = None,
    metres_per_unit: Annotated[
        float | None,
        typer.Option(
            "--metres-per-unit",
            help="For ROS 2 and URDF; known for m, cm, mm, in, ft and other units of length.",
        ),
    ] = None,
    link_radius: OwnRadiusOption = None,
    joint_limit: OwnLimitOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a motion as a trajectory within limits of speed and acceleration, checked as the motion is.

    --out arm.csv writes a table, --out arm.yaml a ROS 2 trajectory_msgs/msg/JointTrajectory, --out arm.urdf
    the arm, --out arm.mp4 a video. The arm is the one that the motion was planned for.
    """
    name = format_for(out, format)
    check_output(out, (EXPORTS[name].ending, ".yml") if name == "ros2-yaml" else (EXPORTS[name].ending,))
    limits = TrajectoryLimits(
        joint_speed=_positive("--joint-speed", joint_speed, math.pi / 180.0),
        joint_acceleration=_positive("--joint-acceleration", joint_acceleration, math.pi / 180.0),
        feed_speed=None if feed_speed is None else _positive("--feed-speed", feed_speed),
        feed_acceleration=(
            None if feed_acceleration is None else _positive("--feed-acceleration", feed_acceleration)
        ),
    )
    world, moved = _loaded(maze, motion)
    arm = arm_of(moved, link_radius, joint_limit)
    try:
        with progress_bars(as_json) as progress:
            made = save_export(
                moved,
                world,
                arm,
                name,
                limits,
                path=out,
                rate=rate,
                metres_per_unit=metres_per_unit,
                progress=progress,
            )
    except ExportRefused as refusal:
        report = None if refusal.report is None else tables.validation_dict(refusal.report)
        data = {"format": name, "out": None, "reason": str(refusal), "validation": report}
        print_outcome(as_json, data, lambda: print(data["reason"], file=sys.stderr))
        raise typer.Exit(NOT_CLEAN) from None
    data = _facts(made, moved, limits, name, out)
    print_outcome(as_json, data, lambda: _show(made, world, data))


def _loaded(maze: str, motion: Path) -> tuple[Maze | Workspace, Motion | SpatialMotion]:
    """Read a maze and a motion; where the motion is in space, a workspace."""
    if read_motion_arrays(motion)["joint_angles"].ndim == 3:
        return load_workspace(maze), SpatialMotion.load(motion)
    return Maze.load(maze), Motion.load(motion)


def _positive(option: str, value: float, factor: float = 1.0) -> float:
    if not 0.0 < value < math.inf:
        raise InputError(f"Expected a positive, finite {option}, got {value:g}.")
    return value * factor


def _facts(
    made: Export, motion: Motion | SpatialMotion, limits: TrajectoryLimits, name: str, out: Path
) -> dict[str, Any]:
    data: dict[str, Any] = {"format": name, "out": str(out), "bytes": len(made.data)}
    if made.trajectory is not None:
        data |= {
            "duration": made.trajectory.duration,
            "least_duration": fastest_duration(motion, limits),
            "points": made.trajectory.n_points,
            "joint_names": list(made.trajectory.joint_names),
            "deviation": made.trajectory.deviation,
            "shares_of_limits": largest_shares(made.trajectory, limits),
        }
    return {**data, "validation": tables.validation_dict(made.report)}


def _show(made: Export, maze: Maze | Workspace, data: dict[str, Any]) -> None:
    rows = []
    if made.trajectory is not None:
        shares = data["shares_of_limits"]
        off, off_in_links = data["deviation"], data["deviation"] / made.trajectory.link_length
        rows = [
            (
                "duration",
                f"{data['duration']:.2f} s; the feed alone would take {data['least_duration']:.2f} s",
            ),
            ("points", f"{data['points']}"),
            *(
                (f"largest {key.replace('_', ' ')}", f"{100 * shares[key]:.1f} % of the limit")
                for key in shares
            ),
            (
                "off the motion",
                f"at most {off:.3g} {maze.units}, {off_in_links:.2g} link lengths",
            ),
        ]
    depth = made.report.penetration_between
    deep = f"at most {depth:.3g} {maze.units} deep, within the tolerance"
    verdict = "free of the walls" if depth <= 0.0 else deep
    rows.append(("walls", f"{verdict}; clearance {made.report.clearance:.3g} {maze.units}"))
    tables.show_rows(f"{EXPORTS[data['format']].title}: {maze.name}", rows)
    print(f"Written: {data['out']}")
