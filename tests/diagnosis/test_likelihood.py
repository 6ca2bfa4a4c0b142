"""Weighted records: what counts as noise of a test, and nuisances integrated out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array
from synthetic import TWO, campaign_of, damper_of, sine, sines

from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.campaign import Campaign, Evidence, evidence_of
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.cross_validation import cross_validation_of
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.fit.likelihood import (
    MarginalisedNuisances,
    WeightedRecord,
    prompt_force,
    shown_force,
    weighted_record,
)
from pzd.diagnosis.fit.prediction import NEAR_STEP, comparable_samples, predict
from pzd.diagnosis.roles import HELD_OUT, TRAINING, VALIDATION, split
from pzd.diagnosis.search.candidates import candidate
from pzd.record import Array, Record, sliced
from pzd.signals.nuisance import NuisanceConfig


def evidence(records: tuple[Record, ...], damper: Damper) -> Evidence:
    cleaned = clean(records)
    return evidence_of(Campaign(cleaned, split(cleaned, None, 2.0), NuisanceConfig()), damper)


@pytest.mark.parametrize(
    "effects", [{}, {"stribeck_friction": {"F_s": 80.0, "v_s": 0.04}}, {"lash": {"delta": 3e-4}}], ids=str
)
def test_the_right_damper_leaves_no_more_than_noise(
    effects: dict[str, dict[str, float]], rng: np.random.Generator
) -> None:
    # Also where dry friction jumps between two samples, which no simulation can know.
    truth = damper_of(TWO, **effects)
    whole = evidence(sines(truth, rng, TWO, jitter=0.01), truth).whole
    found = fit(whole, tuple(effects), whole.start_with(truth))
    freedom = found.size - found.optimum.size
    # About a thousand residuals, and noise estimated from seven differences: over 36 draws 0.975, sd 0.058; 4.5 sd.
    assert 0.71 < found.misfit / freedom < 1.24


def test_what_a_wrong_damper_leaves_counts_as_noise_of_every_harmonic(rng: np.random.Generator) -> None:
    right = damper_of(TWO, gas_spring={"k_g": 3000.0})
    records = sines(right, rng, TWO)
    pairs = zip(*(evidence(records, d).whole.observations for d in (damper_of(TWO), right)), strict=True)
    for wrong, known in pairs:
        assert np.all(wrong.weights < known.weights)
        quietest = int(np.argmax(known.weights))
        assert wrong.weights[quietest] < 0.7 * known.weights[quietest]


def test_noise_of_the_displacement_goes_through_the_oil_spring_into_the_force(rng: np.random.Generator) -> None:
    # A damper that never slips is a spring: s_F = k s_x at every harmonic that is kept.
    k, noise, shares = 2e5, 2e-5, []
    stuck = Damper(base=(BaseRow(voltage_V=0.0, T0_N=1e6, C_Ns_per_m=3000.0, k_N_per_m=k),))
    for _ in range(20):
        (cleaned,) = clean((sine(stuck, 0.0, 1.0, 0.002, rng, displacement_noise=noise, cycles=8),))
        run = cleaned.cycles
        assert run is not None
        variance = predict(stuck, cleaned, 0.0).shared_variance
        assert isinstance(variance, np.ndarray)
        assert variance[0] == 0.0
        single = noise**2 / run.points(cleaned.record.time) / run.count
        # An average over harmonics 0 to 3, of which one is kept.
        shares.append(4.0 * variance[1] / (k**2 * single))
    # Never half as unsure as it must be: of 400 draws the smallest is 0.68. What noise lets through besides makes the
    # median 1.2, sd 0.3.
    assert min(shares) > 0.5
    assert 0.9 < np.median(shares) < 1.6


def test_a_delay_of_all_tests_and_one_of_a_test_shift_the_force_in_one(rng: np.random.Generator) -> None:
    """Shifted twice, the flank of a stiff friction was rounded: a delay that the tests took back fitted better."""
    stiff = Damper(base=(BaseRow(voltage_V=0.0, T0_N=120.0, C_Ns_per_m=1950.0, k_N_per_m=7e5),))
    records = tuple(sine(stiff, 0.0, f, 0.0275, rng, noise=0.002, colour=0.0, rate=500.0) for f in (0.5, 1.0, 4.0))
    for o in evidence(records, stiff).whole.observations:
        force, nothing = prompt_force(o, stiff)[0], np.zeros((o.motion.time.size, 0))
        for tau in np.array([-2.6, -0.8, 1.8]) * o.delay_s:
            sensors = {"sensor_delay": {"tau": tau}}
            own = o.likeliest_delay(o.delayed(force, sensors))
            left = o.standardised((o.measured - o.delayed(force)(tau + own))[:, np.newaxis])
            misfit = np.sum(o.residual_and_slopes(force, nothing, sensors) ** 2)
            assert misfit == pytest.approx(np.sum(left**2) + (own / o.delay_s) ** 2, abs=1e-4)


def test_the_instant_of_a_standing_voltage_does_not_matter(rng: np.random.Generator) -> None:
    (cleaned,) = clean((sine(damper_of(TWO), 0.0, 1.0, 0.02, rng),))
    assert predict(damper_of(TWO), cleaned, 5e-4).timing.shape == (cleaned.record.time.size, 0)


def test_a_sample_beside_a_jump_is_worth_nothing(rng: np.random.Generator) -> None:
    truth = damper_of(TWO, stribeck_friction={"F_s": 200.0, "v_s": 0.04})
    (cleaned,) = clean((sine(truth, 0.0, 1.0, 0.02, rng, noise=0.002),))
    made = evidence((cleaned.record, sine(truth, 150.0, 1.0, 0.02, rng)), truth)
    one = made.whole.observations[0]
    bend = np.abs(np.convolve(one.measured, (1.0, -2.0, 1.0), "same"))
    bend[[0, -1]] = 0.0
    spike = np.zeros(one.measured.size)
    spike[int(np.argmax(bend))] = 100.0
    elsewhere = np.roll(spike, 100)
    worth = [float(np.sum(one.standardised(s) ** 2)) for s in (spike, elsewhere)]
    assert worth[0] < 0.1 * worth[1]


EVIDENCE_OF = {
    "orifice_quadratic": ((301.0, 2720.0, 199e3), {"q": 1500.0}),
    "rounded_yield": ((301.0, 2720.0, 199e3), {"w_s": 0.01}),
    "stribeck_friction": ((301.0, 2720.0, 1e6), {"F_s": 40.0, "v_s": 0.03}),
}
"""Element and values of an effect: one that shows everywhere, at low speed, and beside a flank of a few samples."""


@pytest.mark.parametrize("effect", EVIDENCE_OF)
def test_evidence_is_a_band_s_and_not_a_sample_s(effect: str, rng: np.random.Generator) -> None:
    # The same noise a hertz at every sampling rate, all of which hold the band that is compared, 80 Hz: sampling faster
    # tells nothing that the damper did not do.
    (friction, damping, stiffness), values = EVIDENCE_OF[effect]
    row = BaseRow(voltage_V=0.0, T0_N=friction, C_Ns_per_m=damping, k_N_per_m=stiffness)
    plain, true = Damper(base=(row,)), Damper(base=(row,), effects={effect: values})
    found = []
    for rate in (250.0, 1000.0, 8000.0):
        noise = 0.01 * np.sqrt(rate / 1000.0)
        tests = [sine(true, 0.0, f, 0.02, rng, noise=noise, colour=0.0, rate=rate) for f in (0.5, 1.0)]
        campaign = cross_validation_of(campaign_of(tests), plain, 0.0025).campaign  # which sees all samples
        whole = evidence_of(campaign, plain).whole
        before = fit(whole, (), whole.start())
        found.append(-candidate(whole, before, library()[effect]).delta_bic)
    assert min(found) > 100.0
    assert min(found) > 2.0 / 3.0 * max(found)


@pytest.mark.parametrize(
    ("effect", "values"), [("gas_spring", {"k_g": 2000.0}), ("preload_offset", {"F_0": 40.0})], ids=str
)
def test_nor_is_it_a_sample_s_where_nothing_repeats(
    effect: str, values: dict[str, float], rng: np.random.Generator
) -> None:
    # What is missing beside a flank fills the band: from 250 to 1000 Hz it passes for noise in part, where no cycle
    # tells it from noise. What is slow does not.
    row = BaseRow(voltage_V=0.0, T0_N=301.0, C_Ns_per_m=2720.0, k_N_per_m=199e3)
    plain, true = Damper(base=(row,)), Damper(base=(row,), effects={effect: values})
    found = []
    for rate in (250.0, 1000.0, 4000.0):
        time = np.arange(round(20.0 * rate)) / rate
        records = []
        for slowest in (0.61, 0.87):
            kinematics, voltage = tones(time, slowest, (0.0, 1.0, 2.0)), np.zeros(time.size)
            force = respond(true, Motion(time, *kinematics, voltage))
            noise = 0.01 * np.max(np.abs(force)) * np.sqrt(rate / 1000.0) * rng.standard_normal(time.size)
            records.append(Record(f"{slowest}", None, time, *kinematics, force + noise, voltage))
        whole = evidence_of(cross_validation_of(campaign_of(records), plain, 0.0025).campaign, plain).whole
        found.append(-candidate(whole, fit(whole, (), whole.start()), library()[effect]).delta_bic)
    assert min(found) > 30.0
    assert min(found) > 2.0 / 3.0 * max(found)


def test_samples_beside_a_step_of_the_voltage_are_not_judged(rng: np.random.Generator) -> None:
    (cleaned,) = clean((sine(damper_of(TWO), 0.0, 1.0, 0.02, rng),))
    voltage = np.where(np.arange(cleaned.record.time.size) < 3000, 0.0, 150.0)
    stepped = replace(cleaned, record=replace(cleaned.record, voltage=voltage), lead=None, cycles=None)
    before, after = 2999, 3000
    reach = round(NEAR_STEP * stepped.record.rate)
    assert reach >= 1
    assert not comparable_samples(stepped)[before - reach : after + reach + 1].any()
    assert comparable_samples(stepped)[[before - reach - 1, after + reach + 1]].all()


def test_the_most_demanding_tests_of_the_rig_are_fitted(rng: np.random.Generator) -> None:
    cleaned = clean(sines(damper_of(), rng, cycles=4))
    roles = split(cleaned, None, 2.0).roles
    for channel in ("force", "velocity", "displacement"):
        peaks = [float(np.max(np.abs(getattr(p.record, channel)))) for p in cleaned]
        assert roles[int(np.argmax(peaks))][0] == TRAINING


# ---------------------------------------------------------------- no sample is in two parts


def tones(time: Array, slowest: float, phases: Sequence[float] | Array) -> tuple[Array, Array, Array]:
    """Displacement, velocity and acceleration of three tones without a common period, the slowest in Hz."""
    sizes = ((slowest, 0.012), (2.4 * slowest, 0.006), (6.17 * slowest, 0.002))
    angles = [2.0 * np.pi * f * time + p for (f, _), p in zip(sizes, phases, strict=True)]
    x, v, a = (
        sum(X * (2.0 * np.pi * f) ** n * wave(at) for (f, X), at in zip(sizes, angles, strict=True))
        for n, wave in ((0, np.sin), (1, np.cos), (2, lambda at: -np.sin(at)))
    )
    return np.asarray(x), np.asarray(v), np.asarray(a)


def road_record(rng: np.random.Generator, count: int, name: str) -> Record:
    """A test that does not repeat: three tones without a common period."""
    time = np.arange(count) / 500.0
    x, v, a = tones(time, 1.13, rng.uniform(0.0, 2.0 * np.pi, 3))
    force = respond(damper_of((0.0,)), Motion(time, x, v, a, np.zeros(count)))
    measured = force + 5.0 * rng.standard_normal(count)
    return Record(name, None, time, x, v, a, measured, np.zeros(count))


def samples_of(observation: WeightedRecord) -> set[tuple[str, int]]:
    """The samples of the record that an observation is compared at."""
    assert np.all(np.diff(observation.sample_indices) == 1)
    return {(observation.name, int(i)) for i in observation.sample_indices[observation.compared]}


@pytest.mark.parametrize("count", [1, 2])
def test_no_sample_has_two_roles(rng: np.random.Generator, count: int) -> None:
    records = tuple(road_record(rng, 6_000, f"road-{i}") for i in range(count))
    found = evidence(records, damper_of((0.0,)))
    compared = {
        part: {s for o in problem.observations for s in samples_of(o)}
        for part, problem in (
            (TRAINING, found.halves[0]),
            (VALIDATION, found.halves[1]),
            ((TRAINING, VALIDATION), found.whole),
        )
    }
    assert not compared[TRAINING] & compared[VALIDATION]
    assert compared[TRAINING] | compared[VALIDATION] == compared[TRAINING, VALIDATION]
    roles = dict(zip((p.record.name for p in found.campaign.cleaned), found.campaign.split.roles, strict=True))
    for part, samples in compared.items():
        wanted = part if isinstance(part, tuple) else (part,)
        assert samples
        assert {int(roles[name][i]) for name, i in samples} == set(wanted)
    assert HELD_OUT not in {int(roles[name][i]) for name, i in compared[TRAINING, VALIDATION]}


def test_noise_is_white_within_the_stretches_that_are_compared(rng: np.random.Generator) -> None:
    found = evidence((road_record(rng, 10_000, "road"),), damper_of((0.0,)))
    (training,) = found.halves[0].observations
    (force,) = fit(found.halves[0], (), found.halves[0].start()).simulated
    left = training.standardised(training.measured - force)
    assert np.count_nonzero(np.diff(training.compared.astype(int)) == 1) == 3  # four stretches
    assert left.size < training.measured.size or not training.noise.coefficients.size
    assert float(left @ left) / left.size == pytest.approx(1.0, abs=0.15)


# --- Initial force of a part of a test


def within_the_stick(offset: float, rng: np.random.Generator) -> Record:
    """A motion of 1 mm without a period, which 301 N of friction at 0 V never let slip, beside a preload."""
    time = np.arange(8000) / 500.0
    tones = ((1.13, 0.5e-3), (2.71, 0.3e-3), (6.97, 0.1e-3))
    x, v, a = (
        sum(X * (2 * np.pi * f) ** n * wave(2 * np.pi * f * time) for f, X in tones)
        for n, wave in ((0, np.sin), (1, np.cos), (2, lambda at: -np.sin(at)))
    )
    damper = damper_of((0.0,), preload_offset={"F_0": offset})
    force = respond(damper, Motion(time, x, v, a, np.zeros(time.size)), offset + 30.0)
    noise = rng.standard_normal(time.size)
    return Record("stuck", None, time, x, v, a, force + 0.1 * noise, np.zeros(time.size))


def test_a_part_that_begins_later_is_simulated_from_the_force_at_its_motions_first_sample(
    rng: np.random.Generator,
) -> None:
    found = evidence((within_the_stick(150.0, rng),), damper_of((0.0,)))
    truth = damper_of((0.0,), preload_offset={"F_0": 150.0})
    parts = [o for half in found.halves for o in half.observations]
    assert any(o.sample_indices[0] > 0 for o in parts)
    for o in parts:
        assert np.max(np.abs(o.measured - o.at_compared(shown_force(o, truth)))) < 2.0, o.sample_indices[0]


# --- Marginalised nuisances against the covariance matrix that they give the residuals


Columns = Callable[[np.random.Generator], Array]
RESIDUALS = 80


def dense(rng: np.random.Generator) -> Array:
    """An offset, a gain and a delay of very unlike sizes."""
    return rng.standard_normal((RESIDUALS, 3)) * [0.01, 1.0, 30.0]


def sparse(rng: np.random.Generator) -> Array:
    """A sample beside a jump each, and what noise remembers of it."""
    columns = np.zeros((RESIDUALS, 12))
    for j in range(12):
        columns[6 * j : 6 * j + 4, j] = 5.0 * rng.standard_normal(4)
    return columns


@pytest.mark.parametrize("columns", [dense, sparse])
def test_marginalised_residuals_have_the_likelihood_of_their_covariance(
    columns: Columns, rng: np.random.Generator
) -> None:
    """|r'|^2 = r' (I + V V')^-1 r, the exponent of the marginal likelihood."""
    V, r = columns(rng), rng.standard_normal((RESIDUALS, 4))
    left = MarginalisedNuisances.from_columns(V).marginalised(r)
    exact = r.T @ np.linalg.solve(np.eye(RESIDUALS) + V @ V.T, r)
    np.testing.assert_allclose(left.T @ left, exact, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(MarginalisedNuisances.from_columns(V).marginalised(r[:, 0]), left[:, 0], atol=1e-12)


def test_of_two_groups_of_nuisances_the_likelihood_is_that_of_all(rng: np.random.Generator) -> None:
    """Columns of single samples, some of which overlap, are integrated out by clusters, and before the others."""
    V, local, r = dense(rng), sparse(rng), rng.standard_normal((RESIDUALS, 4))
    local[:, 3:9] += np.roll(local[:, 3:9], 2, axis=0)
    left = MarginalisedNuisances.from_columns(V, csr_array(local)).marginalised(r)
    both = np.column_stack([V, local])
    exact = r.T @ np.linalg.solve(np.eye(RESIDUALS) + both @ both.T, r)
    np.testing.assert_allclose(left.T @ left, exact, rtol=1e-9, atol=1e-9)


def test_without_nuisances_marginalisation_changes_nothing(rng: np.random.Generator) -> None:
    r = rng.standard_normal((RESIDUALS, 2))
    np.testing.assert_array_equal(MarginalisedNuisances.none(RESIDUALS).marginalised(r), r)


def test_a_seal_that_turns_between_two_samples_leaves_the_true_damper_what_noise_leaves(
    rng: np.random.Generator,
) -> None:
    # At 500 Hz a cycle has 89.93 samples: each reverses elsewhere between two of them, and their mean does not jump.
    true = damper_of((0.0,), stribeck_friction={"F_s": 56.0, "v_s": 0.11})
    fine = sine(true, 0.0, 5.56, 0.02, rng, noise=0.0015, colour=0.0, rate=5000.0)
    for first in range(10):
        record = sliced(fine, np.arange(fine.time.size) % 10 == first)
        (cleaned,) = clean([record])
        everything = np.ones(cleaned.record.time.size, dtype=np.bool_)
        given = predict(true, cleaned, 5e-4)
        observed = weighted_record(cleaned, everything, 0, given, NuisanceConfig())
        assert observed is not None
        force, sensors = prompt_force(observed, true)
        left = observed.residual_and_slopes(force, np.zeros((force.size, 0)), sensors)[:, 0]
        assert left @ left < left.size + 4.0 * np.sqrt(2.0 * left.size)  # four standard deviations of chi-square
