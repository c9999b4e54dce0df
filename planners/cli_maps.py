"""The command `hrsnake import`: read a map, say and draw what was understood, and make a maze of it."""

from __future__ import annotations

import dataclasses
import math
import shlex
from pathlib import Path
from typing import Annotated, Any

import shapely
import typer

from hrsnake_env.errors import InputError
from hrsnake_env.maps import ENDINGS, MapOptions, MapReading, read_map
from hrsnake_env.maze import Maze
from planners.cli_tools import PICTURES, JsonOption, check_output, name_of, print_outcome
from planners.tables import Rows, show_rows

__all__ = ["import_command"]

PLACES, SIZES, PIXELS, LAYERS = (
    "Base and goal",
    "Size and outline",
    "Images and ROS maps",
    "SVG, DXF, GeoJSON",
)
"""Groups of options in the help text."""

MOST_LAYERS = 12
"""So many are listed in the table."""

SHARE = 0.25
"""The link length of the example that is printed, as a share of the straight way in front of the base."""


def import_command(
    source: Annotated[
        str, typer.Argument(metavar="MAP", help=f"The map: {', '.join(ENDINGS)}; a ROS map by its .yaml.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write the maze (.geojson); needs a base and a goal.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", help="Draw what was understood, with axes to read coordinates off (.png)."),
    ] = None,
    base: Annotated[
        str | None,
        typer.Option(
            "--base",
            metavar="X,Y,DEG",
            rich_help_panel=PLACES,
            help="Where the arm comes in, in maze units, and its heading: 0 is along x, 90 along y.",
        ),
    ] = None,
    goal: Annotated[
        str | None,
        typer.Option(
            "--goal", metavar="X,Y", rich_help_panel=PLACES, help="Where the tip shall go, in maze units."
        ),
    ] = None,
    goal_radius: Annotated[
        float | None,
        typer.Option(
            "--goal-radius",
            rich_help_panel=PLACES,
            help="By default the map's, or a quarter of the goal's distance to the nearest wall.",
        ),
    ] = None,
    units: Annotated[
        str | None,
        typer.Option(
            "--units",
            rich_help_panel=SIZES,
            help="Of the maze: mm, cm, m, in, ft, yd. A map that says its own is converted.",
        ),
    ] = None,
    scale: Annotated[
        float,
        typer.Option(
            "--scale", rich_help_panel=SIZES, help="Maze units per unit of the map: 1000 turns m into mm."
        ),
    ] = 1.0,
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance",
            rich_help_panel=SIZES,
            help="How far walls may move into the free space to become simpler, in maze units; never "
            "the other way. By default 1.5 pixels, or 1e-4 of an outline's size; 0 keeps every corner.",
        ),
    ] = None,
    resolution: Annotated[
        float | None,
        typer.Option(
            "--resolution",
            rich_help_panel=PIXELS,
            help="Side of a pixel; 1 by default, or what a ROS map says.",
        ),
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            "--threshold",
            rich_help_panel=PIXELS,
            help="Of images: from which brightness, 0 to 1, a pixel is free. 0.75 by default.",
        ),
    ] = None,
    invert: Annotated[
        bool, typer.Option("--invert", rich_help_panel=PIXELS, help="Of images: dark is free.")
    ] = False,
    unknown_is_free: Annotated[
        bool,
        typer.Option(
            "--unknown-is-free", rich_help_panel=PIXELS, help="Of ROS maps: what nobody has seen is no wall."
        ),
    ] = False,
    free: Annotated[
        list[str] | None,
        typer.Option(
            "--free",
            rich_help_panel=LAYERS,
            help="A layer, or a colour (#rrggbb), that holds the free space. Each of these options can be "
            "given several times.",
        ),
    ] = None,
    walls: Annotated[
        list[str] | None, typer.Option("--walls", rich_help_panel=LAYERS, help="One that holds walls.")
    ] = None,
    base_layer: Annotated[
        list[str] | None,
        typer.Option(
            "--base-layer", rich_help_panel=LAYERS, help="One with the base, as an arrow or a point."
        ),
    ] = None,
    goal_layer: Annotated[
        list[str] | None,
        typer.Option(
            "--goal-layer", rich_help_panel=LAYERS, help="One with the goal, as a circle or a point."
        ),
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option("--ignore", rich_help_panel=LAYERS, help="One with dimensions, text and the like."),
    ] = None,
    wall_thickness: Annotated[
        float,
        typer.Option(
            "--wall-thickness",
            rich_help_panel=LAYERS,
            help="Open lines are walls of this thickness, in maze units; 0 leaves them out.",
        ),
    ] = 0.0,
    as_json: JsonOption = False,
) -> None:
    """Make a maze of a map: ROS, image, SVG, DXF or GeoJSON. The free space never grows.

    First look at what is understood (--picture); then say where the arm comes in (--base) and where its tip
    shall go (--goal), unless the map says it, and write the maze (--out).

    A ROS map, read in mm:  hrsnake import map.yaml --units mm --picture seen.png
    """
    check_output(out, (".geojson", ".json"))
    check_output(picture, PICTURES)
    options = MapOptions(
        units=units,
        scale=scale,
        tolerance=tolerance,
        resolution=resolution,
        threshold=threshold,
        invert=invert,
        unknown_is_free=unknown_is_free,
        free=tuple(free or ()),
        walls=tuple(walls or ()),
        base=tuple(base_layer or ()),
        goal=tuple(goal_layer or ()),
        ignore=tuple(ignore or ()),
        wall_thickness=wall_thickness,
    )
    base_pose, place = _base_pose(base), _goal(goal)
    reading = _with_ends(read_map(source, options), base_pose, place, goal_radius)
    try:
        maze, wrong = reading.maze(), None
    except InputError as error:
        maze, wrong = None, error
    if picture is not None:
        from hrsnake_env.maps.picture import draw_reading

        draw_reading(reading, picture, maze)
    given = reading.base_pose is not None and reading.goal is not None
    if wrong is not None and (out is not None or given):  # the picture shows what is wrong
        raise wrong
    if maze is not None and out is not None:
        maze.save(out)
    print_outcome(
        as_json,
        {
            **_reading_dict(reading, maze),
            "out": name_of(out, maze is not None),
            "picture": name_of(picture),
        },
        lambda: _show(source, reading, maze, [out, picture]),
    )


def _numbers(text: str, option: str, wanted: str) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != wanted.count(",") + 1 or not all(map(math.isfinite, values)):
        raise InputError(
            f"Expected {option} as {wanted}, finite numbers with commas between them, got '{text}'."
        )
    return values


def _base_pose(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    x, y, degrees = _numbers(text, "--base", "X,Y,DEG")
    return x, y, math.radians(degrees)


def _goal(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    x, y = _numbers(text, "--goal", "X,Y")
    return x, y


def _with_ends(
    reading: MapReading,
    base_pose: tuple[float, float, float] | None,
    goal: tuple[float, float] | None,
    goal_radius: float | None,
) -> MapReading:
    """Return the reading with the base and the goal that were given, instead of the map's."""
    radius = goal_radius if goal_radius is not None or goal is not None else reading.goal_radius
    return dataclasses.replace(
        reading,
        base_pose=reading.base_pose if base_pose is None else base_pose,
        goal=reading.goal if goal is None else goal,
        goal_radius=radius,
    )


def _straight_way(maze: Maze) -> float:
    """Return how far it is straight on from the base to the first wall: no link may be longer."""
    x, y, heading = (float(value) for value in maze.base_pose)
    start, reach = shapely.Point(x, y), 2.0 * maze.size
    ray = shapely.LineString([(x, y), (x + reach * math.cos(heading), y + reach * math.sin(heading))])
    return float(start.distance(ray.intersection(maze.free_space.boundary)))


def _n_vertices(reading: MapReading) -> int:
    rings = shapely.get_rings(shapely.get_parts(reading.free_space))
    return int(shapely.get_num_coordinates(reading.free_space) - len(rings))


def _reading_dict(reading: MapReading, maze: Maze | None) -> dict[str, Any]:
    """Return what was understood as plain data."""
    pose = reading.base_pose if maze is None else tuple(map(float, maze.base_pose))
    goal = reading.goal if maze is None else tuple(map(float, maze.goal))
    radius = reading.goal_radius if maze is None else maze.goal_radius
    return {
        "name": reading.name,
        "units": reading.units,
        "bounds": list(reading.free_space.bounds),
        "area": reading.free_space.area,
        "parts": len(reading.parts),
        "vertices": _n_vertices(reading),
        "tolerance": reading.tolerance,
        "moved": reading.moved,
        "layers": dict(reading.layers),
        "notes": list(reading.notes),
        "base": None if pose is None else {"x": pose[0], "y": pose[1], "heading_deg": math.degrees(pose[2])},
        "goal": None if goal is None else {"x": goal[0], "y": goal[1], "radius": radius},
        "straight_way": None if maze is None else _straight_way(maze),
    }


def _show(source: str, reading: MapReading, maze: Maze | None, files: list[Path | None]) -> None:
    """Print what was understood, and the command to type next."""
    show_rows(f"Map {reading.name}", _rows(reading, maze))
    for path in files:
        if path is not None:
            print(f"Written: {path}")
    print(f"Next: {_next_command(source, reading, maze, files[0])}")


def _rows(reading: MapReading, maze: Maze | None) -> Rows:
    data, units = _reading_dict(reading, maze), reading.units
    x_min, y_min, x_max, y_max = data["bounds"]
    for number, note in enumerate(reading.notes):
        yield "" if number else "understood", note
    yield "size", f"{x_max - x_min:.6g} x {y_max - y_min:.6g} {units}"
    yield "x, y", f"{x_min:.6g} to {x_max:.6g}, {y_min:.6g} to {y_max:.6g} {units}"
    parts = reading.parts
    shares = ", ".join(f"{part.area / reading.free_space.area:.1%}" for part in parts[:5])
    more = ", ..." if len(parts) > 5 else ""
    yield "free space", "one part" if len(parts) == 1 else f"{len(parts)} parts, not joined: {shares}{more}"
    yield "vertices", f"{data['vertices']:,}"
    yield "tolerance", f"{reading.tolerance:.4g} {units}; walls moved by {reading.moved:.4g} {units} at most"
    for number, (layer, role) in enumerate(list(reading.layers.items())[:MOST_LAYERS]):
        yield "" if number else "layers", f"{layer}: {role}"
    if len(reading.layers) > MOST_LAYERS:
        yield "", f"and {len(reading.layers) - MOST_LAYERS} more"
    base, goal = data["base"], data["goal"]
    if base is None:
        yield "base", "not said: give --base X,Y,DEG"
    else:
        yield "base", f"({base['x']:.12g}, {base['y']:.12g}), heading {base['heading_deg']:.4g} degrees"
    if goal is None:
        yield "goal", "not said: give --goal X,Y"
    else:
        radius = "" if goal["radius"] is None else f", radius {goal['radius']:.4g} {units}"
        yield "goal", f"({goal['x']:.12g}, {goal['y']:.12g}){radius}"
    if maze is not None:
        yield (
            "straight way",
            f"{data['straight_way']:.6g} {units} in front of the base: no link may be longer",
        )


def _next_command(source: str, reading: MapReading, maze: Maze | None, out: Path | None) -> str:
    if maze is not None and out is not None:
        length = float(f"{SHARE * _straight_way(maze):.2g}")
        return f"hrsnake plan {shlex.quote(str(out))} --link-length {length:g}"
    wanted = f"{shlex.quote(Path(source).stem)}.geojson"
    places = "" if maze is not None else "--base X,Y,DEG --goal X,Y "
    return f"the same command with {places}--out {wanted}"
