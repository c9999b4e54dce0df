"""What stands before the studio: who may ask, how much they may send, and what the answers forbid."""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import json
import socket
from collections.abc import AsyncIterator, Awaitable, Callable, MutableMapping
from contextlib import asynccontextmanager
from typing import Any

from planners.studio.limits import Limits

__all__ = ["Guard", "Refusal", "Shelf", "hosts_of", "refuse"]

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
ANY_ADDRESS = ("0.0.0.0", "::", "")

DRAIN_S = 0.25
"""Seconds for which a client that is refused may pause in what it sends."""

HEADERS = {
    "content-security-policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-cache",
}
"""Of every answer: nothing from elsewhere is loaded, and nobody else may frame or embed it."""


class Refusal(Exception):
    """Refuse a request with a status and a sentence.

    Parameters
    ----------
    status : int
        Of HTTP.
    message : str
        One sentence.
    kind : str
        As in the last line of a job.
    """

    def __init__(self, status: int, message: str, kind: str = "input") -> None:
        super().__init__(message)
        self.status, self.message, self.kind = status, message, kind

    def to_dict(self) -> dict[str, str]:
        """Return what the answer holds."""
        return {"type": "error", "kind": self.kind, "message": self.message}


def hosts_of(host: str) -> frozenset[str]:
    """Return the names under which a server that listens on `host` may be asked for."""
    names = {*LOOPBACK, host.strip("[]").lower()}
    if host in ANY_ADDRESS:
        names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
    return frozenset(names - set(ANY_ADDRESS))


class Guard:
    """Refuse what does not come from the studio's own page, and add headers to every answer.

    A page from elsewhere may send requests to the loopback address; its browser says so in Origin or
    Sec-Fetch-Site. A name that was made to point here (DNS rebinding) shows in Host.

    Parameters
    ----------
    app : callable
        The ASGI application behind.
    host : str
        On which the server listens.
    limits : Limits
        Of requests that are answered at once.
    """

    def __init__(self, app: App, host: str, limits: Limits) -> None:
        self.app, self.hosts, self.limits = app, hosts_of(host), limits
        self.any_address = host in ANY_ADDRESS
        self.n_open = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":
            return
        guarded = _with_headers(send)
        self.n_open += 1
        try:
            self._check(scope)
            await self.app(scope, receive, guarded)
        except Refusal as refusal:
            await refuse(refusal, receive, guarded, self.limits)
        finally:
            self.n_open -= 1

    def _check(self, scope: Scope) -> None:
        headers = _headers(scope)
        hosts = headers.get("host", [])
        if len(hosts) != 1 or not self._is_ours(hosts[0]):
            raise Refusal(421, "Expected a request to this server's own address, got one to another name.")
        if self.n_open > self.limits.open_requests:
            raise Refusal(503, "The studio answers too many requests at once: try again later.", "busy")
        if not scope["path"].startswith("/api"):
            return
        origins, sites = headers.get("origin", []), headers.get("sec-fetch-site", [])
        if any(origin != f"http://{hosts[0]}" for origin in origins) or any(
            site not in ("same-origin", "none") for site in sites
        ):
            raise Refusal(403, "Expected a request from the studio's own page, got one from another.")
        if scope["method"] == "POST":
            _check_content(headers, self.limits)

    def _is_ours(self, host: str) -> bool:
        name = _name_of(host)
        return name in self.hosts or (self.any_address and _is_address(name))  # rebinding needs a name


def _headers(scope: Scope) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for key, value in scope["headers"]:
        found.setdefault(key.decode("latin-1").lower(), []).append(value.decode("latin-1").strip().lower())
    return found


def _name_of(host: str) -> str:
    """Return the name in a Host header, without the port."""
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.rpartition(":")[0] if ":" in host else host


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _check_content(headers: dict[str, list[str]], limits: Limits) -> None:
    kinds = headers.get("content-type", [])
    if len(kinds) != 1 or kinds[0].partition(";")[0].strip() != "application/json":
        raise Refusal(415, "Expected a request in application/json, got another kind.")
    if "content-encoding" in headers:
        raise Refusal(415, "Expected a request that is not compressed, got one that is.")
    for length in headers.get("content-length", []):
        if not (length.isascii() and length.isdigit()) or int(length[:20]) > limits.body_bytes:
            raise _too_large(limits)


def _too_large(limits: Limits) -> Refusal:
    """Return the refusal of a body that is too large."""
    mib = limits.body_bytes / 2**20
    return Refusal(413, f"Expected a request of at most {mib:g} MiB, got a larger one.", "limit")


def _with_headers(send: Send) -> Send:
    extra = [(key.encode(), value.encode()) for key, value in HEADERS.items()]

    async def guarded(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            own = {key.lower() for key, _ in message.get("headers", [])}
            more = [(key, value) for key, value in extra if key not in own]
            message = {**message, "headers": [*message.get("headers", []), *more]}
        await send(message)

    return guarded


async def refuse(refusal: Refusal, receive: Receive, send: Send, limits: Limits) -> None:
    """Answer with a refusal, and close the connection."""
    await _drain(receive, limits)
    headers = [(b"content-type", b"application/json"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": refusal.status, "headers": headers})
    await send({"type": "http.response.body", "body": json.dumps(refusal.to_dict()).encode()})


async def _drain(receive: Receive, limits: Limits) -> None:
    """Let go by what a client sends while it sends, within limits: many hear an answer only after that."""
    left = limits.body_bytes
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(limits.body_idle_s):  # for one that drips, too
            while left > 0:
                message = await asyncio.wait_for(receive(), DRAIN_S)
                left -= len(message.get("body", b""))
                if not message.get("more_body", False):
                    return


class Shelf:
    """Count the bytes of all requests that are held, so that many large ones cannot fill the memory.

    Parameters
    ----------
    limits : Limits
        Of one body, and of all together.
    """

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self.held = 0

    @asynccontextmanager
    async def body(self, receive: Receive) -> AsyncIterator[bytes]:
        """Read a body and hold it, within the limits of size and time."""
        limits, chunks, size = self.limits, [], 0
        try:
            try:
                async with asyncio.timeout(limits.body_s):
                    more = True
                    while more:
                        message = await asyncio.wait_for(receive(), limits.body_idle_s)
                        if message["type"] == "http.disconnect":
                            raise Refusal(400, "The connection was closed.")
                        chunk, more = message.get("body", b""), message.get("more_body", False)
                        chunks.append(chunk)
                        size += len(chunk)
                        self.held += len(chunk)
                        self._check(size)
            except TimeoutError:
                raise Refusal(408, "Expected the whole request sooner: it came too slowly.", "time") from None
            body = b"".join(chunks)
            chunks.clear()
            _check_tokens(body, limits)
            yield body
        finally:
            self.held -= size

    def _check(self, size: int) -> None:
        if size > self.limits.body_bytes:
            raise _too_large(self.limits)
        if self.held > self.limits.held_bytes:
            raise Refusal(503, "The studio holds too many large requests: try again later.", "busy")


def _check_tokens(body: bytes, limits: Limits) -> None:
    if sum(map(body.count, (b",", b"[", b"{", b":"))) > limits.body_tokens:
        raise Refusal(
            413, f"Expected a request of at most {limits.body_tokens} numbers and texts, got more.", "limit"
        )
