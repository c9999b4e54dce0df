"""Checks of the arm alone: lengths, configuration, feeder, start and goal, steps, joint limits."""

from __future__ import annotations

import math

import numpy as np

from hrsnake_env.arm import FloatArray, feeder_angle_limits, joints_from_configuration
from planners.checks.scene import Scene, joint_fault, worst_of
from planners.checks.tolerances import ROUNDING, STEP_LIMIT
from planners.problem import Fault

ANGLE_SLACK = 1e-6
"""Of the angles that the feeder leaves, in rad."""


def check_lengths(scene: Scene) -> tuple[float, Fault | None]:
    """Check that every link has its exact length; return the largest deviation too."""
    lengths = np.linalg.norm(np.diff(scene.motion.joints, axis=1), axis=2)
    amount, pose, link = worst_of(np.abs(lengths - scene.length))
    if amount <= scene.length_slack:
        return amount, None
    figure = f"{lengths[pose, link]:.9g} {scene.maze.units}"
    message = f"Link {link} is {figure} long at pose {pose}, not {scene.length:g}."
    return amount, joint_fault(scene, "length", message, pose, link, amount)


def check_consistency(scene: Scene, astray: FloatArray) -> Fault | None:
    """Check that the joints are where feed and joint angles put them; `astray` is how far off, by pose."""
    motion, pose = scene.motion, int(np.argmax(astray))
    joints = joints_from_configuration(
        motion.feed[pose], motion.joint_angles[pose], motion.link_length, motion.base_pose
    )
    amount, _, joint = worst_of(np.linalg.norm(motion.joints[pose] - joints, axis=1)[None])
    if amount <= scene.place_slack:
        return None
    message = (
        f"Joint {joint} is {scene.figure(amount)} from where feed and joint angles put it at pose {pose}."
    )
    return joint_fault(scene, "inconsistent", message, pose, joint, amount)


def check_feeder(scene: Scene) -> Fault | None:
    """Check that links leave the feeder's axis only when their base-side joint has passed the base."""
    motion, whole = scene.motion, scene.motion.n_links * scene.length
    excess = np.maximum(motion.feed - whole, -motion.feed)
    pose = int(np.argmax(excess))
    if excess[pose] > scene.place_slack:
        message = (
            f"The feed is {scene.figure(motion.feed[pose])} at pose {pose}, not between 0 and {whole:g}."
        )
        return joint_fault(scene, "feeder", message, pose, 0, float(excess[pose]))
    behind = scene.arc[:, :-1] < -scene.length_slack
    # A link is held until its base-side joint has passed, so still at the pose after one with the joint
    # behind; and likewise on the way back.
    held = behind.copy()
    held[1:] |= behind[:-1]
    held[:-1] |= behind[1:]
    x, y, heading = motion.base_pose
    along = (motion.joints - (x, y)) @ (math.cos(heading), math.sin(heading))
    across = np.abs((motion.joints - (x, y)) @ (-math.sin(heading), math.cos(heading)))
    aside = np.maximum(across[:, :-1], across[:, 1:])
    aside = np.where(np.diff(along, axis=1) > 0.0, aside, scene.length)  # it points backward
    aside = np.where(held, aside, 0.0)
    aside[:, 0] = np.maximum(aside[:, 0], across[:, 0])
    amount, pose, link = worst_of(aside)
    if amount <= scene.place_slack:
        return None
    message = f"Link {link}, still held by the feeder, is {scene.figure(amount)} off its axis at pose {pose}."
    return joint_fault(scene, "feeder", message, pose, link, amount)


def check_release(scene: Scene) -> Fault | None:
    """Check that joints bend no faster than the feeder lets go of them.

    Between poses too: angles are linear in the feed there, and the limit of a joint past the base is concave.
    """
    motion = scene.motion
    limits = feeder_angle_limits(motion.feed, motion.n_links, motion.link_length)
    amount, pose, joint = worst_of(np.abs(motion.joint_angles) - limits)
    if amount <= ANGLE_SLACK:
        return None
    angle = abs(motion.joint_angles[pose, joint])
    message = (
        f"Joint {joint}, just past the base, is bent by {angle:.4g} rad at pose {pose}, where the feeder "
        f"lets it bend by {limits[pose, joint]:.4g}."
    )
    return joint_fault(scene, "release", message, pose, joint, amount)


def check_start(scene: Scene) -> Fault | None:
    """Check that the whole arm starts in the feeder, with the tip at the base."""
    motion = scene.motion
    wanted = joints_from_configuration(0.0, np.zeros(motion.n_links), scene.length, motion.base_pose)
    distances = np.linalg.norm(motion.joints[0] - wanted, axis=1)
    joint = int(np.argmax(distances))
    if distances[joint] <= scene.place_slack:
        return None
    amount = float(distances[joint])
    message = f"Joint {joint} starts {scene.figure(amount)} from its place with the whole arm in the feeder."
    return joint_fault(scene, "start", message, 0, joint, amount)


def check_goal(scene: Scene) -> tuple[float, Fault | None]:
    """Check that the tip ends inside the goal radius; return its distance from the goal too."""
    motion, radius = scene.motion, scene.maze.goal_radius
    distance = float(np.linalg.norm(motion.joints[-1, -1] - scene.maze.goal))
    if distance <= radius:
        return distance, None
    message = f"The tip ends {scene.figure(distance)} from the goal, outside its radius of {radius:g}."
    return distance, joint_fault(scene, "goal", message, motion.n_poses - 1, motion.n_links, distance)


def check_steps(scene: Scene) -> tuple[float, Fault | None]:
    """Check that no joint moves too far between two poses; return the largest movement too."""
    if scene.motion.n_poses == 1:
        return 0.0, None
    steps = np.linalg.norm(np.diff(scene.motion.joints, axis=0), axis=2)
    amount, pose, joint = worst_of(steps)
    if amount <= STEP_LIMIT * scene.length * (1.0 + ROUNDING):
        return amount, None
    figure = f"{scene.figure(amount)}, more than {STEP_LIMIT:g}"
    message = f"Joint {joint} moves {figure}, between poses {pose} and {pose + 1}."
    return amount, joint_fault(scene, "step", message, pose, joint, amount)


def check_joint_limit(scene: Scene, limit: float | None) -> Fault | None:
    """Check that the joint limit holds."""
    amount, pose, joint = worst_of(np.abs(scene.motion.joint_angles))
    if limit is None or amount <= limit + ROUNDING:
        return None
    message = f"Joint {joint} turns by {amount:.6g} rad at pose {pose}; the limit is {limit:g} rad."
    return joint_fault(scene, "joint limit", message, pose, joint, amount)
