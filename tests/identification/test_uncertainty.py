"""Uncertainty of an estimate by noise of the colour of the residuals alone."""

from __future__ import annotations

import numpy as np
import pytest
from fresh_truths import autoregressive

from pzd.identification.intervals import uncertainty
from pzd.record import Array
from pzd.signals.noise import autoregression


def straight_line(count: int) -> Array:
    return np.column_stack([np.ones(count), np.sin(2.0 * np.pi * np.arange(count) / 250.0)])


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9, -0.6])
def test_the_autoregression_of_the_noise_is_found(rng: np.random.Generator, correlation) -> None:
    noise = autoregressive(rng, 20000, correlation)
    found = autoregression([noise])
    coefficient = found.coefficients[0] if found.coefficients.size else 0.0
    assert coefficient == pytest.approx(correlation, abs=0.03)
    assert found.innovation == pytest.approx(1.0 - correlation**2, rel=0.04)


def test_white_noise_gives_the_textbook_covariance(rng: np.random.Generator) -> None:
    # BIC now and then takes white noise for coloured, and the variance is off by as much: so the median of five draws.
    slopes = straight_line(4000)
    exact = np.diag(np.linalg.inv(slopes.T @ slopes))
    found = [np.diag(uncertainty([(slopes, draw.standard_normal(4000))]).covariance) for draw in rng.spawn(5)]
    np.testing.assert_allclose(np.median(found, axis=0), exact, rtol=0.12)
    np.testing.assert_allclose(found, np.tile(exact, (5, 1)), rtol=0.4)


def test_the_mean_of_correlated_noise_has_its_long_run_variance(rng: np.random.Generator) -> None:
    correlation, count = 0.9, 20000
    # As above: the median of five, since BIC now and then takes an order too many.
    found = [uncertainty([(np.ones((count, 1)), autoregressive(draw, count, correlation))]) for draw in rng.spawn(5)]
    exact = (1.0 + correlation) / (1.0 - correlation) / count
    assert np.median([f.covariance[0, 0] for f in found]) == pytest.approx(exact, rel=0.15)
    freedom = count * (1 - correlation**2) / (1 + correlation**2)
    assert np.median([f.degrees_of_freedom for f in found]) == pytest.approx(freedom, rel=0.15)


def test_few_samples_widen_the_interval(rng: np.random.Generator) -> None:
    few = uncertainty([(np.ones((8, 1)), rng.standard_normal(8))])
    assert few.half_widths()[0] > 1.15 * 1.96 * np.sqrt(few.covariance[0, 0])


def test_a_parameter_that_does_nothing_has_no_interval(rng: np.random.Generator) -> None:
    slopes = np.column_stack([np.ones(100), np.zeros(100)])
    widths = uncertainty([(slopes, rng.standard_normal(100))]).half_widths()
    assert np.isfinite(widths[0])
    assert np.isinf(widths[1])


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_intervals_cover_the_truth_where_the_textbook_fails(correlation, rng: np.random.Generator) -> None:
    slopes = straight_line(1500)
    projection = np.linalg.pinv(slopes)
    textbook = 1.96 * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    held, naive = 0, 0
    for _ in range(200):
        noise = autoregressive(rng, 1500, correlation)
        estimate = projection @ noise
        residuals = noise - slopes @ estimate
        apart = list(zip(np.split(slopes, [700]), np.split(residuals, [700]), strict=True))
        held += np.count_nonzero(np.abs(estimate) <= uncertainty(apart).half_widths())
        naive += np.count_nonzero(np.abs(estimate) <= textbook * np.std(residuals))
    # Of 1200 draws 95, 95 and 93 in 100 hold, for the three correlations; the share of 400 scatters by 0.012.
    assert 0.89 <= held / 400 <= 0.99
    if correlation == 0.9:
        assert naive / 400 < 0.6
