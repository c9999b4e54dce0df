"""Map files that are broken or hostile: refused in one sentence, or read; within time, memory and folder.

The campaign with ten thousand inputs for each reader is `benchmarks/trust/fuzz_maps.py`.
"""

import json
import math
import os
import sys

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.trust.fuzz_maps import attack, faults_in
from benchmarks.trust.map_attacks import ATTACKS
from benchmarks.trust.map_inputs import KINDS
from benchmarks.trust.map_mutations import mutated
from benchmarks.trust.map_seeds import OUTLINES, seeds
from hrsnake_env.errors import LONGEST_MESSAGE, InputError, brief, printable
from hrsnake_env.maps import MapOptions, MapReading, read_map
from hrsnake_env.maps.drawing import Drawing, Outline, Stroke
from hrsnake_env.maps.flatten import Arc, Line
from hrsnake_env.maps.joining import joined
from hrsnake_env.maps.outlines import read_outlines
from hrsnake_env.maze import Maze

ENDINGS = (".geojson", ".yaml", ".pgm", ".png", ".svg", ".dxf")
HEAVY = {
    *("white", "sixty million pixels that are not there", "packed path", "packed spaces", "a long spline"),
    *("squares that overlap", "free squares that overlap", "free circles that overlap", "lines that cross"),
    *("some uses", "noise", "long type", "long kind"),
}
"""Attacks that are left to the campaign: they take a second each."""


@pytest.mark.parametrize("kind", KINDS)
def test_no_attack_brings_a_reader_down(kind):
    tasks = [(name, name, "map") for name in ATTACKS[kind] if name not in HEAVY]
    found = {task[0]: fault for task, fault in faults_in(kind, 0, tasks) if fault is not None}
    assert found == {}


@pytest.mark.parametrize("kind", KINDS)
def test_broken_files_are_refused_in_a_sentence_or_read(kind):
    found = {number: fault for number, fault in faults_in(kind, 1, range(25)) if fault is not None}
    assert found == {}


def test_attacks_on_mazes_are_refused_in_a_sentence():
    tasks = [(name, name, "maze") for name in ATTACKS["geojson"] if name not in HEAVY or "long" in name]
    assert [(task[0], fault) for task, fault in faults_in("geojson", 0, tasks) if fault is not None] == []


@pytest.mark.parametrize("ending", ENDINGS)
def test_what_is_no_file_is_told_at_once(tmp_path, ending):
    """A pipe without a writer would be waited for, a folder cannot be read, and a link may lead nowhere."""
    pipe, folder, link = (tmp_path / f"{name}{ending}" for name in ("pipe", "folder", "link"))
    os.mkfifo(pipe)
    folder.mkdir()
    link.symlink_to(tmp_path / "nowhere")
    for path in (pipe, folder, link, tmp_path / f"missing{ending}"):
        with pytest.raises(InputError, match="Expected a file at"):
            read_map(path)
    if ending == ".geojson":
        for path in (pipe, folder, link):
            with pytest.raises(InputError, match="Expected a maze file at"):
                Maze.load(path)


@pytest.mark.parametrize("image", ["/etc/passwd", "../../../../etc/passwd", "C:\\secret.png", "/dev/zero"])
def test_an_uploaded_map_reads_nothing_but_what_was_uploaded(image):
    """The studio gives its own way to files; what a map names is asked of that alone."""
    data, opened, on = seeds("ros")[0][1].replace(b"room.pgm", image.encode()), [], [True]
    sys.addaudithook(lambda event, what: opened.append(what[0]) if on and event == "open" else None)

    def uploaded(name):
        if name != "map.yaml":
            raise InputError(f"Expected an upload, got {name}.")
        return data

    opened.clear()
    with pytest.raises(InputError, match="Expected an upload"):
        read_map("map.yaml", None, uploaded)
    on.clear()
    assert opened == []


@given(st.text(max_size=3 * LONGEST_MESSAGE))
@settings(max_examples=60)
def test_what_input_errors_say_can_be_printed_whatever_was_given(text):
    said = str(InputError(text))
    assert said.isprintable() and said.encode("utf-8") is not None
    assert said == text or not text.isprintable() or len(said) <= LONGEST_MESSAGE < len(text)


@given(st.recursive(st.none() | st.integers() | st.text(), lambda inner: st.lists(inner), max_leaves=30))
@settings(max_examples=60)
def test_what_was_given_is_told_briefly(value):
    assert len(brief(value)) <= 200


def test_integers_without_end_are_told_briefly():
    assert brief(16**9000) == "a long int"


def test_names_out_of_files_cannot_steer_a_terminal():
    data = {**OUTLINES, "name": "\x1b[2J", "units": "\u202e"}
    reading = read_map("map.geojson", None, lambda name: json.dumps(data).encode())
    assert (reading.name, reading.units) == (r"\x1b[2J", r"\u202e")
    maze = Maze.from_geojson({**seeds_maze(), "name": "\x07", "units": "\x9b"})
    assert (maze.name, maze.units) == (r"\x07", r"\x9b")


def seeds_maze():
    return json.loads(seeds("geojson")[2][1])


def test_printable_texts_stay_as_they_are():
    for text in ("Grundriß 2. OG, 日本", "", "[bold] a"):
        assert printable(text) == text


def test_lines_that_meet_in_one_point_are_joined_however_many_they_are():
    """A star: all pairs of its ends together would not fit into memory."""
    angles = np.linspace(0.0, 6.0, 20_000)
    tips = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings, rest = joined([np.stack([np.zeros(2), tip]) for tip in tips], 1e-9)
    assert len(rings) == 0 and len(rest) == len(tips)


@pytest.mark.parametrize("angle", [math.nan, math.inf])
def test_arcs_of_no_angle_are_left_out(angle):
    room = Outline(
        strokes=(Stroke(pieces=(Line(points=np.array([[0.0, 0.0], [9, 0], [9, 9]])),), closed=True),)
    )
    half = np.array([2.0, 0.0]), np.array([0.0, 2.0])
    arc = Arc(centre=np.array([6.0, 3.0]), major=half[0], minor=half[1], sweep=angle)
    drawing = Drawing(name="a", outlines=[room, Outline(strokes=(Stroke(pieces=(arc,)),))])
    assert read_outlines(drawing, MapOptions()).free_space.area == 40.5


def test_ends_that_are_nearly_one_move_to_the_first_of_them():
    gap, lines = 0.1, [np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.05, 0.0], [1.0, 1.0], [0.0, 0.04]])]
    rings, rest = joined(lines, gap)
    assert rest == [] and {tuple(point) for point in rings[0]} >= {(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)}


def test_a_free_space_that_numbers_cannot_hold_is_refused():
    square = shapely.box(0.0, 0.0, 1.0, 1.0)
    for space in (
        shapely.transform(square, lambda xy: xy + 1e20),
        shapely.transform(square, lambda xy: xy + np.inf),
    ):
        with pytest.raises(InputError, match="that is too small for where it is, or too large"):
            MapReading(name="a", free_space=space, units="m")


def test_the_same_seed_draws_the_same_faults():
    data, others = seeds("svg")[0][1], [each for _, each in seeds("svg")]
    twice = [[mutated(data, np.random.default_rng(seed), others) for seed in range(40)] for _ in range(2)]
    assert twice[0] == twice[1] and len(set(twice[0])) > 30


def test_attacks_are_files_of_their_kind():
    for kind in KINDS:
        assert attack(kind, "empty").files[attack(kind, "empty").main] == b""
