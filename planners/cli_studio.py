"""`hrsnake studio`: draw, plan, watch and export on a page in the browser."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES, Maze

__all__ = ["studio_command"]

PORT, HOST = 8642, "127.0.0.1"

MAX_JOBS, MAX_SECONDS = 64, 86_400.0


def studio_command(
    maze: Annotated[
        str | None,
        typer.Argument(metavar="[MAZE]", help=f"To open: a .geojson file, or one of: {', '.join(MAZES)}."),
    ] = None,
    port: Annotated[int, typer.Option("--port", help="If it is taken, the next free one; 0 for any.")] = PORT,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen on; by default this machine alone can connect.")
    ] = HOST,
    jobs: Annotated[int, typer.Option("--jobs", help="Plans at once, each in a process of its own.")] = 2,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
    time_limit: Annotated[
        float, typer.Option("--time-limit", help="Most seconds that the page may give to a plan.")
    ] = 60.0,
) -> None:
    """Draw mazes, plan, watch and export on a page in the browser. Ctrl-C ends it."""
    _check(port, jobs, time_limit)
    world = None if maze is None else Maze.load(maze)
    # A maze of a file is handed to the server; named ones it knows, with link lengths that suit them.
    start = world if maze is not None and Path(maze).suffix else None
    name = maze if start is None else start.name
    from planners.studio.limits import Limits
    from planners.studio.running import listening_socket, open_browser, serve, server_on

    listener = listening_socket(host, port)
    bound = listener.getsockname()[1]
    shown = "127.0.0.1" if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host.strip("[]") else host
    url = f"http://{shown}:{bound}/" + ("" if name is None else f"?maze={quote(name)}")

    def ready() -> None:
        if port not in (0, bound):
            print(f"Port {port} is taken; this is {bound}.", file=sys.stderr)
        if host not in (HOST, "localhost", "::1", "[::1]"):
            print("Everybody who can reach this machine can use the studio now.", file=sys.stderr)
        print(f"The studio is open at {url} (Ctrl-C ends it).", flush=True)
        if not no_browser:
            open_browser(url)

    serve(server_on(host, Limits(jobs=jobs, time_budget_s=time_limit), start), listener, ready)


def _check(port: int, jobs: int, time_limit: float) -> None:
    missing = [name for name in ("fastapi", "uvicorn") if importlib.util.find_spec(name) is None]
    if missing:
        raise InputError(f"Expected {' and '.join(missing)} to be installed: pip install 'hrsnake[studio]'.")
    if not 0 <= port <= 65535:
        raise InputError(f"Expected a --port from 0 to 65535, got {port}.")
    if not 1 <= jobs <= MAX_JOBS:
        raise InputError(f"Expected --jobs from 1 to {MAX_JOBS}, got {jobs}.")
    if not 1.0 <= time_limit <= MAX_SECONDS:
        raise InputError(f"Expected a --time-limit from 1 to {MAX_SECONDS:g} s, got {time_limit:g}.")
