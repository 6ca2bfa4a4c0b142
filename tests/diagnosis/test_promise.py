"""What a linearised step promises decides which effects are searched for: none that would pay is left out."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines

from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.config import DiagnoseConfig
from pzd.diagnosis.data import prepare, split
from pzd.diagnosis.fit.least_squares import fit
from pzd.diagnosis.search import candidates as searching
from pzd.signals.nuisance import NuisanceConfig

TWO = (0.0, 150.0)
HIDDEN = {
    "relief_valve": {"F_r": 700.0, "C_r": 900.0},
    "orifice_quadratic": {"q": 6000.0},
    "lash": {"delta": 4e-4},
    "sensor_delay": {"tau": 2e-3},
}
OTHERS = (*list(HIDDEN)[1:], None)


@pytest.mark.parametrize("hidden", ["relief_valve", *(pytest.param(name, marks=pytest.mark.ci) for name in OTHERS)])
def test_an_effect_that_is_not_searched_for_would_not_pay(
    hidden: str | None, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    effects = {} if hidden is None else {hidden: HIDDEN[hidden]}
    prepared = prepare(sines(damper_of(TWO, **effects), rng, TWO, cycles=3))
    whole = evidence_of(Campaign(prepared, split(prepared, None, 2.0), NuisanceConfig()), damper_of(TWO)).whole
    before = fit(whole, (), whole.start())
    screened = {c.effect: c for c in searching.candidates(whole, before)}
    monkeypatch.setattr(searching, "SLIGHT_PROMISE", -np.inf)
    monkeypatch.setattr(searching, "WORTH_FITTING", -np.inf)
    all_searched = searching.candidates(whole, before)
    assert all(c.searched for c in all_searched)
    left_out = [c for c in all_searched if not screened[c.effect].searched]
    assert left_out
    assert min(c.delta_bic for c in left_out) > DiagnoseConfig().adopt_bic
    if hidden is not None:
        assert all_searched[0].effect == hidden
        assert screened[hidden].delta_bic == pytest.approx(all_searched[0].delta_bic, rel=1e-6)
