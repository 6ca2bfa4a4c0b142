"""Records as diagnose reads them: freed of the noise of displacement, temperature and voltage, with their cycles.

Displacement and temperature are freed of noise without a filter of fixed corner. Noise of the displacement goes through
a stiff oil into the force, and its second derivative looks like inertia. Where the motion repeats, cycles are averaged
and only harmonics well above their own scatter are kept, over the whole cycle or in short parts of it, such as the
corners of a triangle; where it does not, the spectrum is cut where it sinks into noise.

Noise and steps of a temperature would go through a temperature drift into the force, which follows the fluid and not
its sensor. Noise of a constant voltage would look like steps of the voltage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pzd.artefacts import Rig
from pzd.record import Array, Record, distinct, is_constant, sliced, voltage_scale
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
MOVING_TEMPERATURE = 0.5
"""Change of temperature over a test [K] up to which it counts as its average cycle, at one temperature.

Reason: about the resolution of a thermocouple; not tuned."""
SAMPLES_A_CYCLE = 200
"""Samples in a cycle of a test in which the damper warms: each counts by itself, and more tell no more of its law.

Reason: four times those that a half cycle needs (`FEWEST_IN_HALF_CYCLE`) in each; a slow test at 1 kHz has 2000, and
took ten times as long."""
LEAST_RATE = 250.0
"""Least rate of such a test [Hz].

Reason: a jump of the friction, or the hum of the mains, is as far from a slow law as at the rates of loggers."""
REPEATING_SHARE = 0.5
"""Share of the travel that the repeating run must hold, else the record counts as not repeating; rest before and after
does not count."""


@dataclass(frozen=True, eq=False)
class CleanedRecord:
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


def centred_on(cleaned: Sequence[CleanedRecord], zero: float) -> tuple[CleanedRecord, ...]:
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
        for p in cleaned
    )


def clean(records: Sequence[Record], *, every_sample: bool = False) -> tuple[CleanedRecord, ...]:
    """Clean every record of one rig; several tests in one record become several records of its name.

    Parameters
    ----------
    records : of one rig
    every_sample : whether a test in which the damper warms keeps its samples, for averages of its cycles
    """
    scale = voltage_scale(records)
    still = [(record, is_constant(record, scale)) for record in records]
    tests = [(test, constant) for r, constant in still for test in (separate_tests(r) if constant else (r,))]
    found = [_cleaned(test, constant, thinned=not every_sample) for test, constant in tests]
    averages = [p.average for p in found if p.average is not None]
    return tuple(
        p if p.average is None else replace(p, read_alike=max(sum(map(p.average.read_alike, averages)), 1))
        for p in found
    )


def _cleaned(raw: Record, constant: bool, *, thinned: bool) -> CleanedRecord:
    record = _denoised(raw, constant=constant)
    run = cycles(record.time, record.displacement)
    travel = np.abs(np.gradient(record.displacement))
    if run is None or travel[run.inside(record.time)].sum() < REPEATING_SHARE * travel.sum():
        smoothed, draws = _smoothed_displacement(record)
        return CleanedRecord(smoothed, None, None, constant, draws)
    if constant and thinned and temperature_moves(sliced(record, run.inside(record.time)).temperature):
        record, run = _thinned(record, run)
    average = AverageCycle.of(record.time, record.displacement, run)
    motion = average.motion(average.clear_harmonics)
    if constant:
        run = settled_cycles(run, record.time, record.force)
    kept = sliced(record, run.inside(record.time))
    moved = _with_motion(kept, motion(kept.time))
    if not constant:
        return CleanedRecord(moved, None, None, constant)
    step = 1.0 / record.rate
    early = kept.time[0] - step * np.arange(run.points(record.time), 0, -1)
    lead = _with_lead(moved, early, motion(early))
    return CleanedRecord(moved, run, lead, constant, _monte_carlo_motions(lead, average), average)


def _thinned(record: Record, run: Cycles) -> tuple[Record, Cycles]:
    """Return the means of every n samples of a record that repeats, with its cycles; itself where it has few.

    The mean has nothing of what would fold into a level, as a harmonic of the mains at the new rate, and all that the
    samples know of a slow law beneath white noise.
    """
    every = int(min(run.points(record.time) // SAMPLES_A_CYCLE, record.rate // LEAST_RATE))
    if every < 2:
        return record, run

    def means(values: Array) -> Array:
        whole = values[: values.size // every * every]
        return np.asarray(whole.reshape(-1, every).mean(axis=1))

    channels: dict[str, Any] = {
        name: means(values) for name, values in vars(record).items() if isinstance(values, np.ndarray)
    }
    fewer = replace(record, **channels)
    found = cycles(fewer.time, fewer.displacement)
    return (record, run) if found is None else (fewer, found)


def temperature_moves(temperature: Array | None, by: float = MOVING_TEMPERATURE) -> bool:
    """Whether a temperature (n,) changes by so much [K] from beginning to end; False where none was recorded."""
    return temperature is not None and float(np.ptp(end_temperatures(temperature))) > by


def end_temperatures(temperature: Array) -> tuple[float, float]:
    """Return the temperature [degC] at the beginning and at the end of a test, with noise averaged out."""
    tenth = max(temperature.size // 10, 1)
    return float(np.median(temperature[:tenth])), float(np.median(temperature[-tenth:]))


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


def _with_lead(moved: Record, early: Array, motion: Motion) -> Record:
    """Put one cycle of the motion in front, with the first value of every other channel."""

    def longer(channel: Array | None) -> Array | None:
        return None if channel is None else np.concatenate([np.full(early.size, channel[0]), channel])

    return Record(
        moved.name,
        moved.setting,
        np.concatenate([early, moved.time]),
        np.concatenate([motion[0], moved.displacement]),
        np.concatenate([motion[1], moved.velocity]),
        np.concatenate([motion[2], moved.acceleration]),
        np.concatenate([np.full(early.size, moved.force[0]), moved.force]),
        longer(moved.voltage),
        longer(moved.temperature),
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
