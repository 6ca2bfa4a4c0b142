"""A triangle's corner is sharper than any harmonic that stands clear of the noise, and the force turns round there."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.data import prepare
from pzd.diagnosis.fit.prediction import predicted_force
from pzd.record import Array, Record

RATE, FINER, FREQUENCY, CYCLES = 500.0, 16, 0.25, 4
STIFF = Damper(base=(BaseRow(voltage_V=0.0, T0_N=240.0, C_Ns_per_m=1200.0, k_N_per_m=1.1e6),))


def triangle(noise: float, rng: np.random.Generator) -> tuple[Record, Array]:
    """A slow triangle of an actuator whose loop has 25 Hz, its displacement noisy; and the force without noise."""
    from scipy.signal import bilinear, lfilter

    step, w = 1.0 / (RATE * FINER), 2 * np.pi * 25.0
    fine = np.arange(-2.0 / FREQUENCY, CYCLES / FREQUENCY, step)
    x = lfilter(*bilinear([w * w], [1.0, 1.2 * w, w * w], 1.0 / step), 0.04 / np.pi * np.arcsin(
        np.sin(2 * np.pi * FREQUENCY * fine)))  # fmt: skip
    v = np.gradient(x, step)
    motion = Motion(fine, x, v, np.gradient(v, step), np.zeros_like(fine))
    t, x, v, a, force = (c[::FINER] for c in (fine, x, v, motion.acceleration, respond(STIFF, motion)))
    keep = t >= 0.0
    t, x, v, a, force = t[keep], x[keep], v[keep], a[keep], force[keep]
    seen = x + noise * rng.standard_normal(t.size)
    return Record("triangle", None, t, seen, v, a, force + 0.5 * rng.standard_normal(t.size), np.zeros(t.size)), force


def test_the_force_turns_round_at_the_corners_when_it_should(rng: np.random.Generator) -> None:
    """13 um of noise in four cycles through 1.1 kN/mm are 7 N, of 300 N, and the harmonics that stand clear miss 40."""
    record, force = triangle(13e-6, rng)
    (prepared,) = prepare((record,))
    cycle = prepared.cycles
    assert cycle is not None
    inside = cycle.inside(record.time)
    missed = cycle.fold(record.time[inside], force[inside]).mean(axis=0)
    missed = cycle.fold(prepared.record.time, predicted_force(STIFF, prepared)).mean(axis=0) - missed
    assert np.std(missed) < 2.0  # 3.2 where only harmonics of the whole cycle are kept


def test_without_noise_nothing_is_missed(rng: np.random.Generator) -> None:
    record, force = triangle(1e-9, rng)
    (prepared,) = prepare((record,))
    cycle = prepared.cycles
    assert cycle is not None
    assert predicted_force(STIFF, prepared)[:100] == pytest.approx(force[cycle.inside(record.time)][:100], abs=0.5)
