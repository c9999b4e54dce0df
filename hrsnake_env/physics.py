"""The simulator: rigid links in pymunk, driven by computed torque or gears, among walls of exact shape."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import pymunk
import pymunk.batch
from numpy.typing import ArrayLike

from hrsnake_env.actuation import ACTUATIONS, aim_gears, placed_chain
from hrsnake_env.arguments import check_one_of, is_number
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.contacts import PINCH_TOLERANCE, Contact, ContactLog, PinchReport, pinch_report
from hrsnake_env.dynamics import divide, drive, place_links, read_links, step_targets
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.saved import Move, PhysicsState, SimulationStart
from hrsnake_env.sensing import N_READINGS, N_TIP_RAYS, Senses, cast_rays, read_arm
from hrsnake_env.space import SIM_LINK, TOLERANCE, ArmSpace, WallShapes
from hrsnake_env.walls import Frame, has_thin_walls, wall_pieces

__all__ = ["CONTROL_TIMESTEP", "RAY_REACH", "Physics"]

CONTROL_TIMESTEP = 0.05
"""In s: the time from one pose to the next."""

THICK_MOVE = 0.052
THIN_MOVE = 0.013
"""In link lengths: no joint moves farther in one substep, so that no wall is jumped unseen; the second among
walls thinner than the thickest solid layer, of which any of 0.011 is met."""

RAY_REACH = 2.0
"""Length of the longest rays, in link lengths."""

SLOT_TOLERANCES = 4.0
"""The walls are open for the feeder by so many pinch tolerances more than a link is wide, on each side."""

N_STATIC = 2
"""Bodies that are no links: the one of the walls and, of a dynamic arm, the feeder's rail."""

STATE = (
    pymunk.batch.BodyFields.POSITION
    | pymunk.batch.BodyFields.ANGLE
    | pymunk.batch.BodyFields.VELOCITY
    | pymunk.batch.BodyFields.ANGULAR_VELOCITY
)
POSES = pymunk.batch.BodyFields.POSITION | pymunk.batch.BodyFields.ANGLE
_IDLE: list[tuple[pymunk.batch.Buffer, pymunk.batch.Buffer]] = []
"""Buffers of simulators that are no more, for the next ones: pymunk does not free what they have."""

FORCES = pymunk.batch.BodyFields.FORCE | pymunk.batch.BodyFields.TORQUE


class Physics:
    """Simulate an arm in a maze; lengths are in maze units, angles in rad, masses in link masses.

    Links are dynamic bodies. In each substep every link gets the force that takes it to its place in the
    next one; these forces equal joint torques and a feed force. Walls push back on what is deeper in them
    than the pinch tolerance. The arm is one substep behind its target, as the simulator moves bodies
    before it changes velocities; `node_error` allows for this.

    Parameters
    ----------
    maze : Maze
        The maze.
    arm : ArmSpec
        With `n_links`.
    substeps : int
        Simulated steps from pose to pose; more where a joint moves too far in one.
    kinematic : bool
        Place the links at their targets, whatever is in the way: contacts are then exact, nothing pushes.
    torque_limit : float, optional
        Each joint torque is cut to it, in link mass x link length^2 / s^2; the arm then falls behind where
        it is too weak. None means no limit. Joints in the feeder are held by the feeder.
    actuation : {"computed_torque", "gear"}
        "gear": a servo in each joint turns its link to the target, and no force pushes the links. This needs
        links that get lighter from base to tip and are hard to turn, so torques and forces mean nothing (they
        read 0), impulses are in masses of the touched link, and walls lose: a link sinks into a wall by
        about 90 % of what it is sent. Use it to see what joint servos alone do. Unused if `kinematic`.

    Raises
    ------
    InputError
        If an argument is out of its range.
    """

    def __init__(
        self,
        maze: Maze,
        arm: ArmSpec,
        *,
        substeps: int = 4,
        kinematic: bool = False,
        torque_limit: float | None = None,
        actuation: str = "computed_torque",
    ) -> None:
        if arm.n_links is None:
            raise InputError("Expected an arm with a number of links (n_links), got None.")
        if isinstance(substeps, bool) or not isinstance(substeps, int | np.integer) or substeps < 1:
            raise InputError(f"Expected substeps to be a whole number of at least 1, got {substeps!r}.")
        if torque_limit is not None and not (is_number(torque_limit) and torque_limit > 0.0):
            raise InputError(f"Expected a positive torque_limit, or None, got {torque_limit!r}.")
        check_one_of("actuation", actuation, tuple(ACTUATIONS))
        if actuation == "gear" and torque_limit is not None:
            raise InputError(f"Expected no torque_limit with actuation 'gear', got {torque_limit!r}.")
        self.maze, self.arm, self.substeps, self.kinematic = maze, arm, int(substeps), kinematic
        self._actuation = actuation
        self.n_links, self.link_length = int(arm.n_links), arm.link_length
        self._torque_limit = math.inf if torque_limit is None else float(torque_limit) * SIM_LINK**2
        x, y, heading = (float(value) for value in maze.base_pose)
        self._frame = Frame(base_pose=(x, y, heading), scale=SIM_LINK / arm.link_length)
        self._scale, self._radius = self._frame.scale, arm.link_radius * self._frame.scale
        slot = self._radius + SLOT_TOLERANCES * TOLERANCE
        self._pieces = wall_pieces(maze, self._frame, SIM_LINK, slot, (self.n_links + 1) * SIM_LINK)
        self._surface = np.array(
            [(*piece.start, *piece.end) for piece in self._pieces if piece.radius == 0.0]
        )
        self._largest_move = SIM_LINK * (THIN_MOVE if has_thin_walls(self._pieces, SIM_LINK) else THICK_MOVE)
        self._wall_shapes = WallShapes(self._pieces)
        self._allocate()
        self._untouched_at: FloatArray | None = None
        self.reset()

    def _allocate(self) -> None:
        n = self.n_links
        self._targets = np.zeros((self.substeps, 1 + n))
        self._target, self._last_target = np.zeros(1 + n), np.zeros(1 + n)
        self._all_poses = np.zeros((n + N_STATIC, 3))
        self._poses = self._all_poses[:n]
        self._nodes, self._last_nodes, self._sim_joints = (np.zeros((n + 1, 2)) for _ in range(3))
        # pymunk's batches hold static bodies as well, after the links; short of numbers, it takes what comes
        # next in memory.
        self._state, self._forces = np.zeros((n, 6)), np.zeros((n + N_STATIC, 3))
        self._torques, self._effort, self._tracking = np.zeros(n), np.zeros(1 + n), np.zeros(4)
        self._frame_numbers = np.array([*self._frame.base_pose, self._scale])
        self._senses = Senses(np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(N_READINGS))
        self._rays = np.zeros(N_TIP_RAYS + 2 * n)
        self._reader, self._writer = _IDLE.pop() if _IDLE else (pymunk.batch.Buffer(), pymunk.batch.Buffer())
        self._writer.set_float_buf((self._all_poses if self.kinematic else self._forces).reshape(-1))

    def __del__(self) -> None:
        """Give back what pymunk would keep: the space for long, buffers for ever."""
        if hasattr(self, "_space"):
            self._space.close()
        if hasattr(self, "_reader"):
            _IDLE.append((self._reader, self._writer))

    # Running

    def reset(self, feed: float = 0.0, joint_angles: ArrayLike | None = None) -> None:
        """Put the arm at rest into a configuration, by default wholly into the feeder.

        The simulator is built afresh: one that was used would not repeat an episode to the last bit.

        Parameters
        ----------
        feed : float
            In maze units.
        joint_angles : array-like, shape (n_links,), optional
            In rad. By default the arm is straight.
        """
        angles = np.zeros(self.n_links) if joint_angles is None else joint_angles
        target = self._as_target(feed, angles)
        step_targets(target, target, SIM_LINK, self._targets)
        target = self._targets[-1].copy()
        if self._untouched_at is not None and np.array_equal(self._untouched_at, target):
            return  # just built, and there already
        links = np.zeros((self.n_links, 6))
        place_links(target, SIM_LINK, self._poses, self._nodes)
        links[:, :3] = self._poses
        n_held = self._held(target[0])
        self._begin(
            SimulationStart(
                links=links,
                target=target,
                last_target=target,
                touched=np.full(self.n_links, math.inf),
                effort=np.zeros(1 + self.n_links),
                n_efforts=0,
                tracking=np.zeros(4),
                pose=0,
                n_held=n_held,
                n_active=self.n_links - max(n_held - 1, 0),
                past_link_poses=0,
                log=ContactLog(PINCH_TOLERANCE * self.link_length),
            )
        )
        self._check_order()
        if self.kinematic:
            self._substep(0, target)
        self._untouched_at = target

    def _begin(self, start: SimulationStart) -> None:
        """Build the simulator afresh, and put the arm where it starts."""
        self._start, self._moves, self._untouched_at = start, list[Move](), None
        self._target[:], self._last_target[:], self._effort[:] = start.target, start.last_target, start.effort
        self._n_efforts, self._n_held, self.pose = start.n_efforts, start.n_held, start.pose
        self._n_active, self._past_link_poses = start.n_active, start.past_link_poses
        self._log = start.log.copy()
        place_links(start.target, SIM_LINK, self._poses, self._nodes)
        self._last_nodes[:] = self._nodes
        build = placed_chain if self.kinematic else ACTUATIONS[self._actuation]
        self._chain = build(self.n_links, SIM_LINK)
        last = getattr(self, "_space", None)
        self._space = ArmSpace(
            self._wall_shapes,
            self._chain,
            start.links,
            self._radius,
            log=self._log,
            frame=self._frame,
            walls=self.maze.walls,
        )
        if last is not None:
            last.close()
        self._space.clearances[:] = start.touched
        self._space.n_held = start.n_held
        self._space.activate_links(max(start.n_held - 1, 0))
        self._read()
        self._tracking[:] = start.tracking

    def advance(self, feed: float, joint_angles: ArrayLike) -> None:
        """Move on to the next pose; in between the targets change linearly.

        Joints that have not passed the base are held straight by the feeder.

        Parameters
        ----------
        feed : float
            In maze units.
        joint_angles : array-like, shape (n_links,)
            In rad.
        """
        self._move("advance", self._as_target(feed, joint_angles))

    def advance_to(self, target: FloatArray) -> None:
        """Move on as `advance` does, without a check.

        Parameters
        ----------
        target : array, shape (1 + n_links,)
            Feed and joint angles, finite, in maze units and rad; not kept.
        """
        end = target.copy()
        end[0] *= self._scale
        self._move("advance", end)

    def take_back(self) -> None:
        """Take the targets back to where the arm is: what walls have refused is forgotten."""
        self._move("take_back", None)

    def settle(self) -> None:
        """Take one more substep, so that the links arrive where they were last sent."""
        self._move("settle", None)

    def _move(self, kind: Literal["advance", "take_back", "settle"], end: FloatArray | None) -> None:
        self._moves.append((kind, end))
        self._untouched_at = None
        if kind == "take_back":
            here = np.concatenate([[self.feed * self._scale], self.joint_angles])
            step_targets(here, here, SIM_LINK, self._targets)
            self._target[:] = self._targets[-1]
        elif kind == "settle":
            if not self.kinematic:
                self._substep(self.substeps, self._target)
        elif end is not None:
            self._advance(end)

    def _advance(self, end: FloatArray) -> None:
        targets = self._targets
        parts = divide(self._target, end, SIM_LINK, self._largest_move, targets)
        if parts > 1:
            targets = np.empty((self.substeps * parts, 1 + self.n_links))
            step_targets(self._target, end, SIM_LINK, targets)
        self._begin_pose()
        for number, target in enumerate(targets):
            self._substep(number, target)
        self._target[:] = targets[-1]

    def _substep(self, number: int, target: FloatArray) -> None:
        if not self.finite:
            return  # pymunk's own checks would end the process
        self._nodes, self._last_nodes = self._last_nodes, self._nodes
        self._space.substep = number
        self._feed_links(target.item(0))
        timestep = CONTROL_TIMESTEP / self.substeps
        if not self.kinematic and self._actuation == "computed_torque":
            drive(
                target,
                self._last_target,
                self._state,
                SIM_LINK,
                timestep,
                self._torque_limit,
                self._n_held,
                self._poses,
                self._nodes,
                self._forces,
                self._torques,
                self._effort,
            )
            self._n_efforts += 1
            pymunk.batch.set_space_bodies(self._space.space, FORCES, self._writer)
        else:
            place_links(target, SIM_LINK, self._poses, self._nodes)
            if self.kinematic:
                pymunk.batch.set_space_bodies(self._space.space, POSES, self._writer)
            else:
                aim_gears(self._chain, self._last_target, target, SIM_LINK, timestep)
        self._last_target[:] = target
        self._space.step(timestep)
        self._read()

    def _held(self, feed: float) -> int:
        """Return how many joints the feeder holds; `feed` in simulator units."""
        n_held = math.floor(self.n_links - feed / SIM_LINK) + 1
        return self.n_links if n_held > self.n_links else max(n_held, 0)

    def _feed_links(self, feed: float) -> None:
        """Let links collide as soon as their tip end has passed the base."""
        n_held = self._held(feed)
        # Dynamic links are still where their last target has sent them.
        self._space.n_held = n_held if self.kinematic or n_held > self._n_held else self._n_held
        first_active = n_held - 1 if n_held > 0 else 0
        if n_held != self._n_held:
            self._n_held = n_held
            self._space.activate_links(first_active)
        if self.n_links - first_active > self._n_active:
            self._n_active = self.n_links - first_active

    def _read(self) -> None:
        """Read all bodies, and compare them with where they belong."""
        self._sensed = self._cast = False
        self._reader.clear()
        pymunk.batch.get_space_bodies(self._space.space, STATE, self._reader)
        numbers = np.frombuffer(self._reader.float_buf())
        nodes = self._nodes if self.kinematic else self._last_nodes
        read_links(numbers, nodes, SIM_LINK, self._state, self._sim_joints, self._tracking)
        if not self._space.finite:
            self._tracking[:] = math.inf

    def _begin_pose(self) -> None:
        self.pose += 1
        self._log.begin_pose(self.pose)
        self._space.clearances.fill(math.inf)
        if self.finite:
            self._tracking[0] = self._tracking[1] = 0.0
        self._effort.fill(0.0)
        self._n_efforts = 0
        self._past_link_poses += self._n_active
        self._n_active = 0

    # Saving and restoring

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy is made from: pymunk's objects are built again."""
        options = {name: getattr(self, name) for name in ("maze", "arm", "substeps", "kinematic")}
        limit = None if math.isinf(self._torque_limit) else self._torque_limit / SIM_LINK**2
        options |= {"torque_limit": limit, "actuation": self._actuation}
        return {"options": options, "state": self.get_state()}

    def __setstate__(self, saved: dict[str, Any]) -> None:
        """Build the simulator of a copy, and go to where it stood."""
        self.__init__(**saved["options"])  # type: ignore[misc]
        self.set_state(saved["state"])

    def get_state(self) -> PhysicsState:
        """Return where the simulation stands; it goes on undisturbed."""
        return PhysicsState(start=self._start, moves=tuple(self._moves))

    def set_state(self, state: PhysicsState) -> None:
        """Go back to a state of an arm with as many links in the same maze, exactly."""
        if len(state.start.links) != self.n_links:
            raise InputError(
                f"Expected a state of an arm of {self.n_links} links, got one of {len(state.start.links)}."
            )
        self._begin(state.start)
        for kind, end in state.moves:
            self._move(kind, end)

    def snapshot(self) -> PhysicsState:
        """Return a state that is quick to go back to, and go on from it.

        The simulator is built afresh at once, so that what follows now and what follows on `set_state` is
        the same to the last bit. It may differ in the last digits from what would have followed without.
        """
        self._begin(
            SimulationStart(
                links=self._state.copy(),
                target=self._target.copy(),
                last_target=self._last_target.copy(),
                touched=self._space.clearances.copy(),
                effort=self._effort.copy(),
                n_efforts=self._n_efforts,
                tracking=self._tracking.copy(),
                pose=self.pose,
                n_held=self._n_held,
                n_active=self._n_active,
                past_link_poses=self._past_link_poses,
                log=self._log.copy(),
            )
        )
        return self.get_state()

    def _as_target(self, feed: float, joint_angles: ArrayLike) -> FloatArray:
        angles = np.asarray(joint_angles, dtype=np.float64)
        if angles.shape != (self.n_links,):
            raise InputError(f"Expected joint_angles with shape ({self.n_links},), got {angles.shape}.")
        target = np.empty(1 + self.n_links)
        target[0], target[1:] = feed * self._scale, angles
        if not math.isfinite(target.sum()):
            raise InputError("Expected a finite feed and finite joint_angles, got NaN or infinity.")
        return target

    def _check_order(self) -> None:
        """Make sure that pymunk's batches hold the links in our order, then what stands at the origin."""
        states = np.frombuffer(self._reader.float_buf()).reshape(-1, 6)
        assert len(states) <= self.n_links + N_STATIC
        assert np.array_equal(states[: self.n_links], self._start.links)
        assert not states[self.n_links :].any()

    # Readings

    @property
    def joints(self) -> FloatArray:
        """Joint positions, base end first, shape (n_links + 1, 2), in maze units."""
        return self._frame.to_maze(self._sim_joints)

    @property
    def target(self) -> FloatArray:
        """Where feed and joint angles were last sent, shape (1 + n_links,), in maze units and rad."""
        target: FloatArray = self._target.copy()
        target[0] /= self._scale
        return target

    @property
    def target_joints(self) -> FloatArray:
        """Where the joints were last sent, shape (n_links + 1, 2), in maze units."""
        return self._frame.to_maze(self._nodes)

    @property
    def tip_position(self) -> FloatArray:
        """The tip, shape (2,), in maze units."""
        return self.sense().readings[1:3].copy()

    @property
    def tip_heading(self) -> float:
        """Heading of the last link, in rad."""
        return float(self.sense().readings[3])

    @property
    def feed(self) -> float:
        """Length of arm pushed past the base, in maze units."""
        return float(self.sense().readings[0])

    @property
    def joint_angles(self) -> FloatArray:
        """Joint angles, shape (n_links,), in rad."""
        return self.sense().joint_angles.copy()

    @property
    def feed_speed(self) -> float:
        """In maze units / s."""
        return float(self.sense().readings[4])

    @property
    def joint_speeds(self) -> FloatArray:
        """Speeds of the joint angles, shape (n_links,), in rad / s."""
        return self.sense().joint_speeds.copy()

    def sense(self) -> Senses:
        """Return what the arm senses, in arrays that the next pose overwrites."""
        if not self._sensed:
            read_arm(
                self._state,
                self._sim_joints,
                self._n_held,
                self._surface,
                SIM_LINK,
                self._radius,
                self._space.clearances,
                self._frame_numbers,
                *self._senses,
            )
            self._sensed = True
        return self._senses

    def cast_rays(self) -> FloatArray:
        """Return how far it is to the walls, in an array that the next pose overwrites.

        Returns
        -------
        rays : array, shape (N_TIP_RAYS + 2 * n_links,)
            In shares of `RAY_REACH` link lengths; see `hrsnake_env.sensing.cast_rays`.
        """
        if not self._cast:
            reach = RAY_REACH * SIM_LINK
            cast_rays(self._state, self._sim_joints, self._n_held, self._surface, reach, self._rays)
            self._cast = True
        return self._rays

    @property
    def torques(self) -> FloatArray:
        """Mean joint torques within the last pose, shape (n_links,), in link mass x link length^2 / s^2.

        0 for joints in the feeder, and on gears.
        """
        return self._effort[1:] / (max(self._n_efforts, 1) * SIM_LINK**2)

    @property
    def feed_force(self) -> float:
        """Mean force along the feeder within the last pose, in link mass x link length / s^2; 0 on gears."""
        return float(self._effort[0]) / (max(self._n_efforts, 1) * SIM_LINK)

    @property
    def node_error(self) -> float:
        """Largest distance of a link's end from where it belonged, within the last pose, in maze units."""
        return float(self._tracking[0]) / self._scale

    @property
    def drift(self) -> float:
        """Largest gap between joined links within the last pose, in maze units."""
        return float(self._tracking[1]) / self._scale

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite; a simulation that has broken down stands still."""
        return math.isfinite(self._tracking.item(2))

    @property
    def clearance(self) -> FloatArray:
        """Clearance of each link to the walls, shape (n_links,), in maze units.

        Exact where it is positive, at most one link length, and that in the feeder; to a link that is leaving
        the feeder, walls behind the base are no matter. Where a link has touched
        something within the last pose, the smallest clearance of the contacts, negative below the surface.
        """
        return self.sense().clearances.copy()

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts since the reset."""
        return self._log.contacts

    @property
    def pose_contacts(self) -> tuple[Contact, ...]:
        """The contacts within the last pose."""
        return self._log.current

    def report(self) -> PinchReport:
        """Sum up the contacts since the reset."""
        return pinch_report(
            self.contacts,
            n_poses=self.pose + 1,
            n_links=self.n_links,
            link_poses=self._past_link_poses + self._n_active,
            link_length=self.link_length,
            node_error=float(self._tracking[2]) / self._scale,
            drift=float(self._tracking[3]) / self._scale,
        )
