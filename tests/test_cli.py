"""The command line as a user meets it: outcomes, exit codes, and one sentence for bad input."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from planners import Motion, PlanningResult, PlanningStatus, plan
from planners.cli import app, main
from planners.drawing import draw_failure
from planners.problem import Failure
from planners.tables import show_plan


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path, monkeypatch):
    """Run every test in a folder of its own."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def motion():
    """Return the motion of the paper's links through the paper's benchmark."""
    return plan(fig19(), ArmSpec(link_length=430.0)).motion


@pytest.fixture
def run(capsys, monkeypatch):
    """Return a function that runs a command and returns exit code, stdout and stderr."""

    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        output = capsys.readouterr()
        return ended.value.code or 0, output.out, output.err

    return run_command


def test_plan_writes_a_motion_that_validates_and_simulates(run):
    code, out, err = run("plan", "fig19", "--link-length", 430, "--planner", "sweep", "--out", "m.npz")
    assert (code, err) == (0, "")
    assert "solved" in out and "7 links of 430 px" in out and "Written: m.npz" in out
    code, out, _ = run("validate", "fig19", "m.npz")
    assert code == 0 and "valid" in out
    code, out, _ = run("simulate", "fig19", "m.npz")
    assert code == 0 and "clean: links merely pinch the walls" in out


def test_json_is_one_object_on_one_line(run, motion):
    motion.save("m.npz")
    code, out, _ = run("plan", "fig19", "--link-length", 430, "--planner", "sweep", "--json")
    assert code == 0 and len(out.splitlines()) == 1
    data = json.loads(out)
    assert data["status"] == "solved" and data["n_links"] == 7 and data["validation"]["penetration"] == 0.0
    code, out, _ = run("validate", "fig19", "m.npz", "--json")
    assert json.loads(out)["valid"] is True
    code, out, _ = run("simulate", "fig19", "m.npz", "--json")
    verdict = json.loads(out)["verdict"]
    assert verdict["clean"] is True and verdict["kinematic"]["collision"] == 0
    code, out, _ = run("draw", "fig19", "--json")
    assert json.loads(out)["corners"][0]["turn"] == "right"


def test_no_plan_is_exit_code_3_with_a_reason_and_nothing_written(run):
    code, out, err = run("plan", "fig19", "--link-length", 445, "--planner", "sweep", "--out", "m.npz")
    assert (code, err) == (3, "")
    assert "dead end" in out and "stays free" in " ".join(out.split()) and "place" in out
    assert not Path("m.npz").exists()
    code, out, _ = run("plan", "fig19", "--link-length", 445, "--json")
    data = json.loads(out)
    assert code == 3 and data["status"] == "impossible" and len(data["place"]) == 2
    assert data["reason"].startswith("No rod of 445 px passes") and len(data["attempts"]) >= 2


def test_a_motion_that_is_not_valid_is_exit_code_3(run, motion):
    tighter = fig19(l1=196, l2=196, wall=44, end_gap=196)
    tighter.save("tight.geojson")
    motion.save("m.npz")
    code, out, _ = run("validate", "tight.geojson", "m.npz")
    assert code == 3 and "NOT VALID" in out and "penetration" in out
    code, out, _ = run("simulate", "tight.geojson", "m.npz")
    assert code == 3 and "NOT CLEAN" in out and "collided" in out
    assert "wall 7 from (-98, 1598) to (-98, 0)" in " ".join(out.split())


def test_a_failed_plan_says_and_draws_what_is_in_the_way(run):
    code, out, _ = run("plan", "S200", "--link-length", 500, "--planner", "sweep", "--picture", "why.png")
    words = " ".join(out.split())
    assert code == 3 and "Written: why.png" in out
    assert "tried sweep: dead end" in words and "px from the base" in words and "longest link there" in words
    assert Path("why.png").read_bytes().startswith(b"\x89PNG")


def test_the_wall_that_is_in_the_way_is_named_and_drawn(capsys):
    maze, arm = Maze.load("L"), ArmSpec(link_length=600.0)
    joints = np.array([[0.0, 100.0], [0.0, 700.0], [-90.0, 1290.0]])
    failure = Failure(
        place=(-90.0, 1290.0), path_position=1200.0, link=0, wall=2, depth=12.5, joints=joints
    )  # fmt: skip
    result = PlanningResult(
        status=PlanningStatus.DEAD_END, planner="sweep", failure=failure, longest_there=561.0
    )
    show_plan(maze, arm, result, [None], Path("why.png"))
    words = " ".join(capsys.readouterr().out.split())
    (x0, y0), (x1, y1) = maze.walls[2]
    assert f"in the way wall 2 from ({x0:.5g}, {y0:.5g}) to ({x1:.5g}, {y1:.5g})" in words
    assert "depth 12.5 px in that wall" in words and "longest link there 561 px" in words
    draw_failure(maze, arm, result, Path("why.png"))
    bare = PlanningResult(status=PlanningStatus.NO_PATH, planner="sweep", reason="No path.")
    draw_failure(maze, arm, bare, Path("bare.svg"))
    assert all(Path(name).stat().st_size > 5000 for name in ("why.png", "bare.svg"))


def test_a_plan_is_drawn_and_a_motion_can_be_started_from(run, motion):
    motion.save("m.npz")
    options = ["--warm-start", "m.npz", "--picture", "poses.png"]
    code, out, _ = run("plan", "fig19", "--link-length", 430, *options)
    assert code == 0 and "solved" in " ".join(out.split()) and "Written: poses.png" in out
    assert Path("poses.png").read_bytes().startswith(b"\x89PNG")


QUICKLY = ["longest", "L", "--planner", "sweep", "--accuracy", "0.1"]


def test_longest_prints_what_each_length_needs_and_writes_what_is_asked_for(run):
    names = ["--out", "m.npz", "--plot", "l.png", "--state", "s.json", "--lengths", "200,600"]
    code, out, err = run(*QUICKLY, *names)
    assert (code, err) == (0, "")
    assert "longest link" in out and "with a validated motion" in out and "passes: sweep" in out
    assert "impossible" in out  # 600 is longer than any rod that passes
    written = ["l.png", "m.npz", "s.best.npz", "s.json"]
    assert all(f"Written: {name}" in out for name in written)
    assert sorted(path.name for path in Path().iterdir()) == written
    assert run("validate", "L", "m.npz")[0] == 0
    code, out, _ = run(*QUICKLY, "--state", "s.json", "--lengths", "200", "--json")
    data = json.loads(out)
    assert code == 0 and len(out.splitlines()) == 1 and data["complete"] and data["untried"] == []
    assert 0.9 < data["index"] <= 1.0 and data["length"] == Motion.load("m.npz").link_length
    assert [row["link_length"] for row in data["table"] if row["link_length"] == 200.0] == [200.0]


def test_longest_leaves_no_file_unless_asked(run):
    assert run(*QUICKLY)[0] == 0
    assert list(Path().iterdir()) == []


def test_longest_is_exit_code_3_where_no_length_passes(run):
    settings = ["--planner", "sweep", "--accuracy", 0.5, "--joint-limit", 1]
    code, out, _ = run("longest", "L", *settings, "--out", "m.npz", "--plot", "l.svg")
    assert code == 3 and "no length that was tried passes" in " ".join(out.split())
    assert sorted(path.name for path in Path().iterdir()) == ["l.svg"]


def test_ctrl_c_gives_the_longest_link_so_far(run, monkeypatch):
    calls = []

    def interrupted(*arguments, **settings):
        calls.append(arguments)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return plan(*arguments, **settings)

    monkeypatch.setattr("planners.longest.plan", interrupted)
    code, out, err = run(*QUICKLY, "--out", "m.npz")
    assert code == 130 and "the search was not over" in " ".join(out.split()) and "Written: m.npz" in out
    assert "not tried" in out and err == "hrsnake: stopped; no half-written file is left.\n"
    assert Motion.load("m.npz").link_length > 0.0


def test_simulate_writes_a_replay(run, motion):
    motion.save("m.npz")
    code, out, _ = run("simulate", "fig19", "m.npz", "--replay", "r.html")
    assert code == 0 and "Written: r.html" in out
    assert Path("r.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    code, out, _ = run("simulate", "fig19", "m.npz", "--replay", "r.html", "--json")
    assert json.loads(out)["replay"] == "r.html" and len(out.splitlines()) == 1


def test_draw_writes_a_picture(run, motion):
    motion.save("m.npz")
    code, out, _ = run("draw", "fig19", "m.npz", "--out", "p.svg")
    assert code == 0 and "Written: p.svg" in out
    assert Path("p.svg").read_text().startswith("<?xml")
    code, _, _ = run("draw", "fig19")
    assert code == 0 and Path("fig19.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in Path().iterdir()) == ["fig19.png", "m.npz", "p.svg"]


def test_demo_shows_the_benchmark_and_says_where_its_files_are(run):
    code, out, _ = run("demo")
    assert code == 0
    assert "clean: links merely pinch the walls" in out and "0.977" in out
    names = ["animation.gif", "five_poses.png", "geometry.png", "motion.npz", "verdict.json"]
    assert sorted(path.name for path in Path("demo").iterdir()) == names
    assert all(f"Written: {Path('demo') / name}" in out for name in names)
    assert Path("demo/animation.gif").read_bytes().startswith(b"GIF8")
    verdict = json.loads(Path("demo/verdict.json").read_text())
    assert verdict["success"] and verdict["verdict"]["clean"]
    assert Motion.load("demo/motion.npz").link_length == 430.0


def write_bad_files(motion):
    """Write the files that the table below speaks of."""
    motion.save("m.npz")
    Path("text.npz").write_text("not a motion")
    np.savez("other.npz", joints=np.zeros(3))
    Motion.from_configurations([0.0, 1.0], np.zeros((2, 3)), 100.0, (9.0, 9.0, 0.0)).save("foreign.npz")
    Path("broken.geojson").write_text("{")
    Path("list.geojson").write_text("[1, 2]")
    Path("other.json").write_text("[1, 2]")
    good = fig19().to_geojson()
    for name, change in {
        "base_out": lambda data: data["features"][1]["geometry"].update(coordinates=[-500, 5]),
        "goal_in_wall": lambda data: data["features"][2]["geometry"].update(coordinates=[120, 700]),
        "bow_tie": lambda data: data["features"][0]["geometry"].update(
            coordinates=[[[0, 0], [9, 9], [9, 0], [0, 9], [0, 0]]]
        ),
        "empty": lambda data: data["features"][0]["geometry"].update(coordinates=[]),
        "two_parts": lambda data: data["features"][0].update(
            geometry={
                "type": "MultiPolygon",
                "coordinates": [
                    [[[-100, 0], [100, 0], [100, 600], [-100, 600], [-100, 0]]],
                    [[[140, 0], [340, 0], [340, 900], [140, 900], [140, 0]]],
                ],
            }
        ),
    }.items():
        data = json.loads(json.dumps(good))
        change(data)
        Path(f"{name}.geojson").write_text(json.dumps(data))
    Path("a_file").write_text("")


BAD_INPUT = [
    (
        "plan fig20 --link-length 430",
        "Unknown maze 'fig20'. Available: fig19, fig17a, fig17b, fig17c, fig17d, L, U40",
    ),
    ("plan none.geojson --link-length 430", "Expected a maze file at 'none.geojson', but there is none."),
    ("plan broken.geojson --link-length 430", "Expected JSON in 'broken.geojson'"),
    ("plan list.geojson --link-length 430", "Expected a GeoJSON FeatureCollection, got 'list'."),
    ("plan bow_tie.geojson --link-length 430", "Expected a valid polygon as free space"),
    ("plan empty.geojson --link-length 430", "Expected finite Polygon coordinates in the 'free' feature"),
    ("plan base_out.geojson --link-length 430", "Expected the base inside the free space, got (-500, 5)"),
    (
        "plan goal_in_wall.geojson --link-length 430",
        "Expected the goal inside the free space, got (120, 700)",
    ),
    ("plan two_parts.geojson --link-length 430", "Expected a free way from the base to the goal"),
    ("plan fig19 --link-length 1596", "Expected one link length (1596 px) of straight free way"),
    ("plan fig19 --link-length 0", "Expected a positive, finite link_length, got 0.0."),
    ("plan fig19 --link-length -5", "Expected a positive, finite link_length, got -5.0."),
    ("plan fig19 --link-length nan", "Expected a positive, finite link_length, got nan."),
    ("plan fig19 --link-length 1e9", "Expected a link_length of at most the size of maze 'fig19'"),
    ("plan fig19 --link-length 430 --link-radius -1", "Expected link_radius of at least 0"),
    ("plan fig19 --link-length 430 --link-radius nan", "Expected link_radius of at least 0"),
    ("plan fig19 --link-length 430 --joint-limit 0", "Expected --joint-limit over 0 and at most 180 degrees"),
    ("plan fig19 --link-length 430 --links 4", "Expected at least"),
    ("plan fig19 --link-length 430 --links 0", "Expected n_links to be a whole number of at least 1"),
    ("plan fig19 --link-length 430 --planner best", "Unknown planner 'best'. Available: auto, beam"),
    ("plan fig19 --link-length 430 --out no/m.npz", "Expected an existing folder for 'no/m.npz'"),
    ("plan fig19 --link-length 430 --picture p.gif", "Expected a file name ending in .png, .svg, .pdf"),
    ("plan fig19 --link-length 430 --time-budget 0", "Expected a positive time_budget in seconds, got 0.0."),
    ("plan fig19 --link-length 430 --warm-start none.npz", "Expected a motion file at 'none.npz'"),
    (
        "plan fig19 --link-length 430 --warm-start foreign.npz",
        "Expected a motion from the base of maze 'fig19'",
    ),
    ("plan fig19 --link-length 420 --warm-start m.npz", "Expected a warm start with links of 420 px"),
    ("longest fig20", "Unknown maze 'fig20'. Available: fig19, fig17a, fig17b, fig17c, fig17d, L, U40"),
    ("longest fig19 --planner best", "Unknown planner 'best'. Available: auto, beam"),
    (
        "longest fig19 --lengths 100,long",
        "Expected lengths as numbers with commas between them (100,200,300)",
    ),
    ("longest fig19 --lengths 100,-5", "Expected positive, finite lengths, got -5.0."),
    ("longest fig19 --lengths nan", "Expected positive, finite lengths, got nan."),
    ("longest fig19 --accuracy 0", "Expected an accuracy between 0.0001 and 0.5, got 0.0."),
    ("longest fig19 --time-budget -1", "Expected a positive time_budget in seconds, got -1.0."),
    ("longest fig19 --link-radius -1", "Expected link_radius of at least 0"),
    ("longest fig19 --joint-limit 200", "Expected --joint-limit over 0 and at most 180 degrees"),
    ("longest fig19 --plot l.jpeg2", "Expected a file name ending in .png, .svg, .pdf, got 'l.jpeg2'."),
    ("longest fig19 --state no/s.json", "Expected an existing folder for 'no/s.json'"),
    ("longest fig19 --state s.txt", "Expected a file name ending in .json, got 's.txt'."),
    (
        "longest fig19 --state other.json",
        "Expected a state of `longest`, or a new file name, got 'other.json'",
    ),
    ("plan fig19 --link-length long", "Invalid value for '--link-length'"),
    ("plan fig19", "Missing option '--link-length'"),
    ("plan", "Missing argument 'MAZE'"),
    ("fly fig19", "No such command 'fly'"),
    ("plan fig19 --link-length 430 --fast", "No such option: --fast"),
    ("validate fig19 none.npz", "Expected a motion file at 'none.npz', but there is none."),
    ("validate fig19 text.npz", "Expected a motion (.npz) in 'text.npz', got a file that is not one."),
    ("validate fig19 other.npz", "Expected a motion in 'other.npz' with the keys joints, joint_angles"),
    ("validate fig19 foreign.npz", "Expected a motion from the base of maze 'fig19'"),
    ("simulate fig19 foreign.npz", "Expected a motion from the base of maze 'fig19'"),
    ("simulate fig19 m.npz --substeps 0", "Expected substeps to be a whole number of at least 1, got 0."),
    ("simulate fig19 m.npz --out no/a.gif", "Expected an existing folder for 'no/a.gif'"),
    ("simulate fig19 m.npz --replay r.gif", "Expected a file name ending in .html, got 'r.gif'."),
    ("draw fig19 foreign.npz", "Expected a motion from the base of maze 'fig19'"),
    ("draw fig19 --out p.jpeg2", "Expected a file name ending in .png, .svg, .pdf, got 'p.jpeg2'."),
    ("draw fig19 --link-radius 150", "Expected a maze with a path for links of radius 150"),
    ("demo --out no/demo", "Expected an existing folder for 'no/demo'"),
    ("demo --out a_file", "Expected a folder, but 'a_file' is a file."),
]


@pytest.mark.parametrize(("command", "sentence"), BAD_INPUT)
def test_bad_input_gets_one_sentence_exit_code_2_and_writes_nothing(command, sentence, run, motion):
    write_bad_files(motion)
    before = {path: path.stat().st_mtime_ns for path in Path().rglob("*")}
    code, out, err = run(*command.split())
    assert code == 2
    assert err.startswith("hrsnake: " + sentence)
    assert err.count("\n") == 1 and "Traceback" not in err and out == ""
    assert {path: path.stat().st_mtime_ns for path in Path().rglob("*")} == before


def test_a_folder_that_cannot_be_written_is_refused_before_the_work(run, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: False)  # permissions do not hold root back
    code, _, err = run("plan", "fig19", "--link-length", 430, "--out", "m.npz")
    assert code == 2 and err.startswith("hrsnake: Expected a folder that can be written")
    code, _, err = run("demo")
    assert code == 2 and err.startswith("hrsnake: Expected a folder that can be written")
    assert list(Path().iterdir()) == []


def test_a_full_disk_gets_one_sentence_too(run, monkeypatch):
    def fail(*arguments, **settings):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez_compressed", fail)
    code, _, err = run("plan", "fig19", "--link-length", 430, "--out", "m.npz")
    assert code == 2 and "No space left on device" in err and err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_ctrl_c_leaves_no_half_written_file(run, monkeypatch):
    def interrupt(*arguments, **settings):
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez_compressed", interrupt)
    code, _, err = run("plan", "fig19", "--link-length", 430, "--out", "m.npz")
    assert code == 130 and err == "hrsnake: stopped; no half-written file is left.\n"
    assert list(Path().iterdir()) == []


def test_the_installed_command_answers(tmp_path):
    command = Path(sys.executable).with_name("hrsnake")
    if not command.exists():
        pytest.skip("the package is not installed here")
    done = subprocess.run([command, "--help"], capture_output=True, text=True)
    assert done.returncode == 0
    assert all(name in done.stdout for name in ("plan", "longest", "validate", "simulate", "draw", "demo"))
    done = subprocess.run([command, "plan", "nowhere", "--link-length", "1"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (2, "")


def test_a_maze_file_is_planned_like_a_named_maze(run):
    Maze.load("U200").save("mine.geojson")
    code, out, _ = run("plan", "mine.geojson", "--link-length", 300, "--json")
    named = run("plan", "U200", "--link-length", 300, "--json")
    assert code == named[0] == 0
    assert json.loads(out)["n_poses"] == json.loads(named[1])["n_poses"]


def commands(group=None, path=()):
    """Yield each command with its name."""
    for name, command in (group or typer.main.get_command(app)).commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*path, name))
        else:
            yield (*path, name), command


def examples():
    """Yield the commands that help pages, the README and docs/ show, with where they do."""
    for name, command in commands():
        for line in (command.epilog or "").splitlines():
            yield " ".join(name), line.strip()
    root = Path(__file__).parent.parent
    for page in (root / "README.md", *sorted((root / "docs").glob("*.md"))):
        text = page.read_text().replace("\\\n", " ")
        for line in re.findall(r"^(?:    |\$ )(hrsnake .*)$", text, flags=re.MULTILINE):
            yield page.name, line


def test_every_example_is_a_command_that_is_understood():
    shown = [(where, line) for where, line in examples() if line.startswith("hrsnake ")]
    named = dict(commands())
    assert len(shown) >= 50
    for where, line in shown:
        words = shlex.split(line, comments=True)[1:]
        name = max((name for name in named if words[: len(name)] == [*name]), key=len, default=None)
        assert name is not None, (where, line)
        context = named[name].make_context(name[-1], words[len(name) :])
        assert context.command is named[name], (where, line)


def test_the_shell_completes_mazes_files_and_planners(run, monkeypatch):
    Path("figures.geojson").write_text("{}")
    monkeypatch.setenv("_HRSNAKE_COMPLETE", "complete_bash")

    def completed(line):
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", str(len(line.split(" ")) - 1))
        return run()[1].split()

    assert completed("hrsnake plan fig1") == ["fig19", "fig17a", "fig17b", "fig17c", "fig17d"]
    assert completed("hrsnake plan figu") == ["figures.geojson"]
    assert completed("hrsnake plan fig19 --planner as") == ["as-printed"]


def test_a_map_that_is_given_as_a_maze_is_to_be_imported_first(run):
    Path("duct.svg").write_text("<svg/>")
    code, _, err = run("plan", "duct.svg", "--link-length", 1)
    assert code == 2 and "`hrsnake import duct.svg --out maze.geojson`" in err
