"""The studio, measured: start to first page, a plan over HTTP, many clients at once, frames of the player.

Run with `.venv/bin/python benchmarks/studio.py` from the repository's root, on Linux. Prints a table. Frames
are measured if there is a Chromium.
"""

from __future__ import annotations

import base64
import contextlib
import http.client
import io
import json
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hrsnake_env.mazes import PAPER_LINK_LENGTHS

STARTS, PLANS, CLIENTS, CROWD, FRAMES_S = 5, 15, 20, 60, 8.0
COMMAND = ["-c", "from planners.cli import main; main()", "studio", "--no-browser", "--port", "0"]
LENGTHS = np.linspace(380.0, 436.0, CLIENTS)
"""One for each client, by which its answer is known."""


@contextlib.contextmanager
def studio(*options: str) -> Iterator[tuple[subprocess.Popen[str], int, float]]:
    """Start the studio; yield its process, its port and the moment of its start."""
    start = time.perf_counter()
    words = [sys.executable, *COMMAND, *options]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        yield process, int(process.stdout.readline().partition("127.0.0.1:")[2].partition("/")[0]), start
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def get(port: int, path: str) -> bytes:
    """Ask for something that must be there."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port)) as connection:
        connection.request("GET", path)
        answer = connection.getresponse()
        assert answer.status == 200, path
        return answer.read()


def planned(port: int, scene: Any, link_length: float) -> tuple[int, Any]:
    """Plan; return the status and the last line of the answer."""
    ask = {"scene": scene, "arm": {"link_length": link_length}}
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port)) as connection:
        connection.request("POST", "/api/plan", json.dumps(ask), {"Content-Type": "application/json"})
        answer = connection.getresponse()
        return answer.status, json.loads([line for line in answer if line.strip()][-1])


def scene_of(port: int, name: str) -> Any:
    """Return a named maze as a drawing."""
    return json.loads(get(port, f"/api/mazes/{name}"))["scene"]


def is_right(status: int, last: Any, link_length: float) -> bool:
    """Whether an answer is a plan with links of this length."""
    if status != 200 or last["type"] != "done" or not last["result"]["solved"]:
        return False
    motion = np.load(io.BytesIO(base64.b64decode(last["result"]["motion"])))
    return float(motion["link_length"]) == link_length and bool(last["result"]["verdict"]["clean"])


def memory(pid: int) -> dict[str, float]:
    """Return the largest memory so far (MiB) of the server and of its workers."""

    def peak(each: str) -> float:
        lines = Path(f"/proc/{each}/status").read_text(encoding="utf-8").splitlines()
        return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))

    children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()
    others = [
        child
        for task in Path(f"/proc/{pid}/task").iterdir()
        for child in (task / "children").read_text(encoding="utf-8").split()
    ]
    return {"server": peak(str(pid)), "workers": sum(map(peak, {*children, *others}))}


def crowd(port: int, scene: Any, n_clients: int) -> dict[str, Any]:
    """Let many clients plan at once, each with a link length of its own; sort their answers."""
    counts = {"right": 0, "refused": 0, "wrong": 0}
    lock = threading.Lock()

    def ask(number: int) -> None:
        length = float(LENGTHS[number % CLIENTS])
        status, last = planned(port, scene, length)
        kind = "right" if is_right(status, last, length) else "refused" if status == 503 else "wrong"
        with lock:
            counts[kind] += 1

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(n_clients)]
    start = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return {**counts, "seconds": time.perf_counter() - start}


def maps_at_once(port: int) -> dict[str, Any]:
    """Let as many clients send large images of a map at once; count their answers."""
    image = np.full((2000, 2000), 255, dtype=np.uint8)
    image[::1999], image[:, ::1999], image[900:1100, 300:1700] = 0, 0, 0
    data = base64.b64encode(b"P5\n2000 2000\n255\n" + image.tobytes()).decode()
    body = json.dumps({"files": [{"name": "map.pgm", "data": data}]})
    kinds: list[str] = []

    def ask() -> None:
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port)) as connection:
            connection.request("POST", "/api/map", body, {"Content-Type": "application/json"})
            last = json.loads([line for line in connection.getresponse() if line.strip()][-1])
        kinds.append(last["type"] if last["type"] == "done" else last["kind"])

    threads = [threading.Thread(target=ask) for _ in range(CLIENTS)]
    start = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return {
        "read": kinds.count("done"),
        "refused": kinds.count("busy"),
        "seconds": time.perf_counter() - start,
    }


def first_pages() -> list[float]:
    """Return the seconds from the start of the process to the page."""
    seconds = []
    for _ in range(STARTS):
        with studio() as (_, port, start):
            get(port, "/")
            seconds.append(time.perf_counter() - start)
    return seconds


def frame_times(port: int, maze: str) -> dict[str, Any] | None:
    """Plan a maze from the page and play it: intervals of frames, and times to draw them, in ms."""
    sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
    from browser import BROWSERS, Page, start_browser  # the tests' own

    if not any(map(shutil.which, BROWSERS)):
        return None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = start_browser(Path(folder))
        try:
            page = Page(browser, f"http://127.0.0.1:{port}/?maze={maze}", 1280, 800)
            page.evaluate("document.getElementById('plan').click()")
            page.wait("studio.watch.player !== null", 180.0)
            time.sleep(FRAMES_S)  # it asks for nothing while it plays: that would cost frames
            return dict(page.evaluate("studio.watch.player.frameTimes()"))
        finally:
            browser.close()


def spread(values: list[float]) -> str:
    """Return median and 95th percentile."""
    middle, high = np.percentile(values, [50.0, 95.0])
    return f"median {middle:.1f} ms, 95th percentile {high:.1f} ms"


def main() -> None:
    """Measure and print."""
    pages = first_pages()
    print("| what | measured |\n|---|---|")
    print(f"| start to page, median of {STARTS} | {statistics.median(pages):.2f} s |", flush=True)
    with studio() as (process, port, start):
        scene = scene_of(port, "fig19")
        status, last = planned(port, scene, PAPER_LINK_LENGTHS["fig19"])
        assert is_right(status, last, PAPER_LINK_LENGTHS["fig19"]), last
        print(f"| start to first plan of fig19 | {time.perf_counter() - start:.2f} s |")
        times = []
        for _ in range(PLANS):
            begin = time.perf_counter()
            planned(port, scene, PAPER_LINK_LENGTHS["fig19"])
            times.append(time.perf_counter() - begin)
        print(
            f"| fig19, 430 px, planned, checked and simulated over HTTP | {statistics.median(times):.3f} s |"
        )
        begin = time.perf_counter()
        status, last = planned(port, scene_of(port, "fig17a"), PAPER_LINK_LENGTHS["fig17a"])
        assert is_right(status, last, PAPER_LINK_LENGTHS["fig17a"]), last
        print(f"| fig17a, 245 px, the same | {time.perf_counter() - begin:.3f} s |", flush=True)
        frames = frame_times(port, "fig17a")
        for name, values in (frames or {}).items():
            print(
                f"| fig17a, 245 px, played: {name} of {len(values)} frames | {spread(values)} |", flush=True
            )
        for n_clients in (CLIENTS, CROWD):
            found = crowd(port, scene, n_clients)
            print(
                f"| {n_clients} clients at once | {found['right']} right, {found['refused']} refused, "
                f"{found['wrong']} wrong, in {found['seconds']:.2f} s |"
            )
        maps = maps_at_once(port)
        print(
            f"| {CLIENTS} images of 2,000 x 2,000 at once | {maps['read']} read, {maps['refused']} refused, "
            f"in {maps['seconds']:.2f} s |"
        )
        used = memory(process.pid)
        print(f"| largest memory | server {used['server']:.0f} MiB, workers {used['workers']:.0f} MiB |")


if __name__ == "__main__":
    main()
