"""A replay is one file that holds the run as it was; a real browser reads it in the end."""

import base64
import builtins
import dataclasses
import html
import json
import re
import time
import zlib
from importlib.resources import files

import numpy as np
import pytest
from browser import ERRORS, PATIENCE, PHONE, Page

from hrsnake_env.appearance import COLOURS
from hrsnake_env.arm import ArmSpec, configuration_from_joints, joints_from_configuration
from hrsnake_env.contacts import PINCH_TOLERANCE, Contact
from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from hrsnake_env.mazes import fig19
from hrsnake_env.pages import filled
from hrsnake_env.replay import QUANTUM, Trace, replay_html, replay_payload, save_replay, show
from planners import plan
from planners.rollout import simulate_motion

HALF = 0.5 * QUANTUM + 1e-9  # in link lengths: what rounding may move a coordinate by
EVIL = "</script><script>throw 1</script><b>&amp;</b> __PAYLOAD__ __TITLE__ \u2028 'é'"


def contact(pose, link, point, clearance, **settings):
    kind = "collision" if clearance < -0.1 else "pinch"
    fixed = {"substep": 0, "wall": 2, "other": None, "corner": None, "impulse": 0.0}
    where = {"pose": pose, "link": link, "kind": kind, "point": point, "clearance": clearance}
    return Contact(**{**fixed, **where, **settings})


def corridor(name="corridor"):
    return Maze.from_corridors([(1000, 2000), (1000, 3500)], 200.0, name=name)


def waving(n_poses=40, n_links=4, **settings):
    """Return an arm of links of 100 that is fed and waves; its last link pinches, then collides."""
    maze = corridor()
    feed = np.linspace(0.0, n_links * 100.0, n_poses)
    angles = 0.1 * np.sin(np.arange(n_poses)[:, None] / 5.0 + np.arange(n_links))
    joints = joints_from_configuration(feed, angles, 100.0, maze.base_pose)
    contacts = [[] for _ in range(n_poses)]
    contacts[7] = [contact(7, 3, (1100.0, 2300.0), 0.05)]
    contacts[8] = [contact(8, 3, (1100.0, 2303.0), -1.25, corner=(1100.0, 2303.0))]
    contacts[9] = [contact(9, 1, (1000.0, 2100.0), -0.5, wall=None, other=3)]
    clearances = np.tile(np.linspace(100.0, -1.25, n_poses)[:, None], (1, n_links))
    given = {"joints": joints, "contacts": contacts, "clearances": clearances, "summary": ("a line",)}
    return Trace(
        **{"title": "waving", "maze": maze, "link_length": 100.0, "timestep": 0.05, **given, **settings}
    )


@pytest.fixture(scope="module")
def episode():
    """Return what came of the paper's links in the paper's benchmark."""
    return simulate_motion(plan(fig19(), ArmSpec(link_length=430.0)).motion, fig19())


def payload_of(page):
    (text,) = re.findall(r'<script type="application/json" id="payload">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


def unpacked(text, n_rows, n_columns, order):
    """Read a table of whole numbers as the page does."""
    data, at, columns = zlib.decompress(base64.b64decode(text)), 0, []
    for _ in range(n_columns):
        column = []
        for _ in range(n_rows):
            number = shift = 0
            while True:
                number |= (data[at] & 127) << shift
                at, shift = at + 1, shift + 7
                if data[at - 1] < 128:
                    break
            column.append(-(number + 1) // 2 if number % 2 else number // 2)
        for _ in range(order):
            column = np.cumsum(column)
        columns.append(column)
    assert at == len(data)
    return np.array(columns).T.reshape(n_rows, n_columns)


# What is written


def test_places_and_clearances_come_back_within_half_a_quantum(episode):
    trace = episode.trace(fig19())
    packed = payload_of(replay_html([trace]))["traces"][0]
    n, shape = packed["nPoses"], trace.joints.shape
    assert (n, packed["nLinks"] + 1, 2) == shape and packed["quantum"] == QUANTUM * 430.0
    joints = packed["quantum"] * unpacked(packed["joints"], n, 2 * shape[1], 2)
    joints = joints.reshape(shape) + packed["maze"]["base"][:2]
    assert np.abs(joints - trace.joints).max() <= 430.0 * HALF
    clearances = packed["quantum"] * unpacked(packed["clearances"], n, packed["nLinks"], 1)
    assert np.abs(clearances - trace.clearances).max() <= 430.0 * HALF


def test_rounding_is_small_against_the_pinch_tolerance():
    assert 0.5 * QUANTUM <= PINCH_TOLERANCE / 20
    assert payload_of(replay_html([waving()]))["traces"][0]["tolerance"] == PINCH_TOLERANCE * 100.0


def test_contacts_come_back_with_link_place_and_depth():
    trace = waving()
    packed = payload_of(replay_html([trace]))["traces"][0]
    table = unpacked(packed["contacts"], packed["nContacts"], 9, 1)
    rows = {tuple(row[:6]): np.round(row[6:] * packed["quantum"], 4).tolist() for row in table}
    assert rows == {
        (7, 3, -1, 2, 0, 0): [100.0, 295.0, 0.05],  # the base is at (1000, 2005)
        (8, 3, -1, 2, 1, 1): [100.0, 298.0, -1.25],
        (9, 1, 3, -1, 0, 1): [0.0, 95.0, -0.5],
    }


def test_walls_goal_and_base_are_those_of_the_maze():
    maze = fig19()
    packed = payload_of(replay_html([waving(maze=maze)]))["traces"][0]["maze"]
    assert packed["base"] == maze.base_pose.tolist()
    assert [a + b for a, b in zip(packed["goal"], packed["base"], strict=False)] == maze.goal.tolist()
    for flat, ring in zip(packed["rings"], maze.rings, strict=True):
        np.testing.assert_allclose(np.reshape(flat, (-1, 2)) + maze.base_pose[:2], ring, atol=1e-4)


def test_places_far_from_zero_lose_nothing():
    far = Maze.from_corridors([(5e6, 4e6), (5e6, 4e6 + 15)], 2.0, units="m")
    joints = joints_from_configuration(np.linspace(0, 4, 50), np.zeros((50, 4)), 1.0, far.base_pose)
    trace = Trace(title="far", maze=far, joints=joints, link_length=1.0, timestep=0.05)
    packed = payload_of(replay_html([trace]))["traces"][0]
    back = packed["quantum"] * unpacked(packed["joints"], 50, 10, 2).reshape(joints.shape)
    assert np.abs(back + packed["maze"]["base"][:2] - joints).max() <= HALF
    assert packed["clearances"] is None and packed["contacts"] is None


def test_a_thousand_poses_of_twenty_links_take_less_than_400_kb():
    rng = np.random.default_rng(0)  # a learner's first steps: noise, which packs badly
    angles = np.cumsum(rng.uniform(-0.05, 0.05, (1001, 20)), axis=0)
    joints = joints_from_configuration(np.linspace(0, 2000, 1001), angles, 100.0, corridor().base_pose)
    clearances = rng.uniform(-10.0, 100.0, (1001, 20))
    contacts = [
        [contact(k, link, tuple(joints[k, link]), -1.0 - link / 7) for link in range(3)] for k in range(1001)
    ]
    page = replay_html([waving(joints=joints, clearances=clearances, contacts=contacts)])
    assert len(page.encode()) < 400_000


def test_a_real_run_takes_less_than_100_kb(episode):
    assert len(replay_html([episode.trace(fig19())]).encode()) < 100_000


def test_the_file_is_whole_and_refers_to_nothing_outside(tmp_path):
    out = tmp_path / "r.html"
    save_replay([waving(), waving(title="other")], out)
    page = out.read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>") and page.endswith("</html>\n")
    assert not re.findall(r"https?:|//[a-z]|@import|url\(|<link|<img|\bsrc=|\bimport\(|\bfetch\(", page)
    assert "default-src 'none'" in page and "__TITLE__" not in page and "__PAYLOAD__" not in page
    assert list(tmp_path.iterdir()) == [out]


def test_names_cannot_break_the_page():
    trace = waving(title=EVIL, summary=(EVIL,), maze=corridor(EVIL))
    page = replay_html([trace, trace])
    assert page.count("</script>") == replay_html([waving()]).count("</script>")
    assert f"<title>{html.escape(EVIL)} | {html.escape(EVIL)}</title>" in page
    packed = payload_of(page)["traces"][1]
    assert packed["title"] == packed["maze"]["name"] == packed["summary"][0] == EVIL


def test_colours_are_those_of_the_other_pictures():
    assert payload_of(replay_html([waving()]))["colours"] == COLOURS


def test_a_trace_cannot_be_written_to():
    trace = waving()
    with pytest.raises(ValueError, match="read-only"):
        trace.joints[0, 0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        trace.title = "other"


NAN, BAD_POSE = float("nan"), np.array(waving().joints)
BAD_POSE[12, 1, 0] = NAN
BAD_INPUT = [
    ({"joints": np.zeros((0, 5, 2))}, "Expected a run with at least one pose, got an empty one."),
    (
        {"joints": np.zeros((4, 1, 2))},
        "Expected joints with shape (n_poses, n_links + 1, 2), got (4, 1, 2).",
    ),
    ({"joints": BAD_POSE}, "Expected finite joints within 1e+11 maze units, got nan in pose 12."),
    ({"joints": BAD_POSE + np.inf}, "Expected finite joints"),
    ({"joints": np.full((40, 5, 2), 1e200)}, "Expected finite joints within 1e+11 maze units"),
    ({"clearances": np.zeros((40, 5))}, "Expected clearances with shape (40, 4), got (40, 5)."),
    ({"clearances": np.full((40, 4), np.inf)}, "Expected finite clearances within"),
    ({"contacts": []}, "Expected contacts for each of 40 poses, got 0."),
    (
        {"contacts": [[]] * 39 + [[contact(39, 4, (0.0, 0.0), 0.0)]]},
        "Expected contacts of links 0 to 3, got link 4 in pose 39.",
    ),
    (
        {"contacts": [[]] * 39 + [[contact(39, 0, (0.0, 0.0), NAN)]]},
        "Expected finite contacts within 1e+11 maze units, got nan in pose 39.",
    ),
    ({"link_length": 0.0}, "Expected a positive, finite link_length, got 0.0."),
    ({"timestep": NAN}, "Expected a positive, finite timestep, got nan."),
    ({"link_radius": -1.0}, "Expected a finite link_radius of at least 0, got -1.0."),
]


@pytest.mark.parametrize(("settings", "sentence"), BAD_INPUT)
def test_bad_input_gets_one_sentence(settings, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        waving(**settings)


@pytest.mark.parametrize("number", [0, 3])
def test_one_or_two_runs_are_shown(number, tmp_path):
    with pytest.raises(InputError, match=f"Expected one or two runs to replay, got {number}."):
        save_replay([waving()] * number, tmp_path / "r.html")
    assert list(tmp_path.iterdir()) == []


def test_runs_with_different_timesteps_are_refused():
    with pytest.raises(InputError, match="Expected runs with one timestep"):
        replay_html([waving(), waving(timestep=0.1)])


def test_a_notebook_shows_the_page_in_a_frame_of_its_own():
    pytest.importorskip("IPython")
    frame = show([waving(title=EVIL)], height=500)._repr_html_()
    assert 'sandbox="allow-scripts"' in frame and 'height="500"' in frame
    (page,) = re.findall(r'srcdoc="([^"]*)"', frame)
    assert html.unescape(page) == replay_html([waving(title=EVIL)])


def test_without_ipython_one_sentence_says_what_to_install(monkeypatch):
    real = builtins.__import__

    def without(name, *arguments, **settings):
        if name.startswith("IPython"):
            raise ImportError(name)
        return real(name, *arguments, **settings)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match="pip install"):
        show([waving()])


# What a browser makes of it


@pytest.fixture
def opened(browser, tmp_path):
    """Return a function that opens a replay, and closes it in the end."""
    pages = []

    def open_page(*traces, fragment="play=0", width=1280, height=800, **settings):
        out = tmp_path / f"r{len(pages)}.html"
        save_replay(traces, out)
        pages.append(Page(browser, f"{out.as_uri()}#{fragment}", width, height, **settings))
        return pages[-1]

    yield open_page
    for page in pages:
        page.close()


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_the_browser_shows_the_joints_of_the_episode(opened, episode, share):
    pose, maze = round(share * episode.n_steps), fig19()
    page = opened(episode.trace(maze), fragment=f"pose={pose}&play=0&probe")
    (shown,) = json.loads(page.evaluate("document.documentElement.dataset.joints"))
    joints = np.reshape(shown["joints"], (-1, 2)) + maze.base_pose[:2]
    assert shown["pose"] == page.pose() == pose
    assert np.abs(joints - episode.joints[pose]).max() <= 430.0 * HALF
    assert np.abs(shown["clearances"] - episode.clearances[pose]).max() <= 430.0 * HALF
    feed, angles = configuration_from_joints(episode.joints[pose], 430.0, maze.base_pose)
    assert shown["feed"] == pytest.approx(feed, abs=430.0 * HALF)
    np.testing.assert_allclose(np.radians(shown["angles"]), angles, atol=4 * QUANTUM)
    assert {k for k, kind in enumerate(shown["touching"]) if kind == 1} == episode.pinched(pose)
    assert len(shown["contacts"]) == len(episode.contacts[pose])
    tip = page.evaluate("document.querySelector('.hp-tip-place').textContent").replace("\u2212", "-")
    assert re.findall(r"-?\d+", tip) == [f"{value:.0f}" for value in episode.joints[pose, -1]]


def test_play_advances_and_stops_at_the_end(opened):
    page = opened(waving(), fragment="play=1&speed=8&loop=0")
    page.wait("Number(document.documentElement.dataset.pose) > 3")
    page.wait("document.documentElement.dataset.pose === '39'")
    page.wait("document.documentElement.dataset.playing === '0'")


def test_the_clock_keeps_to_the_speed(opened):
    page = opened(waving(), fragment="pose=0&play=0&speed=2")
    clock = page.evaluate("(player.advance(5000), player.advance(5100), player.clock)")  # at these ms
    assert clock == pytest.approx(2 * 0.1 / 0.05)


def test_a_loop_begins_again(opened):
    page = opened(waving(), fragment="play=1&speed=8&pose=38")
    page.wait("document.documentElement.dataset.pose === '39'")
    page.wait("Number(document.documentElement.dataset.pose) < 30")
    assert page.evaluate("document.documentElement.dataset.playing") == "1"


def test_of_two_runs_the_shorter_one_waits_at_its_end(opened):
    page = opened(waving(), waving(n_poses=25, title="short"), fragment="pose=30&play=0&probe")
    shown = json.loads(page.evaluate("document.documentElement.dataset.joints"))
    assert [trace["pose"] for trace in shown] == [30, 24]
    assert page.evaluate("Array.from(document.querySelectorAll('.hp-head h2'), (h) => h.textContent)") == [
        "waving",
        "short",
    ]
    left, right = page.evaluate(
        "Array.from(document.querySelectorAll('.hp-stage'), (s) => s.getBoundingClientRect().left)"
    )
    assert right > left + 400


def test_keys_step_play_and_go_to_the_ends(opened):
    page = opened(waving(), fragment="pose=10&play=0")
    poses = []
    for key, modifiers in (
        ("ArrowRight", 0),
        ("ArrowRight", 8),
        ("ArrowLeft", 0),
        ("Home", 0),
        ("End", 0),
    ):
        page.key(key, modifiers=modifiers)  # 8 is shift
        poses.append(page.pose())
    assert poses == [11, 21, 20, 0, 39]
    page.key(" ", text=" ")
    assert page.evaluate("document.documentElement.dataset.playing") == "1"
    assert page.evaluate("document.querySelector('.hp-play').ariaLabel") == "Pause"
    page.key(" ", text=" ")
    assert page.evaluate("document.documentElement.dataset.playing") == "0"


def test_the_slider_scrubs_and_says_where_it_is(opened):
    page = opened(waving())
    page.evaluate(
        "const s = document.querySelector('.hp-slider'); s.value = 33; s.dispatchEvent(new Event('input'))"
    )
    assert page.pose() == 33
    assert (
        page.evaluate("document.querySelector('.hp-slider').getAttribute('aria-valuetext')")
        == "pose 33 of 39"
    )


def test_every_control_has_a_name(opened):
    page = opened(waving())
    assert (
        page.evaluate(
            "Array.from(document.querySelectorAll('button, input, select, canvas[role=img]'))"
            ".filter((part) => !part.getAttribute('aria-label')).length"
        )
        == 0
    )


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (7, ["Pinch: link 3, wall 2", "0.05 px from it", "(1100, 2300)"]),
        (8, ["Collision: link 3, a corner", "1.25 px deep", "(1100, 2303)"]),
        (9, ["Collision: link 1, link 3", "0.50 px deep"]),
    ],
)
def test_a_contact_that_is_pointed_at_says_how_deep(opened, pose, words):
    page = opened(waving(), fragment=f"pose={pose}&play=0")
    place = page.evaluate(
        "(() => { const v = player.views[0], c = v.trace.contactsOf[v.pose][0];"
        " const b = v.canvas.getBoundingClientRect();"
        " const [x, y] = v.screen(c.x, c.y); return [b.left + x, b.top + y]; })()"
    )
    page.mouse("mouseMoved", *place)
    page.frames()
    tip = page.evaluate("document.querySelector('.hp-tip:not([hidden])').textContent")
    assert all(word in tip for word in words)


def test_links_are_coloured_by_what_they_touch(opened):
    page = opened(waving(), fragment="pose=8&play=0")
    colours = page.evaluate("[0, 3].map((link) => player.views[0].linkColour(8, link))")
    assert colours == ["rgb(31,95,174)", COLOURS["collision"]]  # 80 px from the walls, and in one
    assert page.evaluate("player.views[0].linkColour(7, 3)") == COLOURS["pinch"]


def test_a_click_on_a_plot_goes_to_that_pose(opened):
    page = opened(waving())
    x, y, width, height = page.evaluate(
        "(() => { const b = document.querySelector('canvas.hp-angles').getBoundingClientRect();"
        " return [b.left, b.top, b.width, b.height]; })()"
    )
    page.click(x + 40 + (width - 46) / 2, y + height / 2)
    assert page.pose() in (19, 20)
    page.mouse("mouseMoved", x + 40 + (width - 46) / 2, y + height / 2)
    page.frames()
    assert page.evaluate("document.querySelector('.hp-angle-note').textContent").startswith("link ")


def test_wheel_and_drag_look_closer_and_a_double_click_fits(opened):
    page = opened(waving(), waving(title="same maze"))
    x, y = page.evaluate(
        "(() => { const b = player.views[0].canvas.getBoundingClientRect();"
        " return [b.left + b.width / 2 + 9, b.top + b.height / 2]; })()"
    )
    page.mouse("mouseWheel", x, y, deltaX=0, deltaY=-400)
    page.wait("player.views[0].view.zoom > 1.5")
    assert page.evaluate("player.views[0].view === player.views[1].view")  # one maze, one view
    before = page.evaluate("player.views[0].view.x")
    page.mouse("mousePressed", x, y, button="left", clickCount=1)
    page.mouse("mouseMoved", x - 30, y, button="left")
    page.mouse("mouseReleased", x - 30, y, button="left", clickCount=1)
    page.frames()
    assert page.evaluate("player.views[0].view.x") > before
    page.click(x, y, count=2)
    page.frames()
    assert page.evaluate("player.views[0].view.zoom") == 1


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("number", [1, 2])
def test_a_phone_shows_all_without_scrolling_sideways(opened, number, dark):
    traces = [waving(title="a title that is so long that it takes several lines, " + "x" * 60)] * number
    page = opened(*traces, dark=dark, **PHONE)
    page.frames()
    assert page.evaluate("[document.documentElement.scrollWidth, innerWidth]") == [360, 360]
    bottom = page.evaluate("document.querySelector('.hp-controls').getBoundingClientRect().bottom")
    assert bottom == pytest.approx(740, abs=1)
    assert page.evaluate(
        "Array.from(document.querySelectorAll('.hp-controls :is(button, select, input)'))"
        ".every((b) => b.getBoundingClientRect().right <= 360)"
    )
    assert page.evaluate("player.style.free") == ("#12161b" if dark else COLOURS["free"])


def test_two_fingers_zoom(opened):
    page = opened(waving(), **PHONE)
    x, y = page.evaluate(
        "(() => { const b = player.views[0].canvas.getBoundingClientRect();"
        " return [b.left + b.width / 2, b.top + b.height / 2]; })()"
    )
    for kind, apart in (("touchStart", 20), ("touchMove", 30), ("touchMove", 60)):
        points = [{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}]
        page.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    page.frames()
    assert page.evaluate("player.views[0].view.zoom") > 2


def test_a_run_without_clearances_and_contacts_is_shown_too(opened):
    page = opened(waving(clearances=None, contacts=None, summary=()), fragment="pose=5&play=0")
    assert page.evaluate("document.querySelector('canvas.hp-clearances').getBoundingClientRect().height") == 0


def test_a_run_of_one_pose_of_one_link_is_shown_too(opened):
    joints = joints_from_configuration(50.0, [0.0], 100.0, corridor().base_pose)[None]
    page = opened(waving(joints=joints, clearances=[[3.0]], contacts=[[]]), fragment="play=1")
    assert page.pose() == 0


def test_in_the_browser_too_names_are_only_text(opened):
    page = opened(waving(title=EVIL, maze=corridor(EVIL)))
    assert page.evaluate("document.querySelector('.hp-title').textContent") == EVIL
    assert page.evaluate("document.querySelectorAll(':is(h1, h2.hp-title) *').length") == 0


def test_the_frame_of_a_notebook_runs_it(browser, tmp_path):
    pytest.importorskip("IPython")
    notebook = tmp_path / "notebook.html"
    notebook.write_text(show([waving()])._repr_html_(), encoding="utf-8")
    target = browser.call("Target.createTarget", url="about:blank")["targetId"]
    session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    settings = {"autoAttach": True, "waitForDebuggerOnStart": False, "flatten": True}
    browser.call("Target.setAutoAttach", session, **settings)  # the frame has a process of its own
    browser.call("Page.navigate", session, url=notebook.as_uri())
    end = time.monotonic() + PATIENCE
    while True:
        browser.call("Runtime.evaluate", session, expression="1")
        attached = [
            event["params"] for event in browser.events if event["method"] == "Target.attachedToTarget"
        ]
        frames = [event["sessionId"] for event in attached if event["targetInfo"]["type"] == "iframe"]
        code = "JSON.stringify(document.documentElement?.dataset)"
        said = [browser.call("Runtime.evaluate", frame, expression=code)["result"] for frame in frames]
        if any('"ready":"1"' in data.get("value", "") for data in said):
            break
        assert time.monotonic() < end, said
        time.sleep(0.05)
    assert json.loads(said[-1]["value"])["errors"] == ""
    browser.call("Target.closeTarget", targetId=target)


def test_a_page_that_fails_says_so(browser, tmp_path):
    out = tmp_path / "broken.html"
    save_replay([waving()], out)
    out.write_text(out.read_text(encoding="utf-8").replace('"joints":"', '"joints":"AAAA'), encoding="utf-8")
    attached = browser.call("Target.createTarget", url=out.as_uri())["targetId"]
    session = browser.call("Target.attachToTarget", targetId=attached, flatten=True)["sessionId"]
    code = f"{ERRORS} !== undefined && {ERRORS} !== '' && !document.getElementById('failure').hidden"
    end = time.monotonic() + PATIENCE
    while not browser.call("Runtime.evaluate", session, expression=code)["result"].get("value"):
        assert time.monotonic() < end
        time.sleep(0.05)
    browser.call("Target.closeTarget", targetId=attached)


# Players on a page of someone else's

EMBEDDING = """<!DOCTYPE html><html><head><title>__TITLE__</title><style>__STYLE__
  html { --card: rgb(1, 2, 3); } button { width: 500px; } .host { height: 300px; overflow: auto; }
</style><script>__SCRIPT__</script></head>
<body><input id="name"><div class="host"></div><div class="host"></div>
<script type="application/json" id="payload">__PAYLOAD__</script><script>
const root = document.documentElement, hosts = document.querySelectorAll(".host");
root.dataset.errors = "";
for (const type of ["error", "unhandledrejection"])
  window.addEventListener(type, (event) => { root.dataset.errors += event.message || event.reason; });
const payload = JSON.parse(document.getElementById("payload").textContent);
const players = [];
const mounted = (host, settings) =>
  HrsnakePlayer.mount(hosts[host], payload, { autoplay: false, ...settings });
Promise.all([mounted(0), mounted(1)]).then((both) => { players.push(...both); root.dataset.ready = "1"; });
</script></body></html>"""


@pytest.fixture
def embedding(browser, tmp_path):
    """Return a page that holds two players, in `hosts`, which `players` lists."""
    parts = [
        files("hrsnake_env").joinpath(name).read_text(encoding="utf-8")
        for name in ("player.css", "player.js")
    ]
    out = tmp_path / "embedding.html"
    page = filled(EMBEDDING, "two", replay_payload([waving()]), style=parts[0], script=parts[1])
    out.write_text(page, encoding="utf-8")
    page = Page(browser, out.as_uri(), 1000, 700)
    yield page
    page.close()


def test_players_on_one_page_do_not_disturb_each_other(embedding):
    embedding.evaluate("(players[0].goTo(5), players[1].goTo(9), players[1].zoomBy(3), players[1].play(), 0)")
    embedding.wait("players[1].pose > 12")
    assert embedding.evaluate("[players[0].pose, players[0].playing, hosts[0].dataset.pose]") == [
        5,
        False,
        "5",
    ]
    assert embedding.evaluate("players.map((player) => player.views[0].view.zoom)") == [1, 3]
    embedding.evaluate("(players[1].pause(), players[1].goTo(9), 0)")
    embedding.click_on(".host:nth-of-type(1) .hp-forward")
    embedding.key("ArrowRight")  # goes to the one that has the focus
    embedding.click_on("#name")
    embedding.key("ArrowRight")  # goes to none
    assert embedding.evaluate("players.map((player) => player.pose)") == [7, 9]


def test_a_player_takes_the_colours_of_its_page_and_keeps_its_own_shape(embedding):
    assert embedding.evaluate("players[0].style.card") == "#010203"
    assert embedding.evaluate("document.querySelector('.hp-back').getBoundingClientRect().width") == 36
    assert embedding.evaluate("hosts[0].scrollWidth <= hosts[0].clientWidth")


def test_a_player_tells_of_its_poses_until_it_is_no_longer_asked(embedding):
    embedding.evaluate("(window.told = [], window.end = players[0].on('pose', (pose) => told.push(pose)), 0)")
    for pose in (3, 3, 20):
        embedding.evaluate(f"(players[0].goTo({pose}), 0)")
        embedding.frames()
    embedding.evaluate("(end(), players[0].goTo(30), 0)")
    embedding.frames()
    assert embedding.evaluate("told") == [3, 20]


def test_a_destroyed_player_leaves_nothing_running(embedding):
    embedding.evaluate(
        "(players[0].setSpeed(8), players[0].play(), players[0].goTo(2), players[0].destroy(), 0)"
    )
    pose = embedding.evaluate("players[0].pose")
    assert embedding.evaluate("[hosts[0].outerHTML, hosts[0].children.length]") == [
        '<div class="host" style=""></div>',
        0,
    ]
    embedding.evaluate(
        "(window.drawn = 0, players[0].on('draw', () => drawn++), players[0].redraw(), players[0].play(), 0)"
    )
    embedding.evaluate("(hosts[0].dispatchEvent(new KeyboardEvent('keydown', { key: 'End' })), 0)")
    embedding.resize(600, 700)
    embedding.set_scheme(dark=True)
    embedding.frames(5)
    assert embedding.evaluate("[players[0].pose, players[0].playing, drawn]") == [pose, False, 0]
    assert embedding.evaluate("hosts[0].outerHTML") == '<div class="host" style=""></div>'
    assert embedding.evaluate("players[1].style.free") == "#12161b"  # the other one still listens


def test_a_later_player_takes_the_place_of_the_one_before(embedding):
    embedding.evaluate(
        "(async () => { const first = mounted(0).catch((error) => error.name);"
        " const second = mounted(0); players.push(await first, await second); })()"
    )
    assert embedding.evaluate("players[2]") == "AbortError"
    embedding.evaluate("(players[0].goTo(30), players[3].goTo(4), 0)")
    embedding.frames()
    assert embedding.evaluate("[hosts[0].children.length, hosts[0].dataset.pose]") == [1, "4"]


def test_frame_times_are_kept_of_playing_alone(embedding):
    embedding.evaluate("mounted(0, { timing: true }).then((player) => players.push(player))")
    embedding.evaluate("(players[2].goTo(3), 0)")
    embedding.frames(3)
    assert embedding.evaluate("players[2].frameTimes()") == {"intervals": [], "draws": []}
    embedding.evaluate("(players[2].play(), 0)")
    embedding.wait("players[2].frameTimes().draws.length > 3")
    times = embedding.evaluate("players[2].frameTimes()")
    assert len(times["intervals"]) >= 4 and all(value >= 0 for part in times.values() for value in part)


def test_what_a_page_fetches_is_what_a_replay_holds():
    traces = [waving(), waving(title=EVIL)]
    assert payload_of(replay_html(traces)) == json.loads(json.dumps(replay_payload(traces)))


@pytest.mark.image
@pytest.mark.parametrize("settings", [{}, {"dark": True}, PHONE], ids=["desktop", "dark", "phone"])
def test_something_is_drawn(opened, episode, settings, tmp_path):
    page = opened(episode.trace(fig19()), fragment="pose=300&play=0", **settings)
    shown = page.evaluate(
        "(() => { const c = player.views[0].canvas, seen = new Set();"
        " const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        " for (let k = 0; k < d.length; k += 4) seen.add((d[k] << 16) | (d[k + 1] << 8) | d[k + 2]);"
        " const number = (name) => parseInt(player.style[name].slice(1), 16);"
        " return ['wall', 'free', 'joint', 'card'].map((name) => seen.has(number(name))); })()"
    )
    assert all(shown)
    page.save_picture(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 10_000
