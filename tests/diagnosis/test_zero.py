"""The zero of the displacement is arbitrary: no verdict and no parameter depends on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from tests.diagnosis.campaign import coloured, damper_of, sines
from whole_diagnosis import all_but, diagnosed

from pzd.artefacts import Diagnosed, Value
from pzd.cli.text_tables import diagnosis_lines
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.search.acceptance import misplaced_end_stop
from pzd.quantities import Control
from pzd.record import Record
from pzd.rig.stand.frame import force_in_frame

TWO = (0.0, 150.0)
STOPS = {"k_e": 1.5e6, "x_e": 0.018}
SHIFT = 0.05


def shifted(records: Sequence[Record], by: float = SHIFT) -> tuple[Record, ...]:
    return tuple(replace(r, displacement=r.displacement + by) for r in records)


def parameter(found: Diagnosed, effect: str, name: str) -> Value:
    return found.diagnosis.parameters[effect][name]


def number(found: Diagnosed, effect: str, name: str) -> float:
    value = parameter(found, effect, name).value
    assert isinstance(value, float)
    return value


@pytest.fixture(scope="module")
def stopped(generator_for: Callable[[str], np.random.Generator]) -> tuple[Diagnosed, Diagnosed]:
    """A damper with end stops, and the same with 50 mm added to its displacement."""
    records = sines(damper_of(TWO, end_stop=STOPS), generator_for("end stops"), TWO)
    return diagnosed(records), diagnosed(shifted(records))


@pytest.mark.ci
def test_records_shifted_by_50_mm_have_the_same_verdict_effects_and_parameters(
    stopped: tuple[Diagnosed, Diagnosed],
) -> None:
    here, there = stopped
    assert here.diagnosis.effects == ("end_stop",)
    assert (there.diagnosis.verdict, there.diagnosis.effects) == (here.diagnosis.verdict, here.diagnosis.effects)
    for name, value in STOPS.items():
        assert number(here, "end_stop", name) == pytest.approx(value, rel=0.1)
        assert number(there, "end_stop", name) == pytest.approx(number(here, "end_stop", name), rel=1e-3)
    assert there.diagnosis.zero_m - here.diagnosis.zero_m == pytest.approx(SHIFT, abs=1e-5)
    assert there.damper.zero_m == there.diagnosis.zero_m


@pytest.mark.ci
def test_where_the_gap_lies_is_told_in_the_displacement_as_recorded(stopped: tuple[Diagnosed, Diagnosed]) -> None:
    here, there = (
        [region.region for region in found.diagnosis.where if region.region.startswith("x ")] for found in stopped
    )
    assert {*here} <= {"x < -0.015 m", "x > 0.015 m"}
    assert {*there} <= {"x < 0.035 m", "x > 0.065 m"}
    assert len(there) == len(here) > 0


@pytest.mark.ci
def test_a_gas_spring_and_its_next_test_are_the_same_about_a_shifted_middle(rng: np.random.Generator) -> None:
    tests = ((2.0, 0.015), (2.0, 0.03))
    records = sines(damper_of(TWO, gas_spring={"k_g": 3000.0}), rng, TWO, tests=tests)
    few = all_but("gas_spring", "fluid_inertia")
    here, there = (diagnosed(each, forbid=few) for each in (records, shifted(records)))
    assert there.diagnosis.effects == here.diagnosis.effects == ("gas_spring",)
    assert number(there, "gas_spring", "k_g") == pytest.approx(number(here, "gas_spring", "k_g"), rel=1e-3)
    one, other = here.diagnosis.next_test, there.diagnosis.next_test
    assert one is not None
    assert other is not None
    assert one.middle_m == pytest.approx(0.0, abs=1e-4)
    assert other.middle_m == pytest.approx(SHIFT, abs=1e-4)
    known = ("waveform", "frequency_Hz", "amplitude_m", "voltage_V", "separates")
    assert {k: getattr(other, k) for k in known} == {k: getattr(one, k) for k in known}


def test_a_damper_whose_zero_is_moved_gives_the_same_force_in_the_displacement_so_moved(
    rng: np.random.Generator,
) -> None:
    """Pasted into a stand, or asked by a figure: x_e is counted from the damper's zero."""
    damper = damper_of((0.0,), end_stop=STOPS)
    (record,) = sines(damper, rng, (0.0,), tests=((0.5, 0.03),), noise=0.0)
    assert damper.moved(SHIFT).zero_m == SHIFT
    here = Motion.of(record)
    there = replace(here, displacement=here.displacement + SHIFT)
    assert respond(damper.moved(SHIFT), there) == pytest.approx(respond(damper, here), abs=1e-4)
    framed = force_in_frame(damper.moved(SHIFT), there, 1e7)
    assert framed == pytest.approx(force_in_frame(damper, here, 1e7), abs=1e-4)


@pytest.mark.ci
def test_the_damper_handed_on_gives_the_recorded_force_in_the_recorded_displacement(
    stopped: tuple[Diagnosed, Diagnosed], rng: np.random.Generator
) -> None:
    record = shifted(sines(damper_of(TWO, end_stop=STOPS), rng, (150.0,), noise=0.0))[-1]
    again = respond(stopped[1].damper, Motion.of(record), float(record.force[0]))[500:]
    assert np.sqrt(np.mean((again - record.force[500:]) ** 2)) < 0.02 * np.max(np.abs(record.force))


@pytest.mark.ci
def test_stops_that_do_not_lie_evenly_about_what_was_recorded_are_found_where_they_are(
    rng: np.random.Generator,
) -> None:
    """Tests to 30 mm one way and to 24 mm the other, between stops that begin 18 mm from zero."""
    damper = damper_of(TWO, end_stop=STOPS)
    found = diagnosed(tuple(off_middle(damper, U, f, a, 0.003, rng) for U in TWO for f in (0.5, 2.0)
                            for a in (0.02, 0.027)))  # fmt: skip
    assert "end_stop" in found.diagnosis.effects, found.diagnosis.reason
    assert number(found, "end_stop", "x_e") == pytest.approx(0.018, rel=0.05)
    assert found.diagnosis.zero_m == pytest.approx(0.0, abs=5e-4)
    told = next(line for line in diagnosis_lines(found.diagnosis, Control()) if line.startswith("adopted: end_stop"))
    assert " to either side of x = " in told


def off_middle(
    damper: Damper, voltage: float, frequency: float, amplitude: float, middle: float, rng: np.random.Generator
) -> Record:
    time = np.arange(-2.0 / frequency, 8.0 / frequency, 1.0 / 16000.0)
    phase = 2.0 * np.pi * frequency * time
    x = middle + amplitude * np.sin(phase)
    v = 2.0 * np.pi * frequency * amplitude * np.cos(phase)
    a = -((2.0 * np.pi * frequency) ** 2) * (x - middle)
    felt = np.full(time.size, voltage)
    force = respond(damper, Motion(time, x, v, a, felt), tolerance=1e-7)
    kept = np.flatnonzero(time >= 0.0)[::16]
    noise = coloured(rng, kept.size, 0.01 * float(np.max(np.abs(force))), 0.9)
    return Record(
        f"{voltage:g}V-{frequency:g}Hz-{1e3 * amplitude:g}mm", None, time[kept], x[kept], v[kept], a[kept],
        force[kept] + noise, felt[kept],
    )  # fmt: skip


@pytest.mark.ci
def test_a_force_near_one_end_of_an_absolute_displacement_is_no_end_stop(rng: np.random.Generator) -> None:
    """Tests from 12.7 to 50 mm. Counted from the sensor's zero an end stop begins at 41.4 mm and was named."""
    tests = ((0.5, 0.01), (0.5, 0.0186), (2.0, 0.015), (2.0, 0.0186))
    records = shifted(sines(damper_of(TWO), rng, TWO, tests=tests), 0.03135)
    told = diagnosed(
        tuple(replace(r, force=r.force + 1e6 * np.maximum(r.displacement - 0.0414, 0.0) ** 2) for r in records)
    ).diagnosis
    assert "end_stop" not in (*told.effects, *told.rivals), told.reason
    assert told.verdict == "unexplained"


@pytest.mark.parametrize(
    ("x_e", "zero", "why"),
    [
        (0.021, 0.0, None),
        (0.021, 0.002, None),
        (0.031, 0.0, "one end"),
        (0.021, 0.008, "one end"),
        (0.010, 0.0, "in the middle"),
        (0.014, 0.004, "in the middle"),
    ],
)
def test_an_end_stop_acts_near_both_ends_of_a_recorded_stroke_of_60_mm(
    x_e: float, zero: float, why: str | None
) -> None:
    damper = damper_of((0.0,), end_stop={"k_e": 1e6, "x_e": x_e}).moved(zero)
    found = misplaced_end_stop(damper, 0.03)
    assert found is None if why is None else found is not None and why in found
