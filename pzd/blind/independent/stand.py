"""A test stand as laboratories have them: campaigns of tests, the motion of the actuator, and the measuring chain.

A campaign draws its tests. The actuator follows each as a loop of second order, and the damper warms by its work. The
data logger adds gains, offsets and their drift, noise, hum, a coarse clock and coarse numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.random import Generator

from pzd.record import Array, Rows

# --- Campaigns: which motions, at which values of the control signal, sampled how fast ---


MotionKind = Literal["sine", "two_tone", "triangle", "sweep", "random"]
SignalKind = Literal["constant", "steps", "ramp"]
LONGEST_STEP = 1.25e-4
"""Of the integration [s]: it costs less than 1e-5 of the force, see tests/blind/test_independent_laws.py."""


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
        """Length of the recording [s]."""
        return float(self.cycles) if self.kind in ("sweep", "random") else self.cycles / self.frequency


@dataclass(frozen=True)
class LaboratoryCampaign:
    """What the stand runs in one case."""

    tests: tuple[LaboratoryTest, ...]
    values: tuple[float, ...]
    """Of the control signal at which parameters are given [V]; one where the damper has none."""
    rate: float
    """Sampling rate [Hz]."""
    step: float = LONGEST_STEP
    """Longest step of the integration [s]: a stiff oil spring asks for shorter ones."""

    @property
    def one_frequency(self) -> bool:
        """Whether all tests are sines of one frequency, so that a spring and a mass cannot be told apart."""
        return {t.kind for t in self.tests} == {"sine"} and len({t.frequency for t in self.tests}) == 1


RATES = (500.0, 512.0, 1000.0, 1024.0, 2000.0, 4000.0)
"""Usual rates of data loggers [Hz]."""
MOST_SAMPLES = 40_000
"""In all tests of a case, so that a diagnosis takes seconds; longer campaigns are sampled more slowly."""


def one_frequency(rng: Generator, stroke: float) -> list[LaboratoryTest]:
    """Plan the test of a crank drive: one frequency, one stroke."""
    frequency = float(rng.choice([0.5, 1.0, 1.5, 2.0]))
    return [LaboratoryTest("sine", stroke, frequency, 10)]


def two_by_two(rng: Generator, stroke: float) -> list[LaboratoryTest]:
    """Plan two frequencies at two strokes each."""
    low, ratio = float(rng.choice([0.5, 1.0, 1.3])), float(rng.choice([2.0, 2.5, 3.0]))
    return [
        LaboratoryTest("sine", stroke * size * (1.0 if f == low else 0.7), f, 8)
        for f in (low, low * ratio)
        for size in (0.5, 1.0)
    ]


def constant_stroke(rng: Generator, stroke: float) -> list[LaboratoryTest]:
    """Plan the usual acceptance test of suspension dampers: one stroke, the speed set by the frequency."""
    speeds = (0.052, 0.131, 0.262, 0.393, 0.524)  # the series 52 to 524 mm/s of the manufacturers
    frequencies = [round(speed / (2.0 * np.pi * stroke), 2) for speed in speeds]
    return [LaboratoryTest("sine", stroke, f, 5) for f in frequencies]


def sines_and_triangles(rng: Generator, stroke: float) -> list[LaboratoryTest]:
    """Plan constant speeds by triangles, between sines."""
    low = float(rng.choice([0.5, 1.0]))
    return [
        LaboratoryTest("sine", stroke, low, 6),
        LaboratoryTest("sine", 0.4 * stroke, 3.0 * low, 8),
        LaboratoryTest("triangle", 0.8 * stroke, 0.5 * low, 4),
        LaboratoryTest("triangle", 0.8 * stroke, 1.5 * low, 6),
    ]


def broadband(rng: Generator, stroke: float) -> list[LaboratoryTest]:
    """Plan sines, two tones, a sweep and a random motion."""
    low = float(rng.choice([0.7, 1.0, 1.2]))
    return [
        LaboratoryTest("sine", stroke, low, 6),
        LaboratoryTest("sine", 0.4 * stroke, 2.5 * low, 8),
        LaboratoryTest("two_tone", 0.8 * stroke, low, 8),
        LaboratoryTest("sweep", 0.3 * stroke, 5.0, 12),
        LaboratoryTest("random", 0.8 * stroke, 2.0, 15),
    ]


def moving_signal(rng: Generator, stroke: float) -> list[LaboratoryTest]:
    """Plan two by two, and tests in which the control signal steps and ramps."""
    low = float(rng.choice([1.0, 1.3]))
    return [
        *two_by_two(rng, stroke),
        LaboratoryTest("sine", 0.8 * stroke, low, 8, "steps"),
        LaboratoryTest("sine", 0.8 * stroke, low, 8, "ramp"),
    ]


CAMPAIGNS: Mapping[str, tuple[float, Callable[[Generator, float], list[LaboratoryTest]]]] = {
    "one_frequency": (0.1, one_frequency),
    "two_by_two": (0.22, two_by_two),
    "constant_stroke": (0.2, constant_stroke),
    "sines_and_triangles": (0.16, sines_and_triangles),
    "broadband": (0.16, broadband),
    "moving_signal": (0.16, moving_signal),
}
"""Every campaign by name: the share of the cases that run it, and its tests from the largest stroke [m]."""


def campaign(name: str, rng: Generator) -> LaboratoryCampaign:
    """Draw the campaign of a case.

    Parameters
    ----------
    name : of the campaign
    rng : where stroke, speeds, control values and the sampling rate come from
    """
    stroke = float(rng.choice([0.01, 0.015, 0.02, 0.025, 0.03]))
    _, planned = CAMPAIGNS[name]
    tests = planned(rng, stroke)
    count = int(rng.integers(2, 4)) if name == "moving_signal" else int(rng.integers(1, 6))
    count = min(count, 3) if len(tests) > 1 else count
    if len(tests) > 4:
        count = min(count, 2)
    highest = float(rng.choice([2.0, 5.0, 12.0, 150.0]))
    values = tuple(float(v) for v in np.round(np.linspace(0.0, highest, count), 3))
    every = [
        LaboratoryTest(t.kind, t.amplitude, t.frequency, t.cycles, t.signal, value)
        for t in tests
        for value in (values if t.signal == "constant" else values[:1])
    ]
    seconds = sum(test.seconds for test in every)
    fast_enough = [r for r in RATES if r * seconds <= MOST_SAMPLES]
    return LaboratoryCampaign(tuple(every), values, float(rng.choice(fast_enough or RATES[:1])))


# --- The motion of a test, and the heat of all of them ---


REST = 0.3
"""Rest of the actuator before it starts [s]."""
COOLING = 120.0
"""Time constant with which the damper loses its heat to the stand [s]."""
PAUSE = 20.0
"""Between two tests [s]."""


@dataclass(frozen=True)
class Actuator:
    """How the position follows its demand."""

    natural_frequency: float
    """Of the closed loop [Hz]."""
    damping_ratio: float
    """Of the closed loop: below 0.7 it overshoots."""
    even: float
    """Second power of the characteristic, as a share at full stroke."""
    odd: float
    """Third power, likewise."""
    wander: float
    """How far the middle of the motion moves during a test, as a share of its amplitude."""

    @classmethod
    def drawn(cls, rng: Generator) -> Actuator:
        """Draw one as laboratories have them."""
        return cls(
            natural_frequency=float(rng.uniform(12.0, 40.0)),
            damping_ratio=float(rng.uniform(0.35, 0.9)),
            even=float(rng.normal(0.0, 0.004)),
            odd=float(rng.normal(0.0, 0.008)),
            wander=float(rng.normal(0.0, 0.004)),
        )


@dataclass(frozen=True, eq=False)
class Driven:
    """The motion and the control signal of one test on a fine grid; every array is (2 n + 1,)."""

    test: LaboratoryTest
    time: Array
    """From the beginning of the recording [s]; before it below 0."""
    displacement: Array
    """From the middle of the stroke [m]."""
    velocity: Array
    acceleration: Array
    signal: Array
    """The control signal [V]."""
    steps_per_sample: int
    """Steps of the integration from one recorded sample to the next."""

    @property
    def kinematics(self) -> tuple[Array, Array, Array]:
        """Displacement [m], velocity [m/s] and acceleration [m/s2]."""
        return self.displacement, self.velocity, self.acceleration

    @property
    def recorded(self) -> Rows:
        """(m,) indices of the fine grid at which the logger samples."""
        every = 2 * self.steps_per_sample
        first = int(np.argmin(np.abs(self.time)))
        return np.arange(first, self.time.size, every)


def driven(
    campaign: LaboratoryCampaign, test: LaboratoryTest, actuator: Actuator, rng: Generator, coarse: bool = False
) -> Driven:
    """Compute the motion of a test on the fine grid.

    Parameters
    ----------
    campaign : which it is of
    test : the demand
    actuator : how the demand is followed
    rng : phases of tones and of a random motion
    coarse : steps four times as long, for a first look
    """
    step = 1.0 / campaign.rate
    per_sample = int(np.ceil(step / (campaign.step * (4.0 if coarse else 1.0))))
    half = 0.5 * step / per_sample
    before = round((REST + _run_in(test)) / step) * per_sample * 2
    after = round(test.seconds / step) * per_sample * 2
    time = np.asarray(np.arange(-before, after + 1) * half, dtype=np.float64)
    demand = _demand(test, time, rng)
    begun = np.clip((time - time[0] - REST) / (0.6 * _run_in(test)), 0.0, 1.0)
    demand *= begun * begun * (3.0 - 2.0 * begun)
    x = _followed(demand, half, actuator)
    share = x / test.amplitude
    x = x * (1.0 + actuator.even * share + actuator.odd * share**2)
    x = x + actuator.wander * test.amplitude * np.clip(time, 0.0, None) / test.seconds
    velocity = np.gradient(x, half)
    return Driven(test, time, x, velocity, np.gradient(velocity, half), _signal(campaign, test, time), per_sample)


def _run_in(test: LaboratoryTest) -> float:
    """Return the time between rest and recording [s]."""
    return 1.0 if test.kind in ("sweep", "random") else max(1.0, 1.5 / test.frequency)


def _demand(test: LaboratoryTest, time: Array, rng: Generator) -> Array:
    """Return the (n,) displacement that the actuator is asked for [m]."""
    phase = 2.0 * np.pi * test.frequency * time
    if test.kind == "sine":
        return np.asarray(test.amplitude * np.sin(phase))
    if test.kind == "triangle":
        return np.asarray(test.amplitude * 2.0 / np.pi * np.arcsin(np.sin(phase)))
    if test.kind == "two_tone":
        second = np.sin(3.0 * phase + rng.uniform(0.0, 2.0 * np.pi))
        return np.asarray(test.amplitude * (0.7 * np.sin(phase) + 0.3 * second))
    if test.kind == "sweep":
        return test.amplitude * _swept(test, time)
    frequencies = np.arange(0.2, 3.0 * test.frequency, 0.07)
    strength = 1.0 / (1.0 + (frequencies / test.frequency) ** 4)
    phases = rng.uniform(0.0, 2.0 * np.pi, frequencies.size)
    summed = np.zeros_like(time)
    for frequency, size, start in zip(frequencies, strength, phases, strict=True):
        summed += size * np.sin(2.0 * np.pi * frequency * time + start)
    return np.asarray(test.amplitude * summed / np.max(np.abs(summed)))


def _swept(test: LaboratoryTest, time: Array) -> Array:
    """Return an (n,) logarithmic sweep whose amplitude falls with the root of its frequency, led in by a sine."""
    lowest = 0.5
    ratio = np.log(test.frequency / lowest)
    share = np.clip(time, 0.0, test.seconds) / test.seconds
    turns = lowest * (test.seconds / ratio * np.expm1(ratio * share) + np.clip(time, None, 0.0))
    return np.asarray(np.exp(-0.5 * ratio * share) * np.sin(2.0 * np.pi * turns))


def _followed(demand: Array, step: float, actuator: Actuator) -> Array:
    """Return the (n,) response of a loop of second order to a demand."""
    from scipy.signal import bilinear, lfilter

    omega = 2.0 * np.pi * actuator.natural_frequency
    b, a = bilinear([omega**2], [1.0, 2.0 * actuator.damping_ratio * omega, omega**2], 1.0 / step)
    return np.asarray(lfilter(b, a, demand))


def _signal(campaign: LaboratoryCampaign, test: LaboratoryTest, time: Array) -> Array:
    """Return the (n,) control signal of a test [V]."""
    low, high = campaign.values[0], campaign.values[-1]
    if test.signal == "constant":
        return np.full_like(time, test.value)
    if test.signal == "ramp":
        return np.asarray(low + (high - low) * np.clip(time / test.seconds, 0.0, 1.0))
    levels = np.array([low, high, 0.5 * (low + high), high, low])
    dwell = 0.37  # no multiple of a period, so that the steps fall into every phase of the motion
    at = (np.clip(time, 0.0, None) / dwell).astype(int) % levels.size
    return np.asarray(levels[at])


def warmed(motions: Sequence[Driven], forces: Sequence[Array], start: float, capacity: float) -> list[Array]:
    """Compute the temperature of the damper over the tests, one after the other.

    Equation: c dT/dt = F v - c (T - T_start)/t_c

    Parameters
    ----------
    motions : every test
    forces : of each, at every second instant of its fine grid [N]
    start : temperature of the room [degC]
    capacity : heat that warms the damper by a kelvin [J/K]

    Returns
    -------
    of each test, (2 n + 1,) [degC]
    """
    above, temperatures = 0.0, []  # kelvin above the room, as a test begins
    for motion, force in zip(motions, forces, strict=True):
        time = motion.time[::2]
        power = np.clip(force * motion.velocity[::2], 0.0, None)
        growth = np.exp((time - time[0]) / COOLING)
        step = time[1] - time[0]
        heat = np.concatenate([[0.0], np.cumsum(0.5 * step * (power[1:] * growth[1:] + power[:-1] * growth[:-1]))])
        excess = (above + heat / capacity) / growth
        temperatures.append(np.interp(motion.time, time, start + excess))
        above = float(excess[-1]) * float(np.exp(-PAUSE / COOLING))
    return temperatures


# --- The measuring chain ---


SPECTRUM = (
    (1.0, 2.6e-5),
    (2.1, 1.0e-5),
    (4.2, 4.6e-6),
    (8.5, 1.1e-6),
    (17.0, 6.0e-7),
    (35.0, 1.2e-6),
    (70.0, 1.8e-7),
    (140.0, 5.3e-8),
    (320.0, 2.9e-8),
)
"""Frequency [Hz], and spectral density of a measured force between the harmonics of its motion, over the square of its
peak [1/Hz]: medians in octaves over 17 tests of a magneto-rheological damper on a press (Quiroz 2022, UTFSM). About
1 % of the peak in all."""


@dataclass(frozen=True)
class Chain:
    """The measuring chain of a case."""

    white: float
    """White noise of the force, as a share of the largest force of the case."""
    recorded: float
    """Noise of the recorded spectrum, as a share of that of the press."""
    hum: float
    """Amplitude at the mains frequency, as a share of the largest force of the case."""
    mains: float
    """Mains frequency [Hz]."""
    displacement_noise: float
    """[m]"""
    displacement_zero: float
    """Reading of the displacement in the middle of the stroke [m]."""
    force_step: float
    """[N]"""
    displacement_step: float
    """[m]"""
    clock: float
    """Time stamps are multiples of this [s]."""

    @classmethod
    def drawn(cls, rng: Generator, peak: float, stroke: float, rate: float) -> Chain:
        """Draw one as laboratories have them."""
        return cls(
            white=float(np.exp(rng.uniform(np.log(3e-4), np.log(3e-3)))),
            recorded=float(rng.uniform(0.1, 0.8)),
            hum=float(rng.choice([0.0, 0.5e-3, 2e-3])),
            mains=float(rng.choice([50.0, 60.0]) + rng.normal(0.0, 0.02)),
            displacement_noise=float(np.exp(rng.uniform(np.log(1e-6), np.log(2e-5)))),
            displacement_zero=float(rng.choice([0.0, 1.0]) * rng.normal(0.0, 0.3)) * stroke,
            force_step=2.5 * peak / 2 ** int(rng.choice([12, 14, 16])),
            displacement_step=float(rng.choice([1e-6, 2e-6, 5e-6])),
            clock=float(rng.choice([c for c in (1e-6, 1e-5, 1e-4) if c <= 0.25 / rate])),
        )


@dataclass(frozen=True)
class ErrorsOfTest:
    """What differs from test to test, within the standard deviations that `diagnose.nuisance` assumes."""

    gain: float
    offset: float
    """[N]"""
    drift: float
    """Of the force from the beginning to the end [N]."""
    delay: float
    """[s]"""
    position: float
    """Displacement at rest [m]."""

    @classmethod
    def drawn(cls, rng: Generator, peak: float) -> ErrorsOfTest:
        """Draw those of one test whose largest force is the peak [N]."""
        return cls(
            gain=float(np.clip(rng.normal(0.0, 0.01), -0.025, 0.025)),
            offset=float(np.clip(rng.normal(0.0, 0.003), -0.008, 0.008)) * peak,
            drift=float(np.clip(rng.normal(0.0, 0.002), -0.005, 0.005)) * peak,
            delay=float(np.clip(rng.normal(0.0, 2e-4), -5e-4, 5e-4)),
            position=float(rng.normal(0.0, 2e-5)),
        )


def sensed_force(time: Array, force: Array, peak: float, chain: Chain, errors: ErrorsOfTest, rng: Generator) -> Array:
    """Return the (n,) reading of the force channel [N].

    Parameters
    ----------
    time : (n,) [s]
    force : (n,) of the damper [N]
    peak : largest force of the case [N]
    chain : of the case
    errors : of the test
    rng : of the noise
    """
    own = float(np.max(np.abs(force)))
    reading = (1.0 + errors.gain) * np.interp(time - errors.delay, time, force) + errors.offset
    reading = reading + errors.drift * (time - time[0]) / (time[-1] - time[0])
    phase = 2.0 * np.pi * chain.mains * time + rng.uniform(0.0, 2.0 * np.pi)
    reading = reading + chain.hum * peak * (np.sin(phase) + 0.3 * np.sin(3.0 * phase))
    reading = reading + chain.white * peak * rng.normal(size=time.size)
    reading = reading + chain.recorded * own * coloured(time.size, float(time[1] - time[0]), rng)
    return np.asarray(np.round(reading / chain.force_step) * chain.force_step)


def coloured(count: int, step: float, rng: Generator) -> Array:
    """Draw (n,) noise of the recorded spectrum, of a force whose peak is 1; below 1 Hz as at 1 Hz.

    Parameters
    ----------
    count : n
    step : sampling interval [s]
    rng : of the noise
    """
    length = 2 * count  # twice as long, so that its end does not run into its beginning
    frequency = np.fft.rfftfreq(length, step)
    known, density = np.array(SPECTRUM).T
    wanted = np.exp(np.interp(np.log(np.maximum(frequency, known[0])), np.log(known), np.log(density)))
    white = np.fft.rfft(rng.normal(size=length))
    return np.asarray(np.fft.irfft(white * np.sqrt(wanted / (2.0 * step)), length)[:count])


def sensed_displacement(time: Array, x: Array, chain: Chain, errors: ErrorsOfTest, rng: Generator) -> Array:
    """Return the (n,) reading of the displacement channel [m]; `x` (n,) counts from the middle of the stroke."""
    reading = x + chain.displacement_zero + errors.position + chain.displacement_noise * rng.normal(size=time.size)
    return np.asarray(np.round(reading / chain.displacement_step) * chain.displacement_step)


def stamped(time: Array, chain: Chain) -> Array:
    """Return the (n,) time stamps of a coarse clock [s]."""
    return np.asarray(np.round(time / chain.clock) * chain.clock)
