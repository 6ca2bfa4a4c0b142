"""The rig test that would separate rivals best, from the dampers fitted to them, within what the stand can do."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pzd.artefacts import NextTest
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cross_validation import Missed, Trials
from pzd.diagnosis.data import Prepared
from pzd.record import Array, Record
from pzd.rig.config import Limits
from pzd.signals.measures import rms

# ----------------------------------------------------------------------------------------------------


FREQUENCIES = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)
"""Frequencies that are weighed [Hz], and the largest."""
STROKES = (0.15, 0.3, 0.6, 1.0)
"""Amplitudes that are weighed, as shares of the largest."""
POINTS = 400
"""Samples of a cycle."""
CYCLES = 2
"""Simulated, the last compared."""
MANY_CYCLES = "ten"
"""Of a test: noise is told from what repeats, and a quarter of the cycles chooses, another is held out."""
STEPS_HZ = 4.0
"""Changes of the voltage in the test that steps it, for each cycle."""
LEAST = 0.02
"""A test of less amplitude than this share of the largest is not weighed: the resolution of the stroke shows in it."""
ROUND_OFF = 1e-12
"""Relative error of a difference of two displacements in double precision, with room."""
MEASURED = 1e-3
"""Relative error of a stroke or frequency as recorded: a sine of 10 mm sampled 100 times a cycle reaches 9.995 mm."""


@dataclass(frozen=True)
class Reach:
    """What a test may reach."""

    middle: float
    """Where the motion has its middle, in the displacement as recorded [m]."""
    amplitude: float
    """Largest amplitude about it [m]."""
    speed: float
    """Largest speed [m/s]."""
    frequency: float
    """Largest frequency [Hz]."""
    force: tuple[float, float]
    """Smallest and largest force [N]."""
    voltages: tuple[float, ...] = ()
    """Voltages to choose from [V]; empty without a control signal."""


def reach_of(limits: Limits, prepared: Sequence[Prepared], voltages: Sequence[float]) -> Reach:
    """What a test may reach: the config's limits, and where it gives none, what the records of this setting reached.

    Parameters
    ----------
    limits : of the config; a stroke is about the middle of what was recorded
    prepared : the records of the setting
    voltages : of the damper's base rows [V]
    """
    records = [p.record for p in prepared]
    lowest, highest = _range([r.displacement for r in records])
    force = _range([r.force for r in records])
    amplitude = 0.5 * (highest - lowest) if limits.stroke_m is None else 0.5 * limits.stroke_m
    middle = _tidy(0.5 * (lowest + highest), amplitude)
    if limits.stroke_m is None:
        amplitude = (1.0 + MEASURED) * min(highest - middle, middle - lowest)
    return Reach(
        middle,
        amplitude,
        limits.speed_m_per_s or (1.0 + MEASURED) * max(float(np.max(np.abs(r.velocity))) for r in records),
        limits.frequency_Hz or (1.0 + MEASURED) * max(frequency_of(p) for p in prepared),
        force if limits.force_N is None else (-limits.force_N, limits.force_N),
        _within(limits.voltage_V or _recorded_voltages(records), voltages),
    )


def _range(channels: Sequence[Array]) -> tuple[float, float]:
    return min(float(np.min(c)) for c in channels), max(float(np.max(c)) for c in channels)


def _tidy(middle: float, amplitude: float) -> float:
    """A middle that can be set: to a digit that is a hundredth of the amplitude's first digit or less."""
    return round(middle, 3 - math.floor(math.log10(amplitude))) + 0.0  # no minus before a zero


def frequency_of(prepared: Prepared) -> float:
    """Frequency of a record [Hz]; where it does not repeat, that of a sine with its stroke and speed."""
    if prepared.cycles is not None:
        return 1.0 / prepared.cycles.period
    record = prepared.record
    return float(np.max(np.abs(record.velocity)) / (np.pi * np.ptp(record.displacement)))


def _recorded_voltages(records: Sequence[Record]) -> tuple[float, float]:
    channels = [r.voltage for r in records if r.voltage is not None]
    return _range(channels) if channels else (-np.inf, np.inf)


def _within(limits: tuple[float, float], voltages: Sequence[float]) -> tuple[float, ...]:
    """The voltages inside the limits; the ends of the limits stand for those beyond."""
    low, high = limits
    return tuple(sorted({min(max(v, low), high) for v in voltages}))


def next_test(
    rivals: Sequence[tuple[str, Damper]], reach: Reach, temperature: float | None, offsets: Sequence[float] = ()
) -> NextTest | None:
    """The test on which the rivals differ most, an offset, a gain and a delay of the test taken off.

    Parameters
    ----------
    rivals : name and fitted damper, the best first; it is told apart from each of the others
    reach : what a test may reach; a test in which any rival would reach more is left out, for any may be the truth
    temperature : at which the test is run [degC]
    offsets : by which the records lie above each rival's force [N]; none by default

    Returns
    -------
    the test, with the r.m.s. difference that it would show in % of peak, and the largest speed and force;
    None without two rivals, or where each test would reach too much
    """
    if len(rivals) < 2:
        return None
    best: tuple[float, NextTest] | None = None
    above = np.array([*offsets] or [0.0] * len(rivals))[:, None]
    for plan, motion in _plans(reach, temperature):
        forces = np.stack([respond(damper, motion) for _, damper in rivals]) + above
        if np.min(forces) < reach.force[0] or np.max(forces) > reach.force[1]:
            continue
        last = forces[:, -POINTS:]
        distance = min(_distance(last[0], other) for other in last[1:])
        if best is None or distance > best[0]:
            reached = {
                "peak_speed_m_per_s": float(np.max(np.abs(motion.velocity))),
                "peak_force_N": float(np.max(np.abs(forces))),
            }
            best = distance, plan.model_copy(update=reached)
    if best is None:
        return None
    names = tuple(name for name, _ in rivals)
    return best[1].model_copy(update={"separates": names, "distance_percent": round(100.0 * best[0], 3)})


def one_more(recorded: Sequence[Prepared], reach: Reach) -> NextTest:
    """A sine of many cycles as fast as the stand can, with the stroke of the longest record: one more test to average.

    Parameters
    ----------
    recorded : the records, their displacement as recorded
    reach : what a test may reach
    """
    record = max(recorded, key=lambda p: float(np.ptp(p.record.time))).record
    amplitude = min(0.5 * float(np.ptp(record.displacement)), reach.amplitude)
    frequency = rounded_down(min(reach.frequency, reach.speed / (2.0 * np.pi * amplitude)))
    return NextTest(
        waveform=f"sine, {MANY_CYCLES} cycles",
        frequency_Hz=frequency,
        amplitude_m=rounded_down(amplitude),
        middle_m=reach.middle,
        voltage_V=record.median_voltage(),
        separates=(),
        peak_speed_m_per_s=float(2.0 * np.pi * frequency * rounded_down(amplitude)),
    )


def _plans(reach: Reach, temperature: float | None) -> Iterator[tuple[NextTest, Motion]]:
    shapes: tuple[tuple[str, Callable[[Array], Array], float], ...] = (
        ("sine", sine, 1.0),
        ("triangle", _triangle, 3.0),
    )
    voltages: list[float | tuple[float, ...] | None] = [*reach.voltages] or [None]
    if len(reach.voltages) > 1:
        voltages.append((reach.voltages[0], reach.voltages[-1]))
    frequencies = sorted({*(f for f in FREQUENCIES if f < reach.frequency), rounded_down(reach.frequency)})
    for (name, shape, harmonic), f, share, voltage in itertools.product(shapes, frequencies, STROKES, voltages):
        amplitude = rounded_down(min(share * reach.amplitude, reach.speed / (2.0 * np.pi * f)))
        if harmonic * f > reach.frequency or amplitude < LEAST * reach.amplitude:
            continue
        stepped = isinstance(voltage, tuple)
        plan = NextTest(
            waveform=f"{name}, voltage stepped" if stepped else name,
            frequency_Hz=f,
            amplitude_m=amplitude,
            middle_m=reach.middle,
            voltage_V=voltage,
            separates=(),
        )
        motion = motion_of(shape, f, amplitude, voltage, temperature)
        yield plan, replace(motion, displacement=reach.middle + motion.displacement)


def rounded_down(value: float, error: float = ROUND_OFF) -> float:
    """A positive number to three digits, never above it by more than its relative error.

    So 0.02 stays 0.02 though a difference gave 0.0199...9.
    """
    larger = value * (1.0 + error)
    digits = 2 - math.floor(math.log10(larger))
    return round(math.floor(larger * 10.0**digits) / 10.0**digits, max(digits, 0))


def motion_of(
    shape: Callable[[Array], Array],
    frequency: float,
    amplitude: float,
    voltage: float | tuple[float, ...] | None,
    temperature: float | None,
) -> Motion:
    """Two cycles of a test about zero, the voltage constant, stepped between two, or none.

    Parameters
    ----------
    shape : of a cycle of amplitude one, over the phase (n,) in cycles
    frequency : [Hz]
    amplitude : [m]
    voltage : one, or two between which it steps [V]
    temperature : [degC]
    """
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


def sine(phase: Array) -> Array:
    """A cycle of a sine of amplitude one over the phase (n,) in cycles."""
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
    return float(rms(left) / np.max(np.abs(first)))


# ----------------------------------------------------------------------------------------------------
# The rig test at a voltage between two tested ones, where the line between their parameters is known to miss most.
#
# T0, C and k are linear between voltages. A voltage left out of the fit shows by how much that line misses it: where that
# is visibly more than is missed of tests at that voltage, the force between voltages is what is known least.


@dataclass(frozen=True)
class PredictingDamper:
    """A damper that is handed on, and what it misses of tests that it has not seen."""

    damper: Damper
    """Its displacement as recorded."""
    offset: float
    """By which the records lie above its force [N]."""
    missed: Missed
    """Of tests that were kept back."""
    missed_between: Missed
    """Of voltages between others that were left out."""


def next_voltage(
    predicting: PredictingDamper,
    trials: Trials,
    recorded: Sequence[Prepared],
    reach: Reach,
    temperature: float | None,
) -> NextTest | None:
    """A sine half-way between two voltages, with the stroke and frequency of the test that the line misses most.

    Parameters
    ----------
    predicting : the damper that is handed on
    trials : the tests, dealt into folds
    recorded : the records of the setting, their displacement as recorded
    reach : what a test may reach
    temperature : at which the test is run [degC]

    Returns
    -------
    None where voltages left out are predicted as well as tests are, or the test would reach too much
    """
    group = _least_known(trials, predicting.missed, predicting.missed_between)
    if group is None:
        return None
    below, above = _widest_beside(trials, group)
    voltage = 0.5 * (below + above)
    if not reach.voltages[0] <= voltage <= reach.voltages[-1]:
        return None
    test = recorded[_most_missed(predicting.missed_between.of(trials.groups[group]))]
    half_stroke = 0.5 * float(np.ptp(test.record.displacement))
    amplitude = min(rounded_down(half_stroke, MEASURED), rounded_down(reach.amplitude))
    fastest = rounded_down(min(reach.frequency, reach.speed / (2.0 * np.pi * amplitude)))
    frequency = min(rounded_down(frequency_of(test), MEASURED), fastest)
    motion = motion_of(sine, frequency, amplitude, voltage, temperature)
    force = respond(predicting.damper, motion.centred_on(-reach.middle)) + predicting.offset
    if np.min(force) < reach.force[0] or np.max(force) > reach.force[1]:
        return None
    return NextTest(
        waveform="sine",
        frequency_Hz=frequency,
        amplitude_m=amplitude,
        middle_m=reach.middle,
        voltage_V=voltage,
        separates=(),
        between_voltage_V=(below, above),
        peak_speed_m_per_s=float(np.max(np.abs(motion.velocity))),
        peak_force_N=float(np.max(np.abs(force))),
    )


def _least_known(trials: Trials, missed: Missed, between: Missed) -> int | None:
    """Of the voltages that are predicted visibly worse left out than tests are, the one predicted worst."""
    pairs = [(i, missed.of(trials.groups[i]), between.of(trials.groups[i])) for i in trials.between()]
    worse = [(out.criterion or 0.0, i) for i, kept_back, out in pairs if kept_back.record and kept_back.less_than(out)]
    return max(worse)[1] if worse else None


def _widest_beside(trials: Trials, group: int) -> tuple[float, float]:
    """The wider of both steps from a voltage to its neighbours [V], the lower one where they are alike."""
    voltages = sorted(v for v in trials.voltages if v is not None)
    steps = [step for step in pairwise(voltages) if trials.voltages[group] in step]
    return max(steps, key=lambda step: step[1] - step[0])


def _most_missed(missed: Missed) -> int:
    """The record that is missed most, by its W_s."""
    return missed.record[int(np.argmax(missed.error / missed.energy))]
