"""Laws of the potential and the path in space."""

import math

import numpy as np
import pytest
import scipy.sparse as sparse
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.ndimage import map_coordinates
from scipy.sparse.linalg import splu

from hrsnake_env.errors import InputError
from planners import path as planar
from planners.spatial import potential as field
from planners.spatial.panel import Panel
from planners.spatial.path import descend, global_path
from planners.spatial.potential import laplace_potential
from planners.spatial.rooms import paired_panels, random_room
from planners.spatial.workspace import Workspace

ROUNDING = 1e-9


def small_room(seed, *, whole=True, n_boxes=12, **changes):
    """Return a room of 200 by 150 by 120 with random boxes, off base and goal.

    The streamline starts off the nodes: at one, steepest ascent may have several directions.
    """
    rng = np.random.default_rng(seed)
    size, goal = np.array([200.0, 150.0, 120.0]), np.array([180.0, 80.0, 50.0])
    base, start = np.array([0.0, 72.0, 58.0]), np.array([22.0, 72.0, 58.0])
    extent = rng.uniform(10.0, 60.0, (n_boxes, 3))
    low = rng.uniform(0.0, 1.0, (n_boxes, 3)) * (size - extent)
    if whole:
        extent, low = np.ceil(extent / 10.0) * 10.0, np.floor(low / 10.0) * 10.0
    boxes = np.stack([low, np.minimum(low + extent, size)], axis=1)
    for low, high in ((base, start), (goal, goal)):
        boxes = boxes[((boxes[:, 0] >= high + 11.0) | (boxes[:, 1] <= low - 11.0)).any(axis=1)]
    values = {"heading": [1.0, 0.0, 0.0], "straight": 22.0, "goal_radius": 5.0, "open_sides": ("x-",)}
    values |= {"room_low": np.zeros(3), "room_high": size, "base": base, "goal": goal, "boxes": boxes}
    return Workspace(name=f"small-{seed}", **(values | changes))


def clearance(points, workspace):
    """Return the smallest distance of points from obstacles, 0 inside."""
    gaps = np.maximum(workspace.obstacles[:, None, 0] - points, points - workspace.obstacles[:, None, 1])
    return float(np.linalg.norm(np.maximum(gaps, 0.0), axis=2).min())


def penetration(points, workspace):
    """Return how deep the deepest point is in an obstacle, by the nearest face; 0 outside."""
    inside = np.minimum(points - workspace.obstacles[:, None, 0], workspace.obstacles[:, None, 1] - points)
    return max(0.0, float(inside.min(axis=2).max()))


def solved_directly(free, goal):
    """Return u by one sparse LU factorisation without pivoting, which keeps the accuracy of small numbers."""
    unknown = free.copy()
    unknown[goal] = False
    index = np.full(free.shape, -1)
    n = int(unknown.sum())
    index[unknown] = np.arange(n)
    matrix, right = sparse.lil_matrix((n, n)), np.zeros(n)
    matrix.setdiag(6.0)
    for here in np.argwhere(unknown):
        for axis in range(3):
            for way in (-1, 1):
                there = here.copy()
                there[axis] += way
                if tuple(there) == goal:
                    right[index[tuple(here)]] += 1.0
                elif unknown[tuple(there)]:
                    matrix[index[tuple(here)], index[tuple(there)]] = -1.0
    factors = splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    u = np.zeros(free.shape)
    u[unknown] = factors.solve(right)
    u[goal] = 1.0
    return u


@pytest.mark.parametrize("seed", range(4))
def test_the_potential_is_accurate_relative_to_itself_everywhere(seed):
    potential = laplace_potential(small_room(seed), cell=10.0)
    assert potential.origin.tolist() == [0.0, 0.0, 0.0] and potential.goal_node.tolist() == [
        180.0,
        80.0,
        50.0,
    ]
    assert potential.u.shape == (21, 16, 13)
    free = potential.u > 0.0
    direct = solved_directly(free, (18, 8, 5))
    np.testing.assert_allclose(potential.u[free], direct[free], rtol=1e-5)


def test_in_a_long_duct_u_falls_below_the_smallest_number_and_leads_on():
    # In a duct of n cells, u falls by a factor x + sqrt(x^2 - 1), x = 3 - 2 cos(pi / n), per cell.
    duct = Workspace(
        name="duct",
        room_low=np.zeros(3),
        room_high=[20_000.0, 60.0, 60.0],
        open_sides=("x-",),
        base=[0.0, 30.0, 30.0],
        heading=[1.0, 0.0, 0.0],
        straight=100.0,
        goal=[19_900.0, 30.0, 30.0],
        goal_radius=5.0,
    )
    potential = laplace_potential(duct, cell=10.0)
    middle = potential.log_u[:, 3, 3]
    x = 3.0 - 2.0 * math.cos(math.pi / 6.0)
    # From 50 to 1950 cells, both ends are far away.
    rates = np.diff(middle)[50:1950]
    np.testing.assert_allclose(rates, math.log(x + math.sqrt(x * x - 1.0)), rtol=1e-5)
    assert middle[50] < math.log(np.finfo(float).smallest_subnormal)
    path = global_path(duct, potential)
    assert path.length == pytest.approx(19_900.0)


def test_solving_in_pieces_changes_nothing(monkeypatch):
    workspace = paired_panels()
    whole = laplace_potential(workspace)
    monkeypatch.setattr(field, "LEVELS", 120)
    monkeypatch.setattr(field, "OVERLAP", 60)
    pieces = laplace_potential(workspace)
    free = whole.u > 0.0
    np.testing.assert_array_equal(pieces.u > 0.0, free)
    np.testing.assert_allclose(pieces.u[free], whole.u[free], rtol=1e-4)


def test_the_path_through_the_paired_panels_is_as_long_as_the_links_that_cover_it():
    # Section 5.5 of the paper: 182 links of 8 and 49 of 30 cover its path: 1456 and 1470.
    workspace = paired_panels()
    potential = laplace_potential(workspace)
    assert potential.cell == 10.0 and potential.log_u.shape == (81, 51, 41)
    path = global_path(workspace, potential)
    assert 1450.0 < path.length < 1470.0
    assert clearance(path.points, workspace) > 10.0


def assert_path_is_sound(workspace, potential):
    path = global_path(workspace, potential)
    np.testing.assert_allclose(path.points[0], workspace.base, atol=ROUNDING)
    np.testing.assert_allclose(path.points[-1], workspace.goal, atol=ROUNDING)
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    assert steps.max() <= 0.1 * potential.cell + ROUNDING
    straight = workspace.base + np.outer(path.s[path.s <= workspace.straight], workspace.heading)
    np.testing.assert_allclose(path.points[: len(straight)], straight, atol=1e-6)
    assert penetration(path.raw, workspace) == 0.0
    assert penetration(path.points, workspace) == 0.0
    np.testing.assert_allclose(np.linalg.norm(path.tangents, axis=1), 1.0)
    assert (path.curvature >= 0.0).all()


@pytest.mark.parametrize("seed", range(10))
def test_the_path_leads_from_base_to_goal_and_enters_no_obstacle(seed):
    workspace = random_room(seed)
    assert_path_is_sound(workspace, laplace_potential(workspace))


def test_the_straight_stretch_is_straight_in_an_oblique_direction():
    heading = np.array([3.0, 2.0, -1.0])
    workspace = small_room(0, base=[35.0, 75.0, 60.0], heading=heading, boxes=None)
    assert_path_is_sound(workspace, laplace_potential(workspace, cell=10.0))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), cell=st.sampled_from([10.0, 7.3, 5.0]))
def test_u_rises_along_the_streamline_which_enters_no_obstacle(seed, cell):
    workspace = small_room(seed, whole=False)
    potential = laplace_potential(workspace, cell=cell)
    assume(potential is not None)
    raw = descend(workspace, potential)
    np.testing.assert_array_equal(raw[0], workspace.base)
    np.testing.assert_array_equal(raw[-1], workspace.goal)
    assert penetration(raw, workspace) == 0.0
    # The goal itself may be off the nodes, and beside its node u no longer rises towards it.
    inner = raw[1:-2]
    u = map_coordinates(potential.u, (inner - potential.origin).T / potential.cell, order=1)
    assert (np.diff(u) > 0.0).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), axis=st.integers(0, 2))
def test_the_mirror_image_of_a_workspace_has_the_mirrored_path(seed, axis):
    workspace = small_room(seed)
    potential = laplace_potential(workspace, cell=10.0)
    assume(potential is not None)
    size = workspace.room_high
    turn, shift = np.ones(3), np.zeros(3)
    turn[axis], shift[axis] = -1.0, size[axis]
    mirrored = small_room(
        seed,
        base=workspace.base * turn + shift,
        goal=workspace.goal * turn + shift,
        heading=workspace.heading * turn,
        boxes=np.sort(workspace.boxes * turn + shift, axis=1),
        open_sides=("x+",) if axis == 0 else ("x-",),
    )
    other = laplace_potential(mirrored, cell=10.0)
    np.testing.assert_allclose(np.flip(other.u, axis), potential.u, rtol=1e-9)
    points, others = global_path(workspace, potential).points, global_path(mirrored, other).points
    np.testing.assert_allclose(others * turn + shift, points, atol=1e-6)


def test_a_room_without_a_way_has_no_potential():
    wall = [[[90.0, 0.0, 0.0], [100.0, 150.0, 120.0]]]
    assert laplace_potential(small_room(0, boxes=wall)) is None


def test_a_goal_between_walls_that_the_grid_joins_is_reached_with_smaller_cells():
    workspace = small_room(0, boxes=[[[150.0, 40.0, 4.0], [200.0, 150.0, 40.0]]], goal=[180.0, 80.0, 1.0])
    assert laplace_potential(workspace, cell=2.5) is None
    assert_path_is_sound(workspace, laplace_potential(workspace))


def test_a_gap_that_the_grid_closes_is_found_with_smaller_cells():
    # 3.4 wide, and no node of the room's own cell of 2.5 inside it but one on the wall rounded outwards.
    walls = [[[90.0, 0.0, 0.0], [100.0, 61.2, 120.0]], [[90.0, 64.6, 0.0], [100.0, 150.0, 120.0]]]
    workspace = small_room(0, boxes=walls)
    assert laplace_potential(workspace, cell=2.5) is None
    potential = laplace_potential(workspace)
    assert potential.cell == 1.25
    assert_path_is_sound(workspace, potential)


def test_the_cell_resolves_the_narrowest_window():
    panel = Panel(
        low=[90.0, 0.0, 0.0],
        high=[100.0, 150.0, 120.0],
        normal="x",
        window_low=[90.0, 60.0, 50.0],
        window_high=[100.0, 72.0, 100.0],
    )
    assert laplace_potential(small_room(0, boxes=None)).cell == 2.5
    assert laplace_potential(small_room(0, boxes=None, panels=(panel,))).cell == 2.0


def test_walls_thinner_than_a_cell_are_walls():
    wall = [[[92.0, 0.0, 0.0], [93.0, 150.0, 120.0]]]
    assert laplace_potential(small_room(0, boxes=wall), cell=10.0) is None


def test_a_path_for_thick_links_keeps_their_radius():
    workspace = random_room(0)
    path = global_path(workspace, laplace_potential(workspace, radius=10.0))
    assert clearance(path.raw[2:], workspace) >= 10.0
    panels = paired_panels()
    assert laplace_potential(panels, radius=31.0) is None


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"radius": -1.0}, "Expected radius to be a finite number of at least 0, got -1.0."),
        ({"cell": -1.0}, "Expected cell to be a finite number of at least 0, got -1.0."),
        (
            {"cell": 0.0},
            "Expected a cell that fills workspace 'small-0' with at most 12,000,000 nodes, got 0.",
        ),
        (
            {"cell": 0.01},
            "Expected a cell that fills workspace 'small-0' with at most 12,000,000 nodes, got 0.01.",
        ),
    ],
)
def test_bad_input_is_refused_in_one_sentence(values, message):
    with pytest.raises(InputError) as error:
        laplace_potential(small_room(0), **values)
    assert str(error.value) == message


def test_lines_in_space_are_measured_and_smoothed_as_in_the_plane():
    rng = np.random.default_rng(0)
    flat = np.cumsum(rng.normal(size=(80, 2)), axis=0)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    lifted = flat @ axes + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(planar.arclength(lifted), planar.arclength(flat))
    for change in (lambda line: planar.resampled(line, 0.3), lambda line: planar.windowed(line, 7)):
        np.testing.assert_allclose(change(lifted), change(flat) @ axes + [1.0, 2.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(planar.tangents(lifted), planar.tangents(flat) @ axes, atol=1e-9)


def test_curvature_is_the_turn_per_length():
    workspace = paired_panels()
    path = global_path(workspace, laplace_potential(workspace))
    k = np.arange(4, len(path.s) - 4)
    cosine = (path.tangents[k - 4] * path.tangents[k + 4]).sum(axis=1)
    turn = np.arccos(np.clip(cosine, -1.0, 1.0))
    np.testing.assert_allclose(path.curvature[k], turn / (path.s[k + 4] - path.s[k - 4]), atol=1e-7)
