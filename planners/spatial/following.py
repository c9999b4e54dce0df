"""Path following in space (section 5.5 of the paper): link ends on the path, whatever links do in between."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from planners.feeding import Feeding, feed
from planners.kernels import feeding as feeding_kernel
from planners.kernels.spatial_chords import chord_errors
from planners.path import resampled
from planners.problem import Failure, PlanningStatus
from planners.spatial.path import Path
from planners.spatial.problem import SpatialCandidate, SpatialMotion
from planners.spatial.query import SpatialQuery
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


def follow_path(path: Path, workspace: Workspace, link_length: float) -> SpatialMotion | None:
    """Feed an arm along the path; None if a joint would have to jump.

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
    motion : SpatialMotion or None
        Its links may be in obstacles.
    """
    fed = _fed(path, workspace, link_length)
    if fed.ending != feeding_kernel.DONE:
        return None
    return SpatialMotion.from_joints(fed.poses, link_length, workspace.base_pose_for(link_length))


def _fed(path: Path, workspace: Workspace, link_length: float) -> Feeding:
    base_pose = workspace.base_pose_for(link_length)
    curve = path.points
    if link_length > workspace.straight:
        curve = np.concatenate([base_pose[None, :3], curve])
    return feed(curve, link_length, base_pose)


def mapping_error(path: Path, link_length: float) -> MappingError:
    """Compute the mapping error of links of a length on a path, over all chords of that length."""
    points = resampled(path.points, min(path.length / len(path.points), link_length / 20.0))
    return MappingError(
        **dict(zip(("link_to_path", "path_to_link"), chord_errors(points, link_length), strict=True))
    )


def plan_following(query: SpatialQuery) -> SpatialCandidate:
    """Plan by path following; the checker says whether that is free."""
    path = query.path
    if path is None:
        return SpatialCandidate(
            status=PlanningStatus.NO_PATH, reason="No way from the base to the goal was found for a point."
        )
    begin = time.perf_counter()
    length, base_pose = query.arm.link_length, query.workspace.base_pose_for(query.arm.link_length)
    fed = _fed(path, query.workspace, length)
    motion = None
    if fed.ending == feeding_kernel.DONE:
        motion = SpatialMotion.from_joints(fed.poses, length, base_pose)
    query.timings["poses"] = time.perf_counter() - begin
    if motion is None:
        return SpatialCandidate(
            status=PlanningStatus.DEAD_END,
            reason=f"Links of {length:g} {query.workspace.units} cannot follow the path: a joint would jump.",
            failure=Failure(place=fed.place, joints=fed.poses[-1]),
        )
    return SpatialCandidate(status=PlanningStatus.SOLVED, motion=motion, track=path.points)
