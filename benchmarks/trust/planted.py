"""Good motions and one fault planted in each, a little above or a little below what is allowed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, box

from hrsnake_env.arm import ArmSpec, joints_from_configuration
from hrsnake_env.maze import Maze
from planners.problem import Motion
from planners.validation import STEP_LIMIT

KINDS = (
    "length",
    "inconsistent",
    "feeder",
    "feed",
    "release",
    "start",
    "goal",
    "step",
    "penetration",
    "sweep",
    "thin wall",
    "crossing",
    "joint limit",
)
"""What can be planted: kinds of faults; "feed" is another "feeder", "thin wall" another "sweep"."""

NAMED = {"feed": "feeder", "thin wall": "sweep"}


def good_motion(rng):
    """Draw a valid motion: the arm is pushed in straight, then curls slowly; its room has no walls near."""
    length, n_links = float(rng.choice([1.0, 100.0])), int(rng.integers(3, 6))
    base = np.array([*rng.uniform(-5.0, 5.0, 2) * length, rng.uniform(-3.0, 3.0)])
    feed = np.linspace(0.0, n_links - rng.uniform(0.1, 0.9), 27 * n_links) * length
    rate = rng.uniform(-1.0, 1.0, n_links) * 0.04 / n_links**2
    rate[0] = 0.0  # in the feeder
    angles = rate * np.arange(40)[:, None]
    motion = Motion.from_configurations(
        np.concatenate([feed, np.full(40, feed[-1])]),
        np.concatenate([np.zeros((len(feed), n_links)), angles]),
        length,
        base,
    )
    return motion, room(motion)


def room(motion, *walls):
    """Build a wide room around a motion, with walls; the goal is at the tip of its last pose."""
    low, high = motion.joints.min(axis=(0, 1)), motion.joints.max(axis=(0, 1))
    margin = 6.0 * motion.link_length
    free = box(*(low - margin), *(high + margin))
    for wall in walls:
        free = free.difference(wall)
    return Maze(
        name="room",
        free_space=free,
        base_pose=motion.base_pose,
        goal=motion.joints[-1, -1],
        goal_radius=0.01 * motion.link_length,
    )


def plant(rng, kind, share):
    """Return motion, maze and arm with a fault of `share` times what is allowed planted in a good motion.

    The fault is there exactly if `share` is over 1.
    """
    motion, maze = good_motion(rng)
    arm = ArmSpec(link_length=motion.link_length)
    return PLANTERS[kind](rng, motion, maze, arm, share)


def _with_joints(motion, pose, change):
    joints = motion.joints.copy()
    joints[pose] = change(joints[pose])
    return replace(motion, joints=joints)


def _length(rng, motion, maze, arm, share):
    link, pose = rng.integers(motion.n_links), rng.integers(motion.n_poses)

    def stretch(joints):
        along = (joints[link + 1] - joints[link]) / motion.link_length
        joints[link + 1 :] += share * 1e-9 * motion.link_length * along
        return joints

    return _with_joints(motion, pose, stretch), maze, arm


def _inconsistent(rng, motion, maze, arm, share):
    way, pose = rng.uniform(0.0, 2 * math.pi), rng.integers(motion.n_poses)
    off = share * 1e-6 * motion.link_length * np.array([math.cos(way), math.sin(way)])
    return _with_joints(motion, pose, lambda joints: joints + off), maze, arm


def _feeder(rng, motion, maze, arm, share):
    """Bend two joints that are still behind the base, so that the one between leaves the axis."""
    angles = motion.joint_angles.copy()
    pose = rng.integers(1, 27)  # no base-side joint has passed
    link = rng.integers(motion.n_links - 2)
    turn = math.asin(share * 1e-6)
    angles[pose, link : link + 3] += np.array([1.0, -2.0, 1.0]) * turn
    return _remade(motion, angles=angles), maze, arm


def _feed(rng, motion, maze, arm, share):
    feed, off = motion.feed.copy(), share * 1e-6 * motion.link_length
    feed[rng.integers(1, 4)] = -off
    if rng.random() < 0.5:
        feed = motion.feed.copy()
        feed[-rng.integers(1, 9)] = motion.n_links * motion.link_length + off
    return _remade(motion, feed=feed), maze, arm


def _release(rng, motion, maze, arm, share):
    """Bend a joint that is a little past the base as far as the feeder lets it, and a little on."""
    past = (motion.feed[:, None] / motion.link_length) - motion.n_links + np.arange(motion.n_links)
    pose, joint = rng.permutation(np.argwhere((past > 1e-3) & (past < 0.1)))[0]
    angles = motion.joint_angles.copy()
    angles[pose, joint] = rng.choice([-1.0, 1.0]) * (16.0 * past[pose, joint] + share * 1e-6)
    return _remade(motion, angles=angles), maze, arm


def _start(rng, motion, maze, arm, share):
    off = share * 1e-6 * motion.link_length
    return _remade(motion, feed=np.concatenate([[off], motion.feed[1:]])), maze, arm


def _goal(rng, motion, maze, arm, share):
    way = rng.uniform(0.0, 2 * math.pi)
    off = share * maze.goal_radius * np.array([math.cos(way), math.sin(way)])
    return motion, replace(maze, goal=maze.goal + off), arm


def _step(rng, motion, maze, arm, share):
    pose, angles, feed = rng.integers(1, 27), motion.joint_angles, motion.feed.copy()
    feed[pose:] += share * STEP_LIMIT * motion.link_length - (feed[pose] - feed[pose - 1])
    kept = feed < motion.n_links * motion.link_length
    motion = Motion.from_configurations(feed[kept], angles[kept], motion.link_length, motion.base_pose)
    return motion, room(motion), arm


def _joint_limit(rng, motion, maze, arm, share):
    limit = float(np.abs(motion.joint_angles).max()) - share * 1e-9
    return motion, maze, replace(arm, joint_limit=limit)


def _penetration(rng, motion, maze, arm, share):
    """Put a block at a link of a pose, as deep in it as rounding, or as far off; the link may be thick."""
    radius = motion.link_length * float(rng.choice([0.0, 0.01, 0.2]))
    pose, link = rng.integers(motion.n_poses - 30, motion.n_poses), rng.integers(1, motion.n_links)
    one, other = motion.joints[pose, link : link + 2]
    along = (other - one) / motion.link_length
    across = np.array([-along[1], along[0]]) * rng.choice([-1.0, 1.0])
    # Less than allowed is free, as far as rounding lets one say so; a thin link may only touch.
    depth = motion.link_length * (share * 1e-9 if radius else (share - 1.0) * 1e-9)
    at = one + rng.uniform(0.5, 0.7) * (other - one) + (radius - depth) * across
    angle = math.atan2(across[1], across[0])
    block = affinity.rotate(box(0.0, -0.03, 0.05, 0.03), angle, origin=(0, 0), use_radians=True)
    scale = motion.link_length
    block = affinity.translate(affinity.scale(block, scale, scale, origin=(0, 0)), *at)
    # What comes before is another matter: the arm stands still, a pose later too.
    rest = slice(pose, pose + 1)
    still = Motion.from_configurations(
        motion.feed[rest], motion.joint_angles[rest], motion.link_length, motion.base_pose
    )
    return still, replace(room(motion, block), goal=maze.goal), replace(arm, link_radius=radius)


def _turning(motion, rng):
    """Return two poses between which the last link turns by 0.05 rad about its joint."""
    angles = motion.joint_angles[[-1, -1]].copy()
    angles[:, -1] += (-0.025, 0.025)
    feed = motion.feed[[-1, -1]]
    return Motion.from_configurations(feed, angles, motion.link_length, motion.base_pose)


def _needle(motion, start, width, time=0.5):
    """Build a needle along the last link at a time between two poses, from `start` links past its joint."""
    angles = motion.joint_angles[0] * (1 - time) + motion.joint_angles[1] * time
    one, other = joints_from_configuration(motion.feed[0], angles, motion.link_length, motion.base_pose)[-2:]
    along = other - one
    needle = affinity.scale(box(start, -width / 2, 1.5, width / 2), *[motion.link_length] * 2, origin=(0, 0))
    needle = affinity.rotate(needle, math.atan2(along[1], along[0]), origin=(0, 0), use_radians=True)
    return affinity.translate(needle, *one)


def _sweep(rng, motion, maze, arm, share):
    """Let the tip's arc reach over a wall between poses by a share of the tolerance, at neither of them."""
    motion = _turning(motion, rng)
    share = share if share > 1.0 else 0.85 * share  # the bound is not so tight that the last of it is free
    wall = _needle(motion, 1.0 - share * 1e-3, 0.02)  # thick enough for its depth to count
    return motion, room(motion, wall), arm


def _thin_wall(rng, motion, maze, arm, share):
    """Turn the tip's link over a thin wall between two poses, or just past its end."""
    motion = _turning(motion, rng)
    start = rng.uniform(0.3, 0.98) if share > 1.0 else rng.uniform(1.0003, 1.2)
    wall = _needle(motion, start, 10.0 ** rng.uniform(-9.0, -2.75), rng.uniform(0.2, 0.8))
    return motion, room(motion, wall), arm


def _crossing(rng, motion, maze, arm, share):
    """Curl thick links to within a share of twice their radius of each other."""
    angles = np.zeros((1, motion.n_links))
    angles[0, -2:] = rng.uniform(1.75, 1.9) * rng.choice([-1.0, 1.0])
    feed, length = [motion.n_links * motion.link_length], motion.link_length
    curled = Motion.from_configurations(feed, angles, length, motion.base_pose)
    links = [LineString(curled.joints[0, k : k + 2]) for k in range(curled.n_links)]
    apart = min(links[k].distance(links[j]) for k in range(len(links)) for j in range(k + 2, len(links)))
    return curled, room(curled), replace(arm, link_radius=apart / 2.0 * min(share, 1.2))


def _remade(motion, feed=None, angles=None):
    feed = motion.feed if feed is None else feed
    angles = motion.joint_angles if angles is None else angles
    return Motion.from_configurations(feed, angles, motion.link_length, motion.base_pose)


PLANTERS = {
    "length": _length,
    "inconsistent": _inconsistent,
    "feeder": _feeder,
    "feed": _feed,
    "release": _release,
    "start": _start,
    "goal": _goal,
    "step": _step,
    "penetration": _penetration,
    "sweep": _sweep,
    "thin wall": _thin_wall,
    "crossing": _crossing,
    "joint limit": _joint_limit,
}
