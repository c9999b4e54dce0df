"""What may be asked of the studio, and the one sentence that says what is wrong with a request."""

from __future__ import annotations

import base64
import binascii
from typing import Annotated, Any

from pydantic import Field, ValidationError

from hrsnake_env.errors import InputError
from planners.studio.scene import Coordinate, Length, Name, Number, Scene, Strict

__all__ = [
    "REQUESTS",
    "Arm",
    "Ask",
    "CheckRequest",
    "ExportRequest",
    "LongestRequest",
    "MapRequest",
    "PlanRequest",
    "Run",
    "decoded",
    "read_request",
]

MAX_LINKS = 2_000
MAX_FILES = 8

Text = Annotated[str, Field(max_length=200)]
Radius = Annotated[float, Field(allow_inf_nan=False, ge=0.0)]
Degrees = Annotated[float, Field(allow_inf_nan=False, gt=0.0, le=180.0)]
Seconds = Annotated[float, Field(allow_inf_nan=False, gt=0.0)]
Positive = Annotated[float, Field(allow_inf_nan=False, gt=0.0)]
Texts = Annotated[tuple[Text, ...], Field(max_length=200)]
Data = str
"""Bytes in base64."""


class Arm(Strict):
    """Describe the arm; an angle in degrees."""

    link_length: Length
    n_links: Annotated[int, Field(ge=1, le=MAX_LINKS)] | None = None
    link_radius: Radius = 0.0
    joint_limit_deg: Degrees | None = None


class PlanRequest(Strict):
    """Ask for a plan."""

    scene: Scene
    arm: Arm
    planner: Text = "auto"
    time_budget: Seconds = 60.0
    warm_start: Data | None = None


class CheckRequest(Strict):
    """Ask what the exact checker and the simulator say of a motion."""

    scene: Scene
    arm: Arm
    motion: Data


class LongestRequest(Strict):
    """Ask for the longest link."""

    scene: Scene
    link_radius: Radius = 0.0
    joint_limit_deg: Degrees | None = None
    planner: Text = "auto"
    accuracy: Number | None = None
    time_budget: Seconds | None = None


class Run(Strict):
    """Hold one motion to be exported, and where it belongs."""

    scene: Scene
    arm: Arm
    motion: Data | None = None
    title: Name = ""


class ExportRequest(Strict):
    """Ask for a file of a run, or of two side by side."""

    format: Text
    runs: Annotated[list[Run], Field(min_length=1, max_length=2)]
    rate: Positive | None = None
    limits: dict[Text, Positive | None] | None = None
    metres_per_unit: Positive | None = None


class UploadedFile(Strict):
    """Hold one file of a map."""

    name: Annotated[str, Field(min_length=1, max_length=200)]
    data: Data


class MapSettings(Strict):
    """Say how a map is to be read; as `MapOptions`, which checks the ranges."""

    units: Annotated[str, Field(max_length=40)] | None = None
    scale: Number | None = None
    tolerance: Number | None = None
    resolution: Number | None = None
    threshold: Number | None = None
    invert: bool = False
    unknown_is_free: bool = False
    free: Texts = ()
    walls: Texts = ()
    base: Texts = ()
    goal: Texts = ()
    ignore: Texts = ()
    wall_thickness: Coordinate | None = None


class MapRequest(Strict):
    """Ask for what is understood of a map; its files are all that is read."""

    files: Annotated[list[UploadedFile], Field(min_length=1, max_length=MAX_FILES)]
    options: MapSettings = MapSettings()


Ask = MapRequest | PlanRequest | CheckRequest | LongestRequest | ExportRequest

REQUESTS: dict[str, type[Ask]] = {
    "map": MapRequest,
    "plan": PlanRequest,
    "check": CheckRequest,
    "longest": LongestRequest,
    "export": ExportRequest,
}
"""What each kind of job is asked with, by its name in the address."""


def read_request(kind: str, body: bytes) -> Ask:
    """Read a request.

    Raises
    ------
    InputError
        If it is not JSON, or does not hold what this kind of job needs.
    """
    try:
        return REQUESTS[kind].model_validate_json(body)
    except ValidationError as error:
        raise InputError(_sentence(error)) from None


def decoded(data: str, what: str) -> bytes:
    """Return bytes from base64.

    Raises
    ------
    InputError
        If it is not base64.
    """
    try:
        return base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError):
        raise InputError(f"Expected {what} in base64, got something else.") from None


def _sentence(error: ValidationError) -> str:
    """Say in one sentence what the first fault of a request is."""
    fault = error.errors(include_url=False, include_context=False)[0]
    message = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    if fault["type"] == "json_invalid":
        return f"Expected a request in JSON, got: {message.removeprefix('Invalid JSON: ')}."
    where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in fault["loc"]).lstrip(".")
    if fault["type"] == "missing":
        return f"Expected {where} in the request, got none."
    if fault["type"] == "extra_forbidden":
        return f"Expected a request without {where!r}, which is not known."
    got = fault["input"]
    shown = f", got {_short(got)}" if isinstance(got, str | int | float | bool | None) else ""
    return f"Expected {where or 'the request'} to be {message}{shown}."


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
