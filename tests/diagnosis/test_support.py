"""Support of each adopted effect by held-out tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import TWO, campaign_of, damper_of, sines

from pzd.diagnosis.adoption import ADDED, Adoption
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.cross_validation import CrossValidation, cross_validation_of
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.search.acceptance import Selection
from pzd.diagnosis.support import support_of

TESTS = ((0.5, 0.03), (1.0, 0.02), (2.0, 0.03))
TRUE = {"preload_offset": {"F_0": 150.0}, "gas_spring": {"k_g": 8000.0}}
"""Two forces parallel to the element, apart in every test: F_0^2 : (k_g X)^2 / 2."""


@pytest.fixture
def validation(rng: np.random.Generator) -> CrossValidation:
    records = sines(damper_of(TWO, **TRUE), rng, TWO, tests=TESTS, cycles=3, noise=2e-3)
    return cross_validation_of(campaign_of(records), damper_of(TWO), DiagnoseConfig().visible)


def adoption_of(validation: CrossValidation, **effects: dict[str, float]) -> Adoption:
    evidence = evidence_of(validation.campaign, damper_of(TWO, **effects))
    plain = fit(evidence.whole, (), evidence.whole.start())
    fitted = fit(evidence.whole, tuple(effects), evidence.whole.start_with(damper_of(TWO, **effects)))
    error = validation.baseline_error()
    return Adoption(Selection(plain, fitted, (), {}, evidence, evidence), error, error, error)


def test_true_effects_are_certain_and_their_shares_are_those_of_their_squares(validation: CrossValidation) -> None:
    """The spring and the offset share no part of a sine, and beside the element, which takes up some of the spring."""
    found = support_of(adoption_of(validation, **TRUE), validation)
    assert list(found) == list(TRUE)
    assert all(each.sure == "certain" and each.folds_better == each.folds for each in found.values())
    assert sum(each.share for each in found.values()) == pytest.approx(1.0, abs=0.05)
    assert found["preload_offset"].share > found["gas_spring"].share


def test_an_effect_that_is_not_there_is_open(validation: CrossValidation) -> None:
    found = support_of(adoption_of(validation, **TRUE, fluid_inertia={"m": 0.1}), validation)
    assert found["fluid_inertia"].sure == "open"
    assert found["fluid_inertia"].share < 0.01
    assert found["gas_spring"].sure == "certain"


def test_what_looks_alike_by_its_values_is_open_however_much_is_lost_without_it(validation: CrossValidation) -> None:
    """`certain` stood in the headline of an effect of which the reason said that it is something else."""
    found = support_of(adoption_of(validation, **TRUE), validation, alike=("gas_spring",))
    assert found["gas_spring"].sure == "open"
    assert found["preload_offset"].sure == "certain"


def test_what_another_could_replace_is_half_as_sure(validation: CrossValidation) -> None:
    adoption = adoption_of(validation, **TRUE)
    shared = Adoption(**{**vars(adoption), "alternatives": {"gas_spring": "accumulator"}})
    found = support_of(shared, validation)
    assert found["gas_spring"].replaced_by == "accumulator"
    assert found["gas_spring"].confidence == pytest.approx(0.5, abs=0.01)
    assert found["gas_spring"].sure == "open"


def test_what_was_added_for_its_prediction_alone_is_known_as_such(validation: CrossValidation) -> None:
    """The tests show that the spring is needed, and not that it is one: what looks alike may predict as well."""
    adoption = adoption_of(validation, **TRUE)
    adoption = replace(adoption, selection=replace(adoption.selection, reasons={"gas_spring": ADDED}))
    found = support_of(adoption, validation)
    assert found["gas_spring"].added
    assert found["gas_spring"].sure == "open"
    assert (
        found["gas_spring"].confidence
        == support_of(adoption_of(validation, **TRUE), validation)["gas_spring"].confidence
    )
    assert not found["preload_offset"].added
    assert found["preload_offset"].sure == "certain"


def test_without_an_effect_there_is_nothing_to_support(validation: CrossValidation) -> None:
    assert support_of(adoption_of(validation), validation) == {}


def test_a_share_is_of_the_refits_where_the_first_order_is_far_from_them(validation: CrossValidation) -> None:
    """Of a gas that was all of the gap 0.02 % came back: a fold was linearised where a plain damper misses all."""
    adoption = adoption_of(validation, **TRUE)
    smaller = replace(adoption.baseline_error, error=adoption.baseline_error.error / 100.0)
    shares = support_of(replace(adoption, baseline_error=smaller), validation)
    assert shares["preload_offset"].share == 1.0
