"""Pictures of an arm in space for paper: the room with its walls seen through, the path, the arm in a pose.

They are drawn as seen from far away, farthest things first. What is farther is exact: faces of walls part the
room, again and again, until each part holds lines alone (a binary space partition).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
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
from numpy.typing import ArrayLike

from hrsnake_env.appearance import COLOURS, FEEDER_SHARE, link_colours, mixed, rgb
from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.spatial.problem import SpatialMotion
from planners.spatial.workspace import AXES, Workspace

__all__ = ["Face", "Solid", "draw_motion", "feeder_ends", "rectangles", "solids"]

VIEWS = ((-58.0, 26.0), (-78.0, 62.0))
"""From where the two views look: azimuth and elevation in degrees."""

SOLID, FLOOR, BACK, GRID = "#97a3b4", "#f1f3f6", "#fafbfc", "#e1e4e9"
GLASS = 0.15
"""How much a wall hides of what is behind it."""

LIGHT = ((0.90, 0.98), (0.82, 0.94), (0.80, 1.08))
"""Brightness of faces along each axis, turned to its low and to its high end."""

DPI = 200
WIDTH, MARGIN, HEAD, FOOT = 6.0, 0.52, 0.42, 0.34
"""Of one view in inches, about the room; above it for the title, below it for the legend."""

LINK_WIDTH, JOINT_WIDTH = 2.6, 3.6
"""Least widths, in points."""


# What walls consist of


@dataclass(frozen=True, eq=False, kw_only=True)
class Face:
    """Hold one flat side of a wall.

    Parameters
    ----------
    axis : int
        The axis it is perpendicular to.
    sign : int
        1 if it is turned to the high end of that axis, else -1.
    at : float
        Its place on that axis.
    polygon : shapely Polygon
        Its outline along the next two axes (x after z), with a hole where there is a window.
    """

    axis: int
    sign: int
    at: float
    polygon: shapely.Polygon


@dataclass(frozen=True, eq=False, kw_only=True)
class Solid:
    """Hold the surface of one panel or box.

    Parameters
    ----------
    faces : sequence of Face
        All of it, without overlaps.
    edges : array, shape (n, 2, 3)
        Where faces meet.
    of_window : bool array, shape (n,)
        Which edges belong to the window.
    """

    faces: tuple[Face, ...]
    edges: FloatArray
    of_window: Any


def solids(workspace: Workspace) -> list[Solid]:
    """Return panels, with their windows open, and then boxes."""
    assert workspace.boxes is not None
    found = []
    for panel in workspace.panels:
        axis = AXES.index(panel.normal)
        window = _flat(panel.window_low, panel.window_high, axis)
        whole = _flat(panel.low, panel.high, axis).difference(window)
        found.append(_prism(panel.low, panel.high, axis, whole, window))
    for low, high in workspace.boxes:
        found.append(_prism(low, high, 2, _flat(low, high, 2), shapely.Polygon()))
    return found


def rectangles(face: Face) -> FloatArray:
    """Cut a face into rectangles, shape (n, 2, 3): two opposite corners of each."""
    corners = shapely.get_coordinates(face.polygon)
    b, c = (np.unique(corners[:, k]) for k in (0, 1))
    found = []
    for (b0, b1), (c0, c1) in itertools.product(itertools.pairwise(b), itertools.pairwise(c)):
        if face.polygon.contains(shapely.Point(0.5 * (b0 + b1), 0.5 * (c0 + c1))):
            found.append([_lifted((b0, c0), face.axis, face.at), _lifted((b1, c1), face.axis, face.at)])
    return np.array(found).reshape(-1, 2, 3)


def feeder_ends(workspace: Workspace, base_pose: ArrayLike) -> FloatArray:
    """Return where the part of the feeder that is shown begins, and its end, the base; shape (2, 3)."""
    base = np.asarray(base_pose, dtype=np.float64)
    return np.stack([base[:3] - FEEDER_SHARE * workspace.size * base[3:], base[:3]])


def _flat(low: FloatArray, high: FloatArray, axis: int) -> shapely.Polygon:
    b, c = (axis + 1) % 3, (axis + 2) % 3
    return shapely.box(low[b], low[c], high[b], high[c])


def _lifted(point: Sequence[float], axis: int, at: float) -> list[float]:
    place = [at, at, at]
    place[(axis + 1) % 3], place[(axis + 2) % 3] = float(point[0]), float(point[1])
    return place


def _prism(
    low: FloatArray, high: FloatArray, axis: int, outline: shapely.Geometry, window: shapely.Polygon
) -> Solid:
    """Return what stands on an outline, from the low to the high end of an axis."""
    ends, faces, edges, of_window = (float(low[axis]), float(high[axis])), [], [], []
    for part in shapely.get_parts(outline):
        part = shapely.orient_polygons(part)  # walls are on the left of all of its rings
        faces += [Face(axis=axis, sign=s, at=at, polygon=part) for s, at in zip((-1, 1), ends, strict=True)]
        for ring in (part.exterior, *part.interiors):
            for p, q in itertools.pairwise(shapely.get_coordinates(ring)):
                faces.append(_side(p, q, axis, ends))
                edges += [[_lifted(p, axis, at), _lifted(q, axis, at)] for at in ends]
                edges.append([_lifted(p, axis, at) for at in ends])
                rim = [bool(window.intersects(shapely.Point(*place))) for place in (0.5 * (p + q), p)]
                of_window += [rim[0], rim[0], rim[1]]
    return Solid(
        faces=tuple(faces),
        edges=np.array(edges).reshape(-1, 2, 3),
        of_window=np.array(of_window, dtype=bool),
    )


def _side(p: FloatArray, q: FloatArray, axis: int, ends: tuple[float, float]) -> Face:
    """Return the face on one edge of an outline, which has the wall on its left."""
    along_b = p[1] == q[1]
    way = q - p
    across = (axis + 2) % 3 if along_b else (axis + 1) % 3
    sign = int(-np.sign(way[0]) if along_b else np.sign(way[1]))
    corners = np.array([_lifted(p, axis, ends[0]), _lifted(q, axis, ends[1])])
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Face(axis=across, sign=sign, at=float(low[across]), polygon=_flat(low, high, across))


# What is in front of what


@dataclass(frozen=True, eq=False, kw_only=True)
class _Stroke:
    """Hold a straight line in space and how it is drawn; `lift` brings it nearer than what it lies on."""

    start: FloatArray
    end: FloatArray
    colour: Any
    width: float
    lift: float = 0.0


def _from_behind(faces: list[Face], strokes: list[_Stroke], out: FloatArray) -> Iterator[Face | _Stroke]:
    """Yield faces and strokes, cut where they pass a face, in the order in which they cover each other."""
    if not faces:
        yield from sorted(strokes, key=lambda one: float(0.5 * (one.start + one.end) @ out) + one.lift)
        return
    tried = faces[:: max(1, len(faces) // 12)]
    plane = min(tried, key=lambda face: sum(_straddles(one, face.axis, face.at) for one in faces))
    axis, at = plane.axis, plane.at
    near = int(out[axis] > 0.0)
    kept = [face for face in faces if face.axis == axis and face.at == at]
    sides: tuple[list[Face], list[Face]] = ([], [])
    lines: tuple[list[_Stroke], list[_Stroke]] = ([], [])
    for face in faces:
        for side, part in _cut_face(face, axis, at):
            sides[side].append(part)
    for stroke in strokes:
        for side, line in _cut_stroke(stroke, axis, at, near):
            lines[side].append(line)
    yield from _from_behind(sides[1 - near], lines[1 - near], out)
    yield from kept
    yield from _from_behind(sides[near], lines[near], out)


def _extent(face: Face, axis: int) -> tuple[float, float]:
    x_min, y_min, x_max, y_max = face.polygon.bounds
    return (x_min, x_max) if axis == (face.axis + 1) % 3 else (y_min, y_max)


def _straddles(face: Face, axis: int, at: float) -> bool:
    low, high = (face.at, face.at) if face.axis == axis else _extent(face, axis)
    return low < at < high


def _cut_face(face: Face, axis: int, at: float) -> Iterator[tuple[int, Face]]:
    """Yield what of a face is below (0) and above (1) a plane; nothing if it lies in it."""
    if face.axis == axis:
        if face.at != at:
            yield int(face.at > at), face
        return
    low, high = _extent(face, axis)
    if not low < at < high:
        yield int(low >= at), face
        return
    bounds = list(face.polygon.bounds)
    k = 0 if axis == (face.axis + 1) % 3 else 1
    for side, end in ((0, k + 2), (1, k)):
        rectangle = [*bounds]
        rectangle[end] = at
        for part in shapely.get_parts(shapely.intersection(face.polygon, shapely.box(*rectangle))):
            if part.area > 0.0:
                yield side, Face(axis=face.axis, sign=face.sign, at=face.at, polygon=part)


def _cut_stroke(stroke: _Stroke, axis: int, at: float, near: int) -> Iterator[tuple[int, _Stroke]]:
    """Yield what of a stroke is below (0) and above (1) a plane; what lies in it is seen from both."""
    a, b = float(stroke.start[axis]) - at, float(stroke.end[axis]) - at
    if a == b == 0.0:
        yield near, stroke
    elif a * b >= 0.0:
        yield int(a + b > 0.0), stroke
    else:
        place = stroke.start + a / (a - b) * (stroke.end - stroke.start)
        style: dict[str, Any] = {"colour": stroke.colour, "width": stroke.width, "lift": stroke.lift}
        yield int(a > 0.0), _Stroke(start=stroke.start, end=place, **style)
        yield int(b > 0.0), _Stroke(start=place, end=stroke.end, **style)


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
        return np.asarray(points, dtype=np.float64) @ np.stack([self.right, self.up], axis=1)

    def draw(self, axes: Axes, strokes: list[_Stroke]) -> None:
        """Draw the room with what is in it."""
        self._draw_backdrop(axes)
        walls = solids(self.workspace)
        faces = [face for wall in walls for face in wall.faces if face.sign * self.out[face.axis] > 1e-9]
        items = _from_behind(faces, [*strokes, *_edges(walls)], self.out)
        runs = itertools.groupby(items, key=lambda item: isinstance(item, Face))
        for number, (are_faces, run) in enumerate(runs):
            add = self._add_faces if are_faces else self._add_strokes
            add(axes, list(run), 2.0 + 0.001 * number)  # type: ignore[arg-type]

    def _add_faces(self, axes: Axes, faces: list[Face], zorder: float) -> None:
        outlines = []
        for face in faces:
            rings = [shapely.get_coordinates(r) for r in (face.polygon.exterior, *face.polygon.interiors)]
            flat = [self.flat([_lifted(p, face.axis, face.at) for p in ring]) for ring in rings]
            codes = [
                c for r in flat for c in (Outline.MOVETO, *[Outline.LINETO] * (len(r) - 2), Outline.CLOSEPOLY)
            ]
            outlines.append(Outline(np.concatenate(flat), codes))
        shades = [LIGHT[face.axis][int(face.sign > 0)] for face in faces]
        solid = np.array(bytearray.fromhex(SOLID[1:])) / 255.0
        colours = [(*np.minimum(shade * solid, 1.0), GLASS) for shade in shades]
        axes.add_collection(
            PathCollection(outlines, facecolors=colours, edgecolors="none", zorder=zorder), autolim=False
        )

    def _add_strokes(self, axes: Axes, strokes: list[_Stroke], zorder: float) -> None:
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
                *self.flat([_lifted(p, axis, at) for p in corners]).T,
                facecolor=FLOOR if axis == 2 else BACK,
                edgecolor=COLOURS["wall"],
                linewidth=0.8,
                zorder=1.0,
            )
            lines = [[(x, low[c]), (x, high[c])] for x in ticks[b]]
            lines += [[(low[b], y), (high[b], y)] for y in ticks[c]]
            flat = [self.flat([_lifted(p, axis, at) for p in line]) for line in lines]
            axes.add_collection(
                LineCollection(flat, colors=GRID, linewidths=0.6, zorder=1.1), autolim=False
            )
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
            style: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 9, "color": "#5b6470"}
            for tick, place in list(zip(ticks[axis], flat[:-1], strict=True))[int(axis == 2) :]:
                axes.text(*(place + 0.026 * size * way), f"{tick:g}", fontsize=7, **style)
            name = f"{AXES[axis]} ({self.workspace.units})"
            away = 0.065 + 0.035 * abs(way[0]) * (axis != 2)  # letters are wider than high
            turn = 90.0 if axis == 2 else 0.0
            axes.text(*(flat[-1] + away * size * way), name, fontsize=8, rotation=turn, **style)


def _ticks(low: FloatArray, high: FloatArray) -> list[FloatArray]:
    """Return round numbers along each axis of a room."""
    most = float((high - low).max())
    power = 10.0 ** math.floor(math.log10(most / 4.0))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if most / (k * power) <= 6.5)
    return [
        step * np.arange(math.ceil(a / step - 1e-9), math.floor(b / step + 1e-9) + 1)
        for a, b in zip(low, high, strict=True)
    ]


def _edges(walls: list[Solid]) -> Iterator[_Stroke]:
    for wall in walls:
        for (start, end), of_window in zip(wall.edges, wall.of_window, strict=True):
            colour = (*(channel / 255.0 for channel in rgb("edge")), 0.9 if of_window else 0.35)
            yield _Stroke(start=start, end=end, colour=colour, width=0.9 if of_window else 0.5)


# The arm


def _arm_strokes(
    joints: FloatArray,
    colours: list[tuple[int, int, int]],
    *,
    feeder: FloatArray,
    width: float,
    share: float,
    joint_width: float,
    size: float,
) -> Iterator[_Stroke]:
    """Yield the links in short pieces, and the joints; `share` below 1 fades them."""
    heading = feeder[1] - feeder[0]
    heading = heading / np.linalg.norm(heading)
    behind = (joints - feeder[0]) @ heading < 0.0
    joint = tuple(c / 255.0 for c in mixed((255, 255, 255), rgb("joint"), share))
    dot = np.array([1e-5 * size, 0.0, 0.0])
    for k, colour in enumerate(colours):
        start, end = joints[k], joints[k + 1]
        if behind[k + 1] and behind[k] and (joints[k + 1] - feeder[1]) @ heading < 0.0:
            continue
        if behind[k] and (joints[k + 1] - feeder[0]) @ heading > 0.0:
            start = feeder[0]  # the rest of the link is not shown, nor is the rest of the feeder
        tint = tuple(c / 255.0 for c in mixed((255, 255, 255), colour, share))
        hit = colour == rgb("collision")
        pieces = np.linspace(start, end, max(2, math.ceil(np.linalg.norm(end - start) / (0.012 * size))) + 1)
        for a, b in itertools.pairwise(pieces):
            yield _Stroke(start=a, end=b, colour=tint, width=width * (1.25 if hit else 1.0), lift=0.004 * size)
        for place in (start, end):
            if share == 1.0 and not (place is feeder[0]):
                yield _Stroke(start=place, end=place + dot, colour=joint, width=joint_width, lift=0.02 * size)


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
    measured = None if distances is None else np.asarray(distances, dtype=np.float64)
    if measured is not None and measured.shape != (motion.n_poses, motion.n_links):
        raise InputError(
            f"Expected distances with shape {(motion.n_poses, motion.n_links)}, got {measured.shape}."
        )
    shown = _shown_poses(motion, measured, poses)
    feeder = feeder_ends(workspace, motion.base_pose)
    seen = [_View(workspace, *view, feeder) for view in views]
    spans = [view.high - view.low for view in seen]
    scale = (WIDTH - 2.0 * MARGIN) / max(float(span[0]) for span in spans)  # inches per unit
    height = max(float(span[1]) for span in spans) * scale + 2.0 * MARGIN
    figure = Figure(figsize=(WIDTH * len(seen), height + HEAD + FOOT), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    width = max(LINK_WIDTH, 144.0 * link_radius * scale)
    # Joints that stand close together would hide the links.
    close = 72.0 * motion.link_length * scale < 2.5 * JOINT_WIDTH
    joint_width = 0.5 * width if close else max(JOINT_WIDTH, 1.3 * width)
    for number, view in enumerate(seen):
        axes = figure.add_axes(
            (number / len(seen), FOOT / (height + HEAD + FOOT), 1 / len(seen), height / (height + HEAD + FOOT))
        )
        axes.set_axis_off()
        middle, half = 0.5 * (view.low + view.high), 0.5 * np.array([WIDTH, height]) / scale
        axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
        strokes = list(_inside(workspace, motion, path, shown, measured, feeder, (width, joint_width)))
        view.draw(axes, strokes)
        _mark_ends(axes, view, workspace)
    figure.text(
        0.5,
        1.0 - 0.5 * HEAD / (height + HEAD + FOOT),
        title if title is not None else _title(workspace, motion, measured, shown[-1]),
        ha="center",
        va="center",
        fontsize=11,
    )
    _add_legend(figure, path, None if measured is None else measured[shown])
    with replacing(picture) as part:
        figure.savefig(part, facecolor="white")


def _shown_poses(motion: SpatialMotion, distances: FloatArray | None, poses: Sequence[int] | None) -> list[int]:
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
) -> Iterator[_Stroke]:
    """Yield what is in the room: feeder, path, the arm in its poses; widths are those of links and joints."""
    size, (width, joint_width) = workspace.size, widths
    grey = tuple(channel / 255.0 for channel in rgb("base"))
    yield _Stroke(start=feeder[0], end=feeder[1], colour=grey, width=2.4 * width, lift=0.05 * size)
    if path is not None:
        points = np.asarray(path, dtype=np.float64)
        step = max(1, len(points) // 400)
        points = np.concatenate([points[:-1:step], points[-1:]])
        for k, (a, b) in enumerate(itertools.pairwise(points)):
            if k % 3 != 2:  # dashes
                yield _Stroke(start=a, end=b, colour=(0.11, 0.13, 0.16, 0.9), width=1.0, lift=-0.002 * size)
    for number, pose in enumerate(poses):
        clear = None if distances is None else distances[pose]
        colours = link_colours(motion.n_links, clearances=clear, link_length=motion.link_length)
        if clear is not None:
            colours = [rgb("collision") if d < 0.0 else c for c, d in zip(colours, clear, strict=True)]
        share = 1.0 if number == len(poses) - 1 else 0.25 + 0.35 * number / max(len(poses) - 1, 1)
        yield from _arm_strokes(
            motion.joints[pose],
            colours,
            feeder=feeder,
            width=width,
            share=share,
            joint_width=joint_width,
            size=size,
        )


def _mark_ends(axes: Axes, view: _View, workspace: Workspace) -> None:
    goal, base = view.flat(workspace.goal), view.flat(view.feeder[0])
    axes.plot(*goal, "o", color=COLOURS["goal"], markersize=6.5, markeredgecolor="white", zorder=8)
    style: dict[str, Any] = {"textcoords": "offset points", "fontsize": 8, "zorder": 9, "weight": "bold"}
    axes.annotate("goal", goal, (0, -11), ha="center", color=COLOURS["goal"], **style)
    axes.annotate("feeder", base, (4, 9), ha="center", color=COLOURS["base"], **style)


def _title(workspace: Workspace, motion: SpatialMotion, distances: FloatArray | None, pose: int) -> str:
    text = f"{motion.n_links} links of {motion.link_length:g} {workspace.units}, pose {pose} of {motion.n_poses - 1}"
    if distances is None:
        return text
    least = float(distances[pose].min())
    return text + (f": {-least:.3g} deep in a wall" if least < 0.0 else f": {least:.3g} clear of the walls")


def _add_legend(figure: Figure, path: FloatArray | None, distances: FloatArray | None) -> None:
    lines = [Line2D([], [], color=COLOURS["arm"], linewidth=3.0, label="link")]
    if distances is not None:
        lines.append(Line2D([], [], color=COLOURS["near"], linewidth=3.0, label="link near a wall"))
        if distances.min() < 0.0:
            lines.append(Line2D([], [], color=COLOURS["collision"], linewidth=3.4, label="link in a wall"))
    if path is not None:
        dashes: Any = (0, (3, 1.5))
        lines.append(Line2D([], [], color="#1c2128", linewidth=1.0, linestyle=dashes, label="path of a point"))
    figure.legend(handles=lines, loc="lower center", ncols=len(lines), frameon=False, fontsize=8)
