"""Motions that somebody sent: read without trust, and checked."""

from __future__ import annotations

import io
import math
from dataclasses import replace

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.problem import Motion, Progress, ValidationReport, motion_values, write_motion_arrays
from planners.reading import NotReadable, read_arrays
from planners.studio.requests import Arm, decoded
from planners.validation import validate

__all__ = ["arm_spec", "checked", "motion_bytes", "motion_from"]


def arm_spec(arm: Arm) -> ArmSpec:
    """Return the arm that a request describes."""
    limit = None if arm.joint_limit_deg is None else math.radians(arm.joint_limit_deg)
    return ArmSpec(
        link_length=arm.link_length, n_links=arm.n_links, link_radius=arm.link_radius, joint_limit=limit
    )


def checked(arm: Arm, motion: Motion, maze: Maze, progress: Progress) -> tuple[ArmSpec, ValidationReport]:
    """Check a motion that somebody sent exactly; return the arm with as many links as it has, and the report.

    Raises
    ------
    InputError
        If it belongs to another arm or another maze.
    """
    spec = arm_spec(arm)
    if spec.n_links is not None and spec.n_links != motion.n_links:
        raise InputError(f"Expected a motion of {spec.n_links} links, got one of {motion.n_links}.")
    spec = replace(spec, n_links=motion.n_links)
    return spec, validate(motion, maze, spec, progress)


def motion_from(data: str) -> Motion:
    """Read a motion (.npz in base64) that somebody sent.

    Raises
    ------
    InputError
        If it does not hold a motion, or would be too large when it is unpacked.
    """
    try:
        values = motion_values(read_arrays(io.BytesIO(decoded(data, "a motion"))))
    except NotReadable as got:
        raise InputError(f"Expected a motion (.npz), got {got}.") from None
    if values["joint_angles"].ndim == 3:
        raise InputError("Expected a motion in the plane, got one in space.")
    return Motion(**values)


def motion_bytes(motion: Motion) -> bytes:
    """Return a motion as a file (.npz)."""
    file = io.BytesIO()
    write_motion_arrays(file, motion)
    return file.getvalue()
