"""Laws of random mazes: their tightness, their reach, their seeds."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from hrsnake_env import ArmSpec, InputError, Maze
from hrsnake_env.bends import Bend, Corridor, draw_bends, longest_rod_of_bend
from hrsnake_env.geodesic import GeodesicDistance
from hrsnake_env.random_mazes import (
    LINK_LENGTH,
    N_LINKS,
    N_TASKS,
    draw_train_maze,
    index_of_difficulty,
    random_maze,
    task_maze,
)
from planners import plan
from planners.rod_bound import Passage, rod_passes

SEEDS, DIFFICULTIES = st.integers(0, 2**32), st.floats(0.0, 1.0)

ROD = 0.01
"""By how much the longest rod may miss what the difficulty says: twice what the rod bound leaves open."""


def digest(maze):
    """Return what tells mazes apart, to the last bit."""
    numbers = [maze.walls.ravel(), maze.base_pose, maze.goal, [maze.goal_radius]]
    return hashlib.sha256(np.concatenate(numbers).tobytes()).hexdigest()


def corridor(bends, leg):
    """Return a maze of bends to the left with long legs, in links."""
    walls = Corridor.from_bends(bends, np.ones(len(bends)), np.full(len(bends) + 1, leg))
    return Maze(
        name="bend",
        free_space=shapely.Polygon(np.concatenate([walls.left, walls.right[::-1]])),
        base_pose=np.array([0.0, 0.05, np.pi / 2]),
        goal=walls.beyond([(-0.2, 0.0)])[0],
        goal_radius=0.1,
    )


@pytest.mark.parametrize("turn", [35.0, 60.0, 90.0, 125.0])
@pytest.mark.parametrize("outlet", [0.6, 1.0, 1.7])
def test_the_longest_rod_of_a_bend_is_what_the_rod_bound_proves(turn, outlet):
    rod = longest_rod_of_bend(1.0, outlet, np.radians(turn))
    maze = corridor([Bend(turn=np.radians(turn), entry=1.0, outlet=outlet, index=1.0)], 6.0 * rod)
    assert rod_passes(maze, 0.997 * rod).passes is Passage.YES
    assert rod_passes(maze, 1.003 * rod).passes is Passage.NO


@given(SEEDS, st.integers(1, 8), DIFFICULTIES)
@settings(deadline=None, max_examples=50)
def test_no_bend_is_tighter_than_the_index_and_one_is_just_as_tight(seed, n_bends, difficulty):
    index = index_of_difficulty(difficulty)
    bends = draw_bends(np.random.default_rng(seed), n_bends, index, difficulty)
    rods = [longest_rod_of_bend(bend.entry, bend.outlet, bend.turn) for bend in bends]
    assert len(bends) in (0, n_bends)
    assert all(rod >= (1.0 - 1e-9) / bend.index for rod, bend in zip(rods, bends, strict=True))
    assert not bends or max(bend.index for bend in bends) == index


@pytest.mark.parametrize("difficulty", [0.55, 0.8, 1.0])
@pytest.mark.parametrize("seed", range(6))
def test_the_longest_rod_of_a_maze_is_what_its_difficulty_says(seed, difficulty):
    maze, rod = random_maze(seed, difficulty=difficulty), LINK_LENGTH / index_of_difficulty(difficulty)
    assert rod_passes(maze, (1.0 - ROD) * rod).passes is Passage.YES
    assert rod_passes(maze, (1.0 + ROD) * rod).passes is Passage.NO


@given(SEEDS, DIFFICULTIES, st.integers(6, 20), st.sampled_from([0.1, 100.0]))
@settings(deadline=None, max_examples=40)
def test_any_arm_leaves_the_feeder_and_is_longer_than_its_way(seed, difficulty, n_links, link_length):
    maze = random_maze(seed, difficulty=difficulty, link_length=link_length, n_links=n_links)
    maze.check_arm(ArmSpec(link_length=1.5 * link_length))
    way = GeodesicDistance(maze)(maze.base_pose[:2])
    assert way <= (n_links - 1) * link_length
    assert way >= link_length


@given(SEEDS, DIFFICULTIES)
@settings(deadline=None, max_examples=40)
def test_walls_are_nowhere_thin_but_at_the_tips_of_corners(seed, difficulty):
    maze, thin = random_maze(seed, difficulty=difficulty), 0.11 * LINK_LENGTH
    filled = maze.free_space.buffer(0.5 * thin, join_style="mitre").buffer(-0.5 * thin, join_style="mitre")
    tip = thin**2 / 4.0 / np.tan(np.radians(27.5))  # what is thinner of a wall between legs 55 degrees apart
    n_bends = (len(maze.walls) - 4) // 2
    assert filled.area - maze.free_space.area <= 1.1 * n_bends * tip
    assert len(filled.interiors) == len(maze.free_space.interiors)


def test_mazes_have_the_same_shape_for_any_link_length():
    small, large = (random_maze(3, difficulty=0.8, link_length=length) for length in (1.0, 1000.0))
    np.testing.assert_allclose(1000.0 * small.walls, large.walls, atol=1e-9)


def test_harder_mazes_have_more_bends():
    bends = [
        np.mean([len(random_maze(seed, difficulty=difficulty).walls) for seed in range(30)])
        for difficulty in (0.0, 0.33, 0.66, 1.0)
    ]
    assert bends[0] == 6  # one bend: three corners on either side
    assert all(np.diff(bends) > 1.0)


def test_some_mazes_end_in_a_hall_of_pillars_and_some_do_not():
    n_pillars = [len(random_maze(seed, difficulty=0.7).free_space.interiors) for seed in range(40)]
    assert 4 <= np.count_nonzero(n_pillars) <= 20


def test_bends_turn_to_both_sides():
    ends = [random_maze(seed, difficulty=0.0).goal[0] for seed in range(20)]
    assert min(ends) < 0.0 < max(ends)


def test_a_longer_arm_gets_more_bends():
    n_walls = [
        np.mean([len(random_maze(seed, difficulty=0.9, n_links=n).walls) for seed in range(10)])
        for n in (8, 12, 20)
    ]
    assert n_walls == sorted(n_walls) and n_walls[0] + 6 < n_walls[2]


def test_the_same_task_is_the_same_maze_to_the_last_bit_in_another_process():
    code = (
        "import sys; sys.path.insert(0, 'tests')\n"
        "from test_random_mazes import digest, task_maze\n"
        "print(*(digest(task_maze(split, k)) for split in ('train', 'test') for k in range(20)))"
    )
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert shown.split() == [digest(task_maze(split, k)) for split in ("train", "test") for k in range(20)]


def test_no_two_tasks_of_both_splits_are_equal():
    mazes = [task_maze(split, k) for split in ("train", "test") for k in range(300)]
    assert len({digest(maze) for maze in mazes}) == len(mazes)


def test_tasks_are_loaded_by_name():
    for split in N_TASKS:
        assert digest(Maze.load(f"random-{split}-17")) == digest(task_maze(split, 17))
        assert Maze.load(f"random-{split}-17").name == f"random-{split}-17"


def test_drawn_train_mazes_are_train_tasks():
    rng = np.random.default_rng(0)
    mazes = [draw_train_maze(rng, difficulty=(0.2, 0.4), n_links=9) for _ in range(3)]
    assert len({digest(maze) for maze in mazes}) == 3
    for maze in mazes:
        split, task_id = maze.name.split("-")[1:]
        again = task_maze(split, int(task_id), difficulty=(0.2, 0.4), n_links=9)
        assert split == "train" and digest(again) == digest(maze)


def test_difficulties_of_tasks_fill_their_range():
    n_walls = [len(task_maze("test", k, difficulty=(0.9, 1.0)).walls) for k in range(20)]
    easy = [len(task_maze("test", k, difficulty=(0.0, 0.0)).walls) for k in range(20)]
    assert set(easy) == {6} and min(n_walls) > 6


@pytest.mark.parametrize("task_id", range(0, 60, 4))
def test_planners_solve_tasks_with_the_arm_that_they_are_for(task_id):
    arm = ArmSpec(link_length=LINK_LENGTH, n_links=N_LINKS)
    # Time enough for the kernels to be compiled, in a fresh checkout.
    assert plan(task_maze("test", task_id), arm, time_budget=600.0).solved


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda: random_maze(0, difficulty=1.1), "Expected a difficulty from 0 to 1, got 1.1."),
        (lambda: random_maze(0, difficulty=np.nan), "Expected a difficulty from 0 to 1, got nan."),
        (lambda: random_maze(0, difficulty=0.5, link_length=0.0), "Expected a positive, finite link_length"),
        (lambda: random_maze(0, difficulty=0.5, n_links=3), "Expected more links for a maze of"),
        (lambda: task_maze("valid", 0), "Unknown split 'valid'. Available: train, test."),
        (lambda: task_maze("test", 1000), "Expected a whole task_id from 0 to 999 of split 'test', got 10"),
        (lambda: task_maze("test", -1), "Expected a whole task_id from 0 to 999 of split 'test', got -1."),
        (lambda: task_maze("test", 0.5), "Expected a whole task_id from 0 to 999 of split 'test', got 0.5."),
        (lambda: Maze.load("random-test-1000"), "Expected a whole task_id from 0 to 999"),
        (
            lambda: task_maze("test", 0, difficulty=(0.6, 0.5)),
            "Expected a range of difficulties in [0, 1], got (0.6, 0.5).",
        ),
        (lambda: Maze.load("random-3"), "Unknown maze 'random-3'. Available: fig19,"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(draw, message):
    with pytest.raises(InputError) as raised:
        draw()
    assert str(raised.value).startswith(message)
