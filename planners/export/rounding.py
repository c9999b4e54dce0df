"""A path through joint space without corners, close to the poses of a motion.

Between poses feed and joint angles change linearly, so at every pose all speeds jump, and no arm could follow
without stopping there. The path here is a cubic B-spline whose control points lie on the motion: every point
of it is an average of configurations that the motion passes nearby, with weights that sum to one. It turns no
joint farther than the motion does, keeps what is straight straight, and moves off by about a sixth of the
spacing of its control points times the jump of the rates. Where a joint would end up farther off than
allowed, the spacing is halved.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from hrsnake_env.arm import FloatArray
from planners.export.kinematics import Kinematics
from planners.problem import Progress

__all__ = ["Polyline", "RoundedPath", "release_ways", "rounded_path"]

SPACING = 0.1
"""Of the control points where nothing is near a corner, in link lengths of feed."""

TURN_PER_LENGTH = 16.0
"""Where joints turn while the feed hardly moves, so many rad count as a link length. No joint turns faster
than that when the feeder lets go of it (`hrsnake_env.arm.feeder_angle_limits`)."""

ROUNDS = 14
"""How often the spacing is halved at most."""

SAMPLES = 3
"""Places between two breaks at which it is measured how far the path is off."""

DEGREE = 3

FEWEST = 2 * DEGREE + 2
"""Pieces that a path has at least: more than a change of a control point reaches."""

STRAIGHT = 1e-8
"""What counts as straight, in rad."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """Hold the poses of a motion as points of a line in joint space, and how far along it each is.

    Parameters
    ----------
    poses : array, shape (n, dof)
        Configurations; see `planners.export.kinematics`.
    """

    poses: FloatArray
    place: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        moves = np.abs(np.diff(self.poses, axis=0))
        steps = np.maximum(moves[:, 0], moves[:, 1:].max(axis=1) / TURN_PER_LENGTH)
        keep = np.concatenate([[True], steps > 1e-12])
        place = np.concatenate([[0.0], np.cumsum(steps)])[keep]
        poses = self.poses[keep]
        poses[-1] = self.poses[-1]
        object.__setattr__(self, "poses", poses)
        object.__setattr__(self, "place", place)

    @property
    def length(self) -> float:
        """Length of the line; 0 if nothing moves."""
        return float(self.place[-1])

    def __call__(self, place: FloatArray) -> FloatArray:
        """Return the configurations at places along the line, shape (n,) -> (n, dof)."""
        after = np.clip(np.searchsorted(self.place, place, side="right"), 1, len(self.place) - 1)
        span = self.place[after] - self.place[after - 1]
        share = np.clip((place - self.place[after - 1]) / span, 0.0, 1.0)[:, None]
        return np.asarray((1.0 - share) * self.poses[after - 1] + share * self.poses[after])


@dataclass(frozen=True, eq=False, kw_only=True)
class RoundedPath:
    """Hold a path without corners.

    Parameters
    ----------
    spline : BSpline
        From places along the motion to configurations.
    breaks : array, shape (n,)
        Between which it is one polynomial.
    deviation : float
        How far, at most, a joint was found from its place in the motion, in link lengths.
    """

    spline: BSpline
    breaks: FloatArray
    deviation: float


def rounded_path(
    line: Polyline,
    kinematics: Kinematics,
    *,
    deviation: float,
    release: FloatArray,
    progress: Progress | None = None,
) -> RoundedPath:
    """Round the corners of a motion.

    Parameters
    ----------
    line : Polyline
        The poses of the motion; of positive length.
    kinematics : Kinematics
        Of the arm.
    deviation : float
        How far a joint may get from where the motion has it, in link lengths. Held up to `ROUNDS` halvings of
        the spacing.
    release : array, shape (n_links,)
        How far past the base each joint has to be before it bends, in link lengths (`release_ways`).
    progress : callable, optional
        Called with "round" and the share of the way that is done.
    """
    n_pieces = max(FEWEST, int(np.ceil(line.length / SPACING)))
    breaks = np.linspace(0.0, line.length, n_pieces + 1)
    stale = np.ones(n_pieces, dtype=bool)
    off = np.zeros(n_pieces)
    for number in range(ROUNDS + 1):
        spline, bends_early = _spline(line, kinematics, breaks, release)
        off[stale] = _deviations(line, kinematics, spline, breaks, np.flatnonzero(stale))
        coarse = off > deviation
        coarse[-1] |= bends_early
        if progress is not None:
            progress("round", 1.0 - float(coarse.mean()))
        if number == ROUNDS or not coarse.any():
            break
        # A control point acts on four pieces: those next to a coarse one become finer, too.
        wide = np.convolve(coarse, np.ones(DEGREE), mode="same") > 0.5
        counts = np.where(wide, 2, 1)
        middles = 0.5 * (breaks[:-1] + breaks[1:])[wide]
        touched = np.convolve(wide, np.ones(2 * DEGREE + 1), mode="same") > 0.5
        breaks = np.sort(np.concatenate([breaks, middles]))
        stale, off = np.repeat(touched, counts), np.repeat(off, counts)
    return RoundedPath(spline=spline, breaks=breaks, deviation=float(off.max()))


def release_ways(line: Polyline, n_links: int, *, longest: float, deviation: float) -> FloatArray:
    """Choose how far past the base each joint is when it starts to bend, in link lengths, shape (n_links,).

    Samples around the moment at which a joint starts to bend must not bend it before the base. The longer the
    way, the faster the arm may be there; but a joint that starts later is off by the angle that it would have
    had by then, so where a motion bends it at once the way is short, and the arm has to be slow.

    Parameters
    ----------
    line : Polyline
        The motion.
    n_links : int
        Number of links.
    longest : float
        How far the feed goes in the time that samples act on.
    deviation : float
        How far a joint may be off for that reason.
    """
    feed = line.poses[:, 0]
    past = feed[:, None] - (n_links - np.arange(n_links))
    angles = np.abs(line.poses[:, 1:]).reshape(len(feed), n_links, -1).max(axis=2)
    near = (past > 1e-9) & (past <= longest + np.abs(np.diff(feed)).max())
    rates = np.divide(angles, past, out=np.zeros_like(past), where=near).max(axis=0)
    return np.asarray(np.minimum(longest, deviation / np.maximum(rates, deviation / longest)))


def _spline(
    line: Polyline, kinematics: Kinematics, breaks: FloatArray, release: FloatArray
) -> tuple[BSpline, bool]:
    """Return the spline, and whether its last piece bends a joint that is still to be released in it."""
    ends = np.repeat(breaks[[0, -1]], DEGREE)
    knots = np.concatenate([ends[:DEGREE], breaks, ends[DEGREE:]])
    # The averages of knots at which a spline of the line's own values keeps straight lines straight.
    places = sum(knots[1 + k : len(knots) - DEGREE + k] for k in range(DEGREE)) / DEGREE
    control = line(np.clip(places, 0.0, line.length))
    n_links = kinematics.n_links
    least = _least_feed(BSpline(knots, control[:, 0], DEGREE), breaks)
    past = least[:, None] - (n_links - np.arange(n_links) + release)
    held = kinematics.held(control, past)
    held[0], held[-1] = control[0], control[-1]
    # The path ends where the motion does. Where a joint is released in the last piece, that must be shorter.
    last = kinematics.held(control[-1:], past[-1:] + release)
    return BSpline(knots, held, DEGREE), bool(np.abs(last - control[-1]).max() > STRAIGHT)


def _least_feed(feed: BSpline, breaks: FloatArray) -> FloatArray:
    """Return the least feed wherever each control point acts, shape (n_control,)."""
    middles = 0.5 * (breaks[:-1] + breaks[1:])
    ends = feed(breaks)
    pieces = np.minimum(np.minimum(ends[:-1], ends[1:]), feed(middles))
    padded = np.pad(pieces, DEGREE, mode="edge")
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, DEGREE + 1).min(axis=1))


def _deviations(
    line: Polyline, kinematics: Kinematics, spline: BSpline, breaks: FloatArray, pieces: NDArray[np.int64]
) -> FloatArray:
    """Measure how far joints are off in pieces of the path, in link lengths, shape (n_pieces,)."""
    shares = (np.arange(SAMPLES) + 0.5) / SAMPLES
    span = np.diff(breaks)[pieces]
    places = (breaks[:-1][pieces, None] + span[:, None] * shares).ravel()
    apart = kinematics.joints(spline(places)) - kinematics.joints(line(places))
    return np.asarray(np.linalg.norm(apart, axis=2).max(axis=1).reshape(-1, SAMPLES).max(axis=1))
