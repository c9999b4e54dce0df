"""The workspace of a spatial arm: a room with boxes and windowed panels, a base and a goal; files."""

from __future__ import annotations

import json
import math
import os
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hrsnake_env.arguments import is_number, numbers
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing

__all__ = ["Panel", "Workspace"]

AXES = "xyz"
SIDES = ("x-", "x+", "y-", "y+", "z-", "z+")
"""Sides of a room: at the low and at the high end of each axis."""

MARK = "hrsnake workspace"
"""What a workspace file calls itself."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Panel:
    """Describe a wall of some thickness with one rectangular window.

    Parameters
    ----------
    low, high : array-like, shape (3,)
        Two opposite corners of the whole panel, window included.
    normal : str
        `x`, `y` or `z`: the axis along which the window goes through.
    window_low, window_high : array-like, shape (3,)
        Two opposite corners of the window. Along the normal they are those of the panel.

    Raises
    ------
    InputError
        If a box is inside out or the window is not in the panel.
    """

    low: FloatArray
    high: FloatArray
    normal: str
    window_low: FloatArray
    window_high: FloatArray

    def __post_init__(self) -> None:
        if self.normal not in tuple(AXES):
            raise InputError(f"Expected the normal of a panel to be x, y or z, got {self.normal!r}.")
        _store_box(self, "low", "high", "a panel")
        axis = AXES.index(self.normal)
        for key, limit in (("window_low", self.low), ("window_high", self.high)):
            corner = _vector(getattr(self, key), "a corner of the window of a panel")
            corner[axis] = limit[axis]
            object.__setattr__(self, key, corner)
        _store_box(self, "window_low", "window_high", "the window of a panel")
        if not ((self.window_low >= self.low).all() and (self.window_high <= self.high).all()):
            raise InputError(
                f"Expected the window of a panel inside it, from {_text(self.low)} to {_text(self.high)}, "
                f"got one from {_text(self.window_low)} to {_text(self.window_high)}."
            )

    @property
    def boxes(self) -> FloatArray:
        """The panel as up to four boxes, shape (n, 2, 3): all of it beyond each edge of the window.

        They overlap at the corners. Boxes that merely abut would have seams, at which the way out of a wall
        would point into the next.
        """
        found = []
        for axis in range(3):
            if axis == AXES.index(self.normal):
                continue
            below, above = np.stack([self.low, self.high]), np.stack([self.low, self.high])
            below[1, axis], above[0, axis] = self.window_low[axis], self.window_high[axis]
            found += [box for box in (below, above) if box[1, axis] > box[0, axis]]
        return np.array(found).reshape(-1, 2, 3)


@dataclass(frozen=True, eq=False, kw_only=True)
class Workspace:
    """Describe what a spatial arm moves in. All arrays are read-only.

    The free space is the room without boxes and panels. An arm comes out of a straight feeder that ends at
    the base, and the first stretch of its way, `straight` units long, goes on along the heading. The base is
    where links of up to that length leave the feeder: one link length in front of it must be straight. For
    longer links the feeder is mounted farther back (`base_pose_for`).

    Parameters
    ----------
    name : str
        For tables and pictures.
    room_low, room_high : array-like, shape (3,)
        Opposite corners of the room, in workspace units.
    open_sides : sequence of str
        Sides of the room without a wall, of `x-`, `x+`, `y-`, `y+`, `z-`, `z+`; the feeder may come in there.
    panels : sequence of Panel
        Walls with a window.
    boxes : array-like, shape (n_boxes, 2, 3)
        Two opposite corners of each further obstacle, the low one first.
    base, heading : array-like, shape (3,)
        Position of the base, and the direction into the room (any length but 0).
    straight : float
        Length of the straight stretch past the base; positive.
    goal : array-like, shape (3,)
        Where the tip has to get.
    goal_radius : float
        How near; positive.
    units : str
        Of all lengths.

    Raises
    ------
    InputError
        If a box is inside out, if base, goal or the end of the straight stretch are outside the room, or if
        base or goal are in an obstacle (the base may lie on one, the feeder may come through it).
    """

    name: str
    room_low: FloatArray
    room_high: FloatArray
    base: FloatArray
    heading: FloatArray
    straight: float
    goal: FloatArray
    goal_radius: float
    open_sides: tuple[str, ...] = ()
    panels: tuple[Panel, ...] = ()
    boxes: FloatArray | None = None
    units: str = "units"

    def __post_init__(self) -> None:
        _store_box(self, "room_low", "room_high", "a room")
        for side in self.open_sides:
            if side not in SIDES:
                raise InputError(f"Unknown side of a room {side!r}. Available: {', '.join(SIDES)}.")
        object.__setattr__(self, "open_sides", tuple(self.open_sides))
        object.__setattr__(self, "panels", tuple(self.panels))
        _store(self, "boxes", _boxes(self.boxes))
        for key in ("base", "heading", "goal"):
            _store(self, key, _vector(getattr(self, key), f"the {key}"))
        if not self.heading.any():
            raise InputError("Expected a heading of some length, got (0, 0, 0).")
        _store(self, "heading", _unit(self.heading))
        for key in ("straight", "goal_radius"):
            object.__setattr__(self, key, _positive(getattr(self, key), key))
        _store(self, "obstacles", self._obstacles())
        self._check_places()

    def __repr__(self) -> str:
        assert self.boxes is not None
        return f"Workspace({self.name!r}, {len(self.panels)} panels, {len(self.boxes)} boxes)"

    obstacles: FloatArray = field(init=False)
    """Boxes, shape (n, 2, 3), whose union leaves the free space: the walls and the closed sides of the room.

    What touches a closed side goes on behind it, as thick as the room is large, so that the way out of an
    obstacle never leads out of the room.
    """

    @property
    def walls(self) -> FloatArray:
        """The obstacles inside the room, shape (n, 2, 3): panels in pieces first, then boxes."""
        assert self.boxes is not None
        return np.concatenate([*(panel.boxes for panel in self.panels), self.boxes])

    def obstacle_in_room(self, number: int) -> FloatArray:
        """Return the part of an obstacle in the room, shape (2, 3), for people; of a side, its face."""
        return np.asarray(np.clip(self.obstacles[number], self.room_low, self.room_high))

    @property
    def size(self) -> float:
        """Diagonal of the room."""
        return float(np.linalg.norm(self.room_high - self.room_low))

    def _obstacles(self) -> FloatArray:
        low, high = self.room_low, self.room_high
        thick, walls = self.size, self.walls.copy()
        sides = []
        for axis in range(3):
            if AXES[axis] + "-" not in self.open_sides:
                touch = walls[:, 0, axis] <= low[axis]
                walls[touch, 0, axis] = np.minimum(walls[touch, 0, axis], low[axis] - thick)
                sides.append(_slab(low - thick, high + thick, axis, None, low[axis]))
            if AXES[axis] + "+" not in self.open_sides:
                touch = walls[:, 1, axis] >= high[axis]
                walls[touch, 1, axis] = np.maximum(walls[touch, 1, axis], high[axis] + thick)
                sides.append(_slab(low - thick, high + thick, axis, high[axis], None))
        return np.concatenate([walls, np.array(sides).reshape(-1, 2, 3)])

    def _check_places(self) -> None:
        room = f"the room, from {_text(self.room_low)} to {_text(self.room_high)}"
        if not ((self.base >= self.room_low).all() and (self.base <= self.room_high).all()):
            raise InputError(f"Expected a base in {room}, got {_text(self.base)}.")
        if not ((self.goal > self.room_low).all() and (self.goal < self.room_high).all()):
            raise InputError(f"Expected a goal inside {room}, got {_text(self.goal)}.")
        low, high = self.obstacles[:, 0], self.obstacles[:, 1]
        for what, place, within in (
            ("base", self.base, (self.base > low) & (self.base < high)),
            ("goal", self.goal, (self.goal >= low) & (self.goal <= high)),
        ):
            if within.all(axis=1).any():
                # One of the walls, which come first: the place is not beyond a side of the room.
                box = self.walls[int(np.argmax(within.all(axis=1)))]
                raise InputError(
                    f"Expected a {what} in the free space, got {_text(place)}, which is in the obstacle from "
                    f"{_text(box[0])} to {_text(box[1])}."
                )
        end = self.base + self.straight * self.heading
        if not ((end > self.room_low).all() and (end < self.room_high).all()):
            raise InputError(
                f"Expected a straight stretch of {self.straight:g} from the base {_text(self.base)} that "
                f"ends inside {room}, got its end at {_text(end)}."
            )
        along = max(float((self.goal - self.base) @ self.heading), 0.0)
        aside = float(np.linalg.norm(self.base + along * self.heading - self.goal))
        if along < self.straight and aside <= self.goal_radius:
            raise InputError(
                f"Expected a goal off the straight stretch of {self.straight:g} from the base, got "
                f"{_text(self.goal)} with a radius of {self.goal_radius:g}: the arm meets it before it bends."
            )

    def base_pose_for(self, link_length: float) -> FloatArray:
        """Return the base for links of a length: position and unit heading, shape (6,).

        The feeder of links longer than the straight stretch ends so much farther back that every link is
        straight until its rear joint has passed the base, and the arm free at the same place as always.
        """
        back = max(0.0, link_length - self.straight)
        return np.concatenate([self.base - back * self.heading, self.heading])

    def check_arm(self, arm: ArmSpec) -> None:
        """Check that the arm can leave the feeder: its first link length is straight and free.

        Raises
        ------
        InputError
            If the link is longer than the room, or than the straight feed allows.
        """
        if arm.link_length > self.size:
            raise InputError(
                f"Expected a link_length of at most the size of workspace '{self.name}' ({self.size:g} "
                f"{self.units}), got {arm.link_length:g}."
            )
        behind = self._free_along(-self.heading, arm.link_radius)
        ahead = self._free_along(self.heading, arm.link_radius)
        if ahead < self.straight:
            raise InputError(
                f"Expected {self.straight:g} {self.units} of straight free way past the base of workspace "
                f"'{self.name}' for links of radius {arm.link_radius:g}, got {ahead:g}."
            )
        if arm.link_length > self.straight + behind:
            raise InputError(
                f"Expected links of at most {self.straight + behind:g} {self.units} in workspace "
                f"'{self.name}', as the straight feed allows ({self.straight:g} past the base, {behind:g} "
                f"behind it), got {arm.link_length:g}."
            )
        base = self.base_pose_for(arm.link_length)[:3]
        nearest = np.clip(base, self.obstacles[:, 0], self.obstacles[:, 1])
        room = float(np.linalg.norm(nearest - base, axis=1).min(initial=np.inf))
        if room < arm.link_radius:
            raise InputError(
                f"Expected at least the link radius of {arm.link_radius:g} {self.units} of room about "
                f"the base of workspace '{self.name}', got {room:g}: move the base into the room, or open "
                f"the side behind it."
            )

    def _free_along(self, way: FloatArray, radius: float) -> float:
        """Return how far from the base the way is free for a rod of a radius; infinite without obstacles.

        What is wholly behind the base does not count: the feeder's own wall is as near as one likes. Touching
        is free. Obstacles are grown by the radius along each axis, which is a little too much at their edges.
        """
        faces = self.obstacles - self.base
        obstacles = self.obstacles[np.maximum(faces[:, 0] * way, faces[:, 1] * way).sum(axis=1) > 0.0]
        low, high = obstacles[:, 0] - radius, obstacles[:, 1] + radius
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            near, far = (low - self.base) / way, (high - self.base) / way
        enter, leave = np.fmin(near, far), np.fmax(near, far)
        across = way == 0.0
        outside = across & ((self.base <= low) | (self.base >= high))
        enter[:, across], leave[:, across] = -np.inf, np.inf
        first, last = enter.max(axis=1), leave.min(axis=1)
        meets = ~outside.any(axis=1) & (first < last) & (last > 0.0)
        return float(np.maximum(first[meets], 0.0).min(initial=np.inf))

    # Reading and writing

    @classmethod
    def load(cls, source: str | os.PathLike[str]) -> Workspace:
        """Read a workspace file (JSON).

        Raises
        ------
        InputError
            If there is no such file, or it does not hold a workspace.
        """
        path = Path(source)
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise InputError(f"Expected a workspace file at '{path}', but there is none.") from None
        except OSError as error:
            raise InputError(
                f"Expected a workspace file at '{path}' that can be read, got: {error.strerror}."
            ) from None
        except UnicodeDecodeError:
            raise InputError(f"Expected text (UTF-8) in '{path}', got a file that is none.") from None
        except (ValueError, RecursionError) as error:
            raise InputError(f"Expected JSON in '{path}', got a file that is not: {error}.") from None
        return cls.from_dict(data, default_name=path.stem)

    @classmethod
    def from_dict(cls, data: Any, *, default_name: str = "workspace") -> Workspace:
        """Build a workspace from plain numbers and strings, as in a workspace file.

        Raises
        ------
        InputError
            If something is missing, unknown or wrong.
        """
        if not isinstance(data, dict) or data.get("type") != MARK:
            raise InputError(f'Expected a workspace with "type": "{MARK}", got {_kind(data)}.')
        known = ("type", "name", "units", "room", "panels", "boxes", "base", "goal")
        _check_keys(data, "a workspace", known, ("room", "base", "goal"))
        room, base, goal = data["room"], data["base"], data["goal"]
        of_base, of_goal = ("position", "heading", "straight"), ("position", "radius")
        _check_keys(room, "the room", ("low", "high", "open"), ("low", "high"))
        _check_keys(base, "the base", of_base, of_base)
        _check_keys(goal, "the goal", of_goal, of_goal)
        panels, boxes = (_list(data.get(key, []), key) for key in ("panels", "boxes"))
        return cls(
            name=_string(data.get("name", default_name), "the name of a workspace"),
            units=_string(data.get("units", "units"), "the units of a workspace"),
            room_low=room["low"],
            room_high=room["high"],
            open_sides=tuple(_list(room.get("open", []), "the open sides of the room")),
            panels=tuple(_panel(one, number) for number, one in enumerate(panels)),
            boxes=np.array([_corners(one, f"box {number}") for number, one in enumerate(boxes)]),
            base=base["position"],
            heading=base["heading"],
            straight=base["straight"],
            goal=goal["position"],
            goal_radius=goal["radius"],
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the workspace as plain numbers and strings (the inverse of `from_dict`)."""
        assert self.boxes is not None
        return {
            "type": MARK,
            "name": self.name,
            "units": self.units,
            "room": {
                "low": self.room_low.tolist(),
                "high": self.room_high.tolist(),
                "open": list(self.open_sides),
            },
            "panels": [
                {
                    "low": panel.low.tolist(),
                    "high": panel.high.tolist(),
                    "normal": panel.normal,
                    "window": {"low": panel.window_low.tolist(), "high": panel.window_high.tolist()},
                }
                for panel in self.panels
            ],
            "boxes": [{"low": low, "high": high} for low, high in self.boxes.tolist()],
            "base": {
                "position": self.base.tolist(),
                "heading": self.heading.tolist(),
                "straight": self.straight,
            },
            "goal": {"position": self.goal.tolist(), "radius": self.goal_radius},
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the workspace as JSON, completely or not at all."""
        with replacing(path) as part:
            part.write_text(json.dumps(self.to_dict(), indent=1) + "\n", encoding="utf-8")


def _slab(low: FloatArray, high: FloatArray, axis: int, start: float | None, end: float | None) -> FloatArray:
    slab = np.stack([low, high])
    if start is not None:
        slab[0, axis] = start
    if end is not None:
        slab[1, axis] = end
    return slab


def _store(record: Any, key: str, array: FloatArray) -> None:
    array = np.array(array, dtype=np.float64)
    array.setflags(write=False)
    object.__setattr__(record, key, array)


def _vector(value: Any, what: str) -> FloatArray:
    try:
        vector = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        vector = np.empty(0)
    # NumPy takes True and "1" for numbers.
    if vector.shape != (3,) or not np.isfinite(vector).all() or not all(map(is_number, value)):
        came = " ".join(repr(value).split())
        raise InputError(f"Expected {what} as three finite numbers (x, y, z), got {came}.")
    return vector


def _unit(vector: FloatArray) -> FloatArray:
    """Return a vector of length 1 along another; itself if it is one but for rounding."""
    if abs(math.hypot(*vector) - 1.0) <= 4.0 * np.finfo(np.float64).eps:
        return vector
    # First by the largest number, as squares may be too large or too small.
    vector = vector / np.abs(vector).max()
    return np.asarray(vector / math.hypot(*vector), dtype=np.float64)


def _positive(value: Any, what: str) -> float:
    if not is_number(value) or not 0.0 < value <= sys.float_info.max:
        raise InputError(f"Expected {what} to be positive and finite, got {value!r}.")
    return float(value)


def _string(value: Any, what: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"Expected {what} as a text, got {_kind(value)}.")
    return value


def _boxes(value: Any) -> FloatArray:
    boxes = numbers("boxes", [] if value is None else value)
    if boxes.shape == (0,):
        return boxes.reshape(0, 2, 3)
    if boxes.ndim != 3 or boxes.shape[1:] != (2, 3):
        raise InputError(f"Expected boxes with shape (n_boxes, 2, 3), got {boxes.shape}.")
    for number, (low, high) in enumerate(value):
        what = f"a corner of box {number}"
        _check_box(_vector(low, what), _vector(high, what), f"box {number}")
    return boxes


def _store_box(record: Any, low: str, high: str, what: str) -> None:
    for key in (low, high):
        _store(record, key, _vector(getattr(record, key), f"a corner of {what}"))
    _check_box(getattr(record, low), getattr(record, high), what)


def _check_box(low: FloatArray, high: FloatArray, what: str) -> None:
    if not (low < high).all():
        raise InputError(
            f"Expected {what} with a low corner below its high corner along every axis, got {_text(low)} and "
            f"{_text(high)}: it is inside out or has no thickness."
        )


def _check_keys(data: Any, what: str, known: tuple[str, ...], needed: tuple[str, ...]) -> None:
    if not isinstance(data, dict):
        raise InputError(f"Expected {what} as an object with {', '.join(needed)}, got {_kind(data)}.")
    for key in needed:
        if key not in data:
            raise InputError(f"Expected {what} with '{key}', but it has none.")
    for key in data:
        if key not in known:
            raise InputError(f"Unknown key {key!r} of {what}. Available: {', '.join(known)}.")


def _list(data: Any, what: str) -> list[Any]:
    if not isinstance(data, list):
        raise InputError(f"Expected {what} as a list, got {_kind(data)}.")
    return data


def _corners(data: Any, what: str) -> list[FloatArray]:
    _check_keys(data, what, ("low", "high"), ("low", "high"))
    return [_vector(data[key], f"the {key} corner of {what}") for key in ("low", "high")]


def _panel(data: Any, number: int) -> Panel:
    what = f"panel {number}"
    _check_keys(data, what, ("low", "high", "normal", "window"), ("low", "high", "normal", "window"))
    low, high = _corners({"low": data["low"], "high": data["high"]}, what)
    window = _corners(data["window"], f"the window of {what}")
    try:
        return Panel(low=low, high=high, normal=data["normal"], window_low=window[0], window_high=window[1])
    except InputError as error:
        raise InputError(f"{str(error).removesuffix('.')} ({what}).") from None


def _kind(data: Any) -> str:
    if isinstance(data, dict):
        return f"an object of type {data['type']!r}" if "type" in data else "an object without a type"
    return {list: "a list", str: "a text", type(None): "nothing"}.get(type(data), f"{data!r}")


def _text(point: FloatArray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"
