"""The studio's page in a real browser, on a real server: draw, plan, watch, compare, save, export."""

import base64
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from test_replay import Browser, Page, browser  # noqa

pytest.importorskip("fastapi")
pytest.importorskip("uvicorn")

MAPS = Path(__file__).with_name("maps")
COMMAND = """
import typer
from planners.cli_studio import studio_command

if __name__ == "__main__":
    typer.run(studio_command)
"""
SHIFT, CONTROL = 8, 2  # modifiers of keys, as the protocol counts them
SOLVED = "document.documentElement.dataset.view === 'watch' && studio.watch.player !== null"
IDLE = "document.documentElement.dataset.busy === '0'"


@pytest.fixture(scope="module")
def address():
    """Return the address of a studio that runs."""
    command = [sys.executable, "-c", COMMAND, "--no-browser", "--port", "0", "--jobs", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        (url,) = re.findall(r"http://\S+/", process.stdout.readline())
        yield url
        process.send_signal(signal.SIGINT)


@pytest.fixture
def studio(browser, address, tmp_path):
    """Return a function that opens the page, and closes it in the end."""
    pages = []

    def open_page(width=1280, height=800, **settings):
        pages.append(Studio(browser, address, width, height, **settings))
        pages[-1].take_downloads(tmp_path)
        return pages[-1]

    yield open_page
    for page in pages:
        page.evaluate("localStorage.clear(), Storage.prototype.setItem = () => {}, 0")  # the next one starts afresh
        page.close()


class Studio(Page):
    """Drive the page as a user does: by what is seen, in maze units."""

    folder = None

    def close(self):
        assert self.evaluate("document.documentElement.dataset.errors") == ""
        mine = [event for event in self.browser.events if event.get("sessionId") == self._session]
        bad = [event for event in mine if event["method"] in ("Runtime.exceptionThrown", "Log.entryAdded")]
        assert [b for b in bad if "422" not in str(b)] == []
        self.browser.call("Target.closeTarget", targetId=self._target)

    def take_downloads(self, folder):
        """Let downloads go to a folder."""
        self.folder = folder
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def downloaded(self, ending):
        """Return the file that has been downloaded."""
        end = time.monotonic() + 30.0
        while not (found := [path for path in self.folder.iterdir() if path.name.endswith(ending)]):
            assert time.monotonic() < end, f"no {ending} has come: {self.text('#export-problem')}"
            time.sleep(0.05)
        return found[0]

    def text(self, query):
        """Return the text of the first part that fits a query."""
        return self.evaluate(f"document.querySelector({query!r})?.textContent ?? ''")

    def press(self, query):
        """Click what fits a query, where it is seen."""
        self.evaluate(f"document.querySelector({query!r}).scrollIntoView({{block: 'nearest'}})")
        box = self.evaluate(f"(({BOX})(document.querySelector({query!r})))")
        self.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)

    def fill(self, query, text):
        """Type into a field, and leave it."""
        self.evaluate(
            f"(field => {{ field.value = {text!r}; for (const type of ['input', 'change'])"
            f" field.dispatchEvent(new Event(type, {{bubbles: true}})) }})(document.querySelector({query!r}))"
        )

    def choose(self, query, *paths):
        """Choose files."""
        node = self.call("Runtime.evaluate", expression=f"document.querySelector({query!r})")
        self.call(
            "DOM.setFileInputFiles",
            files=[str(path) for path in paths],
            objectId=node["result"]["objectId"],
        )

    def at(self, x, y):
        """Return where a place in the maze is seen."""
        return self.evaluate(
            "(() => { const box = document.getElementById('canvas').getBoundingClientRect();"
            f" const [x, y] = studio.view.toScreen({x}, {y}); return [box.left + x, box.top + y]; }})()"
        )

    def drag(self, start, end):
        """Drag with the mouse, from place to place."""
        (x0, y0), (x1, y1) = self.at(*start), self.at(*end)
        self.mouse("mousePressed", x0, y0, button="left", clickCount=1)
        for share in (0.3, 0.7, 1.0):
            self.mouse("mouseMoved", x0 + share * (x1 - x0), y0 + share * (y1 - y0), button="left", buttons=1)
        self.mouse("mouseReleased", x1, y1, button="left", clickCount=1)

    def tap(self, x, y):
        """Touch a place in the maze."""
        left, top = self.at(x, y)
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": left, "y": top}])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def scene(self):
        """Return the drawing."""
        return self.evaluate("studio.store.scene")

    def plan(self):
        """Plan, and wait for the answer."""
        self.press("#plan")
        self.wait(f"{IDLE} && document.querySelector('#outcomes .outcome') !== null")


BOX = "part => { const { x, y, width, height } = part.getBoundingClientRect(); return { x, y, width, height }; }"


# Draw, plan, watch


def test_the_page_opens_with_a_maze_that_is_planned_in_one_click(studio):
    page = studio()
    page.plan()
    page.wait(SOLVED)
    assert page.text("#outcomes .chip").startswith("clean")
    page.wait("studio.watch.player.pose > 2")  # it plays by itself
    page.evaluate("studio.watch.player.pause(), studio.watch.player.goTo(40)")
    page.frames()
    assert page.evaluate("document.getElementById('player').dataset.pose") == "40"
    page.key("ArrowRight")
    page.frames()
    assert page.evaluate("studio.watch.player.pose") == 41
    page.key("Escape")
    assert page.evaluate("document.documentElement.dataset.view") == "draw"
    assert page.evaluate("studio.watch.player") is None


def test_a_corridor_is_drawn_with_the_mouse_and_planned(studio):
    page = studio()
    page.press("#open")
    page.press("#new-scene")
    assert page.scene()["shapes"] == []
    for x, y in ((100, 100), (100, 500), (500, 500)):
        page.click(*page.at(x, y))
    page.click(*page.at(500, 500))  # once more: the end
    assert page.scene()["shapes"] == [{"role": "free", "line": [[100, 100], [100, 500], [500, 500]], "width": 100}]
    page.press("[data-tool=base]")
    page.click(*page.at(100, 120))
    page.press("[data-tool=goal]")
    page.click(*page.at(450, 500))
    assert page.scene()["base"] == [100, 120, 90] and page.scene()["goal"] == [450, 500]
    page.fill("#link-length", "120")
    page.plan()
    page.wait(SOLVED)


def test_walls_are_what_was_drawn_last(studio):
    page = studio()
    page.evaluate("studio.editor.options.snap = false, studio.editor.options.pillar = 'square'")
    page.press("[data-tool=pillar]")
    page.drag((-40, 1000), (40, 1080))
    corners = np.array(page.scene()["shapes"][1]["rings"][0])
    np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [[-40, 1000], [40, 1080]], atol=2.0)
    module = "import('/page/scene.js').then(({ isFree }) => [[0, 900], [0, 1040], [0, 1200], [400, 0]].map(([x, y]) => isFree(studio.store.scene, x, y)))"
    assert page.evaluate(module) == [True, False, True, False]
    page.key("z", modifiers=CONTROL)
    assert len(page.scene()["shapes"]) == 1
    page.key("y", modifiers=CONTROL)
    assert len(page.scene()["shapes"]) == 2


def test_base_goal_and_corners_are_dragged(studio):
    page = studio()
    page.press("[data-tool=select]")
    page.drag((240, 700), (240, 900))
    page.drag((0, 5), (0, 100))
    assert page.scene()["goal"] == [240, 900] and page.scene()["base"] == [0, 100, 90]
    page.click(*page.at(-80, 800))  # the corridor
    page.drag((240, 0), (240, 200))
    assert page.scene()["shapes"][0]["line"][-1] == [240, 200]
    page.drag((0, 800), (-100, 800))  # the middle of an edge becomes a corner
    assert len(page.scene()["shapes"][0]["line"]) == 5
    page.key("Delete")
    assert len(page.scene()["shapes"][0]["line"]) == 4


def test_a_maze_is_drawn_and_planned_with_keys_alone(studio):
    page = studio()
    page.evaluate("document.getElementById('new-scene').click(), studio.view.gridStep")
    step = page.evaluate("studio.view.gridStep")
    walk = lambda key, times, far=0: [page.key(key, modifiers=far) for _ in range(times)]  # noqa: E731
    page.evaluate("document.body.focus(), studio.editor.cursor = null")
    page.key("c", text="c")
    page.key("Enter")
    walk("ArrowUp", 1, SHIFT)
    page.key("Enter")
    walk("ArrowRight", 1, SHIFT)
    page.key("Enter")
    page.key("Enter")
    (shape,) = page.scene()["shapes"]
    start = np.array(shape["line"][0])
    np.testing.assert_allclose(np.array(shape["line"]) - start, [[0, 0], [0, 10 * step], [10 * step, 10 * step]])
    page.key("g", text="g")
    page.key("Enter")  # at the corridor's end
    walk("ArrowLeft", 1)
    page.key("b", text="b")
    walk("ArrowLeft", 1, SHIFT)
    walk("ArrowRight", 1)
    walk("ArrowDown", 9)
    page.key("Enter")
    np.testing.assert_allclose(np.array(page.scene()["base"][:2]) - start, [0, step])
    assert "base is at" in page.text("#status")
    page.fill("#link-length", str(2 * step))
    page.key("Enter", modifiers=CONTROL)
    page.wait(SOLVED)


def test_a_picked_up_goal_follows_the_arrows_until_it_is_dropped_or_put_back(studio):
    page = studio()
    page.press("[data-tool=select]")
    page.evaluate("studio.editor.cursor = [240, 700], studio.editor.canvas.focus()")
    step = page.evaluate("studio.view.gridStep")
    for last, expected in (("Escape", 700), ("Enter", 700 + step)):
        page.evaluate("studio.editor.cursor = [240, 700]")
        page.key("Enter")
        page.key("ArrowUp")
        assert page.scene()["goal"][1] == 700 + step
        page.key(last)
        assert page.scene()["goal"][1] == expected


def test_a_maze_is_drawn_with_fingers_on_a_phone(studio):
    page = studio(width=390, height=844, mobile=True)
    page.evaluate("document.getElementById('new-scene').click(), scrollTo(0, 0)")
    page.frames()
    for place in ((300, 100), (300, 600), (700, 600)):
        page.tap(*place)
    page.press("#finish")
    assert len(page.scene()["shapes"]) == 1 and len(page.scene()["shapes"][0]["line"]) == 3
    page.evaluate("scrollTo(0, 0), studio.editor.setTool('base')")
    page.tap(300, 150)
    page.evaluate("studio.editor.setTool('goal')")
    page.tap(650, 600)
    assert page.scene()["base"] and page.scene()["goal"]
    before = page.evaluate("studio.view.scale")
    (x, y), wide = page.at(500, 300), 40
    touch = lambda kind, by: page.call(  # noqa: E731
        "Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x - by, "y": y, "id": 1}, {"x": x + by, "y": y, "id": 2}] if by else []
    )
    touch("touchStart", wide)
    touch("touchMove", 2 * wide)
    touch("touchEnd", 0)
    assert page.evaluate("studio.view.scale") == pytest.approx(2 * before, rel=0.1)
    assert len(page.scene()["shapes"]) == 1
    page.fill("#link-length", "150")
    page.plan()
    page.wait(SOLVED)


# Ending early, and what goes wrong


def test_planning_is_cancelled_and_the_next_plan_works(studio):
    page = studio()
    page.press("#longest")
    page.wait("document.documentElement.dataset.busy === '1'")
    page.wait("document.getElementById('work-bar').hasAttribute('value')")
    page.key("Escape")
    page.wait(IDLE)
    assert page.evaluate("document.getElementById('alert').hidden && document.getElementById('work').hidden")
    page.plan()
    page.wait(SOLVED)


def test_a_link_that_is_too_long_gets_a_sentence_and_a_mark(studio):
    page = studio()
    page.fill("#link-length", "445")  # 440 is the longest that passes
    page.plan()
    assert page.evaluate("document.documentElement.dataset.view") == "draw"
    sentence = page.text("#outcomes [role=alert]")
    assert len(sentence) > 20 and page.text("#outcomes .chip") == "no motion"
    assert len(page.evaluate("studio.editor.failures")) == 1
    assert page.evaluate("document.getElementById('runs-section').hidden")


@pytest.mark.parametrize(
    ("field", "text", "sentence"),
    [
        ("#link-length", "", "Give the link length: a number over 0."),
        ("#link-length", "-3", "Give the link length: a number over 0."),
        ("#n-links", "2.5", "Links: a whole number over 0, or nothing for as many as are needed."),
        ("#joint-limit", "500", "Joint limit: degrees over 0 up to 180, or nothing for none."),
        ("#budget", "0", "Time budget: seconds over 0."),
    ],
)
def test_settings_that_are_none_are_refused_in_a_sentence(studio, field, text, sentence):
    page = studio()
    page.fill(field, text)
    page.press("#plan")
    page.wait("!document.getElementById('alert').hidden")
    assert page.text("#alert-text") == sentence
    assert page.evaluate(IDLE)


def test_a_base_in_a_wall_is_said_before_and_after_planning(studio):
    page = studio()
    page.evaluate("studio.store.change({ base: [-500, 0, 90] })")
    page.wait("document.getElementById('hints').textContent.includes('The base is in a wall.')")
    page.press("#plan")
    page.wait("!document.getElementById('alert').hidden")
    assert "base inside the free space" in page.text("#alert-text")


# Longest link, two planners


def test_the_longest_link_is_found_and_used(studio):
    page = studio()
    page.press("#longest")
    page.wait("document.getElementById('work-news').textContent !== ''")
    page.press("#stop")
    page.wait(f"{IDLE} && document.querySelector('#outcomes .outcome') !== null")
    assert "No link over 440" in page.text("#outcomes .outcome")
    assert page.evaluate("document.querySelectorAll('#outcomes tbody tr').length") > 0
    if page.evaluate("document.querySelector('.use-length') !== null"):
        page.press(".use-length")
        assert 0.0 < float(page.evaluate("document.getElementById('link-length').value")) < 440.0


def test_two_planners_are_watched_side_by_side(studio):
    page = studio()
    page.fill("#second", "sweep")
    page.fill("#planner", "track")
    assert page.text("#plan") == "Plan both"
    page.press("#plan")
    page.wait(SOLVED)
    titles = page.evaluate("Array.from(document.querySelectorAll('#player .hp-head'), (head) => head.textContent)")
    assert len(titles) == 2 and "track" in titles[0] and "sweep" in titles[1]
    assert page.evaluate("studio.runs.list.length") == 2


def test_runs_of_an_earlier_drawing_say_so(studio):
    page = studio()
    page.plan()
    page.wait(SOLVED)
    page.press("#back")
    assert "earlier" not in page.text("#runs")
    page.evaluate("studio.store.change({ goal: [240, 800] })")
    page.wait("document.getElementById('runs').textContent.includes('of an earlier drawing')")
    page.press("#runs .icon")
    assert page.evaluate("studio.runs.list.length") == 0


# Files


def test_a_saved_file_brings_back_drawing_settings_and_runs(studio):
    page = studio()
    page.fill("#link-length", "420")
    page.plan()
    page.wait(SOLVED)
    page.key("s", modifiers=CONTROL)
    path = page.downloaded(".hrsnake.json")
    saved = json.loads(path.read_text())
    assert saved["hrsnake"] == 1 and saved["scene"] == page.scene() and len(saved["runs"]) == 1
    page.evaluate("document.getElementById('new-scene').click(), studio.runs.clear()")
    page.choose("#file", path)
    page.wait("studio.runs.list.length === 1")
    assert page.scene() == saved["scene"]
    assert page.evaluate("document.getElementById('link-length').value") == "420"
    assert "1 of 1 runs checked" in page.text("#status")
    saved["scene"]["shapes"][0]["width"] = 100  # now the motion goes through walls
    path.write_text(json.dumps(saved))
    page.choose("#file", path)
    page.wait("!document.getElementById('alert').hidden")
    assert "not shown" in page.text("#alert-text") and "refused the motion" in page.text("#alert-text")
    assert page.evaluate("studio.runs.list.length") == 1  # the old one alone


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("x.hrsnake.json", "{", "no JSON"),
        ("x.hrsnake.json", '{"hrsnake": 2}', "got another one"),
        ("x.hrsnake.json", '{"hrsnake": 1, "scene": {"shapes": [{"role": "free", "rings": [[[0, 0], [1, null], [1, 1]]]}]}}', "not two finite numbers"),
        ("x.hrsnake.json", '{"hrsnake": 1, "scene": {"shapes": []}, "runs": [{}]}', "run 1 has none"),
    ],
)
def test_a_broken_file_is_said_and_nothing_is_lost(studio, tmp_path, name, content, said):
    page = studio()
    before = page.scene()
    (tmp_path / name).write_text(content)
    page.choose("#file", tmp_path / name)
    page.wait("!document.getElementById('alert').hidden")
    assert said in page.text("#alert-text")
    assert page.scene() == before


def test_a_map_is_read_shown_and_used(studio):
    page = studio()
    page.choose("#file", MAPS / "ros_house.yaml", MAPS / "ros_house.pgm")
    page.wait("!document.getElementById('map-use').disabled")
    assert page.evaluate("document.querySelectorAll('#map-notes li').length") > 0
    first = page.evaluate("document.querySelector('#map-notes').textContent")
    page.evaluate("document.getElementById('map-more').open = true")
    page.fill("[name=scale]", "1000")
    page.fill("[name=units]", "mm")
    page.wait("document.getElementById('map-dialog').dataset.reading === undefined")
    assert page.evaluate("document.querySelector('#map-notes').textContent") != "" and first
    page.press("#map-use")
    page.wait("studio.store.scene.units === 'mm'")
    assert len(page.scene()["shapes"]) > 0
    assert page.evaluate("studio.editor.tool") == "base"


def test_a_broken_map_is_said_and_the_drawing_stays(studio, tmp_path):
    page = studio()
    before = page.scene()
    (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n and nothing more")
    page.choose("#file", tmp_path / "broken.png")
    page.wait("!document.getElementById('map-problem').hidden")
    assert page.text("#map-problem").startswith("Expected")
    page.press("#map-cancel")
    assert page.scene() == before


def test_runs_are_exported(studio):
    page = studio()
    page.plan()
    page.wait(SOLVED)
    for name, ending, begin in (("csv", ".csv", b"time_s"), ("html", ".html", b"<!DOCTYPE html>")):
        page.press("#export")
        page.fill("#export-format", name)
        page.press("#export-go")
        assert page.downloaded(ending).read_bytes().startswith(begin)
        page.press("#export-cancel")


def test_an_export_that_is_refused_says_why(studio):
    page = studio()
    page.plan()
    page.wait(SOLVED)
    page.press("#export")
    page.fill("#export-format", "ros2-yaml")
    page.press("#export-go")  # pixels have no length in metres
    page.wait("!document.getElementById('export-problem').hidden")
    assert "metres" in page.text("#export-problem")
    page.press("#export-cancel")


def test_a_closed_tab_loses_nothing(studio):
    page = studio()
    page.evaluate("studio.store.change({ goal: [240, 640] })")
    page.call("Page.reload")
    page.wait("document.documentElement.dataset.ready === '1' && window.studio.store.scene.goal[1] === 640")


# How it looks


@pytest.mark.parametrize(("width", "height", "dark"), [(1280, 800, False), (768, 1024, True), (360, 740, False)])
def test_nothing_is_clipped_at_any_width(studio, width, height, dark):
    page = studio(width=width, height=height, dark=dark, mobile=width < 500)
    page.fill("#second", "sweep")
    for view in ("draw", "open", "export", "help", "watch"):
        if view == "watch":
            page.press("#plan")
            page.wait(SOLVED)
        elif view != "draw":
            page.evaluate(f"document.getElementById('{view}').click()")
        page.frames()
        assert page.evaluate("document.documentElement.scrollWidth") <= width, view
        assert page.evaluate(OUTSIDE) == [], view
        page.evaluate("document.querySelectorAll('dialog[open]').forEach((dialog) => dialog.close())")


OUTSIDE = """
Array.from(document.querySelectorAll('button, input, select, canvas')).filter((part) => {
  const box = part.getBoundingClientRect();
  return box.width && (box.left < -1 || box.right > innerWidth + 1);
}).map((part) => part.id || part.className)
"""


def test_every_control_has_a_name(studio):
    page = studio()
    nameless = page.evaluate(
        "Array.from(document.querySelectorAll('button, input, select, canvas')).filter((part) =>"
        " part.type !== 'file' && !part.getAttribute('aria-label') && !part.textContent.trim()"
        " && !part.closest('label') && part.getAttribute('role') !== 'presentation').map((part) => part.id)"
    )
    assert nameless == []


def test_a_frame_of_forty_five_links_takes_less_than_a_sixtieth_of_a_second(studio):
    page = studio()
    page.press("#open")
    page.evaluate("Array.from(document.querySelectorAll('#mazes button')).find((each) => each.textContent === 'fig17a').click()")
    page.wait("studio.store.scene.name === 'fig17a'")
    assert page.evaluate("document.getElementById('link-length').value") == "245"
    page.press("#plan")
    page.wait(SOLVED)
    page.wait("studio.watch.player.frameTimes().draws.length > 60")
    times = page.evaluate("studio.watch.player.frameTimes()")
    assert np.median(times["draws"]) < 16.0
