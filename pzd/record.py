"""One rig record in SI units, and the grouping of records into conditions.

A record whose control signal stands still belongs to a condition: records of one setting at one voltage and one
temperature. Glitches of up to three samples are left out wherever a voltage is judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pzd.parallel.on_disk import beside, let_go, one_at_a_time

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Complex = NDArray[np.complex128]
Rows = NDArray[np.intp]
"""Array types of all of pzd: real numbers, masks over samples, complex numbers, and indices of samples."""

CONSTANT_SHARE = 0.02
"""Largest r.m.s. of a constant voltage about its median, as a share of the scale: a supply scatters by less."""
DIFFERENT_SHARE = 0.1
"""Least difference of two voltages set on purpose, as a share of the scale: a supply scatters by a few hundredths."""
SAME_TEMPERATURE = 2.0
"""Largest spread of temperature in one condition [K], unless the config says otherwise."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation: robust, whatever a few samples do."""
_EQUAL_GAPS = 1e-9
"""Relative difference below which two gaps are equal but for rounding."""
_EVEN = 1e-3
"""Relative scatter below which time steps are even: that of a clock in microseconds at 1 kHz."""

Labels = tuple[str | None, float | None, float | None]
"""Setting, voltage [V] and temperature [degC] of a condition."""


@dataclass(frozen=True, eq=False)
class Record:
    """One test as recorded; every array is (n,), extension positive, in SI units and degC."""

    name: str
    setting: str | None
    time: Array
    displacement: Array
    velocity: Array
    acceleration: Array
    force: Array
    voltage: Array | None = None
    temperature: Array | None = None
    pressure: Array | None = None

    @cached_property
    def rate(self) -> float:
        """Sampling rate [Hz]: of the median time step, or of the mean usual step where a coarse clock rounds."""
        steps = np.diff(self.time)
        middle = float(np.median(steps))
        usual = steps[np.abs(steps - middle) <= 0.5 * middle]  # no gaps
        return float(1.0 / (middle if np.ptp(usual) <= _EVEN * middle else np.mean(usual)))

    def median_voltage(self) -> float | None:
        """Return the median voltage [V], None where none was recorded."""
        return None if self.voltage is None else float(np.median(without_ripple(self.voltage, self.time)))

    def median_temperature(self) -> float | None:
        """Return the median temperature [degC], None where none was recorded."""
        return None if self.temperature is None else float(np.median(self.temperature))


def sliced(record: Record, kept: Mask) -> Record:
    """Return the record at the samples where the mask (n,) is set."""
    channels: dict[str, Any] = {
        name: beside(values[kept], values) for name, values in vars(record).items() if isinstance(values, np.ndarray)
    }
    return replace(record, **channels)


def clock_fault(time: Array) -> tuple[int, str] | None:
    """Return the first sample at which a clock (n,) does not increase, and a message; None for a good clock."""
    wrong = np.flatnonzero(np.diff(time) <= 0.0)
    if not wrong.size:
        return None
    row = int(wrong[0]) + 1
    more = f", and {wrong.size - 1} more such rows" if wrong.size > 1 else ""
    return row, f"time does not increase: {time[row]:.9g} s after {time[row - 1]:.9g} s{more}"


@dataclass(frozen=True, eq=False)
class Condition:
    """Records of one setting taken at one constant voltage and one temperature."""

    setting: str | None
    voltage: float | None
    temperature: float | None
    records: tuple[Record, ...]

    @property
    def labels(self) -> Labels:
        """Setting, voltage [V] and temperature [degC]."""
        return self.setting, self.voltage, self.temperature


_AT_A_TIME = 65536
"""Samples of which the running median is taken at a time."""
_EXCHANGES = {
    5: ((0, 1), (3, 4), (0, 3), (1, 4), (1, 2), (2, 3), (1, 2)),
    7: ((0, 5), (0, 3), (1, 6), (2, 4), (0, 1), (3, 5), (2, 6), (2, 3), (3, 6), (4, 5), (1, 4), (1, 3), (3, 4)),
}
"""Pairs of a window that are put in order one after the other, by the width of the window: its middle one is the median
then. Source: Devillard 1998, Fast median search; ten times as fast over whole channels as a sort of each window."""


def running_median(values: Array, width: int) -> Array:
    """Return the medians (n - width + 1,) of the windows of 5 or 7 samples that lie within values (n,)."""
    found = np.empty(values.size - width + 1)
    for first in range(0, found.size, _AT_A_TIME):
        count = min(_AT_A_TIME, found.size - first)
        window = [values[first + place : first + place + count] for place in range(width)]
        for low, high in _EXCHANGES[width]:
            window[low], window[high] = np.minimum(window[low], window[high]), np.maximum(window[low], window[high])
        found[first : first + count] = window[width // 2]
    return found


def glitches(values: Array, deviation: Array | None = None) -> NDArray[np.int64]:
    """Find the glitches of a channel: up to three samples that jump away from their neighbours and back.

    A glitch deviates from the running median of seven samples by ten robust standard deviations of that deviation,
    by four times the steepest usual step of that median, and by 2 % of the usual range.

    Parameters
    ----------
    values : (n,) of any channel
    deviation : (n,) from the running median, where it is known

    Returns
    -------
    indices of the samples
    """
    away = deviation_from_median(values) if deviation is None else deviation
    deviation = np.abs(away)
    noise = MAD_TO_SIGMA * float(np.median(deviation))
    # Of the median, for glitches that come often would themselves be the steepest steps.
    steepest = float(np.percentile(np.abs(np.diff(values - away)), 99.0)) if values.size > 1 else 0.0
    low, high = np.percentile(values, (0.5, 99.5))
    least = max(10.0 * noise, 4.0 * steepest, 0.02 * float(high - low), 1e-300)
    rows: NDArray[np.int64] = np.flatnonzero(deviation > least)
    return rows


def deviation_from_median(values: Array) -> Array:
    """Return the deviation (n,) from the running median of seven samples, the ends continued by reflection."""
    half = 3
    if values.size <= 2 * half:
        return np.zeros_like(values)
    return values - running_median(np.pad(values, half, mode="reflect"), 2 * half + 1)


def without_glitches(values: Array) -> Array:
    """Return the samples of a channel without glitches of more than 2 % of its usual magnitude."""
    spread = float(np.ptp(values))
    if spread == 0.0:
        return values  # most control signals, and no median is needed for them
    usual = float(np.median(np.abs(values)))
    if spread <= CONSTANT_SHARE * usual:
        return values
    deviation = deviation_from_median(values)
    rows = glitches(values, deviation)
    rows = rows[np.abs(deviation[rows]) > CONSTANT_SHARE * usual]
    return np.delete(values, rows) if rows.size else values


RIPPLE_SHARE = 0.1
"""Largest r.m.s. of a ripple about a constant voltage, as a share of it.

Reason: drivers of coils chop their current by a few hundredths; more is set on purpose."""
RIPPLE_WITHIN = 0.1
"""Time over which a ripple cancels [s]: some periods of the mains and thousands of a chopper, little of a motion."""


def without_ripple(voltage: Array, time: Array) -> Array:
    """Return a voltage (n,) that ripples about a level as its means over pieces of time, (m,); any other as it is.

    The median of a current that a driver chops is one of its two values, and by chance which.
    """
    middle = float(np.median(voltage))
    spread = float(np.sqrt(np.mean((without_glitches(voltage) - middle) ** 2)))
    if not CONSTANT_SHARE * abs(middle) < spread <= RIPPLE_SHARE * abs(middle):
        return voltage
    _, pieces, count = np.unique(np.floor((time - time[0]) / RIPPLE_WITHIN), return_inverse=True, return_counts=True)
    return np.asarray(np.bincount(pieces, voltage) / count)


def mid_stroke(displacements: Iterable[Array]) -> float:
    """Return the middle of the range of displacement that several tests cover [m], each (n,) as recorded."""
    ends = [end(displacement) for displacement in displacements for end in (np.min, np.max)]
    return 0.5 * float(min(ends) + max(ends))


def voltage_scale(records: Iterable[Record]) -> float:
    """Return the larger of the rig's voltage span and largest magnitude [V], without glitches; 0 without voltages."""
    extremes = [
        (float(voltage.min()), float(voltage.max()))
        for record in one_at_a_time(records)
        if record.voltage is not None
        for voltage in (without_glitches(record.voltage),)
    ]
    if not extremes:
        return 0.0
    low, high = min(e[0] for e in extremes), max(e[1] for e in extremes)
    return max(high - low, abs(low), abs(high))


def distinct(records: Sequence[Record]) -> tuple[Record, ...]:
    """Return the records without copies of another: a test that was saved twice says no more than once."""
    found: dict[tuple[object, ...], Record] = {}
    for record in one_at_a_time(records):
        voltage, temperature = record.median_voltage(), record.median_temperature()
        motion = (record.displacement, record.velocity, record.force)
        samples = tuple(np.ascontiguousarray(values).tobytes() for values in motion)
        found.setdefault((record.setting, voltage, temperature, *map(hash, samples)), record)
    return tuple(found.values())


def is_constant(record: Record, scale: float) -> bool:
    """Tell whether the voltage stands still: r.m.s. about the median within 2 % of the scale.

    Glitches are left out, and what ripples about a level faster than a damper moves.
    """
    if record.voltage is None:
        return True
    steady = without_ripple(record.voltage, record.time)
    deviation = without_glitches(steady) - np.median(steady)
    return bool(np.sqrt(np.mean(deviation**2)) <= CONSTANT_SHARE * scale)


def conditions(
    records: Sequence[Record], voltage_within: float | None = None, temperature_within: float = SAME_TEMPERATURE
) -> tuple[tuple[Condition, ...], tuple[Record, ...]]:
    """Group the records of constant voltage into conditions, and return those of moving voltage apart.

    Parameters
    ----------
    records : the rig's records, of any setting
    voltage_within : largest spread of voltage inside one condition [V]; None for 2 % of the scale
    temperature_within : largest spread of temperature inside one condition [degC]

    Returns
    -------
    conditions sorted by setting, voltage and temperature; and the records whose voltage moves
    """
    scale = voltage_scale(records)
    within = CONSTANT_SHARE * scale if voltage_within is None else voltage_within
    still = [r for r in one_at_a_time(records) if is_constant(r, scale)]
    groups: list[tuple[str | None, list[Record]]] = []
    for setting in sorted({r.setting for r in still}, key=lambda s: s or ""):
        of_setting = [r for r in still if r.setting == setting]
        for at_voltage in _bands(of_setting, [r.median_voltage() for r in one_at_a_time(of_setting)], within):
            bands = _bands(at_voltage, [r.median_temperature() for r in one_at_a_time(at_voltage)], temperature_within)
            groups.extend((setting, members) for members in bands)
    found = [_condition(*group, (within, temperature_within)) for group in one_at_a_time(groups)]
    if len({each.labels for each in found}) < len(found):  # rounding has made two labels equal: round less
        found = [_condition(*group, (0.0, 0.0)) for group in groups]
    let_go()
    constant = {id(r) for r in still}
    return tuple(found), tuple(r for r in records if id(r) not in constant)


def merged_voltages(records: Sequence[Record], voltage_within: float) -> tuple[float, float] | None:
    """Find the lowest and highest constant voltage where one condition would merge all of them though they differ.

    Parameters
    ----------
    records : the rig's records, of any setting
    voltage_within : largest spread of voltage inside one condition [V]

    Returns
    -------
    both [V]; None where there are several conditions, or where the voltages scatter about one
    """
    scale = voltage_scale(records)
    voltages = [r.median_voltage() for r in one_at_a_time(records) if is_constant(r, scale)]
    known = [voltage for voltage in voltages if voltage is not None]
    spread = max(known) - min(known) if known else 0.0
    return (min(known), max(known)) if DIFFERENT_SHARE * scale < spread <= voltage_within else None


def _median_level(values: Array, finest: float) -> float:
    """Return the median of a constant channel without the digits that its noise makes.

    Parameters
    ----------
    values : (n,) of one condition
    finest : smallest difference that separates conditions [unit of the values]

    Returns
    -------
    the median, rounded to the largest power of ten within both the robust standard deviation and a tenth of `finest`;
    unrounded where most samples are equal
    """
    middle = float(np.median(values))
    step = min(MAD_TO_SIGMA * float(np.median(np.abs(values - middle))), 0.1 * finest)
    return round(middle, -math.floor(math.log10(step))) + 0.0 if step > 0.0 else middle


def _condition(setting: str | None, members: Sequence[Record], finest: tuple[float, float]) -> Condition:
    """Make a condition of equal records; `finest` is the smallest difference of voltage and temperature that counts."""
    voltages = [without_ripple(r.voltage, r.time) for r in members if r.voltage is not None]
    temperatures = [r.temperature for r in members if r.temperature is not None]
    return Condition(
        setting,
        _median_level(np.concatenate(voltages), finest[0]) if voltages else None,
        _median_level(np.concatenate(temperatures), finest[1]) if temperatures else None,
        tuple(members),
    )


def _bands(records: Sequence[Record], labels: Sequence[float | None], within: float) -> list[list[Record]]:
    """Split records into bands of labels no wider than `within`, lowest first; those without a label come first."""
    unknown = [record for record, label in zip(records, labels, strict=True) if label is None]
    known = sorted(((label, i) for i, label in enumerate(labels) if label is not None), key=lambda one: one[0])
    parts = _split_at_widest_gaps(np.array([label for label, _ in known]), within) if known else []
    bands = [[records[i] for _, i in known[part]] for part in parts]
    return [unknown, *bands] if unknown else bands


def _split_at_widest_gaps(rising: Array, within: float) -> list[slice]:
    """Cut (n,) rising numbers into ranges no wider than `within`, at the widest, of equal gaps at the middlemost."""
    if rising[-1] - rising[0] <= within:
        return [slice(0, rising.size)]
    gaps = np.diff(rising)
    widest = np.flatnonzero(gaps >= gaps.max() * (1.0 - _EQUAL_GAPS)) + 1
    cut = int(widest[np.argmin(np.abs(widest - 0.5 * rising.size))])
    above = (slice(cut + part.start, cut + part.stop) for part in _split_at_widest_gaps(rising[cut:], within))
    return [*_split_at_widest_gaps(rising[:cut], within), *above]
