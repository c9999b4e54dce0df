"""Motions that somebody sent: read without trust, and checked."""

from __future__ import annotations

import io
import math
import zipfile
from dataclasses import replace

import numpy as np

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.problem import KEYS, Motion, Progress, ValidationReport, write_motion_arrays
from planners.studio.requests import Arm, decoded
from planners.validation import validate

__all__ = ["arm_spec", "checked", "motion_bytes", "motion_from"]

MOTION_BYTES = 256 * 2**20
"""That the arrays of a motion may take when they are unpacked."""

MOTION_MEMBERS = 16
"""That a file of a motion may hold."""


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
    raw = decoded(data, "a motion")
    try:
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            members = archive.infolist()
    except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError):
        raise InputError("Expected a motion (.npz), got a file that is not one.") from None
    if len(members) > MOTION_MEMBERS or sum(member.file_size for member in members) > MOTION_BYTES:
        raise InputError(
            f"Expected a motion of at most {MOTION_BYTES // 2**20} MiB unpacked, got a larger file."
        )
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as arrays:
            values = {key: np.asarray(arrays[key]) for key in KEYS}  # what is no array comes as bytes
    except MemoryError:
        raise
    except Exception:  # numpy raises whatever its parsers stumble over
        raise InputError(
            f"Expected a motion (.npz) with the keys {', '.join(KEYS)}, got another file."
        ) from None
    if any(array.dtype.kind not in "fiu" for array in values.values()) or values["link_length"].size != 1:
        raise InputError("Expected a motion of numbers, with one link_length.")
    if values["joint_angles"].ndim == 3:
        raise InputError("Expected a motion in the plane, got one in space.")
    length = float(values.pop("link_length").item())
    return Motion(link_length=length, **values)


def motion_bytes(motion: Motion) -> bytes:
    """Return a motion as a file (.npz)."""
    file = io.BytesIO()
    write_motion_arrays(file, motion)
    return file.getvalue()
