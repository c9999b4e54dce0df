"""The site's pages of the environments agree with the code, and the lines of the pages run."""

import json
import re
from pathlib import Path

import gymnasium as gym
import pytest

from hrsnake_env import ENVIRONMENTS

DOCS = Path(__file__).parent.parent / "docs"
PICTURES = DOCS / "environments" / "pictures"
LIMIT = 5_000_000


@pytest.fixture(scope="module")
def pages():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        import make_environment_pages

        yield make_environment_pages


def part_of(page, title):
    """Return what stands below a heading."""
    return page.split(f"\n## {title}\n")[1].split("\n## ")[0]


def last_ranges(text):
    """Return the ranges of indices in the last table that has some, as (first, last)."""
    table = text[text.rindex("| index |") :]
    found = re.findall(r"^\| (\d+)(?:\u00a0to\u00a0(\d+))? \|", table, flags=re.MULTILINE)
    return [(int(first), int(last or first)) for first, last in found]


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_a_page_says_what_the_environment_is(pages, name):
    env = gym.make(name)
    page = pages.page(name)
    assert f"| links | {env.unwrapped.arm.n_links} |" in page
    assert f"| link length | {env.unwrapped.arm.link_length:.4g} px |" in page
    assert f"| time limit | {ENVIRONMENTS[name]['max_episode_steps']:,} steps" in page
    assert f"| reward type | {ENVIRONMENTS[name]['kwargs'].get('reward_type', 'dense')}" in page


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_the_ranges_of_indices_cover_the_spaces_without_gap_or_overlap(pages, name):
    env = gym.make(name)
    page = pages.page(name)
    for title, space in (("Action Space", env.action_space), ("Observation Space", env.observation_space)):
        covered = [k for first, last in last_ranges(part_of(page, title)) for k in range(first, last + 1)]
        assert covered == list(range(space.shape[0])), title


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_the_lines_of_a_page_make_its_environment(pages, name):
    (code,) = re.findall(r"```python\n(import.*?)```", pages.page(name).split("\n## ")[0], flags=re.DOTALL)
    names = {}
    exec(compile(code, name, "exec"), names)
    assert names["env"].spec.id == name


def test_the_page_of_any_maze_has_every_line_of_the_docstring(pages):
    page = pages.page(pages.BASE)
    text = pages.HyperRedundantMazeEnv.__doc__
    before, parameters = text.split("## Arguments")
    missing = [line for line in map(str.strip, before.splitlines()[1:]) if line and line not in page]
    assert [line for line in missing if not line.startswith("|")] == []
    for name in re.findall(r"^    (\w+) : ", parameters, flags=re.MULTILINE):
        assert f"| `{name}` |" in part_of(page, "Arguments"), name


def test_a_sparse_page_has_the_sparse_rewards_alone(pages):
    dense, sparse = (
        part_of(pages.page(f"HyperRedundantMaze-UTurn-I50{kind}-v0"), "Rewards") for kind in ("", "-Sparse")
    )
    assert "| reward_goal | 10 on success |" in dense and "| reward_goal | 1 on success |" in sparse
    contact = [re.findall(r"^\| reward_contact .*$", text, flags=re.MULTILINE) for text in (dense, sparse)]
    assert contact[0] == contact[1] != []


def test_every_id_has_scores_of_all_policies(pages):
    data = json.loads(pages.SCORES.read_text())
    assert list(data["scores"]) == list(ENVIRONMENTS)
    for name, scores in data["scores"].items():
        assert set(scores) == set(pages.POLICIES), name
        for score in scores.values():
            assert 0.0 <= score["success"] <= 1.0 and 0 <= score["run"] <= score["episodes"]
            assert score["success"] * score["episodes"] <= score["run"] and score["collided"] <= score["run"]
            assert (score["steps"] is None) == (score["run"] == 0)
    assert (DOCS.parent / data["command"].removeprefix("python ")).exists()


def test_every_picture_is_there_and_none_besides(pages):
    wanted = {f"{stem}.{kind}" for stem in pages.pictures() for kind in ("png", "gif")}
    assert {path.name for path in PICTURES.iterdir()} - {"fig19.html"} == wanted
    assert sum(path.stat().st_size for path in PICTURES.iterdir()) < LIMIT


def test_the_overview_links_every_page(pages):
    text = pages.overview((DOCS / "environments" / "index.md").read_text())
    assert set(re.findall(r"\(([\w-]+)\.md\)", text)) == set(ENVIRONMENTS)
    assert pages.MARKER not in text


def test_the_lines_for_researchers_run(capsys):
    pytest.importorskip("stable_baselines3")
    text = (DOCS / "reinforcement_learning.md").read_text()
    code = "\n".join(re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL))
    exec(compile(code, "reinforcement_learning.md", "exec"), {})
    last = capsys.readouterr().out.splitlines()[-3:]
    assert all(re.fullmatch(r"True \d+ True", line) for line in last)
