"""When nothing is missing, diagnose says so: plain dampers from where books begin, the limits of the law among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import STAND

from pzd.artefacts import Diagnosed, ParameterRow, Rig
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.fit.prediction import predict
from pzd.diagnosis.gap import check_residual
from pzd.diagnosis.stage import diagnose
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.signals.nuisance import NuisanceConfig
from tests.studies.plain_damper import plain_force

FINER = 32
"""Steps of the integration a sample."""
Sine = tuple[float, float]
"""Frequency [Hz] and amplitude [m]."""


def record_of(
    T0: float, C: float, k: float, sine: Sine, noise: Array, rate: float, voltage: float | None = None
) -> Record:
    """A sine test of a plain damper, by the integrator of the second generator; as long as its noise [N]."""
    frequency, amplitude = sine
    omega, lead = 2.0 * np.pi * frequency, round(1.5 * rate / frequency)
    fine = (np.arange((lead + noise.size - 1) * 2 * FINER + 1) / (2 * FINER) - lead) / rate
    force = plain_force(fine, amplitude * np.sin(omega * fine), T0, C, 1.0 / k)[::FINER][lead:]
    t = fine[:: 2 * FINER][lead:]
    x, v = amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)
    volts = None if voltage is None else np.full(t.size, voltage)
    name = f"{voltage}-{frequency:g}Hz-{1e3 * amplitude:g}mm"
    return Record(name, None, t, x, v, -(omega**2) * x, force + noise, volts)


def diagnosed(records: Sequence[Record]) -> tuple[tuple[ParameterRow, ...], Diagnosed]:
    rig = Rig(tuple(records), ())
    found = identify(IdentifyConfig(), rig, 1)
    return found.rows, diagnose(DiagnoseConfig(), IdentifyConfig(), STAND, rig, found, Control(), None, 1)


THREE = ((1.0, 0.02), (2.0, 0.02), (1.0, 0.01))
FAR_APART = ((1.0, 0.02), (8.0, 0.004), (1.0, 0.01))
"""So far apart that a viscous damper behind a spring is told from one whose force is recorded late."""
BOOKS = [(300.0, 1000.0, np.inf), (300.0, 0.0, np.inf), (0.0, 1000.0, np.inf), (300.0, 0.0, 1e5), (0.0, 1000.0, 1e5)]


@pytest.mark.parametrize(("T0", "C", "k"), BOOKS, ids=["rigid", "friction", "viscous", "elasto-plastic", "Maxwell"])
def test_the_dampers_of_the_books_lack_nothing(T0: float, C: float, k: float, rng: Generator) -> None:
    """F = 300 sign(v) + 1000 v, the first sentence of most of them, and its kin, with 1 N of noise."""
    (row,), found = diagnosed([record_of(T0, C, k, sine, rng.standard_normal(6001), 1000.0) for sine in FAR_APART])
    assert found.diagnosis.effects == ()
    assert found.diagnosis.verdict == "none", found.diagnosis.reason
    assert pytest.approx(T0, abs=0.3) == row.T0_N
    assert row.W_s < 3e-4
    if np.isinf(k):
        assert row.k_N_per_m is None
        assert "above" in row.status
        assert row.k_N_per_m_low95 > 5e5
    else:
        assert row.k_N_per_m == pytest.approx(k, rel=0.02)
    if C > 0.0:
        assert row.C_Ns_per_m == pytest.approx(C, rel=2e-3)
    else:
        assert (row.C_Ns_per_m or 0.0) < 1.0
        assert row.C_Ns_per_m_low95 == 0.0


def test_a_damper_that_hardly_damps_is_not_given_a_relief_valve() -> None:
    """T0 200 N, C 1 N s/m, k 2e6 N/m without noise: what identify leaves open is no other C in diagnose."""
    tests = ((2.0, 0.03), (1.0, 0.03), (1.0, 0.06))
    _, found = diagnosed([record_of(200.0, 1.0, 2e6, sine, np.zeros(8001), 1000.0) for sine in tests])
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("none", ()), found.diagnosis.reason


def test_an_elasto_plastic_damper_at_three_voltages_is_plain(rng: Generator) -> None:
    records = [
        record_of(T0, 0.55, 1.19e5, sine, 5e-4 * T0 * rng.standard_normal(8001), 2000.0, voltage)
        for voltage, T0 in ((0.0, 201.0), (1.0, 322.0), (2.0, 442.0))
        for sine in ((1.0, 0.02), (2.0, 0.015))
    ]
    rows, found = diagnosed(records)
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("none", ()), found.diagnosis.reason
    for row, T0 in zip(rows, (201.0, 322.0, 442.0), strict=True):
        assert pytest.approx(T0, rel=1e-3) == row.T0_N
        assert row.k_N_per_m == pytest.approx(1.19e5, rel=0.01)


@pytest.mark.parametrize("tau", [0.01, 0.05])
def test_the_late_force_of_a_slow_converter_is_named(tau: float, rng: Generator) -> None:
    """A bridge converter of 80 values a second settles in four: home-made stands are up to 50 ms late."""
    rate = 500.0
    late = [
        replace(each, force=np.roll(each.force, round(tau * rate)) + rng.standard_normal(each.force.size))
        for each in (record_of(300.0, 1000.0, 2e5, sine, np.zeros(2000), rate) for sine in THREE)
    ]
    (_, found) = diagnosed(late)
    assert found.diagnosis.verdict == "named", found.diagnosis.reason
    assert found.diagnosis.effects == ("sensor_delay",)
    value = found.diagnosis.parameters["sensor_delay"]["tau"].value
    assert value == pytest.approx(tau, abs=2e-4)


@pytest.mark.parametrize("T0", [60.0, 128.0, 500.0])
def test_a_reversal_between_two_samples_is_no_effect(T0: float, rng: Generator) -> None:
    """43 samples a cycle of a stiff damper: the force turns within one, now before it is sampled and now after."""
    tests = ((2.5, 0.0128), (2.33, 0.02), (1.7, 0.015))
    records = [record_of(T0, 5675.0, 5.1e8, sine, 0.8 * rng.standard_normal(361), 100.0) for sine in tests]
    (row,), found = diagnosed(records)
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("none", ()), found.diagnosis.reason
    assert row.C_Ns_per_m == pytest.approx(5675.0, rel=0.02)


def test_coarse_steps_of_a_displacement_that_does_not_repeat_for_them_are_no_gap(rng: Generator) -> None:
    """A stroke of 7 mm read in 200 steps, on a stiff damper."""
    made = record_of(810.0, 904.0, 1.06e7, (1.97, 0.0035), 12.0 * rng.standard_normal(10001), 5000.0)
    (cleaned,) = clean((replace(made, displacement=3.47e-5 * np.round(made.displacement / 3.47e-5)),))
    assert cleaned.cycles is None
    plain = Damper(base=(BaseRow(T0_N=810.0, C_Ns_per_m=904.0, k_N_per_m=1.06e7),))
    wanted = np.ones(cleaned.record.time.size, dtype=np.bool_)
    check = check_residual(predict(plain, cleaned, 5e-4), cleaned, wanted, NuisanceConfig())
    assert check.probability["smooth"][0] > 1e-3


@pytest.mark.parametrize(("step", "rate", "k"), [(2e-4, 500.0, 2e5), (1e-4, 200.0, 2e5), (5e-5, 1000.0, 1e6)])
def test_coarse_steps_of_a_displacement_that_repeats_are_no_effect(
    step: float, rate: float, k: float, rng: Generator
) -> None:
    """A stroke of 40 mm in 200 to 800 steps, which the samples of each cycle meet alike: once a false fluid_inertia."""
    records = [
        record_of(300.0, 1000.0, k, sine, rng.standard_normal(round(6.0 / sine[0] * rate) + 1), rate) for sine in THREE
    ]
    stepped = [replace(each, displacement=step * np.round(each.displacement / step)) for each in records]
    _, found = diagnosed(stepped)
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("none", ()), found.diagnosis.reason
