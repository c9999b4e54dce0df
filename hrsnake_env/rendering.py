"""Frames of a maze and an arm, drawn with Pillow in a few milliseconds and without a display."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from hrsnake_env.appearance import RGB, link_colours, mixed, rgb, shown_window
from hrsnake_env.arm import FloatArray
from hrsnake_env.contacts import Contact, Place
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze

__all__ = ["HEIGHT", "Frame", "FrameRenderer"]

HEIGHT = 480
"""Of a frame in pixels, by default. Lines have their full width there, and scale with the height."""

FINE = 2
"""Frames are drawn at so many times their size and then reduced, so that lines are smooth."""

THINNEST = 1.5
"""In pixels: no line of the arm is thinner, however small the frame."""

SMALLEST = 16
"""In pixels: no side of a frame is shorter."""

Frame = NDArray[np.uint8]
Box = tuple[int, int, int, int]


class FrameRenderer:
    """Draw frames: the maze once, the arm as often as wanted.

    Parameters
    ----------
    maze : Maze
        The maze.
    size : int or tuple of two ints
        In pixels. The height, which is even; the width then follows from the maze, between 0.4 and 3 times
        it, and is even, too, as video formats want it. Or width and height; the maze stands in the middle.
    link_radius : float
        In maze units.

    Attributes
    ----------
    size : tuple of two ints
        Width and height in pixels.

    Raises
    ------
    InputError
        If `size` is not of whole numbers from 16.
    """

    def __init__(self, maze: Maze, *, size: int | tuple[int, int] = HEIGHT, link_radius: float = 0.0) -> None:
        x_min, y_min, x_max, y_max = shown_window(maze).tolist()
        wide, high = x_max - x_min, y_max - y_min
        if not isinstance(size, Sequence):
            height = _checked(size, even=True)
            size = (2 * round(height * min(max(wide / high, 0.4), 3.0) / 2), height)
        width, height = (_checked(length) for length in size)
        self.size = (width, height)
        self._scale = min(width / wide, height / high)
        # Where the maze's origin is: x to the right, y down.
        self._origin = np.array(
            [
                width / 2 - self._scale * (x_min + x_max) / 2,
                height / 2 + self._scale * (y_min + y_max) / 2,
            ]
        )
        self._unit = self._scale * high / HEIGHT
        self._link_width = max(2.0 * link_radius * self._scale, self._length(3.5))
        self._fine = self._draw_maze(maze)
        self._plain = self._fine.reduce(FINE)

    def to_pixels(self, points: ArrayLike) -> FloatArray:
        """Return where points of the maze are in a frame, shape (..., 2): from the left, from the top."""
        pixels: FloatArray = np.asarray(points, dtype=np.float64) * (self._scale, -self._scale) + self._origin
        return pixels

    def to_maze(self, pixels: ArrayLike) -> FloatArray:
        """Return which points of the maze are at places in a frame, shape (..., 2)."""
        points: FloatArray = (np.asarray(pixels, dtype=np.float64) - self._origin) / (
            self._scale,
            -self._scale,
        )
        return points

    def draw(
        self,
        joints: ArrayLike,
        *,
        clearances: ArrayLike | None = None,
        link_length: float = 1.0,
        contacts: Sequence[Contact] = (),
        target_joints: ArrayLike | None = None,
    ) -> Frame:
        """Draw a frame.

        Links are coloured by clearance, as in the HTML replay; rings mark pinches, crosses collisions.

        Parameters
        ----------
        joints : array-like, shape (n_links + 1, 2)
            Joint positions, base end first, in maze units. If one is not finite, there is no arm to show.
        clearances : array-like, shape (n_links,), optional
            Of each link, in maze units. Without them all free links look the same.
        link_length : float
            In maze units; the measure of the clearances.
        contacts : sequence of Contact
            Of this pose.
        target_joints : array-like, shape (n_links + 1, 2), optional
            Where the arm was sent: drawn thin and pale.

        Returns
        -------
        frame : uint8 array, shape (height, width, 3)
            Red, green, blue; it belongs to the caller.
        """
        places = self.to_pixels(joints)
        if not np.isfinite(places).all():
            return np.array(self._plain)
        ghost = None if target_joints is None else self.to_pixels(target_joints)
        marks = [(self._place(contact.point), contact.kind) for contact in contacts]
        drawn = np.vstack([places, *([] if ghost is None else [ghost]), *(place for place, _ in marks)])
        box = self._box_around(drawn)
        frame = self._plain.copy()
        if box is not None:
            brush = _Brush(self._fine, box)
            if ghost is not None and np.isfinite(ghost).all():
                brush.line(ghost, self._length(1.5), mixed(rgb("free"), rgb("joint"), 0.35))
            colours = link_colours(
                len(places) - 1, clearances=clearances, link_length=link_length, contacts=contacts
            )
            self._draw_arm(brush, places, colours, contacts)
            for place, kind in marks:
                self._draw_mark(brush, place, kind)
            frame.paste(brush.image.reduce(FINE), box)
        return np.array(frame)

    def _place(self, point: ArrayLike) -> Place:
        x, y = self.to_pixels(point).tolist()
        return x, y

    def _length(self, pixels: float, least: float = THINNEST) -> float:
        """Return a length that is so many pixels in a frame of the default height."""
        length: float = max(self._unit * pixels, least)
        return length

    def _box_around(self, places: FloatArray) -> Box | None:
        """Return left, top, right and bottom of what is drawn at these places, None if out of sight."""
        pad = self._link_width + 2.0 * self._length(8.0, 5.0)
        low = np.clip(np.floor(places.min(axis=0) - pad), 0, self.size)
        high = np.clip(np.ceil(places.max(axis=0) + pad), 0, self.size)
        if not (low < high).all():
            return None
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _draw_arm(
        self, brush: _Brush, places: FloatArray, colours: list[RGB], contacts: Sequence[Contact]
    ) -> None:
        touching = {contact.link for contact in contacts} | {contact.other for contact in contacts}
        ends = [(x, y) for x, y in places.tolist()]
        # What touches is drawn last, and wider: colour alone does not tell.
        for k in sorted(range(len(colours)), key=lambda k: k in touching):
            width = self._link_width + (self._length(1.0, 0.5) if k in touching else 0.0)
            brush.line(places[k : k + 2], width, colours[k])
            for place in ends[k : k + 2]:
                brush.disc(place, width / 2, colours[k])
        link_pixels = float(np.hypot(*(places[1] - places[0])))
        dot = min(self._length(2.6, 0.5 * THINNEST), max(link_pixels / 6, 0.5 * THINNEST))
        for place in ends[:-1]:
            brush.disc(place, dot, rgb("joint"))
        brush.disc(ends[-1], self._length(4.5, 2.0), rgb("joint"))
        brush.disc(ends[-1], self._length(2.6, 1.0), rgb("free"))

    def _draw_mark(self, brush: _Brush, place: Place, kind: str) -> None:
        """Draw a ring around a pinch, or a cross on a collision, on a pale edge that sets it off."""
        for width, colour in ((self._length(6.0), rgb("free")), (self._length(3.0), rgb(kind))):
            if kind == "pinch":
                brush.ring(place, self._length(5.5, 2.5), width, colour)
            else:
                brush.cross(place, self._length(6.0, 3.0), width, colour)

    def _draw_maze(self, maze: Maze) -> Image.Image:
        image = Image.new("RGB", (FINE * self.size[0], FINE * self.size[1]), rgb("wall"))
        brush = _Brush(image, (0, 0, *self.size))
        rings = [self.to_pixels(ring) for ring in maze.rings]
        for number, ring in enumerate(rings):
            brush.polygon(ring, rgb("free" if number == 0 else "wall"))
        goal = self._place(maze.goal)
        radius = max(maze.goal_radius * self._scale, self._length(3.0))
        brush.veil(goal, radius, rgb("goal"), 0.35)
        brush.cross(goal, min(self._length(3.5), 0.5 * radius), self._length(1.4, 0.8), rgb("goal"))
        for ring in rings:
            brush.line(ring, self._length(1.3, 0.7), rgb("edge"))
        x, y, heading = (float(value) for value in maze.base_pose)
        turns = heading + np.radians([0.0, 120.0, 240.0])
        corners = np.column_stack([np.cos(turns), -np.sin(turns)]) * self._length(7.0, 2.5)
        brush.polygon(self.to_pixels((x, y)) + corners, rgb("base"))
        return brush.image


def _checked(length: Any, even: bool = False) -> int:
    """Return a side of a frame, in pixels."""
    whole = isinstance(length, int | np.integer) and not isinstance(length, bool)
    if not whole or length < SMALLEST or (even and length % 2):
        kind = "an even height" if even else "a width and a height"
        raise InputError(f"Expected {kind} in whole pixels, from {SMALLEST}, got {length!r}.")
    return int(length)


class _Brush:
    """Draw at places in pixels of a frame, on a part of its fine picture.

    Parameters
    ----------
    fine : PIL image
        At `FINE` times the frame's size; stays as it is.
    box : tuple of four ints
        Left, top, right and bottom of the part, in pixels of the frame.
    """

    def __init__(self, fine: Image.Image, box: Box) -> None:
        self.image = fine.crop(tuple(FINE * side for side in box))  # type: ignore[arg-type]
        self._draw = ImageDraw.Draw(self.image)
        self._left, self._top = box[:2]

    def line(self, places: ArrayLike, width: float, colour: RGB) -> None:
        """Draw through two places or more."""
        # Pillow counts from the middle of the first pixel.
        fine = FINE * (np.asarray(places) - (self._left, self._top)) - 0.5
        self._draw.line(fine.ravel().tolist(), fill=colour, width=max(round(FINE * width), 1), joint="curve")

    def polygon(self, places: FloatArray, colour: RGB) -> None:
        """Fill a polygon."""
        fine = FINE * (places - (self._left, self._top)) - 0.5
        self._draw.polygon(fine.ravel().tolist(), fill=colour)

    def disc(self, place: Place, radius: float, colour: RGB) -> None:
        """Fill a circle."""
        self._draw.ellipse(self._square(place, radius), fill=colour)

    def ring(self, place: Place, radius: float, width: float, colour: RGB) -> None:
        """Draw a circle; the radius is that of the line's middle."""
        box = self._square(place, radius + width / 2)
        self._draw.ellipse(box, outline=colour, width=max(round(FINE * width), 1))

    def cross(self, place: Place, radius: float, width: float, colour: RGB) -> None:
        """Draw a cross that fills a square."""
        x, y = place
        for rise in (-radius, radius):
            self.line([(x - radius, y - rise), (x + radius, y + rise)], width, colour)

    def veil(self, place: Place, radius: float, colour: RGB, opacity: float) -> None:
        """Fill a circle that lets through what is below it."""
        mask = Image.new("L", self.image.size, 0)
        ImageDraw.Draw(mask).ellipse(self._square(place, radius), fill=round(255 * opacity))
        self.image.paste(colour, mask=mask)

    def _square(self, place: Place, radius: float) -> list[float]:
        x, y = FINE * (place[0] - self._left) - 0.5, FINE * (place[1] - self._top) - 0.5
        return [x - FINE * radius, y - FINE * radius, x + FINE * radius, y + FINE * radius]
