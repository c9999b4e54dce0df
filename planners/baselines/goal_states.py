"""Whole arms at the goal, grown link by link out of the feeder along a path: where planners may end."""

from __future__ import annotations

import numpy as np

from planners.baselines.fed_states import FedArm
from planners.clock import now
from planners.kernels.fed_growth import MOST, Chains, Guide, farthest_seen, grow
from planners.kernels.types import FloatArray, IntArray

__all__ = ["grown_goal_states", "guide_along"]

SPACING = 0.1
"""Of guide points, in link lengths."""

ROOTS = 24
"""Ways that the first link is out of the feeder, that are tried."""

NEARLY_OUT = 0.999
"""The most of them, in link lengths: chains from there reach farthest."""

BEAM = 200
"""Chains that are grown on from: half of them those that got farthest, half drawn."""

PROGRESS = 0.1
"""How much nearer to the goal each link leads, in link lengths."""

SHARE_OF_RADIUS = 0.9
"""Of the goal radius, within which tips end."""

POOL = 200
"""Arms at the goal of which the best are chosen, at most."""

MOVES, MOVE = 100, 0.1
"""The best goal states leave most random moves of this length, in rad and link lengths, free."""

CELL, TURN = 0.15, 0.3
"""Of chains that end within so many link lengths and rad of each other, one is kept."""


def guide_along(points: FloatArray, goal: FloatArray, radius: float, link_length: float) -> Guide:
    """Make a guide from a path to the goal, shape (n, 2); all in maze units."""
    points = np.concatenate([points, goal[None]]) / link_length
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    even = np.linspace(0.0, s[-1], max(int(np.ceil(s[-1] / SPACING)), 1) + 1)
    points = np.column_stack([np.interp(even, s, axis) for axis in points.T])
    return Guide(points, float(even[1]), SHARE_OF_RADIUS * radius / link_length)


def grown_goal_states(
    arm: FedArm, guide: Guide, number: int, rng: np.random.Generator, deadline: float = np.inf
) -> tuple[list[FloatArray], FloatArray]:
    """Grow whole arms from the base to the goal, of as few links as get there.

    Chains are grown by a link at a time, at angles drawn from the ranges of directions that are exactly free,
    and always towards the goal. Of those that end in nearly the same place and direction one is kept.

    Parameters
    ----------
    arm : FedArm
        The arm and its walls.
    guide : Guide
        Path to the goal.
    number : int
        Of states, at most.
    rng : Generator
        Draws directions.
    deadline : float
        When to stop, on the clock of `planners.clock.now`.

    Returns
    -------
    states : list of array, shape (n_links,)
        All of the same number of links; none if no chain gets to the goal.
    farthest : array, shape (n, 2)
        The chain that came nearest to the goal, from the base on, in maze units.
    """
    chains = _roots(arm, guide, rng)
    joints = np.arange(1, len(chains.places))
    while len(joints):
        there = joints[np.hypot(*(chains.places[joints] - guide.points[-1]).T) <= guide.radius]
        states = [_state(chains, int(joint)) for joint in rng.permutation(there)[:POOL]]
        states = [state for state in states if arm.is_clear(state)]
        if states:
            return _roomiest(arm, states, number, rng, deadline), _points(
                chains, int(there[0])
            ) * arm.link_length
        if now() > deadline:
            break
        chosen = _chosen(chains, joints, rng)
        draws = rng.random((len(chosen), MOST))
        grown = Chains(*grow(chains, chosen, arm.scene, arm.most_bent, guide, PROGRESS, draws))
        joints = len(chains.places) + np.arange(len(grown.places))
        chains = Chains(*(np.concatenate(pair) for pair in zip(chains, grown, strict=True)))
    return [], _points(chains, int(np.argmin(chains.to_go))) * arm.link_length


def _roots(arm: FedArm, guide: Guide, rng: np.random.Generator) -> Chains:
    """Return the base, and joints that the feeder has pushed past it."""
    x, y, heading = arm.scene.base_pose
    ways = np.concatenate([[0.0], (np.arange(ROOTS) + 1.0 - rng.random(ROOTS)) / ROOTS])
    ways[-1] = NEARLY_OUT
    places = np.column_stack([x + ways * np.cos(heading), y + ways * np.sin(heading)])
    seen = np.array([farthest_seen(place, 0, guide, arm.scene.walls) for place in places])
    rest = guide.spacing * (len(guide.points) - 1 - seen) + np.hypot(*(places - guide.points[seen]).T)
    parents = np.concatenate([[-1], np.zeros(ROOTS, dtype=np.int64)])
    none = np.zeros(ROOTS + 1)
    return Chains(places, np.full(ROOTS + 1, heading), none, parents, seen, rest, none)


def _chosen(chains: Chains, joints: IntArray, rng: np.random.Generator) -> IntArray:
    """Choose from which joints to grow on: one of each cell, and not too many."""
    joints = joints[np.lexsort((chains.to_go[joints], chains.bent[joints]))]
    cells = np.column_stack([chains.places[joints] / CELL, chains.headings[joints] / TURN])
    _, first = np.unique(np.floor(cells).astype(np.int64), axis=0, return_index=True)
    joints = joints[np.sort(first)]
    if len(joints) <= BEAM:
        return joints
    order = np.argsort(chains.to_go[joints])
    return np.concatenate(
        [joints[order[: BEAM // 2]], rng.permutation(joints[order[BEAM // 2 :]])[: BEAM // 2]]
    )


def _way(chains: Chains, joint: int) -> list[int]:
    """Return the joints from the base to one."""
    way = [joint]
    while chains.parents[way[-1]] >= 0:
        way.append(int(chains.parents[way[-1]]))
    return way[::-1]


def _points(chains: Chains, joint: int) -> FloatArray:
    return chains.places[_way(chains, joint)]


def _state(chains: Chains, joint: int) -> FloatArray:
    """Return the state of a chain: links past its first joint, and the way that this is out of the feeder."""
    way = _way(chains, joint)
    out = float(np.hypot(*(chains.places[way[1]] - chains.places[0])))
    return np.concatenate([[len(way) - 2 + out], chains.angles[way[2:]]])


def _roomiest(
    arm: FedArm, states: list[FloatArray], number: int, rng: np.random.Generator, deadline: float
) -> list[FloatArray]:
    """Choose the states around which the arm is free in most directions, of those looked at in time."""
    moves = rng.normal(size=(MOVES, len(states[0])))
    moves *= MOVE / np.linalg.norm(moves, axis=1, keepdims=True)
    rooms: list[int] = []
    for state in states:
        if rooms and now() > deadline:
            break
        rooms.append(arm.room(state, moves))
    return [states[k] for k in np.argsort(rooms)[::-1][:number]]
