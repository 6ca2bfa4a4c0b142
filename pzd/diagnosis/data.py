"""Prepared records: cleaned, without saturated ones, and split into samples that are fitted, that choose, and held out.

Displacement and temperature are freed of noise without a filter of fixed corner. Noise of the displacement goes through
a stiff oil into the force, and its second derivative looks like inertia. Where the motion repeats, cycles are averaged
and only harmonics well above their own scatter are kept, over the whole cycle or in short parts of it, such as the
corners of a triangle; where it does not, the spectrum is cut where it sinks into noise.

Noise and steps of a temperature would go through a temperature drift into the force, which follows the fluid and not
its sensor. Noise of a constant voltage would look like steps of the voltage.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pzd.artefacts import Rig
from pzd.record import Array, Record, conditions, distinct, is_constant, sliced, voltage_scale
from pzd.signals.average_cycle import AverageCycle, Motion
from pzd.signals.cycles import Cycles, cycles, cycles_of, settled_cycles
from pzd.signals.jumps import denoised_control
from pzd.signals.measures import resolution
from pzd.signals.segmentation import separate_tests
from pzd.signals.smoothing import HIGHEST, cut_above, low_pass, motion_below, resolved_below

DRAWS = 6
"""Displacements that are simulated to see what their noise makes of the force."""
POINTS_OF_DRAW = 4
"""Points per sample of a drawn cycle: fewer, for its deviation is noise."""
DEGREE = 5
"""Of the spline through a displacement that does not repeat: its second derivative is smooth still."""
END_PARTS = 16
"""Parts of a record, of which the first and last give the temperature at its ends.

Reason: of a test of seconds half a second, in which no oil warms unevenly, and hundreds of samples of noise."""
REPEATING_SHARE = 0.5
"""Share of the travel that the repeating run must hold, else the record counts as not repeating; rest before and after
does not count."""


@dataclass(frozen=True, eq=False)
class PreparedRecord:
    """One record, cleaned, with its cycles."""

    record: Record
    """Record with cleaned displacement and its derivatives, smoothed temperature, and the median of a constant voltage;
    only the repeating run where there is one."""
    cycles: Cycles | None
    """Cycles, where motion and voltage both repeat."""
    lead: Record | None
    """The same motion with one more cycle in front, for the simulation to settle."""
    constant: bool
    """Whether the voltage is constant."""
    draws: tuple[Record, ...] = ()
    """Two cycles of the lead, or the whole record where nothing repeats; and the same with other displacements, as
    likely within noise and resolution."""
    average: AverageCycle | None = None
    """Average cycle of the displacement, where it repeats."""
    read_alike: int = 1
    """Tests of the rig, this one among them, in which the steps of the displacement err alike."""
    hum_variance: Array | float = 0.0
    """(H + 1,) variance |.|^2 of the harmonics of the average cycle of the force by mains in step with it [N^2]."""

    @cached_property
    def folded(self) -> Array:
        """(cycles, points) measured force [N]; empty where nothing repeats."""
        return np.zeros((0, 0)) if self.cycles is None else self.cycles.fold(self.record.time, self.record.force)

    @cached_property
    def mean_motion(self) -> Motion:
        """(points,) displacement, velocity and acceleration of the average cycle; empty where nothing repeats."""
        if self.cycles is None:
            return np.zeros(0), np.zeros(0), np.zeros(0)
        time, of = self.record.time, self.cycles.mean
        return of(time, self.record.displacement), of(time, self.record.velocity), of(time, self.record.acceleration)

    @property
    def lead_samples(self) -> int:
        """Number of samples that the lead has in front."""
        return 0 if self.lead is None else self.lead.time.size - self.record.time.size


def centred_on(prepared: Sequence[PreparedRecord], zero: float) -> tuple[PreparedRecord, ...]:
    """Return the records with the displacement counted from another zero [m]."""

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
    """Clean every record of one rig; several tests in one record become several records of its name."""
    scale = voltage_scale(records)
    still = [(record, is_constant(record, scale)) for record in records]
    found = [_prepared(test, constant) for r, constant in still for test in (separate_tests(r) if constant else (r,))]
    averages = [p.average for p in found if p.average is not None]
    return tuple(
        p if p.average is None else replace(p, read_alike=max(sum(map(p.average.read_alike, averages)), 1))
        for p in found
    )


def _prepared(raw: Record, constant: bool) -> PreparedRecord:
    record = _denoised(raw, constant=constant)
    run = cycles(record.time, record.displacement)
    travel = np.abs(np.gradient(record.displacement))
    if run is None or travel[run.inside(record.time)].sum() < REPEATING_SHARE * travel.sum():
        smoothed, draws = _smoothed_displacement(record)
        return PreparedRecord(smoothed, None, None, constant, draws)
    average = AverageCycle.of(record.time, record.displacement, run)
    motion = average.motion(average.clear_harmonics)
    if constant:
        run = settled_cycles(run, record.time, record.force)
    kept = sliced(record, run.inside(record.time))
    cleaned = _with_motion(kept, motion(kept.time))
    if not constant:
        return PreparedRecord(cleaned, None, None, constant)
    step = 1.0 / record.rate
    early = kept.time[0] - step * np.arange(run.points(record.time), 0, -1)
    lead = _with_lead(cleaned, early, motion(early))
    return PreparedRecord(cleaned, run, lead, constant, _monte_carlo_motions(lead, average), average)


def _denoised(record: Record, *, constant: bool) -> Record:
    """Remove sensor noise: a constant voltage is its median, a moving one levels and ramps; smooth temperature."""
    voltage, temperature = record.voltage, record.temperature
    if voltage is not None:
        voltage = np.full(voltage.size, np.median(voltage)) if constant else denoised_control(voltage)
    if temperature is not None and np.ptp(temperature) > 0.0:
        ends = _end_value(temperature), _end_value(temperature[::-1])
        temperature = temperature.copy()
        temperature[0], temperature[-1] = ends  # the filter goes through these two, and would keep their noise
        temperature = low_pass(temperature, HIGHEST)
    return replace(record, voltage=voltage, temperature=temperature)


def _end_value(values: Array) -> float:
    """Extrapolate a straight line through the first samples of a channel to its beginning."""
    first = values[: max(values.size // END_PARTS, 2)]
    return float(np.polynomial.Polynomial.fit(np.arange(first.size), first, 1)(0.0))


def _with_motion(record: Record, motion: Motion) -> Record:
    """Replace the displacement and its derivatives."""
    return replace(record, displacement=motion[0], velocity=motion[1], acceleration=motion[2])


def _with_lead(cleaned: Record, early: Array, motion: Motion) -> Record:
    """Put one cycle of the motion in front, with the first value of every other channel."""

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


def _monte_carlo_motions(lead: Record, average: AverageCycle) -> tuple[Record, ...]:
    """Return two cycles of the lead, and the same with other displacements that are as likely.

    At a corner the acceleration has as much beyond half the sampling rate as below. A force is recorded through a
    filter, which lets nothing of it pass; sampled, it would fold into every harmonic.
    """
    draw, size = np.random.default_rng(DRAWS), average.clear_harmonics.size
    two = sliced(lead, np.arange(lead.time.size) < 2 * average.points)

    def other() -> Record:
        drawn = average.error(draw)
        drawn[:size] += average.clear_harmonics
        x, v, _ = average.motion(drawn, POINTS_OF_DRAW)(two.time)
        *_, a = average.motion(drawn[:size], POINTS_OF_DRAW)(two.time)
        return _with_motion(two, (x, v, a))

    return (two, *(other() for _ in range(DRAWS)))


def _smoothed_displacement(record: Record) -> tuple[Record, tuple[Record, ...]]:
    """Cut the spectrum of the displacement where it sinks into noise; with it, others that are as likely.

    These are the smoothed one with noise, read in the same steps from another zero, and smoothed again: none where the
    motion stands out of its noise everywhere.
    """
    step = resolution(record.displacement)
    corner = min(motion_below(record.displacement), resolved_below(record.displacement, step))
    smooth, beyond = cut_above(record.displacement, corner)
    smoothed = _with_motion(record, _derivatives(smooth, record.rate))
    if beyond == 0.0:
        return smoothed, ()
    draw = np.random.default_rng(DRAWS)
    noise = float(np.sqrt(max(beyond**2 - step**2 / 12.0, 0.0)))

    def other() -> Motion:
        seen = smooth + noise * draw.standard_normal(smooth.size)
        if step > 0.0:
            zero = step * draw.uniform(-0.5, 0.5)
            seen = step * np.round((seen - zero) / step) + zero
        return _derivatives(cut_above(seen, corner)[0], record.rate)

    return smoothed, (smoothed, *(_with_motion(record, other()) for _ in range(DRAWS)))


def _derivatives(smooth: Array, rate: float) -> Motion:
    """Return a smooth displacement (n,) with its derivatives by a spline.

    Those of the spectrum would ring from either end, where the curvature of the reflected record jumps.
    """
    from scipy.interpolate import make_interp_spline

    at = np.arange(smooth.size)
    course = make_interp_spline(at, smooth, DEGREE)
    speed, acceleration = (np.asarray(course(at, order)) * rate**order for order in (1, 2))
    return smooth, speed, acceleration


# --- Exclusion of saturated records


def unsaturated_records(rig: Rig, setting: str | None) -> tuple[list[Record], tuple[str, ...]]:
    """Return the records of a setting with unsaturated force, and the names of the others; all where none is left."""
    mine = [record for record in distinct(rig.records) if record.setting == setting]
    saturated = {
        entry.name
        for entry in rig.entries
        if any(found.check == "saturation" and found.where.startswith("force") for found in entry.findings)
    }
    left = [record for record in mine if record.name not in saturated]
    return (left, tuple(r.name for r in mine if r.name in saturated)) if left else (mine, ())


def saturation_note(names: Sequence[str]) -> str:
    """Say which records were left out."""
    return f"; left out, for their force is cut off at the end of its range: {', '.join(names)}" if names else ""


def without_drift(rig: Rig, records: Sequence[Record]) -> tuple[list[Record], float]:
    """Return the records without the drift of the force that the preflight found, and the largest drift [N].

    A zero of the load cell that moves is the test's own. Where it was right, before the test or within it, is unknown:
    a mean force that is no larger than the drift goes with it, and no preload is made of it; a larger one stays.

    Equation: F - D (t - t_m) / (t_e - t_s), t_m the middle of the cycles from t_s to t_e; less their mean m where
    |m| <= |D|

    Parameters
    ----------
    rig : whose entries hold the findings
    records : of one setting
    """
    changes = {
        entry.name: found.size
        for entry in rig.entries
        for found in entry.findings
        if found.check == "drift" and found.where.startswith("force")
    }

    def levelled(record: Record) -> Record:
        run = cycles_of(record) if record.name in changes else None
        if run is None:
            return record
        change = changes[record.name]
        force = record.force - change * (record.time - 0.5 * (run.start + run.end)) / (run.end - run.start)
        mean = float(run.mean(record.time, force).mean())
        return replace(record, force=force - mean if abs(mean) <= abs(change) else force)

    drifts = [abs(changes[record.name]) for record in records if record.name in changes]
    return [levelled(record) for record in records], max(drifts, default=0.0)


def drift_note(largest: float) -> str:
    """Say by how much the force drifts [N], and what is not known for it; nothing without a drift."""
    known = "; the zero of the force drifts by up to {:.2g} N: that is taken out, and a preload is known no better"
    return known.format(largest) if largest else ""


# --- Split into samples that are fitted, that choose, and that are held out
#
# Records are held out where a condition has three or more; of two, one is held out whole and the other is divided; a
# lone record is divided by cycles, or where nothing repeats by segments. The same rig always splits the same way.


TRAINING, VALIDATION, HELD_OUT = 0, 1, 2
"""Roles of a sample: fitted; used to choose; seen by nothing but the final figures."""
Roles = NDArray[np.int64]
HoldOut = Literal["records", "cycles", "segments", "mixed"]

ROLES_OF_LONE_RECORD = (TRAINING, VALIDATION, TRAINING, HELD_OUT, TRAINING, VALIDATION, TRAINING, HELD_OUT)
"""Roles of the segments of a record that is alone in its condition and does not repeat."""
ROLES_BESIDE_HELD_OUT = (TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION, TRAINING, TRAINING, VALIDATION)
"""Roles of the segments of such a record when another of its condition is held out."""
MOVING_RECORDS_IN_GROUP = 4
"""Fewest records with a moving voltage of which whole ones are held out.

Reason: a step and a ramp do not stand for one another; fewer are each divided."""
SAME_EXTREME = 0.05
"""Records within this share of the rig's largest force, speed or displacement show the same as the one with it."""


@dataclass(frozen=True, eq=False)
class Split:
    """Role of every sample of every record, in the order of the records."""

    roles: tuple[Roles, ...]
    """(n,) role of each sample."""
    held_out: tuple[str, ...]
    """Names of the records that are held out, wholly or in part."""
    hold_out: HoldOut
    """What was held out."""


def split(prepared: Sequence[PreparedRecord], voltage_within: float | None, temperature_within: float) -> Split:
    """Split the records of one setting into roles.

    Parameters
    ----------
    prepared : the records
    voltage_within : largest spread of voltage inside one condition [V]; None for 2 % of the scale
    temperature_within : largest spread of temperature inside one condition [degC]
    """
    number = {id(p.record): i for i, p in enumerate(prepared)}
    found, moving = conditions([p.record for p in prepared], voltage_within, temperature_within)
    groups = [condition.records for condition in found] + (
        [moving] if len(moving) >= MOVING_RECORDS_IN_GROUP else [(record,) for record in moving]
    )
    extreme = {int(np.argmax(peaks)) for peaks in _peaks(prepared)}
    roles: dict[int, Roles] = {}
    kinds: set[HoldOut] = set()
    for turn, group in enumerate(groups):
        members = sorted((number[id(record)] for record in group), key=lambda i: _order(prepared[i]))
        roles |= _roles_in_condition(_rotated(members, turn, extreme), prepared)
        kinds.add("records" if len(group) > 1 else _hold_out_kind(prepared[members[0]]))
    for i in _extremes_not_fitted(prepared, roles):
        roles[i] = _divided_record(prepared[i], alone=True)
        kinds.add(_hold_out_kind(prepared[i]))
    ordered = tuple(roles[i] for i in range(len(prepared)))
    names = (p.record.name for p, role in zip(prepared, ordered, strict=True) if np.any(role == HELD_OUT))
    return Split(ordered, tuple(dict.fromkeys(names)), kinds.pop() if len(kinds) == 1 else "mixed")


def _order(prepared: PreparedRecord) -> tuple[float, float, str]:
    frequency = np.inf if prepared.cycles is None else round(prepared.cycles.frequency, 3)
    return frequency, float(np.max(np.abs(prepared.record.velocity))), prepared.record.name


def _peaks(prepared: Sequence[PreparedRecord]) -> list[Array]:
    """Return the (r,) largest force, speed and displacement of every record: some effects show only there."""
    channels = ("force", "velocity", "displacement")
    return [np.array([np.max(np.abs(getattr(p.record, channel))) for p in prepared]) for channel in channels]


def _extremes_not_fitted(prepared: Sequence[PreparedRecord], roles: Mapping[int, Roles]) -> set[int]:
    """Return the records with the rig's largest force, speed or displacement where nothing near it is fitted."""
    found = set()
    for peaks in _peaks(prepared):
        near = np.flatnonzero(peaks >= (1.0 - SAME_EXTREME) * peaks.max())
        if not any(np.any(roles[int(i)] == TRAINING) for i in near):
            found.add(int(np.argmax(peaks)))
    return found


def _hold_out_kind(prepared: PreparedRecord) -> HoldOut:
    return "segments" if prepared.cycles is None else "cycles"


def _rotated(members: list[int], turn: int, extreme: set[int]) -> list[int]:
    """Rotate the members by `turn`, or by the least more that lets those with an extreme be fitted.

    So over the conditions every kind of test is in every role.
    """
    count = len(members)
    shifts = [[members[(turn + more + i) % count] for i in range(count)] for more in range(count)]
    roles = _roles(count)
    return max(shifts, key=lambda order: sum(i in extreme for i, r in zip(order, roles, strict=True) if r == TRAINING))


def _roles(count: int) -> list[int]:
    """Return the roles of so many records of one condition, in their order."""
    role = [TRAINING] * count
    role[1::4] = [HELD_OUT] * len(role[1::4])
    chooses = slice(3, None, 4) if count > 3 else slice(2, 3)
    role[chooses] = [VALIDATION] * len(role[chooses])
    return role


def _roles_in_condition(members: Sequence[int], prepared: Sequence[PreparedRecord]) -> dict[int, Roles]:
    """Assign roles to the samples of the records of one condition, by the order of its members."""
    if len(members) == 1:
        return {members[0]: _divided_record(prepared[members[0]], alone=True)}
    sizes = [prepared[i].record.time.size for i in members]
    whole = {i: np.full(n, role) for i, n, role in zip(members, sizes, _roles(len(members)), strict=True)}
    if len(members) == 2:
        whole[members[0]] = _divided_record(prepared[members[0]], alone=False)
    return whole


def _divided_record(prepared: PreparedRecord, *, alone: bool) -> Roles:
    time = prepared.record.time
    if prepared.cycles is None:
        pattern = np.array(ROLES_OF_LONE_RECORD if alone else ROLES_BESIDE_HELD_OUT)
        return pattern[np.arange(time.size) * pattern.size // time.size]
    return _roles_of_cycles(prepared.cycles.count, alone=alone)[np.clip(prepared.cycles.number(time), 0, None)]


def _roles_of_cycles(count: int, *, alone: bool) -> Roles:
    """Return the roles of `count` cycles: the last quarter is held out, the one before chooses, the rest is fitted."""
    roles = np.full(count, TRAINING, dtype=np.int64)
    held_out = max(1, count // 4) if alone else 0
    chooses = max(1, count // 4) if count - held_out >= 2 else 0
    roles[count - held_out :] = HELD_OUT
    roles[count - held_out - chooses : count - held_out] = VALIDATION
    return roles
