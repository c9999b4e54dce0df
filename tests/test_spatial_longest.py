"""The longest link in space: every length that counts has a valid motion, and the record is honest."""

import json
import math

import pytest

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from planners import PlanningStatus
from planners.spatial import longest
from planners.spatial.longest import longest_link
from planners.spatial.panel import Panel
from planners.spatial.planning import plan
from planners.spatial.validation import validate
from planners.spatial.workspace import SIDES, Workspace


def room(**changes):
    """Return a room where the arm turns twice between two panels."""
    panels = tuple(
        Panel(
            low=[x, 0.0, 0.0],
            high=[x + 10.0, 150.0, 120.0],
            normal="x",
            window_low=[x, y, z],
            window_high=[x + 10.0, y + 20.0, z + 20.0],
        )
        for x, y, z in ((90.0, 10.0, 10.0), (115.0, 110.0, 90.0))
    )
    values = {"name": "room", "room_low": [0.0] * 3, "room_high": [200.0, 150.0, 120.0], "panels": panels}
    values |= {"open_sides": ("x-",), "base": [0.0, 70.0, 60.0], "heading": [1.0, 0.0, 0.0], "straight": 20.0}
    return Workspace(**(values | {"goal": [180.0, 80.0, 50.0], "goal_radius": 5.0} | changes))


@pytest.fixture
def quick(monkeypatch):
    """Scan in few and large steps, to the first length without a plan."""
    monkeypatch.setattr(longest, "SHORTEST", 0.05)
    monkeypatch.setattr(longest, "STEP", 1.3)
    monkeypatch.setattr(longest, "BEYOND", 1)


@pytest.fixture
def asked(monkeypatch):
    """Record the lengths that are planned."""
    lengths = []

    def recorded(workspace, arm, *arguments, **settings):
        lengths.append(arm.link_length)
        return plan(workspace, arm, *arguments, **settings)

    monkeypatch.setattr(longest, "plan", recorded)
    return lengths


@pytest.mark.parametrize("planner", ["follow", "track"])
def test_the_longest_link_has_a_valid_motion_and_nothing_much_longer_was_found(planner, quick):
    workspace = room()
    answer = longest_link(workspace, planner, accuracy=0.1)
    assert answer.complete
    assert answer.motion is answer.result.motion and answer.motion.link_length == answer.length
    assert validate(answer.motion, workspace, ArmSpec(link_length=answer.length)).valid
    lengths = [trial.link_length for trial in answer.trials]
    assert lengths == sorted(lengths) and len(set(lengths)) == len(lengths)
    found = [trial for trial in answer.trials if trial.status is PlanningStatus.SOLVED]
    assert found[-1].link_length == answer.length
    beyond = [trial.link_length for trial in answer.trials if trial.link_length > answer.length]
    assert beyond and beyond[0] <= answer.length * 1.1 * (1.0 + 1e-9)
    for trial in answer.trials:
        assert (trial.n_links is not None) == (trial.clearance is not None)
        assert (trial.n_links is not None) == (trial.status is PlanningStatus.SOLVED)
        assert trial.seconds > 0.0
    assert all(trial.clearance >= 0.0 and trial.n_links >= 2 for trial in found)
    links = [trial.n_links for trial in found]
    assert links == sorted(links, reverse=True)


def test_shaping_the_track_allows_twice_the_link_that_follows():
    # Lengths that are far on either side of both limits.
    workspace = room()
    for planner, length, status in (
        ("follow", 20.0, PlanningStatus.SOLVED),
        ("follow", 30.0, PlanningStatus.NOT_VALID),
        ("track", 55.0, PlanningStatus.SOLVED),
    ):
        assert plan(workspace, ArmSpec(link_length=length), planner).status is status


def test_radius_and_joint_limit_are_those_of_the_arm(quick):
    limit = math.radians(60.0)
    answer = longest_link(room(), link_radius=3.0, joint_limit=limit, accuracy=0.3)
    arm = ArmSpec(link_length=answer.length, link_radius=3.0, joint_limit=limit)
    assert answer.length > 0.0 and validate(answer.motion, room(), arm).valid


def test_the_outcome_is_plain_data(quick):
    answer = longest_link(room(), "follow", accuracy=0.2)
    data = json.loads(json.dumps(answer.to_dict()))
    assert data["length"] == answer.length and data["n_links"] == answer.motion.n_links and data["complete"]
    assert [trial["status"] for trial in data["trials"]] == [str(trial.status) for trial in answer.trials]


def test_without_a_way_one_length_is_asked_for(asked):
    answer = longest_link(room(panels=(), boxes=[[[90.0, 0.0, 0.0], [100.0, 150.0, 120.0]]]))
    assert answer.length == 0.0 and answer.result is None and answer.motion is None and answer.complete
    assert len(asked) == len(answer.trials) == 1
    assert answer.trials[0].status is PlanningStatus.NO_PATH
    assert answer.to_dict()["n_links"] is None


def test_no_length_beyond_the_room_or_the_feeder_is_asked_for(asked, quick):
    empty = room(panels=(), open_sides=SIDES)
    answer = longest_link(empty, accuracy=0.1)
    assert max(asked) <= empty.size and answer.length > 0.9 * empty.size
    inside = room(panels=(), open_sides=(), base=[30.0, 70.0, 60.0])
    asked.clear()
    answer = longest_link(inside, accuracy=0.1)  # at most 20 in front of the base and 30 behind it
    assert max(asked) <= 50.0 and 45.0 < answer.length <= 50.0


@pytest.mark.parametrize("n_plans", [0, 3])
def test_an_interrupted_search_gives_what_was_found_so_far(n_plans, monkeypatch):
    lengths = []

    def interrupted(workspace, arm, *arguments, **settings):
        if len(lengths) == n_plans:
            raise KeyboardInterrupt
        lengths.append(arm.link_length)
        return plan(workspace, arm, *arguments, **settings)

    monkeypatch.setattr(longest, "plan", interrupted)
    monkeypatch.setattr(longest, "SHORTEST", 0.06)
    answer = longest_link(room(), "follow")
    assert not answer.complete and len(answer.trials) == n_plans
    assert answer.length == max(lengths, default=0.0)
    assert (answer.motion is None) == (n_plans == 0)


def test_progress_names_the_length(quick):
    told = []
    longest_link(room(), "follow", accuracy=0.2, progress=lambda stage, share: told.append((stage, share)))
    assert all(stage.endswith(" units") and 0.0 <= share <= 1.0 for stage, share in told) and told


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"planner": "magic"}, r"Unknown planner 'magic'\. Available: auto, track, causal, follow\."),
        ({"accuracy": 0.0}, r"Expected accuracy to be a finite number of at least 1e-06, got 0\.0\."),
        ({"accuracy": math.nan}, r"Expected accuracy .*, got nan\."),
        ({"link_radius": -1.0}, r"Expected link_radius to be a finite number of at least 0, got -1\.0\."),
        ({"link_radius": "thick"}, r"Expected link_radius .*, got 'thick'\."),
        ({"joint_limit": 0.0}, r"Expected joint_limit .*"),
        ({"time_budget": 0.0}, r"Expected a positive time_budget in seconds, got 0\.0\."),
        ({"time_budget": None}, r"Expected a positive time_budget in seconds, got None\."),
        ({"link_radius": 55.0}, r"Expected 20 units of straight free way .* links of radius 55, got 0\."),
    ],
)
def test_wrong_arguments_are_named_before_anything_is_planned(arguments, message, asked):
    narrow = room(boxes=[[[5.0, 0.0, 0.0], [15.0, 40.0, 120.0]]])
    with pytest.raises(InputError, match=message):
        longest_link(narrow, **arguments)
    assert asked == []
