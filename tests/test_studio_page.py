"""The studio's page in a real browser, on a real server: draw, plan, watch, compare, save, export."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from browser import CONTROL, SHIFT, Page
from shapely.geometry import Point

pytest.importorskip("fastapi")
pytest.importorskip("uvicorn")

MAPS = Path(__file__).with_name("maps")
COMMAND = """
import typer
from planners.cli_studio import studio_command

if __name__ == "__main__":
    typer.run(studio_command)
"""
READ = "document.getElementById('map-dialog').open && !document.getElementById('map-use').disabled"
SOLVED = "document.documentElement.dataset.view === 'watch' && studio.watch.player !== null"
ANSWERED = (
    "(document.querySelector('#outcomes .outcome') !== null || !document.getElementById('alert').hidden)"
)
COMPILING = 240.0  # s: in a fresh checkout the first plan waits for the kernels to be compiled
OPEN = "document.documentElement?.dataset.ready === '1' && window.studio !== undefined"
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
def studio(browser, address):
    """Return a function that opens the page, and closes it in the end."""
    pages = []

    def open_page(width=1280, height=800, **settings):
        page = Studio(browser, address, width, height, allowed=(address,), **settings)
        page.expect('"source": "network"')  # a refusal is an answer
        pages.append(page)
        return page

    yield open_page
    for page in pages:
        # The next one starts afresh.
        page.evaluate("localStorage.clear(), Storage.prototype.setItem = () => {}, 0")
        page.close()


class Studio(Page):
    """Drive the page as a user does; places are in maze units."""

    def wait(self, condition, patience=COMPILING):
        """Wait until an expression is true."""
        super().wait(condition, patience)

    def text(self, query):
        """Return the text of the first part that fits a query."""
        return self.evaluate(f"document.querySelector({query!r})?.textContent ?? ''")

    def fill(self, query, text):
        """Type into a field, and leave it."""
        self.evaluate(
            f"(field => {{ field.value = {text!r}; for (const type of ['input', 'change'])"
            f" field.dispatchEvent(new Event(type, {{bubbles: true}})) }})(document.querySelector({query!r}))"
        )

    def open_files(self, *paths):
        """Choose files to open."""
        self.set_files("#file", *paths)

    def at(self, x, y):
        """Return where a place in the maze is seen."""
        return self.evaluate(
            "(() => { const box = document.getElementById('canvas').getBoundingClientRect();"
            f" const [x, y] = studio.view.toScreen({x}, {y}); return [box.left + x, box.top + y]; }})()"
        )

    def move(self, start, end):
        """Drag with the mouse, from place to place."""
        self.drag(self.at(*start), self.at(*end))

    def touch_at(self, x, y):
        """Touch a place."""
        self.tap(*self.at(x, y))

    def scene(self):
        """Return the drawing."""
        return self.evaluate("studio.store.scene")

    def plan(self):
        """Plan, and wait for the answer."""
        self.click_on("#plan")
        self.wait(f"{IDLE} && {ANSWERED}")

    def watch(self):
        """Plan, and wait until the run is played."""
        self.plan()
        assert self.text("#alert:not([hidden])") + self.text("#outcomes .bad") == ""
        self.wait(SOLVED)


# Draw, plan, watch


def test_the_page_opens_with_a_maze_that_is_planned_in_one_click(studio):
    page = studio()
    page.watch()
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
    page.click_on("#open")
    page.click_on("#new-scene")
    assert page.scene()["shapes"] == []
    for x, y in ((100, 100), (100, 500), (500, 500)):
        page.click(*page.at(x, y))
    page.click(*page.at(500, 500))  # once more: the end
    assert page.scene()["shapes"] == [
        {"role": "free", "line": [[100, 100], [100, 500], [500, 500]], "width": 100}
    ]
    page.click_on("[data-tool=base]")
    page.click(*page.at(100, 120))
    page.click_on("[data-tool=goal]")
    page.click(*page.at(440, 500))
    assert page.scene()["base"] == [100, 120, 90] and page.scene()["goal"] == [440, 500]
    page.fill("#link-length", "120")
    page.watch()


def test_a_square_pillar_is_dragged_open_undone_and_done_again(studio):
    page = studio()
    page.evaluate("studio.editor.options.snap = false, studio.editor.options.pillar = 'square'")
    page.click_on("[data-tool=pillar]")
    page.move((-40, 1000), (40, 1080))
    corners = np.array(page.scene()["shapes"][1]["rings"][0])
    np.testing.assert_allclose(
        [corners.min(axis=0), corners.max(axis=0)], [[-40, 1000], [40, 1080]], atol=2.0
    )
    page.key("z", modifiers=CONTROL)
    assert len(page.scene()["shapes"]) == 1
    page.key("y", modifiers=CONTROL)
    assert len(page.scene()["shapes"]) == 2


def test_what_is_seen_as_free_is_what_is_planned_in(studio):
    from planners.studio.scene import Scene, maze_from_scene

    ring, hole = [[-300, 300], [700, 250], [800, 900], [-250, 800]], [[0, 500], [90, 520], [60, 600]]
    shapes = [
        {"role": "free", "rings": [ring, hole]},
        {"role": "wall", "line": [[100, 300], [200, 700], [500, 450]], "width": 60},
        {"role": "free", "line": [[150, 500], [400, 650], [600, 200], [650, 700]], "width": 40},
        {"role": "wall", "rings": [[[-150, 350], [-50, 350], [-50, 450], [-150, 450]]]},
    ]
    page = studio()
    page.evaluate(f"studio.store.change({{ shapes: {shapes}, base: [-200, 600, 0], goal: [700, 800] }})")
    maze = maze_from_scene(Scene.model_validate_json(json.dumps(page.scene())))
    places = np.random.default_rng(0).uniform([-350, 200], [850, 950], (400, 2))
    points = [Point(place) for place in places]
    clear = [point.distance(maze.free_space.boundary) > 0.5 for point in points]
    module = "import('/page/scene.js').then(({ isFree }) => "
    free = page.evaluate(f"{module}{places.tolist()}.map(([x, y]) => isFree(studio.store.scene, x, y)))")
    expected = [maze.free_space.contains(point) for point in points]
    assert np.array(free)[clear].tolist() == np.array(expected)[clear].tolist()
    assert 50 < sum(expected) < 350


def test_base_goal_and_corners_are_dragged(studio):
    page = studio()
    page.click_on("[data-tool=select]")
    page.move((240, 700), (250, 900))
    page.move((0, 5), (0, 100))
    assert page.scene()["goal"] == [250, 900] and page.scene()["base"] == [0, 100, 90]
    page.click(*page.at(-80, 800))  # the corridor
    page.move((240, 0), (250, 200))
    assert page.scene()["shapes"][0]["line"][-1] == [250, 200]
    page.move((0, 750), (-100, 750))  # the middle of an edge becomes a corner
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
    np.testing.assert_allclose(
        np.array(shape["line"]) - start, [[0, 0], [0, 10 * step], [10 * step, 10 * step]]
    )
    walk("ArrowLeft", 1)
    page.key("g", text="g")
    page.key("Enter")  # a step before the corridor's end
    page.key("b", text="b")
    walk("ArrowLeft", 9)
    walk("ArrowDown", 9)
    page.key("Enter")
    np.testing.assert_allclose(np.array(page.scene()["base"][:2]) - start, [0, step])
    assert "base is at" in page.text("#status")
    page.fill("#link-length", str(2 * step))
    page.key("Enter", modifiers=CONTROL)
    page.wait(SOLVED)


def test_a_picked_up_goal_follows_the_arrows_until_it_is_dropped_or_put_back(studio):
    page = studio()
    page.click_on("[data-tool=select]")
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
        page.touch_at(*place)
    page.click_on("#finish")
    assert len(page.scene()["shapes"]) == 1 and len(page.scene()["shapes"][0]["line"]) == 3
    page.evaluate("scrollTo(0, 0), studio.editor.setTool('base')")
    page.touch_at(300, 150)
    page.evaluate("studio.editor.setTool('goal')")
    page.touch_at(650, 600)
    assert page.scene()["base"] == [300, 150, 90] and page.scene()["goal"] == [650, 600]
    before = page.evaluate("studio.view.scale")
    x, y = page.at(500, 300)
    page.touch("touchStart", (x - 40, y), (x + 40, y))
    page.touch("touchMove", (x - 80, y), (x + 80, y))
    page.touch("touchEnd")
    assert page.evaluate("studio.view.scale") == pytest.approx(2 * before, rel=0.1)
    assert page.scene()["goal"] == [650, 600]  # though a finger came down with its tool
    assert len(page.scene()["shapes"]) == 1
    page.fill("#link-length", "150")
    page.watch()


# Ending early, and what goes wrong


def test_planning_is_cancelled_and_the_next_plan_works(studio):
    page = studio()
    page.click_on("#longest")
    page.wait("document.documentElement.dataset.busy === '1'")
    page.wait("document.getElementById('work-bar').hasAttribute('value')")
    page.key("Escape")
    page.wait(IDLE)
    assert page.evaluate("document.getElementById('alert').hidden && document.getElementById('work').hidden")
    page.watch()


def test_a_link_that_is_too_long_gets_a_sentence_and_a_mark(studio):
    page = studio()
    page.fill("#link-length", "445")  # 440 is the longest that passes
    page.fill("#planner", "sweep")
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
    page.click_on("#plan")
    page.wait("!document.getElementById('alert').hidden")
    assert page.text("#alert-text") == sentence
    assert page.evaluate(IDLE)


def test_a_base_in_a_wall_is_said_before_and_after_planning(studio):
    page = studio()
    page.evaluate("studio.store.change({ base: [-500, 0, 90] })")
    page.wait("document.getElementById('hints').textContent.includes('The base is in a wall.')")
    page.click_on("#plan")
    page.wait("!document.getElementById('alert').hidden")
    assert "base inside the free space" in page.text("#alert-text")


def test_a_server_that_is_gone_is_said_and_nothing_is_lost(studio):
    page = studio()
    before = page.scene()
    offline = {"latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
    page.call("Network.emulateNetworkConditions", offline=True, **offline)
    page.click_on("#plan")
    page.wait("!document.getElementById('alert').hidden")
    assert "does not answer" in page.text("#alert-text") and page.scene() == before
    page.call("Network.emulateNetworkConditions", offline=False, **offline)
    page.watch()
    assert page.evaluate("document.getElementById('alert').hidden")


def test_undo_brings_back_a_replaced_drawing_with_its_settings(studio):
    page = studio()
    before = page.scene()
    page.click_on("#open")
    page.click_on("#new-scene")
    assert page.evaluate("document.getElementById('link-length').value") == "200"
    page.click_on("#undo")
    assert page.scene() == before
    assert page.evaluate("document.getElementById('link-length').value") == "430"


# Longest link, two planners


def test_the_longest_link_is_found_and_used(studio):
    page = studio()
    page.click_on("#longest")
    page.wait("document.getElementById('work-news').textContent.includes('best so far')")
    page.click_on("#stop")
    page.wait(f"{IDLE} && {ANSWERED}")
    assert "No link over 440" in page.text("#outcomes .outcome")
    page.click_on(".use-length")
    length = float(page.evaluate("document.getElementById('link-length').value"))
    assert 0.0 < length < 440.0
    assert page.evaluate("studio.runs.list[0].result.length") == pytest.approx(length, rel=1e-5)


def test_two_planners_are_watched_side_by_side(studio):
    page = studio()
    page.fill("#second", "sweep")
    page.fill("#planner", "track")
    assert page.text("#plan") == "Plan both"
    page.click_on("#plan")
    page.wait(SOLVED)
    titles = page.evaluate(
        "Array.from(document.querySelectorAll('#player .hp-head'), (head) => head.textContent)"
    )
    assert len(titles) == 2 and "track" in titles[0] and "sweep" in titles[1]
    assert page.evaluate("studio.runs.list.length") == 2


def test_runs_of_an_earlier_drawing_say_so(studio):
    page = studio()
    page.watch()
    page.click_on("#back")
    assert "earlier" not in page.text("#runs")
    page.evaluate("studio.store.change({ goal: [240, 800] })")
    page.wait("document.getElementById('runs').textContent.includes('of an earlier drawing')")
    page.click_on("#runs .icon")
    assert page.evaluate("studio.runs.list.length") == 0


# Files


def test_a_saved_file_brings_back_drawing_settings_and_runs(studio, tmp_path):
    page = studio()
    page.fill("#link-length", "420")
    page.watch()
    path = page.download(lambda: page.key("s", modifiers=CONTROL), tmp_path)
    assert path.name == "u-turn.hrsnake.json"
    saved = json.loads(path.read_text())
    assert saved["hrsnake"] == 1 and saved["scene"] == page.scene() and len(saved["runs"]) == 1
    page.evaluate("document.getElementById('new-scene').click(), studio.runs.clear()")
    page.open_files(path)
    page.wait("studio.runs.list.length === 1")
    assert page.scene() == saved["scene"]
    assert page.evaluate("document.getElementById('link-length').value") == "420"
    assert "1 of 1 runs checked" in page.text("#status")
    saved["scene"]["shapes"][0]["width"] = 100  # now the motion goes through walls
    path.write_text(json.dumps(saved))
    page.open_files(path)
    page.wait("!document.getElementById('alert').hidden")
    assert "not shown" in page.text("#alert-text") and "refused the motion" in page.text("#alert-text")
    assert page.evaluate("studio.runs.list.length") == 1  # the old one alone


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("x.hrsnake.json", "{", "no JSON"),
        ("x.hrsnake.json", '{"hrsnake": 2}', "got another one"),
        (
            "x.hrsnake.json",
            '{"hrsnake": 1, "scene": {"shapes": [{"role": "free", "rings": [[[0, 0], [1, null], [1, 1]]]}]}}',
            "not two finite numbers",
        ),
        ("x.hrsnake.json", '{"hrsnake": 1, "scene": {"shapes": []}, "runs": [{}]}', "run 1 has none"),
    ],
)
def test_a_broken_file_is_said_and_nothing_is_lost(studio, tmp_path, name, content, said):
    page = studio()
    before = page.scene()
    (tmp_path / name).write_text(content)
    page.open_files(tmp_path / name)
    page.wait("!document.getElementById('alert').hidden")
    assert said in page.text("#alert-text")
    assert page.scene() == before


def test_a_map_is_read_shown_and_used(studio):
    page = studio()
    page.open_files(MAPS / "ros_house.yaml", MAPS / "ros_house.pgm")
    page.wait(READ)
    assert page.evaluate("document.querySelectorAll('#map-notes li').length") > 0
    first = page.evaluate("document.querySelector('#map-notes').textContent")
    page.evaluate("document.getElementById('map-more').open = true")
    page.fill("[name=scale]", "1000")
    page.fill("[name=units]", "mm")
    page.wait(READ)
    assert page.evaluate("document.querySelector('#map-notes').textContent") != "" and first
    page.click_on("#map-use")
    page.wait("studio.store.scene.units === 'mm'")
    assert len(page.scene()["shapes"]) > 0
    assert page.evaluate("studio.editor.tool") == "base"


def test_a_broken_map_is_said_and_the_drawing_stays(studio, tmp_path):
    page = studio()
    before = page.scene()
    (tmp_path / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n and nothing more")
    page.open_files(tmp_path / "broken.png")
    page.wait("!document.getElementById('map-problem').hidden")
    assert page.text("#map-problem").startswith("Expected")
    page.click_on("#map-cancel")
    assert page.scene() == before


def test_runs_are_exported(studio, tmp_path):
    page = studio()
    page.watch()
    for name, ending, begin in (("csv", ".csv", b"time_s"), ("html", ".html", b"<!DOCTYPE html>")):
        page.click_on("#export")
        page.fill("#export-format", name)
        path = page.download(lambda: page.click_on("#export-go"), tmp_path)
        assert path.suffix == ending and path.read_bytes().startswith(begin)
        page.click_on("#export-cancel")


def test_an_export_that_is_refused_says_why(studio):
    page = studio()
    page.watch()
    page.click_on("#export")
    page.fill("#export-format", "ros2-yaml")
    page.click_on("#export-go")  # pixels have no length in metres
    page.wait("!document.getElementById('export-problem').hidden")
    assert "metres" in page.text("#export-problem")
    page.click_on("#export-cancel")


def test_a_closed_tab_loses_nothing(studio):
    page = studio()
    page.evaluate("studio.store.change({ goal: [240, 640] }), window.old = true")
    page.call("Page.reload")
    page.wait(f"{OPEN} && !window.old")
    assert page.scene()["goal"] == [240, 640]


def test_the_maze_in_the_address_is_opened_once(studio):
    page = studio()
    page.call("Page.navigate", url=page.allowed[0] + "?maze=fig17b")
    page.wait(
        "document.documentElement?.dataset.ready === '1' && window.studio?.store.scene.name === 'fig17b'"
    )
    page.evaluate("studio.store.change({ goal_radius: 7 })")
    page.call("Page.reload")
    page.wait(
        "document.documentElement?.dataset.ready === '1' && window.studio?.store.scene.goal_radius === 7"
    )


# How it looks


@pytest.mark.parametrize(
    ("width", "height", "dark"), [(1280, 800, False), (768, 1024, True), (360, 740, False)]
)
def test_nothing_is_clipped_at_any_width(studio, width, height, dark):
    page = studio(width=width, height=height, dark=dark, mobile=width < 500)
    page.fill("#second", "sweep")
    for view in ("draw", "open", "export", "help", "watch"):
        if view == "watch":
            page.click_on("#plan")
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


def test_what_a_finger_is_to_hit_is_large_enough(studio):
    page = studio(width=360, height=740, mobile=True)
    page.evaluate("studio.editor.setTool('corridor')")
    for view in ("draw", "open", "export", "watch"):
        if view == "watch":
            page.watch()
        elif view != "draw":
            page.evaluate(f"document.getElementById('{view}').click()")
        assert page.evaluate(SMALL) == [], view
        page.evaluate("document.querySelectorAll('dialog[open]').forEach((dialog) => dialog.close())")


SMALL = """
Array.from(document.querySelectorAll('button, select, input:not([type=checkbox])')).filter((part) => {
  const box = part.getBoundingClientRect();
  return box.width && (box.width < 43.5 || box.height < 43.5);
}).map((part) => part.id || part.className || part.name)
"""


@pytest.mark.parametrize("dark", [False, True])
def test_texts_and_fields_stand_out_from_their_ground(studio, dark):
    page = studio(dark=dark)
    ratios = page.evaluate(CONTRASTS)
    assert {
        name: ratio for name, ratio in ratios.items() if ratio < (3.0 if name.startswith("rim") else 4.5)
    } == {}


CONTRASTS = """
(() => {
  const values = getComputedStyle(document.documentElement);
  const light = (name) => {
    const colour = values.getPropertyValue('--' + name).trim();
    const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255)
      .map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
  };
  const ratio = (a, b) => Math.max(light(a) / light(b), light(b) / light(a));
  const pairs = [['on-accent', 'accent']];
  for (const ground of ['card', 'page'])
    for (const text of ['ink', 'soft', 'accent', 'good', 'bad', 'rim']) pairs.push([text, ground]);
  return Object.fromEntries(pairs.map(([a, b]) => [a + ' on ' + b, ratio(a, b)]));
})()
"""


def test_the_focus_goes_where_the_view_goes(studio):
    page = studio()
    page.evaluate("document.getElementById('plan').focus()")
    page.key("Enter")
    page.wait(SOLVED)
    assert page.evaluate("document.activeElement.id") == "player"
    assert page.evaluate("document.activeElement.getAttribute('aria-label')").startswith("u-turn, 6 links")
    page.key("Escape")
    assert page.evaluate("document.activeElement.id") == "plan"


def test_a_view_that_is_moved_shows_what_is_drawn_there(studio):
    page = studio()
    page.frames()
    page.evaluate("studio.view.panBy(3, -2)")
    page.frames()  # now there is a margin
    page.evaluate("window.drawn = studio.view.drawn")
    for by in (17, 23, -60):
        page.evaluate(f"studio.view.panBy({by}, {-by // 2})")
        page.frames()
    assert page.evaluate("window.drawn === studio.view.drawn")  # nothing was drawn anew
    moved = page.evaluate("studio.editor.canvas.toDataURL()")
    page.evaluate("studio.view.drawn = { key: '' }, studio.view.redraw()")
    page.frames()
    assert page.evaluate("studio.editor.canvas.toDataURL()") == moved
    page.evaluate("studio.view.panBy(5000, 0), studio.view.redraw()")
    page.frames()
    assert page.evaluate("window.drawn !== studio.view.drawn")


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
    page.click_on("#open")
    page.evaluate(
        "Array.from(document.querySelectorAll('#mazes button'))"
        ".find((each) => each.textContent === 'fig17a').click()"
    )
    page.wait("studio.store.scene.name === 'fig17a'")
    assert page.evaluate("document.getElementById('link-length').value") == "245"
    page.click_on("#plan")
    page.wait(SOLVED)
    page.wait("studio.watch.player.frameTimes().draws.length > 60")
    times = page.evaluate("studio.watch.player.frameTimes()")
    assert np.median(times["draws"]) < 16.0
