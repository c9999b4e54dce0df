"""Maps from pixels: exact outlines, walls that move inward alone, ROS maps and images as they are stored."""

import io
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from PIL import Image
from scipy import ndimage
from shapely.affinity import rotate
from shapely.geometry import MultiPolygon, Point, Polygon, box

from hrsnake_env.errors import InputError
from hrsnake_env.maps import MapOptions, image, read_map
from hrsnake_env.maps.picture import draw_reading
from hrsnake_env.maps.raster import free_polygons
from hrsnake_env.maps.reading import scale_and_units
from hrsnake_env.maps.simplify import simplified_inward

SAMPLES = Path(__file__).parent / "maps"

pixels = arrays.arrays(np.bool_, st.tuples(st.integers(1, 9), st.integers(1, 9)))
tolerances = st.sampled_from([0.0, 0.5, 0.75, 1.0, 1.5, 3.0])

HEADER = {
    "image": "m.png",
    "resolution": 0.1,
    "origin": [0, 0, 0],
    "negate": 0,
    "occupied_thresh": 0.65,
    "free_thresh": 0.25,
}


def blobs(seed, size=40):
    """Return smooth random free space."""
    noise = np.random.default_rng(seed).random((size, size))
    return ndimage.gaussian_filter(noise, 2.0) > 0.5


def drawn(shape, rows, columns):
    """Return the pixels whose centres are in a shape; y points up."""
    x, y = np.meshgrid(np.arange(columns) + 0.5, rows - np.arange(rows) - 0.5)
    return shapely.contains_xy(shape, x, y)


def n_vertices(shape):
    """Return the number of vertices of all rings."""
    return shapely.get_num_coordinates(shape) - len(shapely.get_rings(shapely.get_parts(shape)))


def stored(levels, **settings):
    """Return an image file's contents."""
    file = io.BytesIO()
    Image.fromarray(np.asarray(levels)).save(file, format=settings.pop("format", "PNG"), **settings)
    return file.getvalue()


def uploads(**contents):
    """Return what reads files by name from memory alone."""
    by_name = {name.replace("_", ".", 1): data for name, data in contents.items()}

    def read(name):
        if name not in by_name:
            raise InputError(f"Unknown file {name!r}. Available: {', '.join(by_name)}.")
        return by_name[name]

    return read


def header(**changes):
    """Return a YAML file of map_server."""
    fields = {key: value for key, value in {**HEADER, **changes}.items() if value is not None}
    return "".join(f"{key}: {value}\n" for key, value in fields.items()).encode()


def states_of(levels, mode="trinary", **changes):
    """Return which pixels of a row are free, as booleans, of a ROS map."""
    files = uploads(m_yaml=header(mode=mode, **changes), m_png=stored(levels))
    columns = np.asarray(levels).shape[1]
    try:
        reading = read_map("m.yaml", MapOptions(tolerance=0.0), files)
    except InputError as error:
        assert "free pixels" in str(error)
        return [False] * columns
    return [reading.free_space.contains(Point(0.1 * k + 0.05, 0.05)) for k in range(columns)]


# Outlines of pixels


@given(pixels)
def test_the_outline_holds_the_free_pixels_and_no_others(free):
    outline = free_polygons(free)
    assert outline.is_valid and outline.area == free.sum()
    rows, columns = free.shape
    assert np.array_equal(drawn(outline, rows, columns), free)


@given(pixels)
def test_free_pixels_that_touch_at_a_corner_alone_are_not_joined(free):
    parts = shapely.get_parts(free_polygons(free))
    assert sum(not part.is_empty for part in parts) == ndimage.label(free)[1]


def test_an_outline_has_its_corners_alone_and_its_origin_at_the_lower_left():
    outline = free_polygons(np.ones((3, 5)))
    assert outline.equals(box(0, 0, 5, 3)) and n_vertices(outline) == 4
    assert free_polygons([[0, 0], [1, 0]]).equals(box(0, 0, 1, 1))


def test_no_free_pixel_is_an_empty_outline_and_a_list_is_no_image():
    assert free_polygons(np.zeros((3, 4))).is_empty
    with pytest.raises(InputError, match="rows, columns"):
        free_polygons([1, 0, 1])


# Simplification


def check_simplified(original, tolerance):
    simple, moved = simplified_inward(original, tolerance)
    assert simple.is_valid
    assert original.covers(simple) and simple.difference(original).area <= 1e-9 * original.area
    assert moved <= tolerance * (1.0 + 1e-9)
    apart = shapely.hausdorff_distance(simple.boundary, original.boundary, densify=0.1)
    assert apart <= moved + 1e-9
    parts = shapely.get_parts(simple), shapely.get_parts(original)
    assert len(parts[0]) == len(parts[1])
    assert len(shapely.get_rings(parts[0])) == len(shapely.get_rings(parts[1]))
    assert n_vertices(simple) <= n_vertices(original)
    return simple, moved


@given(pixels, tolerances)
def test_walls_move_into_the_free_space_alone_and_no_farther_than_allowed(free, tolerance):
    if free.any():
        check_simplified(free_polygons(free), tolerance)


@given(st.integers(0, 10**6), tolerances)
@settings(max_examples=30)
def test_smooth_outlines_too_move_inward_alone_and_lose_vertices(seed, tolerance):
    outline = free_polygons(blobs(seed))
    simple, _ = check_simplified(outline, tolerance)
    if tolerance >= 1.5:
        assert n_vertices(simple) < 0.7 * n_vertices(outline)


@given(st.integers(0, 10**6), st.floats(0.1, 6.0), st.floats(0.0, 0.3))
@settings(max_examples=30)
def test_outlines_of_any_angle_move_inward_alone(seed, turn, tolerance):
    outline = rotate(free_polygons(blobs(seed, 25)), turn, use_radians=True)
    check_simplified(outline, tolerance)


@given(st.integers(0, 10**6))
@settings(max_examples=15)
def test_what_is_simple_hardly_becomes_simpler(seed):
    simple, _ = simplified_inward(free_polygons(blobs(seed)), 1.5)
    again, _ = simplified_inward(simple, 1e-9)
    assert n_vertices(again) >= n_vertices(simple) - 2
    assert math.isclose(again.area, simple.area, rel_tol=1e-6)


def test_without_tolerance_vertices_on_straight_walls_alone_are_left_out():
    square = Polygon(
        [(0, 0), (1, 0), (3, 0), (3, 3), (2, 3), (0, 3)], [[(1, 1), (1, 2), (2, 2), (2, 1.5), (2, 1)]]
    )
    simple, moved = simplified_inward(square, 0.0)
    assert simple.equals(square) and n_vertices(simple) == 8 and moved == 0.0


def test_the_staircase_of_a_diagonal_becomes_one_wall():
    rows = np.arange(60)
    stairs = rows[:, None] >= rows[None, :]
    outline = free_polygons(stairs)
    simple, moved = simplified_inward(outline, math.sqrt(0.5))
    assert n_vertices(outline) > 100 and n_vertices(simple) <= 4
    assert moved == pytest.approx(math.sqrt(0.5))


@pytest.mark.parametrize("turn", [3, 10, 20, 26.565, 30, 40, 44, 45, 60, 87])
def test_straight_walls_of_any_angle_become_straight_at_the_default_tolerance(turn):
    wall = rotate(box(60.3, 120.2, 240.7, 180.6), turn)
    outline = free_polygons(drawn(wall, 300, 300))
    simple, _ = check_simplified(outline, image.TOLERANCE)
    assert n_vertices(simple) <= 12  # four walls, and a little at their corners


def test_a_passage_narrower_than_the_tolerance_stays_open():
    free = np.ones((20, 21), dtype=bool)
    free[:, 10] = False
    free[9, 10] = True
    simple, _ = check_simplified(free_polygons(free), 5.0)
    assert isinstance(simple, Polygon)


def test_specks_stay_obstacles():
    free = np.ones((30, 30), dtype=bool)
    free[5::10, 5::10] = False
    simple, _ = check_simplified(free_polygons(free), 3.0)
    assert not any(simple.contains(Point(x + 0.5, 29.5 - y)) for y in (5, 15, 25) for x in (5, 15, 25))


def test_holes_that_touch_walls_at_a_point_are_not_crossed():
    notched = Polygon([(0, 0), (10, 0), (10, 6), (5, 6.3), (0, 6)], [[(5, 6.3), (4, 4), (6, 4)]])
    assert notched.is_valid
    check_simplified(notched, 1.0)


@pytest.mark.parametrize("seed", [23, 32, 138, 146, 184, 192, 230, 3562])
def test_walls_that_touch_at_a_point_keep_no_part_from_becoming_simpler(seed):
    outline = free_polygons(blobs(seed))
    simple, _ = check_simplified(outline, 3.0)
    assert n_vertices(simple) < 0.5 * n_vertices(outline)


@pytest.mark.parametrize("tolerance", [-1.0, math.nan, math.inf])
def test_a_tolerance_that_is_none_is_refused(tolerance):
    with pytest.raises(InputError, match="tolerance"):
        simplified_inward(box(0, 0, 1, 1), tolerance)


def test_an_outline_that_crosses_itself_is_refused():
    with pytest.raises(InputError, match="valid polygon"):
        simplified_inward(Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), 0.1)


# ROS maps


def test_a_map_as_its_saver_writes_it_is_read_in_metres_with_its_origin():
    reading = read_map(SAMPLES / "ros_house.yaml", MapOptions(tolerance=0.0))
    assert reading.units == "m" and reading.name == "ros_house"
    assert reading.free_space.bounds == pytest.approx((-0.95, -0.55, 3.35, 2.15))
    maze = reading.maze(base_pose=(-0.8, 0.0, 0.0), goal=(3.1, 0.0))
    assert maze.units == "m" and maze.free_space.covers(Point(3.1, 0.0))


def test_units_turn_metres_into_millimetres_and_scale_names_its_units():
    in_mm = read_map(SAMPLES / "ros_house.yaml", MapOptions(units="mm", tolerance=0.0))
    assert in_mm.units == "mm" and in_mm.free_space.bounds == pytest.approx((-950, -550, 3350, 2150))
    scaled = read_map(SAMPLES / "ros_house.yaml", MapOptions(scale=1000.0, tolerance=0.0))
    assert scaled.units == "mm" and scaled.free_space.equals(in_mm.free_space)
    assert scale_and_units("in", MapOptions(units="mm")) == (25.4, "mm")
    assert scale_and_units("px", MapOptions()) == (1.0, "px")
    assert scale_and_units("m", MapOptions(scale=7.0))[0] == 7.0


def test_the_origin_turns_the_map_about_its_lower_left_corner():
    levels = np.full((2, 4), 255, dtype=np.uint8)
    files = uploads(m_yaml=header(origin=[1, 2, math.pi / 2]), m_png=stored(levels))
    assert read_map("m.yaml", None, files).free_space.bounds == pytest.approx((0.8, 2.0, 1.0, 2.4))


@pytest.mark.parametrize("text", ["5e-2", "'0.05'", "5.0e-2"])
def test_numbers_are_read_as_ros_reads_them(text):
    levels = np.full((2, 4), 255, dtype=np.uint8)
    files = uploads(m_yaml=header(resolution=text, origin=f"[-1e0, {text}, 0]"), m_png=stored(levels))
    assert read_map("m.yaml", None, files).free_space.bounds == pytest.approx((-1.0, 0.05, -0.8, 0.15))


def test_units_of_unknown_length_are_refused_where_a_map_has_its_own():
    with pytest.raises(InputError, match=r"'millimeters'.*in m.*\bmm\b"):
        read_map(SAMPLES / "ros_house.yaml", MapOptions(units="millimeters"))
    assert read_map(SAMPLES / "ros_house.yaml", MapOptions(units="steps", scale=1.4)).units == "steps"
    assert read_map(SAMPLES / "image_house.png", MapOptions(units="steps")).units == "steps"


@pytest.mark.parametrize(
    ("name", "options", "unused"),
    [
        ("image_house.png", {"free": ("a",), "wall_thickness": 2.0}, "free, wall_thickness"),
        ("ros_house.yaml", {"threshold": 0.5, "invert": True}, "threshold, invert"),
        ("svg_corridor.svg", {"resolution": 0.05}, "resolution"),
    ],
)
def test_options_that_mean_nothing_to_a_map_are_named(name, options, unused):
    assert read_map(SAMPLES / name, MapOptions(**options)).notes[-1].endswith(f": {unused}.")
    assert not any("Not used" in note for note in read_map(SAMPLES / name).notes)


def test_trinary_maps_are_free_under_the_one_and_walls_over_the_other_threshold():
    row = np.array([[255, 254, 192, 191, 128, 50, 0]], dtype=np.uint8)  # occupancy 0.247 at 192
    assert states_of(row) == [True, True, True, False, False, False, False]
    assert states_of(row, negate=1) == [False, False, False, False, False, True, True]


def test_unknown_is_a_wall_unless_it_is_free():
    row = np.array([[254, 128, 0]], dtype=np.uint8)
    files = uploads(m_yaml=header(), m_png=stored(row))
    assert read_map("m.yaml", MapOptions(tolerance=0.0), files).free_space.area == pytest.approx(0.01)
    options = MapOptions(tolerance=0.0, unknown_is_free=True)
    assert read_map("m.yaml", options, files).free_space.area == pytest.approx(0.02)


def test_opacity_is_averaged_in_mode_trinary_and_unknown_in_mode_scale():
    row = np.array([[[255, 255, 255, 255], [255, 255, 255, 0], [150, 150, 150, 255]]], dtype=np.uint8)
    assert states_of(row) == [True, False, False]  # transparent white has an occupancy of 0.25
    assert states_of(row, mode="scale") == [True, False, False]
    half = np.array([[[255, 255, 255, 128], [200, 200, 200, 255]]], dtype=np.uint8)
    assert states_of(half) == [True, True]
    assert states_of(half, mode="scale") == [False, True]


def test_raw_maps_hold_the_occupancy_in_percent():
    assert states_of(np.array([[0, 25, 26, 66, 100, 101, 255]], dtype=np.uint8), mode="raw") == [
        True,
        True,
        False,
        False,
        False,
        False,
        False,
    ]


def test_grey_of_the_unseen_that_a_threshold_makes_free_is_pointed_out():
    levels = np.array([[254, 205]], dtype=np.uint8)
    files = uploads(m_yaml=header(), m_png=stored(levels))
    assert any("205" in note for note in read_map("m.yaml", None, files).notes)
    files = uploads(m_yaml=header(free_thresh=0.196), m_png=stored(levels))
    reading = read_map("m.yaml", None, files)
    assert not any("205" in note for note in reading.notes) and reading.free_space.area < 0.011


@pytest.mark.parametrize(
    "data",
    [
        b"P5 3 2 255\n" + bytes([255, 255, 255, 255, 0, 0]),
        b"P5\n# saved\n3 2\n# maxval\n100\n" + bytes([100, 100, 100, 100, 0, 0]),
        b"P5 3 2 65535\n" + np.array([65535] * 4 + [0] * 2, dtype=">u2").tobytes(),
        b"P2\n# plain\n3 2\n15\n15 15 15\n15 0 0\n",
        stored(np.array([[65535] * 3, [65535, 0, 0]], dtype=np.uint16)),
        stored(np.array([[255] * 3, [255, 0, 0]], dtype=np.uint8), format="BMP"),
        stored(np.array([[255] * 3, [255, 0, 0]], dtype=np.uint8), format="TIFF"),
    ],
)
def test_every_way_to_store_an_image_gives_the_same_map(data):
    expected = MultiPolygon([box(0, 1, 3, 2)]).union(box(0, 0, 1, 1))
    reading = read_map("m.pgm", MapOptions(tolerance=0.0), uploads(m_pgm=data))
    assert reading.free_space.equals(expected) and reading.units == "px"
    files = uploads(m_yaml=header(image="m.pgm", resolution=1), m_pgm=data)
    assert read_map("m.yaml", MapOptions(tolerance=0.0), files).free_space.equals(expected)


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "other.pgm", "m.png/../x"])
def test_uploads_are_all_that_is_read(name):
    files = uploads(m_yaml=header(image=name), m_png=stored(np.full((2, 2), 255, dtype=np.uint8)))
    with pytest.raises(InputError, match="Unknown file"):
        read_map("m.yaml", None, files)


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"", "image"),
        (b"- 1\n- 2\n", "image"),
        (b"image: [", "YAML"),
        (b"\xff\xfe\x00\x01\x02", "YAML"),
        (b"[" * 5000, "YAML"),
        (b"a: &a [x]\n" * 20000, "YAML file"),
        (b"image: 2020-99-99", "YAML"),
        (b"image: !!python/object/apply:os.getcwd []", "YAML"),
        (header(image=None), "'image'"),
        (header(image=7), "'image'"),
        (header(image="''"), "'image'"),
        (header(resolution=None), "'resolution'"),
        (header(resolution=0), "positive"),
        (header(resolution=".nan"), "'resolution'"),
        (header(resolution=".inf"), "'resolution'"),
        (header(resolution="1" + 400 * "0"), "'resolution'"),
        (header(origin=[0, 0]), "three numbers"),
        (header(origin="[0, x, 0]"), "three numbers"),
        (header(origin=3), "three numbers"),
        (header(negate="perhaps"), "'negate'"),
        (header(mode="fancy"), "trinary, scale, raw"),
        (header(mode="[raw]"), "Unknown mode"),
        (header(free_thresh=0.9), "at most occupied_thresh"),
        (header(occupied_thresh=True), "'occupied_thresh'"),
    ],
)
def test_a_broken_header_is_refused_in_a_sentence(data, complaint):
    files = uploads(m_yaml=data, m_png=stored(np.full((2, 2), 255, dtype=np.uint8)))
    with pytest.raises(InputError, match=complaint) as refused:
        read_map("m.yaml", None, files)
    assert len(str(refused.value)) < 300


# Images


def test_bright_pixels_are_free_or_dark_ones_if_inverted():
    files = uploads(m_png=stored(np.array([[255, 192, 191, 10]], dtype=np.uint8)))
    read = {
        key: read_map("m.png", options, files)
        for key, options in {
            "bright": MapOptions(tolerance=0.0),
            "brighter": MapOptions(threshold=0.9, tolerance=0.0),
            "dark": MapOptions(invert=True, tolerance=0.0),
        }.items()
    }
    assert [round(read[key].free_space.area) for key in read] == [2, 1, 1]
    assert read["dark"].free_space.bounds == (3.0, 0.0, 4.0, 1.0)


def test_transparent_pixels_are_as_white_as_paper():
    ink = np.array([[[0, 0, 0, 0], [0, 0, 0, 255], [0, 0, 0, 40]]], dtype=np.uint8)
    reading = read_map("m.png", MapOptions(tolerance=0.0), uploads(m_png=stored(ink)))
    assert reading.free_space.equals(MultiPolygon([box(0, 0, 1, 1), box(2, 0, 3, 1)]))
    assert any("Transparent" in note for note in reading.notes)


def test_resolution_and_scale_multiply_and_units_name_the_result():
    files = uploads(m_png=stored(np.full((2, 3), 255, dtype=np.uint8)))
    reading = read_map("m.png", MapOptions(resolution=0.5, scale=10.0, units="mm"), files)
    assert reading.free_space.bounds == (0.0, 0.0, 15.0, 10.0) and reading.units == "mm"
    assert reading.tolerance == image.TOLERANCE * 5.0


def test_small_islands_are_left_out_and_counted_but_never_all_of_them():
    free = np.zeros((20, 20), dtype=np.uint8)
    free[2:12, 2:12] = 255
    free[15, 15] = free[17, 3] = 255
    reading = read_map("m.png", None, uploads(m_png=stored(free)))
    assert reading.free_space.equals(box(2, 8, 12, 18)) and any("2 islands" in note for note in reading.notes)
    free[2:12, 2:12] = 0
    assert read_map("m.png", MapOptions(tolerance=0.0), uploads(m_png=stored(free))).free_space.area == 2.0


def huge_png(width, height):
    """Return a PNG whose header promises many pixels."""
    data = bytearray(stored(np.zeros((1, 1), dtype=np.uint8)))
    data[16:24] = width.to_bytes(4, "big") + height.to_bytes(4, "big")
    import zlib

    data[29:33] = zlib.crc32(bytes(data[12:29])).to_bytes(4, "big")
    return bytes(data)


@pytest.mark.parametrize(
    ("data", "complaint"),
    [
        (b"", "Expected an image"),
        (b"no image", "Expected an image"),
        (b"%PDF-1.4 ...", "Expected an image"),
        (stored(np.full((50, 50), 255, dtype=np.uint8))[:60], "damaged|Expected an image"),
        (b"P5 10 10 255\n12", "damaged"),
        (b"P5 -3 2 255\n", "damaged|Expected an image"),
        (b"P2 2 2 255\n1 2 x 4", "damaged"),
        (huge_png(60000, 60000), "64,000,000"),
        (huge_png(8001, 8000), "64,000,000"),
        (stored(np.zeros((4, 4), dtype=np.uint8)), "free pixels"),
        (stored(np.zeros((4, 4), dtype=np.float32), format="TIFF"), "whole numbers"),
    ],
)
def test_a_broken_image_is_refused_in_a_sentence(data, complaint):
    with pytest.raises(InputError, match=complaint):
        read_map("m.png", None, uploads(m_png=data))


@given(st.binary(max_size=40), st.integers(0, 200), st.integers(0, 40))
@settings(max_examples=150)
def test_any_bytes_are_read_or_refused_in_a_sentence(junk, place, length):
    levels = np.array([[255, 0, 255]] * 3, dtype=np.uint8)
    for whole in (stored(levels), stored(levels, format="GIF"), b"P2\n3 1\n255\n255 0 255\n", header()):
        data = whole[:place] + junk + whole[place + length :]
        for name, files in (
            ("m.png", uploads(m_png=data)),
            ("m.yaml", uploads(m_yaml=data, m_png=stored(levels))),
        ):
            try:
                assert read_map(name, None, files).free_space.area > 0.0
            except InputError as error:
                assert str(error)


def test_too_many_vertices_are_refused_with_what_helps(monkeypatch):
    monkeypatch.setattr(image, "MAX_VERTICES", 100)
    levels = np.where(np.random.default_rng(0).random((60, 60)) < 0.1, 0, 255).astype(np.uint8)
    with pytest.raises(InputError, match="median"):
        read_map("m.png", None, uploads(m_png=stored(levels)))


def test_an_unknown_kind_of_map_and_a_missing_file_are_named(tmp_path):
    with pytest.raises(InputError, match=r"plan\.pdf.*\.svg"):
        read_map("plan.pdf")
    with pytest.raises(InputError, match="there is none"):
        read_map(tmp_path / "none.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match="folder or a device"):
        read_map(tmp_path / "folder.png")
    (tmp_path / "m.yaml").write_bytes(header(image=r'"a\0b"'))
    with pytest.raises(InputError, match="name of a file"):
        read_map(tmp_path / "m.yaml")


@pytest.mark.image
def test_the_picture_shows_what_was_understood(tmp_path):
    reading = read_map(SAMPLES / "image_house.png")
    maze = reading.maze(base_pose=(8.0, 10.0, math.pi / 2), goal=(85.0, 55.0))
    for k, drawn_maze in enumerate((None, maze)):
        draw_reading(reading, tmp_path / f"{k}.png", drawn_maze)
    plain, marked = (np.asarray(Image.open(tmp_path / f"{k}.png").convert("RGB"), dtype=int) for k in (0, 1))
    assert plain.shape == marked.shape and min(plain.shape[:2]) > 400
    green = marked[..., 1] - marked[..., 0] > 40
    assert green.sum() > 50 and (plain[..., 1] - plain[..., 0] > 40).sum() == 0
