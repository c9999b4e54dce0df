"""Trajectories as GIF, MP4 and pages."""

import io
import re

import imageio_ffmpeg
import pytest
from matplotlib.animation import FFMpegWriter
from PIL import Image

from hrsnake_env import ArmSpec, Maze
from hrsnake_env.pictures import MazePicture
from planners import plan
from planners.export import TrajectoryLimits, export
from planners.problem import Motion

MAZE = Maze.load("L")
LIMITS = TrajectoryLimits(
    feed_speed=4000.0, feed_acceleration=16000.0, joint_speed=20.0, joint_acceleration=200.0
)


@pytest.fixture(scope="module")
def motion() -> Motion:
    link = 270.0
    result = plan(MAZE, ArmSpec(link_length=link), planner="sweep")
    assert result.motion is not None
    return result.motion


def test_a_gif_takes_as_long_as_the_arm(motion: Motion) -> None:
    stages = []
    made = export(
        motion, MAZE, None, "gif", LIMITS, progress=lambda stage, share: stages.append((stage, share))
    )
    with Image.open(io.BytesIO(made.data)) as picture:
        durations = []
        for frame in range(picture.n_frames):
            picture.seek(frame)
            durations.append(picture.info["duration"])
    # Up to a frame at either end.
    assert sum(durations) / 1000.0 == pytest.approx(made.trajectory.duration, abs=0.2)
    assert ("film", 1.0) in stages


def test_an_mp4_takes_as_long_as_the_arm(motion: Motion, tmp_path) -> None:
    made = export(motion, MAZE, None, "mp4", LIMITS)
    file = tmp_path / "arm.mp4"
    file.write_bytes(made.data)
    frames, seconds = imageio_ffmpeg.count_frames_and_secs(str(file))
    assert seconds == pytest.approx(made.trajectory.duration, abs=0.2)
    assert frames / seconds == pytest.approx(30.0, abs=1.0)
    reader = imageio_ffmpeg.read_frames(str(file))
    facts = next(reader)
    reader.close()
    assert facts["codec"].startswith("h264")
    assert "yuv420p" in facts["pix_fmt"]


def test_ctrl_c_before_the_first_frame_is_ctrl_c(motion: Motion, monkeypatch) -> None:
    def stop(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(MazePicture, "draw_arm", stop)
    with pytest.raises(KeyboardInterrupt):
        export(motion, MAZE, None, "gif", LIMITS)


def test_ffmpeg_says_nothing_of_its_own_when_it_is_cut_short(motion: Motion, monkeypatch, caplog) -> None:
    writers = []
    run = FFMpegWriter._run

    def stop(*_args, **_kwargs):
        writers[0]._proc.stdin.write(b"half a frame")
        raise KeyboardInterrupt

    monkeypatch.setattr(FFMpegWriter, "_run", lambda self: (writers.append(self), run(self)))
    monkeypatch.setattr(MazePicture, "draw_arm", stop)
    with pytest.raises(KeyboardInterrupt):
        export(motion, MAZE, None, "mp4", LIMITS)
    assert not caplog.text


def test_a_page_needs_nothing_else(motion: Motion) -> None:
    made = export(motion, MAZE, None, "html")
    page = made.data.decode()
    assert page.lower().startswith("<!doctype html>")
    assert not re.search(r"(src|href)=[\"']https?:", page)
    assert made.trajectory is None
