"""Velocity and acceleration from average cycles or a smoothed displacement, with known errors."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

Array = NDArray[np.float64]

TIME = np.arange(10_000) * 1e-3
OMEGA = 2.0 * np.pi * 2.037


def relative(got: Array, truth: Array) -> float:
    return float(np.sqrt(np.mean((got - truth) ** 2) / np.mean(truth**2)))


def series(harmonics: Array, amplitudes: Array) -> tuple[Array, Array, Array]:
    """Displacement, velocity and acceleration of a Fourier series of sines."""
    phase = np.outer(TIME, harmonics * OMEGA)
    rate = harmonics * OMEGA
    return np.sin(phase) @ amplitudes, np.cos(phase) @ (amplitudes * rate), -np.sin(phase) @ (amplitudes * rate**2)


def test_a_clean_sine_is_differentiated_exactly() -> None:
    x, v, a = series(np.array([1.0]), np.array([0.01]))
    clean = kinematics(TIME, x, cycles(TIME, x))
    assert relative(clean.displacement, x) < 1e-6
    assert relative(clean.velocity, v) < 1e-6
    assert relative(clean.acceleration, a) < 1e-5


@pytest.mark.parametrize(
    ("noise", "speed", "acceleration"), [(5e-6, 0.01, 0.05), (2e-5, 0.015, 0.1), (1e-4, 0.03, 0.2)]
)
def test_noise_of_a_triangle_is_averaged_away(
    noise: float, speed: float, acceleration: float, rng: np.random.Generator
) -> None:
    odd = np.arange(1.0, 22.0, 2.0)
    x, v, a = series(odd, 0.01 * 8.0 / np.pi**2 * (-1.0) ** ((odd - 1.0) // 2.0) / odd**2)
    errors = []
    for _ in range(3):
        shown = x + noise * rng.standard_normal(x.size)
        clean = kinematics(TIME, shown, cycles(TIME, shown))
        errors.append((relative(clean.velocity, v), relative(clean.acceleration, a)))
        # Differencing twice would be worse by more than an order of magnitude.
        assert relative(np.gradient(np.gradient(shown, TIME), TIME), a) > 5.0 * acceleration
    # In one draw of some hundred a high harmonic is kept by chance; of 20 cycles 250 harmonics are asked, each with a
    # chance of (1 + 4^2/19)^-19 = 9e-6.
    assert np.all(np.median(errors, axis=0) < (speed, acceleration))


def test_the_velocity_follows_a_drift_of_the_displacement(rng: np.random.Generator) -> None:
    x, v, _ = series(np.array([1.0]), np.array([0.01]))
    drift, rate = -5e-4 * TIME + 1e-3 * np.sin(0.4 * TIME), -5e-4 + 4e-4 * np.cos(0.4 * TIME)
    errors = []
    for _ in range(5):
        shown = x + drift + 5e-6 * rng.standard_normal(x.size)
        errors.append(relative(kinematics(TIME, shown, cycles(TIME, shown)).velocity, v + rate))
    # Of 150 draws 98 in 100 lie between 0.0011 and 0.0017; in the others a harmonic is kept by chance, up to 0.0040.
    assert np.median(errors) < 2e-3
    assert max(errors) < 1e-2


def test_the_velocity_is_zero_while_the_motion_rests(rng: np.random.Generator) -> None:
    x, v, _ = series(np.array([1.0]), np.array([0.01]))
    envelope = np.interp(TIME, [2.0, 3.0, 8.0, 9.0], [0.0, 1.0, 1.0, 0.0])
    shown = envelope * x + 5e-6 * rng.standard_normal(x.size)
    clean = kinematics(TIME, shown, cycles(TIME, shown))
    # Of 150 draws the largest are 0.005 of the speed while it moves, and 0.013 of its peak while it rests.
    assert relative(clean.velocity, np.gradient(envelope * x, TIME)) < 0.01
    assert np.abs(clean.velocity[:1800]).max() < 0.02 * v.max()


def test_random_motion_is_smoothed_as_far_as_its_noise_asks(rng: np.random.Generator) -> None:
    hertz = np.fft.rfftfreq(20_000, 1e-3)
    for _ in range(3):
        phases = np.exp(2j * np.pi * rng.random(hertz.size))
        spectrum = np.where((hertz > 0.2) & (hertz < 12.0), phases / np.maximum(hertz, 0.2), 0.0)
        x, v, a = (np.fft.irfft(spectrum * (2j * np.pi * hertz) ** order)[:10_000] for order in range(3))
        scale = 0.01 / np.abs(x).max()
        shown = scale * x + 5e-6 * rng.standard_normal(x.size)
        clean = kinematics(TIME, shown, cycles(TIME, shown))
        assert relative(clean.velocity, scale * v) < 0.015
        assert relative(clean.acceleration, scale * a) < 0.1
        without_noise = kinematics(TIME, scale * x, None)
        assert relative(without_noise.acceleration, scale * a) < 2e-3


def test_an_uneven_clock_gives_the_same_velocity(rng: np.random.Generator) -> None:
    time = np.sort(rng.uniform(0.0, 10.0, 8000))
    time = time[np.concatenate(([True], np.diff(time) > 1e-5))]
    x = 0.01 * np.sin(OMEGA * time)
    clean = kinematics(time, x, cycles(time, x))
    assert relative(clean.velocity, 0.01 * OMEGA * np.cos(OMEGA * time)) < 0.01
