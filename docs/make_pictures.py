"""The pictures of `docs/planners.md`, drawn from what the planners really do.

Run `.venv/bin/python docs/make_pictures.py` from the repository's root: it writes
`docs/images/viable_intervals.png`, `track_chords_poses.png` and `beams_and_corners.png`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Wedge

from hrsnake_env.appearance import COLOURS
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from planners.corners import critical_corners
from planners.drawing import draw_geometry
from planners.figures import draw_rings, draw_walls
from planners.kernels.rod import free_directions
from planners.planning import plan
from planners.survey import survey
from planners.sweep_planner import FINENESSES, MAX_INNER_BEAM, MIN_CURVATURE, VARIANTS
from planners.sweep_track import Track, aim_line, grow

IMAGES = Path(__file__).parent / "images"
LINK_LENGTH = 430.0
START = 261  # the vertex whose link is looked at: the alley is open to it, and will close
VIABLE, CLOSING, TRACK, AIM, GREY = "#2e9e5b", "#d97a12", "#8e44ad", "#d6336c", "#4b5058"
POSES = ("#0b3c78", "#2f7fd0", "#17a2a2")
NOTE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}


def grown_track(maze: Maze) -> Track:
    """Grow a track that takes all corners in the first way."""
    geometry, arm = survey(maze), ArmSpec(link_length=LINK_LENGTH)
    assert geometry is not None
    corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE, MAX_INNER_BEAM)
    aim = aim_line(geometry, corners, [VARIANTS[0]] * len(corners), LINK_LENGTH)
    track = grow(geometry, arm, FINENESSES[1], aim)
    assert track.reached
    return track


def intervals(maze: Maze, points: FloatArray) -> list[FloatArray]:
    """Return the free intervals of directions at each point, each array of shape (n, 2), in rad."""
    room = len(maze.walls) + 1
    blocked, gaps = np.empty((room, 2)), np.empty((room, 2))
    found = []
    for x, y in points:
        n = free_directions(x, y, LINK_LENGTH, maze.walls, 1e-6, blocked, gaps)
        found.append(gaps[:n].copy())
    return found


def viable(found: list[FloatArray]) -> list[list[bool]]:
    """Tell which intervals stay joined to one at the last point, as the planner's pruning does."""
    alive = [[True] * len(found[-1])]
    for these, later in zip(found[-2::-1], found[::-1], strict=False):
        keeps = [
            any(stays and overlap(a, b) for b, stays in zip(later, alive[0], strict=True)) for a in these
        ]
        alive.insert(0, keeps)
    return alive


def overlap(a: FloatArray, b: FloatArray) -> bool:
    """Tell whether two intervals of directions overlap."""
    offset = abs((a.mean() - b.mean() + np.pi) % (2.0 * np.pi) - np.pi)
    return bool(offset <= 0.5 * (a[1] - a[0] + b[1] - b[0]))


def draw_viable_intervals(out: Path) -> None:
    """Draw the free directions of one link, and what becomes of them while its start moves on."""
    lines = [[(0, 0), (0, 1500), (1500, 1500)], [(-20, 820), (330, 1130)]]
    maze = Maze.from_corridors(lines, [200.0, 150.0], goal=(1400, 1500), goal_radius=25.0)
    track = grown_track(maze)
    end = int(np.flatnonzero(track.start[: track.n] == START)[-1])
    way = track.points[START : end + 1]
    found = intervals(maze, way)
    alive = viable(found)
    figure = Figure(figsize=(10.0, 6.6), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    place, chart = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    draw_walls(place, maze)
    draw_wedges(place, track, end, found[0], alive[0])
    draw_bands(chart, way, found, alive, track.headings[end])
    save(figure, out)


def draw_wedges(axes: Axes, track: Track, end: int, gaps: FloatArray, alive: list[bool]) -> None:
    """Draw a link, the free directions about its start, the aim line and the track."""
    start, tip = track.points[START], track.points[end]
    for (first, last), stays in zip(np.degrees(gaps), alive, strict=True):
        colour = VIABLE if stays else CLOSING
        axes.add_patch(Wedge(tuple(start), LINK_LENGTH, first, last, facecolor=colour, alpha=0.35, zorder=2))
    axes.plot(*track.points[START : end + 1].T, color=TRACK, linewidth=2.6, zorder=4)
    axes.plot(*track.points[: START + 1].T, color=TRACK, linewidth=1.2, zorder=3)
    axes.plot(*track.aim.T, color=AIM, linewidth=1.8, linestyle=(0, (5, 3)), zorder=7)
    behind = track.points[track.start[START]]
    for a, b, width in ((behind, start, 2.2), (start, tip, 4.0)):
        axes.plot(
            *np.array([a, b]).T, color=COLOURS["arm"], linewidth=width, solid_capstyle="round", zorder=7
        )
    axes.plot(*np.array([start, tip]).T, "o", color=COLOURS["joint"], markersize=6, zorder=8)
    axes.set_xlim(-190.0, 470.0)
    axes.set_ylim(560.0, 1640.0)
    notes = (
        ("start of the link", start, (90, 625), GREY),
        ("closing: free now,\nbut not for long", start + 330 * unit(47.0), (290, 800), CLOSING),
        ("viable: free during the\nnext link length of feed", start + 385 * unit(75.0), (310, 1325), VIABLE),
        ("joint track: along it\nthe start moves on", track.points[end - 45], (330, 1218), TRACK),
        ("aim line: out at corners", track.aim[np.argmax(track.aim[:, 0] > 120.0)], (270, 1510), AIM),
    )  # fmt: skip
    for text, spot, at, colour in notes:
        line = {"arrowstyle": "-", "color": colour, "linewidth": 1.0}
        style = {"ha": "center", "va": "center", "fontsize": 8.5, "zorder": 9, "bbox": NOTE}
        axes.annotate(text, tuple(spot), xytext=at, color=colour, weight="bold", arrowprops=line, **style)
    axes.set_title("One link, all directions that are free for it", fontsize=11)


def draw_bands(
    axes: Axes, way: FloatArray, found: list[FloatArray], alive: list[list[bool]], heading: float
) -> None:
    """Draw the free intervals over the way of the link's start."""
    travelled = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
    for stays, colour in ((True, VIABLE), (False, CLOSING)):
        patches = [
            [(x, first), (x, last)]
            for x, gaps, keeps in zip(travelled, found, alive, strict=True)
            for (first, last), kept in zip(np.degrees(gaps), keeps, strict=True)
            if kept == stays
        ]
        axes.add_collection(LineCollection(patches, colors=colour, linewidths=6.0, capstyle="butt"))
    axes.plot(0.0, np.degrees(heading), "o", color=COLOURS["arm"], markersize=8, clip_on=False, zorder=5)
    axes.annotate(
        "the link", (8.0, np.degrees(heading) + 2.0), color=COLOURS["arm"], weight="bold", fontsize=9
    )
    inside = {"color": "white", "weight": "bold", "fontsize": 10, "ha": "center", "va": "center"}
    axes.annotate("viable: links are clamped into it", (225.0, 76.0), **inside)
    axes.annotate("closing: never entered", (92.0, 36.0), rotation=-27.0, **inside)
    axes.set_xlim(0.0, LINK_LENGTH)
    axes.set_ylim(-10.0, 110.0)
    axes.set_xlabel("way of the link's start along the track, one link length (px)", fontsize=9)
    axes.set_ylabel("direction of the link (deg)", fontsize=9)
    axes.set_axisbelow(True)
    axes.grid(color="#e3e5e8", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title("The same directions while the arm is fed", fontsize=11)


def unit(degrees: float) -> FloatArray:
    """Return the unit vector in a direction."""
    return np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])


def draw_track_chords_poses(out: Path) -> None:
    """Draw the joint track of the benchmark, the fan of its chords, and three poses."""
    maze = Maze.load("fig19")
    track = grown_track(maze)
    points, per_link = turned(track.points[: track.n]), track.fineness.per_link
    figure = Figure(figsize=(10.0, 3.5), dpi=140, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw_rings(axes, [turned(ring) for ring in maze.rings])
    ends = np.arange(per_link, track.n, 3)
    chords = np.stack([points[track.start[ends]], points[ends]], axis=1)
    axes.add_collection(LineCollection(list(chords), colors="#9aa1ab", linewidths=0.35, alpha=0.8, zorder=1))
    axes.plot(*points.T, color=TRACK, linewidth=2.0, zorder=3)
    for tip, colour in zip(pose_tips(points), POSES, strict=True):
        vertices = [tip]
        while vertices[-1] > per_link:
            vertices.append(int(track.start[vertices[-1]]))
        style = {"linewidth": 2.6, "markersize": 6.5, "markeredgecolor": "white", "markeredgewidth": 0.8}
        axes.plot(*points[vertices].T, "o-", color=colour, solid_capstyle="round", zorder=5, **style)
    write_notes(axes, points)
    x, y = turned(maze.goal)
    axes.add_patch(Circle((x, y), maze.goal_radius, facecolor=COLOURS["goal"], alpha=0.35, zorder=2))
    axes.set_xlim(-60.0, 1650.0)
    axes.set_ylim(-370.0, 130.0)
    save(figure, out)


def pose_tips(points: FloatArray) -> tuple[int, int, int]:
    """Choose three poses by their tips: before the turn, in it, and at the goal."""
    before = int(np.argmax(points[:, 0] > 1120.0))
    inside = int(np.argmax((points[:, 0] > 1500.0) & (points[:, 1] < -190.0)))
    return before, inside, len(points) - 1


def write_notes(axes: Axes, points: FloatArray) -> None:
    """Name the track, its chords and the poses."""
    track = points[int(np.argmax(points[:, 0] > 590.0))]
    notes = (
        ("joint track", track, (620, -55), TRACK),
        ("its chords of one link length: all places of all links", (1420, -215), (960, -180), GREY),
        ("three poses: all joints on the track", None, (240, -180), POSES[0]),
    )
    for text, spot, at, colour in notes:
        line = {"arrowstyle": "-", "color": colour, "linewidth": 1.0}
        style = {"ha": "center", "va": "center", "fontsize": 9, "zorder": 9, "bbox": NOTE}
        leader = {} if spot is None else {"xytext": at, "arrowprops": line}
        axes.annotate(
            text, at if spot is None else tuple(spot), color=colour, weight="bold", **leader, **style
        )


def turned(points: FloatArray) -> FloatArray:
    """Turn points a quarter to the right, so that the benchmark lies."""
    return np.stack([points[..., 1], -points[..., 0]], axis=-1)


def save(figure: Figure, out: Path) -> None:
    """Write a picture, completely or not at all."""
    with replacing(out) as part:
        figure.savefig(part, facecolor="white")
    print(f"Written: {out.relative_to(IMAGES.parent.parent)}")


def draw_beams_and_corners(out: Path) -> None:
    """Draw what the paper's planner sees in a workspace like its Fig. 17b, and its motion."""
    maze = Maze.load("fig17b")
    motion = plan(maze, ArmSpec(link_length=PAPER_LINK_LENGTHS["fig17b"]), "beam").motion
    assert motion is not None
    draw_geometry(maze, motion, out)
    print(f"Written: {out.relative_to(IMAGES.parent.parent)}")


if __name__ == "__main__":
    draw_viable_intervals(IMAGES / "viable_intervals.png")
    draw_track_chords_poses(IMAGES / "track_chords_poses.png")
    draw_beams_and_corners(IMAGES / "beams_and_corners.png")
