"""What is known of a damper is not computed again, and what is remembered stays as it was."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from campaign import damper_of, sines

from pzd.diagnosis.campaign import Campaign
from pzd.diagnosis.data import HELD_OUT, prepare, split
from pzd.signals.nuisance import NuisanceConfig

TWO = (0.0, 150.0)
PLAIN = damper_of(TWO)


@pytest.fixture
def asked(rng: np.random.Generator) -> Callable[[int], Campaign]:
    """The same campaign, so many records at the same time."""
    prepared = prepare(sines(PLAIN, rng, TWO))

    def made(jobs: int) -> Campaign:
        return Campaign(prepared, split(prepared, None, 2.0), NuisanceConfig(), jobs)

    return made


def test_a_damper_is_judged_once(asked: Callable[[int], Campaign]) -> None:
    campaign = asked(1)
    assert campaign.checks(PLAIN) is campaign.checks(damper_of(TWO))
    assert campaign.checks(PLAIN) is not campaign.checks(damper_of(TWO, gas_spring={"k_g": 100.0}))


def test_naming_sees_all_but_the_untouched_samples(asked: Callable[[int], Campaign]) -> None:
    campaign = asked(1)
    seen = {j.prepared.record.name: j.wanted for j in campaign.checks(PLAIN)}
    held_out = {j.prepared.record.name: j.wanted for j in campaign.held_out_checks(PLAIN)}
    assert held_out
    for prepared, roles in zip(campaign.prepared, campaign.split.roles, strict=True):
        nothing = np.zeros(roles.size, dtype=np.bool_)
        assert not np.any(seen.get(prepared.record.name, nothing) & (roles == HELD_OUT))
        assert not np.any(held_out.get(prepared.record.name, nothing) & (roles != HELD_OUT))


def test_records_judged_at_the_same_time_are_judged_the_same(asked: Callable[[int], Campaign]) -> None:
    for one, other in zip(asked(1).checks(PLAIN), asked(2).checks(PLAIN), strict=True):
        np.testing.assert_array_equal(one.residual, other.residual)
