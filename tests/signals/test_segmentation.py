"""Two tests in one record without a pause: told from beats, sweeps and growing sines, and treated apart."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.random import Generator
from stepped_motions import NO_STEPS, STEPS, TIME

from pzd.artefacts import Rig
from pzd.damper.element import element_force
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.roles import split
from pzd.identification.config import IdentifyConfig
from pzd.identification.stage import identify
from pzd.record import Array, Record
from pzd.signals.segmentation import separate_tests, steps_between_tests

TRUTH = (400.0, 2500.0, 4e5)


def record(x: Array, rng: Generator, noise: float = 5.0) -> Record:
    force = element_force(x, 1e-3, *TRUTH) + noise * rng.standard_normal(x.size)
    speed = np.gradient(x, 1e-3)
    return Record("r", None, TIME, x + 2e-6 * rng.standard_normal(x.size), speed, np.gradient(speed, 1e-3), force)


@pytest.mark.parametrize("kind", STEPS)
def test_a_step_of_speed_or_amplitude_separates_two_tests(kind: str, rng: Generator) -> None:
    before, after = separate_tests(record(STEPS[kind], rng))
    assert before.name == after.name == "r"
    assert before.time[0] == TIME[0]
    assert before.time[-1] == pytest.approx(6.0, abs=1.01)
    assert after.time[0] == pytest.approx(6.0, abs=1.01)
    assert after.time[-1] == TIME[-1]


@pytest.mark.parametrize("kind", NO_STEPS)
def test_a_motion_that_changes_from_cycle_to_cycle_is_one_test(kind: str, rng: Generator) -> None:
    whole = record(NO_STEPS[kind], rng)
    assert steps_between_tests(whole.time, whole.displacement) == ()
    assert separate_tests(whole) == (whole,)


@pytest.mark.parametrize(("kind", "frequencies", "amplitudes"), [
    ("two speeds", (1.0, 2.0), (0.01, 0.01)),
    ("two amplitudes", (1.5, 1.5), (0.005, 0.015)),
])  # fmt: skip
def test_two_tests_in_one_record_have_measures_each_and_give_the_parameters_together(
    kind: str, frequencies: tuple[float, ...], amplitudes: tuple[float, ...], rng: Generator
) -> None:
    found = identify(IdentifyConfig(), Rig((record(STEPS[kind], rng),), ()), 1)
    assert [m.record for m in found.measures] == ["r", "r"]
    assert [m.frequency_Hz for m in found.measures] == pytest.approx(frequencies, rel=1e-3)
    assert [m.amplitude_m for m in found.measures] == pytest.approx(amplitudes, rel=1e-2)
    (row,) = found.rows
    assert "the model" not in row.status
    assert (row.T0_N, row.C_Ns_per_m) == pytest.approx(TRUTH[:2], rel=0.02)


def test_two_tests_in_one_record_are_diagnosed_as_two_under_one_name(rng: Generator) -> None:
    cleaned = clean([record(STEPS["two speeds"], rng)])
    assert [p.record.name for p in cleaned] == ["r", "r"]
    assert [p.cycles.frequency for p in cleaned if p.cycles] == pytest.approx([1.0, 2.0], rel=1e-3)
    assert split(cleaned, None, 2.0).held_out == ("r",)
