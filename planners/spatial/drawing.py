"""Pictures of an arm in space for paper: the room with its walls seen through, the path, the arm in a pose.

They are drawn as seen from far away, farthest things first. What is farther is exact: faces of walls part the
room, again and again, until each part holds lines alone (a binary space partition).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from numpy.typing import ArrayLike

from hrsnake_env.appearance import COLOURS, FEEDER_SHARE, RGB, link_colours, mixed, rgb
from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.spatial.panel import AXES
from planners.spatial.problem import SpatialMotion
from planners.spatial.solids import Face, Solid, Stroke, from_behind, lifted, solids
from planners.spatial.workspace import Workspace

__all__ = ["draw_motion", "feeder_ends"]

VIEWS = ((-58.0, 26.0), (-78.0, 62.0))
"""From where the two views look: azimuth and elevation in degrees."""

SOLID, FLOOR, BACK, GRID = "#97a3b4", "#f1f3f6", "#fafbfc", "#e1e4e9"
INK, SOFT = "#1c2128", "#5b6470"
GLASS, MANY_WALLS = 0.15, 12
"""How much a wall hides of what is behind it; if there are more walls than that, each hides less."""

LIGHT = ((0.90, 0.98), (0.82, 0.94), (0.80, 1.08))
"""Brightness of faces along each axis, turned to its low and to its high end."""

DPI = 200
WIDTH, MARGIN, HEAD, FOOT = 6.0, 0.52, 0.42, 0.34
"""Of one view in inches, about the room; above it for the title, below it for the legend."""

LINK_WIDTH, JOINT_WIDTH = 2.6, 3.6
"""Least widths, in points."""


def feeder_ends(workspace: Workspace, base_pose: ArrayLike) -> FloatArray:
    """Return where the part of the feeder that is shown begins, and its end, the base; shape (2, 3)."""
    base = np.asarray(base_pose, dtype=np.float64)
    return np.stack([base[:3] - FEEDER_SHARE * workspace.size * base[3:], base[:3]])


# One view


class _View:
    """Draw a room as seen from far away.

    Parameters
    ----------
    workspace : Workspace
        The room.
    azimuth, elevation : float
        From where, in degrees.
    feeder : array, shape (2, 3)
        Its ends, which are shown too.
    """

    def __init__(self, workspace: Workspace, azimuth: float, elevation: float, feeder: FloatArray) -> None:
        yaw, pitch = math.radians(azimuth), math.radians(elevation)
        self.workspace, self.feeder = workspace, feeder
        self.out = np.array(
            [math.cos(pitch) * math.cos(yaw), math.cos(pitch) * math.sin(yaw), math.sin(pitch)]
        )
        self.right = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        self.up = np.cross(self.out, self.right)
        low, high = workspace.room_low, workspace.room_high
        corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
        shown = self.flat(np.concatenate([corners, feeder]))
        self.low, self.high = shown.min(axis=0), shown.max(axis=0)

    def flat(self, points: ArrayLike) -> FloatArray:
        """Return where points, shape (..., 3), are on the page, shape (..., 2), in workspace units."""
        flat: FloatArray = np.asarray(points, dtype=np.float64) @ np.stack([self.right, self.up], axis=1)
        return flat

    def draw(self, axes: Axes, strokes: list[Stroke]) -> None:
        """Draw the room with what is in it."""
        self._draw_backdrop(axes)
        walls = solids(self.workspace)
        self._glass = GLASS * min(1.0, math.sqrt(MANY_WALLS / max(len(walls), 1)))
        faces = [face for wall in walls for face in wall.faces if face.sign * self.out[face.axis] > 1e-9]
        items = from_behind(faces, [*strokes, *_edges(walls)], self.out)
        runs = itertools.groupby(items, key=lambda item: isinstance(item, Face))
        for number, (are_faces, run) in enumerate(runs):
            add = self._add_faces if are_faces else self._add_strokes
            add(axes, list(run), 2.0 + 0.001 * number)  # type: ignore[arg-type]

    def _add_faces(self, axes: Axes, faces: list[Face], zorder: float) -> None:
        outlines = []
        for face in faces:
            rings = [shapely.get_coordinates(r) for r in (face.polygon.exterior, *face.polygon.interiors)]
            flat = [self.flat([lifted(p, face.axis, face.at) for p in ring]) for ring in rings]
            codes = [
                c for r in flat for c in (Outline.MOVETO, *[Outline.LINETO] * (len(r) - 2), Outline.CLOSEPOLY)
            ]
            outlines.append(Outline(np.concatenate(flat), codes))
        shades = [LIGHT[face.axis][int(face.sign > 0)] for face in faces]
        solid = np.array(bytearray.fromhex(SOLID[1:])) / 255.0
        colours = [(*np.minimum(shade * solid, 1.0), self._glass) for shade in shades]
        axes.add_collection(
            PathCollection(outlines, facecolors=colours, edgecolors="none", zorder=zorder), autolim=False
        )

    def _add_strokes(self, axes: Axes, strokes: list[Stroke], zorder: float) -> None:
        axes.add_collection(
            LineCollection(
                [self.flat([one.start, one.end]) for one in strokes],
                colors=[one.colour for one in strokes],
                linewidths=[one.width for one in strokes],
                capstyle="round",
                zorder=zorder,
            ),
            autolim=False,
        )

    def _draw_backdrop(self, axes: Axes) -> None:
        """Draw the sides of the room behind all else, with a grid, and numbers along its edges."""
        low, high = self.workspace.room_low, self.workspace.room_high
        ticks = _ticks(low, high)
        for axis in range(3):
            at = low[axis] if self.out[axis] > 0.0 else high[axis]
            b, c = (axis + 1) % 3, (axis + 2) % 3
            corners = [(low[b], low[c]), (high[b], low[c]), (high[b], high[c]), (low[b], high[c])]
            axes.fill(
                *self.flat([lifted(p, axis, at) for p in corners]).T,
                facecolor=FLOOR if axis == 2 else BACK,
                edgecolor=COLOURS["wall"],
                linewidth=0.8,
                zorder=1.0,
            )
            lines = [[(x, low[c]), (x, high[c])] for x in ticks[b]]
            lines += [[(low[b], y), (high[b], y)] for y in ticks[c]]
            flat = [self.flat([lifted(p, axis, at) for p in line]) for line in lines]
            axes.add_collection(LineCollection(flat, colors=GRID, linewidths=0.6, zorder=1.1), autolim=False)
        self._write_ticks(axes, ticks)

    def _write_ticks(self, axes: Axes, ticks: list[FloatArray]) -> None:
        low, high, size = self.workspace.room_low, self.workspace.room_high, self.workspace.size
        near = np.where(self.out > 0.0, high, low)
        far = np.where(self.out > 0.0, low, high)
        # The upright edge at the left end of the picture has the numbers of z.
        upright = min(((near[0], far[1]), (far[0], near[1])), key=lambda p: self.right @ (*p, 0.0))
        edges = [(0, near[1], low[2]), (1, near[0], low[2]), (2, *upright)]
        for axis, first, second in edges:
            others = [k for k in range(3) if k != axis]
            middle = 0.5 * (low + high)
            places = np.zeros((len(ticks[axis]) + 1, 3))
            places[:, axis] = [*ticks[axis], middle[axis]]
            places[:, others] = first, second
            aside = np.zeros(3)
            aside[others] = np.array([first, second]) - middle[others]
            if axis != 2:
                aside[2] = 0.0
            way = self.flat(aside)
            way /= np.linalg.norm(way)
            flat = self.flat(places)
            style: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 9, "color": SOFT}
            for tick, place in list(zip(ticks[axis], flat[:-1], strict=True))[int(axis == 2) :]:
                x, y = place + 0.026 * size * way
                axes.text(x, y, f"{tick:g}", fontsize=7, **style)
            name = f"{AXES[axis]} ({self.workspace.units})"
            away = 0.065 + 0.035 * abs(way[0]) * (axis != 2)  # letters are wider than high
            turn = 90.0 if axis == 2 else 0.0
            x, y = flat[-1] + away * size * way
            axes.text(x, y, name, fontsize=8, rotation=turn, **style)


def _ticks(low: FloatArray, high: FloatArray) -> list[FloatArray]:
    """Return round numbers along each axis of a room."""
    most = float((high - low).max())
    power = 10.0 ** math.floor(math.log10(most / 4.0))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if most / (k * power) <= 6.5)
    return [
        step * np.arange(math.ceil(a / step - 1e-9), math.floor(b / step + 1e-9) + 1)
        for a, b in zip(low, high, strict=True)
    ]


def _edges(walls: list[Solid]) -> Iterator[Stroke]:
    for wall in walls:
        for (start, end), of_window in zip(wall.edges, wall.of_window, strict=True):
            colour = (*(channel / 255.0 for channel in rgb("edge")), 0.9 if of_window else 0.35)
            yield Stroke(start=start, end=end, colour=colour, width=0.9 if of_window else 0.5)


# The arm


def _arm_strokes(
    joints: FloatArray,
    colours: list[RGB],
    *,
    feeder: FloatArray,
    widths: tuple[float, float],
    share: float,
    lift: float,
    size: float,
) -> Iterator[Stroke]:
    """Yield the links past the base in short pieces, and their joints; `share` below 1 fades them.

    Poses may lie on each other: the one with the larger `lift` is seen.
    """
    heading = (feeder[1] - feeder[0]) / np.linalg.norm(feeder[1] - feeder[0])
    ahead = (joints - feeder[1]) @ heading
    aside = np.linalg.norm(joints - feeder[1] - ahead[:, None] * heading, axis=1)
    in_feeder = (ahead < 0.0) & (aside < 1e-6 * size)
    dot = np.array([1e-5 * size, 0.0, 0.0])
    for k, colour in enumerate(colours):
        if in_feeder[k + 1]:
            continue
        start, end = feeder[1] if in_feeder[k] else joints[k], joints[k + 1]
        n_pieces = max(2, math.ceil(float(np.linalg.norm(end - start)) / (0.012 * size)))
        width = widths[0] * (1.25 if colour == rgb("collision") else 1.0)
        for a, b in itertools.pairwise(np.linspace(start, end, n_pieces + 1)):
            yield Stroke(start=a, end=b, colour=_tint(colour, share), width=width, lift=lift)
        for place in (start, end) if share == 1.0 else ():
            above, colour = lift + 0.016 * size, rgb("joint")
            yield Stroke(start=place, end=place + dot, colour=_tint(colour), width=widths[1], lift=above)


def _tint(colour: RGB, share: float = 1.0) -> tuple[float, ...]:
    return tuple(channel / 255.0 for channel in mixed((255, 255, 255), colour, share))


def draw_motion(
    workspace: Workspace,
    motion: SpatialMotion,
    path: FloatArray | None,
    picture: Path,
    *,
    poses: Sequence[int] | None = None,
    title: str | None = None,
    distances: ArrayLike | None = None,
    link_radius: float = 0.0,
    views: Sequence[tuple[float, float]] = VIEWS,
) -> None:
    """Draw an arm in its room, seen from two sides.

    Parameters
    ----------
    workspace : Workspace
        The room.
    motion : SpatialMotion
        In that room.
    path : array, shape (n, 3), or None
        The path of the point robot.
    picture : Path
        The file; its ending says the format (.png, .svg, .pdf).
    poses : sequence of int, optional
        Which poses, from the faintest to the one in full colour; negative ones count from the end. By default
        the one in which a link is deepest in a wall, or else the last.
    title : str, optional
        Above the picture. By default it says the arm and the pose.
    distances : array-like, shape (n_poses, n_links), optional
        Of each link from the walls, in workspace units; negative is the depth in them.
    link_radius : float
        In workspace units.
    views : sequence of (azimuth, elevation)
        From where, in degrees.

    Raises
    ------
    InputError
        If there is no such pose, or shapes do not agree.
    """
    measured = None
    if distances is not None:
        # Farther than the room is large is as good as not measured.
        measured = np.minimum(np.asarray(distances, dtype=np.float64), workspace.size)
        wanted = (motion.n_poses, motion.n_links)
        if measured.shape != wanted:
            raise InputError(f"Expected distances with shape {wanted}, got {measured.shape}.")
    shown = _shown_poses(motion, measured, poses)
    feeder = feeder_ends(workspace, motion.base_pose)
    sheet = _Sheet([_View(workspace, *view, feeder) for view in views])
    widths = sheet.line_widths(motion.link_length, link_radius)
    strokes = list(_inside(workspace, motion, path, shown, measured, feeder, widths))
    for axes, view in zip(sheet.axes, sheet.views, strict=True):
        view.draw(axes, strokes)
        _mark_ends(axes, view, workspace)
    sheet.write(
        _title(workspace, motion, measured, shown[-1]) if title is None else title,
        _legend(path, None if measured is None else measured[shown]),
    )
    with replacing(picture) as part:
        sheet.figure.savefig(part, facecolor="white")


class _Sheet:
    """Lay views side by side, at one scale."""

    def __init__(self, views: list[_View]) -> None:
        spans = np.array([view.high - view.low for view in views])
        self.views = views
        self.scale = (WIDTH - 2.0 * MARGIN) / float(spans[:, 0].max())  # inches per workspace unit
        inner = float(spans[:, 1].max()) * self.scale + 2.0 * MARGIN
        self.height = inner + HEAD + FOOT
        size = (WIDTH * len(views), self.height)
        self.figure = Figure(figsize=size, dpi=DPI, facecolor="white")
        self.figure.set_layout_engine("none")  # views are placed below, whatever the user's settings
        FigureCanvasAgg(self.figure)
        self.axes = []
        for number, view in enumerate(views):
            place = (number / len(views), FOOT / self.height, 1.0 / len(views), inner / self.height)
            axes = self.figure.add_axes(place)
            axes.set_axis_off()
            middle, half = 0.5 * (view.low + view.high), 0.5 * np.array([WIDTH, inner]) / self.scale
            axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
            axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
            self.axes.append(axes)

    def line_widths(self, link_length: float, link_radius: float) -> tuple[float, float]:
        """Return widths of links and joints, in points."""
        width = max(LINK_WIDTH, 144.0 * link_radius * self.scale)
        # Joints that stand close together would hide the links.
        close = 72.0 * link_length * self.scale < 2.5 * JOINT_WIDTH
        return width, 0.5 * width if close else max(JOINT_WIDTH, 1.3 * width)

    def write(self, title: str, legend: list[Line2D]) -> None:
        """Write the title above and the legend below."""
        self.figure.text(0.5, 1.0 - 0.5 * HEAD / self.height, title, ha="center", va="center", fontsize=11)
        self.figure.legend(handles=legend, loc="lower center", ncols=len(legend), frameon=False, fontsize=8)


def _shown_poses(
    motion: SpatialMotion, distances: FloatArray | None, poses: Sequence[int] | None
) -> list[int]:
    if poses is None:
        worst = None if distances is None else int(np.argmin(distances.min(axis=1)))
        collides = worst is not None and distances is not None and distances[worst].min() < 0.0
        return [worst if collides and worst is not None else motion.n_poses - 1]
    for pose in poses:
        if not -motion.n_poses <= pose < motion.n_poses:
            raise InputError(f"Expected poses from 0 to {motion.n_poses - 1}, got {pose}.")
    if len(poses) == 0:
        raise InputError("Expected at least one pose to draw, got none.")
    return [int(pose) % motion.n_poses for pose in poses]


def _inside(
    workspace: Workspace,
    motion: SpatialMotion,
    path: FloatArray | None,
    poses: list[int],
    distances: FloatArray | None,
    feeder: FloatArray,
    widths: tuple[float, float],
) -> Iterator[Stroke]:
    """Yield what is in the room: feeder, path, the arm in its poses; widths are those of links and joints."""
    size, sleeve = workspace.size, 2.4 * widths[0]
    yield Stroke(start=feeder[0], end=feeder[1], colour=_tint(rgb("base")), width=sleeve, lift=size)
    if path is not None:
        points = np.asarray(path, dtype=np.float64)
        step = max(1, len(points) // 400)
        points = np.concatenate([points[:-1:step], points[-1:]])
        for k, (a, b) in enumerate(itertools.pairwise(points)):
            if k % 3 != 2:  # dashes
                yield Stroke(start=a, end=b, colour=INK, width=1.0, lift=-0.002 * size)
    for number, pose in enumerate(poses):
        clear = None if distances is None else distances[pose]
        colours = link_colours(motion.n_links, clearances=clear, link_length=motion.link_length)
        if clear is not None:
            colours = [rgb("collision") if d < 0.0 else c for c, d in zip(colours, clear, strict=True)]
        share = 1.0 if number == len(poses) - 1 else 0.25 + 0.35 * number / max(len(poses) - 1, 1)
        lift = size * (0.004 + 0.02 * number)
        yield from _arm_strokes(
            motion.joints[pose], colours, feeder=feeder, widths=widths, share=share, lift=lift, size=size
        )


def _mark_ends(axes: Axes, view: _View, workspace: Workspace) -> None:
    goal, base = (tuple(view.flat(place)) for place in (workspace.goal, view.feeder[0]))
    axes.plot(*goal, "o", color=COLOURS["goal"], markersize=6.5, markeredgecolor="white", zorder=8)
    style: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8, "zorder": 10, "weight": "bold"}
    style["path_effects"] = [withStroke(linewidth=2.2, foreground="white")]
    axes.annotate("goal", goal, (0, -11), ha="center", color=COLOURS["goal"], **style)
    axes.annotate("feeder", base, (2, -13), ha="center", color=COLOURS["base"], **style)


def _title(workspace: Workspace, motion: SpatialMotion, distances: FloatArray | None, pose: int) -> str:
    arm = f"{motion.n_links} links of {motion.link_length:g} {workspace.units}"
    text = f"{arm}, pose {pose} of {motion.n_poses - 1}"
    if distances is None:
        return text
    least = float(distances[pose].min())
    return text + (f": {-least:.3g} deep in a wall" if least < 0.0 else f": {least:.3g} clear of the walls")


def _legend(path: FloatArray | None, distances: FloatArray | None) -> list[Line2D]:
    lines = [Line2D([], [], color=COLOURS["arm"], linewidth=3.0, label="link")]
    if distances is not None:
        lines.append(Line2D([], [], color=COLOURS["near"], linewidth=3.0, label="link near a wall"))
        if distances.min() < 0.0:
            lines.append(Line2D([], [], color=COLOURS["collision"], linewidth=3.4, label="link in a wall"))
    if path is not None:
        dashed: dict[str, Any] = {"color": INK, "linewidth": 1.0, "linestyle": (0, (3, 1.5))}
        lines.append(Line2D([], [], label="path of a point", **dashed))
    return lines
