"""Serving the studio: a free port, the browser, and an orderly end."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import socket
import threading
import webbrowser
from collections.abc import Callable
from typing import Any

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol

from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.studio.limits import Limits
from planners.studio.server import studio_app

__all__ = ["listening_socket", "serve", "server_on"]

PORTS_TRIED = 50

CLOSING_S = 1
"""Seconds that requests have to end when the server does."""


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a socket that listens on this port, or on the next free one; port 0 takes any.

    Raises
    ------
    InputError
        If the host is not this machine's, or none of these ports is free.
    """
    name = host.strip("[]")
    for candidate in range(port, min(port + PORTS_TRIED, 65536)) if port else [0]:
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(
                name, candidate, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
            )[0]
            listener = socket.socket(family, kind, protocol)
        except (OSError, UnicodeError):
            raise InputError(f"Expected a host name or address of this machine, got {host!r}.") from None
        try:
            if os.name == "posix":  # elsewhere it would let two servers share a port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(256)
            return listener
        except OSError as error:
            listener.close()
            if error.errno == errno.EADDRNOTAVAIL:
                raise InputError(f"Expected a host name or address of this machine, got {host!r}.") from None
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise InputError(f"Expected a port that can be used, got {port}: {error.strerror}.") from None
    raise InputError(f"Expected a free port from {port} on, but all {PORTS_TRIED} that were tried are taken.")


def server_on(host: str, limits: Limits, start: Maze | None = None) -> uvicorn.Server:
    """Return a server of the studio that is ready to `serve` on a socket."""
    config = uvicorn.Config(
        studio_app(limits, host, start),
        http=_protocol(limits.head_s),
        ws="none",
        lifespan="on",
        log_level="error",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=CLOSING_S,
    )
    return _Server(config)


class _Server(uvicorn.Server):
    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End all jobs first: their answers would keep connections open."""
        await self.config.app.app.state.jobs.close()  # type: ignore[union-attr]
        await super().shutdown(sockets)


def serve(server: uvicorn.Server, listener: socket.socket, ready: Callable[[], None]) -> None:
    """Serve until Ctrl-C; `ready` is called when the page can be opened."""

    async def run() -> None:
        serving = asyncio.create_task(server.serve(sockets=[listener]))
        while not server.started and not serving.done():
            await asyncio.sleep(0.01)
        if server.started:
            ready()
        await serving

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(run())


def open_browser(url: str) -> None:
    """Open the page, without waiting for the browser."""
    threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def _protocol(head_s: float) -> type[H11Protocol]:
    """Return uvicorn's protocol, which also closes connections that take long to ask for something."""

    class Protocol(H11Protocol):
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self.loop.call_later(head_s, self._check, None)

        def _check(self, last: Any) -> None:
            if self.transport.is_closing():
                return
            if self.cycle is last and (last is None or last.response_complete):
                self.transport.close()
            else:
                self.loop.call_later(head_s, self._check, self.cycle)

    return Protocol
