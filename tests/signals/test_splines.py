"""The cubic spline through even samples is the one through any samples, wherever it is read."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from pzd.signals.splines import cubic, even_cubic, even_derivatives, integral, with_ringing

ROUNDING = 1e-13
"""Of the largest value."""


@pytest.mark.parametrize("samples", [2, 3, 4, 5, 6, 9, 40, 700])
@pytest.mark.parametrize("channels", [(), (3,)])
def test_what_does_not_repeat_has_no_knot_beside_either_end(
    samples: int, channels: tuple[int, ...], rng: np.random.Generator
) -> None:
    values = rng.standard_normal((samples, *channels))
    position = np.concatenate([np.arange(samples), rng.uniform(-1.0, samples, 2 * samples)]).reshape(3, samples)
    expected = CubicSpline(np.arange(samples), values)(position)
    found = even_cubic(values)(position)
    assert found.shape == expected.shape
    assert np.max(np.abs(found - expected)) <= ROUNDING * np.max(np.abs(expected))


@pytest.mark.parametrize("samples", [2, 3, 5, 64, 701])
@pytest.mark.parametrize("channels", [(), (3,)])
def test_what_repeats_goes_on_in_every_period(
    samples: int, channels: tuple[int, ...], rng: np.random.Generator
) -> None:
    values = rng.standard_normal((samples, *channels))
    edges = [0.0, samples, -1e-18, 2.0 * samples, -samples]
    position = np.concatenate([edges, rng.uniform(-2.0 * samples, 3.0 * samples, 300)])
    closed = np.concatenate([values, values[:1]])
    expected = CubicSpline(np.arange(samples + 1), closed, bc_type="periodic")(position)
    found = even_cubic(values, periodic=True)(position)
    assert np.max(np.abs(found - expected)) <= ROUNDING * samples * np.max(np.abs(expected))


def test_it_converges_with_the_fourth_power_of_the_step() -> None:
    errors = []
    for samples in (40, 80, 160):
        phase = 2.0 * np.pi * np.arange(samples) / samples
        between = np.arange(0.0, samples, 0.37)
        found = even_cubic(np.sin(phase), periodic=True)(between)
        errors.append(np.max(np.abs(found - np.sin(2.0 * np.pi * between / samples))))
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert order == pytest.approx([4.0, 4.0], abs=0.1)


@pytest.mark.parametrize("samples", [4, 5, 300])
def test_its_derivatives_at_the_samples_are_those_of_the_spline(samples: int, rng: np.random.Generator) -> None:
    values, at = rng.standard_normal(samples), np.arange(samples)
    expected = CubicSpline(at, values)
    for order, found in enumerate(even_derivatives(values), start=1):
        assert found == pytest.approx(expected(at, order), abs=ROUNDING * np.max(np.abs(expected(at, order))))


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_samples_that_are_not_even_are_taken_where_they_lie(jitter: float, rng: np.random.Generator) -> None:
    time = 7.0 + 1e-3 * (np.arange(200) + jitter * rng.uniform(-1.0, 1.0, 200))
    values, at = rng.standard_normal(200), rng.uniform(time[0], time[-1], 50)
    expected = CubicSpline(time, values)(at)
    assert cubic(time, values)(at) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("samples", [3, 4, 5, 40, 700])
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_the_integral_is_that_of_the_spline(samples: int, jitter: float, rng: np.random.Generator) -> None:
    time = 3.0 + 1e-3 * (np.arange(samples) + jitter * rng.uniform(-1.0, 1.0, samples))
    values = rng.standard_normal(samples)
    moments = np.concatenate([time, rng.uniform(time[0] - 1e-3, time[-1] + 1e-3, 3 * samples)])
    expected = CubicSpline(time, values).antiderivative()(moments)
    assert np.max(np.abs(integral(time, values)(moments) - expected)) <= 1e-12 * np.max(np.abs(expected))


@pytest.mark.parametrize("closed", [True, False])
def test_a_spline_rings_beside_a_jump_by_no_more_than_is_said(closed: bool) -> None:
    step = np.where(np.arange(40) < 20, 0.0, 1.0)
    course, at = even_cubic(step), np.linspace(0.0, 39.0, 3901)
    off = np.abs(course(at) - step[np.round(at).astype(int)])
    jump = np.zeros(40)
    jump[19:21] = 1.0
    said = with_ringing(jump, closed=closed)
    for away in range(1, 5):
        beside = (at > 20.0 + away - 1.0) & (at < 20.0 + away)
        assert np.max(off[beside]) == pytest.approx(said[20 + away], rel=0.02)


def test_what_rings_over_the_end_of_a_cycle_comes_at_its_beginning() -> None:
    jump = np.zeros(40)
    jump[-1] = 1.0
    assert with_ringing(jump, closed=True)[0] == pytest.approx(0.108)
    assert with_ringing(jump, closed=False)[0] == 0.0
