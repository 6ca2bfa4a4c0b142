"""Where T0, C and k bend over the voltage, the line between two voltages misses: the next test is asked for there."""

from __future__ import annotations

import numpy as np
import pytest
from campaign import damper_of, sines
from test_kept_back import campaign_of

from pzd.artefacts import NextTest
from pzd.damper.model import Damper
from pzd.diagnosis.cross_validation import cross_validation_of
from pzd.diagnosis.next_test import intermediate_voltage_test, operating_envelope
from pzd.rig.config import Limits

THREE = (0.0, 50.0, 150.0)
TESTS = ((0.5, 0.02), (2.0, 0.03))
LIMITS = Limits()


def with_friction_at_50(T0: float) -> Damper:
    """T0 is 301 N at 0 V and 1325 N at 150 V; C and k are on the line between both."""
    low, middle, high = damper_of(THREE).base
    on_line = {
        name: (2.0 * getattr(low, name) + getattr(high, name)) / 3.0 for name in ("C_Ns_per_m", "k_N_per_m", "T0_N")
    }
    rows = (low, middle.model_copy(update={**on_line, "T0_N": T0}), high)
    return Damper(base=rows)


ON_THE_LINE = (2.0 * 301.0 + 1325.0) / 3.0


def asked(damper: Damper, rng: np.random.Generator, limits: Limits = LIMITS) -> NextTest | None:
    records = sines(damper, rng, [row.voltage_V or 0.0 for row in damper.base], tests=TESTS, cycles=4)
    campaign = campaign_of(records)
    validation = cross_validation_of(campaign, damper, 0.0025)
    errors = validation.baseline_error(), validation.baseline_interpolation_error
    envelope = operating_envelope(limits, campaign.prepared, [row.voltage_V or 0.0 for row in damper.base])
    return intermediate_voltage_test(damper, 0.0, errors, validation, campaign.prepared, envelope, None)


@pytest.mark.parametrize("T0", [0.6 * ON_THE_LINE, 1.5 * ON_THE_LINE])
def test_a_test_is_asked_for_half_way_along_the_wider_step(T0: float, rng: np.random.Generator) -> None:
    found = asked(with_friction_at_50(T0), rng)
    assert found is not None
    assert found.between_voltage_V == (50.0, 150.0)
    assert found.voltage_V == 100.0
    assert any((found.frequency_Hz, found.amplitude_m) == pytest.approx(test, rel=0.01) for test in TESTS)
    assert found.separates == ()


def test_where_the_parameters_are_on_the_line_nothing_is_asked_for(rng: np.random.Generator) -> None:
    assert asked(with_friction_at_50(ON_THE_LINE), rng) is None


def test_without_a_voltage_between_two_others_nothing_is_asked_for(rng: np.random.Generator) -> None:
    assert asked(damper_of((0.0, 150.0)), rng) is None


@pytest.mark.parametrize(
    "limits", [Limits(voltage_V=(0.0, 90.0)), Limits(force_N=500.0)], ids=["the voltage", "the force"]
)
def test_a_test_beyond_the_limits_of_the_stand_is_not_asked_for(limits: Limits, rng: np.random.Generator) -> None:
    assert asked(with_friction_at_50(1.5 * ON_THE_LINE), rng, limits) is None


def test_stroke_and_speed_stay_within_the_limits_of_the_stand(rng: np.random.Generator) -> None:
    found = asked(with_friction_at_50(1.5 * ON_THE_LINE), rng, Limits(stroke_m=0.02, speed_m_per_s=0.05))
    assert found is not None
    assert found.amplitude_m == pytest.approx(0.01)
    assert found.peak_speed_m_per_s is not None
    assert found.peak_speed_m_per_s <= 0.05
