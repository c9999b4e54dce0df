"""Laws of the code itself: nothing that comes from outside is run."""

import ast
from pathlib import Path

import pytest

FOLDERS = ("hrsnake_env", "planners")

RUNS_TEXT = ("eval", "exec", "compile", "__import__", "os.system", "os.popen")

UNPICKLES = (
    *("pickle.load", "pickle.loads", "pickle.Unpickler", "cloudpickle.load", "cloudpickle.loads"),
    *("marshal.load", "marshal.loads", "shelve.open", "dill.load", "dill.loads", "joblib.load"),
    *("pandas.read_pickle", "pd.read_pickle", "load_replay_buffer", "load_from_pkl"),
)

PICKLES = ("pickle", "marshal", "shelve")
"""Modules that are not imported at all."""

UNSAFE_YAML = ("yaml.load", "yaml.load_all", "yaml.unsafe_load", "yaml.full_load")

ALLOWED: dict[tuple[str, str], str] = {}
"""Exceptions, by file and call, with their reasons. There are none."""


def sources():
    """Return all Python files of both packages."""
    return [path for folder in FOLDERS for path in sorted(Path(folder).rglob("*.py"))]


def name_of(call):
    """Return what is called, as it is written."""
    return ast.unparse(call.func)


def faults_in(text, file="x.py"):
    """Return the calls in a source that run or unpickle what comes from outside."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            plain = isinstance(node, ast.Import)
            names = [alias.name for alias in node.names] if plain else [node.module or ""]
            found += [f"import {name}" for name in names if name.split(".")[0] in PICKLES]
        if not isinstance(node, ast.Call):
            continue
        name, keywords = name_of(node), {each.arg: each.value for each in node.keywords}
        last = name.rpartition(".")[2]
        given = {key: ast.unparse(value) for key, value in keywords.items() if key is not None}
        if name in RUNS_TEXT or name in UNPICKLES or last in UNPICKLES or name in UNSAFE_YAML:
            found.append(name)
        if given.get("allow_pickle", "False") != "False" or given.get("shell", "False") != "False":
            found.append(f"{name} with {given}")
        if name in ("np.load", "numpy.load", "np.lib.format.read_array") and "allow_pickle" not in given:
            found.append(f"{name} without allow_pickle=False")
        if name in ("torch.load", "th.load") and given.get("weights_only") != "True":
            found.append(f"{name} without weights_only=True")
        if last == "load_from_zip_file" and given.get("load_data") != "False":
            found.append(f"{name} without load_data=False")
    return [each for each in found if (file, each) not in ALLOWED]


@pytest.mark.parametrize("path", sources(), ids=str)
def test_nothing_from_outside_is_run_or_unpickled(path):
    assert faults_in(path.read_text(encoding="utf-8"), path.as_posix()) == []


@pytest.mark.parametrize(
    "text",
    [
        "eval(text)",
        "exec(text)",
        "os.system(text)",
        "import pickle",
        "from pickle import loads",
        "pickle.loads(data)",
        "np.load(file)",
        "np.load(file, allow_pickle=True)",
        "np.load(file, allow_pickle=wanted)",
        "yaml.load(text, Loader=yaml.Loader)",
        "torch.load(file)",
        "torch.load(file, weights_only=False)",
        "subprocess.run(text, shell=True)",
        "model.load_replay_buffer(file)",
        "load_from_zip_file(file)",
    ],
)
def test_a_call_that_would_run_something_is_found(text):
    assert faults_in(text)


@pytest.mark.parametrize(
    "text",
    [
        "np.load(file, allow_pickle=False)",
        "yaml.safe_load(text)",
        "torch.load(file, weights_only=True)",
        "re.compile(text)",
        "subprocess.run([name])",
    ],
)
def test_a_call_that_runs_nothing_is_let_be(text):
    assert faults_in(text) == []


def test_there_are_sources_to_look_at():
    assert len(sources()) > 200
