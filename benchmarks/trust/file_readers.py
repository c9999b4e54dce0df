"""Every reader of files and requests but those of maps: what it is fed with, faults in it, and how it reads.

Each draws one input from a generator of random numbers; the same generator gives the same input.
"""

from __future__ import annotations

import asyncio
import base64
import contextlib
import functools
import io
import itertools
import json
import os
import pickle
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.trust import mutations
from benchmarks.trust.mutations import mutated_archive, mutated_bytes, mutated_json, mutated_value, packed
from hrsnake_env.arm import ArmSpec
from hrsnake_env.maze import Maze
from planners import plan, validate
from planners.problem import KEYS, Motion

PLANTED = Path(tempfile.gettempdir()) / f"hrsnake-planted-{os.getpid()}"
"""A file that comes of it if anything that was planted in a pickle is run."""

SCENE = {
    "name": "bend",
    "shapes": [{"role": "free", "line": [[0, 0], [0, 900], [900, 900]], "width": 200}],
    "base": [0, 5, 90],
    "goal": [800, 900],
    "goal_radius": 25,
}

BEAMS = {"low": [0, 0, 0], "high": [100, 60, 60]}


class Planted:
    """Make a file when it is unpickled."""

    def __reduce__(self):
        return open, (str(PLANTED), "w")


@dataclass(frozen=True)
class Reader:
    """Name a reader.

    Parameters
    ----------
    name : str
        For the table.
    ending : str
        Of its files; "" if what it reads is no file.
    draw : callable
        Makes an input from random numbers: bytes, or plain data if there is no file.
    read : callable
        Reads the file at a path, or the data, and goes on with what was read a little.
    """

    name: str
    ending: str
    draw: Callable
    read: Callable


@functools.cache
def bend():
    """Return a maze that is planned in milliseconds."""
    return Maze.from_corridors([(0, 0), (0, 900), (900, 900)], 200.0, name="bend")


@functools.cache
def bend_motion():
    """Return a motion in it."""
    return plan(bend(), ArmSpec(link_length=300.0, link_radius=8.0, joint_limit=2.0)).motion


@functools.cache
def bomb(name):
    """Return an archive that takes 300 MiB when it is unpacked."""
    return mutations.bomb_of(name)


def _arrays(motion):
    step = max(1, motion.n_poses // 12)  # fewer poses are quicker
    picked = {key: getattr(motion, key)[::step] for key in ("joints", "joint_angles", "feed")}
    rest = {key: np.asarray(getattr(motion, key)) for key in (*KEYS, "link_radius", "joint_limit")}
    return {**rest, **picked}


def _planted_array():
    array = np.empty(1, dtype=object)
    array[0] = Planted()
    return mutations.npy(array)


def _archive(members, rng):
    if rng.random() < 0.03:
        data = {f"{name}.npy": mutations.npy(array) for name, array in members.items()}
        data[f"{list(members)[rng.integers(0, len(members))]}.npy"] = _planted_array()
        return packed(data)
    whole = mutated_archive(members, rng, bomb(next(iter(members))) if rng.random() < 0.01 else None)
    return whole if rng.random() < 0.99 else pickle.dumps(Planted())


# Motions


def _draw_motion(rng):
    return _archive(_arrays(bend_motion()), rng)


def _read_motion(path):
    motion = Motion.load(path)
    validate(motion, bend())


@functools.cache
def _room():
    from planners.spatial.rooms import load_workspace

    return load_workspace("paired-panels")


@functools.cache
def _spatial_arrays():
    from planners.spatial.planning import plan as plan_in_space

    return _arrays(
        plan_in_space(_room(), ArmSpec(link_length=90.0)).motion.of_arm(
            ArmSpec(link_length=90.0, link_radius=1.0, joint_limit=2.0)
        )
    )


def _read_spatial(path):
    from planners.spatial.problem import SpatialMotion
    from planners.spatial.validation import validate as validate_in_space

    validate_in_space(SpatialMotion.load(path), _room())


def _read_workspace(path):
    from planners.spatial.workspace import Workspace

    room = Workspace.load(path)
    room.check_arm(ArmSpec(link_length=90.0, link_radius=1.0))


# Policies and trainings


@functools.cache
def _policy_arrays():
    from planners.reading import read_arrays
    from planners.rl.shipped import policy_path

    return read_arrays(policy_path("u-turn-i30-sac"))


def _draw_policy(rng):
    arrays = dict(_policy_arrays())
    if rng.random() < 0.5:
        return _archive(arrays, rng)
    arrays["meta"] = np.array(mutated_json(json.loads(str(arrays["meta"])), rng).decode("latin1"))
    return packed({f"{name}.npy": mutations.npy(array) for name, array in arrays.items()})


def _read_policy(path):
    from planners.rl.network import NetworkPolicy

    policy = NetworkPolicy.load(path)
    policy.predict(np.zeros(policy.n_observed, dtype=np.float32), deterministic=False)
    policy.make_env().close()


STRAIGHT = "HyperRedundantMaze-Straight-v0"

PROGRESS = {
    "task": {"method": "ppo", "env_id": STRAIGHT, "seed": 0},
    "progress": {
        "steps": 2048,
        "episodes": 7,
        "recent": [True, False],
        "recent_planned": [],
        "cpu_seconds": 3.5,
        "seconds": 4.0,
        "curve": [[2000, 3.0, 0.5]],
    },
}


def _read_progress(path):
    from planners.rl.runs import old_progress

    progress = old_progress(path, {"seed": 0}, True)
    assert progress.success is None or 0.0 <= progress.success <= 1.0
    assert progress.learnt(0.98) in (True, False)


def _draw_progress(rng):
    if rng.random() < 0.3:
        whole = packed({"progress.json": json.dumps(PROGRESS), "model.zip": b"x"})
        return mutated_bytes(whole, rng)
    return packed({"progress.json": mutated_json(PROGRESS, rng), "model.zip": b"x"})


@functools.cache
def _model(folder=None):
    from planners.rl.models import new_model, vector
    from planners.rl.settings import load_settings

    settings = load_settings("sac", STRAIGHT)
    arguments = settings.arguments | {"buffer_size": 64, "policy_kwargs": {"net_arch": [4]}}
    settings = type(settings)(**{**vars(settings), "arguments": arguments, "n_envs": 1})
    return new_model(settings, vector(settings), 0, Path(tempfile.gettempdir()))


@functools.cache
def _checkpoint():
    """Return the members of a checkpoint, and those of its model."""
    from planners.rl.checkpoints import write_checkpoint

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "checkpoint.zip"
        write_checkpoint(path, _model(), PROGRESS)
        with zipfile.ZipFile(path) as archive:
            outer = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(io.BytesIO(outer["model.zip"])) as archive:
        return outer, {name: archive.read(name) for name in archive.namelist()}


def _draw_checkpoint(rng):
    outer, inner = (dict(members) for members in _checkpoint())
    kind = rng.integers(0, 7)
    planted = pickle.dumps(Planted())
    if kind == 0:  # what stable-baselines3 would unpickle
        data = json.loads(inner["data"])
        name = [key for key, value in data.items() if isinstance(value, dict)][int(rng.integers(0, 3))]
        data[name] = {":type:": "x", ":serialized:": base64.b64encode(planted).decode()}
        inner["data"] = json.dumps(data).encode()
    elif kind == 1:
        names = ["policy.pth", "pytorch_variables.pth", "actor.optimizer.pth"]
        inner[names[rng.integers(0, 3)]] = packed({"archive/data.pkl": planted, "archive/version": b"3"})
    elif kind == 2:
        outer["replay_buffer.pkl"] = planted
    elif kind == 3:
        inner["data"] = mutated_json(json.loads(inner["data"]), rng)
    elif kind == 4:
        name = list(inner)[rng.integers(0, len(inner))]
        inner[name] = mutated_bytes(inner[name], rng)
    elif kind == 5:
        with np.load(io.BytesIO(outer["replay_buffer.npz"])) as arrays:
            outer["replay_buffer.npz"] = _archive(dict(arrays), rng)
    outer["model.zip"] = packed(inner, zipfile.ZIP_STORED)
    whole = packed(outer, zipfile.ZIP_STORED)
    return mutated_bytes(whole, rng) if kind == 6 else whole


def _read_checkpoint(path):
    from planners.rl.checkpoints import read_model, restore

    read_model(path, lambda file: restore(_model(), file))


@functools.cache
def _lessons():
    layers = [
        (np.zeros((5, 28), np.float32), np.zeros(5, np.float32)),
        (np.zeros((4, 5), np.float32), np.zeros(4, np.float32)),
    ]
    arrays = {f"weights_{k}": weights for k, (weights, _) in enumerate(layers)}
    arrays |= {f"bias_{k}": bias for k, (_, bias) in enumerate(layers)}
    rows = {"observations": np.zeros((6, 28), np.float32), "actions": np.zeros((6, 4), np.float32)}
    return {**rows, "counts": np.array([1, 500]), **arrays}


def _read_lessons(path):
    from planners.rl.checkpoints import read_model
    from planners.rl.clone import Lessons

    lessons = read_model(path, Lessons.load)
    assert lessons.n_rounds + lessons.round_steps is not None


SETTINGS = """default: &base
  n_timesteps: !!float 1e5
  n_envs: 4
  policy: MlpPolicy
  learning_rate: lin_0.0003
  env_wrapper: [{planners.wrappers.ActionRepeat: {repeat: 4}}, planners.wrappers.PlannedResets]
  env_kwargs: {reward_type: dense}
  policy_kwargs: {net_arch: [64, 64]}
HyperRedundantMaze-Straight-v0:
  <<: *base
  n_timesteps: 1000
  gamma: 0.99
"""

LEVELS = "abcdefghi"

LAUGHS = "a: &a [x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n" for before, name in itertools.pairwise(LEVELS)
)
"""A few lines that stand for a hundred million values."""

YAML_WORDS = (
    *("*base", "<<: *base", "!!python/object/apply:os.system ['true']", "!!python/name:os.system", "&base"),
    *("9" * 5000, "2001-99-99", "? [a]\n: b", "!!binary x", "0x" + "f" * 500, "- " * 500, "[" * 1000, "\t"),
    *("%YAML 9", f"{LAUGHS}HyperRedundantMaze-Straight-v0: *i\n", f"{LAUGHS}default: {{n_timesteps: *i}}\n"),
    "default: {n_timesteps: 1, gamma: &x [*x]}\n",
)


def _draw_settings(rng):
    if rng.random() < 0.5:
        return mutated_bytes(SETTINGS.encode(), rng)
    lines = SETTINGS.split("\n")
    for _ in range(rng.integers(1, 3)):
        number = int(rng.integers(0, len(lines)))
        word = YAML_WORDS[rng.integers(0, len(YAML_WORDS))]
        key = lines[number].split(":")[0]
        lines[number] = word if rng.random() < 0.4 else f"{key}: {word}"
    return "\n".join(lines).encode()


def _read_settings(path):
    from planners.rl.settings import load_settings

    settings = load_settings("ppo", STRAIGHT, file=path)
    json.dumps(settings.arguments, default=str)


# Searches and studies


TRIALS = {
    "kind": "hrsnake longest",
    "digest": "d",
    "bound": {"lower": 400.0, "upper": 450.0, "limited_by": "maze", "proven": True,
              "path": {"length": 400.0, "tails": [[0, 0], [0, 1]], "headings": [1.5, 1.5]}},
    "trials": [
        {"link_length": 300.0, "status": "no path", "planner": "track", "reason": "x", "n_links": None,
         "n_poses": None, "joint_range": None, "joint_speed": None, "turning": None, "seconds": 1.0,
         "time_budget": 5.0, "n_actuators": None},
        {"link_length": 200.0, "status": "solved", "planner": "track", "reason": "", "n_links": 5,
         "n_poses": 9, "joint_range": 1.0, "joint_speed": 1.0, "turning": 2.0, "seconds": 1.0,
         "time_budget": 5.0, "n_actuators": 6},
    ],
}  # fmt: skip


def _read_trials(path):
    from planners.length_trials import TrialFile

    file = TrialFile.open(path, "d")
    if file.bound is not None and file.bound.path is not None:
        assert file.bound.path.tips is not None
    assert file.best is None


def _read_lines(path):
    from planners.bench.pool import _read

    _read(path)


def _draw_lines(rng):
    rows = [{"task": ["fig19", 430.0], "seconds": 1.0}, {"task": ["serp", 300.0], "seconds": 2.0}]
    return (
        b"\n".join(mutated_json(row, rng) if rng.random() < 0.6 else json.dumps(row).encode() for row in rows)
        + b"\n"
    )


MANIFEST = {
    "study": "index",
    "runs": [
        {
            "engine": "pool",
            "workers": 2,
            "machine": {"cores": 2, "processor": "x", "python": "3.11"},
            "versions": {},
        }
    ],
}


def _read_manifest(path):
    from planners.bench.campaign import _opened
    from planners.bench.report_rows import machines

    folder = path.parent
    (folder / "manifest.json").write_bytes(path.read_bytes())
    try:
        machines([folder])
        _opened("index", folder).rmdir()
    finally:
        (folder / "manifest.json").unlink()


@functools.cache
def _rows():
    from planners.bench.rows import COLUMNS

    kinds = {"string": "x", "float64": 1.5, "int64": 3, "bool": True}
    return [{name: kinds[kind] for name, kind in COLUMNS.items()} | {"episode": k} for k in range(3)]


def _draw_rows(rng):
    import pyarrow
    from pyarrow import parquet

    file, kind = io.BytesIO(), rng.integers(0, 6)
    rows = mutated_value(_rows(), rng) if kind < 2 else _rows()
    try:
        table = pyarrow.Table.from_pylist(rows)
    except Exception:  # no table at all
        table = pyarrow.Table.from_pylist(_rows())
    if kind == 2:
        column = int(rng.integers(0, table.num_columns))
        other = pyarrow.array(
            [mutations.strange(rng)] * 3 if rng.random() < 0 else [None, None, None], pyarrow.float32()
        )
        table = table.set_column(column, table.column_names[column], other)
    parquet.write_table(table, file)
    return mutated_bytes(file.getvalue(), rng) if kind > 2 else file.getvalue()


def _read_rows(path):
    from hrsnake_env.errors import InputError
    from planners.bench import report_rows
    from planners.bench.rows import read_rows

    with contextlib.suppress(InputError):
        report_rows._read(path)
    read_rows(path)


# The studio


def _request(kind):
    motion = base64.b64encode(_motion_bytes()).decode()
    arm = {"link_length": 300.0, "n_links": None, "link_radius": 8.0, "joint_limit_deg": None}
    drawn = json.dumps(bend().to_geojson()).encode()
    return {
        "plan": {"scene": SCENE, "arm": arm, "planner": "track", "time_budget": 1.0},
        "check": {"scene": SCENE, "arm": arm, "motion": motion},
        "longest": {"scene": SCENE, "link_radius": 0.0, "accuracy": 0.1, "time_budget": 0.1},
        "export": {"format": "csv", "runs": [{"scene": SCENE, "arm": arm, "motion": motion, "title": "t"}]},
        "map": {
            "files": [{"name": "a.geojson", "data": base64.b64encode(drawn).decode()}],
            "options": {"units": "m", "scale": 1.0, "free": ["A"], "wall_thickness": 0.1},
        },
    }[kind]  # fmt: skip


@functools.cache
def _motion_bytes():
    from planners.problem import write_motion_arrays

    file = io.BytesIO()
    write_motion_arrays(file, bend_motion())
    return file.getvalue()


def _draw_request(kind, rng):
    value = _request(kind)
    if kind in ("check", "export") and rng.random() < 0.3:
        holder = value if kind == "check" else value["runs"][0]
        holder["motion"] = base64.b64encode(_draw_motion(rng)).decode()
        return json.dumps(value).encode()
    return mutated_json(value, rng)


class _Desk:
    """Be told, and stop nothing."""

    def tell(self, **news):
        """Be told."""


def _read_request(kind, body):
    from planners.studio.motions import arm_spec, checked, motion_from
    from planners.studio.requests import read_request
    from planners.studio.scene import maze_from_scene
    from planners.studio.tasks import TASKS

    ask = read_request(kind, body)
    if kind in ("map", "export"):
        TASKS[kind](ask, _Desk())
        return
    maze = maze_from_scene(ask.scene)
    if kind == "check":
        checked(ask.arm, motion_from(ask.motion), maze, lambda stage, share: None)
    elif kind == "plan":
        # Within the time that is asked for; a search goes on for long, and has tests of its own.
        plan(maze, arm_spec(ask.arm), "track", time_budget=min(ask.time_budget, 1.0), explain=False)


def _draw_call(rng):
    kind = ["plan", "check", "longest", "export", "map", "nothing"][rng.integers(0, 6)]
    body = _draw_request(kind, rng) if kind != "nothing" else rng.bytes(30)
    headers = {"host": "127.0.0.1", "content-type": "application/json", "content-length": str(len(body))}
    other = mutated_value(headers, rng)
    if rng.random() < 0.4 and isinstance(other, dict):
        headers = {str(key): str(value) for key, value in other.items()}
    path = f"/api/{kind}" if rng.random() < 0.9 else mutated_bytes(b"/api/mazes/fig19", rng).decode("latin1")
    method = "POST" if rng.random() < 0.9 else ["GET", "PUT", "OPTIONS", "x"][rng.integers(0, 4)]
    return {"method": method, "path": path, "headers": headers, "body": body}


@functools.cache
def _app():
    from planners.studio.limits import Limits
    from planners.studio.server import studio_app

    return studio_app(Limits(jobs=0, queue=0, body_idle_s=0.05, body_s=0.5))


def _call(call):
    sent, body = [], [call["body"]]

    async def receive():
        if body:
            return {"type": "http.request", "body": body.pop(), "more_body": False}
        return {"type": "http.disconnect"}

    async def send(message):
        sent.append(message)

    headers = [
        (key.encode("utf-8", "replace").lower(), value.encode("utf-8", "replace"))
        for key, value in call["headers"].items()
    ]
    scope = {"type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "scheme": "http",
             "method": call["method"],
             "path": call["path"], "raw_path": call["path"].encode(), "query_string": b"", "root_path": "",
             "headers": headers, "client": ("127.0.0.1", 5), "server": ("127.0.0.1", 8000)}  # fmt: skip
    asyncio.run(_app()(scope, receive, send))
    status = sent[0]["status"]
    assert status < 500 or status == 503, f"status {status}"


# Environments


def _draw_options(rng):
    options = {"task_id": None, "feed": 20.0, "joint_angles": [0.0, 0.0, 0.0], "goal": [0.0, 500.0]}
    if rng.random() < 0.2:
        options = {"motion": bend_motion(), "waypoint": 3}
    if rng.random() < 0.1:
        options = {"state": mutations.strange(rng)}
    for _ in range(rng.integers(1, 3)):
        keys = [*options, "maze", "task_id", "goal", "state", "motion", "waypoint", "none"]
        options[keys[rng.integers(0, len(keys))]] = mutations.strange(rng)
    if "joint_angles" in options and isinstance(options["joint_angles"], list) and rng.random() < 0.5:
        options["joint_angles"] = mutated_value(options["joint_angles"], rng)
    return options if rng.random() < 0.95 else mutations.strange(rng)


@functools.cache
def _env():
    import gymnasium

    return gymnasium.make(f"hrsnake_env:{STRAIGHT}").unwrapped


def _reset(options):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _env().reset(seed=0, options=options)


READERS = {
    reader.name: reader
    for reader in (
        Reader("motions", ".npz", _draw_motion, _read_motion),
        Reader("motions in space", ".npz", lambda rng: _archive(_spatial_arrays(), rng), _read_spatial),
        Reader("workspaces", ".json", lambda rng: mutated_json(_room().to_dict(), rng), _read_workspace),
        Reader("policies", ".npz", _draw_policy, _read_policy),
        Reader("progress of trainings", ".zip", _draw_progress, _read_progress),
        Reader("models in checkpoints", ".zip", _draw_checkpoint, _read_checkpoint),
        Reader(
            "lessons in checkpoints",
            ".zip",
            lambda rng: packed({"progress.json": b"{}", "model.zip": _archive(_lessons(), rng)}),
            _read_lessons,
        ),
        Reader("settings", ".yml", _draw_settings, _read_settings),
        Reader("states of searches", ".json", lambda rng: mutated_json(TRIALS, rng), _read_trials),
        Reader("rows of studies", ".parquet", _draw_rows, _read_rows),
        Reader("manifests", ".json", lambda rng: mutated_json(MANIFEST, rng), _read_manifest),
        Reader("lines of trials", ".jsonl", _draw_lines, _read_lines),
        *(
            Reader(
                f"studio: {kind}",
                "",
                functools.partial(_draw_request, kind),
                functools.partial(_read_request, kind),
            )
            for kind in ("plan", "check", "longest", "export", "map")
        ),
        Reader("studio: calls", "", _draw_call, _call),
        Reader("reset options", "", _draw_options, _reset),
    )
}
"""All readers by name."""
