"""What readers of drawings hand over: outlines of straight lines and curves, by layer and colour."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError
from hrsnake_env.maps.flatten import MAX_POINTS, Arc, Piece
from hrsnake_env.maps.reading import METRES, converts

__all__ = ["Drawing", "Outline", "Stroke", "counted", "factor", "scaled", "sound"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Stroke:
    """One line drawn without lifting the pen.

    Parameters
    ----------
    pieces : tuple of Line, Arc or Bezier
        Each starts where the one before ends.
    closed : bool
        The last point is joined to the first.
    """

    pieces: tuple[Piece, ...]
    closed: bool = False

    @property
    def hull(self) -> FloatArray:
        """Points whose convex hull holds the stroke, shape (n, 2)."""
        return np.concatenate([piece.hull for piece in self.pieces])

    @property
    def circle(self) -> tuple[FloatArray, float] | None:
        """Centre and radius if the stroke is one whole circle."""
        arcs = [piece for piece in self.pieces if isinstance(piece, Arc)]
        if not arcs or any(not isinstance(piece, Arc) and np.ptp(piece.hull) > 0.0 for piece in self.pieces):
            return None
        centre, radius = arcs[0].centre, arcs[0].radius
        if radius is None:
            return None
        slack = 1e-9 * max(radius, float(np.abs(centre).max()))
        alike = all(
            arc.radius is not None
            and abs(arc.radius - radius) <= slack
            and np.abs(arc.centre - centre).max() <= slack
            for arc in arcs
        )
        whole = abs(abs(sum(arc.sweep for arc in arcs)) - 2 * np.pi) < 1e-6
        return (centre, radius) if alike and whole else None


@dataclass(frozen=True, eq=False, kw_only=True)
class Outline:
    """One thing of a drawing, y up.

    Parameters
    ----------
    strokes : tuple of Stroke
        Several of one thing: an area with holes, by the even-odd rule.
    layer : str
        Under which it is listed; may be empty.
    names : tuple of str
        All names it goes by, the most specific first: its own, its layers'.
    colours : tuple of str
        As #rrggbb.
    heading, radius : float, optional
        Of a place that says where it looks, in rad, or how far it reaches.
    extra : bool
        It repeats what other outlines draw (a hatch), and counts if its layer is given a role alone.
    nonzero : bool
        As SVG fills: where strokes of one direction overlap, it is filled, too.
    """

    strokes: tuple[Stroke, ...]
    layer: str = ""
    names: tuple[str, ...] = ()
    colours: tuple[str, ...] = ()
    heading: float | None = None
    radius: float | None = None
    extra: bool = False
    nonzero: bool = False

    @property
    def hull(self) -> FloatArray:
        """Points whose convex hull holds the outline, shape (n, 2)."""
        return np.concatenate([stroke.hull for stroke in self.strokes])


@dataclass(frozen=True, eq=False, kw_only=True)
class Drawing:
    """Hold a drawing as its file has it.

    Parameters
    ----------
    name : str
        Of the map.
    outlines : sequence of Outline
    units : str or None
        If the file says it.
    notes : sequence of str
        What the reader did and left out.
    """

    name: str
    outlines: Sequence[Outline]
    units: str | None = None
    notes: Sequence[str] = ()


def factor(drawing: Drawing, units: str | None, scale: float) -> tuple[float, str]:
    """Return maze units per unit of the drawing, and a sentence that says so."""
    own = drawing.units
    if own is not None and units is not None and converts(own, units, scale):
        scale = METRES[own] / METRES[units]
    if scale == 1.0:
        return 1.0, f"The drawing is in {own}." if own else "The drawing does not say its units."
    return scale, f"One {own or 'unit'} of the drawing is {scale:g} {units or own or 'units'}."


def scaled(outlines: Sequence[Outline], by: float) -> list[Outline]:
    """Return outlines larger by a factor."""
    if by == 1.0:
        return list(outlines)
    matrix, offset = by * np.eye(2), np.zeros(2)
    return [
        Outline(
            strokes=tuple(
                Stroke(
                    pieces=tuple(piece.transformed(matrix, offset) for piece in stroke.pieces),
                    closed=stroke.closed,
                )
                for stroke in outline.strokes
            ),
            layer=outline.layer,
            names=outline.names,
            colours=outline.colours,
            heading=outline.heading,
            radius=None if outline.radius is None else by * outline.radius,
            extra=outline.extra,
            nonzero=outline.nonzero,
        )
        for outline in outlines
    ]


def sound(drawing: Drawing) -> tuple[list[Outline], list[str]]:
    """Return the outlines that can be drawn, and what was left out.

    Raises
    ------
    InputError
        If there are none, or too many points.
    """
    kept: list[Outline] = []
    notes: list[str] = []
    n_points, broken = 0, 0
    for outline in drawing.outlines:
        strokes = tuple(stroke for stroke in outline.strokes if stroke.pieces)
        if not strokes:
            continue
        with np.errstate(all="ignore"):  # of what is left out here
            hull = np.concatenate([stroke.hull for stroke in strokes])
        n_points += len(hull)
        angles = [
            angle
            for stroke in strokes
            for piece in stroke.pieces
            if isinstance(piece, Arc)
            for angle in (piece.start, piece.sweep)
        ]
        if not (np.isfinite(hull).all() and np.abs(hull).max() <= 1e100 and np.isfinite(angles).all()):
            broken += 1
            continue
        kept.append(outline)
    if n_points > MAX_POINTS:
        raise InputError(f"Expected at most {MAX_POINTS:,} points in map '{drawing.name}', got {n_points:,}.")
    if broken:
        notes.append(f"{counted(broken, 'outline')} with coordinates that are no finite numbers left out.")
    if not kept:
        raise InputError(f"Expected outlines in map '{drawing.name}', got none that can be read.")
    return kept, notes


def counted(n: int, what: str) -> str:
    """Return a number of things in words: `1 line`, `2 lines`."""
    return f"{n:,} {what}" if n == 1 else f"{n:,} {what}s"
