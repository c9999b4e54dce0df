"""Trajectories as tables: CSV, JSON, NPZ."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np

from planners.export.trajectory import Trajectory

__all__ = ["csv_bytes", "json_bytes", "npz_bytes"]

ARRAYS = (
    "time",
    "feed",
    "joint_angles",
    "feed_velocity",
    "joint_velocities",
    "feed_acceleration",
    "joint_accelerations",
    "base_pose",
)


def csv_bytes(trajectory: Trajectory) -> bytes:
    """Return a trajectory as CSV: a header with units, then a row per sample.

    Columns: time; positions, velocities and accelerations of the feed and of each joint. Numbers are written
    so that they are read back exactly.
    """
    names, units = trajectory.joint_names, [trajectory.units, *["rad"] * (len(trajectory.joint_names) - 1)]
    header = ["time_s"]
    for what, per in (("", ""), ("_velocity", "_per_s"), ("_acceleration", "_per_s2")):
        header += [f"{name}{what}_{unit}{per}" for name, unit in zip(names, units, strict=True)]
    rows = np.concatenate([trajectory.time[:, None], *trajectory.table()], axis=1)
    lines = [",".join(header), *(",".join(map(repr, row)) for row in rows.tolist())]
    return ("\n".join(lines) + "\n").encode()


def json_bytes(trajectory: Trajectory) -> bytes:
    """Return a trajectory as one JSON object, with the arrays of `Trajectory` as lists."""
    arrays = {name: getattr(trajectory, name).tolist() for name in ARRAYS}
    return (json.dumps({**_facts(trajectory), **arrays}) + "\n").encode()


def npz_bytes(trajectory: Trajectory) -> bytes:
    """Return a trajectory as .npz, with the arrays of `Trajectory` under their names."""
    file = io.BytesIO()
    arrays: dict[str, Any] = {key: np.asarray(value) for key, value in _facts(trajectory).items()}
    arrays |= {name: getattr(trajectory, name) for name in ARRAYS}
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _facts(trajectory: Trajectory) -> dict[str, Any]:
    return {
        "joint_names": list(trajectory.joint_names),
        "units": trajectory.units,
        "link_length": trajectory.link_length,
        "duration": trajectory.duration,
        "n_poses": trajectory.n_poses,
        "deviation": trajectory.deviation,
    }
