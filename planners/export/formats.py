"""What a motion is exported as: one entry for the command line and the page."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from planners.export.checking import check_motion, safe_trajectory
from planners.export.ros import message_json, message_yaml
from planners.export.tables import csv_bytes, json_bytes, npz_bytes
from planners.export.trajectory import DEFAULT_RATE, Trajectory, TrajectoryLimits
from planners.export.units import metres_in
from planners.export.urdf import urdf_bytes
from planners.problem import Motion, Progress, ValidationReport
from planners.spatial.problem import SpatialMotion
from planners.spatial.workspace import Workspace

__all__ = ["EXPORTS", "Export", "ExportFormat", "export", "export_bytes", "format_for", "save_export"]


@dataclass(frozen=True, eq=False, kw_only=True)
class _Job:
    """Hold what a writer may need; `trajectory` is there for the formats with time."""

    motion: Motion | SpatialMotion
    maze: Maze | Workspace
    arm: ArmSpec
    limits: TrajectoryLimits
    metres_per_unit: float | None
    progress: Progress | None
    trajectory: Trajectory | None = None

    @property
    def timed(self) -> Trajectory:
        """The trajectory of a format that has one."""
        assert self.trajectory is not None  # the caller made it
        return self.trajectory

    @property
    def metres(self) -> float:
        """How many metres a maze unit is."""
        return metres_in(self.maze.units, self.metres_per_unit)

    @property
    def planar(self) -> Maze:
        """The maze, of formats for the plane alone."""
        assert isinstance(self.maze, Maze)  # the caller checked
        return self.maze


@dataclass(frozen=True, eq=False, kw_only=True)
class ExportFormat:
    """Describe one format.

    Parameters
    ----------
    title : str
        What it is, in a few words.
    ending : str
        Of its files, with the point.
    media_type : str
        For a browser.
    write : callable
        From the job to the bytes.
    has_time : bool
        Whether it holds a trajectory.
    in_metres : bool
        Whether it needs the maze's unit in metres.
    in_space : bool
        Whether motions in space can be written, too.
    """

    title: str
    ending: str
    media_type: str
    write: Callable[[_Job], bytes]
    has_time: bool = True
    in_metres: bool = False
    in_space: bool = True


@dataclass(frozen=True, eq=False, kw_only=True)
class Export:
    """Hold what was exported, and what is known of it.

    Parameters
    ----------
    data : bytes
        The file.
    trajectory : Trajectory or None
        None for the formats without time.
    report : ValidationReport
        Of the trajectory, or of the motion where there is none.
    """

    data: bytes
    trajectory: Trajectory | None
    report: ValidationReport


def _gif(job: _Job) -> bytes:
    from planners.export.video import gif_bytes

    return gif_bytes(job.timed, job.planar, job.arm.link_radius, job.progress)


def _mp4(job: _Job) -> bytes:
    from planners.export.video import mp4_bytes

    return mp4_bytes(job.timed, job.planar, job.arm.link_radius, job.progress)


def _html(job: _Job) -> bytes:
    from hrsnake_env.replay import replay_html
    from planners.rollout import simulate_motion  # needs the simulator, which other formats do not

    assert isinstance(job.motion, Motion)  # the caller checked
    arm = dataclasses.replace(job.arm, n_links=job.motion.n_links)
    episode = simulate_motion(job.motion, job.planar, arm, progress=job.progress)
    return replay_html([episode.trace(job.planar, link_radius=arm.link_radius)]).encode()


EXPORTS: Mapping[str, ExportFormat] = MappingProxyType(
    {
        "csv": ExportFormat(
            title="table of the trajectory",
            ending=".csv",
            media_type="text/csv",
            write=lambda job: csv_bytes(job.timed),
        ),
        "json": ExportFormat(
            title="trajectory",
            ending=".json",
            media_type="application/json",
            write=lambda job: json_bytes(job.timed),
        ),
        "npz": ExportFormat(
            title="trajectory as NumPy arrays",
            ending=".npz",
            media_type="application/octet-stream",
            write=lambda job: npz_bytes(job.timed),
        ),
        "ros2-yaml": ExportFormat(
            title="ROS 2 JointTrajectory (YAML)",
            ending=".yaml",
            media_type="application/yaml",
            write=lambda job: message_yaml(job.timed, job.metres),
            in_metres=True,
        ),
        "ros2-json": ExportFormat(
            title="ROS 2 JointTrajectory (JSON)",
            ending=".json",
            media_type="application/json",
            write=lambda job: message_json(job.timed, job.metres),
            in_metres=True,
        ),
        "urdf": ExportFormat(
            title="the arm as URDF",
            ending=".urdf",
            media_type="application/xml",
            write=lambda job: urdf_bytes(job.motion, job.arm, job.limits, job.metres, job.maze.name),
            has_time=False,
            in_metres=True,
        ),
        "gif": ExportFormat(
            title="animation in the arm's own time (GIF)",
            ending=".gif",
            media_type="image/gif",
            write=_gif,
            in_space=False,
        ),
        "mp4": ExportFormat(
            title="video in the arm's own time (MP4)",
            ending=".mp4",
            media_type="video/mp4",
            write=_mp4,
            in_space=False,
        ),
        "html": ExportFormat(
            title="page that plays the simulated motion",
            ending=".html",
            media_type="text/html",
            write=_html,
            has_time=False,
            in_space=False,
        ),
    }
)
"""The formats by name."""


def format_for(path: str | os.PathLike[str], name: str | None = None) -> str:
    """Return the format of a file, by name or else by its ending (.json is the plain trajectory).

    Raises
    ------
    InputError
        If the name is unknown, or no format has this ending.
    """
    if name is not None:
        if name not in EXPORTS:
            raise InputError(f"Unknown format '{name}'. Available: {', '.join(EXPORTS)}.")
        return name
    ending = Path(path).suffix.lower()
    ending = ".yaml" if ending == ".yml" else ending
    for known, entry in EXPORTS.items():
        if entry.ending == ending:
            return known
    endings = dict.fromkeys(entry.ending for entry in EXPORTS.values())
    raise InputError(f"Expected a file name ending in {', '.join(endings)}, got '{path}'.")


def export(
    motion: Motion | SpatialMotion,
    maze: Maze | Workspace,
    arm: ArmSpec | None = None,
    format: str = "csv",
    limits: TrajectoryLimits | None = None,
    *,
    rate: float = DEFAULT_RATE,
    metres_per_unit: float | None = None,
    progress: Progress | None = None,
) -> Export:
    """Check a motion, give it time where the format has time, check that too, and write it.

    Parameters
    ----------
    motion : Motion or SpatialMotion
        Valid in this maze.
    maze : Maze or Workspace
        Of the motion's kind.
    arm : ArmSpec, optional
        Gives link radius and joint limit. By default the arm that the motion was made for.
    format : str
        A name in `EXPORTS`.
    limits : TrajectoryLimits, optional
        By default those that the class names.
    rate : float
        Samples per second of the trajectory.
    metres_per_unit : float, optional
        For ROS and URDF, where the maze's unit has no length.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    export : Export
        The file, and what is known of it.

    Raises
    ------
    InputError
        If the format is unknown, an option is out of range, something is not installed, or the motion is of
        another maze.
    ExportRefused
        If the motion is not valid, or no trajectory near it is.
    """
    entry = EXPORTS[format_for("", str(format))]
    if not entry.in_space and not isinstance(motion, Motion):
        possible = ", ".join(name for name, other in EXPORTS.items() if other.in_space)
        raise InputError(f"Expected one of {possible} for a motion in space, got '{format}'.")
    arm = motion.arm if arm is None else arm
    limits = TrajectoryLimits() if limits is None else limits
    job = _Job(
        motion=motion,
        maze=maze,
        arm=arm,
        limits=limits,
        metres_per_unit=metres_per_unit,
        progress=progress,
    )
    if entry.in_metres:
        metres_in(maze.units, metres_per_unit)  # refused before the work is done
    if entry.has_time:
        trajectory, report = safe_trajectory(motion, maze, arm, limits, rate=rate, progress=progress)
        job = dataclasses.replace(job, trajectory=trajectory)
    else:
        report = check_motion(motion, maze, arm, progress)
    return Export(data=entry.write(job), trajectory=job.trajectory, report=report)


def export_bytes(
    motion: Motion | SpatialMotion,
    maze: Maze | Workspace,
    arm: ArmSpec | None = None,
    format: str = "csv",
    limits: TrajectoryLimits | None = None,
    *,
    rate: float = DEFAULT_RATE,
    metres_per_unit: float | None = None,
    progress: Progress | None = None,
) -> bytes:
    """Return the file that `export` makes."""
    return export(
        motion, maze, arm, format, limits, rate=rate, metres_per_unit=metres_per_unit, progress=progress
    ).data


def save_export(
    motion: Motion | SpatialMotion,
    maze: Maze | Workspace,
    arm: ArmSpec | None = None,
    format: str | None = None,
    limits: TrajectoryLimits | None = None,
    *,
    path: str | os.PathLike[str],
    rate: float = DEFAULT_RATE,
    metres_per_unit: float | None = None,
    progress: Progress | None = None,
) -> Export:
    """Write the file that `export` makes, completely or not at all; by default the ending says the format."""
    name = format_for(path, format)
    made = export(
        motion, maze, arm, name, limits, rate=rate, metres_per_unit=metres_per_unit, progress=progress
    )
    with replacing(path) as part:
        part.write_bytes(made.data)
    return made
