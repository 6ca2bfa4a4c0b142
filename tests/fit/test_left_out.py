"""What was left out of a fit for being small widens the intervals of what looks like it."""

from __future__ import annotations

import numpy as np

from pzd.fit.intervals import LEVEL, by_what_was_left_out, covariance


def test_intervals_hold_where_one_parameter_of_the_prior_size_was_left_out(rng: np.random.Generator) -> None:
    """Monte Carlo: noise of one, and one of three more parameters drawn from its prior."""
    slopes, others, sizes = rng.standard_normal((40, 2)), rng.standard_normal((40, 3)), np.array([0.5, 1.0, 2.0])
    others[:, 0] += 3.0 * slopes[:, 0]
    others[:, 2] += 2.0 * slopes[:, 1]
    held, alone, draws = np.zeros(2), np.zeros(2), 400
    variance = np.diag(covariance(slopes))
    for _ in range(draws):
        which = rng.integers(3)
        r = rng.standard_normal(40) + others[:, which] * sizes[which] * rng.standard_normal()
        estimate = np.linalg.lstsq(slopes, r, rcond=None)[0]
        out = by_what_was_left_out(slopes, r - slopes @ estimate, others, sizes)
        held += np.abs(estimate) < LEVEL * np.sqrt(variance + out)
        alone += np.abs(estimate) < LEVEL * np.sqrt(variance)
    assert np.all(held / draws > 0.93)
    assert np.all(alone / draws < 0.8)


def test_a_parameter_that_does_the_same_is_known_by_its_prior_alone() -> None:
    slopes = np.array([[1.0], [1.0]])
    out = by_what_was_left_out(slopes, np.zeros(2), 2.0 * slopes, np.array([3.0]))
    assert np.allclose(out, 36.0)
