"""Random motions, and mazes around them in which walls are where links come by."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely import affinity
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.arm import ArmSpec, joints_from_configuration
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.problem import Motion


@dataclass(frozen=True)
class Case:
    """Hold what is checked, and lines inside thin walls that no link may cross."""

    motion: Motion
    maze: Maze
    arm: ArmSpec
    cores: tuple[LineString, ...] = ()


def draw_case(rng, thin=0.3):
    """Draw a case; `thin` is the share of walls that are thinner than a checker by depth would see."""
    for _ in range(100):
        length = float(rng.choice([1.0, 100.0, 0.01, 3e4]))
        base = np.array([*rng.uniform(-20.0, 20.0, 2) * length, rng.uniform(-4.0, 4.0)])
        if rng.random() < 0.3:
            base = np.array([0.0, 0.0, rng.integers(0, 4) * math.pi / 2])
        motion = draw_motion(rng, length, base)
        radius = float(rng.choice([0.0, 0.0, 1e-4, 5e-4, 0.004, 0.05, 0.3])) * length
        try:
            maze, cores = draw_maze(rng, motion, radius, thin)
        except (InputError, shapely.errors.GEOSException):
            continue  # the base or the goal was in a wall
        limit = None if rng.random() < 0.5 else float(rng.choice([0.1, 0.5, math.pi]))
        return Case(motion, maze, ArmSpec(link_length=length, link_radius=radius, joint_limit=limit), cores)
    raise AssertionError("no maze in 100 draws")


def draw_motion(rng, length, base):
    """Draw a motion of 1 to 5 links and 1 to 12 poses; some break the rules."""
    n_links, n_poses = int(rng.integers(1, 6)), int(rng.integers(1, 13))
    feed = float(rng.choice([rng.uniform(0.0, n_links), n_links, rng.integers(0, n_links + 1)]))
    push = float(rng.choice([0.0, 0.02, -0.02, 0.3], p=[0.4, 0.3, 0.25, 0.05])) * rng.random()
    feeds = feed + push * np.arange(n_poses)
    if rng.random() < 0.95:
        feeds = np.clip(feeds, 0.0, n_links)
    bend = float(rng.choice([0.0, 0.3, 1.0, 2.5], p=[0.1, 0.3, 0.4, 0.2]))
    rate = float(rng.choice([0.0, 0.003, 0.02, 0.3, 1.0], p=[0.05, 0.3, 0.4, 0.2, 0.05]))
    turns = rng.uniform(-rate, rate, n_links) + rng.normal(size=(n_poses, n_links)) * rate * 0.1
    angles = rng.uniform(-bend, bend, n_links) + np.cumsum(turns, axis=0)
    if rng.random() < 0.02:
        angles[-1, -1] = math.pi
    if rng.random() < 0.9:  # what the feeder holds is straight
        past = feeds[:, None] - n_links + np.arange(n_links)
        held = np.minimum(past, np.minimum(np.roll(past, 1, axis=0), np.roll(past, -1, axis=0))) <= 0.0
        angles = np.where(held, 0.0, np.clip(angles, -16.0 * past.clip(0.0), 16.0 * past.clip(0.0)))
    motion = Motion.from_configurations(feeds * length, angles, length, base)
    if rng.random() < 0.15:  # joints that are not quite where they belong
        joints = motion.joints.copy()
        pose, joint = rng.integers(n_poses), rng.integers(n_links + 1)
        joints[pose, joint:] += rng.normal(size=2) * length * 10.0 ** rng.uniform(-11.0, -2.0)
        motion = replace(motion, joints=joints)
    return motion


def draw_maze(rng, motion, radius, thin):
    """Draw a room around a motion with a few walls, most of them near links or exactly at them."""
    length, base = motion.link_length, Point(motion.base_pose[:2])
    low, high = motion.joints.min(axis=(0, 1)), motion.joints.max(axis=(0, 1))
    margin = length * rng.uniform(0.0 if rng.random() < 0.2 else 0.2, 2.0)
    free, cores = box(*(low - margin), *(high + margin)), []
    for _ in range(int(rng.integers(0, 5))):
        wall, core = draw_wall(rng, motion, radius, thin)
        if wall.distance(base) < 1e-3 * length:
            continue
        free = free.difference(wall)
        cores += [core] if core is not None else []
    tip = motion.joints[-1, -1]
    goal = tip + rng.normal(size=2) * length * float(rng.choice([0.0, 0.1, 1.0]))
    goal_radius = length * float(rng.choice([1e-3, 0.1, 0.3]))
    maze = Maze(name="case", free_space=free, base_pose=motion.base_pose, goal=goal, goal_radius=goal_radius)
    return maze, tuple(core for core in cores if not core.intersects(maze.free_space))


def draw_wall(rng, motion, radius, thin):
    """Draw an obstacle beside a link or across it, and the line no link may cross if it is a thin one."""
    length = motion.link_length
    pose, link = rng.integers(motion.n_poses), rng.integers(motion.n_links)
    one, other = motion.joints[pose, link : link + 2]
    if rng.random() < 0.5 and pose + 1 < motion.n_poses:  # where the link is between two poses
        part = rng.random()
        feed, angles = (a[pose] * (1 - part) + a[pose + 1] * part for a in (motion.feed, motion.joint_angles))
        joints = joints_from_configuration(feed, angles, length, motion.base_pose)
        one, other = joints[link : link + 2]
    share = float(rng.choice([0.0, 1.0, rng.random(), rng.uniform(-0.3, 1.3)]))
    along = (other - one) / max(np.linalg.norm(other - one), 1e-300)
    across = np.array([-along[1], along[0]]) * rng.choice([-1.0, 1.0])
    off = radius + length * float(rng.choice([0.0, 10.0 ** rng.uniform(-6.0, -1.0), rng.uniform(-0.1, 0.5)]))
    at, angle = one + share * (other - one) + off * across, math.atan2(along[1], along[0])
    if rng.random() < thin:
        size, width = length * rng.uniform(0.1, 1.5), length * 10.0 ** rng.uniform(-5.0, -2.5)
        turn = angle + float(rng.choice([0.0, math.pi / 2, rng.uniform(0.0, 3.2)]))
        wall = affinity.rotate(box(-size / 2, 0.0, size / 2, width), turn, origin=(0, 0), use_radians=True)
        trim = min(size / 4, 4e-3 * length)  # the very end of a wall may be passed
        core = LineString([(trim - size / 2, width / 2), (size / 2 - trim, width / 2)])
        core = affinity.rotate(core, turn, origin=(0, 0), use_radians=True)
        return affinity.translate(wall, *at), affinity.translate(core, *at)
    kind = rng.integers(4)
    if kind == 0:  # a block whose side lies along the link
        sides = length * rng.uniform(0.02, 0.8, 2)
        corners = [
            at,
            at + along * sides[0],
            at + along * sides[0] + across * sides[1],
            at + across * sides[1],
        ]
        return Polygon(corners), None
    if kind == 1:  # a block along the axes
        return box(*at, *(at + length * rng.uniform(0.02, 0.6, 2))), None
    if kind == 2:  # a wedge that points at the link
        width, height = length * rng.uniform(0.02, 0.5), length * rng.uniform(0.1, 0.8)
        return Polygon([at, at + across * height + along * width, at + across * height - along * width]), None
    points = at + length * rng.uniform(0.05, 0.4) * rng.normal(size=(6, 2))
    return shapely.convex_hull(shapely.multipoints(points)), None
