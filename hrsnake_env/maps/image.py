"""Mazes from images: pixels that are bright enough are free."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError
from scipy import ndimage

from hrsnake_env.errors import InputError, printable
from hrsnake_env.maps.raster import free_polygons
from hrsnake_env.maps.reading import MapFiles, MapOptions, MapReading, scale_and_units
from hrsnake_env.maps.simplify import simplified_inward

__all__ = ["Pixels", "Placement", "decoded", "read_image", "reading_of"]

THRESHOLD = 0.75
"""From which brightness a pixel is free. Scans of paper are brighter, ink and walls in grey are darker."""

TOLERANCE = 1.5
"""How far walls may move, in pixels. The staircase of a straight wall is up to 1.42 deep."""

ISLAND = 16
"""Other parts of the free space with fewer pixels than this are left out: no arm would be there."""

MAX_PIXELS, MAX_VERTICES = 64_000_000, 200_000

MAX_CORNERS = 500_000
"""Of the free pixels, before outlines become simpler: that takes a minute for noise of millions."""

FORMATS = ("PPM", "PNG", "JPEG", "BMP", "TIFF", "GIF", "WEBP")

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False, kw_only=True)
class Pixels:
    """Hold an image as it was stored.

    Parameters
    ----------
    colour : integer array, shape (rows, columns)
        Grey level, or the sum of red, green and blue; row 0 is at the top.
    full : int
        The `colour` of white.
    alpha : integer array, shape (rows, columns), or None
        255 is opaque. None if the image has no transparency; otherwise `full` is 3 * 255.
    notes : tuple of str
        What is worth knowing.
    """

    colour: NDArray[Any]
    full: int
    alpha: NDArray[Any] | None
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Say where the pixels of a map are in the maze.

    Parameters
    ----------
    pixel : float
        Side of a pixel, in maze units.
    units : str
        Of the maze.
    x, y : float
        The lower left corner of the image, in maze units.
    yaw : float
        By how much the image is turned about that corner, in rad.
    """

    pixel: float
    units: str
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


def read_image(name: str, files: MapFiles, options: MapOptions) -> MapReading:
    """Read an occupancy image. Bright is free, unless `options.invert`; transparent is as white as paper.

    Parameters
    ----------
    name : str
        Of the image.
    files : MapFiles
        Returns its contents.
    options : MapOptions
        `threshold`, `invert`, `resolution`, `scale`, `units` and `tolerance` count.

    Raises
    ------
    InputError
        If the file is no image, too large, or has no free pixel.
    """
    pixels = decoded(files(name), name)
    threshold = THRESHOLD if options.threshold is None else options.threshold
    level, full, notes = pixels.colour, pixels.full, list(pixels.notes)
    if pixels.alpha is not None:
        level = pixels.colour.astype(np.uint32) * pixels.alpha + full * (255 - pixels.alpha.astype(np.uint32))
        full *= 255
        notes.append("Transparent pixels count as white.")
    levels = np.arange(full + 1)
    is_free = (full - levels if options.invert else levels) >= threshold * full
    free: BoolArray = is_free[level]
    share = (
        f"darker than {1.0 - threshold:g} or as dark"
        if options.invert
        else f"of brightness {threshold:g} or more"
    )
    notes.append(f"Pixels {share} are free: {free.mean():.1%} of them.")
    scale, units = scale_and_units("px" if options.resolution is None else "", options)
    resolution = 1.0 if options.resolution is None else options.resolution
    placement = Placement(pixel=resolution * scale, units=units or "px")
    return reading_of(free, name, options.tolerance, placement, notes)


def decoded(data: bytes, name: str) -> Pixels:
    """Decode an image.

    Parameters
    ----------
    data : bytes
        The file.
    name : str
        For messages.

    Raises
    ------
    InputError
        If the data is no image, damaged, or has more than `MAX_PIXELS` pixels: they are not decoded then.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of sizes, which are checked below, and of odd metadata
            with Image.open(io.BytesIO(data), formats=FORMATS) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise Image.DecompressionBombError
                return _pixels(image, name)
    except UnidentifiedImageError:
        raise InputError(
            f"Expected an image in '{name}' ({', '.join(FORMATS)}), got something else."
        ) from None
    except Image.DecompressionBombError:
        raise InputError(
            f"Expected an image of at most {MAX_PIXELS:,} pixels, but '{name}' has more: make it smaller."
        ) from None
    except InputError:
        raise
    except Exception as error:  # damaged images make the library raise whatever its parts do
        raise InputError(
            f"Expected a whole image in '{name}', got a damaged one: {printable(str(error), 200)}."
        ) from None


def _pixels(image: Image.Image, name: str) -> Pixels:
    frames = getattr(image, "n_frames", 1)
    notes = [f"Of {frames} pictures in the file, the first was read."] if frames > 1 else []
    # Pillow has one name for all of these; grey ones are PGM files.
    kind = "PGM" if image.format == "PPM" and image.mode[0] in "1LI" else image.format
    image = ImageOps.exif_transpose(image)
    notes.insert(0, f"{kind} image of {image.width} x {image.height} pixels.")
    if image.mode == "F":
        raise InputError(f"Expected whole numbers as pixels of '{name}', got floating-point ones.")
    if image.mode.startswith("I"):
        level = np.asarray(image)
        if level.min() < 0 or level.max() > 65535:
            raise InputError(f"Expected pixels of at most 16 bits in '{name}', got more.")
        return Pixels(colour=level.astype(np.uint16), full=65535, alpha=None, notes=tuple(notes))
    if "transparency" in image.info or image.mode in ("LA", "PA", "La", "RGBA", "RGBa"):
        channels = np.asarray(image.convert("RGBA"))
        colour = channels[:, :, :3].sum(axis=2, dtype=np.uint16)
        return Pixels(colour=colour, full=765, alpha=channels[:, :, 3], notes=tuple(notes))
    if image.mode in ("1", "L"):
        return Pixels(colour=np.asarray(image.convert("L")), full=255, alpha=None, notes=tuple(notes))
    colour = np.asarray(image.convert("RGB")).sum(axis=2, dtype=np.uint16)
    return Pixels(colour=colour, full=765, alpha=None, notes=tuple(notes))


def reading_of(
    free: BoolArray, name: str, tolerance: float | None, placement: Placement, notes: Sequence[str]
) -> MapReading:
    """Make a reading of free pixels.

    Parameters
    ----------
    free : bool array, shape (rows, columns)
        Row 0 is at the top.
    name : str
        Of the file.
    tolerance : float or None
        In maze units; by default `TOLERANCE` pixels.
    placement : Placement
        Where the pixels are in the maze.
    notes : sequence of str
        What was understood so far.

    Raises
    ------
    InputError
        If no pixel is free, or the outlines have too many vertices.
    """
    notes = list(notes)
    if min(free.shape) < 1:
        raise InputError(f"Expected an image with pixels in '{name}', got none.")
    free, left_out = _without_islands(free)
    if left_out:
        notes.append(f"{left_out} islands of fewer than {ISLAND} free pixels were left out.")
    in_pixels = TOLERANCE if tolerance is None else tolerance / placement.pixel
    corners = _n_corners(free)
    if corners > MAX_CORNERS:
        raise _too_many(MAX_CORNERS, corners, name)
    outlines = free_polygons(free)
    if outlines.is_empty:
        raise InputError(
            f"Expected free pixels in '{name}', got none: lower the threshold, or invert the image if its "
            f"free space is dark."
        )
    exact = _n_vertices(outlines)
    simple, moved = simplified_inward(outlines, in_pixels)
    count = _n_vertices(simple)
    if count > MAX_VERTICES:
        raise _too_many(MAX_VERTICES, count, name)
    notes.append(f"{exact:,} vertices along the pixels became {count:,}.")
    turn, pixel = np.exp(1j * placement.yaw), placement.pixel

    def placed(points: NDArray[np.float64]) -> NDArray[np.float64]:
        away = pixel * points
        if placement.yaw != 0.0:
            turned = (away[:, 0] + 1j * away[:, 1]) * turn
            away = np.stack([turned.real, turned.imag], axis=1)
        return np.asarray(away + np.array([placement.x, placement.y]), dtype=np.float64)

    return MapReading(
        name=PurePath(name).stem,
        free_space=shapely.transform(simple, placed),
        units=placement.units,
        tolerance=in_pixels * pixel,
        moved=moved * pixel,
        notes=tuple(notes),
    )


def _too_many(most: int, count: int, name: str) -> InputError:
    return InputError(
        f"Expected outlines of at most {most:,} vertices in '{name}', got {count:,}: remove specks from the "
        f"image (a median filter does), make it smaller, or allow a larger tolerance."
    )


def _n_corners(free: BoolArray) -> int:
    """Return the number of corners along the pixels, before they are traced."""
    padded = np.pad(free, 1)
    differs = padded[:-1] ^ padded[1:]  # from the pixel below
    touching = (padded[:-1, :-1] == padded[1:, 1:]) & differs[:, :-1] & differs[:, 1:]
    return int((differs[:, :-1] ^ differs[:, 1:]).sum() + 2 * touching.sum())


def _n_vertices(outlines: Any) -> int:
    return int(shapely.get_num_coordinates(outlines) - len(shapely.get_rings(shapely.get_parts(outlines))))


def _without_islands(free: BoolArray) -> tuple[BoolArray, int]:
    """Leave out small parts of the free space, but not the only one; return how many were left out."""
    labels, n_parts = ndimage.label(free)
    if n_parts < 2:
        return free, 0
    sizes = np.bincount(labels.ravel())
    stays = sizes >= min(ISLAND, sizes[1:].max())
    stays[0] = False
    return stays[labels], int(n_parts - stays.sum())
