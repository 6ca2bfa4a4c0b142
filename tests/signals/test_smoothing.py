"""Smoothing removes noise of any colour from a displacement, and nothing that exceeds it."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator

from pzd.record import Array
from pzd.signals.noise import autoregression
from pzd.signals.smoothing import low_pass, motion_below

RATE, NOISE = 1000, 1e-5
INNER = slice(RATE // 2, -RATE // 2)
TIME = np.arange(0.0, 10.0, 1.0 / RATE)


def filtered(noise: Array, corner: float) -> Array:
    """White noise (n,) behind a filter of the fourth order at a corner [Hz]."""
    from scipy.signal import butter, sosfiltfilt

    return np.asarray(sosfiltfilt(butter(4, corner, fs=RATE, output="sos"), noise))


def error(motion: Array, noise: Array) -> float:
    """R.m.s. of what smoothing leaves of the noise and takes of the motion [m]."""
    left = (low_pass(motion + noise, 20.0) - motion)[INNER]
    return float(np.sqrt(np.mean(left**2)))


@pytest.mark.parametrize("corner", [400.0, 200.0, 50.0])
def test_low_pass_filtered_noise_is_removed_as_well_as_white_noise(corner: float, rng: Generator) -> None:
    """Behind a filter at 50 Hz cross-validation misses in 12 of 100 draws and leaves up to 1.9 times as much.

    That more than half of 15 draws miss has a chance of one in ten thousand.
    """
    sine, worse, below = 0.02 * np.sin(2.0 * np.pi * 1.03 * TIME), [], []
    for _ in range(15):
        white = NOISE * rng.standard_normal(TIME.size)
        worse.append(error(sine, filtered(white, corner)) / error(sine, white))
        below.append(motion_below(sine + filtered(white, corner)) * RATE / (2.0 * np.pi))
    assert np.median(worse) < 1.3
    assert max(worse) < 3.0
    assert 1.0 < np.median(below) < 20.0


def test_a_fast_tone_above_a_quiet_band_is_not_smoothed_away(rng: Generator) -> None:
    """Its 0.1 mm lie 2000 times below the slow tone, and a band between them holds noise alone."""
    both = 0.02 * np.sin(2.0 * np.pi * 1.03 * TIME) + 1e-4 * np.sin(2.0 * np.pi * 40.3 * TIME)
    noise = NOISE * rng.standard_normal(TIME.size)
    assert error(both, noise) < 0.5 * NOISE
    assert error(both, filtered(noise, 200.0)) < NOISE


def test_white_noise_added_to_a_model_adds_to_its_density(rng: Generator) -> None:
    model = autoregression([filtered(rng.standard_normal(TIME.size), 400.0)])
    shares = np.linspace(0.0, 0.5, 201)
    wanted = model.density(shares) + 0.05 * model.variance
    found = model.with_white(0.05)
    assert found.variance == pytest.approx(1.05 * model.variance, rel=1e-3)
    assert np.median(np.abs(np.log(found.density(shares) / wanted))) < 0.3  # as well as the same order describes it
    assert found.density(np.array([0.5]))[0] > 10.0 * model.density(np.array([0.5]))[0]
