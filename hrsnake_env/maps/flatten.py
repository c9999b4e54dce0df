"""Curves as chords, together with guards: convex shapes that hold all that chords leave out."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError

__all__ = ["MAX_POINTS", "Arc", "Bezier", "Line", "Piece", "Trace", "flattened", "spline_pieces"]

MAX_POINTS = 2_000_000
"""More points than this are refused, of a drawing or of the chords of one curve."""

SAME_POINT = 1e-9
"""Two ends nearer than this share of a curve's size are one point: files round their coordinates."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Line:
    """Straight from point to point; a single point is a place.

    Parameters
    ----------
    points : array, shape (n, 2)
        n >= 1.
    """

    points: FloatArray

    @property
    def hull(self) -> FloatArray:
        """Points whose convex hull holds the piece, shape (n, 2)."""
        return self.points

    def transformed(self, matrix: FloatArray, offset: FloatArray) -> Line:
        """Return the image under x -> matrix x + offset."""
        return Line(points=self.points @ matrix.T + offset)


@dataclass(frozen=True, eq=False, kw_only=True)
class Arc:
    """Part of an ellipse: centre + major cos t + minor sin t.

    Parameters
    ----------
    centre, major, minor : array, shape (2,)
        Any two conjugate half axes.
    start, sweep : float
        t runs from start to start + sweep, in rad; a negative sweep runs backwards.
    """

    centre: FloatArray
    major: FloatArray
    minor: FloatArray
    start: float = 0.0
    sweep: float = 2 * math.pi

    @property
    def hull(self) -> FloatArray:
        """Points whose convex hull holds the whole ellipse, shape (4, 2)."""
        sides = np.stack([self.major + self.minor, self.major - self.minor])
        return np.concatenate([self.centre + sides, self.centre - sides])

    def transformed(self, matrix: FloatArray, offset: FloatArray) -> Arc:
        """Return the image under x -> matrix x + offset: again an arc."""
        return Arc(
            centre=matrix @ self.centre + offset,
            major=matrix @ self.major,
            minor=matrix @ self.minor,
            start=self.start,
            sweep=self.sweep,
        )

    def at(self, t: FloatArray, stretch: float = 1.0) -> FloatArray:
        """Return the points at the parameters t, shape (n, 2), further from the centre by a factor."""
        return np.asarray(
            self.centre + stretch * (np.outer(np.cos(t), self.major) + np.outer(np.sin(t), self.minor))
        )

    @property
    def radius(self) -> float | None:
        """Radius if it is part of a circle."""
        a, b = (float(np.linalg.norm(axis)) for axis in (self.major, self.minor))
        slant = abs(float(self.major @ self.minor))
        return a if abs(a - b) <= 1e-9 * a and slant <= 1e-9 * a * a else None


@dataclass(frozen=True, eq=False, kw_only=True)
class Bezier:
    """A Bezier curve of any degree, rational if its weights differ.

    Parameters
    ----------
    control : array, shape (n, 2)
        Control points.
    weights : array, shape (n,), optional
        Positive; all the same by default.
    """

    control: FloatArray
    weights: FloatArray | None = None

    @property
    def hull(self) -> FloatArray:
        """Points whose convex hull holds the piece, shape (n, 2)."""
        return self.control

    def transformed(self, matrix: FloatArray, offset: FloatArray) -> Bezier:
        """Return the image under x -> matrix x + offset: again a Bezier curve."""
        return Bezier(control=self.control @ matrix.T + offset, weights=self.weights)


Piece = Line | Arc | Bezier


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """Hold a curve as chords, and what they leave out.

    Parameters
    ----------
    points : array, shape (n, 2)
        On the curve, ends of the chords.
    guards : array of Polygon
        One per chord of a curved piece: convex, and the chord and its part of the curve lie in it. A region
        bounded by the curve differs from the region bounded by the chords within the guards alone.
    deviation : float
        How far guards reach from their chords at most.
    """

    points: FloatArray
    guards: np.ndarray
    deviation: float


def flattened(pieces: Sequence[Piece], tolerance: float) -> Trace:
    """Return pieces that follow each other as one trace, guards no wider than the tolerance.

    An arc is held by the triangle of its chord and its tangents, a Bezier curve by the convex hull of its
    control points: both are exact bounds, for any affine image, and rational curves too.
    """
    size = float(np.ptp(np.concatenate([piece.hull for piece in pieces]), axis=0).max(initial=0.0))
    runs = [_chords(piece, tolerance) for piece in pieces]
    for (before, _, _), (here, _, _) in itertools.pairwise(runs):
        if _same(before[-1], here[0], size):
            here[0] = before[-1]  # chords and guards meet exactly, or cracks of 1e-16 stay between them
    first, last = runs[0][0], runs[-1][0]
    if len(first) > 1 and _same(last[-1], first[0], size):
        last[-1] = first[0]
    points = np.concatenate([here for here, _, _ in runs])
    again = np.concatenate([[False], (points[1:] == points[:-1]).all(axis=1)])
    guards = [
        shapely.convex_hull(
            shapely.multipoints(list(np.concatenate([here[:-1, None], inner, here[1:, None]], axis=1)))
        )
        for here, inner, _ in runs
        if inner is not None
    ]
    return Trace(
        points=points[~again],
        guards=np.concatenate(guards) if guards else np.empty(0, dtype=object),
        deviation=max(off for _, _, off in runs),
    )


def _same(a: FloatArray, b: FloatArray, size: float) -> bool:
    return bool(np.abs(a - b).max() <= SAME_POINT * size)


def spline_pieces(
    knots: ArrayLike, control: ArrayLike, degree: int, weights: ArrayLike | None = None
) -> list[Piece]:
    """Return the Bezier curves of a B-spline, rational if it has weights.

    Raises
    ------
    InputError
        If the numbers of knots and control points do not belong together, or a weight is not positive.
    """
    from scipy.interpolate import BPoly, BSpline, PPoly

    t = np.asarray(knots, dtype=np.float64)
    points = np.asarray(control, dtype=np.float64)
    w = np.ones(len(points)) if weights is None else np.asarray(weights, dtype=np.float64)
    if degree < 1 or len(t) != len(points) + degree + 1 or len(w) != len(points) or len(points) <= degree:
        raise InputError(
            f"Expected a spline of degree {degree} with {len(points) + degree + 1} knots, got {len(t)}."
        )
    if not (w > 0.0).all() or (np.diff(t) < 0.0).any():
        raise InputError("Expected a spline with positive weights and rising knots, got another one.")
    lifted = np.column_stack([points * w[:, None], w])
    breaks = np.unique(t[degree : len(points) + 1])  # where the spline is defined
    if len(breaks) < 2:
        raise InputError("Expected a spline with rising knots, got all of them the same.")
    curve = BSpline(t, lifted, degree)
    powers = [curve(breaks[:-1], nu=k) / math.factorial(k) for k in range(degree, -1, -1)]
    bernstein = BPoly.from_power_basis(PPoly(np.array(powers), breaks)).c  # (degree + 1, n_spans, 3)
    return [
        Bezier(control=span[:, :2] / span[:, 2:], weights=span[:, 2]) for span in bernstein.transpose(1, 0, 2)
    ]


def _chords(piece: Piece, tolerance: float) -> tuple[FloatArray, FloatArray | None, float]:
    """Return points (n + 1, 2), the guards' points between them (n, k, 2) or None, and the guards' width."""
    if isinstance(piece, Line):
        return piece.points.copy(), None, 0.0
    if isinstance(piece, Arc):
        return _chords_of_arc(piece, tolerance)
    return _chords_of_bezier(piece, tolerance)


def _chords_of_arc(arc: Arc, tolerance: float) -> tuple[FloatArray, FloatArray, float]:
    stretch = float(np.linalg.norm(np.stack([arc.major, arc.minor]), ord=2))
    if stretch == 0.0:
        return np.tile(arc.centre, (2, 1)), np.tile(arc.centre, (1, 1, 1)), 0.0
    # Tangents at both ends of a chord of half angle h meet sin(h) tan(h) over it, on the unit circle; with
    # h = 0.975 sqrt(k) and h < 0.5 that is less than k.
    half = 0.975 * math.sqrt(min(max(tolerance / stretch, 1e-30), 0.25))
    n = max(1, math.ceil(abs(arc.sweep) / (2.0 * half)))
    _check_number(n)
    half = abs(arc.sweep) / (2 * n)
    t = arc.start + arc.sweep * np.arange(n + 1) / n
    points = arc.at(t)
    if abs(abs(arc.sweep) - 2 * math.pi) < 1e-12:
        points[-1] = points[0]
    tangents = arc.at(0.5 * (t[1:] + t[:-1]), stretch=1.0 / math.cos(half))
    return points, tangents[:, None], stretch * math.sin(half) * math.tan(half)


def _chords_of_bezier(curve: Bezier, tolerance: float) -> tuple[FloatArray, FloatArray, float]:
    weights = np.ones(len(curve.control)) if curve.weights is None else curve.weights
    parts = np.column_stack([curve.control * weights[:, None], weights])[None]  # (n, k, 3), homogeneous
    places = np.zeros(1)  # where each part starts on the curve
    width, done, done_places, deviation = 1.0, [], [], 0.0
    while len(parts):
        off = _reach(parts[..., :2] / parts[..., 2:])
        flat = (off <= tolerance) | (width < 1e-15)
        deviation = max(deviation, float(off[flat].max(initial=0.0)))
        done.append(parts[flat])
        done_places.append(places[flat])
        width *= 0.5
        places = np.concatenate([places[~flat], places[~flat] + width])
        parts = np.concatenate(_halves(parts[~flat]))
        _check_number(len(parts))
    order = np.argsort(np.concatenate(done_places), kind="stable")
    lifted = np.concatenate(done)[order]
    control = lifted[..., :2] / lifted[..., 2:]
    return np.concatenate([control[:, 0], control[-1:, -1]]), control[:, 1:-1], deviation


def _halves(parts: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut curves at their middle (de Casteljau), shape (n, k, 3) each."""
    left, right = [parts[:, 0]], [parts[:, -1]]
    while parts.shape[1] > 1:
        parts = 0.5 * (parts[:, :-1] + parts[:, 1:])
        left.append(parts[:, 0])
        right.append(parts[:, -1])
    return np.stack(left, axis=1), np.stack(right[::-1], axis=1)


def _reach(control: FloatArray) -> FloatArray:
    """Return how far control points (n, k, 2) lie from the chords of their curves, shape (n,)."""
    start, along = control[:, :1], control[:, -1:] - control[:, :1]
    length_2 = (along**2).sum(axis=-1)
    share = ((control - start) * along).sum(axis=-1) / np.where(length_2 > 0.0, length_2, 1.0)
    feet = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.sqrt(((control - feet) ** 2).sum(axis=-1)).max(axis=1))


def _check_number(n: int) -> None:
    if n > MAX_POINTS:
        raise InputError(
            f"Expected curves of at most {MAX_POINTS:,} chords, got more: give a larger tolerance."
        )
