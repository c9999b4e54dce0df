"""Studies that compare methods: cells and their rows, and runs that lose and double nothing."""

import dataclasses
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from campaign_workers import ALWAYS, HANGS, N_CELLS, ONCE, cells_of, deadly, quick

from hrsnake_env.errors import InputError
from hrsnake_env.random_mazes import N_LINKS, random_maze
from planners import cli
from planners.bench import campaign, learners, methods, planned
from planners.bench.campaign import run_cells
from planners.bench.cells import Cell, CellResult
from planners.bench.engines import DIED, HUNG, over_cells
from planners.bench.learners import LEARNERS, MEASURED, Trained
from planners.bench.methods import available, run_cell
from planners.bench.rows import COLUMNS, TIMES, read_rows, whole_row, write_rows
from planners.bench.studies import STUDIES, study_cells
from planners.bench.tasks import Task, clutter_task, held_out_task, leg_task, rung_task, scan_task, shape_task
from planners.planning import PLANNERS, plan

WORKERS = Path(__file__).with_name("campaign_workers.py")


def cell_of(task: Task, method: str = "track", **changes: object) -> Cell:
    """Return a cell of a task with a budget of 5 s."""
    plain = {"study": "ladder", "seed": 0, "budget": 5.0, "budget_unit": "s", "episodes": task.n_mazes}
    return Cell(method=method, task=task, **{**plain, **changes})


def without_times(rows):
    """Return the rows without what no two runs agree in."""
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def in_process(cells, run, **options):
    """Do cells here, one after the other."""
    yield from ((cell, run(cell)) for cell in cells)


def environment(**more):
    """Return an environment in which the script finds the packages and this folder."""
    path = os.pathsep.join([str(WORKERS.parents[1]), str(WORKERS.parent)])
    return {**os.environ, "PYTHONPATH": path, **more}


# Cells


def test_a_planned_motion_is_driven_through_the_simulator():
    (row,) = run_cell(cell_of(rung_task("bend-i60"))).rows
    assert list(row) == list(COLUMNS)
    assert (row["status"], row["solved"], row["success"], row["clean"]) == ("solved", True, True, True)
    assert row["index"] == pytest.approx(0.6, abs=0.01) and row["n_links"] == 4
    assert 0.0 < row["check_seconds"] < row["seconds"]
    assert row["steps"] > 0 and row["progress"] > 0.9 and row["collisions"] == 0


def test_what_was_not_simulated_is_null():
    (row,) = run_cell(cell_of(rung_task("bend-i60"), "follow")).rows
    assert (row["status"], row["solved"]) == ("not valid", False) and row["reason"]
    assert row["success"] is row["clean"] is row["steps"] is row["pinches"] is None
    assert row["worst_depth"] > 0.01  # what the exact check says of a motion that it refuses


def test_rows_come_back_from_a_file_as_they_were(tmp_path):
    rows = [run_cell(cell_of(rung_task("bend-i60"), name)).rows[0] for name in ("track", "follow")]
    write_rows(rows, tmp_path / "rows.parquet")
    assert read_rows(tmp_path / "rows.parquet") == rows
    (tmp_path / "other.parquet").write_text("no rows")
    with pytest.raises(InputError, match="Expected rows of a benchmark"):
        read_rows(tmp_path / "other.parquet")
    with pytest.raises(InputError, match=r"unknown: \['colour'\]"):
        whole_row({**rows[0], "colour": "red"})


def test_an_episode_of_a_family_is_a_maze():
    task = held_out_task("random", 2)
    rows = run_cell(cell_of(task)).rows
    assert [row["maze"] for row in rows] == ["random-test-0", "random-test-1"]
    assert [row["episode"] for row in rows] == [0, 1]


def test_held_out_mazes_are_as_tight_as_their_index_says():
    for number in range(3):
        problem = held_out_task("random", 3).problem(number)
        rng = np.random.default_rng([1, number])
        difficulty = rng.uniform(0.0, 1.0)
        assert random_maze(rng, difficulty=difficulty, n_links=N_LINKS).free_space.equals(
            problem.maze.free_space
        )
        assert problem.index == pytest.approx(0.3 + 0.6 * difficulty)


def test_every_error_is_a_row(monkeypatch):
    def broken(query):
        raise ZeroDivisionError("no\nroom")

    monkeypatch.setitem(PLANNERS, "track", broken)
    planned.warm_up.cache_clear()
    monkeypatch.setattr(planned, "warm_up", lambda method: None)
    rows = run_cell(cell_of(held_out_task("random", 2))).rows
    assert [row["status"] for row in rows] == ["error: ZeroDivisionError: no room"] * 2
    assert [row["maze"] for row in rows] == ["random-test-0", "random-test-1"]
    assert not any(row["solved"] for row in rows)


def test_a_maze_that_cannot_be_built_is_a_row_beside_the_others(monkeypatch):
    real, task = plan, held_out_task("random", 2)

    def plan_second_only(maze, *arguments, **options):
        if maze.name == "random-test-0":
            raise MemoryError
        return real(maze, *arguments, **options)

    monkeypatch.setattr(planned, "plan", plan_second_only)
    assert [row["status"] for row in run_cell(cell_of(task)).rows] == ["error: MemoryError: ", "solved"]


def test_an_error_of_a_whole_cell_is_a_row(monkeypatch):
    def broken(method):
        raise RuntimeError("no kernels")

    monkeypatch.setattr(planned, "warm_up", broken)
    (row,) = run_cell(cell_of(rung_task("straight"))).rows
    assert row["status"] == "error: RuntimeError: no kernels" and not row["solved"]


@pytest.mark.parametrize("limit", [0.331, 0.5, 0.977])
def test_a_scan_closes_in_on_the_largest_index(monkeypatch, limit):
    def fake(maze, arm, *arguments, **options):
        solved = 88.0 <= arm.link_length <= limit * 440.0
        return SimpleNamespace(
            motion=SimpleNamespace(n_links=9) if solved else None,
            status="solved" if solved else "dead end",
            reason="",
            solved=solved,
            report=None,
            timings={},
        )

    monkeypatch.setattr(planned, "plan", fake)
    rows = run_cell(cell_of(scan_task("fig19", 440.0), episodes=planned.MOST_LENGTHS)).rows
    best = max(row["index"] for row in rows if row["solved"])
    assert limit - planned.FINEST <= best <= limit
    assert len(rows) <= planned.MOST_LENGTHS and [row["episode"] for row in rows] == list(range(len(rows)))
    assert set(planned.SCAN) <= {round(row["index"], 3) for row in rows}  # failures do not end it


def test_a_trained_policy_is_tested_by_mean_and_sampled_actions(monkeypatch):
    def learn(task, seed, steps, folder):
        def test(episodes, first_seed, mean):
            facts = dict.fromkeys(MEASURED, 1)
            return [{**facts, "success": mean, "clean": True} for _ in range(episodes)]

        assert folder.is_dir() and steps == 500 and task.env_id == "HyperRedundantMaze-Bend-I60-v0"
        return Trained(test=test, seconds=3.0, cpu_seconds=2.0, train_steps=512, policy=b"weights")

    monkeypatch.setitem(LEARNERS, "ppo", learn)
    cell = cell_of(rung_task("bend-i60"), "ppo", budget=500.0, budget_unit="steps", episodes=4)
    result = run_cell(cell)
    assert Counter((row["actions"], row["solved"]) for row in result.rows) == {
        ("mean", True): 4,
        ("sampled", False): 4,
    }
    assert {(row["status"], row["train_steps"], row["seconds"]) for row in result.rows} == {
        ("evaluated", 512, 3.0)
    }
    assert result.files == {".npz": b"weights"}


def test_a_learner_is_tested_in_the_mazes_that_its_rows_name_and_planners_get(monkeypatch):
    task = held_out_task("random", 3)
    seen = []

    def run(env, policy, seed, *, options, deterministic=True):
        env.reset(seed=seed, options=options)
        seen.append(env.unwrapped.maze.name)
        return dict.fromkeys(MEASURED, 0)

    monkeypatch.setattr(learners, "episode_facts", run)
    rows = run_cell(cell_of(task, "random", episodes=3)).rows
    assert [row["maze"] for row in rows] == seen == [task.problem(k).maze.name for k in range(3)]


@pytest.mark.parametrize(
    ("options", "said"),
    [({"engine": "none"}, "Unknown engine"), ({"workers": 0}, "at least one"), ({"address": "a"}, "ray")],
)
def test_a_refused_engine_leaves_nothing_behind(tmp_path, options, said):
    cells = [cell_of(rung_task("straight"))]
    with pytest.raises(InputError, match=said):
        run_cells(cells, tmp_path / "study", **options)
    assert not (tmp_path / "study").exists()


def test_a_training_that_fails_is_a_row_for_each_way_to_act(monkeypatch):
    def learn(*arguments):
        raise ValueError("diverged")

    monkeypatch.setitem(LEARNERS, "ppo", learn)
    rows = run_cell(cell_of(rung_task("straight"), "ppo", budget=10.0, budget_unit="steps")).rows
    assert [(row["actions"], row["status"]) for row in rows] == [
        ("mean", "error: ValueError: diverged"),
        ("sampled", "error: ValueError: diverged"),
    ]


def test_random_actions_are_tested_without_training():
    task = shape_task("u-turn", 0.45, learnt=True)
    cell = cell_of(task, "random", budget=0.0, budget_unit="steps", episodes=2)
    first, second = run_cell(cell).rows
    assert first["status"] == "evaluated" and first["actions"] == "sampled" and first["train_steps"] == 0
    assert first["return"] != second["return"] and first["n_links"] == 5
    assert without_times(run_cell(cell).rows) == without_times([first, second])


# Studies


@pytest.mark.parametrize("name", STUDIES)
def test_the_names_of_a_study_are_unique_and_so_are_its_keys(name):
    cells = study_cells(name, skip_missing=True)
    assert len({cell.key for cell in cells}) == len(cells)
    tasks = {cell.task.name: cell.task for cell in cells}
    assert len({task.definition for task in tasks.values()}) == len(tasks)
    assert len({cell.identity for cell in cells}) == len(cells)
    assert 0 < len(study_cells(name, skip_missing=True, quick=True)) < len(cells)


def test_other_work_has_another_key():
    cell = cell_of(rung_task("bend-i60"))
    task = dataclasses.replace(cell.task, simulate=False)
    changes = ({"budget": 6.0}, {"seed": 1}, {"method": "sweep"}, {"task": task}, {"episodes": 2})
    keys = {cell.key, *(dataclasses.replace(cell, **change).key for change in changes)}
    assert len(keys) == 1 + len(changes)
    assert cell.key == cell_of(rung_task("bend-i60")).key


def test_methods_that_draw_have_every_seed():
    cells = study_cells("ladder", methods=["track", "random"], tasks=["straight"], seeds=[4, 5])
    assert [(cell.method, cell.seed) for cell in cells] == [("track", 4), ("random", 4), ("random", 5)]


def test_long_arms_are_learnt_only_if_asked_for():
    cells = study_cells("ladder", methods=["random"])
    assert max(cell.task.n_links for cell in cells) <= 8
    (cell,) = study_cells("ladder", methods=["random"], tasks=["fig17a"], seeds=[0])
    assert cell.task.n_links == 45


@pytest.mark.parametrize(("n_links", "index"), [(5, 0.23), (12, 0.68), (27, 0.91)])
def test_legs_are_as_long_as_the_links_take(n_links, index):
    problem = leg_task(n_links, index).problem(0)
    (row,) = run_cell(cell_of(leg_task(n_links, index))).rows
    assert row["solved"] and abs(row["n_links"] - n_links) <= 1
    assert problem.index == pytest.approx(index)


def test_halls_have_links_at_the_index_of_their_own_longest_rod():
    loose, tight = (clutter_task(index, 1).problem(1) for index in (0.3, 0.9))
    assert loose.longest_rod == tight.longest_rod
    assert (loose.index, tight.index) == pytest.approx((0.3, 0.9))


@pytest.mark.parametrize(
    ("study", "options", "message"),
    [
        ("colours", {}, r"Unknown study 'colours'\. Available: ladder, index"),
        ("ladder", {"methods": ["magic"]}, r"Unknown method 'magic'\. Available: auto, beam"),
        (
            "ladder",
            {"tasks": ["moon*"], "methods": ["track"]},
            r"Unknown task 'moon\*'\. Available: straight",
        ),
        ("ladder", {"budget": 0.0}, "Expected a positive, finite budget in seconds, got 0"),
        ("ladder", {"train_steps": 0}, "Expected at least one step of training, got 0"),
        ("ladder", {"seeds": [-1]}, "Expected seeds of at least 0, got -1"),
        ("links", {"methods": ["random"]}, "Expected a method that the tasks are for, got random"),
    ],
)
def test_a_study_that_cannot_be_is_refused(study, options, message):
    with pytest.raises(InputError, match=message):
        study_cells(study, **options)


def test_a_method_that_is_not_installed_is_refused_once_or_left_out(monkeypatch):
    monkeypatch.setattr(methods.importlib.util, "find_spec", lambda name: None if "stable" in name else 1)
    with pytest.raises(InputError, match=r"Expected stable_baselines3 .* 'ppo': pip install 'hrsnake\[rl\]'"):
        available(["track", "ppo"])
    assert available(["track", "ppo", "track"], skip_missing=True) == ["track"]


# Runs


def test_finished_cells_are_not_done_again(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "over_cells", in_process)
    cells = cells_of(4)
    first = run_cells(cells[:3], tmp_path, run=quick, quiet=True)
    assert (first.cells, first.done, first.complete, first.errors) == (3, 3, True, 0)
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "cells").iterdir()}
    second = run_cells(cells, tmp_path, run=quick, quiet=True)
    assert all(path.stat().st_mtime_ns == time_ns for path, time_ns in before.items())
    assert second.rows == len(read_rows(tmp_path / "rows.parquet")) == sum(cell.episodes for cell in cells)
    assert (tmp_path / "cells" / f"{cells[0].key}.npz").read_bytes() == cells[0].key.encode()


def test_a_larger_budget_takes_the_place_of_a_smaller_one(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "over_cells", in_process)
    for budget, wanted in ((1.0, 1.0), (3.0, 3.0), (2.0, 2.0)):
        run_cells(cells_of(2, budget=budget), tmp_path, run=quick, quiet=True)
        rows = read_rows(tmp_path / "rows.parquet")
        assert {row["budget"] for row in rows} == {wanted}
        assert len(rows) == 3
    run_cells(cells_of(3)[2:], tmp_path, run=quick, quiet=True)
    assert {row["budget"] for row in read_rows(tmp_path / "rows.parquet")} == {3.0, 1.0}


def test_a_folder_holds_one_study(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "over_cells", in_process)
    run_cells(cells_of(1), tmp_path, run=quick, quiet=True)
    other = [dataclasses.replace(cell, study="index") for cell in cells_of(1)]
    with pytest.raises(InputError, match=r"Expected a folder for the study 'index', but .* holds 'ladder'"):
        run_cells(other, tmp_path, run=quick, quiet=True)


def test_errors_are_done_again_only_if_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "over_cells", in_process)

    def broken(cell):
        return CellResult(rows=methods.error_rows(cell, "no luck"))

    assert run_cells(cells_of(2), tmp_path, run=broken, quiet=True).errors == 2
    assert run_cells(cells_of(2), tmp_path, run=quick, quiet=True).errors == 2
    assert run_cells(cells_of(2), tmp_path, run=quick, quiet=True, retry_errors=True).errors == 0


def test_ctrl_c_says_how_to_go_on(tmp_path, monkeypatch, capsys):
    def stopped(cells, run, **options):
        yield cells[0], quick(cells[0])
        raise KeyboardInterrupt

    monkeypatch.setattr(campaign, "over_cells", stopped)
    out = str(tmp_path / "study")
    monkeypatch.setattr(sys, "argv", ["hrsnake", "bench", "ladder", "--methods", "track", "--out", out])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 130
    said = capsys.readouterr().err
    assert "0 of them finished; the others take" in said
    assert "Stopped after 1 of 28 cells; the same command goes on." in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--methods", "magic"], "Unknown method 'magic'"),
        (["--seeds", "one"], "Expected seeds as whole numbers with commas (0,1,2), got 'one'."),
        (["--methods", "track", "--engine", "steam"], "Unknown engine 'steam'. Available: processes, ray."),
        (["--methods", "track", "--address", "auto"], "Expected an address for the engine 'ray' alone"),
        (["--methods", "track", "--engine", "ray", "--address", "127.0.0.1:1"], "Expected a Ray cluster at"),
        (["--methods", "track", "--workers", "0"], "Expected at least one worker, got 0."),
    ],
)
def test_bad_input_is_one_sentence(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.setattr(sys, "argv", ["hrsnake", "bench", "links", "--out", str(tmp_path), *arguments])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


# Workers that die


def test_a_worker_that_dies_or_hangs_costs_its_cell_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("CAMPAIGN_FLAG", str(tmp_path / "flag"))
    patience = property(lambda cell: 3.0 if cell.seed == HANGS else None)
    monkeypatch.setattr(Cell, "patience", patience)
    done = over_cells(cells_of(6), deadly, engine="processes", workers=2)
    statuses = {cell.seed: result.rows[0]["status"] for cell, result in done}
    assert statuses.pop(ALWAYS) == f"error: {DIED}"
    assert statuses.pop(HANGS) == f"error: {HUNG}"
    assert statuses == dict.fromkeys((0, 1, ONCE, 4), "solved")


def finished(out):
    """Count finished cells."""
    return len([path for path in out.glob("cells/*.parquet") if not path.name.startswith(".")])


def ended(pid):
    """Tell whether a process has ended, though nobody may have asked for its exit status."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def test_a_run_that_is_killed_loses_and_doubles_nothing(tmp_path, monkeypatch):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    monkeypatch.setattr(campaign, "over_cells", in_process)
    run_cells(cells_of(N_CELLS), whole, run=quick, quiet=True)
    rng = random.Random(7)
    for sent in (signal.SIGKILL, signal.SIGINT, signal.SIGKILL):
        wanted = finished(broken) + 4
        run = subprocess.Popen(
            [sys.executable, str(WORKERS), str(broken)], env=environment(), stderr=subprocess.DEVNULL
        )
        while finished(broken) < wanted:
            assert run.poll() is None
            time.sleep(0.005)
        time.sleep(rng.uniform(0.0, 0.1))
        tasks = Path(f"/proc/{run.pid}/task/{run.pid}/children")
        children = tasks.read_text().split() if tasks.exists() else []
        run.send_signal(sent)
        assert run.wait(20) == (130 if sent == signal.SIGINT else -signal.SIGKILL)
        deadline = time.monotonic() + 20.0
        while not all(map(ended, children)):
            assert time.monotonic() < deadline
            time.sleep(0.02)
    assert 12 <= finished(broken) < N_CELLS
    (broken / "cells" / ".hrsnake-0.part.parquet").write_bytes(b"PAR1 and no more")
    subprocess.run([sys.executable, str(WORKERS), str(broken)], env=environment(), check=True)
    kept = [sorted(path.name for path in folder.glob("cells/*")) for folder in (whole, broken)]
    assert kept[0] == kept[1]
    rows = [without_times(read_rows(folder / "rows.parquet")) for folder in (whole, broken)]
    assert rows[0] == rows[1] and len(rows[0]) == sum(cell.episodes for cell in cells_of(N_CELLS))


def test_ray_gives_the_same_rows_though_a_worker_dies(tmp_path, monkeypatch):
    pytest.importorskip("ray")
    flag, out, here = tmp_path / "flag", tmp_path / "ray", tmp_path / "here"
    done = subprocess.run(
        [sys.executable, str(WORKERS), str(out), "ray"],
        env=environment(CAMPAIGN_FLAG=str(flag), RAY_USAGE_STATS_ENABLED="0"),
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert flag.exists()
    monkeypatch.setattr(campaign, "over_cells", in_process)
    run_cells(cells_of(8), here, run=quick, quiet=True)
    assert without_times(read_rows(out / "rows.parquet")) == without_times(read_rows(here / "rows.parquet"))
