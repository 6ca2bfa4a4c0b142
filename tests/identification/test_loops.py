"""Work per cycle, equivalent damping and dynamic range against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fresh_truths import TABLE_2, moving_test, sine_test

from pzd.identification.bingham_fit import Bingham
from pzd.identification.strokes_and_loops import equivalent_damping, force_at_rest, measures
from pzd.signals.measures import work


def test_work_of_a_rigid_bingham_damper_over_a_sine() -> None:
    friction, damping, frequency, amplitude = 400.0, 2500.0, 2.0, 0.02
    (row,) = measures([sine_test(Bingham(friction, damping, 1e11), frequency, amplitude)])
    angle = 2.0 * np.pi * frequency
    expected = 4.0 * friction * amplitude + np.pi * damping * angle * amplitude**2
    assert row.work_per_cycle_J == pytest.approx(expected, rel=1e-3)
    assert row.equivalent_damping_Ns_per_m == pytest.approx(
        damping + 4.0 * friction / (np.pi * angle * amplitude), rel=1e-3
    )
    assert row.peak_force_N == pytest.approx(friction + damping * angle * amplitude, rel=1e-3)
    assert row.frequency_Hz == pytest.approx(frequency, rel=1e-6)
    assert row.amplitude_m == pytest.approx(amplitude, rel=1e-4)
    assert row.peak_velocity_m_per_s == pytest.approx(angle * amplitude, rel=1e-4)


def test_a_spring_does_no_work_and_a_dashpot_is_its_own_equivalent() -> None:
    phase = 2.0 * np.pi * np.arange(1000) / 1000.0
    x, v = np.sin(phase), np.cos(phase)
    assert work(x, 7.0 * x, closed=True) == pytest.approx(0.0, abs=1e-12)
    done = work(x, 3.0 * v, closed=True)
    assert done == pytest.approx(3.0 * np.pi, rel=1e-4)
    assert equivalent_damping(done, v, 2.0 * np.pi / 1000.0) == pytest.approx(3.0, rel=1e-4)


def test_force_at_zero_speed_is_the_mean_of_both_branches() -> None:
    phase = 2.0 * np.pi * (np.arange(1000) + 0.37) / 1000.0
    displacement, velocity = np.sin(phase), np.cos(phase)
    assert force_at_rest(velocity, 200.0 * displacement + 30.0, closed=True) == pytest.approx(200.0, rel=1e-4)
    assert force_at_rest(velocity, 1000.0 * velocity, closed=True) == pytest.approx(0.0, abs=1e-9)


def test_dynamic_range_compares_tests_at_the_same_speed_only() -> None:
    records = [
        sine_test(TABLE_2[0.0], 2.0, 0.03, voltage=0.0, name="low"),
        sine_test(TABLE_2[150.0], 2.0, 0.03, voltage=150.0, name="high"),
        sine_test(TABLE_2[150.0], 1.0, 0.03, voltage=150.0, name="slow"),
        moving_test(lambda t: 75.0 + 75.0 * np.sin(t), name="moving"),
    ]
    low, high, slow, moving = measures(records)
    assert low.dynamic_range == 1.0
    assert high.dynamic_range == pytest.approx(high.peak_force_N / low.peak_force_N)
    assert slow.dynamic_range is None
    assert moving.dynamic_range is None
    assert moving.voltage_V is None


def test_noise_averages_out_over_the_cycles(rng: np.random.Generator) -> None:
    clean = sine_test(TABLE_2[0.0], 2.0, 0.03, cycles=20)
    noise = 50.0 * rng.standard_normal(clean.time.size)
    (row,), (truth,) = measures([replace(clean, force=clean.force + noise)]), measures([clean])
    assert row.work_per_cycle_J == pytest.approx(truth.work_per_cycle_J, rel=5e-3)


def test_a_record_without_cycles_is_measured_as_a_whole(rng: np.random.Generator) -> None:
    time = np.arange(20000) / 1000.0
    speed = np.convolve(rng.standard_normal(20000), np.hanning(400) / 200.0, mode="same")
    displacement = np.cumsum(speed) * 1e-3 * 0.05
    velocity = np.gradient(displacement, 1e-3)
    clean = sine_test(TABLE_2[0.0], 2.0, 0.03)
    record = replace(
        clean, time=time, displacement=displacement, velocity=velocity, acceleration=velocity, force=900.0 * velocity
    )
    (row,) = measures([record])
    assert row.frequency_Hz is None
    assert row.equivalent_damping_Ns_per_m == pytest.approx(900.0, rel=0.01)
