"""Figures 20 to 22 of the paper in our workspace, and the motion that the paper announces."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hrsnake_env.arm import ArmSpec, FloatArray
from hrsnake_env.files import replacing
from planners.problem import Progress, ValidationReport
from planners.spatial.drawing import draw_motion
from planners.spatial.following import MappingError, follow_path, mapping_error
from planners.spatial.path import Path as SpatialPath
from planners.spatial.path import global_path
from planners.spatial.planning import plan
from planners.spatial.potential import laplace_potential
from planners.spatial.problem import SpatialMotion
from planners.spatial.rooms import paired_panels
from planners.spatial.validation import signed_distances, validate
from planners.spatial.viewer import Scene, save_page
from planners.spatial.workspace import Workspace

__all__ = ["FOLLOWED", "SpatialFigure", "run_figures"]

FOLLOWED = {20: 8.0, 21: 30.0, 22: 90.0}
"""Link lengths of the paper's figures, in units."""

TRACKED = 90.0
"""Of the arm that only collides when it follows the path."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SpatialFigure:
    """Hold one motion that is shown.

    Parameters
    ----------
    name : str
        For people.
    stem : str
        Of its files.
    motion : SpatialMotion
        Followed or tracked.
    report : ValidationReport
        What the exact checker says of it.
    distances : array, shape (n_poses, n_links)
        Of each link from the obstacles; negative is the depth.
    error : MappingError or None
        Of path following.
    """

    name: str
    stem: str
    motion: SpatialMotion
    report: ValidationReport
    distances: FloatArray
    error: MappingError | None

    @property
    def poses_that_collide(self) -> int:
        """Number of poses in which a link is in an obstacle."""
        return int((self.distances < -1e-9 * self.motion.link_length).any(axis=1).sum())

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain numbers and strings."""
        return {
            "name": self.name,
            "n_links": self.motion.n_links,
            "link_length": self.motion.link_length,
            "n_poses": self.motion.n_poses,
            "poses_that_collide": self.poses_that_collide,
            "depth": self.report.penetration,
            "clearance": self.report.clearance,
            "valid": self.report.valid,
            "link_to_path": None if self.error is None else self.error.link_to_path,
            "path_to_link": None if self.error is None else self.error.path_to_link,
        }


def run_figures(folder: Path, progress: Progress | None = None) -> list[SpatialFigure]:
    """Make Figs. 20 to 22: pictures, motions, one page that turns and plays, and a table.

    Parameters
    ----------
    folder : Path
        Made if it is missing.
    progress : callable, optional
        Called with a stage and the share of it that is done.

    Returns
    -------
    figures : list of SpatialFigure
        In the order of the paper, the tracked motion last.
    """
    tell = progress if progress is not None else lambda stage, share: None
    folder.mkdir(exist_ok=True)
    workspace = paired_panels()
    potential = laplace_potential(workspace)
    path = None if potential is None else global_path(workspace, potential)
    if path is None:
        raise AssertionError("the named workspace has a path")
    figures: list[SpatialFigure] = []
    for number, length in FOLLOWED.items():
        tell("follow", len(figures) / len(FOLLOWED))
        figures.append(_followed(workspace, path, number, length))
    tell("follow", 1.0)
    result = plan(workspace, ArmSpec(link_length=TRACKED), progress=progress)
    if result.motion is None:
        raise AssertionError(f"the motion of the README is not found: {result.reason}")
    figures.append(_measured(workspace, "tracked", "tracked", result.motion, None))
    for number, figure in enumerate(figures):
        tell("draw", number / len(figures))
        _write(workspace, path, figure, folder)
    scenes = [
        Scene(
            name=figure.name,
            workspace=workspace,
            motion=figure.motion,
            path=path.points,
            distances=figure.distances,
        )
        for figure in figures
    ]
    save_page(scenes, folder / "spatial.html", title="Path following and tight manoeuvring in space")
    with replacing(folder / "figures.json") as part:
        rows = {"path_length": path.length, "figures": [figure.to_dict() for figure in figures]}
        part.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    tell("draw", 1.0)
    return figures


def _followed(workspace: Workspace, path: SpatialPath, number: int, length: float) -> SpatialFigure:
    motion = follow_path(path, workspace, length)
    return _measured(workspace, f"Fig. {number}", f"fig{number}", motion, mapping_error(path, length))


def _measured(
    workspace: Workspace, title: str, stem: str, motion: SpatialMotion, error: MappingError | None
) -> SpatialFigure:
    distances = signed_distances(motion.joints, workspace, motion.base_pose)
    return SpatialFigure(
        name=f"{title}: {motion.n_links} links of {motion.link_length:g}",
        stem=stem,
        motion=motion,
        report=validate(motion, workspace),
        distances=distances,
        error=error,
    )


def _write(workspace: Workspace, path: SpatialPath, figure: SpatialFigure, folder: Path) -> None:
    """Write a motion, and a picture of its worst pose or, if all are free, of the last."""
    figure.motion.save(folder / f"{figure.stem}.npz")
    draw_motion(
        workspace,
        figure.motion,
        path.points,
        folder / f"{figure.stem}.png",
        poses=None if figure.poses_that_collide else [-1],
        distances=figure.distances,
    )
