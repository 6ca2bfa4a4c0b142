"""What the data logger has of a test: gains, offsets and their drift, noise, hum, a coarse clock and coarse numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from pzd.record import Array

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
    zero: float
    """What the displacement shows in the middle of the stroke [m]."""
    force_step: float
    """[N]"""
    displacement_step: float
    """[m]"""
    clock: float
    """Time stamps are multiples of this [s]."""

    @classmethod
    def drawn(cls, draw: Generator, peak: float, stroke: float, rate: float) -> Chain:
        """One as they stand in laboratories."""
        return cls(
            white=float(np.exp(draw.uniform(np.log(3e-4), np.log(3e-3)))),
            recorded=float(draw.uniform(0.1, 0.8)),
            hum=float(draw.choice([0.0, 0.5e-3, 2e-3])),
            mains=float(draw.choice([50.0, 60.0]) + draw.normal(0.0, 0.02)),
            displacement_noise=float(np.exp(draw.uniform(np.log(1e-6), np.log(2e-5)))),
            zero=float(draw.choice([0.0, 1.0]) * draw.normal(0.0, 0.3)) * stroke,
            force_step=2.5 * peak / 2 ** int(draw.choice([12, 14, 16])),
            displacement_step=float(draw.choice([1e-6, 2e-6, 5e-6])),
            clock=float(draw.choice([c for c in (1e-6, 1e-5, 1e-4) if c <= 0.25 / rate])),
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
    def drawn(cls, draw: Generator, peak: float) -> ErrorsOfTest:
        """Those of one test whose largest force is the peak [N]."""
        return cls(
            gain=float(np.clip(draw.normal(0.0, 0.01), -0.025, 0.025)),
            offset=float(np.clip(draw.normal(0.0, 0.003), -0.008, 0.008)) * peak,
            drift=float(np.clip(draw.normal(0.0, 0.002), -0.005, 0.005)) * peak,
            delay=float(np.clip(draw.normal(0.0, 2e-4), -5e-4, 5e-4)),
            position=float(draw.normal(0.0, 2e-5)),
        )


def sensed_force(time: Array, force: Array, peak: float, chain: Chain, errors: ErrorsOfTest, draw: Generator) -> Array:
    """(n,) what the force channel shows [N].

    Parameters
    ----------
    time : (n,) [s]
    force : (n,) of the damper [N]
    peak : largest force of the case [N]
    chain : of the case
    errors : of the test
    draw : of the noise
    """
    own = float(np.max(np.abs(force)))
    shown = (1.0 + errors.gain) * np.interp(time - errors.delay, time, force) + errors.offset
    shown = shown + errors.drift * (time - time[0]) / (time[-1] - time[0])
    phase = 2.0 * np.pi * chain.mains * time + draw.uniform(0.0, 2.0 * np.pi)
    shown = shown + chain.hum * peak * (np.sin(phase) + 0.3 * np.sin(3.0 * phase))
    shown = shown + chain.white * peak * draw.normal(size=time.size)
    shown = shown + chain.recorded * own * coloured(time.size, float(time[1] - time[0]), draw)
    return np.asarray(np.round(shown / chain.force_step) * chain.force_step)


def coloured(count: int, step: float, draw: Generator) -> Array:
    """(n,) noise of the recorded spectrum, of a force whose peak is 1; below 1 Hz as at 1 Hz.

    Parameters
    ----------
    count : n
    step : sampling interval [s]
    draw : of the noise
    """
    length = 2 * count  # twice as long, so that its end does not run into its beginning
    frequency = np.fft.rfftfreq(length, step)
    known, density = np.array(SPECTRUM).T
    wanted = np.exp(np.interp(np.log(np.maximum(frequency, known[0])), np.log(known), np.log(density)))
    white = np.fft.rfft(draw.normal(size=length))
    return np.asarray(np.fft.irfft(white * np.sqrt(wanted / (2.0 * step)), length)[:count])


def sensed_displacement(time: Array, x: Array, chain: Chain, errors: ErrorsOfTest, draw: Generator) -> Array:
    """(n,) what the displacement channel shows [m]; `x` (n,) counts from the middle of the stroke."""
    shown = x + chain.zero + errors.position + chain.displacement_noise * draw.normal(size=time.size)
    return np.asarray(np.round(shown / chain.displacement_step) * chain.displacement_step)


def stamped(time: Array, chain: Chain) -> Array:
    """(n,) time stamps as the clock gives them [s]."""
    return np.asarray(np.round(time / chain.clock) * chain.clock)
