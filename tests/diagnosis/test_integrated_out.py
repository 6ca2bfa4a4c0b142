"""Nuisances integrated out of a likelihood: against the covariance matrix that they give the residuals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pzd.diagnosis.fit.likelihood import MarginalisedNuisances
from pzd.record import Array

Columns = Callable[[np.random.Generator], Array]
RESIDUALS = 80


def dense(rng: np.random.Generator) -> Array:
    """An offset, a gain and a delay of very unlike sizes."""
    return rng.standard_normal((RESIDUALS, 3)) * [0.01, 1.0, 30.0]


def sparse(rng: np.random.Generator) -> Array:
    """A sample beside a jump each, and what noise remembers of it."""
    columns = np.zeros((RESIDUALS, 12))
    for j in range(12):
        columns[6 * j : 6 * j + 4, j] = 5.0 * rng.standard_normal(4)
    return columns


@pytest.mark.parametrize("columns", [dense, sparse])
def test_what_is_left_has_the_likelihood_of_residuals_with_these_nuisances(
    columns: Columns, rng: np.random.Generator
) -> None:
    """|r'|^2 = r' (I + V V')^-1 r, the exponent of the marginal likelihood."""
    V, r = columns(rng), rng.standard_normal((RESIDUALS, 4))
    left = MarginalisedNuisances.from_columns(V).marginalised(r)
    exact = r.T @ np.linalg.solve(np.eye(RESIDUALS) + V @ V.T, r)
    np.testing.assert_allclose(left.T @ left, exact, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(MarginalisedNuisances.from_columns(V).marginalised(r[:, 0]), left[:, 0], atol=1e-12)


@pytest.mark.parametrize("columns", [dense, sparse])
def test_the_likeliest_nuisances_are_those_of_ridge_regression(columns: Columns, rng: np.random.Generator) -> None:
    V, r = columns(rng), rng.standard_normal(RESIDUALS)
    exact = np.linalg.solve(np.eye(V.shape[1]) + V.T @ V, V.T @ r)
    np.testing.assert_allclose(MarginalisedNuisances.from_columns(V).most_likely(r), exact, rtol=1e-6, atol=1e-9)


def test_without_nuisances_nothing_is_taken_out(rng: np.random.Generator) -> None:
    r = rng.standard_normal((RESIDUALS, 2))
    np.testing.assert_array_equal(MarginalisedNuisances.none(RESIDUALS).marginalised(r), r)
