"""A finer motion, where the voltage steps between two samples past a tested voltage."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion, parts_of_steps
from pzd.record import Array, Rows
from pzd.rig.stand.config import Steps

DURATION = 4.0
BENT = Damper(
    base=tuple(
        BaseRow(voltage_V=u, T0_N=T0, C_Ns_per_m=C, k_N_per_m=k)
        for u, T0, C, k in ((0.0, 300.0, 2700.0, 2e5), (75.0, 600.0, 3100.0, 3.5e5), (150.0, 1320.0, 2500.0, 4.2e5))
    )
)
"""T0, C and k bend at 75 V."""
STEPPED = Steps(kind="steps", voltages_V=(0.0, 150.0, 75.0, 150.0), dwell_s=0.4)


def motion_at(rate: float) -> Motion:
    """A sine of 1.3 Hz under a voltage that takes 2 ms from one level to the next, one sample at 500 Hz."""
    t, w = np.arange(0.0, DURATION, 1.0 / rate), 2.0 * np.pi * 1.3
    x = 0.025 * np.sin(w * t)
    return Motion(t, x, 0.025 * w * np.cos(w * t), -w * w * x, STEPPED.at(t, DURATION))


def finer(motion: Motion) -> tuple[Motion, Rows]:
    return motion.finer(parts_of_steps(motion.voltage, motion.time.size))


def error_of(force: Array) -> float:
    """R.m.s. distance from the force on a grid of 32 kHz, as a share of its peak."""
    truth = respond(BENT, motion_at(32_000.0))
    return float(np.sqrt(np.mean((force - truth[::64]) ** 2)) / np.max(np.abs(truth)))


def test_a_voltage_step_past_a_tested_voltage_costs_a_tenth_of_the_error_of_a_coarse_grid() -> None:
    motion, places = finer(motion_at(500.0))
    assert error_of(respond(BENT, motion)[places]) < 1e-4
    assert error_of(respond(BENT, motion_at(500.0))) > 1e-3


def test_a_finer_motion_contains_the_samples_of_the_coarse_one() -> None:
    coarse = motion_at(500.0)
    motion, places = finer(coarse)
    steps = np.count_nonzero(np.abs(np.diff(coarse.voltage)) > 1.0)
    assert motion.time.size == coarse.time.size + 7 * steps
    for name in ("time", "displacement", "velocity", "acceleration", "voltage"):
        assert getattr(motion, name)[places] == pytest.approx(getattr(coarse, name), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    "voltage", [None, np.full(100, 75.0), np.linspace(0.0, 150.0, 100)], ids=["no", "still", "ramp"]
)
def test_a_motion_without_voltage_steps_is_not_refined(voltage: Array | None) -> None:
    t = np.arange(100) * 1e-3
    motion = Motion(t, t, t, t, voltage)
    same, places = finer(motion)
    assert same is motion
    assert np.array_equal(places, np.arange(100))
