"""Trajectories out: a motion with time, checked, in the formats that controllers and people read."""

from planners.export.checking import check_trajectory, largest_shares, safe_trajectory
from planners.export.formats import EXPORTS, Export, export, export_bytes, format_for, save_export
from planners.export.timing import fastest_duration, time_parametrise
from planners.export.trajectory import DEFAULT_RATE, ExportRefused, Trajectory, TrajectoryLimits

__all__ = [
    "DEFAULT_RATE",
    "EXPORTS",
    "Export",
    "ExportRefused",
    "Trajectory",
    "TrajectoryLimits",
    "check_trajectory",
    "export",
    "export_bytes",
    "fastest_duration",
    "format_for",
    "largest_shares",
    "safe_trajectory",
    "save_export",
    "time_parametrise",
]
