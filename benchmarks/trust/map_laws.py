"""What must hold when a map of any content is read, and a check of one input in a process with limits."""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import sys
import sysconfig
import tempfile
import time
import traceback
import warnings
from pathlib import Path

import numpy as np
import shapely

from hrsnake_env.errors import InputError
from hrsnake_env.maps import MapOptions, read_map
from hrsnake_env.maze import Maze

__all__ = ["LAWS", "MEMORY", "SECONDS", "SLOW", "fault_of", "limit_memory", "watch_files"]

LAWS = {
    "sentence": "refused in one printable sentence of fewer than 500 characters, or read without a warning",
    "reading": "what is read is a valid free space with printable notes, and its maze is valid or refused",
    "time": "at most 2 s of processor time, and never 10 s",
    "memory": "at most 1 GiB more",
    "files": "no file is written, none read but the map and the image that it names; no program, no network",
}

SENTENCE, SLOW, SECONDS, MEMORY = 500, 2.0, 10.0, 2**30

OWN = tuple(
    {os.path.realpath(path) for path in (*sysconfig.get_paths().values(), sys.prefix, sys.base_prefix)}
)
OWN += (
    str(Path(__file__).parent.parent.parent / "hrsnake_env"),
    str(Path(__file__).parent.parent.parent / "planners"),
)
"""Where Python and the project import from."""

FORBIDDEN = (
    "os.remove",
    "os.rename",
    "os.mkdir",
    "os.rmdir",
    "os.link",
    "os.symlink",
    "os.truncate",
    "os.chmod",
)
FORBIDDEN += (
    "subprocess.Popen",
    "os.system",
    "os.exec",
    "os.posix_spawn",
    "os.fork",
    "socket.connect",
    "urllib.Request",
)

seen: list[tuple[str, str]] = []
"""What the audit hook has seen while `seen_on` is set: event and path."""

watching = {"on": False}


def watch_files():
    """Have Python tell of every file that is opened, in this process, for good."""

    def hook(event, arguments):
        if not watching["on"]:
            return
        if event == "open":
            path, mode, flags = arguments
            writes = bool((flags or 0) & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)) or any(
                c in (mode or "") for c in "wax+"
            )
            seen.append(
                (
                    "write" if writes else "read",
                    os.fsdecode(path) if isinstance(path, str | bytes | os.PathLike) else "",
                )
            )
        elif event in FORBIDDEN:
            seen.append((event, str(arguments[0]) if arguments else ""))

    sys.addaudithook(hook)


def limit_memory():
    """Let this process have no more than `MEMORY` more than it has now."""
    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, now + MEMORY))


def fault_of(given, folder):
    """Read an input; return the law that was broken and how, or None.

    Parameters
    ----------
    given : Input
    folder : Path
        Empty; for the input's files.
    """
    for name, data in given.files.items():
        (folder / name).write_bytes(data)
    seen.clear()
    begin, wrong = time.process_time(), None
    watching["on"] = True
    try:
        with warnings.catch_warnings():
            for kind in (RuntimeWarning, UserWarning, DeprecationWarning):
                warnings.simplefilter("error", kind)
            wrong = _read(given, folder)
    except InputError as error:
        wrong = _wrong_sentence(str(error))
    except MemoryError:
        wrong = "memory", traceback.format_exc(limit=-3)
    except Exception:
        wrong = "sentence", traceback.format_exc(limit=-4)
    finally:
        watching["on"] = False
    taken = time.process_time() - begin
    if wrong is None and taken > SLOW:
        wrong = "time", f"{taken:.1f} s"
    return wrong or _wrong_file(given, folder)


def _wrong_sentence(text):
    if text.isprintable() and 0 < len(text) < SENTENCE:
        return None
    return "sentence", f"{len(text)} characters: {text[:200]!r}"


def _read(given, folder):
    """Read an input as it says; return what is wrong with the reading."""
    source = folder / given.main
    if given.how == "cli":
        return _wrong_command(source)
    if given.how == "maze":
        maze = Maze.load(source)
        return _wrong_maze(maze)
    files = None
    if given.how == "upload":

        def files(name):
            if name not in given.files:
                raise InputError("Expected another file.")
            return given.files[name]

        source = given.main
    reading = read_map(source, MapOptions(**given.options), files)
    free = reading.free_space
    if free.is_empty or not free.is_valid or not np.isfinite(free.bounds).all():
        return "reading", f"free space: {shapely.is_valid_reason(free)}, bounds {free.bounds}"
    texts = (reading.name, reading.units, *reading.notes, *reading.layers)
    if not all(text.isprintable() for text in texts):
        return "reading", f"texts that terminals cannot show: {texts!r:.200}"
    if not 0.0 <= reading.moved <= reading.tolerance * (1.0 + 1e-9):
        return "reading", f"walls moved by {reading.moved!r}, more than {reading.tolerance!r}"
    base = np.array(reading.parts[0].representative_point().coords[0])
    goal = base + 0.3 * (np.array(reading.parts[0].exterior.coords[0])[:2] - base)
    pose = None if reading.base_pose is not None else (*map(float, base), 0.5)
    place = None if reading.goal is not None else tuple(map(float, goal))
    try:
        maze = reading.maze(base_pose=pose, goal=place)
    except InputError as error:
        return _wrong_sentence(str(error))
    return _wrong_maze(maze)


def _wrong_maze(maze):
    if not (maze.free_space.is_valid and np.isfinite(maze.walls).all() and maze.goal_radius > 0.0):
        return "reading", f"maze: {shapely.is_valid_reason(maze.free_space)}"
    if not (maze.name.isprintable() and maze.units.isprintable()):
        return "reading", f"maze with a name that terminals cannot show: {maze.name!r:.100}"
    again = Maze.from_geojson(json.loads(json.dumps(maze.to_geojson())))
    if again.name != maze.name or not np.array_equal(again.goal, maze.goal):
        return "reading", "the maze is another one after it was written and read"
    return None


def _wrong_command(source):
    """Run `hrsnake import`; return what is wrong with how it ends."""
    from planners.cli import main

    said, complained = io.StringIO(), io.StringIO()
    old, sys.argv = sys.argv, ["hrsnake", "import", str(source)]
    code = None
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
            main()
    except SystemExit as ended:
        code = ended.code or 0
    finally:
        sys.argv = old
    if code not in (0, 2):
        return "sentence", f"exit code {code}"
    text = complained.getvalue() if code else said.getvalue()
    if not text.replace("\n", "").isprintable() or "Traceback" in text or (code and text.count("\n") != 1):
        return "sentence", f"printed: {text[:300]!r}"
    try:
        text.encode()
    except UnicodeEncodeError:
        return "sentence", "printed what cannot be written"
    return None


def _wrong_file(given, folder):
    """Tell whether a file was touched that should not have been."""
    yaml = given.files[given.main] if given.main.endswith((".yaml", ".yml")) else b""
    for event, path in seen:
        real = os.path.realpath(path) if path else ""
        if event == "read":
            inside = Path(real).parent == Path(os.path.realpath(folder))
            named = yaml and given.how != "upload" and Path(real).name.encode() in yaml
            ours = real.startswith(OWN) or not path
            if (inside and given.how != "upload") or named or ours or real.startswith(("/usr/", "/lib")):
                continue
        elif event == "write" and "__pycache__" in path:
            continue
        return "files", f"{event} {path!r}"
    extra = [each.name for each in folder.iterdir() if each.name not in given.files]
    return ("files", f"written: {extra}") if extra else None


@contextlib.contextmanager
def empty_folder():
    """Yield a folder for inputs that is taken away in the end."""
    with tempfile.TemporaryDirectory(prefix="maps-") as folder:
        yield Path(folder)
