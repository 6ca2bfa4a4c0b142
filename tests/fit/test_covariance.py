"""The covariance of a least-squares estimate in closed form, its units and its limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import kstest

from pzd.fit.intervals import between_tests, covariance, disagreement, inverse_normal, student_quantile, widening


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


def test_a_mean_that_differs_from_test_to_test_does_so_by_the_moments_of_dersimonian_and_laird() -> None:
    # Two tests of n samples each, means d apart: Q = n d^2 / 2, s^2 = (Q - 1) / n; chi-square of one degree of freedom.
    n, d = 8, 1.5
    slopes, residuals = [np.ones((n, 1))] * 2, [np.full(n, d / 2.0), np.full(n, -d / 2.0)]
    spread, chance = between_tests(slopes, residuals, 0, np.zeros((0, 1)))
    Q = n * d**2 / 2.0
    assert spread == pytest.approx(np.sqrt((Q - 1.0) / n))
    assert chance == pytest.approx(math.erfc(np.sqrt(Q / 2.0)))


def test_the_spread_between_tests_is_found_beside_what_they_share_and_noise_alone_shows_none(
    rng: np.random.Generator,
) -> None:
    """Over 300 rigs of five tests: probabilities by chance are uniform, and squares of the spread right on average."""

    def found(apart: float) -> tuple[float, float]:
        slopes = [rng.standard_normal((40, 3)) for _ in range(5)]
        residuals = [rng.standard_normal(40) + apart * rng.standard_normal() * own[:, 1] for own in slopes]
        shared = np.linalg.lstsq(np.concatenate(slopes), -np.concatenate(residuals), rcond=None)[0]
        at_optimum = [r + own @ shared for own, r in zip(slopes, residuals, strict=True)]
        return between_tests(slopes, at_optimum, 1, np.zeros((0, 3)))

    chances = np.array([found(0.0)[1] for _ in range(300)])
    assert kstest(chances, "uniform").pvalue > 1e-3
    spreads = np.array([found(0.5)[0] for _ in range(300)])
    assert np.sqrt(np.mean(spreads**2)) == pytest.approx(0.5, rel=0.1)


def test_one_test_alone_cannot_differ_from_others(rng: np.random.Generator) -> None:
    slopes = [rng.standard_normal((30, 2)), np.column_stack([rng.standard_normal(30), np.zeros(30)])]
    assert between_tests(slopes, [rng.standard_normal(30)] * 2, 1, np.zeros((0, 2))) == (0.0, 1.0)
