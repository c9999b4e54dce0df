"""Files are written completely or not at all."""

import errno
import os
import signal
import stat
import subprocess
import sys

import pytest

from hrsnake_env.errors import InputError
from hrsnake_env.files import locked, replacing, scratch_folder, tidy


def test_a_file_takes_its_place_when_it_is_complete(tmp_path):
    target = tmp_path / "a.txt"
    with replacing(target) as part:
        part.write_text("new")
        assert not target.exists()
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(error, tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")
    with pytest.raises(error), replacing(target) as part:
        part.write_text("ne")
        raise error
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]


def test_two_writers_of_one_file_do_not_meet_and_the_last_one_wins_whole(tmp_path):
    target = tmp_path / "a.txt"
    with replacing(target) as first:
        first.write_text("first")
        with replacing(target) as second:
            second.write_text("second")
        assert target.read_text() == "second"
    assert target.read_text() == "first"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("name", ["x" * 251 + ".txt", "\N{SNOWMAN}" * 83 + ".txt"])
def test_a_name_as_long_as_the_system_allows_can_be_written(name, tmp_path):
    with replacing(tmp_path / name) as part:
        part.write_text("whole")
    assert (tmp_path / name).read_text() == "whole"


def test_a_link_stays_a_link_and_its_file_is_replaced(tmp_path):
    (tmp_path / "far").mkdir()
    link, file = tmp_path / "link.txt", tmp_path / "far" / "a.txt"
    link.symlink_to(file)
    with replacing(link) as part:
        part.write_text("new")
    assert link.is_symlink() and file.read_text() == "new"


def test_what_is_no_file_is_never_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="is no file"), replacing(pipe):
        pytest.fail("it went on")
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_an_error_of_writing_names_the_file_that_was_wanted(tmp_path):
    target = tmp_path / "a.txt"
    with pytest.raises(OSError) as raised, replacing(target):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert str(raised.value) == f"[Errno {errno.ENOSPC}] No space left on device: '{target}'"
    with pytest.raises(FileNotFoundError, match=r"none/a\.txt'$"), replacing(tmp_path / "none" / "a.txt"):
        pytest.fail("it went on")


def test_a_full_disk_is_told_though_a_library_fails_otherwise_as_it_cleans_up(tmp_path):
    target = tmp_path / "a.txt"
    with pytest.raises(OSError, match=r"No space left on device: '.*a\.txt'$"), replacing(target):
        try:
            raise OSError(errno.ENOSPC, "No space left on device")
        finally:
            raise AttributeError("pos")
    try:
        raise OSError(errno.EIO, "something before")
    except OSError:
        with pytest.raises(AttributeError, match="pos"), replacing(target):
            raise AttributeError("pos") from None


def killed(code, folder):
    """Run lines in a process that kills itself at their end."""
    lines = f"""
import os
from contextlib import ExitStack
from pathlib import Path
from hrsnake_env.files import *
here, enter = Path({str(folder)!r}), ExitStack().enter_context
{code}
os.kill(os.getpid(), {signal.SIGKILL:d})
"""
    assert subprocess.run([sys.executable, "-c", lines]).returncode == -signal.SIGKILL


def test_what_a_killed_process_has_left_goes_with_the_next_write(tmp_path):
    killed(
        "enter(replacing(here / 'a.txt')).write_text('half')\n"
        "(enter(scratch_folder(here)) / 'half').write_text('half')",
        tmp_path,
    )
    assert len(list(tmp_path.iterdir())) == 2
    with replacing(tmp_path / "b.txt") as part:
        part.write_text("whole")
    assert list(tmp_path.iterdir()) == [tmp_path / "b.txt"]


def test_what_others_are_writing_is_not_tidied_away(tmp_path):
    with replacing(tmp_path / "a.txt") as part, scratch_folder(tmp_path) as folder:
        tidy(tmp_path)
        part.write_text("whole")
        assert folder.is_dir()
    assert list(tmp_path.iterdir()) == [tmp_path / "a.txt"]


@pytest.mark.parametrize("name", ["folder", "state.json"])
def test_a_lock_keeps_others_out_until_its_owner_ends_or_is_killed(name, tmp_path):
    (tmp_path / "folder").mkdir()
    target = tmp_path / name
    refused = pytest.raises(InputError, match="this run alone, but another one")
    with locked(target), locked(tmp_path / "another.json"), refused, locked(target):
        pytest.fail("it went on")
    killed(f"enter(locked(here / {name!r}))", tmp_path)
    with locked(target):
        pass
    assert list(tmp_path.rglob("*")) == [tmp_path / "folder"]
