"""The arm as URDF: a prismatic feeder, and links that turn; the names of its joints are the trajectory's.

The root link is the maze: its origin and axes are those of the maze, in metres. At zero positions the whole
arm is straight in the feeder, with its tip at the base.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as Xml
from collections.abc import Sequence

from hrsnake_env.arm import ArmSpec, FloatArray
from planners.export.trajectory import TrajectoryLimits
from planners.problem import Motion
from planners.spatial.kinematics import base_frame
from planners.spatial.problem import SpatialMotion

__all__ = ["urdf_bytes"]

DENSITY = 1000.0
"""Of the links, in kg per cubic metre: plastic with motors in it, on average that of water."""

SHOWN_RADIUS = 0.02
"""Of thin links where they are shown and have mass, in link lengths: a line has neither."""

CLOSE_RADIUS = 0.001
"""Of thin links where they collide, in link lengths: the pinch tolerance."""

EFFORT = 1000.0
"""In N m and N: URDF asks for a limit, which the planner does not know."""


def urdf_bytes(
    motion: Motion | SpatialMotion, arm: ArmSpec, limits: TrajectoryLimits, metres_per_unit: float, name: str
) -> bytes:
    """Return the arm of a motion as URDF.

    Parameters
    ----------
    motion : Motion or SpatialMotion
        Gives the number of links, their length, and the base.
    arm : ArmSpec
        Gives link radius and joint limit.
    limits : TrajectoryLimits
        Give the speeds.
    metres_per_unit : float
        URDF counts in metres.
    name : str
        Of the robot.
    """
    planar, full = isinstance(motion, Motion), limits.for_links(motion.link_length)
    assert full.feed_speed is not None  # filled in
    length, n_links = metres_per_unit * motion.link_length, motion.n_links
    radius = metres_per_unit * arm.link_radius
    turn = (-(arm.joint_limit or math.pi), arm.joint_limit or math.pi, full.joint_speed)
    robot = Xml.Element("robot", name=re.sub(r"[^A-Za-z0-9_.-]", "_", f"hrsnake_{name}"))
    Xml.SubElement(robot, "link", name="maze")
    Xml.SubElement(robot, "link", name="base")
    place, angles = _base(motion, metres_per_unit)
    _joint(robot, "base_in_maze", "fixed", "maze", "base", place, angles)
    _solid(robot, "feeder", 0.1 * length, _shown(radius, length), None)
    slide = (0.0, n_links * length, full.feed_speed * metres_per_unit)
    start = (-n_links * length, 0.0, 0.0)
    _joint(robot, "feed", "prismatic", "base", "feeder", start, axis="1 0 0", limits=slide)
    parent, place = "feeder", (0.0, 0.0, 0.0)
    for k in range(n_links):
        link = f"link_{k}"
        if planar:
            _joint(robot, f"joint_{k}", "revolute", parent, link, place, axis="0 0 1", limits=turn)
        else:
            knuckle = f"knuckle_{k}"
            _solid(robot, knuckle, 0.1 * length, _shown(radius, length), None)
            _joint(robot, f"joint_{k}_yaw", "revolute", parent, knuckle, place, axis="0 0 1", limits=turn)
            _joint(robot, f"joint_{k}_pitch", "revolute", knuckle, link, axis="0 -1 0", limits=turn)
        _solid(robot, link, length, _shown(radius, length), max(radius, CLOSE_RADIUS * length))
        parent, place = link, (length, 0.0, 0.0)
    Xml.SubElement(robot, "link", name="tip")
    _joint(robot, "tip_of_arm", "fixed", parent, "tip", place)
    Xml.indent(robot)
    return b'<?xml version="1.0"?>\n' + Xml.tostring(robot) + b"\n"


def _shown(radius: float, length: float) -> float:
    return radius if radius > 0.0 else SHOWN_RADIUS * length


def _base(motion: Motion | SpatialMotion, metres_per_unit: float) -> tuple[Sequence[float], Sequence[float]]:
    """Return where the base is in the maze, in metres, and roll, pitch and yaw of its axes."""
    if isinstance(motion, Motion):
        x, y, heading = motion.base_pose
        return (metres_per_unit * x, metres_per_unit * y, 0.0), (0.0, 0.0, float(heading))
    axes: FloatArray = base_frame(motion.base_pose).T
    roll = math.atan2(axes[2, 1], axes[2, 2])
    pitch = math.atan2(-axes[2, 0], math.hypot(axes[0, 0], axes[1, 0]))
    yaw = math.atan2(axes[1, 0], axes[0, 0])
    if math.hypot(axes[0, 0], axes[1, 0]) < 1e-9:  # vertical: yaw and roll turn about one axis
        roll, yaw = 0.0, math.atan2(-axes[0, 1], axes[1, 1])
    return [metres_per_unit * float(value) for value in motion.base_pose[:3]], (roll, pitch, yaw)


def _text(values: Sequence[float] | FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _joint(
    robot: Xml.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    place: Sequence[float] = (0.0, 0.0, 0.0),
    angles: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    axis: str | None = None,
    limits: tuple[float, float, float] | None = None,
) -> None:
    joint = Xml.SubElement(robot, "joint", name=name, type=kind)
    Xml.SubElement(joint, "parent", link=parent)
    Xml.SubElement(joint, "child", link=child)
    Xml.SubElement(joint, "origin", xyz=_text(place), rpy=_text(angles))
    if axis is not None:
        Xml.SubElement(joint, "axis", xyz=axis)
    if limits is not None:
        lower, upper, velocity = map(repr, map(float, limits))
        Xml.SubElement(joint, "limit", lower=lower, upper=upper, velocity=velocity, effort=repr(EFFORT))


def _solid(robot: Xml.Element, name: str, length: float, radius: float, close: float | None) -> None:
    """Add a link along x: a cylinder with mass, shown as a capsule; one of radius `close` is to be hit."""
    link = Xml.SubElement(robot, "link", name=name)
    mass = DENSITY * math.pi * radius**2 * length
    inertial = Xml.SubElement(link, "inertial")
    Xml.SubElement(inertial, "origin", xyz=_text((length / 2.0, 0.0, 0.0)), rpy="0 0 0")
    Xml.SubElement(inertial, "mass", value=repr(mass))
    along, across = mass * radius**2 / 2.0, mass * (3.0 * radius**2 + length**2) / 12.0
    moments = {"ixx": along, "iyy": across, "izz": across, "ixy": 0.0, "ixz": 0.0, "iyz": 0.0}
    Xml.SubElement(inertial, "inertia", {key: repr(value) for key, value in moments.items()})
    _capsule(link, "visual", length, radius)
    if close is not None:
        _capsule(link, "collision", length, close)


def _capsule(link: Xml.Element, what: str, length: float, radius: float) -> None:
    for place in (0.0, length):
        part = Xml.SubElement(link, what)
        Xml.SubElement(part, "origin", xyz=_text((place, 0.0, 0.0)), rpy="0 0 0")
        Xml.SubElement(Xml.SubElement(part, "geometry"), "sphere", radius=repr(radius))
    part = Xml.SubElement(link, what)
    Xml.SubElement(part, "origin", xyz=_text((length / 2.0, 0.0, 0.0)), rpy=_text((0.0, math.pi / 2.0, 0.0)))
    Xml.SubElement(Xml.SubElement(part, "geometry"), "cylinder", radius=repr(radius), length=repr(length))
