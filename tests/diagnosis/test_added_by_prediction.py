"""Where a gap has no name, the damper gets what lets it predict tests that no fit has seen, and nothing impossible."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sines
from test_kept_back import TWO, campaign_of
from whole_diagnosis import all_but

from pzd.damper.effects import library, nameable
from pzd.damper.model import Damper, against_nature
from pzd.diagnosis.adoption import ADDED, REPLACED, Adoption, add_predictive_effects, adopt_effects
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation, cross_validation_of
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.search.candidates import candidates, per_voltage_candidates, starts_of
from pzd.record import Record

TESTS = ((0.5, 0.03), (1.0, 0.02), (2.0, 0.03))


def records_of(truth: Damper, rng: np.random.Generator) -> tuple[Record, ...]:
    return sines(truth, rng, TWO, tests=TESTS, cycles=3, noise=2e-3)


def plain_selection(records: tuple[Record, ...], config: DiagnoseConfig) -> tuple[Selection, CrossValidation]:
    campaign = campaign_of(records)
    evidence = evidence_of(campaign, damper_of(TWO))
    plain = fit(evidence.whole, (), evidence.whole.start())
    return Selection(plain, plain, (), {}, evidence, evidence), cross_validation_of(
        campaign, plain.damper, config.visible
    )


def extended(records: tuple[Record, ...], config: DiagnoseConfig) -> tuple[Adoption, float]:
    """The baseline with what is added to it, and the held-out W_s of the baseline."""
    selection, validation = plain_selection(records, config)
    error = validation.baseline_error()
    assert error.criterion is not None
    adoption = Adoption(selection, error, error, validation.baseline_interpolation_error)
    return add_predictive_effects(adoption, validation, config), error.criterion


def test_what_is_missing_is_added_one_effect_after_another(rng: np.random.Generator) -> None:
    truth = damper_of(TWO, preload_offset={"F_0": 150.0}, gas_spring={"k_g": 8000.0})
    found, before = extended(records_of(truth, rng), DiagnoseConfig())
    assert set(found.added) == {"preload_offset", "gas_spring"}
    assert found.error.criterion is not None
    assert found.error.criterion < 0.05 * before
    values = found.selection.fitted.damper.effects
    assert values["preload_offset"]["F_0"] == pytest.approx(150.0, rel=0.05)
    assert values["gas_spring"]["k_g"] == pytest.approx(8000.0, rel=0.05)


@pytest.mark.ci
def test_a_branch_that_no_verdict_names_is_added_with_its_values(rng: np.random.Generator) -> None:
    """Looked for by voltage, in proportion to T0: 301 N and 1325 N."""
    by_voltage_V = {"T0_2": (150.0, 500.0), "k_2": (3e4, 8e4), "at_voltage_V": TWO}
    records = records_of(damper_of(TWO).with_effect("second_branch", by_voltage_V), rng)
    found, before = extended(records, DiagnoseConfig(most_added=1))
    assert found.added == ("second_branch by voltage",)
    assert found.selection.reasons["second_branch"] == ADDED
    assert found.error.criterion is not None
    assert found.error.criterion < 0.05 * before
    values = found.selection.fitted.damper.effects["second_branch"]
    for name in ("T0_2", "k_2"):
        assert values[name] == pytest.approx(by_voltage_V[name], rel=0.05)
    selection, _ = plain_selection(records, DiagnoseConfig())
    tried = candidates(selection.initial_evidence.whole, selection.baseline, silent=True)
    assert {c.effect for c in tried} <= nameable().keys()


def test_what_goes_with_t0_starts_in_proportion_to_it_at_each_voltage(rng: np.random.Generator) -> None:
    selection, _ = plain_selection(records_of(damper_of(TWO), rng), DiagnoseConfig())
    whole, effect = selection.initial_evidence.whole, library()["second_branch"]
    assert whole.with_friction_scaling(library()["gas_spring"]) is whole
    wider = whole.with_friction_scaling(effect)
    for start in starts_of(wider, selection.baseline, effect):
        point = wider.point(np.concatenate([selection.baseline.optimum, start]), wider.unknowns(("second_branch",)))
        values = point.effects["second_branch"]
        share = whole.base[0].T0_N / whole.base[1].T0_N
        for name in ("T0_2", "k_2"):
            soft, hard = values[name]
            assert soft / hard == pytest.approx(share, rel=1e-9)


def test_nothing_is_added_to_a_damper_that_lacks_nothing(rng: np.random.Generator) -> None:
    found, _ = extended(records_of(damper_of(TWO), rng), DiagnoseConfig())
    assert found.added == ()


@pytest.mark.ci
def test_no_more_is_added_than_the_config_allows_nor_what_it_forbids(rng: np.random.Generator) -> None:
    truth = damper_of(TWO, preload_offset={"F_0": 150.0}, gas_spring={"k_g": 8000.0})
    records = records_of(truth, rng)
    for most in (0, 1):
        found, _ = extended(records, DiagnoseConfig(most_added=most, forbid=all_but("preload_offset", "gas_spring")))
        assert len(found.added) == most
    found, _ = extended(records, DiagnoseConfig(forbid=all_but("gas_spring")))
    assert {name.partition(" ")[0] for name in found.added} == {"gas_spring"}


def test_what_was_added_takes_the_place_of_what_stood_in_for_it(rng: np.random.Generator) -> None:
    """A spring and an offset are the polytropic gas to first order; beside it they may have any value."""
    truth = damper_of(TWO, accumulator={"F_g": 300.0, "L": 0.08})
    records = records_of(truth, rng)
    forbid = all_but("preload_offset", "gas_spring", "accumulator")
    config = DiagnoseConfig(forbid=forbid)
    selection, validation = plain_selection(records, config)
    whole = selection.initial_evidence.whole
    stood_in = damper_of(TWO, preload_offset={"F_0": -250.0}, gas_spring={"k_g": 6000.0})
    fitted = fit(whole, ("preload_offset", "gas_spring"), whole.start_with(stood_in))
    adopted = replace(selection, fitted=fitted, reasons=dict.fromkeys(fitted.effects, "adopted"))
    missed = validation.error_by_criterion(fitted.damper)
    between = validation.interpolation_error(fitted.damper, by_criterion=True)
    found = add_predictive_effects(Adoption(adopted, missed, missed, between), validation, config)
    assert found.added == ("accumulator",)
    values = found.selection.fitted.damper.effects
    assert set(values) == {"accumulator"}
    assert values["accumulator"]["F_g"] == pytest.approx(300.0, rel=0.05)
    assert values["accumulator"]["L"] == pytest.approx(0.08, rel=0.05)
    assert found.selection.reasons["gas_spring"] == found.selection.reasons["preload_offset"] == REPLACED
    assert found.error.criterion is not None
    assert found.error.criterion < 0.5 * (missed.criterion or 0.0)
    forced = config.model_copy(update={"force": ("preload_offset", "gas_spring")})
    asked = add_predictive_effects(Adoption(adopted, missed, missed, between), validation, forced)
    assert {"preload_offset", "gas_spring"} <= set(asked.selection.fitted.damper.effects)


@pytest.mark.ci
def test_what_only_a_sensor_shows_is_not_added(rng: np.random.Generator) -> None:
    found, _ = extended(records_of(damper_of(TWO, sensor_delay={"tau": 0.004}), rng), DiagnoseConfig())
    assert "sensor_delay" not in found.added


@pytest.mark.parametrize(("offsets", "added"), [((0.0, 150.0, 450.0), True), ((0.0, -100.0, 450.0), False)])
def test_what_is_worse_between_the_voltages_is_not_added(
    offsets: tuple[float, ...], added: bool, rng: np.random.Generator
) -> None:
    """An offset in proportion to the voltage is known between two voltages; of one that bends, the mean misses less.

    At a third of the way from 0 to 450 N the line says 150 N; the mean of both ends is nearer to -100 N.
    """
    three = (0.0, 50.0, 150.0)
    by_voltage_V: dict[str, float | tuple[float, ...]] = {"F_0": offsets, "at_voltage_V": three}
    truth = damper_of(three).model_copy(update={"effects": {"preload_offset": by_voltage_V}})
    records = sines(truth, rng, three, tests=TESTS, cycles=3, noise=2e-3)
    campaign = campaign_of(records)
    evidence = evidence_of(campaign, damper_of(three, preload_offset={"F_0": 10.0}))
    plain = fit(evidence.whole, (), evidence.whole.start())
    fitted = fit(
        evidence.whole,
        ("preload_offset",),
        evidence.whole.start_with(truth.with_effect("preload_offset", {"F_0": 10.0})),
    )
    config = DiagnoseConfig(most_added=0)
    validation = cross_validation_of(campaign, plain.damper, config.visible)
    selection = Selection(plain, fitted, (), {"preload_offset": "adopted"}, evidence, evidence)
    missed = validation.error_by_criterion(fitted.damper)
    between = validation.interpolation_error(fitted.damper, by_criterion=True)
    found = add_predictive_effects(Adoption(selection, missed, missed, between), validation, config)
    assert (found.added == ("preload_offset by voltage",)) == added


# ---------------------------------------------------------------- nothing impossible


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("gas_spring", {"k_g": -1488.0}),
        ("fluid_inertia", {"m": -3.0}),
        ("sensor_delay", {"tau": -0.05}),
        ("relief_valve", {"F_r": 900.0, "C_r": 4000.0}),
    ],
)
def test_values_that_nature_does_not_have_are_found(effect: str, values: dict[str, float]) -> None:
    assert against_nature(damper_of(TWO, **{effect: values})) == (effect,)
    possible = {name: abs(value) / 10.0 for name, value in values.items()}
    assert against_nature(damper_of(TWO, **{effect: possible})) == ()


def test_one_impossible_value_among_those_by_voltage_is_enough() -> None:
    damper = damper_of(TWO)
    values: dict[str, float | tuple[float, ...]] = {"k_g": (500.0, -20.0), "at_voltage_V": TWO}
    assert against_nature(damper.model_copy(update={"effects": {"gas_spring": values}})) == ("gas_spring",)


def test_an_effect_that_fits_with_an_impossible_value_alone_is_not_handed_on(rng: np.random.Generator) -> None:
    truth = damper_of(TWO, gas_spring={"k_g": -6000.0})
    selection, validation = plain_selection(records_of(truth, rng), DiagnoseConfig())
    whole = selection.initial_evidence.whole
    spring = fit(whole, ("gas_spring",), whole.start_with(truth))
    assert spring.misfit < 0.1 * selection.baseline.misfit
    found = adopt_effects(replace(selection, fitted=spring, reasons={"gas_spring": "adopted"}), validation, (), "V")
    assert found.selection.adopted == ()
    assert found.rejection is not None
    said = re.match(r"gas_spring with k_g = (\S+) N/m ", found.rejection)
    assert said, found.rejection
    assert float(said[1]) == pytest.approx(-6000.0, rel=0.02)
    assert "in nature" in found.selection.reasons["gas_spring"]


def test_lengths_and_masses_are_one_value_at_every_voltage(rng: np.random.Generator) -> None:
    truth = damper_of(TWO, end_stop={"k_e": 2e7, "x_e": 0.02}, preload_offset={"F_0": 100.0})
    selection, _ = plain_selection(records_of(truth, rng), DiagnoseConfig())
    whole = selection.initial_evidence.whole
    fitted = fit(whole, ("end_stop", "preload_offset"), whole.start_with(truth))
    assert [c.effect for c in per_voltage_candidates(whole, fitted)] == ["preload_offset"]
    assert {name for name, effect in library().items() if effect.same_at_every_voltage} == {
        "accumulator",
        "end_stop",
        "fluid_inertia",
    }
