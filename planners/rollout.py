"""Episodes: a policy in the environment, from reset to end, and what came of it."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import hrsnake_env  # registers the environment
from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.contacts import Contact, PinchReport
from hrsnake_env.maze import Maze
from hrsnake_env.physics import CONTROL_TIMESTEP
from hrsnake_env.replay import Trace
from hrsnake_env.simulation import simulate
from planners.controllers import PlannedPolicy
from planners.problem import Motion, Progress

__all__ = ["Episode", "Policy", "episode_facts", "run_episode", "simulate_motion"]

ENV_ID = f"{hrsnake_env.__name__}:HyperRedundantMaze-v0"


class Policy(Protocol):
    """Anything with `predict` as stable-baselines3 has it."""

    def predict(
        self,
        observation: Any,
        state: tuple[Any, ...] | None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[Any], tuple[Any, ...] | None]:
        """Return an action and the state for the next call."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Episode:
    """Hold what happened from reset to end.

    Parameters
    ----------
    joints : array, shape (n_steps + 1, n_links + 1, 2)
        Joint positions at reset and after each step, base end first, in maze units.
    rewards : array, shape (n_steps,)
        As the environment gave them.
    contacts : tuple, one entry per pose
        The contacts of each pose.
    clearances : array, shape (n_steps + 1, n_links)
        Of each link at each pose, in maze units; negative is the depth.
    success : bool
        Whether the tip came to the goal.
    report : PinchReport
        What touched what.
    seconds : float
        Wall time of the steps.
    """

    joints: FloatArray
    rewards: FloatArray
    contacts: tuple[tuple[Contact, ...], ...]
    clearances: FloatArray
    success: bool
    report: PinchReport
    seconds: float

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return len(self.rewards)

    def pinched(self, pose: int) -> frozenset[int]:
        """Return the links that pinch something in a pose."""
        return self._touching(pose, "pinch")

    def collided(self, pose: int) -> frozenset[int]:
        """Return the links that collide with something in a pose."""
        return self._touching(pose, "collision")

    def trace(self, maze: Maze, *, title: str | None = None, link_radius: float = 0.0) -> Trace:
        """Return the episode as a replay shows it (`hrsnake_env.replay`).

        Parameters
        ----------
        maze : Maze
            In which it ran.
        title : str, optional
            By default the maze and the links.
        link_radius : float
            In maze units.
        """
        length, n_links = self.report.link_length, self.report.n_links
        links = f"{n_links} links of {length:g} {maze.units}"
        return Trace(
            title=f"{maze.name}, {links}" if title is None else title,
            maze=maze,
            joints=self.joints,
            link_length=length,
            link_radius=link_radius,
            timestep=CONTROL_TIMESTEP,
            clearances=self.clearances,
            contacts=self.contacts,
            clean=self.report.clean,
            summary=tuple(_summary(self, maze.units)),
        )

    def _touching(self, pose: int, kind: str) -> frozenset[int]:
        return frozenset(contact.link for contact in self.contacts[pose] if contact.kind == kind)


def _summary(episode: Episode, units: str) -> Iterator[str]:
    report, exact = episode.report, episode.report.kinematic
    yield "goal reached" if episode.success else "goal not reached"
    yield f"link-poses: {report.free} free, {report.pinch} pinch, {report.collision} collision"
    depth = f"deepest {report.worst_depth:.3g} {units}"
    yield (
        depth if exact is None else f"{depth}; {exact.worst_depth:.3g} {units} with links that no wall pushes"
    )
    if report.largest_impulse > 0.0:
        yield f"largest wall impulse {report.largest_impulse:.3g} link masses x link lengths / s"


def run_episode(
    env: gym.Env[Any, Any], policy: Policy, seed: int | None = None, progress: Progress | None = None
) -> Episode:
    """Run one episode of `HyperRedundantMaze-v0`.

    Parameters
    ----------
    env : gymnasium.Env
        The environment, wrapped or not.
    policy : Policy
        A `PlannedPolicy`, or a model of stable-baselines3.
    seed : int, optional
        For `env.reset`.
    progress : callable, optional
        Called with "simulate" and the share of the time limit that is used up.

    Returns
    -------
    episode : Episode
        From reset until it was terminated or truncated.
    """
    world: Any = env.unwrapped
    observation, info = env.reset(seed=seed)
    limit = None if env.spec is None else env.spec.max_episode_steps
    joints, contacts, rewards = [world.physics.joints.copy()], [world.physics.pose_contacts], []
    clearances = [world.physics.clearance]
    state, start, over = None, np.array([True]), False
    began = time.perf_counter()
    while not over:
        action, state = policy.predict(observation, state=state, episode_start=start, deterministic=True)
        observation, reward, terminated, truncated, info = env.step(action)
        joints.append(world.physics.joints.copy())
        contacts.append(world.physics.pose_contacts)
        clearances.append(world.physics.clearance)
        rewards.append(float(reward))
        start, over = np.array([False]), terminated or truncated
        if progress is not None and limit and len(rewards) % 50 == 0:
            progress("simulate", len(rewards) / limit)
    return Episode(
        joints=np.array(joints),
        rewards=np.array(rewards),
        contacts=tuple(contacts),
        clearances=np.array(clearances),
        success=bool(info["is_success"]),
        report=world.physics.report(),
        seconds=time.perf_counter() - began,
    )


def episode_facts(
    env: gym.Env[Any, Any],
    policy: Policy,
    seed: int | None = None,
    *,
    options: dict[str, Any] | None = None,
    deterministic: bool = True,
) -> dict[str, Any]:
    """Run one episode, and return what came of it, without its poses.

    Parameters
    ----------
    env : gymnasium.Env
        `HyperRedundantMaze-v0`, wrapped or not.
    policy : Policy
        Which acts.
    seed : int, optional
        For `env.reset`.
    options : dict, optional
        For `env.reset`, such as the `task_id`.
    deterministic : bool
        What the policy is asked for.

    Returns
    -------
    facts : dict
        `task_id`; `success`; `clean`, whether links merely pinched the walls; `steps`; `return`, the sum of
        rewards; `progress`, the share of the way at the end; `worst_depth` in a wall, in link lengths;
        `collisions`, how often the policy saw one; `pinches`, links summed over steps.
    """
    world: Any = env.unwrapped
    observation, info = env.reset(seed=seed, options=options)
    state, start, over, collisions = None, np.array([True]), False, 0
    while not over:
        action, state = policy.predict(
            observation, state=state, episode_start=start, deterministic=deterministic
        )
        observation, _, terminated, truncated, info = env.step(action)
        collisions += bool(info["collisions"])
        start, over = np.array([False]), terminated or truncated
    return {
        "task_id": info["task_id"],
        "success": bool(info["is_success"]),
        "clean": bool(world.physics.report().clean),
        "steps": int(info["total_steps"]),
        "return": float(info["total_reward"]),
        "progress": float(info["progress"]),
        "worst_depth": float(info["worst_depth"]) / world.arm.link_length,
        "collisions": collisions,
        "pinches": int(info["total_pinches"]),
    }


def simulate_motion(
    motion: Motion,
    maze: Maze,
    arm: ArmSpec | None = None,
    *,
    substeps: int = 4,
    progress: Progress | None = None,
) -> Episode:
    """Drive the simulated arm along a motion, with dynamic links and again with kinematic ones.

    Parameters
    ----------
    motion : Motion
        From the base of this maze; it need not be valid there.
    maze : Maze
        The maze.
    arm : ArmSpec, optional
        Gives the link radius. By default the arm that the motion was made for.
    substeps : int
        Simulated steps per action.
    progress : callable, optional
        Called with stage and share done.

    Returns
    -------
    episode : Episode
        Of the dynamic links. Its report holds the kinematic pass, in which no wall pushes and distances are
        exact.
    """
    motion.check_maze(maze)
    spec = motion.arm if arm is None else arm
    spec = dataclasses.replace(spec, n_links=motion.n_links)
    # Absolute targets: after a collision the arm goes on along the motion, and not beside it.
    policy = PlannedPolicy(motion, action="absolute")
    env = gym.make(
        ENV_ID,
        max_episode_steps=len(policy.actions) + 2,  # the arm is one substep behind its target
        maze=maze,
        link_length=spec.link_length,
        n_links=spec.n_links,
        link_radius=spec.link_radius,
        substeps=substeps,
        action="absolute",
        terminate_on_collision=False,
    )
    episode = run_episode(env, policy, progress=progress)
    env.close()
    exact = simulate(maze, spec, motion.feed, motion.joint_angles, substeps=substeps, kinematic=True)
    if progress is not None:
        progress("simulate", 1.0)
    return dataclasses.replace(episode, report=dataclasses.replace(episode.report, kinematic=exact))
