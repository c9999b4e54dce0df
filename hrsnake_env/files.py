"""Writing files completely or not at all, with nothing left of a process that was killed."""

from __future__ import annotations

import os
import secrets
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hrsnake_env.errors import InputError

__all__ = ["locked", "replacing", "scratch_folder", "tidy"]

PART, LOCK = ".hrsnake-", ".hrsnake.lock"
"""How the names of unfinished files begin, and the name of the file that says who writes in a folder."""

STALE_S = 3600.0
"""Age at which an unfinished file belongs to nobody, where no system call tells it."""


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a path beside `path` to write to; it takes the place of `path` when the block ends well.

    If the block is left by an exception, Ctrl-C included, `path` stays as it was, with nothing beside it.
    What a killed process has left in the folder is taken away. Of several processes the last one wins, whole.
    Where `path` is a link, the file that it points to is replaced.

    Raises
    ------
    InputError
        If there is something at `path` that is no file.
    OSError
        If it cannot be written; it names `path`.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        raise InputError(f"Expected a file name to write, but '{path}' is no file.")
    part, held, before = None, None, sys.exception()
    try:
        part, held = _held_part(target.parent, target.suffix, _new_file)
        yield part
        part.replace(target)
    except Exception as error:
        first = _failed_write(error, before)
        if first is None:
            raise
        raise OSError(first.errno, first.strerror, str(path)) from error  # nobody has heard of the part
    finally:
        if part is not None:
            part.unlink(missing_ok=True)
        _let_go(held)


@contextmanager
def scratch_folder(parent: Path) -> Iterator[Path]:
    """Yield a new, hidden folder in `parent`; it goes when the block ends.

    What a killed process has left in `parent` is taken away.
    """
    folder, held = _held_part(parent, "", _new_folder)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        _let_go(held)


@contextmanager
def locked(path: str | os.PathLike[str]) -> Iterator[None]:
    """Keep all other processes out of blocks with this file or folder; one that was killed keeps out nobody.

    Where the system knows no such locks, as on some network drives, nobody is kept out.

    Raises
    ------
    InputError
        If another process is in such a block.
    """
    target = Path(os.path.realpath(path))
    lock = target / LOCK if target.is_dir() else target.with_name(f".{target.name}.lock")
    try:
        held = _held_lock(lock)
    except BlockingIOError:
        raise InputError(f"Expected '{path}' for this run alone, but another one is writing there.") from None
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    try:
        yield
    finally:
        with suppress(OSError):
            if sys.platform == "win32":
                os.close(held)  # an open file cannot be taken away there
                lock.unlink(missing_ok=True)
            else:
                lock.unlink(missing_ok=True)
                os.close(held)


def tidy(folder: Path) -> None:
    """Take away the unfinished files and folders whose writers are no more."""
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(PART) and ".part" in entry.name:
                with suppress(OSError, NotImplementedError), _stale(entry):
                    if entry.is_dir(follow_symlinks=False):
                        shutil.rmtree(entry.path)
                    else:
                        os.unlink(entry.path)


@contextmanager
def _stale(entry: os.DirEntry[str]) -> Iterator[None]:
    """Hold a part that nobody writes any more; BlockingIOError if somebody does."""
    if sys.platform == "win32":
        if time.time() - entry.stat().st_mtime < STALE_S:
            raise BlockingIOError
        yield
        return
    descriptor = os.open(entry.path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        _lock(descriptor)
        yield
    finally:
        os.close(descriptor)


def _held_part(folder: Path, suffix: str, make: Callable[[Path], int | None]) -> tuple[Path, int | None]:
    """Make a part that nobody tidies away as long as its descriptor is open."""
    tidy(folder)
    while True:
        # Libraries tell the format by the ending. The name is short, however long the file's own is.
        part = folder / f"{PART}{secrets.token_hex(8)}.part{suffix}"
        held = make(part)
        if sys.platform == "win32":
            _let_go(held)  # an open file cannot be renamed there
            return part, None
        assert held is not None
        with suppress(BlockingIOError):  # somebody is about to tidy it away already
            with suppress(NotImplementedError):
                _lock(held)
            if _is_at(held, part):
                return part, held
        _let_go(held)


def _failed_write(error: BaseException | None, before: BaseException | None) -> OSError | None:
    """Return the error of writing a part that has led to an error; None if there is none.

    On a full disk some libraries fail again, in other ways, as they clean up. What was amiss `before` is no
    concern of the part.
    """
    while error is not None and error is not before and not isinstance(error, InputError):
        if isinstance(error, OSError):
            ours = not error.filename or PART in str(error.filename)
            return error if ours and error.errno is not None else None
        error = error.__context__
    return None


def _new_file(path: Path) -> int:
    return os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)


def _new_folder(path: Path) -> int | None:
    path.mkdir()
    return None if sys.platform == "win32" else os.open(path, os.O_RDONLY)


def _held_lock(lock: Path) -> int:
    """Open the lock's file and lock it.

    Raises
    ------
    BlockingIOError
        If another process has locked it.
    OSError
        If there can be no such file.
    """
    while True:
        held = os.open(lock, os.O_CREAT | os.O_RDWR, 0o666)
        try:
            with suppress(NotImplementedError):
                _lock(held)
        except BlockingIOError:
            os.close(held)
            raise
        if sys.platform == "win32" or _is_at(held, lock):
            return held
        os.close(held)  # the last owner took its file away meanwhile


def _lock(descriptor: int) -> None:
    """Lock an open file or folder for as long as it is open.

    Raises
    ------
    BlockingIOError
        If another process has locked it.
    NotImplementedError
        If the system, or the drive, knows no locks.
    """
    if sys.platform == "win32":
        import msvcrt

        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError from error
    else:
        import fcntl

        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise
        except OSError as error:
            raise NotImplementedError from error


def _is_at(descriptor: int, path: Path) -> bool:
    """Tell whether an open file is still the one at a path."""
    try:
        return os.path.samestat(os.fstat(descriptor), os.stat(path))
    except FileNotFoundError:
        return False


def _let_go(descriptor: int | None) -> None:
    if descriptor is not None:
        os.close(descriptor)
