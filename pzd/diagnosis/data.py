"""Records made ready for the diagnosis: cleaned, some excluded, and split into what is fitted and what is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Rig
from pzd.record import Array, Record, conditions, is_constant, sliced, voltage_scale
from pzd.signals.cycles import Cycles, cycles, drift, settled
from pzd.signals.jumps import without_noise
from pzd.signals.lack_of_fit import ShortTimeMask
from pzd.signals.noise import neighbours, pure_error
from pzd.signals.smoothing import HIGHEST, low_pass, motion_below
from pzd.signals.stretches import separate_tests

# ----------------------------------------------------------------------------------------------------
# Records made ready for the diagnosis: displacement and temperature freed of noise, without a filter of fixed corner.
#
# Noise of the displacement goes through a stiff oil spring into the force, and a second derivative
# makes it look like inertia. Where the motion repeats, cycles are averaged and only harmonics well
# above their own scatter are kept, over the whole cycle or in short parts of it, such as the corners
# of a triangle; where it does not, the spectrum is cut where it sinks into noise.
#
# Noise and steps of a temperature would go through a drift of the oil into the force, which follows the oil and not its
# sensor. Noise of a voltage that stands still would look like steps of the voltage.


Motion = tuple[Array, Array, Array]
"""Displacement, velocity and acceleration, each (n,)."""

SIGNIFICANT_HARMONIC = 4.0
"""A harmonic of the displacement is kept from this many standard errors on, over a cycle or in parts of it."""
DRAWS = 6
"""Displacements sent through the damper to see what their noise makes of the force."""
POINTS_OF_CYCLE = 16
"""Points per sample on which the cleaned cycle is laid."""
POINTS_OF_DRAW = 4
"""Points per sample on which a drawn cycle is laid: what it differs by is noise."""
END_PARTS = 16
"""The first and last of so many parts of a record say what the temperature is at its ends.

Reason: of a test of seconds half a second, in which no oil warms unevenly, and hundreds of samples of noise."""
REPEATING_SHARE = 0.5
"""The repeating run must hold this share of the way that the piston travels, else the record counts as not
repeating; rest before and after does not count."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
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


def centred_on(prepared: Sequence[PreparedRecord], zero: float) -> tuple[PreparedRecord, ...]:
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


def prepare(records: Sequence[Record]) -> tuple[PreparedRecord, ...]:
    """Every record of one rig, cleaned; several tests in one record are as many, of its name."""
    scale = voltage_scale(records)
    still = [(record, is_constant(record, scale)) for record in records]
    return tuple(
        _prepared(test, constant) for r, constant in still for test in (separate_tests(r) if constant else (r,))
    )


def _prepared(raw: Record, constant: bool) -> PreparedRecord:
    record = _smoothed_temperature(_fixed_voltage(raw) if constant else _denoised_voltage(raw))
    run = cycles(record.time, record.displacement)
    if run is None:
        return PreparedRecord(_smoothed_displacement(record), None, None, constant)
    inside = run.inside(record.time)
    travel = np.abs(np.gradient(record.displacement))
    if travel[inside].sum() < REPEATING_SHARE * travel.sum():
        return PreparedRecord(_smoothed_displacement(record), None, None, constant)
    average = AverageCycle.of(record, run)
    motion = average.motion(average.clear_harmonics)
    if constant:
        run = settled(run, record.time, record.force)
    kept = sliced(record, run.inside(record.time))
    cleaned = _with_motion(kept, motion(kept.time))
    if not constant:
        return PreparedRecord(cleaned, None, None, constant)
    step = 1.0 / record.rate
    early = kept.time[0] - step * np.arange(run.points(record.time), 0, -1)
    lead = _with_lead(cleaned, early, motion(early))
    return PreparedRecord(cleaned, run, lead, constant, _monte_carlo_motions(lead, average))


def _fixed_voltage(record: Record) -> Record:
    """The record with its median voltage in place of what a noisy sensor makes of one that stands still."""
    voltage = record.median_voltage()
    return record if voltage is None else replace(record, voltage=np.full(record.time.size, voltage))


def _denoised_voltage(record: Record) -> Record:
    """The record with the levels and ramps of its voltage in place of what a noisy sensor makes of them."""
    return record if record.voltage is None else replace(record, voltage=without_noise(record.voltage))


def _smoothed_temperature(record: Record) -> Record:
    """The record with the temperature of the oil in place of what a noisy sensor of some resolution makes of it."""
    if record.temperature is None or np.ptp(record.temperature) == 0.0:
        return record
    values = record.temperature.copy()  # the smoothing goes through the ends, and would keep the noise of these two
    values[0], values[-1] = _end_value(values), _end_value(values[::-1])
    return replace(record, temperature=low_pass(values, HIGHEST))


def _end_value(values: Array) -> float:
    """Where a straight line through the first samples of a channel begins."""
    first = values[: max(values.size // END_PARTS, 2)]
    return float(np.polynomial.Polynomial.fit(np.arange(first.size), first, 1)(0.0))


def _with_motion(record: Record, motion: Motion) -> Record:
    """The record with another displacement and its derivatives."""
    return replace(record, displacement=motion[0], velocity=motion[1], acceleration=motion[2])


def _with_lead(cleaned: Record, early: Array, motion: Motion) -> Record:
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
class AverageCycle:
    """The average cycle of a displacement, harmonic by harmonic."""

    run: Cycles
    points: int
    harmonics: NDArray[np.complex128]
    """(H + 1,) Fourier coefficients [m]."""
    variance: Array
    """(H + 1,) of them |.|^2, by noise and resolution [m^2]."""

    @classmethod
    def of(cls, record: Record, run: Cycles) -> AverageCycle:
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
        clear: NDArray[np.bool_] = np.abs(self.harmonics) > SIGNIFICANT_HARMONIC * np.sqrt(self.variance)
        clear[0] = True
        return clear

    @cached_property
    def _in_parts(self) -> tuple[ShortTimeMask, Array]:
        left = self._cycle(np.where(self.clear, 0.0, self.harmonics))
        return ShortTimeMask.of(left, self.variance, SIGNIFICANT_HARMONIC)

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

    def motion(self, harmonics: NDArray[np.complex128], finer: int = POINTS_OF_CYCLE) -> Callable[[Array], Motion]:
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


def _monte_carlo_motions(lead: Record, average: AverageCycle) -> tuple[Record, ...]:
    """Two cycles of the lead as they are, and with other displacements that are as likely."""
    draw = np.random.default_rng(DRAWS)
    two = sliced(lead, np.arange(lead.time.size) < 2 * average.points)
    motions = [average.motion(average.clear_harmonics + average.error(draw), POINTS_OF_DRAW) for _ in range(DRAWS)]
    return (two, *(_with_motion(two, motion(two.time)) for motion in motions))


def _smoothed_displacement(record: Record) -> Record:
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

    return _with_motion(record, (derivative(0) + line, derivative(1) + slope, derivative(2)))


# ----------------------------------------------------------------------------------------------------
# Which records the diagnosis uses: a load cell that was cut off hides what it should show.


def unsaturated_records(rig: Rig, setting: str | None) -> tuple[list[Record], tuple[str, ...]]:
    """The records of a setting whose force is not cut off, and the names of the others; all where none is whole."""
    mine = [record for record in rig.records if record.setting == setting]
    cut_off = {entry.name for entry in rig.entries if any(_cuts_the_force(f.check, f.where) for f in entry.findings)}
    whole = [record for record in mine if record.name not in cut_off]
    return (whole, tuple(r.name for r in mine if r.name in cut_off)) if whole else (mine, ())


def _cuts_the_force(check: str, where: str) -> bool:
    return check == "saturation" and where.startswith("force")


def saturation_note(cut_off: Sequence[str]) -> str:
    """What to add to the reason where records were left out."""
    return f"; left out, for their force is cut off at the end of its range: {', '.join(cut_off)}" if cut_off else ""


# ----------------------------------------------------------------------------------------------------
# Which samples are fitted, which choose, and which nothing has seen before the final figures.
#
# Records are held out where a condition has three or more; of two, one is held out whole and the
# other is parted; a lone record is parted by cycles, or where nothing repeats by segments. The same
# rig always splits the same way.


TRAINING, VALIDATION, HELD_OUT = 0, 1, 2
"""Fitted to; looked at to choose; seen by nothing but the final figures."""
Roles = NDArray[np.int64]
HoldOut = Literal["records", "cycles", "segments", "mixed"]

ROLES_OF_LONE_RECORD = (TRAINING, VALIDATION, TRAINING, HELD_OUT, TRAINING, VALIDATION, TRAINING, HELD_OUT)
"""Segments of a record that is alone in its condition and does not repeat."""
ROLES_BESIDE_HELD_OUT = (TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION)
"""Segments of such a record when another of its condition is untouched."""
MOVING_RECORDS_IN_GROUP = 4
"""Fewer records with a moving voltage are each parted: a step and a ramp do not stand for one another."""
SAME_EXTREME = 0.05
"""Records within this share of the rig's largest force, speed or displacement show the same as the one with it."""
SHORTEST_STRETCH = 50
"""A stretch of fewer samples is not fitted."""


@dataclass(frozen=True, eq=False)
class Split:
    """The role of every sample of every record, in the order of the records."""

    roles: tuple[Roles, ...]
    """(n,) role of each sample."""
    held_out: tuple[str, ...]
    """Names of the records that are untouched, wholly or in part."""
    hold_out: HoldOut
    """What was held out."""


def split(prepared: Sequence[PreparedRecord], voltage_within: float | None, temperature_within: float) -> Split:
    """The split of the records of one setting.

    Parameters
    ----------
    prepared : the records
    voltage_within : largest spread of voltage inside one condition [V]; None for 2 % of the scale
    temperature_within : largest spread of temperature inside one condition [degC]
    """
    place = {id(p.record): i for i, p in enumerate(prepared)}
    found, moving = conditions([p.record for p in prepared], voltage_within, temperature_within)
    groups = [condition.records for condition in found] + (
        [moving] if len(moving) >= MOVING_RECORDS_IN_GROUP else [(record,) for record in moving]
    )
    extreme = {int(np.argmax(peaks)) for peaks in _peaks(prepared)}
    roles: dict[int, Roles] = {}
    kinds: set[HoldOut] = set()
    for turn, group in enumerate(groups):
        members = sorted((place[id(record)] for record in group), key=lambda i: _order(prepared[i]))
        members = _rotated(members, turn, extreme)
        shared, kind = _roles_in_condition(members, prepared)
        roles |= shared
        kinds.add(kind)
    for i in _extremes_not_fitted(prepared, roles):
        roles[i] = _divided_record(prepared[i], alone=True)
        kinds.add(_hold_out_kind(prepared[i]))
    ordered = tuple(roles[i] for i in range(len(prepared)))
    names = (p.record.name for p, role in zip(prepared, ordered, strict=True) if np.any(role == HELD_OUT))
    return Split(ordered, tuple(dict.fromkeys(names)), kinds.pop() if len(kinds) == 1 else "mixed")


def stretches(record: Record, wanted: NDArray[np.bool_]) -> list[Record]:
    """The unbroken stretches of a record in which the mask (n,) is set, those long enough to be fitted."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wanted, [False]]).astype(np.int8)))
    found = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end - start >= SHORTEST_STRETCH:
            mask = np.zeros(wanted.size, dtype=np.bool_)
            mask[start:end] = True
            found.append(sliced(record, mask))
    return found


def _order(prepared: PreparedRecord) -> tuple[float, float, str]:
    frequency = np.inf if prepared.cycles is None else round(prepared.cycles.frequency, 3)
    return frequency, float(np.max(np.abs(prepared.record.velocity))), prepared.record.name


def _peaks(prepared: Sequence[PreparedRecord]) -> list[Array]:
    """(r,) largest force, speed and displacement of every record: some effects show at the rig's largest alone."""
    channels = ("force", "velocity", "displacement")
    return [np.array([np.max(np.abs(getattr(p.record, channel))) for p in prepared]) for channel in channels]


def _extremes_not_fitted(prepared: Sequence[PreparedRecord], roles: Mapping[int, Roles]) -> set[int]:
    """Places of the records with the rig's largest force, speed or displacement, where nothing near it is fitted."""
    found = set()
    for peaks in _peaks(prepared):
        near = np.flatnonzero(peaks >= (1.0 - SAME_EXTREME) * peaks.max())
        if not any(np.any(roles[int(i)] == TRAINING) for i in near):
            found.add(int(np.argmax(peaks)))
    return found


def _hold_out_kind(prepared: PreparedRecord) -> HoldOut:
    return "segments" if prepared.cycles is None else "cycles"


def _rotated(members: list[int], turn: int, extreme: set[int]) -> list[int]:
    """Members rotated by `turn`, or by the least more that lets those with an extreme be fitted.

    So over the conditions every kind of test is in every role.
    """
    count = len(members)
    shifts = [[members[(turn + more + i) % count] for i in range(count)] for more in range(count)]
    roles = _roles(count)
    return max(shifts, key=lambda order: sum(i in extreme for i, r in zip(order, roles, strict=True) if r == TRAINING))


def _roles(count: int) -> list[int]:
    """Roles of so many records of one condition, in their order."""
    role = [TRAINING] * count
    role[1::4] = [HELD_OUT] * len(role[1::4])
    chooses = slice(3, None, 4) if count > 3 else slice(2, 3)
    role[chooses] = [VALIDATION] * len(role[chooses])
    return role


def _roles_in_condition(rotated: list[int], prepared: Sequence[PreparedRecord]) -> tuple[dict[int, Roles], HoldOut]:
    """Roles in one condition, by the order of its members."""
    if len(rotated) == 1:
        only = prepared[rotated[0]]
        return {rotated[0]: _divided_record(only, alone=True)}, _hold_out_kind(only)
    if len(rotated) == 2:
        first, second = rotated
        return {
            first: _divided_record(prepared[first], alone=False),
            second: _whole_record(prepared[second], HELD_OUT),
        }, "records"
    return {i: _whole_record(prepared[i], r) for i, r in zip(rotated, _roles(len(rotated)), strict=True)}, "records"


def _whole_record(prepared: PreparedRecord, role: int) -> Roles:
    return np.full(prepared.record.time.size, role, dtype=np.int64)


def _divided_record(prepared: PreparedRecord, *, alone: bool) -> Roles:
    time = prepared.record.time
    if prepared.cycles is None:
        pattern = np.array(ROLES_OF_LONE_RECORD if alone else ROLES_BESIDE_HELD_OUT)
        return pattern[np.arange(time.size) * pattern.size // time.size]
    return _roles_of_cycles(prepared.cycles.count, alone=alone)[np.clip(prepared.cycles.number(time), 0, None)]


def _roles_of_cycles(count: int, *, alone: bool) -> Roles:
    """Roles of `count` cycles: the last quarter is untouched, the one before chooses, the rest is fitted."""
    roles = np.full(count, TRAINING, dtype=np.int64)
    untouched = max(1, count // 4) if alone else 0
    chooses = max(1, count // 4) if count - untouched >= 2 else 0
    roles[count - untouched :] = HELD_OUT
    roles[count - untouched - chooses : count - untouched] = VALIDATION
    return roles
