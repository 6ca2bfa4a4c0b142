"""Spread of what tests have of their own, estimated within its prior."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.fit.spread import NuisanceEquations, estimated_spread, nuisance_equations

SAMPLES = 50


def drawn(rng: np.random.Generator, count: int, spread: tuple[float, float], levels: int = 1) -> NuisanceEquations:
    """Tests with two things of their own, and a mean of the first for every level."""
    own, shared, left = [], [], []
    for t in range(count):
        A = rng.standard_normal((SAMPLES, 2))
        J = np.zeros((SAMPLES, levels))
        J[:, t % levels] = A[:, 0]
        own.append(A)
        shared.append(J)
        left.append(A @ (rng.standard_normal(2) * spread) + rng.standard_normal(SAMPLES) + 3.0 * J[:, t % levels])
    return nuisance_equations(own, shared, left)


def test_many_tests_show_their_spread(rng: np.random.Generator) -> None:
    # Of 200 tests: sd 5 % of each.
    found = estimated_spread([drawn(rng, 200, (0.3, 0.8))])
    assert found == pytest.approx([0.3, 0.8], rel=0.2)


def test_a_few_tests_that_agree_are_believed_in_part_and_many_wholly(rng: np.random.Generator) -> None:
    """Were the prior's variance counted as so many tests, forty that repeat would still be given a third of it."""
    few, many = (estimated_spread([drawn(rng, count, (0.0, 0.0))]) for count in (3, 40))
    assert np.all((few > 0.4) & (few < 1.0))
    assert np.all(many < 0.15)  # 50 samples of noise show each to 0.14


def test_what_is_shared_takes_up_its_part(rng: np.random.Generator) -> None:
    # The first is free for each level: that of the only test of a level says nothing, and the prior stays.
    found = estimated_spread([drawn(rng, 40, (0.0, 0.0), levels=40)])
    assert found[0] == pytest.approx(1.0, abs=0.01)
    assert found[1] < 0.4


def test_no_spread_is_wider_than_its_prior(rng: np.random.Generator) -> None:
    assert np.all(estimated_spread([drawn(rng, 20, (3.0, 5.0))]) == 1.0)


def test_one_test_says_hardly_anything(rng: np.random.Generator) -> None:
    assert np.all(estimated_spread([drawn(rng, 1, (0.0, 0.0))]) > 0.85)
