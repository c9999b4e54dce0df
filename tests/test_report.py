"""The report of a benchmark, made of small rows whose figures are worked by hand."""

import json
import math
import re
import sys

import numpy as np
import pytest

from hrsnake_env.errors import InputError
from hrsnake_env.ladder import LADDER
from planners.bench.report import write_report
from planners.bench.report_charts import LANE, new_figure, seconds_axis, show_shares, style_of, time_curves
from planners.bench.report_learners import learner_table, matrix, normalised_runs, shared_tasks, success_runs
from planners.bench.report_page import Section, Table, html_page, markdown_page
from planners.bench.report_rows import (
    COLUMNS,
    METHODS,
    ladder_order,
    links_of,
    machines,
    methods_of,
    read_rows,
    succeeded,
    time_limit,
    typical_seconds,
)
from planners.bench.report_tables import (
    below_table,
    duration,
    ladder_tables,
    percent,
    runs_in_words,
    tightest_table,
    time_cell,
    time_table,
)
from planners.cli import main

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")

PLAIN = {
    **dict.fromkeys(COLUMNS),
    **{"study": "ladder", "method": "auto", "task": "u-turn-i60", "shape": "u-turn", "maze": "u-turn-i60"},
    **{"link_length": 264.0, "n_links": 5, "longest_rod": 440.0, "index": 0.6, "seed": 0, "episode": 0},
    **{"actions": "planned", "budget": 60.0, "budget_unit": "s", "status": "solved", "reason": ""},
    **{"solved": True, "seconds": 0.1, "cpu_seconds": 0.1, "check_seconds": 0.01, "train_steps": 0},
}
FAILED = {"solved": False, "status": "dead end"}
LATE = {"solved": False, "status": "out of time", "seconds": 60.2}


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    """Draw with few pixels, which is faster."""
    monkeypatch.setattr("planners.bench.report_charts.DPI", 40)


def row(**changes):
    """Return a row of a planner that has solved a rung."""
    return PLAIN | changes


def trained(method, task, seed, successes, trials=4, actions="mean", result=None):
    """Return the rows of a policy that reaches the goal in some episodes."""
    facts = {"method": method, "task": task, "seed": seed, "actions": actions, "status": "evaluated"}
    facts |= {"budget": 1000.0, "budget_unit": "steps", "seconds": 30.0, "train_steps": 1000}
    every = [k < successes for k in range(trials)]
    return [
        row(**facts, episode=k, solved=done, success=done, clean=done, **{"return": result})
        for k, done in enumerate(every)
    ]


def write(folder, rows, **columns):
    """Write rows as a study does; some columns with other types, or with none of them left out."""
    folder.mkdir(exist_ok=True)
    types = {name: kind for name, kind in (COLUMNS | columns).items() if kind}
    schema = pyarrow.schema([(name, pyarrow.type_for_alias(kind)) for name, kind in types.items()])
    kept = [{name: value for name, value in each.items() if name in types} for each in rows]
    parquet.write_table(pyarrow.Table.from_pylist(kept, schema), folder / "rows.parquet")
    return folder


def cells(table, first):
    """Return the row of a table that begins with a cell."""
    return next(dict(zip(table.head, line, strict=True)) for line in table.rows if line[0] == first)


# Rows


def test_rows_are_read_as_they_were_written(tmp_path):
    rows = [row(), row(method="beam", success=False, worst_depth=-0.25, pinches=3)]
    assert read_rows([write(tmp_path / "a", rows)]) == rows


def test_rows_of_several_folders_are_put_together(tmp_path):
    folders = [write(tmp_path / study, [row(study=study)]) for study in ("ladder", "links")]
    assert [each["study"] for each in read_rows(folders)] == ["ladder", "links"]


@pytest.mark.parametrize(
    ("rows", "columns", "message"),
    [
        ([], {}, "at least one row, got none"),
        ([row(), row()], {}, "every run once, got 2 rows with study ladder, method auto, task u-turn-i60"),
        ([row()], {"solved": "", "seed": ""}, "has no column seed, solved"),
        ([row(seconds="fast")], {"seconds": "string"}, "columns of the types of a study in"),
        ([row(solved=None)], {}, "columns of the types of a study in"),
    ],
)
def test_rows_that_are_not_those_of_a_study_are_refused(tmp_path, rows, columns, message):
    folder = write(tmp_path / "a", rows, **columns)
    with pytest.raises(InputError, match=message):
        read_rows([folder])


def test_a_folder_without_rows_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"folder with rows\.parquet.*there is no"):
        read_rows([tmp_path])
    (tmp_path / "rows.parquet").write_text("no rows", encoding="utf-8")
    with pytest.raises(InputError, match="Expected a Parquet file"):
        read_rows([tmp_path])
    with pytest.raises(InputError, match="at least one folder"):
        read_rows([])


def test_the_simulator_decides_on_success_where_it_ran():
    assert succeeded(row()) and not succeeded(row(solved=False))
    assert not succeeded(row(solved=True, success=False)) and succeeded(row(solved=False, success=True))


@pytest.mark.parametrize(
    ("runs", "seconds"),
    [
        ([{}], 0.1),
        ([{"seconds": 1.0}, {"seconds": 3.0}, {"seconds": 2.0}], 2.0),
        ([{"seconds": 1.0}, FAILED], math.inf),
        ([{"seconds": 1.0}, {"seconds": 2.0}, FAILED], 2.0),
        ([LATE], math.inf),
    ],
)
def test_failures_are_slower_than_every_success(runs, seconds):
    assert typical_seconds([row(**run) for run in runs]) == seconds


def test_a_time_limit_is_claimed_only_where_it_was_reached():
    assert time_limit([row(**LATE)]) == 60.0
    assert time_limit([row(**FAILED)]) is None
    assert time_limit([row(**LATE), row(**FAILED), row(**FAILED)]) is None
    assert time_limit([row()]) is None


def test_rungs_stand_in_the_order_of_the_ladder_and_families_last():
    names = ["random-long", *reversed(LADDER), "random"]
    n_links = {"random-long": 30, "random": 8}
    rows = [row(task=name, maze=name, n_links=n_links.get(name, 5)) for name in names]
    assert ladder_order(rows) == [*LADDER, "random", "random-long"]


def test_ours_come_first_and_unknown_methods_last():
    rows = [row(method=name) for name in ("zebra", "rrt-connect", "auto", "ppo", "beam", "abacus")]
    assert methods_of(rows) == ["auto", "beam", "rrt-connect", "ppo", "abacus", "zebra"]


def test_the_number_of_links_is_that_of_the_runs_that_succeed():
    assert links_of([row(n_links=9), row(n_links=40, **FAILED)]) == 9
    assert links_of([row(n_links=40, **FAILED), row(n_links=0, **FAILED)]) == 40
    assert links_of([row(n_links=None)]) is None


def test_machines_are_named_once_and_broken_manifests_ignored(tmp_path):
    run = {"workers": 2, "machine": {"cores": 4, "processor": "Z80", "python": "3.11"}}
    (tmp_path / "manifest.json").write_text(json.dumps({"runs": [run, run]}), encoding="utf-8")
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "manifest.json").write_text("[1", encoding="utf-8")
    told = machines([tmp_path, tmp_path / "b", tmp_path / "c"])
    assert told == ["4 cores of Z80, Python 3.11, 2 at a time"]


# Tables


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.0012, "1.2 ms"), (0.123, "123 ms"), (1.0, "1 s"), (90.0, "90 s"), (600.0, "10 min")],
)
def test_times_are_written_as_people_read_them(seconds, text):
    assert duration(seconds) == text


@pytest.mark.parametrize(
    ("share", "text"), [(1.0, "100 %"), (0.999, "99.9 %"), (0.0, "0 %"), (0.002, "0.2 %")]
)
def test_only_all_is_100_percent_and_only_none_0(share, text):
    assert percent(share) == text


def test_a_rung_shows_index_links_follow_the_leader_and_successes():
    rows = [row(method="auto", seconds=0.02), row(method="follow", **FAILED)]
    rows += [row(method="rrt-connect", seed=seed, seconds=1.0 + seed) for seed in (0, 1)]
    rows += [row(method="rrt-connect", seed=2, **LATE)]
    ours, others = ladder_tables(rows)
    expected = {"rung": "u-turn-i60", "I": "0.60", "links": "5", "follow-the-leader": "fails"}
    assert cells(ours, "u-turn-i60") == expected | {"**auto**": "solved, 20 ms"}
    # Beta(3, 2) has 2.5 % of its probability below 0.194, and as much above 0.932.
    shares = {"follow": "fails", "rrt-connect": "67 % (19 to 93), 1.5 s"}
    assert cells(others, "u-turn-i60") == expected | shares


def test_learners_are_shown_with_both_kinds_of_actions_and_the_time_of_training():
    rows = trained("ppo", "u-turn-i60", 0, 0) + trained("ppo", "u-turn-i60", 0, 4, actions="sampled")
    mean, sampled = ladder_tables(rows)
    # 1 - 0.025^(1/5) = 0.52
    assert cells(mean, "u-turn-i60")["ppo"] == "0 % (0 to 52), 30 s"
    assert cells(sampled, "u-turn-i60")["ppo"] == "100 % (48 to 100), 30 s"


def test_the_rung_is_named_below_which_a_method_first_stays():
    order = list(LADDER)[:5]
    shares = {"follow": (4, 0, 4, 0, 0), "auto": (4, 1, 4, 1, 4), "backbone": (0, 0, 0, 0, 0)}
    rows = [
        row(method=method, task=task, maze=task, episode=k, **({} if k < count else FAILED))
        for method, counts in shares.items()
        for task, count in zip(order, counts, strict=True)
        for k in range(4)
    ]
    table = below_table(rows)
    first, stays = "first rung below 10 %", "below 10 % from here on"
    named = {name: (cells(table, name)[first], cells(table, name)[stays]) for name in ("follow", "backbone")}
    assert named == {"follow": (order[1], order[3]), "backbone": (order[0], order[0])}
    assert (cells(table, "**auto**")[first], cells(table, "**auto**")[stays]) == ("none", "none")


def test_clean_is_counted_among_simulated_successes():
    rows = [row(episode=k, success=k < 3, clean=k != 0) for k in range(4)]
    assert cells(below_table(rows), "**auto**")["clean"] == "67 %"
    assert cells(below_table([row()]), "**auto**")["clean"] == "-"


@pytest.mark.parametrize(
    ("runs", "text"),
    [
        ([], "-"),
        ([{"seconds": 0.05}], "50 ms (0.5x)"),
        ([{"seconds": 6.4}], "6.4 s (64x)"),
        ([LATE], "> 60 s (> 600x)"),
        ([LATE, LATE, {"seconds": 1.0}], "> 60 s (> 600x)"),
        ([FAILED], "dead end"),
        ([{"solved": False, "status": "error: worker died"}], "error"),
        ([{"success": False}], "not at the goal"),
    ],
)
def test_a_time_beside_ours_claims_a_ratio_only_where_there_is_one(runs, text):
    assert time_cell([row(**run) for run in runs], 0.1) == text


def test_without_our_time_there_is_no_ratio():
    assert time_cell([row(seconds=2.0)], math.inf) == "2 s"
    rows = [row(**FAILED), row(method="aorrtc", seconds=2.0)]
    line = cells(time_table(rows), "u-turn-i60")
    assert (line["**auto**"], line["aorrtc"]) == ("not solved", "2 s")
    assert time_table([row(method="aorrtc")]) is None and time_table([row()]) is None


def test_the_tightest_link_is_the_longest_that_passes_and_shorter_failures_are_counted():
    passes = {0.2: 0.0, 0.4: None, 0.6: 0.0, 0.8: 2e-4, 0.9: None}
    rows = [
        row(
            study="tightest",
            maze="fig19",
            episode=number,
            index=index,
            worst_depth=depth,
            seconds=index,
            n_links=7,
        )
        | (FAILED if depth is None else {})
        for number, (index, depth) in enumerate(passes.items())
    ]
    rows += [row(study="tightest", maze="fig19", method="beam", index=0.3)]
    table = tightest_table(rows)
    assert list(cells(table, "fig19: auto").values())[1:] == [
        *("**0.800**", "0.600", "7", "800 ms", "1 of 3", "440"),
    ]
    assert cells(table, "fig19: beam")["without penetration"] == "not measured"


def test_errors_are_told_and_count_as_failures():
    rows = [row(), row(seed=1, solved=False, status="error: worker died")]
    told = list(runs_in_words(rows))
    assert told[0] == "**ladder**: auto (1 task, 2 seeds, 2 rows, 60 s)."
    assert "1 rows of ladder are errors" in told[1] and "auto on u-turn-i60: worker died" in told[1]
    (table,) = ladder_tables(rows)
    assert cells(table, "u-turn-i60")["**auto**"].startswith("50 %")


# Learners


def test_a_run_scores_0_as_the_random_policy_and_1_as_the_planner():
    rows = [row(**{"return": 9.0}), *trained("random", "u-turn-i60", 0, 0, actions="sampled", result=1.0)]
    for seed, result in enumerate((1.0, 5.0, 9.0, 13.0)):
        rows += trained("ppo", "u-turn-i60", seed, 4, result=result)
    assert normalised_runs(rows, "mean") == {"ppo": {"u-turn-i60": [0.0, 0.5, 1.0, 1.5]}}


@pytest.mark.parametrize("planner", [[], [row(**{"return": None})], [row(**{"return": 1.0})]])
def test_without_a_better_planner_there_is_no_scale(planner):
    rows = planner + trained("random", "u-turn-i60", 0, 0, actions="sampled", result=1.0)
    assert normalised_runs(rows + trained("ppo", "u-turn-i60", 0, 4, result=3.0), "mean") == {}


def test_success_runs_are_shares_by_seed():
    rows = trained("ppo", "a", 0, 1) + trained("ppo", "a", 1, 4) + trained("ppo", "b", 0, 2)
    scores = success_runs(rows, "mean")
    assert scores == {"ppo": {"a": [0.25, 1.0], "b": [0.5]}}
    assert matrix(scores["ppo"], ["a", "b"]).tolist() == [[0.25, 0.5]]
    assert success_runs(rows, "sampled") == {}


def test_learners_with_few_tasks_do_not_take_tasks_from_the_others():
    scores = {
        "ppo": {"a": [1.0], "b": [1.0], "c": [1.0]},
        "dagger": {"b": [0.0], "c": [0.0]},
        "sac": {"a": [0.0]},
    }
    assert shared_tasks(scores) == (["b", "c"], ["ppo", "dagger"])
    assert shared_tasks({}) == ([], [])


def test_learners_are_compared_with_ppo_on_the_tasks_of_both():
    rows = [each for seed in range(3) for each in trained("ppo", "a", seed, 1)]
    rows += [each for seed in range(3) for task in "ab" for each in trained("dagger", task, seed, 4)]
    table = learner_table(rows, "mean")
    line = cells(table, "dagger")
    assert line["seeds x tasks"] == "3 x 2" and line["tasks shared with ppo"] == "1"
    assert line["success, IQM"] == line["better than ppo"] == "1.00 (1.00 to 1.00)"
    assert line["success of ppo there, IQM"] == "0.25 (0.25 to 0.25)"
    assert cells(table, "ppo")["better than ppo"] == "-"
    assert learner_table(rows, "sampled") is None


# Charts


def test_what_is_not_solved_is_drawn_above_the_limit_and_nowhere_else():
    times = {0.2: {"seconds": 0.5}, 0.4: {"seconds": 2.0}, 0.6: LATE}
    rows = [row(task=f"t{index}", index=index, **run) for index, run in times.items()]
    axes = new_figure(3.0).subplots()
    seconds_axis(axes)
    time_curves([axes], [rows], lambda group: group[0]["index"])
    curve, marks = axes.get_lines()
    assert curve.get_xdata().tolist() == [0.2, 0.4, 0.6]
    assert curve.get_ydata()[:2].tolist() == [0.5, 2.0] and np.isnan(curve.get_ydata()[2])
    assert marks.get_xdata().tolist() == [0.6] and min(marks.get_ydata()) > 60.0 * LANE
    assert axes.get_ylim()[1] > max(marks.get_ydata())
    assert all(tick <= 60.0 for tick in axes.get_yticks())


def test_shares_are_written_into_their_cells_and_what_is_missing_stays_white():
    axes = new_figure(3.0).subplots()
    show_shares(axes, np.array([[0.25, np.nan]]), ["a", "b"], ["auto"], numbers=True)
    assert [(text.get_text(), text.get_position()) for text in axes.texts] == [("25", (0.5, 0.5))]
    assert axes.collections[0].get_array().mask.tolist() == [[False, True]]


def test_methods_that_share_a_colour_have_markers_of_their_own():
    looks = [(style_of(name).colour, style_of(name).marker) for name in METHODS]
    assert len(set(looks)) == len(METHODS)


# Pages


def test_cells_cannot_leave_their_place_in_the_page():
    table = Table(head=("a|b",), rows=[("<b>__BODY__ **bold**",)])
    section = Section(title="<i>", blocks=[table])
    page = html_page("x & y", [section], {})
    assert "<b>" not in page and "&lt;b&gt;__BODY__ <strong>bold</strong>" in page and "x &amp; y" in page
    assert "| a\\|b |" in markdown_page("x", [section])


def everything():
    """Return a few rows of every study, planners and learners."""
    rows = []
    for study in ("ladder", "index", "links"):
        for index, task in ((0.3, "u-turn-i30"), (0.6, "u-turn-i60")):
            facts = {
                "study": study,
                "task": task,
                "maze": task,
                "index": index,
                "n_links": 9 if index > 0.5 else 5,
            }
            rows += [
                row(**facts, **{"return": 9.0}),
                row(**facts, method="follow", **(FAILED if index > 0.5 else {})),
            ]
            rows += [
                row(**facts, method="aorrtc", seed=seed, **(LATE if index > 0.5 else {})) for seed in (0, 1)
            ]
            for seed in (0, 1) if study != "links" else ():
                runs = trained("ppo", task, seed, 2, result=5.0) + trained(
                    "dagger", task, seed, 3, result=7.0
                )
                runs += trained("random", task, seed, 0, actions="sampled", result=0.0)
                rows += [each | facts | {"method": each["method"]} for each in runs]
    rows += [
        row(study="index", task=f"{shape}-i60", shape=shape, maze=shape) for shape in ("bend", "clutter")
    ]
    return [*rows, row(study="tightest", task="fig19", maze="fig19", index=0.98, worst_depth=0.0)]


def test_a_report_has_all_studies_and_its_page_needs_nothing_else(tmp_path):
    folder = write(tmp_path / "rows", everything())
    written = write_report([folder], tmp_path / "report")
    names = ["ladder", "profiles-ladder", "index", "index-spaces", "profiles-index", "links"]
    assert [path.name for path in written] == ["report.md", "report.html", *(f"{name}.png" for name in names)]
    assert sorted(path.name for path in (tmp_path / "report").iterdir()) == sorted(
        path.name for path in written
    )
    text, page = (written[k].read_text(encoding="utf-8") for k in (0, 1))
    assert all(f"]({name}.png)" in text for name in names)
    assert page.count("data:image/png;base64,") == len(names)
    assert not re.search(r"<script|https?://|<link|@import", page)
    assert page.count("<table>") == page.count("</table>") == text.count("\n|---")


def test_the_same_rows_give_the_same_figures():
    rows = [each for seed in range(3) for task in "ab" for each in trained("ppo", task, seed, seed + 1)]
    table = learner_table(rows, "mean")
    assert "0.50 (0.50 to 0.50)" not in cells(table, "ppo")["success, IQM"]
    assert table == learner_table(rows, "mean")


@pytest.mark.parametrize(
    ("kept", "left_out"),
    [
        (lambda each: each["study"] == "tightest", "Not measured, and left out: ladder, index, links."),
        (
            lambda each: each["study"] == "index" and each["method"] == "ppo",
            "Shapes not measured: bend, s-bend",
        ),
        (
            lambda each: each["study"] == "index" and each["shape"] == "clutter",
            "bend, u-turn, s-bend, random.",
        ),
        (
            lambda each: each["study"] == "links" and each["method"] == "follow",
            "left out: ladder, index, tightest.",
        ),
        (
            lambda each: each["study"] == "ladder" and each["solved"] is False,
            "not all methods on all: aorrtc on 1",
        ),
    ],
)
def test_what_was_not_measured_is_said_and_left_out(tmp_path, kept, left_out):
    rows = [each for each in everything() if kept(each)]
    written = write_report([write(tmp_path / "rows", rows)], tmp_path / "report")
    assert left_out in written[0].read_text(encoding="utf-8")


def test_an_unknown_study_is_named(tmp_path):
    written = write_report([write(tmp_path / "rows", [row(study="colours")])], tmp_path / "report")
    assert "not known to this report: colours" in written[0].read_text(encoding="utf-8")


@pytest.fixture
def run(capsys, monkeypatch):
    """Return a function that runs the command and returns exit code, stdout and stderr."""

    def run_command(*arguments):
        monkeypatch.setattr(sys, "argv", ["hrsnake", "bench", "report", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return ended.value.code, printed.out, printed.err

    return run_command


def test_the_command_names_the_files_it_has_written(run, tmp_path):
    folder = write(tmp_path / "rows", [row(study="tightest")])
    code, out, err = run(folder, "--out", tmp_path / "report", "--json")
    assert code == 0 and err == ""
    assert json.loads(out)["written"] == [
        str(tmp_path / "report" / name) for name in ("report.md", "report.html")
    ]


def test_bad_input_is_one_sentence_and_exit_code_2(run, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    folder = write(tmp_path / "rows", [row()])
    for arguments, part in (
        ((tmp_path, "--out", tmp_path / "report"), "folder with rows.parquet"),
        ((folder, "--out", tmp_path / "file"), "is a file"),
        ((folder, "--out", tmp_path / "a" / "b"), "existing folder"),
        ((), "FOLDER"),
    ):
        code, out, err = run(*arguments)
        assert code == 2 and out == "" and part in err and err.count("\n") == 1
