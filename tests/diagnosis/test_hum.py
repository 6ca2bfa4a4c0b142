"""Mains hum in the force is no gap of the damper's, and hides none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from campaign import damper_of, sines
from whole_diagnosis import all_but, diagnosed

from pzd.damper.model import Damper
from pzd.record import Record

TWO = (0.0, 150.0)


def humming(damper: Damper, rng: np.random.Generator) -> tuple[Record, ...]:
    """Sines of two frequencies with hum of 2 % of the softest test's peak, near a harmonic of the motion."""
    records = sines(damper, rng, TWO, jitter=0.005, cycles=8)
    amplitude = 0.02 * min(float(np.max(np.abs(record.force))) for record in records)
    waves = [amplitude * np.sin(2.0 * np.pi * 60.007 * record.time + rng.uniform(0.0, 6.0)) for record in records]
    return tuple(replace(r, force=r.force + wave) for r, wave in zip(records, waves, strict=True))


def test_hum_alone_is_no_gap_and_is_told(rng: np.random.Generator) -> None:
    found = diagnosed(humming(damper_of(TWO), rng), forbid=all_but("preload_offset", "orifice_quadratic")).diagnosis
    assert found.verdict == "none"
    assert "mains hum of up to" in found.reason
    assert "is taken for no gap" in found.reason


@pytest.mark.ci
def test_an_effect_is_named_through_the_hum(rng: np.random.Generator) -> None:
    found = diagnosed(humming(damper_of(TWO, orifice_quadratic={"q": 4000.0}), rng)).diagnosis
    assert (found.verdict, found.effects) == ("named", ("orifice_quadratic",))
    q = found.parameters["orifice_quadratic"]["q"].value
    assert q == pytest.approx(4000.0, rel=0.05)


@pytest.mark.ci
def test_without_hum_nothing_is_said_of_it(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO), rng, TWO, jitter=0.005, cycles=8)
    assert "hum" not in diagnosed(records, forbid=all_but("preload_offset")).diagnosis.reason
