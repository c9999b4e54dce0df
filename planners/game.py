"""The game behind `hrsnake play`: who drives the arm, and what there is to see of it. No window here."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import cast

import gymnasium as gym
import numpy as np

from hrsnake_env.arm import FloatArray
from hrsnake_env.env import HyperRedundantMazeEnv
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.rendering import Frame, FrameRenderer
from planners.driving import TURN_STEP, MotionDriver, TipDriver
from planners.planning import PLANNERS, plan
from planners.problem import Progress
from planners.rollout import ENV_ID

__all__ = ["MAZE_SIZE", "Controls", "Game"]

MAZE_SIZE = (960, 576)
"""Of the frames, in pixels."""

SLACK = 1.3
"""So many times the links that the shortest way takes: who drives by hand takes wider turns."""

AT_REST = 1e-6
"""In link lengths: an arm that is nearer to where it was sent is there."""

MOST_STEPS = 4
"""Of a planned motion between two frames."""


@dataclass(kw_only=True)
class Controls:
    """Hold which keys and buttons are down.

    Parameters
    ----------
    held : set of str
        Of left, right, up, down, to_pointer and back.
    pointer : tuple of two floats
        Where the mouse points, in pixels of the frame.
    """

    held: set[str] = field(default_factory=set)
    pointer: tuple[float, float] = (0.0, 0.0)

    def read(self, tip: FloatArray, heading: float, pointed: FloatArray) -> tuple[float, float]:
        """Return turn and feed, each in [-1, 1].

        Parameters
        ----------
        tip, pointed : array, shape (2,)
            Where the tip is and where the mouse points, in maze units.
        heading : float
            Of the tip, in rad.
        """
        turn = float("left" in self.held) - float("right" in self.held)
        feed = float("up" in self.held) - float("down" in self.held)
        if "back" in self.held:
            return turn, -1.0
        if "to_pointer" in self.held:
            x, y = pointed - tip
            off = (math.atan2(y, x) - heading + math.pi) % (2.0 * math.pi) - math.pi
            return min(max(off / TURN_STEP, -1.0), 1.0), 1.0
        return turn, feed


class Game:
    """Hold the world, who drives, and what is to be read on the screen.

    Parameters
    ----------
    maze : Maze
        The maze.
    link_length : float, optional
        In maze units; by default the environment's.
    n_links : int, optional
        By default enough to reach the goal with some to spare.
    planner : str
        `auto` or a key of `PLANNERS`.

    Raises
    ------
    InputError
        If the planner is unknown, or the arm cannot leave the feeder in this maze.
    """

    def __init__(
        self, maze: Maze, link_length: float | None = None, n_links: int | None = None, planner: str = "auto"
    ) -> None:
        if planner != "auto" and planner not in PLANNERS:
            raise InputError(f"Unknown planner {planner!r}. Available: auto, {', '.join(PLANNERS)}.")
        self.maze, self.planner = maze, planner
        self._enter(link_length, n_links)
        if n_links is None:
            self._enter(link_length, math.ceil(SLACK * self.world.physics.n_links))
        self.renderer = FrameRenderer(maze, size=MAZE_SIZE, link_radius=self.arm.link_radius)
        self.controls = Controls()
        self._shown_how: MotionDriver | None = None
        self.reset()

    def _enter(self, link_length: float | None, n_links: int | None) -> None:
        self.env = gym.make(
            ENV_ID,
            max_episode_steps=-1,  # a player takes his time
            maze=self.maze,
            link_length=link_length,
            n_links=n_links,
            terminate_on_collision=False,
        )
        self.world = cast(HyperRedundantMazeEnv, self.env.unwrapped)
        self.arm = self.world.arm

    def reset(self, news: str = "you drive") -> None:
        """Take the arm back into the feeder."""
        _, self.info = self.env.reset()
        self.over, self.by_plan, self.news = "", False, news
        self.pinches = self.collisions = 0
        self._take_the_wheel()

    def _take_the_wheel(self) -> None:
        joints = self.world.physics.target_joints
        self.driver = TipDriver(joints, self.arm.link_length, self.maze.base_pose)

    def hand_over(self, progress: Progress | None = None) -> None:
        """Let the planner drive, or take over from it; planning takes as long as it takes.

        The arm goes on from where it is if that is on the planned motion, and else from the feeder.
        """
        if self.by_plan:
            self.by_plan, self.news = False, "you drive, from here"
            self._take_the_wheel()
            return
        if self._shown_how is None:
            self.news = self._plan(progress)
        if self._shown_how is None:
            return
        if self.over or not self._shown_how.join(self.world.target):
            self.reset()
            self._shown_how.join(self.world.target)
            self.news = "the arm was not on the planned motion: back to the start"
        else:
            self.news = "from here"
        self.by_plan = True

    def _plan(self, progress: Progress | None) -> str:
        """Make the plan, and return what there is to say of it."""
        try:
            result = plan(self.maze, self.arm, self.planner, explain=False, progress=progress)
        except InputError as error:
            return str(error)
        if result.motion is None:
            return f"no plan: {result.reason}"
        self._shown_how = MotionDriver(result.motion)
        return ""

    def advance(self) -> None:
        """Go on by one step, if somebody drives; by more where a planned motion takes small ones."""
        if self.over:
            return
        if self.by_plan and self._shown_how is not None:
            self._advance_by_plan(self._shown_how)
            return
        physics = self.world.physics
        pointed = self.renderer.to_maze(self.controls.pointer)
        turn, feed = self.controls.read(physics.tip_position, self.driver.heading, pointed)
        hit = self.info["collisions"] > 0
        if hit:
            self.driver.step_back()
        action = self.driver.return_action(self._sent)
        if action.any():
            self.news = "a wall is in the way: turn, or go back"
        else:
            action = self.driver.action(self._sent, turn, feed)
            if turn or feed:
                self.news = self.driver.note or "you drive"
        if action.any() or hit or physics.node_error > AT_REST * self.arm.link_length:
            self._step(action)

    @property
    def _sent(self) -> FloatArray:
        """From where the next action counts, shape (1 + n_links,), in maze units and rad."""
        if self.info["collisions"]:  # the environment forgets what a wall has refused
            physics = self.world.physics
            return np.append(physics.feed, physics.joint_angles)
        return self.world.target

    def _advance_by_plan(self, driver: MotionDriver) -> None:
        way = 0.0
        for _ in range(MOST_STEPS):
            action = driver.action(self._sent)
            if driver.done and not action.any():
                self.by_plan, self.news = False, "the motion has ended; you drive, from here"
                self._take_the_wheel()
                return
            self._step(action)
            way += float(np.abs(action).max())
            if self.over or way >= 1.0:
                return

    def _step(self, action: FloatArray) -> None:
        _, _, terminated, _, self.info = self.env.step(action)
        self.pinches += self.info["pinches"]
        self.collisions += self.info["collisions"]
        if terminated:
            clean = "clean" if self.world.pinch_report().clean else "not clean"
            self.by_plan = False
            self.over = f"goal reached, {clean}" if self.info["success"] else "the arm is jammed"

    @property
    def lines(self) -> tuple[str, str]:
        """What is to be read above the maze."""
        arm, units, info = self.arm, self.maze.units, self.info
        verdict = self.over or ("not clean" if self.collisions else "clean so far")
        state = (
            f"{self.maze.name}: {arm.n_links} links of {arm.link_length:.4g} {units}    "
            f"feed {info['feed']:.0f}    clearance {info['clearance']:.2f}    "
            f"pinches {self.pinches}    collisions {self.collisions}    {verdict}"
        )
        if self.over:
            return state, f"{self.over}.    R: again    space: let the planner show how"
        if self.by_plan and self._shown_how is not None:
            pose, last = (
                min(self._shown_how.pose, self._shown_how.motion.n_poses),
                self._shown_how.motion.n_poses,
            )
            news = (
                f"planner '{self.planner}' drives: pose {pose} of {last}    ({self.news})    space: take over"
            )
            return state, news
        return state, self.news

    def frame(self) -> Frame:
        """Draw the arm, and thin where it was sent."""
        physics = self.world.physics
        return self.renderer.draw(
            physics.joints,
            clearances=physics.clearance,
            link_length=self.arm.link_length,
            contacts=physics.pose_contacts,
            target_joints=physics.target_joints,
        )

    @property
    def pointer_line(self) -> tuple[tuple[float, float], tuple[float, float]] | None:
        """Where the tip's heading is drawn, in pixels of the frame; None if nobody steers."""
        if self.by_plan or self.over:
            return None
        heading, tip = self.driver.heading, self.driver.joints[-1]
        start = self.renderer.to_pixels(tip)
        way = np.array([math.cos(heading), -math.sin(heading)])
        (ax, ay), (bx, by) = (start + 7.0 * way).tolist(), (start + 26.0 * way).tolist()
        return (ax, ay), (bx, by)
