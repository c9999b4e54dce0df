"""Files that somebody else may have written: read without trust, without pickle, and within limits."""

from __future__ import annotations

import io
import json
import math
import os
import reprlib
import zipfile
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "ARRAY_BYTES",
    "MOTION_BYTES",
    "TEXT_BYTES",
    "NotReadable",
    "check_archive",
    "read_arrays",
    "read_json",
    "read_limited",
    "shown",
]

ARRAY_BYTES = 256 * 2**20
"""That the arrays of a policy, or of a motion from elsewhere, may take when they are unpacked."""

MOTION_BYTES = 2 * 2**30
"""That a motion may take: planners make none that is larger, and files hold none."""

TEXT_BYTES = 32 * 2**20
"""Of a text file: its lists and numbers take many times as much memory."""

MEMBERS = 1000
"""That an archive may have: each costs far more memory than its bytes."""

LARGE_BITS = 256
"""Of a whole number that no message shows."""

SHOWN = 60
"""Characters of what came that a message shows at most."""

NO_ARCHIVE = "a file that is not one"

ENTRY, BLOCK = b"PK\x01\x02", 2**20
"""What each member of an archive is listed after, and how much is looked through at once."""


class NotReadable(Exception):
    """Say what came instead of what was expected, to end a sentence with: "a file that is not one"."""


def read_arrays(
    source: str | os.PathLike[str] | IO[bytes], *, most_bytes: int = ARRAY_BYTES
) -> dict[str, NDArray[Any]]:
    """Read all arrays of an .npz file; whatever else is in it makes it unreadable.

    Parameters
    ----------
    source : path or binary file
        The archive.
    most_bytes : int
        That its arrays may take; an archive of a few kilobytes can claim to hold any number.

    Returns
    -------
    arrays : dict from str to array
        By their names; none of them holds objects.

    Raises
    ------
    NotReadable
        If it is no such archive, is damaged, or would be too large when it is unpacked.
    FileNotFoundError
        If there is no such file.
    """
    try:
        if not isinstance(source, str | os.PathLike):
            return _unpacked(source, most_bytes)
        _check_kind(source)
        with open(source, "rb") as file:
            return _unpacked(file, most_bytes)
    except (NotReadable, FileNotFoundError):
        raise
    except Exception:  # zip, zlib and numpy raise whatever their parsers stumble over
        raise NotReadable(NO_ARCHIVE) from None


def read_limited(path: str | os.PathLike[str], most_bytes: int = TEXT_BYTES) -> bytes:
    """Read a file of a limited size.

    Raises
    ------
    NotReadable
        If it is larger, or is no file but a folder or a device.
    OSError
        If it cannot be read.
    """
    _check_kind(path)
    with open(path, "rb") as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise NotReadable(f"one of more than {most_bytes // 2**20} MiB")
    return data


def read_json(path: str | os.PathLike[str]) -> Any:
    """Read a JSON file of a limited size.

    Raises
    ------
    NotReadable
        If it is larger, is no file, or does not hold JSON in UTF-8.
    OSError
        If it cannot be read.
    """
    data = read_limited(path)
    try:
        return json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        why = {
            RecursionError: "too many brackets in each other",
            UnicodeDecodeError: "it is no text (UTF-8)",
        }.get(type(error), str(error))
        raise NotReadable(f"a file that is not: {why}") from None


def shown(value: Any) -> str:
    """Return a value that somebody sent for a message: short, however much refers to itself in it."""
    text = _Short().repr(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."


class _Short(reprlib.Repr):
    """Look at the first parts of a value alone."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxother = 3, SHOWN, SHOWN

    def repr_int(self, x: int, level: int) -> str:
        return "a very large number" if x.bit_length() > LARGE_BITS else str(x)


def check_archive(file: IO[bytes], most_bytes: float = math.inf) -> None:
    """Refuse a zip file that would be too large when it is unpacked, or packed in a way that is not usual.

    Raises
    ------
    NotReadable
        If it is so.
    Exception
        Of `zipfile`, if it is none.
    """
    if _count(file, ENTRY) > MEMBERS:
        raise NotReadable(f"one of more than {MEMBERS} members")
    with zipfile.ZipFile(file) as archive:
        members = archive.infolist()
    if sum(member.file_size for member in members) > most_bytes:
        raise NotReadable(f"one of more than {most_bytes / 2**20:.0f} MiB when it is unpacked")
    # Other ways of packing unpack blocks of any size at once.
    if any(member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for member in members):
        raise NotReadable(NO_ARCHIVE)
    file.seek(0)


def _check_kind(path: str | os.PathLike[str]) -> None:
    """Refuse what may never end, as a pipe or a device."""
    if Path(path).exists() and not Path(path).is_file():
        raise NotReadable("a folder or a device")


def _count(file: IO[bytes], what: bytes) -> int:
    """Return how often some bytes are in a file."""
    found, rest = 0, b""
    while block := file.read(BLOCK):
        found += (rest + block).count(what)
        rest = block[-len(what) + 1 :]
    file.seek(0)
    return found


def _unpacked(file: IO[bytes], most_bytes: int) -> dict[str, NDArray[Any]]:
    check_archive(file, most_bytes)
    with zipfile.ZipFile(file) as archive:
        return {_name(member): _array(archive, member) for member in archive.infolist()}


def _name(member: zipfile.ZipInfo) -> str:
    if not member.filename.endswith(".npy"):
        raise NotReadable(NO_ARCHIVE)
    return member.filename.removesuffix(".npy")


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    data = io.BytesIO(archive.read(member))
    array: NDArray[Any] = np.lib.format.read_array(data, allow_pickle=False)
    return array
