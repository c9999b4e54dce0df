"""The studio's server: the page, what is known of mazes, and jobs whose answers come line by line."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import importlib.resources
import math
import re
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.responses import JSONResponse
from shapely.geometry import LineString, Point
from starlette.exceptions import HTTPException
from starlette.types import Receive, Scope, Send

from hrsnake_env.errors import InputError
from hrsnake_env.ladder import LADDER
from hrsnake_env.maps import ENDINGS
from hrsnake_env.maze import MAZES, SEEDED_MAZES, Maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from hrsnake_env.random_mazes import LINK_LENGTH
from planners.planning import PLANNERS
from planners.studio.files import export_formats
from planners.studio.guard import Guard, Refusal, Shelf, refuse
from planners.studio.jobs import Busy, Job, Jobs
from planners.studio.limits import Limits
from planners.studio.requests import REQUESTS, LongestRequest, PlanRequest, read_request
from planners.studio.scene import MAX_POINTS, scene_from_maze

__all__ = ["link_length_of", "studio_app"]

KINDS = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".png": "image/png",
}
"""Files of the page by their ending; no others are served."""

PLAYER = ("player.js", "player.css")

FAMILY_LINK_LENGTH = 400.0
"""For mazes that were made for no length of their own: two widths of their corridors."""

SEED_DIGITS = 9


@dataclass(frozen=True)
class _File:
    body: bytes
    kind: str

    @property
    def etag(self) -> str:
        return f'"{hashlib.sha256(self.body).hexdigest()[:32]}"'


def studio_app(limits: Limits, host: str = "127.0.0.1", start: Maze | None = None) -> Guard:
    """Return the studio as an ASGI application.

    Nothing is kept between requests but the queue of jobs and the workers, and nothing is written.

    Parameters
    ----------
    limits : Limits
        Of all that may be asked.
    host : str
        On which the server listens; requests to other names are refused.
    start : Maze, optional
        That the page opens with.
    """
    jobs, shelf, files = Jobs(limits), Shelf(limits), _page_files()

    @contextlib.asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        jobs.start()
        try:
            yield
        finally:
            await jobs.close()

    app = FastAPI(lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)
    app.state.jobs = jobs
    app.add_exception_handler(Refusal, _refused)
    app.add_exception_handler(HTTPException, _not_here)

    @app.get("/")
    async def index(request: Request) -> Response:
        return _served(files, "index.html", request)

    @app.get("/page/{name}")
    async def page(name: str, request: Request) -> Response:
        return _served(files, name, request)

    @app.get("/api/about")
    async def about() -> Response:
        return JSONResponse(await asyncio.to_thread(_about, limits, start))

    @app.get("/api/mazes/{name}")
    async def maze(name: str) -> Response:
        return JSONResponse(await asyncio.to_thread(_named, name, start))

    @app.post("/api/stop/{job_id}")
    async def stop(job_id: str) -> Response:
        return JSONResponse({"stopped": jobs.stop(job_id)})

    @app.post("/api/{kind}")
    async def ask(kind: str) -> Response:
        if kind not in REQUESTS:
            raise Refusal(404, f"Unknown kind of job {kind[:40]!r}. Available: {', '.join(REQUESTS)}.")
        return _Answer(kind, jobs, shelf)

    return Guard(app, host, limits)


class _Answer(Response):
    """Read a request, let it wait, and send its answer line by line; a closed connection cancels it."""

    def __init__(self, kind: str, jobs: Jobs, shelf: Shelf) -> None:
        super().__init__()
        self.kind, self.jobs, self.shelf = kind, jobs, shelf

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        try:
            await self._answer(receive, send)
        except Refusal as refusal:
            await refuse(refusal, receive, send, self.shelf.limits)

    async def _answer(self, receive: Receive, send: Send) -> None:
        async with self.shelf.body(receive) as body:
            job = await self._submitted(body)
            del body
            tasks = [asyncio.create_task(_gone(receive)), asyncio.create_task(self._send(job, send))]
            try:
                await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            finally:
                self.jobs.cancel(job)
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)

    async def _submitted(self, body: bytes) -> Job:
        limits = self.shelf.limits
        try:
            ask = await asyncio.to_thread(read_request, self.kind, body)
        except InputError as error:
            raise Refusal(422, str(error)) from None
        budget = ask.time_budget if isinstance(ask, PlanRequest | LongestRequest) else None
        if budget is not None and budget > limits.time_budget_s:
            raise Refusal(
                422, f"Expected a time budget of at most {limits.time_budget_s:g} s, got {budget:g} s."
            )
        seconds = (budget or limits.time_budget_s) + limits.grace_s
        try:
            return self.jobs.submit(self.kind, body, limits.longest_s if self.kind == "longest" else seconds)
        except Busy:
            raise Refusal(
                503, f"The studio is busy: {limits.queue} jobs wait already. Try again later.", "busy"
            ) from None

    async def _send(self, job: Job, send: Send) -> None:
        headers = [(b"content-type", b"application/x-ndjson"), (b"x-accel-buffering", b"no")]
        await send({"type": "http.response.start", "status": 200, "headers": headers})
        async for line in job.lines():
            async with asyncio.timeout(self.shelf.limits.send_s):
                await send({"type": "http.response.body", "body": line, "more_body": True})
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _gone(receive: Receive) -> None:
    """Wait until the client has closed the connection."""
    while (await receive())["type"] != "http.disconnect":
        pass


async def _refused(_: Request, refusal: Exception) -> Response:
    assert isinstance(refusal, Refusal)
    return JSONResponse(refusal.to_dict(), refusal.status, {"connection": "close"})


async def _not_here(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    what = "nothing" if error.status_code == 404 else f"no {request.method}"
    return await _refused(request, Refusal(error.status_code, f"There is {what} at this address."))


def _page_files() -> dict[str, _File]:
    """Read all files of the page, once: no path from a request is ever opened."""
    page = importlib.resources.files("planners.studio").joinpath("page")
    found = list(page.iterdir()) if page.is_dir() else []
    found += [importlib.resources.files("hrsnake_env").joinpath(name) for name in PLAYER]
    files = {}
    for file in found:
        ending = file.name[file.name.rfind(".") :]
        if ending in KINDS and file.is_file():
            files[file.name] = _File(file.read_bytes(), KINDS[ending])
    return files


def _served(files: dict[str, _File], name: str, request: Request) -> Response:
    if name not in files:
        raise Refusal(404, "There is no such file of the page.")
    file = files[name]
    if request.headers.get("if-none-match") == file.etag:
        return Response(status_code=304, headers={"etag": file.etag})
    return Response(file.body, headers={"etag": file.etag, "content-type": file.kind})


def _about(limits: Limits, start: Maze | None) -> dict[str, Any]:
    """Return what the page needs to know before anything is asked."""
    auto = {"name": "auto", "about": "Try the track, then the sweep and the others, then other ways round."}
    planners = [{"name": name, "about": _first_sentence(each)} for name, each in PLANNERS.items()]
    return {
        "version": _version(),
        "planners": [auto, *planners],
        "mazes": [{"name": name, "link_length": link_length_of(name)} for name in (*MAZES, *LADDER)],
        "exports": [
            {"name": name, "ending": ending, "about": about}
            for name, (ending, _, about) in export_formats().items()
        ],
        "map_endings": list(ENDINGS),
        "limits": {**limits.to_dict(), "polygon_points": MAX_POINTS},
        "start": None if start is None else start.name,
    }


def _first_sentence(planner: Callable[..., Any]) -> str:
    first = (planner.__doc__ or "").strip().partition("\n")[0]
    return re.sub(r" \[\d+\]_|; see `\w+`", "", first)  # what only the reference can show


def _version() -> str:
    try:
        return version("hrsnake")
    except PackageNotFoundError:  # run from the sources
        return "0"


def link_length_of(name: str) -> float:
    """Return a link length that suits a named maze, in its units."""
    if name in PAPER_LINK_LENGTHS:
        return PAPER_LINK_LENGTHS[name]
    if name in LADDER:
        return LADDER[name].link_length
    return LINK_LENGTH if name.startswith("random-") else FAMILY_LINK_LENGTH


def _fitting_length(maze: Maze) -> float:
    """Return a link length with which the arm leaves the feeder of any maze."""
    x, y, heading = maze.base_pose
    ray = LineString([(x, y), (x + maze.size * math.cos(heading), y + maze.size * math.sin(heading))])
    free = ray.intersection(maze.free_space.boundary).distance(Point(x, y)) or maze.size
    return float(f"{min(0.1 * maze.size, 0.5 * free):.2g}")


def _named(name: str, start: Maze | None) -> dict[str, Any]:
    """Return a named maze as a drawing; never a file."""
    if start is not None and name == start.name:
        return {"scene": scene_from_maze(start), "link_length": _fitting_length(start)}
    kind, _, seed = name.rpartition("-")
    seeded = kind in SEEDED_MAZES and seed.isascii() and seed.isdigit() and len(seed) <= SEED_DIGITS
    if name not in MAZES and name not in LADDER and not seeded:
        names = ", ".join([*MAZES, *LADDER, *(f"{kind}-SEED" for kind in SEEDED_MAZES)])
        raise Refusal(404, f"Unknown maze {name[:40]!r}. Available: {names}.")
    try:
        return {"scene": scene_from_maze(Maze.load(name)), "link_length": link_length_of(name)}
    except InputError as error:
        raise Refusal(422, str(error)) from None
