"""The Gymnasium environment: an arm that is fed into a maze."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hrsnake_env import task
from hrsnake_env.arguments import check_at_least, check_flag, check_one_of, is_number, numbers, place_text
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.contacts import PinchReport
from hrsnake_env.errors import InputError
from hrsnake_env.geodesic import look_ahead
from hrsnake_env.maze import Maze
from hrsnake_env.observation import AHEAD, observation_parts, observation_space, write_observation
from hrsnake_env.options import ResetOptions
from hrsnake_env.physics import CONTROL_TIMESTEP, Physics
from hrsnake_env.rendering import HEIGHT, Frame
from hrsnake_env.saved import PhysicsState
from hrsnake_env.scenes import NO_TASK, Scene, Scenes
from hrsnake_env.tally import Tally
from hrsnake_env.view import View

__all__ = ["EnvState", "HyperRedundantMazeEnv"]


@dataclass(frozen=True, eq=False, kw_only=True)
class EnvState:
    """Hold where an episode stands, from `HyperRedundantMazeEnv.get_state`; it can be pickled."""

    arm: ArmSpec
    world: dict[str, Any]
    maze: Maze
    task_id: int
    target: FloatArray
    physics: PhysicsState
    tally: Tally
    rng: dict[str, Any]


class HyperRedundantMazeEnv(gym.Env[Any, Any]):
    """A planar arm of many rigid links is fed into a maze, and shall reach the goal with its tip.

    ## Description

    A straight feeder stands behind the base. It pushes the arm into the maze link by link; every joint has a
    motor. Links are as stiff as the walls: in tight turns there is hardly any room, and links may pinch the
    walls (be within 0.001 link lengths of them), but not go into them.

    ## Action Space

    `Box(-1, 1, (n_links + 1,), float32)`; larger actions are cut. Joints are counted from the base end,
    angles are counter-clockwise positive.

    | number        | with `action="delta"`                    | with `action="absolute"`                    |
    |---------------|------------------------------------------|---------------------------------------------|
    | 0             | change of the feed's target / 0.02 links | the feed's target: from -1, none, to 1, all |
    | 1 ... n_links | change of each joint's target / 0.05 rad | each joint's target / joint limit (or pi)   |

    Absolute targets are approached by the changes that an action of 1 makes. Joints that have not passed the
    base stay straight, whatever their action: their angle is cut to 16 rad per link length that they are past
    it. If the change would move any joint's place by more than 0.05 link lengths, all of it is scaled down to
    that. What a wall has refused is not asked for again: after a collision the targets are where the arm is.

    ## Observation Space

    `observation="state"`: `Box(low, 1, (4 * n_links + 16,), float32)`; with `rays=True` 8 + 2 * n_links
    numbers more. Everything is cut to its bounds. The reach is the length of the arm.

    | part          | number      | meaning                                                 | min | max |
    |---------------|-------------|---------------------------------------------------------|-----|-----|
    | feed          | 1           | length of arm past the base / reach                     | 0   | 1   |
    | joint_angles  | n_links     | relative to the previous link / joint limit (or pi)     | -1  | 1   |
    | target_errors | 1 + n_links | target minus feed and angles / largest change in a step | -1  | 1   |
    | speeds        | 1 + n_links | of feed and joint angles / largest change in a step     | -1  | 1   |
    | tip_position  | 2           | x and y from the base / reach                           | -1  | 1   |
    | tip_heading   | 2           | cosine and sine                                         | -1  | 1   |
    | clearances    | n_links     | of each link to the walls / link length                 | -1  | 1   |
    | goal_offset   | 2           | x and y from the tip to the goal / reach                | -1  | 1   |
    | goal_distance | 1           | round the walls, from the tip / from the base, halved   | 0   | 1   |
    | ahead         | 6           | places on the shortest way to the goal, see below       | -1  | 1   |
    | tip_rays      | 8           | with `rays`: from the tip to the walls, see below       | 0   | 1   |
    | side_rays     | 2 * n_links | with `rays`: from each joint to the right and left      | 0   | 1   |

    The places ahead are 0.5, 1 and 2 link lengths along the way from the tip; of each, how far it is forward
    and to the left of the tip, / that length. Rays are / 2 link lengths, as far as they see. Those of the
    tip go from -105 to 105 degrees off the last link, in steps of 30; joints in the feeder see nothing.

    `observation="goal"`: a dictionary for hindsight replay. `observation` is the vector without goal_offset,
    goal_distance and ahead, `achieved_goal` is tip_position and `desired_goal` the goal, scaled alike.

    `observation="image"`: the picture of `render`, `Box(0, 255, (image_size, image_size, 3), uint8)`.

    ## Rewards

    The sum of three terms, which `info` holds one by one.

    | term            | `reward_type="dense"`                                   | `reward_type="sparse"` |
    |-----------------|---------------------------------------------------------|------------------------|
    | reward_progress | the way that has been made, see below, from -0.1 to 0.1 | 0                      |
    | reward_contact  | -0.2 (`contact_penalty`) in a step with a collision     | the same               |
    | reward_goal     | 10 on success                                           | 1 on success           |

    Progress is by how much the shortest way from the tip to the goal round the walls has become shorter, in
    link lengths. A collision is a link that is deeper in a wall or another link than the pinch tolerance.

    With `observation="goal"` the reward must be a function of the two goals, `compute_reward`: there
    reward_progress is minus the straight distance from the tip to the goal / reach (0 if sparse), and
    reward_goal is 1 in every step with the tip at the goal.

    ## Starting State

    The whole arm is in the feeder, at rest, with its tip at the base. `reset(options=...)` starts elsewhere:

    | option         | meaning                                                                 |
    |----------------|-------------------------------------------------------------------------|
    | `maze`         | another maze for the same arm: a Maze, a name or a file                 |
    | `task_id`      | with `maze="random"`: which of the mazes of the split                   |
    | `goal`         | another goal (x, y), in maze units                                      |
    | `feed`         | length of arm past the base, in maze units                              |
    | `joint_angles` | in rad, with `feed`                                                     |
    | `motion`       | start at a pose of this; it has `feed` and `joint_angles` for each pose |
    | `waypoint`     | which pose of the motion; by default the first                          |
    | `state`        | from `get_state` or `snapshot`                                          |

    ## Episode End

    Termination: the tip has been within the goal's radius for `success_hold_steps` steps (success); or a link
    has collided with something (unless `terminate_on_collision=False`); or the arm
    is jammed, with a link's end 0.1 link lengths from where it belongs or joined links 0.02 apart.

    Truncation: by the time limit of the registration, 10,000 steps for `HyperRedundantMaze-v0`.

    ## Info

    The same keys from the reset on. Lengths are in maze units, torques in link mass x link length^2 / s^2,
    impulses in link mass x link length / s.

    | key                                          | meaning                                               |
    |----------------------------------------------|-------------------------------------------------------|
    | success, is_success                          | whether the episode has ended in success              |
    | progress                                     | share of the way to the goal that is done             |
    | feed, tip_distance, goal_distance            | arm past the base; tip to goal, straight, round walls |
    | clearance                                    | smallest of all links, negative in a wall             |
    | pinches, collisions                          | links that pinch or collide in this step              |
    | depth, impulse                               | largest in this step                                  |
    | joint_torques                                | means of the step, shape (n_links,)                   |
    | node_error, drift                            | link's end off its place; joined links apart          |
    | task_id                                      | which random maze, or -1                              |
    | reward_progress, reward_contact, reward_goal | the terms of the reward                               |
    | total_steps, total_reward                    | since the reset                                       |
    | total_pinches, total_collisions              | sums since the reset                                  |
    | worst_depth, worst_impulse                   | largest since the reset                               |

    ## Arguments

    ```python
    env = gym.make("HyperRedundantMaze-v0", maze="fig19", link_length=430.0)
    ```

    Parameters
    ----------
    maze : Maze, str or path
        A maze, the name of one, or a maze file; "random" for a new one at every reset.
    link_length : float, optional
        In maze units. By default one and a half times the mean width of the maze; 100 for random mazes.
    n_links : int, optional
        By default enough to reach the goal; 12 for random mazes.
    link_radius : float
        In maze units; 0 means that links are line segments, as in the paper.
    joint_limit : float, optional
        Largest joint angle in rad; None means no limit.
    observation : {"state", "goal", "image"}
        What is observed.
    rays : bool
        Whether rays from the tip and to the sides of the joints are observed.
    image_size : int
        Side of an observed picture, in pixels.
    action : {"delta", "absolute"}
        What an action means.
    reward_type : {"dense", "sparse"}
        What is rewarded.
    contact_penalty : float
        For a step with a collision.
    goal_radius : float, optional
        In maze units; by default the maze's.
    success_hold_steps : int
        So many steps in a row the tip must be at the goal.
    terminate_on_collision : bool
        Whether a collision ends the episode.
    split : {"train", "test"}, optional
        Which random mazes, by default those to train on; no maze is in both.
    difficulty : tuple of two floats, optional
        Range of the random mazes' difficulty, by default (0, 1). A task has one drawn from it.
    substeps : int
        Simulated steps in one step of the environment.
    torque_limit : float, optional
        Largest joint torque in link mass x link length^2 / s^2; None means no limit. A step takes 0.05 s.
    actuation : {"computed_torque", "gear"}
        "gear": a servo in each joint turns its link to the target, and nothing else pushes the links. Walls
        then hardly push back: a link sinks into a wall by about 90 % of what it is sent. Use it to see what
        joint servos alone do; `torque_limit` must be None.
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
        joint_limit: float | None = None,
        observation: str = "state",
        rays: bool = False,
        image_size: int = 96,
        action: str = "delta",
        reward_type: str = "dense",
        contact_penalty: float = task.CONTACT_PENALTY,
        goal_radius: float | None = None,
        success_hold_steps: int = 1,
        terminate_on_collision: bool = True,
        split: str | None = None,
        difficulty: tuple[float, float] | None = None,
        substeps: int = 4,
        torque_limit: float | None = None,
        actuation: str = "computed_torque",
        render_mode: str | None = None,
    ) -> None:
        check_one_of("render_mode", render_mode, (None, *self.metadata["render_modes"]))
        check_one_of("action", action, task.ACTIONS)
        check_one_of("reward_type", reward_type, task.REWARDS)
        check_at_least("contact_penalty", contact_penalty, 0.0)
        check_at_least("success_hold_steps", success_hold_steps, 1, whole=True)
        check_at_least("image_size", image_size, 16, whole=True)
        check_flag("rays", rays)
        check_flag("terminate_on_collision", terminate_on_collision)
        if goal_radius is not None and not (is_number(goal_radius) and 0.0 < goal_radius < math.inf):
            raise InputError(f"Expected a positive, finite goal_radius, or None, got {goal_radius!r}.")
        self._scenes = Scenes(
            maze,
            link_length=link_length,
            n_links=n_links,
            link_radius=link_radius,
            joint_limit=joint_limit,
            goal_radius=goal_radius,
            split=split,
            difficulty=difficulty,
            physics={"substeps": substeps, "torque_limit": torque_limit, "actuation": actuation},
        )
        self.arm = self._scenes.arm
        link_length, n_links = self.arm.link_length, int(self.arm.n_links or 0)
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (n_links + 1,), np.float32)
        self.observation_space = observation_space(observation, n_links, rays=rays, image_size=image_size)
        parts = observation_parts(n_links, goal=observation == "state", rays=rays)
        self._n_observed = sum(length for length, _ in parts.values())
        if observation == "goal":
            self.compute_reward = self.goal_reward  # its presence says that there is a goal
        self._mode, self._rays, self._image_size = observation, rays, image_size
        self.action_mode = action
        self._absolute, self._reward_type, self._contact_penalty = (
            action == "absolute",
            reward_type,
            float(contact_penalty),
        )
        self._success_hold_steps = int(success_hold_steps)
        self._terminate_on_collision = bool(terminate_on_collision)
        self._joint_limit = math.pi if joint_limit is None else joint_limit
        self._reach = n_links * link_length
        self._scales = np.array(
            [link_length, task.FEED_STEP * link_length, task.JOINT_STEP, self._joint_limit]
        )
        self._ahead = np.array(AHEAD) * link_length
        self._target, self._wanted = np.zeros(1 + n_links), np.zeros(1 + n_links)
        self._no_rays, self._places = np.zeros(0), np.zeros((len(AHEAD), 2))
        self._view = View((HEIGHT, HEIGHT) if self._scenes.random else None, fps=self.metadata["render_fps"])
        self._eye = View((image_size, image_size), fps=self.metadata["render_fps"])
        self._enter(self._scenes.first, 0 if self._scenes.random else NO_TASK)
        self._start(0.0, np.zeros(n_links))
        self._ready = True

    # The Gymnasium interface

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Parameters
        ----------
        seed : int, optional
            For `np_random`, from which random mazes are drawn.
        options : dict, optional
            `maze` (a Maze, a name or a file; for the same arm), `task_id` (which random maze), `goal` (x, y),
            `feed` and `joint_angles` (maze units and rad), `motion` and `waypoint` (start at that pose of
            anything with `feed`, shape (n_poses,), and `joint_angles`, shape (n_poses, n_links)), or `state`
            (from `get_state`; the random numbers go on as they are).

        Raises
        ------
        InputError
            If an option is unknown, or an arm cannot start so: out of what the feeder allows, in a wall,
            across itself, or with its tip at the goal. Then the environment must be reset again.
        """
        super().reset(seed=seed)
        self._ready = False
        wanted = ResetOptions.parse(options, self.arm)
        if wanted.state is not None:
            self._return_to(wanted.state)
        else:
            self._enter(*self._scenes.choose(wanted, self.np_random))
            self._start(wanted.feed, wanted.joint_angles)
        self._ready = True
        if self.render_mode == "human":
            self.render()
        return self.observe(), self._info()

    def step(self, action: NDArray[np.floating[Any]]) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Change the targets by an action, and simulate until the arm is there (see the class).

        Raises
        ------
        InputError
            If the action has another shape, or is not finite; nothing has happened then.
        gymnasium.error.ResetNeeded
            If the last reset was refused.
        """
        if not self._ready:
            raise gym.error.ResetNeeded("Expected a reset before this step, as the last one was refused.")
        # A finer action than float32 keeps its digits.
        values = numbers("an action", action)
        if values.shape != self._target.shape:
            raise InputError(f"Expected an action with shape {self._target.shape}, got {values.shape}.")
        if self._tally.collided and np.isfinite(values).all():
            # What a wall has refused is not asked for again, or the arm would wind up and jam.
            self.physics.take_back()
            self._target[:] = self.physics.target
        bad = task.next_target(
            self._target, values, self._absolute, self.arm.link_length, self._joint_limit, self._wanted
        )
        if bad >= 0:
            raise InputError(f"Expected a finite action, got {values[bad]} at index {bad}.")
        self._target, self._wanted = self._wanted, self._target
        self.physics.advance_to(self._target)
        terminated, reward = self._judge()
        if self.render_mode == "human":
            self.render()
        return self.observe(), reward, terminated, False, self._info()

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
        if self.render_mode == "rgb_array":
            return self._view.frame(self.physics)
        self._view.show(self.physics)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        self._view.close()

    def observe(self) -> Any:
        """Return the present observation, as the last `reset` or `step` has."""
        if self._mode == "image":
            return self._eye.frame(self.physics)
        physics, goal = self.physics, self._mode == "state"
        senses = physics.sense()
        vector = np.empty(self._n_observed, dtype=np.float32)
        write_observation(
            *senses,
            self._target,
            self._scales,
            self.maze.base_pose,
            goal,
            self.maze.goal,
            self._tally.distance / (2.0 * self._scene.way),
            self._places,
            physics.cast_rays() if self._rays else self._no_rays,
            vector,
        )
        if goal:
            return vector
        return {
            "observation": vector,
            "achieved_goal": self._goal_place(senses.readings[1:3]),
            "desired_goal": self._goal_place(self.maze.goal),
        }

    def goal_reward(
        self, achieved_goal: ArrayLike, desired_goal: ArrayLike, info: Any
    ) -> float | NDArray[np.float64]:
        """Return the reward of the mode "goal", of one transition or of many: `env.compute_reward` there.

        Parameters
        ----------
        achieved_goal, desired_goal : array-like, shape (2,) or (n, 2)
            As the observations have them.
        info : dict, or sequence of n dicts
            Of the transitions; without "collisions" in it, there were none.

        Returns
        -------
        reward : float, or array with shape (n,)
        """
        terms = self._goal_terms(achieved_goal, desired_goal, info)
        reward = sum(terms.values())
        return float(reward) if np.ndim(reward) == 0 else np.asarray(reward, dtype=np.float64)

    def pinch_report(self) -> PinchReport:
        """Return whether links have merely pinched the walls since the reset, and where they collided."""
        return self.physics.report()

    @property
    def physics(self) -> Physics:
        """The simulator."""
        return self._scene.physics

    @property
    def maze(self) -> Maze:
        """The maze of this episode."""
        return self._scene.maze

    @property
    def target(self) -> FloatArray:
        """Where feed and joint angles were last sent, shape (1 + n_links,), in maze units and rad."""
        return self._target.copy()

    # Saving and restoring

    def get_state(self) -> EnvState:
        """Return where the episode stands, without disturbing it; it goes on from there to the last bit.

        The state holds all moves since the reset, or the last `snapshot`, and going back to it repeats them.
        What wrappers count, such as the steps of a time limit, is not in it.
        """
        return self._state(self.physics.get_state())

    def snapshot(self) -> EnvState:
        """Return a state that is quick to go back to, for searching from it.

        The simulator is built afresh at once, and so the episode may go on differently in the last digits
        than without: but always as it does after `set_state`.
        """
        return self._state(self.physics.snapshot())

    def set_state(self, state: EnvState) -> None:
        """Go back to a state of this environment, or of one made alike, random numbers included."""
        self._return_to(state)
        self.np_random.bit_generator.state = state.rng

    def _state(self, physics: PhysicsState) -> EnvState:
        return EnvState(
            arm=self.arm,
            world=self._scenes.world,
            maze=self.maze,
            task_id=self._task_id,
            target=self._target.copy(),
            physics=physics,
            tally=self._tally.copy(),
            rng=self.np_random.bit_generator.state,  # type: ignore[arg-type]
        )

    def _return_to(self, state: Any) -> None:
        if not isinstance(state, EnvState):
            raise InputError(f"Expected a state from get_state or snapshot, got {type(state).__name__}.")
        for what, own, its in (
            ("arm", vars(self.arm), vars(state.arm)),
            ("world", self._scenes.world, state.world),
        ):
            for key, value in own.items():
                if its[key] != value:
                    raise InputError(
                        f"Expected a state of the same {what}, with {key}={value!r}, got one with "
                        f"{key}={its[key]!r}."
                    )
        self._enter(self._scenes.of(state.maze), state.task_id)
        self.physics.set_state(state.physics)
        self._target = state.target.copy()
        self._look_ahead()
        self._tally = state.tally.copy()

    # What it is made of

    def _enter(self, scene: Scene, task_id: int) -> None:
        far = math.dist(scene.maze.goal, scene.maze.base_pose[:2])
        if self._mode == "goal" and far > self._reach:
            raise InputError(
                f"Expected a goal within the arm's {self._reach:g} {scene.maze.units} for observation "
                f"'goal', got one {far:g} off."
            )
        self._scene, self._task_id = scene, task_id
        self._goal = (float(scene.maze.goal[0]), float(scene.maze.goal[1]))

    def _start(self, feed: float, joint_angles: FloatArray) -> None:
        physics = self.physics
        physics.reset(feed, joint_angles)
        self._target[:] = physics.target
        self._tally = Tally(distance=self._scene.way)
        self._tally.distance, self._tally.tip_distance = self._look_ahead(), self._tip_distance()
        if feed > 0.0:
            self._check_start()

    def _check_start(self) -> None:
        """Refuse a start in a wall, across itself, or at the goal."""
        self.physics.settle()  # lets the simulator see what touches
        for contact in self.physics.pose_contacts:
            if contact.kind == "collision":
                what = "a wall" if contact.other is None else f"link {contact.other}"
                raise InputError(
                    f"Expected a start clear of the walls, got link {contact.link} {-contact.clearance:.3g} "
                    f"{self.maze.units} deep in {what} at {place_text(contact.point, self.maze.size)}."
                )
        if self._tally.tip_distance <= self.maze.goal_radius:
            raise InputError("Expected a start outside the goal's radius, got one with the tip at the goal.")
        self._tally.see(self.physics.pose_contacts)

    def _judge(self) -> tuple[bool, float]:
        """Return whether the step has ended the episode, and its reward."""
        tally, physics, length = self._tally, self.physics, self.arm.link_length
        tally.see(physics.pose_contacts)
        before, tally.distance = tally.distance, self._look_ahead()
        jammed = (
            not physics.finite
            or physics.node_error > task.JAM_NODE_ERROR * length
            or physics.drift > task.JAM_DRIFT * length
        )
        failed = jammed or (tally.collided and self._terminate_on_collision)
        tally.tip_distance = self._tip_distance()
        at_goal = not failed and tally.tip_distance <= self.maze.goal_radius
        tally.steps_at_goal = tally.steps_at_goal + 1 if at_goal else 0
        tally.succeeded = tally.steps_at_goal >= self._success_hold_steps
        if self._mode == "goal":
            place, goal = self._goal_place(physics.sense().readings[1:3]), self._goal_place(self.maze.goal)
            terms = self._goal_terms(place, goal, {"collisions": tally.collisions})
            terms = {name: float(value) for name, value in terms.items()}
        else:
            terms = task.reward_terms(
                self._reward_type,
                progress=(before - tally.distance) / length,
                collided=tally.collided,
                succeeded=tally.succeeded,
                contact_penalty=self._contact_penalty,
            )
        return failed or tally.succeeded, tally.reward(terms)

    def _goal_place(self, point: FloatArray) -> NDArray[np.float32]:
        """Return a place relative to the base, as a share of the arm's length."""
        place = (point - self.maze.base_pose[:2]) / self._reach
        return np.clip(np.nan_to_num(place), -1.0, 1.0).astype(np.float32)

    def _goal_terms(self, achieved: ArrayLike, desired: ArrayLike, info: Any) -> dict[str, Any]:
        offset = np.asarray(achieved, dtype=np.float64) - np.asarray(desired, dtype=np.float64)
        infos = [info] if isinstance(info, dict) else list(info)
        collided = np.array([entry.get("collisions", 0) > 0 for entry in infos])
        return task.goal_reward_terms(
            self._reward_type,
            distance=np.linalg.norm(offset, axis=-1),
            goal_radius=self.maze.goal_radius / self._reach,
            collided=collided[0] if isinstance(info, dict) else collided,
            contact_penalty=self._contact_penalty,
        )

    def _tip_distance(self) -> float:
        readings, goal = self.physics.sense().readings.tolist(), self._goal
        return math.hypot(readings[1] - goal[0], readings[2] - goal[1])

    def _look_ahead(self) -> float:
        """Return the way from the tip to the goal; with the tip deep in a wall, what it was before."""
        distance = math.inf
        if self.physics.finite:
            _, x, y, *_ = self.physics.sense().readings.tolist()
            distance = look_ahead(self._scene.distance.ways, x, y, self._ahead, self._places)
        return distance if math.isfinite(distance) else self._tally.distance

    def _info(self) -> dict[str, Any]:
        tally, physics = self._tally, self.physics
        readings = physics.sense().readings
        return {
            "success": tally.succeeded,
            "is_success": tally.succeeded,
            "progress": 1.0 - tally.distance / self._scene.way,
            "feed": float(readings[0]),
            "tip_distance": tally.tip_distance,
            "goal_distance": tally.distance,
            "clearance": float(readings[5]),
            "pinches": tally.pinches,
            "collisions": tally.collisions,
            "depth": tally.depth,
            "impulse": tally.impulse,
            "joint_torques": physics.torques,
            "node_error": physics.node_error,
            "drift": physics.drift,
            "task_id": self._task_id,
            **tally.terms,
            "total_steps": tally.steps,
            "total_reward": tally.total_reward,
            "total_pinches": tally.total_pinches,
            "total_collisions": tally.total_collisions,
            "worst_depth": tally.worst_depth,
            "worst_impulse": tally.worst_impulse,
        }
