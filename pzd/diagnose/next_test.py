"""The rig test that would separate rivals best, from the dampers fitted to them, within what the stand can do."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pzd.artefacts import NextTest
from pzd.damper.compose import respond
from pzd.damper.effect import Scales
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.record import Array
from pzd.rig.config import Limits

FREQUENCIES = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)
"""Frequencies that are weighed [Hz]."""
STROKES = (0.15, 0.3, 0.6, 1.0)
"""Amplitudes that are weighed, as shares of the largest."""
POINTS = 400
"""Samples of a cycle."""
CYCLES = 2
"""Simulated, the last compared."""
STEPS_HZ = 4.0
"""Changes of the voltage in the test that steps it, for each cycle."""


@dataclass(frozen=True)
class Reach:
    """What the stand can do."""

    amplitude: float
    """Largest amplitude [m]."""
    speed: float
    """Largest speed [m/s]."""
    frequency: float
    """Largest frequency [Hz]."""
    force: float
    """Largest force [N]."""
    voltages: tuple[float, ...]
    """Voltages to choose from [V]; empty without a control signal."""


def reach_of(limits: Limits, scales: Scales, voltages: Sequence[float]) -> Reach:
    """What the stand can do: the config's limits, and where it gives none, what the records reached.

    Parameters
    ----------
    limits : of the config
    scales : of what the records reached; the frequency is taken as twice speed over stroke
    voltages : of the damper's base rows [V]
    """
    low, high = limits.voltage_V or (-np.inf, np.inf)
    return Reach(
        scales.stroke if limits.stroke_m is None else 0.5 * limits.stroke_m,
        limits.speed_m_per_s or scales.speed,
        limits.frequency_Hz or 2.0 * scales.speed / scales.stroke / (2.0 * np.pi),
        limits.force_N or np.inf,
        tuple(v for v in voltages if low <= v <= high),
    )


def next_test(rivals: Sequence[tuple[str, Damper]], reach: Reach, temperature: float | None) -> NextTest | None:
    """The test on which the rivals differ most, an offset, a gain and a delay of the test taken off.

    Parameters
    ----------
    rivals : name and fitted damper, the best first; it is told apart from each of the others
    reach : what the stand can do
    temperature : at which the test is run [degC]

    Returns
    -------
    the test, with the r.m.s. difference that it would show in % of peak; None without two rivals
    """
    if len(rivals) < 2:
        return None
    best: tuple[float, NextTest] | None = None
    for plan, motion in _plans(reach, temperature):
        forces = [respond(damper, motion)[-POINTS:] for _, damper in rivals]
        if np.max(np.abs(forces)) > reach.force:  # any of them may be the truth
            continue
        distance = min(_distance(forces[0], other) for other in forces[1:])
        if best is None or distance > best[0]:
            best = distance, plan
    if best is None:
        return None
    names = tuple(name for name, _ in rivals)
    return best[1].model_copy(update={"separates": names, "distance_percent": round(100.0 * best[0], 3)})


def _plans(reach: Reach, temperature: float | None) -> Iterator[tuple[NextTest, Motion]]:
    shapes: tuple[tuple[str, Callable[[Array], Array], float], ...] = (
        ("sine", _sine, 1.0),
        ("triangle", _triangle, 3.0),
    )
    voltages: list[float | tuple[float, ...] | None] = [*reach.voltages] or [None]
    if len(reach.voltages) > 1:
        voltages.append((reach.voltages[0], reach.voltages[-1]))
    for (name, shape, harmonic), f, share, voltage in itertools.product(shapes, FREQUENCIES, STROKES, voltages):
        amplitude = min(share * reach.amplitude, reach.speed / (2.0 * np.pi * f))
        if harmonic * f > reach.frequency or amplitude < 0.02 * reach.amplitude:
            continue
        stepped = isinstance(voltage, tuple)
        plan = NextTest(
            waveform=f"{name}, voltage stepped" if stepped else name,
            frequency_Hz=f,
            amplitude_m=float(f"{amplitude:.3g}"),
            voltage_V=voltage,
            separates=(),
        )
        yield plan, _motion(shape, f, amplitude, voltage, temperature)


def _motion(
    shape: Callable[[Array], Array],
    frequency: float,
    amplitude: float,
    voltage: float | tuple[float, ...] | None,
    temperature: float | None,
) -> Motion:
    time = np.arange(CYCLES * POINTS) / (POINTS * frequency)
    phase = frequency * time
    cycle = amplitude * shape(phase[:POINTS])
    spectrum = np.fft.rfft(cycle)
    rate = 2j * np.pi * frequency * np.arange(spectrum.size)
    channels = [np.tile(np.fft.irfft(spectrum * rate**order, POINTS), CYCLES) for order in range(3)]
    signal = None
    if isinstance(voltage, tuple):
        signal = np.where((STEPS_HZ * phase) % 2.0 < 1.0, voltage[0], voltage[1])
    elif voltage is not None:
        signal = np.full(time.size, voltage)
    warmth = None if temperature is None else np.full(time.size, temperature)
    return Motion(time, channels[0], channels[1], channels[2], signal, warmth)


def _sine(phase: Array) -> Array:
    return np.asarray(np.sin(2.0 * np.pi * phase))


def _triangle(phase: Array) -> Array:
    """Constant speed, its corners rounded by leaving out harmonics beyond the ninth, as a servo-hydraulic does."""
    orders = np.arange(1, 10, 2)
    terms = (-1.0) ** (orders // 2) / orders**2 * np.sin(2.0 * np.pi * np.outer(phase, orders))
    return np.asarray(8.0 / np.pi**2 * terms.sum(axis=1))


def _distance(first: Array, second: Array) -> float:
    """R.m.s. of what offset, gain and delay of a test cannot make of the difference, as a share of the peak."""
    slack = np.column_stack([np.ones(first.size), first, np.gradient(first)])
    difference = second - first
    left = difference - slack @ np.linalg.lstsq(slack, difference, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)) / np.max(np.abs(first)))
