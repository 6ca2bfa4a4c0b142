"""Records made ready for the diagnosis: displacement and temperature freed of noise, without a filter of fixed corner.

Noise of the displacement goes through a stiff oil spring into the force, and a second derivative
makes it look like inertia. Where the motion repeats, cycles are averaged and only harmonics well
above their own scatter are kept, over the whole cycle or in short parts of it, such as the corners
of a triangle; where it does not, the spectrum is cut where it sinks into noise.

Noise and steps of a temperature would go through a drift of the oil into the force, which follows the oil and not its
sensor. Noise of a voltage that stands still would look like steps of the voltage.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pzd.record import Array, Record, is_constant, sliced, voltage_scale
from pzd.signals.between_cycles import neighbours, pure_error
from pzd.signals.cycles import Cycles, cycles, drift, settled
from pzd.signals.lines import without_noise
from pzd.signals.short_time import ShortTimeMask
from pzd.signals.smoothing import HIGHEST, low_pass, motion_below
from pzd.signals.stretches import separate_tests

Motion = tuple[Array, Array, Array]
"""Displacement, velocity and acceleration, each (n,)."""

CLEAR = 4.0
"""A harmonic of the displacement is kept from this many standard errors on, over a cycle or in parts of it."""
DRAWS = 6
"""Displacements sent through the damper to see what their noise makes of the force."""
FINER = 16
"""Points per sample on which the cleaned cycle is laid."""
DRAWN = 4
"""Points per sample on which a drawn cycle is laid: what it differs by is noise."""
LINE = 16
"""The first and last of so many parts of a record say what the temperature is at its ends.

Reason: of a test of seconds half a second, in which no oil warms unevenly, and hundreds of samples of noise."""
COVERS = 0.5
"""The repeating run must hold this share of the way that the piston travels, else the record counts as not
repeating; rest before and after does not count."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """One record as the diagnosis sees it."""

    record: Record
    """With cleaned displacement and its derivatives, smoothed temperature, and a voltage that stands still at its
    median; only the repeating run where there is one."""
    cycles: Cycles | None
    """The run of cycles, where motion and voltage both repeat."""
    lead: Record | None
    """The same motion for one cycle more in front, for the simulation to settle."""
    constant: bool
    """Whether the voltage stands still."""
    draws: tuple[Record, ...] = ()
    """Two cycles of the lead; and the same with other displacements, as likely by what noise and resolution leave."""

    @cached_property
    def folded(self) -> Array:
        """(cycles, points) measured force [N]; nothing in it where nothing repeats."""
        return np.zeros((0, 0)) if self.cycles is None else self.cycles.fold(self.record.time, self.record.force)

    @cached_property
    def mean_motion(self) -> Motion:
        """Displacement, velocity and acceleration of the average cycle, (points,) each, where there are cycles."""
        if self.cycles is None:
            return np.zeros(0), np.zeros(0), np.zeros(0)
        time, of = self.record.time, self.cycles.mean
        return of(time, self.record.displacement), of(time, self.record.velocity), of(time, self.record.acceleration)

    @property
    def lead_samples(self) -> int:
        """Samples by which the lead is longer."""
        return 0 if self.lead is None else self.lead.time.size - self.record.time.size


def about(prepared: Sequence[Prepared], zero: float) -> tuple[Prepared, ...]:
    """The same with the displacement counted from another zero [m]."""

    def moved(record: Record) -> Record:
        return replace(record, displacement=record.displacement - zero)

    return tuple(
        replace(
            p,
            record=moved(p.record),
            lead=None if p.lead is None else moved(p.lead),
            draws=tuple(moved(draw) for draw in p.draws),
        )
        for p in prepared
    )


def prepare(records: Sequence[Record]) -> tuple[Prepared, ...]:
    """Every record of one rig, cleaned; several tests in one record are as many, of its name."""
    scale = voltage_scale(records)
    still = [(record, is_constant(record, scale)) for record in records]
    return tuple(
        _prepared(test, constant) for r, constant in still for test in (separate_tests(r) if constant else (r,))
    )


def _prepared(raw: Record, constant: bool) -> Prepared:
    record = _even_temperature(_held_voltage(raw) if constant else _quiet_voltage(raw))
    run = cycles(record.time, record.displacement)
    if run is None:
        return Prepared(_smoothed(record), None, None, constant)
    inside = run.inside(record.time)
    travel = np.abs(np.gradient(record.displacement))
    if travel[inside].sum() < COVERS * travel.sum():
        return Prepared(_smoothed(record), None, None, constant)
    average = Average.of(record, run)
    motion = average.motion(average.clear_harmonics)
    if constant:
        run = settled(run, record.time, record.force)
    kept = sliced(record, run.inside(record.time))
    cleaned = _moved(kept, motion(kept.time))
    if not constant:
        return Prepared(cleaned, None, None, constant)
    step = 1.0 / record.rate
    early = kept.time[0] - step * np.arange(run.points(record.time), 0, -1)
    lead = _led_in(cleaned, early, motion(early))
    return Prepared(cleaned, run, lead, constant, _drawn(lead, average))


def _held_voltage(record: Record) -> Record:
    """The record with its median voltage in place of what a noisy sensor makes of one that stands still."""
    voltage = record.median_voltage()
    return record if voltage is None else replace(record, voltage=np.full(record.time.size, voltage))


def _quiet_voltage(record: Record) -> Record:
    """The record with the levels and ramps of its voltage in place of what a noisy sensor makes of them."""
    return record if record.voltage is None else replace(record, voltage=without_noise(record.voltage))


def _even_temperature(record: Record) -> Record:
    """The record with the temperature of the oil in place of what a noisy sensor of some resolution makes of it."""
    if record.temperature is None or np.ptp(record.temperature) == 0.0:
        return record
    values = record.temperature.copy()  # the smoothing goes through the ends, and would keep the noise of these two
    values[0], values[-1] = _end(values), _end(values[::-1])
    return replace(record, temperature=low_pass(values, HIGHEST))


def _end(values: Array) -> float:
    """Where a straight line through the first samples of a channel begins."""
    first = values[: max(values.size // LINE, 2)]
    return float(np.polynomial.Polynomial.fit(np.arange(first.size), first, 1)(0.0))


def _moved(record: Record, motion: Motion) -> Record:
    """The record with another displacement and its derivatives."""
    return replace(record, displacement=motion[0], velocity=motion[1], acceleration=motion[2])


def _led_in(cleaned: Record, early: Array, motion: Motion) -> Record:
    def longer(channel: Array | None) -> Array | None:
        return None if channel is None else np.concatenate([np.full(early.size, channel[0]), channel])

    return Record(
        cleaned.name,
        cleaned.setting,
        np.concatenate([early, cleaned.time]),
        np.concatenate([motion[0], cleaned.displacement]),
        np.concatenate([motion[1], cleaned.velocity]),
        np.concatenate([motion[2], cleaned.acceleration]),
        np.concatenate([np.full(early.size, cleaned.force[0]), cleaned.force]),
        longer(cleaned.voltage),
        longer(cleaned.temperature),
    )


@dataclass(frozen=True, eq=False)
class Average:
    """The average cycle of a displacement, harmonic by harmonic."""

    run: Cycles
    points: int
    harmonics: NDArray[np.complex128]
    """(H + 1,) Fourier coefficients [m]."""
    variance: Array
    """(H + 1,) of them |.|^2, by noise and resolution [m^2]."""

    @classmethod
    def of(cls, record: Record, run: Cycles) -> Average:
        """The average cycle of a record, and how well it is known."""
        folded = run.fold(record.time, record.displacement)
        creep = drift(folded)  # else a mean that walks would end every cycle with a step, which the oil spring feels
        error = pure_error(folded - creep + creep.mean())
        finest = float(np.median(np.diff(np.unique(record.displacement))))
        hidden = finest**2 / 12.0 if error.sample_variance < (0.5 * finest) ** 2 else 0.0
        return cls(run, error.points, error.mean, error.of_mean + hidden / error.points)

    @cached_property
    def clear(self) -> NDArray[np.bool_]:
        """(H + 1,) whether a harmonic stands clear of its own uncertainty."""
        clear: NDArray[np.bool_] = np.abs(self.harmonics) > CLEAR * np.sqrt(self.variance)
        clear[0] = True
        return clear

    @cached_property
    def _in_parts(self) -> tuple[ShortTimeMask, Array]:
        left = self._cycle(np.where(self.clear, 0.0, self.harmonics))
        return ShortTimeMask.of(left, self.variance, CLEAR)

    @cached_property
    def clear_harmonics(self) -> NDArray[np.complex128]:
        """(H + 1,) the coefficients of what stands clear, over the whole cycle or in parts of it [m]."""
        return np.where(self.clear, self.harmonics, self._spectrum(self._in_parts[1]))

    def _noise(self, draw: np.random.Generator) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """(H + 1,) noise as likely as any, and what is kept of it."""
        size = self.harmonics.size
        unit = draw.standard_normal(size) + 1j * draw.standard_normal(size)
        noise: NDArray[np.complex128] = np.sqrt(0.5 * self.variance) * unit
        in_parts = self._spectrum(self._in_parts[0].kept(self._cycle(noise * ~self.clear)))
        return noise, np.where(self.clear, noise, in_parts)

    @cached_property
    def left_out(self) -> Array:
        """(H + 1,) power of the motion itself in what is not kept: what neighbouring harmonics have above noise."""
        drawn = [self._noise(draw) for draw in np.random.default_rng(DRAWS).spawn(DRAWS)]
        noise = np.mean([np.abs(whole - kept) ** 2 for whole, kept in drawn], axis=0)
        above = np.where(self.clear, 0.0, np.abs(self.harmonics - self.clear_harmonics) ** 2 - noise)
        low, high = neighbours(above.size - 1)
        sums, counts = (np.concatenate([[0.0], np.cumsum(each)]) for each in (above, ~self.clear))
        mean = (sums[high + 1] - sums[low]) / np.maximum(counts[high + 1] - counts[low], 1.0)
        power: Array = np.where(self.clear, 0.0, np.maximum(mean, 0.0))
        return power

    def error(self, draw: np.random.Generator) -> NDArray[np.complex128]:
        """(H + 1,) one error of `clear_harmonics` as likely as any: noise in what is kept, and what is left out."""
        _, found = self._noise(draw)
        size = found.size
        found += np.sqrt(0.5 * self.left_out) * (draw.standard_normal(size) + 1j * draw.standard_normal(size))
        found[0] = 0.0
        return found

    def _cycle(self, harmonics: NDArray[np.complex128]) -> Array:
        """(points,) the cycle of some harmonics (H + 1,)."""
        cycle: Array = np.fft.irfft(harmonics, self.points) * self.points
        return cycle

    def _spectrum(self, cycle: Array) -> NDArray[np.complex128]:
        """(H + 1,) the harmonics of a cycle (points,)."""
        spectrum: NDArray[np.complex128] = np.fft.rfft(cycle)[: self.harmonics.size] / self.points
        return spectrum

    def motion(self, harmonics: NDArray[np.complex128], finer: int = FINER) -> Callable[[Array], Motion]:
        """Displacement, velocity and acceleration of some harmonics (H + 1,) at any time."""
        from scipy.interpolate import CubicSpline

        rate = 2j * np.pi * np.arange(harmonics.size) / self.run.period
        fine = finer * self.points
        values = np.fft.irfft(harmonics * rate ** np.arange(3)[:, None], fine) * fine
        values = np.concatenate([values, values[:, :1]], axis=1)
        cycle = CubicSpline(np.arange(fine + 1) / fine, values, axis=1, bc_type="periodic")

        def at(time: Array) -> Motion:
            x, v, a = np.ascontiguousarray(cycle(self.run.phase(time)))
            return x, v, a

        return at


def _drawn(lead: Record, average: Average) -> tuple[Record, ...]:
    """Two cycles of the lead as they are, and with other displacements that are as likely."""
    draw = np.random.default_rng(DRAWS)
    two = sliced(lead, np.arange(lead.time.size) < 2 * average.points)
    motions = [average.motion(average.clear_harmonics + average.error(draw), DRAWN) for _ in range(DRAWS)]
    return (two, *(_moved(two, motion(two.time)) for motion in motions))


def _smoothed(record: Record) -> Record:
    """The record with its displacement cut where the spectrum sinks into noise; derivatives by the spectrum."""
    n = record.time.size
    line = np.linspace(record.displacement[0], record.displacement[-1], n)
    odd = record.displacement - line
    spectrum = np.fft.rfft(np.concatenate([odd, -odd[:0:-1]]))
    frequency = np.arange(spectrum.size) * record.rate / (2 * n - 1)
    spectrum[frequency > motion_below(record.displacement) * record.rate / (2.0 * np.pi)] = 0.0
    slope = float(line[-1] - line[0]) / ((n - 1) / record.rate)

    def derivative(order: int) -> Array:
        return np.fft.irfft(spectrum * (2j * np.pi * frequency) ** order, 2 * n - 1)[:n]

    return _moved(record, (derivative(0) + line, derivative(1) + slope, derivative(2)))
