"""Where a training stands, in one file that is always whole."""

from __future__ import annotations

import io
import json
import pickle
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing

__all__ = ["read_model", "read_progress", "write_checkpoint"]

MODEL, BUFFER, PROGRESS = "model.zip", "replay_buffer.pkl", "progress.json"

QUICK = 1
"""Compression level: the unused part of a replay buffer is all zeros, and shrinks at any."""


def write_checkpoint(path: Path, model: Any, progress: dict[str, Any]) -> None:
    """Write a model, its replay buffer and counters beside the last checkpoint, and then in its place.

    Parameters
    ----------
    path : Path
        The checkpoint (.zip).
    model : stable_baselines3 model
        Between two rollouts.
    progress : dict
        For JSON.
    """
    with replacing(path) as part, zipfile.ZipFile(part, "w") as archive:
        archive.writestr(PROGRESS, json.dumps(progress))
        inner = io.BytesIO()
        model.save(inner)
        archive.writestr(MODEL, inner.getvalue())
        if getattr(model, "replay_buffer", None) is not None:
            buffer = io.BytesIO()
            model.save_replay_buffer(buffer)
            archive.writestr(BUFFER, buffer.getvalue(), zipfile.ZIP_DEFLATED, QUICK)


def read_progress(path: Path) -> dict[str, Any]:
    """Read the counters of a checkpoint.

    Raises
    ------
    InputError
        If the file is no checkpoint.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return dict(json.loads(archive.read(PROGRESS)))
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        raise InputError(f"Expected a checkpoint (.zip) in '{path}', got a file that is not one.") from None


UNREADABLE = (
    *(AttributeError, EOFError, ImportError, KeyError, OSError, TypeError, ValueError),
    *(pickle.UnpicklingError, zipfile.BadZipFile),
)
"""What comes of a file that holds something else, or was written with other versions."""


def read_model(path: Path, load: Callable[[io.BytesIO], Any]) -> Any:
    """Read the model of a checkpoint; it is pickled, so read your own files alone.

    Parameters
    ----------
    path : Path
        The checkpoint (.zip).
    load : callable
        Makes a model of what its `save` has written.

    Returns
    -------
    model : stable_baselines3 model
        With its replay buffer.

    Raises
    ------
    InputError
        If it cannot be read, as one of another version.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            model = load(io.BytesIO(archive.read(MODEL)))
            if BUFFER in archive.namelist():
                with warnings.catch_warnings():
                    # Episodes begin anew, and so hindsight has to cut off those that were running.
                    warnings.filterwarnings("ignore", message="The last trajectory in the replay buffer")
                    model.load_replay_buffer(io.BytesIO(archive.read(BUFFER)))
    except UNREADABLE as error:
        raise InputError(f"Expected a checkpoint that can be read in '{path}', got: {error}.") from None
    return model
