"""Poses against the walls: the exact polygons decide."""

from __future__ import annotations

import math

import numpy as np
import shapely

from hrsnake_env.arm import FloatArray
from planners.checks.scene import CHUNK, BoolArray, Nearest, Scene, point_of, worst_of
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING
from planners.problem import Fault, Progress


def check_poses(scene: Scene, doubtful: BoolArray, tell: Progress) -> tuple[float, Fault | None, BoolArray]:
    """Check all poses: clearance, the worst penetration, and the links deeper than any sweep allows.

    Links that are not `doubtful` are free, and not the nearest to a wall.
    """
    motion = scene.motion
    deep = np.zeros((motion.n_poses, motion.n_links), dtype=bool)
    worst: tuple[float, int, int, FloatArray] = (math.inf, 0, 0, motion.joints[0, -1])
    for first in range(0, motion.n_poses, CHUNK):
        arc = scene.arc[first : first + CHUNK]
        joints = scene.in_maze(motion.joints[first : first + CHUNK], arc)
        pose, link = np.nonzero(doubtful[first : first + CHUNK] & (arc[:, 1:] > ROUNDING * scene.length))
        if len(pose):
            segments = np.stack([joints[pose, link], joints[pose, link + 1]], axis=1)
            emerging = scene.emerging(arc[pose, link])
            clearance, index, place = nearest(scene, segments, emerging)
            if clearance < worst[0]:
                worst = (clearance, first + int(pose[index]), int(link[index]), place)
            deep[first + pose, link] = are_deep(scene, segments, emerging)
        tell("validate", 0.5 + 0.1 * min(1.0, (first + CHUNK) / motion.n_poses))
    clearance, where, link_index, place = worst
    if clearance >= (0.0 if scene.radius == 0.0 else -ROUNDING * scene.length):
        return clearance, None, deep
    fault = Fault(
        kind="penetration",
        message=f"Link {link_index} is {scene.figure(-clearance)} deep in a wall at pose {where}.",
        pose=where,
        link=link_index,
        place=point_of(place),
        amount=-clearance,
    )
    return clearance, fault, deep


def nearest(scene: Scene, segments: FloatArray, emerging: BoolArray) -> Nearest:
    """Find the least signed distance to the walls of capsules around segments, shape (n, 2, 2)."""
    lines = shapely.linestrings(segments)
    outside = np.flatnonzero(~shapely.covers(scene.free, lines))
    if len(outside):
        depth, index, place = _deepest(scene, segments[outside])
        return -depth - scene.radius, int(outside[index]), place
    distances = scene.distances(lines, emerging)
    index = int(np.argmin(distances))
    walls = scene.walls_in_front if emerging[index] else scene.walls
    place = shapely.get_coordinates(shapely.shortest_line(lines[index], walls))[0]
    return float(distances[index]) - scene.radius, index, place


def are_deep(scene: Scene, segments: FloatArray, emerging: BoolArray) -> BoolArray:
    """Say which capsules are surely deeper in a wall than the pinch tolerance."""
    lines, excess = shapely.linestrings(segments), scene.radius - PINCH_TOLERANCE * scene.length
    deep = ~shapely.covers(scene.free, lines)
    deep[deep] = ~shapely.covers(scene.shallow, lines[deep]) if deep.any() else False
    if excess > 0.0:
        deep |= scene.distances(lines, emerging) < excess
    return np.asarray(deep)


def _deepest(scene: Scene, segments: FloatArray) -> Nearest:
    """Find the point of segments that leave the free space, shape (n, 2, 2), that is farthest from it.

    Outside, the distance to the free space is the least of the distances to the walls. Each of those is
    convex along a segment, so the larger one of its two ends bounds it, and the least such bound over the
    walls bounds the depth. Halving the parts that may still beat the deepest point found closes in on it.
    """
    outside = shapely.difference(shapely.linestrings(segments), scene.free)
    parts, owner = shapely.get_parts(outside, return_index=True)
    parts, owner = parts[~shapely.is_empty(parts)], owner[~shapely.is_empty(parts)]
    ends = np.stack([shapely.get_coordinates(shapely.get_point(parts, k)) for k in (0, -1)], axis=1)
    walls, accuracy = scene.maze.walls, 0.1 * ROUNDING * scene.length
    # What is not covered is outside, even where rounding leaves nothing of it.
    depth, index, place = 1e-15 * scene.maze.size, 0, segments[0].mean(axis=0)
    for first in range(0, len(ends), CHUNK):
        rest, of = ends[first : first + CHUNK], owner[first : first + CHUNK]
        while len(rest):
            start, end = (_wall_distances(rest[:, k], walls) for k in (0, 1))
            # Of a segment that lies on a wall but for rounding, GEOS may leave pieces in the free space, too.
            free = np.stack([shapely.intersects_xy(scene.free, rest[:, k]) for k in (0, 1)], axis=1)
            reached = np.where(free, 0.0, np.stack([start.min(axis=1), end.min(axis=1)], axis=1))
            best, row, side = worst_of(reached)
            if best > depth:
                depth, index, place = best, int(of[row]), rest[row, side]
            open_ = np.maximum(start, end).min(axis=1) > depth + accuracy
            doubtful = np.flatnonzero(open_ & free.all(axis=1))
            open_[doubtful] = ~shapely.covers(scene.free, shapely.linestrings(rest[doubtful]))
            rest, of = rest[open_], np.repeat(of[open_], 2)
            middle = rest.mean(axis=1)
            rest = np.stack([rest[:, 0], middle, middle, rest[:, 1]], axis=1).reshape(-1, 2, 2)
    return depth, index, place


def _wall_distances(points: FloatArray, walls: FloatArray) -> FloatArray:
    """Compute the distances from points, shape (n, 2), to each wall, as shape (n, n_walls)."""
    along = walls[:, 1] - walls[:, 0]
    offset = points[:, None] - walls[:, 0]
    share = np.clip(np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(offset - share[..., None] * along, axis=2))
