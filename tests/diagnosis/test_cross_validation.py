"""Cross-validation: prediction error of tests and voltages that no fit has seen, and its comparison."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import TABLE_2, TWO, campaign_of, damper_of, sine, sines

from pzd.artefacts import Prediction
from pzd.damper.model import Damper
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation, cross_validation_of
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.fit.sensitivities import linearise
from pzd.diagnosis.verdict import no_prediction_note
from pzd.fit.cross_validation import PredictionError, predicts_better, predicts_worse
from pzd.record import Record

TESTS = ((0.5, 0.02), (0.5, 0.03), (2.0, 0.02), (2.0, 0.03))
OTHER_TESTS = ((0.5, 0.02), (1.0, 0.03), (2.0, 0.03))


def validation(records: tuple[Record, ...], plain: Damper) -> CrossValidation:
    return cross_validation_of(campaign_of(records), plain, DiagnoseConfig().visible)


def predicted(records: tuple[Record, ...], plain: Damper, damper: Damper) -> Prediction:
    asked = validation(records, plain)
    between = asked.interpolation_error(damper, by_criterion=False)
    found = asked.prediction(asked.baseline_error(), asked.held_out_error(damper), between)
    assert found is not None
    return found


def test_nothing_is_fitted_to_a_held_out_test(rng: np.random.Generator) -> None:
    records = [sine(damper_of(TWO), U, f, x, rng, noise=1e-3, cycles=4) for U in TWO for f, x in TESTS]
    records[2] = replace(records[2], force=1.05 * records[2].force)
    found = predicted(tuple(records), damper_of(TWO), damper_of(TWO))
    (odd,) = (each for each in found.by if each.record == records[2].name)
    # A gain of 5 % of one test is within the priors of nuisances, and here it is missed all the same; a damper fitted
    # to this test beside the three others of its voltage would miss about half. Noise scatters the one by 0.6 %, one
    # standard deviation. The fit that leaves each test a gain of its own sees friction and damping part by the shape
    # of each loop alone, which scatters the other by 3 %.
    assert odd.W_s_plain == pytest.approx((0.05 / 1.05) ** 2, rel=0.04)
    assert odd.W_s == pytest.approx((0.05 / 1.05) ** 2, rel=0.2)
    assert found.hold_out == "tests"
    assert sorted(each.record for each in found.by) == sorted(r.name for r in records)


def test_a_missing_effect_lowers_the_held_out_error(rng: np.random.Generator) -> None:
    truth = damper_of(TWO, preload_offset={"F_0": 120.0})
    found = predicted(sines(truth, rng, TWO, cycles=4), damper_of(TWO), truth)
    assert found.W_s < 0.2 * found.W_s_plain
    assert all(each.W_s < each.W_s_plain for each in found.by)


def test_a_stop_that_one_test_shows_is_not_foretold_by_the_others(rng: np.random.Generator) -> None:
    """Refitted to tests that end just before it, its hardness is their noise: 90 times the error of the plain one."""
    truth = damper_of((0.0,), end_stop={"k_e": 2e6, "x_e": 0.02})
    tests = ((0.5, 0.0201), (1.0, 0.0201), (2.0, 0.0201), (1.0, 0.0214))
    plain = damper_of((0.0,))
    found = predicted(sines(truth, rng, (0.0,), tests=tests, cycles=4, noise=2e-3), plain, truth)
    *_, longest = sorted(found.by, key=lambda each: each.W_s_plain)
    assert longest.W_s < 1.5 * longest.W_s_plain
    assert found.W_s < 1.5 * found.W_s_plain


def test_voltages_between_others_are_left_out_one_at_a_time(rng: np.random.Generator) -> None:
    damper = damper_of()
    found = predicted(sines(damper, rng, tests=OTHER_TESTS, cycles=4), damper, damper).left_out_voltages
    assert [each.voltage for each in found] == [50.0, 100.0]
    for each in found:
        rows = {row.voltage_V: row for row in damper.base}
        below, mine, above = (rows[U].T0_N for U in (each.voltage - 50.0, each.voltage, each.voltage + 50.0))
        # The piezo's friction bends over the voltage, so that the line between its neighbours misses it by so much.
        share = abs(0.5 * (below + above) - mine) / (mine + rows[each.voltage].C_Ns_per_m * 0.3)
        assert 0.2 * share**2 < each.W_s < 5.0 * share**2


def test_a_voltage_without_tests_keeps_its_parameters_and_stops_no_other_search(rng: np.random.Generator) -> None:
    """At large, its T0 goes to a limit, where the step of all ends: a search of 20 steps was then far from its end."""
    three = (0.0, 50.0, 150.0)
    truth = damper_of(three, rounded_yield={"w_s": 0.02}, preload_offset={"F_0": 60.0})
    records = sines(truth, rng, three, tests=((1.0, 0.02), (2.5, 0.01)), cycles=3, noise=2e-3)
    problem = evidence_of(campaign_of(records), damper_of(three)).whole
    effects, start = ("rounded_yield", "preload_offset"), problem.start_with(truth)
    start[[1, 2, 7, 8]] += 0.5
    kept = replace(problem, observations=tuple(o for o in problem.observations if o.base_row != 1))
    found = fit(kept, effects, start)
    np.testing.assert_array_equal(found.optimum[3:6], start[3:6])
    exact = fit(kept, effects, problem.start_with(truth), 100)
    assert found.misfit < exact.misfit + 0.1


def test_a_voltage_is_known_by_its_rows_at_any_temperature(rng: np.random.Generator) -> None:
    """They have it not quite: 150 V at one, 150.002 V at the other, and either row may be without a test."""
    plain = damper_of(TWO)
    asked = validation(sines(plain, rng, TWO, tests=TESTS, cycles=3), plain)
    warm = tuple(row.model_copy(update={"voltage_V": (row.voltage_V or 0.0) + 2e-3}) for row in plain.base)
    known = asked._predictable(plain.model_copy(update={"base": warm}), asked.folds[0])
    assert [mask.any() for mask in known] == [mask.any() for mask in asked.folds[0]]
    cold = plain.model_copy(update={"base": plain.base[:1]})
    lost = [p.record.voltage is not None and p.record.voltage[0] > 75.0 for p in asked.campaign.cleaned]
    known = asked._predictable(cold, asked.folds[0])
    assert [mask.any() for mask in known] == [
        m.any() and not gone for m, gone in zip(asked.folds[0], lost, strict=True)
    ]


@pytest.mark.parametrize("tests", [OTHER_TESTS[:1], OTHER_TESTS])
def test_a_test_alone_at_its_voltage_holds_out_its_cycles(
    rng: np.random.Generator, tests: tuple[tuple[float, float], ...]
) -> None:
    records = sines(damper_of(TWO), rng, (0.0,), tests=tests, cycles=4) + sines(
        damper_of(TWO), rng, (150.0,), tests=((2.0, 0.03),), cycles=4
    )
    found = predicted(records, damper_of(TWO), damper_of(TWO))
    assert found.hold_out == ("cycles" if len(tests) == 1 else "mixed")
    assert len(found.by) == len(records)


def test_the_one_test_that_slips_is_not_foretold_by_those_that_only_strain_the_oil_spring(
    rng: np.random.Generator,
) -> None:
    """At 150 V three tests of four do not reach T0: without the fourth it may be anything beyond their force."""
    plain = damper_of((0.0, 150.0))
    tests = ((0.5, 0.0025), (1.0, 0.0025), (2.0, 0.0029), (1.0, 0.01))
    asked = validation(sines(plain, rng, (0.0, 150.0), tests=tests, cycles=4), plain)
    *_, slipping = (i for i, p in enumerate(asked.campaign.cleaned) if "150V" in p.record.name)
    assert asked.lone == {slipping}
    for each in asked.folds:
        assert not each[slipping].all()
    # Those of 0 V all slip: each is held out as a whole.
    assert sum(fold[i].all() for fold in asked.folds for i in range(len(tests))) == len(tests)


def test_too_little_to_hold_a_test_out_is_reported(rng: np.random.Generator) -> None:
    damper = damper_of((0.0,))
    asked = validation((sine(damper, 0.0, 1.0, 0.03, rng, cycles=1, rate=1000.0),), damper)
    assert (
        asked.prediction(asked.baseline_error(), asked.held_out_error(damper), asked.baseline_interpolation_error)
        is None
    )
    assert "too little to keep a test back" in no_prediction_note(None)


# --- Comparison of prediction errors


def test_a_worse_prediction_exceeds_two_standard_errors_at_some_voltage(rng: np.random.Generator) -> None:
    asked = validation(sines(damper_of(TWO), rng, TWO, cycles=2), damper_of(TWO))
    records = tuple(range(8))
    plain = PredictionError(records, *(np.full(8, value) for value in (1.0, 100.0, 100.0, 1e-3)))
    alike = replace(plain, error=1.0 + 0.1 * np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0]))
    at_one = replace(plain, error=np.array([0.1, 0.2, 0.1, 0.2, 1.2, 1.3, 1.2, 1.3]))
    assert asked.worse_at(alike, plain) == ()
    assert asked.worse_at(at_one, plain) == (150.0,)
    assert asked.worse_at(plain, at_one) == (0.0,)


def test_a_visible_loss_over_all_tests_is_worse_even_by_chance(rng: np.random.Generator) -> None:
    # One test of eight is missed by ten times as much, which the scatter of the differences may be: it is lost all the
    # same to whoever drives there.
    asked = validation(sines(damper_of(TWO), rng, TWO, cycles=2), damper_of(TWO))
    plain = PredictionError(tuple(range(8)), *(np.full(8, value) for value in (1.0, 100.0, 100.0, 1e-3)))
    lost = replace(plain, error=np.array([10.0, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9, 0.9]))
    assert not predicts_worse(lost, plain)
    assert asked.worse_at(lost, plain) == TWO


@pytest.mark.parametrize("tests", [2, 3, 12])
def test_chance_alone_predicts_worse_equally_rarely_for_any_number_of_tests(
    tests: int, rng: np.random.Generator
) -> None:
    """With two tests to a voltage, two standard errors of these two are chance in one of seven."""
    ones = np.ones(tests)
    plain = PredictionError(tuple(range(tests)), ones, 100.0 * ones, ones, 0.0 * ones)
    found = sum(
        predicts_worse(replace(plain, error=1.0 + 0.1 * rng.standard_normal(tests)), plain) for _ in range(8000)
    )
    expected = 8000 * 0.02275
    assert abs(found - expected) < 4.0 * np.sqrt(expected)


@pytest.mark.parametrize("tests", [2, 3, 12])
def test_chance_alone_predicts_better_rarely_for_any_number_of_tests(tests: int, rng: np.random.Generator) -> None:
    """By the differences or by the ratios: of two tests that both fell a little, neither says more than that."""
    ones = np.ones(tests)
    plain = PredictionError(tuple(range(tests)), ones, 100.0 * ones, ones, 0.0 * ones)
    found = sum(
        predicts_better(replace(plain, error=1.0 + 0.1 * rng.standard_normal(tests)), plain) for _ in range(4000)
    )
    assert found < 1.5 * 4000 * 0.02275


def test_a_gain_of_a_test_that_no_fit_has_seen_speaks_against_no_damper(rng: np.random.Generator) -> None:
    """The true damper predicts tests of gains within their prior as they are, and the shape of their force exactly."""
    truth = damper_of(TWO)
    records = sines(truth, rng, TWO, cycles=2)
    scaled = [replace(record, force=record.force * (1.015 if i % 2 else 0.985)) for i, record in enumerate(records)]
    alike, asked = validation(records, truth), validation(tuple(scaled), truth)
    before, error = alike.held_out_error(truth), asked.held_out_error(truth)
    assert error.error.sum() > 1.3 * before.error.sum()
    np.testing.assert_allclose(error.shapes.error.sum(), before.shapes.error.sum(), rtol=0.05)
    lucky, unlucky = replace(error, error=0.9 * error.error), replace(error, error=1.1 * error.error + 1e3)
    assert asked.worse_at(unlucky, lucky)
    assert not asked.worse_in_shape_at(unlucky, lucky)


def test_an_invisible_increase_of_the_error_is_not_worse(rng: np.random.Generator) -> None:
    asked = validation(sines(damper_of(TWO), rng, TWO, cycles=2), damper_of(TWO))
    plain = PredictionError(tuple(range(8)), *(np.full(8, value) for value in (1.0, 100.0, 100.0, 1e-2)))
    assert asked.worse_at(replace(plain, error=plain.error + 5e-3), plain) == ()
    assert asked.worse_at(replace(plain, error=plain.error + 2e-2), plain) == TWO


@pytest.mark.parametrize("lost", [1e180, np.inf])
def test_a_diverged_simulation_predicts_worse_without_a_warning(lost: float) -> None:
    """The square of what it misses would overflow, and leave a scatter beside which nothing is worse."""
    plain = PredictionError(tuple(range(6)), *(np.full(6, value) for value in (1.0, 100.0, 100.0, 1e-3)))
    assert predicts_worse(replace(plain, error=plain.error * lost), plain)
    assert not predicts_worse(plain, replace(plain, error=plain.error * lost))


def test_interpolation_is_much_worse_from_one_and_a_half_times_the_baseline_error(rng: np.random.Generator) -> None:
    """The tests of one voltage all miss what the line misses: that they agree is no evidence."""
    damper = damper_of((0.0, 50.0, 100.0))
    asked = validation(sines(damper, rng, (0.0, 50.0, 100.0), tests=OTHER_TESTS, cycles=4), damper)
    plain = asked.baseline_interpolation_error
    assert asked.interpolates_worse_at(plain) == ()
    assert asked.interpolates_worse_at(replace(plain, error=1.4 * plain.error)) == ()
    assert asked.interpolates_worse_at(replace(plain, error=1.6 * plain.error)) == (50.0,)
    small = replace(asked, visible=1.0)
    assert small.interpolates_worse_at(replace(small.baseline_interpolation_error, error=1.6 * plain.error)) == ()


def test_every_sample_of_every_voltage_is_held_out_once(rng: np.random.Generator) -> None:
    asked = validation(sines(damper_of(), rng, tests=OTHER_TESTS, cycles=2), damper_of())
    assert asked.voltages == tuple(TABLE_2)
    for i, cleaned in enumerate(asked.campaign.cleaned):
        kept_back = np.stack([fold[i] for fold in asked.folds])
        assert np.all(kept_back.sum(axis=0) == 1), cleaned.record.name
        assert kept_back.any(axis=1).sum() == 1


def test_to_first_order_each_test_is_predicted_as_by_a_refit_without_its_fold(rng: np.random.Generator) -> None:
    """Springs and offsets are linear, and a fold moves T0, C and k of the element by little."""
    truth = damper_of((0.0,), gas_spring={"k_g": 4000.0}, preload_offset={"F_0": 60.0})
    records = sines(truth, rng, (0.0,), tests=[*TESTS, (1.0, 0.02), (1.0, 0.03)], cycles=3, jitter=0.03, noise=1e-3)
    asked = validation(records, damper_of((0.0,)))
    found = asked.fit_by_criterion(truth, asked.no_samples)
    assert found is not None
    quick, slow = asked.error_to_first_order(*found), asked.error_by_criterion(truth)
    seen = np.array(
        [float(np.sum((o.measured - f) ** 2)) for o, f in zip(found[0].observations, found[1].simulated, strict=True)]
    )
    energy = np.array([float(np.sum(o.measured**2)) for o in found[0].observations])
    assert quick.criterion == pytest.approx(slow.criterion, rel=0.03)
    assert (quick.criterion or 0.0) > 1.1 * seen.sum() / energy.sum()
    order = [slow.records.index(i) for i in quick.records]
    assert quick.error / quick.energy == pytest.approx((slow.error / slow.energy)[order], rel=0.05)


def test_a_fit_to_every_sample_depends_on_the_damper_alone_whatever_was_fitted_before(rng: np.random.Generator) -> None:
    """Those that are kept are of the damper asked for, with the effects and Jacobian that a fit of its own has."""
    truth = damper_of((0.0,), gas_spring={"k_g": 4000.0}, preload_offset={"F_0": 60.0})
    records = sines(truth, rng, (0.0,), tests=TESTS, cycles=3, noise=1e-3)
    asked = validation(records, damper_of((0.0,)))
    begun = [truth, truth.without_effects("gas_spring"), truth.without_effects("gas_spring", "preload_offset"), truth]
    for damper in begun:
        alone = validation(records, damper_of((0.0,)))
        found, own = asked.fit_by_criterion(damper, asked.no_samples), alone.fit_by_criterion(damper, alone.no_samples)
        assert found is not None
        assert own is not None
        (problem, fitted), (_, other) = found, own
        assert fitted.damper == other.damper
        limits = np.full(fitted.optimum.size, -np.inf), np.full(fitted.optimum.size, np.inf)
        anew = linearise(problem, fitted.unknowns, fitted.optimum, limits)
        np.testing.assert_allclose(fitted.jacobian.dense(), anew.jacobian.dense(), rtol=1e-9, atol=1e-12)
