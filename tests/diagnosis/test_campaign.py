"""A campaign simulates each damper once; a search that exceeds its budget ends at the same place every time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from synthetic import TWO, damper_of, diagnosed, sines

from pzd.diagnosis.campaign import Campaign
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.roles import HELD_OUT, split
from pzd.record import Record
from pzd.signals.nuisance import NuisanceConfig

PLAIN = damper_of(TWO)


@pytest.fixture
def asked(rng: np.random.Generator) -> Callable[[int], Campaign]:
    """The same campaign, so many records at the same time."""
    cleaned = clean(sines(PLAIN, rng, TWO, cycles=4))

    def made(jobs: int) -> Campaign:
        return Campaign(cleaned, split(cleaned, None, 2.0), NuisanceConfig(), jobs)

    return made


def test_a_damper_is_checked_once(asked: Callable[[int], Campaign]) -> None:
    campaign = asked(1)
    assert campaign.checks(PLAIN) is campaign.checks(damper_of(TWO))
    assert campaign.checks(PLAIN) is not campaign.checks(damper_of(TWO, gas_spring={"k_g": 100.0}))


def test_the_search_sees_all_but_the_held_out_samples(asked: Callable[[int], Campaign]) -> None:
    campaign = asked(1)
    seen = {j.cleaned.record.name: j.wanted for j in campaign.checks(PLAIN)}
    held_out = {j.cleaned.record.name: j.wanted for j in campaign.held_out_checks(PLAIN)}
    assert held_out
    for cleaned, roles in zip(campaign.cleaned, campaign.split.roles, strict=True):
        nothing = np.zeros(roles.size, dtype=np.bool_)
        assert not np.any(seen.get(cleaned.record.name, nothing) & (roles == HELD_OUT))
        assert not np.any(held_out.get(cleaned.record.name, nothing) & (roles != HELD_OUT))


def test_parallel_checks_equal_serial_ones(asked: Callable[[int], Campaign]) -> None:
    for one, other in zip(asked(1).checks(PLAIN), asked(2).checks(PLAIN), strict=True):
        np.testing.assert_array_equal(one.residual, other.residual)


# --- Budget of simulations


TRUTH = damper_of(TWO, preload_offset={"F_0": 150.0}, gas_spring={"k_g": 8000.0})


@pytest.fixture
def records(rng: np.random.Generator) -> tuple[Record, ...]:
    return sines(TRUTH, rng, TWO, tests=((0.5, 0.03), (2.0, 0.03)), cycles=3, noise=2e-3)


def test_a_search_without_a_budget_adopts_nothing_and_reports_it(records: tuple[Record, ...]) -> None:
    found = diagnosed(records, most_evaluations=1).diagnosis
    assert found.verdict == "unexplained"
    assert found.effects == ()
    assert "ended by diagnose.most_evaluations (1 forces)" in found.reason


@pytest.mark.ci
def test_effects_adopted_within_the_budget_do_not_depend_on_the_number_of_threads(records: tuple[Record, ...]) -> None:
    """One round fits in: of the two effects that are missing one is adopted."""
    samples = sum(record.time.size for record in records)
    one, two = (diagnosed(records, jobs, most_evaluations=100 * samples).diagnosis for jobs in (1, 2))
    assert one == two
    assert len(one.effects) == 1
    assert "most_evaluations" in one.reason


@pytest.mark.ci
def test_a_search_within_its_budget_reports_none(records: tuple[Record, ...]) -> None:
    found = diagnosed(records).diagnosis
    assert {*found.effects} == {"preload_offset", "gas_spring"}
    assert "most_evaluations" not in found.reason
