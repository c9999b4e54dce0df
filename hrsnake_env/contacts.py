"""What touched what: contact records of a run, and the verdict on them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

__all__ = [
    "PINCH_TOLERANCE",
    "Contact",
    "ContactKey",
    "ContactLog",
    "PinchReport",
    "Place",
    "Touch",
    "pinch_report",
]

PINCH_TOLERANCE = 0.001
"""In link lengths: nearer than this to a wall, on either side of its surface, a link pinches it."""

Place = tuple[float, float]
"""x, y in maze units."""


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Record one contact of a link, at its deepest within one pose.

    Parameters
    ----------
    pose : int
        Number of the pose that was being reached; 0 is the pose at reset.
    substep : int
        Within the pose.
    link : int
        From the base end.
    kind : {"pinch", "collision"}
        A collision is deeper than the pinch tolerance.
    wall : int or None
        Index into `Maze.walls`; None for a contact with another link.
    other : int or None
        The other link.
    corner : tuple of two floats, or None
        The corner of the walls that was touched, if one that juts into the free space was.
    point : tuple of two floats
        Where, in maze units.
    clearance : float
        In maze units; negative is the depth.
    impulse : float
        Largest in one substep, in link mass x link length / s; 0 where nothing pushed.
    """

    pose: int
    substep: int
    link: int
    kind: Literal["pinch", "collision"]
    wall: int | None
    other: int | None
    corner: Place | None
    point: Place
    clearance: float
    impulse: float

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain numbers and strings."""
        return dict(vars(self))


@dataclass(slots=True)
class _Entry:
    substep: int
    wall: int
    point: Place
    clearance: float
    impulse: float


ContactKey = tuple[int, int, int, Place | None, bool]
"""Link, other link or -1, wall or -1 (at a corner the walls that meet there are one), corner, and whether
what is solid behind the surface was touched."""


class ContactLog:
    """Collect the contacts of a run, and keep the deepest for each pose, link, and wall or corner.

    Parameters
    ----------
    tolerance : float
        The pinch tolerance in maze units.
    """

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.pose = 0
        self._done: list[Contact] = []
        self._current: dict[ContactKey, _Entry] = {}
        self._closed: tuple[Contact, ...] | None = ()

    def copy(self) -> ContactLog:
        """Return a log that goes on by itself."""
        log = ContactLog(self.tolerance)
        log.pose, log._done = self.pose, self._done.copy()
        log._current = {key: dataclasses.replace(entry) for key, entry in self._current.items()}
        log._closed = self._closed
        return log

    def begin_pose(self, pose: int) -> None:
        """Close the records of the last pose."""
        if self._current:
            self._done.extend(self.current)
            self._current.clear()
            self._closed = ()
        self.pose = pose

    def touch(
        self, key: ContactKey, substep: int, wall: int, point: Place, clearance: float, impulse: float
    ) -> None:
        """Record that a contact has been seen, `wall` being -1 for another link."""
        self._closed = None
        entry = self._current.get(key)
        if entry is None:
            self._current[key] = _Entry(substep, wall, point, clearance, impulse)
            return
        entry.impulse = max(entry.impulse, impulse)
        if clearance < entry.clearance:
            entry.substep, entry.wall, entry.point, entry.clearance = substep, wall, point, clearance

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts so far, in the order of poses."""
        return (*self._done, *self.current)

    @property
    def current(self) -> tuple[Contact, ...]:
        """The contacts of the present pose."""
        if self._closed is None:
            self._closed = tuple(self._close())
        return self._closed

    def _close(self) -> Iterable[Contact]:
        # What is solid behind the surface matters where the surface itself has not told of a collision.
        told = {
            key[0] for key, entry in self._current.items() if not key[4] and entry.clearance < -self.tolerance
        }
        for (link, other, _, corner, solid), entry in self._current.items():
            if solid and link in told:
                continue
            yield Contact(
                pose=self.pose,
                substep=entry.substep,
                link=link,
                kind="collision" if entry.clearance < -self.tolerance else "pinch",
                wall=entry.wall if entry.wall >= 0 else None,
                other=other if other >= 0 else None,
                corner=corner,
                point=entry.point,
                clearance=entry.clearance,
                impulse=entry.impulse,
            )


@dataclass(frozen=True, kw_only=True)
class Touch:
    """Name a wall or a corner that was touched, and how deep at worst.

    Parameters
    ----------
    wall : int
        Index into `Maze.walls`; at a corner one of the walls that meet there.
    corner : tuple of two floats, or None
        In maze units.
    clearance : float
        Smallest of all contacts there, in maze units; negative is the depth.
    """

    wall: int
    corner: Place | None
    clearance: float

    def to_dict(self) -> dict[str, Any]:
        """Return the record as plain numbers."""
        return dict(vars(self))


@dataclass(frozen=True, kw_only=True)
class PinchReport:
    """Say whether links merely pinched the walls in a run, and if not, where they collided.

    Link-poses are counted: each link that is in the maze, in each pose.

    Parameters
    ----------
    n_poses, n_links : int
        Poses of the run, the one at reset included, and links of the arm.
    link_length : float
        In maze units.
    free, pinch, collision : int
        Link-poses without contact, with contacts within the pinch tolerance alone, and with a deeper one.
    worst_depth : float
        In maze units; 0 if no contact was below the surface.
    largest_impulse : float
        In link mass x link length / s; 0 if nothing has pushed.
    node_error : float
        Largest distance of a link's end from where it belonged, in maze units; infinite if the simulation
        broke down.
    drift : float
        Largest gap between joined links, in maze units.
    pinched_links : tuple of int
        Links with a contact within the tolerance.
    pinched_corners : tuple of Touch
        Corners with a contact within the tolerance.
    collisions : tuple of Touch
        Corners and walls that links went into.
    crossed_links : tuple of pairs of int
        Links that went into each other.
    first_collision : Contact or None
        In the order of poses.
    kinematic : PinchReport or None
        The same run with links that no wall pushes: exact distances.
    """

    n_poses: int
    n_links: int
    link_length: float
    free: int
    pinch: int
    collision: int
    worst_depth: float
    largest_impulse: float
    node_error: float
    drift: float
    pinched_links: tuple[int, ...]
    pinched_corners: tuple[Touch, ...]
    collisions: tuple[Touch, ...]
    crossed_links: tuple[tuple[int, int], ...]
    first_collision: Contact | None
    kinematic: PinchReport | None = None

    @property
    def link_poses(self) -> int:
        """How many link-poses were counted."""
        return self.free + self.pinch + self.collision

    @property
    def clean(self) -> bool:
        """Whether nothing collided, no wall pushed, and every link was where it belonged."""
        tolerance = PINCH_TOLERANCE * self.link_length
        here = self.collision == 0 and self.largest_impulse == 0.0
        tracked = self.node_error < tolerance and self.drift < tolerance
        return here and tracked and (self.kinematic is None or self.kinematic.clean)

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain numbers and strings, ready for JSON; None stands for infinity."""
        report = dict(vars(self))
        for key in ("pinched_corners", "collisions"):
            report[key] = [touch.to_dict() for touch in report[key]]
        for key in ("first_collision", "kinematic"):
            report[key] = None if report[key] is None else report[key].to_dict()
        for key in ("node_error", "drift"):
            report[key] = report[key] if math.isfinite(report[key]) else None
        return {"clean": self.clean, **report}


def pinch_report(
    contacts: Iterable[Contact],
    *,
    n_poses: int,
    n_links: int,
    link_poses: int,
    link_length: float,
    node_error: float,
    drift: float,
) -> PinchReport:
    """Sum up the contacts of a run; `link_poses` counts the links in the maze over all poses."""
    contacts = tuple(contacts)
    collided = [contact for contact in contacts if contact.kind == "collision"]
    pinched = [contact for contact in contacts if contact.kind == "pinch"]
    collision_poses, pinch_poses = _link_poses(collided), _link_poses(pinched)
    n_touched = len(collision_poses | pinch_poses)
    return PinchReport(
        n_poses=n_poses,
        n_links=n_links,
        link_length=link_length,
        free=link_poses - n_touched,
        pinch=n_touched - len(collision_poses),
        collision=len(collision_poses),
        worst_depth=max(0.0, *(-contact.clearance for contact in contacts), 0.0),
        largest_impulse=max((contact.impulse for contact in contacts), default=0.0),
        node_error=node_error,
        drift=drift,
        pinched_links=tuple(sorted({link for _, link in _link_poses(pinched)})),
        pinched_corners=_worst_touches(contact for contact in pinched if contact.corner is not None),
        collisions=_worst_touches(contact for contact in collided if contact.wall is not None),
        crossed_links=tuple(sorted({(c.link, c.other) for c in collided if c.other is not None})),
        first_collision=collided[0] if collided else None,
    )


def _link_poses(contacts: Iterable[Contact]) -> set[tuple[int, int]]:
    """Return (pose, link) of all links that are part of a contact."""
    both = [(contact.pose, contact.other) for contact in contacts if contact.other is not None]
    return {(contact.pose, contact.link) for contact in contacts} | set(both)


def _worst_touches(contacts: Iterable[Contact]) -> tuple[Touch, ...]:
    """Keep the deepest contact of each corner, and of each wall away from corners, in order of walls."""
    worst: dict[Any, Contact] = {}
    for contact in contacts:
        place = contact.wall if contact.corner is None else contact.corner
        if place not in worst or contact.clearance < worst[place].clearance:
            worst[place] = contact
    touches = [
        Touch(
            wall=contact.wall if contact.wall is not None else -1,
            corner=contact.corner,
            clearance=contact.clearance,
        )
        for contact in worst.values()
    ]
    return tuple(sorted(touches, key=lambda touch: (touch.wall, touch.corner or (math.inf, math.inf))))
