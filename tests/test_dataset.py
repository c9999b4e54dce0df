"""Laws of the demonstrations, and of the data sets that hold them."""

import json
import os
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from hrsnake_env import InputError
from planners import cli
from planners.dataset import dataset_ids, record_dataset
from planners.dataset_writer import DatasetWriter
from planners.demonstrator import Demonstrator

minari = pytest.importorskip("minari")

STRAIGHT = "HyperRedundantMaze-Straight-v0"
BEND = "HyperRedundantMaze-Bend-I30-v0"
TIGHT = "HyperRedundantMaze-UTurn-I98-v0"
RANDOM = "HyperRedundantMaze-RandomTrain-v0"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Return an empty folder of data sets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def run(capsys, monkeypatch):
    """Return a function that runs a command and returns exit code, stdout and stderr."""

    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", "dataset", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        output = capsys.readouterr()
        return ended.value.code or 0, output.out, output.err

    return run_command


def metadata(dataset):
    return list(dataset.storage.get_episode_metadata(dataset.episode_indices))


def demonstrate(env_id, noise, seed=0):
    """Return the last info and the number of steps of a demonstration."""
    env = gym.make(f"hrsnake_env:{env_id}")
    demonstrator, rng = Demonstrator(env), np.random.default_rng(seed)
    env.reset(seed=seed)
    assert demonstrator.begin()
    for n in range(1, 100_000):
        action = demonstrator.action()
        action = demonstrator.noisy(action, noise * rng.standard_normal(len(action)))
        assert env.action_space.contains(action)
        _, _, terminated, truncated, info = env.step(action)
        if terminated or truncated:
            return info, n
    raise AssertionError


@pytest.mark.parametrize("env_id", [BEND, TIGHT, "HyperRedundantMaze-Zigzag-I80-v0", RANDOM])
def test_the_demonstrator_reaches_the_goal(env_id):
    assert demonstrate(env_id, 0.0)[0]["success"]


@pytest.mark.parametrize("env_id", [BEND, TIGHT])
def test_the_demonstrator_reaches_the_goal_in_spite_of_noise(env_id):
    infos = [demonstrate(env_id, 0.3, seed)[0] for seed in range(4)]
    assert all(info["success"] for info in infos)


def test_the_demonstrator_leads_an_arm_back_that_was_pushed_off():
    env = gym.make(f"hrsnake_env:{BEND}").unwrapped
    demonstrator = Demonstrator(env)
    env.reset()
    demonstrator.begin()
    for _ in range(120):
        env.step(demonstrator.action())
    planned, off = env.target, np.array([0.0, 0.6, -0.6, 0.6, -0.6])
    for _ in range(4):
        env.step(off)
    strayed = np.abs(env.target - planned)[1:].max()
    for _ in range(10):
        env.step(demonstrator.action())
    place = env.target / demonstrator._steps
    assert strayed > 0.1  # rad
    assert np.abs(demonstrator._poses - place).max(axis=1).min() < 1e-3  # shares of an action


def test_motions_of_the_demonstrator_keep_off_the_walls_where_there_is_room():
    env = gym.make(f"hrsnake_env:{BEND}").unwrapped
    demonstrator, clearances, over = Demonstrator(env), [], False
    env.reset()
    demonstrator.begin()
    while not over:
        _, _, over, _, info = env.step(demonstrator.action())
        # A joint that has just come out of the feeder is near to the wall beside the base.
        if info["feed"] % env.arm.link_length > 0.15 * env.arm.link_length:
            clearances.append(info["clearance"])
    assert len(clearances) > 100 and min(clearances) > 0.09 * env.arm.link_length


def test_absolute_actions_are_refused():
    with pytest.raises(InputError, match="Expected an environment with action='delta', got 'absolute'"):
        Demonstrator(gym.make(f"hrsnake_env:{BEND}", action="absolute"))


def test_a_data_set_loads_and_replays_to_the_last_bit():
    recording = record_dataset("arm/bend-v0", BEND, episodes=2, noises=(0.0, 0.5))
    dataset = minari.load_dataset("arm/bend-v0")
    assert dataset.total_episodes == recording.n_episodes == 3
    assert dataset.total_steps == recording.n_steps
    env = dataset.recover_environment()
    for episode, facts in zip(dataset, metadata(dataset), strict=True):
        observation, info = env.reset(seed=facts["seed"])
        observations, rewards, infos = [observation], [], [info]
        for action in episode.actions:
            observation, reward, terminated, truncated, info = env.step(action)
            observations.append(observation)
            rewards.append(reward)
            infos.append(info)
        np.testing.assert_array_equal(np.array(observations), episode.observations)
        np.testing.assert_array_equal(rewards, episode.rewards)
        np.testing.assert_array_equal([one["joint_torques"] for one in infos], episode.infos["joint_torques"])
        assert (terminated, truncated) == (episode.terminations[-1], episode.truncations[-1])
        assert facts["success"] == info["success"]


def test_scores_run_from_random_actions_to_the_planner():
    recording = record_dataset("straight-v0", STRAIGHT, episodes=3, noises=(0.0,))
    dataset = minari.load_dataset("straight-v0")
    assert dataset.total_episodes == 1
    score = minari.get_normalized_score(dataset, dataset[0].rewards.sum())
    assert score == pytest.approx(1.0, abs=1e-12)
    assert minari.get_normalized_score(dataset, recording.random_return) == 0.0
    assert recording.random_return < recording.expert_return


def test_the_planners_own_action_stands_beside_the_one_taken():
    record_dataset("bend-v0", BEND, episodes=1, noises=(0.0, 0.4))
    noiseless, noisy = minari.load_dataset("bend-v0")
    np.testing.assert_array_equal(noiseless.infos["expert_action"][1:], noiseless.actions)
    added = noisy.actions - noisy.infos["expert_action"][1:]
    assert not noisy.infos["expert_action"][0].any()
    # Of what was added, some is cut at 1, and never more than noise is.
    assert 0.2 < added.std() < 0.4


def test_noise_levels_see_the_same_random_mazes_and_are_written_down():
    recording = record_dataset("random-v0", RANDOM, episodes=2, noises=(0.0, 0.2), seed=3)
    facts = metadata(minari.load_dataset("random-v0"))
    assert [one["noise"] for one in facts] == [0.0, 0.2, 0.0, 0.2]
    assert [one["seed"] for one in facts] == [3, 3, 4, 4]
    tasks = [one["task_id"] for one in facts]
    assert tasks[0] == tasks[1] != tasks[2] == tasks[3]
    assert recording.successes == {
        level: [bool(one["success"]) for one in facts if one["noise"] == level] for level in (0.0, 0.2)
    }


def test_other_mazes_for_the_same_arm_are_options_of_the_reset():
    record_dataset("many-v0", BEND, episodes=1, noises=(0.0,), mazes=["bend-i30", "u-turn-i30"])
    facts = metadata(minari.load_dataset("many-v0"))
    assert [one["maze"] for one in facts] == ["bend-i30", "u-turn-i30"]
    assert [one["options"]["maze"] for one in facts] == ["bend-i30", "u-turn-i30"]


def test_failures_can_be_left_out(monkeypatch):
    # Noise that takes no care of the walls makes episodes fail.
    monkeypatch.setattr(Demonstrator, "noisy", lambda self, action, noise: np.clip(action + noise, -1, 1))
    tight = {"episodes": 3, "noises": (0.0, 0.5)}
    every = record_dataset("all-v0", TIGHT, **tight)
    good = record_dataset("good-v0", TIGHT, **tight, only_success=True)
    n_good = sum(map(sum, every.successes.values()))
    assert every.n_episodes == 4 > n_good == good.n_episodes >= 1
    assert all(one["success"] for one in metadata(minari.load_dataset("good-v0")))


def test_the_same_seed_records_the_same():
    for name, seed in (("a-v0", 1), ("b-v0", 1), ("c-v0", 2)):
        record_dataset(name, BEND, episodes=1, noises=(0.3,), seed=seed)
    a, b, c = (minari.load_dataset(name)[0].actions for name in ("a-v0", "b-v0", "c-v0"))
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a[:50], c[:50])


def test_the_environment_is_recovered_where_nobody_has_imported_it():
    record_dataset("straight-v0", STRAIGHT, episodes=1)
    code = (
        "import sys, minari, gymnasium; assert 'hrsnake_env' not in sys.modules;"
        "dataset = minari.load_dataset('straight-v0'); env = dataset.recover_environment();"
        "print(env.spec.id, env.reset(seed=0)[0].shape);"
        "gymnasium.make(env.spec.id)"
    )
    paths = os.pathsep.join(path for path in sys.path if path)
    environment = {**os.environ, "PYTHONPATH": paths}
    out = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert out.stdout == f"hrsnake_env:{STRAIGHT} (28,)\n", out.stderr


def test_a_run_that_is_broken_off_leaves_nothing(folder, run, monkeypatch):
    add, calls = DatasetWriter.add, []

    def interrupted(self, *arguments, **options):
        calls.append(arguments)
        if len(calls) == 2:
            raise KeyboardInterrupt
        add(self, *arguments, **options)

    monkeypatch.setattr(DatasetWriter, "add", interrupted)
    code, _, err = run("arm/straight-v0", "--env", STRAIGHT, "--episodes", 3)
    assert (code, err) == (130, "hrsnake: stopped; no half-written file is left.\n")
    assert len(calls) == 2 and list(folder.iterdir()) == []


def test_the_command_records_a_data_set_for_each_environment(folder, run):
    code, out, err = run(
        "arm/planner-v0", "--env", STRAIGHT, "--env", BEND, "--episodes", 1, "--noise", 0, "--path", "sets"
    )
    assert (code, err) == (0, "")
    assert "1 of 1 episodes reached the goal" in out
    for name in ("Straight", "Bend-I30"):
        assert (folder / "sets" / "arm" / name / "planner-v0" / "data" / "main_data.hdf5").is_file()


def test_json_of_the_command_has_the_figures(run):
    code, out, _ = run("straight-v0", "--env", STRAIGHT, "--episodes", 2, "--noise", 0.1, "--json")
    (figures,) = json.loads(out)["datasets"]
    assert code == 0 and figures["successes"] == [{"noise": 0.1, "episodes": 2, "successes": 2}]
    assert figures["n_episodes"] == 2 and figures["path"].endswith("straight-v0")


def test_where_nothing_is_planned_nothing_is_written_and_the_exit_code_is_3(folder, run, monkeypatch):
    monkeypatch.setattr(Demonstrator, "begin", lambda self: False)
    code, out, _ = run("straight-v0", "--env", STRAIGHT)
    assert code == 3 and "nothing" in out and list(folder.iterdir()) == []
    code, out, _ = run("straight-v0", "--env", STRAIGHT, "--json")
    assert json.loads(out)["datasets"][0]["expert_return"] is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["x-v0", "--env", "Maze-v0"], "Unknown environment 'Maze-v0'. Available: HyperRedundantMaze-v0, "),
        (["no version", "--env", BEND], "Expected the id of a data set as name-v0 or namespace/name-v0"),
        (["name", "--env", BEND], "Expected the id of a data set as name-v0 or namespace/name-v0"),
        (["x-v0", "--env", BEND, "--noise", "-1"], "Expected noise levels from 0 to 1, got -1.0."),
        (
            ["x-v0", "--env", BEND, "--episodes", "0"],
            "Expected episodes to be a whole number of at least 1, ",
        ),
        (["x-v0", "--env", BEND, "--maze", "nowhere"], "Unknown maze 'nowhere'. Available: "),
        (["x-v0", "--env", BEND, "--path", "a/b"], "Expected an existing folder for 'a/b'"),
    ],
)
def test_bad_input_is_told_in_one_sentence(folder, run, arguments, message):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "") and err.startswith(f"hrsnake: {message}") and err.count("\n") == 1
    assert list(folder.iterdir()) == []


def test_a_data_set_is_never_written_over(run):
    record_dataset("straight-v0", STRAIGHT, episodes=1)
    code, _, err = run("straight-v0", "--env", STRAIGHT)
    assert code == 2 and "'straight-v0' is in " in err


def test_without_minari_a_sentence_says_how_to_get_it(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    code, _, err = run("straight-v0", "--env", STRAIGHT)
    assert code == 2 and 'pip install "hrsnake[data]"' in err


def test_ids_of_several_data_sets_are_all_different():
    env_ids = ["HyperRedundantMaze-v0", STRAIGHT, BEND]
    assert dataset_ids("a/b-v0", env_ids) == ["a/b-v0", "a/Straight/b-v0", "a/Bend-I30/b-v0"]
