"""Misfit of the Bingham element, told from noise and from the sensors of a test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from campaigns import ROWS, campaign
from fresh_truths import sine_test, with_noise

from pzd.artefacts import ParameterRow
from pzd.identification.bingham_fit import Objective, fit_separable
from pzd.identification.condition import identify_condition
from pzd.identification.config import IdentifyConfig
from pzd.identification.prepared_record import fitted_records, prepare
from pzd.identification.trust import Misfit, misfit_of
from pzd.record import Condition, Record

QUICKSTART = ((1.0, 0.01), (1.0, 0.03), (2.0, 0.01), (2.0, 0.03))
ORIFICE = 2500.0


def sines(*, hidden: float, noise: float, rng: np.random.Generator) -> list[Record]:
    """The sines of configs/quickstart.yaml at 0 V, with so much of a quadratic orifice [N s2/m2] beside the element."""
    records = [sine_test(ROWS[0], f, x, cycles=6, rate=500, name=f"{f}-{x}") for f, x in QUICKSTART]
    return [
        with_noise(replace(r, force=r.force + hidden * r.velocity * np.abs(r.velocity)), rng, noise, 0.5)
        for r in records
    ]


def row_for(records: list[Record]) -> ParameterRow:
    return identify_condition(Condition(None, 0.0, None, tuple(records)), IdentifyConfig(), seed=1)[0]


def misfit_for(records: tuple[Record, ...]) -> Misfit:
    """Misfit of the element alone, without auxiliary forces."""
    objective = Objective(tuple(prepare(record) for record in records))
    fit = fit_separable(objective)
    by_record = objective.fitted_by_record(fit.parameters)
    fitted = fitted_records(records, objective.prepared, by_record, IdentifyConfig().nuisance)
    return misfit_of(fitted)


def test_a_hidden_orifice_makes_the_parameters_the_model_s_and_not_the_damper_s(rng: np.random.Generator) -> None:
    row = row_for(sines(hidden=ORIFICE, noise=0.005, rng=rng))
    assert row.C_Ns_per_m > 1.2 * ROWS[0].damping
    assert row.status.startswith("weak: T0, C, k (the model misses ")
    assert row.status.endswith("of peak: the parameters are the model's, not the damper's)")


def test_without_a_hidden_effect_the_parameters_are_the_damper_s(rng: np.random.Generator) -> None:
    assert row_for(sines(hidden=0.0, noise=0.005, rng=rng)).status == "ok"
    assert misfit_for(tuple(sines(hidden=0.0, noise=0.005, rng=rng))).share == 0.0


def test_gain_offset_and_delay_within_their_priors_are_no_misfit(rng: np.random.Generator) -> None:
    spoken = [misfit_for(campaign(draw, "five tests", correlation=0.9)[1]).is_large for draw in rng.spawn(5)]
    assert not any(spoken)


def test_noise_alone_is_seldom_a_misfit(rng: np.random.Generator) -> None:
    draws = [campaign(draw, "two sines", correlation=0.9, noise=0.05)[1] for draw in rng.spawn(20)]
    assert sum(misfit_for(records).share > 0.0 for records in draws) <= 1


def test_a_misfit_within_the_class_of_the_load_cell_leaves_the_status_ok(rng: np.random.Generator) -> None:
    small = misfit_for(tuple(sines(hidden=0.1 * ORIFICE, noise=0.0005, rng=rng)))
    assert 0.0 < small.share < 0.0025
    assert not small.is_large
    assert row_for(sines(hidden=0.1 * ORIFICE, noise=0.0005, rng=rng)).status == "ok"


@pytest.mark.parametrize("kind", ["one sine", "one random"])
def test_a_hidden_effect_is_found_whether_the_motion_repeats_or_not(kind, rng: np.random.Generator) -> None:
    speaks = [misfit_for(campaign(draw, kind, hidden=0.2)[1]).is_large for draw in rng.spawn(8)]
    assert sum(speaks) >= 7


def test_a_motion_that_does_not_repeat_shows_no_misfit_by_itself(rng: np.random.Generator) -> None:
    speaks = [misfit_for(campaign(draw, "one random", correlation=0.9)[1]).is_large for draw in rng.spawn(10)]
    assert not any(speaks)
