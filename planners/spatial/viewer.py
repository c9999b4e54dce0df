"""Motions in space as one HTML page that turns and plays, with nothing else beside it."""

from __future__ import annotations

import base64
import importlib.resources
import math
import os
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.appearance import COLOURS, FAR, FEEDER_SHARE
from hrsnake_env.arm import FloatArray
from hrsnake_env.contacts import PINCH_TOLERANCE
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.pages import filled, framed
from planners.spatial.problem import SpatialMotion
from planners.spatial.solids import rectangles, solids
from planners.spatial.workspace import Workspace

__all__ = ["MOST_POSES", "QUANTUM", "Scene", "kept_poses", "page_html", "save_page", "show"]

MOST_POSES = 400
"""So many poses of a motion a page holds at most."""

QUANTUM = 1e-6
"""In sizes of the room: the page holds places and distances as whole multiples of it."""

FARTHEST = 1000.0
"""In sizes of the room: places farther from the base than this cannot be shown; 32 bits hold them."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Hold one motion that a page shows.

    Parameters
    ----------
    name : str
        For the button that chooses it.
    workspace : Workspace
        The room.
    motion : SpatialMotion
        In that room.
    path : array, shape (n, 3), or None
        The path of the point robot.
    distances : array, shape (n_poses, n_links), or None
        Of each link from the walls, in workspace units; negative is the depth in them. Infinite where it was
        not measured, as in the feeder.
    link_radius : float
        In workspace units.

    Raises
    ------
    InputError
        If a shape is not as said, or a number is not finite.
    """

    name: str
    workspace: Workspace
    motion: SpatialMotion
    path: FloatArray | None = None
    distances: FloatArray | None = None
    link_radius: float = 0.0

    def __post_init__(self) -> None:
        reach = FARTHEST * self.workspace.size
        if self.path is not None:
            path = np.array(self.path, dtype=np.float64)
            if path.ndim != 2 or path.shape[1] != 3 or len(path) < 2:
                raise InputError(f"Expected a path with shape (n, 3), got {path.shape}.")
            self._keep("path", path, path - self.motion.base_pose[:3], reach)
        if self.distances is not None:
            distances, wanted = np.array(self.distances, dtype=np.float64), self.motion.joint_angles.shape[:2]
            if distances.shape != wanted:
                raise InputError(f"Expected distances with shape {wanted}, got {distances.shape}.")
            distances = np.minimum(distances, self.workspace.size)  # farther apart is nothing in the room
            self._keep("distances", distances, distances, reach)
        self._check("joints", self.motion.joints - self.motion.base_pose[:3], reach)
        if not 0.0 <= self.link_radius < math.inf:
            raise InputError(f"Expected a finite link_radius of at least 0, got {self.link_radius!r}.")

    def _keep(self, name: str, values: FloatArray, measured: FloatArray, reach: float) -> None:
        self._check(name, measured, reach)
        values.setflags(write=False)
        object.__setattr__(self, name, values)

    def _check(self, name: str, values: FloatArray, reach: float) -> None:
        bad = ~(np.abs(values) <= reach)
        if bad.any():
            raise InputError(
                f"Expected finite {name} within {reach:g} {self.workspace.units} of scene '{self.name}', got "
                f"{values[tuple(np.argwhere(bad)[0])]:g}."
            )


def save_page(
    scenes: Sequence[Scene],
    path: str | os.PathLike[str],
    *,
    title: str | None = None,
    most_poses: int = MOST_POSES,
) -> None:
    """Write scenes as one HTML file, completely or not at all.

    The file needs nothing else, no network and no server, and a browser with WebGL 2. `#scene=2`, `pose=120`,
    `play=0`, `speed=0.5`, `loop=0`, `walls=0` and `path=0`, with `&` between them, say behind its name how it
    opens.

    Parameters
    ----------
    scenes : sequence of Scene
        One or more; the reader chooses.
    path : path
        The file (.html).
    title : str, optional
        Of the page; by default the name of the workspace.
    most_poses : int
        Motions with more poses are thinned evenly. The first, the last and the worst pose stay.

    Raises
    ------
    InputError
        If there is no scene, or `most_poses` is below 3.
    """
    page = page_html(scenes, title=title, most_poses=most_poses)
    with replacing(path) as part:
        part.write_text(page, encoding="utf-8")


def page_html(scenes: Sequence[Scene], *, title: str | None = None, most_poses: int = MOST_POSES) -> str:
    """Return the page that `save_page` writes."""
    scenes = tuple(scenes)
    if not scenes:
        raise InputError("Expected at least one scene for a page, got none.")
    if most_poses < 3:
        raise InputError(f"Expected most_poses of at least 3, got {most_poses}.")
    heading = scenes[0].workspace.name if title is None else title
    payload = {
        "title": heading,
        "colours": COLOURS,
        "feederShare": FEEDER_SHARE,
        "clearanceScale": [FAR, PINCH_TOLERANCE],
        "scenes": [_packed_scene(scene, most_poses) for scene in scenes],
    }
    template = importlib.resources.files("planners.spatial").joinpath("viewer.html")
    return filled(template.read_text(encoding="utf-8"), heading, payload)


def show(scenes: Sequence[Scene], height: int = 720, *, title: str | None = None) -> Any:
    """Show scenes in a notebook.

    Parameters
    ----------
    scenes : sequence of Scene
        As in `save_page`.
    height : int
        In CSS pixels.
    title : str, optional
        As in `save_page`.

    Returns
    -------
    frame : IPython.display.IFrame
        The last line of a cell shows it. It can run its script, and reaches nothing of the notebook.

    Raises
    ------
    InputError
        As `save_page`; or if IPython is not installed.
    """
    return framed(page_html(scenes, title=title), height)


def kept_poses(n_poses: int, worst: int | None, most: int) -> NDArray[np.int64]:
    """Choose at most so many poses, evenly, in order, with the first, the last and the worst among them."""
    if n_poses <= most:
        return np.arange(n_poses)
    extra = [] if worst is None else [worst]
    evenly = np.linspace(0, n_poses - 1, most - len(extra)).round().astype(np.int64)
    return np.unique([*evenly, *extra])


def _packed_scene(scene: Scene, most_poses: int) -> dict[str, Any]:
    room, motion, distances = scene.workspace, scene.motion, scene.distances
    least = None if distances is None else distances.min(axis=1)
    poses = kept_poses(motion.n_poses, None if least is None else int(np.argmin(least)), most_poses)
    quantum, base = QUANTUM * room.size, motion.base_pose[:3]
    walls = solids(room)
    return {
        "name": scene.name,
        "units": room.units,
        "nPoses": motion.n_poses,
        "nLinks": motion.n_links,
        "nBad": None if least is None else int((least < 0.0).sum()),
        "linkLength": motion.link_length,
        "linkRadius": scene.link_radius,
        "basePose": motion.base_pose.tolist(),
        "goal": room.goal.tolist(),
        "goalRadius": room.goal_radius,
        "room": {
            "low": room.room_low.tolist(),
            "high": room.room_high.tolist(),
            "open": list(room.open_sides),
        },
        "nWalls": max(len(walls), 1),
        # Eight numbers a rectangle: axis, the way it is turned, two opposite corners.
        "faces": [
            number
            for wall in walls
            for face in wall.faces
            for rectangle in rectangles(face)
            for number in (face.axis, face.sign, *rectangle.ravel().tolist())
        ],
        "edges": [
            [*edge.tolist(), int(of_window)]
            for wall in walls
            for edge, of_window in zip(wall.edges, wall.of_window, strict=True)
        ],
        "poses": poses.tolist(),
        "quantum": quantum,
        "joints": _packed((motion.joints[poses] - base).reshape(len(poses), -1) / quantum),
        "nPath": 0 if scene.path is None else len(scene.path),
        "path": None if scene.path is None else _packed((scene.path - base) / quantum),
        "distances": None if distances is None else _packed(_signed(distances[poses] / quantum)),
    }


def _signed(distances: FloatArray) -> FloatArray:
    """Round away from 0 below it, so that a link that is in a wall by a hair still is."""
    return np.where(distances < 0.0, np.floor(distances), distances)


def _packed(table: FloatArray) -> str:
    """Pack numbers, rounded: differences along axis 0, column by column, 32 bits, deflated, base64."""
    whole = np.diff(np.rint(table).astype(np.int64), axis=0, prepend=0)
    # A difference may need 33 bits; it wraps, and so does the sum.
    data = whole.T.astype(np.uint64).astype("<u4").tobytes()
    return base64.b64encode(zlib.compress(data, 9)).decode("ascii")
