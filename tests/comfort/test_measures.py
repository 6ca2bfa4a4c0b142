"""Measures of closed form: a sine, a burst, a change of length, of size, of sampling."""

from __future__ import annotations

import numpy as np
import pytest

from pzd.comfort.iso2631_1997 import evaluate, maximum_transient, reactions, vibration_dose
from pzd.signals.measures import rms

RATE = 1000.0
TIME = np.arange(16000) / RATE
SINE = 0.8 * np.sin(2.0 * np.pi * 2.25 * TIME)


def test_rms_and_crest_factor_of_a_sine() -> None:
    assert rms(SINE) == pytest.approx(0.8 / np.sqrt(2.0), rel=1e-9)
    assert evaluate(SINE, RATE).peak == pytest.approx(0.8, rel=1e-5)
    assert evaluate(SINE, RATE).crest == pytest.approx(np.sqrt(2.0), rel=1e-5)


def test_dose_of_a_sine() -> None:
    assert vibration_dose(SINE, RATE) == pytest.approx(0.8 * (3.0 * 16.0 / 8.0) ** 0.25, rel=1e-9)


def test_dose_grows_with_the_fourth_root_of_time() -> None:
    twice = np.concatenate([SINE, SINE])
    assert vibration_dose(twice, RATE) == pytest.approx(2.0**0.25 * vibration_dose(SINE, RATE), rel=1e-9)


def test_transient_value_of_a_steady_tone_is_its_rms() -> None:
    tone = np.sin(2.0 * np.pi * 4.0 * TIME)
    assert maximum_transient(tone, RATE) == pytest.approx(1.0 / np.sqrt(2.0), rel=1e-9)


def test_transient_value_of_a_burst_shorter_than_a_second() -> None:
    burst = np.zeros_like(TIME)
    burst[5000:5250] = 2.0
    assert maximum_transient(burst, RATE) == pytest.approx(2.0 * np.sqrt(0.25), rel=1e-9)
    assert maximum_transient(burst[5000:5100], RATE) == pytest.approx(2.0, rel=1e-9)


def test_a_shock_exceeds_the_limits_of_the_rms_and_a_tone_does_not() -> None:
    shock = 0.01 * np.sin(2.0 * np.pi * 5.0 * TIME)
    shock[8000:8020] = 3.0
    assert len(evaluate(shock, RATE).beyond) == 3
    assert evaluate(SINE, RATE).beyond == ()


def test_the_dose_ratio_of_a_sine_is_independent_of_time() -> None:
    expected = np.sqrt(2.0) * (3.0 / 8.0) ** 0.25
    assert evaluate(SINE, RATE).vdv_ratio == pytest.approx(expected, rel=1e-9)
    assert evaluate(SINE[: round(8.0 * RATE)], RATE).vdv_ratio == pytest.approx(expected, rel=1e-9)


def test_a_vehicle_at_rest_has_ratios_of_zero() -> None:
    found = evaluate(np.zeros(1000), RATE)
    assert (found.a_w, found.crest, found.mtvv_ratio, found.vdv_ratio) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("a_w", "texts"),
    [
        (0.2, ["not uncomfortable"]),
        (0.4, ["a little uncomfortable"]),
        (0.55, ["a little uncomfortable", "fairly uncomfortable"]),
        (0.9, ["fairly uncomfortable", "uncomfortable"]),
        (1.3, ["uncomfortable", "very uncomfortable"]),
        (2.2, ["very uncomfortable", "extremely uncomfortable"]),
        (3.0, ["extremely uncomfortable"]),
    ],
)
def test_the_ranges_of_the_reactions_overlap_as_the_standard_has_them(a_w: float, texts: list[str]) -> None:
    assert [reaction.text for reaction in reactions(a_w)] == texts


def test_every_level_has_a_reaction_and_the_recalled_ones_say_so() -> None:
    assert all(reactions(float(level)) for level in np.linspace(0.0, 5.0, 501))
    assert {r.trust for r in reactions(3.0)} == {"recalled, not verified"}
