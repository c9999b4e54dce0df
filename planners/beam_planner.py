"""The paper's planner (section 3): every link chooses tangent, edge side or path point, base to tip.

One function answers each subsection's question for one link:

=======  =========================================  ========================================================
section  concept                                    function
=======  =========================================  ========================================================
3.1      tangent point                              `tangent_point`
3.2      closest path point, through the beams      `closest_path_point`
3.3      closest edge side coordinate               `edge_side`
3.4      path point near semi-critical corners      `path_point`, `is_near_semi_critical`
3.5      right and left corner                      `planners.corners.turn_of`
3.6      blocking                                   `blocking`, `remember_jump`
3.7      softening                                  `soften`
3.8      Part A: reference link                     `place_reference_link`
3.8      Part B: downstream links                   `place_downstream_link`, which asks `choose`
3.8      Part C: upstream links                     `place_upstream_links`
=======  =========================================  ========================================================

One step is added to the paper's: `clamp_to_free` moves the chosen direction into the exact free interval of
the link. `AS_PRINTED` leaves it out; `CLAMPED` has it. Which rules are followed is said by `Rules`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hrsnake_env.arguments import place_text
from hrsnake_env.arm import FEEDER_RELEASE, ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.beams import Beams
from planners.clock import now
from planners.kernels import beam_arm as kernel
from planners.kernels.beam_arm import (
    choose,
    place_downstream_link,
    place_reference_link,
    place_upstream_links,
    remember_jump,
)
from planners.kernels.beam_rules import (
    blocking,
    clamp_to_free,
    closest_path_point,
    coordinate_at_length,
    edge_side,
    is_near_semi_critical,
    path_point,
    soften,
    tangent_point,
)
from planners.kernels.beam_types import AXIS, BEAM, CORNER, EDGE, LINK, PATH, TANGENT, Records, Terms, Way
from planners.kernels.types import FloatArray, IntArray
from planners.problem import Candidate, Failure, Motion, PlanningStatus
from planners.query import Query
from planners.room import TooLarge, most_poses
from planners.survey import Geometry

__all__ = [
    "AS_PRINTED",
    "CHOICES",
    "CLAMPED",
    "BeamRun",
    "FedArm",
    "Rules",
    "blocking",
    "choose",
    "clamp_to_free",
    "closest_path_point",
    "coordinate_at_length",
    "edge_side",
    "is_near_semi_critical",
    "path_point",
    "place_downstream_link",
    "place_reference_link",
    "place_upstream_links",
    "plan_as_printed",
    "plan_beam",
    "remember_jump",
    "run_beam",
    "soften",
    "tangent_point",
]

POSES_PER_LINK = 240
"""Regular number of poses per link length of feed; more where joints move fast."""

STEP = 0.03
"""Largest movement of a joint between poses, in link lengths; the checker allows 0.05."""

LONGEST_BEAM = 1.2
"""Beams are cut to this many passage widths for aiming: at a junction they reach down other corridors."""

AT_A_TIME = 50
"""Poses that are fed between two looks at the clock; among thousands of walls they take long."""

HAIR = 1e-9
"""Beams end this share of their length before the wall, so that rounding puts no link's end into it."""

NEAR_END = 0.15
"""A beam that crosses a link this near to its end, in passage widths, passes through its end (3.2). Beams fan
out to this distance on the outer side of a corner."""

REACH = 2.5
"""How far along the path a link's end may be from its start, in link lengths: round a thin wall, twice."""

JUMP = 0.15
"""From which change of its aim from pose to pose on a link has jumped, in rad (3.6): 0.15 link lengths."""

PAD = 3e-4
"""Kept from the walls by a clamped link, in rad about its base-side joint."""

TURN = 12.0
"""Largest turn of a clamped link in rad per link length of feed: 0.5 rad takes a twenty-fifth of one."""

STOP = 0.5
"""The motion ends when the tip is this near to the goal, in goal radii."""

OF_THE_TIP = (kernel.GOAL, kernel.TOO_LONG, kernel.FULL)
"""Endings of a run whose place is the tip's."""

CHOICES = {AXIS: "axis", TANGENT: "tangent", EDGE: "edge side", PATH: "path point"}
"""What a link does, by its number in the record of a run."""


@dataclass(frozen=True, kw_only=True)
class Rules:
    """Say which rules are followed.

    Parameters
    ----------
    clamp : bool
        Whether directions are clamped into the exact free interval, which is not in the paper.
    semi_critical : bool
        Whether links take path points near semi-critical corners (3.4).
    tangent_blocks : bool
        Whether a link is kept from tangent points while its guide link is tangent to the path (3.6).
    jump_blocks : bool
        Whether a link is kept from them from a jump of its guide link until that is tangent (3.6).
    softening_degree : int
        Into how many pieces a sudden jump is divided (3.7), one for each pose of a 240th of a link length of
        feed; 0 is no softening.

    Raises
    ------
    InputError
        If the degree is negative.
    """

    clamp: bool = True
    semi_critical: bool = True
    tangent_blocks: bool = True
    jump_blocks: bool = True
    softening_degree: int = 3

    def __post_init__(self) -> None:
        if not self.softening_degree >= 0:
            raise InputError(f"Expected a softening_degree of at least 0, got {self.softening_degree!r}.")


AS_PRINTED = Rules(clamp=False)
"""The rules of the paper, and no more."""

CLAMPED = Rules(jump_blocks=False)
"""The rules of the paper and the clamp, without the one that then costs a little, presumably as a link
that is held by a wall may never find the tangent point until which it is to block the next one."""


def plan_beam(query: Query, rules: Rules = CLAMPED) -> Candidate:
    """Plan with the paper's rules, clamped to the exact free intervals or as printed.

    Parameters
    ----------
    query : Query
        Maze, arm and terms; no warm start is used.
    rules : Rules
        Which rules are followed.

    Returns
    -------
    candidate : Candidate
        A motion with as many links as it needs, not yet validated, or the reason why there is none.
    """
    geometry = query.geometry
    if geometry is None:
        return query.no_path()
    query.tell("plan", 0.2)
    clock = [now()]
    run = run_beam(geometry, query.arm, rules, record=False, deadline=query.deadline)
    clock.append(now())
    query.tell("plan", 1.0)
    if run.ending != kernel.GOAL:
        return Candidate(
            status=PlanningStatus.OUT_OF_TIME if run.ending == kernel.FULL else PlanningStatus.DEAD_END,
            reason=run.reason(query.maze),
            failure=Failure(
                place=run.place,
                link=None if run.ending in OF_THE_TIP else run.link,
                joints=run.motion(query.maze).joints[-1],
            ),
            timings={**geometry.timings, "plan": clock[1] - clock[0]},
        )
    motion = run.motion(query.maze)
    clock.append(now())
    stages = dict(zip(("plan", "poses"), np.diff(clock).tolist(), strict=True))
    return Candidate(status=PlanningStatus.SOLVED, motion=motion, timings={**geometry.timings, **stages})


def plan_as_printed(query: Query) -> Candidate:
    """Plan with the paper's rules and no more; see `plan_beam`."""
    return plan_beam(query, AS_PRINTED)


@dataclass(frozen=True, eq=False, kw_only=True)
class BeamRun:
    """Hold what came of a run of the rules: n poses of m links, which are numbered from the tip.

    Parameters
    ----------
    link_length : float
        In maze units.
    feeds : array, shape (n,)
        In maze units.
    headings : array, shape (n, m)
        Of each link, in rad.
    record : array, shape (n or 0, m, 5)
        What each link does, in the columns of `planners.kernels.beam_types`.
    ending, link : int
        How it ended, one of GOAL, TOO_LONG, NO_GAP, JUMP and, out of time, FULL of
        `planners.kernels.beam_arm`, and the link at which it did.
    place : tuple of two floats
        Start of that link where it found no way, otherwise the tip, in maze units.
    """

    link_length: float
    feeds: FloatArray
    headings: FloatArray
    record: IntArray
    ending: int
    link: int
    place: tuple[float, float]

    @property
    def n_links(self) -> int:
        """How many links it takes to come this far."""
        return max(1, math.ceil(float(self.feeds[-1]) / self.link_length - 1e-9))

    def motion(self, maze: Maze) -> Motion:
        """Return the motion as far as it goes, not validated."""
        from_base = self.headings[:, : self.n_links][:, ::-1]
        joint_angles = np.diff(from_base, axis=1, prepend=maze.base_pose[2])
        return Motion.from_configurations(self.feeds, joint_angles, self.link_length, maze.base_pose)

    def reason(self, maze: Maze) -> str:
        """Say in one sentence where and why it ended short of the goal."""
        where = f"{place_text(self.place, maze.size)} {maze.units}"
        which = "the tip's link" if self.link == 0 else f"link {self.link + 1} from the tip"
        if self.ending == kernel.NO_GAP:
            return f"With its base-side joint at {where}, {which} has no free direction."
        if self.ending == kernel.JUMP:
            return (
                f"With its base-side joint at {where}, {which} would have to jump to another free direction."
            )
        if self.ending == kernel.FULL:
            return f"Time was over with the tip at {where}."
        return f"All arm that the path can take is fed, and the tip is at {where}, not at the goal."


class FedArm:
    """An arm that is fed by the rules, one pose or many at a time.

    Parameters
    ----------
    geometry : Geometry
        Of the maze.
    arm : ArmSpec
        Its links.
    rules : Rules
        Which rules are followed.
    record : bool
        Whether what each link does is recorded.
    """

    def __init__(
        self, geometry: Geometry, arm: ArmSpec, rules: Rules = CLAMPED, *, record: bool = True
    ) -> None:
        path, length = geometry.path, float(arm.link_length)
        # A joint track that swings from wall to wall is longer than the path, but never by this much.
        n_links = math.ceil(1.6 * path.length / length) + 4
        n_max = min(6 * POSES_PER_LINK * n_links, most_poses(n_links))
        self.geometry, self.link_length, self._walls = geometry, length, geometry.maze.walls
        self.way, self.terms = way_of(geometry), terms_of(geometry, arm, rules)
        self.feeds, self.headings = np.empty(n_max), np.empty((n_max, n_links))
        self.record = np.empty((n_max if record else 0, n_links, 5), dtype=np.int64)
        self.links = straight_links(geometry.maze, length, n_links + 1)
        self._room = straight_links(geometry.maze, length, n_links + 1)
        self.feeds[0], self.headings[0], self.record[:1] = 0.0, geometry.maze.base_pose[2], 0
        self._progress = np.array([1, 0, kernel.TICKS])

    def feed(self, n_poses: int | None = None) -> tuple[int, int]:
        """Feed the arm by so many poses, or to the end; return ending and link as `feed_arm` does.

        Raises
        ------
        TooLarge
            If the poses take more memory than a motion may.
        """
        maze, room = self.geometry.maze, len(self.feeds)
        ending, link = kernel.feed_arm(
            self.way,
            self.links,
            self._room,
            self._progress,
            maze.base_pose,
            maze.goal,
            STOP * maze.goal_radius,
            self.terms,
            self._walls,
            POSES_PER_LINK,
            STEP * self.link_length,
            room if n_poses is None else min(room, self.n_poses + n_poses),
            self.feeds,
            self.headings,
            self.record,
        )
        if ending == kernel.FULL and self.n_poses == room:
            if room == most_poses(len(self.links) - 1):
                raise TooLarge((float(self.links[0].x), float(self.links[0].y)), room, len(self.links) - 1)
            ending = kernel.TOO_LONG
        return ending, link

    @property
    def n_poses(self) -> int:
        """Number of poses so far."""
        return int(self._progress[0])


def run_beam(
    geometry: Geometry,
    arm: ArmSpec,
    rules: Rules = CLAMPED,
    *,
    record: bool = True,
    deadline: float = math.inf,
) -> BeamRun:
    """Feed an arm by the rules from the feeder to the goal, or as far as it goes.

    Parameters
    ----------
    geometry : Geometry
        Of the maze.
    arm : ArmSpec
        Its links.
    rules : Rules
        Which rules are followed.
    record : bool
        Whether what each link does is recorded.
    deadline : float
        When to stop, on the clock of `planners.clock.now`; the run ends with FULL then.

    Raises
    ------
    TooLarge
        If its poses take more memory than a motion may.
    """
    fed = FedArm(geometry, arm, rules, record=record)
    ending, link = fed.feed(AT_A_TIME)
    while ending == kernel.FULL:
        if now() > deadline:
            break
        ending, link = fed.feed(AT_A_TIME)
    n = fed.n_poses
    at = fed.links[0 if ending in OF_THE_TIP else link + 1]
    return BeamRun(
        link_length=fed.link_length,
        feeds=fed.feeds[:n],
        headings=fed.headings[:n],
        record=fed.record[:n],
        ending=ending,
        link=link,
        place=(float(at.x), float(at.y)),
    )


def way_of(geometry: Geometry) -> Way:
    """Gather path, beams and corners for the kernels."""
    path, beams = geometry.path, geometry.beams
    corners = sorted([*geometry.corners, *geometry.semi_critical], key=lambda corner: corner.first)
    longest = LONGEST_BEAM * path.width
    marks = np.recarray(len(path.points), dtype=BEAM)
    marks.along_x, marks.along_y = path.tangents.T
    marks.corner = marks.next_corner = marks.next_critical = -1
    for number, corner in reversed(list(enumerate(corners))):
        marks["corner"][corner.first : corner.last + 1] = number
        marks["next_corner"][: corner.last + 1] = number
        if corner.critical:
            marks["next_critical"][: corner.last + 1] = number
    return Way(
        lines=np.stack([path.points, *(_short_of_walls(beams, side, longest) for side in (+1, -1))]),
        beams=marks,
        corners=np.array(
            [(corner.first, corner.last, corner.turn, corner.critical) for corner in corners], dtype=CORNER
        ).view(np.recarray),
    )


def _short_of_walls(beams: Beams, side: int, longest: float) -> FloatArray:
    return beams.origins + (1.0 - HAIR) * (beams.ends(side, longest) - beams.origins)


def terms_of(geometry: Geometry, arm: ArmSpec, rules: Rules) -> Terms:
    """Gather what the rules need to know, in maze units and path points."""
    path, length = geometry.path, float(arm.link_length)
    return Terms(
        length=length,
        joint_limit=math.inf if arm.joint_limit is None else float(arm.joint_limit),
        release=FEEDER_RELEASE,
        near_end=NEAR_END * path.width,
        reach=max(5, round(REACH * length / path.s[1])),
        semi_critical=rules.semi_critical,
        tangent_blocks=rules.tangent_blocks,
        jump_blocks=rules.jump_blocks,
        jump=JUMP,
        degree=float(rules.softening_degree),
        clamp=rules.clamp,
        pad=PAD,
        turn=TURN / POSES_PER_LINK,
    )


def straight_links(maze: Maze, length: float, n: int) -> Records:
    """Return n links in the feeder, the tip at the base."""
    x, y, heading = (float(value) for value in maze.base_pose)
    links = np.recarray(n, dtype=LINK)
    links.fill(0)
    links.choice, links.corner, links.jumped = AXIS, -1, -1
    links.heading = links.aimed = heading
    links.x = x - length * np.arange(n) * math.cos(heading)
    links.y = y - length * np.arange(n) * math.sin(heading)
    return links
