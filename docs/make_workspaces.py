"""The picture and the table of `docs/workspaces.md`, from motions that are planned, checked and driven here.

Run `.venv/bin/python docs/make_workspaces.py` from the repository's root: it writes `docs/images/fig17.png`
and prints the table as Markdown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from matplotlib.image import imsave
from numpy.typing import NDArray

from hrsnake_env.arm import ArmSpec
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from hrsnake_env.pictures import MazePicture
from planners import Motion, plan, rod_bound
from planners.figures import draw_beams, draw_path, draw_stages
from planners.rollout import Episode, simulate_motion
from planners.survey import Geometry, survey

OUT = Path(__file__).parent / "images" / "fig17.png"
WIDTH, DPI, GAP = 1400, 105, 8
"""Of the picture in pixels, pixels per inch, and pixels between its panels."""

PANELS = (("fig17a", "fig17b"), ("fig17c", "fig17d"))
EVERY = 5
"""One of so many beams is drawn."""

CHARACTERS = {
    "fig19": "U-turn round a thin wall",
    "fig17a": "four U-turns, then a spiral; tight everywhere",
    "fig17b": "a tight U-turn, then pillars in a hall",
    "fig17c": "a tight S-bend, a hall, a wide S-bend",
    "fig17d": "two rooms of irregular blocks, a tight crack between them",
}


@dataclass(frozen=True, eq=False)
class Workspace:
    """Hold a workspace, the arm that is run in it, and, computed once, what comes of it."""

    name: str

    @property
    def arm(self) -> ArmSpec:
        """The arm, with as many links as it takes."""
        return ArmSpec(link_length=PAPER_LINK_LENGTHS[self.name])

    @cached_property
    def maze(self) -> Maze:
        """The maze."""
        return Maze.load(self.name)

    @cached_property
    def geometry(self) -> Geometry:
        """Path and beams."""
        geometry = survey(self.maze)
        assert geometry is not None
        return geometry

    @cached_property
    def motion(self) -> Motion:
        """The motion that `auto` finds; it has passed the exact checker."""
        motion = plan(self.maze, self.arm).motion
        assert motion is not None, self.name
        return motion

    @cached_property
    def episode(self) -> Episode:
        """What the simulated arm did with it."""
        return simulate_motion(self.motion, self.maze, self.arm)


def draw(rows: list[list[Workspace]], out: Path) -> None:
    """Draw the workspaces in rows of equal width, each row as high as that makes it."""
    bands = []
    for row in rows:
        room = (WIDTH - GAP * (len(row) - 1)) / DPI
        shares = [
            float(np.divide(*MazePicture(space.maze, height=1.0).figure.get_size_inches())) for space in row
        ]
        bands.append(side_by_side([panel(space, room / sum(shares)) for space in row]))
    width = min(band.shape[1] for band in bands)
    gap = np.full((GAP, width, 3), 255, dtype=np.uint8)
    parts = [part for band in bands for part in (gap, band[:, :width])][1:]
    with replacing(out) as part:
        imsave(part, np.concatenate(parts))
    print(f"Written: {out.relative_to(OUT.parents[2])}\n")


def side_by_side(panels: list[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Return panels of one height in a row."""
    gap = np.full((len(panels[0]), GAP, 3), 255, dtype=np.uint8)
    return np.concatenate([part for image in panels for part in (gap, image)][1:], axis=1)


def panel(space: Workspace, height: float) -> NDArray[np.uint8]:
    """Draw one workspace: the path, the arm where it has been and where it ends; in the first, beams."""
    letter, links = space.name[-1], space.motion.n_links
    title = f"{letter}: {links} links of {space.arm.link_length:g} px"
    picture = MazePicture(space.maze, height=height, dpi=DPI, title=title)
    if letter == "a":  # as in the paper; elsewhere they would hide the halls
        draw_beams(picture.axes, space.geometry.beams, every=EVERY)
    draw_path(picture.axes, space.geometry.path, linewidth=0.9, zorder=3)
    draw_stages(picture.axes, space.episode.joints)
    return picture.rgb()


def print_table(spaces: list[Workspace]) -> None:
    """Print the table of the page."""
    print("| name | what it is | path | link | longest rod | index | links | poses | simulated |")
    print("|---|---|---|---|---|---|---|---|---|")
    for space in spaces:
        bound, link = rod_bound(space.maze), space.arm.link_length
        cells = (
            f"`{space.name}`",
            CHARACTERS[space.name],
            f"{space.geometry.path.length:,.0f}",
            f"{link:g}",
            f"{math.floor(10 * bound.lower) / 10:.1f} to {math.ceil(10 * bound.upper) / 10:.1f}",
            f"{math.floor(1000 * link / bound.upper) / 1000:.3f}",
            f"{space.motion.n_links}",
            f"{space.motion.n_poses}",
            "clean" if space.episode.success and space.episode.report.clean else "not clean",
        )
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    spaces = {name: Workspace(name) for name in PAPER_LINK_LENGTHS}
    draw([[spaces[name] for name in row] for row in PANELS], OUT)
    print_table(list(spaces.values()))
