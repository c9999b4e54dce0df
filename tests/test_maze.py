"""Laws of the maze, its files, and its errors."""

import json
import math

import numpy as np
import pytest
from shapely.geometry import MultiPolygon, Point, Polygon, box

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import (
    FIG17A_LEG,
    LEGS,
    MAZES,
    PAPER_LINK_LENGTHS,
    corridor_family,
    fig17a,
    fig17b,
    fig17c,
    fig17d,
    fig19,
    serpentine,
)
from planners import plan
from planners.rod_bound import Passage, rod_passes
from planners.rollout import simulate_motion
from planners.survey import survey


def hall(**changes):
    """Return a square hall with a square pillar, or one changed."""
    values = {
        "name": "hall",
        "free_space": Polygon(box(0, 0, 100, 100).exterior, [box(40, 40, 60, 60).exterior.coords]),
        "base_pose": (5.0, 50.0, 0.0),
        "goal": (90.0, 50.0),
        "goal_radius": 3.0,
    }
    return Maze(**{**values, **changes})


def collection(**roles):
    """Return a good maze file as data, with the features of some roles changed or (None) left out."""
    good = {
        "free": {"geometry": {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 9], [0, 0]]]}},
        "base": {"geometry": {"type": "Point", "coordinates": [1, 5]}, "heading_deg": 0.0},
        "goal": {"geometry": {"type": "Point", "coordinates": [8, 5]}, "radius": 0.5},
    }
    features = []
    for role, parts in {**good, **roles}.items():
        if parts is not None:
            properties = {key: value for key, value in parts.items() if key != "geometry"}
            features.append(
                {"type": "Feature", "properties": {"role": role, **properties}, "geometry": parts["geometry"]}
            )
    return {"type": "FeatureCollection", "name": "box", "units": "m", "features": features}


@pytest.mark.parametrize("name", MAZES)
def test_named_mazes_survive_the_round_trip_through_a_file(name, tmp_path):
    maze = Maze.load(name)
    path = tmp_path / "maze.geojson"
    maze.save(path)
    again = Maze.load(path)
    assert again.free_space.equals(maze.free_space)
    np.testing.assert_array_equal(again.goal, maze.goal)
    np.testing.assert_allclose(again.base_pose, maze.base_pose, atol=1e-15)
    assert (again.name, again.units, again.goal_radius) == (maze.name, maze.units, maze.goal_radius)
    assert list(tmp_path.iterdir()) == [path]


def test_holes_survive_the_round_trip():
    maze = hall()
    assert Maze.from_geojson(json.loads(json.dumps(maze.to_geojson()))).free_space.equals(maze.free_space)


def test_walls_have_the_free_space_on_their_left():
    maze = hall()
    middles = maze.walls.mean(axis=1)
    along = maze.walls[:, 1] - maze.walls[:, 0]
    left = middles + 1e-3 * np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    from shapely import contains_xy

    assert contains_xy(maze.free_space, left).all()
    assert len(maze.walls) == 8


def test_arrays_of_a_maze_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        hall().goal[0] = 1.0


def test_fig19_has_the_papers_lengths():
    # Section 5.1: l1 = l2 = 200, l_max = 440 = l1 + wall + l2.
    maze = fig19()
    x = np.unique(maze.walls[:, 0, 0])
    np.testing.assert_array_equal(x, [-100, 100, 140, 340])
    np.testing.assert_array_equal(maze.goal, [240, 700])


def test_fig19_is_the_corridor_of_its_family():
    assert fig19().free_space.equals(corridor_family("U40").free_space)


def test_fig17a_has_the_papers_path_within_one_percent():
    # Section 4 of the paper: a global path of 10,505 px.
    assert survey(fig17a()).path.length == pytest.approx(10505.0, rel=0.01)


@pytest.mark.parametrize(
    ("line", "width", "longest"),
    [
        ([(0, 0), (0, 900), (136, 900), (136, 0)], 118.0, 254.0),
        ([(0, 0), (0, 900), (900, 900)], 90.0, 254.558),
    ],
)
def test_every_turn_of_fig17a_is_extremely_tight(line, width, longest):
    turn = Maze.from_corridors(line, width)
    assert rod_passes(turn, 0.998 * longest).passes is Passage.YES
    assert rod_passes(turn, 1.002 * longest).passes is Passage.NO
    assert PAPER_LINK_LENGTHS["fig17a"] / (1.002 * longest) >= 0.96
    # Both stand in the maze: the widths of its corridors are these two.
    beams = survey(fig17a()).beams
    across = np.hypot(*(beams.left - beams.right).T)
    assert (np.abs(across - width) < 1.0).mean() > 0.25


def test_the_last_bend_of_fig17a_is_as_tight_as_the_others():
    maze = fig17a()
    (x, y), top = maze.goal, FIG17A_LEG + 20.0
    last = Maze.from_corridors(
        [(x - 520, 100), (x - 520, top), (x, top), (x, y - 40)], 90.0, goal=maze.goal, goal_radius=45.0
    )
    assert maze.free_space.buffer(1e-6).covers(last.free_space)
    assert rod_passes(last, 255.2).passes is Passage.NO


@pytest.mark.parametrize(
    ("name", "index"), [("fig19", 0.97), ("fig17a", 0.96), ("fig17b", 0.9), ("fig17c", 0.9), ("fig17d", 0.9)]
)
def test_a_link_of_the_papers_workspaces_is_nearly_the_longest_rod_that_passes(name, index):
    maze, length = Maze.load(name), PAPER_LINK_LENGTHS[name]
    assert rod_passes(maze, length).passes is Passage.YES
    assert rod_passes(maze, length / index).passes is Passage.NO


@pytest.mark.parametrize(
    ("name", "light"),
    [("fig17a", (0.0, 0.0)), ("fig17b", (0.2, 0.8)), ("fig17c", (0.2, 0.8)), ("fig17d", (0.2, 0.8))],
)
def test_but_the_first_workspace_they_have_light_places_besides_tight_ones(name, light):
    # The share of the path along which the walls are farther apart than a link is long.
    beams = survey(Maze.load(name)).beams
    share = (np.hypot(*(beams.left - beams.right).T) > PAPER_LINK_LENGTHS[name]).mean()
    assert light[0] <= share <= light[1]


def test_a_goal_that_reaches_the_base_is_refused():
    for goal in ((0.0, 5.0), (0.0, 14.0)):
        with pytest.raises(InputError, match=r"Expected a goal away from the base, .* radius of 10"):
            Maze.from_corridors([(0, 0), (0, 500)], 100.0, goal=goal, goal_radius=10.0)


@pytest.mark.parametrize("build", [fig17b, fig17c, fig17d])
def test_our_workspaces_hold_their_goal_and_are_as_large_as_the_first(build):
    maze = build()
    assert maze.free_space.contains(Point(maze.goal).buffer(maze.goal_radius))
    assert maze.size == pytest.approx(fig17a().size, rel=0.2)


@pytest.mark.parametrize("name", PAPER_LINK_LENGTHS)
def test_the_papers_workspaces_are_solved_and_their_links_merely_pinch_the_walls(name):
    maze, arm = Maze.load(name), ArmSpec(link_length=PAPER_LINK_LENGTHS[name])
    motion = plan(maze, arm).motion
    assert motion is not None
    if name == "fig17a":  # section 4 of the paper: 45 links, 1870 poses
        assert motion.n_links == 45 and motion.n_poses >= 1870
    else:
        assert 6 <= motion.n_links <= 30
    episode = simulate_motion(motion, maze, arm)
    assert episode.success and episode.report.clean
    assert episode.report.pinch > 0 and episode.report.collision == 0


@pytest.mark.parametrize("inward", [1.0, 2.0, 5.0, -5.0])
def test_fig19_moves_all_its_walls_by_the_same_amount(inward):
    moved = fig19(l1=200 - 2 * inward, l2=200 - 2 * inward, wall=40 + 2 * inward, end_gap=200 - 2 * inward)
    line = [(0, 0), (0, 1500), (240, 1500), (240, 0)]
    assert moved.free_space.equals(Maze.from_corridors(line, 200 - 2 * inward).free_space)


@pytest.mark.parametrize("name", LEGS)
def test_families_are_200_wide_with_their_base_5_in(name):
    maze = Maze.load(name)
    np.testing.assert_allclose(maze.base_pose, [0.0, 5.0, math.pi / 2])
    length = sum(float(leg[1:]) for leg in LEGS[name].split())
    assert maze.free_space.area == pytest.approx(200.0 * length)  # square corners add what overlaps take away


def test_corridors_are_joined_and_may_have_different_widths():
    maze = Maze.from_corridors([[(0, 0), (0, 500)], [(0, 450), (600, 450)]], [100, 60])
    assert maze.free_space.area == pytest.approx(100 * 500 + 60 * 550)
    np.testing.assert_allclose(maze.goal, [570, 450])


def test_of_several_parts_the_one_with_the_base_is_kept():
    maze = hall(free_space=MultiPolygon([box(0, 0, 100, 100), box(200, 0, 300, 100)]))
    assert maze.free_space.area == 10_000


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"free_space": Polygon()}, "Expected a free space with an area, got an empty polygon."),
        ({"free_space": Polygon([(0, 0), (9, 9), (9, 0), (0, 9)])}, "Expected a valid polygon as free space"),
        ({"free_space": "box"}, "Expected the free space as a Polygon, got 'box'."),
        ({"base_pose": (-5.0, 50.0, 0.0)}, "Expected the base inside the free space, got (-5, 50)"),
        ({"base_pose": (50.0, 50.0, 0.0)}, "Expected the base inside the free space, got (50, 50)"),
        ({"base_pose": (0.0, 50.0, 0.0)}, "Expected the base inside the free space, got (0, 50)"),
        ({"base_pose": (5.0, math.nan, 0.0)}, "Expected base_pose (x, y, heading) as 3 finite numbers"),
        ({"base_pose": (5.0, 5.0)}, "Expected base_pose (x, y, heading) as 3 finite numbers"),
        ({"goal": (500.0, 50.0)}, "Expected the goal inside the free space, got (500, 50)"),
        ({"goal_radius": 0.0}, "Expected a positive, finite goal radius, got 0.0."),
        ({"goal_radius": math.nan}, "Expected a positive, finite goal radius, got nan."),
        (
            {"free_space": MultiPolygon([box(0, 0, 50, 100), box(60, 0, 100, 100)])},
            "Expected a free way from the base to the goal, but (90, 50) lies in another part",
        ),
    ],
)
def test_bad_mazes_are_refused_in_one_sentence(changes, message):
    with pytest.raises(InputError) as raised:
        hall(**changes)
    assert str(raised.value).startswith(message)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "Expected a GeoJSON FeatureCollection, got 'list'."),
        ({"type": "Feature"}, "Expected a GeoJSON FeatureCollection, got 'Feature'."),
        ({"type": "FeatureCollection"}, "Expected at least one feature with properties.role 'free', got 0."),
        (collection(free=None), "Expected at least one feature with properties.role 'free', got 0."),
        (collection(base=None), "Expected exactly one feature with properties.role 'base', got 0."),
        (collection(goal=None), "Expected exactly one feature with properties.role 'goal', got 0."),
        (
            collection(free={"geometry": {"type": "Point", "coordinates": [1, 1]}}),
            "Expected the 'free' feature to be a Polygon or MultiPolygon, got 'Point'.",
        ),
        (collection(base={"geometry": None}), "Expected the 'base' feature to be a Point, got None."),
        (
            collection(free={"geometry": {"type": "Polygon", "coordinates": [[[0, 0]]]}}),
            "Expected Polygon coordinates in the 'free' feature",
        ),
        (
            collection(free={"geometry": {"type": "Polygon", "coordinates": []}}),
            "Expected finite Polygon coordinates in the 'free' feature",
        ),
        (
            collection(base={"geometry": {"type": "Point", "coordinates": [1, 5]}}),
            "Expected a number as properties.heading_deg of the 'base' feature, got None.",
        ),
        (
            collection(goal={"geometry": {"type": "Point", "coordinates": [8, 5]}, "radius": "big"}),
            "Expected a number as properties.radius of the 'goal' feature, got 'big'.",
        ),
    ],
)
def test_bad_maze_files_are_refused_in_one_sentence(data, message, tmp_path):
    path = tmp_path / "bad.geojson"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError) as raised:
        Maze.load(path)
    assert str(raised.value).startswith(message)
    assert "\n" not in str(raised.value)


def test_unknown_names_list_what_there_is():
    with pytest.raises(InputError, match=r"Unknown maze 'fig20'\. Available: fig19, fig17a") as raised:
        Maze.load("fig20")
    assert all(name in str(raised.value) for name in MAZES)


def test_missing_and_broken_files_are_told_apart(tmp_path):
    with pytest.raises(InputError, match="but there is none"):
        Maze.load(tmp_path / "none.geojson")
    broken = tmp_path / "broken.geojson"
    broken.write_text("{")
    with pytest.raises(InputError, match="Expected JSON in"):
        Maze.load(broken)
    broken.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="Expected JSON in"):
        Maze.load(broken)
    with pytest.raises(InputError, match="got a folder or a device"):
        (tmp_path / "folder.geojson").mkdir()
        Maze.load(tmp_path / "folder.geojson")


@pytest.mark.parametrize(
    ("arm", "message"),
    [
        (ArmSpec(link_length=36.0), "Expected one link length (36 px) of straight free way"),
        (
            ArmSpec(link_length=150.0),
            "Expected a link_length of at most the size of maze 'hall' (141.421 px)",
        ),
        (ArmSpec(link_length=34.0, link_radius=2.0), "Expected one link length (34 px) of straight free way"),
    ],
)
def test_arms_that_do_not_leave_the_feeder_are_refused(arm, message):
    with pytest.raises(InputError) as raised:
        hall().check_arm(arm)
    assert str(raised.value).startswith(message)


def test_the_wall_behind_the_base_does_not_hold_a_thick_arm_back():
    hall().check_arm(ArmSpec(link_length=30.0, link_radius=5.0 - 1e-9))


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("key", ["l1", "l2", "wall", "end_gap"])
def test_fig19_refuses_bad_lengths(key, value):
    with pytest.raises(InputError, match=f"Expected a positive, finite {key}"):
        fig19(**{key: value})


@pytest.mark.parametrize("width", [0.0, -5.0, math.nan])
def test_corridors_refuse_bad_widths(width):
    with pytest.raises(InputError, match="Expected a positive, finite corridor width"):
        Maze.from_corridors([(0, 0), (0, 9)], width)


@pytest.mark.parametrize("name", ["clutter-3", "corridor-3"])
def test_seeded_mazes_are_drawn_from_their_seed_alone(name):
    maze, again = Maze.load(name), Maze.load(name)
    assert maze.name == name and maze.free_space.equals(again.free_space)
    assert not maze.free_space.equals(Maze.load(f"{name}4").free_space)


def test_a_clutter_hall_has_28_pillars_and_room_for_the_first_link():
    for seed in range(10):
        hall = Maze.load(f"clutter-{seed}")
        hall.check_arm(ArmSpec(link_length=290.0, link_radius=20.0))
        assert hall.free_space.area < 2000 * 1400 - 28 * 1500 / 4  # some may stand in one another


@pytest.mark.parametrize("name", ["corridor-x", "corridor-", "corridor--1", "clutter-1.5", "fig19-1"])
def test_a_seed_is_a_whole_number(name):
    with pytest.raises(InputError, match="corridor-SEED"):
        Maze.load(name)


@pytest.mark.parametrize("n_turns", [1, 4])
def test_a_serpentine_has_as_many_legs_as_turns_and_one(n_turns):
    maze = serpentine(n_turns, width=100.0, pitch=120.0, leg=800.0)
    assert maze.free_space.area == pytest.approx(
        100.0 * ((n_turns + 1) * 800.0 + n_turns * 120.0 + 320.0), rel=1e-9
    )
