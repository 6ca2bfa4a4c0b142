"""What is found does not depend on the sampling rate: one recording of 8 kHz, and the same filtered and decimated."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.random import Generator
from whole_diagnosis import diagnosed

from pzd.damper.compose import respond
from pzd.damper.model import BaseRow, Damper
from pzd.damper.motion import Motion
from pzd.record import Array, Record
from pzd.signals.cycles import cycles
from pzd.signals.kinematics import kinematics

pytestmark = pytest.mark.ci

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


def test_evidence_does_not_grow_with_the_sampling_rate(rng: Generator) -> None:
    tests = recorded(PLAIN.with_effect("gas_spring", {"k_g": 2000.0}), SINES, rng)
    found = {rate: diagnosed(decimated(tests, rate)).diagnosis for rate in (250, 1000, 8000)}
    assert {(d.verdict, d.effects) for d in found.values()} == {("named", ("gas_spring",))}
    pays = {rate: d.ranking[0].delta_bic for rate, d in found.items()}
    assert pays[8000] == pytest.approx(pays[1000], rel=0.1)
    assert pays[250] == pytest.approx(pays[1000], rel=0.2)  # 25 of the 80 harmonics of 4 Hz lie below 100 Hz


@pytest.mark.parametrize("rate", [500, 2000])
def test_a_filter_against_aliasing_is_no_missing_effect(rate: int, rng: Generator) -> None:
    tests = recorded(PLAIN, [rough(rng), [(0.5 * a, f, p) for a, f, p in rough(rng)]], rng)
    found = diagnosed(decimated(tests, rate)).diagnosis
    assert (found.verdict, found.effects) == ("none", ())
