"""Who drives the arm by hand: a person who steers the tip, or a planned motion that takes over."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray, configuration_from_joints, joints_from_configuration
from hrsnake_env.task import FEED_STEP, JOINT_STEP, LARGEST_STEP
from planners.problem import Motion

__all__ = ["TURN_STEP", "MotionDriver", "TipDriver", "joints_along"]

TURN_STEP = 0.1
"""In rad: the heading of the tip changes by so much in one step."""

LARGEST_TURN = math.radians(75.0)
"""Of the heading against the last link. At 90 degrees the tip would pull the joint behind it nowhere."""

ROUNDING = 1e-9
ATTEMPTS = 12

AT_PLACE = 0.01
"""In steps: an arm that is so near to its place on the path is there."""


def joints_along(path: FloatArray, n_links: int, link_length: float) -> FloatArray:
    """Place joints on a path so that the tip is at its end and all links are chords of it.

    Parameters
    ----------
    path : array, shape (n, 2)
        A polyline in maze units; its first point is farther back than the arm reaches.
    n_links : int
        Number of links.
    link_length : float
        In maze units.

    Returns
    -------
    joints : array, shape (n_links + 1, 2)
        Base end first. Each joint is the place nearest behind the next one, along the path, that is a link
        length away from it.
    """
    joints = np.empty((n_links + 1, 2))
    joints[-1], last = path[-1], len(path) - 1
    for k in range(n_links - 1, -1, -1):
        after = joints[k + 1]
        away = np.hypot(*(path[:last] - after).T)
        start = int(np.flatnonzero(away >= link_length)[-1])
        end = after if start == last - 1 else path[start + 1]
        joints[k] = _place_at(path[start], end, after, link_length)
        last = start + 1
    return joints


def _place_at(start: FloatArray, end: FloatArray, centre: FloatArray, distance: float) -> FloatArray:
    """Return the place on a segment, from far to near, that is at a distance from a point."""
    along = (end - start) / np.hypot(*(end - start))
    foot = float(along @ (centre - start))
    across = float(np.hypot(*(start + foot * along - centre)))
    place: FloatArray = start + (foot - math.sqrt(max(distance**2 - across**2, 0.0))) * along
    return place


class _Driver:
    """Turn poses into actions.

    Parameters
    ----------
    link_length : float
        In maze units.
    base_pose : array-like, shape (3,)
        Of the maze.
    """

    def __init__(self, link_length: float, base_pose: ArrayLike) -> None:
        self.link_length = float(link_length)
        self.base_pose = np.array(base_pose, dtype=np.float64)

    def change_to(
        self, target: FloatArray, feed: float, joint_angles: FloatArray
    ) -> tuple[FloatArray, float]:
        """Return the action from a target to a configuration, not cut, and how many steps it takes."""
        length = self.link_length
        action = np.append(
            (feed - target[0]) / (FEED_STEP * length), (joint_angles - target[1:]) / JOINT_STEP
        )
        before = joints_from_configuration(target[0], target[1:], length, self.base_pose)
        after = joints_from_configuration(feed, joint_angles, length, self.base_pose)
        move = float(np.hypot(*(after - before).T).max()) / (LARGEST_STEP * length)
        return action, max(float(np.abs(action).max()), move)


class TipDriver(_Driver):
    """Steer the tip, and let every joint follow the path that the tip has taken.

    The first link length in front of the base is straight, as the feeder holds a link until it is out. The
    heading is that in which the tip will go: without feed the arm stands still, and only the heading turns.

    Parameters
    ----------
    joints : array-like, shape (n_links + 1, 2)
        Where the arm is sent now, in maze units. The path so far is that through the joints.
    link_length : float
        In maze units.
    base_pose : array-like, shape (3,)
        Of the maze.

    Attributes
    ----------
    heading : float
        In rad.
    joints : array, shape (n_links + 1, 2)
        Where the arm is sent.
    note : str
        Why the last action did less than was asked for; empty if it did not.
    """

    def __init__(self, joints: ArrayLike, link_length: float, base_pose: ArrayLike) -> None:
        super().__init__(link_length, base_pose)
        self.joints = np.array(joints, dtype=np.float64)
        self.n_links = len(self.joints) - 1
        x, y, heading = self.base_pose
        self._axis = np.array([math.cos(heading), math.sin(heading)])
        behind = np.array([x, y]) - (self.n_links + 2) * self.link_length * self._axis
        self._path = np.vstack([behind, self.joints])
        self.heading = self._link_heading()
        self.note = ""

    @property
    def feed(self) -> float:
        """Length of arm that is past the base, in maze units."""
        rear = float((self.joints[0] - self.base_pose[:2]) @ self._axis)
        return rear + self.n_links * self.link_length

    def action(self, target: ArrayLike, turn: float, feed: float) -> FloatArray:
        """Return the next action, and go on as if it was taken.

        Parameters
        ----------
        target : array-like, shape (1 + n_links,)
            Where feed and joint angles were last sent, in maze units and rad.
        turn : float
            In [-1, 1]: by how much the heading turns, in `TURN_STEP`; counter-clockwise positive.
        feed : float
            In [-1, 1]: how far the tip goes, in `FEED_STEP` link lengths; if negative, back along its path.

        Returns
        -------
        action : array, shape (n_links + 1,)
            In [-1, 1]. All 0 if the arm cannot do what is asked; `note` then says why.
        """
        aim = np.asarray(target, dtype=np.float64)
        self.note = ""
        self._turn(min(max(turn, -1.0), 1.0))
        action = np.zeros(1 + self.n_links)
        way = min(max(feed, -1.0), 1.0) * FEED_STEP * self.link_length
        if way < 0.0 and self.feed + way < 0.0:
            way = -max(self.feed, 0.0)
        if abs(way) <= ROUNDING * self.link_length:
            if feed < 0.0:
                self.note = "the arm is all in the feeder"
            return action
        for _ in range(ATTEMPTS):
            path = self._moved(way)
            joints = joints_along(path, self.n_links, self.link_length)
            configuration = configuration_from_joints(joints, self.link_length, self.base_pose)
            if way > 0.0 and configuration[0] > (self.n_links + ROUNDING) * self.link_length:
                self.note = "the arm is all out of the feeder"
                return action
            change, steps = self.change_to(aim, float(configuration[0]), configuration[1])
            if steps <= 1.0 + 1e-6:
                self._path, self.joints = path, joints
                if way < 0.0:
                    self.heading = self._path_heading()
                return np.clip(change, -1.0, 1.0)
            way *= max(0.98 / steps, 0.25)
        self.note = "the links cannot follow so tight a turn: turn less, or go back"
        return action

    def step_back(self) -> None:
        """Take the arm's place on the path back by a step, in the same heading, as after a collision."""
        way = -min(FEED_STEP * self.link_length, max(self.feed, 0.0))
        if way < -ROUNDING * self.link_length:
            self._path = self._moved(way)
            self.joints = joints_along(self._path, self.n_links, self.link_length)

    def return_action(self, target: ArrayLike) -> FloatArray:
        """Return the action that takes an arm that was pushed off the path back to its place on it.

        Parameters
        ----------
        target : array-like, shape (1 + n_links,)
            From where the action counts, in maze units and rad.

        Returns
        -------
        action : array, shape (n_links + 1,)
            In [-1, 1]. All 0 if the arm is there.
        """
        feed, angles = configuration_from_joints(self.joints, self.link_length, self.base_pose)
        change, steps = self.change_to(np.asarray(target, dtype=np.float64), float(feed), angles)
        if steps <= AT_PLACE:
            return np.zeros(1 + self.n_links)
        return np.clip(change / max(steps, 1.0), -1.0, 1.0)

    def _turn(self, share: float) -> None:
        if self.feed < (1.0 - ROUNDING) * self.link_length:
            self.heading = float(self.base_pose[2])
            if share:
                self.note = "the first link goes straight"
            return
        link = self._link_heading()
        turned = self.heading + share * TURN_STEP - link
        turned = (turned + math.pi) % (2.0 * math.pi) - math.pi
        self.heading = link + min(max(turned, -LARGEST_TURN), LARGEST_TURN)

    def _moved(self, way: float) -> FloatArray:
        """Return the path with its end moved on, or taken back."""
        if way > 0.0:
            step = way * np.array([math.cos(self.heading), math.sin(self.heading)])
            return np.vstack([self._path, self._path[-1] + step])
        sizes = np.hypot(*np.diff(self._path, axis=0).T)
        left = np.cumsum(sizes[::-1])
        whole = int(np.searchsorted(left, -way, side="right"))  # so many segments go wholly
        n = len(self._path) - whole
        taken = -way - (float(left[whole - 1]) if whole else 0.0)
        back = self._path[n - 2] - self._path[n - 1]
        end = self._path[n - 1] + (taken / np.hypot(*back)) * back
        return np.vstack([self._path[: n - 1], end])

    def _link_heading(self) -> float:
        x, y = self.joints[-1] - self.joints[-2]
        return math.atan2(y, x)

    def _path_heading(self) -> float:
        x, y = self._path[-1] - self._path[-2]
        return math.atan2(y, x)


class MotionDriver(_Driver):
    """Drive the arm along a planned motion, from the start or from the pose where it is already.

    Parameters
    ----------
    motion : Motion
        A motion from the feeder.

    Attributes
    ----------
    pose : int
        That it is on its way to.
    """

    def __init__(self, motion: Motion) -> None:
        super().__init__(motion.link_length, motion.base_pose)
        self.motion, self.pose = motion, 0

    @property
    def done(self) -> bool:
        """Whether the last pose was reached."""
        return self.pose >= self.motion.n_poses

    def join(self, target: ArrayLike) -> bool:
        """Go on from the pose that is nearest to where the arm was sent.

        Parameters
        ----------
        target : array-like, shape (1 + n_links,)
            In maze units and rad.

        Returns
        -------
        near : bool
            Whether the arm can be there in one step. If not, nothing has changed, and a reset is needed.
        """
        aim = np.asarray(target, dtype=np.float64)
        here = joints_from_configuration(aim[0], aim[1:], self.link_length, self.base_pose)
        away = np.hypot(*np.moveaxis(self.motion.joints - here, -1, 0)).max(axis=1)
        nearest = int(np.argmin(away))
        _, steps = self.change_to(aim, float(self.motion.feed[nearest]), self.motion.joint_angles[nearest])
        if steps > 1.0:
            return False
        self.pose = nearest
        return True

    def action(self, target: ArrayLike) -> FloatArray:
        """Return the next action, shape (n_links + 1,), in [-1, 1]; all 0 at the end."""
        aim = np.asarray(target, dtype=np.float64)
        while not self.done:
            change, steps = self.change_to(
                aim, float(self.motion.feed[self.pose]), self.motion.joint_angles[self.pose]
            )
            if steps > ROUNDING:
                break
            self.pose += 1
        else:
            return np.zeros(len(aim))
        if steps <= 1.0 + 1e-6:
            self.pose += 1
        return np.clip(change / max(steps, 1.0), -1.0, 1.0)
