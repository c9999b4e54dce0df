"""The studio's server, asked over real connections: what it answers, what it refuses, what it survives."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import errno
import http.client
import io
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import zipfile
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsnake_env.arm import ArmSpec
from hrsnake_env.errors import InputError
from hrsnake_env.maze import MAZES, Maze
from planners import PLANNERS, Motion, validate
from planners.studio.jobs import Jobs
from planners.studio.limits import Limits
from planners.studio.motions import motion_from
from planners.studio.requests import REQUESTS, read_request
from planners.studio.running import listening_socket, server_on
from planners.studio.scene import Scene, maze_from_scene, scene_from_maze

JSON = {"Content-Type": "application/json"}
SMALL = {  # a bend, which is planned in milliseconds
    "name": "bend",
    "shapes": [{"role": "free", "line": [[0, 0], [0, 900], [900, 900]], "width": 200}],
    "base": [0, 5, 90],
    "goal": [800, 900],
    "goal_radius": 25,
}
PLAN = {"scene": SMALL, "arm": {"link_length": 300.0}}


class Studio:
    """A server on a free port, in a thread."""

    def __init__(self, limits: Limits, start: Maze | None = None) -> None:
        listener = listening_socket("127.0.0.1", 0)
        self.port = listener.getsockname()[1]
        self.server = server_on("127.0.0.1", limits, start)
        self.jobs: Jobs = self.server.config.app.app.state.jobs  # type: ignore[union-attr]
        self.thread = threading.Thread(target=lambda: asyncio.run(self.server.serve(sockets=[listener])))
        self.thread.start()
        self.wait(lambda: self.server.started)

    def wait(self, done: Any, seconds: float = 120.0) -> None:
        """Wait until something has come about."""
        end = time.monotonic() + seconds
        while not done():
            assert time.monotonic() < end, "nothing happened"
            time.sleep(0.005)

    def close(self) -> None:
        """End the server, as Ctrl-C does."""
        self.server.should_exit = True
        self.thread.join()

    def connect(self) -> http.client.HTTPConnection:
        """Open a connection."""
        return http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)

    def get(self, path: str, headers: dict[str, str] | None = None) -> tuple[int, Any, bytes]:
        """Ask for something."""
        with contextlib.closing(self.connect()) as connection:
            connection.request("GET", path, headers=headers or {})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

    def post(self, path: str, body: Any, headers: dict[str, str] | None = None) -> tuple[int, list[Any]]:
        """Ask for a job; return the status and all lines of the answer."""
        with contextlib.closing(self.connect()) as connection:
            data = body if isinstance(body, bytes) else json.dumps(body).encode()
            connection.request("POST", path, data, JSON if headers is None else headers)
            answer = connection.getresponse()
            return answer.status, [json.loads(line) for line in answer if line.strip()]

    def open(self, kind: str, body: Any) -> tuple[http.client.HTTPConnection, Iterator[Any]]:
        """Ask for a job; return the connection and the lines as they come."""
        connection = self.connect()
        connection.request("POST", f"/api/{kind}", json.dumps(body), JSON)
        answer = connection.getresponse()
        assert answer.status == 200, answer.read()
        return connection, (json.loads(line) for line in answer if line.strip())


@pytest.fixture(scope="module")
def studio() -> Iterator[Studio]:
    """Serve with two workers."""
    running = Studio(Limits(jobs=2, grace_s=5.0), start=_named(SMALL, "my duct"))
    yield running
    running.close()


@pytest.fixture(scope="module")
def strict() -> Iterator[Studio]:
    """Serve within narrow limits, without workers: jobs wait for ever."""
    limits = Limits(jobs=0, queue=2, body_bytes=20_000, body_tokens=500, body_idle_s=0.4, head_s=0.4)
    running = Studio(limits)
    yield running
    running.close()


def _named(scene: dict[str, Any], name: str) -> Maze:
    return maze_from_scene(Scene.model_validate_json(json.dumps({**scene, "name": name})))


def _last(lines: list[Any]) -> Any:
    assert lines[-1]["type"] == "done", lines[-1]
    return lines[-1]["result"]


def _drop(connection: http.client.HTTPConnection) -> None:
    """Close a connection at once, as a closed tab does."""
    sock = connection.sock
    if sock is not None:
        sock.shutdown(socket.SHUT_RDWR)
    connection.close()


# Drawings


@pytest.mark.parametrize("name", MAZES)
def test_a_maze_is_the_same_after_being_a_drawing(name: str) -> None:
    maze = Maze.load(name)
    again = maze_from_scene(Scene.model_validate_json(json.dumps(scene_from_maze(maze))))
    assert again.free_space.equals(maze.free_space)
    assert again.base_pose == pytest.approx(maze.base_pose, abs=1e-12)
    assert (again.goal.tolist(), again.goal_radius) == (maze.goal.tolist(), maze.goal_radius)


def test_a_line_is_the_corridor_of_the_same_centreline() -> None:
    line = [(0, 0), (0, 900), (900, 900)]
    assert _named(SMALL, "bend").free_space.equals(Maze.from_corridors(line, 200.0).free_space)


def test_shapes_count_in_the_order_in_which_they_were_drawn() -> None:
    room = {"role": "free", "rings": [[[0, 0], [10, 0], [10, 10], [0, 10]]]}
    block = {"role": "wall", "rings": [[[4, 4], [6, 4], [6, 6], [4, 6]]]}
    scene = {**SMALL, "base": [1, 1, 0], "goal": [9, 9], "goal_radius": 0.5}
    assert _named({**scene, "shapes": [room, block]}, "a").free_space.area == pytest.approx(96.0)
    assert _named({**scene, "shapes": [block, room]}, "a").free_space.area == pytest.approx(100.0)
    assert _named({**scene, "shapes": [room, block, room]}, "a").free_space.area == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"shapes": []}, "walls alone"),
        ({"base": None}, "Expected a base in the drawing"),
        ({"goal": None}, "Expected a goal in the drawing"),
        ({"goal_radius": None}, "Expected a goal in the drawing"),
        ({"base": [500, 0, 0]}, "Expected the base inside the free space"),
        ({"shapes": [{"role": "free", "rings": [[[0, 0], [1, 1]]]}]}, "at least 3 points in shape 1"),
        ({"shapes": [{"role": "free", "rings": [[[0, 0], [1, 1], [2, 2]]]}]}, "flat"),
        ({"shapes": [{"role": "free", "rings": []}]}, "at least 3 points"),
        ({"shapes": [{"role": "free", "line": [[5, 5], [5, 5]], "width": 2}]}, "two different points"),
    ],
)
def test_a_drawing_that_is_no_maze_is_refused(change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        _named({**SMALL, **change}, "bad")


def test_an_outline_that_crosses_itself_encloses_what_its_parts_enclose() -> None:
    bow = {"role": "free", "rings": [[[0, 0], [10, 10], [10, 0], [0, 10]]]}
    door = {"role": "free", "line": [[4, 5], [6, 5]], "width": 1}
    scene = {**SMALL, "shapes": [bow, door], "base": [1, 5, 0], "goal": [9, 5], "goal_radius": 0.5}
    assert 50.0 < _named(scene, "bow").free_space.area < 52.0


# Requests


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        (b"", "in JSON"),
        (b"{", "in JSON"),
        (b"\xff\xfe\x00", "in JSON"),
        (b"[" * 400, "JSON"),
        (b'{"scene":' * 400, "JSON"),
        (b"[]", "the request"),
        (b"{}", "Expected scene in the request"),
        ({**PLAN, "arm": {"link_length": "300"}}, "arm.link_length"),
        ({**PLAN, "arm": {"link_length": True}}, "arm.link_length"),
        ({**PLAN, "arm": {"link_length": -1}}, "arm.link_length"),
        ({**PLAN, "arm": {"link_length": float("nan")}}, "arm.link_length"),
        ({**PLAN, "arm": {"link_length": float("inf")}}, "arm.link_length"),
        ({**PLAN, "arm": {"link_length": 10**400}}, "arm.link_length"),
        ({**PLAN, "arm": {"link_length": 3.0, "n_links": 10**30}}, "arm.n_links"),
        ({**PLAN, "arm": {"link_length": 3.0, "colour": "red"}}, "'arm.colour', which is not known"),
        ({**PLAN, "time_budget": 1e9}, "at most 60 s"),
        ({**PLAN, "scene": {**SMALL, "base": [0, 0]}}, "scene.base"),
        ({**PLAN, "scene": {**SMALL, "goal": [1e300, 0]}}, "scene.goal"),
        ({**PLAN, "scene": {**SMALL, "name": "x" * 10_000}}, "scene.name"),
        ({**PLAN, "scene": {**SMALL, "shapes": [{"role": "hole", "rings": []}]}}, "shapes.0..role"),
        ({**PLAN, "scene": {**SMALL, "shapes": [{"role": "free"}]}}, "either rings, or a line"),
    ],
)
def test_a_bad_request_gets_one_sentence(studio: Studio, body: Any, sentence: str) -> None:
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    status, (answer,) = studio.post("/api/plan", data)
    assert status == 422
    assert (answer["type"], answer["kind"]) == ("error", "input")
    assert answer["message"].startswith("Expected") and len(answer["message"]) < 400
    assert "pydantic" not in answer["message"]
    assert re.search(sentence, answer["message"]), answer["message"]


def test_a_number_beyond_all_floats_is_refused(studio: Studio) -> None:
    body = json.dumps(PLAN).replace("300.0", "1e999").encode()
    status, (answer,) = studio.post("/api/plan", body)
    assert status == 422 and "link_length" in answer["message"]


def test_a_drawing_of_too_many_points_is_refused(studio: Studio) -> None:
    ring = [[float(k), float(k % 7)] for k in range(20_001)]
    scene = {**SMALL, "shapes": [{"role": "free", "rings": [ring]}]}
    status, (answer,) = studio.post("/api/plan", {**PLAN, "scene": scene})
    assert status == 422 and "20000 points" in answer["message"]


@given(kind=st.sampled_from(sorted(REQUESTS)), body=st.binary(max_size=60))
def test_any_bytes_are_a_request_or_get_a_sentence(kind: str, body: bytes) -> None:
    with pytest.raises(InputError, match="Expected"):
        read_request(kind, body)


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=8,
)


@settings(max_examples=50, deadline=None)
@given(
    path=st.sampled_from([("scene",), ("arm",), ("scene", "shapes"), ("scene", "base"), ("scene", "goal")]),
    value=values,
)
def test_any_value_in_a_request_is_taken_or_gets_a_sentence(path: tuple[str, ...], value: Any) -> None:
    body = json.loads(json.dumps(PLAN))
    inner = body
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    try:
        ask = read_request("plan", json.dumps(body).encode("utf-8", "surrogatepass"))
        maze_from_scene(ask.scene)  # type: ignore[union-attr]
    except InputError as error:
        assert str(error).startswith("Expected")


# Who may ask, and how much


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "localhost.", "[::2]:80"])
def test_another_name_is_refused(studio: Studio, host: str) -> None:
    for path in ("/", "/api/about", "/page/player.js"):
        status, _, body = studio.get(path, {"Host": host})
        assert status == 421 and json.loads(body)["kind"] == "input"


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "localhost:{}", "[::1]:{}", "LocalHost"])
def test_this_machines_own_names_are_served(studio: Studio, host: str) -> None:
    assert studio.get("/api/about", {"Host": host.format(studio.port)})[0] == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://localhost:1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_another_page_is_refused(studio: Studio, headers: dict[str, str]) -> None:
    assert studio.get("/api/about", headers)[0] == 403
    assert studio.post("/api/plan", PLAN, {**JSON, **headers})[0] == 403
    assert studio.post("/api/stop/x", {}, {**JSON, **headers})[0] == 403


def test_the_own_page_is_served(studio: Studio) -> None:
    headers = {"Origin": f"http://127.0.0.1:{studio.port}", "Sec-Fetch-Site": "same-origin"}
    assert studio.get("/api/about", headers)[0] == 200


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data"])
def test_what_a_form_can_send_is_refused(studio: Studio, kind: str) -> None:
    assert studio.post("/api/plan", PLAN, {"Content-Type": kind})[0] == 415


def test_a_body_is_refused_by_its_length_before_it_is_read(strict: Studio) -> None:
    with socket.create_connection(("127.0.0.1", strict.port)) as sock:
        head = "POST /api/plan HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        sock.sendall(f"{head}Content-Length: 99999999999\r\n\r\n".encode())
        assert b" 413 " in sock.recv(4096)


def test_a_client_that_sends_too_much_before_it_listens_hears_why(strict: Studio) -> None:
    status, (answer,) = strict.post("/api/plan", b" " * 30_000)
    assert status == 413 and "at most" in answer["message"]


def test_a_body_without_a_length_is_refused_when_it_has_become_too_large(strict: Studio) -> None:
    with socket.create_connection(("127.0.0.1", strict.port)) as sock:
        head = "POST /api/plan HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        sock.sendall(f"{head}Transfer-Encoding: chunked\r\n\r\n".encode())
        with contextlib.suppress(OSError):
            for _ in range(30):
                sock.sendall(b"400\r\n" + b" " * 1024 + b"\r\n")
        assert b" 413 " in sock.recv(4096)
    strict.wait(lambda: strict.get("/api/about")[0] == 200)


def test_a_body_of_too_many_brackets_is_refused(strict: Studio) -> None:
    status, (answer,) = strict.post("/api/plan", b"[],[]" * 300)
    assert status == 413 and answer["kind"] == "limit"


def test_a_body_that_drips_is_not_waited_for(strict: Studio) -> None:
    with socket.create_connection(("127.0.0.1", strict.port), timeout=20) as sock:
        head = "POST /api/plan HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
        sock.sendall(f"{head}Content-Length: 1000\r\n\r\n".encode() + b"{")
        assert b" 408 " in sock.recv(4096)


def test_a_client_that_is_refused_and_drips_does_not_hold_the_studio(strict: Studio) -> None:
    with socket.create_connection(("127.0.0.1", strict.port)) as client:
        client.sendall(b"POST /api/plan HTTP/1.1\r\nHost: evil.example\r\nContent-Length: 9000\r\n\r\n")
        client.settimeout(0.1)
        for _ in range(100):
            with contextlib.suppress(TimeoutError):
                assert client.recv(100).startswith(b"HTTP/1.1 421")
                return
            client.sendall(b"x")
    raise AssertionError("no answer came while it dripped")


def test_a_connection_that_asks_for_nothing_is_closed(strict: Studio) -> None:
    with socket.create_connection(("127.0.0.1", strict.port), timeout=20) as sock:
        sock.sendall(b"GET / HT")
        assert sock.recv(4096) == b""


@pytest.mark.parametrize(
    "path", ["/page/../server.py", "/page/%2e%2e/server.py", "/page/..%2fserver.py", "/page//etc/passwd"]
)
def test_no_path_leads_out_of_the_page(studio: Studio, path: str) -> None:
    status, _, body = studio.get(path)
    assert status == 404 and b"import" not in body


def test_every_answer_forbids_what_is_not_the_pages_own(studio: Studio) -> None:
    for path in ("/page/player.js", "/api/about", "/nothing", "/api/mazes/fig19"):
        _, headers, _ = studio.get(path)
        assert headers["Content-Security-Policy"].startswith("default-src 'none'")
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["Referrer-Policy"] == "no-referrer"
        assert headers["Cache-Control"] == "no-cache"


def test_a_file_of_the_page_that_has_not_changed_is_not_sent_again(studio: Studio) -> None:
    status, headers, body = studio.get("/page/player.js")
    assert (status, headers.get_content_type()) == (200, "text/javascript") and b"HrsnakePlayer" in body
    assert studio.get("/page/player.js", {"If-None-Match": headers["ETag"]})[0] == 304


# What is known


def test_about_names_every_planner_and_maze(studio: Studio) -> None:
    about = json.loads(studio.get("/api/about")[2])
    assert [each["name"] for each in about["planners"]] == ["auto", *PLANNERS]
    assert all(each["about"] for each in about["planners"])
    assert {*MAZES} <= {each["name"] for each in about["mazes"]}
    assert about["limits"]["jobs"] == 2 and about["start"] == "my duct"


@pytest.mark.parametrize("name", ["fig19", "clutter-7", "my%20duct"])
def test_a_named_maze_is_a_drawing_with_a_link_length(studio: Studio, name: str) -> None:
    status, _, body = studio.get(f"/api/mazes/{name}")
    answer = json.loads(body)
    maze = maze_from_scene(Scene.model_validate_json(json.dumps(answer["scene"])))
    assert status == 200
    maze.check_arm(ArmSpec(link_length=answer["link_length"]))


@pytest.mark.parametrize("name", ["nothing", "clutter-" + "9" * 5000, "a.geojson", "..%2f..%2fetc%2fpasswd"])
def test_no_other_name_is_a_maze(studio: Studio, name: str) -> None:
    status, _, body = studio.get(f"/api/mazes/{name}")
    assert status == 404 and b"error" in body


# Jobs


def test_a_plan_comes_checked_and_simulated(studio: Studio) -> None:
    status, lines = studio.post("/api/plan", PLAN)
    assert status == 200 and lines[0]["type"] == "job" and lines[0]["id"]
    result = _last(lines)
    motion, maze = motion_from(result["motion"]), _named(SMALL, "bend")
    assert result["solved"] and validate(motion, maze).valid
    assert (result["n_links"], result["n_poses"]) == (motion.n_links, motion.n_poses)
    assert result["report"]["valid"] and result["verdict"]["clean"] and result["success"]
    assert result["payload"]["traces"][0]["nLinks"] == motion.n_links
    assert Maze.from_geojson(result["geojson"]).free_space.equals(maze.free_space)


def test_a_plan_that_fails_says_where_and_why(studio: Studio) -> None:
    result = _last(studio.post("/api/plan", {**PLAN, "arm": {"link_length": 620.0}, "planner": "track"})[1])
    assert not result["solved"] and result["reason"] and result["motion"] is None
    assert len(result["place"]) == 2 and result["payload"] is None


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"planner": "magic"}, "Unknown planner 'magic'"),
        ({"arm": {"link_length": 1e6}}, "link_length of at most the size"),
        ({"scene": {**SMALL, "goal": [0, -50]}}, "Expected the goal inside"),
        ({"warm_start": "!"}, "in base64"),
    ],
)
def test_what_cannot_be_planned_gets_a_sentence(
    studio: Studio, change: dict[str, Any], sentence: str
) -> None:
    status, lines = studio.post("/api/plan", {**PLAN, **change})
    assert status == 200 and lines[-1]["kind"] == "input"
    assert sentence in lines[-1]["message"]


def test_a_motion_is_checked_and_shown_only_if_valid(studio: Studio) -> None:
    good = _last(studio.post("/api/plan", PLAN)[1])["motion"]
    ask = {"scene": SMALL, "arm": PLAN["arm"], "motion": good}
    result = _last(studio.post("/api/check", ask)[1])
    assert result["solved"] and result["payload"] is not None
    motion = motion_from(good)
    forged = Motion.from_configurations(
        motion.feed, motion.joint_angles * 1.2, motion.link_length, motion.base_pose
    )
    ask["motion"] = _sent(forged)
    result = _last(studio.post("/api/check", ask)[1])
    assert result["status"] == "not valid" and result["payload"] is None and result["reason"]


def _sent(motion: Motion) -> str:
    from planners.studio.motions import motion_bytes

    return base64.b64encode(motion_bytes(motion)).decode()


def test_a_search_is_stopped_with_the_best_so_far(studio: Studio) -> None:
    ask = {"scene": SMALL, "accuracy": 0.0005}
    connection, lines = studio.open("longest", ask)
    job = next(lines)["id"]
    seen = next(line for line in lines if line["type"] == "progress" and "best so far" in line["news"])
    assert 0.0 <= seen["share"] <= 1.0
    status, (answer,) = studio.post(f"/api/stop/{job}", {})
    assert (status, answer) == (200, {"stopped": True})
    result = _last(list(lines))
    connection.close()
    assert not result["complete"] and result["solved"] and result["table"]
    assert 0.0 < result["length"] <= result["bound_upper"]
    assert validate(motion_from(result["motion"]), _named(SMALL, "bend")).valid


def test_nothing_is_stopped_by_a_wrong_name(studio: Studio) -> None:
    assert studio.post("/api/stop/nobody", {}) == (200, [{"stopped": False}])


def test_everybody_gets_the_answer_to_his_own_question(studio: Studio) -> None:
    def ask(number: int) -> None:
        length = 250.0 + 10.0 * number
        answers[number] = _last(studio.post("/api/plan", {**PLAN, "arm": {"link_length": length}})[1])

    answers: dict[int, Any] = {}
    threads = [threading.Thread(target=ask, args=(number,)) for number in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for number in range(8):
        assert motion_from(answers[number]["motion"]).link_length == 250.0 + 10.0 * number


def test_a_closed_tab_ends_its_job_and_no_other(studio: Studio) -> None:
    before = set(studio.jobs.pids)
    connection, lines = studio.open("longest", {"scene": SMALL, "accuracy": 0.0005})
    other, its_lines = studio.open("longest", {"scene": SMALL, "accuracy": 0.0005})
    job = next(its_lines)["id"]
    next(line for line in lines if line["type"] == "progress")
    _drop(connection)
    studio.wait(lambda: len(studio.jobs.pids) == 2 and set(studio.jobs.pids) != before)
    assert len(set(studio.jobs.pids) & before) == 1
    next(line for line in its_lines if "best so far" in line.get("news", ""))
    studio.post(f"/api/stop/{job}", {})
    assert _last(list(its_lines))["solved"]
    other.close()
    assert _last(studio.post("/api/plan", PLAN)[1])["solved"]


@pytest.mark.skipif(os.name != "posix", reason="kills as POSIX does")
def test_a_worker_that_is_killed_fails_its_own_job_alone(studio: Studio) -> None:
    studio.wait(lambda: all(slot.idle for slot in studio.jobs.slots))
    connection, lines = studio.open("longest", {"scene": SMALL, "accuracy": 0.0005})
    next(line for line in lines if line["type"] == "progress")
    slot = next(slot for slot in studio.jobs.slots if slot.job is not None)
    assert slot.worker is not None and slot.worker.pid is not None
    os.kill(slot.worker.pid, signal.SIGKILL)
    last = list(lines)[-1]
    connection.close()
    assert (last["type"], last["kind"]) == ("error", "internal")
    assert _last(studio.post("/api/plan", PLAN)[1])["solved"]


def test_a_job_whose_time_is_over_is_ended(studio: Studio) -> None:
    studio.wait(lambda: any(slot.idle for slot in studio.jobs.slots))
    job = _on_loop(studio, lambda: studio.jobs.submit("longest", json.dumps({"scene": SMALL}).encode(), 60.0))
    slot = next(slot for slot in studio.jobs.slots if slot.job is job)
    _on_loop(studio, lambda: studio.jobs._too_late(slot, job))
    assert job.ended and b'"kind":"time"' in job._lines[-1][1]


def _on_loop(studio: Studio, function: Any) -> Any:
    """Call a function in the server's thread."""

    async def call() -> Any:
        return function()

    return asyncio.run_coroutine_threadsafe(call(), studio.jobs._loop).result(60)


def test_jobs_wait_in_order_and_those_that_cannot_are_refused(strict: Studio) -> None:
    first, first_lines = strict.open("plan", PLAN)
    second, second_lines = strict.open("plan", PLAN)
    assert [next(first_lines)["type"], next(first_lines)["ahead"]] == ["job", 0]
    assert [next(second_lines)["type"], next(second_lines)["ahead"]] == ["job", 1]
    status, (answer,) = strict.post("/api/plan", PLAN)
    assert status == 503 and answer["kind"] == "busy"
    _drop(first)  # a closed tab leaves the queue
    assert next(line for line in second_lines if line["ahead"] == 0)
    third, third_lines = strict.open("plan", PLAN)
    job = next(third_lines)["id"]
    assert strict.post(f"/api/stop/{job}", {})[1] == [{"stopped": True}]
    assert list(third_lines)[-1]["kind"] == "time"
    third.close()
    _drop(second)
    strict.wait(lambda: not strict.jobs.waiting)


def test_a_worker_that_never_gets_ready_is_said_to_those_who_wait() -> None:
    running = Studio(Limits(jobs=1, warm_up_s=0.2))
    try:
        last = running.post("/api/plan", PLAN)[1][-1]
    finally:
        running.close()
    assert (last["type"], last["kind"]) == ("error", "internal")
    assert last["message"].startswith("No worker was ready after 0.2 s")


def test_a_worker_that_cannot_be_started_is_said_to_those_who_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: Limits) -> None:
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr("planners.studio.jobs.Worker", full)
    monkeypatch.setattr("planners.studio.jobs.RETRY_S", 0.05)
    running = Studio(Limits(jobs=1))
    try:
        last = running.post("/api/plan", PLAN)[1][-1]
    finally:
        running.close()
    assert last["message"] == "No worker could be started: Resource temporarily unavailable."


# Maps

PGM = b"P5\n6 5\n255\n" + bytes(6) + 3 * (b"\0" + 4 * b"\xff" + b"\0") + bytes(6)
YAML = (
    b"image: {}\nresolution: 0.5\norigin: [1.0, 2.0, 0.0]\nnegate: 0\n"
    b"occupied_thresh: 0.65\nfree_thresh: 0.2\n"
)


def _files(**files: bytes) -> list[dict[str, str]]:
    return [{"name": name, "data": base64.b64encode(data).decode()} for name, data in files.items()]


@pytest.mark.parametrize("image", [b"map.pgm", b"/home/me/maps/map.pgm"])
def test_a_map_of_two_files_is_read_from_what_was_sent(studio: Studio, image: bytes) -> None:
    files = _files(**{"map.pgm": PGM, "map.yaml": YAML.replace(b"{}", image)})
    result = _last(studio.post("/api/map", {"files": files})[1])
    (shape,) = result["scene"]["shapes"]
    xs, ys = zip(*shape["rings"][0], strict=True)
    assert (min(xs), max(xs), min(ys), max(ys)) == pytest.approx((1.5, 3.5, 2.5, 4.0))
    assert (result["units"], result["parts"], result["scene"]["base"]) == ("m", 1, None)
    assert result["notes"]


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("map.yaml", YAML.replace(b"{}", b"../../../../etc/passwd"), "among the files"),
        ("map.yaml", YAML.replace(b"{}", b"/etc/passwd"), "among the files"),
        ("map.png", b"no picture", "Expected"),
        ("map.svg", b"<svg", "Expected"),
        ("map.dxf", b"0\nSECTION", "Expected"),
        ("/etc/passwd", b"", "Unknown kind of map 'passwd'"),
        ("map.geojson", b"{", "Expected"),
    ],
)
def test_a_map_that_cannot_be_read_gets_a_sentence(
    studio: Studio, name: str, data: bytes, sentence: str
) -> None:
    status, lines = studio.post("/api/map", {"files": _files(**{name: data})})
    assert status == 200 and (lines[-1]["type"], lines[-1]["kind"]) == ("error", "input")
    assert sentence in lines[-1]["message"] and "root:" not in lines[-1]["message"]


def test_an_unknown_option_of_maps_is_refused(studio: Studio) -> None:
    ask = {"files": _files(**{"map.pgm": PGM}), "options": {"colour": "red"}}
    assert studio.post("/api/map", ask)[0] == 422
    assert studio.post("/api/map", {"files": _files(**{f"{k}.pgm": PGM for k in range(9)})})[0] == 422
    assert studio.post("/api/map", {"files": []})[0] == 422


# Exports


@pytest.fixture(scope="module")
def run(studio: Studio) -> dict[str, Any]:
    """Plan once for all exports."""
    motion = _last(studio.post("/api/plan", PLAN)[1])["motion"]
    return {"scene": SMALL, "arm": PLAN["arm"], "motion": motion, "title": "The bend, <at> 300 px"}


def test_every_format_that_is_offered_says_what_it_is(studio: Studio) -> None:
    formats = json.loads(studio.get("/api/about")[2])["exports"]
    assert {"geojson", "motion", "html", "csv"} <= {each["name"] for each in formats}
    assert all(each["about"] and each["ending"].startswith(".") for each in formats)


def test_a_maze_is_exported_without_a_motion(studio: Studio, run: dict[str, Any]) -> None:
    ask = {"format": "geojson", "runs": [{**run, "motion": None}]}
    result = _last(studio.post("/api/export", ask)[1])
    maze = Maze.from_geojson(json.loads(base64.b64decode(result["data"])))
    assert maze.free_space.equals(_named(SMALL, "bend").free_space)
    assert (result["name"], result["type"]) == ("The-bend-at-300-px.geojson", "application/geo+json")


def test_a_motion_is_exported_as_it_is(studio: Studio, run: dict[str, Any]) -> None:
    result = _last(studio.post("/api/export", {"format": "motion", "runs": [run]})[1])
    assert np.array_equal(motion_from(result["data"]).joints, motion_from(run["motion"]).joints)


def test_two_runs_are_one_page(studio: Studio, run: dict[str, Any]) -> None:
    ask = {"format": "html", "runs": [run, {**run, "title": "the other"}]}
    page = base64.b64decode(_last(studio.post("/api/export", ask)[1])["data"]).decode()
    assert "the other" in page and "<at>" not in page


def test_a_trajectory_keeps_the_limits_that_were_given(studio: Studio, run: dict[str, Any]) -> None:
    durations = []
    for speed in (100.0, 50.0):
        limits = {"feed_speed": speed, "feed_acceleration": 1e4}
        ask = {"format": "csv", "runs": [run], "limits": limits, "rate": 20.0}
        data = base64.b64decode(_last(studio.post("/api/export", ask)[1])["data"]).decode()
        durations.append(float(data.strip().splitlines()[-1].split(",")[0]))
    assert durations[1] > 1.5 * durations[0] > 0.0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"format": "docx"}, "Unknown format 'docx'"),
        ({"format": "urdf"}, "metre"),
        ({"limits": {"wish": 3.0}}, "Unknown limit 'wish'"),
        ({"runs": 2}, "Expected one run"),
        ({"motion": None}, "plan first"),
        ({"motion": "forged"}, "Expected a valid motion"),
    ],
)
def test_what_cannot_be_exported_gets_a_sentence(
    studio: Studio, run: dict[str, Any], change: dict[str, Any], sentence: str
) -> None:
    change = dict(change)
    good = motion_from(run["motion"])
    forged = Motion.from_configurations(good.feed, good.joint_angles * 1.2, good.link_length, good.base_pose)
    motions = {None: None, "forged": _sent(forged), "good": run["motion"]}
    runs = [{**run, "motion": motions[change.pop("motion", "good")]}] * change.pop("runs", 1)
    ask = {"format": "csv", "runs": runs, **change}
    status, lines = studio.post("/api/export", ask)
    assert status == 200 and lines[-1].get("kind") == "input", lines[-1]
    assert sentence in lines[-1]["message"]


# Motions that were sent


def _archive(**members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return file.getvalue()


def _npy(array: Any) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


@pytest.mark.parametrize(
    ("data", "sentence"),
    [
        (b"", "file that is not one"),
        (b"PK\x03\x04", "file that is not one"),
        (_archive(joints=bytes(300 * 2**20)), "more than 256 MiB when it is unpacked"),
        (_archive(**{f"a{k}": b"" for k in range(1001)}), "more than 1000 members"),
        (_archive(joints=_npy(np.zeros(3))), "with the keys"),
        (
            _archive(**dict.fromkeys(("joints", "joint_angles", "feed", "link_length", "base_pose"), b"x")),
            "file that is not one",
        ),
        (
            _archive(
                **dict.fromkeys(("joints", "joint_angles", "feed", "base_pose"), _npy(np.array(["a"]))),
                link_length=_npy(1.0),
            ),
            "a motion of numbers",
        ),
    ],
    ids=["empty", "torn", "bomb", "many", "keys", "no arrays", "texts"],
)
def test_a_file_that_is_no_motion_is_refused_before_it_is_unpacked(data: bytes, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        motion_from(base64.b64encode(data).decode())


@settings(max_examples=30, deadline=None)
@given(st.binary(max_size=200))
def test_a_torn_motion_is_refused_or_the_same(noise: bytes) -> None:
    motion = Motion.from_configurations([0.0, 1.0], [[0.0], [0.1]], 2.0, (0.0, 0.0, 0.0))
    raw = base64.b64decode(_sent(motion))
    at = len(noise) * 7 % len(raw)
    try:
        motion_from(base64.b64encode(raw[:at] + noise + raw[at + len(noise) :]).decode())
    except InputError as error:
        assert str(error).startswith("Expected")


# The command


@pytest.mark.skipif(os.name != "posix", reason="interrupts as POSIX does")
def test_the_command_takes_the_next_port_and_ends_with_its_workers() -> None:
    script = "import typer; from planners.cli_studio import studio_command; typer.run(studio_command)"
    with listening_socket("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        process = subprocess.Popen(
            [sys.executable, "-c", script, "--no-browser", "--port", str(port), "--jobs", "1"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        said = process.stdout.readline()
        assert "http://127.0.0.1:" in said and f":{port}/" not in said
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 0 and f"Port {port} is taken" in errors
    assert "Traceback" not in errors
