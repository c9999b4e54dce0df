"""The beam planner's kernels of the whole arm against what their docstrings and the single rules say.

The rules themselves have their twins in `tests/test_beam_rules.py`.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from functools import cache

import numpy as np

from benchmarks.trust.twin_draws import distances_to, segments
from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners.beam_planner import AS_PRINTED, CLAMPED, POSES_PER_LINK, STEP, STOP, FedArm
from planners.kernels import beam_arm
from planners.kernels import beam_rules as rules
from planners.kernels.beam_types import AXIS, EDGE, NOTHING, PATH, POINTS, TANGENT
from planners.query import Query

NUMBER_OF_MAZES = 4
FIELDS = (
    "heading",
    "x",
    "y",
    "choice",
    "target",
    "corner",
    "blocked",
    "closest",
    "aimed",
    "jumped",
    "pieces",
)


@cache
def corridors(number):
    """Return the geometry of one of some corridors with bends, made once."""
    rng = np.random.default_rng(number)
    turns = rng.choice([-1.0, 1.0], 4) * rng.uniform(0.7, 1.5, 4)
    headings = math.pi / 2 + np.cumsum(np.append(0.0, turns * (-1.0) ** np.arange(4)))
    steps = rng.uniform(500, 900, 5)[:, None] * np.column_stack([np.cos(headings), np.sin(headings)])
    points = np.concatenate([[(0.0, 0.0)], np.cumsum(steps, axis=0)])
    maze = Maze.from_corridors([tuple(point) for point in points], 200.0)
    return Query(maze=maze, arm=ArmSpec(link_length=200.0)).geometry


def some_rules(rng):
    """Draw which rules are followed."""
    base = CLAMPED if rng.random() < 0.6 else AS_PRINTED
    flags = {key: bool(rng.random() < 0.5) for key in ("semi_critical", "tangent_blocks", "jump_blocks")}
    return dataclasses.replace(base, softening_degree=int(rng.integers(0, 6)), **flags)


def a_fed_arm(rng, poses=None):
    """Draw an arm that the rules have fed by some poses."""
    geometry = corridors(int(rng.integers(0, NUMBER_OF_MAZES)))
    arm = ArmSpec(link_length=rng.uniform(120.0, 330.0), joint_limit=rng.choice([None, 0.8, 2.0]))
    fed = FedArm(geometry, arm, some_rules(rng))
    fed.feed(int(rng.integers(1, 1500)) if poses is None else poses)
    return fed


def as_numbers(links):
    """Return all that links hold as an array, shape (n, fields)."""
    return np.array([[float(link[name]) for name in FIELDS] for link in links])


def turn(a, b):
    """Return the turn from one direction to another by complex numbers."""
    return float(np.angle(np.exp(1j * (b - a))))


def a_link_chooses_by_the_flowchart(rng):
    """beam_arm.choose and find_closest, by the rules of sections 3.1 to 3.6, one after the other."""
    fed = a_fed_arm(rng)
    way, terms, links = fed.way, fed.terms, fed.links.copy().view(np.recarray)
    k, length = int(rng.integers(0, max(1, int(fed.feeds[fed.n_poses - 1] / fed.link_length)))), terms.length
    px, py = links[k + 1].x, links[k + 1].y
    adjacent, last = links[k + 1], int(links[k].closest)
    expected = -1
    if adjacent.choice != AXIS:
        first = adjacent.target if adjacent.choice == TANGENT else adjacent.closest
        expected = rules.closest_path_point(
            way, links[k + 2].x, links[k + 2].y, adjacent.heading, length,
            max(int(first), last - beam_arm.LITTLE), terms.reach, terms.near_end,
        )  # fmt: skip
    if expected < 0:
        away = np.hypot(*(way.lines[POINTS] - (px, py)).T)
        low = max(last - beam_arm.LITTLE, 0)
        expected = low + int(np.argmin(away[low : last + beam_arm.LITTLE + 1]))
    assert beam_arm.find_closest(way, links, k, terms) == expected
    index = links[k].closest = expected
    target = rules.tangent_point(way, px, py, index, length)
    corner = int(way.beams[target].corner) if target >= 0 else -1
    blocked = rules.blocking(links, k, corner, terms) if target >= 0 else NOTHING
    choice, about = PATH, -1
    aim, direction = rules.path_point(way, px, py, index, length)
    critical = int(way.beams[index].next_critical)
    if target >= 0 and blocked == NOTHING:
        choice, aim, about = TANGENT, target, corner
        direction = math.atan2(*(way.lines[POINTS][target] - (px, py))[::-1])
    elif critical >= 0:
        beam, side = rules.edge_side(way, critical, px, py, index, length)
        near = terms.semi_critical and beam >= 0 and rules.is_near_semi_critical(way, index, beam)
        if beam >= 0 and not near:
            choice, aim, about, direction = EDGE, beam, critical, side
    found = beam_arm.choose(way, links, k, terms)
    link = links[k]
    assert (link.choice, link.target, link.corner, link.blocked) == (choice, aim, about, blocked)
    assert abs(turn(found, direction)) < 1e-9


def jumps_are_remembered_until_tangent_or_past(rng):
    """beam_arm.remember_jump: the cases of section 3.6, one by one."""
    fed = a_fed_arm(rng, 2)
    way, links = fed.way, fed.links
    n_corners = len(way.corners)
    if not n_corners:
        return False
    link, threshold = links[0], 0.15
    choice, jumped = int(rng.choice([TANGENT, EDGE, PATH])), int(rng.integers(-1, n_corners))
    aimed, wanted = rng.uniform(-7, 7, 2)
    wanted = aimed + rng.choice([0.0, 0.1, 1.0]) if rng.random() < 0.5 else wanted
    closest, corner = int(rng.integers(0, len(way.beams))), int(rng.integers(0, n_corners))
    link.choice, link.jumped, link.aimed, link.closest, link.corner = choice, jumped, aimed, closest, corner
    beam_arm.remember_jump(way, links, 0, wanted, threshold)
    expected = jumped
    if choice == TANGENT or (jumped >= 0 and closest > way.corners[jumped].last):
        expected = -1
    if choice == EDGE and abs(turn(aimed, wanted)) > threshold:
        expected = corner
    assert link.jumped == expected and link.aimed == wanted
    return None


def links_in_the_feeder_lie_on_its_axis(rng):
    """beam_arm.place_reference_link and place_upstream_links."""
    n, length = int(rng.integers(2, 9)), rng.uniform(1.0, 300.0)
    base = np.append(rng.uniform(-1e3, 1e3, 2), rng.uniform(-4, 4))
    links, reference, axial = (
        np.recarray(n, dtype=a_fed_arm(rng, 1).links.dtype),
        int(rng.integers(0, n)),
        0.0,
    )
    links.fill(0)
    axial = rng.uniform(0.0, length)
    beam_arm.place_reference_link(links, reference, axial, base)
    beam_arm.place_upstream_links(links, reference, length, base)
    behind = axial - length * np.arange(n - reference)
    expected = base[:2] + behind[:, None] * np.array([math.cos(base[2]), math.sin(base[2])])
    np.testing.assert_allclose(np.stack([links.x, links.y], axis=1)[reference:], expected, atol=1e-9)
    assert (links.heading[reference:] == base[2]).all() and links[reference].choice == AXIS
    assert links[reference].corner == -1 and not links.x[:reference].any()


def the_largest_movement_is_numpys(rng):
    """beam_arm.largest_movement."""
    n = int(rng.integers(1, 9))
    before = np.recarray(n, dtype=a_fed_arm(rng, 1).links.dtype)
    before.fill(0)
    after = before.copy().view(np.recarray)
    after.x, after.y = rng.normal(size=(2, n)) * rng.choice([0.0, 1.0])
    reference = int(rng.integers(0, n + 1))
    moved = np.hypot(after.x, after.y)[:reference]
    largest, whose = beam_arm.largest_movement(before, after, reference)
    assert abs(largest - moved.max(initial=0.0)) < 1e-12
    assert whose == (int(np.argmax(moved)) if moved.any() else 0)


def check_chain(fed, links, reference, feed):
    """Raise unless links hang together and bend no farther than the feeder and the joint limit allow."""
    base, length = fed.geometry.maze.base_pose, fed.link_length
    ends = np.stack([links.x, links.y], axis=1)
    ahead = np.stack([np.cos(links.heading), np.sin(links.heading)], axis=1)
    np.testing.assert_allclose(ends[:-1] - length * ahead[:-1], ends[1:], atol=1e-6)
    axial = feed - reference * length
    np.testing.assert_allclose(ends[reference], base[:2] + axial * ahead[reference], atol=1e-6)
    assert (links.heading[reference:] == base[2]).all()
    past = feed / length - 1 - np.arange(reference)
    bent = np.array([turn(links.heading[k + 1], links.heading[k]) for k in range(reference)])
    allowed = np.minimum(np.minimum(fed.terms.release * past, fed.terms.joint_limit), math.pi)
    assert (np.abs(bent) <= allowed + 1e-9).all()


def a_placed_arm_hangs_together_keeps_limits_and_walls(rng):
    """beam_arm.place_arm, and place_downstream_link for its last link: one pose on from a fed arm."""
    fed = a_fed_arm(rng)
    terms, base, walls = fed.terms, fed.geometry.maze.base_pose, fed.geometry.maze.walls
    links = fed.links.copy().view(np.recarray)
    length, was = fed.link_length, fed.feeds[fed.n_poses - 1]
    reference = int(was / length)
    feed = min(was + rng.uniform(0.0, 0.01) * length, (reference + 1) * length)
    work, share = np.empty((2, len(walls) + 1, 2)), rng.uniform(0.1, 1.0)
    if feed - reference * length < 1e-6 * length:
        return False
    again = links.copy().view(np.recarray)
    failed = beam_arm.place_arm(fed.way, links, reference, feed, share, base, terms, walls, *work)
    if failed >= 0:
        return None
    check_chain(fed, links, reference, feed)
    if terms.clamp and reference:
        starts, ends = ([[links[k + d].x, links[k + d].y] for k in range(reference)] for d in (1, 0))
        assert distances_to(walls, segments(np.array(starts), np.array(ends))).min() > 0.0
    if reference:  # the link at the tip once more by itself
        for name in FIELDS:
            again[name][1:] = links[name][1:]
        released = terms.release * (feed / length - 1.0)
        assert beam_arm.place_downstream_link(fed.way, again, 0, share, released, terms, walls, *work)
        np.testing.assert_allclose(as_numbers(again[:1]), as_numbers(links[:1]), atol=1e-9)
    return None


def fed_on(fed, n_poses):
    """Feed an arm by some poses, by the kernel itself; return ending and link."""
    maze = fed.geometry.maze
    return beam_arm.feed_arm(
        fed.way, fed.links, fed._room, fed._progress, maze.base_pose, maze.goal, STOP * maze.goal_radius,
        fed.terms, maze.walls, POSES_PER_LINK, STEP * fed.link_length, fed.n_poses + n_poses, fed.feeds,
        fed.headings, fed.record,
    )  # fmt: skip


def an_arm_is_fed_in_small_steps_and_the_same_in_parts_as_at_once(rng):
    """beam_arm.feed_arm: steps, chains, endings; fed by a few poses at a time, and in one go."""
    geometry = corridors(int(rng.integers(0, NUMBER_OF_MAZES)))
    arm, chosen = ArmSpec(link_length=rng.uniform(120.0, 330.0)), some_rules(rng)
    whole, parts = FedArm(geometry, arm, chosen), FedArm(geometry, arm, chosen)
    ending, link = whole.feed(400)
    n, found = whole.n_poses, (beam_arm.FULL, 0)
    while parts.n_poses < n and found[0] == beam_arm.FULL:
        found = fed_on(parts, min(37, n - parts.n_poses))
    assert parts.n_poses == n and (ending == beam_arm.FULL or parts.feed(1) == (ending, link))
    np.testing.assert_array_equal(parts.feeds[:n], whole.feeds[:n])
    np.testing.assert_array_equal(parts.headings[:n], whole.headings[:n])
    np.testing.assert_array_equal(parts.record[:n], whole.record[:n])
    length, step = whole.link_length, STEP * whole.link_length
    base, joints = geometry.maze.base_pose, []
    for feed, row in zip(whole.feeds[:n], whole.headings[:n], strict=True):
        out = math.ceil(feed / length - 1e-12)  # links at least partly in front of the base
        ahead = np.stack([np.cos(row[:out]), np.sin(row[:out])], axis=1)[::-1] * length
        start = base[:2] + (feed - out * length) * np.array([math.cos(base[2]), math.sin(base[2])])
        joints.append((start + np.cumsum(ahead, axis=0))[::-1])
    steps = [np.hypot(*(b[: len(a)] - a[: len(b)]).T).max(initial=0.0) for a, b in itertools.pairwise(joints)]
    assert (np.diff(whole.feeds[:n]) > 0.0).all()
    assert not chosen.clamp or max(steps, default=0.0) <= step * (1.0 + 1e-9)
    tip = math.dist(joints[-1][0], geometry.maze.goal) if len(joints[-1]) else math.inf
    assert (ending == beam_arm.GOAL) == (tip <= STOP * geometry.maze.goal_radius)


LAWS = (
    a_link_chooses_by_the_flowchart,
    jumps_are_remembered_until_tangent_or_past,
    links_in_the_feeder_lie_on_its_axis,
    the_largest_movement_is_numpys,
    a_placed_arm_hangs_together_keeps_limits_and_walls,
    an_arm_is_fed_in_small_steps_and_the_same_in_parts_as_at_once,
)
