"""Checks of the arm alone: lengths, configuration, feeder, start and goal, steps, joint limits."""

from __future__ import annotations

import numpy as np

from planners.checks.tolerances import ROUNDING, STEP_LIMIT
from planners.problem import Fault
from planners.spatial.checks.scene import Scene, joint_fault, worst_of
from planners.spatial.kinematics import joints_from_configuration

TURN_LIMIT = 1.0
"""Largest turn of a joint between two poses, in rad: with more, links could sweep about and come back."""


def check_lengths(scene: Scene) -> tuple[float, Fault | None]:
    """Check that every link has its exact length; return the largest deviation too."""
    lengths = np.linalg.norm(np.diff(scene.motion.joints, axis=1), axis=2)
    amount, pose, link = worst_of(np.abs(lengths - scene.length))
    if amount <= scene.length_slack:
        return amount, None
    figure = f"{lengths[pose, link]:.9g} {scene.workspace.units}"
    message = f"Link {link} is {figure} long at pose {pose}, not {scene.length:g}."
    return amount, joint_fault(scene, "length", message, pose, link, amount)


def check_consistency(scene: Scene) -> Fault | None:
    """Check that the joints are where feed and joint angles put them."""
    amount, pose, joint = worst_of(np.linalg.norm(scene.motion.joints - scene.placed, axis=2))
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
    offset = motion.joints - motion.base_pose[:3]
    along = offset @ motion.base_pose[3:]
    across = np.linalg.norm(offset - along[..., None] * motion.base_pose[3:], axis=2)
    aside = np.maximum(across[:, :-1], across[:, 1:])
    aside = np.where(np.diff(along, axis=1) > 0.0, aside, scene.length)  # it points backward
    aside = np.where(held, aside, 0.0)
    aside[:, 0] = np.maximum(aside[:, 0], across[:, 0])
    amount, pose, link = worst_of(aside)
    if amount <= scene.place_slack:
        return None
    message = f"Link {link}, still held by the feeder, is {scene.figure(amount)} off its axis at pose {pose}."
    return joint_fault(scene, "feeder", message, pose, link, amount)


def check_start(scene: Scene) -> Fault | None:
    """Check that the whole arm starts in the feeder, with the tip at the base."""
    motion = scene.motion
    straight = np.zeros((1, motion.n_links, 2))
    wanted = joints_from_configuration([0.0], straight, scene.length, motion.base_pose)[0]
    distances = np.linalg.norm(motion.joints[0] - wanted, axis=1)
    joint = int(np.argmax(distances))
    if distances[joint] <= scene.place_slack:
        return None
    amount = float(distances[joint])
    message = f"Joint {joint} starts {scene.figure(amount)} from its place with the whole arm in the feeder."
    return joint_fault(scene, "start", message, 0, joint, amount)


def check_goal(scene: Scene) -> tuple[float, Fault | None]:
    """Check that the tip ends inside the goal radius; return its distance from the goal too."""
    motion, radius = scene.motion, scene.workspace.goal_radius
    distance = float(np.linalg.norm(motion.joints[-1, -1] - scene.workspace.goal))
    if distance <= radius:
        return distance, None
    message = f"The tip ends {scene.figure(distance)} from the goal, outside its radius of {radius:g}."
    return distance, joint_fault(scene, "goal", message, motion.n_poses - 1, motion.n_links, distance)


def check_steps(scene: Scene) -> tuple[float, Fault | None]:
    """Check that no joint moves or turns too far between two poses; return the largest movement too."""
    if scene.motion.n_poses == 1:
        return 0.0, None
    turns = np.linalg.norm(np.diff(scene.motion.joint_angles, axis=0), axis=2)
    turn, pose, joint = worst_of(turns)
    if turn > TURN_LIMIT:
        figure = f"{turn:.6g} rad, more than {TURN_LIMIT:g}"
        message = f"Joint {joint} turns by {figure}, between poses {pose} and {pose + 1}."
        moved = float(np.linalg.norm(np.diff(scene.motion.joints, axis=0), axis=2).max())
        return moved, joint_fault(scene, "step", message, pose, joint, turn)
    steps = np.linalg.norm(np.diff(scene.motion.joints, axis=0), axis=2)
    amount, pose, joint = worst_of(steps)
    if amount <= STEP_LIMIT * scene.length * (1.0 + ROUNDING):
        return amount, None
    figure = f"{scene.figure(amount)}, more than {STEP_LIMIT:g}"
    message = f"Joint {joint} moves {figure}, between poses {pose} and {pose + 1}."
    return amount, joint_fault(scene, "step", message, pose, joint, amount)


def check_joint_limit(scene: Scene, limit: float | None) -> Fault | None:
    """Check that the joint limit holds; between poses too, as the bend is convex in the two angles."""
    angles = scene.motion.joint_angles
    amount, pose, joint = worst_of(np.hypot(angles[..., 0], angles[..., 1]))
    if limit is None or amount <= limit + ROUNDING:
        return None
    message = f"Joint {joint} turns by {amount:.6g} rad at pose {pose}; the limit is {limit:g} rad."
    return joint_fault(scene, "joint limit", message, pose, joint, amount)
