"""Steps per second beside other environments, each in a process of its own, in turns."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import venv
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import IO, Any

import numpy as np

from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.bench.environment_scenes import ENV_ID, arm_in_hall, half_out, hall
from planners.bench.environment_stepper import HOLD
from planners.bench.pool import Tell

__all__ = ["HOLDS", "PEERS", "TARGETS", "beside_peers", "ours_in_hall", "peers_python", "spread", "stepping"]

PEERS: dict[str, dict[str, Any]] = {
    "gym-pusht": {"make": "gym_pusht:gym_pusht/PushT-v0", "arguments": {"obs_type": "state"}},
    "Swimmer-v5": {"make": "Swimmer-v5"},
}
"""What is measured beside: gym-pusht runs on pymunk, Swimmer on MuJoCo."""

REQUIREMENTS = ("gym-pusht==0.1.8", "gymnasium[mujoco]==1.4.0")
"""gym-pusht needs an older pymunk than ours, so the peers have an environment of their own."""

LINKS = {12: "gym-pusht", 45: "Swimmer-v5"}
"""Links of our arms, and what they are compared with."""

SUBSTEPS = (1, 2, 4)

HOLDS = (1, HOLD)
"""Steps for which a random action is held: a new one in every step is the custom, held ones move the arm."""

TARGETS = {(12, 1): 4.0, (12, 2): 4.0, (12, 4): 4.0, (45, 1): 1.2, (45, 2): 0.6}
"""Ratios that we want to reach, by links and substeps."""

WARM_UP = 0.3
"""Seconds of steps before the first that count."""

READY = "ready.json"


def peers_python(folder: Path) -> Path:
    """Return the Python that has the peers; made with venv and pip the first time.

    Parameters
    ----------
    folder : Path
        Of the virtual environment; made if missing.

    Raises
    ------
    InputError
        If it cannot be made, as without a network.
    """
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    ready = folder / READY
    if ready.exists() and json.loads(ready.read_text(encoding="utf-8")) == list(REQUIREMENTS):
        return python
    if folder.exists() and any(folder.iterdir()) and not (folder / "pyvenv.cfg").exists():
        raise InputError(
            f"Expected a virtual environment, or nothing yet, in '{folder}', got something else."
        )
    print(f"Installing {' and '.join(REQUIREMENTS)} in '{folder}', once.", file=sys.stderr)
    try:
        venv.create(folder, with_pip=True, clear=True)
        install = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        subprocess.run([*install, *REQUIREMENTS], check=True, capture_output=True, text=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise InputError(
            f"Expected pip to install {' and '.join(REQUIREMENTS)} in '{folder}' (it needs a network; "
            f"--peers-python names a Python that has them), got: {_last_line(error)}"
        ) from None
    with replacing(ready) as part:
        part.write_text(json.dumps(REQUIREMENTS), encoding="utf-8")
    return python


def _last_line(error: Exception) -> str:
    said = str(getattr(error, "stderr", None) or getattr(error, "output", None) or error)
    return said.strip().splitlines()[-1] if said.strip() else type(error).__name__


@contextmanager
def stepping(
    python: Path | str, order: Mapping[str, Any], script: Path | None = None
) -> Iterator[Callable[[float], dict[str, float]]]:
    """Start a process that steps through one environment; it ends with the block.

    Parameters
    ----------
    python : Path or str
        Which Python.
    order : mapping
        What it makes: `make` (an id), `arguments`, `options`, `seed`, `hold`.
    script : Path, optional
        By default `environment_stepper.py`.

    Yields
    ------
    run : callable
        Lets it step for so many seconds of its processor's time, and returns what it has counted.

    Raises
    ------
    InputError
        If the environment cannot be made or stepped through there; now, or by `run`.
    """
    script = Path(__file__).with_name("environment_stepper.py") if script is None else script
    root = str(Path(__file__).parents[2])  # so that it also runs from a checkout that is not installed
    path = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    one_thread = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environ = {**os.environ, **one_thread, "PYTHONPATH": path}
    with tempfile.TemporaryFile("w+") as said:
        try:
            process = subprocess.Popen(
                [str(python), "-P", str(script)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=said,
                text=True,
                env=environ,
            )
        except OSError as error:
            raise InputError(f"Expected a Python to run, got '{python}': {error.strerror}.") from None
        try:
            _ask(process, order, order["make"], said)
            yield lambda seconds: _ask(process, {"run": seconds}, order["make"], said)
        finally:
            process.kill()
            process.communicate()


def _ask(
    process: subprocess.Popen[str], order: Mapping[str, Any], name: str, said: IO[str]
) -> dict[str, Any]:
    assert process.stdin is not None and process.stdout is not None
    answer = ""
    with suppress(BrokenPipeError):
        process.stdin.write(json.dumps(order) + "\n")
        process.stdin.flush()
        answer = process.stdout.readline()
    if answer:
        return dict(json.loads(answer))
    process.wait()
    said.seek(0)
    lines = said.read().strip().splitlines() or ["nothing"]
    raise InputError(f"Expected steps of '{name}', got: {lines[-1]}")


def ours_in_hall(maze_file: Path) -> dict[tuple[int, int], dict[str, Any]]:
    """Return the orders for our arms, by links and substeps."""
    hall().save(maze_file)
    return {
        (n_links, substeps): {
            "make": ENV_ID,
            "arguments": arm_in_hall(n_links, maze_file, substeps),
            "options": half_out(),
        }
        for n_links in LINKS
        for substeps in SUBSTEPS
    }


@contextmanager
def _contenders(
    python: Path | str, peers: Mapping[str, Mapping[str, Any]], hold: int
) -> Iterator[dict[Any, Callable[[float], dict[str, float]]]]:
    """Start one process for each environment; they end with the block."""
    with ExitStack() as stack, tempfile.TemporaryDirectory() as folder:
        orders: dict[Any, tuple[Path | str, Mapping[str, Any]]] = {
            key: (python, order) for key, order in peers.items()
        }
        ours = ours_in_hall(Path(folder) / "hall.geojson")
        orders |= {key: (sys.executable, order) for key, order in ours.items()}
        yield {
            key: stack.enter_context(stepping(python, {**order, "hold": hold}))
            for key, (python, order) in orders.items()
        }


def beside_peers(
    python: Path | str,
    window: float,
    rounds: int,
    tell: Tell = lambda: None,
    *,
    hold: int = HOLD,
    peers: Mapping[str, Mapping[str, Any]] = PEERS,
) -> dict[str, Any]:
    """Measure peers and ours in turns, and compare them round by round.

    Parameters
    ----------
    python : Path or str
        That has the peers.
    window : float
        Seconds of processor time for each of them in each round.
    rounds : int
        So many.
    tell : callable
        Called after each round.
    hold : int
        So many steps each random action is held.
    peers : mapping
        What is measured beside, by the names of `PEERS`.

    Returns
    -------
    figures : dict
        Rates of the peers, and of ours with their ratios, steps with a collision, and targets.
    """
    with _contenders(python, peers, hold) as contenders:
        for run in contenders.values():
            run(min(WARM_UP, window))
        every: dict[Any, list[dict[str, float]]] = {key: [] for key in contenders}
        for _ in range(rounds):
            for key in _in_turns(peers):
                every[key].append(contenders[key](window))
            tell()
    rates = {key: [run["steps"] / run["seconds"] for run in runs] for key, runs in every.items()}
    return {
        "window_s": window,
        "rounds": rounds,
        "hold": hold,
        "peers": [{"name": name, "rate": spread(rates[name])} for name in peers],
        "ours": [_row(key, every[key], rates) for key in every if key not in peers],
    }


def _in_turns(peers: Mapping[str, Any]) -> list[Any]:
    """Return the order of a round: each peer, and then those of ours that are compared with it."""
    turns: list[Any] = []
    for peer in peers:
        ours = [n_links for n_links, other in LINKS.items() if other == peer]
        turns += [peer, *((n_links, substeps) for n_links in ours for substeps in SUBSTEPS)]
    return turns


def _row(
    key: tuple[int, int], runs: Sequence[Mapping[str, float]], rates: Mapping[Any, Sequence[float]]
) -> dict[str, Any]:
    n_links, substeps = key
    peer = LINKS[n_links]
    ratios = [ours / theirs for ours, theirs in zip(rates[key], rates[peer], strict=True)]
    steps = sum(run["steps"] for run in runs)
    return {
        "n_links": n_links,
        "substeps": substeps,
        "rate": spread(rates[key]),
        "peer": peer,
        "ratio": spread(ratios),
        "target": TARGETS.get(key),
        "steps": steps,
        "resets": sum(run["resets"] for run in runs),
        "touched": sum(run["touched"] for run in runs) / steps,
    }


def spread(values: Sequence[float]) -> dict[str, float]:
    """Return median, least and largest."""
    return {"median": float(np.median(values)), "least": min(values), "largest": max(values)}
