"""A drawing as the page holds it, and the maze that it stands for."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Annotated, Any, Literal

import numpy as np
import shapely
from pydantic import BaseModel, ConfigDict, Field, model_validator
from shapely.geometry import LineString, MultiPolygon, Polygon
from shapely.validation import make_valid

from hrsnake_env.errors import InputError
from hrsnake_env.maze import MITRE_LIMIT, Maze

__all__ = ["MAX_POINTS", "Scene", "Shape", "free_shapes", "maze_from_scene", "scene_from_maze"]

MAX_POINTS = 20_000
"""Of all shapes of a scene together."""

FARTHEST = 1e9
"""Largest coordinate, in maze units."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Coordinate = Annotated[float, Field(allow_inf_nan=False, ge=-FARTHEST, le=FARTHEST)]
Length = Annotated[float, Field(allow_inf_nan=False, gt=0.0, le=FARTHEST)]
Place = tuple[Coordinate, Coordinate]
Name = Annotated[str, Field(max_length=200)]


class Strict(BaseModel):
    """Refuse what is not known, and texts or truth values where numbers belong."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Shape(Strict):
    """Hold one stroke of a drawing: rings (an outline, then its holes), or a line with a width."""

    role: Literal["free", "wall"]
    rings: list[list[Place]] | None = None
    line: list[Place] | None = None
    width: Length | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Shape:
        if (self.rings is None) == (self.line is None) or (self.line is None) != (self.width is None):
            raise ValueError("either rings, or a line with a width")
        return self

    @property
    def n_points(self) -> int:
        """Number of points."""
        return sum(map(len, self.rings or [])) + len(self.line or [])


class Scene(Strict):
    """Hold a drawing: shapes in the order in which they were drawn, base and goal."""

    name: Name = "drawing"
    units: Annotated[str, Field(max_length=40)] = "px"
    shapes: Annotated[list[Shape], Field(max_length=MAX_POINTS)]
    base: tuple[Coordinate, Coordinate, Number] | None
    goal: Place | None
    goal_radius: Length | None = None

    @model_validator(mode="after")
    def _few_points(self) -> Scene:
        n_points = sum(shape.n_points for shape in self.shapes)
        if n_points > MAX_POINTS:
            raise ValueError(f"at most {MAX_POINTS} points in all shapes, this drawing has {n_points}")
        return self


def maze_from_scene(scene: Scene) -> Maze:
    """Return the maze that a drawing stands for.

    All is wall at first; each shape adds its area to the free space or takes it away, in order.

    Raises
    ------
    InputError
        If nothing is free, base or goal are missing, or they do not fit the free space.
    """
    if scene.base is None or scene.goal is None or scene.goal_radius is None:
        missing = "base" if scene.base is None else "goal"
        raise InputError(f"Expected a {missing} in the drawing, got none: place it in the free space.")
    x, y, heading = scene.base
    return Maze(
        name=scene.name or "drawing",
        free_space=_free_space(scene.shapes),
        base_pose=np.array([x, y, math.radians(heading)]),
        goal=np.array(scene.goal),
        goal_radius=scene.goal_radius,
        units=scene.units,
    )


def scene_from_maze(maze: Maze) -> dict[str, Any]:
    """Return a maze as a drawing of one shape, ready for JSON."""
    x, y, heading = (float(value) for value in maze.base_pose)
    return {
        "name": maze.name,
        "units": maze.units,
        "shapes": free_shapes([maze.free_space]),
        "base": [x, y, math.degrees(heading)],
        "goal": maze.goal.tolist(),
        "goal_radius": maze.goal_radius,
    }


def free_shapes(parts: Iterable[Polygon]) -> list[dict[str, Any]]:
    """Return polygons as shapes of free space, ready for JSON; rings are not closed."""
    return [
        {
            "role": "free",
            "rings": [np.asarray(ring.coords)[:-1, :2].tolist() for ring in (part.exterior, *part.interiors)],
        }
        for part in parts
        if not part.is_empty
    ]


def _free_space(shapes: Iterable[Shape]) -> Any:
    shapes = tuple(shapes)
    if len(shapes) == 1 and shapes[0].role == "free" and shapes[0].rings is not None:
        return _area(shapes[0], 1)  # to the last bit what was given
    free: Any = Polygon()
    run: list[Any] = []
    role = "free"
    for number, shape in enumerate(shapes, 1):
        if shape.role != role:  # shapes of one role in a row are joined at once, which is far quicker
            free, run, role = _folded(free, run, role), [], shape.role
        run.append(_area(shape, number))
    free = _polygons(_folded(free, run, role))
    if free.is_empty:
        raise InputError("Expected free space in the drawing, got walls alone: draw a corridor or a room.")
    return free


def _folded(free: Any, areas: list[Any], role: str) -> Any:
    if not areas:
        return free
    area = shapely.union_all(areas)
    return free.union(area) if role == "free" else free.difference(area)


def _area(shape: Shape, number: int) -> Any:
    if shape.line is not None:
        points = np.array(shape.line, dtype=np.float64).reshape(-1, 2)
        kept = np.ones(len(points), dtype=bool)
        kept[1:] = (np.diff(points, axis=0) != 0.0).any(axis=1)
        points = points[kept]
        if len(points) < 2:
            raise InputError(f"Expected a line of two different points or more in shape {number}, got fewer.")
        return LineString(points).buffer(
            (shape.width or 0.0) / 2, cap_style="flat", join_style="mitre", mitre_limit=MITRE_LIMIT
        )
    rings = shape.rings or []
    for ring in rings[:1] or [[]]:
        if len(ring) < 3:
            raise InputError(f"Expected an outline of at least 3 points in shape {number}, got {len(ring)}.")
    polygon = Polygon(rings[0], [ring for ring in rings[1:] if len(ring) >= 3])
    area = polygon if polygon.is_valid else _polygons(make_valid(polygon))
    if area.is_empty:
        raise InputError(f"Expected an outline with an area in shape {number}, got one that is flat.")
    return area


def _polygons(geometry: Any) -> Any:
    """Return the areas of a geometry, without points and lines; rounded, so that edges meet."""
    rounded = shapely.transform(geometry, lambda xy: np.round(xy, 9) + 0.0)
    valid = rounded if rounded.is_valid else make_valid(rounded)
    parts = [part for part in shapely.get_parts(valid) if isinstance(part, Polygon | MultiPolygon)]
    flat = [part for part in shapely.get_parts(parts) if part.area > 0.0] if parts else []
    return flat[0] if len(flat) == 1 else MultiPolygon(flat)
