"""Edges of the run: ramps, rest and the loading of the oil spring stay outside; error of the period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from pzd.damper.element import element_force
from pzd.signals.cycles import Cycles, cycles, decimated_means, settled_cycles

SIGMAS = 4.0
NOT_SEEN = 0.002
"""A departure below this share of the range is none (twice what the search takes as the same motion)."""


@dataclass(frozen=True)
class Test:
    """A test as a servo-hydraulic rig drives it: rest, ramp, steady cycles, ramp, rest."""

    __test__ = False

    time: np.ndarray
    displacement: np.ndarray
    """With the noise of the sensor."""
    clean: np.ndarray
    continued: np.ndarray
    """The steady motion, going on for ever."""
    period: float
    begin: float
    """Of the steady part."""
    count: int
    noise: float

    @property
    def end(self) -> float:
        return self.begin + self.count * self.period


def drawn(rng: np.random.Generator, shape: str) -> Test:
    rate, period = rng.choice([200.0, 512.0, 1000.0, 2000.0]), rng.uniform(0.25, 2.0)
    count = int(rng.integers(3, 13))
    rest = rng.uniform(0.2, 1.0) * period
    # a sine out of rest has no ramp, an envelope has
    ramp = 0.0 if shape == "sine from rest" else rng.uniform(0.5, 2.0) * period
    begin = rest + ramp
    duration = 2 * begin + count * period
    time = np.arange(0.0, duration, 1.0 / rate)
    inside = np.clip((time - rest) / ramp if ramp else time >= rest, 0.0, 1.0)
    inside = inside * np.clip((duration - rest - time) / ramp if ramp else time < duration - rest, 0.0, 1.0)
    amplitude, phase = rng.uniform(0.005, 0.05), 2 * np.pi * (time - begin) / period
    if ramp and shape == "sine":
        phase = phase + rng.uniform(0.0, 2 * np.pi)
    motion = (1 - np.cos(phase)) / 2 if shape == "haversine" else np.sin(phase)
    motion = motion + sum(rng.uniform(0.0, 0.01) * np.sin(h * phase) for h in (2, 3))
    s = time / time[-1]
    drift = 0.02 * amplitude * rng.uniform(-1, 1) * (s + rng.uniform(-1, 1) * s**2)
    noise = 10 ** rng.uniform(-6.0, -4.3)
    clean, continued = amplitude * inside * motion + drift, amplitude * motion + drift
    recorded = clean + noise * rng.standard_normal(time.size)
    return Test(time, recorded, clean, continued, period, begin, count, noise)


@pytest.fixture(params=["sine", "sine from rest", "haversine"])
def tests(request: pytest.FixtureRequest, rng: np.random.Generator) -> list[Test]:
    return [drawn(draw, request.param) for draw in rng.spawn(12)]


def test_the_run_lies_in_the_steady_part_of_a_test(tests: list[Test]) -> None:
    for test in tests:
        run = cycles(test.time, test.displacement)
        assert run is not None
        inside = run.inside(test.time)
        departure = np.abs(test.clean - test.continued)[inside]
        averaged_noise = test.noise / np.sqrt(
            max(run.points(test.time) / 100.0, 1.0)
        )  # 100 points of a cycle are compared
        seen = NOT_SEEN * np.ptp(test.continued) + 8.0 * averaged_noise
        outside = np.abs(test.time[inside] - 0.5 * (test.begin + test.end)) > 0.5 * test.count * test.period
        # what departs so that it can be told from noise is at most the half of the neighbours compared
        few = max(3, int(np.ceil(0.03 * run.points(test.time))))
        assert np.count_nonzero(departure > seen) <= few
        assert np.count_nonzero(outside) <= 0.2 * run.points(test.time)


def test_no_more_than_a_cycle_is_lost_at_either_end(tests: list[Test]) -> None:
    for test in tests:
        run = cycles(test.time, test.displacement)
        assert run is not None
        assert run.start - test.begin < 1.0 * test.period + 2.0 / 200.0
        assert test.end - run.end < 1.0 * test.period
        assert run.count >= test.count - 1


def test_the_error_of_the_period_is_within_the_bound_by_noise(tests: list[Test]) -> None:
    """Bound: var P = 12 sigma^2 / (n (n^2 - 1) sum m'^2), the shift of n cycles by a straight line."""
    for test in tests:
        run = cycles(test.time, test.displacement)
        assert run is not None
        average = run.mean(test.time, test.continued)
        speed = np.gradient(average, run.period / average.size)
        bound = test.noise * np.sqrt(12.0 / (run.count * (run.count**2 - 1) * float(speed @ speed)))
        # The means of two cycles do not show a drift that bends: 0.02 A (t/T)^2 differs between them by a ramp, which
        # shifts a sine by 0.02 (P/T)^2 / pi^2 of a cycle, and a whole test lasts 3.4 cycles at least.
        least = 1e-5 if run.count > 2 else 0.02 / 3.4**2 / np.pi**2
        assert abs(run.period - test.period) < max(SIGMAS * bound, least * test.period)


def force_of(motion: np.ndarray, step: float) -> np.ndarray:
    """Force of a friction element behind an oil spring, no force at the start."""
    return element_force(motion, step, 1000.0, 2000.0, 10_000.0 / float(np.ptp(motion)))


def noisy(force: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return force + 0.005 * np.abs(force).max() * rng.standard_normal(force.size)


def test_the_cycle_in_which_the_oil_spring_is_loaded_is_left_out(rng: np.random.Generator) -> None:
    left_out = 0
    for _ in range(12):
        test = drawn(rng, "sine from rest")
        force = force_of(test.clean, test.time[1] - test.time[0])
        run = cycles(test.time, test.displacement)
        assert run is not None
        kept = settled_cycles(run, test.time, noisy(force, rng))
        assert kept.count >= max(run.count - 1, 2)
        left_out += run.count - kept.count
        if run.count > 2:
            folded = kept.fold(test.time, force)
            # not one part in thirty of a cycle departs so that it can be told from the noise
            departs = np.abs(folded[0] - folded[1]) > 0.02 * np.ptp(force)
            assert np.mean(departs) < 1.0 / 30.0
    assert left_out > 0


def kept_force(run: Cycles, time: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Force of the same element in the motion of the record, which began a cycle earlier."""
    step = float(time[1] - time[0])
    before = np.arange(-run.period, 0.0, step)
    earlier = 0.015 * np.sin(2.0 * np.pi * before / run.period)
    return element_force(np.concatenate([earlier, motion]), step, 180.0, 900.0, 4.0e5)[before.size :]


@pytest.mark.parametrize("frequency_hz", [0.5, 1.5, 5.0, 12.0])
@pytest.mark.parametrize("rate_hz", [200.0, 500.0, 2000.0])
def test_a_recorder_that_starts_in_full_motion_costs_the_first_cycle(
    rng: np.random.Generator, frequency_hz: float, rate_hz: float
) -> None:
    # T0/k = 0.45 mm at full speed is passed within some milliseconds: one to thirty samples of a thousand
    time = np.arange(0.0, 6.0 / frequency_hz, 1.0 / rate_hz)
    motion = 0.015 * np.sin(2.0 * np.pi * frequency_hz * time)
    force = noisy(element_force(motion, 1.0 / rate_hz, 180.0, 900.0, 4.0e5), rng)
    run = cycles(time, motion)
    assert run is not None
    assert run.start < 0.5 / frequency_hz
    kept = settled_cycles(run, time, force)
    assert kept.count == run.count - 1
    loaded = np.abs(element_force(motion, 1.0 / rate_hz, 180.0, 900.0, 4.0e5) - kept_force(kept, time, motion))
    assert np.max(loaded[kept.inside(time)]) < 0.01 * np.ptp(force)


def test_force_that_repeats_from_the_first_cycle_on_loses_none(rng: np.random.Generator) -> None:
    for _ in range(12):
        test = drawn(rng, "sine")
        force = noisy(force_of(test.continued, test.time[1] - test.time[0]), rng)
        cut = (test.time >= test.begin + test.period) & (test.time < test.end)
        time = test.time[cut]
        run = cycles(time, test.displacement[cut])
        assert run is not None
        warming = 1.0 - 0.05 * (time - time[0]) / (time[-1] - time[0])
        assert settled_cycles(run, time, force[cut] * warming) == run


def test_decimated_means_keep_both_ends_and_a_straight_line() -> None:
    for count in (999, 1000, 1037):
        time = np.arange(count) * 1e-3
        at, values = decimated_means(time, 3.0 + 2.0 * time, 0.5, 100)
        assert at[0] == time[0]
        assert at[-1] == time[-1]
        assert values == pytest.approx(3.0 + 2.0 * at, abs=1e-12)
