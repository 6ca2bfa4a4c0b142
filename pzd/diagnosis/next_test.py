"""The next rig test: one that separates rivals, one more of the longest test, or one at a voltage between tested ones.

Every test lies within the operating envelope: what the stand can do, by the config's limits or the records.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pzd.artefacts import NextTest
from pzd.artefacts.diagnosis import CYCLES_IN_WORDS, CYCLES_OF_TEST, STEPS_PER_CYCLE
from pzd.artefacts.rig import same_motion
from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.cross_validation import CrossValidation
from pzd.fit.cross_validation import PredictionError
from pzd.record import Array
from pzd.rig.config import Limits
from pzd.signals.measures import rms

FREQUENCIES = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0)
"""Frequencies that are tried [Hz], beside the largest."""
STROKES = (0.15, 0.3, 0.6, 1.0)
"""Amplitudes that are tried, as shares of the largest."""
POINTS = 400
"""Samples of a cycle."""
CYCLES = 2
"""Cycles that are simulated; the last is compared."""
SMALLEST_AMPLITUDE = 0.02
"""Share of the largest amplitude below which no test is tried: the resolution of the stroke shows in it."""
ROUND_OFF = 1e-12
"""Relative error of a difference of two displacements in double precision, with room."""
RECORDED_ERROR = 1e-3
"""Relative error of a recorded stroke or frequency: a sine of 10 mm sampled 100 times a cycle reaches 9.995 mm."""


@dataclass(frozen=True)
class OperatingEnvelope:
    """Limits of a test."""

    middle: float
    """Middle of the motion, in the displacement as recorded [m]."""
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


def operating_envelope(
    limits: Limits, cleaned: Sequence[CleanedRecord], voltages: Sequence[float]
) -> OperatingEnvelope:
    """Return the limits of the config, and where it gives none, what the records of this setting reached.

    Parameters
    ----------
    limits : of the config; a stroke is about the middle of what was recorded
    cleaned : the records of the setting
    voltages : of the damper's base rows [V]
    """
    records = [p.record for p in cleaned]
    lowest, highest = _range([r.displacement for r in records])
    amplitude = 0.5 * (highest - lowest if limits.stroke_m is None else limits.stroke_m)
    # To a digit that can be set, a hundredth of the amplitude's first digit or less; + 0.0 leaves no minus before zero.
    middle = round(0.5 * (lowest + highest), 3 - math.floor(math.log10(amplitude))) + 0.0
    if limits.stroke_m is None:
        amplitude = (1.0 + RECORDED_ERROR) * min(highest - middle, middle - lowest)
    recorded = [r.voltage for r in records if r.voltage is not None]
    low, high = limits.voltage_V or (_range(recorded) if recorded else (-np.inf, np.inf))
    return OperatingEnvelope(
        middle,
        amplitude,
        limits.speed_m_per_s or (1.0 + RECORDED_ERROR) * max(float(np.max(np.abs(r.velocity))) for r in records),
        limits.frequency_Hz or (1.0 + RECORDED_ERROR) * max(frequency_of(p) for p in cleaned),
        _range([r.force for r in records]) if limits.force_N is None else (-limits.force_N, limits.force_N),
        tuple(sorted({min(max(v, low), high) for v in voltages})),
    )


def _range(channels: Sequence[Array]) -> tuple[float, float]:
    return min(float(np.min(c)) for c in channels), max(float(np.max(c)) for c in channels)


def frequency_of(cleaned: CleanedRecord) -> float:
    """Return the frequency of a record [Hz]; where it does not repeat, that of a sine with its stroke and speed."""
    if cleaned.cycles is not None:
        return 1.0 / cleaned.cycles.period
    record = cleaned.record
    return float(np.max(np.abs(record.velocity)) / (np.pi * np.ptp(record.displacement)))


def separating_test(
    rivals: Sequence[tuple[str, Damper]],
    envelope: OperatingEnvelope,
    temperature: float | None,
    offsets: Sequence[float] = (),
) -> NextTest | None:
    """Find the test on which the rivals differ most, offset, gain and delay of a test fitted.

    Parameters
    ----------
    rivals : name and fitted damper, the best first, which is separated from each of the others
    envelope : limits of a test; one in which any rival would leave them is not tried, for any may be the truth
    temperature : at which the test is run [degC]
    offsets : by which the records lie above each rival's force [N]; none by default

    Returns
    -------
    the test, with the r.m.s. difference that it would show in % of peak, and the largest speed and force;
    None without two rivals, or where each test would leave the limits
    """
    if len(rivals) < 2:
        return None
    best: tuple[float, NextTest] | None = None
    above = np.array([*offsets] or [0.0] * len(rivals))[:, None]
    for plan, motion in _candidate_tests(envelope, temperature):
        forces = np.stack([respond(damper, motion) for _, damper in rivals]) + above
        if np.min(forces) < envelope.force[0] or np.max(forces) > envelope.force[1]:
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


def repeated_longest_test(
    recorded: Sequence[CleanedRecord], envelope: OperatingEnvelope, moving: Sequence[str] = ()
) -> NextTest | None:
    """Propose one more test: a sine of many cycles as fast as the stand can, with the stroke of the longest record.

    Or of the next longest, where that was run already; at the control signal of that record.

    Parameters
    ----------
    recorded : records, their displacement as recorded
    envelope : limits of a test
    moving : effects that show where the control signal moves alone: it then steps between the outermost levels

    Returns
    -------
    None where all these were run
    """
    for each in sorted(recorded, key=lambda p: -float(np.ptp(p.record.time))):
        amplitude = min(0.5 * float(np.ptp(each.record.displacement)), envelope.amplitude)
        if amplitude < SMALLEST_AMPLITUDE * envelope.amplitude:
            continue
        frequency = rounded_down(min(envelope.frequency, envelope.speed / (2.0 * np.pi * amplitude)))
        voltage = each.record.median_voltage()
        stepped = bool(moving) and len(envelope.voltages) > 1
        if stepped or not any(_was_run(test, frequency, amplitude, voltage) for test in recorded):
            return NextTest(
                waveform="sine, voltage stepped" if stepped else f"sine, {CYCLES_IN_WORDS} cycles",
                frequency_Hz=frequency,
                amplitude_m=rounded_down(amplitude),
                middle_m=envelope.middle,
                voltage_V=(envelope.voltages[0], envelope.voltages[-1]) if stepped else voltage,
                separates=tuple(moving) if stepped else (),
                peak_speed_m_per_s=float(2.0 * np.pi * frequency * rounded_down(amplitude)),
            )
    return None


def _was_run(test: CleanedRecord, frequency: float, amplitude: float, voltage: float | None) -> bool:
    """Whether a test repeats a motion of that frequency [Hz] and amplitude [m] many times, at that control signal."""
    if test.cycles is None or test.cycles.count < CYCLES_OF_TEST or not test.constant:
        return False
    level = test.record.median_voltage()
    pairs = [(1.0 / test.cycles.period, frequency), (0.5 * float(np.ptp(test.record.displacement)), amplitude)]
    pairs += [(level, voltage)] if level is not None and voltage is not None else []
    return all(same_motion(one, other) for one, other in pairs)


def _candidate_tests(envelope: OperatingEnvelope, temperature: float | None) -> Iterator[tuple[NextTest, Motion]]:
    """Yield the tests within the envelope, each with its motion."""
    shapes: tuple[tuple[str, Callable[[Array], Array], float], ...] = (
        ("sine", sine, 1.0),
        ("triangle", _triangle, 3.0),
    )
    voltages: list[float | tuple[float, ...] | None] = [*envelope.voltages] or [None]
    if len(envelope.voltages) > 1:
        voltages.append((envelope.voltages[0], envelope.voltages[-1]))
    frequencies = sorted({*(f for f in FREQUENCIES if f < envelope.frequency), rounded_down(envelope.frequency)})
    for (name, shape, harmonic), f, share, voltage in itertools.product(shapes, frequencies, STROKES, voltages):
        amplitude = rounded_down(min(share * envelope.amplitude, envelope.speed / (2.0 * np.pi * f)))
        if harmonic * f > envelope.frequency or amplitude < SMALLEST_AMPLITUDE * envelope.amplitude:
            continue
        stepped = isinstance(voltage, tuple)
        plan = NextTest(
            waveform=f"{name}, voltage stepped" if stepped else name,
            frequency_Hz=f,
            amplitude_m=amplitude,
            middle_m=envelope.middle,
            voltage_V=voltage,
            separates=(),
        )
        motion = test_motion(shape, f, amplitude, voltage, temperature)
        yield plan, replace(motion, displacement=envelope.middle + motion.displacement)


def rounded_down(value: float, error: float = ROUND_OFF) -> float:
    """Round a positive number down to three digits, never above it by more than its relative error.

    So 0.02 stays 0.02 though a difference gave 0.0199...9.

    Examples
    --------
    >>> rounded_down(0.019999999999999997), rounded_down(1.2349)
    (0.02, 1.23)
    """
    larger = value * (1.0 + error)
    digits = 2 - math.floor(math.log10(larger))
    return round(math.floor(larger * 10.0**digits) / 10.0**digits, max(digits, 0))


def test_motion(
    shape: Callable[[Array], Array],
    frequency: float,
    amplitude: float,
    voltage: float | tuple[float, ...] | None,
    temperature: float | None,
) -> Motion:
    """Return two cycles of a test about zero, the voltage constant, stepped between two, or none.

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
        signal = np.where((STEPS_PER_CYCLE * phase) % 2.0 < 1.0, voltage[0], voltage[1])
    elif voltage is not None:
        signal = np.full(time.size, voltage)
    warm = None if temperature is None else np.full(time.size, temperature)
    return Motion(time, channels[0], channels[1], channels[2], signal, warm)


def sine(phase: Array) -> Array:
    """Return a sine of amplitude one over the phase (n,) in cycles."""
    return np.asarray(np.sin(2.0 * np.pi * phase))


def _triangle(phase: Array) -> Array:
    """Return a triangle of amplitude one, without harmonics beyond the ninth, as a servo-hydraulic rounds it."""
    orders = np.arange(1, 10, 2)
    terms = (-1.0) ** (orders // 2) / orders**2 * np.sin(2.0 * np.pi * np.outer(phase, orders))
    return np.asarray(8.0 / np.pi**2 * terms.sum(axis=1))


def _distance(first: Array, second: Array) -> float:
    """Compute the r.m.s. difference that offset, gain and delay of a test cannot explain, as a share of the peak."""
    slack = np.column_stack([np.ones(first.size), first, np.gradient(first)])
    difference = second - first
    left = difference - slack @ np.linalg.lstsq(slack, difference, rcond=None)[0]
    return float(rms(left) / np.max(np.abs(first)))


# --- Test at a voltage between two tested ones
#
# T0, C and k are linear between voltages. The interpolation error at a left-out voltage shows by how much: where it is
# visibly larger than the held-out error of tests at that voltage, the force between voltages is what is known least.


def intermediate_voltage_test(
    damper: Damper,
    offset: float,
    errors: tuple[PredictionError, PredictionError],
    validation: CrossValidation,
    recorded: Sequence[CleanedRecord],
    envelope: OperatingEnvelope,
    temperature: float | None,
) -> NextTest | None:
    """Propose a sine half-way between two voltages, with stroke and frequency of the test interpolated worst.

    Parameters
    ----------
    damper : adopted damper, its displacement as recorded
    offset : by which the records lie above its force [N]
    errors : held-out error and interpolation error of the damper
    validation : cross-validation of the tests
    recorded : records of the setting, their displacement as recorded
    envelope : operating envelope of a test
    temperature : at which the test is run [degC]

    Returns
    -------
    None where left-out voltages are predicted as well as tests are, or the test would leave the envelope
    """
    group = _worst_interpolated_group(validation, *errors)
    if group is None:
        return None
    below, above = _widest_step(validation, group)
    voltage = 0.5 * (below + above)
    if not envelope.voltages[0] <= voltage <= envelope.voltages[-1]:
        return None
    between = errors[1].of_records(validation.groups[group])
    test = recorded[between.records[int(np.argmax(between.error / between.energy))]]
    half_stroke = 0.5 * float(np.ptp(test.record.displacement))
    amplitude = min(rounded_down(half_stroke, RECORDED_ERROR), rounded_down(envelope.amplitude))
    fastest = rounded_down(min(envelope.frequency, envelope.speed / (2.0 * np.pi * amplitude)))
    frequency = min(rounded_down(frequency_of(test), RECORDED_ERROR), fastest)
    motion = test_motion(sine, frequency, amplitude, voltage, temperature)
    force = respond(damper, motion.centred_on(-envelope.middle)) + offset
    if np.min(force) < envelope.force[0] or np.max(force) > envelope.force[1]:
        return None
    return NextTest(
        waveform="sine",
        frequency_Hz=frequency,
        amplitude_m=amplitude,
        middle_m=envelope.middle,
        voltage_V=voltage,
        separates=(),
        between_voltage_V=(below, above),
        peak_speed_m_per_s=float(np.max(np.abs(motion.velocity))),
        peak_force_N=float(np.max(np.abs(force))),
    )


def _worst_interpolated_group(
    validation: CrossValidation, held_out: PredictionError, between: PredictionError
) -> int | None:
    """Return the voltage with the largest interpolation error, of those where it exceeds the held-out error visibly."""
    worse = []
    for i in validation.interior_groups():
        tested, interpolated = (each.of_records(validation.groups[i]) for each in (held_out, between))
        if tested.records and tested.visibly_below(interpolated):
            worse.append((interpolated.criterion or 0.0, i))
    return max(worse)[1] if worse else None


def _widest_step(validation: CrossValidation, group: int) -> tuple[float, float]:
    """Return the wider of both steps from a voltage to its neighbours [V], the lower one where they are alike."""
    voltages = sorted(v for v in validation.voltages if v is not None)
    steps = [step for step in pairwise(voltages) if validation.voltages[group] in step]
    return max(steps, key=lambda step: step[1] - step[0])
