"""Read from the sources: a test calls every public kernel, and none hands Python a named tuple."""

import ast
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("hrsnake_env", "planners")
CALLERS = ("tests", "benchmarks/trust")

THROUGH_PYTHON = frozenset({"planners.kernels.sweep.grow_track"})
"""Public kernels that tests call through `planners.sweep_track.grow`."""


@cache
def tree_of(path):
    return ast.parse(path.read_text())


def module_name(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def modules():
    """Return the sources of both packages by name of the module."""
    return {module_name(path): path for package in PACKAGES for path in (ROOT / package).rglob("*.py")}


def is_kernel(node):
    """Tell whether a definition is compiled: decorated by njit, or numba.njit."""
    if not isinstance(node, ast.FunctionDef):
        return False
    names = {
        getattr(part, "id", getattr(part, "attr", "")) for d in node.decorator_list for part in ast.walk(d)
    }
    return "njit" in names


@cache
def kernels():
    """Return the definition of each kernel by (module, name)."""
    return {
        (name, node.name): node
        for name, path in modules().items()
        for node in tree_of(path).body
        if is_kernel(node)
    }


@cache
def imported(path):
    """Return what names mean in a source: (module, name) or (module, None)."""
    meaning = {}
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                meaning[alias.asname or alias.name] = (node.module, alias.name)
        elif isinstance(node, ast.Import):
            for alias in node.names:
                if alias.asname:
                    meaning[alias.asname] = (alias.name, None)
    return meaning


@cache
def source_of(module, name):
    """Follow a name through the modules that only hand it on, to where it is defined."""
    path = modules().get(module)
    if path is None or any(getattr(node, "name", None) == name for node in tree_of(path).body):
        return module, name
    return source_of(*imported(path)[name]) if imported(path).get(name, ("", None))[1] else (module, name)


def called(path, nodes):
    """Return what is called in some nodes of a source, as (module, name)."""
    found, meaning, here = set(), imported(path), module_name(path)
    for node in (part for whole in nodes for part in ast.walk(whole) if isinstance(part, ast.Call)):
        if isinstance(node.func, ast.Name):
            module, name = meaning.get(node.func.id, (here, node.func.id))
            found.add(source_of(module, name))
        elif isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name):
            module, part = meaning.get(node.func.value.id, ("", None))
            found.add(source_of(module if part is None else f"{module}.{part}", node.func.attr))
    return found


def test_every_public_kernel_is_called_by_name_in_a_test():
    in_tests = set()
    for folder in CALLERS:
        for path in (ROOT / folder).glob("*.py"):
            in_tests |= called(path, [tree_of(path)])
    public = {key for key in kernels() if not key[1].startswith("_")}
    missing = {f"{module}.{name}" for module, name in public - in_tests} - THROUGH_PYTHON
    assert len(public) > 100
    assert not missing, f"No test calls these kernels: {', '.join(sorted(missing))}."


def test_no_kernel_hands_python_a_named_tuple():
    # numba makes a named tuple by calling Python's own code. Ctrl-C may arrive there, and numba then crashes.
    named = {
        node.name
        for path in modules().values()
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.ClassDef)
        and any(getattr(base, "id", "") == "NamedTuple" for base in node.bases)
    }
    assert {"FedScene", "Grid", "Ways"} <= named
    returning = {
        key
        for key, node in kernels().items()
        if any(isinstance(part, ast.Name) and part.id in named for part in ast.walk(node.returns))
    }
    to_python = set()
    for path in modules().values():
        plain = [node for node in tree_of(path).body if not is_kernel(node)]
        to_python |= called(path, plain)
    guilty = {f"{module}.{name}" for module, name in returning & to_python}
    assert not guilty, f"These kernels return a named tuple to Python: {', '.join(sorted(guilty))}."
