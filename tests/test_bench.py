"""The speed benchmark at its smallest, its file of lines, and what it compares with."""

import dataclasses
import json
import os

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry import LineString

from hrsnake_env.arm import ArmSpec, joints_from_configuration
from hrsnake_env.errors import InputError
from planners.baselines.ompl_sampling import FedArm, plan_ompl
from planners.bench.beside import beside_ompl, ompl_tasks, run_one, u_turns
from planners.bench.fits import exponent
from planners.bench.pool import resumed
from planners.bench.records import write_results
from planners.bench.speed import PARTS, QUICK, run_speed
from planners.bench.speed_tables import speed_markdown
from planners.query import Query
from planners.validation import validate

TINY = dataclasses.replace(
    QUICK,
    runs=1,
    stage_lengths=(245.0,),
    link_lengths=(245.0, 200.0),
    turns=(1, 2),
    fresh=1,
    seeds=1,
    compared=1,
)
ARM = FedArm(Query(maze=u_turns(1), arm=ArmSpec(link_length=220.0)), 4)
STATES = st.tuples(st.floats(0.0, 4.0), *[st.floats(-3.0, 3.0)] * 3)


def test_every_part_is_measured_and_written():
    results = run_speed(TINY, parts=PARTS[:-1], workers=1, quiet=True)
    assert set(PARTS[:-1]) < set(results)
    stages = results["stages"][0]
    assert stages["shape"] == [stages["n_poses"], stages["n_links"] + 1, 2]
    assert results["random mazes"]["kinds"]["clutter"]["mazes"] == 1
    assert results["memory"][0]["peak_bytes"] > results["memory"][0]["imported_bytes"] > 1e7
    text = speed_markdown(json.loads(json.dumps(results)))
    assert all(word in text for word in ("maze to poses", "Exponents", "MiB", "First call", "per second"))


def test_stages_add_up_to_the_time_from_maze_to_poses():
    row = run_speed(TINY, parts=("stages",), quiet=True)["stages"][0]["median_s"]
    before = sum(row[stage] for stage in ("potential", "path", "beams", "plan", "poses"))
    assert row["maze to poses"] == pytest.approx(before)


def test_a_part_that_is_not_there_is_named():
    with pytest.raises(InputError, match=r"Unknown part 'colour'\. Available: stages, links"):
        run_speed(TINY, parts=("colour",))


def test_results_are_written_whole(tmp_path):
    results = run_speed(TINY, parts=(), quiet=True)
    write_results(results, tmp_path / "speed.json")
    assert json.loads((tmp_path / "speed.json").read_text()) == results


@given(st.floats(-3.0, 3.0), st.floats(1e-6, 1e3))
def test_a_power_law_is_fitted_exactly(power, factor):
    sizes = [1.0, 2.0, 5.0, 9.0]
    fit = exponent(sizes, [factor * size**power for size in sizes])
    assert fit["exponent"] == pytest.approx(power, abs=1e-9)
    assert fit["off"] == pytest.approx(1.0)


def nothing():
    """Warm nothing up."""


def squared(number):
    """Return a row; fail loudly if asked for what is done."""
    assert number != 2.0
    return {"task": [number], "square": number**2}


def test_a_file_of_lines_goes_on_after_its_last_whole_line(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text('{"task": [2.0], "square": 4.0}\n{"task": [3.0], "squ')
    rows = resumed(path, squared, [(2.0,), (3.0,), (4.0,)], nothing, workers=1)
    assert [row["square"] for row in rows] == [4.0, 9.0, 16.0]
    assert len(path.read_text().splitlines()) == 3


def test_a_file_of_something_else_is_left_alone(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text("notes\n")
    with pytest.raises(InputError, match="Expected lines of JSON"):
        resumed(path, squared, [(3.0,)], nothing)
    assert path.read_text() == "notes\n"


@given(STATES)
def test_a_state_places_the_arm_as_the_environment_does(state):
    state = np.array(state)
    motion = ARM.motion([state, state])
    joints = joints_from_configuration(
        motion.feed[-1], motion.joint_angles[-1], 220.0, ARM.query.maze.base_pose
    )
    assert ARM.tip(state) == pytest.approx(tuple(joints[-1]), abs=1e-6)
    past = state[0] - (4 - np.arange(4))
    assert (motion.joint_angles[-1][past <= 0.0] == 0.0).all()


@given(STATES)
def test_a_state_is_free_when_the_arm_is_in_the_free_space_and_does_not_meet_itself(state):
    state = np.array(state)
    maze, joints = ARM.query.maze, ARM.motion([state, state]).joints[-1]
    past = state[0] - (4 - np.arange(5)) > 1e-9
    line = LineString([maze.base_pose[:2], *(joints[past] if past.any() else [maze.base_pose[:2]])])
    inside = line.within(maze.free_space)
    assume(not inside or line.distance(maze.free_space.boundary) > 1e-6)  # a touch may be read either way
    assert ARM.is_free(state) == (inside and line.is_simple)


@given(STATES, STATES)
def test_an_edge_keeps_the_checkers_step_limit_and_the_feeders_rule(a, b):
    motion = ARM.motion([np.zeros(4), np.array(a), np.array(b)])
    report = validate(motion, ARM.query.maze)
    assert not {"step", "feeder", "start", "length", "inconsistent"} & {fault.kind for fault in report.faults}


def test_the_start_is_free_and_the_edge_into_the_wall_is_not():
    start, straight, through = np.zeros(4), np.array([3.0, 0, 0, 0]), np.array([4.0, 1.5, 0, 0])
    assert ARM.edge_is_free(start, straight)
    assert not ARM.edge_is_free(straight, through)


def test_bad_questions_to_the_sampling_planners_are_refused():
    with pytest.raises(InputError, match=r"Unknown OMPL planner 'Dijkstra'\. Available: KPIECE1"):
        plan_ompl(ARM.query, algorithm="Dijkstra")
    thick = Query(maze=u_turns(1), arm=ArmSpec(link_length=220.0, link_radius=5.0))
    with pytest.raises(InputError, match="Expected thin links for OMPL, got a link radius of 5"):
        plan_ompl(thick)


def test_what_a_sampling_planner_finds_starts_in_the_feeder_and_ends_at_the_goal():
    pytest.importorskip("ompl")
    query = Query(maze=u_turns(1), arm=ArmSpec(link_length=220.0))
    motion = plan_ompl(query, algorithm="RRTConnect", seed=1, time_limit=10.0).motion
    assert motion is not None
    faults = {fault.kind for fault in validate(motion, query.maze).faults}
    assert faults <= {"penetration", "sweep"}  # it looks in steps and may clip a corner between two


def test_a_sampling_planner_that_runs_out_of_time_says_so():
    pytest.importorskip("ompl")
    candidate = plan_ompl(ARM.query, algorithm="KPIECE1", time_limit=0.05)
    assert candidate.motion is None
    assert candidate.status == "out of time"


def test_planners_are_counted_side_by_side():
    pytest.importorskip("ompl")
    tasks = [task for task in ompl_tasks((1,), (0.5,), (1,), 0.3) if task[2] != "KPIECE1"]
    rows = beside_ompl(tasks, workers=1)
    assert [row["planner"] for row in rows] == ["auto", "sweep", "BKPIECE1", "RRTConnect"]
    assert all(row["runs"] == row["valid"] + row["invalid"] + row["unsolved"] for row in rows)
    assert rows[0]["valid"] == 1


def test_our_planner_is_timed_in_the_same_mazes():
    run = run_one(1, 0.9, "sweep", 1, 5.0)
    assert run["outcome"] == "valid"
    assert 0.0 < run["seconds"] < 5.0


@pytest.mark.skipif(not hasattr(os, "getloadavg"), reason="the system does not tell its load")
def test_the_machine_is_named():
    results = run_speed(TINY, parts=(), quiet=True)
    assert results["machine"]["cores"] == os.cpu_count()
    assert f"Python {results['machine']['python']}" in speed_markdown(results)
