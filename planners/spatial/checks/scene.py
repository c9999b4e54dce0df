"""What all checks look at: the motion, the obstacles, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arm import FloatArray
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING
from planners.problem import Fault
from planners.spatial.checks.turning import third_derivatives
from planners.spatial.kinematics import joints_from_configuration
from planners.spatial.problem import SpatialMotion
from planners.spatial.workspace import Workspace

PLACE_SLACK = 1e-6
"""How far joints may be from where configuration, feeder and start put them, in link lengths."""

MAX_SPLITS = 14
"""How often a piece between two poses is halved before it counts as not bounded."""

MAX_PIECES = 100_000
"""How many pieces there may be at a time before the rest counts as not bounded."""

CELLS = 200_000
"""How many pairs, of links and boxes or of links, are looked at together."""

CUBIC = 3.0**0.5 / 216.0
"""Largest |t (t - 1/2) (t - 1)| / 6 on [0, 1]: what a third derivative of 1 adds to a parabola."""

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Moves:
    """Hold n links on their way from one time to another.

    Parameters
    ----------
    before, after, middle : array, shape (n, 2, 3)
        Both ends in the workspace at the first time, at the last and half way.
    astray : array, shape (n,)
        How far points of the link may be from a segment whose ends go straight from `before` to `after`.
    even : array of bool, shape (n,)
        Whether these ends move evenly; if not, one comes out of the feeder on the way.
    """

    before: FloatArray
    after: FloatArray
    middle: FloatArray
    astray: FloatArray
    even: BoolArray

    @property
    def ways(self) -> FloatArray:
        """How far points of the segments move, from the first time to any and on to the last; shape (n,)."""
        way = np.linalg.norm(self.after - self.before, axis=2)
        return np.asarray(np.where(self.even, way.max(axis=1), way.sum(axis=1)))


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Hold the motion, the obstacles, and what follows from them."""

    motion: SpatialMotion
    workspace: Workspace
    radius: float

    @property
    def length(self) -> float:
        """The link length, in workspace units."""
        return self.motion.link_length

    @property
    def boxes(self) -> FloatArray:
        """The obstacles, shape (n_boxes, 2, 3)."""
        obstacles: FloatArray = self.workspace.obstacles
        return obstacles

    @property
    def tolerance(self) -> float:
        """The largest depth between two poses, in workspace units."""
        return PINCH_TOLERANCE * self.length

    @cached_property
    def tolerances(self) -> FloatArray:
        """The largest depth in each obstacle between two poses, in workspace units, shape (n_boxes,).

        In a thin wall depths are small even where a link passes right through it.
        """
        thinnest = np.ptp(self.boxes, axis=1).min(axis=1, initial=np.inf)
        return np.asarray(np.minimum(self.tolerance, thinnest / 8.0))

    @cached_property
    def slack(self) -> float:
        """What counts as rounding where places in the workspace are compared, in workspace units."""
        size = np.abs(self.boxes).max(initial=0.0)
        return ROUNDING * self.length + 100.0 * float(np.finfo(np.float64).eps * size)

    @cached_property
    def far(self) -> float:
        """What rounding of coordinates makes of a length: some units in their last place."""
        return 4.0 * float(np.finfo(np.float64).eps * np.abs(self.motion.joints).max())

    @property
    def length_slack(self) -> float:
        """How far an exact link may be off its length, in workspace units."""
        return ROUNDING * self.length + self.far

    @property
    def place_slack(self) -> float:
        """How far joints may be from where configuration, feeder and start put them (workspace units)."""
        return PLACE_SLACK * self.length + self.far

    @cached_property
    def arc(self) -> FloatArray:
        """How far past the base each joint is along the arm, shape (n_poses, n_links + 1)."""
        return self.arc_from_feed(self.motion.feed)

    def arc_from_feed(self, feed: FloatArray) -> FloatArray:
        """Compute how far past the base each joint is along the arm, shape (n,) -> (n, n_links + 1)."""
        n_links = self.motion.n_links
        return np.asarray(feed[:, None] - (n_links - np.arange(n_links + 1)) * self.length)

    def in_workspace(self, joints: FloatArray, arc: FloatArray) -> FloatArray:
        """Put the joints behind the base, shape (..., 3), at the base point."""
        return np.where(arc[..., None] < 0.0, self.motion.base_pose[:3], joints)

    @cached_property
    def placed(self) -> FloatArray:
        """The joints where feed and joint angles put them, shape (n_poses, n_links + 1, 3)."""
        motion = self.motion
        return joints_from_configuration(motion.feed, motion.joint_angles, self.length, motion.base_pose)

    @cached_property
    def halfway(self) -> tuple[FloatArray, FloatArray]:
        """Joints and arcs half way after each pose, shape (n_steps, n_links + 1, 3) and without the 3."""
        motion = self.motion
        feed = (motion.feed[:-1] + motion.feed[1:]) / 2.0
        angles = (motion.joint_angles[:-1] + motion.joint_angles[1:]) / 2.0
        joints = joints_from_configuration(feed, angles, self.length, motion.base_pose)
        return joints, self.arc_from_feed(feed)

    @cached_property
    def third(self) -> FloatArray:
        """Bounds on the third derivatives of places after each pose, shape (n_steps, n_links + 1).

        A single pose counts as a step that stands still.
        """
        if self.motion.n_poses == 1:
            return np.zeros((1, self.motion.n_links + 1))
        return self.length * third_derivatives(self.motion.joint_angles)

    def steps(self, first: int, last: int) -> Moves:
        """Return the moves of all links after the poses from `first` to before `last`, pose by pose."""
        n_links = self.motion.n_links
        step, link = np.divmod(np.arange((last - first) * n_links), n_links)
        return self.moves(first + step, link, np.tile((0.0, 1.0), (len(step), 1)))

    def moves(self, step: IntArray, link: IntArray, time: FloatArray) -> Moves:
        """Compute the moves of links, shape (n,), over times after poses, shape (n, 2), in [0, 1]."""
        both = np.stack([link, link + 1], axis=1)
        cubic = CUBIC * self.third[step[:, None], both] * np.ptp(time, axis=1)[:, None] ** 3
        if (time == (0.0, 1.0)).all():
            rows, after = step[:, None], step[:, None] + 1
            places = [self.placed[rows, both], self.placed[after, both], self.halfway[0][rows, both]]
            arcs = [self.arc[rows, both], self.arc[after, both], self.halfway[1][rows, both]]
            return self._moves(places, arcs, cubic)
        times = np.stack([time[:, 0], time[:, 1], time.mean(axis=1)])
        found = [self.ends(step, link, moment) for moment in times]
        return self._moves([joints for joints, _ in found], [arc for _, arc in found], cubic)

    def ends(self, step: IntArray, link: IntArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute both joints of links between poses: places, shape (n, 2, 3), and arcs, shape (n, 2)."""
        motion = self.motion
        moments, rows = np.unique(step + time, return_inverse=True)  # many links share a configuration
        before = np.minimum(moments.astype(np.int64), motion.n_poses - 1)
        after, share = np.minimum(before + 1, motion.n_poses - 1), moments - before
        feed = (1.0 - share) * motion.feed[before] + share * motion.feed[after]
        share = share[:, None, None]
        angles = (1.0 - share) * motion.joint_angles[before] + share * motion.joint_angles[after]
        joints = joints_from_configuration(feed, angles, self.length, motion.base_pose)
        rows, both = rows[:, None], np.stack([link, link + 1], axis=1)
        return joints[rows, both], self.arc_from_feed(feed)[rows, both]

    def _moves(self, places: list[FloatArray], arcs: list[FloatArray], cubic: FloatArray) -> Moves:
        """Say what is known of moves by both joints before, after and half way, and the parabolas' errors."""
        before, after, middle = places
        bend = np.linalg.norm(middle - (before + after) / 2.0, axis=2) + cubic
        passing = (arcs[0] < 0.0) != (arcs[1] < 0.0)
        row, side = np.nonzero(passing)
        # A joint that comes out of the feeder at the base is then on the line from there to its next place.
        # If it comes out beside it (a fault) it is as far off that line at most.
        start, end = arcs[0][row, side], arcs[1][row, side]
        share = (start / (start - end))[:, None]
        place = before[row, side] + share * (after[row, side] - before[row, side])
        bend[row, side] += np.linalg.norm(place - self.motion.base_pose[:3], axis=1)
        return Moves(
            before=self.in_workspace(before, arcs[0]),
            after=self.in_workspace(after, arcs[1]),
            middle=self.in_workspace(middle, arcs[2]),
            astray=bend.max(axis=1),
            even=~passing.any(axis=1),
        )

    def figure(self, amount: float) -> str:
        """Write a length in workspace units and in link lengths."""
        return f"{amount:.6g} {self.workspace.units} ({amount / self.length:.3g} link lengths)"


def point_of(place: FloatArray) -> tuple[float, ...]:
    """Return a place, shape (3,), as plain numbers."""
    return tuple(float(value) for value in place)


def worst_of(values: FloatArray) -> tuple[float, int, int]:
    """Return the largest of values, shape (n, m), with its row and column."""
    row, column = np.unravel_index(np.argmax(values), values.shape)
    return float(values[row, column]), int(row), int(column)


def joint_fault(scene: Scene, kind: str, message: str, pose: int, joint: int, amount: float) -> Fault:
    """Return a fault at a joint."""
    link = min(joint, scene.motion.n_links - 1)
    place = point_of(scene.motion.joints[pose, joint])
    return Fault(kind=kind, message=message, pose=pose, link=link, place=place, amount=amount)


def halves(time: FloatArray) -> FloatArray:
    """Halve spans of time, shape (n, 2), into shape (2 n, 2): both halves of the first, and so on."""
    middle = time.mean(axis=1)
    return np.stack([time[:, 0], middle, middle, time[:, 1]], axis=1).reshape(-1, 2)


def slices(n: int, width: int) -> list[slice]:
    """Cut n rows of a width into slices that are looked at together."""
    rows = max(1, CELLS // max(1, width))
    return [slice(first, min(first + rows, n)) for first in range(0, n, rows)]
