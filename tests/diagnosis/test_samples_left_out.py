"""Samples that are left out part a record: nothing is differenced, filtered or whitened across what is missing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator
from numpy.typing import NDArray

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.data import prepare
from pzd.diagnosis.fit.prediction import predict
from pzd.diagnosis.gap import check_residual
from pzd.record import Array, Record
from pzd.signals.jumps import parted, slope_within, unbroken
from pzd.signals.kinematics import kinematics
from pzd.signals.noise import autoregression
from pzd.signals.nuisance import NuisanceConfig, columns_of

RATE, FINER, DURATION, LEAD = 500, 16, 12.0, 2.0
LATE = 0.0005
"""Of the force [s]: one standard deviation of what a test may have of its own."""
NOISE = 10.0
"""Of the force [N]."""
DAMPER = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=300.0, C_Ns_per_m=2500.0, k_N_per_m=2.0e5),
        BaseRow(voltage_V=150.0, T0_N=1300.0, C_Ns_per_m=2500.0, k_N_per_m=4.0e5),
    )
)


def late_sweep(voltage: Array, rng: Generator) -> Record:
    """A sweep from 0.5 to 4 Hz whose force comes late, at a voltage (n,) on the fine grid."""
    fine = np.arange(-LEAD, DURATION, 1.0 / (RATE * FINER))
    x = 0.012 * np.sin(2.0 * np.pi * (0.5 * fine + 0.5 * 3.5 / DURATION * fine**2))
    v = np.gradient(x, fine)
    force = respond(DAMPER, Motion(fine, x, v, np.gradient(v, fine), voltage))
    seen = slice(round(LEAD * RATE) * FINER, None, FINER)
    t, measured = fine[seen], np.interp(fine[seen] - LATE, fine, force) + NOISE * rng.standard_normal(fine[seen].size)
    clean = kinematics(t, x[seen], None)
    return Record("sweep", None, t, x[seen], clean.velocity, clean.acceleration, measured, voltage[seen])


def probability(record: Record, wanted: NDArray[np.bool_]) -> float:
    """That noise alone leaves what the true damper leaves of the wanted samples."""
    (prepared,) = prepare((record,))
    config = NuisanceConfig()
    found = check_residual(predict(DAMPER, prepared, config.delay_s), prepared, wanted, config)
    return float(np.min(found.probability["smooth"]))


def still(voltage: float) -> Array:
    """A voltage [V] that stands still, on the fine grid."""
    return np.full(round((DURATION + LEAD) * RATE * FINER), voltage)


def switching(every: float) -> Array:
    """A voltage that goes between 0 and 150 V, on the fine grid."""
    steps = np.arange(still(0.0).size) // round(every * RATE * FINER)
    return np.where(steps % 2 == 0, 0.0, 150.0)


@pytest.mark.parametrize("kept_back", [(0.3, 0.55), (0.45, 0.7)])
def test_a_test_that_comes_late_shows_no_gap_beside_what_is_kept_back(
    kept_back: tuple[float, float], rng: Generator
) -> None:
    record = late_sweep(still(150.0), rng)
    share = np.linspace(0.0, 1.0, record.time.size)
    wanted = (share < kept_back[0]) | (share > kept_back[1])
    assert probability(record, wanted) > 1e-3


@pytest.mark.parametrize("every", [0.2, 0.35])
def test_a_test_that_comes_late_shows_no_gap_beside_steps_of_the_voltage(every: float, rng: Generator) -> None:
    record = late_sweep(switching(every), rng)
    assert probability(record, np.ones(record.time.size, dtype=np.bool_)) > 1e-3


def test_the_force_of_a_delay_is_its_slope_on_either_side_of_what_is_left_out() -> None:
    t = np.arange(1000) / 1000.0
    force = 1000.0 * np.sin(2.0 * np.pi * t) + np.where(t < 0.5, 0.0, 500.0)
    counted = (t < 0.45) | (t > 0.55)
    whole = columns_of(force, 1000.0, NuisanceConfig())[counted]
    assert columns_of(force[counted], 1000.0, NuisanceConfig(), counted)[:, 2] == pytest.approx(whole[:, 2], abs=0.05)


def test_stretches_are_parted_at_every_sample_left_out() -> None:
    counted = np.array([0, 1, 1, 1, 0, 0, 1, 0, 1, 1], dtype=np.bool_)
    values = np.array([1.0, 2.0, 4.0, 9.0, 5.0, 8.0])
    assert [part.tolist() for part in parted(values, counted)] == [[1.0, 2.0, 4.0], [9.0], [5.0, 8.0]]
    assert slope_within(values, counted).tolist() == [1.0, 1.5, 2.0, 0.0, 3.0, 3.0]
    assert unbroken(counted, 1).tolist() == [True, True, False, False, True]
    assert unbroken(counted, 0).all()


def test_a_stretch_of_two_samples_does_not_whiten_the_others(rng: Generator) -> None:
    """A resonance takes a model of two coefficients, which two samples have no predecessors for."""
    e = np.zeros(2000)
    for i in range(2, e.size):
        e[i] = 1.6 * e[i - 1] - 0.9 * e[i - 2] + rng.standard_normal()
    found = autoregression([e, e[:2]])
    assert found.coefficients[:2] == pytest.approx([1.6, -0.9], abs=0.05)
    assert found.innovation == pytest.approx(1.0, rel=0.1)
