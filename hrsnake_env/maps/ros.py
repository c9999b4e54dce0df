"""Mazes from maps of ROS: a YAML file with an image, as map_server and nav2 read it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.errors import InputError, brief
from hrsnake_env.maps.image import Pixels, Placement, decoded, reading_of
from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading, scale_and_units

__all__ = ["read_ros"]

MODES = ("trinary", "scale", "raw")

MAX_BYTES = 20_000
"""Of the YAML file, which has ten lines."""

MAX_DEPTH = 10
"""Brackets within brackets."""

LONGEST_NAME = 300
"""Characters of the path of an image."""

UNSEEN = 205
"""The grey in which map savers write what nobody has seen."""

WALL, UNKNOWN, FREE = range(3)


@dataclass(frozen=True, kw_only=True)
class _Header:
    """What the YAML file says. `origin` is (x, y, yaw) of the lower left corner, in m and rad."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied: float
    free: float
    mode: str


def read_ros(name: str, files: MapFiles, options: MapOptions) -> MapReading:
    """Read a map of ROS: free where the occupancy, 1 - brightness, is under `free_thresh`.

    Over `occupied_thresh` is a wall. What lies between, or is transparent in mode `scale`, is unknown: a wall
    unless `options.unknown_is_free`. In mode `raw`, grey levels 0 to 100 are the occupancy in percent, and
    others are unknown. In mode `trinary`, opacity is averaged into the brightness. All as nav2_map_server has
    it.

    Parameters
    ----------
    name : str
        Of the YAML file.
    files : MapFiles
        Returns the contents of that file, and of the image that it names.
    options : MapOptions
        `unknown_is_free`, `scale`, `units` and `tolerance` count; `resolution` replaces the file's.

    Raises
    ------
    InputError
        If a file cannot be read, or says something else than a map of ROS.
    """
    header = _header(files(name), name)
    pixels = decoded(files(header.image), header.image)
    states = _states(pixels, header)
    free = states == FREE
    notes = [f"ROS map, mode {header.mode}.", *pixels.notes]
    unknown, walls = float((states == UNKNOWN).mean()), float((states == WALL).mean())
    notes.append(
        f"{free.mean():.1%} free (occupancy under {header.free:g}), {walls:.1%} walls (over "
        f"{header.occupied:g}), {unknown:.1%} unknown, taken as "
        f"{'free' if options.unknown_is_free else 'walls'}."
    )
    notes += _warnings(pixels, header, options)
    if options.unknown_is_free:
        free |= states == UNKNOWN
    scale, units = scale_and_units("m", options)
    x, y, yaw = header.origin
    pixel = scale * (header.resolution if options.resolution is None else options.resolution)
    placement = Placement(pixel=pixel, units=units, x=scale * x, y=scale * y, yaw=yaw)
    return reading_of(free, PurePath(name).name, options.tolerance, placement, notes)


def _states(pixels: Pixels, header: _Header) -> NDArray[np.uint8]:
    """Return which pixels are free, walls or unknown."""
    level, full, alpha = pixels.colour, pixels.full, pixels.alpha
    if header.mode == "trinary" and alpha is not None:
        level, full = level + alpha, full + 255
    shade = np.arange(full + 1) / full
    of_level = np.full(full + 1, UNKNOWN, dtype=np.uint8)
    if header.mode == "raw":
        percent = np.round(shade * 255.0)
        of_level[(percent >= 100.0 * header.occupied) & (percent <= 100.0)] = WALL
        of_level[percent <= 100.0 * header.free] = FREE
    else:
        occupancy = shade if header.negate else 1.0 - shade
        of_level[occupancy < header.free] = FREE
        of_level[occupancy > header.occupied] = WALL
    states: NDArray[np.uint8] = of_level[level]
    if header.mode == "scale" and alpha is not None:
        states[alpha != 255] = UNKNOWN
    return states


def _warnings(pixels: Pixels, header: _Header, options: MapOptions) -> list[str]:
    """Say what may not be as the user thinks."""
    said = []
    unseen = 1.0 - UNSEEN / 255.0
    if pixels.full == 255 and header.mode == "trinary" and not header.negate and header.free > unseen:
        share = float((pixels.colour == UNSEEN).mean())
        if share > 0.0:
            said.append(
                f"{share:.1%} of the pixels have grey {UNSEEN}, in which map savers write what nobody has "
                f"seen, but free_thresh {header.free:g} makes them free: 0.196 would not."
            )
    if options.resolution is not None and options.resolution != header.resolution:
        said.append(f"The map's resolution of {header.resolution:g} was replaced by {options.resolution:g}.")
    return said


def _header(data: bytes, name: str) -> _Header:
    fields = _fields(data, name)
    image = fields.get("image")
    if not isinstance(image, str) or not 0 < len(image) <= LONGEST_NAME:
        raise InputError(f"Expected the name of an image as 'image' in '{name}', got {brief(image)}.")
    origin = fields.get("origin")
    origin = [_as_written(value) for value in origin] if isinstance(origin, list) else origin
    if not isinstance(origin, list) or len(origin) != 3 or not all(_is_number(value) for value in origin):
        raise InputError(f"Expected 'origin' as three numbers [x, y, yaw] in '{name}', got {brief(origin)}.")
    resolution = _number(fields, "resolution", name)
    if resolution <= 0.0:
        raise InputError(f"Expected a positive 'resolution' in '{name}', got {resolution:g}.")
    free, occupied = (_number(fields, key, name) for key in ("free_thresh", "occupied_thresh"))
    if not 0.0 <= free <= occupied <= 1.0:
        raise InputError(
            f"Expected free_thresh at most occupied_thresh, both from 0 to 1, in '{name}', got {free:g} and "
            f"{occupied:g}."
        )
    negate, mode = fields.get("negate", 0), fields.get("mode", "trinary")
    if not isinstance(negate, bool | int):
        raise InputError(f"Expected 'negate' as 0 or 1 in '{name}', got {brief(negate)}.")
    if mode not in MODES:
        raise InputError(f"Unknown mode {brief(mode)} in '{name}'. Available: {', '.join(MODES)}.")
    return _Header(
        image=image,
        resolution=resolution,
        origin=(float(origin[0]), float(origin[1]), float(origin[2])),
        negate=bool(negate),
        occupied=occupied,
        free=free,
        mode=mode,
    )


def _fields(data: bytes, name: str) -> dict[Any, Any]:
    try:
        import yaml
    except ImportError:
        raise InputError("Reading ROS maps needs PyYAML: pip install 'hrsnake[maps]'.") from None
    if len(data) > MAX_BYTES:
        raise InputError(f"Expected the YAML file of a ROS map in '{name}', got {len(data):,} bytes.")
    try:
        _check_plain(yaml, data, name)
        fields = yaml.safe_load(data)
    except InputError:
        raise
    except Exception as error:  # the library raises whatever its parts do: of `!!bool x` a KeyError
        place = getattr(error, "problem_mark", None)
        where = "" if place is None else f" in line {place.line + 1}"
        raise InputError(f"Expected YAML in '{name}', got something else{where}.") from None
    if not isinstance(fields, dict):
        raise InputError(
            f"Expected 'image: ...', 'resolution: ...' and so on in '{name}', got no such lines."
        )
    return fields


def _check_plain(yaml: Any, data: bytes, name: str) -> None:
    """Refuse what a few bytes of YAML make endless: aliases, and brackets in brackets."""
    depth = 0
    for token in yaml.scan(data):
        kind = type(token).__name__
        if kind == "AliasToken":
            raise InputError(
                f"Expected plain lines of YAML in '{name}', got an alias (*), which maps do not have."
            )
        depth += kind in ("FlowSequenceStartToken", "FlowMappingStartToken")
        depth -= kind in ("FlowSequenceEndToken", "FlowMappingEndToken")
        if depth > MAX_DEPTH:
            raise InputError(f"Expected plain lines of YAML in '{name}', got brackets {MAX_DEPTH} deep.")


def _as_written(value: Any) -> Any:
    """Return the number that a text is, as ROS reads it: to YAML 1.1, `5e-2` is no number without a point."""
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < 1e12  # neither infinite nor NaN, nor more than floating-point numbers hold


def _number(fields: dict[Any, Any], key: str, name: str) -> float:
    value = _as_written(fields.get(key))
    if not _is_number(value):
        raise InputError(f"Expected a number as '{key}' in '{name}', got {brief(value)}.")
    return float(value)
