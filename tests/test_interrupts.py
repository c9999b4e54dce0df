"""Ctrl-C comes through, once nothing can break by it."""

import os
import signal
import subprocess
import sys
import time
import types
from pathlib import Path

import pytest

from planners.interrupts import careful_interrupts, in_foreign_code, interruption_first

ROOT = Path(__file__).parents[1]


def in_module(name, function="work"):
    """Return a function of some module that calls what it is given."""
    module = types.ModuleType(name)
    exec(f"def {function}(call):\n    return call()", module.__dict__)
    return module.__dict__[function]


def seen_in(module, function="work"):
    """Tell whether a frame below a module's function counts as foreign code."""
    return in_module(module, function)(lambda: in_foreign_code(sys._getframe()))


@pytest.mark.parametrize(
    "module",
    [
        "pymunk.space",
        "cffi.api",
        "llvmlite.binding.ffi",
        "matplotlib.path",
        "numba.core.serialize",
        "namedtuple_3",
        "weakref",
    ],
)
def test_what_c_calls_is_foreign_code(module):
    assert seen_in(module)


@pytest.mark.parametrize("module", ["planners.longest", "numba.core.compiler", "pymunked", "importlib"])
def test_what_python_calls_is_not(module):
    assert not seen_in(module)
    assert seen_in(module, "__del__")


def press(times=1, wait=0.05):
    """Press Ctrl-C, and work on for a while."""
    for _ in range(times):
        os.kill(os.getpid(), signal.SIGINT)
    end = time.monotonic() + wait
    while time.monotonic() < end:
        pass
    return "worked on"


def test_ctrl_c_waits_until_foreign_code_has_ended():
    reached = []
    with pytest.raises(KeyboardInterrupt), careful_interrupts():
        reached.append(in_module("pymunk.space")(press))
        press(0, 1.0)
        reached.append("too far")
    assert reached == ["worked on"]


def test_ctrl_c_raises_at_once_in_our_own_code():
    with pytest.raises(KeyboardInterrupt), careful_interrupts():
        press(1, 0.0)
        pytest.fail("it went on")


def test_a_second_ctrl_c_raises_wherever_it_comes():
    with pytest.raises(KeyboardInterrupt), careful_interrupts():
        in_module("pymunk.space")(lambda: (press(wait=0.0), press(wait=0.0)))
        pytest.fail("it went on")


def test_ctrl_c_that_waits_at_the_end_is_not_lost():
    with pytest.raises(KeyboardInterrupt), careful_interrupts():
        in_module("pymunk.space")(lambda: press(wait=0.0))
    press(0, 0.05)  # and it does not come twice


def test_ctrl_c_that_waits_comes_before_an_error():
    with pytest.raises(KeyboardInterrupt), careful_interrupts():
        in_module("pymunk.space")(lambda: press(wait=0.0))
        raise BrokenPipeError("of a child that Ctrl-C has ended")


def test_a_library_that_fails_after_ctrl_c_does_not_hide_it():
    with pytest.raises(KeyboardInterrupt), interruption_first():
        try:
            raise KeyboardInterrupt
        finally:
            [][0]
    with pytest.raises(IndexError), interruption_first():
        [][0]


def test_ctrl_c_while_the_command_loads_is_one_sentence():
    press_it = (
        "import os, signal, sys, hrsnake\n"
        "def hook(event, arguments):\n"
        "    if event == 'import' and arguments[0] == 'planners.planning':\n"
        "        os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.addaudithook(hook)\n"
        "sys.argv = ['hrsnake', '--help']\n"
        "hrsnake.main()\n"
    )
    run = subprocess.run([sys.executable, "-c", press_it], cwd=ROOT, capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (130, "")
    assert run.stderr == "hrsnake: stopped; no half-written file is left.\n"


@pytest.mark.parametrize("handler", [signal.SIG_IGN, lambda *_: None])
def test_what_else_handles_ctrl_c_stays(handler):
    before = signal.signal(signal.SIGINT, handler)
    try:
        with careful_interrupts():
            assert signal.getsignal(signal.SIGINT) is handler
            press(wait=0.0)
    finally:
        signal.signal(signal.SIGINT, before)
    with careful_interrupts():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before
