"""The stand: an actuator that does not quite follow, a control signal, an oil that warms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from pzd.blind.independent.campaigns import LaboratoryCampaign, LaboratoryTest
from pzd.record import Array, Rows

FINEST = 1.25e-4
"""Longest step of the integration [s]: `tests/blind` shows what it costs."""
REST = 0.3
"""The actuator stands still for so long before it starts [s]."""
COOLING = 120.0
"""Time constant with which the damper loses its heat to the stand [s]."""
PAUSE = 20.0
"""Between two tests [s]."""


@dataclass(frozen=True)
class Actuator:
    """How the position follows what is asked for."""

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
    def drawn(cls, draw: Generator) -> Actuator:
        """One as they stand in laboratories."""
        return cls(
            natural_frequency=float(draw.uniform(12.0, 40.0)),
            damping_ratio=float(draw.uniform(0.35, 0.9)),
            even=float(draw.normal(0.0, 0.004)),
            odd=float(draw.normal(0.0, 0.008)),
            wander=float(draw.normal(0.0, 0.004)),
        )


@dataclass(frozen=True, eq=False)
class Driven:
    """What one test does to the damper, on the fine grid; every array is (2 n + 1,)."""

    test: LaboratoryTest
    time: Array
    """From the beginning of the recording [s]; before it below 0."""
    displacement: Array
    """From the middle of the stroke [m]."""
    velocity: Array
    acceleration: Array
    signal: Array
    """The control signal [V]."""
    thinned: int
    """Steps of the integration from one recorded sample to the next."""

    @property
    def recorded(self) -> Rows:
        """(m,) indices of the fine grid at which the logger samples."""
        every = 2 * self.thinned
        first = int(np.argmin(np.abs(self.time)))
        return np.arange(first, self.time.size, every)


def driven(
    campaign: LaboratoryCampaign, test: LaboratoryTest, actuator: Actuator, draw: Generator, coarse: bool = False
) -> Driven:
    """The motion of a test on the fine grid.

    Parameters
    ----------
    campaign : which it is of
    test : what is asked for
    actuator : how it is followed
    draw : phases of tones and of a random motion
    coarse : steps four times as long, for a first look
    """
    step = 1.0 / campaign.rate
    thinned = int(np.ceil(step / (FINEST * (4.0 if coarse else 1.0))))
    half = 0.5 * step / thinned
    before = round((REST + _run_in(test)) / step) * thinned * 2
    after = round(test.seconds / step) * thinned * 2
    time = np.asarray(np.arange(-before, after + 1) * half, dtype=np.float64)
    asked = _asked(test, time, draw)
    begun = np.clip((time - time[0] - REST) / (0.6 * _run_in(test)), 0.0, 1.0)
    asked *= begun * begun * (3.0 - 2.0 * begun)
    x = _followed(asked, half, actuator)
    share = x / test.amplitude
    x = x * (1.0 + actuator.even * share + actuator.odd * share**2)
    x = x + actuator.wander * test.amplitude * np.clip(time, 0.0, None) / test.seconds
    velocity = np.gradient(x, half)
    return Driven(test, time, x, velocity, np.gradient(velocity, half), _signal(campaign, test, time), thinned)


def _run_in(test: LaboratoryTest) -> float:
    """Seconds between rest and recording."""
    return 1.0 if test.kind in ("sweep", "random") else max(1.0, 1.5 / test.frequency)


def _asked(test: LaboratoryTest, time: Array, draw: Generator) -> Array:
    phase = 2.0 * np.pi * test.frequency * time
    if test.kind == "sine":
        return np.asarray(test.amplitude * np.sin(phase))
    if test.kind == "triangle":
        return np.asarray(test.amplitude * 2.0 / np.pi * np.arcsin(np.sin(phase)))
    if test.kind == "two_tone":
        second = np.sin(3.0 * phase + draw.uniform(0.0, 2.0 * np.pi))
        return np.asarray(test.amplitude * (0.7 * np.sin(phase) + 0.3 * second))
    if test.kind == "sweep":
        return test.amplitude * _swept(test, time)
    frequencies = np.arange(0.2, 3.0 * test.frequency, 0.07)
    strength = 1.0 / (1.0 + (frequencies / test.frequency) ** 4)
    phases = draw.uniform(0.0, 2.0 * np.pi, frequencies.size)
    summed = np.zeros_like(time)
    for frequency, size, start in zip(frequencies, strength, phases, strict=True):
        summed += size * np.sin(2.0 * np.pi * frequency * time + start)
    return np.asarray(test.amplitude * summed / np.max(np.abs(summed)))


def _swept(test: LaboratoryTest, time: Array) -> Array:
    """(n,) logarithmic sweep whose amplitude falls with the root of the frequency; before it a sine of the lowest."""
    lowest = 0.5
    ratio = np.log(test.frequency / lowest)
    share = np.clip(time, 0.0, test.seconds) / test.seconds
    turns = lowest * (test.seconds / ratio * np.expm1(ratio * share) + np.clip(time, None, 0.0))
    return np.asarray(np.exp(-0.5 * ratio * share) * np.sin(2.0 * np.pi * turns))


def _followed(asked: Array, step: float, actuator: Actuator) -> Array:
    """(n,) what a loop of second order makes of what is asked for."""
    from scipy.signal import bilinear, lfilter

    omega = 2.0 * np.pi * actuator.natural_frequency
    b, a = bilinear([omega**2], [1.0, 2.0 * actuator.damping_ratio * omega, omega**2], 1.0 / step)
    return np.asarray(lfilter(b, a, asked))


def _signal(campaign: LaboratoryCampaign, test: LaboratoryTest, time: Array) -> Array:
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
    """Temperatures of the damper over the tests, one after the other.

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
    above, found = 0.0, []
    for motion, force in zip(motions, forces, strict=True):
        time = motion.time[::2]
        power = np.clip(force * motion.velocity[::2], 0.0, None)
        growth = np.exp((time - time[0]) / COOLING)
        step = time[1] - time[0]
        heat = np.concatenate([[0.0], np.cumsum(0.5 * step * (power[1:] * growth[1:] + power[:-1] * growth[:-1]))])
        excess = (above + heat / capacity) / growth
        found.append(np.interp(motion.time, time, start + excess))
        above = float(excess[-1]) * float(np.exp(-PAUSE / COOLING))
    return found
