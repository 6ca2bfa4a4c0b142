"""Tests of two states that are compared: averaged cycles at equal phase, or a test of the second state with a model.

Where one motion was run in both states, what no model explains stands on both sides and cancels in the difference of
the averaged cycles. Force and displacement are compared by their harmonics: another sampling rate and another
beginning of the cycle are a factor there, and the noise of neighbouring harmonics is independent.

A spectrum is (H + 1,) complex, the Fourier coefficients of one cycle; `stacked` turns it into (2 H + 1,) real numbers
whose sum of squares is the mean square of the force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pzd.damper.compose import respond
from pzd.damper.model import Damper
from pzd.damper.motion import Motion
from pzd.diagnosis.cleaned_records import CleanedRecord
from pzd.diagnosis.fit.prediction import simulated_record
from pzd.record import CONSTANT_SHARE, MAD_TO_SIGMA, Array, Complex, Mask, Record
from pzd.signals.harmonics import mains_harmonics
from pzd.signals.noise import PureError, pure_error

POINTS = 256
"""Points of a simulated cycle: with a parabola between them the force of a sine is exact to 1e-4 of its peak."""
SETTLING = 1
"""Cycles simulated before the one that is compared: the oil spring is loaded in the first."""
MOST_HARMONICS = 32
"""Harmonics compared at most.

Reason: those of dry friction fall with their order, so that the 32nd holds a thousandth of the power of the first."""
FEWEST_HARMONICS = 6
"""Harmonics compared at least: as many numbers as the parameters of four changes."""
CLEAR = 4.0
"""Power of the force above that of the noise up to which harmonics are compared: two standard errors."""
SAME_FREQUENCY = 0.02
"""Relative difference of two frequencies that count as one.

Reason: the force of a viscous damper then differs by as much, which the model carries to a tenth of it."""
SAME_CYCLE = 0.1
"""R.m.s. difference of two displacements that count as one motion, as a share of the larger.

Reason: what the model misses, often a tenth of the force, then counts for a hundredth of it."""
LEAST_MAINS = 4
"""Lowest harmonic that is left out where it lies upon a line of the mains.

Reason: the mains stand in every cycle alike where their frequency is a multiple of the motion's, so that no scatter
tells of them; harmonics below carry the shape of the force, and few dampers are tested above a fourth of 50 Hz."""
JUMP = 5.0
"""Multiple of the usual second difference from which two samples lie on either side of a jump."""
NO_TEST = 1e9
"""Cost of a pair that is not one motion."""


def stacked(spectrum: Complex) -> Array:
    """Return a spectrum as real numbers, their sum of squares the mean square of the signal (Parseval)."""
    rest = np.sqrt(2.0) * spectrum[1:]
    return np.concatenate([[spectrum[0].real], rest.real, rest.imag])


def unstacked(values: Array) -> Complex:
    """Return (H + 1,) the spectrum of (2 H + 1,) real numbers."""
    half = (values.size - 1) // 2
    rest = (values[1 : half + 1] + 1j * values[half + 1 :]) / np.sqrt(2.0)
    return np.concatenate([[values[0] + 0j], rest])


def course(spectrum: Complex, points: int) -> Array:
    """Return the (points,) cycle of a spectrum."""
    return np.asarray(np.fft.irfft(spectrum, points) * points)


@dataclass(frozen=True, eq=False)
class AveragedTest:
    """Averaged cycle of one test of constant control signal."""

    cleaned: CleanedRecord
    error: PureError
    """Force: its harmonics, and their variance by noise."""

    @property
    def record(self) -> Record:
        """The cleaned record."""
        return self.cleaned.record

    @cached_property
    def frequency(self) -> float:
        """Frequency of the cycles [Hz]."""
        run = self.cleaned.cycles
        return 0.0 if run is None else run.frequency

    @cached_property
    def displacement(self) -> Complex:
        """(H + 1,) harmonics of the displacement [m]."""
        x = self.cleaned.mean_motion[0]
        return np.asarray(np.fft.rfft(x)[: max(x.size // 2, 2)] / x.size)

    @cached_property
    def voltage(self) -> float | None:
        """Control signal [V]."""
        return self.record.median_voltage()

    @cached_property
    def temperature(self) -> float | None:
        """Temperature [degC]."""
        return self.record.median_temperature()


def averaged(cleaned: Sequence[CleanedRecord]) -> list[AveragedTest]:
    """Return the tests of constant control signal whose motion repeats."""
    return [AveragedTest(p, pure_error(p.folded)) for p in cleaned if has_average_cycle(p)]


def has_average_cycle(test: CleanedRecord) -> bool:
    """Whether the motion of a test repeats at a constant control signal."""
    return test.cycles is not None and test.constant


# --- Which test belongs to which


def phase_shift(before: Complex, after: Complex) -> float:
    """Return the shift [cycles] by which a displacement is moved to lie best upon another one.

    Equation: max over s of Re sum_h h^2 conj(B_h) A_h exp(2 pi i h s)    Source: cross-correlation of the speeds
    """
    size = min(before.size, after.size)
    h = np.arange(size)
    product = h**2 * np.conj(before[:size]) * after[:size]
    fine = max(8 * POINTS, 8 * size)
    shift = float(np.argmax(np.fft.irfft(product, fine))) / fine
    for _ in range(20):  # Newton's method on the derivative
        wave = product * np.exp(2j * np.pi * h * shift)
        slope, bend = float(np.sum(-2.0 * np.pi * h * wave.imag)), float(np.sum(-((2.0 * np.pi * h) ** 2) * wave.real))
        if bend >= 0.0:
            break
        shift -= slope / bend
    return shift


def shifted(spectrum: Complex, shift: float) -> Complex:
    """Return a spectrum with the beginning of its cycle moved by a share of a cycle."""
    return np.asarray(spectrum * np.exp(2j * np.pi * np.arange(spectrum.size) * shift))


def motion_distance(before: AveragedTest, after: AveragedTest) -> float:
    """Return the r.m.s. difference of two displacements at equal phase about their means, as a share of the larger."""
    one, other = before.displacement, after.displacement
    size = min(one.size, other.size)
    moved = shifted(other, phase_shift(one, other))
    away = np.linalg.norm(one[1:size] - moved[1:size])
    return float(away / max(np.linalg.norm(one[1:]), np.linalg.norm(other[1:])))


def motion_away(before: AveragedTest, after: AveragedTest) -> float:
    """Return how far two motions lie apart: in frequency by the logarithm of its ratio, in displacement by its share.

    Equation: sqrt(ln(f / f')^2 + d^2), d of `motion_distance`: of one waveform the share by which the amplitudes differ
    """
    return float(np.hypot(np.log(before.frequency / after.frequency), motion_distance(before, after)))


def nearest_motion(test: AveragedTest, others: Sequence[AveragedTest], voltage_within: float) -> AveragedTest | None:
    """Return the test of the same control signal whose motion is nearest; None without."""
    alike = (t for t in others if t is not test and _same_level(t, test, voltage_within))
    return min(alike, key=lambda other: motion_away(other, test), default=None)


def paired(
    before: Sequence[AveragedTest], after: Sequence[AveragedTest], voltage_within: float, temperature_within: float
) -> list[tuple[int, int]]:
    """Pair the tests of equal motion and control signal, each once, so that motions and temperatures lie closest.

    Parameters
    ----------
    before, after : tests of the two states
    voltage_within : largest difference of the control signal in one condition [V]
    temperature_within : largest difference of temperature in one condition [K]; a larger one is allowed, for it was
        recorded, and a closer test is preferred

    Returns
    -------
    indices into both
    """
    from scipy.optimize import linear_sum_assignment

    if not before or not after:
        return []
    cost = np.full((len(before), len(after)), NO_TEST)
    for i, one in enumerate(before):
        for j, other in enumerate(after):
            if not _same_level(one, other, voltage_within):
                continue
            if abs(one.frequency - other.frequency) > SAME_FREQUENCY * one.frequency:
                continue
            distance = motion_distance(one, other)
            if distance <= SAME_CYCLE:
                warmer = 0.0
                if one.temperature is not None and other.temperature is not None:
                    warmer = abs(one.temperature - other.temperature) / max(temperature_within, 1e-9)
                cost[i, j] = distance / SAME_CYCLE + warmer
    rows, columns = linear_sum_assignment(cost)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True) if cost[i, j] < NO_TEST]


def _same_level(one: AveragedTest, other: AveragedTest, within: float) -> bool:
    if one.voltage is None or other.voltage is None:
        return one.voltage is None and other.voltage is None
    return abs(one.voltage - other.voltage) <= max(within, CONSTANT_SHARE * abs(one.voltage))


# --- What is compared


@dataclass(frozen=True, eq=False)
class Comparison:
    """One test of the second state, beside the same test of the first state or the damper of the first state."""

    before: str | None
    """Record of the first state; None where the model stands in its place."""
    after: str
    motion: Motion
    """Cycles of the motion of the second state, about the mean displacement of the first, at its temperature."""
    begin: int
    """First sample that is compared."""
    rate: Array
    """(H + 1,) angular frequency of the harmonics [rad/s]."""
    counted: Mask
    """(H + 1,) which harmonics are compared; all spectra are zero at the others."""
    reference: Complex
    """(H + 1,) force of the first state in this motion [N]."""
    measured: Complex
    """(H + 1,) force of the second state [N]."""
    simulated: Complex
    """(H + 1,) force of the damper of the first state in this motion [N]."""
    first_force: float
    """With which the simulations begin [N]."""
    variance: Array
    """(2 H + 1,) variance of the stacked difference by noise of force and displacement [N^2]."""
    jumps: Array
    """(2 H + 1, m) difference by one standard deviation of the instants of jumps [N]."""
    peak: float
    """Largest force of the first state [N]."""
    warmer: float | None
    """Temperature of the second state less that of the first [K]; None where one was not recorded."""
    displacement_zero: float
    """Mean displacement of the second state less that of the first [m]; 0 without a partner."""
    mean_displacement: float
    """[m] in the first state's records."""
    amplitude: float
    """Half the stroke [m]."""
    missed: Array | None = None
    """(2 H + 1,) mean square that the model may miss where it stands for the first state [N^2]; None where the motions
    are equal."""

    @cached_property
    def difference(self) -> Array:
        """(2 H + 1,) stacked difference, the difference of the motions carried through the damper [N]."""
        return stacked(self.measured - self.reference)

    @property
    def voltage(self) -> float | None:
        """Control signal [V]."""
        return None if self.motion.voltage is None else float(np.median(self.motion.voltage))

    @property
    def temperature(self) -> float | None:
        """Temperature of the first state [degC]."""
        return None if self.motion.temperature is None else float(np.median(self.motion.temperature))

    def spectrum(self, force: Array) -> Complex:
        """Return the (H + 1,) harmonics of a simulated force (n,)."""
        return force_spectrum(force[self.begin :], self.counted)


def cycle_motion(
    harmonics: Complex, frequency: float, mean: float, voltage: float | None, temperature: float | None
) -> Motion:
    """Return a periodic motion sampled over the settling cycles and the one that is compared.

    Parameters
    ----------
    harmonics : (H + 1,) of the displacement [m], of which the mean is replaced
    frequency : of the cycles [Hz]
    mean : of the displacement [m]
    voltage, temperature : constant; None where there is none
    """
    size = min(harmonics.size, POINTS // 2)
    own = harmonics[:size].copy()
    own[0] = 0.0
    rate = 2j * np.pi * np.arange(size) * frequency
    x, v, a = (course(own * rate**order, POINTS) for order in range(3))
    cycles = 1 + SETTLING
    time = np.arange(cycles * POINTS) / (POINTS * frequency)
    constant = [None if value is None else np.full(time.size, value) for value in (voltage, temperature)]
    return Motion(time, np.tile(x, cycles) + mean, np.tile(v, cycles), np.tile(a, cycles), *constant)


def compared_harmonics(test: AveragedTest, other: AveragedTest | None) -> int:
    """Return the highest harmonic up to which the force of a test stands clear of the noise."""
    error = test.error
    last = min(error.mean.size - 1, MOST_HARMONICS, *([] if other is None else [other.error.mean.size - 1]))
    noise = error.of_mean[: last + 1] + (0.0 if other is None else other.error.of_mean[: last + 1])
    clear = np.flatnonzero(octave_mean(np.abs(error.mean[: last + 1]) ** 2) > CLEAR * noise)
    return int(min(max(clear[-1] if clear.size else 0, FEWEST_HARMONICS), last))


def force_spectrum(cycle: Array, counted: Mask) -> Complex:
    """Return the (H + 1,) harmonics of a cycle (n,) of a force, zero where they are not counted."""
    return np.asarray(np.where(counted, np.fft.rfft(cycle)[: counted.size] / cycle.size, 0.0))


def counted_harmonics(last: int, *tests: AveragedTest) -> Mask:
    """Return (last + 1,) which harmonics of some tests lie upon no line of the mains."""
    order, hums = np.arange(last + 1), np.zeros(last + 1, dtype=bool)
    for test in tests:
        hums |= mains_harmonics(test.frequency, last, 1.0 / float(np.ptp(test.record.time)))
    return ~hums | (order < LEAST_MAINS)


def octave_mean(power: Array) -> Array:
    """Average (H + 1,) power over an octave about every harmonic; the mean of a cycle counts as the first harmonic."""
    order = np.arange(power.size)
    low = np.maximum((0.7 * np.maximum(order, 1)).astype(np.int64), 1)
    high = np.minimum(np.maximum(np.ceil(1.4 * np.maximum(order, 1)).astype(np.int64), low + 1), power.size - 1)
    sums = np.concatenate([[0.0], np.cumsum(power)])
    return np.asarray((sums[high + 1] - sums[low]) / (high + 1 - low))


def displacement_variance(damper: Damper, test: AveragedTest, last: int) -> Array:
    """Return (H + 1,) variance of the simulated force by the noise and resolution of the displacement [N^2].

    With the instants of jumps, which `pzd.diagnosis.fit.prediction` leaves out of its own: there samples beside a jump
    do not count, while a harmonic has no samples that could be left out.
    """
    draws = test.cleaned.draws
    if len(draws) < 2:
        return np.zeros(last + 1)
    points = test.error.points

    def harmonics(record: Record) -> Complex:
        cycle = simulated_record(damper, record)[-points:]
        return np.asarray(np.fft.rfft(cycle)[: last + 1] / cycle.size)

    centre = harmonics(draws[0])
    return np.asarray(np.mean([np.abs(harmonics(draw) - centre) ** 2 for draw in draws[1:]], axis=0))


def stacked_variance(variance: Array, counted: Mask) -> Array:
    """Return (2 H + 1,) variance of a stacked spectrum of (H + 1,) variance, zero where it is not counted [N^2]."""
    kept = np.where(counted, variance, 0.0)
    return np.concatenate([kept, kept[1:]])


def jump_columns(test: AveragedTest, counted: Mask, shift: float) -> Array:
    """Return (2 H + 1, 2) difference by one standard deviation of the instant of all jumps up, and of all down [N].

    A jump of dry friction lies anywhere between two samples.

    Equation: dF_h = J exp(-2 pi i h j / P) / (P sqrt 12), J the jumps at samples j     Source: a uniform instant

    Parameters
    ----------
    test : whose samples they are
    counted : (H + 1,) which harmonics are compared
    shift : of the beginning of its cycle [cycles]
    """
    cycle = test.cleaned.folded.mean(axis=0)
    steps = np.roll(cycle, -1) - cycle
    usual = MAD_TO_SIGMA * float(np.median(np.abs(np.roll(steps, -1) - steps)))
    jump = np.abs(np.roll(steps, -1) - steps) > JUMP * usual
    jumps = np.where(jump | np.roll(jump, 1), steps, 0.0) / np.sqrt(12.0)
    spectra = (force_spectrum(np.where(sign * jumps > 0.0, jumps, 0.0), counted) for sign in (1.0, -1.0))
    return np.column_stack([stacked(shifted(spectrum, shift)) for spectrum in spectra])


def cycles_compared(damper: Damper, before: AveragedTest, after: AveragedTest) -> Comparison:
    """Compare the averaged cycles of one motion in two states at equal phase."""
    last = compared_harmonics(before, after)
    shift = phase_shift(before.displacement, after.displacement)
    mean = float(before.displacement[0].real)
    own = cycle_motion(before.displacement, before.frequency, mean, before.voltage, before.temperature)
    moved = cycle_motion(shifted(after.displacement, shift), after.frequency, mean, before.voltage, before.temperature)
    force, measured = before.error.mean[: last + 1], shifted(after.error.mean[: last + 1], shift)
    first = float(course(before.error.mean, max(2 * before.error.mean.size, POINTS))[0])
    begin, counted = SETTLING * POINTS, counted_harmonics(last, before, after)
    own_force, simulated = (force_spectrum(respond(damper, m, first)[begin:], counted) for m in (own, moved))
    variance = sum(
        (t.error.of_mean[: last + 1] + displacement_variance(damper, t, last) for t in (before, after)),
        start=np.zeros(last + 1),
    )
    warmer = None
    if before.temperature is not None and after.temperature is not None:
        warmer = after.temperature - before.temperature
    return Comparison(
        before.record.name,
        after.record.name,
        moved,
        begin,
        2.0 * np.pi * after.frequency * np.arange(last + 1, dtype=np.float64),
        counted,
        np.where(counted, force, 0.0) + simulated - own_force,
        np.where(counted, measured, 0.0),
        simulated,
        first,
        stacked_variance(variance, counted),
        np.column_stack([jump_columns(before, counted, 0.0), jump_columns(after, counted, shift)]),
        float(np.max(np.abs(course(before.error.mean, max(2 * before.error.mean.size, POINTS))))),
        warmer,
        float(after.displacement[0].real) - mean,
        mean,
        0.5 * float(np.ptp(own.displacement)),
    )


def model_compared(damper: Damper, after: AveragedTest, mean: float, temperature: float | None) -> Comparison:
    """Compare the averaged cycle of a test of the second state with the damper of the first one.

    Parameters
    ----------
    damper : of the first state
    after : the test
    mean : displacement of the first state about which the test is taken to have run [m]
    temperature : of the first state, at which it is simulated [degC]; None where none was recorded
    """
    last = compared_harmonics(after, None)
    motion = cycle_motion(after.displacement, after.frequency, mean, after.voltage, temperature)
    cycle = course(after.error.mean, max(2 * after.error.mean.size, POINTS))
    begin = SETTLING * POINTS
    force, counted = respond(damper, motion, float(cycle[0]))[begin:], counted_harmonics(last, after)
    simulated = force_spectrum(force, counted)
    variance = after.error.of_mean[: last + 1] + displacement_variance(damper, after, last)
    warmer = None if temperature is None or after.temperature is None else after.temperature - temperature
    return Comparison(
        None,
        after.record.name,
        motion,
        begin,
        2.0 * np.pi * after.frequency * np.arange(last + 1, dtype=np.float64),
        counted,
        simulated,
        np.where(counted, after.error.mean[: last + 1], 0.0),
        simulated,
        float(cycle[0]),
        stacked_variance(variance, counted),
        jump_columns(after, counted, 0.0),
        float(np.max(np.abs(force))),
        warmer,
        0.0,
        mean,
        0.5 * float(np.ptp(motion.displacement)),
    )
