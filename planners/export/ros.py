"""Trajectories as ROS 2 messages, `trajectory_msgs/msg/JointTrajectory`.

``ros2 topic pub /TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)"`` reads both texts. It reads
YAML 1.1, of which the JSON written here is a part: numbers have a point before an exponent, for without it
they would be strings there. Linux passes at most 128 KiB in one argument: longer messages have to be read
from the file, or sampled at a lower rate.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.export.trajectory import Trajectory

__all__ = ["message_json", "message_yaml"]


def message_yaml(trajectory: Trajectory, metres_per_unit: float) -> bytes:
    """Return the message as YAML.

    Parameters
    ----------
    trajectory : Trajectory
        The trajectory.
    metres_per_unit : float
        The feed is a prismatic joint, in metres.
    """
    lines = ["header:", "  stamp: {sec: 0, nanosec: 0}", "  frame_id: ''", "joint_names:"]
    lines += [f"- {name}" for name in trajectory.joint_names]
    lines.append("points:")
    for positions, velocities, accelerations, sec, nanosec in _points(trajectory, metres_per_unit):
        lines += [
            f"- positions: {positions}",
            f"  velocities: {velocities}",
            f"  accelerations: {accelerations}",
            "  effort: []",
            f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}",
        ]
    return ("\n".join(lines) + "\n").encode()


def message_json(trajectory: Trajectory, metres_per_unit: float) -> bytes:
    """Return the message as JSON; see `message_yaml`."""
    names = ", ".join(f'"{name}"' for name in trajectory.joint_names)
    points = [
        f'{{"positions": {positions}, "velocities": {velocities}, "accelerations": {accelerations}, '
        f'"effort": [], "time_from_start": {{"sec": {sec}, "nanosec": {nanosec}}}}}'
        for positions, velocities, accelerations, sec, nanosec in _points(trajectory, metres_per_unit)
    ]
    header = '{"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}'
    text = f'{{"header": {header}, "joint_names": [{names}], "points": [\n' + ",\n".join(points) + "\n]}\n"
    return text.encode()


def _points(trajectory: Trajectory, metres_per_unit: float) -> Iterator[tuple[str, str, str, int, int]]:
    nanoseconds = np.rint(1e9 * trajectory.time).astype(np.int64).tolist()
    tables = trajectory.table(metres_per_unit)
    for number, when in enumerate(nanoseconds):
        sec, nanosec = divmod(when, 1_000_000_000)
        positions, velocities, accelerations = (_row(table[number]) for table in tables)
        yield positions, velocities, accelerations, sec, nanosec


def _row(values: FloatArray) -> str:
    return "[" + ", ".join(map(_number, values.tolist())) + "]"


def _number(value: float) -> str:
    text = repr(value)
    if "e" not in text or "." in text:
        return text
    mantissa, exponent = text.split("e")
    return f"{mantissa}.0e{exponent}"
