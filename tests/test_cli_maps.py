"""`hrsnake import` as a user meets it: what is printed, drawn and written, exit codes, errors."""

import json
import math
import shutil
import sys
from pathlib import Path

import pytest
import typer

from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners import plan
from planners.cli import main
from planners.cli_maps import import_command

SAMPLES = Path(__file__).parent / "maps"
ENDS = ("--base", "-0.9,0,0", "--goal", "3,-0.3")


@pytest.fixture(autouse=True)
def in_a_folder_with_a_map(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("ros_house.yaml", "ros_house.pgm", "image_house.png"):
        shutil.copy(SAMPLES / name, tmp_path)


@pytest.fixture
def run(capsys, monkeypatch):
    """Return a function that runs `hrsnake import` and returns exit code, stdout and stderr."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.callback()(lambda: None)
    app.command("import")(import_command)
    monkeypatch.setattr("planners.cli.app", app)

    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", "import", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        output = capsys.readouterr()
        return ended.value.code or 0, output.out, output.err

    return run_command


def test_a_map_becomes_a_maze_that_can_be_planned_in(run):
    code, out, err = run("ros_house.yaml", *ENDS, "--out", "m.geojson", "--picture", "m.png")
    assert (code, err) == (0, "")
    for text in ("ROS map, mode trinary", "PGM image of 96 x 64 pixels", "4.3 x 2.7 m", "straight way"):
        assert text in out
    for name in ("m.geojson", "m.png"):
        assert f"Written: {name}" in out and Path(name).stat().st_size > 1000
    command = next(line for line in out.splitlines() if line.startswith("Next: "))
    length = float(command.split("hrsnake plan m.geojson --link-length ")[1])
    assert plan(Maze.load("m.geojson"), ArmSpec(link_length=length)).solved


def test_a_map_that_says_both_ends_only_lacks_a_name_for_the_maze(run):
    code, out, err = run("ros_house.yaml", *ENDS)
    assert (code, err) == (0, "") and "Next: the same command with --out ros_house.geojson" in out


def test_without_base_and_goal_the_map_is_shown_all_the_same(run):
    code, out, err = run("image_house.png", "--picture", "m.png")
    assert (code, err) == (0, "") and Path("m.png").stat().st_size > 1000
    assert "not said: give --base X,Y,DEG" in out and "not said: give --goal X,Y" in out
    assert "Next: the same command with --base X,Y,DEG --goal X,Y --out image_house.geojson" in out


def test_a_maze_without_base_is_refused_after_the_picture_was_drawn(run):
    code, out, err = run("image_house.png", "--picture", "m.png", "--out", "m.geojson", "--goal", "80,50")
    assert (code, out) == (2, "") and "Expected a base, but map 'image_house'" in err
    assert Path("m.png").exists() and not Path("m.geojson").exists()


def test_a_base_in_a_wall_is_refused_and_drawn(run):
    code, _, err = run("ros_house.yaml", "--base", "0,50,0", "--goal", "3,0", "--picture", "m.png")
    assert code == 2 and err.count("\n") == 1 and "behind a wall" in err
    assert Path("m.png").exists()


def test_json_is_one_object_with_what_was_understood(run):
    code, out, _ = run("ros_house.yaml", *ENDS, "--goal-radius", 0.1, "--out", "m.geojson", "--json")
    data = json.loads(out)
    assert code == 0 and out.count("\n") == 1
    assert data["base"] == {"x": -0.9, "y": 0.0, "heading_deg": 0.0}
    assert data["goal"] == {"x": 3.0, "y": -0.3, "radius": 0.1}
    assert (data["units"], data["out"], data["picture"]) == ("m", "m.geojson", None)
    assert 0.0 < data["moved"] <= data["tolerance"] == pytest.approx(0.075)
    code, out, _ = run("image_house.png", "--json")
    assert code == 0 and json.loads(out)["base"] is None


def test_options_reach_the_reader(run):
    options = ("--units", "mm", "--tolerance", 0, "--unknown-is-free", "--json")
    data = json.loads(run("ros_house.yaml", *options)[1])
    assert data["units"] == "mm" and data["moved"] == 0.0 and data["parts"] == 2
    options = ("--resolution", 2, "--scale", 5, "--threshold", 0.5, "--json")
    data = json.loads(run("image_house.png", *options)[1])
    assert data["bounds"] == [0.0, 0.0, 960.0, 640.0]
    inverted = json.loads(run("image_house.png", "--invert", "--json")[1])
    assert inverted["area"] < 0.1 * data["area"] / 100


def test_a_heading_is_given_in_degrees(run):
    assert run("image_house.png", "--base", "8,8,90", "--goal", "85,55", "--out", "m.geojson")[0] == 0
    assert Maze.load("m.geojson").base_pose[2] == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("none.png",), "there is none"),
        (("plan.pdf",), "Unknown kind of map"),
        (("image_house.png", "--base", "1,2"), "--base as X,Y,DEG"),
        (("image_house.png", "--base", "1,2,nan"), "--base as X,Y,DEG"),
        (("image_house.png", "--goal", "here"), "--goal as X,Y"),
        (("image_house.png", "--tolerance", -1), "tolerance"),
        (("image_house.png", "--threshold", 7), "threshold"),
        (("image_house.png", "--scale", 0), "scale"),
        (("image_house.png", "--out", "m.npz"), ".geojson"),
        (("image_house.png", "--picture", "no/m.png"), "existing folder"),
        (("image_house.png", "--picture", "m.exe"), ".png"),
        (("image_house.png", "--base", "8,8,0", "--goal", "8,8"), "away from the base"),
        (("image_house.png", "--base", "8,8,0", "--goal", "50,50", "--goal-radius", -1), "goal radius"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(run, arguments, complaint):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "") and err.count("\n") == 1 and complaint in err


def test_the_help_text_groups_the_options_and_gives_examples(run):
    code, out, _ = run("--help")
    assert code == 0
    for text in ("Base and goal", "Images and ROS maps", "SVG, DXF, GeoJSON", "hrsnake import map.yaml"):
        assert text in out
