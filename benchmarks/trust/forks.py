"""The `hrsnake` command in a forked child of a warm process, for attacks that need hundreds of runs."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from pathlib import Path

from planners import cli

WRITES = ("open", "os.rename", "os.remove", "os.mkdir", "os.truncate")
"""Events of Python's audit at which a file appears, changes its name, or goes."""

PATIENCE_S = 120.0
"""After which a child hangs."""


class Child:
    """Run a command in a process group of its own, in some folder; its words go to files beside the folder.

    Parameters
    ----------
    arguments : sequence of str
        Of `hrsnake`.
    folder : Path
        Where it runs.
    prepare : callable
        Called in the child first.
    """

    def __init__(self, arguments, folder, prepare=lambda: None):
        self.said = {name: folder.parent / f"{folder.name}.{name}" for name in ("out", "err")}
        sys.stdout.flush()
        sys.stderr.flush()
        self.started = time.monotonic()
        self.pid = os.fork()
        if self.pid == 0:
            self._be_it(arguments, folder, prepare)
        self.code = None

    def _be_it(self, arguments, folder, prepare):
        code = 1
        try:
            os.setsid()
            os.chdir(folder)
            for number, name in ((1, "out"), (2, "err")):
                file = os.open(self.said[name], os.O_CREAT | os.O_TRUNC | os.O_WRONLY, 0o666)
                os.dup2(file, number)
            # Workers are forked, too: to import everything anew would take most of the time.
            get = multiprocessing.get_context
            multiprocessing.get_context = lambda method=None: get("fork")
            sys.argv = ["hrsnake", *map(str, arguments)]
            signal.signal(signal.SIGINT, signal.default_int_handler)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            prepare()
            cli.main()
        except SystemExit as end:
            code = end.code or 0
        except BaseException:
            traceback.print_exc()
        finally:
            try:
                sys.stdout.flush()
                sys.stderr.flush()
                threading._shutdown()
            except BaseException:
                traceback.print_exc()
            os._exit(code if isinstance(code, int) else 1)

    def wait(self, seconds=PATIENCE_S):
        """Return the exit code, negative for a signal; None if it still runs after so long.

        A campaign that is itself stopped meanwhile takes the child with it.
        """
        end = time.monotonic() + seconds
        try:
            while not self._has_ended():
                if time.monotonic() > end:
                    return None
                time.sleep(0.002)
        except BaseException:
            self.send(signal.SIGKILL)
            while not self._has_ended():
                time.sleep(0.002)
            raise
        return self.code

    def _has_ended(self):
        if self.code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self.code = os.waitstatus_to_exitcode(status)
        return self.code is not None

    def send(self, number, group=True):
        """Send a signal to it, or to all its processes."""
        with contextlib.suppress(ProcessLookupError):
            (os.killpg if group else os.kill)(self.pid, number)

    def left(self, seconds=20.0):
        """Tell whether processes of its group are still there after it has ended, and end them."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if not _group_lives(self.pid):
                return False
            time.sleep(0.01)
        self.send(signal.SIGKILL)
        return True

    def words(self, name="err"):
        """Return what it has said."""
        return self.said[name].read_text(errors="replace") if self.said[name].exists() else ""


def _group_lives(group):
    """Tell whether a process group has a process that is no zombie (of nobody who asks for its end)."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False  # the common case, without a look at all processes
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, its_group = (entry / "stat").read_text().rpartition(")")[2].split()[:3]
            except (OSError, ValueError):
                continue
            if int(its_group) == group and state != "Z":
                return True
    return False


def stopped(campaign):
    """Run a campaign; tell whether Ctrl-C, or the signal that ends a process, stopped it.

    Both come as exceptions, so that temporary folders, mounts and children go before this process does.
    """

    def end(*_):
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once is enough
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, end)
    try:
        campaign()
    except KeyboardInterrupt:
        return True
    finally:
        signal.signal(signal.SIGTERM, before)
    return False


def run(arguments, folder, prepare=lambda: None):
    """Run a command to its end; return its child."""
    child = Child(arguments, folder, prepare)
    child.wait()
    return child


def at_write(number, delay, act):
    """Return what lets a child do something a moment after its n-th event of writing (from 0)."""

    def prepare():
        seen = 0

        def hook(event, arguments):
            nonlocal seen
            if event in WRITES and _writes(event, arguments):
                seen += 1
                if seen == number + 1:
                    act(delay)

        sys.addaudithook(hook)

    return prepare


def _writes(event, arguments):
    """Leave out what is only read, and what is not in the child's folder."""
    path = arguments[0]
    if event == "open" and not (isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR)):
        return False
    here = os.getcwd()
    return isinstance(path, str | os.PathLike) and os.path.realpath(path).startswith(here + os.sep)


def die(delay):
    """Die without a word: at once, or a moment later in the midst of what comes next."""
    if delay <= 0.0:
        os.kill(os.getpid(), signal.SIGKILL)
    else:
        signal.setitimer(signal.ITIMER_REAL, delay)  # nobody handles it: it ends the process


def files_in(folder):
    """Return the names of all files and folders below a folder, sorted."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))
