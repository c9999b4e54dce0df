"""The benchmark of the spatial planners at its smallest, and the laws that its figures and rooms keep."""

import dataclasses
import json
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners.bench import spatial, spatial_trials
from planners.bench.records import write_results
from planners.bench.spatial import PARTS, QUICK, compared, rooms_with_a_way, run_spatial
from planners.bench.spatial_growth import STAGES, time_stages
from planners.bench.spatial_tables import spatial_markdown
from planners.bench.spatial_trials import try_arm, try_links
from planners.spatial import longest
from planners.spatial.path import global_path
from planners.spatial.planning import plan
from planners.spatial.potential import laplace_potential
from planners.spatial.rooms import ROOM, paired_panels, panels_in_a_row, random_room
from planners.spatial.workspace import Workspace

TINY = dataclasses.replace(
    QUICK,
    planners=("follow", "track"),
    accuracy=0.5,
    rooms=1,
    lengths=(90.0, 45.0),
    copies=(1, 2),
    radii=(0.3,),
    limits=(120.0,),
    panels=((60.0, 60.0, 20.0),),
)
ROW = panels_in_a_row(2)

TOLD = {}
"""How much work each part announced, and how much it told of."""


@contextmanager
def counting_bar(name, total, quiet):
    TOLD[name] = [total, 0]

    def tell():
        TOLD[name][1] += 1

    yield tell


@pytest.fixture(scope="module")
def results():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spatial, "bar", counting_bar)
        patch.setattr(spatial, "PAPER_LENGTHS", (30.0, 90.0))
        patch.setattr(spatial_trials, "HORIZON_LENGTHS", (50.0, 70.0, 130.0))
        patch.setattr(longest, "SHORTEST", 0.05)
        patch.setattr(longest, "STEP", 1.8)
        patch.setattr(longest, "BEYOND", 1)
        return run_spatial(TINY, workers=0, quiet=True)


# The run and its tables


def test_every_part_is_measured_and_named_in_the_tables(results):
    assert set(PARTS) < set(results)
    text = spatial_markdown(json.loads(json.dumps(results)))
    assert all(f"**{part}**" in text for part in PARTS)


def test_results_are_plain_data_and_written_whole(results, tmp_path):
    write_results(results, tmp_path / "spatial.json")
    assert json.loads((tmp_path / "spatial.json").read_text()) == results


def test_a_bar_ends_where_the_work_does(results):
    assert set(TOLD) == set(PARTS)
    assert all(told == total for total, told in TOLD.values()), TOLD


def test_a_part_that_is_not_there_is_named():
    with pytest.raises(InputError, match=r"Unknown part 'colour'\. Available: figures, growth"):
        run_spatial(TINY, parts=("colour",))


def test_tables_have_as_many_cells_in_each_row_as_in_their_head(results):
    width = 0
    for line in spatial_markdown(results).splitlines():
        if not line.startswith("|"):
            width = 0
            continue
        width = width or line.count("|")
        assert line.count("|") == width, line


def test_what_no_planner_has_found_leaves_no_gap_in_the_tables(results):
    bare = json.loads(json.dumps(results))
    for row in bare["rooms"]["rows"]:
        row.update(length=0.0, n_links=None, clearance=None, valid=False)
    bare["rooms"]["compared"] = [compared(bare["rooms"]["rows"], "track")]
    bare["growth"]["way"]["fits"] = {}
    text = spatial_markdown(bare)
    assert "`track` and `follow` have no room in common." in text
    assert "none" in text and "None" not in text


# Figures


def test_the_papers_links_follow_or_collide_as_in_its_figures(results):
    rows = {(row["planner"], row["link_length"]): row for row in results["figures"] if not row["longest"]}
    row = rows["follow", 30.0]
    assert row["status"] == "solved" and row["depth"] == row["between"] == 0.0
    assert row["n_colliding"] == 0 and row["clearance"] > 10.0
    row = rows["follow", 90.0]
    assert row["status"] == "not valid" and row["n_colliding"] > 0
    assert row["depth"] == pytest.approx(-row["clearance"]) and row["depth"] > 20.0
    row = rows["track", 90.0]
    assert (row["status"], row["n_links"], row["n_colliding"]) == ("solved", 15, 0)
    assert row["depth"] == row["between"] == 0.0


def test_longer_links_are_farther_from_the_path(results):
    errors = [
        (row["link_length"], row["link_to_path"], row["path_to_link"])
        for row in results["figures"]
        if row["planner"] == "follow"
    ]
    errors = np.array(sorted(set(errors)))
    assert (np.diff(errors, axis=0) > 0.0).all()


def test_the_longest_links_are_solved_and_longer_when_tracked(results):
    found = {row["planner"]: row for row in results["figures"] if row["longest"]}
    assert {row["status"] for row in found.values()} == {"solved"}
    assert found["track"]["link_length"] > found["follow"]["link_length"]


def test_times_of_stages_are_no_more_than_the_whole():
    row = try_links(ROW, "track", 90.0, runs=1)
    stages = sum(value for stage, value in row["median_s"].items() if stage != "whole")
    assert 0.0 < stages <= row["median_s"]["whole"]
    assert row["pose_s"] > 0.0 and not row["jumps"]
    assert ROW.straight < row["track_length"] < 1.5 * row["path_length"]


def test_a_plan_that_is_not_found_has_no_figures():
    shut = np.array([[[300.0, 0.0, 0.0], [310.0, 300.0, 300.0]]])
    workspace = Workspace(**{**_settings(ROW), "boxes": shut})
    row = try_links(workspace, "track", 90.0, runs=1)
    assert row["status"] == "no path"
    known = {"planner", "link_length", "status", "runs", "median_s"}
    assert {key for key, value in row.items() if value is not None} == known


def _settings(workspace):
    return {one.name: getattr(workspace, one.name) for one in dataclasses.fields(workspace) if one.init}


# Random rooms


def test_ratios_count_rooms_where_both_have_a_motion_and_the_others_are_named():
    def row(room, planner, length, n_links, valid=True):
        return {"room": room, "planner": planner, "length": length, "n_links": n_links, "valid": valid}

    rows = [
        row("a", "follow", 50.0, 20), row("a", "track", 100.0, 10),
        row("b", "follow", 40.0, 20), row("b", "track", 40.0, 20),
        row("c", "follow", 0.0, None, valid=False), row("c", "track", 90.0, 9),
        row("d", "follow", 60.0, 20), row("d", "track", 90.0, 9, valid=False),
        row("e", "follow", 0.0, None, valid=False), row("e", "track", 0.0, None, valid=False),
    ]  # fmt: skip
    assert compared(rows, "track") == {
        "planner": "track",
        "rooms": 5,
        "compared": 2,
        "alone": 1,
        "followed_alone": 1,
        "longer": 1,
        "mean": 1.5,
        "median": 1.5,
        "least": 1.0,
        "largest": 2.0,
        "mean_links": 0.75,
    }


def test_seeds_are_the_first_with_a_way_and_the_others_are_told():
    found, without = rooms_with_a_way(3)
    assert len(found) == 3 and sorted(found + without) == list(range(max(found) + 1))
    assert all(laplace_potential(random_room(seed)) is not None for seed in found)
    assert all(laplace_potential(random_room(seed)) is None for seed in without)


def test_every_longest_link_that_counts_has_passed_the_checker_twice(results):
    for row in [*results["rooms"]["rows"], *results["workspaces"]]:
        assert row["valid"] == (row["length"] > 0.0)
        if row["valid"]:
            assert row["clearance"] >= 0.0 and row["n_links"] > 1


@given(st.integers(0, 10_000), st.floats(0.0, 1.0))
def test_the_goal_of_a_random_room_is_out_of_sight(seed, share):
    room = random_room(seed)
    start = room.base + share * room.straight * room.heading
    # The rule looks every five units: here the boxes may be a little larger.
    boxes = room.boxes + np.array([-5.0, 5.0])[:, None]
    places = start + np.linspace(0.0, 1.0, 400)[:, None] * (room.goal - start)
    within = (places[:, None] >= boxes[:, 0]) & (places[:, None] <= boxes[:, 1])
    assert within.all(axis=2).any()


@pytest.mark.parametrize("n_boxes", [0, 1, 3])
def test_a_room_with_too_few_boxes_to_hide_the_goal_is_made_all_the_same(n_boxes):
    assert len(random_room(1, n_boxes=n_boxes).boxes) == n_boxes


# Growth


def test_exponents_are_those_of_the_median_times(results):
    for growth in results["growth"].values():
        first, last = growth["rows"][0], growth["rows"][-1]
        sizes = np.log(last[growth["over"]] / first[growth["over"]])
        for stage in STAGES:
            grown = np.log(last["median_s"][stage] / first["median_s"][stage])
            assert growth["fits"][stage]["exponent"] == pytest.approx(grown / sizes, abs=1e-6)


def test_stages_add_up_to_the_plan_and_the_check():
    row, seconds = time_stages(ROW, 90.0)
    assert row["solved"] and row["attempts"] == 1
    assert set(seconds) == set(STAGES) and min(seconds.values()) >= 0.0
    assert seconds["plan"] == pytest.approx(seconds["path"] + seconds["track"] + seconds["poses"])
    assert seconds["whole"] == pytest.approx(seconds["plan"] + seconds["check"])


def test_what_is_timed_is_what_is_planned():
    row, _ = time_stages(ROW, 90.0)
    motion = plan(ROW, ArmSpec(link_length=90.0)).motion
    assert (row["n_links"], row["n_poses"]) == (motion.n_links, motion.n_poses)


# Workspaces that the benchmark makes


@pytest.mark.parametrize("n_panels", [1, 2, 5])
def test_the_way_through_a_row_grows_with_its_panels(n_panels):
    room = panels_in_a_row(n_panels)
    path = global_path(room, laplace_potential(room))
    assert 150.0 * n_panels < path.length < 250.0 * (n_panels + 1)
    assert len(room.obstacles) == 4 * n_panels + 5


@given(
    st.sampled_from([40.0, 50.0, 60.0, 80.0]),
    st.sampled_from([40.0, 60.0, 80.0]),
    st.sampled_from([1.0, 5.0, 20.0]),
)
def test_panels_of_a_pair_are_as_far_apart_and_windows_as_wide_as_asked_for(gap, window, thickness):
    room = paired_panels(gap=gap, window=window, thickness=thickness)
    for panel in room.panels:
        axis = "xyz".index(panel.normal)
        assert (panel.high - panel.low)[axis] == pytest.approx(thickness)
        assert np.delete(panel.window_high - panel.window_low, axis) == pytest.approx(window)
    for (one, other), axis in (((0, 1), 0), ((2, 3), 2), ((6, 5), 1)):
        between = room.panels[other].low[axis] - room.panels[one].high[axis]
        assert between == pytest.approx(gap)


def test_panels_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="window of a panel"):
        paired_panels(window=300.0)
    with pytest.raises(InputError, match="low corner below its high corner"):
        paired_panels(thickness=-1.0)


def test_all_rooms_of_a_kind_are_of_the_same_size():
    assert all((room.room_high == ROOM).all() for room in (paired_panels(), random_room(0)))


# Thick arms


def test_a_radius_and_a_joint_limit_are_honoured(results):
    thick, limited = results["radius"]
    assert (thick["status"], thick["valid"], thick["radius"]) == ("solved", True, 0.3)
    assert thick["clearance"] >= 0.0
    assert (limited["status"], limited["valid"]) == ("solved", True)
    assert limited["largest_angle"] <= limited["joint_limit"]


def test_an_arm_that_is_too_thick_for_the_windows_has_no_figures():
    row = try_arm(paired_panels(), ArmSpec(link_length=90.0, link_radius=28.0))
    assert row["status"] != "solved" and not row["valid"]
    assert row["n_links"] is row["clearance"] is row["largest_angle"] is None
