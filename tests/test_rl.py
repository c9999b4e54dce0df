"""Laws of training: it learns, repeats, resumes, and its policies act as they were trained."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from hrsnake_env import InputError, Maze
from hrsnake_env.registration import ENVIRONMENTS
from planners.cli import main
from planners.rl.checkpoints import read_model, read_progress, write_checkpoint
from planners.rl.environments import decision_steps, make_env
from planners.rl.evaluate import FACTS, evaluate, evaluate_both, replayed, summary
from planners.rl.models import new_model, vector
from planners.rl.network import NetworkPolicy, Origin
from planners.rl.settings import METHODS, Settings, load_settings
from planners.rl.watch import Progress, Watch

sb3 = pytest.importorskip("stable_baselines3")
contrib = pytest.importorskip("sb3_contrib")

from planners.rl.train import train  # noqa: E402

STRAIGHT = "HyperRedundantMaze-Straight-v0"

QUICK = {
    "ppo": {"n_steps": 64, "batch_size": 128, "n_epochs": 2, "policy_kwargs": {"net_arch": [16]}},
    "sac": {"learning_starts": 180, "buffer_size": 500, "policy_kwargs": {"net_arch": [16]}},
}


def quick(method, n_envs=2, **changes):
    """Return settings that train in a second, and learn nothing."""
    arguments = QUICK[method] | changes
    return Settings(method=method, env_id=STRAIGHT, n_timesteps=256, n_envs=n_envs, arguments=arguments)


def quick_run(folder, method="ppo", **options):
    """Train for a few steps."""
    options = {"folder": folder, "quiet": True, "settings": quick(method)} | options
    return train(method, STRAIGHT, **options)


def write_quick_settings():
    """Write settings for a command that trains in a second."""
    Path("s.yml").write_text(
        "default: {n_timesteps: 128, n_envs: 2, n_steps: 64, batch_size: 128, policy_kwargs: {net_arch: [8]}}"
    )


@pytest.fixture(scope="module")
def learnt(tmp_path_factory):
    """Return a run on the easiest rung, until the task is learnt."""
    return train("ppo", STRAIGHT, folder=tmp_path_factory.mktemp("learnt"), steps=60_000, quiet=True)


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Return a function that runs a command and returns exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return ended.value.code, printed.out, printed.err

    return run_command


# Learning


def test_ppo_learns_to_feed_and_arrive(learnt):
    assert learnt.stopped == "learnt"
    assert learnt.success >= 0.95
    assert learnt.steps < 60_000 and learnt.episodes >= 100


def test_what_has_been_learnt_is_there_without_the_learner(learnt):
    facts = evaluate_both(NetworkPolicy.load(learnt.policy), episodes=10)
    assert all(fact["success"] and fact["clean"] for rows in facts.values() for fact in rows)
    # In one maze without randomness all episodes with mean actions are the same.
    assert len(facts["mean"]) == 1 and len(facts["sampled"]) == 10


def test_an_untrained_policy_does_not_arrive(tmp_path):
    policy = NetworkPolicy.load(quick_run(tmp_path, steps=1).policy)
    assert not any(fact["success"] for fact in evaluate(policy, episodes=1))


@pytest.mark.parametrize("method", ["ppo", "sac"])
def test_one_seed_gives_one_policy_and_another_seed_another(method, tmp_path):
    runs = [quick_run(tmp_path / f"{k}", method, seed=seed) for k, seed in enumerate((3, 3, 4))]
    same, again, other = (NetworkPolicy.load(run.policy).mean[0] for run in runs)
    assert np.array_equal(same, again)
    assert not np.array_equal(same, other)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_trains_and_its_policy_acts_from_the_base(method, tmp_path):
    chosen = load_settings(method, STRAIGHT)
    chosen = dataclasses.replace(
        chosen,
        n_envs=1,
        arguments=chosen.arguments
        | ({"n_steps": 64, "batch_size": 64} if "n_steps" in chosen.arguments else {}),
    )
    run = train(method, STRAIGHT, steps=64, folder=tmp_path, quiet=True, settings=chosen)
    policy = NetworkPolicy.load(run.policy)
    env = policy.make_env()
    _, info = env.reset(seed=0)
    assert info["progress"] == 0.0 and "waypoint" not in info
    assert policy.origin.method == method and policy.origin.train_steps == run.steps >= 64
    (facts,) = evaluate(policy, episodes=1)
    assert set(FACTS) <= set(facts)


def test_episodes_that_began_elsewhere_do_not_count_as_success():
    progress = Progress()
    for _ in range(200):
        progress.see({"is_success": True, "waypoint": 7})
    assert progress.success is None and progress.success_planned == 1.0 and not progress.learnt(0.5)
    for success in [False] * 5 + [True] * 19:
        progress.see({"is_success": success, "waypoint": -1})
    assert progress.success == pytest.approx(19 / 24) and not progress.learnt(0.98)
    assert progress.episodes == 224


def test_a_task_is_learnt_when_enough_of_the_last_hundred_episodes_succeed():
    progress = Progress()
    for _ in range(99):
        progress.see({"is_success": True})
    assert not progress.learnt(0.98)  # too few, yet
    for success in [False] * 3 + [True] * 97:
        progress.see({"is_success": success})
    assert len(progress.recent) == 100 and not progress.learnt(0.98)
    progress.see({"is_success": True})
    assert progress.learnt(0.98)


# Checkpoints


@pytest.mark.parametrize("method", ["ppo", "sac"])
def test_a_resumed_run_goes_on_with_steps_episodes_and_weights(method, tmp_path):
    first = quick_run(tmp_path, method, steps=256)
    before = NetworkPolicy.load(first.policy)
    again = quick_run(tmp_path, method, steps=256, resume=True)
    assert (again.steps, again.episodes) == (first.steps, first.episodes)
    assert np.array_equal(NetworkPolicy.load(again.policy).mean[0], before.mean[0])
    longer = quick_run(tmp_path, method, steps=600, resume=True)
    assert longer.steps >= 600 and longer.cpu_seconds > first.cpu_seconds
    assert not np.array_equal(NetworkPolicy.load(longer.policy).mean[0], before.mean[0])


def test_a_replay_buffer_survives(tmp_path):
    quick_run(tmp_path, "sac", steps=256)
    with zipfile.ZipFile(tmp_path / "checkpoint.zip") as archive:
        assert "replay_buffer.npz" in archive.namelist()
    sizes = []
    original = sb3.SAC.learn

    def watched(self, *arguments, **options):
        sizes.append(self.replay_buffer.size() * self.n_envs)
        return original(self, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sb3.SAC, "learn", watched)
        quick_run(tmp_path, "sac", steps=300, resume=True)
    assert sizes == [256]


def test_hindsight_goes_on_without_the_episodes_that_were_cut_off(tmp_path):
    settings = load_settings("tqc-her", STRAIGHT)
    # What is learnt does not matter here, so one update is enough each time.
    settings = dataclasses.replace(settings, arguments=settings.arguments | {"gradient_steps": 1})
    runs = [
        train(
            "tqc-her",
            STRAIGHT,
            steps=steps,
            folder=tmp_path,
            quiet=True,
            settings=settings,
            resume=True,
            stop_at=2.0,
        )
        for steps in (400, 1600)
    ]
    assert runs[0].steps < runs[1].steps and runs[1].steps == pytest.approx(1600, abs=32)
    assert runs[1].episodes >= 4 + runs[0].episodes


def test_the_same_checkpoint_always_goes_on_in_the_same_way(tmp_path):
    quick_run(tmp_path, steps=256)
    checkpoint = (tmp_path / "checkpoint.zip").read_bytes()
    weights = []
    for _ in range(2):
        (tmp_path / "checkpoint.zip").write_bytes(checkpoint)
        weights.append(NetworkPolicy.load(quick_run(tmp_path, steps=512, resume=True).policy).mean[0])
    assert np.array_equal(*weights)


def test_a_kill_leaves_a_whole_checkpoint_from_which_steps_go_on(tmp_path):
    code = (
        "import planners.rl.train as t\n"
        "t.CHECKPOINT_STEPS['ppo'] = 128\n"
        f"from tests.test_rl import quick_run\nquick_run({str(tmp_path)!r}, steps=10**7, stop_at=2)"
    )
    root = Path(__file__).parents[1]
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=root, env={**os.environ, "PYTHONPATH": str(root)}
    )
    checkpoint = tmp_path / "checkpoint.zip"
    try:
        until = time.monotonic() + 60.0
        while not (checkpoint.exists() and read_progress(checkpoint)["progress"]["steps"] >= 1000):
            assert process.poll() is None and time.monotonic() < until
            time.sleep(0.05)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    steps = read_progress(checkpoint)["progress"]["steps"]
    run = quick_run(tmp_path, steps=steps + 100, stop_at=2, resume=True)
    assert run.steps == steps + 128  # a whole rollout of both environments


def test_a_checkpoint_is_never_half_written(tmp_path):
    settings = quick("ppo")
    envs = vector(settings)
    model = new_model(settings, envs, 0, tmp_path)
    path = tmp_path / "checkpoint.zip"
    write_checkpoint(path, model, {"progress": {"steps": 1}})

    def fail(*_):
        raise OSError("no space left")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(model, "save", fail)
        with pytest.raises(OSError, match="no space left"):
            write_checkpoint(path, model, {"progress": {"steps": 2}})
    envs.close()
    assert read_progress(path) == {"progress": {"steps": 1}}
    assert [file.name for file in tmp_path.glob("checkpoint*")] == ["checkpoint.zip"]


def test_ctrl_c_keeps_what_is_there(tmp_path, monkeypatch):
    original = Watch.step

    def pressed(self, steps, dones, infos):
        if steps == 200:
            os.kill(os.getpid(), signal.SIGINT)
        return original(self, steps, dones, infos)

    monkeypatch.setattr(Watch, "step", pressed)
    before = signal.getsignal(signal.SIGINT)
    run = quick_run(tmp_path, steps=10_000)
    assert run.stopped == "interrupted" and run.steps == 200
    assert read_progress(tmp_path / "checkpoint.zip")["progress"]["steps"] == 200
    assert signal.getsignal(signal.SIGINT) is before
    monkeypatch.undo()
    assert quick_run(tmp_path, steps=300, resume=True).steps >= 300


def test_ctrl_c_is_exit_code_130(run, monkeypatch):
    write_quick_settings()
    monkeypatch.setattr(Watch, "step", lambda *_: os.kill(os.getpid(), signal.SIGINT) or False)
    code, out, err = run("train", STRAIGHT, "--settings", "s.yml", "--out", "r")
    assert code == 130 and "--resume goes on" in out and "stopped" in err


# Policies as arrays


def model_of(method, **env_kwargs):
    settings = quick({"tqc": "sac"}.get(method, method), **({"batch_size": 64} if method == "ppo" else {}))
    env = gym.make(f"hrsnake_env:{STRAIGHT}", **env_kwargs)
    kind = {"ppo": sb3.PPO, "sac": sb3.SAC, "tqc": contrib.TQC}[method]
    name = "MultiInputPolicy" if env_kwargs else "MlpPolicy"
    return kind(name, env, seed=1, device="cpu", **settings.arguments), env


MODELS = [("ppo", {}), ("sac", {}), ("tqc", {"observation": "goal"}), ("ppo", {"observation": "goal"})]


@pytest.mark.parametrize(("method", "env_kwargs"), MODELS)
def test_the_arrays_act_as_the_model(method, env_kwargs, tmp_path):
    model, env = model_of(method, **env_kwargs)
    NetworkPolicy.from_model(model, Origin(method=method, env_id=STRAIGHT)).save(tmp_path / "p.npz")
    policy = NetworkPolicy.load(tmp_path / "p.npz")
    observation, _ = env.reset(seed=0)
    for _ in range(20):
        action, _ = policy.predict(observation)
        expected, _ = model.predict(observation, deterministic=True)
        np.testing.assert_allclose(action, expected, atol=1e-5)
        assert action.dtype == np.float32 and env.action_space.contains(action)
        observation, *_, done, _, _ = env.step(env.action_space.sample())
        if done:
            observation, _ = env.reset()


@pytest.mark.parametrize("method", ["ppo", "sac"])
def test_sampled_actions_are_spread_as_the_models(method):
    model, env = model_of(method)
    policy = NetworkPolicy.from_model(model, Origin(method=method, env_id=STRAIGHT))
    batch = np.repeat(env.reset(seed=0)[0][None], 4000, axis=0)
    ours, _ = policy.predict(batch, deterministic=False)
    theirs, _ = model.predict(batch, deterministic=False)
    # Five standard errors of a mean of 4000 numbers in [-1, 1] are 0.08.
    np.testing.assert_allclose(ours.mean(axis=0), theirs.mean(axis=0), atol=0.08)
    np.testing.assert_allclose(ours.std(axis=0), theirs.std(axis=0), atol=0.05)


def test_a_batch_is_every_one_of_its_observations(learnt):
    policy = NetworkPolicy.load(learnt.policy)
    env = policy.make_env()
    env.action_space.seed(0)
    batch = [env.reset(seed=0)[0]] + [env.step(env.action_space.sample())[0] for _ in range(4)]
    actions, _ = policy.predict(np.array(batch))
    for observation, action in zip(batch, actions, strict=True):
        np.testing.assert_allclose(policy.predict(observation)[0], action, atol=1e-6)


def test_an_observation_of_another_shape_is_refused(learnt):
    policy = NetworkPolicy.load(learnt.policy)
    with pytest.raises(InputError, match="Expected observations with 28 numbers each"):
        policy.predict(np.zeros(27))
    model, _ = model_of("ppo", observation="goal")
    policy = NetworkPolicy.from_model(model, Origin(method="ppo", env_id=STRAIGHT))
    with pytest.raises(InputError, match="Expected observations with 'achieved_goal', got observation"):
        policy.predict({"observation": np.zeros(19)})


def test_a_policys_file_holds_no_pickle_and_says_where_it_comes_from(learnt):
    with np.load(learnt.policy, allow_pickle=False) as data:
        assert all(data[key].dtype == np.float32 for key in data if key != "meta")
        meta = json.loads(str(data["meta"]))
    assert meta["origin"]["method"] == "ppo" and meta["origin"]["env_id"] == STRAIGHT
    assert meta["origin"]["seed"] == 0 and meta["origin"]["train_steps"] == learnt.steps
    assert {"stable-baselines3", "torch", "numpy"} <= set(meta["origin"]["versions"])


def test_a_policy_acts_where_no_learner_is_installed(learnt):
    code = (
        "import sys\n"
        "for name in ('torch', 'stable_baselines3', 'sb3_contrib'): sys.modules[name] = None\n"
        "from planners.rl.network import NetworkPolicy\n"
        "from planners.rl.evaluate import evaluate\n"
        f"print(evaluate(NetworkPolicy.load({str(learnt.policy)!r}), episodes=1)[0]['success'])"
    )
    root = Path(__file__).parents[1]
    printed = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    ).stdout
    assert printed.strip() == "True"


def test_an_episode_is_the_same_whenever_its_seed_is(learnt):
    policy = NetworkPolicy.load(learnt.policy)
    three = evaluate(policy, episodes=3, seed=5, deterministic=False)
    assert evaluate(policy, episodes=1, seed=7, deterministic=False) == three[2:]
    assert len({fact["return"] for fact in three}) == 3


def test_the_summary_is_the_mean_and_the_worst_of_the_depths():
    rows = [dict.fromkeys(FACTS, 0.0), {**dict.fromkeys(FACTS, 1.0), "worst_depth": 0.25}]
    figures = summary(rows)
    assert figures["episodes"] == 2 and figures["success"] == 0.5 and figures["worst_depth"] == 0.25


def test_a_replay_shows_the_episodes_that_were_measured(learnt):
    policy = NetworkPolicy.load(learnt.policy)
    mean, sampled = replayed(policy, seed=5)
    assert mean.n_poses - 1 == evaluate(policy, episodes=1, seed=5)[0]["steps"]
    assert sampled.n_poses - 1 == evaluate(policy, episodes=1, seed=5, deterministic=False)[0]["steps"]


# Settings


@pytest.mark.parametrize("method", METHODS)
def test_settings_are_well_formed_for_every_environment(method):
    for env_id in ENVIRONMENTS:
        settings = load_settings(method, env_id)
        assert settings.n_timesteps >= 1
        if settings.algorithm == "ppo":  # or the learner warns of rests
            assert settings.n_envs * settings.arguments["n_steps"] % settings.arguments["batch_size"] == 0


@pytest.mark.parametrize("method", METHODS)
def test_the_learner_takes_all_that_the_settings_name(method, tmp_path):
    settings = load_settings(method, STRAIGHT)
    envs = vector(settings)
    model = new_model(settings, envs, 0, tmp_path)
    envs.close()
    assert settings == load_settings(method, STRAIGHT)
    for name in ("gamma", "batch_size", "n_epochs", "buffer_size"):
        if name in settings.arguments:
            assert getattr(model, name) == settings.arguments[name]


def test_a_schedule_falls_to_nothing_over_the_run(tmp_path):
    settings = quick("ppo", learning_rate="lin_0.5")
    envs = vector(settings)
    model = new_model(settings, envs, 0, tmp_path)
    envs.close()
    assert [model.lr_schedule(left) for left in (1.0, 0.5, 0.0)] == [0.5, 0.25, 0.0]


GOOD = "default: {n_timesteps: 10"

BAD_SETTINGS = [
    ("[1, 2]", "Expected settings by environment in 's.yml', got list."),
    ("a: [", "Expected settings (.yml) in 's.yml', got a file that is not YAML."),
    ("Nowhere-v0: {}", "Expected environments and 'default' in 's.yml', got 'Nowhere-v0'."),
    ("HyperRedundantMaze-v0: {n_timesteps: 1}", "Expected settings for 'HyperRedundantMaze-Straight-v0'"),
    (
        "default: {}",
        "Expected n_timesteps for 'default' in 's.yml' to be a whole number of at least 1, got None.",
    ),
    (GOOD + ", speed: 3}", "Unknown setting 'speed' for 'default' in 's.yml'. Available: n_timesteps, "),
    (GOOD + ", policy: CnnPolicy}", "Unknown policy 'CnnPolicy' for 'default'"),
    (
        "default: {n_timesteps: 10, policy_kwargs: 'dict(net_arch=[64])'}",
        "Expected policy_kwargs for 'default' in 's.yml' as names",
    ),
    (GOOD + ", policy_kwargs: {depth: 3}}", "Unknown policy_kwargs 'depth' for 'default'"),
    (GOOD + ", learning_rate: 3e-4}", "Expected learning_rate for 'default' in 's.yml' as a positive number"),
    (GOOD + ", env_wrapper: os.system}", "Unknown env_wrapper 'os.system' for 'default'"),
    (GOOD + ", env_wrapper: [[1]]}", "Unknown env_wrapper [1] for 'default'"),
    (GOOD + ", gamma: x}", "Expected gamma for 'default' in 's.yml' as a number, got 'x'."),
    ("default: !!python/object:os.system {}", "got a file that is not YAML."),
]


@pytest.mark.parametrize(("text", "sentence"), BAD_SETTINGS)
def test_bad_settings_get_one_sentence(text, sentence, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("s.yml").write_text(text)
    with pytest.raises(InputError) as error:
        load_settings("ppo", STRAIGHT, file="s.yml")
    assert sentence in str(error.value) and "\n" not in str(error.value)


def test_a_maze_that_json_cannot_hold_is_refused(tmp_path):
    with pytest.raises(InputError, match="Expected env_kwargs that JSON can hold"):
        quick_run(tmp_path, env_kwargs={"maze": Maze.load("fig19")})


def test_settings_of_another_method_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"Expected settings of sac for .*, got those of ppo"):
        train("sac", STRAIGHT, folder=tmp_path, settings=quick("ppo"))


def test_a_learners_refusal_is_one_sentence(tmp_path):
    with pytest.raises(InputError, match="Expected settings that ppo takes"):
        quick_run(tmp_path, settings=quick("ppo", n_envs=1, n_steps=1))


# The command


def test_the_command_trains_evaluates_and_resumes(run):
    write_quick_settings()
    code, out, _ = run("train", STRAIGHT, "--settings", "s.yml", "--out", "r", "--json")
    assert code == 0 and json.loads(out)["steps"] == 128
    code, out, _ = run("train", STRAIGHT, "--settings", "s.yml", "--out", "r", "--steps", 200, "--resume")
    assert code == 0 and "256" in out
    code, out, _ = run("evaluate", "r/policy.npz", "--episodes", 2, "--json", "--replay", "r/run.html")
    figures = json.loads(out)
    assert code == 0 and figures["summary"]["sampled"]["episodes"] == 2
    assert Path("r/run.html").stat().st_size > 10_000
    code, out, _ = run("evaluate", "r/policy.npz", "--episodes", 1)
    assert code == 0 and "sampled actions" in out and "worst depth" in out


BAD_INPUT = [
    ("train Nowhere-v0", "Unknown environment 'Nowhere-v0'. Available: HyperRedundantMaze-v0, "),
    (f"train {STRAIGHT} --method dqn", "Unknown method 'dqn'. Available: ppo, ppo-planned"),
    (f"train {STRAIGHT} --steps 0", "Expected steps to be a whole number of at least 1, got 0."),
    (f"train {STRAIGHT} --seed -1", "Expected seed to be a whole number of at least 0, got -1."),
    (f"train {STRAIGHT} --stop-at 0", "Expected a positive stop_at, got 0.0."),
    (f"train {STRAIGHT} --out text.npz", "Expected a folder, but 'text.npz' is a file."),
    (f"train {STRAIGHT} --settings no.yml", "Expected a file of settings (.yml) at 'no.yml'"),
    (f"train {STRAIGHT} --out old", "Expected a folder without a run, but there is 'old/checkpoint.zip'"),
    (f"train {STRAIGHT} --out old --resume", "Expected a checkpoint (.zip) in 'old/checkpoint.zip'"),
    ("evaluate no.npz", "Expected a policy (.npz) at 'no.npz', but there is none."),
    ("evaluate text.npz", "Expected a policy (.npz) in 'text.npz', got a file that is not one."),
    ("evaluate array.npz", "Expected a policy (.npz) in 'array.npz', got a file that is not one."),
    ("evaluate p.npz --env Nowhere-v0", "Unknown environment 'Nowhere-v0'."),
    ("evaluate p.npz --env HyperRedundantMaze-Fig19-v0", "Expected an environment with 28 numbers observed"),
    ("evaluate p.npz --episodes 0", "Expected episodes to be a whole number of at least 1, got 0."),
    ("evaluate p.npz --replay a.png", "Expected a file name ending in .html, got 'a.png'."),
]


@pytest.mark.parametrize(("command", "sentence"), BAD_INPUT)
def test_bad_input_gets_one_sentence_and_exit_code_2(command, sentence, run, learnt):
    Path("text.npz").write_text("not a policy")
    np.savez("array.npz", weights=np.zeros(3))
    NetworkPolicy.load(learnt.policy).save("p.npz")
    Path("old").mkdir()
    Path("old/checkpoint.zip").write_text("not a checkpoint")
    code, out, err = run(*command.split())
    assert (code, out) == (2, "")
    assert err.startswith("hrsnake: ") and sentence in err and err.count("\n") == 1


def test_a_missing_extra_is_one_sentence_with_the_command(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    code, _, err = run("train", STRAIGHT)
    assert code == 2 and 'pip install "hrsnake[rl]"' in err and err.count("\n") == 1


def test_another_runs_checkpoint_is_refused(tmp_path):
    quick_run(tmp_path, steps=1)
    with pytest.raises(InputError, match=r"Expected a run with seed=1 to resume in .* got one with seed=0"):
        quick_run(tmp_path, steps=1, seed=1, resume=True)


def test_wrappers_and_arguments_that_are_unknown_are_refused():
    with pytest.raises(InputError, match=r"Unknown wrapper 'os\.system'"):
        make_env(STRAIGHT, wrappers=(("os.system", {}),))
    with pytest.raises(InputError, match="Expected arguments that HyperRedundantMaze-Straight-v0 has"):
        make_env(STRAIGHT, env_kwargs={"colour": "red"})


def test_a_decision_takes_the_wrappers_own_number_of_steps_unless_told():
    repeat = "planners.wrappers.ActionRepeat"
    assert [decision_steps(wrappers) for wrappers in ((), ((repeat, {}),), ((repeat, {"repeat": 8}),))] == [
        1,
        4,
        8,
    ]


def test_a_checkpoint_that_cannot_be_read_gets_one_sentence(tmp_path):
    path = tmp_path / "checkpoint.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("something", "else")
    with pytest.raises(InputError, match="Expected a checkpoint that can be read"):
        read_model(path, lambda file: file)
