"""The intervals of effect parameters: as wide as noise, the tests' own delays and their disagreement make them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic import all_but, damper_of, diagnosed, sine, sines

from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.diagnosis.campaign import Campaign, Evidence, evidence_of
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.fit.least_squares import FitResult, base_half_widths, fit, standard_errors
from pzd.diagnosis.fit.problem import Unknown
from pzd.diagnosis.fit.sensitivities import BlockJacobian
from pzd.diagnosis.roles import split
from pzd.fit.intervals import LEVEL, disagreement
from pzd.record import Array, Record, sliced
from pzd.signals.nuisance import NuisanceConfig

DRAWS = 400
TESTS = 9
DELAY = NuisanceConfig().delay_s
OF_EFFECT = slice(3, 4)
"""Of what `linear` searches, the effect's parameter."""


def linear(rng: np.random.Generator, pulled: float) -> tuple[FitResult, float]:
    """A linear fit of three base variables and one parameter, and by how much it misses that parameter.

    Every test has its own value of the parameter besides, `pulled` times what its noise leaves of it.
    """
    slopes = rng.standard_normal((TESTS, 40, 4))
    own = pulled / np.linalg.norm(slopes[:, :, 3], axis=1) * rng.standard_normal(TESTS)
    residuals = rng.standard_normal((TESTS, 40)) - slopes[:, :, 3] * own[:, None]
    jacobian, left = np.concatenate(slopes), np.concatenate(residuals)
    step = -np.linalg.inv(jacobian.T @ jacobian) @ jacobian.T @ left
    left = left + jacobian @ step
    parameter = library()["fluid_inertia"].parameters[0]
    unknowns = (Unknown("fluid_inertia", parameter, 1.0),)
    split_left = tuple(left.reshape(TESTS, 40))
    by_all = BlockJacobian(4, ((tuple(range(4)), jacobian),))
    fitted = FitResult(damper_of(), (), step, split_left, (), unknowns, np.zeros((0, 4)), lambda: by_all)
    return fitted, float(step[3])


def share_inside(rng: np.random.Generator, pulled: float, errors: Callable[[FitResult], Array]) -> float:
    fits = [linear(rng, pulled) for _ in range(DRAWS)]
    return float(
        np.mean([abs(miss) <= LEVEL * errors(fitted)[0] / fitted.unknowns[0].derivative(0.0) for fitted, miss in fits])
    )


def by_noise_alone(fitted: FitResult) -> Array:
    return np.sqrt(np.diag(fitted.covariance)[-1:]) * fitted.unknowns[0].derivative(0.0)


def test_tests_that_differ_by_noise_alone_disagree_by_one_on_average(rng: np.random.Generator) -> None:
    # Chi-square of eight degrees of freedom over eight: sd 0.5 a draw, 0.025 of the mean of 400; 4.5 sd.
    fits = [linear(rng, 0.0)[0] for _ in range(DRAWS)]
    found = [disagreement(np.split(f.jacobian.dense(), TESTS), f.residuals, f.covariance, OF_EFFECT)[0] for f in fits]
    assert np.mean(found) == pytest.approx(1.0, abs=0.12)


def test_ninety_five_in_a_hundred_intervals_hold_the_truth_where_noise_is_all(
    rng: np.random.Generator,
) -> None:
    # Binomial, 400 draws at 0.96: sd 0.01.
    assert 0.92 <= share_inside(rng, 0.0, standard_errors) <= 0.998


def test_intervals_widen_with_the_disagreement_of_tests_so_that_they_hold_the_truth(
    rng: np.random.Generator,
) -> None:
    # Three times the noise between tests: by noise alone 46 of 100 hold it, by the spread of nine tests 92.
    assert share_inside(rng, 3.0, by_noise_alone) < 0.6
    assert share_inside(rng, 3.0, standard_errors) > 0.86


def shown_late(
    delay: float, effects: dict[str, dict[str, float]], test: tuple[float, float, float], rng: np.random.Generator
) -> Record:
    voltage, frequency, amplitude = test
    late = {"sensor_delay": {"tau": effects.get("sensor_delay", {}).get("tau", 0.0) + delay}}
    record = sine(damper_of((voltage,), **{**effects, **late}), voltage, frequency, amplitude,
                  rng, noise=0.0, cycles=5, rate=500.0)  # fmt: skip
    record = sliced(
        record, record.time < record.time[-1] - 0.05
    )  # a channel ahead of time has nothing to show at the end
    return replace(record, force=record.force + 1e-4 * np.max(record.force) * rng.standard_normal(record.force.size))


def fitted_to(records: tuple[Record, ...], effects: dict[str, dict[str, float]]) -> tuple[Evidence, FitResult]:
    """Fitted from the truth, and weighed by what that leaves."""
    damper, cleaned = damper_of((0.0, 150.0), **effects), clean(records)
    for _ in range(3):
        evidence = evidence_of(Campaign(cleaned, split(cleaned, None, 2.0), NuisanceConfig()), damper)
        found = fit(evidence.whole, tuple(effects), evidence.whole.start_with(damper))
        damper = found.damper
    return evidence, found


FOUR = tuple((U, f, x) for U in (0.0, 150.0) for f, x in ((1.0, 0.015), (2.5, 0.02)))


@pytest.mark.parametrize("tau", [4.2e-3, -9e-3])
def test_a_common_delay_is_known_no_better_than_the_delays_of_the_tests_let_it(
    tau: float, rng: np.random.Generator
) -> None:
    # Each test has a delay of its own, sd 0.5 ms, and nothing else tells a common one from those: four that agree show
    # hardly that the stand is better than that.
    effects = {"sensor_delay": {"tau": tau}}
    evidence, found = fitted_to(tuple(shown_late(0.0, effects, test, rng) for test in FOUR), effects)
    count = len(evidence.whole.observations)
    assert found.damper.effects["sensor_delay"]["tau"] == pytest.approx(tau, abs=DELAY / np.sqrt(count))
    by_the_tests = DELAY / np.sqrt(count)
    assert 0.75 * by_the_tests < standard_errors(found)[0] < 1.2 * by_the_tests


def test_t0_c_and_k_beside_an_effect_have_intervals_that_hold_them(rng: np.random.Generator) -> None:
    effects = {"orifice_quadratic": {"q": 1500.0}}
    evidence, found = fitted_to(tuple(shown_late(0.0, effects, test, rng) for test in FOUR), effects)
    widths = base_half_widths(found, evidence.whole.coordinates)
    fitted, true = (
        np.array([(r.T0_N, r.C_Ns_per_m, 1.0 / r.k_N_per_m) for r in damper.base])
        for damper in (found.damper, damper_of((0.0, 150.0)))
    )
    assert np.all(np.abs(fitted - true) <= widths)
    assert np.all(widths < 0.1 * true)
    # Two tests at each voltage know neither T0 nor C better than the gain of a load cell.
    assert np.all(widths[:, :2] > LEVEL * NuisanceConfig().gain / np.sqrt(2.0) * 0.5 * true[:, :2])


def test_a_delay_of_the_tests_does_not_pass_for_more_or_less_play(rng: np.random.Generator) -> None:
    # To first order a late force lacks its slope; at the corners of free play it lacks more than that.
    effects = {"lash": {"delta": 1.5e-4}}
    shifts = (1.2e-3, -1.2e-3, 1.2e-3, -1.2e-3)
    late = tuple(shown_late(delay, effects, test, rng) for delay, test in zip(shifts, FOUR, strict=True))
    found = fitted_to(late, effects)[1]
    delta = found.damper.effects["lash"]["delta"]
    # Delays of 2.4 standard deviations are drawn towards zero by their prior: not by more than the interval allows.
    assert delta == pytest.approx(1.5e-4, rel=0.02)
    assert abs(float(delta) - 1.5e-4) < LEVEL * standard_errors(found)[0]


def test_t0_c_and_k_of_tests_that_repeat_are_as_near_as_all_of_them_show(rng: np.random.Generator) -> None:
    """Four tests a level that have no gain of their own, two of them held out for the verdict alone."""
    truth = damper_of(orifice_quadratic={"q": 1500.0})
    tests = ((1.0, 0.02), (3.0, 0.02), (2.0, 0.03), (2.0, 0.01))
    records = sines(truth, rng, tests=tests, noise=0.002, colour=0.0)
    found = diagnosed(records, forbid=all_but("orifice_quadratic"))
    assert found.diagnosis.effects == ("orifice_quadratic",)
    for row, true in zip(found.damper.base, truth.base, strict=True):
        found_row, true_row = ([each.T0_N, each.C_Ns_per_m, each.k_N_per_m] for each in (row, true))
        assert found_row == pytest.approx(true_row, rel=0.002)


def test_a_preload_is_not_surer_than_whether_the_friction_is_asymmetric_as_the_valve_is(
    rng: np.random.Generator,
) -> None:
    """A seal rubs alike both ways, a valve does not: at one T0 a constant force is known as badly as which it is."""
    row, alpha = BaseRow(voltage_V=0.0, T0_N=60.0, C_Ns_per_m=1500.0, k_N_per_m=4e6), 0.2
    tests = ((1.0, 0.01), (1.0, 0.025), (2.5, 0.01), (2.5, 0.025))
    plain = sines(Damper(base=(row,)), rng, (0.0,), tests=tests, noise=3e-3, cycles=5, jitter=0.0)
    records = [replace(r, force=r.force + alpha * 1500.0 * np.abs(r.velocity) - 20.0) for r in plain]
    found = diagnosed(records).diagnosis
    assert {"asymmetry", "viscous_asymmetry"} & set(found.effects)
    assert "preload_offset" in found.effects
    (estimate,) = found.parameters["preload_offset"]["F_0"].estimates
    assert estimate.low95 is not None
    assert estimate.high95 is not None
    assert estimate.low95 <= -20.0 <= estimate.high95
    assert estimate.high95 - estimate.low95 < 25.0


@pytest.mark.parametrize("exponent", [1.0, 1.15, 1.4])
def test_a_gas_of_any_exponent_lies_in_the_intervals(exponent: float, rng: np.random.Generator) -> None:
    """Its law differs from the library's by a constant, which a preload takes up: none is sure of the exponent."""
    force, length = 250.0, 0.11
    row = BaseRow(T0_N=60.0, C_Ns_per_m=800.0, k_N_per_m=5e6)
    records = []
    for frequency, amplitude in ((0.5, 0.02), (0.5, 0.035), (2.0, 0.02), (2.0, 0.035)):
        test = sine(Damper(base=(row,)), 0.0, frequency, amplitude, rng, noise=0.002, colour=0.0, rate=500.0)
        gas = -force * (1.0 + test.displacement / length) ** -exponent
        records.append(replace(test, force=test.force + gas, voltage=None))
    found = diagnosed(records, forbid=all_but("accumulator", "preload_offset")).diagnosis
    assert found.effects == ("accumulator", "preload_offset")
    truth = {"accumulator": {"F_g": force, "L": length}, "preload_offset": {"F_0": 0.0}}
    for effect, parameters in truth.items():
        for name, true in parameters.items():
            value = found.parameters[effect][name]
            low, high = value.low95, value.high95
            assert isinstance(low, float)
            assert isinstance(high, float)
            assert low <= true <= high, (effect, name, value)
