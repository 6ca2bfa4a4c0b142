"""A control signal between its steps is a line where it differs from one by noise alone."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.record import Array
from pzd.signals.jumps import denoised_control

TIME = np.arange(4000) / 500.0
STEPPED = np.array([0.0, 150.0, 75.0, 150.0])[(TIME / 0.7).astype(int) % 4]
RAMPED = 150.0 * TIME / TIME[-1]


def noisy(values: Array, rng: np.random.Generator, size: float = 0.2) -> Array:
    return values + size * rng.standard_normal(values.size)


@pytest.mark.parametrize("truth", [STEPPED, RAMPED, STEPPED + 0.1 * RAMPED], ids=["held", "ramp", "both"])
def test_levels_and_ramps_of_a_control_signal_are_freed_of_noise(truth: Array, rng: np.random.Generator) -> None:
    """Of 350 samples the line is known to a seventh of the noise of one, at its ends to twice that."""
    found = denoised_control(noisy(truth, rng))
    assert np.max(np.abs(found - truth)) < 0.2
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.03


def test_a_control_signal_without_noise_or_a_curved_one_is_unchanged(rng: np.random.Generator) -> None:
    assert np.array_equal(denoised_control(STEPPED), STEPPED)
    waved = noisy(75.0 + 75.0 * np.sin(2.0 * np.pi * TIME), rng)
    assert np.array_equal(denoised_control(waved), waved)


@pytest.mark.parametrize("scale", [-1.0, 1e-3, 7.0])
def test_unit_sign_and_zero_of_the_control_signal_make_no_difference(scale: float, rng: np.random.Generator) -> None:
    given = noisy(STEPPED, rng)
    assert denoised_control(3.0 + scale * given) == pytest.approx(3.0 + scale * denoised_control(given), abs=1e-9)


def test_a_slow_rise_of_the_control_signal_keeps_its_samples(rng: np.random.Generator) -> None:
    """Where the supply takes ten samples from one level to the next, each of them stays where it was recorded."""
    rising = np.clip((TIME - 2.0) / 0.02, 0.0, 1.0) * 100.0
    given = noisy(rising, rng)
    moving = (TIME > 2.003) & (TIME < 2.017)
    assert np.array_equal(denoised_control(given)[moving], given[moving])
    assert np.max(np.abs(denoised_control(given) - rising)[~moving]) < 1.0
