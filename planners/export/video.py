"""Videos of a trajectory, as fast as the arm will move: GIF and MP4."""

from __future__ import annotations

import errno
import subprocess
from collections.abc import Collection, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import matplotlib as mpl
import numpy as np
import shapely
from matplotlib.animation import FFMpegWriter, PillowWriter

from hrsnake_env.arm import FloatArray, joints_from_configuration
from hrsnake_env.contacts import PINCH_TOLERANCE
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.pictures import MazePicture
from planners.export.trajectory import Trajectory
from planners.interrupts import interruption_first
from planners.problem import Progress

__all__ = ["gif_bytes", "mp4_bytes"]

FASTEST, SLOWEST = {"gif": 15, "mp4": 30}, {"gif": 2, "mp4": 5}
"""Frames per second."""

MOST_FRAMES = {"gif": 400, "mp4": 2500}
"""Longer videos show fewer frames per second, and still take as long as the arm."""

HEIGHT = 4.8
"""Of the picture, in inches."""


def gif_bytes(
    trajectory: Trajectory, maze: Maze, link_radius: float = 0.0, progress: Progress | None = None
) -> bytes:
    """Return a GIF of a trajectory; orange links pinch a wall."""
    return _film("gif", trajectory, maze, link_radius, progress)


def mp4_bytes(
    trajectory: Trajectory, maze: Maze, link_radius: float = 0.0, progress: Progress | None = None
) -> bytes:
    """Return an MP4 of a trajectory (H.264); orange links pinch a wall.

    Raises
    ------
    InputError
        If imageio-ffmpeg is not installed.
    """
    return _film("mp4", trajectory, maze, link_radius, progress)


def _film(
    kind: str, trajectory: Trajectory, maze: Maze, link_radius: float, progress: Progress | None
) -> bytes:
    frames, rate = _frames(kind, trajectory)
    writer, settings = _writer(kind, rate)
    picture = MazePicture(maze, height=HEIGHT, title="orange: pinches a wall")
    reach = link_radius + PINCH_TOLERANCE * trajectory.link_length
    with TemporaryDirectory() as folder, settings, interruption_first(), _ffmpeg_errors(folder):
        out = Path(folder) / f"arm.{kind}"
        with writer.saving(picture.figure, str(out), dpi=picture.figure.dpi):
            for number, joints in enumerate(frames):
                picture.draw_arm(joints, pinched=_pinched(joints, maze, reach))
                writer.grab_frame(facecolor=picture.figure.get_facecolor())
                if progress is not None:
                    progress("film", (number + 1) / len(frames))
        return out.read_bytes()


@contextmanager
def _ffmpeg_errors(folder: str) -> Iterator[None]:
    """Tell that ffmpeg has failed, as on a full disk, as an error of writing."""
    try:
        yield
    except (BrokenPipeError, subprocess.CalledProcessError) as error:
        raise OSError(errno.EIO, "ffmpeg could not write the film (is the disk full?)", folder) from error


def _frames(kind: str, trajectory: Trajectory) -> tuple[FloatArray, float]:
    """Return joint positions at even times, and how many of them are a second."""
    rate = float(np.clip(MOST_FRAMES[kind] / trajectory.duration, SLOWEST[kind], FASTEST[kind]))
    # A hundredth of a second is the clock of a GIF.
    rate = 100.0 / np.ceil(100.0 / rate) if kind == "gif" else rate
    times = np.append(np.arange(0.0, trajectory.duration, 1.0 / rate), trajectory.duration)
    nearest = np.clip(np.searchsorted(trajectory.time, times), 0, trajectory.n_points - 1)
    joints = joints_from_configuration(
        trajectory.feed[nearest],
        trajectory.joint_angles[nearest],
        trajectory.link_length,
        trajectory.base_pose,
    )
    return joints, rate


def _writer(kind: str, rate: float) -> tuple[Any, AbstractContextManager[Any]]:
    if kind == "gif":
        return PillowWriter(fps=rate), nullcontext()  # type: ignore[arg-type]
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError(
            "Expected imageio-ffmpeg, which writes MP4; install it with: pip install 'hrsnake[export]'"
        ) from None
    options = ["-pix_fmt", "yuv420p", "-loglevel", "quiet"]  # Ctrl-C is its own, too, and it would say so
    writer = FFMpegWriter(fps=rate, codec="h264", extra_args=options)  # type: ignore[arg-type]
    return writer, mpl.rc_context({"animation.ffmpeg_path": imageio_ffmpeg.get_ffmpeg_exe()})


def _pinched(joints: FloatArray, maze: Maze, reach: float) -> Collection[int]:
    """Return the links, past the base, that a wall is within reach of."""
    x, y, heading = maze.base_pose
    outside = (joints[:-1] - (x, y)) @ (np.cos(heading), np.sin(heading)) >= 0.0
    links = shapely.linestrings(np.stack([joints[:-1], joints[1:]], axis=1))
    near = shapely.distance(links, maze.free_space.boundary) <= reach
    return [int(link) for link in np.flatnonzero(near & outside)]
