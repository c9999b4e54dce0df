"""Laws of reading: whatever a file or a request holds, it is read, or refused with one sentence."""

from __future__ import annotations

import base64
import json
import pickle
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.trust import file_readers, mutations
from benchmarks.trust.file_readers import PLANTED, READERS, Planted
from benchmarks.trust.fuzz_files import fault_of, watched
from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners import validate
from planners.cli import main
from planners.problem import Motion
from planners.reading import NotReadable, read_arrays, read_json, shown
from planners.rl.network import NetworkPolicy
from planners.rl.settings import load_settings

HEAVY = ("models in checkpoints",)
"""They need what only some machines have, and much time at first."""


@pytest.fixture(scope="module")
def folder():
    """Return an empty folder; what takes too long there is ended."""
    with watched() as path:
        yield path


@pytest.mark.parametrize("name", [name for name in READERS if name not in HEAVY])
def test_no_input_does_more_than_be_read_or_refused(name, folder):
    reader = READERS[name]

    @settings(max_examples=25)
    @given(st.integers(0, 2**32 - 1))
    def holds(seed):
        data = reader.draw(np.random.default_rng(seed))
        assert fault_of(reader, data, folder) == ""

    holds()


def test_no_checkpoint_does_more_than_be_read_or_refused(folder):
    pytest.importorskip("stable_baselines3")
    reader = READERS["models in checkpoints"]
    for seed in range(20):
        assert fault_of(reader, reader.draw(np.random.default_rng(seed)), folder) == ""


# Archives


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: _flipped(data, 0.5),
        lambda data: _flipped(data, 0.7),
        lambda data: _with_header(data, 8, 1),  # encrypted, it says
        lambda data: _with_header(data, 10, 99),  # packed in an unknown way
        lambda data: _with_header(data, 10, 12),  # bzip2
    ],
)
def test_a_damaged_archive_is_refused(damage, tmp_path):
    path = tmp_path / "m.npz"
    file_readers.bend_motion().save(path)
    path.write_bytes(damage(path.read_bytes()))
    try:
        read_arrays(path)
    except NotReadable as got:
        assert str(got) == "a file that is not one"


def _flipped(data, share):
    place = int(share * len(data))
    return data[:place] + bytes([data[place] ^ 255]) + data[place + 1 :]


def _with_header(data, offset, value):
    place = data.find(b"PK\x01\x02") + offset
    return data[:place] + bytes([value]) + data[place + 1 :]


@pytest.mark.parametrize("load", [Motion.load, NetworkPolicy.load])
def test_a_small_file_with_very_many_zeros_is_refused_before_it_is_unpacked(load, tmp_path, monkeypatch):
    monkeypatch.setattr("planners.problem.MOTION_BYTES", 256 * 2**20)  # a motion may take more
    path = tmp_path / "bomb.npz"
    path.write_bytes(file_readers.bomb("joints"))
    assert path.stat().st_size < 2**22
    with pytest.raises(InputError, match="got one of more than 256 MiB when it is unpacked"):
        load(path)


def test_an_archive_of_very_many_members_is_refused(tmp_path):
    path = tmp_path / "many.npz"
    path.write_bytes(mutations.packed({f"{number}.npy": b"" for number in range(1001)}, zipfile.ZIP_STORED))
    with pytest.raises(NotReadable, match="more than 1000 members"):
        read_arrays(path)


def test_brackets_without_end_are_no_json(tmp_path):
    path = tmp_path / "deep.json"
    path.write_bytes(b"[" * 200_000)
    with pytest.raises(NotReadable, match="a file that is not"):
        read_json(path)


def test_a_value_is_shown_in_few_characters_however_much_refers_to_itself():
    value = ["x"]
    for _ in range(60):
        value = [value] * 9
    for each in (value, "a" * 10**6, 10**5000, {"k": value}):
        assert len(shown(each)) <= 60
    assert shown([1]) == "[1]" and shown("a") == "'a'"


def test_a_few_lines_of_settings_that_stand_for_a_hundred_million_values_are_refused(tmp_path):
    path = tmp_path / "s.yml"
    path.write_text(f"{file_readers.LAUGHS}default: {{n_timesteps: 1, gamma: *i}}\n")
    with pytest.raises(InputError, match="Expected at most 20000 values"):
        load_settings("ppo", file_readers.STRAIGHT, file=path)


def test_settings_may_refer_to_others(tmp_path):
    path = tmp_path / "s.yml"
    path.write_text(file_readers.SETTINGS.replace("!!float 1e5", "100"))
    assert load_settings("ppo", file_readers.STRAIGHT, file=path).n_timesteps == 1000


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("env_kwargs", {"n_links": 10**6}),
        ("env_kwargs", {"substeps": 10**9}),
        ("wrappers", [["planners.wrappers.ActionRepeat", {"repeat": 10**9}]]),
    ],
)
def test_a_policy_asks_for_no_environment_without_end(key, value, tmp_path):
    arrays = dict(file_readers._policy_arrays())
    meta = json.loads(str(arrays["meta"]))
    meta["origin"][key] = value
    np.savez(tmp_path / "p.npz", **{**arrays, "meta": np.array(json.dumps(meta))})
    with pytest.raises(InputError, match=r"Expected .* of at most \d+ for a policy"):
        NetworkPolicy.load(tmp_path / "p.npz")


# Pickles


def test_what_is_planted_is_run_by_whoever_unpickles_it():
    try:
        pickle.loads(pickle.dumps(Planted())).close()
        assert PLANTED.exists()
    finally:
        PLANTED.unlink(missing_ok=True)


def test_nothing_that_stable_baselines_would_unpickle_is_run(tmp_path):
    pytest.importorskip("stable_baselines3")
    from planners.rl.checkpoints import read_model, restore

    outer, inner = (dict(members) for members in file_readers._checkpoint())
    data = json.loads(inner["data"])
    planted = {":type:": "x", ":serialized:": base64.b64encode(pickle.dumps(Planted())).decode()}
    inner["data"] = json.dumps({key: planted if isinstance(data[key], dict) else data[key] for key in data})
    outer["model.zip"] = mutations.packed(inner)
    path = tmp_path / "checkpoint.zip"
    path.write_bytes(mutations.packed(outer))
    model = read_model(path, lambda file: restore(file_readers._model(), file))
    assert model is file_readers._model() and not PLANTED.exists()


def test_a_pickled_replay_buffer_is_refused(tmp_path):
    from planners.rl.checkpoints import read_model

    path = tmp_path / "checkpoint.zip"
    path.write_bytes(mutations.packed({"model.zip": b"x", "replay_buffer.pkl": pickle.dumps(Planted())}))
    with pytest.raises(InputError, match="an old version, whose replay buffer is pickled"):
        read_model(path, lambda file: file)
    assert not PLANTED.exists()


# The arm of a motion


@pytest.fixture
def in_folder(tmp_path, monkeypatch):
    """Go to a folder with a maze and a motion of thick links."""
    monkeypatch.chdir(tmp_path)
    file_readers.bend().save("bend.geojson")
    file_readers.bend_motion().save("m.npz")
    return tmp_path


def test_a_motion_file_says_of_which_arm_it_is(in_folder):
    again = Motion.load("m.npz")
    assert (again.link_radius, again.joint_limit) == (8.0, 2.0)
    longer = again.with_links(again.n_links + 2)
    assert (longer.link_radius, longer.joint_limit, longer.arm.n_links) == (8.0, 2.0, again.n_links + 2)


def test_a_motion_file_of_a_thin_arm_is_as_it_always_was(in_folder):
    file_readers.bend_motion().of_arm(ArmSpec(link_length=300.0)).save("thin.npz")
    assert sorted(np.load("thin.npz")) == ["base_pose", "feed", "joint_angles", "joints", "link_length"]
    thin = Motion.load("thin.npz")
    assert (thin.link_radius, thin.joint_limit) == (0.0, None)


def test_a_motion_is_checked_as_of_its_own_arm():
    motion, maze = file_readers.bend_motion(), file_readers.bend()
    assert validate(motion, maze) == validate(motion, maze, motion.arm)
    fat = motion.of_arm(ArmSpec(link_length=300.0, link_radius=60.0, joint_limit=0.01))
    assert {"penetration", "joint limit"} <= {fault.kind for fault in validate(fat, maze).faults}


@pytest.mark.parametrize(
    "value", [np.array([1.0, 2.0]), np.array("a"), np.array(200.0), np.array(-1.0), np.nan]
)
def test_a_motion_of_no_possible_arm_is_refused(value, in_folder):
    with np.load("m.npz") as arrays:
        np.savez("other.npz", **{**arrays, "link_radius": value})
    with pytest.raises(InputError, match=r"link_radius|motion of numbers"):
        Motion.load("other.npz")


VALIDATE = ("validate", "bend.geojson", "m.npz")


def called(monkeypatch, capsys, *arguments):
    """Run the command line; return its exit code, stdout and stderr."""
    monkeypatch.setattr("sys.argv", ["hrsnake", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    return ended.value.code, *capsys.readouterr()


def test_the_commands_take_the_arm_from_the_motion(in_folder, monkeypatch, capsys):
    code, own, err = called(monkeypatch, capsys, *VALIDATE, "--json")
    assert code == 0 and not err
    code, same, err = called(
        monkeypatch, capsys, "validate", "bend.geojson", "m.npz", "--link-radius", "8", "--json"
    )
    assert code == 0 and same == own and not err
    code, thick, err = called(
        monkeypatch, capsys, "validate", "bend.geojson", "m.npz", "--link-radius", "80", "--json"
    )
    assert code == 3 and thick != own
    assert err == "Note: --link-radius 80 is used; the motion was made for links of radius 8.\n"
    code, _, err = called(monkeypatch, capsys, *VALIDATE, "--joint-limit", "10")
    assert code == 3 and "with joints of 114.592 degrees" in err
    code, _, err = called(monkeypatch, capsys, "export", "bend.geojson", "m.npz", "--out", "m.csv", "--json")
    assert code == 0 and not err


def test_a_motion_in_space_says_of_which_arm_it_is(tmp_path):
    from planners.spatial.problem import SpatialMotion

    values = {key: array for key, array in file_readers._spatial_arrays().items()}
    motion = SpatialMotion(**{**values, "link_length": 90.0, "link_radius": 1.0, "joint_limit": 2.0})
    motion.save(tmp_path / "m.npz")
    again = SpatialMotion.load(tmp_path / "m.npz")
    assert (again.link_radius, again.joint_limit) == (1.0, 2.0)
    assert again.with_links(again.n_links + 1).arm.link_radius == 1.0


@pytest.mark.parametrize("name", ["motions", "policies", "workspaces"])
def test_a_broken_file_is_bad_input_for_the_command_line(name, in_folder, monkeypatch, capsys):
    command = {
        "motions": ("validate", "bend.geojson", "broken"),
        "policies": ("evaluate", "broken", "--episodes", "1"),
        "workspaces": ("spatial", "validate", "broken.json", "m.npz"),
    }[name]
    path = in_folder / ("broken.json" if name == "workspaces" else "broken")
    path.write_bytes(_flipped(file_readers._motion_bytes(), 0.5))
    code, out, err = called(monkeypatch, capsys, *command)
    assert code == 2 and not out and err.startswith("hrsnake: Expected") and err.count("\n") == 1


def test_a_device_is_no_file():
    with pytest.raises(NotReadable, match="a folder or a device"):
        read_arrays("/dev/null")


def test_a_name_that_is_too_long_is_no_maze():
    with pytest.raises(InputError, match="Unknown maze"):
        Maze.load("a" * 5000)


def test_a_map_whose_name_has_line_breaks_gets_one_sentence():
    from hrsnake_env.maps import read_map

    with pytest.raises(InputError) as raised:
        read_map("\n\r", files=lambda name: b"")
    assert "\n" not in str(raised.value)
