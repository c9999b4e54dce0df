"""The commands of `hrsnake spatial` as a user meets them: outcomes, exit codes, one sentence for errors."""

import json
import sys

import numpy as np
import pytest

from hrsnake_env.arm import ArmSpec
from planners.cli import main
from planners.spatial import SpatialMotion, Workspace, load_workspace, longest, plan


def small_room(**changes):
    """Return a room with one box between the base and the goal, as plain data."""
    data = {
        "type": "hrsnake workspace",
        "name": "small",
        "units": "mm",
        "room": {"low": [0, 0, 0], "high": [200, 100, 100], "open": ["x-"]},
        "boxes": [{"low": [80, 0, 0], "high": [110, 70, 100]}],
        "base": {"position": [0, 50, 50], "heading": [1, 0, 0], "straight": 30},
        "goal": {"position": [170, 40, 40], "radius": 3},
    }
    return {**data, **changes}


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def room(tmp_path):
    """Write the small room, and return its workspace."""
    workspace = Workspace.from_dict(small_room())
    workspace.save(tmp_path / "small.json")
    return workspace


@pytest.fixture
def run(capsys, monkeypatch):
    """Return a function that runs `hrsnake spatial` and returns exit code, stdout and stderr."""

    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", "spatial", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        output = capsys.readouterr()
        return ended.value.code or 0, output.out, output.err

    return run_command


def test_plan_writes_a_motion_a_picture_and_a_page_and_the_motion_validates(run, room, tmp_path):
    wanted = ("--out", "m.npz", "--picture", "m.png", "--page", "m.html")
    code, out, err = run("plan", "small.json", "--link-length", 30, *wanted)
    assert (code, err) == (0, "")
    assert "solved" in out and "links of 30 mm" in out
    for name in ("m.npz", "m.png", "m.html"):
        assert f"Written: {name}" in out and (tmp_path / name).stat().st_size > 1000
    code, out, _ = run("validate", "small.json", "m.npz")
    assert code == 0 and "valid" in out and "NOT VALID" not in out
    code, out, _ = run("draw", "small.json", "m.npz", "--out", "again.png")
    assert code == 0 and (tmp_path / "again.png").stat().st_size > 1000


def test_json_is_one_object_on_one_line(run, room):
    code, out, _ = run("plan", "small.json", "--link-length", 30, "--json")
    data = json.loads(out)
    assert code == 0 and out.count("\n") == 1
    assert (
        data["status"] == "solved"
        and data["validation"]["valid"]
        and data["validation"]["penetration"] == 0.0
    )


def test_a_radius_and_a_joint_limit_reach_planner_and_checker(run, room):
    arm = ("--link-radius", 4, "--joint-limit", 80)
    code, _, _ = run("plan", "small.json", "--link-length", 30, *arm, "--out", "m.npz")
    assert code == 0
    assert run("validate", "small.json", "m.npz", *arm)[0] == 0
    motion = SpatialMotion.load("m.npz")
    bend = float(np.hypot(*np.moveaxis(motion.joint_angles, -1, 0)).max())
    code, out, _ = run("validate", "small.json", "m.npz", "--joint-limit", np.degrees(bend) - 1.0)
    assert code == 3 and "joint limit" in out


def test_no_plan_says_why_and_where_and_ends_with_3(run, room, tmp_path):
    wall = small_room(boxes=[{"low": [80, 0, 0], "high": [110, 100, 100]}])
    (tmp_path / "wall.json").write_text(json.dumps(wall))
    code, out, _ = run("plan", "wall.json", "--link-length", 30, "--out", "m.npz")
    assert code == 3 and "no path" in out and "Nothing written to m.npz" in out
    assert not (tmp_path / "m.npz").exists()
    code, out, _ = run("plan", "small.json", "--link-length", 150, "--json")
    data = json.loads(out)
    assert code == 3 and data["status"] == "dead end" and len(data["place"]) == 3 and data["depth"] > 0.0


def test_a_motion_in_an_obstacle_ends_validation_with_3(run, room, tmp_path):
    straight = SpatialMotion.from_configurations(
        np.arange(0.0, 120.5, 1.0), np.zeros((121, 4, 2)), 30.0, room.base_pose_for(30.0)
    )
    straight.save(tmp_path / "m.npz")
    code, out, _ = run("validate", "small.json", "m.npz")
    assert code == 3 and "NOT VALID" in out and "deep in an obstacle" in " ".join(out.split())


def test_longest_is_found_and_its_motion_written(run, room, tmp_path, monkeypatch):
    for name, value in (("SHORTEST", 0.05), ("STEP", 1.3), ("BEYOND", 1)):  # few and large steps
        monkeypatch.setattr(longest, name, value)
    code, out, _ = run("longest", "small.json", "--accuracy", 0.1, "--out", "m.npz", "--json")
    data = json.loads(out)
    motion = SpatialMotion.load(tmp_path / "m.npz")
    assert code == 0 and data["complete"] and motion.link_length == data["length"] > 30.0
    assert plan(room, ArmSpec(link_length=data["length"])).solved
    solved = [trial["link_length"] for trial in data["trials"] if trial["status"] == "solved"]
    assert max(solved) == data["length"]


def test_a_named_workspace_can_be_written_to_begin_from(run, tmp_path):
    assert run("save", "paired-panels", "room.json")[0] == 0
    assert Workspace.load(tmp_path / "room.json").to_dict() == load_workspace("paired-panels").to_dict()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"boxes": [{"low": [110, 0, 0], "high": [80, 70, 100]}]}, "it is inside out or has no thickness"),
        ({"goal": {"position": [90, 40, 40], "radius": 3}}, "Expected a goal in the free space"),
        (
            {"base": {"position": [90, 50, 50], "heading": [1, 0, 0], "straight": 30}},
            "Expected a base in the free",
        ),
        ({"base": {"position": [0, 50, 50], "heading": [0, 0, 0], "straight": 30}}, "heading"),
        ({"goal": {"position": [90, 40], "radius": 3}}, "three"),
        ({"walls": []}, "Unknown key 'walls' of a workspace"),
        ({"type": "FeatureCollection"}, 'Expected a workspace with "type": "hrsnake workspace"'),
    ],
)
def test_a_bad_workspace_is_one_sentence_and_code_2(run, tmp_path, changes, message):
    (tmp_path / "bad.json").write_text(json.dumps(small_room(**changes)))
    code, out, err = run("plan", "bad.json", "--link-length", 30)
    assert (code, out) == (2, "")
    assert message in err and err.count("\n") == 1 and "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("plan", "small.json", "--link-length", 0), "positive, finite link_length"),
        (("plan", "small.json", "--link-length", 30, "--planner", "beam"), "Unknown planner 'beam'"),
        (("plan", "small.json", "--link-length", 30, "--links", 2), "Expected at least"),
        (("plan", "small.json", "--link-length", 30, "--out", "m.txt"), "ending in .npz"),
        (("plan", "small.json", "--link-length", 30, "--page", "none/m.html"), "existing folder"),
        (("plan", "small.json", "--link-length", 1000), "at most the size of workspace 'small'"),
        (("plan", "closed.json", "--link-length", 31), "as the straight feed allows"),
        (("plan", "nowhere.json", "--link-length", 30), "Expected a workspace file at 'nowhere.json'"),
        (("plan", "fig19", "--link-length", 30), "Unknown workspace 'fig19'"),
        (("validate", "small.json", "m.npz"), "Expected a motion file at 'm.npz'"),
        (("validate", "small.json", "plane.npz"), "got one in the plane"),
        (("validate", "small.json", "other.npz"), "it belongs to another workspace"),
        (("draw", "small.json", "other.npz"), "--out"),
        (("longest", "small.json", "--accuracy", 0), "accuracy"),
    ],
)
def test_bad_input_is_one_sentence_and_code_2(run, room, tmp_path, arguments, message):
    closed = small_room(room={"low": [0, 0, 0], "high": [200, 100, 100]})
    (tmp_path / "closed.json").write_text(json.dumps(closed))
    feed, angles = [0.0, 1.0], np.zeros((2, 1, 2))
    SpatialMotion.from_configurations(feed, angles, 30.0, [0, 0, 0, 1, 0, 0]).save(tmp_path / "other.npz")
    np.savez(
        tmp_path / "plane.npz", joints=np.zeros((2, 2, 2)), joint_angles=np.zeros((2, 1)), feed=feed,
        link_length=30.0, base_pose=np.zeros(3),
    )  # fmt: skip
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert message in err and err.count("\n") == 1 and "Traceback" not in err


def test_the_papers_figures_are_drawn_with_one_page(run, tmp_path):
    code, out, _ = run("figures", "--out", "figures")
    assert code == 0 and "Written: figures/spatial.html" in out
    rows = json.loads((tmp_path / "figures" / "figures.json").read_text())
    assert 1450.0 <= rows["path_length"] <= 1470.0
    short, longer, collides, tracked = rows["figures"]
    assert (short["n_links"], short["depth"]) == (182, 0.0) and (longer["n_links"], longer["depth"]) == (
        49,
        0.0,
    )
    assert collides["depth"] == pytest.approx(23.9, abs=0.3) and collides["poses_that_collide"] > 500
    assert tracked["valid"] and tracked["n_links"] == 15 and tracked["poses_that_collide"] == 0
    for stem in ("fig20", "fig21", "fig22", "tracked"):
        assert (tmp_path / "figures" / f"{stem}.png").read_bytes().startswith(b"\x89PNG")
        assert SpatialMotion.load(tmp_path / "figures" / f"{stem}.npz").n_poses > 100
