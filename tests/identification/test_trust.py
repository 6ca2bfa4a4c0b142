"""Undetermined parameters have no number, and the status says why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fresh_truths import SENSORS_ALIKE, TABLE_2, acceptance_test, sine_test, with_noise

from pzd.artefacts import ParameterRow
from pzd.identification.bingham_fit import Bingham, Objective, fit_evolutionary, fit_separable
from pzd.identification.condition import identify_condition
from pzd.identification.config import EvolutionaryConfig, IdentifyConfig
from pzd.identification.prepared_record import prepare
from pzd.identification.trust import ParameterEvidence, displacement_noise, partial_sensitivities, trust_of
from pzd.record import Condition, Record
from pzd.signals.nuisance import NuisanceConfig


def row_for(*records: Record, config: IdentifyConfig | None = None) -> ParameterRow:
    return identify_condition(Condition(None, None, None, records), config or IdentifyConfig(), seed=1)[0]


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_slow_small_test_cannot_tell_the_damping(rng: np.random.Generator, noise) -> None:
    record = sine_test(Bingham(400.0, 2500.0, 4e5), 0.2, 0.002, cycles=6)
    row = row_for(with_noise(record, rng, noise, correlation=0.9))
    assert row.C_Ns_per_m is None
    assert row.C_Ns_per_m_low95 < 2500.0 < row.C_Ns_per_m_high95
    assert row.status.startswith("undetermined: C (")
    assert pytest.approx(400.0, rel=0.03) == row.T0_N


def test_a_damper_that_never_slips_shows_neither_friction_nor_damping() -> None:
    row = row_for(sine_test(Bingham(5000.0, 2500.0, 4e5), 2.0, 0.005))
    assert row.T0_N is None
    assert row.C_Ns_per_m is None
    assert "undetermined: T0, C" in row.status


def springs_under(rng: np.random.Generator, friction: float = 0.0, starts: tuple[float, ...] = (150.0, -40.0)) -> list:
    """F = 2e5 x + F_i + friction sign(v), sines of 0.5 mm, 1 N of noise."""
    tests = [sine_test(Bingham(5e3, 0.0, 2e5), f, 5e-4) for f in (1.0, 2.0)]
    return [
        replace(
            r,
            force=2e5 * r.displacement + start + friction * np.sign(r.velocity) + rng.standard_normal(r.time.size),
        )
        for r, start in zip(tests, starts, strict=True)
    ]


def test_where_no_test_slips_the_oil_spring_is_told_and_a_bound_of_friction(rng: np.random.Generator) -> None:
    """Each test began at a force of its own, 150 N and -40 N: neither is a preload."""
    row = row_for(*springs_under(rng))
    assert row.shows_oil_spring_alone
    assert row.k_N_per_m_low95 < 2e5 < row.k_N_per_m_high95
    assert row.k_N_per_m == pytest.approx(2e5, rel=2e-3)
    assert row.T0_N_low95 == pytest.approx(100.0, rel=5e-3)  # half of k times the range of 1 mm
    assert (row.T0_N, row.T0_N_high95, row.C_Ns_per_m, row.C_Ns_per_m_low95) == (None,) * 4
    assert row.status.startswith("undetermined: T0, C (no test slips")


def test_friction_beside_a_spring_that_carries_most_is_no_damper_that_never_slips(rng: np.random.Generator) -> None:
    """3 N of friction in 250 N, under 1 N of noise: a loop of 3 % of the whole, which repeats."""
    assert not row_for(*springs_under(rng, friction=3.0)).shows_oil_spring_alone


def test_a_tare_of_the_load_cell_is_not_explained_by_an_element_that_never_slips() -> None:
    record = sine_test(Bingham(50.0, 1000.0, 4e5), 2.0, 0.01)
    tared = Objective((prepare(replace(record, force=record.force + 600.0)),))
    for fit in (fit_separable(tared), fit_evolutionary(tared, EvolutionaryConfig(), seed=1)):
        assert fit.parameters.friction < 0.5 * fit.parameters.stiffness * np.ptp(record.displacement)
    assert row_for(replace(record, force=record.force + 600.0)).status != "ok"


def test_a_damper_without_friction_has_a_friction_of_zero_and_not_an_undetermined_one(rng: np.random.Generator) -> None:
    record = sine_test(Bingham(0.0, 2500.0, 4e5), 2.0, 0.02)
    row = row_for(with_noise(record, rng))
    assert row.T0_N is not None
    assert row.T0_N_high95 < 0.01 * np.abs(record.force).max()
    assert row.C_Ns_per_m == pytest.approx(2500.0, rel=0.01)


@pytest.mark.parametrize("stiffness", [np.inf, 4e5])
def test_a_damper_of_friction_alone_has_a_damping_of_zero_up_to_a_small_force(
    stiffness: float, rng: np.random.Generator
) -> None:
    """It left C empty, and the run ended as not to be trusted."""
    record = sine_test(Bingham(2000.0, 0.0, stiffness), 2.0, 0.02)
    row = row_for(with_noise(record, rng))
    assert row.C_Ns_per_m is not None
    assert row.C_Ns_per_m_low95 == 0.0
    assert row.C_Ns_per_m_high95 * np.abs(record.velocity).max() < 0.05 * 2000.0
    assert "undetermined: C" not in row.status
    assert pytest.approx(2000.0, rel=0.03) == row.T0_N


def test_a_rigid_oil_spring_is_undetermined_and_the_others_are_not(rng: np.random.Generator) -> None:
    row = row_for(with_noise(sine_test(Bingham(400.0, 2500.0, 4e9), 2.0, 0.02), rng))
    assert row.k_N_per_m is None
    assert row.status.startswith("undetermined: k (")
    assert pytest.approx(400.0, rel=0.05) == row.T0_N
    assert row.C_Ns_per_m == pytest.approx(2500.0, rel=0.02)


def test_the_interval_of_a_stiff_oil_spring_is_that_of_its_compliance(rng: np.random.Generator) -> None:
    """The misfit is a parabola in 1/k, not in k: the interval reaches farther up than down, as the profile does."""
    row = row_for(with_noise(sine_test(Bingham(400.0, 2500.0, 1e7), 2.0, 0.02), rng))
    low, k, high = row.k_N_per_m_low95, row.k_N_per_m, row.k_N_per_m_high95
    assert 1.0 / low - 1.0 / k == pytest.approx(1.0 / k - 1.0 / high, rel=1e-6)
    assert high - k > 1.2 * (k - low)
    assert low < 1e7 < high


def test_displacement_noise_that_hides_the_oil_spring_is_named(rng: np.random.Generator) -> None:
    record = sine_test(Bingham(400.0, 2500.0, 3e7), 2.0, 0.02)
    noisy = replace(record, displacement=record.displacement + 1e-5 * rng.standard_normal(record.time.size))
    row = row_for(noisy)
    assert row.status.startswith("weak: k (")
    assert row.k_N_per_m_low95 < 3e7 < row.k_N_per_m_high95


def test_displacement_noise_is_measured_and_the_motion_itself_is_not_taken_for_it(rng: np.random.Generator) -> None:
    record = sine_test(TABLE_2[0.0], 2.0, 0.03)
    noise = 5e-6 * rng.standard_normal(record.time.size)
    assert displacement_noise(record.displacement) < 1e-7
    assert displacement_noise(record.displacement + noise) == pytest.approx(5e-6, rel=0.1)


def test_a_model_that_misses_half_of_the_force_is_weak_throughout() -> None:
    record = sine_test(TABLE_2[0.0], 2.0, 0.03)
    spoiled = replace(record, force=record.force + 400.0 * np.sin(2.0 * np.pi * 11.0 * record.time))
    row = row_for(spoiled)
    assert row.status.startswith("weak: T0, C, k (")
    assert "of the force's r.m.s." in row.status


@pytest.mark.parametrize("draw", range(6))
def test_the_status_of_good_tests_is_ok(draw, rng: np.random.Generator) -> None:
    _, records = acceptance_test(rng)
    assert row_for(*(with_noise(r, rng) for r in records), config=SENSORS_ALIKE).status == "ok"


def test_a_parameter_uncertain_by_the_sensors_is_weak_and_never_undetermined(rng: np.random.Generator) -> None:
    # Friction over damping: a gain of 20 % between two tests says nothing of C, and yet noise alone would.
    records = [sine_test(TABLE_2[150.0], f, 0.02, rate=500) for f in (0.5, 1.0)]
    noisy = [with_noise(r, rng, 0.002) for r in records]
    row = row_for(*noisy, config=IdentifyConfig(nuisance=NuisanceConfig(gain=0.2)))
    assert row.status.startswith("weak: ")
    assert row.C_Ns_per_m == pytest.approx(TABLE_2[150.0].damping, rel=0.02)
    assert row.C_Ns_per_m_high95 > 1.5 * row.C_Ns_per_m


def test_linearly_dependent_slopes_have_no_partial_sensitivity(rng: np.random.Generator) -> None:
    base = rng.standard_normal((100, 2))
    slopes = np.column_stack([base, base @ [1.0, 2.0]])
    np.testing.assert_allclose(partial_sensitivities(slopes.T @ slopes, np.ones(3), 100.0), 0.0, atol=1e-7)
    assert np.all(partial_sensitivities(base.T @ base, np.ones(2), 100.0) > 0.5)


def test_undetermined_and_weak_stand_in_one_status() -> None:
    status, determined = trust_of(
        [
            ParameterEvidence("T0", 100.0, 1.0, 1.0, 0.3),
            ParameterEvidence("C", 1000.0, 600.0, 600.0, 0.3),
            ParameterEvidence("k", 1e5, 2e4, 2e4, 0.3),
        ]
    )
    assert determined == (True, False, True)
    assert status == "undetermined: C (95 % interval of +-60 % by noise alone); weak: k (95 % interval of +-20 %)"
