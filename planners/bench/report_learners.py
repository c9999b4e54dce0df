"""Learners beside the planner: scores of their runs, one matrix of seeds and tasks per learner."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from hrsnake_env.arm import FloatArray
from planners.bench.report_page import Table
from planners.bench.report_rows import OURS, RANDOM, Row, grouped, is_learner, methods_of, succeeded
from planners.bench.report_tables import duration
from planners.bench.statistics import (
    Estimate,
    interquartile_mean,
    normalised_score,
    optimality_gap,
    probability_of_improvement,
    stratified_bootstrap,
)

__all__ = ["Scores", "learner_table", "matrix", "normalised_runs", "shared_tasks", "success_runs"]

BASELINE = "ppo"
"""With whose runs those of the other learners are compared."""

SEED = 0
"""Of the bootstrap: the same rows give the same report."""

Scores = Mapping[str, Mapping[str, Sequence[float]]]
"""By learner, then by task: a score per seed."""


def success_runs(rows: Sequence[Row], actions: str) -> Scores:
    """Return the share of successes of every run, with the random policy's beside the learners'."""
    return {
        method: {
            task: [
                float(np.mean([succeeded(row) for row in run]))
                for run in grouped(here, lambda row: row["seed"]).values()
            ]
            for task, here in grouped(group, lambda row: row["task"]).items()
        }
        for method, group in _by_learner(rows, actions).items()
    }


def normalised_runs(rows: Sequence[Row], actions: str) -> Scores:
    """Return the mean return of every run, 0 that of the random policy and 1 that of our planner.

    Tasks on which a reference was not measured, or on which the planner has no higher return, are left out.
    """
    references = _references(rows)
    result: dict[str, dict[str, list[float]]] = {}
    for method, group in _by_learner(rows, actions).items():
        for task, here in grouped(group, lambda row: row["task"]).items():
            means = [_mean_return(run) for run in grouped(here, lambda row: row["seed"]).values()]
            known = [mean for mean in means if mean is not None]
            if task in references and known:
                low, high = references[task]
                scores = normalised_score([[mean] for mean in known], [low], [high])[:, 0]
                result.setdefault(method, {})[task] = scores.tolist()
    return result


def _by_learner(rows: Sequence[Row], actions: str) -> dict[str, list[Row]]:
    chosen = [row for row in rows if row["actions"] == actions and row["method"] != RANDOM]
    groups = grouped(chosen, lambda row: row["method"])
    return {name: groups[name] for name in methods_of(chosen)}


def _mean_return(rows: Iterable[Row]) -> float | None:
    """Return the mean return; None if none is known."""
    known = [row["return"] for row in rows if row["return"] is not None and np.isfinite(row["return"])]
    return float(np.mean(known)) if known else None


def _references(rows: Sequence[Row]) -> dict[str, tuple[float, float]]:
    """Return the mean returns of the random policy and of our planner, where these make a scale."""
    result = {}
    for task, here in grouped(rows, lambda row: row["task"]).items():
        low = _mean_return(row for row in here if row["method"] == RANDOM)
        ours = [[row for row in here if row["method"] == name and not is_learner(row)] for name in OURS]
        high = next((mean for mean in map(_mean_return, ours) if mean is not None), None)
        if low is not None and high is not None and high > low:
            result[task] = (low, high)
    return result


def shared_tasks(scores: Scores) -> tuple[list[str], list[str]]:
    """Return tasks that can be compared on, and the learners that were measured on all of them.

    Learners with less than half as many tasks as the one with most of them are left out: with them hardly a
    task would be common to all.
    """
    most = max((len(tasks) for tasks in scores.values()), default=0)
    names = [name for name, tasks in scores.items() if 2 * len(tasks) >= most]
    common = (
        [task for task in scores[names[0]] if all(task in scores[name] for name in names)] if names else []
    )
    return common, names if common else []


def matrix(runs: Mapping[str, Sequence[float]], tasks: Sequence[str]) -> FloatArray:
    """Return the scores of some tasks, shape (n_runs, n_tasks): the first runs if some tasks have more."""
    n_runs = min(len(runs[task]) for task in tasks)
    return np.array([runs[task][:n_runs] for task in tasks], dtype=np.float64).T


def learner_table(rows: Sequence[Row], actions: str) -> Table | None:
    """Write aggregate scores of the learners; None if none was measured."""
    successes, normalised = success_runs(rows, actions), normalised_runs(rows, actions)
    if not successes:
        return None
    groups = _by_learner(rows, actions)
    lines = [
        (
            method,
            *_aggregates(runs),
            *_against(runs, successes.get(BASELINE) if method != BASELINE else None),
            *_normalised(normalised.get(method)),
            _training(groups[method]),
        )
        for method, runs in successes.items()
    ]
    head = ("learner", "seeds x tasks", "success, IQM", f"tasks shared with {BASELINE}")
    word = "deterministic" if actions == "mean" else "sampled"
    return Table(
        head=(
            *(*head, f"success of {BASELINE} there, IQM", f"better than {BASELINE}"),
            *("normalised return, IQM", "optimality gap", "scaled tasks", "training, median"),
        ),
        rows=lines,
        title=f"Learners, {word} actions: interquartile means (IQM) with 95 % intervals",
    )


def _aggregates(runs: Mapping[str, Sequence[float]]) -> tuple[str, str]:
    scores = matrix(runs, list(runs))
    return f"{scores.shape[0]} x {scores.shape[1]}", _interval(_estimate(interquartile_mean, scores))


def _against(
    runs: Mapping[str, Sequence[float]], baseline: Mapping[str, Sequence[float]] | None
) -> tuple[str, str, str]:
    """Compare runs with the baseline's on the tasks that both were measured on."""
    tasks = [task for task in runs if baseline is not None and task in baseline]
    if baseline is None or not tasks:
        return "-", "-", "-"
    ours, theirs = matrix(runs, tasks), matrix(baseline, tasks)
    better = _estimate(probability_of_improvement, ours, theirs)
    return str(len(tasks)), _interval(_estimate(interquartile_mean, theirs)), _interval(better)


def _normalised(runs: Mapping[str, Sequence[float]] | None) -> tuple[str, str, str]:
    if not runs:
        return "-", "-", "0"
    scores = matrix(runs, list(runs))
    values = _estimate(interquartile_mean, scores), _estimate(optimality_gap, scores)
    return (*map(_interval, values), str(scores.shape[1]))  # type: ignore[return-value]


def _training(rows: Sequence[Row]) -> str:
    runs = grouped(rows, lambda row: (row["task"], row["seed"])).values()
    times = [run[0]["seconds"] for run in runs if run[0]["seconds"] is not None]
    return duration(float(np.median(times))) if times else "-"


def _estimate(statistic: object, *scores: FloatArray) -> Estimate:
    return stratified_bootstrap(statistic, *scores, rng=np.random.default_rng(SEED))  # type: ignore[arg-type]


def _interval(estimate: Estimate) -> str:
    return f"{estimate.value:.2f} ({estimate.low:.2f} to {estimate.high:.2f})"
