"""Laws of imitation: pupils learn the way, runs repeat and resume, and the planner teaches throughout."""

import json
import os
import signal
import sys

import numpy as np
import pytest

from hrsnake_env import InputError
from planners.demonstrator import Demonstrator
from planners.rl import clone as cloning
from planners.rl import fitting
from planners.rl.checkpoints import read_model, read_progress
from planners.rl.evaluate import evaluate
from planners.rl.network import NetworkPolicy
from planners.rl.settings import CLONING, Settings, load_settings
from planners.rl.watch import Stop

pytest.importorskip("torch")

STRAIGHT, BEND = "HyperRedundantMaze-Straight-v0", "HyperRedundantMaze-Bend-I30-v0"
RANDOM = "HyperRedundantMaze-RandomTrain-v0"


@pytest.fixture
def quick(monkeypatch):
    """Let fits and tests take no time, and learn little."""
    monkeypatch.setattr(fitting, "UPDATES", 40)
    monkeypatch.setattr(fitting, "CHECK", 20)
    monkeypatch.setattr(cloning, "TESTS", 1)


def quick_run(folder, method="dagger", **options):
    """Play two rounds, or as many as there are steps for."""
    options = {"steps": 1000, "stop_at": 2.0, "quiet": True} | options
    return cloning.clone(method, options.pop("env_id", STRAIGHT), folder=folder, **options)


def lessons_of(run):
    return read_model(run.checkpoint, cloning.Lessons.load)


# Learning


@pytest.mark.parametrize("method", CLONING)
def test_a_pupil_comes_round_the_bend(method, tmp_path, monkeypatch):
    monkeypatch.setattr(fitting, "UPDATES", 1000)  # a second or two
    run = cloning.clone(method, BEND, steps=3000, folder=tmp_path, quiet=True)
    policy = NetworkPolicy.load(run.policy)
    (mean,) = evaluate(policy, episodes=1)  # all of them are the same
    sampled = evaluate(policy, episodes=20, deterministic=False)
    assert mean["success"] and sum(fact["success"] for fact in sampled) >= 18
    assert run.stopped == "learnt" and run.steps < 3000 and len(run.curve) * 500 <= run.steps


def test_an_untaught_pupil_does_not_arrive(quick, tmp_path, monkeypatch):
    monkeypatch.setattr(fitting, "UPDATES", 0)
    run = quick_run(tmp_path, env_id=BEND, steps=1)
    assert run.success == 0.0 and run.stopped == "steps"
    assert not evaluate(NetworkPolicy.load(run.policy), episodes=1)[0]["success"]


@pytest.mark.parametrize("method", CLONING)
def test_one_seed_gives_one_policy_and_another_seed_another(method, quick, tmp_path):
    runs = [quick_run(tmp_path / f"{k}", method, seed=seed) for k, seed in enumerate((3, 3, 4))]
    same, again, other = (NetworkPolicy.load(run.policy).mean[0] for run in runs)
    assert np.array_equal(same, again)
    assert not np.array_equal(same, other)


# Who plays, and what is told


@pytest.fixture
def watched(monkeypatch):
    """Return what the teacher says, and what is done before noise, in order."""
    told, done = [], []
    action, noisy = Demonstrator.action, Demonstrator.noisy

    def tell(self):
        told.append(action(self))
        return told[-1]

    def do(self, chosen, noise):
        done.append(chosen)
        return noisy(self, chosen, noise)

    monkeypatch.setattr(Demonstrator, "action", tell)
    monkeypatch.setattr(Demonstrator, "noisy", do)
    return told, done


def test_daggers_lessons_grow_and_are_the_teachers(quick, watched, tmp_path):
    first = lessons_of(quick_run(tmp_path, steps=1))
    lessons = lessons_of(quick_run(tmp_path, steps=1000, resume=True))
    told, done = map(np.array, watched)
    assert len(first.actions) >= 500 and len(first.actions) + 500 <= len(lessons.actions)
    assert np.array_equal(lessons.observations[: len(first.actions)], first.observations)
    assert np.array_equal(lessons.actions, told)
    own = (told != done).any(axis=1)
    # The teacher plays the first round alone, and half of the steps of the second; three standard errors.
    assert not own[: len(first.actions)].any()
    assert own[len(first.actions) :].mean() == pytest.approx(0.5, abs=1.5 / np.sqrt(500))


def test_in_behaviour_cloning_the_teacher_plays_all_rounds(quick, watched, tmp_path):
    lessons = lessons_of(quick_run(tmp_path, "clone"))
    told, done = map(np.array, watched)
    assert lessons.n_rounds == 2 and len(lessons.actions) >= 1000
    assert np.array_equal(told, done) and np.array_equal(lessons.actions, told)


def test_a_pupil_that_stands_still_is_not_watched_for_ever(quick, tmp_path, monkeypatch):
    monkeypatch.setattr(cloning, "BETA", 0.0)
    monkeypatch.setattr(cloning, "NOISES", (0.0,))
    monkeypatch.setattr(cloning, "PATIENCE", 30)
    still = np.zeros(4, dtype=np.float32)
    monkeypatch.setattr(NetworkPolicy, "predict", lambda *_, **__: (still, None))
    run = quick_run(tmp_path)
    first, second = run.curve[0][0], run.curve[1][0]
    assert (second - first) % 31 == 0 and second - first < 531


def test_mazes_without_a_plan_are_left_out(monkeypatch):
    plans = iter([False, False, True])
    monkeypatch.setattr(Demonstrator, "begin", lambda _: next(plans))
    env = cloning.make_env(RANDOM)
    settings = Settings(method="dagger", env_id=RANDOM, n_timesteps=1)
    school = cloning._School(settings, 0, env, Stop(), lambda *_: None)
    observation = school._start(5)
    env.reset(seed=5)
    env.reset()
    assert np.array_equal(observation, env.reset()[0])
    monkeypatch.setattr(Demonstrator, "begin", lambda _: False)
    with pytest.raises(InputError, match="Expected planned motions to imitate, got none in"):
        school._start(5)
    env.close()


# Fitting


def test_a_perceptron_fits_whatever_the_scales_of_its_inputs(monkeypatch):
    monkeypatch.setattr(fitting, "UPDATES", 1000)
    rng = np.random.default_rng(0)
    x = rng.uniform(-1.0, 1.0, (2000, 3)).astype(np.float32)
    observed = np.column_stack([0.02 * x[:, 0] + 0.9, x[:, 1], np.full(2000, 0.5)]).astype(np.float32)
    wanted = np.column_stack([x[:, 0] * x[:, 1]])
    layers = fitting.fitted(observed, wanted, (), rng)
    assert all(array.dtype == np.float32 for layer in layers for array in layer)
    got = observed
    for weights, bias in layers[:-1]:
        got = np.tanh(got @ weights.T + bias)
    got = got @ layers[-1][0].T + layers[-1][1]
    assert np.sqrt(np.mean((got - wanted) ** 2)) < 0.05  # the deviation of what is wanted is 0.33


def test_a_fit_goes_on_from_the_layers_it_is_given(monkeypatch):
    rng = np.random.default_rng(0)
    observed = rng.uniform(-1.0, 1.0, (200, 3)).astype(np.float32)
    wanted = np.sin(observed[:, :2])
    monkeypatch.setattr(fitting, "UPDATES", 20)
    layers = fitting.fitted(observed, wanted, (), rng)
    monkeypatch.setattr(fitting, "UPDATES", 0)
    again = fitting.fitted(0.5 * observed + 0.2, wanted, layers, rng)
    for (weights, bias), (others, other) in zip(layers, again, strict=True):
        # Scales go into the first layer and out of it again.
        np.testing.assert_allclose(weights, others, atol=1e-5)
        np.testing.assert_allclose(bias, other, atol=1e-5)


# Checkpoints


def test_a_resumed_run_ends_as_one_that_never_stopped(quick, tmp_path, monkeypatch):
    whole = quick_run(tmp_path / "whole")
    with monkeypatch.context() as patch:
        tested, calls = cloning._School._tested, []

        def killed(self, layers):
            calls.append(layers)
            if len(calls) == 2:
                raise MemoryError
            return tested(self, layers)

        patch.setattr(cloning._School, "_tested", killed)
        with pytest.raises(MemoryError):
            quick_run(tmp_path / "part")
    assert read_progress(tmp_path / "part/checkpoint.zip")["progress"]["steps"] == whole.curve[0][0]
    part = quick_run(tmp_path / "part", resume=True)
    assert (part.steps, part.episodes) == (whole.steps, whole.episodes)
    ours, theirs = (NetworkPolicy.load(run.policy) for run in (part, whole))
    for layer, other in zip((*ours.hidden, ours.mean), (*theirs.hidden, theirs.mean), strict=True):
        assert all(map(np.array_equal, layer, other))
    again = quick_run(tmp_path / "part", resume=True)  # nothing is left to do
    assert again.steps == part.steps and again.cpu_seconds == part.cpu_seconds


@pytest.mark.parametrize("round_", [0, 1])
def test_ctrl_c_keeps_the_rounds_that_are_there(round_, quick, tmp_path, monkeypatch):
    original, begun = cloning._School._start, []

    def pressed(self, seed):
        begun.append(seed is not None)  # a round's first episode has a seed
        if sum(begun) == round_ + 1:
            os.kill(os.getpid(), signal.SIGINT)
        return original(self, seed)

    monkeypatch.setattr(cloning._School, "_start", pressed)
    if round_ == 0:
        with pytest.raises(KeyboardInterrupt):
            quick_run(tmp_path)
        assert not list(tmp_path.iterdir())
    else:
        run = quick_run(tmp_path)
        assert run.stopped == "interrupted" and lessons_of(run).n_rounds == len(run.curve) == 1
        assert run.policy.exists() and run.steps == len(lessons_of(run).actions)


def test_lessons_survive_their_file_without_pickle(quick, tmp_path):
    lessons = lessons_of(quick_run(tmp_path, steps=1))
    with open(tmp_path / "lessons.npz", "wb") as file:
        lessons.save(file)
    with np.load(tmp_path / "lessons.npz", allow_pickle=False) as data:
        assert all(data[key].dtype.kind in "fi" for key in data)
    with open(tmp_path / "lessons.npz", "rb") as file:
        again = cloning.Lessons.load(file)
    assert np.array_equal(again.actions, lessons.actions) and again.round_steps == lessons.round_steps == 500
    assert len(again.layers) == 3 and np.array_equal(again.layers[0][0], lessons.layers[0][0])


# What is refused

BAD = [
    ({"method": "bc"}, "Unknown method 'bc'. Available: 'clone', 'dagger'."),
    ({"env_id": "Nowhere-v0"}, "Unknown environment 'Nowhere-v0'."),
    ({"seed": -1}, "Expected seed to be a whole number of at least 0, got -1."),
    ({"steps": 0}, "Expected steps to be a whole number of at least 1, got 0."),
    ({"stop_at": 0.0}, "Expected a positive stop_at, got 0.0."),
    ({"env_kwargs": {"action": "absolute"}}, "Expected an environment with action='delta', got 'absolute'."),
    ({"env_kwargs": {"observation": "image"}}, "Expected observations made of vectors, got Box("),
    ({"env_kwargs": {"colour": "red"}}, f"Expected arguments that {STRAIGHT} has"),
]


@pytest.mark.parametrize(("options", "sentence"), BAD)
def test_bad_input_gets_one_sentence(options, sentence, tmp_path):
    with pytest.raises(InputError) as error:
        quick_run(tmp_path, **options)
    assert sentence in str(error.value) and "\n" not in str(error.value)


def test_a_folder_with_another_run_is_refused(quick, tmp_path):
    quick_run(tmp_path, steps=1)
    with pytest.raises(InputError, match="Expected a folder without a run"):
        quick_run(tmp_path, steps=1)
    with pytest.raises(InputError, match="Expected a run with method='clone' to resume in"):
        quick_run(tmp_path, "clone", steps=1, resume=True)


def test_a_missing_torch_is_one_sentence_with_the_command(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InputError, match=r'pip install "hrsnake\[rl\]"'):
        quick_run(tmp_path)


@pytest.mark.parametrize("method", CLONING)
def test_imitation_has_no_file_of_settings(method):
    with pytest.raises(InputError, match=f"Expected a method with settings .*, got '{method}'"):
        load_settings(method, STRAIGHT)


# Where it is reached from


def test_the_command_imitates_and_evaluates(quick, capsys, monkeypatch, tmp_path):
    from planners.cli import main

    monkeypatch.chdir(tmp_path)
    printed = []
    for command in (
        f"train {STRAIGHT} --method dagger --steps 1 --out run --json",
        "evaluate run/policy.npz --episodes 1 --json",
    ):
        monkeypatch.setattr(sys, "argv", ["hrsnake", *command.split()])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0
        printed.append(json.loads(capsys.readouterr().out))
    assert printed[0]["method"] == "dagger" and printed[0]["steps"] >= 500
    assert printed[1]["summary"]["sampled"]["episodes"] == 1
