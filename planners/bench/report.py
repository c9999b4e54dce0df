"""The report of a benchmark: tables and pictures of the studies that are there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from hrsnake_env.files import replacing
from planners.bench.report_learners import learner_table
from planners.bench.report_page import Picture, Section, Table, html_page, markdown_page
from planners.bench.report_pictures import draw_index, draw_ladder, draw_links, draw_profiles
from planners.bench.report_rows import RANDOM, Row, is_learner, ladder_order, machines, of_study, read_rows
from planners.bench.report_tables import below_table, ladder_tables, runs_in_words, tightest_table, time_table

__all__ = ["write_report"]

TITLE = "Planners and learners beside each other"

BENDS = ("bend", "u-turn", "s-bend")
SPACES = ("random", "clutter")

INTERVALS = (
    "Success means that the goal was reached in the simulator, or, where nothing was simulated, that the "
    "exact checker passed the motion. Its intervals are those of the posterior with a uniform prior, and a "
    "single run has none. They count the episodes of one trained policy as independent, which makes them too "
    "narrow; intervals of interquartile means are over trainings. Times are wall-clock and include the "
    "exact check; of planners only successes are timed."
)


def write_report(folders: Sequence[Path], out: Path) -> list[Path]:
    """Write tables and pictures of all studies that are there: report.md, pictures, and report.html.

    Parameters
    ----------
    folders : sequence of Path
        Each with the `rows.parquet` of a study.
    out : Path
        Folder for the report; made if it is missing.

    Returns
    -------
    written : list of Path
        The files, the report in Markdown and the page first.

    Raises
    ------
    InputError
        If there are no rows, or they cannot be read.
    """
    rows = read_rows(folders)
    out.mkdir(parents=True, exist_ok=True)
    sections = [
        _ran(rows, machines(folders)),
        *(section(found, out) for study, section in STUDIES.items() if (found := _rows_of(rows, study))),
    ]
    pictures = [block.name for part in sections for block in part.blocks if isinstance(block, Picture)]
    page = html_page(TITLE, sections, {name: (out / name).read_bytes() for name in pictures})
    for name, text in (("report.md", markdown_page(TITLE, sections)), ("report.html", page)):
        with replacing(out / name) as part:
            part.write_text(text, encoding="utf-8")
    return [out / name for name in ("report.md", "report.html", *pictures)]


def _rows_of(rows: Sequence[Row], study: str) -> list[Row]:
    """Return the rows of a study; over the index, with those of learners trained for the ladder alone.

    These stand at the study's nearest index, so that its columns stay whole.
    """
    found = of_study(rows, study)
    if study != "index" or not found:
        return found
    known = {row["method"] for row in found}
    indices = {shape: sorted({row["index"] for row in found if row["shape"] == shape}) for shape in BENDS}
    return found + [
        {**row, "index": min(indices[row["shape"]], key=lambda index: abs(index - row["index"]))}
        for row in of_study(rows, "ladder")
        if indices.get(row["shape"]) and is_learner(row) and row["method"] not in {*known, RANDOM}
    ]


def _ran(rows: Sequence[Row], where: Sequence[str]) -> Section:
    """Say what was run, and what was not."""
    missing = [study for study in STUDIES if not of_study(rows, study)]
    unknown = sorted({row["study"] for row in rows} - set(STUDIES))
    text = [INTERVALS, *runs_in_words(rows)]
    if where:
        text.append(f"Measured on {'; '.join(where)}.")
    if missing:
        text.append(f"Not measured, and left out: {', '.join(missing)}.")
    if unknown:
        text.append(f"Measured, but not known to this report: {', '.join(unknown)}.")
    return Section(title="What was run", text=text)


def _ladder(rows: Sequence[Row], out: Path) -> Section:
    draw_ladder(rows, out / "ladder.png")
    blocks: list[Table | Picture] = [
        Picture(
            name="ladder.png",
            text="Success in percent on the rungs of the ladder, easy ones first; of learners with "
            "deterministic actions. White: not measured.",
        ),
        below_table(rows),
        *ladder_tables(rows),
    ]
    if times := time_table(rows, ladder_order(rows)):
        blocks.append(times)
    return Section(
        title="The ladder", text=[_missing(rows)], blocks=[*blocks, *_learners(rows, out, "ladder")]
    )


def _index(rows: Sequence[Row], out: Path) -> Section:
    blocks: list[Table | Picture] = []
    own = of_study(rows, "index")
    for shapes, name in ((BENDS, "index.png"), (SPACES, "index-spaces.png")):
        here = {row["shape"] for row in own}
        if chosen := [shape for shape in shapes if shape in here]:
            draw_index(rows, chosen, out / name)
            text = (
                f"Success (above) and median time of planners (below) over the index I: {', '.join(chosen)}. "
                "Learners trained for the ladder alone are shown near its rungs. White: not measured. "
                "Marks above the times: fewer than half of the runs succeed."
            )
            blocks.append(Picture(name=name, text=text))
    if times := time_table(own):
        blocks.append(times)
    absent = [shape for shape in (*BENDS, *SPACES) if shape not in {row["shape"] for row in own}]
    said = [_missing(own)] + ([f"Shapes not measured: {', '.join(absent)}."] if absent else [])
    return Section(title="Over the index", text=said, blocks=[*blocks, *_learners(own, out, "index")])


def _links(rows: Sequence[Row], out: Path) -> Section:
    rows = [row for row in rows if not is_learner(row)]
    if not rows:
        return Section(title="Over the number of links", text=["No planner was measured."])
    draw_links(rows, out / "links.png")
    text = (
        "Median time of planners over the number of links, at several indices. Marks above the times: fewer "
        "than half of the runs succeed."
    )
    blocks: list[Table | Picture] = [Picture(name="links.png", text=text)]
    if times := time_table(rows):
        blocks.append(times)
    return Section(title="Over the number of links", text=[_missing(rows)], blocks=blocks)


def _tightest(rows: Sequence[Row], out: Path) -> Section:
    text = (
        "The largest index at which a motion is valid (no penetration at any pose, at most 0.001 link "
        "lengths anywhere between poses), bold the largest of each maze; and the largest at which the exact "
        "checker finds no penetration between poses either. The index is the link's length over the longest "
        "rod that passes the maze: nothing passes above 1."
    )
    return Section(title="The tightest links", text=[text, _missing(rows)], blocks=[tightest_table(rows)])


def _learners(rows: Sequence[Row], out: Path, study: str) -> list[Table | Picture]:
    """Return tables of scores, and profiles."""
    blocks: list[Table | Picture] = []
    for actions in ("mean", "sampled"):
        if table := learner_table(rows, actions):
            blocks.append(table)
    name = f"profiles-{study}.png"
    if draw_profiles(rows, out / name):
        text = (
            "Performance profiles: of planners the share of runs that succeed within a time, of learners the "
            "share of runs above a score (return: 0 the random policy, 1 our planner). Higher is better. On "
            "tasks common to all methods shown; methods with less than half as many tasks are left out."
        )
        blocks.append(Picture(name=name, text=text))
    return blocks


def _missing(rows: Sequence[Row]) -> str:
    """Say which methods were not measured on which number of tasks."""
    tasks = {row["task"] for row in rows}
    by_method: dict[str, set[str]] = {}
    for row in rows:
        by_method.setdefault(row["method"], set()).add(row["task"])
    part = [f"{name} on {len(here)}" for name, here in sorted(by_method.items()) if len(here) < len(tasks)]
    return f"{len(tasks)} task{'s' * (len(tasks) != 1)}" + (
        f"; not all methods on all: {', '.join(part)}." if part else ", all methods on all."
    )


STUDIES: dict[str, Callable[[Sequence[Row], Path], Section]] = {
    "ladder": _ladder,
    "index": _index,
    "links": _links,
    "tightest": _tightest,
}
"""How the section of each study is made."""
