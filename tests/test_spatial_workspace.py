"""Laws of the workspaces of a spatial arm, and of their files."""

import copy
import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners.spatial.panel import Panel
from planners.spatial.rooms import ROOMS, load_workspace, paired_panels, random_room
from planners.spatial.workspace import SIDES, Workspace

AXIS = st.integers(0, 2)
WAYS = st.one_of(
    arrays(np.float64, 3, elements=st.floats(-1.0, 1.0)).filter(lambda way: np.linalg.norm(way) > 0.1),
    st.builds(lambda axis, sign: sign * np.eye(3)[axis], AXIS, st.sampled_from([-1.0, 1.0])),
    st.sampled_from([np.array([1.0, 1e-300, 0.0]), np.array([1.0, -5e-324, 1e-17])]),
)

DATA = {
    "type": "hrsnake workspace",
    "name": "two rooms",
    "units": "mm",
    "room": {"low": [0, 0, 0], "high": [100, 60, 40], "open": ["x-"]},
    "panels": [
        {
            "low": [50, 0, 0],
            "high": [60, 60, 40],
            "normal": "x",
            "window": {"low": [50, 20, 10], "high": [60, 40, 40]},
        }
    ],
    "boxes": [{"low": [80, 10, 10], "high": [90, 20, 20]}],
    "base": {"position": [0, 30, 20], "heading": [2, 0, 0], "straight": 15},
    "goal": {"position": [70, 30, 20], "radius": 2},
}


def changed(path, value):
    """Return the plain workspace with one entry changed, or left out if the value is `...`."""
    data = copy.deepcopy(DATA)
    *parents, last = path.split(".")
    place = data
    for key in parents:
        place = place[int(key) if key.isdigit() else key]
    if value is ...:
        del place[last]
    else:
        place[int(last) if last.isdigit() else last] = value
    return data


def room(**changes):
    """Return an empty room of 100 x 60 x 40 with the base in its middle."""
    values = {
        "name": "empty",
        "room_low": (0, 0, 0),
        "room_high": (100, 60, 40),
        "base": (50, 30, 20),
        "heading": (1, 0, 0),
        "straight": 10.0,
        "goal": (90, 30, 20),
        "goal_radius": 2.0,
    }
    return Workspace(**{**values, **changes})


def message_of(make, *arguments):
    """Return what an InputError says, which is one line and one sentence."""
    with pytest.raises(InputError) as raised:
        make(*arguments)
    message = str(raised.value)
    assert "\n" not in message and message.endswith(".")
    return message


# Obstacles


@st.composite
def panels(draw):
    """Draw a panel with a window, which may reach its edges."""
    size = np.array(draw(st.tuples(*[st.integers(1, 20)] * 3)), dtype=float)
    low = np.array(draw(st.tuples(*[st.integers(-20, 20)] * 3)), dtype=float)
    start = np.array([draw(st.integers(0, int(most) - 1)) for most in size])
    end = [draw(st.integers(int(first) + 1, int(most))) for first, most in zip(start, size, strict=True)]
    return Panel(
        low=low,
        high=low + size,
        normal=draw(st.sampled_from("xyz")),
        window_low=low + start,
        window_high=low + end,
    )


@given(panels(), st.integers(0, 2**32 - 1))
def test_the_boxes_of_a_panel_are_all_of_it_but_the_window(panel, seed):
    extent = panel.high - panel.low
    points = np.random.default_rng(seed).uniform(panel.low - extent, panel.high + extent, (500, 3))

    def within(low, high):
        return ((points > low) & (points < high)).all(axis=-1)

    of_boxes = np.zeros(len(points), dtype=bool)
    for low, high in panel.boxes:
        assert (low < high).all()
        of_boxes |= within(low, high)
    wall = within(panel.low, panel.high) & ~within(panel.window_low, panel.window_high)
    np.testing.assert_array_equal(of_boxes, wall)


def test_an_edge_of_a_window_at_the_edge_of_its_panel_gives_no_box():
    assert len(Workspace.from_dict(DATA).panels[0].boxes) == 3
    whole = changed("panels.0.window", {"low": [50, 0, 0], "high": [60, 60, 40]})
    assert Workspace.from_dict(whole).panels[0].boxes.shape == (0, 2, 3)


def test_along_its_normal_a_window_goes_through():
    window = Workspace.from_dict(changed("panels.0.window.low", [0, 20, 10])).panels[0]
    np.testing.assert_array_equal(window.window_low, [50, 20, 10])


@st.composite
def furnished_rooms(draw):
    """Draw boxes on a coarse lattice, some across, at or beyond a side of the room, and its open sides."""
    boxes = []
    for _ in range(draw(st.integers(0, 5))):
        low = np.array(draw(st.tuples(*[st.sampled_from([-500, -10, 0, 5, 30, 300])] * 3)), dtype=float)
        boxes.append([low, low + draw(st.tuples(*[st.sampled_from([5, 10, 40, 1000])] * 3))])
    # Base and goal keep clear of the boxes: they are not asked about.
    free = [box for box in boxes if not (np.array(box[0]) < 85).all() or not (np.array(box[1]) > 15).all()]
    sides = tuple(draw(st.sets(st.sampled_from(SIDES))))
    return Workspace(
        name="drawn",
        room_low=np.zeros(3),
        room_high=np.full(3, 100.0),
        open_sides=sides,
        boxes=np.array(free),
        base=np.full(3, 20.0),
        heading=np.ones(3),
        straight=1.0,
        goal=np.full(3, 80.0),
        goal_radius=1.0,
    )


@given(furnished_rooms(), st.integers(0, 2**32 - 1))
def test_obstacles_are_the_walls_inside_and_all_that_is_behind_closed_sides(workspace, seed):
    points = np.random.default_rng(seed).uniform(-150.0, 250.0, (500, 3))

    def in_any(boxes):
        inside = (points[:, None] > boxes[:, 0]) & (points[:, None] < boxes[:, 1])
        return inside.all(axis=2).any(axis=1)

    shut = np.zeros(len(points), dtype=bool)
    for axis, name in enumerate("xyz"):
        shut |= (points[:, axis] < 0.0) & (name + "-" not in workspace.open_sides)
        shut |= (points[:, axis] > 100.0) & (name + "+" not in workspace.open_sides)
    np.testing.assert_array_equal(in_any(workspace.obstacles), shut | in_any(workspace.walls))
    assert (workspace.obstacles[:, 0] < workspace.obstacles[:, 1]).all()


@given(furnished_rooms())
def test_only_what_touches_a_closed_side_goes_on_behind_it_and_far(workspace):
    obstacles = workspace.obstacles[: len(workspace.walls)]
    for axis, name in enumerate("xyz"):
        closed_low, closed_high = (name + end not in workspace.open_sides for end in "-+")
        low, high = workspace.walls[:, 0, axis], workspace.walls[:, 1, axis]
        behind_low, behind_high = closed_low & (low <= 0.0), closed_high & (high >= 100.0)
        assert (obstacles[behind_low, 0, axis] <= -workspace.size).all()
        assert (obstacles[behind_high, 1, axis] >= 100.0 + workspace.size).all()
        np.testing.assert_array_equal(obstacles[~behind_low, 0, axis], low[~behind_low])
        np.testing.assert_array_equal(obstacles[~behind_high, 1, axis], high[~behind_high])


# The straight feed


def sampled_free_length(workspace, way, radius):
    """Return how far along a way the first of many points lies in a grown obstacle that is not behind."""
    reach = np.linspace(0.0, 200.0, 20_001)
    points = workspace.base + reach[:, None] * way
    first = math.inf
    for box in workspace.obstacles:
        corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3)
        if ((corners - workspace.base) @ way).max() > 0.0:
            inside = ((points > box[0] - radius) & (points < box[1] + radius)).all(axis=1)
            first = min(first, float(reach[inside].min(initial=math.inf)))
    return first


@given(furnished_rooms(), WAYS, st.sampled_from([0.0, 0.5, 15.0]))
def test_the_free_way_ends_where_the_first_obstacle_begins(workspace, way, radius):
    way = way / np.linalg.norm(way)
    free = workspace._free_along(way, radius)
    sampled = sampled_free_length(workspace, way, radius)
    # Points come every 0.01; an obstacle whose corner is only grazed may lie between two of them.
    assert free <= sampled + 1e-9
    if free < sampled - 0.01:
        ends = workspace.base + np.array([free, free + 0.01])[:, None] * way
        low, high = workspace.obstacles[:, 0] - radius, workspace.obstacles[:, 1] + radius
        at = (ends[0] >= low - 1e-9) & (ends[0] <= high + 1e-9)
        assert at.all(axis=1).any()


@pytest.mark.parametrize(
    ("box", "heading", "free"),
    [
        (((60, 0, 0), (70, 60, 40)), (1, 0, 0), 10.0),
        (((60, 0, 0), (70, 60, 40)), (-1, 0, 0), math.inf),
        (((60, 30, 0), (70, 60, 40)), (1, 0, 0), math.inf),  # along a face, to the left
        (((60, 0, 0), (70, 30, 40)), (1, 0, 0), math.inf),  # and to the right
        (((60, 30, 20), (70, 60, 40)), (1, 0, 0), math.inf),  # along an edge
        (((50, 0, 0), (70, 60, 40)), (1, 0, 0), 0.0),  # the base on a face, into it
        (((50, 0, 0), (70, 60, 40)), (-1, 0, 0), math.inf),  # and away from it
        (((50, 0, 0), (70, 60, 40)), (0, 1, 0), math.inf),  # and along it
        (((30, 0, 0), (50, 60, 40)), (1, 1, 0), math.inf),  # and aslant away from it
        (((30, 0, 0), (50, 60, 40)), (1, 0, 0), math.inf),
        (((60, 40, 0), (70, 60, 40)), (1, 1, 0), 10 * math.sqrt(2)),  # to an edge that the way enters
        (((60, 20, 0), (70, 40, 40)), (1, 1, 0), math.inf),  # past an edge that it touches
        (((60, 36, 0), (70, 60, 40)), (4, 3, 0), 12.5),
        (((50, 30, 20), (60, 40, 30)), (1, 1, 1), 0.0),  # from a corner inwards
        (((50, 30, 20), (60, 40, 30)), (-1, -1, -1), math.inf),
        (((60, 31, 21), (70, 60, 40)), (10, 1, 1), math.sqrt(102)),
    ],
)
def test_the_free_way_of_a_thin_arm_is_exact(box, heading, free):
    way = np.array(heading) / np.linalg.norm(heading)
    assert room(open_sides=SIDES, boxes=[box], straight=1e-3)._free_along(way, 0.0) == pytest.approx(free)


@pytest.mark.parametrize(
    ("box", "heading", "free"),
    [
        (((60, 0, 0), (70, 60, 40)), (1, 0, 0), 7.0),
        (((60, 33, 0), (70, 60, 40)), (1, 0, 0), math.inf),  # touches with its side
        (((60, 32, 0), (70, 60, 40)), (1, 0, 0), 7.0),
        (((0, 0, 0), (50, 60, 40)), (1, 0, 0), math.inf),  # the wall that the feeder comes through
        (((0, 32, 0), (51, 60, 40)), (1, 0, 0), 0.0),  # a wall beside the mouth
        (((52, 0, 0), (60, 60, 40)), (1, 0, 0), 0.0),
    ],
)
def test_the_free_way_of_a_thick_arm_keeps_its_radius(box, heading, free):
    workspace = room(open_sides=SIDES, boxes=[box], straight=1e-3)
    assert workspace._free_along(np.array(heading), 3.0) == pytest.approx(free)


@pytest.mark.parametrize(("radius", "x"), [(0.0, 0.0), (2.0, 2.0)])
def test_an_arm_may_come_through_a_closed_wall(radius, x):
    workspace = room(base=(x, 30, 20))
    workspace.check_arm(ArmSpec(link_length=10.0, link_radius=radius))
    assert message_of(workspace.check_arm, ArmSpec(link_length=11.0, link_radius=radius)) == (
        "Expected links of at most 10 units in workspace 'empty', as the straight feed allows (10 past the "
        "base, 0 behind it), got 11."
    )


@pytest.mark.parametrize(
    ("changes", "arm", "message"),
    [
        (
            {},
            {"link_length": 200.0},
            "Expected a link_length of at most the size of workspace 'empty' (123.288 units), got 200.",
        ),
        (
            {},
            {"link_length": 61.0},
            "Expected links of at most 60 units in workspace 'empty', as the straight feed allows (10 past "
            "the base, 50 behind it), got 61.",
        ),
        (
            {"boxes": [((20, 20, 10), (30, 40, 30))]},
            {"link_length": 30.5, "link_radius": 2.0},
            "Expected links of at most 28 units in workspace 'empty', as the straight feed allows (10 past "
            "the base, 18 behind it), got 30.5.",
        ),
        (
            {"boxes": [((56, 20, 10), (60, 40, 30))]},
            {"link_length": 5.0},
            "Expected 10 units of straight free way past the base of workspace 'empty' for links of radius "
            "0, got 6.",
        ),
        (
            {"boxes": [((56, 34, 10), (60, 40, 30))]},
            {"link_length": 15.0, "link_radius": 5.0},
            "Expected 10 units of straight free way past the base of workspace 'empty' for links of radius "
            "5, got 1.",
        ),
    ],
)
def test_arms_that_cannot_leave_the_feeder_are_refused(changes, arm, message):
    assert message_of(room(**changes).check_arm, ArmSpec(**arm)) == message


def test_the_longest_link_that_the_straight_feed_allows_is_taken():
    room().check_arm(ArmSpec(link_length=60.0))
    room(boxes=[((60, 0, 0), (70, 60, 40))]).check_arm(ArmSpec(link_length=60.0))
    endless = room(open_sides=("x-",))
    endless.check_arm(ArmSpec(link_length=endless.size))


@given(WAYS, st.floats(1.0, 100.0))
def test_the_feeder_of_long_links_is_drawn_back_along_the_heading(way, length):
    workspace = room(heading=way)
    pose = workspace.base_pose_for(length)
    assert np.linalg.norm(pose[3:]) == pytest.approx(1.0)
    np.testing.assert_allclose(np.cross(pose[3:], way), 0.0, atol=1e-9)
    mouth = pose[:3] + max(length, workspace.straight) * pose[3:]
    np.testing.assert_allclose(mouth, workspace.base + workspace.straight * workspace.heading, atol=1e-9)


# Records and files


@given(panels(), WAYS, st.sets(st.sampled_from(SIDES)))
def test_a_workspace_survives_the_round_trip_through_json(panel, heading, sides):
    workspace = room(
        panels=(panel,),
        heading=heading,
        open_sides=sides,
        base=(50, 30, 35),
        goal=(1 / 3, 59, 39),
        straight=4.0,
    )
    again = Workspace.from_dict(json.loads(json.dumps(workspace.to_dict())))
    assert again.to_dict() == workspace.to_dict()
    np.testing.assert_array_equal(again.heading, workspace.heading)
    np.testing.assert_array_equal(again.obstacles, workspace.obstacles)


@pytest.mark.parametrize("make", [*ROOMS.values(), lambda: random_room(3), lambda: Workspace.from_dict(DATA)])
def test_a_workspace_survives_the_round_trip_through_a_file(make, tmp_path):
    workspace, path = make(), tmp_path / "w.json"
    workspace.save(path)
    again = load_workspace(path)
    assert again.to_dict() == workspace.to_dict()
    np.testing.assert_array_equal(again.obstacles, workspace.obstacles)
    assert list(tmp_path.iterdir()) == [path]


def test_name_units_panels_and_boxes_may_be_left_out(tmp_path):
    data = {key: value for key, value in DATA.items() if key not in ("name", "units", "panels", "boxes")}
    del data["room"]["open"]
    (tmp_path / "bare.json").write_text(json.dumps(data))
    workspace = Workspace.load(tmp_path / "bare.json")
    assert repr(workspace) == "Workspace('bare', 0 panels, 0 boxes)"
    assert (workspace.units, workspace.open_sides, len(workspace.obstacles)) == ("units", (), 6)


def test_a_workspace_says_what_is_in_it():
    assert repr(Workspace.from_dict(DATA)) == "Workspace('two rooms', 1 panels, 1 boxes)"


@pytest.mark.parametrize(
    "key", ["room_low", "room_high", "base", "heading", "goal", "boxes", "obstacles", "panels"]
)
def test_arrays_of_a_workspace_cannot_be_written(key):
    value = getattr(Workspace.from_dict(DATA), key)
    for array in (value,) if key != "panels" else (value[0].low, value[0].window_high):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_arrays_that_come_in_are_not_kept():
    boxes, base = np.array([[[80.0, 10, 10], [90, 20, 20]]]), np.array([50.0, 30, 20])
    workspace = room(boxes=boxes, base=base)
    boxes[:], base[:] = 0.0, 0.0
    assert workspace.boxes[0, 0, 0] == 80.0 and workspace.base[0] == 50.0


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1.0, 1e200, 4e307])
def test_a_heading_may_have_any_length(size):
    np.testing.assert_allclose(room(heading=(3 * size, 0, 4 * size)).heading, [0.6, 0, 0.8], rtol=1e-15)


ROOM = "the room, from (0, 0, 0) to (100, 60, 40)"
INSIDE_OUT = "with a low corner below its high corner along every axis, got"
TWICE = "it is inside out or has no thickness"


@pytest.mark.parametrize(
    ("data", "message"),
    [
        # What it is
        ([], 'Expected a workspace with "type": "hrsnake workspace", got a list.'),
        (None, 'Expected a workspace with "type": "hrsnake workspace", got nothing.'),
        (3, 'Expected a workspace with "type": "hrsnake workspace", got 3.'),
        ({}, 'Expected a workspace with "type": "hrsnake workspace", got an object without a type.'),
        (
            changed("type", "FeatureCollection"),
            'Expected a workspace with "type": "hrsnake workspace", got an object of type '
            "'FeatureCollection'.",
        ),
        # Keys
        (changed("goal", ...), "Expected a workspace with 'goal', but it has none."),
        (changed("base.heading", ...), "Expected the base with 'heading', but it has none."),
        (changed("goal.radius", ...), "Expected the goal with 'radius', but it has none."),
        (changed("boxes.0.high", ...), "Expected box 0 with 'high', but it has none."),
        (
            changed("walls", []),
            "Unknown key 'walls' of a workspace. Available: type, name, units, room, panels, boxes, base, "
            "goal.",
        ),
        (
            changed("panels.0.door", []),
            "Unknown key 'door' of panel 0. Available: low, high, normal, window.",
        ),
        (changed("room", [0, 1]), "Expected the room as an object with low, high, got a list."),
        (changed("boxes", {}), "Expected boxes as a list, got an object without a type."),
        (changed("boxes.0", "box"), "Expected box 0 as an object with low, high, got a text."),
        (changed("room.open", "x-"), "Expected the open sides of the room as a list, got a text."),
        (
            changed("room.open", ["x-", "left"]),
            "Unknown side of a room 'left'. Available: x-, x+, y-, y+, z-, z+.",
        ),
        (changed("room.open", [["x-"]]), "Unknown side of a room ['x-']. Available: x-, x+, y-, y+, z-, z+."),
        (changed("name", 5), "Expected the name of a workspace as a text, got 5."),
        (changed("units", None), "Expected the units of a workspace as a text, got nothing."),
        # Numbers
        (
            changed("base.position", [0, 30]),
            "Expected the base as three finite numbers (x, y, z), got [0, 30].",
        ),
        (
            changed("base.position", [0, 30, math.nan]),
            "Expected the base as three finite numbers (x, y, z), got [0, 30, nan].",
        ),
        (
            changed("base.position", [0, 30, True]),
            "Expected the base as three finite numbers (x, y, z), got [0, 30, True].",
        ),
        (
            changed("goal.position", ["1", "2", "3"]),
            "Expected the goal as three finite numbers (x, y, z), got ['1', '2', '3'].",
        ),
        (
            changed("base.heading", "north"),
            "Expected the heading as three finite numbers (x, y, z), got 'north'.",
        ),
        (
            changed("room.high", [1, [2], 3]),
            "Expected a corner of a room as three finite numbers (x, y, z), got [1, [2], 3].",
        ),
        (
            changed("boxes.0.low", [0, 0, math.inf]),
            "Expected the low corner of box 0 as three finite numbers (x, y, z), got [0, 0, inf].",
        ),
        (
            changed("panels.0.window.high", 7),
            "Expected the high corner of the window of panel 0 as three finite numbers (x, y, z), got 7.",
        ),
        (changed("base.heading", [0, 0, 0]), "Expected a heading of some length, got (0, 0, 0)."),
        (changed("base.straight", "15"), "Expected straight to be positive and finite, got '15'."),
        (changed("base.straight", 0), "Expected straight to be positive and finite, got 0."),
        (changed("goal.radius", math.nan), "Expected goal_radius to be positive and finite, got nan."),
        (changed("goal.radius", True), "Expected goal_radius to be positive and finite, got True."),
        # Boxes
        (
            changed("room.high", [100, 60, 0]),
            f"Expected a room {INSIDE_OUT} (0, 0, 0) and (100, 60, 0): {TWICE}.",
        ),
        (
            changed("boxes.0.high", [70, 20, 20]),
            f"Expected box 0 {INSIDE_OUT} (80, 10, 10) and (70, 20, 20): {TWICE}.",
        ),
        (
            changed("panels.0.high", [50, 60, 40]),
            f"Expected a panel {INSIDE_OUT} (50, 0, 0) and (50, 60, 40): {TWICE} (panel 0).",
        ),
        (
            changed("panels.0.window.high", [60, 20, 40]),
            f"Expected the window of a panel {INSIDE_OUT} (50, 20, 10) and (60, 20, 40): {TWICE} (panel 0).",
        ),
        (
            changed("panels.0.window.high", [60, 61, 40]),
            "Expected the window of a panel inside it, from (50, 0, 0) to (60, 60, 40), got one from "
            "(50, 20, 10) to (60, 61, 40) (panel 0).",
        ),
        (
            changed("panels.0.normal", "w"),
            "Expected the normal of a panel to be x, y or z, got 'w' (panel 0).",
        ),
        (changed("panels.0.normal", 0), "Expected the normal of a panel to be x, y or z, got 0 (panel 0)."),
        # Places
        (changed("base.position", [-1, 30, 20]), f"Expected a base in {ROOM}, got (-1, 30, 20)."),
        (changed("goal.position", [70, 60, 20]), f"Expected a goal inside {ROOM}, got (70, 60, 20)."),
        (changed("goal.position", [0, 40, 20]), f"Expected a goal inside {ROOM}, got (0, 40, 20)."),
        (
            changed("goal.position", [55, 45, 20]),
            "Expected a goal in the free space, got (55, 45, 20), which is in the obstacle from (50, 40, 0) "
            "to (60, 60, 40).",
        ),
        (
            changed("goal.position", [80, 15, 15]),
            "Expected a goal in the free space, got (80, 15, 15), which is in the obstacle from (80, 10, 10) "
            "to (90, 20, 20).",
        ),
        (
            changed("base.position", [52, 30, 5]),
            "Expected a base in the free space, got (52, 30, 5), which is in the obstacle from (50, 0, 0) to "
            "(60, 60, 10).",
        ),
        (
            changed("base.straight", 100),
            "Expected a straight stretch of 100 from the base (0, 30, 20) that ends inside "
            f"{ROOM}, got its end at (100, 30, 20).",
        ),
        (
            changed("base.heading", [-1, 0, 0]),
            "Expected a straight stretch of 15 from the base (0, 30, 20) that ends inside "
            f"{ROOM}, got its end at (-15, 30, 20).",
        ),
        (
            changed("goal.position", [10, 30, 20]),
            "Expected a goal off the straight stretch of 15 from the base, got (10, 30, 20) with a radius of "
            "2: the arm meets it before it bends.",
        ),
        (
            changed("goal.position", [10, 31, 20]),
            "Expected a goal off the straight stretch of 15 from the base, got (10, 31, 20) with a radius of "
            "2: the arm meets it before it bends.",
        ),
    ],
)
def test_what_is_no_workspace_is_refused(data, message):
    assert message_of(Workspace.from_dict, data) == message


@pytest.mark.parametrize(
    "entry", ["base.position", "goal.radius", "base.straight", "boxes.0.low", "base.heading"]
)
def test_numbers_beyond_a_float_are_refused(entry):
    huge = 10**400 if entry.endswith(("radius", "straight")) else [0, 0, 10**400]
    assert message_of(Workspace.from_dict, changed(entry, huge)).startswith("Expected")


@pytest.mark.parametrize(
    ("boxes", "message"),
    [
        (np.zeros((2, 3)), "Expected boxes with shape (n_boxes, 2, 3), got (2, 3)."),
        (np.zeros((0, 5)), "Expected boxes with shape (n_boxes, 2, 3), got (0, 5)."),
        ("none", "Expected boxes in numbers, got 'none'."),
        (
            [[[1, 2, 3], [4, 5, "6"]]],
            "Expected a corner of box 0 as three finite numbers (x, y, z), got [4, 5, '6'].",
        ),
        (
            np.full((1, 2, 3), np.nan),
            "Expected a corner of box 0 as three finite numbers (x, y, z), got array([nan, nan, nan]).",
        ),
    ],
)
def test_wrong_arrays_of_boxes_are_refused(boxes, message):
    assert message_of(lambda: room(boxes=boxes)) == message


def test_a_base_on_the_wall_of_a_closed_side_is_taken_and_one_in_a_box_there_is_not():
    room(base=(0, 30, 20))
    assert message_of(lambda: room(base=(0, 30, 20), boxes=[((0, 0, 0), (5, 60, 40))])) == (
        "Expected a base in the free space, got (0, 30, 20), which is in the obstacle from (0, 0, 0) to "
        "(5, 60, 40)."
    )


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (lambda path: None, "Expected a workspace file at '{}', but there is none."),
        (
            lambda path: path.mkdir(),
            "Expected JSON in '{}', got a folder or a device.",
        ),
        (
            lambda path: path.write_bytes(b"\xff\xfe"),
            "Expected JSON in '{}', got a file that is not: it is no text (UTF-8).",
        ),
        (
            lambda path: path.write_text("{"),
            "Expected JSON in '{}', got a file that is not: Expecting property name enclosed in double "
            "quotes: line 1 column 2 (char 1).",
        ),
        (
            lambda path: path.write_text(""),
            "Expected JSON in '{}', got a file that is not: Expecting value: line 1 column 1 (char 0).",
        ),
    ],
)
def test_files_that_are_no_workspaces_are_refused(write, message, tmp_path):
    path = tmp_path / "w.json"
    write(path)
    assert message_of(Workspace.load, path) == message.format(path)


@pytest.mark.parametrize("text", ["[" * 200_000, "9" * 10_000])
def test_json_that_python_gives_up_on_is_refused(text, tmp_path):
    (tmp_path / "w.json").write_text(text)
    assert message_of(Workspace.load, tmp_path / "w.json").startswith("Expected ")


# Named rooms


def test_the_paired_panels_are_those_of_the_notes():
    workspace = paired_panels()
    assert (len(workspace.panels), len(workspace.walls), len(workspace.obstacles)) == (7, 27, 32)
    for length in (8.0, 30.0, 90.0, 300.0):
        workspace.check_arm(ArmSpec(link_length=length))


@pytest.mark.parametrize("seed", range(5))
def test_random_rooms_are_the_same_for_the_same_seed_and_let_the_arm_in(seed):
    workspace = random_room(seed)
    assert workspace.to_dict() == load_workspace(f"random-{seed}").to_dict()
    assert workspace.to_dict() != random_room(seed + 1).to_dict()
    assert len(workspace.walls) == 60
    workspace.check_arm(ArmSpec(link_length=60.0, link_radius=25.0))


def test_unknown_rooms_are_refused():
    assert message_of(load_workspace, "paired") == (
        "Unknown workspace 'paired'. Available: paired-panels, random-SEED; or give the path of a .json file."
    )
    assert message_of(load_workspace, "random-x").startswith("Unknown workspace 'random-x'.")
