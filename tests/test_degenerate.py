"""Degenerate geometry is refused in one sentence or answered right, wherever it lies and however large."""

import re
import warnings

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import Polygon

from benchmarks.trust.degenerate import look_everywhere
from hrsnake_env.arguments import length_text
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.planning import plan
from planners.potential import passage_width
from planners.rod_bound import rod_bound
from planners.spatial import Workspace, random_room
from planners.spatial import plan as plan_in_space
from planners.track_scene import Scene
from planners.validation import validate


def corridor(**changes):
    """Return a straight corridor."""
    made = {
        "name": "corridor",
        "free_space": shapely.box(-0.05, -0.5, 3.0, 0.5),
        "base_pose": (0.0, 0.0, 0.0),
        "goal": (2.5, 0.0),
        "goal_radius": 0.1,
    }
    return Maze(**(made | changes))


def placed(maze, scale, offset):
    """Return a maze scaled and moved."""
    return Maze(
        name=maze.name,
        free_space=shapely.transform(maze.free_space, lambda xy: xy * scale + offset),
        base_pose=(*(maze.base_pose[:2] * scale + offset), maze.base_pose[2]),
        goal=maze.goal * scale + offset,
        goal_radius=maze.goal_radius * scale,
    )


@settings(max_examples=8)
@given(st.integers(0, 10**6))
def test_no_degenerate_scene_breaks_a_law(seed):
    _, faults = look_everywhere(seed, extras=False)
    assert not [fault for fault in faults if not fault.startswith("time:")]  # the campaign looks at the clock


@pytest.mark.parametrize("planner", ["track", "sweep", "beam"])
@pytest.mark.parametrize(("scale", "offset"), [(1e-3, 1e6), (1.0, 1e9), (1e6, 0.0)])
def test_a_maze_far_from_the_origin_is_planned_as_at_it(planner, scale, offset):
    maze, arm = placed(Maze.load("U40"), scale, offset), ArmSpec(link_length=200.0 * scale)
    result = plan(maze, arm, planner, time_budget=20.0)
    assert result.solved and validate(result.motion, maze, arm).valid


def test_a_failure_far_from_the_origin_is_placed_in_the_maze():
    maze = placed(Maze.load("fig19"), 1e-3, 1e6)
    result = plan(maze, ArmSpec(link_length=0.5), "track")
    assert not result.solved and shapely.dwithin(shapely.Point(result.place), maze.free_space, 1e-3)


@pytest.mark.parametrize(("scale", "offset"), [(1e-3, 1e3), (1e-3, 1e6), (1.0, 1e9)])
def test_a_room_far_from_the_origin_is_planned_as_at_it(scale, offset):
    far = far_room(scale, offset)
    result = plan_in_space(far, ArmSpec(link_length=far.straight), "track", time_budget=20.0)
    assert result.solved


def far_room(scale, offset):
    """Return a random room scaled and moved."""
    room = random_room(1)
    return Workspace(
        name="far",
        room_low=room.room_low * scale + offset,
        room_high=room.room_high * scale + offset,
        base=room.base * scale + offset,
        heading=room.heading,
        straight=room.straight * scale,
        goal=room.goal * scale + offset,
        goal_radius=room.goal_radius * scale,
        open_sides=room.open_sides,
        boxes=room.boxes * scale + offset,
    )


def test_a_warm_start_from_another_workspace_is_refused():
    room = random_room(1)
    solved = plan_in_space(room, ArmSpec(link_length=room.straight))
    with pytest.raises(InputError, match="belongs to another workspace"):
        plan_in_space(room.moved([0.0, 0.0, 1.0]), ArmSpec(link_length=room.straight), warm_start=solved)


def test_a_maze_comes_back_from_its_file_with_the_same_walls():
    ring = [(-0.05, -0.5), (3.0, -0.5), (3.0, 0.5), (-0.05, 0.5)]
    beside = [(x + 1e-9 * (k in (0, 3)), y + 1e-9 * (k == 1)) for k, (x, y) in enumerate(ring)]
    maze = corridor(
        free_space=Polygon([p for pair in zip(ring, beside, strict=True) for p in pair]).buffer(0)
    )
    assert (Maze.from_geojson(maze.to_geojson()).walls == maze.walls).all()


@pytest.mark.parametrize("planner", ["track", "sweep", "beam"])
@pytest.mark.parametrize(("scale", "offset"), [(1e-3, 0.0), (1e-5, 3.0), (1.0, 0.0), (1e3, 0.0)])
def test_a_reason_tells_places_as_finely_as_the_maze_is_small(planner, scale, offset):
    maze = placed(Maze.load("fig19"), scale, offset)
    result = plan(maze, ArmSpec(link_length=500.0 * scale), planner)
    told = re.search(r"\(([-\d.]+), ([-\d.]+)\)", result.reason)
    off = np.array([float(figure) for figure in told.groups()]) - result.place
    if "seen from the base" in result.reason:
        off += maze.base_pose[:2]
    assert np.abs(off).max() <= 1e-4 * maze.size


@pytest.mark.parametrize("size", [1e-30, 1e-9, 2e-3, 1.0, 2e3, 9.99e5, 1e30])
@pytest.mark.parametrize("share", [-1.0, -0.123456, -1e-6, 0.0, 1e-3, 0.5, 7.7])
def test_a_length_is_told_to_a_ten_thousandth_of_the_size(size, share):
    assert abs(float(length_text(share * size, size)) - share * size) <= 1e-4 * size


def test_points_on_a_straight_wall_make_no_walls():
    x = np.linspace(-0.05, 3.0, 10_000)
    ring = [*zip(x, np.full(x.size, -0.5), strict=True), (3.0, 0.5), (-0.05, 0.5)]
    assert len(corridor(free_space=Polygon(ring)).walls) == 4


@pytest.mark.parametrize("angle", np.linspace(0.05, 3.95, 40))
def test_no_wall_of_a_maze_is_a_point(angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    ring = np.array([(-0.05, -0.5), (1.0, -0.5), (3.0, -0.5), (3.0, 0.5), (3.0, 0.5), (-0.05, 0.5)]) @ turn.T
    maze = corridor(free_space=Polygon(ring), base_pose=(0.0, 0.0, angle), goal=turn @ (2.5, 0.0))
    assert (maze.walls[:, 0] != maze.walls[:, 1]).any(axis=1).all()


def test_no_wall_is_a_point_in_link_lengths_either():
    # Corners a hair apart, which are one after a turn and a division.
    ring = [(-0.05, -0.5), (3.0, -0.5)]
    for k in range(60):
        x, y = 3.0 - 0.05 * k, 0.5 + 0.001 * (k % 7)
        ring += [(x, y), (np.nextafter(x, -np.inf), y)]
    maze = corridor(free_space=Polygon(ring))
    scene = Scene(maze=maze, length=1.3, joint_limit=np.inf)
    assert len(scene.near.walls) < len(maze.walls)
    assert (scene.near.walls[:, 0] != scene.near.walls[:, 1]).any(axis=1).all()
    assert plan(maze, ArmSpec(link_length=1.3), "track").solved


@pytest.mark.parametrize("scale", [1e-55, 1e-12, 1e-6, 1.0, 1e12, 1e55])
def test_corridors_have_the_same_shape_in_all_units(scale):
    bend = np.array([(0.0, 0.0), (0.0, 913.7), (731.9, 1204.1)])
    wanted = Maze.from_corridors(bend, 217.3, base_offset=5.0)
    maze = Maze.from_corridors(bend * scale, 217.3 * scale, base_offset=5.0 * scale)
    assert maze.walls == pytest.approx(wanted.walls * scale, rel=1e-9, abs=1e-9 * wanted.size * scale)
    assert plan(maze, ArmSpec(link_length=200.0 * scale)).solved


def test_small_pieces_of_walls_hardly_change_the_width_of_the_passage():
    x = np.linspace(-0.05, 3.0, 3_000)
    rough = [*zip(x, -0.5 - 1e-3 * (np.arange(x.size) % 2), strict=True), (3.0, 0.5), (-0.05, 0.5)]
    width = passage_width(corridor(free_space=Polygon(rough)))
    assert width == pytest.approx(passage_width(corridor()), rel=0.02)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Maze.from_corridors([], 200.0),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], "wide"),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], [200.0, 300.0]),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], 200.0, base_offset=float("inf")),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], 200.0, base_offset="near"),
        lambda: Maze.from_corridors(None, 200.0),
        lambda: Maze.from_corridors([[(0, 0), (0, 900)], ["away"]], 200.0),
        lambda: Maze.from_corridors([(0, 0), (0, True)], 200.0),
        lambda: Maze.from_corridors([(0, 0), (0, "900")], 200.0),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], True),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], [True]),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], 200.0, goal=(True, 800)),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], 200.0, goal_radius=True),
        lambda: Maze.from_corridors([(0, 0), (0, 900)], 200.0, base_offset=True),
        lambda: Maze.from_corridors([(0, 0), (0, 1e160)], 1e159),
        lambda: Maze.from_corridors([(0, 0), (0, 1e-160)], 1e-161, base_offset=1e-162),
        lambda: corridor(free_space=shapely.box(-1e160, -1e160, 1e160, 1e160)),
        lambda: corridor(base_pose=(0, 0, False)),
        lambda: corridor(goal=("2.5", 0)),
        lambda: corridor(goal_radius="small"),
        lambda: corridor(goal_radius=None),
        lambda: corridor(goal=(3.0, 0.0)),
        lambda: corridor(base_pose=(-0.05, 0.0, 0.0)),
        lambda: plan(corridor(), ArmSpec(link_length=1e-6)),
        lambda: plan(corridor(), ArmSpec(link_length=1.0), time_budget="long"),
        lambda: rod_bound(corridor(), float("nan")),
        lambda: rod_bound(corridor(), -1.0),
    ],
)
def test_what_is_no_maze_or_arm_is_refused_in_one_sentence(make):
    with warnings.catch_warnings(), pytest.raises(InputError, match=r"^Expected .*\.$"):
        warnings.simplefilter("error")
        make()
