"""The pages of the environments, one for each id, as Markdown: from the spaces, the docstring and the scores.

`docs/site_hook.py` puts them into the site; none is committed. Pictures are drawn by
`docs/make_environment_pictures.py`, scores measured by `benchmarks/environment_scores.py`.
"""

from __future__ import annotations

import functools
import inspect
import json
import math
import re
from pathlib import Path
from typing import Any

import environment_docstring as doc
import gymnasium as gym
from environment_tables import as_table, bounds, span

from hrsnake_env import ENVIRONMENTS, LADDER
from hrsnake_env.env import HyperRedundantMazeEnv
from hrsnake_env.ladder import Rung
from hrsnake_env.observation import observation_parts
from hrsnake_env.physics import CONTROL_TIMESTEP
from hrsnake_env.random_mazes import N_TASKS, index_of_difficulty
from hrsnake_env.task import FEED_STEP

__all__ = ["BASE", "MARKER", "SCORES", "groups", "overview", "page", "picture", "pictures", "short_name"]

BASE = "HyperRedundantMaze-v0"
FOLDER = Path(__file__).parent / "environments"
SCORES = FOLDER / "scores.json"
MARKER = "<!-- the table of all environments -->"
POLICIES = {
    "random": "random actions",
    "follow": "follow-the-leader",
    "planner": "planner",
}


MAKE = """\
```python
import gymnasium as gym
import hrsnake_env  # registers the ids

env = gym.make("{name}")
```"""
PICTURES = """\
![The arm, planned and simulated, at the goal](pictures/{stem}.png){{ .maze }}
![The planner's episode](pictures/{stem}.gif){{ .maze }}"""


def short_name(name: str) -> str:
    """Return what tells an id from the others.

    Examples
    --------
    >>> short_name("HyperRedundantMaze-UTurn-I50-Sparse-v0")
    'UTurn-I50-Sparse'
    """
    return name.removesuffix("-v0").removeprefix("HyperRedundantMaze").removeprefix("-") or "Any maze"


def groups() -> dict[str, list[str]]:
    """Return all ids in the order and under the headings in which the site lists them."""
    found: dict[str, list[str]] = {title: [] for title in ("Any maze", "Ladder", "Ladder, sparse", "Random")}
    for name, task in ENVIRONMENTS.items():
        if name == BASE:
            found["Any maze"].append(name)
        elif task["kwargs"]["maze"] == "random":
            found["Random"].append(name)
        else:
            found["Ladder" if task["kwargs"]["reward_type"] == "dense" else "Ladder, sparse"].append(name)
    return found


def picture(name: str) -> str:
    """Return the stem of an id's pictures; dense and sparse rewards share them."""
    arguments = ENVIRONMENTS[name]["kwargs"]
    maze = arguments.get("maze", "any")
    if maze != "random":
        return str(maze)
    return f"random-{'long-' if 'n_links' in arguments else ''}{arguments['split']}"


def pictures() -> dict[str, str]:
    """Return the stem of every picture, and the first id that it belongs to."""
    return {picture(name): name for name in reversed(ENVIRONMENTS)}


def page(name: str) -> str:
    """Return the page of an id."""
    env = made(name)
    parts = [
        f"# {name}",
        role(name),
        MAKE.format(name=name),
        PICTURES.format(stem=picture(name)),
        "## Facts",
        as_table(facts(name)[0], facts(name)[1:]),
        "## Scores",
        scores(name),
        "## Description",
        doc.section("Description"),
        "## Action Space",
        *action_space(name, env),
        "## Observation Space",
        *observation_space(name, env),
        "## Rewards",
        *rewards(name),
    ]
    for title in ("Starting State", "Episode End", "Info"):
        parts += [f"## {title}", doc.section(title)]
        if title == "Episode End" and name != BASE:
            parts.append(f"The time limit of this id is {limit(name)} steps.")
    parts += ["## Arguments", arguments(name), "## Version History", doc.section("Version History")]
    return "\n\n".join(parts) + "\n"


def overview(text: str) -> str:
    """Return the overview: its text, with the table of all ids in the place of the marker."""
    tables = []
    for title, names in groups().items():
        rows = [
            (
                f"![](pictures/{picture(name)}.png){{ .thumbnail loading=lazy }}",
                f"[{short_name(name)}]({name}.md){{ .id }}"
                + (f"<br>[sparse]({twin(name)}.md)" if twin(name) else ""),
                str(made(name).unwrapped.arm.n_links),
                index(name),
                role(name),
            )
            for name in names
            if "-Sparse" not in name
        ]
        if not rows:
            continue
        tables.append(f"## {title}\n\n" + as_table(("", "id", "links", "index", "role"), rows))
    before, after = text.split(MARKER)
    return before + "\n\n".join(tables) + after


# What the parts say


def role(name: str) -> str:
    """Return one sentence: what an id is for."""
    if name == BASE:
        return "Any maze and any arm, by keyword arguments; by default the paper's benchmark, shorter links."
    arguments = ENVIRONMENTS[name]["kwargs"]
    if arguments["maze"] != "random":
        return rung(name).role
    bends = ", tight and with ten bends and more" if "difficulty" in arguments else ""
    if arguments["split"] == "train":
        return f"A new maze at every reset{bends}, to train on."
    return f"{N_TASKS['test']} mazes{bends}, to measure on; none of them is among those to train on."


def facts(name: str) -> list[tuple[str, str]]:
    """Return rows of name and value."""
    arm, arguments = made(name).unwrapped.arm, ENVIRONMENTS[name]["kwargs"]
    maze, units = made(name).unwrapped.maze, made(name).unwrapped.maze.units
    is_random = arguments.get("maze") == "random"
    reward = arguments.get("reward_type", "dense")
    return [
        ("maze", f"drawn at each reset, split `{arguments['split']}`" if is_random else f"`{maze.name}`"),
        ("link length", f"{arm.link_length:.4g} {units}"),
        ("links", f"{arm.n_links}"),
        ("longest rod that passes", longest_rod(name)),
        ("index", index(name)),
        ("reward type", f"{reward}; [the other]({twin(name)}.md)" if twin(name) else reward),
        ("time limit", f"{limit(name)} steps of {CONTROL_TIMESTEP:g} s"),
    ]


def twin(name: str) -> str | None:
    """Return the id with the other rewards, if there is one."""
    sparse = "-Sparse-v0"
    other = name.replace(sparse, "-v0") if name.endswith(sparse) else name.replace("-v0", sparse)
    return other if other in ENVIRONMENTS else None


def longest_rod(name: str) -> str:
    """Return the longest rod that passes the maze of an id, with its unit."""
    if ENVIRONMENTS[name]["kwargs"].get("maze") == "random":
        return "another in each maze"
    rod, units = rung(name).longest_rod, made(name).unwrapped.maze.units
    return "any, as there is no turn" if math.isinf(rod) else f"{rod:.4g} {units}"


def index(name: str) -> str:
    """Return the index of an id: link length over the longest rod."""
    if ENVIRONMENTS[name]["kwargs"].get("maze") == "random":
        low, high = ENVIRONMENTS[name]["kwargs"].get("difficulty", (0.0, 1.0))
        return f"{index_of_difficulty(low):.2g} to {index_of_difficulty(high):.2g}"
    return f"{made(name).unwrapped.arm.link_length / rung(name).longest_rod:.2f}"


def scores(name: str) -> str:
    """Return the table of an id's scores."""
    measured = read_scores()["scores"][name]
    rows = []
    for policy, title in POLICIES.items():
        score = measured[policy]
        n, run = score["episodes"], score["run"]
        if run == 0:
            rows.append((title, f"{n}", "no valid motion", "", "", ""))
            continue
        rows.append(
            (
                title,
                f"{n}" if run == n else f"{n}, no valid motion in {n - run}",
                f"{100.0 * score['success']:.3g} %",
                f"{score['return']:.2f}",
                f"{score['steps']:.0f}",
                f"{score['collided']}",
            )
        )
    heads = ("policy", "episodes", "success", "return", "steps", "collided")
    note = (
        "Means over the episodes; one without a valid motion counts as a failure with return 0, and has no "
        "steps; collided are those with a collision. Follow-the-leader keeps all joints on the way of the "
        "tip. Measured by "
        f"`{read_scores()['command']}`."
    )
    return as_table(heads, rows) + "\n\n" + note


def action_space(name: str, env: gym.Env[Any, Any]) -> list[str]:
    """Return the text and the table of an action space, in numbers of this id's."""
    arm, units, space = env.unwrapped.arm, env.unwrapped.maze.units, env.action_space
    heads, feed, joints = doc.table("Action Space")
    rows = [
        (span(start, stop), *bounds(space, start, stop), *cells[1:])
        for cells, start, stop in ((feed, 0, 1), (joints, 1, 1 + arm.n_links))
    ]
    numbers = as_table(("index", "min", "max", *heads[1:]), rows)
    step = f"A change of {FEED_STEP:g} links is {FEED_STEP * arm.link_length:.3g} {units}."
    if name == BASE:
        return [doc.section("Action Space"), f"Without arguments, `{space}`:", numbers, step]
    first, *others = doc.paragraphs("Action Space")
    return [re.sub(r"^`Box\([^`]*`", f"`{space}`", first), numbers, step, *others]


def observation_space(name: str, env: gym.Env[Any, Any]) -> list[str]:
    """Return the text and the table of an observation space, in numbers of this id's."""
    arm, maze, space = env.unwrapped.arm, env.unwrapped.maze, env.observation_space
    meanings = {cells[0]: cells[2] for cells in doc.table("Observation Space")}
    rows, start = [], 0
    for part, (length, _) in observation_parts(arm.n_links).items():
        rows.append(
            (span(start, start + length), f"`{part}`", meanings[part], *bounds(space, start, start + length))
        )
        start += length
    assert space.shape == (start,)
    numbers = as_table(("index", "part", "meaning", "min", "max"), rows)
    box = f"`Box(low, 1, ({start},), float32)`"
    reach = f"{arm.n_links} links of {arm.link_length:.4g} {maze.units}"
    if name == BASE:
        return [doc.section("Observation Space"), f"Without arguments, {box}:", numbers]
    return [
        f"{box}, cut to its bounds. The reach is the length of the arm: {reach}.",
        numbers,
        *own_paragraphs("Observation Space"),
        f"Goals for hindsight replay, pictures and rays: [all modes]({BASE}.md#observation-space).",
    ]


def rewards(name: str) -> list[str]:
    """Return the text and the table of an id's rewards."""
    if name == BASE:
        return [doc.section("Rewards")]
    kind = ENVIRONMENTS[name]["kwargs"]["reward_type"]
    rows = [
        (term, dense if kind == "dense" or sparse == "the same" else sparse)
        for term, dense, sparse in doc.table("Rewards")[1:]
    ]
    first, *others = own_paragraphs("Rewards")
    return [first, as_table(("term", f'`reward_type="{kind}"`'), rows), *others]


def own_paragraphs(title: str) -> list[str]:
    """Return the paragraphs of a section that hold for the ids of the ladder: they observe the state."""
    return [text for text in doc.paragraphs(title) if not re.match(r'(With )?`observation="', text)]


def arguments(name: str) -> str:
    """Return the table of the arguments, with the values that they have in an id."""
    given = ENVIRONMENTS[name]["kwargs"]
    rows = []
    for parameter in list(inspect.signature(HyperRedundantMazeEnv).parameters.values()):
        kind, meaning = doc.arguments()[parameter.name]
        value = given.get(parameter.name, parameter.default)
        shown = f"**`{value!r}`**" if parameter.name in given else f"`{value!r}`"
        rows.append((f"`{parameter.name}`", shown, f"{kind}. {meaning}"))
    note = "Bold: set by this id. `gym.make` takes any of them.\n\n" if given else ""
    return note + as_table(("argument", "value" if given else "default", "meaning"), rows)


# Small parts


@functools.cache
def made(name: str) -> gym.Env[Any, Any]:
    """Return an environment, made once."""
    return gym.make(name)


@functools.cache
def read_scores() -> dict[str, Any]:
    """Return what was measured."""
    data: dict[str, Any] = json.loads(SCORES.read_text(encoding="utf-8"))
    return data


def rung(name: str) -> Rung:
    """Return the rung of an id's maze."""
    return LADDER[made(name).unwrapped.maze.name]


def limit(name: str) -> str:
    """Return the time limit of an id, in steps."""
    return f"{ENVIRONMENTS[name]['max_episode_steps']:,}"
