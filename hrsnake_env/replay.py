"""A run, or two side by side, as one HTML file that opens anywhere, with nothing else beside it."""

from __future__ import annotations

import base64
import importlib.resources
import math
import os
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.appearance import COLOURS, FAR, FEEDER_SHARE
from hrsnake_env.arm import FloatArray
from hrsnake_env.contacts import PINCH_TOLERANCE, Contact
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from hrsnake_env.maze import Maze
from hrsnake_env.pages import filled, framed

__all__ = ["QUANTUM", "Trace", "replay_html", "replay_payload", "save_replay", "show"]

QUANTUM = 1e-4
"""In link lengths: the page holds places and clearances as whole multiples of it. No coordinate is off by
more than half of it, a twentieth of the pinch tolerance."""

FARTHEST = 1e9
"""In link lengths: places farther from the base than this cannot be shown."""

MAX_TRACES = 2

IntArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """Hold what one run shows in a replay.

    Parameters
    ----------
    title : str
        What ran: the maze, the planner or learner.
    maze : Maze
        In which it ran.
    joints : array, shape (n_poses, n_links + 1, 2)
        Joint positions, base end first, in maze units.
    link_length, link_radius : float
        In maze units.
    timestep : float
        From one pose to the next, in s.
    clearances : array, shape (n_poses, n_links), optional
        Of each link, in maze units; negative is the depth. None if they were not measured.
    contacts : sequence with one entry per pose, optional
        The contacts of each pose. None if they were not recorded.
    clean : bool, optional
        The verdict: whether links merely pinched the walls. None if there is none.
    summary : sequence of str
        Lines that say more of the verdict.

    Raises
    ------
    InputError
        If there is no pose, a shape is not as said, or a number is not finite.
    """

    title: str
    maze: Maze
    joints: FloatArray
    link_length: float
    timestep: float
    link_radius: float = 0.0
    clearances: FloatArray | None = None
    contacts: Sequence[Sequence[Contact]] | None = None
    clean: bool | None = None
    summary: Sequence[str] = ()

    def __post_init__(self) -> None:
        joints = np.array(self.joints, dtype=np.float64)
        if joints.ndim != 3 or joints.shape[1] < 2 or joints.shape[2] != 2:
            raise InputError(f"Expected joints with shape (n_poses, n_links + 1, 2), got {joints.shape}.")
        if len(joints) == 0:
            raise InputError("Expected a run with at least one pose, got an empty one.")
        for name in ("link_length", "timestep"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise InputError(f"Expected a positive, finite {name}, got {getattr(self, name)!r}.")
        if not 0.0 <= self.link_radius < math.inf:
            raise InputError(f"Expected a finite link_radius of at least 0, got {self.link_radius!r}.")
        reach = FARTHEST * self.link_length
        _check_numbers("joints", joints - self.maze.base_pose[:2], reach)
        self._keep("joints", joints)
        if self.clearances is not None:
            clearances = np.array(self.clearances, dtype=np.float64)
            if clearances.shape != (self.n_poses, self.n_links):
                raise InputError(
                    f"Expected clearances with shape {(self.n_poses, self.n_links)}, got {clearances.shape}."
                )
            _check_numbers("clearances", clearances, reach)
            self._keep("clearances", clearances)
        if self.contacts is not None:
            self._check_contacts(self.contacts, reach)
            object.__setattr__(self, "contacts", tuple(map(tuple, self.contacts)))
        object.__setattr__(self, "summary", tuple(self.summary))

    def _keep(self, name: str, values: FloatArray) -> None:
        values.setflags(write=False)
        object.__setattr__(self, name, values)

    def _check_contacts(self, contacts: Sequence[Sequence[Contact]], reach: float) -> None:
        if len(contacts) != self.n_poses:
            raise InputError(f"Expected contacts for each of {self.n_poses} poses, got {len(contacts)}.")
        for pose, touching in enumerate(contacts):
            for contact in touching:
                if not 0 <= contact.link < self.n_links:
                    raise InputError(
                        f"Expected contacts of links 0 to {self.n_links - 1}, got link {contact.link} "
                        f"in pose {pose}."
                    )
                place = (*(contact.point - self.maze.base_pose[:2]), contact.clearance)
                _check_numbers("contacts", np.array([place]), reach, pose)

    @property
    def n_poses(self) -> int:
        """Number of poses."""
        return len(self.joints)

    @property
    def n_links(self) -> int:
        """Number of links."""
        return int(self.joints.shape[1]) - 1


def _check_numbers(name: str, values: FloatArray, reach: float, first_pose: int = 0) -> None:
    """Refuse numbers that are not finite, or too large to be shown; `values` has one entry per pose."""
    bad = ~(np.abs(values) <= reach)
    if bad.any():
        place = tuple(np.argwhere(bad)[0])
        raise InputError(
            f"Expected finite {name} within {reach:g} maze units, got {values[place]:g} in pose "
            f"{first_pose + int(place[0])}."
        )


def save_replay(traces: Sequence[Trace], out: str | os.PathLike[str]) -> None:
    """Write a replay as one HTML file, completely or not at all.

    The file needs nothing else, no network and no server. `#pose=120`, `play=0`, `speed=0.5` and `loop=0`,
    with `&` between them, say behind its name how it opens.

    Parameters
    ----------
    traces : sequence of one or two Trace
        Two are shown side by side, with one clock: the shorter one waits at its end.
    out : path
        The file (.html).

    Raises
    ------
    InputError
        If there are none or more than two, or their time steps differ.
    """
    page = replay_html(traces)
    with replacing(out) as part:
        part.write_text(page, encoding="utf-8")


def replay_html(traces: Sequence[Trace]) -> str:
    """Return the page that `save_replay` writes."""
    traces = tuple(traces)
    payload = replay_payload(traces)
    title = " | ".join(trace.title for trace in traces)
    parts = {"style": _text("player.css"), "script": _text("player.js")}
    return filled(_text("replay.html"), title, payload, **parts)


def replay_payload(traces: Sequence[Trace]) -> dict[str, Any]:
    """Return what `HrsnakePlayer.mount` of `player.js` plays, as plain data for JSON.

    Parameters
    ----------
    traces : sequence of one or two Trace
        As in `save_replay`. Payloads of one timestep may be joined by joining their `traces`.

    Raises
    ------
    InputError
        As `save_replay`.
    """
    traces = tuple(traces)
    if not 1 <= len(traces) <= MAX_TRACES:
        raise InputError(f"Expected one or two runs to replay, got {len(traces)}.")
    timesteps = [trace.timestep for trace in traces]
    if len(set(timesteps)) > 1:
        raise InputError(f"Expected runs with one timestep, as they share a clock, got {timesteps}.")
    return {
        "colours": COLOURS,
        "timestep": timesteps[0],
        "feederShare": FEEDER_SHARE,
        "clearanceScale": [FAR, PINCH_TOLERANCE],
        "traces": [_packed_trace(trace) for trace in traces],
    }


def _text(name: str) -> str:
    return importlib.resources.files("hrsnake_env").joinpath(name).read_text(encoding="utf-8")


def show(traces: Sequence[Trace], height: int = 720) -> Any:
    """Show a replay in a notebook.

    Parameters
    ----------
    traces : sequence of one or two Trace
        As in `save_replay`.
    height : int
        In CSS pixels.

    Returns
    -------
    frame : IPython.display.IFrame
        The last line of a cell shows it. It can run its script, and reaches nothing of the notebook.

    Raises
    ------
    InputError
        As `save_replay`; or if IPython is not installed.
    """
    return framed(replay_html(traces), height)


def _packed_trace(trace: Trace) -> dict[str, Any]:
    maze, quantum = trace.maze, QUANTUM * trace.link_length
    x, y, heading = (float(value) for value in maze.base_pose)
    joints = _quantised(trace.joints - (x, y), quantum).reshape(trace.n_poses, -1)
    clearances = None if trace.clearances is None else _quantised(trace.clearances, quantum)
    contacts = None if trace.contacts is None else _contact_table(trace, trace.contacts, quantum)
    return {
        "title": trace.title,
        "clean": trace.clean,
        "summary": list(trace.summary),
        "nPoses": trace.n_poses,
        "nLinks": trace.n_links,
        "linkLength": trace.link_length,
        "linkRadius": trace.link_radius,
        "tolerance": PINCH_TOLERANCE * trace.link_length,
        "quantum": quantum,
        "maze": {
            "name": maze.name,
            "units": maze.units,
            "size": maze.size,
            "base": [x, y, heading],
            "goal": (maze.goal - (x, y)).tolist(),
            "goalRadius": maze.goal_radius,
            "rings": [_short((ring - (x, y)).ravel(), maze.size) for ring in maze.rings],
        },
        "joints": _packed(joints, order=2),
        "clearances": None if clearances is None else _packed(clearances, order=1),
        "nContacts": None if contacts is None else len(contacts),
        "contacts": None if contacts is None else _packed(contacts, order=1),
    }


def _quantised(values: FloatArray, quantum: float) -> IntArray:
    return np.rint(values / quantum).astype(np.int64)


def _short(values: FloatArray, size: float) -> list[float]:
    """Round coordinates of walls to a hundred-millionth of the maze, which is shorter to write."""
    digits = 8 - math.floor(math.log10(size))
    return [round(value, digits) for value in values.tolist()]


def _contact_table(trace: Trace, contacts: Sequence[Sequence[Contact]], quantum: float) -> IntArray:
    """Return the contacts as whole numbers, one row each, ordered so that rows resemble the ones before.

    Columns: pose, link, other link or -1, wall or -1, 1 for a corner, 1 for a collision; x and y from the
    base and clearance, all three in quanta.
    """
    rows = [
        (
            pose,
            contact.link,
            -1 if contact.other is None else contact.other,
            -1 if contact.wall is None else contact.wall,
            int(contact.corner is not None),
            int(contact.kind == "collision"),
            *(contact.point - trace.maze.base_pose[:2]) / quantum,
            contact.clearance / quantum,
        )
        for pose, touching in enumerate(contacts)
        for contact in touching
    ]
    rows.sort(key=lambda row: (row[1:5], row[0]))
    return np.rint(np.array(rows, dtype=np.float64).reshape(-1, 9)).astype(np.int64)


def _packed(table: IntArray, order: int) -> str:
    """Pack whole numbers: differences along axis 0, in bytes of seven bits, deflated, in base64.

    Parameters
    ----------
    table : int array, shape (n_rows, n_columns)
        Written column by column.
    order : int
        1: differences; 2: differences of differences, which are small where something moves evenly.
    """
    for _ in range(order):
        table = np.diff(table, axis=0, prepend=0)
    numbers = table.T.ravel()
    numbers = np.where(numbers < 0, -2 * numbers - 1, 2 * numbers)  # small ones stay small, none is negative
    shifts = 7 * np.arange(8)  # 56 bits, more than any number here has
    parts = (numbers[:, None] >> shifts) & 127
    more = (numbers[:, None] >> (shifts + 7)) > 0
    used = np.concatenate([np.ones_like(more[:, :1]), more[:, :-1]], axis=1)
    data = (parts | (more << 7))[used].astype(np.uint8).tobytes()
    return base64.b64encode(zlib.compress(data, 9)).decode("ascii")
