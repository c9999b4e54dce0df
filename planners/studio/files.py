"""Files in and out of the studio, all in memory: maps that were uploaded, and what is to be downloaded."""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maps import MapFiles, MapOptions, MapReading
from hrsnake_env.maze import Maze
from hrsnake_env.replay import replay_html
from planners.problem import Motion, Progress
from planners.studio.motions import checked, motion_bytes, motion_from
from planners.studio.requests import ExportRequest, MapRequest, Run, UploadedFile, decoded
from planners.studio.scene import MAX_POINTS, free_shapes, maze_from_scene

if TYPE_CHECKING:
    from planners.export import TrajectoryLimits

__all__ = ["export_formats", "exported", "map_read", "uploaded"]

OWN_EXPORTS: dict[str, tuple[str, str, str]] = {
    "geojson": (".geojson", "application/geo+json", "the maze, as `hrsnake plan` takes it"),
    "motion": (".npz", "application/octet-stream", "the motion without time, as `hrsnake simulate` takes it"),
    "html": (".html", "text/html", "a page that plays the run, or two side by side"),
}
"""What the studio writes itself: ending, media type, and what it is."""


# Maps


def map_read(ask: MapRequest) -> dict[str, Any]:
    """Return what is understood of a map, as a drawing without what the map does not say.

    Raises
    ------
    InputError
        If it cannot be read, or has too many corners to be drawn.
    """
    from hrsnake_env.maps import read_map

    settings = {key: value for key, value in ask.options.model_dump().items() if value is not None}
    reading = read_map(_main_file(ask.files), MapOptions(**settings), uploaded(ask.files))
    rings = [ring for part in reading.parts for ring in (part.exterior, *part.interiors)]
    n_points = sum(len(ring.coords) - 1 for ring in rings)
    if n_points > MAX_POINTS:
        raise InputError(
            f"Expected a map of at most {MAX_POINTS} corners, got {n_points}: a larger tolerance, or an "
            f"image with less noise, has fewer."
        )
    return {
        "scene": _scene_of(reading),
        "units": reading.units,
        "notes": list(reading.notes),
        "layers": dict(reading.layers),
        "tolerance": reading.tolerance,
        "moved": reading.moved,
        "parts": len(reading.parts),
    }


def uploaded(files: Sequence[UploadedFile]) -> MapFiles:
    """Return what reads the files that were uploaded, by their names without folders; nothing else."""
    held = {_base_name(file.name): file for file in files}

    def read(name: str) -> bytes:
        file = held.get(name) or held.get(_base_name(name))
        if file is None:
            wanted, got = _base_name(name)[:80], ", ".join(held)
            raise InputError(f"Expected '{wanted}' among the files, got {got}: choose all together.")
        return decoded(file.data, f"file '{file.name}'")

    return read


def _base_name(name: str) -> str:
    return re.split(r"[/\\]", name)[-1]


def _main_file(files: Sequence[UploadedFile]) -> str:
    """Return the name of the file that refers to the others: the YAML of a ROS map, or else the first."""
    names = [_base_name(file.name) for file in files]
    return next((name for name in names if name.lower().endswith((".yaml", ".yml"))), names[0])


def _scene_of(reading: MapReading) -> dict[str, Any]:
    base, goal = reading.base_pose, reading.goal
    return {
        "name": reading.name[:200],
        "units": reading.units[:40],
        "shapes": free_shapes(reading.parts),
        "base": None if base is None else [base[0], base[1], math.degrees(base[2])],
        "goal": None if goal is None else list(goal),
        "goal_radius": reading.goal_radius,
    }


# Exports


def export_formats() -> dict[str, tuple[str, str, str]]:
    """Return ending, media type and meaning of each format by its name."""
    from planners.export import EXPORTS

    others = {name: (each.ending, each.media_type, each.title) for name, each in EXPORTS.items()}
    return {**others, **OWN_EXPORTS}


def exported(ask: ExportRequest, progress: Progress) -> dict[str, Any]:
    """Return a file of one run, or of two side by side; every motion is checked exactly before.

    Raises
    ------
    InputError
        If there is no such format, a motion is missing or not valid, or an option is out of its range.
    """
    from planners.export import ExportRefused

    if ask.format not in export_formats():
        names = ", ".join(export_formats())
        raise InputError(f"Unknown format {ask.format[:40]!r}. Available: {names}.")
    if len(ask.runs) > 1 and ask.format != "html":
        raise InputError(f"Expected one run for {ask.format}, got {len(ask.runs)}: html alone shows two.")
    try:
        data = _data(ask, progress)
    except ExportRefused as refusal:
        raise InputError(str(refusal)) from None
    ending, kind, _ = export_formats()[ask.format]
    run = ask.runs[0]
    return {
        "name": _file_name(run.title or run.scene.name) + ending,
        "type": kind,
        "data": base64.b64encode(data).decode("ascii"),
    }


def _data(ask: ExportRequest, progress: Progress) -> bytes:
    """Return the contents of a file."""
    from planners.export import export_bytes

    run = ask.runs[0]
    maze = maze_from_scene(run.scene)
    if ask.format == "geojson":
        return (json.dumps(maze.to_geojson(), indent=1) + "\n").encode()
    if ask.format == "html":
        return _page(ask.runs, progress)
    if ask.format == "motion":
        return motion_bytes(_valid(run, maze, progress)[0])
    motion, arm = _valid(run, maze, progress)
    options: dict[str, Any] = {} if ask.rate is None else {"rate": ask.rate}
    return export_bytes(
        motion,
        maze,
        arm,
        ask.format,
        _limits(ask.limits or {}),
        metres_per_unit=ask.metres_per_unit,
        progress=progress,
        **options,
    )


def _valid(run: Run, maze: Maze, progress: Progress) -> tuple[Motion, ArmSpec]:
    """Return the motion of a run and its arm, checked exactly."""
    if run.motion is None:
        raise InputError("Expected a motion to export, got none: plan first.")
    motion = motion_from(run.motion)
    arm, report = checked(run.arm, motion, maze, progress)
    if not report.valid:
        raise InputError(
            f"Expected a valid motion to export, got one with a fault: {report.faults[0].message}"
        )
    return motion, arm


def _page(runs: list[Run], progress: Progress) -> bytes:
    """Return the replay of simulated runs."""
    from planners.rollout import simulate_motion

    traces = []
    for run in runs:
        maze = maze_from_scene(run.scene)
        motion, arm = _valid(run, maze, progress)
        episode = simulate_motion(motion, maze, arm, progress=progress)
        traces.append(episode.trace(maze, title=run.title or None, link_radius=arm.link_radius))
    return replay_html(traces).encode()


def _limits(limits: dict[str, float | None]) -> TrajectoryLimits:
    """Return limits by name, in rad and maze units."""
    from planners.export import TrajectoryLimits

    known = [field.name for field in fields(TrajectoryLimits)]
    values = {}
    for key, value in limits.items():
        if key not in known:
            raise InputError(f"Unknown limit {key[:40]!r}. Available: {', '.join(known)}.")
        if value is not None:
            values[key] = value
    return TrajectoryLimits(**values)


def _file_name(title: str) -> str:
    """Return a name for a file that every system takes."""
    return re.sub(r"[^A-Za-z0-9]+", "-", title).strip("-")[:60] or "hrsnake"
