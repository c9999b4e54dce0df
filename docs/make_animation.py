"""The animation on top of the README: 45 links of 245 px through the paper's long maze, as simulated.

Run `.venv/bin/python docs/make_animation.py` from the repository's root: it writes `docs/images/fig17a.gif`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from make_environment_pictures import Drawing, write_gif

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.planning import plan
from planners.rollout import simulate_motion

OUT = Path(__file__).parent / "images" / "fig17a.gif"
LINK_LENGTH = 245.0
SIZE = (720, 620)
N_FRAMES, MILLISECONDS = 130, 70


def main() -> None:
    """Plan, simulate and draw; nothing is drawn of a run that is not clean."""
    maze, arm = Maze.load("fig17a"), ArmSpec(link_length=LINK_LENGTH)
    result = plan(maze, arm)
    if result.motion is None:
        sys.exit(result.reason)
    episode = simulate_motion(result.motion, maze, arm)
    if not (episode.success and episode.report.clean):
        sys.exit("The simulated run is not clean.")
    write_gif(Drawing(maze, episode, SIZE).frames(N_FRAMES), OUT, MILLISECONDS)
    print(f"{OUT.name}: {OUT.stat().st_size / 1e3:.0f} kB, {result.motion}")


if __name__ == "__main__":
    main()
