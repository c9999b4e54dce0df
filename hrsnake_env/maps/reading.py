"""What the readers of maps share: how a map is to be read, what was understood, and the way to a maze."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

import numpy as np
from shapely.geometry import MultiPolygon, Point, Polygon

from hrsnake_env.errors import InputError, brief, printable
from hrsnake_env.maze import Maze

__all__ = ["METRES", "MapFiles", "MapOptions", "MapReading", "converts", "files_beside", "scale_and_units"]

METRES = {
    "m": 1.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 0.001,
    "um": 1e-6,
    "km": 1000.0,
    "in": 0.0254,
    "ft": 0.3048,
    "yd": 0.9144,
}
"""Units that maps name, in m."""

MAX_BYTES = 512_000_000
"""Of a file."""

LONGEST_NAME, LONGEST_NOTE = 200, 1000
"""Characters of what is shown of a map."""

GOAL_SHARE = 0.25
"""Radius of a goal that none was given for, as a share of its distance to the nearest wall."""

MapFiles = Callable[[str], bytes]
"""Returns the contents of a file by its name: the map itself, and what it refers to. Nothing else is read."""


def files_beside(path: Path) -> MapFiles:
    """Return what reads files by the names that a map gives them: beside the map, or absolute."""

    def read(name: str) -> bytes:
        target = path.parent / name
        try:
            if target.exists() and not target.is_file():
                raise InputError(f"Expected a file at '{target}', got a folder or a device.")
            size = target.stat().st_size
            if size == 0:  # as devices in disguise have, which would be waited for
                raise InputError(f"Expected a map at '{target}', got an empty file.")
            if size > MAX_BYTES:
                raise InputError(f"Expected a file of at most {MAX_BYTES:,} bytes at '{target}', got more.")
            return target.read_bytes()
        except FileNotFoundError:
            raise InputError(f"Expected a file at '{target}', but there is none.") from None
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"Expected the name of a file, got {brief(name)}.") from None
        except OSError as error:
            raise InputError(f"Expected a readable file at '{target}', got: {error.strerror}.") from None

    return read


def converts(own: str | None, wanted: str | None, scale: float) -> bool:
    """Tell whether lengths of a map have to be converted from its own units, as no scale says how.

    Raises
    ------
    InputError
        If nobody knows how long the units are that are wanted.
    """
    if scale != 1.0 or own not in METRES or wanted is None or wanted == own:
        return False
    if wanted not in METRES:
        raise InputError(
            f"Unknown units '{wanted}' for a map in {own}: give a scale, too, or one of: {', '.join(METRES)}."
        )
    return True


def scale_and_units(units: str, options: MapOptions) -> tuple[float, str]:
    """Return the maze units per unit of a map, and their name.

    Parameters
    ----------
    units : str
        Of the map.
    options : MapOptions
        What the user wants.

    Examples
    --------
    >>> scale_and_units("m", MapOptions(units="mm"))
    (1000.0, 'mm')
    >>> scale_and_units("m", MapOptions(scale=100.0))
    (100.0, 'cm')
    """
    scale, wanted = options.scale, options.units
    if wanted is None:
        sizes = {name: METRES.get(units, math.nan) / size for name, size in METRES.items()}
        named = [name for name, size in sizes.items() if math.isclose(size, scale, rel_tol=1e-9)]
        return scale, units if scale == 1.0 else (named[0] if named else f"{1.0 / scale:g} {units}")
    if converts(units, wanted, scale):
        digits = METRES[units] / METRES[wanted]
        return float(f"{digits:.12g}"), wanted
    return scale, wanted


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """Say how a map is to be read.

    Parameters
    ----------
    units : str, optional
        Of the maze. By default the map's own, as far as it names them: m of a ROS map, px of an image.
    scale : float
        Maze units per unit of the map; 1000 turns m into mm. If it is 1, a map that names its units is
        converted to `units`.
    tolerance : float, optional
        How far a wall may be moved into the free space to simplify an outline, in maze units; 0 keeps every
        corner. By default 1.5 pixels, which makes straight walls of the staircases of pixels along slanted
        ones and leaves walls along the pixels where they are; or 1e-4 of an outline's size.
    resolution : float, optional
        Side of a pixel in units of the map, for images that do not say it; 1 by default.
    threshold : float, optional
        Of images: from which brightness, in [0, 1], a pixel is free. 0.75 by default.
    invert : bool
        Of images: dark is free.
    unknown_is_free : bool
        Of ROS maps: what nobody has seen is free; otherwise it is a wall.
    free, walls, base, goal, ignore : tuple of str
        Of outlines: names of layers, or colours (#rrggbb), that hold the free space, walls, the base, the
        goal, or nothing of interest.
    wall_thickness : float
        Of outlines: open lines are walls of this thickness, in maze units; 0 leaves them out.
    """

    units: str | None = None
    scale: float = 1.0
    tolerance: float | None = None
    resolution: float | None = None
    threshold: float | None = None
    invert: bool = False
    unknown_is_free: bool = False
    free: tuple[str, ...] = ()
    walls: tuple[str, ...] = ()
    base: tuple[str, ...] = ()
    goal: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    wall_thickness: float = 0.0

    def __post_init__(self) -> None:
        for name in ("scale", "resolution"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < math.inf:
                raise InputError(f"Expected a positive, finite {name}, got {value!r}.")
        for name in ("tolerance", "wall_thickness"):
            value = getattr(self, name)
            if value is not None and not 0.0 <= value < math.inf:
                raise InputError(f"Expected a finite {name} of at least 0, got {value!r}.")
        if self.threshold is not None and not 0.0 < self.threshold <= 1.0:
            raise InputError(f"Expected a threshold over 0 and at most 1, got {self.threshold!r}.")


@dataclass(frozen=True, eq=False, kw_only=True)
class MapReading:
    """Hold what was understood of a map. The free space is never larger than the map's.

    Parameters
    ----------
    name : str
        Of the map.
    free_space : Polygon or MultiPolygon
        In maze units, y up; all parts, largest first.
    units : str
        Of the maze.
    tolerance : float
        How far outlines were allowed to move into the free space, in maze units.
    moved : float
        How far they moved at most, in maze units.
    notes : tuple of str
        What was understood, in sentences: format, size, thresholds, layers by role, what was left out.
    layers : mapping from str to str
        Of outlines: the role of each layer or colour: free, walls, base, goal or ignored.
    base_pose : tuple of three floats, or None
        (x, y, heading) if the map says it, in maze units and rad.
    goal : tuple of two floats, or None
        If the map says it.
    goal_radius : float or None
        If the map says it.
    """

    name: str
    free_space: Polygon | MultiPolygon
    units: str
    tolerance: float = 0.0
    moved: float = 0.0
    notes: tuple[str, ...] = ()
    layers: Mapping[str, str] = field(default_factory=dict)
    base_pose: tuple[float, float, float] | None = None
    goal: tuple[float, float] | None = None
    goal_radius: float | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.free_space.bounds).all() and self.free_space.is_valid):
            raise InputError(
                f"Expected a free space whose corners numbers can tell apart, in map '{self.name}', got one "
                f"that is too small for where it is, or too large: give another scale."
            )
        texts = {name: printable(getattr(self, name), LONGEST_NAME) for name in ("name", "units")}
        notes = tuple(printable(note, LONGEST_NOTE) for note in self.notes)
        layers = {printable(layer, LONGEST_NAME): role for layer, role in self.layers.items()}
        for name, value in (*texts.items(), ("notes", notes), ("layers", MappingProxyType(layers))):
            object.__setattr__(self, name, value)

    @property
    def parts(self) -> list[Polygon]:
        """The parts of the free space that are not joined, largest first."""
        whole = self.free_space
        parts = list(whole.geoms) if isinstance(whole, MultiPolygon) else [whole]
        return sorted(parts, key=lambda part: -part.area)

    def maze(
        self,
        *,
        base_pose: tuple[float, float, float] | None = None,
        goal: tuple[float, float] | None = None,
        goal_radius: float | None = None,
        name: str | None = None,
    ) -> Maze:
        """Return the maze of the part in which the base stands.

        Parameters
        ----------
        base_pose : (x, y, heading), optional
            In maze units and rad; by default the map's.
        goal : (x, y), optional
            In maze units; by default the map's.
        goal_radius : float, optional
            By default the map's, or a quarter of the goal's distance to the nearest wall.
        name : str, optional
            By default the map's.

        Raises
        ------
        InputError
            If neither the map nor the caller gives base and goal, or they do not fit the free space.
        """
        pose = self.base_pose if base_pose is None else base_pose
        place = self.goal if goal is None else goal
        for role, value in (("base", pose), ("goal", place)):
            if value is None:
                raise InputError(
                    f"Expected a {role}, but map '{self.name}' does not say where it is: give one within "
                    f"{_extent(self.free_space)} {self.units}."
                )
        assert pose is not None and place is not None
        radius = goal_radius if goal_radius is not None else (self.goal_radius if goal is None else None)
        if radius is None:
            radius = GOAL_SHARE * float(self.free_space.boundary.distance(Point(place))) or 1.0
        return Maze(
            name=self.name if name is None else name,
            free_space=self.free_space,
            base_pose=np.array(pose),
            goal=np.array(place),
            goal_radius=radius,
            units=self.units,
        )


def _extent(free_space: Polygon | MultiPolygon) -> str:
    x_min, y_min, x_max, y_max = free_space.bounds
    return f"x from {x_min:g} to {x_max:g} and y from {y_min:g} to {y_max:g}"
