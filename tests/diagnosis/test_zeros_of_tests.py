"""A load cell whose zero differs from test to test names nothing of the damper, and hides nothing of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import TWO, all_but, damper_of, diagnosed, sines

from pzd.record import Record

TESTS = ((0.5, 0.02), (2.0, 0.02), (2.0, 0.01), (3.0, 0.02))
ONLY = {"forbid": all_but("preload_offset", "fluid_inertia", "gas_spring", "asymmetry")}


def with_zeros(records: tuple[Record, ...], share: float, rng: np.random.Generator) -> list[Record]:
    """Each test with a zero of its own, of that standard deviation as a share of its peak."""
    return [replace(r, force=r.force + share * float(np.max(np.abs(r.force))) * rng.standard_normal()) for r in records]


def test_zeros_that_differ_from_test_to_test_are_told_and_name_nothing(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO), rng, TWO, tests=TESTS, noise=2e-3, cycles=6)
    found = diagnosed(with_zeros(records, 0.02, rng), **ONLY)
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("none", ()), found.diagnosis.reason
    assert "the zero of the load cell differs from test to test, by " in found.diagnosis.reason


def test_an_effect_is_named_beside_zeros_that_differ(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO, fluid_inertia={"m": 12.0}), rng, TWO, tests=TESTS, noise=2e-3, cycles=6)
    found = diagnosed(with_zeros(records, 0.02, rng), **ONLY)
    assert (found.diagnosis.verdict, found.diagnosis.effects) == ("named", ("fluid_inertia",)), found.diagnosis.reason
    assert "the zero of the load cell differs from test to test, by " in found.diagnosis.reason
    assert found.damper.effects["fluid_inertia"]["m"] == pytest.approx(12.0, rel=0.05)


def test_a_stand_without_them_is_told_of_none(rng: np.random.Generator) -> None:
    records = sines(damper_of(TWO, fluid_inertia={"m": 12.0}), rng, TWO, tests=TESTS, noise=2e-3, cycles=6)
    told = diagnosed(records, **ONLY).diagnosis
    assert (told.verdict, told.effects) == ("named", ("fluid_inertia",)), told.reason
    assert "zero of the load cell" not in told.reason
