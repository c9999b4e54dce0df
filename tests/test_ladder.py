"""Laws of the ladder: every rung is what it says, and is solved."""

import pytest

from hrsnake_env import LADDER, MAZES, ArmSpec, Maze
from hrsnake_env.ladder import rung_maze
from hrsnake_env.mazes import PAPER_LINK_LENGTHS
from planners import plan
from planners.rod_bound import Passage, rod_passes

SHORT = [name for name in LADDER if name not in PAPER_LINK_LENGTHS]
GROWING = [name for name in SHORT if not name.startswith("u-turn-deep")]
FEW = [name for name in GROWING if not name.startswith("u-turn-long")]
LONGER = 5.0
"""Legs that much longer leave the turn alone as what limits a rod."""


@pytest.mark.parametrize("name", LADDER)
def test_every_rung_is_solved_with_the_links_it_has(name):
    rung = LADDER[name]
    result = plan(Maze.load(name), ArmSpec(link_length=rung.link_length, n_links=rung.n_links))
    assert result.solved, result.reason
    assert result.motion.n_links == rung.n_links


@pytest.mark.parametrize("name", [name for name in SHORT if name != "straight"])
def test_the_longest_rod_of_a_short_rung_is_that_of_its_turns(name):
    rung = LADDER[name]
    shape = name.rpartition("-")[0]
    turns = rung_maze(shape, rung.link_length, longer=LONGER)
    assert rod_passes(turns, 0.995 * rung.longest_rod).passes is Passage.YES
    assert rod_passes(turns, 1.005 * rung.longest_rod).passes is Passage.NO


@pytest.mark.parametrize("name", [name for name, rung in LADDER.items() if rung.index > 0.7])
def test_of_a_tight_rung_it_is_the_longest_rod_of_the_maze_itself(name):
    maze, rod = Maze.load(name), LADDER[name].longest_rod
    assert rod_passes(maze, 0.995 * rod).passes is Passage.YES
    assert rod_passes(maze, 1.005 * rod).passes is Passage.NO


def test_names_tell_the_index():
    for name in SHORT:
        index = LADDER[name].index
        assert name.endswith(f"-i{100 * index:.0f}") or (name == "straight" and index == 0.0)


def test_the_ladder_climbs_to_the_papers_workspaces_with_their_links():
    assert list(LADDER)[: len(SHORT)] == SHORT
    assert {name: LADDER[name].link_length for name in PAPER_LINK_LENGTHS} == PAPER_LINK_LENGTHS


def test_the_rungs_of_one_shape_get_tighter_and_their_mazes_have_the_same_corridor():
    for shape in ("bend", "u-turn", "s-bend", "zigzag"):
        rungs = [rung for name, rung in LADDER.items() if name.startswith(f"{shape}-i")]
        assert len(rungs) >= 2
        assert [rung.index for rung in rungs] == sorted({rung.index for rung in rungs})
        n_walls = {len(Maze.load(rung.maze).walls) for rung in rungs}
        assert len(n_walls) == 1


def test_short_rungs_need_few_links():
    assert max(LADDER[name].n_links for name in FEW) <= 8


def test_the_deep_u_turns_take_from_14_to_55_links():
    links = [rung.n_links for name, rung in LADDER.items() if name.startswith("u-turn-deep")]
    assert links == sorted(links, reverse=True)
    assert (links[-1], links[0]) == (14, 55)


def test_mazes_of_the_ladder_bear_their_names_and_leave_the_list_of_mazes_short():
    for name in LADDER:
        assert Maze.load(name).name == name
    assert not set(SHORT) & set(MAZES)


@pytest.mark.parametrize("name", GROWING)
def test_legs_grow_with_the_link(name):
    rung = LADDER[name]
    shape = name.rpartition("-")[0] or name
    twice = rung_maze(shape, 2.0 * rung.link_length)
    n_corners = len(rung_maze(shape, rung.link_length).walls)
    assert len(twice.walls) == n_corners
    assert twice.free_space.area > Maze.load(name).free_space.area + 200.0 * rung.link_length


def test_links_that_follow_the_path_pass_the_loose_rungs_alone():
    passed = {
        name: plan(
            Maze.load(name), ArmSpec(link_length=LADDER[name].link_length), "follow", explain=False
        ).solved
        for name in SHORT
    }
    assert passed == {name: LADDER[name].index < 0.4 for name in SHORT}
