"""The cubic spline is scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from pzd.signals.cubic import cubic_through


@pytest.mark.parametrize("samples", [2, 3, 4, 5, 100, 3000])
@pytest.mark.parametrize("jitter", [0.0, 0.9])
def test_as_scipy_has_it(rng: np.random.Generator, samples: int, jitter: float) -> None:
    time = 1e-3 * (np.arange(samples) + jitter * rng.uniform(0.0, 1.0, samples))
    values = rng.standard_normal(samples)
    at = np.linspace(time[0] - 1e-3, time[-1] + 1e-3, 4 * samples)
    wanted = CubicSpline(time, values)(at)
    assert cubic_through(time, values, at) == pytest.approx(wanted, rel=1e-9, abs=1e-9 * float(np.max(np.abs(wanted))))


def test_places_in_any_order(rng: np.random.Generator) -> None:
    time, values = np.linspace(0.0, 1.0, 50), rng.standard_normal(50)
    at = rng.uniform(0.0, 1.0, 200)
    assert cubic_through(time, values, at) == pytest.approx(CubicSpline(time, values)(at), rel=1e-9, abs=1e-9)


def test_a_channel_that_is_no_piece_of_memory(rng: np.random.Generator) -> None:
    table = rng.standard_normal((60, 3))
    time = np.arange(60.0)
    assert np.array_equal(
        cubic_through(time, table[:, 1], time + 0.3), cubic_through(time, table[:, 1].copy(), time + 0.3)
    )
