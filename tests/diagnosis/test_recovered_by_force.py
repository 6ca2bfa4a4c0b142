"""What no verdict names yet is found again with its values where the config forces it, on noisy virtual rigs."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines
from test_kept_back import campaign_of

from pzd.damper.effect import Scales
from pzd.damper.effects import library, nameable
from pzd.damper.model import against_nature
from pzd.diagnosis.campaign import evidence_of
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.search.candidates import candidate, resumed

VOLTAGES = (0.0, 150.0)
TESTS = ((0.5, 0.005), (0.5, 0.03), (2.0, 0.01), (2.0, 0.03))
RIG = Scales(2500.0, 1300.0, 0.38, 0.03, 4.7, 2640.0, 150.0)
"""Of the plain damper on these tests, rounded."""
WITHIN = {"accumulator": 0.1, "bouc_wen": 0.15, "cavitation": 0.15, "frame_compliance": 0.15}
"""How near a fit on half a per cent of noise comes to every value, as a share of it."""


def test_all_that_can_be_hidden_and_is_not_named_is_tried() -> None:
    unnamed = {name for name in library().keys() - nameable().keys() if library()[name].hidden is not None}
    assert unnamed == WITHIN.keys()


@pytest.mark.parametrize("name", WITHIN)
def test_its_values_are_found_again(name: str, rng: np.random.Generator) -> None:
    effect = library()[name]
    assert effect.hidden is not None
    values = effect.hidden(rng, RIG)(0.4)
    truth = damper_of(VOLTAGES, **{name: values})
    assert against_nature(truth) == ()
    records = sines(truth, rng, VOLTAGES, tests=TESTS, cycles=3, noise=5e-3)
    evidence = evidence_of(campaign_of(records), damper_of(VOLTAGES))
    plain = fit(evidence.whole, (), evidence.whole.start())
    found = resumed(evidence.whole, plain, candidate(evidence.whole, plain, effect))
    assert found.fitted.misfit < 0.5 * plain.misfit
    fitted = found.fitted.damper.effects[name]
    for parameter, value in values.items():
        assert fitted[parameter] == pytest.approx(value, rel=WITHIN[name]), (parameter, values, fitted)
