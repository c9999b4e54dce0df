"""The simulator's space: links, joints and walls in pymunk, and the callbacks that see what touches."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pymunk

from hrsnake_env.actuation import Chain
from hrsnake_env.arm import FloatArray
from hrsnake_env.contacts import PINCH_TOLERANCE, ContactKey, ContactLog, Place
from hrsnake_env.walls import Frame, WallPiece

__all__ = ["SIM_LINK", "TOLERANCE", "ArmSpace", "WallShapes"]

SIM_LINK = 230.0
"""Length of a link in simulator units, whatever the maze's: pymunk's tolerances then always mean the same."""

TOLERANCE = PINCH_TOLERANCE * SIM_LINK
LINK, WALL = 1, 2
WALL_CATEGORY = 1 << 31
N_CATEGORIES = 30
EVERYTHING = pymunk.ShapeFilter.ALL_MASKS()
IN_FEEDER = pymunk.ShapeFilter(mask=0)


class WallShapes:
    """Hold the walls for pymunk: made once, they go from each space to the next.

    Walls have no memory, unlike bodies and constraints, so that a space with them is as good as new.

    Parameters
    ----------
    pieces : sequence of WallPiece
        In simulator units.
    """

    def __init__(self, pieces: Sequence[WallPiece]) -> None:
        # Not the space's own static body: a joint's anchor would switch off its contacts.
        self._body = pymunk.Body(body_type=pymunk.Body.STATIC)
        self._space: pymunk.Space | None = None
        self.pieces: dict[pymunk.Shape, tuple[WallPiece, float]] = {}
        """What each shape stands for, and how much farther off than its piece's surface it seems."""
        category = pymunk.ShapeFilter(categories=WALL_CATEGORY)
        for piece in pieces:
            # No `set_neighbors`: it drops contacts at the ends of walls (measured: of 18,771 links at or
            # across the walls of fig19, 1,427 went unnoticed with it, and none without).
            # What is solid behind the surface begins two tolerances below it, and so is touched by a
            # collision alone: a pinch is seen once.
            radius = max(piece.radius - 2.0 * TOLERANCE, 0.0)
            shape = pymunk.Segment(self._body, piece.start, piece.end, radius)
            shape.collision_type, shape.filter = WALL, category
            self.pieces[shape] = (piece, TOLERANCE - (piece.radius - radius))

    def enter(self, space: pymunk.Space) -> None:
        """Stand in a space, and no longer in the last one."""
        if self._space is not None:
            self._space.remove(*self.pieces, self._body)
        space.add(self._body, *self.pieces)
        self._space = space


class ArmSpace:
    """Hold a fresh pymunk space with an arm among walls, and record its contacts.

    Links are a little wider than they are, by the pinch tolerance, so that a contact is seen before it is
    one. What is within the tolerance is recorded and disturbs nothing.

    Parameters
    ----------
    wall_shapes : WallShapes
        The walls.
    chain : Chain
        The arm's links and joints.
    links : array, shape (n_links, 6)
        Centre, heading, velocity and angular velocity of each link, in simulator units, rad and s.
    radius : float
        Of the links, in simulator units.
    log : ContactLog
        Where contacts are recorded.
    frame : Frame
        The simulator's frame.
    walls : array, shape (n_walls, 2, 2)
        The walls of the maze, in maze units.
    """

    def __init__(
        self,
        wall_shapes: WallShapes,
        chain: Chain,
        links: FloatArray,
        radius: float,
        *,
        log: ContactLog,
        frame: Frame,
        walls: FloatArray,
    ) -> None:
        self.space = pymunk.Space()
        self.space.iterations = chain.iterations
        # A processed contact is pushed back to the tolerance, and not beyond.
        self.space.collision_slop = 2.0 * TOLERANCE
        self.n_held = len(links)
        self._first_active = len(links)
        self.substep = 0
        self.clearances = np.full(len(links), math.inf)
        self._log, self._frame, self._maze_walls, self._radius = log, frame, walls, radius
        self.finite = True
        self._error: Exception | None = None
        self._masses = [link.mass for link in chain.links]
        self._links: dict[pymunk.Shape, int] = {}
        self._walls = wall_shapes.pieces
        self._pressed: dict[tuple[pymunk.Shape, pymunk.Shape], tuple[ContactKey, int, Place, float]] = {}
        for k, state in enumerate(links.tolist()):
            self._add_link(k, chain.links[k], state)
        self.space.add(*chain.rest)
        wall_shapes.enter(self.space)
        self.space.on_collision(LINK, WALL, pre_solve=self._before_wall, post_solve=self._after)
        self.space.on_collision(LINK, LINK, pre_solve=self._before_link, post_solve=self._after)

    def step(self, timestep: float) -> None:
        """Simulate one substep."""
        if self._pressed:
            self._pressed.clear()
        self.space.step(timestep)
        if self._error is not None:
            raise RuntimeError("A contact could not be recorded.") from self._error

    def activate_links(self, first_active: int) -> None:
        """Let the links from `first_active` on collide, and no others."""
        if first_active == self._first_active:
            return
        for shape, k in self._links.items():
            if k < first_active:
                shape.filter = IN_FEEDER
            elif k < self._first_active:
                shape.filter = _link_filter(k)
        self._first_active = first_active

    def close(self) -> None:
        """Give back the memory that pymunk's space has outside Python.

        pymunk's objects know themselves by handles, and are rings that way: Python looks for those when very
        many objects have gathered, and sees nothing of the third of a mebibyte that a space has.
        """
        with self.space._space:  # cffi calls what frees it
            pass
        del self.space

    # Building

    def _add_link(self, k: int, body: pymunk.Body, state: list[float]) -> None:
        x, y, body.angle, speed_x, speed_y, body.angular_velocity = state
        body.position, body.velocity = (x, y), (speed_x, speed_y)
        half = SIM_LINK / 2.0
        shape = pymunk.Segment(body, (-half, 0.0), (half, 0.0), self._radius + TOLERANCE)
        shape.collision_type, shape.filter = LINK, IN_FEEDER
        self.space.add(body, shape)
        self._links[shape] = k

    # Callbacks: they record, and never raise, as pymunk prints exceptions and forgets them.

    def _before_wall(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        try:
            arbiter.process_collision = self._see_wall(arbiter) < -TOLERANCE
        except Exception as error:
            self._error = error

    def _before_link(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        try:
            arbiter.process_collision = self._see_link(arbiter) < -TOLERANCE
        except Exception as error:
            self._error = error

    def _after(self, arbiter: pymunk.Arbiter, space: pymunk.Space, data: object) -> None:
        try:
            key, wall, place, clearance = self._pressed[arbiter.shapes]
            # Of two links the outer one's mass: the first link may be immovable.
            impulse = arbiter.total_impulse.length / SIM_LINK / self._masses[max(key[0], key[1])]
            self._log.touch(key, self.substep, wall, place, clearance, impulse)
        except Exception as error:
            self._error = error

    def _see_wall(self, arbiter: pymunk.Arbiter) -> float:
        """Record a contact with a wall; return its clearance in simulator units."""
        link_shape, wall_shape = shapes = arbiter.shapes
        link, (piece, margin) = self._links[link_shape], self._walls[wall_shape]
        contacts = arbiter.contact_point_set
        point, distance = self._deepest(contacts, from_base_on=link < self.n_held)
        if point is None:
            return math.inf
        clearance = distance + margin
        corner = None
        if piece.radius == 0.0:
            corner, inner = self._corner(piece, point)
            if inner and clearance + self._radius > 0.0 and _is_behind(piece, contacts.normal):
                clearance = -clearance - 2.0 * self._radius
        key = (link, -1, piece.wall if corner is None else -1, corner, piece.radius > 0.0)
        self._record(shapes, key, piece.wall, point, clearance)
        return clearance

    def _see_link(self, arbiter: pymunk.Arbiter) -> float:
        """Record a contact between links; return its clearance in simulator units."""
        shapes = arbiter.shapes
        a, b = sorted(self._links[shape] for shape in shapes)
        point, distance = self._deepest(arbiter.contact_point_set, from_base_on=a < self.n_held)
        clearance = distance + 2.0 * TOLERANCE
        if point is None or clearance > TOLERANCE:
            return math.inf
        self._record(shapes, (a, b, -1, None, False), -1, point, clearance)
        self.clearances[b] = min(self.clearances[b], clearance)
        return clearance

    def _record(
        self,
        shapes: tuple[pymunk.Shape, pymunk.Shape],
        key: ContactKey,
        wall: int,
        point: Place,
        clearance: float,
    ) -> None:
        self.clearances[key[0]] = min(self.clearances[key[0]], clearance)
        place, depth = self._frame.place_in_maze(point), clearance / self._frame.scale
        self._log.touch(key, self.substep, wall, place, depth, 0.0)
        if clearance < -TOLERANCE:
            self._pressed[shapes] = (key, wall, place, depth)

    def _deepest(self, contacts: pymunk.ContactPointSet, *, from_base_on: bool) -> tuple[Place | None, float]:
        """Return the deepest point of a contact, on the second shape, and its distance.

        Of a link that is still in the feeder only what lies in front of the base is in the maze.
        """
        place, deepest = None, math.inf
        for contact in contacts.points:
            point, distance = contact.point_b, contact.distance
            self.finite = self.finite and math.isfinite(distance)
            if distance < deepest and (not from_base_on or point[0] >= 0.0):
                place, deepest = (point[0], point[1]), distance
        return place, deepest

    def _corner(self, piece: WallPiece, point: Place) -> tuple[Place | None, bool]:
        """Return the corner at a point of the surface, and whether the point is away from its wall's ends."""
        for end, juts, index in ((piece.start, piece.start_juts, 0), (piece.end, piece.end_juts, 1)):
            if math.hypot(point[0] - end[0], point[1] - end[1]) <= TOLERANCE:
                x, y = self._maze_walls[piece.wall, index]
                return ((float(x), float(y)) if juts else None), False
        return None, True


def _link_filter(k: int) -> pymunk.ShapeFilter:
    """Let a link meet walls and all links but its neighbours (and, with 30 bits, those 29 or 31 off)."""
    neighbours = 1 << ((k - 1) % N_CATEGORIES) | 1 << ((k + 1) % N_CATEGORIES)
    return pymunk.ShapeFilter(categories=1 << (k % N_CATEGORIES), mask=EVERYTHING & ~neighbours)


def _is_behind(piece: WallPiece, normal: tuple[float, float]) -> bool:
    """Whether a link, from which `normal` points to the wall, lies beyond the surface."""
    into_x, into_y = piece.end[1] - piece.start[1], piece.start[0] - piece.end[0]
    return normal[0] * into_x + normal[1] * into_y < 0.0
