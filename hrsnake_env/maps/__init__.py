"""Maps in: a maze from a ROS map, an occupancy image, SVG, DXF or GeoJSON outlines."""

from __future__ import annotations

import dataclasses
import importlib
import os
from pathlib import Path, PurePath

from hrsnake_env.errors import InputError
from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading, files_beside

__all__ = ["ENDINGS", "MapFiles", "MapOptions", "MapReading", "read_map"]

IMAGES = (".pgm", ".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".gif", ".webp")

ENDINGS = {
    **dict.fromkeys((".yaml", ".yml"), "ros"),
    **dict.fromkeys(IMAGES, "image"),
    ".svg": "svg",
    ".dxf": "dxf",
    **dict.fromkeys((".geojson", ".json"), "geojson"),
}
"""Which module reads a file, by the file's ending."""

OF_PIXELS = ("resolution", "threshold", "invert", "unknown_is_free")
OF_OUTLINES = ("free", "walls", "base", "goal", "ignore", "wall_thickness")

UNUSED = {
    "ros": ("threshold", "invert", *OF_OUTLINES),
    "image": ("unknown_is_free", *OF_OUTLINES),
    **dict.fromkeys(("svg", "dxf", "geojson"), OF_PIXELS),
}
"""Options that mean nothing to a reader."""


def read_map(
    source: str | os.PathLike[str], options: MapOptions | None = None, files: MapFiles | None = None
) -> MapReading:
    """Read a map of any kind. The free space that comes out is never larger than the map's.

    Parameters
    ----------
    source : str or path
        A ROS map (.yaml), an image (.pgm, .png, ...), or outlines (.svg, .dxf, .geojson); the ending says
        which.
    options : MapOptions, optional
        How to read it.
    files : callable, optional
        Returns the contents of files by name, as for uploads: then nothing is read from disk. By default,
        files are read beside the map.

    Returns
    -------
    reading : MapReading
        What was understood; `reading.maze(...)` makes a maze of it.

    Raises
    ------
    InputError
        If the map cannot be read, in a sentence that says why.
    """
    path = PurePath(source)
    kind = ENDINGS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"Unknown kind of map {path.name!r}. Available: {', '.join(ENDINGS)}.")
    module = importlib.import_module(f"hrsnake_env.maps.{kind}")
    read = getattr(module, f"read_{kind}")
    name, source_files = (
        (path.name, files_beside(Path(path))) if files is None else (os.fspath(source), files)
    )
    options = MapOptions() if options is None else options
    reading: MapReading = read(name, source_files, options)
    unused = [key for key in UNUSED[kind] if getattr(options, key) != getattr(MapOptions, key)]
    if unused:
        said = f"Not used, for they mean nothing to this kind of map: {', '.join(unused)}."
        reading = dataclasses.replace(reading, notes=(*reading.notes, said))
    return reading
