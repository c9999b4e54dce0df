"""Pictures of an arm in space show the walls, the arm and the path that they were given."""

import base64
import html
import itertools
import json
import re
import time
import zlib

import numpy as np
import pytest
import shapely
from browser import ERRORS, PATIENCE, PHONE, Page
from matplotlib.image import imread
from test_replay import EVIL

from hrsnake_env.appearance import COLOURS
from hrsnake_env.errors import InputError
from planners.spatial import viewer
from planners.spatial.drawing import draw_motion
from planners.spatial.panel import Panel
from planners.spatial.problem import SpatialMotion
from planners.spatial.rooms import paired_panels, random_room
from planners.spatial.solids import Stroke, from_behind, rectangles, solids
from planners.spatial.viewer import MOST_POSES, QUANTUM, Scene, page_html, save_page, show
from planners.spatial.workspace import Workspace

WORST = 33


def bending(n_poses=60, n_links=5, link_length=60.0, workspace=None):
    """Return an arm that is fed, and bends up and to its left as it goes."""
    room = paired_panels() if workspace is None else workspace
    share = np.linspace(0.0, 1.0, n_poses)
    angles = np.zeros((n_poses, n_links, 2))
    angles[:, 2:] = share[:, None, None] * [0.3, 0.25]
    base = room.base_pose_for(link_length)
    return SpatialMotion.from_configurations(260.0 * share, angles, link_length, base)


def measured(motion):
    """Return made-up distances: links in the feeder have none, and one link is in a wall for a while."""
    distances = np.tile(np.linspace(40.0, 0.5, motion.n_poses)[:, None], (1, motion.n_links))
    distances[:, 0] = np.inf
    distances[WORST - 3 : WORST + 4, 3] = -2.0
    distances[WORST, 3] = -7.25
    return distances


def straight_path(workspace):
    return np.linspace(workspace.base, workspace.goal, 50)


def scene(name="bending", **settings):
    room = settings.pop("workspace", paired_panels())
    motion = settings.pop("motion", None) or bending(workspace=room)
    given = {"path": straight_path(room)}
    if "distances" not in settings:
        given["distances"] = measured(motion)
    return Scene(name=name, workspace=room, motion=motion, **{**given, **settings})


def box_room(boxes=(), panels=()):
    """Return an empty room of 100 x 80 x 60 with the base at its low x."""
    return Workspace(
        name="box-room",
        room_low=np.zeros(3),
        room_high=np.array([100.0, 80.0, 60.0]),
        open_sides=("x-",),
        boxes=np.array(boxes).reshape(-1, 2, 3),
        panels=tuple(panels),
        base=np.array([0.0, 10.0, 10.0]),
        heading=np.array([1.0, 0.0, 0.0]),
        straight=10.0,
        goal=np.array([90.0, 70.0, 50.0]),
        goal_radius=2.0,
    )


def panel(window_low, window_high, normal="y"):
    low, high = np.array([20.0, 30.0, 0.0]), np.array([80.0, 40.0, 60.0])
    return Panel(
        normal=normal,
        low=low,
        high=high,
        window_low=np.array(window_low, dtype=float),
        window_high=np.array(window_high, dtype=float),
    )


# What walls consist of

OPENINGS = [
    pytest.param(((30, 30, 20), (50, 40, 40)), 8, id="in the middle"),
    pytest.param(((30, 30, 20), (50, 40, 60)), 8, id="at the ceiling"),
    pytest.param(((20, 30, 0), (50, 40, 40)), 6, id="in a corner"),
    pytest.param(((30, 30, 0), (50, 40, 60)), 8, id="from floor to ceiling"),
]


def area_of(rectangle):
    sides = np.sort(rectangle[1] - rectangle[0])
    assert sides[0] == 0.0
    return sides[1] * sides[2]


@pytest.mark.parametrize(("window", "n_corners"), OPENINGS)
def test_a_panel_has_its_window_open_and_no_face_twice(window, n_corners):
    room = box_room(panels=[panel(*window)])
    (wall,) = solids(room)
    front = [face for face in wall.faces if face.axis == 1 and face.sign == -1 and face.at == 30.0]
    low, high = np.array(window, dtype=float)
    opening = (high[0] - low[0]) * (high[2] - low[2])
    assert sum(area_of(one) for face in front for one in rectangles(face)) == 60.0 * 60.0 - opening
    # The divergence theorem: a surface that is closed, turned outwards everywhere and covered once has the
    # volume of its solid along each axis.
    for axis in range(3):
        flux = sum(
            face.sign * face.at * area_of(one)
            for face in wall.faces
            if face.axis == axis
            for one in rectangles(face)
        )
        assert flux == pytest.approx(10.0 * (60.0 * 60.0 - opening))
    assert len({tuple(map(tuple, np.sort(edge, axis=0))) for edge in wall.edges}) == len(wall.edges)
    assert len(wall.edges) == 3 * n_corners


def test_edges_of_a_window_are_told_from_those_of_the_panel():
    (wall,) = solids(box_room(panels=[panel((30, 30, 20), (50, 40, 40))]))
    inside = ((wall.edges >= (30, 30, 20)) & (wall.edges <= (50, 40, 40))).all(axis=(1, 2))
    np.testing.assert_array_equal(wall.of_window, inside)
    assert inside.sum() == 12 and len(inside) == 24


def test_rectangles_of_a_face_cover_it_without_overlap():
    (wall,) = solids(box_room(panels=[panel((30, 30, 20), (50, 40, 40))]))
    for face in wall.faces:
        flat = [shapely.box(*np.delete(one, face.axis, axis=1).ravel()) for one in rectangles(face)]
        assert sum(one.area for one in flat) == pytest.approx(face.polygon.area)
        assert all(a.intersection(b).area == 0.0 for a, b in itertools.combinations(flat, 2))


def test_what_is_nearer_to_the_eye_comes_later():
    room, out = random_room(2, n_boxes=15), np.array([0.5, -0.7, 0.4])
    faces = [f for wall in solids(room) for f in wall.faces if f.sign * out[f.axis] > 0.0]
    rng, dots = np.random.default_rng(0), []
    for place in rng.uniform(room.room_low, room.room_high, (200, 3)):
        dots.append(Stroke(start=place, end=place, colour="black", width=1.0))
    order = list(from_behind(faces, dots, out))
    assert sum(isinstance(item, Stroke) for item in order) == len(dots)  # a dot cannot be cut
    compared = 0
    for number, item in enumerate(order):
        if isinstance(item, Stroke):
            continue
        for other, dot in enumerate(order):
            if not isinstance(dot, Stroke):
                continue
            far = (dot.start[item.axis] - item.at) / out[item.axis]
            flat = np.roll(dot.start - far * out, -item.axis - 1)[:2]
            if item.polygon.contains(shapely.Point(*flat)):
                compared += 1
                assert (other > number) == (far > 0.0)
    assert compared > 100


# Figures for paper


@pytest.fixture
def drawn(tmp_path):
    """Return a function that draws and returns the picture, shape (height, width, 3), in 0 to 255."""

    def draw(room, motion, path=None, **settings):
        draw_motion(room, motion, path, tmp_path / "picture.png", **settings)
        return np.round(255.0 * imread(tmp_path / "picture.png")[:, :, :3]).astype(int)

    return draw


def pixels_of(picture, colour, within=2):
    wanted = np.array(list(bytes.fromhex(COLOURS[colour][1:])))
    return int((np.abs(picture - wanted).max(axis=2) <= within).sum())


@pytest.mark.image
def test_a_link_in_a_wall_is_drawn_in_red_and_only_in_that_pose(drawn):
    motion = bending(workspace=box_room(), n_links=4, link_length=10.0)
    distances = np.full((60, 4), 20.0)
    distances[WORST, 3] = -1.0
    room = box_room()
    plain = {"title": "", "distances": distances}
    assert pixels_of(drawn(room, motion, **plain), "collision") > 50  # the worst pose is the one shown
    assert pixels_of(drawn(room, motion, poses=[0], **plain), "collision") == 0


@pytest.mark.image
def test_a_box_before_the_arm_veils_it_and_one_behind_it_does_not(drawn):
    base = {"n_links": 4, "link_length": 10.0, "n_poses": 2}
    seen = {}
    for name, place in {"nothing": None, "before": (1.0, 0.0, 0.0), "behind": (1.0, 60.0, 0.0)}.items():
        boxes = [] if place is None else [[place, np.add(place, (60.0, 8.0, 55.0))]]
        room = box_room(boxes)
        motion = SpatialMotion.from_configurations(
            [0.0, 40.0], np.zeros((2, 4, 2)), base["link_length"], room.base_pose_for(10.0)
        )
        # From the front: y goes away from the reader.
        seen[name] = pixels_of(drawn(room, motion, title="", views=[(-90.0, 10.0)]), "arm")
    assert seen["behind"] == seen["nothing"] > 3 * seen["before"]


@pytest.mark.image
def test_faint_poses_are_added_to_the_last_one(drawn):
    room, motion = paired_panels(), bending()
    one = drawn(room, motion, poses=[-1], title="")
    three = drawn(room, motion, poses=[10, 30, -1], title="")
    assert one.shape == three.shape and (one != three).any(axis=2).sum() > 300


@pytest.mark.image
@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_every_format_is_written_and_nothing_beside_it(ending, tmp_path):
    room = box_room([[(50, 20, 0), (60, 30, 60)]])
    motion = bending(workspace=room, n_poses=4, link_length=10.0)
    draw_motion(room, motion, straight_path(room), tmp_path / f"p.{ending}", distances=None)
    assert [file.name for file in tmp_path.iterdir()] == [f"p.{ending}"]
    assert (tmp_path / f"p.{ending}").stat().st_size > 5_000


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"poses": [60]}, "Expected poses from 0 to 59, got 60."),
        ({"poses": []}, "Expected at least one pose to draw, got none."),
        ({"distances": np.zeros((60, 4))}, "Expected distances with shape (60, 5), got (60, 4)."),
    ],
)
def test_a_figure_of_what_is_not_there_is_refused(settings, sentence, tmp_path):
    with pytest.raises(InputError, match=re.escape(sentence)):
        draw_motion(paired_panels(), bending(), None, tmp_path / "p.png", **settings)
    assert list(tmp_path.iterdir()) == []


# What a page holds


def payload_of(page):
    (text,) = re.findall(r'<script type="application/json" id="payload">(.*?)</script>', page, re.DOTALL)
    return json.loads(text)


def unpacked(text, n_rows):
    """Read numbers as the page does."""
    differences = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").reshape(-1, n_rows)
    return np.cumsum(differences, axis=1, dtype=np.int32).T


def test_places_and_distances_come_back_within_half_a_quantum():
    given = scene()
    packed = payload_of(page_html([given]))["scenes"][0]
    quantum, n = packed["quantum"], given.motion.n_poses
    assert quantum == QUANTUM * given.workspace.size
    joints = quantum * unpacked(packed["joints"], n).reshape(given.motion.joints.shape)
    assert np.abs(joints + packed["basePose"][:3] - given.motion.joints).max() <= 0.51 * quantum
    distances = quantum * unpacked(packed["distances"], n)
    assert np.abs(distances - given.distances).max() <= quantum
    path = quantum * unpacked(packed["path"], packed["nPath"])
    assert np.abs(path + packed["basePose"][:3] - given.path).max() <= 0.51 * quantum
    assert packed["nBad"] == 7


def test_a_link_that_is_in_a_wall_by_a_hair_still_is():
    distances = np.full((60, 5), 1.0)
    distances[7, 2] = -1e-12
    packed = payload_of(page_html([scene(distances=distances)]))["scenes"][0]
    assert np.argwhere(unpacked(packed["distances"], 60) < 0).tolist() == [[7, 2]]


def test_of_many_poses_the_first_the_last_and_the_worst_stay():
    motion = bending(n_poses=5003)
    distances = np.ones((5003, 5))
    distances[1237, 3] = -0.5
    packed = payload_of(page_html([scene(motion=motion, distances=distances)]))["scenes"][0]
    poses = packed["poses"]
    assert len(poses) <= MOST_POSES and {0, 1237, 5002} <= set(poses) and packed["nPoses"] == 5003
    assert np.diff(poses).min() > 0 and np.diff(poses).max() <= 2 * 5003 / MOST_POSES
    assert payload_of(page_html([scene()], most_poses=10))["scenes"][0]["poses"].count(WORST) == 1


def test_four_scenes_take_less_than_two_megabytes():
    rng = np.random.default_rng(0)
    scenes = []
    for n_links in (182, 49, 15, 15):
        angles = rng.uniform(-0.2, 0.2, (1454, n_links, 2))  # noise, which packs badly
        room = paired_panels()
        motion = SpatialMotion.from_configurations(
            np.linspace(0, 1454, 1454), angles, 1456 / n_links, room.base_pose_for(1456 / n_links)
        )
        distances = rng.uniform(0.0, 50.0, (1454, n_links))
        scenes.append(scene(motion=motion, distances=distances))
    assert len(page_html(scenes).encode()) < 2_000_000


def test_the_file_is_whole_and_refers_to_nothing_outside(tmp_path):
    out = tmp_path / "p.html"
    save_page([scene(), scene(name="other", path=None, distances=None)], out, title="two")
    page = out.read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>") and page.endswith("</html>\n")
    frame = re.sub(r'(?<=id="payload">).*', "", page)  # numbers in base64 may spell anything
    assert not re.findall(r"https?:|//[a-z]|@import|url\(|<link|<img|\bsrc=|\bimport\(|\bfetch\(", frame)
    assert "default-src 'none'" in page and "__TITLE__" not in page and "__PAYLOAD__" not in page
    assert payload_of(page)["colours"] == COLOURS
    assert list(tmp_path.iterdir()) == [out]


def test_names_cannot_break_the_page():
    page = page_html([scene(name=EVIL)], title=EVIL)
    assert page.count("</script>") == page_html([scene()]).count("</script>")
    assert f"<title>{html.escape(EVIL)}</title>" in page
    assert payload_of(page)["title"] == payload_of(page)["scenes"][0]["name"] == EVIL


NAN = float("nan")


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"path": np.zeros((4, 2))}, "Expected a path with shape (n, 3), got (4, 2)."),
        ({"path": np.full((4, 3), NAN)}, "Expected finite path within"),
        ({"distances": np.zeros((60, 4))}, "Expected distances with shape (60, 5), got (60, 4)."),
        ({"distances": np.full((60, 5), NAN)}, "Expected finite distances within"),
        ({"link_radius": -1.0}, "Expected a finite link_radius of at least 0, got -1.0."),
    ],
)
def test_a_scene_of_wrong_shape_or_numbers_gets_one_sentence(settings, sentence):
    with pytest.raises(InputError, match=re.escape(sentence)):
        scene(**settings)


def test_a_page_needs_a_scene_and_a_few_poses(tmp_path):
    with pytest.raises(InputError, match=r"Expected at least one scene for a page, got none\."):
        save_page([], tmp_path / "p.html")
    with pytest.raises(InputError, match=r"Expected most_poses of at least 3, got 2\."):
        save_page([scene()], tmp_path / "p.html", most_poses=2)
    assert list(tmp_path.iterdir()) == []


def test_a_notebook_shows_the_page_in_a_frame_of_its_own():
    pytest.importorskip("IPython")
    frame = show([scene(name=EVIL)], height=500)._repr_html_()
    assert 'sandbox="allow-scripts"' in frame and 'height="500"' in frame
    (page,) = re.findall(r'srcdoc="([^"]*)"', frame)
    assert html.unescape(page) == page_html([scene(name=EVIL)])


# What a browser makes of it


def of_graphics(event):
    """Return whether an event is the browser's word on how it draws: in software, and slowly read back."""
    entry = event.get("params", {}).get("entry", {})
    return event["method"] == "Log.entryAdded" and (entry["source"], entry["level"]) == (
        "rendering",
        "warning",
    )


@pytest.fixture
def opened(browser, tmp_path):
    """Return a function that writes a page and opens it."""
    pages = []

    def open_page(*scenes, fragment="play=0", width=900, height=640, **settings):
        out = tmp_path / f"{len(pages)}.html"
        save_page(scenes, out)
        pages.append(Page(browser, f"{out.as_uri()}#{fragment}", width, height, **settings))
        return pages[-1]

    yield open_page
    browser.events[:] = [event for event in browser.events if not of_graphics(event)]
    for page in pages:
        page.close()


KEEP = "window.kept = stage.pixels()"
CHANGED = (
    "(() => { const now = stage.pixels(); let n = 0;"
    " for (let k = 0; k < now.length; k += 4)"
    " n += now[k] !== kept[k] || now[k + 1] !== kept[k + 1] || now[k + 2] !== kept[k + 2];"
    " return n; })()"
)  # how many pixels differ from those that were kept
REDDISH = (
    "(() => { const d = stage.pixels(); let n = 0;"
    " for (let k = 0; k < d.length; k += 4) n += d[k] > d[k + 1] + 60 && d[k] > d[k + 2] + 60;"
    " return n; })()"
)


def changed_by(page, action):
    """Return how many pixels an action changes."""
    page.evaluate(f"({KEEP}, 1)")
    action()
    page.frames()
    return page.evaluate(CHANGED)


def middle_of(page):
    return page.evaluate(
        "(() => { const b = byId('picture').getBoundingClientRect();"
        " return [b.left + b.width / 2, b.top + b.height / 2]; })()"
    )


def drag(page, dx, dy, **settings):
    x, y = middle_of(page)
    page.mouse("mousePressed", x, y, button="left", clickCount=1, **settings)
    page.mouse("mouseMoved", x + dx, y + dy, button="left", **settings)
    page.mouse("mouseReleased", x + dx, y + dy, button="left", clickCount=1, **settings)
    page.frames()


def test_the_browser_has_the_joints_of_the_motion(opened):
    given = scene()
    page = opened(given, fragment="pose=40&play=0")
    row = (
        "Array.from(stage.scene.joints.subarray(player.row * stage.scene.width).slice(0, stage.scene.width))"
    )
    joints = np.reshape(page.evaluate(row), (-1, 3))
    quantum = QUANTUM * given.workspace.size
    assert page.pose() == 40 and np.abs(joints - given.motion.joints[40]).max() <= quantum
    assert page.evaluate("stage.scene.feed[player.row]") == pytest.approx(given.motion.feed[40], abs=quantum)
    assert page.evaluate("byId('feed').textContent") == f"{given.motion.feed[40]:.1f} units"


@pytest.mark.image
def test_the_slider_changes_the_pose_and_the_picture(opened):
    page = opened(scene(), fragment="pose=0&play=0")
    scrub = "const s = byId('slider'); s.value = 45; s.dispatchEvent(new Event('input'))"
    assert changed_by(page, lambda: None) == 0  # the same pose is the same picture
    assert changed_by(page, lambda: page.evaluate(scrub)) > 200
    assert page.pose() == 45
    assert page.evaluate("byId('slider').getAttribute('aria-valuetext')") == "pose 45 of 59"


@pytest.mark.image
def test_a_link_in_a_wall_is_red_on_the_page_and_its_depth_is_said(opened):
    page = opened(scene(), fragment=f"pose={WORST}&play=0&walls=0")
    assert page.evaluate(REDDISH) > 50
    said = "[byId('least-name').textContent, byId('least').textContent, byId('colliding').textContent]"
    assert page.evaluate(said) == ["Depth", "7.25 units", "1"]
    page.evaluate("player.goTo(0)")
    assert page.evaluate(REDDISH) == 0
    assert page.evaluate(said) == ["Clearance", "40.0 units", "0"]
    assert page.evaluate("byId('bad-poses').textContent") == "7 of 60"
    page.evaluate("byId('worst').click()")
    assert page.pose() == WORST


@pytest.mark.image
def test_walls_and_path_are_switched_off_and_on(opened):
    page = opened(scene(), fragment="pose=10&play=0")
    for name, least in (("walls", 5_000), ("path", 100)):
        button = f"byId('{name}')"
        assert changed_by(page, lambda button=button: page.evaluate(f"{button}.click()")) > least
        assert page.evaluate(f"{button}.getAttribute('aria-pressed')") == "false"
        page.evaluate(f"{button}.click()")
        page.frames()
        assert page.evaluate(CHANGED) == 0


@pytest.mark.image
def test_dragging_turns_and_a_double_click_resets(opened):
    page = opened(scene(), fragment="pose=40&play=0")
    before = page.evaluate("[stage.camera.yaw, stage.camera.pitch]")
    assert changed_by(page, lambda: drag(page, 60, 25)) > 5_000
    yaw, pitch = page.evaluate("[stage.camera.yaw, stage.camera.pitch]")
    assert yaw < before[0] and pitch > before[1]
    drag(page, 30, 0, modifiers=8)  # with shift it moves aside
    assert page.evaluate("Math.hypot(...stage.camera.target)") > 0.01
    page.click(*middle_of(page), count=2)
    page.frames()
    assert page.evaluate("[stage.camera.yaw, stage.camera.pitch]") == before
    assert page.evaluate(CHANGED) == 0


def test_the_wheel_zooms_and_keys_do_what_they_say(opened):
    page = opened(scene(), fragment="pose=10&play=0")
    page.mouse("mouseWheel", *middle_of(page), deltaX=0, deltaY=-300)
    page.wait("stage.camera.zoom > 1.5")
    page.key("r", text="r")
    assert page.evaluate("stage.camera.zoom") == 1
    poses = []
    for key, modifiers in (("ArrowRight", 0), ("ArrowRight", 8), ("ArrowLeft", 0), ("Home", 0), ("End", 0)):
        page.key(key, modifiers=modifiers)  # 8 is shift
        poses.append(page.pose())
    assert poses == [11, 21, 20, 0, 59]
    page.key("w", text="w")
    assert page.evaluate("shown.walls") is False
    page.key(" ", text=" ")
    assert page.evaluate("document.documentElement.dataset.playing") == "1"
    assert page.evaluate("byId('play').getAttribute('aria-label')") == "Pause"


def test_play_goes_on_to_the_end(opened):
    page = opened(scene(), fragment="play=1&speed=8&loop=0")
    page.wait("document.documentElement.dataset.pose === '59'")
    page.wait("document.documentElement.dataset.playing === '0'")


@pytest.mark.image
def test_another_scene_is_shown_at_the_same_feed_from_the_same_side(opened):
    other = bending(n_poses=31, link_length=95.0)  # whose feeder is mounted farther back
    page = opened(
        scene(), scene(name="thin", motion=other, path=None, distances=None), fragment="pose=40&play=0"
    )
    drag(page, 60, 25)
    yaw = page.evaluate("stage.camera.yaw")
    assert (
        changed_by(page, lambda: page.evaluate("document.querySelectorAll('#scenes button')[1].click()"))
        > 200
    )
    assert page.evaluate("document.documentElement.dataset.scene") == "thin"
    assert page.pose() == int(np.abs(other.feed - bending().feed[40]).argmin())
    assert page.evaluate("stage.camera.yaw") == yaw
    assert page.evaluate("stage.kept.path.length") == 0  # nothing is left of the other scene's path
    assert page.evaluate("[byId('path').hidden, byId('least').closest('.if-distances').hidden]") == [
        True,
        True,
    ]


def test_every_control_has_a_name(opened):
    page = opened(scene(), scene(name="other"))
    nameless = (
        "Array.from(document.querySelectorAll('button, input, select, canvas[role=img]'))"
        ".filter((part) => !part.getAttribute('aria-label')).length"
    )
    assert page.evaluate(nameless) == 0


def test_in_the_browser_too_names_are_only_text(opened):
    page = opened(scene(name=EVIL), scene())
    assert page.evaluate("document.querySelector('#scenes button').textContent") == EVIL
    assert page.evaluate("document.querySelectorAll('#scenes button *').length") == 0


@pytest.mark.image
@pytest.mark.parametrize("dark", [False, True])
def test_a_phone_shows_all_without_scrolling_sideways_and_two_fingers_zoom(opened, dark):
    names = ("182 links of 8", "15 links of 90, followed", "15 links of 90, tracked", "x" * 70)
    page = opened(*(scene(name=name) for name in names), fragment="pose=40&play=0", dark=dark, **PHONE)
    page.frames()
    assert page.evaluate("[document.documentElement.scrollWidth, innerWidth]") == [360, 360]
    x, y = middle_of(page)
    for kind, apart in (("touchStart", 20), ("touchMove", 30), ("touchMove", 60)):
        points = [{"x": x - apart, "y": y, "id": 1}, {"x": x + apart, "y": y, "id": 2}]
        page.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    page.frames()
    assert page.evaluate("stage.camera.zoom") > 2
    page.key("r", text="r")
    background = page.evaluate("Array.from(stage.pixels().slice(0, 3))")
    assert background == ([24, 29, 36] if dark else [255, 255, 255])


def test_without_webgl_the_page_says_so_and_still_shows_the_numbers(browser, tmp_path):
    out = tmp_path / "p.html"
    save_page([scene()], out)
    refused = "<script>HTMLCanvasElement.prototype.getContext = ((real) => function (kind, ...more) { "
    refused += "return kind === 'webgl2' ? null : real.call(this, kind, ...more); })"
    refused += "(HTMLCanvasElement.prototype.getContext);</script>"
    out.write_text(out.read_text(encoding="utf-8").replace("<body>", "<body>" + refused), encoding="utf-8")
    page = Page(browser, f"{out.as_uri()}#pose={WORST}&play=0", 900, 640)
    assert page.evaluate("document.documentElement.dataset.webgl") == "0"
    assert "needs WebGL 2" in page.evaluate("byId('none').textContent")
    assert page.evaluate("byId('none').hidden") is False
    assert page.evaluate("byId('least').textContent") == "7.25 units"
    page.key("ArrowRight")
    assert page.pose() == WORST + 1
    page.close()


@pytest.mark.image
def test_graphics_that_are_taken_away_come_back(opened):
    page = opened(scene(), fragment="pose=40&play=0")
    page.evaluate(f"({KEEP}, 1)")
    page.evaluate("(window.taken = stage.painter.gl.getExtension('WEBGL_lose_context')).loseContext()")
    page.wait("!byId('none').hidden")
    page.evaluate("taken.restoreContext()")
    page.wait("byId('none').hidden && !stage.painter.gl.isContextLost()")
    assert page.evaluate(CHANGED) == 0


def test_a_page_that_is_broken_says_so(browser, tmp_path):
    out = tmp_path / "broken.html"
    save_page([scene()], out)
    out.write_text(out.read_text(encoding="utf-8").replace('"nLinks":5', '"nLinks":6'), encoding="utf-8")
    target = browser.call("Target.createTarget", url=out.as_uri())["targetId"]
    session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
    code = f"Boolean({ERRORS}) && !document.getElementById('failure').hidden"
    end = time.monotonic() + PATIENCE
    while not browser.call("Runtime.evaluate", session, expression=code)["result"].get("value"):
        assert time.monotonic() < end
        time.sleep(0.05)
    browser.call("Target.closeTarget", targetId=target)


def test_kept_poses_are_all_if_they_are_few():
    assert viewer.kept_poses(5, 2, 400).tolist() == [0, 1, 2, 3, 4]
