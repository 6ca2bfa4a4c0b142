"""Hum of the mains in step with a motion: no cycle tells it from the damper, the tests of the stand together do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import campaign_of, damper_of, sine

from pzd.diagnosis.campaign import Campaign, evidence_of
from pzd.diagnosis.gap import probability_of_noise
from pzd.diagnosis.mains import with_hum
from pzd.record import Record

HUM = 12.0
"""Amplitude [N]: 0.9 % of the peak of the slow test, 0.5 % of that of the quick ones."""
TRUE = damper_of((0.0,))


def sines_in_step(rng: np.random.Generator, amplitude: float) -> list[Record]:
    """Sines of 1, 5 and 7.5 Hz: 60 Hz are sixty, twelve and eight times as much."""
    records = [
        sine(TRUE, 0.0, frequency, speed / (2.0 * np.pi * frequency), rng, noise=0.003, colour=0.5, cycles=6)
        for frequency, speed in ((1.0, 0.4), (5.0, 0.8), (7.5, 0.8))
    ]
    phases = rng.uniform(0.0, 2.0 * np.pi, len(records))
    return [
        replace(r, force=r.force + amplitude * np.sin(2.0 * np.pi * 60.01 * r.time + phase))
        for r, phase in zip(records, phases, strict=True)
    ]


def allowing_for_hum(campaign: Campaign) -> Campaign:
    return replace(campaign, cleaned=with_hum(campaign.cleaned, TRUE), _predictions={}, _checks={})


def test_the_true_damper_leaves_no_more_than_noise_of_sines_in_step_with_the_mains(rng: np.random.Generator) -> None:
    campaign = campaign_of(sines_in_step(rng, HUM))
    assert probability_of_noise(campaign.checks(TRUE)) < 1e-6  # each by itself: the hum of the quickest is a gap
    assert probability_of_noise(allowing_for_hum(campaign).checks(TRUE)) > 1e-3


def test_the_likelihood_gives_no_weight_to_a_harmonic_that_hums(rng: np.random.Generator) -> None:
    campaign = campaign_of(sines_in_step(rng, HUM))
    quickest = [evidence_of(each, TRUE).whole.observations[-1] for each in (campaign, allowing_for_hum(campaign))]
    weights = [each.weights for each in quickest]
    share = (weights[1] / weights[0]) ** 2
    assert share[8] < 0.05
    assert np.delete(share, [8, 24]) == pytest.approx(1.0)


def test_tests_without_hum_are_weighed_as_they_were(rng: np.random.Generator) -> None:
    campaign = campaign_of(sines_in_step(rng, 0.0))
    assert all(np.all(each.hum_variance == 0.0) for each in with_hum(campaign.cleaned, TRUE))
