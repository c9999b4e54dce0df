"""The paper's results at their smallest, and the laws that their figures keep."""

import dataclasses
import json
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from hrsnake_env.errors import InputError
from hrsnake_env.maze import Maze
from planners.beam_planner import AS_PRINTED, CLAMPED
from planners.bench import paper
from planners.bench.fits import line
from planners.bench.paper import PARTS, QUICK, run_paper
from planners.bench.paper_scans import RODS, VARIANTS, family_rod, scan_family, trials
from planners.bench.paper_speed import growth_with_arm, time_each_pose
from planners.bench.paper_tables import paper_markdown
from planners.bench.paper_trials import depth_at_poses, maze_of, try_planner
from planners.bench.records import write_results
from planners.cli import app
from planners.problem import Motion
from planners.survey import survey
from planners.validation import validate

TINY = dataclasses.replace(
    QUICK,
    workspaces=("fig19",),
    runs=1,
    repeats=1,
    links=(3, 6),
    turns=(1, 2),
    index_step=140.0,
    shown=(430.0,),
    families=("L",),
    family_step=0.2,
    family_coarse=0.4,
    variants=("as printed, all rules", "clamped, without the jump rule"),
    rule_lengths=(430.0,),
    rule_mazes=("L",),
    rule_shares=(0.6,),
)
FIG19 = Maze.load("fig19")


TOLD = {}
"""How much work each part announced, and how much it told of."""


@contextmanager
def counting_bar(name, total, quiet):
    TOLD[name] = [total, 0]

    def tell():
        TOLD[name][1] += 1

    yield tell


@pytest.fixture(scope="module")
def results():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paper, "bar", counting_bar)
        return run_paper(TINY, workers=0, quiet=True)


def test_every_part_is_measured_and_named_in_the_tables(results):
    assert set(PARTS) < set(results)
    text = paper_markdown(json.loads(json.dumps(results)))
    assert all(f"**{part}**" in text for part in PARTS)


def test_results_are_plain_data_and_written_whole(results, tmp_path):
    write_results(results, tmp_path / "paper.json")
    assert json.loads((tmp_path / "paper.json").read_text()) == results


def test_a_bar_ends_where_the_work_does(results):
    assert set(TOLD) == set(PARTS)
    assert all(told == total for total, told in TOLD.values()), TOLD


def test_as_printed_and_clamped_pass_the_benchmark_at_the_papers_length(results):
    rows = {row["planner"]: row for row in results["workspaces"]}
    assert {row["status"] for row in rows.values()} == {"solved"}
    assert rows["auto"]["clean"]


def test_variants_hold_the_two_rule_sets_of_the_planner():
    assert VARIANTS["as printed, all rules"] == AS_PRINTED
    assert VARIANTS["clamped, without the jump rule"] == CLAMPED
    assert len(set(VARIANTS.values())) == len(VARIANTS)


@pytest.mark.parametrize("planner", ["auto", "sweep", "track", "beam", "as-printed", "follow"])
@pytest.mark.parametrize("length", [150.0, 200.0, 430.0, 439.0, 441.0])
def test_what_counts_as_solved_passes_the_exact_checker_and_nothing_else_does(planner, length):
    trial = try_planner(FIG19, length, planner)
    if trial.came == 1.0:
        assert trial.motion is not None
        assert trial.solved == validate(trial.motion, FIG19).valid
    else:
        assert not trial.solved


def test_the_depth_at_poses_is_the_exact_checkers():
    for length in (200.0, 430.0, 439.0):
        trial = try_planner(FIG19, length, "as-printed")
        assert trial.depth == pytest.approx(validate(trial.motion, FIG19).penetration, abs=1e-6 * length)
        assert trial.between >= trial.depth


@given(st.floats(0.0, 150.0))
def test_a_link_is_as_deep_as_its_end_is_behind_the_wall(beyond):
    # The wall ahead of the base is 1595 px away.
    motion = Motion.from_configurations([1595.0 + beyond], np.zeros((1, 1)), 2000.0, FIG19.base_pose)
    assert depth_at_poses(motion, FIG19) == pytest.approx(beyond, abs=1e-3)


def test_a_link_that_is_longer_than_the_maze_does_not_fit():
    trial = try_planner(FIG19, 1e4, "beam")
    assert (trial.status, trial.came, trial.motion) == ("does not fit", 0.0, None)


@given(
    st.floats(-1e3, 1e3),
    st.floats(0.01, 1e3),
    st.lists(st.floats(0.0, 10.0), min_size=3, max_size=9, unique=True).filter(lambda x: np.ptp(x) > 0.1),
)
def test_a_straight_line_is_fitted_exactly(start, slope, x):
    fit = line(x, start + slope * np.array(x))
    assert fit["slope"] == pytest.approx(slope, rel=1e-3, abs=1e-6)
    assert fit["r2"] == pytest.approx(1.0, abs=1e-6)


def test_no_line_is_better_than_its_own():
    fit = line([0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 4.0, 9.0])
    assert fit["slope"] == pytest.approx(3.0)
    assert fit["start"] == pytest.approx(-1.0)
    assert fit["r2"] == pytest.approx(1.0 - 4.0 / 49.0)


def test_poses_one_by_one_are_those_of_the_whole_run():
    geometry = survey(FIG19)
    timed = time_each_pose(geometry, 430.0, CLAMPED, repeats=2)
    assert timed.at_goal
    assert len(timed.feeds) == len(timed.seconds) == len(timed.links_out)
    assert (np.diff(timed.feeds) > 0.0).all() and (timed.seconds > 0.0).all()
    motion = try_planner(FIG19, 430.0, "beam").motion
    assert np.array_equal(motion.feed[1:], timed.feeds)
    assert timed.links_out[-1] == motion.n_links


def test_an_arm_that_grows_is_looked_at_where_it_comes_to():
    growth = growth_with_arm(1, (2, 4, 500), "beam")
    assert [row["n_links"] for row in growth["rows"]] == [2, 4]
    assert all(0.0 < row["least_s"] <= row["median_s"] for row in growth["rows"])


def test_a_family_whose_rod_is_known_has_the_one_that_is_proved():
    for name in ("L", "U40"):
        assert family_rod(name) == (RODS[name], True)
    rod, closed = family_rod("S0")
    assert not closed and 1222.0 < rod < 1230.0


def test_the_longest_link_of_a_family_passes_and_is_validated():
    row = scan_family("U40", "beam", 0.1, 0.4)
    trial = try_planner(maze_of("U40"), row["longest"], "beam")
    assert validate(trial.motion, maze_of("U40")).valid
    longer = row["longest"] + 0.1 * row["rod"]
    assert longer > row["rod"] or not try_planner(maze_of("U40"), longer, "beam").solved


def test_rows_are_in_the_order_of_their_tasks_in_one_process_and_in_many():
    tasks = [("fig19", length, "follow", True) for length in (430.0, 150.0, 200.0)]
    assert trials(tasks, 0) == trials(tasks, 2)


def test_a_part_that_is_not_there_is_named():
    with pytest.raises(InputError, match=r"Unknown part 'colour'\. Available: workspaces, poses"):
        run_paper(TINY, parts=("colour",))


def test_the_command_prints_json_or_tables_and_writes_all(monkeypatch, tmp_path):
    monkeypatch.setattr(paper, "QUICK", TINY)
    file = tmp_path / "paper.json"
    arguments = ["bench", "paper", "--quick", "--parts", "poses"]
    done = CliRunner().invoke(app, [*arguments, "--out", str(file), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout) == json.loads(file.read_text())
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0
    assert "**poses**" in done.stdout and "**rules**" not in done.stdout
