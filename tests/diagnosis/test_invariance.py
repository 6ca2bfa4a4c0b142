"""A rig mirrored, scaled, shifted or sampled otherwise is the same rig: its verdict and parameters follow."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import TWO, all_but, coloured, damper_of, diagnosed, sines
from test_naming import TRUTHS

from pzd.artefacts import Diagnosed, ParameterRow, Value
from pzd.damper.compose import respond
from pzd.damper.effects import library
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.search.acceptance import misplaced_end_stop
from pzd.quantities import Control
from pzd.record import Array, Record
from pzd.report.diagnosis_text import diagnosis_lines
from pzd.rig.stand.frame import force_in_frame
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

SIDED = {"alpha", "F_0"}
"""Parameters that say in which direction: they change their sign with it."""
OF_INTERVAL = 0.05
"""Share of its 95 % interval by which the search may end beside the same optimum."""
MOVES: dict[str, tuple[Callable[[Record], Record], Callable[[str, str], float], float]] = {
    "mirrored": (
        lambda r: replace(
            r, displacement=-r.displacement, velocity=-r.velocity, acceleration=-r.acceleration, force=-r.force
        ),
        lambda name, unit: -1.0 if name in SIDED else 1.0,
        1.0,
    ),
    "3.7 times as strong": (
        lambda r: replace(r, force=3.7 * r.force),
        lambda name, unit: 3.7 if unit.startswith(("N", "kg")) else 1.0,
        3.7,
    ),
    "a fifth as strong": (
        lambda r: replace(r, force=0.2 * r.force),
        lambda name, unit: 0.2 if unit.startswith(("N", "kg")) else 1.0,
        0.2,
    ),
    "an hour later": (lambda r: replace(r, time=r.time + 3600.0), lambda name, unit: 1.0, 1.0),
}
"""How the rig is changed; by what a parameter of that name and unit is multiplied then; and by what T0, C and k."""


def follows(moved: Diagnosed, found: Diagnosed, factor: Callable[[str, str], float], force: float) -> None:
    here, there = found.diagnosis, moved.diagnosis
    assert (there.verdict, there.effects, there.rivals) == (here.verdict, here.effects, here.rivals)
    for effect, values in here.parameters.items():
        for parameter in library()[effect].parameters:
            name, value, other = parameter.name, values[parameter.name], there.parameters[effect][parameter.name]
            times = factor(name, parameter.unit)
            near(other.value, times * np.array(value.value), abs(times) * wide(value.high95, value.low95))
    for row, other in zip(found.parameters, moved.parameters, strict=True):
        same_row(other, row, force)


def same_row(other: ParameterRow, row: ParameterRow, force: float) -> None:
    for column in ("T0_N", "C_Ns_per_m", "k_N_per_m"):
        value, low, high = (getattr(row, column + end) for end in ("", "_low95", "_high95"))
        if value is None:  # the tests do not show it, such as C behind an open relief valve
            assert getattr(other, column) is None
            continue
        near(getattr(other, column), force * value, force * (high - low))
    # How wide the interval is of what no test determines goes by where the search ended.
    assert re.sub(r"\d+ %", "# %", other.status) == re.sub(r"\d+ %", "# %", row.status)


def wide(high: float | Sequence[float] | None, low: float | Sequence[float] | None) -> np.ndarray:
    return np.array(high, dtype=np.float64) - np.array(low, dtype=np.float64)


def near(value: object, expected: object, width: object) -> None:
    beside = np.abs(np.array(value, dtype=np.float64) - np.array(expected, dtype=np.float64))
    assert np.all(beside <= OF_INTERVAL * np.array(width)), (value, expected, width)


@pytest.fixture(scope="module")
def sided(generator_for: Callable[[str], np.random.Generator]) -> tuple[tuple[Record, ...], Diagnosed]:
    """A small rig whose damper is softer in one direction, and what is said of it."""
    damper, tests = damper_of((0.0,), asymmetry=TRUTHS["asymmetry"]), ((1.0, 0.02), (2.0, 0.03), (2.0, 0.02))
    records = sines(damper, generator_for("sided"), (0.0,), tests=tests, cycles=5)
    return records, diagnosed(records)


@pytest.mark.parametrize(
    "move", ["mirrored", *(pytest.param(name, marks=pytest.mark.ci) for name in MOVES if name != "mirrored")]
)
def test_a_sided_effect_changes_sides_with_the_rig_and_nothing_else(
    sided: tuple[tuple[Record, ...], Diagnosed], move: str
) -> None:
    records, found = sided
    change, factor, force = MOVES[move]
    assert found.diagnosis.effects == ("asymmetry",)
    follows(diagnosed(tuple(map(change, records))), found, factor, force)


AT_ONCE = (
    ("mirrored", "3.7 times as strong", "an hour later"),
    ("mirrored", "a fifth as strong", "an hour later"),
)
"""Moves that an effect goes through at once, in turn: what one of them breaks, all of them do."""


@pytest.mark.ci
@pytest.mark.parametrize(
    ("effect", "moves"), [(effect, AT_ONCE[i % len(AT_ONCE)]) for i, effect in enumerate((None, *TRUTHS))]
)
def test_every_verdict_follows_its_rig(rng: np.random.Generator, effect: str | None, moves: tuple[str, ...]) -> None:
    hidden = {} if effect is None else {effect: TRUTHS[effect]}
    records = sines(damper_of(TWO, **hidden), rng, TWO, jitter=0.01)
    changes, factors, forces = zip(*(MOVES[move] for move in moves), strict=True)
    moved = records
    for change in changes:
        moved = tuple(map(change, moved))

    def factor(name: str, unit: str) -> float:
        return float(np.prod([each(name, unit) for each in factors]))

    follows(diagnosed(moved), diagnosed(records), factor, float(np.prod(forces)))


# --- The zero of the displacement is arbitrary


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
def test_the_gap_is_located_in_the_displacement_as_recorded(stopped: tuple[Diagnosed, Diagnosed]) -> None:
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
def test_the_adopted_damper_gives_the_recorded_force_in_the_recorded_displacement(
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
def test_a_stop_at_one_end_of_an_absolute_displacement_is_found_where_it_is(rng: np.random.Generator) -> None:
    """Tests from 12.7 to 50 mm, a bump stop from 41.4 mm on: nothing is touched at the other end."""
    tests = ((0.5, 0.01), (0.5, 0.0186), (2.0, 0.015), (2.0, 0.0186))
    records = shifted(sines(damper_of(TWO), rng, TWO, tests=tests), 0.03135)
    found = diagnosed(
        tuple(replace(r, force=r.force + 1e6 * np.maximum(r.displacement - 0.0414, 0.0) ** 2) for r in records)
    )
    told = found.diagnosis
    assert (told.verdict, told.effects) == ("named", ("end_stop",)), told.reason
    assert number(found, "end_stop", "k_e") == pytest.approx(1e6, rel=0.15)  # 75 N beneath noise of 15 to 50 N
    # Where it begins and how stiff it is trade against each other: ten draws of the noise scatter by 0.08 mm.
    assert found.damper.zero_m + number(found, "end_stop", "x_e") == pytest.approx(0.0414, abs=3e-4)


@pytest.mark.parametrize(
    ("x_e", "zero", "why"),
    [
        (0.021, 0.0, None),
        (0.021, 0.002, None),
        (0.024, 0.008, None),
        (0.010, 0.0, "in the middle"),
        (0.014, 0.004, "in the middle"),
        (0.0293, 0.0, "turn round"),
        (0.0293, 0.002, None),
    ],
)
def test_an_end_stop_acts_near_an_end_of_a_recorded_stroke_of_60_mm(x_e: float, zero: float, why: str | None) -> None:
    damper = damper_of((0.0,), end_stop={"k_e": 1e6, "x_e": x_e}).moved(zero)
    motions = [(np.array([-0.03, 0.03]), np.array([0.0, speed])) for speed in (0.1, 0.2)]
    found = misplaced_end_stop(damper, 0.03, motions)
    assert found is None if why is None else found is not None and why in found


@pytest.mark.parametrize(
    ("amplitudes", "speeds", "why"),
    [
        ((0.03, 0.02), (0.2, 0.2), "turn round"),  # one of them reaches the stop
        ((0.03, 0.03), (0.2, 0.2), "turn round"),  # one motion at two voltages
        ((0.03, 0.03), (0.2, 0.1), None),
        ((0.03, 0.028), (0.2, 0.2), None),
    ],
)
def test_a_stop_in_the_last_tenth_of_the_stroke_is_shown_by_two_motions(
    amplitudes: tuple[float, ...], speeds: tuple[float, ...], why: str | None
) -> None:
    """Friction that gives before it slips, at the reversal of the longest test, was named an end stop."""
    damper = damper_of((0.0,), end_stop={"k_e": 1e6, "x_e": 0.0277})
    motions = [(np.array([-a, a]), np.array([0.0, v])) for a, v in zip(amplitudes, speeds, strict=True)]
    found = misplaced_end_stop(damper, 0.03, motions)
    assert found is None if why is None else found is not None and why in found


# --- One recording of 8 kHz, and the same filtered and decimated


RATE, DURATION, LEAD = 8000, 9.0, 1.0
PASSES = 0.8
"""Share of half the lower rate that the filter before a decimation lets through."""
NOISE, SENSOR = 0.22, 9e-8
"""Density of the noise of force [N/sqrt(Hz)] and displacement [m/sqrt(Hz)]: 5 N and 2 um at 1 kHz."""
PLAIN = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=400.0, C_Ns_per_m=2500.0, k_N_per_m=4.0e5),
        BaseRow(voltage_V=100.0, T0_N=1100.0, C_Ns_per_m=2900.0, k_N_per_m=4.4e5),
    )
)
SINES = [[(0.020, 1.0, 0.0)], [(0.015, 2.0, 0.0)], [(0.010, 4.0, 0.0)]]
"""Amplitude [m], frequency [Hz] and phase [rad] of the tones of each test."""


def rough(rng: Generator) -> list[tuple[float, float, float]]:
    """Forty tones from 0.5 to 6 Hz whose amplitudes fall as the frequency grows, 3 mm r.m.s. at 1 Hz."""
    tones = np.linspace(0.5, 6.0, 40)
    return [(0.0033 / f, f, phase) for f, phase in zip(tones, rng.uniform(0.0, 2.0 * np.pi, tones.size), strict=True)]


def recorded(damper: Damper, tests: list[list[tuple[float, float, float]]], rng: Generator) -> list[tuple[str, Array]]:
    """Name and time, displacement, force and voltage (4, n) of every test at each voltage, at the full rate."""
    found = []
    t = np.arange(-LEAD, DURATION, 1.0 / RATE)
    for row in damper.base:
        for number, tones in enumerate(tests):
            w = [2.0 * np.pi * f for _, f, _ in tones]
            x = np.sum([a * np.sin(u * t + p) for u, (a, _, p) in zip(w, tones, strict=True)], axis=0)
            v = np.sum([a * u * np.cos(u * t + p) for u, (a, _, p) in zip(w, tones, strict=True)], axis=0)
            a = -np.sum([a * u**2 * np.sin(u * t + p) for u, (a, _, p) in zip(w, tones, strict=True)], axis=0)
            U = np.full(t.size, row.voltage_V)
            force = respond(damper, Motion(t, x, v, a, U), tolerance=1e-9)
            channels = np.stack([t, x, force, U])[:, t >= 0.0]
            channels[1] += SENSOR * np.sqrt(RATE / 2.0) * rng.standard_normal(channels.shape[1])
            channels[2] += NOISE * np.sqrt(RATE / 2.0) * rng.standard_normal(channels.shape[1])
            found.append((f"{row.voltage_V:g}V-{number}", channels))
    return found


def decimated(tests: list[tuple[str, Array]], rate: int) -> Iterator[Record]:
    """The same tests behind a linear-phase filter at a lower rate, a quarter of a second cut off at either end."""
    from scipy.signal import firwin

    factor = RATE // rate
    window = firwin(20 * factor * 2 + 1, PASSES / factor) if factor > 1 else np.ones(1)
    for name, (time, motion, measured, voltage) in tests:
        filtered = (np.convolve(channel, window, "same") for channel in (motion, measured))
        t, x, force, U = (c[RATE // 4 : -RATE // 4 : factor] for c in (time, *filtered, voltage))
        clean = kinematics(t, x, cycles(t, x))
        yield Record(name, None, t, x, clean.velocity, clean.acceleration, force, U)


@pytest.mark.ci
def test_evidence_does_not_grow_with_the_sampling_rate(rng: Generator) -> None:
    tests = recorded(PLAIN.with_effect("gas_spring", {"k_g": 2000.0}), SINES, rng)
    found = {rate: diagnosed(decimated(tests, rate)).diagnosis for rate in (250, 1000, 8000)}
    assert {(d.verdict, d.effects) for d in found.values()} == {("named", ("gas_spring",))}
    pays = {rate: d.ranking[0].delta_bic for rate, d in found.items()}
    assert pays[8000] == pytest.approx(pays[1000], rel=0.1)
    assert pays[250] == pytest.approx(pays[1000], rel=0.2)  # 25 of the 80 harmonics of 4 Hz lie below 100 Hz


@pytest.mark.ci
@pytest.mark.parametrize("rate", [500, 2000])
def test_a_filter_against_aliasing_is_no_missing_effect(rate: int, rng: Generator) -> None:
    tests = recorded(PLAIN, [rough(rng), [(0.5 * a, f, p) for a, f, p in rough(rng)]], rng)
    found = diagnosed(decimated(tests, rate)).diagnosis
    assert (found.verdict, found.effects) == ("none", ())
