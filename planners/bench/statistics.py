"""Statistics of few runs on several tasks, each with its published formula.

Scores are matrices of shape (n_runs, n_tasks): a run is a training or a search with a seed of its own. Tasks
are strata: they are not a sample, so no interval says anything about tasks that were not tried.

References
----------
.. [1] R. Agarwal, M. Schwarzer, P. S. Castro, A. Courville, M. G. Bellemare, "Deep Reinforcement Learning at
   the Edge of the Statistical Precipice", NeurIPS 2021.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from hrsnake_env.arm import FloatArray
from hrsnake_env.errors import InputError

__all__ = [
    "Estimate",
    "interquartile_mean",
    "normalised_score",
    "optimality_gap",
    "performance_profile",
    "probability_of_improvement",
    "stratified_bootstrap",
    "success_share",
]

LEVEL = 0.95
"""Of all intervals, by default."""

RESAMPLES = 2000
"""Of the bootstrap: the ends of its intervals are then good to about a percent of their distance."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """Hold a figure and the interval it comes with.

    Parameters
    ----------
    value, low, high : float
        The figure, and the ends of its interval.
    """

    value: float
    low: float
    high: float


def success_share(successes: int, trials: int, level: float = LEVEL) -> Estimate:
    """Estimate how often something succeeds.

    The value is successes / trials. With a uniform prior the posterior of the probability is
    Beta(1 + successes, 1 + trials - successes) (T. Bayes, 1763), whose mode is the value. The interval leaves
    (1 - level) / 2 of it out at either end, but begins at 0 without a success and ends at 1 without a failure
    (as L. D. Brown, T. T. Cai, A. DasGupta, "Interval Estimation for a Binomial Proportion", Statistical
    Science 16, 2001, have it), so that the value is always inside.

    Parameters
    ----------
    successes, trials : int
        0 <= successes <= trials, and at least one trial.
    level : float
        Probability that is in the interval.

    Raises
    ------
    InputError
        If there is no trial, or there are more successes than trials.

    Examples
    --------
    >>> round(success_share(0, 9).high, 4)  # 1 - 0.025^(1/10)
    0.3085
    """
    if not 0 <= successes <= trials or trials < 1:
        raise InputError(f"Expected 0 to n successes of n >= 1 trials, got {successes} of {trials}.")
    posterior = stats.beta(1 + successes, 1 + trials - successes)
    tail = (1.0 - level) / 2.0
    return Estimate(
        value=successes / trials,
        low=float(posterior.ppf(tail)) if successes else 0.0,
        high=float(posterior.ppf(1.0 - tail)) if successes < trials else 1.0,
    )


def interquartile_mean(scores: ArrayLike) -> float:
    """Return the mean of the middle half of all runs on all tasks ([1]_ of the module, section 4.3).

    The 25 % trimmed mean: of n scores the floor(n / 4) smallest and as many of the largest are left out.

    Parameters
    ----------
    scores : array-like, shape (n_runs, n_tasks)
        Not empty.

    Examples
    --------
    >>> interquartile_mean([[0.0, 1.0], [2.0, 9.0]])
    1.5
    """
    every = np.sort(_checked(scores), axis=None)
    cut = every.size // 4
    return float(every[cut : every.size - cut].mean())


def optimality_gap(scores: ArrayLike, target: float = 1.0) -> float:
    """Return by how much scores fall short of a target on average ([1]_ of the module, section 4.3).

    target - mean(min(score, target)): what is above the target makes up for nothing.

    Parameters
    ----------
    scores : array-like, shape (n_runs, n_tasks)
        Not empty.
    target : float
        For planner-normalised scores 1 is the planner.
    """
    return float(target - np.minimum(_checked(scores), target).mean())


def performance_profile(scores: ArrayLike, thresholds: ArrayLike) -> FloatArray:
    """Return the share of all runs on all tasks with a score above each threshold.

    F(tau) = 1/M sum_m 1/N sum_n 1[x_mn > tau], the run-score distribution ([1]_ of the module, section 4.2;
    E. D. Dolan and J. J. More, "Benchmarking optimization software with performance profiles", Mathematical
    Programming 91, 2002, have the form for times).

    Parameters
    ----------
    scores : array-like, shape (n_runs, n_tasks)
        Not empty.
    thresholds : array-like, shape (n_thresholds,)
        tau.

    Returns
    -------
    shares : array, shape (n_thresholds,)
        Never rising over rising thresholds.
    """
    every, taus = _checked(scores).ravel(), np.asarray(thresholds, dtype=np.float64)
    return np.asarray((every[None, :] > taus[:, None]).mean(axis=1), dtype=np.float64)


def probability_of_improvement(scores: ArrayLike, others: ArrayLike) -> float:
    """Return how likely a run of one method is better than a run of another, on average over tasks.

    P(X > Y) = 1/M sum_m 1/(N K) sum_i sum_j S(x_mi, y_mj) with S = 1 if x > y, 1/2 if x = y, else 0: the
    Mann-Whitney statistic of each task over its number of pairs ([1]_ of the module, section 4.3).

    Parameters
    ----------
    scores : array-like, shape (n_runs, n_tasks)
        Of X.
    others : array-like, shape (n_other_runs, n_tasks)
        Of Y, on the same tasks in the same order.

    Raises
    ------
    InputError
        If the numbers of tasks differ, or there is no score.

    Examples
    --------
    >>> probability_of_improvement([[1.0], [2.0]], [[1.0], [0.0]])
    0.875
    """
    x, y = _checked(scores), _checked(others)
    if x.shape[1] != y.shape[1]:
        raise InputError(f"Expected scores of the same tasks, got {x.shape[1]} and {y.shape[1]} tasks.")
    above = x[:, None, :] - y[None, :, :]
    return float(np.mean(0.5 + 0.5 * np.sign(above)))


def normalised_score(score: ArrayLike, random: ArrayLike, planner: ArrayLike) -> FloatArray:
    """Return scores on a scale on which the random policy has 0 and the planner has 1.

    (score - random) / (planner - random), as J. Fu et al., "D4RL: Datasets for Deep Data-Driven Reinforcement
    Learning", 2020, without its factor of 100, and with the planner as the expert.

    Parameters
    ----------
    score : array-like, shape (n_runs, n_tasks)
        For example returns.
    random, planner : array-like, shape (n_tasks,)
        Mean scores of the two references.

    Raises
    ------
    InputError
        If the planner is not better than the random policy on some task: there is no such scale then.
    """
    low, high = np.asarray(random, dtype=np.float64), np.asarray(planner, dtype=np.float64)
    if not np.all(high > low):
        raise InputError("Expected a planner that scores higher than the random policy on every task.")
    return np.asarray((np.asarray(score, dtype=np.float64) - low) / (high - low), dtype=np.float64)


def stratified_bootstrap(
    statistic: Callable[..., float],
    *scores: ArrayLike,
    rng: np.random.Generator,
    resamples: int = RESAMPLES,
    level: float = LEVEL,
) -> Estimate:
    """Estimate a statistic, with its percentile interval over stratified resamples.

    Each resample draws, for every task of every matrix alone, as many runs with replacement as there are
    ([1]_ of the module, section 4.1). The interval lies between the (1 - level) / 2 quantiles of the
    statistic of the resamples (B. Efron, "Bootstrap methods: another look at the jackknife", Annals of
    Statistics 7, 1979). With a single run it has no width, which says nothing about other runs.

    Parameters
    ----------
    statistic : callable
        Given as many matrices, returns a number.
    scores : array-like, shape (n_runs, n_tasks) each
        n_runs may differ from matrix to matrix.
    rng : numpy Generator
        Draws the runs.
    resamples : int
        At least 1.
    level : float
        Of the interval.

    Raises
    ------
    InputError
        If there is no score, or a matrix has not two axes.
    """
    every = [_checked(matrix) for matrix in scores]
    draws = (x[rng.integers(len(x), size=(resamples, *x.shape)), np.arange(x.shape[1])] for x in every)
    drawn = [statistic(*matrices) for matrices in zip(*draws, strict=True)]
    low, high = np.quantile(drawn, [(1.0 - level) / 2.0, (1.0 + level) / 2.0])
    return Estimate(value=float(statistic(*every)), low=float(low), high=float(high))


def _checked(scores: ArrayLike) -> FloatArray:
    """Return a matrix of scores; refuse what is none."""
    matrix = np.asarray(scores, dtype=np.float64)
    if matrix.ndim != 2 or matrix.size == 0:
        raise InputError(f"Expected scores with shape (n_runs, n_tasks), got {matrix.shape}.")
    if not np.isfinite(matrix).all():
        raise InputError("Expected finite scores, got some that are not.")
    return matrix
