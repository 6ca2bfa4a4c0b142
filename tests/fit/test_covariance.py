"""The covariance of a least-squares estimate in closed form, its units and its limits."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.fit.intervals import covariance, disagreement, inverse_normal, student_quantile, widening


def test_the_covariance_of_a_line_is_that_of_the_textbook() -> None:
    # y = a + b t at t = 0, 1, 2, 3, noise 1: var b = 1 / sum (t - 1.5)^2 = 1/5, var a = 1/4 + 1.5^2/5.
    t = np.arange(4.0)
    found = covariance(np.column_stack([np.ones(4), t]))
    np.testing.assert_allclose(found, [[0.7, -0.3], [-0.3, 0.2]], rtol=1e-12)


def test_a_covariance_changes_with_the_units_alone_and_is_infinite_where_nothing_shows(
    rng: np.random.Generator,
) -> None:
    J, units = rng.standard_normal((20, 3)), np.array([1e-9, 1.0, 1e9])
    np.testing.assert_allclose(covariance(J * units), covariance(J) / np.outer(units, units), rtol=1e-9)
    unseen = covariance(J * [1.0, 0.0, 1.0])
    assert np.isinf(unseen[1, 1])
    np.testing.assert_allclose(unseen[np.ix_([0, 2], [0, 2])], covariance(J[:, [0, 2]]), rtol=1e-9)


def test_what_two_parameters_share_is_theirs_by_halves_and_their_difference_is_nothing() -> None:
    # The least of all solutions: of a sum known to 1/2 each takes a half.
    np.testing.assert_allclose(inverse_normal(np.full((2, 2), 4.0)), np.full((2, 2), 1.0 / 16.0), rtol=1e-12)


def test_two_tests_of_one_mean_disagree_by_the_square_of_their_difference_over_its_variance() -> None:
    # Means of n and n samples that differ by d: pulls +-d/4, var of each 1/(8 n): R = n d^2 / 2.
    n, d = 8, 1.5
    slopes = [np.ones((n, 1))] * 2
    residuals = [np.full(n, d / 2.0), np.full(n, -d / 2.0)]
    found = disagreement(slopes, residuals, covariance(np.concatenate(slopes)))
    assert found[0] == pytest.approx(n * d**2 / 2.0)


def test_one_test_tells_no_disagreement_and_nothing_makes_intervals_narrower_than_noise(
    rng: np.random.Generator,
) -> None:
    J, r = rng.standard_normal((30, 2)), rng.standard_normal(30)
    r = r - J @ np.linalg.lstsq(J, r, rcond=None)[0]
    assert disagreement([J], [r], covariance(J)).tolist() == [1.0, 1.0]
    assert widening(np.array([0.2, 3.0]), 14.0, 28).tolist() == [1.0, 3.0]
    assert widening(np.array([0.2, 3.0]), 56.0, 28).tolist() == [2.0, 3.0]


def test_quantiles_are_those_of_the_cauchy_and_the_normal_distribution_at_the_ends() -> None:
    assert student_quantile(1.0, 0.975) == pytest.approx(np.tan(0.475 * np.pi))
    assert student_quantile(0.1, 0.975) == student_quantile(1.0, 0.975)
    assert student_quantile(np.inf, 0.975) == pytest.approx(1.959964, abs=1e-6)
