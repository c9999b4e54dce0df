"""The same in three dimensions: workspaces of boxes, path following, and the joint track in space."""

from planners.spatial.following import MappingError, follow_path, mapping_error
from planners.spatial.longest import SpatialLongest, longest_link
from planners.spatial.panel import Panel
from planners.spatial.planning import PLANNERS, plan
from planners.spatial.problem import SpatialMotion, SpatialResult
from planners.spatial.rooms import ROOMS, load_workspace, random_room
from planners.spatial.validation import validate
from planners.spatial.workspace import Workspace

__all__ = [
    "PLANNERS",
    "ROOMS",
    "MappingError",
    "Panel",
    "SpatialLongest",
    "SpatialMotion",
    "SpatialResult",
    "Workspace",
    "follow_path",
    "load_workspace",
    "longest_link",
    "mapping_error",
    "plan",
    "random_room",
    "validate",
]
