"""Folds, fits without a fold in closed form, and the paired comparison of errors."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from pzd.fit.cross_validation import (
    FOLDS,
    PredictionError,
    folds_in_turn,
    held_out_residuals,
    log_ratios,
    paired_t,
    predicts_better,
)
from pzd.record import Array


@pytest.mark.parametrize("tests", [2, 3, 5, 7, 23])
@pytest.mark.parametrize("turn", [0, 1, 4])
def test_folds_differ_by_one_test_at_most_and_neighbours_are_in_different_ones(tests: int, turn: int) -> None:
    dealt = folds_in_turn(tests, turn)
    sizes = np.bincount(dealt, minlength=min(FOLDS, tests))
    assert sizes.size == min(FOLDS, tests)
    assert np.ptp(sizes) <= 1
    assert all(one != other for one, other in pairwise(dealt))


def test_the_residuals_without_a_fold_are_those_of_a_refit_without_it(rng: np.random.Generator) -> None:
    sizes, folds = (5, 8, 3, 6), [[0, 2], [1], [3]]
    slopes = [rng.standard_normal((n, 2)) * [1.0, 1e6] for n in sizes]  # of columns of any unit
    measured = [rng.standard_normal(n) for n in sizes]
    prior = np.array([[0.3, 0.0], [0.0, 2e5]])

    def fitted(tests: list[int]) -> Array:
        columns = np.concatenate([*(slopes[i] for i in tests), prior])
        return np.linalg.lstsq(columns, np.concatenate([*(measured[i] for i in tests), np.zeros(2)]), rcond=None)[0]

    whole = fitted([0, 1, 2, 3])
    found = held_out_residuals(slopes, [y - J @ whole for J, y in zip(slopes, measured, strict=True)], folds, prior)
    for fold in folds:
        without = fitted([i for i in range(4) if i not in fold])
        for i in fold:
            np.testing.assert_allclose(found[i], measured[i] - slopes[i] @ without, rtol=1e-9)


def test_every_test_counts_alike_in_ratios_and_what_does_not_show_is_no_difference() -> None:
    force = np.array([1.0, 1e4, 1e8])
    one = PredictionError((0, 1, 2), 0.01 * force, force, force, 1e-3 * force)
    other = replace(one, error=0.04 * force)
    np.testing.assert_allclose(log_ratios(one, other), np.log(41.0 / 11.0), rtol=1e-12)
    # A thousandth of what shows, halved in each test: no ratio speaks of it.
    faint, fainter = (replace(one, error=share * 1e-6 * force) for share in (1.0, 0.5))
    assert np.all(np.abs(log_ratios(fainter, faint)) < 1e-3)


def test_a_share_of_each_error_is_no_chance_though_the_differences_scatter() -> None:
    force, unseen = np.full(4, 100.0), np.zeros(4)
    before = PredictionError((0, 1, 2, 3), np.array([9.0, 1.0, 0.1, 0.01]), force, force, unseen)
    after = replace(before, error=0.5 * before.error * np.array([1.0, 1.01, 0.99, 1.0]))
    assert paired_t(before.error - after.error) < 2.0
    assert predicts_better(after, before)
    assert not predicts_better(before, after)


def test_a_difference_that_is_always_the_same_is_no_chance_and_none_is() -> None:
    assert paired_t(np.full(3, 2.0)) == np.inf
    assert paired_t(np.full(3, -2.0)) == -np.inf
    assert paired_t(np.zeros(3)) == 0.0
    assert paired_t(np.array([5.0])) == 0.0
