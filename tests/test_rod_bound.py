"""The longest rod that passes: closed forms, laws, and a dense check of the rod's motion."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar
from shapely.affinity import rotate, scale
from shapely.geometry import LineString, Polygon, box

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from planners.clock import now
from planners.kernels.rod import free_directions
from planners.kernels.rod_search import sweep_is_free
from planners.kernels.rod_space import GAPS, SLACK, possible_gaps
from planners.planning import plan
from planners.rod_bound import Passage, _first_triangles, rod_bound, rod_passes

ACCURACY = 0.005
"""Of a bound, unless a test asks for another."""


def maze_of(free_space, base_pose, goal, goal_radius=10.0, name="test"):
    return Maze(
        name=name,
        free_space=free_space,
        base_pose=np.array(base_pose),
        goal=np.array(goal),
        goal_radius=goal_radius,
    )


def bend(a, b, leg=1500.0):
    """Return a right-angled bend of a leg of width a, up, and a leg of width b, to the right."""
    free = box(0, 0, a, leg + b).union(box(0, leg, a + leg, leg + b))
    return maze_of(free, (a / 2, 5, math.pi / 2), (a + leg - 50, leg + b / 2))


def longest_in_bend(a, b):
    """Return the longest rod in a right-angled bend: the least of a / cos t + b / sin t over t."""
    return (a ** (2 / 3) + b ** (2 / 3)) ** 1.5


def arc(inner, outer, n=120):
    """Return half a ring with straight legs, its walls of n edges each: a hairpin without corners."""
    angles = np.linspace(0.0, math.pi, n + 1)
    unit = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ring = [
        (outer, -900),
        *(outer * unit),
        (-outer, -900),
        (-inner, -900),
        *(inner * unit[::-1]),
        (inner, -900),
    ]
    middle = 0.5 * (inner + outer)
    return maze_of(Polygon(ring), (middle, -895, math.pi / 2), (-middle, -800))


def corner_goal(goal=(150.0, 1500.0), radius=10.0):
    free = box(-100, 0, 100, 1600).union(box(-100, 1400, 1600, 1600))
    return maze_of(free, (0, 5, math.pi / 2), goal, radius)


def two_ways(plugged=None):
    """Return a corridor round a block, by a wide way (below) or by a narrow one (above)."""
    free = box(0, -50, 400, 50).union(box(300, -300, 900, 190)).union(box(800, -50, 1200, 50))
    free = free.difference(box(400, -200, 800, 150))
    if plugged is not None:
        free = free.difference(
            {"above": box(590, 150, 610, 190), "below": box(590, -300, 610, -200)}[plugged]
        )
    return maze_of(free, (5, 0, 0), (1150, 0), 20.0)


def assert_near(bound, length, accuracy=ACCURACY):
    """Raise unless the bound holds a length, and is as narrow as it should be."""
    assert bound.lower <= length <= bound.upper
    assert bound.proven
    assert bound.upper - bound.lower <= accuracy * bound.upper


def assert_path_is_free(maze, path):
    """Raise unless a rod's motion is free, starts at the base, ends at the goal, and turns or moves only."""
    moves = np.linalg.norm(np.diff(path.tails, axis=0), axis=1) > 0.0
    turns = np.diff(path.headings) != 0.0
    assert not (moves & turns).any()
    assert path.tails[0] == pytest.approx(maze.base_pose[:2])
    assert path.headings[0] == pytest.approx(maze.base_pose[2])
    assert math.dist(path.tips[-1], maze.goal) <= maze.goal_radius
    shares = np.linspace(0.0, 1.0, 12)[:, None]
    tails = np.concatenate([a + shares * (b - a) for a, b in zip(path.tails, path.tails[1:], strict=False)])
    before, after = path.headings[:-1], path.headings[1:]
    headings = (before + shares * (after - before)).T.ravel()
    tips = tails + path.length * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    rods = shapely.linestrings(np.stack([tails, tips], axis=1))
    free = maze.free_space.buffer(1e-7)
    shapely.prepare(free)
    assert shapely.covers(free, rods).all()


# Closed forms


@pytest.mark.parametrize(("a", "b"), [(200.0, 200.0), (200.0, 120.0), (80.0, 250.0), (150.0, 30.0)])
def test_a_right_angled_bend_has_its_closed_form(a, b):
    maze = bend(a, b)
    bound = rod_bound(maze)
    assert_near(bound, longest_in_bend(a, b))
    assert bound.limited_by == "maze"
    assert_path_is_free(maze, bound.path)


@pytest.mark.parametrize(("l1", "l2", "wall"), [(200.0, 200.0, 40.0), (120.0, 200.0, 80.0)])
def test_a_turn_with_a_wide_end_lets_a_rod_lie_across(l1, l2, wall):
    assert_near(rod_bound(fig19(l1, l2, wall, 250.0)), l1 + wall + l2)


@pytest.mark.parametrize(
    ("l1", "l2", "end_gap"), [(200.0, 200.0, 60.0), (200.0, 200.0, 110.0), (200.0, 120.0, 80.0)]
)
def test_a_turn_with_a_narrow_end_is_two_bends_in_a_row(l1, l2, end_gap):
    # The rod leaves the first leg tip first, and at some moment lies along the end. Until then its tail is in
    # the first leg and its tip under the end wall, so it turns in a bend of widths l1 and end_gap; from then
    # on, seen backwards, in one of widths l2 and end_gap.
    length = min(longest_in_bend(l1, end_gap), longest_in_bend(l2, end_gap), l1 + 40.0 + l2)
    assert_near(rod_bound(fig19(l1, l2, 40.0, end_gap)), length)


def test_a_bend_of_many_short_walls_has_the_bound_of_a_ring():
    # A chord of the outer circle that touches the inner one; the edges are within 0.04 % of the circles.
    bound = rod_bound(arc(300.0, 400.0), accuracy=0.02)
    assert bound.lower <= 1.002 * 2 * math.sqrt(400.0**2 - 300.0**2)
    assert bound.upper >= 0.998 * 2 * math.sqrt(400.0**2 - 300.0**2)
    assert bound.proven


def test_a_straight_way_to_the_end_is_limited_by_the_feeder():
    bound = rod_bound(maze_of(box(-50, 0, 50, 1000), (0, 5, math.pi / 2), (0, 990)))
    assert bound.limited_by == "feeder"
    assert_near(bound, 995.0)


def test_a_goal_on_the_straight_way_limits_no_rod():
    # A longer rod gets there too, and ends still in the feeder.
    maze = maze_of(box(-50, 0, 50, 1000), (0, 5, math.pi / 2), (8, 800))
    bound = rod_bound(maze)
    assert (bound.lower, bound.upper, bound.limited_by, bound.proven) == (995.0, 995.0, "feeder", True)
    assert math.dist(bound.path.tips[-1], maze.goal) <= maze.goal_radius
    assert bound.path.way.tolist() == pytest.approx(np.array([(0.0, 5.0), (0.0, 800.0)]))


@pytest.mark.parametrize(("aside", "limited_by"), [(9.9, "feeder"), (10.1, "maze")])
def test_a_goal_beside_the_straight_way_is_on_it_if_its_radius_says_so(aside, limited_by):
    bound = rod_bound(maze_of(box(-50, 0, 50, 1000), (0, 5, math.pi / 2), (aside, 800)))
    assert bound.limited_by == limited_by


@pytest.mark.parametrize("length", [300.0, 794.0, 796.0, 900.0, 995.0])
def test_a_link_with_a_motion_to_a_goal_on_the_straight_way_is_a_rod_that_passes(length):
    maze = maze_of(box(-50, 0, 50, 1000), (0, 5, math.pi / 2), (0, 800))
    assert plan(maze, ArmSpec(link_length=length)).solved
    assert rod_passes(maze, length).passes is Passage.YES


def test_a_goal_close_behind_a_corner_limits_the_rod():
    # At the end the rod lies from the left wall, past the inner corner (100, 1400), to the goal's disc.
    goal, radius, corner = np.array([150.0, 1500.0]), 10.0, np.array([100.0, 1400.0])

    def shorter(angle):
        tip = goal + radius * np.array([math.cos(angle), math.sin(angle)])
        return -math.dist(tip, corner) * (tip[0] + 100.0) / (tip[0] - 100.0)

    longest = -minimize_scalar(shorter, bounds=(math.pi / 2, 3 * math.pi / 2), method="bounded").fun
    bound = rod_bound(corner_goal(goal, radius), accuracy=0.02)
    assert_near(bound, longest, 0.02)
    assert longest > longest_in_bend(200.0, 200.0)


def test_of_two_ways_the_wide_one_counts():
    both, wide, narrow = (rod_bound(two_ways(plugged)) for plugged in (None, "above", "below"))
    assert max(both.lower, wide.lower) <= min(both.upper, wide.upper)
    assert narrow.upper < both.lower


# Laws


@pytest.mark.parametrize("angle", [0.3, 2.0])
def test_the_bound_turns_and_grows_with_the_maze(angle):
    maze = bend(100.0, 160.0, leg=500.0)
    turned = scale(rotate(maze.free_space, angle, origin=(0, 0), use_radians=True), 3.0, 3.0, origin=(0, 0))
    turn = 3.0 * np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    base, heading = turn @ maze.base_pose[:2], maze.base_pose[2] + angle
    bound = rod_bound(maze_of(turned, (*base, heading), turn @ maze.goal, 30.0))
    assert_near(bound, 3.0 * longest_in_bend(100.0, 160.0))


def test_thick_links_have_the_bound_of_the_narrower_maze():
    # Grown walls leave a corridor narrower by a diameter and a rounded inner corner, which is easier to pass.
    thin, thick = rod_bound(bend(200.0, 200.0)), rod_bound(bend(200.0, 200.0), 20.0)
    assert longest_in_bend(160.0, 160.0) <= thick.upper
    assert thick.upper < thin.lower
    # About the inner corner's arc, a rod at 45 degrees is nearer to the outer walls by what rounding leaves.
    assert thick.lower <= longest_in_bend(200.0, 200.0) - 2 * 20.0


def test_links_too_thick_for_the_maze_do_not_pass():
    bound = rod_bound(fig19(), 150.0)
    assert (bound.lower, bound.upper, bound.path) == (0.0, 0.0, None)
    assert rod_passes(fig19(), 100.0, 150.0).passes is Passage.NO


@given(st.floats(0.05, 1.3))
def test_a_rod_passes_if_and_only_if_it_is_shorter_than_the_limit(share):
    maze = bend(60.0, 60.0, leg=250.0)
    length = share * longest_in_bend(60.0, 60.0)
    verdict = rod_passes(maze, length)
    if abs(share - 1.0) > 1e-3:
        assert verdict.passes is (Passage.YES if share < 1.0 else Passage.NO)
    assert (verdict.path is not None) == (verdict.passes is Passage.YES)
    if verdict.path is not None:
        assert_path_is_free(maze, verdict.path)


def test_a_rod_longer_than_the_straight_way_does_not_pass():
    assert rod_passes(fig19(), 1596.0).passes is Passage.NO


def test_the_rods_path_through_pillars_is_free_and_short():
    rng = np.random.default_rng(3)
    free = box(0, 0, 900, 600)
    for x in range(250, 850, 150):
        for y in range(60, 600, 120):
            pillar = shapely.MultiPoint(rng.normal((x, y), 22.0, (7, 2))).convex_hull
            free = free.difference(pillar)
    maze = maze_of(free, (5, 300, 0), (870, 300), 20.0)
    verdict = rod_passes(maze, 120.0)
    assert verdict.passes is Passage.YES
    assert_path_is_free(maze, verdict.path)
    assert np.linalg.norm(np.diff(verdict.path.tails, axis=0), axis=1).sum() < 1.2 * 750.0


def test_without_time_the_interval_is_the_first_one():
    bound = rod_bound(fig19(), deadline=now())
    assert (bound.lower, bound.path, bound.proven, bound.limited_by) == (0.0, None, False, "feeder")
    assert bound.upper == pytest.approx(1595.0)


def test_progress_does_not_fall():
    shares = []
    rod_bound(fig19(), progress=lambda stage, share: shares.append(share))
    assert shares[0] == 0.0
    assert shares == sorted(shares)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rod_bound(fig19(), accuracy=0.0), "Expected an accuracy between 0 and 1, got 0.0."),
        (lambda: rod_passes(fig19(), -1.0), "Expected a positive, finite length, got -1.0."),
        (lambda: rod_passes(fig19(), math.inf), "Expected a positive, finite length, got inf."),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(InputError) as error:
        call()
    assert str(error.value) == message


# Kernels


SPACES = [_first_triangles(maze) for maze in (fig19(), arc(300.0, 400.0, 30), two_ways())]


def contains(gaps, direction):
    return any((direction - start) % (2 * math.pi) <= end - start for start, end in gaps)


@given(
    st.sampled_from(SPACES),
    st.integers(0, 10**6),
    st.floats(10.0, 900.0),
    st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=1, max_size=5),
    st.floats(1e-3, 1.0),
)
def test_a_heading_that_is_free_from_some_tail_in_a_triangle_is_possible(space, pick, length, places, shrink):
    corners = space.vertices[space.triangles[pick % space.counts[1]]]
    corners = corners[pick % 3] + shrink * (corners - corners[pick % 3])
    n = len(space.walls)
    blocked, free, gaps = np.empty((n + 1, 2)), np.empty((n + 1, 2)), np.empty((GAPS, 2))
    n_gaps = possible_gaps(space, corners, length, np.empty(n, dtype=np.bool_), blocked, gaps)
    for u, v in places:
        a, b = (u, v) if u + v <= 1.0 else (1.0 - u, 1.0 - v)
        tail = (1 - a - b) * corners[0] + a * corners[1] + b * corners[2]
        if shapely.distance(shapely.multilinestrings(list(space.walls)), shapely.points(tail)) < 1e-6:
            continue
        for start, end in free[: free_directions(*tail, length, space.walls, SLACK, blocked, free)]:
            for direction in np.linspace(start, end, 7):
                assert contains(gaps[:n_gaps], direction)


@given(
    st.sampled_from(SPACES),
    st.integers(0, 10**6),
    st.tuples(st.floats(-60, 60), st.floats(-60, 60)),
    st.floats(-math.pi, math.pi),
    st.floats(10.0, 600.0),
)
def test_a_sweep_is_free_exactly_when_its_area_meets_no_wall(space, pick, step, heading, length):
    p = space.vertices[space.triangles[pick % space.counts[1]]].mean(axis=0)
    q, rod = p + step, length * np.array([math.cos(heading), math.sin(heading)])
    area = shapely.MultiPoint([p, q, p + rod, q + rod]).convex_hull
    distance = shapely.distance(shapely.multilinestrings(list(space.walls)), area)
    free = sweep_is_free(*p, *q, heading, length, space)
    if distance > 1e-6:
        assert free or LineString([p, q]).length == 0.0
    elif shapely.intersects(shapely.multilinestrings(list(space.walls)), area.buffer(-1e-6)):
        assert not free


def test_a_small_maze_is_decided_in_plain_python_too():
    # Small enough to run without compiling, where an index out of bounds is an error.
    maze = maze_of(box(0, 0, 10, 40).union(box(0, 30, 40, 40)), (5, 1, math.pi / 2), (35, 35), 2.0)
    assert rod_passes(maze, 20.0).passes is Passage.YES
    assert rod_passes(maze, 35.0).passes is Passage.NO
