"""The workspace of a spatial arm: a room with boxes and windowed panels, a base and a goal; files."""

from __future__ import annotations

import dataclasses
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.reading import NotReadable, read_json
from planners.spatial.entries import (
    boxes_of,
    check_keys,
    corners_of,
    kind_of,
    list_of,
    point_text,
    positive,
    store,
    store_box,
    string_of,
    unit_of,
    vector_of,
)
from planners.spatial.panel import AXES, Panel, panel_from_dict

__all__ = ["Workspace"]

SIDES = ("x-", "x+", "y-", "y+", "z-", "z+")
"""Sides of a room: at the low and at the high end of each axis."""

MARK = "hrsnake workspace"
"""What a workspace file calls itself."""


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
        store_box(self, "room_low", "room_high", "a room")
        for side in self.open_sides:
            if side not in SIDES:
                raise InputError(f"Unknown side of a room {side!r}. Available: {', '.join(SIDES)}.")
        object.__setattr__(self, "open_sides", tuple(self.open_sides))
        object.__setattr__(self, "panels", tuple(self.panels))
        store(self, "boxes", boxes_of(self.boxes))
        for key in ("base", "heading", "goal"):
            store(self, key, vector_of(getattr(self, key), f"the {key}"))
        if not self.heading.any():
            raise InputError("Expected a heading of some length, got (0, 0, 0).")
        store(self, "heading", unit_of(self.heading))
        for key in ("straight", "goal_radius"):
            object.__setattr__(self, key, positive(getattr(self, key), key))
        store(self, "obstacles", self._obstacles())
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

    def obstacles_grown(self, margin: float) -> FloatArray:
        """Return the obstacles with their faces moved outwards by a margin, shape (n, 2, 3)."""
        return np.asarray(self.obstacles + margin * np.array([[-1.0], [1.0]]))

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
        room = f"the room, from {point_text(self.room_low)} to {point_text(self.room_high)}"
        if not ((self.base >= self.room_low).all() and (self.base <= self.room_high).all()):
            raise InputError(f"Expected a base in {room}, got {point_text(self.base)}.")
        if not ((self.goal > self.room_low).all() and (self.goal < self.room_high).all()):
            raise InputError(f"Expected a goal inside {room}, got {point_text(self.goal)}.")
        low, high = self.obstacles[:, 0], self.obstacles[:, 1]
        for what, place, within in (
            ("base", self.base, (self.base > low) & (self.base < high)),
            ("goal", self.goal, (self.goal >= low) & (self.goal <= high)),
        ):
            if within.all(axis=1).any():
                # One of the walls, which come first: the place is not beyond a side of the room.
                box = self.walls[int(np.argmax(within.all(axis=1)))]
                raise InputError(
                    f"Expected a {what} in the free space, got {point_text(place)}, which is in the obstacle "
                    f"from {point_text(box[0])} to {point_text(box[1])}."
                )
        end = self.base + self.straight * self.heading
        if not ((end > self.room_low).all() and (end < self.room_high).all()):
            raise InputError(
                f"Expected a straight stretch of {self.straight:g} from the base {point_text(self.base)} "
                f"that ends inside {room}, got its end at {point_text(end)}."
            )
        along = max(float((self.goal - self.base) @ self.heading), 0.0)
        aside = float(np.linalg.norm(self.base + along * self.heading - self.goal))
        if along < self.straight and aside <= self.goal_radius:
            raise InputError(
                f"Expected a goal off the straight stretch of {self.straight:g} from the base, got "
                f"{point_text(self.goal)} with a radius of {self.goal_radius:g}: the arm meets it before it "
                f"bends."
            )

    def moved(self, way: ArrayLike) -> Workspace:
        """Return the same workspace with everything in it moved by a vector, shape (3,).

        Raises
        ------
        InputError
            If something would lie elsewhere after rounding, like a thin box far from the origin.
        """
        way = np.asarray(way, dtype=np.float64)
        assert self.boxes is not None
        corners = ("low", "high", "window_low", "window_high")
        return dataclasses.replace(
            self,
            **{key: getattr(self, key) + way for key in ("room_low", "room_high", "base", "goal")},
            boxes=self.boxes + way,
            panels=tuple(
                dataclasses.replace(panel, **{key: getattr(panel, key) + way for key in corners})
                for panel in self.panels
            ),
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
            data = read_json(path)
        except FileNotFoundError:
            raise InputError(f"Expected a workspace file at '{path}', but there is none.") from None
        except OSError as error:
            raise InputError(
                f"Expected a workspace file at '{path}' that can be read, got: {error.strerror}."
            ) from None
        except NotReadable as got:
            raise InputError(f"Expected JSON in '{path}', got {got}.") from None
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
            raise InputError(f'Expected a workspace with "type": "{MARK}", got {kind_of(data)}.')
        known = ("type", "name", "units", "room", "panels", "boxes", "base", "goal")
        check_keys(data, "a workspace", known, ("room", "base", "goal"))
        room, base, goal = data["room"], data["base"], data["goal"]
        of_base, of_goal = ("position", "heading", "straight"), ("position", "radius")
        check_keys(room, "the room", ("low", "high", "open"), ("low", "high"))
        check_keys(base, "the base", of_base, of_base)
        check_keys(goal, "the goal", of_goal, of_goal)
        panels, boxes = (list_of(data.get(key, []), key) for key in ("panels", "boxes"))
        return cls(
            name=string_of(data.get("name", default_name), "the name of a workspace"),
            units=string_of(data.get("units", "units"), "the units of a workspace"),
            room_low=room["low"],
            room_high=room["high"],
            open_sides=tuple(list_of(room.get("open", []), "the open sides of the room")),
            panels=tuple(panel_from_dict(one, number) for number, one in enumerate(panels)),
            boxes=np.array([corners_of(one, f"box {number}") for number, one in enumerate(boxes)]),
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
