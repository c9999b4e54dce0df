"""What the kernels of the beam planner pass around. Lengths in maze units, angles in rad."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planners.kernels.types import FloatArray

AXIS, TANGENT, EDGE, PATH = 0, 1, 2, 3
"""What a link does: lie on the feeder's axis, touch the path (3.1), aim at an edge side (3.3) or the path."""

NOTHING, GUIDE_TANGENT, GUIDE_JUMPED = 0, 1, 2
"""What keeps a link from a tangent point (3.6): nothing, or that its guide link is tangent, or has jumped."""

CHOICE, TARGET, CLOSEST, BLOCKED, PIECES = 0, 1, 2, 3, 4
"""Columns of a record: what a link does; the path point or beam that it aims at; the path point closest to
its start; what keeps it from a tangent point; how many pieces of a softened jump are still to be made."""


POINTS, LEFT, RIGHT = 0, 1, 2
"""Lines of a way: the path, the ends of the left and of the right beams."""

BEAM = np.dtype(
    [("along_x", "f8"), ("along_y", "f8"), ("corner", "i8"), ("next_corner", "i8"), ("next_critical", "i8")]
)
"""What belongs to a path point besides its place: the unit vector along the path, the corner in whose run it
is, and the first corner, the first critical corner, that ends at or after it; -1 is none."""

CORNER = np.dtype([("first", "i8"), ("last", "i8"), ("turn", "i8"), ("critical", "b1")])
"""Of each corner the first and the last path point, +1 for a left one, -1 for a right one, and whether it is
critical; otherwise it is semi-critical."""

LINK = np.dtype(
    [
        ("heading", "f8"),
        ("x", "f8"),
        ("y", "f8"),
        ("choice", "i8"),
        ("target", "i8"),
        ("corner", "i8"),
        ("blocked", "i8"),
        ("closest", "i8"),
        ("aimed", "f8"),
        ("jumped", "i8"),
        ("pieces", "f8"),
    ]
)
"""A link in one pose, and what it remembers: heading and end; what it does, the path point or beam that it
aims at, the corner that this is about, or -1, and what keeps it from a tangent point; the path point closest
to its start; the direction in which it last wanted to point; the corner at which it has jumped and has not
yet found a tangent point, or -1; and how many pieces of a softened jump are still to be made, in regular
poses."""

Records = Any
"""An array of one of these types, with its fields as attributes. Links are numbered from the tip, as in the
paper. One array of records is passed to a kernel faster than an array for each field."""


class Way(NamedTuple):
    """The path with its beams and corners (section 2): n points, c corners.

    Attributes
    ----------
    lines : array, shape (3, n, 2)
        Path points, and the ends of the left and of the right beams.
    beams : array of BEAM, shape (n,)
        What else belongs to each path point.
    corners : array of CORNER, shape (c,)
        In the order of the path.
    """

    lines: FloatArray
    beams: Records
    corners: Records


class Terms(NamedTuple):
    """On what terms the rules are followed.

    Attributes
    ----------
    length, joint_limit : float
        Of the links.
    release : float
        How fast the feeder lets go of a joint, in rad per link length that the joint is past the base.
    near_end : float
        A beam that crosses a link this near to its end is the one through its end (3.2).
    reach : int
        How many path points beyond that of its start the end of a link may be.
    semi_critical : bool
        Whether links take path points near semi-critical corners (3.4).
    tangent_blocks, jump_blocks : bool
        Whether a link is kept from tangent points by a guide link that is tangent, that has jumped (3.6).
    jump : float
        From which change of its aim on a guide link has jumped, in rad.
    degree : float
        Into how many pieces a sudden jump is divided, one for each regular pose (3.7).
    clamp : bool
        Whether the direction is clamped into the exact free interval. Not in the paper.
    pad : float
        Kept from the walls by a clamped link, in rad.
    turn : float
        Largest turn of a clamped link, in rad per regular pose.
    """

    length: float
    joint_limit: float
    release: float
    near_end: float
    reach: int
    semi_critical: bool
    tangent_blocks: bool
    jump_blocks: bool
    jump: float
    degree: float
    clamp: bool
    pad: float
    turn: float
