"""The pictures of `docs/studio.md`, taken of the page in a headless Chromium.

Run `.venv/bin/python docs/make_studio.py` from the repository's root: it writes `docs/images/studio_draw.png`
and `docs/images/studio_watch.png`.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
sys.path.insert(0, str(ROOT / "tests"))

from browser import Page, start_browser  # noqa: E402, the tests' own

DRAWING = "fig17b"
RUN = "fig17a"
POSE = 0.62  # as a share of the run
SOLVED = "document.documentElement.dataset.view === 'watch' && studio.watch.player !== null"


def main() -> None:
    """Open the studio with two mazes, plan in the second, and take pictures."""
    with tempfile.TemporaryDirectory() as folder:
        browser = start_browser(Path(folder))
        try:
            page = studio(browser, DRAWING)
            page.save_picture(IMAGES / "studio_draw.png")
            page = studio(browser, RUN)
            page.evaluate("document.querySelector('#plan').click()")
            page.wait(SOLVED, 180.0)
            page.evaluate("studio.watch.player.pause()")
            page.evaluate(f"studio.watch.player.goTo(Math.round({POSE} * studio.watch.player.last))")
            page.frames(4)
            page.save_picture(IMAGES / "studio_watch.png")
        finally:
            browser.close()


SERVERS: list[subprocess.Popen[str]] = []


def studio(browser, maze):  # type: ignore[no-untyped-def]
    """Start a studio with a maze, and open its page."""
    command = [sys.executable, "-m", "planners", "studio", maze, "--no-browser", "--port", "0"]
    SERVERS.append(subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True))
    (url,) = re.findall(r"http://\S+", SERVERS[-1].stdout.readline())
    page = Page(browser, url, 1280, 800)
    page.frames(4)
    return page


if __name__ == "__main__":
    try:
        main()
    finally:
        for server in SERVERS:
            server.send_signal(signal.SIGINT)
            server.wait()
