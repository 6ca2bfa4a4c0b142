"""Short-time mask: corners of a cycle are kept, noise is dropped."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.record import Array
from pzd.signals.lack_of_fit import ShortTimeMask

POINTS = 2000
NOISE = 1e-3


def variance_of(level: float, points: int = POINTS) -> Array:
    """(H + 1,) variance of the Fourier coefficients of white noise of that r.m.s."""
    return np.full(int(0.4 * points) + 1, level**2 / points)


def triangle(points: int = POINTS) -> Array:
    return 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * (np.arange(points) + 0.3) / points))


def without_high_harmonics(cycle: Array, last: int) -> Array:
    spectrum = np.fft.rfft(cycle)
    spectrum[last + 1 :] = 0.0
    return np.fft.irfft(spectrum, cycle.size)


@pytest.mark.parametrize("points", [333, 512, 2000, 8001])
def test_without_noise_the_short_time_mask_keeps_the_whole_cycle(points: int, rng: np.random.Generator) -> None:
    """The parts overlap so that their squares add up to one: nothing below the band limit gets lost."""
    cycle = without_high_harmonics(rng.standard_normal(points), int(0.3 * points))
    _, found = ShortTimeMask.of(cycle, variance_of(1e-9, points), 4.0)
    np.testing.assert_allclose(found, cycle, atol=0.02 * np.max(np.abs(cycle)))


def test_cycles_equal_to_the_last_digit_are_kept_whole_by_the_short_time_mask(rng: np.random.Generator) -> None:
    cycle = without_high_harmonics(rng.standard_normal(512), 150)
    _, found = ShortTimeMask.of(cycle, np.zeros(int(0.4 * 512) + 1), 4.0)
    np.testing.assert_allclose(found, cycle, atol=0.02 * np.max(np.abs(cycle)))


def test_the_short_time_mask_drops_noise_alone(rng: np.random.Generator) -> None:
    """Of fifteen hundred blocks beyond 4 standard errors, exp(-16) each, one is kept in several thousand cycles."""
    cycles = NOISE * rng.standard_normal((100, POINTS))
    kept = [np.any(ShortTimeMask.of(cycle, variance_of(NOISE), 4.0)[1] != 0.0) for cycle in cycles]
    assert not np.any(kept)


def test_a_corner_of_a_triangle_is_found_below_the_noise_of_every_harmonic(rng: np.random.Generator) -> None:
    """No harmonic from the 91st on has six times the power of the noise, and yet the corner comes out of it."""
    whole = triangle()
    left = whole - without_high_harmonics(whole, 90)
    noisy = left + NOISE * rng.standard_normal(POINTS)
    assert np.max(np.abs(np.fft.rfft(left)) ** 2) / POINTS**2 < 6.0 * variance_of(NOISE)[0]
    clear, found = ShortTimeMask.of(noisy, variance_of(NOISE), 4.0)
    corner = np.abs(whole) > 0.99
    assert np.linalg.norm((found - left)[corner]) < 0.75 * np.linalg.norm(left[corner])
    np.testing.assert_array_equal(clear.kept(noisy), found)


def test_the_short_time_mask_is_linear_in_the_cycle(rng: np.random.Generator) -> None:
    clear, _ = ShortTimeMask.of(triangle() - without_high_harmonics(triangle(), 90), variance_of(NOISE), 4.0)
    one, other = rng.standard_normal((2, POINTS))
    np.testing.assert_allclose(clear.kept(one + 2.0 * other), clear.kept(one) + 2.0 * clear.kept(other), atol=1e-12)
    assert np.linalg.norm(clear.kept(one)) < 0.5 * np.linalg.norm(one)
