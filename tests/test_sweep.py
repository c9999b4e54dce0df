"""Laws of the sweep: exact chords on one joint track, and how far it gets."""

import numpy as np
import pytest

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from planners import PlanningStatus, plan, sweep_track
from planners.corners import critical_corners
from planners.kernels.sweep import FASTEST
from planners.query import Query
from planners.survey import survey
from planners.sweep_planner import FINENESSES, MIN_CURVATURE, VARIANTS, plan_sweep
from planners.sweep_track import aim_line, grow

FINENESS = FINENESSES[1]

# In px, at corridors 200 wide: within half a percent of the longest that any planner here has passed.
LONG = {
    "fig19": 439.2,
    "L": 562.0,
    "U40": 439.0,
    "U200": 560.0,
    "S0": 760.0,
    "S200": 423.0,
    "S400": 446.0,
    "S1000": 562.0,
    "zig3": 439.0,
    "serp": 439.0,
}


def track_of(maze, length, variants=()):
    """Return a track that takes the first corners as told and all others in the default way."""
    geometry = survey(maze)
    corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE)
    ways = [VARIANTS[k] for k in (*variants, *[0] * len(corners))][: len(corners)]
    return grow(geometry, ArmSpec(link_length=length), FINENESS, aim_line(geometry, corners, ways, length))


@pytest.mark.parametrize("name", LONG)
def test_links_near_the_limit_pass_every_turn(name):
    result = plan(Maze.load(name), ArmSpec(link_length=LONG[name]), planner="sweep")
    assert result.solved, result.reason
    assert result.report.penetration == 0.0


@pytest.mark.parametrize("share", [0.25, 0.5, 0.75, 0.9, 0.97])
@pytest.mark.parametrize("name", ["S0", "zig3"])
def test_shorter_links_pass_too(name, share):
    result = plan(Maze.load(name), ArmSpec(link_length=share * LONG[name]), planner="sweep")
    assert result.solved, result.reason


@pytest.mark.parametrize(("name", "length"), [("fig19", 430.0), ("serp", 300.0)])
def test_every_vertex_is_one_link_length_from_its_start(name, length):
    track = track_of(Maze.load(name), length)
    assert track.reached
    vertices = np.arange(FINENESS.per_link, track.n)
    chords = track.points[vertices] - track.points[track.start[vertices]]
    np.testing.assert_allclose(np.hypot(*chords.T), length, rtol=1e-12)


@pytest.mark.parametrize(("name", "length"), [("fig19", 430.0), ("serp", 300.0), ("S200", 200.0)])
def test_neighbouring_vertices_are_never_farther_apart_than_allowed(name, length):
    track = track_of(Maze.load(name), length)
    steps = np.hypot(*np.diff(track.points[: track.n], axis=0).T)
    assert steps.max() <= FASTEST * length / FINENESS.per_link * (1 + 1e-9)


def test_starts_only_move_forward():
    track = track_of(fig19(), 430.0)
    assert (np.diff(track.start[: track.n]) >= 0).all()


def test_the_aim_swings_to_the_outer_wall_at_the_corner_and_fades_into_the_goal():
    geometry = survey(fig19())
    corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE)[:1]
    line = aim_line(geometry, corners, [VARIANTS[0]], 430.0)
    np.testing.assert_allclose(line[-1], geometry.path.points[-1], atol=1e-9)
    middle = (corners[0].first + corners[0].last) // 2
    assert np.hypot(*(line[middle] - geometry.beams.left[middle])) < 0.1 * geometry.path.width


def test_links_longer_than_any_rod_that_passes_end_in_a_dead_end():
    # No rod longer than 440 passes: it must lie across both legs and the wall at some moment.
    candidate = plan_sweep(Query(maze=fig19(), arm=ArmSpec(link_length=445.0)))
    assert candidate.status is PlanningStatus.DEAD_END
    assert candidate.motion is None and "stays free" in candidate.reason
    assert candidate.failure is not None


def test_round_bends_of_many_short_walls_are_passed():
    angle = np.linspace(np.pi, 0.0, 120)
    bend = 300.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    maze = Maze.from_corridors(np.vstack([[(-300.0, -900.0)], bend, [(300.0, -900.0)]]), 150.0)
    result = plan(maze, ArmSpec(link_length=350.0), planner="sweep")
    assert result.solved, result.reason


def test_a_deadline_that_has_passed_ends_planning():
    query = Query(maze=Maze.load("S200"), arm=ArmSpec(link_length=430.0), deadline=0.0)
    candidate = plan_sweep(query)
    assert candidate.status is PlanningStatus.OUT_OF_TIME and candidate.motion is None
    assert candidate.failure.path_position > 0.0


def test_a_track_drawn_in_pieces_is_the_same(monkeypatch):
    whole = track_of(Maze.load("serp"), 300.0)
    monkeypatch.setattr(sweep_track, "CHUNK", 500)
    pieces = track_of(Maze.load("serp"), 300.0)
    assert pieces.reached and pieces.n == whole.n
    np.testing.assert_array_equal(pieces.points[: pieces.n], whole.points[: whole.n])


def test_a_track_goes_on_from_where_its_aim_differs():
    maze, length = Maze.load("serp"), 430.0
    geometry = survey(maze)
    corners = critical_corners(geometry.path, geometry.beams, MIN_CURVATURE)
    ways = [VARIANTS[0]] * len(corners)
    other = [*ways[:-1], VARIANTS[1]]
    arm = ArmSpec(link_length=length)
    first, second = (aim_line(geometry, corners, way, length) for way in (ways, other))
    earlier = grow(geometry, arm, FINENESS, first)
    resumed, fresh = grow(geometry, arm, FINENESS, second, earlier), grow(geometry, arm, FINENESS, second)
    assert resumed.resumed > 0.2 * earlier.n
    assert resumed.n == fresh.n
    np.testing.assert_array_equal(resumed.points[: fresh.n], fresh.points[: fresh.n])
