"""The speed benchmark at its smallest, its file of lines, and what it compares with."""

import dataclasses
import json
import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrsnake_env.errors import InputError
from planners.bench.beside import beside_ompl, ompl_tasks, run_one
from planners.bench.fits import exponent
from planners.bench.pool import resumed
from planners.bench.records import write_results
from planners.bench.speed import PARTS, QUICK, run_speed
from planners.bench.speed_tables import speed_markdown

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


def test_planners_are_counted_side_by_side():
    pytest.importorskip("ompl")
    tasks = [task for task in ompl_tasks((1,), (0.5,), (1,), 0.3) if task[2] != "KPIECE1"]
    rows = beside_ompl(tasks, workers=1)
    assert [row["planner"] for row in rows] == ["auto", "sweep", "BKPIECE1", "RRTConnect", "AORRTC"]
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
