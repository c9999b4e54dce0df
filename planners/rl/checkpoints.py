"""Where a training stands, in one file that is always whole, and that no code of somebody else's is in.

Libraries pickle their models, and to unpickle is to run what a file says. So of a model only its weights,
read as such, and its counters are taken from a checkpoint, into a new model made from the settings.
"""

from __future__ import annotations

import io
import json
import warnings
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hrsnake_env.arguments import is_number
from hrsnake_env.errors import InputError
from hrsnake_env.files import replacing
from planners.reading import TEXT_BYTES, NotReadable, check_archive, read_arrays

__all__ = ["read_model", "read_progress", "restore", "write_checkpoint"]

MODEL, BUFFER, PROGRESS = "model.zip", "replay_buffer.npz", "progress.json"

PICKLED = "replay_buffer.pkl"
"""What checkpoints of old versions have instead of `BUFFER`."""

MODEL_BYTES = 2**30
"""That a model may take, and what is packed in it."""

MARGIN = 2**20
"""For the names of arrays and the like."""

QUICK = 1
"""Compression level: the unused part of a replay buffer is all zeros, and shrinks at any."""

COUNTERS = ("num_timesteps", "_episode_num", "_n_updates", "_current_progress_remaining")
"""Of a model, as stable-baselines3 calls them."""


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
            arrays: dict[str, Any] = dict(_arrays_of(model.replay_buffer))
            arrays |= {"pos": np.array(model.replay_buffer.pos), "full": np.array(model.replay_buffer.full)}
            np.savez(buffer, **arrays)
            archive.writestr(BUFFER, buffer.getvalue(), zipfile.ZIP_DEFLATED, QUICK)


def read_progress(path: Path) -> dict[str, Any]:
    """Read the counters of a checkpoint.

    Raises
    ------
    InputError
        If the file is no checkpoint.
    """
    try:
        with open(path, "rb") as file:
            check_archive(file)
            with zipfile.ZipFile(file) as archive:
                return dict(json.loads(_member(archive, PROGRESS, TEXT_BYTES)))
    except Exception:  # zip, zlib and json raise whatever their parsers stumble over
        raise InputError(f"Expected a checkpoint (.zip) in '{path}', got a file that is not one.") from None


def read_model(path: Path, load: Callable[[io.BytesIO], Any]) -> Any:
    """Read the model of a checkpoint, and its replay buffer.

    Parameters
    ----------
    path : Path
        The checkpoint (.zip).
    load : callable
        Makes a model of what its `save` has written, without trust: see `restore`.

    Returns
    -------
    model : stable_baselines3 model
        With its replay buffer, if it has one.

    Raises
    ------
    InputError
        If it cannot be read, as one of another version.
    """
    try:
        with open(path, "rb") as file:
            check_archive(file)
            with zipfile.ZipFile(file) as archive:
                if PICKLED in archive.namelist():
                    raise NotReadable("one of an old version, whose replay buffer is pickled")
                model = load(io.BytesIO(_member(archive, MODEL, MODEL_BYTES)))
                if getattr(model, "replay_buffer", None) is not None:
                    _fill(model.replay_buffer, archive)
    except Exception as error:  # what comes of a file that holds something else, or of other versions
        what = " ".join(str(error).split())[:200]
        raise InputError(f"Expected a checkpoint that can be read in '{path}', got: {what}.") from None
    return model


def restore(model: Any, file: io.BytesIO) -> Any:
    """Take weights and counters of what the `save` of a model like this has written; nothing is unpickled.

    Parameters
    ----------
    model : stable_baselines3 model
        Just made, from the same settings.
    file : binary file
        That its `save` has written.

    Returns
    -------
    model : stable_baselines3 model
        The same.
    """
    from stable_baselines3.common.save_util import load_from_zip_file

    check_archive(file, MODEL_BYTES)
    with zipfile.ZipFile(file) as archive:
        counters = json.loads(archive.read("data"))
    file.seek(0)
    # Weights alone: torch reads these with `weights_only`, and the rest is not read at all.
    _, weights, variables = load_from_zip_file(file, load_data=False, device="cpu")
    model.set_parameters(weights, exact_match=True, device="cpu")
    for name in model._get_torch_save_params()[1]:
        if (own := getattr(model, name)) is not None:
            own.data.copy_((variables or {})[name].data)
    for name in COUNTERS:
        if not is_number(counters[name]):
            raise NotReadable(f"{name} that is no number")
        setattr(model, name, counters[name])
    return model


def _arrays_of(buffer: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield all arrays of numbers in a replay buffer by name; those of a dictionary as `name.key`."""
    for name, value in sorted(vars(buffer).items()):
        for key, array in value.items() if isinstance(value, dict) else [("", value)]:
            if isinstance(array, np.ndarray) and array.dtype.kind in "fiub":
                yield f"{name}.{key}" if key else name, array


def _member(archive: zipfile.ZipFile, name: str, most_bytes: int) -> bytes:
    if archive.getinfo(name).file_size > most_bytes:
        raise NotReadable(f"one whose {name} is larger than {most_bytes // 2**20} MiB")
    return archive.read(name)


def _fill(buffer: Any, archive: zipfile.ZipFile) -> None:
    """Put what was saved into a replay buffer that is just made."""
    if getattr(buffer, "copy_info_dict", False):
        raise NotReadable("a replay buffer with infos, which a checkpoint does not hold")
    most_bytes = sum(array.nbytes for _, array in _arrays_of(buffer)) + MARGIN
    arrays = read_arrays(io.BytesIO(_member(archive, BUFFER, most_bytes)), most_bytes=most_bytes)
    pos, full = int(arrays["pos"]), bool(arrays["full"])
    if not 0 <= pos < buffer.buffer_size:
        raise NotReadable(f"place {pos} in a replay buffer of {buffer.buffer_size}")
    for name, own in _arrays_of(buffer):
        if arrays[name].shape != own.shape or arrays[name].dtype != own.dtype:
            raise NotReadable(f"a replay buffer whose {name} has another shape")
        own[...] = arrays[name]
    buffer.pos, buffer.full = pos, full
    if hasattr(buffer, "truncate_last_trajectory"):
        with warnings.catch_warnings():
            # Episodes begin anew, and so hindsight has to cut off those that were running.
            warnings.filterwarnings("ignore", message="The last trajectory in the replay buffer")
            buffer.truncate_last_trajectory()
