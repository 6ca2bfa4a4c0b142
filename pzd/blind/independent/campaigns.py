"""Campaigns as laboratories run them: which motions, at which values of the control signal, sampled how fast."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator

MotionKind = Literal["sine", "two_tone", "triangle", "sweep", "random"]
SignalKind = Literal["constant", "steps", "ramp"]


@dataclass(frozen=True)
class LaboratoryTest:
    """One test: what the actuator is asked for, and the control signal."""

    kind: MotionKind
    amplitude: float
    """Largest displacement that is asked for [m]."""
    frequency: float
    """Of a sine, a triangle or the first tone; where a sweep ends and a random motion has lost its strength [Hz]."""
    cycles: int
    """Periods that are recorded; of a sweep or a random motion, seconds."""
    signal: SignalKind = "constant"
    value: float = 0.0
    """Of the control signal where it is constant [V]."""

    @property
    def seconds(self) -> float:
        """How long it is recorded."""
        return float(self.cycles) if self.kind in ("sweep", "random") else self.cycles / self.frequency


@dataclass(frozen=True)
class LaboratoryCampaign:
    """What the stand runs in one case."""

    tests: tuple[LaboratoryTest, ...]
    values: tuple[float, ...]
    """Of the control signal at which parameters are given [V]; one where the damper has none."""
    rate: float
    """Sampling rate [Hz]."""

    @property
    def one_frequency(self) -> bool:
        """Whether all tests are sines of one frequency, so that a spring and a mass are the same thing."""
        return {t.kind for t in self.tests} == {"sine"} and len({t.frequency for t in self.tests}) == 1


RATES = (500.0, 512.0, 1000.0, 1024.0, 2000.0, 4000.0)
"""Usual rates of data loggers [Hz]."""
MOST_SAMPLES = 40_000
"""In all tests of a case; longer campaigns are sampled more slowly."""


def one_frequency(draw: Generator, stroke: float) -> list[LaboratoryTest]:
    """A crank drive: one frequency, one stroke."""
    frequency = float(draw.choice([0.5, 1.0, 1.5, 2.0]))
    return [LaboratoryTest("sine", stroke, frequency, 10)]


def two_by_two(draw: Generator, stroke: float) -> list[LaboratoryTest]:
    """Two frequencies at two strokes each."""
    low, ratio = float(draw.choice([0.5, 1.0, 1.3])), float(draw.choice([2.0, 2.5, 3.0]))
    return [
        LaboratoryTest("sine", stroke * size * (1.0 if f == low else 0.7), f, 8)
        for f in (low, low * ratio)
        for size in (0.5, 1.0)
    ]


def constant_stroke(draw: Generator, stroke: float) -> list[LaboratoryTest]:
    """The usual acceptance test of suspension dampers: one stroke, the speed set by the frequency."""
    speeds = (0.052, 0.131, 0.262, 0.393, 0.524)  # the series 52 to 524 mm/s of the manufacturers
    frequencies = [round(speed / (2.0 * np.pi * stroke), 2) for speed in speeds]
    return [LaboratoryTest("sine", stroke, f, 5) for f in frequencies]


def sines_and_triangles(draw: Generator, stroke: float) -> list[LaboratoryTest]:
    """Constant speeds by triangles, between sines."""
    low = float(draw.choice([0.5, 1.0]))
    return [
        LaboratoryTest("sine", stroke, low, 6),
        LaboratoryTest("sine", 0.4 * stroke, 3.0 * low, 8),
        LaboratoryTest("triangle", 0.8 * stroke, 0.5 * low, 4),
        LaboratoryTest("triangle", 0.8 * stroke, 1.5 * low, 6),
    ]


def broadband(draw: Generator, stroke: float) -> list[LaboratoryTest]:
    """Sines, two tones, a sweep and a random motion."""
    low = float(draw.choice([0.7, 1.0, 1.2]))
    return [
        LaboratoryTest("sine", stroke, low, 6),
        LaboratoryTest("sine", 0.4 * stroke, 2.5 * low, 8),
        LaboratoryTest("two_tone", 0.8 * stroke, low, 8),
        LaboratoryTest("sweep", 0.3 * stroke, 5.0, 12),
        LaboratoryTest("random", 0.8 * stroke, 2.0, 15),
    ]


def moving_signal(draw: Generator, stroke: float) -> list[LaboratoryTest]:
    """Two by two, and tests in which the control signal steps and ramps."""
    low = float(draw.choice([1.0, 1.3]))
    return [
        *two_by_two(draw, stroke),
        LaboratoryTest("sine", 0.8 * stroke, low, 8, "steps"),
        LaboratoryTest("sine", 0.8 * stroke, low, 8, "ramp"),
    ]


CAMPAIGNS: Mapping[str, Callable[[Generator, float], list[LaboratoryTest]]] = {
    "one_frequency": one_frequency,
    "two_by_two": two_by_two,
    "constant_stroke": constant_stroke,
    "sines_and_triangles": sines_and_triangles,
    "broadband": broadband,
    "moving_signal": moving_signal,
}
"""Every campaign by name."""
SHARES: Mapping[str, float] = {
    "one_frequency": 0.1,
    "two_by_two": 0.22,
    "constant_stroke": 0.2,
    "sines_and_triangles": 0.16,
    "broadband": 0.16,
    "moving_signal": 0.16,
}
"""How many of the cases run each."""


def campaign(name: str, draw: Generator) -> LaboratoryCampaign:
    """The tests of a case.

    Parameters
    ----------
    name : of the campaign
    draw : where stroke, speeds, control values and the sampling rate come from
    """
    stroke = float(draw.choice([0.01, 0.015, 0.02, 0.025, 0.03]))
    tests = CAMPAIGNS[name](draw, stroke)
    count = int(draw.integers(2, 4)) if name == "moving_signal" else int(draw.integers(1, 6))
    count = min(count, 3) if len(tests) > 1 else count
    if len(tests) > 4:
        count = min(count, 2)
    highest = float(draw.choice([2.0, 5.0, 12.0, 150.0]))
    values = tuple(float(v) for v in np.round(np.linspace(0.0, highest, count), 3))
    every = [
        LaboratoryTest(t.kind, t.amplitude, t.frequency, t.cycles, t.signal, value)
        for t in tests
        for value in (values if t.signal == "constant" else values[:1])
    ]
    seconds = sum(test.seconds for test in every)
    fast_enough = [r for r in RATES if r * seconds <= MOST_SAMPLES]
    return LaboratoryCampaign(tuple(every), values, float(draw.choice(fast_enough or RATES[:1])))
