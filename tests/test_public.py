"""What the packages say that they offer is there, and explained."""

import importlib
import inspect
import pkgutil

import pytest

import hrsnake_env
import planners

MODULES = sorted(
    module.name
    for package in (hrsnake_env, planners)
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
)


@pytest.mark.parametrize("name", ["hrsnake_env", "planners", *MODULES])
def test_all_names_exist_and_are_documented(name):
    module = importlib.import_module(name)
    assert module.__doc__
    for public in getattr(module, "__all__", []):
        value = getattr(module, public)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert value.__doc__, f"{name}.{public}"


def test_importing_the_world_does_not_load_the_simulator():
    import subprocess
    import sys

    code = "import sys, hrsnake_env; sys.exit('pymunk' in sys.modules or 'matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
