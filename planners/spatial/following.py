"""Path following in space (section 5.5 of the paper): link ends on the path, whatever links do in between."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planners.clock import now
from planners.feeding import STEP, feed
from planners.kernels import feeding as feeding_kernel
from planners.kernels.spatial_chords import chord_errors, place_on_path
from planners.path import arclength, resampled
from planners.problem import PlanningStatus
from planners.spatial.path import Path
from planners.spatial.problem import SpatialCandidate, SpatialMotion
from planners.spatial.query import SpatialQuery, behind_straight
from planners.spatial.workspace import Workspace

__all__ = ["MappingError", "follow_path", "mapping_error", "plan_following"]


@dataclass(frozen=True, kw_only=True)
class MappingError:
    """Say how far links with both ends on a path are from it, over all places on the path, in its units.

    Parameters
    ----------
    link_to_path : float
        Largest distance of a point of a link from the stretch of path that it spans.
    path_to_link : float
        Largest distance of a point of the path from the link that spans it.
    """

    link_to_path: float
    path_to_link: float


def follow_path(path: Path, workspace: Workspace, link_length: float) -> SpatialMotion:
    """Feed an arm along the path.

    Long links cannot follow everywhere: where a link stands across the path at its rear end, that joint
    jumps. Then the poses are those of even steps of the tip, with each joint at the nearest place behind the
    next.

    Parameters
    ----------
    path : Path
        Of this workspace.
    workspace : Workspace
        Gives the base.
    link_length : float
        In workspace units.

    Returns
    -------
    motion : SpatialMotion
        Its links may be in obstacles, and its joints may jump.
    """
    base_pose = workspace.base_pose_for(link_length)
    curve = np.concatenate([base_pose[None, :3], behind_straight(workspace, path.points)])
    fed = feed(curve, link_length, base_pose)
    poses = fed.poses
    if fed.ending != feeding_kernel.DONE:
        arc = arclength(curve)
        tips = np.linspace(0.0, arc[-1], math.ceil(arc[-1] / (STEP * link_length)) + 1)
        poses = np.empty((len(tips), math.ceil(arc[-1] / link_length) + 1, 3))
        place_on_path(curve, arc, link_length, tips, base_pose, poses)
        behind = (poses[-1] - base_pose[:3]) @ base_pose[3:] <= 0.0
        poses = poses[:, int(np.argmin(behind)) - 1 :]  # one link is still in the feeder
    return SpatialMotion.from_joints(poses, link_length, base_pose)


def mapping_error(path: Path, link_length: float) -> MappingError:
    """Compute the mapping error of links of a length on a path, over all chords of that length."""
    points = resampled(path.points, min(path.length / len(path.points), link_length / 20.0))
    link_to_path, path_to_link = chord_errors(points, link_length)
    return MappingError(link_to_path=link_to_path, path_to_link=path_to_link)


def plan_following(query: SpatialQuery) -> SpatialCandidate:
    """Plan by path following; the checker says whether that is free."""
    path = query.path
    if path is None:
        return query.no_path()
    begin = now()
    motion = follow_path(path, query.workspace, query.arm.link_length)
    query.timings["poses"] = now() - begin
    return SpatialCandidate(status=PlanningStatus.SOLVED, motion=motion, track=path.points)
