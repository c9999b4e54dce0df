"""The pictures of the environments' pages: the arm at the goal, and the planner's episode, in every maze.

`make docs-pictures` writes them to `docs/environments/pictures/`, with the benchmark's run as a page to play.
`docs/make_environment_pictures.py u-turn` draws those with that in their name.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from make_environment_pages import pictures
from PIL import Image
from rich.progress import track

from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.rendering import Frame, FrameRenderer
from hrsnake_env.replay import save_replay
from planners.controllers import PlanningPolicy
from planners.rollout import Episode, run_episode

OUT = Path(__file__).parent / "environments" / "pictures"
REPLAYED = "fig19"
LARGE, QUARTER, SMALL = (960, 480), (240, 240), (480, 360)
"""Width and height, in pixels, that pictures, each of four in one, and animations fit into."""

MILLISECONDS, AT_THE_GOAL = 90, 1500
LARGEST = 250_000
"""An animation that has more bytes gets fewer frames."""

N_TASKS = 4
"""So many random mazes are shown."""

COLOURS = 48


def draw(stem: str, name: str) -> None:
    """Draw both pictures of a maze; of random mazes, several."""
    env = gym.make(name)
    world: Any = env.unwrapped
    policy, n = PlanningPolicy(env), N_TASKS if stem.startswith("random") else 1
    runs: list[tuple[Maze, Episode]] = []
    for seed in range(n):
        episode = run_episode(env, policy, seed=seed)
        runs.append((world.maze, episode))
    if n == 1:
        picture = Drawing(*runs[0], LARGE).frame(-1)
    else:
        rows = np.array([Drawing(*run, QUARTER).frame(-1) for run in runs]).reshape(2, 2, *QUARTER, 3)
        picture = np.concatenate(np.concatenate(rows, axis=1), axis=1)
    write_png(picture, stem)
    drawings = [Drawing(*run, SMALL if n == 1 else (SMALL[1], SMALL[1])) for run in runs]
    animation = OUT / f"{stem}.gif"
    for n_frames in (60, 52, 44, 36):
        write_gif([frame for drawing in drawings for frame in drawing.frames(n_frames // n)], animation)
        if animation.stat().st_size <= LARGEST:
            break
    if stem == REPLAYED:
        save_replay([runs[0][1].trace(runs[0][0])], OUT / f"{stem}.html")


class Drawing:
    """Draw poses of an episode in pictures that fit into a size; square ones have just that size."""

    def __init__(self, maze: Maze, episode: Episode, size: tuple[int, int]) -> None:
        self.episode = episode
        wide, high = size
        if wide == high:
            self.renderer = FrameRenderer(maze, size=size)
            return
        natural, _ = FrameRenderer(maze, size=high).size
        self.renderer = FrameRenderer(maze, size=2 * round(high * min(1.0, wide / natural) / 2))

    def frame(self, pose: int) -> Frame:
        """Draw a pose."""
        episode = self.episode
        return self.renderer.draw(
            episode.joints[pose],
            clearances=episode.clearances[pose],
            link_length=episode.report.link_length,
            contacts=episode.contacts[pose],
        )

    def frames(self, n: int) -> list[Frame]:
        """Draw poses from the start to the end, about evenly chosen."""
        chosen = np.unique(np.linspace(0, len(self.episode.joints) - 1, n).round().astype(int))
        return [self.frame(int(pose)) for pose in chosen]


def write_png(frame: Frame, stem: str) -> None:
    """Write a picture."""
    image = Image.fromarray(frame).quantize(COLOURS, dither=Image.Dither.NONE)
    with replacing(OUT / f"{stem}.png") as part:
        image.save(part, optimize=True)


def write_gif(frames: list[Frame], out: Path, milliseconds: int = MILLISECONDS) -> None:
    """Write an animation, all of whose frames have the same colours."""
    sample = np.concatenate(frames[:: max(len(frames) // 6, 1)] + frames[-1:], axis=1)
    palette = Image.fromarray(sample).quantize(COLOURS, dither=Image.Dither.NONE)
    images = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    times = [milliseconds] * (len(images) - 1) + [AT_THE_GOAL]
    with replacing(out) as part:
        images[0].save(
            part, save_all=True, append_images=images[1:], duration=times, loop=0, optimize=False, disposal=1
        )


def main(parts: list[str]) -> None:
    """Draw all, or those whose names have one of the parts in them."""
    OUT.mkdir(parents=True, exist_ok=True)
    wanted = [stem for stem in pictures() if not parts or any(part in stem for part in parts)]
    for stem in track(wanted, description="pictures"):
        draw(stem, pictures()[stem])
    sizes = [path.stat().st_size for path in OUT.iterdir()]
    print(f"{len(sizes)} files of {sum(sizes) / 1e6:.2f} MB, the largest of {max(sizes) / 1e3:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
