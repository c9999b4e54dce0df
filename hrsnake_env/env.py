"""The Gymnasium environment: an arm that is fed into a maze."""

from __future__ import annotations

import math
import os
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from hrsnake_env import task
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.contacts import Contact, PinchReport
from hrsnake_env.dynamics import largest_move, step_targets
from hrsnake_env.errors import InputError
from hrsnake_env.geodesic import GeodesicDistance
from hrsnake_env.maze import Maze
from hrsnake_env.physics import CONTROL_TIMESTEP, Physics
from hrsnake_env.rendering import Frame, FrameRenderer
from hrsnake_env.window import Window

__all__ = ["HyperRedundantMazeEnv"]

RESET_OPTIONS = ("feed", "joint_angles")


class HyperRedundantMazeEnv(gym.Env[Any, Any]):
    """A planar arm of many rigid links is fed into a maze, and shall reach the goal with its tip.

    ## Description

    A straight feeder stands behind the base. It pushes the arm into the maze link by link; every joint has a
    motor. Links are as stiff as the walls: in tight turns there is hardly any room, and links may pinch the
    walls (be within 0.001 link lengths of them), but not go into them.

    ## Action Space

    `Box(-1, 1, (n_links + 1,), float32)`: the change of the feed's target in units of 0.02 link lengths, then
    the change of each joint's target, base end first, in units of 0.05 rad (counter-clockwise positive).
    Larger actions are cut. Joints that have not passed the base stay straight, whatever their action. If the
    change would move any joint's place by more than 0.05 link lengths, all of it is scaled down to that.

    ## Observation Space

    `Box(low, 1, (4 * n_links + 8,), float32)`; everything is cut to its bounds.

    | part          | number      | meaning                                                      | min | max |
    |---------------|-------------|--------------------------------------------------------------|-----|-----|
    | feed          | 1           | length of arm past the base / length of the arm              | 0   | 1   |
    | joint_angles  | n_links     | relative to the previous link / pi                           | -1  | 1   |
    | target_errors | 1 + n_links | target minus feed and joint angles / largest change in a step| -1  | 1   |
    | speeds        | 1 + n_links | of feed and joint angles / largest change in a step          | -1  | 1   |
    | goal_offset   | 2           | x and y from the tip to the goal / size of the maze          | -1  | 1   |
    | tip_heading   | 2           | cosine and sine                                              | -1  | 1   |
    | goal_distance | 1           | from the tip round the walls / the same from the base, halved| 0   | 1   |
    | clearances    | n_links     | of each link to the walls / link length                      | -1  | 1   |

    ## Rewards

    The sum of three terms, which `info` holds one by one: `reward_progress`, by how much the way from the tip
    to the goal round the walls has become shorter, in link lengths; `reward_collision`, -1 in a step in which
    a link has gone into a wall or another link; `reward_goal`, 10 on success.

    ## Starting State

    The whole arm is in the feeder, at rest, with its tip at the base. `reset(options={"feed": ...,
    "joint_angles": ...})` starts elsewhere.

    ## Episode End

    Termination: the tip is within the goal's radius (success); or a link has gone into something deeper than
    the pinch tolerance (unless `terminate_on_collision=False`); or the arm is jammed, with a link's end 0.05
    link lengths from where it belongs or joined links 0.01 apart.

    Truncation: after 10,000 steps, by the time limit of the registration.

    ## Arguments

    ```python
    env = gym.make("HyperRedundantMaze-v0", maze="fig19", link_length=430.0)
    ```

    Parameters
    ----------
    maze : Maze, str or path
        A maze, the name of one, or a maze file.
    link_length : float, optional
        In maze units. By default one and a half times the mean width of the maze.
    n_links : int, optional
        By default enough to reach the goal.
    link_radius : float
        In maze units; 0 means that links are line segments, as in the paper.
    substeps : int
        Simulated steps in one step of the environment.
    torque_limit : float, optional
        Largest joint torque in link mass x link length^2 / s^2; None means no limit. A step takes 0.05 s.
    actuation : {"computed_torque", "gear"}
        "gear": a servo in each joint turns its link to the target, and nothing else pushes the links. Walls
        then hardly push back: a link sinks into a wall by about 90 % of what it is sent. Use it to see what
        joint servos alone do; `torque_limit` must be None.
    terminate_on_collision : bool
        Whether a collision ends the episode.
    render_mode : {None, "human", "rgb_array"}
        "human" shows every step in a window (`pip install "hrsnake[play]"`); "rgb_array" needs no display.

    Raises
    ------
    InputError
        If an argument is out of its range, or the arm cannot leave the feeder in this maze.

    ## Version History

    - v0: first version.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": ["human", "rgb_array"],
        "render_fps": round(1 / CONTROL_TIMESTEP),
    }

    def __init__(
        self,
        maze: Maze | str | os.PathLike[str] = "fig19",
        link_length: float | None = None,
        n_links: int | None = None,
        link_radius: float = 0.0,
        substeps: int = 4,
        torque_limit: float | None = None,
        actuation: str = "computed_torque",
        terminate_on_collision: bool = True,
        render_mode: str | None = None,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise InputError(f"Unknown render_mode {render_mode!r}. Available: None, 'human', 'rgb_array'.")
        self.maze = maze if isinstance(maze, Maze) else Maze.load(maze)
        self._goal_distance = GeodesicDistance(self.maze)
        self._way = self._goal_distance(self.maze.base_pose[:2])
        if link_length is None:
            link_length = 1.5 * _mean_width(self.maze)
        arm = ArmSpec(link_length=link_length, n_links=n_links, link_radius=link_radius)
        self.maze.check_arm(arm)
        if n_links is None:
            # A link more than a way 5 % longer takes: links cut corners less well than a string.
            n_links = math.ceil(1.05 * self._way / link_length) + 1
        self.arm = ArmSpec(link_length=link_length, n_links=n_links, link_radius=link_radius)
        self.physics = Physics(
            self.maze, self.arm, substeps=substeps, torque_limit=torque_limit, actuation=actuation
        )
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (n_links + 1,), np.float32)
        self.observation_space = task.observation_space(n_links)
        self._terminate_on_collision = terminate_on_collision
        self._step_limits = np.array([task.FEED_STEP * link_length, *([task.JOINT_STEP] * n_links)])
        self._renderer: FrameRenderer | None = None
        self._window: Window | None = None
        self._distance = self._way
        self._start(0.0, np.zeros(n_links))

    # The Gymnasium interface

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode; `options` may hold `feed` (maze units) and `joint_angles` (rad) to start from."""
        super().reset(seed=seed)
        options = options or {}
        unknown = [key for key in options if key not in RESET_OPTIONS]
        if unknown:
            raise InputError(f"Unknown reset option {unknown[0]!r}. Available: {', '.join(RESET_OPTIONS)}.")
        self._start(options.get("feed", 0.0), options.get("joint_angles", np.zeros(self.physics.n_links)))
        if self.render_mode == "human":
            self.render()
        outcome = task.StepOutcome(progress=0.0, collided=False, succeeded=False)
        return self._observation(), self._info(outcome, ())

    def step(
        self, action: NDArray[np.floating[Any]]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Change the targets by an action, and simulate until the arm is there (see the class)."""
        self._target = self._next_target(self._checked(action))
        self.physics.advance(self._target[0], self._target[1:])
        before, self._distance = self._distance, self._distance_now()
        contacts = self.physics.pose_contacts
        collided = any(contact.kind == "collision" for contact in contacts)
        jammed = task.is_jammed(self.physics)
        failed = jammed or (collided and self._terminate_on_collision)
        outcome = task.StepOutcome(
            progress=(before - self._distance) / self.arm.link_length,
            collided=collided,
            succeeded=not failed and self._tip_distance() <= self.maze.goal_radius,
        )
        info = self._info(outcome, contacts)
        reward = sum(task.reward_terms(outcome).values())
        if self.render_mode == "human":
            self.render()
        return self._observation(), reward, failed or outcome.succeeded, False, info

    def render(self) -> Frame | None:
        """Draw the arm in the maze, its links coloured by clearance, and what touches.

        Returns
        -------
        frame : uint8 array, shape (height, width, 3), or None
            None in the mode "human", which shows the frame in a window, and without a render mode.
        """
        if self.render_mode is None:
            gym.logger.warn(
                'Calling render() without a render mode; pass render_mode="rgb_array" to gym.make.'
            )
            return None
        if self._renderer is None:
            self._renderer = FrameRenderer(self.maze, link_radius=self.arm.link_radius)
        frame = self._renderer.draw(
            self.physics.joints,
            clearances=self.physics.clearance,
            link_length=self.arm.link_length,
            contacts=self.physics.pose_contacts,
        )
        if self.render_mode == "rgb_array":
            return frame
        if self._window is None:
            self._window = Window(self._renderer.size, fps=self.metadata["render_fps"], title=self.maze.name)
        self._window.show(frame)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def pinch_report(self) -> PinchReport:
        """Return whether links have merely pinched the walls since the reset, and where they collided."""
        return self.physics.report()

    @property
    def target(self) -> FloatArray:
        """Where feed and joint angles were last sent, shape (1 + n_links,), in maze units and rad."""
        return self._target.copy()

    # What it is made of

    def _start(self, feed: float, joint_angles: Any) -> None:
        self.physics.reset(feed, joint_angles)
        self._target = self.physics.target
        self._distance = self._way
        self._distance = self._distance_now()

    def _checked(self, action: Any) -> FloatArray:
        """Return an action as float64, cut to [-1, 1]: a finer action than float32 keeps its digits."""
        values = np.asarray(action, dtype=np.float64)
        if values.shape != self.action_space.shape:
            raise InputError(f"Expected an action with shape {self.action_space.shape}, got {values.shape}.")
        if not np.isfinite(values).all():
            k = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"Expected a finite action, got {values[k]} at index {k}.")
        return np.clip(values, -1.0, 1.0)

    def _next_target(self, action: FloatArray) -> FloatArray:
        """Return the target after an action, scaled down until no joint's place moves too far."""
        change, largest = action * self._step_limits, task.LARGEST_STEP * self.arm.link_length
        for _ in range(20):
            wanted = self._target + change
            wanted[0] = min(max(wanted[0], 0.0), self.physics.n_links * self.arm.link_length)
            targets: FloatArray = np.empty((1, len(wanted)))
            step_targets(self._target, wanted, self.arm.link_length, targets)  # straight in the feeder
            move = largest_move(self._target, targets, self.arm.link_length)
            if move <= largest * (1.0 + 1e-6):
                break
            change *= largest / move
        else:
            return self._target
        return np.ascontiguousarray(targets[0])

    def _tip_distance(self) -> float:
        return float(np.linalg.norm(self.physics.tip_position - self.maze.goal))

    def _distance_now(self) -> float:
        """Return the way from the tip to the goal; with the tip in a wall, what it was before."""
        distance = self._goal_distance(self.physics.tip_position) if self.physics.finite else math.inf
        return distance if math.isfinite(distance) else self._distance

    def _observation(self) -> NDArray[np.float32]:
        return task.observation(self.physics, self._target, min(self._distance / (2.0 * self._way), 1.0))

    def _info(self, outcome: task.StepOutcome, contacts: tuple[Contact, ...]) -> dict[str, Any]:
        return {
            "success": outcome.succeeded,
            "is_success": outcome.succeeded,
            "feed": self.physics.feed,
            "tip_distance": self._tip_distance(),
            "goal_distance": self._distance,
            "clearance": float(self.physics.clearance.min()),
            "pinches": len({contact.link for contact in contacts if contact.kind == "pinch"}),
            "collisions": len({contact.link for contact in contacts if contact.kind == "collision"}),
            "depth": max(
                (-contact.clearance for contact in contacts if contact.clearance < 0.0), default=0.0
            ),
            "impulse": max((contact.impulse for contact in contacts), default=0.0),
            "node_error": self.physics.node_error,
            "drift": self.physics.drift,
            **task.reward_terms(outcome),
        }


def _mean_width(maze: Maze) -> float:
    """Return the width of the corridor that has the maze's area and length of walls."""
    return float(2.0 * maze.free_space.area / maze.free_space.length)
