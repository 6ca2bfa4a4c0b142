"""Cycles are averaged only where the average removes noise alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pzd.record import Array
from pzd.signals.cycles import cycles, departure_from_mean_cycle
from pzd.signals.kinematics import kinematics

RATE, DURATION = 1000.0, 20.0
TIME = np.arange(int(RATE * DURATION)) / RATE
NOISE = 2e-6
"""Of a laser or LVDT [m]."""
PAIRS = (
    (1.0, 10.03, 2 / 15), (1.1, 12.3, 0.1), (1.38, 1.42, 1.0), (1.0, 10.0, 0.1), (1.0, 10.25, 0.02), (1.0, 2.03, 0.02),
    (1.0, 2.0, 0.5), (1.0, 3.0, 0.2), (1.0, 3.001, 0.2), (1.2, 11.0, 0.05), (1.3, 13.7, 0.03), (0.9, 9.91, 0.3),
    (0.5, 8.02, 0.05), (2.0, 9.99, 0.1), (1.0, 1.01, 0.5), (1.0, 1.5, 1.0), (1.0, 7.5, 0.02), (1.0, 12.5, 0.08),
    (1.7, 14.02, 0.04), (0.8, np.pi, 0.4),
)  # fmt: skip
"""Frequencies [Hz] and ratio of the amplitudes: with a common period, nearly, and without."""


def tones(*parts: tuple[float, float, float]) -> tuple[Array, Array]:
    """Displacement and velocity of tones of amplitude [m], frequency [Hz] and phase."""
    w = [2.0 * np.pi * frequency for _, frequency, _ in parts]
    x = sum(a * np.sin(rate * TIME + p) for (a, _, p), rate in zip(parts, w, strict=True))
    v = sum(a * rate * np.cos(rate * TIME + p) for (a, _, p), rate in zip(parts, w, strict=True))
    return np.asarray(x), np.asarray(v)


def speed_error(x: Array, v: Array, noise: Array) -> float:
    """R.m.s. error of the velocity as a share of its r.m.s., half a second at either end left out."""
    measured = x + noise
    time = TIME[: x.size]
    found = kinematics(time, measured, cycles(time, measured)).velocity
    inner = slice(int(0.5 * RATE), -int(0.5 * RATE))
    return float(np.sqrt(np.mean((found - v)[inner] ** 2) / np.mean(v[inner] ** 2)))


@pytest.fixture
def noise(rng: np.random.Generator) -> Array:
    return NOISE * rng.standard_normal(TIME.size)


@pytest.mark.parametrize(("first", "second", "ratio"), PAIRS)
def test_the_velocity_of_two_tones_is_within_one_percent(first: float, second: float, ratio: float, noise) -> None:
    assert speed_error(*tones((0.015, first, 0.0), (0.015 * ratio, second, 0.7)), noise) < 0.01


@pytest.mark.parametrize("duration", [6.0, 10.0, 15.0])
@pytest.mark.parametrize(("first", "second", "ratio"), PAIRS)
def test_the_velocity_of_two_tones_in_short_records_is_within_three_percent(
    first: float, second: float, ratio: float, duration: float, noise: Array
) -> None:
    """Two or three cycles of a near period, each a little further into the second tone, are no cycles."""
    x, v = tones((0.015, first, 0.0), (0.015 * ratio, second, 0.7))
    short = slice(round(duration * RATE))
    assert speed_error(x[short], v[short], noise[short]) < 0.03


def growing() -> tuple[Array, Array]:
    """A sine of 1 Hz from 5 to 20 mm."""
    size, growth, w = 0.005 + 0.015 * TIME / DURATION, 0.015 / DURATION, 2.0 * np.pi
    return size * np.sin(w * TIME), growth * np.sin(w * TIME) + size * w * np.cos(w * TIME)


def swept() -> tuple[Array, Array]:
    """A sine of 10 mm from 0.5 to 8 Hz."""
    rise = 7.5 / DURATION
    phase, w = 2.0 * np.pi * (0.5 * TIME + 0.5 * rise * TIME**2), 2.0 * np.pi * (0.5 + rise * TIME)
    return 0.01 * np.sin(phase), 0.01 * w * np.cos(phase)


def narrow() -> tuple[Array, Array]:
    """Forty tones within 0.3 Hz about 1.5 Hz, in the order of the golden section."""
    golden = np.arange(1, 41) * (np.sqrt(5.0) - 1.0) / 2.0 % 1.0
    frequencies, phases = 1.35 + 0.3 * golden, 2.0 * np.pi * (golden * 40.0 % 1.0)
    return tones(*((0.002, float(f), float(p)) for f, p in zip(frequencies, phases, strict=True)))


@pytest.mark.parametrize("motion", [growing, swept, narrow])
def test_the_velocity_of_what_does_not_repeat_is_within_one_percent(
    motion: Callable[[], tuple[Array, Array]], noise
) -> None:
    assert speed_error(*motion(), noise) < 0.01


@pytest.mark.parametrize("second", [10.03, 12.5, 3.02])
def test_two_tones_without_a_common_period_are_no_cycles(second: float, noise) -> None:
    x, _ = tones((0.015, 1.0, 0.0), (0.002, second, 0.3))
    found = cycles(TIME, x + noise)
    assert found is None or found.period > 1.5


@pytest.mark.parametrize("colour", [0.0, 0.9])
@pytest.mark.parametrize("size", [0.0, 2e-6, 2e-5])
def test_noise_of_any_colour_is_no_departure(size: float, colour: float, rng: np.random.Generator) -> None:
    from scipy.signal import lfilter

    white = size * rng.standard_normal((12, 1000))
    noise = lfilter([np.sqrt(1.0 - colour**2)], [1.0, -colour], white.ravel()).reshape(white.shape)
    x = 0.015 * np.sin(2.0 * np.pi * np.arange(1000) / 1000.0)
    assert departure_from_mean_cycle(x + noise) < 0.003


@pytest.mark.parametrize("turn", [0.01, 0.03, 0.25, 0.5])
def test_a_second_tone_departs_from_the_average_at_any_phase_gained_per_cycle(turn: float) -> None:
    """Closed form: a tone that comes round evenly has its whole mean square taken away by the average."""
    cycle, phase = np.arange(12)[:, None], np.arange(1000) / 1000.0
    second = np.sin(2.0 * np.pi * (10.0 * phase + turn * (cycle + phase)))
    found = departure_from_mean_cycle(np.sin(2.0 * np.pi * phase) + 0.05 * second)
    assert 0.03 < found < 0.6
    assert departure_from_mean_cycle(3.0 * np.sin(2.0 * np.pi * phase) + 0.15 * second) == pytest.approx(
        found, rel=1e-9
    )


def test_a_wander_of_half_a_percent_is_tolerated(rng: np.random.Generator) -> None:
    """As the closed loop of a servo-hydraulic stand has it."""
    size = 1.0 + 0.005 * rng.standard_normal(12)[:, None]
    assert departure_from_mean_cycle(size * np.sin(2.0 * np.pi * np.arange(1000) / 1000.0)) < 0.03
