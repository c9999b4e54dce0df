"""What one request may ask for, and what one server may hold at a time."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

__all__ = ["Limits"]

MIB = 2**20


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Hold all limits of the studio.

    Parameters
    ----------
    jobs : int
        Jobs that run at once, each in a process of its own.
    queue : int
        Jobs that may wait for their turn.
    time_budget_s : float
        Seconds that planning may be given.
    grace_s : float
        Seconds after which a job is ended that has not ended by itself when its time was over.
    warm_up_s : float
        Seconds that a worker may take until it can work; the first one compiles.
    longest_s : float
        Seconds after which a search for the longest link ends with the best so far.
    body_bytes : int
        Of one request.
    held_bytes : int
        Of all requests that are read, wait or run.
    body_tokens : int
        Numbers, texts and brackets of one request, which cost far more memory than their bytes.
    body_s, body_idle_s : float
        Seconds in which a request must have come, and in which some part of it must.
    head_s : float
        Seconds in which the head of a request must have come.
    send_s : float
        Seconds in which a client must take what it is sent.
    open_requests : int
        Requests that are answered at once.
    worker_bytes : int
        Of memory that a worker may use for its data.
    """

    jobs: int = 2
    queue: int = 32
    time_budget_s: float = 60.0
    grace_s: float = 30.0
    warm_up_s: float = 300.0
    longest_s: float = 900.0
    body_bytes: int = 32 * MIB
    held_bytes: int = 160 * MIB
    body_tokens: int = 400_000
    body_s: float = 60.0
    body_idle_s: float = 10.0
    head_s: float = 10.0
    send_s: float = 30.0
    open_requests: int = 128
    worker_bytes: int = 3 * 1024 * MIB

    def to_dict(self) -> dict[str, Any]:
        """Return the limits as plain numbers."""
        return asdict(self)
