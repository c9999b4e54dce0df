"""The environment's benchmark at its smallest, the processes that it asks, and what its figures mean."""

import dataclasses
import io
import json
import sys

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

from hrsnake_env.errors import InputError
from planners.bench import environment, environment_peers
from planners.bench.environment import PARTS, QUICK, run_environment
from planners.bench.environment_peers import beside_peers, peers_python, stepping
from planners.bench.environment_random import EVERY_MAZE, random_steps, random_tasks, summed_up
from planners.bench.environment_scenes import ENV_ID, N_WALLS, REACH, arm_in_hall, half_out, hall
from planners.bench.environment_stepper import Stepper, serve
from planners.bench.environment_tables import environment_markdown
from planners.bench.environment_where import PIECES, REST, Stopwatch
from planners.cli import app

TINY = dataclasses.replace(
    QUICK,
    window=0.02,
    rounds=1,
    links=(12,),
    where_rounds=1,
    where_steps=60,
    n_envs=2,
    random_mazes=("straight", "random"),
    random_steps=200,
)
CART = {"make": "CartPole-v1", "seed": 1}


@pytest.fixture(scope="module")
def results():
    return run_environment(TINY, parts=PARTS[1:], quiet=True)


def test_every_part_is_measured_and_named_in_the_tables(results):
    assert set(PARTS[1:]) < set(results)
    text = environment_markdown(json.loads(json.dumps(results)))
    assert all(f"**{part}**" in text for part in PARTS[1:])


def test_the_pieces_of_a_step_are_all_there_and_add_up(results):
    (row,) = results["where"]
    assert set(row["pieces"]) == {*PIECES, REST}
    assert row["pieces"]["pymunk's step"] > 0.0
    assert row["sum"] == pytest.approx(sum(row["pieces"].values()))


def test_planned_episodes_come_to_the_goal_with_a_clean_verdict(results):
    rows = results["planner"]["rows"]
    assert {(row["maze"], row["substeps"]) for row in rows} == {("fig19", n) for n in (1, 2, 4)}
    assert all(row["success"] and row["clean"] for row in rows)
    errors = [row["node_error"] for row in sorted(rows, key=lambda row: row["substeps"])]
    assert errors == sorted(errors, reverse=True) and errors[-1] > 0.0


def test_one_environment_is_the_unit_of_vectors(results):
    rows = {row["name"]: row for row in results["vector"]["rows"]}
    assert rows["one"]["ratio"] == {"median": 1.0, "least": 1.0, "largest": 1.0}
    assert {"make_vec, sync", "make_vec, async"} < set(rows)


def test_the_hall_has_forty_walls_and_arms_of_one_reach():
    assert len(hall(0).walls) == len(hall(1).walls) == N_WALLS
    for n_links in (12, 45):
        env = gym.make(ENV_ID, **arm_in_hall(n_links, hall()))
        _, info = env.reset(options=half_out())
        assert info["feed"] == pytest.approx(REACH / 2)
        assert info["collisions"] == info["pinches"] == 0


def test_arms_in_the_hall_meet_its_pillars():
    stepper = Stepper(gym.make(ENV_ID, **arm_in_hall(12, hall())), 0, half_out())
    ticks = iter(range(10**6))
    counts = stepper.run(100, lambda: next(ticks))
    assert counts["steps"] == 1000
    assert 0 < counts["touched"] < counts["steps"]


def test_a_stepper_resets_whenever_an_episode_ends():
    ticks = iter(range(10**6))
    counts = Stepper(gym.make("CartPole-v1")).run(40, lambda: next(ticks))
    assert counts["steps"] == 400
    assert counts["resets"] >= 2  # a pole that is pushed at random falls within 100 steps


def test_every_order_gets_one_line():
    orders = io.StringIO("\n".join(map(json.dumps, (CART, {"run": 0.01}, {"run": 0.02}))) + "\n")
    answers = io.StringIO()
    serve(orders, answers)
    made, first, second = map(json.loads, answers.getvalue().splitlines())
    assert made == {"ready": "CartPole-v1", "gymnasium": gym.__version__}
    assert first["steps"] > 0 and first["seconds"] >= 0.01 and second["seconds"] >= 0.02


FAKE = """
import json, sys
json.loads(sys.stdin.readline())
print(json.dumps({"ready": "fake"}), flush=True)
for line in sys.stdin:
    seconds = json.loads(line)["run"]
    print(json.dumps({"steps": 1000, "seconds": seconds, "resets": 1, "touched": 10}), flush=True)
"""


def test_a_ratio_compares_with_the_peer_of_its_round(monkeypatch, tmp_path):
    script = tmp_path / "fake.py"
    script.write_text(FAKE)
    real = environment_peers.stepping
    monkeypatch.setattr(environment_peers, "stepping", lambda python, order: real(python, order, script))
    figures = beside_peers(sys.executable, 0.5, 3)
    assert [peer["rate"]["median"] for peer in figures["peers"]] == [2000.0, 2000.0]
    assert {(row["n_links"], row["substeps"]) for row in figures["ours"]} == {
        (n_links, substeps) for n_links in (12, 45) for substeps in (1, 2, 4)
    }
    for row in figures["ours"]:
        assert row["ratio"] == {"median": 1.0, "least": 1.0, "largest": 1.0}
        assert (row["steps"], row["resets"], row["touched"]) == (3000, 3, 0.01)
    text = environment_markdown(run_environment(TINY, parts=(), quiet=True) | {"peers": [figures]})
    assert ">= 4: not met" in text and ">= 0.6: met" in text


def test_a_process_steps_through_what_it_is_asked_for():
    with stepping(sys.executable, CART) as run:
        counts = run(0.01)
    assert counts["steps"] > 0 and counts["touched"] == 0


def test_what_cannot_be_made_is_told_in_one_sentence(tmp_path):
    with (
        pytest.raises(InputError, match=r"Expected steps of 'Nothing-v0', got: .*Nothing"),
        stepping(sys.executable, {"make": "Nothing-v0"}),
    ):
        pass
    with (
        pytest.raises(InputError, match="Expected a Python to run, got"),
        stepping(tmp_path / "python", CART),
    ):
        pass


def test_peers_that_cannot_be_installed_are_told_in_one_sentence(monkeypatch, tmp_path):
    monkeypatch.setattr(environment_peers.venv, "create", lambda folder, **_: folder.mkdir())
    with pytest.raises(InputError, match=r"^Expected pip to install gym-pusht==0\.1\.8 .*--peers-python"):
        peers_python(tmp_path / "peers")
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(InputError, match="Expected a virtual environment, or nothing yet"):
        peers_python(tmp_path)
    assert (tmp_path / "notes").read_text() == "mine"


def test_time_within_a_piece_counts_for_the_innermost_alone(monkeypatch):
    ticks = iter([0.0, 1.0, 3.0, 10.0])
    monkeypatch.setattr("planners.bench.environment_where.time.perf_counter", lambda: next(ticks))
    watch = Stopwatch("outer")
    inner = watch.timed("inner", lambda: None)
    inner()  # outside the root: not counted
    watch.timed("outer", inner)()
    assert watch.seconds == {"inner": 2.0, "outer": 8.0}
    assert (watch.total, watch.calls, watch.inside) == (
        10.0,
        {"inner": 1, "outer": 1},
        {"inner": 0, "outer": 1},
    )


def test_random_tasks_cover_every_maze_end_and_actuation():
    tasks = random_tasks(10**6)
    assert sum(steps for *_, steps, _ in tasks) >= 10**6
    assert len({task[:3] for task in tasks}) == len(tasks) == 4 * len(EVERY_MAZE)


def test_random_steps_repeat():
    task = ("u-turn-i50", False, "computed_torque", 300, 3)
    row = random_steps(*task)
    assert row == random_steps(*task)
    assert row["steps"] == 300 and row["not_finite"] == 0 and "exception" not in row


def test_an_exception_is_a_finding():
    row = random_steps("nowhere", True, "gear", 5, 0)
    assert row["exception"].startswith("InputError: Unknown maze 'nowhere'")
    assert len(summed_up([row], 1)["exceptions"]) == 1


def test_random_runs_go_on_from_their_file(tmp_path):
    rows = tmp_path / "rows.jsonl"
    done = [random_steps(*task) for task in random_tasks(200, TINY.random_mazes)]
    rows.write_text("".join(json.dumps({**row, "steps": 7}) + "\n" for row in done))
    again = run_environment(TINY, parts=("random",), rows=rows, workers=1, quiet=True)["random"]
    assert (again["done"], sum(row["steps"] for row in again["rows"])) == (len(done), 7 * len(done))


def test_ctrl_c_keeps_the_parts_that_are_done(monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(environment, "resets", lambda *_: {"figures": 1})
    monkeypatch.setattr(environment, "vector", stop)
    kept = []
    results = run_environment(
        TINY, parts=("resets", "vector", "random"), keep=lambda done: kept.append(dict(done)), quiet=True
    )
    assert results["resets"] == {"figures": 1} and results["stopped"] == "vector"
    assert "random" not in results
    assert [done["resets"] for done in kept] == [{"figures": 1}]


def test_a_part_that_is_not_there_is_named():
    with pytest.raises(InputError, match=r"Unknown part 'colour'\. Available: peers, where"):
        run_environment(TINY, parts=("colour",))


@pytest.mark.image
def test_the_command_writes_figures_and_a_picture(monkeypatch, tmp_path):
    monkeypatch.setattr(environment, "QUICK", TINY)
    file, picture = tmp_path / "env.json", tmp_path / "where.png"
    arguments = ["bench", "env", "--quick", "--parts", "where", "--out", str(file), "--json"]
    done = CliRunner().invoke(app, [*arguments, "--picture", str(picture)])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout) == json.loads(file.read_text())
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert np.isfinite(json.loads(file.read_text())["where"][0]["whole"])
