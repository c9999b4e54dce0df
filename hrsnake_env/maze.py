"""The maze: free space, base pose and goal; read from and written to GeoJSON."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, mapping, shape
from shapely.geometry.polygon import orient
from shapely.validation import explain_validity

from hrsnake_env.arguments import is_number
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError, brief, printable
from hrsnake_env.files import replacing

__all__ = ["MAZES", "RUNG_MAZES", "SEEDED_MAZES", "Maze"]

MITRE_LIMIT = 10.0
"""Corridor corners sharper than about 11 degrees are cut off; all others are square."""

MOST = sys.float_info.max
"""That a number holds; integers of a file may be larger."""

FARTHEST = 1e100
"""Of coordinates: products of those beyond are infinite."""

MAX_BYTES = 256 * 2**20
"""Of a maze file."""

LONGEST_NAME = 200
"""Characters of a maze's name and units; a file may have a book there."""

SMALLEST, LARGEST = 1e-60, 1e60
"""How small and how large a maze may be, in its units: beyond, products of lengths are no numbers."""

MAZES: dict[str, Callable[[], Maze]] = {}
"""The builders of the named mazes, in the order in which they are listed; `hrsnake_env.mazes` fills it."""

RUNG_MAZES: dict[str, Callable[[], Maze]] = {}
"""The builders of the ladder's own mazes, made for one link length each; `hrsnake_env.ladder` fills it."""

SEEDED_MAZES: dict[str, Callable[[int], Maze]] = {}
"""The builders of random mazes, by the name before the seed: `clutter-7` is the hall drawn from seed 7."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Maze:
    """Hold a planar maze: where links may be, where the arm comes in, and where its tip shall go.

    Behind the base stands a straight feeder along the base heading; parts of links behind the base are not
    in the maze. The y axis points up.

    Parameters
    ----------
    name : str
        Shown in tables and pictures.
    free_space : shapely Polygon or MultiPolygon
        The space not in walls; holes are obstacles. Of several parts, the one with the base is kept.
    base_pose : array-like, shape (3,)
        (x, y, heading) of the base, in maze units and rad.
    goal : array-like, shape (2,)
        In maze units.
    goal_radius : float
        The goal is reached when the tip is at most this far from it; positive.
    units : str
        Name of the maze's length unit.

    Raises
    ------
    InputError
        If the free space is empty or invalid, the base or the goal is not in it, no free way joins them, or
        the goal reaches the base.
    """

    name: str
    free_space: Polygon
    base_pose: FloatArray
    goal: FloatArray
    goal_radius: float
    units: str = "px"

    def __post_init__(self) -> None:
        base_pose = _frozen_array(self.base_pose, (3,), "base_pose (x, y, heading)")
        goal = _frozen_array(self.goal, (2,), "goal (x, y)")
        if not is_number(self.goal_radius) or not 0.0 < self.goal_radius < math.inf:
            raise InputError(f"Expected a positive, finite goal radius, got {self.goal_radius!r}.")
        parts = _checked_parts(self.free_space)
        base, tip = Point(base_pose[:2]), Point(goal)
        for role, point in (("base", base), ("goal", tip)):
            if not any(part.contains(point) for part in parts):
                raise InputError(
                    f"Expected the {role} inside the free space, got ({point.x:.12g}, {point.y:.12g}), "
                    f"which is on or behind a wall."
                )
        part = next(part for part in parts if part.contains(base))
        if not part.contains(tip):
            raise InputError(
                f"Expected a free way from the base to the goal, but ({tip.x:.12g}, {tip.y:.12g}) lies in "
                f"another part of the free space than ({base.x:.12g}, {base.y:.12g})."
            )
        if base.distance(tip) <= self.goal_radius:
            raise InputError(
                f"Expected a goal away from the base, got one whose radius of {self.goal_radius:g} reaches "
                f"the tip in the feeder: there is nothing to plan."
            )
        object.__setattr__(self, "free_space", _without_collinear_vertices(orient(part)))
        object.__setattr__(self, "base_pose", base_pose)
        object.__setattr__(self, "goal", goal)
        object.__setattr__(self, "goal_radius", float(self.goal_radius))

    def __repr__(self) -> str:
        return f"Maze({self.name!r}, {len(self.walls)} walls)"

    @property
    def rings(self) -> Iterator[FloatArray]:
        """Yield the walls as closed rings, shape (n_vertices + 1, 2), with the free space on the left."""
        yield np.asarray(self.free_space.exterior.coords, dtype=np.float64)[:, :2]
        for hole in self.free_space.interiors:
            yield np.asarray(hole.coords, dtype=np.float64)[:, :2]

    @property
    def walls(self) -> FloatArray:
        """Start and end of each wall segment, shape (n_walls, 2, 2), with the free space on the left."""
        return np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in self.rings])

    @property
    def size(self) -> float:
        """Diagonal of the free space's bounding box, in maze units."""
        x_min, y_min, x_max, y_max = self.free_space.bounds
        return math.hypot(x_max - x_min, y_max - y_min)

    def check_arm(self, arm: ArmSpec) -> None:
        """Check that the arm can leave the feeder: one link length in front of the base is straight and free.

        Raises
        ------
        InputError
            If the link is longer than the maze, or the first link length is not free.
        """
        if arm.link_length > self.size:
            raise InputError(
                f"Expected a link_length of at most the size of maze '{self.name}' ({self.size:g} "
                f"{self.units}), got {arm.link_length:g}."
            )
        x, y, heading = self.base_pose
        ray = LineString(
            [
                (x, y),
                (x + arm.link_length * math.cos(heading), y + arm.link_length * math.sin(heading)),
            ]
        )
        walls = self.free_space.boundary
        inside = self.free_space.covers(ray)
        if inside and (arm.link_radius == 0.0 or _front_clearance(ray, walls) >= arm.link_radius):
            return
        free = 0.0 if arm.link_radius > 0.0 and inside else _free_length(ray, walls)
        raise InputError(
            f"Expected one link length ({arm.link_length:g} {self.units}) of straight free way in front of "
            f"the base of maze '{self.name}' for a link of radius {arm.link_radius:g}, got {free:g}."
        )

    # Reading and writing

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Maze:
        """Load a named maze, or a maze file (GeoJSON).

        Parameters
        ----------
        source : str or path
            One of `MAZES` or `RUNG_MAZES`, one of `SEEDED_MAZES` with a seed (`clutter-7`), or the path of a
            `.geojson` or `.json` file.

        Raises
        ------
        InputError
            If there is no such maze, or the file does not hold one.

        Examples
        --------
        >>> Maze.load("fig19").goal
        array([240., 700.])
        """
        text = os.fspath(source)
        for named in (MAZES, RUNG_MAZES):
            if text in named:
                return named[text]()
        kind, _, seed = text.rpartition("-")
        if kind in SEEDED_MAZES and seed.isascii() and seed.isdigit():
            return SEEDED_MAZES[kind](int(seed))
        if Path(text).suffix.lower() not in (".geojson", ".json"):
            if os.path.isfile(text):  # false where the name is too long, which `Path` raises for
                raise InputError(
                    f"Expected a maze (.geojson), but '{text}' is another file: if it is a map, "
                    f"`hrsnake import {text} --out maze.geojson` makes a maze of it."
                )
            names = [*MAZES, *(f"{kind}-SEED" for kind in SEEDED_MAZES), *RUNG_MAZES]
            raise InputError(
                f"Unknown maze {text!r}. Available: {', '.join(names)}; or give the path of a .geojson file."
            )
        return cls.from_geojson(_read_json(Path(text)), default_name=Path(text).stem)

    @classmethod
    def from_geojson(cls, data: Any, *, default_name: str = "maze") -> Maze:
        """Build a maze from a GeoJSON FeatureCollection.

        Features by `properties.role`: `free` (Polygon with holes: the free space), `base` (Point, with
        `heading_deg`) and `goal` (Point, with `radius`); `name` and `units` stand at the top.

        Raises
        ------
        InputError
            If a feature is missing, or does not hold what its role needs.
        """
        if not isinstance(data, dict) or data.get("type") != "FeatureCollection":
            kind = data.get("type") if isinstance(data, dict) else type(data).__name__
            raise InputError(f"Expected a GeoJSON FeatureCollection, got {brief(kind)}.")
        features = _features_by_role(data.get("features"))
        free = [_geometry(feature, "free", ("Polygon", "MultiPolygon")) for feature in features["free"]]
        base, goal = features["base"][0], features["goal"][0]
        base_point = _geometry(base, "base", ("Point",))
        goal_point = _geometry(goal, "goal", ("Point",))
        heading = math.radians(_number(base, "base", "heading_deg"))
        return cls(
            name=_text(data.get("name", default_name)),
            free_space=free[0] if len(free) == 1 else _union(free),
            base_pose=np.array([base_point.x, base_point.y, heading]),
            goal=np.array([goal_point.x, goal_point.y]),
            goal_radius=_number(goal, "goal", "radius"),
            units=_text(data.get("units", "px")),
        )

    def to_geojson(self) -> dict[str, Any]:
        """Return the maze as a GeoJSON FeatureCollection (the inverse of `from_geojson`)."""
        x, y, heading = (float(value) for value in self.base_pose)

        def feature(geometry: Any, **properties: Any) -> dict[str, Any]:
            return {"type": "Feature", "properties": properties, "geometry": mapping(geometry)}

        return {
            "type": "FeatureCollection",
            "name": self.name,
            "units": self.units,
            "features": [
                feature(self.free_space, role="free"),
                feature(Point(x, y), role="base", heading_deg=math.degrees(heading)),
                feature(Point(self.goal), role="goal", radius=self.goal_radius),
            ],
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the maze as GeoJSON, completely or not at all."""
        with replacing(path) as part:
            part.write_text(json.dumps(self.to_geojson(), indent=1) + "\n", encoding="utf-8")

    @classmethod
    def from_corridors(
        cls,
        centrelines: ArrayLike | Sequence[ArrayLike],
        width: float | Sequence[float],
        *,
        name: str = "corridors",
        goal: ArrayLike | None = None,
        goal_radius: float | None = None,
        base_offset: float = 5.0,
        units: str = "px",
    ) -> Maze:
        """Build a maze from corridors: centrelines with a width, square mitred corners and flat ends.

        Parameters
        ----------
        centrelines : array-like, shape (n, 2), or a sequence of them
            Waypoints of each centreline; the base stands `base_offset` from the start of the first, along
            its first leg.
        width : float, or a sequence with one per centreline
            In maze units.
        goal : array-like, shape (2,), optional
            By default half a width before the end of the last centreline.
        goal_radius : float, optional
            By default an eighth of the last width.

        Examples
        --------
        >>> bend = Maze.from_corridors([(0, 0), (0, 900), (900, 900)], 200.0)
        >>> bend.free_space.area
        360000.0
        """
        lines = _as_centrelines(centrelines)
        widths = _as_widths(width, len(lines))
        if not is_number(base_offset) or not math.isfinite(base_offset):
            raise InputError(f"Expected a finite base_offset, got {base_offset!r}.")
        start, along = lines[0][0], _unit(lines[0][1] - lines[0][0])
        end, back = lines[-1][-1], _unit(lines[-1][-2] - lines[-1][-1])
        base = start + base_offset * along
        return cls(
            name=name,
            free_space=_union(
                [
                    LineString(line).buffer(
                        value / 2, cap_style="flat", join_style="mitre", mitre_limit=MITRE_LIMIT
                    )
                    for line, value in zip(lines, widths, strict=True)
                ]
            ),
            base_pose=np.array([*base, math.atan2(along[1], along[0])]),
            goal=end + 0.5 * widths[-1] * back if goal is None else _frozen_array(goal, (2,), "goal (x, y)"),
            goal_radius=widths[-1] / 8 if goal_radius is None else goal_radius,
            units=units,
        )


def _real_numbers(values: Any) -> FloatArray:
    """Return an array of real numbers; raise ValueError for truth values, texts and ragged rows."""
    array = np.asarray(values)
    if not isinstance(values, np.ndarray) and array.dtype.kind in "biuf":  # numpy takes True for 1 in a list
        array = np.asarray(values, dtype=object)
    if array.dtype.kind not in "iuf" and not all(map(is_number, array.flat)):
        raise ValueError("no real numbers")
    return array.astype(np.float64)


def _frozen_array(values: ArrayLike, shape_: tuple[int, ...], what: str) -> FloatArray:
    try:
        array = _real_numbers(values)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.shape != shape_ or not np.isfinite(array).all():
        raise InputError(f"Expected {what} as {shape_[0]} finite numbers, got {values!r}.")
    array.setflags(write=False)
    return array


def _checked_parts(free_space: Any) -> list[Polygon]:
    if not isinstance(free_space, Polygon | MultiPolygon):
        raise InputError(
            f"Expected the free space as a Polygon, got {getattr(free_space, 'geom_type', free_space)!r}."
        )
    if free_space.is_empty:
        raise InputError("Expected a free space with an area, got an empty polygon.")
    if not np.abs(free_space.bounds).max() <= FARTHEST:
        raise InputError(f"Expected a free space with coordinates of at most {FARTHEST:g}, got larger ones.")
    bounds = np.asarray(free_space.bounds)
    if np.isfinite(bounds).all():
        _check_extent(float(np.abs(bounds).max()))
        _check_extent(float(np.abs(bounds[2:] - bounds[:2]).max()))
    if not free_space.is_valid:
        raise InputError(
            f"Expected a valid polygon as free space, got one with: {explain_validity(free_space)}."
        )
    return list(free_space.geoms) if isinstance(free_space, MultiPolygon) else [free_space]


def _without_collinear_vertices(polygon: Polygon) -> Polygon:
    """Return the same polygon with fewer vertices, so that a maze from its own polygon is the same maze.

    No vertex comes twice in a row, whatever rounding makes of the rest: no wall is a point.
    """
    polygon = shapely.remove_repeated_points(polygon)
    while True:
        simple = polygon.simplify(0.0)
        fewer = shapely.get_num_coordinates(simple) < shapely.get_num_coordinates(polygon)
        if not (fewer and simple.is_valid and simple.symmetric_difference(polygon).area == 0.0):
            return polygon
        polygon = simple


def _front_clearance(ray: LineString, walls: Any) -> float:
    """Return the distance from a ray to the walls in front of its start.

    The wall that the feeder comes through is as near as one likes, so walls behind the start do not count.
    """
    start, end = np.asarray(ray.coords)
    along, reach = _unit(end - start), float(np.linalg.norm(end - start))
    across = np.array([-along[1], along[0]])
    front = Polygon(
        [
            start + reach * across,
            end + reach * (across + along),
            end - reach * (across - along),
            start - reach * across,
        ]
    )
    return float(ray.distance(walls.intersection(front)))


def _free_length(ray: LineString, walls: Any) -> float:
    return float(Point(ray.coords[0]).distance(ray.intersection(walls)))


def _read_json(path: Path) -> Any:
    try:
        if path.exists() and not path.is_file():  # a pipe would be waited for
            raise InputError(f"Expected a maze file at '{path}', got a folder or a device.")
        if path.stat().st_size > MAX_BYTES:
            raise InputError(f"Expected a maze file of at most {MAX_BYTES >> 20} MiB at '{path}', got more.")
        return json.loads(path.read_bytes())
    except FileNotFoundError:
        raise InputError(f"Expected a maze file at '{path}', but there is none.") from None
    except OSError as error:
        raise InputError(f"Expected a readable maze file at '{path}', got: {error.strerror}.") from None
    except RecursionError:
        raise InputError(f"Expected a maze in '{path}', got lists nested too deeply.") from None
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"Expected JSON in '{path}', got: {error}.") from None


def _features_by_role(features: Any) -> dict[str, list[dict[str, Any]]]:
    by_role: dict[str, list[dict[str, Any]]] = {"free": [], "base": [], "goal": []}
    for feature in features if isinstance(features, list) else []:
        properties = feature.get("properties") if isinstance(feature, dict) else None
        role = properties.get("role") if isinstance(properties, dict) else None
        if isinstance(role, str) and role in by_role:
            by_role[role].append(feature)
    for role, found in by_role.items():
        if not found or (role != "free" and len(found) > 1):
            wanted = "at least one feature" if role == "free" else "exactly one feature"
            raise InputError(f"Expected {wanted} with properties.role '{role}', got {len(found)}.")
    return by_role


def _geometry(feature: dict[str, Any], role: str, kinds: tuple[str, ...]) -> Any:
    data = feature.get("geometry")
    kind = data.get("type") if isinstance(data, dict) else data
    if kind not in kinds:
        raise InputError(f"Expected the '{role}' feature to be a {' or '.join(kinds)}, got {brief(kind)}.")
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused below
            geometry = shape(data)
    except (
        *(TypeError, ValueError, KeyError, IndexError, AttributeError, OverflowError),
        *(RecursionError, shapely.errors.ShapelyError),
    ):
        raise InputError(
            f"Expected {kind} coordinates in the '{role}' feature, got none that can be read."
        ) from None
    if geometry.is_empty or not np.isfinite(shapely.get_coordinates(geometry)).all():
        raise InputError(
            f"Expected finite {kind} coordinates in the '{role}' feature, got an empty or infinite one."
        )
    return shapely.force_2d(geometry)


def _text(value: Any) -> str:
    return printable(value if isinstance(value, str) else brief(value), LONGEST_NAME)


def _number(feature: dict[str, Any], role: str, key: str) -> float:
    value = feature["properties"].get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= MOST:
        raise InputError(
            f"Expected a number as properties.{key} of the '{role}' feature, got {brief(value)}."
        )
    return float(value)


def _union(polygons: Sequence[Any]) -> Any:
    for polygon in polygons:
        _checked_parts(polygon)
    union = shapely.union_all(polygons)
    # Buffers leave corners beside their place, by rounding; walls that should meet then do not.
    decimals = 12 - math.floor(math.log10(np.abs(union.bounds).max()))
    return shapely.transform(union, lambda xy: np.round(xy, decimals) + 0.0)


def _as_centrelines(centrelines: ArrayLike | Sequence[ArrayLike]) -> list[FloatArray]:
    try:
        lines = _lines_of(centrelines)
    except (TypeError, ValueError, OverflowError):
        raise InputError(
            "Expected centrelines as lists of waypoints (x, y) in numbers, got others."
        ) from None
    if not lines:
        raise InputError("Expected at least one centreline, got none.")
    for line in lines:
        if line.ndim != 2 or line.shape[1] != 2 or len(line) < 2 or not np.isfinite(line).all():
            raise InputError(f"Expected each centreline with shape (n >= 2, 2), got {line.shape}.")
        _check_extent(float(np.abs(line).max()))
        _check_extent(float(np.ptp(line, axis=0).max()))
    return lines


def _lines_of(centrelines: Any) -> list[FloatArray]:
    try:
        single = _real_numbers(centrelines)
    except ValueError:  # corridors with different numbers of waypoints
        return [_real_numbers(line) for line in centrelines]
    return [single] if single.ndim == 2 else list(single)


def _check_extent(extent: float) -> None:
    """Refuse what has no squares in double precision; nothing at all is refused elsewhere."""
    if extent > 0.0 and not SMALLEST <= extent <= LARGEST:
        raise InputError(f"Expected a maze between {SMALLEST:g} and {LARGEST:g} in size, got {extent:g}.")


def _as_widths(width: Any, n: int) -> list[float]:
    try:
        widths = np.broadcast_to(_real_numbers(width), n).tolist()
    except (TypeError, ValueError, OverflowError):
        raise InputError(
            f"Expected a corridor width, or one for each of {n} centrelines, got {width!r}."
        ) from None
    if not all(math.isfinite(value) and value > 0.0 for value in widths):
        raise InputError(f"Expected a positive, finite corridor width, got {width!r}.")
    for value in widths:
        _check_extent(value)
    return [float(value) for value in widths]


def _unit(vector: FloatArray) -> FloatArray:
    length = np.linalg.norm(vector)
    if length == 0.0:
        raise InputError("Expected different waypoints at the ends of a centreline, got the same twice.")
    return np.asarray(vector / length, dtype=np.float64)
