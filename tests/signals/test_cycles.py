"""The run of repeating cycles is found whatever the shape, and never in motion that does not repeat."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import sawtooth

from pzd.signals.cycles import Cycles, cycles

TIME = np.arange(10_000) * 1e-3


def smooth_random(rng: np.random.Generator, count: int, step: float = 1e-3) -> np.ndarray:
    """Band-limited random displacement, periodic over `count` samples."""
    frequency = np.fft.rfftfreq(count, step)
    spectrum = rng.standard_normal(frequency.size) * np.exp(2j * np.pi * rng.random(frequency.size))
    spectrum[(frequency < 0.2) | (frequency > 8.0)] = 0.0
    motion = np.fft.irfft(spectrum / np.maximum(frequency, 0.2), count)
    return 0.01 * motion / np.abs(motion).max()


@pytest.mark.parametrize("shape", ["sine", "triangle"])
def test_period_of_a_test_that_ends_inside_a_cycle(shape: str, rng: np.random.Generator) -> None:
    for frequency in rng.uniform(0.25, 20.0, 8):
        phase = 2 * np.pi * (frequency * TIME + rng.random())
        x = 0.01 * (np.sin(phase) if shape == "sine" else sawtooth(phase, 0.5))
        run = cycles(TIME, x + 2e-5 * rng.standard_normal(x.size))
        assert run is not None
        assert run.period == pytest.approx(1.0 / frequency, rel=2e-4)
        # half a sample is given: a record of two exact cycles has a sample less than two periods
        assert run.count == int(np.floor((10.0 + 0.5e-3) * frequency + 1e-6))


@pytest.mark.parametrize("step", [0.0, 5e-5])
def test_a_fast_recorder_of_a_slow_test_finds_the_cycles_under_its_noise(step: float, rng: np.random.Generator) -> None:
    """Noise of a hundredth of the stroke at 5 kHz is quicker than the rod, from sample to sample."""
    time = np.arange(4000) / 5000.0
    for frequency in rng.uniform(4.0, 9.0, 8):
        x = 1.3e-3 * np.sin(2.0 * np.pi * (frequency * time + rng.random())) + 1.5e-5 * rng.standard_normal(time.size)
        run = cycles(time, x if step == 0.0 else step * np.round(x / step))
        assert run is not None
        assert run.period == pytest.approx(1.0 / frequency, rel=2e-3)


def test_rest_and_ramps_stay_outside_the_run(rng: np.random.Generator) -> None:
    for _ in range(5):
        period, rest, cycle_count = rng.uniform(0.3, 0.8), rng.uniform(1.0, 2.0), 8
        envelope = np.interp(
            TIME, rest + period * np.array([0.0, 2.0, 2.0 + cycle_count, 4.0 + cycle_count]), [0, 1, 1, 0]
        )
        x = 0.01 * envelope * np.sin(2 * np.pi * (TIME - rest) / period) + 1e-5 * rng.standard_normal(TIME.size)
        run = cycles(TIME, x)
        assert run is not None
        assert run.period == pytest.approx(period, rel=1e-3)
        assert run.start >= rest + 1.5 * period
        assert run.end <= rest + (2.5 + cycle_count) * period
        assert run.count >= cycle_count - 1


def test_drift_does_not_hide_the_cycles(rng: np.random.Generator) -> None:
    x = 0.005 * np.sin(2 * np.pi * 1.1 * TIME) - 0.006 * TIME / TIME[-1]
    run = cycles(TIME, x + 1e-5 * rng.standard_normal(x.size))
    assert run is not None
    assert run.count == 11
    assert run.period == pytest.approx(1 / 1.1, rel=1e-3)


def test_a_road_driven_twice_is_two_cycles(rng: np.random.Generator) -> None:
    for _ in range(5):
        run = cycles(TIME, np.tile(smooth_random(rng, 5000), 2))
        assert run is not None
        assert run.count == 2
        assert run.period == pytest.approx(5.0, rel=1e-6)


def test_motion_that_does_not_repeat_has_no_cycles(rng: np.random.Generator) -> None:
    for _ in range(20):
        assert cycles(TIME, smooth_random(rng, 20_000)[:10_000]) is None
        assert cycles(TIME, np.cumsum(rng.standard_normal(TIME.size))) is None
        assert cycles(TIME, np.sin(2 * np.pi * (0.5 * TIME + rng.uniform(0.1, 1.0) * TIME**2))) is None


def test_quick_motion_on_a_slow_wave_is_no_cycle(rng: np.random.Generator) -> None:
    slow = 0.02 * np.sin(2 * np.pi * 0.3 * TIME)
    assert cycles(TIME, slow) is not None
    for _ in range(5):
        quick = np.gradient(smooth_random(rng, 20_000))[:10_000]
        # a tenth of the displacement, most of the speed
        assert cycles(TIME, slow + 0.002 * quick / np.abs(quick).max()) is None


def test_less_than_two_cycles_are_none() -> None:
    assert cycles(TIME[:950], np.sin(2 * np.pi * 2.0 * TIME[:950])) is None
    run = cycles(TIME[:1000], np.sin(2 * np.pi * 2.0 * TIME[:1000]))
    assert run is not None
    assert run.count == 2
    assert run.start == 0.0


def test_folded_cycles_are_the_waveform() -> None:
    x = np.sin(2 * np.pi * 2.0371 * TIME)
    run = cycles(TIME, x)
    assert run is not None
    folded = run.fold(TIME, x)
    phase = 2 * np.pi * np.arange(folded.shape[1]) / folded.shape[1]
    start = 2 * np.pi * 2.0371 * run.start
    assert np.abs(folded - np.sin(start + phase)).max() < 1e-6
    assert run.number(TIME).max() == run.count - 1
    assert np.count_nonzero(run.number(TIME) == 0) == pytest.approx(run.period * 1000, abs=1)


@pytest.mark.parametrize("beside", [-1e-5, 0.0, 1e-5])
def test_white_noise_keeps_its_variance_in_folded_cycles(beside: float, rng: np.random.Generator) -> None:
    """Also where the period that was found lies a little below or above whole samples."""
    time = np.arange(10001) / 1000.0
    folded = Cycles(1.0 + beside, 0.012, 9).fold(time, rng.standard_normal(time.size))
    assert np.mean(np.diff(folded, axis=0) ** 2) / 2.0 == pytest.approx(1.0, rel=0.06)
