"""Between poses, against the obstacles: a bound decides, not samples (see `planners.spatial.validation`)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.checks.tolerances import PINCH_TOLERANCE, ROUNDING
from planners.problem import Fault, Progress
from planners.spatial.checks.boxes import direction_gaps, frame_gaps, moving_gaps, separations
from planners.spatial.checks.scene import (
    MAX_PIECES,
    MAX_SPLITS,
    BoolArray,
    IntArray,
    Moves,
    Scene,
    halves,
    point_of,
    slices,
)

__all__ = ["check_between"]

PATIENCE = (3, 6)
"""How often a piece is halved before depths over 0, and over an eighth of the tolerance, are accepted."""

GROUP = 20_000
"""How many links and boxes near them are looked at together."""

NONE = np.zeros(0, dtype=np.int64)

FAULT_SAMPLES = 257
"""Times between two poses at which the depth is looked for when a fault there is described."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _Pieces:
    """Hold pieces of motion: a link near a box after a pose, over a time in [0, 1].

    `step`, `link` and `box` have shape (n,), `time` has shape (n, 2).
    """

    step: IntArray
    link: IntArray
    box: IntArray
    time: FloatArray

    def __len__(self) -> int:
        return len(self.link)

    def __getitem__(self, chosen: BoolArray) -> _Pieces:
        return _Pieces(
            step=self.step[chosen], link=self.link[chosen], box=self.box[chosen], time=self.time[chosen]
        )

    def halved(self) -> _Pieces:
        """Halve the pieces in time."""
        step, link, box = (np.repeat(values, 2) for values in (self.step, self.link, self.box))
        return _Pieces(step=step, link=link, box=box, time=halves(self.time))


def check_between(scene: Scene, deep: BoolArray, tell: Progress) -> tuple[float, Fault | None]:
    """Bound the depth between poses, and find the worst place where there is no bound up to the tolerance.

    Links that are `deep` at one of two poses are not looked at between them: the fault of that pose says it
    already.
    """
    n_steps = scene.motion.n_poses - 1
    skipped = deep[1:] | deep[:-1]
    near = []
    for part in slices(n_steps, scene.motion.n_links * len(scene.boxes)):
        near.append(_near(scene, part, skipped[part]))
        tell("validate", 0.4 + 0.2 * part.stop / n_steps)
    step, link, box = (np.concatenate(values) for values in zip(*near, strict=True)) if near else [NONE] * 3
    bound, open_ = 0.0, []
    for first in range(0, len(step), GROUP):
        group = slice(first, first + GROUP)
        time = np.tile((0.0, 1.0), (len(step[group]), 1))
        pieces = _Pieces(step=step[group], link=link[group], box=box[group], time=time)
        found, left = _swept(scene, pieces)
        bound = max(bound, found)
        open_ += [one for one in left if len(one)]
        tell("validate", 0.6 + 0.2 * min(1.0, (first + GROUP) / len(step)))
    if open_:
        return math.inf, _sweep_fault(scene, open_)
    return math.inf if skipped.any() else bound, None


def _near(scene: Scene, part: slice, skipped: BoolArray) -> tuple[IntArray, IntArray, IntArray]:
    """Find boxes that come within reach of links between poses: steps, links and boxes."""
    moves = scene.steps(part.start, part.stop)
    both = np.concatenate([moves.before, moves.after], axis=1)
    gaps = frame_gaps(both.min(axis=1), both.max(axis=1), scene.boxes)
    out = np.maximum(scene.arc[part, 1:], scene.arc[part.start + 1 : part.stop + 1, 1:])
    looked_at = (out > ROUNDING * scene.length) & ~skipped
    gaps[~looked_at.ravel()] = np.inf
    row, box = np.nonzero(gaps < (moves.astray + scene.radius + scene.slack)[:, None])
    step, link = np.divmod(row, scene.motion.n_links)
    return part.start + step, link, box


def _swept(scene: Scene, pieces: _Pieces) -> tuple[float, list[_Pieces]]:
    """Bound the depth of pieces by halving; return the bound, and the pieces that are deep or still open."""
    bound, deep = 0.0, []
    for level in range(MAX_SPLITS + 1):
        if not len(pieces):
            break
        allowed = scene.tolerances[pieces.box]
        limit = allowed * (0.0, 1.0 / 8.0, 1.0)[np.searchsorted(PATIENCE, level, side="right")]
        moves = scene.moves(pieces.step, pieces.link, pieces.time)
        depth, distance = _depths(scene, moves, pieces.box, limit)
        left = depth > limit
        bound = max(bound, float(np.max(depth, where=~left, initial=0.0)))
        pieces, is_deep = pieces[left], distance[left] < scene.radius - allowed[left]
        deep.append(pieces[is_deep])
        if level == MAX_SPLITS or 2 * len(pieces) > MAX_PIECES:
            break
        # One deep place is enough to know of a link between two poses.
        names = pieces.step * scene.motion.n_links + pieces.link
        pieces = pieces[~np.isin(names, names[is_deep])].halved()
    return bound, [*deep, pieces]


def _depths(scene: Scene, moves: Moves, box: IntArray, limit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bound how deep links on their way get in boxes, and compute how far they are from them half way.

    What is not deeper than `limit` by the planes of faces and links is not measured half way (infinite).
    """
    low, high = scene.boxes[box, 0], scene.boxes[box, 1]
    reach = moves.astray + scene.radius + scene.slack
    depth, distance = np.full(len(box), np.inf), np.full(len(box), np.inf)
    even = np.flatnonzero(moves.even)
    gaps = moving_gaps(moves.before[even], moves.after[even], low[even], high[even])
    depth[even] = reach[even] - gaps
    rest = np.flatnonzero(depth > limit)
    ends, low, high = moves.middle[rest], low[rest], high[rest]
    distance[rest], normals, _ = separations(ends[:, 0], ends[:, 1], low, high)
    corners = np.concatenate([moves.before, moves.after], axis=1)[rest]
    gaps = direction_gaps(corners, normals, low, high)
    depth[rest] = np.minimum(depth[rest], reach[rest] - gaps)
    return depth, distance


def _sweep_fault(scene: Scene, open_: list[_Pieces]) -> Fault:
    """Name the worst of the pieces that are not bounded, by the depth at the middle of each."""
    worst: tuple[float, int, int] | None = None
    for pieces in open_:
        distance, _ = _distances(scene, pieces)
        index = int(np.argmin(distance))
        if worst is None or distance[index] < worst[0]:
            worst = (float(distance[index]), int(pieces.step[index]), int(pieces.link[index]))
    assert worst is not None  # the caller has pieces
    _, pose, link = worst
    n_boxes = len(scene.boxes)
    times = np.repeat(np.linspace(0.0, 1.0, FAULT_SAMPLES), n_boxes)
    samples = _Pieces(
        step=np.full(len(times), pose),
        link=np.full(len(times), link),
        box=np.tile(np.arange(n_boxes), FAULT_SAMPLES),
        time=np.stack([times, times], axis=1),
    )
    distance, place = _distances(scene, samples)
    index = int(np.argmin(distance))
    amount = scene.radius - float(distance[index])
    what = f"gets {scene.figure(amount)} deep in an obstacle"
    if amount <= scene.tolerances[samples.box[index]]:
        amount, what = (
            math.inf,
            f"could not be shown to get at most {PINCH_TOLERANCE:g} link lengths deep in an obstacle",
        )
    message = f"Link {link} {what} between poses {pose} and {pose + 1}."
    where = point_of(place[index])
    return Fault(kind="sweep", message=message, pose=pose, link=link, place=where, amount=amount)


def _distances(scene: Scene, pieces: _Pieces) -> tuple[FloatArray, FloatArray]:
    """Compute the signed distances of links to boxes half way, and where on the link; shape (n,), (n, 3)."""
    joints, arc = scene.ends(pieces.step, pieces.link, pieces.time.mean(axis=1))
    joints = scene.in_workspace(joints, arc)
    start, end, box = joints[:, 0], joints[:, 1], scene.boxes[pieces.box]
    distance, _, share = separations(start, end, box[:, 0], box[:, 1])
    return distance, start + share[:, None] * (end - start)
