"""What the tests' own gains, offsets and delays share is missing from the damper, and no chance of single tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sine, sines
from test_kept_back import TWO, campaign_of
from whole_diagnosis import all_but, diagnosed

from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.verdict import NuisanceTrend, nuisance_trend
from pzd.record import Record

TESTS = ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03))
LIKE_A_FREQUENCY = ("fluid_inertia", "gas_spring", "orifice_quadratic")
"""Effects that differ between a slow and a fast test of one stroke."""


def scaled(damper: Damper, factor: float) -> Damper:
    rows = (
        BaseRow(
            voltage_V=r.voltage_V,
            T0_N=factor * r.T0_N,
            C_Ns_per_m=factor * r.C_Ns_per_m,
            k_N_per_m=factor * r.k_N_per_m,
        )
        for r in damper.base
    )
    return damper.model_copy(update={"base": tuple(rows)})


def frequency_dependent(rng: np.random.Generator, share: float) -> tuple[Record, ...]:
    """T0, C and k lower by a share at 0.5 Hz, higher by it at 2 Hz."""
    return tuple(
        sine(scaled(damper_of(TWO), 1.0 + (share if f > 1.0 else -share)), U, f, x, rng, noise=2e-3, cycles=4)
        for U in TWO
        for f, x in TESTS
    )


def trend(records: tuple[Record, ...]) -> NuisanceTrend | None:
    return nuisance_trend(campaign_of(records), damper_of(TWO), DiagnoseConfig())


def test_gains_that_follow_the_frequency_are_a_trend(rng: np.random.Generator) -> None:
    found = trend(frequency_dependent(rng, 0.05))
    assert found is not None
    assert (found.nuisance, found.follows) == ("gain", "frequency")
    # The force of a sine is 0.7 to 1 of its peak in r.m.s.
    assert 0.7 * 0.05 < found.size < 0.05


def test_where_the_voltage_moves_in_every_test_no_trend_is_sought(rng: np.random.Generator) -> None:
    records = [
        replace(r, voltage=np.where(np.sin(3.0 * r.time) > 0.0, max(TWO), min(TWO)))
        for r in frequency_dependent(rng, 0.05)
        if r.voltage is not None
    ]
    assert trend(tuple(records)) is None


def test_voltages_as_a_rig_records_them_are_one_condition(rng: np.random.Generator) -> None:
    """No two tests hold a voltage to the last digit."""
    records = [
        replace(r, voltage=r.voltage + 0.2 * rng.standard_normal())
        for r in frequency_dependent(rng, 0.05)
        if r.voltage is not None
    ]
    found = trend(tuple(records))
    assert found is not None
    assert (found.nuisance, found.follows) == ("gain", "frequency")


@pytest.mark.parametrize(
    "forbid", [all_but(*LIKE_A_FREQUENCY), pytest.param((), marks=pytest.mark.ci)], ids=["few", "all"]
)
def test_a_damper_that_depends_on_frequency_is_not_none(rng: np.random.Generator, forbid: tuple[str, ...]) -> None:
    diagnosis = diagnosed(frequency_dependent(rng, 0.05), forbid=forbid).diagnosis
    assert diagnosis.verdict == "unexplained"
    assert diagnosis.prediction is not None
    assert diagnosis.prediction.W_s <= diagnosis.prediction.W_s_plain


@pytest.mark.parametrize("jitter", [0.0, 0.02])
def test_gains_and_offsets_that_scatter_are_none(rng: np.random.Generator, jitter: float) -> None:
    for _ in range(3):
        records = sines(damper_of(TWO), rng, TWO, jitter=jitter, cycles=3)
        offsets = 0.005 * rng.standard_normal(len(records))
        moved = [replace(r, force=r.force + o * np.max(r.force)) for r, o in zip(records, offsets, strict=True)]
        assert trend(tuple(moved)) is None


def test_two_tests_a_voltage_show_no_trend(rng: np.random.Generator) -> None:
    records = [r for r in frequency_dependent(rng, 0.05) if "30mm" in r.name]
    assert trend(tuple(records)) is None
