"""What is killed, stopped, or cannot be written loses nothing; `benchmarks/trust` tries it many times."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="the campaigns fork")

ROOT = Path(__file__).parents[1]


def campaign(name, *options, cwd):
    """Run a campaign with a small count; return what it says, and fail with its faults."""
    (cwd / "docs").mkdir()
    (cwd / "docs" / "maps").symlink_to(ROOT / "docs" / "maps")
    run = subprocess.run(
        [sys.executable, "-m", f"benchmarks.trust.{name}", *options],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


def test_commands_that_are_killed_lose_nothing(tmp_path):
    pytest.importorskip("minari")
    names = ("longest --state", "dataset", "export")
    said = campaign("kills", "--count", "1", *(w for n in names for w in ("--command", n)), cwd=tmp_path)
    assert all(re.search(rf"{name}: \d+ runs, 1 of them killed", said) for name in names)


def test_ctrl_c_ends_commands_with_one_sentence(tmp_path):
    pytest.importorskip("minari")
    said = campaign("ctrl_c", "--count", "2", "--command", "draw", "--command", "longest", cwd=tmp_path)
    assert said.count("2 times") == 2


def test_a_command_that_cannot_write_says_so_and_leaves_the_old_file(tmp_path):
    pytest.importorskip("minari")
    said = campaign("disk", "--command", "plan --out", "--command", "export .gif", cwd=tmp_path)
    assert "limit of size: 2 commands, 0 faults" in said


def test_output_that_cannot_be_printed_is_one_sentence():
    if not Path("/dev/full").exists():
        pytest.skip("no full device here")
    with open("/dev/full", "w") as full:
        run = subprocess.run(
            [sys.executable, "-m", "planners", "--help"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            cwd=ROOT,
        )
    assert run.returncode == 2
    assert run.stderr.startswith("hrsnake: Expected files") and run.stderr.count("\n") == 1
