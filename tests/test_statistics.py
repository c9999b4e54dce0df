"""Statistics of runs, against definitions, cases worked by hand, and laws."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.integrate import quad

from hrsnake_env.errors import InputError
from planners.bench.statistics import (
    interquartile_mean,
    normalised_score,
    optimality_gap,
    performance_profile,
    probability_of_improvement,
    stratified_bootstrap,
    success_share,
)

SHAPES = st.tuples(st.integers(1, 5), st.integers(1, 4))
# Multiples of 1/8: ties are common, and sums are exact.
SCORES = SHAPES.flatmap(lambda shape: arrays(np.int64, shape, elements=st.integers(-8, 8))).map(
    lambda values: values / 8.0
)
EXACT = 1e-12


@given(st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_success_share_lies_inside_its_interval_and_the_interval_in_0_to_1(case):
    estimate = success_share(*case)
    assert 0.0 <= estimate.low <= estimate.value <= estimate.high <= 1.0


@given(st.integers(1, 200).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_successes_and_failures_have_mirrored_intervals(case):
    successes, trials = case
    estimate, mirrored = success_share(successes, trials), success_share(trials - successes, trials)
    assert mirrored.low == pytest.approx(1.0 - estimate.high, abs=1e-9)


@pytest.mark.parametrize(("successes", "trials"), [(1, 2), (3, 10), (45, 60)])
def test_the_success_interval_holds_its_level_of_the_posterior(successes, trials):
    estimate = success_share(successes, trials, level=0.9)
    factor = math.comb(trials, successes) * (trials + 1)  # of the Beta density with a uniform prior

    def density(p):
        return factor * p**successes * (1.0 - p) ** (trials - successes)

    assert quad(density, estimate.low, estimate.high)[0] == pytest.approx(0.9, abs=1e-9)
    assert quad(density, 0.0, estimate.low)[0] == pytest.approx(0.05, abs=1e-9)


def test_success_without_a_failure_ends_at_1_and_starts_at_a_root():
    # All of n succeed: the posterior's distribution function is p^(n + 1).
    estimate = success_share(3, 3)
    assert (estimate.low, estimate.high) == (pytest.approx(0.025**0.25, abs=EXACT), 1.0)


@pytest.mark.parametrize(
    ("scores", "mean"),
    [
        ([[5.0]], 5.0),
        ([[0.0, 1.0], [2.0, 100.0]], 1.5),  # four scores: one is left out at either end
        ([[3.0, 1.0, 2.0]], 2.0),  # three scores: floor(3 / 4) = 0 are left out
        ([[0.0, 0.0, 1.0, 1.0], [1.0, 1.0, 2.0, 50.0]], 1.0),  # eight scores: two at either end
    ],
)
def test_the_interquartile_mean_is_that_of_the_middle_half(scores, mean):
    assert interquartile_mean(scores) == pytest.approx(mean, abs=EXACT)


@given(SCORES)
def test_the_interquartile_mean_leaves_out_a_quarter_at_either_end(scores):
    every = sorted(scores.ravel().tolist())
    cut = len(every) // 4
    assert interquartile_mean(scores) == pytest.approx(np.mean(every[cut : len(every) - cut]), abs=EXACT)


def test_what_is_above_the_target_does_not_narrow_the_optimality_gap():
    assert optimality_gap([[0.5, 3.0]]) == pytest.approx(0.25, abs=EXACT)
    assert optimality_gap([[0.5, 3.0]], target=2.0) == pytest.approx(0.75, abs=EXACT)


@given(SCORES)
def test_the_optimality_gap_is_0_exactly_if_all_scores_reach_the_target(scores):
    assert (optimality_gap(scores, 0.5) == 0.0) == bool((scores >= 0.5).all())


def test_a_profile_counts_scores_strictly_above_the_threshold():
    shares = performance_profile([[0.0, 0.5], [0.5, 1.0]], [-0.1, 0.0, 0.5, 1.0])
    assert shares.tolist() == [1.0, 0.75, 0.25, 0.0]


@given(SCORES)
def test_the_area_below_a_profile_is_the_mean_score(scores):
    above = scores + 1.0  # in 0 to 2, all multiples of 1/8
    taus = np.arange(0.0, 2.0, 0.125)
    assert performance_profile(above, taus).sum() * 0.125 == pytest.approx(above.mean(), abs=EXACT)


def test_the_probability_of_improvement_counts_pairs_and_halves_ties():
    # Task 1: 2 > 1, 2 > 2 is a tie, 0 < 1, 0 < 2: 1.5 of 4. Task 2: all pairs better: 1.
    assert probability_of_improvement([[2.0, 9.0], [0.0, 8.0]], [[1.0, 1.0], [2.0, 2.0]]) == 0.6875


@given(SCORES, st.integers(1, 4), st.integers(0, 99))
def test_the_probabilities_of_improvement_both_ways_add_up_to_1(x, n_runs, seed):
    y = np.random.default_rng(seed).integers(-8, 9, size=(n_runs, x.shape[1])) / 8.0
    both = probability_of_improvement(x, y) + probability_of_improvement(y, x)
    assert both == pytest.approx(1.0, abs=EXACT)


@given(SCORES)
def test_the_probability_of_improvement_is_that_of_all_pairs(scores):
    others = np.array([[0.25] * scores.shape[1], [0.0] * scores.shape[1]])
    pairs = [
        1.0 if x > y else 0.5 if x == y else 0.0
        for task in range(scores.shape[1])
        for x, y in product(scores[:, task], others[:, task])
    ]
    assert probability_of_improvement(scores, others) == pytest.approx(np.mean(pairs), abs=EXACT)


@given(SCORES)
def test_the_random_policy_scores_0_and_the_planner_1(scores):
    random, planner = scores.mean(axis=0), scores.mean(axis=0) + 2.0
    assert normalised_score(random, random, planner) == pytest.approx(0.0, abs=EXACT)
    assert normalised_score(planner, random, planner) == pytest.approx(1.0, abs=EXACT)


def test_the_bootstrap_of_two_runs_on_one_task_is_that_of_four_equally_likely_draws():
    # Draws of (0, 1): means 0, 1/2, 1/2, 1. Quantiles at 0.3 and 0.7 lie in the middle half.
    estimate = stratified_bootstrap(np.mean, [[0.0], [1.0]], rng=np.random.default_rng(0), level=0.4)
    assert (estimate.value, estimate.low, estimate.high) == (0.5, 0.5, 0.5)
    wide = stratified_bootstrap(np.mean, [[0.0], [1.0]], rng=np.random.default_rng(0), level=0.95)
    assert (wide.low, wide.high) == (0.0, 1.0)


@given(SHAPES, st.integers(0, 99))
def test_the_bootstrap_never_mixes_tasks(shape, seed):
    scores = np.tile(np.arange(shape[1], dtype=np.float64), (shape[0], 1))  # all runs of a task are alike
    estimate = stratified_bootstrap(interquartile_mean, scores, rng=np.random.default_rng(seed), resamples=20)
    assert estimate.low == pytest.approx(estimate.value, abs=EXACT) == estimate.high


def test_tasks_are_drawn_independently_of_each_other():
    # Two runs, opposite on two tasks: drawn together their mean is always 1/2.
    scores = [[0.0, 1.0], [1.0, 0.0]]
    estimate = stratified_bootstrap(np.mean, scores, rng=np.random.default_rng(1), resamples=400)
    assert (estimate.low, estimate.high) == (0.0, 1.0)


def test_the_interval_of_normal_runs_is_as_wide_as_theory_says():
    scores = np.random.default_rng(5).normal(size=(60, 4))
    estimate = stratified_bootstrap(np.mean, scores, rng=np.random.default_rng(6), resamples=3000)
    deviation = math.sqrt(sum(scores[:, task].var() / 60 for task in range(4))) / 4
    assert estimate.high - estimate.low == pytest.approx(2 * 1.96 * deviation, rel=0.08)


def test_the_same_generator_gives_the_same_interval():
    scores = np.random.default_rng(2).random((5, 3))
    one, two = (
        stratified_bootstrap(interquartile_mean, scores, rng=np.random.default_rng(7), resamples=50)
        for _ in range(2)
    )
    assert (one.low, one.high) == (two.low, two.high)


def test_two_matrices_are_resampled_each():
    estimate = stratified_bootstrap(
        probability_of_improvement,
        [[2.0], [3.0]],
        [[0.0], [1.0], [1.5]],
        rng=np.random.default_rng(0),
        resamples=50,
    )
    assert (estimate.value, estimate.low, estimate.high) == (1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: success_share(0, 0), "n >= 1 trials, got 0 of 0"),
        (lambda: success_share(3, 2), "got 3 of 2"),
        (lambda: interquartile_mean([]), r"shape \(n_runs, n_tasks\), got \(0,\)"),
        (lambda: interquartile_mean([[np.nan]]), "finite scores"),
        (lambda: probability_of_improvement([[1.0]], [[1.0, 2.0]]), "same tasks, got 1 and 2"),
        (lambda: normalised_score([[1.0]], [1.0], [1.0]), "a planner that scores higher"),
    ],
)
def test_bad_scores_are_refused(call, message):
    with pytest.raises(InputError, match=message):
        call()
