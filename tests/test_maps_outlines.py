"""Maps from SVG, DXF and GeoJSON outlines: what is free, and that nothing ever becomes free."""

import io
import json
import math
import sys
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely
import svgelements
from ezdxf.math import BSpline as LibrarySpline
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon, box

from hrsnake_env.errors import InputError
from hrsnake_env.maps.drawing import Drawing, Outline, Stroke
from hrsnake_env.maps.dxf import read_dxf
from hrsnake_env.maps.flatten import Arc, Bezier, Line, flattened, spline_pieces
from hrsnake_env.maps.geojson import read_geojson
from hrsnake_env.maps.outlines import read_outlines
from hrsnake_env.maps.reading import MapOptions, MapReading, files_beside
from hrsnake_env.maps.svg import read_svg
from hrsnake_env.maze import MAZES, Maze

SAMPLES = Path(__file__).parent / "maps"
READERS = {"svg": read_svg, "dxf": read_dxf, "geojson": read_geojson}
ROUNDING = 1e-9  # of a drawing's size: coordinates are sums of a few products of doubles


def reading_of(kind: str, data: bytes | str, **options: object) -> MapReading:
    raw = data.encode() if isinstance(data, str) else data
    return READERS[kind]("map.file", lambda name: raw, MapOptions(**options))


def sample(kind: str, **options: object) -> MapReading:
    return READERS[kind](f"{kind}_corridor.{kind}", files_beside(SAMPLES / "x"), MapOptions(**options))


def svg(body: str, page: str = 'viewBox="0 0 200 100"') -> str:
    return f'<svg xmlns="http://www.w3.org/2000/svg" {page}>{body}</svg>'


def dxf(draw, **new: object) -> bytes:
    document = ezdxf.new(**new)
    draw(document.modelspace())
    text = io.StringIO()
    document.write(text)
    return text.getvalue().encode()


def features(*items: tuple[dict, dict], **top: object) -> str:
    listed = [{"type": "Feature", "properties": own, "geometry": geometry} for own, geometry in items]
    return json.dumps({"type": "FeatureCollection", "features": listed, **top})


def rings(*areas: Polygon, layers: tuple[str, ...] = (), **options: object) -> MapReading:
    """Read straight closed outlines."""
    outlines = [
        Outline(
            strokes=(Stroke(pieces=(Line(points=np.array(area.exterior.coords)),), closed=True),),
            layer=layer,
            names=(layer,),
        )
        for area, layer in zip(areas, layers or [""] * len(areas), strict=True)
    ]
    return read_outlines(Drawing(name="map", outlines=outlines), MapOptions(**options))


def same_area(a: Polygon, b: Polygon, slack: float = ROUNDING) -> bool:
    return a.symmetric_difference(b).area <= slack * max(a.length, b.length)


# The same corridor in three formats

WALLS = [(10, 10), (10, 290), (390, 290), (390, 30), (230, 20), (230, 190), (150, 190), (150, 10)]
TRIANGLE = [(60, 240), (90, 235), (70, 215)]


@pytest.mark.parametrize("kind", READERS)
def test_one_corridor_is_the_same_maze_in_every_format(kind: str) -> None:
    reading = sample(kind, units="mm")
    pillar = Point(310, 190).buffer(25, quad_segs=4096)
    true = Polygon(WALLS, [TRIANGLE]).difference(pillar if kind != "geojson" else Polygon())
    maze = reading.maze()
    assert maze.units == "mm"
    assert shapely.hausdorff_distance(maze.free_space.boundary, true.boundary) <= reading.tolerance
    assert maze.free_space.difference(true).area <= 1e-6  # the true pillar is itself cut into 16,384 chords
    assert reading.moved <= reading.tolerance
    np.testing.assert_allclose(maze.base_pose, [80, 20, math.pi / 2], atol=1e-9)
    np.testing.assert_allclose(maze.goal, [310, 70], atol=1e-9)
    assert maze.goal_radius == pytest.approx(12)


@pytest.mark.parametrize("name", ["fig19", "fig17c"])
def test_a_maze_file_is_read_exactly(name: str) -> None:
    maze = MAZES[name]()
    back = reading_of("geojson", json.dumps(maze.to_geojson())).maze()
    assert back.to_geojson() == maze.to_geojson()


def test_a_maze_file_is_scaled_as_asked() -> None:
    data = json.dumps(Maze.from_corridors([(0, 0), (0, 9)], 2.0, units="m").to_geojson())
    reading = reading_of("geojson", data, units="mm")
    assert reading.free_space.bounds == (-1000, 0, 1000, 9000)
    assert (reading.units, reading.goal_radius) == ("mm", 250.0)


def test_a_maze_file_with_named_layers_is_read_as_outlines() -> None:
    maze = MAZES["fig19"]()
    reading = reading_of("geojson", json.dumps(maze.to_geojson()), free=("free",), ignore=("goal",))
    assert same_area(reading.free_space, maze.free_space)
    assert reading.goal is None


# Curves


def outside(region: Polygon, curve: np.ndarray) -> bool:
    """Tell whether no point of a wall is inside a region."""
    inner = region.buffer(-ROUNDING * region.length)
    return not shapely.contains_properly(inner, shapely.points(curve)).any()


def along(piece: Arc | Bezier, n: int = 2000) -> np.ndarray:
    """Return points of a piece by its own formula."""
    t = np.linspace(0.0, 1.0, n)
    if isinstance(piece, Arc):
        return piece.at(piece.start + piece.sweep * t)
    degree = len(piece.control) - 1
    basis = np.stack([math.comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)])
    weights = np.ones(degree + 1) if piece.weights is None else piece.weights
    return (basis.T @ (piece.control * weights[:, None])) / (basis.T @ weights)[:, None]


coordinates = st.integers(-10_000, 10_000).map(lambda thousandths: thousandths / 1000)
places = st.tuples(coordinates, coordinates)
beziers = st.lists(places, min_size=3, max_size=6).flatmap(
    lambda points: st.builds(
        lambda weights: Bezier(control=np.array(points), weights=np.array(weights)),
        st.lists(st.floats(0.1, 10), min_size=len(points), max_size=len(points)),
    )
)
arcs = st.builds(
    lambda centre, major, minor, start, sweep: Arc(
        centre=np.array(centre), major=np.array(major), minor=np.array(minor), start=start, sweep=sweep
    ),
    *(places, places, places),
    st.floats(-7, 7),
    st.floats(-2 * math.pi, 2 * math.pi),
)


@given(piece=st.one_of(arcs, beziers), tolerance=st.floats(1e-4, 3.0))
@settings(max_examples=60)
def test_guards_hold_the_curve_and_are_no_wider_than_the_tolerance(piece, tolerance: float) -> None:
    trace = flattened([piece], tolerance)
    held = shapely.union_all(shapely.buffer(trace.guards, 1e-9))
    assert shapely.covers(held, shapely.points(along(piece))).all()
    assert trace.deviation <= tolerance
    chords = [LineString(pair) for pair in zip(trace.points[:-1], trace.points[1:], strict=True)]
    if len(chords) == len(trace.guards):  # chords of no length are left out
        reach = [shapely.hausdorff_distance(*pair) for pair in zip(trace.guards, chords, strict=True)]
        assert max(reach) <= tolerance + 1e-9


@given(controls=st.lists(places, min_size=3, max_size=7, unique=True), free=st.booleans())
@settings(max_examples=25)
def test_free_space_never_grows_over_a_curved_wall(controls: list, free: bool) -> None:
    """A closed curve of quadratic pieces, as a room or as a pillar, crossing itself or not."""
    points = np.array(controls)
    middles = 0.5 * (points + np.roll(points, -1, axis=0))
    pieces = [Bezier(control=np.stack([middles[i - 1], points[i], middles[i]])) for i in range(len(points))]
    curve = np.concatenate([along(piece, 300) for piece in pieces])
    room = Outline(strokes=(Stroke(pieces=tuple(pieces), closed=True),))
    frame = Line(points=np.array(box(-20, -20, 20, 20).exterior.coords))
    hall = Outline(strokes=(Stroke(pieces=(frame,), closed=True),))
    true = shapely.make_valid(Polygon(curve), method="linework")
    if not free:
        solid = shapely.union_all([Polygon(part.exterior) for part in shapely.get_parts(true.buffer(1e-9))])
        true = box(-20, -20, 20, 20).difference(solid)
    drawing = Drawing(name="map", outlines=[room] if free else [hall, room])
    if free and true.buffer(-0.05).is_empty:
        return
    reading = read_outlines(drawing, MapOptions(tolerance=0.05))
    assert reading.moved <= reading.tolerance
    # Sampled curves are up to 1e-4 off their formula, and 100 long.
    assert reading.free_space.difference(true).area < 1e-2
    lost = true.difference(reading.free_space)
    assert lost.difference(LineString(curve).buffer(0.051)).area < 1e-2


@pytest.mark.parametrize("tolerance", [None, 0.5, 0.0])
def test_straight_walls_stay_where_they_are_beside_curves(tolerance: float | None) -> None:
    body = '<path d="M0 0H100A50 50 0 0 1 100 100H0Z"/><circle cx="50" cy="50" r="20"/>'
    reading = reading_of("svg", svg(body), tolerance=tolerance)
    true = box(0, 0, 100, 100).union(Point(100, 50).buffer(50, quad_segs=2000))
    true = true.difference(Point(50, 50).buffer(20, quad_segs=2000))
    assert reading.free_space.difference(true).area < 1e-2
    assert shapely.hausdorff_distance(reading.free_space.boundary, true.boundary) <= reading.tolerance + 1e-4
    straight = (
        LineString([(0, 0), (100, 0)]),
        LineString([(0, 0), (0, 100)]),
        LineString([(0, 100), (100, 100)]),
    )
    assert all(reading.free_space.boundary.buffer(1e-9).covers(line) for line in straight)
    corners = shapely.get_num_coordinates(reading.free_space)
    assert corners <= {None: 300, 0.5: 80, 0.0: 400}[tolerance]


@pytest.mark.parametrize("weights", [None, [1.0, 3.0, 0.5, 2.0, 1.0, 1.0]])
@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_splines_are_those_of_another_library(degree: int, weights: list[float] | None) -> None:
    control = [(0, 0, 0), (1, 2, 0), (3, 3, 0), (4, -1, 0), (6, 0, 0), (7, 2, 0)]
    tool = LibrarySpline(control, order=degree + 1, weights=weights)
    pieces = spline_pieces(tool.knots(), np.array(control)[:, :2], degree, weights)
    curve = LineString(np.concatenate([along(piece, 400) for piece in pieces]))
    theirs = [Point(point.x, point.y) for point in tool.approximate(100)]
    assert max(curve.distance(point) for point in theirs) < 1e-4
    assert curve.hausdorff_distance(LineString(theirs)) < 0.05


# What is what


def test_depth_of_outlines_alternates_between_free_space_and_obstacles() -> None:
    plan = [box(i, i, 20 - i, 20 - i) for i in range(0, 8, 2)]
    reading = rings(*plan)
    expected = plan[0].difference(plan[1]).union(plan[2].difference(plan[3]))
    assert same_area(reading.free_space, expected)
    assert [part.area for part in reading.parts] == sorted(
        (part.area for part in reading.parts), reverse=True
    )


@given(seed=st.integers(0, 10_000), n=st.integers(1, 8))
@settings(max_examples=40)
def test_free_space_is_in_the_room_and_in_no_pillar(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    pillars = [box(x, y, x + a, y + b) for x, y, a, b in rng.uniform((1, 1, 0.1, 0.1), (8, 8, 4, 4), (n, 4))]
    reading = rings(box(0, 0, 10, 10), *pillars, tolerance=0.0)
    islands = {
        i
        for i, one in enumerate(pillars)
        if any(other is not one and other.buffer(1e-4).contains(one) for other in pillars)
    }
    for i, pillar in enumerate(pillars):
        if not islands:
            assert reading.free_space.intersection(pillar).area < 1e-9, i
    assert box(0, 0, 10, 10).covers(reading.free_space)


def test_an_outline_drawn_twice_counts_once() -> None:
    room, near = box(0, 0, 10, 10), box(1e-9, 0, 10, 10 - 1e-9)
    reading = rings(room, room, near, box(2, 2, 3, 3), box(2, 2, 3, 3))
    assert reading.free_space.area == pytest.approx(99, abs=1e-6)
    assert any("drawn twice" in note for note in reading.notes)


def test_what_crosses_a_larger_outline_is_an_obstacle() -> None:
    reading = rings(box(0, 0, 10, 10), box(8, 4, 12, 6))
    assert same_area(reading.free_space, box(0, 0, 10, 10).difference(box(8, 4, 10, 6)))
    assert any("crossing" in note for note in reading.notes)


@pytest.mark.parametrize("tolerance", [0.0, 1.0, 5.0])
def test_no_wall_is_lost_that_is_thinner_than_the_tolerance(tolerance: float) -> None:
    room, pillar = box(0, 0, 200, 200), box(80, 80, 120, 120)
    walls = [
        pillar,
        box(100, 99, 180, 101),
        box(90, 40, 91, 100),
        box(40, 60, 180, 60.5),
        box(-5, 30, 99, 32),
    ]
    walls += [box(41, 60.1, 170, 60.6), box(98, 70, 99, 119)]  # twice, all but; and a room in the pillar
    for order in (1, -1):
        free = rings(*[room, *walls][::order], tolerance=tolerance).free_space
        hall = max(shapely.get_parts(free), key=lambda part: part.area)
        assert max(hall.intersection(wall).area for wall in walls) < 1e-9
        assert hall.area > 0.9 * room.difference(shapely.union_all(walls)).area


@settings(max_examples=25)
@given(
    st.lists(st.tuples(*[st.floats(5, 190)] * 2, *[st.floats(0.05, 60)] * 2), min_size=2, max_size=6),
    st.sampled_from([0.0, 0.3, 3.0]),
)
def test_what_a_drawing_has_as_obstacles_is_free_nowhere(sizes: list, tolerance: float) -> None:
    obstacles = [box(x, y, min(x + wide, 195), min(y + high, 195)) for x, y, wide, high in sizes]
    free = rings(box(0, 0, 200, 200), *obstacles, tolerance=tolerance).free_space
    hall = max(shapely.get_parts(free), key=lambda part: box(*part.bounds).area)
    assert max(hall.intersection(wall).area for wall in obstacles) < 1e-6


def test_rooms_that_share_a_wall_stay_apart() -> None:
    reading = rings(box(0, 0, 5, 10), box(5, 0, 10, 10), box(2, 2, 3, 3))
    assert len(reading.parts) == 2
    assert reading.free_space.area == pytest.approx(99, abs=0.05)


def test_areas_named_free_are_joined() -> None:
    reading = rings(box(0, 0, 6, 2), box(4, 0, 6, 9), layers=("free", "free"))
    assert same_area(reading.free_space, box(0, 0, 6, 2).union(box(4, 0, 6, 9)))


def test_a_scribble_is_refused() -> None:
    with pytest.raises(InputError, match="scribble"):
        rings(Polygon(np.random.default_rng(1).uniform(0, 1, (2000, 2))))


def test_a_bow_tie_is_free_in_both_halves_and_solid_in_all_of_it() -> None:
    star = [(5 + 3 * math.cos(0.8 * math.pi * k), 5 + 3 * math.sin(0.8 * math.pi * k)) for k in range(5)]
    room = rings(Polygon(star))
    hall = rings(box(0, 0, 10, 10), Polygon(star))
    middle = Point(5, 5)
    assert not room.free_space.contains(middle)
    assert not hall.free_space.contains(middle)
    assert hall.free_space.area < 100 - room.free_space.area


@pytest.mark.parametrize("by", ["walls", "WALLS ", "#FF0000", "red", "#f00"])
def test_roles_go_by_name_or_colour_in_any_spelling(by: str) -> None:
    body = (
        '<rect id="room" width="100" height="50" fill="none" stroke="blue"/>'
        '<g id="walls"><rect x="40" y="20" width="10" height="10" fill="red"/></g>'
    )
    reading = reading_of("svg", svg(body), free=("room",), walls=(by,))
    assert reading.free_space.area == pytest.approx(4900)
    reading = reading_of("svg", svg(body), free=("#0000ff",))
    assert reading.free_space.area == pytest.approx(4900)
    reading = reading_of("svg", svg(body), ignore=(by,))
    assert reading.free_space.area == pytest.approx(5000)


def test_an_option_for_what_is_free_leaves_out_what_nobody_named() -> None:
    reading = rings(box(0, 0, 9, 9), box(2, 2, 3, 3), layers=("ROOM", "CHAIRS"), free=("room",))
    assert reading.free_space.area == pytest.approx(81)
    assert dict(reading.layers) == {"ROOM": "free", "CHAIRS": "ignored"}


def test_an_unnamed_outline_is_an_obstacle_or_around_everything() -> None:
    reading = rings(box(0, 0, 9, 9), box(2, 2, 3, 3), box(-1, -1, 10, 10), layers=("free", "x", "frame"))
    assert reading.free_space.area == pytest.approx(80)


def test_unknown_layers_are_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"Unknown layer or colour 'flur'\. Available: A-WALL, room\."):
        rings(box(0, 0, 9, 9), box(2, 2, 3, 3), layers=("room", "A-WALL"), free=("flur",))


# Lines


@given(seed=st.integers(0, 10_000), noise=st.sampled_from([0.0, 1e-6]))
@settings(max_examples=20)
def test_lines_in_any_order_and_direction_are_one_room(seed: int, noise: float) -> None:
    rng = np.random.default_rng(seed)
    ends = list(zip(WALLS, [*WALLS[1:], WALLS[0]], strict=True))
    lines = [np.array(ends[i][:: rng.choice([1, -1])], dtype=float) for i in rng.permutation(len(ends))]
    outlines = [
        Outline(strokes=(Stroke(pieces=(Line(points=line + rng.normal(0, 1, (2, 2)) * noise),)),))
        for line in [*lines, lines[0]]
    ]
    reading = read_outlines(Drawing(name="map", outlines=outlines), MapOptions())
    assert same_area(reading.free_space, Polygon(WALLS), 10 * noise + ROUNDING)


def test_rooms_of_lines_with_a_wall_in_common_stay_apart() -> None:
    lines = [(0, 0, 5, 0), (5, 0, 9, 0), (9, 0, 9, 4), (9, 4, 5, 4), (5, 4, 0, 4), (0, 4, 0, 0), (5, 0, 5, 4)]
    body = "".join('<line x1="{}" y1="{}" x2="{}" y2="{}"/>'.format(*line) for line in lines)
    reading = reading_of("svg", svg(body))
    assert [round(part.area) for part in reading.parts] == [20, 16]


@pytest.mark.parametrize(("thickness", "area"), [(0.0, 100.0), (1.0, 95.0)])
def test_an_open_line_is_a_wall_if_it_has_a_thickness(thickness: float, area: float) -> None:
    body = '<rect width="10" height="10" fill="none"/><polyline points="5,0 5,5" fill="none"/>'
    reading = reading_of("svg", svg(body), wall_thickness=thickness)
    assert reading.free_space.area == pytest.approx(area)
    assert (thickness == 0.0) == any("1 open line of" in note for note in reading.notes)


def test_thick_lines_enclose_rooms() -> None:
    body = '<path d="M0 0H10" fill="none"/><path d="M-.5 9H10.5M.5 -1V10M9.5 -1V10" fill="none"/>'
    reading = reading_of("svg", svg(body), wall_thickness=1.0)
    assert same_area(reading.free_space, box(1, 91.5, 9, 99.5))


def test_a_gap_is_closed_up_to_the_tolerance_alone() -> None:
    body = '<path d="M0 0H10V10H0V.1" fill="none" stroke="black"/>'
    assert reading_of("svg", svg(body), tolerance=0.2).free_space.area == pytest.approx(100, abs=4)
    with pytest.raises(InputError, match="0 closed and 1 open lines"):
        reading_of("svg", svg(body), tolerance=0.05)


# Base and goal


@pytest.mark.parametrize(
    ("mark", "heading"),
    [
        ('<line x1="10" y1="50" x2="30" y2="50"/>', 0.0),
        ('<path d="M10 50V30" fill="none"/>', math.pi / 2),
        ('<circle cx="10" cy="50" r="2"/><line x1="12" y1="50" x2="20" y2="50"/>', 0.0),
        ('<circle cx="10" cy="50" r="2"/>', 0.0),
        ('<path d="M10 50H30M27 48L30 50L27 52" fill="none"/>', 0.0),
    ],
)
def test_a_base_is_an_arrow_or_a_place(mark: str, heading: float) -> None:
    reading = reading_of("svg", svg(f'<rect width="200" height="100"/><g id="base">{mark}</g>'))
    assert reading.base_pose is not None
    np.testing.assert_allclose(reading.base_pose[:2], [10, 50], atol=1e-9)
    assert reading.base_pose[2] == pytest.approx(heading, abs=0.7 if "circle" in mark else 1e-9)


@pytest.mark.parametrize(
    ("mark", "radius"),
    [
        ('<circle cx="50" cy="50" r="5"/>', 5.0),
        ('<rect x="45" y="47" width="10" height="6"/>', 3.0),
        ('<path d="M45 45L55 55M45 55L55 45" fill="none"/>', None),
    ],
)
def test_a_goal_is_a_circle_a_shape_or_a_cross(mark: str, radius: float | None) -> None:
    reading = reading_of("svg", svg(f'<rect width="200" height="100"/><g id="goal">{mark}</g>'))
    np.testing.assert_allclose(reading.goal, [50, 50], atol=1e-9)
    assert reading.goal_radius == (None if radius is None else pytest.approx(radius))


def test_two_bases_are_left_to_the_reader() -> None:
    marks = '<g id="base"><circle cx="10" cy="50" r="2"/><circle cx="30" cy="50" r="2"/></g>'
    reading = reading_of("svg", svg(f'<rect width="200" height="100"/>{marks}'))
    assert reading.base_pose is None
    assert any("one base, got 2" in note for note in reading.notes)


# SVG


@pytest.mark.parametrize(
    ("page", "scale", "units"),
    [
        ('width="200mm" height="100mm" viewBox="0 0 200 100"', 1.0, "mm"),
        ('width="8in" height="4in" viewBox="0 0 200 100"', 8 * 25.4 / 200, "mm"),
        ('width="20cm" height="10cm"', 25.4 / 96, "mm"),
        ('width="400" height="200px" viewBox="0 0 200 100"', 1.0, "px"),
        ('viewBox="0 0 200 100"', 1.0, "px"),
        ("", 1.0, "px"),
        ('width="100%" height="100%" viewBox="0 0 200 100"', 1.0, "px"),
    ],
)
def test_lengths_are_those_of_the_page(page: str, scale: float, units: str) -> None:
    reading = reading_of("svg", svg('<rect x="10" y="20" width="100" height="50"/>', page))
    x_min, y_min, x_max, y_max = reading.free_space.bounds
    assert (x_max - x_min, y_max - y_min, x_min) == pytest.approx(
        (100 * scale, 50 * scale, 10 * scale), rel=1e-12
    )
    assert reading.units == units
    if "viewBox" in page:
        assert y_min == pytest.approx(30 * scale)


def test_shapes_are_those_of_another_library_under_any_transform() -> None:
    body = (
        '<g transform="translate(3 4) rotate(20)"><path transform="skewX(30) scale(2 1)" '
        'd="M10 10C20 0 30 40 40 10S60 30 60 10Q50 -10 40 0T20 0A15 8 30 1 0 10 10Z"/></g>'
    )
    reading = reading_of("svg", svg(body), tolerance=1e-3)
    document = svgelements.SVG.parse(io.StringIO(svg(body)), reify=False)
    path = next(document.select(lambda element: isinstance(element, svgelements.Path)))
    curve = []
    for piece in path.segments(transformed=False):
        for t in np.linspace(0, 1, 300) if not isinstance(piece, svgelements.Move) else ():
            point = path.transform.point_in_matrix_space(piece.point(t))
            curve.append((point.x, 100 - point.y))
    assert outside(reading.free_space, np.array(curve))
    true = shapely.make_valid(Polygon(curve), method="linework")
    assert true.symmetric_difference(reading.free_space).area < 2e-3 * true.length + 0.5 * true.length * 2e-3


def test_what_is_not_displayed_is_not_there_and_uses_are() -> None:
    body = (
        '<defs><rect id="pillar" width="10" height="10"/></defs><rect width="200" height="100"/>'
        '<use href="#pillar" x="20" y="20"/><use href="#pillar" transform="translate(50 20) scale(2)"/>'
        '<symbol id="s"><rect x="70" y="70" width="5" height="5"/></symbol>'
        '<rect x="100" width="10" height="10" visibility="hidden"/><image href="file:///etc/passwd"/>'
        '<g style="display: none"><rect x="5" y="5" width="9" height="9"/></g>'
        '<marker id="m"><path d="M0 0L9 0L9 9Z"/></marker><clipPath id="c"><circle r="50"/></clipPath>'
    )
    reading = reading_of("svg", svg(body))
    assert reading.free_space.area == pytest.approx(20_000 - 100 - 400)
    assert any("1 image" in note and "2 hidden elements" in note for note in reading.notes)


BOMB = '<!DOCTYPE svg [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><svg xmlns="http://www.w3.org/2000/svg">&b;</svg>'
XXE = '<!DOCTYPE svg [<!ENTITY x SYSTEM "file:///etc/passwd">]><svg xmlns="http://www.w3.org/2000/svg">&x;</svg>'
USES = "".join(
    f'<g id="g{i}"><use href="#g{i - 1}"/><use href="#g{i - 1}"/></g>' if i else '<rect id="g0" width="1"/>'
    for i in range(40)
)

BROKEN_SVG = [
    (b"", "broken XML"),
    (b"\xff\xfe\x00", "broken XML"),
    ("<svg", "broken XML"),
    ("<html/>", "got <html>"),
    (BOMB, "entities"),
    (XXE, "entities"),
    (svg(USES), "by its uses"),
    (svg('<g id="a"><use href="#a"/></g>'), "uses itself"),
    (svg("<g>" * 500 + "</g>" * 500), "deep"),
    (svg(""), "Expected outlines"),
    (svg('<path d="M0 0L"/>'), "Expected"),
    (svg('<path d="hello"/>'), "Expected shapes"),
    (svg('<rect width="x" height="5"/>'), "Expected"),
    (svg('<path d="M0 0H5" fill="none"/>'), "0 closed and 1 open lines"),
    (svg('<rect width="5" height="5"/>', 'width="0mm" height="5mm"'), "page with an area"),
    (svg('<rect width="1e400" height="5"/>'), "Expected"),
    (b"\x1f\x8b\x00", "compressed"),
]


@pytest.mark.parametrize(("data", "message"), BROKEN_SVG)
def test_broken_svg_is_refused_in_a_sentence(data: bytes | str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading_of("svg", data)


# DXF


@pytest.mark.parametrize("form", ["R12", "R2000", "R2018", "binary"])
def test_every_entity_is_drawn_in_every_version(form: str) -> None:
    document = ezdxf.new("R2010" if form == "binary" else form)
    space = document.modelspace()
    space.add_polyline2d([(0, 0), (90, 0), (90, 60), (0, 60)], close=True)
    space.add_circle((10, 10), 5)
    space.add_arc((30, 10), 5, 0, 180)
    space.add_line((25, 10), (35, 10))
    space.add_polyline2d([(45, 10, 1), (55, 10, 0)], format="xyb", close=True)
    space.add_solid([(65, 5), (75, 5), (65, 15), (75, 15)])
    expected = 5400 - math.pi * 25 * 2 - 100
    if form != "R12":
        space.add_ellipse((10, 30), (5, 0), 0.5)
        space.add_lwpolyline([(30, 30), (40, 30), (40, 40)], close=True)
        space.add_spline(degree=2).set_open_uniform([(0, 0, 0), (1, 1, 0), (2, 0, 0)], degree=2)
        expected -= math.pi * 12.5 + 50
    stream = io.BytesIO() if form == "binary" else io.StringIO()
    document.write(stream, fmt="bin" if form == "binary" else "asc")
    data = stream.getvalue()
    reading = reading_of("dxf", data)
    assert reading.free_space.area == pytest.approx(expected, abs=100 * reading.tolerance)
    assert reading.free_space.area < expected


def test_blocks_are_placed_turned_and_scaled_as_the_library_does() -> None:
    document = ezdxf.new()
    inner = document.blocks.new("INNER")
    inner.add_circle((1, 0), 1)
    inner.add_lwpolyline([(3, 0, 1), (4, 0, 0.3)], format="xyb", close=True)
    outer = document.blocks.new("OUTER")
    outer.add_blockref("INNER", (2, 2), dxfattribs={"rotation": 30, "xscale": 2, "yscale": -0.5})
    document.layers.add("PILLARS")
    space = document.modelspace()
    space.add_lwpolyline([(-50, -50), (50, -50), (50, 50), (-50, 50)], close=True)
    space.add_blockref("OUTER", (-9, 4), dxfattribs={"rotation": -50, "xscale": 1.5, "layer": "PILLARS"})
    text = io.StringIO()
    document.write(text)
    reading = reading_of("dxf", text.getvalue(), tolerance=0.01)
    assert reading.layers["PILLARS"] == "walls"
    walls = []
    for middle in space.query("INSERT")[0].virtual_entities():
        for entity in middle.virtual_entities():
            walls += [(p.x, p.y) for p in ezdxf.path.make_path(entity).flattening(1e-4)]
    # The library makes cubic curves of arcs, which are 3e-4 radii off.
    assert outside(reading.free_space.buffer(-2e-3), np.array(walls))
    assert len(reading.free_space.interiors) == 2
    holes = shapely.union_all([Polygon(hole) for hole in reading.free_space.interiors])
    assert shapely.distance(holes, shapely.points(walls)).max() < 1e-3


@pytest.mark.parametrize(
    ("code", "factor"), [(1, 25.4), (2, 304.8), (4, 1.0), (5, 10.0), (6, 1000.0), (10, 914.4)]
)
def test_units_are_turned_into_each_other(code: int, factor: float) -> None:
    document = ezdxf.new(units=code)
    document.modelspace().add_lwpolyline([(0, 0), (1, 0), (1, 2), (0, 2)], close=True)
    text = io.StringIO()
    document.write(text)
    assert reading_of("dxf", text.getvalue(), units="mm").free_space.bounds == pytest.approx(
        (0, 0, factor, 2 * factor)
    )
    assert reading_of("dxf", text.getvalue(), scale=3.0).free_space.bounds == pytest.approx((0, 0, 3, 6))


def test_hidden_layers_and_unknown_entities_are_left_out_and_said() -> None:
    def draw(space) -> None:
        layers = space.doc.layers
        layers.add("OFF").off()
        layers.add("FROZEN").freeze()
        space.add_lwpolyline([(0, 0), (9, 0), (9, 9), (0, 9)], close=True)
        for layer in ("OFF", "FROZEN"):
            space.add_circle((4, 4), 2, dxfattribs={"layer": layer})
        space.add_text("hall")
        space.add_mtext("hall")
        hatch = space.add_hatch()
        hatch.paths.add_polyline_path([(1, 1), (2, 1), (2, 2)])

    reading = reading_of("dxf", dxf(draw))
    assert reading.free_space.area == pytest.approx(81)
    said = " ".join(reading.notes)
    assert "1 MTEXT, 1 TEXT" in said and "2 entities" in said and "1 hatch" in said


@pytest.mark.parametrize(("state", "obstacles"), [("on", 3), ("off", 1), ("freeze", 0)])
def test_a_block_shows_as_its_layers_and_that_of_its_insertion_do(state: str, obstacles: int) -> None:
    def draw(space) -> None:
        layers = space.doc.layers
        layers.get("0").off()  # what is on it in a block is on the layer of the insertion
        for layer in ("ROOM", "INSERTED", "OWN"):
            layers.add(layer)
        getattr(layers.get("INSERTED"), state)()
        block = space.doc.blocks.new("COLUMN")
        for x, layer in ((1, "0"), (3, "0"), (5, "OWN")):
            block.add_circle((x, 1), 0.5, dxfattribs={"layer": layer})
        space.add_lwpolyline([(0, 0), (9, 0), (9, 9), (0, 9)], close=True, dxfattribs={"layer": "ROOM"})
        space.add_blockref("COLUMN", (1, 1), dxfattribs={"layer": "INSERTED"})

    assert len(reading_of("dxf", dxf(draw)).free_space.interiors) == obstacles


def test_faces_are_solid_and_multiple_lines_are_walls_too() -> None:
    def draw(space) -> None:
        space.add_lwpolyline([(0, 0), (9, 0), (9, 9), (0, 9)], close=True)
        space.add_3dface([(1, 1), (2, 1), (2, 2), (1, 2)])
        space.add_mline([(4, 4), (8, 4), (8, 8), (4, 8)], close=True)

    assert reading_of("dxf", dxf(draw)).free_space.area == pytest.approx(81 - 1 - 36 + 16)


def test_a_hatch_of_a_named_layer_is_solid_but_for_its_islands() -> None:
    def draw(space) -> None:
        space.doc.layers.add("WALLS")
        space.add_lwpolyline([(-1, -1), (19, -1), (19, 19), (-1, 19)], close=True)
        hatch = space.add_hatch(dxfattribs={"layer": "WALLS"})
        hatch.paths.add_polyline_path([(0, 0), (9, 0), (9, 9), (0, 9)])
        edges = hatch.paths.add_edge_path()
        edges.add_arc((5, 5), 2, 0, 360)

    reading = reading_of("dxf", dxf(draw))
    assert reading.free_space.area == pytest.approx(400 - 81 + 4 * math.pi, abs=0.1)


def test_a_damaged_file_is_repaired_and_said() -> None:
    whole = (SAMPLES / "dxf_corridor.dxf").read_bytes()
    reading = reading_of("dxf", whole.replace(b"0.012", b"0.0x2", 1))
    assert any("damaged" in note for note in reading.notes)
    reading = reading_of("dxf", whole.replace(b"\nLINE", b"\nLIME", 1).replace(b"\r\nLINE", b"\r\nLIME", 1))
    assert any("unknown LIME" in note for note in reading.notes)


BROKEN_DXF = [
    (b"", "empty"),
    (b"hello", "DXF drawing"),
    (b"AutoCAD Binary DXF\r\n\x1a\x00abc", "DXF drawing"),
    (b"\x00" * 1000, "DXF drawing"),
    (b"AC1032" + b"\x00" * 100, "Expected"),
    (b"  0\nEOF\n", "Expected"),
]


@pytest.mark.parametrize(("data", "message"), BROKEN_DXF)
def test_broken_dxf_is_refused_in_a_sentence(data: bytes, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading_of("dxf", data)


@pytest.mark.parametrize("within", [True, False])
def test_blocks_that_multiply_are_refused(within: bool) -> None:
    document = ezdxf.new("R2000")
    document.blocks.new("B0").add_circle((0, 0), 1)
    for i in range(1, 30):
        block = document.blocks.new(f"B{i}")
        for _ in range(10):
            block.add_blockref(f"B{i - 1}", (0, 0))
    grid = {"row_count": 30_000, "column_count": 30_000, "row_spacing": 1, "column_spacing": 1}
    document.modelspace().add_blockref("B29" if within else "B0", (0, 0), dxfattribs={} if within else grid)
    text = io.StringIO()
    document.write(text)
    with pytest.raises(InputError, match="entities"):
        reading_of("dxf", text.getvalue())


def test_a_block_within_itself_is_drawn_to_a_depth_alone() -> None:
    document = ezdxf.new("R2000")
    block = document.blocks.new("B")
    block.add_circle((5, 5), 1)
    block.add_blockref("B", (0, 0))
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (9, 0), (9, 9), (0, 9)], close=True)
    space.add_blockref("B", (0, 0))
    text = io.StringIO()
    document.write(text)
    assert reading_of("dxf", text.getvalue()).free_space.area == pytest.approx(81 - math.pi, abs=0.02)


# GeoJSON


def test_all_geometries_are_read_at_any_depth() -> None:
    room = shapely.geometry.mapping(box(0, 0, 9, 9).difference(box(1, 1, 2, 2)))
    line = {"type": "MultiLineString", "coordinates": [[[4, 4], [5, 4]], [[5, 4], [5, 5], [4, 4]]]}
    point = {"type": "Point", "coordinates": [7, 7, 3.5]}
    nested = {
        "type": "GeometryCollection",
        "geometries": [line, {"type": "GeometryCollection", "geometries": []}],
    }
    data = features(
        ({}, room), ({}, nested), ({"kind": "goal"}, point), ({"role": "base", "heading_deg": 90}, point)
    )
    reading = reading_of("geojson", data)
    assert reading.free_space.area == pytest.approx(81 - 1 - 0.5)
    assert reading.goal == (7, 7) and reading.goal_radius is None
    assert reading.base_pose == pytest.approx((7, 7, math.pi / 2))


def test_a_bare_geometry_is_a_map_too() -> None:
    reading = reading_of("geojson", json.dumps(shapely.geometry.mapping(box(0, 0, 9, 9))))
    assert reading.free_space.area == pytest.approx(81)


def test_degrees_are_noted_and_not_projected() -> None:
    data = features(({}, shapely.geometry.mapping(box(11.57, 48.1, 11.58, 48.11))))
    reading = reading_of("geojson", data)
    assert any("degrees" in note for note in reading.notes)
    assert not any("degrees" in note for note in rings(box(0, 0, 0.5, 0.5)).notes)


BROKEN_GEOJSON = [
    (b"", "JSON"),
    (b"\xff", "JSON"),
    (b"[1]", "without a type"),
    ("[" * 100_000, "deep"),
    ('{"type": "FeatureCollection"}', "list of features"),
    ('{"type": "FeatureCollection", "features": [null, 3, {}]}', "Expected outlines"),
    ('{"type": "Polygon", "coordinates": [[["a", 1]]]}', "pairs of numbers"),
    ('{"type": "Polygon", "coordinates": [[[NaN, 1], [2, 3], [4, 1]]]}', "finite"),
    ('{"type": "Polygon", "coordinates": 7}', "lists of coordinates"),
    ('{"type": "Polygon", "coordinates": [[]]}', "pairs of numbers"),
    ('{"type": "Polygon", "coordinates": []}', "Expected outlines"),
    ('{"type": "Polygon", "coordinates": [[[1, 1], [1, 1], [1, 1]]]}', "some size"),
    ('{"type": "Polygon", "coordinates": [[[0, 0], [1, 1], [2, 2]]]}', "0 closed"),
    ('{"type": "GeometryCollection", "geometries": {}}', "list of geometries"),
    ('{"type": "Point", "coordinates": [1e999, 2]}', "finite"),
    ('{"type": "Polygon", "coordinates": [[[1e200, 0], [0, 1e200], [1, 1]]]}', "Expected"),
]


@pytest.mark.parametrize(("data", "message"), BROKEN_GEOJSON)
def test_broken_geojson_is_refused_in_a_sentence(data: bytes | str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        reading_of("geojson", data)


# Limits


@pytest.mark.parametrize(("kind", "library"), [("svg", "svgelements"), ("dxf", "ezdxf")])
def test_a_missing_library_is_named(kind: str, library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=rf"{library}.*hrsnake\[maps\]"):
        reading_of(kind, "x")


def test_no_file_but_the_map_is_asked_for() -> None:
    asked = []

    def files(name: str) -> bytes:
        asked.append(name)
        return svg('<rect width="9" height="9"/><image href="other.svg"/><use href="other.svg#a"/>').encode()

    read_svg("map.svg", files, MapOptions())
    assert asked == ["map.svg"]


def test_too_many_points_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hrsnake_env.maps.drawing.MAX_POINTS", 3)
    with pytest.raises(InputError, match="at most 3 points"):
        rings(box(0, 0, 9, 9))
    monkeypatch.undo()
    monkeypatch.setattr("hrsnake_env.maps.outlines.MAX_VERTICES", 4)
    with pytest.raises(InputError, match="at most 4 corners"):
        rings(box(0, 0, 9, 9))
    with pytest.raises(InputError, match="larger tolerance"):
        reading_of("svg", svg('<circle cx="50" cy="50" r="50"/>'), tolerance=1e-13)


def winding_walls(path, rule=""):
    """Return the area that is left of a room of 100 x 100 beside a filled path named wall."""
    text = (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100"><rect width="100" height="100"/>'
        f'<path id="wall" {rule} d="{path}"/></svg>'
    )
    return read_svg("a.svg", {"a.svg": text.encode()}.__getitem__, MapOptions()).free_space.area


@pytest.mark.parametrize("inner", ["M30 20H50V40H30Z", "M30 30H50V50H30Z"])
def test_a_path_of_svg_is_filled_by_its_rule(inner):
    outer, back = "M20 20H60V60H20Z", "M30 30V50H50V30Z"
    assert winding_walls(f"{outer} {inner}") == pytest.approx(8400.0)
    assert winding_walls(f"{outer} {inner}", 'fill-rule="evenodd"') == pytest.approx(8800.0)
    # The other way round it is a hole by both rules; what is enclosed cannot be reached, but is not wall.
    assert winding_walls(f"{outer} {back}") == pytest.approx(8800.0)
