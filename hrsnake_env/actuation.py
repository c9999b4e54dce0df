"""The arm in pymunk, one chain of links for each way to move them: put, pushed, or turned by gears."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import pymunk

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError

__all__ = ["ACTUATIONS", "Chain", "aim_gears", "geared_chain", "placed_chain", "pushed_chain"]

# Gears never kept 45 links of equal masses nearer to their places than 2 % of a link. With masses that fall
# from base to tip a sweep of the solver, which goes through the constraints in the order of adding, carries
# the motion outwards; longer arms take more sweeps. Measured with 7 to 200 links that start abruptly: node
# errors of at most 0.01 % of a link. With a ratio of 2 and 20 sweeps it is 1 to 2 % with 45 links.
GEAR_MASS_RATIO = 4.0
"""So many times lighter is each link on gears than the one before it."""

GEAR_MOMENT_FACTOR = 1e5
"""So many times harder to turn is a link on gears than a uniform rod of its mass."""

LARGEST_GEARED = 200
"""Links; with 260, the squares of their inverse masses are beyond floating point."""

ITERATIONS = 10


@dataclass(frozen=True, eq=False, kw_only=True)
class Chain:
    """Hold the bodies and constraints of an arm, base end first, before they are in a space.

    Parameters
    ----------
    links : list of Body
        Their x axes point to the tip; they lie at the origin.
    rest : list of Body and Constraint
        What else belongs into the space, in that order.
    gears : list of GearJoint
        Of `rest`, what turns links, from the second on, relative to the previous ones.
    iterations : int
        Sweeps of the solver that the chain takes.
    """

    links: list[pymunk.Body]
    rest: list[pymunk.Body | pymunk.Constraint]
    gears: list[pymunk.GearJoint]
    iterations: int


def placed_chain(n_links: int, link_length: float) -> Chain:
    """Return links that go where they are put, whatever is in the way."""
    links = [pymunk.Body(body_type=pymunk.Body.KINEMATIC) for _ in range(n_links)]
    return Chain(links=links, rest=[], gears=[], iterations=ITERATIONS)


def pushed_chain(n_links: int, link_length: float) -> Chain:
    """Return jointed uniform rods of mass 1, the first on the feeder's axis, for forces to push."""
    links = [pymunk.Body(1.0, link_length**2 / 12.0) for _ in range(n_links)]
    # The walls stand on the space's own static body: a joint's anchor switches off its contacts.
    rail = pymunk.Body(body_type=pymunk.Body.STATIC)
    half, reach = link_length / 2.0, (n_links + 2) * link_length
    grooves = [
        pymunk.GrooveJoint(rail, links[0], (-reach, 0.0), (reach, 0.0), (end, 0.0)) for end in (-half, half)
    ]
    joints = [*grooves, *_pivots(links, link_length)]
    _stiffen(joints)
    return Chain(links=links, rest=[rail, *joints], gears=[], iterations=ITERATIONS)


def geared_chain(n_links: int, link_length: float) -> Chain:
    """Return jointed links that gears turn; the first goes where the feeder puts it, straight."""
    if n_links > LARGEST_GEARED:
        raise InputError(f"Expected at most {LARGEST_GEARED} links with actuation 'gear', got {n_links}.")
    links = [pymunk.Body(body_type=pymunk.Body.KINEMATIC)]
    for k in range(1, n_links):
        mass = GEAR_MASS_RATIO**-k
        links.append(pymunk.Body(mass, GEAR_MOMENT_FACTOR * mass * link_length**2 / 12.0))
    joints = _pivots(links, link_length)
    gears = [pymunk.GearJoint(a, b, 0.0, 1.0) for a, b in pairwise(links)]
    _stiffen([*joints, *gears])
    return Chain(links=links, rest=[*gears, *joints], gears=gears, iterations=ITERATIONS + n_links // 2)


ACTUATIONS = {"computed_torque": pushed_chain, "gear": geared_chain}
"""What an arm may be driven by, and the chain for it."""


def aim_gears(
    chain: Chain, last_target: FloatArray, target: FloatArray, link_length: float, timestep: float
) -> None:
    """Send a geared chain from one configuration to the next.

    Parameters
    ----------
    chain : Chain
        From `geared_chain`.
    last_target, target : array, shape (1 + n_links,)
        Feed and joint angles to be at after this substep, and after the next one.
    link_length : float
        Of `chain`, as the feed is measured.
    timestep : float
        In s.
    """
    # pymunk moves bodies before it solves for velocities. Gears and pivots so act one substep late; the first
    # link must be at its last target when they see it, and already have the speed to the next one.
    speed = (target[0] - last_target[0]) / timestep
    first = chain.links[0]
    first.position = (last_target[0] - (len(chain.links) - 0.5) * link_length - speed * timestep, 0.0)
    first.velocity = (speed, 0.0)
    for gear, angle in zip(chain.gears, target[2:].tolist(), strict=True):
        gear.phase = angle


def _pivots(links: list[pymunk.Body], link_length: float) -> list[pymunk.Constraint]:
    half = link_length / 2.0
    return [pymunk.PivotJoint(a, b, (half, 0.0), (-half, 0.0)) for a, b in pairwise(links)]


def _stiffen(constraints: list[pymunk.Constraint]) -> None:
    """Let constraints correct all of their error in one substep, and joined links not collide."""
    for constraint in constraints:
        constraint.error_bias, constraint.collide_bodies = 0.0, False
