"""The longest link: within the bound, near the closed form, resumable, honest about what was not tried."""

import dataclasses
import json
import math

import numpy as np
import pytest

import planners.longest as longest
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import Motion, PlanningResult, PlanningStatus, longest_link, plan, validate
from planners.length_trials import LengthTrial
from planners.longest_chart import draw_longest
from planners.problem import Attempt

LIMIT = 200.0 * 2.0 * math.sqrt(2.0)
"""The longest rod round a right-angled bend of width 200: twice the diagonal of the corner's square."""


def bend(name="bend"):
    return Maze.from_corridors([(0, 0), (0, 1500), (1500, 1500)], 200.0, name=name)


@pytest.fixture
def asked(monkeypatch):
    """Record the lengths that planners are asked for, in mazes other than the one that compiles."""
    lengths = []

    def recorded(maze, arm, *arguments, **settings):
        lengths.append(arm.link_length)
        return plan(maze, arm, *arguments, **settings)

    monkeypatch.setattr(longest, "plan", recorded)
    monkeypatch.setattr(longest, "_compile", lambda planner: None)
    return lengths


@pytest.fixture(scope="module")
def answer():
    return longest_link(bend(), "sweep", accuracy=0.01, lengths=(200.0, 900.0))


def test_the_longest_link_is_within_the_bound_and_near_the_closed_form(answer):
    assert answer.bound.lower <= LIMIT <= answer.bound.upper
    assert 0.98 * LIMIT <= answer.length <= answer.bound.upper
    assert answer.index == answer.length / answer.bound.upper <= answer.length / LIMIT
    assert answer.index - 1e-4 <= float(answer.index_text) <= answer.index + 1e-9
    assert answer.complete and answer.untried == () and answer.note == ""
    assert answer.motion.link_length == answer.length
    assert validate(answer.motion, bend(), ArmSpec(link_length=answer.length)).valid


def test_every_step_of_the_grid_above_the_longest_link_has_failed(answer):
    upper, known = answer.bound.upper, {trial.link_length: trial for trial in answer.trials}
    steps = [upper * 0.99**k for k in range(100)]
    above = [step for step in steps if step > answer.length]
    assert above and all(not known[step].passes for step in above)
    failed = [trial.link_length for trial in answer.failed]
    assert {*above, 900.0} <= set(failed)
    assert min(failed) - answer.length <= 0.25 * 0.01 * answer.length  # closer than a step


def test_the_table_has_the_ladder_the_lengths_asked_for_and_the_longest(answer):
    lengths = [trial.link_length for trial in answer.table]
    assert lengths == sorted(lengths) and {200.0, 900.0, answer.length} <= set(lengths)
    assert lengths[0] <= 0.26 * answer.bound.upper
    passing = [trial for trial in answer.table if trial.passes]
    assert answer.fewest in answer.table
    links = [trial.n_links for trial in passing]
    assert answer.fewest.n_links == min(links)
    assert links == sorted(links, reverse=True) and links[0] > links[-1]
    assert [trial.n_actuators for trial in passing] == [n + 1 for n in links]
    assert all(0.0 < trial.joint_range < math.pi for trial in passing)
    assert all(trial.turning >= trial.joint_range for trial in passing)
    # A link turned by an angle moves one end by half of it; a joint angle belongs to two links.
    assert all(0.0 < trial.joint_speed * trial.link_length <= 4.0 + 1e-9 for trial in passing)


def test_a_length_beyond_the_bound_is_never_planned(asked):
    answer = longest_link(bend(), "sweep", accuracy=0.2, lengths=(900.0,))
    assert max(asked) <= answer.bound.upper
    (beyond,) = [trial for trial in answer.table if trial.link_length == 900.0]
    assert beyond.status is PlanningStatus.IMPOSSIBLE and beyond.reason.startswith("No rod longer than")


def test_joint_speed_is_that_of_the_joint_that_travels_farthest():
    # One link, pushed out by 2 of 4 and then turned by 0.1 rad about its base-side joint.
    turned = Motion.from_configurations([4.0, 6.0, 6.0], [[0, 0], [0, 0], [0, 0.1]], 4.0, (0, 0, 0))
    result = longest.plan(bend(), ArmSpec(link_length=300.0))
    trial = LengthTrial.from_result(4.0, dataclasses.replace(result, motion=turned), 0.0, 1.0)
    assert trial.joint_speed == pytest.approx(0.1 / (8.0 * math.sin(0.05)))
    assert (trial.joint_range, trial.turning, trial.n_actuators) == (0.1, 0.1, 3)


def test_an_interrupted_search_gives_the_best_so_far_and_goes_on_where_it_was(tmp_path, monkeypatch, asked):
    state, counted = tmp_path / "state.json", longest.plan

    def interrupted(*arguments, **settings):
        if len(asked) == 4:
            raise KeyboardInterrupt
        return counted(*arguments, **settings)

    monkeypatch.setattr(longest, "plan", interrupted)
    first = longest_link(bend(), "sweep", accuracy=0.02, state=state)
    assert not first.complete and first.untried and len(first.trials) == 4
    assert first.motion.link_length == first.length > 0.0
    done = list(asked)
    monkeypatch.setattr(longest, "plan", counted)
    monkeypatch.setattr(longest, "rod_bound", None)  # it is in the state
    second = longest_link(bend("another name"), "sweep", accuracy=0.02, state=state)
    assert second.complete and second.length >= first.length and second.note == ""
    assert not set(done) & set(asked[4:]) and len(set(asked)) == len(asked)
    assert second.bound.path.length == second.bound.lower
    asked.clear()
    third = longest_link(bend(), "sweep", accuracy=0.02, state=state)
    assert asked == [] and third.to_dict() == second.to_dict()
    assert np.array_equal(third.motion.joints, second.motion.joints)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["state.best.npz", "state.json"]


def test_a_state_of_another_maze_or_of_other_options_is_not_used(tmp_path, asked):
    state = tmp_path / "state.json"
    longest_link(bend(), "sweep", accuracy=0.2, state=state)
    n_first = len(asked)
    narrower = Maze.from_corridors([(0, 0), (0, 1500), (1500, 1500)], 190.0)
    answer = longest_link(narrower, "sweep", accuracy=0.2, state=state)
    assert "starts anew" in answer.note and len(asked) > n_first
    assert answer.length < answer.bound.upper < 0.99 * LIMIT
    assert "starts anew" in longest_link(narrower, "sweep", accuracy=0.2, joint_limit=2.0, state=state).note


def test_a_state_without_its_motion_or_with_one_that_is_not_valid_asks_again(tmp_path, asked):
    state = tmp_path / "state.json"
    first = longest_link(bend(), "sweep", accuracy=0.2, state=state)
    (tmp_path / "state.best.npz").unlink()
    asked.clear()
    assert longest_link(bend(), "sweep", accuracy=0.2, state=state).length == first.length in asked
    moved = dataclasses.replace(first.motion, joints=np.add(first.motion.joints, [50.0, 0.0]))
    moved.save(tmp_path / "state.best.npz")
    asked.clear()
    again = longest_link(bend(), "sweep", accuracy=0.2, state=state)
    assert again.length == first.length in asked and not np.array_equal(again.motion.joints, moved.joints)


def test_a_length_that_lacked_time_is_said_and_asked_again_with_more_time_only(tmp_path, monkeypatch):
    calls = []

    def late(maze, arm, planner, *, time_budget, explain):
        calls.append(arm.link_length)
        result = plan(maze, arm, planner, explain=explain)
        return result if arm.link_length < 400.0 else dataclasses.replace(
            result, status=PlanningStatus.OUT_OF_TIME, motion=None
        )  # fmt: skip

    monkeypatch.setattr(longest, "plan", late)
    monkeypatch.setattr(longest, "_compile", lambda planner: None)
    options = {"accuracy": 0.05, "state": tmp_path / "state.json"}
    first = longest_link(bend(), "sweep", time_budget=5.0, **options)
    assert first.length < 400.0 and len(first.out_of_time) >= 5 and first.failed == ()
    calls.clear()
    assert longest_link(bend(), "sweep", time_budget=5.0, **options).length == first.length and calls == []
    longest_link(bend(), "sweep", time_budget=6.0, **options)
    steps = {first.bound.upper * 0.95**k for k in range(100)}
    assert set(calls) >= steps & {trial.link_length for trial in first.out_of_time}


@pytest.mark.parametrize(
    ("status", "last", "seconds", "undecided"),
    [
        (PlanningStatus.DEAD_END, PlanningStatus.DEAD_END, 1.0, False),
        (PlanningStatus.DEAD_END, PlanningStatus.OUT_OF_TIME, 1.0, True),
        (PlanningStatus.DEAD_END, PlanningStatus.DEAD_END, 9.0, True),
        (PlanningStatus.IMPOSSIBLE, PlanningStatus.OUT_OF_TIME, 9.0, False),
    ],
)
def test_a_length_is_undecided_if_any_planner_lacked_time(status, last, seconds, undecided):
    attempts = tuple(
        Attempt(planner="sweep", route=0, status=each, seconds=1.0)
        for each in (PlanningStatus.DEAD_END, last)
    )
    result = PlanningResult(status=status, planner="track", attempts=attempts)
    assert LengthTrial.from_result(300.0, result, seconds, 9.0).out_of_time == undecided


def test_where_nothing_passes_the_answer_is_zero_with_all_reasons(tmp_path):
    answer = longest_link(bend(), "sweep", accuracy=0.5, joint_limit=0.01)
    assert (answer.length, answer.index, answer.motion) == (0.0, 0.0, None)
    assert answer.complete and all(trial.reason for trial in answer.failed) and answer.bound.upper > LIMIT
    draw_longest(bend(), answer, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")


def test_links_too_thick_for_the_maze_have_no_longest_length():
    answer = longest_link(bend(), "sweep", accuracy=0.1, link_radius=150.0, lengths=(400.0,))
    assert (answer.length, answer.bound.upper, answer.untried) == (0.0, 0.0, ())
    assert [trial.link_length for trial in answer.table] == [400.0]


def test_thick_links_are_shorter_than_thin_ones():
    thick = longest_link(bend(), "sweep", accuracy=0.05, link_radius=15.0)
    # The corridor is 30 narrower, but its inner corner is round: between the square corner's limit and more.
    assert 0.95**2 * 0.85 * LIMIT < thick.length < 0.95 * LIMIT


BAD_OPTIONS = [
    ({"planner": "best"}, "Unknown planner 'best'. Available: auto, beam"),
    ({"accuracy": 0.0}, "Expected an accuracy between 0.0001 and 0.5, got 0.0."),
    ({"accuracy": math.nan}, "Expected an accuracy between 0.0001 and 0.5, got nan."),
    ({"lengths": (100.0, -1.0)}, "Expected positive, finite lengths, got -1.0."),
    ({"time_budget": 0.0}, "Expected a positive time_budget in seconds, got 0.0."),
    ({"link_radius": -1.0}, "Expected link_radius of at least 0"),
    ({"joint_limit": 4.0}, "Expected joint_limit in (0, pi] rad, or None, got 4.0."),
]


@pytest.mark.parametrize(("options", "sentence"), BAD_OPTIONS)
def test_bad_options_are_refused_before_any_work(options, sentence, asked):
    with pytest.raises(InputError) as caught:
        longest_link(bend(), **options)
    assert str(caught.value).startswith(sentence) and asked == []


def test_a_file_of_something_else_is_neither_used_nor_overwritten(tmp_path):
    path = tmp_path / "maze.json"
    bend().save(path)
    before = path.read_text()
    for text, sentence in (
        (before, "holds something else"),
        ("{", "holds something else"),
        ('{"kind": "hrsnake longest", "digest": "?"}', None),
        (None, "got a damaged one"),
    ):
        if text is None:
            longest_link(bend(), "sweep", accuracy=0.4, state=path)
            text = json.dumps({**json.loads(path.read_text()), "trials": [{"link_length": "long"}]})
        path.write_text(text)
        if sentence is not None:
            with pytest.raises(InputError, match=sentence):
                longest_link(bend(), "sweep", accuracy=0.4, state=path)
            assert path.read_text() == text
