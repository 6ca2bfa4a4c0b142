"""Tests that do not simply repeat: two tones, a beat, narrow-band noise, a sweep, a growing sine.

A damper without anything hidden is said to miss nothing in any of them, and what is hidden at about 1 % of the peak
force (r.m.s., after T0, C and k have followed it) is named in all of them, with its size.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.random import Generator
from synthetic import diagnosed

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import clean
from pzd.diagnosis.fit.prediction import END_SHARE, comparable_samples
from pzd.record import Array, Record
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

pytestmark = pytest.mark.ci

RATE, FINER, DURATION, LEAD = 500, 16, 20.0, 2.0
NOISE, SENSOR, VOLTMETER = 5.0, 2e-6, 0.1
"""Of the force [N], of the displacement [m] and of the voltage [V]."""
PLAIN = Damper(
    base=(
        BaseRow(voltage_V=0.0, T0_N=400.0, C_Ns_per_m=2500.0, k_N_per_m=4.0e5),
        BaseRow(voltage_V=50.0, T0_N=700.0, C_Ns_per_m=2700.0, k_N_per_m=4.2e5),
        BaseRow(voltage_V=100.0, T0_N=1100.0, C_Ns_per_m=2900.0, k_N_per_m=4.4e5),
    )
)


def tones(*parts: tuple[float, float]) -> Callable[[Array], Array]:
    """Tones of those amplitudes [m] and frequencies [Hz]."""
    return lambda t: np.sum([a * np.sin(2.0 * np.pi * f * t + 0.3 * i) for i, (a, f) in enumerate(parts)], axis=0)


def narrow(t: Array) -> Array:
    """Forty lines between 1.35 and 1.65 Hz in no order of phase, 10 mm r.m.s."""
    lines = enumerate(np.linspace(1.35, 1.65, 40))
    tones = [np.sin(2.0 * np.pi * (f * t + np.sqrt(2.0) * i**2)) for i, f in lines]
    return np.asarray(0.01 * np.sqrt(2.0 / 40.0) * np.sum(tones, axis=0))


def growing(t: Array) -> Array:
    """1 Hz, from 5 to 20 mm."""
    return np.asarray((0.005 + 0.015 * t / DURATION) * np.sin(2.0 * np.pi * t))


def swept(t: Array) -> Array:
    """From 0.5 to 8 Hz and from 10 to 4 mm."""
    return np.asarray((0.01 - 0.006 * t / DURATION) * np.sin(2.0 * np.pi * (0.5 * t + 0.5 * 7.5 / DURATION * t**2)))


MOTIONS: dict[str, Callable[[Array], Array]] = {
    "1 and 10.03 Hz": tones((0.015, 1.0), (0.002, 10.03)),
    "1.1 and 12.3 Hz": tones((0.015, 1.1), (0.0015, 12.3)),
    "a beat": tones((0.01, 1.38), (0.01, 1.42)),
    "narrow-band noise": narrow,
    "a growing sine": growing,
    "a sweep": swept,
}
SIZES = {
    "orifice_quadratic": ("q", (5000.0, 5000.0, 5000.0, 4200.0, 14000.0, 4600.0)),
    "gas_spring": ("k_g", (1150.0, 1200.0, 1330.0, 1400.0, 1500.0, 2900.0)),
    "rounded_yield": ("w_s", (0.003, 0.003, 0.0006, 0.0012, 0.0008, 0.0018)),
}
"""Of each effect in each of the motions: what leaves about 1 % of the peak force."""


def records(damper: Damper, motion: Callable[[Array], Array], rng: Generator) -> tuple[Record, ...]:
    """The motion and its half at each voltage, velocity and acceleration as the rig stage makes them."""
    fine = np.arange(-LEAD, DURATION, 1.0 / (RATE * FINER))
    x = motion(fine)
    v = np.gradient(x, fine)
    a = np.gradient(v, fine)
    found = []
    for row in damper.base:
        for share in (1.0, 0.5):
            U = np.full(fine.size, row.voltage_V)
            force = respond(damper, Motion(fine, share * x, share * v, share * a, U))
            t, seen, measured, volts = (c[round(LEAD * RATE) * FINER :: FINER] for c in (fine, share * x, force, U))
            measured = measured + NOISE * rng.standard_normal(t.size)
            seen = seen + SENSOR * rng.standard_normal(t.size)
            volts = volts + VOLTMETER * rng.standard_normal(t.size)
            clean = kinematics(t, seen, cycles(t, seen))
            name = f"{row.voltage_V:g}V-{share:g}"
            found.append(Record(name, None, t, seen, clean.velocity, clean.acceleration, measured, volts))
    return tuple(found)


@pytest.mark.parametrize("motion", MOTIONS)
def test_nothing_is_missed_in_a_plain_damper(motion: str, rng: Generator) -> None:
    assert diagnosed(records(PLAIN, MOTIONS[motion], rng)).diagnosis.verdict == "none"


@pytest.mark.parametrize(
    ("motion", "effect"),  # each of both in some pair: all eighteen take half an hour, by hand
    [
        ("1 and 10.03 Hz", "orifice_quadratic"),
        ("1.1 and 12.3 Hz", "rounded_yield"),
        ("a beat", "gas_spring"),
        ("a beat", "rounded_yield"),
        ("a beat", "orifice_quadratic"),
    ],
)
def test_what_is_hidden_is_named_with_its_size(motion: str, effect: str, rng: Generator) -> None:
    parameter, sizes = SIZES[effect]
    size = dict(zip(MOTIONS, sizes, strict=True))[motion]
    found = diagnosed(records(PLAIN.with_effect(effect, {parameter: size}), MOTIONS[motion], rng)).diagnosis
    assert (found.verdict, found.effects) == ("named", (effect,))
    assert found.parameters[effect][parameter].value == pytest.approx(size, rel=0.05)


def test_noise_of_a_voltage_that_stands_still_is_no_step(rng: Generator) -> None:
    """Samples beside a step of the voltage are left out; noise once passed for steps, and left a tenth of them."""
    inside = 1.0 - 2.0 * END_SHARE
    for each in clean(records(PLAIN, MOTIONS["a sweep"], rng)):
        assert np.mean(comparable_samples(each)) == pytest.approx(inside, abs=0.02)


def two_speeds(t: Array) -> Array:
    """12 mm at 1 Hz, then without a pause at 2 Hz."""
    return 0.012 * np.sin(2.0 * np.pi * np.where(t < 0.5 * DURATION, 1.0, 2.0) * t)


def test_two_speeds_in_one_record_are_two_tests_of_one_name(rng: Generator) -> None:
    assert diagnosed(records(PLAIN, two_speeds, rng)).diagnosis.verdict == "none"
    found = diagnosed(records(PLAIN.with_effect("orifice_quadratic", {"q": 5000.0}), two_speeds, rng)).diagnosis
    assert (found.verdict, found.effects) == ("named", ("orifice_quadratic",))
    assert len(set(found.gap.held_out)) == len(found.gap.held_out)
